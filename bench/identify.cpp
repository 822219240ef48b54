// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Times the inner loop and whole identifications on a UR10 (modified DH + Hayati, 39 columns) and prints one JSON
// object a line:
// {"name", "value", "unit"}. bench/run.py runs it beside the peers.

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "common.hpp"
#include "estimation/evaluate.hpp"
#include "truing/truing.hpp"

namespace {

using namespace truing;
using namespace truing::bench;

Robot with_tool(Robot robot) {
  robot.targets = {{"tool", frame_from_xyz_rpy({0.03, -0.02, 0.15}, Eigen::Vector3d::Zero())}};
  return robot;
}

Robot with_errors(Robot robot, std::mt19937_64* random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  for (Joint& joint : robot.joints) {
    joint.a += 1e-3 * normal(*random);
    joint.d += 1e-3 * normal(*random);
    joint.alpha += 1e-3 * normal(*random);
    joint.theta += 1e-3 * normal(*random);
  }
  for (const int k : {2, 3}) robot.joints[static_cast<std::size_t>(k)].beta = 1e-3 * normal(*random);
  robot.T_measurement_base = frame_from_xyz_rpy({2.1, -0.7, 0.4}, {0.3, -0.2, 2.5});
  robot.targets[0].T_last_target.translation() += Eigen::Vector3d(2e-3, -3e-3, 1e-3);
  return robot;
}

/// Poses and noisy positions in columns of their own.
struct Data {
  std::vector<std::vector<double>> q, p;
  Measurements measurements;

  Data(const Robot& truth, std::size_t rows, double sigma, std::mt19937_64* random)
      : q(6, std::vector<double>(rows)), p(3, std::vector<double>(rows)) {
    std::uniform_real_distribution<double> uniform(-M_PI, M_PI);
    std::normal_distribution<double> normal(0.0, sigma);
    for (auto& column : q) {
      for (double& v : column) v = uniform(*random);
    }
    measurements.rows = rows;
    for (auto& column : q) measurements.joints.push_back({column.data(), 1});
    {
      const Prediction predicted = predict(truth, measurements);
      for (int k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < rows; ++i)
          p[static_cast<std::size_t>(k)][i] =
              predicted.position(static_cast<Eigen::Index>(i), k) + (sigma > 0.0 ? normal(*random) : 0.0);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) measurements.position[k] = {p[k].data(), 1};
  }
};

long peak_kilobytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

/// Forgets the peak so far (Linux).
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

long resident_kilobytes(const char* which) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(which, 0) == 0) return std::stol(line.substr(std::strlen(which)));
  }
  return peak_kilobytes();
}

struct Problem {
  model::Model model;
  std::vector<std::vector<double>> bases;
  std::vector<int> free;
  Eigen::VectorXd values;
  std::vector<std::int32_t> rows;

  Problem(const Robot& robot, const Measurements& data)
      : model(model::make_model(robot, data)), bases(estimation::make_bases(model, data)) {
    for (std::size_t k = 0; k < model.parameters.size(); ++k) {  // 30 link values, 6 base, 3 tool
      const model::ParameterInfo& info = model.parameters[k];
      if (info.role == model::Role::geometry || info.role == model::Role::base ||
          (info.role == model::Role::target && !info.rotation))
        free.push_back(static_cast<int>(k));
    }
    values = model::initial_values(model);
    rows.resize(data.rows);
    std::iota(rows.begin(), rows.end(), 0);
  }

  estimation::Evaluator evaluator(const Measurements& data, int threads) const {
    return estimation::Evaluator(model, data, bases, estimation::make_segments(data, rows), free, threads);
  }
};

double rms_against(const Robot& truth, const Robot& found, std::mt19937_64* random) {
  const Data fresh(truth, 2000, 0.0, random);
  const Residuals r = residuals(found, fresh.measurements);
  return std::sqrt(r.position.rowwise().squaredNorm().mean());
}

void time_kernel(const Robot& truth, std::mt19937_64* random) {
  const Data data(truth, 1000, 3e-5, random);
  const Problem problem(truth, data.measurements);
  const estimation::Evaluator evaluator = problem.evaluator(data.measurements, 1);
  report("jacobian_columns", static_cast<double>(problem.free.size()), "1");
  double sum = 0.0;
  report("fk_jacobian_1000",
         1e6 * best_seconds(5000,
                            [&] {
                              evaluator.jacobian_tiles(problem.values, estimation::Weighing{},
                                                       [&](const double* j, int, int) { sum += j[0]; });
                            }),
         "us");
  estimation::NormalEquations normal;
  report("iteration_1000",
         1e6 * best_seconds(2000, [&] { evaluator.normal_equations(problem.values, estimation::Weighing{}, &normal); }),
         "us");
  if (sum == 0.123456789) std::puts("");  // the work is not to be optimised away
}

void time_threads(const Robot& truth, std::mt19937_64* random) {
  const Data data(truth, 100000, 3e-5, random);
  const Problem problem(truth, data.measurements);
  double time[3];
  estimation::NormalEquations normal;
  const estimation::Evaluator one = problem.evaluator(data.measurements, 1),
                              two = problem.evaluator(data.measurements, 2);
  // In turn, so that a change of the machine's speed hits both.
  std::vector<double> ratios;
  one.normal_equations(problem.values, estimation::Weighing{}, &normal);
  two.normal_equations(problem.values, estimation::Weighing{}, &normal);
  for (int k = 0; k < 31; ++k) {
    time[1] = seconds([&] { one.normal_equations(problem.values, estimation::Weighing{}, &normal); });
    time[2] = seconds([&] { two.normal_equations(problem.values, estimation::Weighing{}, &normal); });
    ratios.push_back(time[1] / time[2]);
  }
  std::nth_element(ratios.begin(), ratios.begin() + 15, ratios.end());
  report("threads_speedup_100000", ratios[15], "x");
}

void time_million(const Robot& nominal, const Robot& truth, std::mt19937_64* random) {
  const Data data(truth, 1000000, 3e-5, random);
  {
    const Problem problem(truth, data.measurements);
    estimation::NormalEquations normal;
    for (const int threads : {1, 2}) {
      const estimation::Evaluator evaluator = problem.evaluator(data.measurements, threads);
      report(
          "iteration_1000000_threads_" + std::to_string(threads),
          1e3 * best_seconds(15, [&] { evaluator.normal_equations(problem.values, estimation::Weighing{}, &normal); }),
          "ms");
    }
  }
  reset_peak();
  const long before = resident_kilobytes("VmRSS:");
  Identification result;
  report("identify_1000000", seconds([&] { result = identify(nominal, data.measurements); }), "s");
  report("identify_1000000_memory", static_cast<double>(resident_kilobytes("VmHWM:") - before) / 1024.0, "MB");
  report("identify_1000000_iterations", result.solver.iterations, "1");
}

void time_identify(const Robot& nominal, const Robot& truth, std::mt19937_64* random) {
  const Data data(truth, 1000, 3e-5, random);
  IdentifyOptions options;
  options.test_share = 0.0;
  Identification result;
  report("identify_1000", 1e3 * best_seconds(500, [&] { result = identify(nominal, data.measurements, options); }),
         "ms");
  report("identify_1000_rank", result.rank, "1");
  report("identify_1000_columns", result.columns, "1");
  report("identify_1000_iterations", result.solver.iterations, "1");
}

/// Median over 20 seeds of the rms error on fresh poses, as a fraction of sigma sqrt(p / N).
void accuracy(const Robot& nominal) {
  for (const std::size_t rows : {200u, 1000u}) {
    std::vector<double> ratios;
    for (unsigned seed = 0; seed < 20; ++seed) {
      std::mt19937_64 random(seed);
      const Robot truth = with_errors(nominal, &random);
      const Data data(truth, rows, 3e-5, &random);
      IdentifyOptions options;
      options.test_share = 0.0;
      const Identification result = identify(nominal, data.measurements, options);
      ratios.push_back(rms_against(truth, result.robot, &random) /
                       (3e-5 * std::sqrt(static_cast<double>(result.rank) / static_cast<double>(rows))));
    }
    std::nth_element(ratios.begin(), ratios.begin() + 10, ratios.end());
    report("accuracy_" + std::to_string(rows), ratios[10], "sigma sqrt(p/N)");
  }
}

}  // namespace

int main() {
  std::mt19937_64 random(1);
  const Robot nominal = with_tool(ur10());
  const Robot truth = with_errors(nominal, &random);
  report("kernel", kernel::functions().name);
  time_kernel(truth, &random);
  time_identify(nominal, truth, &random);
  accuracy(nominal);
  time_threads(truth, &random);
  time_million(nominal, truth, &random);
}
