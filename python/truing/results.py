# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a command found, as it is written: ``result.json``, ``covariance.csv``, ``residuals.csv``."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import truing
from truing.errors import InputError

IDENTIFICATION_FORMAT = "truing-identification/1"
PREDICTION_FORMAT = "truing-prediction/1"
PLAN_FORMAT = "truing-plan/1"
DIAGNOSIS_FORMAT = "truing-diagnosis/1"
EXAM_FORMAT = "truing-exam/1"

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """What is known of every row of the data, in the order of the data.

    Errors are predicted minus measured and NaN where a row does not measure them; a row has either a position
    error or a
    distance error. `position` is where the target was measured, or else predicted.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]  # "rad" | "m"
    joints: Floats  # shape=(n, driven joints) [rad | m]
    position: Floats  # shape=(n, 3) [m]
    error_before: Floats  # shape=(n, 3) [m]
    error_after: Floats  # shape=(n, 3) [m]
    distance_before: Floats  # shape=(n,) [m]
    distance_after: Floats  # shape=(n,) [m]
    rotation_before: Floats  # shape=(n, 3) [rad]
    rotation_after: Floats  # shape=(n, 3) [rad]
    test: Bools
    rejected: Bools
    pose: NDArray[np.int32]  # group of rows of one robot pose
    time: Floats | None = None  # [s]

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.joints)

    @property
    def magnitude_before(self) -> Floats:
        """Length of the position (or distance) error before, shape=(n,) [m]."""
        return _magnitude(self.error_before, self.distance_before)

    @property
    def magnitude_after(self) -> Floats:
        """Length of the position (or distance) error after, shape=(n,) [m]."""
        return _magnitude(self.error_after, self.distance_after)

    @property
    def what(self) -> str:
        """What is compared: "position", "distance" or both."""
        positions, distances = np.isfinite(self.error_after).any(), np.isfinite(self.distance_after).any()
        return "position and distance" if positions and distances else "distance" if distances else "position"

    @property
    def numbers_per_row(self) -> float:
        """Measured numbers that a row carries, on average."""
        measured = sum(
            int(np.isfinite(e).sum()) for e in (self.error_after, self.distance_after, self.rotation_after)
        )
        return measured / self.count if self.count else 0.0


def _magnitude(error: Floats, distance: Floats) -> Floats:
    return np.where(np.isfinite(distance), np.abs(distance), np.sqrt(np.sum(error**2, axis=1)))


def statistics(magnitude: Floats, rotation: Floats | None = None) -> dict[str, Any]:
    """Statistics of error lengths [m] as ``result.json`` has them; rows without a measurement (NaN) do not
    count.
    """
    size = magnitude[np.isfinite(magnitude)]
    if size.size == 0:
        return {"rms_m": None, "mean_m": None, "median_m": None, "p95_m": None, "max_m": None, "n": 0}
    result: dict[str, Any] = {
        "rms_m": float(np.sqrt(np.mean(size**2))),
        "mean_m": float(size.mean()),
        "median_m": float(np.median(size)),
        "p95_m": float(np.quantile(size, 0.95)),
        "max_m": float(size.max()),
        "n": int(size.size),
    }
    if rotation is not None and np.isfinite(rotation).any():
        result["rotation_rms_rad"] = float(np.sqrt(np.nanmean(np.sum(rotation**2, axis=1))))
    return result


def without_nan(value: Any) -> Any:
    """The same, ready for JSON: numpy types become Python's, what is not finite becomes None."""
    if isinstance(value, Mapping):
        return {str(key): without_nan(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return without_nan(value.tolist())
    if isinstance(value, (list, tuple)):
        return [without_nan(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


_NUMBER = r"(?:-?[0-9][0-9.e+-]*|null)"
_ROW_OF_NUMBERS = re.compile(
    rf"\[\n *({_NUMBER}(?:,\n *{_NUMBER})*)\n *\]"
)  # no text of JSON holds a line break


def to_json(result: Mapping[str, Any]) -> str:
    """Text of ``result.json``: no NaN, rows of numbers on one line, one line break at the end."""
    text = json.dumps(without_nan(result), indent=2, allow_nan=False, ensure_ascii=False)
    return _ROW_OF_NUMBERS.sub(lambda row: f"[{' '.join(row[1].split())}]", text) + "\n"


def correlations(covariance: Floats) -> Floats:
    """Correlation matrix of a covariance matrix, shape=(n, n)."""
    sigma = np.sqrt(np.diag(covariance))
    safe = np.where(sigma > 0, sigma, 1.0)
    return np.asarray(np.clip(covariance / safe[:, None] / safe, -1, 1))


# ---- Identification
# --------------------------------------------------------------------------------------------------


def identification_dict(
    result: truing.Identification, *, seed: int, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing identify`` holds. `seed`: of the split; `warnings`: more of them,
    first.
    """
    errors = {"train": result.train} if result.test is None else {"train": result.train, "test": result.test}
    return {
        "format": IDENTIFICATION_FORMAT,
        "version": truing.__version__,
        "robot": result.robot.name,
        "errors": {
            name: {"before": _statistics(e.before), "after": _statistics(e.after)}
            for name, e in errors.items()
        },
        "parameters": [_parameter(p) for p in result.parameters],
        "effects": [
            {"effect": e.effect, "joints": list(e.joints), "parameters": dict(e.parameters)}
            for e in result.robot.effects
        ],
        "frozen": [_frozen(f) for f in result.frozen],
        "rejected_rows": list(result.rejected_rows),
        "solver": {
            "name": result.solver.name,
            "iterations": result.solver.iterations,
            "converged": result.solver.converged,
            "stopped_because": result.solver.stopped_because,
        },
        "noise_sigma_m": result.noise_sigma,
        "rotation_noise_sigma_rad": result.rotation_noise_sigma,
        "rank": result.rank,
        "columns": result.columns,
        "seed": seed,
        "warnings": [*warnings, *result.warnings],
    }


def _statistics(e: truing.ErrorStatistics) -> dict[str, Any]:
    values: dict[str, Any] = {
        "rms_m": e.rms,
        "mean_m": e.mean,
        "median_m": e.median,
        "p95_m": e.p95,
        "max_m": e.max,
        "n": e.n,
    }
    if math.isfinite(e.rotation_rms):
        values["rotation_rms_rad"] = e.rotation_rms
    return values


def _parameter(p: truing.Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "nominal": p.nominal,
        "value": p.value,
        "sigma": p.sigma,
        "unit": p.unit,
        "frozen": p.frozen,
    }


def _frozen(f: truing.Frozen) -> dict[str, Any]:
    return {"parameter": f.parameter, "combination": dict(f.combination), "why": f.why}


def rows_of(
    before: truing.Robot,
    after: truing.Robot,
    data: truing.Measurements,
    *,
    test: Bools,
    rejected: Sequence[int] = (),
) -> Rows:
    """Errors of every row of `data` for two robots. `test`: shape=(n,), the rows held out; `rejected`: rows
    left out of the fit.
    """
    out = np.zeros(data.rows, dtype=bool)
    out[list(rejected)] = True
    old, new = truing.residuals(before, data), truing.residuals(after, data)
    predicted = np.asarray(truing.predict(after, data).position)
    return Rows(
        **_inputs(after, data),
        position=(
            predicted
            if data.positions is None
            else np.where(np.isfinite(data.positions), data.positions, predicted)
        ),
        error_before=_block(old.position, data.rows),
        error_after=_block(new.position, data.rows),
        distance_before=_column(old.distance, data.rows),
        distance_after=_column(new.distance, data.rows),
        rotation_before=_block(old.rotation, data.rows),
        rotation_after=_block(new.rotation, data.rows),
        test=test,
        rejected=out,
    )


def predicted_rows(robot: truing.Robot, data: truing.Measurements, predicted: truing.Prediction) -> Rows:
    """Prediction against measurement where there is one; rows may have none. Before and after are the same.

    Rows that touch a fixed point have no errors here: where the point is, is not known.
    """
    position = np.asarray(predicted.position)
    absent, absent3 = np.full(data.rows, np.nan), np.full((data.rows, 3), np.nan)
    error = absent3 if data.positions is None else position - data.positions
    distance = (
        absent
        if data.distances is None or len(predicted.distance) != data.rows
        else predicted.distance - data.distances
    )
    rotation = absent3
    if data.orientations is not None:
        measured, found = np.asarray(data.orientations), np.asarray(predicted.orientation)
        w, v = measured[:, :1], -measured[:, 1:]  # found * conjugate(measured)
        scalar = found[:, :1] * w - np.sum(found[:, 1:] * v, axis=1, keepdims=True)
        rotation = 2.0 * np.sign(scalar) * (found[:, :1] * v + w * found[:, 1:] + np.cross(found[:, 1:], v))
    nobody = np.zeros(data.rows, dtype=bool)
    place = (
        position
        if data.positions is None
        else np.where(np.isfinite(data.positions), data.positions, position)
    )
    return Rows(
        **_inputs(robot, data),
        position=place,
        error_before=error,
        error_after=error,
        distance_before=distance,
        distance_after=distance,
        rotation_before=rotation,
        rotation_after=rotation,
        test=nobody,
        rejected=nobody,
    )


def _inputs(robot: truing.Robot, data: truing.Measurements) -> dict[str, Any]:
    driven = [robot.joints[index] for index in robot.driven_joints()]
    return {
        "joint_names": tuple(joint.name for joint in driven),
        "joint_units": tuple("rad" if joint.type == "revolute" else "m" for joint in driven),
        "joints": np.asarray(data.joints),
        "pose": np.asarray(truing.pose_groups(data)),
        "time": None if data.time is None or not np.isfinite(data.time).all() else np.asarray(data.time),
    }


def _block(values: Floats, rows: int) -> Floats:
    return np.asarray(values) if len(values) == rows else np.full((rows, 3), np.nan)


def _column(values: Floats, rows: int) -> Floats:
    return np.asarray(values) if len(values) == rows else np.full(rows, np.nan)


def covariance_columns(result: truing.Identification) -> dict[str, Any]:
    """Columns of ``covariance.csv``: the names, then one column per fitted parameter (unit of an entry: both
    units' product).
    """
    names = fitted_names(result)
    return {"name": names, **{name: result.covariance[:, k] for k, name in enumerate(names)}}


def fitted_names(result: truing.Identification) -> list[str]:
    """Names of the parameters that the covariance is of."""
    return [p.name for p in result.parameters if not p.frozen]


def residual_columns(
    rows: Rows, measured: truing.Measurements, target_names: Sequence[str] = ()
) -> dict[str, Any]:
    """Columns of ``residuals.csv``: every row with what was measured, what is predicted before and after, and
    the difference.
    """
    columns: dict[str, Any] = {
        "row": np.arange(rows.count),
        "set": np.where(rows.test, "test", "train"),
        "pose": rows.pose,
    }
    if measured.targets is not None and target_names:
        columns["target"] = np.asarray(target_names)[measured.targets]
    for k, unit in enumerate(rows.joint_units):
        columns[f"q{k + 1}_{unit}"] = rows.joints[:, k]
    has = {
        "position": np.isfinite(rows.error_after).any(),
        "distance": np.isfinite(rows.distance_after).any(),
        "rotation": np.isfinite(rows.rotation_after).any(),
    }
    if has["position"]:
        # A fixed point has no measured position: its rows carry errors alone.
        place = (
            np.full((rows.count, 3), np.nan) if measured.positions is None else np.asarray(measured.positions)
        )
        for k, axis in enumerate("xyz"):
            columns[f"{axis}_m"] = place[:, k]
        for when, error in (("before", rows.error_before), ("after", rows.error_after)):
            for k, axis in enumerate("xyz"):
                columns[f"{when}_{axis}_m"] = place[:, k] + error[:, k]
        for when, error in (("before", rows.error_before), ("after", rows.error_after)):
            for k, axis in enumerate("xyz"):
                columns[f"error_{when}_{axis}_m"] = error[:, k]
    if has["distance"]:
        assert measured.distances is not None  # there are no distance errors without distances
        columns["dist_m"] = measured.distances
        for when, distance in (("before", rows.distance_before), ("after", rows.distance_after)):
            columns[f"{when}_dist_m"] = measured.distances + distance
    columns["error_before_m"] = rows.magnitude_before
    columns["error_after_m"] = rows.magnitude_after
    if has["rotation"]:
        columns["rotation_error_before_rad"] = np.sqrt(np.sum(rows.rotation_before**2, axis=1))
        columns["rotation_error_after_rad"] = np.sqrt(np.sum(rows.rotation_after**2, axis=1))
    columns["rejected"] = rows.rejected.astype(np.int8)
    return columns


def write_identification(
    folder: Path,
    result: truing.Identification,
    data: truing.Measurements,
    *,
    seed: int,
    source: str,
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
    base_link: str = "",
    tip_link: str = "",
) -> dict[str, Any]:
    """Writes everything that ``truing identify`` found into `folder`, and returns what result.json holds.

    `source` names the data in the calibrated robot file. A `nominal_file` in URDF is also written calibrated,
    as URDF.
    """
    from truing import report
    from truing.files import write_table

    found: dict[str, Any] = without_nan(identification_dict(result, seed=seed, warnings=warnings))
    assert result.set is not None
    rows = rows_of(
        result.before, result.robot, data, test=np.asarray(result.set) == 1, rejected=result.rejected_rows
    )
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    held_out = found["errors"].get("test", found["errors"]["train"])
    write_robot(
        folder,
        result.robot,
        source,
        {"rms_m": held_out["after"]["rms_m"], "covariance": "covariance.csv"},
        nominal_file,
        base_link,
        tip_link,
    )
    write_table(folder / "covariance.csv", covariance_columns(result))
    names = [target.name for target in result.robot.targets]
    write_table(folder / "residuals.csv", residual_columns(rows, data, names))
    page = report.identification_report(found, rows, (fitted_names(result), correlations(result.covariance)))
    (folder / "report.html").write_text(page, encoding="utf-8")
    return found


def write_robot(
    folder: Path,
    robot: truing.Robot,
    source: str,
    calibration: dict[str, Any],
    nominal_file: Path | None,
    base_link: str,
    tip_link: str,
) -> None:
    """Writes ``robot.yaml`` in the units of the file that came in, and ``robot.urdf`` too if that was URDF."""
    from datetime import datetime, timezone

    from truing.files import load_units, save_robot

    save_robot(
        folder / "robot.yaml",
        robot,
        units=load_units(nominal_file) if nominal_file else None,
        calibration={
            "source": source,
            "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
            **calibration,
        },
    )
    if nominal_file is not None and robot.convention == "urdf" and nominal_file.suffix.lower() != ".yaml":
        text = nominal_file.read_text(encoding="utf-8-sig")
        (folder / "robot.urdf").write_text(
            truing.urdf_with_calibration(text, robot, base_link, tip_link), encoding="utf-8"
        )


# ---- Diagnosis
# -------------------------------------------------------------------------------------------------------


def with_second_record(robot: truing.Robot, data: truing.Measurements) -> truing.Measurements:
    """The same measurements by the second record of the joints (columns qr1 …), without the first. Raises
    InputError.
    """
    units = ["rad" if robot.joints[index].type == "revolute" else "m" for index in robot.driven_joints()]
    second, covariates = [], dict(data.covariates)
    for k, unit in enumerate(units):
        name = f"qr{k + 1}_{unit}"
        if name not in covariates:
            raise InputError(
                f"--record qr: the data has no column {name}; a second record has one for every driven joint"
                f" (qr1 … qr{len(units)})"
            )
        second.append(np.array(covariates.pop(name)))
    for row in np.flatnonzero(~np.isfinite(np.array(second)).all(axis=0))[:1]:
        raise InputError(f"--record qr: row {row} (from 0) has no second record of every joint")
    return data.replace(joints=np.stack(second, axis=1), covariates=covariates)


def diagnosis_dict(found: truing.Diagnosis, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing diagnose`` holds. `warnings`: more of them, first."""
    return {
        "format": DIAGNOSIS_FORMAT,
        "version": truing.__version__,
        "robot": found.robot.name,
        "verdict": found.verdict,
        "sentence": found.sentence,
        "gap": {
            **_statistics(found.gap),
            "noise_floor_m": found.noise_floor,
            "noise_from_repeats": found.noise_from_repeats,
            "closable": found.closable,
            "p": found.p_gap,
            "parts": _parts(found),
        },
        "after": {**_statistics(found.after), "remaining_structure_p": found.remaining_structure_p},
        "after_unknown": _statistics(found.after_unknown),
        "shrink": {"value": found.shrink.value, "ci": _interval(found.shrink)},
        "effects": [_effect(e, found.robot) for e in found.effects],
        "unknown": [_unknown(u, found.robot) for u in found.unknown],
        "where": {
            "joints": [
                {"joint": w.joint, "share": w.share.value, "ci": _interval(w.share)}
                for w in found.where_joints
            ],
            "inputs": [{"input": w.input, "share": w.share} for w in found.where_inputs],
            "workspace": [{"center_m": w.center, "rms_m": w.rms, "n": w.n} for w in found.workspace],
            "direction": [{"axis": found.direction[:, k], "rms_m": found.direction_rms[k]} for k in range(3)],
        },
        "sanity": [{"kind": s.kind, "text": s.text, "rows": list(s.rows)} for s in found.sanity],
        "not_testable": [
            {"effect": n.effect, "joints": list(n.joints), "why": n.why} for n in found.not_testable
        ],
        "detectable": [
            {
                "effect": d.effect,
                "joint": d.joint,
                "parameter": d.parameter,
                "unit": d.unit,
                "size": d.size,
                "size_at_tip_m": d.size_at_tip,
            }
            for d in found.detectable
        ],
        "next_measurements": [_next_pose(p) for p in found.next_poses],
        "candidates": [
            {
                "effect": c.effect,
                "joints": list(c.joints),
                "columns": c.columns,
                "gain": c.gain,
                "evidence": c.evidence,
                "held_out_gain": c.held_out_gain,
                "largest_z": c.largest_z,
            }
            for c in found.candidates
        ],
        "nearest_neighbour": {"p95_m": found.neighbour_p95, "share": found.neighbour_share},
        "joint_record": found.joint_record,
        "outliers": list(found.outliers),
        "seed": found.seed,
        "warnings": [*warnings, *found.warnings],
    }


def _interval(share: truing.Share) -> list[float]:
    return [share.low, share.high]


def _held_out(found: truing.FoundEffect | truing.UnknownEffect) -> dict[str, Any]:
    before, after = found.held_out_before, found.held_out_after
    return {
        "before_rms_m": before.rms,
        "after_rms_m": after.rms,
        "before_p95_m": before.p95,
        "after_p95_m": after.p95,
        "before_max_m": before.max,
        "after_max_m": after.max,
        "n": after.n,
        "shrink": found.shrink.value,
        "ci": _interval(found.shrink),
    }


def _curve(c: truing.Curve, robot: truing.Robot) -> dict[str, Any]:
    second = (
        {
            "input": c.second_input,
            "unit": _input_unit(c.second_input, robot),
            "range": [c.second_low, c.second_high],
        }
        if c.second_input
        else None
    )
    return {
        "site": c.site,
        "input": c.input,
        "input_unit": c.input_unit,
        "second": second,
        "unit": c.unit,
        "points": c.points,
        "samples": c.samples,
    }


def _input_unit(name: str, robot: truing.Robot) -> str:
    """Unit of what a free function depends on: "q3", "torque2", "temp" …"""
    joint = re.fullmatch(r"q([0-9]+)", name)
    if joint:
        return "rad" if robot.joints[int(joint[1]) - 1].type == "revolute" else "m"
    return {"torque": "Nm", "payload": "kg", "temp": "deg C", "time": "s"}.get(name.rstrip("0123456789"), "")


def _effect(e: truing.FoundEffect, robot: truing.Robot) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "joints": list(e.joints),
        "probability": e.probability,
        "parameters": [_parameter(p) for p in e.parameters],
        "held_out": _held_out(e),
        "share": e.share,
        "share_alone": e.share_alone,
        "share_last": e.share_last,
        "confounded_with": [
            {
                "effect": a.effect,
                "joints": list(a.joints),
                "probability": a.probability,
                "separated_by": a.separated_by,
            }
            for a in e.confounded_with
        ],
        "note": e.note,
        "identify_as": e.identify_as,
        "curves": [_curve(c, robot) for c in e.curves],
    }


def _unknown(u: truing.UnknownEffect, robot: truing.Robot) -> dict[str, Any]:
    first: Floats | list[Any] = u.curves[0].points[:, :2] if u.curves else []
    return {
        "joint": u.joint,
        "inputs": list(u.inputs),
        "probability": u.probability,
        "held_out": _held_out(u),
        "share": u.share,
        "curve": first,
        "curves": [_curve(c, robot) for c in u.curves],
        "looks_like": u.looks_like,
    }


def _next_pose(p: truing.NextPose) -> dict[str, Any]:
    return {"joints": p.joints, "direction": list(p.direction), "payload_kg": p.payload, "why": p.why}


def _parts(found: truing.Diagnosis) -> dict[str, Any]:
    """The gap's mean square cut into parts that add up to 1: noise, each effect, each unknown function,
    unexplained.
    """
    effects, unknown = [e.share for e in found.effects], [u.share for u in found.unknown]
    left = max(0.0, 1.0 - sum(effects) - sum(unknown))
    noise = min(left, (found.noise_floor / found.gap.rms) ** 2) if found.gap.rms > 0 else left
    return {"noise": noise, "effects": effects, "unknown": unknown, "unexplained": left - noise}


def diagnosis_rows(found: truing.Diagnosis, data: truing.Measurements) -> Rows:
    """Errors of every row of `data` before and after; `rejected`: rows that counted for little."""
    before, after = found.residuals_before, found.residuals_after
    out = np.zeros(data.rows, dtype=bool)
    out[list(found.outliers)] = True
    return Rows(
        **_inputs(found.robot, data),
        position=np.full((data.rows, 3), np.nan) if data.positions is None else np.asarray(data.positions),
        error_before=_block(before.position, data.rows),
        error_after=_block(after.position, data.rows),
        distance_before=_column(before.distance, data.rows),
        distance_after=_column(after.distance, data.rows),
        rotation_before=_block(before.rotation, data.rows),
        rotation_after=_block(after.rotation, data.rows),
        test=np.asarray(found.set) == 1,
        rejected=out,
    )


def diagnosis_columns(
    rows: Rows, measured: truing.Measurements, target_names: Sequence[str], directions: Floats | None = None
) -> dict[str, Any]:
    """Columns of diagnose's ``residuals.csv``: those of identify, the rotation errors component by component,
    and approach directions
    that were inferred."""
    columns = residual_columns(rows, measured, target_names)
    columns["outlier"] = columns.pop("rejected")
    if directions is not None:
        for k in range(directions.shape[1]):
            columns[f"dir{k + 1}"] = directions[:, k]
    if np.isfinite(rows.rotation_after).any():
        for when, error in (("before", rows.rotation_before), ("after", rows.rotation_after)):
            for k, axis in enumerate("xyz"):
                columns[f"rotation_error_{when}_{axis}_rad"] = error[:, k]
    return columns


def next_pose_columns(found: truing.Diagnosis) -> dict[str, Any]:
    """Columns of ``next_poses.csv``: joints, and what else the poses ask for. Made to be measured, or given
    to ``simulate --plan``.
    """
    poses = found.next_poses
    columns = joint_columns(found.robot, np.array([p.joints for p in poses]))
    for k in range(max(len(p.direction) for p in poses)):
        columns[f"dir{k + 1}"] = np.array([p.direction[k] if k < len(p.direction) else 0 for p in poses])
    payload = np.array([p.payload for p in poses])
    if np.isfinite(payload).all():
        columns["payload_kg"] = payload
    return columns


def write_diagnosis(
    folder: Path,
    found: truing.Diagnosis,
    data: truing.Measurements,
    *,
    source: str,
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
    base_link: str = "",
    tip_link: str = "",
) -> dict[str, Any]:
    """Writes everything that ``truing diagnose`` found into `folder`, and returns what result.json holds.

    `source` names the data in the robot file.
    """
    from truing.diagnose_report import diagnosis_report
    from truing.files import write_table

    result: dict[str, Any] = without_nan(diagnosis_dict(found, warnings=warnings))
    if found.joint_record == "qr":  # what it went by
        data = with_second_record(found.robot, data)
    rows = diagnosis_rows(found, data)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    own = found.gap.rms * (1.0 - found.shrink.value)  # the robot file holds no drifts and no free functions
    write_robot(folder, found.robot, source, {"rms_m": own}, nominal_file, base_link, tip_link)
    write_table(
        folder / "residuals.csv",
        diagnosis_columns(rows, data, [target.name for target in found.robot.targets], found.directions),
    )
    if found.next_poses:
        write_table(folder / "next_poses.csv", next_pose_columns(found))
    (folder / "report.html").write_text(diagnosis_report(result, rows), encoding="utf-8")
    return result


# ---- Prediction and plan
# ---------------------------------------------------------------------------------------------


def prediction_columns(
    robot: truing.Robot, data: truing.Measurements, predicted: truing.Prediction
) -> dict[str, Any]:
    """Columns of ``predicted.csv``, one row per row of `data`: only `dist_m` when `data` has distances, else
    the pose, with
    `dist_m` as well when the robot knows its anchor."""
    distance = np.asarray(predicted.distance)
    if data.distances is not None:
        if len(distance) != data.rows:
            raise InputError(
                f"the data has distances, but robot {robot.name!r} has no anchor to measure them from:"
                " identify it first"
            )
        return {"dist_m": distance}
    columns: dict[str, Any] = {f"{axis}_m": predicted.position[:, k] for k, axis in enumerate("xyz")}
    columns.update({name: predicted.orientation[:, k] for k, name in enumerate(("qw", "qx", "qy", "qz"))})
    if len(distance) == data.rows:
        columns["dist_m"] = distance
    return columns


def prediction_dict(robot: truing.Robot, rows: Rows, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing predict`` holds; errors only where something was measured."""
    result: dict[str, Any] = {
        "format": PREDICTION_FORMAT,
        "version": truing.__version__,
        "robot": robot.name,
        "rows": rows.count,
        "warnings": list(warnings),
    }
    if np.isfinite(rows.magnitude_after).any():
        result["errors"] = statistics(rows.magnitude_after, rows.rotation_after)
    return result


def plan_dict(
    robot: truing.Robot,
    planned: truing.PlanResult,
    *,
    index: str,
    noise: float,
    seed: int,
    seen: truing.Distinction | None = None,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing plan`` holds. `noise` of one position component [m] is what the
    standard errors are for; `seen`:
    what the plan tells apart, if that was asked for."""
    result: dict[str, Any] = {
        "format": PLAN_FORMAT,
        "version": truing.__version__,
        "robot": robot.name,
        "poses": len(planned.joints) if seen is None else len(seen.joints),
        "index": {
            "name": index,
            "start": planned.index_start,
            "end": planned.index_end,
            "exchanges": planned.exchanges,
        },
        "noise_m": noise,
        "parameters": [{**_parameter(p), "value": None} for p in planned.parameters],
        "frozen": [_frozen(f) for f in planned.frozen],
        "seed": seed,
        "warnings": list(warnings),
    }
    if seen is not None:
        result["distinguish"] = distinction_dict(seen)
    return result


def distinction_dict(seen: truing.Distinction) -> dict[str, Any]:
    """The part of ``result.json`` of ``truing plan`` on effects: their smallest sizes, which are alike, and
    what poses were added for.
    """
    return {
        "added_poses": seen.added,
        "effects": [
            {
                "effect": e.effect,
                "joint": e.joint,
                "parameter": e.parameter,
                "unit": e.unit,
                "size": e.size,
                "size_at_tip_m": e.size_at_tip,
                "size_with_geometry": e.size_with_geometry,
                "size_with_geometry_at_tip_m": e.size_with_geometry_at_tip,
                "standard_errors": e.standard_errors,
            }
            for e in seen.effects
        ],
        "r2": np.asarray(seen.r2),
        "alike": [_effect_pair(p) for p in seen.alike],
        "separated": [
            {**_effect_pair(p), "r2_after": p.r2_after, "size_after": p.size_after} for p in seen.separated
        ],
        "not_testable": [
            {"effect": n.effect, "joints": list(n.joints), "why": n.why} for n in seen.not_testable
        ],
    }


def _effect_pair(p: truing.EffectPair) -> dict[str, Any]:
    return {
        "effect": p.effect,
        "joint": p.joint,
        "other": p.other,
        "other_joint": p.other_joint,
        "r2": p.r2,
        "parameter": p.parameter,
        "unit": p.unit,
        "size": p.size,
        "separated_by": p.separated_by,
    }


def plan_columns(
    robot: truing.Robot, joints: Floats, seen: truing.Distinction | None = None
) -> dict[str, Any]:
    """Columns of ``poses.csv``: joints, and the inputs to be varied that were asked for."""
    if seen is None:
        return joint_columns(robot, joints)
    columns = joint_columns(robot, seen.joints)
    if seen.direction is not None:
        columns.update(
            {f"dir{k + 1}": seen.direction[:, k].astype(np.int64) for k in range(seen.direction.shape[1])}
        )
    for name, values in (("payload_kg", seen.payload), ("temp_C", seen.temperature), ("t_s", seen.time)):
        if values is not None:
            columns[name] = values
    return columns


def joint_columns(robot: truing.Robot, joints: Floats) -> dict[str, Any]:
    """Joint readings as columns: `q1_rad` …, `_m` for prismatic joints."""
    units = ["rad" if robot.joints[index].type == "revolute" else "m" for index in robot.driven_joints()]
    return {f"q{k + 1}_{unit}": joints[:, k] for k, unit in enumerate(units)}


# ---- Examination
# -----------------------------------------------------------------------------------------------------


def write_exam(folder: Path, result: Mapping[str, Any]) -> dict[str, Any]:
    """Writes what the examination found into `folder`, and returns what result.json holds."""
    from truing.diagnose_report import exam_report

    found: dict[str, Any] = without_nan({"version": truing.__version__, **result})
    found.setdefault("format", EXAM_FORMAT)
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(exam_report(found), encoding="utf-8")
    return found
