// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/closed_form.hpp"
#include "math/constants.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "math/linear_algebra.hpp"
#include "math/trigonometry.hpp"

// Product of exponentials (Brockett 1984): T(q) = e1(q1) ... e6(q6) T(0), e_k a turn about axis k where it stands at
// zero. Solved by the subproblems of Paden and Kahan (Murray, Li, Sastry 1994, ch. 3.3; further ones: Elias and Wen
// 2022), all of which come down to one equation A cos + B sin = C. Angles stay pairs (cosine, sine) until the end.

namespace truing::inverse_kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kParallelDoubts = 1.0;  // so many times the doubt a length may be off where two singularities meet
constexpr int kShoulderPlaces = ClosedForm::kShoulderPlaces, kPlaces = ClosedForm::kWristPlaces;

/// One place further round.
Vector2d turned_on(const Vector2d& q, int places) {
  const double angle = 2.0 * kPi / places, c = std::cos(angle), s = std::sin(angle);
  return {c * q[0] - s * q[1], s * q[0] + c * q[1]};
}

/// R(h, angle) v, Rodrigues.
inline Vector3d turned(const Vector3d& h, const Vector2d& q, const Vector3d& v) {
  return q[0] * v + q[1] * h.cross(v) + ((1.0 - q[0]) * h.dot(v)) * h;
}
inline Vector3d turned_back(const Vector3d& h, const Vector2d& q, const Vector3d& v) {
  return turned(h, {q[0], -q[1]}, v);
}

/// The part of v across h.
inline Vector3d across(const Vector3d& h, const Vector3d& v) { return v - h.dot(v) * h; }

/// Both angles of an equation, none, or many.
struct Angles {
  Vector2d q[kShoulderPlaces];
  int count = 0;
  bool anywhere = false;  ///< all around, where the doubt is larger than what the equation says
  bool doubtful = false;  ///< the two may be one, or none
};

/// A cos + B sin = C. Its two angles lie to both sides of that of (A, B), sine squared D / (A^2 + B^2) away. `doubt`:
/// how far that may be off for the robot as it is. A D within the doubt may be of either sign there, and gives two
/// seeds apart; one that is negative by rounding is zero.
Angles solve_trigonometric(double A, double B, double C, double doubt) {
  constexpr double kRounding = 1e-11;
  Angles out;
  const double r2 = A * A + B * B;
  const double D = r2 - C * C;
  if (D < -std::max(4.0 * doubt, kRounding) * r2 || !(r2 > 0.0)) return out;
  out.count = 2;
  out.doubtful = doubt > 0.0 && D < doubt * r2;
  const bool doubtful = D < doubt * r2;
  const double root = std::sqrt(doubtful ? std::max(std::abs(D), doubt * r2) : std::max(D, 0.0));
  const double scale = 1.0 / (doubtful ? std::sqrt(r2 * (C * C + root * root)) : r2);
  out.q[0] = Vector2d(A * C - B * root, B * C + A * root) * scale;
  out.q[1] = Vector2d(A * C + B * root, B * C - A * root) * scale;
  return out;
}

/// Subproblem 1: R(h, q) v = w, as nearly as it can. False: v or w lies along h, and any angle would do.
bool solve_turn(const Vector3d& h, const Vector3d& v, const Vector3d& w, Vector2d* q) {
  const double c = w.dot(v) - h.dot(v) * h.dot(w), s = w.dot(h.cross(v));
  const double length2 = c * c + s * s;
  if (!(length2 > 1e-20 * v.squaredNorm() * w.squaredNorm())) {
    *q = {1.0, 0.0};
    return false;
  }
  *q = Vector2d(c, s) / std::sqrt(length2);
  return true;
}

/// Subproblem 4: g . R(h, q) v = d. `doubt`: of the directions and of lengths relative to the vectors' own.
Angles solve_projection(const Vector3d& g, const Vector3d& h, const Vector3d& v, double d, double doubt) {
  const double hv = h.dot(v);
  const double A = g.dot(v) - g.dot(h) * hv, B = g.dot(h.cross(v)), C = d - g.dot(h) * hv;
  if (doubt > 0.0) doubt *= std::sqrt(g.squaredNorm() * v.squaredNorm() / std::max(A * A + B * B, 1e-300));
  return solve_trigonometric(A, B, C, std::min(doubt, 0.5));
}

/// The same for the first axis, which may pass so close to the wrist that it can stand anywhere.
Angles solve_shoulder(const Vector3d& g, const Vector3d& h, const Vector3d& v, double d, double doubt) {
  const double r = across(h, g).norm() * across(h, v).norm();
  constexpr double kAnywhere = 0.2;
  if (doubt * g.norm() * v.norm() < kAnywhere * r) return solve_projection(g, h, v, d, doubt);
  if (doubt == 0.0 && std::abs(d - g.dot(h) * h.dot(v)) > 1e-11 * g.norm()) return {};
  Angles out;
  out.anywhere = doubt > 0.0;
  out.count = out.anywhere ? kShoulderPlaces : 1;
  solve_turn(h, v, g, &out.q[0]);
  for (int k = 1; k < out.count; ++k) out.q[k] = turned_on(out.q[k - 1], kShoulderPlaces);
  return out;
}

/// Subproblem 3: |R(h, q) v - w| = the length whose square is d2.
Angles solve_distance(const Vector3d& h, const Vector3d& v, const Vector3d& w, double d2, double doubt) {
  return solve_projection(w, h, v, 0.5 * (v.squaredNorm() + w.squaredNorm() - d2), doubt);
}

/// The same for what lies in planes across h: of all three only the parts across count.
Angles solve_planar_distance(const Vector3d& h, const Vector3d& v, const Vector3d& w, const Vector3d& d, double doubt) {
  return solve_distance(h, across(h, v), across(h, w), across(h, d).squaredNorm(), doubt);
}

/// Configurations as cosines and sines, all of them turned into angles at once.
struct Pairs {
  double cosine[ClosedForm::kMost][6], sine[ClosedForm::kMost][6];

  void set(int configuration, int k, const Vector2d& q) {
    cosine[configuration][k] = q[0];
    sine[configuration][k] = q[1];
  }
  void to_angles(int count, Configuration* found) const {
    double angle[ClosedForm::kMost * 6];
    arc_tangents(&sine[0][0], &cosine[0][0], 6 * count, angle);
    for (int i = 0; i < count; ++i) std::copy(angle + 6 * i, angle + 6 * i + 6, found[i].angle);
  }
};

Vector3d some_normal(const Vector3d& h) { return h.unitOrthogonal(); }

/// The point nearest to lines, least squares.
Vector3d meeting_point(const Vector3d* h, const Vector3d* o, std::initializer_list<int> lines) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const int k : lines) {
    const Matrix3d P = Matrix3d::Identity() - h[k] * h[k].transpose();
    A += P;
    b += P * o[k];
  }
  return solve_symmetric<3, 1>(A, b);
}

double distance_to_line(const Vector3d& point, const Vector3d& h, const Vector3d& o) {
  return across(h, point - o).norm();
}

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))); }

}  // namespace

ClosedForm::ClosedForm(const Arm& arm, const InverseOptions& options) {
  Tip home;
  std::vector<HomeAxis> axes = arm.home_axes(&home);
  home_rotation_ = home.rotation;
  home_position_ = home.position;
  find_rails(axes);
  if (rails_ < 0) return;
  axes.erase(axes.begin(), axes.begin() + rails_);

  // A passive joint on the axis of its neighbour (a parallelogram's) turns the same axis.
  for (std::size_t k = 0; k + 1 < axes.size();) {
    HomeAxis& a = axes[k];
    const HomeAxis& b = axes[k + 1];
    const bool same = !a.prismatic && !b.prismatic &&
                      angle_between(a.direction, b.direction) < options.parallel_tolerance &&
                      distance_to_line(b.point, a.direction, a.point) < options.wrist_tolerance;
    if (!same) {
      ++k;
      continue;
    }
    const double sign = a.direction.dot(b.direction) < 0.0 ? -1.0 : 1.0;
    for (const auto& [joint, weight] : b.joints) a.joints.push_back({joint, sign * weight});
    deviation_ = std::max(
        {deviation_, angle_between(a.direction, b.direction), distance_to_line(b.point, a.direction, a.point)});
    axes.erase(axes.begin() + static_cast<std::ptrdiff_t>(k) + 1);
  }
  if (axes.size() != 6 || arm.driven() != rails_ + 6) return;
  for (int k = 0; k < 6; ++k) {
    const HomeAxis& axis = axes[static_cast<std::size_t>(k)];
    if (axis.prismatic) return;
    h_[k] = axis.direction;
    o_[k] = axis.point;
    std::fill(weight_[k], weight_[k] + 6, 0.0);
    for (const auto& [joint, weight] : axis.joints) {
      if (joint < rails_) return;
      weight_[k][joint - rails_] += weight;
    }
    for (int j = k + 1; j < 6; ++j) {
      if (weight_[k][j] != 0.0) return;
    }
    if (weight_[k][k] == 0.0) return;
  }
  if (find_wrist(options)) {
    kind_ = ClosedFormKind::spherical_wrist;
  } else if (find_three_parallel(options)) {
    kind_ = ClosedFormKind::three_parallel;
  }
  constexpr double kEffects = 1e-3;  // what they may turn an axis by
  if (deviation_ > 1e-11 || arm.has_effects()) doubt_ = 4.0 * std::max(deviation_, arm.has_effects() ? kEffects : 0.0);
  for (int k = 0; k < 3; ++k) reach_[0] += (o_[k + 1] - o_[k]).norm();
  reach_[0] += (o_[4] - o_[3]).norm();
  reach_[1] = reach_[0] + (home_position_ - o_[4]).norm();
  for (int k = 0; k < 6; ++k) {
    per_angle_[k] = 1.0 / weight_[k][k];
    turn_[k] = 2.0 * kPi * std::abs(per_angle_[k]);
    per_turn_[k] = 1.0 / turn_[k];
  }
}

void ClosedForm::find_rails(const std::vector<HomeAxis>& axes) {
  while (rails_ < static_cast<int>(axes.size()) && axes[static_cast<std::size_t>(rails_)].prismatic) {
    const HomeAxis& rail = axes[static_cast<std::size_t>(rails_)];
    if (rails_ == 3 || rail.joints.size() != 1 || rail.joints[0].first != rails_) {
      rails_ = -1;
      return;
    }
    rail_[rails_] = rail.direction;
    rail_weight_[rails_] = rail.joints[0].second;
    ++rails_;
  }
}

bool ClosedForm::find_wrist(const InverseOptions& options) {
  if (angle_between(h_[3], h_[4]) < 0.1 || angle_between(h_[4], h_[5]) < 0.1) return false;
  const Vector3d wrist = meeting_point(h_, o_, {3, 4, 5});
  double miss = 0.0;
  for (int k = 3; k < 6; ++k) miss = std::max(miss, distance_to_line(wrist, h_[k], o_[k]));
  if (miss > options.wrist_tolerance) return false;
  Vector3d before[6];
  std::copy(o_, o_ + 6, before);
  o_[3] = o_[4] = o_[5] = wrist;
  if (!find_shoulder(options)) {
    std::copy(before, before + 6, o_);
    return false;
  }
  deviation_ = std::max(deviation_, miss);
  return true;
}

bool ClosedForm::find_shoulder(const InverseOptions& options) {
  // Two axes made parallel point the same way, along their middle.
  const auto make_parallel = [this, &options](int a, int b) {
    const double angle = angle_between(h_[a], h_[b]);
    if (angle > options.parallel_tolerance) return false;
    if (h_[a].dot(h_[b]) < 0.0) {
      h_[b] = -h_[b];
      for (double& weight : weight_[b]) weight = -weight;
    }
    h_[a] = h_[b] = (h_[a] + h_[b]).normalized();
    deviation_ = std::max(deviation_, angle);
    return true;
  };
  const auto make_meet = [this, &options](int a, int b) {
    if (angle_between(h_[a], h_[b]) < 0.1) return false;
    const Vector3d point = meeting_point(h_, o_, {a, b});
    const double miss = distance_to_line(point, h_[a], o_[a]);
    if (miss > options.wrist_tolerance) return false;
    o_[a] = o_[b] = point;
    deviation_ = std::max(deviation_, miss);
    return true;
  };
  if (make_parallel(1, 2)) {
    shoulder_ = Shoulder::parallel_23;
  } else if (make_meet(0, 1)) {
    shoulder_ = Shoulder::meet_12;
  } else if (make_meet(1, 2)) {
    shoulder_ = Shoulder::meet_23;
  } else if (make_parallel(0, 1)) {
    shoulder_ = Shoulder::parallel_12;
  } else {
    return false;
  }
  return true;
}

bool ClosedForm::find_three_parallel(const InverseOptions& options) {
  const double angle =
      std::max({angle_between(h_[1], h_[2]), angle_between(h_[1], h_[3]), angle_between(h_[2], h_[3])});
  if (angle > options.parallel_tolerance || angle_between(h_[4], h_[5]) < 0.1) return false;
  const Vector3d point = meeting_point(h_, o_, {4, 5});
  const double miss = std::max(distance_to_line(point, h_[4], o_[4]), distance_to_line(point, h_[5], o_[5]));
  if (miss > options.wrist_tolerance) return false;
  for (const int k : {2, 3}) {
    if (h_[1].dot(h_[k]) > 0.0) continue;
    h_[k] = -h_[k];
    for (double& weight : weight_[k]) weight = -weight;
  }
  h_[1] = h_[2] = h_[3] = (h_[1] + h_[2] + h_[3]).normalized();
  o_[4] = o_[5] = point;
  deviation_ = std::max({deviation_, angle, miss});
  return true;
}

/// Are both angles of axis 5 so close together that an inexact arm may have them elsewhere?
bool ClosedForm::nearly_singular(const Eigen::Vector2d* q, int count) const {
  return count == 2 && std::abs(q[0][0] * q[1][1] - q[0][1] * q[1][0]) <
                           6.0 * doubt_;  // sine of twice the angle from the singularity
}

/// e1 e2 e3 w = wanted for the wrist's centre w: at most four ways.
int ClosedForm::solve_positions(const Vector3d& wanted, Position* found) const {
  const Vector3d& w = o_[3];
  int count = 0;
  const auto add = [&](const Vector2d& q1, const Vector2d& q2, const Vector2d& q3, int i, int j, int place = -1) {
    found[count++] = {{q1, q2, q3}, (i & 1) | j << 1, place};
  };
  switch (shoulder_) {
    case Shoulder::parallel_23: {
      // Axes 2 and 3 leave the height along h as it is: h . e1^-1 wanted = h . w gives q1; then a planar arm of two
      // links.
      const Vector3d& h = h_[1];
      const Angles first = solve_shoulder(wanted - o_[0], h_[0], h, h.dot(w - o_[0]), doubt_);
      for (int i = 0; i < first.count; ++i) {
        const Vector3d y = o_[0] + turned_back(h_[0], first.q[i], wanted - o_[0]);
        const Angles third = solve_planar_distance(h, w - o_[2], o_[1] - o_[2], y - o_[1], doubt_);
        for (int j = 0; j < third.count; ++j) {
          Vector2d second;
          solve_turn(h, o_[2] + turned(h, third.q[j], w - o_[2]) - o_[1], y - o_[1], &second);
          add(first.q[i], second, third.q[j], i, j, first.anywhere ? i : -1);
        }
      }
      break;
    }
    case Shoulder::meet_12: {
      // Axes 1 and 2 leave the distance from where they meet as it is: that gives q3; then two turns about one point.
      const Vector3d& c = o_[0];
      const Angles third = solve_distance(h_[2], w - o_[2], c - o_[2], (wanted - c).squaredNorm(), doubt_);
      for (int j = 0; j < third.count; ++j) {
        const Vector3d x = o_[2] + turned(h_[2], third.q[j], w - o_[2]) - c;
        const Angles second = solve_projection(h_[0], h_[1], x, h_[0].dot(wanted - c), doubt_);
        for (int i = 0; i < second.count; ++i) {
          Vector2d first;
          solve_turn(h_[0], turned(h_[1], second.q[i], x), wanted - c, &first);
          add(first, second.q[i], third.q[j], i, j);
        }
      }
      break;
    }
    case Shoulder::meet_23: {
      const Vector3d& c = o_[1];
      const Angles first = solve_distance(h_[0], c - o_[0], wanted - o_[0], (w - c).squaredNorm(), doubt_);
      for (int i = 0; i < first.count; ++i) {
        const Vector3d y = o_[0] + turned_back(h_[0], first.q[i], wanted - o_[0]) - c;
        const Angles third = solve_projection(h_[1], h_[2], w - c, h_[1].dot(y), doubt_);
        for (int j = 0; j < third.count; ++j) {
          Vector2d second;
          solve_turn(h_[1], turned(h_[2], third.q[j], w - c), y, &second);
          add(first.q[i], second, third.q[j], i, j);
        }
      }
      break;
    }
    case Shoulder::parallel_12: {
      const Vector3d& h = h_[0];
      const Angles third = solve_projection(h, h_[2], w - o_[2], h.dot(wanted - o_[2]), doubt_);
      for (int j = 0; j < third.count; ++j) {
        const Vector3d x = o_[2] + turned(h_[2], third.q[j], w - o_[2]);
        const Angles second = solve_planar_distance(h, x - o_[1], o_[0] - o_[1], wanted - o_[0], doubt_);
        for (int i = 0; i < second.count; ++i) {
          Vector2d first;
          solve_turn(h, o_[1] + turned(h, second.q[i], x - o_[1]) - o_[0], wanted - o_[0], &first);
          add(first, second.q[i], third.q[j], i, j);
        }
      }
      break;
    }
  }
  return count;
}

int ClosedForm::solve_spherical(const Matrix3d& R, const Vector3d& p, double hold, Configuration* found) const {
  const Matrix3d G = R * home_rotation_.transpose();  // e1 ... e6 turn as much
  const Vector3d u = some_normal(h_[5]);
  const Vector3d G_h6 = G * h_[5], G_u = G * u;
  Position positions[2 * kShoulderPlaces];
  Pairs pairs;
  const int position_count = solve_positions(p + G * (o_[3] - home_position_), positions);
  int count = 0;
  for (int k = 0; k < position_count; ++k) {
    const Vector2d* q = positions[k].q;
    const auto back = [&](const Vector3d& v) {
      return turned_back(h_[2], q[2], turned_back(h_[1], q[1], turned_back(h_[0], q[0], v)));
    };
    const Vector3d R_h6 = back(G_h6), R_u = back(G_u);  // R = R4 R5 R6
    const Angles fifth = solve_projection(h_[3], h_[4], h_[5], h_[3].dot(R_h6), doubt_ * doubt_);
    for (int i = 0; i < fifth.count; ++i) {
      Vector2d fourth;
      // Where axes 4 and 6 line up, q4 stays where it is; q6 always makes up for what q4 leaves.
      if (!solve_turn(h_[3], turned(h_[4], fifth.q[i], h_[5]), R_h6, &fourth))
        fourth = {std::cos(hold), std::sin(hold)};
      // Where they nearly do, the robot as it is may have q4 anywhere: seeds all around.
      const bool shoulder = positions[k].place >= 0;
      const int places = !shoulder && i == 0 && nearly_singular(fifth.q, fifth.count) ? kPlaces : 1;
      for (int place = 0; place < places; ++place) {
        Vector2d sixth;
        solve_turn(h_[5], u, turned_back(h_[4], fifth.q[i], turned_back(h_[3], fourth, R_u)), &sixth);
        for (int a = 0; a < 3; ++a) pairs.set(count, a, q[a]);
        pairs.set(count, 3, fourth);
        pairs.set(count, 4, fifth.q[i]);
        pairs.set(count, 5, sixth);
        found[count].branch = positions[k].branch | i << 2;
        found[count].circle = shoulder ? (positions[k].branch >> 1) | i << 1 : places > 1 ? 4 + k : -1;
        found[count].places = shoulder ? kShoulderPlaces : places;
        found[count].about = shoulder ? 0 : 3;
        found[count++].place = shoulder ? positions[k].place : place;
        if (places > 1) fourth = turned_on(fourth, kPlaces);
      }
    }
  }
  pairs.to_angles(count, found);
  return count;
}

int ClosedForm::solve_parallel(const Matrix3d& R, const Vector3d& p, double hold, Configuration* found) const {
  const Matrix3d G = R * home_rotation_.transpose();
  const Vector3d& h = h_[1];
  const Vector3d& c = o_[4];  // where axes 5 and 6 meet: neither moves it
  const Vector3d u = some_normal(h);
  const Vector3d G_h6 = G * h_[5];
  const Vector3d wanted = p + G * (c - home_position_);
  const Angles first = solve_projection(wanted - o_[0], h_[0], h, h.dot(c - o_[0]), doubt_);
  Pairs pairs;
  int count = 0;
  // Both elbows for these angles of axes 1, 5 and 6; or, with `places`, for axis 6 all around.
  const auto add = [&](const Vector2d& q1, const Vector2d& q5, Vector2d q6, int places, int branch, int circle) {
    for (int place = 0; place < places; ++place) {
      // e2 e3 e4 = e1^-1 T T(0)^-1 e6^-1 e5^-1: a turn about h, and where it takes axis 4.
      const auto before = [&](const Vector3d& v) { return turned_back(h_[5], q6, turned_back(h_[4], q5, v)); };
      Vector2d q234;
      solve_turn(h, u, turned_back(h_[0], q1, G * before(u)), &q234);
      const Vector3d y = o_[0] + turned_back(h_[0], q1, wanted + G * before(o_[3] - c) - o_[0]);
      const Angles third = solve_planar_distance(h, o_[3] - o_[2], o_[1] - o_[2], y - o_[1], doubt_);
      for (int j = 0; j < third.count; ++j) {
        Vector2d q2;
        solve_turn(h, o_[2] + turned(h, third.q[j], o_[3] - o_[2]) - o_[1], y - o_[1], &q2);
        pairs.set(count, 0, q1);
        pairs.set(count, 1, q2);
        pairs.set(count, 2, third.q[j]);
        pairs.set(count, 3, q234);
        pairs.set(count, 4, q5);
        pairs.set(count, 5, q6);
        found[count].branch = branch | j << 1;
        found[count].circle = places > 1 ? circle + j : -1;
        found[count].places = places;
        found[count].about = 5;
        found[count++].place = place;
      }
      if (places > 1) q6 = turned_on(q6, kPlaces);
    }
  };
  bool circles = false;
  for (int i = 0; i < first.count; ++i) {
    const Vector2d& q1 = first.q[i];
    const Vector3d R1_h = turned(h_[0], q1, h);
    const Vector3d back_h = G.transpose() * R1_h;
    const Angles fifth = solve_projection(h, h_[4], h_[5], R1_h.dot(G_h6), doubt_ * doubt_);
    for (int k = 0; k < fifth.count; ++k) {
      Vector2d q6;
      if (!solve_turn(h_[5], back_h, turned_back(h_[4], fifth.q[k], h), &q6)) q6 = {std::cos(hold), std::sin(hold)};
      const int places = k == 0 && nearly_singular(fifth.q, fifth.count) ? kPlaces : 1;
      circles = circles || places > 1;
      add(q1, fifth.q[k], q6, places, i | k << 2, 2 * i);
    }
  }
  // Where axis 1 is in doubt, it may stand so that axis 6 is parallel to the other three, which neither of its two
  // angles shows.
  for (int way = 0; way < 2 && first.doubtful && !circles; ++way) {
    const Vector3d parallel = way == 0 ? G_h6 : Vector3d(-G_h6);
    Vector2d q1, q5, q6;
    if (!solve_turn(h_[0], h, parallel, &q1) || !solve_turn(h_[4], h_[5], way == 0 ? h : Vector3d(-h), &q5)) continue;
    const double off = h.dot(turned_back(h_[0], q1, wanted - o_[0])) - h.dot(c - o_[0]);
    if (std::abs(off) > kParallelDoubts * doubt_ * (wanted - o_[0]).norm()) continue;
    q6 = {std::cos(hold), std::sin(hold)};
    add(q1, q5, q6, kPlaces, way << 2, 4 + 2 * way);
  }
  pairs.to_angles(count, found);
  for (int k = 0; k < count; ++k) found[k].angle[3] -= found[k].angle[1] + found[k].angle[2];
  return count;
}

int ClosedForm::solve(const Tip& wanted, const double* readings, double hold, Configuration* found) const {
  Vector3d p = wanted.position;
  for (int k = 0; k < rails_; ++k) p -= rail_weight_[k] * readings[k] * rail_[k];
  return kind_ == ClosedFormKind::spherical_wrist ? solve_spherical(wanted.rotation, p, hold, found)
                                                  : solve_parallel(wanted.rotation, p, hold, found);
}

void ClosedForm::rail_range(int k, const Tip& wanted, bool turned, double* lower, double* upper) const {
  // |c - o1 - (sum of weight_i reading_i rail_i)| <= reach: along what is left of rail k across the others.
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> others(3, rails_ - 1);
  for (int i = 0, at = 0; i < rails_; ++i) {
    if (i != k) others.col(at++) = rail_[i];
  }
  Vector3d own = rail_[k];
  for (Eigen::Index i = 0; i < others.cols(); ++i) {  // Gram-Schmidt
    for (Eigen::Index m = 0; m < i; ++m) others.col(i) -= others.col(m).dot(others.col(i)) * others.col(m);
    others.col(i).normalize();
    own -= others.col(i).dot(own) * others.col(i);
  }
  const double length = own.norm();
  const Vector3d c =
      turned ? Vector3d(wanted.position + wanted.rotation * home_rotation_.transpose() * (o_[4] - home_position_))
             : wanted.position;
  const double middle = own.dot(c - o_[0]) / (length * length), half = (turned ? reach_[0] : reach_[1]) / length;
  *lower = (middle - half) / rail_weight_[k];
  *upper = (middle + half) / rail_weight_[k];
  if (*lower > *upper) std::swap(*lower, *upper);
}

double ClosedForm::angle(int k, const double* readings) const {
  double sum = 0.0;
  for (int j = 0; j <= k; ++j) sum += weight_[k][j] * readings[rails_ + j];
  return sum;
}

bool ClosedForm::readings_near(const Configuration& found, const double* seed, const double* lower, const double* upper,
                               double* readings, double* excess) const {
  *excess = 0.0;
  std::copy(seed, seed + rails_, readings);
  double* arm = readings + rails_;
  for (int k = 0; k < 6; ++k) {
    double angle = found.angle[k];
    for (int j = 0; j < k; ++j) angle -= weight_[k][j] * arm[j];
    const int at = rails_ + k;
    const double turn = turn_[k];
    double reading = angle * per_angle_[k];
    reading += turn * nearest_integer((seed[at] - reading) * per_turn_[k]);
    if (reading > upper[at]) reading -= turn * std::ceil((reading - upper[at]) / turn);
    if (reading < lower[at]) {
      reading += turn * std::ceil((lower[at] - reading) / turn);
      // No turn lies within: the one that is less beyond.
      if (reading - upper[at] > lower[at] - (reading - turn)) reading -= turn;
      *excess = std::max({*excess, reading - upper[at], lower[at] - reading});
    }
    arm[k] = reading;
  }
  return *excess <= 0.0;
}

}  // namespace truing::inverse_kinematics
