# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which brakes hold the joints are left out, and what is found is what is found without them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from truing.dynamics import CheckedRecordings, Recording, check_recordings, diagnose, predict
from truing.testing.dynamics import NOISE, coloured_noise, simulate_motion

Floats = NDArray[np.float64]
STEP = 0.01  # [s]
HELD, BRAKED, MOVING = (
    0.6,
    1.5,
    1.6,
)  # [s] drives hold the arm, before and after brakes do; from place to place
STOPS = 6
SIMULATED = simulate_motion(recordings=2, held_out=0, seconds=2.0)  # the robots alone
ARM, TRUTH = SIMULATED.nominal, SIMULATED.truth


def path(random: np.random.Generator, braked_for: float) -> tuple[Floats, NDArray[np.bool_]]:
    """From place to place, at rest in between: angles [rad], and where brakes hold them, for so many s."""
    part = np.linspace(0.0, 1.0, round(MOVING / STEP), endpoint=False)[:, None]
    rise = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    places = random.uniform(-1.0, 1.0, (STOPS + 1, 6))
    q, braked = [], []
    for before, after in zip(places[:-1], places[1:], strict=True):
        rest = round((2.0 * HELD + BRAKED) / STEP)
        q += [before + (after - before) * rise, np.repeat(after[None], rest, axis=0)]
        time = STEP * np.arange(rest)
        braked += [np.zeros(len(rise), bool), (time > HELD) & (time < HELD + braked_for)]
    return np.vstack(q), np.concatenate(braked)


def recorded(seed: int, brakes: bool, let_go: float = 0.0) -> tuple[Recording, NDArray[np.bool_]]:
    """let_go: [s] in which torques fade away until the next motion begins; 0: they are nothing at once."""
    random = np.random.default_rng([61, seed])
    q, braked = path(random, BRAKED if let_go == 0.0 else np.inf)
    made = Recording(f"cell{seed}", time=STEP * np.arange(len(q)), position=q)
    torque = np.array(predict(TRUTH, made, cutoff=30.0).torque)
    noise = coloured_noise(torque.shape, random) * NOISE * torque.std(axis=0)
    if brakes:
        begins = np.flatnonzero(np.diff(braked.astype(int)) == 1) + 1
        since = STEP * (np.arange(len(q)) - begins[np.searchsorted(begins, np.arange(len(q)), "right") - 1])
        left = np.exp(-since / let_go) if let_go else np.zeros(len(q))
        torque = np.where(braked[:, None], left[:, None] * torque, torque)
    return made.replace(torque=torque + noise), braked


def checked(brakes: bool, let_go: float = 0.0) -> tuple[CheckedRecordings, list[NDArray[np.bool_]]]:
    recordings, braked = zip(*(recorded(seed, brakes, let_go) for seed in range(4)), strict=True)
    return check_recordings(ARM, recordings), list(braked)


def test_rows_with_the_brakes_on_are_left_out_and_no_others() -> None:
    found, braked = checked(brakes=True)
    said = next(one for one in found.findings if one.finding == "drives_off")
    assert said.applied and not said.mistake
    assert {one.finding for one in found.findings} <= {"drives_off", "at_rest"}
    # A stop in which nothing has to be held is not told from one with brakes, and harms nobody.
    assert said.value == pytest.approx(4 * STOPS * (BRAKED + 0.2), rel=0.1)
    for rows, one in zip(braked, found.recordings, strict=True):
        left = np.isin(STEP * np.arange(len(rows)), np.asarray(one.time))
        assert left[~rows].mean() > 0.85
        assert left[rows].mean() < 0.1


@pytest.mark.parametrize("let_go", [None, 0.5])
def test_of_arms_that_drives_hold_nothing_is_said(let_go: float | None) -> None:
    """Nor of torques that fade, as where a controller's integral takes over what friction held."""
    found, _ = checked(brakes=let_go is not None, let_go=let_go or 0.0)
    assert "drives_off" not in {one.finding for one in found.findings}


def test_what_is_found_is_what_is_found_without_brakes() -> None:
    """With these rows 3.6 kg came and went, and held-out torques were off by more than they vary."""
    names = []
    for brakes in (False, True):
        recordings = [recorded(seed, brakes)[0].replace(test=seed >= 3) for seed in range(5)]
        found = check_recordings(ARM, recordings)
        assert not {one.finding for one in found.findings} & {"load_comes_and_goes", "load_differs"}
        diagnosed = diagnose(found.robot, found.recordings)
        names.append([(one.effect, one.joints) for one in diagnosed.effects])
        (named,) = [model for model in diagnosed.errors if model.model == "named"]
        assert max(joint.percent for joint in named.held_out) < 3.0
    without, with_them = names
    assert with_them[0] == without[0]
    assert {one for one, _ in with_them} <= {one for one, _ in without}


def test_rows_are_left_out_by_the_column_enabled() -> None:
    simulated = simulate_motion(seed=5, seconds=12.0, recordings=2, held_out=1)
    one, other = simulated.recordings
    enabled = np.where(np.asarray(one.time) < 3.0, 0.0, 1.0)
    found = check_recordings(simulated.nominal, [one.replace(columns={"enabled": enabled}), other])
    (said,) = found.findings
    assert said.finding == "drives_off" and said.applied
    assert said.recordings == ("motion1",) and said.value == pytest.approx(3.0, abs=0.01)
    assert np.asarray(found.recordings[0].time)[0] == pytest.approx(3.0)
    assert found.recordings[1] is other


def test_a_recording_with_drives_off_throughout_is_a_mistake() -> None:
    simulated = simulate_motion(seed=5, seconds=12.0, recordings=2, held_out=1)
    one, other = simulated.recordings
    off = one.replace(columns={"enabled": np.zeros(len(one))})
    (said,) = check_recordings(simulated.nominal, [off, other]).findings
    assert said.finding == "drives_off" and said.mistake and "leave it out" in said.evidence
