# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `truing fleet identify` and `truing fleet diagnose` write.

``result.json``, ``report.html``, the robot of the type (``robot.yaml``), every arm's (``robot_NAME.yaml``),
and ``arms.csv``, a row for each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.files import load_units, save_robot, write_table
from truing.fleet.diagnosis import FleetDiagnosis, FleetEffect
from truing.fleet.found import ArmFound, Errors, FleetIdentification, FleetParameter, Frozen
from truing.fleet.gram import ErrorCounts
from truing.fleet.page import fleet_report
from truing.report.json_text import to_json, without_nan
from truing.rotations import quaternions_from_rotations

IDENTIFICATION_FORMAT = "truing-fleet/1"
DIAGNOSIS_FORMAT = "truing-fleet-diagnosis/1"


def statistics_dict(errors: ErrorCounts) -> dict[str, Any]:
    """Of lengths [m]; median and 95th percentile come from a histogram, to about 1 %."""
    return {
        "rms_m": errors.rms,
        "mean_m": errors.mean,
        "median_m": errors.quantile(0.5),
        "p95_m": errors.quantile(0.95),
        "max_m": errors.largest if errors.n else math.nan,
        "n": errors.n,
    }


def errors_dict(before: Errors, after: Errors) -> dict[str, Any]:
    """As `truing identify` has them."""
    out: dict[str, Any] = {
        "train": {"before": statistics_dict(before.fitted), "after": statistics_dict(after.fitted)}
    }
    if after.held_out.n:
        out["test"] = {"before": statistics_dict(before.held_out), "after": statistics_dict(after.held_out)}
    if after.turns.n:
        out["train"]["before"]["rotation_rms_rad"] = before.turns.rms
        out["train"]["after"]["rotation_rms_rad"] = after.turns.rms
    return out


def parameter_dict(p: FleetParameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "nominal": p.nominal,
        "value": p.value,
        "sigma": p.sigma,
        "unit": p.unit,
        "frozen": p.frozen,
    }


def _frozen_dict(f: Frozen) -> dict[str, Any]:
    return {"parameter": f.parameter, "combination": dict(f.combination), "why": f.why}


def _arm_dict(arm: ArmFound) -> dict[str, Any]:
    T = arm.robot.T_measurement_base
    return {
        "rows": arm.rows,
        "left_out": arm.left_out,
        "errors": errors_dict(arm.before, arm.after),
        "parameters": [parameter_dict(p) for p in arm.parameters],
        "frozen": [_frozen_dict(f) for f in arm.frozen],
        "base": {
            "xyz": [float(x) for x in T[:3, 3]],
            "quaternion": [float(q) for q in quaternions_from_rotations(T[None, :3, :3])[0]],
            "sigma": [float(s) for s in arm.base_sigma],
        },
    }


def identification_dict(found: FleetIdentification, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing fleet identify`` holds."""
    return {
        "format": IDENTIFICATION_FORMAT,
        "version": _core.version(),
        "robot": found.robot.name,
        "errors": errors_dict(found.before, found.after),
        "parameters": [parameter_dict(p) for p in found.parameters],
        "frozen": [_frozen_dict(f) for f in found.frozen],
        "arms": {name: _arm_dict(arm) for name, arm in found.arms.items()},
        "noise_sigma_m": found.noise_sigma,
        "rows": found.rows,
        "partitions": found.partitions,
        "skipped": list(found.skipped),
        "solver": {
            "name": "lm",
            "iterations": found.iterations,
            "passes": found.passes,
            "converged": found.converged,
            "stopped_because": found.stopped_because,
        },
        "test_share": found.test_share,
        "seed": found.seed,
        "warnings": [*warnings, *_warnings(found)],
    }


def _warnings(found: FleetIdentification) -> list[str]:
    out = [*found.warnings, *(f"passed over: {fault}" for fault in found.skipped)]
    lost = sum(arm.left_out for arm in found.arms.values())
    return out + ([f"{lost} rows left out as gross outliers"] if lost else [])


def _effect_dict(effect: FleetEffect) -> dict[str, Any]:
    return {
        "effect": effect.effect,
        "joints": list(effect.joints),
        "nats": effect.nats,
        "size_at_tip_m": effect.size_at_tip,
        "parameters": [parameter_dict(p) for p in effect.parameters],
        "confounded_with": list(effect.confounded_with),
    }


def diagnosis_dict(found: FleetDiagnosis, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing fleet diagnose`` holds."""
    return {
        **identification_dict(found.identification, warnings),
        "format": DIAGNOSIS_FORMAT,
        "sentence": found.sentence,
        "of_all": [_effect_dict(effect) for effect in found.of_all],
        "of_arms": {name: [_effect_dict(e) for e in effects] for name, effects in found.of_arms.items()},
        "scattered": list(found.scattered),
        "unexplained": list(found.unexplained),
        "not_testable": [{"effect": n.effect, "why": n.why} for n in found.not_testable],
    }


def arm_columns(arms: Mapping[str, ArmFound]) -> dict[str, Any]:
    """``arms.csv``: a row for each arm, with its errors, its zeros and what else is its own."""
    columns: dict[str, Any] = {"arm": list(arms)}
    columns["rows"] = np.array([arm.rows for arm in arms.values()])
    columns["left_out"] = np.array([arm.left_out for arm in arms.values()])
    for when in ("before", "after"):
        columns[f"rms_{when}_m"] = np.array([getattr(arm, when).fitted.rms for arm in arms.values()])
    names = dict.fromkeys((p.name, p.unit) for arm in arms.values() for p in arm.parameters)
    known = {name: {p.name: p for p in arm.parameters} for name, arm in arms.items()}
    for name, unit in names:
        called = name if unit == "-" else f"{name}_{unit.replace('/', '_per_')}"
        mine = [known[arm].get(name) for arm in arms]
        columns[called] = np.array([math.nan if p is None else p.value for p in mine])
        columns[f"{called}_sigma"] = np.array([math.nan if p is None else p.sigma for p in mine])
    return columns


def file_of_arm(name: str, taken: set[str]) -> str:
    """A file name for an arm, whatever it is called; none twice."""
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)[:100]
    while plain in taken:
        plain += "_"
    taken.add(plain)
    return f"robot_{plain}.yaml"


def write_fleet(
    folder: Path,
    found: FleetIdentification | FleetDiagnosis,
    *,
    nominal_file: Path,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that was found into `folder`, and returns what result.json holds."""
    if isinstance(found, FleetDiagnosis):
        known, fit = diagnosis_dict(found, warnings), found.identification
    else:
        known, fit = identification_dict(found, warnings), found
    result: dict[str, Any] = without_nan(known)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    units, date = load_units(nominal_file), datetime.now(timezone.utc).strftime("%Y-%m-%d")
    about = {"source": f"a fleet of {len(fit.arms)} arms", "date": date, "rms_m": fit.after.fitted.rms}
    save_robot(folder / "robot.yaml", fit.robot, units=units, calibration=about)
    taken: set[str] = set()
    for name, arm in fit.arms.items():
        about = {"source": f"arm {name} of a fleet", "date": date, "rms_m": arm.after.fitted.rms}
        save_robot(folder / file_of_arm(name, taken), arm.robot, units=units, calibration=about)
    write_table(folder / "arms.csv", arm_columns(fit.arms))
    (folder / "report.html").write_text(fleet_report(result), encoding="utf-8")
    return result
