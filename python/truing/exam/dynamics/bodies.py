# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What an arm's links ask of its joints, in numpy over many rows at once: the examiner's own Newton and
Euler, to say what inertias could explain, and for the feed-forward of a controller. Motions themselves are
MuJoCo's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truing.exam.dynamics.robots import Arm, Floats, Link

GRAVITY = np.array([0.0, 0.0, -9.81])
_SYMMETRIC = tuple(
    np.array([[a == i and b == j or a == j and b == i for b in range(3)] for a in range(3)], dtype=float)
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
)


@dataclass(frozen=True)
class Sweep:
    """Motion of every joint's frame in the base's axes; lists over joints, rows first."""

    rotation: list[Floats]  # (rows, 3, 3)
    origin: list[Floats]  # (rows, 3) [m]
    axis: list[Floats]  # (rows, 3)
    spin: list[Floats]  # (rows, 3) [rad/s]
    spin_rate: list[Floats]  # (rows, 3) [rad/s^2]
    acceleration: list[Floats]  # (rows, 3) [m/s^2] of the origin, gravity taken off


def sweep(arm: Arm, q: Floats, qd: Floats, qdd: Floats) -> Sweep:
    """Outward recursion (Featherstone 2008, table 5.1, in base coordinates). q, qd, qdd: shape=(rows, n)."""
    rows = len(q)
    turn = np.broadcast_to(np.eye(3), (rows, 3, 3))
    origin, spin, rate = (np.zeros((rows, 3)) for _ in range(3))
    acceleration = np.broadcast_to(-GRAVITY, (rows, 3))
    found = Sweep([], [], [], [], [], [])
    for j in range(arm.n):
        step = turn @ arm.origins[j]
        acceleration = acceleration + np.cross(rate, step) + np.cross(spin, np.cross(spin, step))
        origin = origin + step
        axis = turn @ arm.axes[j]
        turn = turn @ _about(arm.axes[j], q[:, j])
        rate = rate + axis * qdd[:, j, None] + np.cross(spin, axis) * qd[:, j, None]
        spin = spin + axis * qd[:, j, None]
        for column, value in zip(
            (
                found.rotation,
                found.origin,
                found.axis,
                found.spin,
                found.spin_rate,
                found.acceleration,
            ),
            (turn, origin, axis, spin, rate, acceleration),
            strict=True,
        ):
            column.append(np.asarray(value))
    return found


def _about(axis: Floats, angle: Floats) -> Floats:
    """Rodrigues' formula, shape=(rows, 3, 3)."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sin * k + (1.0 - cos) * (k @ k))


def regressor(arm: Arm, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """Torques for a unit of every link's m, mx, my, mz, xx, yy, zz, xy, xz, yz (inertia about the joint's
    frame): shape=(rows, n, 10 n) (Atkeson, An and Hollerbach 1986, eq. 8).
    """
    motion = sweep(arm, q, qd, qdd)
    rows, n = q.shape
    found = np.zeros((rows, n, 10 * n))
    for k in range(n):
        turn, w, dw, a = motion.rotation[k], motion.spin[k], motion.spin_rate[k], motion.acceleration[k]
        for c in range(10):
            force, moment = np.zeros((rows, 3)), np.zeros((rows, 3))
            if c == 0:
                force = a
            elif c < 4:
                e = turn[:, :, c - 1]
                force = np.cross(dw, e) + np.cross(w, np.cross(w, e))
                moment = np.cross(e, a)
            else:
                moment = _euler(turn, _SYMMETRIC[c - 4], w, dw)
            for j in range(k + 1):
                lever = motion.origin[k] - motion.origin[j]
                found[:, j, 10 * k + c] = np.sum(motion.axis[j] * (moment + np.cross(lever, force)), axis=1)
    return found


def _euler(turn: Floats, inertia: Floats, w: Floats, dw: Floats) -> Floats:
    """I dw + w x I w, the inertia given in the link's frame."""

    def times(v: Floats) -> Floats:
        local = np.einsum("rij,ri->rj", turn, v) @ inertia
        return np.asarray(np.einsum("rij,rj->ri", turn, local))

    return np.asarray(times(dw) + np.cross(w, times(w)))


def numbers(link: Link) -> Floats:
    """Mass, first moment and inertia about the joint's frame, in the order of `regressor`."""
    inertia = link.inertia + link.mass * (link.com @ link.com * np.eye(3) - np.outer(link.com, link.com))
    first = link.mass * link.com
    return np.array([link.mass, *first, *np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]])


def torques(arm: Arm, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """Torques that the links ask of the joints, shape=(rows, n) [Nm]."""
    motion = sweep(arm, q, qd, qdd)
    rows, n = q.shape
    found = np.zeros((rows, n))
    for k, link in enumerate(arm.links):
        turn, w, dw = motion.rotation[k], motion.spin[k], motion.spin_rate[k]
        com = turn @ link.com
        force = link.mass * (motion.acceleration[k] + np.cross(dw, com) + np.cross(w, np.cross(w, com)))
        moment = np.cross(com, force) + _euler(turn, link.inertia, w, dw)
        for j in range(k + 1):
            lever = motion.origin[k] - motion.origin[j]
            found[:, j] += np.sum(motion.axis[j] * (moment + np.cross(lever, force)), axis=1)
    return found


def weight_along(arm: Arm, q: Floats, way: Floats) -> Floats:
    """Torques that hold the links at rest against this gravity, shape=(rows, n) [Nm]. way: shape=(3,) [m/s^2]
    in the base's axes.
    """
    motion = sweep(arm, q, np.zeros_like(q), np.zeros_like(q))
    found = np.zeros_like(q)
    for k, link in enumerate(arm.links):
        center = motion.origin[k] + motion.rotation[k] @ link.com
        for j in range(k + 1):
            moment = np.cross(center - motion.origin[j], -link.mass * way)
            found[:, j] += np.sum(motion.axis[j] * moment, axis=1)
    return found


def tool_points(arm: Arm, q: Floats) -> tuple[Floats, Floats]:
    """Tool in the base's axes, shape=(rows, 3) [m], and how it moves with every joint, shape=(rows, n, 3)
    [m/rad].
    """
    still = np.zeros_like(q)
    motion = sweep(arm, q, still, still)
    tip = motion.origin[-1] + motion.rotation[-1] @ arm.tool
    arms = [np.cross(motion.axis[j], tip - motion.origin[j]) for j in range(arm.n)]
    return tip, np.stack(arms, axis=1)
