# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measurement files: CSV or Parquet, one row per measured pose, every unit in its column's name."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from truing import _core
from truing.errors import InputError, InputWarning, did_you_mean
from truing.files.common import PathLike, Units, listed, write_table
from truing.files.plausibility import check_units_look_right
from truing.files.program_poses import is_program, read_program_poses
from truing.files.table import Beside, Codes, Floats, Table
from truing.limits import LARGEST_NUMBER, UNIT_LENGTH_OFF

_LENGTHS = ("m", "mm")
_ANGLES = ("rad", "deg")
_SPEEDS = ("rad_s", "deg_s", "m_s", "mm_s")
_TORQUES = ("Nm", "N")
_SI_NAMES = {"mm": "m", "deg": "rad", "mm_s": "m_s", "deg_s": "rad_s"}

# Columns with a unit, and the units there are.
_UNITS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("x", "y", "z", "dist"), _LENGTHS),
    "payload": ("kg",),
    "temp": ("C",),
    "t": ("s",),
    "sigma": _LENGTHS + _ANGLES,
}
# Columns with a joint's number: q1_rad, dir1 ...
_JOINT_UNITS: dict[str, tuple[str, ...]] = {
    "q": _ANGLES + _LENGTHS,
    "qr": _ANGLES + _LENGTHS,
    "u": _ANGLES + _LENGTHS,
    "qd": _SPEEDS,
    "tau": _TORQUES,
    "dir": (),
}
_BARE = ("qw", "qx", "qy", "qz", "pose", "weight")
_LABELS = ("fixed_point", "target", "set")
_POSITION = ("x", "y", "z")
_ORIENTATION = ("qw", "qx", "qy", "qz")
_OF_JOINT = re.compile(r"(qr|qd|tau|dir|u|q)([1-9][0-9]*)(?:_(.*))?", re.ASCII)
_SETS = ("train", "test")
ARM = "arm"
"""The column of a fleet's tables that names the arm a row is from."""
_LIMIT_MARGIN = 1e-3  # [rad | m]
_LARGEST = 1e6  # of a length or an angle, in the file's own unit: no machine is larger


@dataclass(frozen=True)
class _Source:
    """A column of the file: its name there, and its unit ("" if it has none)."""

    column: str
    unit: str = ""


_MEASURED = ("x", "dist", "fixed_point")  # roles of which a row needs one


class _Plan:
    """Which column of the file is what. Refuses names that are almost right."""

    def __init__(self, table: Table, robot: _core.Robot, more_labels: Sequence[str] = ()) -> None:
        self.table = table
        self._known_labels = (*_LABELS, *more_labels)
        self.joints = [robot.joints[index] for index in robot.driven_joints()]
        self.known: dict[str, _Source] = {}  # by role: "q1", "x", "dir2", "sigma m", "target" ...
        self.labels: list[str] = []
        self.covariates: dict[str, _Source] = {}  # by the name that they get
        for name in table.names:
            self._place(name)
        self._require_joints()
        self._require_whole(_POSITION, "a position has three coordinates")
        self._require_whole(_ORIENTATION, "an orientation is a quaternion, scalar first")
        if "qw" in self.known and "x" not in self.known:
            self._refuse(
                "qw", "an orientation without a position: expected the columns x_m, y_m, z_m (or _mm) too"
            )
        if any(f"dir{number}" in self.known for number in self._numbers()):
            joints = tuple(f"dir{number}" for number in self._numbers())
            self._require_whole(joints, "give all joints an approach direction, 0 where it is not known")

    @property
    def numbers(self) -> list[str]:
        """Columns that must hold numbers."""
        return [source.column for role, source in self.known.items() if role not in self._known_labels]

    def has(self, roles: Sequence[str]) -> bool:
        return all(role in self.known for role in roles)

    def _numbers(self) -> range:
        return range(1, len(self.joints) + 1)

    def _place(self, name: str) -> None:
        of_joint = _OF_JOINT.fullmatch(name)
        if of_joint:
            stem, number, unit = of_joint[1], int(of_joint[2]), of_joint[3]
            if number <= len(self.joints) or stem in ("q", "dir"):
                self._place_of_joint(name, stem, number, unit)
                return
        stem, _, unit = name.partition("_")
        if name in self._known_labels:
            self.known[name] = _Source(name)
            self.labels.append(name)
        elif name in _BARE:
            self.known[name] = _Source(name)
        elif stem in _UNITS and unit in _UNITS[stem]:
            self._take(f"sigma {_SI_NAMES.get(unit, unit)}" if stem == "sigma" else stem, name, unit)
        elif stem in _UNITS and "_" not in unit:
            self._refuse_unit(name, stem, unit, _UNITS[stem])
        else:
            self._add_covariate(name, _Source(name))

    def _place_of_joint(self, name: str, stem: str, number: int, unit: str | None) -> None:
        if number > len(self.joints):
            raise InputError(
                f"{self.table.path}, column {name!r}: the robot has {len(self.joints)} driven joints: "
                f"{listed([joint.name for joint in self.joints])} (passive joints have no column)"
            )
        units = _JOINT_UNITS[stem]
        if stem == "dir":
            if unit is not None:
                self.table.refuse(
                    f"a direction has no unit (-1, 0 or 1), expected the name dir{number}", column=name
                )
            self._take(f"dir{number}", name, "")
            return
        if unit not in units:
            self._refuse_unit(name, f"{stem}{number}", unit or "", units)
        if stem == "q":
            joint = self.joints[number - 1]
            suitable = _ANGLES if joint.type == "revolute" else _LENGTHS
            if unit not in suitable:
                expected = " or ".join(f"q{number}_{word}" for word in suitable)
                self.table.refuse(f"joint {joint.name!r} is {joint.type}, expected {expected}", column=name)
            self._take(f"q{number}", name, unit)
            return
        self._add_covariate(f"{stem}{number}_{_SI_NAMES.get(unit, unit)}", _Source(name, unit))

    def _take(self, role: str, name: str, unit: str) -> None:
        if role in self.known:
            self.table.refuse(
                f"column {self.known[role].column!r} is there too and means the same: remove one", column=name
            )
        self.known[role] = _Source(name, unit)

    def _add_covariate(self, name: str, source: _Source) -> None:
        if name in self.covariates:
            other = self.covariates[name].column
            self.table.refuse(
                f"column {other!r} is there too and means the same: remove one", column=source.column
            )
        self.covariates[name] = source

    def _refuse(self, role: str, message: str) -> NoReturn:
        self.table.refuse(message, column=self.known[role].column)

    def _refuse_unit(self, name: str, stem: str, unit: str, units: Sequence[str]) -> NoReturn:
        what = f"unknown unit {unit!r}" if unit else "no unit"
        expected = " or ".join(f"{stem}_{word}" for word in units)
        self.table.refuse(
            f"{what}, expected {expected} (rename a column that means something else)", column=name
        )

    def _require_joints(self) -> None:
        for number, joint in enumerate(self.joints, 1):
            if f"q{number}" in self.known:
                continue
            wanted = [f"q{number}_{unit}" for unit in (_ANGLES if joint.type == "revolute" else _LENGTHS)]
            others = [name for name in self.table.names if name not in self.numbers]
            hint = did_you_mean(wanted[0], others, 0.8) or did_you_mean(wanted[1], others, 0.8)
            self.table.refuse(
                f"there is no column {' or '.join(wanted)} for joint {joint.name!r}; {hint}"
                f"the columns are {listed(self.table.names)}"
            )

    def _require_whole(self, roles: Sequence[str], why: str) -> None:
        there = [role for role in roles if role in self.known]
        missing = [role for role in roles if role not in self.known]
        if there and missing:
            units = _UNITS.get(missing[0], ())
            names = " or ".join(f"{missing[0]}_{unit}" for unit in units) or missing[0]
            self.table.refuse(f"there is {self.known[there[0]].column} but no column {names}: {why}")


def load_measurements(
    path: PathLike,
    robot: _core.Robot,
    *,
    set_column: bool = True,
    joints_only: bool = False,
    beside: Beside | None = None,
) -> _core.Measurements:
    """Read measurements of `robot` from CSV or Parquet.

    Columns, with their unit in the name: q1_rad ... (the driven joints, in chain order), then x_m y_m z_m
    with or without qw qx qy qz, or dist_m, or fixed_point; optional dir1 ..., payload_kg, temp_C, t_s,
    target, pose, set, sigma_m and sigma_rad (standard deviation of the row), weight. Any other column of
    numbers becomes a covariate of its own name; qr1_..., u1_..., qd1_..., tau1_... do so in SI units and
    under their SI name (qr1_deg as qr1_rad).

    set_column: False passes over the column `set`. joints_only: rows need no measurement (for predictions),
    and a robot program of joints is read as well. beside: columns that another file gives, such as the joints
    of a program (`truing.programs.commanded_joints`).
    Raises InputError that names the line, the column, what was found and what was expected. Warns
    (InputWarning) about joints beyond their limits.
    """
    if is_program(Path(path)):
        return _of_program(Path(path), robot, joints_only)
    table = Table(Path(path), beside=beside)
    plan = _Plan(table, robot)
    if not joints_only:
        _require_measured(plan)
    table.read(plan.numbers, plan.labels)
    columns = _columns(plan, robot, set_column=set_column, joints_only=joints_only)
    return _measurements(table, columns)


def load_partition(
    table: Table, robot: _core.Robot, row_group: int | None = None
) -> dict[str, _core.Measurements]:
    """The measurements of each arm in a table of a fleet, by the arm's name in the column `arm`; "" without
    one. Columns and errors are those of `load_measurements`.

    row_group: of a Parquet file, to read no more of it.
    """
    plan = _Plan(table, robot, more_labels=[ARM])
    _require_measured(plan)
    if row_group is None:
        table.read(plan.numbers, plan.labels)
    else:
        table.read_row_groups([row_group], plan.numbers, plan.labels)
    arms, names = table.labels(ARM) if plan.has([ARM]) else (np.zeros(table.rows, dtype=np.int32), [""])
    if (arms < 0).any():
        table.refuse_cell(int(np.argmax(arms < 0)), ARM, "the name of the arm that the row is from")
    columns = _columns(plan, robot, set_column=True, joints_only=False)
    if len(names) == 1:
        return {names[0]: _measurements(table, columns)}
    return {
        name: _measurements(table, {key: _rows_of(value, arms == code) for key, value in columns.items()})
        for code, name in enumerate(names)
    }


def _rows_of(value: Any, rows: Any) -> Any:
    """Some rows of a column, of a list of columns, or of columns by name; lists of names stay."""
    if isinstance(value, dict):
        return {name: column[rows] for name, column in value.items()}
    if isinstance(value, np.ndarray):
        return value[rows]
    return [column[rows] if isinstance(column, np.ndarray) else column for column in value]


def _require_measured(plan: _Plan) -> None:
    if not any(plan.has([role]) for role in _MEASURED):
        plan.table.refuse(
            "nothing is measured: expected the columns x_m y_m z_m, or dist_m, or fixed_point; "
            f"the columns are {listed(plan.table.names)}"
        )


def _columns(plan: _Plan, robot: _core.Robot, *, set_column: bool, joints_only: bool) -> dict[str, Any]:
    """The columns of a table that was read, as `Measurements` takes them."""
    reader = _Reader(plan.table, plan)
    joints = [reader.values(f"q{number}") for number in range(1, len(plan.joints) + 1)]
    columns: dict[str, Any] = {"joints": joints}
    columns |= reader.measured()
    if not joints_only:
        reader.require_a_measurement_in_every_row(columns)
    columns |= reader.circumstances(robot)
    columns |= reader.reliability()
    columns |= reader.groups(set_column)
    columns |= reader.other_columns()

    units = {role: source.unit for role, source in plan.known.items()}
    check_units_look_right(plan.table, robot, plan.joints, units, columns)
    _warn_about_limits(reader, joints)
    return columns


def _measurements(table: Table, columns: dict[str, Any]) -> _core.Measurements:
    given = dict(columns)
    try:
        return _core.Measurements(given.pop("joints"), **given)
    except ValueError as error:
        raise InputError(f"{table.path}: {error}") from None


def _of_program(path: Path, robot: _core.Robot, joints_only: bool) -> _core.Measurements:
    """A robot program has joints, and nothing that was measured."""
    if not joints_only:
        raise InputError(
            f"{path}: is a robot program, in which nothing is measured: expected a table of what was measured"
            " at its targets, x_m y_m z_m; the joints of the rows come from the program with `truing"
            f" identify ROBOT measured.csv --program {path.name}`"
        )
    program = read_program_poses(path)
    if not program.only_joints:
        raise InputError(
            f"{path}: has targets that are poses, expected joints: `truing apply --poses-out FILE` writes"
            " the joints"
            " that the controller takes for them"
        )
    return _core.Measurements(program.joints(robot))


class _Reader:
    """Takes columns out of a table in SI units, and refuses values that cannot be."""

    def __init__(self, table: Table, plan: _Plan) -> None:
        self.table = table
        self.plan = plan

    def measured(self) -> dict[str, Any]:
        """Positions, orientations, distances, fixed points, as far as the file has them."""
        columns: dict[str, Any] = {}
        if self.plan.has(["x"]):
            columns["positions"] = self.positions()
        if self.plan.has(["qw"]):
            columns["orientations"] = self.orientations(columns["positions"])
        if self.plan.has(["dist"]):
            columns["distances"] = self.values("dist", gaps=True)
        if self.plan.has(["fixed_point"]):
            codes, names = self.table.labels("fixed_point")
            if names:
                columns |= {"fixed_points": codes, "fixed_point_names": names}
        return columns

    def circumstances(self, robot: _core.Robot) -> dict[str, Any]:
        """Targets, approach directions, payload, temperature, time."""
        columns: dict[str, Any] = {}
        targets = self.targets(robot)
        if targets is not None:
            columns["targets"] = targets
        if self.plan.has(["dir1"]):
            columns["directions"] = [self.directions(k) for k in range(1, len(self.plan.joints) + 1)]
        for role, keyword in (("payload", "payload"), ("temp", "temperature"), ("t", "time")):
            if self.plan.has([role]):
                columns[keyword] = self.values(role)
        if "payload" in columns:
            self.require("payload", columns["payload"] >= 0.0, "a mass of zero or more")
        return columns

    def reliability(self) -> dict[str, Any]:
        """Standard deviations and weights of rows."""
        roles = {"sigma m": "position_sigma", "sigma rad": "rotation_sigma", "weight": "weight"}
        columns = {keyword: self.values(role) for role, keyword in roles.items() if self.plan.has([role])}
        for role, keyword in roles.items():
            if keyword not in columns:
                continue
            if role == "weight":
                self.require(role, columns[keyword] >= 0.0, "a weight of zero or more")
            else:
                self.require(role, columns[keyword] > 0.0, "a standard deviation above zero")
        return columns

    def groups(self, set_column: bool) -> dict[str, Any]:
        """Which rows are one pose, and which are held out."""
        columns: dict[str, Any] = {}
        if self.plan.has(["pose"]):
            columns["pose"] = self.poses()
        if set_column and self.plan.has(["set"]):
            columns["set"] = self.sets()
        return columns

    def other_columns(self) -> dict[str, Any]:
        """Covariates, and the joint speeds if all of them are there."""
        speeds = [
            f"qd{number}_{'rad_s' if joint.type == 'revolute' else 'm_s'}"
            for number, joint in enumerate(self.plan.joints, 1)
        ]
        known = all(speed in self.plan.covariates for speed in speeds)
        covariates = {
            name: self.column(source, any_value=not (known and name in speeds))
            for name, source in self.plan.covariates.items()
        }
        columns: dict[str, Any] = {"covariates": covariates}
        if known:
            columns["joint_speeds"] = [covariates[speed] for speed in speeds]
        return columns

    def name(self, role: str) -> str:
        return self.plan.known[role].column

    def values(self, role: str, *, gaps: bool = False) -> Floats:
        return self.column(self.plan.known[role], gaps=gaps)

    def column(self, source: _Source, *, gaps: bool = False, any_value: bool = False) -> Floats:
        largest = _LARGEST if source.unit in _LENGTHS + _ANGLES else LARGEST_NUMBER
        values = self.table.numbers(source.column, gaps=gaps, any_value=any_value, largest=largest)
        return _to_si(values, source.unit)

    def require(self, role: str, good: Any, expected: str) -> None:
        if not good.all():
            self.table.refuse_cell(int(np.argmin(good)), self.name(role), expected)

    def positions(self) -> list[Floats]:
        columns = [self.values(role, gaps=True) for role in _POSITION]
        gaps = [np.isnan(column) for column in columns]
        for role, gap in zip(_POSITION, gaps, strict=True):
            # All three or none: the first row where one is missing alone is half a position.
            half = gap & ~(gaps[0] & gaps[1] & gaps[2])
            self.require(role, ~half, "a coordinate, as the row has others: a position has three")
        return columns

    def orientations(self, positions: list[Floats]) -> list[Floats]:
        columns = [self.column(self.plan.known[role], any_value=True) for role in _ORIENTATION]
        squared = np.zeros(self.table.rows)
        gap = np.ones(self.table.rows, dtype=np.bool_)
        for column in columns:
            squared += column * column
            gap &= np.isnan(column)
        good = gap | (np.abs(np.sqrt(squared) - 1.0) <= UNIT_LENGTH_OFF)
        if not good.all():
            row = int(np.argmin(good))
            found = " ".join(f"{column[row]:.6g}" for column in columns)
            length = (
                f"of length {math.sqrt(squared[row]):.6g}"
                if math.isfinite(squared[row])
                else "which is incomplete"
            )
            self.table.refuse(
                f"found the quaternion {found}, {length}; expected a unit quaternion (to 1e-3), scalar first,"
                " or four empty cells",
                row=row,
            )
        alone = ~gap & np.isnan(positions[0])
        if alone.any():
            self.table.refuse(
                "found an orientation without a position, expected both", row=int(np.argmax(alone))
            )
        return columns

    def require_a_measurement_in_every_row(self, columns: dict[str, Any]) -> None:
        measured = np.zeros(self.table.rows, dtype=np.bool_)
        expected = []
        if "positions" in columns:
            measured |= ~np.isnan(columns["positions"][0])
            expected.append(", ".join(self.name(role) for role in _POSITION))
        if "distances" in columns:
            measured |= ~np.isnan(columns["distances"])
            expected.append(self.name("dist"))
        if "fixed_points" in columns:
            measured |= columns["fixed_points"] >= 0
        if self.plan.has(["fixed_point"]):
            expected.append("fixed_point")
        if not measured.all():
            row = int(np.argmin(measured))
            self.table.refuse(
                f"nothing is measured: found empty cells, expected values in {' or '.join(expected)}", row=row
            )

    def targets(self, robot: _core.Robot) -> Codes | None:
        """Index into the robot's targets; None: all the tool."""
        if not self.plan.has(["target"]):
            return None
        codes, names = self.table.labels("target")
        known = {target.name: index for index, target in enumerate(robot.targets)}
        for code, name in enumerate(names):
            if name not in known:
                self.table.refuse(
                    f"the robot has no target {name!r}; its targets are {listed(list(known))}",
                    row=int(np.argmax(codes == code)),
                    column="target",
                )
        lookup = np.array([*(known[name] for name in names), 0], dtype=np.int32)
        return np.asarray(lookup[codes]) if len(names) > 0 else None

    def directions(self, number: int) -> Floats:
        role = f"dir{number}"
        values = self.values(role)
        self.require(role, (values == 0.0) | (np.abs(values) == 1.0), "-1, 0 or 1")
        return values

    def poses(self) -> Codes:
        values = self.values("pose")
        self.require(
            "pose",
            (values == np.floor(values)) & (np.abs(values) < 2**31),
            "the number of a pose, an integer below 2^31",
        )
        return values.astype(np.int32)

    def sets(self) -> Codes:
        codes, names = self.table.labels("set")
        lookup = np.array(
            [*(_SETS.index(name) if name in _SETS else -1 for name in names), -1], dtype=np.int32
        )
        sets = lookup[codes]
        self.require("set", sets >= 0, "train or test")
        return np.asarray(sets)


def _to_si(values: Floats, unit: str) -> Floats:
    if unit in ("mm", "mm_s"):
        # Divided, not multiplied by 0.001: 290 mm is then 0.29 m to the last digit.
        return np.divide(values, 1000.0, out=values if values.flags.writeable else None)
    if unit in ("deg", "deg_s"):
        return np.multiply(values, math.pi / 180.0, out=values if values.flags.writeable else None)
    return values


def _warn_about_limits(reader: _Reader, joints: list[Floats]) -> None:
    for number, (joint, values) in enumerate(zip(reader.plan.joints, joints, strict=True), 1):
        if math.isinf(joint.lower) and math.isinf(joint.upper):
            continue
        beyond = (values < joint.lower - _LIMIT_MARGIN) | (values > joint.upper + _LIMIT_MARGIN)
        if not beyond.any():
            continue
        row = int(np.argmax(beyond))
        unit = "rad" if joint.type == "revolute" else "m"
        try:
            reader.table.refuse(
                f"joint {joint.name!r} is at {values[row]:.6g} {unit}, beyond its limits {joint.lower:.6g} to"
                f" {joint.upper:.6g} {unit} (so in {int(beyond.sum())} of {len(values)} rows)",
                row=row,
                column=reader.name(f"q{number}"),
            )
        except InputError as error:
            warnings.warn(InputWarning(str(error)), stacklevel=4)


# ---- Writing -------------------------------------------------------------------------------------


def save_measurements(
    path: PathLike, data: _core.Measurements, robot: _core.Robot, *, units: Units | None = None
) -> None:
    """Write measurements as CSV (Parquet when `path` ends in .parquet), atomically, in the given units
    (default m, rad).

    Covariates are written as they are. In m and rad every number reads back bit for bit.
    """
    units = units or Units()
    joints = [robot.joints[index] for index in robot.driven_joints()]
    columns: dict[str, Any] = {}
    if data.pose is not None:
        columns["pose"] = data.pose
    for number, (joint, values) in enumerate(zip(joints, data.joints.T, strict=True), 1):
        name, column = _with_unit(
            f"q{number}", values, units.angle if joint.type == "revolute" else units.length
        )
        columns[name] = column
    columns |= _measured_columns(data, robot, units)
    columns |= _circumstance_columns(data, units)
    if data.joint_speeds is not None:
        for number, (joint, values) in enumerate(zip(joints, data.joint_speeds.T, strict=True), 1):
            columns[f"qd{number}_{'rad_s' if joint.type == 'revolute' else 'm_s'}"] = values
    for name, values in data.covariates.items():
        if name in columns and not name.startswith("qd"):
            raise InputError(
                f"{path}: a covariate is called {name!r}, which means something else in this file: rename it"
            )
        columns[name] = values
    if data.set is not None:
        columns["set"] = [_SETS[index] for index in data.set]
    write_table(path, columns)


def _with_unit(stem: str, values: Any, unit: str = "") -> tuple[str, Any]:
    """Name and values of a column in this unit, from SI."""
    return f"{stem}_{unit}" if unit else stem, _from_si(np.asarray(values), unit)


def _measured_columns(data: _core.Measurements, robot: _core.Robot, units: Units) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    if data.targets is not None:
        names = [target.name for target in robot.targets]
        columns["target"] = [names[index] for index in data.targets]
    if data.positions is not None:
        columns.update(
            _with_unit(role, values, units.length)
            for role, values in zip(_POSITION, data.positions.T, strict=True)
        )
    if data.orientations is not None:
        columns.update(
            _with_unit(role, values) for role, values in zip(_ORIENTATION, data.orientations.T, strict=True)
        )
    if data.distances is not None:
        columns.update([_with_unit("dist", data.distances, units.length)])
    if data.fixed_points is not None:
        points = [*data.fixed_point_names, None]  # -1: none
        columns["fixed_point"] = [points[index] for index in data.fixed_points]
    return columns


def _circumstance_columns(data: _core.Measurements, units: Units) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    if data.directions is not None:
        for number, values in enumerate(data.directions.T, 1):
            columns[f"dir{number}"] = values.astype(np.int8)
    known = (
        ("payload", data.payload, "kg"),
        ("temp", data.temperature, "C"),
        ("t", data.time, "s"),
        ("sigma", data.position_sigma, units.length),
        ("sigma", data.rotation_sigma, units.angle),
        ("weight", data.weight, ""),
    )
    columns.update(_with_unit(stem, values, unit) for stem, values, unit in known if values is not None)
    return columns


def _from_si(values: Any, unit: str) -> Any:
    if unit == "mm":
        return values * 1000.0
    if unit == "deg":
        return values * (180.0 / math.pi)
    return values
