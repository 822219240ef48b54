// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "model/model.hpp"
#include "support/inverse_arms.hpp"
#include "truing/compensate.hpp"

using namespace inverse_arms;
using truing::Compensated;
using truing::Compensator;
using truing::InverseSolver;

TEST_CASE("the real robot goes where it is wanted when the command is given to a controller with the nominal model") {
  for (const Robot& nominal : {ur(), wrist_arm(), gantry()}) {
    CAPTURE(nominal.name);
    const Robot real = perturbed(nominal, 1e-3, 1e-3, 61);
    const Compensator compensator(nominal, real);
    const InverseSolver controller(nominal);
    Sampler sampler(nominal, 62);
    int reached_count = 0;
    for (int k = 0; k < 100; ++k) {
      const Joints truth = sampler.joints();
      const Task task = task_at(truing::forward_kinematics(nominal, truth).back());
      const Compensated out = compensator.pose(task, truth);
      if (!out.solution.reached()) continue;  // beyond the real robot's limits or reach: labelled
      ++reached_count;
      // What the controller makes of the command, and where the real robot then is.
      const Solution controlled = controller.solve(task_at(out.T_command), out.solution.joints);
      REQUIRE(controlled.reached());
      const Isometry3d T = truing::forward_kinematics(real, controlled.joints).back();
      CHECK((T.translation() - task.T_measurement_target.translation()).norm() < 1e-7);
      CHECK((truing::forward_kinematics(real, out.solution.joints).back().translation() -
             task.T_measurement_target.translation())
                .norm() < 1e-9);
      CHECK(out.position_before > 1e-5);
    }
    CHECK(reached_count > 90);
  }
}

TEST_CASE("poses near the wrist's singularity, where the fake target does not settle, are compensated too") {
  const Robot nominal = ur(), real = perturbed(nominal, 1e-3, 1e-3, 63);
  const Compensator compensator(nominal, real);
  const InverseSolver controller(nominal), model(real);
  Sampler sampler(nominal, 64);
  truing::InverseOptions harder;
  harder.max_restarts = 2000;
  const InverseSolver search(real, harder);
  int unsettled = 0, out_of_reach = 0;
  for (int k = 0; k < 100; ++k) {
    Joints truth = sampler.joints();
    truth[4] = sampler.uniform(-3e-3, 3e-3);
    truth[2] = sampler.uniform(0.5, 2.0);
    const Task task = task_at(truing::forward_kinematics(nominal, truth).back());
    const Compensated out = compensator.pose(task, truth);
    if (!out.solution.reached()) {  // the nominal robot's reach is not the real one's: no search finds anything either
      CHECK_FALSE(search.solve(task, truth).reached());
      ++out_of_reach;
      continue;
    }
    CHECK(holds(real, task, out.solution, 1e-9, 1e-8));
    // The usual way: command the pose less what the calibrated model says it will be off, again and again.
    Isometry3d command = task.T_measurement_target;
    Joints q = truth;
    double off = 1.0;
    for (int round = 0; round < 10; ++round) {
      const Solution s = controller.solve(task_at(command), q);
      if (!s.reached()) break;
      q = s.joints;
      const Isometry3d T = model.forward(q);
      off = (T.translation() - task.T_measurement_target.translation()).norm();
      command = command * T.inverse() * task.T_measurement_target;
    }
    unsettled += off > 1e-6;
  }
  CHECK(unsettled > 0);
}

TEST_CASE("joint programs keep their configuration, and base frames are each robot's own") {
  const Robot nominal = wrist_arm();
  Robot real = perturbed(nominal, 1e-3, 1e-3, 65);
  real.T_measurement_base = somewhere();
  truing::CompensateOptions options;
  options.in_base = true;
  const Compensator compensator(nominal, real, options);
  Sampler sampler(nominal, 66);
  for (int k = 0; k < 50; ++k) {
    const Joints program = 0.9 * sampler.joints();
    const Compensated out = compensator.joints(program, program);
    if (!out.solution.reached()) continue;
    const Isometry3d wanted = truing::forward_kinematics(nominal, program).back();
    const Isometry3d T =
        real.T_measurement_base.inverse() * truing::forward_kinematics(real, out.solution.joints).back();
    CHECK((T.translation() - wanted.translation()).norm() < 1e-9);
    CHECK((out.T_command.translation() - truing::forward_kinematics(nominal, out.solution.joints).back().translation())
              .norm() < 1e-12);
    if (std::abs(program[4]) > 0.3 && std::abs(program[2] + 1.39) > 0.2)
      CHECK((out.solution.joints - program).cwiseAbs().maxCoeff() < 0.1);
  }
}

TEST_CASE("the standard error of a reached pose is what parameters drawn from their covariance scatter by") {
  const Robot nominal = ur();
  const Robot real = perturbed(nominal, 1e-3, 1e-3, 67);
  auto table = random_joints(real, 60, 68);
  measure(table.get(), real, What::pose, 3e-5, 69);
  truing::IdentifyOptions how;
  how.test_share = 0.0;
  const truing::Identification found = truing::identify(nominal, table->data, how);
  Compensator compensator(nominal, found.robot);
  compensator.set_uncertainty(found.parameters, found.covariance);
  Joints q(6);
  q << 0.3, -1.0, 1.2, 0.4, 0.9, 0.7;
  const Compensated out = compensator.joints(q, q);
  REQUIRE(out.solution.reached());

  // Robots with parameters from the covariance: where are they at the same joints?
  const truing::model::Model model = truing::model::make_model(found.robot, {});
  const Eigen::MatrixXd root = Eigen::MatrixXd(found.covariance.ldlt().matrixL());
  const Eigen::VectorXd scale = found.covariance.ldlt().vectorD().cwiseMax(0.0).cwiseSqrt();
  const auto permutation = found.covariance.ldlt().transpositionsP();
  const Isometry3d T = truing::forward_kinematics(found.robot, out.solution.joints).back();
  std::mt19937_64 random(70);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 1> squares = Eigen::Matrix<double, 6, 1>::Zero();
  constexpr int kDraws = 2000;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd z(scale.size());
    for (Eigen::Index i = 0; i < z.size(); ++i) z[i] = normal(random);
    const Eigen::VectorXd change = permutation.transpose() * (root * scale.cwiseProduct(z));
    Eigen::VectorXd values = truing::model::initial_values(model);
    Eigen::Index at = 0;
    for (const truing::Parameter& parameter : found.parameters) {
      if (!parameter.frozen) values[model.parameter_index(parameter.name)] += change[at++];
    }
    const Isometry3d moved =
        truing::forward_kinematics(truing::model::robot_with(model, values), out.solution.joints).back();
    const Matrix3d turn = moved.linear() * T.linear().transpose();
    Eigen::Matrix<double, 6, 1> off;
    off << moved.translation() - T.translation(), turn(2, 1), turn(0, 2), turn(1, 0);
    squares += off.cwiseAbs2();
  }
  for (int i = 0; i < 6; ++i) {
    CHECK(out.sigma[i] > 1e-6);
    CHECK(out.sigma[i] == doctest::Approx(std::sqrt(squares[i] / kDraws)).scale(0).epsilon(0.1));
  }
}

TEST_CASE("robots and parameters that do not fit are one clear error; a batch is the same on any number of threads") {
  const Robot nominal = ur(), real = perturbed(nominal, 1e-3, 1e-3, 71);
  CHECK_THROWS_WITH_AS(Compensator(nominal, gantry()), doctest::Contains("6 driven joints"), std::invalid_argument);
  Compensator compensator(nominal, real);
  truing::Parameter unknown;
  unknown.name = "J9.a";
  CHECK_THROWS_WITH_AS(compensator.set_uncertainty({unknown}, Eigen::MatrixXd::Identity(1, 1)),
                       doctest::Contains("J9.a"), std::invalid_argument);
  unknown.name = "J2.a";
  CHECK_THROWS_WITH_AS(compensator.set_uncertainty({unknown}, Eigen::MatrixXd::Identity(2, 2)),
                       doctest::Contains("2 x 2"), std::invalid_argument);
  Sampler sampler(nominal, 72);
  std::vector<Task> tasks;
  for (int k = 0; k < 200; ++k) tasks.push_back(task_at(truing::forward_kinematics(nominal, sampler.joints()).back()));
  const std::vector<Joints> seed = {sampler.joints()};
  const auto two = compensator.pose_batch(tasks, seed, {}, 1);
  const auto three = compensator.pose_batch(tasks, seed, {}, 3);
  for (std::size_t k = 0; k < tasks.size(); ++k) CHECK(two[k].solution.joints == three[k].solution.joints);
}
