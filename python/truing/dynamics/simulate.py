# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Models judged by motion: started at measured states and driven by the measured torques, where is the
robot then?

Windows begin every half second in recordings that no fit has seen. Each model is the file that `export`
wrote, loaded again, or an MJCF as it is, and all windows run at once (`mujoco.rollout`, on all cores).
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.commanded import Commanded, CommandedTrack, CommandRunner, commanded_track
from truing.dynamics.export import Exported, export, import_mujoco
from truing.dynamics.export.parts import drive_torque
from truing.dynamics.motion import (
    SMOOTHING,
    Track,
    smoothed,
    stretches_of,
    table_at,
    track_of,
)
from truing.dynamics.recorded import Recorded
from truing.dynamics.runner import Runnable, Runner, runnable
from truing.errors import InputError

Floats = NDArray[np.float64]
Spans = Sequence[tuple[float, float]]
"""[s] of a recording: stretches, begin and end."""

HORIZONS = (0.1, 0.5, 2.0)
COMMANDED_HORIZONS = (0.1, 0.5, 2.0, 5.0)  # a servo pulls its model back, so that longer ones say something
_SAMPLE = 0.02  # [s] between the samples of simulated paths
_CHECKED = 16  # windows on which the integration step is halved
_CHECKED_AHEAD = 0.5  # [s]
_FINE = 0.002  # [s] the same where rows of a recording are asked for: between them straight lines
_SAME = 1e-9  # of a step: rounding
_TORQUE_STEP = 0.01  # [s] between the rows of a motion whose torques are computed, or the recording's own


@dataclass(frozen=True)
class Windows:
    """Stretches of recordings: where they begin, and where the robot went."""

    joints: tuple[str, ...]
    prismatic: tuple[bool, ...]  # of each joint
    recordings: tuple[str, ...]  # of each window
    starts: Floats  # shape=(n,) [s]
    times: Floats  # shape=(m,) [s] from the start of a window
    measured: Floats  # shape=(n, m, joints) [rad | m]
    horizons: tuple[float, ...]  # [s], each among `times`
    tracks: tuple[Track, ...] = field(repr=False)
    track: NDArray[np.intp] = field(repr=False)  # shape=(n,)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple("m" if slides else "rad" for slides in self.prismatic)

    def at(self, horizon: float) -> int:
        """The number of a horizon's sample."""
        return int(np.argmin(np.abs(self.times - horizon)))


@dataclass(frozen=True)
class Judgement:
    """How far models are off, ahead of measured states."""

    windows: Windows
    simulated: dict[str, Floats]  # by model, shape=(n, times, joints) [rad | m]
    step_error: dict[str, float]
    """[rad | m] by model, how far half the integration step moves the worst joint half a second ahead,
    median."""
    torque_error: dict[str, Floats] = field(default_factory=dict)
    """By model, shape=(joints,) [Nm | N]: rms over the windows' motion of measured torques less those that
    the model needs for it."""
    torque_spread: dict[str, Floats] = field(default_factory=dict)
    """By model, shape=(joints,) [Nm | N]: standard deviation of the measured ones, less what the model says
    of the measurement."""

    def errors(self, model: str, horizon: float) -> Floats:
        """shape=(n, joints) [rad | m]: simulated less measured, `horizon` seconds ahead. Raises InputError
        for a model or horizon that was not judged."""
        if model not in self.simulated or horizon not in self.windows.horizons:
            raise InputError(
                f"{model!r} at {horizon} s was not judged: models {', '.join(self.simulated)}, horizons"
                f" {', '.join(map(str, self.windows.horizons))} s"
            )
        k = self.windows.at(horizon)
        return self.simulated[model][:, k] - self.windows.measured[:, k]

    def rms(self, model: str, horizon: float) -> Floats:
        """shape=(joints,) [rad | m]"""
        return np.asarray(np.sqrt(np.mean(self.errors(model, horizon) ** 2, axis=0)))

    def worst_joints(self, model: str, horizon: float) -> Floats:
        """shape=(n,) [rad | m]: the largest error of a joint in each window; of those that turn, unless none
        does."""
        slides = np.array(self.windows.prismatic)
        errors = np.abs(self.errors(model, horizon))
        return np.asarray((errors if slides.all() else errors[:, ~slides]).max(axis=1))

    def worst_joint(self, model: str, horizon: float) -> float:
        """[rad | m] median over the windows of the largest error of a joint."""
        return float(np.median(self.worst_joints(model, horizon)))

    def rows(self) -> list[dict[str, Any]]:
        """One row per model and horizon, for tables and result.json."""
        return [
            {
                "model": model,
                "horizon_s": horizon,
                "worst_joint_median": self.worst_joint(model, horizon),
                "rms": dict(zip(self.windows.joints, self.rms(model, horizon).tolist(), strict=True)),
            }
            for model in self.simulated
            for horizon in self.windows.horizons
        ]


def windows_of(
    recordings: Sequence[Recorded],
    robot: _core.Robot,
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.5,
    smoothing: float = SMOOTHING,
    within: Sequence[Spans] | None = None,
    most: int | None = None,
    track: Callable[[Any, _core.Robot, float], tuple[Track, NDArray[np.bool_]]] = track_of,
) -> Windows:
    """Stretches as long as the longest horizon, one beginning `every` seconds, without gaps and with one
    payload.

    smoothing: [s] half of the stretch whose cubic gives start and end positions (Savitzky and Golay 1964),
    and speeds where none were recorded. Torques, or else currents times torque_per_ampere, are taken as
    they are. within: [s] of each recording, stretches that windows must lie in. most: of more windows so
    many are taken, evenly. track: what drives the models, `commanded_track` for commands. Raises InputError:
    no torques (commands), joints that were not recorded, nothing as long as the longest horizon.
    """
    driven = [joint for joint in robot.joints if not joint.passive]
    if not horizons or min(horizons) <= 0.0 or every <= 0.0 or smoothing <= 0.0:
        raise InputError("horizons, every and smoothing are seconds, expected to be larger than zero")
    longest = max(horizons)
    times = np.unique(np.round([*np.arange(_SAMPLE, longest + 1e-9, _SAMPLE), *horizons], 9))
    tracks, numbers, starts = [], [], []
    for number, recording in enumerate(recordings):
        made, free = track(recording, robot, smoothing)
        tracks.append(made)
        spans = [(float(made.time[0]), float(made.time[-1]))] if within is None else within[number]
        for begin, end in spans:
            for start in _starts(made, begin + smoothing, end - smoothing - longest, longest, every):
                rows = slice(
                    np.searchsorted(made.time, start), np.searchsorted(made.time, start + longest, "right")
                )
                if free[rows].all() and made.one_payload(start, start + longest):
                    numbers.append(number)
                    starts.append(start)
    if not starts:
        raise InputError(
            f"no recording has {longest + 2 * smoothing:g} s without a gap or a change of its payload, the"
            " longest horizon: give longer recordings, or shorter horizons"
        )
    kept = np.arange(len(starts))
    if most is not None and kept.size > most:
        kept = np.unique(np.round(np.linspace(0, kept.size - 1, most)).astype(int))
    return Windows(
        tuple(joint.name for joint in driven),
        tuple(joint.type == "prismatic" for joint in driven),
        tuple(recordings[numbers[k]].name for k in kept),
        np.array(starts)[kept],
        times,
        np.array([table_at(tracks[numbers[k]].time, tracks[numbers[k]].q, starts[k] + times) for k in kept]),
        tuple(float(h) for h in horizons),
        tuple(tracks),
        np.array(numbers, dtype=np.intp)[kept],
    )


def _starts(track: Track, first: float, last: float, longest: float, every: float) -> list[float]:
    """`first`, and every so many seconds until `last`, where windows as long as `longest` are in no gap."""
    out: list[float] = []
    for begin, end in track.stretches:
        low = max(math.ceil((begin - first) / every - _SAME), 0)
        high = math.floor((min(end - longest, last) - first) / every + _SAME)
        out += [first + k * every for k in range(low, high + 1)]
    return out


def judge(
    models: Mapping[str, _core.Robot | Exported | Runnable],
    recordings: Sequence[Recorded],
    horizons: Sequence[float] = HORIZONS,
    every: float = 0.5,
    smoothing: float = SMOOTHING,
    callbacks: bool = True,
    within: Sequence[Spans] | None = None,
    most: int | None = None,
    torques: bool = False,
) -> Judgement:
    """Simulates every model over the same windows of recordings.

    models: robots, exported to a temporary folder, what `export(to="mjcf")` gave, or a `runnable`; driven by
    torques, unless all are `commanded_mjcf`. callbacks: run callbacks.py where a robot or an export has one.
    Horizons, every, smoothing, within, most: as in windows_of, whose errors are raised; joints are those of
    the first model, the same number in every other.
    torques: also of the torques that each model needs for the windows' motion.
    """
    if not models:
        raise InputError("no model to judge")
    import_mujoco()
    simulated, step_error = {}, {}
    torque_error: dict[str, Floats] = {}
    torque_spread: dict[str, Floats] = {}
    with tempfile.TemporaryDirectory() as folder:
        made = {
            name: _made(model, Path(folder) / str(k), callbacks)
            for k, (name, model) in enumerate(models.items())
        }
        first = next(iter(made.values()))
        track = commanded_track if isinstance(first, Commanded) else track_of
        windows = windows_of(recordings, first.robot, horizons, every, smoothing, within, most, track)
        for name, model in made.items():
            if len(model.driven) != len(windows.joints):
                raise InputError(
                    f"model {name} has the joints {', '.join(model.driven)}, the first one"
                    f" {', '.join(windows.joints)}: expected the same number"
                )
            runner = runner_of(model, windows.tracks)
            simulated[name] = runner.run(windows.starts, windows.track, windows.times)
            step_error[name] = _step_error(runner, windows)
            if torques:
                torque_error[name], torque_spread[name] = _torque_error(runner, windows, smoothing)
    return Judgement(windows, simulated, step_error, torque_error, torque_spread)


def _made(model: _core.Robot | Exported | Runnable, folder: Path, callbacks: bool) -> Runnable:
    if isinstance(model, _core.Robot):
        model = export(model, "mjcf", folder)
    return model if isinstance(model, Runnable) else runnable(model, callbacks)


def runner_of(model: Runnable, tracks: Sequence[Track]) -> Runner:
    """By torques, or of a `Commanded` by commands."""
    if not isinstance(model, Commanded):
        return Runner(model, tracks)
    commanded = [track for track in tracks if isinstance(track, CommandedTrack)]
    if len(commanded) < len(tracks):
        raise InputError("some models are driven by commands and some by torques: expected all alike")
    return CommandRunner(model, commanded)


def _step_error(runner: Runner, windows: Windows) -> float:
    """[rad | m] by which half the step moves the worst joint, median over some windows."""
    n = windows.starts.size
    some = np.arange(n)[:: max(n // _CHECKED, 1)][:_CHECKED]
    ahead = np.array([min(_CHECKED_AHEAD, max(windows.horizons))])
    starts, track = windows.starts[some], windows.track[some]
    whole = runner.run(starts, track, ahead)
    half = runner.run(starts, track, ahead, 0.5 * float(runner.model.opt.timestep))
    return float(np.median(np.abs(whole - half).max(axis=(1, 2))))


def _torque_error(runner: Runner, windows: Windows, smoothing: float) -> tuple[Floats, Floats]:
    """Rms error of a model's torques over the motion of the windows, and the measured torques' standard
    deviation, both smoothed as the motion is. shape=(joints,) [Nm | N]"""
    errors, measured = [], []
    for t, track in enumerate(windows.tracks):
        stride = max(int(round(_TORQUE_STEP / track.step)), 1)
        for rows in _stretches(windows, t, stride):
            at = track.time[rows]
            drive = drive_torque(runner.of.robot, track.torque_time, track.torque, at)
            step = stride * track.step
            measured.append(smoothed(drive, step, smoothing))
            errors.append(smoothed(drive - runner.torques(t, rows), step, smoothing))
    together = np.concatenate(errors)
    return np.sqrt(np.mean(together**2, axis=0)), np.concatenate(measured).std(axis=0)


def _stretches(windows: Windows, t: int, stride: int) -> list[NDArray[np.intp]]:
    """Rows of a track that windows cover, every stride-th, cut where they are not next to each other."""
    time, longest = windows.tracks[t].time, max(windows.horizons)
    covered = np.zeros(time.size, dtype=bool)
    for start in windows.starts[windows.track == t]:
        covered[np.searchsorted(time, start) : np.searchsorted(time, start + longest, "right")] = True
    rows = np.flatnonzero(covered[::stride]) * stride
    return [part for part in np.split(rows, np.flatnonzero(np.diff(rows) > stride) + 1) if part.size]


@dataclass(frozen=True)
class Response:
    """A recording's motion as a model gives it, restarted at the measured state window by window."""

    position: Floats  # shape=(n, joints) [rad | m], a row for each of the recording
    window: NDArray[np.intp]  # shape=(n,): the number of each row's window
    start: Floats  # shape=(windows,) [s]
    horizon: float  # [s] that was asked for


def simulated_response(
    model: _core.Robot | Exported | Runnable,
    recording: Recorded,
    horizon: float,
    smoothing: float = SMOOTHING,
    callbacks: bool = True,
) -> Response:
    """Simulates a whole recording, driven by its torques, in windows of `horizon` [s] one after the other.

    A window begins at the measured state (as in windows_of), the first after a gap or a change of the payload
    with its first row.
    Raises InputError: no torques, joints that were not recorded, less than 0.2 s between these, a horizon
    that is not above zero, MuJoCo is not installed.
    """
    if not horizon > 0.0:
        raise InputError(f"a horizon of {horizon:g} s: expected one above zero")
    import_mujoco()
    with tempfile.TemporaryDirectory() as folder:
        made = _made(model, Path(folder) / "model", callbacks)
    began = float(np.asarray(recording.time)[0])
    starts: list[float] = []
    tracks, of_track, window = [], [], []
    for stretch in stretches_of(recording):
        tracks.append(replace(track_of(stretch, made.robot, smoothing)[0], began=began))
        number = ((stretch.time - stretch.time[0]) / horizon + 1e-9).astype(int)
        window.append(len(starts) + number)
        starts += [stretch.time[0] + k * horizon for k in range(number[-1] + 1)]
        of_track += [len(tracks) - 1] * (number[-1] + 1)
    start, rows = np.array(starts), np.concatenate(window)
    since = np.asarray(recording.time, dtype=float) - start[rows]
    ahead = _FINE * np.arange(int(np.ceil(since.max() / _FINE)) + 1, dtype=np.float64)
    path = np.empty((start.size, ahead.size, len(made.driven)))
    path[:, 0] = [table_at(tracks[t].time, tracks[t].q, start[k : k + 1])[0] for k, t in enumerate(of_track)]
    if ahead.size > 1:
        path[:, 1:] = Runner(made, tracks).run(start, np.array(of_track, dtype=np.intp), ahead[1:])
    position = np.concatenate([table_at(ahead, path[w], since[rows == w]) for w in range(start.size)])
    return Response(position, rows, start, horizon)
