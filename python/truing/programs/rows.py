# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Joints, or hand poses, that a program commands, for a table of what was measured there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files import load_measurements
from truing.files.common import PathLike, joint_columns
from truing.files.program_poses import hand_poses, is_program, with_moves
from truing.files.stream_file import pose_columns
from truing.files.table import Beside
from truing.model import Robot
from truing.programs.apply import Applied, Outcome, apply_programs

Floats = NDArray[np.float64]


def commanded_joints(path: PathLike, robot: Robot) -> Beside:
    """Columns q1_rad … of what a program commands, for `load_measurements`: one row per move to a literal
    target, in the order in which the moves stand in the file.

    robot: as its controller believes it to be; joints of targets that are poses are those that it takes for
    them, by their configuration data. path: a program, or a table of `truing apply --poses-out`. Raises
    InputError where a row would not be known: moves that go to no literal target, a tool that is not defined.
    """
    path = Path(path)
    if not is_program(path):
        table = load_measurements(path, robot, joints_only=True)
        return Beside(path, joint_columns(robot, table.joints))
    try:
        outcome = apply_programs([with_moves(path)], robot, robot)
    except InputError as error:
        hint = (
            " (these options are those of `truing apply`; the table that its --poses-out writes is taken in"
            " place of the program)"
        )
        raise InputError(f"{error}{hint if '--' in str(error) else ''}") from None
    _require_every_move(outcome)
    moves = sorted((order, k) for k, one in enumerate(outcome.targets) for order in one.target.moves)
    if not moves:
        raise InputError(f"{path}: has no move to a literal target")
    return Beside(path, joint_columns(robot, np.array([_joints(outcome.targets[k]) for _, k in moves])))


def commanded_hand(path: PathLike) -> Beside:
    """Columns hand_x_m … hand_qz of what a program of poses commands, for `truing.files.load_handeye`: the
    flange in the robot base, one row per move to a literal target. Raises InputError likewise.
    """
    path = Path(path)
    if not is_program(path):
        raise InputError(f"{path}: expected a robot program: .src, .mod, .ls, .script or .jbi")
    return Beside(path, pose_columns(hand_poses(path), "hand_"))


def _require_every_move(outcome: Outcome) -> None:
    """A move that is left out would shift all rows after it."""
    left = [(path, stay.line, stay.what, stay.why) for path, stay in outcome.stays]
    left += [
        (one.source, one.target.line, one.target.name, one.why)
        for one in outcome.targets
        if one.target.moves and one.joints is None
    ]
    if left:
        path, line, what, why = min(left, key=lambda one: one[1])
        raise InputError(
            f"{path}, line {line}: {what}: {why}: its joints are not known, nor which row was measured there;"
            " expected a program of literal targets, or a table with columns q1_rad …"
        )


def _joints(one: Applied) -> Floats:
    assert one.joints is not None
    return one.joints
