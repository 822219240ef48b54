// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What is to be told apart: every effect at every joint that planned poses can show.

#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/common/not_testable.hpp"
#include "truing/model/effect.hpp"
#include "truing/plan.hpp"

namespace truing::planning {

/// An effect at a joint (or of the whole robot), and how the model calls its parameters.
struct Group {
  const Effect* effect = nullptr;
  std::string joint;
  std::vector<std::string> parameters;
  std::vector<EffectRequest> requests;
};

bool is_named(const std::vector<EffectRequest>& requests, const Group& group);

/// Names that mean nothing are errors that list what there is.
void check_names(const Robot& robot, const DistinguishOptions& options, const Measurements& data);

/// Every effect at every joint that these inputs can show, and why not the others.
std::vector<Group> find_groups(const Robot& robot, const Measurements& data, const DistinguishOptions& options,
                               std::vector<NotTestable>* not_testable);

}  // namespace truing::planning
