# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Joints simulated apart, each along the measured motion of the others: the same chain, 15 times faster and
more than the simulator moves the whole arm. The search looks here; the simulator judges what it finds."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.charge import Charges
from truing.dynamics.servo.data import ServoData, Stream, Window
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator
from truing.dynamics.smoothing import cubics, rows_within

Floats = NDArray[np.float64]
Tables = tuple[Floats, Floats, Floats, Floats]
"""Inertia, bias, weight by cosine and sine of a joint's own turn: `ServoPath`. shape=(n, joints)"""

Lane = tuple[object, ...]
"""All that the motion of a joint apart goes by: its number, values, masses, functions, windows."""

_SAG, _SUMS = FIELDS.index("supply_sag"), FIELDS.index("integral_gain")
_FAR = 1e3  # [rad | m]: what is so far has left
_REMEMBERED = 4_000_000  # numbers, 32 MB
_SMOOTHING = 0.03  # [s] on both sides, of accelerations: they are needed of the other joints alone
_SLIDE = 2  # mjtJoint


class Apart:
    """An arm's joints along recordings; has what of a `Simulator` fits and searches use."""

    def __init__(self, simulator: Simulator, step: float = 0.0) -> None:
        """step: longest of a simulation [s]; 0: the simulator's."""
        self.whole = simulator
        self.data, self.arm, self.model = simulator.data, simulator.arm, simulator.model
        self.dofs = simulator.dofs
        names = simulator.arm.nominal.joints
        self._joints = np.array([simulator.model.joint(name).id for name in names])
        self._turns = np.asarray(self.model.jnt_type)[self._joints] != _SLIDE
        self._moved = _descendants(self.model, np.asarray(self.model.jnt_bodyid)[self._joints])
        self.longest, self.step = step, longer_step(self.data, step)
        self._core_arm = simulator.core_arm_with(self.step)
        self._paths: dict[tuple[object, ...], list[_core.ServoPath]] = {}
        self._known: dict[tuple[str, int], Tables] = {}
        self._motions: dict[Lane, Floats] = {}
        self._held = 0  # numbers of these
        self._numbers: dict[tuple[Window, ...], int] = {}
        none = np.zeros((0, len(names)))
        self._turned = self._turns.astype(float)
        self._charges = Charges(self.data, self._charged)
        self._unseen = _core.ServoPath(none, none, none, none, self._turned)

    def in_gravity(self, gravity: Floats) -> Apart:
        """The same arm where weight pulls so [m/s^2]."""
        x, y, z = (float(v) for v in gravity)
        arm = replace(self.arm, nominal=replace(self.arm.nominal, gravity=(x, y, z)))
        return Apart(Simulator(arm, self.data, self.whole.threads), self.longest)

    def run(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        torques: bool = False,
        only: Sequence[int] | None = None,
    ) -> tuple[list[Floats], list[Floats]]:
        """As `Simulator.run`. only: of each point the joint that is moved, where the others do not matter;
        -1: all. A joint's motion is remembered for a while: chains that differ elsewhere have the same."""
        moved = [-1] * len(points) if only is None else list(only)
        if torques or any(np.any(p.chain[:, _SAG] != 0.0) for p in points):  # which joints feel together
            return self._simulated(points, windows, torques, moved)
        lanes = [self._lanes(p, windows, joint) for p, joint in zip(points, moved, strict=True)]
        asked: dict[Lane, None] = {}
        jobs: list[tuple[int, int]] = []
        for k, (own, joint) in enumerate(zip(lanes, moved, strict=True)):
            new = [j for j, lane in own.items() if lane not in self._motions and lane not in asked]
            jobs += [(k, joint)] if len(new) == len(own) else [(k, j) for j in new]
            asked |= dict.fromkeys(own[j] for j in new)
        whole, fresh = self._fresh(points, windows, lanes, jobs)
        seen = ChainMap(fresh, self._motions)
        out = [
            whole[k] if k in whole else self._together([seen.get(lane) for lane in own.values()], joint)
            for k, (own, joint) in enumerate(zip(lanes, moved, strict=True))
        ]
        left = [k for k, motion in enumerate(out) if motion is None]
        again = self._simulated([points[k] for k in left], windows, False, [moved[k] for k in left])[0]
        for k, motion in zip(left, again, strict=True):
            out[k] = motion
        self._remember(fresh)
        return [motion for motion in out if motion is not None], []

    def _lanes(self, point: Point, windows: Sequence[Window], only: int) -> dict[int, Lane]:
        """All that the motion of each joint goes by."""
        number = self._numbers.setdefault(tuple(windows), len(self._numbers))
        common = (number, point.weight, _masses(point))
        functions = [(f[0], (*f[1:4], f[4].tobytes())) for f in point.functions]
        return {
            j: (j, point.chain[j].tobytes(), common, tuple(f for joint, f in functions if joint == j))
            for j in (range(len(point.chain)) if only < 0 else (only,))
        }

    def _fresh(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        lanes: Sequence[dict[int, Lane]],
        jobs: Sequence[tuple[int, int]],
    ) -> tuple[dict[int, Floats], dict[Lane, Floats]]:
        """Simulates points as a whole (joint -1), or a joint of them: motions of the first, and of joints.
        Where one leaves, all of its arm stand still: they are no other arm's."""
        motions = self._simulated([points[k] for k, _ in jobs], windows, False, [j for _, j in jobs])[0]
        whole: dict[int, Floats] = {}
        fresh: dict[Lane, Floats] = {}
        for (k, joint), motion in zip(jobs, motions, strict=True):
            motion.flags.writeable = False
            if joint < 0:
                whole[k] = motion
            if joint >= 0 or not has_left(motion):
                fresh |= {lane: motion[:, j] for j, lane in lanes[k].items() if joint in (-1, j)}
        return whole, fresh

    def _together(self, columns: Sequence[Floats | None], only: int) -> Floats | None:
        """Of joints that were simulated one by one. None: there is one that was not, or has left."""
        if any(one is None or (only < 0 and has_left(one)) for one in columns):
            return None
        rows = [one for one in columns if one is not None]
        out = np.zeros((rows[0].size, len(self._turns)), order="F")
        for j, column in enumerate(rows):
            out[:, j if only < 0 else only] = column
        return out

    def _remember(self, fresh: dict[Lane, Floats]) -> None:
        """What was known longest goes first."""
        self._motions |= fresh
        self._held += sum(column.size for column in fresh.values())
        while self._held > _REMEMBERED:
            self._held -= self._motions.pop(next(iter(self._motions))).size

    def _simulated(
        self, points: Sequence[Point], windows: Sequence[Window], torques: bool, moved: Sequence[int]
    ) -> tuple[list[Floats], list[Floats]]:
        if not points:
            return [], []
        charges = self._charges.of(points, windows)
        return self._with(points, windows, charges, torques, moved)

    def _charged(
        self, points: Sequence[Point], windows: Sequence[Window], charges: Sequence[Floats]
    ) -> list[Floats]:
        moved = [-1 if np.any(p.chain[:, _SAG] != 0.0) else _alone(p.chain[:, _SUMS] > 0.0) for p in points]
        return self._with(points, windows, charges, False, moved)[0]

    def _with(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        charges: Sequence[Floats],
        torques: bool,
        moved: Sequence[int],
    ) -> tuple[list[Floats], list[Floats]]:
        """charges: of each point, what its integrals hold when recordings begin."""
        kinds: dict[tuple[object, ...], int] = {}
        for p in points:
            kinds.setdefault(_masses(p), len(kinds))
        streams = tuple(sorted({w.stream for w in windows}))
        paths = [self._path(p, streams) for p in {_masses(p): p for p in points}.values()]
        sets = [
            _core.ServoSet(p.chain, p.weight, kinds[_masses(p)], list(p.functions), joint, charge)
            for p, joint, charge in zip(points, moved, charges, strict=True)
        ]
        some = [_core.ServoWindow(w.stream, w.first, w.rows) for w in windows]
        whole = self.whole
        return _core.simulate_servos_apart(
            self._core_arm, paths, whole.core_recordings, some, sets, whole.threads, torques
        )

    # ---- what the joints feel

    def _path(self, point: Point, streams: tuple[int, ...]) -> list[_core.ServoPath]:
        """Of these recordings."""
        key = (*_masses(point), streams)
        if key not in self._paths:
            paths = [self._unseen] * len(self.data.streams)
            for k in streams:
                paths[k] = _core.ServoPath(*self._of_masses(point, k), self._turned)
            self._paths[key] = paths
            if len(self._paths) > 40:  # of fits of masses, which come by once
                self._paths.pop(next(iter(self._paths)))
        return self._paths[key]

    def _of_masses(self, point: Point, stream: int) -> Tables:
        """Torques are linear in masses: others than the model's add what one does."""
        tables = self._tables("", Point(point.chain), stream)
        for body, scale in point.links:
            one = Point(point.chain, links=((body, 2.0),))
            tables = _more(tables, self._tables(f"link {body}", one, stream), scale - 1.0)
        if point.payload:
            one = Point(point.chain, payload=1.0, place=point.place)
            tables = _more(tables, self._tables("payload", one, stream), point.payload)
        return tables

    def _tables(self, name: str, point: Point, stream: int) -> Tables:
        """Of the model's masses (""), or what one further unit of a mass adds to these."""
        if (name, stream) not in self._known:
            found = self._along(self.data.streams[stream], point)
            if name:
                found = _more(found, self._tables("", Point(point.chain), stream), -1.0)
            self._known[name, stream] = found
        return self._known[name, stream]

    def _along(self, stream: Stream, point: Point) -> Tables:
        """Newton and Euler along a recording (Luh et al. 1980), without the joint's own acceleration."""
        m, mujoco = self.whole.with_masses(point), self.whole.mujoco
        d = mujoco.MjData(m)
        n, rows = self._joints.size, stream.time.size
        acceleration = cubics(stream.speed, rows_within(_SMOOTHING, stream.step), stream.step)[1]
        places, dofs = in_a_row(np.asarray(m.jnt_qposadr)[self._joints]), in_a_row(self.dofs)
        joints = in_a_row(self._joints)
        torque, one = np.empty((rows, n)), np.empty(m.nv)
        axes, anchors = np.empty((rows, n, 3)), np.empty((rows, n, 3))
        centres, turns = np.empty((rows, m.nbody, 3)), np.empty((rows, m.nbody, 9))
        q, v, qdd, axis_of, anchor_of = d.qpos, d.qvel, d.qacc, d.xaxis, d.xanchor
        centre_of, turn_of = d.xipos, d.ximat
        for k in range(rows):
            q[places], v[dofs], qdd[dofs] = stream.smooth[k], stream.speed[k], acceleration[k]
            mujoco.mj_kinematics(m, d)
            mujoco.mj_comPos(m, d)
            mujoco.mj_comVel(m, d)
            mujoco.mj_rne(m, d, 1, one)
            torque[k] = one[dofs]
            axes[k], anchors[k] = axis_of[joints], anchor_of[joints]
            centres[k], turns[k] = centre_of, turn_of
        turned = turns.reshape(rows, m.nbody, 3, 3)
        inertia, cosine, sine = np.empty((rows, n)), np.zeros((rows, n)), np.zeros((rows, n))
        gravity = np.asarray(m.opt.gravity)
        mass, floats = np.asarray(m.body_mass), 1.0 - np.asarray(m.body_gravcomp)
        for j in range(n):
            axis, moved = axes[:, j], self._moved[j]
            if not self._turns[j]:
                inertia[:, j] = mass[moved].sum()
                along = np.einsum("ki,i->k", axis, gravity)
                cosine[:, j] = -along * np.sum((mass * floats)[moved])
                torque[:, j] += along * np.sum((mass * (1.0 - floats))[moved])
                continue
            arm = centres[:, moved] - anchors[:, None, j]
            swept = np.cross(axis[:, None], arm)
            own = np.einsum("ki,kbij->kbj", axis, turned[:, moved])
            about = np.sum(own**2 * np.asarray(m.body_inertia)[moved], axis=2)
            inertia[:, j] = np.sum(about + mass[moved] * np.sum(swept**2, axis=2), axis=1)
            heavy = np.einsum("kbi,b->ki", swept, (mass * floats)[moved])
            cosine[:, j] = -np.einsum("ki,i->k", heavy, gravity)
            torque[:, j] += np.einsum("kbi,b,i->k", swept, (mass * (1.0 - floats))[moved], gravity)
            sine[:, j] = -np.einsum("ki,i->k", np.cross(axis, heavy), gravity)
        return inertia, torque - inertia * acceleration, cosine, sine


def longer_step(data: ServoData, longest: float) -> float:
    """The longest step up to `longest` [s], no shorter than the simulator's, of which the rows of all
    recordings are whole numbers apart."""
    apart = data.step * math.gcd(*(round(s.step / data.step) for s in data.streams))
    return apart / math.ceil(apart / max(longest, data.step) - 1e-6)


def in_a_row(numbers: NDArray[np.intp]) -> slice | NDArray[np.intp]:
    """A slice, which numpy reads ten times faster, where it takes the same."""
    first = int(numbers[0])
    follows = np.array_equal(numbers, np.arange(first, first + numbers.size))
    return slice(first, first + numbers.size) if follows else numbers


def _alone(which: NDArray[np.bool_]) -> int:
    """The number of the only one; -1: there are others."""
    return int(np.argmax(which)) if np.sum(which) == 1 else -1


def has_left(motion: Floats) -> bool:
    return bool(np.abs(motion).max() >= _FAR)


def _masses(point: Point) -> tuple[object, ...]:
    links = tuple((body, scale) for body, scale in point.links if scale != 1.0)
    return (point.payload, point.place if point.payload else None, links)


def _more(tables: Tables, others: Tables, times: float) -> Tables:
    a, b, c, d = (one + times * other for one, other in zip(tables, others, strict=True))
    return a, b, c, d


def _descendants(model: object, bodies: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """All bodies that each of some bodies carries, itself among them."""
    parents = np.asarray(model.body_parentid)  # type: ignore[attr-defined]
    out = []
    for body in bodies:
        carried = np.zeros(parents.size, dtype=bool)
        carried[body] = True
        for b in range(int(body) + 1, parents.size):
            carried[b] = carried[parents[b]]
        out.append(np.flatnonzero(carried))
    return out
