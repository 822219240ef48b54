# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing diagnose`` writes: ``result.json``, ``residuals.csv``, ``next_poses.csv`` and the robots."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.diagnosis.page import UNKNOWN, colour_of, diagnosis_report, plain_name
from truing.drawing import cause, effects_of, robot_picture, without
from truing.errors import InputError
from truing.files import Looks, looks_of, write_table
from truing.files.common import joint_columns
from truing.identification.result import (
    block,
    column,
    joint_inputs,
    parameter_dict,
    residual_columns,
    statistics_dict,
    write_robot,
)
from truing.report.json_text import to_json, without_nan
from truing.report.rows import Rows
from truing.report.scene import RobotPicture

DIAGNOSIS_FORMAT = "truing-diagnosis/1"
Floats = NDArray[np.float64]


def with_second_record(robot: _core.Robot, data: _core.Measurements) -> _core.Measurements:
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


def diagnosis_dict(found: _core.Diagnosis, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing diagnose`` holds. `warnings`: more of them, first."""
    return {
        "format": DIAGNOSIS_FORMAT,
        "version": _core.version(),
        "robot": found.robot.name,
        "verdict": found.verdict,
        "explained": found.explained,
        "sentence": found.sentence,
        "gap": {
            **statistics_dict(found.gap),
            "noise_floor_m": found.noise_floor,
            "noise_from_repeats": found.noise_from_repeats,
            "closable": found.closable,
            "p": found.p_gap,
            "parts": _parts(found),
        },
        "after": {**statistics_dict(found.after), "remaining_structure_p": found.remaining_structure_p},
        "after_unknown": statistics_dict(found.after_unknown),
        "after_robot_with_unknown": found.robot_with_unknown
        and statistics_dict(found.after_robot_with_unknown),
        "shrink": {"value": found.shrink.value, "ci": _interval(found.shrink)},
        "held_out_fall": {
            "poses": found.held_out_fall.poses,
            "mean_m": found.held_out_fall.mean,
            "sigma_m": found.held_out_fall.sigma,
            "probability": found.held_out_fall.probability,
        },
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
        "sanity": [
            {"kind": s.kind, "text": s.text, "rows": list(s.rows), "mistake": s.mistake} for s in found.sanity
        ],
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
        "rows": len(found.set),
        "outliers": list(found.outliers),
        "seed": found.seed,
        "warnings": [*warnings, *found.warnings],
    }


def _interval(share: _core.Share) -> list[float]:
    return [share.low, share.high]


def _held_out(found: _core.FoundEffect | _core.UnknownEffect) -> dict[str, Any]:
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


def _curve(c: _core.Curve, robot: _core.Robot) -> dict[str, Any]:
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
        "period": c.period or None,
        "second": second,
        "unit": c.unit,
        "points": c.points,
        "samples": c.samples,
    }


def _input_unit(name: str, robot: _core.Robot) -> str:
    """Unit of what a free function depends on: "q3", "torque2", "temp" …"""
    joint = re.fullmatch(r"q([0-9]+)", name)
    if joint:
        return "rad" if robot.joints[int(joint[1]) - 1].type == "revolute" else "m"
    return {"torque": "Nm", "payload": "kg", "temp": "deg C", "time": "s"}.get(name.rstrip("0123456789"), "")


def _effect(e: _core.FoundEffect, robot: _core.Robot) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "joints": list(e.joints),
        "probability": e.probability,
        "parameters": [parameter_dict(p) for p in e.parameters],
        "held_out": _held_out(e),
        "size_at_tip_m": e.size_at_tip,
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


def _unknown(u: _core.UnknownEffect, robot: _core.Robot) -> dict[str, Any]:
    first: Floats | list[Any] = u.curves[0].points[:, :2] if u.curves else []
    return {
        "joint": u.joint,
        "inputs": list(u.inputs),
        "probability": u.probability,
        "held_out": _held_out(u),
        "size_at_tip_m": u.size_at_tip,
        "share": u.share,
        "curve": first,
        "curves": [_curve(c, robot) for c in u.curves],
        "looks_like": u.looks_like,
    }


def _next_pose(p: _core.NextPose) -> dict[str, Any]:
    return {"joints": p.joints, "direction": list(p.direction), "payload_kg": p.payload, "why": p.why}


def _parts(found: _core.Diagnosis) -> dict[str, Any]:
    """The gap's mean square cut into parts that add up to 1: noise, each effect, each unknown function,
    unexplained.
    """
    effects, unknown = [e.share for e in found.effects], [u.share for u in found.unknown]
    left = max(0.0, 1.0 - sum(effects) - sum(unknown))
    noise = min(left, (found.noise_floor / found.gap.rms) ** 2) if found.gap.rms > 0 else left
    return {"noise": noise, "effects": effects, "unknown": unknown, "unexplained": left - noise}


def diagnosis_rows(found: _core.Diagnosis, data: _core.Measurements) -> Rows:
    """Errors of every row of `data` before and after; `rejected`: rows that counted for little."""
    before, after = found.residuals_before, found.residuals_after
    out = np.zeros(data.rows, dtype=bool)
    out[list(found.outliers)] = True
    return Rows(
        **joint_inputs(found.robot, data),
        position=np.full((data.rows, 3), np.nan) if data.positions is None else np.asarray(data.positions),
        error_before=block(before.position, data.rows),
        error_after=block(after.position, data.rows),
        distance_before=column(before.distance, data.rows),
        distance_after=column(after.distance, data.rows),
        rotation_before=block(before.rotation, data.rows),
        rotation_after=block(after.rotation, data.rows),
        test=np.asarray(found.set) == 1,
        rejected=out,
    )


def diagnosis_columns(
    rows: Rows, measured: _core.Measurements, target_names: Sequence[str], directions: Floats | None = None
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


def next_pose_columns(found: _core.Diagnosis) -> dict[str, Any]:
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
    found: _core.Diagnosis,
    data: _core.Measurements,
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
    result: dict[str, Any] = without_nan(diagnosis_dict(found, warnings=warnings))
    if found.joint_record == "qr":  # what it went by
        data = with_second_record(found.robot, data)
    rows = diagnosis_rows(found, data)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    own = found.gap.rms * (1.0 - found.shrink.value)  # the robot file holds no drifts and no free functions
    write_robot(folder, found.robot, source, {"rms_m": own}, nominal_file, base_link, tip_link)
    if found.robot_with_unknown is not None:
        by_tables = {"rms_m": found.after_robot_with_unknown.rms}
        write_robot(
            folder,
            found.robot_with_unknown,
            source,
            by_tables,
            nominal_file,
            base_link,
            tip_link,
            "robot_with_unknown",
        )
    write_table(
        folder / "residuals.csv",
        diagnosis_columns(rows, data, [target.name for target in found.robot.targets], found.directions),
    )
    if found.next_poses:
        write_table(folder / "next_poses.csv", next_pose_columns(found))
    looks = looks_of(nominal_file, found.robot, base_link)
    page = diagnosis_report(result, rows, diagnosed_picture(found, result, data, looks))
    (folder / "report.html").write_text(page, encoding="utf-8")
    return result


def diagnosis_page(found: _core.Diagnosis, data: _core.Measurements) -> str:
    """The report of ``truing diagnose`` without its files."""
    result: dict[str, Any] = without_nan(diagnosis_dict(found))
    if found.joint_record == "qr":
        data = with_second_record(found.robot, data)
    return diagnosis_report(result, diagnosis_rows(found, data), diagnosed_picture(found, result, data))


def diagnosed_picture(
    found: _core.Diagnosis,
    result: Mapping[str, Any],
    data: _core.Measurements,
    looks: Looks | None = None,
) -> RobotPicture:
    """The robot without what was named, and each cause that was found, the largest first; all at last."""
    causes = [_named(number, effect, found.robot) for number, effect in enumerate(result["effects"])]
    causes += [_unnamed(unknown) for unknown in result["unknown"]]
    every = {name: value for c in causes for name, value in c["added"].items()}
    if len(causes) > 1:
        together = {key: [v for c in causes for v in c[key]] for key in ("joints", "effects", "curves")}
        causes.append(cause("all that was found", UNKNOWN, added=every, **together))
    named = {p["name"] for effect in result["effects"] for p in effect["parameters"]}
    old = [e for e in found.robot.effects if not set(e.parameters) & named]
    return robot_picture(
        without(found.robot, every).replace(effects=old),
        causes=causes,
        readings=np.asarray(data.joints),
        payload=None if data.payload is None else np.asarray(data.payload),
        temperature=None if data.temperature is None else np.asarray(data.temperature),
        looks=looks,
    )


def _named(number: int, effect: Mapping[str, Any], robot: _core.Robot) -> dict[str, Any]:
    """An effect that was named: values that it adds to the chain, or a law."""
    values = {p["name"]: p["value"] - p["nominal"] for p in effect["parameters"] if not p["frozen"]}
    laws: list[dict[str, Any]] = []
    if any(name.startswith(effect["effect"]) for name in values):  # else values of the chain itself
        laws = [a for a in effects_of(robot) if set(a["parameters"]) & set(values)]
        laws = laws or [{**effect, "parameters": {p["name"]: p["value"] for p in effect["parameters"]}}]
        laws = [{key: law[key] for key in ("effect", "joints", "parameters")} for law in laws]
    name = f"{plain_name(effect['effect'])}{_at_joints(effect['joints'])}"
    return cause(name, colour_of(number), effect["joints"], added={} if laws else values, effects=laws)


def _unnamed(unknown: Mapping[str, Any]) -> dict[str, Any]:
    """What no effect explains: its curves."""
    joints = [unknown["joint"]] if unknown["joint"] else []
    keys = ("site", "input", "second")
    curves = [
        {**{key: c[key] for key in keys}, "points": [point[:2] for point in c["points"]]}
        for c in unknown["curves"]
    ]
    return cause(f"unknown{_at_joints(joints)}", UNKNOWN, joints, curves=curves)


def _at_joints(joints: Sequence[str]) -> str:
    return f" at {', '.join(joints)}" if joints else ""
