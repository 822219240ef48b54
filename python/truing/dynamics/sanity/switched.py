# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What comes and goes while a robot is recorded: loads that it picks up, a push at its tool.

Links that all rows have in common, and friction and offsets of each recording, leave a torque that comes and
goes. It may be that of one load (or force), which is there or not, or of one of several: a hidden Markov
model of few states. Values of the loads and the links are found by least squares, then the states by
Viterbi's recursion (1967), in which a change costs; and so on in turns until no state changes.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity.grids import Grid

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]

STEP = 0.05  # [s] between the rows that are looked at, at least
ROWS = 2000  # of all recordings together, at most
FEWEST = 40  # rows of a recording
STRETCH = 1.0  # [s] that is asked alone for how much of it there is, to begin with
TURNS = 15  # of values and states
PROMISING = 0.9  # of the squares left without it: what the first guess must get below
CORRELATED = 0.5  # [s] over which what is left may be alike, at most: it is more while states are wrong
CHANGE = 20.0  # [nats] that must be gained where it comes or goes
ANOTHER = 0.8  # of the squares left with fewer of them: what one more must get below
RIDGE = 1e-6  # of the mean square column: what motion does not show stays the file's
_TINY = 1e-300


Columns = Callable[[Floats, Floats, Floats], Floats]
"""Of angles, speeds and accelerations, shape=(n, joints) each: torques by the values of what comes and goes,
shape=(n, joints, values)."""


@dataclass(frozen=True)
class Switched:
    """What comes and goes, and when it is there."""

    values: Floats
    sigma: float  # standard error of the first of them
    states: dict[str, tuple[Floats, Bools]]  # by recording: instants [s], and whether it is there

    @property
    def recordings(self) -> tuple[str, ...]:
        """Those in which it is there for some time."""
        return tuple(name for name, (_, there) in self.states.items() if there.any())

    @property
    def spans(self) -> tuple[tuple[str, float, float], ...]:
        """Recording, begin and end [s] of the times when it is there."""
        out = []
        for name, (instants, there) in self.states.items():
            bounds = np.concatenate([instants[:1], 0.5 * (instants[1:] + instants[:-1]), instants[-1:]])
            changes = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]])))
            out += [
                (name, round(float(bounds[a]), 3), round(float(bounds[b]), 3))
                for a, b in changes.reshape(-1, 2)
            ]
        return tuple(out)

    @property
    def share(self) -> float:
        """Of the time."""
        return float(np.mean(np.concatenate([there for _, there in self.states.values()])))

    def there(self, recording: str, time: Floats) -> Bools:
        """Whether it is there at these times [s], shape=(n,): as at the nearest instant; never in a recording
        that was too short to be asked.
        """
        if recording not in self.states:
            return np.zeros(len(time), dtype=np.bool_)
        instants, there = self.states[recording]
        return there[np.searchsorted(0.5 * (instants[1:] + instants[:-1]), time)]


@dataclass(frozen=True)
class AtTimes:
    """What comes and goes: one of these, or none of them."""

    each: tuple[Switched, ...]
    changes: int  # how often one comes or goes
    part: float  # of the squares left without them: what is left with them
    left: float  # the same as the geometric mean of the joints' parts


@dataclass(frozen=True)
class _Rows:
    """Of one recording; what friction, rotors and offsets take up is left out of links and torque."""

    name: str
    time: Floats  # shape=(n,) [s]
    motion: tuple[Floats, Floats, Floats]  # shape=(n, joints) each: angles, speeds, accelerations
    there: Bools  # shape=(joints, n) a torque was measured
    links: Floats  # shape=(joints, n, 10 links) torques by the parameters of the links
    torque: Floats  # shape=(joints, n) [Nm | N] less that of the file's links; 0: not measured
    usual: Floats  # shape=(joints, n, 4) orthonormal columns of friction, rotor and offset

    def without_usual(self, columns: Floats) -> Floats:
        """shape=(joints, n, k)"""
        return np.asarray(columns - self.usual @ (self.usual.transpose(0, 2, 1) @ columns))


@dataclass(frozen=True)
class Thinned:
    """Rows of recordings that are asked what comes and goes."""

    rows: list[_Rows]
    step: float  # [s] between them
    gram: Floats  # shape=(joints, 10 links, 10 links) of the links' columns
    right: Floats  # shape=(joints, 10 links) these times the torques


def thinned(robot: _core.Robot, grids: Sequence[Grid]) -> Thinned | None:
    """None: they are too short, or no torque was measured."""
    step = max(STEP, sum(len(grid.rows) * grid.step for grid in grids) / ROWS)
    rows = [one for grid in grids if len((one := _rows(robot, grid, step)).time) >= FEWEST]
    if not any(one.torque.any() for one in rows):
        return None
    gram = sum(one.links.transpose(0, 2, 1) @ one.links for one in rows)
    right = sum((one.torque[:, None, :] @ one.links)[:, 0] for one in rows)
    return Thinned(rows, step, np.asarray(gram), np.asarray(right))


def switched(
    of: Thinned, columns: Columns, first: Sequence[Floats], is_mass: bool, most: int = 1
) -> AtTimes | None:
    """What has these columns and explains most by coming and going; None: there is no such.

    first: values to begin with, of any size, beside those that stretches of time have in common. is_mass:
    the first value is above zero; the links may take up what is always there, so that it is there where more
    of it is. most: different ones, one at a time.
    """
    arm = _Arm.made(of, columns, is_mass)
    tried = [_in_turns(arm, arm.apart(values, 2)) for values in (*first, arm.stretches.in_common())]
    best = min((one for one in tried if one is not None), key=lambda one: one.left, default=None)
    while best is not None and len(best.each) < most:
        more = _in_turns(arm, arm.apart(best.each[-1].values, len(best.each) + 2))
        if more is None or more.left > ANOTHER * best.left:
            break
        best = more
    return best


def _rows(robot: _core.Robot, grid: Grid, step: float) -> _Rows:
    rows = grid.rows[:: max(1, round(step / grid.step))]
    motion = grid.q[rows], grid.qd[rows], grid.qdd[rows]
    torque = (grid.torque[rows] - np.asarray(_core.rigid_torques(robot, *motion))).T
    there = ~np.isnan(torque)
    links = np.asarray(_core.torque_regressor(robot, *motion)).transpose(1, 0, 2) * there[:, :, None]
    ones = np.ones((len(rows), len(torque)))
    usual = np.stack([grid.direction[rows], grid.qd[rows], grid.qdd[rows], ones]).transpose(2, 1, 0)
    one = _Rows(
        grid.name,
        grid.time[rows],
        motion,
        there,
        links,
        np.where(there, torque, 0.0),
        np.linalg.qr(usual * there[:, :, None])[0],
    )
    left = one.without_usual(one.torque[:, :, None])[:, :, 0]
    return replace(one, links=one.without_usual(links), torque=left)


@dataclass(frozen=True)
class _Fit:
    """Links, and what comes and goes where it is said to be there."""

    weight: Floats  # shape=(joints,) one over what is left of a joint's torque
    values: Floats  # shape=(things, values)
    left: list[Floats]  # by recording, shape=(joints, n) [Nm | N]

    @property
    def squares(self) -> float:
        return float(sum(np.sum((self.weight[:, None] * one) ** 2) for one in self.left))

    @property
    def rms(self) -> Floats:
        """What is left of each joint's torque. shape=(joints,) [Nm | N]"""
        rms = np.sqrt(np.mean(np.concatenate(self.left, axis=1) ** 2, axis=1))
        return np.asarray(np.maximum(rms, max(1e-6 * rms.max(), _TINY)))


@dataclass(frozen=True)
class _Arm:
    of: Thinned
    own: list[Floats]  # by recording, shape=(joints, n, values) of what comes and goes, whole
    is_mass: bool
    without: _Fit  # nothing anywhere

    @classmethod
    def made(cls, of: Thinned, columns: Columns, is_mass: bool) -> _Arm:
        own = [columns(*one.motion).transpose(1, 0, 2) * one.there[:, :, None] for one in of.rows]
        ones = np.ones(len(of.gram))
        arm = cls(of, own, is_mass, _Fit(ones, np.zeros((0, own[0].shape[2])), []))
        first = arm.fit(arm.nowhere(), ones)
        return replace(arm, without=arm.fit(arm.nowhere(), 1.0 / first.rms))

    def nowhere(self) -> list[Numbers]:
        return [np.zeros(len(one.time), dtype=np.intp) for one in self.of.rows]

    def fit(self, states: Sequence[Numbers], weight: Floats) -> _Fit:
        """Least squares: normal equations of the links, bordered by those of what comes and goes. states: the
        number of the thing that is there; 0: none.
        """
        square, width, values = weight**2, self.of.gram.shape[1], self.own[0].shape[2]
        things = max(int(one.max()) for one in states)
        both = width + things * values
        whole, right = np.zeros((both, both)), np.zeros(both)
        whole[:width, :width], right[:width] = np.tensordot(square, self.of.gram, 1), square @ self.of.right
        owns = []
        for one, columns, there in zip(self.of.rows, self.own, states, strict=True):
            each = [columns * (there == k)[:, None] for k in range(1, things + 1)]
            own = one.without_usual(np.concatenate([*each, columns[:, :, :0]], axis=2))
            owns.append(own)
            weighed = (square[:, None, None] * own).transpose(0, 2, 1)
            whole[width:, :width] += np.sum(weighed @ one.links, axis=0)
            whole[width:, width:] += np.sum(weighed @ own, axis=0)
            right[width:] += np.sum(weighed @ one.torque[:, :, None], axis=0)[:, 0]
        whole[:width, width:] = whole[width:, :width].T
        found = np.linalg.solve(whole + RIDGE * np.trace(whole) / both * np.eye(both), right)
        left = [
            one.torque - one.links @ found[:width] - own @ found[width:]
            for one, own in zip(self.of.rows, owns, strict=True)
        ]
        return _Fit(weight, found[width:].reshape(things, values), left)

    @functools.cached_property
    def stretches(self) -> _Stretches:
        length, by = max(2, round(STRETCH / self.of.step)), self.without.weight[:, None]
        places, grams, rights = [], [], []
        for k, (own, left) in enumerate(zip(self.own, self.without.left, strict=True)):
            for begin in range(0, left.shape[1], length):
                rows = slice(begin, begin + length)
                x = (by[:, :, None] * own[:, rows]).reshape(-1, own.shape[2])
                places.append((k, rows))
                grams.append(x.T @ x)
                rights.append(x.T @ (by * left[:, rows]).ravel())
        return _Stretches(places, np.array(grams), np.array(rights))

    def apart(self, values: Floats, groups: int) -> list[Numbers]:
        """Stretches by how much of these values they want, from little to much: means of so many groups."""
        out = self.nowhere()
        group = _means(*self.stretches.wanted(values), groups)
        for (k, rows), number in zip(self.stretches.places, group, strict=True):
            out[k][rows] = number
        return out


@dataclass(frozen=True)
class _Stretches:
    """Normal equations of what the links leave in each of them."""

    places: list[tuple[int, slice]]  # number of the recording, rows
    gram: Floats  # shape=(stretches, values, values)
    right: Floats  # shape=(stretches, values)

    def wanted(self, values: Floats) -> tuple[Floats, Floats]:
        """How much of these values each wants, and its weight: one over the variance of that."""
        weight = np.maximum(np.einsum("i,sij,j->s", values, self.gram, values), _TINY)
        return self.right @ values / weight, weight

    def in_common(self) -> Floats:
        """What they have in common, each so much of it as it wants: alternating least squares from the first
        principal direction. shape=(values,)
        """
        whole = self.gram.sum(axis=0)
        whole += (RIDGE * np.trace(whole) + _TINY) * np.eye(len(whole))
        sizes, vectors = np.linalg.eig(np.linalg.solve(whole, self.right.T @ self.right))
        values = np.real(vectors[:, int(np.argmax(np.real(sizes)))])
        for _ in range(TURNS):
            much = self.wanted(values)[0]
            gram = np.einsum("s,sij->ij", much**2, self.gram)
            ridge = RIDGE * (float(np.mean(much**2)) + _TINY) * whole
            values = np.linalg.solve(gram + ridge, much @ self.right)
            values = values / max(float(np.linalg.norm(values)), _TINY)
        return np.asarray(values)


def _means(values: Floats, weights: Floats, groups: int) -> Numbers:
    """Number of the mean that each value is nearest to, ascending (Lloyd 1957). shape=(n,)"""
    means = np.quantile(values, np.linspace(0.1, 0.9, groups))
    for _ in range(TURNS):
        group = np.searchsorted(0.5 * (means[1:] + means[:-1]), values)
        there = [group == k for k in range(groups)]
        if not all(one.any() for one in there):
            break
        means = np.array([np.average(values[one], weights=weights[one]) for one in there])
    return np.asarray(np.searchsorted(0.5 * (means[1:] + means[:-1]), values))


def _in_turns(arm: _Arm, states: list[Numbers]) -> AtTimes | None:
    """Values and states that agree; None: they explain little, or one is there always or never."""
    fit = arm.fit(states, arm.without.weight)
    if not arm.is_mass:  # which of two is nothing?
        other = [1 - there for there in states]
        states = min(states, other, key=lambda one: arm.fit(one, arm.without.weight).squares)
        fit = arm.fit(states, arm.without.weight)
    if fit.squares > PROMISING * arm.without.squares:
        return None
    for _ in range(TURNS):
        if arm.is_mass:
            states = _lightest_first(states, fit.values[:, 0])
        fit = arm.fit(states, 1.0 / fit.rms)
        new = _states(arm, fit, states)
        if len(np.unique(np.concatenate(new))) <= len(fit.values):
            return None
        if all(np.array_equal(a, b) for a, b in zip(states, new, strict=True)):
            break
        states = new
        fit = arm.fit(states, fit.weight)
    without = arm.fit(arm.nowhere(), fit.weight)
    left = float(np.exp(2.0 * np.mean(np.log(fit.rms / arm.without.rms))))
    changes = sum(int(np.sum(there[1:] != there[:-1])) for there in states)
    each = tuple(_switched(arm, fit, states, k) for k in range(len(fit.values)))
    return AtTimes(each, changes, fit.squares / without.squares, left)


def _switched(arm: _Arm, fit: _Fit, states: Sequence[Numbers], k: int) -> Switched:
    there = [one == k + 1 for one in states]
    of_name = {one.name: (one.time, at) for one, at in zip(arm.of.rows, there, strict=True)}
    return Switched(fit.values[k], _sigma(arm, fit, there), of_name)


def _lightest_first(states: Sequence[Numbers], masses: Floats) -> list[Numbers]:
    """Numbers in the order of the masses: the links take up what is always there, and no mass is negative."""
    rank = np.argsort(np.argsort(np.concatenate([[0.0], masses])))
    return [rank[one] for one in states]


def _states(arm: _Arm, fit: _Fit, states: Sequence[Numbers]) -> list[Numbers]:
    """What is there when, by what the fit leaves without it and with each."""
    rows = max(min(_correlated(fit.left, fit.weight), CORRELATED / arm.of.step), 1.0)
    by, out = fit.weight[:, None], []
    for columns, left, now in zip(arm.own, fit.left, states, strict=True):
        own = [np.zeros_like(left), *(by * (columns @ values) for values in fit.values)]
        without = by * left + sum(one * (now == k) for k, one in enumerate(own))
        gain = [0.5 * np.sum(without**2 - (without - one) ** 2, axis=0) / rows for one in own]
        out.append(_viterbi(np.array(gain).T))
    return out


def _correlated(left: Sequence[Floats], weight: Floats) -> float:
    """Rows that tell as much as one whose noise is its own: (1 + r) / (1 - r) of a first-order process."""
    square = weight**2
    after = sum(float(square @ np.sum(one[:, 1:] * one[:, :-1], axis=1)) for one in left)
    r = min(max(after / max(sum(float(square @ np.sum(one**2, axis=1)) for one in left), _TINY), 0.0), 0.98)
    return (1.0 + r) / (1.0 - r)


def _viterbi(gain: Floats) -> Numbers:
    """The state of every row: the sum of their gains [nats], less CHANGE a change, is largest. shape=(n,)

    gain: shape=(n, states)
    """
    numbers = range(gain.shape[1])
    best = [0.0] * len(numbers)
    came: list[list[int]] = []  # by row and state: the state of the row before
    for here in gain.tolist():
        top = max(numbers, key=best.__getitem__)
        came.append([k if best[k] >= best[top] - CHANGE else top for k in numbers])
        best = [max(best[k], best[top] - CHANGE) + here[k] for k in numbers]
    state, out = max(numbers, key=best.__getitem__), []
    for before in reversed(came):
        out.append(state)
        state = before[state]
    return np.array(out[::-1], dtype=np.intp)


def _sigma(arm: _Arm, fit: _Fit, states: Sequence[Bools]) -> float:
    """Standard error of the first value, the links being known: how far those of times with it are apart."""
    firsts, variances = [], []
    by, width = fit.weight[:, None], fit.values.shape[1]
    for own, left, there in zip(arm.own, fit.left, states, strict=True):
        for rows in np.split(np.arange(len(there)), np.flatnonzero(there[1:] != there[:-1]) + 1):
            for part in np.array_split(rows, 2):
                if len(part) < 2 * width or not there[part[0]]:
                    continue
                x = (by[:, :, None] * own[:, part]).reshape(-1, width)
                inverse = np.linalg.pinv(x.T @ x, rcond=1e-9, hermitian=True)
                firsts.append(float((inverse @ (x.T @ (by * left[:, part]).ravel()))[0]))
                variances.append(float(inverse[0, 0]))
    if len(firsts) < 2:
        return float("inf")
    of_one = np.array(firsts) ** 2 / np.array(variances)
    coloured = max(1.0, float(np.sum(of_one)) / (len(firsts) - 1))
    return float(np.sqrt(coloured / np.sum(1.0 / np.array(variances))))
