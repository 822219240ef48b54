# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Laws of textbooks with other constants and in mixtures; laws that are far from textbooks; effects in no
catalogue.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.bodies import tool_points
from truing.exam.dynamics.laws import LISTED, Hidden, Maker, Scene, stop
from truing.exam.dynamics.robots import Arm, Floats

# ---- Textbook laws, other constants, a little of something else ----------------------------------


def _viscous_law(arm: Arm, j: int, rng: Generator) -> Hidden:
    power = rng.uniform(1.6, 2.6)

    def drag(s: Scene) -> Floats:
        v = s.motion.qd[:, j]
        return s.at(j, np.sign(v) * np.abs(v) ** power)

    return Hidden("viscous_law", (j,), drag, 3.0 * arm.viscous[j] / arm.speed[j])


def _stribeck(arm: Arm, j: int, rng: Generator) -> Hidden:
    vs, power = arm.speed[j] * rng.uniform(0.03, 0.12), rng.uniform(1.0, 2.0)
    return Hidden(
        "stribeck",
        (j,),
        lambda s: s.at(j, s.sign(j) * np.exp(-((np.abs(s.motion.qd[:, j]) / vs) ** power))),
        arm.coulomb[j],
    )


def _presliding(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Two stop operators of different widths (Maxwell slip)."""
    width, share = rng.uniform(3e-3, 2e-2), rng.uniform(0.0, 0.4)

    def bent(s: Scene) -> Floats:
        q = s.motion.q[:, j]
        z = (1.0 - share) * stop(q, width) + share * stop(q, 3.0 * width)
        return s.at(j, z - s.sign(j))

    return Hidden("presliding", (j,), bent, 1.2 * arm.coulomb[j])


def _load_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Driving and driven differ (Hamon et al. 2010)."""
    driven = rng.uniform(0.7, 1.3)

    def drag(s: Scene) -> Floats:
        load, sign = s.total[:, j], s.sign(j)
        factor = np.where(load * s.motion.qd[:, j] > 0.0, 1.0, driven)
        return s.at(j, factor * sign * np.abs(load))

    return Hidden("load_friction", (j,), drag, 0.3)


def _ripple(arm: Arm, j: int, rng: Generator) -> Hidden:
    order, phase = int(rng.integers(2, 11)), rng.uniform(-np.pi, np.pi)
    second = rng.uniform(0.0, 0.25)

    def wave(s: Scene) -> Floats:
        q = s.motion.q[:, j]
        return s.at(j, np.sin(order * q + phase) + second * np.cos((order + 1) * q))

    return Hidden("ripple", (j,), wave, 1.5 * arm.coulomb[j])


def _spring(arm: Arm, j: int, rng: Generator) -> Hidden:
    rest = rng.uniform(-0.5, 0.5)
    return Hidden("spring", (j,), lambda s: s.at(j, s.motion.q[:, j] - rest))


def _thermal_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    share = rng.uniform(0.3, 1.0)

    def drag(s: Scene) -> Floats:
        own = share * arm.coulomb[j] * s.sign(j) + arm.viscous[j] * s.motion.qd[:, j]
        return s.at(j, -(s.temperature[:, j] - 20.0) / 25.0 * own)

    return Hidden("thermal_friction", (j,), drag, 1.0)


def _coupling(arm: Arm, j: int, rng: Generator) -> Hidden:
    k = j - 1 if j == arm.n - 1 or (j > 0 and rng.random() < 0.5) else j + 1
    return Hidden(
        "coupling",
        (j, k),
        lambda s: s.at(j, arm.coulomb[k] * s.sign(k) + arm.viscous[k] * s.motion.qd[:, k]),
        1.5,
    )


def _tool_force(arm: Arm, j: int, rng: Generator) -> Hidden:
    pull = rng.normal(size=3)

    def felt(s: Scene) -> Floats:
        return np.asarray(-tool_points(arm, s.motion.q)[1] @ pull)

    return Hidden("tool_force", (), felt)


DEPARTURES: dict[str, Maker] = {
    **{name: LISTED[name] for name in ("asymmetric_friction", "position_friction", "warmup", "armature")},
    **{name: LISTED[name] for name in ("motor_constant", "torque_lag", "time_offset", "link_inertia")},
    "viscous_law": _viscous_law,
    "stribeck": _stribeck,
    "presliding": _presliding,
    "load_friction": _load_friction,
    "ripple": _ripple,
    "spring": _spring,
    "thermal_friction": _thermal_friction,
    "coupling": _coupling,
    "tool_force": _tool_force,
}

# ---- Right effects, wrong laws -------------------------------------------------------------------


def _far_viscous(arm: Arm, j: int, rng: Generator) -> Hidden:
    """No drag up to a speed, and then steeply."""
    v0 = arm.speed[j] * rng.uniform(0.2, 0.4)

    def drag(s: Scene) -> Floats:
        v = s.motion.qd[:, j]
        return s.at(j, np.sign(v) * np.maximum(np.abs(v) - v0, 0.0))

    return Hidden("viscous_law", (j,), drag, 4.0 * arm.viscous[j])


def _far_stribeck(arm: Arm, j: int, rng: Generator) -> Hidden:
    """With frictional memory: what counts is the speed some time ago."""
    vs, lag = arm.speed[j] * rng.uniform(0.05, 0.1), rng.uniform(0.02, 0.06)

    def curve(s: Scene) -> Floats:
        ago = np.roll(np.abs(s.motion.qd[:, j]), round(lag / s.step))
        return s.at(j, s.sign(j) / (1.0 + np.abs(ago / vs)))

    return Hidden("stribeck", (j,), curve, arm.coulomb[j])


def _far_load(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Growing with the square of the load."""

    def drag(s: Scene) -> Floats:
        load = s.motion.torque[:, j]
        return s.at(j, s.sign(j) * load**2 / float(np.abs(load).max()))

    return Hidden("load_friction", (j,), drag, 0.4)


def _far_spring(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A spring that hardens."""
    return Hidden("spring", (j,), lambda s: s.at(j, s.motion.q[:, j] * (1 + 1.5 * s.motion.q[:, j] ** 2)))


def _far_position(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A tight quarter of the turn."""
    middle = rng.uniform(-0.5, 0.5) * arm.reach[j]
    return Hidden(
        "position_friction",
        (j,),
        lambda s: s.at(j, s.sign(j) * (np.abs(s.motion.q[:, j] - middle) < 0.4 * arm.reach[j])),
        arm.coulomb[j],
    )


def _far_thermal(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Grease that melts at a temperature."""

    def drag(s: Scene) -> Floats:
        melted = 1.0 / (1.0 + np.exp(-(s.temperature[:, j] - 36.0) / 2.0))
        return s.at(j, -melted * (arm.coulomb[j] * s.sign(j) + arm.viscous[j] * s.motion.qd[:, j]))

    return Hidden("thermal_friction", (j,), drag, 0.8)


def _far_constant(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Iron that saturates: the more torque, the less of it is read."""

    def read(s: Scene) -> Floats:
        tau = s.total[:, j]
        return s.at(j, -tau * np.abs(tau) / float(np.abs(tau).max()))

    return Hidden("motor_constant", (j,), read, 0.4, meter=True)


def _far_presliding(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Bristles that hardly give at first."""
    width = rng.uniform(1e-2, 4e-2)

    def bent(s: Scene) -> Floats:
        z = stop(s.motion.q[:, j], width)
        return s.at(j, z**3 - s.sign(j))

    return Hidden("presliding", (j,), bent, 1.2 * arm.coulomb[j])


FAR: dict[str, Maker] = {
    "viscous_law": _far_viscous,
    "stribeck": _far_stribeck,
    "load_friction": _far_load,
    "spring": _far_spring,
    "position_friction": _far_position,
    "thermal_friction": _far_thermal,
    "motor_constant": _far_constant,
    "presliding": _far_presliding,
}

# ---- Effects in no catalogue ---------------------------------------------------------------------


def _other(arm: Arm, j: int) -> int:
    return j - 1 if j else 1


def squeezed(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Friction with the square of another joint's angle: a cable that is pinched."""
    k = _other(arm, j)
    return Hidden(
        "squeezed",
        (j,),
        lambda s: s.at(j, s.sign(j) * s.motion.q[:, k] ** 2),
        inputs=(f"angle J{k + 1}",),
    )


def remembered(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A frame that gives way under load and stays: a play in the torque."""

    def felt(s: Scene) -> Floats:
        load = s.motion.torque[:, j]
        return s.at(j, stop(load, 0.6 * float(np.std(load))))

    return Hidden("remembered", (j,), felt, inputs=("torque",))


def notched(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A detent at one angle: it pulls in from both sides."""
    at, width = rng.uniform(-0.3, 0.3) * arm.reach[j], rng.uniform(0.08, 0.15)

    def pull(s: Scene) -> Floats:
        x = (s.motion.q[:, j] - at) / width
        return s.at(j, x * np.exp(-0.5 * x**2))

    return Hidden("notched", (j,), pull, inputs=("angle",))


def slipped(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A torque that is there for some seconds of every recording."""
    start, lasts = rng.uniform(1.5, 3.0), rng.uniform(1.5, 3.0)

    def there(s: Scene) -> Floats:
        return s.at(j, ((s.motion.t > start) & (s.motion.t < start + lasts)).astype(float))

    return Hidden("slipped", (j,), there, inputs=("time",))


def rubbing(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Friction that comes and goes three times over another joint's turn: a hose that rubs."""
    k = _other(arm, j)
    return Hidden(
        "rubbing",
        (j,),
        lambda s: s.at(j, s.sign(j) * np.maximum(np.cos(3.0 * s.motion.q[:, k]), 0.0)),
        inputs=(f"angle J{k + 1}",),
    )


def yielding(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A clutch that slips beyond a load."""

    def felt(s: Scene) -> Floats:
        load = s.motion.torque[:, j]
        edge = 1.2 * float(np.std(load))
        return s.at(j, np.sign(load - load.mean()) * np.maximum(np.abs(load - load.mean()) - edge, 0.0))

    return Hidden("yielding", (j,), felt, inputs=("torque",))


def humming(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A resonance at one speed costs torque there."""
    at = arm.speed[j] * rng.uniform(0.2, 0.35)
    width = 0.3 * at

    def felt(s: Scene) -> Floats:
        x = (np.abs(s.motion.qd[:, j]) - at) / width
        return s.at(j, s.sign(j) * np.exp(-0.5 * x**2))

    return Hidden("humming", (j,), felt, inputs=("speed",))


def breathing(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A torque that swings over time, in whatever posture."""
    period, phase = rng.uniform(3.0, 6.0), rng.uniform(0.0, 6.28)
    return Hidden(
        "breathing",
        (j,),
        lambda s: s.at(j, np.sin(2.0 * np.pi * s.motion.t / period + phase)),
        inputs=("time",),
    )


UNLISTED: dict[str, dict[str, Maker]] = {
    "development": {maker.__name__: maker for maker in (squeezed, remembered, notched, slipped)},
    "examination": {maker.__name__: maker for maker in (rubbing, yielding, humming, breathing)},
}
