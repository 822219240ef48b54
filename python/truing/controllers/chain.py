# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Joint origins of a robot, as descriptions hold them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.chains import FixedFrames
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]
_ALONG_Z = 1e-15  # sine of an axis with z, below which it is rounding


def origins(links: Sequence[FixedFrames]) -> list[Floats]:
    """Of every joint in the frame that the joint before it moves, and what follows the last joint."""
    frames, after = [], np.eye(4)
    for link in links:
        frames.append(after @ link.before)
        after = link.after
    return [*frames, after]


def about_z(links: Sequence[FixedFrames]) -> list[FixedFrames]:
    """The same chain with every axis along z of its joint's frame."""
    out = []
    for link in links:
        turn = np.eye(4)
        turn[:3, :3] = _z_to(link.axis)
        out.append(
            FixedFrames(link.joint, np.array([0.0, 0.0, 1.0]), link.before @ turn, turn.T @ link.after)
        )
    return out


def _z_to(axis: Floats) -> Floats:
    """A rotation that brings z to `axis`, by the shortest way."""
    z = np.array([0.0, 0.0, 1.0])
    normal = np.cross(z, axis)
    sine, cosine = float(np.linalg.norm(normal)), float(axis[2])
    if sine < _ALONG_Z:
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
