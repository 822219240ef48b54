// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// Two explanations of the same data, as `identify` is asked for them.
struct Rivals {
  std::string name;  ///< of the first, in words
  std::string other_name;
  struct Side {
    std::vector<std::string> parameters;
    std::vector<EffectRequest> requests;
  };
  Side first, other;
  std::map<std::string, double> parameters;  ///< of the first, as fitted
};

/// Poses (with directions and payloads, where the data have such columns) at which two explanations that agree on the
/// data differ most: greedy T-optimal design (Atkinson and Fedorov 1975). Empty when none of some hundred poses would
/// tell.
std::vector<NextPose> next_poses(const Robot& robot, const Measurements& data, const Rivals& rivals,
                                 const DiagnoseOptions& options, int count, double noise_sigma);

}  // namespace truing::diagnosis
