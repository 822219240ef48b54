# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Arms in MuJoCo under a position controller: rigid ones, with springs between motor and link, with gaps
there.

A motion is kept where forces and accelerations meet: MuJoCo steps half-implicitly, so that the force of a
step belongs to the second difference of the angle about its beginning, and the speed at that instant is the
mean
of those before and after. A test holds that no shift of the torques in time explains anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
from mujoco import rollout

from truing.exam.dynamics.bodies import torques
from truing.exam.dynamics.motions import STEP, Course
from truing.exam.dynamics.robots import Arm, Floats

_STICKING = 4e-3
"""[rad] that friction may hold a joint away from where it is sent."""


@dataclass(frozen=True)
class Motion:
    """What the motors' sides did, at STEP from the first recorded row on."""

    t: Floats  # shape=(rows,) [s]
    q: Floats  # shape=(rows, n) [rad]
    qd: Floats
    qdd: Floats
    torque: Floats  # shape=(rows, n) [Nm] that moved the mechanism, without friction

    def every(self, step: int) -> Motion:
        return Motion(*(column[::step] for column in (self.t, self.q, self.qd, self.qdd, self.torque)))


@dataclass(frozen=True)
class Gearing:
    """What stands between motor and link, by joint. The rotor is part of what the data sheet gives as its
    link's inertia (`with_rotor`).
    """

    rotor: Mapping[int, float] = field(default_factory=dict)  # [kg m^2] about the joint's axis
    stiffness: Mapping[int, float] = field(default_factory=dict)  # [Nm/rad]
    gap: Mapping[int, float] = field(default_factory=dict)  # [rad] from stop to stop


@dataclass(frozen=True)
class Controller:
    """PD with gravity fed forward."""

    kp: Floats  # [Nm/rad]
    kd: Floats  # [Nm s/rad]
    believed: Arm  # whose weight is fed forward


def felt_inertia(arm: Arm) -> Floats:
    """[kg m^2] that each joint feels in the middle of its travel."""
    n = arm.n
    q = np.full((n, n), 0.3)
    still = np.zeros((n, n))
    return np.diag(torques(arm, q, still, np.eye(n)) - torques(arm, q, still, still)).copy()


def controller(arm: Arm, believed: Arm, hertz: float) -> Controller:
    """Gains for a bandwidth, from the inertia that each joint feels in the middle of its travel; more where
    friction would hold a joint far from its command.
    """
    felt = felt_inertia(arm)
    kp = np.maximum(felt * (2.0 * np.pi * hertz) ** 2, arm.coulomb / _STICKING)
    return Controller(kp, 1.4 * np.sqrt(felt * kp), believed)


def model_of(arm: Arm, gains: Controller, gearing: Gearing) -> mujoco.MjModel:
    """The mechanism with a motor of affine force, `control - kp q - kd qd`, at every joint."""
    bodies, motors, closing = [], [], []
    for j, link in enumerate(arm.links):
        place = " ".join(f"{value:.9g}" for value in arm.origins[j])
        axis = " ".join(f"{value:g}" for value in arm.axes[j])
        bodies.append(f'<body pos="{place}"><joint name="J{j + 1}" axis="{axis}"/>')
        closing.append("</body>")
        own = link
        if j in gearing.stiffness or j in gearing.gap:
            rotor = _disc(arm.axes[j], gearing.rotor[j])
            own = replace(link, inertia=link.inertia - rotor)
            bodies.append(f"{_inertial(1e-6, np.zeros(3), rotor)}<body>{_between(j, axis, gearing)}")
            closing.append("</body>")
        bodies.append(_inertial(own.mass, own.com, own.inertia))
        motors.append(
            f'<general joint="J{j + 1}" gainprm="1" biastype="affine"'
            f' biasprm="0 {-gains.kp[j]:.9g} {-gains.kd[j]:.9g}"/>'
        )
    text = (
        f'<mujoco><compiler angle="radian" autolimits="true"/><option timestep="{STEP}"'
        ' integrator="implicitfast" gravity="0 0 -9.81"><flag contact="disable"/></option>'
        f"<worldbody>{''.join(bodies)}{''.join(closing)}</worldbody>"
        f"<actuator>{''.join(motors)}</actuator></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(text)


def _between(j: int, axis: str, gearing: Gearing) -> str:
    """The hinge between motor and link; the gear's own losses damp it a little."""
    if j in gearing.stiffness:
        k = gearing.stiffness[j]
        return f'<joint name="F{j + 1}" axis="{axis}" stiffness="{k:.9g}" damping="{k * 8e-4:.9g}"/>'
    half = gearing.gap[j] / 2.0
    return (
        f'<joint name="F{j + 1}" axis="{axis}" range="{-half:.9g} {half:.9g}" damping="0.02"'
        f' solreflimit="{4 * STEP} 1" solimplimit="0.95 0.99 {half / 4:.3g}"/>'
    )


def _hang(model: mujoco.MjModel, data: mujoco.MjData, arm: Arm, q: Floats, gearing: Gearing) -> None:
    """Springs bent, and gaps closed, as the weight does at rest."""
    still = np.zeros_like(q)
    weight = torques(arm, q, still, still)[0]
    for j, stiffness in gearing.stiffness.items():
        data.qpos[model.joint(f"F{j + 1}").qposadr[0]] = -weight[j] / stiffness
    for j, gap in gearing.gap.items():
        data.qpos[model.joint(f"F{j + 1}").qposadr[0]] = -np.sign(weight[j]) * gap / 2.0


def with_rotor(arm: Arm, joint: int, size: float) -> Arm:
    """The rotor's disc added to its link: rigidly joined, both are the link of the data sheet."""
    links = list(arm.links)
    links[joint] = replace(links[joint], inertia=links[joint].inertia + _disc(arm.axes[joint], size))
    return replace(arm, links=tuple(links))


def _disc(axis: Floats, size: float) -> Floats:
    return np.asarray(size * (0.6 * np.eye(3) + 0.4 * np.outer(axis, axis)))


def _inertial(mass: float, com: Floats, inertia: Floats) -> str:
    i = inertia
    six = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    return (
        f'<inertial mass="{mass:.12g}" pos="{" ".join(f"{v:.12g}" for v in com)}"'
        f' fullinertia="{" ".join(f"{v:.12g}" for v in six)}"/>'
    )


def fed_forward(believed: Arm, course: Course, every: int = 10) -> Floats:
    """Weight along the commanded motion, as a controller computes it every few cycles and draws lines
    between.
    """
    rows = np.arange(len(course.q))
    some = np.unique(np.r_[rows[::every], rows[-1]])
    still = np.zeros((len(some), believed.n))
    weight = torques(believed, course.q[some], still, still)
    return np.stack([np.interp(rows, some, weight[:, j]) for j in range(believed.n)], axis=1)


def run(
    arm: Arm,
    gains: Controller,
    courses: Sequence[Course],
    losses: Sequence[Floats],
    gearing: Gearing | None = None,
) -> list[Motion]:
    """Motions of the motors under commands. losses: [Nm] friction and the like that act against the motors
    along each course, shape=(rows, n).
    """
    gearing = gearing or Gearing()
    model = model_of(arm, gains, gearing)
    data = mujoco.MjData(model)
    motor = [int(model.joint(name).qposadr[0]) for name in arm.names]
    found = []
    for course, loss in zip(courses, losses, strict=True):
        mujoco.mj_resetData(model, data)
        data.qpos[motor] = course.q[0]
        _hang(model, data, arm, course.q[:1], gearing)
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start = np.empty(size)
        mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        control = gains.kp * course.q + gains.kd * course.qd + fed_forward(gains.believed, course) - loss
        states, _ = rollout.rollout(model, data, start[None], control[None], skip_checks=False)
        states = np.concatenate([start[None], states[0]])
        q, v = states[:, 1 : 1 + model.nq][:, motor], states[:, 1 + model.nq : 1 + 2 * model.nq][:, motor]
        # Equation of the step: M (v[k+1] - v[k]) / h + bias(q[k], v[k]) = control[k] - kp q[k] - kd v[k+1].
        force = control - gains.kp * q[:-1] - gains.kd * v[1:]
        rows = slice(course.settle, len(course.q))
        found.append(
            Motion(
                np.arange(len(course.q) - course.settle, dtype=float) * STEP,
                q[:-1][rows],
                (0.5 * (v[:-1] + v[1:]))[rows],
                ((v[1:] - v[:-1]) / STEP)[rows],
                force[rows],
            )
        )
    return found
