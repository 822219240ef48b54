# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis judged a second time, by motion: models started at measured states of held-out recordings and
driven by the measured torques. Where are they 0.1, 0.5 and 2 s later?

`named` has the laws as they were found (the MJCF and callbacks.py); `exported` is the MJCF as it is written,
alone: what MuJoCo has no field for is not in it, and the rest was fitted anew without that.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import identify
from truing.dynamics.commanded import CommandedTrack
from truing.dynamics.export import Exported, export, import_mujoco
from truing.dynamics.export.refit import training
from truing.dynamics.motion import SMOOTHING, Track
from truing.dynamics.recorded import Recorded
from truing.dynamics.rollout.page import FAR, TURN, main_horizon
from truing.dynamics.runner import Runnable, runnable
from truing.dynamics.simulate import HORIZONS, Judgement, Response, Spans, judge

Floats = NDArray[np.float64]

BLOCKS_OF_TIME = "blocks of time"  # what `held_out` says where parts of the recordings were held out
WINDOWS = 60  # at most: keeps it to some seconds
STANDARD = "coulomb,viscous,current_offset"  # beside the inertial parameters
WORSE = 1.05  # times another model's error: worse than it
DRAWN = 20.0  # [s] of motion in a report
_BLOCKS = 10  # of time, as cpp/src/dynamics/problem.cpp parts recordings


@dataclass(frozen=True)
class Rollout:
    """What motion says of a diagnosis."""

    judgement: Judgement | None
    """Models 'nominal', 'standard', 'named', 'exported'."""
    why_not: str = ""
    """Why nothing was simulated; "" if it was."""
    refitted: tuple[str, ...] = ()
    """Parameters without which friction and bodies of 'exported' were fitted anew."""


def rollout(
    nominal: _core.Robot,
    found: _core.TorqueDiagnosis,
    recordings: Sequence[_core.Recording],
    *,
    test_share: float = 0.3,
    horizons: Sequence[float] = HORIZONS,
    windows: int = WINDOWS,
) -> Rollout:
    """Simulates the robot as given, as standard practice fits it, and as it was found, on what `diagnose`
    held out.

    nominal, recordings, test_share: as `diagnose` got them. horizons: [s]; those that no held-out stretch is
    long enough for are left out. windows: at most so many, evenly taken. A model that has left (1000 rad or
    m) counts as that far off. What cannot be simulated says why in `why_not`: MuJoCo is not installed, drives
    without constants, links without masses.
    """
    held = [r for r in recordings if r.name in found.held_out]
    spans: list[Spans] | None = None
    if list(found.held_out) == [BLOCKS_OF_TIME]:
        held, spans = list(recordings), held_out_blocks(recordings, test_share)
    try:
        rows = held_out_rows(recordings, found.held_out, test_share)
        train = training(list(zip(recordings, rows, strict=True)))
        import_mujoco()
        standard = nominal if is_fitted(nominal) else _standard(nominal, recordings, found.cutoff, test_share)
        with tempfile.TemporaryDirectory() as folder:
            models = {
                name: export(robot, "mjcf", Path(folder) / name, recordings=train, cutoff=found.cutoff)
                for name, robot in (("nominal", nominal), ("standard", standard), ("named", found.robot))
            }
            judgement = judge(
                {**models, "exported": runnable(models["named"], callbacks=False)},
                held,
                possible(horizons, held, spans),
                within=spans,
                most=windows,
            )
    except (ValueError, RuntimeError) as error:  # InputError, and what MuJoCo says to a model
        return Rollout(None, str(error))
    return Rollout(judgement, refitted=models["named"].refitted)


def is_fitted(robot: _core.Robot) -> bool:
    """Whether a robot carries what an earlier fit of torques found: `diagnose` takes it as it is."""
    return bool(robot.torque_effects) and "qd1" in robot.fitted_range


def _standard(
    nominal: _core.Robot, recordings: Sequence[_core.Recording], cutoff: float, test_share: float
) -> _core.Robot:
    """The robot that standard practice fits to the recordings that are not held out."""
    fit = identify(nominal, recordings, effects=STANDARD, cutoff=cutoff, test_share=test_share)
    return fit.robot


def held_out_blocks(recordings: Sequence[_core.Recording], test_share: float) -> list[Spans]:
    """[s] of each recording, what is held out where recordings are parted into blocks of time.

    Number k of ten is held out when k times the share passes a whole number (`is_held_out` in
    cpp/src/dynamics/problem.cpp).
    """
    length = max(float(r.time[-1] - r.time[0]) for r in recordings) / _BLOCKS * (1.0 + 1e-9)
    passed = [math.floor(k * test_share + 0.5) for k in range(_BLOCKS + 1)]
    held = [k for k in range(_BLOCKS) if passed[k + 1] > passed[k]]
    return [
        [
            (float(r.time[0]) + k * length, min(float(r.time[0]) + (k + 1) * length, float(r.time[-1])))
            for k in held
            if float(r.time[0]) + k * length < float(r.time[-1])
        ]
        for r in recordings
    ]


def held_out_rows(
    recordings: Sequence[_core.Recording], held_out: Sequence[str], test_share: float
) -> list[NDArray[np.bool_]]:
    """Which rows of each recording were held out. held_out: as a diagnosis or fit says."""
    if list(held_out) != [BLOCKS_OF_TIME]:
        return [np.full(len(r), r.name in held_out) for r in recordings]
    return [
        np.any([r.time < -np.inf, *((r.time >= begin) & (r.time < end) for begin, end in spans)], axis=0)
        for r, spans in zip(recordings, held_out_blocks(recordings, test_share), strict=True)
    ]


def spans_of(recording: _core.Recording, held: NDArray[np.bool_]) -> Spans:
    """[s] the stretches of a recording's rows that were held out."""
    rows = np.flatnonzero(held)
    return [
        (float(recording.time[part[0]]), float(recording.time[part[-1]]))
        for part in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        if part.size
    ]


def judge_written(
    ours: Exported, written: Runnable | None, recordings: Sequence[tuple[_core.Recording, NDArray[np.bool_]]]
) -> Rollout:
    """A written model beside the robot that it was written from, on rows that were held out.

    ours: the robot's MJCF, which has callbacks.py where it needs them. written: None for that MJCF alone.
    """
    held = [(recording, spans_of(recording, rows)) for recording, rows in recordings if rows.any()]
    if not held:
        return Rollout(None, "nothing was held out: give recordings that nothing was fitted to (--held-out)")
    motion, spans = [recording for recording, _ in held], [spans for _, spans in held]
    alone = runnable(ours, callbacks=False) if written is None else written
    try:
        models = {"named": runnable(ours), "exported": alone}
        horizons = possible(HORIZONS, motion, spans)
        judged = judge(models, motion, horizons, within=spans, most=WINDOWS)
        return Rollout(judged, refitted=ours.refitted if written is None else ())
    except (ValueError, RuntimeError) as error:
        return Rollout(None, str(error))


def possible(
    horizons: Sequence[float], held: Sequence[Recorded], spans: Sequence[Spans] | None = None
) -> list[float]:
    """The horizons that the longest stretch has room for, or the shortest."""
    whole = [[(float(r.time[0]), float(r.time[-1]))] for r in held]
    longest = max((end - begin for of in spans or whole for begin, end in of), default=0.0)
    return [h for h in sorted(horizons) if h + 0.2 <= longest] or [min(horizons)]


# ---- What result.json and the report are given ---------------------------------------------------
def rollout_dict(found: Rollout, written: str = "MJCF") -> dict[str, Any]:
    """The part `rollout` of result.json. Errors: rms over the windows [rad | m], simulated less measured.
    written: what the model 'exported' is."""
    judged = found.judgement
    if judged is None:
        return {"horizon_s": [], "held_out": {}, "why_not": found.why_not}
    out = {**judgement_dict(judged, "held_out"), "why_not": "", "refitted": list(found.refitted)}
    return {**out, **words_of(judged, written, bool(found.refitted))}


def judgement_dict(judged: Judgement, key: str) -> dict[str, Any]:
    """Errors of every model and joint at each horizon, under `key`."""
    windows = judged.windows
    return {
        "horizon_s": list(windows.horizons),
        key: {
            model: {
                joint: [float(judged.rms(model, h)[j]) for h in windows.horizons]
                for j, joint in enumerate(windows.joints)
            }
            for model in judged.simulated
        },
        "units": dict(zip(windows.joints, windows.units, strict=True)),
        "worst_joint_median": {
            model: [judged.worst_joint(model, h) for h in windows.horizons] for model in judged.simulated
        },
        "windows": int(windows.starts.size),
        "recordings": sorted(set(windows.recordings)),
        "step_error": dict(judged.step_error),
    }


def words_of(judged: Judgement, written: str = "MJCF", refitted: bool = False) -> dict[str, Any]:
    """sentence: how far every model is off. worse: where what was found moves worse than what was there.
    verdict: of these, what the verdict must say."""
    horizon = judged.windows.horizons[main_horizon(judged.windows.horizons)]
    unit = "rad" if not all(judged.windows.prismatic) else "m"
    names = {
        "nominal": "the nominal model",
        "standard": "standard practice",
        "named": "what was named",
        "exported": f"the {written} alone" + (" (fitted anew without what it lacks)" if refitted else ""),
    }
    names = {model: name for model, name in names.items() if model in judged.simulated}
    off = {model: shown(judged.worst_joint(model, horizon), unit) for model in names}
    named = _worse(judged, "named", "what was named", unit)
    return {
        "sentence": f"Simulated {horizon:g} s ahead the robot is off by "
        + ", ".join(f"{off[model]} with {name}" for model, name in names.items())
        + f" (worst joint, median of {judged.windows.starts.size} windows)",
        "worse": [*named, *_worse(judged, "exported", f"the {written} alone", unit)],
        "verdict": [text[:1].upper() + text[1:] for text in named if text.startswith("in motion")],
    }


def _worse(judged: Judgement, model: str, ours: str, unit: str) -> list[str]:
    """Sentences of horizons, and of joints at the main one, at which `model` moves worse."""
    texts = []
    for other, theirs in (("standard", "standard practice"), ("nominal", "the nominal model")):
        if other not in judged.simulated:
            continue
        far = [
            f"{h:g} s ahead by {shown(judged.worst_joint(model, h), unit)} against"
            f" {shown(judged.worst_joint(other, h), unit)}"
            for h in judged.windows.horizons
            if moves_worse(judged.worst_joints(model, h), judged.worst_joints(other, h), unit, np.median)
        ]
        if far:
            texts.append(f"in motion {ours} is worse than {theirs}: off {', '.join(far)}")
        h = judged.windows.horizons[main_horizon(judged.windows.horizons)]
        mine, its = np.abs(judged.errors(model, h)), np.abs(judged.errors(other, h))
        joints = [
            f"{joint} ({shown(_rms(mine[:, j]), u)} against {shown(_rms(its[:, j]), u)})"
            for j, (joint, u) in enumerate(zip(judged.windows.joints, judged.windows.units, strict=True))
            if moves_worse(mine[:, j], its[:, j], u, _rms)
        ]
        if joints:
            texts.append(f"{h:g} s ahead {ours} moves worse than {theirs} at {', '.join(joints)}")
    return texts


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def moves_worse(mine: Floats, its: Floats, unit: str, of_all: Callable[[Floats], float]) -> bool:
    """Whether absolute errors of windows, shape=(n,) [rad | m], are larger than another model's: of all by
    more than a twentieth, and one by one more often than equal models have it once in forty (sign test).
    Who has left is as far off as who has left."""
    has_left = TURN if unit == "rad" else FAR
    mine, its = np.fmin(mine, has_left), np.fmin(its, has_left)  # what is no number has left, too
    more_often = np.count_nonzero(mine > its) - np.count_nonzero(mine < its)
    return bool(of_all(mine) > WORSE * of_all(its) and more_often > 2.0 * np.sqrt(mine.size))


def shown(value: float, unit: str) -> str:
    """An error in degrees or millimetres; of one that has left, that it has."""
    if unit == "rad":
        return f"{math.degrees(value):.2f}°" if value < TURN else "more than a turn"
    return f"{1e3 * value:.2f} mm" if value < FAR else f"more than {FAR:g} m"


def paths_of(judged: Judgement) -> list[Mapping[str, Any]]:
    """Of every joint a stretch to draw: windows one after the other in the recording that has most."""
    windows = judged.windows
    names, counts = np.unique(np.array(windows.recordings), return_counts=True)
    recording = str(names[np.argmax(counts)])
    chosen: list[int] = []
    longest = max(windows.horizons)
    for k in np.flatnonzero(np.array(windows.recordings) == recording):
        start = windows.starts[k]
        if chosen and start - windows.starts[chosen[0]] + longest > DRAWN:
            break
        if not chosen or start >= windows.starts[chosen[-1]] + longest - 1e-9:
            chosen.append(int(k))
    track = windows.tracks[int(windows.track[chosen[0]])]
    begin, end = windows.starts[chosen[0]], windows.starts[chosen[-1]] + longest
    rows = (track.time >= begin) & (track.time <= end)
    scale = [math.degrees(1.0) if unit == "rad" else 1e3 for unit in windows.units]
    return [
        {
            "recording": recording,
            "joint": joint,
            "unit": "°" if windows.units[j] == "rad" else "mm",
            "time": track.time[rows],
            "measured": np.where(track.near_gap(SMOOTHING)[rows], np.nan, scale[j] * track.q[rows, j]),
            **_commanded(track, rows, j, scale[j]),
            "ahead": np.concatenate([[*(windows.starts[k] + windows.times), np.nan] for k in chosen]),
            "simulated": {
                model: np.concatenate([[*(scale[j] * path[k, :, j]), np.nan] for k in chosen])
                for model, path in judged.simulated.items()
            },
        }
        for j, joint in enumerate(windows.joints)
    ]


def _commanded(track: Track, rows: NDArray[np.bool_], joint: int, scale: float) -> dict[str, Floats]:
    """What a joint was commanded, where that was a position."""
    if not (isinstance(track, CommandedTrack) and track.kind == "position"):
        return {}
    return {"commanded": scale * track.held(track.time[rows])[:, joint]}


def response_paths(
    robot: _core.Robot, recording: _core.Recording, response: Response
) -> list[Mapping[str, Any]]:
    """Of every joint the first seconds of a simulated response, to draw."""
    time = np.asarray(recording.time)
    rows = np.flatnonzero(time <= time[0] + DRAWN)
    cuts = np.flatnonzero(np.diff(response.window[rows])) + 1  # a line breaks where a window begins
    joints = [joint for joint in robot.joints if not joint.passive]
    out: list[Mapping[str, Any]] = []
    for j, joint in enumerate(joints):
        turns = joint.type == "revolute"
        scale = math.degrees(1.0) if turns else 1e3
        out.append(
            {
                "recording": recording.name,
                "joint": joint.name,
                "unit": "°" if turns else "mm",
                "time": time[rows],
                "measured": scale * np.asarray(recording.position)[rows, j],
                "ahead": np.append(np.insert(time[rows], cuts, np.nan), np.nan),
                "simulated": {
                    "named": np.append(np.insert(scale * response.position[rows, j], cuts, np.nan), np.nan)
                },
            }
        )
    return out
