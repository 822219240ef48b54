# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Errors on rows without the ends of each recording, where an arm stands, starts and stops.

Both sides go through a Butterworth of fourth order, forth and back; rows are thinned. Standard practice is
fitted to such rows as well, with Pinocchio's regressor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from truing.dynamics import Recording, predict
from truing.model import Robot

Floats = NDArray[np.float64]

END = 0.5  # [s] left out at both ends
ROWS_A_SECOND = 25.0
SMOOTH_SIGN = 0.01  # [rad/s] of the hyperbolic tangent that stands for the direction
ROUNDS = 4  # of weighting
SMALLEST = 1e-10  # eigenvalue to the largest: parameters that no torque shows


@dataclass(frozen=True)
class Rows:
    """Rows of some recordings."""

    measured: Floats  # shape=(rows, joints) [Nm]
    nominal: Floats  # the same of the URDF
    named: Floats  # of the robot found
    columns: Floats  # of standard practice for parameters of one, shape=(rows, joints, parameters)


def rows_without_ends(urdf: Path, found: Robot, recordings: Sequence[Recording], cutoff: float) -> Rows:
    """found: the robot as named; its drives' constants make torques of currents. cutoff: [Hz]"""
    model = pin.buildModelFromUrdf(str(urdf))
    parts = [_rows_of(model, found, one, cutoff) for one in recordings]
    return Rows(*(np.concatenate(table) for table in zip(*parts, strict=True)))


def _rows_of(
    model: pin.Model, found: Robot, recording: Recording, cutoff: float
) -> tuple[Floats, Floats, Floats, Floats]:
    step = float(np.median(np.diff(recording.time)))
    gains = [found.joints[index].torque_per_ampere or 1.0 for index in found.driven_joints()]

    def low_passed(table: Floats) -> Floats:
        return np.asarray(filtfilt(*butter(4, 2.0 * cutoff * step), table, axis=0))

    position = low_passed(np.asarray(recording.position))
    speed = np.gradient(position, step, axis=0)
    acceleration = np.gradient(speed, step, axis=0)
    direction = low_passed(np.tanh(speed / SMOOTH_SIGN))
    predicted = np.asarray(predict(found, recording, cutoff=cutoff).current) * gains
    named, measured = low_passed(predicted), low_passed(np.asarray(recording.current) * gains)

    end, each = round(END / step), round(1.0 / (ROWS_A_SECOND * step))
    kept = slice(end, len(position) - end, each)
    states = list(zip(position[kept], speed[kept], acceleration[kept], strict=True))
    data = model.createData()
    nominal = np.array([pin.rnea(model, data, *state) for state in states])
    links = np.array([pin.computeJointTorqueRegressor(model, data, *state).copy() for state in states])
    drives = np.concatenate(
        [_at_own_joint(one[kept]) for one in (direction, speed, np.ones_like(speed))], axis=2
    )
    return measured[kept], nominal, named[kept], np.concatenate([links, drives], axis=2)


def _at_own_joint(table: Floats) -> Floats:
    """A parameter for every joint. shape=(rows, joints, joints)"""
    return np.asarray(table[:, :, None] * np.eye(table.shape[1]))


def standard_practice(fitted: Rows, tested: Rows) -> Floats:
    """Base parameters, Coulomb, viscous, offset, each joint weighted by its error (Gautier 1997): torques of
    `tested`, shape=(rows, joints) [Nm].
    """
    weight = np.ones(fitted.measured.shape[1])
    for _ in range(ROUNDS):
        gram = np.einsum("j,ija,ijb->ab", weight, fitted.columns, fitted.columns, optimize=True)
        right = np.einsum("j,ija,ij->a", weight, fitted.columns, fitted.measured, optimize=True)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        values = np.linalg.pinv(gram / np.outer(scale, scale), SMALLEST, hermitian=True) @ (right / scale)
        values /= scale
        weight = 1.0 / np.mean((fitted.columns @ values - fitted.measured) ** 2, axis=0)
    return np.asarray(tested.columns @ values)
