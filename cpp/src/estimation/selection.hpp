// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which parameters are asked for, by what the data hold and by what the options say.

#include <vector>

#include "estimation/evaluate.hpp"
#include "math/observability.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/common/parameter.hpp"
#include "truing/model/parameter_selection.hpp"

namespace truing::estimation {

/// What the training rows hold, as far as it decides which parameters make sense.
struct Content {
  bool frame = false;  ///< positions or poses in a measurement frame
  bool distance = false;
  bool poses = false;
  std::vector<bool> target, target_rotation, point;
};

Content content_of(const Model& model, const std::vector<Segment>& segments);

inline bool belongs_to_instrument(Role role) {
  return role == Role::base || role == Role::anchor || role == Role::point;
}

/// A value of a link that makes sense to fit: beta only between axes that are near parallel, or where the robot has one
/// already. `parallel`: of near_parallel.
bool is_fitted_geometry(const ParameterInfo& info, const std::vector<bool>& parallel, const Robot& robot);

/// Indices of the parameters to fit, before anything is known about what can be seen.
std::vector<int> select_free(const Model& model, const Content& content, const ParameterSelection& selection);

/// What is unknown anyway is kept first, then geometry, zeros and ratios, effects: of two that cannot be told apart the
/// plainer stays.
int priority_of(Role role);

struct Selection {
  std::vector<int> fitted;     ///< parameters
  std::vector<Frozen> frozen;  ///< and what is held, in words
};

/// The free parameters that a rank decision keeps, and names for those that it does not.
Selection observable(const Model& model, const std::vector<int>& free, const Rank& rank);

}  // namespace truing::estimation
