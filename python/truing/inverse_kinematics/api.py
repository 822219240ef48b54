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
from typing import TYPE_CHECKING, Any, Literal

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
from truing.keywords import made, takes

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import InverseKeywords, PathKeywords

Kind = Literal["pose", "torch", "point"]
Targets = Sequence[Task] | TargetData | ArrayLike
GivenConditions = Conditions | Sequence[Conditions] | None
Progress = Callable[[int], object]


@takes(_core.InverseOptions)
def inverse(
    robot: Robot,
    targets: Targets,
    *,
    kind: Kind = "pose",
    seeds: ArrayLike | None = None,
    conditions: GivenConditions = None,
    target: int = 0,
    threads: int = 0,
    progress: Progress | None = None,
    **options: Unpack[InverseKeywords],
) -> Solutions:
    """Joint readings that bring the robot's tool to each target, effects included. The result says which
    targets are not reached, and why.

    robot: nominal or calibrated. targets: shape=(n, 4, 4) [m] poses in the measurement frame, a sequence of
    `Task`, or what `load_targets` read.
    kind: of poses given as an array: "pose", "torch" (roll about the tool's z is free) or "point" (position
    alone).
    seeds: shape=(driven joints,) or (n, driven joints) [rad | m], where the robot comes from; None: those of
    the file, or the middle of the joints' ranges.
    conditions: payload, approach direction …, one or one per target; None: those of the file.
    target: which of the robot's targets is brought there, its index.
    threads: 0: as many as the machine has; the solutions are the same for any number. progress: called with
    targets done, now and then.
    options: fields of `InverseOptions`.

    For many calls with one robot make an `InverseSolver` once. Raises InputError on robots, targets or
    options that cannot be used.
    """
    tasks = _tasks(targets)
    given = _conditions(targets, conditions)
    solver = InverseSolver(robot, made(_core.InverseOptions, options), _first(given), target=target)
    return solver.solve_batch(
        tasks,
        _seeds(targets, seeds),
        given,
        like=Task(np.eye(4), kind=kind),
        threads=threads,
        progress=progress,
    )


@takes(_core.PathOptions)
def inverse_path(
    robot: Robot,
    targets: Targets,
    *,
    kind: Kind = "pose",
    seed: ArrayLike | None = None,
    scene: Scene | None = None,
    conditions: Conditions | None = None,
    target: int = 0,
    progress: Progress | None = None,
    **options: Unpack[PathKeywords],
) -> JointPath:
    """Joints along a sequence of targets, in the shortest steps. Where no step keeps within the bounds, the
    result lists a gap.

    robot, targets, kind, scene, target, progress: as in `inverse`. seed: shape=(driven joints,) [rad | m],
    where the robot comes from.
    conditions: of the whole path; None: those of the file, whose rows must agree.
    options: fields of `PathOptions`.

    Raises InputError as `inverse` does.
    """
    tasks = _tasks(targets)
    given = (
        targets.path_conditions() if conditions is None and isinstance(targets, TargetData) else conditions
    )
    solver = InverseSolver(robot, _core.InverseOptions(scene=scene or Scene()), given, target=target)
    steps = made(_core.PathOptions, options)
    seeds = _seeds(targets, seed)
    first = None if seeds is None else seeds if seeds.ndim == 1 else seeds[0]
    return solver.path(tasks, first, steps, given, like=Task(np.eye(4), kind=kind), progress=progress)


@takes(_core.InverseOptions)
def compensate(
    nominal: Robot,
    calibrated: Robot,
    targets: Targets,
    *,
    program: bool = False,
    kind: Kind = "pose",
    seeds: ArrayLike | None = None,
    conditions: GivenConditions = None,
    target: int = 0,
    in_base: bool = False,
    uncertainty: Uncertainty | None = None,
    threads: int = 0,
    progress: Progress | None = None,
    **options: Unpack[InverseKeywords],
) -> Compensations:
    """Commands for a controller that has the nominal model, so that the calibrated robot reaches the targets.

    nominal: the controller's model. calibrated: what `identify` found. targets: as in `inverse`; or, with
    `program`, joint positions, shape=(n, driven joints) [rad | m], at which the nominal robot's poses are the
    targets. A file with joints and no poses is a program. Arms of less than six joints can seldom be given
    back whole poses: kind says what of them is wanted.
    kind, seeds, conditions, target, threads, progress: as in `inverse`. The seed decides the configuration.
    in_base: poses and commands are in each robot's own base frame, as programs have them; else in the
    measurement frame.
    uncertainty: what `load_uncertainty` read, for the standard error of where the tool will be.
    options: fields of `InverseOptions`.

    Raises InputError as `inverse` does, and when the robots have different joints.
    """
    given = _conditions(targets, conditions)
    chosen = _core.CompensateOptions(inverse=made(_core.InverseOptions, options), in_base=in_base)
    maker = Compensator(nominal, calibrated, chosen, _first(given), target=target)
    like = Task(np.eye(4), kind=kind)
    if uncertainty is not None:
        maker.set_uncertainty(uncertainty.names, uncertainty.values, uncertainty.covariance)
    if program or isinstance(targets, TargetData) and targets.is_program:
        return maker.joints_batch(_program(targets), given, like=like, threads=threads, progress=progress)
    return maker.pose_batch(
        _tasks(targets),
        _seeds(targets, seeds),
        given,
        like=like,
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
