# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing fleet dynamics`: its files, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import truing
from truing.cli import main
from truing.testing.fleet import TorqueFleet, save_torque_fleet, simulate_torque_fleet


@pytest.fixture(scope="module")
def fleet() -> TorqueFleet:
    return simulate_torque_fleet(seed=8111)


@pytest.fixture(scope="module")
def folder(fleet: TorqueFleet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("fleet")
    save_torque_fleet(place, fleet)
    return place


@pytest.fixture(scope="module")
def robot_file(fleet: TorqueFleet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.yaml"
    truing.save_robot(path, fleet.nominal)
    return path


def test_the_command_writes_what_it_found(
    fleet: TorqueFleet, folder: Path, robot_file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    code = main(["fleet", "dynamics", str(robot_file), str(folder), "--workers", "0", "--out", str(out)])
    assert code == 0
    result = json.loads((out / "result.json").read_text())
    assert result["format"] == "truing-fleet-dynamics/1"
    assert {one["arm"]: one["parameter"] for one in result["stands_out"]} == fleet.faults
    assert result["solver"]["passes"] == 2
    assert len((out / "arms.csv").read_text().splitlines()) == 13
    page = (out / "report.html").read_text()
    assert all(name in page for name in fleet.faults)
    arm = truing.load_robot(out / "robot_a012.yaml")
    assert any(effect.effect == "motor_constant" for effect in arm.torque_effects)


@pytest.mark.parametrize(
    "broken, said",
    [
        ("nothing", "there is no such file or folder"),
        ("positions only", "no torques (tau1_Nm"),
        ("no joint", "there is no column q6_rad"),
        ("short", "no stretch without gaps is longer"),
        ("all test", "a001: has no rows to fit"),
        ("no masses", "no link of the robot has a mass"),
        ("share", "--test-share"),
    ],
)
def test_wrong_input_is_one_line_and_exit_2(
    broken: str,
    said: str,
    folder: Path,
    robot_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    source = tmp_path / "arm=a001" / "run.parquet"
    source.parent.mkdir()
    table = pq.read_table(folder / "arm=a001" / "run1.parquet")
    more, robot = [], robot_file
    if broken == "positions only":
        table = table.drop_columns([f"tau{k}_Nm" for k in range(1, 7)])
    elif broken == "no joint":
        table = table.drop_columns(["q6_rad"])
    elif broken == "short":
        table = table.slice(0, 30)
    elif broken == "all test":
        table = table.set_column(table.column_names.index("set"), "set", pa.array(["test"] * table.num_rows))
        other = tmp_path / "arm=a002" / "run.parquet"
        other.parent.mkdir()
        other.write_bytes((folder / "arm=a002" / "run1.parquet").read_bytes())
    elif broken == "no masses":
        robot = tmp_path / "bare.yaml"
        bare = truing.load_robot(robot_file)
        for joint in bare.joints:
            joint.mass = None
        truing.save_robot(robot, bare)
    elif broken == "share":
        more = ["--test-share", "0"]
    pq.write_table(table, source)
    given = tmp_path / "none" if broken == "nothing" else tmp_path
    out = tmp_path / "out"
    code = main(["fleet", "dynamics", str(robot), str(given), "--workers", "0", "--out", str(out), *more])
    error = capsys.readouterr().err
    assert code == 2, error
    assert error.count("\n") == 1 and error.startswith("truing: ") and said in error, error
    assert not out.exists()
