# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing dynamics`` writes: of ``diagnose``, ``identify``, ``predict`` and ``export``.

``result.json``, ``residuals.parquet``, ``covariance.csv``, ``predicted.csv``, the robot and the report.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.friction import friction_dict
from truing.dynamics.page import diagnosis_report, fit_report, prediction_report
from truing.files import load_units, save_robot, write_table
from truing.identification.result import parameter_dict
from truing.report.json_text import to_json, without_nan

DYNAMICS_FORMAT = "truing-dynamics/1"
IDENTIFICATION_FORMAT = "truing-dynamics-identification/1"
PREDICTION_FORMAT = "truing-dynamics-prediction/1"
EXPORT_FORMAT = "truing-dynamics-export/1"
BLOCKS_OF_TIME = "blocks of time"  # what `held_out` says where parts of the only recording were held out
Floats = NDArray[np.float64]


# ---- result.json ---------------------------------------------------------------------------------
def diagnosis_dict(found: _core.TorqueDiagnosis, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics diagnose`` holds. `warnings`: more of them, first."""
    return {
        "format": DYNAMICS_FORMAT,
        "version": _core.version(),
        "robot": found.robot.name,
        "verdict": found.verdict,
        "sentence": found.sentence,
        "effects": [_effect(e) for e in found.effects],
        "unknown": [_unknown(u) for u in found.unknown],
        "where": where_dict(found.where, found.errors),
        **_errors(found.errors),
        "friction": friction_dict(found.robot, found.where),
        "classes": [{"effects": list(c.effects), "sentence": c.sentence} for c in found.classes],
        "sanity": [],
        "not_testable": [_not_testable(n) for n in found.not_testable],
        "held_out": list(found.held_out),
        "cutoff_hz": found.cutoff,
        "design_effect": list(found.design_effect),
        "warnings": [*warnings, *found.warnings],
    }


def fit_dict(found: _core.TorqueFit, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics identify`` holds. `warnings`: more of them, first."""
    return {
        "format": IDENTIFICATION_FORMAT,
        "version": _core.version(),
        "robot": found.robot.name,
        "parameters": [parameter_dict(p) for p in found.parameters],
        **_errors(found.errors),
        "friction": friction_dict(found.robot, []),
        "not_testable": [_not_testable(n) for n in found.not_testable],
        "held_out": list(found.held_out),
        "cutoff_hz": found.cutoff,
        "warnings": [*warnings, *found.warnings],
    }


def _effect(e: _core.FoundTorqueEffect) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "joints": list(e.joints),
        "standard": e.standard,
        "probability": e.probability,
        "parameters": [parameter_dict(p) for p in e.parameters],
        "share": e.share.value,
        "ci": [e.share.low, e.share.high],
        "rms_Nm": e.rms,
        "confounded_with": [
            {"effect": a.effect, "joints": list(a.joints), "probability": a.probability}
            for a in e.confounded_with
        ],
        "sentence": e.sentence,
    }


def _unknown(u: _core.UnknownTorque) -> dict[str, Any]:
    return {
        "joint": u.joint,
        "inputs": list(u.inputs),
        "probability": u.probability,
        "share": u.share.value,
        "ci": [u.share.low, u.share.high],
        "rms_Nm": u.rms,
        "curve": [list(point) for point in u.curve],
    }


def _not_testable(n: _core.NotTestable) -> dict[str, Any]:
    return {"effect": n.effect, "joints": list(n.joints), "why": n.why}


def _errors(errors: Sequence[_core.TorqueErrors]) -> dict[str, Any]:
    """By set, model and joint: in % of the torque's standard deviation, and in Nm (N)."""
    sets = ("held_out", "train")
    return {
        key: {
            name: {e.model: {one.joint: getattr(one, field) for one in getattr(e, name)} for e in errors}
            for name in sets
        }
        for key, field in (("torque", "percent"), ("torque_rms_Nm", "rms"))
    }


def where_dict(where: Sequence[_core.TorqueRegime], errors: Sequence[_core.TorqueErrors]) -> dict[str, Any]:
    """Where the gap lies that standard practice leaves: by joint, by input, and in all parts of the motion.

    A joint's share is that of its squared error, each joint's in units of its own torque. An input's share
    is how unevenly the squared error is spread over it, 0 to 1: the part of it beyond an even spread.
    """
    standard = next((e for e in errors if e.model == "standard"), None)
    squares = {} if standard is None else {e.joint: e.percent**2 for e in standard.held_out}
    total = sum(value for value in squares.values() if math.isfinite(value))
    shares = {joint: value / total if total > 0 else 0.0 for joint, value in squares.items()}
    inputs: dict[str, float] = {}
    for joint, share in shares.items():
        for name in {w.input for w in where if w.joint == joint}:
            bins = [w for w in where if w.joint == joint and w.input == name]
            inputs[name] = inputs.get(name, 0.0) + share * _unevenness(bins)
    return {
        "joints": [{"joint": joint, "share": share} for joint, share in shares.items()],
        "inputs": [
            {"input": name, "share": share} for name, share in sorted(inputs.items(), key=lambda i: -i[1])
        ],
        "regimes": [
            {
                "joint": w.joint,
                "input": w.input,
                "low": w.low,
                "high": w.high,
                "standard_rms_Nm": w.standard,
                "named_rms_Nm": w.named,
                "n": w.n,
            }
            for w in where
        ],
    }


def _unevenness(bins: Sequence[_core.TorqueRegime]) -> float:
    square = np.array([b.standard**2 for b in bins])
    rows = np.array([b.n for b in bins])
    if not (square @ rows > 0):
        return 0.0
    mean = square @ rows / rows.sum()
    return float(np.maximum(square - mean, 0.0) @ rows / (square @ rows))


# ---- Tables --------------------------------------------------------------------------------------
def _driven(robot: _core.Robot) -> list[_core.Joint]:
    return [robot.joints[index] for index in robot.driven_joints()]


def torque_unit(joint: _core.Joint) -> str:
    return "Nm" if joint.type == "revolute" else "N"


def measured_torque(robot: _core.Robot, recording: _core.Recording) -> Floats:
    """Torques as measured, else currents times the drives' constants (1 Nm/A where none is known); NaN where
    there is neither. shape=(n, joints) [Nm | N]
    """
    joints = _driven(robot)
    out = np.full((len(recording), len(joints)), np.nan)
    if recording.current.shape[1]:
        out = np.asarray(recording.current) * [joint.torque_per_ampere or 1.0 for joint in joints]
    if recording.torque.shape[1]:
        out = np.where(np.isnan(recording.torque), out, recording.torque)
    return out


def residual_columns(
    robot: _core.Robot, recordings: Sequence[_core.Recording], held_out: Sequence[str], cutoff: float
) -> dict[str, Any]:
    """Columns of ``residuals.parquet``: every row with the torque measured, the one that `robot` predicts,
    and what is left. Torques are as recorded, not low-passed. `set` is left out where parts of one recording
    were held out.
    """
    joints = _driven(robot)
    measured = [measured_torque(robot, recording) for recording in recordings]
    predicted = [
        np.asarray(_core.dynamics_predict(robot, recording, cutoff).torque) for recording in recordings
    ]
    counts = [len(recording) for recording in recordings]
    columns: dict[str, Any] = {"recording": np.repeat([recording.name for recording in recordings], counts)}
    if list(held_out) != [BLOCKS_OF_TIME]:
        sets = ["test" if recording.name in held_out else "train" for recording in recordings]
        columns["set"] = np.repeat(sets, counts)
    columns["t_s"] = np.concatenate([recording.time for recording in recordings])
    table, model = np.concatenate(measured), np.concatenate(predicted)
    for k, joint in enumerate(joints, 1):
        unit = torque_unit(joint)
        columns[f"tau{k}_{unit}"] = table[:, k - 1]
        columns[f"predicted_tau{k}_{unit}"] = model[:, k - 1]
        columns[f"error_tau{k}_{unit}"] = table[:, k - 1] - model[:, k - 1]
    return columns


def recording_columns(robot: _core.Robot, recording: _core.Recording) -> dict[str, Any]:
    """A recording as a table that `load_recordings` reads: time, positions, torques, and its set."""
    joints = _driven(robot)
    columns: dict[str, Any] = {"t_s": np.asarray(recording.time)}
    for k, joint in enumerate(joints):
        unit = "rad" if joint.type == "revolute" else "m"
        columns[f"q{k + 1}_{unit}"] = np.asarray(recording.position[:, k])
    for k in _recorded(recording.torque):
        columns[f"tau{k + 1}_{torque_unit(joints[k])}"] = np.asarray(recording.torque[:, k])
    columns["set"] = ["test" if recording.test else "train"] * len(recording)
    return columns


def parameter_columns(parameters: Sequence[_core.Parameter]) -> dict[str, Any]:
    """Columns of ``covariance.csv``: parameters with their standard errors."""
    return {
        "parameter": [p.name for p in parameters],
        "value": np.array([p.value for p in parameters], dtype=np.float64),
        "sigma": np.array([p.sigma for p in parameters], dtype=np.float64),
        "unit": [p.unit for p in parameters],
    }


def prediction_columns(
    robot: _core.Robot, recording: _core.Recording, predicted: _core.TorquePrediction
) -> dict[str, Any]:
    """Columns of ``predicted.csv``, one row per row of `recording`: t_s, and the columns that were measured;
    torques where nothing was.
    """
    joints = _driven(robot)
    torque = np.asarray(predicted.torque)
    columns: dict[str, Any] = {"t_s": np.asarray(recording.time)}
    by_torque, by_current = (_recorded(table) for table in (recording.torque, recording.current))
    for k, joint in enumerate(joints):
        if k in by_torque or not (by_torque or by_current):
            columns[f"tau{k + 1}_{torque_unit(joint)}"] = torque[:, k]
    for k, joint in enumerate(joints):
        if k in by_current:
            columns[f"i{k + 1}_A"] = torque[:, k] / (joint.torque_per_ampere or 1.0)
    return columns


def assumed_drives(robot: _core.Robot, recording: _core.Recording) -> list[str]:
    """What is to be said of joints whose currents were recorded and whose drive's constant is not known."""
    joints = _driven(robot)
    unknown = [joints[k].name for k in _recorded(recording.current) if joints[k].torque_per_ampere is None]
    if not unknown:
        return []
    return [
        f"torque_per_ampere is not known of {', '.join(unknown)}: 1 Nm/A is assumed, so that their currents"
        " are their torques in numbers: say the drives' constants in the robot file or with"
        " --torque-per-ampere"
    ]


def _recorded(table: Floats) -> list[int]:
    """The joints that a table has values of."""
    return [k for k in range(table.shape[1]) if not np.isnan(table[:, k]).all()]


def prediction_dict(
    robot: _core.Robot,
    recording: _core.Recording,
    predicted: _core.TorquePrediction,
    *,
    cutoff: float,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics predict`` holds; errors only of joints that were measured.

    The measured torque is as recorded, so that its noise is part of the error.
    """
    measured = measured_torque(robot, recording)
    errors = {}
    for k, joint in enumerate(_driven(robot)):
        torque = measured[:, k]
        if np.isnan(torque).all():
            continue
        rms = float(np.sqrt(np.mean((torque - predicted.torque[:, k]) ** 2)))
        spread = float(torque.std())
        errors[joint.name] = {
            "rms": rms,
            "unit": torque_unit(joint),
            "percent": 100.0 * rms / spread if spread > 0 else math.nan,
        }
    return {
        "format": PREDICTION_FORMAT,
        "version": _core.version(),
        "robot": robot.name,
        "recording": recording.name,
        "rows": len(recording),
        "cutoff_hz": cutoff,
        "errors": errors,
        "warnings": [*warnings, *assumed_drives(robot, recording)],
    }


def export_dict(
    robot: _core.Robot,
    to: str,
    model: str,
    not_written: Sequence[NotWritten],
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics export`` holds. model: name of the simulator's file."""
    found: dict[str, Any] = without_nan(
        {
            "format": EXPORT_FORMAT,
            "version": _core.version(),
            "robot": robot.name,
            "to": to,
            "model": model,
            "not_written": [{"name": n.name, "size_Nm": n.size, "reason": n.reason} for n in not_written],
            "warnings": list(warnings),
        }
    )
    return found


# ---- Everything ----------------------------------------------------------------------------------
def write_diagnosis(
    folder: Path,
    found: _core.TorqueDiagnosis,
    recordings: Sequence[_core.Recording],
    *,
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics diagnose`` found, and returns what result.json holds.

    `nominal_file`: the robot's file, in whose units robot.yaml is written.
    """
    result: dict[str, Any] = without_nan(diagnosis_dict(found, warnings=warnings))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    _write_robot(folder, found.robot, recordings, nominal_file)
    columns = residual_columns(found.robot, recordings, found.held_out, found.cutoff)
    write_table(folder / "residuals.parquet", columns)
    traces = [
        {
            "recording": t.recording,
            "joint": t.joint,
            **{
                key: np.array(getattr(t, key)) for key in ("time", "measured", "nominal", "standard", "named")
            },
        }
        for t in found.traces
    ]
    report = diagnosis_report(result, traces, len(recordings))
    (folder / "report.html").write_text(report, encoding="utf-8")
    return result


def write_fit(
    folder: Path,
    found: _core.TorqueFit,
    recordings: Sequence[_core.Recording],
    *,
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics identify`` found, and returns what result.json holds."""
    result: dict[str, Any] = without_nan(fit_dict(found, warnings=warnings))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    _write_robot(folder, found.robot, recordings, nominal_file)
    write_table(folder / "covariance.csv", parameter_columns(found.parameters))
    columns = residual_columns(found.robot, recordings, found.held_out, found.cutoff)
    write_table(folder / "residuals.parquet", columns)
    (folder / "report.html").write_text(fit_report(result, len(recordings)), encoding="utf-8")
    return result


def write_prediction(
    folder: Path,
    robot: _core.Robot,
    recording: _core.Recording,
    predicted: _core.TorquePrediction,
    *,
    cutoff: float,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics predict`` found, and returns what result.json holds."""
    result: dict[str, Any] = without_nan(
        prediction_dict(robot, recording, predicted, cutoff=cutoff, warnings=warnings)
    )
    write_table(folder / "predicted.csv", prediction_columns(robot, recording, predicted))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    traces = [
        {
            "recording": recording.name,
            "joint": joint.name,
            "time": np.asarray(recording.time),
            "measured": measured,
            "named": np.asarray(predicted.torque[:, k]),
        }
        for k, (joint, measured) in enumerate(
            zip(_driven(robot), measured_torque(robot, recording).T, strict=True)
        )
    ]
    (folder / "report.html").write_text(prediction_report(result, traces), encoding="utf-8")
    return result


def _write_robot(
    folder: Path, robot: _core.Robot, recordings: Sequence[_core.Recording], nominal_file: Path | None
) -> None:
    """``robot.yaml`` in the units of the nominal file."""
    save_robot(
        folder / "robot.yaml",
        robot,
        units=load_units(nominal_file) if nominal_file else None,
        calibration={
            "source": ", ".join(recording.name for recording in recordings),
            "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
        },
    )
