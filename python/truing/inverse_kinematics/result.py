# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing ik`` and ``truing compensate`` found, as it is written: ``result.json``, ``joints.csv``,
``poses.csv``, the report.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.drawing import cause, differences, effects_of, robot_picture
from truing.files import Looks, TargetData, write_table
from truing.files.common import MOTIONS, joint_columns
from truing.inverse_kinematics.between import contacts_between
from truing.inverse_kinematics.page import Drawing, compensation_report, inverse_report
from truing.report.arrays import subsample
from truing.report.charts import AFTER
from truing.report.json_text import to_json, without_nan
from truing.report.rows import statistics
from truing.report.scene import RobotPicture
from truing.rotations import quaternions_from_rotations

INVERSE_FORMAT = "truing-inverse/1"
COMPENSATION_FORMAT = "truing-compensation/1"
AXES = ("x", "y", "z")
_ROBOTS_DRAWN = 3
_POSES_SHOWN = 300  # among which the reader of a report chooses

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Solved:
    """Everything that one run of ``truing ik`` came to."""

    data: TargetData
    solver: _core.InverseSolver
    solutions: Sequence[_core.Solution]  # one or more per target, in the order of the targets
    target: NDArray[np.intp]  # shape=(len(solutions),): which row of the file each is for
    all_branches: bool = False
    path: _core.JointPath | None = None
    steps: _core.PathOptions | None = None  # of the path


@dataclass(frozen=True)
class CompensatedProgram:
    """Everything that one run of ``truing compensate`` came to."""

    data: TargetData
    compensator: _core.Compensator
    results: _core.Compensations
    in_base: bool = False
    uncertain: bool = False  # standard errors are known


# ---- What both write -----------------------------------------------------------------------------


def is_commanded(solution: _core.Solution) -> bool:
    """Whether its joints are an answer: a failure's are the nearest that was found."""
    return solution.reason in ("reached", "retreated")


def status_text(solver: _core.InverseSolver, solution: _core.Solution) -> str:
    """The column `status`: "ok", or the reason in words."""
    return "ok" if solution.reached else solver.describe(solution)


def solution_columns(solver: _core.InverseSolver, solutions: Sequence[_core.Solution]) -> dict[str, Any]:
    """Columns of ``joints.csv``, one row per solution; no joints where the task is not met."""
    joints = _commanded_joints(solver, solutions)
    columns = joint_columns(solver.robot, joints)
    columns["status"] = [status_text(solver, s) for s in solutions]
    columns["position_error_m"] = np.array([s.position_error for s in solutions])
    columns["rotation_error_rad"] = np.array([s.rotation_error for s in solutions])
    columns["branch"] = np.array([s.branch for s in solutions], dtype=np.int64)
    return columns


def _commanded_joints(solver: _core.InverseSolver, solutions: Sequence[_core.Solution]) -> Floats:
    nothing = np.full(solver.driven_count, np.nan)
    return np.array([np.asarray(s.joints) if is_commanded(s) else nothing for s in solutions]).reshape(
        -1, solver.driven_count
    )


def _failure(solver: _core.InverseSolver, target: int, s: _core.Solution) -> dict[str, Any]:
    """Why a target is not reached, and the nearest that is."""
    found: dict[str, Any] = {"target": target, "reason": s.reason, "text": status_text(solver, s)}
    if s.reason == "retreated":
        return {**found, "retreat_m": s.retreat}
    if s.reason == "collision":
        return {
            **found,
            "pair": contact_names(solver, s),
            "own_parts": is_with_itself(solver, s),
            "distance_m": s.contact_distance,
        }
    unit = "rad" if s.position_error <= solver.options.position_tolerance else "m"
    found |= {f"miss_{unit}": s.miss, "direction": s.direction}
    if s.joint >= 0:
        joint = limited_joint(solver.robot, s.joint)
        found |= {"joint": joint.name, f"excess_{'rad' if joint.type == 'revolute' else 'm'}": s.excess}
    return {
        **found,
        "nearest": {
            "joints": s.joints,
            "position_error_m": s.position_error,
            "rotation_error_rad": s.rotation_error,
        },
    }


def limited_joint(robot: _core.Robot, index: int) -> _core.Joint:
    """As `Solution.joint` counts: driven joints, then passive ones that have limits."""
    driven = [robot.joints[k] for k in robot.driven_joints()]
    passive = [
        joint
        for joint in robot.joints
        if joint.passive and (np.isfinite(joint.lower) or np.isfinite(joint.upper))
    ]
    return [*driven, *passive][index]


def contact_names(solver: _core.InverseSolver, s: _core.Solution) -> list[str]:
    """The pair that collides."""
    if s.contact is None:
        return []
    scene = solver.options.scene
    names = [*(capsule.name for capsule in scene.capsules), *(obstacle.name for obstacle in scene.obstacles)]
    return [names[k] for k in s.contact]


def is_with_itself(solver: _core.InverseSolver, s: _core.Solution) -> bool:
    """Whether both of the pair are parts of the robot."""
    return s.contact is not None and max(s.contact) < len(solver.options.scene.capsules)


def _ranges(robot: _core.Robot, joints: Floats) -> list[dict[str, Any]]:
    """Of every driven joint its limits, and what of them is used."""
    rows = joints[np.isfinite(joints).all(axis=1)]
    found = []
    for k, index in enumerate(robot.driven_joints()):
        joint = robot.joints[index]
        used = [float(rows[:, k].min()), float(rows[:, k].max())] if len(rows) else None
        found.append(
            {
                "joint": joint.name,
                "unit": "rad" if joint.type == "revolute" else "m",
                "limits": [joint.lower, joint.upper],
                "used": used,
            }
        )
    return found


def _counts(solutions: Iterable[_core.Solution]) -> dict[str, int]:
    return dict(Counter(s.reason for s in solutions).most_common())


def _worst(solutions: Iterable[_core.Solution]) -> dict[str, Any]:
    met = [s for s in solutions if s.reached]
    return {
        "position_m": max((s.position_error for s in met), default=None),
        "rotation_rad": max((s.rotation_error for s in met), default=None),
    }


def _skeletons(robot: _core.Robot, joints: Floats) -> tuple[Floats, ...]:
    """The robot as lines, at a few of its positions."""
    rows = np.flatnonzero(np.isfinite(joints).all(axis=1))
    if not rows.size:
        return ()
    pick = rows[np.unique(np.linspace(0, rows.size - 1, min(_ROBOTS_DRAWN, rows.size)).astype(np.intp))]
    base = np.asarray(robot.T_measurement_base)[None, :3, 3]
    return tuple(
        np.concatenate([base, _core.forward_kinematics(robot, joints[row])[:, :3, 3]]) for row in pick
    )


def _picture(
    robot: _core.Robot,
    joints: Floats,
    looks: Looks | None,
    nominal: _core.Robot | None = None,
    in_base: bool = False,
) -> RobotPicture:
    """The robot at its targets; over the `nominal` one, where there is one, what makes it differ."""
    rows = subsample(np.flatnonzero(np.isfinite(joints).all(axis=1)), _POSES_SHOWN)
    poses = ([f"target {row}" for row in rows], joints[rows]) if rows.size else None
    if in_base:
        robot = robot.replace(T_measurement_base=np.eye(4))
    causes = []
    drawn = robot
    alike = nominal is not None and nominal.convention == robot.convention
    if nominal is not None and alike and [j.name for j in nominal.joints] == [j.name for j in robot.joints]:
        drawn = nominal.replace(T_measurement_base=robot.T_measurement_base)
        old = effects_of(nominal)
        effects = [effect for effect in effects_of(robot) if effect not in old]
        added = differences(drawn, robot)
        causes = [cause("all that was calibrated", AFTER, added=added, effects=effects)]
    stand = None if poses is None else poses[1][0]
    return robot_picture(drawn, causes=causes, poses=poses, stand=stand, looks=looks)


def _outlines(scene: _core.Scene) -> tuple[tuple[str, Floats], ...]:
    """Edges of boxes; of spheres and capsules circles, and of capsules lines between them."""
    gap = np.full((1, 3), np.nan)
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    found = []
    for o in scene.obstacles:
        if o.shape == "box":
            corners = (
                0.5
                * np.asarray(o.size)
                * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            )
            pieces = [corners[[a, b]] for a in range(8) for b in range(a) if (a ^ b) in (1, 2, 4)]
        else:
            end = np.array([0.0, 0.0, o.size[2] if o.shape == "capsule" else 0.0])
            pieces = [
                o.radius * circle,
                o.radius * circle + end,
                o.radius * circle[:, [0, 2, 1]],
                o.radius * circle[:, [2, 0, 1]] + end,
            ]
            pieces += (
                [np.array([side, side + end]) for side in o.radius * circle[::8]]
                if o.shape == "capsule"
                else []
            )
        line = np.concatenate([part for piece in pieces for part in (piece, gap)])
        T = np.asarray(o.T_measurement_shape)
        found.append((o.name, line @ T[:3, :3].T + T[:3, 3]))
    return tuple(found)


# ---- truing ik -----------------------------------------------------------------------------------


def first_of_each(solved: Solved) -> list[_core.Solution]:
    """The best answer of every target: branches come nearest first."""
    first = np.unique(solved.target, return_index=True)[1]
    return [solved.solutions[int(k)] for k in first]


def inverse_dict(solved: Solved, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing ik`` holds."""
    solver, solutions = solved.solver, first_of_each(solved)
    reached = [s for s in solutions if s.reached]
    found: dict[str, Any] = {
        "format": INVERSE_FORMAT,
        "version": _core.version(),
        "robot": solver.robot.name,
        "effects": [effect.effect for effect in solver.robot.effects],
        "closed_form": solver.closed_form,
        "tasks": dict(Counter(task.kind for task in solved.data.tasks)),
        "choose": solver.options.choose,
        "tolerance": {
            "position_m": solver.options.position_tolerance,
            "rotation_rad": solver.options.rotation_tolerance,
        },
        "targets": solved.data.count,
        "reached": len(reached),
        "reasons": _counts(solutions),
        "worst": _worst(solutions),
        "joints": _ranges(solver.robot, _commanded_joints(solver, solved.solutions)),
        "failures": [_failure(solver, k, s) for k, s in enumerate(solutions) if not s.reached],
    }
    if solved.all_branches:
        found["branches"] = {
            "rows": len(solved.solutions),
            "per_target": dict(Counter(int(n) for n in Counter(solved.target.tolist()).values())),
        }
    if not_empty(solver.options.scene):
        scene = solver.options.scene
        found["scene"] = {
            "capsules": len(scene.capsules),
            "obstacles": len(scene.obstacles),
            "clearance_m": scene.clearance,
        }
    if solved.path is not None and solved.steps is not None:
        found["path"] = _path(solved.path, solved.steps, solver.robot)
        if not_empty(solver.options.scene):
            found["path"]["collisions"] = _between(solved.path, solver)
    found["warnings"] = list(warnings)
    return found


def _between(path: _core.JointPath, solver: _core.InverseSolver) -> list[dict[str, Any]]:
    return [
        {
            "from": one.start,
            "to": one.start + 1,
            "first": one.first,
            "second": one.second,
            "distance_m": one.distance,
        }
        for one in contacts_between(path, solver)
    ]


def not_empty(scene: _core.Scene) -> bool:
    return bool(scene.capsules or scene.obstacles)


def _path(path: _core.JointPath, steps: _core.PathOptions, robot: _core.Robot) -> dict[str, Any]:
    joints = [robot.joints[k] for k in robot.driven_joints()]
    gaps = []
    for gap in path.gaps:
        joint = joints[gap.joint] if gap.joint >= 0 else None
        size = {} if joint is None else {f"step_{'rad' if joint.type == 'revolute' else 'm'}": gap.step}
        gaps.append(
            {"from": gap.start, "to": gap.start + 1, "joint": None if joint is None else joint.name, **size}
        )
    return {
        "continuous": path.continuous,
        "longest_turn_rad": path.longest_turn,
        "longest_slide_m": path.longest_slide,
        "bounds": {"turn_rad": steps.longest_turn, "slide_m": steps.longest_slide},
        "gaps": gaps,
    }


def inverse_columns(solved: Solved) -> dict[str, Any]:
    """Columns of ``joints.csv`` of ``truing ik``: one row per target in order; with all branches one per
    answer, and which target it is for.
    """
    columns = solution_columns(solved.solver, solved.solutions)
    if solved.all_branches:
        columns = {"target": solved.target.astype(np.int64), **columns}
    if any(task.kind == "torch" for task in solved.data.tasks):
        kinds = [solved.data.tasks[int(k)].kind for k in solved.target]
        columns["roll_rad"] = np.array(
            [s.roll if kind == "torch" else np.nan for s, kind in zip(solved.solutions, kinds, strict=True)]
        )
    if any(task.longest_retreat > 0 for task in solved.data.tasks):
        columns["retreat_m"] = np.array([s.retreat for s in solved.solutions])
    return columns


def write_inverse(
    folder: Path, solved: Solved, *, looks: Looks | None = None, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything that ``truing ik`` found into `folder`, and returns what result.json holds. looks: of
    the robot's links.
    """
    found: dict[str, Any] = without_nan(inverse_dict(solved, warnings=warnings))
    first = first_of_each(solved)
    joints = _commanded_joints(solved.solver, first)
    drawing = Drawing(
        wanted=np.array([np.asarray(task.T_measurement_target)[:3, 3] for task in solved.data.tasks]),
        reasons=tuple(s.reason for s in first),
        texts=tuple(status_text(solved.solver, s) for s in first),
        robots=_skeletons(solved.solver.robot, joints),
        joints=joints,
        obstacles=_outlines(solved.solver.options.scene),
        robot=_picture(solved.solver.robot, joints, looks),
    )
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    write_table(folder / "joints.csv", inverse_columns(solved))
    (folder / "report.html").write_text(inverse_report(found, drawing), encoding="utf-8")
    return found


# ---- truing compensate ---------------------------------------------------------------------------


def compensation_dict(
    made: CompensatedProgram, wanted: Floats, *, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing compensate`` holds. `wanted`: shape=(n, 4, 4) [m]."""
    solver, solutions = made.compensator.calibrated, list(made.results.solutions)
    met = np.array([s.reached for s in solutions])
    sigma = np.asarray(made.results.sigma)
    before, after = np.asarray(made.results.position_before), np.array([s.position_error for s in solutions])
    moved = np.linalg.norm(np.asarray(made.results.T_command)[:, :3, 3] - wanted[:, :3, 3], axis=1)
    found: dict[str, Any] = {
        "format": COMPENSATION_FORMAT,
        "version": _core.version(),
        "nominal": made.compensator.nominal.robot.name,
        "calibrated": solver.robot.name,
        "effects": [effect.effect for effect in solver.robot.effects],
        "targets": len(solutions),
        "from": "joints" if made.data.is_program else "poses",
        "frame": "base" if made.in_base else "measurement",
        "reached": int(met.sum()),
        "reasons": _counts(solutions),
        "before": statistics(np.where(met, before, np.nan)),
        "after": statistics(np.where(met, after, np.nan)),
        "correction": statistics(np.where(met, moved, np.nan)),
        "other_configuration": [
            k for k, other in enumerate(made.results.other_configuration) if other and met[k]
        ],
        "joints": _ranges(solver.robot, _commanded_joints(solver, solutions)),
        "failures": [_failure(solver, k, s) for k, s in enumerate(solutions) if not s.reached],
    }
    if made.uncertain and met.any():
        rms = np.sqrt(np.mean(sigma[met] ** 2, axis=0))
        found["standard_error"] = {
            "rms": dict(zip(MOTIONS, rms, strict=True)),
            "position_m": statistics(
                np.sqrt(np.sum(np.where(met[:, None], sigma, np.nan)[:, :3] ** 2, axis=1))
            ),
        }
    found["warnings"] = list(warnings)
    return found


def wanted_frames(made: CompensatedProgram) -> Floats:
    """shape=(n, 4, 4) [m]: of a program of joints the nominal robot's poses, in the frame that commands are
    in.
    """
    if not made.data.is_program:
        return np.array([np.asarray(task.T_measurement_target) for task in made.data.tasks])
    nominal = made.compensator.nominal
    assert made.data.joints is not None
    conditions = made.data.conditions or (None,) * made.data.count
    frames = np.array([nominal.forward(q, c) for q, c in zip(made.data.joints, conditions, strict=True)])
    return np.linalg.inv(nominal.robot.T_measurement_base) @ frames if made.in_base else frames


def compensation_columns(made: CompensatedProgram) -> dict[str, Any]:
    """Columns of ``joints.csv`` of ``truing compensate``: those of ``truing ik``, the error without
    compensation, and standard errors if they are known.
    """
    columns = solution_columns(made.compensator.calibrated, list(made.results.solutions))
    columns["position_before_m"] = np.asarray(made.results.position_before)
    columns["rotation_before_rad"] = np.asarray(made.results.rotation_before)
    columns["other_configuration"] = np.asarray(made.results.other_configuration).astype(np.int8)
    if made.uncertain:
        columns.update(
            {f"sigma_{name}": np.asarray(made.results.sigma)[:, k] for k, name in enumerate(MOTIONS)}
        )
    return columns


def pose_columns(made: CompensatedProgram) -> dict[str, Any]:
    """Columns of ``poses.csv``: the pose to command for every target; empty where it is not reached."""
    solutions = list(made.results.solutions)
    good = np.array([is_commanded(s) for s in solutions])
    frames = np.asarray(made.results.T_command)
    values = np.where(
        good[:, None],
        np.column_stack([frames[:, :3, 3], quaternions_from_rotations(frames[:, :3, :3])]),
        np.nan,
    )
    columns: dict[str, Any] = {
        name: values[:, k] for k, name in enumerate(("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"))
    }
    columns["other_configuration"] = np.asarray(made.results.other_configuration).astype(np.int8)
    columns["status"] = [status_text(made.compensator.calibrated, s) for s in solutions]
    return columns


def write_compensation(
    folder: Path, made: CompensatedProgram, *, looks: Looks | None = None, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything that ``truing compensate`` found into `folder`. Returns what result.json holds.
    looks: of the robot's links.
    """
    wanted = wanted_frames(made)
    found: dict[str, Any] = without_nan(compensation_dict(made, wanted, warnings=warnings))
    solver, solutions = made.compensator.calibrated, list(made.results.solutions)
    joints = _commanded_joints(solver, solutions)
    met = ~np.isnan(joints[:, 0])
    robots, obstacles = _skeletons(solver.robot, joints), _outlines(solver.options.scene)
    if made.in_base:  # all is drawn where the targets are
        R, p = (
            np.asarray(solver.robot.T_measurement_base)[:3, :3],
            np.asarray(solver.robot.T_measurement_base)[:3, 3],
        )
        robots, obstacles = (
            tuple((points - p) @ R for points in robots),
            tuple((name, (points - p) @ R) for name, points in obstacles),
        )
    drawing = Drawing(
        wanted=wanted[:, :3, 3],
        reasons=tuple(s.reason for s in solutions),
        texts=tuple(status_text(solver, s) for s in solutions),
        robots=robots,
        joints=joints,
        obstacles=obstacles,
        correction=np.where(
            met[:, None], np.asarray(made.results.T_command)[:, :3, 3] - wanted[:, :3, 3], np.nan
        ),
        before=np.where(met, np.asarray(made.results.position_before), np.nan),
        sigma=np.where(met[:, None], np.asarray(made.results.sigma), np.nan) if made.uncertain else None,
        robot=_picture(solver.robot, joints, looks, made.compensator.nominal.robot, made.in_base),
    )
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    write_table(folder / "joints.csv", compensation_columns(made))
    write_table(folder / "poses.csv", pose_columns(made))
    (folder / "report.html").write_text(compensation_report(found, drawing), encoding="utf-8")
    return found
