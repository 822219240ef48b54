# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames of numbers that a file holds as matrices or quaternions: checked, and made exact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.common import shown
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import rotations_from_quaternions

Floats = NDArray[np.float64]
Where = Callable[[int], str]  # what messages call entry k: "poses.txt, line 3"

_LARGEST = 1e6  # [m] of a position
_OFF = 1e-3  # entries of R^T R - I: what a few digits leave


def frames_from_rows(values: Floats, where: Where) -> tuple[Floats, bool]:
    """Frames, shape=(n, 4, 4), of shape=(n, 16), matrices row by row or column by column, or shape=(n, 12)
    without their last rows; and whether they were written column by column.

    Raises InputError.
    """
    values = np.asarray(values, dtype=np.float64)
    if values.shape[1] == 12:
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(values), 4))
        values = np.column_stack([values, last])
    matrices = values.reshape(-1, 4, 4)
    last = np.array([0.0, 0.0, 0.0, 1.0])
    by_rows = np.abs(matrices[:, 3, :] - last).max(axis=1) < 1e-6
    by_columns = np.abs(matrices[:, :, 3] - last).max(axis=1) < 1e-6
    columns = not by_rows.all() and bool(by_columns.all())
    if columns:
        matrices = np.swapaxes(matrices, 1, 2)
    elif not by_rows.all():
        row = int(np.argmin(by_rows))
        raise InputError(
            f"{where(row)}: the matrix ends in {' '.join(f'{v:.6g}' for v in matrices[row, 3])}, expected its"
            " last row 0 0 0 1 (or, written column by column, its last column)"
        )
    return frames_from_parts(matrices[:, :3, :3], matrices[:, :3, 3], where), columns


def frames_from_parts(rotations: Floats, positions: Floats, where: Where) -> Floats:
    """Frames, shape=(n, 4, 4), of rotation matrices, shape=(n, 3, 3), and positions, shape=(n, 3) [m]."""
    _check_positions(positions, where)
    finite = np.isfinite(rotations).all(axis=(1, 2))
    products = np.swapaxes(rotations, 1, 2) @ np.where(np.isfinite(rotations), rotations, 0.0)
    off = np.abs(np.where(np.isfinite(products), products, np.inf) - np.eye(3)).max(axis=(1, 2))
    wrong = ~finite | ~(off < _OFF)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{where(row)}: its three columns of rotation are not of unit length and square to each other"
            f" (off by {off[row]:.3g}), expected a rotation matrix with four digits or more"
        )
    mirrored = np.linalg.det(rotations) < 0
    if mirrored.any():
        raise InputError(
            f"{where(int(np.argmax(mirrored)))}: the rotation is a mirror (determinant -1), expected +1: is"
            " one axis negated?"
        )
    u, _, vt = np.linalg.svd(rotations)
    out = np.tile(np.eye(4), (len(rotations), 1, 1))
    out[:, :3, :3] = u @ vt
    out[:, :3, 3] = positions
    return out


def frames_from_quaternions(positions: Floats, q: Floats, where: Where) -> Floats:
    """Frames, shape=(n, 4, 4), of positions, shape=(n, 3) [m], and quaternions, shape=(n, 4), w x y z."""
    _check_positions(positions, where)
    length = np.linalg.norm(q, axis=1)
    wrong = ~(np.abs(length - 1.0) < UNIT_LENGTH_OFF)
    if wrong.any():
        row = int(np.argmax(wrong))
        w, x, y, z = q[row]
        raise InputError(
            f"{where(row)}: found the quaternion x {x:.6g} y {y:.6g} z {z:.6g} w {w:.6g} of length"
            f" {length[row]:.6g}, expected 1"
        )
    out = np.tile(np.eye(4), (len(q), 1, 1))
    out[:, :3, :3] = rotations_from_quaternions(q)
    out[:, :3, 3] = positions
    return out


def _check_positions(positions: Floats, where: Where) -> None:
    wrong = ~(np.abs(positions) < _LARGEST)
    if wrong.any():
        row, axis = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
        raise InputError(
            f"{where(int(row))}: found {'xyz'[axis]} = {shown(float(positions[row, axis]))}, expected a"
            " position in m"
        )
