# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Zeros of a servo arm for LeRobot: by how much each motor's middle is off, and a calibration with it moved.

The chain's zero is the recording's angle less the model's at the same place. With the calibration that is
written here the robot reads what the model would: then the model keeps its own zeros.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

from truing import _core
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.servo.chain import ServoChain
from truing.errors import InputError
from truing.files import (
    load_lerobot_calibration,
    matched_motors,
    moved_zero,
    radians_per_count,
)

_ZEROS_ALONE = "LeRobot holds zeros alone: `--to mjcf` has it"


def write(
    chain: ServoChain, calibration: Path | None, robot: _core.Robot | None = None
) -> tuple[dict[str, str], list[NotWritten]]:
    """Text by file name: offsets.json, and the calibration under its own name if one is given.

    robot: whose joints the motors are matched with; None: the chain's names. Raises InputError: a calibration
    of other motors, a zero that its ranges have no room for.
    """
    zeros = {
        joint: drive.zero
        for joint, drive, slides in zip(chain.joints, chain.drives, chain.prismatic, strict=True)
        if not slides
    }
    offsets = {
        joint: {
            "zero_deg": math.degrees(zero),
            "counts": round(zero / radians_per_count()),
        }
        for joint, zero in zeros.items()
    }
    files = {"offsets.json": json.dumps(offsets, indent=4) + "\n"}
    left = [NotWritten(name, math.nan, _ZEROS_ALONE) for name in _departures(chain)]
    if calibration is None:
        return files, left
    motors = load_lerobot_calibration(calibration)
    names = matched_motors(calibration, motors, robot or _named(chain))
    for joint, zero in zeros.items():
        name = names[joint]
        motors[name] = moved_zero(name, motors[name], -zero)
        rest = abs(zero - offsets[joint]["counts"] * radians_per_count())
        if rest > 0.0:
            reason = f"to half counts, {math.degrees(rest):.3f} deg of it"
            left.append(NotWritten(f"zero.{joint}", math.nan, reason))
    if calibration.name in files:
        raise InputError(f"{calibration}: would be overwritten by offsets.json: give it another name")
    files[calibration.name] = json.dumps({n: asdict(m) for n, m in motors.items()}, indent=4) + "\n"
    return files, left


def _named(chain: ServoChain) -> _core.Robot:
    """A robot with the chain's joints, for their names."""
    return _core.Robot("names", joints=[_core.Joint(name) for name in chain.joints])


def _departures(chain: ServoChain) -> list[str]:
    return ["gain, friction, delay and whatever else was found of the drives"] if chain.joints else []
