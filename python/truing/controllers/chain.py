# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A robot as other programs hold one: fixed frames between joints that turn about, or move along, one axis.

    T_before_after = before @ (motion about or along axis) @ after

Joint zeros are in `before`: the joint is at ratio * reading.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Link:
    """A joint and the fixed frames about it, shape=(4, 4) [m]."""

    joint: _core.Joint
    axis: Floats  # shape=(3,)
    before: Floats
    after: Floats


def links_of(robot: _core.Robot) -> list[Link]:
    return [_link(joint, robot.convention) for joint in robot.joints]


def _link(joint: _core.Joint, convention: str) -> Link:
    prismatic = joint.type == "prismatic"
    if convention == "urdf":
        axis = np.asarray(joint.axis, dtype=float)
        return Link(
            joint, axis, np.asarray(joint.T_parent_joint) @ _motion(joint, axis, joint.offset), np.eye(4)
        )
    axis = np.array([0.0, 0.0, 1.0])
    # Rz(theta) and Tz(d) commute with the joint, so the link's constant part of both stands before it.
    turn = joint.theta + (0.0 if prismatic else joint.offset)
    slide = joint.d + (joint.offset if prismatic else 0.0)
    screw = _frame((0, 0, turn), (0, 0, slide))
    twist = _frame((joint.alpha, 0, 0), (joint.a, 0, 0))
    lean = _frame((0, joint.beta, 0), (0, 0, 0))
    if convention == "dh":
        return Link(joint, axis, screw, twist @ lean)
    return Link(joint, axis, twist @ lean @ screw, np.eye(4))


def _frame(angles: Sequence[float], xyz: Sequence[float]) -> Floats:
    """Rz Ry Rx of angles about x, y, z [rad], at xyz [m]."""
    T = np.eye(4)
    T[:3, :3] = rotations_from_angles(np.array([angles], dtype=float), "zyx")[0]
    T[:3, 3] = xyz
    return T


def _motion(joint: _core.Joint, axis: Floats, value: float) -> Floats:
    T = np.eye(4)
    if joint.type == "prismatic":
        T[:3, 3] = axis * value
    else:
        T[:3, :3] = rotations_from_angles((axis * value)[None], "rotation-vector")[0]
    return T


def origins(links: Sequence[Link]) -> list[Floats]:
    """Of every joint in the frame that the joint before it moves, and what follows the last joint."""
    frames, after = [], np.eye(4)
    for link in links:
        frames.append(after @ link.before)
        after = link.after
    return [*frames, after]


def about_z(links: Sequence[Link]) -> list[Link]:
    """The same chain with every axis along z of its joint's frame."""
    out = []
    for link in links:
        turn = np.eye(4)
        turn[:3, :3] = _z_to(link.axis)
        out.append(Link(link.joint, np.array([0.0, 0.0, 1.0]), link.before @ turn, turn.T @ link.after))
    return out


def _z_to(axis: Floats) -> Floats:
    """A rotation that brings z to `axis`, by the shortest way."""
    z = np.array([0.0, 0.0, 1.0])
    normal = np.cross(z, axis)
    sine, cosine = float(np.linalg.norm(normal)), float(axis[2])
    if sine < 1e-15:
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    angle = math.atan2(sine, cosine)
    return np.asarray(rotations_from_angles((normal / sine * angle)[None], "rotation-vector")[0])


def robot_of(frames: Sequence[Floats], like: _core.Robot, axes: Sequence[Floats]) -> _core.Robot:
    """A robot of joint origins, those of `origins`, with the joints of `like`: what a reader makes of a
    file.
    """
    joints = [
        _core.Joint(
            joint.name,
            type=joint.type,
            T_parent_joint=T,
            axis=axis,
            driven_by=list(joint.driven_by),
            lower=joint.lower,
            upper=joint.upper,
        )
        for joint, T, axis in zip(like.joints, frames, axes, strict=False)
    ]
    targets = [_core.Target(t.name, frames[-1] @ np.asarray(t.T_last_target)) for t in like.targets]
    return _core.Robot(like.name, convention="urdf", joints=joints, targets=targets, gravity=like.gravity)
