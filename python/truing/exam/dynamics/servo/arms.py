# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Arms of one to six joints driven by position servos, from the size of a hobby arm to that of a legged
robot's leg; no maker's product. Development and examination have none in common.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.bodies import torques
from truing.exam.dynamics.robots import Arm, Floats, arm_of

REFERENCE_C = 25.0
"""[deg C] at which friction is what an arm's data say."""


@dataclass(frozen=True)
class Servo:
    """An arm and its drives, by joint."""

    arm: Arm  # its friction is that of the drives
    armature: Floats  # shape=(n,) [kg m^2] of rotors, seen at the joints
    hertz: float  # bandwidth that its gains are set for

    @property
    def n(self) -> int:
        return self.arm.n


@dataclass(frozen=True)
class Plant:
    """What a servo arm does with a command. Arrays have shape=(n,)."""

    arm: Arm
    # What everybody fits: the usual parameters.
    gain: Floats  # [Nm/rad] of the command error
    viscous: Floats  # [Nm s/rad] of the motor's speed: D gain, back-EMF and oil together
    coulomb: Floats  # [Nm]
    armature: Floats  # [kg m^2]
    delay: Floats  # [s] of the command
    # Firmware.
    dead_band: Floats  # [rad] to both sides
    power: Floats  # of the drive law: gain * error at `bend`, less than proportional where it is below 1
    bend: Floats  # [rad] error at which the drive law is right
    integral: Floats  # [Nm/(rad s)]
    lead: Floats  # [Nm s/rad] of the commanded speed
    rate: Floats  # [rad/s] of the command at most
    limit: Floats  # [Nm] of the motor at most
    sag: float  # share of the supply lost per Nm of all motors together
    # Gears.
    load_friction: Floats  # [Nm/Nm] of what the motor gives
    breakaway: Floats  # [Nm] above Coulomb's at rest
    stribeck_speed: Floats  # [rad/s]
    thermal: Floats  # [Nm/K] of friction above REFERENCE_C
    gap: Floats  # [rad] from stop to stop; 0: none
    compliance: Floats  # [rad/Nm] between motor and link; 0: rigid
    # Beside the catalogue's.
    weight: Floats  # of gravity on each joint; 1: as it is
    extra: tuple[tuple[int, Extra], ...] = field(default=())

    def at(self, joint: int, **values: float) -> Plant:
        """With other values at a joint."""
        changed = {}
        for name, value in values.items():
            array = getattr(self, name).copy()
            array[joint] = value
            changed[name] = array
        return replace(self, **changed)


@dataclass(frozen=True)
class Moment:
    """What a law that stands in no catalogue sees of its joint, in every recording at once."""

    t: float  # [s]
    q: Floats  # [rad]
    qd: Floats  # [rad/s]
    error: Floats  # [rad] of the command
    torque: Floats  # [Nm] of the motor


class Extra:
    """A law of the examiner's own: torque [Nm] that it takes from the motor."""

    def __call__(self, m: Moment) -> Floats:
        raise NotImplementedError


NEVER = 1e9
"""A limit that is never reached."""


def plant(servo: Servo, rng: Generator, delay: float) -> Plant:
    """A servo arm with nothing wrong: gains for its bandwidth, enough to hold its weight to 0.07 rad."""
    n, arm = servo.n, servo.arm
    felt, weight = felt_inertia(arm) + servo.armature, held_weight(arm)
    hertz = servo.hertz * rng.uniform(0.8, 1.25, n)
    gain = np.maximum(felt * (2.0 * np.pi * hertz) ** 2, np.maximum(weight / 0.07, arm.coulomb / 0.02))
    zero, one = np.zeros(n), np.ones(n)
    return Plant(
        arm,
        gain=gain,
        viscous=2.0 * rng.uniform(0.6, 1.0, n) * np.sqrt(felt * gain),
        coulomb=arm.coulomb * rng.uniform(0.7, 1.4, n),
        armature=servo.armature * rng.uniform(0.8, 1.25, n),
        delay=np.full(n, delay),
        dead_band=zero,
        power=one,
        bend=0.1 * one,
        integral=zero,
        lead=zero,
        rate=NEVER * one,
        limit=NEVER * one,
        sag=0.0,
        load_friction=zero,
        breakaway=zero,
        stribeck_speed=0.1 * one,
        thermal=zero,
        gap=zero,
        compliance=zero,
        weight=one,
    )


def felt_inertia(arm: Arm) -> Floats:
    """[kg m^2] of the links that each joint feels in the middle of its travel."""
    q = np.full((arm.n, arm.n), 0.3)
    still = np.zeros_like(q)
    return np.diag(torques(arm, q, still, np.eye(arm.n)) - torques(arm, q, still, still)).copy()


def held_weight(arm: Arm) -> Floats:
    """[Nm] that each joint holds at most in some postures."""
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (64, arm.n)) * arm.reach
    still = np.zeros_like(q)
    return np.asarray(np.abs(torques(arm, q, still, still)).max(axis=0))


_DEVELOPMENT = (
    Servo(
        arm_of(
            "lever",
            "y",
            [(0, 0, 0.3)],
            [(0.46, (0.004, 0.002, -0.12), 0.05, 0.02)],
            [1.8],
            [4.5],
            [0.03],
            [0.02],
            (0.0, 0.0, -0.14),
            0.25,
        ),
        np.array([0.002]),
        3.0,
    ),
    Servo(
        arm_of(
            "pair",
            "yy",
            [(0, 0, 0.4), (0, 0.01, -0.16)],
            [(0.34, (0.004, 0.006, -0.09), 0.16, 0.02), (0.22, (0.003, 0.002, -0.08), 0.14, 0.016)],
            [1.6, 1.9],
            [3.5, 4.0],
            [0.06, 0.04],
            [0.05, 0.03],
            (0.0, 0.0, -0.15),
            0.15,
        ),
        np.array([0.006, 0.004]),
        4.0,
    ),
    Servo(
        arm_of(
            "leg",
            "xyy",
            [(0, 0.08, 0.6), (0, 0.09, 0), (0, 0.01, -0.22)],
            [
                (0.7, (-0.01, 0.02, 0.0), 0.08, 0.045),
                (1.1, (-0.004, -0.02, -0.04), 0.22, 0.04),
                (0.24, (0.003, 0.0, -0.12), 0.22, 0.015),
            ],
            [0.8, 1.2, 1.1],
            [5.0, 6.0, 6.0],
            [0.25, 0.25, 0.3],
            [0.1, 0.1, 0.1],
            (0.0, 0.0, -0.22),
            0.6,
        ),
        np.array([0.012, 0.012, 0.016]),
        6.0,
    ),
    Servo(
        arm_of(
            "desk",
            "zyyyx",
            [(0, 0, 0.08), (0.02, 0, 0.05), (0.02, 0, 0.115), (0.13, 0, 0), (0.06, 0, 0)],
            [
                (0.12, (0.01, 0.002, 0.03), 0.06, 0.025),
                (0.14, (0.01, -0.003, 0.07), 0.11, 0.02),
                (0.13, (0.07, 0.002, 0.005), 0.12, 0.018),
                (0.09, (0.03, 0.003, 0.0), 0.06, 0.018),
                (0.10, (0.04, 0.004, 0.006), 0.08, 0.02),
            ],
            [1.6, 1.3, 1.3, 1.4, 2.0],
            [3.0, 3.0, 3.0, 3.5, 4.0],
            [0.06, 0.07, 0.06, 0.05, 0.045],
            [0.1, 0.1, 0.1, 0.08, 0.06],
            (0.09, 0.0, 0.0),
            0.2,
        ),
        np.array([0.02, 0.022, 0.018, 0.012, 0.01]),
        3.0,
    ),
    Servo(
        arm_of(
            "bench",
            "zyyxyx",
            [(0, 0, 0.1), (0, 0, 0.05), (0.05, 0, 0.27), (0.12, 0, 0), (0.12, 0, 0), (0.07, 0, 0)],
            [
                (0.9, (0.0, 0.01, 0.02), 0.09, 0.045),
                (0.95, (0.012, 0.0, 0.16), 0.28, 0.035),
                (0.45, (0.08, 0.006, 0.0), 0.12, 0.03),
                (0.32, (0.08, 0.004, 0.0), 0.12, 0.028),
                (0.24, (0.03, 0.0, 0.004), 0.07, 0.026),
                (0.18, (0.04, 0.006, 0.004), 0.07, 0.024),
            ],
            [2.2, 1.1, 1.1, 2.2, 1.5, 2.4],
            [2.4, 2.2, 2.6, 3.2, 3.2, 3.6],
            [0.30, 0.40, 0.25, 0.12, 0.10, 0.08],
            [0.4, 0.5, 0.3, 0.12, 0.1, 0.06],
            (0.1, 0.0, 0.0),
            0.4,
        ),
        np.array([0.08, 0.10, 0.06, 0.025, 0.02, 0.015]),
        3.5,
    ),
)

_EXAMINATION = (
    Servo(
        arm_of(
            "arm_of_one",
            "x",
            [(0, 0, 0.5)],
            [(0.62, (0.003, 0.005, -0.15), 0.07, 0.025)],
            [1.5],
            [3.8],
            [0.06],
            [0.03],
            (0.0, 0.0, -0.18),
            0.3,
        ),
        np.array([0.005]),
        2.6,
    ),
    Servo(
        arm_of(
            "two",
            "zy",
            [(0, 0, 0.15), (0.02, 0, 0.04)],
            [(0.28, (0.01, 0.004, 0.02), 0.06, 0.03), (0.26, (0.1, 0.003, 0.004), 0.18, 0.02)],
            [2.0, 1.2],
            [3.2, 3.6],
            [0.07, 0.06],
            [0.06, 0.05],
            (0.18, 0.0, 0.0),
            0.15,
        ),
        np.array([0.008, 0.008]),
        3.4,
    ),
    Servo(
        arm_of(
            "hind",
            "xyy",
            [(0, -0.1, 0.7), (0, -0.11, 0), (0, -0.01, -0.28)],
            [
                (1.2, (0.012, -0.03, 0.004), 0.1, 0.06),
                (1.9, (0.006, 0.02, -0.06), 0.28, 0.05),
                (0.5, (0.004, 0.002, -0.14), 0.28, 0.02),
            ],
            [0.7, 1.1, 1.0],
            [4.0, 5.0, 5.0],
            [0.6, 0.6, 0.7],
            [0.2, 0.2, 0.2],
            (0.0, 0.0, -0.28),
            1.2,
        ),
        np.array([0.03, 0.03, 0.045]),
        5.0,
    ),
    Servo(
        arm_of(
            "shelf",
            "zyyy",
            [(0, 0, 0.09), (0, 0, 0.05), (0, 0, 0.13), (0.12, 0, 0)],
            [
                (0.16, (0.004, 0.002, 0.03), 0.06, 0.03),
                (0.17, (0.006, 0.002, 0.08), 0.13, 0.02),
                (0.12, (0.06, 0.003, 0.004), 0.12, 0.018),
                (0.14, (0.06, 0.003, 0.0), 0.1, 0.02),
            ],
            [1.8, 1.2, 1.3, 1.5],
            [2.8, 2.6, 2.8, 3.2],
            [0.07, 0.09, 0.07, 0.05],
            [0.1, 0.12, 0.1, 0.08],
            (0.12, 0.0, 0.0),
            0.18,
        ),
        np.array([0.025, 0.03, 0.02, 0.012]),
        2.8,
    ),
    Servo(
        arm_of(
            "rack",
            "zyyyzy",
            [(0, 0, 0.12), (0, 0.06, 0.02), (0, -0.02, 0.3), (0, 0, 0.26), (0, 0.05, 0), (0, 0, 0.06)],
            [
                (1.3, (0.0, 0.02, 0.01), 0.1, 0.05),
                (1.2, (0.012, 0.0, 0.17), 0.3, 0.035),
                (0.7, (0.008, 0.0, 0.13), 0.26, 0.03),
                (0.35, (0.0, 0.02, 0.006), 0.08, 0.03),
                (0.3, (0.006, 0.0, 0.03), 0.07, 0.028),
                (0.22, (0.02, 0.03, 0.01), 0.07, 0.025),
            ],
            [2.2, 1.0, 1.1, 1.6, 1.6, 2.4],
            [2.0, 1.8, 2.2, 2.8, 2.8, 3.2],
            [0.45, 0.55, 0.35, 0.15, 0.12, 0.1],
            [0.5, 0.6, 0.4, 0.15, 0.12, 0.08],
            (0.0, 0.09, 0.0),
            0.5,
        ),
        np.array([0.12, 0.14, 0.09, 0.03, 0.025, 0.02]),
        3.0,
    ),
)


def servos(which: str) -> tuple[Servo, ...]:
    return _DEVELOPMENT if which == "development" else _EXAMINATION
