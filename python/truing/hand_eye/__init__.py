# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye calibration: where a camera is on a robot or beside it."""

from truing._core import (
    Camera as Camera,
    ClockOffset as ClockOffset,
    ClosedForm as ClosedForm,
    HandEyeErrors as HandEyeErrors,
    HandEyeKinematics as HandEyeKinematics,
    HandEyeNoise as HandEyeNoise,
    HandEyeOptions as HandEyeOptions,
    HandEyePlanOptions as HandEyePlanOptions,
    HandEyePoses as HandEyePoses,
    HandEyeResidual as HandEyeResidual,
    HandEyeResult as HandEyeResult,
    NextHandPose as NextHandPose,
    Reading as Reading,
    Unobservable as Unobservable,
    handeye_closed_form as handeye_closed_form,
    handeye_readings as handeye_readings,
    project as project,
)
from truing.hand_eye.api import (
    handeye as handeye,
    handeye_clock as handeye_clock,
    handeye_options as handeye_options,
    handeye_plan as handeye_plan,
    handeye_with_kinematics as handeye_with_kinematics,
)
