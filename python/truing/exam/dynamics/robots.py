# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Arms with masses that sit the dynamic half: plausible ones of several sizes, no maker's product.

Development and examination have none in common.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Link:
    """A rigid body in the frame of the joint that moves it."""

    mass: float  # [kg]
    com: Floats  # shape=(3,) [m]
    inertia: Floats  # shape=(3, 3) [kg m^2] about the centre of mass


@dataclass(frozen=True)
class Arm:
    """A serial arm of hinges. Joint j stands at origins[j] in the frame of joint j-1, frames parallel at
    zero.
    """

    name: str
    origins: Floats  # shape=(n, 3) [m]
    axes: Floats  # shape=(n, 3)
    links: tuple[Link, ...]
    reach: Floats  # shape=(n,) [rad] largest angle to both sides
    speed: Floats  # shape=(n,) [rad/s] largest
    coulomb: Floats  # shape=(n,) [Nm] as is usual for such a drive
    viscous: Floats  # shape=(n,) [Nm s/rad]
    tool: Floats  # shape=(3,) [m] in the frame of the last joint
    payload: float  # [kg] rated

    @property
    def n(self) -> int:
        return len(self.links)

    @property
    def names(self) -> list[str]:
        return [f"J{k + 1}" for k in range(self.n)]


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _rod(mass: float, com: tuple[float, float, float], length: float, radius: float) -> Link:
    """A cylinder about its centre of mass, along its own lever, a little askew as castings are."""
    center = np.array(com)
    along = center / np.linalg.norm(center) if np.linalg.norm(center) > 1e-6 else np.array([0.0, 0.0, 1.0])
    thin, thick = mass * (3 * radius**2 + length**2) / 12.0, mass * radius**2 / 2.0
    inertia = thin * np.eye(3) + (thick - thin) * np.outer(along, along)
    skew = np.array([[0.0, 1.0, -0.6], [1.0, 0.0, 0.8], [-0.6, 0.8, 0.0]])
    return Link(mass, center, inertia + 0.04 * thick * skew)


def arm_of(
    name: str,
    axes: str,
    origins: list[tuple[float, float, float]],
    links: list[tuple[float, tuple[float, float, float], float, float]],
    reach: list[float],
    speed: list[float],
    coulomb: list[float],
    viscous: list[float],
    tool: tuple[float, float, float],
    payload: float,
) -> Arm:
    """An arm from tables: links are (mass [kg], centre of mass [m], length [m], radius [m])."""
    return Arm(
        name,
        np.array(origins),
        np.array([_AXES[axis] for axis in axes]),
        tuple(_rod(*link) for link in links),
        reach=np.array(reach),
        speed=np.array(speed),
        coulomb=np.array(coulomb),
        viscous=np.array(viscous),
        tool=np.array(tool),
        payload=payload,
    )


_DEVELOPMENT = (
    arm_of(
        "shop",
        "zyyyzy",
        [(0, 0, 0.19), (0, 0.14, 0), (0, -0.12, 0.57), (0, 0, 0.52), (0, 0.11, 0), (0, 0, 0.11)],
        [
            (7.1, (0.0, 0.03, -0.02), 0.16, 0.08),
            (12.4, (0.02, 0.0, 0.26), 0.60, 0.07),
            (5.2, (-0.01, 0.01, 0.24), 0.50, 0.05),
            (2.1, (0.0, 0.05, 0.01), 0.12, 0.05),
            (1.9, (0.01, 0.0, 0.05), 0.11, 0.05),
            (1.3, (0.012, 0.04, 0.03), 0.09, 0.045),
        ],
        [2.8, 1.6, 2.2, 2.4, 2.4, 2.8],
        [1.7, 1.5, 1.8, 2.2, 2.2, 2.4],
        [9.5, 10.5, 6.5, 2.2, 1.9, 1.6],
        [14.0, 15.0, 9.0, 2.4, 2.1, 1.7],
        (0.0, 0.09, 0.0),
        8.0,
    ),
    arm_of(
        "slim",
        "zyzyzyz",
        [(0, 0, 0.31), (0, 0, 0), (0, 0, 0.33), (0.06, 0, 0), (-0.06, 0, 0.36), (0, 0, 0), (0.08, 0, 0.1)],
        [
            (3.4, (0.0, 0.02, -0.06), 0.2, 0.06),
            (3.6, (0.01, 0.0, 0.09), 0.2, 0.06),
            (2.9, (0.03, 0.0, -0.06), 0.18, 0.05),
            (2.6, (-0.04, 0.01, 0.10), 0.18, 0.05),
            (2.4, (0.0, 0.03, -0.11), 0.22, 0.05),
            (1.5, (0.05, 0.0, 0.02), 0.12, 0.045),
            (0.9, (0.015, 0.02, 0.06), 0.09, 0.04),
        ],
        [2.5, 1.5, 2.4, 1.9, 2.5, 1.8, 2.6],
        [1.8, 1.7, 1.9, 2.0, 2.3, 2.3, 2.6],
        [2.6, 3.0, 2.1, 1.8, 0.9, 0.8, 0.5],
        [3.0, 3.2, 2.2, 1.9, 0.7, 0.6, 0.35],
        (0.0, 0.0, 0.1),
        3.0,
    ),
    arm_of(
        "bench",
        "zyy",
        [(0, 0, 0.22), (0, 0.05, 0), (0, -0.02, 0.31)],
        [
            (2.6, (0.01, 0.02, 0.03), 0.12, 0.06),
            (2.2, (0.01, 0.0, 0.13), 0.32, 0.035),
            (1.2, (0.012, 0.01, 0.11), 0.28, 0.03),
        ],
        [2.6, 1.5, 2.2],
        [2.4, 2.2, 2.6],
        [1.1, 1.2, 0.7],
        [0.8, 0.9, 0.45],
        (0.0, 0.0, 0.26),
        1.0,
    ),
    arm_of(
        "swing",
        "yy",
        [(0, 0, 0.9), (0, 0.04, -0.45)],
        [(4.4, (0.01, 0.02, -0.2), 0.48, 0.04), (2.3, (0.02, 0.0, -0.17), 0.4, 0.03)],
        [1.9, 2.2],
        [2.2, 2.8],
        [1.8, 0.9],
        [1.5, 0.5],
        (0.0, 0.0, -0.36),
        1.5,
    ),
)

_EXAMINATION = (
    arm_of(
        "yard",
        "zyyxyx",
        [(0, 0, 0.45), (0.16, 0, 0), (0, 0, 0.68), (0.28, 0, 0.14), (0.42, 0, 0), (0.1, 0, 0)],
        [
            (46.0, (0.05, -0.03, -0.08), 0.4, 0.16),
            (38.0, (0.02, -0.06, 0.29), 0.75, 0.10),
            (29.0, (0.07, 0.03, 0.10), 0.3, 0.11),
            (11.5, (0.14, 0.01, 0.0), 0.42, 0.07),
            (4.6, (0.03, 0.02, 0.01), 0.14, 0.05),
            (1.6, (0.05, 0.012, 0.02), 0.08, 0.05),
        ],
        [2.7, 1.3, 1.7, 2.9, 1.9, 3.0],
        [1.9, 1.6, 1.9, 2.8, 2.7, 3.4],
        [38.0, 46.0, 29.0, 8.5, 6.0, 3.4],
        [52.0, 60.0, 31.0, 7.0, 4.8, 2.1],
        (0.12, 0.0, 0.0),
        20.0,
    ),
    arm_of(
        "reach",
        "zyzyzyx",
        [(0, 0, 0.36), (0, 0, 0), (0, 0.01, 0.42), (0, 0, 0), (0, -0.01, 0.40), (0, 0, 0), (0, 0, 0.13)],
        [
            (5.6, (0.01, -0.02, -0.07), 0.24, 0.07),
            (6.2, (0.0, 0.04, 0.12), 0.26, 0.07),
            (4.3, (0.01, 0.02, -0.09), 0.22, 0.06),
            (4.0, (0.01, -0.03, 0.11), 0.24, 0.06),
            (2.8, (0.0, 0.02, -0.10), 0.22, 0.055),
            (2.2, (0.01, 0.01, 0.05), 0.14, 0.05),
            (1.1, (0.04, 0.015, 0.02), 0.08, 0.045),
        ],
        [2.6, 1.6, 2.6, 1.9, 2.6, 1.7, 2.6],
        [1.6, 1.5, 1.7, 1.8, 2.1, 2.1, 2.4],
        [5.2, 5.8, 3.9, 3.6, 1.8, 1.5, 0.9],
        [6.4, 7.0, 4.4, 4.1, 1.7, 1.3, 0.6],
        (0.1, 0.0, 0.0),
        7.0,
    ),
    arm_of(
        "crane",
        "zyx",
        [(0, 0, 0.6), (0.1, 0, 0), (0.5, 0.03, 0)],
        [
            (14.0, (0.03, 0.01, -0.05), 0.3, 0.1),
            (8.5, (0.22, 0.02, 0.02), 0.55, 0.06),
            (2.4, (0.08, 0.03, 0.02), 0.18, 0.05),
        ],
        [2.9, 1.2, 2.9],
        [1.5, 1.3, 2.6],
        [7.0, 8.0, 1.6],
        [9.0, 8.5, 1.1],
        (0.2, 0.05, 0.0),
        5.0,
    ),
    arm_of(
        "fork",
        "yx",
        [(0, 0, 0.7), (0.4, 0.0, 0.0)],
        [(7.6, (0.19, 0.02, 0.01), 0.42, 0.05), (2.1, (0.1, 0.05, 0.03), 0.24, 0.04)],
        [1.7, 2.8],
        [1.9, 2.6],
        [4.1, 1.0],
        [3.6, 0.8],
        (0.24, 0.08, 0.0),
        3.0,
    ),
)


def arms(which: str) -> tuple[Arm, ...]:
    return _DEVELOPMENT if which == "development" else _EXAMINATION


def loaded(arm: Arm, mass: float, com: Floats) -> Arm:
    """With a payload, a point mass in the frame of the last joint, fixed to the last link."""
    last = arm.links[-1]
    whole = last.mass + mass
    center = (last.mass * last.com + mass * com) / whole
    inertia = last.inertia + _steiner(last.mass, last.com - center) + _steiner(mass, com - center)
    return replace(arm, links=(*arm.links[:-1], Link(whole, center, inertia)))


def _steiner(mass: float, offset: Floats) -> Floats:
    return np.asarray(mass * (offset @ offset * np.eye(3) - np.outer(offset, offset)))


def misjudged(arm: Arm, rng: Generator, low: float, high: float, only: int | None = None) -> Arm:
    """Inertials that are wrong by shares between low and high: masses, centres, inertias, each still a
    body's. only: of this link alone.
    """

    def off() -> float:
        return 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))

    links = list(arm.links)
    for k, link in enumerate(arm.links):
        if only is not None and k != only:
            continue
        factor = off()
        center = link.com * np.array([off(), off(), off()])
        links[k] = Link(link.mass * factor, center, link.inertia * factor * off())
    return replace(arm, links=tuple(links))
