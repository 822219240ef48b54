# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""truing diagnose keeps its contract, from Python and from the command line, whatever the verdict."""

from __future__ import annotations

import csv
import functools
import json
import math
import os
import platform
import re
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import truing
from truing.cli import main
from truing.errors import InputWarning
from truing.examples import example
from truing.model import AppliedEffect, catalogue, catalogue_effects
from truing.testing.simulation import random_joints

ROBOT = str(example("irb120"))
NOISE = 3e-5  # [m] of one coordinate
CASES = ["none", "effects", "unknown", "effects+unknown"]


def step(d: Any) -> Any:
    """What no catalogue has: J2 jumps where it passes 0.41 rad."""
    return np.where(d.joint("J2") > 0.41, 1.0, -1.0)


OWN = truing.Effect("jump", site="J2", basis=step)


def measured(case: str, *, poses: int = 220, orientation: bool = False) -> truing.Measurements:
    """A robot with known geometry, an unknown base, and what the verdict `case` asks for."""
    robot = truing.load_robot(ROBOT)
    rng = np.random.default_rng([7, poses])
    joints = random_joints(robot, poses, 3)
    directions = rng.choice([-1.0, 1.0], size=joints.shape)
    true = robot.copy()
    true.T_measurement_base = truing.frame_from_xyz_rpy([0.4, -1.6, 0.3], [0.01, -0.02, 0.8])
    if case.startswith("effects"):
        true.effects = [AppliedEffect("backlash", ["J3"], {"backlash.J3": 1e-3})]
    moved = joints.copy()
    if case.endswith("unknown"):
        moved[:, 1] += np.where(joints[:, 1] > 0.41, 6e-4, -6e-4)
    predicted = truing.predict(true, truing.Measurements(moved, directions=directions))
    positions = np.asarray(predicted.position) + rng.normal(0, NOISE, (poses, 3))
    return truing.Measurements(
        joints,
        positions=positions,
        directions=directions,
        orientations=predicted.orientation if orientation else None,
    )


def in_order(poses: int = 220) -> truing.Measurements:
    """The verdict "effects", with the approach directions of poses driven to one after the other."""
    base = measured("effects", poses=poses)
    joints = np.array(base.joints)
    directions = np.ones_like(joints)
    directions[1:] = np.sign(np.diff(joints, axis=0))
    true = truing.load_robot(ROBOT)
    true.effects = [AppliedEffect("backlash", ["J3"], {"backlash.J3": 1e-3})]
    predicted = truing.predict(true, truing.Measurements(joints, directions=directions))
    positions = np.asarray(predicted.position) + np.random.default_rng(11).normal(0, NOISE, (poses, 3))
    return truing.Measurements(joints, positions=positions, directions=directions)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(data: truing.Measurements) -> str:
    truing.save_measurements("data.csv", data, truing.load_robot(ROBOT))
    return "data.csv"


def diagnosed(data: truing.Measurements, *options: str) -> dict[str, Any]:
    assert main(["diagnose", ROBOT, written(data), "--out", "found", *options]) == 0
    result: dict[str, Any] = json.loads(Path("found/result.json").read_text())
    return result


def columns(path: str) -> dict[str, list[str]]:
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [row[k] for row in rows[1:]] for k, name in enumerate(rows[0])}


# ---- The contract of result.json -----------------------------------------------------------------

NUMBER = (int, float)
TEXTS, NUMBERS = [str], [NUMBER]
MAYBE = (int, float, type(None))
CI = [NUMBER, NUMBER]
CURVES = [
    {
        "site": str,
        "input": str,
        "input_unit": str,
        "second": (dict, type(None)),
        "unit": str,
        "points": [[NUMBER]],
        "samples": [[NUMBER]],
    }
]
HELD_OUT = {"before_rms_m": NUMBER, "after_rms_m": NUMBER, "shrink": NUMBER, "ci": CI, "n": int}
PARAMETER = {"name": str, "value": NUMBER, "sigma": MAYBE, "unit": str}
ALTERNATIVE = {"effect": str, "joints": TEXTS, "probability": NUMBER, "separated_by": str}
EFFECT = {
    "effect": str,
    "joints": TEXTS,
    "probability": NUMBER,
    "parameters": [PARAMETER],
    "held_out": HELD_OUT,
    "size_at_tip_m": NUMBER,
    "share": NUMBER,
    "share_alone": NUMBER,
    "share_last": NUMBER,
    "confounded_with": [ALTERNATIVE],
    "note": str,
    "identify_as": str,
    "curves": CURVES,
}
UNKNOWN = {
    "joint": str,
    "inputs": TEXTS,
    "probability": NUMBER,
    "held_out": HELD_OUT,
    "size_at_tip_m": NUMBER,
    "share": NUMBER,
    "curve": [[NUMBER]],
    "curves": CURVES,
    "looks_like": str,
}
CANDIDATE = {
    "effect": str,
    "joints": TEXTS,
    "columns": int,
    "gain": MAYBE,
    "evidence": MAYBE,
    "held_out_gain": MAYBE,
    "largest_z": MAYBE,
}
CONTRACT = {
    "format": str,
    "version": str,
    "robot": str,
    "verdict": str,
    "explained": str,
    "sentence": str,
    "gap": {
        "rms_m": NUMBER,
        "p95_m": NUMBER,
        "max_m": NUMBER,
        "noise_floor_m": NUMBER,
        "closable": NUMBER,
        "noise_from_repeats": bool,
        "p": NUMBER,
        "parts": {"noise": NUMBER, "effects": NUMBERS, "unknown": NUMBERS, "unexplained": NUMBER},
    },
    "where": {
        "joints": [{"joint": str, "share": NUMBER, "ci": CI}],
        "inputs": [{"input": str, "share": NUMBER}],
        "workspace": [{"center_m": [NUMBER], "rms_m": NUMBER, "n": int}],
        "direction": [{"axis": NUMBERS, "rms_m": NUMBER}],
    },
    "effects": [EFFECT],
    "unknown": [UNKNOWN],
    "after": {"rms_m": NUMBER, "remaining_structure_p": MAYBE},
    "after_unknown": {"rms_m": NUMBER, "n": int},
    "after_robot_with_unknown": (dict, type(None)),
    "shrink": {"value": NUMBER, "ci": CI},
    "held_out_fall": {"poses": int, "mean_m": NUMBER, "sigma_m": NUMBER, "probability": NUMBER},
    "not_testable": [{"effect": str, "joints": TEXTS, "why": str}],
    "detectable": [
        {"effect": str, "joint": str, "parameter": str, "unit": str, "size": NUMBER, "size_at_tip_m": NUMBER}
    ],
    "candidates": [CANDIDATE],
    "sanity": [{"kind": str, "text": str, "rows": [int]}],
    "next_measurements": [{"joints": NUMBERS, "direction": [int], "payload_kg": MAYBE, "why": str}],
    "nearest_neighbour": {"p95_m": MAYBE, "share": MAYBE},
    "joint_record": str,
    "rows": int,
    "outliers": [int],
    "seed": int,
    "warnings": TEXTS,
}


def check(value: Any, wanted: Any, where: str = "result") -> None:
    """That `value` has at least the keys, and everywhere the types, of `wanted`."""
    if isinstance(wanted, dict):
        assert isinstance(value, dict) and set(wanted) <= set(value), (
            f"{where} lacks {set(wanted) - set(value)}"
        )
        for key, inner in wanted.items():
            check(value[key], inner, f"{where}.{key}")
    elif isinstance(wanted, list):
        assert isinstance(value, list), where
        if len(wanted) > 1:
            assert len(value) == len(wanted), where
        for k, item in enumerate(value):
            check(item, wanted[k if len(wanted) > 1 else 0], f"{where}[{k}]")
    else:
        assert isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool)), (
            f"{where} is {value!r}"
        )


def named(effect: dict[str, Any]) -> str:
    """Name in the catalogue: a transmission error is reported with its order, "transmission_error@14"."""
    return str(effect["effect"]).split("@")[0]


@pytest.mark.parametrize("case", CASES)
def test_result_json_keeps_its_contract(case: str) -> None:
    result = diagnosed(measured(case))
    check(result, CONTRACT)
    assert result["format"] == "truing-diagnosis/1"
    known = {name for name, _ in catalogue()}
    for effect in result["effects"]:
        assert named(effect) in known
        assert (
            0 <= effect["probability"] <= 1
            and effect["held_out"]["ci"][0] <= effect["held_out"]["shrink"] <= effect["held_out"]["ci"][1]
        )
    assert {named(a) for e in result["effects"] for a in e["confounded_with"]} <= known
    parts = result["gap"]["parts"]
    assert len(parts["effects"]) == len(result["effects"]) and len(parts["unknown"]) == len(result["unknown"])
    every = [parts["noise"], parts["unexplained"], *parts["effects"], *parts["unknown"]]
    assert sum(every) == pytest.approx(1) and min(every) >= 0
    assert parts["effects"] == [e["share"] for e in result["effects"]] and parts["unknown"] == [
        u["share"] for u in result["unknown"]
    ]
    closed = 1 - (result["after_unknown"]["rms_m"] / result["gap"]["rms_m"]) ** 2
    assert sum(parts["effects"]) + sum(parts["unknown"]) == pytest.approx(max(0.0, closed), abs=1e-9)
    assert result["gap"]["n"] == result["after"]["n"] == result["after_unknown"]["n"] > 0
    for curve in [c for e in [*result["effects"], *result["unknown"]] for c in e["curves"]]:
        assert curve["site"].split(".")[0] in {
            *(joint.name for joint in truing.load_robot(ROBOT).joints),
            "base",
        }
        check(curve["second"] or {}, {"input": str, "unit": str, "range": CI} if curve["second"] else {})


@pytest.mark.parametrize("case", CASES)
def test_the_verdict_is_that_of_the_hidden_truth(case: str) -> None:
    found = truing.diagnose(truing.load_robot(ROBOT), measured(case))
    assert found.verdict == case
    assert bool(found.effects) == case.startswith("effects") and bool(found.unknown) == case.endswith(
        "unknown"
    )
    if case.startswith("effects"):
        assert ("backlash", ("J3",)) in [(e.effect, e.joints) for e in found.effects]
    if case.endswith("unknown"):
        assert found.unknown[0].joint == "J2" and "q2" in found.unknown[0].inputs


# ---- What is written -----------------------------------------------------------------------------


def test_diagnose_writes_its_files_and_says_where_the_report_is(capsys: pytest.CaptureFixture[str]) -> None:
    result = diagnosed(measured("effects"))
    files = {"result.json", "report.html", "robot.yaml", "residuals.csv"} | (
        {"next_poses.csv"} if result["next_measurements"] else set()
    )
    assert {path.name for path in Path("found").iterdir()} == files
    lines = capsys.readouterr().out.strip().splitlines()
    assert lines[-1] == "report: found/report.html"
    assert result["sentence"] in lines


def rms_of_robot_file(data: truing.Measurements) -> float:
    """Of found/robot.yaml, on the rows held out."""
    error = np.linalg.norm(
        np.asarray(truing.residuals(truing.load_robot("found/robot.yaml"), data).position), axis=1
    )
    test = np.array(columns("found/residuals.csv")["set"]) == "test"
    return float(np.sqrt(np.mean(error[test] ** 2)))


@pytest.mark.parametrize("case", CASES)
def test_the_robot_file_holds_what_was_named(case: str) -> None:
    data = measured(case)
    result = diagnosed(data)
    robot = truing.load_robot("found/robot.yaml")
    stands_for = {"gravity_moment": "joint_compliance"}  # where the links' masses are not known
    assert {stands_for.get(e.effect, e.effect) for e in robot.effects} <= {
        e["effect"] for e in result["effects"]
    }
    rms = rms_of_robot_file(data)
    assert result["shrink"]["value"] == pytest.approx(1 - rms / result["gap"]["rms_m"], abs=1e-6)
    assert yaml.safe_load(Path("found/robot.yaml").read_text())["calibration"]["rms_m"] == pytest.approx(
        rms, rel=1e-6
    )
    if case == "effects":  # neither drifts nor corrections of laws: the robot is all that was named
        assert rms == pytest.approx(result["after"]["rms_m"], rel=1e-6)


def test_a_robot_that_has_the_unknown_as_tables_leaves_what_is_said(
    capsys: pytest.CaptureFixture[str],
) -> None:
    data = measured("effects+unknown")
    result = diagnosed(data)
    assert "robot_with_unknown.yaml" in capsys.readouterr().out
    assert "robot_with_unknown.yaml" in Path("found/report.html").read_text()
    robot = truing.load_robot("found/robot_with_unknown.yaml")
    held_out = np.array(columns("found/residuals.csv")["set"]) == "test"
    left = np.asarray(truing.predict(robot, data).position) - np.asarray(data.positions)
    rms = np.sqrt(np.mean(np.sum(left[held_out] ** 2, axis=1)))
    said = result["after_robot_with_unknown"]["rms_m"]
    assert rms == pytest.approx(said, rel=1e-5) and said == pytest.approx(
        result["after_unknown"]["rms_m"], rel=0.02
    )
    assert said < 0.5 * result["after"]["rms_m"]  # of robot.yaml


def test_the_real_robot_reaches_its_targets_where_commands_go_by_the_tables() -> None:
    diagnosed(measured("unknown", orientation=True))
    nominal, found = truing.load_robot(ROBOT), truing.load_robot("found/robot_with_unknown.yaml")
    wanted = random_joints(nominal, 20, 5)
    targets = truing.predict(nominal, truing.Measurements(wanted))
    commands = truing.compensate(nominal, found, wanted, program=True, in_base=True)
    moved = np.array(commands.solutions.joints)
    moved[:, 1] += np.where(moved[:, 1] > 0.41, 6e-4, -6e-4)
    real = truing.predict(nominal, truing.Measurements(moved))
    assert np.median(np.linalg.norm(real.position - targets.position, axis=1)) < 1e-4


@pytest.mark.parametrize("case", ["none", "effects"])
def test_without_anything_unknown_there_are_no_tables(case: str) -> None:
    Path("found").mkdir()
    Path("found/robot_with_unknown.yaml").write_text("of an earlier run")
    result = diagnosed(measured(case))
    assert result["after_robot_with_unknown"] is None and not Path("found/robot_with_unknown.yaml").exists()


def test_what_nothing_describes_is_unknown_without_joint_and_input(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rng = np.random.default_rng(31)
    robot = truing.load_robot(ROBOT)
    joints = np.repeat(random_joints(robot, 80, 9), 3, axis=0)
    places = np.asarray(truing.predict(robot, truing.Measurements(joints)).position) + np.repeat(
        rng.normal(0, 1.5e-4, (80, 3)), 3, axis=0
    )
    data = truing.Measurements(
        joints, positions=places + rng.normal(0, 2e-5, places.shape), directions=np.ones_like(joints)
    )
    result = diagnosed(data)
    check(result, CONTRACT)
    assert result["verdict"] == "unknown" and "Repeats show a noise of" in result["sentence"]
    (unknown,) = result["unknown"]
    assert unknown["joint"] == "" and unknown["inputs"] == [] and unknown["curves"] == []
    assert "unknown somewhere" in capsys.readouterr().out
    page = Path("found/report.html").read_text()
    assert "Unknown somewhere <" in page
    assert "unknown, somewhere: no function" in truing.diagnose(robot, data).summary()


def test_directions_that_were_inferred_are_written_and_serve_the_robot_file() -> None:
    data = in_order()
    given = diagnosed(data)
    assert not any(name.startswith("dir") for name in columns("found/residuals.csv"))
    assert truing.diagnose(truing.load_robot(ROBOT), data).directions is None
    result = diagnosed(data.replace(directions=None))
    assert ("backlash", ["J3"]) in [(e["effect"], e["joints"]) for e in result["effects"]]
    assert any(s["kind"] == "direction" for s in result["sanity"])
    table = columns("found/residuals.csv")
    inferred = np.array([[float(v) for v in table[f"dir{k + 1}"]] for k in range(6)]).T
    assert np.array_equal(inferred[1:], np.asarray(data.directions)[1:])
    assert rms_of_robot_file(data.replace(directions=inferred)) == pytest.approx(
        result["after"]["rms_m"], rel=1e-6
    )
    # The robot file serves on the very data that it came from: the same directions are inferred, and said.
    with pytest.warns(InputWarning, match="inferred from the order of the rows"):
        again = rms_of_robot_file(data.replace(directions=None))
    assert again == pytest.approx(result["after"]["rms_m"], rel=1e-6)
    assert result["after"]["rms_m"] == pytest.approx(given["after"]["rms_m"], rel=0.1)


def test_speeds_that_were_inferred_serve_the_robot_file() -> None:
    robot, time = truing.load_robot(ROBOT), np.arange(0.0, 16.0, 0.02)

    def joints(at: Any) -> Any:
        return np.stack([0.4 * np.sin((0.9 + 0.2 * k) * at + k) - 0.2 * (k == 1) for k in range(6)], axis=1)

    # The tracker's clock is 0.4 ms late. Seed 20.
    seen = truing.predict(robot, truing.Measurements(joints(time - 0.0004))).position
    noisy = np.asarray(seen) + 3e-5 * np.random.default_rng(20).normal(size=(len(time), 3))
    data = truing.Measurements(joints(time), positions=noisy, time=time)
    result = diagnosed(data)
    assert [s["kind"] for s in result["sanity"]] == ["speed", "direction"]
    assert [e["effect"] for e in result["effects"]] == ["time_offset"]
    assert "Look at the data first" not in Path("found/report.html").read_text()
    with pytest.warns(InputWarning, match="joint speeds that the robot's effects need were inferred"):
        again = rms_of_robot_file(data)
    assert again == pytest.approx(result["after"]["rms_m"], rel=1e-6)


def test_rows_beyond_what_effects_were_fitted_on_are_warned_of() -> None:
    data = measured("effects")
    diagnosed(data)
    robot = truing.load_robot("found/robot.yaml")
    assert set(robot.fitted_range) == {f"q{k + 1}" for k in range(6)}
    truing.predict(robot, data)  # the very poses: a warning would be an error
    joints = np.array(data.joints)
    joints[:7, 2] += 9.0
    with pytest.warns(InputWarning, match=r"7 of 220 rows lie beyond the range .* \(q3\)"):
        truing.predict(robot, data.replace(joints=joints))


def test_of_25_poses_that_are_too_few_it_is_said_what_they_can_answer() -> None:
    nominal = truing.load_robot(example("ur10"))
    data = truing.simulate(nominal, poses=25, noise=6e-4, lengths=3e-4, angles=3e-4, seed=30).data
    found = truing.diagnose(nominal, data)
    # Five held-out poses neither condemn wrong links nor confirm them.
    assert found.verdict == "effects" and 0.05 < found.held_out_fall.probability < 0.95
    assert found.sentence.startswith("Held-out poses neither confirm nor contradict what explains the others")
    said = re.search(
        r" can answer is whether a single effect makes the gap: (.*) would show from (.*) mm at the tip on\.",
        found.sentence,
    )
    assert said is not None
    asked, shown = said.groups()
    traits = {effect.name: effect.traits for effect in catalogue_effects()}
    small = [
        d
        for d in found.detectable
        if d.size_at_tip < found.gap.rms
        and (not traits[d.effect].plausible or d.size <= traits[d.effect].plausible)
    ]
    names = {d.effect.replace("_", " ") for d in small}
    named = {name for effect in traits if (name := effect.replace("_", " ")) in asked}
    assert 5 <= len(named) < len(names) and named <= names
    assert asked.endswith(f" and {len(names) - 5} more")
    assert float(shown) == pytest.approx(1e3 * max(d.size_at_tip for d in small), rel=0.01)


def test_links_that_few_poses_do_not_see_stay_about_nominal() -> None:
    """Where the wrist hardly moved, all four were worse than nominal elsewhere, 1.25 to 1.7 times."""
    nominal = truing.load_robot(example("ur10"))

    def ratio(seed: int) -> float:
        """Errors of poses anywhere by the robot file, to those with base and tool alone."""
        rng = np.random.default_rng(seed)
        joints = rng.uniform(-1.5, 1.5, (25, 6))
        joints[:, 4:] = 0.4 + rng.uniform(-0.02, 0.02, (25, 2))
        few = truing.simulate(nominal, joints=joints, noise=3e-4, seed=seed).data
        anywhere = rng.uniform(-1.5, 1.5, (200, 6))
        fresh = truing.simulate(nominal, joints=anywhere, noise=1e-9, seed=seed).data
        found = truing.diagnose(nominal, few)
        before, after = (
            float(np.linalg.norm(truing.residuals(robot, fresh).position))
            for robot in (found.robot_before, found.robot)
        )
        return after / before

    ratios = [ratio(seed) for seed in range(4)]
    assert sum(one < 1.0 for one in ratios) >= 3
    assert np.exp(np.mean(np.log(ratios))) < 1.0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_target_that_is_barely_seen_does_not_run_away_with_an_effect(seed: int) -> None:
    """The tool hardly turns, and frames alone take it to where the backlash has another lever. What that
    left was called a coupling and a function of the direction.
    """
    nominal = truing.load_robot(example("ur10"))
    nominal = nominal.replace(
        joints=[j.replace(mass=None, center_of_mass=np.zeros(3)) for j in nominal.joints]
    )
    rng = np.random.default_rng(seed)
    joints = np.array([0.0, -1.2, 1.6, 0.0, -np.pi / 2, 0.0]) + rng.uniform(-0.4, 0.4, (150, 6)) * (
        np.arange(6) < 3
    )
    joints[:, 3] = -np.pi / 2 - joints[:, 1] - joints[:, 2]
    joints[:, 5] = joints[:, 0]
    joints[:, 3:] += rng.uniform(-1e-3, 1e-3, (150, 3))
    effects = {"backlash.wrist_2": 3.5e-3}
    data = truing.simulate(
        nominal,
        joints=joints,
        effects=effects,
        noise=4e-5,
        lengths=0.0,
        angles=0.0,
        columns=["dir"],
        seed=seed,
    ).data
    found = truing.diagnose(nominal, data)
    assert [(e.effect, list(e.joints)) for e in found.effects] == [("backlash", ["wrist_2"])]
    assert not found.unknown


@pytest.mark.parametrize(
    ("joint", "place", "size", "seed"), [(4, -0.2269, 1.777e-4, 2), (3, -0.1176, 1.971e-4, 4)]
)
def test_a_name_that_a_step_explains_as_well_is_not_certain(
    joint: int, place: float, size: float, seed: int
) -> None:
    nominal = truing.load_robot(example("ur10"))
    data = truing.simulate(nominal, poses=160, noise=3e-5, lengths=0.0, angles=0.0, seed=seed).data
    read = np.array(data.joints)
    read[:, joint] -= size * (read[:, joint] > place)
    found = truing.diagnose(nominal, data.replace(joints=read))
    assert found.effects or found.verdict == "unknown"
    assert all(effect.probability <= 0.9 for effect in found.effects)


def test_what_held_out_poses_contradict_ends_with_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    right = measured("effects")
    # The rows held out have the backlash the other way round.
    wrong = np.array(right.positions)
    nominal = truing.load_robot(ROBOT)
    true = nominal.copy()
    true.T_measurement_base = truing.frame_from_xyz_rpy([0.4, -1.6, 0.3], [0.01, -0.02, 0.8])
    no_effect = np.asarray(truing.predict(true, right).position)
    test = np.arange(220) % 4 == 0
    wrong[test] = 2.0 * no_effect[test] - wrong[test]
    data = right.replace(positions=wrong, set=test.astype(np.int8))
    assert main(["diagnose", ROBOT, written(data), "--out", "found"]) == 1
    result = json.loads(Path("found/result.json").read_text())
    assert result["verdict"] == "does_not_hold"
    assert result["after"]["rms_m"] > result["gap"]["rms_m"]
    assert truing.load_robot("found/robot.yaml").effects == ()
    assert "does not hold" in capsys.readouterr().err
    assert "does not hold" in Path("found/report.html").read_text()


def test_residuals_tell_the_same_as_result_json() -> None:
    result = diagnosed(measured("effects", orientation=True))
    table = columns("found/residuals.csv")
    assert {"row", "set", "pose", "outlier", "q1_rad", "x_m"} <= set(table)
    assert [int(row) for row in table["row"]] == list(range(220))
    assert [k for k, out in enumerate(table["outlier"]) if out == "1"] == sorted(result["outliers"])
    chosen = [k for k in range(220) if table["set"][k] == "test"]
    for when, expected in (("before", result["gap"]), ("after", result["after"])):
        error = np.array([[float(table[f"error_{when}_{axis}_m"][k]) for axis in "xyz"] for k in chosen])
        assert np.sqrt(np.mean(np.sum(error**2, axis=1))) == pytest.approx(expected["rms_m"], rel=1e-6)
        rotation = np.array(
            [[float(table[f"rotation_error_{when}_{axis}_rad"][k]) for axis in "xyz"] for k in range(220)]
        )
        assert np.isfinite(rotation).all()


def test_the_same_seed_writes_the_same_result() -> None:
    data = measured("effects")
    first = diagnosed(data, "--seed", "3")
    report = Path("found/report.html").read_bytes()
    assert diagnosed(data, "--seed", "3", "--threads", "1") == first
    assert first["seed"] == 3
    assert Path("found/report.html").read_bytes() == report


def test_json_is_all_that_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    result = diagnosed(measured("effects"), "--json")
    assert json.loads(capsys.readouterr().out) == result


def test_the_report_has_the_sentence() -> None:
    result = diagnosed(measured("effects+unknown"))
    page = Path("found/report.html").read_text()
    assert f"{1e3 * result['gap']['rms_m']:.3g} mm" in page and "backlash at J3" in page


def test_next_poses_of_an_earlier_run_do_not_stay() -> None:
    Path("found").mkdir()
    Path("found/next_poses.csv").write_text("old")
    Path("found/mine.txt").write_text("mine")
    result = diagnosed(measured("none"))
    assert Path("found/mine.txt").exists()
    assert Path("found/next_poses.csv").exists() == bool(result["next_measurements"])


# ---- Bad and odd input ---------------------------------------------------------------------------

BAD = [
    ["diagnose"],
    ["diagnose", ROBOT],
    ["diagnose", ROBOT, "missing.csv"],
    ["diagnose", ROBOT, ROBOT],
    ["diagnose", "palletizer", "DATA"],
    ["diagnose", ROBOT, "UNMEASURED"],
    ["diagnose", ROBOT, "DATA", "--leave-out", "slack"],
    ["diagnose", ROBOT, "DATA", "--false-alarm", "2"],
    ["diagnose", ROBOT, "DATA", "--false-alarm", "0%"],
    ["diagnose", ROBOT, "DATA", "--seed", "-1"],
    ["diagnose", ROBOT, "DATA", "--record", "qr"],
    ["diagnose", ROBOT, "DATA", "--record", "u"],
]


@pytest.mark.parametrize("arguments", BAD, ids=[" ".join(a).replace(ROBOT, "ROBOT") for a in BAD])
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    files = {"palletizer": str(example("palletizer")), "DATA": "data.csv", "UNMEASURED": "joints.csv"}
    data = measured("none", poses=60)
    written(data)
    truing.save_measurements("joints.csv", truing.Measurements(data.joints), truing.load_robot(ROBOT))
    before = sorted(Path().iterdir())
    code = main([files.get(argument, argument) for argument in arguments])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert captured.err.startswith("truing: ") and captured.err.count("\n") == 1
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize("poses", [3, 20])
def test_few_poses_are_answered_or_refused_clearly(poses: int, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["diagnose", ROBOT, written(measured("effects", poses=poses)), "--out", "found"])
    captured = capsys.readouterr()
    if code == 0:
        check(json.loads(Path("found/result.json").read_text()), CONTRACT)
    else:
        assert code == 2
        assert (
            captured.err.startswith("truing: ") and captured.err.count("\n") == 1 and "poses" in captured.err
        )
        assert not Path("found").exists()


def test_an_empty_optional_column_is_named_and_ignored() -> None:
    data = measured("effects")
    nothing = np.full(data.rows, math.nan)
    found = truing.diagnose(truing.load_robot(ROBOT), data.replace(temperature=nothing))
    assert found.verdict == truing.diagnose(truing.load_robot(ROBOT), data).verdict
    assert any("temp" in n.why for n in found.not_testable if n.effect == "thermal")


def test_an_empty_column_of_ones_own_does_no_harm() -> None:
    data = measured("effects")
    found = truing.diagnose(
        truing.load_robot(ROBOT), data.replace(covariates={"humidity": np.full(data.rows, math.nan)})
    )
    assert ("backlash", ("J3",)) in [(e.effect, e.joints) for e in found.effects]


def test_a_missing_column_is_not_testable_and_says_so() -> None:
    result = diagnosed(measured("effects"))
    why = {n["effect"]: n["why"] for n in result["not_testable"]}
    assert "temp_C" in why["thermal"]


def test_the_second_record_of_the_joints_can_be_used() -> None:
    data = measured("effects")
    wrong = data.replace(
        joints=np.asarray(data.joints) + 0.01,
        covariates={f"qr{k + 1}_rad": np.asarray(data.joints)[:, k] for k in range(6)},
    )
    by_second = diagnosed(wrong, "--record", "qr")
    assert by_second["gap"]["rms_m"] == pytest.approx(diagnosed(data)["gap"]["rms_m"], rel=1e-6)


# ---- From Python ---------------------------------------------------------------------------------


def test_an_unknown_option_raises() -> None:
    with pytest.raises(TypeError, match="Did you mean 'false_alarm'"):
        truing.diagnose(truing.load_robot(ROBOT), measured("unknown"), false_alarms=0.1)  # type: ignore[call-arg]


def test_an_effect_of_ones_own_takes_part() -> None:
    robot, data = truing.load_robot(ROBOT), measured("unknown")
    found = truing.diagnose(robot, data, effects=OWN)
    assert found.effects and found.effects[0].effect == "jump"
    value = {p.name: p for p in found.effects[0].parameters}["jump.J2"]
    assert value.value == pytest.approx(6e-4, abs=5 * value.sigma + 5e-5)
    assert "jump" in {c.effect for c in found.candidates}


def hanging(effect: AppliedEffect) -> truing.Measurements:
    """Of a robot with heavy links, light and loaded, while its joint or its axis gives way."""
    rng = np.random.default_rng(23)
    true = truing.load_robot(ROBOT)
    for joint in true.joints:
        joint.mass, joint.center_of_mass = 4.0, [0.05, -0.08, 0.06]
    true.T_measurement_base = truing.frame_from_xyz_rpy([0.4, -1.6, 0.3], [0.01, -0.02, 0.8])
    true.effects = [effect]
    inputs = {
        "directions": rng.choice([-1.0, 1.0], size=(220, 6)),
        "payload": rng.choice([0.0, 3.0], size=220),
    }
    joints = random_joints(true, 220, 5)
    predicted = truing.predict(true, truing.Measurements(joints, **inputs))
    return truing.Measurements(
        joints, positions=np.asarray(predicted.position) + rng.normal(0, NOISE, (220, 3)), **inputs
    )


@pytest.mark.parametrize(
    ("applied", "asked"),
    [
        (
            AppliedEffect("joint_compliance", ["J2"], {"joint_compliance.J2": 6e-5}),
            "gravity_moment:J2,joint_compliance:J2",
        ),
        (AppliedEffect("backlash", ["J3"], {"backlash.J3": 1e-3}), "backlash:J3"),
        (AppliedEffect("scale", [], {"scale": 1e-3}), "scale"),
    ],
)
def test_identify_takes_what_was_named(applied: AppliedEffect, asked: str) -> None:
    robot, data = truing.load_robot(ROBOT), hanging(applied)  # no masses are known
    found = truing.diagnose(robot, data)
    asked_for = {e.effect: e.identify_as for e in found.effects}
    assert asked_for[applied.effect] == asked
    for text in asked_for.values():
        assert truing.identify(robot, data, free="tool.*", effects=text).test.after.rms < 0.9 * found.gap.rms


@pytest.mark.parametrize("hangs", [False, True])
def test_a_joint_that_gives_way_upwards_is_asked_whether_the_robot_hangs(hangs: bool) -> None:
    robot = truing.load_robot(ROBOT)
    centers = ([0, -0.02, 0], [-0.135, 0, 0], [-0.02, 0, 0.03], [0, -0.1, 0], [0, 0, 0], [0, 0, -0.01])
    for joint, mass, center in zip(robot.joints, (6, 4, 5, 2, 1, 0.5), centers, strict=True):
        joint.mass, joint.center_of_mass = mass, center
    true = robot.copy()
    true.gravity = [0.0, 0.0, 9.81 if hangs else -9.81]
    true.effects = [AppliedEffect("joint_compliance", ["J2"], {"joint_compliance.J2": 3e-5})]
    joints = random_joints(robot, 220, 4)
    positions = np.asarray(truing.predict(true, truing.Measurements(joints)).position)
    noise = np.random.default_rng(6).normal(0, NOISE, (220, 3))
    found = truing.diagnose(robot, truing.Measurements(joints, positions=positions + noise))
    (effect,) = [e for e in found.effects if e.effect == "joint_compliance"]
    assert np.sign(effect.parameters[0].value) == (-1.0 if hangs else 1.0)
    assert any("joint_compliance.J2 is below zero" in text for text in found.warnings) == hangs


def test_an_effect_that_is_left_out_is_not_considered() -> None:
    robot, data = truing.load_robot(ROBOT), measured("effects")
    found = truing.diagnose(robot, data, leave_out="backlash")
    assert "backlash" not in {e.effect for e in found.effects} | {c.effect for c in found.candidates}
    assert found.verdict != "none"


def test_what_is_handed_out_has_shapes_and_cannot_be_changed() -> None:
    data = measured("effects")
    found = truing.diagnose(truing.load_robot(ROBOT), data)
    assert found.error_before.shape == found.error_after.shape == (data.rows,)
    assert found.set.shape == (data.rows,) and set(found.set) == {0, 1}
    assert found.residuals_before.position.shape == (data.rows, 3)
    assert found.direction.shape == (3, 3) and found.direction_rms.shape == (3,)
    with pytest.raises(ValueError, match="read-only"):
        found.error_before[0] = 0.0
    for curve in [c for e in found.effects for c in e.curves]:
        assert curve.points.shape[1] == 3 and curve.samples.shape[1] == 2
    assert found.after_unknown.n == found.after.n and found.directions is None
    assert "Diagnosis('" in repr(found) and found.sentence in found.summary()


def bent(name: str, joint: int, motion: Any, *, poses: int, noise: float, seed: int) -> truing.Diagnosis:
    """One joint moves by a function of the angles that no catalogue has. `noise`: of the size at the tip."""
    robot = truing.load_robot(str(example(name)))
    rng = np.random.default_rng(seed)
    low = [max(j.lower, -2.8) for j in robot.joints]
    joints = rng.uniform(low, [min(j.upper, 2.8) for j in robot.joints], (poses, len(low)))
    moved = joints.copy()
    moved[:, joint] += 2e-3 * motion(joints)
    there, here = (
        np.asarray(truing.predict(robot, truing.Measurements(q)).position) for q in (moved, joints)
    )
    sigma = noise * np.linalg.norm(there - here, axis=1).std()
    positions = there + rng.normal(0, sigma, there.shape)
    return truing.diagnose(robot, truing.Measurements(joints, positions=positions))


@functools.cache
def bent_beside_its_neighbour() -> truing.Diagnosis:
    """J3 moves by a bump of the angle of J2."""
    bump = lambda q: np.exp(-0.5 * ((q[:, 1] - 0.2) / 0.4) ** 2)  # noqa: E731
    return bent("irb120", 2, bump, poses=150, noise=0.08, seed=1)


def test_of_unknown_functions_the_one_that_does_most_is_told_first() -> None:
    found = bent_beside_its_neighbour()
    assert [(u.joint, u.inputs) for u in found.unknown[:1]] == [("J3", ("q2",))]
    assert "Unknown: J3 moves as a function of q2" in found.sentence


def test_what_is_told_as_unknown_does_not_count_as_named() -> None:
    """Beside the bump stands a function of J2, in the place of a law: alone it makes errors larger."""
    found = bent_beside_its_neighbour()
    assert not found.effects and found.verdict == "unknown"
    assert found.after.rms == found.gap.rms and found.after_unknown.rms < 0.3 * found.gap.rms


def test_what_corrects_a_law_is_said_and_drawn_once() -> None:
    found = bent("ur10", 0, lambda q: q[:, 0] > 0.3, poses=230, noise=0.125, seed=7)
    assert any("not the simple one" in effect.note and effect.curves for effect in found.effects)
    for effect in found.effects:
        said, drawn = effect.note.split("; "), [(c.site, c.input, c.second_input) for c in effect.curves]
        assert len(said) == len(set(said)) and len(drawn) == len(set(drawn))


def test_the_names_of_the_results_are_public() -> None:
    for name in (
        "DiagnoseOptions",
        "Diagnosis",
        "FoundEffect",
        "UnknownEffect",
        "Alternative",
        "Curve",
        "NotTestable",
        "Detectable",
        "Candidate",
        "SanityFinding",
        "WhereJoint",
        "WhereInput",
        "WorkspaceCell",
        "NextPose",
        "Share",
        "diagnose",
    ):
        room = truing.common if name == "NotTestable" else truing.diagnosis
        assert getattr(room, name).__doc__


# ---- The examination -----------------------------------------------------------------------------


def test_without_mujoco_the_examination_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [
        name for name in sys.modules if name == "truing.exam" or name.startswith(("truing.exam.", "mujoco"))
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert main(["exam", "--quick", "--out", "found"]) == 2
    captured = capsys.readouterr()
    assert 'pip install "truing[exam]"' in captured.err and captured.err.count("\n") == 1
    assert not Path("found").exists()


def test_a_second_diagnosis_finds_the_memory_that_the_first_one_freed() -> None:
    """The C library would give it back to the system, and take it anew page by page."""
    told = any(name.startswith(("MALLOC_", "GLIBC_TUNABLES")) for name in os.environ)
    if platform.libc_ver()[0] != "glibc" or told:
        pytest.skip("memory is kept where the C library is glibc, and nobody told it otherwise")
    robot, data = truing.load_robot(ROBOT), measured("effects")
    faults = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        truing.diagnose(robot, data, threads=1)
        faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
    assert min(faults[1:]) < 10_000, faults  # pages; 37 000 before
