// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses that a robot can take, drawn at random: what `plan` and `distinguish` choose from.

#include <vector>

#include <Eigen/Core>

#include "math/random.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/plan.hpp"

namespace truing::planning {

/// What moves the tip by less than this, rms, when its parameter is one is rounding: a coupling into a joint on whose
/// axis the tool lies. [m]
constexpr double kRounding = 1e-10;

using Pose = Eigen::VectorXd;  // readings of the driven joints

struct Range {
  double lower, upper, step;
};

/// Of every driven joint. Throws std::invalid_argument: a prismatic joint without limits, a range too small for the
/// step.
std::vector<Range> joint_ranges(const Robot& robot, double min_step, double min_step_prismatic, const char* who);

/// A pose within limits whose every joint is more than its step away from both neighbours (null: there is none). False:
/// none was found.
bool draw_pose(const Robot& robot, const Model& model, const std::vector<Range>& ranges, const Pose* before,
               const Pose* after, Random* random, Pose* out);

}  // namespace truing::planning
