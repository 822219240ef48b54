# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing dynamics` from files to files, and what it says to input that cannot be used."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truing
from truing.cli import main
from truing.dynamics import load_recordings
from truing.dynamics.result import recording_columns
from truing.files import write_table
from truing.testing.dynamics import SimulatedMotion, demo_arm, simulate_motion


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seconds=14.0, recordings=3, held_out=1)


@pytest.fixture(scope="module")
def files(simulated: SimulatedMotion, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("motion")
    truing.save_robot(folder / "robot.yaml", simulated.nominal)
    for recording in simulated.recordings:
        write_table(folder / f"{recording.name}.csv", recording_columns(simulated.nominal, recording))
    return folder


def test_diagnose_names_what_was_hidden(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "found"
    robot, recordings = str(files / "robot.yaml"), str(files / "motion*.csv")
    assert main(["dynamics", "diagnose", robot, recordings, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "coupling at J5 from J6" in said and "standard   named" in said
    assert {path.name for path in out.iterdir()} == {
        "result.json",
        "report.html",
        "robot.yaml",
        "residuals.parquet",
    }
    assert json.loads((out / "result.json").read_text())["held_out"] == ["motion3"]

    assert (
        main(
            [
                "dynamics",
                "predict",
                str(out / "robot.yaml"),
                str(files / "motion3.csv"),
                "--out",
                str(tmp_path / "p"),
            ]
        )
        == 0
    )
    errors = json.loads((tmp_path / "p" / "result.json").read_text())["errors"]
    assert all(error["percent"] < 12 for error in errors.values())


def test_identify_fits_what_is_asked_for(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(files / "robot.yaml"), str(files / "motion1.csv"), str(files / "motion2.csv")]
    effects = ["--effects", "coulomb,viscous,load_friction:J2+J3", "--cutoff", "6Hz", "--json"]
    assert main(["dynamics", "identify", *arguments, *effects, "--out", str(tmp_path / "o")]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["cutoff_hz"] == 6.0
    names = {p["name"] for p in result["parameters"]}
    assert {"coulomb.J1", "viscous.J6", "load_friction.J2", "load_friction.J3"} <= names
    assert "load_friction.J1" not in names
    assert (tmp_path / "o" / "covariance.csv").exists()


def refused(arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line of a command that ends with 2 and writes nothing."""
    out = tmp_path / "refused"
    assert main(["dynamics", *arguments, "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert not out.exists() and said.err.count("\n") == 1, said.err
    return said.err


def without_torques(files: Path, tmp_path: Path, extra: str = "") -> Path:
    """The first recording without its torques; `extra` stands in their place."""
    lines = (files / "motion1.csv").read_text().splitlines()
    names = lines[0].split(",")
    kept = [k for k, name in enumerate(names) if not name.startswith("tau")]
    rows = [[line.split(",")[k] for k in kept] for line in lines]
    path = tmp_path / "bare.csv"
    added = [f",{extra}" if extra and n == 0 else ",0" if extra else "" for n in range(len(rows))]
    path.write_text("\n".join(",".join(row) + more for row, more in zip(rows, added, strict=True)) + "\n")
    return path


def test_a_recording_without_torques_is_refused(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = str(files / "robot.yaml")
    said = refused(["diagnose", robot, str(without_torques(files, tmp_path))], tmp_path, capsys)
    assert "bare" in said and "tau1_Nm" in said and "commands" not in said
    said = refused(["diagnose", robot, str(without_torques(files, tmp_path, "u1_rad"))], tmp_path, capsys)
    assert "from commands alone (u1_rad …) is not there yet" in said
    bare = str(without_torques(files, tmp_path))
    assert main(["dynamics", "predict", robot, bare, "--out", str(tmp_path / "p")]) == 0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["identify", "--effects", "coulmob"], "'coulmob'"),
        (["diagnose", "--leave-out", "ghost"], "'ghost'"),
        (["diagnose", "--cutoff", "8"], "--cutoff: found '8', expected a frequency with its unit"),
        (["diagnose", "--torque-per-ampere", "1,2"], "found 2 numbers, expected 6"),
        (["diagnose", "--torque-per-ampere", "1,2,3,4,5,-6"], "found '-6'"),
        (["diagnose", "--joints", "J1,J2"], "J3"),
        (["diagnose", "--payload", "2"], "--payload: found '2', expected a mass with its unit"),
        (["predict", "--payload", "2kg@1,2"], "--payload: found '2kg@1,2'"),
        (["identify", "--payload", "2kg@0,0,6"], "expected a length with its unit"),
    ],
)
def test_options_that_cannot_be_used_are_refused(
    arguments: list[str], expected: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *options = arguments
    given = [command, str(files / "robot.yaml"), str(files / "motion1.csv"), *options]
    assert expected in refused(given, tmp_path, capsys)


def test_files_that_cannot_be_used_are_refused(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, motion = str(files / "robot.yaml"), str(files / "motion1.csv")
    assert "nowhere.csv" in refused(["diagnose", robot, str(tmp_path / "nowhere.csv")], tmp_path, capsys)
    assert "nowhere.yaml" in refused(["diagnose", str(tmp_path / "nowhere.yaml"), motion], tmp_path, capsys)
    short = tmp_path / "short.csv"
    short.write_text("\n".join((files / "motion1.csv").read_text().splitlines()[:11]) + "\n")
    assert "20" in refused(["diagnose", robot, str(short)], tmp_path, capsys)
    said = refused(["diagnose", robot], tmp_path, capsys)
    assert "REC" in said


def test_a_robot_without_masses_is_refused(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf = tmp_path / "bare.urdf"
    joints = "".join(
        f'<link name="l{k}"/><joint name="J{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>'
        f'<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for k in range(1, 7)
    )
    urdf.write_text(f'<robot name="bare"><link name="l0"/>{joints}</robot>')
    said = refused(["diagnose", str(urdf), str(files / "motion1.csv")], tmp_path, capsys)
    assert "no link has a mass" in said and "<inertial>" in said


def test_drive_constants_given_are_those_of_the_robot(files: Path, tmp_path: Path) -> None:
    from truing.cli.recordings import with_drives

    robot = with_drives(demo_arm(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert [joint.torque_per_ampere for joint in robot.joints] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_the_demonstration_ends_with_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dynamics", "demo", "--out", str(tmp_path / "demo")]) == 0
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == f"report: {tmp_path / 'demo' / 'report.html'}"
    assert "load_friction.J2" in said and "not named" not in said
    for name in ("report.html", "nominal.yaml", "truth.yaml", "motion1.csv", "motion5.csv"):
        assert (tmp_path / "demo" / name).exists()


@pytest.mark.parametrize(
    ("to", "names"),
    [
        ("mjcf", {"demo_arm.xml", "callbacks.py"}),
        ("urdf", {"demo_arm.urdf"}),
        ("isaaclab", {"demo_arm.urdf", "actuators.py"}),
    ],
)
def test_export_writes_the_model_and_what_it_lacks(
    to: str,
    names: set[str],
    simulated: SimulatedMotion,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    truing.save_robot(tmp_path / "robot.yaml", simulated.truth)
    out = tmp_path / "model"
    assert main(["dynamics", "export", str(tmp_path), "--to", to, "--out", str(out)]) == 0
    assert {path.name for path in out.iterdir()} == names | {"not_written.yaml", "result.json"}
    result = json.loads((out / "result.json").read_text())
    assert result["format"] == "truing-dynamics-export/1" and result["to"] == to
    assert (out / result["model"]).exists()
    said = capsys.readouterr().out
    assert str(out / result["model"]) in said
    if to == "urdf":  # it has no place for friction that grows with the load
        assert any("load_friction" in n["name"] for n in result["not_written"])


def test_a_folder_without_a_robot_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "robot.yaml: there is no such file" in refused(["export", str(tmp_path)], tmp_path, capsys)


def test_a_payload_on_the_command_line_weighs_as_one_in_the_file(
    files: Path, simulated: SimulatedMotion, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = recording_columns(simulated.nominal, simulated.recordings[0])
    stated = {"payload_kg": [2.0] * len(columns["t_s"]), "payload_z_mm": [60.0] * len(columns["t_s"])}
    write_table(tmp_path / "motion1.csv", {**columns, **stated})
    robot, bare = str(files / "robot.yaml"), str(files / "motion1.csv")
    predicted = []
    for name, arguments in {
        "without": [bare],
        "option": [bare, "--payload", "2kg@0,0,60mm"],
        "column": [str(tmp_path / "motion1.csv"), "--payload", "9kg"],
    }.items():
        assert main(["dynamics", "predict", robot, *arguments, "--out", str(tmp_path / name)]) == 0
        predicted.append((tmp_path / name / "predicted.csv").read_text())
    assert predicted[1] == predicted[2] != predicted[0]


PLAN = ["--duration", "12s", "--starts", "2", "--rounds", "1", "--seed", "3", "--threads", "1"]


def test_plan_writes_a_motion_that_can_be_read_as_a_recording(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = str(files / "robot.yaml")
    given = [
        robot,
        str(files / "motion1.csv"),
        "--columns",
        "current,payload",
        "--separate",
        "stribeck:J1,backlash:J1",
    ]
    assert main(["dynamics", "plan", *given, *PLAN, "--out", str(tmp_path / "plan")]) == 0
    result = json.loads((tmp_path / "plan" / "result.json").read_text())
    assert result["format"] == "truing-dynamics/1"
    assert [run["payload_kg"] for run in result["runs"]] == [0.0, 2.0]
    assert {(p["effect"], p["other"]) for p in result["separated"]} == {
        ("stribeck", "backlash"),
        ("backlash", "stribeck"),
    }
    assert "given" in result
    arm = demo_arm()
    (motion,) = load_recordings(tmp_path / "plan" / "motion.csv", arm)
    assert motion.speed.shape == (result["rows"], arm.driven_count)
    page = (tmp_path / "plan" / "report.html").read_text()
    assert "The smallest effects that would be seen" in page and "The recordings that there are" in page
    assert "effects seen" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--columns", "volts"], "words of current, torque, payload, temp"),
        (["--separate", "ghost"], "'ghost'"),
        (["--separate", "coulomb"], "is fitted in any case"),
        (["--separate", "thermal_friction"], "temp_C"),
        (["--home", "0deg,0deg"], "home has 2 numbers, expected 6"),
        (["--home", "0deg,0deg,300deg,0deg,0deg,0deg"], "joint 'J3' has no room to move"),
        (["--torque-noise", "1,2"], "torque_noise has 2 numbers, expected 6"),
        (["--duration", "2s"], "--duration"),
    ],
)
def test_plans_that_cannot_be_are_refused(
    arguments: list[str], expected: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["plan", str(files / "robot.yaml"), "--starts", "1", "--rounds", "0", *arguments]
    assert expected in refused(given, tmp_path, capsys)
