// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "math/observability.hpp"
#include "math/random.hpp"
#include "math/registration.hpp"
#include "support/arms.hpp"
#include "support/contains.hpp"

using namespace arms;
using truing::Identification;
using truing::IdentifyOptions;

namespace {

const truing::Parameter& parameter(const Identification& result, const std::string& name) {
  for (const truing::Parameter& p : result.parameters) {
    if (p.name == name) return p;
  }
  throw std::runtime_error("no parameter " + name);
}

/// Median and rms error on fresh poses without noise.
double fresh_rms(const Robot& truth, const Robot& found, unsigned seed) {
  auto table = random_joints(truth, 500, seed);
  const truing::Prediction a = truing::predict(truth, table->data), b = truing::predict(found, table->data);
  return std::sqrt((a.position - b.position).rowwise().squaredNorm().mean());
}

std::string complaint(const Robot& robot, const Measurements& data, const IdentifyOptions& options = {}) {
  try {
    truing::identify(robot, data, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// A UR10 wrong by millimetres in an unknown frame, and what a tracker sees of it.
struct Ur10Case {
  Robot nominal = ur10(), truth;
  std::unique_ptr<Table> table;

  /// `wrist`: share of their range that the last three joints use.
  Ur10Case(std::size_t rows, double sigma, unsigned seed, What what = What::position, double wrist = 1.0) {
    truth = perturbed(nominal, 1e-3, 1e-3, seed);
    truth.joints[2].beta = 5e-4;
    truth.joints[3].beta = -7e-4;
    truth.T_measurement_base = somewhere();
    table = random_joints(truth, rows, seed + 1);
    for (std::size_t k = 3; k < 6; ++k) {
      for (double& q : *table->columns[k]) q *= wrist;
    }
    measure(table.get(), truth, what, sigma, seed + 2);
  }
};

}  // namespace

TEST_CASE("without noise the robot is found exactly") {
  for (Robot nominal : {ur10(), palletizer(), rail_arm(), urdf_arm()}) {
    CAPTURE(nominal.name);
    for (const What what : {What::position, What::pose}) {
      Robot truth = perturbed(nominal, 1e-3, 1e-3, 5);
      truth.T_measurement_base = somewhere();
      auto table = random_joints(truth, 200, 6);
      measure(table.get(), truth, what, 0.0, 7);
      const Identification result = truing::identify(nominal, table->data);
      CHECK(result.solver.converged);
      // Directions that only the errors themselves make visible (parallel axes no longer quite parallel) stay at
      // nominal: second order.
      const double second_order = nominal.name == "palletizer" ? 1e-6 : 1e-10;
      CHECK(fresh_rms(truth, result.robot, 8) < second_order);
      CHECK(result.test->after.max < second_order);
      CHECK(result.rejected_rows.empty());
    }
  }
}

TEST_CASE("a UR10 with Hayati terms, unknown base and tool has rank 27, at 200 and at 1000 poses") {
  for (const std::size_t rows : {200u, 1000u}) {
    const Ur10Case c(rows, 3e-5, 11);
    const Identification result = truing::identify(c.nominal, c.table->data);
    CHECK(result.rank == 27);
    CHECK(result.columns == 35);  // 24 link values, 2 beta, 6 base, 3 tool
    CHECK(result.frozen.size() == 8);
    for (const truing::Frozen& f : result.frozen) CHECK(parameter(result, f.parameter).frozen);
  }
}

TEST_CASE("the same arm as joint origins has the same rank") {
  // 6R: 27 observable from positions; 4R arm of origins: 4 * 4 + 6 - 3 = 19.
  Robot truth = perturbed(urdf_arm(), 1e-3, 1e-3, 12);
  truth.T_measurement_base = somewhere();
  auto table = random_joints(truth, 300, 13);
  measure(table.get(), truth, What::position, 1e-5, 14);
  CHECK(truing::identify(urdf_arm(), table->data).rank == 19);
}

TEST_CASE("a frozen combination moves no measurement") {
  const Ur10Case c(300, 0.0, 15);
  const Identification result = truing::identify(c.nominal, c.table->data);
  for (const truing::Frozen& frozen : result.frozen) {
    INFO(frozen.parameter);
    Robot moved = result.before;
    const double step = 1e-6;
    for (const auto& [name, weight] : frozen.combination) {
      const std::string owner = name.substr(0, name.find('.')), value = name.substr(name.find('.') + 1);
      const double delta = step * weight;
      Eigen::Isometry3d* frame = owner == "base"   ? &moved.T_measurement_base
                                 : owner == "tool" ? &moved.targets[0].T_last_target
                                                   : nullptr;
      if (frame) {
        const int axis = value.back() - 'x';
        if (value.size() == 1) {
          frame->translation()[axis] += delta;
        } else {
          frame->linear() = Eigen::AngleAxisd(delta, Eigen::Vector3d::Unit(axis)).toRotationMatrix() * frame->linear();
        }
        continue;
      }
      Joint& joint = moved.joints[moved.joint_index(owner)];
      (value == "theta"   ? joint.theta
       : value == "d"     ? joint.d
       : value == "a"     ? joint.a
       : value == "alpha" ? joint.alpha
                          : joint.beta) += delta;
    }
    CHECK(fresh_rms(result.before, moved, 16) < 2e-3 * step);
  }
}

TEST_CASE("both solvers agree to 1e-9") {
  for (const What what : {What::position, What::pose}) {
    const Ur10Case c(300, 1e-4, 17, what);
    IdentifyOptions options;
    options.loss = truing::Loss::none;
    const Identification lm = truing::identify(c.nominal, c.table->data, options);
    options.solver = truing::Solver::ceres;
    const Identification ceres = truing::identify(c.nominal, c.table->data, options);
    CHECK(ceres.solver.converged);
    for (std::size_t k = 0; k < lm.parameters.size(); ++k) {
      INFO(lm.parameters[k].name);
      CHECK(std::abs(lm.parameters[k].value - ceres.parameters[k].value) < 1e-9);
    }
  }
}

TEST_CASE("both solvers agree under a robust loss") {
  const Ur10Case c(150, 1e-4, 18);
  for (const truing::Loss loss : {truing::Loss::huber, truing::Loss::cauchy, truing::Loss::tukey}) {
    IdentifyOptions options;
    options.loss = loss;
    const Identification lm = truing::identify(c.nominal, c.table->data, options);
    options.solver = truing::Solver::ceres;
    const Identification ceres = truing::identify(c.nominal, c.table->data, options);
    for (std::size_t k = 0; k < lm.parameters.size(); ++k)
      CHECK(std::abs(lm.parameters[k].value - ceres.parameters[k].value) < 1e-3 * lm.noise_sigma + 1e-7);
  }
}

TEST_CASE("bounds are kept") {
  const Ur10Case c(200, 1e-4, 19);
  IdentifyOptions options;
  options.solver = truing::Solver::ceres;
  options.bounds["J3.a"] = {-0.6121, -0.6119};
  const Identification result = truing::identify(c.nominal, c.table->data, options);
  CHECK(parameter(result, "J3.a").value >= -0.6121);
  CHECK(parameter(result, "J3.a").value <= -0.6119);
}

TEST_CASE("priors hold what few poses leave open, both solvers alike, and many poses outvote them") {
  for (const std::size_t poses : {12u, 2000u}) {
    CAPTURE(poses);
    const Ur10Case c(poses, 1e-4, 21);
    IdentifyOptions options;
    options.test_share = 0.0;
    options.loss = truing::Loss::none;
    const Identification free = truing::identify(c.nominal, c.table->data, options);
    options.priors = {{"J*.theta", 1e-4}, {"J*.alpha", 1e-4}, {"J*.a", 1e-4}, {"J*.d", 1e-4}};
    options.prior_noise = 1e-4;
    const Identification held = truing::identify(c.nominal, c.table->data, options);
    options.solver = truing::Solver::ceres;
    const Identification ceres = truing::identify(c.nominal, c.table->data, options);
    double away_free = 0.0, away_held = 0.0;
    for (std::size_t k = 0; k < held.parameters.size(); ++k) {
      const truing::Parameter& p = held.parameters[k];
      CHECK(std::abs(p.value - ceres.parameters[k].value) < 1e-7);
      if (p.frozen || p.name[0] != 'J' || p.name.find(".beta") != std::string::npos) continue;
      away_free += std::pow(free.parameters[k].value - p.nominal, 2.0);
      away_held += std::pow(p.value - p.nominal, 2.0);
    }
    if (poses < 100)
      CHECK(away_held < 0.5 * away_free);
    else
      CHECK(away_held > 0.7 * away_free);
  }
}

TEST_CASE("priors of what is always unknown, of nothing, and without a size are refused") {
  const Ur10Case c(50, 1e-4, 22);
  IdentifyOptions options;
  const auto complaint_about = [&](const std::string& name, double sigma) {
    options.priors = {{name, sigma}};
    return complaint(c.nominal, c.table->data, options);
  };
  CHECK(contains(complaint_about("base.x", 1e-3), "base.x"));
  CHECK(contains(complaint_about("J9.*", 1e-3), "J9.*"));
  CHECK(contains(complaint_about("J2.a", 0.0), "must be finite and positive"));
  CHECK(contains(complaint_about("J2.a", std::numeric_limits<double>::infinity()), "must be finite and positive"));
}

TEST_CASE("priors let fewer values than parameters be fitted, but not fewer than have no prior") {
  const Ur10Case c(8, 1e-4, 24);  // 24 values: fewer than there are parameters
  IdentifyOptions options;
  options.test_share = 0.0;
  options.prior_noise = 1e-4;
  CHECK(contains(complaint(c.nominal, c.table->data, options), "cannot determine"));
  options.priors = {{"J*", 1e-3}};
  const Identification found = truing::identify(c.nominal, c.table->data, options);
  CHECK(found.solver.converged);
  CHECK(fresh_rms(c.truth, found.robot, 25) < fresh_rms(c.truth, found.before, 25));
}

TEST_CASE("links that the rows hardly see stay near the nominal robot, by as much as the others are off") {
  IdentifyOptions freely, options;
  freely.shrink_beyond = std::numeric_limits<double>::infinity();
  freely.test_share = options.test_share = 0.0;
  for (const unsigned seed : {30u, 31u, 32u}) {
    CAPTURE(seed);
    const Ur10Case c(40, 1e-4, seed, What::position, 0.02);  // the wrist nearly at rest
    const Identification free = truing::identify(c.nominal, c.table->data, freely);
    const Identification held = truing::identify(c.nominal, c.table->data, options);
    CHECK(free.shrunk_to == 0.0);
    CHECK(held.shrunk_to > 3e-4);  // of 1e-3
    CHECK(held.shrunk_to < 4e-3);
    CHECK(std::any_of(held.warnings.begin(), held.warnings.end(),
                      [](const std::string& w) { return contains(w, "the rows hardly see some links"); }));
    double runs_away = 0.0, stays = 0.0;
    for (std::size_t k = 0; k < held.parameters.size(); ++k) {
      const truing::Parameter &was = free.parameters[k], &is = held.parameters[k];
      if (is.frozen || is.name[0] != 'J') continue;
      runs_away = std::max(runs_away, std::abs(was.value - was.nominal));
      stays = std::max(stays, std::abs(is.value - is.nominal));
    }
    CHECK(runs_away > 0.02);
    CHECK(stays < 0.01);
    CHECK(fresh_rms(c.truth, held.robot, seed) < 0.2 * fresh_rms(c.truth, free.robot, seed));
    CHECK(fresh_rms(c.truth, held.robot, seed) < fresh_rms(c.truth, held.before, seed));
  }
}

TEST_CASE("links that are farther off than robots are are fitted freely, from near the nominal robot") {
  IdentifyOptions freely, one_fit;
  freely.shrink_beyond = std::numeric_limits<double>::infinity();
  one_fit.resamples = 0;
  double near = 0.0, anywhere = 0.0;  // errors on fresh poses
  for (const unsigned seed : {34u, 35u, 36u, 37u, 38u, 39u}) {
    CAPTURE(seed);
    const Ur10Case c(100, 1e-4, seed, What::position, 0.02);
    Robot other = c.nominal;
    for (const std::size_t k : {1u, 2u, 3u}) {
      other.joints[k].offset += 0.5;
      other.joints[k].a *= 1.5;
      other.joints[k].d += 0.2;
    }
    const Identification found = truing::identify(other, c.table->data, one_fit);
    CHECK(found.shrunk_to == 0.0);
    CHECK(contains(found.warnings.back(), "robots of other values may fit them as well"));
    CHECK(contains(found.warnings.back(), "about this one"));
    CHECK(found.local_sigma == found.covariance.diagonal().cwiseSqrt());
    CHECK(found.test->after.rms < 3e-4);
    for (const truing::Parameter& p : found.parameters) {
      if (!p.frozen && p.name[0] == 'J') CHECK(std::abs(p.value - p.nominal) < 3.2);  // less than half a turn
    }
    near += fresh_rms(c.truth, found.robot, seed);
    anywhere += fresh_rms(c.truth, truing::identify(other, c.table->data, freely).robot, seed);
  }
  CHECK(near < 0.8 * anywhere);
}

TEST_CASE("standard errors of links that are far off are what fits to poses weighed at random scatter by") {
  const Ur10Case c(60, 1e-4, 40, What::position, 0.02);
  Robot other = c.nominal;
  for (const std::size_t k : {1u, 2u, 3u}) other.joints[k].offset += 0.5;
  IdentifyOptions options, one_fit;
  options.resamples = 4;
  one_fit.resamples = 0;
  const Identification found = truing::identify(other, c.table->data, options),
                       alone = truing::identify(other, c.table->data, one_fit);
  CHECK(contains(found.warnings.back(), "what 4 fits to poses weighed at random scatter by"));
  for (std::size_t k = 0; k < found.parameters.size(); ++k)
    CHECK(std::memcmp(&found.parameters[k].value, &alone.parameters[k].value, sizeof(double)) == 0);
  CHECK(found.local_sigma == alone.local_sigma);
  CHECK(found.covariance != alone.covariance);
  Eigen::Index at = 0;
  for (const truing::Parameter& p : found.parameters) {
    if (p.frozen) continue;
    CHECK(p.sigma == std::sqrt(found.covariance(at, at)));
    ++at;
  }
  // Each of the four adds to the squares what it has other values by; the errors about the fit count as one more.
  const Eigen::MatrixXd more = 5.0 * found.covariance - alone.covariance;
  CHECK(more.diagonal().minCoeff() > 0.0);
  CHECK(more.diagonal().cwiseQuotient(alone.covariance.diagonal()).mean() > 4.0 * 0.3);
  options.threads = 1;
  const Identification serial = truing::identify(other, c.table->data, options);
  CHECK(serial.covariance == found.covariance);
  options.resamples = -1;
  CHECK(contains(complaint(c.nominal, c.table->data, options), "resamples must not be negative"));
}

TEST_CASE("where the rows see every link, or somebody knows more of them, nothing is shrunk") {
  const Ur10Case seen(200, 1e-4, 33), hardly(40, 1e-4, 33, What::position, 0.02);
  IdentifyOptions options;
  const Identification found = truing::identify(seen.nominal, seen.table->data, options);
  CHECK(found.shrunk_to == 0.0);
  CHECK(truing::identify(hardly.nominal, hardly.table->data, options).shrunk_to > 0.0);
  options.priors = {{"J5.theta", 1e-2}};
  CHECK(truing::identify(hardly.nominal, hardly.table->data, options).shrunk_to == 0.0);
  options.shrink_beyond = 0.0;
  CHECK(contains(complaint(seen.nominal, seen.table->data, options), "shrink_beyond must be positive"));
}

TEST_CASE("a robot with fitted effects knows the range that they were fitted on") {
  const Ur10Case c(200, 1e-4, 23);
  IdentifyOptions options;
  CHECK(truing::identify(c.nominal, c.table->data, options).robot.fitted_range.empty());
  options.effects = {{"harmonic", {"J2"}}};
  options.test_share = 0.0;
  const truing::Robot robot = truing::identify(c.nominal, c.table->data, options).robot;
  REQUIRE(robot.fitted_range.size() == 6);
  double low = 1e300, high = -1e300;
  for (std::size_t row = 0; row < c.table->data.rows; ++row) {
    low = std::min(low, c.table->data.joints[1][row]);
    high = std::max(high, c.table->data.joints[1][row]);
  }
  CHECK(robot.fitted_range.at("q2") == std::pair{low, high});
}

TEST_CASE("the measurement frame by SVD and as parameters end in the same place") {
  const Ur10Case c(200, 1e-4, 20);
  IdentifyOptions options;
  const Identification by_parameters = truing::identify(c.nominal, c.table->data, options);
  options.frame_by = truing::FrameBy::svd;
  const Identification by_svd = truing::identify(c.nominal, c.table->data, options);
  CHECK(by_svd.solver.converged);
  for (std::size_t k = 0; k < by_svd.parameters.size(); ++k) {
    CHECK(std::abs(by_svd.parameters[k].value - by_parameters.parameters[k].value) < 1e-8);
  }
}

TEST_CASE("the frame by SVD gives the same bits on one and on two threads") {
  const Ur10Case c(10000, 1e-4, 20);
  IdentifyOptions options;
  options.frame_by = truing::FrameBy::svd;
  options.threads = 1;
  const Identification one = truing::identify(c.nominal, c.table->data, options);
  options.threads = 2;
  const Identification two = truing::identify(c.nominal, c.table->data, options);
  for (std::size_t k = 0; k < one.parameters.size(); ++k) CHECK(one.parameters[k].value == two.parameters[k].value);
}

TEST_CASE("a row of weight zero counts for nothing") {
  Ur10Case c(120, 1e-4, 53);
  std::vector<double> weight(120);
  std::vector<std::int8_t> set(120, 0);
  for (std::size_t i = 0; i < 120; ++i) weight[i] = i < 80 ? 1.0 : 0.0;
  c.table->data.set = set;
  c.table->data.weight = c.table->add(weight);
  const Identification with_zeros = truing::identify(c.nominal, c.table->data);
  Ur10Case half(120, 1e-4, 53);
  half.table->data.rows = 80;
  half.table->data.set.assign(80, 0);
  const Identification without = truing::identify(half.nominal, half.table->data);
  for (std::size_t k = 0; k < without.parameters.size(); ++k) {
    CHECK(std::abs(with_zeros.parameters[k].value - without.parameters[k].value) < 1e-9);
    if (!without.parameters[k].frozen)
      CHECK(with_zeros.parameters[k].sigma == doctest::Approx(without.parameters[k].sigma).scale(0).epsilon(1e-6));
  }
}

TEST_CASE("the undamped iteration of the differential error model ends in the same place") {
  const Ur10Case c(200, 1e-4, 21);
  IdentifyOptions options;
  const Identification damped = truing::identify(c.nominal, c.table->data, options);
  options.undamped = true;
  const Identification undamped = truing::identify(c.nominal, c.table->data, options);
  for (std::size_t k = 0; k < damped.parameters.size(); ++k)
    CHECK(std::abs(damped.parameters[k].value - undamped.parameters[k].value) < 1e-9);
}

TEST_CASE("the result does not depend on where the measurement frame stands") {
  Ur10Case c(200, 1e-4, 22);
  const Identification here = truing::identify(c.nominal, c.table->data);
  const Eigen::Isometry3d T = truing::frame_from_xyz_rpy({-5.0, 3.0, 1.0}, {2.0, 0.7, -1.1});
  Table& t = *c.table;
  std::vector<std::vector<double>> moved(3, std::vector<double>(t.data.rows));
  for (std::size_t i = 0; i < t.data.rows; ++i) {
    const Eigen::Vector3d p = T * Eigen::Vector3d(t.data.position[0][i], t.data.position[1][i], t.data.position[2][i]);
    for (std::size_t k = 0; k < 3; ++k) moved[k][i] = p[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k < 3; ++k) t.data.position[k] = t.add(moved[k]);
  const Identification there = truing::identify(c.nominal, t.data);
  CHECK(there.rank == here.rank);
  for (std::size_t k = 0; k < here.parameters.size(); ++k) {
    if (here.parameters[k].name.rfind("base.", 0) == 0) continue;
    INFO(here.parameters[k].name);
    CHECK(std::abs(here.parameters[k].value - there.parameters[k].value) < 1e-9);
    if (!here.parameters[k].frozen)
      CHECK(here.parameters[k].sigma == doctest::Approx(there.parameters[k].sigma).scale(0).epsilon(1e-3));
  }
}

/// What results of many seeds say of their standard errors.
class Scatter {
 public:
  void add(const Identification& result) {
    std::vector<double> fitted;
    for (const truing::Parameter& p : result.parameters) {
      if (!p.frozen) fitted.push_back(p.value);
    }
    values_.push_back(Eigen::Map<Eigen::VectorXd>(fitted.data(), static_cast<Eigen::Index>(fitted.size())));
    variances_.push_back(result.covariance.diagonal());
  }

  /// Standard deviation over the seeds by the standard error, of every parameter that is fitted.
  Eigen::ArrayXd ratio() const {
    const auto seeds = static_cast<double>(values_.size());
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(values_[0].size()), scatter = mean, variance = mean;
    for (const Eigen::VectorXd& v : values_) mean += v / seeds;
    for (const Eigen::VectorXd& v : values_) scatter += (v - mean).cwiseAbs2() / (seeds - 1.0);
    for (const Eigen::VectorXd& v : variances_) variance += v / seeds;
    return (scatter.array() / variance.array()).sqrt();
  }

 private:
  std::vector<Eigen::VectorXd> values_, variances_;
};

TEST_CASE("standard errors match the scatter over 200 seeds within 10 per cent") {
  const double sigma = 5e-5;
  const int seeds = 200;
  const Robot nominal = palletizer();
  Robot truth = perturbed(nominal, 1e-3, 1e-3, 23);
  truth.T_measurement_base = somewhere();
  auto table = random_joints(truth, 80, 24);
  IdentifyOptions options;
  options.test_share = 0.0;
  Scatter scatter;
  for (int seed = 0; seed < seeds; ++seed) {
    measure(table.get(), truth, What::position, sigma, 1000u + static_cast<unsigned>(seed));
    scatter.add(truing::identify(nominal, table->data, options));
  }
  // One ratio scatters by 1/sqrt(400) = 5 per cent itself: 10 per cent for their mean, 20 for each.
  const Eigen::ArrayXd ratio = scatter.ratio();
  CHECK(ratio.mean() == doctest::Approx(1.0).scale(0).epsilon(0.1));
  CHECK(ratio.minCoeff() > 0.8);
  CHECK(ratio.maxCoeff() < 1.2);
}

TEST_CASE("standard errors take repeats of a pose for one observation where the model misses something") {
  // 100 poses, each measured four times: an error of the pose, ten times the noise, that no parameter explains.
  const int seeds = 60, poses = 100, repeats = 4;
  const Robot nominal = palletizer();
  Robot truth = perturbed(nominal, 1e-3, 1e-3, 31);
  truth.T_measurement_base = somewhere();
  IdentifyOptions options;
  options.test_share = 0.0;
  options.loss = truing::Loss::none;
  Scatter scatter;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    auto table = random_joints(truth, poses, 3200 + seed);
    truing::math::Random random(3300 + seed);
    measure(table.get(), truth, What::position, 0.0, 1);
    auto repeated = std::make_unique<Table>(static_cast<std::size_t>(poses * repeats));
    const auto repeat = [&](const truing::Column& column) {
      std::vector<double> out;
      for (int i = 0; i < poses; ++i) out.insert(out.end(), repeats, column[static_cast<std::size_t>(i)]);
      return out;
    };
    for (const truing::Column& joint : table->data.joints)
      repeated->data.joints.push_back(repeated->add(repeat(joint)));
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<double> position = repeat(table->data.position[k]);
      for (std::size_t i = 0; i < static_cast<std::size_t>(poses); ++i) {
        const double of_pose = 5e-4 * random.normal();
        for (std::size_t r = 0; r < static_cast<std::size_t>(repeats); ++r)
          position[repeats * i + r] += of_pose + 5e-5 * random.normal();
      }
      repeated->data.position[k] = repeated->add(position);
    }
    scatter.add(truing::identify(nominal, repeated->data, options));
  }
  // Taken for 400 rows the standard errors would be half of the scatter.
  const Eigen::ArrayXd ratio = scatter.ratio();
  CHECK(ratio.mean() > 0.85);
  CHECK(ratio.mean() < 1.2);
}

TEST_CASE("standard errors of few poses match the scatter, also where some poses are off") {
  // 21 parameters: fewer than two poses for each. Off is every fifth pose, by ten times the noise.
  const int seeds = 200;
  const Robot nominal = palletizer();
  Robot truth = perturbed(nominal, 1e-3, 1e-3, 33);
  truth.T_measurement_base = somewhere();
  IdentifyOptions options;
  options.test_share = 0.0;
  options.loss = truing::Loss::none;
  for (const std::size_t poses : {std::size_t{22}, std::size_t{30}}) {
    for (const bool off : {false, true}) {
      Scatter scatter;
      for (unsigned seed = 0; seed < seeds; ++seed) {
        auto table = random_joints(truth, poses, 34 + seed);
        measure(table.get(), truth, What::position, 5e-5, 5000 + seed);
        truing::math::Random random(6000 + seed);
        for (std::size_t k = 0; k < 3; ++k) {
          std::vector<double> position;
          for (std::size_t i = 0; i < poses; ++i)
            position.push_back(table->data.position[k][i] + (off && i % 5 == 0 ? 5e-4 * random.normal() : 0.0));
          table->data.position[k] = table->add(position);
        }
        scatter.add(truing::identify(nominal, table->data, options));
      }
      const Eigen::ArrayXd ratio = scatter.ratio();
      CHECK(ratio.mean() == doctest::Approx(1.0).scale(0).epsilon(0.07));
      CHECK(ratio.minCoeff() > 0.8);
      CHECK(ratio.maxCoeff() < 1.2);
    }
  }
}

TEST_CASE("standard errors of poses match the scatter, whatever weight rotations are given") {
  const int seeds = 200;
  const Robot nominal = rail_arm();
  Robot truth = perturbed(nominal, 1e-3, 1e-3, 25);
  truth.T_measurement_base = somewhere();
  auto table = random_joints(truth, 60, 26);
  IdentifyOptions options;
  options.test_share = 0.0;
  options.rotation_length = 0.3;
  std::vector<double> values;
  double variance = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    measure(table.get(), truth, What::pose, 1e-4, 3000u + static_cast<unsigned>(seed));
    const Identification result = truing::identify(nominal, table->data, options);
    const truing::Parameter& p = parameter(result, "J2.alpha");
    REQUIRE(!p.frozen);
    values.push_back(p.value);
    variance += p.sigma * p.sigma / seeds;
    if (seed == 0) {
      CHECK(result.noise_sigma == doctest::Approx(1e-4).scale(0).epsilon(0.15));
      CHECK(result.rotation_noise_sigma == doctest::Approx(2e-4).scale(0).epsilon(0.15));
    }
  }
  double mean = 0.0, scatter = 0.0;
  for (const double v : values) mean += v / seeds;
  for (const double v : values) scatter += (v - mean) * (v - mean) / (seeds - 1);
  CHECK(std::sqrt(scatter / variance) == doctest::Approx(1.0).scale(0).epsilon(0.15));
}

TEST_CASE("two per cent of gross outliers change nothing and are listed") {
  const Ur10Case clean(1000, 3e-5, 27);
  Ur10Case dirty(1000, 3e-5, 27);
  std::mt19937_64 random(28);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<double> x(1000);
  std::vector<std::size_t> bad;
  for (std::size_t i = 0; i < 1000; ++i) {
    x[i] = dirty.table->data.position[0][i];
    if (i % 50 == 7) {
      x[i] += 5e-3 * (normal(random) > 0 ? 1 : -1);
      bad.push_back(i);
    }
  }
  dirty.table->data.position[0] = dirty.table->add(x);
  IdentifyOptions options;
  options.test_share = 0.0;
  const Identification with = truing::identify(dirty.nominal, dirty.table->data, options);
  const Identification without = truing::identify(clean.nominal, clean.table->data, options);
  CHECK(with.rejected_rows == bad);
  CHECK(fresh_rms(clean.truth, with.robot, 29) < 1.1 * fresh_rms(clean.truth, without.robot, 29));
}

/// A column with `by` added to one row.
truing::Column with_spike(Table* table, const truing::Column& column, std::size_t row, double by) {
  std::vector<double> values(table->data.rows);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = column[i];
  values[row] += by;
  return table->add(values);
}

TEST_CASE("one spike, or one row in twenty, of any size changes nothing and is listed") {
  const Ur10Case clean(300, 3e-5, 28);
  IdentifyOptions options;
  options.test_share = 0.0;
  const Identification without = truing::identify(clean.nominal, clean.table->data, options);
  for (const std::size_t every : {300u, 20u}) {
    for (const double size : {0.1, 1.0, 30.0, 1000.0, 5e5}) {
      CAPTURE(every);
      CAPTURE(size);
      Ur10Case dirty(300, 3e-5, 28);
      std::vector<std::size_t> bad;
      for (std::size_t row = 7; row < 300; row += every) {
        truing::Column& column = dirty.table->data.position[row % 3];
        column = with_spike(dirty.table.get(), column, row, row % 2 ? size : -size);
        bad.push_back(row);
      }
      const Identification with = truing::identify(dirty.nominal, dirty.table->data, options);
      CHECK(with.solver.converged);
      CHECK(with.rejected_rows == bad);
      CHECK(fresh_rms(clean.truth, with.robot, 29) < 1.1 * fresh_rms(clean.truth, without.robot, 29));
    }
  }
}

TEST_CASE("a spike of a wire's length does not carry its anchor away") {
  const Robot nominal = ur10();
  Robot truth = perturbed(nominal, 5e-4, 5e-4, 38);
  truth.anchor = truing::Anchor{{1.2, -0.8, 0.1}, 0.25};
  for (const double spike : {10.0, -3.0, 1000.0}) {
    CAPTURE(spike);
    auto table = random_joints(truth, 400, 39);
    measure(table.get(), truth, What::distance, 2e-5, 40);
    table->data.distance = with_spike(table.get(), table->data.distance, 11, spike);
    IdentifyOptions options;
    options.test_share = 0.0;
    const Identification found = truing::identify(nominal, table->data, options);
    CHECK(found.rejected_rows == std::vector<std::size_t>{11});
    CHECK(found.train.after.rms < 4e-5);
  }
}

TEST_CASE("the palletizer's eighteen parameters are found to the noise floor from 50 planned poses") {
  const Robot nominal = palletizer();
  Robot truth = nominal;  // an arm wrong by millimetres, with gear ratios and zeros off
  const double ratio[4] = {1.0004, 0.9997, 1.0005, 1.0}, zero[4] = {0.001, -0.002, 0.0015, 0.0};
  const int driven[4] = {0, 1, 2, 4};
  for (int k = 0; k < 4; ++k) {
    truth.joints[driven[k]].ratio = ratio[k];
    truth.joints[driven[k]].offset = zero[k];
  }
  truth.joints[0].a += 1.2e-3;
  truth.joints[1].a -= 1.5e-3;
  truth.joints[2].a += 2.0e-3;
  truth.joints[3].a -= 0.8e-3;
  truth.T_measurement_base = somewhere();
  truing::PlanOptions plan_options;
  plan_options.free = {"J1.a",      "J2.a",      "J3.a",      "J4.a",      "J1.d",   "J4.d",   "J5.d",  "*.ratio",
                       "J1.offset", "J2.offset", "J3.offset", "J5.offset", "tool.x", "tool.y", "tool.z"};
  plan_options.seed = 30;
  plan_options.proposals = 16;
  plan_options.sweeps = 2;
  const truing::PlanResult plan = truing::plan(nominal, plan_options);
  REQUIRE(plan.joints.rows() == 50);
  CHECK(plan.index_end > plan.index_start);
  for (Eigen::Index i = 1; i < 50; ++i)
    CHECK((plan.joints.row(i) - plan.joints.row(i - 1)).cwiseAbs().minCoeff() > plan_options.min_step);

  Table table(50);
  for (int k = 0; k < 4; ++k) {
    std::vector<double> q(50);
    for (int i = 0; i < 50; ++i) q[static_cast<std::size_t>(i)] = plan.joints(i, k);
    table.data.joints.push_back(table.add(q));
  }
  const double sigma = 5e-5;
  measure(&table, truth, What::position, sigma, 31);
  IdentifyOptions options;
  options.free = plan_options.free;
  options.test_share = 0.0;
  const Identification result = truing::identify(nominal, table.data, options);
  CHECK(result.columns == 18 + 6);
  CHECK(result.frozen.size() >=
        3);  // d1 and J1's zero are the base's; among the tool, d4, d5, a4 and joint 5's zero one is not seen
  CHECK(result.noise_sigma == doctest::Approx(sigma).scale(0).epsilon(0.25));
  CHECK(fresh_rms(truth, result.robot, 32) < 2.0 * sigma);
  CHECK(fresh_rms(truth, result.before, 32) > 1e-3);
  CHECK(fresh_rms(truth, result.robot, 32) < 5e-4);
  // What the plan promised is what the fit found.
  for (const truing::Parameter& promised : plan.parameters) {
    for (const truing::Parameter& found : result.parameters) {
      if (found.name == promised.name && !found.frozen && found.name.rfind("base.r", 0) != 0) {
        INFO(found.name);
        CHECK(found.sigma ==
              doctest::Approx(promised.sigma * sigma / plan_options.position_sigma).scale(0).epsilon(0.4));
      }
    }
  }
}

TEST_CASE("effects are found beside the geometry") {
  Robot nominal = ur10(), truth = perturbed(nominal, 5e-4, 5e-4, 33);
  truth.joints[0] = nominal.joints[0];  // a tilt of the first axis is the base's to the eye, but not to gravity
  truth.T_measurement_base = somewhere();
  truth.effects = {{"backlash", {"J2"}, {{"backlash.J2", 3e-4}}},
                   {"harmonic",
                    {"J3"},
                    {{"harmonic.J3.cos1", 2e-4},
                     {"harmonic.J3.sin1", -1e-4},
                     {"harmonic.J3.cos2", 0.0},
                     {"harmonic.J3.sin2", 1e-4}}},
                   {"joint_compliance", {"J2", "J3"}, {{"joint_compliance.J2", 2e-6}, {"joint_compliance.J3", 5e-6}}}};
  auto table = random_joints(truth, 400, 34);
  std::mt19937_64 random(35);
  for (int k = 0; k < 6; ++k) {
    std::vector<double> dir(400);
    for (double& d : dir) d = random() & 1 ? 1.0 : -1.0;
    table->data.direction.push_back(table->add(dir));
  }
  std::vector<double> payload(400);
  for (double& m : payload) m = random() & 1 ? 10.0 : 0.0;
  table->data.payload = table->add(payload);
  measure(table.get(), truth, What::position, 0.0, 36);
  IdentifyOptions options;
  options.effects = {{"backlash", {"J2"}}, {"harmonic", {"J3"}}, {"joint_compliance", {"J2", "J3"}}};
  const Identification result = truing::identify(nominal, table->data, options);
  CHECK(result.test->after.max < 1e-8);
  CHECK(parameter(result, "backlash.J2").value == doctest::Approx(3e-4).scale(0).epsilon(1e-5));
  CHECK(parameter(result, "harmonic.J3.sin2").value == doctest::Approx(1e-4).scale(0).epsilon(1e-5));
  CHECK(parameter(result, "joint_compliance.J3").value == doctest::Approx(5e-6).scale(0).epsilon(1e-4));
  // The calibrated robot carries them: predicting with it gives the same residuals.
  const truing::Residuals again = truing::residuals(result.robot, table->data);
  CHECK(again.position.rowwise().norm().maxCoeff() < 1e-8);
}

TEST_CASE("an effect of the caller's own may put one parameter on several sites") {
  truing::Effect lag;
  lag.name = "lag";
  lag.terms = [](const Robot& robot, std::size_t joint, const Measurements&) {
    return std::vector<truing::Term>{
        {"lag.all", "s", robot.joints[joint].name,
         [joint](const truing::Inputs& in) { return std::cos(3.0 * in.joints[static_cast<Eigen::Index>(joint)]); },
         false}};
  };
  Robot nominal = ur10(), truth = nominal;
  truth.T_measurement_base = somewhere();
  truth.effects = {{"lag", {"J2", "J3"}, {{"lag.all", 2e-3}}}};
  auto table = random_joints(truth, 200, 37);
  const truing::Prediction p = truing::predict(truth, table->data, {lag});
  for (int k = 0; k < 3; ++k) {
    std::vector<double> x(200);
    for (Eigen::Index i = 0; i < 200; ++i) x[static_cast<std::size_t>(i)] = p.position(i, k);
    table->data.position[static_cast<std::size_t>(k)] = table->add(x);
  }
  IdentifyOptions options;
  options.own_effects = {lag};
  options.effects = {{"lag", {"J2", "J3"}}};
  const Identification result = truing::identify(nominal, table->data, options);
  CHECK(parameter(result, "lag.all").value == doctest::Approx(2e-3).scale(0).epsilon(1e-6));
}

TEST_CASE("a wire's length alone finds anchor, zero and links") {
  Robot nominal = ur10(), truth = perturbed(nominal, 5e-4, 5e-4, 38);
  truth.anchor = truing::Anchor{{1.2, -0.8, 0.1}, 0.25};
  auto table = random_joints(truth, 600, 39);
  measure(table.get(), truth, What::distance, 0.0, 40);
  const Identification result = truing::identify(nominal, table->data);
  CHECK(result.test->after.max < 1e-9);
  CHECK(parameter(result, "anchor.zero").value == doctest::Approx(0.25).scale(0).epsilon(1e-3));
}

TEST_CASE("touching fixed points finds the arm up to its scale") {
  // A 4R arm touches each of three points in many configurations, found by damped steps from random joints.
  Robot nominal = ur10(), truth = perturbed(nominal, 5e-4, 5e-4, 41);
  std::mt19937_64 random(42);
  std::vector<std::vector<double>> q(6);
  std::vector<std::int32_t> point;
  const Eigen::Vector3d points[3] = {{0.5, 0.2, 0.3}, {0.3, -0.5, 0.2}, {-0.4, 0.4, 0.5}};
  while (point.size() < 150) {
    const Eigen::Vector3d goal = points[point.size() % 3];
    Eigen::VectorXd x(6);
    for (double& v : x) v = 4.0 * (static_cast<double>(random() >> 11) * 0x1.0p-53 - 0.5);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d p = truing::forward_kinematics(truth, x).back().translation();
      Eigen::Matrix<double, 3, 6> j;
      for (int k = 0; k < 6; ++k) {
        Eigen::VectorXd y = x;
        y[k] += 1e-7;
        j.col(k) = (truing::forward_kinematics(truth, y).back().translation() - p) / 1e-7;
      }
      x += j.transpose() * (j * j.transpose() + 1e-6 * Eigen::Matrix3d::Identity()).ldlt().solve(goal - p);
    }
    if ((truing::forward_kinematics(truth, x).back().translation() - goal).norm() > 1e-12) continue;
    for (int k = 0; k < 6; ++k) q[static_cast<std::size_t>(k)].push_back(x[k]);
    point.push_back(static_cast<std::int32_t>(point.size() % 3));
  }
  Table table(point.size());
  for (int k = 0; k < 6; ++k) table.data.joints.push_back(table.add(q[static_cast<std::size_t>(k)]));
  table.data.fixed_point = point;
  table.data.fixed_point_names = {"a", "b", "c"};
  const Identification result = truing::identify(nominal, table.data);
  CHECK(result.test->after.max < 1e-8);
  CHECK(result.test->before.max > 1e-4);
  bool said = false;
  for (const truing::Frozen& f : result.frozen) said = said || f.why.find("scale") != std::string::npos;
  CHECK(said);
  CHECK(parameter(result, "J3.a").frozen);
  // Up to scale: the other long link is right relative to the one held.
  CHECK(parameter(result, "J4.a").value / parameter(result, "J3.a").value ==
        doctest::Approx(truth.joints[3].a / truth.joints[2].a).scale(0).epsilon(1e-6));
}

TEST_CASE("orientation may be missing on some rows, and rows may carry sigmas and weights") {
  Ur10Case c(200, 1e-5, 43, What::pose);
  std::vector<double> q[4], sigma(200), turn(200);
  for (int k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < 200; ++i)
      q[k].push_back(i % 3 ? c.table->data.orientation[static_cast<std::size_t>(k)][i] : std::nan(""));
  }
  for (int k = 0; k < 4; ++k) c.table->data.orientation[static_cast<std::size_t>(k)] = c.table->add(q[k]);
  const Identification plain = truing::identify(c.nominal, c.table->data);
  CHECK(fresh_rms(c.truth, plain.robot, 44) < 3e-5);
  for (std::size_t i = 0; i < 200; ++i) {
    sigma[i] = 1e-5;
    turn[i] = 2e-5;
  }
  c.table->data.position_sigma = c.table->add(sigma);
  c.table->data.rotation_sigma = c.table->add(turn);
  const Identification weighted = truing::identify(c.nominal, c.table->data);
  CHECK(fresh_rms(c.truth, weighted.robot, 44) < 3e-5);
  CHECK(weighted.noise_sigma == doctest::Approx(plain.noise_sigma).scale(0).epsilon(0.1));
}

TEST_CASE("several targets on the tool are found together") {
  Robot nominal = ur10();
  nominal.targets.push_back({"smr1", Eigen::Isometry3d::Identity()});
  Robot truth = perturbed(nominal, 1e-3, 1e-3, 45);
  truth.targets[1].T_last_target.translation() = Eigen::Vector3d(0.1, 0.05, -0.02);
  truth.T_measurement_base = somewhere();
  auto table = random_joints(truth, 200, 46);
  for (std::size_t i = 0; i < 200; ++i) table->data.target.push_back(static_cast<std::int32_t>(i % 2));
  measure(table.get(), truth, What::position, 0.0, 47);
  const Identification result = truing::identify(nominal, table->data);
  CHECK(result.test->after.max < 1e-10);
  // Places on the tool are seen up to a turn about the last axis and a shift along it, which the last link shares:
  // their distance is seen.
  const auto gap = [](const Robot& r) {
    return (r.targets[1].T_last_target.translation() - r.targets[0].T_last_target.translation()).norm();
  };
  CHECK(gap(result.robot) == doctest::Approx(gap(truth)).scale(0).epsilon(1e-8));
}

TEST_CASE("a tool that is not asked for keeps its orientation") {
  const Ur10Case c(100, 0.0, 52, What::pose);
  IdentifyOptions options;
  options.free = {"J2.theta"};
  const Identification result = truing::identify(c.nominal, c.table->data, options);
  CHECK(result.robot.targets[0].T_last_target.matrix() == c.nominal.targets[0].T_last_target.matrix());
}

TEST_CASE("pose groups stay together, and the split depends on the seed alone") {
  Ur10Case c(100, 1e-4, 48);
  for (std::size_t i = 0; i < 100; ++i) c.table->data.pose.push_back(static_cast<std::int32_t>(i / 5));
  IdentifyOptions options;
  options.free = {"tool.*"};
  const Identification a = truing::identify(c.nominal, c.table->data, options),
                       b = truing::identify(c.nominal, c.table->data, options);
  CHECK(a.set == b.set);
  for (std::size_t i = 0; i < 100; ++i) CHECK(a.set[i] == a.set[i - i % 5]);
  CHECK(std::count(a.set.begin(), a.set.end(), 1) == 20);
  options.seed = 1;
  CHECK(truing::identify(c.nominal, c.table->data, options).set != a.set);
}

TEST_CASE("what cannot be identified is refused with a reason") {
  const Ur10Case few(6, 0.0, 49);
  IdentifyOptions options;
  options.test_share = 0.0;
  CHECK(complaint(few.nominal, few.table->data, options).find("cannot determine") != std::string::npos);
  Ur10Case same(50, 0.0, 50);
  for (Column& column : same.table->data.joints) column = same.table->add(std::vector<double>(50, 0.3));
  CHECK(complaint(same.nominal, same.table->data).find("one pose") != std::string::npos);
  const Ur10Case c(50, 0.0, 51);
  options.free = {"J9.a"};
  CHECK(complaint(c.nominal, c.table->data, options).find("no parameter matches 'J9.a'") != std::string::npos);
  options.free = {};
  options.bounds["J2.a"] = {0, 1};
  CHECK(complaint(c.nominal, c.table->data, options).find("ceres") != std::string::npos);
}

TEST_CASE("a joint column that makes no sense is suspected aloud") {
  Ur10Case c(100, 1e-5, 54);
  std::swap(c.table->data.joints[1], c.table->data.joints[2]);
  bool said = false;
  for (const std::string& w : truing::identify(c.nominal, c.table->data).warnings)
    said = said || w.find("is a joint column wrong") != std::string::npos;
  CHECK(said);
}

TEST_CASE("rank counts what a Gram can tell") {
  Eigen::MatrixXd j = Eigen::MatrixXd::Random(50, 5);
  j.col(4) = 2.0 * j.col(0) - j.col(2);
  const truing::math::Rank rank = truing::math::find_rank(j.transpose() * j, {0, 0, 0, 0, 1}, 1e-6);
  CHECK(rank.kept == std::vector<int>{0, 1, 2, 3});
  REQUIRE(rank.frozen == std::vector<int>{4});
  CHECK(rank.combination(0, 0) == doctest::Approx(2.0));
  CHECK(rank.combination(2, 0) == doctest::Approx(-1.0));
  CHECK(rank.combination(1, 0) == 0.0);
}

TEST_CASE("registration finds the frame between two sets of points, never a reflection") {
  const Eigen::Isometry3d T = somewhere();
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 10);
  points.row(2).setZero();  // a plane: the reflection fits as well
  const Eigen::Isometry3d found = truing::math::register_points(points, T * points);
  CHECK(found.isApprox(T, 1e-12));
  CHECK(found.linear().determinant() == doctest::Approx(1.0));
}
