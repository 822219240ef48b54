# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How the links of a URDF look: their meshes (STL, OBJ), with so few triangles that a page can carry them.

A picture is no reason to stop: what cannot be read is said, and drawn as it would be without a mesh.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.files.common import PathLike, read_bytes, shown
from truing.files.robot_file import is_urdf

Floats = NDArray[np.float64]
Whole = NDArray[np.intp]

TRIANGLES = 8_000  # of a robot: 0.2 MB of a page
_LARGEST_URDF = 20_000_000  # [bytes]
_LARGEST_FILE = 50_000_000  # [bytes]: a million triangles
_LARGEST_ROBOT = 200_000_000  # [bytes] of all mesh files
_FARTHEST = 1e3  # [m] from the link's frame: beyond are millimetres that nobody scaled, or damage
_LISTED = 4
_BASE = -1  # the place of what stands still


@dataclass(frozen=True)
class Mesh:
    """Triangles in the frame of a joint."""

    joint: int  # of the robot: the link moves with it; -1: with the base
    points: Floats  # shape=(n, 3) [m]
    faces: Whole  # shape=(m, 3), rows of `points`


@dataclass(frozen=True)
class Looks:
    """The meshes of a robot's links, and in a sentence what was left out or made coarser; "" if nothing."""

    meshes: Sequence[Mesh]
    note: str = ""


class _Damaged(Exception):
    """Why a mesh is not drawn."""


def looks_of(path: PathLike | None, robot: _core.Robot, base_link: str = "") -> Looks | None:
    """How the links of a robot that was read from a URDF look. None: it is no URDF, or names no mesh.

    path: of the robot file. Meshes are looked for below its folder and below the root of its package.
    Never raises because of what the files hold.
    """
    if path is None or robot.convention != "urdf":
        return None
    try:
        if not is_urdf(path):
            return None
        text = read_bytes(Path(path), _LARGEST_URDF)
        if b"<!ENTITY" in text:  # a few of them can stand for gigabytes
            return None
        tree = ElementTree.fromstring(text)
        named = [one for one in _named_meshes(tree, robot, base_link) if one.files]
    except _Damaged as error:
        return Looks([], f"Drawn without meshes: an origin or a scale in {shown(Path(path).name)}: {error}.")
    except (InputError, ElementTree.ParseError, OSError, RecursionError):
        return None
    if not named:
        return None
    reader = _Reader(Path(path))
    pieces: dict[int, list[Floats]] = {}
    for link in named:
        drawn = [reader.corners(file, link.T_joint_link) for file in link.files]
        pieces.setdefault(link.joint, []).extend(corners for corners in drawn if corners is not None)
    together = {joint: np.concatenate(drawn) for joint, drawn in sorted(pieces.items()) if drawn}
    meshes, coarser = _with_few_triangles(together)
    return Looks(meshes, " ".join([*coarser, *reader.said()]))


# ---- What a URDF names ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _File:
    """A mesh as a URDF names it."""

    name: str
    scale: Floats
    T_link_mesh: Floats


@dataclass(frozen=True)
class _Link:
    joint: int
    T_joint_link: Floats
    files: Sequence[_File]


def _named_meshes(tree: ElementTree.Element, robot: _core.Robot, base_link: str) -> Iterator[_Link]:
    """Every link that is fixed to the base or to a joint of the robot. What moves besides is left out."""
    index = {joint.name: k for k, joint in enumerate(robot.joints)}
    links = {link.get("name", ""): link for link in tree.findall("link")}
    below: dict[str, list[tuple[str, ElementTree.Element]]] = {}
    for joint in tree.findall("joint"):
        below.setdefault(_end(joint, "parent"), []).append((_end(joint, "child"), joint))
    children = {child for joints in below.values() for child, _ in joints}
    roots = [base_link] if base_link else [name for name in links if name not in children]
    open_: list[tuple[str, int, Floats]] = [(name, _BASE, np.eye(4)) for name in roots[:1]]
    known = set(roots[:1])
    while open_:
        name, at, T = open_.pop()
        if name in links:
            yield _Link(at, T, _files_of(links[name]))
        for child, joint in below.get(name, ()):
            if child in known:
                continue
            if joint.get("name") in index:
                open_.append((child, index[joint.get("name", "")], np.eye(4)))
            elif joint.get("type") == "fixed":
                open_.append((child, at, T @ _origin(joint)))
            known.add(child)


def _end(joint: ElementTree.Element, which: str) -> str:
    end = joint.find(which)
    return "" if end is None else end.get("link", "")


def _files_of(link: ElementTree.Element) -> list[_File]:
    """Those that are there to be seen; where none of them can be read here, those for collisions."""
    found: list[_File] = []
    for kind in ("visual", "collision"):
        found = [*found, *_files_for(link, kind)]
        if any(Path(file.name).suffix.lower() in _READERS for file in found):
            break
    readable = [file for file in found if Path(file.name).suffix.lower() in _READERS]
    return readable or found[:1]


def _files_for(link: ElementTree.Element, kind: str) -> Iterator[_File]:
    for one in link.findall(kind):
        mesh = one.find("geometry/mesh")
        if mesh is not None and mesh.get("filename"):
            scale = _numbers(mesh.get("scale"), 1.0)
            yield _File(mesh.get("filename", ""), scale, _origin(one))


def _origin(element: ElementTree.Element) -> Floats:
    origin = element.find("origin")
    T = np.eye(4)
    if origin is not None:
        T[:3, :3] = _core.rotation_from_rpy(_numbers(origin.get("rpy"), 0.0))
        T[:3, 3] = _numbers(origin.get("xyz"), 0.0)
    return T


def _numbers(text: str | None, otherwise: float) -> Floats:
    if not (text or "").strip():
        return np.full(3, otherwise)
    try:
        values = np.array([float(word) for word in (text or "").split()])
    except ValueError:
        raise _Damaged(f"found {shown(text)}, expected three numbers") from None
    if values.shape != (3,) or not np.isfinite(values).all():
        raise _Damaged(f"found {shown(text)}, expected three numbers")
    return values


# ---- Finding and reading files -------------------------------------------------------------------


class _Reader:
    """Reads the meshes of one URDF, each file once, and remembers why some are not there."""

    def __init__(self, urdf: Path) -> None:
        self._folder = Path(os.path.realpath(urdf)).parent
        self._read: dict[Path, Floats] = {}
        self._bytes = 0
        self._faults: dict[str, str] = {}

    def corners(self, file: _File, T_joint_link: Floats) -> Floats | None:
        """Those of a mesh's triangles in the joint's frame, shape=(3 n, 3) [m]. None: it cannot be drawn."""
        T = T_joint_link @ file.T_link_mesh
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                corners = (self._corners_of(self._place(file.name)) * file.scale) @ T[:3, :3].T + T[:3, 3]
            if not len(corners) or not (np.abs(corners) < _FARTHEST).all():
                raise _Damaged("has no triangles" if not len(corners) else f"is wider than {_FARTHEST:g} m")
        except (_Damaged, InputError, OSError, ValueError, OverflowError) as error:
            text = str(error) if isinstance(error, _Damaged) else "cannot be read"
            self._faults.setdefault(Path(file.name).name, text)
            return None
        if np.prod(np.sign(file.scale)) < 0:  # a mirrored mesh would be seen from inside
            corners = corners.reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3)
        return corners

    def said(self) -> list[str]:
        """What was not drawn, as a sentence."""
        if not self._faults:
            return []
        each = [f"{shown(name)} {why}" for name, why in self._faults.items()]
        more = f"; and {len(each) - _LISTED} more" if len(each) > _LISTED else ""
        return [f"Drawn without their meshes: {'; '.join(each[:_LISTED])}{more}."]

    def _place(self, name: str) -> Path:
        """Where a mesh is: below the URDF's folder or the root of its package, and nowhere else."""
        package = re.match(r"(?:package|model)://([^/]+)/(.+)", name)
        if "://" in name and package is None and not name.startswith("file://"):
            raise _Damaged("is named by an address that is not read")
        roots = [self._folder, *self._package_roots(package[1] if package else "")]
        inside = package[2] if package else name.removeprefix("file://")
        candidates = [root / inside for root in roots]
        if package:
            candidates.append(self._folder / package[1] / inside)
        for candidate in candidates:
            real = Path(os.path.realpath(candidate))
            if real.is_file() and any(real.is_relative_to(root) for root in roots):
                return real
        raise _Damaged("is not below the URDF's folder or package")

    def _package_roots(self, name: str) -> list[Path]:
        """The nearest folder above the URDF that is the package: it has its name, or a package.xml."""
        above = self._folder.parents
        for folder in (self._folder, *above):
            if folder.parent != folder and (
                (name and folder.name == name) or (folder / "package.xml").is_file()
            ):
                return [folder]
        return []

    def _corners_of(self, path: Path) -> Floats:
        if path not in self._read:
            reader = _READERS.get(path.suffix.lower())
            if reader is None:
                raise _Damaged("is neither STL nor OBJ")
            self._bytes += path.stat().st_size
            if self._bytes > _LARGEST_ROBOT:
                raise _Damaged("is more than a report needs")
            corners = reader(read_bytes(path, _LARGEST_FILE))
            if not np.isfinite(corners).all():
                raise _Damaged("has points that are no numbers")
            self._read[path] = corners
        return self._read[path]


_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")


def _stl(data: bytes) -> Floats:
    """Corners of the triangles. Binary files may begin with "solid" too: their length says what they are."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + count * _TRIANGLE.itemsize:
        corners = np.frombuffer(data, dtype=_TRIANGLE, offset=84)["corners"]
        return corners.reshape(-1, 3).astype(np.float64)
    if not data.lstrip()[:5].lower() == b"solid" or b"\0" in data[:1000]:
        raise _Damaged("is damaged: its length is not that of its triangles")
    corners = _floats(_VERTEX.findall(data))
    if len(corners) % 3:
        raise _Damaged("is damaged: a triangle has no three corners")
    return corners


def _obj(data: bytes) -> Floats:
    """Corners of the triangles; faces of more corners are cut into fans."""
    rows = [line.split() for line in data.splitlines()]
    points = _floats([row[1:4] for row in rows if row[:1] == [b"v"]])
    fans = [[int(word.partition(b"/")[0]) for word in row[1:]] for row in rows if row[:1] == [b"f"]]
    every = np.array([[f[0], f[k], f[k + 1]] for f in fans for k in range(1, len(f) - 1)], dtype=np.intp)
    every = np.where(every < 0, every + len(points), every - 1).ravel()  # negative ones count from the end
    if every.size and not (0 <= every.min() and every.max() < len(points)):
        raise _Damaged("is damaged: a face has a corner that is not there")
    return points[every]


def _floats(words: Sequence[Sequence[bytes]]) -> Floats:
    if any(len(row) != 3 for row in words):
        raise _Damaged("is damaged: a point has no three numbers")
    return np.array([[float(word) for word in row] for row in words], dtype=np.float64).reshape(-1, 3)


_READERS = {".stl": _stl, ".obj": _obj}


# ---- Fewer triangles -----------------------------------------------------------------------------


def _with_few_triangles(corners: Mapping[int, Floats]) -> tuple[list[Mesh], list[str]]:
    """The meshes by joint, with at most TRIANGLES of them together: points in a cell of a grid become one
    (J. Rossignac, P. Borrel: Multi-resolution 3D approximations, 1993), and the grid is as fine as it may be.
    """
    if not corners:
        return [], []
    span = max(float(np.ptp(c, axis=0).max()) for c in corners.values()) or 1.0
    cell = 1e-6 * span  # points that are the same become one
    meshes = [_clustered(joint, c, cell) for joint, c in corners.items()]
    if _count(meshes) <= TRIANGLES:
        return meshes, []
    before = _count(meshes)
    low, high = math.log(1e-4 * span), math.log(span)
    for _ in range(10):
        middle = 0.5 * (low + high)
        trial = [_clustered(joint, c, math.exp(middle)) for joint, c in corners.items()]
        if _count(trial) > TRIANGLES:
            low = middle
        else:
            high, meshes = middle, trial
    if _count(meshes) > TRIANGLES:
        return [], ["The meshes are too large for a report: links are drawn as capsules."]
    text = f"Meshes are drawn with {_count(meshes):,} of {before:,} triangles."
    return meshes, [text.replace(",", " ")]


def _count(meshes: Sequence[Mesh]) -> int:
    return sum(len(mesh.faces) for mesh in meshes)


def _clustered(joint: int, corners: Floats, cell: float) -> Mesh:
    """The mesh with one point, their mean, for all in the same cell."""
    keys = np.floor((corners - corners.min(axis=0)) / cell).astype(np.int64)  # < 2^21
    _, where = np.unique((keys[:, 0] << 42) + (keys[:, 1] << 21) + keys[:, 2], return_inverse=True)
    where = where.ravel()
    counts = np.bincount(where)
    points = np.stack([np.bincount(where, corners[:, k]) / counts for k in range(3)], axis=1)
    faces = where.reshape(-1, 3)
    real = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[real]
    faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
    kept, where = np.unique(faces, return_inverse=True)
    return Mesh(joint, points[kept], where.reshape(-1, 3).astype(np.intp))
