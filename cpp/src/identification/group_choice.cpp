// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What is decided on sums alone: which columns they can see, and which groups of columns they speak for.

#include <algorithm>
#include <stdexcept>

#include "estimation/evidence.hpp"
#include "math/observability.hpp"
#include "rooms.hpp"
#include "truing/fleet.hpp"

namespace truing {
using namespace identification;

namespace identification {
namespace {

constexpr double kRivalNats = 3.0;  ///< what loses less in a group's place cannot be told from it

/// Groups that may stand in the place of one that was chosen.
std::vector<int> rivals_of(const Evidence& evidence, const Choice& choice, std::size_t at, double* nats) {
  Choice others = choice;
  others.groups.erase(others.groups.begin() + static_cast<std::ptrdiff_t>(at));
  others.scales.erase(others.scales.begin() + static_cast<std::ptrdiff_t>(at));
  const std::vector<Evidence::Gain> gains = evidence.gains(evidence.evaluate(others));
  const int own = choice.groups[at];
  *nats = gains[static_cast<std::size_t>(own)].score;
  std::vector<int> out;
  for (const Evidence::Gain& gain : gains) {
    const bool chosen = std::find(choice.groups.begin(), choice.groups.end(), gain.group) != choice.groups.end();
    if (!chosen && gain.score > *nats - kRivalNats) out.push_back(gain.group);
  }
  std::sort(out.begin(), out.end(), [&](int a, int b) {
    return gains[static_cast<std::size_t>(a)].score > gains[static_cast<std::size_t>(b)].score;
  });
  return out;
}

/// The sums with a column in front that is nothing and explains nothing: the search wants one that is always in.
Gram with_empty_column(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right, double squares, double values) {
  const Eigen::Index p = gram.rows();
  Gram out{Eigen::MatrixXd::Zero(p + 1, p + 1), Eigen::VectorXd::Zero(p + 1), squares, values + 1.0};
  out.xx(0, 0) = 1.0;
  out.xx.bottomRightCorner(p, p) = gram;
  out.xy.tail(p) = right;
  return out;
}

}  // namespace
}  // namespace identification

SeenColumns seen_columns(const Eigen::MatrixXd& gram, const std::vector<int>& priority, double tolerance) {
  if (gram.rows() != gram.cols() || gram.rows() != static_cast<Eigen::Index>(priority.size()))
    throw std::invalid_argument("expected a square Gram matrix with a priority for each column");
  Rank rank = find_rank(gram, priority, tolerance);
  return {std::move(rank.kept), std::move(rank.frozen), std::move(rank.combination)};
}

GroupChoice choose_groups(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right, double squares, double values,
                          const std::vector<std::vector<int>>& groups, const Eigen::VectorXd& prior, double cost,
                          double threshold) {
  const Eigen::Index p = gram.rows();
  if (gram.cols() != p || right.size() != p || prior.size() != p)
    throw std::invalid_argument("gram, right and prior must have one number of columns");
  const Gram sums = with_empty_column(gram, right, squares, values);
  Eigen::VectorXd sizes(p + 1);
  sizes << 1.0, prior;
  std::vector<ColumnGroup> columns;
  for (const std::vector<int>& group : groups) {
    columns.emplace_back();
    columns.back().cost = cost;
    for (const int k : group) {
      if (k < 0 || k >= p)
        throw std::invalid_argument("a group names column " + std::to_string(k) + ", of " + std::to_string(p) +
                                    " columns");
      columns.back().columns.push_back(k + 1);
    }
  }
  const Evidence evidence(sums, columns, {0}, sizes);
  SearchOptions options;
  options.threshold = threshold;
  const Evidence::State state = evidence.search(options);
  GroupChoice out;
  out.groups = state.choice.groups;
  out.solution = Eigen::VectorXd::Zero(p);
  for (std::size_t k = 0; k < state.columns.size(); ++k) {
    if (state.columns[k] > 0) out.solution[state.columns[k] - 1] = state.solution[static_cast<Eigen::Index>(k)];
  }
  out.sigma = std::sqrt(state.sigma2);
  for (std::size_t at = 0; at < out.groups.size(); ++at) {
    double nats = 0.0;
    out.rivals.push_back(rivals_of(evidence, state.choice, at, &nats));
    out.nats.push_back(nats);
  }
  return out;
}

}  // namespace truing
