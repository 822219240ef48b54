# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Real recordings as a source of real noise.

What an instrument and a real arm leave after a flexible fit is neither white nor Gaussian, and wanders and
jumps in its own way. It is put on top of a robot with one sealed effect, at the poses where it was recorded.
The flexible fit takes what is systematic (link values, functions of each joint, approach direction, frames
that wander), so that the sealed effect is what there is to find.
"""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import truing
from truing.exam.kinematics import Chain, Floats, chain_of, rotations, sweep
from truing.exam.laws import Context, Inputs
from truing.exam.robots import Specimen
from truing.exam.sizing import View
from truing.model import pose_groups

_FILES = {
    "development": (
        ("irb120_faro", "robot.yaml", "measurements.csv"),
        ("motoman_leica", "robot_right.yaml", "measurements_right.csv"),
    ),
    "examination": (
        ("ipa_ur10_leica", "robot.yaml", "measurements_series_c.csv"),
        ("ipa_ur10_leica", "robot.yaml", "measurements_series_b.csv"),
        ("motoman_leica", "robot_left.yaml", "measurements_left.csv"),
    ),
}
_SECONDS = 20.0  # between poses, where nobody wrote the time down
_TIME_KNOTS = 8
_PASSES = 4  # of the robust fit
_TUKEY = 4.685
_LONG = 1000  # rows
_RIDGE = 1e-11  # on unit columns: many of them say the same


@dataclass(frozen=True)
class Recording:
    """A recording, its fitted frames, and what the flexible fit leaves of it."""

    name: str
    nominal: truing.Robot  # as published
    chain: Chain  # with fitted base and targets
    inputs: Inputs  # of every row
    noise: Floats  # (n, 3) [m]
    sigma: float  # of one component, robust [m]

    @property
    def specimen(self) -> Specimen:
        return Specimen(self.nominal, payload=0.0)


def folder() -> Path | None:
    """Where the recordings are, or None."""
    place = os.environ.get("TRUING_REALDATA")
    return Path(place) if place and Path(place).is_dir() else None


def missing(which: str) -> str:
    """Why the recordings cannot take part; empty: they can."""
    place = folder()
    if place is None:
        return "TRUING_REALDATA names no folder with recordings"
    absent = [name for name, _, _ in _FILES[which] if not (place / name).is_dir()]
    return f"no {', '.join(sorted(set(absent)))} in TRUING_REALDATA" if absent else ""


@functools.cache
def recordings(which: str) -> tuple[Recording, ...]:
    place = folder()
    if place is None:
        return ()
    return tuple(_load(place / name, robot, measurements) for name, robot, measurements in _FILES[which])


def _load(place: Path, robot_file: str, measurement_file: str) -> Recording:
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", truing.InputWarning)
        robot = truing.load_robot(place / robot_file)
        data = truing.load_measurements(place / measurement_file, robot)
    positions = np.asarray(data.positions)
    keep = np.isfinite(positions).all(axis=1)
    inputs = _inputs(data, keep)
    nominal = robot.replace(T_measurement_base=np.eye(4))
    chain = fit_frames(chain_of(nominal), inputs, positions[keep])
    noise = _flexible_rest(chain, inputs, positions[keep])
    sigma = 1.4826 * float(np.median(np.abs(noise)))
    return Recording(f"{place.name}/{measurement_file}", nominal, chain, inputs, noise, sigma)


def _inputs(data: truing.Measurements, keep: NDArray[np.bool_]) -> Inputs:
    readings = np.asarray(data.joints)[keep]
    n = len(readings)
    pose = np.asarray(pose_groups(data))[keep].astype(np.int64)
    _, first = np.unique(pose, return_index=True)
    order = np.sort(first)
    came = np.vstack([readings[order[:1]], readings[order[:-1]]])
    place = {int(pose[row]): k for k, row in enumerate(order)}
    visit = np.array([place[int(p)] for p in pose])
    previous = came[visit]
    direction = np.where(readings >= previous, 1.0, -1.0)
    target = (
        np.asarray(data.targets)[keep].astype(np.int64)
        if data.targets is not None
        else np.zeros(n, dtype=np.int64)
    )
    zero = np.zeros(n)
    return Inputs(
        readings,
        previous,
        direction,
        np.zeros_like(readings),
        zero,
        zero + 20.0,
        20.0,
        _SECONDS * visit.astype(float),
        {},
        target,
        visit.astype(np.int64),
    )


def rows_of(inputs: Inputs, rows: NDArray[np.int64]) -> Inputs:
    """Some rows of some inputs."""
    return Inputs(
        inputs.readings[rows],
        inputs.previous[rows],
        inputs.direction[rows],
        inputs.speed[rows],
        inputs.payload[rows],
        inputs.temperature[rows],
        inputs.reference,
        inputs.time[rows],
        {name: values[rows] for name, values in inputs.covariates.items()},
        inputs.target[rows],
        inputs.pose[rows],
    )


def _with_frames(chain: Chain, base: Floats, places: Floats) -> Chain:
    targets = []
    for frame, place in zip(chain.targets, places, strict=True):
        moved = frame.copy()
        moved[:3, 3] = place
        targets.append(moved)
    return Chain(**{**chain.__dict__, "base": base, "targets": tuple(targets)})


def fit_frames(chain: Chain, inputs: Inputs, measured: Floats) -> Chain:
    """Base and targets by alternating registrations and linear solutions for the targets."""
    places = np.array([frame[:3, 3] for frame in chain.targets])
    base = np.eye(4)
    for _ in range(200):
        state = sweep(_with_frames(chain, np.eye(4), places), inputs.readings, target=inputs.target)
        base = _registered(state.tip, measured)
        back = (measured - base[:3, 3]) @ base[:3, :3]
        before = places.copy()
        for k in range(len(places)):
            mine = inputs.target == k
            if mine.any():
                ahead = back[mine] - state.link_origin[-1][mine]
                places[k] = np.mean(np.einsum("nab,na->nb", state.link_rotation[-1][mine], ahead), axis=0)
        if np.abs(places - before).max() < 1e-7:
            break
    return _with_frames(chain, base, places)


def _registered(points: Floats, measured: Floats) -> Floats:
    """Rigid transform of points onto measured ones (Kabsch)."""
    a, b = points.mean(axis=0), measured.mean(axis=0)
    u, _, v = np.linalg.svd((points - a).T @ (measured - b))
    turn = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ v)))])
    frame = np.eye(4)
    frame[:3, :3] = (u @ turn @ v).T
    frame[:3, 3] = b - frame[:3, :3] @ a
    return frame


def _flexible_rest(chain: Chain, inputs: Inputs, measured: Floats) -> Floats:
    """Residuals of a fit that may bend every joint in its own angle and let the frame wander; gross errors
    stay in.
    """
    context = Context(chain, inputs)
    view = View(context)
    columns = [
        np.broadcast_to(c, (context.n, 3)).ravel()
        for c in view._frame_columns() + view.geometry_columns() + _bends(view) + _wander(view)
    ]
    matrix = np.stack(columns, axis=1)
    size = np.linalg.norm(matrix, axis=0)
    matrix = matrix[:, size > 1e-9] / size[size > 1e-9]
    rest = (measured - context.state.tip).ravel()
    weight = np.ones(len(rest))
    left = rest
    for _ in range(_PASSES):
        weighted = matrix * weight[:, None]
        gram = weighted.T @ matrix + _RIDGE * np.eye(matrix.shape[1])
        left = rest - matrix @ np.linalg.solve(gram, weighted.T @ rest)
        length = np.linalg.norm(left.reshape(-1, 3), axis=1)
        u = np.clip(length / (_TUKEY * 1.5 * float(np.median(length))), 0.0, 1.0)
        weight = np.repeat((1.0 - u**2) ** 2, 3)
    return np.asarray(left.reshape(-1, 3))


def _bends(view: View) -> list[Floats]:
    """Every joint as a function of its own angle; in long recordings also of two angles, as weight and cables
    need it.
    """
    context = view.context
    orders = range(1, 4 if context.n < _LONG else 9)
    found = []
    moving = [joint for joint in context.chain.driven if np.ptp(context.motion[:, joint]) > 0.05]
    for joint in moving:
        q = context.motion[:, joint]
        values = [f(k * q) for f in (np.cos, np.sin) for k in orders] + [
            q,
            context.inputs.direction[:, context.column(joint)],
        ]
        if context.n >= _LONG:
            values += [
                f(context.motion[:, a] + side * context.motion[:, b])
                for f in (np.cos, np.sin)
                for side in (-1.0, 1.0)
                for a in moving
                for b in moving
                if a < b
            ]
        found += [value[:, None] * view.columns["motion", joint, 0] for value in values]
    return found


def _wander(view: View) -> list[Floats]:
    time = view.context.inputs.time
    knots = np.linspace(time.min(), time.max(), _TIME_KNOTS)
    hats = [np.interp(time, knots, np.eye(_TIME_KNOTS)[k]) for k in range(1, _TIME_KNOTS)]
    return [hat[:, None] * column for hat in hats for column in view._frame_columns()[:6]]


def turned(rotation: Floats, by: Floats) -> Floats:
    """Rotations turned by small rotation vectors about the axes of the measurement frame."""
    return np.asarray(rotations(by) @ rotation)
