# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated measurements with known truth: poses of a robot, hand-eye scenes, streams of a swaying arm."""

from truing._core import (
    FlexibleMode as FlexibleMode,
    ImuErrors as ImuErrors,
    SimulatedStreams as SimulatedStreams,
    StreamSimulationOptions as StreamSimulationOptions,
    TrackerErrors as TrackerErrors,
    large_boom as large_boom,
    large_boom_modes as large_boom_modes,
)
from truing.testing.fleet import (
    FleetSimulation as FleetSimulation,
    TorqueFleet as TorqueFleet,
    save_fleet as save_fleet,
    save_torque_fleet as save_torque_fleet,
    simulate_fleet as simulate_fleet,
    simulate_torque_fleet as simulate_torque_fleet,
)
from truing.testing.simulation import (
    Simulation as Simulation,
    TrueEffect as TrueEffect,
    Truth as Truth,
    simulate as simulate,
)
from truing.testing.streams import simulate_streams as simulate_streams
