# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `truing fleet dynamics` writes.

``result.json``, ``report.html``, the robot of the type (``robot.yaml``), every arm's (``robot_NAME.yaml``),
and ``arms.csv``, a row for each.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.files import load_units, save_robot, write_table
from truing.fleet.result import file_of_arm, parameter_dict
from truing.fleet.torque_page import torque_report
from truing.fleet.torques import ArmTorques, FleetDynamics, TorqueErrorOf
from truing.report.json_text import to_json, without_nan

DYNAMICS_FORMAT = "truing-fleet-dynamics/1"


def _error_dict(error: TorqueErrorOf) -> dict[str, Any]:
    return {
        "joint": error.joint,
        "nominal_percent": error.nominal,
        "shared_percent": error.shared,
        "own_percent": error.own,
        "own_rms_Nm": error.rms,
        "rows": error.rows,
    }


def _arm_dict(arm: ArmTorques) -> dict[str, Any]:
    return {
        "recordings": arm.recordings,
        "rows": arm.rows,
        "held_out": [_error_dict(error) for error in arm.errors],
        "parameters": [parameter_dict(p) for p in arm.parameters],
    }


def dynamics_dict(found: FleetDynamics, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing fleet dynamics`` holds."""
    return {
        "format": DYNAMICS_FORMAT,
        "version": _core.version(),
        "robot": found.robot.name,
        "sentence": found.sentence,
        "stands_out": [asdict(one) for one in found.stands_out],
        "unexplained": list(found.unexplained),
        "held_out": [_error_dict(error) for error in found.errors],
        "held_out_are": found.held_out,
        "parameters": [parameter_dict(p) for p in found.parameters],
        "arms": {name: _arm_dict(arm) for name, arm in found.arms.items()},
        "cutoff_Hz": found.cutoff,
        "rows": found.rows,
        "partitions": found.partitions,
        "skipped": list(found.skipped),
        "solver": {
            "name": "gauss-newton",
            "iterations": found.iterations,
            "passes": found.passes,
            "converged": found.converged,
            "stopped_because": "predicted fall of the cost far below the noise"
            if found.converged
            else "iteration limit",
        },
        "warnings": [*warnings, *found.warnings, *(f"passed over: {fault}" for fault in found.skipped)],
    }


def arm_columns(arms: Mapping[str, ArmTorques]) -> dict[str, Any]:
    """``arms.csv``: a row for each arm, with its held-out errors and what is its own."""
    columns: dict[str, Any] = {"arm": list(arms)}
    columns["recordings"] = np.array([arm.recordings for arm in arms.values()])
    columns["rows"] = np.array([arm.rows for arm in arms.values()])
    first = next(iter(arms.values()))
    for j, error in enumerate(first.errors):
        for model in ("nominal", "shared", "own"):
            values = [getattr(arm.errors[j], model) for arm in arms.values()]
            columns[f"{model}_{error.joint}_percent"] = np.array(values)
    for k, parameter in enumerate(first.parameters):
        unit = parameter.unit.replace("/", "_per_").replace(" ", "_")
        called = parameter.name if unit == "-" else f"{parameter.name}_{unit}"
        columns[called] = np.array([arm.parameters[k].value for arm in arms.values()])
        columns[f"{called}_sigma"] = np.array([arm.parameters[k].sigma for arm in arms.values()])
    return columns


def write_fleet_dynamics(
    folder: Path, found: FleetDynamics, *, nominal_file: Path, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything that was found into `folder`, and returns what result.json holds."""
    result: dict[str, Any] = without_nan(dynamics_dict(found, warnings))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    units, date = load_units(nominal_file), datetime.now(timezone.utc).strftime("%Y-%m-%d")
    about = {"source": f"torques of a fleet of {len(found.arms)} arms", "date": date}
    save_robot(folder / "robot.yaml", found.robot, units=units, calibration=about)
    taken: set[str] = set()
    for name, arm in found.arms.items():
        about = {"source": f"torques of arm {name} of a fleet", "date": date}
        save_robot(folder / file_of_arm(name, taken), arm.robot, units=units, calibration=about)
    write_table(folder / "arms.csv", arm_columns(found.arms))
    (folder / "report.html").write_text(torque_report(result), encoding="utf-8")
    return result
