# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files of a performance test (ISO 9283): what was commanded, and what was measured.

CSV or Parquet, every unit in its column's name, one row per commanded pose or per measured one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing.files.common import PathLike, listed, shown
from truing.files.table import Floats, Table
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_quaternions

Ints = NDArray[np.int64]
TESTS = ("pose", "approach", "path", "warm-up")
_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_WHOLE = ("cycle", "approach", "point", "block")
_PLAIN = ("load_percent", "speed_percent", "t_s", "temp_C")
_LABELS = ("test", "pose", "path")
_MOST_PERCENT = 200  # of a rated value
_FAR = 100.0  # [m] from the base no robot reaches
_JOINT = re.compile(r"q([1-9][0-9]*)_(rad|deg|m|mm)", re.ASCII)


@dataclass(frozen=True)
class CommandedPoses:
    """Poses that the robot was told to reach. Rows with a path are the path's points, in order."""

    file: Path
    name: tuple[str, ...]
    position: Floats  # shape=(n, 3) [m]
    rotation: Floats | None  # shape=(n, 3, 3)
    path: tuple[str, ...]  # "" of a pose
    point: Ints  # number of a path's point, from 1; 0 of a pose

    def row(self, name: str) -> int | None:
        """Of a pose."""
        return self.name.index(name) if name in self.name else None

    def path_rows(self, path: str) -> Ints:
        """Rows of a path's points, in their order."""
        rows = np.array([k for k, one in enumerate(self.path) if one == path], dtype=np.int64)
        return rows[np.argsort(self.point[rows], kind="stable")]


@dataclass(frozen=True)
class MeasuredPoses:
    """What an instrument measured in a performance test. One entry per row, in the order of the file."""

    file: Path
    test: tuple[str, ...]  # of TESTS
    pose: tuple[str, ...]  # name of the commanded pose; "" of a path
    path: tuple[str, ...]  # name of the path; "" of a pose
    cycle: Ints
    approach: Ints  # number of the direction; 0: none
    point: Ints  # number of the path's point; 0: a sample of a recording
    block: Ints  # of a warm-up; 0: none
    load: Floats  # [%] of the rated load; NaN: not said
    speed: Floats  # [%] of the rated speed; NaN: not said
    position: Floats  # shape=(n, 3) [m]
    rotation: Floats | None  # shape=(n, 3, 3)
    time: Floats | None = None  # [s]
    temperature: Floats | None = None  # [deg C]
    joints: Floats | None = None  # shape=(n, joints) [rad | m], as the controller reports them

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.position)


def load_commanded(path: PathLike) -> CommandedPoses:
    """Reads commanded poses: columns pose, x_m y_m z_m (_mm), qw … qz if orientations count; path and point
    of path points. Raises InputError for anything else that is amiss, with line and column.
    """
    reader = _Reader(Table(Path(path)), ("pose", "path"), ("point",))
    reader.require("pose", "the names of the commanded poses")
    reader.read()
    names, paths = reader.texts("pose"), reader.texts("path")
    for row, name in enumerate(names):
        if not name:
            reader.table.refuse_cell(row, "pose", "the name of a pose, such as P1")
        if name in names[:row]:
            reader.table.refuse(f"the pose {shown(name)} is there twice", row=row, column="pose")
    point = reader.whole("point")
    for row, (of, number) in enumerate(zip(paths, point, strict=True)):
        if bool(of) != bool(number):
            reader.table.refuse("found a path without a point, or a point without a path", row=row)
    return CommandedPoses(reader.table.path, names, reader.positions(), reader.rotations(), paths, point)


def load_measured(path: PathLike) -> MeasuredPoses:
    """Reads the measurements of a performance test: columns x_m y_m z_m (_mm), pose (or path), cycle;
    optional test, approach, point, block, load_percent, speed_percent, qw … qz, t_s, temp_C, q1_rad …. Raises
    InputError for anything else that is amiss, with line and column.
    """
    reader = _Reader(Table(Path(path)), _LABELS, (*_WHOLE, *_PLAIN))
    if "path" not in reader.table.names:
        reader.require("pose", "the name of the commanded pose, such as P1")
    reader.require("cycle", "the number of the cycle, from 1")
    reader.read()
    measured = MeasuredPoses(
        reader.table.path,
        reader.tests(),
        reader.texts("pose"),
        reader.texts("path"),
        reader.whole("cycle"),
        reader.whole("approach"),
        reader.whole("point"),
        reader.whole("block"),
        reader.percent("load_percent"),
        reader.percent("speed_percent"),
        reader.positions(),
        reader.rotations(),
        reader.optional("t_s"),
        reader.optional("temp_C"),
        reader.joints(),
    )
    _require_sense(reader.table, measured)
    return measured


class _Reader:
    """Takes columns out of a table, in SI units, and refuses what cannot be."""

    def __init__(self, table: Table, labels: Sequence[str], numbers: Sequence[str]) -> None:
        self.table = table
        self.labels = [name for name in labels if name in table.names]
        self.unit = self._unit()
        wanted = [f"{axis}_{self.unit}" for axis in _POSITION]
        self.oriented = any(name in table.names for name in _QUATERNION)
        joints = [name for name in table.names if _JOINT.fullmatch(name)]
        self.numbers = [*wanted, *(_QUATERNION if self.oriented else ()), *joints]
        for name in self.numbers:
            self.require(name, "a position has three coordinates, an orientation four")
        self.numbers += [name for name in numbers if name in table.names]
        known = {*self.numbers, *self.labels}
        for name in table.names:
            if name not in known:
                table.refuse(
                    f"unknown column; expected {listed([*labels, *numbers])}, x_m y_m z_m (or _mm), qw qx qy"
                    " qz, q1_rad …; remove what is no part of the test",
                    column=name,
                )

    def _unit(self) -> str:
        there = [unit for unit in ("m", "mm") if f"x_{unit}" in self.table.names]
        if len(there) != 1:
            found = "both x_m and x_mm" if there else f"the columns {listed(self.table.names)}"
            self.table.refuse(f"found {found}, expected x_m y_m z_m or x_mm y_mm z_mm")
        return there[0]

    def require(self, column: str, why: str) -> None:
        if column not in self.table.names:
            self.table.refuse(
                f"there is no column {column}: {why}; the columns are {listed(self.table.names)}"
            )

    def read(self) -> None:
        self.table.read(self.numbers, self.labels)

    def texts(self, name: str) -> tuple[str, ...]:
        if name not in self.labels:
            return ("",) * self.table.rows
        codes, words = self.table.labels(name)
        return tuple("" if code < 0 else words[code] for code in codes)

    def tests(self) -> tuple[str, ...]:
        if "test" not in self.labels:
            return ("pose",) * self.table.rows
        found = self.texts("test")
        for row, word in enumerate(found):
            if word not in TESTS:
                self.table.refuse_cell(row, "test", f"{', '.join(TESTS[:-1])} or {TESTS[-1]}")
        return found

    def whole(self, name: str) -> Ints:
        """Whole numbers from 1; 0 where nothing is given."""
        if name not in self.numbers:
            return np.zeros(self.table.rows, dtype=np.int64)
        values = self.table.numbers(name, gaps=True)
        wrong = np.isfinite(values) & ((values < 1) | (values != np.floor(values)))
        if wrong.any():
            self.table.refuse_cell(int(np.argmax(wrong)), name, "a whole number from 1")
        return np.asarray(np.where(np.isfinite(values), values, 0.0).astype(np.int64))

    def percent(self, name: str) -> Floats:
        if name not in self.numbers:
            return np.full(self.table.rows, math.nan)
        values = self.table.numbers(name, gaps=True)
        wrong = np.isfinite(values) & ((values < 0) | (values > _MOST_PERCENT))
        if wrong.any():
            self.table.refuse_cell(
                int(np.argmax(wrong)), name, f"a percentage of the rated value, 0 to {_MOST_PERCENT}"
            )
        return values

    def optional(self, name: str) -> Floats | None:
        if name not in self.numbers:
            return None
        values = self.table.numbers(name, gaps=True)
        return values if np.isfinite(values).any() else None

    def positions(self) -> Floats:
        scale = 1.0 if self.unit == "m" else 1e-3
        return scale * np.column_stack([self.table.numbers(f"{axis}_{self.unit}") for axis in _POSITION])

    def rotations(self) -> Floats | None:
        if not self.oriented:
            return None
        q = np.column_stack([self.table.numbers(name) for name in _QUATERNION])
        wrong = np.abs(np.linalg.norm(q, axis=1) - 1.0) > UNIT_LENGTH_OFF
        if wrong.any():
            row = int(np.argmax(wrong))
            found = " ".join(f"{value:.6g}" for value in q[row])
            self.table.refuse(
                f"found the quaternion {found}, expected one of unit length (to {UNIT_LENGTH_OFF:g})", row=row
            )
        return rotations_from_quaternions(q)

    def joints(self) -> Floats | None:
        found = {int(match[1]): name for name in self.numbers if (match := _JOINT.fullmatch(name))}
        if not found:
            return None
        if sorted(found) != list(range(1, len(found) + 1)):
            self.table.refuse(f"found the joints {listed(list(found.values()))}, expected q1 … without a gap")
        columns = []
        for number in sorted(found):
            values = self.table.numbers(found[number], gaps=True)
            unit = found[number].rpartition("_")[2]
            columns.append(np.radians(values) if unit == "deg" else values / 1e3 if unit == "mm" else values)
        return np.column_stack(columns)


def _require_sense(table: Table, measured: MeasuredPoses) -> None:
    """What every row of its test needs."""
    for row, test in enumerate(measured.test):
        if measured.cycle[row] == 0:
            table.refuse_cell(row, "cycle", "the number of the cycle, from 1")
        if test == "path" and not measured.path[row]:
            table.refuse("found no path, expected its name, such as E1-E3", row=row)
        if test != "path" and not measured.pose[row]:
            table.refuse("found no pose, expected its name, such as P1", row=row)
        if test == "approach" and measured.approach[row] == 0:
            table.refuse("found no approach, expected the number of the direction, from 1", row=row)
        if test == "warm-up" and measured.block[row] == 0:
            table.refuse("found no block, expected the number of the block of cycles, from 1", row=row)
    extent = float(np.abs(measured.position).max())
    if extent > _FAR:
        table.refuse(
            f"positions up to {extent:.4g} m: this looks like millimetres; call the columns x_mm y_mm z_mm"
        )
