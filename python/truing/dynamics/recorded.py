# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What was recorded of a robot's drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]


def driven_joints(robot: _core.Robot) -> list[_core.Joint]:
    """The joints that have a reading, in chain order."""
    return [robot.joints[index] for index in robot.driven_joints()]


def torque_unit(joint: _core.Joint) -> str:
    return "Nm" if joint.type == "revolute" else "N"


def measured_torque(robot: _core.Robot, recording: _core.Recording) -> Floats:
    """Torques as measured, else currents times the drives' constants (1 Nm/A where none is known); NaN where
    there is neither. shape=(n, joints) [Nm | N]
    """
    joints = driven_joints(robot)
    out = np.full((len(recording), len(joints)), np.nan)
    if recording.current.shape[1]:
        out = np.asarray(recording.current) * [joint.torque_per_ampere or 1.0 for joint in joints]
    if recording.torque.shape[1]:
        out = np.where(np.isnan(recording.torque), out, recording.torque)
    return out
