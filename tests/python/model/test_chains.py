# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The plain chain of a robot, as files of other programs hold it, is the robot."""

from __future__ import annotations

import numpy as np
import pytest

from truing.chains import FixedFrames, coupling_of, fixed_frames, zeros_of
from truing.model import Joint, Robot, forward_kinematics
from truing.rotations import rotations_from_angles


def linkage(convention: str) -> Robot:
    """A rail, and joints that follow others, one before the joint that leads it; zeros everywhere."""
    rng = np.random.default_rng(3)
    joints = []
    for name, driven_by in (
        ("rail", []),
        ("F", [("J3", 0.7), ("J2", -1.0)]),
        ("J2", []),
        ("J3", []),
        ("G", [("F", -1.0)]),
        ("J4", []),
    ):
        T = np.eye(4)
        T[:3, :3] = rotations_from_angles(rng.normal(size=(1, 3)), "zyx")[0]
        T[:3, 3] = rng.normal(0.0, 0.3, 3)
        axis = rng.normal(size=3)
        links = dict(zip(("theta", "d", "a", "alpha", "beta"), rng.normal(0.0, 0.4, 5).tolist(), strict=True))
        place = {"T_parent_joint": T, "axis": axis / np.linalg.norm(axis)} if convention == "urdf" else links
        joints.append(
            Joint(
                name,
                type="prismatic" if name == "rail" else "revolute",
                offset=float(rng.normal(0.0, 0.2)),
                ratio=1.0 if driven_by else float(rng.uniform(0.9, 1.1)),
                driven_by=driven_by,
                **place,  # type: ignore[arg-type]
            )
        )
    return Robot("linkage", joints=joints, convention=convention)  # type: ignore[arg-type]


def moved(frames: FixedFrames, motion: float) -> np.ndarray:
    T = np.eye(4)
    if frames.joint.type == "prismatic":
        T[:3, 3] = motion * frames.axis
    else:
        T[:3, :3] = rotations_from_angles((motion * frames.axis)[None], "rotation-vector")[0]
    return np.asarray(frames.before @ T @ frames.after)


@pytest.mark.parametrize("convention", ["urdf", "dh", "mdh"])
def test_fixed_frames_and_plain_motions_give_the_robots_frames(convention: str) -> None:
    robot = linkage(convention)
    driven = [robot.joints[k] for k in robot.driven_joints()]
    coupling = coupling_of([(joint.name, joint.driven_by) for joint in robot.joints])
    for readings in np.random.default_rng(4).normal(size=(5, len(driven))):
        motions = coupling[:, robot.driven_joints()] @ ([joint.ratio for joint in driven] * readings)
        T = np.array(robot.T_measurement_base)
        for frames, motion, wanted in zip(
            fixed_frames(robot), motions, forward_kinematics(robot, readings), strict=False
        ):
            T = T @ moved(frames, float(motion))
            assert T == pytest.approx(wanted, abs=1e-12)


def test_a_joint_that_follows_has_its_leaders_zeros_and_its_own() -> None:
    robot = linkage("dh")
    own = {joint.name: joint.offset for joint in robot.joints}
    zeros = dict(zip(own, zeros_of(robot), strict=True))
    assert zeros["F"] == pytest.approx(own["F"] + 0.7 * own["J3"] - own["J2"])
    assert zeros["G"] == pytest.approx(own["G"] - zeros["F"])
    assert zeros["J4"] == own["J4"]
