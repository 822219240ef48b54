# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing performance`` writes: ``result.json``, the report, and of a plan the files to drive and fill in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.performance.api import USUAL_CYCLES, Assessment, Quantity, WarmUp
from truing.performance.page import performance_report
from truing.report.json_text import to_json, without_nan

PERFORMANCE_FORMAT = "truing-performance/1"
FLOOR_SHARE = 0.25  # an instrument's uncertainty above this share of a value is said


@dataclass(frozen=True)
class TestNotes:
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
    notes: TestNotes,
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


def _value_dict(one: Quantity, notes: TestNotes) -> dict[str, Any]:
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
    notes: TestNotes,
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
