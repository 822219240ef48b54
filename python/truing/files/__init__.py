# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading and writing files: robots, measurements, tables. Every error names file, line or column, found and
expected.
"""

from __future__ import annotations

from truing.files.common import Units, atomic_output_dir, atomic_write, write_table
from truing.files.handeye_file import HandEyeData, Stream, load_camera, load_handeye, load_stream, save_camera
from truing.files.measurement_file import load_measurements, save_measurements
from truing.files.robot_file import load_calibration, load_robot, load_units, robot_to_yaml, save_robot
from truing.files.scene_file import load_scene
from truing.files.target_file import TargetData, load_targets
from truing.files.uncertainty_file import Uncertainty, load_uncertainty

__all__ = [
    "HandEyeData",
    "Stream",
    "TargetData",
    "Uncertainty",
    "Units",
    "atomic_output_dir",
    "atomic_write",
    "load_calibration",
    "load_camera",
    "load_handeye",
    "load_measurements",
    "load_robot",
    "load_scene",
    "load_stream",
    "load_targets",
    "load_uncertainty",
    "load_units",
    "robot_to_yaml",
    "save_camera",
    "save_measurements",
    "save_robot",
    "write_table",
]
