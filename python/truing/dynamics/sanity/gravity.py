# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which way is down? Arms hang from ceilings and walls, and the robot's file seldom says so."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]

WIDE, NARROW = math.radians(30.0), math.radians(0.5)  # steps from the best of the coarse directions
AS_NEAR = math.radians(2.5)
COARSE = [
    np.array(way) / math.sqrt(float(np.dot(way, way)))
    for way in itertools.product((-1.0, 0.0, 1.0), repeat=3)
    if any(way)
]  # axes, diagonals and corners of a cube: 45° apart or less


def best_direction(left: Callable[[Floats], float]) -> Floats:
    """The unit vector at which `left` is least: the best coarse one, then steps that are halved; a coarse one
    that is as near as friction and wrong masses let it be known. shape=(3,)
    """
    best = min(COARSE, key=left)
    least, step = left(best), WIDE
    while step > NARROW:
        other = min(_around(best, step), key=left)
        if left(other) < least:
            best, least = other, left(other)
        else:
            step *= 0.5
    plain = max(COARSE, key=lambda one: float(one @ best))
    return plain if float(plain @ best) > math.cos(AS_NEAR) else best


def held_against(robot: _core.Robot, q: Floats, place: Floats | None = None) -> Floats:
    """J^T f of a force of one at the tool along each axis of the base: what a mass of one there would weigh.
    shape=(n, joints, 3); place: [m] in the frame after the last link, in place of the tool's.
    """
    alone = robot.copy()
    for joint in alone.joints:
        joint.mass, joint.inertia, joint.rotor_inertia = 0.0, np.zeros((3, 3)), 0.0
    alone.joints[-1].mass = 1.0
    if place is not None:
        alone.joints[-1].center_of_mass = place
    elif robot.targets:
        alone.joints[-1].center_of_mass = np.array(robot.targets[0].T_last_target)[:3, 3]
    return np.stack([weight(alone, axis, q) for axis in np.eye(3)], axis=-1)


def weight(robot: _core.Robot, down: Floats, q: Floats) -> Floats:
    """Torques that hold the links at rest under this gravity [m/s^2] in the base frame. shape=(n, joints)"""
    robot = under(robot, down)
    return np.asarray(_core.rigid_torques(robot, q, np.zeros_like(q), np.zeros_like(q)))


def under(robot: _core.Robot, down: Floats) -> _core.Robot:
    """The robot with this gravity [m/s^2] in its base frame."""
    out = robot.copy()
    out.gravity = down
    return out


def in_words(gravity: Floats) -> str:
    """Its direction as a unit vector, "0.00 -1.00 0.00"."""
    size = float(np.linalg.norm(gravity))
    return " ".join(f"{value:.2f}" for value in np.round(gravity / size, 2) + 0.0) if size else "nothing"


def _around(direction: Floats, angle: float) -> list[Floats]:
    """Eight directions at an angle [rad] from one."""
    side = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    side /= np.linalg.norm(side)
    up = np.cross(direction, side)
    turns = [k * math.pi / 4.0 for k in range(8)]
    return [
        math.cos(angle) * direction + math.sin(angle) * (math.cos(turn) * side + math.sin(turn) * up)
        for turn in turns
    ]
