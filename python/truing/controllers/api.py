# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values of a calibration for controllers and descriptions: frames, zeros, joint origins."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.controllers import frames, lerobot, ros2_control, tf, ur_description, urdf, zeros
from truing.controllers.distances import Dropped, dropped_effects, dropped_links, dropped_ratios
from truing.controllers.frames import BRANDS, NamedFrame, in_flange, inverse
from truing.controllers.nearest import Freedom, Nearest, nearest
from truing.controllers.written import Written
from truing.errors import InputError
from truing.files import FLANGE, Brand, last_to_flange, load_robot, says_flange
from truing.files.common import PathLike, decoded, read_bytes, shown
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_quaternions

Floats = NDArray[np.float64]
Format = Literal["frames", "ur_description", "urdf", "ros2_control", "tf", "lerobot", "zeros"]
FORMATS: tuple[Format, ...] = get_args(Format)
NEEDS_NOMINAL: tuple[Format, ...] = ("ros2_control", "lerobot", "zeros")

HANDEYE = "truing-handeye/1"
_RESULT = "result.json"
_ROBOT = "robot.yaml"
_INVERSE = "robot_base"  # says the same as measurement_frame, from the other side


@dataclass(frozen=True)
class Calibration:
    """A result: a calibrated robot, or frames of a camera and its board. source: the file."""

    source: Path
    robot: _core.Robot | None = None
    frames: Sequence[NamedFrame] = ()


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """nominal: the robot that the controller believes in; with it frames are those that bring it nearest to
    the calibrated one. brands: of frames. source: URDF whose names and meshes are kept; base_link, tip_link:
    its chain. lerobot: LeRobot's calibration of the recorded arm. parent: of tf, the frame that tools are in
    ("tool0") or bases ("base"). child: of tf, another name of the first frame.
    """

    nominal: _core.Robot | None = None
    brands: Sequence[Brand] = BRANDS
    source: Path | None = None
    base_link: str = ""
    tip_link: str = ""
    lerobot: Path | None = None
    parent: str = ""
    child: str = ""


@dataclass(frozen=True)
class Exported:
    """What was written of which calibration."""

    name: str
    to: Format
    written: Written
    options: ExportOptions = field(repr=False)


def load_result(path: PathLike) -> Calibration:
    """The result of identify, diagnose or handeye: their folder, result.json of handeye, or a robot file.

    Raises InputError.
    """
    path = Path(path)
    if path.is_dir():
        described, robot = path / _RESULT, path / _ROBOT
        if described.exists() and _document(described).get("format") == HANDEYE:
            return Calibration(described, frames=_of_handeye(described))
        if not robot.exists():
            raise InputError(
                f"{path}: holds no {_ROBOT} and no {_RESULT} of handeye: expected the folder of identify,"
                " diagnose or handeye"
            )
        return Calibration(robot, robot=load_robot(robot))
    if path.name == _RESULT or (path.suffix == ".json" and _document(path).get("format") == HANDEYE):
        if _document(path).get("format") == HANDEYE:
            return Calibration(path, frames=_of_handeye(path))
        return load_result(path.parent)
    return Calibration(path, robot=load_robot(path))


def export(calibration: Calibration, to: Format, options: ExportOptions | None = None) -> Exported:
    """The files of a format, as text, and what they do not hold. Writes nothing.

    Raises InputError: a format that this calibration has nothing for, a nominal robot that is missing or of
    another arm.
    """
    options = options or ExportOptions()
    if to not in FORMATS:
        raise InputError(f"format {to!r} is not known, expected one of {', '.join(FORMATS)}")
    name = calibration.robot.name if calibration.robot is not None else calibration.source.parent.name
    if to in ("frames", "tf"):
        return Exported(name, to, _frames(calibration, to, options), options)
    if calibration.robot is None:
        raise InputError(f"{calibration.source}: is of handeye and has frames alone: --to frames or tf")
    return Exported(name, to, _robot_in(calibration.robot, to, options), options)


def _robot_in(robot: _core.Robot, to: Format, options: ExportOptions) -> Written:
    if to == "ur_description":
        return ur_description.written(robot)
    if to == "urdf":
        return urdf.written(robot, options.source, options.base_link, options.tip_link)
    if options.nominal is None:
        raise InputError(
            f"--to {to} needs --nominal, the robot that the controller believes in: zeros are against it"
        )
    freedoms: tuple[Freedom, ...] = ("offset", "ratio") if to == "ros2_control" else ("offset",)
    found = nearest(options.nominal, robot, freedoms)
    if to == "ros2_control":
        return ros2_control.written(found, robot)
    if to == "zeros":
        return zeros.written(found, robot)
    if options.lerobot is None:
        raise InputError("--to lerobot needs --calibration, LeRobot's JSON that the arm was recorded with")
    return lerobot.written(found, robot, options.lerobot)


# ---- Frames --------------------------------------------------------------------------------------


def _frames(calibration: Calibration, to: Format, options: ExportOptions) -> Written:
    found: Nearest | None = None
    notes: list[str] = []
    named = list(calibration.frames)
    if calibration.robot is not None:
        robot = calibration.robot
        T_last_flange = last_to_flange(robot) if says_flange(robot) else np.eye(4)
        if options.nominal is not None:
            found = nearest(options.nominal, robot, ())
            robot, T_last_flange = found.robot, found.T_last_flange
            notes.append("frames with which the nominal robot comes nearest to the calibrated one")
        else:
            notes.append(
                "frames of the calibrated robot: right for who uses its links; for a controller that keeps"
                " its own name its robot (--nominal)"
            )
        named = _of_robot(robot, T_last_flange)
        said = options.nominal is not None or says_flange(robot)
        where = "the robot's flange" if said else "the frame after the last link"
        notes.append(f"tools stand in {where}: it has to be the maker's flange")
    if options.child:
        named[0] = NamedFrame(options.child, named[0].T, named[0].tool, named[0].about)
    if to == "tf":
        named = [frame for frame in named if frame.name != _INVERSE]
        out = tf.written(named, [options.parent or ("tool0" if frame.tool else "base") for frame in named])
    else:
        out = frames.written(named, options.brands)
    dropped: list[Dropped] = []
    if calibration.robot is not None:
        reason = "a frame is no place for it"
        dropped = [
            *([] if found is None else [dropped_links(found.after, "a frame is no place for them")]),
            *dropped_ratios(calibration.robot, reason),
            *dropped_effects(calibration.robot, reason),
        ]
    return Written(
        files=out.files,
        values=out.values,
        lines=out.lines,
        dropped=dropped,
        notes=[*out.notes, *notes],
        remaining=found.after if found is not None else None,
        extra=out.extra,
    )


def _of_robot(robot: _core.Robot, T_last_flange: Floats) -> list[NamedFrame]:
    tools = [
        NamedFrame(target.name, in_flange(target, T_last_flange), True, f"{target.name} in the flange")
        for target in robot.targets
        if target.name != FLANGE
    ]
    T = np.asarray(robot.T_measurement_base)
    return [
        *tools,
        NamedFrame("measurement_frame", inverse(T), False, "measurement frame in the robot's base"),
        NamedFrame(_INVERSE, T, False, "the robot's base in the measurement frame"),
    ]


def _of_handeye(path: Path) -> list[NamedFrame]:
    document = _document(path)
    if "camera" not in document:
        raise InputError(f"{path}: handeye ended with {shown(document.get('status'))} and has no camera")
    in_hand = document.get("setup") == "eye-in-hand"
    named = [("camera", in_hand), ("board", not in_hand)]
    return [
        NamedFrame(
            name, _frame(path, name, document[name]), tool, f"{name} in the {'flange' if tool else 'base'}"
        )
        for name, tool in named
        if name in document
    ]


def _frame(path: Path, name: str, entry: Any) -> Floats:
    try:
        values = [float(entry[key]) for key in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")]
    except (KeyError, TypeError, ValueError):
        values = [math.nan]
    if not np.isfinite(values).all() or abs(float(np.linalg.norm(values[3:])) - 1.0) > UNIT_LENGTH_OFF:
        raise InputError(
            f"{path}: {name} is {shown(entry)}, expected x_m y_m z_m and a quaternion qw qx qy qz"
        )
    T = np.eye(4)
    T[:3, 3] = values[:3]
    T[:3, :3] = rotations_from_quaternions(np.array([values[3:]]))[0]
    return T


def _document(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(decoded(path, read_bytes(path, 1_000_000_000)))
    except (json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is no JSON: {error}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected a result of truing")
    return found
