# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading and writing files: robots, measurements, images, tables.

Every error names the file, the line or column, what was found and what was expected.
"""

from truing.files.arms import ARMS as ARMS
from truing.files.boards import (
    Board as Board,
    BoardViews as BoardViews,
    find_board as find_board,
    parse_board as parse_board,
)
from truing.files.brand_frames import (
    NOTATIONS as NOTATIONS,
    Brand as Brand,
    frame_from_numbers as frame_from_numbers,
    numbers_from_frame as numbers_from_frame,
)
from truing.files.common import (
    Units as Units,
    atomic_output_dir as atomic_output_dir,
    atomic_write as atomic_write,
    write_table as write_table,
)
from truing.files.controller_parts import ControllerModel as ControllerModel
from truing.files.flange import (
    FLANGE as FLANGE,
    last_to_flange as last_to_flange,
    says_flange as says_flange,
    with_flange as with_flange,
)
from truing.files.handeye_answer import (
    HandEyeAnswer as HandEyeAnswer,
    read_handeye_answer as read_handeye_answer,
)
from truing.files.handeye_file import (
    HandEyeData as HandEyeData,
    Stream as Stream,
    load_camera as load_camera,
    load_handeye as load_handeye,
    load_stream as load_stream,
    pair_rows as pair_rows,
    save_camera as save_camera,
)
from truing.files.lerobot_calibration import (
    MotorCalibration as MotorCalibration,
    load_lerobot_calibration as load_lerobot_calibration,
    matched_motors as matched_motors,
    moved_zero as moved_zero,
    radians_per_count as radians_per_count,
)
from truing.files.link_meshes import Looks as Looks, looks_of as looks_of
from truing.files.measurement_file import (
    load_measurements as load_measurements,
    save_measurements as save_measurements,
)
from truing.files.mjcf_file import is_mjcf as is_mjcf
from truing.files.performance_file import (
    CommandedPoses as CommandedPoses,
    MeasuredPoses as MeasuredPoses,
    load_commanded as load_commanded,
    load_measured as load_measured,
)
from truing.files.recording_file import load_recordings as load_recordings
from truing.files.residual_file import (
    commanded_columns as commanded_columns,
    load_commanded_motion as load_commanded_motion,
    load_residual_motion as load_residual_motion,
)
from truing.files.robot_file import (
    any_robot as any_robot,
    is_controller as is_controller,
    is_urdf as is_urdf,
    load_calibration as load_calibration,
    load_controller as load_controller,
    load_robot as load_robot,
    load_units as load_units,
    robot_to_yaml as robot_to_yaml,
    save_robot as save_robot,
)
from truing.files.scene_file import load_scene as load_scene
from truing.files.stream_file import (
    ImuData as ImuData,
    JointData as JointData,
    PoseData as PoseData,
    SetupData as SetupData,
    ToolPoses as ToolPoses,
    TrackerData as TrackerData,
    load_imu as load_imu,
    load_joints as load_joints,
    load_plan as load_plan,
    load_setup as load_setup,
    load_tool_poses as load_tool_poses,
    load_tracker as load_tracker,
    save_imu as save_imu,
    save_joints as save_joints,
    save_plan as save_plan,
    save_setup as save_setup,
    save_tracker as save_tracker,
)
from truing.files.target_file import (
    TargetData as TargetData,
    load_targets as load_targets,
)
from truing.files.uncertainty_file import (
    Uncertainty as Uncertainty,
    load_uncertainty as load_uncertainty,
)
