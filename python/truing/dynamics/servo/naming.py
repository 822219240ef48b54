# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which effects stand beside the groundwork: ranked by linear gain, the best three refitted without
linearisation, one after the other, as long as folds that were not fitted are predicted better."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.candidates import BUS, Candidate, candidate_columns, candidates_of
from truing.dynamics.servo.fit import (
    Column,
    Fitted,
    Fitter,
    FoldSums,
    Noise,
    combined,
    noise_of,
    sums_by_fold,
)
from truing.dynamics.servo.free import USUAL, Free, Sizes, moved
from truing.dynamics.servo.ground import Place, other_places, sizes_of
from truing.dynamics.servo.simulator import FIELDS, Point

Floats = NDArray[np.float64]

THRESHOLD = 4.0  # nats beyond the cost
LEAST_GAIN = 0.01  # of a joint's squared error on folds that were not fitted
SURE_GAIN = 2.0  # standard errors over the folds
SURE_NATS = 10.0  # of a refit: instead of these, where folds are too unlike for standard errors
OTHER_LAWS = 0.2  # part of a joint's error that other laws than the catalogue's may well be
NAMED = 0.2  # what is less sure is fitted, and not named
INEXACT = 0.03  # of what a law explains: so much it may miss as no law of the catalogue is a machine's
MEMBER = 0.05  # of the best one's weight: who has less is not of its class
_CLASS_NATS, _CLASS_R2, _SAME_R2, _TEMPERED, _FAR_NATS = 6.0, 0.95, 0.5, 0.5, 25.0
_LATE_R2 = 0.95  # of a delay, that damping and the others do as well: these are one class
ONE_RECORDING = 0.9  # the most that folds of one recording are worth
_REFITTED, _REFITTED_EACH = 6, 4  # of the candidates, without linearisation; of each joint, if there are more
_FIRST_ROUNDS, _MORE_ROUNDS = 1, 5  # of a refit: from each start, from the best of these
_STRAIGHT = 5.0  # standard errors from a fit: so far its derivatives are taken to hold
_OF_ARM = 5, 2  # the same of what is of the whole arm, where every joint is refitted; of one effect
_LEAST_PART = 0.05  # of what the usual parameters leave at a joint, that a name removes
_NEAR = 3  # candidates of a joint that are fitted from another place
_STARTS = 2  # that a refit is begun from: those of least error
_HOPELESS = 0.3  # of the best refit's nats: what a refit has won after its first rounds, or it ends
_WIDE = (0.5, 2.0)  # of a prior: sizes that a candidate is looked at
_FRICTIONS = (1.0, 0.4, 0.05)  # times the dry friction that stands beside it
_OF_INPUTS = ("gain_law", "thermal_friction", "supply_gain", "warmup")
_LEAST_GROUPS = 3
_BETTER = 3.0  # nats: of a name that takes another's place
_ALIKE = 0.4  # of the median: how far delays may be apart that are one
_FARTHEST = 0.6  # of a prior: that derivatives are followed
RESOLUTION = 0.3  # of the usual step between distinct readings: no error is smaller
_MOST_ROWS = 15000  # of which sums are made; more are thinned


@dataclass
class Rank:
    """A candidate's place beside what is fitted."""

    candidate: int
    score: float
    share: float
    values: Floats
    folds: Floats  # squares by fold, with it
    explains_best: float


@dataclass(frozen=True)
class Weight:
    """What is left without an effect, everything else refitted at its joint."""

    before: Floats  # squares of each fold by the fit to the others, without it
    after: Floats  # and with it
    loss: float  # nats
    point: Point  # the chain without it


@dataclass(frozen=True)
class Refit:
    """A rival that was refitted in the place of what was taken."""

    other: Candidate
    behind: float  # nats
    best: float  # nats that the one won that was taken


@dataclass
class Account:
    """What was found, fitted to all training rows."""

    fitted: Fitted
    standard: Fitted  # with the usual parameters alone
    found: list[Candidate]
    sizes: Sizes
    nominal: Point
    not_testable: list[tuple[str, tuple[str, ...], str]] = field(default_factory=list)
    refits: dict[tuple[str, tuple[str, ...]], list[Refit]] = field(default_factory=dict)
    """By the place of what was taken: rivals that were refitted where it was."""
    weights: list[Weight] = field(default_factory=list)
    vetoed: list[tuple[Candidate, str]] = field(default_factory=list)  # and why they are not named
    idle: list[Candidate] = field(default_factory=list)  # what was dropped beside what is named
    late: Fitted | None = (
        None  # with the usual parameters and the delay that joints have alike, if it is found
    )

    @property
    def ground(self) -> Fitted:
        """What other names are held against."""
        return self.standard if self.late is None else self.late

    def remove(self, at: int) -> None:
        """Takes one of what was found from the list."""
        if self.found.pop(at).label == BUS:
            self.late = None


@dataclass
class Sums:
    """Normal equations by fold, of the columns that are fitted and of the candidates."""

    folds: list[FoldSums]
    always: int  # columns of what is fitted stand first
    noise: Noise


def squares_of_folds(
    sums: Sums,
    fitted: Fitted,
    more: Sequence[int] = (),
    prior: Floats | None = None,
    by: Sequence[FoldSums] | None = None,
) -> Floats:
    """Squares of each fold by the fit to the others, linear at the fit, with its priors: what motion hardly
    shows would otherwise go anywhere. Nor do values go further than derivatives hold. more: further columns
    that are in, numbered as in `sums`, and their priors. by: sums that the others are fitted by, of rows that
    are weighed otherwise."""
    columns = [*range(sums.always), *more]
    extra = np.zeros(0) if prior is None else prior
    precision = np.array([*(f.prior for f in fitted.free), *extra]) ** -2.0
    away = np.array([f.at(fitted.point) - s for f, s in zip(fitted.free, fitted.start, strict=True)])
    pull = precision * np.array([*away, *np.zeros(len(extra))])
    fits, parts = ([_of_columns(one, columns) for one in some] for some in (by or sums.folds, sums.folds))
    xx, xy = sum(part[0] for part in fits), sum(part[1] for part in fits)
    sigma = np.sqrt(np.diag(np.linalg.inv(xx + np.diag(precision))))
    known = sigma[: sums.always]
    out = []
    for (fitted_xx, fitted_xy, _), (here, right, squares) in zip(fits, parts, strict=True):
        others, pulls = xx - fitted_xx + np.diag(precision), xy - fitted_xy - pull
        values = _held_back(np.linalg.solve(others, pulls), others, pulls, known)
        out.append(squares - 2.0 * float(values @ right) + float(values @ here @ values))
    return np.array(out)


def _held_back(values: Floats, others: Floats, pulls: Floats, sigma: Floats) -> Floats:
    """What is fitted no further than derivatives hold, value by value; all together, where rows that are
    fitted would be further off so than at the fit: along a valley, as of a delay and damping, one that is
    held back alone leaves it."""
    known = slice(0, sigma.size)
    out = values.copy()
    out[known] = np.clip(values[known], -_STRAIGHT * sigma, _STRAIGHT * sigma)
    if float(out @ others @ out) > 2.0 * float(out @ pulls):
        out[known] = values[known] * _STRAIGHT / float(np.max(np.abs(values[known]) / sigma))
    return out


def rooted_gain(before: Floats, after: Floats) -> tuple[float, float]:
    """Mean of what parts lose of their squares, as roots, which a few large ones do not decide, and its
    standard error. A part that had hardly any errors counts for less, or its own would decide."""
    gain = (before - after) / np.maximum(before + np.median(before), 1e-300)
    roots = np.copysign(np.sqrt(np.abs(gain)), gain)
    return float(roots.mean()), float(roots.std(ddof=1)) / math.sqrt(before.size)


def _of_columns(fold: FoldSums, columns: Sequence[int]) -> tuple[Floats, Floats, float]:
    return fold[0][np.ix_(columns, columns)], fold[1][columns], fold[2]


class Namer:
    """The search."""

    def __init__(self, fitter: Fitter, leave_out: Sequence[str], most: int) -> None:
        self.fitter, self.leave_out, self.most = fitter, tuple(leave_out), most
        self.data, self.arm = fitter.simulator.data, fitter.simulator.arm
        self.joints = len(self.arm.nominal.joints)
        self.resolution = _resolution(fitter)
        self.groups = _groups_of_inputs(self)

    # ---- ranking

    def all_candidates(
        self, point: Point, sizes: Sizes
    ) -> tuple[list[Candidate], list[tuple[str, tuple[str, ...], str]], Floats]:
        motions, torques = self.fitter.simulator.run([point], self.fitter.rows.windows, torques=True)
        self.fitter.runs += 1
        found, idle = candidates_of(self.arm, self.data, point, sizes, torques[0], self.leave_out)
        return found, idle, motions[0]

    def sums(
        self,
        fitted: Fitted,
        more: Sequence[Column],
        errors: Floats | None = None,
        noise: Noise | None = None,
        folds_of_rows: NDArray[np.intp] | None = None,
    ) -> Sums:
        """Noise is what all columns together leave; rows count for as many as their noise goes on for."""
        rows = self.fitter.rows
        errors = fitted.errors if errors is None else errors
        columns = [*fitted.columns, *more]
        noise = noise or self._noise(columns, errors, len(fitted.columns))
        which = rows.fold if folds_of_rows is None else folds_of_rows
        fold = np.unique(which, return_inverse=True)[1]
        count = float(np.sum(1.0 / noise.effect))
        some = sums_by_fold(columns, errors, noise.weight, fold, self._every())
        here = np.bincount(fold)
        folds = [(xx, xy, yy, float(n) * count) for (xx, xy, yy, _), n in zip(some, here, strict=True)]
        return Sums(folds, len(fitted.columns), noise)

    def _every(self) -> int:
        return max(1, math.ceil(len(self.fitter.rows.fold) / _MOST_ROWS))

    def noise_after(self, fitted: Fitted) -> Noise:
        """What a ridge fit leaves of what is fitted, joint by joint."""
        return self._noise(fitted.columns, fitted.errors, len(fitted.columns))

    def _noise(self, columns: Sequence[Column], errors: Floats, always: int) -> Noise:
        """What a ridge fit of everything leaves, joint by joint."""
        rms = np.maximum(np.sqrt(np.mean(errors**2, axis=0)), self.resolution)
        xx, xy, _, _ = sums_by_fold(columns, errors, 1.0 / rms, every=self._every())[0]
        scale = np.sqrt(np.maximum(np.diag(xx), 1e-30))
        ridge = np.full(len(columns), 1e-3)
        ridge[:always] = 1e-6
        values = np.linalg.solve(xx / np.outer(scale, scale) + np.diag(ridge), xy / scale) / scale
        return noise_of(errors - combined(columns, values, errors), self.fitter.rows, self.resolution)

    def ranked(
        self, sums: Sums, groups: Sequence[Sequence[int]], costs: Sequence[float], prior: Floats
    ) -> tuple[Floats, list[Rank]]:
        gains = _core.rank_columns(
            sums.folds, list(range(sums.always)), [list(g) for g in groups], list(costs), prior
        )
        out = [
            Rank(k, g.score, g.share, np.asarray(g.values), np.asarray(g.folds), g.explains_best)
            for k, g in enumerate(gains[1:])
        ]
        return np.asarray(gains[0].folds), out

    def predicts(self, before: Floats, after: Floats, least: float, nats: float = 0.0) -> bool:
        """Folds that were not fitted: by enough in all, and by two standard errors, or by many nats."""
        if before.size < 2 or not before.sum() > 0.0:
            return False
        mean, error = rooted_gain(before, after)
        whole = float((before - after).sum() / before.sum())
        return whole > least / self.joints and bool(nats > SURE_NATS or mean > SURE_GAIN * error)

    def _enough(self, one: Candidate, seen: Mapping[tuple[str, tuple[str, ...]], int]) -> bool:
        """Whether as many were refitted as may be: of a joint, or of the arm and each of its effects."""
        there = [place for place, joint in seen.items() if joint == one.joint]
        if one.joint < 0:
            return len(there) >= _OF_ARM[0] or [name for name, _ in there].count(one.effect) >= _OF_ARM[1]
        return len(there) >= (_REFITTED if self.joints == 1 else _REFITTED_EACH)

    def matters(self, ground: Fitted, one: Candidate, before: Fitted, after: Fitted) -> bool:
        """Whether a refit removes more of its joint's error than encoders' steps make, and than a part of
        what the usual parameters leave there: the laws themselves are no nearer to a machine's."""
        squares = [np.mean(some.errors**2, axis=0) for some in (before, after, ground)]
        enough = squares[0] - squares[1] > np.maximum(self.resolution**2, _LEAST_PART * squares[2])
        return bool(np.any(enough) if one.joint < 0 else enough[one.joint])

    def folds_of(self, fitted: Fitted, noise: Noise, folds_of_rows: NDArray[np.intp] | None = None) -> Floats:
        """Squares of each fold, by the fit to the others, linear at the fit."""
        return squares_of_folds(self.sums(fitted, [], None, noise, folds_of_rows), fitted)

    def carries(self, one: Candidate, before: Fitted, after: Fitted, noise: Noise) -> bool:
        """Whether what goes with an input that changes from recording to recording predicts values of it that
        were not fitted: recordings of one value (of several inputs that rose together) are one fold."""
        if self.groups is None or one.free[0].field not in _OF_INPUTS:
            return True
        folds = [self.folds_of(fitted, noise, self.groups) for fitted in (before, after)]
        return bool(folds[0].sum() - folds[1].sum() > LEAST_GAIN / self.joints * folds[0].sum())

    # ---- the search

    def run(
        self,
        fitted: Fitted,
        sizes: Sizes,
        nominal: Point,
        late: tuple[Candidate, Fitted] | None = None,
    ) -> Account:
        """late: a delay that joints have alike, and the fit with it."""
        account = Account(fitted, fitted, [], sizes, nominal)
        if late is not None:
            account.found.append(late[0])
            account.fitted = account.late = late[1]
        refused: set[tuple[str, int]] = set()
        while len(account.found) < self.most:
            self.fitter.progress(f"candidates beside {len(account.found)} that were named")
            before = len(account.found)
            if not self._round(account, refused):
                break
            for joint in range(self.joints):
                if joint in {c.joint for c in account.found[before:]}:
                    self._question(account, joint)
        self._join(account)
        self._weigh(account)
        return account

    def _join(self, account: Account) -> None:
        """Delays that most joints have alike, found one by one beside what hid that they are: one cause."""
        late = [one for one in account.found if one.free[0].field == "delay"]
        free = [f for one in late for f in one.free]
        if len(late) < 2 or 2 * len(free) <= self.joints:
            return
        values = np.array([f.at(account.fitted.point) for f in free])
        if np.ptp(values) > _ALIKE * np.median(values):
            return
        free.sort(key=lambda f: f.joint)
        names = self.arm.nominal.joints
        where = () if len(free) == self.joints else tuple(names[f.joint] for f in free)
        account.found = [one for one in account.found if one.free[0].field != "delay"]
        account.found.append(Candidate("delay", -1, where, tuple(free), label=BUS))

    def _weigh(self, account: Account) -> None:
        """Drops what is idle, until nothing is."""
        account.weights = []
        while account.found and self._drop_idle(account):
            pass

    def drop(self, account: Account, at: int) -> None:
        """Takes one of what was found out of the chain; the rest is fitted, and weighed, without it."""
        fitted, one = account.fitted, account.found[at]
        self.fitter.progress(f"{one.effect} {' '.join(one.joints)} does not hold")
        noise = self.noise_after(fitted)
        less = self.without(account, at, noise)
        account.remove(at)
        account.fitted = self.polished(less, noise)
        self._again(account)
        self._weigh(account)

    def _again(self, account: Account) -> None:
        """What was idle beside a name that did not hold may not be idle without it."""
        vetoed = {other.place for other, _ in account.vetoed}
        again = {(c.label, c.joint) for c in account.idle if c.place not in vetoed}
        account.idle.clear()
        while again and self._round(account, set(), again):
            pass

    def _question(self, account: Account, joint: int) -> None:
        """Looks again at every earlier name of the joint where one was taken: another may stand there now."""
        noise = self.noise_after(account.fitted)
        for at in [k for k, c in enumerate(account.found) if c.joint == joint][:-1]:
            one, fitted = account.found[at], account.fitted
            less = self.without(account, at, noise)
            rest = Account(
                less,
                account.standard,
                [c for k, c in enumerate(account.found) if k != at],
                account.sizes,
                account.nominal,
                late=account.late,
            )
            best, seen = self.best_beside(rest, set(), joint)
            if not best or best[0][1].place == one.place:
                continue
            _, other, refit = best[0]
            new = self.fitter.cost(refit.errors, refit.point, refit.free, refit.start, seen)
            old = self.fitter.cost(fitted.errors, fitted.point, fitted.free, fitted.start, seen)
            if old - new > _BETTER:
                self.fitter.progress(f"{other.effect} in the place of {one.effect} {' '.join(one.joints)}")
                account.refits[other.place] = _rivals(less, seen, best, 0)
                account.found[at] = other
                account.found.append(account.found.pop(at))
                account.fitted = self.polished(refit, seen)
                return

    def _drop_idle(self, account: Account) -> bool:
        """Takes away what folds that were not fitted are predicted as well without; the others are weighed
        by what is left without them (`Account.weights`)."""
        fitted, weights = account.fitted, []
        noise = self.noise_after(fitted)
        squares = self.folds_of(fitted, noise)
        for at, one in enumerate(account.found):
            less, weight, needed = self.weighed(account, at, noise, squares)
            if not needed:
                self.fitter.progress(f"{one.effect} {' '.join(one.joints)} is idle")
                account.idle.append(one)
                account.remove(at)
                account.fitted = self.polished(less, noise)
                return True
            weights.append(weight)
        account.weights = weights
        return False

    def weighed(
        self, account: Account, at: int, noise: Noise, squares: Floats
    ) -> tuple[Fitted, Weight, bool]:
        """The account without one of what was found, what that loses, and whether folds that were not fitted
        are predicted better with it. squares: of these folds, with it."""
        fitted = account.fitted
        less = self.without(account, at, noise)
        before = self.folds_of(less, noise)
        loss = self.fitter.cost(less.errors, less.point, less.free, less.start, noise) - self.fitter.cost(
            fitted.errors, fitted.point, fitted.free, fitted.start, noise
        )
        needed = loss >= THRESHOLD and self.predicts(before, squares, LEAST_GAIN, loss)
        return less, Weight(before, squares, loss, less.point), needed

    def _round(
        self,
        account: Account,
        refused: set[tuple[str, int]],
        only: set[tuple[str, int]] | None = None,
    ) -> bool:
        """Takes what wins most. only: labels and joints of these forms."""
        best, noise = self.best_beside(account, refused, only=only)
        if not best:
            return False
        taken: dict[int, int] = {}  # the best of each joint; what moves all joints alone
        for k, (_, one, _) in enumerate(best):
            taken.setdefault(one.joint, k)
        taken = {-1: 0} if best[0][1].joint < 0 else {j: k for j, k in taken.items() if j >= 0}
        for k in taken.values():
            one = best[k][1]
            self.fitter.progress(f"{one.effect} {' '.join(one.joints)} is taken")
            account.found.append(one)
            account.refits[one.place] = _rivals(account.fitted, noise, best, k)
        refits = [best[k][1:] for k in taken.values()]
        account.fitted = self.polished(_together(account.fitted, refits), noise)
        refused.clear()
        return True

    def best_beside(
        self,
        account: Account,
        refused: set[tuple[str, int]],
        joint: int | None = None,
        only: set[tuple[str, int]] | None = None,
    ) -> tuple[list[tuple[float, Candidate, Fitted]], Noise]:
        """What may stand beside what was found, refitted, the best first. joint, only: only there, of these
        labels and joints."""
        fitted = account.fitted
        candidates, account.not_testable, base = self.all_candidates(fitted.point, account.sizes)
        there = {c.place for c in account.found}
        candidates = [c for c in candidates if c.place not in there and not self._fitted(fitted, c)]
        if joint is not None:
            here = (joint, -1) if self.joints == 1 else (joint,)
            candidates = [c for c in candidates if c.joint in here]
        if only is not None:
            candidates = [c for c in candidates if (c.label, c.joint) in only]
        if not candidates:
            return [], self.noise_after(fitted)
        with self.fitter.beside(fitted):
            return self._best_of(account, refused, candidates, base)

    def _best_of(
        self,
        account: Account,
        refused: set[tuple[str, int]],
        candidates: Sequence[Candidate],
        base: Floats,
    ) -> tuple[list[tuple[float, Candidate, Fitted]], Noise]:
        fitted = account.fitted
        columns = candidate_columns(self.fitter, fitted.point, base, candidates)
        sums = self.sums(fitted, columns)
        ranks = self.ranked(sums, *_groups(sums, fitted, candidates))[1]
        starts = self.starts(fitted, candidates, sums.noise)
        for k, second in self._starts_elsewhere(account, candidates, sums.noise).items():
            starts[k] = max(starts[k], second, key=lambda one: one[0])
        order = sorted(ranks, key=lambda r: -max(r.score, starts[r.candidate][0]))
        best: list[tuple[float, Candidate, Fitted]] = []
        seen: dict[tuple[str, tuple[str, ...]], int] = {}  # places, and their joints
        for rank in order:
            one, (promised, start) = candidates[rank.candidate], starts[rank.candidate]
            if max(rank.score, promised) < THRESHOLD:
                break
            if self._enough(one, seen):
                continue
            if one.place in seen or (one.label, one.joint) in refused:
                continue
            points = [start] if start is not None else []
            if _plausible(one, rank, fitted.point):
                points.append(_linear_start(one, rank, fitted.point))
            if not points:
                continue
            points.append(one.on(fitted.point))
            seen[one.place] = one.joint
            so_far = max((nats for nats, other, _ in best if other.joint == one.joint), default=0.0)
            gain, refit = self._refit(fitted, one, points, sums.noise, so_far)
            after = self.folds_of(refit, sums.noise)
            before = self.folds_of(fitted, sums.noise)
            fine = gain > THRESHOLD and self.predicts(before, after, LEAST_GAIN, gain)
            fine = fine and self.matters(account.ground, one, fitted, refit)
            if fine and self.carries(one, fitted, refit, sums.noise):
                best.append((gain, one, refit))
            else:
                refused.add((one.label, one.joint))
        best.sort(key=lambda b: -b[0])
        return best, sums.noise

    def starts(
        self, fitted: Fitted, candidates: Sequence[Candidate], noise: Noise
    ) -> list[tuple[float, Point | None]]:
        """Of each candidate of a joint the best of wide steps in its size and in the friction beside it, with
        what is fitted at the joint following as far as its derivatives reach: nats, and where it is."""
        out: list[tuple[float, Point | None]] = [(-math.inf, None)] * len(candidates)
        labels: dict[str, list[int]] = {}
        for k, one in enumerate(candidates):
            labels.setdefault(one.label, []).append(k)
        tried, points = [], []
        for members in labels.values():
            one = candidates[members[0]]
            for number in range(len(_sizes(one))):
                for friction in _FRICTIONS if one.joint >= 0 or self.joints == 1 else _FRICTIONS[:1]:
                    changed = fitted.point
                    for k in members:
                        changed = _wide(candidates[k], changed, number, friction)
                    points.append(changed)
                    tried.append(members)
        follows = [_Follow(fitted, j, noise) for j in range(self.joints)]
        for members, point, motion in zip(tried, points, self.fitter.motions(points), strict=True):
            errors = self.fitter.errors(motion)
            for k in members:
                joint = candidates[k].joint
                here = follows if joint < 0 else [follows[joint]]
                found = [follow.gain(errors, point) for follow in here]
                gain = sum(nats for nats, _ in found)
                if gain > out[k][0]:
                    base = point if joint < 0 else fitted.point
                    for follow, (_, step) in zip(here, found, strict=True):
                        base = follow.moved(base, point, step)
                    out[k] = (gain, base)
        return out

    def _starts_elsewhere(
        self, account: Account, candidates: Sequence[Candidate], noise: Noise
    ) -> dict[int, tuple[float, Point]]:
        """The same from other places, of candidates that belong there: the best few of each are fitted, as
        they have far to go. Nats over the fit."""
        out: dict[int, tuple[float, Point]] = {}
        fitter = self.fitter
        for place in other_places(fitter, account.fitted, account.nominal, account.sizes):
            sizes = sizes_of(fitter.simulator, place.near.point, fitter.rows.windows)
            forms = {(c.label, c.joint): c for c in self.all_candidates(place.near.point, sizes)[0]}
            for joint in place.joints:
                some = {k: forms[c.label, joint] for k, c in enumerate(candidates) if c.joint == joint}
                for k, start in self._starts_near(account.fitted, place, joint, some, noise).items():
                    out[k] = max(out.get(k, start), start, key=lambda one: one[0])
        return out

    def _starts_near(
        self, fitted: Fitted, place: Place, joint: int, forms: Mapping[int, Candidate], noise: Noise
    ) -> dict[int, tuple[float, Point]]:
        """forms: of some candidates, as large as they are usual at this place."""
        fitter, near = self.fitter, place.near
        tried = [(k, number) for k, one in forms.items() for number in range(len(_sizes(one)))]
        chain = fitted.point.chain.copy()
        chain[joint] = near.point.chain[joint]
        base = replace(fitted.point, chain=chain)
        points = [_wide(forms[k], base, number, 1.0) for k, number in tried]
        follow = _Follow(near, joint, noise)
        best: dict[int, tuple[float, list[Point]]] = {}
        for (k, _), point, motion in zip(tried, points, fitter.motions(points), strict=True):
            gain, step = follow.gain(fitter.errors(motion), point)
            if k not in best or gain > best[k][0]:
                best[k] = gain, [follow.moved(fitted.point, point, step), point]
        mine = [k for k, f in enumerate(fitted.free) if f.joint == joint and f.field != place.held]
        free, start = [fitted.free[k] for k in mine], fitted.start[mine]
        every = (fitted.free, fitted.start, noise)
        before = fitter.joint_costs(fitted.errors, fitted.point, *every)[joint]
        out: dict[int, tuple[float, Point]] = {}
        for k in sorted(best, key=lambda k: -best[k][0])[:_NEAR]:
            one = forms[k]
            for point in best[k][1]:
                means = np.array([*start, *(_begin(f, one, point) for f in one.free)])
                fit = fitter.fit(point, [*free, *one.free], means, noise, 2 * _MORE_ROUNDS, shown=False)
                after = fitter.joint_costs(fit.errors, fit.point, *every)[joint]
                if k not in out or before - after > out[k][0]:
                    out[k] = float(before - after), fit.point
        return out

    def _fitted(self, fitted: Fitted, one: Candidate) -> bool:
        names = {(f.field, f.joint, f.body) for f in fitted.free}
        return any((f.field, f.joint, f.body) in names for f in one.free)

    def _refit(
        self, fitted: Fitted, one: Candidate, points: Sequence[Point], noise: Noise, best: float
    ) -> tuple[float, Fitted]:
        """The candidate and what is fitted at its joint, without linearisation: nats that it wins. points:
        where to begin. best: nats of the best refit until now."""
        before = self.fitter.cost(fitted.errors, fitted.point, fitted.free, fitted.start, noise)
        mine = [k for k, f in enumerate(fitted.free) if one.joint < 0 or f.joint == one.joint or f.joint < 0]
        free = [*(fitted.free[k] for k in mine), *one.free]
        doing = f"{one.effect} {' '.join(one.joints)}"
        tries = []
        motions = self.fitter.motions(points)
        costs = [
            self.fitter.cost(self.fitter.errors(m), p, [], np.zeros(0), noise)
            for m, p in zip(motions, points, strict=True)
        ]
        for k in np.argsort(costs, kind="stable")[:_STARTS]:
            point = points[k]
            start = np.array([*(fitted.start[k] for k in mine), *(_begin(f, one, point) for f in one.free)])
            tries.append(self.fitter.fit(point, free, start, noise, _FIRST_ROUNDS, doing, shown=False))
        some = min(tries, key=lambda t: t.cost)
        start = some.start
        others = [k for k in range(len(fitted.free)) if k not in mine]
        every = [*(fitted.free[k] for k in others), *free]
        starts = np.array([*fitted.start[others], *start])
        after = self.fitter.cost(some.errors, some.point, every, starts, noise)
        if before - after > _HOPELESS * best:
            some = self.fitter.fit(some.point, free, start, noise, _MORE_ROUNDS, doing)
            after = self.fitter.cost(some.errors, some.point, every, starts, noise)
        else:
            some.errors, some.columns = self.fitter.columns(some.point, free)
        columns = list(fitted.columns)
        for k, column in zip(mine, some.columns, strict=False):
            columns[k] = column
        some.columns = [*columns, *some.columns[len(mine) :]]
        some.free = [*fitted.free, *one.free]
        some.start = np.array([*fitted.start, *start[len(mine) :]])
        return before - after, some

    def polished(self, refit: Fitted, noise: Noise, rounds: int = _MORE_ROUNDS) -> Fitted:
        return self.fitter.settled(refit.point, refit.free, refit.start, noise, rounds, "all that is named")

    def without(self, account: Account, at: int, noise: Noise) -> Fitted:
        """Everything but one of what was found, refitted at its joint."""
        fitted, one = account.fitted, account.found[at]
        drop = {(f.field, f.joint, f.body) for f in one.free}
        keep = [k for k, f in enumerate(fitted.free) if (f.field, f.joint, f.body) not in drop]
        mine = [k for k in keep if one.joint < 0 or fitted.free[k].joint in (one.joint, -1)]
        point, free = one.off(fitted.point), [fitted.free[k] for k in mine]
        # Usual values have made up for what goes: they may as well begin where they were without any name.
        ground = account.standard if one.label == BUS else account.ground
        known = {(f.field, f.joint, f.body) for f in ground.free}
        other = point
        for f in (f for f in free if (f.field, f.joint, f.body) in known):
            other = f.put(other, f.at(ground.point))
        with self.fitter.beside(fitted):
            tries = [
                self.fitter.fit(p, free, fitted.start[mine], noise, _MORE_ROUNDS, f"without {one.effect}")
                for p in (point, other)
            ]
        some = min(tries, key=lambda t: t.cost)
        columns = list(fitted.columns)
        for k, column in zip(mine, some.columns, strict=True):
            columns[k] = column
        return replace(
            fitted,
            point=some.point,
            free=[fitted.free[k] for k in keep],
            start=fitted.start[keep],
            errors=some.errors,
            columns=[columns[k] for k in keep],
        )


def _rivals(
    fitted: Fitted, noise: Noise, best: Sequence[tuple[float, Candidate, Fitted]], at: int
) -> list[Refit]:
    """Refits that may stand in the place of one of them. What is of the whole arm stands in the place of a
    joint's by what it does at that joint."""
    nats, one, refit = best[at]

    def at_joint(some: Fitted) -> float:
        squares = fitted.errors[:, one.joint] ** 2 - some.errors[:, one.joint] ** 2
        return 0.5 * float(np.sum(squares)) * float(noise.weight[one.joint]) ** 2

    out = []
    for k, (theirs, other, some) in enumerate(best):
        if k == at or not _meet(one, other):
            continue
        whole = one.joint >= 0 > other.joint
        behind = at_joint(refit) - at_joint(some) if whole else nats - theirs
        out.append(Refit(other, max(behind, 0.0), nats))
    return out


def _meet(one: Candidate, other: Candidate) -> bool:
    """Whether one may stand in the other's place: at one joint, or one of them of the whole arm."""
    return one.joint == other.joint or min(one.joint, other.joint) < 0


def _together(fitted: Fitted, refits: Sequence[tuple[Candidate, Fitted]]) -> Fitted:
    """Refits of unlike joints in one. What they saw is that of the last."""
    point, free, start = refits[0][1].point, list(fitted.free), list(fitted.start)
    chain = point.chain.copy()
    for one, refit in refits:
        if one.joint >= 0:
            chain[one.joint] = refit.point.chain[one.joint]
        free += one.free
        start += list(refit.start[len(fitted.free) :])
    return replace(refits[-1][1], point=replace(point, chain=chain), free=free, start=np.array(start))


class _Follow:
    """What is fitted at a joint, following a change by its derivatives: (X'X + P) d = X'e - P (x - start)."""

    def __init__(self, fitted: Fitted, joint: int, noise: Noise) -> None:
        self.joint, self.weight = joint, float(noise.weight[joint])
        mine = [k for k, f in enumerate(fitted.free) if f.joint == joint]
        self.free = [fitted.free[k] for k in mine]
        self.start = fitted.start[mine]
        self.x = np.array([fitted.columns[k][1] for k in mine]) * self.weight
        self.precision = np.array([f.prior**-2 for f in self.free])
        self.most = np.array([_FARTHEST * f.prior for f in self.free])
        self.xx = sums_by_fold([(0, one) for one in self.x], self.x[0][:, None], np.ones(1))[0][0]
        self.inverse = np.linalg.inv(self.xx + np.diag(self.precision + 1e-9))
        away = np.array([f.at(fitted.point) for f in self.free]) - self.start
        self.before = self._cost(float(np.sum((fitted.errors[:, joint] * self.weight) ** 2)), away)

    def _cost(self, squares: float, away: Floats) -> float:
        return 0.5 * (squares + float(np.sum(self.precision * away**2)))

    def gain(self, errors: Floats, point: Point) -> tuple[float, Floats]:
        """Nats, and the steps."""
        e = errors[:, self.joint] * self.weight
        away = np.array([f.at(point) for f in self.free]) - self.start
        right = np.einsum("kn,n->k", self.x, e)
        step = self.inverse @ (right - self.precision * away)
        step = np.clip(step, -self.most, self.most)
        squares = float(np.sum(e**2)) - 2.0 * float(step @ right) + float(step @ self.xx @ step)
        return self.before - self._cost(squares, away + step), step

    def moved(self, base: Point, changed: Point, step: Floats) -> Point:
        """The base with this joint as in `changed`, and the steps."""
        chain = base.chain.copy()
        chain[self.joint] = changed.chain[self.joint]
        return moved(replace(base, chain=chain), self.free, step)


def _sizes(one: Candidate) -> list[float]:
    """In units of the prior, or of where the form begins."""
    if one.begin is not None:
        return [1.0]
    free = one.free[0]
    return [
        s for s in (*_WIDE, *(-w for w in _WIDE)) if free.low <= s * free.prior + one.neutral <= free.high
    ]


def _wide(one: Candidate, point: Point, number: int, friction: float) -> Point:
    """The point with the candidate at a size, and other dry friction."""
    sizes = _sizes(one)
    point = one.on(point)
    if one.begin is None:
        free = one.free[0]
        point = free.put(point, one.neutral + sizes[min(number, len(sizes) - 1)] * free.prior)
    if one.joint < 0:
        chain = point.chain.copy()
        chain[:, FIELDS.index("coulomb")] *= friction
        return replace(point, chain=chain)
    return point.with_value(one.joint, "coulomb", friction * point.value(one.joint, "coulomb"))


def _linear_start(one: Candidate, rank: Rank, point: Point) -> Point:
    point = one.on(point)
    if one.begin is None:
        new = one.free[0]
        change = float(np.clip(rank.values[0], -new.prior, new.prior))
        point = new.put(point, new.at(point) + change)
    return point


def _begin(free: Free, one: Candidate, point: Point) -> float:
    """Mean of a value's prior: neutral, or where the form was looked at."""
    return free.at(point) if one.begin is not None else free.at(one.off(point))


def _groups(
    sums: Sums, fitted: Fitted, candidates: Sequence[Candidate]
) -> tuple[list[list[int]], list[float], Floats]:
    """Columns, costs and priors of the candidates: having looked at all joints and forms of an effect costs
    the log of their number."""
    kinds: dict[str, int] = {}
    for one in candidates:
        kinds[one.effect] = kinds.get(one.effect, 0) + 1
    first = sums.always
    prior = np.array(
        [
            *(f.prior for f in fitted.free),
            *(1.0 if c.begin is not None else c.free[0].prior for c in candidates),
        ]
    )
    return (
        [[first + k] for k in range(len(candidates))],
        [math.log(kinds[c.effect]) for c in candidates],
        prior,
    )


def _plausible(one: Candidate, rank: Rank, point: Point) -> bool:
    """A value that machines have, as the linear account has it; a form that is wanted the other way round
    stands for something else."""
    value = float(rank.values[0])
    if one.begin is not None:
        return 0.1 < value < 5.0
    free = one.free[0]
    at = free.at(one.off(point)) + value
    slack = 0.02 * free.prior
    return free.low - slack <= at <= free.high + slack and abs(value) > 1e-3 * free.prior


def _groups_of_inputs(namer: Namer) -> NDArray[np.intp] | None:
    """Number of each row's group of recordings of one firmware gain; None: there are not three."""
    if "gain" not in namer.data.varies:
        return None
    gains = np.array([float(np.median(s.gain)) for s in namer.data.streams])
    kinds = np.unique(np.round(np.log(np.maximum(gains, 1e-9)), 2), return_inverse=True)[1]
    windows = namer.fitter.rows.windows
    rows = np.array([kinds[w.stream] for w in windows], dtype=np.intp)[namer.fitter.rows.window]
    return rows if np.unique(rows).size >= _LEAST_GROUPS else None


def _resolution(fitter: Fitter) -> Floats:
    """Of each joint's reading: the usual step between distinct values, a part of it. shape=(joints,)"""
    out = []
    for column in fitter.rows.measured.T:
        distinct = np.unique(np.round(column, 9))
        out.append(RESOLUTION * float(np.quantile(np.diff(distinct), 0.05)) if distinct.size > 1 else 1e-6)
    return np.asarray(np.maximum(np.array(out), 1e-7))


# ---- how sure -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Sureness:
    """Of one effect that was found."""

    probability: float  # its own part of its class's
    confounded: tuple[tuple[Candidate, float], ...]  # what could stand in its place, and their parts
    of_class: float  # that it is one of these


def sureness(namer: Namer, account: Account, single: bool) -> list[Sureness]:
    """Posterior of each effect's class against what could stand in its place, linear at the fit."""
    fitted = account.fitted
    if not account.found:
        return []
    candidates, _, base = namer.all_candidates(fitted.point, account.sizes)
    there = {c.place for c in account.found}
    others = [c for c in candidates if c.place not in there and not namer._fitted(fitted, c)]
    columns = candidate_columns(namer.fitter, fitted.point, base, others)
    out = []
    for at, one in enumerate(account.found):
        mine = [k for k, f in enumerate(fitted.free) if f in one.free]
        shown = [fitted.columns[k] for k in mine]
        change = np.array([fitted.free[k].at(fitted.point) for k in mine]) - np.array(
            [f.at(one.off(fitted.point)) for f in one.free]
        )
        if one.begin is not None or not np.isfinite(change).all():  # of a limit: all that it does
            off = namer.fitter.motions([one.off(fitted.point)])[0]
            shown, change = [(-1, base - off)], np.ones(1)
        part = combined(shown, change, base)
        keep = [k for k in range(len(fitted.free)) if k not in mine]
        less = replace(fitted, free=[fitted.free[k] for k in keep], columns=[fitted.columns[k] for k in keep])
        sums = namer.sums(less, [(-1, part), *columns], fitted.errors + part)
        groups, costs, prior = _groups(sums, less, [replace(one, begin=1.0), *others])
        ranks = namer.ranked(sums, groups, costs, prior)[1]
        refits = account.refits.get(one.place, ())
        out.append(_sure(namer.joints, one, others, account.weights[at], ranks, refits, single))
    return out


def _sure(
    joints: int,
    one: Candidate,
    others: Sequence[Candidate],
    weight_of: Weight,
    ranks: Sequence[Rank],
    refits: Sequence[Refit],
    single: bool,
) -> Sureness:
    loss = ranks[0].score
    outside = math.exp(-_TEMPERED * min(loss, 700.0))
    rivals: dict[tuple[str, tuple[str, ...]], tuple[Candidate, float]] = {}
    for refit in refits:
        # Of refits both laws are inexact, and by a part of what they explain.
        weight = math.exp(-refit.behind / max(1.0 / _TEMPERED, INEXACT * refit.best))
        if weight > MEMBER and refit.other.place != one.place:
            rivals[refit.other.place] = (refit.other, weight)
    for rank in sorted(ranks[1:], key=lambda r: -r.score):
        other = others[rank.candidate - 1]
        if other.place in rivals or other.place == one.place or not _meet(one, other):
            continue
        behind = loss - rank.score
        weight = math.exp(-_TEMPERED * max(behind, 0.0))
        if rank.explains_best < _SAME_R2:
            continue
        if behind < _CLASS_NATS or rank.explains_best > _CLASS_R2:
            rivals[other.place] = (other, weight)
        elif behind < _FAR_NATS:
            outside += weight
    in_class = 1.0 + sum(weight for _, weight in rivals.values())
    before, after = weight_of.before, weight_of.after
    gain = float((before - after).sum() / before.sum()) if before.sum() > 0.0 else 0.0
    part = max(0.0, gain) * joints
    law = part**2 / (part**2 + OTHER_LAWS**2)
    if single:
        law = min(law, ONE_RECORDING)
    total = (in_class + outside) / law if law > 0.0 else math.inf
    return Sureness(
        1.0 / total, tuple((other, weight / total) for other, weight in rivals.values()), in_class / total
    )


# ---- what the usual parameters do as well ----------------------------------------------------------
def late(namer: Namer, account: Account) -> list[int]:
    """Joints at which the usual parameters (damping, above all) do what a delay does."""
    fitted = account.fitted
    candidates, _, base = namer.all_candidates(fitted.point, account.sizes)
    some = [c for c in candidates if c.effect == "delay"]
    out = []
    for one, (_, y) in zip(some, candidate_columns(namer.fitter, fitted.point, base, some), strict=True):
        j = one.joint
        mine = [k for k, f in enumerate(fitted.free) if f.joint == j and f.field in USUAL]
        usual = [(0, fitted.columns[k][1]) for k in mine]
        xx, xy, yy, _ = sums_by_fold(usual, y[:, None], np.ones(1))[0]
        scale = np.sqrt(np.maximum(np.diag(xx), 1e-30))
        right = xy / scale
        fit = np.linalg.solve(xx / np.outer(scale, scale) + 1e-6 * np.eye(len(right)), right)
        if yy - float(right @ fit) < (1.0 - _LATE_R2) * yy:
            out.append(j)
    return out
