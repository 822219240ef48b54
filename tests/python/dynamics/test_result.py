# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files of `truing dynamics`: what the contract of result.json asks for, and tables of the recordings."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import truing
from pages import charts_of, visible
from truing.cli.commands.dynamics.diagnose import cause_lines
from truing.dynamics import Recording, RecordingFinding, TorqueDiagnosis, diagnose, identify, predict
from truing.dynamics.page import ROOM, causes_in_words, in_motion_sentence
from truing.dynamics.result import (
    diagnosis_page,
    prediction_columns,
    write_diagnosis,
    write_fit,
    write_prediction,
)
from truing.dynamics.sanity.findings import FoundParameter
from truing.errors import InputError
from truing.report.arrays import unpacked
from truing.testing.dynamics import HIDDEN, SimulatedMotion, demo_arm, simulate_motion


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seconds=16.0)


@pytest.fixture(scope="module")
def found(simulated: SimulatedMotion) -> TorqueDiagnosis:
    return diagnose(simulated.nominal, simulated.recordings)


@pytest.fixture(scope="module")
def folder(
    simulated: SimulatedMotion, found: TorqueDiagnosis, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    out = tmp_path_factory.mktemp("diagnosis")
    write_diagnosis(out, found, simulated.recordings, warnings=["a warning about the input"])
    return out


@pytest.fixture(scope="module")
def result(folder: Path) -> Any:
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


def test_a_load_that_nobody_told_is_a_cause_in_headline_and_table(
    simulated: SimulatedMotion, found: TorqueDiagnosis, tmp_path: Path
) -> None:
    load = RecordingFinding(
        "load_differs",
        ("b", "c"),
        (),
        "b and c carry 1.50 kg more than the lightest",
        1.5,
        "kg",
        applied=True,
        parameters=(FoundParameter("payload.m", 1.5, 0.02, "kg"), FoundParameter("payload.x", 0.1, 0.0, "m")),
    )
    result = write_diagnosis(tmp_path, found, simulated.recordings, sanity=[load])
    first = result["effects"][0]
    assert (first["effect"], first["joints"], first["recordings"]) == ("payload", [], ["b", "c"])
    assert first["share"] is None and 0.9 <= first["probability"] < 1.0 and not first["standard"]
    assert result["sentence"].startswith("b and c carry a load of 1.50 kg that nobody told. The error")
    text = visible((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "b and c carry a load of 1.50 kg that nobody told. Torque error falls from" in text
    assert "load at the tool that nobody told" in text and "taken into account first" in text
    assert "load" not in causes_in_words({"effects": [first]})
    lines = cause_lines(result)
    assert lines[0][:3] == ("payload in b and c", "first", "90 %") and "m 1.50 ± 0.020 kg" in lines[0][3]


def test_hidden_effects_are_named_within_their_errors(result: dict[str, Any]) -> None:
    named = {e["effect"]: e for e in result["effects"] if not e["standard"]}
    for effect, (joints, values) in HIDDEN.items():
        assert named[effect]["joints"] == list(joints)
        sizes = {p["name"]: p for p in named[effect]["parameters"]}
        for name, value in values.items():
            assert abs(sizes[name]["value"] - value) < max(5 * sizes[name]["sigma"], 0.06 * value), name


def test_result_has_what_the_contract_lists(result: dict[str, Any]) -> None:
    assert (result["format"], result["command"]) == ("truing-dynamics/1", "diagnose")
    assert result["verdict"] in ("effects", "effects+unknown")
    assert {"effect", "joints", "standard", "probability", "parameters", "share", "ci", "rms_Nm"} < set(
        result["effects"][0]
    )
    assert {"confounded_with", "sentence"} < set(result["effects"][0])
    joints = ["J1", "J2", "J3", "J4", "J5", "J6"]
    for held in ("held_out", "train"):
        for model in ("nominal", "standard", "named", "with_unknown"):
            assert list(result["torque"][held][model]) == joints
    assert result["held_out"] == ["motion4", "motion5"]
    assert result["sanity"] == [] and result["cutoff_hz"] > 0
    assert result["warnings"][0] == "a warning about the input"
    for key in ("unknown", "remainders", "classes", "not_testable"):
        assert isinstance(result[key], list)


@pytest.mark.parametrize("applied", [True, False])
def test_what_was_corrected_stands_below_the_headline(
    simulated: SimulatedMotion, found: TorqueDiagnosis, tmp_path: Path, applied: bool
) -> None:
    finding = RecordingFinding("gravity_direction", (), (), "gravity points up", 90.0, "%", applied)
    write_diagnosis(tmp_path, found, simulated.recordings, sanity=[finding])
    header = (tmp_path / "report.html").read_text(encoding="utf-8").split("</header>")[0]
    assert ("gravity points up" in header) is applied


def test_the_headline_has_the_numbers_of_the_sentence(folder: Path, result: dict[str, Any]) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    headline = page[page.index("<h1") : page.index("</h1>")]
    shown = re.findall(r">([\d.]+)\u202f%<", headline)
    assert shown and shown == re.findall(r"([\d.]+) %", result["sentence"])[:2]


def test_where_says_the_joint_that_was_worst(result: dict[str, Any]) -> None:
    shares = {w["joint"]: w["share"] for w in result["where"]["joints"]}
    assert max(shares, key=lambda joint: shares[joint]) == "J5"
    assert sum(shares.values()) == pytest.approx(1.0)
    assert all(0.0 <= w["share"] <= 1.0 for w in result["where"]["inputs"])
    assert {"joint", "input", "low", "high", "standard_rms_Nm", "named_rms_Nm", "n"} == set(
        result["where"]["regimes"][0]
    )


def test_residuals_have_every_row_and_are_small(folder: Path, simulated: SimulatedMotion) -> None:
    table = pq.read_table(folder / "residuals.parquet").to_pydict()
    assert len(table["t_s"]) == sum(len(recording) for recording in simulated.recordings)
    assert set(zip(table["recording"], table["set"], strict=True)) == {
        *((f"motion{k}", "train") for k in (1, 2, 3)),
        *((f"motion{k}", "test") for k in (4, 5)),
    }
    measured, error = np.array(table["tau5_Nm"]), np.array(table["error_tau5_Nm"])
    np.testing.assert_allclose(measured - np.array(table["predicted_tau5_Nm"]), error, atol=1e-12)
    assert error.std() < 0.05 * measured.std()
    assert table["q3_rad"] == np.concatenate([r.position[:, 2] for r in simulated.recordings]).tolist()


def test_residuals_carry_the_payloads_that_recordings_state(
    tmp_path: Path, simulated: SimulatedMotion
) -> None:
    free, *others = simulated.recordings
    (loaded,) = truing.dynamics.with_payload([others[0]], 2.0, (0.0, 0.0, 0.1))
    found = identify(simulated.nominal, simulated.recordings, effects="coulomb,viscous")
    write_fit(tmp_path, found, [free, loaded])
    table = pq.read_table(tmp_path / "residuals.parquet").to_pydict()
    n = len(free)
    assert table["payload_kg"] == [0.0] * n + [2.0] * len(loaded)
    assert table["payload_z_m"][n - 1 : n + 1] == [0.0, 0.1]


def test_the_robot_file_predicts_as_the_robot_found(
    folder: Path, found: TorqueDiagnosis, simulated: SimulatedMotion
) -> None:
    robot = truing.load_robot(folder / "robot.yaml")
    recording = simulated.recordings[-1]
    np.testing.assert_allclose(
        predict(robot, recording).torque, predict(found.robot, recording).torque, rtol=1e-9, atol=1e-9
    )


def test_the_report_says_it_in_its_first_lines(folder: Path, result: dict[str, Any]) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    text = visible(page)
    assert "Torque error falls from" in text
    assert "another joint's motor acts on this one (J6 on J5)" in text.replace("&#x27;", "'")
    assert "a warning about the input" in text
    charts = charts_of(page)
    assert {"trace", "errors", "where", "friction0"} <= set(charts)
    shown = [trace for trace in charts["trace"]["data"] if trace["visible"]]
    assert {trace["name"] for trace in shown} == {"measured", "nominal", "standard", "named"}
    assert charts["trace"]["layout"]["updatemenus"][0]["buttons"][0]["label"] == "J5"  # the worst is first
    loads = [len([t for t in charts[f"friction{k}"]["data"]]) for k in range(6)]
    assert loads[1] == 2 and loads[0] == 1  # only J2 has friction that grows with the load


def test_no_line_is_drawn_from_one_held_out_block_to_the_next(simulated: SimulatedMotion) -> None:
    found = diagnose(simulated.nominal, simulated.recordings[:1])  # one recording: blocks of its time
    pauses = np.diff(np.array(found.traces[0].time))
    apart = np.count_nonzero(pauses > 1.0)
    assert apart >= 1
    line = charts_of(diagnosis_page(found, 1))["trace"]["data"][0]
    for axis in ("x", "y"):
        assert np.isnan(unpacked(line[axis])).sum() == apart


def one_after_the_other(robot: truing.Robot, joints: range, name: str) -> Recording:
    """Each of these joints swings for 15 s while the others stand, with dry friction of 2 Nm. Seed 20."""
    turns = 5 + int(name[-1])
    time = np.arange(0.0, 15.0 * len(joints), 0.01)
    position = np.full((len(time), 6), 0.4)
    for number, joint in enumerate(joints):
        swings = (time >= 15.0 * number) & (time < 15.0 * (number + 1))
        position[swings, joint] -= 0.4 * (1.0 - np.cos(2 * np.pi * turns * np.arange(swings.sum()) / 1500))
    speed, noise = np.gradient(position, 0.01, axis=0), np.random.default_rng(20).normal(size=position.shape)
    ideal = predict(robot, Recording(name, time=time, position=position)).torque
    torque = ideal + 2.0 * np.tanh(speed / 0.01) + 0.1 * noise
    return Recording(name, time=time, position=position, torque=torque, test=name.endswith("2"))


def test_every_joint_is_drawn_where_it_moves() -> None:
    robot = demo_arm()
    arm = [one_after_the_other(robot, range(3), f"arm{k}") for k in range(3)]
    wrist = [one_after_the_other(robot, range(3, 6), f"wrist{k}") for k in range(3)]
    found = diagnose(robot, arm + wrist)
    assert [trace.recording for trace in found.traces] == 3 * ["arm2"] + 3 * ["wrist2"]
    for k, trace in enumerate(found.traces):
        assert 15.0 * (k % 3) - 12.0 < trace.time[0] < 15.0 * (k % 3) + 12.0
        assert np.std(trace.measured) > 1.5  # at rest: noise
    buttons = charts_of(diagnosis_page(found, 6))["trace"]["layout"]["updatemenus"][0]["buttons"]
    assert {button["label"] for button in buttons} >= {"J1, arm2", "J6, wrist2"}


def test_a_fit_writes_its_parameters_with_errors(simulated: SimulatedMotion, tmp_path: Path) -> None:
    fit = identify(simulated.nominal, simulated.recordings, effects="coulomb,viscous,load_friction:J2")
    result = write_fit(tmp_path, fit, simulated.recordings)
    assert (result["format"], result["command"]) == ("truing-dynamics/1", "identify")
    fitted = {p["name"]: p for p in result["parameters"]}
    assert fitted["load_friction.J2"]["value"] == pytest.approx(0.09, abs=0.02)
    with (tmp_path / "covariance.csv").open(encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert list(rows) == result["covariance"]["names"]
    variance = float(rows["coulomb.J1"]["coulomb.J1"])
    assert variance == pytest.approx(fitted["coulomb.J1"]["sigma"] ** 2, rel=1e-6)
    assert rows["coulomb.J1"]["viscous.J1"] == rows["viscous.J1"]["coulomb.J1"] != "0"
    assert truing.load_robot(tmp_path / "robot.yaml").torque_effects
    assert "coulomb.J1" in visible((tmp_path / "report.html").read_text(encoding="utf-8"))


def test_a_prediction_has_the_columns_that_were_measured(simulated: SimulatedMotion, tmp_path: Path) -> None:
    recording = simulated.recordings[0]
    predicted = predict(simulated.truth, recording)
    write_prediction(tmp_path, simulated.truth, recording, predicted)
    with (tmp_path / "predicted.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["t_s", *(f"tau{k}_Nm" for k in range(1, 7))]
    assert len(rows) == 1 + len(recording)
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert (result["format"], result["command"]) == ("truing-dynamics/1", "predict")
    assert result["rows"] == len(recording) and result["errors"]["J2"]["percent"] < 10


def test_predicted_currents_are_torques_by_the_drives_constants(simulated: SimulatedMotion) -> None:
    robot = demo_arm()
    for joint in robot.joints:
        joint.torque_per_ampere = 4.0
    bare = simulated.recordings[0]
    recording = Recording("currents", time=bare.time, position=bare.position, current=bare.torque / 4.0)
    predicted = predict(robot, recording)
    columns = prediction_columns(robot, recording, predicted)
    assert list(columns) == ["t_s", *(f"i{k}_A" for k in range(1, 7))]
    np.testing.assert_allclose(columns["i2_A"], predicted.torque[:, 1] / 4.0)


def test_the_same_seed_gives_the_same_recordings() -> None:
    one, other, third = (simulate_motion(seconds=2.0, recordings=1, held_out=0, seed=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(one.recordings[0].torque, other.recordings[0].torque)
    assert np.abs(one.recordings[0].torque - third.recordings[0].torque).max() > 1.0


def test_the_headline_holds_in_two_lines_whatever_joints_are_called() -> None:
    def cause(effect: str, joint: str, share: float, words: str) -> dict[str, Any]:
        return {
            "effect": effect,
            "joints": [joint],
            "standard": False,
            "share": share,
            "probability": 0.9,
            "confounded_with": [],
            "sentence": f"{words} at {joint}: 1 +- 0.1 Nm",
        }

    names = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
    load = [cause("load_friction", name, 0.2, "Friction that grows with the load") for name in names[:2]]
    assert causes_in_words({"effects": load}) == (
        "friction that grows with the load (shoulder_pan_joint, shoulder_lift_joint)"
    )
    rotors = [cause("armature", name, 0.1, "Inertia of the motor's rotor") for name in names]
    said = causes_in_words({"effects": [*load, *rotors]})
    assert said == "friction that grows with the load (2 joints); inertia of the motor's rotor (3 joints)"
    reversal = cause("presliding", names[2], 0.05, "Friction that builds up after a reversal")
    assert len(causes_in_words({"effects": [*load, *rotors, reversal]})) <= ROOM


@pytest.mark.parametrize(("seed", "told"), [(31, False), (32, True)])
def test_the_headline_says_what_a_cause_cannot_be_told_from(seed: int, told: bool, tmp_path: Path) -> None:
    """A load at the flange, or a last link that is heavier: of few seconds the two are alike."""
    load = {"payload.m": 2.0, "payload.mx": 0.0, "payload.my": 0.0, "payload.mz": 0.2}
    simulated = simulate_motion(seed=seed, seconds=12.0, hidden={"payload": ([], load)})
    found = diagnose(simulated.nominal, simulated.recordings)
    result = write_diagnosis(tmp_path, found, simulated.recordings)
    text = visible((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert ("(or payload: these recordings cannot tell)" in result["sentence"]) != told
    assert ("(J6) or payload: these recordings cannot tell" in text) != told
    (cause,) = [effect for effect in result["effects"] if not effect["standard"]]
    assert cause["effect"] == ("payload" if told else "link_inertia")


def test_errors_in_motion_are_said_where_rests_make_a_difference() -> None:
    def said(held_out: float | None, in_motion: float | None) -> str:
        errors = {"held_out": held_out, "in_motion": in_motion}
        return in_motion_sentence({"torque": {rows: {"named": {"J1": e}} for rows, e in errors.items()}})

    assert "named effects leave J1 5.1" in said(6.0, 5.1)
    assert said(2.0, 1.95) == said(None, None) == ""


def test_predict_low_passes_where_the_robot_was_fitted(simulated: SimulatedMotion, tmp_path: Path) -> None:
    recording = simulated.recordings[-1]
    found = identify(simulated.nominal, simulated.recordings, cutoff=12.0).robot
    truing.save_robot(tmp_path / "robot.yaml", found)
    robot = truing.load_robot(tmp_path / "robot.yaml")
    assert robot.fitted_range["frequency"] == (0.0, 12.0)
    predicted = predict(robot, recording)
    assert predicted.cutoff == 12.0
    assert (predicted.torque == predict(robot, recording, cutoff=12.0).torque).all()
    assert predict(robot, recording, cutoff=5.0).cutoff == 5.0
    assert predict(simulated.nominal, recording).cutoff == 8.0
    slow = Recording("slow", time=recording.time[::4], position=recording.position[::4])
    assert predict(robot, slow).cutoff == pytest.approx(0.25 / 0.04)  # rows 0.04 s apart show no more
    with pytest.raises(InputError, match="'frequency' ends at 0 Hz, expected above 0 Hz"):
        predict(robot.replace(fitted_range={"frequency": (0.0, 0.0)}), recording)
