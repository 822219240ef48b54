# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The robot as simulators hold one: fixed frames between plain joints, and bodies that can exist.

Joint zeros are in the frames (`truing.chains`), so that a simulator's joint is at `ratio * reading`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.chains import fixed_frames
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
    links: list[Link] = []
    adjusted: list[Adjusted] = []
    for frames in fixed_frames(robot):
        joint = frames.joint
        body, change = _possible(joint.name, _fitted_body(robot, joint))
        if change is not None:
            adjusted.append(change)
        ratio = 1.0 if joint.passive else joint.ratio
        ends = sorted((ratio * joint.lower, ratio * joint.upper))
        links.append(
            Link(
                name=joint.name,
                prismatic=joint.type == "prismatic",
                axis=frames.axis,
                before=frames.before,
                after=frames.after,
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
