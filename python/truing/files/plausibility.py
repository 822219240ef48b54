# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Do measured values look like the units that their columns name?

A wrong unit is caught only where the data leave no doubt: small motions, odd robots and gross outliers must
not be refused. Where the size of the numbers alone could mislead, the robot's own forward kinematics is
asked: positions that follow the model's at a scale of 1000 are in millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.files.common import listed
from truing.files.table import Floats, Table, sample_rows

_DEGREE = math.pi / 180.0
_SPREAD_ROWS = 20_000  # rows to judge a spread from
_POSE_ROWS = 200  # rows to run forward kinematics on
_ROBOT_REACHES = 20.0  # positions spread over more than this many reaches are in another unit
_ALIKE = 0.8  # fraction of the positions' variance that the model must explain before it counts as a witness


def check_units_look_right(
    table: Table,
    robot: _core.Robot,
    joints: Sequence[_core.Joint],
    units: Mapping[str, str],
    columns: Mapping[str, Any],
) -> None:
    """Raises InputError when a column's values are plainly in another unit than its name says, and says why.

    joints: the driven ones. units: as the file has them, by role ("q1", "x", "dist"). columns: in SI units.
    """
    rows = sample_rows(table.rows, _SPREAD_ROWS)
    readings = [np.asarray(column)[rows] for column in columns["joints"]]
    _check_radians(table, joints, units, readings)

    targets = columns.get("targets")
    targets = np.zeros(len(rows), dtype=np.int32) if targets is None else targets[rows]
    # Targets sit at places of their own, perhaps unknown: one target's positions tell about the robot's
    # motion.
    one = targets == np.bincount(targets).argmax()
    reach = _reach(robot, joints, readings)
    if "positions" in columns:
        positions = np.column_stack([column[rows] for column in columns["positions"]])
        use = one & ~np.isnan(positions[:, 0])
        if use.sum() >= 4:
            pose = np.flatnonzero(use)[sample_rows(int(use.sum()), _POSE_ROWS)]
            witness = _Witness(robot, int(targets[pose[0]]), np.column_stack(readings)[pose], positions[pose])
            _check_degrees(table, joints, units, readings, witness)
            _check_one_joint(table, joints, units, witness)
            _check_positions(table, units, positions[use], reach, witness)
    if units.get("dist") == "m":
        distances = columns["distances"][rows]
        spread = _spread(distances[one & ~np.isnan(distances)])
        if reach > 0.0 and spread > _ROBOT_REACHES * reach:
            table.refuse(
                f"the distances vary by {spread:.4g} m, but the robot reaches no further than {reach:.3g} m:"
                " they look like millimetres; call the column dist_mm (or put the length unit of the robot"
                " file right)",
                column="dist_m",
            )


def check_joint_units_look_right(
    table: Table, joints: Sequence[_core.Joint], units: Mapping[str, str], readings: NDArray[np.float64]
) -> None:
    """Raises InputError when joint readings, shape=(n, driven joints) [rad | m], are plainly degrees in
    columns called _rad.
    """
    _check_radians(table, joints, units, list(readings.T))


def check_targets_look_right(
    table: Table,
    robot: _core.Robot,
    units: Mapping[str, str],
    positions: NDArray[np.float64],
    *,
    in_base: bool = False,
) -> None:
    """Raises InputError when wanted positions, shape=(n, 3) [m], are plainly in another unit than their
    columns say.

    What is merely out of reach is no error. in_base: positions are in the robot's base frame, not in the
    measurement frame.
    """
    joints = [robot.joints[index] for index in robot.driven_joints()]
    limits = [np.array([joint.lower, joint.upper]) for joint in joints]
    if not all(
        np.isfinite(ends).all()
        for joint, ends in zip(joints, limits, strict=True)
        if joint.type == "prismatic"
    ):
        return  # a rail without ends reaches everywhere
    reach = _reach(robot, joints, limits)
    base = np.zeros(3) if in_base else robot.T_measurement_base[:3, 3]
    distance = np.linalg.norm(positions - base, axis=1)
    names = _names(units, ("x", "y", "z"))
    far = distance > _ROBOT_REACHES * reach
    if reach > 0.0 and far.any():
        row = int(np.argmax(far))
        look = (
            "it looks like millimetres; call the columns x_mm, y_mm, z_mm"
            if distance[row] < 1000.0 * _ROBOT_REACHES * reach and units["x"] == "m"
            else "is its unit right?"
        )
        table.refuse(
            f"{names}: this target is {distance[row]:.4g} m from the robot's base, which reaches no further"
            f" than {reach:.3g} m: {look} (or put the robot's base right)",
            row=row,
        )
    if reach > 0.0 and units["x"] == "mm" and (np.linalg.norm(positions, axis=1) < reach / 100.0).all():
        table.refuse(
            f"{names}: all targets are within {1000.0 * np.linalg.norm(positions, axis=1).max():.4g} mm of"
            f" the origin, but the robot reaches {reach:.3g} m: they look like metres; call the columns x_m,"
            " y_m, z_m"
        )


def _names(units: Mapping[str, str], roles: Sequence[str]) -> str:
    return listed([f"{role}_{units[role]}" for role in roles])


def _check_radians(
    table: Table, joints: Sequence[_core.Joint], units: Mapping[str, str], readings: Sequence[Floats]
) -> None:
    """Columns called _rad that hold degrees."""
    moving, suspects, certain = 0, [], []
    for number, (joint, values) in enumerate(zip(joints, readings, strict=True), 1):
        if units[f"q{number}"] != "rad":
            continue
        moving += int(np.ptp(values) > 0.0)
        inside = (values >= joint.lower - 0.1) & (values <= joint.upper + 0.1)
        if (
            np.mean(np.abs(values) > 4.0 * math.pi) <= 0.5
            or inside.mean() > 0.5
            and math.isfinite(joint.upper - joint.lower)
        ):
            continue
        suspects.append(f"q{number}")
        in_degrees = values * _DEGREE
        if ((in_degrees >= joint.lower - 0.1) & (in_degrees <= joint.upper + 0.1)).all() and math.isfinite(
            joint.upper - joint.lower
        ):
            certain.append(f"q{number}")
    # A turntable may count its turns; that most joints do so is not to be believed.
    wrong = suspects if suspects and 2 * len(suspects) >= moving else certain
    if wrong:
        number = int(wrong[0][1:])
        joint, values = joints[number - 1], readings[number - 1]
        limits = (
            f", its limits are {joint.lower:.3g} to {joint.upper:.3g} rad"
            if math.isfinite(joint.upper - joint.lower)
            else ""
        )
        table.refuse(
            f"values from {values.min():.4g} to {values.max():.4g} look like degrees: more than two turns to"
            f" either side in most rows{limits}. The same holds for {len(wrong)} of the joints: call these"
            f" columns {listed([f'{role}_deg' for role in wrong])}, or convert the values",
            column=f"q{number}_rad",
        )


def _check_degrees(
    table: Table,
    joints: Sequence[_core.Joint],
    units: Mapping[str, str],
    readings: Sequence[Floats],
    witness: _Witness,
) -> None:
    """Columns called _deg that hold radians: all values are small, and the positions follow the model only if
    they are radians.
    """
    roles = [f"q{number}" for number, joint in enumerate(joints, 1) if joint.type == "revolute"]
    if not roles or any(units[role] != "deg" for role in roles):
        return
    in_file = [readings[int(role[1:]) - 1] / _DEGREE for role in roles]
    if max(float(np.abs(values).max()) for values in in_file) > math.pi + 0.06 or not any(
        np.ptp(values) > 0.0 for values in in_file
    ):
        return
    scale = witness.match(1.0).scale
    as_radians = witness.match(1.0 / _DEGREE)
    # In truth small motions fit the model at about its own size; radians taken for degrees make it some 57
    # times too small.
    if as_radians.explained > 0.9 and 0.5 < as_radians.scale < 2.0 and not 0.2 < scale < 5.0:
        table.refuse(
            f"all of {_names(units, roles)} lie within +-{math.pi:.4g}, and the measured positions follow the"
            " robot model only if these are radians: they look like radians; call the columns"
            f" {listed([f'{role}_rad' for role in roles])}, or convert the values"
        )


def _check_one_joint(
    table: Table, joints: Sequence[_core.Joint], units: Mapping[str, str], witness: _Witness
) -> None:
    """One column in another angle unit than its name says: the positions follow the model only when it alone
    is converted.
    """
    if witness.match(1.0).explained > 0.9:
        return
    best, wrong = 0.0, ""
    for number, joint in enumerate(joints, 1):
        if joint.type != "revolute":
            continue
        factors = np.ones(len(joints))
        factors[number - 1] = 1.0 / _DEGREE if units[f"q{number}"] == "deg" else _DEGREE
        explained = witness.match(factors).explained
        if explained > best:
            best, wrong = explained, f"q{number}"
    if best > 0.98:
        looks, word = ("rad", "radians") if units[wrong] == "deg" else ("deg", "degrees")
        table.refuse(
            f"the measured positions follow the robot model only if these are {word}: they look like {word};"
            f" call the column {wrong}_{looks}, or convert the values",
            column=f"{wrong}_{units[wrong]}",
        )


def _check_positions(
    table: Table, units: Mapping[str, str], positions: NDArray[np.float64], reach: float, witness: _Witness
) -> None:
    """Positions whose size is off by a thousand."""
    roles = ("x", "y", "z")
    spread = max(_spread(positions[:, axis]) for axis in range(3))
    names = _names(units, roles)
    if reach > 0.0 and spread > _ROBOT_REACHES * reach and any(units[role] == "m" for role in roles):
        table.refuse(
            f"{names}: the positions spread over {spread:.4g} m, but the robot reaches no further than"
            f" {reach:.3g} m: they look like millimetres; call the columns x_mm, y_mm, z_mm (or put the"
            " length unit of the robot file right)"
        )
    if spread < reach / 100.0 and any(units[role] == "mm" for role in roles):
        match = witness.match(1.0)
        if match.explained > _ALIKE and 1.0 / 3000.0 < match.scale < 1.0 / 300.0:
            table.refuse(
                f"{names}: the positions spread over {1000.0 * spread:.4g} mm only, and follow the robot"
                f" model at a scale of {match.scale:.2g}: they look like metres; call the columns x_m, y_m,"
                " z_m (or put the length unit of the robot file right)"
            )


def _spread(values: NDArray[np.float64]) -> float:
    """From the 10th to the 90th percentile: a few gross outliers do not matter."""
    if len(values) == 0:
        return 0.0
    low, high = np.percentile(values, (10.0, 90.0))
    return float(high - low)


def _reach(robot: _core.Robot, joints: Sequence[_core.Joint], readings: Sequence[Floats]) -> float:
    """No point of the robot is further than this from its base, targets at unknown places aside. [m]"""
    length = 0.0
    for joint in robot.joints:
        link = (
            joint.T_parent_joint[:3, 3] if robot.convention == "urdf" else np.array([joint.a, 0.0, joint.d])
        )
        length += float(np.linalg.norm(link))
    length += max(float(np.linalg.norm(target.T_last_target[:3, 3])) for target in robot.targets)
    strokes = [
        np.abs(values).max()
        for joint, values in zip(joints, readings, strict=True)
        if joint.type == "prismatic"
    ]
    return length + float(sum(strokes))


class _Match:
    """How well one set of points follows another: measured = scale * rotation * modelled + shift."""

    def __init__(self, modelled: NDArray[np.float64], measured: NDArray[np.float64]) -> None:
        a, b = modelled - modelled.mean(axis=0), measured - measured.mean(axis=0)
        size_a, size_b = float((a * a).sum()), float((b * b).sum())
        self.scale = self.explained = 0.0
        if size_a > 0.0 and size_b > 0.0 and math.isfinite(size_a * size_b):
            # Umeyama 1991, eq. 40 to 42; `explained` is the fraction of the measured variance.
            u, singular, vt = np.linalg.svd(b.T @ a)
            singular[2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
            self.scale = float(singular.sum()) / size_a
            self.explained = float(singular.sum()) ** 2 / (size_a * size_b)


class _Witness:
    """The robot model's own opinion of where the target was."""

    def __init__(
        self, robot: _core.Robot, target: int, readings: NDArray[np.float64], positions: NDArray[np.float64]
    ) -> None:
        self._robot = robot
        self._target = target
        self._readings = readings
        self._positions = positions
        self._revolute = np.array([robot.joints[index].type == "revolute" for index in robot.driven_joints()])

    def match(self, angle_factor: float | NDArray[np.float64]) -> _Match:
        """Measured against modelled positions, the revolute joints' readings multiplied by `angle_factor`
        (one, or one each).
        """
        readings = np.where(self._revolute, self._readings * angle_factor, self._readings)
        modelled = [_core.forward_kinematics(self._robot, row, self._target)[-1, :3, 3] for row in readings]
        return _Match(np.array(modelled), self._positions)
