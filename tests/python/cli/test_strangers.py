# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a stranger writes on the command line, and into the files that it names: one line that says where,
what was found, and what to do; nothing is passed over.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from truing.cli import main
from truing.examples import example

ROBOT = example("irb120").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The line with which a command refuses; nothing is printed or written."""
    before = sorted(Path().rglob("*"))
    assert main(list(arguments)) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("truing: ") and said.err.count("\n") == 1, said
    assert sorted(Path().rglob("*")) == before
    return said.err


# ---- Effects in a robot file -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "where"),
    [
        (
            "effects: [{effect: backlahs, joints: [J1], parameters: {backlash.J1: 1e-4}}]",
            "effects[0] (backlahs) effect: there is no effect 'backlahs'; did you mean 'backlash'? there are",
        ),
        (
            "effects: [{effect: backlash, joints: [J1], parameters: {backlash.J2: 1e-4}}]",
            "effects[0] (backlash): effect 'backlash' has a value 'backlash.J2', which its law does not look"
            " at (did you mean 'backlash.J1'?)",
        ),
        (
            "torque_effects: [{effect: coulomb, joints: [J1, J2],"
            " parameters: {coulomb.J1: 1, coulom.J2: 1}}]",
            "torque_effects[0] (coulomb): effect 'coulomb' has a value 'coulom.J2'",
        ),
    ],
)
def test_an_effect_that_would_do_nothing_is_refused_at_its_line(
    entry: str, where: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("arm.yaml").write_text(f"{ROBOT}{entry}\n", encoding="utf-8")
    said = refusal(capsys, "simulate", "arm.yaml", "--out", "out")
    line = ROBOT.count("\n") + 1
    assert f"arm.yaml, line {line}: {where}" in said


def test_an_effect_on_torques_that_is_none_is_refused_where_torques_count(
    capsys: pytest.CaptureFixture[str],
) -> None:
    entry = "torque_effects: [{effect: coulom, joints: [J1], parameters: {coulom.J1: 1}}]"
    Path("arm.yaml").write_text(f"{ROBOT}{entry}\n", encoding="utf-8")
    said = refusal(capsys, "dynamics", "predict", "arm.yaml", "none.csv", "--out", "out")
    assert "there is no effect 'coulom'; did you mean 'coulomb'?" in said and "arm.yaml, line" in said
    assert (
        main(["simulate", "arm.yaml", "--poses", "5", "--out", "out"]) == 0
    )  # poses know nothing of torques


# ---- Options ---------------------------------------------------------------------------------------


def test_a_name_that_is_almost_one_is_answered_with_that_one(capsys: pytest.CaptureFixture[str]) -> None:
    Path("arm.yaml").write_text(ROBOT, encoding="utf-8")
    assert "did you mean 'identify'?" in refusal(capsys, "identfy", "arm.yaml")
    assert "did you mean 'diagnose'?" in refusal(capsys, "dynamics", "dignose")
    assert main(["simulate", "arm.yaml", "--poses", "30", "--out", "sim"]) == 0
    capsys.readouterr()
    for option, word, meant in (("--free", "J1.alhpa", "J1.alpha"), ("--effects", "backlahs", "backlash")):
        arguments = ("identify", "arm.yaml", "sim/measurements.csv", option, word, "--out", "out")
        assert f"'{word}'" in (said := refusal(capsys, *arguments)) and f"did you mean '{meant}'?" in said


def test_an_empty_path_is_no_folder(capsys: pytest.CaptureFixture[str]) -> None:
    Path("arm.yaml").write_text(ROBOT, encoding="utf-8")
    assert "--out: found '', expected a path" in refusal(capsys, "simulate", "arm.yaml", "--out", "")


def test_a_name_that_is_too_long_for_the_disk_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    Path("arm.yaml").write_text(ROBOT, encoding="utf-8")
    for command in (["simulate", "arm.yaml"], ["load", "arm.yaml"]):
        assert "cannot be written: File name too long" in refusal(capsys, *command, "--out", "x" * 300)


def test_options_of_recordings_need_recordings(capsys: pytest.CaptureFixture[str]) -> None:
    Path("arm.yaml").write_text(
        ROBOT.replace("alpha: ", "mass: 1, com: [0, 0, 0], alpha: "), encoding="utf-8"
    )
    said = refusal(capsys, "dynamics", "plan", "arm.yaml", "--joints", "xyz", "--out", "out")
    assert "--joints: found 'xyz', which is of recordings, and there are none" in said


# ---- What is printed -------------------------------------------------------------------------------


def test_a_row_of_a_table_stays_a_line_in_a_pipe(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert main(["effects"]) == 0
    piped = capsys.readouterr().out.splitlines()
    (row,) = [line for line in piped if line.startswith("  stiffness_zones ")]
    assert row.rstrip().endswith("strain-wave gears")
    monkeypatch.setenv("COLUMNS", "60")
    assert main(["effects"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 60
