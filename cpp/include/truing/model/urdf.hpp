// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "truing/model/robot.hpp"

namespace truing {

/// Reads the chain from `base_link` to `tip_link` of a URDF text (Convention::urdf; parsed by urdfdom). Fixed joints
/// are folded into the next moving joint's T_parent_joint, the last ones into the tool; masses, centres of mass and
/// inertias of links are merged the same way, also of what moves off the chain (a gripper's fingers), as it stands at
/// zero; `mimic` of a joint in the chain becomes `driven_by` with its multiplier.
/// `<dynamics>` becomes the torque effects coulomb and viscous, those of a joint that mimics at the joint that drives
/// it; velocity and effort of `<limit>` become speed_limit and torque_limit, zero, less, or 1e6 and more of either
/// means none. A base may stand beside the chain, fixed to a link that has the tip below it: the controller's `base` of
/// many arms does. Empty link names: the only root, the only leaf. Throws std::invalid_argument: not a URDF, unknown
/// base or tip (lists the links there are), tip not below base nor below what it is fixed to, planar or floating joint.
Robot robot_from_urdf(const std::string& urdf_text, const std::string& base_link = "",
                      const std::string& tip_link = "");

/// Links that the chain carries and that move by joints of their own (a gripper's fingers): their masses are merged as
/// they stand at zero. Throws as robot_from_urdf.
std::vector<std::string> links_off_chain(const std::string& urdf_text, const std::string& base_link = "",
                                         const std::string& tip_link = "");

/// The last moving link of the only chain below `base_link`: a tip for who wants the motion and not a tool, whatever is
/// fixed to that link. Throws std::invalid_argument: not a URDF, unknown base, nothing moves, several chains move.
std::string last_moving_link(const std::string& urdf_text, const std::string& base_link = "");

/// The same URDF text with the origins of the chain's joints replaced by those of `calibrated`. What URDF cannot hold
/// (ratios, offsets that cannot be folded in, base frame, effects) is named in a comment at the top.
/// A joint zero is folded into the origin (rotation about the axis). Frames, never rpy, are composed.
std::string urdf_with_calibration(const std::string& urdf_text, const Robot& calibrated,
                                  const std::string& base_link = "", const std::string& tip_link = "");

}  // namespace truing
