# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Residuals of a diagnosis are read as the recordings that they were made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from truing.errors import InputError
from truing.files import load_residual_motion, write_table
from truing.model import Joint, Robot

ROBOT = Robot("rail", joints=[Joint("R", type="prismatic"), Joint("J", a=0.3)])


def columns() -> dict[str, object]:
    n = 6
    return {
        "recording": ["one"] * 4 + ["two"] * 2,
        "set": ["train"] * 4 + ["test"] * 2,
        "t_s": np.array([0.0, 0.1, 0.2, 0.3, 0.0, 0.1]),
        "q1_m": np.arange(n) * 0.01,
        "q2_rad": np.arange(n) * 0.02,
        "tau1_N": np.ones(n),
        "tau2_Nm": np.full(n, 2.0),
        "predicted_tau1_N": np.zeros(n),
        "temp2_C": np.array([20.0] * 4 + [np.nan] * 2),
        "payload_kg": np.array([0.0] * 4 + [1.5] * 2),
        "payload_z_m": np.full(n, 0.1),
    }


def test_motion_payload_and_temperatures_come_back(tmp_path: Path) -> None:
    write_table(tmp_path / "r.parquet", columns())
    (one, held), (two, held_two) = load_residual_motion(tmp_path / "r.parquet", ROBOT)
    assert (one.name, two.name, one.test, two.test) == ("one", "two", False, True)
    assert not held.any() and held_two.all()
    assert np.asarray(two.torque).tolist() == [[1.0, 2.0]] * 2
    assert set(one.columns) == {"temp2_C", "payload_kg", "payload_z_m"}
    assert set(two.columns) == {"payload_kg", "payload_z_m"}  # no temperature was recorded
    assert two.columns["payload_kg"].tolist() == [1.5, 1.5]


def test_a_table_of_another_robot_is_refused(tmp_path: Path) -> None:
    table = columns()
    del table["q2_rad"]
    write_table(tmp_path / "r.parquet", table)
    with pytest.raises(InputError, match="has no column q2_rad, expected the residuals.parquet"):
        load_residual_motion(tmp_path / "r.parquet", ROBOT)
