# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Laws of the examiner's hidden effects, written anew from textbooks and data sheets: nothing here comes from
the catalogue.

A law says what the true robot does differently for an effect of size 1; sizes are set later, from what is
seen at the tip. A law
may depart from the textbook by a share: springs harden, play grows with load, a link's temperature lags
behind the sensor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator

from truing.exam.kinematics import (
    ALPHA,
    BETA,
    A,
    Chain,
    Changes,
    D,
    Floats,
    Ints,
    Sweep,
    gravity_torques,
    motions,
    no_changes,
    side_of,
    sweep,
)


@dataclass(frozen=True)
class Inputs:
    """What happens while measuring: one row per measurement, whether or not it is told to the candidate."""

    readings: Floats  # (n, driven) [rad | m]
    previous: Floats  # (n, driven) where the robot came from [rad | m]
    direction: Floats  # (n, driven) -1 or 1
    speed: Floats  # (n, driven) [rad/s | m/s]
    payload: Floats  # (n,) [kg]
    temperature: Floats  # (n,) [deg C]
    reference: float  # temperature at which the nominal robot is right [deg C]
    time: Floats  # (n,) [s]
    covariates: Mapping[str, Floats]  # (n,) each, in the unit of the name
    target: Ints  # (n,) which target was measured
    pose: Ints  # (n,) rows of one approach share a number

    @property
    def rows(self) -> int:
        return len(self.payload)


class Context:
    """The nominal robot at the inputs: what laws look at.

    What a law scales itself by (the largest torque, the range of a joint, the hours) is taken from the
    context `of` the measurement, so that the same robot is met again at fresh poses.
    """

    def __init__(self, chain: Chain, inputs: Inputs, of: Context | None = None) -> None:
        self.chain, self.inputs = chain, inputs
        self.of: Context = of if of is not None else self

    @property
    def n(self) -> int:
        return self.inputs.rows

    def still(self) -> Changes:
        return no_changes(self.n, self.chain.joints)

    @cached_property
    def motion(self) -> Floats:
        """Motion of every joint, shape=(n, J) [rad | m]."""
        return motions(self.chain, self.inputs.readings)

    @cached_property
    def state(self) -> Sweep:
        return sweep(self.chain, self.inputs.readings, target=self.inputs.target, every_site=True)

    @cached_property
    def torque(self) -> Floats:
        """Of weight and payload on every joint, shape=(n, J) [Nm | N]."""
        return gravity_torques(self.chain, self.state, self.inputs.payload)

    @cached_property
    def warmth(self) -> Floats:
        """Temperature above where the nominal robot is right, shape=(n,) [K]."""
        return self.inputs.temperature - self.inputs.reference

    def column(self, joint: int) -> int:
        return self.chain.driven.index(joint)

    def largest(self, joint: int) -> float:
        """Largest torque that the joint met [Nm]."""
        return float(np.abs(self.of.torque[:, joint]).max()) + 1e-9

    @property
    def hours(self) -> Floats:
        """Share of the measurement's time that has passed, shape=(n,)."""
        time = self.of.inputs.time
        return np.asarray((self.inputs.time - time.min()) / max(float(np.ptp(time)), 1.0))


Law = Callable[[Context], Changes]


@dataclass(frozen=True)
class Hidden:
    """An effect of the true robot."""

    effect: str
    joints: tuple[int, ...]  # empty: the robot as a whole
    law: Law
    size: float = 1.0
    needs: frozenset[str] = frozenset()  # columns without which nobody can find it
    inputs: tuple[str, ...] = ()  # of unlisted effects: what it depends on
    detail: Mapping[str, float] = field(default_factory=dict)  # shape, for mechanisms and for the label
    listed: bool = True
    exact: Callable[[Context, float], Changes] | None = (
        None  # at a size, where it is not the law times the size
    )
    warms: bool = False  # follows the temperature from where the robot was right

    def changes(self, context: Context) -> Changes:
        return self.exact(context, self.size) if self.exact else self.law(context).scaled(self.size)

    def sized(self, size: float) -> Hidden:
        return replace(self, size=size)


def at_joint(joint: int, values: Callable[[Context], Floats]) -> Law:
    """The joint moves by `values`, shape=(n,) [rad | m], on top of what it should."""

    def law(context: Context) -> Changes:
        changes = context.still()
        changes.motion[:, joint] = values(context)
        return changes

    return law


# ---- Joints --------------------------------------------------------------------------------------


def joint_offset(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    return Hidden("joint_offset", (joint,), at_joint(joint, lambda c: np.ones(c.n)))


def gear_ratio(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """With departure: the pitch of one half turn differs from that of the other."""
    side = float(rng.choice([-1.0, 1.0]))
    return Hidden(
        "gear_ratio",
        (joint,),
        at_joint(joint, lambda c: c.motion[:, joint] * (1.0 + depart * (side * c.motion[:, joint] > 0.0))),
    )


def harmonic(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """An eccentric disc, an oval one, or both; with departure a third order as well."""
    first, second = [(1.0, 0.0), (0.0, 1.0), (0.8, 0.6)][int(rng.choice(3, p=[0.5, 0.2, 0.3]))]
    phase = rng.uniform(-np.pi, np.pi, 3)

    def values(c: Context) -> Floats:
        q = c.motion[:, joint]
        return np.asarray(
            first * np.cos(q + phase[0])
            + second * np.cos(2 * q + phase[1])
            + depart * np.cos(3 * q + phase[2])
        )

    return Hidden("harmonic", (joint,), at_joint(joint, values), detail={"first": first, "second": second})


def transmission_error(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """Tooth meshing; with departure it is no sine: its multiples come with it."""
    order = float(rng.choice([60, 81, 96, 100, 121, 160]))
    phase = float(rng.uniform(-np.pi, np.pi))

    def values(c: Context) -> Floats:
        u = order * c.motion[:, joint] + phase
        return np.asarray(np.cos(u) + depart * (0.7 * np.cos(2 * u + 0.4) + 0.4 * np.cos(3 * u + 1.1)))

    return Hidden("transmission_error", (joint,), at_joint(joint, values), detail={"order": order})


def backlash(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """Play that the approach decides; with departure it widens with load."""

    def values(c: Context) -> Floats:
        share, usual = (np.abs(of.torque[:, joint]) / c.largest(joint) for of in (c, c.of))
        return np.asarray(
            0.5 * c.inputs.direction[:, c.column(joint)] * (1.0 + depart * 2.0 * (share - usual.mean()))
        )

    return Hidden("backlash", (joint,), at_joint(joint, values), needs=frozenset({"dir"}))


def gravity_backlash(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """Play that the weight decides; with departure it closes gradually."""

    def values(c: Context) -> Floats:
        torque = c.torque[:, joint]
        if depart == 0.0:
            return 0.5 * side_of(torque)
        return np.asarray(0.5 * np.tanh(torque / (0.5 * depart * c.largest(joint))))

    return Hidden("gravity_backlash", (joint,), at_joint(joint, values), needs=frozenset({"masses"}))


def hardening(torque: Floats, largest: float, depart: float) -> Floats:
    """Deflection per unit compliance of a strain-wave gear: three zones, each stiffer than the one before."""
    knots = np.array([0.0, 0.3, 0.65, 10.0]) * largest
    slopes = (1.0 + depart, 1.0, 1.0 - 0.6 * depart)
    size = np.abs(torque)
    total = np.zeros_like(size)
    for low, high, slope in zip(knots[:-1], knots[1:], slopes, strict=True):
        total = total + slope * (np.clip(size, low, high) - low)
    return np.asarray(np.copysign(total, torque))


def joint_compliance(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A gear that gives way; with departure in three zones."""

    def values(c: Context) -> Floats:
        torque = c.torque[:, joint]
        return hardening(torque, c.largest(joint), depart) if depart else torque

    return Hidden("joint_compliance", (joint,), at_joint(joint, values), detail={"depart": depart})


def dead_band(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A brake pad or preload that holds up to half the largest torque; only beyond it the joint gives way."""

    def values(c: Context) -> Floats:
        torque = c.torque[:, joint]
        return np.asarray(np.copysign(np.maximum(np.abs(torque) - 0.45 * c.largest(joint), 0.0), torque))

    return Hidden("joint_compliance", (joint,), at_joint(joint, values), detail={"dead_band": 0.45})


def motor_torque(context: Context, joint: int, friction: float) -> Floats:
    """What the motor gives at standstill: it holds the weight, and friction holds against the way it came."""
    weight = context.torque[:, joint]
    level = friction * context.largest(joint)
    return np.asarray(
        -weight + context.inputs.direction[:, context.column(joint)] * (level + 0.15 * np.abs(weight))
    )


def windup(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """The drive twists under its motor's torque, friction included."""
    friction = float(rng.uniform(0.25, 0.6))
    law = at_joint(joint, lambda c: -motor_torque(c, joint, friction))
    return Hidden("windup", (joint,), law, needs=frozenset({"tau"}), detail={"friction": friction})


def joint_coupling(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """The wrist's joints drag each other along: `joint` is the last one."""
    share = rng.uniform(-1.0, 1.0, 2)

    def law(context: Context) -> Changes:
        changes = context.still()
        changes.motion[:, joint - 1] = share[0] * context.motion[:, joint - 2]
        changes.motion[:, joint] = share[1] * context.motion[:, joint - 1]
        return changes

    return Hidden("joint_coupling", (), law)


def time_offset(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    def law(context: Context) -> Changes:
        changes = context.still()
        changes.motion[:, context.chain.driven] = context.inputs.speed
        return changes

    return Hidden("time_offset", (), law, needs=frozenset({"speed"}))


# ---- Links ---------------------------------------------------------------------------------------


def link_geometry(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """One link is not as drawn: longer, shifted or twisted."""
    which = int(rng.choice([D, A, ALPHA]))

    def law(context: Context) -> Changes:
        changes = context.still()
        changes.links[:, joint, which] = 1.0
        return changes

    return Hidden("link_geometry", (joint,), law, detail={"value": float(which)})


def all_geometry(chain: Chain, rng: Generator) -> Law:
    """Errors of manufacture on every link: 0.3 mm and 0.5 mrad. The axes that rods run across stay parallel,
    else the rods would jam.
    """
    joints = chain.joints
    passive = [j for j in range(joints) if j not in chain.driven]
    across = [driver + chain.mdh for j in passive for driver, _ in chain.drivers[j]]
    lengths, angles = rng.normal(0.0, 3e-4, (joints, 2)), rng.normal(0.0, 5e-4, (joints, 2))

    def law(context: Context) -> Changes:
        changes = context.still()
        changes.links[:, :, [D, A]] = lengths
        changes.links[:, :, ALPHA] = angles[:, 0]
        changes.links[:, across, ALPHA] = 0.0
        changes.motion[:] = angles[:, 1]
        changes.motion[:, [*passive, *np.flatnonzero(chain.prismatic)]] = 0.0
        return changes

    return law


def lagging(context: Context, constant: float) -> Floats:
    """Temperature of a part that follows the sensor by a first-order lag."""
    time, warmth = context.inputs.time, context.warmth
    order = np.argsort(time, kind="stable")
    found = np.empty(len(time))
    value = float(warmth[order[0]])
    before = float(time[order[0]])
    for row in order:
        value += (float(warmth[row]) - value) * (1.0 - np.exp(-(float(time[row]) - before) / constant))
        before = float(time[row])
        found[row] = value
    return found


def _warm(context: Context, depart: float) -> Floats:
    if depart == 0.0:
        return context.warmth
    span = float(np.ptp(context.of.inputs.time)) + 1.0
    slow = lagging(context, 0.25 * span)
    return np.asarray((1.0 - depart) * context.warmth + depart * slow)


def thermal(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A link grows; with departure one part of it follows the sensor late."""

    def law(context: Context) -> Changes:
        changes = context.still()
        warm = _warm(context, depart)
        for which in (D, A):
            changes.links[:, joint, which] = context.chain.links[joint, which] * warm
        return changes

    return Hidden("thermal", (joint,), law, needs=frozenset({"temp"}), warms=True)


def thermal_zero(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    law = at_joint(joint, lambda c: _warm(c, depart))
    return Hidden("thermal_zero", (joint,), law, needs=frozenset({"temp"}), warms=True)


def axis_wobble(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A bearing's run-out: the axis leans once per turn, with departure twice as well."""
    phase = rng.uniform(-np.pi, np.pi, 3)
    round_ness = float(rng.uniform(0.3, 1.0))

    def law(context: Context) -> Changes:
        changes = context.still()
        q = context.motion[:, joint]
        changes.tilt[:, joint, 0] = np.cos(q + phase[0]) + depart * np.cos(2 * q + phase[2])
        changes.tilt[:, joint, 1] = round_ness * np.cos(q + phase[1])
        return changes

    return Hidden("axis_wobble", (joint,), law)


def link_compliance(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A uniform beam under what hangs at and beyond its end.

    The moment M runs straight from start to end. What a slice turns, as seen at the tip, is the same as if
    the beam turned about its start by (2 M_start + M_end) / 6 and about its end by (M_start + 2 M_end) / 6 of
    its compliance (conjugate beam). Its own weight is left out.
    """

    def law(context: Context) -> Changes:
        changes = context.still()
        state = context.state
        start, end = state.joint_origin[joint], state.joint_origin[joint + 1]
        along = (end - start) / np.maximum(np.linalg.norm(end - start, axis=1, keepdims=True), 1e-9)
        moments = [_moment_beyond(context, joint, place) for place in (start, end)]
        first, second = (m - along * np.einsum("na,na->n", along, m)[:, None] for m in moments)
        for at, turn in ((joint, (2.0 * first + second) / 6.0), (joint + 1, (first + 2.0 * second) / 6.0)):
            changes.bend[:, at] = np.einsum("nab,na->nb", state.joint_rotation[at], turn)
        return changes

    return Hidden("link_compliance", (joint,), law)


def _moment_beyond(context: Context, joint: int, place: Floats) -> Floats:
    """Moment of the weight of all links after `joint` and of the payload about a place [Nm], shape=(n, 3)."""
    state, chain = context.state, context.chain
    centers = state.link_origin + np.einsum("jnab,jb->jna", state.link_rotation, chain.com)
    tool = state.link_origin[-1] + state.link_rotation[-1] @ chain.targets[0][:3, 3]
    first = context.inputs.payload[:, None] * (tool - place)
    for k in range(joint + 1, chain.joints):
        first = first + chain.mass[k] * (centers[k] - place)
    return np.asarray(np.cross(first, chain.base[:3, :3] @ chain.gravity))


def linkage(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """A rod of a palletizer is too long: between square arms it turns the wrist by about 1 / cos of its lean.

    The wrist was levelled when the robot was set up, over its range: the mean is trimmed away.
    """
    lower = float(rng.random() < 0.5)

    def values(c: Context) -> Floats:
        first, second = (driver for driver, _ in c.chain.drivers[joint])
        angle = c.motion[:, first] if lower else c.motion[:, first] + c.motion[:, second]
        usual = c.of.motion[:, first] if lower else c.of.motion[:, first] + c.of.motion[:, second]
        middle = 0.5 * (usual.max() + usual.min())
        return np.asarray(1.0 / np.cos(angle - middle) - np.mean(1.0 / np.cos(usual - middle)))

    return Hidden("linkage", (joint,), at_joint(joint, values), detail={"lower": lower})


# ---- Frames and instrument -----------------------------------------------------------------------


DYING_OUT = (0.25, 0.4)  # time constants of a drift that dies out, over the time that was recorded


def drift(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    """Base or tracker moves: evenly, dying out, or wandering; with departure it jumps as well."""
    kind = str(rng.choice(["even", "dying", "wandering"]))
    return drifting(kind, rng, depart)


def drifting(kind: str, rng: Generator, depart: float = 0.0) -> Hidden:
    shift, turn = _unit(rng), 0.4 * _unit(rng)  # 0.4 rad per m: the tracker stands some metres away
    path = _path(kind, rng, depart)

    def law(context: Context) -> Changes:
        changes = context.still()
        along = path(context.hours)
        changes.base[:, :3] = along[:, :1] * shift + along[:, 1:2] * shift[[1, 2, 0]]
        changes.base[:, 3:] = along[:, 1:2] * turn
        return changes

    return Hidden("drift", (), law, needs=frozenset({"t"}), detail={"wandering": float(kind == "wandering")})


def _path(kind: str, rng: Generator, depart: float) -> Callable[[Floats], Floats]:
    """Two coordinates over the share of time that has passed, which the same path answers for any poses."""
    knots = np.linspace(0.0, 1.0, 400)
    if kind == "wandering":
        walk = np.cumsum(rng.normal(0.0, 1.0 / 20.0, (400, 2)), axis=0)
    elif kind == "dying":
        first, second = (1.0 - np.exp(-knots / time) for time in DYING_OUT)
        walk = np.stack([first, 0.5 * second], axis=1)
    else:
        walk = np.stack([knots, -0.6 * knots], axis=1)
    if depart:
        walk = walk + depart * (knots[:, None] > rng.uniform(0.3, 0.7)) * np.array([1.0, 0.4])
    return lambda share: np.stack([np.interp(share, knots, walk[:, k]) for k in range(2)], axis=1)


def _unit(rng: Generator) -> Floats:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


def scale(joint: int, rng: Generator, depart: float = 0.0) -> Hidden:
    def law(context: Context) -> Changes:
        changes = context.still()
        changes.scale[:] = 1.0
        return changes

    return Hidden("scale", (), law)


def beta_changes(context: Context, joint: int) -> Changes:
    """The twist about y, that alpha, a and d cannot say between parallel axes."""
    changes = context.still()
    changes.links[:, joint, BETA] = 1.0
    return changes


Maker = Callable[..., Hidden]
LISTED: dict[str, Maker] = {
    "joint_offset": joint_offset,
    "gear_ratio": gear_ratio,
    "harmonic": harmonic,
    "transmission_error": transmission_error,
    "backlash": backlash,
    "gravity_backlash": gravity_backlash,
    "joint_compliance": joint_compliance,
    "windup": windup,
    "joint_coupling": joint_coupling,
    "time_offset": time_offset,
    "link_geometry": link_geometry,
    "thermal": thermal,
    "thermal_zero": thermal_zero,
    "axis_wobble": axis_wobble,
    "link_compliance": link_compliance,
    "linkage": linkage,
    "drift": drift,
    "scale": scale,
}
"""Effects that have a name, and who makes them."""

WHOLE_ROBOT = frozenset({"joint_coupling", "time_offset", "drift", "scale"})
