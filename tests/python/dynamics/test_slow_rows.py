# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of recordings whose rows are far apart, as a controller's log or a bus gives them, the same is named."""

from __future__ import annotations

import numpy as np
import pytest

from truing import _core
from truing.dynamics import Recording, check_recordings, diagnose, predict
from truing.dynamics.recorded import with_rows
from truing.testing import dynamics as testing
from truing.testing.dynamics import simulate_motion

USUAL = ("coulomb", "viscous", "current_offset")
FINE = 0.001  # [s] between steps of the simulation


@pytest.mark.parametrize(("seed", "every"), [(3, 4), (3, 15), (4, 10), (5, 10)])
def test_names_and_values_are_those_of_fast_rows(seed: int, every: int) -> None:
    """Rows 40 to 150 ms apart. With differences in place of a curve, stiction and friction that is not
    linear were named at up to four joints, .9 and surer, an unknown beside them."""
    simulated = simulate_motion(seed=seed, seconds=60.0)
    rows = [with_rows(one, np.arange(len(one)) % every == 0) for one in simulated.recordings]
    checked = check_recordings(simulated.nominal, rows)
    said = [one for one in checked.findings if one.finding != "at_rest"]
    assert [one.finding for one in said] == ["slow_rows"]
    assert said[0].value == pytest.approx(10.0 * every)
    found = diagnose(checked.robot, checked.recordings)
    assert found.cutoff == pytest.approx(min(8.0, 25.0 / every), rel=1e-6)  # a quarter of the rows a second
    named = {one.effect: one for one in found.effects if one.effect not in USUAL}
    assert {(one, tuple(effect.joints)) for one, effect in named.items()} == {
        ("coupling", ("J5", "J6")),
        ("load_friction", ("J2",)),
        ("armature", ("J3",)),
    }
    assert not found.unknown
    assert named["load_friction"].parameters[0].value == pytest.approx(0.09, rel=0.05)
    assert named["armature"].parameters[0].value == pytest.approx(1.6, rel=0.03)
    assert min(one.probability for one in named.values()) > 0.9


def _recorded(seed: int, number: int, step: float, means: bool) -> Recording:
    """The demonstration's arm with dry and viscous friction alone, and noise of half a per cent; torques at
    instants, or means over the time of a row. step: [s] between rows."""
    random = np.random.default_rng([seed, number])
    time = np.arange(0.0, 24.0, FINE)
    q = testing.fourier_motion(time, 6, random)
    qd = np.gradient(q, FINE, axis=0)
    torque = np.asarray(_core.rigid_torques(testing.demo_arm(), q, qd, np.gradient(qd, FINE, axis=0)))
    coulomb, viscous = np.array(testing.USUAL).T
    torque = torque + coulomb * np.sign(qd) + viscous * qd
    every = round(step / FINE)
    usual = torque.std(axis=0)
    if means:
        weights = np.array([0.5, *np.ones(every - 1), 0.5]) / every
        torque = np.column_stack([np.convolve(column, weights, mode="same") for column in torque.T])
    rows = np.arange(every, len(time) - every, every)
    noise = 0.005 * usual * testing.coloured_noise((len(rows), 6), random)
    return Recording(f"motion{number}", time=time[rows], position=q[rows], torque=torque[rows] + noise)


@pytest.mark.parametrize("means", [False, True])
@pytest.mark.parametrize("step", [0.02, 0.04])
@pytest.mark.parametrize("seed", [1, 2])
def test_friction_that_turns_between_rows_is_dry_friction(seed: int, step: float, means: bool) -> None:
    """With rows 20 ms apart, torques at instants were taken for means, and Stribeck's friction was named, .94
    sure; with rows 40 ms apart means were taken for instants, and presliding was named."""
    recordings = [_recorded(seed, number, step, means) for number in range(4)]
    checked = check_recordings(testing.demo_arm(), recordings)
    assert [one.finding for one in checked.findings] == ["slow_rows", *["row_means"] * means]
    assert [one.torque_is_mean for one in checked.recordings] == [means] * 4
    found = diagnose(checked.robot, checked.recordings)
    assert {one.effect for one in found.effects} == set(USUAL)


def test_friction_that_builds_up_over_a_way_is_no_mean_over_rows() -> None:
    """It takes as long as a row does, or longer, at one joint."""
    names = {"presliding.J2": 7.0, "presliding.J2.x0": 0.005}
    simulated = simulate_motion(seed=6, hidden={"presliding": (["J2"], names)})
    rows = [with_rows(one, np.arange(len(one)) % 4 == 0) for one in simulated.recordings]
    checked = check_recordings(simulated.nominal, rows)
    assert "row_means" not in {one.finding for one in checked.findings}


def test_torques_are_predicted_as_they_were_recorded() -> None:
    """Means over a row's time where these were recorded: nearer to them than values at instants are."""
    checked = check_recordings(testing.demo_arm(), [_recorded(3, number, 0.04, True) for number in range(4)])
    robot = diagnose(checked.robot, checked.recordings).robot
    recording = checked.recordings[0]
    errors = [
        np.std(recording.torque - predict(robot, one).torque)
        for one in (recording, recording.replace(torque_is_mean=False))
    ]
    assert errors[0] < 0.7 * errors[1]
