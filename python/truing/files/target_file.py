# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Target files: what a robot shall reach, CSV or Parquet, one row per target, every unit in its column's
name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.errors import InputError, did_you_mean
from truing.files.common import PathLike, listed, shown
from truing.files.plausibility import check_joint_units_look_right, check_targets_look_right
from truing.files.program_poses import is_program as is_robot_program, wanted_poses
from truing.files.table import Floats, Table
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_quaternions

_LENGTHS = ("m", "mm")
_ANGLES = ("rad", "deg")
_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_WINDOWS = ("roll", "lead", "work")
# Columns and the units there are.
_UNITS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_POSITION, _LENGTHS),
    **dict.fromkeys(_QUATERNION, ("",)),
    **{f"{window}_{end}": _ANGLES for window in _WINDOWS for end in ("lower", "upper")},
    "roll": _ANGLES,
    "payload": ("kg",),
    "temp": ("C",),
    "t": ("s",),
}
_TASK = "task"
_KINDS = ("pose", "torch", "point")
_OF_JOINT = re.compile(r"(q|dir)([1-9][0-9]*)(?:_(.*))?", re.ASCII)


@dataclass(frozen=True)
class TargetData:
    """What a target file holds, in SI units. One entry per row, in the order of the file."""

    path: Path
    tasks: tuple[_core.Task, ...] = ()  # poses; empty: a program of joint positions
    joints: Floats | None = None  # shape=(n, driven joints) [rad | m]: the program; with tasks the seeds
    conditions: tuple[_core.Conditions, ...] = ()  # empty: none are given

    @property
    def is_program(self) -> bool:
        """Joint positions, not poses."""
        return not self.tasks

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.tasks) if self.tasks or self.joints is None else len(self.joints)

    def path_conditions(self) -> _core.Conditions | None:
        """Those of a path, which has one load, temperature and approach direction for all of its targets;
        time is that of the first.
        """
        for row, other in enumerate(self.conditions):
            first = self.conditions[0]
            if (other.payload, other.temperature, other.direction) != (
                first.payload,
                first.temperature,
                first.direction,
            ):
                raise InputError(
                    f"{self.path}: row {row} (from 0) has another payload, temperature or approach direction"
                    " than the first, but a path has one: split the file there"
                )
        return self.conditions[0] if self.conditions else None


class _Plan:
    """Which column of the file is what. Whatever else there is, is refused: a mistyped window would be no
    window.
    """

    def __init__(self, table: Table, robot: _core.Robot) -> None:
        self.table = table
        self.robot_joints = [robot.joints[index] for index in robot.driven_joints()]
        self.columns: dict[str, str] = {}  # by role: "x", "roll_lower", "q1", "dir2" …
        self.units: dict[str, str] = {}
        self.labels: list[str] = []
        for name in table.names:
            self._place(name)

    @property
    def numbers(self) -> list[str]:
        """Columns that must hold numbers."""
        return [name for role, name in self.columns.items() if role != _TASK]

    def has(self, roles: Sequence[str]) -> bool:
        return any(role in self.columns for role in roles)

    def require_whole(self, roles: Sequence[str], why: str) -> None:
        """All of them, or none."""
        there = [role for role in roles if role in self.columns]
        missing = [role for role in roles if role not in self.columns]
        if there and missing:
            self.table.refuse(
                f"there is {self.columns[there[0]]} but no column {self._wanted(missing[0])}: {why}"
            )

    def joint_roles(self, stem: str) -> list[str]:
        return [f"{stem}{number}" for number in range(1, len(self.robot_joints) + 1)]

    def _wanted(self, role: str) -> str:
        of_joint = _OF_JOINT.fullmatch(role)
        units = _UNITS.get(role, ("",))
        if of_joint and of_joint[1] == "q":
            units = self._joint_units(int(of_joint[2]))
        return " or ".join(f"{role}_{unit}" if unit else role for unit in units)

    def _joint_units(self, number: int) -> tuple[str, ...]:
        return _ANGLES if self.robot_joints[number - 1].type == "revolute" else _LENGTHS

    def _place(self, name: str) -> None:
        of_joint = _OF_JOINT.fullmatch(name)
        if of_joint:
            self._place_of_joint(name, of_joint[1], int(of_joint[2]), of_joint[3])
        elif name == _TASK:
            self.labels.append(name)
            self._take(_TASK, name, "")
        elif name in _UNITS and _UNITS[name] == ("",):
            self._take(name, name, "")
        else:
            stem, _, unit = name.rpartition("_")
            if stem in _UNITS and unit in _UNITS[stem]:
                self._take(stem, name, unit)
            else:
                self._refuse_unknown(name)

    def _place_of_joint(self, name: str, stem: str, number: int, unit: str | None) -> None:
        if number > len(self.robot_joints):
            self.table.refuse(
                f"the robot has {len(self.robot_joints)} driven joints:"
                f" {listed([joint.name for joint in self.robot_joints])} (passive joints have no column)",
                column=name,
            )
        if stem == "dir":
            if unit is not None:
                self.table.refuse(
                    f"a direction has no unit (-1, 0 or 1), expected the name dir{number}", column=name
                )
            self._take(f"dir{number}", name, "")
            return
        units = self._joint_units(number)
        if unit not in units:
            joint = self.robot_joints[number - 1]
            self.table.refuse(
                f"joint {joint.name!r} is {joint.type}, expected {self._wanted(f'q{number}')}", column=name
            )
        self._take(f"q{number}", name, unit or "")

    def _take(self, role: str, name: str, unit: str) -> None:
        if role in self.columns:
            self.table.refuse(
                f"column {self.columns[role]!r} is there too and means the same: remove one", column=name
            )
        self.columns[role] = name
        self.units[role] = unit

    def _refuse_unknown(self, name: str) -> None:
        if name in _UNITS:
            self.table.refuse(f"no unit, expected {self._wanted(name)}", column=name)
        stem, _, unit = name.rpartition("_")
        if stem in _UNITS and _UNITS[stem] != ("",):
            self.table.refuse(f"unknown unit {unit!r}, expected {self._wanted(stem)}", column=name)
        known = (
            [self._wanted(role).split(" or ")[0] for role in _UNITS]
            + [_TASK]
            + [self._wanted(role).split(" or ")[0] for role in self.joint_roles("q")]
        )
        hint = did_you_mean(name, known, 0.75)
        self.table.refuse(
            f"unknown column; {hint}expected {listed(known)}, dir1 …; remove what is no part of a target",
            column=name,
        )


class _Reader:
    """Takes columns out of a table in SI units, and refuses values that cannot be."""

    def __init__(self, table: Table, plan: _Plan) -> None:
        self.table = table
        self.plan = plan

    def values(self, role: str, *, gaps: bool = False) -> Floats:
        values = self.table.numbers(self.plan.columns[role], gaps=gaps)
        unit = self.plan.units[role]
        return values / 1000.0 if unit == "mm" else np.radians(values) if unit == "deg" else values

    def optional(self, role: str) -> Floats:
        """NaN where nothing is given."""
        return self.values(role, gaps=True) if role in self.plan.columns else np.full(self.table.rows, np.nan)

    def kinds(self, usual: str) -> list[str]:
        if _TASK not in self.plan.columns:
            return [usual] * self.table.rows
        codes, names = self.table.labels(_TASK)
        for code, name in enumerate(names):
            if name not in _KINDS:
                self.table.refuse(
                    f"found {shown(name)}, expected {', '.join(_KINDS[:-1])} or {_KINDS[-1]}",
                    row=int(np.argmax(codes == code)),
                    column=_TASK,
                )
        words = [*names, usual]  # -1: an empty cell
        return [words[code] for code in codes]

    def frames(self, kinds: Sequence[str]) -> Floats:
        """shape=(n, 4, 4). Where the position alone is wanted there may be no orientation."""
        frames = np.tile(np.eye(4), (self.table.rows, 1, 1))
        frames[:, :3, 3] = np.column_stack([self.values(role) for role in _POSITION])
        point = np.array([kind == "point" for kind in kinds])
        if not self.plan.has(_QUATERNION):
            if not point.all():
                row = int(np.argmin(point))
                self.table.refuse(
                    f"a {kinds[row]} has an orientation: expected the columns {', '.join(_QUATERNION)}, or"
                    " the task point (position alone)",
                    row=row,
                )
            return frames
        q = np.column_stack([self.values(role, gaps=bool(point.any())) for role in _QUATERNION])
        norm = np.linalg.norm(q, axis=1)
        empty = np.isnan(q).all(axis=1) & point
        good = empty | (np.abs(norm - 1.0) <= UNIT_LENGTH_OFF)
        if not good.all():
            self._refuse_quaternion(int(np.argmin(good)), q, norm)
        there = np.flatnonzero(~empty)
        frames[there, :3, :3] = rotations_from_quaternions(q[there])
        return frames

    def _refuse_quaternion(self, row: int, q: Floats, norm: Floats) -> None:
        found = " ".join(f"{value:.6g}" for value in q[row])
        length = f"of length {norm[row]:.6g}" if math.isfinite(norm[row]) else "which is incomplete"
        self.table.refuse(
            f"found the quaternion {found}, {length}; expected a unit quaternion (to 1e-3), scalar first",
            row=row,
        )

    def window(
        self, name: str, kinds: Sequence[str], usual: tuple[float, float]
    ) -> list[tuple[float, float]]:
        """Pairs (lower, upper), those of `usual` where nothing is given."""
        ends = []
        for end, otherwise in zip(("lower", "upper"), usual, strict=True):
            role = f"{name}_{end}"
            values = self.optional(role)
            self._require_torch(role, values, kinds)
            self._require_angle(role, values, 2.0 * math.pi if name == "roll" else math.pi)
            ends.append(np.where(np.isnan(values), otherwise, values))
        empty = ends[0] > ends[1]
        if empty.any():
            row = int(np.argmax(empty))
            self.table.refuse(
                f"the window of {name} is empty: its lower end {ends[0][row]:.6g} rad is above the upper one"
                f" {ends[1][row]:.6g} rad",
                row=row,
            )
        return list(zip(ends[0].tolist(), ends[1].tolist(), strict=True))

    def preferred_roll(self, kinds: Sequence[str], usual: float | None) -> list[float | None]:
        values = self.optional("roll")
        self._require_torch("roll", values, kinds)
        self._require_angle("roll", values, 2.0 * math.pi)
        return [usual if math.isnan(value) else value for value in values.tolist()]

    def _require_torch(self, role: str, values: Floats, kinds: Sequence[str]) -> None:
        wrong = np.isfinite(values) & np.array([kind != "torch" for kind in kinds])
        if wrong.any():
            row = int(np.argmax(wrong))
            self.table.refuse(
                f"a {kinds[row]} has no {role.replace('_', ' ')}: that is of the task torch; say so in a"
                " column task, or with --task torch",
                row=row,
                column=self.plan.columns[role],
            )

    def _require_angle(self, role: str, values: Floats, most: float) -> None:
        beyond = np.abs(values) > most + 1e-6
        if beyond.any():
            row = int(np.argmax(beyond))
            hint = (
                f"; these look like degrees: call the column {role}_deg"
                if self.plan.units[role] == "rad"
                else ""
            )
            self.table.refuse(
                f"found {values[row]:.6g} rad, expected an angle within ±{most:.4g} rad{hint}",
                row=row,
                column=self.plan.columns[role],
            )

    def joints(self) -> Floats:
        return np.column_stack([self.values(role) for role in self.plan.joint_roles("q")])

    def conditions(self) -> tuple[_core.Conditions, ...]:
        columns: dict[str, Any] = {}
        roles = self.plan.joint_roles("dir")
        if self.plan.has(roles):
            directions = np.column_stack([self.values(role) for role in roles])
            for number, role in enumerate(roles):
                good = np.isin(directions[:, number], (-1.0, 0.0, 1.0))
                if not good.all():
                    self.table.refuse_cell(int(np.argmin(good)), self.plan.columns[role], "-1, 0 or 1")
            columns["direction"] = directions.astype(int).tolist()
        for role, keyword in (("payload", "payload"), ("temp", "temperature"), ("t", "time")):
            if role in self.plan.columns:
                columns[keyword] = self.values(role).tolist()
        if "payload" in columns and min(columns["payload"]) < 0:
            self.table.refuse_cell(
                int(np.argmin(columns["payload"])), self.plan.columns["payload"], "a mass of zero or more"
            )
        if not columns:
            return ()
        return tuple(
            _core.Conditions(**dict(zip(columns, row, strict=True)))
            for row in zip(*columns.values(), strict=True)
        )


def load_targets(
    path: PathLike,
    robot: _core.Robot,
    *,
    like: _core.Task | None = None,
    program: bool = False,
    in_base: bool = False,
) -> TargetData:
    """Read what `robot` shall reach from CSV or Parquet, one row per target.

    Columns, with their unit in the name: x_m y_m z_m (or _mm) and qw qx qy qz, the target in the measurement
    frame (points need no orientation); optional task (pose, torch, point), of a torch roll_rad (preferred),
    roll_lower_rad roll_upper_rad, lead_… and work_lower_rad … (or _deg), q1_rad … (where the robot comes
    from), dir1 …, payload_kg, temp_C, t_s. An empty cell of these means what `like` says.

    like: task of rows that say no other; None: a full pose. program: joints q1_rad … without x_m … are a
    program of joint positions.
    in_base: poses are in the robot's own base frame, not in the measurement frame.
    A robot program (.src, .mod, .ls, .script, .jbi) is read as well: its literal targets, in the order of
    its moves. Raises InputError that names the line, the column, what was found and what was expected.
    """
    if is_robot_program(Path(path)):
        return _of_program(Path(path), robot, like or _core.Task(np.eye(4)), program, in_base)
    table = Table(Path(path))
    plan = _Plan(table, robot)
    joint_roles = plan.joint_roles("q")
    plan.require_whole(_POSITION, "a position has three coordinates")
    plan.require_whole(_QUATERNION, "an orientation is a quaternion, scalar first")
    plan.require_whole(joint_roles, f"{len(joint_roles)} driven joints")
    plan.require_whole(
        plan.joint_roles("dir"), "give all joints an approach direction, 0 where it is not known"
    )
    is_program = program and not plan.has(_POSITION) and plan.has(joint_roles)
    if not is_program and not plan.has(_POSITION):
        more = f", or {plan._wanted(joint_roles[0])} … for a program of joint positions" if program else ""
        table.refuse(
            f"there are no targets: expected the columns x_m y_m z_m and qw qx qy qz{more}; the columns are"
            f" {listed(table.names)}"
        )
    if is_program:
        for role in plan.columns:
            if role in _UNITS and role not in ("payload", "temp", "t") or role == _TASK:
                table.refuse(
                    "is about poses, but there are no columns x_m y_m z_m", column=plan.columns[role]
                )
    table.read(plan.numbers, plan.labels)
    reader = _Reader(table, plan)
    joints = reader.joints() if plan.has(joint_roles) else None
    if joints is not None:
        check_joint_units_look_right(table, plan.robot_joints, plan.units, joints)
    tasks = () if is_program else _tasks(reader, like or _core.Task(np.eye(4)))
    if tasks:
        positions = np.array([task.T_measurement_target[:3, 3] for task in tasks])
        check_targets_look_right(table, robot, plan.units, positions, in_base=in_base)
    return TargetData(path=table.path, tasks=tasks, joints=joints, conditions=reader.conditions())


def _of_program(path: Path, robot: _core.Robot, like: _core.Task, program: bool, in_base: bool) -> TargetData:
    """Targets of a robot program. One of joints alone is a program of joint positions, where that is asked
    for."""
    wanted, joints = wanted_poses(path, robot, in_base=in_base)
    if program and joints is not None:
        return TargetData(path=path, tasks=(), joints=joints)
    tasks = tuple(like.replace(T_measurement_target=T) for T in wanted)
    return TargetData(path=path, tasks=tasks, joints=joints)


def _tasks(reader: _Reader, like: _core.Task) -> tuple[_core.Task, ...]:
    kinds = reader.kinds(like.kind)
    frames = reader.frames(kinds)
    same: dict[str, Any] = {
        "axis": like.axis,
        "travel": like.travel,
        "retreat": like.retreat,
        "longest_retreat": like.longest_retreat,
    }
    columns: Mapping[str, Sequence[Any]] = {
        "kind": kinds,
        "roll": reader.window("roll", kinds, like.roll),
        "preferred_roll": reader.preferred_roll(kinds, like.preferred_roll),
        "lead": reader.window("lead", kinds, like.lead),
        "work": reader.window("work", kinds, like.work),
    }
    try:
        return tuple(
            _core.Task(frame, **dict(zip(columns, row, strict=True)), **same)
            for frame, row in zip(frames, zip(*columns.values(), strict=True), strict=True)
        )
    except ValueError as error:
        raise InputError(f"{reader.table.path}: {error}") from None
