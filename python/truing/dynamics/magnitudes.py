# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques that are magnitudes: many servos report the size of their current, and not which way it pushes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import measured_torque
from truing.errors import InputWarning

BOTH_WAYS = 0.2  # of a joint's travel, at least, in either direction
FEWEST = 2  # joints that show it
HELD = 0.9  # of the rows with the weight on one side: the joint is held up, and its torque has one sign
WEIGHTLESS = 0.1  # of the torque: less weight than that holds no sign
ROWS = 2000  # a recording, evenly picked, whose weight is looked at


def are_magnitudes(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> bool:
    """Whether no torque is ever below zero (or none above) at two joints or more that turn both ways and
    hold up no weight: friction and inertia have both signs there.
    """
    torque = np.concatenate([measured_torque(robot, one) for one in recordings])
    measured = np.isfinite(torque).any(axis=0)
    joints = np.flatnonzero(measured & _both_ways(recordings) & ~_held_up(robot, recordings))
    if len(joints) < FEWEST:
        return False
    least, most = np.nanmin(torque[:, joints], axis=0), np.nanmax(torque[:, joints], axis=0)
    one_sign = (least >= 0.0).all() or (most <= 0.0).all()
    return bool(one_sign and (most > least).all())


def commands_for_magnitudes(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> list[_core.Recording]:
    """The recordings without torques and currents, where these are magnitudes and commands are there. Those
    that are read in pieces stay as they are.
    """
    recordings = list(recordings)
    commanded = all(
        one.pieces is None and (one.command.shape[1] or one.torque_command.shape[1]) for one in recordings
    )
    if not recordings or not commanded or not are_magnitudes(robot, recordings):
        return recordings
    warnings.warn(
        "the torques (or currents) never change their sign though the joints turn both ways: they are"
        " magnitudes, and not used. The commands are, as of an arm without torques",
        InputWarning,
        stacklevel=2,
    )
    return [_without_torques(one) for one in recordings]


def _without_torques(recording: _core.Recording) -> _core.Recording:
    nothing = np.empty((np.size(recording.time), 0))
    return recording.replace(torque=nothing, current=nothing)


def _both_ways(recordings: Sequence[_core.Recording]) -> NDArray[np.bool_]:
    """Joints of whose travel a fifth or more goes either way. shape=(joints,)"""
    steps = np.concatenate([np.diff(one.position, axis=0) for one in recordings])
    up, down = np.maximum(steps, 0.0).sum(axis=0), np.maximum(-steps, 0.0).sum(axis=0)
    return np.asarray(np.minimum(up, down) > BOTH_WAYS * (up + down))


def _held_up(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> NDArray[np.bool_]:
    """Joints that the model's weight pulls to one side all the time. shape=(joints,)"""
    motion, torque = [], []
    for one in recordings:
        some = slice(None, None, max(1, np.size(one.time) // ROWS))
        motion.append(np.asarray(one.position)[some])
        torque.append(measured_torque(robot, one)[some])
    position = np.concatenate(motion)
    still = np.zeros_like(position)
    weight = np.asarray(_core.rigid_torques(robot, position, still, still))
    up = (weight > 0.0).mean(axis=0)
    loaded = _size(weight) > WEIGHTLESS * _size(np.nan_to_num(np.concatenate(torque)))
    return np.asarray(loaded & (np.maximum(up, 1.0 - up) > HELD))


def _size(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root mean square of each column."""
    return np.asarray(np.sqrt(np.mean(columns**2, axis=0)))
