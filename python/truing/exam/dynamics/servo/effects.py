# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What may be hidden in a servo arm, by the catalogue's names, each with the amplitudes that machines have;
and laws that stand in no catalogue.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.robots import Floats, loaded
from truing.exam.dynamics.servo.arms import Extra, Moment, Plant, felt_inertia, held_weight
from truing.exam.dynamics.servo.firmware import STEP

_STIFF = 0.3
"""[rad] of a spring's swing in one step, at most."""


@dataclass(frozen=True)
class Hidden:
    """An effect somewhere in an arm, as what it makes of a plant for an amplitude."""

    effect: str
    joints: tuple[int, ...]
    made: Callable[[Plant, float], Plant]
    least: float
    most: float  # that machines have
    inputs: tuple[str, ...] = ()  # of an unlisted one


@dataclass(frozen=True)
class Usage:
    """What a joint is asked for, where nothing is hidden: what limits are measured by."""

    torque: Floats  # shape=(n,) [Nm] largest
    drawn: float  # [Nm] largest of all motors together
    speed: Floats  # shape=(n,) [rad/s] largest of the command
    error: Floats  # shape=(n,) [rad] rms
    moved: Floats  # shape=(n,) [rad/s] rms of the motors


Maker = Callable[[Plant, Usage, int, Generator], Hidden]


# ---- The usual parameters, wrong at one joint alone ----------------------------------------------


def delay(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    return Hidden("delay", (j,), lambda p, a: p.at(j, delay=p.delay[j] + a), 2e-3, 0.15)


def command_gain(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """A weaker drive than its maker says; in a third of the draws a stronger one."""
    side = -1.0 if rng.random() < 0.67 else 1.0
    return Hidden("command_gain", (j,), lambda p, a: p.at(j, gain=p.gain[j] * np.exp(side * a)), 0.03, 1.2)


# ---- Firmware ------------------------------------------------------------------------------------


def saturation(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """The motor gives a share less than what is asked for at most."""
    return Hidden("saturation", (j,), lambda p, a: p.at(j, limit=use.torque[j] * (1.0 - a)), 0.03, 0.92)


def rate_limit(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    return Hidden("rate_limit", (j,), lambda p, a: p.at(j, rate=use.speed[j] / (1.0 + a)), 0.05, 60.0)


def dead_band(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    return Hidden("dead_band", (j,), lambda p, a: p.at(j, dead_band=a), 1e-3, 0.08)


def integral_gain(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """An integral of the error, held where it winds up."""
    return Hidden("integral_gain", (j,), lambda p, a: p.at(j, integral=a * p.gain[j]), 0.05, 8.0)


def damping_gain(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """The D gain sees the error, and not the speed alone."""
    return Hidden("damping_gain", (j,), lambda p, a: p.at(j, lead=a * p.gain[j]), 3e-3, 0.12)


def drive_law(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """Less than proportional to the error; right at its rms."""
    return Hidden("drive_law", (j,), lambda p, a: p.at(j, power=1.0 - a, bend=use.error[j]), 0.03, 0.65)


def supply_sag(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """One supply for all motors: amplitude is the share that is lost at the largest load."""
    return Hidden("supply_sag", (), lambda p, a: replace(p, sag=a / use.drawn), 0.02, 0.6)


# ---- Gears ---------------------------------------------------------------------------------------


def load_friction(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    return Hidden("load_friction", (j,), lambda p, a: p.at(j, load_friction=a), 0.02, 0.6)


def stribeck(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """Friction that falls as a joint begins to move (LuGre with a Stribeck curve)."""
    speed = float(rng.uniform(0.05, 0.3)) * use.moved[j]
    return Hidden(
        "stribeck",
        (j,),
        lambda p, a: p.at(j, breakaway=a * p.coulomb[j], stribeck_speed=speed),
        0.05,
        5.0,
    )


def thermal_friction(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """Grease that stiffens in the cold, or gears that bind as they warm."""
    side = float(rng.choice([-1.0, 1.0]))
    most = 0.03 if side < 0.0 else 0.15
    return Hidden("thermal_friction", (j,), lambda p, a: p.at(j, thermal=side * a * p.coulomb[j]), 1e-3, most)


def backlash(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    return Hidden("backlash", (j,), lambda p, a: p.at(j, gap=a), 2e-3, 0.12)


def joint_elasticity(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """Two masses: amplitude is how far the spring bends under the largest weight, or a fifth of the largest
    torque. Not stiffer than the simulation's step can follow.
    """
    most = max(held_weight(p.arm)[j], 0.2 * use.torque[j])
    lighter = min(float(felt_inertia(p.arm)[j]), float(p.armature[j]))
    stiffest = lighter * (_STIFF / STEP) ** 2
    least = max(2e-3, most / stiffest)
    return Hidden(
        "joint_elasticity", (j,), lambda p, a: p.at(j, compliance=a / most), least, max(0.3, 2.0 * least)
    )


# ---- The arm -------------------------------------------------------------------------------------


def payload(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
    """A point mass at the tool."""
    return Hidden(
        "payload",
        (),
        lambda p, a: replace(p, arm=loaded(p.arm, a * p.arm.payload, p.arm.tool)),
        0.02,
        2.0,
    )


LISTED: dict[str, Maker] = {
    maker.__name__: maker
    for maker in (
        delay,
        command_gain,
        saturation,
        rate_limit,
        dead_band,
        integral_gain,
        damping_gain,
        drive_law,
        supply_sag,
        load_friction,
        stribeck,
        thermal_friction,
        backlash,
        joint_elasticity,
        payload,
    )
}
USUAL = frozenset({"delay", "command_gain"})
"""Parameters that everybody fits: hidden at one joint, where all others are as they are handed over."""
LOADED = frozenset({"backlash", "joint_elasticity"})
"""Effects that show where links weigh something beside their rotors."""


def bears(p: Plant, j: int) -> bool:
    return float(felt_inertia(p.arm)[j]) > 0.3 * float(p.armature[j])


# ---- In no catalogue -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Detent(Extra):
    """A place where gears catch: pushed off before it, held behind it."""

    size: float
    place: float  # [rad]
    width: float

    def __call__(self, m: Moment) -> Floats:
        x = (m.q - self.place) / self.width
        return np.asarray(self.size * 1.6 * x * np.exp(0.5 - 0.5 * x * x))


@dataclass(frozen=True)
class Bumper(Extra):
    """A soft stop on one side, long before the joint's end."""

    size: float
    place: float
    width: float

    def __call__(self, m: Moment) -> Floats:
        x = np.maximum((m.q - self.place) / self.width, 0.0)
        return np.asarray(self.size * x * x)


@dataclass(frozen=True)
class Gust(Extra):
    """A torque that comes and goes by the clock."""

    size: float
    period: float  # [s]
    phase: float

    def __call__(self, m: Moment) -> Floats:
        wave = np.sin(2.0 * np.pi * m.t / self.period + self.phase)
        return np.full_like(m.q, self.size * float(np.tanh(4.0 * wave)))


@dataclass(frozen=True)
class Hum(Extra):
    """Losses within a band of speeds, as of a part that resonates."""

    size: float
    speed: float  # [rad/s]
    width: float

    def __call__(self, m: Moment) -> Floats:
        x = (np.abs(m.qd) - self.speed) / self.width
        return np.asarray(self.size * np.sign(m.qd) * np.exp(-x * x))


@dataclass(frozen=True)
class OneWay(Extra):
    """A ratchet's drag: losses that grow with speed one way only."""

    size: float
    speed: float

    def __call__(self, m: Moment) -> Floats:
        return np.asarray(self.size * np.tanh(np.maximum(m.qd, 0.0) / self.speed) ** 2)


@dataclass(frozen=True)
class Kick(Extra):
    """Firmware that adds a kick in a middle range of errors, on one side."""

    size: float
    error: float  # [rad]

    def __call__(self, m: Moment) -> Floats:
        x = (m.error - self.error) / (0.4 * self.error)
        return np.asarray(-self.size * np.exp(-x * x))


def _extra(name: str, inputs: str, of: Callable[[Plant, Usage, int, Generator, float], Extra]) -> Maker:
    """A maker whose amplitude is a share of the joint's largest torque."""

    def maker(p: Plant, use: Usage, j: int, rng: Generator) -> Hidden:
        dice = int(rng.integers(2**31))

        def made(p: Plant, a: float) -> Plant:
            law = of(p, use, j, np.random.default_rng(dice), 0.3 * a * use.torque[j])
            return replace(p, extra=((j, law),))

        return Hidden(name, (j,), made, 0.01, 2.0, (inputs,))

    return maker


def _place(p: Plant, j: int, rng: Generator) -> float:
    return float(rng.uniform(-0.3, 0.3) * p.arm.reach[j])


UNLISTED: dict[str, dict[str, Maker]] = {
    "development": {
        "detent": _extra("detent", "angle", lambda p, u, j, r, s: Detent(s, _place(p, j, r), 0.12)),
        "gust": _extra(
            "gust", "time", lambda p, u, j, r, s: Gust(s, r.uniform(1.5, 3.5), r.uniform(0, 6.28))
        ),
        "hum": _extra(
            "hum", "speed", lambda p, u, j, r, s: Hum(s, r.uniform(0.9, 1.6) * u.moved[j], 0.35 * u.moved[j])
        ),
    },
    "examination": {
        "bumper": _extra("bumper", "angle", lambda p, u, j, r, s: Bumper(s, _place(p, j, r), 0.3)),
        "one_way": _extra(
            "one_way", "speed", lambda p, u, j, r, s: OneWay(s, r.uniform(0.8, 2.0) * u.moved[j])
        ),
        "kick": _extra(
            "kick", "command_error", lambda p, u, j, r, s: Kick(s, r.uniform(0.8, 1.5) * u.error[j])
        ),
    },
}
