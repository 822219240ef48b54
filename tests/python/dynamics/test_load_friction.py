# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Gears lose a part of what their motor gives, or of what their link takes: either is named alone."""

from __future__ import annotations

import numpy as np
import pytest

from truing import _core
from truing.dynamics import Recording, diagnose
from truing.testing import dynamics as testing

STEP = 0.004  # [s] between rows
PART = 0.12  # of the load


def _recorded(seed: int, number: int, of_links: bool) -> Recording:
    """The demonstration's arm with dry and viscous friction a third of its torques, and 1 % of noise."""
    random = np.random.default_rng([seed, number])
    time = np.arange(0.0, 20.0, STEP)
    q = testing.fourier_motion(time, 6, random)
    qd = np.gradient(q, STEP, axis=0)
    torque = np.asarray(_core.rigid_torques(testing.demo_arm(), q, qd, np.gradient(qd, STEP, axis=0)))
    coulomb, viscous = np.array(testing.USUAL).T
    usual = 2.0 * coulomb * np.sign(qd) + viscous * qd
    load = torque[:, 1] if of_links else (torque + usual)[:, 1]
    moved = torque + usual
    moved[:, 1] += PART * np.sign(qd[:, 1]) * np.abs(load)
    noise = 0.01 * moved.std(axis=0) * testing.coloured_noise(moved.shape, random)
    return Recording(f"motion{number}", time=time, position=q, torque=moved + noise)


@pytest.mark.parametrize("of_links", [False, True])
@pytest.mark.parametrize("seed", [41, 42])
def test_either_load_is_named_alone(seed: int, of_links: bool) -> None:
    recordings = [_recorded(seed, number, of_links) for number in range(4)]
    found = diagnose(testing.demo_arm(), recordings)
    (named,) = [one for one in found.effects if not one.standard]
    assert (named.effect, tuple(named.joints)) == ("load_friction", ("J2",))
    (parameter,) = named.parameters
    assert parameter.name == ("load_friction.J2.links" if of_links else "load_friction.J2")
    assert parameter.value == pytest.approx(PART, rel=0.02 if of_links else 0.15)
    assert not found.unknown
    left = {one.model: one.held_out[1].percent for one in found.errors}
    assert left["named"] < 0.2 * left["standard"]
