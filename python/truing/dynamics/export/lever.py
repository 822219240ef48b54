# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dry friction that goes with a joint's angle, as the friction of a tendon.

A tendon from a point far above the joint, on the link before it, to the end of a lever of length b on the
joint's own link has the length L with dL/dq = b sin(q - zero), but for b / distance. Its `frictionloss` F
holds the joint with F b |sin(q - zero)|: what gravity makes of friction that grows with the load, where the
link before does not tilt. MuJoCo has no other field whose friction goes with the state, and it needs no
further joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truing.dynamics.export.chain import Floats

LENGTH = 0.1  # [m] of the lever
DISTANCE = 10.0  # [m] of the other end
_ZEROS = 90  # angles tried for `zero`, in half a turn
_WORTH = 0.75  # of what Coulomb friction and damping leave: a lever that leaves more is not written

_ROUNDING = 1e-9  # of the largest friction: what least squares leave where nothing is left


@dataclass(frozen=True)
class Lever:
    """constant + slope |qd| + amplitude |sin(q - zero)|, at the simulator's joint."""

    constant: float  # [Nm]
    slope: float  # [Nm s/rad]
    amplitude: float  # [Nm], above zero
    zero: float  # [rad]
    left: float  # [Nm] root mean square of what it cannot do

    @property
    def force(self) -> float:
        """[N] the tendon's friction."""
        return self.amplitude / LENGTH


def lever_for(friction: Floats, q: Floats, qd: Floats) -> Lever | None:
    """The best lever by least squares, its slope not below zero (damping that pushes); none where Coulomb
    friction and damping are nearly as good.

    friction: without its sign [Nm]; q [rad] and qd [rad/s]: of the simulator's joint; all shape=(n,).
    """
    still, speed = np.ones_like(qd), np.abs(qd)
    _, without = _least_squares([still, speed], friction)
    if without <= _ROUNDING * float(np.abs(friction).max()):
        return None
    best: Lever | None = None
    for zero in np.arange(_ZEROS) * (np.pi / _ZEROS):
        turned = np.abs(np.sin(q - zero))
        (constant, amplitude, slope), left = _least_squares([still, turned, speed], friction)
        if slope < 0.0:
            (constant, amplitude), left = _least_squares([still, turned], friction)
            slope = 0.0
        if amplitude > 0.0 and (best is None or left < best.left):
            best = Lever(constant, slope, amplitude, float(zero), left)
    return best if best is not None and best.left < _WORTH * without else None


def _least_squares(columns: Sequence[Floats], wanted: Floats) -> tuple[list[float], float]:
    """Values, and the root mean square of what they leave."""
    table = np.column_stack(columns)
    values = np.linalg.lstsq(table, wanted, rcond=None)[0]
    return values.tolist(), float(np.sqrt(np.mean((wanted - table @ values) ** 2)))


def ends(axis: Floats, zero: float) -> tuple[Floats, Floats]:
    """Both ends of the tendon in the joint's frame, as it stands at zero: the far one, which stays with the
    link before, and the lever's, which turns with the joint. axis: shape=(3,). Returns shape=(3,) [m] twice.
    """
    across = np.eye(3)[int(np.argmin(np.abs(axis)))]
    u = np.cross(axis, across)
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    return DISTANCE * u, LENGTH * (np.cos(zero) * u - np.sin(zero) * v)
