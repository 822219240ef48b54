// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions that no law describes, as a robot carries them: the effect `lookup_table`.

#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/robot.hpp"

namespace truing::model {

/// A site's value is a function of one or two inputs: linear between knots, flat beyond the first and the last.
struct LookupTable {
  std::string site;                        ///< as in Term::site
  std::vector<std::string> inputs;         ///< "q3", "dir3" …, one or two
  std::vector<std::vector<double>> knots;  ///< of every input, ascending
  std::vector<double> values;              ///< [rad | m], the second input's knots run fastest
};

/// Inputs that are known of every row that a robot is asked about, if it has the column: "q3", "dir3", "speed3",
/// "torque3" (the number is that of the joint in the chain), "payload", "temp".
bool is_input_of_tables(const std::string& input);

/// Lets a robot carry a table, beside those that it has; added to the one of the same site and inputs.
void add_table(const LookupTable& table, Robot* robot);

}  // namespace truing::model
