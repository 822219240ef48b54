# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Friction curves: the laws of the catalogue, added up for a joint."""

from __future__ import annotations

import numpy as np
import pytest

from truing.dynamics.friction import friction_dict, friction_torque, parameters_at
from truing.model import AppliedEffect
from truing.testing.dynamics import demo_arm

SPEED = np.array([-0.4, 0.0, 0.2])


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"coulomb": 2.0, "viscous": 3.0}, [-2 - 1.2, 0, 2 + 0.6]),
        ({"presliding": 1.5, "presliding.x0": 1e-3}, [-1.5, 0, 1.5]),
        ({"asymmetric_friction": 2.0}, [0.8, 0, 0.4]),
        ({"viscous_law.quadratic": 2.0}, [-0.32, 0, 0.08]),
        ({"viscous_law.cubic": 5.0}, [-0.32, 0, 0.04]),
        ({"viscous_law.root": 1.0}, [-np.sqrt(0.4), 0, np.sqrt(0.2)]),
        ({"viscous_law.saturating": 2.0, "viscous_law.v0": 0.2}, [-2 * np.tanh(2), 0, 2 * np.tanh(1)]),
        ({"stribeck": 2.0, "stribeck.vs": 0.2}, [-2 * np.exp(-4), 0, 2 * np.exp(-1)]),
        ({"load_friction": 0.1}, [-3, 0, 3]),
    ],
)
def test_every_law_is_that_of_the_catalogue(parameters: dict[str, float], expected: list[float]) -> None:
    np.testing.assert_allclose(friction_torque(parameters, SPEED, load=-30.0), expected, atol=1e-12)


def test_a_joint_has_the_parameters_of_its_own_effects_alone() -> None:
    robot = demo_arm()
    robot.torque_effects = [
        AppliedEffect("coulomb", ["J2"], {"coulomb.J2": 1.0}),
        AppliedEffect("viscous_law", ["J2"], {"viscous_law.J2.saturating": 2.0, "viscous_law.J2.v0": 0.3}),
        AppliedEffect("coulomb", ["J1"], {"coulomb.J1": 7.0}),
        AppliedEffect("armature", ["J3"], {"armature.J3": 7.0}),
    ]
    found = parameters_at(robot, "J2")
    assert found == {"coulomb": 1.0, "viscous_law.saturating": 2.0, "viscous_law.v0": 0.3}
    curves = {one["joint"]: one["curves"] for one in friction_dict(robot, [])}
    assert set(curves) == {"J1", "J2"}  # armature is no friction
    speed = friction_dict(robot, [])[1]["speed"]
    assert np.isnan(speed).sum() == 1  # at rest, where the line is broken
    np.testing.assert_allclose(
        curves["J2"][0]["friction"][-1], 1.0 + 2.0 * np.tanh(speed[-1] / 0.3), rtol=1e-12
    )
