# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye files: poses.csv (one row per robot pose), what a camera saw of a board there, and camera.yaml
(format truing-camera/1).
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PlainValidator

from truing import _core
from truing.errors import InputError, InputWarning, did_you_mean
from truing.files.boards import Board, BoardViews, find_board, parse_board, plausible_camera
from truing.files.common import PathLike, atomic_write, listed
from truing.files.opencv_file import is_opencv_file, read_opencv_camera
from truing.files.other_poses import OtherPoses, Setup, Side, read_other_poses
from truing.files.table import Beside, Floats, Table
from truing.files.yaml_tree import Document, FreeMapping, Number, Strict, Text, choice, expected, found
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_angles, rotations_from_quaternions

CAMERA_FORMAT = "truing-camera/1"
_CAMERA = "camera file"

_SIDES = {"hand": "flange in the robot base", "board": "board in the camera"}
_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_ANGLES = ("rx", "ry", "rz")
_LENGTH_UNITS = ("m", "mm")
_ANGLE_UNITS = ("rad", "deg")
_JOINT_UNITS = (*_ANGLE_UNITS, *_LENGTH_UNITS)
_OF_JOINT = re.compile(r"q([1-9][0-9]*)(?:_(.*))?", re.ASCII)
_SETS = ("train", "test")
_FEWEST = 3  # poses
_FARTHEST = 100.0  # [m] no robot's hand and no camera's board spread over more
_EQUAL = 1e-9  # [m | rad] poses that differ by less are one
_STILL = 5e-5  # [m | rad] a hand that moved by less stood still: its error is the same
_ANY_WAY = np.array([0.36, 0.48, 0.8])  # of length one, along no axis of a robot
_STILL_BOARD = 0.02  # [rad, and of its distance] and so did the board that a camera sees no further away

# Orders of turned (intrinsic) axes: the letters from left to right are the rotations as they are multiplied.
EULER_ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
ANGLE_CONVENTIONS = ("rotation-vector", *EULER_ORDERS)


@dataclass(frozen=True)
class HandEyeData:
    """What a hand-eye file holds, in SI units, ready for `truing.handeye`. One entry per row that is used."""

    path: Path
    poses: _core.HandEyePoses
    rows: NDArray[np.intp]  # of the file, counted from 0
    time: Floats | None = None  # shape=(n,) [s] column t_s: of the hand
    board_time: Floats | None = None  # shape=(n,) [s] column board_t_s
    joints: Floats | None = None  # shape=(n, driven joints) [rad | m]
    images: tuple[str, ...] = ()  # as the file names them
    views: BoardViews | None = None  # how the board was found in them
    board: Board | None = None
    camera_given: bool = True  # False: the camera's values were found from the images
    unused: tuple[str, ...] = ()  # rows that are not used, in words
    convention: str = "quaternion"  # of the orientations, or which program wrote the poses

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.rows)


@dataclass(frozen=True)
class Stream:
    """Poses of one side alone, with their times where the file has them."""

    path: Path
    time: Floats | None  # shape=(n,) [s], increasing
    T: Floats  # shape=(n, 4, 4)


# ---- Rotations -----------------------------------------------------------------------------------


def check_angles(convention: str | None, *, needed_by: str = "") -> str | None:
    """A convention of angles by its name; InputError when it is none, or when it is missing and a column
    needs it.
    """
    names = (
        "rotation-vector (Universal Robots), zyx (KUKA A B C and Fanuc W P R: turned axes z, y, x, which is"
        " fixed axes x, y, z), xyz (Staubli), zyz (Kawasaki O A T), or another order of turned axes"
    )
    if convention is None or convention == "":
        if needed_by:
            raise InputError(
                f"{needed_by}: angles mean nothing without their convention: say it with --angles (in Python:"
                f" angles=…), one of {names}"
            )
        return None
    if convention in ANGLE_CONVENTIONS:
        return convention
    hint = (
        f"; rotations about fixed axes in the order {convention.lower()} are {convention.lower()[::-1]!r}"
        " here"
        if convention.lower() in EULER_ORDERS
        else ""
    )
    raise InputError(f"--angles: found {convention!r}, expected {names}{hint}")


# ---- Columns -------------------------------------------------------------------------------------


class _Plan:
    """Which column of the file is what. Refuses names that are almost right."""

    def __init__(self, table: Table, sides: Sequence[str]) -> None:
        self.table = table
        self.sides = sides
        self.columns: dict[str, str] = {}  # "hand_x" -> name in the file
        self.units: dict[str, str] = {}
        self.labels: list[str] = []
        self.joints: dict[int, str] = {}
        self.times: dict[str, str] = {}
        self.others: list[str] = []
        for name in table.names:
            self._place(name)

    @property
    def numbers(self) -> list[str]:
        return [*self.columns.values(), *self.joints.values(), *self.times.values()]

    def _place(self, name: str) -> None:
        if name in ("image", "set"):
            self.labels.append(name)
            return
        if name in ("t_s", "board_t_s"):
            self.times[name] = name
            return
        side, _, rest = name.partition("_")
        if side in _SIDES and side in self.sides and rest:
            self._place_of_side(name, side, rest)
            return
        of_joint = _OF_JOINT.fullmatch(name)
        if of_joint:
            if of_joint[2] not in _JOINT_UNITS:
                self._refuse_unit(name, f"q{of_joint[1]}", _JOINT_UNITS)
            if int(of_joint[1]) in self.joints:
                self.table.refuse(
                    f"joint {of_joint[1]} has two columns, {self.joints[int(of_joint[1])]!r} and {name!r}:"
                    " remove one"
                )
            self.joints[int(of_joint[1])] = name
            return
        stem, _, unit = name.partition("_")
        if stem in ("t", "time") and unit in ("", "ms", "us", "ns"):
            self._refuse_unit(name, "t", ("s",))
        self.others.append(name)

    def _place_of_side(self, name: str, side: str, rest: str) -> None:
        stem, _, unit = rest.partition("_")
        kinds = {
            **dict.fromkeys(_POSITION, _LENGTH_UNITS),
            **dict.fromkeys(_QUATERNION, ("",)),
            **dict.fromkeys(_ANGLES, _ANGLE_UNITS),
        }
        if stem not in kinds:
            names = [f"{side}_{axis}_m" for axis in _POSITION] + [f"{side}_{part}" for part in _QUATERNION]
            hint = did_you_mean(name, names)
            self.table.refuse(
                f"unknown column; {hint}of the {side} ({_SIDES[side]}) there are {listed(names)}, or angles:"
                f" {side}_rx_deg …",
                column=name,
            )
        if unit not in kinds[stem]:
            if kinds[stem] == ("",):
                self.table.refuse(f"a quaternion has no unit, expected the name {side}_{stem}", column=name)
            self._refuse_unit(name, f"{side}_{stem}", kinds[stem])
        role = f"{side}_{stem}"
        if role in self.columns:
            self.table.refuse(
                f"there are two columns for it, {self.columns[role]!r} and {name!r}: remove one", column=name
            )
        self.columns[role] = name
        self.units[role] = unit

    def _refuse_unit(self, name: str, stem: str, units: Sequence[str]) -> None:
        self.table.refuse(
            f"no known unit in the name, expected {' or '.join(f'{stem}_{unit}' for unit in units)}",
            column=name,
        )

    def has(self, side: str) -> bool:
        return any(role.startswith(f"{side}_") for role in self.columns)

    def require_whole(self, side: str) -> str:
        """A side has a position and one kind of orientation, each in one unit; "quaternion" or "angles"."""
        self._require(side, _POSITION, "_m", "a position has three coordinates")
        quaternion = [part for part in _QUATERNION if f"{side}_{part}" in self.columns]
        angles = [part for part in _ANGLES if f"{side}_{part}" in self.columns]
        if quaternion and angles:
            self.table.refuse(
                f"the {side} has an orientation twice, {self.columns[f'{side}_{quaternion[0]}']} … and"
                f" {self.columns[f'{side}_{angles[0]}']} …: remove one"
            )
        if angles:
            self._require(side, _ANGLES, "_deg", "an orientation has three angles")
            return "angles"
        self._require(
            side,
            _QUATERNION,
            "",
            "an orientation is a quaternion, scalar first, or three angles with --angles",
        )
        return "quaternion"

    def _require(self, side: str, stems: Sequence[str], ending: str, why: str) -> None:
        missing = [stem for stem in stems if f"{side}_{stem}" not in self.columns]
        if missing:
            wanted = f"{side}_{missing[0]}{ending}"
            others = [name for name in self.table.names if name not in self.columns.values()]
            hint = did_you_mean(wanted, others, 0.75)
            self.table.refuse(
                f"there is no column {wanted} ({_SIDES[side]}: {why}); {hint}the columns are"
                f" {listed(self.table.names)}"
            )
        units = {self.units[f"{side}_{stem}"] for stem in stems}
        if len(units) > 1:
            names = [self.columns[f"{side}_{stem}"] for stem in stems]
            self.table.refuse(f"mixed units in {listed(names)}: give all three in one unit")


class _Reader:
    """Takes poses out of a table."""

    def __init__(self, table: Table, plan: _Plan, angles: str | None) -> None:
        self.table = table
        self.plan = plan
        self.angles = angles

    def _columns(self, side: str, stems: Sequence[str], gaps: bool) -> Floats:
        return np.column_stack(
            [self.table.numbers(self.plan.columns[f"{side}_{stem}"], gaps=gaps) for stem in stems]
        )

    def frames(self, side: str, kind: str, *, gaps: bool = False) -> Floats:
        """shape=(n, 4, 4); NaN in rows whose cells are all empty, where `gaps` allows them."""
        position = self._columns(side, _POSITION, gaps)
        orientation = self._columns(side, _ANGLES if kind == "angles" else _QUATERNION, gaps)
        names = [
            self.plan.columns[f"{side}_{stem}"]
            for stem in (*_POSITION, *(_ANGLES if kind == "angles" else _QUATERNION))
        ]
        empty = np.isnan(np.column_stack([position, orientation]))
        absent = empty.all(axis=1)
        half = empty.any(axis=1) & ~absent
        if half.any():
            row = int(np.argmax(half))
            self.table.refuse(
                f"found an empty cell, expected a number, or empty cells in all of {listed(names)} where"
                " there is no pose",
                row=row,
                column=names[int(np.argmax(empty[row]))],
            )
        if self.plan.units[f"{side}_x"] == "mm":
            position = position / 1000.0
        out = np.full((len(position), 4, 4), np.nan)
        there = np.flatnonzero(~absent)
        if kind == "angles":
            rotations = self._from_angles(side, orientation, there)
        else:
            self._require_unit_quaternions(side, orientation, there)
            rotations = rotations_from_quaternions(orientation[there])
        out[there] = np.eye(4)
        out[there, :3, :3] = rotations
        out[there, :3, 3] = position[there]
        return out

    def _from_angles(self, side: str, angles: Floats, there: NDArray[np.intp]) -> Floats:
        names = [self.plan.columns[f"{side}_{stem}"] for stem in _ANGLES]
        convention = check_angles(self.angles, needed_by=f"{self.table.path}, columns {listed(names)}")
        assert convention is not None
        values = angles[there]
        if self.plan.units[f"{side}_rx"] == "rad":
            beyond = np.abs(values) > 2 * math.pi + 1e-6
            if beyond.any():
                place, column = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
                self.table.refuse(
                    f"found {values[place, column]:.6g}, more than a turn: these look like degrees; call the"
                    f" columns {listed([name.removesuffix('_rad') + '_deg' for name in names])}, or convert"
                    " them",
                    row=int(there[place]),
                    column=names[column],
                )
            return rotations_from_angles(values, convention)
        if len(values) and np.abs(values).max() <= math.pi + 0.01 and np.ptp(values, axis=0).max() > 0.2:
            self._warn(
                f"columns {listed(names)}: all values lie within ±{math.pi:.3g}, which is next to no rotation"
                " in degrees: are these radians? Then call them"
                f" {listed([name.removesuffix('_deg') + '_rad' for name in names])}"
            )
        return rotations_from_angles(np.radians(values), convention)

    def _require_unit_quaternions(self, side: str, q: Floats, there: NDArray[np.intp]) -> None:
        norm = np.linalg.norm(q[there], axis=1)
        wrong = np.abs(norm - 1.0) > UNIT_LENGTH_OFF
        if not wrong.any():
            return
        row = int(there[int(np.argmax(wrong))])
        values, size = q[row], float(norm[int(np.argmax(wrong))])
        if size < 1e-9:
            hint = "an empty orientation?"
        elif abs(size - 1000.0) < 1.0:
            hint = "it looks like it was converted to mm with the position: a quaternion has no unit"
        elif np.abs(values).max() > 1.5:
            hint = f"it looks like angles: call them {side}_rx_deg (or _rad) … and say --angles"
        elif np.abs(norm - norm[0]).max() < 1e-3 * norm[0]:
            hint = "all have the same length: scaled?"
        else:
            hint = "a column in the wrong place, or too few digits?"
        self.table.refuse(
            f"found the {side} quaternion {' '.join(f'{v:.6g}' for v in values)} of length {size:.6g},"
            " expected a unit quaternion (to 1e-3), scalar first"
            f" ({', '.join(f'{side}_{part}' for part in _QUATERNION)}); {hint}",
            row=row,
        )

    def _warn(self, message: str) -> None:
        warnings.warn(InputWarning(f"{self.table.path}: {message}"), stacklevel=4)

    def times(self, name: str, *, increasing: bool) -> Floats | None:
        if name not in self.plan.times:
            return None
        values = self.table.numbers(name)
        if increasing and len(values) > 1:
            back = np.diff(values) <= 0
            if back.any():
                row = int(np.argmax(back)) + 1
                self.table.refuse(
                    f"found {values[row]:.9g} after {values[row - 1]:.9g}, expected times that increase from"
                    " row to row",
                    row=row,
                    column=name,
                )
        return values

    def sets(self) -> NDArray[np.int8] | None:
        if "set" not in self.plan.labels:
            return None
        codes, names = self.table.labels("set")
        lookup = np.array(
            [*(_SETS.index(name) if name in _SETS else -1 for name in names), -1], dtype=np.int8
        )
        sets = lookup[codes]
        if (sets < 0).any():
            self.table.refuse_cell(int(np.argmax(sets < 0)), "set", "train or test")
        return np.asarray(sets, dtype=np.int8)

    def joints(self) -> Floats | None:
        numbers = sorted(self.plan.joints)
        if not numbers:
            return None
        if numbers != list(range(1, len(numbers) + 1)):
            missing = next(k for k in range(1, len(numbers) + 2) if k not in numbers)
            self.table.refuse(
                f"there is no column q{missing}_rad (or another unit), but {self.plan.joints[numbers[-1]]}:"
                " joints are counted from 1 without gaps"
            )
        columns = []
        for number in numbers:
            name = self.plan.joints[number]
            values = self.table.numbers(name)
            unit = name.rpartition("_")[2]
            if unit == "rad" and np.median(np.abs(values)) > 4 * math.pi:
                self.table.refuse(
                    f"values from {values.min():.4g} to {values.max():.4g} look like degrees: call the column"
                    f" q{number}_deg, or convert them",
                    column=name,
                )
            columns.append(
                np.radians(values) if unit == "deg" else values / 1000.0 if unit == "mm" else values
            )
        return np.column_stack(columns)

    def images(self, folder: Path) -> tuple[list[str], list[Path]]:
        """Names and paths of the images, one per row; all have to be there."""
        codes, names = self.table.labels("image")
        if (codes < 0).any():
            self.table.refuse_cell(
                int(np.argmax(codes < 0)), "image", "the path of an image, relative to this file"
            )
        paths = [folder / name for name in names]
        missing = [k for k, path in enumerate(paths) if not path.is_file()]
        if missing:
            row = min(int(np.argmax(codes == k)) for k in missing)
            first = int(codes[row])
            rest = [names[k] for k in missing if k != first]
            more = (
                f"; {len(rest)} more {'are' if len(rest) > 1 else 'is'} missing: {listed(rest, 8)}"
                if rest
                else ""
            )
            self.table.refuse(
                f"there is no image {names[first]!r} in {folder or Path()}{os.sep} (paths are relative to"
                f" this file){more}",
                row=row,
                column="image",
            )
        twice = np.flatnonzero(np.bincount(codes, minlength=len(names)) > 1)
        if twice.size:
            rows = np.flatnonzero(codes == twice[0])
            self.table.refuse(
                f"the image {names[twice[0]]!r} is already that of an earlier row: one image for each pose",
                row=int(rows[1]),
                column="image",
            )
        return [names[code] for code in codes], [paths[code] for code in codes]


# ---- Reading -------------------------------------------------------------------------------------


def load_handeye(
    path: PathLike,
    *,
    board: str | Board | None = None,
    camera: PathLike | _core.Camera | None = None,
    angles: str | None = None,
    setup: Setup | None = None,
    progress: Callable[[int, int], None] | None = None,
    beside: Beside | None = None,
) -> HandEyeData:
    """Read robot poses, and what the camera saw of the board at each, from CSV or Parquet, or from a file of
    easy_handeye, easy_handeye2, MoveIt or OpenCV that holds both.

    Columns, with their unit in the name: hand_x_m hand_y_m hand_z_m (or _mm) and hand_qw hand_qx hand_qy
    hand_qz, the flange in the robot base as the controller reports it; then board_x_m … board_qz, the board
    in the camera, or `image`, a path relative to the file. Instead of a quaternion hand_rx_deg hand_ry_deg
    hand_rz_deg (or _rad; board likewise). Optional: t_s, board_t_s, set (train, test), q1_rad … (for
    `handeye_with_kinematics`). Rows whose board cells are all empty are left out, and rows of one pose,
    robot and board as in an earlier row, count as one, with a warning.

    board: what is in the images, "chessboard:9x6:25mm" (inner corners), "charuco:5x7:40mm:30mm",
    "circles:10x10:25.4mm", "acircles:4x11:20mm", "apriltag:36h11:6x6:88mm:0.3";
    needs OpenCV. camera: file, or `Camera`; None: its values are found from the same images.
    angles: convention of angle columns: "rotation-vector" (UR), or the order of turned axes, "zyx" for Rz Ry
    Rx (KUKA, Fanuc), "xyz", "zyz" …
    setup: of samples of easy_handeye, which writes the robot's poses the other way round where the camera
    stands in the cell; None: as the samples say, else eye-in-hand.
    progress: called with images done, and images in all.
    beside: columns of a table that another file gives, hand_x_m … of a program
    (`truing.programs.commanded_hand`).

    Raises InputError that names the line, the column, what was found and what was expected.
    """
    other = None if beside else read_other_poses(Path(path), setup)
    if other is not None:
        return _of_other_program(other, board)
    table = Table(Path(path), beside=beside)
    plan = _Plan(table, ("hand", "board"))
    angles = check_angles(angles)
    parsed = parse_board(board) if isinstance(board, str) else board
    kind = plan.require_whole("hand")
    use_images = "image" in plan.labels and (parsed is not None or not plan.has("board"))
    _require_a_board(table, plan, parsed, use_images)
    board_kind = "" if use_images else plan.require_whole("board")
    table.read(plan.numbers, plan.labels)
    _check_count(table, table.rows)
    reader = _Reader(table, plan, angles)
    hand = reader.frames("hand", kind)
    sets, joints = reader.sets(), reader.joints()
    time, board_time = _two_times(table, plan, reader)
    seen = (
        _seen_in_images(table, reader, parsed, camera, progress)
        if use_images and parsed is not None
        else _seen_in_file(table, reader, board_kind)
    )
    seen = _checked(table, hand, seen, sets, streams=board_time is not None)
    rows, views = seen.rows, seen.views
    poses = _core.HandEyePoses(
        hand[rows],
        seen.T_camera_board,
        images=None if views is None else list(zip(views.points, views.pixels, strict=True)),
        camera=None if views is None else views.camera,
        set=None if sets is None else sets[rows],
        board_symmetries=[] if views is None or parsed is None else list(parsed.symmetries()),
    )
    return HandEyeData(
        path=table.path,
        poses=poses,
        rows=rows,
        time=None if time is None else time[rows],
        board_time=None if board_time is None else board_time[rows],
        joints=None if joints is None else joints[rows],
        images=tuple(seen.images[row] for row in rows) if views is not None else (),
        views=views,
        board=parsed if views is not None else None,
        camera_given=views is None or camera is not None,
        unused=tuple(seen.unused),
        convention=(angles or "") if "angles" in (kind, board_kind) else "quaternion",
    )


def _checked(
    table: Table, hand: Floats, seen: _Seen, sets: NDArray[np.int8] | None, *, streams: bool
) -> _Seen:
    """Poses enough, that poses may be; those of a robot that stood still are one, but not in a stream."""
    _check_count(table, len(seen.rows), "with a board")
    images = seen.views is not None
    _check_poses(table.path, hand[seen.rows], seen.T_camera_board, images=images, columns=True)
    return seen if streams else _one_of_each_pose(table.path, hand, seen, sets)


def _require_a_board(table: Table, plan: _Plan, board: Board | None, use_images: bool) -> None:
    """The camera saw something, and what it saw is known."""
    if not use_images and not plan.has("board"):
        table.refuse(
            "there is nothing that the camera saw: expected the columns board_x_m … board_qz (board in the"
            f" camera), or image; the columns are {listed(table.names)}"
        )
    if use_images and board is None:
        table.refuse(
            "the column image needs to know what is in the images: say it with --board (in Python: board=…),"
            " such as chessboard:9x6:25mm (inner corners), charuco:5x7:40mm:30mm or circles:10x10:25.4mm",
            column="image",
        )
    if not use_images and board is not None:
        table.refuse("a board was named, but there is no column image; the board poses of the file need none")


def _two_times(table: Table, plan: _Plan, reader: _Reader) -> tuple[Floats | None, Floats | None]:
    """Times of hand and board."""
    streams = "board_t_s" in plan.times
    if streams and "t_s" not in plan.times:
        table.refuse(
            "there is no column t_s: board_t_s is the camera's time, and needs the robot's beside it",
            column="board_t_s",
        )
    return reader.times("t_s", increasing=streams), reader.times("board_t_s", increasing=True)


@dataclass(frozen=True)
class _Seen:
    """What the camera saw."""

    rows: NDArray[np.intp]  # with a board, shape=(m,)
    T_camera_board: Floats  # shape=(m, 4, 4)
    unused: list[str]  # rows without one, in words
    images: Sequence[str] = ()  # one per row of the file
    views: BoardViews | None = None


def _seen_in_images(
    table: Table,
    reader: _Reader,
    board: Board,
    camera: PathLike | _core.Camera | None,
    progress: Callable[[int, int], None] | None,
) -> _Seen:
    images, paths = reader.images(table.path.parent)
    given = load_camera(camera) if camera is not None and not isinstance(camera, _core.Camera) else camera
    views = find_board(
        paths,
        board,
        camera=given,
        names=images,
        progress=progress,
        where=str(camera) if camera is not None and given is not camera else "",
    )
    if views.missing:
        which = listed([images[row] for row in views.missing], 12)
        warnings.warn(
            InputWarning(
                f"{table.path}: the board was not found in {len(views.missing)} of {len(images)} images,"
                f" which are left out: {which}"
            ),
            stacklevel=3,
        )
    unused = [f"the board was not found in {images[row]}" for row in views.missing]
    return _Seen(np.asarray(views.found, dtype=np.intp), views.T_camera_board, unused, images, views)


def _seen_in_file(table: Table, reader: _Reader, kind: str) -> _Seen:
    seen = reader.frames("board", kind, gaps=True)
    rows = np.flatnonzero(np.isfinite(seen[:, 0, 0]))
    absent = np.setdiff1d(np.arange(table.rows), rows)
    if absent.size:
        warnings.warn(
            InputWarning(
                f"{table.path}: {absent.size} of {table.rows} rows have no board pose and are left out:"
                f" {listed([str(r) for r in absent], 12)} (from 0)"
            ),
            stacklevel=3,
        )
    return _Seen(rows, seen[rows], [f"row {row} (from 0) has no board pose" for row in absent])


def _one_of_each_pose(path: Path, hand: Floats, seen: _Seen, sets: NDArray[np.int8] | None = None) -> _Seen:
    """Rows at which the robot stands as in an earlier one, and the board as well, become one with it. The
    robot's error is the same in them: as poses of their own they would be counted as if it were not.
    """
    first = _first_alike(hand[seen.rows], seen.T_camera_board, None if sets is None else sets[seen.rows])
    kept = np.unique(first)
    if len(kept) == len(first):
        return seen
    groups = [np.flatnonzero(first == k) for k in kept]
    repeats = [
        (int(seen.rows[k]), int(seen.rows[first[k]])) for k in np.flatnonzero(first != np.arange(len(first)))
    ]
    named = [f"{row} (as {earlier})" for row, earlier in repeats]
    warnings.warn(
        InputWarning(
            f"{path}: {len(repeats)} of {len(first)} poses are those of an earlier row, robot and board:"
            f" they count as one with it, as the robot's error is the same: {listed(named, 12)} (rows from 0)"
        ),
        stacklevel=3,
    )
    _require_enough(path, len(kept), "that differ")
    return _Seen(
        seen.rows[kept],
        np.array([_mean_frame(seen.T_camera_board[group]) for group in groups]),
        [*seen.unused, *(f"row {row} (from 0) has the pose of row {earlier}" for row, earlier in repeats)],
        seen.images,
        None if seen.views is None else _views_together(seen.views, groups),
    )


def _first_alike(hand: Floats, board: Floats, sets: NDArray[np.int8] | None) -> NDArray[np.intp]:
    """Of each pose the first at which hand and board stood alike, itself if there is none."""
    first = np.arange(len(hand))
    far = np.linalg.norm(board[:, :3, 3], axis=1)
    along = hand[:, :3, 3] @ _ANY_WAY  # hands that are near are so along any line: few are left to look at
    order = np.argsort(along, kind="stable")
    low, high = (np.searchsorted(along[order], along + side * _STILL) for side in (-1.0, 1.0))
    for k in range(1, len(hand)):
        near = np.sort(order[low[k] : high[k]])
        near = near[(near < k) & (first[near] == near)]
        alike = (_apart(hand[near], hand[k]) < _STILL).all(axis=1)
        limits = _STILL_BOARD * np.column_stack([far[near], np.ones(len(near))])
        alike &= (_apart(board[near], board[k]) < limits).all(axis=1)
        if sets is not None:
            alike &= sets[near] == sets[k]
        if alike.any():
            first[k] = int(near[np.argmax(alike)])
    return first


def _apart(frames: Floats, frame: Floats) -> Floats:
    """shape=(n, 2) [m] and, while it is small, [rad]."""
    turn = np.linalg.norm(frames[:, :3, :3] - frame[:3, :3], axis=(1, 2)) / math.sqrt(2.0)
    return np.column_stack([np.linalg.norm(frames[:, :3, 3] - frame[:3, 3], axis=1), turn])


def _mean_frame(frames: Floats) -> Floats:
    """Of frames that are nearly alike; the one itself where it is alone."""
    if len(frames) == 1:
        return np.asarray(frames[0])
    mean = frames.mean(axis=0)
    u, _, vt = np.linalg.svd(mean[:3, :3])
    mean[:3, :3] = u @ vt
    return np.asarray(mean)


def _views_together(views: BoardViews, groups: Sequence[NDArray[np.intp]]) -> BoardViews:
    """Images of one pose as one, with the points of all; a copy of an image tells nothing new."""
    points, pixels = [], []
    for group in groups:
        own = [
            k
            for k in group
            if not any(np.array_equal(views.pixels[k], views.pixels[j]) for j in group if j < k)
        ]
        points.append(np.vstack([views.points[k] for k in own]))
        pixels.append(np.vstack([views.pixels[k] for k in own]))
    kept = [int(group[0]) for group in groups]
    return replace(
        views,
        found=tuple(views.found[k] for k in kept),
        points=tuple(points),
        pixels=tuple(pixels),
        T_camera_board=views.T_camera_board[kept],
        rms=views.rms[kept],
    )


def load_stream(path: PathLike, side: Side, *, angles: str | None = None) -> Stream:
    """Read poses with times: t_s and hand_x_m … hand_qz, or board_x_m … board_qz. Columns as in
    `load_handeye`; times increase. Or poses as other programs write them: lines of 16 or 12 numbers and
    matrices of OpenCV, which have no times, lines of 8 (time, position, quaternion x y z w), and CSV exports
    of the ROS messages PoseStamped and TransformStamped; files of ViSP, as one name with %d for their number.

    Raises InputError that names the line, the column, what was found and what was expected.
    """
    other = read_other_poses(Path(path))
    if other is not None:
        return _stream_of_other_program(other, side)
    table = Table(Path(path))
    plan = _Plan(table, ("hand", "board"))
    if not plan.has(side):
        table.refuse(
            f"expected the columns {side}_x_m … {side}_qz ({_SIDES[side]}); the columns are"
            f" {listed(table.names)}"
        )
    kind = plan.require_whole(side)
    if "t_s" not in plan.times:
        table.refuse(
            f"there is no column t_s: a stream has a time in every row; the columns are {listed(table.names)}"
        )
    table.read(plan.numbers, plan.labels)
    reader = _Reader(table, plan, check_angles(angles))
    frames = reader.frames(side, kind, gaps=side == "board")
    time = reader.times("t_s", increasing=True)
    assert time is not None
    there = np.isfinite(frames[:, 0, 0])
    _check_count(table, int(there.sum()))
    return Stream(table.path, time[there], frames[there])


def pair_rows(hand: Stream, board: Stream) -> HandEyeData:
    """Poses of two files that belong together row by row. Raises InputError."""
    if len(hand.T) != len(board.T):
        raise InputError(
            f"{board.path}: has {len(board.T)} poses, expected {len(hand.T)} as in {hand.path}: without times"
            " they belong together row by row"
        )
    return _of_matrices(hand.path, hand.T, board.T, "matrices")


def _of_matrices(path: Path, hand: Floats, board: Floats, convention: str) -> HandEyeData:
    _check_poses(path, hand, board)
    seen = _one_of_each_pose(path, hand, _Seen(np.arange(len(hand)), board, []))
    poses = _core.HandEyePoses(hand[seen.rows], seen.T_camera_board)
    return HandEyeData(path, poses, seen.rows, unused=tuple(seen.unused), convention=convention)


def _of_other_program(other: OtherPoses, board: str | Board | None) -> HandEyeData:
    if board is not None:
        raise InputError(
            f"{other.path}: a board was named, but {other.tool} name no images; a table with the columns"
            " hand_x_m … hand_qz and image does"
        )
    if other.either is not None:
        raise InputError(
            f"{other.path}: {other.tool} hold the poses of one side, expected those of the hand, and those"
            " of the board in a second file: --board-poses (in Python: load_stream and pair_rows)"
        )
    hand, seen = other.of("hand"), other.of("board")
    if len(hand) != len(seen):
        raise InputError(f"{other.path}: has {len(hand)} poses of the hand, but {len(seen)} of the board")
    _require_enough(other.path, len(hand))
    return _of_matrices(other.path, hand, seen, other.tool)


def _stream_of_other_program(other: OtherPoses, side: Side) -> Stream:
    frames, time = other.of(side), other.time
    _require_enough(other.path, len(frames))
    if time is not None:
        later = np.diff(time) > 0
        if not later.all():
            row = int(np.argmin(later)) + 1
            raise InputError(
                f"{other.path}: the time of pose {row} (from 0), {time[row]:.6f} s, is not later than that"
                f" before it, {time[row - 1]:.6f} s; expected times that increase"
            )
    return Stream(other.path, time, frames)


def _check_count(table: Table, count: int, what: str = "") -> None:
    _require_enough(table.path, count, what)


def _require_enough(path: Path, count: int, what: str = "") -> None:
    if count < _FEWEST:
        raise InputError(
            f"{path}: has {count} {'pose' if count == 1 else 'poses'}{f' {what}' if what else ''}, expected"
            f" at least {_FEWEST} (better 15 or more, turned about different axes)"
        )


def _check_poses(
    path: Path, hand: Floats, board: Floats, *, images: bool = False, columns: bool = False
) -> None:
    """Values that no hand-eye data has. columns: the file's columns have names with units."""
    if _spread_of_poses(hand) < _EQUAL:
        raise InputError(
            f"{path}: all {len(hand)} robot poses are equal: nothing moved, or one pose was written again and"
            " again"
        )
    if not images and _spread_of_poses(board) < _EQUAL:
        raise InputError(
            f"{path}: all {len(board)} board poses are equal: the camera did not see the hand move, or one"
            " pose was written again and again"
        )

    def spread(frames: Floats) -> float:
        low, high = np.percentile(frames[:, :3, 3], (10, 90), axis=0)
        return float(max((high - low).max(), np.median(np.linalg.norm(frames[:, :3, 3], axis=1)) / 10))

    # Where one side alone is in another unit, the loop shows it (and which); where both are, nothing else
    # does.
    if spread(hand) > _FARTHEST and (images or spread(board) > _FARTHEST):
        sides = ("hand",) if images else ("hand", "board")
        names = [f"{side}_x_mm …" for side in sides]
        what = f"call the columns {listed(names)}, or convert them" if columns else "expected m: convert them"
        raise InputError(
            f"{path}: the hand's positions spread over {spread(hand):.4g} m: these look like millimetres;"
            f" {what}"
        )


def _spread_of_poses(frames: Floats) -> float:
    """The largest difference of a coordinate [m] or of an entry of a rotation."""
    positions = np.ptp(frames[:, :3, 3], axis=0).max()
    return float(max(positions, np.abs(frames[:, :3, :3] - frames[0, :3, :3]).max()))


# ---- Cameras -------------------------------------------------------------------------------------


def _pixels(value: object) -> int:
    if (
        not isinstance(value, Decimal)
        or not value.is_finite()
        or value != value.to_integral_value()
        or not 1 <= value <= 100_000
    ):
        raise expected(value, "a number of pixels")
    return int(value)


def _coefficients(value: object) -> list[Decimal]:
    if not isinstance(value, list):
        raise expected(value, "a list of numbers, [k1, k2, p1, p2, k3]")
    for item in value:
        if not isinstance(item, Decimal) or not item.is_finite():
            raise expected(item, "a finite number")
    if len(value) not in (4, 5):
        more = (
            ": more coefficients belong to another model (rational, fisheye), which is not read; calibrate"
            " the camera with five"
            if len(value) > 5
            else ""
        )
        raise expected(value, f"5 coefficients [k1, k2, p1, p2, k3] (or 4, without k3){more}")
    return value


class _Distortion(Strict):
    model: Annotated[Literal["plumb_bob"], PlainValidator(choice("plumb_bob"))]
    coefficients: Annotated[list[Decimal], PlainValidator(_coefficients)]


class _CameraFile(Strict):
    format: Text
    width: Annotated[int, PlainValidator(_pixels)]
    height: Annotated[int, PlainValidator(_pixels)]
    fx: Number
    fy: Number
    cx: Number
    cy: Number
    distortion: _Distortion
    sigma: FreeMapping = {}
    calibration: FreeMapping = {}


def load_camera(path: PathLike) -> _core.Camera:
    """Read a camera file (format truing-camera/1): image size, fx fy cx cy [px], distortion k1 k2 p1 p2 k3
    (plumb bob, as OpenCV). Or one that OpenCV's calibration wrote (cv::FileStorage: camera_matrix,
    distortion_coefficients, image_width, image_height).

    Raises InputError that names the line (or OpenCV's node), what was found and what was expected.
    """
    if is_opencv_file(Path(path)):
        camera = read_opencv_camera(Path(path))
        if wrong := plausible_camera(camera):
            raise InputError(f"{path}: {wrong[0]}: {wrong[1]}")
        return camera
    document = Document.read(Path(path), _CAMERA)
    told = document.value.get("format")
    if told != CAMERA_FORMAT:
        document.refuse(
            ("format",) if "format" in document.value else (),
            (
                f"found {found(told)}, expected {CAMERA_FORMAT}"
                if "format" in document.value
                else f"key 'format' is missing: expected format: {CAMERA_FORMAT}"
            ),
        )
    file = document.validated(_CameraFile)
    camera = _core.Camera(
        width=file.width,
        height=file.height,
        fx=float(file.fx),
        fy=float(file.fy),
        cx=float(file.cx),
        cy=float(file.cy),
        distortion=[float(value) for value in (*file.distortion.coefficients, Decimal(0))][:5],
    )
    wrong = plausible_camera(camera)
    if wrong:
        document.refuse((wrong[0],), wrong[1])
    return camera


def save_camera(
    path: PathLike,
    camera: _core.Camera,
    *,
    sigma: Mapping[str, float] | None = None,
    calibration: Mapping[str, object] | None = None,
) -> None:
    """Write a camera file, atomically. `sigma`: standard errors by name; `calibration`: where the values come
    from.
    """

    def number(value: float) -> str:
        return repr(float(value))

    coefficients = ", ".join(number(value) for value in camera.distortion)
    lines = [f"format: {CAMERA_FORMAT}", f"width: {camera.width}", f"height: {camera.height}"]
    lines += [f"{name}: {number(getattr(camera, name))}" for name in ("fx", "fy", "cx", "cy")]
    lines.append(f"distortion: {{model: plumb_bob, coefficients: [{coefficients}]}}  # k1 k2 p1 p2 k3")
    for key, mapping in (("sigma", sigma), ("calibration", calibration)):
        if mapping:
            lines.append(
                f"{key}: {{{', '.join(f'{name}: {_scalar(value)}' for name, value in mapping.items())}}}"
            )
    with atomic_write(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _scalar(value: object) -> str:
    if isinstance(value, (bool, int)):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else "null"
    text = str(value)
    return (
        text
        if re.fullmatch(r"[A-Za-z][A-Za-z0-9_.-]*", text)
        else '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
    )
