# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques that a simulator has no field for. `truing.dynamics.export` writes this file beside the model.

    import mujoco, callbacks
    model = mujoco.MjModel.from_xml_path("callbacks.xml")  # robot.xml where there is none
    callbacks.install(model)

`install` sets MuJoCo's passive callback for this model; other models are left alone. What resists motion is
told to MuJoCo as dry friction (`dof_frictionloss`) that changes with state, so that a joint sticks as it
should; the rest is added to `qfrc_passive`. Both see the motors' torque and the accelerations of the step
before. Without MuJoCo's callback (many simulations at once) call `dry_friction` and `smooth_torques` with
arrays of any number of rows, and `link_torques` of every state. It needs numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Effect = tuple[str, int, int, dict[str, float]]
"""Name, number of the joint, number of the joint that causes it (the same, but for couplings), parameters."""

JOINTS: list[str] = []
"""Names of the joints that have a reading; columns of all tables are in this order."""
RATIOS: list[float] = []
"""A joint of the model is at ratio * reading; the tables here are of readings."""
LINKS: list[str] = []
"""Names of all joints of the chain."""
COUPLING: list[list[float]] = []
"""Motion of each of LINKS for readings of one, one row a joint."""
EFFECTS: list[Effect] = []
FIELDS: dict[str, list[float]] = {}
"""`frictionloss` [Nm | N] and `damping` [Nm s/rad | N s/m] at the readings, to which the effects are
added."""

NO_CALLBACKS = "callbacks_belong_to"  # text in a model that was fitted without these effects

REFERENCE_C = 20.0  # temperature from which thermal effects count
_QUIET = 0.01  # [rad/s | m/s] below this the sign of another joint's speed fades


def dry_friction(
    q: ArrayLike,
    qd: ArrayLike,
    drive: ArrayLike,
    temperature: ArrayLike = REFERENCE_C,
    time: ArrayLike = 0.0,
    effects: Sequence[Effect] | None = None,
    base: Sequence[float] | None = None,
    links: ArrayLike | None = None,
) -> Floats:
    """What holds each joint back, without its sign. shape=(n, joints) [Nm | N]

    q, qd: readings and their speeds. drive: torques of the motors. links: what of them the links take
    (`link_torques`); as much as the motors give where it is not known. All shape=(n, joints). temperature
    [deg C] and time [s] of switched-on drives: a number, (n, 1) or (n, joints).
    """
    q, qd, drive, warm, time = _tables(q, qd, drive, temperature, time)
    carried = drive if links is None else np.atleast_2d(np.asarray(links, dtype=float))
    out = np.zeros_like(q) + (FIELDS["frictionloss"] if base is None else base)
    for name, j, _, p in EFFECTS if effects is None else effects:
        speed = np.abs(qd[:, j])
        if name == "coulomb":
            out[:, j] += p[""]
        elif name == "load_friction":
            out[:, j] += p.get("", 0.0) * np.abs(drive[:, j]) + p.get("links", 0.0) * np.abs(carried[:, j])
        elif name == "position_friction":
            out[:, j] += p.get("sin", 0.0) * np.sin(q[:, j]) + p.get("cos", 0.0) * np.cos(q[:, j])
        elif name == "stribeck":
            out[:, j] += p[""] * np.exp(-((speed / p["vs"]) ** 2))
        elif name == "viscous_law":
            out[:, j] += p.get("root", 0.0) * np.sqrt(speed)
            if "saturating" in p:
                out[:, j] += p["saturating"] * np.tanh(speed / p["v0"])
        elif name == "thermal_friction":
            out[:, j] += p.get("coulomb", 0.0) * warm[:, j]
        elif name == "warmup":
            out[:, j] += p.get("coulomb", 0.0) * time[:, j]
    return np.maximum(out, 0.0)


def smooth_torques(
    q: ArrayLike,
    qd: ArrayLike,
    drive: ArrayLike,
    temperature: ArrayLike = REFERENCE_C,
    time: ArrayLike = 0.0,
    effects: Sequence[Effect] | None = None,
) -> Floats:
    """What else acts on each joint, with its sign: add it to the joint. shape=(n, joints) [Nm | N]

    Arguments as of dry_friction.
    """
    q, qd, drive, warm, time = _tables(q, qd, drive, temperature, time)
    out = np.zeros_like(q)
    for name, j, by, p in EFFECTS if effects is None else effects:
        if name == "asymmetric_friction":
            out[:, j] -= p[""] * np.abs(qd[:, j])
        elif name == "coupling":
            out[:, j] -= p.get("viscous", 0.0) * qd[:, by] + p.get("coulomb", 0.0) * np.tanh(
                qd[:, by] / _QUIET
            )
        elif name == "thermal_friction":
            out[:, j] -= p.get("viscous", 0.0) * qd[:, j] * warm[:, j]
        elif name == "warmup":
            out[:, j] -= p.get("viscous", 0.0) * qd[:, j] * time[:, j]
    return out


def _tables(
    q: ArrayLike, qd: ArrayLike, drive: ArrayLike, temperature: ArrayLike, time: ArrayLike
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    q, qd, drive = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (q, qd, drive))
    warm = np.broadcast_to(np.asarray(temperature, dtype=float) - REFERENCE_C, q.shape)
    return q, qd, drive, warm, np.broadcast_to(np.asarray(time, dtype=float), q.shape)


def of_links() -> bool:
    """Whether `dry_friction` looks at what the links take."""
    return any("links" in parameters for _, _, _, parameters in EFFECTS)


def link_torques(model: Any, data: Any, dofs: ArrayLike) -> Floats:
    """What the links take of each drive, without friction and rotors, in the state of MuJoCo's `data`, whose
    velocities were computed, and at its accelerations. dofs: of LINKS. shape=(joints,) [Nm | N]"""
    import mujoco

    held = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, held)
    return np.asarray(np.transpose(COUPLING) @ held[np.asarray(dofs)])


def prepare(model: Any) -> Floats:
    """Sets the model's fields to those that belong to the callbacks: without them, Coulomb friction and
    damping stand for what they add. Returns which degree of freedom each joint is, shape=(joints,).

    Raises ValueError: the model was fitted without these effects.
    """
    import mujoco

    text = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, NO_CALLBACKS)
    if text >= 0:
        begin, size = model.text_adr[text], model.text_size[text]
        file = bytes(model.text_data[begin : begin + size - 1]).decode()
        raise ValueError(f"this model was fitted without callbacks: they belong to {file}")
    ratios = np.asarray(RATIOS)
    dofs = np.array([model.joint(name).dofadr[0] for name in JOINTS])
    model.dof_frictionloss[dofs] = np.asarray(FIELDS["frictionloss"]) / np.abs(ratios)
    model.dof_damping[dofs] = np.asarray(FIELDS["damping"]) / ratios**2
    return dofs


def install(
    model: Any, temperature: Callable[[Any], float] | None = None, time: Callable[[Any], float] | None = None
) -> None:
    """Sets mujoco.set_mjcb_passive for this model (one thread: the model's dry friction changes at every
    step).

    temperature, time: of MuJoCo's data, [deg C] and [s]; 20 deg C and data.time if not given.
    """
    import mujoco

    dofs, ratios = prepare(model), np.asarray(RATIOS)
    qpos = np.array([model.joint(name).qposadr[0] for name in JOINTS])
    motors = [model.actuator(f"drive_{name}").id for name in JOINTS]
    chain = [model.joint(name).dofadr[0] for name in LINKS] if of_links() else None

    def passive(m: Any, d: Any) -> None:
        if m is not model and m.signature != model.signature:
            return
        q, qd = d.qpos[qpos] / ratios, d.qvel[dofs] / ratios
        drive = d.actuator_force[motors] + d.qfrc_applied[dofs] * ratios
        warm = REFERENCE_C if temperature is None else temperature(d)
        now = d.time if time is None else time(d)
        links = None if chain is None else link_torques(m, d, chain)
        m.dof_frictionloss[dofs] = dry_friction(q, qd, drive, warm, now, links=links)[0] / np.abs(ratios)
        d.qfrc_passive[dofs] += smooth_torques(q, qd, drive, warm, now)[0] / ratios

    mujoco.set_mjcb_passive(passive)
