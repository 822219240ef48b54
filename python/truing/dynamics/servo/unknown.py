# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What nobody knows: torques as free functions of one input, beside all that is named."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.fit import Column, Fitted, Noise, change_of, sums
from truing.dynamics.servo.free import Free
from truing.dynamics.servo.naming import (
    ONE_RECORDING,
    OTHER_LAWS,
    RESOLUTION,
    THRESHOLD,
    Account,
    Namer,
    Rank,
)
from truing.dynamics.servo.simulator import Function, Point

Floats = NDArray[np.float64]

UNKNOWN = 0.5  # so sure at least must be that there is what nobody knows
INPUTS = ("speed", "load", "angle", "command_error", "time", "directed_load", "directed_angle")
_LEAST = 0.05  # of a joint's squared error on folds that were not fitted
_PLACES = 6  # of a free function
_NARROW = (
    24,
    ("speed", "angle", "command_error", "time", "directed_angle"),
)  # a hum, a detent, a gust are narrow
_SIZE = 0.3  # of a joint's usual torque: a function's prior
_REFITTED = 2  # functions of a joint, without linearisation
_ROUNDS = 4


@dataclass(frozen=True)
class FoundFunction:
    """A torque as a function of an input that nothing of the catalogue explains."""

    joint: int
    input: str
    low: float
    width: float
    values: Floats  # [Nm] at the places
    sigmas: Floats
    probability: float
    share: float
    fitted: Fitted = field(repr=False, compare=False)  # with it, and all that is named


@dataclass(frozen=True)
class Place(Free):
    """A free function's torque at one of its places."""

    number: int = 0

    def value(self, point: Point) -> float:
        return float(point.functions[0][4][self.number])

    def put(self, point: Point, at: float) -> Point:
        joint, name, low, width, values = point.functions[0]
        values = values.copy()
        values[self.number] = at
        return replace(point, functions=((joint, name, low, width, values),))


class Unknown:
    """The search for free functions beside an account."""

    def __init__(self, namer: Namer, account: Account) -> None:
        self.namer, self.account = namer, account
        point = account.fitted.point
        _, torques = namer.fitter.simulator.run([point], namer.fitter.rows.windows, torques=True)
        self.zeros: dict[tuple[str, int], Function] = {
            (name, j): _zero(namer, name, j, torques[0]) for name in INPUTS for j in range(namer.joints)
        }

    def found(self, single: bool, holds: Callable[[Point], bool]) -> list[FoundFunction]:
        """Of every joint the function that wins most, if it stands up as a name must. single: of one
        recording only. holds: whether held-out motion is predicted better at a point."""
        noise, ranks = self._ranked()
        out = []
        for j in range(self.namer.joints):
            best = [key for key, rank in ranks if key[1] == j and rank.score > THRESHOLD][:_REFITTED]
            refits = sorted((self._refit(key, noise) for key in best), key=lambda refit: refit.cost)
            for refit in refits:
                one = self._judged(refit, noise, single)
                if one is not None and holds(refit.point):
                    out.append(one)
                    break
        return sorted(out, key=lambda one: -one.share)

    def idle(self, found: Sequence[FoundFunction]) -> tuple[int, FoundFunction] | None:
        """A name that folds are predicted as well without, beside a function at its joint (or at any, of what
        is of the whole arm), and this function: it stood for what nobody knows."""
        namer, account = self.namer, self.account
        for function in found:
            beside = replace(account, fitted=function.fitted)
            noise = namer.noise_after(account.fitted)
            squares = namer.folds_of(function.fitted, noise)
            for at, one in enumerate(account.found):
                if one.joint in (function.joint, -1) and not namer.weighed(beside, at, noise, squares)[2]:
                    return at, function
        return None

    def _ranked(self) -> tuple[Noise, list[tuple[tuple[str, int], Rank]]]:
        """Linear at the fit, the best first. One place of one input is moved at all joints at once."""
        namer, fitted = self.namer, self.account.fitted
        size = 0.02 * self.account.sizes.torque
        labels = [(name, place) for name in INPUTS for place in range(_places(name))]
        base, *motions = namer.fitter.motions([fitted.point, *self._points(labels, size)])
        columns: list[Column] = []
        groups: dict[tuple[str, int], list[int]] = {}
        for (name, _), motion in zip(labels, motions, strict=True):
            for j in range(namer.joints):
                groups.setdefault((name, j), []).append(len(fitted.columns) + len(columns))
                columns.append((j, change_of(motion, base, float(size[j]), j)))
        sums = namer.sums(fitted, columns)
        costs = [math.log(len(groups))] * len(groups)
        sizes = [_SIZE * self.account.sizes.torque[j] for j, _ in columns]
        prior = np.array([*(f.prior for f in fitted.free), *sizes])
        ranks = namer.ranked(sums, list(groups.values()), costs, prior)[1]
        keys = list(groups)
        return sums.noise, [(keys[r.candidate], r) for r in sorted(ranks, key=lambda r: -r.score)]

    def _points(self, labels: list[tuple[str, int]], size: Floats) -> Iterator[Point]:
        for name, place in labels:
            functions = []
            for j in range(self.namer.joints):
                joint, _, low, width, values = self.zeros[name, j]
                functions.append((joint, name, low, width, size[j] * np.eye(values.size)[place]))
            yield replace(self.account.fitted.point, functions=tuple(functions))

    def _refit(self, key: tuple[str, int], noise: Noise) -> Fitted:
        """The function and what is fitted at its joint, without linearisation: a large one is far from the
        fit that had to make up for it."""
        fitted, (name, j) = self.account.fitted, key
        size = _SIZE * float(self.account.sizes.torque[j])
        zero = self.zeros[key]
        places = [
            Place(f"{name} {k}", j, "linear", size, -np.inf, np.inf, "Nm", number=k)
            for k in range(zero[4].size)
        ]
        mine = [k for k, f in enumerate(fitted.free) if f.joint == j]
        free = [*(fitted.free[k] for k in mine), *places]
        start = np.array([*fitted.start[mine], *np.zeros(len(places))])
        point = replace(fitted.point, functions=(zero,))
        with self.namer.fitter.beside(fitted):
            some = self.namer.fitter.fit(point, free, start, noise, _ROUNDS, f"free function of {name}")
        others = [k for k in range(len(fitted.free)) if k not in mine]
        return replace(
            some,
            free=[*(fitted.free[k] for k in others), *free],
            start=np.array([*fitted.start[others], *start]),
            columns=[*(fitted.columns[k] for k in others), *some.columns],
        )

    def _judged(self, refit: Fitted, noise: Noise, single: bool) -> FoundFunction | None:
        """What was found, if folds that were not fitted are predicted better, and it moves the joint by more
        than a step of its encoder."""
        namer, fitted = self.namer, self.account.fitted
        joint, name, low, width, values = refit.point.functions[0]
        nats = namer.fitter.cost(fitted.errors, fitted.point, fitted.free, fitted.start, noise)
        nats -= namer.fitter.cost(refit.errors, refit.point, refit.free, refit.start, noise)
        before, after = namer.folds_of(fitted, noise), namer.folds_of(refit, noise)
        if nats < THRESHOLD or not namer.predicts(before, after, _LEAST, nats):
            return None
        gain = float((before - after).sum() / before.sum())
        part = max(0.0, gain) * namer.joints
        probability = part**2 / (part**2 + OTHER_LAWS**2)
        moves = (refit.errors - fitted.errors)[:, joint]
        if probability < UNKNOWN or float(np.std(moves)) < namer.resolution[joint] / RESOLUTION:
            return None
        shown = min(probability, ONE_RECORDING) if single else probability
        return FoundFunction(joint, name, low, width, values, _sigmas(refit, noise), shown, gain, refit)


def _sigmas(refit: Fitted, noise: Noise) -> Floats:
    """Standard errors of the places."""
    prior = np.array([f.prior for f in refit.free])
    xx, _ = sums(refit.columns, refit.errors, noise)
    sigma = np.sqrt(np.diag(np.linalg.inv(xx + np.diag(prior**-2.0))))
    return np.asarray(sigma[[k for k, f in enumerate(refit.free) if isinstance(f, Place)]])


def _zero(namer: Namer, name: str, j: int, torque: Floats) -> Function:
    """A function that is nothing, over what its input went through. torque: shape=(n, joints)"""
    rows = namer.fitter.rows
    streams = namer.data.streams
    if name == "time":
        low, high = 0.0, max(s.time[-1] - s.time[0] for s in streams)
    elif name in ("speed", "command_error"):
        values = np.concatenate(
            [s.speed[:, j] if name == "speed" else s.command[:, j] - s.position[:, j] for s in streams]
        )
        low, high = np.quantile(values, [0.01, 0.99])
    elif name == "directed_load":
        low, high = 0.0, float(np.quantile(np.abs(torque[:, j]), 0.99))
    else:
        values = torque[:, j] if name == "load" else rows.measured[:, j]
        low, high = np.quantile(values, [0.01, 0.99])
    places = _places(name)
    return j, name, float(low), max(float(high - low), 1e-6) / (places - 1), np.zeros(places)


def _places(name: str) -> int:
    return _NARROW[0] if name in _NARROW[1] else _PLACES
