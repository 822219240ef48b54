// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the laws of the effects are written with.

#include <functional>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/effect.hpp"

namespace truing::model {

using Basis = std::function<double(const Inputs&)>;

/// The data lack a column: an error, whoever asked.
[[noreturn]] void refuse(const char* effect, const Joint& joint, const std::string& what);

/// The joint is of the wrong kind: an error only if this very joint was asked for.
[[noreturn]] void unsuited(const char* effect, const Joint& joint, const std::string& what);

inline bool is_revolute(const Joint& joint) { return joint.type == JointType::revolute; }
inline const char* motion_unit(const Joint& joint) { return is_revolute(joint) ? "rad" : "m"; }

void require_driven(const char* effect, const Joint& joint);
void require_revolute(const char* effect, const Joint& joint, const std::string& why);
void require_weight(const char* effect, const Robot& robot, const Joint& joint, const Measurements& data,
                    const std::string& or_else = "");

/// Place of a driven joint among the driven ones: the number in its column names, less one.
std::size_t driven_number(const Robot& robot, std::size_t joint);

Term make_term(const std::string& parameter, const std::string& unit, const std::string& site, Basis basis,
               bool needs_gravity = false);

/// A number taken from the data the first time, and from the robot ever after.
double remembered(const Robot& robot, const std::string& effect, const std::string& name,
                  const std::function<double()>& first);

/// Mean of what is a number in the column; 0 if nothing is.
double mean_of(const Column& column, std::size_t rows);

}  // namespace truing::model
