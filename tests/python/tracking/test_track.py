# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking from Python: samples in any order, faulty samples, recordings replayed without looking ahead, and
the truth within what is said.
"""

from __future__ import annotations

import functools
import pickle
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import truing
from truing import InputError
from truing.examples import example
from truing.files.stream_file import SetupData
from truing.rotations import interpolated, rotation_vectors
from truing.testing import SimulatedStreams, TrackerErrors, large_boom, simulate_streams
from truing.tracking import (
    CorrectionLimits,
    FilterOptions,
    ModalModel,
    RecordedStreams,
    ReplayResult,
    Tracker,
    TrackOptions,
    TrackSetup,
)
from truing.tracking.result import BASELINES, horizon_errors
from truing.tracking.uncertainty import tool_covariance

ROBOT = truing.load_robot(example("large_boom"))


@functools.cache
def recording(motion: str = "gentle", seconds: float = 12.0, offset: float = 0.0) -> SimulatedStreams:
    errors = TrackerErrors(clock_offset=offset, out_of_order=0.02)
    return simulate_streams(ROBOT, seconds=seconds, motion=motion, imu_rate=500.0, tracker=errors, seed=5)


@functools.cache
def played(motion: str = "gentle", offset: float = 0.0) -> ReplayResult:
    streams = recording(motion, offset=offset)
    setup = streams.setup if not offset else streams.setup.replace(clock_offset=0.0, clock_offset_sigma=0.01)
    return truing.replay(streams.recorded, setup)


# ---- The simulated arm ---------------------------------------------------------------------------


def test_the_example_file_is_the_large_boom() -> None:
    boom = large_boom()
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(-1, 1, 4)
        assert np.allclose(
            truing.model.flange_poses(ROBOT, [q])[0], truing.model.flange_poses(boom, [q])[0], atol=1e-9
        )


def test_the_sway_does_not_depend_on_how_the_robot_is_described() -> None:
    t = np.linspace(0.0, 2.0, 21)
    a, b = (
        simulate_streams(robot, seconds=2.0, imu_rate=100.0, joint_noise=0.0, seed=2).tool_at(t)
        for robot in (ROBOT, large_boom())
    )
    assert np.allclose(a, b, atol=1e-6)


def test_encoders_do_not_see_the_sway() -> None:
    s = recording()
    true = interpolated(*(lambda t: (t, s.tool_at(t)))(np.arange(0.0, 12.0, 2e-3)), s.flange["t"][:2900])
    seen = s.flange["T_base_flange"][:2900] @ np.asarray(s.setup.T_flange_tool)
    assert 2e-3 < np.linalg.norm(true[:, :3, 3] - seen[:, :3, 3], axis=1).std() < 0.1


# ---- Sample by sample ----------------------------------------------------------------------------


def test_faulty_samples_are_refused_by_name_and_change_nothing() -> None:
    s = recording()
    tracker = Tracker(s.setup)
    imu, poses = s.imu, s.tracker
    for k in range(600):
        assert tracker.push_imu(imu["t"][k], imu["gyro"][k], imu["accel"][k]) == "accepted"
    for k in range(80):
        tracker.push_pose(poses["t"][k], poses["position"][k], poses["orientation"][k])
    tracker.push_joints(0.4, s.flange["T_base_flange"][100])
    before = tracker.predict(tracker.now + 0.04)
    t, gyro, accel = imu["t"][599], imu["gyro"][599], imu["accel"][599]
    assert tracker.push_imu(t, gyro, accel) == "duplicate"
    assert tracker.push_imu(t - 0.1, gyro, accel) == "backwards"
    assert tracker.push_imu(t + 0.002, [np.nan, 0, 0], accel) == "not_finite"
    position, orientation = poses["position"][79], poses["orientation"][79]
    assert tracker.push_pose(poses["t"][79], position, orientation) == "duplicate"
    assert tracker.push_pose(t + 5.0, position, orientation) == "future"
    assert tracker.push_pose(t - 5.0, position, orientation) == "too_late"
    assert tracker.push_pose(t - 1e-3, position, 1.2 * orientation) == "not_unit"
    assert tracker.push_pose(t - 1e-3, [np.inf, 0, 0], orientation) == "not_finite"
    after = tracker.predict(tracker.now + 0.04)
    assert (before.T_base_tool == after.T_base_tool).all() and (before.covariance == after.covariance).all()
    assert tracker.counters["imu"] == {"accepted": 600, "duplicate": 1, "backwards": 1, "not_finite": 1}
    assert tracker.counters["pose"]["not_unit"] == 1


def test_two_sensors_on_one_stamp_are_both_taken() -> None:
    s = recording()
    tracker = Tracker(s.setup)
    t = s.imu["t"][:300]
    assert set(tracker.push_imu_rows(t, s.imu["gyro"][:300], s.imu["accel"][:300])) == {"accepted"}
    at = s.setup.T_tracker_base @ s.flange["T_base_flange"][100] @ s.setup.T_flange_receiver
    assert tracker.push_pose(t[200], at[:3, 3]) == "accepted"
    assert tracker.push_joints(t[200], s.flange["T_base_flange"][100]) == "accepted"


def test_the_order_of_arrival_does_not_matter() -> None:
    s = recording("stop-and-go")
    answers = []
    for shuffled in (False, True):
        tracker = Tracker(s.setup)
        n = 400  # 0.8 s
        poses = np.flatnonzero(s.tracker["t"] < 0.75)
        early, late = (poses[::2], poses[1::2][::-1]) if shuffled else (np.sort(poses), poses[:0])
        given = [*early, *late]
        tracker.push_imu_rows(s.imu["t"][:2], s.imu["gyro"][:2], s.imu["accel"][:2])
        for k in range(2, n):
            tracker.push_imu(s.imu["t"][k], s.imu["gyro"][k], s.imu["accel"][k])
            now = s.imu["t"][k]
            while given and not shuffled and s.tracker["t"][given[0]] <= now:
                j = given.pop(0)
                tracker.push_pose(s.tracker["t"][j], s.tracker["position"][j], s.tracker["orientation"][j])
            if shuffled and k % 100 == 99:  # what is of the last 0.2 s, newest first
                mine = sorted(
                    (j for j in given if now - 0.2 <= s.tracker["t"][j] <= now),
                    key=lambda j: -s.tracker["t"][j],
                )
                for j in mine:
                    tracker.push_pose(
                        s.tracker["t"][j], s.tracker["position"][j], s.tracker["orientation"][j]
                    )
                    given.remove(j)
        answers.append(tracker.predict(tracker.now))
    assert np.allclose(answers[0].T_base_tool, answers[1].T_base_tool, atol=1e-12, rtol=0) and np.allclose(
        answers[0].covariance, answers[1].covariance, atol=1e-12, rtol=0
    )


def test_options_are_checked_and_a_typo_raises() -> None:
    with pytest.raises(TypeError, match="FilterOptions has no 'windwo'; choose from window"):
        FilterOptions(windwo=1.0)
    with pytest.raises(InputError, match="window must be above 0"):
        Tracker(
            TrackSetup(),
            TrackOptions(filter=FilterOptions(window=-1.0)),
        )
    with pytest.raises(InputError, match="seconds must be above 0"):
        simulate_streams(ROBOT, seconds=-1.0)
    with pytest.raises(InputError, match=r"gyro must have shape \(2, 3\)"):
        Tracker(TrackSetup()).push_imu_rows([0.0, 0.01], np.zeros((2, 2)), np.zeros((2, 3)))


def test_options_are_values() -> None:
    options = TrackOptions(modes=ModalModel([0.6], [0.02]), limits=CorrectionLimits(position=0.1))
    options.filter.window = 0.4
    again = pickle.loads(pickle.dumps(options))
    assert (again.filter.window, again.limits.position, again.modes.frequency.tolist()) == (0.4, 0.1, [0.6])
    assert options.replace(coast_position=0.5).coast_position == 0.5 and options.coast_position != 0.5


# ---- Replay --------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", ["gentle", "stop-and-go"])
def test_predictions_beat_what_is_simpler(motion: str) -> None:
    for row in horizon_errors(played(motion).graded):
        assert row["truing"]["n"] > 400
        noise = 1e-3 * np.sqrt(3)  # of the tracker samples that predictions are graded against
        best = min(row[name]["rms_m"] for name in BASELINES)
        assert row["truing"]["rms_m"] < best
        if row["horizon_s"] == 0.04:
            assert row["truing"]["rms_m"] < 1.5 * noise < best


def test_every_row_of_the_plan_has_one_compensation() -> None:
    p, s = played(), recording()
    rows = p.compensation
    assert len(p.rows) == len(s.plan["t"]) == len(rows["t"])
    assert np.allclose(rows["t"], s.plan["t"] + s.setup.actuator_lag, atol=1e-12)
    made = rows["made"]
    assert made.sum() > 1100 and not made[rows["t"] > 12.1].any()
    assert (rows["t"][made] - rows["made_at"][made] > 0.035).all() and (
        rows["t"][made] - rows["made_at"][made] < 0.0401 + 2e-3
    ).all()
    # what is wanted is the plan minus what is predicted; what is sent follows it within the limits
    away = rows["T_base_tool_planned"][made][:, :3, 3] - rows["T_base_tool"][made][:, :3, 3]
    assert np.abs(rows["wanted"][made][:, :3] - away).max() < 1e-12
    settled = made & (rows["t"] > 4.0)
    trailing = rows["correction"][settled][:, :3] - rows["wanted"][settled][:, :3]
    assert np.sqrt(np.mean(np.sum(trailing**2, axis=1))) < 0.1 * np.sqrt(
        np.mean(np.sum(rows["wanted"][settled][:, :3] ** 2, axis=1))
    )
    off = np.abs(rows["correction"] - rows["wanted"]).max(axis=1) > 1e-3
    assert (np.asarray(rows["limited"])[made] == off[made]).all()
    free = made
    corrected = rows["T_base_flange"][free] @ np.asarray(s.setup.T_flange_tool)
    assert np.allclose(
        corrected[:, :3, 3],
        rows["T_base_tool_planned"][free][:, :3, 3] + rows["correction"][free][:, :3],
        atol=1e-12,
    )


def test_the_truth_is_within_what_is_said() -> None:
    s, rows = recording("stop-and-go"), played("stop-and-go").compensation
    use = rows["made"] & (rows["t"] > 5.0) & (rows["t"] < 12.0)
    true = s.tool_at(rows["t"][use])
    predicted = rows["T_base_tool"][use]
    e = np.column_stack(
        [
            true[:, :3, 3] - predicted[:, :3, 3],
            rotation_vectors(true[:, :3, :3] @ np.swapaxes(predicted[:, :3, :3], 1, 2)),
        ]
    )
    sigma = np.sqrt(np.einsum("nii->ni", rows["covariance"][use].reshape(-1, 6, 6)))
    assert np.mean(np.abs(e) <= 3 * sigma) > 0.97


def test_the_truth_is_within_what_is_said_where_frames_are_off_as_the_setup_says() -> None:
    """2 mm and 1 mrad, seeds 1 to 8. By the filter's covariance alone squares were hundreds of times too
    large."""
    s = recording("stop-and-go")
    sigma = np.array([2e-3] * 3 + [1e-3] * 3)
    squares = []
    for seed in range(1, 9):
        random = np.random.default_rng(seed)
        frames = {}
        for name in ("T_tracker_base", "T_flange_receiver"):
            by, T = sigma * random.normal(size=6), np.array(getattr(s.setup, name))
            T[:3, 3] += by[:3]
            T[:3, :3] = Rotation.from_rotvec(by[3:]).as_matrix() @ T[:3, :3]
            frames[name] = T
        where = SetupData(s.setup.replace(**frames), {name: np.diag(sigma**2) for name in frames})
        rows = truing.replay(s.recorded, where.setup).compensation
        use = rows["made"] & (rows["t"] > 5.0) & (rows["t"] < 12.0)
        true, predicted = s.tool_at(rows["t"][use]), rows["T_base_tool"][use]
        turned = rotation_vectors(true[:, :3, :3] @ np.swapaxes(predicted[:, :3, :3], 1, 2))
        e = np.column_stack([true[:, :3, 3] - predicted[:, :3, 3], turned])
        filtered = rows["covariance"][use].reshape(-1, 6, 6)
        squares.append(
            [
                np.mean(np.einsum("ni,ni->n", e, np.linalg.solve(P, e[:, :, None])[:, :, 0])) / 6
                for P in (tool_covariance(where, predicted, filtered), filtered)
            ]
        )
    said, by_filter = np.mean(squares, axis=0)
    assert 0.5 < said < 2.0
    assert by_filter > 100.0


def test_nothing_is_used_before_it_arrived() -> None:
    """What comes after a time does not change what was said before it."""
    s = recording()
    whole = played().compensation
    cut = RecordedStreams()
    for name, take in (("imu", s.imu), ("tracker", s.tracker), ("flange", s.flange), ("plan", s.plan)):
        early = take["arrival"] < 6.0
        getattr(cut, f"set_{name}")(**{key: values[early] for key, values in take.items()})
    part = truing.replay(cut, s.setup).compensation
    both = part["made"]
    same = slice(None, len(both))
    assert both.sum() > 500 and (whole["made"][same][both]).all()
    for name in ("T_base_tool", "correction", "covariance"):
        assert (part[name][both] == whole[name][same][both]).all(), name


def test_an_unknown_clock_offset_is_found() -> None:
    p = played(offset=0.008)
    assert abs(p.clock.offset - 0.008) < 3 * p.clock.sigma + 1e-4 and p.clock.sigma < 2e-3
    assert p.timeline["sigma"][0] > 5 * p.timeline["sigma"][-1]


def test_a_dropout_coasts_and_comes_back() -> None:
    s = simulate_streams(ROBOT, seconds=10.0, imu_rate=500.0, dropouts=[(5.0, 1.5)], seed=3)
    p = truing.replay(s.recorded, s.setup)
    t, status = p.timeline["t"], np.array(p.timeline["status"])
    assert set(status[(t > 5.4) & (t < 6.4)]) <= {"coasting", "hold"} and set(
        status[(t > 7.5) & (t < 9.9)]
    ) == {"valid"}
    rows = p.compensation
    use = rows["made"]
    step = np.linalg.norm(np.diff(rows["correction"][use][:, :3], axis=0), axis=1)
    assert step.max() <= 1.001 * CorrectionLimits().position_rate * 0.01


def test_a_shifted_base_station_is_said() -> None:
    s = simulate_streams(
        ROBOT,
        seconds=16.0,
        imu_rate=500.0,
        shifts=[(10.0, truing.frame_from_xyz_rpy([0.02, 0.0, 0.0], [0.0, 0.0, 0.004]))],
        seed=4,
    )
    p = truing.replay(s.recorded, s.setup)
    assert len(p.shifts) == 1 and 9.5 < p.shifts[0].t < 11.0 and p.shifts[0].flagged < 12.5
    assert not played().shifts


def test_modes_are_learnt_from_the_start_and_used_from_then_on() -> None:
    s = recording("stop-and-go", seconds=24.0)
    p = truing.replay(s.recorded, s.setup, learn_modes=15.0)
    assert p.modes.model.count >= 1 and 14.5 < p.modes_from < 15.5
    true = np.array([mode.frequency for mode in s.modes])
    assert min(abs(p.modes.model.frequency[0] / true - 1)) < 0.15
    t, by = p.compensation["made_at"], np.array(p.compensation["predictor"])
    assert "modes" not in set(by[t < p.modes_from - 0.1])
    timeline = p.timeline
    assert (timeline["frequencies"][timeline["t"] < p.modes_from - 0.1] == 0).all() and (
        timeline["frequencies"][-1][: p.modes.model.count] > 0.3
    ).all()
    # given from the start they are taken where they predict better
    given = truing.replay(s.recorded, s.setup, TrackOptions(modes=p.modes.model))
    assert "modes" in set(given.compensation["predictor"])


def test_a_tracker_without_orientations_is_not_taken_for_more_than_it_is() -> None:
    s = recording()
    streams = s.recorded
    streams.set_tracker(s.tracker["t"], s.tracker["position"], None, s.tracker["arrival"])
    graded = truing.replay(streams, s.setup).graded
    use = (graded["horizon"] == 0.04) & (graded["t"] > 5.0)
    assert set(graded["dimensions"][use]) == {3.0} and np.mean(graded["squares"][use]) < 9.0


def test_progress_is_told_and_may_stop() -> None:
    s = recording()
    heard: list[float] = []

    def stop_half_way(share: float) -> bool:
        heard.append(share)
        return share < 0.5

    p = truing.replay(s.recorded, s.setup, progress=stop_half_way)
    assert 40 < len(heard) < 60 and 0.5 <= heard[-1] < 0.52 and heard == sorted(heard)
    assert p.timeline["t"][-1] < 8.0


def test_ctrl_c_stops_a_replay() -> None:
    import signal

    s = recording()

    def interrupt(share: float) -> bool:
        if 0.3 < share < 0.32:
            signal.raise_signal(signal.SIGINT)
        return True

    with pytest.raises(KeyboardInterrupt):
        truing.replay(s.recorded, s.setup, progress=interrupt)


def test_gravity_need_not_be_along_z() -> None:
    """A base that is tilted by 10 degrees."""
    tilt = truing.frame_from_xyz_rpy([0.0, 0.0, 0.0], [0.17, 0.0, 0.0])[:3, :3]
    robot = ROBOT.copy()
    robot.gravity = tilt @ [0.0, 0.0, -9.81]
    s = simulate_streams(robot, seconds=8.0, imu_rate=500.0, seed=1)
    assert np.allclose(s.setup.gravity, robot.gravity)
    row: dict[str, Any] = next(
        row for row in horizon_errors(truing.replay(s.recorded, s.setup).graded) if row["horizon_s"] == 0.04
    )
    assert row["truing"]["rms_m"] < 4e-3
    wrong = next(
        row
        for row in horizon_errors(
            truing.replay(s.recorded, s.setup.replace(gravity=[0.0, 0.0, -9.81])).graded
        )
        if row["horizon_s"] == 0.04
    )
    assert wrong["truing"]["rms_m"] > 1.3 * row["truing"]["rms_m"]
