# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How far the tool of one robot is from another's, over poses of the whole range: what a format drops, in
metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError

Floats = NDArray[np.float64]

POSES = 200
_SEED = 20


@dataclass(frozen=True)
class Dropped:
    """Something of the robot that is not written. size: how far it moves the tool at most [m]; NaN: not
    known.
    """

    name: str
    size: float
    reason: str


@dataclass(frozen=True)
class Distance:
    """Between tools [m], over poses of the robot's range."""

    rms: float
    largest: float


def poses_of(robot: _core.Robot) -> _core.Measurements:
    """Poses and inputs of the whole range: joints within their limits, both directions of approach, payload
    and temperature within what the effects were fitted on.
    """
    rng = np.random.default_rng(_SEED)
    columns = []
    for k, index in enumerate(robot.driven_joints(), 1):
        joint = robot.joints[index]
        widest = math.pi if joint.type == "revolute" else 1.0
        low = joint.lower if math.isfinite(joint.lower) else -widest
        high = joint.upper if math.isfinite(joint.upper) else widest
        if joint.type == "revolute":  # further turns show nothing new
            low, high = max(low, -math.pi), min(high, math.pi)
        seen = robot.fitted_range.get(f"q{k}", (low, high))
        low, high = max(low, seen[0]), min(high, seen[1])
        columns.append(rng.uniform(low, high, POSES) if low < high else np.full(POSES, low))
    shape = (POSES, len(columns))

    def within(name: str) -> Floats:
        low, high = robot.fitted_range.get(name, (0.0, 0.0))
        return rng.uniform(low, high, POSES)

    return _core.Measurements(
        np.column_stack(columns),
        directions=rng.choice([-1.0, 1.0], shape),
        joint_speeds=np.zeros(shape),
        payload=within("payload"),
        temperature=within("temp"),
        time=np.arange(float(POSES)),
        target_names=[target.name for target in robot.targets],
    )


def tools(robot: _core.Robot, poses: _core.Measurements) -> Floats:
    """Positions of the tool in the measurement frame, effects included, shape=(n, 3) [m]."""
    return np.asarray(_core.predict(robot, poses).position)


def between(one: _core.Robot, other: _core.Robot, poses: _core.Measurements) -> Distance:
    """Both robots' tools at the same readings."""
    apart = np.linalg.norm(tools(one, poses) - tools(other, poses), axis=1)
    return Distance(float(np.sqrt(np.mean(apart**2))), float(apart.max()))


def without_effects(robot: _core.Robot) -> _core.Robot:
    return robot.replace(effects=[], torque_effects=[], fitted_range={}, anchor=None)


def dropped_links(remaining: Distance, reason: str) -> Dropped:
    """Where links stay nominal: all that zeros, tool and base cannot make good."""
    return Dropped("lengths and twists of links", remaining.largest, reason)


def dropped_effects(robot: _core.Robot, reason: str) -> list[Dropped]:
    """Every effect of the robot, with what the tool moves by when it alone is left out."""
    poses = poses_of(robot)
    out = []
    for k, effect in enumerate(robot.effects):
        rest = [other for n, other in enumerate(robot.effects) if n != k]
        size = _size(robot, robot.replace(effects=rest), poses)
        out.append(Dropped(_named(effect), size, reason))
    return out


def dropped_ratios(robot: _core.Robot, reason: str) -> list[Dropped]:
    """Gear ratios other than 1, likewise."""
    poses = poses_of(robot)
    out = []
    for k, joint in enumerate(robot.joints):
        if joint.ratio == 1.0 or joint.driven_by:
            continue
        other = robot.copy()
        other.joints[k].ratio = 1.0
        out.append(Dropped(f"{joint.name}.ratio", _size(robot, other, poses), reason))
    return out


def _size(robot: _core.Robot, other: _core.Robot, poses: _core.Measurements) -> float:
    try:
        return between(robot, other, poses).largest
    except InputError:  # an input that nobody can make up here
        return math.nan


def _named(effect: _core.AppliedEffect) -> str:
    return f"{effect.effect} {'+'.join(effect.joints)}".strip()
