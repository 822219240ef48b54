# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The URDF reader, the chain and its derivatives against Pinocchio, which shares no code with truing."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import truing
from numpy.typing import NDArray

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]


def urdf(name: str, joints: str) -> str:
    """A URDF with the given joints, and every link that they name."""
    links = dict.fromkeys(re.findall(r'link="(\w+)"', joints))
    inertia = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return (
        f'<?xml version="1.0"?>\n<robot name="{name}">'
        + "".join(f'<link name="{link}">{inertia}</link>' for link in links)
        + joints
        + "</robot>"
    )


LIMITS = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'

# Origins turned about all three axes, axes along x, y, z and -z; fixed joints before, between and behind.
ARM = urdf(
    "arm",
    f"""
  <joint name="mount" type="fixed"><parent link="world"/><child link="foot"/><origin xyz="0.3 -0.2 0.5" rpy="0.3 -0.7 1.9"/></joint>
  <joint name="A1" type="revolute"><parent link="foot"/><child link="l1"/><origin xyz="0 0.01 0.4" rpy="0.1 0.2 -0.3"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="A2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.15 0 0.1" rpy="-1.57 0 0.4"/><axis xyz="0 1 0"/>{LIMITS}</joint>
  <joint name="spacer" type="fixed"><parent link="l2"/><child link="l2b"/><origin xyz="0.05 0.02 -0.01" rpy="0.7 1.1 -2.0"/></joint>
  <joint name="spacer2" type="fixed"><parent link="l2b"/><child link="l2c"/><origin xyz="0 0.02 0.3" rpy="0 0 3.1"/></joint>
  <joint name="A3" type="revolute"><parent link="l2c"/><child link="l3"/><origin xyz="0.6 0 0" rpy="0 1.5 0"/><axis xyz="1 0 0"/>{LIMITS}</joint>
  <joint name="A4" type="continuous"><parent link="l3"/><child link="l4"/><origin xyz="0.1 0.6 0" rpy="2.9 -1.2 0.5"/><axis xyz="0 0 -1"/></joint>
  <joint name="A5" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="0 0 0.12" rpy="1.57 0 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="A6" type="revolute"><parent link="l5"/><child link="l6"/><origin xyz="0 0.1 0.02" rpy="-1.5 0.1 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="flange" type="fixed"><parent link="l6"/><child link="tcp"/><origin xyz="0.04 -0.03 0.2" rpy="0.5 -0.4 0.3"/></joint>
""",
)

# Axes along no coordinate, one of them not of unit length; the first joint starts at the root.
OBLIQUE = urdf(
    "oblique",
    f"""
  <joint name="B1" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0.1 0.2 0.3" rpy="0 0 0"/><axis xyz="0.48 -0.6 0.64"/>{LIMITS}</joint>
  <joint name="B2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="-0.2 0.1 0.5" rpy="1 2 3"/><axis xyz="1 2 -3"/>{LIMITS}</joint>
  <joint name="B3" type="continuous"><parent link="l2"/><child link="l3"/><origin xyz="0.4 0 0" rpy="-2 0.3 1"/><axis xyz="0 0.6 0.8"/></joint>
  <joint name="tip" type="fixed"><parent link="l3"/><child link="l3b"/><origin xyz="0 0.1 0"/></joint>
  <joint name="B4" type="revolute"><parent link="l3b"/><child link="l4"/><origin xyz="0 0 0.35" rpy="0.2 -0.9 2.2"/><axis xyz="-0.8 0 0.6"/>{LIMITS}</joint>
""",
)

# A gantry that carries a wrist; a prismatic joint along an oblique axis, and one that mimics another.
GANTRY = urdf(
    "gantry",
    f"""
  <joint name="X" type="prismatic"><parent link="floor"/><child link="bridge"/><origin xyz="0 0 2" rpy="0.01 -0.02 0.03"/><axis xyz="1 0 0"/>{LIMITS}</joint>
  <joint name="Y" type="prismatic"><parent link="bridge"/><child link="trolley"/><origin xyz="0.1 0 0" rpy="0 0 0.5"/><axis xyz="0 0.6 -0.8"/>{LIMITS}</joint>
  <joint name="foot" type="fixed"><parent link="trolley"/><child link="trolley2"/><origin xyz="0.02 0.01 -0.3" rpy="3.1 0 0"/></joint>
  <joint name="Z" type="prismatic"><parent link="trolley2"/><child link="mast"/><origin xyz="0 0 0" rpy="0.1 0 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="Z2" type="prismatic"><parent link="mast"/><child link="mast2"/><origin xyz="0 0.1 0"/><axis xyz="0 0 1"/>{LIMITS}
    <mimic joint="Z" multiplier="0.5"/></joint>
  <joint name="C" type="revolute"><parent link="mast2"/><child link="wrist"/><origin xyz="0.05 0 0.3" rpy="0.4 0.2 -1"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="D" type="revolute"><parent link="wrist"/><child link="hand"/><origin xyz="0 0 0.2" rpy="1.57 0 0"/><axis xyz="0.28 0 0.96"/>{LIMITS}</joint>
  <joint name="grip" type="fixed"><parent link="hand"/><child link="tcp"/><origin xyz="0.1 0.2 0.05" rpy="0 0.3 0"/></joint>
""",
)

ROBOTS = {"arm": ARM, "oblique": OBLIQUE, "gantry": GANTRY}


@dataclass
class Both:
    """One URDF, read by truing and by Pinocchio."""

    text: str
    robot: truing.Robot
    model: Any
    data: Any
    tip: int  # Pinocchio's frame of the last link

    @classmethod
    def read(cls, text: str) -> Both:
        model = pin.buildModelFromXML(text)
        links = [i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
        # An export adds a link where the tool was measured to be.
        names = [model.frames[i].name for i in links]
        tip = "truing_tool" if "truing_tool" in names else names[-1]
        return cls(
            text,
            truing.robot_from_urdf(text, tip_link=tip),
            model,
            model.createData(),
            model.getFrameId(tip, pin.FrameType.BODY),
        )

    def motions(self, reading: Floats) -> dict[str, float]:
        """What each joint moves by: readings, and their multiples at joints that mimic."""
        driven = [self.robot.joints[index].name for index in self.robot.driven_joints()]
        moves = dict(zip(driven, (float(value) for value in reading), strict=True))
        for joint in self.robot.joints:
            if joint.passive:
                moves[joint.name] = sum(weight * moves[other] for other, weight in joint.driven_by)
        return moves

    def configuration(self, reading: Floats) -> Floats:
        q = np.array(pin.neutral(self.model))
        for name, motion in self.motions(reading).items():
            joint = self.model.joints[self.model.getJointId(name)]
            # Pinocchio holds a joint without limits as cosine and sine.
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(motion), np.sin(motion)) if joint.nq == 2 else motion
            )
        return q

    def frames(self, reading: Floats) -> Floats:
        """Frame after every joint, then that of the last link."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(reading))
        placements = [self.data.oMi[self.model.getJointId(joint.name)] for joint in self.robot.joints]
        return np.array([placement.homogeneous for placement in [*placements, self.data.oMf[self.tip]]])

    def jacobian(self, reading: Floats) -> Floats:
        """Of the last link's frame at its own origin, in axes of the base: rows x y z rx ry rz, a column per
        driven joint.
        """
        full = pin.computeFrameJacobian(
            self.model,
            self.data,
            self.configuration(reading),
            self.tip,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        driven = [self.robot.joints[index].name for index in self.robot.driven_joints()]
        columns = {name: np.zeros(6) for name in driven}
        for joint in self.robot.joints:
            column = full[:, self.model.joints[self.model.getJointId(joint.name)].idx_v]
            for name, weight in joint.driven_by or ((joint.name, 1.0),):
                columns[name] = columns[name] + weight * column
        return np.column_stack([columns[name] for name in driven])


@pytest.fixture(params=sorted(ROBOTS))
def both(request: pytest.FixtureRequest) -> Both:
    return Both.read(ROBOTS[request.param])


def readings(both: Both, count: int, seed: int) -> Floats:
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (count, both.robot.driven_count))


# ---- Forward kinematics
# ----------------------------------------------------------------------------------------------


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


# ---- Derivatives
# -----------------------------------------------------------------------------------------------------


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
    """`identify` of joint zeros: its covariance is that of Pinocchio's columns, and of the frame's six.

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
    jacobian = np.stack([columns[parameter] for parameter in fitted], axis=2).reshape(3 * len(q), -1)
    # The base was found where it is, at the origin: it turns about that.
    expected = found.noise_sigma**2 * np.linalg.inv(jacobian.T @ jacobian)
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


# ---- Export
# ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_exported_calibration_is_the_same_robot_to_pinocchio(name: str) -> None:
    both = Both.read(ROBOTS[name])
    simulated = truing.simulate(both.robot, poses=200, orientation=True, seed=8)
    found = truing.identify(both.robot, simulated.data)
    exported = Both.read(truing.urdf_with_calibration(both.text, found.robot))
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
    text = truing.urdf_with_calibration(both.text, robot)
    exported = Both.read(text)
    for reading in readings(both, 30, seed=11):
        ours = truing.forward_kinematics(robot, reading)[-1]
        np.testing.assert_allclose(ours, exported.frames(reading)[-1], rtol=0, atol=1e-12)
