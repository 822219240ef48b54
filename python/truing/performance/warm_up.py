# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of warm-ups: dAP, dRP, the course of the drift, and how much of it the catalogue's thermal effects would
compensate.

For that every second block is predicted from the others: what is left is what a compensated robot would have
shown.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing._core import Measurements, Robot
from truing.errors import InputError
from truing.files.performance_file import MeasuredPoses
from truing.identification import identify, predict
from truing.performance import intervals
from truing.performance.assessment import FEWEST, Findings, Ints, WarmUp, in_order
from truing.performance.quantities import drift, pose_accuracy, pose_repeatability

Floats = NDArray[np.float64]
_FEWEST_BLOCKS = 4
_PLACE = ("tool.x", "tool.y", "tool.z")  # what of the mean position is no matter of warmth


def find_warm_ups(found: Findings, robot: Robot | None) -> None:
    """dAP, dRP and the course of the warm-up at every pose."""
    m = found.measured
    every = found.rows("warm-up")
    for pose in in_order(m.pose[row] for row in every):
        rows = every[[m.pose[row] == pose for row in every]]
        numbers = np.unique(m.block[rows])
        blocks = [rows[m.block[rows] == number] for number in numbers]
        n = min(len(block) for block in blocks)
        if len(blocks) < 2 or n < FEWEST:
            found.lacks("dAP, dRP", pose, "fewer than two blocks, or fewer than three cycles in one")
            continue
        if n != max(len(block) for block in blocks):
            raise InputError(
                f"{m.file}: the blocks of the warm-up at {pose} have {n} to {max(map(len, blocks))} cycles,"
                " expected as many in each"
            )
        found.count(n, "warm-up", f"{pose}, each block of the warm-up")
        positions = np.stack([m.position[block] for block in blocks])
        time, timed = _block_times(m, blocks, numbers)
        command = found.command(pose)
        if command is None:
            found.lacks("dAP", pose, "there are no commanded poses")
        _drifts(found, pose, positions, time, None if command is None else command[0])
        course = WarmUp(
            pose,
            time - time[0],
            timed,
            None if m.temperature is None else np.array([m.temperature[b].mean() for b in blocks]),
            None if command is None else pose_accuracy(positions, command[0]),
            pose_repeatability(positions),
            _travel(positions),
        )
        found.warm_ups.append(_with_thermal_fit(course, m, rows, blocks, robot))


def _drifts(found: Findings, pose: str, positions: Floats, time: Floats, command: Floats | None) -> None:
    n = positions.shape[1]
    if command is not None:
        found.add(
            "dAP",
            pose,
            drift(pose_accuracy(positions, command)),
            n,
            partial(intervals.accuracy_drift_interval, positions - command, time),
        )
    found.add(
        "dRP",
        pose,
        drift(pose_repeatability(positions)),
        n,
        partial(intervals.repeatability_drift_interval, positions, time),
    )
    found.add(
        "travel",
        pose,
        float(_travel(positions).max()),
        n,
        partial(intervals.travel_interval, positions, time),
    )


def _travel(positions: Floats) -> Floats:
    """How far the barycentre of every block is from the first one's, shape=(blocks,) of (blocks, n, 3)."""
    means = positions.mean(axis=1)
    return np.asarray(np.linalg.norm(means - means[0], axis=-1))


def _block_times(m: MeasuredPoses, blocks: list[Ints], numbers: Ints) -> tuple[Floats, bool]:
    """Mean time of every block [s], or its number."""
    if m.time is None or not all(np.isfinite(m.time[block]).all() for block in blocks):
        return numbers.astype(np.float64), False
    time = np.array([m.time[block].mean() for block in blocks])
    if (np.diff(time) <= 0).any():
        raise InputError(f"{m.file}: the blocks of the warm-up are not in the order of their times (t_s)")
    return time, True


def _with_thermal_fit(
    course: WarmUp, m: MeasuredPoses, rows: Ints, blocks: list[Ints], robot: Robot | None
) -> WarmUp:
    if robot is None:
        return replace(course, why_not="no robot file is given")
    if m.joints is None or m.temperature is None:
        return replace(course, why_not="it needs the columns q1_rad … and temp_C")
    if not (np.isfinite(m.joints[rows]).all() and np.isfinite(m.temperature[rows]).all()):
        return replace(course, why_not="joints or temperatures of the warm-up have gaps")
    try:
        fit = fit_warm_up(robot, m.joints[rows], m.position[rows], m.temperature[rows], m.block[rows])
    except InputError as error:
        return replace(course, why_not=str(error))
    place = {row: k for k, row in enumerate(rows)}
    left = np.stack([[m.position[r] - fit.predicted[place[r]] for r in block] for block in blocks])
    means = left.mean(axis=1)
    return replace(course, compensated=np.linalg.norm(means - means[0], axis=-1), effects=fit.effects)


# ---- Thermal effects ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ThermalFit:
    """Thermal effects fitted to a warm-up."""

    effects: tuple[str, ...]  # names of the parameters that were found
    predicted: Floats  # shape=(n, 3) [m], each row by a fit that did not see its block


def fit_warm_up(
    robot: Robot, joints: Floats, positions: Floats, temperature: Floats, block: NDArray[np.int64]
) -> ThermalFit:
    """Fits every effect of the catalogue that temperature drives, and the tool's position.

    robot: its base frame is where it stands in the frame of the measurements, and is held.
    joints: shape=(n, driven joints) [rad | m]. positions: shape=(n, 3) [m]. temperature: shape=(n,) [deg C].
    block: shape=(n,), number of the block. Raises InputError where the data do not serve.
    """
    if joints.shape[1] != robot.driven_count:
        raise InputError(
            f"the warm-up has {joints.shape[1]} joint columns, the robot {robot.driven_count} driven joints"
        )
    blocks = np.unique(block)
    if len(blocks) < _FEWEST_BLOCKS:
        raise InputError(f"the warm-up has {len(blocks)} blocks, expected {_FEWEST_BLOCKS} or more")
    if float(np.ptp(temperature)) < 1.0:
        raise InputError(f"the temperature changed by {np.ptp(temperature):.2g} K, expected 1 K or more")
    data = Measurements(joints, positions=positions, temperature=temperature)
    effects = [one.name for one in _core.catalogue_effects() if one.traits.driver == "temperature"]
    predicted = np.empty_like(positions)
    odd = np.isin(block, blocks[::2])
    names: set[str] = set()
    for held_out in (odd, ~odd):
        seen = Measurements(
            joints[~held_out],
            positions=positions[~held_out],
            temperature=temperature[~held_out],
            pose=block[~held_out],  # one pose of the robot, but not one temperature
        )
        found = identify(
            robot,
            seen,
            free=list(_PLACE),
            hold="base.*",
            effects=effects,
            test_share=0.0,
            raise_if_not_converged=False,
        )
        if not found.solver.converged:
            raise InputError(f"the fit of the thermal effects failed: {found.solver.stopped_because}")
        names |= {one.name for one in found.parameters if not one.frozen and one.name not in _PLACE}
        found.robot.fitted_range = {}  # half of the blocks may lie beyond the other half's, by little
        predicted[held_out] = predict(found.robot, data).position[held_out]
    return ThermalFit(tuple(sorted(names)), predicted)
