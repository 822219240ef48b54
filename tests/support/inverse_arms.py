# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robots and poses that the tests of inverse kinematics share, and an opinion of their own of whether a task
is met.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import truing
from truing.examples import example
from truing.model import AppliedEffect

Floats = NDArray[np.float64]


def irb() -> truing.Robot:
    return truing.load_robot(example("irb120"))


def calibrated(robot: truing.Robot, seed: int = 0) -> truing.Robot:
    """As a calibration finds it: every link, zero and ratio a little off."""
    random = np.random.default_rng(seed)

    def off(joint: truing.Joint) -> truing.Joint:
        a, d, alpha, offset, ratio = random.normal(0.0, 1.0, 5)
        moved = joint.replace(a=joint.a + 4e-4 * a, d=joint.d + 4e-4 * d, alpha=joint.alpha + 6e-4 * alpha)
        return (
            moved
            if joint.passive
            else moved.replace(offset=joint.offset + 1e-3 * offset, ratio=1.0 + 2e-4 * ratio)
        )

    return robot.replace(joints=[off(joint) for joint in robot.joints])


def with_effects(robot: truing.Robot) -> truing.Robot:
    """What changes with load, approach direction and angle."""
    masses = [
        joint.replace(mass=12.0 - 1.5 * k, center_of_mass=[0.05, 0.02, 0.03])
        for k, joint in enumerate(robot.joints)
    ]
    effects = [
        AppliedEffect("joint_compliance", ["J2"], {"joint_compliance.J2": 3e-6}),
        AppliedEffect("backlash", ["J3"], {"backlash.J3": 4e-4}),
        AppliedEffect("harmonic", ["J1"], {"harmonic.J1.cos1": 3e-4, "harmonic.J1.sin1": -2e-4}),
    ]
    return robot.replace(joints=masses, effects=effects)


def gantry() -> truing.Robot:
    """A six-axis arm under three rails, hanging: 10 m, 4 m, 2 m."""
    quarter = math.pi / 2
    rails = [
        truing.Joint(name, type="prismatic", theta=theta, alpha=alpha, lower=0.0, upper=length)
        for name, theta, alpha, length in (
            ("X", 0.0, -quarter, 10.0),
            ("Y", quarter, quarter, 4.0),
            ("Z", 0.0, 0.0, 2.0),
        )
    ]
    arm = irb()
    return arm.replace(
        name="gantry",
        joints=[*rails, *arm.joints],
        T_measurement_base=truing.frame_from_xyz_rpy([0, 0, 3], [0, quarter, 0]),
    )


def scara() -> truing.Robot:
    """The sliding joint stands near the end of the chain."""
    joints = [
        truing.Joint("J1", d=0.4, a=0.3, lower=-2.5, upper=2.5),
        truing.Joint("J2", a=0.25, alpha=math.pi, lower=-2.5, upper=2.5),
        truing.Joint("Z", type="prismatic", lower=0.0, upper=0.2),
        truing.Joint("C", d=0.05, lower=-6.0, upper=6.0),
    ]
    return truing.Robot("scara", joints=joints)


def limits(robot: truing.Robot) -> Floats:
    """shape=(2, driven joints) [rad | m], infinite ends at 12."""
    driven = [robot.joints[k] for k in robot.driven_joints()]
    return np.array(np.clip([[j.lower for j in driven], [j.upper for j in driven]], -12.0, 12.0))


def random_joints(robot: truing.Robot, count: int, seed: int = 0, share: float = 1.0) -> Floats:
    """Spread evenly over the middle `share` of the joints' ranges."""
    low, high = limits(robot)
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    return np.random.default_rng(seed).uniform(middle - half, middle + half, (count, len(low)))


def usual_joints(count: int, seed: int = 0) -> Floats:
    """Of the six-axis arm, away from its singularities and limits: a calibration changes no branch there."""
    joints = random_joints(irb(), count, seed, share=0.7)
    joints[:, 2] = np.clip(joints[:, 2], -1.0, 0.8)
    joints[:, 4] = np.where(joints[:, 4] < 0, -1.0, 1.0) * np.maximum(np.abs(joints[:, 4]), 0.3)
    return joints


def poses_of(solver: truing.inverse_kinematics.InverseSolver, joints: Floats) -> Floats:
    """shape=(n, 4, 4)"""
    return np.array([solver.forward(q) for q in joints])


def position_off(found: Floats, wanted: Floats) -> float:
    return float(np.linalg.norm(found[:3, 3] - wanted[:3, 3]))


def rotation_off(found: Floats, wanted: Floats) -> float:
    """Angle between two orientations, exact for small ones."""
    R = found[:3, :3].T @ wanted[:3, :3]
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(float(np.linalg.norm(skew)), float(np.trace(R)) - 1.0)


def axis_off(found: Floats, wanted: Floats, axis: int = 2) -> float:
    """Angle between the tool's axes, exact for small ones."""
    a, b = found[:3, axis], wanted[:3, axis]
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def is_within_limits(robot: truing.Robot, joints: Floats) -> bool:
    driven = [robot.joints[k] for k in robot.driven_joints()]
    return all(joint.lower <= value <= joint.upper for joint, value in zip(driven, joints, strict=True))


def wrapped(angles: Floats) -> Floats:
    """To within half a turn: which turn is nearest to the seed may hang on the last digit."""
    return np.remainder(angles + math.pi, 2 * math.pi) - math.pi
