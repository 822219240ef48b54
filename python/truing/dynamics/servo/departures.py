# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Usual parameters that depart from the file, and what alone would do the same beside the file's values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.candidates import Candidate, candidates_of
from truing.dynamics.servo.fit import Noise, sums
from truing.dynamics.servo.free import USUAL, Free
from truing.dynamics.servo.ground import TORQUES, shared_scale
from truing.dynamics.servo.naming import INEXACT, MEMBER, Account, Namer
from truing.dynamics.servo.simulator import Point

Floats = NDArray[np.float64]

_DEPARTS = 3.0  # standard errors from the file's value
_SAME = 0.05  # of a prior's standard deviation: too little to be called another value
_NATS = 2.0  # below which accounts are as good
_ROUNDS = 4


@dataclass(frozen=True)
class Departure:
    """How far a usual parameter is from the file's, on its scale and beyond what all torques share."""

    free: Free
    change: float
    sigma: float

    @property
    def certain(self) -> bool:
        return self.change > max(_DEPARTS * self.sigma, _SAME * self.free.prior)

    @property
    def probability(self) -> float:
        """That it is another value."""
        return 1.0 - math.erfc(self.change / self.sigma / math.sqrt(2.0))

    @property
    def price(self) -> float:
        """[nats] of a value that is free instead of the file's: Occam's factor (MacKay 1992)."""
        return math.log(self.free.prior / self.sigma) + 0.5 * (self.change / self.free.prior) ** 2


@dataclass(frozen=True)
class Instead:
    """An effect that alone, beside the file's values, does what the usual parameters do at a joint."""

    other: Candidate
    probability: float  # its part, with those that depart taken for one account


def departures(namer: Namer, account: Account) -> list[Departure]:
    """Of every usual parameter, as the usual parameters alone have it; its standard error is that beside all
    that is named."""
    fitted, standard = account.fitted, account.standard
    noise = namer.noise_after(fitted)
    xx, _ = sums(fitted.columns, fitted.errors, noise)
    prior = np.array([f.prior for f in fitted.free])
    sigma = np.sqrt(np.diag(np.linalg.inv(xx + np.diag(prior**-2.0))))
    scales = shared_scale(standard.point, account.nominal)
    out = []
    for k, free in enumerate(fitted.free):
        if free.field not in USUAL:
            continue
        change = free.at(standard.point) - free.at(account.nominal)
        # What all torques have in common is one departure, and the gain's where there is one.
        if not namer.data.torque_command and free.field in TORQUES[1:]:
            change -= scales[free.joint]
        out.append(Departure(free, abs(change), max(float(sigma[k]), 1e-300)))
    return out


def instead(namer: Namer, account: Account, found: Sequence[Departure]) -> dict[int, list[Instead]]:
    """By joint: what may stand in the place of all that departs there. Each candidate that a derivative shows
    is fitted by itself beside the file's values, and weighed with the values that it saves."""
    joints = sorted({d.free.joint for d in found if d.certain})
    if not joints:
        return {}
    fitted, fitter = account.fitted, namer.fitter
    noise = namer.noise_after(fitted)
    here, other = _nats(fitted.errors, noise), fitter.other
    fitter.anchor(account.nominal)
    of_file = _nats(fitter.errors(fitter.motions([account.nominal])[0]), noise)
    fits = [
        one for kind in _kinds(namer, account, joints) for one in _alone(namer, account.nominal, kind, noise)
    ]
    fitter.other = other
    out = {}
    for j in joints:
        slack = max(_NATS, INEXACT * (of_file[j] - here[j]))
        saved = sum(d.price for d in found if d.free.joint == j and d.certain)
        told = [one for one in fits if one[0].joint in (j, -1)]
        behind = [(one, (nats[j] + price - here[j] - saved) / slack) for one, nats, price in told]
        best = min([0.0, *(far for _, far in behind)])
        weights = [(one, math.exp(best - far)) for one, far in behind]
        total = math.exp(best) + sum(weight for _, weight in weights)
        out[j] = [Instead(one, weight / total) for one, weight in weights if weight > MEMBER * math.exp(best)]
    return out


def _nats(errors: Floats, noise: Noise) -> Floats:
    return np.asarray(0.5 * np.sum((errors * noise.weight) ** 2, axis=0))


def _kinds(namer: Namer, account: Account, joints: Sequence[int]) -> list[list[Candidate]]:
    """Candidates that are looked at from their neutral value: one effect at all these joints, or the
    arm's."""
    nominal = account.nominal
    torques = np.zeros((1, namer.joints))  # only limits, which are not looked at from neutral, need them
    every, _ = candidates_of(namer.arm, namer.data, nominal, account.sizes, torques, namer.leave_out)
    kinds: dict[str, list[Candidate]] = {}
    for one in every:
        if one.begin is None and one.joint in (*joints, -1):
            kinds.setdefault(one.label, []).append(one)
    return list(kinds.values())


def _alone(
    namer: Namer, nominal: Point, kind: Sequence[Candidate], noise: Noise
) -> Iterator[tuple[Candidate, Floats, float]]:
    """Each candidate, what it leaves at every joint beside the file's values, and the price of its value, in
    nats."""
    point = nominal
    for one in kind:
        point = one.on(point)
    free = [one.free[0] for one in kind]
    start = np.array([f.at(one.off(nominal)) for f, one in zip(free, kind, strict=True)])
    fit = namer.fitter.fit(point, free, start, noise, _ROUNDS)
    nats = _nats(fit.errors, noise)
    for one, value, mean, (joint, column) in zip(kind, free, start, fit.columns, strict=True):
        weight = noise.weight if joint < 0 else noise.weight[joint]
        sigma = (float(np.sum((column * weight) ** 2)) + value.prior**-2.0) ** -0.5
        yield one, nats, Departure(value, value.at(fit.point) - float(mean), sigma).price
