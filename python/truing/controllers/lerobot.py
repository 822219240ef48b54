# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""LeRobot: a calibration JSON whose zeros are those that were found.

A joint in degrees is (count - middle of the range) * 360 / 4095, so the middle moves and homing_offset, a
register of the servo, stays. The range loses twice as much at one end: it never reaches beyond what was
recorded.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

from truing import _core
from truing.controllers.distances import between, dropped_effects, dropped_links, dropped_ratios, poses_of
from truing.controllers.nearest import Nearest
from truing.controllers.written import Written
from truing.files import load_lerobot_calibration, matched_motors, moved_zero, radians_per_count

_REASON = "LeRobot has zeros"


def written(found: Nearest, calibrated: _core.Robot, calibration: Path) -> Written:
    """calibration: the JSON that the robot was recorded with. Raises InputError."""
    motors = load_lerobot_calibration(calibration)
    matched = matched_motors(calibration, motors, found.robot)
    changed = dict(motors)
    again, lines = found.robot.copy(), []
    for index in found.robot.driven_joints():
        joint = again.joints[index]
        name = matched[joint.name]
        changed[name] = moved_zero(name, motors[name], joint.offset)
        taken = (motors[name].middle - changed[name].middle) * radians_per_count()
        lines.append(
            (
                joint.name,
                f"zero {math.degrees(taken):+.3f} deg ({math.degrees(joint.offset):+.3f} wanted), range"
                f" {changed[name].range_min} to {changed[name].range_max}",
            )
        )
        joint.offset = taken
    bare = calibrated.replace(targets=[calibrated.targets[0]])
    remaining = between(bare, again, poses_of(calibrated))
    return Written(
        files={
            calibration.name: json.dumps({name: asdict(motor) for name, motor in changed.items()}, indent=4)
            + "\n"
        },
        values={"motors": {name: asdict(motor) for name, motor in changed.items()}},
        lines=lines,
        dropped=[
            dropped_links(remaining, _REASON),
            *dropped_ratios(calibrated, _REASON),
            *dropped_effects(calibrated, _REASON),
        ],
        notes=[
            "one count is 0.088 deg, and a zero is exact to half of half of it",
            "LeRobot asks at the next connect which calibration to use: the file, not that of the motors."
            " Positions in percent change their scale with the range; policies and data sets of before keep"
            " the old zeros",
        ],
        remaining=remaining,
        before=found.before,
    )
