# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Intervals hold the truth as often as they say: simulated tests of a known robot, every quantity.

The slow test asks for 93 to 97 % of 500 tests that no interval was chosen by; the quick one, of 40, only
catches what is broken. As a program it prints the shares of these 500:

    python tests/python/performance/test_coverage.py
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from truing.performance import intervals
from truing.performance.quantities import drift

Floats = NDArray[np.float64]
Random = np.random.Generator
COVARIANCE = 1.5e-10 * np.array([[1.2, 0.3, 0.0], [0.3, 0.8, 0.2], [0.0, 0.2, 0.5]])  # [m^2]: about 0.01 mm
ROOT = np.linalg.cholesky(COVARIANCE)
UNSEEN = 400_000  # number of the first test that nothing was chosen by
POINTS = 40
ALONG = np.linspace(0, 1, POINTS)
HOURS = np.linspace(0, 8, 24)
WARMTH = 1 - np.exp(-HOURS / 1.5)


def scatter(rng: Random, *shape: int) -> Floats:
    """Deviations of attained positions [m]."""
    return np.asarray(rng.standard_normal((*shape, 3)) @ ROOT.T)


def true_repeatability() -> float:
    """RP of the population, by the formula on a million draws."""
    lengths = np.linalg.norm(scatter(np.random.default_rng(11), 1_000_000), axis=-1)
    return float(lengths.mean() + 3 * lengths.std())


RP = true_repeatability()


def path_scatter(rng: Random) -> Floats:
    """Ten cycles: neighbouring points of a cycle go together, over about a sixth of the path."""
    together = np.exp(-np.abs(ALONG[:, None] - ALONG) / 0.15)
    root = np.linalg.cholesky(together + 1e-9 * np.eye(POINTS))
    return np.asarray(np.einsum("ij,njk->nik", root, scatter(rng, 10, POINTS)))


CORNER = np.exp(-(((ALONG - 0.5) / 0.08) ** 2))
OFF_PATH = 3e-4 * np.stack([0 * ALONG, CORNER, 0.2 * ALONG], axis=1)
ROUGH = 1 + CORNER
APART = 2e-5 * np.array([[0.0, 0, 0], [1, 0, 0], [0.3, 0.5, 0]])
OFF = np.array([2e-4, 1e-4, -1e-4])
MOVED = 1e-4 * np.outer(WARMTH, [1.0, 0.3, -0.2])
SETTLING = 2 - WARMTH


@dataclass(frozen=True)
class Case:
    """How a test is simulated, its interval, and what is true."""

    sample: Callable[[Random], Floats]
    interval: Callable[[Floats, Random], intervals.Interval]
    truth: float


CASES = {
    "AP": Case(lambda rng: OFF / 4 + scatter(rng, 30), intervals.length_interval, np.linalg.norm(OFF / 4)),
    "AP_a": Case(lambda rng: 1e-4 + 5e-5 * rng.standard_normal(30), intervals.mean_interval, 1e-4),
    "RP": Case(lambda rng: scatter(rng, 30), intervals.repeatability_interval, RP),
    "RP_a": Case(lambda rng: 5e-5 * rng.standard_normal(30), intervals.deviation_interval, 1.5e-4),
    "vAP": Case(
        lambda rng: APART[:, None] + scatter(rng, 3, 30),
        lambda found, rng: intervals.directions_interval(list(found), rng),
        2e-5,
    ),
    "AD": Case(lambda rng: -3e-4 + 2e-5 * rng.standard_normal(30), intervals.mean_interval, -3e-4),
    "RD": Case(lambda rng: 0.8 + 2e-5 * rng.standard_normal(30), intervals.deviation_interval, 6e-5),
    "AT": Case(
        lambda rng: OFF_PATH + path_scatter(rng),
        intervals.path_interval,
        float(np.linalg.norm(OFF_PATH, axis=1).max()),
    ),
    "RT": Case(
        lambda rng: ROUGH[:, None] * path_scatter(rng),
        intervals.path_repeatability_interval,
        RP * float(ROUGH.max()),
    ),
    "dAP": Case(
        lambda rng: (OFF + MOVED)[:, None] + scatter(rng, 24, 10),
        lambda found, rng: intervals.accuracy_drift_interval(found, 3600 * HOURS, rng),
        float(drift(np.linalg.norm(OFF + MOVED, axis=1))),
    ),
    "travel": Case(
        lambda rng: (OFF + MOVED)[:, None] + scatter(rng, 24, 10),
        lambda found, rng: intervals.travel_interval(found, 3600 * HOURS, rng),
        float(np.linalg.norm(MOVED, axis=1).max()),
    ),
    "dRP": Case(
        lambda rng: SETTLING[:, None, None] * scatter(rng, 24, 10),
        lambda found, rng: intervals.repeatability_drift_interval(found, 3600 * HOURS, rng),
        RP * float(drift(SETTLING)),
    ),
}


def coverage(case: Case, runs: int, first: int = 0) -> float:
    """The share of simulated tests, numbered from `first` on, whose interval holds the truth."""
    held = 0
    for run in range(first, first + runs):
        low, high = case.interval(case.sample(np.random.default_rng([run, 7])), np.random.default_rng(run))
        held += low <= case.truth <= high
    return held / runs


@pytest.mark.parametrize("name", sorted(CASES))
def test_an_interval_holds_the_truth(name: str) -> None:
    assert 0.85 <= coverage(CASES[name], 20 if name in ("AT", "RT", "dRP", "travel") else 40)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_an_interval_of_95_percent_holds_the_truth_in_93_to_97(name: str) -> None:
    assert 0.93 <= coverage(CASES[name], 500, UNSEEN) <= 0.97


@pytest.mark.slow
@pytest.mark.parametrize(("name", "least"), [("uniform", 0.93), ("heavy", 0.88)])
def test_a_scatter_that_is_not_normal_is_held_nearly_as_often(name: str, least: float) -> None:
    """The price of normal draws, told in the guide."""

    def draw(rng: Random, rows: int) -> Floats:
        found = rng.uniform(-1, 1, (rows, 3)) if name == "uniform" else rng.standard_t(6, (rows, 3))
        return np.asarray(1e-5 * found)

    lengths = np.linalg.norm(draw(np.random.default_rng(11), 1_000_000), axis=-1)
    truth = float(lengths.mean() + 3 * lengths.std())
    case = Case(lambda rng: draw(rng, 30), intervals.repeatability_interval, truth)
    assert least <= coverage(case, 500, UNSEEN) <= 0.97


def test_an_accuracy_of_nothing_has_an_interval_from_zero() -> None:
    low, high = intervals.length_interval(scatter(np.random.default_rng(5), 30), np.random.default_rng(6))
    assert low == 0 and 0 < high < 2e-5


def test_a_repeatability_that_stays_may_have_no_drift() -> None:
    """Of 24 blocks of ten the most different ones differ by a third, by chance alone."""
    blocks = scatter(np.random.default_rng(5), 24, 10)
    low, high = intervals.repeatability_drift_interval(blocks, 3600 * HOURS, np.random.default_rng(6))
    assert low == 0 and high > 0


def test_intervals_are_the_same_again() -> None:
    sample = scatter(np.random.default_rng(5), 30)
    first, again = (intervals.repeatability_interval(sample, np.random.default_rng(6)) for _ in range(2))
    assert first == again


def test_intervals_scale_with_the_unit() -> None:
    sample = scatter(np.random.default_rng(5), 30)
    metres = intervals.repeatability_interval(sample, np.random.default_rng(6))
    millimetres = intervals.repeatability_interval(1e3 * sample, np.random.default_rng(6))
    assert millimetres == pytest.approx([1e3 * end for end in metres], rel=1e-9)


if __name__ == "__main__":
    for quantity in CASES:
        sys.stdout.write(f"{quantity:8}{100 * coverage(CASES[quantity], 500, UNSEEN):.1f} %\n")
        sys.stdout.flush()
