# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The commands of docs/tutorials/servo.md on a real SO-101, stored as LeRobot stores it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pyarrow.csv as csv
import pytest
from numpy.typing import NDArray

from lerobot_sets import write_lerobot
from truing.cli import main

pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
SO101 = Path(os.environ.get("TRUING_REALDATA", "")) / "dyn_so101"
MOTORS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
FITTED, HELD_OUT = ("multisine", "step_response"), "slow_precision"
SECONDS = 30.0  # of each recording


def episode(name: str) -> tuple[Floats, Floats, float]:
    """State and action [deg], shape=(n, joints) each, and rows a second."""
    table = csv.read_csv(SO101 / f"{name}.csv")
    time = np.asarray(table["t_s"])
    rows = slice(0, int(np.searchsorted(time, time[0] + SECONDS)))
    state, action = (
        np.degrees(np.column_stack([table[f"{kind}{k}_rad"] for k in range(1, 6)])[rows]) for kind in "qu"
    )
    return state, action, 1.0 / float(np.median(np.diff(time)))


@pytest.mark.realdata
def test_the_tutorial_makes_a_better_file_of_a_real_arm(tmp_path: Path) -> None:
    if not os.environ.get("TRUING_REALDATA") or not SO101.exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_so101")
    episodes = [episode(name) for name in (*FITTED, HELD_OUT)]
    data = tmp_path / "recordings"
    write_lerobot(data, MOTORS, episodes[0][2], [one[:2] for one in episodes], test=1)
    file, found, model = str(SO101 / "robot.xml"), tmp_path / "diagnosed", tmp_path / "model"
    of = [str(data), "--units", "deg", "--tip-link", "gripper"]
    assert main(["dynamics", "diagnose", file, *of, "--out", str(found)]) == 0
    rollout = json.loads((found / "result.json").read_text())["rollout"]
    main_one = rollout["horizon_s"].index(rollout["main_horizon_s"])
    errors = {
        name: np.mean([of_joint[main_one] for of_joint in joints.values()])
        for name, joints in rollout["held_out"].items()
    }
    assert errors["named"] < 0.6 * errors["nominal"]
    assert main(["dynamics", "export", str(found), "--source", file, "--out", str(model)]) == 0
    compared = ["dynamics", "compare", file, str(model / "robot.xml"), *of, "--out", str(tmp_path / "nearer")]
    assert main(compared) == 0
    assert main(["dynamics", "randomise", str(found), "--out", str(tmp_path / "randomised")]) == 0
    isaac = ["dynamics", "export", str(found), "--source", file, "--to", "isaaclab"]
    assert main([*isaac, "--out", str(tmp_path / "isaac")]) == 0
    # The other way round the new file is the worse one: what a check of a change hears.
    back = ["dynamics", "compare", str(model / "robot.xml"), file, *of, "--out", str(tmp_path / "worse")]
    assert main(back) == 1
