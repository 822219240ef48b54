# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does the robot pick something up and set it down again while it is recorded, and nobody told?

Links that all rows have in common, and friction and offsets of each recording, leave a torque that comes and
goes. It may be that of one load, which hangs at the tool or does not: a hidden Markov model of two states.
Load and links are found by least squares, then the states by Viterbi's recursion (1967), in which a change
costs; and so on in turns until no state changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity.grids import Grid

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

STEP = 0.05  # [s] between the rows that are looked at, at least
ROWS = 2000  # of all recordings together, at most
FEWEST = 40  # rows of a recording
STRETCH = 1.0  # [s] whose load is asked for alone, to begin with
TURNS = 15  # of load and states
PROMISING = 0.9  # of the squares left without a load: what the first guess must get below
CORRELATED = 0.5  # [s] over which what is left may be alike, at most: it is more while states are wrong
CHANGE = 20.0  # [nats] that a load that comes or goes must gain
RIDGE = 1e-6  # of the mean square column: what motion does not show stays the file's
OF_LOAD = 4  # parameters of a link that a load adds to: mass, and mass times centre
_TINY = 1e-300


@dataclass(frozen=True)
class Grasped:
    """One load in the frame after the last link, and when it hangs there."""

    load: Floats  # shape=(4,) [kg, kg m]
    sigma: float  # [kg] of its mass
    part: float  # of the squares left without it: what is left with it
    gain: float  # squares that it explains, those of what is left of every joint being one on average
    states: dict[str, tuple[Floats, Bools]]  # by recording: instants [s], and whether it hangs there

    @property
    def changes(self) -> int:
        """How often it comes or goes."""
        return sum(int(np.sum(there[1:] != there[:-1])) for _, there in self.states.values())

    def carried(self, recording: str, time: Floats) -> Bools:
        """Whether it hangs there at these times [s], shape=(n,): as at the nearest instant."""
        if recording not in self.states:
            return np.zeros(len(time), dtype=np.bool_)
        instants, there = self.states[recording]
        return there[np.searchsorted(0.5 * (instants[1:] + instants[:-1]), time)]


def grasped(robot: _core.Robot, grids: Sequence[Grid]) -> Grasped | None:
    """The load that explains most by coming and going; None: there is no such."""
    seconds = sum(len(grid.rows) * grid.step for grid in grids)
    step = max(STEP, seconds / ROWS)
    seen = [rows for grid in grids if len((rows := _rows(robot, grid, step)).time) >= FEWEST]
    if not any(one.torque.any() for one in seen):
        return None
    arm = _Arm.of(seen, step)
    found = [_in_turns(arm, arm.apart(load)) for load in arm.first_loads(robot)]
    return max((one for one in found if one is not None), key=lambda one: one.gain, default=None)


@dataclass(frozen=True)
class _Rows:
    """Of one recording; what friction, rotors and offsets take up is left out of links and torque."""

    name: str
    time: Floats  # shape=(n,) [s]
    links: Floats  # shape=(joints, n, 10 links) torques by the parameters of the links
    load: Floats  # shape=(joints, n, 4) the same of a load, whole
    torque: Floats  # shape=(joints, n) [Nm | N] less that of the file's links; 0: not measured
    usual: Floats  # shape=(joints, n, 4) orthonormal columns of friction, rotor and offset

    def without_usual(self, columns: Floats) -> Floats:
        """shape=(joints, n, k)"""
        return np.asarray(columns - self.usual @ (self.usual.transpose(0, 2, 1) @ columns))


def _rows(robot: _core.Robot, grid: Grid, step: float) -> _Rows:
    rows = grid.rows[:: max(1, round(step / grid.step))]
    motion = grid.q[rows], grid.qd[rows], grid.qdd[rows]
    torque = (grid.torque[rows] - np.asarray(_core.rigid_torques(robot, *motion))).T
    there = ~np.isnan(torque)[:, :, None]
    links = np.asarray(_core.torque_regressor(robot, *motion)).transpose(1, 0, 2) * there
    ones = np.ones((len(rows), len(torque)))
    usual = np.stack([grid.direction[rows], grid.qd[rows], grid.qdd[rows], ones]).transpose(2, 1, 0) * there
    one = _Rows(
        grid.name,
        grid.time[rows],
        links,
        links[:, :, -10 : -10 + OF_LOAD],
        np.where(there[:, :, 0], torque, 0.0),
        np.linalg.qr(usual)[0],
    )
    left = one.without_usual(one.torque[:, :, None])[:, :, 0]
    return replace(one, links=one.without_usual(links), torque=left)


@dataclass(frozen=True)
class _Fit:
    """Links, and a load where it is said to hang."""

    weight: Floats  # shape=(joints,) one over what is left of a joint's torque
    load: Floats  # shape=(4,) [kg, kg m]
    left: list[Floats]  # by recording, shape=(joints, n) [Nm | N]

    @property
    def squares(self) -> float:
        return float(sum(np.sum((self.weight[:, None] * one) ** 2) for one in self.left))

    @property
    def weighed_by_left(self) -> Floats:
        """Weights that make what is left of each joint one, rms. shape=(joints,)"""
        rms = np.sqrt(np.mean(np.concatenate(self.left, axis=1) ** 2, axis=1))
        return np.asarray(1.0 / np.maximum(rms, max(1e-6 * rms.max(), _TINY)))


@dataclass(frozen=True)
class _Arm:
    seen: list[_Rows]
    step: float  # [s] between rows
    gram: Floats  # shape=(joints, 10 links, 10 links) of the links' columns
    right: Floats  # shape=(joints, 10 links) these times the torques
    without: _Fit  # no load anywhere

    @classmethod
    def of(cls, seen: list[_Rows], step: float) -> _Arm:
        gram = sum(one.links.transpose(0, 2, 1) @ one.links for one in seen)
        right = sum((one.torque[:, None, :] @ one.links)[:, 0] for one in seen)
        arm = cls(
            seen,
            step,
            np.asarray(gram),
            np.asarray(right),
            _Fit(np.ones(len(seen[0].torque)), np.zeros(4), []),
        )
        first = arm.fit(arm.nowhere(), arm.without.weight)
        return replace(arm, without=arm.fit(arm.nowhere(), first.weighed_by_left))

    def nowhere(self) -> list[Bools]:
        return [np.zeros(len(one.time), dtype=np.bool_) for one in self.seen]

    def fit(self, states: Sequence[Bools], weight: Floats) -> _Fit:
        """Least squares: normal equations of the links, bordered by those of the load."""
        square, width = weight**2, self.gram.shape[1]
        whole, right = np.zeros((width + OF_LOAD, width + OF_LOAD)), np.zeros(width + OF_LOAD)
        whole[:width, :width], right[:width] = np.tensordot(square, self.gram, 1), square @ self.right
        loads = []
        for one, there in zip(self.seen, states, strict=True):
            load = one.without_usual(one.load * there[:, None])
            loads.append(load)
            weighed = (square[:, None, None] * load).transpose(0, 2, 1)
            whole[width:, :width] += np.sum(weighed @ one.links, axis=0)
            whole[width:, width:] += np.sum(weighed @ load, axis=0)
            right[width:] += np.sum(weighed @ one.torque[:, :, None], axis=0)[:, 0]
        whole[:width, width:] = whole[width:, :width].T
        values = np.linalg.solve(whole + RIDGE * np.trace(whole) / len(whole) * np.eye(len(whole)), right)
        left = [
            one.torque - one.links @ values[:width] - load @ values[width:]
            for one, load in zip(self.seen, loads, strict=True)
        ]
        return _Fit(weight, values[width:], left)

    def stretches(self) -> Iterator[tuple[int, slice, Floats, Floats]]:
        """Number of the recording, rows, and normal equations of a load of what the links leave in each."""
        length, by = max(2, round(STRETCH / self.step)), self.without.weight[:, None]
        for k, (one, left) in enumerate(zip(self.seen, self.without.left, strict=True)):
            for begin in range(0, len(one.time), length):
                rows = slice(begin, begin + length)
                x = (by[:, :, None] * one.load[:, rows]).reshape(-1, OF_LOAD)
                yield k, rows, x.T @ x, x.T @ (by * left[:, rows]).ravel()

    def first_loads(self, robot: _core.Robot) -> list[Floats]:
        """Loads to begin with, of any size: a mass at the tool; and what stretches have in common, each so
        much of it as it wants (alternating least squares from the first principal direction). shape=(4,)
        """
        last = np.array(robot.targets[0].T_last_target)[:3, 3] if robot.targets else np.zeros(3)
        equations = [(gram, right) for _, _, gram, right in self.stretches()]
        whole = np.sum([gram for gram, _ in equations], axis=0)
        whole += (RIDGE * np.trace(whole) + _TINY) * np.eye(OF_LOAD)
        outer = np.sum([np.outer(right, right) for _, right in equations], axis=0)
        values, vectors = np.linalg.eig(np.linalg.solve(whole, outer))
        load = np.real(vectors[:, int(np.argmax(np.real(values)))])
        for _ in range(TURNS):
            much = [float(load @ right) / max(float(load @ gram @ load), _TINY) for gram, right in equations]
            gram = np.sum([a * a * g for a, (g, _) in zip(much, equations, strict=True)], axis=0)
            right = np.sum([a * r for a, (_, r) in zip(much, equations, strict=True)], axis=0)
            load = np.linalg.solve(gram + RIDGE * whole, right)
            load = load / max(float(np.linalg.norm(load)), _TINY)
        return [np.append(1.0, last), load]

    def apart(self, load: Floats) -> list[Bools]:
        """Stretches that want much of a load, and those that want little: two means."""
        places, much, weight = [], [], []
        for k, rows, gram, right in self.stretches():
            size = max(float(load @ gram @ load), _TINY)
            places.append((k, rows))
            much.append(float(load @ right) / size)
            weight.append(size)
        upper = _two_means(np.array(much), np.array(weight))
        out = self.nowhere()
        for (k, rows), there in zip(places, upper, strict=True):
            out[k][rows] = there
        return out


def _two_means(values: Floats, weights: Floats) -> Bools:
    """Which of the values are nearer to the upper of two means. shape=(n,)"""
    low, high = np.quantile(values, [0.1, 0.9])
    for _ in range(TURNS):
        upper = values > 0.5 * (low + high)
        if upper.all() or not upper.any():
            break
        low = float(np.average(values[~upper], weights=weights[~upper]))
        high = float(np.average(values[upper], weights=weights[upper]))
    return np.asarray(values > 0.5 * (low + high))


def _in_turns(arm: _Arm, states: list[Bools]) -> Grasped | None:
    """Load and states that agree; None: it explains little, or hangs there always or never."""
    fit = arm.fit(states, arm.without.weight)
    if fit.squares > PROMISING * arm.without.squares:
        return None
    for _ in range(TURNS):
        if fit.load[0] < 0.0:
            states = [~there for there in states]
        fit = arm.fit(states, fit.weighed_by_left)
        new = _states(arm, fit, states)
        share = np.mean(np.concatenate(new))
        if share in (0.0, 1.0):
            return None
        if all(np.array_equal(a, b) for a, b in zip(states, new, strict=True)):
            break
        states = new
        fit = arm.fit(states, fit.weight)
    without = arm.fit(arm.nowhere(), fit.weight).squares
    of_name = {one.name: (one.time, there) for one, there in zip(arm.seen, states, strict=True)}
    return Grasped(fit.load, _sigma(arm, fit, states), fit.squares / without, without - fit.squares, of_name)


def _states(arm: _Arm, fit: _Fit, states: Sequence[Bools]) -> list[Bools]:
    """When the load hangs there, by what the fit leaves with and without it."""
    rows = min(_correlated(fit.left, fit.weight), CORRELATED / arm.step)
    by, out = fit.weight[:, None], []
    for one, left, there in zip(arm.seen, fit.left, states, strict=True):
        of_load = by * (one.load @ fit.load)
        without = by * left + of_load * there
        out.append(_viterbi(0.5 * np.sum(without**2 - (without - of_load) ** 2, axis=0) / max(rows, 1.0)))
    return out


def _correlated(left: Sequence[Floats], weight: Floats) -> float:
    """Rows that tell as much as one whose noise is its own: (1 + r) / (1 - r) of a first-order process."""
    square = weight**2
    after = sum(float(square @ np.sum(one[:, 1:] * one[:, :-1], axis=1)) for one in left)
    r = min(max(after / max(sum(float(square @ np.sum(one**2, axis=1)) for one in left), _TINY), 0.0), 0.98)
    return (1.0 + r) / (1.0 - r)


def _viterbi(gain: Floats) -> Bools:
    """Which rows have it: the sum of their gains [nats], less CHANGE a change, is largest. shape=(n,)"""
    without, with_it = 0.0, 0.0
    came: list[tuple[bool, bool]] = []  # by row: the row before had it, this one having it not, and having it
    for here in gain.tolist():
        came.append((with_it - CHANGE > without, with_it >= without - CHANGE))
        without, with_it = max(without, with_it - CHANGE), max(with_it, without - CHANGE) + here
    state, out = with_it > without, []
    for before in reversed(came):
        out.append(state)
        state = before[int(state)]
    return np.array(out[::-1], dtype=np.bool_)


def _sigma(arm: _Arm, fit: _Fit, states: Sequence[Bools]) -> float:
    """[kg] standard error of the mass, the links being known: how far masses of times with it are apart."""
    masses, variances = [], []
    by = fit.weight[:, None]
    for one, left, there in zip(arm.seen, fit.left, states, strict=True):
        for rows in np.split(np.arange(len(there)), np.flatnonzero(there[1:] != there[:-1]) + 1):
            for part in np.array_split(rows, 2):
                if len(part) < 2 * OF_LOAD or not there[part[0]]:
                    continue
                x = (by[:, :, None] * one.load[:, part]).reshape(-1, OF_LOAD)
                inverse = np.linalg.pinv(x.T @ x, rcond=1e-9, hermitian=True)
                masses.append(float((inverse @ (x.T @ (by * left[:, part]).ravel()))[0]))
                variances.append(float(inverse[0, 0]))
    if len(masses) < 2:
        return float("inf")
    of_one = np.array(masses) ** 2 / np.array(variances)
    coloured = max(1.0, float(np.sum(of_one)) / (len(masses) - 1))
    return float(np.sqrt(coloured / np.sum(1.0 / np.array(variances))))
