# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How far an effect changes the simulated motion once the usual parameters are fitted, and which other effect
would look the same. All of it by simulating the arm with and without.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from truing.exam.dynamics.robots import Floats
from truing.exam.dynamics.servo.arms import Plant
from truing.exam.dynamics.servo.courses import Course
from truing.exam.dynamics.servo.effects import Usage
from truing.exam.dynamics.servo.firmware import Conditions, Run, play

SAME = 0.98
"""Share of what is seen of an effect that another must explain to stand for it."""
UNSEEN = 3.0
"""[nats] below which no test on these rows tells two effects apart."""
BARE = "*"
"""Stands for all usual parameters."""
_PER_ROW = 0.2
"""What a row counts: what an encoder's steps leave is correlated from row to row."""

_STEPS: dict[str, Callable[[Plant], Plant]] = {
    "command_gain": lambda p: replace(p, gain=1.05 * p.gain),
    "viscous": lambda p: replace(p, viscous=1.1 * p.viscous),
    "coulomb": lambda p: replace(p, coulomb=1.2 * p.coulomb),
    "armature": lambda p: replace(p, armature=1.2 * p.armature),
    "delay": lambda p: replace(p, delay=p.delay + 4e-3),
}
"""A step of each usual parameter, at all joints at once: what it does at a joint is laid to its own."""


class View:
    """Recordings to learn from, and what the usual parameters can change in them."""

    def __init__(self, plant: Plant, courses: Sequence[Course], conditions: Sequence[Conditions]) -> None:
        self.plant, self.courses, self.conditions = plant, courses, conditions
        self.quiet, *stepped = play([plant, *(step(plant) for step in _STEPS.values())], courses, conditions)
        self.whole = motion(self.quiet)
        self.n = self.whole.shape[1]
        self.usual = dict(zip(_STEPS, (motion(runs) - self.whole for runs in stepped), strict=True))
        means = [run.q - run.q.mean(axis=0) for run in self.quiet]
        self.spread = np.sqrt(np.mean(np.concatenate(means) ** 2, axis=0))

    def usage(self) -> Usage:
        """Largest of what the joints are asked for."""
        errors = [course.u - run.q for course, run in zip(self.courses, self.quiet, strict=True)]
        rates = [np.abs(np.gradient(c.u, 1.0 / c.rate, axis=0)) for c in self.courses if c.kind != "steps"]
        every = np.concatenate([np.abs(run.torque) for run in self.quiet])
        return Usage(
            torque=np.quantile(every, 0.995, axis=0),
            drawn=float(np.quantile(every.sum(axis=1), 0.995)),
            speed=np.concatenate(rates).max(axis=0),
            error=np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0)),
            moved=np.sqrt(np.mean(np.concatenate([run.speed for run in self.quiet]) ** 2, axis=0)),
        )

    def changes(self, plants: Sequence[Plant]) -> list[Floats]:
        """What other plants do with the same commands, less what this one does: shape=(rows, n) each."""
        return [motion(runs) - self.whole for runs in play(plants, self.courses, self.conditions)]

    def rest(self, change: Floats, hidden: str = "") -> Floats:
        """What is left of a change of the motion once the usual parameters and the joints' zeros are fitted,
        joint by joint. hidden: the usual parameter that is looked for, and not fitted; BARE: zeros alone are.
        """
        left = np.empty_like(change)
        for j in range(self.n):
            columns = [c[:, j] for name, c in self.usual.items() if hidden not in (name, BARE)]
            table = np.stack([*columns, np.ones(len(change))], axis=1)
            size = np.linalg.norm(table, axis=0)
            table = table[:, size > 1e-9] / size[size > 1e-9]
            left[:, j] = change[:, j] - table @ np.linalg.lstsq(table, change[:, j], rcond=1e-6)[0]
        return left

    def sizes(self, change: Floats, hidden: str = "") -> Floats:
        """Rms of what is left over rms of the motion about its middle, shape=(n,)."""
        return np.asarray(np.sqrt(np.mean(self.rest(change, hidden) ** 2, axis=0)) / self.spread)

    def absorbed(self, change: Floats, hidden: str, beside: Floats | None = None) -> float:
        """Share of a change that the usual parameters take up, `hidden` not among them; beside: the change
        that one more parameter makes.
        """
        left = self.rest(change, hidden).ravel()
        if beside is not None:
            other = self.rest(beside, hidden).ravel()
            left = left - other * float(left @ other) / float(other @ other)
        return 1.0 - float(left @ left) / float(np.sum(self.rest(change, BARE) ** 2))

    def same(self, change: Floats, other: Floats, sigma: float, hidden: str = "") -> tuple[float, bool]:
        """Share of a change that another explains, and whether this stands for it. sigma: [rad] of noise."""
        left, theirs = self.rest(change, hidden).ravel(), self.rest(other, hidden).ravel()
        square = float(left @ left)
        if square <= 0.0 or float(theirs @ theirs) <= 0.0:
            return 0.0, False
        share = float(left @ theirs) ** 2 / (square * float(theirs @ theirs))
        nats = 0.5 * (1.0 - share) * square / sigma**2 * _PER_ROW
        return share, share >= SAME or nats < UNSEEN


def motion(runs: Sequence[Run]) -> Floats:
    return np.concatenate([run.q for run in runs])
