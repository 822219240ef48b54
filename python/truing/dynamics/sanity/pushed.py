# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does the tool touch something at times? Torques of that are no gap between the robot and its model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import with_rows
from truing.dynamics.sanity import gravity
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.switched import AtTimes, Switched, Thinned, switched

Floats = NDArray[np.float64]

PART = 0.5  # of the squares left without the force, at most, with it
MOST = 0.6  # of the time: what pushes longer is not left out
MARGIN = 0.3  # [s] left out around it


def push_of(robot: _core.Robot, thin: Thinned, place: Floats | None = None) -> AtTimes | None:
    """A force along one direction of the base that comes and goes; None: there is no such. place: [m] where
    it acts, in the frame after the last link; none: at the tool.
    """

    def columns(q: Floats, qd: Floats, qdd: Floats) -> Floats:
        return gravity.held_against(robot, q, place)

    found = switched(thin, columns, list(np.eye(3)), is_mass=False)
    return found if found is not None and found.part < PART and found.changes else None


def said(found: Switched) -> RecordingFinding:
    """What is said of a force that comes and goes."""
    size = float(np.linalg.norm(found.values))
    share = 100.0 * found.share
    words = (
        f"{listed(found.recordings)}: something pushes at the tool for {share:.0f} % of the time"
        f" ({len(found.spans)} times), by some {size:.2g} N along {gravity.in_words(found.values)} of the"
        " base"
    )
    applied = found.share < MOST
    words += ": these rows are left out" if applied else ": record it without touching anything"
    return RecordingFinding(
        "tool_pushed",
        found.recordings,
        (),
        words,
        size,
        "N",
        applied=applied,
        mistake=not applied,
        spans=found.spans,
    )


def without_pushes(recordings: Sequence[_core.Recording], found: Switched) -> list[_core.Recording]:
    """The recordings without the rows in which the tool is pushed, and those near them."""
    out = []
    for one in recordings:
        time = np.asarray(one.time)
        pushed = [found.there(one.name, time + by) for by in (-MARGIN, 0.0, MARGIN)]
        kept = ~np.any(pushed, axis=0)
        if kept.any():
            out.append(with_rows(one, kept))
    return out
