# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing plan`` writes: ``result.json`` and ``poses.csv``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.files.common import joint_columns, write_table
from truing.identification.result import frozen_dict, parameter_dict
from truing.planning.page import plan_report
from truing.report.json_text import to_json, without_nan

PLAN_FORMAT = "truing-plan/1"
Floats = NDArray[np.float64]


def plan_dict(
    robot: _core.Robot,
    planned: _core.PlanResult,
    *,
    index: str,
    noise: float,
    seed: int,
    seen: _core.Distinction | None = None,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing plan`` holds. `noise` of one position component [m] is what the
    standard errors are for; `seen`:
    what the plan tells apart, if that was asked for."""
    result: dict[str, Any] = {
        "format": PLAN_FORMAT,
        "version": _core.version(),
        "robot": robot.name,
        "poses": len(planned.joints) if seen is None else len(seen.joints),
        "index": {
            "name": index,
            "start": planned.index_start,
            "end": planned.index_end,
            "exchanges": planned.exchanges,
        },
        "noise_m": noise,
        "parameters": [{**parameter_dict(p), "value": None} for p in planned.parameters],
        "frozen": [frozen_dict(f) for f in planned.frozen],
        "seed": seed,
        "warnings": list(warnings),
    }
    if seen is not None:
        result["distinguish"] = distinction_dict(seen)
    return result


def distinction_dict(seen: _core.Distinction) -> dict[str, Any]:
    """The part of ``result.json`` of ``truing plan`` on effects: smallest sizes, pairs that are not told
    apart, pairs that poses were added for.
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


def _effect_pair(p: _core.EffectPair) -> dict[str, Any]:
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


def plan_columns(robot: _core.Robot, joints: Floats, seen: _core.Distinction | None = None) -> dict[str, Any]:
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


def write_plan(
    folder: Path,
    robot: _core.Robot,
    planned: _core.PlanResult,
    seen: _core.Distinction | None = None,
    *,
    index: str,
    noise: float,
    seed: int,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing plan`` found into `folder`, and returns what result.json holds."""
    found: dict[str, Any] = without_nan(
        plan_dict(robot, planned, index=index, noise=noise, seed=seed, seen=seen, warnings=warnings)
    )
    write_table(folder / "poses.csv", plan_columns(robot, planned.joints, seen))
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    driven = [robot.joints[k] for k in robot.driven_joints()]
    page = plan_report(
        found,
        [joint.name for joint in driven],
        planned.joints if seen is None else seen.joints,
        ["rad" if joint.type == "revolute" else "m" for joint in driven],
    )
    (folder / "report.html").write_text(page, encoding="utf-8")
    return found
