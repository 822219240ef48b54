// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What was recorded, or follows from it: the inputs that an effect may be a function of.

#include <cstdint>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/effect.hpp"

namespace truing::diagnosis {

/// A recorded (or derived) input, for every row.
struct InputColumn {
  std::string name;  ///< q2, dir3, torque2, payload, temp, time, order, or a covariate's
  std::string unit;
  int joint = -1;  ///< index in Robot::joints that it belongs to
  bool constant = false;
  std::vector<double> values;
};

/// The weight that a joint carries.
bool is_torque(const InputColumn& input);

std::vector<InputColumn> make_inputs(const Robot& robot, const Measurements& data);

/// Name of the input that drives an effect at a joint: "torque2"; empty: it has none, or several.
std::string input_name(Driver driver, std::size_t joint);

/// Where the free function's hat-shaped basis functions peak along one input; flat beyond the first and the last.
std::vector<double> knots_of(const InputColumn& input, const std::vector<std::int32_t>& rows, int most);

/// Values of the hats at `x`: at most two are not zero.
void hats_at(const std::vector<double>& knots, double x, double* out);

}  // namespace truing::diagnosis
