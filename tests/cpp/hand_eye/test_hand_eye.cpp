// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/consensus.hpp"
#include "hand_eye/images.hpp"
#include "hand_eye/readings.hpp"
#include "hand_eye/refine.hpp"
#include "math/frame.hpp"
#include "math/random.hpp"
#include "math/rotation.hpp"
#include "support/contains.hpp"
#include "support/sanitized.hpp"
#include "truing/handeye.hpp"

using namespace truing;
using namespace truing::hand_eye;

namespace {

struct Noise {
  double hand_position = 0.0, hand_rotation = 0.0, camera_position = 0.0, camera_rotation = 0.0;
};
const Noise kUsual{1e-4, 0.05 * kDegree, 5e-4, 0.1 * kDegree};

struct Scene {
  HandEyeSetup setup;
  HandEyePoses poses;
  Eigen::Isometry3d X, Y;  // truth
};

Eigen::Vector3d normal3(Random* random) { return {random->normal(), random->normal(), random->normal()}; }

Eigen::Isometry3d make(const Eigen::Vector3d& position, const Eigen::Vector3d& turn) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = rotation_from_vector(turn), T.translation() = position;
  return T;
}

Eigen::Isometry3d disturbed(const Eigen::Isometry3d& T, double position, double rotation, Random* random) {
  Vector6d d;
  d << position * normal3(random), rotation * normal3(random);
  return moved(T, d);
}

/// `turn`: largest rotation vector component of the hand about each axis [rad].
Scene make_scene(HandEyeSetup setup, int n, const Noise& noise, std::uint64_t seed,
                 const Eigen::Vector3d& turn = {0.7, 0.7, 0.7}) {
  Random random(seed);
  Scene s;
  s.setup = setup;
  const bool in_hand = setup == HandEyeSetup::eye_in_hand;
  // Cameras look at their boards, boards' z axes away from them.
  s.X = make({0.05, -0.03, 0.08}, {3.0, 0.1, -0.2}), s.Y = make({0.6, 0.1, -0.45}, {3.1, 0.1, 0.2});
  if (!in_hand) {
    const Eigen::Vector3d position(1.6, 0.2, 0.5), z = (Eigen::Vector3d(0.6, 0.0, 0.3) - position).normalized(),
                                                   x = z.cross(Eigen::Vector3d(0.1, 0.0, 1.0)).normalized();
    s.X.translation() = position;
    s.X.linear() << x, z.cross(x), z;
    s.Y = make({0.03, -0.05, 0.15}, {0.0, 0.0, 0.0});
    s.Y.linear() = s.X.linear() * rotation_from_vector({0.2, 0.1, 0.4});
  }
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d r;
    for (int k = 0; k < 3; ++k) r(k) = random.uniform(-turn(k), turn(k));
    const Eigen::Vector3d p(0.6 + random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2),
                            0.3 + random.uniform(-0.2, 0.2));
    const Eigen::Isometry3d hand = make(p, r);
    s.poses.T_camera_board.push_back(disturbed(predicted_board(s.X, moving_frames({hand}, setup)[0], s.Y),
                                               noise.camera_position, noise.camera_rotation, &random));
    s.poses.T_base_hand.push_back(disturbed(hand, noise.hand_position, noise.hand_rotation, &random));
  }
  return s;
}

HandEyeOptions options_for(const Scene& scene) {
  HandEyeOptions o;
  o.setup = scene.setup;
  return o;
}

double position_error(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}
double rotation_error(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return vector_from_rotation(a.linear() * b.linear().transpose()).norm();
}

const HandEyeSetup kSetups[] = {HandEyeSetup::eye_in_hand, HandEyeSetup::eye_to_hand};

/// A 9 x 6 board of 25 mm seen by a camera with distortion; pixel noise and largest tilt [rad] as told.
Scene make_pixel_scene(int n, double hand_position, double hand_rotation, double pixel, std::uint64_t seed,
                       const Camera& camera, double tilt = 0.6) {
  Random random(seed);
  Scene s;
  s.setup = HandEyeSetup::eye_in_hand;
  s.X = make({0.05, -0.03, 0.08}, {0.02, -0.03, 0.7});
  s.Y = make({0.6, 0.1, 0.0}, {3.1, 0.1, 0.0});  // its z into the table, as boards' are
  Eigen::Matrix3Xd points(3, 54);
  for (int i = 0; i < 54; ++i) points.col(i) = Eigen::Vector3d(0.025 * (i % 9) - 0.1, 0.025 * (i / 9) - 0.0625, 0.0);
  s.poses.camera = camera;
  while (static_cast<int>(s.poses.images.size()) < n) {
    Eigen::Isometry3d B = make({random.uniform(-0.08, 0.08), random.uniform(-0.06, 0.06), random.uniform(0.35, 0.55)},
                               {random.uniform(-tilt, tilt), random.uniform(-tilt, tilt), random.uniform(-1.0, 1.0)});
    BoardImage image{points, Eigen::Matrix2Xd(2, 54)};
    bool inside = true;
    for (int i = 0; i < 54; ++i) {
      const Eigen::Vector2d p = project(camera, B * points.col(i));
      inside = inside && p.x() > 0 && p.y() > 0 && p.x() < camera.width && p.y() < camera.height;
      image.pixels.col(i) = p + pixel * Eigen::Vector2d(random.normal(), random.normal());
    }
    if (!inside) continue;
    const Eigen::Isometry3d hand = s.Y * B.inverse() * s.X.inverse();
    s.poses.T_base_hand.push_back(disturbed(hand, hand_position, hand_rotation, &random));
    s.poses.T_camera_board.push_back(disturbed(B, 1e-3, 5e-3, &random));  // a rough start: pixels are what counts
    s.poses.images.push_back(image);
  }
  return s;
}

const Camera kCamera{1280, 960, 1100.0, 1105.0, 645.0, 478.0, {-0.12, 0.05, 0.0008, -0.0005, 0.01}};

}  // namespace

// ---- Dual quaternions and the closed form --------------------------------------------------------------------------

TEST_CASE("dual quaternions multiply, invert and come back as frames do") {
  Random random(11);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d a = make(normal3(&random), normal3(&random)), b = make(normal3(&random), normal3(&random));
    const DualQuaternion qa = dual_quaternion(a), qb = dual_quaternion(b);
    CHECK((frame(qa).matrix() - a.matrix()).norm() < 1e-14);
    CHECK((frame(qa * qb).matrix() - (a * b).matrix()).norm() < 1e-13);
    CHECK((frame(conjugate(qa)).matrix() - a.inverse().matrix()).norm() < 1e-13);
    CHECK(std::abs(qa.real.coeffs().dot(qa.dual.coeffs())) < 1e-14);  // unit: real and dual part are orthogonal
  }
}

TEST_CASE("the factor of a motion vanishes at the true camera, and sums are those of the factors") {
  const Scene s = make_scene(HandEyeSetup::eye_to_hand, 12, {}, 3);
  const Frames M = moving_frames(s.poses.T_base_hand, s.setup);
  Rows rows(12);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const Screws screws = make_screws(M, s.poses.T_camera_board, rows);
  Eigen::Isometry3d X = s.X;  // about the pivots, in the unit of length
  X.translation() = (s.X * screws.center_B - screws.center_M) / screws.length;
  const DualQuaternion q = dual_quaternion(X);
  Vector8d x;
  x << q.real.w(), q.real.vec(), q.dual.w(), q.dual.vec();
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  for (std::size_t i = 0; i < 12; ++i)
    for (std::size_t j = i + 1; j < 12; ++j) {
      const Eigen::Matrix<double, 8, 8> S =
          motion_factor(screws.M[i] * conjugate(screws.M[j]), screws.B[i] * conjugate(screws.B[j]));
      CHECK((S * x).norm() < 1e-13);
      normal += S.transpose() * S;
    }
  CHECK((normal - sum_motions(screws).normal).norm() < 1e-11 * normal.norm());
}

TEST_CASE("the quadratic of the null vectors finds the unit dual quaternion, whatever basis they come in") {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const DualQuaternion q = dual_quaternion(make(normal3(&random), normal3(&random)));
    Vector8d x, tangent;
    x << q.real.w(), q.real.vec(), q.dual.w(), q.dual.vec();
    tangent << 0, 0, 0, 0, q.real.w(), q.real.vec();  // q e: the other null vector of perfect motions
    const double angle = random.uniform(0.0, 6.28);
    const Vector8d v7 = std::cos(angle) * x + std::sin(angle) * tangent,
                   v8 = -std::sin(angle) * x + std::cos(angle) * tangent;
    const Vector8d y = unit_combination(v7, v8);
    CHECK(std::min((y - x).norm(), (y + x).norm()) < 1e-9);
  }
}

TEST_CASE("without noise the camera is exact in both set-ups, for three poses and for hundreds") {
  for (const HandEyeSetup setup : kSetups)
    for (const int n : {3, 10, 200}) {
      CAPTURE(n);
      const Scene s = make_scene(setup, n, {}, 17);
      const ClosedForm c = handeye_closed_form(s.poses, setup);
      CHECK(position_error(c.T_parent_camera, s.X) < 1e-11);
      CHECK(rotation_error(c.T_parent_camera, s.X) < 1e-11);
      CHECK(position_error(c.T_parent_board, s.Y) < 1e-11);
      CHECK(c.singular_values(5) > 1e5 * c.singular_values(6));
      const HandEyeResult r = handeye(s.poses, options_for(s));
      CHECK(r.status == HandEyeStatus::done);
      CHECK(position_error(r.camera.T, s.X) < 1e-9);
      CHECK(r.train.position_max < 1e-9);
    }
}

TEST_CASE("motions of half a turn have a sign of their own") {
  // Identity and half turns about x, y, z: every motion is half a turn.
  for (const double noise : {0.0, 1e-4}) {
    Scene s = make_scene(HandEyeSetup::eye_to_hand, 4, {}, 2);
    Random random(8);
    for (std::size_t i = 0; i < 4; ++i) {
      Eigen::Vector3d turn = Eigen::Vector3d::Zero();
      if (i > 0) turn(static_cast<Eigen::Index>(i - 1)) = 180.0 * kDegree;
      const Eigen::Isometry3d hand = make(s.poses.T_base_hand[i].translation(), turn + noise * normal3(&random));
      s.poses.T_base_hand[i] = hand;
      s.poses.T_camera_board[i] = predicted_board(s.X, hand, s.Y);
    }
    if (noise > 0.0) CHECK(position_error(handeye_closed_form(s.poses, s.setup).T_parent_camera, s.X) < 1e-9);
    const HandEyeResult r = handeye(s.poses, options_for(s));  // exactly half turns have no sign: right or refused
    if (noise > 0.0) REQUIRE(r.status == HandEyeStatus::done);
    if (r.status == HandEyeStatus::done) CHECK(position_error(r.camera.T, s.X) < 1e-6);
  }
}

TEST_CASE("neither the order of the poses, nor the unit of length, nor the base frame moves the result") {
  for (const int n : {20, 150}) {
    const Scene s = make_scene(HandEyeSetup::eye_to_hand, n, kUsual, 23);
    for (const HandEyeMethod method : {HandEyeMethod::closed_form, HandEyeMethod::refined}) {
      HandEyeOptions o = options_for(s);
      o.method = method;
      const Eigen::Isometry3d X = handeye(s.poses, o).camera.T;
      Scene shuffled = s;
      Random random(4);
      for (std::size_t i = shuffled.poses.T_base_hand.size() - 1; i > 0; --i) {
        const std::size_t j = random.below(i + 1);
        std::swap(shuffled.poses.T_base_hand[i], shuffled.poses.T_base_hand[j]),
            std::swap(shuffled.poses.T_camera_board[i], shuffled.poses.T_camera_board[j]);
      }
      const double tight =
          method == HandEyeMethod::closed_form ? 1e-9 : 1e-6;  // the refinement stops at a share of its standard errors
      CHECK(position_error(handeye(shuffled.poses, o).camera.T, X) < tight);
      Scene scaled = s, elsewhere = s;
      const Eigen::Isometry3d F = make({2.0, -1.0, 3.0}, {0.5, 1.0, -0.7});
      for (std::size_t i = 0; i < s.poses.T_base_hand.size(); ++i) {
        scaled.poses.T_base_hand[i].translation() *= 1000.0, scaled.poses.T_camera_board[i].translation() *= 1000.0;
        elsewhere.poses.T_base_hand[i] = F * s.poses.T_base_hand[i];
      }
      Eigen::Isometry3d back = handeye(scaled.poses, o).camera.T;
      back.translation() /= 1000.0;
      CHECK(position_error(back, X) < tight);
      CHECK(position_error(F.inverse() * handeye(elsewhere.poses, o).camera.T, X) < tight);
    }
  }
}

// ---- Maximum likelihood --------------------------------------------------------------------------------------------

TEST_CASE("derivatives of the closure agree with differences") {
  for (const HandEyeSetup setup : kSetups) {
    const Scene s = make_scene(setup, 3, {}, 31);
    LoopProblem problem;
    problem.setup = setup, problem.A = s.poses.T_base_hand, problem.M = moving_frames(problem.A, setup),
    problem.B = s.poses.T_camera_board;
    const LoopRow row = loop_row(problem, 1, s.X, s.Y, {});
    for (int k = 0; k < 12; ++k) {
      Eigen::Matrix<double, 12, 1> d = Eigen::Matrix<double, 12, 1>::Zero();
      d(k) = 1e-6;
      const Vector6d up = loop_row(problem, 1, moved(s.X, d.head<6>()), moved(s.Y, d.tail<6>()), {}).e;
      const Vector6d down = loop_row(problem, 1, moved(s.X, -d.head<6>()), moved(s.Y, -d.tail<6>()), {}).e;
      CHECK(((up - down) / 2e-6 - row.J.col(k)).norm() < 1e-8);
    }
    // The covariance of a turn of the hand: from samples of the closure's own derivative by the hand.
    Matrix6d V = Matrix6d::Zero();
    for (int k = 0; k < 3; ++k) {
      Vector6d d = Vector6d::Zero();
      d(3 + k) = 1e-6;
      LoopProblem turned = problem;
      turned.A[1] = moved(problem.A[1], d), turned.M = moving_frames(turned.A, setup);
      const Vector6d g = (loop_row(turned, 1, s.X, s.Y, {}).e - row.e) / 1e-6;
      V += g * g.transpose();
    }
    LoopNoise noise;
    noise.variance = {0.0, 1.0, 0.0, 0.0};
    CHECK((loop_row(problem, 1, s.X, s.Y, noise).V - V).norm() < 1e-5);
  }
}

TEST_CASE("standard errors are the scatter over 300 seeds, with noise told and with noise found") {
  for (const bool told : {true, false}) {
    CAPTURE(told);
    double squares = 0.0;
    int inside = 0, count = 0;
    for (std::uint64_t seed = 100; seed < (kSanitized ? 103 : 400); ++seed) {
      const Scene s = make_scene(HandEyeSetup::eye_to_hand, 25, kUsual, seed);
      HandEyeOptions o = options_for(s);
      if (told)
        o.hand_position_sigma = kUsual.hand_position, o.hand_rotation_sigma = kUsual.hand_rotation,
        o.camera_position_sigma = kUsual.camera_position, o.camera_rotation_sigma = kUsual.camera_rotation;
      const HandEyeResult r = handeye(s.poses, o);
      REQUIRE(r.status == HandEyeStatus::done);
      const Eigen::Vector3d e = r.camera.T * r.working_point - s.X * r.working_point;
      for (int k = 0; k < 3; ++k, ++count) {
        const double z = e(k) / std::sqrt(r.working_point_covariance(k, k));
        squares += z * z, inside += std::abs(z) < 1.96;
      }
    }
    if (kSanitized) continue;
    CHECK(squares / count == doctest::Approx(1.0).scale(0).epsilon(told ? 0.15 : 0.3));
    CHECK(inside > 0.92 * count);
    CHECK(inside < 0.98 * count);
  }
}

/// Of Student's t, 97.5 %: Cornish and Fisher's expansion (Abramowitz and Stegun 26.7.5).
double student(double degrees_of_freedom) {
  const double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z, d = 1.0 / degrees_of_freedom;
  return z + (z3 + z) / 4.0 * d + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0 * d * d;
}

TEST_CASE("intervals from eight and ten poses hold the truth as often as they say, with the noise found from them") {
  // 300 scenes, of which each has six errors that hang together a little: 95 % may read 94.0 to 96.0 %.
  for (const HandEyeSetup setup : kSetups)
    for (const int n : {8, 10}) {
      CAPTURE(n);
      int inside = 0, by_normal = 0, count = 0;
      for (std::uint64_t seed = 5000; seed < (kSanitized ? 5003 : 5300); ++seed) {
        const Scene s = make_scene(setup, n, kUsual, seed);
        HandEyeOptions o = options_for(s);
        o.reject = false;
        const HandEyeResult r = handeye(s.poses, o);
        REQUIRE(r.status == HandEyeStatus::done);
        Vector6d e;
        e << r.camera.T.translation() - s.X.translation(),
            vector_from_rotation(r.camera.T.linear() * s.X.linear().transpose());
        for (int k = 0; k < 6; ++k, ++count) {
          const double z = std::abs(e(k)) / std::sqrt(r.camera.covariance(k, k));
          CHECK(std::isfinite(r.camera_degrees_of_freedom(k)));
          inside += z < student(r.camera_degrees_of_freedom(k)), by_normal += z < 1.959964;
        }
      }
      if (kSanitized) continue;
      CAPTURE(static_cast<double>(inside) / count);
      CHECK(inside > 0.935 * count);
      CHECK(inside < 0.965 * count);
      CHECK(by_normal < inside);
    }
}

TEST_CASE("a fit that is stopped does not say that the camera is found") {
  const Scene s = make_scene(kSetups[0], 10, kUsual, 5000);
  HandEyeOptions o = options_for(s);
  o.max_iterations = 2;
  const HandEyeResult r = handeye(s.poses, o);
  CHECK(r.status == HandEyeStatus::not_converged);
  CHECK(contains(r.message, "The fit to 10 poses did not come to an end in 2 iterations; where it stands"));
}

TEST_CASE("where the noise is told, quantiles are the normal ones, and many poses come to the same") {
  const Scene s = make_scene(HandEyeSetup::eye_in_hand, 10, kUsual, 41);
  HandEyeOptions o = options_for(s);
  o.hand_position_sigma = kUsual.hand_position, o.hand_rotation_sigma = kUsual.hand_rotation,
  o.camera_position_sigma = kUsual.camera_position, o.camera_rotation_sigma = kUsual.camera_rotation;
  const HandEyeResult told = handeye(s.poses, o);
  CHECK(told.camera_degrees_of_freedom.array().isInf().all());
  CHECK(told.board_degrees_of_freedom.array().isInf().all());
  const Scene many = make_scene(HandEyeSetup::eye_in_hand, 300, kUsual, 42);
  CHECK(handeye(many.poses, options_for(many)).camera_degrees_of_freedom.minCoeff() > 300.0);
}

TEST_CASE("both noises are found from many poses") {
  const HandEyeResult r = [] {
    const Scene s = make_scene(HandEyeSetup::eye_to_hand, 500, kUsual, 7);
    return handeye(s.poses, options_for(s));
  }();
  CHECK(r.noise.estimated);
  CHECK(r.noise.position == doctest::Approx(std::hypot(1e-4, 5e-4)).scale(0).epsilon(0.05));
  // The smaller of two rotation noises hardly shows beside the larger one: this seed's is the lowest of 60.
  CHECK(r.noise.hand_rotation == doctest::Approx(kUsual.hand_rotation).scale(0).epsilon(0.5));
  CHECK(r.noise.camera_rotation == doctest::Approx(kUsual.camera_rotation).scale(0).epsilon(0.1));
  CHECK(std::hypot(r.noise.hand_rotation, r.noise.camera_rotation) ==
        doctest::Approx(std::hypot(kUsual.hand_rotation, kUsual.camera_rotation)).scale(0).epsilon(0.05));
}

TEST_CASE("the smaller of two rotation noises is not found too small on the average") {
  for (const HandEyeSetup setup : kSetups)
    for (const int n : {30, 120}) {
      CAPTURE(n);
      const int seeds = kSanitized ? 2 : 80;
      double sum = 0.0, squares = 0.0;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Scene s = make_scene(setup, n, kUsual, static_cast<std::uint64_t>(seed));
        const double ratio = std::pow(handeye(s.poses, options_for(s)).noise.hand_rotation / kUsual.hand_rotation, 2);
        sum += ratio, squares += ratio * ratio;
      }
      if (kSanitized) continue;
      const double mean = sum / seeds, error = std::sqrt((squares / seeds - mean * mean) / seeds);
      CHECK(mean > 1.0 - 3.0 * error);
      CHECK(mean < (n < 100 ? 1.5 : 1.0 + 3.0 * error));  // of few poses the prior draws it towards an even split
    }
}

TEST_CASE("a pose left out is the fit without it") {
  const Scene s = make_scene(HandEyeSetup::eye_in_hand, 12, kUsual, 41);
  HandEyeOptions o = options_for(s);
  o.hand_position_sigma = 1e-4, o.hand_rotation_sigma = 1e-3, o.camera_position_sigma = 5e-4,
  o.camera_rotation_sigma = 2e-3;
  const HandEyeResult all = handeye(s.poses, o);
  for (const std::size_t i : {std::size_t{0}, std::size_t{5}}) {
    HandEyePoses rest = s.poses;
    rest.set.assign(12, 0);
    rest.set[i] = 1;
    const HandEyeResult without = handeye(rest, o);
    REQUIRE(without.test);
    CHECK(without.test->n == 1);
    CHECK(without.residuals[i].position == doctest::Approx(all.residuals[i].position_left_out).scale(0).epsilon(0.02));
    CHECK(without.residuals[i].rotation == doctest::Approx(all.residuals[i].rotation_left_out).scale(0).epsilon(0.02));
  }
}

namespace {

/// Root mean squares over the poses, each left out: as the result has them, and by a fit without the pose.
struct LeftOutBothWays {
  double position = 0.0, rotation = 0.0, pixels = 0.0, direct_position = 0.0, direct_rotation = 0.0,
         direct_pixels = 0.0;
};

LeftOutBothWays leave_each_out(const HandEyePoses& poses, const HandEyeOptions& options) {
  const HandEyeResult all = handeye(poses, options);
  REQUIRE(all.status == HandEyeStatus::done);
  REQUIRE(all.rejected.empty());
  LeftOutBothWays out{all.left_out.position_rms, all.left_out.rotation_rms, all.left_out.pixel_rms, 0.0, 0.0, 0.0};
  const std::size_t n = poses.T_base_hand.size();
  HandEyeOptions keep = options;
  keep.reject = false;
  for (std::size_t i = 0; i < n; ++i) {
    HandEyePoses rest = poses;
    rest.set.assign(n, 0);
    rest.set[i] = 1;
    const HandEyeResult without = handeye(rest, keep);
    REQUIRE(without.test);
    out.direct_position += std::pow(without.test->position_rms, 2);
    out.direct_rotation += std::pow(without.test->rotation_rms, 2);
    out.direct_pixels += std::pow(without.test->pixel_rms, 2);
  }
  const double count = static_cast<double>(n);
  out.direct_position = std::sqrt(out.direct_position / count);
  out.direct_rotation = std::sqrt(out.direct_rotation / count);
  out.direct_pixels = std::sqrt(out.direct_pixels / count);
  return out;
}

void check_agreement(const LeftOutBothWays& e, double tolerance) {
  CHECK(e.position == doctest::Approx(e.direct_position).scale(0).epsilon(tolerance));
  CHECK(e.rotation == doctest::Approx(e.direct_rotation).scale(0).epsilon(tolerance));
  if (std::isfinite(e.direct_pixels)) CHECK(e.pixels == doctest::Approx(e.direct_pixels).scale(0).epsilon(tolerance));
}

}  // namespace

TEST_CASE("left out of images with an unknown lens, poses are predicted as by a fit without them") {
  for (const int n : kSanitized ? std::vector<int>{6, 10} : std::vector<int>{6, 10, 16})
    for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 2); ++seed)
      for (const double tilt : {0.6, 0.15}) {
        CAPTURE(n);
        CAPTURE(seed);
        CAPTURE(tilt);
        Scene s = make_pixel_scene(n, 1e-4, 0.05 * kDegree, 0.1, seed, kCamera, tilt);
        s.poses.camera->fx *= 1.01, s.poses.camera->cx += 3.0;
        HandEyeOptions o = options_for(s);
        o.refine_camera = true;
        check_agreement(leave_each_out(s.poses, o), n < 10 ? 0.15 : 0.03);  // few: without one the noise found differs
      }
}

TEST_CASE("left out, poses are predicted as by a fit without them also where noise is told too small") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Scene s = make_scene(HandEyeSetup::eye_to_hand, 10, kUsual, seed);
    HandEyeOptions o = options_for(s);
    o.hand_position_sigma = 1e-5, o.hand_rotation_sigma = 1e-5, o.camera_position_sigma = 5e-5,
    o.camera_rotation_sigma = 2e-4, o.reject = false;
    check_agreement(leave_each_out(s.poses, o), 0.01);
    check_agreement(leave_each_out(make_pixel_scene(10, 1e-4, 0.05 * kDegree, 0.1, seed, kCamera).poses, {}), 0.03);
  }
}

TEST_CASE("of three poses none can be left out, and that is not a number") {
  const Scene s = make_pixel_scene(3, 1e-4, 0.05 * kDegree, 0.1, 3, kCamera);
  const HandEyeResult r = handeye(s.poses, options_for(s));
  REQUIRE(r.status == HandEyeStatus::done);
  CHECK(r.left_out.n == 3);
  CHECK(std::isnan(r.left_out.position_rms));
  CHECK(std::isnan(r.residuals[0].position_left_out));
  CHECK(std::isfinite(r.train.position_rms));
}

TEST_CASE("noise told too small is said, and standard errors are widened") {
  const Scene s = make_scene(HandEyeSetup::eye_to_hand, 40, kUsual, 9);
  HandEyeOptions o = options_for(s);
  o.hand_position_sigma = 1e-5, o.hand_rotation_sigma = 1e-5, o.camera_position_sigma = 5e-5,
  o.camera_rotation_sigma = 2e-4;
  const HandEyeResult told = handeye(s.poses, o), found = handeye(s.poses, options_for(s));
  REQUIRE(told.rejected.empty());
  REQUIRE(told.warnings.size() == 1);
  CHECK(told.warnings[0].find("noise that was given") != std::string::npos);
  CHECK(std::sqrt(told.working_point_covariance.trace()) > 0.5 * std::sqrt(found.working_point_covariance.trace()));
}

// ---- Poses that do not fit -----------------------------------------------------------------------------------------

TEST_CASE("gross outliers are all listed, up to three of ten") {
  for (const double share : {0.1, 0.3})
    for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 20); ++seed) {
      CAPTURE(share);
      CAPTURE(seed);
      Scene s = make_scene(HandEyeSetup::eye_to_hand, 30, kUsual, seed);
      Random random(seed + 1000);
      std::vector<std::size_t> spoilt;
      for (std::size_t i = 0; i < static_cast<std::size_t>(share * 30); ++i) {
        Vector6d d;
        d << 0.03 * normal3(&random).normalized(), 10.0 * kDegree * normal3(&random).normalized();
        s.poses.T_camera_board[3 * i] = moved(s.poses.T_camera_board[3 * i], d);
        spoilt.push_back(3 * i);
      }
      const HandEyeResult r = handeye(s.poses, options_for(s));
      REQUIRE(r.status == HandEyeStatus::done);
      CHECK(r.rejected == spoilt);
      CHECK(r.singular_gap > 5.0);  // of the poses that agree
      for (const std::size_t i : r.rejected) CHECK(!r.residuals[i].cause.empty());
      CHECK(position_error(r.camera.T, s.X) < 3e-3);
    }
}

TEST_CASE("what is wrong with a pose is named") {
  const Scene clean = make_scene(HandEyeSetup::eye_in_hand, 20, kUsual, 77);
  const auto cause = [&](const Scene& s, std::size_t i) {
    const HandEyeResult r = handeye(s.poses, options_for(s));
    CHECK(r.status == HandEyeStatus::done);
    CHECK(std::find(r.rejected.begin(), r.rejected.end(), i) != r.rejected.end());
    return r.residuals[i].cause;
  };
  Scene s = clean;
  s.poses.T_base_hand[6].translation().y() += 0.405;
  CHECK(cause(s, 6).find("hand y is off by 40") != std::string::npos);
  CHECK(cause(s, 6).find("typing error") != std::string::npos);
  s = clean;
  s.poses.T_base_hand[6].translation().x() *= -1.0;
  CHECK(cause(s, 6).find("hand x has the wrong sign") != std::string::npos);
  s = clean;
  s.poses.T_camera_board[4] = s.poses.T_camera_board[4] * make({0.2, 0.15, 0.0}, {0.0, 0.0, 180.0 * kDegree});
  CHECK(cause(s, 4).find("turned by 180 deg about its normal") != std::string::npos);
  s = clean;
  std::swap(s.poses.T_camera_board[2], s.poses.T_camera_board[9]);
  CHECK(cause(s, 2).find("hand of pose 9") ==
        std::string::npos);  // pose 9 is itself rejected: its hand is not among those that agree
  s = clean;
  s.poses.T_camera_board[2] = s.poses.T_camera_board[9];
  CHECK(cause(s, 2).find("belongs to the hand of pose 9") != std::string::npos);
  s = clean;
  s.poses.T_base_hand[2] = s.poses.T_base_hand[9];
  CHECK(cause(s, 2).find("its hand is that of pose 9") != std::string::npos);
}

TEST_CASE("a board that looks the same turned is read as the loop needs it") {
  Scene s = make_scene(HandEyeSetup::eye_in_hand, 20, kUsual, 15);
  for (int k = 1; k < 4; ++k) {
    const Eigen::Vector3d center(0.1, 0.1, 0.0);
    Eigen::Isometry3d turn = make({0, 0, 0}, {0, 0, 90.0 * k * kDegree});
    turn.translation() = center - turn.linear() * center;
    s.poses.board_symmetries.push_back(turn);
  }
  const HandEyeResult straight = handeye(s.poses, options_for(s));
  Random random(3);
  std::vector<std::size_t> turned;
  for (std::size_t i = 0; i < 20; ++i) {
    const std::uint64_t k = random.below(4);
    if (k > 0) s.poses.T_camera_board[i] = s.poses.T_camera_board[i] * s.poses.board_symmetries[k - 1].inverse();
  }
  s.poses.set.assign(20, 0);
  for (const std::size_t i : {3, 8, 14})
    s.poses.set[i] = 1;  // held-out boards are read in the turn that closes as well
  const HandEyeResult r = handeye(s.poses, options_for(s));
  CHECK(r.status == HandEyeStatus::done);
  CHECK(r.rejected.empty());
  REQUIRE(r.test);
  CHECK(r.test->position_max < 5e-3);
  CHECK(position_error(r.camera.T, straight.camera.T) <
        1e-3);  // the board's origin may be another corner: noise acts there
}

// ---- Other readings of the same numbers ----------------------------------------------------------------------------

TEST_CASE("a wrong reading is recognised, named, and closes when it is applied") {
  const auto wrong = [](Scene* s, const std::string& name) {
    Frames &hand = s->poses.T_base_hand, &board = s->poses.T_camera_board;
    const auto each = [](Frames* frames, auto change) {
      for (Eigen::Isometry3d& T : *frames) T = change(T);
    };
    const auto as_xyzw = [](Eigen::Isometry3d T) {  // written x y z w into columns w x y z
      const Eigen::Quaterniond q(T.linear());
      T.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
      return T;
    };
    const auto mirrored = [](Eigen::Isometry3d T) {
      const Eigen::DiagonalMatrix<double, 3> m(1, -1, 1);
      T.linear() = m * T.linear() * m, T.translation() = m * T.translation();
      return T;
    };
    if (name == "hand-inverted") each(&hand, [](const Eigen::Isometry3d& T) { return T.inverse(); });
    if (name == "board-inverted") each(&board, [](const Eigen::Isometry3d& T) { return T.inverse(); });
    if (name == "hand-millimetres")
      each(&hand, [](Eigen::Isometry3d T) {
        T.translation() *= 1e3;
        return T;
      });
    if (name == "board-millimetres")
      each(&board, [](Eigen::Isometry3d T) {
        T.translation() *= 1e3;
        return T;
      });
    if (name == "hand-xyzw") each(&hand, as_xyzw);
    if (name == "board-xyzw") each(&board, as_xyzw);
    if (name == "hand-left-handed") each(&hand, mirrored);
    if (name == "hand-y-negated")
      each(&hand, [](Eigen::Isometry3d T) {
        T.translation().y() *= -1.0;
        return T;
      });
    if (name == "hand-transposed")
      each(&hand, [](Eigen::Isometry3d T) {
        T.linear().transposeInPlace();
        return T;
      });
    if (name == "hand-zyx-as-xyz")
      each(&hand, [](Eigen::Isometry3d T) {  // Rz(c) Ry(b) Rx(a) written, Rx(a) Ry(b) Rz(c) read
        const Eigen::Vector3d a = T.linear().eulerAngles(2, 1, 0);
        T.linear() =
            (Eigen::AngleAxisd(a(2), Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(a(1), Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd(a(0), Eigen::Vector3d::UnitZ()))
                .toRotationMatrix();
        return T;
      });
    if (name == "hand-rotation-vector-as-zyx")
      each(&hand, [](Eigen::Isometry3d T) {
        const Eigen::Vector3d v = vector_from_rotation(T.linear());
        T.linear() =
            (Eigen::AngleAxisd(v(2), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(v(1), Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd(v(0), Eigen::Vector3d::UnitX()))
                .toRotationMatrix();
        return T;
      });
    if (name == "hand-radians-as-degrees")
      each(&hand, [](Eigen::Isometry3d T) {
        T.linear() = rotation_from_vector(kDegree * vector_from_rotation(T.linear()));
        return T;
      });
    if (name == "board-one-later") std::rotate(board.begin(), board.begin() + 1, board.end());
    if (name == "hand-millimetres+hand-inverted")
      each(&hand, [](Eigen::Isometry3d T) {
        T = T.inverse();
        T.translation() *= 1e3;
        return T;
      });
  };
  for (const HandEyeSetup setup : kSetups)
    for (const std::string name :
         {"hand-inverted", "board-inverted", "hand-millimetres", "board-millimetres", "hand-xyzw", "board-xyzw",
          "hand-left-handed", "hand-y-negated", "hand-transposed", "hand-zyx-as-xyz", "hand-rotation-vector-as-zyx",
          "hand-radians-as-degrees", "board-one-later", "hand-millimetres+hand-inverted"}) {
      if (kSanitized && (setup == HandEyeSetup::eye_in_hand || name.find("board") == std::string::npos)) continue;
      CAPTURE(name);
      Scene s = make_scene(setup, 25, kUsual, 51, {1.2, 1.0, 2.0});
      const Eigen::Isometry3d X = s.X;
      wrong(&s, name);
      HandEyeOptions o = options_for(s);
      const HandEyeResult refused = handeye(s.poses, o);
      REQUIRE(refused.status == HandEyeStatus::not_closing);
      REQUIRE(!refused.readings.empty());
      CHECK(refused.readings[0].name == name);
      CHECK(refused.message.find(refused.readings[0].name) != std::string::npos);
      o.reading = refused.readings[0].name;
      const HandEyeResult r = handeye(s.poses, o);
      CHECK(r.status == HandEyeStatus::done);
      CHECK(position_error(r.camera.T, X) < 5e-3);
    }
}

TEST_CASE("the set-up exchanged is proposed first, and closes when it is told so") {
  int sets = 0;
  for (const HandEyeSetup setup : kSetups)
    for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 20); ++seed)
      for (const bool facing : {false, true}) {  // z of the board away from the camera, and towards it
        CAPTURE(seed);
        CAPTURE(facing);
        const int n = 6 + static_cast<int>(seed);
        Scene s = make_scene(setup, n, kUsual, seed);
        if (facing)
          for (Eigen::Isometry3d& B : s.poses.T_camera_board) B = B * make({0, 0, 0}, {kPi, 0, 0});
        HandEyeOptions o;
        o.setup = setup == HandEyeSetup::eye_in_hand ? HandEyeSetup::eye_to_hand : HandEyeSetup::eye_in_hand;
        const HandEyeResult refused = handeye(s.poses, o);
        REQUIRE(refused.status == HandEyeStatus::not_closing);
        REQUIRE_FALSE(refused.readings.empty());
        CHECK(refused.readings[0].name == "other-setup");
        CHECK(refused.readings[0].other_setup);
        CHECK(refused.message.find(setup == HandEyeSetup::eye_in_hand ? "set-up eye-in-hand."
                                                                      : "set-up eye-to-hand.") != std::string::npos);
        const HandEyeResult told = handeye(s.poses, options_for(s));
        CHECK(told.status == HandEyeStatus::done);
        CHECK(position_error(told.camera.T, s.X) < 0.01);
        ++sets;
      }
  CHECK(sets >= (kSanitized ? 8 : 40));
}

TEST_CASE("what is wrong beside the set-up is proposed with it, and the set-up is no way to read poses") {
  Scene s = make_scene(HandEyeSetup::eye_to_hand, 15, kUsual, 4);
  for (Eigen::Isometry3d& A : s.poses.T_base_hand) A.translation() *= 1e3;
  const HandEyeResult r = handeye(s.poses, {});
  REQUIRE(r.status == HandEyeStatus::not_closing);
  REQUIRE_FALSE(r.readings.empty());
  CHECK(r.readings[0].name == "hand-millimetres+other-setup");
  CHECK(r.readings[0].other_setup);
  for (const truing::Reading& reading : r.readings)
    CHECK(reading.other_setup == (reading.name.find("other-setup") != std::string::npos));
  CHECK(r.message.find("set-up eye-to-hand, reading \"hand-millimetres\".") != std::string::npos);
  HandEyeOptions o;
  o.reading = "other-setup";
  CHECK_THROWS_WITH_AS(handeye(s.poses, o), doctest::Contains("give the set-up eye-to-hand"), std::invalid_argument);
}

TEST_CASE("the same mistake on hand and board is recognised, as where one program wrote both") {
  const auto as_xyzw = [](const Eigen::Matrix3d& R) {
    const Eigen::Quaterniond q(R);
    return Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  };
  const auto as_xyz = [](const Eigen::Matrix3d& R) {  // Rz(c) Ry(b) Rx(a) written, Rx(a) Ry(b) Rz(c) read
    const Eigen::Vector3d a = R.eulerAngles(2, 1, 0);
    return (Eigen::AngleAxisd(a(2), Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(a(1), Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(a(0), Eigen::Vector3d::UnitZ()))
        .toRotationMatrix();
  };
  const auto transposed = [](const Eigen::Matrix3d& R) -> Eigen::Matrix3d { return R.transpose(); };
  const std::pair<std::string, std::function<Eigen::Matrix3d(const Eigen::Matrix3d&)>> mistakes[] = {
      {"xyzw", as_xyzw}, {"zyx-as-xyz", as_xyz}, {"transposed", transposed}};
  for (const HandEyeSetup setup : kSetups)
    for (const Noise& noise : {Noise{}, kUsual})
      for (const auto& made : mistakes) {
        if (kSanitized && setup == HandEyeSetup::eye_in_hand) continue;
        const std::string& name = made.first;
        CAPTURE(name);
        Scene s = make_scene(setup, 25, noise, 55, {1.2, 1.0, 2.0});
        for (Frames* frames : {&s.poses.T_base_hand, &s.poses.T_camera_board})
          for (Eigen::Isometry3d& T : *frames) T.linear() = made.second(T.linear());
        HandEyeOptions o = options_for(s);
        const HandEyeResult refused = handeye(s.poses, o);
        REQUIRE(refused.status == HandEyeStatus::not_closing);
        REQUIRE(!refused.readings.empty());
        o.reading = "hand-" + name + "+board-" + name;
        CHECK(refused.readings[0].name == o.reading);
        const HandEyeResult r = handeye(s.poses, o);
        CHECK(r.status == HandEyeStatus::done);
        CHECK(position_error(r.camera.T, s.X) < 5e-3);
      }
}

TEST_CASE("poses that belong to nothing are refused without a reading") {
  Scene s = make_scene(HandEyeSetup::eye_in_hand, 20, {}, 61);
  const Scene other = make_scene(HandEyeSetup::eye_in_hand, 20, {}, 62);
  s.poses.T_camera_board = other.poses.T_camera_board;
  const HandEyeResult r = handeye(s.poses, options_for(s));
  CHECK(r.status == HandEyeStatus::not_closing);
  CHECK(r.readings.empty());
}

TEST_CASE("boards ten times too large or too small do not close, and the factor is said") {
  for (const HandEyeSetup setup : kSetups)
    for (const double factor : {0.1, 10.0}) {
      Scene s = make_scene(setup, 15, kUsual, 63);
      for (Eigen::Isometry3d& T : s.poses.T_camera_board) T.translation() *= factor;
      const HandEyeResult r = handeye(s.poses, options_for(s));
      REQUIRE(r.status == HandEyeStatus::not_closing);
      CHECK(r.board_scale * factor == doctest::Approx(1.0).scale(0).epsilon(0.01));
      CHECK(r.message.find(factor > 1.0 ? " times as small" : " times as large") != std::string::npos);
    }
}

TEST_CASE("a row that is there twice shifts those that follow, and motions are not blamed for it") {
  for (const std::ptrdiff_t row : {4, 8, 12}) {
    Scene s = make_scene(HandEyeSetup::eye_in_hand, 16, kUsual, 64);
    Frames& hands = s.poses.T_base_hand;
    hands.insert(hands.begin() + row, hands[static_cast<std::size_t>(row)]), hands.pop_back();
    const HandEyeResult r = handeye(s.poses, options_for(s));
    if (r.status == HandEyeStatus::done)
      CHECK_FALSE(r.rejected.empty());
    else
      CHECK(r.status == HandEyeStatus::not_closing);
  }
}

TEST_CASE("a board of another size is said") {
  Scene s = make_scene(HandEyeSetup::eye_in_hand, 30, kUsual, 71);
  for (Eigen::Isometry3d& T : s.poses.T_camera_board) T.translation() *= 0.96;
  const HandEyeResult r = handeye(s.poses, options_for(s));
  CHECK(r.board_scale == doctest::Approx(1.0 / 0.96).scale(0).epsilon(0.01));
  CHECK(std::any_of(r.warnings.begin(), r.warnings.end(),
                    [](const std::string& w) { return w.find("% larger than given") != std::string::npos; }));
  REQUIRE(r.concerns.size() == r.warnings.size());
  const auto scale = std::find_if(r.concerns.begin(), r.concerns.end(), [](const HandEyeConcern& concern) {
    return concern.kind == HandEyeConcernKind::board_scale;
  });
  REQUIRE(scale != r.concerns.end());
  CHECK(scale->value == r.board_scale);
}

TEST_CASE("a board that is likely of another size is said where that does much for the closure") {
  const auto says_scale = [](const HandEyeResult& r) {
    return std::any_of(r.concerns.begin(), r.concerns.end(),
                       [](const HandEyeConcern& concern) { return concern.kind == HandEyeConcernKind::board_scale; });
  };
  const auto standard_errors = [](const HandEyeResult& r) {
    return std::abs(r.board_scale - 1.0) / r.board_scale_sigma;
  };
  const std::uint64_t seeds = kSanitized ? 3 : 30;
  const auto with_lengths_times = [](double factor, Scene s) {
    for (Eigen::Isometry3d& T : s.poses.T_camera_board) T.translation() *= factor;
    return handeye(s.poses, options_for(s));
  };
  int likely = 0, said = 0, false_alarms = 0;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    // A few poses: the misfit passes for noise, so that no factor is many standard errors from 1.
    const Scene few = make_scene(HandEyeSetup::eye_in_hand, 7, kUsual, 700 + seed, {0.3, 0.3, 0.3});
    false_alarms += says_scale(handeye(few.poses, options_for(few)));
    const HandEyeResult r = with_lengths_times(0.985, few);
    if (standard_errors(r) > 2.5 && standard_errors(r) < 4.0) ++likely, said += says_scale(r);
  }
  CHECK(likely > 0.8 * static_cast<double>(seeds));
  CHECK(said == likely);
  CHECK(false_alarms == 0);
  // More poses: three standard errors do little for the closure.
  const Scene many = make_scene(HandEyeSetup::eye_in_hand, 20, kUsual, 760, {0.1, 0.1, 0.1});
  const HandEyeResult right = handeye(many.poses, options_for(many));
  const HandEyeResult r = with_lengths_times(right.board_scale - 3.0 * right.board_scale_sigma, many);
  REQUIRE(r.board_scale - 1.0 > 0.002);
  REQUIRE(standard_errors(r) > 2.5);
  REQUIRE(standard_errors(r) < 4.0);
  CHECK_FALSE(says_scale(r));
}

TEST_CASE("a reading is explained in the caller's nouns") {
  CHECK(explain_reading("hand-inverted+board-millimetres", {"flange", "tracker", "receiver"}) ==
        "flange poses are inverted (base in flange); "
        "receiver positions are in mm and were read as m");
  CHECK_THROWS_AS(explain_reading("board-upside-down"), std::invalid_argument);
  for (const Reading& reading : handeye_readings()) {
    CHECK(reading.explanation == explain_reading(reading.name));
    CHECK(reading.explanation.find('{') == std::string::npos);
  }
}

// ---- What motions cannot show --------------------------------------------------------------------------------------

TEST_CASE("one axis of rotation: the height along it is refused, or told") {
  for (const HandEyeSetup setup : kSetups)
    for (const Noise& noise : {Noise{}, kUsual}) {
      Scene s = make_scene(setup, 20, noise, 81, {0.0, 0.0, 1.5});
      HandEyeOptions o = options_for(s);
      const HandEyeResult r = handeye(s.poses, o);
      REQUIRE(r.status == HandEyeStatus::not_observable);
      REQUIRE(r.unobservable.size() == 1);
      CHECK(std::abs(r.unobservable[0].direction.z()) > 0.999);
      CHECK(r.unobservable[0].reason == UnobservableReason::one_axis);
      CHECK(r.message.find("known height") != std::string::npos);
      CHECK_THROWS_WITH_AS(handeye_closed_form(s.poses, setup), doctest::Contains("known height"),
                           std::invalid_argument);
      o.known_height = s.X.translation().z();
      const HandEyeResult told = handeye(s.poses, o);
      CHECK(told.status == HandEyeStatus::done);
      CHECK(position_error(told.camera.T, s.X) < (noise.camera_position > 0.0 ? 5e-3 : 1e-8));
      CHECK(rotation_error(told.camera.T, s.X) < (noise.camera_position > 0.0 ? 5e-3 : 1e-8));
    }
}

TEST_CASE("moves without a turn, and turns too small, are refused with what to do") {
  for (const Noise& noise : {Noise{}, kUsual}) {
    const Scene s = make_scene(HandEyeSetup::eye_to_hand, 20, noise, 91, {0.0, 0.0, 0.0});
    const HandEyeResult r = handeye(s.poses, options_for(s));
    CHECK(r.status == HandEyeStatus::not_observable);
    CHECK(r.unobservable.size() == 3);
    CHECK(r.message.find("Rotate") != std::string::npos);
  }
  const Scene small = make_scene(HandEyeSetup::eye_to_hand, 8, kUsual, 92, {0.006, 0.006, 0.006});
  const HandEyeResult r = handeye(small.poses, options_for(small));
  CHECK(r.status == HandEyeStatus::not_observable);
  CHECK(r.message.find("30 deg") != std::string::npos);
}

TEST_CASE("unusable data are one clear error") {
  const Scene s = make_scene(HandEyeSetup::eye_in_hand, 5, {}, 1);
  const auto message = [&](const HandEyePoses& poses, const HandEyeOptions& o = {}) {
    try {
      handeye(poses, o);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  HandEyePoses p = s.poses;
  p.T_base_hand.resize(2), p.T_camera_board.resize(2);
  CHECK(message(p).find("three poses") != std::string::npos);
  p = s.poses;
  for (Eigen::Isometry3d& T : p.T_base_hand) T = p.T_base_hand[0];
  CHECK(message(p).find("all hand poses are equal") != std::string::npos);
  p = s.poses;
  for (Eigen::Isometry3d& T : p.T_camera_board) T = p.T_camera_board[0];
  CHECK(message(p).find("all board poses are equal") != std::string::npos);
  p = s.poses;
  p.T_base_hand[3].translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(message(p).find("pose 3 is not finite") != std::string::npos);
  p = s.poses;
  p.T_camera_board[1].linear() *= 1.1;
  CHECK(message(p).find("not a rotation") != std::string::npos);
  p = s.poses;
  p.T_camera_board[1].linear().col(0) *= -1.0;
  CHECK(message(p).find("left-handed") != std::string::npos);
  p = s.poses;
  p.T_camera_board.pop_back();
  CHECK(message(p).find("5 hand poses and 4 board poses") != std::string::npos);
  HandEyeOptions o;
  o.reading = "hand-upside-down";
  CHECK(message(s.poses, o).find("unknown reading 'hand-upside-down'") != std::string::npos);
  o = {};
  o.pixel_sigma = 0.0;
  CHECK(message(s.poses, o).find("pixel_sigma") != std::string::npos);
}

// ---- Images --------------------------------------------------------------------------------------------------------

TEST_CASE("pixels without noise give the camera, also when its lens must be found as well") {
  for (const bool refine : {false, true}) {
    Scene s = make_pixel_scene(12, 0.0, 0.0, 0.0, 5, kCamera);
    HandEyeOptions o = options_for(s);
    o.refine_camera = refine;
    if (refine) s.poses.camera->fx *= 1.01, s.poses.camera->cx += 3.0, s.poses.camera->distortion[0] += 0.01;
    const HandEyeResult r = handeye(s.poses, o);
    REQUIRE(r.status == HandEyeStatus::done);
    CHECK(position_error(r.camera.T, s.X) < 1e-6);
    if (!refine) continue;
    REQUIRE(r.camera_model);
    CHECK(r.camera_model->fx == doctest::Approx(kCamera.fx).scale(0).epsilon(1e-6));
    CHECK(r.camera_model->cx == doctest::Approx(kCamera.cx).scale(0).epsilon(1e-5));
    CHECK(r.camera_model->distortion[0] == doctest::Approx(kCamera.distortion[0]).scale(0).epsilon(1e-3));
    CHECK(r.camera_model_sigma.size() == 9);
  }
}

TEST_CASE("standard errors from images are the scatter over 60 seeds") {
  int inside = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 60); ++seed) {
    const Scene s = make_pixel_scene(15, 1e-4, 0.05 * kDegree, 0.1, seed, kCamera);
    const HandEyeResult r = handeye(s.poses, options_for(s));
    REQUIRE(r.status == HandEyeStatus::done);
    CHECK(r.noise.pixel == doctest::Approx(0.1).scale(0).epsilon(0.15));
    const Eigen::Vector3d e = r.camera.T * r.working_point - s.X * r.working_point;
    for (int k = 0; k < 3; ++k, ++count) inside += std::abs(e(k)) < 1.96 * std::sqrt(r.working_point_covariance(k, k));
  }
  if (!kSanitized) CHECK(inside > 0.88 * count);
}

TEST_CASE("a lens that is not that of the images is said, and one that is theirs is not doubted") {
  for (const double off : {0.0, 10.0})
    for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 10); ++seed) {
      Scene s = make_pixel_scene(15, 1e-4, 0.05 * kDegree, 0.1, seed, kCamera);
      s.poses.camera->cx += 5.0 * off, s.poses.camera->distortion[0] += 0.01 * off;
      const HandEyeResult r = handeye(s.poses, options_for(s));
      REQUIRE(r.status == HandEyeStatus::done);
      const bool said = std::any_of(r.concerns.begin(), r.concerns.end(), [](const HandEyeConcern& concern) {
        return concern.kind == HandEyeConcernKind::other_lens;
      });
      CHECK(said == (off > 0.0));
    }
}

TEST_CASE("what is about board poses is refused, and not proposed, where boards were found in images") {
  Scene s = make_pixel_scene(12, 1e-4, 0.05 * kDegree, 0.1, 9, kCamera);
  HandEyeOptions options = options_for(s);
  options.reading = "board-inverted";
  CHECK_THROWS_AS(handeye(s.poses, options), std::invalid_argument);
  options.reading = "";
  options.camera_position_sigma = 1e-3;
  CHECK_THROWS_AS(handeye(s.poses, options), std::invalid_argument);
  options.camera_position_sigma = HandEyeOptions().camera_position_sigma;
  for (Eigen::Isometry3d& T : s.poses.T_base_hand)
    T = T.inverse();  // the hand's side is the only one that can be read otherwise
  const HandEyeResult r = handeye(s.poses, options);
  REQUIRE(r.status == HandEyeStatus::not_closing);
  for (const Reading& reading : r.readings) CHECK(reading.name.find("board-") == std::string::npos);
  REQUIRE_FALSE(r.readings.empty());
  CHECK(r.readings[0].name == "hand-inverted");
}

TEST_CASE("boards that scatter beyond their pixels are said, and weighed by that") {
  Scene s = make_pixel_scene(25, 1e-4, 0.05 * kDegree, 0.1, 8, kCamera);
  Random random(1);
  for (BoardImage& image : s.poses.images) {  // every board bent in its own way: seen turned by half a degree
    const Eigen::Matrix3d turn = rotation_from_vector(0.5 * kDegree * normal3(&random));
    image.points = turn.transpose() * image.points;
  }
  const HandEyeResult r = handeye(s.poses, options_for(s));
  REQUIRE(r.status == HandEyeStatus::done);
  CHECK(std::any_of(r.warnings.begin(), r.warnings.end(),
                    [](const std::string& w) { return w.find("what their pixels can tell") != std::string::npos; }));
  CHECK(r.noise.camera_rotation == doctest::Approx(0.5 * kDegree).scale(0).epsilon(0.3));
  CHECK(position_error(r.camera.T, s.X) < 5e-3);
  const HandEyeResult clean =
      handeye(make_pixel_scene(25, 1e-4, 0.05 * kDegree, 0.1, 8, kCamera).poses, options_for(s));
  CHECK(clean.warnings.empty());
}

TEST_CASE("a robot that turns is not taken for a lens: board near the hand, sharp images, seeds 1 to 30") {
  double hand = 0.0, squares = 0.0;
  const int seeds = kSanitized ? 2 : 30;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Scene s = make_pixel_scene(14, 0.0, 0.0, 0.02, seed, kCamera);
    const Eigen::Isometry3d X = make({0.9, 0.1, 0.5}, {-1.9, 0.1, 0.3}),
                            Y = make({0.02, -0.03, 0.06}, {0.2, 0.1, -0.4});
    Random random(seed);
    for (Eigen::Isometry3d& T : s.poses.T_base_hand) {
      const Eigen::Isometry3d B = s.X.inverse() * T.inverse() * s.Y;
      T = disturbed(X * B * Y.inverse(), 2e-4, 4e-4, &random);
    }
    HandEyeOptions o;
    o.setup = HandEyeSetup::eye_to_hand;
    const HandEyeResult r = handeye(s.poses, o);
    REQUIRE(r.status == HandEyeStatus::done);
    CHECK(r.warnings.empty());
    hand += r.noise.hand_rotation / seeds;
    Vector6d e;
    e << r.camera.T.translation() - X.translation(),
        log_rotation(Eigen::Quaterniond(r.camera.T.linear() * X.linear().transpose()));
    squares += e.dot(r.camera.covariance.ldlt().solve(e)) / 6.0 / seeds;
  }
  if (kSanitized) return;
  CHECK(hand == doctest::Approx(4e-4).scale(0).epsilon(0.06));  // it was 3.1e-4: the rest was the lens'
  CHECK(squares == doctest::Approx(1.05).scale(0).epsilon(0.25));
}

TEST_CASE("the elimination of robot poses finds Ceres' minimum over all of them") {
  // refine_loop holds the board's pixel covariance, refine_images goes through the pixels with every robot pose free.
  const Scene s = make_pixel_scene(20, 1e-4, 0.05 * kDegree, 0.1, 3, kCamera);
  LoopProblem problem;
  problem.setup = s.setup, problem.A = s.poses.T_base_hand, problem.M = moving_frames(problem.A, s.setup),
  problem.B = s.poses.T_camera_board;
  problem.pixel_shape.resize(20);
  Rows rows(20);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  for (std::size_t i = 0; i < 20; ++i) {
    const BoardFit fit = fit_board(kCamera, s.poses.images[i], problem.B[i]);
    REQUIRE(fit.converged);
    problem.B[i] = fit.T_camera_board, problem.pixel_shape[i] = fit.shape;
  }
  LoopNoise noise;
  noise.variance = {1e-8, std::pow(0.05 * kDegree, 2), 0.0, 0.01}, noise.estimate = {false, false, false, false};
  const LoopEstimate a = refine_loop(problem, rows, s.X, s.Y, noise, 50);
  const ImageEstimate b =
      refine_images(problem, s.poses.images, rows, kCamera, s.X, s.Y, {0.1, 1e-4, 0.05 * kDegree}, false, 50);
  const double sigma = std::sqrt(a.covariance.topLeftCorner<3, 3>().trace());
  CHECK(position_error(a.X, b.X) < 0.02 * sigma);
  CHECK((a.covariance - b.covariance).norm() < 0.02 * a.covariance.norm());
}

// ---- Planning, clocks, kinematics ----------------------------------------------------------------------------------

TEST_CASE("planned poses shrink the standard error as promised, more than as many random ones") {
  const Scene s = make_scene(HandEyeSetup::eye_in_hand, 8, kUsual, 13, {0.25, 0.25, 0.25});
  HandEyeOptions o = options_for(s);
  o.hand_position_sigma = kUsual.hand_position, o.hand_rotation_sigma = kUsual.hand_rotation,
  o.camera_position_sigma = kUsual.camera_position, o.camera_rotation_sigma = kUsual.camera_rotation;
  const HandEyeResult before = handeye(s.poses, o);
  const std::vector<NextHandPose> next = handeye_plan(s.poses, before, o);
  REQUIRE(next.size() == 5);
  CHECK(next[0].working_point_sigma < std::sqrt(before.working_point_covariance.trace() / 3.0));
  for (std::size_t k = 1; k < next.size(); ++k) CHECK(next[k].working_point_sigma < next[k - 1].working_point_sigma);
  Random random(2);
  Scene planned = s;
  for (const NextHandPose& n : next) {
    planned.poses.T_base_hand.push_back(n.T_base_hand);
    const Eigen::Isometry3d B = predicted_board(s.X, moving_frames({n.T_base_hand}, s.setup)[0], s.Y);
    CHECK(position_error(B, n.T_camera_board) < 0.02);
    planned.poses.T_camera_board.push_back(disturbed(B, kUsual.camera_position, kUsual.camera_rotation, &random));
  }
  const HandEyeResult after = handeye(planned.poses, o);
  CHECK(std::sqrt(after.working_point_covariance.trace() / 3.0) ==
        doctest::Approx(next.back().working_point_sigma).scale(0).epsilon(0.3));
}

TEST_CASE("the offset between two clocks is found within three standard errors, and refused where nothing turns") {
  const auto hand_at = [](double t) {
    return make(
        {0.6 + 0.1 * std::sin(0.9 * t), 0.1 * std::cos(1.3 * t), 0.3 + 0.1 * std::sin(0.5 * t)},
        {0.6 * std::sin(1.1 * t), 0.5 * std::sin(0.7 * t + 1.0) + 0.1 * std::sin(3.1 * t), 0.7 * std::sin(0.43 * t)});
  };
  const Scene s = make_scene(HandEyeSetup::eye_to_hand, 3, {}, 1);
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 10); ++seed) {
    Random random(seed);
    std::vector<double> hand_time, camera_time;
    Frames hand, board;
    for (int i = 0; i < 2500; ++i) {
      hand_time.push_back(100.0 + 0.008 * i);
      hand.push_back(disturbed(hand_at(hand_time.back()), 1e-4, 5e-4, &random));
    }
    for (int i = 0; i < 500; ++i) {
      camera_time.push_back(7.0 + i / 30.0);  // t_hand = t_camera + 94.037
      board.push_back(disturbed(predicted_board(s.X, hand_at(camera_time.back() + 94.037), s.Y), 5e-4, 2e-3, &random));
    }
    const ClockOffset c = handeye_clock(hand_time, hand, camera_time, board, s.setup, 120.0);
    REQUIRE_MESSAGE(c.found, c.message);
    CHECK(c.sigma < 0.001);
    CHECK(std::abs(c.offset - 94.037) < 4.0 * c.sigma + 1e-4);
    HandEyePoses poses;
    poses.T_base_hand = c.T_base_hand;
    for (const std::size_t i : c.rows) poses.T_camera_board.push_back(board[i]);
    CHECK(position_error(handeye(poses, options_for(s)).camera.T, s.X) < 2e-3);
  }
  std::vector<double> time;
  Frames still;
  Random random(4);
  for (int i = 0; i < 200; ++i) time.push_back(0.01 * i), still.push_back(disturbed(hand_at(0.0), 1e-4, 1e-3, &random));
  const ClockOffset none = handeye_clock(time, still, time, still, s.setup, 0.5);
  (void)none;  // the same record twice is in step
  Frames other;
  for (int i = 0; i < 200; ++i) other.push_back(disturbed(hand_at(0.0), 1e-4, 1e-3, &random));
  CHECK(!handeye_clock(time, still, time, other, s.setup, 0.5).found);
  std::swap(time[4], time[5]);
  CHECK_THROWS_WITH_AS(handeye_clock(time, still, time, other, s.setup, 0.5),
                       doctest::Contains("goes back in time at row 5"), std::invalid_argument);
}

TEST_CASE("the offset is found in every stretch of stamps that are rounded: seed 71") {
  // A tracker of 60 Hz, so quiet that slopes over two of its steps will do: their ends are where a row is, or is not.
  const auto hand_at = [](double t) {
    return make({0.6 + 0.1 * std::sin(0.9 * t), 0.1 * std::cos(1.3 * t), 0.3},
                {0.6 * std::sin(1.1 * t), 0.5 * std::sin(0.7 * t + 1.0), 0.7 * std::sin(0.43 * t)});
  };
  const Scene s = make_scene(HandEyeSetup::eye_to_hand, 3, {}, 1);
  Random random(71);
  std::vector<double> hand_time;
  Frames hand;
  for (int i = 0; i < 6000; ++i) hand_time.push_back(0.01 * i), hand.push_back(hand_at(hand_time.back()));
  for (int stretch = 0; stretch < 5; ++stretch) {
    CAPTURE(stretch);
    std::vector<double> time;
    Frames board;
    for (int i = 0; i < 600; ++i) {
      time.push_back(std::round(1e6 * (2.0 + 10.0 * stretch + i / 60.0)) / 1e6 - 6.8665);
      board.push_back(disturbed(predicted_board(s.X, hand_at(time.back() + 6.9), s.Y), 5e-5, 5e-5, &random));
    }
    const ClockOffset c = handeye_clock(hand_time, hand, time, board, s.setup, 8.0);
    REQUIRE_MESSAGE(c.found, c.message);
    CHECK(std::abs(c.offset - 6.9) < 1e-3);
  }
}

namespace {

/// Two records of 20 and 17 s that turn about three axes with frequencies of `seed`; `same`: of one motion.
ClockOffset clock_of_noisy_boards(std::uint64_t seed, double rotation_noise, bool same) {
  Random random(seed);
  Eigen::Vector3d speed[2], phase[2];
  for (int m = 0; m < 2; ++m)
    for (int k = 0; k < 3; ++k) speed[m](k) = random.uniform(0.4, 3.0), phase[m](k) = random.uniform(0.0, 2.0 * kPi);
  const auto hand_at = [&](int m, double t) {
    const Eigen::Vector3d turn = (speed[m] * t + phase[m]).array().sin();
    return make({0.6 + 0.1 * std::sin(0.9 * t), 0.1 * std::cos(1.3 * t), 0.3}, 0.5 * turn);
  };
  const Scene s = make_scene(HandEyeSetup::eye_to_hand, 3, {}, 1);
  std::vector<double> hand_time, camera_time;
  Frames hand, board;
  for (int i = 0; i < 2500; ++i) {
    hand_time.push_back(100.0 + 0.008 * i);
    hand.push_back(disturbed(hand_at(0, hand_time.back()), 1e-4, 5e-4, &random));
  }
  for (int i = 0; i < 500; ++i) {
    camera_time.push_back(7.0 + i / 30.0);  // t_hand = t_camera + 94.037
    const Eigen::Isometry3d A = hand_at(same ? 0 : 1, camera_time.back() + 94.037);
    board.push_back(disturbed(predicted_board(s.X, A, s.Y), 5e-4, rotation_noise, &random));
  }
  return handeye_clock(hand_time, hand, camera_time, board, s.setup, 120.0);
}

}  // namespace

TEST_CASE("noisy orientations are smoothed until they show the offset, and two motions are not taken for one") {
  int found = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 8); ++seed)
    for (const double noise : {0.002, 0.01, 0.03}) {
      CAPTURE(seed);
      CAPTURE(noise);
      const ClockOffset c = clock_of_noisy_boards(seed, noise, true);
      if (c.found) CHECK(std::abs(c.offset - 94.037) < 5.0 * c.sigma);
      found += c.found, ++count;
      CHECK_FALSE(clock_of_noisy_boards(seed, noise, false).found);
    }
  CHECK(found >= count - 2);  // slow turning that nearly repeats is refused
}

TEST_CASE("with the robot's kinematics a wrong link is found, and the camera with it") {
  for (const HandEyeSetup setup : kSetups) {
    Robot nominal;
    nominal.convention = Convention::dh;
    const double a[6] = {0.15, 0.6, 0.12, 0.0, 0.0, 0.0}, d[6] = {0.45, 0.0, 0.0, 0.62, 0.0, 0.1},
                 alpha[6] = {-90, 0, -90, 90, -90, 0};
    for (int k = 0; k < 6; ++k) {
      Joint j;
      j.name = "J" + std::to_string(k + 1), j.a = a[k], j.d = d[k], j.alpha = alpha[k] * kDegree;
      if (k == 1) j.theta = -90.0 * kDegree;
      nominal.joints.push_back(j);
    }
    nominal.targets.push_back({"tool", make({0.0, 0.0, 0.05}, {0.0, 0.0, 0.3})});
    Robot real = nominal;
    real.joints[1].a += 0.004, real.joints[2].offset += 0.006, real.joints[3].d -= 0.003;
    Scene s = make_scene(setup, 3, {}, 19);
    s.poses = {};
    Random random(6);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> q(60, 6);
    for (int i = 0; i < 60; ++i) {
      for (int k = 0; k < 6; ++k) q(i, k) = random.uniform(-0.6, 0.6);
      const Eigen::VectorXd reading = q.row(i).transpose();
      s.poses.T_base_hand.push_back(forward_kinematics(nominal, reading).back());
      const Eigen::Isometry3d hand = forward_kinematics(real, reading).back();
      s.poses.T_camera_board.push_back(
          disturbed(predicted_board(s.X, moving_frames({hand}, setup)[0], s.Y), 1e-4, 2e-4, &random));
      s.poses.set.push_back(i % 4 == 0);
    }
    IdentifyOptions fit;
    const HandEyeKinematics k = handeye_with_kinematics(nominal, q, s.poses, options_for(s), fit);
    REQUIRE(k.test_after);
    CHECK(k.test_after->position_rms < 0.15 * k.test_before->position_rms);
    CHECK(k.test_after->position_rms < 4e-4);
    // What the camera sees at the working point is where it is, up to what link parameters can take on themselves:
    // closures say it.
    CHECK(position_error(k.camera.T, s.X) < 3e-3);
    CHECK(k.working_point_covariance.trace() > 0.0);
    CHECK(k.robot.targets[0].T_last_target.isApprox(nominal.targets[0].T_last_target));
  }
}
