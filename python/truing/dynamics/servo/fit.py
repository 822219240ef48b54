# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Chains fitted to motion: output errors over all windows, sensitivities by differences from one run of all
perturbations, Levenberg's damping, priors and bounds."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.data import ServoData, Window
from truing.dynamics.servo.free import Free, moved
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator

Floats = NDArray[np.float64]
Progress = Callable[[str], None]
Column = tuple[int, Floats]
"""What a value changes: a joint and its rows, shape=(n,), or -1 and all joints', shape=(n, joints)."""
FoldSums = tuple[Floats, Floats, float, float]

_DAMPINGS = (0.0, 0.03, 0.3, 3.0)  # Levenberg's, of the diagonal: all are tried at once, the best is taken
_FARTHEST_LOG = 4.0  # of a logarithm in one step: a flat column would leave for any number
_LONGER = (3.0,)  # times the step of the second: along curved valleys
_FINER = 0.1  # times the usual step of a difference quotient
_LAST = 2e-3  # relative fall of the cost at which a fit ends
_ANCHORS = 3
_AGREES = 0.02  # of the rms error: what the anchor may still change
_LEFT = 3.0  # [rad] an error that is cut: what has left pulls no more than this
_MEDIAN = 1.4826  # standard deviation of normal errors over the median of their sizes
_HUBER = 1.345  # of it: 95 % efficient where errors are normal (Huber 1964)
_LEAST_SCALE = 1.0 / 3.0  # of the rms
_FIRM_TURNS, _FIRM_ROUNDS = 3, 5
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
    cut: Floats | None = None  # shape=(joints,) [rad | m]: larger errors count in proportion (Huber 1964)

    @property
    def weight(self) -> Floats:
        return np.asarray(1.0 / (self.sigma * np.sqrt(self.effect)))

    def counted(self, errors: Floats) -> Floats:
        """Errors whose squares are twice Huber's loss: e^2 up to the cut c, c (2 |e| - c) beyond."""
        if self.cut is None:
            return errors
        size = np.abs(errors)
        return np.where(size > self.cut, np.sqrt(self.cut * np.maximum(2.0 * size - self.cut, 0.0)), size)

    def weighed(self, table: Sequence[Column], errors: Floats) -> tuple[Sequence[Column], Floats]:
        """Columns and errors of the weighted squares whose gradient is the loss's."""
        return (table, errors) if self.cut is None else scaled(table, errors, huber_roots(errors, self.cut))


def cut_of(errors: Floats) -> Floats:
    """Of each joint, where Huber's loss asks 5 % more rows of normal errors, whose scale the median says (of
    a joint that mostly rests it says nothing)."""
    rms = np.sqrt(np.mean(errors**2, axis=0))
    scale = np.maximum(_MEDIAN * np.median(np.abs(errors), axis=0), _LEAST_SCALE * rms)
    return np.asarray(_HUBER * np.maximum(scale, 1e-9))


def huber_roots(errors: Floats, cut: Floats) -> Floats:
    """Roots of rows' weights: 1, and c / |e| beyond the cut."""
    return np.asarray(np.sqrt(np.minimum(1.0, cut / np.maximum(np.abs(errors), 1e-300))))


def scaled(table: Sequence[Column], errors: Floats, root: Floats) -> tuple[list[Column], Floats]:
    """Rows of columns and errors, each times its root."""
    return [(j, column * (root if j < 0 else root[:, j])) for j, column in table], errors * root


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
    columns: list[Column] = field(repr=False)  # of the position, by each value on its scale
    noise: Noise = field(repr=False, default_factory=lambda: Noise(np.ones(1), np.ones(1)))
    cost: float = np.inf


class Fitter:
    """Fits of chains to the rows of some windows. simulator: `Apart`: what the whole arm does otherwise is
    added as it is at the last `anchor` (space mapping, Bandler 1994)."""

    def __init__(self, simulator: Simulator | Apart, rows: Rows, progress: Progress | None = None) -> None:
        self.simulator, self.rows = simulator, rows
        self.progress = progress or (lambda text: None)
        self.runs = 0  # simulated chains
        self.fineness = 1.0  # of difference quotients: times the usual steps
        self._beside: tuple[Point, Floats] | None = None
        self.other: Floats = np.zeros_like(rows.measured)  # of the whole arm, less that of joints apart

    def motions(self, points: Sequence[Point]) -> list[Floats]:
        self.runs += len(points)
        if self._beside is None or not isinstance(self.simulator, Apart):
            return self.simulator.run(points, self.rows.windows)[0]
        base, motion = self._beside
        moves = [_only_joint(point, base) for point in points]
        found = self.simulator.run(points, self.rows.windows, only=moves)[0]
        for k, joint in enumerate(moves):
            if joint >= 0:
                alone, found[k] = found[k][:, joint], motion.copy()
                found[k][:, joint] = alone
        return found

    @contextlib.contextmanager
    def beside(self, fitted: Fitted) -> Iterator[None]:
        """Meanwhile of points that differ from a fit at one joint this joint alone is simulated, if joints
        are apart: the others stay as they were fitted. A supply that sags by all torques needs them all."""
        outer = self._beside
        sags = np.any(fitted.point.chain[:, FIELDS.index("supply_sag")] != 0.0)
        if not sags and self.rows.measured.shape[1] > 1:
            self._beside = fitted.point, self.rows.measured - self.other - fitted.errors
        try:
            yield
        finally:
            self._beside = outer

    @contextlib.contextmanager
    def finer(self) -> Iterator[None]:
        """Meanwhile differences are of a tenth of the usual steps: along a valley, as that of a light joint's
        torques, which all may grow together, those of single values cancel, and what is left is their
        curvature."""
        outer, self.fineness = self.fineness, _FINER * self.fineness
        try:
            yield
        finally:
            self.fineness = outer

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

    def firm(self, fitted: Fitted, doing: str = "") -> Fitted:
        """A fit's values by Huber's loss, cut anew where each fit ends."""
        for _ in range(_FIRM_TURNS):
            noise = replace(fitted.noise, cut=cut_of(fitted.errors))
            fitted = self.settled(fitted.point, fitted.free, fitted.start, noise, _FIRM_ROUNDS, doing)
        return replace(fitted, noise=replace(fitted.noise, cut=None))

    def columns(
        self, point: Point, free: Sequence[Free], exact: bool = False, known: Floats | None = None
    ) -> tuple[Floats, list[Column]]:
        """Errors of the point, and the change of the position with each value on its scale. known: the
        point's motion, where it was simulated.

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
                step = self.fineness * one.step
                step = step if one.at(point) + step <= one.high else -step
                changed = one.put(changed, one.at(point) + step)
                steps[k] = one.at(changed) - one.at(point)
            points.append(changed)
        motions = self.motions(points if known is not None else [*points, point])
        base = known if known is not None else motions.pop()
        out: list[Column] = [(-1, np.zeros(0))] * len(free)
        for members, motion in zip(groups.values(), motions, strict=True):
            for k in members:
                joint = -1 if exact and base.shape[1] > 1 else free[k].joint
                out[k] = joint, change_of(motion, base, steps[k], joint)
        return self.errors(base), out

    def cost(self, errors: Floats, point: Point, free: Sequence[Free], start: Floats, noise: Noise) -> float:
        """Half of the weighted squares, and of the priors'."""
        squares = float(np.sum((noise.counted(errors) * noise.weight) ** 2))
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
        shown: bool = True,
    ) -> Fitted:
        """Gauss-Newton with Levenberg's damping. noise: None: every joint's rms before each round, so that
        all joints count alike. shown: whether columns are wanted where it ends."""
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
                point,
                *(moved(point, free, step) for step in self._steps(point, free, start, errors, table, noise)),
            ]
            point, after, motion = self._best(tried, errors, free, start, noise)
            if not after < before:
                break
            last = number + 1 == rounds or after > before * (1.0 - _LAST)
            if last and not shown:
                errors, table = self.errors(self.motions([point])[0] if motion is None else motion), []
            else:
                errors, table = self.columns(point, free, known=motion)
            if last:
                break
        noise = fixed or Noise(np.maximum(np.sqrt(np.mean(errors**2, axis=0)), least), np.ones(len(least)))
        cost = self.cost(errors, point, free, start, noise)
        return Fitted(point, free, start, errors, table, noise, cost)

    def _best(
        self, tried: Sequence[Point], errors: Floats, free: Sequence[Free], start: Floats, noise: Noise
    ) -> tuple[Point, float, Floats | None]:
        """The best of points, the first of which has these errors, its cost, and its motion if it was
        simulated. Joints apart do not know of each other: each takes what is best for it."""
        motions = self.motions(tried[1:])
        some = [errors, *(self.errors(motion) for motion in motions)]
        costs = np.array(
            [self.joint_costs(e, p, free, start, noise) for e, p in zip(some, tried, strict=True)]
        )
        sags = np.any(tried[0].chain[:, FIELDS.index("supply_sag")] != 0.0)
        if not isinstance(self.simulator, Apart) or sags or any(one.joint < 0 for one in free):
            best = int(np.argmin(costs.sum(axis=1)))
            return tried[best], float(costs[best].sum()), motions[best - 1] if best else None
        each = np.argmin(costs, axis=0)
        chain = np.array([tried[k].chain[j] for j, k in enumerate(each)])
        motion = None
        if np.all(each > 0):
            motion = np.column_stack([motions[k - 1][:, j] for j, k in enumerate(each)])
        functions = tuple(f for j, k in enumerate(each) for f in tried[k].functions if f[0] == j)
        return replace(tried[0], chain=chain, functions=functions), float(costs.min(axis=0).sum()), motion

    def joint_costs(
        self, errors: Floats, point: Point, free: Sequence[Free], start: Floats, noise: Noise
    ) -> Floats:
        """`cost`, joint by joint; priors of what is of the whole arm stand at the first."""
        out = 0.5 * np.sum((noise.counted(errors) * noise.weight) ** 2, axis=0)
        for one, mean in zip(free, start, strict=True):
            out[max(one.joint, 0)] += 0.5 * ((one.at(point) - mean) / one.prior) ** 2
        return np.asarray(out)

    def _steps(
        self,
        point: Point,
        free: Sequence[Free],
        start: Floats,
        errors: Floats,
        table: Sequence[Column],
        noise: Noise,
    ) -> list[Floats]:
        """Steps of every damping: (X'X + P + mu D) s = X'e - P (x - start)."""
        xx, xy = sums(*noise.weighed(table, errors), noise)
        precision = np.array([f.prior**-2 for f in free])
        at = np.array([f.at(point) for f in free])
        right = xy - precision * (at - start)
        out = []
        most = np.array([_FARTHEST_LOG if f.scale == "log" else np.inf for f in free])
        for mu in _DAMPINGS:
            d = xx + np.diag(precision + mu * np.diag(xx) + 1e-12)
            out.append(np.clip(bounded_step(d, right, free, at), -most, most))
        return [*out, *(longer * out[1] for longer in _LONGER)]


def _only_joint(point: Point, base: Point) -> int:
    """The joint at which alone a point differs; -1: others do, or what is of the whole arm."""
    there = {*np.flatnonzero(np.any(point.chain != base.chain, axis=1))}
    there |= {f[0] for f in point.functions if not any(f is g for g in base.functions)}
    whole = ("weight", "payload", "place", "links")
    same = all(getattr(point, name) == getattr(base, name) for name in whole)
    return int(there.pop()) if same and len(there) == 1 else -1


def change_of(motion: Floats, base: Floats, step: float, joint: int) -> Floats:
    """Change of a motion by a step of one, of a joint (-1: of all). Contiguous."""
    seen = (slice(None), slice(None) if joint < 0 else joint)
    if not step:
        return np.zeros_like(base[seen])
    return np.ascontiguousarray(np.clip(motion[seen] - base[seen], -_LEFT, _LEFT) / step)


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


def sums(columns: Sequence[Column], errors: Floats, noise: Noise) -> tuple[Floats, Floats]:
    """X'X and X'e of weighted rows."""
    xx, xy, _, _ = sums_by_fold(columns, errors, noise.weight)[0]
    return xx, xy


def sums_by_fold(
    columns: Sequence[Column],
    errors: Floats,
    weight: Floats,
    fold: NDArray[np.intp] | None = None,
    every: int = 1,
) -> list[FoldSums]:
    """X'X, X'e, e'e and rows of each fold, in a fixed order of sums: numpy's products add in another order
    with other numbers of threads, and a search may then end elsewhere. fold: of each row, from 0 on; None:
    one fold. every: rows are thinned to each so-many-th, which counts for as many."""
    rows = np.zeros(len(errors), dtype=np.intp) if fold is None else fold
    folds = int(rows.max()) + 1 if rows.size else 1
    measured = np.ascontiguousarray(errors)
    return list(_core.sum_columns(list(columns), measured, weight, rows.tolist(), folds, every))


def combined(columns: Sequence[Column], values: Floats, like: Floats) -> Floats:
    """The sum of the columns, each times its value. like: shape=(n, joints)"""
    out = np.zeros_like(like)
    for (joint, column), value in zip(columns, values, strict=True):
        if joint < 0:
            out += value * column
        else:
            out[:, joint] += value * column
    return out
