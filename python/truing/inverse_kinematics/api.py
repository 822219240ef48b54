# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inverse kinematics and compensation: inverse, inverse_path, compensate. Each function hands its keywords to
the C++ core.

found = truing.inverse(robot, poses, kind="torch")  # poses: shape=(n, 4, 4), or what load_targets read
found.joints, found.reached, found.position_error

made = truing.compensate(nominal, calibrated, poses)
made.solutions.joints, made.T_command
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truing import _core
from truing._core import (
    Compensations,
    Compensator,
    Conditions,
    InverseSolver,
    JointPath,
    Robot,
    Scene,
    Solutions,
    Task,
)
from truing.errors import InputError
from truing.files import TargetData, Uncertainty

Kind = Literal["pose", "torch", "point"]
Choose = Literal["nearest", "limits_margin", "manipulability", "rail_travel"]
Targets = Sequence[Task] | TargetData | ArrayLike
GivenConditions = Conditions | Sequence[Conditions] | None
Progress = Callable[[int], object]

_USUAL = _core.InverseOptions()  # the defaults stand in inverse.hpp alone
_USUAL_PATH = _core.PathOptions()


def inverse(
    robot: Robot,
    targets: Targets,
    *,
    kind: Kind = "pose",
    seeds: ArrayLike | None = None,
    choose: Choose = _USUAL.choose,
    scene: Scene | None = None,
    conditions: GivenConditions = None,
    target: int = 0,
    position_tolerance: float = _USUAL.position_tolerance,
    rotation_tolerance: float = _USUAL.rotation_tolerance,
    max_restarts: int = _USUAL.max_restarts,
    threads: int = 0,
    progress: Progress | None = None,
) -> Solutions:
    """Joint readings that bring the robot's tool to each target, effects included. The result says which
    targets are not reached, and why.

    robot: nominal or calibrated. targets: shape=(n, 4, 4) [m] poses in the measurement frame, a sequence of
    `Task`, or what `load_targets` read.
    kind: of poses given as an array: "pose", "torch" (roll about the tool's z is free) or "point" (position
    alone).
    seeds: shape=(driven joints,) or (n, driven joints) [rad | m], where the robot comes from; None: those of
    the file, or the middle of the joints' ranges.
    choose: which of several solutions: "nearest" to the seed, "limits_margin", "manipulability" or
    "rail_travel".
    scene: obstacles, and capsules around links, that must not collide.
    conditions: payload, approach direction …, one or one per target; None: those of the file.
    target: which of the robot's targets is brought there, its index.
    position_tolerance: [m], rotation_tolerance: [rad] largest error of a solution. max_restarts: descents
    before a target counts as not reached.
    threads: 0: as many as the machine has; the solutions are the same for any number. progress: called with
    targets done, now and then.

    For many calls with one robot make an `InverseSolver` once. Raises InputError on robots, targets or
    options that cannot be used.
    """
    tasks = _tasks(targets)
    given = _conditions(targets, conditions)
    options = _core.InverseOptions(
        position_tolerance=position_tolerance,
        rotation_tolerance=rotation_tolerance,
        choose=choose,
        max_restarts=max_restarts,
        scene=scene or Scene(),
    )
    solver = InverseSolver(robot, options, _first(given), target=target)
    return solver.solve_batch(
        tasks,
        _seeds(targets, seeds),
        given,
        like=Task(np.eye(4), kind=kind),
        threads=threads,
        progress=progress,
    )


def inverse_path(
    robot: Robot,
    targets: Targets,
    *,
    kind: Kind = "pose",
    seed: ArrayLike | None = None,
    scene: Scene | None = None,
    conditions: Conditions | None = None,
    target: int = 0,
    longest_turn: float = _USUAL_PATH.longest_turn,
    longest_slide: float = _USUAL_PATH.longest_slide,
    rolls: int = _USUAL_PATH.rolls,
    rail_places: int = _USUAL_PATH.rail_places,
    smoothing: int = _USUAL_PATH.smoothing,
    progress: Progress | None = None,
) -> JointPath:
    """Joints along a sequence of targets, in the shortest steps. Where no step keeps within the bounds, the
    result lists a gap.

    robot, targets, kind, scene, target, progress: as in `inverse`. seed: shape=(driven joints,) [rad | m],
    where the robot comes from.
    conditions: of the whole path; None: those of the file, whose rows must agree.
    longest_turn: [rad], longest_slide: [m] of a joint between neighbouring targets. A larger step is a gap.
    rolls: samples of a torch's free roll. rail_places: samples of each rail. smoothing: rounds of smoothing.

    Raises InputError as `inverse` does.
    """
    tasks = _tasks(targets)
    given = (
        targets.path_conditions() if conditions is None and isinstance(targets, TargetData) else conditions
    )
    solver = InverseSolver(robot, _core.InverseOptions(scene=scene or Scene()), given, target=target)
    options = _core.PathOptions(
        longest_turn=longest_turn,
        longest_slide=longest_slide,
        rolls=rolls,
        rail_places=rail_places,
        smoothing=smoothing,
    )
    seeds = _seeds(targets, seed)
    first = None if seeds is None else seeds if seeds.ndim == 1 else seeds[0]
    return solver.path(tasks, first, options, given, like=Task(np.eye(4), kind=kind), progress=progress)


def compensate(
    nominal: Robot,
    calibrated: Robot,
    targets: Targets,
    *,
    program: bool = False,
    kind: Kind = "pose",
    seeds: ArrayLike | None = None,
    choose: Choose = _USUAL.choose,
    scene: Scene | None = None,
    conditions: GivenConditions = None,
    target: int = 0,
    in_base: bool = False,
    uncertainty: Uncertainty | None = None,
    threads: int = 0,
    progress: Progress | None = None,
) -> Compensations:
    """Commands for a controller that has the nominal model, so that the calibrated robot reaches the targets.

    nominal: the controller's model. calibrated: what `identify` found. targets: as in `inverse`; or, with
    `program`, joint positions, shape=(n, driven joints) [rad | m], at which the nominal robot's poses are the
    targets. A file with joints and no poses is a program.
    kind, seeds, choose, scene, conditions, target, threads, progress: as in `inverse`. The seed decides the
    configuration.
    in_base: poses and commands are in each robot's own base frame, as programs have them; else in the
    measurement frame.
    uncertainty: what `load_uncertainty` read, for the standard error of where the tool will be.

    Raises InputError as `inverse` does, and when the robots have different joints.
    """
    given = _conditions(targets, conditions)
    options = _core.CompensateOptions(
        inverse=_core.InverseOptions(choose=choose, scene=scene or Scene()), in_base=in_base
    )
    maker = Compensator(nominal, calibrated, options, _first(given), target=target)
    if uncertainty is not None:
        maker.set_uncertainty(uncertainty.names, uncertainty.values, uncertainty.covariance)
    if program or isinstance(targets, TargetData) and targets.is_program:
        return maker.joints_batch(_program(targets), given, threads=threads, progress=progress)
    return maker.pose_batch(
        _tasks(targets),
        _seeds(targets, seeds),
        given,
        like=Task(np.eye(4), kind=kind),
        threads=threads,
        progress=progress,
    )


def _tasks(targets: Targets) -> list[Task] | NDArray[np.float64]:
    """Tasks as they are; poses as an array, which the core makes tasks of."""
    if isinstance(targets, TargetData):
        if targets.is_program:
            raise InputError(f"{targets.path}: holds joint positions, expected poses")
        return list(targets.tasks)
    if isinstance(targets, Sequence) and len(targets) and all(isinstance(task, Task) for task in targets):
        return list(targets)
    frames = _array(targets, "targets")
    if frames.ndim != 3 or frames.shape[1:] != (4, 4) or not len(frames):
        raise InputError(f"targets has shape {frames.shape}, expected (n, 4, 4) poses, or a sequence of Task")
    return frames


def _program(targets: Targets) -> NDArray[np.float64]:
    joints = targets.joints if isinstance(targets, TargetData) else _array(targets, "targets")
    if joints is None:
        raise InputError("the file has no joint positions, which a program is made of")
    return joints


def _seeds(targets: Targets, seeds: ArrayLike | None) -> NDArray[np.float64] | None:
    if seeds is not None:
        return _array(seeds, "seeds")
    return targets.joints if isinstance(targets, TargetData) else None


def _conditions(targets: Targets, conditions: GivenConditions) -> Conditions | list[Conditions] | None:
    if conditions is None:
        return list(targets.conditions) if isinstance(targets, TargetData) and targets.conditions else None
    return conditions if isinstance(conditions, Conditions) else list(conditions)


def _first(conditions: Conditions | list[Conditions] | None) -> Conditions | None:
    """They say which inputs there are."""
    return conditions[0] if isinstance(conditions, list) else conditions


def _array(values: Any, name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {type(values).__name__}, expected an array of numbers") from None
