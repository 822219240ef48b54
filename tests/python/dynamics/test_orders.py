# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What is left and repeats many times a turn of a joint: gears and motors that turn faster."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from truing.dynamics import (
    Recording,
    TorqueDiagnosis,
    TorqueEffect,
    diagnose,
    identify,
)
from truing.dynamics.page import orders_sentence
from truing.dynamics.result import diagnosis_dict
from truing.testing.dynamics import HIDDEN, simulate_motion

Floats = NDArray[np.float64]


def with_waves(one: Recording, joint: int, order: float, amplitude: float, *, directed: bool) -> Recording:
    torque = np.array(one.torque)
    angle = np.asarray(one.position)[:, joint]
    way = np.sign(np.gradient(angle)) if directed else 1.0
    torque[:, joint] += amplitude * way * np.sin(order * angle + 0.4)
    return one.replace(torque=torque)


def diagnosed(seed: int, joint: int, order: float, amplitude: float, *, directed: bool) -> TorqueDiagnosis:
    simulated = simulate_motion(seed=seed, hidden={})
    waved = [with_waves(r, joint, order, amplitude, directed=directed) for r in simulated.recordings]
    return diagnose(simulated.nominal, waved)


@pytest.mark.parametrize(("seed", "joint", "order"), [(1, 0, 80.0), (2, 3, 50.5), (3, 5, 101.0)])
@pytest.mark.parametrize("directed", [False, True])
def test_waves_of_a_gear_are_found_with_their_size(
    seed: int, joint: int, order: float, directed: bool
) -> None:
    amplitude = 0.05 * float(np.std(simulate_motion(seed=seed, hidden={}).recordings[0].torque[:, joint]))
    found = diagnosed(seed, joint, order, amplitude, directed=directed)
    (one,) = found.orders
    assert one.joint == f"J{joint + 1}"
    assert one.order == pytest.approx(order, abs=0.5)
    assert one.with_direction == directed
    assert one.amplitude == pytest.approx(amplitude, rel=0.25)
    assert 0.05 < one.share < 1.0


def test_waves_that_are_left_are_fitted_as_an_effect_of_one_s_own() -> None:
    simulated = simulate_motion(seed=21, hidden={})
    waved = [with_waves(r, 0, 32.0, 0.8, directed=True) for r in simulated.recordings]
    gear = TorqueEffect(
        "gear",
        "J1",
        {
            "sin": lambda m: m.direction("J1") * np.sin(32 * m.joint("J1")),
            "cos": lambda m: m.direction("J1") * np.cos(32 * m.joint("J1")),
        },
    )
    fit = identify(simulated.nominal, waved, effects=["coulomb,viscous", gear])
    values = {p.name: p.value for p in fit.parameters}
    assert np.hypot(values["gear.J1.sin"], values["gear.J1.cos"]) == pytest.approx(0.8, rel=0.1)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_noise_and_laws_of_the_angle_have_no_order(seed: int) -> None:
    law = {"ripple": (["J1"], {"ripple.J1.sin4": 1.0, "ripple.J1.cos4": 0.5})}
    for hidden in ({}, HIDDEN, law):
        simulated = simulate_motion(seed=seed, hidden=hidden)
        assert not diagnose(simulated.nominal, simulated.recordings).orders


def test_the_result_and_the_sentence_say_where_and_how_large() -> None:
    found = diagnosed(1, 0, 80.0, 0.5, directed=True)
    (one,) = diagnosis_dict(found)["orders"]
    assert one.keys() == {"joint", "order", "with_direction", "amplitude", "unit", "share"}
    assert "J1 80 a turn with the direction of motion (0.4" in orders_sentence([one])
    assert orders_sentence([]) == ""
    assert "left: 80 waves a turn of J1, with the direction" in found.summary()
