# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""bench/real_diagnosis.py --splits: poses stay together, and two builds are compared split by split."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

_PATH = Path(__file__).resolve().parents[3] / "bench/real_diagnosis.py"
_SPEC = importlib.util.spec_from_file_location("real_diagnosis", _PATH)
assert _SPEC is not None and _SPEC.loader is not None
real_diagnosis: Any = importlib.util.module_from_spec(_SPEC)
sys.modules["real_diagnosis"] = real_diagnosis
_SPEC.loader.exec_module(real_diagnosis)


def split(named: float | None, unknown: float | None = 0.5) -> dict[str, Any]:
    told: dict[str, Any] = {"gap": 2.0, "geometry": 1.0, "named": named, "unknown": unknown}
    return told if named is not None else {**told, "error": "ValueError: no idea"}


def test_rows_of_a_pose_stay_on_one_side_of_a_split() -> None:
    group = np.repeat(np.arange(40), 3)
    made = [real_diagnosis.parted(group, 36, number, 5) for number in range(4)]
    for of in made:
        sides = of.reshape(40, 3)
        assert (sides == sides[:, :1]).all() and of.sum() == 36
    assert len({of.tobytes() for of in made}) == 4
    assert np.array_equal(made[0], real_diagnosis.parted(group, 36, 0, 5))
    assert not np.array_equal(made[0], real_diagnosis.parted(group, 36, 0, 6))


def test_mean_and_worst_stand_in_the_table_and_a_failure_is_infinitely_bad() -> None:
    lines = real_diagnosis.split_table(
        {"arm": [split(0.4), split(0.8)], "leg": [split(0.4), split(None, None)]}, None
    )
    assert "| arm | 2 | 0 | 2.000 / 2.000 | 1.000 / 1.000 | 0.600 / 0.800 | 0.500 / 0.500 |" in lines
    assert lines[3].startswith("| leg | 2 | 1 |") and "∞ / ∞" in lines[3]


def test_two_builds_are_compared_split_by_split() -> None:
    before, after = [split(0.4), split(0.8), split(0.8)], [split(0.41), split(0.7), split(0.9)]
    assert real_diagnosis.beside(before, after, "named") == "0.667 / 0.800 | 0.670 / 0.900 | 1 : 1"
    (line,) = real_diagnosis.split_table({"arm": after}, {"arm": before})[2:]
    assert line.count("|") == real_diagnosis.split_table({"arm": after}, {"arm": before})[0].count("|")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seed": 1}, "expected seed 0"),
        ({"splits": 3}, "expected splits 2"),
        ({"recordings": {}}, "has no arm"),
    ],
)
def test_figures_of_other_splits_are_refused(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    file = tmp_path / "before.json"
    told = {"format": real_diagnosis.FORMAT, "seed": 0, "splits": 2, "recordings": {"arm": [split(0.4)] * 2}}
    file.write_text(json.dumps(told))
    assert real_diagnosis.stored([file], 0, 2, ["arm"])["arm"][0]["named"] == 0.4
    file.write_text(json.dumps({**told, **change}))
    with pytest.raises(SystemExit, match=said):
        real_diagnosis.stored([file], 0, 2, ["arm"])


def test_figures_stored_one_recording_a_file_are_taken_together(tmp_path: Path) -> None:
    for name in ("arm", "leg"):
        told = {"format": real_diagnosis.FORMAT, "seed": 0, "splits": 1, "recordings": {name: [split(0.4)]}}
        (tmp_path / name).write_text(json.dumps(told))
    found = real_diagnosis.stored([tmp_path / "leg", tmp_path / "arm"], 0, 1, ["arm", "leg"])
    assert list(found) == ["arm", "leg"]


def test_a_table_replaces_what_stands_between_its_marks_alone(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- splits -->\nold\n<!-- end of splits -->\nb\n")
    real_diagnosis.write(page, "<!-- splits -->", "<!-- end of splits -->", "| new |")
    assert page.read_text() == "a\n<!-- splits -->\n| new |\n<!-- end of splits -->\nb\n"
