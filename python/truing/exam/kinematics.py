# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Forward kinematics of the examiner, in plain numpy and over all poses at once.

It shares no line with the core that is examined. Any link value, joint, frame may differ from pose to pose:
`Changes`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

import truing

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

D, A, ALPHA, BETA = range(4)  # columns of Changes.links
_NO_WEIGHT = 1e-6  # [Nm | N]: more than rounding, and than twenty bodies of a microgram 3 m away


class NoRestError(Exception):
    """The weight bends a spring further than this holds it back: a mechanism buckles."""


@dataclass(frozen=True)
class Chain:
    """A robot as arrays over its joints."""

    names: tuple[str, ...]
    mdh: bool  # modified Denavit-Hartenberg convention; else the standard one
    prismatic: NDArray[np.bool_]  # shape=(joints,)
    theta: Floats  # shape=(joints,): of the joint at reading zero [rad]
    links: Floats  # shape=(joints, 4): d, a [m], alpha, beta [rad]
    coupling: Floats  # shape=(joints, driven): motion = coupling @ reading
    drivers: tuple[tuple[tuple[int, float], ...], ...]  # of passive joints; empty: driven
    gravity: Floats  # in the base frame [m/s^2]
    base: Floats  # shape=(4, 4): T_measurement_base [m]
    targets: tuple[Floats, ...]  # shape=(4, 4) each: T_last_target [m]
    mass: Floats  # shape=(joints,): of the link behind each joint [kg]
    com: Floats  # shape=(joints, 3): its centre of mass in the frame behind the joint [m]

    @property
    def joints(self) -> int:
        """Number of joints, those that follow rods included."""
        return len(self.names)

    @property
    def driven(self) -> list[int]:
        """Joints with a motor, by their place in `names`; the others follow rods."""
        return [j for j, drivers in enumerate(self.drivers) if not drivers]

    @property
    def revolute(self) -> list[int]:
        """Joints with a motor that turn, by their place in `names`."""
        return [j for j in self.driven if not self.prismatic[j]]

    def number(self, joint: int) -> int:
        """Place of a driven joint among the columns q1 ..., counted from 1."""
        return self.driven.index(joint) + 1

    def angle(self, joint: int) -> str:
        """What a diagnosis calls the joint's motion: by its number in the chain, passive joints counted."""
        return f"q{joint + 1}"


def chain_of(robot: truing.Robot) -> Chain:
    """A truing robot of convention dh or mdh as a chain; ratios and zeros are left out, examination robots
    have none.
    """
    joints = list(robot.joints)
    names = [joint.name for joint in joints]
    drivers = tuple(
        tuple((names.index(name), weight) for name, weight in joint.driven_by) for joint in joints
    )
    return Chain(
        names=tuple(names),
        mdh=robot.convention == "mdh",
        prismatic=np.array([joint.type == "prismatic" for joint in joints]),
        theta=np.array([joint.theta for joint in joints]),
        links=np.array([[joint.d, joint.a, joint.alpha, joint.beta] for joint in joints]),
        coupling=_coupling(drivers),
        drivers=drivers,
        gravity=np.array(robot.gravity),
        base=np.array(robot.T_measurement_base),
        targets=tuple(np.array(target.T_last_target) for target in robot.targets),
        mass=np.array([joint.mass or 0.0 for joint in joints]),
        com=np.array([joint.center_of_mass for joint in joints]),
    )


def _coupling(drivers: Sequence[Sequence[tuple[int, float]]]) -> Floats:
    driven = [j for j, by in enumerate(drivers) if not by]
    matrix = np.zeros((len(drivers), len(driven)))
    for column, j in enumerate(driven):
        matrix[j, column] = 1.0
    for j, by in enumerate(drivers):
        for driver, weight in by:
            matrix[j, driven.index(driver)] += weight
    return matrix


@dataclass
class Changes:
    """How the true robot differs from the nominal one, pose by pose. n rows, J joints."""

    motion: Floats  # (n, J) added to the joints' motions [rad | m]
    links: Floats  # (n, J, 4) added to d, a, alpha, beta
    tilt: Floats  # (n, J, 2) turn about x, y just before the joint [rad]
    bend: (
        Floats  # (n, J, 3) rotation vector just before the joint: the end of the link that leads there [rad]
    )
    base: Floats  # (n, 6) of the base in the measurement frame: shift [m], rotation vector [rad]
    scale: Floats  # (n,) of the instrument's metre
    tool: Floats  # (n, 3) shift of the target in the last frame [m]

    def __add__(self, other: Changes) -> Changes:
        return Changes(**{f.name: getattr(self, f.name) + getattr(other, f.name) for f in fields(self)})

    def scaled(self, factor: float) -> Changes:
        return Changes(**{f.name: factor * getattr(self, f.name) for f in fields(self)})


def no_changes(n: int, joints: int) -> Changes:
    return Changes(
        np.zeros((n, joints)),
        np.zeros((n, joints, 4)),
        np.zeros((n, joints, 2)),
        np.zeros((n, joints, 3)),
        np.zeros((n, 6)),
        np.zeros(n),
        np.zeros((n, 3)),
    )


@dataclass
class Sweep:
    """Frames of all poses in the measurement frame, lengths in m, and the axis and origin of every elementary
    transform met on the way.
    """

    tip: Floats  # (n, 3)
    rotation: Floats  # (n, 3, 3)
    joint_axis: Floats  # (J, n, 3)
    joint_origin: Floats  # (J, n, 3)
    joint_rotation: Floats  # (J, n, 3, 3) before the joint turns
    link_rotation: Floats  # (J, n, 3, 3) after the joint's row
    link_origin: Floats  # (J, n, 3)
    sites: dict[tuple[str, int, int], tuple[bool, Floats, Floats]] = field(
        default_factory=dict
    )  # (kind, joint, k): turns, axis, origin


class _Frame:
    """A frame for every pose, moved by elementary transforms. Columns of the rotation are kept apart: a turn
    touches two.
    """

    def __init__(self, n: int, frame: Floats) -> None:
        self.columns = [np.repeat(frame[None, :3, k], n, axis=0) for k in range(3)]
        self.origin = np.repeat(frame[None, :3, 3], n, axis=0)

    def turn(self, axis: int, angle: Floats) -> None:
        u, v = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        self.columns[u], self.columns[v] = (
            c * self.columns[u] + s * self.columns[v],
            c * self.columns[v] - s * self.columns[u],
        )

    def shift(self, axis: int, by: Floats) -> None:
        self.origin = self.origin + by[:, None] * self.columns[axis]

    def rotation(self) -> Floats:
        return np.stack(self.columns, axis=2)

    def rotate(self, vectors: Floats) -> None:
        """By small or large rotation vectors in the frame itself, shape=(n, 3)."""
        turned = self.rotation() @ rotations(vectors)
        self.columns = [turned[:, :, k] for k in range(3)]


def rotations(vectors: Floats) -> Floats:
    """Rotation matrices of rotation vectors [rad], shape=(n, 3) -> (n, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    k = np.stack([np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], 1)
    first = np.sinc(angle / math.pi)[:, None, None]
    second = (0.5 * np.sinc(angle / (2.0 * math.pi)) ** 2)[:, None, None]
    return np.asarray(np.eye(3) + first * k + second * (k @ k))


def motions(chain: Chain, readings: Floats, changes: Changes | None = None) -> Floats:
    """Motion of every joint, shape=(n, J) [rad | m], at `readings`, shape=(n, driven) [rad | m]. Passive
    joints follow the true motions of their drivers.
    """
    every = readings @ chain.coupling.T
    if changes is not None:
        every = every + changes.motion
        for j, drivers in enumerate(chain.drivers):
            for driver, weight in drivers:
                every[:, j] += weight * changes.motion[:, driver]
    return every


def sweep(
    chain: Chain,
    readings: Floats,
    changes: Changes | None = None,
    target: Ints | None = None,
    every_site: bool = False,
) -> Sweep:
    """Where target, links and axes are, in the measurement frame.

    readings: shape=(n, driven) [rad | m]. target: shape=(n,), which target was measured; None: the first.
    every_site: also notes axis and origin of every elementary transform, for `site_columns`.
    """
    n = len(readings)
    change = changes if changes is not None else no_changes(n, chain.joints)
    motion = motions(chain, readings, change)
    frame = _Frame(n, chain.base)
    frame.origin = frame.origin + change.base[:, :3]
    if change.base[:, 3:].any():
        turned = rotations(change.base[:, 3:]) @ frame.rotation()
        frame.columns = [turned[:, :, k] for k in range(3)]
    walk = _Walk(chain, frame, change, every_site)
    for j in range(chain.joints):
        walk.joint(j, motion[:, j])
    return walk.finish(target if target is not None else np.zeros(n, dtype=np.int64))


class _Walk:
    """One pass along the chain."""

    def __init__(self, chain: Chain, frame: _Frame, change: Changes, every_site: bool) -> None:
        self.chain, self.frame, self.change, self.every_site = chain, frame, change, every_site
        self.sites: dict[tuple[str, int, int], tuple[bool, Floats, Floats]] = {}
        self.axes: list[Floats] = []
        self.origins: list[Floats] = []
        self.before: list[Floats] = []
        self.link_rotations: list[Floats] = []
        self.link_origins: list[Floats] = []

    def joint(self, j: int, motion: Floats) -> None:
        values = self.chain.links[j] + self.change.links[:, j]
        if self.chain.mdh:
            self._link(j, values)
        self._soften(j)
        self.axes.append(self.frame.columns[2])
        self.origins.append(self.frame.origin)
        self.before.append(self.frame.rotation())
        slides = bool(self.chain.prismatic[j])
        self._note("motion", j, 0, not slides, 2)
        self.frame.turn(2, self.chain.theta[j] + (0.0 * motion if slides else motion))
        self._note("link", j, D, False, 2)
        self.frame.shift(2, values[:, D] + (motion if slides else 0.0))
        if not self.chain.mdh:
            self._link(j, values)
        self.link_rotations.append(self.frame.rotation())
        self.link_origins.append(self.frame.origin)

    def _link(self, j: int, values: Floats) -> None:
        """Rx(alpha), Tx(a) and Ry(beta): x moves and x turns commute, so their order is the same for both
        conventions.
        """
        self._note("link", j, A, False, 0)
        self.frame.shift(0, values[:, A])
        self._note("link", j, ALPHA, True, 0)
        self.frame.turn(0, values[:, ALPHA])
        self._note("link", j, BETA, True, 1)
        self.frame.turn(1, values[:, BETA])

    def _soften(self, j: int) -> None:
        for k in range(3):
            self._note("bend", j, k, True, k)
        if self.change.bend[:, j].any():
            self.frame.rotate(self.change.bend[:, j])
        for k in range(2):
            if self.change.tilt[:, j, k].any():
                self.frame.turn(k, self.change.tilt[:, j, k])

    def _note(self, kind: str, j: int, k: int, turns: bool, axis: int) -> None:
        if self.every_site:
            self.sites[kind, j, k] = (turns, self.frame.columns[axis], self.frame.origin)

    def finish(self, target: Ints) -> Sweep:
        rotation = self.frame.rotation()
        places = np.array([t[:3, 3] for t in self.chain.targets])[target] + self.change.tool
        tip = self.frame.origin + np.einsum("nij,nj->ni", rotation, places)
        tip = tip * (1.0 + self.change.scale[:, None])
        rotation = rotation @ np.array([t[:3, :3] for t in self.chain.targets])[target]
        return Sweep(
            tip,
            rotation,
            np.array(self.axes),
            np.array(self.origins),
            np.array(self.before),
            np.array(self.link_rotations),
            np.array(self.link_origins),
            self.sites,
        )


def site_columns(state: Sweep) -> dict[tuple[str, int, int], Floats]:
    """What each elementary value does to the tip, shape=(n, 3) each [m/rad | m/m]. The sweep must have been
    made with `every_site`.
    """
    columns = {}
    for key, (turns, axis, origin) in state.sites.items():
        columns[key] = np.cross(axis, state.tip - origin) if turns else axis
    return columns


def gravity_torques(chain: Chain, state: Sweep, payload: Floats) -> Floats:
    """Torque [Nm] or force [N] of weight on every joint coordinate, its passive followers included, shape=(n,
    J). payload: shape=(n,) [kg], at the first target.
    """
    down = chain.base[:3, :3] @ chain.gravity
    centers = state.link_origin + np.einsum("jnab,jb->jna", state.link_rotation, chain.com)
    first = _tool_points(chain, state)
    single = np.zeros((len(payload), chain.joints))
    for j in range(chain.joints):
        load = np.sum(chain.mass[j:]) + payload
        moment = np.einsum("l,lna->na", chain.mass[j:], centers[j:] - state.joint_origin[j]) + payload[
            :, None
        ] * (first - state.joint_origin[j])
        axis = state.joint_axis[j]
        single[:, j] = (
            load * (axis @ down)
            if chain.prismatic[j]
            else np.einsum("na,na->n", axis, np.cross(moment, down))
        )
    total = single.copy()
    for j, drivers in enumerate(chain.drivers):
        for driver, weight in drivers:
            total[:, driver] += weight * single[:, j]
    return total


def side_of(torque: Floats) -> Floats:
    """-1 or 1: the side to which a torque [Nm] or force [N] pushes; 0 where nothing does."""
    return np.asarray(np.where(np.abs(torque) > _NO_WEIGHT, np.sign(torque), 0.0))


def _tool_points(chain: Chain, state: Sweep) -> Floats:
    """The payload hangs at the first target, whichever was measured."""
    return np.asarray(state.link_origin[-1] + state.link_rotation[-1] @ chain.targets[0][:3, 3])


def quaternions(matrices: Floats) -> Floats:
    """Quaternions w x y z with w >= 0, shape=(n, 4), of rotation matrices, shape=(n, 3, 3): eigenvector of
    the largest eigenvalue (Bar-Itzhack 2000).
    """
    r = matrices
    k = np.empty((len(r), 4, 4))
    k[:, 0, 0] = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    k[:, 1, 1] = r[:, 0, 0] - r[:, 1, 1] - r[:, 2, 2]
    k[:, 2, 2] = r[:, 1, 1] - r[:, 0, 0] - r[:, 2, 2]
    k[:, 3, 3] = r[:, 2, 2] - r[:, 0, 0] - r[:, 1, 1]
    for (i, j), value in {
        (0, 1): r[:, 2, 1] - r[:, 1, 2],
        (0, 2): r[:, 0, 2] - r[:, 2, 0],
        (0, 3): r[:, 1, 0] - r[:, 0, 1],
        (1, 2): r[:, 0, 1] + r[:, 1, 0],
        (1, 3): r[:, 0, 2] + r[:, 2, 0],
        (2, 3): r[:, 1, 2] + r[:, 2, 1],
    }.items():
        k[:, i, j] = k[:, j, i] = value
    found: Any = np.linalg.eigh(k)[1][:, :, -1]
    return np.asarray(found * np.where(found[:, :1] < 0.0, -1.0, 1.0))
