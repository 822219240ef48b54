# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a path collides with between its targets."""

from __future__ import annotations

import numpy as np
import pytest

import truing
from inverse_arms import irb
from truing.inverse_kinematics import InverseOptions, InverseSolver, contacts_between
from truing.model import LinkCapsule, Obstacle, Scene, forward_kinematics


def swing() -> np.ndarray:
    """shape=(4, 6) [rad]: the first joint turns by 15 degrees from target to target."""
    q = np.tile([0.0, 0.3, -0.2, 0.1, 0.8, 0.2], (4, 1))
    q[:, 0] = np.radians([0.0, 15.0, 30.0, 45.0])
    return q


@pytest.mark.parametrize(("share", "clearance", "found"), [(0.4, 0.0, [1]), (0.4, 0.01, [1]), (9.0, 0.0, [])])
def test_a_thin_post_between_two_targets_is_found(share: float, clearance: float, found: list[int]) -> None:
    robot, q = irb(), swing()
    between = q[1] + share * (q[2] - q[1])
    post = np.eye(4)
    post[:3, 3] = forward_kinematics(robot, between)[-1][:3, 3] - [0, 0, 0.1]
    pole = Obstacle("post", shape="capsule", T_measurement_shape=post, size=[0, 0, 0.2], radius=0.004)
    hand = LinkCapsule("hand", link="tool", start=[0, 0, -0.02], end=[0, 0, 0], radius=0.01)
    scene = Scene(obstacles=[pole], capsules=[hand], clearance=clearance)
    solver = InverseSolver(robot, InverseOptions(scene=scene))
    wanted = np.array([truing.forward_kinematics(robot, one)[-1] for one in q])
    path = solver.path(wanted, q[0])
    assert path.continuous
    contacts = contacts_between(path, solver)
    assert [one.start for one in contacts] == found
    for one in contacts:
        assert {one.first, one.second} == {"hand", "post"} and one.distance < clearance
