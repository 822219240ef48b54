# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where the maker's flange is in a robot: controllers have their tools there, and programs their poses.

A target called `flange` says it. Of a URDF or MJCF it is the tip, until a tool is measured in its place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]
FLANGE = "flange"


def says_flange(robot: _core.Robot) -> bool:
    return any(target.name == FLANGE for target in robot.targets)


def last_to_flange(robot: _core.Robot) -> Floats:
    """shape=(4, 4) [m] the flange in the frame after the last joint: the target of that name; else the first
    target of a robot whose joints are a URDF's; else that frame itself.
    """
    named = [target for target in robot.targets if target.name == FLANGE]
    if not named and robot.convention != "urdf":
        return np.eye(4)
    return np.array((named or robot.targets)[0].T_last_target)


def with_flange(robot: _core.Robot, nominal: _core.Robot) -> _core.Robot:
    """The robot with the nominal one's flange among its targets, where its own would be taken to be
    elsewhere: its first target is a tool that was measured. Not where a joint has that name.
    """
    T_last_flange = last_to_flange(nominal)
    taken = any(joint.name == FLANGE for joint in robot.joints)
    if taken or np.array_equal(last_to_flange(robot), T_last_flange):
        return robot
    return robot.replace(targets=[*robot.targets, _core.Target(FLANGE, T_last_flange)])
