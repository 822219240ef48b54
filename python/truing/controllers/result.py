# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing export`` writes: the files of the format, ``result.json``."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from truing import _core
from truing.controllers.api import Exported
from truing.controllers.distances import Distance
from truing.report.json_text import to_json

FORMAT = "truing-export/1"


def export_dict(exported: Exported, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` holds. remaining: between the calibrated robot and the one that the files
    describe.
    """
    written = exported.written
    return {
        "format": FORMAT,
        "version": _core.version(),
        "name": exported.name,
        "to": exported.to,
        "files": list(written.files),
        **written.values,
        **written.extra,
        "dropped": [
            {
                "name": item.name,
                "size_m": None if math.isnan(item.size) else item.size,
                "reason": item.reason,
            }
            for item in written.dropped
        ],
        "before": _distance(written.before),
        "remaining": _distance(written.remaining),
        "notes": list(written.notes),
        "warnings": list(warnings),
    }


def _distance(distance: Distance | None) -> dict[str, float] | None:
    return None if distance is None else {"rms_m": distance.rms, "max_m": distance.largest}


def write_export(folder: Path, exported: Exported, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """Writes the files and ``result.json`` into `folder`; returns what the latter holds."""
    for name, text in exported.written.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    result = export_dict(exported, warnings=warnings)
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    return result
