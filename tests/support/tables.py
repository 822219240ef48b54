# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""CSV files in tests: what is in one, and how one is made."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path


def columns(path: str | Path) -> dict[str, list[str]]:
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [row[k] for row in rows[1:]] for k, name in enumerate(rows[0])}


def write(path: Path, columns: Mapping[str, Sequence[object]]) -> Path:
    rows = [
        ",".join(columns),
        *(",".join(str(value) for value in row) for row in zip(*columns.values(), strict=True)),
    ]
    path.write_text("\n".join(rows) + "\n")
    return path
