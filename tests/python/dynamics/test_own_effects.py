# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one's own on torques, evaluated in Python a stretch at a time."""

from __future__ import annotations

import numpy as np
import pytest

from truing.dynamics import (
    MotionInputs,
    Recording,
    TorqueEffect,
    TorqueEffectSize,
    TorquePlan,
    diagnose,
    identify,
    plan,
    predict,
)
from truing.errors import InputError
from truing.testing.dynamics import simulate_motion

STIFFNESS = 9.0  # [Nm/rad^2]
SIMULATED = simulate_motion(seed=5, hidden={})


def bent(angle: np.ndarray) -> np.ndarray:
    return np.sign(angle - 0.4) * (angle - 0.4) ** 2


def with_hose(one: Recording) -> Recording:
    return one.replace(torque=one.torque + STIFFNESS * np.outer(bent(one.position[:, 2]), np.eye(6)[2]))


RECORDINGS = [with_hose(one) for one in SIMULATED.recordings]
HOSE = TorqueEffect("hose", "J3", lambda m: bent(m.joint("J3")), unit="Nm/rad^2")


def test_a_diagnosis_names_it_with_its_size() -> None:
    found = diagnose(SIMULATED.nominal, RECORDINGS, effects=HOSE)
    first = found.effects[0]
    assert (first.effect, tuple(first.joints)) == ("hose", ("J3",))
    assert first.probability > 0.9
    (parameter,) = first.parameters
    assert parameter.name == "hose.J3"
    assert abs(parameter.value - STIFFNESS) < 0.05 * STIFFNESS


def test_threads_do_not_change_a_bit_of_it() -> None:
    one, two = (
        diagnose(SIMULATED.nominal, RECORDINGS, effects=[HOSE], threads=n).effects[0].parameters[0].value
        for n in (1, 2)
    )
    assert one == two


def test_identify_fits_it_beside_the_catalogues() -> None:
    fit = identify(SIMULATED.nominal, RECORDINGS, effects=["coulomb", "viscous,current_offset", HOSE])
    values = {p.name: p.value for p in fit.parameters}
    assert values["hose.J3"] == pytest.approx(STIFFNESS, rel=0.05)
    assert "viscous.J6" in values


def test_prediction_is_its_basis_times_its_value() -> None:
    found = identify(SIMULATED.nominal, RECORDINGS, effects=[HOSE]).robot
    bare = found.copy()
    bare.torque_effects = [e for e in bare.torque_effects if e.effect != "hose"]
    value = next(e for e in found.torque_effects if e.effect == "hose").parameters["hose.J3"]
    first = RECORDINGS[0]
    difference = predict(found, first, effects=HOSE).torque - predict(bare, first).torque
    # The basis sees angles after the low-pass.
    assert np.abs(difference[:, 2] - value * bent(first.position[:, 2]))[100:-100].max() < 0.02 * STIFFNESS
    assert np.abs(difference[:, [0, 1, 3, 4, 5]]).max() < 1e-9


def test_several_parameters_at_every_joint() -> None:
    def grease(m: MotionInputs) -> np.ndarray:
        return np.tanh(m.speed(m.at) / 0.3)

    both = TorqueEffect(
        "grease", "*", {"thin": grease, "load": lambda m: np.tanh(m.torque(m.at))}, needs_torque=True
    )
    names = [p.name for p in identify(SIMULATED.nominal, RECORDINGS, effects=both).parameters]
    assert {"grease.J1.thin", "grease.J6.load"} <= set(names)


def test_what_a_basis_may_not_do_is_said() -> None:
    def refused(basis, match: str) -> None:
        with pytest.raises(InputError, match=match):
            diagnose(SIMULATED.nominal, RECORDINGS, effects=TorqueEffect("odd", "J3", basis))

    refused(lambda m: m.torque("J3"), "needs_torque=True")
    refused(lambda m: m.joint("J9"), "no joint 'J9'.*J1, J2")
    refused(lambda m: m.column("temp_C"), "no column 'temp_C'")
    refused(lambda m: np.ones(3), r"'odd\.J3'.*shape \(3,\)")
    refused(lambda m: np.full(len(m), np.nan), "not finite")
    with pytest.raises(InputError, match="no joint 'J9'"):
        diagnose(SIMULATED.nominal, RECORDINGS, effects=TorqueEffect("odd", "J9", lambda m: m.time))
    with pytest.raises(InputError, match="taken by the catalogue"):
        TorqueEffect("coulomb", "J3", lambda m: m.time)


QUICK = {"duration": 12.0, "starts": 3, "rounds": 3, "seed": 5}


def test_a_plan_says_from_which_size_on_it_would_show() -> None:
    def hose(planned: TorquePlan) -> TorqueEffectSize:
        (one,) = [e for e in planned.planned.effects if e.effect == "hose"]
        return one

    nominal = SIMULATED.nominal
    one = hose(plan(nominal, effects=HOSE, **QUICK))
    assert (tuple(one.joints), one.joint) == (("J3",), "J3")
    assert (one.parameter, one.unit) == ("hose.J3", "Nm/rad^2")
    assert 0.0 < one.size < STIFFNESS
    thrice = TorqueEffect("hose", "J3", lambda m: 3.0 * bent(m.joint("J3")), unit="Nm/rad^2")
    still = {**QUICK, "starts": 1, "rounds": 0}
    assert 3.0 * hose(plan(nominal, effects=[thrice], **still)).size == pytest.approx(
        hose(plan(nominal, effects=[HOSE], **still)).size, rel=0.02
    )


def test_a_motion_is_planned_that_tells_it_from_others() -> None:
    planned = plan(SIMULATED.nominal, effects=HOSE, separate="hose:J3,spring:J3", **QUICK)
    assert {(p.effect, p.other) for p in planned.separated} == {("hose", "spring"), ("spring", "hose")}
    assert planned.information > planned.information_random
    with pytest.raises(InputError, match="hose"):
        plan(SIMULATED.nominal, separate="hose:J3,spring:J3", **QUICK)


def test_a_plan_says_what_of_it_cannot_be_used() -> None:
    warm = TorqueEffect("warm", "J3", lambda m: m.column("temp3_C"))
    with pytest.raises(InputError, match="temp3_C"):
        plan(SIMULATED.nominal, effects=warm, **QUICK)
    with pytest.raises(InputError, match="TorqueEffect"):
        plan(SIMULATED.nominal, effects="spring", **QUICK)  # type: ignore[arg-type]
