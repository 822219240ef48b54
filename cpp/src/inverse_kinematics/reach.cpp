// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/reach.hpp"
#include "math/constants.hpp"

#include <stdexcept>
#include <string>

namespace truing::inverse_kinematics {
namespace {

using Eigen::Vector3d;

Limits limits_of(const Arm& arm) {
  Limits limits;
  int reading = 0;
  for (std::size_t k = 0; k < arm.robot().joints.size(); ++k) {
    const Joint& joint = arm.robot().joints[k];
    if (!joint.passive()) {
      limits.lower[reading] = joint.lower;
      limits.upper[reading++] = joint.upper;
    } else if (std::isfinite(joint.lower) || std::isfinite(joint.upper)) {
      PassiveLimit limit{{}, arm.motion_constants()[static_cast<Eigen::Index>(k)], joint.lower, joint.upper};
      for (int j = 0; j < arm.driven(); ++j) limit.weight[j] = arm.motion_weights()(static_cast<Eigen::Index>(k), j);
      limits.passive.push_back(limit);
    }
  }
  return limits;
}

/// Metres that count as a radian: the length of what turns, stretched out, over pi.
Scales scales_of(const Arm& arm) {
  Tip home;
  const std::vector<HomeAxis> axes = arm.home_axes(&home);
  double length = 0.0;
  const HomeAxis* last = nullptr;
  for (const HomeAxis& axis : axes) {
    if (axis.prismatic) continue;
    if (last) length += (axis.point - last->point).norm();
    last = &axis;
  }
  if (last) length += (home.position - last->point).norm();
  Scales scales;
  scales.length = length > 1e-3 ? length / kPi : 1.0;
  std::size_t reading = 0;
  for (const Joint& joint : arm.robot().joints) {
    if (!joint.passive()) scales.joint[reading++] = joint.type == JointType::prismatic ? scales.length : 1.0;
  }
  return scales;
}

const InverseOptions& valid(const InverseOptions& options) {
  std::string why;
  if (!options.is_valid(&why)) throw std::invalid_argument(why);
  return options;
}

/// Steps of the additive recurrence x_k = frac(1/2 + k a), a_j = g^-(j+1), g^(n+1) = g + 1: the generalised golden
/// ratio (Roberts 2018).
void golden_steps(int n, double* step) {
  double g = 2.0;
  for (int i = 0; i < 60; ++i) g = std::pow(1.0 + g, 1.0 / (n + 1));
  double power = 1.0;
  for (int j = 0; j < n; ++j) step[j] = power /= g;
}

}  // namespace

Reach::Reach(const Robot& robot, const InverseOptions& o, const Conditions& c, std::size_t target,
             const std::vector<Effect>& own)
    : options(valid(o)),
      conditions(c),
      arm(robot, c, target, own),
      limits(limits_of(arm)),
      scales(scales_of(arm)),
      closed(arm, o),
      surroundings(o.scene.empty() ? Surroundings() : Surroundings(o.scene, arm)),
      pool(arm) {
  golden_steps(arm.driven(), golden_);
  Borrowed(arm, &pool, conditions);  // complains about inputs that are missing
}

bool Reach::check(Search* search, const double* readings, Solution* solution) const {
  const int n = driven();
  solution->joints.resize(n);
  for (int j = 0; j < n; ++j) {
    double q = readings[j];
    if (q > limits.upper[j] && q <= limits.upper[j] + kLimitRounding) q = limits.upper[j];
    if (q < limits.lower[j] && q >= limits.lower[j] - kLimitRounding) q = limits.lower[j];
    solution->joints[j] = q;
  }
  const Miss miss = miss_of(search->goal, arm.tip(solution->joints.data(), search->scratch));
  solution->position_error = miss.position;
  solution->rotation_error = miss.rotation;
  solution->roll = miss.roll;
  solution->reason = Reason::out_of_reach;
  int joint = -1;
  if (limits.excess(n, solution->joints.data(), &joint) > 0.0) return false;
  if (!(miss.position <= options.position_tolerance && miss.rotation <= options.rotation_tolerance)) return false;
  if (!surroundings.empty()) {
    const NearestPair pair = surroundings.nearest(arm, solution->joints.data());
    solution->contact = {pair.first, pair.second};
    solution->contact_distance = pair.distance + options.scene.clearance;
    if (pair.distance < 0.0) {
      solution->reason = Reason::interference;
      if (search->interfering.joints.size() == 0 || solution->contact_distance > search->interfering.contact_distance)
        search->interfering = *solution;
      return false;
    }
  }
  solution->reason = Reason::reached;
  return true;
}

double Reach::distance2(const double* a, const double* b) const {
  double sum = 0.0;
  for (int j = 0; j < driven(); ++j) {
    const double d = (a[j] - b[j]) / scales.joint[j];
    sum += d * d;
  }
  return sum;
}

// ---- Descents -------------------------------------------------------------------------------------------------------

Descent Reach::descent_from(Search* search, const double* from, const DescentOptions& how) const {
  Descent descent;
  std::copy(from, from + driven(), descent.readings);
  descend(arm, limits, scales, search->goal, how, search->scratch, &descent);
  search->iterations += descent.iterations;
  return descent;
}

/// Seed k of those that restarts begin from: evenly over the joints' ranges, of unlimited ones over a turn or the arm's
/// reach.
void Reach::restart_seed(int k, const double* around, double* seed) const {
  for (int j = 0; j < driven(); ++j) {
    const double half = kPi * scales.joint[j];
    double low = limits.lower[j], high = limits.upper[j];
    if (!std::isfinite(low) || !std::isfinite(high)) {
      const double middle = std::clamp(around[j], low, high);
      low = std::max(low, middle - half);
      high = std::min(high, middle + half);
    } else if (arm.turns(j) && high - low > 2.0 * half) {
      const double middle = 0.5 * (low + high);
      low = middle - half;
      high = middle + half;
    }
    const double x = 0.5 + (k + 1) * golden_[j];
    seed[j] = low + (high - low) * (x - std::floor(x));
  }
}

/// One descent, within limits.
bool Reach::descend_to(Search* search, const double* from, Solution* solution) const {
  DescentOptions how;
  how.max_iterations = options.max_iterations;
  const Descent descent = descent_from(search, from, how);
  if (descent.cost < search->nearest.cost) search->nearest = descent;
  return check(search, descent.readings, solution);
}

/// From the seed, then from others until one arrives.
bool Reach::descend_from_many(Search* search, int restarts, Solution* solution) const {
  if (descend_to(search, search->seed, solution)) return true;
  double from[kMaxDrivenJoints];
  for (int k = 0; k < restarts; ++k) {
    restart_seed(k, search->seed, from);
    if (descend_to(search, from, solution)) return true;
  }
  return false;
}

// ---- Closed form ----------------------------------------------------------------------------------------------------

/// What the closed form knows of a pose with the rails there, nearest to the seed first; `slack`: how far beyond limits
/// they may lie.
int Reach::candidates(Search* search, const Goal& pose, const double* rails, double slack, Candidate* found) const {
  Configuration all[ClosedForm::kMost];
  double from[kMaxDrivenJoints];
  std::copy(search->seed, search->seed + driven(), from);
  std::copy(rails, rails + closed.rails(), from);
  const double hold = closed.angle(closed.kind() == ClosedFormKind::spherical_wrist ? 3 : 5, from);
  const int count = closed.solve({pose.rotation, pose.position}, from, hold, all);
  bool worth[ClosedForm::kMost];
  std::fill(worth, worth + count, true);
  if (!closed.exact()) choose_on_circles(pose, from, all, count, search->scratch, worth);
  int kept = 0;
  for (int k = 0; k < count; ++k) {
    if (!worth[k]) continue;
    Candidate c;
    closed.readings_near(all[k], from, limits.lower, limits.upper, c.readings, &c.excess);
    if (c.excess > slack) continue;
    c.branch = all[k].branch;
    c.distance = distance2(c.readings, search->seed);
    int at = kept++;
    for (; at > 0 && found[at - 1].distance > c.distance; --at) found[at] = found[at - 1];
    found[at] = c;
  }
  return kept;
}

/// Above det J in Cramer's rule for Newton's step of one joint: det [J, the error in place of that joint's column].
/// Zero where the other joints alone take the error away.
double Reach::newton_numerator(const Goal& pose, const double* readings, int joint, EffectScratch* scratch) const {
  Columns columns;
  const Tip tip = arm.tip(readings, scratch, &columns);
  columns.linear[joint] = pose.position - tip.position;
  columns.angular[joint] = rotation_between(tip.rotation, pose.rotation);
  Eigen::Matrix<double, 6, 6> J;
  for (int j = 0; j < 6; ++j)
    J.col(j) << columns.linear[closed.rails() + j] / scales.length, columns.angular[closed.rails() + j];
  return J.determinant();
}

/// Round a circle of seeds Newton's step of the joint that goes round passes through zero near every configuration that
/// the robot has there: seeds are moved to these zeros, and those beside a place that is missing stay.
void Reach::choose_on_circles(const Goal& pose, const double* from, Configuration* all, int count,
                              EffectScratch* scratch, bool* worth) const {
  int at[ClosedForm::kCircles][ClosedForm::kMostPlaces];
  double value[ClosedForm::kMost];
  Configuration moved[ClosedForm::kMost];
  bool any = false;
  for (int k = 0; k < count; ++k) {
    if (all[k].circle < 0) continue;
    if (!any) std::fill(&at[0][0], &at[0][0] + ClosedForm::kCircles * ClosedForm::kMostPlaces, -1);
    any = true;
    at[all[k].circle][all[k].place] = k;
    double readings[kMaxDrivenJoints], excess = 0.0;
    closed.readings_near(all[k], from, limits.lower, limits.upper, readings, &excess);
    value[k] = newton_numerator(pose, readings, closed.rails() + all[k].about, scratch);
    worth[k] = false;
  }
  if (!any) return;
  for (int k = 0; k < count; ++k) {
    if (all[k].circle < 0) continue;
    const int* circle = at[all[k].circle];
    const int places = all[k].places;
    const int before = circle[(all[k].place + places - 1) % places], next = circle[(all[k].place + 1) % places];
    moved[k] = all[k];
    if (before < 0 || next < 0) {
      worth[k] = true;
    } else if ((value[k] < 0.0) != (value[next] < 0.0)) {
      worth[k] = true;
      const double share = value[k] / (value[k] - value[next]);
      for (int i = 0; i < 6; ++i)
        moved[k].angle[i] += share * std::remainder(all[next].angle[i] - all[k].angle[i], 2.0 * kPi);
    } else {
      // It may touch zero between places: where its size is least, and small.
      const bool least = std::abs(value[k]) < std::abs(value[before]) && std::abs(value[k]) <= std::abs(value[next]);
      const bool alone = (value[k] < 0.0) == (value[before] < 0.0);
      worth[k] = least && alone;
    }
  }
  for (int k = 0; k < count; ++k) {
    if (all[k].circle >= 0) all[k] = moved[k];
  }
}

/// A candidate carried over to the robot as it is, rails and limits aside; then the turns nearest to the seed within
/// limits.
bool Reach::polish(Search* search, const Candidate& candidate, Solution* solution) const {
  solution->branch = candidate.branch;
  constexpr double kGood = 1e-10;  // of what closed forms give away from singularities
  const bool good = closed.exact() && check(search, candidate.readings, solution);
  if (good && solution->position_error <= kGood && solution->rotation_error <= kGood) return true;
  DescentOptions how;
  how.max_iterations = options.max_iterations;
  how.fixed_joints = closed.rails();
  how.ignore_limits = true;
  how.patience = 4;  // what ends at a singularity has mostly nothing beside it
  Descent descent = descent_from(search, candidate.readings, how);
  how.patience = 6;
  if (!descent.converged) leave_singularity(search, candidate.readings, how, &descent);
  if (!descent.converged) return good && check(search, candidate.readings, solution);
  return finish(search, descent, solution);
}

/// A descent without limits ended here: the turns nearest to the seed, and within limits.
bool Reach::finish(Search* search, Descent descent, Solution* solution) const {
  double from[kMaxDrivenJoints], readings[kMaxDrivenJoints], excess = 0.0;
  Configuration here;
  for (int k = 0; k < 6; ++k) here.angle[k] = closed.angle(k, descent.readings);
  std::copy(search->seed, search->seed + driven(), from);
  std::copy(descent.readings, descent.readings + closed.rails(), from);
  closed.readings_near(here, from, limits.lower, limits.upper, readings, &excess);
  if (excess > kLimitRounding) return false;
  if (arm.has_effects()) {  // they need not come again after a whole turn
    DescentOptions how;
    how.max_iterations = options.max_iterations;
    how.fixed_joints = closed.rails();
    how.ignore_limits = true;
    descent = descent_from(search, readings, how);
    std::copy(descent.readings, descent.readings + driven(), readings);
  }
  return check(search, readings, solution);
}

/// A descent that ended at a singularity, e != 0 there, may have its answer beside it. Lyapunov-Schmidt: with J v = 0
/// and u J = 0 all but u e can be taken away by the other motions, and u e(q + s v) = c + b s + a s^2 has its zeros
/// where the answers are; or there are none.
void Reach::leave_singularity(Search* search, const double* seed, const DescentOptions& how, Descent* descent) const {
  constexpr double kNear = 1e-3;                   // of the cost
  constexpr double kProbe = 0.1, kFurthest = 1.5;  // [rad]
  if (descent->cost > kNear) return;
  double still[kMaxDrivenJoints];
  const Vector6d u = still_direction(descent->readings, how.fixed_joints, search->scratch, still);
  const auto beside = [&](double s, double* readings) {
    for (int j = 0; j < driven(); ++j) readings[j] = descent->readings[j] + s * still[j];
  };
  const auto left = [&](double s) {
    double readings[kMaxDrivenJoints];
    beside(s, readings);
    const Tip tip = arm.tip(readings, search->scratch);
    return u.head<3>().dot(search->goal.position - tip.position) / scales.length +
           u.tail<3>().dot(rotation_between(tip.rotation, search->goal.rotation));
  };
  const double c = left(0.0), plus = left(kProbe), minus = left(-kProbe);
  const double a = 0.5 * (plus + minus - 2.0 * c) / (kProbe * kProbe), b = 0.5 * (plus - minus) / kProbe;
  const double discriminant = b * b - 4.0 * a * c;
  if (!(discriminant > 0.0)) return;
  // The zero on the side that the seed came from first: the other one is its twin's.
  double side = 0.0;
  for (int j = 0; j < driven(); ++j)
    side += (seed[j] - descent->readings[j]) * still[j] / (scales.joint[j] * scales.joint[j]);
  const double half = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  const double zero[2] = {half / a, c / half};
  const int first = side * zero[0] > side * zero[1] ? 0 : 1;
  for (const int k : {first, 1 - first}) {
    if (!(std::abs(zero[k]) < kFurthest)) continue;
    double from[kMaxDrivenJoints];
    beside(zero[k], from);
    const Descent other = descent_from(search, from, how);
    if (!other.converged) continue;
    *descent = other;
    return;
  }
}

/// The nearest branch, the rails where the seed has them.
bool Reach::solve_by_branches(Search* search, Solution* solution) const {
  Candidate found[ClosedForm::kMost];
  const int count = candidates(search, search->goal, search->seed, closed.exact() ? kLimitRounding : kNearLimit, found);
  for (int k = 0; k < count; ++k) {
    if (polish(search, found[k], solution)) return true;
  }
  solution->branch = -1;
  return false;
}

Goal pose_at_roll(const Goal& goal, double roll) {
  const auto nearest_to_zero = [](const Window& window) { return std::clamp(0.0, window.lower, window.upper); };
  const Vector3d leant = std::tan(nearest_to_zero(goal.lead)) * goal.travel +
                         std::tan(nearest_to_zero(goal.work)) * goal.across + goal.axis;
  Goal pose = goal;
  pose.kind = TaskKind::pose;
  pose.rotation =
      goal.rotation * Eigen::Quaterniond::FromTwoVectors(goal.axis, leant) * Eigen::AngleAxisd(roll, goal.axis);
  return pose;
}

/// A torch task as poses: every few degrees of roll the closed form, at the seed's rails.
bool Reach::solve_by_rolls(Search* search, Solution* solution) const {
  constexpr int kRolls = 72;
  const Goal& goal = search->goal;
  const bool fixed = goal.wanted_roll == goal.wanted_roll;
  const double low = goal.rolls ? goal.roll.lower : -kPi, high = goal.rolls ? goal.roll.upper : kPi;
  for (int k = 0; k < (fixed ? 1 : kRolls); ++k) {
    Candidate found[ClosedForm::kMost];
    const Goal pose = pose_at_roll(goal, fixed ? goal.wanted_roll : low + (high - low) * (k + 0.5) / kRolls);
    const int count = candidates(search, pose, search->seed, kNearLimit, found);
    for (int i = 0; i < count; ++i) {
      if (descend_to(search, found[i].readings, solution)) return true;
    }
  }
  return false;
}

// ---- One answer -----------------------------------------------------------------------------------------------------

bool Reach::solve_once(Search* search, Solution* solution) const {
  const Goal& goal = search->goal;
  if (options.choose != Choose::nearest &&
      (solve_for_best(search, solution) || solve_for_best_of_many(search, solution)))
    return true;
  if (goal.kind == TaskKind::pose && closed && solve_by_branches(search, solution)) return true;
  // Without rails an exact closed form has said all there is to say, but for configurations at the rim of what exists.
  const bool said_all =
      goal.kind == TaskKind::pose && closed.exact() && closed && closed.rails() == 0 && limits.passive.empty();
  if (descend_from_many(search, said_all ? std::min(options.max_restarts, 8) : options.max_restarts, solution))
    return true;
  return goal.kind == TaskKind::torch && closed && solve_by_rolls(search, solution);
}

/// As near to the preferred roll as can be: there, or from the answer towards it until it goes no further.
bool Reach::solve_at_preferred_roll(Search* search, Solution* solution) const {
  Goal at = search->goal;
  at.rolls = true;
  Search there{at, search->seed, search->scratch};
  if (solve_once(&there, solution)) return true;
  Goal anywhere = search->goal;
  anywhere.wanted_roll = std::numeric_limits<double>::quiet_NaN();
  anywhere.rolls = anywhere.roll.upper - anywhere.roll.lower < 2.0 * kPi;
  Search first{anywhere, search->seed, search->scratch};
  if (!solve_once(&first, solution)) {
    search->nearest = first.nearest;
    search->interfering = first.interfering;
    return false;
  }
  const double whole = std::remainder(search->goal.wanted_roll - solution->roll, 2.0 * kPi);
  double share = 0.0, step = 0.5;
  for (int k = 0; k < 40 && step > 1e-9; ++k) {
    at.wanted_roll = solution->roll + std::min(step, 1.0 - share) * whole;
    Search next{at, solution->joints.data(), search->scratch};
    Solution further;
    if (descend_to(&next, solution->joints.data(), &further)) {
      share += std::min(step, 1.0 - share);
      *solution = further;
      if (share >= 1.0) break;
    } else {
      step *= 0.5;
    }
    search->iterations += next.iterations;
  }
  return true;
}

/// The goal moved along its direction of retreat, by the least that frees it: doubled steps until it is free, then
/// halved ones.
bool Reach::retreat(Search* search, Solution* solution) const {
  const Goal& goal = search->goal;
  if (!(goal.longest_retreat > 0.0) || search->interfering.joints.size() == 0) return false;
  constexpr double kFirst = 1e-3, kFine = 1e-5;  // [m]
  const auto free_at = [&](double way, const double* seed, Solution* there) {
    Goal moved = goal;
    moved.position += way * goal.retreat;
    Search at{moved, seed, search->scratch};
    there->retreat = way;
    // The configuration that interferes least first: it is the one to be freed.
    return descend_to(&at, seed, there) || solve_once(&at, there);
  };
  double blocked = 0.0, way = std::min(kFirst, goal.longest_retreat);
  Solution freed;
  while (!free_at(way, search->interfering.joints.data(), &freed)) {
    if (way >= goal.longest_retreat) return false;
    blocked = way;
    way = std::min(2.0 * way, goal.longest_retreat);
  }
  while (way - blocked > kFine) {
    const double middle = 0.5 * (blocked + way);
    Solution there;
    if (free_at(middle, freed.joints.data(), &there)) {
      way = middle;
      freed = there;
    } else {
      blocked = middle;
    }
  }
  *solution = freed;
  solution->reason = Reason::retreated;
  return true;
}

Solution Reach::solve(Search* search) const {
  Solution solution;
  const bool preferred = search->goal.wanted_roll == search->goal.wanted_roll;
  const bool reached = preferred ? solve_at_preferred_roll(search, &solution) : solve_once(search, &solution);
  if (!reached && !retreat(search, &solution)) explain(search, &solution);
  solution.iterations = search->iterations;
  return solution;
}

Solution Reach::follow(Search* search) const {
  Solution solution;
  if (!descend_to(search, search->seed, &solution)) explain(search, &solution);
  solution.iterations = search->iterations;
  return solution;
}

void Reach::branches(Search* search, Branches* found) const {
  found->count = found->beyond_limits = 0;
  const bool ways = search->scratch && search->by_way;
  const auto keep = [&](Solution& solution) {
    if (ways) {
      settle_directions(search, &solution);
      std::fill(search->scratch->direction.begin(), search->scratch->direction.end(), 0.0);
      if (!solution.reached()) return;
    }
    constexpr double kSame = 1e-5;
    for (int k = 0; k < found->count; ++k) {
      if ((found->solution[static_cast<std::size_t>(k)].joints - solution.joints).cwiseAbs().maxCoeff() < kSame) return;
    }
    if (found->count < static_cast<int>(found->solution.size()))
      found->solution[static_cast<std::size_t>(found->count++)] = solution;
  };
  if (closed) {
    Candidate all[ClosedForm::kMost];
    const int count = candidates(search, search->goal, search->seed, std::numeric_limits<double>::infinity(), all);
    for (int k = 0; k < count; ++k) {
      if (all[k].excess > (closed.exact() ? kLimitRounding : kNearLimit)) {
        ++found->beyond_limits;
        continue;
      }
      Solution solution;
      if (polish(search, all[k], &solution)) keep(solution);
    }
    return;
  }
  double from[kMaxDrivenJoints];
  for (int k = 0; k < 8 * std::max(1, options.max_restarts); ++k) {
    restart_seed(k, search->seed, from);
    Solution solution;
    if (descend_to(search, from, &solution)) keep(solution);
  }
}

void Reach::settle_directions(Search* search, Solution* solution) const {
  for (int round = 0; round < 4 && solution->reached(); ++round) {
    bool same = true;
    for (int j = 0; j < driven(); ++j) {
      const double way = solution->joints[j] - search->seed[j];
      const double direction = way > 0.0 ? 1.0 : way < 0.0 ? -1.0 : 0.0;
      same = same && search->scratch->direction[static_cast<std::size_t>(j)] == direction;
      search->scratch->direction[static_cast<std::size_t>(j)] = direction;
    }
    if (same) return;
    const Joints here = solution->joints;
    if (!descend_to(search, here.data(), solution)) explain(search, solution);
  }
}

}  // namespace truing::inverse_kinematics
