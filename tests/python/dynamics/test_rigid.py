# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques of the rigid chain against Pinocchio's recursive Newton-Euler algorithm, from the same URDF."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pinocchio_arms import ARM, GANTRY, OBLIQUE, Both
from truing import _core
from truing.errors import InputError
from urdf_inertias import skewed_inertias

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]

ROBOTS = {"arm": ARM, "oblique": OBLIQUE, "gantry": GANTRY}


def coupling(both: Both) -> Floats:
    """Rates of Pinocchio's joints, which mimic nothing, for rates of readings."""
    out = np.zeros((both.model.nv, both.robot.driven_count))
    for k in range(both.robot.driven_count):
        for name, motion in both.motions(np.eye(both.robot.driven_count)[k]).items():
            out[both.model.joints[both.model.getJointId(name)].idx_v, k] = motion
    return out


def assert_torques_are_pinocchios(text: str) -> None:
    both = Both.read(text)
    n = both.robot.driven_count
    random = np.random.default_rng(7)
    q, qd, qdd = (random.uniform(-3, 3, (60, n)) for _ in range(3))
    ours = _core.rigid_torques(both.robot, q, qd, qdd)
    C = coupling(both)
    theirs = np.array(
        [
            C.T @ pin.rnea(both.model, both.data, both.configuration(q[row]), C @ qd[row], C @ qdd[row])
            for row in range(len(q))
        ]
    )
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_torques_are_pinocchios(name: str) -> None:
    assert_torques_are_pinocchios(skewed_inertias(ROBOTS[name]))


@pytest.mark.realdata
@pytest.mark.parametrize("name", ["dyn_ur10e", "dyn_tx40", "dyn_ur10"])
def test_torques_of_published_urdfs_are_pinocchios(name: str) -> None:
    path = Path(os.environ.get("TRUING_REALDATA", "")) / name / "robot.urdf"
    if not path.exists():
        pytest.skip(f"{name} is not there: set TRUING_REALDATA to the folder of recordings")
    assert_torques_are_pinocchios(path.read_text())


GRIPPER = """
  <link name="left"><inertial><origin xyz="0.01 0.02 0.03"/><mass value="0.4"/>
    <inertia ixx="2e-3" iyy="1e-3" izz="1.5e-3" ixy="1e-4" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><inertial><origin xyz="0 0 0.02"/><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><origin xyz="0 0.03 0.1" rpy="0.3 0 0.2"/><parent link="tcp"/>
    <child link="left"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
  <joint name="swing" type="revolute"><origin xyz="0 0 0.05" rpy="0 0.4 0"/><parent link="left"/>
    <child link="tip"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


def test_a_gripper_weighs_what_it_weighs_at_zero() -> None:
    plain = skewed_inertias(ARM)
    text = plain.replace("</robot>", GRIPPER)
    model = pin.buildModelFromXML(text)
    held = [model.getJointId("slide"), model.getJointId("swing")]
    model = pin.buildReducedModel(model, held, pin.neutral(model))
    robot = _core.robot_from_urdf(text, "", "tcp")
    assert _core.links_off_chain(text, "", "tcp") == ["left", "tip"]
    both = Both.read(plain)
    q, qd, qdd = (np.random.default_rng(8).uniform(-3, 3, (20, robot.driven_count)) for _ in range(3))
    C, data = coupling(both), model.createData()
    rows = zip(q, qd, qdd, strict=True)
    theirs = np.array([C.T @ pin.rnea(model, data, both.configuration(a), C @ b, C @ c) for a, b, c in rows])
    ours = _core.rigid_torques(robot, q, qd, qdd)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * np.abs(theirs).max())
    assert np.abs(_core.rigid_torques(both.robot, q, qd, qdd) - theirs).max() > 1.0


def test_tables_of_another_shape_are_refused() -> None:
    robot = Both.read(ARM).robot
    right = np.zeros((4, robot.driven_count))
    with pytest.raises(InputError, match=r"qd has shape \(4, 5\), expected \(4, 6\)"):
        _core.rigid_torques(robot, right, right[:, 1:], right)
    with pytest.raises(InputError, match="q"):
        _core.rigid_torques(robot, right[0], right, right)
    right[1, 2] = np.inf
    with pytest.raises(InputError, match="row 2, joint 3"):
        _core.rigid_torques(robot, right, right, right)
