# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing performance`` writes: ``result.json``, the report, of a plan what to drive and to fill in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.errors import InputError
from truing.files.common import frame_dict, joint_columns, write_table
from truing.performance.assessment import USUAL_CYCLES, Assessment, Quantity, WarmUp
from truing.performance.drive import DriveOptions, performance_programs, program_files
from truing.performance.page import performance_plan_report, performance_report
from truing.performance.plan import SHEET, PerformancePlan, sheet_rows
from truing.programs.write import BRANDS
from truing.report.json_text import to_json, without_nan

PERFORMANCE_FORMAT = "truing-performance/1"
PLAN_FORMAT = "truing-performance-plan/1"
FLOOR_SHARE = 0.25  # an instrument's uncertainty above this share of a value is said


@dataclass(frozen=True)
class ReportNotes:
    """What a report says of how the test was made."""

    robot: str = ""
    instrument: str = ""
    length_uncertainty: float | None = None  # [m] expanded, k = 2
    angle_uncertainty: float | None = None  # [rad] expanded, k = 2
    rated_load: float | None = None  # [kg]
    rated_speed: float | None = None  # [m/s]
    measured_point: str = ""


def performance_dict(
    found: Mapping[str, Assessment],
    files: Mapping[str, Path],
    notes: ReportNotes,
    *,
    commanded: Path | None = None,
    seed: int = 0,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """What ``result.json`` of ``truing performance report`` holds. found, files: by the label of a column."""
    every: dict[tuple[str, str, float, float], dict[str, Any]] = {}
    for label, assessment in found.items():
        for one in assessment.quantities:
            row = every.setdefault(_key(one), _quantity_dict(one))
            row["values"][label] = _value_dict(one, notes)
    said = [f"{_of(label, found)}{text}" for label, one in found.items() for text in one.warnings]
    return {
        "format": PERFORMANCE_FORMAT,
        "version": _core.version(),
        "standard": "ISO 9283:1998",
        "robot": notes.robot,
        "instrument": {
            "name": notes.instrument,
            "uncertainty_m": notes.length_uncertainty,
            "uncertainty_rad": notes.angle_uncertainty,
        },
        "rated": {"load_kg": notes.rated_load, "speed_m_s": notes.rated_speed},
        "measured_point": notes.measured_point,
        "commanded": None if commanded is None else str(commanded),
        "columns": [
            {
                "label": label,
                "file": str(files[label]),
                "aligned": None
                if one.alignment is None
                else {
                    "poses": one.alignment.poses,
                    "T_commanded_measured": one.alignment.T_commanded_measured.tolist(),
                },
            }
            for label, one in found.items()
        ],
        "confidence": 0.95,
        "usual_cycles": dict(USUAL_CYCLES),
        "quantities": list(every.values()),
        "warm_up": [_warm_up_dict(label, course) for label, a in found.items() for course in a.warm_ups],
        "not_found": [
            {"label": label, "quantity": one.name, "at": one.at, "why": one.why}
            for label, a in found.items()
            for one in a.not_found
        ],
        "seed": seed,
        "warnings": [*warnings, *said],
    }


def _of(label: str, found: Mapping[str, Assessment]) -> str:
    return f"{label}: " if len(found) > 1 else ""


def _key(one: Quantity) -> tuple[str, str, float, float]:
    return one.name, one.at, -1.0 if math.isnan(one.load) else one.load, _speed_key(one)


def _speed_key(one: Quantity) -> float:
    return -1.0 if math.isnan(one.speed) else one.speed


def _quantity_dict(one: Quantity) -> dict[str, Any]:
    return {
        "quantity": one.name,
        "clause": one.clause,
        "at": one.at,
        "load_percent": one.load,
        "speed_percent": one.speed,
        "unit": one.unit,
        "values": {},
    }


def _value_dict(one: Quantity, notes: ReportNotes) -> dict[str, Any]:
    uncertainty = notes.length_uncertainty if one.unit == "m" else notes.angle_uncertainty
    return {
        "value": one.value,
        "ci": list(one.interval),
        "cycles": one.cycles,
        "at_floor": None if uncertainty is None else uncertainty > FLOOR_SHARE * abs(one.value),
    }


def _warm_up_dict(label: str, course: WarmUp) -> dict[str, Any]:
    def plain(values: np.ndarray[Any, Any] | None) -> list[float] | None:
        return None if values is None else [float(value) for value in values]

    return {
        "label": label,
        "pose": course.pose,
        "t_s" if course.timed else "block": plain(course.time),
        "temp_C": plain(course.temperature),
        "AP_m": plain(course.accuracy),
        "RP_m": plain(course.repeatability),
        "travel_m": plain(course.travel),
        "compensated_m": plain(course.compensated),
        "thermal_effects": list(course.effects),
        "not_compensated_because": course.why_not,
    }


def write_performance(
    folder: Path,
    found: Mapping[str, Assessment],
    files: Mapping[str, Path],
    notes: ReportNotes,
    *,
    commanded: Path | None = None,
    seed: int = 0,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing performance report`` found into `folder`, and returns what result.json
    holds.
    """
    result: dict[str, Any] = without_nan(
        performance_dict(found, files, notes, commanded=commanded, seed=seed, warnings=warnings)
    )
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    (folder / "report.html").write_text(performance_report(result), encoding="utf-8")
    return result


def write_performance_plan(
    folder: Path,
    robot: _core.Robot,
    planned: PerformancePlan,
    drive: DriveOptions,
    *,
    warnings: Iterable[str] = (),
) -> dict[str, Any]:
    """Writes everything that ``truing performance plan`` makes into `folder`, and returns what result.json
    holds.
    """
    said = list(warnings)
    try:
        programs = program_files(performance_programs(robot, planned, drive))
    except InputError as error:
        programs = {}
        said.append(f"no programs are written: {error}")
    for name, text in programs.items():
        (folder / name).parent.mkdir(exist_ok=True)
        # Bytes: lines end as the controller wants them, whatever this machine does.
        (folder / name).write_bytes(text.encode("ascii"))
    write_table(folder / "poses.csv", commanded_columns(planned))
    write_table(folder / "joints.csv", {"pose": list(planned.names), **joint_columns(robot, planned.joints)})
    sheet = sheet_columns(robot, planned)
    write_table(folder / "sheet.csv", sheet)
    cube = planned.cube
    result: dict[str, Any] = without_nan(
        {
            "format": PLAN_FORMAT,
            "version": _core.version(),
            "standard": "ISO 9283:1998",
            "robot": robot.name,
            "cube": {
                "centre_m": cube.centre.tolist(),
                "edge_m": cube.edge,
                "tool": frame_dict(planned.frame("P1")),
            },
            "poses": sum(not path for path in planned.path),
            "paths": planned.paths(),
            "cycles": {
                "pose": planned.options.cycles,
                "approach": planned.options.cycles,
                "path": planned.options.path_cycles,
                "warm-up": planned.options.warm_up_cycles,
            },
            "speeds_percent": list(planned.options.speeds),
            "rated_speed_m_s": drive.rated_speed,
            "dwell_s": drive.dwell,
            "sheet_rows": len(next(iter(sheet.values()))),
            "programs": [brand for brand in BRANDS if any(n.startswith(f"{brand}/") for n in programs)],
            "warnings": said,
        }
    )
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    page = performance_plan_report(result, planned.names, planned.path, planned.T_base_tool[:, :3, 3])
    (folder / "report.html").write_text(page, encoding="utf-8")
    return result


def commanded_columns(planned: PerformancePlan) -> dict[str, Any]:
    """Columns of poses.csv."""
    frames = [frame_dict(T) for T in planned.T_base_tool]
    point = np.array([number or np.nan for number in planned.point], dtype=np.float64)
    return {
        "pose": list(planned.names),
        **{name: np.array([frame[name] for frame in frames]) for name in frames[0]},
        "path": [path or None for path in planned.path],
        "point": point,
    }


def sheet_columns(robot: _core.Robot, planned: PerformancePlan) -> dict[str, Any]:
    """Columns of sheet.csv: what is measured in which order, and empty cells for it."""
    rows = list(sheet_rows(planned))
    texts = {name: [row[name] or None for row in rows] for name in ("test", "pose", "path")}
    numbers = {
        name: np.array([np.nan if row[name] is None else row[name] for row in rows], dtype=np.float64)
        for name in SHEET[3:]
    }
    place = {name: k for k, name in enumerate(planned.names)}
    joints = planned.joints[[place[row["pose"] or f"{row['path']}.{row['point']}"] for row in rows]]
    empty = np.full(len(rows), np.nan)
    return {
        **texts,
        **numbers,
        **joint_columns(robot, joints),
        **{name: empty for name in ("t_s", "temp_C", "x_mm", "y_mm", "z_mm")},
    }
