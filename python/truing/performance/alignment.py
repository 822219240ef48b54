# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The instrument's frame fitted to the robot's base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.performance_file import CommandedPoses, MeasuredPoses
from truing.performance.assessment import Alignment, in_order

Floats = NDArray[np.float64]
_FEWEST = 3  # poses that hold a frame
_ON_A_LINE = 1e-3  # [m] nearer to one line poses leave the turn about it open


def aligned(measured: MeasuredPoses, commanded: CommandedPoses) -> Alignment:
    """The rigid motion that brings the barycentres of the poses nearest to the commanded positions (Arun,
    Huang and Blostein 1987).
    """
    names = [
        name
        for name in in_order(
            pose for pose, test in zip(measured.pose, measured.test, strict=True) if test == "pose"
        )
        if commanded.row(name) is not None
    ]
    here = np.array([measured.position[_rows_of(measured, name)].mean(axis=0) for name in names])
    there = np.array([commanded.position[commanded.name.index(name)] for name in names])
    if len(names) < _FEWEST or np.linalg.svd(here - here.mean(axis=0))[1][1] < _ON_A_LINE:
        raise InputError(
            f"{measured.file}: the frame is fitted to three poses or more that are not on one line, found"
            f" {len(names)}"
        )
    u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    T = np.eye(4)
    T[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    T[:3, 3] = there.mean(axis=0) - T[:3, :3] @ here.mean(axis=0)
    return Alignment(T, len(names))


def _rows_of(measured: MeasuredPoses, pose: str) -> list[int]:
    return [
        row
        for row, (name, test) in enumerate(zip(measured.pose, measured.test, strict=True))
        if name == pose and test == "pose"
    ]


def moved(measured: MeasuredPoses, T: Floats) -> MeasuredPoses:
    rotation = None if measured.rotation is None else T[:3, :3] @ measured.rotation
    return replace(measured, position=measured.position @ T[:3, :3].T + T[:3, 3], rotation=rotation)
