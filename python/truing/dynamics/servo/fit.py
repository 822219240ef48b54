# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Chains fitted to motion: output errors over all windows, sensitivities by differences from one run of all
perturbations, Levenberg's damping, priors and bounds."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.data import ServoData, Window
from truing.dynamics.servo.free import Free, moved
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator

Floats = NDArray[np.float64]
Progress = Callable[[str], None]

_DAMPINGS = (0.0, 0.03, 0.3, 3.0)  # Levenberg's, of the diagonal: all are tried at once, the best is taken
_FARTHEST_LOG = 4.0  # of a logarithm in one step: a flat column would leave for any number
_LONGER = (2.0, 4.0)  # times the step of the second: along curved valleys
_LAST = 2e-3  # relative fall of the cost at which a fit ends
_ANCHORS = 3
_AGREES = 0.02  # of the rms error: what the anchor may still change
_LEFT = 3.0  # [rad] an error that is cut: what has left pulls no more than this
_LAGS = 400  # rows: longest correlation that is summed


@dataclass(frozen=True)
class Rows:
    """Rows of a set of windows: what was measured there, and where they belong."""

    windows: tuple[Window, ...]
    measured: Floats  # shape=(n, joints)
    fold: NDArray[np.intp]  # shape=(n,)
    window: NDArray[np.intp]  # shape=(n,) number of the window


def rows_of(data: ServoData, windows: Sequence[Window]) -> Rows:
    parts = [data.streams[w.stream].position[w.first + 1 : w.first + w.rows + 1] for w in windows]
    counts = [w.rows for w in windows]
    return Rows(
        tuple(windows),
        np.concatenate(parts),
        np.repeat(np.array([w.fold for w in windows], dtype=np.intp), counts),
        np.repeat(np.arange(len(windows), dtype=np.intp), counts),
    )


@dataclass(frozen=True)
class Noise:
    """What counts as an error of size one at each joint, and for how many rows a row counts."""

    sigma: Floats  # shape=(joints,) [rad | m]
    effect: Floats  # shape=(joints,): rows that count as one (Kish 1965)

    @property
    def weight(self) -> Floats:
        return np.asarray(1.0 / (self.sigma * np.sqrt(self.effect)))


def noise_of(errors: Floats, rows: Rows, least: Floats) -> Noise:
    """Rms of each joint's errors, no less than `least`; how long they go on: 1 + 2 sum of correlations,
    initial positive sequence (Geyer 1992), within windows."""
    joints = errors.shape[1]
    sigma = np.maximum(np.sqrt(np.mean(errors**2, axis=0)), least)
    effect = np.ones(joints)
    cuts = np.flatnonzero(np.diff(rows.window)) + 1
    pieces = np.split(errors, cuts)
    longest = min(_LAGS, min(len(piece) for piece in pieces) - 1)
    for j in range(joints):
        spectrum = np.zeros(longest + 1)
        for piece in pieces:
            size = 1 << int(2 * len(piece) - 1).bit_length()
            transform = np.fft.rfft(piece[:, j], size)
            spectrum += np.fft.irfft(transform * np.conj(transform), size)[: longest + 1]
        if spectrum[0] <= 0.0:
            continue
        rho = spectrum / spectrum[0]
        pairs = rho[1:-1:2] + rho[2::2]
        end = int(np.argmax(pairs < 0.0)) if np.any(pairs < 0.0) else pairs.size
        effect[j] = max(1.0, 1.0 + 2.0 * float(np.sum(pairs[:end])))
    return Noise(sigma, effect)


@dataclass
class Fitted:
    """A fit: where it ended, and what it saw there."""

    point: Point
    free: list[Free]
    start: Floats  # prior means, on the scales
    errors: Floats  # shape=(n, joints) measured less simulated
    columns: Floats = field(repr=False)  # shape=(values, n, joints) of the position
    noise: Noise = field(repr=False, default_factory=lambda: Noise(np.ones(1), np.ones(1)))
    cost: float = np.inf


class Fitter:
    """Fits of chains to the rows of some windows. simulator: `Apart`: what the whole arm does otherwise is
    added as it is at the last `anchor` (space mapping, Bandler 1994)."""

    def __init__(self, simulator: Simulator | Apart, rows: Rows, progress: Progress | None = None) -> None:
        self.simulator, self.rows = simulator, rows
        self.progress = progress or (lambda text: None)
        self.runs = 0  # simulated chains
        self._only: tuple[int, Floats] | None = None
        self.other: Floats = np.zeros_like(rows.measured)  # of the whole arm, less that of joints apart

    def motions(self, points: Sequence[Point]) -> list[Floats]:
        self.runs += len(points)
        if self._only is None or not isinstance(self.simulator, Apart):
            return self.simulator.run(points, self.rows.windows)[0]
        joint, motion = self._only
        found = self.simulator.run(points, self.rows.windows, only=joint)[0]
        out = [motion.copy() for _ in found]
        for one, moved_joint in zip(out, found, strict=True):
            one[:, joint] = moved_joint[:, joint]
        return out

    @contextlib.contextmanager
    def only(self, joint: int, fitted: Fitted) -> Iterator[None]:
        """Meanwhile this joint alone is simulated, if joints are apart: the others stay as they were fitted.
        A supply that sags by all joints' torques needs them all."""
        outer, self._only = self._only, None
        sags = np.any(fitted.point.chain[:, FIELDS.index("supply_sag")] != 0.0)
        if joint >= 0 and not sags and self.rows.measured.shape[1] > 1:
            self._only = joint, self.rows.measured - self.other - fitted.errors
        try:
            yield
        finally:
            self._only = outer

    def errors(self, motion: Floats) -> Floats:
        return np.clip(self.rows.measured - self.other - motion, -_LEFT, _LEFT)

    def anchor(self, point: Point) -> None:
        """From here on errors at this point are the whole arm's."""
        if isinstance(self.simulator, Apart):
            whole = self.simulator.whole.run([point], self.rows.windows)[0][0]
            self.other = np.clip(whole - self.motions([point])[0], -_LEFT, _LEFT)

    def settled(
        self,
        point: Point,
        free: Sequence[Free],
        start: Floats,
        noise: Noise | None,
        rounds: int,
        doing: str = "",
    ) -> Fitted:
        """`fit` by joints apart, anchored anew where it ends, as long as the whole arm's errors fall."""
        self.anchor(point)
        best = self.fit(point, free, start, noise, rounds, doing)
        for _ in range(_ANCHORS):
            before = self.other
            self.anchor(best.point)
            errors, columns = self.columns(best.point, free)
            here = self.cost(errors, best.point, free, start, best.noise)
            best = Fitted(best.point, list(free), start, errors, columns, best.noise, here)
            if np.sqrt(np.mean((self.other - before) ** 2)) < _AGREES * np.sqrt(np.mean(errors**2)):
                break
            best = self.fit(best.point, free, start, noise, 2, doing)
        return best

    def columns(self, point: Point, free: Sequence[Free], exact: bool = False) -> tuple[Floats, Floats]:
        """Errors of the point, and the change of the position with each value on its scale.

        One value is changed at all joints in one simulation, and what a joint does then is taken for its
        own: how joints move each other is left out (of geared arms some percent). Steps are judged by whole
        simulations in any case. exact: a simulation for each value.
        """
        groups: dict[object, list[int]] = {}
        for k, one in enumerate(free):
            alone = exact or one.joint < 0
            groups.setdefault((one.field, k) if alone else one.field, []).append(k)
        points, steps = [], np.zeros(len(free))
        for members in groups.values():
            changed = point
            for k in members:
                one = free[k]
                step = one.step if one.at(point) + one.step <= one.high else -one.step
                changed = one.put(changed, one.at(point) + step)
                steps[k] = one.at(changed) - one.at(point)
            points.append(changed)
        motions = self.motions([point, *points])
        base = motions[0]
        table = np.zeros((len(free), *base.shape))
        for members, motion in zip(groups.values(), motions[1:], strict=True):
            change = np.clip(motion - base, -_LEFT, _LEFT)
            for k in members:
                seen = slice(None) if len(members) == 1 else slice(free[k].joint, free[k].joint + 1)
                if steps[k]:
                    table[k][:, seen] = change[:, seen] / steps[k]
        return self.errors(base), table

    def cost(self, errors: Floats, point: Point, free: Sequence[Free], start: Floats, noise: Noise) -> float:
        """Half of the weighted squares, and of the priors'."""
        squares = float(np.sum((errors * noise.weight) ** 2))
        priors = sum(((f.at(point) - s) / f.prior) ** 2 for f, s in zip(free, start, strict=True))
        return 0.5 * float(squares + priors)

    def fit(
        self,
        point: Point,
        free: Sequence[Free],
        start: Floats,
        noise: Noise | None,
        rounds: int,
        doing: str = "",
    ) -> Fitted:
        """Gauss-Newton with Levenberg's damping. noise: None: every joint's rms before each round, so that
        all joints count alike."""
        free = list(free)
        errors, table = self.columns(point, free)
        fixed = noise
        least = 1e-6 * np.ones(errors.shape[1])
        for number in range(rounds):
            self.progress(f"{doing} (round {number + 1})" if doing else "")
            noise = fixed or Noise(
                np.maximum(np.sqrt(np.mean(errors**2, axis=0)), least), np.ones(len(least))
            )
            before = self.cost(errors, point, free, start, noise)
            tried = [
                moved(point, free, step) for step in self._steps(point, free, start, errors, table, noise)
            ]
            costs = []
            motions = self.motions(tried)
            for one, motion in zip(tried, motions, strict=True):
                costs.append(self.cost(self.errors(motion), one, free, start, noise))
            best = int(np.argmin(costs))
            if not costs[best] < before:
                break
            point = tried[best]
            done = costs[best] > before * (1.0 - _LAST)
            if number + 1 == rounds or done:
                errors, table = self.columns(point, free)
                break
            errors, table = self.columns(point, free)
        noise = fixed or Noise(np.maximum(np.sqrt(np.mean(errors**2, axis=0)), least), np.ones(len(least)))
        cost = self.cost(errors, point, free, start, noise)
        return Fitted(point, free, start, errors, table, noise, cost)

    def _steps(
        self, point: Point, free: Sequence[Free], start: Floats, errors: Floats, table: Floats, noise: Noise
    ) -> list[Floats]:
        """Steps of every damping: (X'X + P + mu D) s = X'e - P (x - start)."""
        xx, xy = sums(table, errors, noise)
        precision = np.array([f.prior**-2 for f in free])
        at = np.array([f.at(point) for f in free])
        right = xy - precision * (at - start)
        out = []
        most = np.array([_FARTHEST_LOG if f.scale == "log" else np.inf for f in free])
        for mu in _DAMPINGS:
            d = xx + np.diag(precision + mu * np.diag(xx) + 1e-12)
            out.append(np.clip(bounded_step(d, right, free, at), -most, most))
        return [*out, *(longer * out[1] for longer in _LONGER)]


def bounded_step(d: Floats, right: Floats, free: Sequence[Free], at: Floats) -> Floats:
    """The step of a quadratic model; values that would pass a bound end there, and the others follow."""
    held = np.zeros(len(free), dtype=bool)
    step = np.zeros(len(free))
    low = np.array([f.low for f in free]) - at
    high = np.array([f.high for f in free]) - at
    for _ in range(len(free) + 1):
        go = ~held
        if not go.any():
            break
        step[go] = np.linalg.solve(d[np.ix_(go, go)], right[go] - d[np.ix_(go, held)] @ step[held])
        beyond = go & ((step < low) | (step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(step[beyond], low[beyond], high[beyond])
        held |= beyond
    return step


def sums(table: Floats, errors: Floats, noise: Noise) -> tuple[Floats, Floats]:
    """X'X and X'e of weighted rows."""
    x = (table * noise.weight).reshape(len(table), -1)
    return x @ x.T, x @ (errors * noise.weight).ravel()
