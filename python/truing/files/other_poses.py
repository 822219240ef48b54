# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses as other programs write them: lines of 16, 12 or 8 numbers, CSV exports of ROS messages, samples of
easy_handeye, easy_handeye2 and MoveIt, matrices of OpenCV, files of ViSP, programs of robots.

What a file is, is told by what stands in it, not by its name.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError, InputWarning
from truing.files.common import decoded, listed, read_bytes, shown
from truing.files.opencv_file import read_opencv_poses
from truing.files.program_poses import hand_poses, is_program
from truing.files.rigid import frames_from_quaternions, frames_from_rows
from truing.files.table import Table
from truing.files.visp_file import is_series, is_visp_matrix, read_visp_series
from truing.files.yaml_tree import Document, Loc, found

Floats = NDArray[np.float64]
Side = Literal["hand", "board"]
Setup = Literal["eye-in-hand", "eye-to-hand"]

_HEAD = 65536  # bytes that tell what a file is
_LARGEST_TEXT = 100_000_000  # [bytes] half a million lines of 16 numbers
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_BETWEEN = re.compile(r"[\s,;]+")
_YAML_SUFFIXES = (".yaml", ".yml", ".samples", ".calib")
_OF_ROS = re.compile(
    r"(?:(?P<message>.*?)[./_])?(?P<part>position|translation|orientation|rotation)[./_](?P<axis>[xyzw])"
)
_NANOSECONDS = 1e14  # stamps beyond are not seconds
_SAMPLES = (
    "samples of easy_handeye2 (parameters, samples: [{robot, tracking}]), easy_handeye (hand_world_samples,"
    " camera_marker_samples) or MoveIt ([{effector_wrt_world, object_wrt_sensor}])"
)


@dataclass(frozen=True)
class OtherPoses:
    """What such a file holds: poses of both sides, or of one, frames of shape=(n, 4, 4) [m]."""

    path: Path
    tool: str  # what it looks like, in words
    hand: Floats | None = None  # in the robot base
    board: Floats | None = None  # in the camera
    either: Floats | None = None  # of one side; the file does not say of which
    time: Floats | None = None  # shape=(n,) [s]

    def of(self, side: Side) -> Floats:
        """Poses of one side. InputError where the file has none."""
        frames = self.hand if side == "hand" else self.board
        if frames is None:
            frames = self.either
        if frames is None:
            other = "board" if side == "hand" else "hand"
            raise InputError(
                f"{self.path}: {self.tool} with poses of the {other} alone, expected poses of the {side}"
            )
        return frames


def read_other_poses(path: Path, setup: Setup | None = None) -> OtherPoses | None:
    """What another program wrote; None: the file is none of these, but perhaps a table with named columns.

    setup: what is expected; easy_handeye writes the hand's pose the other way round where the camera stands
    in the cell. Raises InputError that names the line, what was found and what was expected.
    """
    if is_program(path):
        return OtherPoses(path, "a robot program", hand=hand_poses(path))
    if is_series(path):
        return OtherPoses(path, "poses of ViSP", either=read_visp_series(path))
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except (OSError, ValueError):
        return None  # who reads it as a table says so
    reader = _reader(path, head)
    return None if reader is None else reader(path, setup)


Reader = Callable[[Path, "Setup | None"], OtherPoses]


def _reader(path: Path, head: bytes) -> Reader | None:
    if head.startswith(b"PAR1"):
        return None
    text = head.decode("utf-8", errors="replace").lstrip("\ufeff \t\r\n")
    if text.startswith("<") and "<launch" in text:
        return _refuse_launch
    if text.startswith(("%YAML:", "{", "<")) or "opencv-matrix" in text:
        return _opencv_poses
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if path.suffix.lower() in _YAML_SUFFIXES or (lines and re.match(r"---$|-$|- |\w+:( |$)", lines[0])):
        return _yaml_poses
    if lines and all(_NUMBER.fullmatch(word) for word in _words(lines[0])):
        return _rows_of_numbers
    if lines and sum(bool(_OF_ROS.fullmatch(name.strip(' "'))) for name in lines[0].split(",")) >= 7:
        return _ros_messages
    return None


# ---- Lines of numbers ----------------------------------------------------------------------------


def _words(line: str) -> list[str]:
    return _BETWEEN.split(line.strip(" \t,;"))


def _rows_of_numbers(path: Path, setup: Setup | None) -> OtherPoses:
    lines, rows = _numbers_of_lines(path)
    values = np.array(rows)
    count = values.shape[1]

    def where(row: int) -> str:
        return f"{path}, line {lines[row]}"

    if count == 8:  # TUM: t x y z qx qy qz qw
        frames = frames_from_quaternions(values[:, 1:4], values[:, [7, 4, 5, 6]], where)
        return OtherPoses(path, "lines of time, position and quaternion", either=frames, time=values[:, 0])
    if count == 4:
        if len(values) % 4:
            raise InputError(
                f"{where(len(values) - 1)}: the file ends within a matrix: it has {len(values)} lines of 4"
                " numbers, expected 4 for each pose"
            )
        lines, values = lines[::4], values.reshape(-1, 16)
    if values.shape[1] not in (12, 16):
        hint = (
            ". What position and orientation are in these, a line of names says: "
            "hand_x_m,hand_y_m,hand_z_m,hand_qw,hand_qx,hand_qy,hand_qz (or hand_rx_deg … with --angles)"
            if count in (6, 7, 13, 14)
            else ""
        )
        raise InputError(
            f"{where(0)}: found {count} numbers, expected 16 (a matrix), 12 (without its last row), 4 lines"
            f" of 4, or 8 (time, position, quaternion x y z w){hint}"
        )
    frames, by_columns = frames_from_rows(values, where)
    if by_columns:
        warnings.warn(InputWarning(f"{path}: the matrices are written column by column"), stacklevel=2)
    return OtherPoses(path, "lines of numbers", either=frames)


def _numbers_of_lines(path: Path) -> tuple[list[int], list[list[float]]]:
    """Numbers of the lines, counted from 1, and what stands there; blank lines and comments (#) are passed
    over.
    """
    lines: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(decoded(path, read_bytes(path, _LARGEST_TEXT)).splitlines(), 1):
        bare = line.partition("#")[0].strip()
        if not bare:
            continue
        words = _words(bare)
        for word in words:
            if not _NUMBER.fullmatch(word):
                raise InputError(f"{path}, line {number}: found {shown(word)}, expected a number")
        if rows and len(words) != len(rows[0]):
            raise InputError(
                f"{path}, line {number}: found {len(words)} numbers, expected {len(rows[0])} as in line"
                f" {lines[0]}"
            )
        lines.append(number)
        rows.append([float(word) for word in words])
    return lines, rows


# ---- ROS messages as CSV -------------------------------------------------------------------------


def _ros_messages(path: Path, setup: Setup | None) -> OtherPoses:
    """PoseStamped, TransformStamped and what holds them, as `rostopic echo -p`, exports of rosbag and
    PlotJuggler write them: one column per field.
    """
    table = Table(path)
    columns = _columns_of_ros(table)
    frames = [name for name in table.names if name.endswith("frame_id")]
    table.read([*columns.values()], frames)
    _require_one_frame(table, frames)
    position = np.column_stack([table.numbers(columns[axis]) for axis in ("x", "y", "z")])
    q = np.column_stack([table.numbers(columns[axis]) for axis in ("qw", "qx", "qy", "qz")])
    time = _stamps(table)
    return OtherPoses(
        path,
        "a CSV of ROS messages",
        either=frames_from_quaternions(position, q, lambda row: f"{path}, line {row + 2}"),
        time=time,
    )


def _columns_of_ros(table: Table) -> dict[str, str]:
    """Names of the columns by what they hold: x y z qw qx qy qz."""
    messages: dict[str, dict[str, str]] = {}
    for name in table.names:
        match = _OF_ROS.fullmatch(name)
        if match:
            turned = match["part"] in ("orientation", "rotation")
            messages.setdefault(match["message"] or "", {})["q" * turned + match["axis"]] = name
    whole = {
        message: columns
        for message, columns in messages.items()
        if {"x", "y", "z", "qw", "qx", "qy", "qz"} <= columns.keys()
    }
    if len(whole) != 1:
        named = listed([message or "(no name)" for message in whole or messages])
        table.refuse(
            f"found {len(whole)} poses in each row ({named}), expected one, position (or translation) x y z"
            " and orientation (or rotation) x y z w: export one topic"
        )
    return next(iter(whole.values()))


def _require_one_frame(table: Table, names: Sequence[str]) -> None:
    """All rows are of one transform: an export of /tf holds many."""
    for name in names:
        codes, frames = table.labels(name)
        other = np.flatnonzero(codes != codes[0])
        if other.size:
            word = frames[codes[other[0]]] if codes[other[0]] >= 0 else ""
            table.refuse(
                f"found the frame {word!r}, expected {frames[codes[0]]!r} as in the first row: export one"
                " transform, not all of /tf",
                row=int(other[0]),
                column=name,
            )


def _stamps(table: Table) -> Floats | None:
    """[s] the header's stamp, else when the message was recorded."""
    by_end = {name.replace("/", "."): name for name in reversed(table.names)}

    def column(*ends: str) -> str | None:
        for end in ends:
            for name, real in by_end.items():
                if name == end or name.endswith("." + end):
                    return real
        return None

    def numbers(name: str) -> Floats:
        return table.numbers(name, largest=1e20)

    whole, part = column("stamp.secs", "stamp.sec"), column("stamp.nsecs", "stamp.nanosec")
    if whole and part:
        return numbers(whole) + 1e-9 * numbers(part)
    name = column("stamp", "%time", "__time", "time", "Time", "timestamp", "rosbagTimestamp", "t_s")
    if name is None:
        return None
    time = numbers(name)
    return time / 1e9 if np.abs(time).max() > _NANOSECONDS else time


# ---- Samples of easy_handeye and MoveIt ----------------------------------------------------------


def _yaml_poses(path: Path, setup: Setup | None) -> OtherPoses:
    document = Document.read(path, "file of hand-eye samples", lists=True)
    value = document.value
    if isinstance(value, list):
        return _moveit_samples(document)
    if is_visp_matrix(value):
        document.refuse(
            (),
            "found one pose of ViSP, expected all of them: give the name with %d for the number,"
            " pose_fPe_%d.yaml, and the poses of the board as --board-poses pose_cPo_%d.yaml",
        )
    samples = value.get("samples")
    if isinstance(samples, list):
        return _easy_handeye2_samples(document, setup)
    if isinstance(samples, dict) or "hand_world_samples" in value:
        return _easy_handeye_samples(document, setup)
    if "transform" in value or "transformation" in value:
        document.refuse(
            (),
            "found the result of a calibration (where the camera is), expected what it was found from: give"
            f" the file of samples, {_SAMPLES}, and this one with --compare",
        )
    document.refuse((), f"found the keys {listed([str(key) for key in value])}, expected {_SAMPLES}")


def _moveit_samples(document: Document) -> OtherPoses:
    """moveit_calibration, "Save samples": matrices row by row."""
    if not document.value:
        document.refuse((), f"found an empty list, expected {_SAMPLES}")
    hand, board = (_matrices(document, key) for key in ("effector_wrt_world", "object_wrt_sensor"))
    return OtherPoses(document.path, "samples of MoveIt", hand=hand, board=board)


def _matrices(document: Document, key: str) -> Floats:
    values = [
        _numbers(document, (index, key), _at(document, sample, (index,), key), 16)
        for index, sample in enumerate(document.value)
    ]
    return frames_from_rows(np.array(values), lambda row: _line(document, (row, key)))[0]


def _easy_handeye2_samples(document: Document, setup: Setup | None) -> OtherPoses:
    samples = document.value["samples"]
    places: list[Loc] = [("samples", index) for index in range(len(samples))]
    if not samples:
        document.refuse(("samples",), f"found an empty list, expected {_SAMPLES}")
    for place, sample in zip(places, samples, strict=True):
        if not isinstance(sample, dict):
            document.refuse(place, f"found {found(sample)}, expected robot and tracking")
    seen = "optical" if "optical" in samples[0] else "tracking"
    return _easy(
        document,
        setup,
        [(*place, "robot") for place in places],
        [(*place, seen) for place in places],
        "samples of easy_handeye2",
    )


def _easy_handeye_samples(document: Document, setup: Setup | None) -> OtherPoses:
    base: Loc = ("samples",) if isinstance(document.value.get("samples"), dict) else ()
    sides: list[list[Loc]] = []
    for key in ("hand_world_samples", "camera_marker_samples"):
        holder = _at(document, _value(document, base), base, key)
        transforms = _at(document, holder, (*base, key), "transforms")
        if not isinstance(transforms, list) or not transforms:
            document.refuse(
                (*base, key, "transforms"), f"found {found(transforms)}, expected a list of transforms"
            )
        sides.append([(*base, key, "transforms", index) for index in range(len(transforms))])
    if len(sides[0]) != len(sides[1]):
        document.refuse(
            (*base, "camera_marker_samples"),
            f"found {len(sides[1])} transforms, expected {len(sides[0])} as in hand_world_samples",
        )
    return _easy(document, setup, sides[0], sides[1], "samples of easy_handeye")


def _easy(
    document: Document, setup: Setup | None, hand: Sequence[Loc], board: Sequence[Loc], tool: str
) -> OtherPoses:
    """Where the camera stands in the cell, these tools write the base in the hand."""
    told = _setup_told(document)
    if told is not None and setup is not None and told != setup:
        document.refuse(
            ("parameters",), f"the samples are those of a camera {told}, expected {setup}: say --setup {told}"
        )
    frames = _transforms(document, hand)
    if (told or setup) == "eye-to-hand":
        frames = np.asarray(np.linalg.inv(frames), dtype=np.float64)
    return OtherPoses(document.path, tool, hand=frames, board=_transforms(document, board))


def _setup_told(document: Document) -> Setup | None:
    parameters = document.value.get("parameters")
    if not isinstance(parameters, dict):
        return None
    kind = parameters.get("calibration_type")
    if kind is None and isinstance(parameters.get("eye_on_hand"), bool):
        return "eye-in-hand" if parameters["eye_on_hand"] else "eye-to-hand"
    if kind in (None, ""):
        return None
    if kind not in ("eye_in_hand", "eye_on_base"):
        document.refuse(
            ("parameters", "calibration_type"), f"found {found(kind)}, expected eye_in_hand or eye_on_base"
        )
    return "eye-in-hand" if kind == "eye_in_hand" else "eye-to-hand"


def _transforms(document: Document, places: Sequence[Loc]) -> Floats:
    """geometry_msgs/Transform, as a mapping: translation x y z, rotation x y z w."""
    positions: list[list[float]] = []
    quaternions: list[list[float]] = []
    for place in places:
        value = _value(document, place)
        if isinstance(value, dict) and "transform" in value:  # TransformStamped
            place, value = (*place, "transform"), value["transform"]
        for key, axes, out in (("translation", "xyz", positions), ("rotation", "wxyz", quaternions)):
            part = _at(document, value, place, key)
            out.append(
                [
                    _number(document, (*place, key, axis), _at(document, part, (*place, key), axis))
                    for axis in axes
                ]
            )
    return frames_from_quaternions(
        np.array(positions), np.array(quaternions), lambda row: _line(document, places[row])
    )


# ---- Values of a document ------------------------------------------------------------------------


def _line(document: Document, place: Loc) -> str:
    line = document.line(place)
    return f"{document.path}, line {line}" if line else str(document.path)


def _value(document: Document, place: Loc) -> Any:
    """What stands at `place`, or an error that says how far it goes."""
    value: Any = document.value
    at: Loc = ()
    for step in place:
        if isinstance(step, str):
            value = _at(document, value, at, step)
        else:
            value = value[step]
        at = (*at, step)
    return value


def _at(document: Document, value: Any, place: Loc, key: str) -> Any:
    if not isinstance(value, dict):
        document.refuse(place, f"found {found(value)}, expected a mapping with the key {key}")
    if key not in value:
        document.refuse(place, f"found the keys {listed([str(k) for k in value])}, expected one called {key}")
    return value[key]


def _number(document: Document, place: Loc, value: Any) -> float:
    if not isinstance(value, Decimal) or not math.isfinite(float(value)):
        document.refuse(place, f"found {found(value)}, expected a finite number")
    return float(value)


def _numbers(document: Document, place: Loc, value: Any, count: int) -> list[float]:
    if not isinstance(value, list) or len(value) != count:
        document.refuse(place, f"found {found(value)}, expected a list of {count} numbers")
    return [_number(document, (*place, index), item) for index, item in enumerate(value)]


# ---- OpenCV, launch files ------------------------------------------------------------------------


def _opencv_poses(path: Path, setup: Setup | None) -> OtherPoses:
    poses = read_opencv_poses(path)
    return OtherPoses(
        path,
        "matrices of OpenCV",
        hand=poses.get("hand"),
        board=poses.get("board"),
        either=poses.get("either"),
    )


def _refuse_launch(path: Path, setup: Setup | None) -> NoReturn:
    raise InputError(
        f"{path}: found a launch file, which holds the result of a calibration (where the camera is),"
        f" expected what it was found from: give the file of samples, {_SAMPLES}, and this one with --compare"
    )
