# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A controller that believes in the nominal robot runs the written programs on a robot that was built
otherwise.

Programs are written and read back by the tests' own code, so that a misread notation cannot cancel.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import program_texts as texts
from program_robots import built, nominal
from truing.files.brand_frames import numbers_from_frame
from truing.files.programs import Given
from truing.inverse_kinematics import InverseOptions, InverseSolver, Task
from truing.model import Target
from truing.programs import ApplyOptions, apply_programs

BRANDS = ("kuka", "abb", "fanuc", "yaskawa", "ur")
COUNT, BY_JOINTS = 14, 4
# What printed digits leave at the tool: half a digit of every number, in the worst way. [m], [rad]
FLOOR = {
    "kuka": (3e-6, 3e-6),
    "abb": (3e-6, 3e-6),
    "fanuc": (4e-5, 3e-5),
    "yaskawa": (4e-5, 6e-5),  # a pulse is up to 2.2e-3 deg
    "ur": (4e-6, 4e-6),
}


def working_joints(brand: str, seed: int) -> np.ndarray:
    """shape=(COUNT, 6) [deg]: in front of the robot, elbow up, J5 on either side."""
    rng = np.random.default_rng(seed)
    spread = np.array([50.0, 18.0, 18.0, 60.0, 15.0, 120.0])
    middle = {
        "kuka": [0, -80, 95, 0, 45, 0],
        "abb": [0, 10, 15, 0, 50, 0],
        "fanuc": [0, 10, -10, 0, -60, 0],
        "yaskawa": [0, 10, -10, 0, -60, 0],
        "ur": [0, -90, 90, -60, -60, 0],
    }[brand]
    q = np.array(middle) + spread * rng.uniform(-1, 1, (COUNT, 6))
    if brand != "ur":
        q[::3, 4] *= -1  # the other way to hold the wrist
    return np.asarray(q)


def given(brand: str) -> Given:
    if brand in ("fanuc", "yaskawa"):
        return Given({"3": texts.T_FLANGE_TOOL}, {"2": texts.T_BASE_FRAME}, tuple(texts.PULSES))
    return Given()


def frame_of(brand: str) -> np.ndarray:
    return np.eye(4) if brand == "ur" else texts.T_BASE_FRAME


def write_program(folder: Path, brand: str, seed: int) -> tuple[Path, np.ndarray, list[np.ndarray]]:
    """A program, its joints [rad], and where it wants the tool in the robot base."""
    joints = working_joints(brand, seed)
    solver = InverseSolver(nominal(brand))
    wanted = [solver.forward(np.radians(q)) @ texts.T_FLANGE_TOOL for q in joints]
    poses = [np.linalg.inv(frame_of(brand)) @ T for T in wanted[BY_JOINTS:]]
    path = folder / f"sim{texts.SUFFIX[brand]}"
    path.write_bytes(texts.WRITERS[brand](joints, poses).encode("latin-1"))
    # The program wants what it prints.
    printed_joints, printed_poses = texts.read_back(brand, path.read_text(encoding="latin-1"))
    wanted = [solver.forward(np.radians(q)) @ texts.T_FLANGE_TOOL for q in printed_joints]
    wanted += [frame_of(brand) @ T for T in printed_poses]
    return path, np.radians(joints), wanted


def difference(T: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    R = T[:3, :3].T @ other[:3, :3]
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return float(np.linalg.norm(T[:3, 3] - other[:3, 3])), math.atan2(sine, (np.trace(R) - 1) / 2)


@pytest.mark.parametrize("brand", BRANDS)
def test_the_built_robot_reaches_what_the_program_wants(brand: str, tmp_path: Path) -> None:
    path, joints, wanted = write_program(tmp_path, brand, seed=11)
    outcome = apply_programs([path], nominal(brand), built(brand), ApplyOptions(given(brand)))
    assert [one.status for one in outcome.targets] == ["changed"] * COUNT
    assert not outcome.stays

    text = outcome.files[path].decode("latin-1")
    command_joints, command_poses = texts.read_back(brand, text)
    tight = InverseOptions(position_tolerance=1e-9, rotation_tolerance=1e-9)
    controller, robot = InverseSolver(nominal(brand), tight), InverseSolver(built(brand))
    commands = [np.radians(q) for q in command_joints]
    for q, T in zip(joints[BY_JOINTS:], command_poses, strict=True):
        flange = frame_of(brand) @ T @ np.linalg.inv(texts.T_FLANGE_TOOL)
        commands.append(np.asarray(controller.solve(Task(flange), q).joints))
    missed = [
        difference(robot.forward(q) @ texts.T_FLANGE_TOOL, T) for q, T in zip(commands, wanted, strict=True)
    ]
    off_before = [
        difference(robot.forward(q) @ texts.T_FLANGE_TOOL, T)[0] for q, T in zip(joints, wanted, strict=True)
    ]

    assert min(off_before) > 3e-4, "without correction the robot is off by far more than the digits"
    assert max(position for position, _ in missed) < FLOOR[brand][0]
    assert max(rotation for _, rotation in missed) < FLOOR[brand][1]
    # What the report promises is what happens.
    for one, (position, rotation) in zip(outcome.targets, missed, strict=True):
        assert one.after == pytest.approx((position, rotation), abs=2e-8)


def test_the_flange_of_a_urdf_is_its_tip_link(tmp_path: Path) -> None:
    """URDFs of arms end in a fixed joint to tool0. The calibrated robot has its measured reflector there."""
    path, joints, wanted = write_program(tmp_path, "kuka", seed=11)
    arm = nominal("kuka")
    tip = Target("tool0", np.asarray(arm.joints[-1].T_parent_joint))
    believed = arm.replace(joints=arm.joints[:-1], targets=[tip])
    random = np.random.default_rng(12)
    links = []
    for joint in believed.joints:
        T = np.array(joint.T_parent_joint)
        T[:3, 3] += random.normal(0.0, 1e-3, 3)
        links.append(joint.replace(T_parent_joint=T))
    real = believed.replace(joints=links)
    reflector = np.eye(4)
    reflector[:3, 3] = 0.1, 0.02, 0.05
    measured = real.replace(targets=[Target("reflector", reflector)])
    outcome = apply_programs([path], believed, measured, ApplyOptions(given("kuka")))
    assert [one.status for one in outcome.targets] == ["changed"] * COUNT

    command_joints, command_poses = texts.read_back("kuka", outcome.files[path].decode("latin-1"))
    controller, robot = InverseSolver(arm), InverseSolver(real)
    commands = [np.radians(q) for q in command_joints]
    for q, T in zip(joints[BY_JOINTS:], command_poses, strict=True):
        flange = frame_of("kuka") @ T @ np.linalg.inv(texts.T_FLANGE_TOOL)
        commands.append(np.asarray(controller.solve(Task(flange), q).joints))
    missed = [
        difference(robot.forward(q) @ texts.T_FLANGE_TOOL, T)[0]
        for q, T in zip(commands, wanted, strict=True)
    ]
    assert max(missed) < 4e-6


@pytest.mark.parametrize("brand", BRANDS)
def test_identical_robots_give_the_same_bytes(brand: str, tmp_path: Path) -> None:
    for seed in range(3):
        path, _, _ = write_program(tmp_path, brand, seed)
        outcome = apply_programs([path], nominal(brand), nominal(brand), ApplyOptions(given(brand)))
        assert outcome.files[path] == path.read_bytes()
        assert {one.status for one in outcome.targets} == {"same"}


def test_kuka_turns_are_counted_anew_where_an_axis_crosses_zero(tmp_path: Path) -> None:
    """A4 stands at zero; the correction turns it to the negative side, which T has a bit for."""
    solver = InverseSolver(nominal("kuka"))
    q = np.radians([10.0, -80.0, 95.0, 0.0, 45.0, 20.0])
    path = tmp_path / "zero.src"
    values = dict(zip("XYZABC", numbers_from_frame("kuka", solver.forward(q)), strict=True))
    pose = ",".join(f"{name} {value:.6f}" for name, value in values.items())
    path.write_text(f"DEF zero()\n$BASE=$NULLFRAME\n$TOOL=$NULLFRAME\nPTP {{{pose},S 2,T 2}}\nEND\n")
    outcome = apply_programs([path], nominal("kuka"), built("kuka"), ApplyOptions())
    (one,) = outcome.targets
    assert one.status == "changed"
    assert one.command_joints is not None
    expected = sum(1 << k for k in range(6) if one.command_joints[k] < 0)
    assert f"S 2,T {expected}}}" in outcome.files[path].decode()
