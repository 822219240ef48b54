# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing track calibrate`` and ``track run`` found, as it is written: ``setup.yaml``,
``compensation.csv``, ``result.json``, reports.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.files import write_table
from truing.files.common import MOTIONS, frame_dict, joint_columns
from truing.files.stream_file import (
    FRAMES,
    PoseData,
    SetupData,
    pose_columns,
    save_setup,
)
from truing.report.json_text import to_json, without_nan
from truing.rotations import interpolated, rotation_vectors
from truing.tracking.api import TrackCalibration
from truing.tracking.page import Replayed, calibration_report, run_report
from truing.tracking.uncertainty import tool_covariance

RUN_FORMAT = "truing-track-run/1"
CALIBRATION_FORMAT = "truing-track-calibration/1"
BASELINES = ("hold", "velocity", "fk", "fk_velocity")
SETTLING = 5.0  # [s] of the start, in which clock and biases settle: not counted in errors
_DROPOUT = 0.25  # [s] between tracker samples

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Played:
    """A replay and what it was made from."""

    robot: _core.Robot
    where: SetupData
    played: _core.ReplayResult
    horizon: float  # [s]
    plan_t: Floats  # shape=(rows of the plan,) [s], their own stamps
    tracker_t: Floats  # shape=(n,) [s], the tracker's stamps in the inertial sensor's clock
    truth: PoseData | None = None  # of the tool, the inertial sensor's clock


# ---- Errors --------------------------------------------------------------------------------------


def error_summary(errors: Floats) -> dict[str, Any]:
    """Of lengths, shape=(n,) [m]."""
    e = errors[np.isfinite(errors)]
    if not e.size:
        return {"n": 0, "rms_m": None, "median_m": None, "p95_m": None, "max_m": None}
    return {
        "n": int(e.size),
        "rms_m": float(np.sqrt(np.mean(e**2))),
        "median_m": float(np.median(e)),
        "p95_m": float(np.quantile(e, 0.95)),
        "max_m": float(e.max()),
    }


def horizon_errors(graded: Mapping[str, Any]) -> list[dict[str, Any]]:
    """For every horizon: our error and the baselines', over the tracker samples that all of them have;
    settled ones.
    """
    t, horizon, dimensions = graded["t"], graded["horizon"], graded["dimensions"]
    start = t.min() + SETTLING if t.size else 0.0
    ours = np.linalg.norm(graded["position"], axis=1)
    rows = []
    for h in np.unique(horizon):
        there = (horizon == h) & (dimensions > 0) & (t >= start)
        common = there & np.all([np.isfinite(graded[name]) for name in BASELINES], axis=0)
        turned = there & (dimensions == 6)
        rotation = np.linalg.norm(graded["rotation"][turned], axis=1)
        rows.append(
            {
                "horizon_s": float(h),
                "truing": error_summary(ours[common]),
                **{name: error_summary(graded[name][common]) for name in BASELINES},
                "rotation_rms_rad": float(np.sqrt(np.mean(rotation**2))) if rotation.size else None,
                "predicted_sigma_m": (
                    float(np.sqrt(np.mean(graded["position_sigma"][there] ** 2))) if there.any() else None
                ),
                "squares_per_dimension": (
                    float(np.mean(graded["squares"][there] / dimensions[there])) if there.any() else None
                ),
                "lost": int(((horizon == h) & (dimensions == 0)).sum()),
            }
        )
    return rows


def against_truth(run: Played) -> dict[str, Any] | None:
    """Errors of the predictions behind compensation.csv against the true tool, and their NEES (6 expected).
    After a jump of the tracker the set-up is another one, and nothing is counted.
    """
    if run.truth is None:
        return None
    rows = run.played.compensation
    t = rows["t"]
    use = rows["made"] & (t >= run.truth.t[0]) & (t <= run.truth.t[-1]) & (t >= t.min() + SETTLING)
    if run.played.shifts:
        use &= t < run.played.shifts[0].t - 0.1
    if not use.any():
        return {**error_summary(np.empty(0)), "nees": None}
    true = interpolated(run.truth.t, run.truth.T, t[use])
    predicted = rows["T_base_tool"][use]
    e = np.column_stack(
        [
            true[:, :3, 3] - predicted[:, :3, 3],
            rotation_vectors(true[:, :3, :3] @ np.swapaxes(predicted[:, :3, :3], 1, 2)),
        ]
    )
    P = tool_covariance(run.where, predicted, rows["covariance"][use].reshape(-1, 6, 6))
    nees = np.einsum("ni,ni->n", e, np.linalg.solve(P, e[:, :, None])[:, :, 0])
    inside = np.abs(e) <= 3 * np.sqrt(np.einsum("nii->ni", P))
    uncorrected = np.linalg.norm(true[:, :3, 3] - rows["T_base_tool_planned"][use][:, :3, 3], axis=1)
    return {
        **error_summary(np.linalg.norm(e[:, :3], axis=1)),
        "rotation_rms_rad": float(np.sqrt(np.mean(np.sum(e[:, 3:] ** 2, axis=1)))),
        "nees": float(nees.mean()),
        "inside_3_sigma": float(inside.mean()),
        "without_compensation": error_summary(uncorrected),
    }


# ---- What is written -----------------------------------------------------------------------------


def run_dict(run: Played, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing track run`` holds."""
    p = run.played
    rows, innovations, timeline = p.compensation, p.innovations, p.timeline
    made = rows["made"]
    status = np.array(timeline["status"], dtype=str)
    used = innovations["accepted"] > 0
    settled = used & (innovations["t"] >= (innovations["t"].min() + SETTLING if used.any() else 0.0))
    return {
        "format": RUN_FORMAT,
        "version": _core.version(),
        "robot": run.robot.name,
        "horizon_s": run.horizon,
        "rows": len(made),
        "made": int(made.sum()),
        "status": {
            name: float(np.mean(status == name)) if status.size else 0.0
            for name in ("valid", "coasting", "hold", "lost")
        },
        "predictors": {
            name: int(count)
            for name, count in zip(
                *np.unique(
                    [w for w, m in zip(rows["predictor"], made, strict=True) if m], return_counts=True
                ),
                strict=True,
            )
        },
        "correction": {
            "rms_m": (
                float(np.sqrt(np.mean(np.sum(rows["correction"][made, :3] ** 2, axis=1))))
                if made.any()
                else None
            ),
            "max_m": (
                float(np.linalg.norm(rows["correction"][made, :3], axis=1).max()) if made.any() else None
            ),
            "limited": float(np.mean(rows["limited"][made])) if made.any() else 0.0,
        },
        "errors": horizon_errors(p.graded),
        "truth": against_truth(run),
        "consistency": {
            "nis_per_dimension": (
                float(np.sum(innovations["nis"][settled]) / np.sum(innovations["dimensions"][settled]))
                if settled.any()
                else None
            ),
            "innovations": int(used.sum()),
            "outliers": int((~used).sum()),
            "noise": {
                "position_m": p.noise.position,
                "rotation_rad": p.noise.rotation,
                "accel_factor": p.noise.accel_factor,
                "gyro_factor": p.noise.gyro_factor,
            },
        },
        "clock": {
            "offset_s": p.clock.offset,
            "sigma_s": p.clock.sigma,
            "drift": p.clock.drift,
            "estimated": run.where.setup.clock_offset_sigma > 0,
        },
        "modes": _modes(run),
        "shifts": [
            {
                "t_s": s.t,
                "flagged_s": s.flagged,
                "cause": s.cause,
                "jump_m": float(np.linalg.norm(s.jump[:3])),
                "jump_rad": float(np.linalg.norm(s.jump[3:])),
                "position_noise_m": s.position_noise,
                "rotation_noise_rad": s.rotation_noise,
                "odds": s.odds,
            }
            for s in p.shifts
        ],
        "dropouts": dropouts(run.tracker_t),
        "samples": {stream: dict(counts) for stream, counts in p.counters.items()},
        "warnings": list(warnings),
    }


def dropouts(t: Floats) -> list[dict[str, float]]:
    """Stretches without a tracker sample."""
    times = np.sort(t)
    return [
        {"start_s": float(times[k]), "seconds": float(times[k + 1] - times[k])}
        for k in np.flatnonzero(np.diff(times) > _DROPOUT)
    ]


def _modes(run: Played) -> dict[str, Any]:
    given, learnt = run.where.modes, run.played.modes
    model = learnt.model if learnt.model.count else given
    last = run.played.timeline["frequencies"][-1] if len(run.played.timeline["t"]) else np.zeros(4)
    return {
        "source": "this recording" if learnt.model.count else "the set-up file" if given.count else "none",
        "used_from_s": run.played.modes_from or None,
        "stopped_because": learnt.stopped_because or None,
        "modes": [
            {
                "frequency_hz": float(model.frequency[k]),
                "damping": float(model.damping[k]),
                "tracked_hz": float(last[k]),
            }
            for k in range(model.count)
        ],
    }


def compensation_columns(run: Played) -> dict[str, Any]:
    """Columns of ``compensation.csv``: a row for each row of the plan; where none was made, empty cells and
    the status `lost`.
    """
    rows = run.played.compensation
    made = rows["made"]

    def known(values: Floats) -> Floats:
        return np.where(made, values, np.nan)

    covariance = tool_covariance(run.where, rows["T_base_tool"], rows["covariance"].reshape(-1, 6, 6))
    sigma = np.sqrt(np.einsum("nii->ni", covariance))
    columns: dict[str, Any] = {"t_s": rows["t"], "plan_t_s": run.plan_t, "made_s": known(rows["made_at"])}
    columns |= {name: known(values) for name, values in pose_columns(rows["T_base_tool"]).items()}
    columns |= {f"d{name}": known(rows["correction"][:, k]) for k, name in enumerate(MOTIONS)}
    columns |= {
        f"flange_{name}": known(values) for name, values in pose_columns(rows["T_base_flange"]).items()
    }
    columns |= joint_columns(run.robot, corrected_joints(run))
    columns |= {f"sigma_{name}": known(sigma[:, k]) for k, name in enumerate(MOTIONS)}
    columns["limited"] = known(np.asarray(rows["limited"], dtype=np.float64))
    columns["predictor"] = [
        word if there else None for word, there in zip(rows["predictor"], made, strict=True)
    ]
    columns["status"] = [word if there else "lost" for word, there in zip(rows["status"], made, strict=True)]
    return columns


def corrected_joints(run: Played) -> Floats:
    """Joints that bring the flange to where it was corrected to, shape=(rows, driven joints) [rad | m]; NaN
    where none do, or none were asked for.

    An arm with fewer than six driven joints cannot take every correction: it brings the tool's point there,
    from the row before by the least motion of its joints.
    """
    rows, robot = run.played.compensation, run.robot
    T_flange_tool = np.asarray(run.where.setup.T_flange_tool)
    bare = robot.replace(
        T_measurement_base=np.eye(4), targets=[_core.Target("tool", T_flange_tool)], effects=[]
    )  # the flange is that of the link table throughout
    solver = _core.InverseSolver(bare)
    like = _core.Task(np.eye(4), kind="pose" if robot.driven_count >= 6 else "point")
    out = np.full((len(rows["t"]), robot.driven_count), np.nan)
    previous = None
    for k in np.flatnonzero(rows["made"]):
        task = like.replace(T_measurement_target=rows["T_base_flange"][k] @ T_flange_tool)
        found = solver.solve(task, None) if previous is None else solver.follow(task, previous)
        if not found.reached and previous is not None:
            found = solver.solve(task, previous)
        if found.reached:
            out[k] = previous = found.joints
    return out


def write_run(folder: Path, run: Played, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """Writes everything that ``truing track run`` found into `folder`, and returns what result.json holds."""
    found: dict[str, Any] = without_nan(run_dict(run, warnings=warnings))
    if len(run.plan_t):
        write_table(folder / "compensation.csv", compensation_columns(run))
    learnt = run.played.modes.model
    if learnt.count:  # for the next recording of this arm
        save_setup(folder / "setup.yaml", replace(run.where, modes=learnt))
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(run_report(found, _replayed(run)), encoding="utf-8")
    return found


def _replayed(run: Played) -> Replayed:
    """What the report draws."""
    p = run.played
    true_tool = None if run.truth is None else (run.truth.t, run.truth.T)
    return Replayed(p.compensation, p.graded, p.timeline, p.innovations, true_tool)


# ---- Calibration ---------------------------------------------------------------------------------


def calibration_dict(
    robot: _core.Robot, c: TrackCalibration, *, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing track calibrate`` holds."""
    setup, done = c.where.setup, c.status == "done"
    return {
        "format": CALIBRATION_FORMAT,
        "version": _core.version(),
        "robot": robot.name,
        "status": c.status,
        "message": c.message,
        "frames": (
            {name: _frame(np.asarray(getattr(setup, name)), c.where.covariance.get(name)) for name in FRAMES}
            if done
            else None
        ),
        "gravity_m_s2": np.asarray(setup.gravity) if done else None,
        "positions": {
            "source": "standstills" if c.positions else "motion",
            "position_sigma_m": c.frames.position_sigma,
            "rotation_sigma_rad": c.frames.rotation_sigma,
            "errors": [
                {
                    "t_s": float(t),
                    "position_m": e.position,
                    "rotation_rad": e.rotation,
                    "weight": e.weight,
                    **(
                        {"scatter_m": c.positions[k].scatter, "samples": c.positions[k].samples}
                        if c.positions
                        else {}
                    ),
                }
                for k, (t, e) in enumerate(zip(c.times, c.frames.errors, strict=False))
            ],
        },
        "tool": (
            None
            if c.tool is None
            else {
                "message": c.tool.message,
                "pivot_error_m": list(c.tool.pivot_error),
                "orientation_error_rad": list(c.tool.orientation_error),
            }
        ),
        "clock": _calibrated_clock(c) if done else None,
        "inertial": (
            None
            if c.inertial is None
            else {
                "message": c.inertial.message,
                "tracker_up": c.inertial.tracker_up,
                "gyro_bias_rad_s": c.inertial.gyro_bias,
                "accel_bias_m_s2": c.inertial.accel_bias,
                "rotation_rate_rad_s": c.inertial.rotation_rate,
                "position_rms_m": c.inertial.position_rms,
                "rotation_rms_rad": c.inertial.rotation_rms,
            }
        ),
        "actuator_lag_s": c.actuator_lag,
        "modes": (
            None
            if c.modes is None
            else {
                "stopped_because": c.modes.stopped_because,
                "error_m": list(c.modes.error),
                "modes": [
                    {
                        "frequency_hz": float(c.modes.model.frequency[k]),
                        "frequency_sigma_hz": float(c.modes.model.frequency_sigma[k]),
                        "damping": float(c.modes.model.damping[k]),
                    }
                    for k in range(c.modes.model.count)
                ],
            }
        ),
        "notes": list(c.notes),
        "warnings": list(warnings),
    }


def _frame(T: Floats, covariance: Floats | None) -> dict[str, Any]:
    sigma = (
        None
        if covariance is None
        else dict(zip(MOTIONS, np.sqrt(np.maximum(0.0, np.diag(covariance))).tolist(), strict=True))
    )
    return {**frame_dict(T), "sigma": sigma}


def _calibrated_clock(c: TrackCalibration) -> dict[str, Any]:
    found: dict[str, Any] = {
        "drift": c.where.clock_drift,
        "controller_clock_offset_s": c.where.setup.controller_clock_offset,
        "same_clock": c.same_clock,
        "joints_offset_s": None if c.joints_clock is None else c.joints_clock.offset,
        "joints_offset_sigma_s": None if c.joints_clock is None else c.joints_clock.sigma,
    }
    if c.inertial is not None:
        found |= {
            "offset_s": c.where.setup.clock_offset,
            "sigma_s": c.inertial.clock_offset_sigma,
            "rich_enough": c.inertial.rich_enough,
            "advice": c.inertial.advice,
        }
    return found


def write_calibration(
    folder: Path, robot: _core.Robot, c: TrackCalibration, *, source: str, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything that ``truing track calibrate`` found into `folder`, and returns what result.json
    holds. No setup.yaml where the data did not show it.
    """
    found: dict[str, Any] = without_nan(calibration_dict(robot, c, warnings=warnings))
    if c.status == "done":
        told = {
            "source": source,
            "positions": len(c.frames.errors),
            "position_sigma_m": c.frames.position_sigma,
            "truing": _core.version(),
        }
        save_setup(folder / "setup.yaml", replace(c.where, calibration=told))
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(calibration_report(found), encoding="utf-8")
    return found
