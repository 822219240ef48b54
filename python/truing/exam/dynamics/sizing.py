# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What is seen of an effect once standard practice is fitted, and which other effect would look the same.

Rivals are textbook laws, written here anew: the examiner shares no law with who is examined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truing.exam.dynamics.bodies import regressor, tool_points, weight_along
from truing.exam.dynamics.laws import Scene, stop
from truing.exam.dynamics.robots import Floats

SAME = 0.98
"""Share of what is seen of an effect that a rival must explain to stand for it."""
UNSEEN = 3.0
"""[nats] below which no test on these rows tells two effects apart."""
_BAND = 10.0  # [Hz] in which effects and noise are compared
_RATE = 25.0  # [Hz] of the rows that are compared
_RIDGE = 1e-9  # smallest singular value of unit columns


def low_pass(x: Floats, step: float, hertz: float = _BAND) -> Floats:
    """Zero-phase, by a raised-cosine edge in frequency; ends are continued by point reflection."""
    rows = len(x)
    pad = min(rows - 1, round(1.0 / step))
    whole = np.concatenate([2 * x[0] - x[pad:0:-1], x, 2 * x[-1] - x[-2 : -pad - 2 : -1]])
    f = np.fft.rfftfreq(len(whole), step)
    gain = 0.5 * (1.0 + np.cos(np.pi * np.clip((f / hertz - 0.8) / 0.4, 0.0, 1.0)))
    gain = gain[:, None] if x.ndim > 1 else gain
    return np.asarray(np.fft.irfft(np.fft.rfft(whole, axis=0) * gain, n=len(whole), axis=0)[pad : pad + rows])


@dataclass(frozen=True)
class Rival:
    """Forms of an effect: each is columns, shape=(rows x joints, columns), in units of the noise."""

    effect: str
    joints: tuple[int, ...]
    forms: tuple[Floats, ...]


class View:
    """Recordings to learn from, in units of the noise, with standard practice taken out: offset, Coulomb and
    viscous of every joint, and under wrong inertials all inertias too.
    """

    def __init__(self, scenes: Sequence[Scene], sigma: Floats, inertials: bool, per_row: float) -> None:
        self.scenes = scenes
        self.sigma = sigma
        self.n = len(sigma)
        self.per_row = per_row  # what a row at 25 Hz counts, noise being as coloured, or as fast, as it is
        self.every = max(1, round(1.0 / (_RATE * scenes[0].step)))
        standard = [
            self.stacked([s.at(j, column(s, j)) for s in scenes])
            for j in range(self.n)
            for column in (_one, Scene.sign, _speed)
        ]
        columns = np.stack(standard, axis=1)
        self.bodies = self._bodies()
        if inertials:
            columns = np.concatenate([columns, self.bodies], axis=1)
        self.basis = orthonormal(columns)

    def stacked(self, columns: Sequence[Floats]) -> Floats:
        """Torques of each recording, shape=(rows, n), in band, one below the other, over the noise."""
        parts = [
            low_pass(column, scene.step)[:: self.every] / self.sigma
            for column, scene in zip(columns, self.scenes, strict=True)
        ]
        return np.asarray(np.concatenate(parts).ravel())

    def _bodies(self) -> Floats:
        parts = []
        for s in self.scenes:
            q, qd, qdd = (low_pass(x, s.step)[:: self.every] for x in (s.motion.q, s.motion.qd, s.motion.qdd))
            parts.append(regressor(s.arm, q, qd, qdd) / self.sigma[:, None])
        whole = np.concatenate(parts)
        return whole.reshape(-1, whole.shape[2])

    def rest(self, column: Floats) -> Floats:
        """What standard practice leaves, shape=(rows x joints, ...)."""
        return np.asarray(column - self.basis @ (self.basis.T @ column))

    def size(self, column: Floats) -> float:
        """Rms over the noise at the joint where most is seen."""
        left = self.rest(column).reshape(-1, self.n)
        return float(np.sqrt(np.mean(left**2, axis=0)).max())

    def explained(self, column: Floats, others: Floats) -> float:
        """Share of what is seen of a column that others explain."""
        left = self.rest(column)
        q = orthonormal(self.rest(others))
        return float(np.sum((q.T @ left) ** 2) / max(np.sum(left**2), 1e-30))

    def unseen(self, column: Floats, share: float) -> bool:
        """Whether what is not explained of a column drowns in the noise."""
        return 0.5 * (1.0 - share) * float(np.sum(self.rest(column) ** 2)) * self.per_row < UNSEEN


def orthonormal(columns: Floats) -> Floats:
    size = np.linalg.norm(columns, axis=0)
    unit = columns[:, size > 1e-9] / size[size > 1e-9]
    if not unit.shape[1]:
        return np.asarray(unit)
    u, s, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(u[:, s > np.sqrt(_RIDGE) * s[0]])


def _one(s: Scene, j: int) -> Floats:
    return np.ones(len(s.motion.t))


def _speed(s: Scene, j: int) -> Floats:
    return s.motion.qd[:, j]


# ---- Rivals --------------------------------------------------------------------------------------


def forms_at(s: Scene, j: int, handed: frozenset[str]) -> dict[tuple[str, int], list[list[Floats]]]:
    """Columns at joint j of each form of each effect there; the second of the key: another joint, or -1."""
    v, q, sign = s.motion.qd[:, j], s.motion.q[:, j], s.sign(j)
    top = s.arm.speed[j]
    found: dict[tuple[str, int], list[list[Floats]]] = {
        ("viscous_law", -1): [[v * np.abs(v)], [v**3], [sign * np.sqrt(np.abs(v))]]
        + [[np.tanh(v / (part * top))] for part in (0.1, 0.2, 0.4)],
        ("stribeck", -1): [[sign * np.exp(-((v / (part * top)) ** 2))] for part in (0.02, 0.05, 0.1, 0.2)],
        ("presliding", -1): [[stop(q, width)] for width in (2e-3, 5e-3, 1e-2, 2e-2, 4e-2)],
        ("asymmetric_friction", -1): [[np.abs(v)]],
        ("load_friction", -1): [[sign * np.abs(s.total[:, j])]],
        ("position_friction", -1): [[sign * np.sin(q), sign * np.cos(q)]],
        ("ripple", -1): [[np.sin(k * q), np.cos(k * q)] for k in range(1, 13)],
        ("armature", -1): [[s.motion.qdd[:, j]]],
        ("spring", -1): [[q]],
        ("motor_constant", -1): [[s.total[:, j]]],
        ("torque_lag", -1): [[np.gradient(s.total[:, j], s.step)]],
        ("warmup", -1): [[sign * s.motion.t, v * s.motion.t]],
    }
    if "temperature" in handed:
        warm = s.temperature[:, j] - 20.0
        found["thermal_friction", -1] = [[sign * warm, v * warm]]
    for k in range(s.arm.n):
        if k != j:
            found["coupling", k] = [[s.motion.qd[:, k], s.sign(k), s.motion.qdd[:, k]]]
    return found


def rivals(view: View, joints: Sequence[int], handed: frozenset[str]) -> list[Rival]:
    """Every textbook effect at these joints, and those of the whole arm."""
    found = []
    for j in joints:
        every = [forms_at(s, j, handed) for s in view.scenes]
        for effect, other in every[0]:
            forms = []
            for number, form in enumerate(every[0][effect, other]):
                forms.append(
                    np.stack(
                        [
                            view.stacked(
                                [
                                    s.at(j, own[effect, other][number][c])
                                    for s, own in zip(view.scenes, every, strict=True)
                                ]
                            )
                            for c in range(len(form))
                        ],
                        axis=1,
                    )
                )
            found.append(Rival(effect, (j,) if other < 0 else (j, other), tuple(forms)))
    return found + _whole_arm(view)


def _whole_arm(view: View) -> list[Rival]:
    n = view.n
    found = [Rival("link_inertia", (k,), (view.bodies[:, 10 * k : 10 * k + 10],)) for k in range(n)]
    found.append(Rival("payload", (), (view.bodies[:, 10 * n - 10 : 10 * n - 6],)))
    shifted = view.stacked([np.gradient(s.total, s.step, axis=0) for s in view.scenes])
    found.append(Rival("time_offset", (), (shifted[:, None],)))
    moves = [tool_points(s.arm, s.motion.q)[1] for s in view.scenes]
    pulls = [view.stacked([m[:, :, c] for m in moves]) for c in range(3)]
    found.append(Rival("tool_force", (), (np.stack(pulls, axis=1),)))
    tilts = [
        view.stacked([weight_along(s.arm, s.motion.q, way) for s in view.scenes]) for way in np.eye(3)[:2]
    ]
    found.append(Rival("base_tilt", (), (np.stack(tilts, axis=1),)))
    return found


def best_share(view: View, column: Floats, rival: Rival) -> float:
    """Share of an effect that the best form of a rival explains."""
    return max(view.explained(column, form) for form in rival.forms)
