# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Made-up candidates of the dynamic examination; the examiner's workers load them by name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any


def silent(robot: Path, recordings: Sequence[Path]) -> Any:
    """Finds nothing, whatever is handed over."""
    assert robot.is_file() and all(file.is_file() for file in recordings)
    return SimpleNamespace(verdict="none", effects=[], unknown=[])


def stubborn(robot: Path, recordings: Sequence[Path]) -> Any:
    """Always names friction under load at the first joint, for certain."""
    named = SimpleNamespace(effect="load_friction", joints=["J1"], probability=0.99, confounded_with=[])
    return SimpleNamespace(verdict="effects", effects=[named], unknown=[])


def crashing(robot: Path, recordings: Sequence[Path]) -> Any:
    raise RuntimeError("no answer")


def promising(robot: Path, recordings: Sequence[Path]) -> Any:
    """Says how much better motion will be, and what it became on recordings that it never had."""

    def improvement_on(files: Sequence[Path]) -> float:
        assert not set(files) & set(recordings) and all(file.is_file() for file in files)
        return 0.5

    promise = SimpleNamespace(value=0.6, low=0.4, high=0.8)
    return SimpleNamespace(
        verdict="none", effects=[], unknown=[], shrink=promise, improvement_on=improvement_on
    )
