# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""ABB: MOC.cfg, the motion configuration of an IRC5 or OmniCore controller (SYSPAR/MOC.cfg of a backup).

It does not hold link lengths: these come from the data sheet of the robot type that it names, or from a robot
file beside it. It holds joint limits, and where each resolver stands at the calibration position
(`cal_offset`, motor radians): not an error of the joint's zero, but what the controller subtracts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.errors import InputError
from truing.files.arms import ARMS, Arm, arms_of
from truing.files.common import decoded, listed, read_bytes, shown
from truing.files.controller_parts import ControllerModel, unknown_arm
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_quaternions

_MAKER = "ABB"
_LARGEST = 16_000_000
_ENDLESS = 100.0  # [rad] a bound beyond this is none: ABB writes such for joints that turn on
_TOKEN = re.compile(r'\s*-(?P<key>[A-Za-z_]\w*)(?:\s+(?:"(?P<text>[^"]*)"|(?P<word>(?!-[A-Za-z_])\S+)))?')
_USED = (
    "ROBOT",
    "ROBOT_SERIAL_NUMBER",
    "ARM",
    "ARM_LOAD",
    "ARM_CALIB",
    "JOINT_CALIB",
    "MOTOR_CALIB",
    "TRANSMISSION",
)
_OFFSETS = ("error_offset_x", "error_offset_y", "error_offset_z")
_ANGLES = ("error_roll", "error_pitch", "error_jaw")


@dataclass(frozen=True)
class _Instance:
    """One `-name "rob1_1" -key value ...` of a section, and its line."""

    line: int
    values: Mapping[str, str]

    @property
    def name(self) -> str:
        return self.values.get("name", "")


Sections = dict[str, list[_Instance]]


def robot_from_moc(path: Path, arm: str, beside: _core.Robot | None) -> ControllerModel:
    """The robot of a MOC.cfg. arm: its data sheet; "": that of the robot type. beside: a robot of the user's
    instead. Raises InputError.
    """
    sections = _sections(path)
    unit = _one_robot(path, sections)
    robot_type = unit.values.get("use_robot_type", "")
    base, sheet = _geometry(path, robot_type, arm, beside)
    names = [unit.values[key] for key in sorted(unit.values) if key.startswith("use_joint_")]
    driven = base.driven_joints()
    if len(names) != len(driven):
        raise InputError(
            f"{path}, line {unit.line}: {unit.name} has {len(names)} joints ({listed(names)}), {sheet} has"
            f" {len(driven)}"
        )
    limits = _limits(path, sections, names)
    joints = [joint.copy() for joint in base.joints]
    for index, (lower, upper) in zip(driven, limits, strict=True):
        joints[index].lower, joints[index].upper = lower, upper
    robot = base.replace(joints=joints, T_measurement_base=_base_frame(path, unit, base))
    offsets = _cal_offsets(path, sections, names)
    ratios = _ratios(path, sections, names)
    loads, load_notes = _loads(path, sections, names)
    absolute, accuracy = _absolute_accuracy(path, sections, unit, names)
    return ControllerModel(
        robot=robot,
        kind="ABB MOC.cfg",
        arm=sheet,
        understood=(
            ("robot", f"{unit.name}, type {robot_type or 'not stated'}, {_serial(sections)}"),
            ("link lengths", f"of {sheet}: the file has none"),
            ("joint limits", "of the file"),
            ("absolute accuracy", absolute),
            *((f"motor at calibration, {name}", text) for name, text in _offset_lines(offsets, ratios)),
            *loads,
        ),
        warnings=tuple(accuracy),
        not_understood=(*load_notes, *_left(sections, unit, names)),
        calibration={
            "source": path.name,
            "controller": "ABB MOC.cfg",
            "arm": sheet,
            "robot_type": robot_type,
            "absolute_accuracy": absolute.startswith("on"),
            "cal_offset_motor_rad": offsets,
            **({"motor_turns_per_joint_turn": ratios} if ratios else {}),
        },
    )


# ---- The file ------------------------------------------------------------------------------------


def _sections(path: Path) -> Sections:
    text = decoded(path, read_bytes(path, _LARGEST))
    lines = text.splitlines()
    head = lines[0].strip() if lines else ""
    if not head.startswith("MOC:CFG"):
        raise InputError(
            f"{path}, line 1: found {shown(head)}, expected MOC:CFG_1.0 …, the motion configuration of an ABB"
            " controller (SYSPAR/MOC.cfg of a backup)"
        )
    sections: Sections = {}
    section, begun, pending = "", 0, ""
    for number, line in enumerate(lines[1:], 2):
        content = line.strip()
        if not pending and re.fullmatch(r"[A-Z][A-Z0-9_]*:", content):
            section = content[:-1]
            sections.setdefault(section, [])
        elif content and not content.startswith("#"):
            begun = begun if pending else number
            pending += " " + content.removesuffix("\\")
            if content.endswith("\\"):
                continue
            sections.setdefault(section, []).append(_Instance(begun, _values(path, begun, pending)))
            pending = ""
    if pending:
        raise InputError(f"{path}, line {begun}: ends in the middle of an entry: the file is cut off")
    return sections


def _values(path: Path, line: int, text: str) -> dict[str, str]:
    values: dict[str, str] = {}
    place = 0
    while text[place:].strip():
        match = _TOKEN.match(text, place)
        if match is None:
            raise InputError(f"{path}, line {line}: found {shown(text[place:].strip())}, expected -key value")
        values[match["key"]] = match["text"] if match["text"] is not None else match["word"] or ""
        place = match.end()
    return values


def _number(path: Path, instance: _Instance, key: str) -> float:
    text = instance.values.get(key, "0")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{path}, line {instance.line}: -{key} of {shown(instance.name)} is {shown(text)}, expected a"
            " number"
        )
    return value


def _of(sections: Sections, section: str, name: str) -> _Instance | None:
    return next((instance for instance in sections.get(section, ()) if instance.name == name), None)


# ---- What is understood --------------------------------------------------------------------------


def _one_robot(path: Path, sections: Sections) -> _Instance:
    robots = sections.get("ROBOT", [])
    if len(robots) != 1:
        names = listed([robot.name for robot in robots])
        raise InputError(
            f"{path}: has {len(robots)} robots{f' ({names})' if names else ''}, expected one: keep one entry"
            " of ROBOT in a copy of the file"
        )
    return robots[0]


def _geometry(path: Path, robot_type: str, arm: str, beside: _core.Robot | None) -> tuple[_core.Robot, str]:
    """The robot whose links it has, and how that is called."""
    if beside is not None:
        return beside, arm
    if arm:
        sheet: Arm | None = ARMS.get(arm.lower())
        if sheet is None or sheet.maker != _MAKER:
            raise unknown_arm(path, arm, [one.name for one in arms_of(_MAKER)], "robot.yaml")
        return sheet.robot(), sheet.name
    short = re.sub(r"^ROB\d+_", "", robot_type)
    for sheet in arms_of(_MAKER):
        if any(short.startswith(known) for known in sheet.types):
            return sheet.robot(), sheet.name
    raise InputError(
        f"{path}: there is no data sheet of {robot_type or 'a robot without type'} here (those known are"
        f" {listed([one.name for one in arms_of(_MAKER)])}): give the robot file beside it,"
        f" {path.name}@robot.yaml"
    )


def _serial(sections: Sections) -> str:
    numbers = [
        f"{one.values.get('robot_serial_number_high_part', '').strip()}-"
        f"{one.values.get('robot_serial_number_low_part', '').strip()}"
        for one in sections.get("ROBOT_SERIAL_NUMBER", ())
    ]
    return f"serial number {listed(numbers)}" if numbers else "no serial number"


def _limits(path: Path, sections: Sections, names: list[str]) -> list[tuple[float, float]]:
    limits = []
    for name in names:
        arm = _of(sections, "ARM", name)
        if arm is None:
            raise InputError(f'{path}: ARM has no entry of joint "{name}", which ROBOT uses')
        lower, upper = (_number(path, arm, f"{side}_joint_bound") for side in ("lower", "upper"))
        if not lower < upper:
            raise InputError(
                f"{path}, line {arm.line}: joint bounds of {name} are {lower:g} and {upper:g}, expected"
                " lower < upper"
            )
        limits.append((-math.inf if lower < -_ENDLESS else lower, math.inf if upper > _ENDLESS else upper))
    return limits


def _base_frame(path: Path, unit: _Instance, robot: _core.Robot) -> Any:
    """The robot's base in the world, where it is stated: else the robot's own."""
    if not any(
        key.startswith("base_frame_pos") or key.startswith("base_frame_orient") for key in unit.values
    ):
        return robot.T_measurement_base
    T = np.eye(4)
    T[:3, 3] = [_number(path, unit, f"base_frame_pos_{axis}") for axis in "xyz"]
    q = np.array([_number(path, unit, f"base_frame_orient_u{k}") for k in range(4)])
    if "base_frame_orient_u0" not in unit.values:  # ABB leaves out what has its usual value
        q[0] = 1.0 if not q[1:].any() else math.sqrt(max(0.0, 1.0 - float(q[1:] @ q[1:])))
    if abs(float(np.linalg.norm(q)) - 1.0) > UNIT_LENGTH_OFF:
        raise InputError(
            f"{path}, line {unit.line}: base_frame_orient is {q.tolist()}, expected a quaternion of length 1"
        )
    T[:3, :3] = rotations_from_quaternions(q[None])[0]
    return T


def _cal_offsets(path: Path, sections: Sections, names: list[str]) -> dict[str, float]:
    """[rad] of the motor; joints whose calibration is not marked as valid are left out."""
    offsets = {}
    for name in names:
        motor = _of(sections, "MOTOR_CALIB", name)
        if motor is not None and "valid_cal_offset" in motor.values:
            offsets[name] = _number(path, motor, "cal_offset")
    return offsets


def _ratios(path: Path, sections: Sections, names: list[str]) -> dict[str, float]:
    """Motor turns for one of the joint, where the file has them (ABB hides those of its own arms)."""
    found = {name: _of(sections, "TRANSMISSION", name) for name in names}
    ratios = {
        name: _number(path, one, "transm_joint")
        for name, one in found.items()
        if one is not None and "transm_joint" in one.values
    }
    for name, ratio in ratios.items():
        if ratio == 0:
            raise InputError(f"{path}: transm_joint of {name} is 0, expected a gear ratio")
    return ratios


def _offset_lines(offsets: Mapping[str, float], ratios: Mapping[str, float]) -> list[tuple[str, str]]:
    return [
        (
            name,
            f"{value:.5f} rad at the motor"
            + (f", {math.degrees(value / ratios[name]):.5f} deg at the joint" if name in ratios else ""),
        )
        for name, value in offsets.items()
    ]


def _loads(path: Path, sections: Sections, names: list[str]) -> tuple[list[tuple[str, str]], list[str]]:
    """Masses fixed to arms, as lines; and what cannot be placed."""
    used: dict[str, str] = {}
    for name in names:
        arm = _of(sections, "ARM", name)
        if arm is not None and arm.values.get("use_customer_arm_load"):
            used[arm.values["use_customer_arm_load"]] = name
    lines, notes = [], []
    for load in sections.get("ARM_LOAD", ()):
        mass = _number(path, load, "mass")
        if mass < 0:
            raise InputError(f"{path}, line {load.line}: mass of {load.name} is {mass:g}, expected 0 or more")
        if mass == 0:
            continue
        center = ", ".join(f"{_number(path, load, f'mass_centre_{axis}'):g}" for axis in "xyz")
        where = f"on {used[load.name]}" if load.name in used else "used by no arm"
        lines.append((f"arm load {load.name}", f"{mass:g} kg at {center} m, {where}"))
        if load.name in used:
            notes.append(
                f"ARM_LOAD {load.name}: {mass:g} kg hang on {used[load.name]}, whose frame the file does not"
                " define: put mass and com into robot.yaml if gravity matters"
            )
    return lines, notes


def _absolute_accuracy(
    path: Path, sections: Sections, unit: _Instance, names: list[str]
) -> tuple[str, list[str]]:
    """Whether the controller corrects itself, in words, and the warning that goes with it."""
    calib = unit.values.get("use_robot_calib", "")
    arms = [arm for name in names if (arm := _of(sections, "ARM_CALIB", name)) is not None]
    length = max((math.hypot(*(_number(path, arm, key) for key in _OFFSETS)) for arm in arms), default=0.0)
    angle = max((math.hypot(*(_number(path, arm, key) for key in _ANGLES)) for arm in arms), default=0.0)
    table = f"errors of up to {1e3 * length:.3f} mm and {1e3 * angle:.3f} mrad a link in ARM_CALIB"
    if not calib:
        return "not stated", [f"{path.name}: does not say whether absolute accuracy is on (use_robot_calib)"]
    if calib.endswith("uncalib"):
        unused = f"; {table} are not used" if length or angle else ""
        return f"off (use_robot_calib {calib}){unused}", [
            f"{path.name}: absolute accuracy is off (use_robot_calib {calib}): the controller works with the"
            f" data sheet{unused}"
        ]
    return f"on (use_robot_calib {calib}): {table}", [
        f"{path.name}: absolute accuracy is on (use_robot_calib {calib}): the controller corrects its"
        f" targets itself by {table}, whose frames are not published, so that this robot lacks them: joints"
        " that it shows are those after its correction. Switch absolute accuracy off before measuring and"
        " compensating, or calibrate and compensate poses, never joints"
    ]


def _left(sections: Sections, unit: _Instance, names: list[str]) -> list[str]:
    """What the file holds and the robot does not, in few lines."""
    left = []
    compliances = [
        f"{name} {one.values['Compl']}"
        for name in names
        if (one := _of(sections, "JOINT_CALIB", name)) is not None and "Compl" in one.values
    ]
    if compliances:
        left.append(f"JOINT_CALIB: joint compliance, used with absolute accuracy only: {listed(compliances)}")
    others = [one.name for one in sections.get("ARM", ()) if one.name not in names]
    if others:
        left.append(f"external axes: {listed(others)}")
    coupled = [
        one.name
        for one in sections.get("ARM", ())
        if "upper_joint_coupl_bound" in one.values or "lower_joint_coupl_bound" in one.values
    ]
    if coupled:
        left.append(f"limits of the sum of two joints at {listed(coupled)}")
    if "base_frame_coordinated" in unit.values:
        left.append(f"base frame moved by {unit.values['base_frame_coordinated']}")
    rest = sorted(set(sections) - set(_USED) - {""})
    if rest:
        left.append(f"sections that say nothing of the kinematics: {listed(rest, 40)}")
    return left
