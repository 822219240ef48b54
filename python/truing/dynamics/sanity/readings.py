# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Would the recordings fit the robot's model far better if their columns were read otherwise?

Each joint's torque is a multiple of the model's rigid torque, plus friction and an offset. The multiple and
the friction must not be negative: a motor does not gain energy from friction, nor do masses weigh upwards.
What such a fit leaves is compared over readings: signs, order and units of columns, and which way is down.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity import conventions, gravity
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid
from truing.dynamics.sanity.loads import OF_LOAD, REACH

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

ROWS = 800  # that readings are compared on
ROWS_OF_ONE = 300  # the same, of a single recording
ROWS_OF_WAYS = 150  # that ways to count angles are searched on, hundreds of them
FEWEST = 40  # rows in which a joint moves
POOR = 0.3  # of the variance: a joint that leaves more is worth a look
GAIN = 0.4  # of a joint's variance: from here on another reading is far better
PART = 0.5  # and it must leave at most this part of what the joints in question left
FITS = 0.25  # of the variance: more must not be left of a joint that is read with another sign
SEEN, SEVERAL = 0.02, 2  # of the variance that a joint left; joints that leave half of it or less
AS_GOOD = 0.9  # of the gain of another reading: a force or load at the tool with more may be all there is
FAIR = 0.08  # of the variance: where a joint leaves more, other orders are looked at
HEAVY = 0.5  # of the variance by rigid torque: there angles are seen in it
OF_ALL = ("torque_order", "joint_order", "angle_convention", "gravity_removed")  # joints together
# A base upside down is what half a turn of the joint after a vertical one is, and the likelier of the two.
PLAINER = {"angle_convention": "gravity_direction"}
GAIN_OF_ALL, PART_OF_ALL = 0.08, 1.0 / 3.0  # gain and part, of all joints together
AS_LITTLE = 2.0  # times what the best reading leaves of a joint: another that leaves more is not as good
NOT_AT_ALL, WELL = 0.8, 0.2  # of the variance: a sign is certain where it takes one to the other
BEYOND = 4.0  # times the limit of a joint: no angle is there
BOTH = 0.05  # of the variance: rigid torque and friction both speak of the sign
DEPENDENT = 1e-9  # determinant of columns of unit length that say the same
# Of three columns.
_SUBSETS = np.array([one for one in itertools.product((True, False), repeat=3) if any(one)])
_BOTH_IN = _SUBSETS[:, :, None] & _SUBSETS[:, None, :]


@dataclass(frozen=True)
class Rows:
    """Rows of all recordings, evenly picked. shape=(n, joints)"""

    q: Floats
    qd: Floats
    qdd: Floats
    direction: Floats
    torque: Floats  # NaN: not measured
    moving: Bools


@dataclass(frozen=True)
class Reading:
    """How columns are read: joint j is column `order[j]`; factors are those of the columns."""

    order: tuple[int, ...]
    torque_order: tuple[int, ...]
    position: tuple[float, ...]
    torque: tuple[float, ...]
    gravity: tuple[float, ...]  # [m/s^2] in the base frame
    zero: tuple[float, ...]  # [rad | m] that each joint's angle is more in the robot's file


@dataclass(frozen=True)
class Fit:
    """What friction and a multiple of the rigid torque leave and explain, of each joint's variance."""

    left: Floats  # NaN: the joint does not move, or its torque was not measured
    scale: Floats  # of the rigid torque
    by_rigid: Floats
    by_friction: Floats


@dataclass(frozen=True)
class _Candidate:
    finding: str
    joints: tuple[int, ...]  # that it is about; none: all
    reading: Reading


@dataclass(frozen=True)
class _Found:
    finding: str
    joints: tuple[int, ...]
    before: float  # largest part of the variance that was left of a joint in question
    after: float
    rival: str  # another reading that does as well
    certain: bool


# ---- Fit -------------------------------------------------------------------------------------------
def rows_of(grids: Sequence[Grid], most: int = ROWS) -> Rows:
    """About so many rows, of each recording its share."""
    total = sum(len(grid.rows) for grid in grids)
    every = max(1, math.ceil(total / most))
    picked = [(grid, grid.rows[::every]) for grid in grids]

    def column(name: str) -> Floats:
        return np.concatenate([getattr(grid, name)[rows] for grid, rows in picked])

    moving = np.concatenate([grid.moving[rows] for grid, rows in picked])
    q, qd, qdd, direction, torque = map(column, ("q", "qd", "qdd", "direction", "torque"))
    return Rows(q, qd, qdd, direction, torque, moving)


class _Model:
    """Fits of one set of rows; rigid torques are computed once for each way to read the angles."""

    def __init__(self, robot: _core.Robot, rows: Rows) -> None:
        self.robot, self.rows = robot, rows
        self.rigid: dict[tuple[object, int | None], Floats] = {}
        self.fits: dict[Reading, Fit] = {}

    def fit(self, reading: Reading) -> Fit:
        """Computed once for each reading."""
        if reading not in self.fits:
            self.fits[reading] = _fit_joints(*self._rows_of(reading))
        return self.fits[reading]

    def _rows_of(self, reading: Reading) -> tuple[Floats, Floats, Bools]:
        """Rigid torque, direction and speed, shape=(n, joints, 3); measured torque; and in which rows which
        joint moves.
        """
        rows, order = self.rows, list(reading.order)
        factor = np.array(reading.position)[order]
        torque = (rows.torque * np.array(reading.torque))[:, list(reading.torque_order)]
        columns = (
            self._rigid_of(reading),
            np.copysign(1.0, factor) * rows.direction[:, order],
            factor * rows.qd[:, order],
        )
        return np.stack(columns, axis=2), torque, rows.moving[:, order] & ~np.isnan(torque)

    def _rigid_of(self, reading: Reading) -> Floats:
        """Rigid torques are linear in gravity: those without it, and by each axis of it."""
        key = (reading.order, reading.position, reading.zero)
        if (key, None) not in self.rigid:
            motion = self._angles(reading), *(self._read(x, reading) for x in (self.rows.qd, self.rows.qdd))
            weightless = gravity.under(self.robot, np.zeros(3))
            self.rigid[key, None] = np.asarray(_core.rigid_torques(weightless, *motion))
        out = self.rigid[key, None]
        for axis, size in enumerate(reading.gravity):
            if size == 0.0:
                continue
            if (key, axis) not in self.rigid:
                self.rigid[key, axis] = gravity.weight(self.robot, np.eye(3)[axis], self._angles(reading))
            out = out + size * self.rigid[key, axis]
        return out

    def _read(self, columns: Floats, reading: Reading) -> Floats:
        return np.asarray((columns * np.array(reading.position))[:, list(reading.order)])

    def _angles(self, reading: Reading) -> Floats:
        return np.asarray(self._read(self.rows.q, reading) + np.array(reading.zero))

    def left_with_force(self, reading: Reading) -> float:
        """What is left, over all joints, with the constant force at the tool that fits best."""
        return self._left_beside(reading, gravity.held_against(self.robot, self._angles(reading)))[0]

    def left_with_load(self, reading: Reading) -> float:
        """The same with the load at the tool that fits best; infinite where none could hang there."""
        robot = gravity.under(self.robot, np.array(reading.gravity))
        motion = self._angles(reading), *(self._read(x, reading) for x in (self.rows.qd, self.rows.qdd))
        columns = np.asarray(_core.torque_regressor(robot, *motion))[:, :, -10 : -10 + OF_LOAD]
        left, load = self._left_beside(reading, columns)
        tool = np.array(robot.targets[0].T_last_target)[:3, 3] if robot.targets else np.zeros(3)
        hangs = load[0] > 0.0 and np.linalg.norm(load[1:] / load[0] - tool) < REACH
        return left if hangs else math.inf

    def _left_beside(self, reading: Reading, pulls: Floats) -> tuple[float, Floats]:
        """What is left, over all joints, with more columns, shape=(n, joints, k), and their factors."""
        sides, torques = [], []
        columns, measured, moves = self._rows_of(reading)
        fit = self.fit(reading)
        for j in np.flatnonzero(~np.isnan(fit.left)):
            own, torque = columns[moves[:, j], j], measured[moves[:, j], j]
            used = own if fit.scale[j] > 0.0 else own[:, 1:]
            both = _without(used, np.column_stack([torque, pulls[moves[:, j], j]]))
            both /= torque.std() * math.sqrt(len(torque))
            torques.append(both[:, 0])
            sides.append(both[:, 1:])
        side, torque = np.concatenate(sides), np.concatenate(torques)
        factors = np.asarray(np.linalg.lstsq(side, torque, rcond=None)[0], dtype=np.float64)
        return float(np.sum((torque - side @ factors) ** 2)), factors


def _without(columns: Floats, values: Floats) -> Floats:
    """What least squares by these columns and an offset leaves of the values."""
    x = np.column_stack([columns, np.ones(len(columns))])
    return np.asarray(values - x @ np.linalg.lstsq(x, values, rcond=None)[0])


def _not_negative(gram: Floats, right: Floats) -> Floats:
    """Factors of least squares that are not negative: the best of all subsets of the three columns.
    shape=(joints, 3)
    """
    parts = np.where(_BOTH_IN, gram[:, None], np.eye(3))
    able = np.linalg.det(parts) >= DEPENDENT
    parts[~able] = np.eye(3)
    factors = np.linalg.solve(parts, (_SUBSETS * right[:, None])[..., None])[..., 0]
    explained = np.where(able & (factors >= 0.0).all(axis=2), np.einsum("jsk,jk->js", factors, right), 0.0)
    best = np.argmax(explained, axis=1)[:, None]
    chosen = np.take_along_axis(factors, best[:, :, None], axis=1)[:, 0]
    return np.asarray(np.where(np.take_along_axis(explained, best, axis=1) > 0.0, chosen, 0.0))


def _fit_joints(columns: Floats, torque: Floats, moves: Bools) -> Fit:
    """Least squares of each joint with an offset, the other factors not negative."""
    inside, count = moves.T[:, :, None], np.maximum(moves.sum(axis=0), 1)[:, None, None]

    def centred(values: Floats) -> Floats:
        values = np.where(inside, values, 0.0)
        return np.where(inside, values - values.sum(axis=1, keepdims=True) / count, 0.0)

    x, y = centred(columns.swapaxes(0, 1)), centred(torque.T[:, :, None])
    size, total = np.sqrt((x**2).sum(axis=1)), (y**2).sum(axis=(1, 2))
    x /= np.where(size > 0.0, size, 1.0)[:, None]
    across = x.swapaxes(1, 2)
    factors = _not_negative(across @ x, (across @ y)[:, :, 0])
    left = ((y - x @ factors[:, :, None]) ** 2).sum(axis=(1, 2))
    by_friction = ((x[:, :, 1:] @ factors[:, 1:, None]) ** 2).sum(axis=(1, 2))
    known = (moves.sum(axis=0) >= FEWEST) & (total > 0.0)
    variance = np.where(known, total, np.nan)
    scale = np.where(size[:, 0] > 0.0, factors[:, 0] / np.where(size[:, 0] > 0.0, size[:, 0], 1.0), 0.0)
    return Fit(
        left / variance,
        np.where(known, scale, np.nan),
        factors[:, 0] ** 2 / variance,
        by_friction / variance,
    )


# ---- Readings --------------------------------------------------------------------------------------
def as_written(robot: _core.Robot) -> Reading:
    joints = len(robot.driven_joints())
    identity, ones = tuple(range(joints)), (1.0,) * joints
    zero = (0.0,) * joints
    return Reading(identity, identity, ones, ones, tuple(float(one) for one in robot.gravity), zero)


def _candidates(reading: Reading, revolute: Sequence[bool], poor: Sequence[int]) -> Iterator[_Candidate]:
    """Other readings, the plainest first: those that concern the joints that fit badly."""
    for j in poor:
        column, other = reading.order[j], reading.torque_order[j]
        torque, position = _turned(reading.torque, other), _turned(reading.position, column)
        yield _Candidate("torque_sign", (j,), replace(reading, torque=torque))
        yield _Candidate("position_sign", (j,), replace(reading, position=position))
        yield _Candidate("joint_sign", (j,), replace(reading, torque=torque, position=position))
    for kind, size in (("angles_in_deg", math.pi / 180.0), ("angles_in_rad", 180.0 / math.pi)):
        factors = zip(reading.position, revolute, strict=True)
        position = tuple(factor * (size if turns else 1.0) for factor, turns in factors)
        yield _Candidate(kind, (), replace(reading, position=position))


def _downs(model: _Model, reading: Reading) -> Iterator[_Candidate]:
    """Gravity the other way that fits best, unless a constant force at the tool does nearly as well; and
    torques that the weight was taken off.
    """
    size = float(np.linalg.norm(reading.gravity))
    if not size > 0.0:
        return

    def read(direction: Floats) -> Reading:
        return replace(reading, gravity=tuple(float(one) for one in size * direction))

    def left(one: Reading) -> float:
        return float(np.nan_to_num(model.fit(one).left, nan=0.0).sum())

    down = read(gravity.best_direction(lambda direction: left(read(direction))))
    if not _gains_as_much(model.left_with_force(reading), model.fit(reading), model.fit(down)):
        yield _Candidate("gravity_direction", (), down)
    yield _Candidate("gravity_removed", (), read(np.zeros(3)))


def _turned(factors: tuple[float, ...], k: int) -> tuple[float, ...]:
    return (*factors[:k], -factors[k], *factors[k + 1 :])


def _swapped(order: tuple[int, ...], i: int, j: int) -> tuple[int, ...]:
    out = list(order)
    out[i], out[j] = out[j], out[i]
    return tuple(out)


def _orders(
    model: _Model, reading: Reading, names: Sequence[str], revolute: Sequence[bool]
) -> Iterator[_Candidate]:
    """The best order of the torques, and that of all columns of the joints: from the plainest start (as they
    are, backwards, by the alphabet) by exchanges of two, as long as one helps. Columns say by their units
    whether a joint turns or slides.
    """
    n = len(names)

    def fits(order: Sequence[int]) -> bool:
        return all(revolute[j] == revolute[k] for j, k in enumerate(order))

    alphabet = tuple(int(k) for k in np.argsort(np.argsort(names)))
    for kind in ("torque_order", "joint_order"):
        both = kind == "joint_order"

        def read(order: tuple[int, ...], both: bool = both) -> Reading:
            columns = tuple(reading.order[k] for k in order) if both else reading.order
            torques = tuple(reading.torque_order[k] for k in order)
            return replace(reading, order=columns, torque_order=torques)

        def left(order: tuple[int, ...], read: Callable[[tuple[int, ...]], Reading] = read) -> float:
            return float(np.nan_to_num(model.fit(read(order)).left, nan=1.0).sum())

        start = min(filter(fits, (tuple(range(n)), tuple(range(n))[::-1], alphabet)), key=left)
        best, order = left(start), start
        while True:
            pairs = itertools.combinations(range(n), 2)
            tried = {_swapped(order, i, j) for i, j in pairs if revolute[i] == revolute[j]}
            other = min(sorted(tried), key=left, default=order)
            if left(other) > best - GAIN_OF_ALL / n:
                break
            best, order = left(other), other
        changed = tuple(j for j in range(n) if order[j] != j)
        if changed:
            yield _Candidate(kind, changed, read(order))


def _counted_otherwise(
    model: _Model, reading: Reading, revolute: Sequence[bool], poor: Sequence[int]
) -> Iterator[_Candidate]:
    """Angles from other zeros, or the other way: more than the sign of one joint that fits badly."""
    rows = model.rows
    every = max(1, len(rows.q) // ROWS_OF_WAYS)
    few = _Model(model.robot, Rows(*(getattr(rows, field.name)[::every] for field in fields(rows))))

    def read(ways: tuple[conventions.Way, ...]) -> Reading:
        position, torque, zero = list(reading.position), list(reading.torque), list(reading.zero)
        for j, (sign, quarter) in enumerate(ways):
            position[reading.order[j]] *= sign
            torque[reading.torque_order[j]] *= sign
            zero[j] += conventions.angle(quarter)
        return replace(reading, position=tuple(position), torque=tuple(torque), zero=tuple(zero))

    def left(ways: tuple[conventions.Way, ...]) -> float:
        return float(np.nan_to_num(few.fit(read(ways)).left, nan=1.0).sum())

    ways = conventions.best_ways(left, revolute, GAIN_OF_ALL / len(revolute))
    changed = tuple(j for j, way in enumerate(ways) if way != conventions.AS_IT_IS)
    if len(changed) > 1 or any(quarter for _, quarter in ways) or not set(changed) <= set(poor):
        yield _Candidate("angle_convention", changed, read(ways))


def better_reading(
    robot: _core.Robot, rows: Rows, reading: Reading | None = None
) -> tuple[list[_Found], Reading, Fit]:
    """One reading after the other that is far better than the one before; the last; and its fit.

    reading: where to begin, of one recording of several, whose order is questioned only where it fits badly.
    """
    joints = driven_joints(robot)
    names, revolute = [joint.name for joint in joints], [joint.type == "revolute" for joint in joints]
    model = _Model(robot, rows)
    of_all = reading is None  # a robot counts its angles one way: no single recording of several changes that
    few, seen = (FAIR, SEEN) if of_all else (POOR, POOR)
    reading = reading or as_written(robot)
    fit = model.fit(reading)
    found: list[_Found] = []
    while len(found) < 2 * len(joints):
        with_load = model.left_with_load(reading) if np.any(fit.left > seen) else math.inf
        if with_load < (1.0 - AS_GOOD) * float(np.nansum(fit.left)):
            break  # a gripper that the file lacks: no reading gains more
        poor = [int(j) for j in np.flatnonzero(fit.left > POOR)]
        candidates = list(_candidates(reading, revolute, poor)) if poor else []
        if np.any(fit.left > seen):
            candidates += _downs(model, reading)
        if np.any(fit.left > few):
            candidates += _orders(model, reading, names, revolute)
        if of_all and (poor or np.any((fit.left > few) & (fit.by_rigid > HEAVY))):
            candidates += _counted_otherwise(model, reading, revolute, poor)
        tried = [
            (gain, candidate, other)
            for candidate in candidates
            for other in (model.fit(candidate.reading),)
            for gain in (_gain(fit, other, candidate),)
            if gain > 0.0
        ]
        tried = [one for one in tried if not _gains_as_much(with_load, fit, one[2])]
        if not tried:
            break
        candidate, other, rival = _chosen(tried)
        found.append(_what_was_found(candidate, fit, other, rival))
        reading, fit = candidate.reading, other
    plain = as_written(robot)
    in_order = (reading.order, reading.torque_order) == (plain.order, plain.torque_order)
    found = [replace(one, certain=one.certain and in_order) for one in found]  # else: of which column?
    return found, reading, fit


def _chosen(tried: Sequence[tuple[float, _Candidate, Fit]]) -> tuple[_Candidate, Fit, str]:
    """The reading that gains most, or a plainer one that is as good; and another that is, if any."""
    _, best, fit = max(tried, key=lambda one: one[0])
    as_good = [
        (one, own) for _, one, own in tried if one is not best and _alike(one, best) and _as_good(own, fit)
    ]
    for one, own in as_good:
        if one.finding == PLAINER.get(best.finding):
            return one, own, ""
    rivals = [one.finding for one, _ in as_good if PLAINER.get(one.finding) != best.finding]
    return best, fit, rivals[0] if rivals else ""


def _gain(fit: Fit, other: Fit, candidate: _Candidate) -> float:
    """What less is left, over all joints; 0 where that is not far better."""
    before, after = np.nan_to_num(fit.left, nan=1.0), np.nan_to_num(other.left, nan=1.0)
    gain = float((before - after).sum())
    if (np.isnan(other.left) & ~np.isnan(fit.left)).any():
        return 0.0
    if candidate.finding == "gravity_direction":
        # A spring at one joint may look like weight; another way of down shows at several, and harms none.
        better = np.count_nonzero((before > SEEN) & (after < PART * before))
        good = gain > GAIN_OF_ALL and better >= SEVERAL and (after < before + SEEN).all()
        return gain if good else 0.0
    if candidate.finding in OF_ALL:
        # Joints with friction and hardly any weight fit in any order: all of them together decide.
        far = gain > GAIN_OF_ALL and np.nansum(other.left) < PART_OF_ALL * np.nansum(fit.left)
        return gain if far else 0.0
    about = list(candidate.joints) or list(range(len(before)))
    if candidate.joints and after[about].max() > FITS:  # a spring, say, that the model lacks
        return 0.0
    return gain if gain > GAIN and after[about].sum() < PART * before[about].sum() else 0.0


def _as_good(rival: Fit, best: Fit) -> bool:
    """Whether a reading leaves as little of every joint as the best one does. The gain would not tell: where
    most of the torques was unexplained, a reading that explains four fifths has gained nearly as much.
    """
    return not bool((rival.left > AS_LITTLE * np.maximum(best.left, SEEN)).any())


def _gains_as_much(left: float, fit: Fit, other: Fit) -> bool:
    """Whether what leaves so much over all joints gains nearly as much as another reading."""
    as_it_is = float(np.nansum(fit.left))
    return as_it_is - left >= AS_GOOD * (as_it_is - float(np.nansum(other.left)))


def _alike(one: _Candidate, other: _Candidate) -> bool:
    """Whether both are about the same joints."""
    return bool(set(one.joints) & set(other.joints)) or not (one.joints and other.joints)


def _what_was_found(candidate: _Candidate, fit: Fit, other: Fit, rival: str) -> _Found:
    about = list(candidate.joints) or list(range(len(fit.left)))
    before = float(np.nanmax(fit.left[about]))
    after = float(np.nanmax(other.left[about]))
    certain = not rival and (
        candidate.finding == "gravity_direction"
        or candidate.finding == "torque_sign"
        and before > NOT_AT_ALL
        and after < WELL
        and bool((other.by_rigid[about] > BOTH).all() and (other.by_friction[about] > BOTH).all())
    )
    return _Found(candidate.finding, candidate.joints, before, after, rival, certain)


# ---- Words -----------------------------------------------------------------------------------------
_READINGS = {
    "torque_sign": "the torque of {0} has the opposite sign",
    "position_sign": "the angle of {0} has the opposite sign",
    "joint_sign": "{0} turns the other way: angle and torque have the opposite sign",
    "torque_order": "the torques are in another order: {1}",
    "joint_order": "the joints are in another order: {1}",
    "angles_in_deg": "the angles are in deg, not in rad",
    "angles_in_rad": "the angles are in rad, not in deg",
    "angle_convention": "angles are not counted as the robot's file counts them, which would be {3}",
    "gravity_direction": "gravity points along {2} of the base, not as the robot's file has it",
    "gravity_removed": "the torques do not hold the weight of the links, as if a controller had taken it off",
}
_KINDS = {"angles_in_deg": "position_unit", "angles_in_rad": "position_unit"}


@dataclass(frozen=True)
class Read:
    """What other readings say: findings, factors by which columns are corrected, and the fit with the reading
    that is best for all recordings together.
    """

    findings: tuple[RecordingFinding, ...]
    torque: dict[str, Floats]  # by recording, shape=(joints,)
    position: dict[str, Floats]
    gravity: tuple[float, ...]  # [m/s^2] in the base frame
    fit: Fit


def readings(robot: _core.Robot, grids: Sequence[Grid], each: bool = True) -> Read:
    """All recordings together, then each: one of them may have been written otherwise."""
    joints = driven_joints(robot)
    found, reading, fit = better_reading(robot, rows_of(grids))
    cases = [(one, reading, tuple(grid.name for grid in grids)) for one in found]
    for grid in grids if each else ():
        if len(grids) > 1 and len(grid.rows):
            more, own, _ = better_reading(robot, rows_of([grid], ROWS_OF_ONE), reading)
            cases += [(_of_one_alone(one), own, (grid.name,)) for one in more]
    cases = [(_with_limits(one, joints, grids, names), own, names) for one, own, names in cases]
    torque = {grid.name: np.ones(len(joints)) for grid in grids}
    position = {grid.name: np.ones(len(joints)) for grid in grids}
    for one, _, names in cases:
        for name in names if one.certain else ():
            if one.finding == "gravity_direction":
                continue
            if one.finding == "torque_sign":
                torque[name][list(one.joints)] *= -1.0
            else:
                position[name] *= [math.pi / 180.0 if j.type == "revolute" else 1.0 for j in joints]
    groups: dict[tuple[object, ...], list[tuple[_Found, Reading, tuple[str, ...]]]] = {}
    for case in cases:
        one, _, names = case
        groups.setdefault((one.finding, one.rival, one.certain, len(names) == len(grids)), []).append(case)
    words = [_finding(group, [joint.name for joint in joints], len(grids)) for group in groups.values()]
    downs = [own.gravity for one, own, _ in cases if one.finding == "gravity_direction" and one.certain]
    down = downs[0] if downs else as_written(robot).gravity
    return Read(tuple(words), torque, position, down, fit)


def _of_one_alone(one: _Found) -> _Found:
    """A robot hangs one way: no single recording of several changes that."""
    return replace(one, certain=one.certain and one.finding != "gravity_direction")


def _with_limits(
    one: _Found, joints: Sequence[_core.Joint], grids: Sequence[Grid], names: Sequence[str]
) -> _Found:
    """Degrees are certain where the angles as written are beyond the joints' limits, too."""
    if one.finding != "angles_in_deg" or one.rival:
        return one
    beyond = []
    for k, joint in enumerate(joints):
        if joint.type != "revolute" or not math.isfinite(joint.upper - joint.lower):
            continue
        most = max(float(np.abs(grid.q[:, k]).max()) for grid in grids if grid.name in names)
        limit = max(abs(joint.lower), abs(joint.upper))
        beyond.append(most > BEYOND * limit and most * math.pi / 180.0 < 1.1 * limit)
    return replace(one, certain=len(beyond) > 1 and all(beyond))


def _finding(
    group: Sequence[tuple[_Found, Reading, tuple[str, ...]]], names: Sequence[str], recordings: int
) -> RecordingFinding:
    first, reading, _ = group[0]
    joints = tuple(names[j] for j in sorted({j for one, _, _ in group for j in one.joints}))
    where = tuple(dict.fromkeys(name for _, _, some in group for name in some))
    order = reading.order if first.finding == "joint_order" else reading.torque_order
    down = gravity.in_words(np.array(reading.gravity))
    ordered = ", ".join(names[k] for k in _inverse(order))
    signs = [reading.position[k] for k in reading.order]
    counted = conventions.in_words(names, signs, reading.zero)
    said = _READINGS[first.finding].format(listed(joints), ordered, down, counted)
    before, after = (max(getattr(one, key) for one, _, _ in group) for key in ("before", "after"))
    words = "" if len(where) == recordings else f"{listed(where)}: "
    words += (
        f"{said}: rigid torque and friction then leave {100 * after:.0f} % of the variance in place of"
        f" {100 * before:.0f} %"
    )
    if first.rival:
        words += (
            f"; as well if {_READINGS[first.rival].format(listed(joints), '(exchanged)', 'another way', '')}"
        )
    words += "; corrected" if first.certain else f". {_advice(first.finding, names, order)}"
    kind = _KINDS.get(first.finding, first.finding)
    where = () if len(where) == recordings else where
    return RecordingFinding(
        kind, where, joints, words, 100 * before, "% of the variance", first.certain, not first.certain
    )


def _inverse(order: Sequence[int]) -> list[int]:
    """The joint of every column."""
    return [int(k) for k in np.argsort(order)]


def _advice(finding: str, names: Sequence[str], order: Sequence[int]) -> str:
    if finding == "joint_order":
        return f"Run again with --joints {','.join(names[k] for k in _inverse(order))}"
    if finding in _KINDS:
        return "Correct the unit in the names of the columns, and run again"
    if finding == "gravity_direction":
        return "Write it as `gravity` into robot.yaml, or turn the base of the URDF, and run again"
    if finding == "angle_convention":
        return "Correct the columns (or zeros and axes in the model), and run again"
    if finding == "gravity_removed":
        return "Record the whole torque of the drives, and run again"
    return "Correct the columns (or the axis in the model), and run again"
