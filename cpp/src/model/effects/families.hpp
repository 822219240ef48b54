// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The catalogue, a file per family of effects. An effect is added in its family's file and nowhere else.

#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/effect.hpp"

namespace truing::model {

std::vector<Effect> geometry_effects();
std::vector<Effect> compliance_effects();
std::vector<Effect> transmission_effects();
std::vector<Effect> thermal_effects();
std::vector<Effect> coupling_effects();
std::vector<Effect> bearing_effects();
std::vector<Effect> instrument_effects();
std::vector<Effect> table_effects();

/// "transmission_error@96" -> its effect; nullptr when the name is of another form.
const Effect* transmission_error_of(const std::string& name);

}  // namespace truing::model
