# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A fault that one arm has is named with the arm, an effect that all have is named of all, and nothing else
is.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truing
from truing.cli import main
from truing.examples import example
from truing.fleet import FleetDiagnosis
from truing.testing.fleet import FleetSimulation, save_fleet, simulate_fleet


@pytest.fixture(scope="module")
def robot() -> truing.Robot:
    return truing.load_robot(example("ur10"))


def diagnosed(robot: truing.Robot, fleet: FleetSimulation, folder: Path) -> FleetDiagnosis:
    save_fleet(folder, fleet, robot)
    return truing.fleet.diagnose(robot, folder, workers=0)


def test_the_arms_with_a_fault_are_named_and_no_other(robot: truing.Robot, tmp_path: Path) -> None:
    fleet = simulate_fleet(robot, arms=12, poses=100, faults=2, seed=31)
    found = diagnosed(robot, fleet, tmp_path)
    assert set(found.of_arms) == set(fleet.faults)
    for name, (effect, joint) in fleet.faults.items():
        named = found.of_arms[name][0]
        assert (named.effect, named.joints) == (effect, (joint,))
    assert {effect.effect for effect in found.of_all} == {"link_geometry"}
    assert all(name in found.sentence for name in fleet.faults)


def test_a_fleet_without_faults_has_none(robot: truing.Robot, tmp_path: Path) -> None:
    fleet = simulate_fleet(robot, arms=10, poses=80, faults=0, seed=32)
    found = diagnosed(robot, fleet, tmp_path)
    assert not found.of_arms and not found.unexplained
    assert "No arm differs from the others" in found.sentence


@pytest.mark.slow
def test_five_of_two_hundred_arms_are_named_and_no_sixth(robot: truing.Robot, tmp_path: Path) -> None:
    fleet = simulate_fleet(robot, arms=200, poses=100, faults=5, seed=57)
    found = diagnosed(robot, fleet, tmp_path)
    assert set(found.of_arms) == set(fleet.faults)


def test_the_command_says_all_arms_or_this_arm(
    robot: truing.Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fleet = simulate_fleet(robot, arms=6, poses=80, faults=1, seed=34)
    save_fleet(tmp_path / "arms", fleet, robot)
    out = tmp_path / "out"
    code = main(
        [
            "fleet",
            "diagnose",
            str(example("ur10")),
            str(tmp_path / "arms"),
            "--workers",
            "0",
            "--out",
            str(out),
        ]
    )
    assert code == 0
    assert "All 6 arms of this type" in capsys.readouterr().out
    result = json.loads((out / "result.json").read_text())
    assert result["format"] == "truing-fleet-diagnosis/1"
    assert list(result["of_arms"]) == list(fleet.faults)
    assert next(iter(fleet.faults)) in (out / "report.html").read_text()
