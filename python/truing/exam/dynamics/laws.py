# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What arms do to their motors' torques, by laws of the examiner's own: bristles that bend (Dahl 1968;
Canudas de Wit et al. 1995), Stribeck curves that are fractions, lubricant that shears as Eyring's, balancers
with a
cylinder.

A law gives the torque of an amplitude of one, over one recording; the examiner finds the amplitude.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.bodies import GRAVITY, tool_points, weight_along
from truing.exam.dynamics.motions import STEP
from truing.exam.dynamics.physics import Motion
from truing.exam.dynamics.robots import Arm, Floats, loaded

SHARP = 2e-7
"""[rad] over which Coulomb's friction turns: friction at rest remembers where it came from."""


@dataclass(frozen=True)
class Scene:
    """One recording as the laws see it."""

    arm: Arm
    motion: Motion
    total: Floats  # shape=(rows, n) [Nm] of links and of usual friction
    temperature: Floats  # shape=(rows, n) [deg C]
    step: float = STEP  # [s] between rows
    loaded: bool = True  # whether an arm that is changed by an effect is so in this recording

    def sign(self, j: int) -> Floats:
        """Direction of the friction of a joint."""
        return sharp(self.motion.q[:, j])

    def at(self, j: int, column: Floats) -> Floats:
        found = np.zeros_like(self.motion.q)
        found[:, j] = column
        return found


Law = Callable[[Scene], Floats]


@dataclass(frozen=True)
class Hidden:
    """An effect, by the catalogue's name, and its torque for an amplitude of one."""

    effect: str
    joints: tuple[int, ...]
    law: Law | None = None
    largest: float = np.inf  # amplitude that machines have at most
    meter: bool = False  # of the measurement: acts on the whole torque, and not on the motion
    arm: Callable[[float], Arm] | None = None  # the true arm for an amplitude, instead of a law
    gearing: str = ""  # "stiffness" or "gap": made in MuJoCo
    needs: frozenset[str] = frozenset()  # columns without which it cannot be found
    inputs: tuple[str, ...] = ()  # of an unlisted one


def stop(q: Floats, width: float) -> Floats:
    """The stop operator: z follows q / width and stays within -1 and 1 (elasto-plastic, no drift)."""
    steps = (np.diff(q, prepend=q[0]) / width).tolist()
    z, found = 0.0, []
    for move in steps:
        z += move
        z = 1.0 if z > 1.0 else -1.0 if z < -1.0 else z
        found.append(z)
    return np.array(found)


def sharp(q: Floats) -> Floats:
    """Direction that friction knows at each row: what it was before and what it is after, in the mean, or it
    would come half a row late.
    """
    z = stop(q, SHARP)
    return np.asarray(0.5 * (z + np.append(z[1:], z[-1])))


def bristles(q: Floats, width: float) -> Floats:
    """Dahl's bristles, dz/dq = (1 - z sign(dq)) / width, integrated exactly over each step."""
    moves = np.diff(q, prepend=q[0])
    decay, target = np.exp(-np.abs(moves) / width).tolist(), np.sign(moves).tolist()
    z, found = 0.0, []
    for a, s in zip(decay, target, strict=True):
        z = s + (z - s) * a if s else z
        found.append(z)
    return np.array(found)


def usual_friction(arm: Arm, motion: Motion) -> Floats:
    """Coulomb and viscous."""
    sign = np.stack([sharp(motion.q[:, j]) for j in range(arm.n)], axis=1)
    return np.asarray(arm.coulomb * sign + arm.viscous * motion.qd)


# ---- Friction ------------------------------------------------------------------------------------


def viscous_law(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Quadratic drag with some of the third power, or oil that shears (Eyring)."""
    if rng.random() < 0.5:
        cubic = rng.uniform(0.05, 0.25)

        def drag(s: Scene) -> Floats:
            v = s.motion.qd[:, j]
            return s.at(j, v * np.abs(v) * (1.0 + cubic * np.abs(v) / arm.speed[j]))

        return Hidden("viscous_law", (j,), drag, 3.0 * arm.viscous[j] / arm.speed[j])
    v0 = arm.speed[j] * rng.uniform(0.12, 0.3)
    return Hidden(
        "viscous_law",
        (j,),
        lambda s: s.at(j, np.tanh(s.motion.qd[:, j] / v0)),
        1.5 * arm.coulomb[j],
    )


def stribeck(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A rational Stribeck curve, s / (1 + (v / vs)^2)."""
    vs = arm.speed[j] * rng.uniform(0.03, 0.1)
    return Hidden(
        "stribeck",
        (j,),
        lambda s: s.at(j, s.sign(j) / (1.0 + (s.motion.qd[:, j] / vs) ** 2)),
        1.0 * arm.coulomb[j],
    )


def presliding(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Bristles that bend over a width, in place of a sharp turn; with some of their own damping (LuGre)."""
    width = float(np.exp(rng.uniform(np.log(2e-3), np.log(2e-2))))

    def bent(s: Scene) -> Floats:
        z = bristles(s.motion.q[:, j], width)
        damped = 0.01 * np.gradient(z, s.step)
        return s.at(j, z - s.sign(j) + np.clip(damped, -0.1, 0.1))

    return Hidden("presliding", (j,), bent, 1.2 * arm.coulomb[j])


def asymmetric_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    """More drag one way than the other."""
    side = float(rng.choice([-1.0, 1.0]))

    def drag(s: Scene) -> Floats:
        v = side * s.motion.qd[:, j]
        return s.at(j, side * np.maximum(v, 0.0) ** 1.1)

    return Hidden("asymmetric_friction", (j,), drag, 2.0 * arm.viscous[j])


def load_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Friction that grows with the load on the motor's side of the gear, rounded where the load turns."""
    part = rng.uniform(0.05, 0.2)

    def drag(s: Scene) -> Floats:
        load = s.total[:, j]
        round_off = part * float(np.std(load))
        return s.at(j, s.sign(j) * (np.hypot(load, round_off) - round_off))

    return Hidden("load_friction", (j,), drag, 0.3)


def position_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A tight spot of the bearing, as von Mises' bell over the angle, beside the mean."""
    phase, width = rng.uniform(-np.pi, np.pi), rng.uniform(0.4, 0.9)
    return Hidden(
        "position_friction",
        (j,),
        lambda s: s.at(j, s.sign(j) * (np.exp(width * np.cos(s.motion.q[:, j] - phase)) - 1.0)),
        1.0 * arm.coulomb[j],
    )


def thermal_friction(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Grease that thins as it warms, exponentially, in drag and Coulomb's part."""
    scale, share = rng.uniform(18.0, 30.0), rng.uniform(0.2, 0.8)

    def drag(s: Scene) -> Floats:
        thin = np.exp(-(s.temperature[:, j] - 20.0) / scale) - 1.0
        own = share * arm.coulomb[j] * s.sign(j) + arm.viscous[j] * s.motion.qd[:, j]
        return s.at(j, thin * own)

    return Hidden("thermal_friction", (j,), drag, 1.5, needs=frozenset({"temperature"}))


def warmup(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Friction that falls while an arm runs in, recording by recording from the start."""
    lasts = rng.uniform(8.0, 20.0)

    def drag(s: Scene) -> Floats:
        fall = np.exp(-s.motion.t / lasts) - 0.5
        own = arm.coulomb[j] * s.sign(j) + 0.5 * arm.viscous[j] * s.motion.qd[:, j]
        return s.at(j, fall * own)

    return Hidden("warmup", (j,), drag, 1.2)


# ---- Gears, springs, loads -----------------------------------------------------------------------


def ripple(arm: Arm, j: int, rng: Generator) -> Hidden:
    """An order per turn, a tenth of its double, and a breath of the motor's own turn."""
    order, phase = int(rng.choice([2, 3, 4, 6, 8, 12])), rng.uniform(-np.pi, np.pi)
    motor = float(rng.choice([50, 80, 100, 101, 120]))

    def wave(s: Scene) -> Floats:
        q = s.motion.q[:, j]
        main = np.cos(order * q + phase) + 0.1 * np.sin(2 * order * q)
        return s.at(j, main + 0.05 * np.sin(motor * q))

    return Hidden("ripple", (j,), wave, 1.5 * arm.coulomb[j])


def armature(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A rotor that the data sheet leaves out."""
    return Hidden("armature", (j,), lambda s: s.at(j, s.motion.qdd[:, j]))


def spring(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A balancer's cylinder: force over the length between two pins, times its lever."""
    a, b, preload = 0.12, rng.uniform(0.3, 0.5), rng.uniform(0.0, 0.5)

    def pull(s: Scene) -> Floats:
        q = s.motion.q[:, j]
        length = np.sqrt(a * a + b * b - 2 * a * b * np.cos(np.pi - q))
        slack = b - a
        return s.at(j, -(preload * slack + length - slack) * a * b * np.sin(np.pi - q) / length)

    return Hidden("spring", (j,), pull)


def tool_force(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A cable from the tool to a far point, on a long soft spring. (Of the whole arm: j is not used.)"""
    reach = float(np.sum(np.linalg.norm(arm.origins, axis=1)))
    anchor = np.array([*rng.uniform(-3.0, 3.0, 2) * reach, rng.uniform(2.0, 4.0) * reach])

    def pull(s: Scene) -> Floats:
        tip, moves = tool_points(arm, s.motion.q)
        line = anchor - tip
        length = np.linalg.norm(line, axis=1, keepdims=True)
        force = line / length * (1.0 + 0.3 * (length / length.mean() - 1.0))
        return np.asarray(-np.einsum("rjc,rc->rj", moves, force))

    return Hidden("tool_force", (), pull)


def base_tilt(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A base that stands askew: weight along the floor, too. (Of the whole arm: j is not used.)"""
    turn = rng.uniform(0.0, 2.0 * np.pi)
    side = float(np.linalg.norm(GRAVITY)) * np.array([np.cos(turn), np.sin(turn), 0.0])
    return Hidden("base_tilt", (), lambda s: weight_along(arm, s.motion.q, side), 0.15)


def coupling(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A belt or a differential wrist: the neighbour's own losses and its rotor felt at this joint too."""
    k = j - 1 if j == arm.n - 1 or (j > 0 and rng.random() < 0.5) else j + 1
    drag, inert = rng.uniform(0.5, 1.5), rng.uniform(0.0, 0.05) * arm.coulomb[k]

    def felt(s: Scene) -> Floats:
        own = arm.coulomb[k] * s.sign(k) + drag * arm.viscous[k] * s.motion.qd[:, k]
        return s.at(j, own + inert * s.motion.qdd[:, k])

    return Hidden("coupling", (j, k), felt, 1.5)


def link_inertia(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A link that is not as its data sheet says: something is bolted to it."""
    place = arm.links[j].com + rng.uniform(-0.08, 0.08, 3)

    def changed(size: float) -> Arm:
        return _bolted(arm, j, size * arm.links[j].mass, place)

    return Hidden("link_inertia", (j,), arm=changed, largest=0.6)


def payload(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A load at the tool that nobody told. (Of the whole arm: j is not used.)"""
    place = arm.tool + rng.uniform(-0.05, 0.05, 3)
    return Hidden(
        "payload", (), arm=lambda size: _bolted(arm, arm.n - 1, size * arm.payload, place), largest=1.2
    )


def _bolted(arm: Arm, j: int, mass: float, place: Floats) -> Arm:
    one = replace(arm, links=(arm.links[j],))
    links = list(arm.links)
    links[j] = loaded(one, mass, place).links[0]
    return replace(arm, links=tuple(links))


def joint_elasticity(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Two masses with a damped spring between them, in MuJoCo; the encoder sits at the motor."""
    return Hidden("joint_elasticity", (j,), gearing="stiffness", largest=0.04)


def backlash(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A hinge with play between motor and link, in MuJoCo."""
    return Hidden("backlash", (j,), gearing="gap", largest=0.03)


# ---- Drives and measurement ----------------------------------------------------------------------


def motor_constant(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A drive that gives more, or less, than is read."""
    side = float(rng.choice([-1.0, 1.0]))
    return Hidden("motor_constant", (j,), lambda s: s.at(j, side * s.total[:, j]), largest=0.35, meter=True)


def torque_lag(arm: Arm, j: int, rng: Generator) -> Hidden:
    """A filter before the torque is read: first order, here to its first term in time (see `lagged`)."""
    return Hidden(
        "torque_lag",
        (j,),
        lambda s: s.at(j, -np.gradient(s.total[:, j], s.step)),
        largest=0.04,
        meter=True,
    )


def time_offset(arm: Arm, j: int, rng: Generator) -> Hidden:
    """Torques stamped late or early against the angles. (Of the whole arm: j is not used.)"""
    return Hidden("time_offset", (), lambda s: np.gradient(s.total, s.step, axis=0), largest=0.03, meter=True)


def lagged(torque: Floats, seconds: float, step: float) -> Floats:
    """Through a first-order filter, exactly."""
    a = float(np.exp(-step / seconds))
    value, found = float(torque[0]), []
    for new in torque.tolist():
        value = a * value + (1.0 - a) * new
        found.append(value)
    return np.array(found)


def shifted(torque: Floats, seconds: float, step: float) -> Floats:
    """What was at t + seconds is read at t."""
    rows = np.arange(len(torque), dtype=float)
    ahead = np.clip(rows + seconds / step, 0, len(torque) - 1)
    return np.stack([np.interp(ahead, rows, column) for column in torque.T], axis=1)


Maker = Callable[[Arm, int, Generator], Hidden]

LISTED: dict[str, Maker] = {
    maker.__name__: maker
    for maker in (
        viscous_law,
        stribeck,
        presliding,
        asymmetric_friction,
        load_friction,
        position_friction,
        thermal_friction,
        warmup,
        ripple,
        armature,
        spring,
        tool_force,
        base_tilt,
        coupling,
        link_inertia,
        payload,
        joint_elasticity,
        backlash,
        motor_constant,
        torque_lag,
        time_offset,
    )
}
"""The examiner's law of every effect that the catalogue has beside standard practice."""
