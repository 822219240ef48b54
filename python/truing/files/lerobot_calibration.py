# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""LeRobot: the calibration of a bus of servos, ~/.cache/huggingface/lerobot/calibration/**/NAME.json.

For each motor homing_offset, which the servo subtracts from its count, drive_mode, and the range that was
recorded while somebody moved the joint. In degrees a position is (count - middle of the range) * 360 /
(resolution - 1) (lerobot, MotorsBus._normalize): the joint's zero is the middle of what a hand went through,
with the homing of a pose that it held. Geometry is not in it: that is a URDF's beside it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from truing import _core
from truing.errors import InputError
from truing.files.common import PathLike, decoded, listed, read_bytes, shown
from truing.files.controller_parts import ControllerModel

_LARGEST = math.radians(45)  # of a zero that a range can give way to
COUNTS = 4096
"""Of one turn: STS3215 and XL330, XL430 servos."""

_LARGEST_COUNT = 1_000_000  # far beyond what any servo counts
_FIELDS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")
_OLD = ("motor_names", "calib_mode")


@dataclass(frozen=True)
class MotorCalibration:
    """One motor. homing_offset, range_min, range_max: counts."""

    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    @property
    def middle(self) -> float:
        """[counts] where the joint reads zero."""
        return 0.5 * (self.range_min + self.range_max)

    @property
    def half_range(self) -> float:
        """[rad] from zero to either end."""
        return 0.5 * (self.range_max - self.range_min) * radians_per_count()


def radians_per_count() -> float:
    """As LeRobot converts counts to degrees."""
    return 2 * math.pi / (COUNTS - 1)


def load_lerobot_calibration(path: PathLike) -> dict[str, MotorCalibration]:
    """Motors by name, in the file's order. Raises InputError."""
    path = Path(path)
    try:
        document = json.loads(decoded(path, read_bytes(path, 1_000_000)))
    except (json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is no JSON: {error}") from None
    if isinstance(document, dict) and any(key in document for key in _OLD):
        raise InputError(
            f"{path}: is a calibration of LeRobot before 0.2 ({listed(_OLD)}), whose zeros are two poses:"
            " calibrate with a newer one"
        )
    if not isinstance(document, dict) or not document:
        raise InputError(f"{path}: expected motors by name, each with {listed(_FIELDS)}")
    motors = {name: _motor(path, name, entry) for name, entry in document.items()}
    taken: dict[int, str] = {}
    for name, motor in motors.items():
        if motor.id in taken:
            raise InputError(f"{path}: {name} and {taken[motor.id]} both have id {motor.id}")
        taken[motor.id] = name
    return motors


def _motor(path: Path, name: str, entry: object) -> MotorCalibration:
    if not isinstance(entry, dict):
        raise InputError(f"{path}: {shown(name)} is {shown(entry)}, expected {listed(_FIELDS)}")
    values = {}
    for key in _FIELDS:
        value = entry.get(key)
        if not isinstance(value, int) or isinstance(value, bool) or abs(value) > _LARGEST_COUNT:
            raise InputError(f"{path}: {key} of {shown(name)} is {shown(value)}, expected a whole number")
        values[key] = value
    motor = MotorCalibration(**values)
    if motor.range_min >= motor.range_max:
        raise InputError(
            f"{path}: the range of {shown(name)} is {motor.range_min} to {motor.range_max}, expected"
            " range_min < range_max"
        )
    if motor.range_max - motor.range_min >= COUNTS:
        raise InputError(
            f"{path}: the range of {shown(name)} is more than the {COUNTS} counts of one turn: other servos"
            " than STS3215, XL330 and XL430?"
        )
    return motor


def moved_zero(name: str, motor: MotorCalibration, offset: float) -> MotorCalibration:
    """A motor with the zero moved so that what is read becomes reading + offset [rad]; one end of the range
    gives way. Raises InputError: more than 45 degrees, or than the range has.
    """
    twice = round(2 * offset / radians_per_count())
    if abs(offset) > _LARGEST or abs(twice) >= motor.range_max - motor.range_min:
        raise InputError(
            f"{name}: its zero is {math.degrees(offset):.1f} deg off, more than a range can give way: hold"
            " the arm in its middle pose and calibrate it with LeRobot again"
        )
    if twice > 0:
        return replace(motor, range_max=motor.range_max - twice)
    return replace(motor, range_min=motor.range_min - twice)


def matched_motors(
    path: PathLike, motors: Mapping[str, MotorCalibration], robot: _core.Robot
) -> dict[str, str]:
    """Name of the motor by name of the driven joint: equal names, or else ids in the order of the chain.

    Raises InputError where neither fits.
    """
    joints = [robot.joints[index].name for index in robot.driven_joints()]
    by_key = {_key(name): name for name in motors}
    named = {joint: by_key[_key(joint)] for joint in joints if _key(joint) in by_key}
    if len(named) == len(joints):
        return named
    by_id = sorted(motors, key=lambda name: motors[name].id)
    if not named and len(by_id) >= len(joints) and all(joint.strip("joint_J").isdigit() for joint in joints):
        return dict(zip(joints, by_id, strict=False))
    missing = [joint for joint in joints if joint not in named]
    raise InputError(
        f"{path}: has no motor for joint {listed(missing)}: its motors are {listed(list(motors))}: another"
        " robot, or choose the chain (--base-link, --tip-link)"
    )


def _key(name: str) -> str:
    return name.lower().removesuffix("_joint").replace("_", "").replace("-", "").replace(".pos", "")


def robot_from_lerobot(path: Path, beside: _core.Robot, beside_name: str) -> ControllerModel:
    """The robot beside, with the ranges of the calibration as limits. Raises InputError."""
    motors = load_lerobot_calibration(path)
    matched = matched_motors(path, motors, beside)
    joints = [joint.copy() for joint in beside.joints]
    lines, warnings = [], []
    for joint in joints:
        if joint.name not in matched:
            continue
        motor = motors[matched[joint.name]]
        middle = 0.5 * (joint.lower + joint.upper)
        if math.isfinite(middle) and abs(middle) > math.radians(5):
            warnings.append(
                f"{path.name}: {joint.name}: the middle of the range, LeRobot's zero, is at"
                f" {math.degrees(middle):+.1f} deg of {beside_name}: the two zeros are not the same"
            )
        joint.lower, joint.upper = -motor.half_range, motor.half_range
        lines.append(
            (
                joint.name,
                f"motor {motor.id}, zero at count {motor.middle:g}, homing offset {motor.homing_offset},"
                f" {math.degrees(motor.half_range):.1f} deg each way",
            )
        )
        if motor.drive_mode:
            warnings.append(
                f"{path.name}: {joint.name}: drive_mode is {motor.drive_mode}, which turns the sign of"
                " percentages and not that of degrees"
            )
    warnings.append(
        f"{path.name}: a joint's zero is the middle of the range that was recorded by hand, after homing at"
        " a pose that somebody held: errors of some degrees are usual; identify finds them (J.offset,"
        " J.theta)"
    )
    left = [name for name in motors if name not in matched.values()]
    return ControllerModel(
        robot=beside.replace(joints=joints),
        kind="LeRobot calibration",
        arm=beside_name,
        understood=(("geometry", f"of {beside_name}"), *lines),
        warnings=tuple(warnings),
        not_understood=tuple(f"{name}: no joint of the chain" for name in left),
        calibration={
            "source": path.name,
            "controller": "LeRobot",
            "arm": beside_name,
            "motors": {
                joint: {key: getattr(motors[name], key) for key in _FIELDS} for joint, name in matched.items()
            },
        },
    )
