# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where will the tool of a swaying boom be in 40 ms? A simulated recording, sample by sample as on the arm,
and once more as a replay.
"""

import numpy as np

import truing
from truing.tracking.result import horizon_errors


def main() -> None:
    streams = truing.testing.simulate_streams(
        truing.testing.large_boom(), seconds=20.0, motion="stop-and-go", tip_speed=0.8, seed=4
    )
    imu, poses, flange, plan = streams.imu, streams.tracker, streams.flange, streams.plan

    # Sample by sample: whatever has arrived is pushed, every hundredth of a second the tool is predicted.
    tracker = truing.tracking.Tracker(streams.setup)
    predictions = []
    done = {"tracker": 0, "flange": 0, "plan": 0}
    for k, arrival in enumerate(imu["arrival"]):
        while done["plan"] < len(plan["t"]) and plan["arrival"][done["plan"]] < arrival:
            tracker.push_plan(plan["t"][done["plan"]], plan["T_base_tool"][done["plan"]])
            done["plan"] += 1
        while done["flange"] < len(flange["t"]) and flange["arrival"][done["flange"]] < arrival:
            tracker.push_joints(flange["t"][done["flange"]], flange["T_base_flange"][done["flange"]])
            done["flange"] += 1
        while done["tracker"] < len(poses["t"]) and poses["arrival"][done["tracker"]] < arrival:
            tracker.push_pose(
                poses["t"][done["tracker"]],
                poses["position"][done["tracker"]],
                poses["orientation"][done["tracker"]],
            )
            done["tracker"] += 1
        tracker.push_imu(imu["t"][k], imu["gyro"][k], imu["accel"][k])
        if k % 10 == 0 and k > 5000:
            predictions.append(tracker.compensate(tracker.now + 0.04).predicted)
    true = streams.tool_at([p.t for p in predictions])
    error = np.array([p.T_base_tool[:3, 3] for p in predictions]) - true[:, :3, 3]
    print(
        f"40 ms ahead the tool was predicted to {1e3 * np.sqrt(np.mean(np.sum(error**2, axis=1))):.2f} mm"
        f" rms; last status: {predictions[-1].status}"
    )

    # The same recording as a replay, with what simpler ways would have said.
    played = truing.replay(streams.recorded, streams.setup)
    for row in horizon_errors(played.graded):
        others = ", ".join(f"{name} {1e3 * row[name]['rms_m']:.1f}" for name in ("hold", "velocity", "fk"))
        print(
            f"{1e3 * row['horizon_s']:.0f} ms ahead, against the tracker: {1e3 * row['truing']['rms_m']:.2f}"
            f" mm rms ({others})"
        )


if __name__ == "__main__":
    main()
