# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing dynamics diagnose`` writes when there were commands alone: result.json, report.html, arm.xml
(bodies and joints without drives) and motion.parquet (the recordings, and what of them was held out)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.rollout import BLOCKS_OF_TIME, held_out_rows
from truing.dynamics.sanity.findings import RecordingFinding
from truing.dynamics.servo.export import MODEL, MOTION
from truing.dynamics.servo.page import servo_report
from truing.dynamics.servo.result import ServoDiagnosis, servo_dict
from truing.files import commanded_columns, write_table
from truing.report.json_text import to_json


def write_servo(
    folder: Path,
    found: ServoDiagnosis,
    recordings: Sequence[_core.Recording],
    *,
    sanity: Iterable[RecordingFinding] = (),
    warnings: Iterable[str] = (),
    test_share: float = 0.3,
) -> dict[str, Any]:
    """Writes everything, and returns what result.json holds. sanity: findings of `check_recordings`, whose
    recordings these are. test_share: as it was diagnosed with."""
    result = servo_dict(found, sanity=sanity, warnings=warnings)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    (folder / MODEL).write_text(found.mjcf, encoding="utf-8")
    prismatic = found.chains["named"].prismatic
    columns = commanded_columns(recordings, prismatic, held_rows(found, recordings, test_share))
    write_table(folder / MOTION, columns)
    report = servo_report(result, [vars(trace) for trace in found.traces])
    (folder / "report.html").write_text(report, encoding="utf-8")
    return result


def held_rows(
    found: ServoDiagnosis, recordings: Sequence[_core.Recording], test_share: float
) -> list[NDArray[np.bool_]]:
    """Which rows of each recording were held out: whole recordings by name, else blocks of their time."""
    named = {recording.name for recording in recordings} & set(found.held_out)
    return held_out_rows(recordings, list(named) if named else [BLOCKS_OF_TIME], test_share)
