// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Where will the tool of a swaying boom be in 40 ms? Samples are pushed as they arrive; nothing is allocated for them.

#include <cmath>
#include <cstdio>

#include <truing/truing.hpp>

int main() {
  truing::StreamSimulationOptions simulation;
  simulation.seconds = 15.0;
  simulation.motion = truing::SimulatedMotion::stop_and_go;
  simulation.tip_speed = 0.8;
  simulation.seed = 4;
  const truing::SimulatedStreams streams = truing::simulate_streams(truing::large_boom(), simulation);

  truing::Tracker tracker(streams.setup);
  std::size_t pose = 0, flange = 0, plan = 0, k = 0;
  double squares = 0.0, uncorrected = 0.0, count = 0.0;
  for (const truing::ImuSample& sample : streams.imu) {
    for (; plan < streams.plan.size() && streams.plan[plan].arrival < sample.arrival; ++plan)
      tracker.push_plan(streams.plan[plan].t, streams.plan[plan].T_base_frame);
    for (; flange < streams.flange.size() && streams.flange[flange].arrival < sample.arrival; ++flange)
      tracker.push_joints(streams.flange[flange].t, streams.flange[flange].T_base_frame);
    for (; pose < streams.tracker.size() && streams.tracker[pose].arrival < sample.arrival; ++pose)
      tracker.push_pose(streams.tracker[pose]);
    tracker.push_imu(sample);
    if (++k % 10 != 0 || sample.t < 5.0) continue;
    const truing::Compensation c = tracker.compensate(tracker.now() + 0.04);
    const Eigen::Vector3d tool = streams.tool_at(c.predicted.t).translation();
    squares += (tool - c.predicted.T_base_tool.translation()).squaredNorm();
    uncorrected += (tool - c.T_base_tool_planned.translation()).squaredNorm();
    count += 1.0;
  }
  const double rms = std::sqrt(squares / count), away = std::sqrt(uncorrected / count);
  std::printf("40 ms ahead the tool was predicted to %.2f mm rms; it was %.1f mm away from its plan\n", 1e3 * rms,
              1e3 * away);
  return rms < 0.3 * away ? 0 : 1;
}
