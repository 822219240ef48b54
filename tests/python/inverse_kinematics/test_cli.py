# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing ik` and `truing compensate` keep the contract of the command line: a row per target in order, a
reason where there is no answer, nothing half-written.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from inverse_arms import (
    Floats,
    calibrated,
    gantry,
    irb,
    poses_of,
    position_off,
    random_joints,
    rotation_off,
    usual_joints,
    with_effects,
    wrapped,
)
from scene_files import NAMES, SCENE
from tables import columns, write
from truing.cli import main
from truing.examples import example
from truing.inverse_kinematics import Conditions, InverseSolver
from truing.rotations import quaternions_from_rotations, rotations_from_quaternions

ROBOT = str(example("irb120"))


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def write_poses(frames: Floats, more: Mapping[str, Any] | None = None, *, name: str = "targets.csv") -> str:
    values = np.column_stack([frames[:, :3, 3], quaternions_from_rotations(frames[:, :3, :3])])
    return str(
        write(
            Path(name),
            {n: [repr(float(v)) for v in values[:, k]] for k, n in enumerate(NAMES)} | dict(more or {}),
        )
    )


def run(*arguments: str) -> tuple[int, dict[str, Any]]:
    code = main([*arguments, "--out", "found"])
    return code, json.loads(Path("found/result.json").read_text())


def joints_of(path: str = "found/joints.csv", count: int = 6) -> Floats:
    table = columns(path)
    names = [name for name in table if name[0] == "q" and name[1].isdigit()]
    assert len(names) == count
    return np.array([[float(v) if v else math.nan for v in table[name]] for name in names]).T


def frames_of(path: str) -> Floats:
    table = columns(path)
    frames = np.tile(np.eye(4), (len(table["x_m"]), 1, 1))
    frames[:, :3, 3] = np.array([[float(v) for v in table[name]] for name in NAMES[:3]]).T
    frames[:, :3, :3] = rotations_from_quaternions(
        np.array([[float(v) for v in table[name]] for name in NAMES[3:]]).T
    )
    return frames


# ---- ik ------------------------------------------------------------------------------------------


def test_a_row_per_target_in_order_and_everything_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = poses_of(InverseSolver(irb()), random_joints(irb(), 20, seed=1))
    wanted[7, :3, 3] += 3.0
    code, result = run("ik", ROBOT, write_poses(wanted))
    captured = capsys.readouterr()
    assert code == 1 and captured.err.strip() == "truing: 1 of 20 targets are not reached"
    assert {path.name for path in Path("found").iterdir()} == {"result.json", "report.html", "joints.csv"}
    assert (result["format"], result["targets"], result["reached"], result["reasons"]) == (
        "truing-inverse/1",
        20,
        19,
        {"reached": 19, "out_of_reach": 1},
    )
    table = columns("found/joints.csv")
    assert list(table) == [
        *(f"q{k}_rad" for k in range(1, 7)),
        "status",
        "position_error_m",
        "rotation_error_rad",
        "branch",
    ]
    assert [k for k, status in enumerate(table["status"]) if status != "ok"] == [7] and table["status"][
        7
    ].startswith("out of reach by ")
    assert all(table[f"q{k}_rad"][7] == "" for k in range(1, 7))
    joints = joints_of()
    for k in set(range(20)) - {7}:
        reached = truing.forward_kinematics(irb(), joints[k])[-1]
        assert position_off(reached, wanted[k]) <= 1.001e-6 and rotation_off(reached, wanted[k]) <= 1.001e-6
    failure = result["failures"][0]
    assert (
        failure["target"] == 7
        and failure["reason"] == "out_of_reach"
        and len(failure["nearest"]["joints"]) == 6
        and failure["miss_m"] > 2
    )
    assert (
        captured.out.strip().splitlines()[-1] == "report: found/report.html"
        and "target 7: out of reach" in captured.out
    )


def test_all_reached_is_status_zero_and_the_same_again(capsys: pytest.CaptureFixture[str]) -> None:
    targets = write_poses(poses_of(InverseSolver(irb()), random_joints(irb(), 10, seed=2)))
    code, first = run("ik", ROBOT, targets, "--json", "--threads", "1")
    assert code == 0 and json.loads(capsys.readouterr().out) == first and first["failures"] == []
    files = {path.name: path.read_bytes() for path in Path("found").iterdir()}
    run("ik", ROBOT, targets, "--json", "--threads", "2")
    assert {path.name: path.read_bytes() for path in Path("found").iterdir()} == files


def test_a_calibrated_robot_is_solved_with_its_effects() -> None:
    robot = with_effects(calibrated(irb(), 3))
    truing.save_robot("calibrated.yaml", robot)
    robot = truing.load_robot("calibrated.yaml")
    solver = InverseSolver(robot)
    joints, direction = random_joints(robot, 15, seed=3, share=0.8), [1] * 15
    at = Conditions(payload=1.5, direction=[1] * 6)
    wanted = np.array([solver.forward(q, at) for q in joints])
    code, result = run(
        "ik",
        "calibrated.yaml",
        write_poses(wanted, {"payload_kg": [1.5] * 15, **{f"dir{k}": direction for k in range(1, 7)}}),
    )
    assert code == 0 and set(result["effects"]) == {"joint_compliance", "backlash", "harmonic"}
    said = Path("found/joints.csv")
    write(
        Path("rows.csv"),
        {
            **{k: v for k, v in columns(said).items() if k.startswith("q")},
            "payload_kg": [1.5] * 15,
            **{f"dir{k}": direction for k in range(1, 7)},
        },
    )
    assert main(["predict", "calibrated.yaml", "rows.csv", "--out", "predicted"]) == 0
    for reached, there in zip(frames_of("predicted/predicted.csv"), wanted, strict=True):
        assert position_off(reached, there) <= 1.001e-6 and rotation_off(reached, there) <= 1.01e-6


@pytest.mark.parametrize(
    "options", [["--task", "torch"], ["--free-axis", "z"], ["--free-axis", "x"], ["--task", "point"]]
)
def test_less_may_be_wanted(options: list[str]) -> None:
    wanted = poses_of(InverseSolver(irb()), random_joints(irb(), 10, seed=4))
    code, result = run("ik", ROBOT, write_poses(wanted), *options)
    kind = "point" if "point" in options else "torch"
    assert (
        code == 0
        and result["tasks"] == {kind: 10}
        and ("roll_rad" in columns("found/joints.csv")) == (kind == "torch")
    )
    for q, T in zip(joints_of(), wanted, strict=True):
        reached = truing.forward_kinematics(irb(), q)[-1]
        assert position_off(reached, T) <= 1.001e-6
        if kind == "torch":
            axis = 0 if "x" in options else 2
            assert reached[:3, axis] @ T[:3, axis] > 1 - 1e-11


def test_all_branches_say_which_target_they_are_for(capsys: pytest.CaptureFixture[str]) -> None:
    joints = usual_joints(6, seed=5)
    wanted = poses_of(InverseSolver(irb()), joints)
    wanted[2, :3, 3] += 3.0
    code, result = run("ik", ROBOT, write_poses(wanted), "--all-branches")
    assert code == 1 and result["reached"] == 5 and result["targets"] == 6
    table = columns("found/joints.csv")
    assert next(iter(table)) == "target" and [int(t) for t in table["target"]] == sorted(
        int(t) for t in table["target"]
    )
    assert (
        set(table["target"]) == {str(k) for k in range(6)}
        and result["branches"]["rows"] == len(table["target"]) > 10
    )
    found = joints_of()
    for q, target, status in zip(found, table["target"], table["status"], strict=True):
        assert (status == "ok") == (target != "2")
        if status == "ok":
            assert position_off(truing.forward_kinematics(irb(), q)[-1], wanted[int(target)]) <= 1.001e-6
    own = [
        np.abs(wrapped(found[k] - joints[int(t)])).max() for k, t in enumerate(table["target"]) if t != "2"
    ]
    assert sum(off < 1e-5 for off in own) == 5


def test_a_path_is_continuous_or_its_gaps_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    start = np.array([0.2, 0.1, -0.2, 0.3, 0.9, -0.3])
    joints = start + np.linspace(0.0, 0.8, 60)[:, None] * np.array([1.0, 0.3, 0.4, 0.5, -0.3, 1.0])
    wanted = poses_of(InverseSolver(irb()), joints)
    seed = ",".join(f"{math.degrees(q):.6f}deg" for q in start)
    code, result = run("ik", ROBOT, write_poses(wanted), "--path", "--seed", seed)
    assert code == 0 and result["path"]["continuous"] and result["path"]["gaps"] == []
    steps = np.abs(np.diff(joints_of(), axis=0)).max()
    assert steps == pytest.approx(result["path"]["longest_turn_rad"], rel=1e-6) and steps < 0.05
    assert "the path is continuous" in capsys.readouterr().out
    code, result = run(
        "ik", ROBOT, write_poses(np.concatenate([wanted[:5], wanted[-5:]])), "--path", "--seed", seed
    )
    assert (
        code == 1
        and [(g["from"], g["to"]) for g in result["path"]["gaps"]] == [(4, 5)]
        and not result["path"]["continuous"]
    )
    captured = capsys.readouterr()
    assert "the path has 1 gap" in captured.err and "no continuous path from target 4 to 5" in captured.out


def test_the_seed_decides_the_configuration() -> None:
    joints = random_joints(irb(), 8, seed=6, share=0.6)
    targets = write_poses(poses_of(InverseSolver(irb()), joints))
    write(Path("seeds.csv"), {f"q{k + 1}_rad": [repr(float(v)) for v in joints[:, k]] for k in range(6)})
    run("ik", ROBOT, targets, "--seed", "seeds.csv")
    assert np.abs(joints_of() - joints).max() < 1e-4
    degrees = ",".join(f"{v:.9f}" for v in np.degrees(joints[3])) + "deg"
    run("ik", ROBOT, targets, "--seed", degrees)
    assert np.abs(joints_of()[3] - joints[3]).max() < 1e-4
    with_seeds = write_poses(
        poses_of(InverseSolver(irb()), joints),
        {f"q{k + 1}_rad": joints[:, k] for k in range(6)},
        name="own.csv",
    )
    run("ik", ROBOT, with_seeds)
    assert np.abs(joints_of() - joints).max() < 1e-4


def test_what_is_in_the_way_is_named_and_avoided_by_a_retreat(capsys: pytest.CaptureFixture[str]) -> None:
    T = truing.forward_kinematics(irb(), [0.0, 0.3, 0.0, 0.0, 0.9, 0.0])[-1]
    p = 1000 * T[:3, 3] + 20 * T[:3, 2]
    scene = SCENE.decode().replace(
        "xyz: [300, 300, 500], radius: 80", f"xyz: [{p[0]}, {p[1]}, {p[2]}], radius: 25"
    )
    Path("scene.yaml").write_text(scene)
    targets = write_poses(T[None])
    code, result = run("ik", ROBOT, targets, "--scene", "scene.yaml")
    assert (
        code == 1
        and result["failures"][0]["pair"] == ["hand", "ball"]
        and result["scene"] == {"capsules": 2, "obstacles": 3, "clearance_m": 0.005}
    )
    assert "hand and ball" in columns("found/joints.csv")["status"][0]
    code, result = run("ik", ROBOT, targets, "--scene", "scene.yaml", "--retreat", "100mm")
    table = columns("found/joints.csv")
    assert (
        code == 1
        and result["reasons"] == {"retreated": 1}
        and 0.0 < float(table["retreat_m"][0]) < 0.1
        and table["q1_rad"][0]
    )
    reached = truing.forward_kinematics(irb(), joints_of()[0])[-1]
    assert reached[:3, 3] == pytest.approx(T[:3, 3] - float(table["retreat_m"][0]) * T[:3, 2], abs=2e-6)
    where = truing.load_scene("scene.yaml", irb())
    assert truing.model.nearest_contact(where, irb(), joints_of()[0]).distance >= 0.005 - 1e-9


def test_rails_and_other_targets_of_the_robot() -> None:
    robot = gantry().replace(
        targets=[
            truing.Target("tool"),
            truing.Target("probe", truing.frame_from_xyz_rpy([0, 0, 0.2], [0, 0, 0])),
        ]
    )
    truing.save_robot("gantry.yaml", robot)
    wanted = np.array([truing.forward_kinematics(robot, q, 1)[-1] for q in random_joints(robot, 5, seed=7)])
    code, result = run(
        "ik", "gantry.yaml", write_poses(wanted), "--target", "probe", "--choose", "rail_travel"
    )
    assert code == 0 and result["choose"] == "rail_travel"
    table = columns("found/joints.csv")
    assert list(table)[:4] == ["q1_m", "q2_m", "q3_m", "q4_rad"]
    for q, T in zip(joints_of(count=9), wanted, strict=True):
        assert position_off(truing.forward_kinematics(robot, q, 1)[-1], T) <= 1.001e-6
    beyond = wanted.copy()
    beyond[:, :3, 3] += [0, 0, 5.0]
    code, result = run(
        "ik", "gantry.yaml", write_poses(beyond), "--target", "probe"
    )  # off the rails: a status, no error
    assert code == 1 and result["reached"] == 0


def test_a_path_has_one_load(capsys: pytest.CaptureFixture[str]) -> None:
    targets = write_poses(
        poses_of(InverseSolver(irb()), usual_joints(3, seed=13)),
        {"payload_kg": [1, 1, 2]},
    )
    assert main(["ik", ROBOT, targets, "--path"]) == 2
    assert "row 2 (from 0) has another payload" in capsys.readouterr().err and not Path("truing-ik").exists()


def test_the_reports_answer_first() -> None:
    wanted = poses_of(InverseSolver(irb()), usual_joints(20, seed=14))
    wanted[3, :3, 3] *= 4.0
    targets = write_poses(wanted)
    run("ik", ROBOT, targets, "--path")
    page = Path("found/report.html").read_text()
    assert (
        '<span class="after">19</span> of 20 targets are reached. The path has' in page
        and "not all reached" in page
    )
    assert (
        "out of reach by" in page
        and 'id="workspace"' in page
        and 'id="ranges"' in page
        and page.count('id="path') == 6
    )
    truing.save_robot("real.yaml", calibrated(irb(), 2))
    run("compensate", ROBOT, "real.yaml", targets)
    other = Path("found/report.html").read_text()
    assert (
        "Commanded as they are, targets would be missed by" in other
        and 'id="corrections"' in other
        and 'id="distribution"' in other
    )


# ---- compensate ----------------------------------------------------------------------------------


def test_compensation_from_identification_to_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", ROBOT, "--poses", "80", "--out", "sim", "--seed", "2", "--perturb", "J*"]) == 0
    assert main(["identify", "sim/robot.yaml", "sim/measurements.csv", "--out", "calibration"]) == 0
    capsys.readouterr()
    nominal, real = truing.load_robot(ROBOT), truing.load_robot("calibration/robot.yaml")
    joints = usual_joints(30, seed=8)
    wanted = poses_of(InverseSolver(nominal), joints)
    targets = write_poses(wanted, {f"q{k + 1}_rad": joints[:, k] for k in range(6)})
    code, result = run(
        "compensate", ROBOT, "calibration/robot.yaml", targets, "--uncertainty", "calibration/result.json"
    )
    assert code == 0 and result["format"] == "truing-compensation/1" and result["reached"] == 30
    assert {path.name for path in Path("found").iterdir()} == {
        "result.json",
        "report.html",
        "joints.csv",
        "poses.csv",
    }
    commands, solver = frames_of("found/poses.csv"), InverseSolver(real)
    for q, command, T in zip(joints_of(), commands, wanted, strict=True):
        assert (
            position_off(solver.forward(q), T) <= 1.001e-6 and rotation_off(solver.forward(q), T) <= 1.001e-6
        )
        assert position_off(truing.forward_kinematics(nominal, q)[-1], command) < 1e-12
    before = np.array([float(v) for v in columns("found/joints.csv")["position_before_m"]])
    assert before == pytest.approx(
        [position_off(solver.forward(q), T) for q, T in zip(joints, wanted, strict=True)], rel=1e-3
    )
    assert (
        result["before"]["mean_m"] == pytest.approx(before.mean())
        and result["after"]["max_m"] < 1e-6 < result["before"]["mean_m"]
    )
    error = result["standard_error"]["position_m"]["rms_m"]
    assert 1e-6 < error < 3e-4
    truth = truing.load_robot("sim/true_robot.yaml")
    off = [
        position_off(truing.forward_kinematics(truth, q)[-1], T)
        for q, T in zip(joints_of(), wanted, strict=True)
    ]
    assert 0.3 < np.sqrt(np.mean(np.square(off))) / error < 3.0  # of the right size, by the truth
    assert "standard error of what remains" in capsys.readouterr().out


def test_a_program_of_joints_is_compensated(capsys: pytest.CaptureFixture[str]) -> None:
    real = calibrated(irb(), 4)
    truing.save_robot("real.yaml", real)
    real = truing.load_robot("real.yaml")
    program = usual_joints(12, seed=9)
    write(
        Path("program.csv"),
        {f"q{k + 1}_deg": [repr(float(v)) for v in np.degrees(program[:, k])] for k in range(6)},
    )
    code, result = run("compensate", ROBOT, "real.yaml", "program.csv")
    assert code == 0 and result["from"] == "joints" and "standard_error" not in result
    for q, was in zip(joints_of(), program, strict=True):
        wanted = truing.forward_kinematics(irb(), was)[-1]
        assert position_off(truing.forward_kinematics(real, q)[-1], wanted) <= 1.001e-6
    assert list(columns("found/poses.csv")) == [*NAMES, "other_configuration", "status"]


def test_a_program_of_an_arm_of_five_joints_says_what_to_ask_for(capsys: pytest.CaptureFixture[str]) -> None:
    arm = irb().replace(joints=irb().joints[:5])
    truing.save_robot("five.yaml", arm)
    truing.save_robot("real.yaml", calibrated(arm, 5))
    program = usual_joints(12, seed=10)[:, :5]
    write(
        Path("program.csv"),
        {f"q{k + 1}_deg": [repr(float(v)) for v in np.degrees(program[:, k])] for k in range(5)},
    )
    code, result = run("compensate", "five.yaml", "real.yaml", "program.csv")
    assert code == 1 and result["reached"] == 0
    assert "has 5 driven joints, and a whole pose takes 6" in result["warnings"][0]
    code, result = run("compensate", "five.yaml", "real.yaml", "program.csv", "--task", "torch")
    assert code == 0 and result["reached"] == 12 and not result["warnings"]
    capsys.readouterr()


def test_commands_in_the_base_frame(capsys: pytest.CaptureFixture[str]) -> None:
    real = calibrated(irb(), 5).replace(
        T_measurement_base=truing.frame_from_xyz_rpy([1.0, 2.0, 0.5], [0.01, 0.02, 1.0])
    )
    truing.save_robot("real.yaml", real)
    real = truing.load_robot("real.yaml")
    joints = usual_joints(10, seed=10)
    wanted = poses_of(InverseSolver(irb()), joints)
    code, result = run(
        "compensate",
        ROBOT,
        "real.yaml",
        write_poses(wanted, {f"q{k + 1}_rad": joints[:, k] for k in range(6)}),
        "--in-base",
    )
    assert code == 0 and result["frame"] == "base"
    base = np.linalg.inv(real.T_measurement_base)
    for q, T in zip(joints_of(), wanted, strict=True):
        assert position_off(base @ truing.forward_kinematics(real, q)[-1], T) <= 1.001e-6
    assert "--in-base" not in capsys.readouterr().err
    main(["compensate", ROBOT, "real.yaml", "targets.csv", "--out", "elsewhere"])
    assert "2291 mm and 57.3 deg from that of NOMINAL" in capsys.readouterr().err


# ---- Bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ik", "none.yaml", "targets.csv"], "none.yaml: cannot be read"),
        (["ik", ROBOT, "none.csv"], "none.csv: cannot be read"),
        (["ik", ROBOT, "empty.csv"], "empty.csv: is empty"),
        (["ik", ROBOT, "nan.csv"], "nan.csv, line 3, column 'x_m': found 'nan'"),
        (["ik", ROBOT, "long.csv"], "long.csv, line 2: found the quaternion"),
        (["ik", ROBOT, "mm.csv"], "looks like millimetres"),
        (["ik", ROBOT, "targets.csv", "--seed", "0,0,0deg"], "--seed: found 3 joints, the robot has 6"),
        (
            ["ik", ROBOT, "targets.csv", "--seed", "0,0,0,0,0,1"],
            "--seed, joint J6: found '1', expected an angle with its unit",
        ),
        (["ik", ROBOT, "targets.csv", "--seed", "five.csv"], "five.csv: there is no column q6_rad"),
        (
            ["ik", ROBOT, "targets.csv", "--seed", "two.csv"],
            "two.csv: has 2 rows, expected one, or one for each of 3",
        ),
        (["ik", ROBOT, "targets.csv", "--path", "--all-branches"], "--path and --all-branches"),
        (
            ["ik", ROBOT, "targets.csv", "--all-branches", "--task", "torch"],
            "--all-branches: is for full poses",
        ),
        (
            ["ik", ROBOT, "targets.csv", "--task", "point", "--free-axis", "z"],
            "--free-axis z and --task point",
        ),
        (["ik", ROBOT, "targets.csv", "--scene", "none.yaml"], "none.yaml: cannot be read"),
        (
            ["ik", ROBOT, "targets.csv", "--retreat", "50"],
            "--retreat: found '50', expected a length with its unit",
        ),
        (
            ["ik", ROBOT, "targets.csv", "--retreat", "0mm"],
            "--retreat: found '0mm', expected a length above 0",
        ),
        (["ik", ROBOT, "targets.csv", "--longest-turn", "-3deg"], "--longest-turn: found '-3deg'"),
        (
            ["ik", ROBOT, "targets.csv", "--target", "probe"],
            "--target: the robot has no target 'probe'; its targets are tool",
        ),
        (["ik", ROBOT, "targets.csv", "--choose", "best"], "best"),
        (["ik", ROBOT, "program.csv"], "there are no targets"),
        (["ik", "lossy.yaml", "targets.csv"], "sag"),
        (["compensate", ROBOT, str(example("palletizer")), "targets.csv"], "these are not the same robot"),
        (["compensate", ROBOT, ROBOT, "targets.csv", "--uncertainty", "empty.csv"], "empty.csv: is not JSON"),
        (
            ["compensate", ROBOT, ROBOT, "program.csv", "--seed", "0,0,0,0,0,0deg"],
            "--seed: a program of joint positions",
        ),
        (
            ["compensate", ROBOT, ROBOT, "program.csv", "--retreat", "5mm"],
            "--retreat: a program of joint positions is given back where it is",
        ),
        (["compensate", ROBOT, ROBOT, "empty.csv"], "empty.csv: is empty"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = poses_of(InverseSolver(irb()), random_joints(irb(), 3, seed=11, share=0.7))
    write_poses(wanted)
    text = Path("targets.csv").read_text().splitlines()
    Path("empty.csv").write_text("")
    Path("nan.csv").write_text("\n".join([*text[:2], ",".join(["nan", *text[2].split(",")[1:]])]) + "\n")
    Path("long.csv").write_text("\n".join([text[0], ",".join([*text[1].split(",")[:6], "2"])]) + "\n")
    Path("mm.csv").write_text(
        "\n".join(
            [
                text[0],
                ",".join([*(str(1000 * float(v)) for v in text[1].split(",")[:3]), *text[1].split(",")[3:]]),
            ]
        )
        + "\n"
    )
    write(Path("five.csv"), {f"q{k}_rad": [0.1] for k in range(1, 6)})
    write(Path("two.csv"), {f"q{k}_rad": [0.1, 0.2] for k in range(1, 7)})
    write(Path("program.csv"), {f"q{k}_rad": [0.1, 0.2] for k in range(1, 7)})
    truing.save_robot(
        "lossy.yaml", irb().replace(effects=[truing.model.AppliedEffect("sag", ["J2"], {"sag.J2": 1e-4})])
    )
    before = sorted(Path().iterdir())
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert message in captured.err and captured.err.count("\n") == 1 and captured.out == ""
    assert sorted(Path().iterdir()) == before


def test_ctrl_c_leaves_nothing_behind(tmp_path: Path) -> None:
    write_poses(poses_of(InverseSolver(gantry()), random_joints(gantry(), 100, seed=12)).repeat(1000, axis=0))
    truing.save_robot("gantry.yaml", gantry())
    before = sorted(tmp_path.iterdir())
    program = "import sys; from truing.cli import main; print('ready', flush=True); sys.exit(main())"
    command = ["ik", "gantry.yaml", "targets.csv", "--choose", "manipulability"]
    arguments = [sys.executable, "-c", program, *command]
    with subprocess.Popen(
        arguments, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(4.0)  # past its imports
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and "Traceback" not in errors
    assert sorted(tmp_path.iterdir()) == before
