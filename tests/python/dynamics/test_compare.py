# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing dynamics compare`: the better model wins, by torque and by motion, and a worse one ends with 1."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from pages import charts_of, visible
from truing.cli import main
from truing.dynamics.comparison import Comparison, compare
from truing.dynamics.export import export
from truing.dynamics.result import recording_columns
from truing.errors import InputWarning
from truing.examples import copy_servo_arm
from truing.files import load_recordings, write_table
from truing.testing.dynamics import SimulatedMotion, simulate_motion


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seconds=10.0, recordings=2, held_out=0)


@pytest.fixture(scope="module")
def files(simulated: SimulatedMotion, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The true robot, one with three times the viscous friction at J3, and an MJCF of the true one."""
    folder = tmp_path_factory.mktemp("models")
    truing.save_robot(folder / "good.yaml", simulated.truth)
    truing.save_robot(folder / "bad.yaml", stiff(simulated))
    export(simulated.truth, "mjcf", folder / "mjcf")
    for recording in simulated.recordings:
        write_table(folder / f"{recording.name}.csv", recording_columns(simulated.nominal, recording))
    return folder


def stiff(simulated: SimulatedMotion) -> truing.Robot:
    robot = simulated.truth.copy()
    effects = list(robot.torque_effects)
    for k, effect in enumerate(effects):
        if "viscous.J3" in effect.parameters:
            effects[k] = truing.model.AppliedEffect("viscous", ["J3"], {"viscous.J3": 21.0})
    robot.torque_effects = effects
    return robot


@pytest.fixture(scope="module")
def found(simulated: SimulatedMotion) -> Comparison:
    return compare(simulated.truth, stiff(simulated), simulated.recordings, windows=16, horizons=(0.1, 0.5))


def test_the_worse_model_is_found_at_its_joint(found: Comparison) -> None:
    assert found.nearer == "A" and found.worse == ["torque", "motion 0.1 s ahead", "motion 0.5 s ahead"]
    assert int(np.argmax(found.torque.joints)) == 2 and int(np.argmax(found.motion[1].joints)) == 2
    assert found.torque.joints[0] == pytest.approx(1.0, abs=1e-6)
    ratio = found.motion[1]
    assert 1.05 < ratio.low < ratio.value < ratio.high
    assert ratio.value == pytest.approx(np.exp(np.mean(np.log(ratio.joints))))


def test_a_model_is_as_good_as_itself(simulated: SimulatedMotion) -> None:
    same = compare(
        simulated.truth, simulated.truth, simulated.recordings, windows=4, horizons=(0.1,), margin=0.0
    )
    assert same.nearer == "neither" and [ratio.value for _, ratio in same.ratios] == [1.0, 1.0]


def arguments(files: Path, a: str, b: str, out: Path) -> list[str]:
    names = [str(files / a), str(files / b)]
    return ["dynamics", "compare", *names, str(files / "motion*.csv"), "--out", str(out)]


def test_exit_status_gates_a_change_of_model(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments(files, "good.yaml", "bad.yaml", tmp_path / "worse")) == 1
    said = capsys.readouterr()
    assert "worse than MODEL_A by more than 5 %: torque, motion 0.1 s ahead" in said.err
    result: dict[str, Any] = json.loads((tmp_path / "worse" / "result.json").read_text())
    assert (result["format"], result["command"], result["nearer"]) == ("truing-dynamics/1", "compare", "A")
    assert result["torque"]["B"]["J3"] > 2.0 * result["torque"]["A"]["J3"]
    assert result["rollout"]["horizon_s"] == [0.1, 0.5, 2.0]
    page = (tmp_path / "worse" / "report.html").read_text(encoding="utf-8")
    assert "B is worse" in visible(page) and result["sentence"] in visible(page)
    chart = charts_of(page)["motion"]
    assert [t["name"] for t in chart["data"] if t["visible"]] == ["measured", "A", "B", "start"]

    assert main(arguments(files, "bad.yaml", "good.yaml", tmp_path / "better")) == 0
    assert json.loads((tmp_path / "better" / "result.json").read_text())["nearer"] == "B"


def test_an_mjcf_is_compared_as_it_is(files: Path, simulated: SimulatedMotion, tmp_path: Path) -> None:
    # Without callbacks.py it lacks the coupling at J5, and nothing at J1.
    status = main([*arguments(files, "good.yaml", "mjcf/demo_arm.xml", tmp_path / "o"), "--margin", "10%"])
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    assert status == 1 and result["margin"] == pytest.approx(0.1)
    ratios = result["ratios"][0]["joints"]
    assert max(ratios, key=lambda joint: ratios[joint]) == "J5"
    assert ratios["J1"] == pytest.approx(1.0, abs=0.05)


def refused(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert not out.exists() and said.count("\n") == 1, said
    return said


def test_models_that_cannot_be_compared_are_refused(
    files: Path, simulated: SimulatedMotion, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "o"
    five = simulated.nominal.replace(joints=list(simulated.nominal.joints)[:5])
    truing.save_robot(files / "five.yaml", five)
    assert "expected the same number" in refused(arguments(files, "good.yaml", "five.yaml", out), out, capsys)
    assert "nowhere.yaml" in refused(arguments(files, "good.yaml", "nowhere.yaml", out), out, capsys)
    said = refused([*arguments(files, "good.yaml", "bad.yaml", out), "--margin", "5"], out, capsys)
    assert "--margin: found '5'" in said


def test_servos_are_not_compared_on_commands_with_another_sign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = copy_servo_arm(tmp_path / "arm") / "arm.xml"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # the jaw is left out
        robot = truing.load_robot(arm, any_tool=True, tip_link="gripper")
        motion = load_recordings([arm.parent / "recordings"], robot, units="deg")[0]
    n, out = motion.position.shape[1], tmp_path / "o"
    for name, factor in (("wrong", -1.0), ("right", 180.0 / np.pi)):
        command = factor * np.asarray(motion.command)
        columns = {"t_s": motion.time}
        columns |= {f"q{k + 1}_rad": motion.position[:, k] for k in range(n)}
        columns |= {f"u{k + 1}_rad": command[:, k] for k in range(n)}
        write_table(tmp_path / f"{name}.csv", columns)
    typed = ["dynamics", "compare", str(arm), str(arm), "--tip-link", "gripper"]
    assert main([*typed, str(tmp_path / "wrong.csv"), "--out", str(out)]) == 2 and not out.exists()
    assert "goes the other way than it is sent" in capsys.readouterr().err.splitlines()[-1]
    assert main([*typed, str(tmp_path / "right.csv"), "--out", str(out)]) == 0
    assert "warning: commands are in deg, not in rad" in capsys.readouterr().err
