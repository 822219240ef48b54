# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How a robot is measured: which poses, from which side, with which load, when, how warm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from truing.exam.kinematics import Chain, Floats
from truing.exam.laws import Inputs
from truing.exam.robots import Specimen

RIGHT_AT = 20.0
"""Temperature at which the nominal robot is right [deg C]: measured warm, it has other lengths and zeros."""

COVARIATES = {
    "supply_bar": (6.0, 0.4),
    "humidity_pct": (45.0, 12.0),
    "spindle_rpm": (3000.0, 900.0),
}  # mean and spread


@dataclass(frozen=True)
class Plan:
    """A way of measuring; the same plan gives the poses handed over and the fresh ones."""

    low: Floats  # (driven,) [rad | m]
    high: Floats
    poses: int
    repeats: float = 0.0  # share of the poses that are approached again
    targets: int = 1
    both_sides: bool = True  # each joint comes from a side of its own choice; else from the pose before
    one_sided: tuple[int, ...] = ()  # driven joints that always come from below
    payloads: tuple[float, ...] = (0.0,)
    seconds: float = 20.0  # from pose to pose
    warmth: float = 12.0  # [K]
    cooling: float = 0.55  # share of the time after which it cools down again; 1: never
    steady_warming: bool = False  # temperature rises in proportion to time
    equal_speed: bool = False
    still: Mapping[int, float] = field(
        default_factory=dict
    )  # driven joints that do not move, and where they stand
    moving: tuple[int, ...] = ()  # driven joints that have a speed while measured; empty: all
    levels: tuple[Floats, ...] = ()  # of each driven joint: where it stands, on a grid; empty: anywhere


def usual_plan(specimen: Specimen, chain: Chain, rng: Generator, poses: int, payloads: bool) -> Plan:
    low, high = limits(specimen, chain)
    levels = (
        (0.0,)
        if not payloads
        else tuple(
            specimen.payload * share for share in ((0.0, 1.0) if rng.random() < 0.5 else (0.0, 0.5, 1.0))
        )
    )
    targets = 2 if poses <= 200 and rng.random() < 0.2 else 1
    repeats = float(rng.choice([0.0, 0.0, 0.1, 0.25]))
    return Plan(
        low,
        high,
        poses,
        repeats,
        targets,
        both_sides=bool(rng.random() < 0.6),
        payloads=levels,
        seconds=float(rng.uniform(10.0, 30.0)),
        warmth=float(rng.uniform(8.0, 18.0)),
        cooling=float(rng.uniform(0.45, 0.65)),
    )


def limits(specimen: Specimen, chain: Chain) -> tuple[Floats, Floats]:
    """Lowest and highest reading of each driven joint, shape=(driven,) [rad | m]."""
    joints = [specimen.robot.joints[j] for j in chain.driven]
    return np.array([joint.lower for joint in joints]), np.array([joint.upper for joint in joints])


def draw(specimen: Specimen, chain: Chain, plan: Plan, rng: Generator, fresh: int = 0) -> Inputs:
    """Inputs of a measurement after `plan`; `fresh`: so many new poses, once each, over the same hours."""
    count = fresh or plan.poses
    poses = _poses(specimen, chain, plan, rng, count)
    visits = np.arange(count)
    again = 0 if fresh else round(plan.repeats * count)
    if again:
        visits = rng.permutation(np.concatenate([visits, rng.choice(count, size=again)]))
    readings = poses[visits]
    previous = np.vstack([readings[:1] - 0.1, readings[:-1]])
    direction = _directions(plan, rng, readings, previous)
    time = _times(plan, rng, len(visits), bool(fresh))
    rows = np.repeat(np.arange(len(visits)), 1 if fresh else plan.targets)
    target = np.zeros(len(rows), dtype=np.int64) if fresh else np.tile(np.arange(plan.targets), len(visits))
    speed = direction * (0.3 if plan.equal_speed else rng.uniform(0.05, 0.6, direction.shape))
    if plan.moving:
        speed[:, [k for k in range(speed.shape[1]) if k not in plan.moving]] = 0.0
    payload = rng.choice(np.array(plan.payloads), size=count)[visits]
    covariates = {name: _wander(rng, len(visits), *values)[rows] for name, values in COVARIATES.items()}
    return Inputs(
        readings[rows],
        previous[rows],
        direction[rows],
        speed[rows],
        payload[rows],
        temperature(plan, time)[rows],
        RIGHT_AT,
        time[rows],
        covariates,
        target,
        visits[rows],
    )


def _poses(specimen: Specimen, chain: Chain, plan: Plan, rng: Generator, count: int) -> Floats:
    poses = _anywhere(plan, rng, count)
    for _ in range(200):
        bad = ~_reachable(specimen, chain, poses)
        if not bad.any():
            break
        poses[bad] = _anywhere(plan, rng, int(bad.sum()))
    for column, value in plan.still.items():
        poses[:, column] = value
    return poses


def _anywhere(plan: Plan, rng: Generator, count: int) -> Floats:
    if plan.levels:
        return np.stack([rng.choice(levels, size=count) for levels in plan.levels], axis=1)
    return np.asarray(rng.uniform(plan.low, plan.high, (count, len(plan.low))))


def _reachable(specimen: Specimen, chain: Chain, poses: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Rods of a palletizer must not come near their dead centre."""
    if specimen.rod_arm == 0.0:
        return np.ones(len(poses), dtype=bool)
    low, high = limits(specimen, chain)
    drivers = [chain.driven.index(driver) for driver, _ in next(by for by in chain.drivers if by)]
    lean = poses[:, drivers].sum(axis=1) - 0.5 * (low + high)[drivers].sum()
    return np.asarray(np.abs(lean) < 1.1)


def _directions(plan: Plan, rng: Generator, readings: Floats, previous: Floats) -> Floats:
    free = rng.choice([-1.0, 1.0], size=readings.shape)
    came = np.where(readings > previous, 1.0, np.where(readings < previous, -1.0, free))
    direction = free if plan.both_sides else came
    direction[:, list(plan.one_sided)] = 1.0
    return np.asarray(direction)


def _times(plan: Plan, rng: Generator, count: int, fresh: bool) -> Floats:
    total = plan.seconds * plan.poses * (1.0 + plan.repeats)
    if fresh:
        return np.sort(rng.uniform(0.0, total, count))
    gaps = rng.uniform(0.7, 1.3, count)
    gaps[int(rng.integers(count))] += 0.05 * count  # somebody had a coffee
    time = np.cumsum(gaps)
    return np.asarray(time / time[-1] * total)


def temperature(plan: Plan, time: Floats) -> Floats:
    """Temperature at times [s], shape=(n,) [deg C]: warms up while working, cools down when the work gets
    light; swings a little with the hall.
    """
    total = plan.seconds * plan.poses * (1.0 + plan.repeats)
    share = time / total
    if plan.steady_warming:
        return np.asarray(RIGHT_AT + plan.warmth * share)
    peak = 1.0 - math.exp(-plan.cooling / 0.25)
    rising = 1.0 - np.exp(-share / 0.25)
    falling = peak * np.exp(-(share - plan.cooling) / 0.2)
    return np.asarray(
        RIGHT_AT + plan.warmth * np.where(share < plan.cooling, rising, falling) + 0.4 * np.sin(17.0 * share)
    )


def _wander(rng: Generator, count: int, mean: float, spread: float) -> Floats:
    """A quantity that somebody logged: it wanders about its mean."""
    steps = rng.normal(size=count)
    values = np.empty(count)
    value = float(rng.normal())
    for row in range(count):
        value = 0.9 * value + math.sqrt(1.0 - 0.81) * steps[row]
        values[row] = value
    return mean + spread * values
