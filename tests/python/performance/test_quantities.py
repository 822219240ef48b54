# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A sheet computed by hand: every characteristic of ISO 9283 from a handful of numbers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from truing.files import load_commanded, load_measured
from truing.performance import Assessment, assess
from truing.performance.quantities import crossings

COMMANDED = """pose,x_mm,y_mm,z_mm,path,point
P2,0,0,0,,
P4,300,400,0,,
E.1,0,0,0,E,1
E.2,10,0,0,E,2
"""

# P2: lengths from the barycentre (1, 0, 0) are 1 1 1 3, their mean 1.5, their standard deviation 1.
# P4: barycentre (300, 400, 2), lengths 0. Distances to P2: from (0,0,0) and (4,0,0).
# Path: E.1 has deviations ±1 along y about (0, 2, 0); E.2 has 0 0 0 4 along z about (10, 0, 1).
# Approaches: barycentres (0,0,0), (3,4,0), (3,0,0): 5 apart at most.
# Warm-up: barycentres 1, 1.5, 3 from P2 along z; RP 1, 1, 4.5.
MEASURED = """test,pose,path,cycle,approach,point,block,t_s,x_mm,y_mm,z_mm
pose,P2,,1,,,,,0,0,0
pose,P4,,1,,,,,300,400,2
pose,P2,,2,,,,,0,0,0
pose,P4,,2,,,,,300,400,2
pose,P2,,3,,,,,0,0,0
pose,P4,,3,,,,,300,400,2
pose,P2,,4,,,,,4,0,0
pose,P4,,4,,,,,300,400,2
"""


def sheet() -> str:
    rows = [MEASURED]
    ring = ((1, 0), (-1, 0), (0, 1), (0, -1))  # lengths of 1: RP is 1
    for cycle, (dx, dy) in enumerate(ring, 1):
        rows.append(f"path,,E,{cycle},,1,,,0,{2 + (1 if cycle % 2 else -1)},0\n")
        rows.append(f"path,,E,{cycle},,2,,,10,0,{4 if cycle == 4 else 0}\n")
        for approach, (x, y) in enumerate(((0, 0), (3, 4), (3, 0)), 1):
            rows.append(f"approach,P2,,{cycle},{approach},,,,{x + dx},{y + dy},0\n")
        for block, z in ((1, 1.0), (2, 1.5)):
            rows.append(f"warm-up,P2,,{cycle},,,{block},{3600 * block},{dx},{dy},{z}\n")
        rows.append(f"warm-up,P2,,{cycle},,,3,10800,{3 if cycle == 4 else -1},0,3\n")
    return "".join(rows)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Assessment:
    folder: Path = tmp_path_factory.mktemp("sheet")
    (folder / "measured.csv").write_text(sheet())
    (folder / "poses.csv").write_text(COMMANDED)
    return assess(load_measured(folder / "measured.csv"), load_commanded(folder / "poses.csv"))


DISTANCES = [math.sqrt(300**2 + 400**2 + 4)] * 3 + [math.sqrt(296**2 + 400**2 + 4)]
SQUARES = sum((d - sum(DISTANCES) / 4) ** 2 for d in DISTANCES)

BY_HAND = {
    ("AP", "P2"): 1.0,
    ("RP", "P2"): 1.5 + 3 * 1.0,
    ("AP", "P4"): 2.0,
    ("RP", "P4"): 0.0,
    ("vAP", "P2"): 5.0,
    ("AD", "P2-P4"): sum(DISTANCES) / 4 - 500.0,
    ("RD", "P2-P4"): 3 * math.sqrt(SQUARES / 3),
    ("AT", "E"): 2.0,
    ("RT", "E"): 1.5 + 3 * 1.0,
    ("dAP", "P2"): 2.0,
    ("dRP", "P2"): 4.5 - 1.0,
    ("travel", "P2"): 2.0,
}


@pytest.mark.parametrize(("name", "at"), sorted(BY_HAND))
def test_the_sheet_computed_by_hand(found: Assessment, name: str, at: str) -> None:
    values = {(one.name, one.at): one.value for one in found.quantities}
    assert values[name, at] == pytest.approx(1e-3 * BY_HAND[name, at], abs=1e-12)


def test_the_sheet_has_nothing_else(found: Assessment) -> None:
    assert {(one.name, one.at) for one in found.quantities} == set(BY_HAND)
    assert not found.not_found


def test_intervals_hold_the_value_of_what_is_not_at_zero(found: Assessment) -> None:
    for one in found.quantities:
        low, high = one.interval
        assert low <= high
        if one.name in ("AP", "RP", "AD", "RD", "vAP", "AT"):
            assert low <= one.value <= high, one


def test_other_numbers_of_cycles_are_said(found: Assessment) -> None:
    assert "P2: 4 cycles, where ISO 9283 (6.9) has 30" in found.warnings
    assert "E: 4 cycles, where ISO 9283 (6.9) has 10" in found.warnings


def test_a_recorded_path_is_cut_by_normal_planes() -> None:
    commanded = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    # Above the path by 0.1 in its first half, then falling to 0 at x = 3.
    recorded = np.array([[-1.0, 0, 0.1], [0.9, 0, 0.1], [1.5, 0, 0.1], [3.0, 0, 0.0]])
    found = crossings(recorded, commanded)
    assert found == pytest.approx(np.array([[0, 0, 0.1], [1, 0, 0.1], [2, 0, 0.1 - 0.1 / 3]]))


def test_a_recording_that_ends_early_has_no_crossing() -> None:
    commanded = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    assert np.isnan(crossings(np.array([[-1.0, 0, 0], [1.5, 0, 0]]), commanded)[2]).all()
