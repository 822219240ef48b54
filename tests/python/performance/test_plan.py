# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing performance plan`: a cube that is reached, poses where the standard has them, and a test that is
driven in simulation from sheet to report.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import truing
from truing.cli import main
from truing.examples import __file__ as examples
from truing.performance import PerformancePlan, PlanOptions, assess, plan_test
from truing.performance.plan import Cube, cube_poses, path_points

EXAMPLES = Path(examples).parent


@pytest.fixture(scope="module")
def robot() -> truing.Robot:
    return truing.load_robot(EXAMPLES / "irb120.yaml")


@pytest.fixture(scope="module")
def planned(robot: truing.Robot) -> PerformancePlan:
    return plan_test(robot)


def test_poses_are_a_tenth_of_the_diagonal_from_its_ends() -> None:
    cube = Cube(np.array([1.0, 0.0, 1.0]), 1.0, np.eye(3))
    poses = cube_poses(cube)
    diagonal = np.sqrt(3.0)
    for name in ("P2", "P3", "P4", "P5"):
        ends = [
            np.linalg.norm(poses[name] - cube.corner(*signs))
            for signs in np.ndindex(2, 2, 2)
            for signs in [tuple(2 * s - 1 for s in signs)]
        ]
        assert min(ends) == pytest.approx(0.1 * diagonal)
    assert np.linalg.norm(poses["P2"] - poses["P4"]) == pytest.approx(0.8 * diagonal)
    assert poses["P1"] == pytest.approx(0.25 * sum(poses[name] for name in ("P2", "P3", "P4", "P5")))
    edges = np.array([poses[name] - poses["P1"] for name in ("P2", "P3", "P4", "P5")])
    assert np.linalg.matrix_rank(edges, tol=1e-9) == 2  # one plane


def test_circles_lie_in_the_plane_of_the_poses() -> None:
    cube = Cube(np.array([1.0, 0.0, 1.0]), 0.5, np.eye(3))
    poses, paths = cube_poses(cube), path_points(cube, 21)
    normal = np.cross(poses["P2"] - poses["P1"], poses["P3"] - poses["P1"])
    for name, radius in (("circle", 0.2), ("small", 0.025)):
        off = paths[name] - cube.centre
        assert np.linalg.norm(off, axis=1) == pytest.approx(radius)
        assert np.abs(off @ normal).max() < 1e-12
        assert paths[name][0] == pytest.approx(paths[name][-1])


@pytest.mark.parametrize("name", ["irb120", "ur10", "palletizer", "large_boom"])
def test_the_joints_reach_what_is_commanded_within_their_limits(name: str) -> None:
    robot = truing.load_robot(EXAMPLES / f"{name}.yaml")
    planned = plan_test(robot)
    for T, q in zip(planned.T_base_tool, planned.joints, strict=True):
        found = np.linalg.inv(robot.T_measurement_base) @ truing.forward_kinematics(robot, q)[-1]
        assert found == pytest.approx(T, abs=1e-7)
    for place, index in enumerate(robot.driven_joints()):
        joint = robot.joints[index]
        assert joint.lower <= planned.joints[:, place].min() <= planned.joints[:, place].max() <= joint.upper


def test_a_cube_may_be_asked_for(robot: truing.Robot) -> None:
    planned = plan_test(robot, PlanOptions(edge=0.1, centre=(0.4, 0.05, 0.3)))
    assert planned.cube.edge == 0.1 and planned.frame("P1")[:3, 3] == pytest.approx([0.4, 0.05, 0.3])
    with pytest.raises(truing.InputError, match="no cube with an edge of 3 m"):
        plan_test(robot, PlanOptions(edge=3.0))


def test_the_files_of_a_plan_are_a_test_from_sheet_to_report(
    robot: truing.Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A simulated robot, its second joint off by 1 mrad, fills in the sheet; the report finds where it is."""
    monkeypatch.chdir(tmp_path)
    options = ["--cycles", "5", "--path-cycles", "3", "--warm-up-blocks", "2", "--speeds", "100,10"]
    assert main(["performance", "plan", str(EXAMPLES / "irb120.yaml"), "--out", "plan", *options]) == 0
    rng = np.random.default_rng(4)
    with open("plan/sheet.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    off = np.eye(6)[1] * 1e-3
    for row in rows:
        q = np.array([float(row[f"q{k}_rad"]) for k in range(1, 7)])
        at = truing.forward_kinematics(robot, q + off)[-1][:3, 3] + 1e-6 * rng.standard_normal(3)
        row.update({f"{axis}_mm": f"{1e3 * value:.6f}" for axis, value in zip("xyz", at, strict=True)})
    with open("measured.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    assert main(["performance", "report", "measured.csv", "--commanded", "plan/poses.csv"]) == 0
    result = json.loads(Path("truing-performance-report/result.json").read_text())
    found = {
        (row["quantity"], row["at"]): row["values"]["measured"]
        for row in result["quantities"]
        if row["speed_percent"] == 10
    }
    names = {name for name, _ in found}
    assert names == {"AP", "RP", "vAP", "AD", "RD", "AT", "RT"}
    assert {at for name, at in found if name == "vAP"} == {"P1", "P2", "P4"}
    assert {at for name, at in found if name == "AT"} == {"line", "circle", "small"}
    planned = plan_test(robot)
    place = planned.names.index("P1")
    moved = truing.forward_kinematics(robot, planned.joints[place] + off)[-1][:3, 3]
    expected = np.linalg.norm(moved - planned.frame("P1")[:3, 3])
    assert found["AP", "P1"]["value"] == pytest.approx(expected, abs=3e-6)
    assert found["RP", "P1"]["value"] < 1e-5
    assert any("5 cycles, where ISO 9283 (6.9) has 30" in text for text in result["warnings"])
    assert "line 2, column 'x_mm': found an empty cell" in refused("plan/sheet.csv", capsys)


def refused(file: str, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main(["performance", "report", file]) == 2
    return capsys.readouterr().err


def test_programs_of_every_brand_are_beside_the_poses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert (
        main(["performance", "plan", str(EXAMPLES / "irb120.yaml"), "--out", "plan", "--rated-speed", "2m/s"])
        == 0
    )
    for name in ("kuka/poses_50.src", "abb/poses_50.mod", "fanuc/poses_50.ls", "ur/poses_50.script"):
        assert (tmp_path / "plan" / name).stat().st_size > 200
    assert "$VEL.CP=1\r\n" in (tmp_path / "plan/kuka/paths_50.src").read_bytes().decode()
    assert "FOR N1=1 TO 30" in (tmp_path / "plan/kuka/poses_10.src").read_text()


def test_a_robot_that_slides_has_no_programs_and_is_told_so(tmp_path: Path) -> None:
    robot = (EXAMPLES / "irb120.yaml").read_text()
    assert "type: revolute" in robot
    lines = robot.splitlines()
    first = next(k for k, line in enumerate(lines) if "type: revolute" in line)
    rail = "  - {name: rail, type: prismatic, theta: 0, d: 0, a: 0, alpha: 0, limits: [-0.2, 0.2]}"
    (tmp_path / "rail.yaml").write_text("\n".join([*lines[:first], rail, *lines[first:]]) + "\n")
    assert main(["performance", "plan", str(tmp_path / "rail.yaml"), "--out", str(tmp_path / "plan")]) == 0
    result = json.loads((tmp_path / "plan" / "result.json").read_text())
    assert result["programs"] == [] and "rail is prismatic" in result["warnings"][0]


def test_assess_is_what_the_package_offers() -> None:
    assert truing.performance.assess is assess
