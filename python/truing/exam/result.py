# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing exam`` writes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import truing
from truing.exam.page import exam_report
from truing.report.json_text import to_json, without_nan

EXAM_FORMAT = "truing-exam/1"


def write_exam(folder: Path, result: Mapping[str, Any]) -> dict[str, Any]:
    """Writes what the examination found into `folder`, and returns what result.json holds."""
    found: dict[str, Any] = without_nan({"version": truing.__version__, **result})
    found.setdefault("format", EXAM_FORMAT)
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(exam_report(found), encoding="utf-8")
    return found
