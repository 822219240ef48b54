# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The torque regressor against Pinocchio's, which shares no code with truing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from pinocchio_arms import ARM, GANTRY, OBLIQUE, Both
from truing import _core

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]
ROBOTS = {"arm": ARM, "oblique": OBLIQUE, "gantry": GANTRY}
# Pinocchio: m, mc, then Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the joint's frame; ours: Ixx, Iyy, Izz, Ixy, Ixz,
# Iyz.
ORDER = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]


def random_chain(seed: int) -> str:
    """A URDF of four to eight joints that turn or slide along any axis, as text."""
    rng = np.random.default_rng(seed)

    def numbers(values: Floats) -> str:
        return " ".join(repr(float(value)) for value in values)

    joints = int(rng.integers(4, 9))
    text = '<?xml version="1.0"?>\n<robot name="chain"><link name="l0"/>'
    for k in range(1, joints + 1):
        kind = "prismatic" if rng.random() < 0.25 else "revolute"
        inertia = (
            '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        text += f'''<link name="l{k}">{inertia}</link>
  <joint name="J{k}" type="{kind}"><parent link="l{k - 1}"/><child link="l{k}"/>
    <origin xyz="{numbers(rng.uniform(-0.5, 0.5, 3))}" rpy="{numbers(rng.uniform(-3, 3, 3))}"/>
    <axis xyz="{numbers(rng.normal(size=3))}"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'''
    return text + "</robot>"


def with_inertias(text: str, seed: int) -> Both:
    """Both read the URDF, and get the same masses, centres and inertias, those of a few point masses."""
    rng = np.random.default_rng(seed)
    both = Both.read(text)
    gravity = rng.normal(size=3) * 5.0
    both.robot.gravity = gravity
    both.model.gravity.linear = gravity
    for joint in both.robot.joints:
        masses = rng.uniform(0.1, 1.0, 8)
        points = rng.uniform(-0.3, 0.3, (8, 3))
        center = masses @ points / masses.sum()
        second = (points - center).T @ ((points - center) * masses[:, None])
        inertia = np.trace(second) * np.eye(3) - second
        joint.mass, joint.center_of_mass, joint.inertia = float(masses.sum()), center, inertia
        both.model.inertias[both.model.getJointId(joint.name)] = pin.Inertia(masses.sum(), center, inertia)
    return both


CASES = [(name, text, seed) for seed, (name, text) in enumerate(sorted(ROBOTS.items()))] + [
    (f"chain {seed}", random_chain(seed), seed) for seed in range(12)
]


@pytest.fixture(params=CASES, ids=[case[0] for case in CASES])
def both(request: pytest.FixtureRequest) -> Both:
    return with_inertias(request.param[1], request.param[2])


def states(both: Both, count: int) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(5)
    shape = (count, both.robot.driven_count)
    return rng.uniform(-3, 3, shape), rng.normal(size=shape) * 2.0, rng.normal(size=shape) * 5.0


def rates(both: Both) -> Floats:
    """Pinocchio's speeds for those of the readings: a joint that mimics follows."""
    driven = [both.robot.joints[index].name for index in both.robot.driven_joints()]
    out = np.zeros((both.model.nv, len(driven)))
    for joint in both.robot.joints:
        at = both.model.joints[both.model.getJointId(joint.name)].idx_v
        for name, weight in joint.driven_by or ((joint.name, 1.0),):
            out[at, driven.index(name)] += weight
    return out


def test_torques_are_pinocchios(both: Both) -> None:
    q, qd, qdd = states(both, 20)
    ours = _core.torque_regressor(both.robot, q, qd, qdd) @ _core.link_parameters(both.robot)
    S = rates(both)
    theirs = [
        S.T @ pin.rnea(both.model, both.data, both.configuration(a), S @ b, S @ c)
        for a, b, c in zip(q, qd, qdd, strict=True)
    ]
    scale = float(np.abs(theirs).max())
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * max(1.0, scale))


def test_the_regressor_is_pinocchios(both: Both) -> None:
    q, qd, qdd = states(both, 20)
    ours = _core.torque_regressor(both.robot, q, qd, qdd)
    S = rates(both)
    links = [both.model.getJointId(joint.name) - 1 for joint in both.robot.joints]
    columns = [10 * link + k for link in links for k in ORDER]
    for Y, a, b, c in zip(ours, q, qd, qdd, strict=True):
        full = pin.computeJointTorqueRegressor(both.model, both.data, both.configuration(a), S @ b, S @ c)
        theirs = (S.T @ full)[:, columns]
        np.testing.assert_allclose(Y, theirs, rtol=0, atol=1e-10 * max(1.0, float(np.abs(theirs).max())))


def test_parameters_are_pinocchios(both: Both) -> None:
    ours = _core.link_parameters(both.robot).reshape(-1, 10)
    for mine, joint in zip(ours, both.robot.joints, strict=True):
        inertia = both.model.inertias[both.model.getJointId(joint.name)]
        np.testing.assert_allclose(mine, inertia.toDynamicParameters()[ORDER], rtol=0, atol=1e-12)


def test_a_table_of_another_shape_is_refused() -> None:
    robot = Both.read(ARM).robot
    with pytest.raises(truing.InputError, match=r"qd has shape \(3, 6\), expected \(4, 6\)"):
        _core.torque_regressor(robot, np.zeros((4, 6)), np.zeros((3, 6)), np.zeros((4, 6)))
    with pytest.raises(truing.InputError, match=r"q has shape \(4, 5\), expected \(4, 6\)"):
        _core.torque_regressor(robot, np.zeros((4, 5)), np.zeros((4, 5)), np.zeros((4, 5)))


def test_a_value_that_is_no_number_is_refused_by_its_place() -> None:
    robot = Both.read(ARM).robot
    qdd = np.zeros((4, 6))
    qdd[2, 1] = np.nan
    with pytest.raises(truing.InputError, match="qdd, row 3, joint 2: nan"):
        _core.torque_regressor(robot, np.zeros((4, 6)), np.zeros((4, 6)), qdd)
