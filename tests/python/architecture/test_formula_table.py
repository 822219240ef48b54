# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The table of formulas in the architecture page: each function stands in the file that the table names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "method" / "architecture.md"


def rows() -> list[tuple[str, list[str], list[str]]]:
    """Formula, functions and files of every row."""
    table = PAGE.read_text(encoding="utf-8").split("## Where each formula lives")[1].split("\n## ")[0]
    found = []
    for line in table.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 3 and cells[2].startswith("`"):
            names = [name.split("::")[-1] for name in re.findall(r"`([\w:]+)`", cells[1])]
            found.append((cells[0], names, re.findall(r"`([^`]+)`", cells[2])))
    return found


def test_the_table_is_read() -> None:
    assert len(rows()) > 40


@pytest.mark.parametrize(("formula", "names", "files"), rows())
def test_a_formula_is_where_the_table_says(formula: str, names: list[str], files: list[str]) -> None:
    roots = [ROOT if file.startswith("python/") else ROOT / "cpp" / "src" for file in files]
    text = "\n".join(
        (root / file).read_text(encoding="utf-8") for root, file in zip(roots, files, strict=True)
    )
    missing = [name for name in names if not re.search(rf"\b{re.escape(name)}\b", text)]
    assert not missing, f"{formula}: {missing} not in {files}"
