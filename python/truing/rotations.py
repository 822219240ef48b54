# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Rotations and frames of many rows: quaternions (w x y z), angles, rotation vectors, interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rotations_from_quaternions(q: Floats) -> Floats:
    """shape=(n, 3, 3) of shape=(n, 4), scalar first; brought to unit length first."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def rotations_from_angles(angles: Floats, convention: str) -> Floats:
    """shape=(n, 3, 3) of three angles a row [rad].

    convention: "rotation-vector" (axis times angle, as Universal Robots), or the order in which rotations
    about turned axes are multiplied: "zyx" is Rz(rz) Ry(ry) Rx(rx). Where an axis comes twice ("zyz"), the
    columns rx, ry, rz hold first, second and third angle.
    """
    if convention == "rotation-vector":
        angle = np.linalg.norm(angles, axis=1)
        half = 0.5 * angle
        # sin(a/2)/a, also where a is 0
        scale = np.where(angle > 0, np.sin(half) / np.where(angle > 0, angle, 1.0), 0.5)
        return rotations_from_quaternions(np.column_stack([np.cos(half), scale[:, None] * angles]))
    out = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    twice = len(set(convention)) < 3
    for place, letter in enumerate(convention):
        axis = "xyz".index(letter)
        turn = angles[:, place if twice else axis]
        c, s = np.cos(turn), np.sin(turn)
        step = np.zeros((len(angles), 3, 3))
        j, k = (axis + 1) % 3, (axis + 2) % 3
        step[:, axis, axis] = 1.0
        step[:, j, j], step[:, j, k], step[:, k, j], step[:, k, k] = c, -s, s, c
        out = out @ step
    return out


def quaternions_from_rotations(rotations: Floats) -> Floats:
    """shape=(n, 4), scalar first and not negative, of shape=(n, 3, 3)."""
    r = np.asarray(rotations)
    trace = np.einsum("nii->n", r)
    # The largest of four squares is safe to divide by.
    squares = np.stack([1 + trace, *(1 + 2 * r[:, k, k] - trace for k in range(3))], axis=1)
    out = np.empty((len(r), 4))
    best = np.argmax(squares, axis=1)
    for k in range(4):
        rows = np.flatnonzero(best == k)
        if not rows.size:
            continue
        m, s = r[rows], 2 * np.sqrt(squares[rows, k])
        if k == 0:
            out[rows] = np.stack(
                [
                    s / 4,
                    (m[:, 2, 1] - m[:, 1, 2]) / s,
                    (m[:, 0, 2] - m[:, 2, 0]) / s,
                    (m[:, 1, 0] - m[:, 0, 1]) / s,
                ],
                axis=1,
            )
        else:
            i, j, h = k - 1, k % 3, (k + 1) % 3
            out[rows, 0] = (m[:, h, j] - m[:, j, h]) / s
            out[rows, 1 + i] = s / 4
            out[rows, 1 + j] = (m[:, j, i] + m[:, i, j]) / s
            out[rows, 1 + h] = (m[:, h, i] + m[:, i, h]) / s
    return out * np.where(out[:, :1] < 0, -1.0, 1.0)


def rotation_vectors(R: Floats) -> Floats:
    """shape=(n, 3) [rad] of shape=(n, 3, 3), for turns well below half a turn."""
    w = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine, cosine = np.linalg.norm(w, axis=1), (np.einsum("nii->n", R) - 1) / 2
    angle = np.arctan2(sine, cosine)
    return np.asarray(w * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)[:, None])


def interpolated(t: Floats, T: Floats, at: Floats) -> Floats:
    """Frames between two of a stream, shape=(m, 4, 4): positions on a line, orientations by a normalised mean
    of the neighbours' columns.
    """
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    x = ((at - t[k]) / (t[k + 1] - t[k]))[:, None, None]
    out = (1 - x) * T[k] + x * T[k + 1]
    u, _, vt = np.linalg.svd(out[:, :3, :3])
    out[:, :3, :3] = u @ vt
    return np.asarray(out)
