// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/descent.hpp"
#include "math/constants.hpp"
#include "math/registration.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace truing::inverse_kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInside = 1e-8;  // a window's edge is aimed at from so far inside: what converged is within [rad]

double wrapped(double angle) { return angle - 2.0 * kPi * std::floor((angle + kPi) / (2.0 * kPi)); }

/// Rotation vector that takes direction a to b; across both, any if they are opposite.
Vector3d swing_between(const Vector3d& a, const Vector3d& b) {
  const Vector3d n = a.cross(b);
  const double sine = n.norm(), cosine = a.dot(b);
  if (sine > 1e-9) return (std::atan2(sine, cosine) / sine) * n;
  return cosine > 0.0 ? n : Vector3d(kPi * a.unitOrthogonal());
}

/// How far `value` must move to be in the window, 0 inside. Aims `inside` the edge, or at the middle of what is
/// narrower.
double way_into(const Window& window, double value, double inside) {
  if (value >= window.lower && value <= window.upper) return 0.0;
  inside = std::min(inside, 0.5 * (window.upper - window.lower));
  return value > window.upper ? window.upper - inside - value : window.lower + inside - value;
}

/// The torch's axis as the wanted frame sees it.
struct Lean {
  double lead, work;
  Vector3d lead_row, work_row;  ///< gradients with respect to a small rotation about the measurement frame's axes
};

Lean lean_of(const Goal& goal, const Matrix3d& R) {
  const Vector3d a = R * goal.axis;
  const Vector3d t = goal.rotation * goal.travel, b = goal.rotation * goal.across, n = goal.rotation * goal.axis;
  const double along = a.dot(n), ahead = a.dot(t), aside = a.dot(b);
  // lead = atan2(a.t, a.n), and a moves by w x a: d(a.t) = w . (a x t).
  const auto row = [&](const Vector3d& side, double value) -> Vector3d {
    return (along * a.cross(side) - value * a.cross(n)) / std::max(along * along + value * value, 1e-12);
  };
  return {std::atan2(ahead, along), std::atan2(aside, along), row(t, ahead), row(b, aside)};
}

/// Turn about the torch's axis from the wanted frame to this one: the twist of the swing-twist decomposition.
double roll_of(const Goal& goal, const Matrix3d& R) {
  const Eigen::Quaterniond q(Matrix3d(goal.rotation.transpose() * R));
  return wrapped(2.0 * std::atan2(q.vec().dot(goal.axis), q.w()));
}
/// A window may lie across half a turn: the turn of roll that is nearest to its middle.
double roll_near(const Window& window, double roll) {
  const double middle = 0.5 * (window.lower + window.upper);
  return middle + wrapped(roll - middle);
}
Vector3d roll_row(const Goal& goal, const Matrix3d& R) {
  const Vector3d a = R * goal.axis, n = goal.rotation * goal.axis;
  return (a + n) / std::max(1.0 + a.dot(n), 1e-6);
}

// ---- Rows ----------------------------------------------------------------------------------------------------------

constexpr int kMostRows = 12;

/// The task's equations at one configuration, linearised: error = J dq. A column per joint.
struct Rows {
  int count = 0;
  double error[kMostRows];
  double column[kMaxDrivenJoints][kMostRows];
  double cost = 0.0;
  bool small = false;  ///< all within the tolerance
};

struct Problem {
  const Arm& arm;
  const Limits& limits;
  const Scales& scales;
  const Goal& goal;
  const DescentOptions& options;
  EffectScratch* scratch;
};

void add_position(const Problem& problem, const Tip& tip, const Columns& columns, Rows* rows) {
  const double per_metre = 1.0 / problem.scales.length;
  const Vector3d way = problem.goal.position - tip.position;
  for (int i = 0; i < 3; ++i) rows->error[i] = per_metre * way[i];
  for (int j = 0; j < problem.arm.driven(); ++j) {
    for (int i = 0; i < 3; ++i) rows->column[j][i] = per_metre * columns.linear[j][i];
  }
  rows->count = 3;
  rows->small = way.squaredNorm() <= problem.options.tolerance * problem.options.tolerance;
}

/// All three of a pose.
void add_rotation(const Problem& problem, const Tip& tip, const Columns& columns, Rows* rows) {
  const double per_radian = problem.options.rotation_weight;
  const Vector3d turn = rotation_between(tip.rotation, problem.goal.rotation);
  for (int i = 0; i < 3; ++i) rows->error[3 + i] = per_radian * turn[i];
  for (int j = 0; j < problem.arm.driven(); ++j) {
    for (int i = 0; i < 3; ++i) rows->column[j][3 + i] = per_radian * columns.angular[j][i];
  }
  rows->count = 6;
  rows->small = rows->small && turn.squaredNorm() <= problem.options.tolerance * problem.options.tolerance;
}

/// One equation of the orientation: `error` is to go about `direction`.
void add_angular(const Problem& problem, const Columns& columns, double error, const Vector3d& direction, Rows* rows) {
  const double per_radian = problem.options.rotation_weight;
  const int row = rows->count++;
  rows->error[row] = per_radian * error;
  for (int j = 0; j < problem.arm.driven(); ++j) {
    rows->column[j][row] = per_radian * direction.dot(columns.angular[j]);
  }
  rows->small = rows->small && std::abs(error) <= problem.options.tolerance;
}

/// The direction of the torch's axis.
void add_lean(const Problem& problem, const Tip& tip, const Columns& columns, Rows* rows) {
  const Goal& goal = problem.goal;
  if (!goal.leans) {
    // I - n n^T of the angular part: its two rows, along the tool frame's other axes.
    const Vector3d swing = swing_between(tip.rotation * goal.axis, goal.rotation * goal.axis);
    for (const Vector3d& side : {Vector3d(tip.rotation * goal.travel), Vector3d(tip.rotation * goal.across)}) {
      add_angular(problem, columns, side.dot(swing), side, rows);
    }
    return;
  }
  const Lean lean = lean_of(goal, tip.rotation);
  const double lead = way_into(goal.lead, lean.lead, kInside), work = way_into(goal.work, lean.work, kInside);
  if (lead != 0.0 || goal.lead.lower == goal.lead.upper) add_angular(problem, columns, lead, lean.lead_row, rows);
  if (work != 0.0 || goal.work.lower == goal.work.upper) add_angular(problem, columns, work, lean.work_row, rows);
}

/// The turn about the torch's axis, where it is not free.
void add_roll(const Problem& problem, const Tip& tip, const Columns& columns, Rows* rows) {
  const Goal& goal = problem.goal;
  if (goal.prefers_roll()) {
    const double error = wrapped(goal.wanted_roll - roll_of(goal, tip.rotation));
    add_angular(problem, columns, error, roll_row(goal, tip.rotation), rows);
  } else if (goal.rolls) {
    const double into = way_into(goal.roll, roll_near(goal.roll, roll_of(goal, tip.rotation)), kInside);
    if (into != 0.0) add_angular(problem, columns, into, roll_row(goal, tip.rotation), rows);
  }
}

/// Passive joints that are beyond their limits.
void add_passive_limits(const Problem& problem, const double* q, Rows* rows) {
  const int n = problem.arm.driven();
  for (const PassiveLimit& limit : problem.limits.passive) {
    double motion = limit.constant;
    for (int j = 0; j < n; ++j) motion += limit.weight[j] * q[j];
    const double into = way_into({limit.lower, limit.upper}, motion, kInside);
    if (into == 0.0 || rows->count == kMostRows) continue;
    const int row = rows->count++;
    rows->error[row] = into;
    for (int j = 0; j < n; ++j) rows->column[j][row] = limit.weight[j];
    rows->small = false;
  }
}

void evaluate(const Problem& problem, const double* q, Rows* rows) {
  Columns columns;
  const Tip tip = problem.arm.tip(q, problem.scratch, &columns);
  add_position(problem, tip, columns, rows);
  if (problem.goal.kind == TaskKind::pose) {
    add_rotation(problem, tip, columns, rows);
  } else if (problem.goal.kind == TaskKind::torch) {
    add_lean(problem, tip, columns, rows);
    add_roll(problem, tip, columns, rows);
  }
  if (!problem.options.ignore_limits) add_passive_limits(problem, q, rows);
  rows->cost = 0.0;
  for (int i = 0; i < rows->count; ++i) rows->cost += rows->error[i] * rows->error[i];
}

// ---- The step ------------------------------------------------------------------------------------------------------

/// y = A^-1 b for a symmetric positive A (lower triangle), by Cholesky, in place. False: A is not positive.
bool solve_positive(int n, double (*A)[kMostRows], double* b) {
  for (int k = 0; k < n; ++k) {
    double pivot = A[k][k];
    for (int i = 0; i < k; ++i) pivot -= A[k][i] * A[k][i];
    if (!(pivot > 0.0)) return false;
    const double inverse = 1.0 / std::sqrt(pivot);
    A[k][k] = inverse;
    for (int r = k + 1; r < n; ++r) {
      double sum = A[r][k];
      for (int i = 0; i < k; ++i) sum -= A[r][i] * A[k][i];
      A[r][k] = sum * inverse;
    }
    double sum = b[k];
    for (int i = 0; i < k; ++i) sum -= A[k][i] * b[i];
    b[k] = sum * inverse;
  }
  for (int k = n; k-- > 0;) {
    double sum = b[k];
    for (int i = k + 1; i < n; ++i) sum -= A[i][k] * b[i];
    b[k] = sum * A[k][k];
  }
  return true;
}

/// The joints that are free to move, and what they are to do.
struct ActiveSet {
  bool free[kMaxDrivenJoints];
  double sum[kMostRows][kMostRows] = {};  ///< J W J^T of the free ones, lower triangle
  double error[kMostRows];                ///< less what the joints that stopped at a limit have done
};

/// A joint into the sum, or with sign -1 out of it.
void add_joint(const Problem& problem, const Rows& rows, int j, double sign, ActiveSet* set) {
  const double* column = rows.column[j];
  const double scale = problem.scales.joint[j];
  const double weight = sign * scale * scale;
  for (int r = 0; r < rows.count; ++r) {
    const double scaled = weight * column[r];
    for (int c = 0; c <= r; ++c) set->sum[r][c] += scaled * column[c];
  }
}

/// All but the fixed joints, and those that stand at a limit and would be driven beyond it.
void free_joints(const Problem& problem, const Rows& rows, const double* q, ActiveSet* set) {
  std::copy(rows.error, rows.error + rows.count, set->error);
  for (int j = 0; j < problem.arm.driven(); ++j) {
    set->free[j] = j >= problem.options.fixed_joints;
    if (!set->free[j]) continue;
    double downhill = 0.0;
    for (int r = 0; r < rows.count; ++r) downhill += rows.column[j][r] * set->error[r];
    const bool at_limit = !problem.options.ignore_limits && ((q[j] >= problem.limits.upper[j] && downhill > 0.0) ||
                                                             (q[j] <= problem.limits.lower[j] && downhill < 0.0));
    set->free[j] = !at_limit;
    if (set->free[j]) add_joint(problem, rows, j, 1.0, set);
  }
}

/// The step of the free joints, and how long its longest turn is [rad]: the tip follows a slide in a straight line
/// however far it goes. False: the damping is too small.
bool step_free(const Problem& problem, const Rows& rows, const ActiveSet& set, double damping, double* step,
               double* longest) {
  const int m = rows.count;
  const double* scale = problem.scales.joint;
  double A[kMostRows][kMostRows], y[kMostRows];
  for (int r = 0; r < m; ++r) {
    std::copy(set.sum[r], set.sum[r] + r + 1, A[r]);
    A[r][r] += damping;
    y[r] = set.error[r];
  }
  if (!solve_positive(m, A, y)) return false;
  *longest = 0.0;
  for (int j = 0; j < problem.arm.driven(); ++j) {
    if (!set.free[j]) continue;
    double move = 0.0;
    for (int r = 0; r < m; ++r) move += rows.column[j][r] * y[r];
    step[j] = scale[j] * scale[j] * move;
    if (problem.arm.turns(j)) *longest = std::max(*longest, std::abs(step[j]));
  }
  return true;
}

/// Joints that the shortened step would take past a limit go to the limit, and are free no more. True: there are none.
bool stop_at_limits(const Problem& problem, const Rows& rows, const double* q, double shorten, double* step,
                    ActiveSet* set) {
  const double *lower = problem.limits.lower, *upper = problem.limits.upper;
  bool within = true;
  for (int j = 0; j < problem.arm.driven(); ++j) {
    if (!set->free[j]) continue;
    const double at = q[j] + shorten * step[j];
    if (at <= upper[j] && at >= lower[j]) continue;
    within = false;
    set->free[j] = false;
    step[j] = (at > upper[j] ? upper[j] : lower[j]) - q[j];
    for (int r = 0; r < rows.count; ++r) set->error[r] -= rows.column[j][r] * step[j];
    add_joint(problem, rows, j, -1.0, set);
  }
  return within;
}

/// What turns by a shortened step leaves the rest of the error to what slides. True: nothing that is free slides.
bool shorten_turns(const Problem& problem, const Rows& rows, double shorten, double* step, ActiveSet* set) {
  const int n = problem.arm.driven();
  bool slides = false;
  for (int j = 0; j < n; ++j) slides = slides || (set->free[j] && !problem.arm.turns(j));
  for (int j = 0; j < n; ++j) {
    if (!set->free[j]) continue;
    step[j] *= shorten;
    if (!slides || !problem.arm.turns(j)) continue;
    set->free[j] = false;
    for (int r = 0; r < rows.count; ++r) set->error[r] -= rows.column[j][r] * step[j];
    add_joint(problem, rows, j, -1.0, set);
  }
  return !slides;
}

/// dq = W J^T (J W J^T + damping I)^-1 error over the joints that are free to move: the damped pseudo-inverse with
/// joint scales W. A joint that would pass its limit goes to the limit and no further, and the others are solved for
/// again with what is then left of the error: an active set, so that the error is redistributed and not cut off.
bool solve_step(const Problem& problem, const Rows& rows, const double* q, double damping, double* step) {
  const int n = problem.arm.driven();
  std::fill(step, step + n, 0.0);
  ActiveSet set;
  free_joints(problem, rows, q, &set);
  for (int round = 0; round <= n; ++round) {
    double longest = 0.0;
    if (!step_free(problem, rows, set, damping, step, &longest)) return false;
    // What is too long is shortened first: a joint stops at its limit only where the shortened step would pass it.
    const double shorten = longest > problem.options.longest_step ? problem.options.longest_step / longest : 1.0;
    if (!problem.options.ignore_limits && !stop_at_limits(problem, rows, q, shorten, step, &set)) continue;
    if (shorten == 1.0 || shorten_turns(problem, rows, shorten, step, &set)) return true;
  }
  return true;
}

/// The cost that may damp: of twice the arm's length, which counts as pi (Scales), and half a turn: (2 pi)^2 + pi^2.
/// What is beyond that is for slides to bring, and those need no care.
double far_cost(const Arm& arm) {
  for (int j = 0; j < arm.driven(); ++j) {
    if (!arm.turns(j)) return 5.0 * kPi * kPi;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Goal::Goal(const Task& task)
    : kind(task.kind),
      rotation(task.T_measurement_target.linear()),
      position(task.T_measurement_target.translation()),
      axis(task.axis),
      roll(task.roll),
      lead(task.lead),
      work(task.work),
      wanted_roll(task.kind == TaskKind::torch ? task.preferred_roll : std::numeric_limits<double>::quiet_NaN()),
      retreat(task.T_measurement_target.linear() * task.retreat),
      longest_retreat(task.longest_retreat) {
  travel = (task.travel - task.travel.dot(axis) * axis).normalized();
  across = axis.cross(travel);
  leans = lead.lower != 0.0 || lead.upper != 0.0 || work.lower != 0.0 || work.upper != 0.0;
  rolls = roll.upper - roll.lower < 2.0 * kPi;
}

Goal pose_at_roll(const Goal& goal, double roll) {
  const auto nearest_to_zero = [](const Window& window) { return std::clamp(0.0, window.lower, window.upper); };
  const Vector3d leant = std::tan(nearest_to_zero(goal.lead)) * goal.travel +
                         std::tan(nearest_to_zero(goal.work)) * goal.across + goal.axis;
  Goal pose = goal;
  pose.kind = TaskKind::pose;
  pose.rotation = goal.rotation * least_rotation(goal.axis, leant) * Eigen::AngleAxisd(roll, goal.axis);
  return pose;
}

Vector3d rotation_between(const Matrix3d& from, const Matrix3d& to) {
  const Matrix3d E = to * from.transpose();
  const Vector3d v(E(2, 1) - E(1, 2), E(0, 2) - E(2, 0), E(1, 0) - E(0, 1));  // 2 sin(angle) times the axis
  const double sine = 0.5 * v.norm(), cosine = 0.5 * (E.trace() - 1.0);
  if (sine > 1e-3 || cosine > 0.0) {
    if (cosine > 0.999) {  // angle / sin(angle) by series: small angles come often
      const double s2 = sine * sine;
      return (0.5 + s2 / 12.0 + 3.0 * s2 * s2 / 80.0) * v;
    }
    return (0.5 * std::atan2(sine, cosine) / sine) * v;
  }
  const Eigen::AngleAxisd near_half_turn(E);
  return near_half_turn.angle() * near_half_turn.axis();
}

Miss miss_of(const Goal& goal, const Tip& tip) {
  Miss miss;
  miss.position = (goal.position - tip.position).norm();
  if (goal.kind == TaskKind::pose) {
    miss.rotation = rotation_between(tip.rotation, goal.rotation).norm();
  } else if (goal.kind == TaskKind::torch) {
    miss.roll = roll_of(goal, tip.rotation);
    if (goal.leans) {
      const Lean lean = lean_of(goal, tip.rotation);
      miss.rotation = std::hypot(way_into(goal.lead, lean.lead, 0.0), way_into(goal.work, lean.work, 0.0));
    } else {
      miss.rotation = swing_between(tip.rotation * goal.axis, goal.rotation * goal.axis).norm();
    }
    if (goal.rolls)
      miss.rotation = std::max(miss.rotation, std::abs(way_into(goal.roll, roll_near(goal.roll, miss.roll), 0.0)));
  }
  return miss;
}

double Limits::excess(int driven, const double* readings, int* joint) const {
  double worst = 0.0;
  *joint = -1;
  const auto look = [&worst, joint](double beyond, int k) {
    if (beyond <= worst) return;
    worst = beyond;
    *joint = k;
  };
  for (int j = 0; j < driven; ++j) look(std::max(readings[j] - upper[j], lower[j] - readings[j]), j);
  for (std::size_t k = 0; k < passive.size(); ++k) {
    double motion = passive[k].constant;
    for (int j = 0; j < driven; ++j) motion += passive[k].weight[j] * readings[j];
    look(std::max(motion - passive[k].upper, passive[k].lower - motion), driven + static_cast<int>(k));
  }
  return worst;
}

// Levenberg-Marquardt whose damping follows the squared error (Sugihara 2011): far away it is careful, near the goal it
// is Newton. A step that does not lower the cost is taken back and the damping raised.
void descend(const Arm& arm, const Limits& limits, const Scales& scales, const Goal& goal,
             const DescentOptions& options, EffectScratch* scratch, Descent* out) {
  const Problem problem{arm, limits, scales, goal, options, scratch};
  const int n = arm.driven();
  double* q = out->readings;
  if (!options.ignore_limits) {
    for (int j = 0; j < n; ++j) q[j] = std::clamp(q[j], limits.lower[j], limits.upper[j]);
  }
  Rows buffer[2];
  Rows* rows = &buffer[0];
  Rows* trial = &buffer[1];
  evaluate(problem, q, rows);
  out->converged = rows->small;
  constexpr double kFloor = 1e-14;  // of the damping
  const double far = far_cost(arm);
  double factor = 0.05;
  int slow = 0;
  while (!out->converged && out->iterations < options.max_iterations) {
    ++out->iterations;
    double step[kMaxDrivenJoints], next[kMaxDrivenJoints];
    if (!solve_step(problem, *rows, q, factor * std::min(rows->cost, far) + kFloor, step)) {
      factor = std::max(10.0 * factor, 1e-3);
      continue;
    }
    for (int j = 0; j < n; ++j) {
      next[j] = q[j] + step[j];
      if (!options.ignore_limits) next[j] = std::clamp(next[j], limits.lower[j], limits.upper[j]);  // rounding alone
    }
    evaluate(problem, next, trial);
    if (!(trial->cost < rows->cost)) {
      factor *= 8.0;
      if (++slow >= options.patience) break;
      continue;
    }
    slow = trial->cost > 0.9 * rows->cost ? slow + 1 : 0;
    factor = std::max(0.4 * factor, 1e-4);
    std::copy(next, next + n, q);
    std::swap(rows, trial);
    out->converged = rows->small;
    if (slow >= options.patience) break;
  }
  out->cost = rows->cost;
}

}  // namespace truing::inverse_kinematics
