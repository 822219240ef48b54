# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Performance of a robot after ISO 9283:1998, with intervals: assess.

measured = truing.files.load_measured("measured.csv")
found = truing.performance.assess(measured, truing.files.load_commanded("poses.csv"))
found.quantities[0].value, found.quantities[0].interval
"""

from __future__ import annotations

from truing._core import Robot
from truing.errors import InputError
from truing.files.performance_file import CommandedPoses, MeasuredPoses
from truing.performance.alignment import aligned, moved
from truing.performance.assessment import Assessment, Findings
from truing.performance.paths import find_paths
from truing.performance.poses import find_directions, find_distance, find_poses
from truing.performance.warm_up import find_warm_ups


def assess(
    measured: MeasuredPoses,
    commanded: CommandedPoses | None = None,
    *,
    align: bool = False,
    robot: Robot | None = None,
    seed: int = 0,
) -> Assessment:
    """Every characteristic of ISO 9283 that the measurements give, each with its 95 % interval.

    measured: what `load_measured` read. commanded: what `load_commanded` read; without it accuracies (AP, AD,
    AT, dAP) are not found, repeatabilities are.
    align: the instrument's frame is not the robot's base: fit the one to the other by the poses of the test.
    AP then leaves out what a rigid motion explains.
    robot: of a warm-up with joints and temperatures, say what the thermal effects of the catalogue would
    compensate. seed: of the bootstrap.

    Raises InputError on a commanded pose that is missing, a cycle that is there twice, and on measurements
    that plainly are in another frame than the commands.
    """
    if align and commanded is None:
        raise InputError("the frame can be fitted to commanded poses alone, and there are none")
    alignment = aligned(measured, commanded) if align and commanded is not None else None
    if alignment is not None:
        measured = moved(measured, alignment.T_commanded_measured)
    found = Findings(measured, commanded, seed)
    for load, speed in found.conditions():
        found.now(load, speed)
        find_poses(found)
        find_directions(found)
        find_distance(found)
        find_paths(found)
        find_warm_ups(found, robot)
    if not found.quantities:
        why = "; ".join(sorted({f"{one.name} at {one.at}: {one.why}" for one in found.missing}))
        raise InputError(f"{measured.file}: no characteristic can be found ({why})")
    return Assessment(
        tuple(found.quantities), tuple(found.missing), tuple(found.warm_ups), alignment, tuple(found.warnings)
    )
