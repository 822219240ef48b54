// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/consensus.hpp"
#include "math/constants.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "math/frame.hpp"
#include "math/random.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"

namespace truing::hand_eye {
namespace {

constexpr double kAgreeing = 0.6;  // of the rows must close for a triple to count
constexpr double kBeyond =
    2.5;  // times their distance: rows that do not agree. Six normal errors get there once in a million
constexpr std::size_t kFewest = 6;    // poses of which some may be left out: fewer agree by chance
constexpr std::size_t kJudges = 200;  // rows that judge a triple
constexpr double kTurn = 0.1;         // [rad] poses of a triple differ by more, where there are such

/// Rows, each in every reading of its board, against one X and Y.
class Judge {
 public:
  Judge(const Frames& M, const Frames& B, const std::vector<Eigen::Isometry3d>& symmetries, double length)
      : M_(M), B_(B), symmetries_(symmetries), length_(length) {}

  Eigen::Isometry3d board(std::size_t i, int symmetry) const {
    return symmetry == 0 ? B_[i] : B_[i] * symmetries_[static_cast<std::size_t>(symmetry - 1)];
  }

  /// The nearer of the board's readings; distance in rad, metres by the problem's length.
  double distance(const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y, std::size_t i, int* symmetry) const {
    const Eigen::Isometry3d predicted = predicted_board(X, M_[i], Y);
    double best = std::numeric_limits<double>::infinity();
    for (int s = 0; s <= static_cast<int>(symmetries_.size()); ++s) {
      const Vector6d e = closure(predicted, board(i, s));
      const double d = std::hypot(e.head<3>().norm() / length_, e.tail<3>().norm());
      if (d < best) best = d, *symmetry = s;
    }
    return best;
  }

 private:
  const Frames& M_;
  const Frames& B_;
  const std::vector<Eigen::Isometry3d>& symmetries_;
  double length_;
};

double angle_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return vector_from_rotation(a.linear() * b.linear().transpose()).norm();
}

/// Closures of the agreeing rows with the readings chosen.
void describe(const Frames& M, const Judge& judge, Agreement* a) {
  std::vector<double> position, rotation;
  for (const std::size_t i : a->rows) {
    const Vector6d e = closure(predicted_board(a->X, M[i], a->Y), judge.board(i, a->symmetry[i]));
    position.push_back(e.head<3>().norm()), rotation.push_back(e.tail<3>().norm());
  }
  a->position = median_of(position), a->rotation = median_of(rotation);
}

}  // namespace

Eigen::Isometry3d CameraSolver::operator()(const Frames& M, const Frames& B, const Rows& rows) const {
  return axis ? solve_camera_one_axis(M, B, rows, *axis, height) : solve_camera(M, B, rows).X;
}

Rows canonical_order(const Frames& frames, const Rows& rows) {
  std::vector<std::pair<std::array<double, 6>, std::size_t>> keys;
  for (const std::size_t i : rows) {
    const Eigen::Matrix3d& R = frames[i].linear();
    const Eigen::Vector3d t = frames[i].translation();
    keys.push_back({{R(0, 0), R(1, 1), R(0, 1), t.x(), t.y(), t.z()}, i});
  }
  std::sort(keys.begin(), keys.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Rows order;
  for (const auto& key : keys) order.push_back(key.second);
  return order;
}

Agreement find_agreement(const Frames& M, const Frames& B, const Rows& rows,
                         const std::vector<Eigen::Isometry3d>& symmetries, const CameraSolver& solve,
                         const ConsensusOptions& options) {
  const Judge judge(M, B, symmetries, make_screws(M, B, rows).length);
  Agreement out;
  out.rows = rows;
  out.symmetry.assign(B.size(), 0);
  Frames read = B;  // in the readings chosen
  const auto judge_all = [&](std::vector<double>* distances) {
    distances->clear();
    for (const std::size_t i : rows) distances->push_back(judge.distance(out.X, out.Y, i, &out.symmetry[i]));
    std::vector<double> sorted = *distances;
    out.scale = quantile(&sorted, kAgreeing);
  };
  const auto refit = [&] {
    for (const std::size_t i : rows) read[i] = judge.board(i, out.symmetry[i]);
    out.X = solve(M, read, out.rows), out.Y = mean_board(M, read, out.rows, out.X);
  };

  refit();
  std::vector<double> distances;
  judge_all(&distances);
  if (!options.search || rows.size() < 4 || (symmetries.empty() && rows.size() < kFewest)) {
    std::fill(out.symmetry.begin(), out.symmetry.end(), 0);
    describe(M, judge, &out);
    return out;
  }

  const Rows order = canonical_order(B, rows);
  Rows judges;
  const std::size_t stride = std::max<std::size_t>(1, order.size() / kJudges);
  for (std::size_t i = 0; i < order.size(); i += stride) judges.push_back(order[i]);
  Random random(1);
  const int readings = static_cast<int>(symmetries.size()) + 1;
  Eigen::Isometry3d best_X = out.X, best_Y = out.Y;
  double best = out.scale;
  for (int trial = 0; trial < options.triples; ++trial) {
    Rows triple;
    for (int attempt = 0; attempt < 20 && triple.size() < 3; ++attempt) {
      const std::size_t i = order[random.below(order.size())];
      if (std::all_of(triple.begin(), triple.end(),
                      [&](std::size_t j) { return j != i && angle_between(M[i], M[j]) > kTurn; }))
        triple.push_back(i);
    }
    if (triple.size() < 3) continue;
    for (int s1 = 0; s1 < readings; ++s1)
      for (int s2 = 0; s2 < readings; ++s2) {
        read[triple[0]] = judge.board(triple[0], 0), read[triple[1]] = judge.board(triple[1], s1),
        read[triple[2]] = judge.board(triple[2], s2);
        const Eigen::Isometry3d X = solve(M, read, triple), Y = mean_board(M, read, triple, X);
        distances.clear();
        int ignored = 0;
        for (const std::size_t i : judges) distances.push_back(judge.distance(X, Y, i, &ignored));
        const double scale = quantile(&distances, kAgreeing);
        if (scale < best) best = scale, best_X = X, best_Y = Y;
      }
  }
  out.X = best_X, out.Y = best_Y;
  for (int round = 0; round < 6; ++round) {
    judge_all(&distances);
    Rows agreeing;
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (distances[k] <= kBeyond * out.scale || rows.size() < kFewest) agreeing.push_back(rows[k]);
    const bool same = round > 0 && agreeing == out.rows;
    out.rows = agreeing;
    if (same) break;
    refit();
  }
  describe(M, judge, &out);
  return out;
}

int nearest_symmetry(const Frames& M, const Frames& B, const std::vector<Eigen::Isometry3d>& symmetries,
                     const Agreement& agreement, double length, std::size_t i) {
  int symmetry = 0;
  Judge(M, B, symmetries, length).distance(agreement.X, agreement.Y, i, &symmetry);
  return symmetry;
}

std::string likely_cause(const Frames& A, const Frames& B, HandEyeSetup setup, std::size_t i, const Rows& agreeing,
                         const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y, double position_noise,
                         double rotation_noise) {
  const double near = 6.0 * position_noise + 1e-6, aligned = 6.0 * rotation_noise + 1e-6;
  const auto same = [&](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return (a.translation() - b.translation()).norm() < near && angle_between(a, b) < aligned;
  };
  // Where the hand would have to be, and the board, for the loop to close.
  const Eigen::Isometry3d M = X * B[i] * Y.inverse(Eigen::Isometry);
  const Eigen::Isometry3d hand = setup == HandEyeSetup::eye_to_hand ? M : M.inverse(Eigen::Isometry);
  const Eigen::Isometry3d board = predicted_board(X, moving_frames({A[i]}, setup)[0], Y);

  const Eigen::Isometry3d turn =
      B[i].inverse(Eigen::Isometry) * board;  // from the board as seen to the board as expected
  const Eigen::Vector3d v = vector_from_rotation(turn.linear());
  if (v.norm() > kPi - std::max(aligned, 0.1) && std::abs(v.z()) > 0.98 * v.norm())
    return "the board was seen turned by 180 deg about its normal";
  if (std::abs(v.norm() - kPi / 2) < std::max(aligned, 0.1) && std::abs(v.z()) > 0.98 * v.norm())
    return "the board was seen turned by 90 deg about its normal";
  for (const std::size_t j : agreeing)
    if (same(hand, A[j]) && !same(A[i], A[j])) return "its board belongs to the hand of pose " + std::to_string(j);
  for (const std::size_t j : agreeing)
    if (j != i && same(A[i], A[j]))
      return "its hand is that of pose " + std::to_string(j) + ": had the robot moved on?";

  const Eigen::Vector3d off = A[i].translation() - hand.translation();
  const double turned = angle_between(A[i], hand);
  if (turned < aligned && off.norm() > near) {
    Eigen::Index axis = 0;
    const double most = off.cwiseAbs().maxCoeff(&axis);
    const double rest = std::sqrt(std::max(0.0, off.squaredNorm() - most * most));
    const std::string name(1, "xyz"[axis]);
    if (rest < std::max(near, 0.02 * most)) {
      const double value = A[i].translation()(axis), wanted = hand.translation()(axis);
      if (std::abs(value + wanted) < near) return "hand " + name + " has the wrong sign";
      return "hand " + name + " is off by " + millimetres(off(axis)) + ", it alone: a typing error?";
    }
    return "hand position is off by " + millimetres(off.norm()) + ", its orientation is right";
  }
  const Eigen::Vector3d seen_off = B[i].translation() - board.translation();
  if (seen_off.norm() < near && turned > aligned && std::abs(v.z()) < 0.3 * v.norm())
    return "the board was seen tilted the wrong way by " + degrees(v.norm()) +
           ": the other solution of a plane seen almost from the front";
  if (off.norm() < near && turned > aligned)
    return "hand orientation is off by " + degrees(turned) + ", its position is right";
  return "off by " + millimetres(seen_off.norm()) + " and " + degrees(v.norm());
}

}  // namespace truing::hand_eye
