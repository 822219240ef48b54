# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""95 % intervals of the characteristics, by the bootstrap with draws from the normal distribution that the
sample suggests.

Thirty cycles, or ten, are few: the ordinary bootstrap of RP (percentiles, BCa) holds the truth in 85 % of
cases. Three forms are used:

- *studentized* (Efron and Tibshirani 1993, 12.5, on the logarithm): of repeatabilities and distances. The
  standard error is taken from the sample's own kurtosis, its distribution from normal draws.
- *test inversion* (Carpenter 1999): of lengths and of maxima, which are biased upwards and end at zero. The
  interval holds every size at which what was observed is no rare outcome, above or below.
- the *profile* of a maximum over many points (RT, dRP) is first drawn towards its mean by as much as chance
  alone would spread it (empirical Bayes): else the largest of ten would be taken for larger than it is. RT's
  upper end leaves it as found: else one point that is much worse than its neighbours would be averaged away.

Coverage, measured: tests/python/performance/test_coverage.py and docs/guide/performance.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from truing.performance.quantities import (
    drift,
    largest_distance,
    lengths_from_barycentre,
    pose_repeatability,
    three_deviations,
)

Floats = NDArray[np.float64]
Interval = tuple[float, float]
DRAWS = 1000
TAIL = 0.025
_KNOWN_TAIL = 0.1  # beyond the end as if the place of a maximum were known: it is not, so that less is beyond
_KNOWN_RATIO_TAIL = 0.15  # the same where errors are factors: their distribution leans to the far side
_UNEVEN_TAIL = 0.015  # beyond the end of a profile that chance made more uneven than it is
_NORMAL_TENTH = 1.2816  # above it lies a tenth of the normal distribution, as beyond that end
_STEPS = 26  # of the bisection: the end of an interval to 1e-7 of the bracket
_LENGTH_DRAWS = 4000
_LARGEST_SIZE = 1e6  # of the bisection: here the interval is as good as open
_FEWEST_BLOCKS = 8  # of a warm-up that a curve of five numbers is put through
_RATES = (
    3.0,
    10.0,
    30.0,
)  # exponentials of a warm-up's curve: settled after the whole, a third, a tenth of it
_RANK = 1e-6  # of the largest singular value: curves that short warm-ups cannot tell apart


# ---- The three forms ---------------------------------------------------------------------------------------


def studentized(value: float, error: float, drawn: Floats, drawn_errors: Floats, centre: float) -> Interval:
    """Interval of a positive quantity, on its logarithm.

    drawn, drawn_errors: values and standard errors of samples from a population in which the quantity is
    `centre`.
    """
    if value <= 0 or error <= 0:
        return value, value
    pivots = np.log(drawn / centre) * drawn / drawn_errors
    low, high = np.quantile(pivots, [TAIL, 1 - TAIL])
    return float(value * np.exp(-high * error / value)), float(value * np.exp(-low * error / value))


def inverted(observed: float, truth: Callable[[float], float], drawn: Callable[[float], Floats]) -> Interval:
    """All truths under which `observed` lies in neither tail of what is drawn. `truth` and `drawn` are
    functions of a size from 0 on; the truth grows with it. The draws use the same random numbers each time.
    """
    low = 0.0
    if np.mean(drawn(0.0) >= observed) < TAIL:
        low = _bisect(lambda size: bool(np.mean(drawn(size) >= observed) < TAIL))
    high = _bisect(lambda size: bool(np.mean(drawn(size) <= observed) >= TAIL))
    return truth(low), truth(high)


def _bisect(below: Callable[[float], bool]) -> float:
    """The size at which `below` ends to be true."""
    low, high = 0.0, 1.0
    while below(high) and high < _LARGEST_SIZE:
        low, high = high, 2.0 * high
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) else (low, middle)
    return 0.5 * (low + high)


def mean_errors(samples: Floats, rng: np.random.Generator) -> Floats:
    """Draws of the error of a mean over the first axis, shape=(draws, ...) of (n, ...), all entries of a
    sample together: normal with the sample's covariance, widened as Student's t for it was estimated.
    """
    n = len(samples)
    centred = (samples - samples.mean(axis=0)).reshape(n, -1)
    weights = rng.standard_normal((DRAWS, n))
    widening = np.sqrt((n - 1) / rng.chisquare(n - 1, DRAWS))
    drawn = (weights * widening[:, None]) @ centred / np.sqrt(n * (n - 1))
    return np.asarray(drawn.reshape(DRAWS, *samples.shape[1:]))


# ---- Quantities --------------------------------------------------------------------------------------------


def length_interval(offsets: Floats, rng: np.random.Generator) -> Interval:
    """Of the length of a mean, AP: offsets from the commanded position, shape=(n, 3) [m]."""
    mean, errors = offsets.mean(axis=0), mean_errors(offsets, rng)
    length = float(np.linalg.norm(mean))
    return inverted(
        length, lambda size: size * length, lambda size: np.linalg.norm(size * mean + errors, axis=-1)
    )


def mean_interval(values: Floats, rng: np.random.Generator) -> Interval:
    """Of a mean that may be negative, AD and the angles of AP: shape=(n,)."""
    low, high = np.quantile(mean_errors(values[:, None], rng)[:, 0], [TAIL, 1 - TAIL])
    return float(values.mean() - high), float(values.mean() - low)


def repeatability_interval(attained: Floats, rng: np.random.Generator) -> Interval:
    """Of RP: shape=(n, 3) [m]."""
    scale = float(np.abs(attained - attained.mean(axis=0)).max())
    if scale == 0:
        return 0.0, 0.0
    sample = (attained - attained.mean(axis=0)) / scale
    covariance = np.cov(sample.T)
    drawn = rng.standard_normal((DRAWS, *sample.shape)) @ _root(covariance)
    low, high = studentized(
        float(pose_repeatability(sample)),
        float(_repeatability_error(sample)),
        pose_repeatability(drawn),
        _repeatability_error(drawn),
        float(normal_repeatability(covariance, rng)),
    )
    return scale * low, scale * high


def deviation_interval(values: Floats, rng: np.random.Generator) -> Interval:
    """Of three standard deviations, RD and the angles of RP: shape=(n,)."""
    drawn = rng.standard_normal((DRAWS, len(values)))
    value = float(three_deviations(values))
    return studentized(
        value, float(_deviation_error(values)), three_deviations(drawn), _deviation_error(drawn), 3.0
    )


def directions_interval(directions: Sequence[Floats], rng: np.random.Generator) -> Interval:
    """Of vAP: for every direction the attained positions, shape=(n, 3) [m]."""
    means = [attained.mean(axis=0) for attained in directions]
    errors = [mean_errors(attained, rng) for attained in directions]
    middle = np.mean(means, axis=0)
    observed = float(largest_distance(means))
    if observed == 0:
        return 0.0, 0.0
    low, high = inverted(
        observed,
        lambda size: size * observed,
        lambda size: largest_distance(
            [size * (mean - middle) + error for mean, error in zip(means, errors, strict=True)]
        ),
    )
    i, j = max(combinations(range(len(means)), 2), key=lambda k: np.linalg.norm(means[k[0]] - means[k[1]]))
    along = (errors[i] - errors[j]) @ (means[i] - means[j]) / observed
    return low, max(high, observed + float(np.quantile(along, 1 - _KNOWN_TAIL)))


def path_interval(offsets: Floats, rng: np.random.Generator) -> Interval:
    """Of AT: offsets from the commanded path, shape=(n, m, 3) [m]."""
    mean, errors = offsets.mean(axis=0), mean_errors(offsets, rng)
    observed = float(np.linalg.norm(mean, axis=-1).max())
    return inverted(
        observed,
        lambda size: size * observed,
        lambda size: np.linalg.norm(size * mean + errors, axis=-1).max(axis=-1),
    )


def path_repeatability_interval(attained: Floats, rng: np.random.Generator) -> Interval:
    """Of RT: shape=(n, m, 3) [m]."""
    points = np.moveaxis(attained, 0, 1)
    found = pose_repeatability(points)
    if found.min() <= 0:
        return float(found.max()), float(found.max())
    n = len(attained)
    centred = (attained - attained.mean(axis=0)).reshape(n, -1)
    true = np.array([normal_repeatability(np.cov(point.T), rng) for point in points])
    ratios = np.empty((DRAWS, len(points)))
    for k in range(DRAWS):  # all points of a cycle are drawn together: neighbours go together
        drawn = (rng.standard_normal((n, n)) @ centred / np.sqrt(n - 1)).reshape(attained.shape)
        ratios[k] = pose_repeatability(np.moveaxis(drawn, 0, 1)) / true
    # The more even a profile, the more its largest value grows by chance. The lower end is of the profile
    # without what chance made uneven; the upper end of the profile as found, in which a point that is much
    # worse than its neighbours stays so. Chance has made that too uneven in part, so that more is beyond.
    even = np.exp(_shrunk(np.log(found / found.mean()), np.log(ratios)))
    high = np.quantile(_growth(even, ratios), 1 - TAIL)
    low = np.quantile(_growth(found, ratios), _UNEVEN_TAIL)
    return float(found.max() * np.exp(-high)), float(found.max() * np.exp(-low))


def _growth(profile: Floats, ratios: Floats) -> Floats:
    """Logarithm of what chance makes of a profile's largest value, shape=(draws,)."""
    return np.asarray(np.log((profile * ratios).max(axis=1) / profile.max()))


def accuracy_drift_interval(offsets: Floats, time: Floats, rng: np.random.Generator) -> Interval:
    """Of dAP: offsets from the commanded position, shape=(blocks, n, 3) [m]; time of the blocks [s]."""
    means = offsets.mean(axis=1)
    lengths = np.linalg.norm(means, axis=-1)
    along = means / np.maximum(lengths, 1e-300)[:, None]
    errors = np.einsum("kbi,bi->kb", _block_errors(offsets, rng), along)
    moved = warm_up_curve(time, means)
    changed = np.linalg.norm((means - moved).mean(axis=0) + moved, axis=-1)
    changed -= changed[0]
    low, high = inverted(
        float(drift(lengths)),
        lambda size: size * float(drift(changed)),
        lambda size: drift(size * changed + errors),
    )
    return low, max(high, _end_at_largest(changed, errors))


def travel_interval(positions: Floats, time: Floats, rng: np.random.Generator) -> Interval:
    """Of how far the barycentre moved since the first block: shapes as in `accuracy_drift_interval`."""
    means, errors = positions.mean(axis=1), _block_errors(positions, rng)
    moved = warm_up_curve(time, means)
    shaken = errors - errors[:, :1]
    return inverted(
        float(np.linalg.norm(means - means[0], axis=-1).max()),
        lambda size: float(size * np.linalg.norm(moved, axis=-1).max()),
        lambda size: np.linalg.norm(size * moved + shaken, axis=-1).max(axis=-1),
    )


def repeatability_drift_interval(positions: Floats, time: Floats, rng: np.random.Generator) -> Interval:
    """Of dRP: shapes as in `accuracy_drift_interval`."""
    found = pose_repeatability(positions)
    if found.min() <= 0:
        return float(drift(found)), float(drift(found))
    ratios = np.empty((DRAWS, len(positions)))
    for k, block in enumerate(positions):
        covariance = np.cov(block.T)
        drawn = rng.standard_normal((DRAWS, *block.shape)) @ _root(covariance)
        ratios[:, k] = pose_repeatability(drawn) / normal_repeatability(covariance, rng)
    logarithms = np.log(found)
    shape = warm_up_curve(time, logarithms[:, None])[:, 0]
    shape -= shape.mean()
    level = float(np.exp(logarithms.mean() - np.log(ratios).mean()))
    low, high = inverted(
        float(drift(found)),
        lambda size: level * float(drift(np.exp(size * shape))),
        lambda size: level * drift(np.exp(size * shape) * ratios),
    )
    return low, max(high, _end_of_ratios(level * np.exp(shape), ratios))


def _end_at_largest(curve: Floats, drawn: Floats) -> float:
    """Upper end of the change where the smooth curve changed most: where two places change about as much, the
    inversion alone ends too low.
    """
    place = int(np.argmax(np.abs(curve - curve[0])))
    deviation = float((drawn[:, place] - drawn[:, 0]).std())
    return float(abs(curve[place] - curve[0])) + _NORMAL_TENTH * deviation


def _end_of_ratios(curve: Floats, ratios: Floats) -> float:
    """The same of a curve whose errors are factors: what was found too small by a factor was drawn with a
    small scatter too, so that the truth is the value over the factor (a pivot), not the value times it.
    """
    place = int(np.argmax(np.abs(curve - curve[0])))
    changes = np.abs(curve[place] / ratios[:, place] - curve[0] / ratios[:, 0])
    return float(np.quantile(changes, 1 - _KNOWN_RATIO_TAIL))


# ---- Parts -------------------------------------------------------------------------------------------------


def warm_up_curve(time: Floats, values: Floats) -> Floats:
    """What values changed by since the first block, without their noise: a straight line and three
    exponentials through them, zero at the first block, shape=(blocks, k). Fewer than eight blocks stay as
    they are.
    """
    if len(time) < _FEWEST_BLOCKS:
        return np.asarray(values - values[0])
    passed = (time - time[0]) / max(float(time[-1] - time[0]), 1e-9)
    curves = [passed, *(1 - np.exp(-passed * rate) for rate in _RATES)]
    basis = np.column_stack([np.ones_like(passed), *curves])
    found = np.linalg.lstsq(basis, values, rcond=_RANK)[0]
    return np.asarray(basis[:, 1:] @ found[1:])


def normal_repeatability(covariance: Floats, rng: np.random.Generator) -> float:
    """RP of a normal population: E l + 3 sqrt(E l^2 - (E l)^2), E l^2 the trace, E l by drawing."""
    variances = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    squares = rng.standard_normal((_LENGTH_DRAWS, len(variances))) ** 2 @ variances
    # The mean of the squares is known: it corrects for what of the draws came out too long or too short.
    mean = float(np.sqrt(squares).mean() * np.sqrt(variances.sum() / squares.mean()))
    return mean + 3.0 * float(np.sqrt(max(variances.sum() - mean**2, 0.0)))


def _root(covariance: Floats) -> Floats:
    """A matrix whose product with standard normal rows has this covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _repeatability_error(attained: Floats) -> Floats:
    """Standard error of RP by the influence of every length on mean and standard deviation."""
    lengths = lengths_from_barycentre(attained)
    away = lengths - lengths.mean(axis=-1, keepdims=True)
    deviation = lengths.std(axis=-1, ddof=1, keepdims=True)
    influence = away + 3.0 * (away**2 - deviation**2) / (2.0 * np.maximum(deviation, 1e-300))
    return np.asarray(np.sqrt((influence**2).mean(axis=-1) / (lengths.shape[-1] - 1)))


def _deviation_error(values: Floats) -> Floats:
    """Standard error of three standard deviations, likewise."""
    away = values - values.mean(axis=-1, keepdims=True)
    deviation = values.std(axis=-1, ddof=1, keepdims=True)
    influence = 3.0 * (away**2 - deviation**2) / (2.0 * np.maximum(deviation, 1e-300))
    return np.asarray(np.sqrt((influence**2).mean(axis=-1) / (values.shape[-1] - 1)))


def _shrunk(profile: Floats, drawn: Floats) -> Floats:
    """A profile drawn towards its mean by the spread that it would have were it flat (James and Stein)."""
    spread = float(profile.var())
    by_chance = float((drawn - drawn.mean(axis=0)).var(axis=1).mean())
    kept = max(0.0, 1.0 - by_chance / spread) if spread > 0 else 0.0
    return np.asarray(profile.mean() + kept * (profile - profile.mean()))


def _block_errors(positions: Floats, rng: np.random.Generator) -> Floats:
    """Draws of the errors of the blocks' means, shape=(draws, blocks, 3), of one covariance for all."""
    blocks, n, _ = positions.shape
    centred = (positions - positions.mean(axis=1, keepdims=True)).reshape(-1, 3)
    covariance = centred.T @ centred / (blocks * (n - 1))
    return np.asarray(rng.standard_normal((DRAWS, blocks, 3)) @ _root(covariance) / np.sqrt(n))
