# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inverse kinematics and compensation: joints for targets, commands that make up for the robot's errors."""

from truing._core import (
    Branches as Branches,
    Compensated as Compensated,
    CompensateOptions as CompensateOptions,
    Compensations as Compensations,
    Compensator as Compensator,
    Conditions as Conditions,
    InverseOptions as InverseOptions,
    InverseSolver as InverseSolver,
    JointPath as JointPath,
    PathGap as PathGap,
    PathOptions as PathOptions,
    Solution as Solution,
    Solutions as Solutions,
    Task as Task,
)
from truing.inverse_kinematics.api import (
    compensate as compensate,
    inverse as inverse,
    inverse_path as inverse_path,
)
from truing.inverse_kinematics.between import (
    ContactBetween as ContactBetween,
    contacts_between as contacts_between,
)
