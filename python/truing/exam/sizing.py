# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How large an effect looks once base and tool are fitted, and which other effects look the same.

Linear: small changes move the tip by their columns (`site_columns`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from truing.exam import laws
from truing.exam.kinematics import ALPHA, BETA, A, Changes, D, Floats, side_of, site_columns
from truing.exam.laws import Context, Hidden

SAME = 0.98
"""Share of an effect's look from which on another one explains it: nobody is asked to tell them apart."""
_RANK = 1e-5


class View:
    """What is seen of a change of the robot after base and tool (and geometry) are fitted."""

    def __init__(self, context: Context, geometry: bool = False) -> None:
        self.context = context
        self.columns = site_columns(context.state)
        self.frames = _orthonormal(self._frame_columns() + (self.geometry_columns() if geometry else []))

    def look(self, moved: Floats) -> Floats:
        """The part of a displacement of all rows, shape=(n, 3), that no fitted frame takes away. Flat."""
        flat = moved.ravel()
        return np.asarray(flat - self.frames @ (self.frames.T @ flat))

    def rms(self, moved: Floats) -> float:
        """Root mean square length of what remains [m]."""
        return float(np.sqrt(np.sum(self.look(moved) ** 2) / self.context.n))

    def displaced(self, changes: Changes) -> Floats:
        """How small changes move the tips, shape=(n, 3)."""
        context = self.context
        chain, state = context.chain, context.state
        motion = changes.motion.copy()
        for follower, drivers in enumerate(chain.drivers):
            for driver, weight in drivers:
                motion[:, follower] += weight * changes.motion[:, driver]
        moved = np.zeros_like(state.tip)
        for j in np.flatnonzero(motion.any(axis=0)).tolist():
            moved += motion[:, j : j + 1] * self.columns["motion", j, 0]
        for j, k in np.argwhere(changes.links.any(axis=0)).tolist():
            moved += changes.links[:, j, k : k + 1] * self.columns["link", j, k]
        bend = changes.bend.copy()
        bend[:, :, :2] += changes.tilt
        for j, k in np.argwhere(bend.any(axis=0)).tolist():
            moved += bend[:, j, k : k + 1] * self.columns["bend", j, k]
        if not changes.base.any():
            return np.asarray(moved + changes.scale[:, None] * state.tip)
        moved += changes.base[:, :3] + np.cross(changes.base[:, 3:], state.tip - chain.base[:3, 3])
        return np.asarray(moved + changes.scale[:, None] * state.tip)

    def _frame_columns(self) -> list[Floats]:
        context = self.context
        columns = [np.broadcast_to(axis, (context.n, 3)) for axis in np.eye(3)]
        columns += [np.cross(axis, context.state.tip - context.state.tip.mean(axis=0)) for axis in np.eye(3)]
        for target in np.unique(context.inputs.target):
            mine = (context.inputs.target == target)[:, None]
            columns += [mine * context.state.link_rotation[-1][:, :, k] for k in range(3)]
        return columns

    def geometry_columns(self, only: Iterable[int] | None = None) -> list[Floats]:
        joints = range(self.context.chain.joints) if only is None else only
        return [self._with_followers(j, k) for j in joints for k in (-1, D, A, ALPHA, BETA)]

    def _with_followers(self, joint: int, which: int) -> Floats:
        """Column of a link value, or (-1) of the joint's zero."""
        if which >= 0:
            return self.columns["link", joint, which]
        changes = self.context.still()
        changes.motion[:, joint] = 1.0
        return self.displaced(changes)


def _orthonormal(columns: Sequence[Floats]) -> Floats:
    """A basis of what the columns span, by the eigenvectors of the Gram matrix of unit columns."""
    flat = np.stack([column.ravel() for column in columns], axis=1)
    size = np.linalg.norm(flat, axis=0)
    unit = flat[:, size > 1e-12] / size[size > 1e-12]
    if unit.shape[1] == 0:
        return np.zeros((flat.shape[0], 0))
    values, vectors = np.linalg.eigh(unit.T @ unit)
    kept = values > _RANK**2 * values[-1]
    return np.asarray(unit @ (vectors[:, kept] / np.sqrt(values[kept])))


def explained(view: View, moved: Floats, columns: Sequence[Floats]) -> float:
    """Share of the look of a displacement that some columns explain."""
    look = view.look(moved)
    total = float(look @ look)
    looks = [view.look(column) for column in columns]
    raw = [float(np.linalg.norm(column)) for column in columns]
    seen = [
        look_of
        for look_of, size in zip(looks, raw, strict=True)
        if np.linalg.norm(look_of) > 1e-6 * max(size, 1e-12)
    ]
    if total == 0.0 or not seen:
        return 0.0
    basis = _orthonormal(seen)
    return float(np.sum((basis.T @ look) ** 2) / total)


@dataclass(frozen=True)
class Rival:
    """An effect that could be named instead."""

    effect: str
    joint: int  # -1: the robot as a whole, or all joints
    columns: tuple[Floats, ...]


def rivals(view: View, handed: frozenset[str]) -> list[Rival]:
    """Every listed effect at every joint, as far as the columns handed over allow it."""
    context = view.context
    found: list[Rival] = []
    for joint in range(context.chain.joints):
        found += [
            Rival(name, joint, tuple(view.displaced(c) for c in changes))
            for name, changes in _at_joint(context, joint, handed)
        ]
        found.append(Rival("link_geometry", joint, tuple(view.geometry_columns([joint]))))
    unit = context.still()
    unit.scale[:] = 1.0
    found.append(Rival("scale", -1, (view.displaced(unit),)))
    found.append(Rival("link_geometry", -1, tuple(view.geometry_columns())))
    if "t" in handed:
        found.append(Rival("drift", -1, tuple(_even_drift(view))))
    if "speed" in handed:
        late = context.still()
        late.motion[:, context.chain.driven] = context.inputs.speed
        found.append(Rival("time_offset", -1, (view.displaced(late),)))
    return found


def _even_drift(view: View) -> list[Floats]:
    time = view.context.inputs.time - view.context.inputs.time.mean()
    return [time[:, None] * column for column in view._frame_columns()[:6]]


def drifts(view: View) -> list[Floats]:
    """A base that drifts evenly or comes to rest, as `laws.drift` has it, by any of its six coordinates."""
    paths = [np.exp(-view.context.hours / time) for time in laws.DYING_OUT]
    dying = [path[:, None] * column for path in paths for column in view._frame_columns()[:6]]
    return _even_drift(view) + dying


def _moving(context: Context, joint: int, values: Floats) -> Changes:
    changes = context.still()
    changes.motion[:, joint] = values
    return changes


def _at_joint(context: Context, joint: int, handed: frozenset[str]) -> list[tuple[str, list[Changes]]]:
    chain, inputs, q = context.chain, context.inputs, context.motion[:, joint]
    driven = joint in chain.driven
    found = [("joint_offset", [_moving(context, joint, np.ones(context.n))])]
    if driven:
        found.append(("gear_ratio", [_moving(context, joint, q)]))
        if "dir" in handed:
            found.append(("backlash", [_moving(context, joint, inputs.direction[:, context.column(joint)])]))
    if not chain.prismatic[joint]:
        found.append(
            ("harmonic", [_moving(context, joint, f(k * q)) for f in (np.cos, np.sin) for k in (1, 2)])
        )
        found.append(("axis_wobble", _wobbles(context, joint)))
    if "masses" in handed or "payload" in handed:
        torque = context.torque[:, joint]
        found.append(("joint_compliance", [_moving(context, joint, torque)]))
        found.append(("stiffness_zones", _zones(context, joint)))
        found.append(("gravity_backlash", [_moving(context, joint, side_of(torque))]))
        if joint + 1 < chain.joints:
            found.append(
                ("link_compliance", [laws.link_compliance(joint, np.random.default_rng(0)).changes(context)])
            )
    if "temp" in handed:
        found.append(("thermal_zero", [_moving(context, joint, context.warmth)]))
        found.append(("thermal", [laws.thermal(joint, np.random.default_rng(0)).changes(context)]))
    return found


def _zones(context: Context, joint: int) -> list[Changes]:
    """Torque in three zones that part the data in thirds."""
    torque = context.torque[:, joint]
    knots = [0.0, *np.quantile(np.abs(torque), [1 / 3, 2 / 3]), np.inf]
    parts = [
        np.clip(np.abs(torque), low, high) - low for low, high in zip(knots[:-1], knots[1:], strict=True)
    ]
    return [_moving(context, joint, np.copysign(part, torque)) for part in parts]


def _wobbles(context: Context, joint: int) -> list[Changes]:
    found = []
    q = context.motion[:, joint]
    for k in range(2):
        for values in (np.cos(q), np.sin(q)):
            changes = context.still()
            changes.tilt[:, joint, k] = values
            found.append(changes)
    return found


def lookalikes(view: View, moved: Floats, effect: Hidden, handed: frozenset[str]) -> list[tuple[str, int]]:
    """Effects and joints that explain a displacement all but wholly, the effect itself left out."""
    found = []
    for rival in rivals(view, handed):
        own = rival.effect == effect.effect and (not effect.joints or rival.joint in effect.joints)
        own |= (
            rival.effect == "stiffness_zones"
            and effect.effect == "joint_compliance"
            and rival.joint in effect.joints
        )  # a law with room to spare
        if own or (
            rival.effect == "link_geometry"
            and rival.joint < 0
            and effect.effect not in ("scale", "joint_offset")
        ):
            continue
        if explained(view, moved, rival.columns) > SAME:
            found.append((rival.effect, rival.joint))
    return found
