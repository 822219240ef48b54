# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The robot and what is measured of it: joints, effects, frames, gravity, URDF, measurements, scene."""

from truing._core import (
    Anchor as Anchor,
    AppliedEffect as AppliedEffect,
    Contact as Contact,
    EffectRequest as EffectRequest,
    EffectTraits as EffectTraits,
    Joint as Joint,
    LinkCapsule as LinkCapsule,
    Measurements as Measurements,
    Obstacle as Obstacle,
    Robot as Robot,
    Scene as Scene,
    Target as Target,
    catalogue as catalogue,
    catalogue_effects as catalogue_effects,
    flange_poses as flange_poses,
    forward_kinematics as forward_kinematics,
    frame_from_xyz_rpy as frame_from_xyz_rpy,
    gravity_torques as gravity_torques,
    last_moving_link as last_moving_link,
    nearest_contact as nearest_contact,
    pose_groups as pose_groups,
    robot_from_urdf as robot_from_urdf,
    rotation_from_rpy as rotation_from_rpy,
    rpy_from_rotation as rpy_from_rotation,
    urdf_with_calibration as urdf_with_calibration,
    validate_measurements as validate_measurements,
    validate_robot as validate_robot,
    validate_scene as validate_scene,
)
