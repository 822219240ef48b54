# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The recorded arm and the simulated one over each other, for a report that plays them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from truing import _core
from truing.drawing import robot_picture
from truing.files import Looks
from truing.report.arrays import subsample
from truing.report.scene import RobotPicture

FRAMES = 600  # of a film: more are not seen


def arm_picture(
    robot: _core.Robot,
    paths: Sequence[Mapping[str, Any]],
    names: Mapping[str, str],
    looks: Looks | None = None,
) -> RobotPicture | None:
    """The film of `paths` (`truing.dynamics.rollout.paths_of`): measured motion and that of every model,
    `names` in words, what was named first. None where a joint of the robot is missing in the paths.
    """
    driven = [robot.joints[index] for index in robot.driven_joints()]
    by_joint = {path["joint"]: path for path in paths}
    if not paths or not all(joint.name in by_joint for joint in driven):
        return None
    ordered = [by_joint[joint.name] for joint in driven]
    scale = [math.radians(1.0) if joint.type == "revolute" else 1e-3 for joint in driven]
    ahead = np.asarray(ordered[0]["ahead"], dtype=np.float64)
    models = sorted((m for m in ordered[0]["simulated"] if m in names), key=lambda m: m != "named")
    simulated = {
        model: np.stack(
            [s * np.asarray(p["simulated"][model]) for s, p in zip(scale, ordered, strict=True)], axis=1
        )
        for model in models
    }
    known = np.isfinite(ahead)
    for positions in simulated.values():
        known &= np.isfinite(positions).all(axis=1)
    rows = subsample(np.flatnonzero(known), FRAMES)
    if not models or rows.size < 2:
        return None
    measured = np.stack(
        [s * np.interp(ahead[rows], p["time"], p["measured"]) for s, p in zip(scale, ordered, strict=True)],
        axis=1,
    )
    play = {
        "time": ahead[rows] - ahead[rows[0]],
        "name": "recorded",
        "first": measured,
        "others": {names[model]: simulated[model][rows] for model in models},
    }
    return robot_picture(robot, play=play, stand=measured[0], looks=looks)
