# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing track calibrate`: the truth within its standard errors, clocks included; what the data do not show
is said, and nothing is written.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from pages import charts_of, visible
from tables import columns
from truing import InputError
from truing.cli import main
from truing.examples import example
from truing.files import write_table
from truing.files.stream_file import (
    ImuData,
    JointData,
    PoseData,
    TrackerData,
    save_imu,
    save_joints,
    save_plan,
    save_tracker,
)
from truing.model import flange_poses
from truing.rotations import quaternions_from_rotations, rotation_vectors, rotations_from_quaternions
from truing.tracking import TrackCalibration, TrackSetup, calibrate_inertial, calibrate_tool
from truing.tracking.api import white_noise

Floats = NDArray[np.float64]
ROBOT = truing.load_robot(example("ur10"))
TRUE = TrackSetup(
    T_tracker_base=truing.frame_from_xyz_rpy([2.0, -1.0, 0.5], [0.02, -0.03, 2.1]),
    T_flange_receiver=truing.frame_from_xyz_rpy([0.05, 0.03, 0.10], [0.3, -0.2, 1.0]),
    T_flange_imu=truing.frame_from_xyz_rpy([0.02, -0.04, 0.06], [-0.1, 0.2, -0.7]),
    clock_offset=0.35,
    controller_clock_offset=0.12,
    actuator_lag=0.05,
)
POSITION_NOISE, ROTATION_NOISE = 2e-4, 3e-4


@dataclasses.dataclass(frozen=True)
class Recording:
    imu: ImuData
    tracker: TrackerData
    joints: JointData
    plan: PoseData


def smooth(x: Floats) -> Floats:
    """From 0 to 1 with speed and acceleration 0 at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10 - 15 * x + 6 * x**2)


@functools.cache
def recording(seed: int = 1, positions: int = 12, rest: float = 3.4, turns: float = 0.9) -> Recording:
    """A stiff arm that goes from test position to test position. Stamps of all devices differ."""
    rng = np.random.default_rng(seed)
    stops = np.array([0.0, -1.2, 1.2, -1.0, 0.8, 0.0]) + turns * rng.uniform(-1.0, 1.0, (positions, 6)) * [
        1,
        0.4,
        0.6,
        1,
        1,
        1,
    ]
    move, start = 2.2, 1.0
    length = start + (positions - 1) * (move + rest) + rest

    def joints_at(t: Floats) -> Floats:
        q = np.tile(stops[0], (len(t), 1))
        for k in range(1, positions):
            q += smooth((t - start - rest - (k - 1) * (move + rest)) / move)[:, None] * (
                stops[k] - stops[k - 1]
            )
        return q

    def flange_at(t: Floats) -> Floats:
        return np.asarray(flange_poses(ROBOT, joints_at(t)))

    h = 1e-3
    t = np.arange(0.01, length, 0.005)
    before, now, after = (flange_at(t + step) @ np.asarray(TRUE.T_flange_imu) for step in (-h, 0.0, h))
    gyro = rotation_vectors(np.swapaxes(before[:, :3, :3], 1, 2) @ after[:, :3, :3]) / (2 * h)
    acceleration = (before + after - 2 * now)[:, :3, 3] / h**2
    accel = np.einsum("nji,nj->ni", now[:, :3, :3], acceleration - [0, 0, -9.81])
    imu = ImuData(
        Path("imu.csv"),
        t,
        gyro + [0.002, -0.001, 0.003] + 1e-3 * rng.normal(size=gyro.shape),
        accel + [0.02, -0.03, 0.01] + 1e-2 * rng.normal(size=gyro.shape),
    )
    t = np.arange(0.013, length, 0.01)
    T = np.asarray(TRUE.T_tracker_base) @ flange_at(t) @ np.asarray(TRUE.T_flange_receiver)
    w = ROTATION_NOISE * rng.normal(size=(len(t), 3))
    noisy = T[:, :3, :3] @ (np.eye(3) + np.stack([np.cross(np.eye(3), -v) for v in w]))
    tracker = TrackerData(
        Path("tracker.csv"),
        t + TRUE.clock_offset,
        T[:, :3, 3] + POSITION_NOISE * rng.normal(size=(len(t), 3)),
        quaternions_from_rotations(noisy),
    )
    t = np.arange(0.0, length, 0.008)
    joints = JointData(Path("joints.csv"), t + TRUE.controller_clock_offset, joints_at(t))
    t = np.arange(0.0, length + 0.5, 0.01)
    plan = PoseData(
        Path("plan.csv"), t + TRUE.controller_clock_offset, flange_at(t + TRUE.actuator_lag) @ tool()
    )
    return Recording(imu, tracker, joints, plan)


def tool() -> Floats:
    frames = truing.forward_kinematics(ROBOT, np.zeros(6))
    return np.asarray(np.linalg.inv(frames[-2]) @ frames[-1])


@functools.cache
def calibrated(seed: int = 1) -> TrackCalibration:
    r = recording(seed)
    return truing.track_calibrate(ROBOT, r.joints, r.tracker, r.imu, plan=r.plan)


def errors(found: TrackCalibration, name: str) -> tuple[Floats, Floats]:
    """Found minus true, and the standard errors."""
    F, T = np.asarray(getattr(found.where.setup, name)), np.asarray(getattr(TRUE, name))
    e = np.concatenate([F[:3, 3] - T[:3, 3], rotation_vectors((F[:3, :3] @ T[:3, :3].T)[None])[0]])
    return e, np.sqrt(np.diag(found.where.covariance[name]))


# ---- What is found -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["T_tracker_base", "T_flange_receiver", "T_flange_imu"])
def test_frames_are_within_their_standard_errors(name: str) -> None:
    found = calibrated()
    assert found.status == "done" and len(found.positions) == 12
    e, sigma = errors(found, name)
    assert (np.abs(e) < 4.5 * sigma + 1e-6).all(), (e, sigma)
    assert np.abs(e[:3]).max() < (5e-3 if name == "T_flange_imu" else 1e-3) and np.abs(e[3:]).max() < 5e-3


def test_three_clocks_are_told_apart() -> None:
    found, setup = calibrated(), calibrated().where.setup
    assert found.inertial is not None and found.inertial.rich_enough and not found.same_clock
    assert setup.clock_offset == pytest.approx(TRUE.clock_offset, abs=2e-3)
    assert setup.controller_clock_offset == pytest.approx(TRUE.controller_clock_offset, abs=6e-3)
    assert found.actuator_lag == pytest.approx(TRUE.actuator_lag, abs=2e-3)


def test_the_biases_that_were_found_stand_in_the_set_up() -> None:
    found, setup = calibrated(), calibrated().where.setup
    assert found.inertial is not None
    assert (setup.gyro_bias == found.inertial.gyro_bias).all()
    assert (setup.accel_bias == found.inertial.accel_bias).all()
    assert 0 < setup.gyro_bias_sigma < 1e-3
    assert 0 < setup.accel_bias_sigma < 0.1


def test_devices_that_began_at_other_times_are_aligned_and_it_is_said() -> None:
    r = recording()
    imu = dataclasses.replace(r.imu, t=r.imu.t + 600.0)
    tracker = dataclasses.replace(r.tracker, t=r.tracker.t - 600.0)
    found = truing.track_calibrate(ROBOT, r.joints, tracker, imu)
    assert found.status == "done"
    setup = found.where.setup
    assert setup.controller_clock_offset == pytest.approx(TRUE.controller_clock_offset - 600.0, abs=6e-3)
    assert setup.clock_offset == pytest.approx(TRUE.clock_offset - 1200.0, abs=3e-3)
    assert any("began at other times" in note for note in found.notes)
    # a set-up of the day before, when the clocks were others
    before = calibrated().where
    with pytest.warns(truing.InputWarning, match=r"joints.csv: joints .* moved by \+600\.\d+ s") as told:
        streams = truing.recorded_streams(ROBOT, before, imu=imu, tracker=tracker, joints=r.joints)
    assert any("tracker.csv: tracker" in str(w.message) for w in told)
    inside = truing.replay(streams, before.setup, before.options(), horizons=[0.04]).graded
    assert (inside["dimensions"] == 6).mean() > 0.8
    settled = inside["t"] > inside["t"].min() + 5.0
    assert np.median(np.linalg.norm(inside["position"][settled], axis=1)) < 2e-3


def test_gravity_and_noise_are_found() -> None:
    found = calibrated()
    assert np.allclose(found.where.setup.gravity, [0, 0, -9.81], atol=0.05)
    imu = recording().imu
    assert white_noise(imu.gyro, 100) == pytest.approx(1e-3, rel=0.1) and white_noise(
        imu.accel, 100
    ) == pytest.approx(1e-2, rel=0.1)
    # what is taken is what predicts best, and never less than what is seen
    noise = found.where.filter
    assert noise["gyro_noise"] >= 0.9 * 1e-3 * np.sqrt(0.005) and noise[
        "accel_noise"
    ] >= 0.9 * 1e-2 * np.sqrt(0.005)
    assert noise["position_sigma"] == pytest.approx(POSITION_NOISE, rel=0.15) or noise[
        "position_sigma"
    ] == pytest.approx(3 * POSITION_NOISE, rel=0.15)


def test_a_drifting_clock_is_found_and_taken_off() -> None:
    r = recording()
    fast = dataclasses.replace(r.tracker, t=r.tracker.t * (1 + 1e-3))
    found = truing.track_calibrate(ROBOT, r.joints, fast, r.imu)
    assert found.where.clock_drift == pytest.approx(1e-3, abs=5e-5) and any(
        re.search(r"drifts by -(9|10)\d\d ppm.* Hz", note) for note in found.notes
    )
    assert calibrated().where.clock_drift == 0.0
    e = np.asarray(found.where.setup.T_tracker_base)[:3, 3] - np.asarray(TRUE.T_tracker_base)[:3, 3]
    assert np.abs(e).max() < 1e-3
    steady = found.where.steady(fast.t) - found.where.setup.clock_offset
    assert np.abs(steady - (r.tracker.t - TRUE.clock_offset)).max() < 4e-3


def test_the_tool_is_the_robot_files_or_that_of_prescribed_poses() -> None:
    assert np.allclose(calibrated().where.setup.T_flange_tool, tool(), atol=1e-12)
    r, rng = recording(), np.random.default_rng(7)
    true = truing.frame_from_xyz_rpy([0.1, -0.05, 0.3], [0.2, 0.1, -0.4])
    joints = np.array([0.0, -1.2, 1.2, -1.0, 0.8, 0.0]) + 0.4 * rng.uniform(-1, 1, (40, 6))
    flange = flange_poses(ROBOT, joints)
    pivots = [F for F in flange]
    tip = np.array([0.7, 0.1, 0.5])
    moved = np.array(
        [
            np.block(
                [
                    [F[:3, :3], (tip - F[:3, :3] @ true[:3, 3] + 1e-4 * rng.normal(size=3))[:, None]],
                    [np.zeros((1, 3)), np.ones((1, 1))],
                ]
            )
            for F in pivots
        ]
    )
    found = calibrate_tool(moved, flange[:4], [F[:3, :3] @ true[:3, :3] for F in flange[:4]])
    assert (
        found.status == "done"
        and np.allclose(found.T_flange_tool.T, true, atol=3e-4)
        and len(found.pivot_error) == 40
    )
    assert len(r.joints.t) > 0


def test_a_position_that_is_off_is_reported_and_counts_little() -> None:
    r = recording()
    rest = calibrated().positions[5]
    at = (r.tracker.t - 0.23 > rest.start - 0.5) & (r.tracker.t - 0.23 < rest.end + 0.5)
    bumped = dataclasses.replace(
        r.tracker, position=r.tracker.position + np.where(at[:, None], [0.02, 0.0, 0.01], 0.0)
    )
    found = truing.track_calibrate(ROBOT, r.joints, bumped)
    worst = max(range(len(found.frames.errors)), key=lambda k: found.frames.errors[k].position)
    assert worst == 5 and found.frames.errors[5].position > 0.015 and found.frames.errors[5].weight < 0.1
    assert (
        np.linalg.norm(
            np.asarray(found.where.setup.T_tracker_base)[:3, 3] - np.asarray(TRUE.T_tracker_base)[:3, 3]
        )
        < 1.5e-3
    )


def test_an_arm_that_never_stands_still_is_calibrated_from_its_motion() -> None:
    r = recording(2, 12, 0.2)
    found = truing.track_calibrate(ROBOT, r.joints, r.tracker, r.imu)
    assert (
        found.status == "done"
        and not found.positions
        and any("frames come from the motion" in note for note in found.notes)
    )
    assert (
        np.linalg.norm(
            np.asarray(found.where.setup.T_tracker_base)[:3, 3] - np.asarray(TRUE.T_tracker_base)[:3, 3]
        )
        < 5e-3
    )


def test_slow_motion_is_not_rich_enough_and_advice_is_given() -> None:
    r = recording(3, 8, 3.4, 0.04)
    imu = calibrate_inertial(
        r.imu.t,
        r.imu.gyro,
        r.imu.accel,
        r.tracker.t - 0.35,
        r.tracker.position,
        r.tracker.orientation,
        clock_wanted=1e-5,
    )
    assert not imu.rich_enough and "rad/s" in (imu.advice or imu.message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: dataclasses.replace(t, position=t.position * [1, -1, 1]), "receiver y has the wrong sign"),
        (
            lambda t: dataclasses.replace(t, orientation=t.orientation[:, [1, 2, 3, 0]]),
            "are x y z w and were read as w x y z",
        ),
        (lambda t: dataclasses.replace(t, position=1000 * t.position), "mm|unit|1000"),
    ],
)
def test_frames_that_cannot_be_are_named(change: Any, message: str) -> None:
    import re

    r = recording()
    found = truing.track_calibrate(ROBOT, r.joints, change(r.tracker), r.imu)
    assert found.status != "done" and re.search(message, found.message + " ".join(found.notes)), (
        found.message,
        found.notes,
    )
    assert "board" not in found.message and "reading" not in found.message


def test_a_receiver_that_is_mounted_elsewhere_is_refused() -> None:
    """By 18 cm."""
    r = recording()
    setup = truing.track_calibrate(ROBOT, r.joints, r.tracker, r.imu).where.setup
    elsewhere = np.array(setup.T_flange_receiver)
    elsewhere[:3, 3] += [0.12, -0.12, 0.06]
    moved = setup.replace(T_flange_receiver=elsewhere)
    with pytest.raises(InputError, match=r"the receiver is 0\.1.* m from .* turns with the flange"):
        truing.recorded_streams(ROBOT, moved, imu=r.imu, joints=r.joints, tracker=r.tracker)


def test_a_specific_force_with_the_other_sign_is_named() -> None:
    r = recording()
    found = truing.track_calibrate(ROBOT, r.joints, r.tracker, dataclasses.replace(r.imu, accel=-r.imu.accel))
    assert found.status == "not consistent" and "specific force has the other sign" in found.message


def test_a_tracker_without_orientations_is_refused() -> None:
    r = recording()
    with pytest.raises(InputError, match="there are no columns qw qx qy qz"):
        truing.track_calibrate(ROBOT, r.joints, dataclasses.replace(r.tracker, orientation=None))


# ---- The command ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, r = tmp_path_factory.mktemp("recording"), recording()
    save_imu(folder / "imu.csv", r.imu.t, r.imu.gyro, r.imu.accel)
    save_tracker(folder / "tracker.csv", r.tracker.t, r.tracker.position, r.tracker.orientation)
    save_joints(folder / "joints.csv", ROBOT, r.joints.t, r.joints.joints)
    save_plan(folder / "plan.csv", r.plan.t, r.plan.T)
    return folder


def streams(folder: Path, *names: str) -> list[str]:
    return [word for name in names for word in (f"--{name}", str(folder / f"{name}.csv"))]


def test_calibrate_then_run(files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = str(example("ur10"))
    assert (
        main(
            [
                "track",
                "calibrate",
                robot,
                *streams(files, "joints", "tracker", "imu", "plan"),
                "--out",
                str(tmp_path / "found"),
            ]
        )
        == 0
    )
    out = capsys.readouterr().out
    assert (
        out.strip().splitlines()[-1] == f"report: {tmp_path / 'found/report.html'}"
        and "12 test positions" in out
    )
    assert {path.name for path in (tmp_path / "found").iterdir()} == {
        "result.json",
        "report.html",
        "setup.yaml",
    }
    result = json.loads((tmp_path / "found/result.json").read_text())
    assert (
        result["format"] == "truing-track-calibration/1"
        and result["status"] == "done"
        and len(result["positions"]["errors"]) == 12
    )
    assert result["clock"]["rich_enough"] is True and set(result["frames"]) == {
        "T_tracker_base",
        "T_flange_receiver",
        "T_flange_tool",
        "T_flange_imu",
    }
    page = (tmp_path / "found/report.html").read_text()
    text, charts = visible(page), charts_of(page)
    assert (
        text.index("Tracker and robot agree to")
        < text.index("Error of each position")
        < text.index("The motion was rich enough")
        < text.index("Frames")
        < text.index("Clocks")
    )
    assert {"positions", "rotations"} <= set(charts) and len(charts["positions"]["data"][0]["x"]) == 12

    setup = truing.load_setup(tmp_path / "found/setup.yaml")
    assert (
        setup.setup.clock_offset == pytest.approx(TRUE.clock_offset, abs=2e-3)
        and "T_flange_imu" in setup.covariance
    )
    assert (
        main(
            [
                "track",
                "run",
                robot,
                "--setup",
                str(tmp_path / "found/setup.yaml"),
                *streams(files, "joints", "tracker", "imu", "plan"),
                "--out",
                str(tmp_path / "run"),
            ]
        )
        == 0
    )
    run = json.loads((tmp_path / "run/result.json").read_text())
    at = next(row for row in run["errors"] if row["horizon_s"] == 0.04)
    assert (
        at["truing"]["rms_m"] < 2.5e-3
        and len(columns(tmp_path / "run/compensation.csv")["t_s"]) == run["rows"]
    )


def test_prescribed_poses_of_the_tool_are_read(files: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    n = 6
    q = np.array([0.0, -1.2, 1.2, -1.0, 0.8, 0.0]) + 0.4 * rng.uniform(-1, 1, (n, 6))
    table = {f"q{k + 1}_deg": np.degrees(q[:, k]) for k in range(6)} | {
        "kind": ["pivot"] * 4 + ["orientation"] * 2
    }
    turned = quaternions_from_rotations(np.asarray(flange_poses(ROBOT, q))[:, :3, :3])
    write_table(
        tmp_path / "tool.csv",
        table
        | {
            part: np.where(np.arange(n) < 4, np.nan, turned[:, k])
            for k, part in enumerate(("qw", "qx", "qy", "qz"))
        },
    )
    poses = truing.load_tool_poses(tmp_path / "tool.csv", ROBOT)
    assert np.allclose(poses.pivot, q[:4], atol=1e-12) and np.allclose(poses.orientation, q[4:], atol=1e-12)
    assert np.allclose(poses.prescribed, rotations_from_quaternions(turned[4:]), atol=1e-12)
    write_table(tmp_path / "bad.csv", {**table, "kind": ["pivot"] * 5 + ["tip"]})
    with pytest.raises(
        InputError, match=r"line 7, column 'kind': found 'tip', expected pivot or orientation"
    ):
        truing.load_tool_poses(tmp_path / "bad.csv", ROBOT)


def test_what_does_not_show_is_said_and_no_set_up_is_written(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A left-handed tracker; the set-up of an earlier run goes, so that it is not taken for this one's."""
    r = recording()
    save_tracker(
        tmp_path / "tracker.csv", r.tracker.t, r.tracker.position * [1, -1, 1], r.tracker.orientation
    )
    (tmp_path / "out").mkdir()
    (tmp_path / "out/setup.yaml").write_text("of an earlier run")
    code = main(
        [
            "track",
            "calibrate",
            str(example("ur10")),
            *streams(files, "joints", "imu"),
            "--tracker",
            str(tmp_path / "tracker.csv"),
            "--out",
            str(tmp_path / "out"),
        ]
    )
    result = json.loads((tmp_path / "out/result.json").read_text())
    assert (
        code == 1
        and result["status"] != "done"
        and result["frames"] is None
        and not (tmp_path / "out/setup.yaml").exists()
    )
    assert result["message"] in capsys.readouterr().err.replace("\n", " ")
    assert "No set-up is written" in visible((tmp_path / "out/report.html").read_text())
