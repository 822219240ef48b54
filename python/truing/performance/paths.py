# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of paths: AT and RT, where every cycle crosses the planes of the path's points."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.performance import intervals
from truing.performance.assessment import FAR, Findings, Ints, in_order
from truing.performance.quantities import crossings, path_accuracy, path_repeatability

Floats = NDArray[np.float64]


def find_paths(found: Findings) -> None:
    """AT and RT of every path."""
    m = found.measured
    every = found.rows("path")
    for path in in_order(m.path[row] for row in every):
        rows = every[[m.path[row] == path for row in every]]
        attained, command = _path_points(found, path, rows)
        found.count(len(attained), "path", path)
        if found.few("AT, RT", path, len(attained)):
            continue
        if command is None:
            found.lacks("AT", path, "there is no commanded path of this name")
        else:
            if float(path_accuracy(attained, command)) > FAR:
                raise InputError(
                    f"{m.file}: the path {path} is {float(path_accuracy(attained, command)):.4g} m from the"
                    " commanded one: another frame, another unit or another tool (--align fits the frame)"
                )
            found.add(
                "AT",
                path,
                path_accuracy(attained, command),
                len(attained),
                partial(intervals.path_interval, attained - command),
            )
        found.add(
            "RT",
            path,
            path_repeatability(attained),
            len(attained),
            partial(intervals.path_repeatability_interval, attained),
        )


def _path_points(found: Findings, path: str, rows: Ints) -> tuple[Floats, Floats | None]:
    """Where every cycle crossed the planes of the path's points, shape=(n, m, 3); the commanded points."""
    m = found.measured
    command = None
    if found.commanded is not None and (of_path := found.commanded.path_rows(path)).size:
        command = found.commanded.position[of_path]
    numbered = m.point[rows] > 0
    if numbered.any() and not numbered.all():
        raise InputError(f"{m.file}: some rows of the path {path} have a point and others none")
    cycles = [rows[m.cycle[rows] == cycle] for cycle in np.unique(m.cycle[rows])]
    if not numbered.any():
        return _cut(found, path, cycles, command), command
    points = np.unique(m.point[rows])
    for of_cycle in cycles:
        if not np.array_equal(np.sort(m.point[of_cycle]), points):
            raise InputError(
                f"{m.file}: cycle {m.cycle[of_cycle[0]]} of the path {path} does not have each of its"
                f" {len(points)} points once"
            )
    if command is not None and not np.array_equal(points, np.arange(1, len(command) + 1)):
        raise InputError(
            f"{m.file}: the path {path} was measured at {len(points)} points, and commanded at {len(command)}"
        )
    return np.stack([m.position[of[np.argsort(m.point[of])]] for of in cycles]), command


def _cut(found: Findings, path: str, cycles: list[Ints], command: Floats | None) -> Floats:
    """Recordings of a path, cut by the planes of its points; the ends that not every cycle reached are left
    out of all.
    """
    m = found.measured
    if command is None or len(command) < 2:
        raise InputError(
            f"{m.file}: the path {path} is a recording (no column point): expected its commanded points,"
            " which say where it is cut"
        )
    cut = []
    for of in cycles:
        order = of if m.time is None else of[np.argsort(m.time[of], kind="stable")]
        cut.append(crossings(m.position[order], command))
    crossed = np.stack(cut)
    missed = np.flatnonzero(np.isnan(crossed).any(axis=(0, 2)))
    inner = missed[(missed > 0) & (missed < len(command) - 1)]
    if inner.size:
        raise InputError(
            f"{m.file}: not every cycle of the path {path} crosses the plane of its point {inner[0] + 1}: the"
            " recording is cut off, or in another frame"
        )
    for end in missed:  # the robot stops there, on this side of the plane or the other
        for cycle, of in enumerate(cycles):
            if np.isnan(crossed[cycle, end]).any():
                ends = m.position[of]
                crossed[cycle, end] = ends[np.argmin(np.linalg.norm(ends - command[end], axis=1))]
    return crossed
