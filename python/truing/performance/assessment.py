# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a test of performance found, and what it is found from: the measurements, by load and speed."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.performance_file import CommandedPoses, MeasuredPoses
from truing.performance.intervals import Interval

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
FEWEST = 3  # cycles of which a standard deviation and its interval are worth anything
USUAL_CYCLES = {"pose": 30, "approach": 30, "path": 10, "warm-up": 10}
CLAUSES = {
    "AP": "7.2",
    "RP": "7.2",
    "vAP": "7.2",
    "AD": "7.3",
    "RD": "7.3",
    "dAP": "7.6",
    "dRP": "7.6",
    "AT": "8.2",
    "RT": "8.3",
}
FAR = 0.05  # [m] an AP from here on is no robot's, but another frame's


@dataclass(frozen=True)
class Quantity:
    """One characteristic, found from one set of cycles."""

    name: str  # "AP", "RP_a", "vAP", "travel" …; those after _ are angles about x (a), y (b), z (c)
    at: str  # the pose, the pair of poses, or the path
    load: float  # [%] of the rated load; NaN: not said
    speed: float  # [%] of the rated speed; NaN: not said
    unit: str  # "m" | "rad"
    value: float
    interval: tuple[float, float]  # 95 %
    cycles: int

    @property
    def clause(self) -> str:
        """Of ISO 9283:1998; "" of what is not in it."""
        return CLAUSES.get(self.name.split("_")[0], "")


@dataclass(frozen=True)
class NotFound:
    """A characteristic that the measurements do not give, and why."""

    name: str
    at: str
    why: str


@dataclass(frozen=True)
class WarmUp:
    """Course of a warm-up at one pose, block by block."""

    pose: str
    time: Floats  # [s] since the first block; the number of the block where no times are given
    timed: bool
    temperature: Floats | None  # [deg C]
    accuracy: Floats | None  # AP of every block [m]
    repeatability: Floats  # RP of every block [m]
    travel: Floats  # how far the barycentre moved since the first block [m]
    compensated: Floats | None = None  # what would be left of the travel with thermal effects compensated [m]
    effects: tuple[str, ...] = ()  # parameters of the thermal effects that do so
    why_not: str = ""  # they were not fitted


@dataclass(frozen=True)
class Alignment:
    """The rigid motion that was fitted between measured and commanded poses."""

    T_commanded_measured: Floats  # shape=(4, 4) [m]
    poses: int


@dataclass(frozen=True)
class Assessment:
    """What a performance test found."""

    quantities: tuple[Quantity, ...]
    not_found: tuple[NotFound, ...]
    warm_ups: tuple[WarmUp, ...] = ()
    alignment: Alignment | None = None
    warnings: tuple[str, ...] = ()


@dataclass
class Findings:
    """The measurements of one test, and what was found of them so far."""

    measured: MeasuredPoses
    commanded: CommandedPoses | None
    seed: int
    quantities: list[Quantity] = field(default_factory=list)
    missing: list[NotFound] = field(default_factory=list)
    warm_ups: list[WarmUp] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    load: float = np.nan
    speed: float = np.nan

    def conditions(self) -> list[tuple[float, float]]:
        """Load and speed of every set of cycles, the largest first."""
        pairs = np.column_stack([self.measured.load, self.measured.speed])
        found = np.unique(np.where(np.isnan(pairs), -1.0, pairs), axis=0)[::-1]
        return [(load if load >= 0 else np.nan, speed if speed >= 0 else np.nan) for load, speed in found]

    def now(self, load: float, speed: float) -> None:
        self.load, self.speed = load, speed

    def rows(self, test: str) -> Ints:
        m = self.measured
        same = (np.nan_to_num(m.load, nan=-1) == np.nan_to_num(self.load, nan=-1)) & (
            np.nan_to_num(m.speed, nan=-1) == np.nan_to_num(self.speed, nan=-1)
        )
        return np.flatnonzero(same & np.array([one == test for one in m.test]))

    def cycles(self, rows: Ints, test: str, at: str) -> Ints:
        """Rows in the order of their cycles. Says where their number is not the usual one."""
        number = self.measured.cycle[rows]
        order = np.argsort(number, kind="stable")
        twice = np.flatnonzero(np.diff(number[order]) == 0)
        if twice.size:
            raise InputError(
                f"{self.measured.file}: cycle {number[order][twice[0]]} of {at} is there twice (test {test}):"
                " give every cycle its own number, and repeated tests a file each"
            )
        self.count(len(rows), test, at)
        return np.asarray(rows[order])

    def count(self, cycles: int, test: str, at: str) -> None:
        usual = USUAL_CYCLES[test]
        if cycles != usual:
            self.warnings.append(f"{at}: {cycles} cycles, where ISO 9283 (6.9) has {usual}")

    def command(self, pose: str) -> tuple[Floats, Floats | None] | None:
        """Position and orientation; None: no commands are given."""
        if self.commanded is None:
            return None
        row = self.commanded.row(pose)
        if row is None:
            raise InputError(
                f"{self.measured.file}: the pose {pose!r} is not among the commanded ones of"
                f" {self.commanded.file}: {', '.join(self.commanded.name[:12])}"
            )
        rotation = self.commanded.rotation
        return self.commanded.position[row], None if rotation is None else rotation[row]

    def add(
        self,
        name: str,
        at: str,
        value: float | Floats,
        cycles: int,
        interval: Callable[[np.random.Generator], Interval],
        unit: str = "m",
    ) -> None:
        """The same numbers whatever else is asked for: every quantity draws from a stream of its own."""
        place = zlib.crc32(f"{name}|{at}|{self.load:g}|{self.speed:g}".encode())
        low, high = interval(np.random.default_rng([self.seed, place]))
        self.quantities.append(
            Quantity(name, at, self.load, self.speed, unit, float(value), (low, high), cycles)
        )

    def lacks(self, name: str, at: str, why: str) -> None:
        self.missing.append(NotFound(name, at, why))

    def few(self, names: str, at: str, cycles: int) -> bool:
        """Whether there are too few cycles; then it is said."""
        if cycles < FEWEST:
            self.lacks(names, at, f"{cycles} cycles, expected {FEWEST} or more")
        return cycles < FEWEST


def in_order(words: Iterable[str]) -> list[str]:
    """Each once, as they come."""
    return list(dict.fromkeys(words))
