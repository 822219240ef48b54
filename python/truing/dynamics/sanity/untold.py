# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does a recording carry a load that neither it nor the model of a fitted robot states?

A robot whose torques were fitted knows its links, so that one recording alone shows what hangs at its tool.
"""

from __future__ import annotations

from truing import _core
from truing.dynamics.sanity.findings import listed
from truing.dynamics.sanity.grids import grids_of
from truing.dynamics.sanity.loads import Load, always_there, picked_up, stated
from truing.dynamics.sanity.switched import thinned

_SPANS = 4  # times that are said


def untold_load(robot: _core.Robot, recording: _core.Recording) -> str:
    """What to know before a prediction is held against measured torques, in words. "": they carry nothing,
    none was measured, the recording states a payload, or the robot was never fitted to torques.
    """
    if not robot.torque_effects or stated([recording]):
        return ""
    grids = [grid for grid in grids_of(robot, [recording]) if len(grid.rows)]
    thin = thinned(robot, grids) if grids else None
    if thin is None:
        return ""
    carried, _ = picked_up(robot, thin)
    if carried:
        return _at_times(recording.name, carried)
    load = always_there(robot, grids[0])
    if load is None:
        return ""
    x, y, z = (1e3 * v for v in load.place)
    mass = f"{load.mass:.2f} kg (+- {load.sigma:.2g})"
    return (
        f"{recording.name}: its torques carry {mass} at {x:.0f} {y:.0f} {z:.0f} mm in the tool's frame, which"
        " neither it nor the robot states: state it in columns payload_kg …"
        f" (for predict: --payload {load.mass:.2f}kg@{x:.0f},{y:.0f},{z:.0f}mm)"
    )


def _at_times(recording: str, carried: list[Load]) -> str:
    masses = listed([f"{load.mass:.2f} kg" for load in carried])
    spans = sorted(span[1:] for load in carried if load.when is not None for span in load.when.spans)
    times = [f"{begin:.1f} to {end:.1f} s" for begin, end in spans[:_SPANS]]
    times += [f"{len(spans) - _SPANS} times more"] * (len(spans) > _SPANS)
    return (
        f"{recording}: its torques carry {masses} at the tool from {listed(times)}, which neither it nor the"
        " robot states: state it in a column payload_kg"
    )
