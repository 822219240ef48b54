# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot calibration: find how a real robot differs from its model, name the cause, and remove it.

    robot = truing.load_robot("robot.yaml")
    data = truing.load_measurements("measurements.csv", robot)
    found = truing.identify(robot, data, effects="backlash")
    truing.save_robot("calibrated.yaml", found.robot)

SI units throughout: m, rad, kg, s. `T_a_b` maps b-coordinates into a. Quaternions are w x y z.
"""

from truing._core import (
    Anchor,
    AppliedEffect,
    BeforeAfter,
    EffectRequest,
    ErrorStatistics,
    Frozen,
    Identification,
    IdentifyOptions,
    Joint,
    Measurements,
    Parameter,
    PlanOptions,
    PlanResult,
    Prediction,
    Residuals,
    Robot,
    SolverSummary,
    Target,
    catalogue,
    forward_kinematics,
    frame_from_xyz_rpy,
    gravity_torques,
    pose_groups,
    robot_from_urdf,
    rotation_from_rpy,
    rpy_from_rotation,
    urdf_with_calibration,
    validate_measurements,
    validate_robot,
    version,
)
from truing.api import identify, plan, predict, residuals
from truing.effects import Effect
from truing.errors import InputError, InputWarning, NotConvergedError
from truing.files import load_measurements, load_robot, save_measurements, save_robot
from truing.simulation import simulate

__version__ = version()
validate = validate_robot

__all__ = [
    "Anchor",
    "AppliedEffect",
    "BeforeAfter",
    "Effect",
    "EffectRequest",
    "ErrorStatistics",
    "Frozen",
    "Identification",
    "IdentifyOptions",
    "InputError",
    "InputWarning",
    "Joint",
    "Measurements",
    "NotConvergedError",
    "Parameter",
    "PlanOptions",
    "PlanResult",
    "Prediction",
    "Residuals",
    "Robot",
    "SolverSummary",
    "Target",
    "__version__",
    "catalogue",
    "forward_kinematics",
    "frame_from_xyz_rpy",
    "gravity_torques",
    "identify",
    "load_measurements",
    "load_robot",
    "plan",
    "pose_groups",
    "predict",
    "residuals",
    "robot_from_urdf",
    "rotation_from_rpy",
    "rpy_from_rotation",
    "save_measurements",
    "save_robot",
    "simulate",
    "urdf_with_calibration",
    "validate",
    "validate_measurements",
]
