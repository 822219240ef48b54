# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The command line keeps its contract: files, exit status, one clear line for bad input, nothing
half-written.
"""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from tables import columns
from truing.cli import main
from truing.cli.tables import table
from truing.examples import example

ROBOT = str(example("irb120"))


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def simulated(tmp_path: Path) -> Path:
    assert (
        main(["simulate", ROBOT, "--poses", "80", "--out", "sim", "--seed", "1", "--outliers", "2%:5mm"]) == 0
    )
    return tmp_path / "sim"


def identified(folder: Path, *options: str) -> tuple[int, dict[str, Any]]:
    code = main(
        ["identify", str(folder / "robot.yaml"), str(folder / "measurements.csv"), "--out", "found", *options]
    )
    return code, json.loads(Path("found/result.json").read_text())


# ---- What is written -----------------------------------------------------------------------------


def test_identify_writes_its_files_and_says_where_the_report_is(
    simulated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    code, result = identified(simulated)
    assert code == 0
    assert {path.name for path in Path("found").iterdir()} == {
        "result.json",
        "report.html",
        "robot.yaml",
        "covariance.csv",
        "residuals.csv",
    }
    assert result["format"] == "truing-identification/1"
    assert result["solver"]["converged"] and result["rank"] + len(result["frozen"]) == result["columns"]
    assert {"rms_m", "mean_m", "median_m", "p95_m", "max_m", "n"} <= set(result["errors"]["test"]["after"])
    assert capsys.readouterr().out.strip().splitlines()[-1] == "report: found/report.html"
    calibrated = truing.load_robot("found/robot.yaml")
    assert calibrated.joint("J2").a != truing.load_robot(ROBOT).joint("J2").a


def test_residuals_tell_the_same_as_result_json(simulated: Path) -> None:
    _, result = identified(simulated)
    table = columns("found/residuals.csv")
    assert [int(row) for row in table["row"]] == list(range(80))
    assert [k for k, rejected in enumerate(table["rejected"]) if rejected == "1"] == result["rejected_rows"]
    for name in ("train", "test"):
        chosen = [k for k in range(80) if table["set"][k] == name and table["rejected"][k] == "0"]
        for when in ("before", "after"):
            error = np.array([[float(table[f"error_{when}_{axis}_m"][k]) for axis in "xyz"] for k in chosen])
            length = np.linalg.norm(error, axis=1)
            expected = result["errors"][name][when]
            assert length == pytest.approx([float(table[f"error_{when}_m"][k]) for k in chosen])
            assert len(length) == expected["n"]
            assert [
                np.sqrt(np.mean(length**2)),
                length.mean(),
                np.quantile(length, 0.95),
                length.max(),
            ] == pytest.approx(
                [expected["rms_m"], expected["mean_m"], expected["p95_m"], expected["max_m"]], rel=1e-6
            )


def test_covariance_is_labelled_and_agrees_with_the_standard_errors(simulated: Path) -> None:
    _, result = identified(simulated)
    table = columns("found/covariance.csv")
    fitted = [p for p in result["parameters"] if not p["frozen"]]
    assert list(table) == ["name", *table["name"]]
    assert table["name"] == [p["name"] for p in fitted]
    for k, p in enumerate(fitted):
        assert math.sqrt(float(table[p["name"]][k])) == pytest.approx(p["sigma"], rel=1e-9)


def test_the_same_seed_writes_the_same_result(simulated: Path) -> None:
    _, first = identified(simulated, "--seed", "3")
    report = Path("found/report.html").read_bytes()
    _, again = identified(simulated, "--seed", "3", "--threads", "1")
    assert first == again
    assert Path("found/report.html").read_bytes() == report


def test_json_is_all_that_is_printed(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    _, result = identified(simulated, "--json")
    assert json.loads(capsys.readouterr().out) == result


def test_prediction_has_a_row_for_every_row_in_order(simulated: Path) -> None:
    identified(simulated)
    assert (
        main(["predict", "found/robot.yaml", str(simulated / "measurements.csv"), "--out", "predicted"]) == 0
    )
    table = columns("predicted/predicted.csv")
    assert list(table) == ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]
    robot = truing.load_robot("found/robot.yaml")
    expected = truing.predict(robot, truing.load_measurements(simulated / "measurements.csv", robot)).position
    assert np.array(
        [[float(table[name][k]) for name in ("x_m", "y_m", "z_m")] for k in range(80)]
    ) == pytest.approx(expected, abs=1e-15)
    assert json.loads(Path("predicted/result.json").read_text())["errors"]["n"] == 80


def test_prediction_needs_no_measurements(capsys: pytest.CaptureFixture[str]) -> None:
    Path("joints.csv").write_text(
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,0,0,0,0,0\n10,20,30,40,50,60\n"
    )
    assert main(["predict", ROBOT, "joints.csv", "--out", "predicted"]) == 0
    assert len(columns("predicted/predicted.csv")["x_m"]) == 2
    assert "errors" not in json.loads(Path("predicted/result.json").read_text())


def test_distances_come_back_as_distances() -> None:
    robot = truing.load_robot(ROBOT)
    robot.anchor = truing.model.Anchor([1.0, 0.2, 0.1], 0.01)
    truing.save_robot("wire.yaml", robot)
    Path("wire.csv").write_text(
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,dist_mm\n0,0,0,0,0,0,900\n10,20,30,40,50,60,\n"
    )
    assert main(["predict", "wire.yaml", "wire.csv", "--out", "with"]) == 0
    assert list(columns("with/predicted.csv")) == ["dist_m"]
    Path("joints.csv").write_text("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,0,0,0,0,0\n")
    assert main(["predict", "wire.yaml", "joints.csv", "--out", "without"]) == 0
    assert list(columns("without/predicted.csv")) == ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "dist_m"]


def test_a_plan_does_not_find_what_moves_the_tip_by_rounding_alone() -> None:
    robot = truing.load_robot(ROBOT)
    on_axis = np.eye(4)
    on_axis[2, 3] = 0.1
    robot.targets[0].T_last_target = on_axis
    truing.save_robot("arm.yaml", robot)
    assert main(["plan", "arm.yaml", "--poses", "20", "--out", "planned"]) == 0
    result = json.loads(Path("planned/result.json").read_text())
    assert max(p["sigma"] for p in result["parameters"] if p["sigma"] is not None) < 0.01


def test_a_plan_is_measured_by_the_simulator(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", ROBOT, "--poses", "20", "--out", "planned", "--min-step", "20deg"]) == 0
    table = columns("planned/poses.csv")
    joints = np.array([[float(table[f"q{k}_rad"][row]) for k in range(1, 7)] for row in range(20)])
    assert np.abs(np.diff(joints, axis=0)).min() > math.radians(20)
    assert json.loads(Path("planned/result.json").read_text())["index"]["name"] == "d_optimal"
    assert main(["simulate", ROBOT, "--plan", "planned/poses.csv", "--out", "sim"]) == 0
    measured = columns("sim/measurements.csv")
    assert [float(value) for value in measured["q3_rad"]] == joints[:, 2].tolist()


@pytest.mark.parametrize("width", [60, 80, 200])
def test_a_table_loses_no_letter_of_long_names_and_their_figures(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = [
        (
            "backlash left_shoulder_roll_joint",
            "backlash panda_joint7",
            "0.042",
            "0.042",
            "0.068 mrad",
            "0.3 mrad",
        ),
        ("gear ratio panda_joint5", "harmonic panda_finger_joint1", "0.019", "-", "85 ppm", "never"),
    ]
    table("told apart", ("", "from", "R2", "after", "from this size on", "after"), lines, words=True)
    out = capsys.readouterr().out
    assert all(len(line) <= width for line in out.splitlines())
    said = "".join(sum(lines, ()))
    missing = [letter for letter in set(said) - {" "} if out.count(letter) < said.count(letter)]
    assert not missing


def test_a_plan_says_which_effects_it_tells_apart(capsys: pytest.CaptureFixture[str]) -> None:
    plan = ["plan", ROBOT, "--poses", "30", "--out"]
    assert main([*plan, "full", "--columns", "payload,dir,temp,t"]) == 0
    assert "smallest effects" in capsys.readouterr().out
    result = json.loads(Path("full/result.json").read_text())
    seen, table = result["distinguish"], columns("full/poses.csv")
    assert {"dir1", "dir6", "payload_kg", "temp_C", "t_s"} <= set(table)
    assert {float(v) for v in table["dir2"]} == {-1, 1} and {float(v) for v in table["payload_kg"]} == {0, 5}
    assert result["poses"] == len(table["q1_rad"]) == 30 and seen["added_poses"] == 0
    assert len(seen["r2"]) == len(seen["effects"]) and all(
        len(row) == len(seen["effects"]) for row in seen["r2"]
    )
    assert all(e["size"] > 0 and e["size_at_tip_m"] > 0 for e in seen["effects"])
    assert any(
        n["effect"] == "joint_offset" and n["joints"] == ["J1"] and "base" in n["why"]
        for n in seen["not_testable"]
    )
    assert "Which effects look alike" in Path("full/report.html").read_text(encoding="utf-8")

    assert main([*plan, "one", "--separate", "backlash,joint_offset"]) == 0
    one_sided = json.loads(Path("one/result.json").read_text())["distinguish"]
    assert "dir1" not in columns("one/poses.csv")
    assert main([*plan, "two", "--separate", "backlash,joint_offset", "--columns", "dir"]) == 0
    two_sided = json.loads(Path("two/result.json").read_text())["distinguish"]

    def alike(found: dict[str, Any]) -> set[str]:
        return {p["joint"] for p in found["alike"] if p["joint"] == p["other_joint"]}

    assert {"J2", "J3", "J4", "J5"} <= alike(one_sided) and not alike(two_sided)
    assert {e["effect"] for e in two_sided["effects"]} == {"backlash", "joint_offset"}
    rows = len(columns("two/poses.csv")["q1_rad"])
    assert rows == 30 + two_sided["added_poses"]


def test_a_plan_that_is_asked_nothing_says_nothing_of_effects() -> None:
    assert main(["plan", ROBOT, "--poses", "20", "--out", "planned"]) == 0
    assert "distinguish" not in json.loads(Path("planned/result.json").read_text())
    assert list(columns("planned/poses.csv")) == [f"q{k}_rad" for k in range(1, 7)]


def test_simulated_files_hold_nominal_and_truth() -> None:
    options = [
        "--effect",
        "backlash:J2=0.2mrad",
        "--effect",
        "harmonic:J3:sin2=1e-4",
        "--columns",
        "payload,temp,t",
        "--orientation",
        "--base-unknown",
    ]
    assert main(["simulate", ROBOT, "--poses", "12", "--out", "sim", *options]) == 0
    header = list(columns("sim/measurements.csv"))
    assert {"qw", "dir1", "payload_kg", "temp_C", "t_s"} <= set(header)
    truth = json.loads(Path("sim/truth.json").read_text())
    assert {e["parameter"]: e["value"] for e in truth["effects"]} == {
        "backlash.J2": 2e-4,
        "harmonic.J3.sin2": 1e-4,
    }
    assert truing.load_robot("sim/robot.yaml").joint("J2").a == truing.load_robot(ROBOT).joint("J2").a
    assert truing.load_robot("sim/true_robot.yaml").joint("J2").a == truth["parameters"]["J2.a"]["true"]


def test_a_urdf_comes_back_as_urdf_too() -> None:
    Path("two.urdf").write_text(
        '<robot name="two"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><joint name="j1"'
        ' type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.5"/><axis xyz="0 0'
        ' 1"/></joint><joint name="j2" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.4'
        ' 0 0.1"/><axis xyz="0 1 0"/></joint><joint name="j3" type="continuous"><parent link="c"/><child'
        ' link="d"/><origin xyz="0.3 0.1 0"/><axis xyz="0 1 0"/></joint></robot>'
    )
    assert (
        main(["simulate", "two.urdf", "--poses", "60", "--out", "sim", "--base-link", "a", "--tip-link", "d"])
        == 0
    )
    assert main(["identify", "two.urdf", "sim/measurements.csv", "--out", "found"]) == 0
    assert truing.load_robot("found/robot.urdf").driven_count == 3


# ---- Exit status, errors -------------------------------------------------------------------------


def test_a_fit_that_does_not_converge_exits_1_and_says_why(
    simulated: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    identify = truing.identify
    monkeypatch.setattr(
        truing, "identify", lambda *a, **k: identify(*a, **k, max_iterations=1, rms_fall=0.0, gradient=0.0)
    )
    code, result = identified(simulated)
    assert code == 1
    assert not result["solver"]["converged"] and result["solver"]["stopped_because"]
    assert result["solver"]["stopped_because"] in capsys.readouterr().err
    assert "did not converge" in Path("found/report.html").read_text()


def with_turned_column(folder: Path) -> str:
    """The measurements with the sign of J3 turned."""
    with (folder / "measurements.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    with Path("turned.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows({**row, "q3_rad": repr(-float(row["q3_rad"]))} for row in rows)
    return "turned.csv"


def test_a_mistake_is_said_first_and_once_and_exits_1(
    simulated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    identify = ["identify", str(simulated / "robot.yaml"), with_turned_column(simulated), "--out", "found"]
    capsys.readouterr()
    assert main(identify) == 1
    said = capsys.readouterr()
    assert said.out.startswith(
        "look at the robot file and the columns first: turning the sign of joint column 3"
    )
    assert (said.out + said.err).count("joint column") == 1
    assert "--large-errors" in said.err
    mistake = json.loads(Path("found/result.json").read_text())["mistake"]
    assert mistake["kind"] == "joint_sign" and mistake["changes"]
    page = Path("found/report.html").read_text()
    head = page[page.index("<h1>") : page.index("</header>")]
    assert "do not go together" in head and "sign of joint column 3" in head
    assert page.count("sign of joint column") == 1
    assert main([*identify, "--large-errors"]) == 0
    assert json.loads(Path("found/result.json").read_text())["mistake"] == mistake

    cut = subprocess.run(
        [
            "bash",
            "-c",
            f"set -o pipefail; {sys.executable} -m truing {' '.join(identify)} --json | head -c 1",
        ],
        capture_output=True,
        check=False,
    )
    assert cut.returncode == 1  # that nobody reads on does not make a success of it


def test_diagnose_says_a_mistake_once(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    turned = with_turned_column(simulated)
    capsys.readouterr()
    assert main(["diagnose", str(simulated / "robot.yaml"), turned, "--out", "found"]) == 1
    said = capsys.readouterr()
    assert (said.out + said.err).count("turning the sign of joint column 3") == 1
    assert Path("found/report.html").read_text().lower().count("turning the sign of joint column 3") == 1


def test_noise_is_what_repeats_show(simulated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = truing.load_robot(simulated / "true_robot.yaml")
    rng = np.random.default_rng(7)
    joints = np.repeat(rng.uniform(-1.0, 1.0, (60, 6)), 3, axis=0)
    exact = truing.predict(robot, truing.Measurements(joints=joints)).position
    structure = 2e-4 * np.sin(40.0 * joints[:, :3])  # that no parameter of the robot makes
    positions = exact + structure + rng.normal(0.0, 1e-6, exact.shape)
    truing.save_measurements("repeats.csv", truing.Measurements(joints=joints, positions=positions), robot)
    capsys.readouterr()
    assert main(["identify", ROBOT, "repeats.csv", "--out", "found"]) == 0
    result = json.loads(Path("found/result.json").read_text())
    assert result["noise_from_repeats_m"] == pytest.approx(1e-6, rel=0.15)
    assert result["noise_sigma_m"] > 5e-5
    assert "noise of repeats 0.0010 mm" in capsys.readouterr().out
    assert "structure that the model does not explain" in Path("found/report.html").read_text()


BAD = [
    ["nonsense"],
    ["identify"],
    ["identify", ROBOT],
    ["identify", "missing.yaml", "missing.csv"],
    ["identify", ROBOT, "missing.csv"],
    ["identify", ROBOT, "DATA", "--loss", "softly"],
    ["identify", ROBOT, "DATA", "--free", "J9.*"],
    ["identify", ROBOT, "DATA", "--effects", "slack"],
    ["identify", ROBOT, "DATA", "--effects", "backlash"],
    ["identify", ROBOT, "DATA", "--rotation-length", "10"],
    ["identify", ROBOT, "DATA", "--test-share", "3"],
    ["identify", ROBOT, "DATA", "--tip-link", "flange"],
    ["identify", ROBOT, ROBOT],
    ["predict", ROBOT, "missing.csv"],
    ["simulate", ROBOT, "--noise", "0.03"],
    ["simulate", ROBOT, "--noise", "-1mm"],
    ["simulate", ROBOT, "--geometry-error", "1mm"],
    ["simulate", ROBOT, "--geometry-error", "1mm,-1mrad"],
    ["simulate", ROBOT, "--effect", "backlash"],
    ["simulate", ROBOT, "--effect", "backlash:J2=much"],
    ["simulate", ROBOT, "--effect", "slack:J2=1"],
    ["simulate", ROBOT, "--outliers", "2%"],
    ["simulate", ROBOT, "--columns", "humidity"],
    ["simulate", ROBOT, "--perturb", "J9.*"],
    ["simulate", ROBOT, "--poses", "none"],
    ["plan", ROBOT, "--poses", "2"],
    ["plan", ROBOT, "--min-step", "15"],
    ["plan", ROBOT, "--min-step", "300deg"],
    ["plan", ROBOT, "--columns", "humidity"],
    ["plan", ROBOT, "--separate", "slack"],
    ["plan", ROBOT, "--separate", "backlash:J9"],
    ["plan", ROBOT, "--columns", "payload", "--payload", "5"],
    ["plan", ROBOT, "--columns", "temp", "--temperatures", "35,20"],
]


@pytest.mark.parametrize("arguments", BAD, ids=[" ".join(a).replace(ROBOT, "ROBOT") for a in BAD])
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    if "DATA" in arguments:
        truing.save_measurements(
            "data.csv", truing.simulate(truing.load_robot(ROBOT), poses=60).data, truing.load_robot(ROBOT)
        )
    before = sorted(Path().iterdir())
    code = main([argument.replace("DATA", "data.csv") for argument in arguments])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert (
        captured.err.startswith("truing: ") and captured.err.count("\n") == 1 and captured.err.endswith("\n")
    )
    assert sorted(Path().iterdir()) == before


def test_a_folder_that_cannot_be_written_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    Path("file").write_text("mine")
    assert main(["simulate", ROBOT, "--poses", "3", "--out", "file"]) == 2
    assert "expected a folder" in capsys.readouterr().err
    assert Path("file").read_text() == "mine"


def test_warnings_about_the_input_go_to_stderr_and_into_the_result(
    capsys: pytest.CaptureFixture[str],
) -> None:
    robot = truing.load_robot(ROBOT)
    joints = np.random.default_rng(0).uniform(-1, 1, (60, 6))
    joints[7, 4] = 3.0  # beyond J5's limits
    truing.save_measurements("data.csv", truing.simulate(robot, joints=joints).data, robot)
    assert main(["identify", ROBOT, "data.csv", "--out", "found", "--json"]) == 0
    captured = capsys.readouterr()
    assert "warning: " in captured.err and "J5" in captured.err
    assert any("J5" in warning for warning in json.loads(captured.out)["warnings"])


def test_ctrl_c_leaves_nothing_behind(tmp_path: Path) -> None:
    program = (
        "import sys; from truing.cli import main; print('ready', flush=True); sys.exit(main(sys.argv[1:]))"
    )
    arguments = [
        sys.executable,
        "-c",
        program,
        "plan",
        str(example("ur10")),
        "--poses",
        "40000",
        "--out",
        "planned",
    ]
    with subprocess.Popen(
        arguments, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(3.0)  # at work, past its imports
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_version_and_effects(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"truing {truing.__version__}\n"
    assert main(["effects"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name, _ in truing.model.catalogue())


def test_the_demo_finds_the_truth_and_ends_with_the_report(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--out", "demo"]) == 0
    assert capsys.readouterr().out.strip().splitlines()[-1] == "report: demo/report.html"
    truth = json.loads(Path("demo/truth.json").read_text())
    assert truth["fresh_poses"]["after_mean_m"] < 2.5e-5 < 1e-3 < truth["fresh_poses"]["before_mean_m"]
    assert {
        "result.json",
        "robot.yaml",
        "nominal.yaml",
        "poses.csv",
        "measurements.csv",
        "covariance.csv",
        "residuals.csv",
    } <= {path.name for path in Path("demo").iterdir()}
