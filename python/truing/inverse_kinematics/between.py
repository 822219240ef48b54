# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Collisions on the way from one target of a path to the next: the core looks at the targets alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core

_TURN, _SLIDE = math.radians(1.0), 0.002  # [rad], [m] of any joint between two places that are looked at
_ROUNDING = 1e-9  # [m]


@dataclass(frozen=True)
class ContactBetween:
    """start: the target before, from 0. distance: of the two parts [m], where they are nearest on the
    way to the next.
    """

    start: int
    first: str
    second: str
    distance: float


def contacts_between(path: _core.JointPath, solver: _core.InverseSolver) -> list[ContactBetween]:
    """Where joints that go straight from target to target bring parts nearer than the scene's clearance."""
    scene, robot = solver.options.scene, solver.robot
    joints, reached = np.asarray(path.solutions.joints), np.asarray(path.solutions.reached)
    apart = {gap.start for gap in path.gaps}
    kinds = [robot.joints[k].type for k in robot.driven_joints()]
    steps = np.array([_SLIDE if kind == "prismatic" else _TURN for kind in kinds])
    found = []
    for k in range(len(joints) - 1):
        if k in apart or not (reached[k] and reached[k + 1]):
            continue
        worst = _nearest(scene, robot, joints[k], joints[k + 1], steps)
        if worst is not None and worst.distance < scene.clearance - _ROUNDING:
            found.append(ContactBetween(k, worst.first, worst.second, worst.distance))
    return found


def _nearest(
    scene: _core.Scene,
    robot: _core.Robot,
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    steps: NDArray[np.float64],
) -> _core.Contact | None:
    """The nearest pair of all places between two targets; None where nothing lies between."""
    count = math.ceil(float(np.max(np.abs(end - start) / steps)))
    shares = np.arange(1, count) / max(count, 1)
    contacts = [_core.nearest_contact(scene, robot, start + share * (end - start)) for share in shares]
    return min(contacts, key=lambda contact: contact.distance, default=None)
