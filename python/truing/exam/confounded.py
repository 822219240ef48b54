# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Ways of measuring that make two effects one: the honest answer names both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from numpy.random import Generator

from truing.exam import laws
from truing.exam.design import Plan, usual_plan
from truing.exam.kinematics import Chain
from truing.exam.laws import Hidden
from truing.exam.robots import Specimen


@dataclass(frozen=True)
class Twin:
    """An effect, the one that looks the same, and the plan that makes it so."""

    hidden: Hidden
    rival: str
    rival_joint: int  # -1: the robot as a whole
    plan: Plan
    handed: frozenset[str]
    exact: bool = True  # else it is looked at whether they are alike


Kind = Callable[[Specimen, Chain, Generator], "Twin | None"]


def _plan(specimen: Specimen, chain: Chain, rng: Generator, payloads: bool = False) -> Plan:
    return replace(
        usual_plan(specimen, chain, rng, int(rng.choice([150, 200, 300])), payloads), both_sides=True
    )


def _arms(chain: Chain) -> tuple[int, int]:
    """Shoulder and elbow: the second and third turning joints, which carry the weight."""
    return chain.revolute[1], chain.revolute[2]


def _with_range(plan: Plan, column: int, low: float, high: float) -> Plan:
    lows, highs = plan.low.copy(), plan.high.copy()
    lows[column], highs[column] = max(low, float(plan.low[column])), min(high, float(plan.high[column]))
    return replace(plan, low=lows, high=highs)


def one_sided(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """Backlash at a joint that is always approached from below is its zero."""
    joint = int(rng.choice(chain.revolute[1:-1]))
    plan = replace(_plan(specimen, chain, rng), one_sided=(chain.driven.index(joint),))
    return Twin(laws.backlash(joint, rng), "joint_offset", joint, plan, frozenset({"dir"}))


def steady_warming(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """Temperature rises in proportion to time: the first joint's warm zero is a base that turns."""
    if chain.prismatic[0]:
        return None
    plan = replace(_plan(specimen, chain, rng), steady_warming=True)
    return Twin(laws.thermal_zero(0, rng), "drift", -1, plan, frozenset({"temp", "t"}))


def long_metre(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """A tracker's metre against all lengths of the arm. A slide's travel is no length of a link."""
    if chain.prismatic.any():
        return None
    return Twin(laws.scale(0, rng), "link_geometry", -1, _plan(specimen, chain, rng), frozenset({"t"}))


def short_range(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """Over a few degrees the joint's zero is a harmonic."""
    joint = int(rng.choice(chain.revolute[1:-1]))
    plan = _plan(specimen, chain, rng)
    column = chain.driven.index(joint)
    center = float(rng.uniform(plan.low[column] + 0.3, plan.high[column] - 0.3))
    return Twin(
        laws.joint_offset(joint, rng),
        "harmonic",
        joint,
        _with_range(plan, column, center - 0.12, center + 0.12),
        frozenset({"dir"}),
        exact=False,
    )


def one_posture(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """One load and an arm held straight: the elbow's spring and the upper arm's bending."""
    shoulder, elbow = _arms(chain)
    if specimen.rod_arm or elbow != shoulder + 1:
        return None
    plan = _plan(specimen, chain, rng)
    still = {
        k: float(rng.uniform(plan.low[k], plan.high[k]))
        for k in range(chain.driven.index(elbow), len(chain.driven) - 1)
    }
    plan = replace(plan, still=still)
    return Twin(
        laws.joint_compliance(elbow, rng),
        "link_compliance",
        shoulder,
        plan,
        frozenset({"masses"}),
        exact=False,
    )


def leaning_arm(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """The arm near upright, its upper part held: the weight's torque is in proportion to the angle, as a
    wrong gear ratio is.
    """
    shoulder, elbow = _arms(chain)
    plan = _plan(specimen, chain, rng)
    column = chain.driven.index(shoulder)
    if specimen.rod_arm:
        return None
    still = {
        k: float(rng.uniform(plan.low[k], plan.high[k]))
        for k in range(chain.driven.index(elbow), len(chain.driven) - 1)
    }
    center = float(rng.uniform(plan.low[column] + 0.3, plan.high[column] - 0.3))
    plan = replace(_with_range(plan, column, center - 0.2, center + 0.2), still=still)
    return Twin(
        laws.gear_ratio(shoulder, rng), "joint_compliance", shoulder, plan, frozenset({"masses"}), exact=False
    )


def one_sided_weight(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """The arm leans forward only: play on the side of the weight is the joint's zero."""
    shoulder, elbow = _arms(chain)
    joint = int(rng.choice([shoulder, elbow]))
    plan = _plan(specimen, chain, rng)
    for arm in (shoulder, elbow):
        column = chain.driven.index(arm)
        low, high = float(plan.low[column]), float(plan.high[column])
        side = float(rng.uniform(0.0, 0.6))
        plan = _with_range(plan, column, low + side * (high - low), low + (side + 0.4) * (high - low))
    return Twin(
        laws.gravity_backlash(joint, rng), "joint_offset", joint, plan, frozenset({"masses"}), exact=False
    )


def no_friction(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """Motor torques that hold the weight and nothing else: wind-up is compliance."""
    joint = int(rng.choice(_arms(chain)))
    plan = _plan(specimen, chain, rng, payloads=True)
    return Twin(
        laws.joint_compliance(joint, rng), "windup", joint, plan, frozenset({"masses", "payload", "bare_tau"})
    )


def one_speed(specimen: Specimen, chain: Chain, rng: Generator) -> Twin | None:
    """One joint moves, always as fast: a late clock is its backlash."""
    joint = int(rng.choice(chain.revolute[1:-1]))
    plan = replace(_plan(specimen, chain, rng), equal_speed=True, moving=(chain.driven.index(joint),))
    return Twin(laws.backlash(joint, rng), "time_offset", -1, plan, frozenset({"dir", "speed"}))


def twins() -> tuple[Kind, ...]:
    return (
        one_sided,
        steady_warming,
        long_metre,
        short_range,
        one_posture,
        leaning_arm,
        one_sided_weight,
        no_friction,
        one_speed,
    )
