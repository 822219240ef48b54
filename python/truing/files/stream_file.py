# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files of a tracked arm: imu.csv, tracker.csv, joints.csv, plan.csv (CSV or Parquet, one row per sample),
and setup.yaml (format truing-track/1).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import PlainValidator

from truing import _core
from truing.errors import InputWarning, did_you_mean
from truing.files.common import PathLike, atomic_write, listed, write_table
from truing.files.table import Floats, Table
from truing.files.yaml_tree import (
    AngleName,
    Document,
    FreeMapping,
    LengthName,
    Number,
    Strict,
    Text,
    Vector3,
    expected,
    found,
)
from truing.rotations import quaternions_from_rotations, rotations_from_quaternions

SETUP_FORMAT = "truing-track/1"
FRAMES = ("T_tracker_base", "T_flange_receiver", "T_flange_tool", "T_flange_imu")

_SETUP = "set-up file"
_QUATERNION = ("qw", "qx", "qy", "qz")
_POSITION = ("x", "y", "z")
_OF_JOINT = re.compile(r"q([1-9][0-9]*)(?:_(.*))?", re.ASCII)
_NOT_UNIT = 1e-3  # a quaternion's length may be off by this
_TIMES = ("t", "arrival")
_LARGEST_TIME = 1e11  # [s] seconds since any epoch are fewer
_LARGEST = 1e6  # of everything else, in the file's own unit
_LONGEST_GAP = 3600.0  # [s] between two stamps of one recording
_SLOWEST = 10.0  # [s] a median step above this is no stream of seconds
_FARTHEST = 100.0  # [m] no tracker sees farther, no arm reaches farther
_FASTEST = 35.0  # [rad/s] what gyros end at: 2000 deg/s
_GRAVITY = (7.0, 13.0)  # [m/s^2] median of the specific force's length
_FASTEST_DRIFT = 0.01  # [s/s]
_LARGEST_BIAS = {
    "gyro_bias_rad_s": 0.5,
    "accel_bias_m_s2": 3.0,
}  # beyond those of cheap sensors, far below motion
_FEWEST = 2


@dataclass(frozen=True)
class ImuData:
    """Samples of an inertial sensor."""

    path: Path
    t: Floats  # shape=(n,) [s], increasing
    gyro: Floats  # shape=(n, 3) [rad/s]
    accel: Floats  # shape=(n, 3) [m/s^2] specific force
    arrival: Floats | None = None  # shape=(n,) [s]


@dataclass(frozen=True)
class TrackerData:
    """The receiver in the tracker frame."""

    path: Path
    t: Floats  # shape=(n,) [s]; with arrivals in any order, else increasing
    position: Floats  # shape=(n, 3) [m]
    orientation: Floats | None = None  # shape=(n, 4) w x y z, of unit length
    arrival: Floats | None = None  # shape=(n,) [s]


@dataclass(frozen=True)
class JointData:
    """Encoder readings."""

    path: Path
    t: Floats  # shape=(n,) [s], increasing
    joints: Floats  # shape=(n, driven joints) [rad | m]
    arrival: Floats | None = None  # shape=(n,) [s]


@dataclass(frozen=True)
class PoseData:
    """Poses of the tool in the base frame: planned, or true."""

    path: Path
    t: Floats  # shape=(n,) [s], increasing
    T: Floats  # shape=(n, 4, 4)
    arrival: Floats | None = None  # shape=(n,) [s]


@dataclass(frozen=True)
class ToolPoses:
    """Joints at prescribed poses of the tool, at the last test position."""

    path: Path
    pivot: Floats  # shape=(n, driven joints) [rad | m]: the tip on one point, in several orientations
    orientation: Floats  # shape=(m, driven joints): the tool in prescribed orientations
    prescribed: Floats  # shape=(m, 3, 3): R_base_tool of those


@dataclass(frozen=True)
class SetupData:
    """What setup.yaml holds: where things are, how sure that is, and what else `Tracker` should know."""

    setup: _core.TrackSetup
    covariance: Mapping[str, Floats] = field(
        default_factory=dict
    )  # by frame: shape=(6, 6) of position [m] and rotation vector about the parent's axes [rad]
    # [s/s] t_imu = t_tracker - clock_offset - clock_drift (t_tracker - clock_reference); taken off the stamps
    # before `Tracker` sees them
    clock_drift: float = 0.0
    clock_reference: float = 0.0  # [s] of the tracker's clock
    modes: _core.ModalModel = field(default_factory=_core.ModalModel)
    filter: Mapping[str, float] = field(
        default_factory=dict
    )  # of `FilterOptions`, where they are not the usual ones
    limits: Mapping[str, float] = field(default_factory=dict)  # of `CorrectionLimits`
    deviation: Mapping[str, float] = field(default_factory=dict)  # of `DeviationOptions`
    calibration: Mapping[str, Any] = field(default_factory=dict)  # where the values come from

    def steady(self, t: Floats) -> Floats:
        """Stamps of the tracker without the drift of its clock."""
        return t - self.clock_drift * (t - self.clock_reference)

    def options(self) -> _core.TrackOptions:
        """`TrackOptions` with the file's modes, filter and limits."""
        options = _core.TrackOptions(modes=self.modes)
        for target, values in (
            (options.filter, self.filter),
            (options.limits, self.limits),
            (options.deviation, self.deviation),
        ):
            for name, value in values.items():
                setattr(target, name, int(value) if isinstance(getattr(target, name), int) else value)
        return options


# ---- Streams -------------------------------------------------------------------------------------


class _Stream:
    """The table of a stream: required columns by stem and unit, t_s, arrival_s; refuses names that are almost
    right.
    """

    def __init__(self, path: PathLike, kind: str) -> None:
        self.table = Table(Path(path))
        self.kind = kind
        self.columns: dict[str, str] = {}
        self.taken: set[str] = set()

    def want(self, stem: str, units: Sequence[str], *, optional: bool = False) -> bool:
        """Whether there is a column of this stem; its unit has to be one of `units`, ("",) for none."""
        names = [f"{stem}_{unit}" if unit else stem for unit in units]
        present = [name for name in names if name in self.table.names]
        if len(present) > 1:
            self.table.refuse(
                f"there are two columns for it, {listed(present)}: remove one", column=present[0]
            )
        if present:
            self.columns[stem] = present[0]
            self.taken.add(present[0])
            return True
        other = next(
            (
                name
                for name in self.table.names
                if name.partition("_")[0] == stem.partition("_")[0] and name not in self.taken
            ),
            None,
        )
        if other is not None and (other == stem or other.startswith(f"{stem}_")):
            self.table.refuse(
                f"found the unit {other[len(stem) + 1 :] or 'nothing'!r} in the name, expected"
                f" {' or '.join(names)}",
                column=other,
            )
        if not optional:
            others = [name for name in self.table.names if name not in self.taken]
            hint = did_you_mean(names[0], others, 0.7)
            self.table.refuse(
                f"there is no column {names[0]} ({self.kind}); {hint}the columns are"
                f" {listed(self.table.names)}"
            )
        return False

    def read(self) -> None:
        self.want("t", ("s",))
        self.want("arrival", ("s",), optional=True)
        self.table.read(list(self.columns.values()), ())
        unknown = [name for name in self.table.names if name not in self.taken]
        if unknown:
            warnings.warn(
                InputWarning(
                    f"{self.table.path}: columns that a stream of this kind does not have are not used:"
                    f" {listed(unknown)}"
                ),
                stacklevel=3,
            )
        if self.table.rows < _FEWEST:
            self.table.refuse(f"has {self.table.rows} row, expected a stream of samples")

    def numbers(self, stem: str, *, gaps: bool = False) -> Floats:
        name = self.columns[stem]
        values = self.table.numbers(name, gaps=gaps, largest=_LARGEST_TIME if stem in _TIMES else _LARGEST)
        unit = name[len(stem) + 1 :]
        return values / 1000.0 if unit == "mm" else np.radians(values) if unit == "deg" else values

    def block(self, stems: Sequence[str], *, gaps: bool = False) -> Floats:
        return np.column_stack([self.numbers(stem, gaps=gaps) for stem in stems])

    def arrival(self) -> Floats | None:
        return self.numbers("arrival") if "arrival" in self.columns else None

    def times(self, *, ordered: bool) -> Floats:
        """The stamps; increasing where `ordered`."""
        t = self.numbers("t")
        step = float(np.median(np.abs(np.diff(t))))
        if step > _SLOWEST:
            self.table.refuse(
                f"samples are {step:.4g} apart: these look like milliseconds or counts, expected seconds",
                column="t_s",
            )
        gaps = np.flatnonzero(np.abs(np.diff(t)) > _LONGEST_GAP)
        if gaps.size:
            row = int(gaps[0]) + 1
            self.table.refuse(
                f"found {t[row]:.9g} after {t[row - 1]:.9g}, expected stamps of one recording: a wrong stamp,"
                " or another recording begins here",
                row=row,
                column="t_s",
            )
        wrong = np.flatnonzero(np.diff(t) <= 0) if ordered else np.empty(0, dtype=np.intp)
        if wrong.size:
            row = int(wrong[0]) + 1
            if t[row] == t[row - 1]:
                self.table.refuse(
                    f"found {t[row]:.9g} a second time, expected one row for each instant; {wrong.size} such"
                    " rows",
                    row=row,
                    column="t_s",
                )
            more = (
                " (rows in the order of their arrival need a column arrival_s)"
                if self.kind.startswith("tracker")
                else ""
            )
            self.table.refuse(
                f"time goes backwards: found {t[row]:.9g} after {t[row - 1]:.9g}, expected growing"
                f" times{more}",
                row=row,
                column="t_s",
            )
        return t

    def quaternions(self, *, gaps: bool = False) -> Floats:
        """shape=(n, 4), of unit length; rows of gaps stay NaN."""
        q = self.block(_QUATERNION, gaps=gaps)
        length = np.linalg.norm(q, axis=1)
        wrong = np.abs(length - 1.0) > _NOT_UNIT
        if wrong.any():
            row = int(np.argmax(wrong))
            self.table.refuse(
                f"the quaternion {' '.join(f'{value:.5g}' for value in q[row])} has length {length[row]:.5g},"
                " expected 1",
                row=row,
                column=self.columns["qw"],
            )
        return np.asarray(q / length[:, None])


def load_imu(path: PathLike) -> ImuData:
    """Read an inertial stream: t_s, gx_rad_s gy_rad_s gz_rad_s, ax_m_s2 ay_m_s2 az_m_s2 (specific force,
    +9.81 upward at rest), optional arrival_s.

    Raises InputError that names the line, the column, what was found and what was expected: time going
    backwards, deg/s, g, gravity taken off.
    """
    stream = _Stream(path, "inertial stream: angular velocity and specific force")
    gyro, accel = [f"g{axis}" for axis in _POSITION], [f"a{axis}" for axis in _POSITION]
    for stem in gyro:
        stream.want(stem, ("rad_s",))
    for stem in accel:
        stream.want(stem, ("m_s2",))
    stream.read()
    t = stream.times(ordered=True)
    data = ImuData(stream.table.path, t, stream.block(gyro), stream.block(accel), stream.arrival())
    rate, force = np.linalg.norm(data.gyro, axis=1), float(np.median(np.linalg.norm(data.accel, axis=1)))
    if np.percentile(rate, 90) > _FASTEST:
        stream.table.refuse(
            f"a tenth of the rates are above {np.percentile(rate, 90):.4g}: these look like deg/s, expected"
            " rad/s",
            column="gx_rad_s",
        )
    if not _GRAVITY[0] < force < _GRAVITY[1]:
        what = (
            "these look like g: multiply by 9.80665"
            if 0.7 < force < 1.3
            else (
                "gravity seems to have been taken off: the specific force itself is needed"
                if force < 5.0
                else "of another unit?"
            )
        )
        stream.table.refuse(
            f"the median length is {force:.4g}, expected about 9.81 m/s^2 (specific force, +9.81 upward at"
            f" rest); {what}",
            column="ax_m_s2",
        )
    return data


def load_tracker(path: PathLike) -> TrackerData:
    """Read a tracker's stream: t_s, x_m y_m z_m (or _mm) and, if the tracker gives them, qw qx qy qz;
    optional arrival_s. Rows of empty cells are left out.

    With arrival_s rows may be late, out of order and double; else times grow. Raises InputError that names
    line, column, found and expected.
    """
    stream = _Stream(path, "tracker: receiver in the tracker frame")
    for axis in _POSITION:
        stream.want(axis, ("m", "mm"))
    turned = [part for part in _QUATERNION if stream.want(part, ("",), optional=True)]
    if turned and len(turned) < 4:
        stream.table.refuse(
            f"there is {listed(turned)}, but not"
            f" {listed([part for part in _QUATERNION if part not in turned])}: a quaternion has four parts"
        )
    stream.read()
    t, arrival = stream.times(ordered="arrival" not in stream.columns), stream.arrival()
    position = stream.block(_POSITION, gaps=True)
    orientation = stream.quaternions(gaps=True) if turned else None
    both = position if orientation is None else np.column_stack([position, orientation])
    there = np.isfinite(both).all(axis=1)
    partly = np.isfinite(both).any(axis=1) & ~there
    if partly.any():
        row = int(np.argmax(partly))
        stream.table.refuse("found some empty cells, expected a whole pose or none", row=row)
    if there.sum() < _FEWEST:
        stream.table.refuse(f"has {int(there.sum())} rows with a pose, expected a stream of samples")
    if not there.all():
        warnings.warn(
            InputWarning(
                f"{stream.table.path}: {int((~there).sum())} of {len(t)} rows have no pose and are left out"
            ),
            stacklevel=2,
        )
    centre = np.median(position[there], axis=0)
    far = float(np.percentile(np.linalg.norm(position[there] - centre, axis=1), 90))
    if far > _FARTHEST or np.linalg.norm(centre) > _FARTHEST:
        stream.table.refuse(
            f"positions are {max(far, float(np.linalg.norm(centre))):.4g} m away: these look like"
            " millimetres; call the columns x_mm y_mm z_mm, or convert them",
            column=stream.columns["x"],
        )
    return TrackerData(
        stream.table.path,
        t[there],
        position[there],
        None if orientation is None else orientation[there],
        None if arrival is None else arrival[there],
    )


def load_joints(path: PathLike, robot: _core.Robot) -> JointData:
    """Read encoder readings: t_s, q1_rad … (or _deg; _m, _mm for prismatic joints), one for each driven joint
    of `robot`; optional arrival_s.

    Raises InputError that names the line, the column, what was found and what was expected.
    """
    stream = _Stream(path, "encoder readings")
    driven = [joint for joint in robot.joints if not joint.passive]
    stems = [f"q{k + 1}" for k in range(len(driven))]
    for stem, joint in zip(stems, driven, strict=True):
        stream.want(stem, ("rad", "deg") if joint.type == "revolute" else ("m", "mm"))
    more = [
        name
        for name in stream.table.names
        if (match := _OF_JOINT.fullmatch(name)) and int(match[1]) > len(driven)
    ]
    if more:
        stream.table.refuse(f"the robot {robot.name!r} has {len(driven)} driven joints", column=more[0])
    stream.read()
    t = stream.times(ordered=True)
    joints = stream.block(stems)
    for k, joint in enumerate(driven):
        if (
            joint.type == "revolute"
            and stream.columns[stems[k]].endswith("_rad")
            and np.median(np.abs(joints[:, k])) > 4 * math.pi
        ):
            stream.table.refuse(
                f"values from {joints[:, k].min():.4g} to {joints[:, k].max():.4g} look like degrees: call"
                f" the column {stems[k]}_deg, or convert them",
                column=stream.columns[stems[k]],
            )
    return JointData(stream.table.path, t, joints, stream.arrival())


def load_plan(path: PathLike) -> PoseData:
    """Read planned (or true) tool poses in the base frame: t_s, x_m y_m z_m (or _mm), qw qx qy qz; optional
    arrival_s, when a row was known.

    Raises InputError that names the line, the column, what was found and what was expected.
    """
    stream = _Stream(path, "planned tool in the base frame")
    for axis in _POSITION:
        stream.want(axis, ("m", "mm"))
    for part in _QUATERNION:
        stream.want(part, ("",))
    stream.read()
    t = stream.times(ordered=True)
    T = np.tile(np.eye(4), (len(t), 1, 1))
    T[:, :3, 3] = stream.block(_POSITION)
    T[:, :3, :3] = rotations_from_quaternions(stream.quaternions())
    if float(np.median(np.linalg.norm(T[:, :3, 3], axis=1))) > _FARTHEST:
        stream.table.refuse(
            "positions are hundreds of metres away: these look like millimetres; call the columns x_mm y_mm"
            " z_mm, or convert them",
            column=stream.columns["x"],
        )
    return PoseData(stream.table.path, t, T, stream.arrival())


def load_tool_poses(path: PathLike, robot: _core.Robot) -> ToolPoses:
    """Read the joints at prescribed poses of the tool: q1_rad …, `kind`, pivot (the tip on one point) or
    orientation, and for the latter qw qx qy qz of the tool in the base.

    Raises InputError that names the line, the column, what was found and what was expected.
    """
    table = Table(Path(path))
    driven = [joint for joint in robot.joints if not joint.passive]
    names = []
    for k, joint in enumerate(driven):
        units = ("rad", "deg") if joint.type == "revolute" else ("m", "mm")
        there = [f"q{k + 1}_{unit}" for unit in units if f"q{k + 1}_{unit}" in table.names]
        if not there:
            table.refuse(f"there is no column q{k + 1}_{units[0]}; the columns are {listed(table.names)}")
        names.append(there[0])
    if "kind" not in table.names:
        table.refuse(f"there is no column kind (pivot or orientation); the columns are {listed(table.names)}")
    turned = [part for part in _QUATERNION if part in table.names]
    if turned and len(turned) < 4:
        table.refuse(f"there is {listed(turned)} alone: a quaternion has four parts")
    table.read([*names, *turned], ["kind"])
    codes, words = table.labels("kind")
    kinds = np.array([*words, ""])[codes]
    wrong = ~np.isin(kinds, ("pivot", "orientation"))
    if wrong.any():
        table.refuse_cell(int(np.argmax(wrong)), "kind", "pivot or orientation")
    scale = {"rad": 1.0, "deg": math.pi / 180, "m": 1.0, "mm": 1e-3}
    joints = np.column_stack([scale[name.rpartition("_")[2]] * table.numbers(name) for name in names])
    pivot, orientation = kinds == "pivot", kinds == "orientation"
    prescribed = np.empty((0, 3, 3))
    if orientation.any():
        if not turned:
            table.refuse("rows of kind orientation need the columns qw qx qy qz: the tool in the base")
        q = np.column_stack([table.numbers(part, gaps=True) for part in _QUATERNION])
        off = orientation & ~(np.abs(np.linalg.norm(q, axis=1) - 1.0) <= _NOT_UNIT)
        if off.any():
            table.refuse(
                "expected a quaternion of length 1: the tool in the base",
                row=int(np.argmax(off)),
                column="qw",
            )
        prescribed = rotations_from_quaternions(q[orientation])
    return ToolPoses(table.path, joints[pivot], joints[orientation], prescribed)


def _with_arrival(columns: dict[str, Any], arrival: Floats | None) -> dict[str, Any]:
    return columns if arrival is None else {**columns, "arrival_s": arrival}


def pose_columns(T: Floats, prefix: str = "") -> dict[str, Floats]:
    """Columns x_m … qz of frames, shape=(n, 4, 4)."""
    q = quaternions_from_rotations(T[:, :3, :3])
    return {
        **{f"{prefix}{axis}_m": T[:, k, 3] for k, axis in enumerate(_POSITION)},
        **{f"{prefix}{part}": q[:, k] for k, part in enumerate(_QUATERNION)},
    }


def save_imu(path: PathLike, t: Floats, gyro: Floats, accel: Floats, arrival: Floats | None = None) -> None:
    """Write an inertial stream, atomically. t, arrival: shape=(n,) [s]. gyro, accel: shape=(n, 3) [rad/s],
    [m/s^2].
    """
    columns = {f"g{axis}_rad_s": gyro[:, k] for k, axis in enumerate(_POSITION)} | {
        f"a{axis}_m_s2": accel[:, k] for k, axis in enumerate(_POSITION)
    }
    write_table(path, _with_arrival({"t_s": t, **columns}, arrival))


def save_tracker(
    path: PathLike,
    t: Floats,
    position: Floats,
    orientation: Floats | None = None,
    arrival: Floats | None = None,
) -> None:
    """Write a tracker's stream, atomically. position: shape=(n, 3) [m]. orientation: shape=(n, 4) w x y z."""
    columns = {f"{axis}_m": position[:, k] for k, axis in enumerate(_POSITION)}
    if orientation is not None:
        columns |= {part: orientation[:, k] for k, part in enumerate(_QUATERNION)}
    write_table(path, _with_arrival({"t_s": t, **columns}, arrival))


def save_joints(
    path: PathLike, robot: _core.Robot, t: Floats, joints: Floats, arrival: Floats | None = None
) -> None:
    """Write encoder readings, atomically. joints: shape=(n, driven joints) [rad | m]."""
    driven = [joint for joint in robot.joints if not joint.passive]
    columns = {
        f"q{k + 1}_{'rad' if joint.type == 'revolute' else 'm'}": joints[:, k]
        for k, joint in enumerate(driven)
    }
    write_table(path, _with_arrival({"t_s": t, **columns}, arrival))


def save_plan(path: PathLike, t: Floats, T: Floats, arrival: Floats | None = None) -> None:
    """Write tool poses in the base frame, atomically. T: shape=(n, 4, 4)."""
    write_table(path, _with_arrival({"t_s": t, **pose_columns(T)}, arrival))


# ---- Set-up --------------------------------------------------------------------------------------


def _finite(value: object) -> float:
    if not isinstance(value, Decimal) or not value.is_finite():
        raise expected(value, "a finite number")
    return float(value)


def _covariance(value: object) -> NDArray[np.float64]:
    what = "a covariance: 6 lists of 6 numbers, of x, y, z and the rotation vector"
    if (
        not isinstance(value, list)
        or len(value) != 6
        or any(not isinstance(row, list) or len(row) != 6 for row in value)
    ):
        raise expected(value, what)
    matrix = np.array([[_finite(item) for item in row] for row in value])
    if np.abs(matrix - matrix.T).max() > 1e-6 * np.abs(matrix).max() or np.linalg.eigvalsh(
        matrix
    ).min() < -1e-9 * max(1e-30, np.abs(matrix).max()):
        raise expected("a matrix that is not symmetric, or has negative variances", what)
    return matrix


def _gain(value: object) -> NDArray[np.float64]:
    if (
        not isinstance(value, list)
        or len(value) != 6
        or any(not isinstance(row, list) or len(row) != 3 for row in value)
    ):
        raise expected(
            value,
            "6 lists of 3 numbers: of x, y, z [-] and the rotation vector [rad/m], per planned acceleration",
        )
    return np.array([[_finite(item) for item in row] for row in value])


def _not_negative(value: object) -> Decimal:
    if not isinstance(value, Decimal) or not value.is_finite() or value < 0:
        raise expected(value, "a number that is not below 0")
    return value


class _Units(Strict):
    length: LengthName
    angle: AngleName


class _Frame(Strict):
    xyz: Vector3
    qw: Number
    qx: Number
    qy: Number
    qz: Number
    covariance: Annotated[NDArray[np.float64] | None, PlainValidator(_covariance)] = None


class _Mode(Strict):
    frequency_hz: Number
    damping: Annotated[Decimal, PlainValidator(_not_negative)]
    frequency_sigma_hz: Annotated[Decimal, PlainValidator(_not_negative)] = Decimal(0)
    gain: Annotated[NDArray[np.float64] | None, PlainValidator(_gain)] = None


class _SetupFile(Strict):
    format: Text
    units: _Units
    T_tracker_base: _Frame
    T_flange_receiver: _Frame
    T_flange_tool: _Frame
    T_flange_imu: _Frame
    gravity: Vector3 = (Decimal(0), Decimal(0), Decimal("-9.81"))
    clock_offset_s: Number = Decimal(0)
    clock_offset_sigma_s: Annotated[Decimal, PlainValidator(_not_negative)] = Decimal(0)
    clock_drift: Number = Decimal(0)
    clock_reference_s: Number = Decimal(0)
    controller_clock_offset_s: Number = Decimal(0)
    actuator_lag_s: Annotated[Decimal, PlainValidator(_not_negative)] = Decimal(0)
    gyro_bias_rad_s: Vector3 = (Decimal(0), Decimal(0), Decimal(0))
    gyro_bias_sigma_rad_s: Annotated[Decimal, PlainValidator(_not_negative)] = Decimal(0)
    accel_bias_m_s2: Vector3 = (Decimal(0), Decimal(0), Decimal(0))
    accel_bias_sigma_m_s2: Annotated[Decimal, PlainValidator(_not_negative)] = Decimal(0)
    modes: list[_Mode] = []
    filter: FreeMapping = {}
    limits: FreeMapping = {}
    deviation: FreeMapping = {}
    calibration: FreeMapping = {}


def load_setup(path: PathLike) -> SetupData:
    """Read a set-up file (format truing-track/1): frames with their covariance, clock offsets, gravity,
    modes.

    Raises InputError that names the line, what was found and what was expected.
    """
    document = Document.read(Path(path), _SETUP)
    told = document.value.get("format")
    if told != SETUP_FORMAT:
        document.refuse(
            ("format",) if "format" in document.value else (),
            (
                f"found {found(told)}, expected {SETUP_FORMAT}"
                if "format" in document.value
                else f"key 'format' is missing: expected format: {SETUP_FORMAT}"
            ),
        )
    file = document.validated(_SetupFile)
    length, angle = (
        1e-3 if file.units.length == "mm" else 1.0,
        math.radians(1.0) if file.units.angle == "deg" else 1.0,
    )
    scale = np.array([length] * 3 + [angle] * 3)
    frames = {name: _frame(document, name, getattr(file, name), length) for name in FRAMES}
    covariance = {
        name: scale[:, None] * getattr(file, name).covariance * scale
        for name in FRAMES
        if getattr(file, name).covariance is not None
    }
    setup = _core.TrackSetup(
        **frames,
        gravity=_gravity(document, file),
        clock_offset=float(file.clock_offset_s),
        clock_offset_sigma=float(file.clock_offset_sigma_s),
        controller_clock_offset=float(file.controller_clock_offset_s),
        actuator_lag=float(file.actuator_lag_s),
        gyro_bias=_bias(document, file, "gyro_bias_rad_s"),
        accel_bias=_bias(document, file, "accel_bias_m_s2"),
        gyro_bias_sigma=float(file.gyro_bias_sigma_rad_s),
        accel_bias_sigma=float(file.accel_bias_sigma_m_s2),
    )
    options = {
        "filter": _numbers(document, "filter", file.filter, _core.FilterOptions()),
        "limits": _numbers(document, "limits", file.limits, _core.CorrectionLimits()),
        "deviation": _numbers(document, "deviation", file.deviation, _core.DeviationOptions()),
    }
    if abs(file.clock_drift) > _FASTEST_DRIFT:
        document.refuse(
            ("clock_drift",),
            f"found {file.clock_drift}, expected at most {_FASTEST_DRIFT} s/s: no clock is so fast",
        )
    return SetupData(
        setup,
        covariance,
        float(file.clock_drift),
        float(file.clock_reference_s),
        _modes(document, file.modes),
        calibration=file.calibration,
        **options,
    )


def _frame(document: Document, name: str, frame: _Frame, length: float) -> Floats:
    q = np.array([float(getattr(frame, part)) for part in _QUATERNION])
    norm = float(np.linalg.norm(q))
    if abs(norm - 1.0) > _NOT_UNIT:
        document.refuse((name, "qw"), f"the quaternion has length {norm:.5g}, expected 1")
    T = np.eye(4)
    T[:3, :3] = rotations_from_quaternions(q[None])[0]
    T[:3, 3] = [length * float(value) for value in frame.xyz]
    if np.linalg.norm(T[:3, 3]) > _FARTHEST:
        document.refuse(
            (name, "xyz"),
            f"is {np.linalg.norm(T[:3, 3]):.4g} m away: in millimetres? units length says"
            f" {'mm' if length < 1 else 'm'}",
        )
    return T


def _gravity(document: Document, file: _SetupFile) -> Floats:
    gravity = np.array([float(value) for value in file.gravity])
    if not _GRAVITY[0] < np.linalg.norm(gravity) < _GRAVITY[1]:
        document.refuse(
            ("gravity",),
            f"has length {np.linalg.norm(gravity):.4g}, expected about 9.81 m/s^2, such as [0, 0, -9.81]",
        )
    return gravity


def _bias(document: Document, file: _SetupFile, name: str) -> Floats:
    bias = np.array([float(value) for value in getattr(file, name)])
    largest = _LARGEST_BIAS[name]
    if np.abs(bias).max() > largest:
        document.refuse(
            (name,),
            f"found {np.abs(bias).max():.4g}, expected at most {largest:g}: no inertial sensor is so far off",
        )
    return bias


def _modes(document: Document, modes: Sequence[_Mode]) -> _core.ModalModel:
    if len(modes) > 4:
        document.refuse(("modes",), f"found {len(modes)} modes, expected at most 4")
    for k, mode in enumerate(modes):
        if not 0 < mode.frequency_hz < 25:
            document.refuse(
                ("modes", k, "frequency_hz"),
                f"found {mode.frequency_hz}, expected a frequency between 0 and 25 Hz",
            )
        if mode.damping >= 1:
            document.refuse(("modes", k, "damping"), f"found {mode.damping}, expected a ratio below 1")
    gains = np.zeros((len(modes), 6, 3))
    for k, mode in enumerate(modes):
        if mode.gain is not None:
            gains[k] = mode.gain
    return _core.ModalModel(
        [float(m.frequency_hz) for m in modes],
        [float(m.damping) for m in modes],
        gains,
        [float(m.frequency_sigma_hz) for m in modes],
    )


def _numbers(document: Document, key: str, values: Mapping[str, Any], options: object) -> dict[str, float]:
    """Numbers by the names of an options class."""
    names = [
        name
        for name in dir(options)
        if isinstance(getattr(options, name), (int, float)) and not name.startswith("_")
    ]
    for name, value in values.items():
        if name not in names:
            hint = did_you_mean(name, names)
            document.refuse((key, name), f"unknown key; {hint}expected one of {listed(names)}")
        if not isinstance(value, Decimal) or not value.is_finite() or value < 0:
            document.refuse((key, name), f"found {found(value)}, expected a number that is not below 0")
    return {name: float(value) for name, value in values.items()}


def save_setup(path: PathLike, data: SetupData) -> None:
    """Write a set-up file, in m and rad, atomically."""
    setup = data.setup
    lines = [f"format: {SETUP_FORMAT}", "units: {length: m, angle: rad}"]
    for name in FRAMES:
        T = np.asarray(getattr(setup, name))
        q = quaternions_from_rotations(T[None, :3, :3])[0]
        parts = ", ".join(f"{part}: {float(value)!r}" for part, value in zip(_QUATERNION, q, strict=True))
        lines += [f"{name}:", f"  xyz: {_row(T[:3, 3])}", *(f"  {part}" for part in parts.split(", "))]
        if name in data.covariance:
            lines += [
                "  covariance:  # of x, y, z and the rotation vector about the parent's axes",
                *(f"    - {_row(row)}" for row in np.asarray(data.covariance[name])),
            ]
    lines += [
        f"gravity: {_row(np.asarray(setup.gravity))}  # in the base frame, m/s^2",
        f"clock_offset_s: {setup.clock_offset!r}  # t_imu = t_tracker - clock_offset_s",
        f"clock_offset_sigma_s: {setup.clock_offset_sigma!r}  # 0: known exactly, and not estimated",
        (
            f"clock_drift: {data.clock_drift!r}  # s/s; offsets are those at clock_reference_s of the"
            " tracker's clock"
        ),
        f"clock_reference_s: {data.clock_reference!r}",
        (
            f"controller_clock_offset_s: {setup.controller_clock_offset!r}  # t_imu = t of joints and plan -"
            " controller_clock_offset_s"
        ),
        f"actuator_lag_s: {setup.actuator_lag!r}  # joints are where the plan was so long ago",
    ]
    for bias, unit in (("gyro_bias", "rad_s"), ("accel_bias", "m_s2")):
        if getattr(setup, f"{bias}_sigma") > 0:
            lines += [
                f"{bias}_{unit}: {_row(np.asarray(getattr(setup, bias)))}  # when it was calibrated",
                f"{bias}_sigma_{unit}: {getattr(setup, f'{bias}_sigma')!r}  # standard error; 0: not known",
            ]
    modes = data.modes
    if modes.count:
        lines.append("modes:")
        for k in range(modes.count):
            lines += [
                f"  - frequency_hz: {float(modes.frequency[k])!r}",
                f"    frequency_sigma_hz: {float(modes.frequency_sigma[k])!r}",
                f"    damping: {float(modes.damping[k])!r}",
                "    gain:",
                *(f"      - {_row(row)}" for row in np.asarray(modes.gain[k])),
            ]
    for key, values in (("filter", data.filter), ("limits", data.limits), ("deviation", data.deviation)):
        if values:
            lines += [f"{key}:", *(f"  {name}: {float(value)!r}" for name, value in values.items())]
    if data.calibration:
        lines += [
            "calibration:",
            *(f"  {name}: {_scalar(value)}" for name, value in data.calibration.items()),
        ]
    with atomic_write(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _row(values: Floats) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


def _scalar(value: object) -> str:
    if isinstance(value, (bool, int)):
        return str(value).lower()
    if isinstance(value, (float, np.floating, Decimal)):
        return repr(float(value)) if math.isfinite(value) else "null"
    return '"' + str(value).replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
