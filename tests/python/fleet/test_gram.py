# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A Gram adds, refuses what it does not go with, pickles, and comes back from its file bit by bit."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import truing
from truing import _core
from truing.examples import example
from truing.fleet.gram import ErrorCounts
from truing.fleet.passes import chosen_rows


@pytest.fixture(scope="module")
def robot() -> truing.Robot:
    return truing.load_robot(example("ur10"))


@pytest.fixture(scope="module")
def data(robot: truing.Robot) -> truing.Measurements:
    return truing.simulate(robot, poses=301, seed=4).data


def halves(data: truing.Measurements) -> tuple[truing.Measurements, truing.Measurements]:
    rows = np.arange(data.rows)
    return chosen_rows(data, rows[:150]), chosen_rows(data, rows[150:])


def test_grams_of_two_halves_add_to_the_gram_of_all_rows(
    robot: truing.Robot, data: truing.Measurements
) -> None:
    at = truing.fleet.parameters(robot, data)
    one, other = (truing.Gram.of(robot, at, half, scores=True) for half in halves(data))
    added, whole = one + other, truing.Gram.of(robot, at, data, scores=True)
    assert added.values == whole.values == 3 * 301
    assert added.errors.n == 301
    for mine, theirs in ((added.xx, whole.xx), (added.xr, whole.xr), (added.scores, whole.scores)):
        np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-12 * np.abs(theirs).max())
    assert np.array_equal(added.errors.counts, whole.errors.counts)


def test_a_step_on_a_gram_is_a_step_of_least_squares(robot: truing.Robot, data: truing.Measurements) -> None:
    at = {"elbow.a": -0.5723, "wrist_1.d": 0.163941}
    gram = truing.Gram.of(robot, at, data)
    step = np.linalg.solve(gram.xx, -gram.xr)
    moved = truing.Gram.of(robot, dict(zip(at, gram.point + step, strict=True)), data)
    assert moved.rr < gram.rr
    assert np.abs(moved.xr).max() < 1e-3 * np.abs(gram.xr).max()
    robot_there = _core.robot_at(robot, data, gram.names, gram.point + step)
    assert moved.rr == pytest.approx(np.sum(truing.residuals(robot_there, data).position ** 2), rel=1e-9)


def test_grams_that_do_not_go_together_refuse_to_add(robot: truing.Robot, data: truing.Measurements) -> None:
    at = {"elbow.a": -0.5723, "wrist_1.d": 0.163941}
    gram = truing.Gram.of(robot, at, data)
    with pytest.raises(truing.InputError, match=r"other parameters do not add.*wrist_1\.d"):
        gram + truing.Gram.of(robot, {"elbow.a": -0.5723}, data)
    with pytest.raises(truing.InputError, match=r"elbow\.a is -0.5723 in one and -0.57 in the other"):
        gram + truing.Gram.of(robot, {**at, "elbow.a": -0.57}, data)
    longer = robot.copy()
    longer.joint("elbow").d += 1e-6
    with pytest.raises(truing.InputError, match="another robot, weighing or version"):
        gram + truing.Gram.of(longer, at, data)
    with pytest.raises(truing.InputError, match="another robot, weighing or version"):
        gram + truing.Gram.of(robot, at, data, rotation_length=0.2)


def test_a_gram_survives_pickling_and_its_file(
    robot: truing.Robot, data: truing.Measurements, tmp_path: Path
) -> None:
    gram = truing.Gram.of(robot, truing.fleet.parameters(robot, data), data, scores=True)
    assert pickle.loads(pickle.dumps(gram)) == gram
    gram.save(tmp_path / "rows.gram")
    back = truing.Gram.load(tmp_path / "rows.gram")
    assert back == gram
    assert (back + gram).values == 2 * gram.values


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 broken", b"q1_rad,x_m\n1,2\n"])
def test_a_file_that_holds_no_gram_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rows.gram"
    path.write_bytes(content)
    with pytest.raises(truing.InputError, match=r"rows\.gram: is not a Gram file"):
        truing.Gram.load(path)


def test_a_file_of_another_format_or_with_a_part_missing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rows.gram"
    with path.open("wb") as file:
        np.savez(file, format=np.array("truing-gram/9"))
    with pytest.raises(truing.InputError, match="found truing-gram/9, expected the format truing-gram/1"):
        truing.Gram.load(path)
    with path.open("wb") as file:
        np.savez(file, format=np.array("truing-gram/1"), names=np.array(["J1.a"]))
    with pytest.raises(truing.InputError, match="'units': found no such array"):
        truing.Gram.load(path)


def test_quantiles_of_a_histogram_are_right_to_two_per_cent() -> None:
    lengths = np.linalg.norm(np.random.default_rng(3).normal(size=(20_000, 3)), axis=1) * 1e-4
    counts = ErrorCounts.of(lengths)
    for share in (0.1, 0.5, 0.95):
        assert counts.quantile(share) == pytest.approx(np.quantile(lengths, share), rel=0.02)
    assert counts.rms == pytest.approx(np.sqrt(np.mean(lengths**2)), rel=1e-12)
    assert (counts + counts).n == 40_000
    assert counts.largest == lengths.max()
    assert np.isnan(ErrorCounts.of(np.full(3, np.nan)).rms)
