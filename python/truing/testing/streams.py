# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated streams of a swaying arm: what a tracker's test is made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.files.stream_file import SetupData, save_imu, save_joints, save_plan, save_setup, save_tracker
from truing.report.json_text import to_json, without_nan
from truing.rotations import rotation_vectors

SIMULATION_FORMAT = "truing-track-simulation/1"
_TRUTH_RATE = 200.0  # [Hz] of truth.csv


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


def write_simulation(
    folder: Path,
    robot: _core.Robot,
    streams: _core.SimulatedStreams,
    options: _core.StreamSimulationOptions,
) -> dict[str, Any]:
    """Writes imu.csv, tracker.csv, joints.csv, plan.csv, setup.yaml, truth.csv and truth.json into `folder`;
    returns what truth.json holds.
    """
    save_imu(folder / "imu.csv", **streams.imu)
    save_tracker(folder / "tracker.csv", **streams.tracker)
    save_joints(folder / "joints.csv", robot, **streams.joints)
    plan = streams.plan
    save_plan(folder / "plan.csv", plan["t"], plan["T_base_tool"], plan["arrival"])
    t = np.arange(int(options.seconds * _TRUTH_RATE) + 1) / _TRUTH_RATE
    save_plan(folder / "truth.csv", t, streams.tool_at(t))
    setup, offset = streams.setup, options.tracker.clock_offset
    if offset or options.tracker.clock_drift:  # nobody knows it beforehand
        setup = setup.replace(clock_offset=0.0, clock_offset_sigma=max(0.01, 1.5 * abs(offset)))
    save_setup(folder / "setup.yaml", SetupData(setup, calibration={"source": "simulated: the true frames"}))
    truth: dict[str, Any] = without_nan(
        {
            "format": SIMULATION_FORMAT,
            "version": _core.version(),
            "robot": robot.name,
            "seed": options.seed,
            "seconds": options.seconds,
            "motion": options.motion,
            "clock_offset_s": options.tracker.clock_offset,
            "clock_drift": options.tracker.clock_drift,
            "actuator_lag_s": options.actuator_lag,
            "modes": [{"frequency_hz": mode.frequency, "damping": mode.damping} for mode in streams.modes],
            "dropouts": [{"start_s": start, "seconds": seconds} for start, seconds in options.dropouts],
            "station_shifts": [
                {
                    "start_s": start,
                    "jump_m": float(np.linalg.norm(T[:3, 3])),
                    "jump_rad": float(np.linalg.norm(rotation_vectors(T[None, :3, :3]))),
                }
                for start, T in options.shifts
            ],
            "samples": {
                "imu": len(streams.imu["t"]),
                "tracker": len(streams.tracker["t"]),
                "joints": len(streams.joints["t"]),
                "plan": len(plan["t"]),
            },
        }
    )
    (folder / "truth.json").write_text(to_json(truth), encoding="utf-8")
    return truth
