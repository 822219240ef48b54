# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inverse kinematics and compensation in Python: what is claimed is true by Pinocchio and by `predict`, and
what other tools get wrong stays right.
"""

from __future__ import annotations

import functools
import math
import pickle
import threading
from typing import Literal

import numpy as np
import pytest

import truing
from inverse_arms import (
    Floats,
    axis_off,
    calibrated,
    gantry,
    irb,
    is_within_limits,
    limits,
    poses_of,
    position_off,
    random_joints,
    rotation_off,
    scara,
    with_effects,
    wrapped,
)
from truing.examples import example
from truing.inverse_kinematics import (
    Compensator,
    Conditions,
    InverseOptions,
    InverseSolver,
    PathOptions,
    Solution,
    Solutions,
    Task,
)
from truing.model import AppliedEffect, LinkCapsule, Obstacle, Scene, nearest_contact

TOLERANCE = 1e-6  # [m], [rad]


def check(robot: truing.Robot, found: Solutions, wanted: Floats, kind: str = "pose") -> None:
    """Whatever is claimed to be reached is, by plain forward kinematics (of robots without effects), and
    within limits.
    """
    for solution, T in zip(found, wanted, strict=True):
        if not solution.reached:
            continue
        reached = truing.forward_kinematics(robot, solution.joints)[-1]
        assert position_off(reached, T) <= 1.001 * TOLERANCE
        if kind != "point":
            assert (rotation_off if kind == "pose" else axis_off)(reached, T) <= 1.001 * TOLERANCE
        assert is_within_limits(robot, solution.joints)


# ---- Every kind of chain -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "robot",
    [
        irb(),
        calibrated(irb(), 3),
        truing.load_robot(example("ur10")),
        calibrated(truing.load_robot(example("ur10")), 4),
        gantry(),
    ],
    ids=["wrist", "wrist calibrated", "three parallel", "three parallel calibrated", "gantry"],
)
@pytest.mark.parametrize("kind", ["pose", "torch", "point"])
def test_every_reachable_target_is_reached(robot: truing.Robot, kind: str) -> None:
    solver = InverseSolver(robot)
    wanted = poses_of(solver, random_joints(robot, 60, seed=1))
    seeds = random_joints(robot, 60, seed=2)
    found = truing.inverse(robot, wanted, kind=kind, seeds=seeds)  # type: ignore[arg-type]
    assert found.reached.all(), [solver.describe(s) for s in found if not s.reached]
    check(robot, found, wanted, kind)


@pytest.mark.parametrize(
    "robot", [truing.load_robot(example("palletizer")), scara()], ids=["palletizer", "scara"]
)
def test_four_axes_reach_their_own_poses(robot: truing.Robot) -> None:
    solver = InverseSolver(robot)
    wanted = poses_of(solver, random_joints(robot, 60, seed=1, share=0.95))
    found = truing.inverse(robot, wanted, seeds=random_joints(robot, 60, seed=2))
    assert found.reached.all()
    check(robot, found, wanted)


def test_the_closed_form_is_named() -> None:
    names = [
        InverseSolver(robot).closed_form
        for robot in (irb(), calibrated(irb()), truing.load_robot(example("ur10")), scara())
    ]
    assert names == ["spherical_wrist", "spherical_wrist", "three_parallel", "none"]


def test_all_branches_of_a_calibrated_arm_are_those_of_the_nominal_one() -> None:
    """Away from singularities and limits, where a calibration cannot make branches come and go."""
    nominal, real = (
        InverseSolver(irb()),
        InverseSolver(calibrated(irb(), 5)),
    )
    low, high = limits(irb())
    compared = 0
    for q in random_joints(irb(), 60, seed=3, share=0.9):
        task = Task(nominal.forward(q))
        there, here = nominal.branches(task, q).solutions, real.branches(task, q).solutions
        assert min(float(np.abs(s.joints - q).max()) for s in there) < 1e-5  # its own is among them
        for solution in here:
            assert (
                solution.reached
                and position_off(real.forward(solution.joints), task.T_measurement_target) <= TOLERANCE
            )
        for those, others in ((there, here), (here, there)):
            for s in those:
                if stiffness(s.joints) > 0.05 and np.minimum(s.joints - low, high - s.joints).min() > 0.1:
                    assert (
                        min(float(np.abs(wrapped(s.joints - other.joints)).max()) for other in others) < 0.15
                    )
                    compared += 1
        joints = np.array([s.joints for s in here])
        apart = [float(np.abs(a - b).max()) for k, a in enumerate(joints) for b in joints[:k]]
        assert not apart or min(apart) > 1e-4
    assert compared > 100


nominal_arm = functools.cache(irb)


def stiffness(joints: Floats) -> float:
    """Smallest singular value of the nominal arm's Jacobian, by differences [m, rad per rad]."""
    robot = nominal_arm()
    T = truing.forward_kinematics(robot, joints)[-1]
    columns = []
    for k in range(6):
        D = (truing.forward_kinematics(robot, joints + 1e-6 * np.eye(6)[k])[-1] - T) / 1e-6
        W = D[:3, :3] @ T[:3, :3].T
        columns.append([*D[:3, 3], W[2, 1], W[0, 2], W[1, 0]])
    return float(np.linalg.svd(np.array(columns), compute_uv=False)[-1])


# ---- Pinocchio -----------------------------------------------------------------------------------


def test_what_is_reached_is_by_pinocchio() -> None:
    pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")
    from pinocchio_arms import ARM, OBLIQUE, Both

    for text, kind in ((ARM, "pose"), (ARM, "torch"), (OBLIQUE, "point")):
        both = Both.read(text)
        low, high = np.clip(limits(both.robot), -3.0, 3.0)
        joints = np.random.default_rng(7).uniform(low, high, (30, len(low)))
        wanted = np.array([both.frames(q)[-1] for q in joints])
        found = truing.inverse(
            both.robot, wanted, kind=kind, seeds=np.random.default_rng(8).uniform(low, high, joints.shape)
        )  # type: ignore[arg-type]
        assert found.reached.all()
        for q, T in zip(found.joints, wanted, strict=True):
            there = both.frames(q)[-1]
            assert position_off(there, T) <= 1.001 * TOLERANCE
            if kind != "point":
                assert (rotation_off if kind == "pose" else axis_off)(there, T) <= 1.001 * TOLERANCE


# ---- Effects -------------------------------------------------------------------------------------


def predicted(robot: truing.Robot, joints: Floats, payload: Floats, direction: Floats) -> Floats:
    """shape=(n, 4, 4): where `predict` says that the robot is."""
    from truing.rotations import rotations_from_quaternions

    said = truing.predict(
        robot,
        truing.Measurements(
            joints, payload=payload, directions=direction, positions=np.zeros((len(joints), 3))
        ),
    )
    frames = np.tile(np.eye(4), (len(joints), 1, 1))
    frames[:, :3, :3], frames[:, :3, 3] = (
        rotations_from_quaternions(np.asarray(said.orientation)),
        said.position,
    )
    return frames


def test_effects_in_the_inverse_are_those_of_predict() -> None:
    robot = with_effects(calibrated(irb(), 6))
    random = np.random.default_rng(9)
    joints = random_joints(robot, 40, seed=4, share=0.8)
    payload, direction = random.uniform(0.0, 3.0, 40), random.choice([-1.0, 1.0], (40, 6))
    conditions = [
        Conditions(payload=float(p), direction=d.astype(int).tolist())
        for p, d in zip(payload, direction, strict=True)
    ]
    solver = InverseSolver(robot, conditions=conditions[0])
    said = predicted(robot, joints, payload, direction)
    forward = np.array([solver.forward(q, c) for q, c in zip(joints, conditions, strict=True)])
    assert np.abs(forward - said).max() < 1e-10
    bare = InverseSolver(robot.replace(effects=[]))
    assert np.abs(poses_of(bare, joints) - said).max() > 1e-4  # and they do something

    found = solver.solve_batch(said, random_joints(robot, 40, seed=5), conditions)
    assert found.reached.all()
    again = predicted(robot, found.joints, payload, direction)
    for reached, wanted in zip(again, said, strict=True):
        assert (
            position_off(reached, wanted) <= 1.001 * TOLERANCE
            and rotation_off(reached, wanted) <= 1.001 * TOLERANCE
        )


def test_without_directions_those_of_the_way_from_the_seed_are_taken() -> None:
    robot = with_effects(irb())
    solver = InverseSolver(robot)
    for q, seed in zip(
        random_joints(robot, 20, seed=6, share=0.7), random_joints(robot, 20, seed=7, share=0.7), strict=True
    ):
        wanted = InverseSolver(robot.replace(effects=[])).forward(q)
        found = solver.solve(Task(wanted), seed)
        if not found.reached:
            continue
        way = Conditions(direction=np.sign(found.joints - seed).astype(int).tolist())
        assert position_off(solver.forward(found.joints, way), wanted) <= 1.001 * TOLERANCE


def test_an_effect_of_ones_own_is_refused_by_name() -> None:
    robot = irb().replace(effects=[AppliedEffect("sag", ["J2"], {"sag.J2": 1e-4})])
    with pytest.raises(truing.InputError, match="sag"):
        InverseSolver(robot)


@pytest.mark.parametrize(
    ("effect", "value"),
    [
        ("harmonic", "harmonic.J2.cos3"),  # there are cos1 and cos2
        ("backlash", "backlash.J3"),  # of another joint than the effect's
        ("neighbour_coupling", "neighbour_coupling.J2.J9"),
    ],
)
def test_a_value_that_no_law_looks_at_is_refused_by_name(effect: str, value: str) -> None:
    """It would do nothing, in a robot file written by hand."""
    robot = irb().replace(effects=[AppliedEffect(effect, ["J2"], {value: 1e-3})])
    with pytest.raises(truing.InputError, match=rf"'{value}'.*does not look at.*; it has {effect}\.J2"):
        InverseSolver(robot)


# ---- What other tools get wrong ------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz")
def test_a_free_roll_is_about_the_tools_axis_not_about_the_bases(axis: int) -> None:
    """Robotics Toolbox, mask=[1,1,1,1,1,0]: success with a tool axis 0.2 to 0.33 rad off, for its mask acts
    in the base frame.
    """
    robot = irb()
    solver = InverseSolver(robot)
    unit, travel = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    wanted = poses_of(solver, random_joints(robot, 60, seed=8, share=0.9))
    like = Task(np.eye(4), kind="torch", axis=unit, travel=travel)
    found = solver.solve_batch(wanted, random_joints(robot, 60, seed=9), like=like)
    assert found.reached.all()
    rolls = []
    for solution, T in zip(found, wanted, strict=True):
        reached = truing.forward_kinematics(robot, solution.joints)[-1]
        assert (
            position_off(reached, T) <= 1.001 * TOLERANCE and axis_off(reached, T, axis) <= 1.001 * TOLERANCE
        )
        rolls.append(rotation_off(reached, T))
    assert max(rolls) > 0.5  # the freedom is used


def test_a_cone_is_kept_exactly() -> None:
    """Drake's cone constraint leaves up to 6e-4 rad."""
    robot = irb()
    solver = InverseSolver(robot)
    lead, work = (math.radians(-5), math.radians(10)), (math.radians(-15), math.radians(3))
    wanted = poses_of(solver, random_joints(robot, 60, seed=10, share=0.8))
    like = Task(np.eye(4), kind="torch", lead=lead, work=work, roll=(-0.4, 0.3))
    found = solver.solve_batch(wanted, random_joints(robot, 60, seed=11), like=like)
    assert found.reached.mean() > 0.8
    for solution, T in zip(found, wanted, strict=True):
        if not solution.reached:
            continue
        n = T[:3, :3].T @ truing.forward_kinematics(robot, solution.joints)[-1][:3, 2]
        assert lead[0] - TOLERANCE <= math.atan2(n[0], n[2]) <= lead[1] + TOLERANCE
        assert work[0] - TOLERANCE <= math.atan2(n[1], n[2]) <= work[1] + TOLERANCE
        assert -0.4 - TOLERANCE <= solution.roll <= 0.3 + TOLERANCE


def test_sliding_joints_are_not_wrapped_by_a_turn() -> None:
    """robotics-toolbox-python#406: lengths brought into (-pi, pi]."""
    robot = gantry()
    solver = InverseSolver(robot)
    joints = random_joints(robot, 60, seed=12)
    joints[:, 0] = np.linspace(6.5, 10.0, 60)  # beyond 2 pi
    wanted = poses_of(solver, joints)
    found = solver.solve_batch(wanted, random_joints(robot, 60, seed=13))
    assert found.reached.all()
    check(robot, found, wanted)
    three = robot.replace(joints=robot.joints[:3])  # three rails alone: one answer
    rails = np.array([[9.9, 3.7, 1.9], [6.4, 0.1, 0.2], [3.2, 3.9, 0.01]])
    found = truing.inverse(
        three, np.array([truing.forward_kinematics(three, q)[-1] for q in rails]), kind="point"
    )
    assert found.reached.all() and np.abs(found.joints - rails).max() < 2e-6


def test_success_is_never_stale_and_limits_are_never_violated() -> None:
    """bio_ik#48: the flag from before clamping. pick_ik#43: answers beyond the limits."""
    wide = irb()
    narrow = wide.replace(
        joints=[joint.replace(lower=0.4 * joint.lower, upper=0.4 * joint.upper) for joint in wide.joints]
    )
    wanted = poses_of(InverseSolver(wide), random_joints(wide, 150, seed=14))
    for kind in ("pose", "torch"):
        found = truing.inverse(narrow, wanted, kind=kind, max_restarts=20)
        assert 0 < found.reached.sum() < 150
        check(narrow, found, wanted, kind)
        assert all(is_within_limits(narrow, s.joints) for s in found)  # the nearest of failures, too
        for solution, T in zip(found, wanted, strict=True):
            reached = truing.forward_kinematics(narrow, solution.joints)[-1]
            off = rotation_off(reached, T) if kind == "pose" else axis_off(reached, T)
            assert solution.position_error == pytest.approx(position_off(reached, T), abs=1e-12)
            assert solution.rotation_error == pytest.approx(off, abs=1e-9)
        assert {s.reason for s in found if not s.reached} <= {"limit", "out_of_reach", "singular"}


def test_a_sliding_joint_inside_the_arm_is_no_trouble() -> None:
    """OptIK ends the process on one."""
    robot = scara()
    found = truing.inverse(
        robot,
        poses_of(InverseSolver(robot), random_joints(robot, 20, seed=15, share=0.9)),
    )
    assert found.reached.all()


def test_an_arm_on_a_rail_does_not_flip_where_the_rail_ends() -> None:
    """roboplan#276: clamping flips an arm on a rail."""
    robot = gantry()
    solver = InverseSolver(robot)
    start = np.array([9.6, 2.0, 1.0, 0.2, 0.3, -0.4, 0.1, 0.8, 0.2])
    T = solver.forward(start)
    way = np.tile(T, (120, 1, 1))
    along = truing.forward_kinematics(robot, start + np.eye(9)[0])[-1][:3, 3] - T[:3, 3]
    way[:, :3, 3] += np.linspace(0.0, 0.55, 120)[:, None] * along  # the last 0.15 m lie beyond the rail's end
    path = truing.inverse_path(robot, way, seed=start)
    assert path.continuous and path.solutions.reached.all()
    steps = np.abs(np.diff(path.solutions.joints, axis=0))
    assert steps[:, 3:].max() < 0.1 and path.solutions.joints[:, 0].max() <= 10.0
    check(robot, path.solutions, way)
    previous = start  # and by Newton from one to the next
    for k, pose in enumerate(way):
        found = solver.follow(Task(pose), previous)
        assert found.reached, (k, solver.describe(found))
        assert np.abs(found.joints - previous)[3:].max() < 0.1
        previous = np.asarray(found.joints)


def test_a_path_does_not_jump() -> None:
    """TRAC-IK jumped 3.14 rad twice in 1000 poses."""
    robot = irb()
    solver = InverseSolver(robot)
    t = np.linspace(0.0, 1.0, 200)[:, None]
    joints = np.array([0.2, 0.1, -0.2, 0.3, 0.9, -0.3]) + 0.7 * np.sin(
        2 * math.pi * t * np.array([1.0, 0.7, 0.6, 1.3, 0.4, 1.7])
    )
    wanted = poses_of(solver, joints)
    for kind in ("pose", "torch"):
        path = truing.inverse_path(robot, wanted, kind=kind, seed=joints[0])
        assert path.continuous and path.solutions.reached.all()
        check(robot, path.solutions, wanted, kind)
        steps = np.abs(np.diff(path.solutions.joints, axis=0)).max()
        assert steps == pytest.approx(path.longest_turn, rel=1e-9) and steps < 0.15
        if kind == "pose":
            assert np.abs(path.solutions.joints - joints).max() < 1e-4


@pytest.mark.parametrize("kind", ["pose", "torch"])
def test_a_path_that_needs_more_than_a_turn_begins_at_the_turn_that_lets_it(kind: str) -> None:
    """Half of J6's range lies a turn away from the seed."""
    robot = irb()
    solver = InverseSolver(robot)
    joints = np.tile([0.2, 0.1, -0.2, 0.3, 0.9, 0.0], (200, 1))
    joints[:, 5] = np.linspace(0.98 * robot.joints[5].lower, 0.98 * robot.joints[5].upper, 200)
    wanted = poses_of(solver, joints)
    path = truing.inverse_path(robot, wanted, kind=kind)
    assert path.continuous and path.solutions.reached.all()
    check(robot, path.solutions, wanted, kind)
    if kind == "pose":
        assert path.longest_turn == pytest.approx(np.abs(np.diff(joints, axis=0)).max(), rel=1e-6)


@pytest.mark.parametrize("kind", ["pose", "torch", "point"])
@pytest.mark.parametrize("axes", [6, 7])
def test_paths_of_arms_without_closed_form_are_followed_from_target_to_target(axes: int, kind: str) -> None:
    """Poses on smooth motions of random chains: seeds that are tried anew at every target lie elsewhere."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        links = [
            truing.Joint(
                f"J{k + 1}",
                d=random.choice([0.0, 0.3, 0.4]),
                a=random.choice([0.0, 0.1, 0.3]),
                alpha=random.choice([-0.5, 0.5]) * math.pi,
                lower=-2.6,
                upper=2.6,
            )
            for k in range(axes)
        ]
        robot = truing.Robot("chain", joints=links)
        phase = 2 * math.pi * (np.linspace(0.0, 1.0, 81)[:, None] + random.random(axes))
        middle, swing = random.uniform(-1.4, 1.4, axes), random.uniform(0.3, 0.9, axes)
        wanted = poses_of(InverseSolver(robot), middle + swing * np.sin(phase))
        path = truing.inverse_path(robot, wanted, kind=kind)
        assert path.continuous, (seed, [(gap.start, gap.step) for gap in path.gaps])
        check(robot, path.solutions, wanted, kind)


def test_a_gap_is_told_where_no_path_is() -> None:
    robot = irb()
    solver = InverseSolver(robot)
    ends = np.array([[0.2, 0.1, -0.2, 0.3, 0.9, -0.3], [1.9, 0.1, -0.2, 0.3, 0.9, -0.3]])
    path = truing.inverse_path(robot, poses_of(solver, np.repeat(ends, 5, axis=0)), seed=ends[0])
    assert not path.continuous and [gap.start for gap in path.gaps] == [4]
    assert (
        path.gaps[0].step
        == pytest.approx(np.abs(np.diff(path.solutions.joints[4:6], axis=0)).max(), rel=1e-9)
        and path.gaps[0].step > 0.35
    )
    far = poses_of(solver, ends[:1].repeat(3, axis=0))
    far[1, :3, 3] += 5.0
    assert {(gap.start, gap.joint) for gap in truing.inverse_path(robot, far).gaps} == {(0, -1), (1, -1)}


def test_threads_share_a_solver() -> None:
    """tesseract#1363: wrong Jacobians under threads."""
    robot = with_effects(calibrated(irb(), 2))
    solver = InverseSolver(robot)
    wanted = poses_of(solver, random_joints(robot, 80, seed=16, share=0.8))
    seeds = random_joints(robot, 80, seed=17)
    alone = [solver.solve(Task(T), q) for T, q in zip(wanted, seeds, strict=True)]
    together: dict[int, list[Solution]] = {}

    def run(name: int) -> None:
        together[name] = [solver.solve(Task(T), q) for T, q in zip(wanted, seeds, strict=True)]

    threads = [threading.Thread(target=run, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for found in together.values():
        for a, b in zip(alone, found, strict=True):
            assert np.array_equal(a.joints, b.joints) and a.reason == b.reason


@pytest.mark.parametrize(
    "robot", [irb(), with_effects(calibrated(irb())), gantry()], ids=["nominal", "effects", "gantry"]
)
def test_any_number_of_threads_gives_the_same_bits(robot: truing.Robot) -> None:
    wanted = poses_of(InverseSolver(robot), random_joints(robot, 150, seed=18))
    wanted[::10, :3, 3] += 0.5
    results = [
        truing.inverse(robot, wanted, kind=kind, threads=threads, max_restarts=20)
        for kind in ("pose", "torch")
        for threads in (1, 2, 3, 0)
    ]
    for first, others in ((results[0], results[1:4]), (results[4], results[5:])):
        for other in others:
            assert np.array_equal(first.joints, other.joints) and first.reasons == other.reasons
            assert np.array_equal(first.position_error, other.position_error)


# ---- What cannot be reached ----------------------------------------------------------------------


def test_out_of_reach_says_how_far_and_where() -> None:
    robot = irb()
    solver = InverseSolver(robot)
    T = np.eye(4)
    T[:3, 3] = [3.0, 0.0, 0.29]
    found = solver.solve(Task(T, kind="point"))
    assert found.reason == "out_of_reach" and not found.reached
    assert found.miss == pytest.approx(found.position_error, rel=1e-6) and 2.0 < found.miss < 2.6
    assert found.direction @ np.array([1.0, 0.0, 0.0]) > 0.99
    there = truing.forward_kinematics(robot, found.joints)[-1]
    assert position_off(there, T) == pytest.approx(found.miss, rel=1e-6)  # the nearest is given
    assert "out of reach by" in solver.describe(found) and "mm in direction" in solver.describe(found)


def test_a_limit_in_the_way_is_named() -> None:
    robot = irb()
    joints = list(robot.joints)
    joints[0] = joints[0].replace(lower=-0.5, upper=0.5)
    narrow = robot.replace(joints=joints)
    solver = InverseSolver(narrow)
    found = solver.solve(Task(truing.forward_kinematics(robot, [0.7, 0.2, -0.1, 0.2, 0.4, 0.1])[-1]))
    assert found.reason == "limit" and not found.reached
    assert narrow.joints[found.joint].name in solver.describe(found) and found.excess > 0
    assert is_within_limits(narrow, found.joints)


def test_a_target_at_a_limit_is_reached() -> None:
    robot = irb()
    low, high = limits(robot)
    joints = np.array([high, low, np.where(np.arange(6) % 2, low, high)])
    joints[:, 4] = [1.0, -1.0, 0.7]  # not at a singularity as well
    wanted = poses_of(InverseSolver(robot), joints)
    found = truing.inverse(robot, wanted)
    assert found.reached.all()
    check(robot, found, wanted)


def test_singular_targets_are_reached_or_labelled() -> None:
    robot = calibrated(irb(), 1)
    solver = InverseSolver(robot)
    joints = random_joints(robot, 60, seed=19, share=0.7)
    joints[:, 4] = np.concatenate([np.zeros(20), np.full(20, 1e-7), np.full(20, -1e-4)])
    wanted = poses_of(solver, joints)
    found = truing.inverse(robot, wanted, seeds=random_joints(robot, 60, seed=20))
    assert found.reached.all()
    check(robot, found, wanted)


def test_what_is_chosen_is_the_best_of_all_branches() -> None:
    robot = irb()
    low, high = limits(robot)
    best = InverseSolver(robot, InverseOptions(choose="limits_margin"))
    for q in random_joints(robot, 20, seed=21, share=0.8):
        task = Task(best.forward(q))
        margins = [
            float((np.minimum(s.joints - low, high - s.joints) / (high - low)).min())
            for s in best.branches(task, q).solutions
        ]
        chosen = best.solve(task, q).joints
        assert float((np.minimum(chosen - low, high - chosen) / (high - low)).min()) >= max(margins) - 1e-6


# ---- What is in the way --------------------------------------------------------------------------


def scene(wall_at: float) -> Scene:
    wall = Obstacle(
        "wall",
        shape="box",
        T_measurement_shape=truing.frame_from_xyz_rpy([wall_at, 0, 0.5], [0, 0, 0]),
        size=[0.04, 4.0, 4.0],
    )
    return Scene(
        obstacles=[wall],
        capsules=[LinkCapsule("hand", link="tool", start=[0, 0, -0.1], end=[0, 0, 0], radius=0.02)],
    )


def test_what_collides_is_not_reached_and_retreats_by_the_least() -> None:
    robot = irb()
    T = truing.forward_kinematics(robot, [0.0, 0.3, 0.0, 0.0, 0.6, 0.0])[-1]
    options = InverseOptions(scene=scene(float(T[0, 3])))
    solver = InverseSolver(robot, options)
    found = solver.solve(Task(T))
    assert (
        found.reason == "collision"
        and not found.reached
        and found.contact is not None
        and found.contact_distance < 0
    )
    assert "hand and wall" in solver.describe(found)
    away = -T[:3, :3].T @ np.array([1.0, 0.0, 0.0])
    retreating = solver.solve(Task(T, retreat=away, longest_retreat=0.2))
    assert retreating.reason == "retreated" and 0.0 < retreating.retreat < 0.2
    there = truing.forward_kinematics(robot, retreating.joints)[-1]
    assert there[:3, 3] == pytest.approx(T[:3, 3] - [retreating.retreat, 0, 0], abs=2e-6)
    nearest = nearest_contact(options.scene, robot, retreating.joints)
    assert (nearest.first, nearest.second) == ("hand", "wall") and 0.0 <= nearest.distance < 1e-3


def test_a_free_scene_changes_nothing() -> None:
    robot = irb()
    wanted = poses_of(InverseSolver(robot), random_joints(robot, 30, seed=22, share=0.7))
    assert np.array_equal(
        truing.inverse(robot, wanted).joints, truing.inverse(robot, wanted, scene=scene(50.0)).joints
    )


# ---- Compensation --------------------------------------------------------------------------------


@pytest.mark.parametrize("in_base", [False, True])
def test_the_real_robot_goes_where_it_is_wanted(in_base: bool) -> None:
    nominal = irb().replace(T_measurement_base=truing.frame_from_xyz_rpy([0.5, -0.2, 0.1], [0, 0, 0.3]))
    real = with_effects(calibrated(nominal, 8)).replace(
        T_measurement_base=truing.frame_from_xyz_rpy([0.501, -0.2, 0.1], [0.001, 0, 0.3])
    )
    base = np.asarray(real.T_measurement_base) if in_base else np.eye(4)
    solver, believed = (
        InverseSolver(real),
        InverseSolver(nominal),
    )
    joints = random_joints(nominal, 60, seed=23, share=0.8)
    wanted = np.linalg.inv(base) @ poses_of(InverseSolver(real.replace(effects=[])), joints)
    made = truing.compensate(nominal, real, wanted, seeds=joints, in_base=in_base)
    assert made.solutions.reached.all()
    for k, one in enumerate(made):
        q = one.solution.joints
        command = believed.forward(q)
        if in_base:
            command = np.linalg.inv(nominal.T_measurement_base) @ command
        assert np.abs(command - one.T_command).max() < 1e-12  # the nominal robot takes these joints for it
        # The backlash is on one of its two sides, or in the middle.
        errors = [
            position_off(
                solver.forward(q, Conditions(direction=[0, 0, side, 0, 0, 0])),
                base @ wanted[k],
            )
            for side in (-1, 0, 1)
        ]
        assert min(errors) <= 1.001 * TOLERANCE
        assert one.position_before is None or one.position_before > 1e-5


def test_a_program_of_joints_keeps_its_configuration() -> None:
    nominal, real = irb(), calibrated(irb(), 9)
    program = random_joints(nominal, 80, seed=24, share=0.9)
    made = truing.compensate(nominal, real, program, program=True)
    joints = made.solutions.joints
    for k in np.flatnonzero(made.solutions.reached):
        wanted = truing.forward_kinematics(nominal, program[k])[-1]
        assert position_off(truing.forward_kinematics(real, joints[k])[-1], wanted) <= 1.001 * TOLERANCE
    usual = made.solutions.reached & (
        np.array([stiffness(q) for q in program]) > 0.02
    )  # beside singularities joints are far apart by necessity
    assert usual.sum() > 50 and not made.other_configuration[usual].any()
    assert np.abs(joints - program)[usual].max() < 0.5 and np.median(np.abs(joints - program)[usual]) < 0.02


@pytest.mark.parametrize(("joints", "kind"), [(5, "torch"), (4, "point")])
def test_a_program_of_joints_of_few_axes_is_given_back_what_they_can(
    joints: int, kind: Literal["torch", "point"]
) -> None:
    """Four or five joints reach whole poses of another arm nowhere; the place of the tool they do."""
    arm = irb().replace(joints=irb().joints[:joints])
    nominal, real = arm, calibrated(arm, 12)
    program = random_joints(nominal, 60, seed=28, share=0.7)
    whole = truing.compensate(nominal, real, program, program=True)
    assert not whole.solutions.reached.any()
    made = truing.compensate(nominal, real, program, program=True, kind=kind)
    assert made.solutions.reached.mean() > 0.9 and made.other_configuration.mean() < 0.1
    for k in np.flatnonzero(made.solutions.reached):
        wanted = truing.forward_kinematics(nominal, program[k])[-1]
        found = truing.forward_kinematics(real, made.solutions.joints[k])[-1]
        assert position_off(found, wanted) <= 1.001 * TOLERANCE
        assert kind == "point" or np.linalg.norm(np.cross(found[:3, 2], wanted[:3, 2])) <= 1.001 * TOLERANCE
        assert position_off(truing.forward_kinematics(real, program[k])[-1], wanted) > 1e-5


def test_near_the_wrist_singularity_compensation_is_right_or_labelled() -> None:
    """Fake targets, corrected twice, leave 9.2 % of poses off by over 1 um and never converge on 1.2 %."""
    nominal, real = irb(), calibrated(irb(), 10)
    joints = random_joints(nominal, 60, seed=25, share=0.7)
    joints[:, 4] = np.random.default_rng(26).uniform(-0.01, 0.01, 60)
    wanted = poses_of(InverseSolver(nominal), joints)
    made = truing.compensate(nominal, real, wanted, seeds=joints)
    for T, one in zip(wanted, made, strict=True):
        if one.solution.reached:
            reached = truing.forward_kinematics(real, one.solution.joints)[-1]
            assert (
                position_off(reached, T) <= 1.001 * TOLERANCE
                and rotation_off(reached, T) <= 1.001 * TOLERANCE
            )
        else:
            assert one.solution.reason in ("limit", "singular", "out_of_reach")
    assert made.solutions.reached.mean() > 0.9


def test_the_standard_error_is_that_of_the_parameters() -> None:
    nominal, real = irb(), calibrated(irb(), 11)
    step, sigma = 1e-7, np.array([2e-5, 3e-5, 1e-4])
    covariance = np.diag(sigma**2)
    covariance[0, 1] = covariance[1, 0] = 0.6 * sigma[0] * sigma[1]
    wanted = poses_of(InverseSolver(real), random_joints(real, 10, seed=27, share=0.7))
    known = truing.files.Uncertainty(
        ("J2.a", "J3.d", "J4.alpha"),
        (real.joint("J2").a, real.joint("J3").d, real.joint("J4").alpha),
        covariance,
    )
    made = truing.compensate(nominal, real, wanted, uncertainty=known)
    assert np.isnan(truing.compensate(nominal, real, wanted).sigma).all()
    for one in made:
        T = truing.forward_kinematics(real, one.solution.joints)[-1]
        columns = []
        for name, value in (("J2", "a"), ("J3", "d"), ("J4", "alpha")):
            moved = real.copy()
            setattr(moved.joint(name), value, getattr(moved.joint(name), value) + step)
            D = truing.forward_kinematics(moved, one.solution.joints)[-1]
            W = (D[:3, :3] - T[:3, :3]) @ T[:3, :3].T / step
            columns.append([*((D[:3, 3] - T[:3, 3]) / step), W[2, 1], W[0, 2], W[1, 0]])
        J = np.array(columns).T
        assert one.sigma == pytest.approx(np.sqrt(np.diag(J @ covariance @ J.T)), rel=1e-3, abs=1e-9)


def test_robots_with_other_joints_are_refused() -> None:
    with pytest.raises(truing.InputError, match="9"):
        Compensator(irb(), gantry())
    with pytest.raises(truing.InputError, match="J9"):
        Compensator(irb(), irb()).set_uncertainty(["J9.a"], [0.0], [[1e-10]])
    with pytest.raises(truing.InputError, match="covariance"):
        Compensator(irb(), irb()).set_uncertainty(["J2.a"], [0.0], np.eye(2))


# ---- In Python -----------------------------------------------------------------------------------


def test_progress_counts_up_and_what_it_raises_stops_the_work() -> None:
    robot = irb()
    wanted = poses_of(InverseSolver(robot), random_joints(robot, 500, seed=28))
    seen: list[int] = []
    truing.inverse(robot, wanted, threads=1, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 500 and len(seen) > 2

    class Enough(Exception):
        pass

    def stop(done: int) -> None:
        if done > 100:
            raise Enough

    for run in (
        lambda: truing.inverse(robot, wanted, progress=stop),
        lambda: truing.compensate(robot, robot, wanted, progress=stop),
        lambda: truing.inverse_path(robot, wanted, progress=stop),
    ):
        with pytest.raises(Enough):
            run()


def test_ctrl_c_stops_a_batch() -> None:
    import _thread

    robot = gantry()
    wanted = poses_of(InverseSolver(robot), random_joints(robot, 64 * 40, seed=29))
    with pytest.raises(KeyboardInterrupt):
        truing.inverse(
            robot, wanted, threads=1, progress=lambda done: _thread.interrupt_main() if done == 128 else None
        )


def test_a_batch_is_a_sequence_and_arrays() -> None:
    robot = irb()
    solver = InverseSolver(robot)
    found = solver.solve_batch(poses_of(solver, random_joints(robot, 5, seed=30)))
    assert (
        len(found) == 5
        and found.joints.shape == (5, 6)
        and found.direction.shape == (5, 3)
        and found.branch.shape == (5,)
    )
    assert np.array_equal(found[2].joints, found.joints[2]) and found[-1].reason == found.reasons[4]
    with pytest.raises(IndexError):
        found[5]
    assert [s.reached for s in found] == found.reached.tolist()
    assert "5 of 5" in repr(found)


def test_tasks_scenes_and_options_survive_pickle_and_replace() -> None:
    task = Task(
        truing.frame_from_xyz_rpy([1, 2, 3], [0.1, 0.2, 0.3]),
        kind="torch",
        roll=(-0.1, 0.2),
        preferred_roll=0.05,
        lead=(0.0, 0.1),
        longest_retreat=0.02,
    )
    again = pickle.loads(pickle.dumps(task))
    assert np.array_equal(again.T_measurement_target, task.T_measurement_target) and (
        again.kind,
        again.roll,
        again.preferred_roll,
        again.lead,
    ) == ("torch", (-0.1, 0.2), 0.05, (0.0, 0.1))
    assert task.replace(kind="point").kind == "point" and task.kind == "torch"
    here = pickle.loads(pickle.dumps(scene(1.0)))
    assert [o.name for o in here.obstacles] == ["wall"] and here.capsules[0].link == "tool"
    options = InverseOptions(choose="manipulability", scene=scene(1.0))
    assert pickle.loads(pickle.dumps(options)).scene.obstacles[0].size.tolist() == [0.04, 4.0, 4.0]
    with pytest.raises(TypeError):
        InverseOptions(tolerance=1e-3)  # type: ignore[call-arg]
    conditions = Conditions(payload=2.0, direction=[1, 0, -1], covariates={"oil": 3.0})
    assert dict(pickle.loads(pickle.dumps(conditions)).covariates) == {"oil": 3.0}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda s: s.solve(Task(np.eye(4)), [0.0] * 5),
            "5 joint readings, the robot has 6",
        ),
        (lambda s: s.solve(Task(np.eye(4)), [0.0] * 40), "40 joint readings"),
        (lambda s: s.solve(Task(np.eye(4)), [math.nan] * 6), "not a finite number"),
        (lambda s: s.solve(Task(2 * np.eye(4))), "rigid"),
        (lambda s: s.solve(Task(np.full((4, 4), math.nan))), "finite"),
        (
            lambda s: s.solve(Task(np.eye(4), kind="torch", axis=[0, 0, 2])),
            "unit length",
        ),
        (
            lambda s: s.solve(Task(np.eye(4), kind="torch", roll=(1.0, -1.0))),
            "window of roll is empty",
        ),
        (
            lambda s: s.solve(Task(np.eye(4)).replace(kind="flat")),
            "choose one of 'pose', 'torch', 'point'",
        ),
        (lambda s: s.branches(Task(np.eye(4), kind="torch")), "full pose"),
        (lambda s: s.solve_batch(np.eye(4)), "shape"),
        (lambda s: s.solve_batch([np.eye(4), np.full((4, 4), math.nan)]), "pose 1: .*NaN"),
        (lambda s: s.solve_batch(np.tile(np.eye(4), (3, 1, 1)), np.zeros((2, 6))), "2 seeds for 3"),
        (lambda s: s.solve_batch(np.tile(np.eye(4), (3, 1, 1)), np.zeros((3, 5))), r"found \(3, 5\)"),
        (
            lambda s: s.solve_batch(np.tile(np.eye(4), (3, 1, 1)), conditions=[Conditions()] * 2),
            "2 conditions for 3",
        ),
        (
            lambda s: s.path(np.tile(np.eye(4), (3, 1, 1)), options=PathOptions(rolls=0)),
            "rolls",
        ),
        (lambda s: s.forward([math.inf] * 6), "finite"),
        (
            lambda _: InverseSolver(irb(), InverseOptions(position_tolerance=-1.0)),
            "position_tolerance",
        ),
        (lambda _: InverseSolver(irb(), target=3), "target"),
        (lambda _: truing.inverse(irb(), "poses.csv"), "array of numbers"),
        (lambda _: truing.inverse(irb(), []), "shape"),
        (
            lambda _: InverseSolver(
                irb(),
                InverseOptions(
                    scene=Scene(
                        capsules=[LinkCapsule("c", link="J9", start=[0, 0, 0], end=[0, 0, 1], radius=0.1)]
                    )
                ),
            ),
            "J9",
        ),
    ],
)
def test_what_cannot_be_used_is_refused(call: object, message: str) -> None:
    with pytest.raises(truing.InputError, match=message):
        call(InverseSolver(irb()))  # type: ignore[operator]
