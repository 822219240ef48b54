# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated streams of a swaying arm: what a tracker's test is made of."""

from __future__ import annotations

from truing import _core


def simulate_streams(
    robot: _core.Robot, options: _core.StreamSimulationOptions | None = None, **changes: object
) -> _core.SimulatedStreams:
    """Streams of an arm that sways, with known truth; shares no equation with the filter.

    options: None: the usual ones. changes: of them, by name: `simulate_streams(robot, seconds=20.0,
    motion="stop-and-go", seed=3)`.
    Raises InputError on options that make no sense.
    """
    given = options or _core.StreamSimulationOptions()
    return _core.simulate_streams(robot, given.replace(**changes) if changes else given)
