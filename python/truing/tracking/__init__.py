# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking: where the tool of a swaying arm will be, from encoders, an inertial sensor and a tracker."""

from truing._core import (
    ClockEstimate as ClockEstimate,
    Compensation as Compensation,
    CompensationRow as CompensationRow,
    CorrectionLimits as CorrectionLimits,
    DeviationOptions as DeviationOptions,
    FilterOptions as FilterOptions,
    FramesResult as FramesResult,
    InertialResult as InertialResult,
    ModalModel as ModalModel,
    ModesResult as ModesResult,
    PosePrediction as PosePrediction,
    PositionError as PositionError,
    RecordedStreams as RecordedStreams,
    ReplayResult as ReplayResult,
    RestPose as RestPose,
    Shift as Shift,
    ToolResult as ToolResult,
    Tracker as Tracker,
    TrackerNoise as TrackerNoise,
    TrackOptions as TrackOptions,
    TrackSetup as TrackSetup,
    WatchOptions as WatchOptions,
    calibrate_frames as calibrate_frames,
    calibrate_inertial as calibrate_inertial,
    calibrate_tool as calibrate_tool,
    find_rests as find_rests,
    identify_modes as identify_modes,
    replay as replay,
)
from truing.tracking.api import (
    TrackCalibration as TrackCalibration,
    actuator_lag as actuator_lag,
    check_streams as check_streams,
    recorded_streams as recorded_streams,
    track_calibrate as track_calibrate,
)
