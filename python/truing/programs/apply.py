# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Replaces literal targets of programs by what to command, so that the real robot reaches the targets.

A controller believes in the nominal robot: for a pose it takes the joints of the nominal inverse
kinematics. Each target is compensated at the flange and written back in its own frame, with its own tool.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.brand_frames import NOTATIONS, Brand, frame_from_numbers, numbers_from_frame
from truing.files.flange import last_to_flange
from truing.files.program_poses import counts_j3_from_horizon
from truing.files.programs import Given, Number, Reading, Stay, Target, edited, printed, read_programs
from truing.inverse_kinematics import (
    CompensateOptions,
    Compensator,
    Conditions,
    InverseOptions,
    InverseSolver,
    Task,
)
from truing.model import Robot, Target as RobotTarget
from truing.programs.configuration import Posture, after_move, fits, posture_of, understood

Floats = NDArray[np.float64]
Status = Literal["changed", "same", "stayed"]

JOINTS = 6
# Digits after the point: at least so many, where the language takes them.
_LENGTH_DECIMALS: Mapping[Brand, int] = {"kuka": 3, "abb": 3, "fanuc": 3, "ur": 6, "yaskawa": 3}
_ANGLE_DECIMALS: Mapping[Brand, int] = {"kuka": 4, "abb": 7, "fanuc": 3, "ur": 6, "yaskawa": 2}
_JOINT_DECIMALS: Mapping[Brand, int] = {"kuka": 4, "abb": 4, "fanuc": 3, "ur": 6, "yaskawa": 0}
_TOLERANCE = 1e-9  # [m], [rad] of the solver: far below what a program prints
_MOST_TURN = math.radians(10.0)  # of a joint by a correction: zeros are not so far off
_OF_POSES = (
    0,
    1,
    2,
    4,
)  # joints that a pose must not turn so far; 4 and 6 may share a turn where they line up
_SAME_JOINT = 1e-6  # [rad] nearer to where it was a joint comes from no side
_AT_LIMIT = 1e-9  # [rad] by which rounding may put a joint beyond its limit
_STRAIGHT = 1e-9  # of the longest side squared: three points with less area between them stand in a line
_SAME_ARC = (0.01, math.radians(1.0))  # relative change of an arc's radius, turn of its plane


@dataclass(frozen=True)
class ApplyOptions:
    """given: tools, frames and pulses that the programs do not say. seed: shape=(6,) [rad], where the robot
    stands before the first move; None: not known. j3_turns_with_j2: FANUC's J3 counts from the horizon, so
    that the model's J3 is the sum of both readings; None: unless the model has that coupling itself.
    """

    given: Given = field(default_factory=Given)
    seed: Floats | None = None
    payload: float = 0.0  # [kg] at the tool
    temperature: float | None = None  # [deg C]
    j3_turns_with_j2: bool | None = None


@dataclass(frozen=True)
class Applied:
    """One target. Frames are in the robot base, lengths in m, angles in rad."""

    source: Path
    target: Target
    status: Status
    why: str = ""  # it stayed
    wanted: Floats | None = None  # shape=(4, 4) of the tool, where the program wants it
    joints: Floats | None = None  # shape=(6,) that the nominal robot takes for it
    command: Floats | None = None  # shape=(4, 4) of the tool: what is commanded
    command_joints: Floats | None = None  # shape=(6,) that the controller takes for it
    before: tuple[float, float] = (math.nan, math.nan)  # how far off the robot is by the model [m], [rad]
    after: tuple[float, float] = (math.nan, math.nan)  # likewise with the printed command
    moved: tuple[float, float] = (math.nan, math.nan)  # command against wanted
    rounding: tuple[float, float] = (math.nan, math.nan)  # what the printed digits leave
    texts: Mapping[Number, str] = field(default_factory=dict)  # new tokens
    configuration_from: str = ""

    @property
    def numbers(self) -> tuple[list[str], list[str]]:
        """Its tokens before and after."""
        old = [number.text for number in self.target.numbers]
        return old, [self.texts.get(number, number.text) for number in self.target.numbers]


@dataclass(frozen=True)
class RefusedFile:
    """A program of which nothing is written."""

    paths: tuple[Path, ...]
    message: str


@dataclass(frozen=True)
class Outcome:
    """What became of all programs."""

    brand: Brand
    targets: tuple[Applied, ...]
    stays: tuple[tuple[Path, Stay], ...]  # everything else that was left as it is
    files: Mapping[Path, bytes]
    refused: tuple[RefusedFile, ...]
    notes: tuple[str, ...]


def apply_programs(
    paths: Sequence[Path],
    nominal: Robot,
    real: Robot,
    options: ApplyOptions | None = None,
    progress: Callable[[int], object] | None = None,
) -> Outcome:
    """Programs with literal targets replaced by what to command.

    nominal: the robot as its controller believes it to be. real: as it was calibrated. The controller's
    flange is the nominal robot's (`truing.files.last_to_flange`), and stands in both on the last joint's
    link alike; their base is the controller's robot base. progress: called with targets done. Raises
    InputError where no file can be used, and for robots that are not of six joints.
    """
    options = options or ApplyOptions()
    robots = _Robots(nominal, real, options)
    readings, unread = read_programs(paths, options.given)
    refused = [RefusedFile(one.paths, one.message) for one in unread]
    done: list[Applied] = []
    stays: list[tuple[Path, Stay]] = []
    files: dict[Path, bytes] = {}
    notes: dict[str, None] = {}
    for reading in readings:
        try:
            applied = _Program(reading, robots, options).run(progress, len(done))
        except InputError as error:
            refused.append(RefusedFile(tuple(source.path for source in reading.own()), str(error)))
            continue
        done += applied
        stays += [(reading.sources[stay.source].path, stay) for stay in reading.stays]
        notes |= dict.fromkeys(reading.notes)
        texts: list[dict[Number, str]] = [{} for _ in reading.sources]
        for one in applied:
            texts[one.target.source] |= one.texts
        files |= {
            source.path: edited(source, new)
            for source, new in zip(reading.sources, texts, strict=True)
            if source in reading.own()
        }
    if not files:
        raise InputError("; ".join(one.message for one in refused))
    return Outcome(readings[0].brand, tuple(done), tuple(stays), files, tuple(refused), tuple(notes))


class _Robots:
    """The nominal and the real robot at their flange, in their base."""

    def __init__(self, nominal: Robot, real: Robot, options: ApplyOptions) -> None:
        for robot in (nominal, real):
            kinds = [robot.joints[k].type for k in robot.driven_joints()]
            if len(kinds) != JOINTS or set(kinds) != {"revolute"}:
                raise InputError(
                    f"{robot.name}: has {len(kinds)} driven joints, expected the six turning joints of an"
                    " industrial"
                    " arm: with fewer a full pose cannot be corrected"
                )
        inverse = InverseOptions(position_tolerance=_TOLERANCE, rotation_tolerance=_TOLERANCE)
        self.options = options
        conditions = self.conditions(np.zeros(JOINTS, dtype=int))
        self.compensator = Compensator(
            _at_flange(nominal, last_to_flange(nominal)),
            _at_flange(real, last_to_flange(nominal)),
            CompensateOptions(inverse=inverse, in_base=True),
            conditions,
        )
        self.nominal: InverseSolver = self.compensator.nominal
        self.real: InverseSolver = self.compensator.calibrated
        driven = [nominal.joints[k] for k in nominal.driven_joints()]
        self.limits = [(joint.lower, joint.upper) for joint in driven]
        said = options.j3_turns_with_j2
        self.j3_turns_with_j2 = counts_j3_from_horizon("fanuc", nominal) if said is None else said

    def conditions(self, direction: NDArray[np.int_]) -> Conditions:
        return Conditions(
            direction=direction.tolist(), payload=self.options.payload, temperature=self.options.temperature
        )

    def from_readings(self, brand: Brand, values: Floats) -> Floats:
        """The model's joints [rad] of joints that the controller shows [rad]."""
        q = values.copy()
        if brand == "fanuc" and self.j3_turns_with_j2:
            q[2] += q[1]
        return q

    def to_readings(self, brand: Brand, joints: Floats) -> Floats:
        values = joints.copy()
        if brand == "fanuc" and self.j3_turns_with_j2:
            values[2] -= values[1]
        return values

    def solutions(self, T_base_flange: Floats, near: Floats | None, conditions: Conditions) -> list[Floats]:
        """All joints of the nominal robot within its limits, whole turns included."""
        found: list[Floats] = []
        for solution in self.nominal.branches(Task(T_base_flange), near, conditions).solutions:
            choices = []
            for angle, (lower, upper) in zip(solution.joints, self.limits, strict=True):
                turns = [angle + 2 * math.pi * k for k in (-1, 0, 1)]
                inside = [turn for turn in turns if lower - _AT_LIMIT <= turn <= upper + _AT_LIMIT]
                bounded = math.isfinite(lower) and math.isfinite(upper)
                choices.append(inside if bounded else [angle])
            found += [np.array(way) for way in itertools.product(*choices)]
        return found


def _at_flange(robot: Robot, T_last_flange: Floats) -> Robot:
    """The robot with its flange as its only target, in its own base."""
    flange = RobotTarget(robot.targets[0].name, T_last_flange)
    return robot.replace(targets=[flange], T_measurement_base=np.eye(4))


@dataclass(frozen=True)
class _Start:
    """What a target is in the nominal robot."""

    wanted: Floats  # T_base_tool
    joints: Floats
    configuration_from: str


class _Stays(Exception):
    """A target that is left as it is."""


class _Program:
    """One program: its targets in the order in which moves first use them."""

    def __init__(self, reading: Reading, robots: _Robots, options: ApplyOptions) -> None:
        self.reading, self.robots, self.options = reading, robots, options
        self.brand = reading.brand
        self.previous: Floats | None = options.seed
        self.previous_name = "--seed"

    def run(self, progress: Callable[[int], object] | None, before: int) -> list[Applied]:
        applied: list[Applied] = []
        for target in self.reading.targets:
            applied.append(self._one(target))
            if progress is not None:
                progress(before + len(applied))
        return self._without_changed_arcs(applied)

    def _where(self, target: Target) -> str:
        return f"{self.reading.sources[target.source].path}, line {target.line}: {target.name}"

    def _one(self, target: Target) -> Applied:
        path = self.reading.sources[target.source].path
        for place, kind in ((target.tool, "tool"), (target.frame, "frame")):
            if place.T is None:
                names = ",".join(NOTATIONS[self.brand].names)
                raise InputError(
                    f"{self._where(target)}: {kind} {place.name} is not defined in the files given: say"
                    " what it is,"
                    f" --{kind} {place.name}={names}"
                )
        try:
            start = self._start(target)
        except _Stays as stays:
            return Applied(path, target, "stayed", str(stays))
        direction = np.zeros(JOINTS, dtype=int)
        if self.previous is not None:
            way = start.joints - self.previous
            direction = np.where(np.abs(way) > _SAME_JOINT, np.sign(way), 0).astype(int)
        self.previous, self.previous_name = start.joints, f"line {target.line}"
        base = Applied(
            path,
            target,
            "stayed",
            wanted=start.wanted,
            joints=start.joints,
            configuration_from=start.configuration_from,
        )
        try:
            return self._commanded(base, start, self.robots.conditions(direction))
        except _Stays as stays:
            return replace(base, why=str(stays))

    # ---- What is wanted ----

    def _start(self, target: Target) -> _Start:
        conditions = self.robots.conditions(np.zeros(JOINTS, dtype=int))
        if target.kind == "joints":
            joints = self._joints_of(target)
            return _Start(self.robots.nominal.forward(joints, conditions) @ _frame(target.tool.T), joints, "")
        try:
            pose = frame_from_numbers(self.brand, [number.value for number in target.numbers])
        except InputError as error:
            raise InputError(f"{self._where(target)}: {error}") from None
        wanted = _frame(target.frame.T) @ pose
        flange = wanted @ np.linalg.inv(_frame(target.tool.T))
        near = self.previous if target.seed is None else np.array(target.seed)
        ways = self.robots.solutions(flange, near, conditions)
        if not ways:
            raise InputError(
                f"{self._where(target)} is out of the nominal robot's reach: are --nominal, tool and"
                " frame those of"
                " the controller?"
            )
        return self._chosen(target, wanted, ways, near)

    def _joints_of(self, target: Target) -> Floats:
        values = np.array([number.value for number in target.numbers])
        if self.brand == "yaskawa":
            values = values / np.array(self.options.given.pulses)
        return self.robots.from_readings(self.brand, values if self.brand == "ur" else np.radians(values))

    def _chosen(self, target: Target, wanted: Floats, ways: list[Floats], near: Floats | None) -> _Start:
        """Of several joints those that the program means."""
        configuration = target.configuration
        source = "qnear" if target.seed is not None else self.previous_name
        if configuration is not None:
            source = "data"
            postures = [self._posture(way) for way in ways]
            why = understood(configuration, postures[0])
            if why:
                raise _Stays(why)
            ways = [way for way, posture in zip(ways, postures, strict=True) if fits(configuration, posture)]
            if not ways:
                raise _Stays(f"no solution of the nominal robot has its configuration {configuration.text}")
        if near is None and len(ways) > 1:
            raise _Stays(
                "which of several solutions is meant is not said, and no target before it says where the"
                " robot comes"
                " from: give --seed"
            )
        if near is not None:
            ways = sorted(ways, key=lambda way: float(np.abs(way - near).max()))
        return _Start(wanted, ways[0], source)

    def _posture(self, joints: Floats) -> Posture:
        conditions = self.robots.conditions(np.zeros(JOINTS, dtype=int))
        posture = posture_of(lambda q: self.robots.nominal.forward(q, conditions), joints)
        return replace(posture, joints=self.robots.to_readings(self.brand, joints))

    # ---- What to command ----

    def _commanded(self, base: Applied, start: _Start, conditions: Conditions) -> Applied:
        target, robots = base.target, self.robots
        tool = _frame(target.tool.T)
        flange = start.wanted @ np.linalg.inv(tool)
        made = robots.compensator.pose(Task(flange), start.joints, conditions)
        if not made.solution.reached:
            reason = robots.real.describe(made.solution)
            raise InputError(f"{self._where(target)} is out of reach after compensation: {reason}")
        joints = np.asarray(made.solution.joints)
        why = _turned_far(start.joints, joints, range(JOINTS) if target.kind == "joints" else _OF_POSES)
        if why:
            raise _Stays(why)
        # Whoever has the nominal robot's joints has its pose; there the last digits are the controller's own.
        command = robots.nominal.forward(joints, conditions) @ tool
        texts = self._texts(target, joints, command)
        final, final_joints = self._as_printed(target, texts, joints, command, conditions)
        if target.configuration is not None and texts:
            turns = after_move(target.configuration, self._posture(final_joints))
            if isinstance(turns, str):
                raise _Stays(turns)
            texts |= {number: str(value) for number, value in turns.items()}
        reached = robots.real.forward(final_joints, conditions) @ tool
        uncorrected = robots.real.forward(start.joints, conditions) @ tool
        return replace(
            base,
            status="changed" if texts else "same",
            command=final,
            command_joints=final_joints,
            before=_difference(uncorrected, start.wanted),
            after=_difference(reached, start.wanted),
            moved=_difference(final, start.wanted),
            rounding=_difference(final, command),
            texts=texts,
        )

    def _texts(self, target: Target, joints: Floats, command: Floats) -> dict[Number, str]:
        """Tokens that the command needs anew."""
        old = [number.value for number in target.numbers]
        if target.kind == "joints":
            values, least = list(self._printed_joints(joints)), [_JOINT_DECIMALS[self.brand]] * JOINTS
        else:
            local = np.linalg.inv(_frame(target.frame.T)) @ command
            values = list(numbers_from_frame(self.brand, local, like=old))
            if NOTATIONS[self.brand].rotation == "quaternion":
                # As long as it was: digits that were cut off are no correction.
                values[3:] = (np.array(values[3:]) * np.linalg.norm(old[3:])).tolist()
            least = [_LENGTH_DECIMALS[self.brand]] * 3 + [_ANGLE_DECIMALS[self.brand]] * (len(old) - 3)
        texts = {
            number: printed(number, value, decimals)
            for number, value, decimals in zip(target.numbers, values, least, strict=True)
        }
        return {number: text for number, text in texts.items() if text != number.text}

    def _printed_joints(self, joints: Floats) -> Floats:
        values = self.robots.to_readings(self.brand, joints)
        values = values if self.brand == "ur" else np.degrees(values)
        return values * np.array(self.options.given.pulses) if self.brand == "yaskawa" else values

    def _as_printed(
        self,
        target: Target,
        texts: Mapping[Number, str],
        joints: Floats,
        command: Floats,
        conditions: Conditions,
    ) -> tuple[Floats, Floats]:
        """The tool's pose and the joints that the controller makes of the printed numbers."""
        tool = _frame(target.tool.T)
        written = replace(
            target, numbers=tuple(replace(n, text=texts[n]) if n in texts else n for n in target.numbers)
        )
        if target.kind == "joints":
            q = self._joints_of(written)
            return self.robots.nominal.forward(q, conditions) @ tool, q
        pose = _frame(target.frame.T) @ frame_from_numbers(self.brand, [n.value for n in written.numbers])
        found = self.robots.nominal.follow(Task(pose @ np.linalg.inv(tool)), joints, conditions)
        return pose, np.asarray(found.joints) if found.reached else joints

    # ---- Arcs ----

    def _without_changed_arcs(self, applied: list[Applied]) -> list[Applied]:
        """A point that an arc passes is changed only where the arc keeps its radius and its plane."""
        for k, one in enumerate(applied):
            via = one.target.via
            if via is None or one.status != "changed":
                continue
            ends = [None if i is None else applied[i] for i in (via.start, via.end)]
            why = _changed_arc(ends[0], one, ends[1])
            if why:
                applied[k] = replace(
                    Applied(one.source, one.target, "stayed", why), wanted=one.wanted, joints=one.joints
                )
        return applied


def _turned_far(start: Floats, joints: Floats, of: Sequence[int]) -> str:
    """Why joints are no correction of those at the start; "" if they are."""
    turned = np.abs(joints - start)
    worst = max(of, key=lambda joint: float(turned[joint]))
    if turned[worst] <= _MOST_TURN:
        return ""
    return (
        f"the correction would turn joint {worst + 1} by {math.degrees(turned[worst]):.1f} deg: the target"
        " stands at the limit of a joint, or where axes line up"
    )


def _changed_arc(start: Applied | None, middle: Applied, end: Applied | None) -> str:
    """Why the arc through three points would be another one; "" if it stays."""
    if start is None or end is None:
        return "a point on an arc whose start or end is no literal target"
    three = (start, middle, end)
    wanted = [one.wanted[:3, 3] for one in three if one.wanted is not None]
    command = [one.command[:3, 3] for one in three if one.command is not None]
    if len(wanted) < 3 or len(command) < 3:
        return "a point on an arc whose start or end stays as it is"
    (radius, normal), (other, turned) = _arc(wanted), _arc(command)
    if not math.isfinite(radius):
        return "a point on an arc, which stands in line with its start and end"
    if abs(other - radius) > _SAME_ARC[0] * radius:
        return f"a point on an arc, whose radius would change from {1e3 * radius:.2f} to {1e3 * other:.2f} mm"
    angle = math.acos(min(1.0, abs(float(normal @ turned))))
    if angle > _SAME_ARC[1]:
        return f"a point on an arc, whose plane would turn by {math.degrees(angle):.2f} deg"
    return ""


def _arc(points: Sequence[Floats]) -> tuple[float, Floats]:
    """Radius and normal of the circle through three points; an infinite radius where they stand in a line."""
    a, b, c = points
    normal = np.cross(b - a, c - a)
    area = float(np.linalg.norm(normal))
    sides = [float(np.linalg.norm(v)) for v in (b - a, c - b, a - c)]
    if area <= _STRAIGHT * max(sides) ** 2:
        return math.inf, np.array([0.0, 0.0, 1.0])
    return math.prod(sides) / (2 * area), normal / area


def _frame(T: Floats | None) -> Floats:
    assert T is not None  # targets of unknown places never come here
    return T


def _difference(T: Floats, other: Floats) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two frames."""
    return float(np.linalg.norm(T[:3, 3] - other[:3, 3])), _angle(T[:3, :3].T @ other[:3, :3])


def _angle(R: Floats) -> float:
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(np.linalg.norm(sine)), float(np.trace(R)) - 1.0)
