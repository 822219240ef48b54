# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `truing track calibrate` and `truing track run` share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from truing.cli.options import File
from truing.cli.tables import ms

IMU = "Inertial sensor: t_s, gx_rad_s …, ax_m_s2 …"

TrackerFile = Annotated[Path, File("Receiver in the tracker frame: t_s, x_m …, qw …", metavar="TRACKER.csv")]
JointsFile = Annotated[Path, File("Encoder readings: t_s, q1_rad …", metavar="JOINTS.csv")]


def clock_text(clock: Mapping[str, Any]) -> str:
    return f"clocks: t_imu = t_tracker {-1e3 * clock['offset_s']:+.3f} ms, +- {ms(clock['sigma_s'])}"


def frequencies(modes: Sequence[Mapping[str, Any]]) -> str:
    return ", ".join(f"{mode['frequency_hz']:.3g} Hz" for mode in modes)
