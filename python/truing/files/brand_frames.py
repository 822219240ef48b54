# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames as robot makers write them: six or seven numbers, in the order, units and angles of each brand.

| brand | numbers | rotation |
| --- | --- | --- |
| kuka | X Y Z [mm], A B C [deg] | Rz(A) Ry(B) Rx(C) |
| fanuc | X Y Z [mm], W P R [deg] | Rz(R) Ry(P) Rx(W) |
| yaskawa | X Y Z [mm], Rx Ry Rz [deg] | Rz(Rz) Ry(Ry) Rx(Rx) |
| abb | x y z [mm], q1 q2 q3 q4 | quaternion, scalar first |
| ur | x y z [m], rx ry rz [rad] | rotation vector: axis times angle |

These are the data types FRAME (KUKA), pose and orient (ABB), pose (Universal Robots), and the Cartesian
positions of FANUC and Yaskawa, as their programming manuals define them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.limits import UNIT_LENGTH_OFF
from truing.rotations import (
    quaternions_from_rotations,
    rotations_from_angles,
    rotations_from_quaternions,
)

Floats = NDArray[np.float64]
Brand = Literal["kuka", "fanuc", "yaskawa", "abb", "ur"]
Kind = Literal["zyx", "xyz", "quaternion", "rotation-vector"]

_LOCKED = 1e-12  # cosine of the middle angle below which first and last turn about one axis


@dataclass(frozen=True)
class Notation:
    """How a brand writes a frame. length: metres in its unit. rotation: "zyx" has the turn about z first,
    "xyz" the turn about x, both mean Rz Ry Rx, in degrees; a rotation vector is in rad.
    """

    names: tuple[str, ...]
    length: float
    rotation: Kind


NOTATIONS: dict[Brand, Notation] = {
    "kuka": Notation(("X", "Y", "Z", "A", "B", "C"), 1e-3, "zyx"),
    "fanuc": Notation(("X", "Y", "Z", "W", "P", "R"), 1e-3, "xyz"),
    "yaskawa": Notation(("X", "Y", "Z", "Rx", "Ry", "Rz"), 1e-3, "xyz"),
    "abb": Notation(("x", "y", "z", "q1", "q2", "q3", "q4"), 1e-3, "quaternion"),
    "ur": Notation(("x", "y", "z", "rx", "ry", "rz"), 1.0, "rotation-vector"),
}


def frame_from_numbers(brand: Brand, numbers: Sequence[float]) -> Floats:
    """The frame, shape=(4, 4) [m], that numbers in the order of `NOTATIONS[brand].names` stand for.

    Raises InputError for another count, a number that is not finite, and a quaternion not of unit length.
    """
    notation = NOTATIONS[brand]
    values = np.asarray(numbers, dtype=np.float64)
    if values.shape != (len(notation.names),):
        raise InputError(
            f"a frame of {brand}: found {values.size} numbers, expected {' '.join(notation.names)}"
        )
    if not np.isfinite(values).all():
        raise InputError(f"a frame of {brand}: found {values.tolist()}, expected finite numbers")
    T = np.eye(4)
    T[:3, 3] = values[:3] * notation.length
    T[:3, :3] = _rotation(brand, notation, values[3:])
    return T


def _rotation(brand: Brand, notation: Notation, values: Floats) -> Floats:
    if notation.rotation == "quaternion":
        length = float(np.linalg.norm(values))
        if abs(length - 1) > UNIT_LENGTH_OFF:
            raise InputError(
                f"a frame of {brand}: the quaternion {values.tolist()} has length {length:.6g}, expected 1"
            )
        return np.asarray(rotations_from_quaternions(values[None])[0])
    if notation.rotation == "rotation-vector":
        return np.asarray(rotations_from_angles(values[None], "rotation-vector")[0])
    angles = np.radians(values if notation.rotation == "xyz" else values[::-1])
    return np.asarray(rotations_from_angles(angles[None], "zyx")[0])


def numbers_from_frame(brand: Brand, T: Floats, like: Sequence[float] | None = None) -> tuple[float, ...]:
    """A frame, shape=(4, 4) [m], as a brand writes it, in the order of `NOTATIONS[brand].names`.

    like: numbers of a frame nearby. Of the several ways to write one rotation (180 or -180 degrees, a
    quaternion or its negative, a rotation vector beyond half a turn) that nearest to these is taken. Without
    it angles are in (-180, 180], the middle one in [-90, 90], q1 is not negative, and a rotation vector is no
    longer than pi.
    """
    notation = NOTATIONS[brand]
    position = np.asarray(T)[:3, 3] / notation.length
    near = None if like is None else np.asarray(like, dtype=np.float64)[3:]
    rotation = np.asarray(T, dtype=np.float64)[:3, :3]
    if notation.rotation == "quaternion":
        turn = quaternions_from_rotations(rotation[None])[0]
        if near is not None and float(near @ turn) < 0:
            turn = -turn
    elif notation.rotation == "rotation-vector":
        turn = _rotation_vector(rotation, near)
    else:
        first_z = notation.rotation == "zyx"
        turn = _zyx(rotation, near if near is None or first_z else near[::-1])
        turn = turn if first_z else turn[::-1]
    return tuple(float(value) + 0.0 for value in (*position, *turn))  # + 0.0: no negative zero


def _zyx(rotation: Floats, near: Floats | None) -> Floats:
    """Angles about z, y, x [deg] with R = Rz Ry Rx; near: the same of a rotation nearby."""
    r = rotation
    cosine = math.hypot(r[0, 0], r[1, 0])
    if cosine > _LOCKED:
        z = math.atan2(r[1, 0], r[0, 0])
    else:  # z and x turn about one axis: either does
        z = 0.0 if near is None else math.radians(near[0])
    # The rest follows from Rz(z)' R = Ry Rx, which is well conditioned for every middle angle.
    c, s = math.cos(z), math.sin(z)
    y = math.atan2(-r[2, 0], c * r[0, 0] + s * r[1, 0])
    x = math.atan2(s * r[0, 2] - c * r[1, 2], c * r[1, 1] - s * r[0, 1])
    found = np.degrees([z, y, x])
    found = np.where(found == -180.0, 180.0, found)
    if near is None:
        return found
    # The other way to write it: half a turn about z, the middle angle from the other side.
    other = np.array([found[0] + 180, 180 - found[1], found[2] + 180])
    ways = [way + 360 * np.round((near - way) / 360) for way in (found, other)]
    return min(ways, key=lambda way: float(np.abs(way - near).sum()))


def _rotation_vector(rotation: Floats, near: Floats | None) -> Floats:
    """Axis times angle [rad], exact also near half a turn; near: the same of a rotation nearby."""
    q = quaternions_from_rotations(rotation[None])[0]
    sine = float(np.linalg.norm(q[1:]))
    if sine < 1e-12:  # below, the vector is twice the quaternion's to the last digit
        return 2 * q[1:] if near is None else _nearest_turn(near)
    axis, angle = q[1:] / sine, 2 * math.atan2(sine, q[0])
    if near is not None:
        angle += 2 * math.pi * round((float(near @ axis) - angle) / (2 * math.pi))
    return np.asarray(axis * angle)


def _nearest_turn(near: Floats) -> Floats:
    """No rotation at all, written with as many whole turns as `near` has."""
    length = float(np.linalg.norm(near))
    turns = round(length / (2 * math.pi))
    return np.zeros(3) if turns == 0 else near / length * (2 * math.pi * turns)
