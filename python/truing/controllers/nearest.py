# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What to enter where the links cannot be changed: joint zeros, tool and base with which the controller's
robot comes nearest to the calibrated one, and how far it stays away.

The zero of the first joint cannot be told from the base, that of the last one from the tool: these take them.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.controllers.distances import Distance, between, poses_of, tools, without_effects
from truing.errors import InputError
from truing.files.flange import last_to_flange
from truing.identification import identify

Floats = NDArray[np.float64]
Freedom = Literal["offset", "ratio"]


@dataclass(frozen=True)
class Nearest:
    """robot: the controller's, with what is to be entered. T_last_flange: the controller's flange in its last
    joint's frame. before: with tool and base alone; after: with all.
    """

    robot: _core.Robot
    T_last_flange: Floats
    before: Distance
    after: Distance


def nearest(nominal: _core.Robot, calibrated: _core.Robot, freedoms: Collection[Freedom]) -> Nearest:
    """The robot that a controller can be made to believe in. Raises InputError where the two do not belong
    together.
    """
    _check_same_robot(nominal, calibrated)
    poses = poses_of(calibrated)
    predicted = _core.predict(calibrated, poses)
    data = _core.Measurements(
        poses.joints,
        positions=np.asarray(predicted.position),
        orientations=np.asarray(predicted.orientation),
    )
    started = without_effects(nominal).replace(
        T_measurement_base=calibrated.T_measurement_base, targets=[calibrated.targets[0]]
    )
    frames = _fitted(started, data, ["base.*", "tool.*"])
    names = [nominal.joints[index].name for index in nominal.driven_joints()]
    driven = list(zip(names, calibrated.driven_joints(), strict=True))
    free = [f"{name}.offset" for name in names[1:-1] if "offset" in freedoms]
    if "ratio" in freedoms:
        # Only those that were found: a ratio that nobody asked for would bend to errors of the links.
        pairs = ((nominal.joint(name).ratio, calibrated.joints[index].ratio) for name, index in driven)
        free += [
            f"{name}.ratio" for (name, _), (one, other) in zip(driven, pairs, strict=True) if one != other
        ]
    found = _fitted(frames, data, ["base.*", "tool.*", *free]) if free else frames
    bare = calibrated.replace(targets=[calibrated.targets[0]])
    return Nearest(found, last_to_flange(nominal), between(bare, frames, poses), between(bare, found, poses))


def _check_same_robot(nominal: _core.Robot, calibrated: _core.Robot) -> None:
    if nominal.driven_count != calibrated.driven_count:
        raise InputError(
            f"{nominal.name} has {nominal.driven_count} driven joints, {calibrated.name} has"
            f" {calibrated.driven_count}: these are not the same robot"
        )


def _fitted(robot: _core.Robot, data: _core.Measurements, free: list[str]) -> _core.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = identify(
            robot,
            data,
            free=free,
            loss="none",
            test_share=0.0,
            raise_if_not_converged=False,
        )
    if not np.isfinite(tools(found.robot, data)).all():
        raise InputError(f"{robot.name} cannot be brought to the calibrated robot: is it the nominal one?")
    return found.robot
