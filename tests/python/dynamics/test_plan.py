# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Motions that tell effects on torques apart: within limits, the same every time, and better than others."""

from __future__ import annotations

import numpy as np
import pytest

from truing.dynamics import Recording, TorqueOutlook, TorquePlan, identify, plan, predict
from truing.errors import InputError
from truing.model import AppliedEffect
from truing.testing.dynamics import USUAL, demo_arm, fourier_motion

ARM = demo_arm()
QUICK = {"duration": 12.0, "starts": 3, "rounds": 3, "seed": 5}


@pytest.fixture(scope="module")
def planned() -> TorquePlan:
    return plan(ARM, columns="current,payload", **QUICK)


def sizes(outlook: TorqueOutlook) -> dict[tuple[str, ...], float]:
    return {(e.effect, *e.joints): e.size for e in outlook.effects}


def test_the_motion_keeps_the_limits_and_begins_and_ends_at_rest(planned: TorquePlan) -> None:
    assert planned.time[-1] == pytest.approx(12.0) and len(planned.time) == 1201
    assert np.abs(planned.position).max() <= 1.5 + 1e-9
    assert np.abs(planned.speed).max() <= 0.8 * 1.5 + 1e-9
    assert np.abs(planned.acceleration).max() <= 5.0 + 1e-6
    assert np.abs(planned.speed[[0, -1]]).max() < 1e-3


def test_a_joint_with_little_room_stays_within_it() -> None:
    narrow = ARM.copy()
    narrow.joints[1].lower, narrow.joints[1].upper, narrow.joints[1].speed_limit = -0.4, 0.1, 0.3
    one = plan(narrow, **{**QUICK, "starts": 1, "rounds": 0})
    assert -0.4 < one.position[:, 1].min() and one.position[:, 1].max() < 0.1
    assert np.abs(one.speed[:, 1]).max() <= 0.8 * 0.3 + 1e-9


def test_the_same_seed_gives_the_same_motion_on_any_number_of_threads(planned: TorquePlan) -> None:
    again = plan(ARM, columns="current,payload", threads=1, **QUICK)
    assert np.array_equal(again.position, planned.position)
    assert again.information == planned.information


def test_the_plan_brings_more_than_the_random_motion_it_began_with(planned: TorquePlan) -> None:
    assert planned.information > planned.information_random + 5.0
    assert planned.evaluated == 3 + 4 * 3


def test_sizes_scale_with_the_noise() -> None:
    options = {**QUICK, "starts": 1, "rounds": 0}
    one, three = (sizes(plan(ARM, noise=noise, **options).planned) for noise in (0.01, 0.03))
    for key in set(one) & set(three):
        assert three[key] == pytest.approx(3.0 * one[key], rel=0.02), key


def test_a_promised_size_is_three_or_more_standard_errors_of_a_fit() -> None:
    # Oracle: the same columns through identify, on torques with white noise of the promised size.
    option = {"noise_time": 0.0, **QUICK, "starts": 1, "rounds": 0}
    one = plan(ARM, torque_noise=[0.5] * 6, cutoff=8.0, **option)
    truth = ARM.copy()
    truth.torque_effects = [
        AppliedEffect(effect, [f"J{k}"], {f"{effect}.J{k}": value})
        for k, values in enumerate(USUAL, 1)
        for effect, value in zip(("coulomb", "viscous"), values, strict=True)
    ]
    recordings = []
    for seed in range(4):
        random = np.random.default_rng([1, seed])
        bare = Recording(f"m{seed}", time=one.time, position=one.position)
        torque = np.asarray(predict(truth, bare, cutoff=30.0).torque)
        # White at 100 Hz: what passes 8 Hz has a sixth of its variance.
        recordings.append(
            bare.replace(
                torque=torque + random.normal(size=torque.shape) * 0.5 * np.sqrt(50 / 8), test=seed > 2
            )
        )
    fit = identify(ARM, recordings, effects="coulomb,viscous,current_offset,asymmetric_friction:J3")
    sigma = next(p.sigma for p in fit.parameters if p.name == "asymmetric_friction.J3")
    promised = next(e for e in one.planned.effects if e.parameter == "asymmetric_friction.J3")
    # Three training recordings: standard errors are smaller by their root. A diagnosis asks for some 4.4,
    # and identify counts filtered rows a little less than one each.
    assert 3.0 < promised.size / (np.sqrt(3.0) * sigma) < 5.0


def test_what_is_inherent_is_said_not_promised(planned: TorquePlan) -> None:
    without = plan(ARM, **{**QUICK, "starts": 1, "rounds": 0})
    why = {(n.effect, *n.joints): n.why for n in without.planned.not_testable}
    assert "known payload" in why[("motor_constant",)]
    assert not any(key[0] == "motor_constant" for key in sizes(without.planned))
    assert "payload_kg" in why[("payload_place",)]
    assert "link inertias" in why[("armature", "J1")]
    assert "link inertias" in why[("payload",)]
    assert any(key[0] == "thermal_friction" and "temp_C" in text for key, text in why.items())
    with_payload = sizes(planned.planned)
    assert ("motor_constant", "J2") in with_payload and ("payload_place",) in with_payload


def test_recordings_that_are_there_are_told_what_they_lack() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    still = np.full((time.size, 6), 0.3)
    still[:, 0] = 0.5 * np.sin(time)
    given = plan(
        ARM, [Recording("one joint", time=time, position=still)], **{**QUICK, "starts": 1, "rounds": 0}
    ).given
    seen = sizes(given)
    assert any(key[1:] == ("J1",) for key in seen) and not any(key[1:] == ("J2",) for key in seen)
    assert any(n.effect == "thermal_friction" for n in given.not_testable)


def test_asked_for_pairs_are_told_apart_better_than_by_chance() -> None:
    options = {**QUICK, "separate": "load_friction:J2,position_friction:J2", "rounds": 8}
    asked = plan(ARM, **options)
    assert {p.effect for p in asked.separated} == {"load_friction", "position_friction"}
    assert asked.information > asked.information_random + 0.5
    assert all(e.size_apart is not None and e.size_apart >= e.size for e in asked.planned.effects)
    assert {e.effect for e in asked.planned.effects} == {"load_friction", "position_friction"}
    assert {n.effect for n in asked.planned.not_testable} <= {"load_friction", "position_friction"}


@pytest.mark.slow
def test_a_fit_along_the_planned_motion_is_surer_than_along_random_ones() -> None:
    planned = plan(ARM, duration=24.0, starts=3, rounds=2, seed=1)
    time = np.asarray(planned.time)
    asked = {"stribeck": {"stribeck.J2.vs": 0.12}, "presliding": {"presliding.J2.x0": 0.01}}
    for effect in asked:
        plans, randoms = [], []
        for seed in range(3):
            other = fourier_motion(time, 6, np.random.default_rng([2, seed]))
            for position, out in ((np.asarray(planned.position), plans), (other, randoms)):
                out.append(_sigma(time, position, effect, seed))
        assert np.median(plans) < 0.7 * np.median(randoms), effect


def _sigma(time: np.ndarray, position: np.ndarray, effect: str, seed: int) -> float:
    """Standard error of the effect at J2, fitted to three recordings of the motion."""
    truth = ARM.copy()
    truth.torque_effects = [
        AppliedEffect(name, [f"J{k}"], {f"{name}.J{k}": value})
        for k, values in enumerate(USUAL, 1)
        for name, value in zip(("coulomb", "viscous"), values, strict=True)
    ]
    size = {"stribeck": ("vs", 0.12), "presliding": ("x0", 0.01)}[effect]
    truth.torque_effects = [
        *truth.torque_effects,
        AppliedEffect(effect, ["J2"], {f"{effect}.J2": 3.0, f"{effect}.J2.{size[0]}": size[1]}),
    ]
    recordings = []
    for run in range(4):
        random = np.random.default_rng([3, seed, run])
        bare = Recording(f"m{run}", time=time, position=position)
        torque = np.asarray(predict(truth, bare, cutoff=30.0).torque)
        recordings.append(bare.replace(torque=torque + random.normal(size=torque.shape), test=run > 2))
    fit = identify(ARM, recordings, effects=f"coulomb,viscous,current_offset,{effect}:J2")
    return next(p.sigma for p in fit.parameters if p.name == f"{effect}.J2")


def test_options_that_make_no_sense_are_refused() -> None:
    for options, message in (
        ({"columns": "volts"}, "found 'volts'"),
        ({"duration": 1.0}, "duration"),
        ({"speed": 2.0}, "speed"),
        ({"separate": "stribeck:J9"}, "J9"),
        ({"separate": "motor_constant"}, "motor_constant"),
    ):
        with pytest.raises(InputError, match=message):
            plan(ARM, **options)
    massless = ARM.copy()
    for joint in massless.joints:
        joint.mass = None
    with pytest.raises(InputError, match="no link of the robot has a mass"):
        plan(massless)
