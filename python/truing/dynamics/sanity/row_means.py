# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Are torques of rows that are far apart values at an instant, or means over the time of a row?

A logger that thins out what it got, or a table that was averaged, has means. Dry friction turns between two
rows, so a fit tells the two apart, by all joints alike: what builds up slowly at one joint does not look so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import with_rows
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import FAR_APART, usual_step

Floats = NDArray[np.float64]

LONGEST = 120.0  # [s] of a recording that is looked at
LESS = 0.9  # of what instants leave, in the geometric mean over the joints: means that leave less are taken
EFFECTS = [_core.EffectRequest(name) for name in ("coulomb", "viscous", "current_offset")]


def row_means(
    robot: _core.Robot, recordings: list[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Recordings whose torques are means, marked as such. recordings: nothing else is wrong with them."""
    far = [one for one in recordings if usual_step(np.asarray(one.time)) > FAR_APART]
    if not far or any(one.torque_is_mean for one in far):
        return [], recordings
    first = [with_rows(one, np.asarray(one.time) <= one.time[0] + LONGEST) for one in far]
    at_instants = _left(robot, first)
    means = _left(robot, [one.replace(torque_is_mean=True) for one in first])
    moved = (at_instants > 0.0) & (means > 0.0)
    ratio = float(np.exp(np.mean(np.log(means[moved] / at_instants[moved])))) if moved.any() else 1.0
    if ratio >= LESS:
        return [], recordings
    names = tuple(one.name for one in far)
    words = f"{listed(names)}: torques are means over the time of a row, not values at its"
    words += f" instant: dry friction that turns between rows then leaves {100 * (1 - ratio):.0f} % less"
    found = RecordingFinding("row_means", names, (), words, 100 * (1 - ratio), "%", applied=True)
    return [found], [one.replace(torque_is_mean=True) if one.name in names else one for one in recordings]


def _left(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> Floats:
    """[Nm | N] rms error of every joint where it moves, of what was not fitted. shape=(joints,)"""
    fit = _core.dynamics_identify(robot, recordings, _core.TorqueOptions(effects=EFFECTS), [])
    (named,) = (errors for errors in fit.errors if errors.model == "named")
    return np.array([joint.rms for joint in named.in_motion])
