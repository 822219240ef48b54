# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands that arrive late at all joints alike, as servos on one bus have them.

In slow motion damping, friction and rotor take a late command's part. Joint by joint some then say a delay
and others something else beside it; together they say one number. It is asked before anything else is sought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.candidates import BUS, Candidate
from truing.dynamics.servo.fit import Fitted, sums
from truing.dynamics.servo.free import Free, Sizes, free_value
from truing.dynamics.servo.ground import groundwork
from truing.dynamics.servo.naming import Account, Namer
from truing.dynamics.servo.simulator import FIELDS, Point

Floats = NDArray[np.float64]

_DOING = "commands that are late at all joints"
_DELAYS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1)  # [s] that are looked at
_NEARER = (1.4, 1.2, 1.1)  # times the best, on both sides, that are looked at then
_SPREAD = 0.2  # of the common delay: standard deviation of a joint's own
_LEAST = 0.03  # of what is moved, and of the usual torque: rotor and dry friction that a fit begins from
_ROUNDS = 4
_TURNS, _SETTLED = 4, 0.03  # of a fit and its common delay; part of it that may still change
_LOST = 2.0  # times the best squared error (geometric mean of the joints): longer delays are not looked at
_SPEAK = 4.0  # nats for or against
_PART = 0.1  # of a joint's squared error, that one which speaks for it loses
_SAME = 0.5  # of the common delay, that a joint's own is at least
_LEAST_FOR = 2  # joints


def late_alike(namer: Namer, fitted: Fitted, sizes: Sizes, nominal: Point) -> tuple[Candidate, Fitted] | None:
    """The delay that joints have in common, and the fit with it. None: there is none.

    fitted: the usual parameters alone. Delays are tried at all joints at once, the usual parameters following
    (a profile of the likelihood); about the best one each joint's own is fitted. Of the joints that speak two
    or more must speak for it, and more than against it; these keep none.
    """
    if namer.joints < _LEAST_FOR or "delay" in namer.leave_out:
        return None
    namer.fitter.progress(_DOING)
    other = namer.fitter.other
    found = _alike(namer, Account(fitted, fitted, [], sizes, nominal))
    if found is None:
        namer.fitter.other = other
    return found


def _alike(namer: Namer, account: Account) -> tuple[Candidate, Fitted] | None:
    best = _best_of_all(namer, account.fitted, account.sizes)
    if best is None:
        return None
    every = list(range(namer.joints))
    tried = _with(namer, account, best, every)
    speak_for, against = _said(namer, account.fitted, tried, every)
    if against:
        every = [j for j in every if j not in against]
        if len(every) < _LEAST_FOR:
            return None
        tried = _with(namer, account, best, every)
        speak_for, more = _said(namer, account.fitted, tried, every)
        if more:
            return None
    if len(speak_for) < max(_LEAST_FOR, len(against) + 1):
        return None
    tried = _laid_anew(namer, account, tried, every)
    names = namer.arm.nominal.joints
    where = () if len(every) == namer.joints else tuple(names[j] for j in every)
    return Candidate("delay", -1, where, tuple(_delays(tried)), label=BUS), tried


def _best_of_all(namer: Namer, fitted: Fitted, sizes: Sizes) -> Point | None:
    """The usual parameters and the delay of all joints that move best together (geometric mean of the joints'
    squared errors). None: that without."""
    none = log_squares(fitted.errors, namer.resolution)
    best, least, point = fitted.point, none, fitted.point

    def tried(point: Point, delay: float) -> tuple[Point, float]:
        point = _lifted(point.with_value(slice(None), "delay", delay), sizes)
        fit = namer.fitter.fit(point, fitted.free, fitted.start, None, _ROUNDS, shown=False)
        return fit.point, log_squares(fit.errors, namer.resolution)

    for delay in _DELAYS:
        point, squares = tried(point, delay)
        if squares < least:
            best, least = point, squares
        elif squares > least + np.log(_LOST):
            break
    if not least < none:
        return None
    for times in (part for factor in _NEARER for part in (factor, 1.0 / factor)):
        point, squares = tried(best, times * best.value(0, "delay"))
        if squares < least:
            best, least = point, squares
    return best


def _lifted(point: Point, sizes: Sizes) -> Point:
    """With rotors and dry friction that are seen: what has gone to nothing, as a late command's inertia is
    less than none, does not come back by derivatives of its logarithm."""
    chain = point.chain.copy()
    for name, least in (("armature", sizes.inertia), ("coulomb", sizes.torque)):
        at = FIELDS.index(name)
        chain[:, at] = np.maximum(chain[:, at], _LEAST * least)
    return replace(point, chain=chain)


def log_squares(errors: Floats, resolution: Floats) -> float:
    """Mean over the joints of the logarithm of their mean squared error."""
    return float(np.mean(np.log(np.maximum(np.mean(errors**2, axis=0), resolution**2))))


def _with(namer: Namer, account: Account, best: Point, joints: Sequence[int]) -> Fitted:
    """The usual parameters and these joints' delays, alike: about what all of them say together, which moves
    as they are fitted."""
    usual, common = account.fitted, best.value(joints[0], "delay")
    others = [j for j in range(namer.joints) if j not in joints]
    chain = best.chain.copy()
    chain[others] = usual.point.chain[others]
    point = replace(best, chain=chain)
    for _ in range(_TURNS):
        delays = [replace(free_value("delay", j, account.sizes), prior=_SPREAD * common) for j in joints]
        start = np.array([*usual.start, *(common for _ in delays)])
        tried = namer.fitter.settled(point, [*usual.free, *delays], start, None, 2 * _ROUNDS, _DOING)
        before, common, point = common, _together(namer, tried), tried.point
        if abs(common - before) < _SETTLED * before:
            break
    return tried


def _laid_anew(namer: Namer, account: Account, tried: Fitted, joints: Sequence[int]) -> Fitted:
    """The groundwork once more under these delays, where it ends better so: what was fitted without them may
    have led light joints, whose torques' scale is hardly seen, far away."""
    delays = np.array([f.at(tried.point) for f in _delays(tried)])
    late = account.nominal.chain.copy()
    late[list(joints), FIELDS.index("delay")] = delays
    laid = groundwork(namer.fitter, replace(account.nominal, chain=late), namer.data)[0]
    other = _with(namer, replace(account, fitted=laid), laid.point, joints)
    squares = [log_squares(one.errors, namer.resolution) for one in (tried, other)]
    return other if squares[1] < squares[0] else tried


def _delays(tried: Fitted) -> list[Free]:
    return [f for f in tried.free if f.field == "delay"]


def _together(namer: Namer, tried: Fitted) -> float:
    """[s] the mean of the joints' delays, each by what its motion says (prior apart)."""
    noise = namer.noise_after(tried)
    xx, _ = sums(tried.columns, tried.errors, noise)
    sigma = np.sqrt(np.diag(np.linalg.inv(xx + np.diag([f.prior**-2.0 for f in tried.free]))))
    own = [k for k, f in enumerate(tried.free) if f.field == "delay"]
    said = np.maximum(sigma[own] ** -2.0 - np.array([tried.free[k].prior ** -2.0 for k in own]), 0.0)
    values = np.array([tried.free[k].at(tried.point) for k in own])
    return float(np.average(values, weights=said + 1e-12))


def _said(namer: Namer, before: Fitted, after: Fitted, joints: Sequence[int]) -> tuple[list[int], list[int]]:
    """Joints that speak for the delay, and against it: which it costs nats, or whose own is another."""
    noise = namer.noise_after(after)
    costs = [
        namer.fitter.joint_costs(one.errors, one.point, one.free, one.start, noise) for one in (before, after)
    ]
    squares = [np.mean(one.errors**2, axis=0) for one in (before, after)]
    won, left = costs[0] - costs[1], squares[1] / np.maximum(squares[0], 1e-300)
    same = after.point.chain[:, FIELDS.index("delay")] > _SAME * _together(namer, after)
    speak_for = [j for j in joints if same[j] and won[j] > _SPEAK and left[j] < 1.0 - _PART]
    return speak_for, [j for j in joints if not same[j] or won[j] < -_SPEAK]
