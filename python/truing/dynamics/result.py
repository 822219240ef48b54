# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing dynamics`` writes: of ``diagnose``, ``identify``, ``predict`` and ``export``.

``result.json``, ``residuals.parquet``, ``covariance.csv``, ``predicted.csv``, the robot and the report.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import PAYLOAD_COLUMNS, PAYLOAD_FOUND
from truing.dynamics.comparison import Comparison, comparison_dict
from truing.dynamics.comparison.page import comparison_report
from truing.dynamics.export import Exported, refit_words
from truing.dynamics.friction import friction_dict
from truing.dynamics.page import diagnosis_report, export_report, fit_report, prediction_report
from truing.dynamics.recorded import driven_joints, measured_torque, torque_unit
from truing.dynamics.rollout import Rollout, held_out_rows, paths_of, response_paths, rollout_dict
from truing.dynamics.rollout.arm import arm_picture
from truing.dynamics.rollout.page import KEYS as MODEL_NAMES
from truing.dynamics.sanity.findings import RecordingFinding
from truing.dynamics.servo.export import ServoExported
from truing.dynamics.servo.export.verified import servo_rollout_dict
from truing.dynamics.simulate import Response
from truing.dynamics.told import FoundLoad, sentence_of, told
from truing.files import load_units, looks_of, save_robot, write_table
from truing.identification.result import parameter_dict
from truing.report.json_text import to_json, without_nan

DYNAMICS_FORMAT = "truing-dynamics/1"  # of all commands; `command` says which one wrote it
Floats = NDArray[np.float64]


# ---- result.json ---------------------------------------------------------------------------------
def _head(command: str) -> dict[str, Any]:
    return {"format": DYNAMICS_FORMAT, "command": command, "version": _core.version()}


NOT_JUDGED = Rollout(None, "not asked for")


def diagnosis_dict(
    found: _core.TorqueDiagnosis,
    rollout: Rollout = NOT_JUDGED,
    *,
    sanity: Iterable[RecordingFinding] = (),
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics diagnose`` holds. `sanity`: findings of `check_recordings`;
    `warnings`: more of them, first.
    """
    motion, sanity = rollout_dict(rollout), list(sanity)
    said = told(found, sanity)
    return {
        **_head("diagnose"),
        "robot": found.robot.name,
        "verdict": said.verdict,
        "sentence": ". ".join([said.sentence, *motion.get("verdict", ())]),
        "load_sentence": sentence_of(said.loads),
        "effects": [*map(_load, said.loads), *map(_effect, found.effects)],
        "covariance": covariance_dict(parameters_of(found), found.covariance),
        "unknown": [_unknown(u) for u in found.unknown],
        "remainders": list(found.remainders),
        "orders": [_order(o) for o in found.orders],
        "where": where_dict(found.where, found.errors),
        **_errors(found.errors),
        "without_names_percent": found.without_names,
        "rollout": motion,
        "friction": friction_dict(found.robot, found.where),
        "classes": [{"effects": list(c.effects), "sentence": c.sentence} for c in found.classes],
        "sanity": [asdict(finding) for finding in sanity],
        "not_testable": [_not_testable(n) for n in found.not_testable],
        "held_out": list(found.held_out),
        "cutoff_hz": found.cutoff,
        "design_effect": list(found.design_effect),
        "warnings": [*warnings, *found.warnings, *motion.get("worse", ())],
    }


def fit_dict(
    found: _core.TorqueFit, *, sanity: Iterable[RecordingFinding] = (), warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics identify`` holds; as `diagnosis_dict`."""
    return {
        **_head("identify"),
        "robot": found.robot.name,
        "parameters": [parameter_dict(p) for p in found.parameters],
        "covariance": covariance_dict(found.parameters, found.covariance),
        **_errors(found.errors),
        "friction": friction_dict(found.robot, []),
        "sanity": [asdict(finding) for finding in sanity],
        "not_testable": [_not_testable(n) for n in found.not_testable],
        "held_out": list(found.held_out),
        "cutoff_hz": found.cutoff,
        "warnings": [*warnings, *found.warnings],
    }


def parameters_of(found: _core.TorqueDiagnosis) -> list[_core.Parameter]:
    """Of all effects, one after the other."""
    return [p for effect in found.effects for p in effect.parameters]


def covariance_dict(parameters: Iterable[_core.Parameter], covariance: Floats) -> dict[str, Any]:
    """shape=(m, m), of the parameters that are not frozen; unit of an entry: the product of both units."""
    return {"names": [p.name for p in parameters if not p.frozen], "matrix": covariance.tolist()}


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


def _load(load: FoundLoad) -> dict[str, Any]:
    """As an effect; what it removes is not known, as everything else was looked for with it."""
    return {
        "effect": load.effect,
        "joints": [],
        "recordings": list(load.recordings),
        "standard": False,
        "probability": load.probability,
        "parameters": [asdict(p) for p in load.parameters],
        "share": None,
        "ci": [None, None],
        "rms_Nm": None,
        "confounded_with": [],
        "sentence": load.sentence,
    }


def _order(order: _core.TorqueOrder) -> dict[str, Any]:
    return {
        "joint": order.joint,
        "order": order.order,
        "with_direction": order.with_direction,
        "amplitude": order.amplitude,
        "unit": "Nm",
        "share": order.share,
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
    sets = ("held_out", "in_motion", "train")
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
def residual_columns(
    robot: _core.Robot,
    recordings: Sequence[_core.Recording],
    held_out: Sequence[str],
    cutoff: float,
    test_share: float = 0.3,
) -> dict[str, Any]:
    """Columns of ``residuals.parquet``: every row with its motion, the torque measured, the one that `robot`
    predicts, and what is left. Torques are as recorded, not low-passed. test_share: as it was fitted with.
    """
    joints = driven_joints(robot)
    counts = [len(recording) for recording in recordings]
    columns: dict[str, Any] = {"recording": np.repeat([recording.name for recording in recordings], counts)}
    held = np.concatenate(held_out_rows(recordings, held_out, test_share))
    columns["set"] = np.where(held, "test", "train")
    columns["t_s"] = np.concatenate([recording.time for recording in recordings])
    columns.update(_motion_columns(joints, recordings))
    table = np.concatenate([measured_torque(robot, recording) for recording in recordings])
    model = np.concatenate(
        [np.asarray(_core.dynamics_predict(robot, recording, cutoff).torque) for recording in recordings]
    )
    for k, joint in enumerate(joints, 1):
        unit = torque_unit(joint)
        columns[f"tau{k}_{unit}"] = table[:, k - 1]
        columns[f"predicted_tau{k}_{unit}"] = model[:, k - 1]
        columns[f"error_tau{k}_{unit}"] = table[:, k - 1] - model[:, k - 1]
    return columns


def _motion_columns(joints: Sequence[_core.Joint], recordings: Sequence[_core.Recording]) -> dict[str, Any]:
    """Positions; speeds and temperatures where any recording has them, NaN in the others; payloads, 0 in the
    others.
    """
    position = np.concatenate([np.asarray(recording.position) for recording in recordings])
    speed = np.concatenate(
        [
            np.asarray(r.speed) if r.speed.shape[1] else np.full((len(r), len(joints)), np.nan)
            for r in recordings
        ]
    )
    columns: dict[str, Any] = {}
    for k, joint in enumerate(joints, 1):
        unit = "rad" if joint.type == "revolute" else "m"
        columns[f"q{k}_{unit}"] = position[:, k - 1]
        if not np.isnan(speed).all():
            columns[f"qd{k}_{unit}_s"] = speed[:, k - 1]
    warm = {name for r in recordings for name in r.columns if name.startswith("temp") and name.endswith("_C")}
    for name in sorted(warm):
        each = [np.asarray(r.columns.get(name, np.full(len(r), np.nan))) for r in recordings]
        columns[name] = np.concatenate(each)
    for name in (*PAYLOAD_COLUMNS, PAYLOAD_FOUND):
        if any(name in r.columns for r in recordings):
            each = [np.asarray(r.columns.get(name, np.zeros(len(r)))) for r in recordings]
            columns[name] = np.concatenate(each)
    return columns


def recording_columns(robot: _core.Robot, recording: _core.Recording) -> dict[str, Any]:
    """A recording as a table that `load_recordings` reads: time, positions, torques, and its set."""
    joints = driven_joints(robot)
    columns: dict[str, Any] = {"t_s": np.asarray(recording.time)}
    for k, joint in enumerate(joints):
        unit = "rad" if joint.type == "revolute" else "m"
        columns[f"q{k + 1}_{unit}"] = np.asarray(recording.position[:, k])
    for k in _recorded(recording.torque):
        columns[f"tau{k + 1}_{torque_unit(joints[k])}"] = np.asarray(recording.torque[:, k])
    columns["set"] = ["test" if recording.test else "train"] * len(recording)
    return columns


def covariance_columns(parameters: Iterable[_core.Parameter], covariance: Floats) -> dict[str, Any]:
    """Columns of ``covariance.csv``: the names, then one column per fitted parameter (`covariance_dict`)."""
    names = [p.name for p in parameters if not p.frozen]
    return {"name": names, **{name: covariance[:, k] for k, name in enumerate(names)}}


def prediction_columns(
    robot: _core.Robot, recording: _core.Recording, predicted: _core.TorquePrediction
) -> dict[str, Any]:
    """Columns of ``predicted.csv``, one row per row of `recording`: t_s, and the columns that were measured;
    torques where nothing was.
    """
    joints = driven_joints(robot)
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


def response_columns(robot: _core.Robot, response: Response) -> dict[str, Any]:
    """Columns that ``predict --simulate`` adds: positions, and the number of the window of each row."""
    columns: dict[str, Any] = {}
    for k, joint in enumerate(driven_joints(robot)):
        columns[f"q{k + 1}_{'rad' if joint.type == 'revolute' else 'm'}"] = response.position[:, k]
    return {**columns, "window": response.window}


def assumed_drives(robot: _core.Robot, recording: _core.Recording) -> list[str]:
    """What is to be said of joints whose currents were recorded and whose drive's constant is not known."""
    joints = driven_joints(robot)
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
    response: Response | None = None,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics predict`` holds; errors only of joints that were measured.

    The measured torque is as recorded, so that its noise is part of the error.
    """
    measured = measured_torque(robot, recording)
    errors = {}
    for k, joint in enumerate(driven_joints(robot)):
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
        **_head("predict"),
        "robot": robot.name,
        "recording": recording.name,
        "rows": len(recording),
        "cutoff_hz": predicted.cutoff,
        "errors": errors,
        "simulated": None if response is None else _response_dict(robot, recording, response),
        "warnings": [*warnings, *assumed_drives(robot, recording)],
    }


def _response_dict(robot: _core.Robot, recording: _core.Recording, response: Response) -> dict[str, Any]:
    """How far a simulated motion is off, on all rows and on the last of every window."""
    off = response.position - np.asarray(recording.position)
    ends = np.flatnonzero(np.diff(response.window, append=-1) != 0)
    return {
        "horizon_s": response.horizon,
        "windows": int(response.start.size),
        "errors": {
            joint.name: {
                "rms": float(np.sqrt(np.mean(off[:, k] ** 2))),
                "end_rms": float(np.sqrt(np.mean(off[ends, k] ** 2))),
                "unit": "rad" if joint.type == "revolute" else "m",
            }
            for k, joint in enumerate(driven_joints(robot))
        },
    }


def export_dict(
    robot: _core.Robot,
    to: str,
    exported: Exported,
    rollout: Rollout = NOT_JUDGED,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics export`` holds. rollout: the model as it is written beside
    the robot."""
    found: dict[str, Any] = without_nan(
        {
            **_head("export"),
            "robot": robot.name,
            "to": to,
            "model": exported.model.name,
            "not_written": [
                {"name": n.name, "size_Nm": n.size, "reason": n.reason} for n in exported.not_written
            ],
            "refitted": list(exported.refitted),
            "notes": [text for text in (refit_words(exported.refitted), exported.not_refitted) if text],
            "rollout": rollout_dict(rollout, "URDF" if to == "urdf" else "MJCF"),
            "warnings": list(warnings),
        }
    )
    return found


def _write_residuals(
    folder: Path,
    found: _core.TorqueDiagnosis | _core.TorqueFit,
    recordings: Sequence[_core.Recording],
    test_share: float,
) -> None:
    """Of recordings that are in memory: residuals of the others would be as long as they are."""
    whole = [recording for recording in recordings if recording.pieces is None]
    if whole:
        columns = residual_columns(found.robot, whole, found.held_out, found.cutoff, test_share)
        write_table(folder / "residuals.parquet", columns)


# ---- Everything ----------------------------------------------------------------------------------
def write_diagnosis(
    folder: Path,
    found: _core.TorqueDiagnosis,
    recordings: Sequence[_core.Recording],
    rollout: Rollout = NOT_JUDGED,
    *,
    sanity: Iterable[RecordingFinding] = (),
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
    base_link: str = "",
    test_share: float = 0.3,
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics diagnose`` found, and returns what result.json holds.

    `rollout`: of `truing.dynamics.rollout`. `sanity`: findings of `check_recordings`. `nominal_file`: the
    robot's file, in whose units robot.yaml is written, and from whose `base_link` it was read. `test_share`:
    as it was diagnosed with.
    """
    result: dict[str, Any] = without_nan(diagnosis_dict(found, rollout, sanity=sanity, warnings=warnings))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    _write_robot(folder, found.robot, recordings, nominal_file)
    write_table(folder / "covariance.csv", covariance_columns(parameters_of(found), found.covariance))
    _write_residuals(folder, found, recordings, test_share)
    traces = _traces(found)
    paths = paths_of(rollout.judgement) if rollout.judgement is not None else []
    arm = arm_picture(found.robot, paths, MODEL_NAMES, looks_of(nominal_file, found.robot, base_link))
    report = diagnosis_report(result, traces, len(recordings), paths, arm)
    (folder / "report.html").write_text(report, encoding="utf-8")
    return result


def _traces(found: _core.TorqueDiagnosis) -> list[dict[str, Any]]:
    keys = ("time", "measured", "nominal", "standard", "named")
    return [
        {"recording": t.recording, "joint": t.joint, **{key: np.array(getattr(t, key)) for key in keys}}
        for t in found.traces
    ]


def diagnosis_page(found: _core.TorqueDiagnosis, recordings: int) -> str:
    """The report of ``truing dynamics diagnose`` without its files, not judged by motion."""
    result: dict[str, Any] = without_nan(diagnosis_dict(found, NOT_JUDGED))
    return diagnosis_report(result, _traces(found), recordings)


def write_fit(
    folder: Path,
    found: _core.TorqueFit,
    recordings: Sequence[_core.Recording],
    *,
    sanity: Iterable[RecordingFinding] = (),
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
    test_share: float = 0.3,
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics identify`` found, and returns what result.json holds."""
    result: dict[str, Any] = without_nan(fit_dict(found, sanity=sanity, warnings=warnings))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    _write_robot(folder, found.robot, recordings, nominal_file)
    write_table(folder / "covariance.csv", covariance_columns(found.parameters, found.covariance))
    _write_residuals(folder, found, recordings, test_share)
    (folder / "report.html").write_text(fit_report(result, len(recordings)), encoding="utf-8")
    return result


def write_prediction(
    folder: Path,
    robot: _core.Robot,
    recording: _core.Recording,
    predicted: _core.TorquePrediction,
    response: Response | None = None,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics predict`` found, and returns what result.json holds.

    `response`: of `truing.dynamics.simulate.simulated_response`.
    """
    result: dict[str, Any] = without_nan(
        prediction_dict(robot, recording, predicted, response, warnings=warnings)
    )
    columns = prediction_columns(robot, recording, predicted)
    if response is not None:
        columns.update(response_columns(robot, response))
    write_table(folder / "predicted.csv", columns)
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
            zip(driven_joints(robot), measured_torque(robot, recording).T, strict=True)
        )
    ]
    paths = [] if response is None else response_paths(robot, recording, response)
    arm = arm_picture(robot, paths, {"named": "simulated"})
    (folder / "report.html").write_text(prediction_report(result, traces, paths, arm), encoding="utf-8")
    return result


def write_export(
    folder: Path,
    robot: _core.Robot,
    exported: Exported,
    to: str,
    rollout: Rollout = NOT_JUDGED,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes ``result.json`` and the report of ``truing dynamics export``; returns what result.json holds."""
    result = export_dict(robot, to, exported, rollout, warnings=warnings)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    paths = paths_of(rollout.judgement) if rollout.judgement is not None else []
    arm = arm_picture(robot, paths, MODEL_NAMES)
    (folder / "report.html").write_text(export_report(result, paths, arm), encoding="utf-8")
    return result


def write_servo_export(
    folder: Path,
    robot: str,
    exported: Exported | ServoExported,
    to: str,
    rollout: Rollout = NOT_JUDGED,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """The same of a diagnosis from commands. robot: its name."""
    motion = servo_rollout_dict(rollout)
    result: dict[str, Any] = without_nan(
        {
            **_head("export"),
            "robot": robot,
            "to": to,
            "model": exported.model if isinstance(exported, ServoExported) else exported.model.name,
            "driven_by": "commands",
            "not_written": [
                {"name": n.name, "size_Nm": n.size, "reason": n.reason} for n in exported.not_written
            ],
            "rollout": motion,
            "warnings": [*warnings, *motion.get("worse", ())],
        }
    )
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    paths = paths_of(rollout.judgement) if rollout.judgement is not None else []
    (folder / "report.html").write_text(export_report(result, paths), encoding="utf-8")
    return result


def write_comparison(
    folder: Path, found: Comparison, names: tuple[str, str], *, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics compare`` found, and returns what result.json holds.

    names: of the models, as the user wrote them.
    """
    notes = [f"{name}: {note}" for name, of in zip(names, found.notes, strict=True) for note in of]
    result: dict[str, Any] = without_nan(
        {
            **_head("compare"),
            **comparison_dict(found, names),
            "recordings": sorted(set(found.judgement.windows.recordings)),
            "warnings": [*warnings, *notes],
        }
    )
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    report = comparison_report(result, paths_of(found.judgement))
    (folder / "report.html").write_text(report, encoding="utf-8")
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
