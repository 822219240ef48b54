// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/asked.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "math/random.hpp"

namespace truing::identification {
std::string count_of(std::size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

namespace {

/// 0 train, 1 test for every row: the data's own split, or a fraction of the pose groups drawn with the seed.
std::vector<std::int8_t> split(const Measurements& data, const IdentifyOptions& options,
                               const std::vector<std::int32_t>& group) {
  const std::size_t groups =
      group.empty() ? 0 : static_cast<std::size_t>(*std::max_element(group.begin(), group.end())) + 1;
  if (groups < 2)
    throw std::invalid_argument("all " + count_of(data.rows, "row") +
                                " are of one pose: nothing can be identified from them");
  if (!data.set.empty()) return data.set;
  std::vector<std::int32_t> order(groups);
  std::iota(order.begin(), order.end(), 0);
  Random random(options.seed);
  for (std::size_t k = groups - 1; k > 0; --k) std::swap(order[k], order[random.below(k + 1)]);
  std::vector<std::int8_t> of_group(groups, 0);
  const auto held_out = static_cast<std::size_t>(std::lround(options.test_share * static_cast<double>(groups)));
  for (std::size_t k = 0; k < held_out; ++k) of_group[order[k]] = 1;
  std::vector<std::int8_t> set(data.rows);
  for (std::size_t row = 0; row < data.rows; ++row) set[row] = of_group[group[row]];
  return set;
}

}  // namespace

SplitRows split_rows(const Measurements& data, const IdentifyOptions& options) {
  SplitRows out;
  out.pose = pose_groups(data);
  out.set = split(data, options, out.pose);
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.weight && data.weight[row] == 0.0) continue;  // counts for nothing
    (out.set[row] ? out.test : out.train).push_back(static_cast<std::int32_t>(row));
  }
  return out;
}

namespace {

std::size_t measured_values(const std::vector<Segment>& segments) {
  std::size_t out = 0;
  for (const Segment& segment : segments) {
    out += segment.rows.size() * (segment.kind == kernel::Kind::distance ? 1u
                                  : segment.kind == kernel::Kind::pose   ? 6u
                                                                         : 3u);
  }
  return out;
}

}  // namespace

Asked what_is_asked(const Model& model, const Measurements& data, const std::vector<std::int32_t>& train,
                    const IdentifyOptions& options) {
  const std::vector<Segment> segments = make_segments(data, train);
  Asked out;
  out.content = content_of(model, segments);
  out.values = measured_values(segments);
  out.free = select_free(model, out.content, options);
  if (out.free.empty()) throw std::invalid_argument("nothing is free: name parameters to fit, or hold fewer");
  for (const auto& [name, bound] : options.bounds) find_parameters(model, {name});
  for (const auto& [glob, sigma] : options.priors) {
    for (const int k : find_parameters(model, {glob})) {
      const ParameterInfo& info = model.parameters[static_cast<std::size_t>(k)];
      if (belongs_to_instrument(info.role) || info.role == Role::target)
        throw std::invalid_argument("priors: '" + glob + "' stands for " + info.name +
                                    ", but base, targets and instrument are found from the data alone");
    }
  }
  if (options.frame_by == FrameBy::svd &&
      (out.content.distance || out.content.poses || !out.content.frame || !model.point_names.empty())) {
    throw std::invalid_argument(
        "frame_by = svd needs measured positions only, no orientations, distances or fixed points");
  }
  for (const int k : out.free) {
    const Role role = model.parameters[k].role;
    if (belongs_to_instrument(role) || role == Role::target) out.instrument.push_back(model.parameters[k].name);
    if (role == Role::base) out.base_free = true;
  }
  return out;
}

namespace {

/// Touching fixed points shows shapes, not sizes: with every length free the robot could shrink to nothing. The longest
/// is held.
int length_that_carries_scale(const Model& model, const Eigen::VectorXd& values, const std::vector<int>& free) {
  int longest = -1;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const bool length = (info.role == Role::geometry || info.role == Role::target) && info.unit == "m";
    const double size = std::abs(values[static_cast<Eigen::Index>(k)]);
    if (!length || size < 1e-9) continue;
    if (std::find(free.begin(), free.end(), static_cast<int>(k)) == free.end())
      return -1;  // some length is held already
    if (info.role == Role::geometry && (longest < 0 || size > std::abs(values[longest]))) longest = static_cast<int>(k);
  }
  return longest;
}

/// Number of parameters that the rows alone must determine. What priors are weighed against comes from the rows as
/// well, unless it is given.
std::size_t without_prior(const Job& job, const std::vector<int>& fitted) {
  if (!(job.options.prior_noise > 0.0)) return fitted.size();
  return static_cast<std::size_t>((prior_of(job, fitted, job.options.prior_noise).weight.array() == 0.0).count());
}

}  // namespace

Seen what_is_seen(const Job& job, const Asked& asked, const Eigen::VectorXd& values) {
  Seen out;
  out.free = asked.free;
  if (!asked.content.frame && !asked.content.distance) {
    out.scale_carrier = length_that_carries_scale(job.model, values, out.free);
    out.free.erase(std::remove(out.free.begin(), out.free.end(), out.scale_carrier), out.free.end());
  }
  out.selection = select_observable(job, out.free, values);
  const std::size_t unknown = without_prior(job, out.selection.fitted);
  if (asked.values <= unknown) {
    throw std::invalid_argument(count_of(asked.values, "measured value") + " in " +
                                count_of(job.rows.size(), "training row") + " cannot determine " +
                                count_of(unknown, "parameter") + ": measure more poses, or free fewer parameters");
  }
  if (out.scale_carrier >= 0) {
    const std::string& name = job.model.parameters[out.scale_carrier].name;
    out.selection.frozen.push_back(
        {name, {{name, 1.0}}, "touching fixed points shows no scale: this length, held at nominal, carries it"});
  }
  return out;
}

}  // namespace truing::identification
