# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Performance of a robot after ISO 9283:1998, with intervals: assess.

measured = truing.files.load_measured("measured.csv")
found = truing.performance.assess(measured, truing.files.load_commanded("poses.csv"))
found.quantities[0].value, found.quantities[0].interval
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing._core import Robot
from truing.errors import InputError
from truing.files.performance_file import CommandedPoses, MeasuredPoses
from truing.performance import intervals
from truing.performance.quantities import (
    crossings,
    distances,
    drift,
    largest_distance,
    path_accuracy,
    path_repeatability,
    pose_accuracy,
    pose_repeatability,
    three_deviations,
)
from truing.performance.warm_up import fit_warm_up
from truing.rotations import rotation_vectors

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
_FAR = 0.05  # [m] an AP from here on is no robot's, but another frame's
_ANGLES = ("a", "b", "c")  # about x, y, z


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


def assess(
    measured: MeasuredPoses,
    commanded: CommandedPoses | None = None,
    *,
    align: bool = False,
    robot: Robot | None = None,
    seed: int = 0,
) -> Assessment:
    """Every characteristic of ISO 9283 that the measurements give, each with its 95 % interval.

    measured: what `load_measured` read. commanded: what `load_commanded` read; without it accuracies (AP, AD,
    AT, dAP) are not found, repeatabilities are.
    align: the instrument's frame is not the robot's base: fit the one to the other by the poses of the test.
    AP then leaves out what a rigid motion explains.
    robot: of a warm-up with joints and temperatures, say what the thermal effects of the catalogue would
    compensate. seed: of the bootstrap.

    Raises InputError on a commanded pose that is missing, a cycle that is there twice, and on measurements
    that plainly are in another frame than the commands.
    """
    if align and commanded is None:
        raise InputError("the frame can be fitted to commanded poses alone, and there are none")
    alignment = _aligned(measured, commanded) if align and commanded is not None else None
    if alignment is not None:
        measured = _moved(measured, alignment.T_commanded_measured)
    found = _Found(measured, commanded, seed)
    for load, speed in found.conditions():
        found.now(load, speed)
        _poses(found)
        _directions(found)
        _distance(found)
        _paths(found)
        _warm_ups(found, robot)
    if not found.quantities:
        why = "; ".join(sorted({f"{one.name} at {one.at}: {one.why}" for one in found.missing}))
        raise InputError(f"{measured.file}: no characteristic can be found ({why})")
    return Assessment(
        tuple(found.quantities), tuple(found.missing), tuple(found.warm_ups), alignment, tuple(found.warnings)
    )


@dataclass
class _Found:
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
        interval: Callable[[np.random.Generator], intervals.Interval],
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


def _in_order(words: Iterator[str]) -> list[str]:
    return list(dict.fromkeys(words))


# ---- Poses -------------------------------------------------------------------------------------------------


def _poses(found: _Found) -> None:
    """AP and RP of every pose."""
    m = found.measured
    every = found.rows("pose")
    for pose in _in_order(m.pose[row] for row in every):
        rows = found.cycles(every[[m.pose[row] == pose for row in every]], "pose", pose)
        if found.few("AP, RP", pose, len(rows)):
            continue
        attained, command = m.position[rows], found.command(pose)
        _accuracy(found, pose, attained, None if command is None else command[0])
        found.add(
            "RP",
            pose,
            pose_repeatability(attained),
            len(rows),
            partial(intervals.repeatability_interval, attained),
        )
        if m.rotation is not None:
            _angles(found, pose, m.rotation[rows], None if command is None else command[1])


def _accuracy(found: _Found, pose: str, attained: Floats, command: Floats | None) -> None:
    if command is None:
        found.lacks("AP", pose, "there are no commanded poses")
        return
    value = float(pose_accuracy(attained, command))
    if value > _FAR:
        raise InputError(
            f"{found.measured.file}: {pose} is {value:.4g} m from where it was commanded: another frame,"
            " another unit or another tool; measured positions are in the robot's base, unless the frame is"
            " to be fitted (--align)"
        )
    found.add(
        "AP",
        pose,
        value,
        len(attained),
        partial(intervals.length_interval, attained - command),
    )


def _angles(found: _Found, pose: str, rotations: Floats, command: Floats | None) -> None:
    """AP and RP of the angles about x, y, z: rotation vectors from the commanded orientation, or from the
    first one.
    """
    turned = rotation_vectors(rotations @ (rotations[0] if command is None else command).T)
    n = len(turned)
    if command is None:
        found.lacks("AP of angles", pose, "there are no commanded orientations")
    for letter, angles in zip(_ANGLES, turned.T, strict=True):
        if command is not None:
            found.add(
                f"AP_{letter}",
                pose,
                float(angles.mean()),
                n,
                partial(intervals.mean_interval, angles),
                "rad",
            )
        found.add(
            f"RP_{letter}",
            pose,
            three_deviations(angles),
            n,
            partial(intervals.deviation_interval, angles),
            "rad",
        )


def _directions(found: _Found) -> None:
    """vAP of every pose that was approached from several directions."""
    m = found.measured
    every = found.rows("approach")
    for pose in _in_order(m.pose[row] for row in every):
        of_pose = every[[m.pose[row] == pose for row in every]]
        groups = [
            m.position[found.cycles(of_pose[m.approach[of_pose] == k], "approach", f"{pose} from {k}")]
            for k in np.unique(m.approach[of_pose])
        ]
        fewest = min(len(group) for group in groups)
        if len(groups) < 2:
            found.lacks("vAP", pose, "approached from one direction alone")
        elif not found.few("vAP", pose, fewest):
            found.add(
                "vAP",
                pose,
                largest_distance([group.mean(axis=0) for group in groups]),
                fewest,
                partial(intervals.directions_interval, groups),
            )


def _distance(found: _Found) -> None:
    """AD and RD between P2 and P4, of the cycles that have both."""
    m = found.measured
    every = found.rows("pose")
    first, second = (every[[m.pose[row] == pose for row in every]] for pose in ("P2", "P4"))
    both, i, j = np.intersect1d(m.cycle[first], m.cycle[second], return_indices=True)
    if not len(first) or not len(second) or found.few("AD, RD", "P2-P4", len(both)):
        return
    attained = distances(m.position[first[i]], m.position[second[j]])
    here, there = found.command("P2"), found.command("P4")
    if here is None or there is None:
        found.lacks("AD", "P2-P4", "there are no commanded poses")
    else:
        off = attained - float(np.linalg.norm(here[0] - there[0]))
        found.add("AD", "P2-P4", float(off.mean()), len(both), partial(intervals.mean_interval, off))
    found.add(
        "RD",
        "P2-P4",
        three_deviations(attained),
        len(both),
        partial(intervals.deviation_interval, attained),
    )


# ---- Paths -------------------------------------------------------------------------------------------------


def _paths(found: _Found) -> None:
    """AT and RT of every path."""
    m = found.measured
    every = found.rows("path")
    for path in _in_order(m.path[row] for row in every):
        rows = every[[m.path[row] == path for row in every]]
        attained, command = _path_points(found, path, rows)
        found.count(len(attained), "path", path)
        if found.few("AT, RT", path, len(attained)):
            continue
        if command is None:
            found.lacks("AT", path, "there is no commanded path of this name")
        else:
            if float(path_accuracy(attained, command)) > _FAR:
                raise InputError(
                    f"{m.file}: the path {path} is {float(path_accuracy(attained, command)):.4g} m from the"
                    " commanded one: another frame, another unit or another tool (--align fits the frame)"
                )
            found.add(
                "AT",
                path,
                path_accuracy(attained, command),
                len(attained),
                partial(intervals.path_interval, attained - command),
            )
        found.add(
            "RT",
            path,
            path_repeatability(attained),
            len(attained),
            partial(intervals.path_repeatability_interval, attained),
        )


def _path_points(found: _Found, path: str, rows: Ints) -> tuple[Floats, Floats | None]:
    """Where every cycle crossed the planes of the path's points, shape=(n, m, 3); the commanded points."""
    m = found.measured
    command = None
    if found.commanded is not None and (of_path := found.commanded.path_rows(path)).size:
        command = found.commanded.position[of_path]
    numbered = m.point[rows] > 0
    if numbered.any() and not numbered.all():
        raise InputError(f"{m.file}: some rows of the path {path} have a point and others none")
    cycles = [rows[m.cycle[rows] == cycle] for cycle in np.unique(m.cycle[rows])]
    if not numbered.any():
        return _cut(found, path, cycles, command), command
    points = np.unique(m.point[rows])
    for of_cycle in cycles:
        if not np.array_equal(np.sort(m.point[of_cycle]), points):
            raise InputError(
                f"{m.file}: cycle {m.cycle[of_cycle[0]]} of the path {path} does not have each of its"
                f" {len(points)} points once"
            )
    if command is not None and not np.array_equal(points, np.arange(1, len(command) + 1)):
        raise InputError(
            f"{m.file}: the path {path} was measured at {len(points)} points, and commanded at {len(command)}"
        )
    return np.stack([m.position[of[np.argsort(m.point[of])]] for of in cycles]), command


def _cut(found: _Found, path: str, cycles: list[Ints], command: Floats | None) -> Floats:
    """Recordings of a path, cut by the planes of its points; the ends that not every cycle reached are left
    out of all.
    """
    m = found.measured
    if command is None or len(command) < 2:
        raise InputError(
            f"{m.file}: the path {path} is a recording (no column point): expected its commanded points,"
            " which say where it is cut"
        )
    cut = []
    for of in cycles:
        order = of if m.time is None else of[np.argsort(m.time[of], kind="stable")]
        cut.append(crossings(m.position[order], command))
    crossed = np.stack(cut)
    missed = np.flatnonzero(np.isnan(crossed).any(axis=(0, 2)))
    inner = missed[(missed > 0) & (missed < len(command) - 1)]
    if inner.size:
        raise InputError(
            f"{m.file}: not every cycle of the path {path} crosses the plane of its point {inner[0] + 1}: the"
            " recording is cut off, or in another frame"
        )
    for end in missed:  # the robot stops there, on this side of the plane or the other
        for cycle, of in enumerate(cycles):
            if np.isnan(crossed[cycle, end]).any():
                ends = m.position[of]
                crossed[cycle, end] = ends[np.argmin(np.linalg.norm(ends - command[end], axis=1))]
    return crossed


# ---- Warm-up -----------------------------------------------------------------------------------------------


def _warm_ups(found: _Found, robot: Robot | None) -> None:
    """dAP, dRP and the course of the warm-up at every pose."""
    m = found.measured
    every = found.rows("warm-up")
    for pose in _in_order(m.pose[row] for row in every):
        rows = every[[m.pose[row] == pose for row in every]]
        numbers = np.unique(m.block[rows])
        blocks = [rows[m.block[rows] == number] for number in numbers]
        n = min(len(block) for block in blocks)
        if len(blocks) < 2 or n < FEWEST:
            found.lacks("dAP, dRP", pose, "fewer than two blocks, or fewer than three cycles in one")
            continue
        if n != max(len(block) for block in blocks):
            raise InputError(
                f"{m.file}: the blocks of the warm-up at {pose} have {n} to {max(map(len, blocks))} cycles,"
                " expected as many in each"
            )
        found.count(n, "warm-up", f"{pose}, each block of the warm-up")
        positions = np.stack([m.position[block] for block in blocks])
        time, timed = _block_times(m, blocks, numbers)
        command = found.command(pose)
        if command is None:
            found.lacks("dAP", pose, "there are no commanded poses")
        _drifts(found, pose, positions, time, None if command is None else command[0])
        course = WarmUp(
            pose,
            time - time[0],
            timed,
            None if m.temperature is None else np.array([m.temperature[b].mean() for b in blocks]),
            None if command is None else pose_accuracy(positions, command[0]),
            pose_repeatability(positions),
            _travel(positions),
        )
        found.warm_ups.append(_with_thermal_fit(course, m, rows, blocks, robot))


def _drifts(found: _Found, pose: str, positions: Floats, time: Floats, command: Floats | None) -> None:
    n = positions.shape[1]
    if command is not None:
        found.add(
            "dAP",
            pose,
            drift(pose_accuracy(positions, command)),
            n,
            partial(intervals.accuracy_drift_interval, positions - command, time),
        )
    found.add(
        "dRP",
        pose,
        drift(pose_repeatability(positions)),
        n,
        partial(intervals.repeatability_drift_interval, positions, time),
    )
    found.add(
        "travel",
        pose,
        float(_travel(positions).max()),
        n,
        partial(intervals.travel_interval, positions, time),
    )


def _travel(positions: Floats) -> Floats:
    """How far the barycentre of every block is from the first one's, shape=(blocks,) of (blocks, n, 3)."""
    means = positions.mean(axis=1)
    return np.asarray(np.linalg.norm(means - means[0], axis=-1))


def _block_times(m: MeasuredPoses, blocks: list[Ints], numbers: Ints) -> tuple[Floats, bool]:
    """Mean time of every block [s], or its number."""
    if m.time is None or not all(np.isfinite(m.time[block]).all() for block in blocks):
        return numbers.astype(np.float64), False
    time = np.array([m.time[block].mean() for block in blocks])
    if (np.diff(time) <= 0).any():
        raise InputError(f"{m.file}: the blocks of the warm-up are not in the order of their times (t_s)")
    return time, True


def _with_thermal_fit(
    course: WarmUp, m: MeasuredPoses, rows: Ints, blocks: list[Ints], robot: Robot | None
) -> WarmUp:
    if robot is None:
        return replace(course, why_not="no robot file is given")
    if m.joints is None or m.temperature is None:
        return replace(course, why_not="it needs the columns q1_rad … and temp_C")
    if not (np.isfinite(m.joints[rows]).all() and np.isfinite(m.temperature[rows]).all()):
        return replace(course, why_not="joints or temperatures of the warm-up have gaps")
    try:
        fit = fit_warm_up(robot, m.joints[rows], m.position[rows], m.temperature[rows], m.block[rows])
    except InputError as error:
        return replace(course, why_not=str(error))
    place = {row: k for k, row in enumerate(rows)}
    left = np.stack([[m.position[r] - fit.predicted[place[r]] for r in block] for block in blocks])
    means = left.mean(axis=1)
    # Both halves of the blocks were predicted by fits with a mean of their own: it is no drift.
    compensated = np.linalg.norm(means - means.mean(axis=0), axis=-1)
    return replace(course, compensated=compensated, effects=fit.effects)


# ---- Frames ------------------------------------------------------------------------------------------------


def _aligned(measured: MeasuredPoses, commanded: CommandedPoses) -> Alignment:
    """The rigid motion that brings the barycentres of the poses nearest to the commanded positions (Arun,
    Huang and Blostein 1987).
    """
    names = [
        name
        for name in _in_order(
            pose for pose, test in zip(measured.pose, measured.test, strict=True) if test == "pose"
        )
        if commanded.row(name) is not None
    ]
    here = np.array([measured.position[_rows_of(measured, name)].mean(axis=0) for name in names])
    there = np.array([commanded.position[commanded.name.index(name)] for name in names])
    if len(names) < 3 or np.linalg.svd(here - here.mean(axis=0))[1][1] < 1e-3:
        raise InputError(
            f"{measured.file}: the frame is fitted to three poses or more that are not on one line, found"
            f" {len(names)}"
        )
    u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    T = np.eye(4)
    T[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    T[:3, 3] = there.mean(axis=0) - T[:3, :3] @ here.mean(axis=0)
    return Alignment(T, len(names))


def _rows_of(measured: MeasuredPoses, pose: str) -> list[int]:
    return [
        row
        for row, (name, test) in enumerate(zip(measured.pose, measured.test, strict=True))
        if name == pose and test == "pose"
    ]


def _moved(measured: MeasuredPoses, T: Floats) -> MeasuredPoses:
    rotation = None if measured.rotation is None else T[:3, :3] @ measured.rotation
    return replace(measured, position=measured.position @ T[:3, :3].T + T[:3, 3], rotation=rotation)
