# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Arms as five makers count their joints, and the same arms as they were built."""

from __future__ import annotations

import math

import numpy as np

from truing.model import Joint, Robot

# Axes at joint readings zero, sign included, and where the next axis is [m]: x, z in the plane of the arm.
_UPRIGHT = ((0, 0, 0.2), (0.15, 0, 0.3), (0, 0, 0.6), (0.3, 0, 0.1), (0.34, 0, 0), (0.08, 0, 0))
# KUKA's arm is stretched forward at zero.
_FLAT = ((0, 0, 0.2), (0.15, 0, 0.3), (0.6, 0, 0), (0.3, 0, -0.1), (0.34, 0, 0), (0.08, 0, 0))
_ARMS = {
    "abb": (_UPRIGHT, "z y y x y x"),
    "fanuc": (_UPRIGHT, "z y -y -x -y -x"),
    "yaskawa": (_UPRIGHT, "z y -y -x -y -x"),
    "kuka": (_FLAT, "-z y y -x y -x"),
}
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
# Where flange z points forward at zero, as all four have it.
_FLANGE = np.array([[0.0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])

# Universal Robots' data sheet of the UR10: a, d [m], alpha [rad].
_UR10 = (
    (0, 0.1273, math.pi / 2),
    (-0.612, 0, 0),
    (-0.5723, 0, 0),
    (0, 0.163941, math.pi / 2),
    (0, 0.1157, -math.pi / 2),
    (0, 0.0922, 0),
)


def nominal(brand: str) -> Robot:
    """The robot as its controller believes it to be."""
    if brand == "ur":
        joints = [
            Joint(f"J{k + 1}", a=a, d=d, alpha=alpha, lower=-2 * math.pi, upper=2 * math.pi)
            for k, (a, d, alpha) in enumerate(_UR10)
        ]
        return Robot("UR10", joints=joints)
    places, axes = _ARMS[brand]
    joints = []
    for k, (place, axis) in enumerate(zip(places, axes.split(), strict=True)):
        T = np.eye(4)
        T[:3, 3] = place
        sign = -1.0 if axis.startswith("-") else 1.0
        limit = math.radians(350 if k == 5 else 185 if k == 3 else 170)
        direction = sign * np.array(_AXES[axis[-1]], dtype=float)
        joints.append(Joint(f"J{k + 1}", T_parent_joint=T, axis=direction, lower=-limit, upper=limit))
    last = joints[-1].T_parent_joint
    # The flange frame belongs after joint 6: its turn stands in the place of a fixed, passive joint.
    end = Joint("flange", T_parent_joint=_FLANGE, axis=np.array([0.0, 0, 1]), driven_by=[("J6", 0.0)])
    assert last.shape == (4, 4)
    return Robot(brand, joints=[*joints, end], convention="urdf")


def built(brand: str, seed: int = 1) -> Robot:
    """The same arm with a millimetre and a milliradian here and there: what nobody but the calibration
    knows."""
    rng = np.random.default_rng(seed)
    robot = nominal(brand)
    for joint in robot.joints:
        if joint.passive:
            continue
        joint.offset = float(rng.normal(0, 1e-3))
        if brand == "ur":
            joint.a, joint.d = joint.a + float(rng.normal(0, 5e-4)), joint.d + float(rng.normal(0, 5e-4))
            joint.alpha = joint.alpha + float(rng.normal(0, 5e-4))
        else:
            T = np.array(joint.T_parent_joint)
            T[:3, 3] += rng.normal(0, 5e-4, 3)
            joint.T_parent_joint = T
    return robot
