# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a fleet's torques: what the type's links and drives are, and what each arm departs by.

Of arm a and joint j, with the columns X of what a torque may be a sum of, the nominal torque tau, the
type's parameters delta, and of the arm its motor's gain g and its own friction and offset d (some of X's
columns, F):

    measured = (1 + g) (tau + X delta) + F d + noise

Everything is decided by sums of X, tau and the measured torque: the rows are read once to be fitted, and once
more for the standard errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.fit import refuse_faults
from truing.fleet.nested import Covariance, Layout, Place, covariance, damped_step, reduced
from truing.fleet.source import Source
from truing.fleet.torque_sums import (
    ArmSums,
    Joints,
    JointSum,
    ScoreTask,
    TorqueTask,
    TorqueTotals,
    sum_all_torques,
)
from truing.fleet.workers import Workers

Floats = NDArray[np.float64]

OWN_FRICTION = ("coulomb", "viscous", "current_offset")
GAIN = "motor_constant"
_ITERATIONS = 20
_ENOUGH = 1e-6  # of the noise's variance: a step that promises no more changes nothing that is seen
# Of an arm's own column, that its others do not explain: one of less is not told from them.
_OWN_PART = 0.02
_LIKELY_GAIN = 0.2  # by which a motor's constant may well be off


@dataclass(frozen=True)
class TorqueSettings:
    """What is asked for."""

    cutoff: float  # [Hz]
    test_share: float
    skip_corrupt: bool


@dataclass(frozen=True)
class Own:
    """Parameters that every arm has of its own: `effect.joint`, joint after joint."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    joint: tuple[int, ...]  # number of the joint of each
    column: tuple[int, ...]  # number among the joint's columns; of a gain -1


@dataclass(frozen=True)
class ArmAt:
    """An arm where the fit stands. xx, xr, rr, values, scores: as a Gram has them, of the type's parameters
    and then of its own.
    """

    xx: Floats
    xr: Floats
    rr: float
    values: int
    scores: Floats


@dataclass(frozen=True)
class TorqueFitted:
    """Where the fit ended."""

    robot: _core.Robot
    columns: _core.TorqueColumns
    own: Own
    shared: Floats  # shape=(p,), of the type: change from nominal
    arms: Mapping[str, Floats]  # shape=(q,), of each arm; not seen: 0
    covariance: Covariance
    layout: Layout
    train: Mapping[str, Joints]
    test: Mapping[str, Joints]
    sums: Mapping[str, ArmSums]
    noise: Floats  # shape=(joints,) [Nm | N] rms of a filtered row
    iterations: int
    converged: bool
    notes: tuple[str, ...]
    faults: tuple[str, ...]
    partitions: int
    marked: bool

    def at(self, name: str | None) -> list[Floats]:
        """Where each joint's columns stand: of an arm, or of the type (None)."""
        own = np.zeros(len(self.own.names)) if name is None else self.arms[name]
        return [
            combination(self.columns, self.own, joint, self.shared, own)
            for joint in range(len(self.columns.joints))
        ]


# ---- The model


def own_of(columns: _core.TorqueColumns) -> Own:
    """A motor's gain, friction and an offset at every joint."""
    names, units, joints, numbers = [], [], [], []
    for j, joint in enumerate(columns.joints):
        of_joint = list(columns.of_joint[j])
        names.append(f"{GAIN}.{joint}")
        units.append("-")
        joints.append(j)
        numbers.append(-1)
        for effect in OWN_FRICTION:
            number = columns.names.index(f"{effect}.{joint}")
            names.append(f"{effect}.{joint}")
            units.append(columns.units[number])
            joints.append(j)
            numbers.append(of_joint.index(number))
    return Own(tuple(names), tuple(units), tuple(joints), tuple(numbers))


def combination(columns: _core.TorqueColumns, own: Own, joint: int, shared: Floats, mine: Floats) -> Floats:
    """shape=(p + 1,): what of a joint's columns, and of the nominal torque, is added to the nominal torque:
    (1 + g) (tau + X delta) + F d - tau.
    """
    gain = mine[own.names.index(f"{GAIN}.{columns.joints[joint]}")]
    out = np.append((1.0 + gain) * shared[list(columns.of_joint[joint])], gain)
    for value, where, column in zip(mine, own.joint, own.column, strict=True):
        if where == joint and column >= 0:
            out[column] += value
    return out


def _turn(columns: _core.TorqueColumns, own: Own, joint: int, shared: Floats, mine: Floats) -> Floats:
    """shape=(p + 1, m): how `combination` changes with the type's parameters and then with the arm's own."""
    of_joint = list(columns.of_joint[joint])
    out = np.zeros((len(of_joint) + 1, len(shared) + len(mine)))
    gain = mine[own.names.index(f"{GAIN}.{columns.joints[joint]}")]
    out[np.arange(len(of_joint)), of_joint] = 1.0 + gain
    for k, (where, column) in enumerate(zip(own.joint, own.column, strict=True)):
        if where != joint:
            continue
        if column >= 0:
            out[column, len(shared) + k] = 1.0
        else:
            out[:, len(shared) + k] = np.append(shared[of_joint], 1.0)
    return out


# ---- The fit


class _Search:
    """Where the fit stands. Every look at another point is algebra on the sums."""

    def __init__(self, robot: _core.Robot, columns: _core.TorqueColumns, train: Mapping[str, Joints]) -> None:
        self.robot, self.columns, self.own, self.train = robot, columns, own_of(columns), train
        self.shared = np.zeros(len(columns.names))
        self.arms = {name: np.zeros(len(self.own.names)) for name in train}
        self.noise = np.array([_spread([joints[j] for joints in train.values()]) for j in self._joints])
        self.likely = self._likely_own()
        self.frozen = {name: self._not_seen(joints) for name, joints in train.items()}
        self.iterations = 0

    @property
    def _joints(self) -> range:
        return range(len(self.columns.joints))

    def _likely_own(self) -> Floats:
        """shape=(q,): the size at which an own parameter makes a torque like that which was measured. As a
        prior it says no more than that the arms' departures from the type are zero on the whole.
        """
        out = []
        for j, column in zip(self.own.joint, self.own.column, strict=True):
            rows = sum(joints[j].rows for joints in self.train.values())
            squares = sum(joints[j].xx[column, column] for joints in self.train.values() if joints[j].rows)
            likely = self.noise[j] / math.sqrt(squares / rows) if squares > 0.0 else 1.0
            out.append(_LIKELY_GAIN if column < 0 else likely)
        return np.array(out)

    def _not_seen(self, joints: Joints) -> NDArray[np.bool_]:
        """shape=(q,): own parameters that an arm's rows do not tell from its others of the joint."""
        out = np.ones(len(self.own.names), dtype=np.bool_)
        for j, joint in enumerate(joints):
            mine = [k for k, where in enumerate(self.own.joint) if where == j]
            if joint.rows <= len(mine):
                continue
            columns = [self.own.column[k] for k in mine]
            seen = _core.seen_columns(joint.xx[np.ix_(columns, columns)], [0] * len(mine), _OWN_PART)
            out[[mine[k] for k in seen.kept]] = False
        return out

    def look(self, prior: bool = True) -> dict[str, ArmAt]:
        """The normal equations of every arm. prior: with that of the links' inertias."""
        return {name: self._arm_at(name, prior) for name in self.train}

    def _arm_at(self, name: str, prior: bool) -> ArmAt:
        p, q = len(self.shared), len(self.own.names)
        xx, xr, rr, values = np.zeros((p + q, p + q)), np.zeros(p + q), 0.0, 0
        for j, joint in enumerate(self.train[name]):
            if not joint.rows:
                continue
            weight = self.noise[j] ** -2
            turn = _turn(self.columns, self.own, j, self.shared, self.arms[name])
            at = combination(self.columns, self.own, j, self.shared, self.arms[name])
            xx += weight * turn.T @ joint.xx @ turn
            xr += weight * turn.T @ (joint.xx @ at - joint.xy)
            rr += weight * joint.squares(at)
            values += int(joint.rows)
        precision = np.append(self._precision(prior), self.likely**-2.0)
        here = np.append(self.shared, self.arms[name])
        xx[np.arange(p + q), np.arange(p + q)] += precision
        xr += precision * here
        rr += float(precision @ here**2)
        return ArmAt(xx, xr, rr, values, np.zeros((0, 0)))

    def _precision(self, prior: bool) -> Floats:
        """shape=(p,): of the prior of the links' inertias, in equal parts from every arm; of others next to
        nothing.
        """
        of_links = np.array([name.startswith("link_inertia.") for name in self.columns.names])
        size = np.array(self.columns.prior) * (1.0 if prior else 1e3)
        return np.where(of_links, size**-2.0, 1e-9) / len(self.train)

    def layout(self, shared: Sequence[int]) -> Layout:
        """These of the type's parameters are fitted, and what each arm's rows see of its own."""
        p = len(self.shared)
        places = {
            name: Place(
                p + np.flatnonzero(~frozen), np.array(shared, np.intp), np.arange(len(shared), dtype=np.intp)
            )
            for name, frozen in self.frozen.items()
        }
        return Layout(tuple(self.columns.names[k] for k in shared), places)

    def descend(self, layout: Layout, shared: Sequence[int]) -> bool:
        """Gauss and Newton's steps; the noise of every joint is taken anew in each."""
        p = len(self.shared)
        for _ in range(_ITERATIONS):
            self.noise = self._noise()
            step = damped_step(self.look(), layout, 0.0)
            self.shared[list(shared)] += step.shared
            for name, place in layout.arms.items():
                self.arms[name][place.own - p] += step.own[name]
            self.iterations += 1
            if step.fall <= _ENOUGH:
                return True
        return False

    def _noise(self) -> Floats:
        """shape=(joints,): rms that the fit leaves, the median of the arms."""
        out = []
        for j in self._joints:
            left = [
                joints[j].squares(combination(self.columns, self.own, j, self.shared, self.arms[name]))
                / joints[j].rows
                for name, joints in self.train.items()
                if joints[j].rows
            ]
            out.append(max(math.sqrt(max(0.0, float(np.median(left)))), 1e-9) if left else 1.0)
        return np.array(out)

    def take_bodies(self, layout: Layout) -> None:
        """The type's parameters with inertias that bodies can have."""
        rest = reduced(self.look(prior=False), layout)
        self.shared = np.array(_core.torques_of_bodies(self.robot, rest.xx, rest.xx @ self.shared - rest.xr))

    def score_tasks(self) -> dict[str, ScoreTask]:
        out = {}
        for name, own in self.arms.items():
            at = tuple(combination(self.columns, self.own, j, self.shared, own) for j in self._joints)
            turns = tuple(
                self.noise[j] ** -2 * _turn(self.columns, self.own, j, self.shared, own) for j in self._joints
            )
            out[name] = ScoreTask(at, turns)
        return out


def _spread(joints: Sequence[JointSum]) -> float:
    """rms [Nm | N] of what the nominal model leaves, at first."""
    rows = sum(j.rows for j in joints)
    return max(math.sqrt(sum(j.yy for j in joints) / rows), 1e-9) if rows else 1.0


def fit_torques(
    workers: Workers,
    source: Source,
    robot: _core.Robot,
    settings: TorqueSettings,
    tell: Callable[[str], None] = lambda _: None,
) -> TorqueFitted:
    """Two passes: one for the sums, which say where the fit ends, one for the scores there."""
    columns = _core.torque_columns(robot)
    task = TorqueTask(robot, settings.cutoff, settings.test_share)
    tell("summing every recording")
    total = sum_all_torques(workers, source, task)
    _refuse(total, settings, source)
    marked = any(any(joint.rows for joint in arm.marked) for arm in total.arms.values())
    train, test = _parted(total, marked)
    _refuse_too_few(train, columns)
    tell("fitting")
    search = _Search(robot, columns, train)
    every = range(len(columns.names))
    layout = search.layout(every)
    converged = search.descend(layout, every)
    search.take_bodies(layout)
    others = [k for k, name in enumerate(columns.names) if not name.startswith("link_inertia.")]
    converged &= search.descend(search.layout(others), others)
    tell("standard errors")
    there = sum_all_torques(workers, source, replace(task, scores=search.score_tasks(), marked=marked))
    refuse_faults(there.faults, settings.skip_corrupt, len(source.partitions))
    for name in total.arms:
        if name not in there.arms:
            raise InputError(
                f"arm {name}: its recordings can no longer be read: {' '.join(there.faults[:1])}"
            )
    looked = {name: replace(arm, scores=_scores_of(there.arms[name])) for name, arm in search.look().items()}
    return TorqueFitted(
        robot,
        columns,
        search.own,
        search.shared,
        search.arms,
        covariance(looked, layout),
        layout,
        train,
        test,
        total.arms,
        search.noise,
        search.iterations,
        converged,
        total.notes,
        tuple(dict.fromkeys((*total.faults, *there.faults))),
        len(source.partitions),
        marked,
    )


def _scores_of(arm: ArmSums) -> Floats:
    """What an arm's own unknowns of a joint took up of the noise of its few blocks is missing in their scores
    (as HC1, of clusters: Cameron and Miller 2015, section VI).
    """
    own = 1 + len(OWN_FRICTION)
    return arm.scores * (arm.blocks / max(1, arm.blocks - own))


def _refuse(total: TorqueTotals, settings: TorqueSettings, source: Source) -> None:
    refuse_faults(total.faults, settings.skip_corrupt, len(source.partitions))
    if not total.arms:
        raise InputError("no recordings: expected those of at least one arm")


def _parted(total: TorqueTotals, marked: bool) -> tuple[dict[str, Joints], dict[str, Joints]]:
    """Sums to fit, and sums to judge on, by arm. marked: recordings that are marked are the latter."""
    train, test = {}, {}
    for name, arm in total.arms.items():
        both = tuple(a + b for a, b in zip(arm.fitted, arm.held_out, strict=True))
        train[name] = both if marked else arm.fitted
        test[name] = arm.marked if marked else arm.held_out
    return train, test


def _refuse_too_few(train: Mapping[str, Joints], columns: _core.TorqueColumns) -> None:
    for j, joint in enumerate(columns.joints):
        if not any(joints[j].rows > len(columns.of_joint[j]) for joints in train.values()):
            raise InputError(
                f"joint {joint}: no arm has recordings to fit in which it moves and its torque was measured"
            )
    for name, joints in train.items():
        if not any(joint.rows for joint in joints):
            raise InputError(
                f"arm {name}: has no rows to fit: all its recordings are marked as test, or it does not move"
            )
