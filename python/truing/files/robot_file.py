# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot files: robot.yaml (format truing-robot/1), URDF, MJCF, and those of controllers.

A number in a file is read with all its digits, converted once and rounded once; it is written with as few
digits as lead back to the same double. So a saved robot loads bit for bit, in any unit. Frames are written as
xyz and rpy: their rotation comes back bit for bit if it was made from rpy, else to 1e-15.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from decimal import Context, Decimal
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from truing import _core
from truing.errors import InputError, InputWarning, did_you_mean
from truing.files.abb_file import robot_from_moc
from truing.files.arms import ARMS
from truing.files.common import PathLike, Units, atomic_write, decoded, listed, read_bytes, shown
from truing.files.controller_parts import ControllerModel, split_arm, unknown_arm
from truing.files.lerobot_calibration import robot_from_lerobot
from truing.files.mjcf_file import is_mjcf, robot_from_mjcf
from truing.files.ur_file import robot_from_calibration_conf, robot_from_urp
from truing.files.yaml_tree import (
    LARGEST_YAML,
    LONGEST_NAME,
    NAME,
    AngleName,
    Document,
    FreeMapping,
    Inertia,
    LengthName,
    Limits,
    Loc,
    MassName,
    Number,
    Range,
    Strict,
    Text,
    Vector3,
    choice,
)

FORMAT = "truing-robot/1"
_KIND = "robot file"
_LARGEST_URDF = 64_000_000
MOST_JOINTS = 200
_URDF_SUFFIXES = (".urdf", ".xml", ".xacro")
_CONTROLLER_SUFFIXES = (".conf", ".urp", ".cfg", ".json")
_TOOL = "tool"
# Parameters are called after joints and targets (J2.a, tool.x), and these two are taken (base.x,
# anchor.zero).
_KEPT_NAMES = ("base", "anchor")

_ZERO = (Decimal(0), Decimal(0), Decimal(0))
_EXACT = Context(prec=60, Emax=10**6, Emin=-(10**6), traps=[])
_RADIANS_PER_DEGREE = _EXACT.divide(
    Decimal("3.14159265358979323846264338327950288419716939937510582097494459"), Decimal(180)
)
_SI = Decimal(1)
_SI_PER_LENGTH = {"m": _SI, "mm": Decimal("0.001")}
_SI_PER_ANGLE = {"rad": _SI, "deg": _RADIANS_PER_DEGREE}


# ---- The file's models ---------------------------------------------------------------------------


class _UnitsOfFile(Strict):
    length: LengthName
    angle: AngleName
    mass: MassName


class _Frame(Strict):
    xyz: Vector3
    rpy: Vector3 = _ZERO


_AT_ORIGIN = _Frame.model_construct(xyz=_ZERO, rpy=_ZERO)


class _Joint(Strict):
    name: Text
    type: Annotated[Literal["revolute", "prismatic"], PlainValidator(choice("revolute", "prismatic"))]
    ratio: Number = Decimal(1)
    offset: Number = Decimal(0)
    driven_by: dict[str, Number] | None = None
    limits: Limits = None
    mass: Number | None = None
    com: Vector3 = _ZERO
    inertia: Inertia | None = None
    torque_per_ampere: Number | None = None
    rotor_inertia: Number = Decimal(0)
    speed_limit: Number | None = None
    torque_limit: Number | None = None


class _LinkJoint(_Joint):
    theta: Number
    d: Number
    a: Number
    alpha: Number
    beta: Number = Decimal(0)


class _UrdfJoint(_Joint):
    xyz: Vector3
    rpy: Vector3 = _ZERO
    axis: Vector3


class _Effect(Strict):
    effect: Text
    joints: list[Text] = []
    parameters: dict[str, Number]


class _Anchor(Strict):
    xyz: Vector3
    zero: Number = Decimal(0)


class _RobotFile(Strict):
    format: Text
    name: Text = ""
    units: _UnitsOfFile
    convention: Annotated[Literal["dh", "mdh", "urdf"], PlainValidator(choice("dh", "mdh", "urdf"))]
    gravity: Vector3 = (Decimal(0), Decimal(0), Decimal("-9.81"))
    base: _Frame = _AT_ORIGIN
    tool: _Frame = _AT_ORIGIN
    targets: dict[str, _Frame] = {}
    effects: list[_Effect] = []
    torque_effects: list[_Effect] = []
    fitted_range: dict[str, Range] = {}
    anchor: _Anchor | None = None
    calibration: FreeMapping = {}


class _LinkTable(_RobotFile):
    joints: Annotated[list[_LinkJoint], Field(min_length=1, max_length=MOST_JOINTS)]


class _UrdfChain(_RobotFile):
    joints: Annotated[list[_UrdfJoint], Field(min_length=1, max_length=MOST_JOINTS)]


# ---- Reading -------------------------------------------------------------------------------------


def load_robot(
    path: PathLike,
    base_link: str = "",
    tip_link: str = "",
    *,
    any_tool: bool = False,
    arm: str = "",
    known: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> _core.Robot:
    """Read a robot from robot.yaml, URDF (.urdf, .xml), MJCF (.xml; needs MuJoCo: truing[dynamics]), or from
    a controller's file: calibration.conf or .urp of Universal Robots, MOC.cfg of ABB, LeRobot's calibration
    JSON.

    `base_link` and `tip_link` choose the chain of a URDF, or of an MJCF (bodies; the tip may be a site);
    empty: its only root and its only leaf. any_tool: of a URDF whose joints form one chain the tip need not
    be named, however many links are fixed to the last one; the tool is then that link (torques know none).
    arm: of a controller's file, see `load_controller`; also behind an @ of `path`, "calibration.conf@ur10e".
    known: names that effects of a robot.yaml may have, by its key (`effects`, `torque_effects`), where those
    of one's own are not taken.
    Warns (InputWarning) of what an MJCF has and a robot does not: contacts, moving branches; and of what a
    controller's file says that changes how its robot is to be calibrated.
    Raises InputError that names the file, the line, what was found and what was expected.
    """
    path, arm = split_arm(os.fspath(path), arm)
    if path.suffix.lower() in _CONTROLLER_SUFFIXES:
        model = load_controller(path, arm, base_link, tip_link)
        for text in model.warnings:
            warnings.warn(text, InputWarning, stacklevel=2)
        return model.robot
    if arm:
        raise InputError(
            f"{path}: an arm is named for files of controllers ({listed(_CONTROLLER_SUFFIXES)}), and this is"
            " none"
        )
    if path.suffix.lower() in _URDF_SUFFIXES:
        if is_mjcf(path):
            robot = robot_from_mjcf(path, base_link, tip_link)
        else:
            robot = _from_urdf(path, base_link, tip_link, any_tool)
        _check_lengths_of_names(path, robot)
        return robot
    if base_link or tip_link:
        raise InputError(
            f"{path}: base and tip links choose a chain from URDF or MJCF, and this is not one (.urdf, .xml)"
        )
    document, model_of_file = _read(path)
    _check_names(document, model_of_file)
    _check_joints(document, model_of_file)
    _check_effects(document, model_of_file, known)
    _check_units_look_right(document, model_of_file)
    try:
        robot = _to_robot(model_of_file, path.stem)
        _core.validate_robot(robot)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    _check_values(document, robot)
    return robot


def load_controller(
    path: PathLike, arm: str = "", base_link: str = "", tip_link: str = ""
) -> ControllerModel:
    """The robot that a controller believes in, and what its file says besides.

    path: calibration.conf or .urp of Universal Robots, MOC.cfg of ABB, LeRobot's calibration JSON; with the
    arm behind an @, if it is not given. arm: a data sheet ("ur10e"; `truing.files.arms.ARMS`), or a robot
    file that has the links (a URDF beside LeRobot's calibration; its only one need not be named). base_link,
    tip_link: of a URDF beside. Raises InputError.
    """
    path, arm = split_arm(os.fspath(path), arm)
    suffix = path.suffix.lower()
    if suffix == ".conf":
        return robot_from_calibration_conf(path, arm)
    if suffix == ".urp":
        return robot_from_urp(path, arm)
    is_file = bool(arm) and arm.lower() not in ARMS
    if suffix == ".cfg":
        beside = _beside(path, arm, base_link, tip_link) if is_file else None
        return robot_from_moc(path, arm, beside)
    if suffix == ".json":
        name = arm if is_file else str(_only_urdf(path, arm))
        return robot_from_lerobot(path, _beside(path, name, base_link, tip_link), Path(name).name)
    raise InputError(f"{path}: is no file of a controller, expected {listed(_CONTROLLER_SUFFIXES)}")


def is_controller(path: PathLike) -> bool:
    """Whether a robot file is one of a controller's, by its ending."""
    return split_arm(os.fspath(path))[0].suffix.lower() in _CONTROLLER_SUFFIXES


def any_robot(path: PathLike, arm: str = "", base_link: str = "", tip_link: str = "") -> ControllerModel:
    """A robot from any of its files, a controller's or not, with what the file says besides. Raises
    InputError.
    """
    file, name = split_arm(os.fspath(path), arm)
    if file.suffix.lower() in _CONTROLLER_SUFFIXES:
        return load_controller(file, name, base_link, tip_link)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", InputWarning)
        robot = load_robot(file, base_link, tip_link)
    masses = sum(joint.mass is not None for joint in robot.joints)
    return ControllerModel(
        robot=robot,
        kind={".urdf": "URDF", ".xml": "URDF or MJCF"}.get(file.suffix.lower(), "robot file"),
        arm=robot.name,
        understood=(
            ("convention", robot.convention),
            ("joints", f"{len(robot.joints)}, {robot.driven_count} of them with a reading"),
            ("masses", f"of {masses} links"),
            ("effects", listed([effect.effect for effect in robot.effects]) or "none"),
        ),
        warnings=tuple(str(warning.message) for warning in heard),
        calibration=load_calibration(file),
    )


def _beside(path: Path, arm: str, base_link: str, tip_link: str) -> _core.Robot:
    """The robot file that is named beside a controller's file: from here, or from that file's folder."""
    places = [Path(arm), path.parent / arm]
    found = next((place for place in places if place.exists()), None)
    if found is None or found.suffix.lower() in _CONTROLLER_SUFFIXES:
        raise unknown_arm(path, arm, beside="robot.yaml")
    return load_robot(found, base_link, tip_link)


def _only_urdf(path: Path, arm: str) -> Path:
    if arm:
        raise InputError(f"{path}: {arm} is no arm of such servos, expected its URDF ({path.name}@arm.urdf)")
    files = sorted(path.parent.glob("*.urdf"))
    if len(files) != 1:
        raise InputError(
            f"{path}: holds counts of servos and no links: name the URDF of the arm ({path.name}@arm.urdf);"
            f" beside it are {len(files)} URDFs"
        )
    return files[0]


def is_urdf(path: PathLike) -> bool:
    """Whether a robot file is a URDF: neither robot.yaml nor MJCF nor a controller's."""
    file, arm = split_arm(os.fspath(path))
    return not arm and file.suffix.lower() in _URDF_SUFFIXES and not is_mjcf(file)


def load_units(path: PathLike) -> Units:
    """The units that a robot file is written in; those of URDF and MJCF are always m and rad."""
    path, _ = split_arm(os.fspath(path))
    if path.suffix.lower() in (*_URDF_SUFFIXES, *_CONTROLLER_SUFFIXES):
        return Units()
    units = _read(path)[1].units
    return Units(length=units.length, angle=units.angle)


def load_calibration(path: PathLike) -> dict[str, Any]:
    """The `calibration:` mapping of a robot file (source, date, rms_m ...); empty if it has none."""
    path, arm = split_arm(os.fspath(path))
    if path.suffix.lower() in _CONTROLLER_SUFFIXES:
        return dict(load_controller(path, arm).calibration)
    if path.suffix.lower() in _URDF_SUFFIXES:
        return {}
    plain: dict[str, Any] = _without_decimals(_read(path)[1].calibration)
    return plain


def _without_decimals(value: Any) -> Any:
    if isinstance(value, Decimal):
        exponent = value.as_tuple().exponent
        return int(value) if exponent == 0 else float(value)
    if isinstance(value, dict):
        return {key: _without_decimals(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_decimals(item) for item in value]
    return value


def _from_urdf(path: Path, base_link: str, tip_link: str, any_tool: bool) -> _core.Robot:
    text = decoded(path, read_bytes(path, _LARGEST_URDF))
    if not text.strip():
        raise InputError(f"{path}: is empty, expected a URDF")
    if "<xacro:" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):  # what xacro wrote may quote its source
        raise InputError(
            f"{path}: is a xacro, expected a URDF: `xacro {path.name} > robot.urdf` (ROS) writes one"
        )
    try:
        if any_tool and not tip_link:
            tip_link = _core.last_moving_link(text, base_link)
        robot = _core.robot_from_urdf(text, base_link, tip_link)
        off_chain = _core.links_off_chain(text, base_link, tip_link) if any_tool else []
    except ValueError as error:
        # The parser quotes the file, line ends and all.
        raise InputError(f"{path}: {' '.join(str(error).split())[:1000]}") from None
    if off_chain:
        warnings.warn(
            f"{path}: moves off the chain, its mass merged as it stands at zero: {listed(off_chain, 6)}",
            InputWarning,
            stacklevel=4,
        )
    return robot


def _check_lengths_of_names(path: Path, robot: _core.Robot) -> None:
    for name in (robot.name, *(joint.name for joint in robot.joints)):
        if len(name) > LONGEST_NAME:
            raise InputError(f"{path}: found {shown(name)}, expected {NAME}")


def _read(path: Path) -> tuple[Document, _LinkTable | _UrdfChain]:
    text = decoded(path, read_bytes(path, LARGEST_YAML))
    if text.lstrip().startswith("<"):
        raise InputError(
            f"{path}: is XML, expected a {_KIND}: the name of a URDF ends in .urdf, of an MJCF in .xml"
        )
    document = Document(path, text, _KIND)
    if "format" not in document.value:
        document.refuse((), f"key 'format' is missing: a robot file starts with `format: {FORMAT}`")
    if document.value["format"] != FORMAT:
        document.refuse(("format",), f"found {shown(str(document.value['format']))}, expected {FORMAT!r}")
    if document.value.get("convention") == "urdf":
        return document, document.validated(_UrdfChain)
    return document, document.validated(_LinkTable)


def _check_names(document: Document, model: _LinkTable | _UrdfChain) -> None:
    taken: dict[str, Loc] = {_TOOL: ("tool",)}
    places: list[tuple[str, Loc]] = [
        (joint.name, ("joints", i, "name")) for i, joint in enumerate(model.joints)
    ]
    places += [(name, ("targets", name)) for name in model.targets]
    for name, loc in places:
        if len(name) > LONGEST_NAME:
            document.refuse(loc, f"found {shown(name)}, expected {NAME}")
        if name in _KEPT_NAMES:
            document.refuse(
                loc, f"the name {name!r} is kept for parameters such as base.x and anchor.zero: rename it"
            )
        if name in taken:
            line = document.line(taken[name])
            first = f"in line {line}" if line else "of the tool frame"
            document.refuse(loc, f"the name {shown(name)} is there twice (first {first}): rename one")
        taken[name] = loc


def _check_joints(document: Document, model: _LinkTable | _UrdfChain) -> None:
    names = [joint.name for joint in model.joints]
    drivers = {joint.name: list(joint.driven_by or ()) for joint in model.joints}
    for i, joint in enumerate(model.joints):
        loc: Loc = ("joints", i)
        if joint.mass is not None and joint.mass < 0:
            document.refuse((*loc, "mass"), f"found {joint.mass}, expected zero or more")
        if joint.ratio == 0:
            document.refuse(
                (*loc, "ratio"),
                "found 0, expected the joint's gear ratio relative to the nominal one, near 1",
            )
        _check_drive(document, joint, loc)
        if isinstance(joint, _UrdfJoint):
            length = math.sqrt(sum(float(value) ** 2 for value in joint.axis))
            if abs(length - 1.0) > 1e-6:
                document.refuse(
                    (*loc, "axis"),
                    f"has length {length:.6g}, expected a unit vector: divide it by its length",
                )
        if joint.driven_by is None:
            continue
        if not joint.driven_by:
            document.refuse(
                (*loc, "driven_by"),
                "is empty, expected {joint: factor}; leave it out for a joint with a reading",
            )
        if joint.ratio != 1:
            document.refuse(
                (*loc, "ratio"), "a passive joint has no reading that a ratio could act on: remove it"
            )
        for driver in joint.driven_by:
            if driver not in drivers:
                document.refuse(
                    (*loc, "driven_by", driver), f"there is no such joint; the joints are {listed(names)}"
                )
        circle = _circle(joint.name, drivers)
        if circle:
            document.refuse(
                (*loc, "driven_by"),
                f"goes round in a circle ({' -> '.join(circle)}): one of them must have a reading",
            )


def _check_drive(document: Document, joint: _Joint, loc: Loc) -> None:
    if joint.rotor_inertia < 0:
        document.refuse(
            (*loc, "rotor_inertia"), f"found {joint.rotor_inertia}, expected zero or more (kg m^2)"
        )
    if joint.torque_per_ampere == 0:
        document.refuse(
            (*loc, "torque_per_ampere"),
            "found 0, expected Nm/A at the joint; leave it out if it is not known",
        )
    for key in ("speed_limit", "torque_limit"):
        value = getattr(joint, key)
        if value is not None and value <= 0:
            document.refuse((*loc, key), f"found {value}, expected more than zero; leave it out for none")


def _circle(start: str, drivers: Mapping[str, Sequence[str]]) -> list[str]:
    """A way along `drivers` from `start` back to it; empty if there is none."""
    came_from: dict[str, str] = {}
    waiting = [start]
    while waiting:
        name = waiting.pop()
        for driver in drivers.get(name, ()):
            if driver == start:
                way = [name]
                while way[-1] != start:
                    way.append(came_from[way[-1]])
                return [*reversed(way), start]
            if driver not in came_from:
                came_from[driver] = name
                waiting.append(driver)
    return []


def _check_effects(
    document: Document, model: _LinkTable | _UrdfChain, known: Mapping[str, Sequence[str]]
) -> None:
    names = [joint.name for joint in model.joints]
    for key, effects in (("effects", model.effects), ("torque_effects", model.torque_effects)):
        for i, effect in enumerate(effects):
            if key in known and effect.effect.partition("@")[0] not in known[key]:
                hint = did_you_mean(effect.effect, known[key])
                document.refuse(
                    (key, i, "effect"),
                    f"there is no effect {shown(effect.effect)}; {hint}there are {listed(known[key], 60)}",
                )
            for k, joint in enumerate(effect.joints):
                if joint not in names:
                    document.refuse(
                        (key, i, "joints", k),
                        f"there is no joint {shown(joint)}; the joints are {listed(names)}",
                    )


def _check_values(document: Document, robot: _core.Robot) -> None:
    """A value that an effect's law does not look at would do nothing."""
    for key, texts in (
        ("effects", _core.unknown_effect_values(robot)),
        ("torque_effects", _core.unknown_torque_values(robot)),
    ):
        for i, text in enumerate(texts):
            if text:
                document.refuse((key, i), text)


# ---- Do the numbers look like the unit that the file names? --------------------------------------


def _angles(model: _LinkTable | _UrdfChain) -> Iterator[tuple[Loc, Decimal]]:
    """Every angle of the file, limits excepted: a joint may well turn many times."""
    for i, joint in enumerate(model.joints):
        if isinstance(joint, _LinkJoint):
            yield from ((("joints", i, key), getattr(joint, key)) for key in ("theta", "alpha", "beta"))
        elif isinstance(joint, _UrdfJoint):
            yield from ((("joints", i, "rpy"), value) for value in joint.rpy)
        if joint.type == "revolute":
            yield ("joints", i, "offset"), joint.offset
    for loc, frame in _frames(model):
        yield from (((*loc, "rpy"), value) for value in frame.rpy)


def _lengths(model: _LinkTable | _UrdfChain) -> Iterator[tuple[Loc, Decimal]]:
    """Every length on the robot itself."""
    for i, joint in enumerate(model.joints):
        if isinstance(joint, _LinkJoint):
            yield from ((("joints", i, key), getattr(joint, key)) for key in ("d", "a"))
        elif isinstance(joint, _UrdfJoint):
            yield from ((("joints", i, "xyz"), value) for value in joint.xyz)
        if joint.type == "prismatic":
            yield ("joints", i, "offset"), joint.offset
    for loc, frame in _frames(model):
        if loc != ("base",):
            yield from (((*loc, "xyz"), value) for value in frame.xyz)


def _frames(model: _LinkTable | _UrdfChain) -> Iterator[tuple[Loc, _Frame]]:
    yield ("base",), model.base
    yield ("tool",), model.tool
    yield from ((("targets", name), frame) for name, frame in model.targets.items())


def _check_units_look_right(document: Document, model: _LinkTable | _UrdfChain) -> None:
    if model.units.angle == "rad":
        _refuse_degrees(document, model)
    else:
        _refuse_radians(document, model)
    if model.units.length == "m":
        _refuse_millimetres(document, model)
    else:
        _refuse_metres(document, model)


def _refuse_degrees(document: Document, model: _LinkTable | _UrdfChain) -> None:
    for loc, value in _angles(model):
        if abs(float(value)) > 2 * math.pi + 0.1:
            document.refuse(
                loc,
                f"{float(value):g} looks like degrees, but units says `angle: rad` and a link angle stays"
                " within one turn: change units to `angle: deg`, or this value",
            )
    for i, joint in enumerate(model.joints):
        limits = (joint.limits or ()) if joint.type == "revolute" else ()
        for limit in limits:
            if limit is not None and abs(limit) > 100:
                document.refuse(
                    ("joints", i, "limits"),
                    f"{float(limit):g} looks like degrees, but units says `angle: rad`: "
                    "change units to `angle: deg`, or these limits",
                )


def _refuse_radians(document: Document, model: _LinkTable | _UrdfChain) -> None:
    # Twists are multiples of a quarter turn on nearly every robot: 1.5708 and 3.1416 give radians away.
    twists = [
        (loc, float(value))
        for loc, value in _angles(model)
        if loc[-1] in ("alpha", "rpy") and loc[0] == "joints" and float(value) != 0.0
    ]
    quarters = [abs(value) / (math.pi / 2) for _, value in twists]
    if quarters and all(quarter < 2.002 and abs(quarter - round(quarter)) < 1e-3 for quarter in quarters):
        loc, value = twists[0]
        document.refuse(
            loc,
            f"{value:g} looks like radians (every {loc[-1]} of the file is 0 or a multiple of pi/2), but"
            " units says `angle: deg`: change units to `angle: rad`, or the angles",
        )


def _refuse_millimetres(document: Document, model: _LinkTable | _UrdfChain) -> None:
    for loc, value in _lengths(model):
        if abs(float(value)) > 50:
            document.refuse(
                loc,
                f"{float(value):g} looks like millimetres, but units says `length: m` and no link is that"
                " long: change units to `length: mm`, or this value",
            )


def _refuse_metres(document: Document, model: _LinkTable | _UrdfChain) -> None:
    reach = sum(abs(float(value)) for _, value in _lengths(model))
    if 0.0 < reach < 8.0 and len(model.joints) > 2:
        document.refuse(
            ("units",),
            f"all lengths of the robot add up to {reach:g} mm, which looks like metres: change units to "
            "`length: m`, or the lengths",
        )


# ---- File to robot -------------------------------------------------------------------------------


def _to_si(value: Decimal, si_per_unit: Decimal) -> float:
    return float(_EXACT.multiply(value, si_per_unit))


def _to_robot(model: _LinkTable | _UrdfChain, default_name: str) -> _core.Robot:
    length, angle = _SI_PER_LENGTH[model.units.length], _SI_PER_ANGLE[model.units.angle]

    def vector(values: Sequence[Decimal], si_per_unit: Decimal = _SI) -> NDArray[np.float64]:
        return np.array([_to_si(value, si_per_unit) for value in values])

    def frame(xyz: Sequence[Decimal], rpy: Sequence[Decimal]) -> NDArray[np.float64]:
        return _core.frame_from_xyz_rpy(vector(xyz, length), vector(rpy, angle))

    def joint(entry: _LinkJoint | _UrdfJoint) -> _core.Joint:
        own = angle if entry.type == "revolute" else length
        lower, upper = entry.limits or (None, None)
        fields: dict[str, Any] = {
            "name": entry.name,
            "type": entry.type,
            "ratio": float(entry.ratio),
            "offset": _to_si(entry.offset, own),
            "driven_by": [(driver, float(weight)) for driver, weight in (entry.driven_by or {}).items()],
            "lower": -math.inf if lower is None else _to_si(lower, own),
            "upper": math.inf if upper is None else _to_si(upper, own),
            "mass": None if entry.mass is None else float(entry.mass),
            "center_of_mass": vector(entry.com, length),
            "inertia": None if entry.inertia is None else _matrix(vector(entry.inertia)),
            "torque_per_ampere": (
                None if entry.torque_per_ampere is None else float(entry.torque_per_ampere)
            ),
            "rotor_inertia": float(entry.rotor_inertia),
            "speed_limit": math.inf if entry.speed_limit is None else _to_si(entry.speed_limit, own),
            "torque_limit": math.inf if entry.torque_limit is None else float(entry.torque_limit),
        }
        if isinstance(entry, _UrdfJoint):
            fields["T_parent_joint"] = frame(entry.xyz, entry.rpy)
            fields["axis"] = _unit(vector(entry.axis))
        else:
            fields.update((key, _to_si(getattr(entry, key), angle)) for key in ("theta", "alpha", "beta"))
            fields.update((key, _to_si(getattr(entry, key), length)) for key in ("d", "a"))
        return _core.Joint(**fields)

    def applied(entries: Sequence[_Effect]) -> list[_core.AppliedEffect]:
        return [
            _core.AppliedEffect(
                entry.effect, entry.joints, {name: float(value) for name, value in entry.parameters.items()}
            )
            for entry in entries
        ]

    targets = {_TOOL: model.tool, **model.targets}
    return _core.Robot(
        model.name or default_name,
        convention=model.convention,
        gravity=vector(model.gravity),
        T_measurement_base=frame(model.base.xyz, model.base.rpy),
        joints=[joint(entry) for entry in model.joints],
        targets=[_core.Target(name, frame(target.xyz, target.rpy)) for name, target in targets.items()],
        effects=applied(model.effects),
        torque_effects=applied(model.torque_effects),
        fitted_range={name: (float(low), float(high)) for name, (low, high) in model.fitted_range.items()},
        anchor=(
            None
            if model.anchor is None
            else _core.Anchor(vector(model.anchor.xyz, length), _to_si(model.anchor.zero, length))
        ),
    )


def _matrix(inertia: NDArray[np.float64]) -> NDArray[np.float64]:
    """[ixx, iyy, izz, ixy, ixz, iyz] as shape=(3, 3)."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _unit(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """`axis` of length one; untouched if it is so already, so that its digits stay."""
    norm = float(np.linalg.norm(axis))
    return axis if abs(norm - 1.0) <= 1e-12 else axis / norm


# ---- Robot to file -------------------------------------------------------------------------------


def save_robot(
    path: PathLike,
    robot: _core.Robot,
    *,
    units: Units | None = None,
    calibration: Mapping[str, Any] | None = None,
) -> None:
    """Write `robot` as robot.yaml, atomically. `units`: of the file, default m and rad; `calibration`: where
    the values come
    from (source, date, rms_m, covariance ...), kept as it is."""
    text = robot_to_yaml(robot, units=units, calibration=calibration)
    try:
        data = text.encode()
    except UnicodeEncodeError as error:
        raise InputError(
            f"{path}: a name holds {shown(error.object[error.start])}, which no text file can hold"
        ) from None
    with atomic_write(path) as temporary:
        temporary.write_bytes(data)


def robot_to_yaml(
    robot: _core.Robot, *, units: Units | None = None, calibration: Mapping[str, Any] | None = None
) -> str:
    """`robot` as the text of a robot.yaml. Raises InputError when the robot itself is not sound."""
    units = units or Units()
    try:
        _core.validate_robot(robot)
    except ValueError as error:
        raise InputError(f"robot {shown(robot.name)} cannot be written: {error}") from None
    if robot.targets[0].name != _TOOL:
        raise InputError(
            f"robot {shown(robot.name)} cannot be written: its first target is the tool and must be called "
            f"{_TOOL!r}, found {shown(robot.targets[0].name)}"
        )
    return _Writer(robot, units).text(calibration or {})


class _Writer:
    def __init__(self, robot: _core.Robot, units: Units) -> None:
        self._robot = robot
        self._units = units
        self._length = _SI_PER_LENGTH[units.length]
        self._angle = _SI_PER_ANGLE[units.angle]

    def text(self, calibration: Mapping[str, Any]) -> str:
        robot = self._robot
        convention = robot.convention
        lines = [
            f"format: {FORMAT}",
            f"name: {_quoted(robot.name or 'robot')}",
            f"units: {{length: {self._units.length}, angle: {self._units.angle}, mass: kg}}",
            f"convention: {convention}",
            f"gravity: {self._vector(robot.gravity, _SI)}",
        ]
        if not np.array_equal(robot.T_measurement_base, np.eye(4)):
            lines.append(f"base: {self._frame(robot.T_measurement_base)}")
        lines.append("joints:")
        lines += [f"  - {self._joint(joint, convention)}" for joint in robot.joints]
        lines.append(f"tool: {self._frame(robot.targets[0].T_last_target)}")
        if len(robot.targets) > 1:
            lines.append("targets:")
            lines += [
                f"  {_quoted(target.name)}: {self._frame(target.T_last_target)}"
                for target in robot.targets[1:]
            ]
        if robot.anchor is not None:
            zero = _digits(robot.anchor.zero, self._length)
            lines.append(f"anchor: {{xyz: {self._vector(robot.anchor.point, self._length)}, zero: {zero}}}")
        if robot.effects:
            lines.append("effects:  # values in SI units (rad, m, rad/Nm ...), whatever `units` says")
            lines += [f"  - {self._effect(effect)}" for effect in robot.effects]
        if robot.torque_effects:
            lines.append("torque_effects:  # values in SI units (Nm, Nm s/rad ...), whatever `units` says")
            lines += [f"  - {self._effect(effect)}" for effect in robot.torque_effects]
        if robot.fitted_range:
            lines.append(
                "fitted_range:  # of the inputs that the effects were fitted on (rad, m, kg, deg C, Hz)"
            )
            lines += [
                f"  {_quoted(name)}: {self._vector(ends, _SI)}" for name, ends in robot.fitted_range.items()
            ]
        if calibration:
            lines.append("calibration:")
            lines += [f"  {_quoted(str(key))}: {_flow(value)}" for key, value in calibration.items()]
        return "\n".join(lines) + "\n"

    def _joint(self, joint: _core.Joint, convention: str) -> str:
        kind = joint.type
        own = self._angle if kind == "revolute" else self._length
        parts = [f"name: {_quoted(joint.name)}", f"type: {kind}"]
        if convention == "urdf":
            parts.append(self._frame(joint.T_parent_joint)[1:-1])
            parts.append(f"axis: {self._vector(joint.axis, _SI)}")
        else:
            parts += [
                f"theta: {_digits(joint.theta, self._angle)}",
                f"d: {_digits(joint.d, self._length)}",
                f"a: {_digits(joint.a, self._length)}",
                f"alpha: {_digits(joint.alpha, self._angle)}",
            ]
            if not _is_plain_zero(joint.beta):
                parts.append(f"beta: {_digits(joint.beta, self._angle)}")
        # A passive joint has no reading for a ratio to act on.
        if joint.ratio != 1.0 and not joint.driven_by:
            parts.append(f"ratio: {_digits(joint.ratio, _SI)}")
        if not _is_plain_zero(joint.offset):
            parts.append(f"offset: {_digits(joint.offset, own)}")
        if joint.driven_by:
            drivers = ", ".join(
                f"{_quoted(name)}: {_digits(weight, _SI)}" for name, weight in joint.driven_by
            )
            parts.append(f"driven_by: {{{drivers}}}")
        if math.isfinite(joint.lower) or math.isfinite(joint.upper):
            limits = (
                _digits(value, own) if math.isfinite(value) else "null"
                for value in (joint.lower, joint.upper)
            )
            parts.append(f"limits: [{', '.join(limits)}]")
        if joint.mass is not None:
            parts.append(f"mass: {_digits(joint.mass, _SI)}")
        if not all(_is_plain_zero(value) for value in joint.center_of_mass):
            parts.append(f"com: {self._vector(joint.center_of_mass, self._length)}")
        parts += self._drive(joint, own)
        return f"{{{', '.join(parts)}}}"

    def _drive(self, joint: _core.Joint, own: Decimal) -> list[str]:
        parts = []
        if joint.inertia is not None:
            upper = [joint.inertia[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            parts.append(f"inertia: {self._vector(upper, _SI)}")
        if joint.torque_per_ampere is not None:
            parts.append(f"torque_per_ampere: {_digits(joint.torque_per_ampere, _SI)}")
        if joint.rotor_inertia != 0.0:
            parts.append(f"rotor_inertia: {_digits(joint.rotor_inertia, _SI)}")
        if math.isfinite(joint.speed_limit):
            parts.append(f"speed_limit: {_digits(joint.speed_limit, own)}")
        if math.isfinite(joint.torque_limit):
            parts.append(f"torque_limit: {_digits(joint.torque_limit, _SI)}")
        return parts

    def _effect(self, effect: _core.AppliedEffect) -> str:
        joints = ", ".join(_quoted(name) for name in effect.joints)
        parameters = ", ".join(
            f"{_quoted(name)}: {_digits(value, _SI)}" for name, value in effect.parameters.items()
        )
        return f"{{effect: {_quoted(effect.effect)}, joints: [{joints}], parameters: {{{parameters}}}}}"

    def _vector(self, values: Any, si_per_unit: Decimal) -> str:
        return f"[{', '.join(_digits(value, si_per_unit) for value in values)}]"

    def _frame(self, T: NDArray[np.float64]) -> str:
        rpy = self._rpy(np.array(T[:3, :3]))
        return f"{{xyz: {self._vector(T[:3, 3], self._length)}, rpy: [{', '.join(rpy)}]}}"

    def _rpy(self, rotation: NDArray[np.float64]) -> tuple[str, ...]:
        """The angles, as text, whose rotation is `rotation` bit for bit if there are such near by; else as
        near as angles get.
        """
        rpy = _core.rpy_from_rotation(rotation)
        nearest = tuple(_digits(value, self._angle) for value in rpy)
        # Someone wrote this rotation as rpy, most likely with few digits; or it was one of the neighbouring
        # doubles.
        short = (
            tuple(_rounded(value, self._angle, digits) for value in rpy) for digits in (6, 8, 10, 12, 14)
        )
        neighbours = itertools.product(
            *([_digits(value, self._angle) for value in _neighbours(value)] for value in rpy)
        )
        for texts in itertools.chain(short, [nearest], neighbours):
            angles = np.array([_to_si(Decimal(text), self._angle) for text in texts])
            if np.array_equal(_core.rotation_from_rpy(angles), rotation):
                return texts
        return nearest


def _neighbours(value: float, reach: int = 2) -> list[float]:
    values = [float(value)]
    below = above = float(value)
    for _ in range(reach):
        below, above = math.nextafter(below, -math.inf), math.nextafter(above, math.inf)
        values += [below, above]
    return values


def _is_plain_zero(value: float) -> bool:
    return value == 0.0 and math.copysign(1.0, value) > 0.0


def _digits(value: float, si_per_unit: Decimal) -> str:
    """The shortest number in the file's unit that reads back as exactly `value`."""
    value = float(value)
    if si_per_unit == _SI:
        return _plain(Decimal(repr(value)))
    in_unit = _EXACT.divide(Decimal(value), si_per_unit)
    for digits in range(1, 40):
        rounded = Context(prec=digits).plus(in_unit)
        if _to_si(rounded, si_per_unit) == value:
            return _plain(rounded)
    return _plain(in_unit)


def _rounded(value: float, si_per_unit: Decimal, digits: int) -> str:
    """`value` in the file's unit to `digits` places behind the point."""
    in_unit = _EXACT.divide(Decimal(float(value)), si_per_unit)
    rounded = _EXACT.quantize(in_unit, Decimal(1).scaleb(-digits))
    return _plain(rounded) if rounded else "0"


def _plain(number: Decimal) -> str:
    """12.5, -0.0, 1.0e-09: forms that YAML 1.1 readers also take for numbers."""
    if number == 0:
        return "-0.0" if number.is_signed() else "0"
    number = number.normalize(_EXACT)
    if -7 <= number.adjusted() < 16:
        return format(number, "f")
    mantissa, exponent = format(number, "e").split("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{int(exponent):+03d}"


def _quoted(text: str) -> str:
    """A YAML scalar that every reader takes for this text."""
    plain = (
        text.isascii()
        and text.replace("_", "").replace("-", "").replace(".", "").isalnum()
        and text[0].isalpha()
    )
    if plain and text.lower() not in ("true", "false", "null", "yes", "no", "on", "off", "y", "n"):
        return text
    escaped = (f"\\U{ord(c):08x}" if not c.isprintable() or 0xD800 <= ord(c) < 0xE000 else c for c in text)
    inner = "".join({"\\": "\\\\", '"': '\\"'}.get(part, part) for part in escaped)
    return f'"{inner}"'


def _flow(value: Any) -> str:
    """Free values of `calibration` in YAML's flow style."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return (
            _plain(Decimal(repr(value)))
            if math.isfinite(value)
            else str(value).replace("inf", ".inf").replace("nan", ".nan")
        )
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_quoted(str(key))}: {_flow(item)}' for key, item in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_flow(item) for item in value)}]"
    return _quoted(str(value))
