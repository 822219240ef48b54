# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sanity before statistics: what looks wrong with recordings of motion, before anything is fitted to them.

What is certain is corrected, and said; all else is only said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity import columns
from truing.dynamics.sanity.findings import (
    CheckedRecordings as CheckedRecordings,
    RecordingFinding as RecordingFinding,
)
from truing.dynamics.sanity.grids import grids_of
from truing.dynamics.sanity.speeds import speeds

Floats = NDArray[np.float64]


def check_recordings(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> CheckedRecordings:
    """Look for mistakes in recordings before something is fitted to them: units and signs of speeds, gaps,
    clipped and coarse values, rest.

        checked = truing.dynamics.check_recordings(robot, recordings)
        found = truing.dynamics.diagnose(checked.robot, checked.recordings)

    Returns the findings, and robot and recordings with what is certain corrected (`applied`): units and
    signs of speeds and angles that derivatives prove. A `mistake` is not corrected: until it is, effects
    that are named are doubtful.

    Raises InputError on a robot or recordings that cannot be used.
    """
    for recording in recordings:
        _core.validate_recording(recording, robot)
    found, recordings = columns.clock(recordings)
    grids = grids_of(robot, recordings)
    of_speeds, by_speed, by_angle = speeds(robot, grids)
    found += of_speeds
    recordings = [_scaled(one, by_speed.get(one.name), by_angle.get(one.name)) for one in recordings]
    if _any_change(by_angle):
        grids = grids_of(robot, recordings)
    grids = [grid for grid in grids if len(grid.rows)]
    found += columns.rest(robot, grids)
    found += [*columns.values(robot, recordings), *columns.alone(recordings)]
    found.sort(key=lambda one: (not one.mistake, one.finding in ("at_rest", "gaps", "one_recording")))
    return CheckedRecordings(robot, tuple(recordings), tuple(found))


def _scaled(recording: _core.Recording, by_speed: Floats | None, by_angle: Floats | None) -> _core.Recording:
    fields: dict[str, Any] = {}
    if by_speed is not None and (by_speed != 1.0).any():
        fields["speed"] = np.asarray(recording.speed) * by_speed
    if by_angle is not None and (by_angle != 1.0).any():
        fields["position"] = np.asarray(recording.position) * by_angle
    return recording.replace(**fields) if fields else recording


def _any_change(factors: Mapping[str, Floats]) -> bool:
    return any(bool((some != 1.0).any()) for some in factors.values())
