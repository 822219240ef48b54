// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Before any data: which effects a plan can tell apart, and the poses that would.

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "math/constants.hpp"
#include "math/linear_algebra.hpp"
#include "model/effects/traits.hpp"
#include "model/model.hpp"
#include "planning/groups.hpp"
#include "planning/planned_poses.hpp"
#include "planning/poses.hpp"
#include "planning/view.hpp"
#include "rooms.hpp"
#include "truing/plan.hpp"

namespace truing {
using namespace planning;

namespace planning {
namespace {

/// Pairs to be told apart get poses until less than this is shared: the size needed is then three times what it takes
/// to be seen.
constexpr double kGoal = 0.9;
/// A pose that tells less than this fraction of an effect does not tell.
constexpr double kTellsNothing = 1e-6;
/// Nor does one after which R2 falls by less than this, on average.
constexpr double kProgress = 1e-4;

using Eigen::Index;
using Eigen::MatrixXd;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Size from which on a parameter of group a is told from group b; NaN: never.
double size_beside(const View& view, std::size_t b, Index column, double standard_errors) {
  if (column < 0) return kNaN;
  const double visible = view.visible_beside(b, column);
  return visible > kInvisible * view.columns.x.col(column).squaredNorm() ? standard_errors / std::sqrt(visible) : kNaN;
}

std::vector<std::string> joints_of(const Group& group) {
  return group.joint.empty() ? std::vector<std::string>{} : std::vector<std::string>{group.joint};
}

/// The two, the one that is explained better first.
EffectPair make_pair(const View& view, const std::vector<Group>& groups, std::size_t a, std::size_t b,
                     const DistinguishOptions& options) {
  if (view.r2(b, a) > view.r2(a, b) + 1e-9) std::swap(a, b);
  EffectPair pair;
  pair.effect = groups[a].effect->name;
  pair.joint = groups[a].joint;
  pair.other = groups[b].effect->name;
  pair.other_joint = groups[b].joint;
  pair.r2 = view.r2(a, b);
  const EffectSize size = smallest(view, groups[a], a, options);
  pair.parameter = size.parameter;
  pair.unit = size.unit;
  pair.size = size_beside(view, b, view.columns.at(size.parameter), size.standard_errors);
  pair.separated_by =
      separated_by({groups[a].effect, joints_of(groups[a])}, {groups[b].effect, joints_of(groups[b])},
                   recorded(options), "measure poses where the two differ (name both to have them added)");
  return pair;
}

/// Columns of an effect at the plan and at the proposals, both of unit rms over the two together, so that what the plan
/// does not move at all counts as well.
struct HereAndThere {
  MatrixXd here, there;
};

HereAndThere unit_rms(const View& view, const Columns& there, const std::vector<Index>& columns) {
  std::vector<Index> places;
  for (const Index k : columns) places.push_back(there.at(view.columns.parameters[static_cast<std::size_t>(k)].name));
  HereAndThere out{chosen(view.columns.x, columns), chosen(there.x, places)};
  const double planned = static_cast<double>(view.columns.x.rows() / there.per_pose);
  const double proposed = static_cast<double>(there.x.rows() / there.per_pose);
  for (Index k = 0; k < out.here.cols(); ++k) {
    const double rms = std::sqrt(out.here.col(k).squaredNorm() / planned + out.there.col(k).squaredNorm() / proposed);
    if (!(rms > 0.0)) continue;
    out.here.col(k) /= rms;
    out.there.col(k) /= rms;
  }
  return out;
}

/// What the rival, with base and tool, cannot follow of an effect at the proposals once it is fitted to it on the plan.
MatrixXd left_by_rival(const View& view, const Columns& there, const std::vector<Index>& effect,
                       const std::vector<Index>& rival) {
  std::vector<Index> rivals = view.base;
  rivals.insert(rivals.end(), view.tool.begin(), view.tool.end());
  rivals.insert(rivals.end(), rival.begin(), rival.end());
  const HereAndThere x = unit_rms(view, there, rivals), y = unit_rms(view, there, effect);
  const double planned = static_cast<double>(view.columns.x.rows() / there.per_pose);
  const double proposed = static_cast<double>(there.x.rows() / there.per_pose);
  // What the plan leaves open, the rival uses to follow on poses of this kind in general: they count, but little.
  const double little = std::sqrt(1e-3 * planned / proposed);
  MatrixXd both(x.here.rows() + x.there.rows(), x.here.cols()), wanted(both.rows(), y.here.cols());
  both << x.here, little * x.there;
  wanted << y.here, little * y.there;
  return y.there - x.there * least_squares(both, wanted);
}

/// The pose, of some hundred, where rivals that are fitted to each other on what is planned already still differ most
/// (greedy T-optimal design, Atkinson and Fedorov 1975), summed over the pairs that still share much. False: none
/// tells.
bool next_pose(const View& view, const std::vector<Planned>& proposals, const Robot& carrying, const Pairs& shared,
               const DistinguishOptions& options, Planned* out) {
  const Columns there = make_columns(carrying, proposals, {}, options, nullptr);
  const Index m = there.per_pose, count = static_cast<Index>(proposals.size());
  Eigen::VectorXd told = Eigen::VectorXd::Zero(count);
  for (const auto& [a, b] : shared) {
    const MatrixXd left = left_by_rival(view, there, view.seen[a].columns, view.seen[b].columns);
    for (Index k = 0; k < count; ++k)
      told[k] += left.middleRows(k * m, m).squaredNorm() / static_cast<double>(std::max<Index>(1, left.cols()));
  }
  Index best = -1;
  if (count == 0 || !(told.maxCoeff(&best) > kTellsNothing)) return false;
  *out = proposals[static_cast<std::size_t>(best)];
  return true;
}

/// A plan whose effects are to be told apart; poses are added to it until they are.
class Plan {
 public:
  Plan(const Robot& robot, const MatrixXd& joints, const DistinguishOptions& options, Distinction* result)
      : robot_(robot), options_(options), inputs_(options, robot.driven_count()), result_(*result) {
    for (Index k = 0; k < joints.rows(); ++k)
      poses_.push_back(inputs_.planned(joints.row(k).transpose(), static_cast<std::size_t>(k),
                                       static_cast<std::size_t>(joints.rows())));
    {
      const Measured measured(robot_, poses_, options_);
      check_names(robot_, options_, measured.data);
      groups_ = find_groups(robot_, measured.data, options_, &result_.not_testable);
    }
    for (const EffectRequest& request : options_.separate) names_.insert(request.effect);
    view_ = look(robot_, poses_, groups_, options_, &carrying_);
    for (std::size_t a = 0; a < groups_.size(); ++a) {
      for (std::size_t b = a + 1; b < groups_.size(); ++b) {
        const bool wanted = all() ? is_wanted(a) || is_wanted(b) : is_wanted(a) && is_wanted(b);
        if (wanted && view_.is_visible(a) && view_.is_visible(b)) pairs_.emplace_back(a, b);
      }
    }
    for (const auto& [a, b] : pairs_) result_.separated.push_back(make_pair(view_, groups_, a, b, options_));
  }

  /// Poses that tell the pairs apart, one by one.
  void add_poses() {
    if (pairs_.empty() || options_.add <= 0) return;
    const std::vector<Range> ranges =
        joint_ranges(robot_, options_.min_step, options_.min_step_prismatic, "distinguish");
    const Model bare = make_model(robot_, Measurements{});
    const std::vector<Planned> first = poses_;
    while (result_.added < options_.add) {
      const Pairs shared = shared_pairs();
      Planned best;
      if (shared.empty() || !next_pose(view_, propose(first, ranges, bare), carrying_, shared, options_, &best) ||
          !keep_if_it_tells(best, shared))
        break;
      ++result_.added;
    }
    for (std::size_t k = 0; k < pairs_.size(); ++k) look_again(pairs_[k], &result_.separated[k]);
  }

  /// What the whole plan sees.
  void describe() {
    std::stable_sort(result_.separated.begin(), result_.separated.end(),
                     [](const EffectPair& a, const EffectPair& b) { return a.r2 > b.r2; });
    std::vector<std::size_t> shown;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      if (!all() && !is_wanted(g)) continue;
      if (!view_.is_visible(g)) {
        result_.not_testable.push_back(why_invisible(view_, groups_[g], view_.seen[g]));
        continue;
      }
      const EffectSize size = smallest(view_, groups_[g], g, options_);
      if (is_beyond_machines(size, groups_[g], robot_)) {
        result_.not_testable.push_back(why_not_seen(size));
        continue;
      }
      shown.push_back(g);
      result_.effects.push_back(size);
    }
    say_what_was_asked_only();
    say_one_sided();
    compare(shown);
    hand_out_poses();
  }

 private:
  /// One effect alone is to be told from everything else.
  bool all() const { return names_.size() < 2; }
  bool is_wanted(std::size_t g) const { return is_named(options_.separate, groups_[g]); }

  /// Pairs of which too much is still shared, the one that is explained better first.
  Pairs shared_pairs() const {
    Pairs shared;
    for (const auto& [a, b] : pairs_) {
      const double forth = view_.r2(a, b), back = view_.r2(b, a);
      if (std::max(forth, back) > kGoal) shared.push_back(forth >= back ? std::make_pair(a, b) : std::make_pair(b, a));
    }
    return shared;
  }

  /// Poses to choose the next one from: half of them are of the plan, with other inputs.
  std::vector<Planned> propose(const std::vector<Planned>& first, const std::vector<Range>& ranges, const Model& bare) {
    std::vector<Planned> proposals;
    const Pose last = poses_.back().joints;
    for (int k = 0; k < options_.proposals; ++k) {
      Pose pose(static_cast<Index>(ranges.size()));
      if (k % 2 == 0) {
        pose = first[inputs_.random().below(first.size())].joints;
        bool far = true;
        for (Index j = 0; j < pose.size(); ++j)
          far = far && std::abs(pose[j] - last[j]) > ranges[static_cast<std::size_t>(j)].step;
        if (!far) continue;
      } else if (!draw_pose(robot_, bare, ranges, &last, nullptr, &inputs_.random(), &pose)) {
        continue;
      }
      proposals.push_back(inputs_.drawn(pose, poses_.size()));
    }
    return proposals;
  }

  /// False: with this pose the pairs are hardly better told apart, and it is not taken.
  bool keep_if_it_tells(const Planned& pose, const Pairs& shared) {
    poses_.push_back(pose);
    Robot carrying;
    View more = look(robot_, poses_, groups_, options_, &carrying);
    double fall = 0.0;
    for (const auto& [a, b] : shared) fall += view_.r2(a, b) - more.r2(a, b);
    if (fall < kProgress * static_cast<double>(shared.size())) {
      poses_.pop_back();
      return false;
    }
    view_ = std::move(more);
    carrying_ = std::move(carrying);
    return true;
  }

  void look_again(const std::pair<std::size_t, std::size_t>& groups, EffectPair* pair) const {
    const Group& first = groups_[groups.first];
    const bool as_before = first.effect->name == pair->effect && first.joint == pair->joint;
    const std::size_t a = as_before ? groups.first : groups.second, b = as_before ? groups.second : groups.first;
    pair->r2_after = view_.r2(a, b);
    const double size = size_beside(view_, b, view_.columns.at(pair->parameter), view_.standard_errors(a));
    if (std::isfinite(size)) pair->size_after = size;
  }

  void say_what_was_asked_only() {
    if (all()) return;
    const auto other = [&](const NotTestable& n) { return names_.count(n.effect) == 0; };
    result_.not_testable.erase(std::remove_if(result_.not_testable.begin(), result_.not_testable.end(), other),
                               result_.not_testable.end());
  }

  /// Effects of the direction, where it was not recorded.
  void say_one_sided() {
    if (recorded(options_).direction) return;
    for (const Effect& effect : catalogue()) {
      if (effect.traits.driver != Driver::direction || effect.traits.search != Search::always) continue;
      if (!all() && names_.count(effect.name) == 0) continue;
      result_.not_testable.push_back(
          {effect.name,
           {},
           "no column dir: every pose is approached from the same side, and play is the same as a joint's zero",
           Untestable::column_missing});
    }
  }

  void compare(const std::vector<std::size_t>& shown) {
    const auto count = static_cast<Index>(shown.size());
    const auto at = [&](Index k) { return shown[static_cast<std::size_t>(k)]; };
    result_.r2.resize(count, count);
    for (Index i = 0; i < count; ++i) {
      for (Index j = 0; j < count; ++j) result_.r2(i, j) = i == j ? 1.0 : view_.r2(at(i), at(j));
    }
    for (Index i = 0; i < count; ++i) {
      for (Index j = i + 1; j < count; ++j) {
        if (std::max(result_.r2(i, j), result_.r2(j, i)) > options_.alike)
          result_.alike.push_back(make_pair(view_, groups_, at(i), at(j), options_));
      }
    }
    std::stable_sort(result_.alike.begin(), result_.alike.end(),
                     [](const EffectPair& a, const EffectPair& b) { return a.r2 > b.r2 + 1e-9; });
  }

  void hand_out_poses() {
    const Recorded with = recorded(options_);
    const auto n = static_cast<Index>(poses_.size()), driven = static_cast<Index>(robot_.driven_count());
    result_.joints.resize(n, driven);
    if (with.direction) result_.direction.resize(n, driven);
    if (with.payload) result_.payload.resize(n);
    if (with.temperature) result_.temperature.resize(n);
    if (with.time) result_.time.resize(n);
    for (Index k = 0; k < n; ++k) {
      const Planned& pose = poses_[static_cast<std::size_t>(k)];
      result_.joints.row(k) = pose.joints.transpose();
      for (Index j = 0; j < result_.direction.cols(); ++j)
        result_.direction(k, j) = pose.direction[static_cast<std::size_t>(j)];
      if (with.payload) result_.payload[k] = pose.payload;
      if (with.temperature) result_.temperature[k] = pose.temperature;
      if (with.time) result_.time[k] = pose.time;
    }
  }

  const Robot& robot_;
  const DistinguishOptions& options_;
  InputDraw inputs_;
  Distinction& result_;
  std::vector<Planned> poses_;
  std::vector<Group> groups_;
  std::set<std::string> names_;  ///< of effects to be told apart
  View view_;
  Robot carrying_;  ///< the robot with the effects at zero
  Pairs pairs_;     ///< to be told apart
};

void check_plan(const Robot& robot, const MatrixXd& joints) {
  const std::size_t driven = robot.driven_count();
  if (joints.cols() != static_cast<Index>(driven)) {
    throw std::invalid_argument("distinguish: poses have " + std::to_string(joints.cols()) + " joints, and the robot " +
                                std::to_string(driven) + " driven ones");
  }
  if (joints.rows() < 3) throw std::invalid_argument("distinguish: a plan has at least 3 poses");
  if (!joints.allFinite()) throw std::invalid_argument("distinguish: joints must be finite");
}

}  // namespace
}  // namespace planning

bool DistinguishOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(payload > 0.0) || !std::isfinite(payload)) return fail("payload must be positive");
  if (!(temperature_high > temperature_low) || !std::isfinite(temperature_high - temperature_low))
    return fail("temperature_high must be above temperature_low");
  if (!(seconds_per_pose > 0.0) || !std::isfinite(seconds_per_pose)) return fail("seconds_per_pose must be positive");
  if (!(position_sigma > 0.0) || !(rotation_sigma > 0.0))
    return fail("position_sigma and rotation_sigma must be positive");
  if (!(alike > 0.0 && alike < 1.0)) return fail("alike must lie between 0 and 1");
  if (add < 0 || proposals < 1) return fail("add must not be negative, proposals at least 1");
  if (!(min_step >= 0.0) || !(min_step_prismatic >= 0.0)) return fail("min_step must not be negative");
  return true;
}

Distinction distinguish(const Robot& given, const Eigen::MatrixXd& joints, const DistinguishOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("distinguish: " + error);
  validate(given);
  Robot robot = given;
  robot.effects.clear();
  recorded(options);  // throws
  check_plan(robot, joints);
  Distinction result;
  Plan plan(robot, joints, options, &result);
  plan.add_poses();
  plan.describe();
  return result;
}

}  // namespace truing
