# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking a swaying arm: recordings, their replay, and what is wrong with them. The work is done by
`Tracker` in the C++ core.

    robot, where = truing.load_robot("robot.yaml"), truing.load_setup("setup.yaml")
    streams = truing.recorded_streams(
        robot,
        where,
        imu=truing.load_imu("imu.csv"),
        tracker=truing.load_tracker("tracker.csv"),
        joints=truing.load_joints("joints.csv", robot),
        plan=truing.load_plan("plan.csv"),
    )
    played = truing.replay(streams, where.setup, where.options())
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files.stream_file import ImuData, JointData, PoseData, SetupData, ToolPoses, TrackerData
from truing.rotations import interpolated, quaternions_from_rotations, rotations_from_quaternions

Floats = NDArray[np.float64]

PLAN_AHEAD = 1.0  # [s] a plan without arrival_s is known so long before its time
_FEW = 4000  # samples that checks look at
# Of the tracker's spread (or of 1 m, if that is more): a set-up that is off by more is another one.
_FAR_OFF = 0.25
_COMMON = 0.1  # of the shorter of two streams: with less in common they are of other times
_BEGUN_APART = 10.0  # [s] streams of one recording are started within this
_FEWEST_RESTS = 6
_FROM_MOTION = 300  # poses that stand in for test positions
_SAME_CLOCK = 0.02  # [s]
_LONGEST_LAG = 0.5  # [s]
_STRETCH = 10.0  # [s] of a recording, in which the offset of clocks is found on its own
_DRIFTED = 0.5  # [s] stretches are looked at so far from the whole's offset
_LEAST_DRIFT = 5e-5  # [s/s] what is less the filter finds by itself
_TUNED_FOR, _SETTLING = 0.04, 3.0  # [s]
_FACTORS, _TRACKER_FACTORS = (1.0, 3.0, 10.0, 30.0, 100.0), (1.0, 3.0)
_STATIC_TIMES = (1.0, 0.5, 0.2, 0.1)  # [s]
_ELSEWHERE = 0.05  # [m] a receiver or tool that is farther off than this is another one
_CERTAIN = 10.0  # standard errors, as if rows were independent, which they are not
_ON_THE_FLANGE = 1.0  # [m] a receiver that seems to be farther off is not told by so little turning
_TURNS = 1.5  # times the squares that have to be left without it
_LEANING = 0.2  # [rad] gravity by the inertial sensor and by encoders: no sway, sag or bias makes so much
_REVERSED = 2.8  # [rad] likewise: the specific force seems to have the other sign
_CLEAR = 0.2  # another reading of the numbers has to be so much better before it is named


def recorded_streams(
    robot: _core.Robot,
    where: SetupData | _core.TrackSetup,
    *,
    imu: ImuData,
    joints: JointData,
    tracker: TrackerData | None = None,
    plan: PoseData | None = None,
) -> _core.RecordedStreams:
    """A recording for `replay` from its files: forward kinematics of the encoders, and when each sample
    arrived. The drift of the tracker's clock that `where` knows is taken off.

    A stream without arrivals is taken to have arrived at its stamps, a plan one second before. Arrivals are
    of the computer's clock: where the inertial stream has them, its fastest sample ties stamps to arrivals.

    Streams that do not overlap by the set-up's clocks, because a device's clock began anew, are aligned by
    the turns that they saw together, and an InputWarning says so.

    Raises InputError where streams do not belong together in time, or where the tracker, the gyro or the
    set-up cannot be right: see `check_streams`.
    """
    setup = where.setup if isinstance(where, SetupData) else where
    if tracker is not None and isinstance(where, SetupData):
        tracker = replace(tracker, t=where.steady(tracker.t))
    imu, tracker, plan, joints = _aligned(robot, setup, imu, joints, tracker, plan)
    check_streams(robot, setup, imu=imu, joints=joints, tracker=tracker)
    if plan is not None:
        _check_plan(robot, setup, joints, plan)
    tied = 0.0 if imu.arrival is None else float(np.min(imu.arrival - imu.t))
    streams = _core.RecordedStreams()
    streams.set_imu(imu.t, imu.gyro, imu.accel, _arrival(imu, tied, 0.0))
    streams.set_flange(
        joints.t,
        _core.flange_poses(robot, joints.joints),
        _arrival(joints, tied, setup.controller_clock_offset),
    )
    if tracker is not None:
        streams.set_tracker(
            tracker.t, tracker.position, tracker.orientation, _arrival(tracker, tied, setup.clock_offset)
        )
    if plan is not None:
        streams.set_plan(plan.t, plan.T, _arrival(plan, tied - PLAN_AHEAD, setup.controller_clock_offset))
    return streams


def _arrival(stream: ImuData | JointData | TrackerData | PoseData, tied: float, offset: float) -> Floats:
    return stream.t - offset + tied if stream.arrival is None else stream.arrival


def _overlap(a: Floats, b: Floats) -> bool:
    """Whether two stamps' spans have a tenth of the shorter one in common."""
    common = min(a.max(), b.max()) - max(a.min(), b.min())
    return float(common) >= _COMMON * float(min(np.ptp(a), np.ptp(b)))


def _aligned(
    robot: _core.Robot,
    setup: _core.TrackSetup,
    imu: ImuData,
    joints: JointData,
    tracker: TrackerData | None,
    plan: PoseData | None,
) -> tuple[ImuData, TrackerData | None, PoseData | None, JointData]:
    """The streams; those whose clocks do not meet the inertial sensor's by the set-up with their stamps
    moved, where the turns that both saw tell by how much. Beginnings are taken to lie within ten seconds.
    """
    t = joints.t - setup.controller_clock_offset
    if not _overlap(t, imu.t):
        flange = _core.flange_poses(robot, joints.joints)
        by = imu.t[0] - t[0]
        found = _core.calibrate_inertial(
            imu.t,
            imu.gyro,
            imu.accel,
            t + by,
            np.ascontiguousarray(flange[:, :3, 3]),
            quaternions_from_rotations(flange[:, :3, :3]),
            clock_search=_BEGUN_APART,
            max_iterations=200,  # without noise of the tracker it takes long to say how much there is
        )
        if found.status == "done":
            by -= found.clock_offset
            _say_moved(joints.path, "joints", by)
            joints = replace(joints, t=joints.t + by)
            plan = None if plan is None else replace(plan, t=plan.t + by)
            t = t + by
    if (
        tracker is not None
        and tracker.orientation is not None
        and not _overlap(tracker.t - setup.clock_offset, t)
    ):
        paired = _paired(robot, joints, tracker)
        if paired.clock.found:  # t_controller = t_tracker + offset
            by = paired.offset + setup.clock_offset - setup.controller_clock_offset
            _say_moved(tracker.path, "tracker", by)
            tracker = replace(tracker, t=tracker.t + by)
    return imu, tracker, plan, joints


def _say_moved(path: object, name: str, by: float) -> None:
    warnings.warn(
        f"{path}: {name} and the inertial sensor do not overlap by the set-up's clocks; the stamps are moved"
        f" by {by:+.3f} s, as the turns tell that both saw: has a device been switched on anew since the"
        " set-up was calibrated?",
        InputWarning,
        stacklevel=4,
    )


def check_streams(
    robot: _core.Robot,
    setup: _core.TrackSetup,
    *,
    imu: ImuData,
    joints: JointData,
    tracker: TrackerData | None = None,
) -> None:
    """Raises InputError where streams do not overlap in time, and where numbers are misread: gyro in deg/s,
    tracker in other axes, left-handed, in mm …

    Predictions from encoders and set-up are compared with measurements. Sway and calibration errors are far
    below the limits.
    """
    flange = _core.flange_poses(robot, joints.joints)
    t = joints.t - setup.controller_clock_offset
    _require_overlap("joints", joints, t, imu)
    _check_gyro(imu, t, flange)
    _check_imu_axes(setup, imu, t, flange)
    if tracker is not None:
        _require_overlap("tracker", tracker, tracker.t - setup.clock_offset, imu)
        _check_tracker(setup, tracker, t, flange)


def _require_overlap(name: str, stream: JointData | TrackerData, t: Floats, imu: ImuData) -> None:
    if not _overlap(t, imu.t):
        raise InputError(
            f"{stream.path}: {name} from {t.min():.6g} to {t.max():.6g} s in the inertial sensor's clock, but"
            f" {imu.path} from {imu.t[0]:.6g} to {imu.t[-1]:.6g} s: expected streams of the same time; is the"
            " clock offset in the set-up file right? `truing track calibrate` finds it"
        )


def _check_plan(robot: _core.Robot, setup: _core.TrackSetup, joints: JointData, plan: PoseData) -> None:
    """The planned tool against the encoders': joints follow their plan."""
    rows = _spread_out(len(joints.t))
    at = joints.t[rows] - setup.actuator_lag
    rows = rows[(at >= plan.t[0]) & (at <= plan.t[-1])]
    if not rows.size:
        return
    tool = _core.flange_poses(robot, joints.joints[rows]) @ np.asarray(setup.T_flange_tool)
    near = np.clip(np.searchsorted(plan.t, joints.t[rows] - setup.actuator_lag), 0, len(plan.t) - 1)
    off = float(np.median(np.linalg.norm(plan.T[near, :3, 3] - tool[:, :3, 3], axis=1)))
    if off > _ELSEWHERE:
        warnings.warn(
            f"{plan.path}: the planned tool is {off:.2g} m from where encoders and T_flange_tool have it: is"
            " it the plan of this recording, for this tool and base? Corrections are to the plan as it is",
            InputWarning,
            stacklevel=3,
        )


def _spread_out(rows: int) -> NDArray[np.intp]:
    return np.linspace(0, rows - 1, min(rows, _FEW)).astype(np.intp)


def _check_gyro(imu: ImuData, t: Floats, flange: Floats) -> None:
    """The gyro's rms against that of the flange's turns: the same, but for sway."""
    step = max(1, int(0.05 / max(1e-6, float(np.median(np.diff(t))))))
    if len(t) <= step:
        return
    a, b = flange[:-step:step, :3, :3], flange[step::step, :3, :3]
    trace = np.einsum("nij,nij->n", a, b)
    rate = np.arccos(np.clip((trace - 1) / 2, -1, 1)) / np.maximum(1e-6, (t[step:] - t[:-step])[::step])
    told = float(np.sqrt(np.mean(rate**2)))
    bias = np.median(imu.gyro, axis=0)
    measured = float(np.sqrt(np.mean(np.sum((imu.gyro - bias) ** 2, axis=1))))
    if told > 0.01 and 30 < measured / told < 110:
        raise InputError(
            f"{imu.path}, column 'gx_rad_s': the rates are {measured / told:.3g} times those of the joints:"
            " these look like deg/s, expected rad/s"
        )


def _check_imu_axes(setup: _core.TrackSetup, imu: ImuData, t: Floats, flange: Floats) -> None:
    """The sensor's axes against those of the set-up: where is up, on the average over the recording? Sway and
    acceleration cancel in it.
    """
    rows = _spread_out(len(imu.t))
    rows = rows[(imu.t[rows] >= t[0]) & (imu.t[rows] <= t[-1])]
    near = np.clip(np.searchsorted(t, imu.t[rows]), 0, len(t) - 1)
    R = flange[near][:, :3, :3] @ np.asarray(setup.T_flange_imu)[:3, :3]
    up = -np.asarray(setup.gravity) / np.linalg.norm(setup.gravity)

    mean = np.einsum("nij,nj->i", R, imu.accel[rows])
    usual = float(np.arccos(np.clip(mean @ up / max(1e-9, float(np.linalg.norm(mean))), -1, 1)))
    if usual > _LEANING:
        raise InputError(
            f"{imu.path}, column 'ax_m_s2': at the mean of the recording the sensor feels gravity"
            f" {np.degrees(usual):.3g} deg from where encoders and T_flange_imu of the set-up have it: are"
            f" the sensor's axes{' and the sign of its specific force' if usual > _REVERSED else ''} those of"
            " the set-up? `truing track calibrate` finds them"
        )


def _check_tracker(setup: _core.TrackSetup, tracker: TrackerData, t: Floats, flange: Floats) -> None:
    """Measured receiver positions against those of forward kinematics; where they are far off, the reading of
    the numbers that mends it is named.
    """
    stamps = tracker.t - setup.clock_offset
    rows = _spread_out(len(stamps))
    rows = rows[(stamps[rows] >= t[0]) & (stamps[rows] <= t[-1])]
    near = np.clip(np.searchsorted(t, stamps[rows]), 0, len(t) - 1)
    expected = np.asarray(setup.T_tracker_base) @ flange[near] @ np.asarray(setup.T_flange_receiver)
    p, measured = expected[:, :3, 3], tracker.position[rows]
    limit = _FAR_OFF * max(1.0, float(np.median(np.linalg.norm(p - np.median(p, axis=0), axis=1))))

    def off(read: Floats) -> float:
        return float(np.median(np.linalg.norm(read - p, axis=1)))

    usual = off(measured)
    if usual <= limit:
        _check_orientation(tracker, rows, expected)
        _check_receiver(setup, tracker, flange[near], measured)
        return
    readings = [
        (off(1e-3 * measured), "positions in mm: call the columns x_mm y_mm z_mm, or convert them"),
        (off(1e3 * measured), "positions in km?"),
    ]
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            axes = np.zeros((3, 3))
            axes[range(3), order] = signs
            if (axes == np.eye(3)).all():
                continue
            words = " ".join(
                f"{'' if sign > 0 else '-'}{'xyz'[k]}" for k, sign in zip(order, signs, strict=True)
            )
            kind = (
                "left-handed axes"
                if np.linalg.det(axes) < 0
                else "a y-up frame"
                if order[2] == 1
                else "other axes"
            )
            readings.append(
                (
                    off(measured @ axes.T),
                    (
                        f"{kind}: the set-up's x y z are its {words}; convert positions and quaternions, or"
                        " calibrate with this tracker frame"
                    ),
                )
            )
    best, what = min(readings)
    where = f"{tracker.path}: positions are {usual:.4g} m from where encoders and set-up put the receiver"
    if best < _CLEAR * usual and best <= limit:
        raise InputError(f"{where}, but {best:.3g} m with {what}")
    raise InputError(
        f"{where}, expected below {limit:.3g} m: is this the set-up of this recording? `truing track"
        " calibrate` finds it anew"
    )


def _check_receiver(setup: _core.TrackSetup, tracker: TrackerData, flange: Floats, measured: Floats) -> None:
    """Whether the receiver is elsewhere on the flange than the set-up says: such an error turns with the
    flange. One of the tracker's frame stands still, sag goes downwards and depends on the reach.
    """
    R_tracker_base = np.asarray(setup.T_tracker_base)[:3, :3]
    place = flange @ np.asarray(setup.T_flange_receiver)
    off = (measured - np.asarray(setup.T_tracker_base)[:3, 3]) @ R_tracker_base - place[:, :3, 3]
    down = np.asarray(setup.gravity) / np.linalg.norm(setup.gravity)
    reach = np.linalg.norm(np.cross(place[:, :3, 3], down), axis=1)
    standing = np.tile(np.eye(3), (len(off), 1, 1))
    sag = np.stack([np.outer(reach, down), np.outer(reach**2, down)], axis=2)
    without = np.concatenate([standing, sag], axis=2)

    def fit(columns: Floats, rows: NDArray[np.bool_]) -> tuple[Floats, Floats]:
        A = columns[rows].reshape(-1, columns.shape[2])
        found = np.asarray(np.linalg.lstsq(A, off[rows].ravel(), rcond=1e-6)[0], dtype=np.float64)
        return found, np.asarray(np.linalg.norm(columns @ found - off, axis=1))

    turning = np.concatenate([flange[:, :3, :3], without], axis=2)
    length = fit(turning, np.ones(len(off), dtype=bool))[1]
    rows = length <= 4 * np.median(length)  # reflected signals do not count
    found, length = fit(turning, rows)
    left, before = np.mean(length[rows] ** 2), np.mean(fit(without, rows)[1][rows] ** 2)
    elsewhere = float(np.linalg.norm(found[:3]))
    A = turning[rows].reshape(-1, turning.shape[2])
    spread = float(np.sqrt(left / 3.0 * np.trace(np.linalg.pinv(A.T @ A, 1e-12, hermitian=True)[:3, :3])))
    told = max(_ELSEWHERE, _CERTAIN * spread) < elsewhere < _ON_THE_FLANGE  # of an arm that turns enough
    if told and before > _TURNS * left:
        raise InputError(
            f"{tracker.path}: the receiver is {elsewhere:.2g} m from where T_flange_receiver of the set-up"
            f" has it, for the difference to the encoders turns with the flange ({before**0.5:.2g} m rms, and"
            f" {left**0.5:.2g} m if the receiver is there): has it been mounted anew? `truing track"
            " calibrate` finds it"
        )


def _check_orientation(tracker: TrackerData, rows: NDArray[np.intp], expected: Floats) -> None:
    if tracker.orientation is None:
        return
    q = tracker.orientation[rows]

    def off(read: Floats) -> float:
        trace = np.einsum("nij,nij->n", rotations_from_quaternions(read), expected[:, :3, :3])
        return float(np.median(np.arccos(np.clip((trace - 1) / 2, -1, 1))))

    usual = off(q)
    if usual < 0.35:
        return
    readings = [
        (off(q[:, [3, 0, 1, 2]]), "scalar last"),
        (off(q * np.array([1.0, -1.0, -1.0, -1.0])), "inverted (the tracker in the receiver)"),
    ]
    best, what = min(readings)
    hint = (
        f", but {best:.2g} rad if the quaternions are {what}: convert them"
        if best < _CLEAR * usual
        else ": is this the set-up of this recording?"
    )
    raise InputError(
        f"{tracker.path}, column 'qw': orientations are {usual:.3g} rad from what encoders and set-up"
        f" say{hint}"
    )


# ---- Calibration ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class TrackCalibration:
    """What `track_calibrate` found, part by part."""

    where: SetupData  # to be saved as setup.yaml; means nothing unless `status` is "done"
    status: str  # "done", "not observable", "not consistent", "not converged"
    message: str
    frames: _core.FramesResult
    positions: tuple[_core.RestPose, ...]  # standstills that frames were found from; none: the motion itself
    times: Floats  # shape=(n,) [s] of the positions used, the controller's clock
    inertial: _core.InertialResult | None
    tool: _core.ToolResult | None
    joints_clock: _core.ClockOffset | None  # t_controller = t_tracker + offset; None: not compared
    same_clock: bool  # controller and inertial sensor share one
    actuator_lag: float | None  # [s] None: no plan
    modes: _core.ModesResult | None
    notes: tuple[str, ...]


def track_calibrate(
    robot: _core.Robot,
    joints: JointData,
    tracker: TrackerData,
    imu: ImuData | None = None,
    *,
    plan: PoseData | None = None,
    tool: ToolPoses | None = None,
    clock_wanted: float = 1e-3,
) -> TrackCalibration:
    """Find a tracking set-up from one recording, in which the arm stands still at test positions for three
    seconds or more each.

    Joints and tracker give the offset of their clocks, the tracker frame and the receiver on the flange. The
    inertial sensor, gravity and its clock come from the motion between. Where the arm never stood still,
    frames come from the motion as well.

    plan: planned tool; gives the actuators' lag and the modes of the sway. tool: prescribed poses of the
    tool; None: the robot file's tool.
    clock_wanted: [s] a larger standard error of the inertial sensor's clock offset is not enough, and advice
    is given.

    Raises InputError on data that cannot be used; what the data do not show is a status, not a number.
    """
    if tracker.orientation is None:
        raise InputError(
            f"{tracker.path}: there are no columns qw qx qy qz: frames are calibrated from poses of the"
            " receiver; position alone is enough for `track run`"
        )
    paired = _paired(robot, joints, tracker)
    notes = list(paired.notes)
    places, more = _positions(joints, tracker, paired)
    notes += more
    frames = _core.calibrate_frames(places.hand, places.board)
    notes += list(frames.warnings)
    status, message = frames.status, frames.message

    inertial, found_tool = None, None
    imu_base = 0.0
    if imu is not None and status == "done":
        inertial, imu_base, more = _inertial(imu, joints, paired, clock_wanted)
        notes += more
        if inertial.status != "done":
            status, message = inertial.status, inertial.message
    if tool is not None and status == "done":
        found_tool = _core.calibrate_tool(
            _core.flange_poses(robot, tool.pivot),
            _core.flange_poses(robot, tool.orientation) if len(tool.orientation) else None,
            list(tool.prescribed),
        )
        if found_tool.status != "done":
            status, message = found_tool.status, found_tool.message

    found = TrackCalibration(
        where=SetupData(_core.TrackSetup()),
        status=status,
        message=message,
        frames=frames,
        positions=tuple(places.rests),
        times=places.times,
        inertial=inertial,
        tool=found_tool,
        joints_clock=paired.clock if paired.clock.found else None,
        same_clock=True,
        actuator_lag=None,
        modes=None,
        notes=tuple(dict.fromkeys(notes)),
    )
    if status != "done":
        return found
    return _completed(found, robot, joints, tracker, imu, plan, paired, imu_base)


def _inertial(
    imu: ImuData, joints: JointData, paired: _Paired, clock_wanted: float
) -> tuple[_core.InertialResult, float, list[str]]:
    """Inertial sensor, gravity and clock by the controller's clock; what was added to the sensor's stamps
    first [s], to lay a record that began elsewhere upon the joints' beginning; what to know.
    """
    base = 0.0 if _overlap(imu.t, joints.t) else float(joints.t[0] - imu.t[0])
    found = _core.calibrate_inertial(
        imu.t + base,
        imu.gyro,
        imu.accel,
        paired.stamps + paired.offset,
        paired.position,
        paired.orientation,
        clock_wanted=clock_wanted,
        **({"clock_search": _BEGUN_APART} if base else {}),
    )
    notes = list(found.warnings)
    if base:
        notes.append(
            "joints and inertial sensor began at other times by their stamps: aligned by the turns that both"
            f" saw, t_controller = t_imu {base + found.clock_offset:+.3f} s"
        )
    return found, base, notes


@dataclass(frozen=True)
class _Paired:
    """Joints and tracker of one recording, by one clock."""

    flange: Floats  # shape=(rows of the joints, 4, 4)
    stamps: Floats  # shape=(n,) [s] of the tracker, its drift taken off
    position: Floats  # shape=(n, 3) [m]
    orientation: Floats  # shape=(n, 4)
    clock: _core.ClockOffset
    base: float  # [s] added to the stamps before `clock` was found: beginnings laid upon each other
    drift: float
    reference: float  # [s] where the drift counts from
    notes: tuple[str, ...]

    @property
    def offset(self) -> float:
        """[s] t_controller = t_tracker + offset"""
        return self.base + (self.clock.offset if self.clock.found else 0.0)


def _paired(robot: _core.Robot, joints: JointData, tracker: TrackerData) -> _Paired:
    assert tracker.orientation is not None
    stamps, first = np.unique(tracker.t, return_index=True)
    position, orientation = tracker.position[first], tracker.orientation[first]
    flange = _core.flange_poses(robot, joints.joints)
    base = 0.0 if _overlap(stamps, joints.t) else float(joints.t[0] - stamps[0])
    clock, drift, reference = _joints_clock(
        joints.t, flange, stamps + base, _frames_of(position, orientation)
    )
    reference -= base
    notes = [
        f"joints and tracker: t_controller = t_tracker {base + clock.offset:+.4f} s, standard error"
        f" {1e3 * clock.sigma:.2g} ms"
        if clock.found
        else f"joints and tracker are taken to have {'one clock' if base == 0.0 else 'begun together'}:"
        f" {clock.message}"
    ]
    if drift:
        rate = 1.0 / float(np.median(np.diff(stamps)))
        notes.append(
            f"the tracker's clock drifts by {1e6 * drift:+.0f} ppm: its stamps say {rate:.2f} Hz, by the"
            f" controller's clock it ran at {rate / (1.0 + drift):.2f} Hz. setup.yaml has the drift; live,"
            " take it off the stamps"
        )
    stamps = stamps + drift * (stamps - reference)
    return _Paired(flange, stamps, position, orientation, clock, base, drift, reference, tuple(notes))


def _frames_of(position: Floats, orientation: Floats) -> Floats:
    """shape=(n, 4, 4)"""
    frames = np.tile(np.eye(4), (len(position), 1, 1))
    frames[:, :3, :3], frames[:, :3, 3] = rotations_from_quaternions(orientation), position
    return frames


@dataclass(frozen=True)
class _Positions:
    """Flange and receiver at the same instants."""

    times: Floats  # shape=(n,) [s] the controller's clock
    hand: Floats  # shape=(n, 4, 4) T_base_flange
    board: Floats  # shape=(n, 4, 4) T_tracker_receiver
    rests: Sequence[_core.RestPose] = ()


def _positions(joints: JointData, tracker: TrackerData, paired: _Paired) -> tuple[_Positions, list[str]]:
    """Where the arm stood still; of an arm that hardly ever did, samples of its motion."""
    offset = paired.offset
    rests = _core.find_rests(
        joints.t, paired.flange, paired.stamps, paired.position, paired.orientation, clock_offset=-offset
    )
    if len(rests) >= _FEWEST_RESTS:
        times = np.array([(rest.start + rest.end) / 2 for rest in rests])
        hand = np.array([rest.T_base_flange for rest in rests])
        board = np.array([rest.T_tracker_receiver for rest in rests])
        return _Positions(times, hand, board, rests), []
    note = (
        f"the arm stood still {len(rests)} times (for three seconds or more), fewer than {_FEWEST_RESTS}:"
        " frames come from the motion, with its sway and the clocks' offset in them"
    )
    at = paired.stamps + offset
    inside = np.flatnonzero((at > joints.t[0]) & (at < joints.t[-1]))
    if inside.size < _FEWEST_RESTS:
        raise InputError(
            f"{tracker.path}: {inside.size} samples lie within the time of {joints.path}, expected"
            " streams of the same time"
        )
    chosen = inside[np.linspace(0, inside.size - 1, min(_FROM_MOTION, inside.size)).astype(np.intp)]
    times = at[chosen]
    seen = _frames_of(paired.position, paired.orientation)[chosen]
    return _Positions(times, interpolated(joints.t, paired.flange, times), seen), [note]


def _completed(
    found: TrackCalibration,
    robot: _core.Robot,
    joints: JointData,
    tracker: TrackerData,
    imu: ImuData | None,
    plan: PoseData | None,
    paired: _Paired,
    imu_base: float,
) -> TrackCalibration:
    """The set-up put together; the filter's noise, actuators' lag and modes of the sway."""
    where, same_clock, notes = _assembled(robot, found.frames, found.inertial, found.tool, paired, imu_base)
    where = replace(where, clock_drift=-paired.drift, clock_reference=paired.reference)
    lag, modes = None, None
    if plan is not None:
        lag = actuator_lag(joints.t, paired.flange @ np.asarray(where.setup.T_flange_tool), plan)
        where = replace(where, setup=where.setup.replace(actuator_lag=lag))
    if imu is not None:
        streams = recorded_streams(robot, where, imu=imu, joints=joints, tracker=tracker, plan=plan)
        where = _tuned(streams, replace(where, filter=_noise(imu, tracker)))
        if plan is not None:
            modes = _core.replay(
                streams, where.setup, where.options(), horizons=[], learn_modes=0.97 * float(np.ptp(imu.t))
            ).modes
            where = replace(where, modes=modes.model)
    return replace(
        found,
        where=where,
        same_clock=same_clock,
        actuator_lag=lag,
        modes=modes,
        notes=tuple(dict.fromkeys([*found.notes, *notes])),
    )


def _assembled(
    robot: _core.Robot,
    frames: _core.FramesResult,
    inertial: _core.InertialResult | None,
    tool: _core.ToolResult | None,
    paired: _Paired,
    imu_base: float,
) -> tuple[SetupData, bool, list[str]]:
    """Frames, gravity and clocks together, with covariances; whether controller and inertial sensor share a
    clock; what to know.
    """
    clock, offset = paired.clock, paired.offset
    T_tracker_base, T_flange_receiver = (
        np.asarray(frames.T_tracker_base.T),
        np.asarray(frames.T_flange_receiver.T),
    )
    covariance = {
        "T_tracker_base": np.asarray(frames.T_tracker_base.covariance),
        "T_flange_receiver": np.asarray(frames.T_flange_receiver.covariance),
    }
    notes: list[str] = []
    if inertial is None:
        setup = _core.TrackSetup(
            T_tracker_base=T_tracker_base,
            T_flange_receiver=T_flange_receiver,
            gravity=robot.gravity,
            clock_offset=-offset,
        )
        notes.append(
            "without --imu the inertial sensor, gravity and its clock are not found: `track run` needs them"
        )
        same = True
    else:
        setup, told = _core.assemble_setup(frames, inertial)
        notes += told
        # The tracker's stamps were shifted by `offset` first: what is left is between controller and inertial
        # sensor.
        between, sigma = (
            imu_base + inertial.clock_offset,
            np.hypot(inertial.clock_offset_sigma, clock.sigma if clock.found else 0.0),
        )
        same = not clock.found or abs(between) < max(3.0 * float(sigma), _SAME_CLOCK)
        setup.clock_offset = between - offset
        setup.controller_clock_offset = 0.0 if same else between
        if same and clock.found:
            notes.append(
                f"joints and inertial sensor are taken to have one clock: {1e3 * between:+.2g} ms between"
                " them is what sway makes of angular speeds"
            )
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = T_flange_receiver[:3, :3]
        lever = T_flange_receiver[:3, :3] @ np.asarray(inertial.T_receiver_imu.T)[:3, 3]
        carry = np.eye(6)
        carry[:3, 3:] = -np.array(
            [[0, -lever[2], lever[1]], [lever[2], 0, -lever[0]], [-lever[1], lever[0], 0]]
        )
        covariance["T_flange_imu"] = (
            carry @ covariance["T_flange_receiver"] @ carry.T
            + turn @ np.asarray(inertial.T_receiver_imu.covariance) @ turn.T
        )
    if tool is None:
        frames_at_zero = _core.forward_kinematics(robot, np.zeros(robot.driven_count))
        setup.T_flange_tool = np.linalg.inv(frames_at_zero[-2]) @ frames_at_zero[-1]
    else:
        setup.T_flange_tool = tool.T_flange_tool.T
        covariance["T_flange_tool"] = np.asarray(tool.T_flange_tool.covariance)
    return SetupData(setup, covariance), same, notes


def _joints_clock(
    t: Floats, flange: Floats, stamps: Floats, seen: Floats
) -> tuple[_core.ClockOffset, float, float]:
    """t_controller = t_tracker + offset + drift (t_tracker - reference), by the turns that both saw: the
    whole for the offset, stretches of it for the drift; 0 where none shows.
    """

    def compare(rows: slice, at: Floats, search: float = 10.0) -> _core.ClockOffset:
        return _core.handeye_clock(t.tolist(), flange, at[rows].tolist(), seen[rows], "eye-to-hand", search)

    whole = compare(slice(None), stamps)
    count = int(np.ptp(stamps) / _STRETCH)
    if not whole.found or count < 3:
        return whole, 0.0, 0.0
    edges = np.linspace(0, len(stamps), count + 1).astype(np.intp)
    found = [
        (float(np.mean(stamps[a:b])), c)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
        if b - a > 100 and (c := compare(slice(a, b), stamps + whole.offset, _DRIFTED)).found
    ]
    at, offsets = np.array([when for when, _ in found]), np.array([c.offset for _, c in found])
    if len(found) < 3 or np.ptp(at) < 2 * _STRETCH:
        return whole, 0.0, 0.0
    line = np.polyfit(at - at.mean(), offsets, 1)
    scatter = float(np.sqrt(np.sum((offsets - np.polyval(line, at - at.mean())) ** 2) / (len(at) - 2)))
    drift, sigma = float(line[0]), max(scatter, 1e-4) / float(np.sqrt(np.sum((at - at.mean()) ** 2)))
    if abs(drift) < max(4.0 * sigma, _LEAST_DRIFT) or abs(drift) > 0.01:
        return whole, 0.0, 0.0
    reference = float(at.mean())
    return compare(slice(None), stamps + drift * (stamps - reference)), drift, reference


def white_noise(values: Floats, count: int) -> float:
    """Standard deviation of white noise in evenly sampled values, shape=(n, k): from third differences, in
    the quietest fifth of stretches of `count`.
    """
    third = np.diff(values, n=3, axis=0)  # of white noise: 20 times its variance
    stretches = third[: len(third) // count * count].reshape(-1, count * values.shape[1])
    return float(np.sqrt(np.quantile(np.mean(stretches**2, axis=1), 0.2) / 20.0)) if len(stretches) else 0.0


def _noise(imu: ImuData, tracker: TrackerData) -> dict[str, float]:
    """White noise of the sensors, as third differences show it; options of the filter by name."""
    step = float(np.median(np.diff(imu.t)))
    count = max(8, int(0.5 / step))
    position = tracker.position[np.argsort(tracker.t, kind="stable")]
    found = {
        "gyro_noise": max(1e-5, white_noise(imu.gyro, count) * step**0.5),
        "accel_noise": max(1e-4, white_noise(imu.accel, count) * step**0.5),
        "position_sigma": max(2e-5, white_noise(position, 30)),
    }
    if tracker.orientation is not None:
        # a change of the quaternion is half the turn; signs are made continuous first
        q = tracker.orientation[np.argsort(tracker.t, kind="stable")]
        q = q * np.cumprod(np.where(np.sum(q * np.roll(q, 1, axis=0), axis=1) < 0, -1.0, 1.0))[:, None]
        found["rotation_sigma"] = max(2e-5, 2.0 * white_noise(q, 30) * (4.0 / 3.0) ** 0.5)

    return found


def _tuned(streams: _core.RecordedStreams, where: SetupData) -> SetupData:
    """The set-up with the noise and the static time that predict the tracker's samples best.

    What an inertial sensor's own filter, its scale and the shaking of its mount do is not white: the noise
    that stands for it is found by trying. How fast the static
    deviation wanders depends on the arm: slowly on one that sags, with every move on one whose link table is
    off.
    """

    def error(tried: SetupData) -> float:
        graded = _core.replay(streams, tried.setup, tried.options(), horizons=[_TUNED_FOR]).graded
        use = (graded["dimensions"] > 0) & (graded["t"] > graded["t"].min(initial=np.inf) + _SETTLING)
        return (
            float(np.median(np.linalg.norm(graded["position"][use], axis=1))) if use.sum() > 50 else np.inf
        )  # the tracker's outliers do not count

    best, least = where, error(where)
    scaled = [
        {name: value * (tracker_by if name.endswith("sigma") else by) for name, value in where.filter.items()}
        for by in _FACTORS
        for tracker_by in _TRACKER_FACTORS
    ]
    for tried in (replace(where, filter=values) for values in scaled):
        now = error(tried)
        if now < 0.98 * least:  # what is no better is not taken
            best, least = tried, now
    for tried in (replace(best, deviation={"static_time": seconds}) for seconds in _STATIC_TIMES):
        now = error(tried)
        if now < 0.98 * least:
            best, least = tried, now
    return best


def actuator_lag(t: Floats, T_base_tool: Floats, plan: PoseData) -> float:
    """[s] Delay of the joints behind the plan, from 0 to 0.5: that of the smallest difference of positions.

    T_base_tool: by forward kinematics, shape=(n, 4, 4), at t, shape=(n,) [s].
    """
    inside = (t > plan.t[0] + _LONGEST_LAG) & (t < plan.t[-1])
    if inside.sum() < 10:
        raise InputError(
            f"{plan.path}: from {plan.t[0]:.6g} to {plan.t[-1]:.6g} s, the joints from {t[0]:.6g} to"
            f" {t[-1]:.6g} s: expected a plan of the same time and clock"
        )
    at = t[inside][:: max(1, int(inside.sum()) // 20000)]
    tool = T_base_tool[inside][:: max(1, int(inside.sum()) // 20000), :3, 3]

    def off(lag: float) -> float:
        return float(
            sum(np.mean((np.interp(at - lag, plan.t, plan.T[:, k, 3]) - tool[:, k]) ** 2) for k in range(3))
        )

    step = 0.005
    lags = np.arange(0.0, _LONGEST_LAG + step, step)
    squares = np.array([off(lag) for lag in lags])
    k = int(np.argmin(squares))
    if np.ptp(squares) < 1e-9 or k in (0, len(lags) - 1):
        return float(lags[k]) if np.ptp(squares) >= 1e-9 else 0.0
    low, middle, high = squares[k - 1 : k + 2]
    return float(
        lags[k] + 0.5 * step * (low - high) / (low - 2 * middle + high)
    )  # vertex of the parabola through three
