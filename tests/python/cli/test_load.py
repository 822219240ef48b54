# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing load`, and files of controllers where other commands ask for ROBOT."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truing
from truing.cli import main

CONF = """[mounting]
delta_theta = [ 2.0775e-05, 0.96821571555565844, -1.85685385014877657, 0.888647901450376643, 6e-05, -7e-05]
delta_a = [ 0.000393621, 0.184093300397451837, 0.14493953300732923, -6.43297403642e-05, 7.767e-06, 0]
delta_d = [ 4.00263e-05, 278.244144925623573, -183.695513914913732, -94.5471513669751289, 0.0003, 0.0001]
delta_alpha = [ -0.00027, 0.00125856505456124, -0.00322052070697146503, 0.00065153016530384, -0.0006, 0]
joint_raw_offset = [ 3.7, 3.7, -3.1, 2.3, 2.3, 2.3]
"""


@pytest.fixture
def conf(tmp_path: Path) -> Path:
    path = tmp_path / "calibration.conf"
    path.write_text(CONF, encoding="utf-8")
    return path


def test_what_was_understood_and_what_was_not_is_shown_and_written(
    conf: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = conf.with_name("controller.yaml")
    assert main(["load", str(conf), "--arm", "ur5", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "+278.244 m" in said
    assert "not understood: joint_raw_offset (line 6)" in said
    assert truing.load_robot(out).joints[1].a == pytest.approx(-0.425, abs=1e-3)


def test_two_files_are_compared(conf: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = conf.with_name("one.yaml")
    assert main(["load", f"{conf}@ur5", "--out", str(out)]) == 0
    capsys.readouterr()
    other = conf.with_name("other.yaml")
    assert main(["load", str(conf), str(out), "--arm", "ur5", "--out", str(other), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["apart_m"] == [0.0]
    assert main(["load", f"{conf}@ur5", f"{conf}@ur5e", "--json", "--out", str(out)]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [file["arm"] for file in result["files"]] == ["ur5", "ur5e"]
    assert 0.05 < result["apart_m"][0] < 0.2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["calibration.conf"], "does not say which arm"),
        (["gone.conf"], "No such file"),
        (["calibration.conf@ur5", "--out", "calibration.conf"], "is an input of this run"),
        (["calibration.conf@ur5", "--out", "no/folder.yaml"], "cannot be written"),
        (["calibration.conf@ur5", "calibration.conf"], "does not say which arm"),
        (["robot.yaml", "--arm", "ur5"], "--arm ur5: names the arm of a controller's file"),
    ],
)
def test_nothing_is_written_of_bad_input(
    conf: Path,
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(conf.parent)
    assert main(["load", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert sorted(path.name for path in conf.parent.iterdir()) == ["calibration.conf"]
    assert conf.read_text(encoding="utf-8") == CONF


def test_a_controller_s_file_is_a_robot_for_other_commands(conf: Path) -> None:
    folder = conf.parent
    simulated = folder / "simulated"
    assert main(["simulate", f"{conf}@ur5", "--poses", "60", "--out", str(simulated)]) == 0
    data = str(simulated / "measurements.csv")
    assert main(["identify", f"{conf}@ur5", data, "--large-errors", "--out", str(folder / "found")]) == 0
    assert truing.load_robot(folder / "found" / "robot.yaml").convention == "dh"
    assert not (folder / "found" / "robot.urdf").exists()
