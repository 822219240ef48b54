// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Closed-loop inverse kinematics as Pinocchio's manual writes it (its example "inverse kinematics": log6, Jlog6, damped
// least squares), with whole steps, joints clamped to their limits, and restarts from random joints. CPU time of every
// target.
//
//     pinocchio_clik CHAIN CASES ANSWERS MODE RUNS
//
// CHAIN and CASES are doubles as bench/peers/inverse_chain.py writes them; ANSWERS gets a row a target: 1 if reached,
// joints, seconds (best of RUNS). MODE: `one` (up to 100 restarts) or `path` (from the answer before, no restart).

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/spatial.hpp>

namespace {

using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<double> read(const char* path) {
  std::vector<double> values;
  std::FILE* file = std::fopen(path, "rb");
  if (!file) {
    std::fprintf(stderr, "cannot read %s\n", path);
    std::exit(2);
  }
  double value;
  while (std::fread(&value, sizeof value, 1, file) == 1) values.push_back(value);
  std::fclose(file);
  return values;
}

pinocchio::SE3 frame(const double* rows) {
  const Eigen::Map<const Matrix4> T(rows);
  return pinocchio::SE3(T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>());
}

/// A row a joint: 1 if it slides, limits, placement in the frame of the joint before; then the tool's placement.
struct Arm {
  pinocchio::Model model;
  pinocchio::SE3 tool;
  int n = 0;

  explicit Arm(const std::vector<double>& chain) {
    n = static_cast<int>((chain.size() - 16) / 19);
    pinocchio::JointIndex parent = 0;
    for (int j = 0; j < n; ++j) {
      const double* row = chain.data() + 19 * j;
      const std::string name = "joint" + std::to_string(j);
      if (row[0] != 0.0) {
        parent = model.addJoint(parent, pinocchio::JointModelPZ(), frame(row + 3), name);
      } else {
        parent = model.addJoint(parent, pinocchio::JointModelRZ(), frame(row + 3), name);
      }
      model.lowerPositionLimit[j] = row[1];
      model.upperPositionLimit[j] = row[2];
    }
    tool = frame(chain.data() + 19 * n);
  }
};

class Clik {
 public:
  explicit Clik(const Arm& arm) : arm_(arm), data_(arm.model), J_(6, arm.n), J_tip_(6, arm.n), random_(1) {
    J_.setZero();
  }

  bool descend(const pinocchio::SE3& wanted, Eigen::VectorXd* q) {
    constexpr int kIterations = 100;
    constexpr double kDamping = 1e-6, kTolerance = 1e-6;
    for (int k = 0; k < kIterations; ++k) {
      pinocchio::computeJointJacobians(arm_.model, data_, *q);
      const pinocchio::SE3 T = data_.oMi[static_cast<std::size_t>(arm_.n)] * arm_.tool;
      const pinocchio::SE3 error = T.actInv(wanted);
      const Eigen::Matrix<double, 6, 1> e = pinocchio::log6(error).toVector();
      if (error.translation().norm() <= kTolerance && e.tail<3>().norm() <= kTolerance) return true;
      pinocchio::getJointJacobian(arm_.model, data_, static_cast<std::size_t>(arm_.n), pinocchio::LOCAL, J_);
      Eigen::Matrix<double, 6, 6> Jlog;
      pinocchio::Jlog6(error.inverse(), Jlog);
      J_tip_.noalias() = -(Jlog * arm_.tool.toActionMatrixInverse()) * J_;
      Eigen::Matrix<double, 6, 6> gram = J_tip_ * J_tip_.transpose();
      gram.diagonal().array() += kDamping;
      q->noalias() -= J_tip_.transpose() * gram.ldlt().solve(e);
      *q = q->cwiseMax(arm_.model.lowerPositionLimit).cwiseMin(arm_.model.upperPositionLimit);
    }
    return false;
  }

  bool solve(const pinocchio::SE3& wanted, int restarts, Eigen::VectorXd* q) {
    for (int k = 0;; ++k) {
      if (descend(wanted, q)) return true;
      if (k == restarts) return false;
      for (int j = 0; j < arm_.n; ++j) {
        (*q)[j] = std::uniform_real_distribution<double>(arm_.model.lowerPositionLimit[j],
                                                         arm_.model.upperPositionLimit[j])(random_);
      }
    }
  }

 private:
  const Arm& arm_;
  pinocchio::Data data_;
  pinocchio::Data::Matrix6x J_, J_tip_;
  std::mt19937_64 random_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: pinocchio_clik CHAIN CASES ANSWERS one|path RUNS\n");
    return 2;
  }
  const Arm arm(read(argv[1]));
  const std::vector<double> cases = read(argv[2]);
  const bool path = std::string(argv[4]) == "path";
  const int runs = std::atoi(argv[5]), columns = 2 * arm.n + 16, count = static_cast<int>(cases.size()) / columns;
  Clik clik(arm);
  std::vector<double> answers(static_cast<std::size_t>(count * (arm.n + 2)), 1e9);
  for (int run = 0; run < runs; ++run) {
    Eigen::VectorXd q(arm.n);
    for (int k = 0; k < count; ++k) {
      const double* row = cases.data() + k * columns;
      if (!path) q = Eigen::Map<const Eigen::VectorXd>(row + arm.n, arm.n);
      if (path && k == 0) q = Eigen::Map<const Eigen::VectorXd>(row, arm.n);
      const pinocchio::SE3 wanted = frame(row + 2 * arm.n);
      const double start = cpu_seconds();
      const bool reached = clik.solve(wanted, path ? 0 : 100, &q);
      const double seconds = cpu_seconds() - start;
      double* answer = answers.data() + k * (arm.n + 2);
      answer[0] = reached;
      for (int j = 0; j < arm.n; ++j) answer[1 + j] = q[j];
      answer[arm.n + 1] = std::min(answer[arm.n + 1], seconds);
    }
  }
  std::FILE* file = std::fopen(argv[3], "wb");
  if (!file || std::fwrite(answers.data(), sizeof(double), answers.size(), file) != answers.size() ||
      std::fclose(file) != 0) {
    std::fprintf(stderr, "cannot write %s\n", argv[3]);
    return 2;
  }
  return 0;
}
