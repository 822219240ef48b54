// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A camera on the hand looks at a board in the cell. One of the poses was typed in wrongly.

#include <cmath>
#include <cstdio>
#include <random>

#include <truing/truing.hpp>

namespace {

Eigen::Isometry3d frame(const Eigen::Vector3d& position, const Eigen::Vector3d& turn) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = position;
  T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  return T;
}

}  // namespace

int main() {
  const Eigen::Isometry3d T_hand_camera = frame({0.05, 0.0, 0.08}, {0.0, 0.0, 1.57}),
                          T_base_board = frame({0.7, 0.1, 0.0}, {3.14, 0.0, 0.0});
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto noise = [&](double size) {
    return Eigen::Vector3d(size * normal(random), size * normal(random), size * normal(random));
  };

  truing::HandEyePoses poses;
  for (int i = 0; i < 25; ++i) {
    const Eigen::Isometry3d T_camera_board = frame(Eigen::Vector3d(0.0, 0.0, 0.5) + noise(0.05), noise(0.4));
    poses.T_base_hand.push_back(T_base_board * T_camera_board.inverse() * T_hand_camera.inverse() *
                                frame(noise(1e-4), noise(5e-4)));
    poses.T_camera_board.push_back(T_camera_board * frame(noise(5e-4), noise(1e-3)));
  }
  poses.T_base_hand[7].translation().y() += 0.1;

  truing::HandEyeOptions options;
  options.setup = truing::HandEyeSetup::eye_in_hand;
  const truing::HandEyeResult found = truing::handeye(poses, options);
  std::printf("%s\n", found.message.c_str());
  for (const std::size_t i : found.rejected)
    std::printf("left out: pose %zu, %s\n", i, found.residuals[i].cause.c_str());
  const double off = (found.camera.T.translation() - T_hand_camera.translation()).norm();
  std::printf("%.2f mm from where it was put\n", 1e3 * off);
  return found.status == truing::HandEyeStatus::done && found.rejected.size() == 1 && off < 3e-3 ? 0 : 1;
}
