// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "rooms.hpp"

namespace truing::math {

/// How many letters have to be added, removed or changed to make one word of another.
inline std::size_t letters_apart(const std::string& a, const std::string& b) {
  std::vector<std::size_t> apart(b.size() + 1);
  std::iota(apart.begin(), apart.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(apart[0], i + 1);
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t changed = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = std::exchange(apart[k + 1], std::min({changed, apart[k] + 1, apart[k + 1] + 1}));
    }
  }
  return apart.back();
}

/// " (did you mean 'backlash'?)" of the name that is nearest to `word`; nothing where none is near.
inline std::string did_you_mean(const std::string& word, const std::vector<std::string>& names) {
  const std::string* nearest = nullptr;
  std::size_t least = 1 + word.size() / 3;  // letters
  for (const std::string& name : names) {
    const std::size_t apart = letters_apart(word, name);
    if (apart >= word.size() || apart > least || (nearest != nullptr && apart == least)) continue;
    nearest = &name;
    least = apart;
  }
  return nearest == nullptr ? "" : " (did you mean '" + *nearest + "'?)";
}

}  // namespace truing::math
