# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The robot as simulators hold one: fixed frames between plain joints, and bodies that can exist.

    T_link = before @ (motion about or along axis) @ after

Joint zeros are folded into `before`, so that a simulator's joint is at `ratio * reading`. `after` is where
the robot's file has its link frame; of URDF conventions it is the identity.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError

Floats = NDArray[np.float64]

_LEAST = 1e-9  # of a body's largest second moment: the smallest one that is written
_TINY_MASS = 1e-6  # [kg]
_TINY_RADIUS = 1e-3  # [m] of gyration, of a body that has a mass and no inertia
_TEN = ("m", "mx", "my", "mz", "xx", "yy", "zz", "xy", "xz", "yz")  # as in link_parameters


@dataclass(frozen=True)
class Body:
    """Mass, centre of mass, and inertia about it, in the frame after the link."""

    mass: float  # [kg]
    center: Floats  # shape=(3,) [m]
    inertia: Floats  # shape=(3, 3) [kg m^2]


@dataclass(frozen=True)
class Link:
    """A joint and what it moves."""

    name: str  # of the joint
    prismatic: bool
    axis: Floats  # shape=(3,) in the joint's frame
    before: Floats  # shape=(4, 4) [m] from the frame after the link before, joint zero included
    after: Floats  # shape=(4, 4) [m] from the joint's frame, moved, to the frame after the link
    body: Body
    ratio: float  # joint = ratio * reading
    drivers: tuple[tuple[str, float], ...]  # of a passive joint: joint = sum of weight * driver's joint
    lower: float  # [rad | m] of the simulator's joint
    upper: float
    speed_limit: float  # [rad/s | m/s] of the reading
    torque_limit: float  # [Nm | N] at the reading


@dataclass(frozen=True)
class Adjusted:
    """A body that cannot exist as it was fitted, and what was changed."""

    joint: str
    mass: float  # [kg] added
    inertia: float  # [kg m^2] largest principal moment of what was added
    reason: str


@dataclass(frozen=True)
class Chain:
    links: tuple[Link, ...]
    adjusted: tuple[Adjusted, ...]

    @property
    def driven(self) -> tuple[Link, ...]:
        return tuple(link for link in self.links if not link.drivers)


def chain_of(robot: _core.Robot) -> Chain:
    """Raises InputError for a robot without masses."""
    _core.validate_robot(robot)
    massless = [joint.name for joint in robot.joints if joint.mass is None]
    if massless:
        raise InputError(
            f"{robot.name or 'robot'}: no mass is known of the links of {', '.join(massless)},"
            " which a simulator needs: take a URDF with <inertial>, or state mass, center_of_mass and"
            " inertia in robot.yaml"
        )
    zeros: dict[str, float] = {}
    links: list[Link] = []
    adjusted: list[Adjusted] = []
    for joint in robot.joints:
        zero = (
            sum(weight * zeros[driver] for driver, weight in joint.driven_by)
            if joint.passive
            else joint.offset
        )
        zeros[joint.name] = zero
        before, after, axis = _fixed_frames(robot, joint)
        body, change = _possible(joint.name, _fitted_body(robot, joint))
        if change is not None:
            adjusted.append(change)
        ratio = 1.0 if joint.passive else joint.ratio
        ends = sorted((ratio * joint.lower, ratio * joint.upper))
        links.append(
            Link(
                name=joint.name,
                prismatic=joint.type == "prismatic",
                axis=axis,
                before=before @ _moved(axis, zero, joint.type == "prismatic"),
                after=after,
                body=body,
                ratio=ratio,
                drivers=tuple(joint.driven_by),
                lower=ends[0],
                upper=ends[1],
                speed_limit=joint.speed_limit,
                torque_limit=joint.torque_limit,
            )
        )
    return Chain(tuple(links), tuple(adjusted))


def _fixed_frames(robot: _core.Robot, joint: _core.Joint) -> tuple[Floats, Floats, Floats]:
    """Before and after the motion, and its axis. The motion of a (modified) DH joint is about or along z and
    commutes with theta and d: all of a DH link comes after it, of a modified DH link theta and d do."""
    identity = np.eye(4)
    if robot.convention == "urdf":
        return np.array(joint.T_parent_joint), identity, np.array(joint.axis)
    z = np.array([0.0, 0.0, 1.0])
    values = {"theta": joint.theta, "d": joint.d, "a": joint.a, "alpha": joint.alpha, "beta": joint.beta}
    if robot.convention == "dh":
        return identity, _link_frame("dh", values), z
    across = _link_frame("mdh", {**values, "theta": 0.0, "d": 0.0})
    along = _link_frame("mdh", {**values, "a": 0.0, "alpha": 0.0, "beta": 0.0})
    return across, along, z


def _link_frame(convention: str, values: dict[str, float]) -> Floats:
    one = _core.Robot("one", convention=convention, joints=[_core.Joint("J", **values)])  # type: ignore[arg-type]
    return np.array(_core.forward_kinematics(one, np.zeros(1))[0])


def _moved(axis: Floats, by: float, prismatic: bool) -> Floats:
    """shape=(4, 4): Rodrigues' formula, or a shift."""
    T = np.eye(4)
    if prismatic:
        T[:3, 3] = by * axis
    else:
        K = cross_matrix(axis)
        T[:3, :3] += np.sin(by) * K + (1.0 - np.cos(by)) * (K @ K)
    return T


def cross_matrix(v: Floats) -> Floats:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _steiner(mass: float, r: Floats) -> Floats:
    """What mass * r adds to an inertia that is taken about a point r away. shape=(3, 3) [kg m^2]"""
    return np.asarray(mass * (r @ r * np.eye(3) - np.outer(r, r)))


def _fitted_body(robot: _core.Robot, joint: _core.Joint) -> Body:
    """What the robot says, with the effects that are changes of bodies: link_inertia, and payload at the
    last."""
    number = [one.name for one in robot.joints].index(joint.name)
    ten = np.array(_core.link_parameters(robot))[10 * number : 10 * (number + 1)]
    last = number == len(robot.joints) - 1
    known = joint.inertia is not None
    for effect in robot.torque_effects:
        prefix = f"link_inertia.{joint.name}." if effect.effect == "link_inertia" else "payload."
        if effect.effect == "link_inertia" or (effect.effect == "payload" and last):
            part = np.array([effect.parameters.get(prefix + key, 0.0) for key in _TEN])
            ten += part
            known = known or bool(part.any())
    mass = float(ten[0])
    center = ten[1:4] / mass if mass != 0.0 else np.zeros(3)
    xx, yy, zz, xy, xz, yz = ten[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    # Of an inertia that nobody states rounding would be left.
    return Body(mass, center, about_origin - _steiner(mass, center) if known else np.zeros((3, 3)))


def _possible(joint: str, body: Body) -> tuple[Body, Adjusted | None]:
    """The nearest body that can exist with the same centre of mass: mass positive, second moments positive.

    A body of positive density has a positive definite pseudo-inertia (Wensing, Kim and Slotine 2018, eq. 6),
    which about the centre of mass is: mass > 0 and Sigma = tr(I) / 2 - I positive definite. Mass and centre
    are what gravity shows best, so they stay and the smallest eigenvalues of Sigma are raised.
    """
    mass = max(body.mass, _TINY_MASS)
    sigma = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    values, vectors = np.linalg.eigh(0.5 * (sigma + sigma.T))
    least = max(_LEAST * values[-1], _LEAST * mass * _TINY_RADIUS**2)
    if body.mass >= _TINY_MASS and values[0] >= least:
        return body, None
    raised = np.maximum(values, max(least, 0.0 if body.inertia.any() else mass * _TINY_RADIUS**2))
    sigma = vectors @ np.diag(raised) @ vectors.T
    inertia = np.trace(sigma) * np.eye(3) - sigma
    center = body.center if body.mass >= _TINY_MASS else np.zeros(3)
    reasons = []
    if body.mass < _TINY_MASS:
        reasons.append(f"its mass is {body.mass:.3g} kg")
    if values[0] < least:
        unknown = "no inertia is known of it"
        negative = f"a second moment about its centre of mass is {values[0]:.3g} kg m^2"
        reasons.append(negative if body.inertia.any() else unknown)
    change = float(np.abs(np.linalg.eigvalsh(inertia - body.inertia)).max())
    made = Body(mass, center, inertia)
    if body.mass >= _TINY_MASS and change <= 1e-6 * float(np.abs(body.inertia).max()):
        return made, None  # flat bodies: rounding
    return made, Adjusted(
        joint, mass - body.mass, change, f"the link behind {joint} cannot exist: " + ", ".join(reasons)
    )


def body_in(T: Floats, body: Body) -> Body:
    """A body of the frame after the link, in the joint's frame: T = after."""
    R = T[:3, :3]
    return Body(body.mass, R @ body.center + T[:3, 3], R @ body.inertia @ R.T)


def plain(values: float | Sequence[float] | Floats) -> str:
    """Numbers as text that reads back to the same doubles."""
    return " ".join(repr(float(v) + 0.0) for v in np.atleast_1d(np.asarray(values, dtype=float)))


def file_name(name: str) -> str:
    """A robot's name as a file's."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("._") or "robot"
