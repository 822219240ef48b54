# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking on recorded streams: clocks and frames found without being told, predictions no worse than the
best of the simpler ways.

The recordings are not part of the repository (docs/benchmarks/real-robots.md says where they are from). Set
TRUING_REALDATA to their folder.
"""

from __future__ import annotations

import functools
import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing

_BENCH = Path(__file__).resolve().parents[3] / "bench"


def _module(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, _BENCH / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


DATA: Path = _module("real_data").default_folder()
track_real = _module("track_real")

pytestmark = [
    pytest.mark.realdata,
    pytest.mark.skipif(
        not (DATA / "aubo_i5_run0_60hz").is_dir(),
        reason="no recordings here: set TRUING_REALDATA to their folder",
    ),
    pytest.mark.filterwarnings("ignore::truing.InputWarning"),
]


@functools.lru_cache(maxsize=1)
def run0() -> tuple[truing.tracking.TrackCalibration, list[dict[str, Any]]]:
    found, errors = track_real.with_tracker(DATA / "aubo_i5_run0_60hz")
    return found, errors


def test_three_clocks_are_found() -> None:
    found = run0()[0]
    assert found.status == "done" and found.joints_clock is not None and found.inertial is not None
    assert found.joints_clock.offset == pytest.approx(-6.9, abs=0.1)
    assert found.where.setup.controller_clock_offset == pytest.approx(
        -0.13, abs=0.05
    ) or found.where.setup.controller_clock_offset == pytest.approx(0.13, abs=0.05)
    assert found.inertial.clock_offset_sigma < 5e-3
    assert abs(found.where.clock_drift) == pytest.approx(1e-3, rel=0.1)


def test_frames_and_gravity_are_found() -> None:
    found = run0()[0]
    assert 1e-4 < found.frames.position_sigma < 1e-3  # of what the link table and the clocks leave
    gravity = np.asarray(found.where.setup.gravity)
    assert np.linalg.norm(gravity) == pytest.approx(9.81, rel=0.03) and gravity[2] < -9.4


@pytest.mark.parametrize("horizon", [0.02, 0.04, 0.08])
def test_predictions_are_no_worse_than_the_best_of_the_simpler_ways(horizon: float) -> None:
    at = next(row for row in run0()[1] if row["horizon_s"] == horizon)
    assert at["truing"]["n"] > 1500
    assert at["truing"]["rms_m"] <= 1.02 * min(
        at[name]["rms_m"] for name in ("hold", "velocity", "fk", "fk_velocity")
    )


def test_the_inertial_part_without_a_tracker() -> None:
    if not (DATA / "aubo_i5_run1").is_dir():
        pytest.skip("aubo_i5_run1 is not among the recordings")
    found, offset, misfit, rates = track_real.without_tracker(DATA / "aubo_i5_run1")
    assert (
        found.status == "done"
        and found.clock_offset == pytest.approx(-0.08, abs=0.02)
        and offset == pytest.approx(-0.08, abs=0.006)
    )
    assert misfit <= 0.0140 < 0.1 * rates  # the baseline
