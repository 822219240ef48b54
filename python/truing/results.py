# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a command found, as it is written: ``result.json``, ``covariance.csv``, ``residuals.csv``."""

from __future__ import annotations

import json
import math
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

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """What is known of every row of the data, in the order of the data.

    Errors are predicted minus measured and NaN where a row does not measure them; a row has either a position error or a
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
        measured = sum(int(np.isfinite(e).sum()) for e in (self.error_after, self.distance_after, self.rotation_after))
        return measured / self.count if self.count else 0.0


def _magnitude(error: Floats, distance: Floats) -> Floats:
    return np.where(np.isfinite(distance), np.abs(distance), np.sqrt(np.sum(error**2, axis=1)))


def statistics(magnitude: Floats, rotation: Floats | None = None) -> dict[str, Any]:
    """Statistics of error lengths [m] as ``result.json`` has them; rows without a measurement (NaN) do not count."""
    size = magnitude[np.isfinite(magnitude)]
    if size.size == 0:
        return {"rms_m": None, "mean_m": None, "median_m": None, "p95_m": None, "max_m": None, "n": 0}
    result: dict[str, Any] = {"rms_m": float(np.sqrt(np.mean(size**2))), "mean_m": float(size.mean()), "median_m": float(np.median(size)),
                              "p95_m": float(np.quantile(size, 0.95)), "max_m": float(size.max()), "n": int(size.size)}
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


def to_json(result: Mapping[str, Any]) -> str:
    """Text of ``result.json``: no NaN, one line break at the end."""
    return json.dumps(without_nan(result), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def correlations(covariance: Floats) -> Floats:
    """Correlation matrix of a covariance matrix, shape=(n, n)."""
    sigma = np.sqrt(np.diag(covariance))
    safe = np.where(sigma > 0, sigma, 1.0)
    return np.asarray(np.clip(covariance / safe[:, None] / safe, -1, 1))


# ---- Identification --------------------------------------------------------------------------------------------------


def identification_dict(result: truing.Identification, *, seed: int, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing identify`` holds. `seed`: of the split; `warnings`: more of them, first."""
    errors = {"train": result.train} if result.test is None else {"train": result.train, "test": result.test}
    return {
        "format": IDENTIFICATION_FORMAT,
        "version": truing.__version__,
        "robot": result.robot.name,
        "errors": {name: {"before": _statistics(e.before), "after": _statistics(e.after)} for name, e in errors.items()},
        "parameters": [_parameter(p) for p in result.parameters],
        "effects": [{"effect": e.effect, "joints": list(e.joints), "parameters": dict(e.parameters)} for e in result.robot.effects],
        "frozen": [_frozen(f) for f in result.frozen],
        "rejected_rows": list(result.rejected_rows),
        "solver": {"name": result.solver.name, "iterations": result.solver.iterations, "converged": result.solver.converged,
                   "stopped_because": result.solver.stopped_because},
        "noise_sigma_m": result.noise_sigma,
        "rotation_noise_sigma_rad": result.rotation_noise_sigma,
        "rank": result.rank,
        "columns": result.columns,
        "seed": seed,
        "warnings": [*warnings, *result.warnings],
    }  # fmt: skip


def _statistics(e: truing.ErrorStatistics) -> dict[str, Any]:
    values: dict[str, Any] = {"rms_m": e.rms, "mean_m": e.mean, "median_m": e.median, "p95_m": e.p95, "max_m": e.max, "n": e.n}
    if math.isfinite(e.rotation_rms):
        values["rotation_rms_rad"] = e.rotation_rms
    return values


def _parameter(p: truing.Parameter) -> dict[str, Any]:
    return {"name": p.name, "nominal": p.nominal, "value": p.value, "sigma": p.sigma, "unit": p.unit, "frozen": p.frozen}


def _frozen(f: truing.Frozen) -> dict[str, Any]:
    return {"parameter": f.parameter, "combination": dict(f.combination), "why": f.why}


def rows_of(before: truing.Robot, after: truing.Robot, data: truing.Measurements, *, test: Bools, rejected: Sequence[int] = ()) -> Rows:
    """Errors of every row of `data` for two robots. `test`: shape=(n,), the rows held out; `rejected`: rows left out of the fit."""
    out = np.zeros(data.rows, dtype=bool)
    out[list(rejected)] = True
    old, new = truing.residuals(before, data), truing.residuals(after, data)
    predicted = np.asarray(truing.predict(after, data).position)
    return Rows(
        **_inputs(after, data),
        position=predicted if data.positions is None else np.where(np.isfinite(data.positions), data.positions, predicted),
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
    distance = absent if data.distances is None or len(predicted.distance) != data.rows else predicted.distance - data.distances
    rotation = absent3
    if data.orientations is not None:
        measured, found = np.asarray(data.orientations), np.asarray(predicted.orientation)
        w, v = measured[:, :1], -measured[:, 1:]  # found * conjugate(measured)
        scalar = found[:, :1] * w - np.sum(found[:, 1:] * v, axis=1, keepdims=True)
        rotation = 2.0 * np.sign(scalar) * (found[:, :1] * v + w * found[:, 1:] + np.cross(found[:, 1:], v))
    nobody = np.zeros(data.rows, dtype=bool)
    place = position if data.positions is None else np.where(np.isfinite(data.positions), data.positions, position)
    return Rows(**_inputs(robot, data), position=place, error_before=error, error_after=error, distance_before=distance, distance_after=distance,
                rotation_before=rotation, rotation_after=rotation, test=nobody, rejected=nobody)  # fmt: skip


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
    """Columns of ``covariance.csv``: the names, then one column per fitted parameter (unit of an entry: both units' product)."""
    names = fitted_names(result)
    return {"name": names, **{name: result.covariance[:, k] for k, name in enumerate(names)}}


def fitted_names(result: truing.Identification) -> list[str]:
    """Names of the parameters that the covariance is of."""
    return [p.name for p in result.parameters if not p.frozen]


def residual_columns(rows: Rows, measured: truing.Measurements, target_names: Sequence[str] = ()) -> dict[str, Any]:
    """Columns of ``residuals.csv``: every row with what was measured, what is predicted before and after, and the difference."""
    columns: dict[str, Any] = {"row": np.arange(rows.count), "set": np.where(rows.test, "test", "train"), "pose": rows.pose}
    if measured.targets is not None and target_names:
        columns["target"] = np.asarray(target_names)[measured.targets]
    for k, unit in enumerate(rows.joint_units):
        columns[f"q{k + 1}_{unit}"] = rows.joints[:, k]
    has = {"position": np.isfinite(rows.error_after).any(), "distance": np.isfinite(rows.distance_after).any(),
           "rotation": np.isfinite(rows.rotation_after).any()}  # fmt: skip
    if has["position"]:
        # A fixed point has no measured position: its rows carry errors alone.
        place = np.full((rows.count, 3), np.nan) if measured.positions is None else np.asarray(measured.positions)
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


def write_identification(folder: Path, result: truing.Identification, data: truing.Measurements, *, seed: int, source: str,
                         warnings: Iterable[str] = (), nominal_file: Path | None = None, base_link: str = "",
                         tip_link: str = "") -> dict[str, Any]:  # fmt: skip
    """Writes everything that ``truing identify`` found into `folder`, and returns what result.json holds.

    `source` names the data in the calibrated robot file. A `nominal_file` in URDF is also written calibrated, as URDF.
    """
    from datetime import datetime, timezone

    from truing import report
    from truing.files import load_units, save_robot, write_table

    found: dict[str, Any] = without_nan(identification_dict(result, seed=seed, warnings=warnings))
    assert result.set is not None
    rows = rows_of(result.before, result.robot, data, test=np.asarray(result.set) == 1, rejected=result.rejected_rows)
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    held_out = found["errors"].get("test", found["errors"]["train"])
    save_robot(folder / "robot.yaml", result.robot, units=load_units(nominal_file) if nominal_file else None,
               calibration={"source": source, "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"), "rms_m": held_out["after"]["rms_m"],
                            "covariance": "covariance.csv"})  # fmt: skip
    if nominal_file is not None and result.robot.convention == "urdf" and nominal_file.suffix.lower() != ".yaml":
        text = nominal_file.read_text(encoding="utf-8-sig")
        (folder / "robot.urdf").write_text(truing.urdf_with_calibration(text, result.robot, base_link, tip_link), encoding="utf-8")
    write_table(folder / "covariance.csv", covariance_columns(result))
    names = [target.name for target in result.robot.targets]
    write_table(folder / "residuals.csv", residual_columns(rows, data, names))
    page = report.identification_report(found, rows, (fitted_names(result), correlations(result.covariance)))
    (folder / "report.html").write_text(page, encoding="utf-8")
    return found


# ---- Prediction and plan ---------------------------------------------------------------------------------------------


def prediction_columns(robot: truing.Robot, data: truing.Measurements, predicted: truing.Prediction) -> dict[str, Any]:
    """Columns of ``predicted.csv``, one row per row of `data`: only `dist_m` when `data` has distances, else the pose, with
    `dist_m` as well when the robot knows its anchor."""
    distance = np.asarray(predicted.distance)
    if data.distances is not None:
        if len(distance) != data.rows:
            raise InputError(f"the data has distances, but robot {robot.name!r} has no anchor to measure them from: identify it first")
        return {"dist_m": distance}
    columns: dict[str, Any] = {f"{axis}_m": predicted.position[:, k] for k, axis in enumerate("xyz")}
    columns.update({name: predicted.orientation[:, k] for k, name in enumerate(("qw", "qx", "qy", "qz"))})
    if len(distance) == data.rows:
        columns["dist_m"] = distance
    return columns


def prediction_dict(robot: truing.Robot, rows: Rows, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing predict`` holds; errors only where something was measured."""
    result: dict[str, Any] = {"format": PREDICTION_FORMAT, "version": truing.__version__, "robot": robot.name, "rows": rows.count,
                              "warnings": list(warnings)}  # fmt: skip
    if np.isfinite(rows.magnitude_after).any():
        result["errors"] = statistics(rows.magnitude_after, rows.rotation_after)
    return result


def plan_dict(robot: truing.Robot, planned: truing.PlanResult, *, index: str, noise: float, seed: int, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing plan`` holds. `noise` of one position component [m] is what the standard errors are for."""
    return {
        "format": PLAN_FORMAT,
        "version": truing.__version__,
        "robot": robot.name,
        "poses": len(planned.joints),
        "index": {"name": index, "start": planned.index_start, "end": planned.index_end, "exchanges": planned.exchanges},
        "noise_m": noise,
        "parameters": [{**_parameter(p), "value": None} for p in planned.parameters],
        "frozen": [_frozen(f) for f in planned.frozen],
        "seed": seed,
        "warnings": list(warnings),
    }


def joint_columns(robot: truing.Robot, joints: Floats) -> dict[str, Any]:
    """Joint readings as columns: `q1_rad` …, `_m` for prismatic joints."""
    units = ["rad" if robot.joints[index].type == "revolute" else "m" for index in robot.driven_joints()]
    return {f"q{k + 1}_{unit}": joints[:, k] for k, unit in enumerate(units)}
