# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms in MuJoCo: links, rotors, gaps, springs, Coulomb and viscous friction are MuJoCo's; what
firmware and gears do besides is computed at every step, for all copies of an arm at once, which stand side by
side in one model and do not know of each other: what leaves (a spring too stiff for the step, an integral
that runs away) is stopped alone, and its motion is NaN.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from truing.exam.dynamics.robots import Arm, Floats, Link
from truing.exam.dynamics.servo.arms import NEVER, REFERENCE_C, Moment, Plant
from truing.exam.dynamics.servo.courses import SECONDS, Course

STEP = 2e-3
"""[s] of the simulation; recordings take every so many."""
SETTLE = 0.6
"""[s] at the first command before a recording begins."""
_LEAD_LAG = 0.015  # [s] filter of the commanded speed
_SUPPLY_LAG = 0.03  # [s] of the supply's capacitors
_WINDUP = 0.3  # [rad] of error times gain: most that the integral may hold
_BRISTLE = 1.5e-3  # [rad] over which friction of the gears turns
_GAP_LAG = 2.0 * STEP  # [s] time constant of a gap's stops
_WILD = 300.0  # [rad/s] of an arm that has left
_FLAT = 1e-6  # [rad] of error, below which the drive law is not evaluated


@dataclass(frozen=True)
class Run:
    """What one arm did along one course, at the recording's rate."""

    q: Floats  # shape=(rows, n) [rad] at the outputs, where the encoders are
    torque: Floats  # shape=(rows, n) [Nm] of the motors
    supply: Floats  # shape=(rows,): share of the nominal voltage
    speed: Floats  # shape=(rows, n) [rad/s] of the motors


@dataclass(frozen=True)
class Conditions:
    """What a recording was made under."""

    warmth: Floats  # shape=(rows, n) [deg C] of the gears


def play(
    plants: Sequence[Plant], courses: Sequence[Course], conditions: Sequence[Conditions]
) -> list[list[Run]]:
    """Every plant along every course: runs by plant, then by course. Courses have one rate and one length."""
    pairs = [(p, c, k) for p in plants for c, k in zip(courses, conditions, strict=True)]
    copies = _Copies([p for p, _, _ in pairs], [c for _, c, _ in pairs], [k for _, _, k in pairs])
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        runs = copies.run()
    finally:
        mujoco.set_mju_user_warning(before)
    width = len(courses)
    return [runs[k * width : (k + 1) * width] for k in range(len(plants))]


class _Copies:
    """Arms side by side. Arrays have shape=(copies, n)."""

    def __init__(
        self, plants: Sequence[Plant], courses: Sequence[Course], conditions: Sequence[Conditions]
    ) -> None:
        self.plants, self.courses, self.conditions = plants, courses, conditions
        self.model = _model_of(plants)
        self.data = mujoco.MjData(self.model)
        self.n = plants[0].arm.n
        names = [[f"c{k}J{j + 1}" for j in range(self.n)] for k in range(len(plants))]
        self.at = np.array([[self.model.joint(name).qposadr[0] for name in row] for row in names])
        flexes = [(k, j) for k, p in enumerate(plants) for j in range(self.n) if p.gap[j] or p.compliance[j]]
        self.flexed = np.array(flexes, dtype=int).reshape(-1, 2)
        self.flex_at = np.array([self.model.joint(f"c{k}F{j + 1}").qposadr[0] for k, j in flexes], dtype=int)
        self.copy_of = np.repeat(
            np.arange(len(plants)), [self.n + sum(k == f for f, _ in flexes) for k in range(len(plants))]
        )
        self.gone = np.zeros(len(plants), dtype=bool)
        self.rate = courses[0].rate
        self.stride = round(1.0 / (self.rate * STEP))
        self.steps = round((SETTLE + SECONDS) / STEP)
        self.p: dict[str, Floats] = {}  # values of every copy, by their names in Plant
        fields = "gain dead_band power bend integral lead rate limit load_friction breakaway thermal delay"
        for name in (*fields.split(), "stribeck_speed", "weight"):
            self.p[name] = np.stack([getattr(p, name) for p in plants])
        self.p["sag"] = np.array([p.sag for p in plants])[:, None]
        usual = {"rate": NEVER, "limit": NEVER, "dead_band": 0.0, "power": 1.0, "integral": 0.0, "lead": 0.0}
        usual |= {"sag": 0.0, "weight": 1.0, "load_friction": 0.0, "breakaway": 0.0, "thermal": 0.0}
        self.has = {name: bool(np.any(self.p[name] != none)) for name, none in usual.items()}
        self.has["gears"] = any(self.has[name] for name in ("load_friction", "breakaway", "thermal"))
        self.extras = [(k, j, law) for k, p in enumerate(plants) for j, law in p.extra]

    def _commands(self) -> Floats:
        """Held between the bus's samples, late by each joint's delay: shape=(steps, copies, n)."""
        t = np.arange(self.steps + 1) * STEP - SETTLE
        found = np.empty((self.steps, len(self.plants), self.n))
        for k, (plant, course) in enumerate(zip(self.plants, self.courses, strict=True)):
            rows = np.clip(np.floor(t * self.rate + 1e-6).astype(int), 0, len(course.u) - 1)
            held = course.u[rows]
            for j in range(self.n):
                found[:, k, j] = np.interp(t[:-1] - plant.delay[j], t, held[:, j])
        return found

    def _start(self) -> None:
        q = np.stack([course.u[0] for course in self.courses])
        self.data.qpos[self.at] = q
        mujoco.mj_forward(self.model, self.data)

    def _stop(self, left: NDArray[np.intp]) -> None:
        """Copies that have left: they hang still from now on."""
        self.gone[left] = True
        for k in left:
            own = self.model.jnt_qposadr[self.copy_of == k]
            self.data.qpos[own] = self.data.qvel[own] = self.data.qacc_warmstart[own] = 0.0

    def run(self) -> list[Run]:
        self._start()
        commands = self._commands()
        data, at = self.data, self.at
        shape = at.shape
        self.sent, self.slow = commands[0].copy(), commands[0].copy()
        self.held, self.bristle = np.zeros(shape), np.zeros(shape)
        self.torque, self.supply = np.zeros(shape), np.ones((shape[0], 1))
        warmth = np.stack([c.warmth - REFERENCE_C for c in self.conditions], axis=1)
        first = round(SETTLE / STEP)
        kept: list[tuple[Floats, ...]] = []
        for step in range(self.steps):
            q, v = data.qpos[at], data.qvel[at]
            if not np.abs(v).max() < _WILD:
                self._stop(np.flatnonzero(~(np.abs(v) < _WILD).all(axis=1)))
                q, v = data.qpos[at], data.qvel[at]
            out = q.copy()
            if len(self.flexed):
                out[self.flexed[:, 0], self.flexed[:, 1]] += data.qpos[self.flex_at]
            row = max(step - first, 0) // self.stride
            force = self._force(step * STEP - SETTLE, commands[step], out, v, warmth[row])
            force[self.gone] = 0.0
            data.qfrc_applied[at] = force
            if step >= first and (step - first) % self.stride == 0:
                out[self.gone] = np.nan
                kept.append((out, self.torque, self.supply[:, 0], v))
            mujoco.mj_step(self.model, data)
        q, torque, supply, v = (np.stack(column, axis=1) for column in zip(*kept, strict=True))
        return [Run(q[k], torque[k], supply[k], v[k]) for k in range(shape[0])]

    def _force(self, t: float, command: Floats, q: Floats, v: Floats, warmth: Floats) -> Floats:
        """[Nm] on the motors, without what MuJoCo's own friction takes. What no copy has is left out."""
        has = self.has
        if has["rate"]:
            self.sent = self.sent + np.clip(
                command - self.sent, -self.p["rate"] * STEP, self.p["rate"] * STEP
            )
        else:
            self.sent = command
        error = self.sent - q
        seen = error
        if has["dead_band"]:
            seen = np.sign(error) * np.maximum(np.abs(error) - self.p["dead_band"], 0.0)
        drive = self.p["gain"] * (self._law(seen) if has["power"] else seen)
        if has["integral"]:
            most = _WINDUP * self.p["gain"]
            self.held = np.clip(self.held + self.p["integral"] * seen * STEP, -most, most)
            drive = drive + self.held
        if has["lead"]:
            rate = (self.sent - self.slow) / _LEAD_LAG
            self.slow = self.slow + rate * STEP
            drive = drive + self.p["lead"] * rate
        if has["limit"]:
            drive = np.clip(drive * self.supply, -self.p["limit"], self.p["limit"])
        else:
            drive = drive * self.supply
        self.torque = drive
        if has["sag"]:
            left = 1.0 - self.p["sag"] * np.abs(self.torque).sum(axis=1, keepdims=True)
            self.supply = self.supply + (np.maximum(left, 0.2) - self.supply) * (STEP / _SUPPLY_LAG)
        force = drive - self._gears(v, warmth) if has["gears"] else drive.copy()
        if has["weight"]:
            force -= (self.p["weight"] - 1.0) * self.data.qfrc_bias[self.at]
        for k, j, law in self.extras:
            force[k, j] -= law(Moment(t, q[k, j], v[k, j], error[k, j], drive[k, j]))
        return np.asarray(force)

    def _law(self, error: Floats) -> Floats:
        """error |error / bend|^(power - 1), by which small errors are answered with more."""
        size = np.maximum(np.abs(error), _FLAT) / self.p["bend"]
        return np.asarray(error * size ** (self.p["power"] - 1.0))

    def _gears(self, v: Floats, warmth: Floats) -> Floats:
        """Friction beyond Coulomb's, on bristles that bend (Dahl 1968): of the load, at rest, of warmth."""
        side = np.sign(v)
        self.bristle = side + (self.bristle - side) * np.exp(-np.abs(v) * (STEP / _BRISTLE))
        bound = self.p["load_friction"] * np.abs(self.torque) + self.p["thermal"] * warmth
        bound += self.p["breakaway"] * np.exp(-np.minimum((v / self.p["stribeck_speed"]) ** 2, 50.0))
        return np.asarray(bound * self.bristle)


# ---- The model -----------------------------------------------------------------------------------


def _model_of(plants: Sequence[Plant]) -> mujoco.MjModel:
    arms = "".join(_arm_of(k, plant) for k, plant in enumerate(plants))
    return mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian" autolimits="true" balanceinertia="true" boundmass="1e-6"'
        f' boundinertia="1e-9"/><option timestep="{STEP}" integrator="implicitfast" gravity="0 0 -9.81"'
        ' tolerance="1e-12"><flag contact="disable" autoreset="disable"/></option>'
        f"<worldbody>{arms}</worldbody></mujoco>"
    )


def _arm_of(k: int, plant: Plant) -> str:
    """A chain of hinges; between motor and link another one, where there is a gap or a spring."""
    arm, parts, closing = plant.arm, [], []
    for j, link in enumerate(arm.links):
        axis = three(arm.axes[j])
        parts.append(
            f'<body pos="{three(arm.origins[j])}"><joint name="c{k}J{j + 1}" axis="{axis}"'
            f' armature="{plant.armature[j]:.12g}" damping="{plant.viscous[j]:.12g}"'
            f' frictionloss="{plant.coulomb[j]:.12g}" solreffriction="{2 * STEP:g} 1"/>'
        )
        closing.append("</body>")
        if plant.gap[j] or plant.compliance[j]:
            parts.append('<inertial mass="1e-4" pos="0 0 0" diaginertia="1e-7 1e-7 1e-7"/>')
            parts.append(f"<body>{_between(f'c{k}F{j + 1}', axis, plant, j)}")
            closing.append("</body>")
        parts.append(inertial(link))
    return "".join(parts) + "".join(closing)


def _between(name: str, axis: str, plant: Plant, j: int) -> str:
    own = plant.armature[j]
    if plant.compliance[j]:
        stiffness = 1.0 / plant.compliance[j]
        loss = 0.1 * np.sqrt(own * stiffness)
        return f'<joint name="{name}" axis="{axis}" stiffness="{stiffness:.9g}" damping="{loss:.9g}"/>'
    half = plant.gap[j] / 2.0
    loss = 0.02 * plant.viscous[j]
    return (
        f'<joint name="{name}" axis="{axis}" range="{-half:.9g} {half:.9g}" damping="{loss:.9g}"'
        f' solreflimit="{_GAP_LAG} 1" solimplimit="0.95 0.99 {half / 4:.3g}"/>'
    )


def inertial(link: Link) -> str:
    i = link.inertia
    six = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    return (
        f'<inertial mass="{link.mass:.12g}" pos="{three(link.com)}"'
        f' fullinertia="{" ".join(f"{value:.12g}" for value in six)}"/>'
    )


def three(values: Floats) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def mjcf(name: str, arm: Arm, drives: dict[str, Floats]) -> str:
    """The arm as its maker publishes it: links, and drives by their usual parameters."""
    parts, motors = [], []
    for j, link in enumerate(arm.links):
        parts.append(
            f'<body name="link{j + 1}" pos="{three(arm.origins[j])}"><joint name="J{j + 1}"'
            f' axis="{three(arm.axes[j])}" range="{-arm.reach[j] - 0.3:.6g} {arm.reach[j] + 0.3:.6g}"'
            f' armature="{drives["armature"][j]:.6g}" damping="{drives["viscous"][j]:.6g}"'
            f' frictionloss="{drives["coulomb"][j]:.6g}"/>{inertial(link)}'
        )
        motors.append(f'<position name="M{j + 1}" joint="J{j + 1}" kp="{drives["gain"][j]:.6g}"/>')
    tip = f'<site name="tool" pos="{three(arm.tool)}"/>'
    return (
        f'<mujoco model="{name}">\n<compiler angle="radian" autolimits="true"/>\n'
        f'<option timestep="{STEP}" integrator="implicitfast"/>\n<worldbody>\n'
        + "\n".join(parts)
        + f"\n{tip}{'</body>' * arm.n}\n</worldbody>\n<actuator>\n"
        + "\n".join(motors)
        + "\n</actuator>\n</mujoco>\n"
    )
