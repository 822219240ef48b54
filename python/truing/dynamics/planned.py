# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing dynamics plan`` writes: ``result.json``, ``motion.csv`` and ``report.html``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.dynamics.plan_page import plan_report
from truing.files import write_table
from truing.report.json_text import to_json, without_nan

PLAN_FORMAT = "truing-dynamics/1"


def plan_dict(
    robot: _core.Robot, planned: _core.TorquePlan, *, seed: int, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics plan`` holds. `given`: of recordings that were given."""
    joints = [robot.joints[index].name for index in robot.driven_joints()]
    found: dict[str, Any] = {
        "format": PLAN_FORMAT,
        "version": _core.version(),
        "robot": robot.name,
        "joints": joints,
        "rows": len(planned.time),
        "duration_s": float(planned.time[-1]),
        "runs": [{"payload_kg": r.payload, "temp_C": r.temperature} for r in planned.runs],
        "torque_noise_Nm": dict(zip(joints, np.asarray(planned.torque_noise).tolist(), strict=True)),
        "information_nats": {"random": planned.information_random, "planned": planned.information},
        "evaluated": planned.evaluated,
        "planned": outlook_dict(planned.planned),
        "random": outlook_dict(planned.random),
        "separated": [_pair(p) for p in planned.separated],
        "seed": seed,
        "warnings": [*warnings, *planned.warnings],
    }
    if planned.given.effects or planned.given.not_testable:
        found["given"] = outlook_dict(planned.given)
    return found


def outlook_dict(outlook: _core.TorqueOutlook) -> dict[str, Any]:
    """What motions could show: smallest sizes, pairs that are not told apart, what would not show."""
    return {
        "effects": [
            {
                "effect": e.effect,
                "joints": list(e.joints),
                "parameter": e.parameter,
                "unit": e.unit,
                "size": e.size,
                "size_apart": e.size_apart,
                "joint": e.joint,
                "torque_Nm": e.torque,
                "closest": e.closest,
                "closest_joints": list(e.closest_joints),
                "r2": e.r2,
            }
            for e in outlook.effects
        ],
        "alike": [_pair(p) for p in outlook.alike],
        "not_testable": [
            {"effect": n.effect, "joints": list(n.joints), "why": n.why} for n in outlook.not_testable
        ],
    }


def _pair(p: _core.TorqueEffectPair) -> dict[str, Any]:
    return {
        "effect": p.effect,
        "joints": list(p.joints),
        "other": p.other,
        "other_joints": list(p.other_joints),
        "r2": p.r2,
        "separated_by": p.separated_by,
    }


def motion_columns(robot: _core.Robot, planned: _core.TorquePlan) -> dict[str, Any]:
    """Columns of ``motion.csv``: time, then position and speed of every joint that is driven."""
    columns: dict[str, Any] = {"t_s": np.asarray(planned.time)}
    for stem, table, per in (("q", planned.position, ""), ("qd", planned.speed, "_s")):
        for k, index in enumerate(robot.driven_joints()):
            unit = "rad" if robot.joints[index].type == "revolute" else "m"
            columns[f"{stem}{k + 1}_{unit}{per}"] = np.asarray(table[:, k])
    return columns


def write_torque_plan(
    folder: Path,
    robot: _core.Robot,
    planned: _core.TorquePlan,
    *,
    seed: int,
    columns: Sequence[str],
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing dynamics plan`` found, and returns what result.json holds."""
    result: dict[str, Any] = without_nan(
        {**plan_dict(robot, planned, seed=seed, warnings=warnings), "columns": list(columns)}
    )
    write_table(folder / "motion.csv", motion_columns(robot, planned))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    units = ["rad" if robot.joints[k].type == "revolute" else "m" for k in robot.driven_joints()]
    report = plan_report(result, np.asarray(planned.time), np.asarray(planned.position), units)
    (folder / "report.html").write_text(report, encoding="utf-8")
    return result
