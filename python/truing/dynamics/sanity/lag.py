# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques shifted in time against the motion: the shift at which motion explains them best.

The columns are the regressor of the rigid chain, friction and an offset (Atkeson, An and Hollerbach 1986), so
that no mass need be right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid
from truing.dynamics.sanity.speeds import vertex

Floats = NDArray[np.float64]

ROWS = 2400  # of all recordings
FEWEST = 150  # in which a joint moves, of a recording
LATEST = 0.3  # [s] largest shift that is looked for
TIMES = np.linspace(-LATEST, LATEST, 51)  # [s] shifts
RANK = 1e-7  # of the largest eigenvalue: columns below say nothing
SAID = 0.015  # [s] from here on a shift is said
APPLIED = 0.04  # [s] from here on the effect `time_offset`, which is linear, cannot take it
SAME = 0.012  # [s] within this of what all have in common, a recording has that
ROUNDS = 2
BETTER = 0.7  # of the squared error: the shift must leave less


@dataclass(frozen=True)
class _Joint:
    """One joint over all recordings: its rows, torques at every shift, and how motion explains them."""

    recording: NDArray[np.intp]  # of every row
    torque: Floats  # shape=(rows, shifts) less its mean
    basis: Floats  # shape=(rows, rank) orthonormal columns of the model

    def expected(self, late: Floats) -> Floats:
        """What motion explains where each recording is shifted by its own time [s]."""
        shift = np.argmin(np.abs(TIMES[:, None] - late[self.recording]), axis=0)
        torque = self.torque[np.arange(len(shift)), shift]
        return np.asarray(self.basis @ (self.basis.T @ torque))

    def left(self) -> Floats:
        """Part of the variance that no motion explains, by shift."""
        explained = self.basis.T @ self.torque
        total = np.einsum("ij,ij->j", self.torque, self.torque)
        return np.asarray(1.0 - np.einsum("ij,ij->j", explained, explained) / total)


def shifts(robot: _core.Robot, grids: Sequence[Grid]) -> dict[str, float]:
    """By recording the time [s] by which its torques are late against its motion, where that is certain."""
    joints = _joints(robot, grids)
    if not joints:
        return {}
    common = np.sum([len(joint.torque) * np.log(joint.left()) for joint in joints], axis=0)
    best = int(np.argmin(common))
    together = TIMES[best] + vertex(-common, best) * (TIMES[1] - TIMES[0])
    late = np.full(len(grids), TIMES[best])
    for _ in range(ROUNDS):  # a recording that is shifted spoils what the others expect of it
        expected = [joint.expected(late) for joint in joints]
        own = [_shift_of(number, joints, expected) for number in range(len(grids))]
        late = np.array([together if one is None else one for one in own])
    late = np.where(np.abs(late - together) < SAME, together, late)
    return {
        grid.name: float(one)
        for grid, one in zip(grids, late, strict=True)
        if abs(one) > max(SAID, grid.raw_step)
    }


def _shift_of(number: int, joints: Sequence[_Joint], expected: Sequence[Floats]) -> float | None:
    """Of one recording [s]; 0: no shift is clearly better than none; None: one of several joints moves alone,
    and what its friction remembers may look like a shift."""
    score, rows, moved = np.zeros(len(TIMES)), 0, 0
    for joint, torque in zip(joints, expected, strict=True):
        own = joint.recording == number
        if own.sum() < FEWEST:
            continue
        error = joint.torque[own] - torque[own, None]
        error = error - error.mean(axis=0)
        score += own.sum() * np.log(np.einsum("ij,ij->j", error, error))
        rows += int(own.sum())
        moved += 1
    if moved == 1 < len(joints):
        return None
    best = int(np.argmin(score))
    if not rows or best in (0, len(TIMES) - 1):
        return 0.0
    if score[best] - score[len(TIMES) // 2] > rows * math.log(BETTER):
        return 0.0
    return float(TIMES[best] + vertex(-score, best) * (TIMES[1] - TIMES[0]))


def _joints(robot: _core.Robot, grids: Sequence[Grid]) -> list[_Joint]:
    every = max(1, math.ceil(sum(len(grid.rows) for grid in grids) / ROWS))
    rows = [_within(grid)[::every] for grid in grids]
    numbers = np.repeat(np.arange(len(grids)), [len(some) for some in rows])
    if not len(numbers):
        return []
    motion = [
        np.concatenate([getattr(grid, name)[some] for grid, some in zip(grids, rows, strict=True)])
        for name in ("q", "qd", "qdd", "direction")
    ]
    moving = np.concatenate([grid.moving[some] for grid, some in zip(grids, rows, strict=True)])
    joints = motion[0].shape[1]
    regressor = np.asarray(_core.torque_regressor(robot, *motion[:3])).reshape(len(numbers), joints, -1)
    out = []
    for j in range(joints):
        torque = np.concatenate(
            [_shifted(g.torque[:, j], some, TIMES / g.step) for g, some in zip(grids, rows, strict=True)]
        )
        own = moving[:, j] & ~np.isnan(torque).any(axis=1)
        columns = np.column_stack([regressor[own, j], motion[1][own, j], motion[3][own, j]])
        torque = torque[own]
        if own.sum() < max(FEWEST, 2 * columns.shape[1]):
            continue
        torque = torque - torque.mean(axis=0)
        if (np.einsum("ij,ij->j", torque, torque) > 0.0).all():
            out.append(_Joint(numbers[own], torque, _basis(columns)))
    return out


def _within(grid: Grid) -> NDArray[np.intp]:
    """Rows that can be shifted either way."""
    reach = int(math.ceil(LATEST / grid.step)) + 1
    return grid.rows[(grid.rows >= reach) & (grid.rows < len(grid.q) - reach)]


def _shifted(column: Floats, rows: NDArray[np.intp], by: Floats) -> Floats:
    """Values so many steps later, by straight lines between them. shape=(rows, shifts)"""
    whole = np.floor(by).astype(np.intp)
    part = by - whole
    at = rows[:, None] + whole
    return np.asarray((1.0 - part) * column[at] + part * column[at + 1])


def _basis(columns: Floats) -> Floats:
    """Orthonormal columns that span those given, less their means."""
    x = columns - columns.mean(axis=0)
    size = np.sqrt(np.einsum("ij,ij->j", x, x))
    kept = size > 1e-12 * size.max()
    x = x[:, kept] / size[kept]
    values, vectors = np.linalg.eigh(x.T @ x)
    seen = values > RANK * values[-1]
    return np.asarray(x @ (vectors[:, seen] / np.sqrt(values[seen])))


def findings(late: dict[str, float], recordings: int) -> list[RecordingFinding]:
    """In words; recordings: how many there are."""
    out = []
    for applied in (True, False):
        some = {name: value for name, value in late.items() if (abs(value) >= APPLIED) is applied}
        if not some:
            continue
        worst = max(some.values(), key=abs)
        word = "late against" if worst > 0 else "ahead of"
        up_to = "up to " if max(map(abs, some.values())) > 1.1 * min(map(abs, some.values())) else ""
        words = f"{listed(list(some))}: torques are {up_to}{1000 * abs(worst):.0f} ms {word} the motion"
        words += "; they are shifted back" if applied else "; left to the effect time_offset"
        names = () if len(some) == recordings else tuple(some)
        out.append(RecordingFinding("torque_shift", names, (), words, worst, "s", applied))
    return out
