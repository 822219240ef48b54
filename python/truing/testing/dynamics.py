# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion of a simulated arm with hidden effects on its torques."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing._core import AppliedEffect, Joint, Recording, Robot

Floats = NDArray[np.float64]

STEP = 0.01  # [s] between rows
HARMONICS = 5  # of a Fourier trajectory
REACH = 1.1  # [rad] largest angle from the middle
CUT_OFF = 30.0  # [Hz] of the derivatives of the motion, which has nothing above 1 Hz
NOISE = 0.02  # standard deviation of the noise, of each torque's own
MEMORY = 0.9  # of the noise: correlation from row to row, as cables, ripple and filters make it

# Coulomb [Nm], viscous [Nm s/rad] of every joint, shoulder to wrist.
USUAL = ((6.0, 9.0), (7.0, 12.0), (4.0, 7.0), (1.5, 2.0), (1.2, 1.6), (0.9, 1.1))
# What nobody put into the model.
HIDDEN: Mapping[str, tuple[Sequence[str], Mapping[str, float]]] = {
    "load_friction": (["J2"], {"load_friction.J2": 0.09}),
    "coupling": (
        ["J5", "J6"],
        {"coupling.J5.J6.coulomb": 0.5, "coupling.J5.J6.viscous": 1.1, "coupling.J5.J6.inertia": 0.15},
    ),
    "armature": (["J3"], {"armature.J3": 1.6}),
}


@dataclass(frozen=True)
class SimulatedMotion:
    """Recordings of an arm, and what was hidden in it."""

    nominal: Robot  # as the model's author knows it
    truth: Robot  # with the effects on its torques
    recordings: list[Recording]


def demo_arm() -> Robot:
    """A six-joint arm of 30 kg with masses and inertias, and no friction."""
    quarter = math.pi / 2
    #         d      a      alpha     mass  centre of mass           principal moments
    links = [
        (0.18, 0.0, quarter, 7.5, (0.0, -0.03, 0.02), (0.035, 0.033, 0.028)),
        (0.0, -0.61, 0.0, 12.5, (0.36, 0.01, 0.15), (0.07, 0.42, 0.41)),
        (0.0, -0.57, 0.0, 4.0, (0.31, 0.0, 0.05), (0.011, 0.13, 0.13)),
        (0.17, 0.0, quarter, 2.1, (0.0, -0.01, 0.02), (0.005, 0.0045, 0.004)),
        (0.12, 0.0, -quarter, 2.0, (0.0, 0.01, 0.02), (0.005, 0.0045, 0.004)),
        (0.11, 0.0, 0.0, 1.3, (0.02, 0.0, -0.03), (0.0022, 0.0021, 0.0013)),
    ]
    joints = [
        Joint(
            f"J{k}",
            d=d,
            a=a,
            alpha=alpha,
            mass=mass,
            center_of_mass=centre,
            inertia=np.diag(moments),
            lower=-math.pi,
            upper=math.pi,
        )
        for k, (d, a, alpha, mass, centre, moments) in enumerate(links, 1)
    ]
    return Robot("demo arm", joints=joints)


def simulate_motion(
    *,
    recordings: int = 5,
    held_out: int = 2,
    seconds: float = 24.0,
    seed: int = 0,
    hidden: Mapping[str, tuple[Sequence[str], Mapping[str, float]]] = HIDDEN,
) -> SimulatedMotion:
    """Recordings of `demo_arm` along Fourier trajectories, with friction of every joint, hidden effects (see
    HIDDEN), and noise whose rows are correlated, of 2 % of each torque.

    held_out: so many, the last, are marked as test. hidden: effects, their joints and parameters. The same
    seed gives the same recordings.
    """
    nominal = demo_arm()
    truth = nominal.copy()
    names = [joint.name for joint in truth.joints]
    usual = [
        AppliedEffect(effect, [name], {f"{effect}.{name}": values[k]})
        for name, values in zip(names, USUAL, strict=True)
        for k, effect in enumerate(("coulomb", "viscous"))
    ]
    more = [AppliedEffect(name, joints, values) for name, (joints, values) in hidden.items()]
    truth.torque_effects = [*usual, *more]
    out = []
    for number in range(recordings):
        random = np.random.default_rng([seed, number])
        test = number >= recordings - held_out
        out.append(moved(truth, f"motion{number + 1}", seconds=seconds, test=test, random=random))
    return SimulatedMotion(nominal, truth, out)


def moved(truth: Robot, name: str, *, seconds: float, test: bool, random: np.random.Generator) -> Recording:
    """A recording of a robot along a random Fourier trajectory, with correlated noise of its torques."""
    time = np.arange(0.0, seconds, STEP)
    bare = Recording("motion", time=time, position=fourier_motion(time, len(truth.driven_joints()), random))
    torque = np.asarray(_core.dynamics_predict(truth, bare, CUT_OFF).torque)
    noise = coloured_noise(torque.shape, random) * NOISE * torque.std(axis=0)
    return Recording(name, time=time, position=bare.position, torque=torque + noise, test=test)


def fourier_motion(time: Floats, joints: int, random: np.random.Generator) -> Floats:
    """Sums of sines with random amplitudes and phases, as used to excite arms (Swevers et al. 1997, eq. 12),
    scaled to REACH. shape=(n, joints) [rad]
    """
    base = 2.0 * math.pi / random.uniform(9.0, 12.0)
    out = np.zeros((len(time), joints))
    for k in range(1, HARMONICS + 1):
        phase = random.uniform(0.0, 2.0 * math.pi, joints)
        out += random.normal(0.0, 1.0, joints) / k * np.sin(base * k * time[:, None] + phase)
    return np.asarray(REACH * out / np.abs(out).max(axis=0))


def coloured_noise(shape: tuple[int, ...], random: np.random.Generator) -> Floats:
    """First-order autoregressive noise of unit variance. shape=(n, joints)"""
    white = random.normal(0.0, math.sqrt(1.0 - MEMORY**2), shape)
    out = np.empty(shape)
    out[0] = random.normal(0.0, 1.0, shape[1:])
    for row in range(1, shape[0]):
        out[row] = MEMORY * out[row - 1] + white[row]
    return out
