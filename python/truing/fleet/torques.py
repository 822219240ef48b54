# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The dynamics of a fleet: the type's links and friction, what each arm has of its own, and which arms stand
out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.found import FleetParameter
from truing.fleet.source import first_notes, recordings_of
from truing.fleet.standing_out import LEAST, centre_of, left_of, standing_out
from truing.fleet.torque_fit import GAIN, TorqueFitted, TorqueSettings, combination, fit_torques
from truing.fleet.torque_sums import Joints, JointSum
from truing.fleet.workers import workers_of

Floats = NDArray[np.float64]

_CHANCE = 0.01  # that an arm of a fleet without a fault is named
_GAIN_ON_UNSEEN = 0.01  # of a joint's squared held-out error, that an arm's own value must take away
_GAINS = (-0.5, 1.0)  # that a motor may have, as the catalogue has it
_MUCH_MORE = 1.5  # times the median arm's error, from which on an arm has something that nothing explains


@dataclass(frozen=True)
class TorqueErrorOf:
    """Held-out errors of a joint's torque [%] of the measured torque's standard deviation, and of `own` the
    rms [Nm | N]: of the nominal model, of what all arms share, and of that with each arm's own. NaN: not
    measured.
    """

    joint: str
    nominal: float
    shared: float
    own: float
    rms: float
    rows: int


@dataclass(frozen=True)
class StandsOut:
    """An arm's own parameter that the others do not have so. value, sigma: of this arm, as a departure from
    the type. others, scatter: mean of the other arms', and their standard deviation beyond their errors.
    probability: that any arm of a fleet without a fault was as far off. torque: [Nm | N] rms that it makes.
    removed: fraction of the joint's squared held-out error that it takes away.
    """

    arm: str
    parameter: str
    joint: str
    unit: str
    value: float
    sigma: float
    others: float
    scatter: float
    probability: float
    torque: float
    removed: float


@dataclass(frozen=True)
class ArmTorques:
    """One arm: its robot (the type's links and friction with its own), its own parameters as departures from
    the type, and its errors.
    """

    name: str
    robot: _core.Robot
    parameters: tuple[FleetParameter, ...]
    errors: tuple[TorqueErrorOf, ...]
    recordings: int
    rows: int

    def parameter(self, name: str) -> FleetParameter:
        """By full name, e.g. coulomb.J2 or motor_constant.J3. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]


@dataclass(frozen=True)
class FleetDynamics:
    """What `truing.fleet.dynamics` found."""

    sentence: str
    robot: _core.Robot  # the type
    parameters: tuple[FleetParameter, ...]  # of the type: changes from nominal
    arms: Mapping[str, ArmTorques]
    errors: tuple[TorqueErrorOf, ...]  # of all arms together
    stands_out: tuple[StandsOut, ...]  # arms and parameters, the surest first
    unexplained: tuple[str, ...]  # arms with errors well above the others', which nothing fitted explains
    covariance: Floats  # shape=(p, p), of the type's parameters
    held_out: str  # what errors are of
    cutoff: float  # [Hz] of the low-pass
    rows: int
    partitions: int
    skipped: tuple[str, ...]  # partitions that were passed over
    passes: int
    iterations: int
    converged: bool
    warnings: tuple[str, ...]

    def parameter(self, name: str) -> FleetParameter:
        """Of the type, by full name. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]


def dynamics(
    robot: _core.Robot,
    source: Any,
    client: Any = None,
    *,
    one_arm: bool = False,
    cutoff: float | None = None,
    test_share: float = 0.2,
    skip_corrupt: bool = False,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> FleetDynamics:
    """Find the links and the friction of a type from recordings of torques of many arms, what each arm has of
    its own, and the arms that stand out.

        found = truing.fleet.dynamics(robot, "recordings/")
        found.robot, found.arms["a017"].robot, found.stands_out

    All arms share the links' inertial parameters, armature, Coulomb and viscous friction and an offset. Each
    has, at every joint, friction and an offset that depart from these, and a gain of its motor.

    robot: nominal, of all arms, with masses and inertias. source: files, or a folder of Parquet or CSV
    files, with the columns of recordings of motion and torque. A file is of the arm that its folder
    `arm=NAME/` names, or of its own name; one_arm: all are of one. client: of Dask; None: a cluster on this
    machine, for this call, of so many `workers` (None: one a processor; 0: this process alone). cutoff:
    [Hz] of the low-pass without phase that both sides of the equation of motion go through; None: as in
    TorqueSumOptions. test_share: fraction of the time that is held out, where no recording is marked as
    test. skip_corrupt: partitions that cannot be read are passed over and named in `skipped`. tell: is told
    what begins.

    The same bits on one worker or many. Raises InputError on data or options that cannot be used; it names
    the partition.
    """
    cutoff = _core.TorqueSumOptions().cutoff if cutoff is None else cutoff
    if not (math.isfinite(cutoff) and cutoff > 0.0):
        raise InputError(f"cutoff: found {cutoff}, expected more than 0 Hz")
    if not 0.0 < test_share < 1.0:
        raise InputError(f"test_share: found {test_share}, expected a fraction above 0 and below 1")
    settings = TorqueSettings(cutoff, test_share, skip_corrupt)
    partitions = recordings_of(source, one_arm=one_arm)
    _core.torque_columns(robot)  # a robot that cannot be used is refused before workers start
    with workers_of(client, workers) as at_work:
        fitted = fit_torques(at_work, partitions, robot, settings, tell)
        return _found(fitted, settings, at_work.passes)


# ---- What was found


def _found(ended: TorqueFitted, settings: TorqueSettings, passes: int) -> FleetDynamics:
    fitted = _centred(ended)
    joints = fitted.columns.joints
    arms = {name: _arm(fitted, name) for name in fitted.arms}
    errors = tuple(
        _error(
            joint, _together(fitted.test, j), {name: fitted.at(name)[j] for name in arms}, fitted.at(None)[j]
        )
        for j, joint in enumerate(joints)
    )
    stands_out = _standing_out(fitted)
    unexplained = _unexplained(fitted)
    warnings = list(first_notes(fitted.notes, "recordings"))
    if not any(error.rows for error in errors):
        warnings.append("nothing is held out: recordings are too short, or all times are at rest")
    warnings += _gains_of_no_motor(fitted)
    if len(arms) < LEAST:
        warnings.append(f"{len(arms)} arms: {LEAST} or more say how arms scatter, and which stand out")
    sigma = np.sqrt(np.maximum(np.diag(fitted.covariance.shared), 0.0))
    return FleetDynamics(
        _sentence(len(arms), stands_out, unexplained),
        _core.robot_with_torques(fitted.robot, fitted.shared),
        tuple(
            FleetParameter(name, unit, 0.0, float(value), float(s))
            for name, unit, value, s in zip(
                fitted.columns.names, fitted.columns.units, fitted.shared, sigma, strict=True
            )
        ),
        arms,
        errors,
        stands_out,
        unexplained,
        fitted.covariance.shared,
        "recordings marked as test" if fitted.marked else f"{100 * settings.test_share:.3g} % of the time",
        settings.cutoff,
        sum(arm.rows for arm in arms.values()),
        fitted.partitions,
        fitted.faults,
        passes,
        fitted.iterations,
        fitted.converged,
        tuple(warnings),
    )


def _arm(fitted: TorqueFitted, name: str) -> ArmTorques:
    own, values, sums = fitted.own, fitted.arms[name], fitted.sums[name]
    sigma = _own_sigma(fitted, name)
    gains = {n: v for n, v in zip(own.names, values, strict=True) if n.startswith(f"{GAIN}.") and v}
    mine = fitted.shared.copy()
    for k, parameter in enumerate(own.names):
        if parameter in fitted.columns.names:  # friction behind the gain, which the motor's constant scales
            gain = values[own.names.index(f"{GAIN}.{fitted.columns.joints[own.joint[k]]}")]
            mine[fitted.columns.names.index(parameter)] += values[k] / (1.0 + gain)
    robot = _core.robot_with_torques(fitted.robot, mine)
    robot.torque_effects = [
        *robot.torque_effects,
        *(_core.AppliedEffect(GAIN, [n.partition(".")[2]], {n: float(v)}) for n, v in gains.items()),
    ]
    at, shared = fitted.at(name), fitted.at(None)
    return ArmTorques(
        name,
        robot,
        tuple(
            FleetParameter(n, unit, 0.0, float(v), float(s))
            for n, unit, v, s in zip(own.names, own.units, values, sigma, strict=True)
        ),
        tuple(
            _error(joint, {name: fitted.test[name][j]}, {name: at[j]}, shared[j])
            for j, joint in enumerate(fitted.columns.joints)
        ),
        sums.recordings,
        int(
            max(
                (
                    a.rows + b.rows + c.rows
                    for a, b, c in zip(sums.fitted, sums.held_out, sums.marked, strict=True)
                )
            )
        ),
    )


def _gains_of_no_motor(fitted: TorqueFitted) -> list[str]:
    """What to say where masses and gains share a scale that no motor has: of which arm it comes."""
    gains = np.array([_gains(fitted, name) for name in fitted.arms])
    if gains.min() >= _GAINS[0] and gains.max() <= _GAINS[1]:
        return []
    apart = np.abs(gains - np.median(gains, axis=0)).max(axis=1)
    arm = list(fitted.arms)[int(np.argmax(apart))]
    return [
        f"motor gains from {gains.min():+.2g} to {gains.max():+.2g}, which motors do not have: an arm with a"
        f" payload that is not stated, or in other units, leads the masses of all away; look at {arm}, state"
        " its payload_kg, or leave it out"
    ]


def _own_sigma(fitted: TorqueFitted, name: str) -> Floats:
    """shape=(q,): standard errors; NaN: held at the type's."""
    out = np.full(len(fitted.own.names), math.nan)
    place = fitted.layout.arms[name]
    variance = np.diag(fitted.covariance.own[name])
    out[place.own - len(fitted.shared)] = np.sqrt(np.maximum(variance, 0.0))
    return out


def _together(test: Mapping[str, Joints], j: int) -> dict[str, JointSum]:
    return {name: joints[j] for name, joints in test.items()}


def _error(
    joint: str, sums: Mapping[str, JointSum], own: Mapping[str, Floats], shared: Floats
) -> TorqueErrorOf:
    """Of one arm's held-out rows, or of several arms'. The standard deviation is that of the measured torque
    about each arm's mean.
    """
    rows = sum(s.rows for s in sums.values())
    variance = sum(_variation(s) for s in sums.values())
    if rows < 2 or not variance > 0.0:
        return TorqueErrorOf(joint, math.nan, math.nan, math.nan, math.nan, 0)
    nominal = sum(s.yy for s in sums.values())
    type_of = sum(s.squares(shared) for s in sums.values())
    each = sum(s.squares(own[name]) for name, s in sums.items())
    as_nominal, as_type, as_own = (
        100.0 * math.sqrt(max(0.0, squares) / variance) for squares in (nominal, type_of, each)
    )
    return TorqueErrorOf(joint, as_nominal, as_type, as_own, math.sqrt(max(0.0, each) / rows), int(rows))


def _variation(joint: JointSum) -> float:
    """Sum of squares of the measured torque about its mean: of y and the nominal torque together."""
    if joint.rows < 2:
        return 0.0
    measured = joint.yy + 2.0 * joint.xy[-1] + joint.xx[-1, -1]
    offset = _ones(joint)
    mean = (joint.xy[offset] + joint.xx[offset, -1]) / joint.rows
    return float(max(0.0, measured - joint.rows * mean**2))


def _ones(joint: JointSum) -> int:
    """The column of the offset, which is one in every row."""
    return int(np.argmin(np.abs(np.diag(joint.xx)[:-1] - joint.rows)))


# ---- Arms that stand out


def _centred(fitted: TorqueFitted) -> TorqueFitted:
    """The same torques, with friction and offsets of the type that are the mean of the arms which do not
    stand out: what one arm has more is no part of the type's.
    """
    names = list(fitted.arms)
    sigma = np.array([_own_sigma(fitted, name) for name in names])
    values = np.array([fitted.arms[name] for name in names])
    shared, gains = fitted.shared.copy(), {name: _gains(fitted, name) for name in names}
    for k, parameter in enumerate(fitted.own.names):
        left = left_of(values[:, k], sigma[:, k], standing_out(values[:, k], sigma[:, k], _level(sigma)))
        if parameter not in fitted.columns.names or not left:
            continue
        centre = centre_of(values[left, k], sigma[left, k])[0]
        shared[fitted.columns.names.index(parameter)] += centre
        for a, name in enumerate(names):  # (1 + g) (delta + c) + d - (1 + g) c
            values[a, k] -= (1.0 + gains[name][fitted.own.joint[k]]) * centre
    return replace(fitted, shared=shared, arms=dict(zip(names, values, strict=True)))


def _gains(fitted: TorqueFitted, name: str) -> Floats:
    """shape=(joints,)"""
    at = [fitted.own.names.index(f"{GAIN}.{joint}") for joint in fitted.columns.joints]
    return fitted.arms[name][at]


def _level(sigma: Floats) -> float:
    """Of one parameter, so that `_CHANCE` is that of the whole fleet. sigma: shape=(arms, parameters)"""
    return _CHANCE / max(1, int(np.isfinite(sigma).any(axis=0).sum()))


def _standing_out(fitted: TorqueFitted) -> tuple[StandsOut, ...]:
    names = list(fitted.arms)
    sigma = np.array([_own_sigma(fitted, name) for name in names])
    values = np.array([fitted.arms[name] for name in names])
    level = _level(sigma)
    found = []
    for k, parameter in enumerate(fitted.own.names):
        for outlier in standing_out(values[:, k], sigma[:, k], level):
            arm = names[outlier.index]
            removed = _removed(fitted, arm, k, outlier.centre)
            if removed < _GAIN_ON_UNSEEN:
                continue
            found.append(
                StandsOut(
                    arm,
                    parameter,
                    fitted.columns.joints[fitted.own.joint[k]],
                    fitted.own.units[k],
                    float(values[outlier.index, k]),
                    float(sigma[outlier.index, k]),
                    outlier.centre,
                    outlier.scatter,
                    min(1.0, outlier.probability / level * _CHANCE),
                    _torque(fitted, arm, k, float(values[outlier.index, k]) - outlier.centre),
                    removed,
                )
            )
    return tuple(sorted(found, key=lambda s: -s.removed))


def _removed(fitted: TorqueFitted, arm: str, k: int, centre: float) -> float:
    """Fraction of the joint's squared held-out error that the arm's own value takes away: against the others'
    mean, and the arm's other own parameters of the joint fitted beside it.
    """
    j = fitted.own.joint[k]
    train, test = fitted.train[arm][j], fitted.test[arm][j]
    if not test.rows:
        return 0.0
    sigma = _own_sigma(fitted, arm)
    beside = [
        i for i, where in enumerate(fitted.own.joint) if where == j and i != k and np.isfinite(sigma[i])
    ]
    without = fitted.arms[arm].copy()
    without[k] = centre
    columns = (
        np.column_stack([_column(fitted, i, j) for i in beside]) if beside else np.zeros((len(train.xy), 0))
    )
    at = combination(fitted.columns, fitted.own, j, fitted.shared, without)
    slope = columns.T @ (train.xy - train.xx @ at)
    at = at + columns @ np.linalg.lstsq(columns.T @ train.xx @ columns, slope, rcond=None)[0]
    left = test.squares(at)
    return 1.0 - test.squares(fitted.at(arm)[j]) / left if left > 0.0 else 0.0


def _column(fitted: TorqueFitted, k: int, j: int) -> Floats:
    """An own parameter's column among those of its joint, the nominal torque behind them."""
    of_joint = list(fitted.columns.of_joint[j])
    if fitted.own.column[k] < 0:
        return np.append(fitted.shared[of_joint], 1.0)
    out = np.zeros(len(of_joint) + 1)
    out[fitted.own.column[k]] = 1.0
    return out


def _torque(fitted: TorqueFitted, arm: str, k: int, size: float) -> float:
    joint = fitted.train[arm][fitted.own.joint[k]]
    column = _column(fitted, k, fitted.own.joint[k])
    return abs(size) * math.sqrt(max(0.0, float(column @ joint.xx @ column)) / joint.rows)


def _unexplained(fitted: TorqueFitted) -> tuple[str, ...]:
    """Arms that keep an error half as large again as the median arm's at some joint, in itself and beside the
    torque that its motion took.
    """
    names = list(fitted.arms)
    out = np.zeros(len(names), dtype=np.bool_)
    for j in range(len(fitted.columns.joints) if len(names) >= LEAST else 0):
        left = np.array(
            [_rms(fitted.test[name][j].squares(fitted.at(name)[j]), fitted.test[name][j]) for name in names]
        )
        took = np.array([_rms(_variation(fitted.train[name][j]), fitted.train[name][j]) for name in names])
        out |= _high(left) & _high(left / took)
    return tuple(name for name, more in zip(names, out, strict=True) if more)


def _rms(squares: float, joint: JointSum) -> float:
    return math.sqrt(max(0.0, squares) / joint.rows) if joint.rows else math.nan


def _high(values: Floats) -> NDArray[np.bool_]:
    known = values[np.isfinite(values)]
    return (
        np.asarray(values > _MUCH_MORE * np.median(known)) if known.size else np.zeros(len(values), np.bool_)
    )


def _sentence(arms: int, stands_out: tuple[StandsOut, ...], unexplained: tuple[str, ...]) -> str:
    words = {GAIN: "motor gain", "coulomb": "dry friction", "viscous": "viscous friction"}
    by_arm: dict[str, list[str]] = {}
    for s in stands_out:
        effect = s.parameter.partition(".")[0]
        by_arm.setdefault(s.arm, []).append(f"{words.get(effect, 'offset')} of {s.joint}")
    if not by_arm:
        text = f"None of {arms} arms stands out." if arms >= LEAST else f"{arms} arms, too few to compare."
    else:
        each = "; ".join(f"{name} by {' and '.join(what)}" for name, what in sorted(by_arm.items()))
        text = f"{len(by_arm)} of {arms} arms stand{'s' if len(by_arm) == 1 else ''} out: {each}."
    more = [name for name in unexplained if name not in by_arm]
    return text + (f" Errors beyond the others', unexplained: {', '.join(more)}." if more else "")
