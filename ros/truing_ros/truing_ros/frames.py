# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames as ROS messages have them: position and quaternion, scalar last."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Frame(NamedTuple):
    """A pose: ``T_a_b`` maps b-coordinates into a."""

    position: Floats  # shape=(3,) [m]
    quaternion: Floats  # shape=(4,) x y z w, unit length

    def __mul__(self, other: Frame) -> Frame:  # type: ignore[override]
        return Frame(
            self.position + rotated(self.quaternion, other.position),
            product(self.quaternion, other.quaternion),
        )

    def inverse(self) -> Frame:
        back = self.quaternion * [-1.0, -1.0, -1.0, 1.0]
        return Frame(-rotated(back, self.position), back)


def product(p: Floats, q: Floats) -> Floats:
    """Hamilton product of two quaternions x y z w."""
    vector = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
    return np.append(vector, p[3] * q[3] - p[:3] @ q[:3])


def rotated(q: Floats, v: Floats) -> Floats:
    """A vector turned by a quaternion x y z w of unit length."""
    across = 2.0 * np.cross(q[:3], v)
    return v + q[3] * across + np.cross(q[:3], across)


def frame_of(position: Any, orientation: Any) -> Frame:
    """Of the two parts of a message, which have x, y, z and x, y, z, w. Raises ValueError where they hold no
    pose: NaN, or a quaternion that is not of unit length.
    """
    p = np.array([position.x, position.y, position.z], dtype=float)
    q = np.array([orientation.x, orientation.y, orientation.z, orientation.w], dtype=float)
    if not (np.isfinite(p).all() and abs(np.linalg.norm(q) - 1.0) < 1e-3):
        raise ValueError(f"holds no pose: position {p.tolist()}, quaternion x y z w {q.tolist()}")
    return Frame(p, q / np.linalg.norm(q))


def fill(transform: Any, frame: Frame) -> None:
    """Writes a frame into the `transform` of a TransformStamped."""
    for axis, value in zip("xyz", frame.position, strict=True):
        setattr(transform.translation, axis, float(value))
    for part, value in zip("xyzw", frame.quaternion, strict=True):
        setattr(transform.rotation, part, float(value))


def mean_frame(frames: list[Frame]) -> Frame:
    """Of frames that lie close together: mean position, mean direction of the quaternions."""
    quaternions = np.array([frame.quaternion for frame in frames])
    quaternions *= np.where(quaternions @ quaternions[0] < 0.0, -1.0, 1.0)[:, None]
    mean = quaternions.mean(axis=0)
    return Frame(np.mean([frame.position for frame in frames], axis=0), mean / np.linalg.norm(mean))
