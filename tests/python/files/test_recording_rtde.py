# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of Universal Robots' RTDE, as its CSVWriter and ur_rtde write them: the header names an output,
or a vector's output and the joint from 0."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from truing import _core
from truing.dynamics import load_recordings
from truing.errors import InputError

ROBOT = _core.Robot("ur", joints=[_core.Joint(f"J{k}", a=0.3) for k in range(1, 7)])
ROWS = 40
VECTORS = ("actual_q", "actual_qd", "actual_current", "target_q", "joint_temperatures", "actual_TCP_pose")
HEADER = [
    "timestamp",
    *(f"{name}_{k}" for name in VECTORS for k in range(6)),
    "payload",
    *(f"payload_cog_{k}" for k in range(3)),
    "actual_robot_voltage",
    "actual_digital_input_bits",
]


def rows() -> np.ndarray:
    random = np.random.default_rng(5)
    time = 4711.0 + 0.002 * np.arange(ROWS)
    vectors = random.normal(size=(ROWS, 6 * len(VECTORS)))
    rest = np.tile([1.5, 0.01, 0.02, 0.03, 48.0, 255.0], (ROWS, 1))
    return np.column_stack([time, vectors, rest])


def written(path: Path, between: str, table: np.ndarray) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=between)
        writer.writerow(HEADER)
        writer.writerows(table.tolist())
    return path


@pytest.mark.parametrize("between", [" ", ","])
def test_outputs_are_read_by_their_names(tmp_path: Path, between: str) -> None:
    table = rows()
    (found,) = load_recordings(written(tmp_path / "run.csv", between, table), ROBOT)
    assert found.name == "run"
    assert np.allclose(np.diff(found.time), 0.002)
    parts = {name: table[:, 1 + 6 * k : 7 + 6 * k] for k, name in enumerate(VECTORS)}
    assert np.array_equal(found.position, parts["actual_q"])
    assert np.array_equal(found.speed, parts["actual_qd"])
    assert np.array_equal(found.current, parts["actual_current"])
    assert np.array_equal(found.command, parts["target_q"])
    assert np.array_equal(found.columns["temp3_C"], parts["joint_temperatures"][:, 2])
    assert np.all(found.columns["payload_kg"] == 1.5) and np.all(found.columns["payload_y_m"] == 0.02)
    assert np.all(found.columns["volt_V"] == 48.0)
    assert "actual_TCP_pose_0" in found.columns


def test_a_fault_is_said_with_its_place(tmp_path: Path) -> None:
    path = written(tmp_path / "run.csv", " ", rows())
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("actual_q_3 ", "actual_q_9 "), encoding="utf-8")
    with pytest.raises(InputError, match=r"run\.csv.*the robot has 6 joints"):
        load_recordings(path, ROBOT)
    lines = text.splitlines()
    lines[7] = lines[7].rsplit(" ", 1)[0]
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=r"run\.csv: is not a table of RTDE outputs: .*Expected 43 columns"):
        load_recordings(path, ROBOT)
    lines = text.splitlines()
    lines[7] = " ".join(["4711.1", "fast", *lines[7].split(" ")[2:]])
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=r"run\.csv: .*Row #8: .*'fast'"):
        load_recordings(path, ROBOT)
