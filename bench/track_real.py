# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking on a recorded arm with three clocks: the section of docs/benchmarks/real-robots.md between its \
markers.

    python bench/track_real.py --data FOLDER

FOLDER as for bench/real_data.py. Clocks and frames are found from the first part of the time; predictions are
graded on the rest, against the tracker's own later samples.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import truing
from truing.rotations import interpolated, quaternions_from_rotations, rotation_vectors
from truing.tracking import InertialResult, TrackCalibration, calibrate_inertial
from truing.tracking.result import BASELINES, horizon_errors

Floats = NDArray[np.float64]

ROOT = Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- track: written by bench/track_real.py -->", "<!-- end of track -->"
FITTED = 0.5  # fraction of the tracker's time that clocks and frames are found from
# what the sensor's data sheet allows its scale to be off: the recording does not show it apart from gravity
IMU_SCALE = 0.015
HORIZONS = [0.02, 0.04, 0.08]
LOW_PASS = 6.0  # [Hz] of the baseline for the inertial part
TRAINED = 0.7


def cut(data: Any, keep: NDArray[np.bool_]) -> Any:
    """Some rows of a stream."""
    return dataclasses.replace(
        data,
        **{
            f.name: getattr(data, f.name)[keep]
            for f in dataclasses.fields(data)
            if isinstance(getattr(data, f.name), np.ndarray)
        },
    )


def with_tracker(
    folder: Path,
) -> tuple[TrackCalibration, list[dict[str, Any]]]:
    """What was found on the first part, and errors of predictions on the rest."""
    robot = truing.load_robot(folder / "robot.yaml")
    imu, tracker, joints = (
        truing.load_imu(folder / "imu.csv"),
        truing.load_tracker(folder / "tracker.csv"),
        truing.load_joints(folder / "joints.csv", robot),
    )
    middle = tracker.t[0] + FITTED * (tracker.t[-1] - tracker.t[0])
    whole = truing.track_calibrate(
        robot, joints, tracker, imu
    )  # for the offsets alone: where to cut the other streams
    shift, between = (
        float(middle - (whole.where.steady(np.array([middle])) - whole.where.setup.clock_offset)[0]),
        whole.where.setup.controller_clock_offset,
    )
    found = truing.track_calibrate(
        robot,
        cut(joints, joints.t - between < middle - shift),
        cut(tracker, tracker.t < middle),
        cut(imu, imu.t < middle - shift),
    )
    where = dataclasses.replace(found.where, filter={**found.where.filter, "imu_scale": IMU_SCALE})
    later = imu.t >= middle - shift, tracker.t >= middle, joints.t - between >= middle - shift
    streams = truing.recorded_streams(
        robot, where, imu=cut(imu, later[0]), tracker=cut(tracker, later[1]), joints=cut(joints, later[2])
    )
    played = truing.replay(streams, where.setup, where.options(), horizons=HORIZONS)
    return found, horizon_errors(played.graded)


def low_passed(values: Floats, rate: float) -> Floats:
    """Without what is above LOW_PASS. shape=(n, 3)"""
    spectrum = np.fft.rfft(values, axis=0)
    spectrum[np.fft.rfftfreq(len(values), 1.0 / rate) > LOW_PASS] = 0.0
    return np.fft.irfft(spectrum, n=len(values), axis=0)


def turned_alike(gyro: Floats, rates: Floats) -> tuple[Floats, Floats]:
    """R and b of gyro = rates R + b in the least squares (Wahba 1965). shape=(n, 3)"""
    u, _, vt = np.linalg.svd((rates - rates.mean(axis=0)).T @ (gyro - gyro.mean(axis=0)))
    R = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return R, gyro.mean(axis=0) - rates.mean(axis=0) @ R


def without_tracker(folder: Path) -> tuple[InertialResult, float, float, float]:
    """The inertial sensor against the flange of the encoders, which stands in for the tracker; then by
    turning rates alone: t_imu = t_joints - offset [s], rms of the gyro's misfit on the last
    part, and of the rates [rad/s]."""
    robot = truing.load_robot(folder / "robot.yaml")
    imu, joints = truing.load_imu(folder / "imu.csv"), truing.load_joints(folder / "joints.csv", robot)
    flange = truing.model.flange_poses(robot, joints.joints)
    middle, rate = joints.t[0] + TRAINED * (joints.t[-1] - joints.t[0]), 100.0
    early = joints.t < middle
    found = calibrate_inertial(
        imu.t,
        imu.gyro,
        imu.accel,
        joints.t[early],
        flange[early, :3, 3],
        quaternions_from_rotations(flange[early, :3, :3]),
    )

    def pair(start: float, end: float, offset: float) -> tuple[Floats, Floats]:
        """Gyro and the model's rates in the flange, low-passed."""
        t, h = np.arange(start, end, 1.0 / rate), 0.5 / rate
        before, after = (interpolated(joints.t, flange, t + offset + step)[:, :3, :3] for step in (-h, h))
        gyro = np.column_stack([np.interp(t, imu.t, imu.gyro[:, k]) for k in range(3)])
        return low_passed(gyro, rate), low_passed(
            rotation_vectors(np.swapaxes(before, 1, 2) @ after) * rate, rate
        )

    def misfit(gyro: Floats, rates: Floats, R: Floats, b: Floats) -> float:
        return float(np.sqrt(np.mean(np.sum((gyro - rates @ R - b) ** 2, axis=1))))

    train, test = (joints.t[0] + 1.0, middle), (middle + 1.0, min(joints.t[-1], imu.t[-1]) - 1.0)
    offsets = found.clock_offset + np.arange(-0.03, 0.031, 0.0025)
    errors = [misfit(*both, *turned_alike(*both)) for both in (pair(*train, offset) for offset in offsets)]
    offset = float(offsets[int(np.argmin(errors))])
    R, b = turned_alike(*pair(*train, offset))
    gyro, rates = pair(*test, offset)
    return found, offset, misfit(gyro, rates, R, b), float(np.sqrt(np.mean(np.sum(rates**2, axis=1))))


def section(data: Path) -> str:
    lines = [BEGIN, "## Track", ""]
    folder = data / "aubo_i5_run0_60hz"
    if folder.is_dir():
        found, errors = with_tracker(folder)
        lines += [*setup_table(found), *prediction_table(errors)]
    else:
        lines += ["Not there: `aubo_i5_run0_60hz`.", ""]
    folder = data / "aubo_i5_run1"
    lines += inertial_paragraph(folder) if folder.is_dir() else ["Not there: `aubo_i5_run1`."]
    return "\n".join([*lines, END])


def in_millimetres(lengths: Floats, decimals: int = 1) -> str:
    return ", ".join(f"{1e3 * v:.{decimals}f}" for v in lengths)


def frame_row(what: str, frame: Any, covariance: Floats) -> str:
    """Where a frame is, with the standard errors of its position and orientation."""
    sigma = np.sqrt(np.diag(covariance))
    return (
        f"| {what} | {in_millimetres(np.asarray(frame)[:3, 3])} mm |"
        f" {in_millimetres(sigma[:3], 2)} mm; {in_millimetres(sigma[3:], 2)} mrad | |"
    )


def setup_table(found: TrackCalibration) -> list[str]:
    """Clocks and frames, beside what the recording's notes say."""
    clock, frames, inertial = found.joints_clock, found.frames, found.inertial
    assert clock is not None and inertial is not None
    setup, covariance = found.where.setup, found.where.covariance["T_flange_imu"]
    between = np.hypot(clock.sigma, inertial.clock_offset_sigma)
    drift = found.where.clock_drift
    return [
        (
            "**Aubo i5 with inertial sensor and Polaris tracker, three clocks.** Clocks and frames from"
            f" the first {100 * FITTED:.0f} % of the time, and nothing was told beforehand:"
        ),
        "",
        "| | found | standard error | told by the recording's notes |",
        "| --- | --- | --- | --- |",
        (
            f"| joints against tracker | t_joints = t_tracker {clock.offset:+.4f} s |"
            f" {1e3 * clock.sigma:.1f} ms | −6.9 s |"
        ),
        (
            f"| drift of the tracker's clock | {1e6 * drift:+.0f} ppm: its stamps say"
            f" 60 Hz, it ran at {60.0 * (1.0 + drift):.2f} Hz | | not mentioned |"
        ),
        (
            f"| inertial sensor against joints | t_imu = t_joints {-setup.controller_clock_offset:+.4f} s"
            f" | {1e3 * between:.1f} ms | lags by 0.13 s |"
        ),
        (
            f"| inertial sensor against tracker | t_imu = t_tracker {-setup.clock_offset:+.4f} s |"
            f" {1e3 * inertial.clock_offset_sigma:.1f} ms | |"
        ),
        frame_row("base in the tracker frame", setup.T_tracker_base, frames.T_tracker_base.covariance),
        frame_row("receiver on the flange", setup.T_flange_receiver, frames.T_flange_receiver.covariance),
        (
            "| inertial sensor on the flange |"
            f" {in_millimetres(np.asarray(setup.T_flange_imu)[:3, 3])} mm |"
            f" {in_millimetres(np.sqrt(np.diag(covariance))[:3])} mm | |"
        ),
        (
            f"| gravity in the base | {', '.join(f'{v:.3f}' for v in np.asarray(setup.gravity))} m/s² | |"
            " along −z |"
        ),
        (
            f"| encoders against tracker, with these frames | {1e3 * frames.position_sigma:.2f} mm a"
            " component | | 4.3 mm |"
        ),
        "",
    ]


def prediction_table(errors: list[dict[str, Any]]) -> list[str]:
    """Errors of predictions on the rest of the time, and what they say 40 ms ahead."""
    names = {
        "truing": "truing",
        "hold": "hold: the last tracker sample",
        "velocity": "tracker, finite-difference velocity",
        "fk": "forward kinematics with fitted frames",
        "fk_velocity": "the same at constant velocity",
    }
    lines = [
        (
            "Predictions of the receiver on the rest of the time, against the tracker's own later"
            " samples, position error in mm:"
        ),
        "",
        "| ahead | | rms | median | 95 % | max | samples |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in errors:
        for name, words in names.items():
            e = row[name]
            lines.append(
                f"| {1e3 * row['horizon_s']:.0f} ms | {words} | "
                + " | ".join(f"{1e3 * e[key]:.2f}" for key in ("rms_m", "median_m", "p95_m", "max_m"))
                + f" | {e['n']} |"
            )
    at = next(row for row in errors if row["horizon_s"] == 0.04)
    best = min(BASELINES, key=lambda name: at[name]["rms_m"])
    verdict = "better" if at["truing"]["rms_m"] < at[best]["rms_m"] else "no better"
    return [
        *lines,
        "",
        (
            "There is no plan in this recording, so what will be commanded is not known to any of them."
            f" 40 ms ahead truing is {verdict} than the best of the others ({names[best]}):"
            f" {1e3 * at['truing']['rms_m']:.2f} against {1e3 * at[best]['rms_m']:.2f} mm rms. Errors"
            f" squared are {at['squares_per_dimension']:.2g} of what was predicted; samples of tracker"
            " and inertial sensor arrive at their stamps, as the recording has no others."
        ),
        "",
    ]


def inertial_paragraph(folder: Path) -> list[str]:
    """What the recording without a tracker says."""
    inertial, offset, misfit, rates = without_tracker(folder)
    T = np.asarray(inertial.T_receiver_imu.T)
    return [
        (
            "**Aubo i5 without tracker, 600 s.** The flange by forward kinematics stands in for the"
            f" tracker: t_imu = t_joints {-inertial.clock_offset:+.4f} s, standard error"
            f" {1e3 * inertial.clock_offset_sigma:.1f} ms;"
        ),
        (
            f"by turning rates alone {-offset:+.4f} s (told: the inertial sensor lags by about 0.08 s):"
            " accelerometer and gyro of this sensor have filters of their own, and one offset cannot"
            " serve both. The sensor is at"
        ),
        (
            f"{', '.join(f'{1e3 * v:.0f}' for v in T[:3, 3])} mm on the flange; gravity"
            f" {np.linalg.norm(inertial.gravity):.3f} m/s². Gyro against the model's angular velocity"
            f" below {LOW_PASS:.0f} Hz, offset, one rotation and one bias found on the"
        ),
        (
            f"first {100 * TRAINED:.0f} % of the time, on the rest: **{misfit:.4f} rad/s** rms of"
            f" {rates:.2f} (baseline 0.0140, without the offset 0.0827)."
        ),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with a subfolder for each recording")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/benchmarks/real-robots.md")
    args = parser.parse_args()
    text = args.page.read_text(encoding="utf-8")
    if BEGIN not in text:
        sys.exit(f"{args.page} has no line {BEGIN}")
    head, rest = text.split(BEGIN)
    written = section(args.data)
    args.page.write_text(head + written + rest.split(END)[1], encoding="utf-8")
    print(written)


if __name__ == "__main__":
    main()
