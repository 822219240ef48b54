# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing dynamics` from files to files, and what it says to input that cannot be used."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest

import truing
from pages import charts_of, visible
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
    assert "simulated less measured motion" in said and "worst joint, 2 s" in said
    assert {path.name for path in out.iterdir()} == {
        "result.json",
        "report.html",
        "robot.yaml",
        "covariance.csv",
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


def test_predict_simulates_the_motion_too(
    files: Path, simulated: SimulatedMotion, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truing.save_robot(tmp_path / "truth.yaml", simulated.truth)
    arguments = ["predict", str(tmp_path / "truth.yaml"), str(files / "motion3.csv"), "--simulate", "0.5s"]
    assert main(["dynamics", *arguments, "--out", str(tmp_path / "p")]) == 0
    assert "motion in 28 windows of 0.5 s" in capsys.readouterr().out
    with (tmp_path / "p" / "predicted.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    recording = simulated.recordings[2]
    names = [f"q{k}_rad" for k in range(1, 7)]
    assert set(rows[0]) == {"t_s", *(f"tau{k}_Nm" for k in range(1, 7)), *names, "window"}
    assert len(rows) == len(recording)
    off = np.array([[float(row[name]) for name in names] for row in rows]) - recording.position
    result = json.loads((tmp_path / "p" / "result.json").read_text())["simulated"]
    assert result["errors"]["J3"]["rms"] == pytest.approx(np.sqrt(np.mean(off[:, 2] ** 2)))
    assert np.abs(off[:, :4]).max() < math.radians(4.0)
    assert "motion" in charts_of((tmp_path / "p" / "report.html").read_text(encoding="utf-8"))
    assert "--simulate: found '0s'" in refused([*arguments[:3], "--simulate", "0s"], tmp_path, capsys)
    bare = str(without_torques(files, tmp_path))
    said = refused(["predict", str(files / "robot.yaml"), bare, "--simulate", "0.5s"], tmp_path, capsys)
    assert "bare: no torques" in said


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
    assert all(word in said for word in ("bare", "tau1_Nm", "i1_A", "u1_rad"))  # what to record
    said = refused(["diagnose", robot, str(without_torques(files, tmp_path, "u1_rad"))], tmp_path, capsys)
    assert "bare: command of joint 2, row 1" in said  # commands alone are enough, of all joints
    bare = str(without_torques(files, tmp_path))
    assert main(["dynamics", "predict", robot, bare, "--out", str(tmp_path / "p")]) == 0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            ["identify", "--effects", "coulmob:J2"],
            "--effects: found 'coulmob:J2', expected effects on torques",
        ),
        (["diagnose", "--leave-out", "ghost"], "--leave-out: found 'ghost', expected effects on torques"),
        (["diagnose", "--cutoff", "8"], "--cutoff: found '8', expected a frequency with its unit"),
        (["diagnose", "--torque-per-ampere", "1,2"], "--torque-per-ampere: found 2 numbers, expected 6"),
        (["diagnose", "--torque-per-ampere", "1,2,3,4,5,0"], "--torque-per-ampere: found '0'"),
        (["diagnose", "--joints", "J1,J2"], "--joints: there is no J3"),
        (["diagnose", "--payload", "2"], "--payload: found '2', expected a mass with its unit"),
        (["predict", "--payload", "2kg@1,2"], "--payload: found '2kg@1,2'"),
        (["identify", "--payload", "2kg@0,0,6"], "expected a length with its unit"),
        (["predict", "--topic", "/states"], "--topic (in Python: topic=) is of bags"),
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


def changed(files: Path, tmp_path: Path, change: Callable[[dict[str, Any]], None]) -> str:
    """The first recording with other columns, of no set."""
    table: dict[str, Any] = {k: np.array(v) for k, v in columns_of(files / "motion1.csv").items()}
    change(table)
    write_table(tmp_path / "changed.csv", table)
    return str(tmp_path / "changed.csv")


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """Columns of numbers of a table."""
    lines = [line.split(",") for line in path.read_text().splitlines()]
    return {
        name: np.array([float(line[k]) for line in lines[1:]])
        for k, name in enumerate(lines[0])
        if name != "set"
    }


def at_rest(table: dict[str, Any]) -> None:
    for k in range(1, 7):
        table[f"q{k}_rad"][:] = 0.3


def with_a_run_of_nan(table: dict[str, Any]) -> None:
    table["tau2_Nm"][100:120] = np.nan


def with_time_that_goes_back(table: dict[str, Any]) -> None:
    table["t_s"][50] = table["t_s"][40]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (at_rest, "nothing moves: no joint of any recording is faster than 0.01 rad/s"),
        (with_a_run_of_nan, "line 102, column 'tau2_Nm': found an empty cell"),
        (with_time_that_goes_back, "line 52, column 't_s': time goes backwards"),
    ],
)
@pytest.mark.parametrize("command", ["diagnose", "identify"])
def test_recordings_that_cannot_be_used_leave_nothing_behind(
    command: str,
    change: Callable[[dict[str, Any]], None],
    expected: str,
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    motion = changed(files, tmp_path, change)
    assert expected in refused([command, str(files / "robot.yaml"), motion], tmp_path, capsys)


def test_a_closed_loop_is_refused(files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    model = tmp_path / "loop.xml"
    body = '<body name="{0}"><joint name="{0}" axis="0 1 0"/><geom size="0.1" mass="1"/>{1}</body>'
    model.write_text(
        f"<mujoco><worldbody>{body.format('a', body.format('b', ''))}{body.format('c', '')}</worldbody>"
        '<equality><connect body1="b" body2="c" anchor="0 0 0"/></equality></mujoco>'
    )
    given = ["diagnose", str(model), str(files / "motion1.csv"), "--tip-link", "b"]
    said = refused(given, tmp_path, capsys)
    assert "`connect` between 'b' and 'c' closes a loop" in said


def turned(column: str) -> Callable[[dict[str, Any]], None]:
    def change(table: dict[str, Any]) -> None:
        table[column] = -table[column]

    return change


@pytest.mark.parametrize("command", ["diagnose", "identify"])
def test_a_mistake_in_the_recordings_comes_first(
    command: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion, out = changed(files, tmp_path, turned("tau6_Nm")), tmp_path / "out"
    assert main(["dynamics", command, str(files / "robot.yaml"), motion, "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("look at the data first: the torque of J6 has the opposite sign")
    assert "the columns of the recordings are to be corrected first" in said.err
    finding = json.loads((out / "result.json").read_text())["sanity"][0]
    assert finding["finding"] == "torque_sign" and finding["joints"] == ["J6"] and finding["mistake"]
    assert set(finding) == {
        "finding",
        "recordings",
        "joints",
        "evidence",
        "value",
        "unit",
        "applied",
        "parameters",
        "spans",
        "mistake",
    }
    page = visible((out / "report.html").read_text(encoding="utf-8"))
    assert page.index("Look at the data first") < page.index("Error of every joint")


def test_what_is_certain_is_corrected_and_said(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, out = str(files / "robot.yaml"), tmp_path / "out"
    motions = [changed(files, tmp_path, turned("tau3_Nm")), str(files / "motion2.csv")]
    assert main(["dynamics", "diagnose", robot, *motions, "--out", str(out)]) == 0
    assert "note: changed: the torque of J3 has the opposite sign" in capsys.readouterr().out
    result = json.loads((out / "result.json").read_text())
    assert [f["applied"] for f in result["sanity"]] == [True]
    assert {"coupling", "load_friction"} <= {e["effect"] for e in result["effects"] if not e["standard"]}
    page = visible((out / "report.html").read_text(encoding="utf-8"))
    assert "What the recordings look like" in page and "allowed for" in page


def test_currents_without_constants_are_said_in_words(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def currents(table: dict[str, Any]) -> None:
        for k in range(1, 7):
            table[f"i{k}_A"] = table.pop(f"tau{k}_Nm") / 10.0

    motion, out = changed(files, tmp_path, currents), str(tmp_path / "out")
    assert main(["dynamics", "diagnose", str(files / "robot.yaml"), motion, "--out", out]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "masses and drive constants share one scale" in said and "J2 9.9" in said
    assert "one recording: blocks of its own time are held out" in said


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


def by_current(simulated: SimulatedMotion, folder: Path, constants: list[float]) -> Path:
    """The first recording with currents in place of torques."""
    columns = recording_columns(simulated.nominal, simulated.recordings[0])
    for k, constant in enumerate(constants, 1):
        columns[f"i{k}_A"] = columns.pop(f"tau{k}_Nm") / constant
    write_table(folder / "currents.csv", columns)
    return folder / "currents.csv"


def test_drive_constants_have_either_sign(
    simulated: SimulatedMotion, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    constants = [10.0, -8.0, 9.0, -5.0, 4.0, 3.0]
    recording = str(by_current(simulated, tmp_path, constants))
    given = ["--torque-per-ampere", ",".join(map(str, constants))]
    for name, motion, more in (("i", recording, given), ("tau", str(files / "motion1.csv"), [])):
        arguments = ["predict", str(files / "robot.yaml"), motion, *more, "--out", str(tmp_path / name)]
        assert main(["dynamics", *arguments]) == 0
    assert "1 Nm/A is assumed" not in capsys.readouterr().err
    currents, torques = (read_columns(tmp_path / name / "predicted.csv") for name in ("i", "tau"))
    assert list(currents) == ["t_s", *(f"i{k}_A" for k in range(1, 7))]
    for k, constant in enumerate(constants, 1):
        assert np.allclose(currents[f"i{k}_A"] * constant, torques[f"tau{k}_Nm"], atol=1e-6)
    errors = [json.loads((tmp_path / name / "result.json").read_text())["errors"] for name in ("i", "tau")]
    assert errors[0]["J2"]["percent"] == pytest.approx(errors[1]["J2"]["percent"], rel=1e-6)


def test_an_assumed_drive_constant_is_said(
    simulated: SimulatedMotion, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = simulated.nominal.copy()
    robot.joints[0].torque_per_ampere = 10.0
    truing.save_robot(tmp_path / "robot.yaml", robot)
    recording = str(by_current(simulated, tmp_path, [10.0, *[1.0] * 5]))
    out = tmp_path / "o"
    assert main(["dynamics", "predict", str(tmp_path / "robot.yaml"), recording, "--out", str(out)]) == 0
    warning = "torque_per_ampere is not known of J2, J3, J4, J5, J6: 1 Nm/A is assumed"
    assert warning in capsys.readouterr().err
    assert warning in json.loads((out / "result.json").read_text())["warnings"][0]
    assert warning in (out / "report.html").read_text()


def read_columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(encoding="utf-8") as text:
        names = text.readline().strip().split(",")
        table = np.loadtxt(text, delimiter=",")
    return dict(zip(names, table.T, strict=True))


def test_what_identify_writes_belongs_together(
    simulated: SimulatedMotion, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The parameters of result.json, covariance.csv and robot.yaml, and rows of residuals.parquet."""
    recordings = [str(files / f"motion{k}.csv") for k in (1, 2, 3)]
    out = tmp_path / "o"
    arguments = ["identify", str(files / "robot.yaml"), *recordings, "--effects", "coulomb,viscous"]
    assert main(["dynamics", *arguments, "--out", str(out)]) == 0
    assert "parameters fitted; low-pass at 8 Hz" in capsys.readouterr().out
    names = {"result.json", "report.html", "robot.yaml", "covariance.csv", "residuals.parquet"}
    assert {path.name for path in out.iterdir()} == names
    parameters = json.loads((out / "result.json").read_text())["parameters"]
    fitted = {p["name"]: p for p in parameters if not p["frozen"]}
    with (out / "covariance.csv").open(encoding="utf-8") as text:
        listed = {row["name"]: row for row in csv.DictReader(text)}
    assert set(listed) == set(fitted)
    friction = [n for n in fitted if n.startswith(("coulomb.", "viscous.")) and n.count(".") == 1]
    assert len(friction) == 12
    carried = truing.load_robot(out / "robot.yaml").torque_effects
    values = {name: value for effect in carried for name, value in effect.parameters.items()}
    for name in friction:
        assert float(listed[name][name]) == pytest.approx(fitted[name]["sigma"] ** 2, rel=1e-6)
        assert values[name] == pytest.approx(fitted[name]["value"], rel=1e-6)
    table = parquet.read_table(out / "residuals.parquet").to_pydict()
    assert len(table["t_s"]) == sum(len(recording) for recording in simulated.recordings)
    assert {
        kind for kind, name in zip(table["set"], table["recording"], strict=True) if name == "motion3"
    } == {"test"}
    left = np.array(table["tau2_Nm"]) - np.array(table["predicted_tau2_Nm"])
    assert np.allclose(left, table["error_tau2_Nm"])


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
    assert {path.name for path in out.iterdir()} == names | {"not_written.yaml", "result.json", "report.html"}
    result = json.loads((out / "result.json").read_text())
    assert (result["format"], result["command"]) == ("truing-dynamics/1", "export")
    assert result["to"] == to
    assert (out / result["model"]).exists()
    assert result["rollout"]["held_out"] == {} and result["rollout"]["why_not"]
    said = capsys.readouterr().out
    assert str(out / result["model"]) in said
    if to == "urdf":  # it has no place for friction that grows with the load
        assert any("load_friction" in n["name"] for n in result["not_written"])


def test_export_judges_what_it_wrote_on_what_was_held_out(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = tmp_path / "found"
    robot, recordings = str(files / "robot.yaml"), str(files / "motion*.csv")
    assert main(["dynamics", "diagnose", robot, recordings, "--out", str(found)]) == 0
    diagnosed = json.loads((found / "result.json").read_text())["rollout"]
    assert main(["dynamics", "export", str(found), "--out", str(tmp_path / "model")]) == 0
    written = json.loads((tmp_path / "model" / "result.json").read_text())["rollout"]
    for model in ("named", "exported"):  # the same motion, the same models
        assert written["held_out"][model]["J5"] == pytest.approx(diagnosed["held_out"][model]["J5"], rel=1e-9)
    assert "as written" in capsys.readouterr().out
    assert "motion" in charts_of((tmp_path / "model" / "report.html").read_text(encoding="utf-8"))

    given = ["--held-out", str(files / "motion1.csv")]
    assert main(["dynamics", "export", str(found), "--to", "urdf", *given, "--out", str(tmp_path / "u")]) == 0
    urdf = json.loads((tmp_path / "u" / "result.json").read_text())["rollout"]
    assert urdf["recordings"] == ["motion1"] and "the URDF alone" in urdf["sentence"]
    assert urdf["held_out"]["exported"]["J3"][1] > 2.0 * urdf["held_out"]["named"]["J3"][1]  # no armature


def test_a_residuals_file_of_other_programs_is_refused(
    simulated: SimulatedMotion, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truing.save_robot(tmp_path / "robot.yaml", simulated.truth)
    write_table(tmp_path / "residuals.parquet", {"recording": ["a"], "t_s": np.zeros(1)})
    assert "has no column set, expected the residuals.parquet" in refused(
        ["export", str(tmp_path)], tmp_path, capsys
    )
    (tmp_path / "residuals.parquet").write_text("no Parquet")
    assert "cannot be read as Parquet" in refused(["export", str(tmp_path)], tmp_path, capsys)


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
