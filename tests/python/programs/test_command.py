# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing apply`: copies, result and table, and what it refuses in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import truing
from program_corpus import CORPUS, applied, options
from program_robots import built, nominal
from truing import InputError
from truing.cli.app import main
from truing.inverse_kinematics import InverseSolver
from truing.programs import apply_programs


def test_poses_out_is_what_ik_reads(tmp_path: Path) -> None:
    """The command's own table brings the same joints back."""
    for name, robot in (("nominal", nominal("kuka")), ("real", built("kuka"))):
        truing.save_robot(tmp_path / f"{name}.yaml", robot)
    arguments = ["apply", str(CORPUS / "kuka_inline.src"), "--nominal", str(tmp_path / "nominal.yaml")]
    arguments += ["--real", str(tmp_path / "real.yaml"), "--out", str(tmp_path / "out")]
    assert main([*arguments, "--poses-out", str(tmp_path / "poses.csv")]) == 1  # a relative move stays
    robot = nominal("kuka")
    data = truing.load_targets(tmp_path / "poses.csv", robot)
    assert data.count == 4 and data.joints is not None
    tool = np.array(data.tasks[0].T_measurement_target)
    flange = InverseSolver(robot).forward(data.joints[0])
    T_flange_tool = np.linalg.inv(flange) @ tool
    assert np.allclose(T_flange_tool[:3, 3], [0.03, 0, 0.12], atol=1e-9)


def arguments_of(tmp_path: Path, *programs: str) -> list[str]:
    for name, robot in (("nominal", nominal("fanuc")), ("real", built("fanuc"))):
        truing.save_robot(tmp_path / f"{name}.yaml", robot)
    robots = ["--nominal", str(tmp_path / "nominal.yaml"), "--real", str(tmp_path / "real.yaml")]
    return ["apply", *(str(CORPUS / name) for name in programs), *robots, "--out", str(tmp_path / "out")]


def test_the_command_writes_copies_and_a_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main([*arguments_of(tmp_path, "fanuc_plain.ls"), "--tool", "1=30,0,120,0,0,0"])
    assert status == 0
    assert "fanuc_plain_compensated.ls" in capsys.readouterr().out
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["format"] == "truing-programs/1"
    assert [one["status"] for one in result["targets"]] == ["changed"] * 3
    assert result["before"]["mean_m"] > 1e-3 > 1e-5 > result["after"]["max_m"]
    assert (tmp_path / "out" / "report.html").exists()
    assert (tmp_path / "out" / "fanuc_plain_compensated.ls").read_bytes() != (
        CORPUS / "fanuc_plain.ls"
    ).read_bytes()


@pytest.mark.parametrize(
    ("programs", "more", "message"),
    [
        (
            ["fanuc_plain.ls"],
            [],
            "tool 1 is not defined in the files given: say what it is, --tool 1=X,Y,Z,W,P,R",
        ),
        (["fanuc_plain.ls"], ["--tool", "1=3,4"], "--tool: found '1=3,4', expected NAME=X,Y,Z,W,P,R"),
        (["fanuc_plain.ls"], ["--tool", "1=0,0,9000,0,0,0"], "out of the nominal robot's reach"),
        (["fanuc_plain.ls", "ur_first.script"], [], "give those of one robot at a time"),
        (["fanuc_plain.ls"], ["--seed", "1,2deg"], "--seed: found 2 joints, the robot has 6"),
        (["fanuc_plain.ls"], ["--pulses", "1,2"], "--pulses: found '1,2', expected six numbers"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(
    programs: list[str], more: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments_of(tmp_path, *programs), *more]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_limit_that_the_correction_would_pass_is_out_of_reach(tmp_path: Path) -> None:
    """J1 ends at the program's own joint: the built robot would have to go further."""
    believed, real = nominal("fanuc"), built("fanuc")
    real.joints[1].upper = believed.joints[1].upper = np.radians(10.0)
    real.joints[1].offset = -2e-3  # to be made up for by a reading above the limit

    path = tmp_path / "limit.ls"
    text = (CORPUS / "fanuc_plain.ls").read_text(encoding="latin-1")
    path.write_text(text.replace("   3:L P[2]", "   3:!").replace("   4:L P[3", "   4:!"), encoding="latin-1")
    with pytest.raises(InputError, match="out of reach after compensation: J2 would have to go"):
        apply_programs([path], believed, real, options("fanuc"))


@pytest.mark.parametrize(
    ("joints", "joint"), [("170,10,0,0,30,0", 1), ("0,0,0,0,0,0", 4), ("0,0,0,0,0.01,0", 4)]
)
def test_a_joint_target_never_comes_out_in_another_configuration(
    tmp_path: Path, joints: str, joint: int
) -> None:
    """At the limit of J1 the arm would turn over, where a wrist is in line J4 and J6 against each other."""
    text = (
        "MODULE M\nPROC a()\nMoveAbsJ [[{}],[9E9,9E9,9E9,9E9,9E9,9E9]],v5,fine,tool0;\nENDPROC\nENDMODULE\n"
    )
    (tmp_path / "a.mod").write_text(text.format(joints), encoding="ascii")
    (found,) = applied(tmp_path / "a.mod").targets
    assert found.status == "stayed"
    assert found.why.startswith(f"the correction would turn joint {joint} by ")
    (tmp_path / "a.mod").write_text(text.format("160,10,0,0,30,0"), encoding="ascii")
    (found,) = applied(tmp_path / "a.mod").targets
    assert found.status == "changed"
