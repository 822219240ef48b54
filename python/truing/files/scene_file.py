# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Scene files: scene.yaml (format truing-scene/1), what a robot must not touch, and what of it must not."""

from __future__ import annotations

import math
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import PlainValidator

from truing import _core
from truing.errors import InputError
from truing.files.common import PathLike, shown
from truing.files.yaml_tree import (
    AngleName,
    Document,
    LengthName,
    Loc,
    Number,
    Strict,
    Text,
    Vector3,
    choice,
    expected,
)

SCENE_FORMAT = "truing-scene/1"
_KIND = "scene file"
_ZERO = (Decimal(0), Decimal(0), Decimal(0))
_LARGEST_ROOM = 1000.0  # [m]


def _name_pair(value: object) -> tuple[str, str]:
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(isinstance(name, str) and name for name in value)
    ):
        raise expected(value, "a pair of names, [forearm, table]")
    return value[0], value[1]


class _UnitsOfFile(Strict):
    length: LengthName
    angle: AngleName = "rad"


class _Obstacle(Strict):
    name: Text
    shape: Annotated[Literal["sphere", "capsule", "box"], PlainValidator(choice("sphere", "capsule", "box"))]
    xyz: Vector3
    rpy: Vector3 = _ZERO
    size: Vector3 | None = None
    length: Number | None = None
    radius: Number | None = None


class _Capsule(Strict):
    name: Text
    link: Text
    start: Vector3
    end: Vector3
    radius: Number


class _SceneFile(Strict):
    format: Text
    units: _UnitsOfFile
    obstacles: list[_Obstacle] = []
    capsules: list[_Capsule] = []
    clearance: Number = Decimal(0)
    ignored: list[Annotated[tuple[str, str], PlainValidator(_name_pair)]] = []


# What each shape needs, and what it has not.
_SIZES = {"sphere": ("radius",), "capsule": ("radius", "length"), "box": ("size",)}


def load_scene(path: PathLike, robot: _core.Robot) -> _core.Scene:
    """Read a scene for `robot` from YAML.

    Raises InputError that names the file, the line, what was found and what was expected.
    """
    document = Document.read(Path(path), _KIND)
    if "format" not in document.value:
        document.refuse((), f"key 'format' is missing: a scene file starts with `format: {SCENE_FORMAT}`")
    if document.value["format"] != SCENE_FORMAT:
        document.refuse(
            ("format",), f"found {shown(str(document.value['format']))}, expected {SCENE_FORMAT!r}"
        )
    model = document.validated(_SceneFile)
    for k, obstacle in enumerate(model.obstacles):
        _require_sizes(document, ("obstacles", k), obstacle)
    _check_names(document, model, robot)
    to_metres = 0.001 if model.units.length == "mm" else 1.0
    _check_lengths(document, model, to_metres)
    scene = _core.Scene(
        obstacles=[_obstacle(obstacle, model.units.angle, to_metres) for obstacle in model.obstacles],
        capsules=[
            _core.LinkCapsule(
                c.name,
                link=c.link,
                start=_point(c.start, to_metres),
                end=_point(c.end, to_metres),
                radius=float(c.radius) * to_metres,
            )
            for c in model.capsules
        ],
        clearance=float(model.clearance) * to_metres,
        ignored=model.ignored,
    )
    try:
        _core.validate_scene(scene, robot)
    except ValueError as error:
        raise InputError(f"{document.path}: {error}") from None
    return scene


def _point(
    values: tuple[Decimal, Decimal, Decimal], scale: float
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([float(value) for value in values]) * scale


def _obstacle(o: _Obstacle, angle: str, to_metres: float) -> _core.Obstacle:
    rpy = _point(o.rpy, math.pi / 180.0 if angle == "deg" else 1.0)
    size = np.zeros(3)
    if o.size is not None:
        size = _point(o.size, to_metres)
    elif o.length is not None:
        size[2] = float(o.length) * to_metres
    return _core.Obstacle(
        o.name,
        shape=o.shape,
        T_measurement_shape=_core.frame_from_xyz_rpy(_point(o.xyz, to_metres), rpy),
        size=size,
        radius=0.0 if o.radius is None else float(o.radius) * to_metres,
    )


def _require_sizes(document: Document, loc: Loc, obstacle: _Obstacle) -> None:
    needed = _SIZES[obstacle.shape]
    for key in ("size", "length", "radius"):
        value = getattr(obstacle, key)
        if key in needed and value is None:
            document.refuse(loc, f"key {key!r} is missing: a {obstacle.shape} has {' and '.join(needed)}")
        if key not in needed and value is not None:
            document.refuse((*loc, key), f"a {obstacle.shape} has no {key}, it has {' and '.join(needed)}")
        if value is not None and min(value if isinstance(value, tuple) else (value,)) <= 0:
            document.refuse((*loc, key), "expected more than zero")


def _check_names(document: Document, model: _SceneFile, robot: _core.Robot) -> None:
    """Equal names, links that the robot does not have, pairs of what is not there: each with its line."""
    taken: dict[str, Loc] = {}
    names: list[tuple[str, Loc]] = [
        (obstacle.name, ("obstacles", k, "name")) for k, obstacle in enumerate(model.obstacles)
    ]
    names += [(capsule.name, ("capsules", k, "name")) for k, capsule in enumerate(model.capsules)]
    for name, loc in names:
        if name in taken:
            document.refuse(
                loc,
                f"the name {shown(name)} is there twice (first in line {document.line(taken[name])}):"
                " rename one",
            )
        taken[name] = loc
    links = ["base", *(joint.name for joint in robot.joints), "tool"]
    for k, capsule in enumerate(model.capsules):
        if capsule.link not in links:
            document.refuse(
                ("capsules", k, "link"),
                f"there is no link {shown(capsule.link)}; the links are {', '.join(links)}",
            )
        if capsule.radius <= 0:
            document.refuse(("capsules", k, "radius"), "expected more than zero")
    for k, pair in enumerate(model.ignored):
        for name in pair:
            if name not in taken:
                document.refuse(("ignored", k), f"there is no {shown(name)}; there are {', '.join(taken)}")


def _check_lengths(document: Document, model: _SceneFile, to_metres: float) -> None:
    """Millimetres in a file that says metres."""
    if model.clearance < 0:
        document.refuse(("clearance",), f"found {model.clearance}, expected zero or more")
    for part, entries in (("obstacles", model.obstacles), ("capsules", model.capsules)):
        for k, entry in enumerate(entries):
            for key in ("xyz", "size", "length", "radius", "start", "end"):
                value = getattr(entry, key, None)
                numbers = () if value is None else value if isinstance(value, tuple) else (value,)
                if any(abs(float(number)) * to_metres > _LARGEST_ROOM for number in numbers):
                    document.refuse(
                        (part, k, key),
                        f"is more than {_LARGEST_ROOM:g} m: it looks like millimetres; write units: {{length:"
                        " mm}, or this value in metres",
                    )
