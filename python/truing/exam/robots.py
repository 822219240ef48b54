# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The robots that sit the examination: plausible arms of several sizes and makes, no maker's product.

Development and examination have none in common, so that nothing tuned on the first knows the second.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import truing

_R = math.pi / 2


@dataclass(frozen=True)
class Specimen:
    """A robot as it leaves the factory, and what its data sheet says besides."""

    robot: truing.Robot  # nominal, with masses
    payload: float  # rated [kg]
    rod_arm: float = 0.0  # distance of a palletizer's rods from its arms [m]; 0: no rods

    @property
    def name(self) -> str:
        return self.robot.name

    @property
    def wrist(self) -> bool:
        """Whether the last three joints turn and are driven: they may drag each other along."""
        return (
            all(joint.type == "revolute" and not joint.passive for joint in self.robot.joints[-3:])
            and len(self.robot.joints) >= 6
        )


Row = tuple[str, float, float, float, float, tuple[float, float], float, tuple[float, float, float]]
"""name, theta, d, a, alpha, limits, mass, com"""


def _joints(
    rows: Sequence[Row],
    prismatic: Sequence[str] = (),
    passive: Mapping[str, Mapping[str, float]] | None = None,
) -> list[truing.Joint]:
    driven_by = passive or {}
    made = []
    for name, theta, d, a, alpha, (lower, upper), mass, com in rows:
        drivers = tuple(driven_by.get(name, {}).items())
        limits = {} if drivers else {"lower": lower, "upper": upper}
        made.append(
            truing.Joint(
                name,
                type="prismatic" if name in prismatic else "revolute",
                theta=theta,
                d=d,
                a=a,
                alpha=alpha,
                driven_by=drivers,
                mass=mass,
                center_of_mass=com,
                **limits,
            )
        )
    return made


def _target(name: str, xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> truing.Target:
    return truing.Target(name, truing.frame_from_xyz_rpy(xyz, rpy))


def _compact() -> Specimen:
    """A table-top arm of 0.6 m reach."""
    joints = _joints(
        [
            ("J1", 0.0, 0.31, 0.0, -_R, (-2.8, 2.8), 6.5, (0.0, 0.10, -0.01)),
            ("J2", -_R, 0.0, 0.28, 0.0, (-1.8, 1.8), 5.0, (-0.13, 0.005, 0.02)),
            ("J3", 0.0, 0.0, 0.075, -_R, (-1.8, 1.1), 4.2, (-0.03, -0.01, 0.02)),
            ("J4", 0.0, 0.30, 0.0, _R, (-2.7, 2.7), 2.6, (0.0, -0.12, 0.0)),
            ("J5", 0.0, 0.0, 0.0, -_R, (-2.0, 2.0), 1.1, (0.0, 0.0, 0.015)),
            ("J6", 0.0, 0.08, 0.0, 0.0, (-3.1, 3.1), 0.5, (0.0, 0.004, -0.02)),
        ]
    )
    targets = [_target("tool", (0.04, 0.01, 0.09)), _target("smr2", (-0.03, 0.04, 0.06))]
    return Specimen(truing.Robot("compact", joints=joints, targets=targets), payload=3.0)


def _seven() -> Specimen:
    """A light arm with seven joints, 1.0 m, in modified DH."""
    limits = ((-2.8, 2.8), (-1.7, 1.7), (-2.8, 2.8), (-2.9, -0.2), (-2.8, 2.8), (0.1, 3.5), (-2.8, 2.8))
    joints = _joints(
        [
            ("A1", 0.0, 0.34, 0.0, 0.0, limits[0], 4.1, (0.003, -0.03, -0.08)),
            ("A2", 0.0, 0.0, 0.0, -_R, limits[1], 3.9, (-0.003, -0.06, 0.03)),
            ("A3", 0.0, 0.36, 0.0, _R, limits[2], 3.3, (0.03, 0.03, -0.06)),
            ("A4", 0.0, 0.0, 0.075, _R, limits[3], 3.4, (-0.05, 0.10, 0.03)),
            ("A5", 0.0, 0.39, -0.075, -_R, limits[4], 3.2, (-0.01, 0.04, -0.10)),
            ("A6", 0.0, 0.0, 0.0, _R, limits[5], 1.6, (0.06, -0.01, -0.01)),
            ("A7", 0.0, 0.12, 0.09, _R, limits[6], 0.7, (0.01, 0.01, 0.06)),
        ]
    )
    targets = [_target("tool", (0.05, -0.02, 0.12), (0.1, 0.0, 0.4)), _target("smr2", (-0.05, 0.03, 0.10))]
    return Specimen(truing.Robot("seven", joints=joints, targets=targets, convention="mdh"), payload=4.0)


def _foundry() -> Specimen:
    """A floor-mounted arm of 1.8 m, in modified DH."""
    joints = _joints(
        [
            ("J1", 0.0, 0.52, 0.0, 0.0, (-2.9, 2.9), 130.0, (0.05, 0.02, -0.12)),
            ("J2", -_R, 0.0, 0.16, -_R, (-1.1, 1.3), 62.0, (0.35, 0.02, 0.05)),
            ("J3", 0.0, 0.0, 0.78, 0.0, (-1.3, 1.2), 58.0, (0.06, -0.02, 0.03)),
            ("J4", 0.0, 0.86, 0.13, -_R, (-2.8, 2.8), 24.0, (0.0, 0.01, -0.30)),
            ("J5", 0.0, 0.0, 0.0, _R, (-2.0, 2.0), 9.0, (0.0, 0.03, 0.01)),
            ("J6", 0.0, 0.14, 0.0, -_R, (-3.1, 3.1), 4.0, (0.0, 0.01, -0.02)),
        ]
    )
    targets = [_target("tool", (0.10, 0.03, 0.20)), _target("smr2", (-0.08, 0.10, 0.15))]
    return Specimen(truing.Robot("foundry", joints=joints, targets=targets, convention="mdh"), payload=45.0)


def _stacker() -> Specimen:
    """A palletizer of 2.2 m: two rods keep its wrist level."""
    joints = _joints(
        [
            ("J1", 0.0, 0.66, 0.20, -_R, (-2.6, 2.6), 300.0, (-0.08, 0.10, 0.0)),
            ("J2", -_R, 0.0, 0.95, 0.0, (-0.7, 1.1), 160.0, (-0.45, 0.0, 0.04)),
            ("J3", _R, 0.0, 1.05, 0.0, (-0.9, 1.0), 120.0, (-0.60, 0.0, -0.04)),
            ("J4", 0.0, 0.0, 0.18, _R, (0.0, 0.0), 35.0, (-0.08, 0.0, 0.0)),
            ("J5", 0.0, -0.16, 0.0, 0.0, (-3.0, 3.0), 20.0, (0.0, 0.01, 0.04)),
        ],
        passive={"J4": {"J2": -1.0, "J3": -1.0}},
    )
    targets = [_target("tool", (0.14, 0.06, -0.10)), _target("smr2", (-0.10, 0.12, -0.08))]
    return Specimen(truing.Robot("stacker", joints=joints, targets=targets), payload=60.0, rod_arm=0.25)


def _bench() -> Specimen:
    """An arm with an offset wrist, 0.95 m."""
    joints = _joints(
        [
            ("B1", 0.0, 0.152, 0.0, _R, (-3.0, 3.0), 7.4, (0.0, -0.02, 0.0)),
            ("B2", 0.0, 0.0, -0.425, 0.0, (-2.6, -0.4), 13.0, (0.21, 0.0, 0.11)),
            ("B3", 0.0, 0.0, -0.392, 0.0, (-2.2, 2.2), 4.0, (0.15, 0.0, 0.03)),
            ("B4", 0.0, 0.131, 0.0, _R, (-3.0, 3.0), 2.1, (0.0, -0.004, 0.01)),
            ("B5", 0.0, 0.100, 0.0, -_R, (-2.6, 2.6), 2.0, (0.0, 0.004, 0.01)),
            ("B6", 0.0, 0.099, 0.0, 0.0, (-3.0, 3.0), 0.6, (0.0, 0.0, -0.02)),
        ]
    )
    targets = [_target("tool", (0.05, 0.03, 0.08)), _target("smr2", (-0.06, 0.02, 0.05))]
    return Specimen(truing.Robot("bench", joints=joints, targets=targets), payload=5.0)


def _heavy() -> Specimen:
    """A heavy arm of 2.6 m."""
    joints = _joints(
        [
            ("J1", 0.0, 0.78, 0.32, -_R, (-2.7, 2.7), 420.0, (-0.10, 0.12, 0.03)),
            ("J2", -_R, 0.0, 1.10, 0.0, (-1.0, 1.2), 190.0, (-0.60, 0.02, -0.08)),
            ("J3", 0.0, 0.0, -0.05, -_R, (-1.2, 1.1), 170.0, (0.10, -0.05, 0.12)),
            ("J4", 0.0, 1.19, 0.0, _R, (-3.0, 3.0), 75.0, (0.0, -0.50, 0.01)),
            ("J5", 0.0, 0.0, 0.0, -_R, (-2.0, 2.0), 34.0, (0.0, 0.01, 0.04)),
            ("J6", 0.0, 0.215, 0.0, 0.0, (-3.1, 3.1), 12.0, (0.0, 0.01, -0.03)),
        ]
    )
    targets = [_target("tool", (0.15, -0.05, 0.22)), _target("smr2", (-0.12, 0.14, 0.18))]
    return Specimen(truing.Robot("heavy", joints=joints, targets=targets), payload=120.0)


def _rail() -> Specimen:
    """An arm of 1.3 m on a rail of 2.4 m. The rail lies along z of the base, so gravity points along y."""
    joints = _joints(
        [
            ("rail", 0.0, 0.0, 0.10, _R, (-1.2, 1.2), 250.0, (0.0, -0.1, 0.0)),
            ("J1", 0.0, 0.40, 0.09, -_R, (-2.8, 2.8), 55.0, (-0.03, 0.08, 0.01)),
            ("J2", -_R, 0.0, 0.56, 0.0, (-1.4, 1.5), 32.0, (-0.28, 0.01, 0.06)),
            ("J3", 0.0, 0.0, 0.10, -_R, (-1.7, 1.1), 27.0, (-0.05, -0.02, 0.05)),
            ("J4", 0.0, 0.62, 0.0, _R, (-2.8, 2.8), 12.0, (0.0, -0.25, 0.0)),
            ("J5", 0.0, 0.0, 0.0, -_R, (-2.0, 2.0), 5.0, (0.0, 0.01, 0.02)),
            ("J6", 0.0, 0.10, 0.0, 0.0, (-3.1, 3.1), 2.0, (0.0, 0.005, -0.02)),
        ],
        prismatic=["rail"],
    )
    targets = [_target("tool", (0.07, 0.02, 0.14)), _target("smr2", (-0.06, 0.07, 0.10))]
    robot = truing.Robot("rail", joints=joints, targets=targets, gravity=(0.0, 9.81, 0.0))
    return Specimen(robot, payload=15.0)


def _layer_picker() -> Specimen:
    """A palletizer of 3 m, in modified DH."""
    joints = _joints(
        [
            ("J1", 0.0, 0.85, 0.0, 0.0, (-2.7, 2.7), 520.0, (0.10, 0.02, -0.2)),
            ("J2", -_R, 0.0, 0.35, -_R, (-0.6, 1.2), 330.0, (0.62, 0.0, 0.05)),
            ("J3", _R, 0.0, 1.25, 0.0, (-1.0, 1.0), 250.0, (0.60, 0.0, -0.05)),
            ("J4", 0.0, 0.0, 1.45, 0.0, (0.0, 0.0), 60.0, (0.12, 0.0, 0.0)),
            ("J5", 0.0, -0.25, 0.24, _R, (-3.0, 3.0), 40.0, (0.01, 0.0, 0.03)),
        ],
        passive={"J4": {"J2": -1.0, "J3": -1.0}},
    )
    targets = [_target("tool", (0.18, -0.07, -0.12)), _target("smr2", (-0.15, 0.10, -0.10))]
    return Specimen(
        truing.Robot("layer-picker", joints=joints, targets=targets, convention="mdh"),
        payload=150.0,
        rod_arm=0.34,
    )


def _long_seven() -> Specimen:
    """Seven joints with offsets everywhere, 1.2 m, standard DH."""
    limits = ((-2.7, 2.7), (-1.6, 1.6), (-2.7, 2.7), (-2.0, 2.0), (-2.7, 2.7), (-1.9, 1.9), (-3.0, 3.0))
    joints = _joints(
        [
            ("A1", 0.0, 0.42, 0.03, -_R, limits[0], 9.0, (0.0, 0.12, 0.01)),
            ("A2", 0.0, 0.0, -0.03, _R, limits[1], 8.0, (0.01, 0.02, 0.15)),
            ("A3", 0.0, 0.46, 0.05, _R, limits[2], 6.0, (-0.02, 0.08, 0.02)),
            ("A4", 0.0, 0.0, -0.05, -_R, limits[3], 5.5, (0.02, 0.0, 0.12)),
            ("A5", 0.0, 0.44, 0.0, -_R, limits[4], 3.8, (0.0, 0.10, 0.02)),
            ("A6", 0.0, 0.0, 0.08, _R, limits[5], 2.6, (-0.03, 0.01, 0.01)),
            ("A7", 0.0, 0.15, 0.0, 0.0, limits[6], 1.0, (0.0, 0.0, -0.03)),
        ]
    )
    targets = [_target("tool", (0.06, 0.04, 0.10)), _target("smr2", (-0.07, 0.01, 0.08))]
    return Specimen(truing.Robot("long-seven", joints=joints, targets=targets), payload=8.0)


def specimens(which: str) -> list[Specimen]:
    """The robots of "development" or "examination"."""
    if which == "development":
        return [_compact(), _seven(), _foundry(), _stacker()]
    return [_bench(), _heavy(), _rail(), _layer_picker(), _long_seven()]
