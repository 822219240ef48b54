# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Data sheets of common arms: the link table that a controller's calibration file adds to, or leaves out.

Sources. Universal Robots: "DH parameters for calculations of kinematics and dynamics" of the maker's support
pages, masses and centres of mass included; working range of the data sheets. ABB: product specifications, as
drawn in the joint origins of ros-industrial/abb (irb120_3_58, irb1200_5_90, irb1200_7_70, irb4600_40_255);
limits of the same. Convention `dh`; the last frame is the maker's flange (UR flange, ABB tool0).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from truing import _core

UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_TURN = 2 * math.pi


@dataclass(frozen=True)
class Row:
    """One link of a data sheet. theta, alpha, limits [rad]; d, a [m]; mass [kg], centre of mass [m]."""

    theta: float
    d: float
    a: float
    alpha: float
    lower: float
    upper: float
    mass: float | None = None
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Arm:
    """A robot as its maker draws it. types: how the controller's files call it."""

    name: str
    maker: str
    joints: tuple[str, ...]
    rows: tuple[Row, ...]
    types: tuple[str, ...] = ()

    def robot(self) -> _core.Robot:
        """The robot of the data sheet, its tool at the flange."""
        return _core.Robot(
            self.name, joints=[joint_of(name, row) for name, row in zip(self.joints, self.rows, strict=True)]
        )


def joint_of(name: str, row: Row, beta: float = 0.0) -> _core.Joint:
    return _core.Joint(
        name,
        theta=row.theta,
        d=row.d,
        a=row.a,
        alpha=row.alpha,
        beta=beta,
        lower=row.lower,
        upper=row.upper,
        mass=row.mass,
        center_of_mass=row.com,
    )


def _ur(
    name: str,
    lengths: tuple[float, float, float, float, float, float],
    masses: Sequence[float | None],
    coms: Sequence[tuple[float, float, float]],
) -> Arm:
    """lengths: d1, a2, a3, d4, d5, d6 [m]."""
    d1, a2, a3, d4, d5, d6 = lengths
    quarter = math.pi / 2
    table = ((d1, 0, quarter), (0, a2, 0), (0, a3, 0), (d4, 0, quarter), (d5, 0, -quarter), (d6, 0, 0))
    rows = [
        Row(0.0, float(d), float(a), float(alpha), -_TURN, _TURN, mass, com)
        for (d, a, alpha), mass, com in zip(table, masses, coms, strict=True)
    ]
    return Arm(name, "Universal Robots", UR_JOINTS, tuple(rows))


def _abb(
    name: str,
    types: tuple[str, ...],
    lengths: tuple[float, float, float, float, float, float],
    limits: Sequence[tuple[float, float]],
) -> Arm:
    """lengths: height, and from J1 to J2, J2 to J3, J3 to J4, J4 to J5, J5 to the flange [mm]; limits
    [deg].
    """
    d1, a1, a2, a3, d4, d6 = (1e-3 * length for length in lengths)
    table = (
        (0, d1, a1, -90),
        (-90, 0, a2, 0),
        (0, 0, a3, -90),
        (0, d4, 0, 90),
        (0, 0, 0, -90),
        (180, d6, 0, 0),
    )
    rows = [
        Row(math.radians(t), d, a, math.radians(alpha), math.radians(low), math.radians(high))
        for (t, d, a, alpha), (low, high) in zip(table, limits, strict=True)
    ]
    return Arm(name, "ABB", tuple(f"J{k}" for k in range(1, 7)), tuple(rows), types)


_UR5_COMS = (
    (0.0, -0.02561, 0.00193),
    (0.2125, 0.0, 0.11336),
    (0.15, 0.0, 0.0265),
    (0.0, -0.0018, 0.01634),
    (0.0, 0.0018, 0.01634),
    (0.0, 0.0, -0.001159),
)
_UR3_COMS = (
    (0.0, -0.02, 0.0),
    (0.13, 0.0, 0.1157),
    (0.05, 0.0, 0.0238),
    (0.0, 0.0, 0.01),
    (0.0, 0.0, 0.01),
    (0.0, 0.0, -0.02),
)
_UR10_COMS = (
    (0.021, 0.0, 0.027),
    (0.38, 0.0, 0.158),
    (0.24, 0.0, 0.068),
    (0.0, 0.007, 0.018),
    (0.0, 0.007, 0.018),
    (0.0, 0.0, -0.026),
)
_UR16_COMS = (
    (0.0, -0.016, 0.03),
    (0.302, 0.0, 0.16),
    (0.194, 0.0, 0.065),
    (0.0, -0.009, 0.011),
    (0.0, 0.018, 0.012),
    (0.0, 0.0, -0.044),
)
_UR20_COMS = (
    (0.0, -0.061, 0.0062),
    (0.5226, 0.0, 0.2098),
    (0.3234, 0.0, 0.0604),
    (0.0, -0.0026, 0.0393),
    (0.0, 0.0024, 0.0379),
    (0.0, 0.0, -0.0293),
)

_ARMS = (
    _ur(
        "ur3",
        (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819),
        (2.0, 3.42, 1.26, 0.8, 0.8, 0.35),
        _UR3_COMS,
    ),
    _ur(
        "ur5",
        (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
        (3.7, 8.393, 2.33, 1.219, 1.219, 0.1879),
        _UR5_COMS,
    ),
    _ur(
        "ur10",
        (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
        (7.1, 12.7, 4.27, 2.0, 2.0, 0.365),
        _UR10_COMS,
    ),
    _ur(
        "ur3e",
        (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
        (1.98, 3.4445, 1.437, 0.871, 0.805, 0.261),
        _UR3_COMS,
    ),
    _ur(
        "ur5e",
        (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
        (3.761, 8.058, 2.846, 1.37, 1.3, 0.365),
        _UR5_COMS,
    ),
    _ur(
        "ur10e",
        (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
        (7.369, 13.051, 3.989, 2.1, 1.98, 0.615),
        _UR10_COMS,
    ),
    _ur(
        "ur16e",
        (0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655),
        (7.369, 10.45, 4.321, 2.18, 2.033, 0.907),
        _UR16_COMS,
    ),
    _ur(
        "ur20",
        (0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543),
        (16.343, 29.632, 7.879, 3.054, 3.126, 0.926),
        _UR20_COMS,
    ),
    _ur(
        "ur30",
        (0.2363, -0.637, -0.5037, 0.201, 0.1593, 0.1543),
        (None,) * 6,
        ((0.0, 0.0, 0.0),) * 6,
    ),
    _abb(
        "irb120",
        ("120_0.58_3",),
        (290, 0, 270, 70, 302, 72),
        ((-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)),
    ),
    _abb(
        "irb1200-5",
        ("1200_0.9_5",),
        (399.1, 0, 448, 42, 451, 82),
        ((-170, 170), (-100, 130), (-200, 70), (-270, 270), (-130, 130), (-400, 400)),
    ),
    _abb(
        "irb1200-7",
        ("1200_0.7_7",),
        (399.1, 0, 350, 42, 351, 82),
        ((-170, 170), (-100, 135), (-200, 70), (-270, 270), (-130, 130), (-400, 400)),
    ),
    _abb(
        "irb4600-40",
        ("4600_2.55_40",),
        (495, 175, 1095, 175, 1270, 135),
        ((-180, 180), (-90, 150), (-180, 75), (-400, 400), (-125, 120), (-400, 400)),
    ),
)

ARMS: dict[str, Arm] = {arm.name: arm for arm in _ARMS}
"""Arms by name, as `--arm` takes them."""


def arms_of(maker: str) -> list[Arm]:
    return [arm for arm in _ARMS if arm.maker == maker]
