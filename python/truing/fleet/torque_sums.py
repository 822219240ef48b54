# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A pass over a fleet's recordings of torques: every partition is summed to normal equations of each joint's
torque, which add up.

As in a pass over positions, what a worker does depends on the partition and its task alone, and sums are
taken in the order of the partitions. Nothing here leaves an addition to a library for linear algebra, whose
order may depend on how many threads a process has.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.source import RecordingPartition, Source
from truing.fleet.workers import Workers

Floats = NDArray[np.float64]

AT_A_TIME = 16  # sums that one task adds, in their order
_PARTS = 10  # of equal time that a recording is cut into; some are held out


@dataclass(frozen=True)
class JointSum:
    """Normal equations of one joint's torque. x: columns of its parameters, then the nominal torque; y: the
    measured torque less the nominal one [Nm | N]. Rows at which the joint moves.
    """

    xx: Floats  # shape=(p + 1, p + 1)
    xy: Floats  # shape=(p + 1,)
    yy: float
    rows: float

    def __add__(self, other: JointSum) -> JointSum:
        if not other.rows:
            return self
        if not self.rows:
            return other
        return JointSum(self.xx + other.xx, self.xy + other.xy, self.yy + other.yy, self.rows + other.rows)

    def squares(self, at: Floats) -> float:
        """Sum of squared errors of x at. at: shape=(p + 1,)"""
        return float(self.yy - 2.0 * at @ self.xy + at @ self.xx @ at) if self.rows else 0.0


Joints = tuple[JointSum, ...]  # one for each joint that has a reading


@dataclass(frozen=True)
class ArmSums:
    """Of one arm: rows to fit, rows of the times that are held out, and those of recordings marked as test.
    scores: shape=(m, m), sum over blocks of time of g gᵀ, g the gradient of a block's rows; (0, 0): none.
    """

    fitted: Joints
    held_out: Joints
    marked: Joints
    recordings: int
    blocks: int  # of time, that are fitted
    scores: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def __add__(self, other: ArmSums) -> ArmSums:
        return ArmSums(
            _added(self.fitted, other.fitted),
            _added(self.held_out, other.held_out),
            _added(self.marked, other.marked),
            self.recordings + other.recordings,
            self.blocks + other.blocks,
            self.scores + other.scores,
        )


def _added(one: Joints, other: Joints) -> Joints:
    return tuple(a + b for a, b in zip(one, other, strict=True))


@dataclass(frozen=True)
class TorqueTotals:
    """Of some partitions: sums of each arm, what to know of the data, and partitions that cannot be read."""

    arms: Mapping[str, ArmSums]
    notes: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class ScoreTask:
    """Where one arm stands, for the scores. at: of each joint, shape=(p + 1,). turns: of each joint,
    shape=(p + 1, m), with the joint's weight: columns of all parameters of the fit by those of its sums.
    """

    at: tuple[Floats, ...]
    turns: tuple[Floats, ...]


@dataclass(frozen=True)
class TorqueTask:
    """What a pass does with every partition. scores: by arm; empty: none. marked: recordings are held out
    that are marked, and all times of the others are fitted.
    """

    robot: _core.Robot
    cutoff: float
    test_share: float
    scores: Mapping[str, ScoreTask] = field(default_factory=dict)
    marked: bool = False


# ---- What a worker does


def sum_recordings(partition: RecordingPartition, task: TorqueTask, frame: Any = None) -> TorqueTotals:
    """The sums of a partition's recordings, which are of one arm."""
    try:
        found, told = partition.recordings(task.robot)
        if not found:
            return TorqueTotals({}, told)
        sums = [_sums_of(recording, task, partition.arm) for recording in found]
    except InputError as error:
        text = str(error)
        return TorqueTotals({}, (), (text if partition.path in text else f"{partition.called}: {text}",))
    total = functools.reduce(lambda a, b: a + b, sums)
    return TorqueTotals({partition.arm: total}, (*told, *_notes(found, task.robot)))


def _sums_of(recording: _core.Recording, task: TorqueTask, arm: str) -> ArmSums:
    joints = len(task.robot.driven_joints())
    options = _core.TorqueSumOptions(cutoff=task.cutoff)
    sums = [_joint_sum(block) for block in _core.sum_torques(task.robot, recording, options)]
    blocks = [tuple(sums[k : k + joints]) for k in range(0, len(sums), joints)]
    none: Joints = (JointSum(np.zeros((0, 0)), np.zeros(0), 0.0, 0.0),) * joints
    if recording.test:
        return ArmSums(none, none, functools.reduce(_added, blocks, none), 1, 0, _scores([], task, arm))
    held = [not task.marked and is_held_out(k, len(blocks), task.test_share) for k in range(len(blocks))]
    kept = [block for block, out in zip(blocks, held, strict=True) if not out]
    other = [block for block, out in zip(blocks, held, strict=True) if out]
    return ArmSums(
        functools.reduce(_added, kept, none),
        functools.reduce(_added, other, none),
        none,
        1,
        sum(any(joint.rows for joint in block) for block in kept),
        _scores(kept, task, arm),
    )


def _joint_sum(block: _core.TorqueBlock) -> JointSum:
    return JointSum(np.array(block.gram), np.array(block.right), block.squares, block.rows)


def is_held_out(block: int, blocks: int, share: float) -> bool:
    """Whether a block of time is held out: of ten equal parts of the recording those at which the part's
    number times the share passes a half, evenly spread.
    """
    part = block * _PARTS // blocks
    return bool(np.floor((part + 1) * share + 0.5) > np.floor(part * share + 0.5))


def _scores(blocks: Sequence[Joints], task: TorqueTask, arm: str) -> Floats:
    """shape=(m, m)"""
    if arm not in task.scores:
        return np.zeros((0, 0))
    where = task.scores[arm]
    m = where.turns[0].shape[1]
    out = np.zeros((m, m))
    for block in blocks:
        gradient = np.zeros(m)
        for joint, at, turn in zip(block, where.at, where.turns, strict=True):
            if joint.rows:
                slope = np.einsum("ij,j->i", joint.xx, at) - joint.xy
                gradient += np.einsum("ij,i->j", turn, slope)
        out += np.multiply.outer(gradient, gradient)
    return out


def _notes(recordings: Sequence[_core.Recording], robot: _core.Robot) -> tuple[str, ...]:
    unknown = [
        robot.joints[k].name for k in robot.driven_joints() if robot.joints[k].torque_per_ampere is None
    ]
    if not unknown or any(np.size(recording.torque) for recording in recordings):
        return ()
    return (
        f"torque_per_ampere is not known of {', '.join(unknown)}: 1 Nm/A is assumed, so masses and drive"
        " constants cannot be told apart, and all torques of these joints are in amperes",
    )


# ---- Adding up, and the passes


def add_totals(parts: Sequence[TorqueTotals]) -> TorqueTotals:
    """Sums of several lots of partitions, in their order."""
    arms: dict[str, ArmSums] = {}
    for part in parts:
        for name, sums in part.arms.items():
            arms[name] = arms[name] + sums if name in arms else sums
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return TorqueTotals(arms, notes, tuple(fault for part in parts for fault in part.faults))


def sum_all_torques(workers: Workers, source: Source, task: TorqueTask) -> TorqueTotals:
    """One pass: the sums of every arm, by name."""
    total = workers.run(sum_recordings, source, task, add_totals, AT_A_TIME)
    return TorqueTotals(dict(sorted(total.arms.items())), total.notes, total.faults)
