# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing performance report`: files in, one page out, bad files refused by one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import truing
from truing.cli import main
from truing.examples import __file__ as examples
from truing.files import load_commanded, load_measured
from truing.performance import WarmUp, assess
from truing.testing.simulation import true_robot

POSES = {"P1": (1.0, 0.0, 1.0), "P2": (1.2, 0.2, 1.2), "P3": (1.2, -0.2, 1.2), "P4": (0.8, -0.2, 0.8)}
COMMANDED = "pose,x_m,y_m,z_m,qw,qx,qy,qz\n" + "".join(
    f"{name},{x},{y},{z},1,0,0,0\n" for name, (x, y, z) in POSES.items()
)


def measured(seed: int, off: float = 2e-4, cycles: int = 30, turned: np.ndarray | None = None) -> str:
    """A test of all poses with 0.01 mm of noise, off by `off`, at two speeds."""
    rng = np.random.default_rng(seed)
    lines = ["pose,cycle,load_percent,speed_percent,x_mm,y_mm,z_mm,qw,qx,qy,qz"]
    for speed in (100, 10):
        for cycle in range(1, cycles + 1):
            for name, position in POSES.items():
                at = np.array(position) + [off, 0, 0] + 1e-5 * rng.standard_normal(3)
                at = at if turned is None else turned[:3, :3] @ at + turned[:3, 3]
                x, y, z = 1e3 * at
                a, b, c = 0.5e-4 * rng.standard_normal(3) + [5e-5, 0, 0]
                lines.append(f"{name},{cycle},100,{speed},{x:.6f},{y:.6f},{z:.6f},1,{a:.9f},{b:.9f},{c:.9f}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "poses.csv").write_text(COMMANDED)
    (tmp_path / "nominal.csv").write_text(measured(1, 8e-4))
    (tmp_path / "compensated.csv").write_text(measured(2, 5e-5))
    return tmp_path


def test_columns_stand_side_by_side(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(
        [
            *("performance", "report", "nominal.csv", "compensated.csv", "--commanded", "poses.csv"),
            *("--instrument", "<b>tracker</b>", "--instrument-uncertainty", "0.02mm", "--rated-load", "5kg"),
        ]
    )
    assert code == 0
    out = folder / "truing-performance-report"
    result = json.loads((out / "result.json").read_text())
    assert [column["label"] for column in result["columns"]] == ["nominal", "compensated"]
    row = next(r for r in result["quantities"] if (r["quantity"], r["at"]) == ("AP", "P1"))
    assert (row["load_percent"], row["speed_percent"], row["clause"]) == (100, 100, "7.2")
    assert row["values"]["nominal"]["value"] == pytest.approx(8e-4, abs=1e-5)
    assert row["values"]["nominal"]["at_floor"] is False
    assert row["values"]["compensated"]["at_floor"] is True  # 0.05 mm by 0.02 mm
    page = (out / "report.html").read_text()
    assert "<b>tracker</b>" not in page and "&lt;b&gt;tracker" in page
    assert "at the instrument's floor" in page and "10 % of the rated speed" in page
    assert "AP" in capsys.readouterr().out


def test_angles_are_about_x_y_z(folder: Path) -> None:
    found = assess(load_measured("nominal.csv"), load_commanded("poses.csv"))
    angles = {one.name: one for one in found.quantities if one.at == "P1" and one.speed == 100}
    assert angles["AP_a"].value == pytest.approx(1e-4, abs=6e-5)  # twice the quaternion's 5e-5
    assert angles["RP_a"].value == pytest.approx(3e-4, rel=0.4)
    assert angles["AP_a"].unit == "rad"


def test_the_seed_gives_the_same_numbers(folder: Path) -> None:
    def intervals(seed: int) -> list[tuple[float, float]]:
        return [one.interval for one in assess(load_measured("nominal.csv"), seed=seed).quantities]

    assert intervals(3) == intervals(3) != intervals(4)


def test_without_commands_repeatabilities_are_found(folder: Path) -> None:
    found = assess(load_measured("nominal.csv"))
    assert {one.name for one in found.quantities} == {"RP", "RP_a", "RP_b", "RP_c", "RD"}
    assert {one.name for one in found.not_found} == {"AP", "AP of angles", "AD"}


def test_another_frame_is_refused_and_can_be_fitted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    turned = truing.frame_from_xyz_rpy([0.3, -2, 0.5], [0.01, 0.02, 2])
    (folder / "tracker.csv").write_text(measured(3, turned=turned))
    assert main(["performance", "report", "tracker.csv", "--commanded", "poses.csv"]) == 2
    assert "P1 is" in (error := capsys.readouterr().err) and "--align" in error
    assert not (folder / "truing-performance-report").exists()
    assert main(["performance", "report", "tracker.csv", "--commanded", "poses.csv", "--align"]) == 0
    result = json.loads((folder / "truing-performance-report" / "result.json").read_text())
    found = np.array(result["columns"][0]["aligned"]["T_commanded_measured"])
    assert found @ turned == pytest.approx(np.eye(4), abs=3e-4)
    rows = [row for row in result["quantities"] if row["quantity"] == "AP"]
    assert max(row["values"]["tracker"]["value"] for row in rows) < 3e-5


WARM_POSE = np.array([0.3, 0.2, -0.3, 0.4, 0.9, 0.1])  # [rad]


def warmed_up(folder: Path, positions: np.ndarray, temperature: np.ndarray) -> WarmUp:
    """What is found of 16 blocks of ten cycles, 30 minutes apart."""
    block = np.repeat(np.arange(16), 10)
    lines = ["test,pose,cycle,block,t_s,temp_C,x_m,y_m,z_m," + ",".join(f"q{k}_rad" for k in range(1, 7))]
    for k in range(160):
        numbers = (k % 10 + 1, block[k] + 1, 1800 * block[k] + k, temperature[k], *positions[k], *WARM_POSE)
        lines.append("warm-up,P1," + ",".join(f"{value:.9g}" for value in numbers))
    (folder / "warm.csv").write_text("\n".join(lines) + "\n")
    robot = truing.load_robot(Path(examples).with_name("irb120.yaml"))
    (course,) = assess(load_measured(folder / "warm.csv"), robot=robot).warm_ups
    return course


def test_thermal_effects_take_the_drift_of_a_robot_that_has_them(tmp_path: Path) -> None:
    robot = truing.load_robot(Path(examples).with_name("irb120.yaml"))
    driver = next(e for e in truing.model.catalogue_effects() if e.name == "thermal_zero")
    assert driver.traits.driver == "temperature"
    true = true_robot(
        robot, lengths=0, angles=0, effects={"thermal_zero.J2": 1.5e-5, "thermal_zero.J3": 1e-5}
    )
    temperature = 20 + 15 * (1 - np.exp(-np.repeat(np.arange(16), 10) / 4.0))
    joints = np.tile(WARM_POSE, (160, 1))
    data = truing.Measurements(joints, positions=np.zeros((160, 3)), temperature=temperature)
    noise = 5e-6 * np.random.default_rng(2).standard_normal((160, 3))
    course = warmed_up(tmp_path, truing.predict(true.robot, data).position + noise, temperature)
    assert course.travel.max() > 5e-5
    assert course.compensated is not None and course.compensated.max() < 1e-5
    assert course.effects


def test_what_no_thermal_effect_explains_is_left_whole(tmp_path: Path) -> None:
    """The robot sinks evenly while the temperature goes up and down: nothing of it is compensated."""
    robot = truing.load_robot(Path(examples).with_name("irb120.yaml"))
    block = np.repeat(np.arange(16), 10)
    positions = np.tile(truing.forward_kinematics(robot, WARM_POSE)[-1][:3, 3], (160, 1))
    positions[:, 2] -= 1e-5 * block
    positions += 5e-6 * np.random.default_rng(2).standard_normal((160, 3))
    course = warmed_up(tmp_path, positions, 20 + 5 * np.sin(np.pi * block / 15.0))
    assert course.compensated is not None
    assert course.compensated.max() > 0.9 * course.travel.max() > 1.2e-4


BAD = {
    "no column pose": ("cycle,x_m,y_m,z_m\n1,1,0,1\n", "there is no column pose"),
    "no unit": ("pose,cycle,x,y,z\nP1,1,1,0,1\n", "expected x_m y_m z_m or x_mm y_mm z_mm"),
    "unknown column": ("pose,cycle,x_m,y_m,z_m,colour\nP1,1,1,0,1,3\n", "column 'colour': unknown column"),
    "cycle twice": (
        "pose,cycle,x_m,y_m,z_m\nP1,1,1,0,1\nP1,1,1,0,1\nP1,2,1,0,1\n",
        "cycle 1 of P1 is there twice",
    ),
    "not a test": (
        "test,pose,cycle,x_m,y_m,z_m\nposes,P1,1,1,0,1\n",
        "found 'poses', expected pose, approach",
    ),
    "half a cycle": ("pose,cycle,x_m,y_m,z_m\nP1,1.5,1,0,1\n", "line 2, column 'cycle'"),
    "millimetres": ("pose,cycle,x_m,y_m,z_m\nP1,1,1000,0,1000\n", "looks like millimetres"),
    "quaternion": (
        "pose,cycle,x_m,y_m,z_m,qw,qx,qy,qz\nP1,1,1,0,1,2,0,0,0\n",
        "line 2: found the quaternion",
    ),
    "no name": ("pose,cycle,x_m,y_m,z_m\n,1,1,0,1\n", "line 2: found no pose"),
    "two cycles": ("pose,cycle,x_m,y_m,z_m\nP1,1,1,0,1\nP1,2,1,0,1\n", "2 cycles, expected 3 or more"),
    "not commanded": (
        "pose,cycle,x_m,y_m,z_m\nP9,1,1,0,1\nP9,2,1,0,1\nP9,3,1,0,1\n",
        "the pose 'P9' is not among the commanded ones",
    ),
    "recording without a path": (
        "test,path,cycle,x_m,y_m,z_m\npath,E,1,1,0,1\npath,E,1,1,0,1\n",
        "the path E is a recording (no column point)",
    ),
    "no block": ("test,pose,cycle,x_m,y_m,z_m\nwarm-up,P1,1,1,0,1\n", "line 2: found no block"),
}


@pytest.mark.parametrize("name", sorted(BAD))
def test_a_bad_file_is_refused_by_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    text, expected = BAD[name]
    (folder / "bad.csv").write_text(text)
    assert main(["performance", "report", "bad.csv", "--commanded", "poses.csv"]) == 2
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1
    assert not (folder / "truing-performance-report").exists()


def test_labels_are_one_for_each_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["performance", "report", "nominal.csv", "--labels", "a,b"]) == 2
    assert "--labels: found 2 labels, expected one for each of 1 files" in capsys.readouterr().err
