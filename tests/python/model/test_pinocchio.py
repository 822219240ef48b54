# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The URDF reader, the chain and its derivatives against Pinocchio, which shares no code with truing."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from pinocchio_arms import ARM, GANTRY, OBLIQUE, Both
from urdf_inertias import skewed_inertias

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]


ROBOTS = {"arm": ARM, "oblique": OBLIQUE, "gantry": GANTRY}


@pytest.fixture(params=sorted(ROBOTS))
def both(request: pytest.FixtureRequest) -> Both:
    return Both.read(ROBOTS[request.param])


def readings(both: Both, count: int, seed: int) -> Floats:
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (count, both.robot.driven_count))


# ---- Forward kinematics --------------------------------------------------------------------------


def test_frames_of_all_joints_and_the_tool_are_pinocchios(both: Both) -> None:
    for reading in readings(both, 50, seed=1):
        ours = np.array(truing.forward_kinematics(both.robot, reading))
        np.testing.assert_allclose(ours, both.frames(reading), rtol=0, atol=1e-12)


def test_predictions_are_pinocchios(both: Both) -> None:
    """The vectorised kernel, on many rows at once."""
    q = readings(both, 203, seed=2)  # no multiple of any number of lanes
    predicted = truing.predict(both.robot, truing.Measurements(q))
    theirs = np.array([both.frames(reading)[-1] for reading in q])
    np.testing.assert_allclose(predicted.position, theirs[:, :3, 3], rtol=0, atol=1e-12)
    for orientation, frame in zip(predicted.orientation, theirs, strict=True):
        np.testing.assert_allclose(
            pin.Quaternion(*orientation).toRotationMatrix(), frame[:3, :3], rtol=0, atol=1e-12
        )


def test_mimicking_joints_have_no_reading() -> None:
    both = Both.read(GANTRY)
    assert both.robot.driven_count == 5 and both.robot.joint("Z2").passive
    moved = np.array(truing.forward_kinematics(both.robot, np.array([0.0, 0.0, 0.4, 0.0, 0.0])))
    still = np.array(truing.forward_kinematics(both.robot, np.zeros(5)))
    assert np.linalg.norm(moved[-1, :3, 3] - still[-1, :3, 3]) == pytest.approx(
        0.6, abs=1e-12
    )  # 0.4 of Z, half as much of Z2


# ---- Derivatives ---------------------------------------------------------------------------------


def test_jacobian_by_differences_is_pinocchios(both: Both) -> None:
    """Differences of predictions of fourth order: their error is 1e-11 here."""
    q = readings(both, 20, seed=3)
    h = 1e-3
    weights = {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}

    def frames(joints: Floats) -> tuple[Floats, Floats]:
        predicted = truing.predict(both.robot, truing.Measurements(joints))
        matrices = [pin.Quaternion(*quaternion).toRotationMatrix() for quaternion in predicted.orientation]
        return np.asarray(predicted.position), np.array(matrices)

    rotation = frames(q)[1]
    for k in range(both.robot.driven_count):
        step = np.zeros(both.robot.driven_count)
        step[k] = h
        moved = {n: frames(q + n * step) for n in weights}
        linear = sum((w * moved[n][0] for n, w in weights.items()), np.zeros(3)) / (12.0 * h)
        turning = sum((w * moved[n][1] for n, w in weights.items()), np.zeros((3, 3))) / (12.0 * h)
        theirs = np.array([both.jacobian(reading)[:, k] for reading in q])
        np.testing.assert_allclose(linear, theirs[:, :3], rtol=0, atol=1e-9)
        # dR/dq R^T is the cross product matrix of the joint's axis.
        cross = np.array([pin.skew(axis) for axis in theirs[:, 3:]])
        np.testing.assert_allclose(turning @ rotation.transpose(0, 2, 1), cross, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_analytic_jacobian_gives_pinocchios_covariance(name: str) -> None:
    """`identify` of joint zeros: its covariance, clustered by pose, is that of Pinocchio's columns.

    Residuals are far below where curvature matters, so both Jacobians stand at the same point.
    """
    both = Both.read(ROBOTS[name])
    q = readings(both, 400, seed=4)
    theirs = np.array([both.frames(reading)[-1] for reading in q])
    noise = 1e-9 * np.random.default_rng(5).standard_normal((len(q), 3))
    data = truing.Measurements(q, positions=theirs[:, :3, 3] + noise, set=np.zeros(len(q), dtype=np.int8))
    # The first joint's zero and the base are the same thing.
    driven = [both.robot.joints[index].name for index in both.robot.driven_joints()]
    free = [f"{joint}.offset" for joint in driven[1:]]
    found = truing.identify(both.robot, data, free=free, loss="none")

    fitted = [p.name for p in found.parameters if not p.frozen]
    offsets = np.array([both.jacobian(reading)[:3, 1:] for reading in q])
    frame = np.zeros((len(q), 3, 6))
    for row, point in enumerate(theirs[:, :3, 3]):
        frame[row] = np.hstack([np.eye(3), -pin.skew(point)])
    columns = {
        **{name: offsets[:, :, k] for k, name in enumerate(free)},
        **{f"base.{axis}": frame[:, :, k] for k, axis in enumerate(("x", "y", "z", "rx", "ry", "rz"))},
    }
    # A joint that does nothing but what others do is frozen: both columns leave it out.
    # The base was found where it is, at the origin: it turns about that.
    jacobian = np.stack([columns[parameter] for parameter in fitted], axis=2)  # shape=(poses, 3, parameters)
    inverse = np.linalg.inv(np.einsum("nca,ncb->ab", jacobian, jacobian))
    found_by_fit = inverse @ np.einsum("nca,nc->a", jacobian, noise)
    score = np.einsum("nca,nc->na", jacobian, noise - jacobian @ found_by_fit)
    leverage = np.einsum("nca,ab,ncb->n", jacobian, inverse, jacobian) / 3
    expected = inverse @ (score.T / (1 - leverage) @ score) @ inverse
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        found.covariance / size[:, None] / size, expected / size[:, None] / size, rtol=0, atol=1e-5
    )


def test_identified_joint_zeros_are_those_put_into_pinocchio(both: Both) -> None:
    """Measurements made by Pinocchio alone, with joints that stand elsewhere than they say."""
    rng = np.random.default_rng(6)
    driven = [both.robot.joints[index].name for index in both.robot.driven_joints()]
    hidden = np.r_[0.0, 0.01 * rng.standard_normal(len(driven) - 1)]
    q = readings(both, 100, seed=7)
    frames = np.array([both.frames(reading + hidden)[-1] for reading in q])
    quaternions = np.array(
        [np.roll(pin.Quaternion(frame[:3, :3]).coeffs(), 1) for frame in frames]
    )  # x y z w to w x y z
    data = truing.Measurements(q, positions=frames[:, :3, 3], orientations=quaternions)
    found = truing.identify(both.robot, data, free=[f"{joint}.offset" for joint in driven[1:]], loss="none")
    value = {p.name: p.value for p in found.parameters}
    frozen = {p.name for p in found.parameters if p.frozen}
    for joint, truth in zip(driven[1:], hidden[1:], strict=True):
        name = f"{joint}.offset"
        assert name in frozen or value[name] == pytest.approx(truth, abs=1e-9)
    assert found.test is not None and found.test.after.max < 1e-9


# ---- Export --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_exported_calibration_is_the_same_robot_to_pinocchio(name: str) -> None:
    both = Both.read(ROBOTS[name])
    simulated = truing.simulate(both.robot, poses=200, orientation=True, seed=8)
    found = truing.identify(both.robot, simulated.data)
    exported = Both.read(truing.model.urdf_with_calibration(both.text, found.robot))
    changed = 0.0
    back = np.linalg.inv(found.robot.T_measurement_base)  # a URDF knows no measurement frame
    for reading in readings(both, 50, seed=9):
        ours = back @ np.array(truing.forward_kinematics(found.robot, reading))
        theirs = exported.frames(reading)
        np.testing.assert_allclose(ours[-1], theirs[-1], rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            ours[-1], np.array(truing.forward_kinematics(exported.robot, reading))[-1], rtol=0, atol=1e-12
        )
        changed = max(changed, float(np.abs(theirs - both.frames(reading)).max()))
    assert changed > 1e-4  # the calibration did change the robot


def test_exported_joint_zeros_are_turned_about_oblique_axes(both: Both) -> None:
    robot = both.robot.copy()
    rng = np.random.default_rng(10)
    for joint in robot.joints:
        if not joint.passive:
            joint.offset = 0.02 * rng.standard_normal()
    text = truing.model.urdf_with_calibration(both.text, robot)
    exported = Both.read(text)
    for reading in readings(both, 30, seed=11):
        ours = truing.forward_kinematics(robot, reading)[-1]
        np.testing.assert_allclose(ours, exported.frames(reading)[-1], rtol=0, atol=1e-12)


# ---- Inertias ------------------------------------------------------------------------------------

PUBLISHED = ("dyn_ur10e", "dyn_tx40", "dyn_ur10")


def assert_inertias_are_pinocchios(text: str) -> None:
    both = Both.read(text)
    for joint in both.robot.joints:
        theirs = both.model.inertias[both.model.getJointId(joint.name)]
        assert joint.mass == pytest.approx(theirs.mass, rel=1e-14)
        np.testing.assert_allclose(joint.center_of_mass, theirs.lever, rtol=0, atol=1e-13)
        np.testing.assert_allclose(joint.inertia, theirs.inertia, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_merged_inertias_are_pinocchios(name: str) -> None:
    assert_inertias_are_pinocchios(skewed_inertias(ROBOTS[name]))


@pytest.mark.realdata
@pytest.mark.parametrize("name", PUBLISHED)
def test_inertias_of_published_urdfs_are_pinocchios(name: str) -> None:
    path = Path(os.environ.get("TRUING_REALDATA", "")) / name / "robot.urdf"
    if not path.exists():
        pytest.skip(f"{name} is not there: set TRUING_REALDATA to the folder of recordings")
    assert_inertias_are_pinocchios(path.read_text())
