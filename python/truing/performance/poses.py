# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of poses: AP and RP, vAP of several directions, AD and RD between two of them."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.performance import intervals
from truing.performance.assessment import FAR, Findings, in_order
from truing.performance.quantities import (
    distances,
    largest_distance,
    pose_accuracy,
    pose_repeatability,
    three_deviations,
)
from truing.rotations import rotation_vectors

Floats = NDArray[np.float64]
_ANGLES = ("a", "b", "c")  # about x, y, z


def find_poses(found: Findings) -> None:
    """AP and RP of every pose."""
    m = found.measured
    every = found.rows("pose")
    for pose in in_order(m.pose[row] for row in every):
        rows = found.cycles(every[[m.pose[row] == pose for row in every]], "pose", pose)
        if found.few("AP, RP", pose, len(rows)):
            continue
        attained, command = m.position[rows], found.command(pose)
        _accuracy(found, pose, attained, None if command is None else command[0])
        found.add(
            "RP",
            pose,
            pose_repeatability(attained),
            len(rows),
            partial(intervals.repeatability_interval, attained),
        )
        if m.rotation is not None:
            _angles(found, pose, m.rotation[rows], None if command is None else command[1])


def _accuracy(found: Findings, pose: str, attained: Floats, command: Floats | None) -> None:
    if command is None:
        found.lacks("AP", pose, "there are no commanded poses")
        return
    value = float(pose_accuracy(attained, command))
    if value > FAR:
        raise InputError(
            f"{found.measured.file}: {pose} is {value:.4g} m from where it was commanded: another frame,"
            " another unit or another tool; measured positions are in the robot's base, unless the frame is"
            " to be fitted (--align)"
        )
    found.add(
        "AP",
        pose,
        value,
        len(attained),
        partial(intervals.length_interval, attained - command),
    )


def _angles(found: Findings, pose: str, rotations: Floats, command: Floats | None) -> None:
    """AP and RP of the angles about x, y, z: rotation vectors from the commanded orientation, or from the
    first one.
    """
    turned = rotation_vectors(rotations @ (rotations[0] if command is None else command).T)
    n = len(turned)
    if command is None:
        found.lacks("AP of angles", pose, "there are no commanded orientations")
    for letter, angles in zip(_ANGLES, turned.T, strict=True):
        if command is not None:
            found.add(
                f"AP_{letter}",
                pose,
                float(angles.mean()),
                n,
                partial(intervals.mean_interval, angles),
                "rad",
            )
        found.add(
            f"RP_{letter}",
            pose,
            three_deviations(angles),
            n,
            partial(intervals.deviation_interval, angles),
            "rad",
        )


def find_directions(found: Findings) -> None:
    """vAP of every pose that was approached from several directions."""
    m = found.measured
    every = found.rows("approach")
    for pose in in_order(m.pose[row] for row in every):
        of_pose = every[[m.pose[row] == pose for row in every]]
        groups = [
            m.position[found.cycles(of_pose[m.approach[of_pose] == k], "approach", f"{pose} from {k}")]
            for k in np.unique(m.approach[of_pose])
        ]
        fewest = min(len(group) for group in groups)
        if len(groups) < 2:
            found.lacks("vAP", pose, "approached from one direction alone")
        elif not found.few("vAP", pose, fewest):
            found.add(
                "vAP",
                pose,
                largest_distance([group.mean(axis=0) for group in groups]),
                fewest,
                partial(intervals.directions_interval, groups),
            )


def find_distance(found: Findings) -> None:
    """AD and RD between P2 and P4, of the cycles that have both."""
    m = found.measured
    every = found.rows("pose")
    first, second = (every[[m.pose[row] == pose for row in every]] for pose in ("P2", "P4"))
    both, i, j = np.intersect1d(m.cycle[first], m.cycle[second], return_indices=True)
    if not len(first) or not len(second) or found.few("AD, RD", "P2-P4", len(both)):
        return
    attained = distances(m.position[first[i]], m.position[second[j]])
    here, there = found.command("P2"), found.command("P4")
    if here is None or there is None:
        found.lacks("AD", "P2-P4", "there are no commanded poses")
    else:
        off = attained - float(np.linalg.norm(here[0] - there[0]))
        found.add("AD", "P2-P4", float(off.mean()), len(both), partial(intervals.mean_interval, off))
    found.add(
        "RD",
        "P2-P4",
        three_deviations(attained),
        len(both),
        partial(intervals.deviation_interval, attained),
    )
