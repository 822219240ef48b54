# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing identify`` and ``truing predict`` write.

``result.json``, ``covariance.csv``, ``residuals.csv``, the robot and the report.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.drawing import cause, differences, effects_of, robot_picture, tip_motion
from truing.errors import InputError, InputWarning
from truing.files import (
    Looks,
    is_urdf,
    load_robot,
    load_units,
    looks_of,
    save_robot,
    says_flange,
    with_flange,
    write_table,
)
from truing.identification.api import predict, residuals
from truing.identification.page import identification_report, prediction_report
from truing.report.charts import REJECTED
from truing.report.json_text import to_json, without_nan
from truing.report.rows import Rows, statistics
from truing.report.scene import RobotPicture

IDENTIFICATION_FORMAT = "truing-identification/1"
PREDICTION_FORMAT = "truing-prediction/1"
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


def correlations(covariance: Floats) -> Floats:
    """Correlation matrix of a covariance matrix, shape=(n, n)."""
    sigma = np.sqrt(np.diag(covariance))
    safe = np.where(sigma > 0, sigma, 1.0)
    return np.asarray(np.clip(covariance / safe[:, None] / safe, -1, 1))


def identification_dict(
    result: _core.Identification,
    *,
    seed: int,
    warnings: Iterable[str] = (),
    mistake: _core.Mistake | None = None,
    noise_from_repeats: float | None = None,
) -> dict[str, Any]:
    """What ``result.json`` of ``truing identify`` holds. `seed`: of the split; `warnings`: more of them,
    first; `mistake`: what `review` said; `noise_from_repeats`: of one component [m].
    """
    errors = {"train": result.train} if result.test is None else {"train": result.train, "test": result.test}
    return {
        "format": IDENTIFICATION_FORMAT,
        "version": _core.version(),
        "robot": result.robot.name,
        "mistake": mistake_dict(mistake),
        "errors": {
            name: {"before": statistics_dict(e.before), "after": statistics_dict(e.after)}
            for name, e in errors.items()
        },
        "parameters": [parameter_dict(p) for p in result.parameters],
        "effects": [
            {"effect": e.effect, "joints": list(e.joints), "parameters": dict(e.parameters)}
            for e in result.robot.effects
        ],
        "frozen": [frozen_dict(f) for f in result.frozen],
        "rejected_rows": list(result.rejected_rows),
        "solver": {
            "name": result.solver.name,
            "iterations": result.solver.iterations,
            "converged": result.solver.converged,
            "stopped_because": result.solver.stopped_because,
        },
        "noise_sigma_m": result.noise_sigma,
        "noise_from_repeats_m": noise_from_repeats,
        "rotation_noise_sigma_rad": result.rotation_noise_sigma,
        "shrunk_to": result.shrunk_to,
        "rank": result.rank,
        "columns": result.columns,
        "seed": seed,
        "warnings": [*warnings, *_warnings_of(result, mistake)],
    }


def statistics_dict(e: _core.ErrorStatistics) -> dict[str, Any]:
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


def _warnings_of(result: _core.Identification, mistake: _core.Mistake | None) -> Sequence[str]:
    """A mistake is said once: warnings of a fit to it say the same in other words, or nothing."""
    return result.warnings if mistake is None or mistake.kind == "unexplained" else ()


def mistake_dict(mistake: _core.Mistake | None) -> dict[str, Any] | None:
    if mistake is None:
        return None
    return {
        "kind": mistake.kind,
        "text": mistake.text,
        "changes": [parameter_dict(p) for p in mistake.changes],
    }


def parameter_dict(p: _core.Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "nominal": p.nominal,
        "value": p.value,
        "sigma": p.sigma,
        "unit": p.unit,
        "frozen": p.frozen,
    }


def frozen_dict(f: _core.Frozen) -> dict[str, Any]:
    return {"parameter": f.parameter, "combination": dict(f.combination), "why": f.why}


def rows_of(
    before: _core.Robot,
    after: _core.Robot,
    data: _core.Measurements,
    *,
    test: Bools,
    rejected: Sequence[int] = (),
) -> Rows:
    """Errors of every row of `data` for two robots. `test`: shape=(n,), the rows held out; `rejected`: rows
    left out of the fit.
    """
    out = np.zeros(data.rows, dtype=bool)
    out[list(rejected)] = True
    old, new = residuals(before, data), residuals(after, data)
    predicted = np.asarray(predict(after, data).position)
    return Rows(
        **joint_inputs(after, data),
        position=(
            predicted
            if data.positions is None
            else np.where(np.isfinite(data.positions), data.positions, predicted)
        ),
        error_before=block(old.position, data.rows),
        error_after=block(new.position, data.rows),
        distance_before=column(old.distance, data.rows),
        distance_after=column(new.distance, data.rows),
        rotation_before=block(old.rotation, data.rows),
        rotation_after=block(new.rotation, data.rows),
        test=test,
        rejected=out,
    )


def predicted_rows(robot: _core.Robot, data: _core.Measurements, predicted: _core.Prediction) -> Rows:
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
        **joint_inputs(robot, data),
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


def joint_inputs(robot: _core.Robot, data: _core.Measurements) -> dict[str, Any]:
    driven = [robot.joints[index] for index in robot.driven_joints()]
    return {
        "joint_names": tuple(joint.name for joint in driven),
        "joint_units": tuple("rad" if joint.type == "revolute" else "m" for joint in driven),
        "joints": np.asarray(data.joints),
        "pose": np.asarray(_core.pose_groups(data)),
        "time": None if data.time is None or not np.isfinite(data.time).all() else np.asarray(data.time),
    }


def block(values: Floats, rows: int) -> Floats:
    return np.asarray(values) if len(values) == rows else np.full((rows, 3), np.nan)


def column(values: Floats, rows: int) -> Floats:
    return np.asarray(values) if len(values) == rows else np.full(rows, np.nan)


def covariance_columns(result: _core.Identification) -> dict[str, Any]:
    """Columns of ``covariance.csv``: the names, then one column per fitted parameter (unit of an entry: both
    units' product).
    """
    names = fitted_names(result)
    return {"name": names, **{name: result.covariance[:, k] for k, name in enumerate(names)}}


def fitted_names(result: _core.Identification) -> list[str]:
    """Names of the parameters that the covariance is of."""
    return [p.name for p in result.parameters if not p.frozen]


def residual_columns(
    rows: Rows, measured: _core.Measurements, target_names: Sequence[str] = ()
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
    result: _core.Identification,
    data: _core.Measurements,
    *,
    seed: int,
    source: str,
    warnings: Iterable[str] = (),
    mistake: _core.Mistake | None = None,
    nominal_file: Path | None = None,
    base_link: str = "",
    tip_link: str = "",
) -> dict[str, Any]:
    """Writes everything that ``truing identify`` found into `folder`, and returns what result.json holds.

    `source` names the data in the calibrated robot file; `mistake` is what `review` said. A `nominal_file` in
    URDF is also written calibrated, as URDF.
    """
    found: dict[str, Any] = without_nan(
        identification_dict(
            result,
            seed=seed,
            warnings=warnings,
            mistake=mistake,
            noise_from_repeats=_core.noise_from_repeats(data),
        )
    )
    rows = _rows(result, data)
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
    looks = looks_of(nominal_file, result.before, base_link)
    (folder / "report.html").write_text(_page(found, rows, result, data, looks), encoding="utf-8")
    return found


def _rows(result: _core.Identification, data: _core.Measurements) -> Rows:
    assert result.set is not None
    test = np.asarray(result.set) == 1
    return rows_of(result.before, result.robot, data, test=test, rejected=result.rejected_rows)


def _page(
    found: dict[str, Any],
    rows: Rows,
    result: _core.Identification,
    data: _core.Measurements,
    looks: Looks | None = None,
) -> str:
    correlation = fitted_names(result), correlations(result.covariance)
    picture = calibrated_picture(result.before, result.robot, data, looks=looks)
    return identification_report(found, rows, correlation, picture)


def identification_page(result: _core.Identification, data: _core.Measurements, seed: int) -> str:
    """The report of ``truing identify`` without its files."""
    repeats = _core.noise_from_repeats(data)
    found = without_nan(identification_dict(result, seed=seed, noise_from_repeats=repeats))
    return _page(found, _rows(result, data), result, data)


def calibrated_picture(
    before: _core.Robot,
    after: _core.Robot,
    data: _core.Measurements,
    most: int = 8,
    looks: Looks | None = None,
) -> RobotPicture:
    """The robot before, and what was found: all of it, and what each joint and each effect has of it, the
    joint that moves the tip most first. `most`: so many of them.
    """
    readings = np.asarray(data.joints)
    some = readings[:: max(1, len(readings) // 200)]
    added = differences(before, after)
    sizes = {joint.name: tip_motion(before, after, joint.name, some) for joint in before.joints}
    worst = sorted((name for name in sizes if sizes[name] > 0), key=lambda name: -sizes[name])
    old = effects_of(before)
    effects = [effect for effect in effects_of(after) if effect not in old]
    guilty = worst[:1] or [name for effect in effects[:1] for name in effect["joints"]]
    causes = [cause("all that was found", REJECTED, guilty, added=added, effects=effects)]
    for effect in effects:
        where = f" at {', '.join(effect['joints'])}" if effect["joints"] else ""
        name = f"{effect['effect'].replace('_', ' ')}{where}"
        causes.append(cause(name, REJECTED, effect["joints"], effects=[effect]))
    for name in worst:
        own = {key: value for key, value in added.items() if key.startswith(f"{name}.")}
        causes.append(cause(f"values of {name}", REJECTED, [name], added=own))
    return robot_picture(
        before,
        causes=[] if not (added or effects) else causes[: most + 1],
        readings=readings,
        payload=None if data.payload is None else np.asarray(data.payload),
        temperature=None if data.temperature is None else np.asarray(data.temperature),
        looks=looks,
    )


def write_robot(
    folder: Path,
    robot: _core.Robot,
    source: str,
    calibration: dict[str, Any],
    nominal_file: Path | None,
    base_link: str,
    tip_link: str,
    stem: str = "robot",
) -> None:
    """Writes ``robot.yaml`` in the units of the nominal file, and ``robot.urdf`` if that was URDF (of MJCF
    only the former). `stem`: another name."""
    save_robot(
        folder / f"{stem}.yaml",
        robot if nominal_file is None else _with_flange(robot, nominal_file, base_link, tip_link),
        units=load_units(nominal_file) if nominal_file else None,
        calibration={
            "source": source,
            "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
            **calibration,
        },
    )
    if nominal_file is None or not is_urdf(nominal_file):
        return
    if robot.convention == "urdf":
        text = nominal_file.read_text(encoding="utf-8-sig")
        (folder / f"{stem}.urdf").write_text(
            _core.urdf_with_calibration(text, robot, base_link, tip_link), encoding="utf-8"
        )


def _with_flange(robot: _core.Robot, nominal_file: Path, base_link: str, tip_link: str) -> _core.Robot:
    """With the flange of the nominal robot, if that is of a URDF or an MJCF."""
    if robot.convention != "urdf" or says_flange(robot):
        return robot
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # heard when it was read first
        return with_flange(robot, load_robot(nominal_file, base_link, tip_link))


def prediction_columns(
    robot: _core.Robot, data: _core.Measurements, predicted: _core.Prediction
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


def prediction_dict(robot: _core.Robot, rows: Rows, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing predict`` holds; errors only where something was measured."""
    result: dict[str, Any] = {
        "format": PREDICTION_FORMAT,
        "version": _core.version(),
        "robot": robot.name,
        "rows": rows.count,
        "warnings": list(warnings),
    }
    if np.isfinite(rows.magnitude_after).any():
        result["errors"] = statistics(rows.magnitude_after, rows.rotation_after)
    return result


def write_prediction(
    folder: Path,
    robot: _core.Robot,
    data: _core.Measurements,
    predicted: _core.Prediction,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing predict`` found into `folder`, and returns what result.json holds."""
    rows = predicted_rows(robot, data, predicted)
    found: dict[str, Any] = without_nan(prediction_dict(robot, rows, warnings))
    write_table(folder / "predicted.csv", prediction_columns(robot, data, predicted))
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(prediction_report(found, rows), encoding="utf-8")
    return found
