# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A robot as other programs hold one: fixed frames between joints that turn about, or move along, one axis.

    T_before_after = before @ (motion about or along axis) @ after

Joint zeros are in `before`: the joint is at ratio * reading, and one that follows others at the weighted sum
of theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FixedFrames:
    """A joint and the fixed frames about it, shape=(4, 4) [m]."""

    joint: _core.Joint
    axis: Floats  # shape=(3,) in the joint's frame
    before: Floats
    after: Floats


def coupling_of(drivers: Sequence[tuple[str, Sequence[tuple[str, float]]]]) -> Floats:
    """C(i, j): by how much joint i moves when joint j does, itself or as one that others follow.

    drivers: of every joint its name, and names and weights of those that it follows, in any order of the
    chain. m = own + W m, so that C = (I - W)^-1.
    """
    number = {name: k for k, (name, _) in enumerate(drivers)}
    weights = np.zeros((len(number), len(number)))
    for k, (_, led_by) in enumerate(drivers):
        for driver, weight in led_by:
            weights[k, number[driver]] = weight
    return np.asarray(np.linalg.inv(np.eye(len(number)) - weights))


def zeros_of(robot: _core.Robot) -> Floats:
    """Motion of every joint at readings of zero: its own zero and those of the joints that it follows.
    shape=(joints,) [rad | m]"""
    coupling = coupling_of([(joint.name, joint.driven_by) for joint in robot.joints])
    return np.asarray(coupling @ [joint.offset for joint in robot.joints])


def fixed_frames(robot: _core.Robot) -> list[FixedFrames]:
    """Of every joint, in chain order."""
    return [
        _frames(joint, robot.convention, zero)
        for joint, zero in zip(robot.joints, zeros_of(robot).tolist(), strict=True)
    ]


def _frames(joint: _core.Joint, convention: str, zero: float) -> FixedFrames:
    prismatic = joint.type == "prismatic"
    if convention == "urdf":
        axis = np.asarray(joint.axis, dtype=float)
        before = np.asarray(joint.T_parent_joint) @ _motion(axis, zero, prismatic)
        return FixedFrames(joint, axis, before, np.eye(4))
    axis = np.array([0.0, 0.0, 1.0])
    # Rz(theta) and Tz(d) commute with the joint, so the link's constant part of both stands before it.
    turn = joint.theta + (0.0 if prismatic else zero)
    slide = joint.d + (zero if prismatic else 0.0)
    screw = _frame((0, 0, turn), (0, 0, slide))
    twist = _frame((joint.alpha, 0, 0), (joint.a, 0, 0))
    lean = _frame((0, joint.beta, 0), (0, 0, 0))
    if convention == "dh":
        return FixedFrames(joint, axis, screw, twist @ lean)
    return FixedFrames(joint, axis, twist @ lean @ screw, np.eye(4))


def _frame(angles: Sequence[float], xyz: Sequence[float]) -> Floats:
    """Rz Ry Rx of angles about x, y, z [rad], at xyz [m]."""
    T = np.eye(4)
    T[:3, :3] = rotations_from_angles(np.array([angles], dtype=float), "zyx")[0]
    T[:3, 3] = xyz
    return T


def _motion(axis: Floats, value: float, prismatic: bool) -> Floats:
    T = np.eye(4)
    if prismatic:
        T[:3, 3] = axis * value
    else:
        T[:3, :3] = rotations_from_angles((axis * value)[None], "rotation-vector")[0]
    return T
