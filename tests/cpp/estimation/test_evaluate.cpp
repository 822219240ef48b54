// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The kernel and what feeds it: against the plain forward kinematics, against central differences, copy against copy.

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>

#include <Eigen/Eigenvalues>

#include "estimation/clustered.hpp"
#include "estimation/evaluate.hpp"
#include "support/arms.hpp"

using namespace arms;
using namespace truing::estimation;
using truing::kernel::Functions;

namespace {

std::vector<std::int32_t> all_rows(const Measurements& data) {
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

std::vector<int> all_parameters(const Model& model) {
  std::vector<int> free(model.parameters.size());
  std::iota(free.begin(), free.end(), 0);
  return free;
}

/// Residual and dense Jacobian of all rows, in order of tiles.
void dense(const Evaluator& evaluator, const Eigen::VectorXd& values, const Weighing& weighing, Eigen::VectorXd* r,
           Eigen::MatrixXd* j) {
  const auto p = static_cast<Eigen::Index>(evaluator.free().size());
  r->resize(static_cast<Eigen::Index>(evaluator.components()));
  if (j) j->resize(r->size(), p);
  Eigen::Index at = 0;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    const Eigen::Index n = evaluator.tile_rows(tile) * evaluator.tile_components(tile);
    Eigen::VectorXd tile_r(n);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> tile_j(n, p);
    evaluator.tile(tile, values, weighing, tile_r.data(), j ? tile_j.data() : nullptr);
    r->segment(at, n) = tile_r;
    if (j) j->middleRows(at, n) = tile_j;
    at += n;
  }
}

const std::vector<truing::EffectRequest> kEffects = {{"backlash", {}}, {"harmonic", {}}, {"joint_compliance", {}}};

std::vector<truing::EffectRequest> effects_for(const Robot& robot) {
  return robot.joints[0].mass ? kEffects : std::vector<truing::EffectRequest>{{"backlash", {}}, {"harmonic", {}}};
}

void add_directions(Table* table, unsigned seed) {
  std::mt19937_64 random(seed);
  for (std::size_t k = 0; k < table->data.joints.size(); ++k) {
    std::vector<double> dir(table->data.rows);
    for (double& d : dir) d = random() & 1 ? 1.0 : -1.0;
    table->data.direction.push_back(table->add(dir));
  }
}

/// Columns of every parameter of `near` with `effects`, against central differences.
void check_columns(const Robot& near, const Measurements& data, const std::vector<truing::EffectRequest>& effects) {
  const Model model = make_model(near, data, effects);
  const auto bases = make_bases(model, data);
  const Evaluator evaluator(model, data, bases, make_segments(data, all_rows(data)), all_parameters(model), 1);
  Eigen::VectorXd values = initial_values(model);
  for (Eigen::Index k = 0; k < values.size(); ++k) {  // effects and orientation corrections away from zero
    const bool per_torque = model.parameters[static_cast<std::size_t>(k)].unit.find("Nm") != std::string::npos;
    if (values[k] == 0.0) values[k] = (per_torque ? 1e-7 : 1e-3) * static_cast<double>(k % 7 - 3);
  }
  Weighing weighing;
  Eigen::VectorXd r, plus, minus;
  Eigen::MatrixXd j;
  dense(evaluator, values, weighing, &r, &j);
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const bool per_torque =
        model.parameters[k].unit.find("Nm") != std::string::npos;  // torques are up to thousands of Nm
    const double step = per_torque ? 1e-8 : 1e-5;
    Eigen::VectorXd moved = values;
    moved[static_cast<Eigen::Index>(k)] += step;
    dense(evaluator, moved, weighing, &plus, nullptr);
    moved[static_cast<Eigen::Index>(k)] -= 2.0 * step;
    dense(evaluator, moved, weighing, &minus, nullptr);
    const Eigen::VectorXd difference = (plus - minus) / (2.0 * step);
    const double size = std::max(1.0, difference.cwiseAbs().maxCoeff());
    INFO(model.parameters[k].name);
    CHECK((difference - j.col(static_cast<Eigen::Index>(k))).cwiseAbs().maxCoeff() < (per_torque ? 2e-7 : 2e-8) * size);
  }
}

void check_jacobian(const Robot& robot, What what, unsigned seed) {
  CAPTURE(robot.name);
  CAPTURE(static_cast<int>(what));
  Robot truth = robot;
  truth.T_measurement_base = somewhere();
  truth.anchor = truing::Anchor{{1.0, 2.0, -0.5}, 0.3};
  auto table = random_joints(truth, 70, seed);  // one full tile and a part of another
  add_directions(table.get(), seed + 1);
  measure(table.get(), truth, what, 0.0, seed + 2);
  check_columns(perturbed(truth, 1e-3, 1e-3, seed + 3), table->data, effects_for(robot));
}

}  // namespace

TEST_CASE("predictions equal the plain forward kinematics") {
  for (Robot robot : {ur10(), palletizer(), rail_arm(), urdf_arm()}) {
    CAPTURE(robot.name);
    robot.T_measurement_base = somewhere();
    robot.joints[1].ratio = 1.001;
    robot.joints[1].offset = 0.02;
    robot.joints[2].beta = robot.convention == Convention::urdf ? 0.0 : 0.01;
    const auto table = random_joints(robot, 101, 11);
    const truing::Prediction p = truing::predict(robot, table->data);
    for (std::size_t row = 0; row < table->data.rows; ++row) {
      Eigen::VectorXd q(static_cast<Eigen::Index>(table->data.joints.size()));
      for (Eigen::Index k = 0; k < q.size(); ++k) q[k] = table->data.joints[static_cast<std::size_t>(k)][row];
      const Eigen::Isometry3d T = truing::forward_kinematics(robot, q).back();
      const auto i = static_cast<Eigen::Index>(row);
      CHECK((p.position.row(i).transpose() - T.translation()).norm() < 2e-15 * 20);
      const Eigen::Quaterniond expected(T.rotation()),
          got(p.orientation(i, 0), p.orientation(i, 1), p.orientation(i, 2), p.orientation(i, 3));
      CHECK(expected.angularDistance(got) < 1e-7);
    }
  }
}

TEST_CASE("the Jacobian of every parameter and effect agrees with central differences") {
  for (const Robot& robot : {ur10(), palletizer(), rail_arm(), urdf_arm()}) {
    check_jacobian(robot, What::position, 21);
    check_jacobian(robot, What::pose, 22);
    check_jacobian(robot, What::distance, 23);
  }
}

TEST_CASE("an effect on the targets has a column that is right for the rows of each") {
  for (const What what : {What::position, What::pose}) {
    Robot truth = ur10();
    truth.targets.push_back({"elbow", truing::frame_from_xyz_rpy({0.2, 0.1, -0.3}, {0.4, 0.5, 0.6})});
    truth.T_measurement_base = somewhere();
    auto table = random_joints(truth, 80, 24);
    for (std::int32_t row = 0; row < 80; ++row) table->data.target.push_back(row % 2);
    measure(table.get(), truth, what, 0.0, 25);
    check_columns(perturbed(truth, 1e-3, 1e-3, 26), table->data, {{"scale", {}}});
  }
}

TEST_CASE("a passive joint inherits the corrections of its drivers") {
  const Robot robot = palletizer();
  const auto table = random_joints(robot, 5, 31);
  const Model model = make_model(robot, table->data);
  // k2 and the zero of joint 2 act through A2 and, with opposite sign, through A4.
  for (const char* name : {"J2.ratio", "J2.offset"}) {
    const ParameterInfo& info = model.parameters[model.parameter_index(name)];
    REQUIRE(info.columns.size() == 1);
    CHECK(info.columns[0].sites.size() == 2);
    CHECK(info.columns[0].sites[0].second == 1.0);
    CHECK(info.columns[0].sites[1].second == -1.0);
  }
}

TEST_CASE("residuals are zero at the truth") {
  for (Robot truth : {ur10(), palletizer(), rail_arm(), urdf_arm()}) {
    truth.T_measurement_base = somewhere();
    truth.anchor = truing::Anchor{{1.0, 2.0, -0.5}, 0.3};
    for (const What what : {What::position, What::pose, What::distance}) {
      auto table = random_joints(truth, 60, 41);
      measure(table.get(), truth, what, 0.0, 1);
      const truing::Residuals r = truing::residuals(truth, table->data);
      if (what == What::distance) {
        CHECK(r.distance.cwiseAbs().maxCoeff() < 1e-14);
      } else {
        CHECK(r.position.cwiseAbs().maxCoeff() < 1e-14);
      }
      if (what == What::pose) CHECK(r.rotation.cwiseAbs().maxCoeff() < 1e-14);
    }
  }
}

TEST_CASE("one and two threads give the same bits") {
  Robot truth = ur10();
  auto table = random_joints(truth, 20000, 51);
  measure(table.get(), truth, What::position, 1e-4, 52);
  const Model model = make_model(truth, table->data);
  const auto bases = make_bases(model, table->data);
  NormalEquations one, two;
  for (const int threads : {1, 2}) {
    const Evaluator evaluator(model, table->data, bases, make_segments(table->data, all_rows(table->data)),
                              all_parameters(model), threads);
    evaluator.normal_equations(initial_values(model), Weighing{}, threads == 1 ? &one : &two);
  }
  CHECK(one.gram == two.gram);
  CHECK(one.gradient == two.gradient);
  CHECK(one.cost == two.cost);
}

TEST_CASE("the streamed Gram equals the dense product") {
  Robot truth = palletizer();
  auto table = random_joints(truth, 500, 61);
  add_directions(table.get(), 62);
  measure(table.get(), truth, What::pose, 1e-4, 63);
  const Model model = make_model(truth, table->data, kEffects);
  const auto bases = make_bases(model, table->data);
  const Evaluator evaluator(model, table->data, bases, make_segments(table->data, all_rows(table->data)),
                            all_parameters(model), 1);
  for (const auto loss : {truing::kernel::RowLoss::none, truing::kernel::RowLoss::huber,
                          truing::kernel::RowLoss::cauchy, truing::kernel::RowLoss::tukey}) {
    Weighing weighing;
    weighing.loss = loss;
    weighing.loss_scale = 2e-4;
    NormalEquations normal;
    evaluator.normal_equations(initial_values(model), weighing, &normal);
    Eigen::VectorXd r;
    Eigen::MatrixXd j;
    dense(evaluator, initial_values(model), weighing, &r, &j);
    const Eigen::MatrixXd gram = j.transpose() * j;
    CHECK((normal.gram - gram).cwiseAbs().maxCoeff() < 1e-12 * gram.cwiseAbs().maxCoeff());
    CHECK((normal.gradient - j.transpose() * r).cwiseAbs().maxCoeff() < 1e-12 * gram.cwiseAbs().maxCoeff());
    CHECK(normal.squares == doctest::Approx(r.squaredNorm()).scale(0).epsilon(1e-12));
  }
}

/// sum over clusters of g g^T / (1 - h), by the dense Jacobian of rows with `components` values each.
Eigen::MatrixXd scores_by_hand(const Eigen::MatrixXd& j, const Eigen::VectorXd& r, int components,
                               const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster) {
  const auto clusters = *std::max_element(cluster.begin(), cluster.end()) + 1;
  Eigen::MatrixXd score = Eigen::MatrixXd::Zero(j.cols(), clusters);
  Eigen::VectorXd leverage = Eigen::VectorXd::Zero(clusters);
  for (std::size_t row = 0; row < cluster.size(); ++row) {
    const auto at = static_cast<Eigen::Index>(row) * components;
    const auto block = j.middleRows(at, components);
    score.col(cluster[row]) += block.transpose() * r.segment(at, components);
    leverage[cluster[row]] += (block * inverse * block.transpose()).trace() / components;
  }
  const Eigen::VectorXd weight = (1.0 - leverage.array().min(0.9)).inverse();
  return score * weight.asDiagonal() * score.transpose();
}

TEST_CASE("scores of clusters equal the dense ones, with the same bits on one and two threads") {
  Robot truth = palletizer();
  for (const What what : {What::pose, What::position}) {
    const int components = what == What::pose ? 6 : 3;
    CAPTURE(components);
    auto table = random_joints(truth, what == What::pose ? 500 : 40000, 81);
    measure(table.get(), truth, what, 1e-4, 82);
    const Model model = make_model(truth, table->data);
    const auto bases = make_bases(model, table->data);
    const std::vector<std::int32_t> every = all_rows(table->data);
    std::vector<int> free = all_parameters(model);
    const Evaluator evaluator(model, table->data, bases, make_segments(table->data, every), free, 1);
    Eigen::VectorXd r;
    Eigen::MatrixXd j;
    dense(evaluator, initial_values(model), Weighing{}, &r, &j);
    const Eigen::MatrixXd inverse =
        (j.transpose() * j + Eigen::MatrixXd::Identity(j.cols(), j.cols())).inverse();  // whatever can be seen
    std::vector<std::int32_t> alone = every, together(every.size());
    std::mt19937_64 random(83);
    for (std::int32_t& c : together) c = static_cast<std::int32_t>(random() % (every.size() / 3));  // nor in order
    for (const std::vector<std::int32_t>& cluster : {alone, together}) {
      const auto scores = [&](int threads, const Eigen::MatrixXd& of) -> Eigen::MatrixXd {
        return clustered_scores({model, table->data, bases, free, every, threads}, initial_values(model), Weighing{},
                                of, cluster);
      };
      const Eigen::MatrixXd expected = scores_by_hand(j, r, components, inverse, cluster);
      const Eigen::MatrixXd found = scores(1, inverse);
      CHECK((found - expected).cwiseAbs().maxCoeff() < 1e-8 * expected.cwiseAbs().maxCoeff());
      CHECK(found == scores(2, inverse));
      const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(j.cols(), j.cols());
      const Eigen::MatrixXd plain = scores_by_hand(j, r, components, none, cluster);
      CHECK((scores(2, none) - plain).cwiseAbs().maxCoeff() < 1e-10 * plain.cwiseAbs().maxCoeff());
    }
  }
}

/// sum over clusters of g g^T, g = J^T (I - H)^-1/2 r, by the dense inverse root of every cluster's own matrix.
Eigen::MatrixXd few_scores_by_hand(const Eigen::MatrixXd& j, const Eigen::VectorXd& r, int components,
                                   const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(j.cols(), j.cols());
  for (std::int32_t c = 0; c <= *std::max_element(cluster.begin(), cluster.end()); ++c) {
    std::vector<Eigen::Index> own;
    for (std::size_t row = 0; row < cluster.size(); ++row) {
      for (int k = 0; k < components && cluster[row] == c; ++k)
        own.push_back(static_cast<Eigen::Index>(row) * components + k);
    }
    const Eigen::MatrixXd block = j(own, Eigen::all);
    const auto n = static_cast<Eigen::Index>(own.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> left(Eigen::MatrixXd::Identity(n, n) -
                                                              block * inverse * block.transpose());
    const Eigen::VectorXd score = block.transpose() * (left.operatorInverseSqrt() * r(own));
    out += score * score.transpose();
  }
  return out;
}

TEST_CASE("scores of few clusters equal the dense ones, of clusters smaller and larger than the parameters") {
  Robot truth = palletizer();
  for (const What what : {What::pose, What::position}) {
    const int components = what == What::pose ? 6 : 3;
    CAPTURE(components);
    auto table = random_joints(truth, 90, 84);
    measure(table.get(), truth, what, 1e-4, 85);
    const Model model = make_model(truth, table->data);
    const auto bases = make_bases(model, table->data);
    const std::vector<std::int32_t> every = all_rows(table->data);
    const std::vector<int> free = all_parameters(model);
    const Evaluator evaluator(model, table->data, bases, make_segments(table->data, every), free, 1);
    Eigen::VectorXd r;
    Eigen::MatrixXd j;
    dense(evaluator, initial_values(model), Weighing{}, &r, &j);
    // Some more information than the rows', so that no leverage comes near 1.
    const Eigen::MatrixXd inverse = (2.0 * j.transpose() * j + Eigen::MatrixXd::Identity(j.cols(), j.cols())).inverse();
    std::vector<std::int32_t> alone = every, some = every, many = every;
    for (std::size_t row = 0; row < every.size(); ++row) {
      some[row] = static_cast<std::int32_t>(row * 7 % 31);
      many[row] = static_cast<std::int32_t>(row % 3);
    }
    CHECK(90 / 3 * components > static_cast<int>(free.size()));
    for (const std::vector<std::int32_t>& cluster : {alone, some, many}) {
      const Eigen::MatrixXd expected = few_scores_by_hand(j, r, components, inverse, cluster);
      const Eigen::MatrixXd found = few_clusters_scores({model, table->data, bases, free, every, 1},
                                                        initial_values(model), Weighing{}, inverse, cluster);
      CHECK((found - expected).cwiseAbs().maxCoeff() < 1e-8 * expected.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("every copy of the kernel agrees with the scalar one") {
  const int columns = 13, length = 96;
  std::mt19937_64 random(71);
  std::vector<double> c(static_cast<std::size_t>(columns * length));
  for (double& v : c) v = static_cast<double>(random() >> 11) * 0x1.0p-53 - 0.5;
  std::vector<double> expected(columns * columns, 0.0);
  for (int j = 0; j < columns; ++j) {
    for (int i = 0; i <= j; ++i) {
      for (int k = 0; k < length; ++k) expected[j * columns + i] += c[i * length + k] * c[j * length + k];
    }
  }
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const Functions* f = truing::kernel::functions(name);
    if (!f) continue;
    CAPTURE(name);
    // Gram of an odd number of columns.
    std::vector<double> acc(f->gram_size(columns), 0.0), out(columns * columns, 0.0);
    f->gram_add(c.data(), length, columns, 0, length, acc.data());
    f->gram_reduce(acc.data(), columns, 0, out.data());
    for (int j = 0; j < columns; ++j) {
      for (int i = 0; i <= j; ++i)
        CHECK(out[j * columns + i] == doctest::Approx(expected[j * columns + i]).scale(0).epsilon(1e-13));
    }
    // Without what is known, the others have the same bits.
    for (const int known : {0, 5, 12, columns}) {
      std::vector<double> again(columns * columns, 0.0);
      f->gram_add(c.data(), length, columns, known, length, acc.data());
      f->gram_reduce(acc.data(), columns, known, again.data());
      for (int j = known; j < columns; ++j) {
        for (int i = 0; i <= j; ++i) CHECK(again[j * columns + i] == out[j * columns + i]);
      }
    }
    // Columns in any places, some of them nought in all rows.
    std::vector<double> some = c, placed(columns * columns, 0.0);
    std::fill(some.begin() + 4 * length, some.begin() + 12 * length, 0.0);
    std::vector<const double*> places;
    for (int k = 0; k < columns; ++k) places.push_back(some.data() + k * length);
    f->gram_add_columns(places.data(), columns, 0, length, acc.data());
    f->gram_reduce(acc.data(), columns, 0, placed.data());
    const auto is_nought = [](int k) { return k >= 4 && k < 12; };
    for (int j = 0; j < columns; ++j) {
      for (int i = 0; i <= j; ++i)
        CHECK(placed[j * columns + i] == (is_nought(i) || is_nought(j) ? 0.0 : out[j * columns + i]));
    }
    // Some of them nought in some rows.
    std::vector<double> parted(columns * columns, 0.0), by_hand(columns * columns, 0.0);
    some = c;
    for (int k = 0; k < columns; ++k) std::fill_n(some.begin() + k * length + 16 * (k % 4), 24 + 8 * (k % 5), 0.0);
    for (int j = 0; j < columns; ++j)
      for (int i = 0; i <= j; ++i)
        for (int k = 0; k < length; ++k) by_hand[j * columns + i] += some[i * length + k] * some[j * length + k];
    f->gram_add_columns(places.data(), columns, 0, length, acc.data());
    f->gram_reduce(acc.data(), columns, 0, parted.data());
    for (int j = 0; j < columns; ++j)
      for (int i = 0; i <= j; ++i)
        CHECK(parted[j * columns + i] == doctest::Approx(by_hand[j * columns + i]).scale(1.0).epsilon(1e-13));
    // Rows whose numbers are neighbours, in two lots, some columns of the first nought.
    const int padded = 3 * truing::kernel::kRowColumns, lot = 7;
    std::vector<double> rows(static_cast<std::size_t>(2 * lot * padded), 0.0), sums(padded * padded, -1.0);
    for (int k = 0; k < 2 * lot; ++k)
      for (int i = 0; i < padded; ++i)
        if (k >= lot || i < truing::kernel::kRowColumns)
          rows[static_cast<std::size_t>(k * padded + i)] = c[static_cast<std::size_t>(k * padded + i)];
    f->gram_add_rows(rows.data(), padded, lot, true, sums.data());
    f->gram_add_rows(rows.data() + lot * padded, padded, lot, false, sums.data());
    for (int i = 0; i < padded; ++i) {
      for (int j = i; j < padded; ++j) {
        double sum = 0.0;
        for (int k = 0; k < 2 * lot; ++k) sum += rows[k * padded + i] * rows[k * padded + j];
        CHECK(sums[i * padded + j] == doctest::Approx(sum).scale(1).epsilon(1e-14));
      }
    }
    // Columns times numbers, of rows that no pack has whole; none beyond them is touched.
    std::vector<double> together(length, 1.0);
    f->add_columns(places.data(), expected.data(), columns, length - 3, together.data());
    for (int i = 0; i < length; ++i) {
      double sum = 1.0;
      for (int k = 0; k < columns && i < length - 3; ++k) sum += expected[k] * some[k * length + i];
      CHECK(together[i] == doctest::Approx(sum).scale(1).epsilon(1e-14));
    }
    // Squares of a row of numbers times the columns.
    std::vector<double> squares(length, 1.0);
    f->add_squared(c.data(), length, expected.data(), columns, length, squares.data());
    for (int i = 0; i < length; ++i) {
      double sum = 0.0;
      for (int k = 0; k < columns; ++k) sum += expected[k] * c[k * length + i];
      CHECK(squares[i] == doctest::Approx(1.0 + sum * sum).scale(0).epsilon(1e-13));
    }
    // Of one tile's rows alone: none beyond them is touched.
    squares.assign(length, 1.0);
    f->add_squared(c.data(), length, expected.data(), columns, truing::kernel::kTilePoses, squares.data());
    CHECK(std::all_of(squares.begin() + truing::kernel::kTilePoses, squares.end(), [](double v) { return v == 1.0; }));
    // Sine and cosine, through a chain of one rotation about z and a step along x: also where the quadrant changes, and
    // many turns away.
    using namespace truing::kernel;
    const Step steps[2] = {{Code::rotate, 0, 0, {0, 1, 0}, {0, 1, 0}}, {Code::translate, -1, 0, {3, 0, 0}, {3, 0, 0}}};
    const double constants[1] = {1.0}, start[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
    const int slots_at_start[4] = {0, 1, 2, 3};
    Program program{};
    program.kind = Kind::position;
    program.steps = steps;
    program.step_count = 2;
    program.constants = constants;
    program.start_slots = slots_at_start;
    program.start_vectors = start;
    program.start_count = 4;
    std::copy(slots_at_start, slots_at_start + 4, program.tip_slots);
    program.position_scale = program.rotation_scale = 1.0;
    std::vector<double> values(kTilePoses), measured(3 * kTilePoses, 0.0), residual(3 * kTilePoses), slots(256);
    for (int i = 0; i < kTilePoses; ++i) values[i] = i < 20 ? (i - 10) * M_PI / 4 : (i - 30) * 137.3;
    Tile tile{};
    tile.values = values.data();
    tile.measured = measured.data();
    tile.slots = slots.data();
    tile.jacobian = tile.residual = residual.data();
    f->evaluate(program, tile);
    for (int i = 0; i < kTilePoses; ++i) {
      CHECK(std::abs(residual[i] - std::cos(values[i])) < 3e-16);
      CHECK(std::abs(residual[kTilePoses + i] - std::sin(values[i])) < 3e-16);
    }
  }
}
