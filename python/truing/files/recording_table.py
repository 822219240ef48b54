# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion as tables: CSV or Parquet, one row per sample, every unit in its column's name."""

from __future__ import annotations

import dataclasses
import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from truing import _core
from truing.errors import InputWarning, did_you_mean
from truing.files.common import listed, shown
from truing.files.recording_parts import checked_times, joints_of_numbers, make_recordings, table_of
from truing.files.table import Floats, Table
from truing.limits import LARGEST_NUMBER

_DEGREE = math.pi / 180.0
_RPM = 2.0 * math.pi / 60.0

# Units by kind of joint, each with its size in SI units.
_ANGLE = {"rad": 1.0, "deg": _DEGREE}
_LENGTH = {"m": 1.0, "mm": 1e-3}
_TURNING = {"rad_s": 1.0, "deg_s": _DEGREE, "rpm": _RPM}
_SLIDING = {"m_s": 1.0, "mm_s": 1e-3}
_TORQUE = {"Nm": 1.0, "mNm": 1e-3}
_FORCE = {"N": 1.0}
_AMPERE = {"A": 1.0, "mA": 1e-3}
# Columns with a joint's number, q1_rad, tau1_Nm ...: the table of the recording, and the units of a revolute
# and of a prismatic joint.
_OF_JOINTS: dict[str, tuple[tuple[str, dict[str, float], dict[str, float]], ...]] = {
    "q": (("position", _ANGLE, _LENGTH),),
    "qd": (("speed", _TURNING, _SLIDING),),
    "tau": (("torque", _TORQUE, _FORCE),),
    "i": (("current", _AMPERE, _AMPERE),),
    "u": (("command", _ANGLE, _LENGTH), ("torque_command", _TORQUE, _FORCE)),
    "ud": (("speed_command", _TURNING, _SLIDING),),
}
_TEMPERATURES = {"C": 0.0, "K": -273.15}  # what is added to come to degrees Celsius
# Columns of the whole robot, and their units; what they are called in the recording.
_OF_ROBOT = {"payload": {"kg": 1.0, "g": 1e-3}, "volt": {"V": 1.0, "mV": 1e-3}}
_SI_NAMES = {"payload": "payload_kg", "volt": "volt_V"}
_OF_PAYLOAD = re.compile(r"(payload_[xyz])(?:_(.*))?")  # where its centre is in the tool's frame
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_TIME_STEMS = ("t", "time", "timestamp")
_OF_JOINT = re.compile(r"(qd|ud|q|tau|i|u|temp)([1-9][0-9]*)(?:_(.*))?", re.ASCII)
_SETS = ("train", "test")
_LARGEST_TIME = 1e11  # [s] seconds since any epoch are fewer
_LARGEST_COVARIATE = 1e12
MOST_IN_MEMORY = 25_000_000  # cells: larger Parquet files are read in pieces
PIECE_ROWS = 65_536  # of a long file: its first ones, which are looked at before anything is fitted
PASS_ROWS = (
    16_384  # at a time in every pass over them: what Arrow, NumPy and the core copy of them stays small
)


@dataclass(frozen=True)
class _Source:
    """A column of the file, and how its numbers become SI: factor * number + shift."""

    column: str
    factor: float = 1.0
    shift: float = 0.0


class _Layout:
    """Which column of the file is what. Refuses names that are almost right."""

    def __init__(self, table: Table, robot: _core.Robot, joints: Sequence[str] | None) -> None:
        self.table = table
        self.joints = [robot.joints[index] for index in robot.driven_joints()]
        self.joint_of = joints_of_numbers(robot, joints)
        self.chosen = joints is not None
        self.time: _Source | None = None
        self.set = False
        self.tables: dict[str, dict[int, _Source]] = {}  # by table, then by joint
        self.known: dict[str, _Source] = {}  # other columns with a meaning, by the name that they get
        self.others: list[str] = []
        for name in table.names:
            self._place(name)
        self._find_time()
        self._require_positions()

    @property
    def numbers(self) -> list[str]:
        """Columns that must hold numbers."""
        sources = [source for table in self.tables.values() for source in table.values()]
        return [source.column for source in (*sources, *self.known.values(), *self._times())]

    def _times(self) -> list[_Source]:
        return [] if self.time is None else [self.time]

    def _place(self, name: str) -> None:
        of_joint = _OF_JOINT.fullmatch(name)
        stem, _, unit = name.partition("_")
        if of_joint:
            self._place_of_joint(name, of_joint[1], int(of_joint[2]), of_joint[3] or "")
        elif name == "set":
            self.set = True
        elif name == "enabled":
            self._take(self.known, name, _Source(name), name)
        elif of_payload := _OF_PAYLOAD.fullmatch(name):
            self._place_with(name, f"{of_payload[1]}_m", of_payload[1], of_payload[2] or "", _LENGTH)
        elif stem == "temp" and "_" not in unit:
            self._place_with(name, "temp_C", stem, unit, _TEMPERATURES)
        elif stem in _OF_ROBOT and "_" not in unit:
            self._place_with(name, _SI_NAMES[stem], stem, unit, _OF_ROBOT[stem])
        elif stem not in _TIME_STEMS or unit not in _TIMES:
            self.others.append(name)

    def _place_of_joint(self, name: str, stem: str, number: int, unit: str) -> None:
        if number not in self.joint_of:
            if self.chosen:
                return  # a joint that is none of the robot's, as the caller said
            names = [joint.name for joint in self.joints]
            there = max(int(found[2]) for found in map(_OF_JOINT.fullmatch, self.table.names) if found)
            several = ",".join([*names, *"-" * (there - len(names))])
            self.table.refuse(
                f"the robot has {len(names)} joints with a reading: {listed(names)}; where the file has"
                " others, say with --joints (in Python: joints=) which of the robot's each number is,"
                f" '-' for none: {shown(several, 200)} if the last are others",
                column=name,
            )
        index = self.joint_of[number]
        joint = self.joints[index]
        if stem == "temp":
            self._place_with(name, f"temp{index + 1}_C", f"temp{number}", unit, _TEMPERATURES)
            return
        expected: list[str] = []
        for table_name, turning, sliding in _OF_JOINTS[stem]:
            units = turning if joint.type == "revolute" else sliding
            if unit in units:
                self._take(self.tables.setdefault(table_name, {}), index, _Source(name, units[unit]), name)
                return
            expected += [f"{stem}{number}_{word}" for word in units]
        found = f"found the unit {unit!r} in the name" if unit else "there is no unit in the name"
        self.table.refuse(
            f"{found}, expected {' or '.join(expected)} (joint {joint.name!r} is {joint.type}; rename a"
            " column that means something else)",
            column=name,
        )

    def _place_with(self, name: str, role: str, stem: str, unit: str, units: Mapping[str, float]) -> None:
        if unit not in units:
            found = f"found the unit {unit!r} in the name" if unit else "there is no unit in the name"
            expected = " or ".join(f"{stem}_{word}" for word in units)
            self.table.refuse(
                f"{found}, expected {expected} (rename a column that means something else)", column=name
            )
        scale = {"shift": units[unit]} if units is _TEMPERATURES else {"factor": units[unit]}
        self._take(self.known, role, _Source(name, **scale), name)

    def _take(self, place: dict[Any, _Source], key: Any, source: _Source, name: str) -> None:
        if key in place:
            self.table.refuse(
                f"column {place[key].column!r} is there too and means the same: remove one", column=name
            )
        place[key] = source

    def _find_time(self) -> None:
        stamps = [
            name
            for name in self.table.names
            if name.partition("_")[0] in _TIME_STEMS and name.partition("_")[2] in _TIMES
        ]
        if not stamps:
            bare = [name for name in self.table.names if name in _TIME_STEMS]
            hint = (
                f"the name {bare[0]!r} says no unit: call the column {bare[0]}_s, _ms, _us or _ns"
                if bare
                else f"the columns are {listed(self.table.names)}"
            )
            self.table.refuse(f"there is no column t_s (or t_ms, t_us, t_ns), the time of each row; {hint}")
        if len(stamps) > 1 and "t_s" not in stamps:
            self.table.refuse(
                f"column {stamps[1]!r} is a time too: call the one that counts t_s, or remove the others",
                column=stamps[0],
            )
        name = "t_s" if "t_s" in stamps else stamps[0]
        self.time = _Source(name, _TIMES[name.partition("_")[2]])
        self.others += [stamp for stamp in stamps if stamp != name]

    def _require_positions(self) -> None:
        number_of = {index: number for number, index in self.joint_of.items()}
        for index, joint in enumerate(self.joints):
            if index in self.tables.get("position", {}):
                continue
            units = _ANGLE if joint.type == "revolute" else _LENGTH
            wanted = [f"q{number_of[index]}_{unit}" for unit in units]
            hint = (
                did_you_mean(wanted[0], self.others, 0.8)
                or did_you_mean(wanted[1], self.others, 0.8)
                or self._shorter_arm(index)
            )
            self.table.refuse(
                f"there is no column {' or '.join(wanted)}, the position of joint {joint.name!r}; {hint}"
                f"the columns are {listed(self.table.names)}"
            )

    def _shorter_arm(self, first: int) -> str:
        """Of joints that were not recorded up to the tip, such as a gripper's: how they are left out."""
        there = self.tables.get("position", {})
        if not there or any(index in there for index in range(first, len(self.joints))):
            return ""
        return "joints up to the tip are left out by the name of the link before them (--tip-link); "


class _Reader:
    """Takes columns out of a table in SI units, and refuses values that cannot be."""

    def __init__(self, table: Table, layout: _Layout) -> None:
        self.table = table
        self.layout = layout

    def times(self) -> Floats:
        t = self.stamps()
        return self.times_from(float(t[0]), t)

    def stamps(self) -> Floats:
        """The times as the file has them."""
        source = self.layout.time
        assert source is not None
        return self.table.numbers(source.column, "a time", largest=_LARGEST_TIME / source.factor)

    def times_from(self, first: float, t: Floats) -> Floats:
        """In seconds; `first`: stamp of the recording's first row."""
        source = self.layout.time
        assert source is not None
        scaled = t if source.factor == 1.0 else (t - _origin(first)) * source.factor
        begin = first if source.factor == 1.0 else (first - _origin(first)) * source.factor
        return checked_times(scaled, self.table.refuse, source.column, begin)

    def values(self, source: _Source, *, required: bool = False) -> Floats | None:
        """The column in SI units; None: nothing was recorded. Gaps within it are refused."""
        values = self.table.numbers(source.column, any_value=True)
        if not (np.abs(values) <= LARGEST_NUMBER).all():  # False for NaN
            if not required and np.isnan(values).all():
                return None
            self._refuse_value(source.column, values, required)
        if (source.factor, source.shift) == (1.0, 0.0):
            return values
        return values * source.factor + source.shift

    def _refuse_value(self, column: str, values: Floats, required: bool) -> NoReturn:
        good = np.isfinite(values)
        if good.all():
            limit = f"a number between -{LARGEST_NUMBER:g} and {LARGEST_NUMBER:g}"
            self.table.refuse_cell(int(np.argmax(np.abs(values) > LARGEST_NUMBER)), column, limit)
        row = int(np.argmin(good))
        after = np.flatnonzero(good[row:])
        run = int(after[0]) if after.size else len(values) - row
        more = f" (in {run} rows from here, {len(values) - int(good.sum())} of {len(values)} in all)"
        advice = "leave these rows out" if required else "leave these rows out, or the whole column"
        self.table.refuse_cell(row, column, f"a finite number{more if run > 1 else ''}: {advice}")

    def tables(self) -> dict[str, Floats]:
        """Positions and what else was recorded of the joints."""
        out: dict[str, Floats] = {}
        for name, sources in self.layout.tables.items():
            found = {
                index: self.values(source, required=name == "position") for index, source in sources.items()
            }
            if all(values is None for values in found.values()):
                continue
            out[name] = table_of(self.table.rows, len(self.layout.joints))
            for index, values in found.items():
                if values is not None:
                    out[name][:, index] = values
        return out

    def columns(self) -> dict[str, Floats]:
        """Payload, temperatures, voltage, whether enabled, and all other columns of numbers."""
        out: dict[str, Floats] = {}
        for name, source in self.layout.known.items():
            values = self.values(source)
            if values is not None:
                self._check_known(name, source.column, values)
                out[name] = values
        for name in self.layout.others:
            if name in out:
                self.table.refuse("another column comes to this name: rename one", column=name)
            values = self.table.numbers(name, any_value=True)
            usable = np.abs(values) <= _LARGEST_COVARIATE  # False for NaN
            if usable.all():
                out[name] = values
            elif not np.isnan(values).all():
                self._warn_left_out(name, usable, values)
        return out

    def _check_known(self, name: str, column: str, values: Floats) -> None:
        rules = {
            "payload_kg": (values >= 0.0, "a mass of zero or more"),
            "enabled": ((values == 0.0) | (values == 1.0), "0 or 1"),
        }
        good, expected = rules.get(name, (values == values, ""))
        if not good.all():
            self.table.refuse_cell(int(np.argmin(good)), column, expected)

    def _warn_left_out(self, name: str, usable: Any, values: Floats) -> None:
        row = int(np.argmin(usable))
        warnings.warn(
            InputWarning(
                f"{self.table.path}, column {name!r}: is left out: found {values[row]:g} in row {row + 1},"
                f" and no usable number in {len(values) - int(usable.sum())} of {len(values)} rows"
            ),
            stacklevel=6,
        )

    def test(self) -> Any:
        """Per row whether it is of the test set; None: no column says so."""
        if not self.layout.set:
            return None
        codes, names = self.table.labels("set")
        place = np.array([*(_SETS.index(name) if name in _SETS else -1 for name in names), -1])
        sets = place[codes]
        if (sets < 0).any():
            self.table.refuse_cell(int(np.argmin(sets)), "set", "train or test")
        return sets == 1


def _origin(first: float) -> float:
    """What may be taken off stamps before they are scaled: those since 1970 would lose digits."""
    return first if abs(first) > LARGEST_NUMBER else 0.0


def read_table(
    path: Path, name: str, robot: _core.Robot, joints: Sequence[str] | None
) -> list[_core.Recording]:
    """The recordings of a CSV or Parquet file: one, or one for each run of rows of a set."""
    table = Table(path, comments=True)
    if table.is_parquet and table.count_rows() * len(table.names) > MOST_IN_MEMORY:
        return [read_in_pieces(table, _Layout(table, robot, joints), name)]
    return recordings_of(table, name, robot, joints)


def recordings_of(
    table: Table, name: str, robot: _core.Robot, joints: Sequence[str] | None
) -> list[_core.Recording]:
    """The same of a table in memory, whose columns are called as in a file."""
    layout = _Layout(table, robot, joints)
    table.read(layout.numbers, _labels(layout))
    return _recordings_in(table, layout, name, robot)


def read_row_groups(
    path: Path, name: str, robot: _core.Robot, groups: Sequence[int]
) -> list[_core.Recording]:
    """The same of row groups of a Parquet file that are next to one another, as if there were no others."""
    table = Table(path)
    layout = _Layout(table, robot, None)
    table.read_row_groups(groups, layout.numbers, _labels(layout))
    return _recordings_in(table, layout, name, robot)


def _recordings_in(table: Table, layout: _Layout, name: str, robot: _core.Robot) -> list[_core.Recording]:
    reader = _Reader(table, layout)
    time = reader.times()
    tables = {"time": time, **reader.tables()}
    return make_recordings(str(table.path), name, robot, tables, reader.columns(), reader.test())


# ---- Recordings longer than memory


@dataclass(frozen=True)
class _Pieces:
    """The rows of a long Parquet file: called, it reads them from the first one on."""

    table: Table
    layout: _Layout
    name: str
    columns: tuple[str, ...]
    test: bool

    def __call__(self, rows: int | None = None) -> Iterator[_core.Recording]:
        first: float | None = None
        for part in self.table.parts(rows or PASS_ROWS, self.layout.numbers, _labels(self.layout)):
            reader = _Reader(part, self.layout)
            t = reader.stamps()
            first = float(t[0]) if first is None else first
            with warnings.catch_warnings():  # of columns with gaps: said once
                warnings.simplefilter("ignore", InputWarning)
                columns = reader.columns()
            tables: dict[str, Any] = reader.tables()
            tables["columns"] = {name: columns[name] for name in self.columns}
            yield _core.Recording(self.name, time=reader.times_from(first, t), test=self.test, **tables)


def _labels(layout: _Layout) -> list[str]:
    return ["set"] if layout.set else []


def read_in_pieces(table: Table, layout: _Layout, name: str) -> _core.Recording:
    """A recording whose rows stay in the file. All of it is read once, and checked; a column with gaps is
    left out.
    """
    survey = _Survey()
    for part in table.parts(PASS_ROWS, layout.numbers, _labels(layout)):
        survey.add(_Reader(part, layout))
    pieces = _Pieces(table, layout, name, tuple(sorted(survey.columns)), bool(survey.test))
    return next(iter(pieces(PIECE_ROWS))).replace(pieces=pieces, end=survey.end)


@dataclass
class _Survey:
    """What a long file holds throughout."""

    columns: set[str] = dataclasses.field(default_factory=set)
    first: float | None = None  # stamp
    end: float = -math.inf  # [s]
    test: bool | None = None
    _recorded: set[tuple[str, int]] = dataclasses.field(default_factory=set)

    def add(self, reader: _Reader) -> None:
        """The next rows. Raises InputError where they do not go on as those before."""
        usable, recorded = set(reader.columns()), _recorded(reader.tables())
        t = reader.stamps()
        if self.first is None:
            self.first, self.columns, self._recorded = float(t[0]), usable, recorded
        if recorded != self._recorded:
            reader.table.refuse(
                "a joint's column is empty from here on, or before: fill it, or leave it out", row=0
            )
        time = reader.times_from(self.first, t)
        if time[0] <= self.end:
            reader.table.refuse("time goes backwards, expected growing times: sort the rows", row=0)
        self.columns &= usable
        self.end = float(time[-1])
        self._add_set(reader)

    def _add_set(self, reader: _Reader) -> None:
        marked = reader.test()
        if marked is None:
            return
        if (marked != marked[0]).any() or self.test not in (None, bool(marked[0])):
            reader.table.refuse(
                "changes within a file that is read in pieces: write a file for each set", column="set"
            )
        self.test = bool(marked[0])


def _recorded(tables: Mapping[str, Floats]) -> set[tuple[str, int]]:
    """Which joints of which tables have numbers."""
    return {
        (name, joint)
        for name, values in tables.items()
        for joint in range(values.shape[1])
        if not math.isnan(values[0, joint])
    }
