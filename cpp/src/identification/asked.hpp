// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "identification/fit.hpp"

namespace truing::identification {

// Which rows, which parameters.

/// "1 row", "5 rows".
std::string count_of(std::size_t n, const char* what);

struct SplitRows {
  std::vector<std::int32_t> pose;  ///< number of the pose, for every row
  std::vector<std::int8_t> set;    ///< 0 train, 1 test, for every row
  std::vector<std::int32_t> train, test;
};

SplitRows split_rows(const Measurements& data, const IdentifyOptions& options);

/// What is to be fitted, and what measures it.
struct Asked {
  Content content;         ///< of the training rows
  std::size_t values = 0;  ///< that they measure
  std::vector<int> free;
  std::vector<std::string> instrument;  ///< of these: base, targets, anchor and fixed points, which are always unknown
  bool base_free = false;
};

Asked what_is_asked(const Model& model, const Measurements& data, const std::vector<std::int32_t>& train,
                    const IdentifyOptions& options);

/// What is fitted of what was asked for.
struct Seen {
  std::vector<int> free;
  int scale_carrier = -1;  ///< a length that is held, since nothing shows the scale; -1: none
  Selection selection;
};

Seen what_is_seen(const Job& job, const Asked& asked, const Eigen::VectorXd& values);

}  // namespace truing::identification
