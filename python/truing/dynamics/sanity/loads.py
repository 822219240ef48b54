# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does the robot carry a load in some recordings, or for some of their time, and nobody told?

What comes and goes while it is recorded, `switched` finds. What some recordings carry from end to end no fold
of them can show, as what is fitted to the others does not know it. So the torques of all are taken by one set
of links; by friction and offsets of each recording alone, which change with the day; and by a load of each
half of a recording: what both halves carry alike, and the lightest recording does not, hangs at its tool.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import PAYLOAD_COLUMNS, PAYLOAD_FOUND
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import FoundParameter, RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid, speeds_at_rest
from truing.dynamics.sanity.switched import Switched, Thinned, switched

Floats = NDArray[np.float64]

ROWS = 300  # of each recording
FEWEST = 40  # measured torques of half a recording
ROUNDS = 3  # of weighing joints by what is left of their torques
SURE = 6.0  # standard errors by which masses differ
BY_HALVES = 0.25  # of what the halves of a recording differ by: no standard error is smaller
PART = 0.5  # of the squares that a recording leaves without its load, at most, with it
PART_OF_ALL = 0.65  # of the squares that all leave without a load that comes and goes, at most, with it
GAIN = 1.1  # ratio of the torques of two recordings: from here on it is said
MOST = 4  # loads that are told apart
REACH = 1.0  # [m] no load hangs farther from the tool
RIDGE = 1e-6  # of the links' mean square column: what motion does not show stays the file's
OF_LOAD = 4  # parameters of a link that a load adds to: mass, and mass times centre
_COLUMNS = (*PAYLOAD_COLUMNS, PAYLOAD_FOUND)  # of a recording


@dataclass(frozen=True)
class Load:
    """What hangs at the tool of recordings, more than of the lightest one."""

    recordings: tuple[str, ...]
    mass: float  # [kg]
    sigma: float  # [kg]
    place: tuple[float, float, float]  # [m] of its centre in the tool's frame
    when: Switched | None = None  # it hangs there; None: all the time

    def carried(self, recording: _core.Recording) -> Floats:
        """Mass at the tool in every row. shape=(n,) [kg]"""
        if recording.name not in self.recordings:
            return np.zeros(len(recording))
        if self.when is None:
            return np.full(len(recording), self.mass)
        return np.asarray(self.mass * self.when.there(recording.name, np.asarray(recording.time)))


def stated(recordings: Sequence[_core.Recording]) -> bool:
    """Some say what they carry, or are read in pieces, of which nothing here is asked."""
    return any(one.pieces is not None for one in recordings) or any(
        np.any(one.columns[name]) for one in recordings for name in PAYLOAD_COLUMNS if name in one.columns
    )


def compared(robot: _core.Robot, grids: Sequence[Grid]) -> Compared | None:
    """The links that recordings have in common, and a load of each of them; None for one recording alone."""
    seen = [halves for grid in grids if len(halves := _halves(robot, grid)) == 2]
    return Compared.of(seen, len(driven_joints(robot))) if len(seen) > 1 else None


def always_there(robot: _core.Robot, grid: Grid) -> Load | None:
    """What one recording carries from end to end, more than a robot whose links are known."""
    halves = _halves(robot, grid)
    if len(halves) < 2:
        return None
    fit = Compared.of([halves], len(driven_joints(robot)), links_known=True)
    load, sigma = fit.loads[0], fit.sigma([0])
    others = min(PART * fit.squares(0, np.zeros(OF_LOAD)), fit.squares_scaled(0, fit.scale(0)))
    if load[0] < SURE * sigma or fit.squares(0, load) > others:
        return None  # torques on another scale look like a load, too
    place = _in_tool(robot, load)
    return Load((grid.name,), float(load[0]), sigma, place) if np.linalg.norm(place) < REACH else None


def gain_differs(fit: Compared) -> list[RecordingFinding]:
    """Recordings whose torques are a multiple of what the others' are, which no load explains as well."""
    scales = np.array([fit.scale(k) for k in range(len(fit.names))])
    usual = float(np.median(scales))
    if not usual > 0.0:
        return []  # torques that do not follow the links at all have no scale
    apart = [
        k
        for k, scale in enumerate(scales)
        if scale > 0.0  # a factor below zero is none: the links explain next to nothing there
        and abs(math.log(scale / usual)) > math.log(GAIN)
        and fit.squares_scaled(k, scale) < PART * fit.squares_scaled(k, usual)
        and fit.squares_scaled(k, scale) < fit.squares(k, fit.loads[k])
    ]
    if not apart:
        return []
    said = listed([f"{fit.names[k]} by {scales[k] / usual:.2f}" for k in apart])
    words = (
        f"torques are those of the other recordings times a factor, {said}: another unit, other constants of"
    )
    words += " the drives? Bring all to one scale, and run again"
    worst = max((scales[k] / usual for k in apart), key=lambda ratio: abs(math.log(ratio)))
    where = tuple(fit.names[k] for k in apart)
    return [RecordingFinding("gain_differs", where, (), words, float(worst), "-", mistake=True)]


def loads_of(robot: _core.Robot, fit: Compared) -> list[Load]:
    """Loads that recordings carry and the lightest of them does not."""
    lightest, *others = _groups(fit)
    out = []
    for group in others:
        load = fit.mean(group) - fit.mean(lightest)
        place = _in_tool(robot, load)
        if np.linalg.norm(place) < REACH:
            sigma = math.hypot(fit.sigma(group), fit.sigma(lightest))
            names = tuple(fit.names[k] for k in sorted(group))
            out.append(Load(names, float(load[0]), sigma, place))
    return out


def picked_up(robot: _core.Robot, thin: Thinned) -> tuple[list[Load], float]:
    """What the robot picks up, or sets down, while it is recorded; what is left of the squares with it."""

    def columns(q: Floats, qd: Floats, qdd: Floats) -> Floats:
        return np.asarray(_core.torque_regressor(robot, q, qd, qdd))[:, :, -10 : -10 + OF_LOAD]

    tool = np.array(robot.targets[0].T_last_target)[:3, 3] if robot.targets else np.zeros(3)
    found = switched(thin, columns, [np.append(1.0, tool)], is_mass=True, most=MOST)
    if found is None or found.part > PART_OF_ALL or not found.changes:
        return [], 1.0
    out = []
    for one in found.each:
        place = _in_tool(robot, one.values)
        if one.values[0] < SURE * one.sigma or np.linalg.norm(place) > REACH:
            return [], 1.0
        out.append(Load(one.recordings, float(one.values[0]), one.sigma, place, one))
    return out, found.left


def _in_tool(robot: _core.Robot, load: Floats) -> tuple[float, float, float]:
    """[m] centre of a load, shape=(4,) [kg, kg m] in the frame after the last link, in the tool's."""
    T_tool_last = np.linalg.inv(np.array(robot.targets[0].T_last_target)) if robot.targets else np.eye(4)
    x, y, z, _ = (T_tool_last @ np.append(load[1:] / load[0], 1.0)).tolist()
    return x, y, z


def used(load: Load) -> RecordingFinding:
    """What is said of a load that is taken into account."""
    x, y, z = (1e3 * v for v in load.place)
    words = (
        f"{_who(load)} {load.mass:.2f} kg (+- {load.sigma:.2g}) {_than(load)}, at {x:.0f} {y:.0f} {z:.0f} mm"
        " in the tool's frame: taken into account"
    )
    if load.when is None:
        words += f" (for predict: --payload {load.mass:.2f}kg@{x:.0f},{y:.0f},{z:.0f}mm)"
    parameters = (
        FoundParameter("payload.m", load.mass, load.sigma, "kg"),
        *(FoundParameter(f"payload.{axis}", v, 0.0, "m") for axis, v in zip("xyz", load.place, strict=True)),
    )
    found = RecordingFinding(_finding(load), load.recordings, (), words, load.mass, "kg", applied=True)
    return replace(found, spans=_spans(load), parameters=parameters)


def to_be_weighed(load: Load) -> RecordingFinding:
    """What is said of a load where drives' constants are not known, so that its mass is not."""
    rest = "0 where there is none" if load.when else "0 in the others"
    words = (
        f"{_who(load)} some {load.mass:.2g} kg {_than(load)} by the constants that the file's masses would"
        f" need, and no payload_kg says so: state it, {rest}, and it tells the drives' constants"
    )
    return RecordingFinding(
        _finding(load), load.recordings, (), words, load.mass, "kg", mistake=True, spans=_spans(load)
    )


def _finding(load: Load) -> str:
    return "load_differs" if load.when is None else "load_comes_and_goes"


def _spans(load: Load) -> tuple[tuple[str, float, float], ...]:
    return load.when.spans if load.when is not None else ()


def _who(load: Load) -> str:
    return f"{listed(load.recordings)} {'carries' if len(load.recordings) == 1 else 'carry'}"


def _than(load: Load) -> str:
    """What it is compared with."""
    if load.when is None:
        return "more than the lightest"
    times = len(load.when.spans)
    return "once" if times == 1 else f"{times} times"


def with_loads(recordings: Sequence[_core.Recording], loads: Sequence[Load]) -> list[_core.Recording]:
    """The recordings with what each of them carries, marked as found: nobody weighed it, and it does not tell
    drives' constants."""
    if not loads:
        return list(recordings)
    out = []
    for one in recordings:
        columns = {name: np.zeros(len(one)) for name in _COLUMNS}
        for load in loads:
            mass = load.carried(one)
            values = (
                np.broadcast_to((1.0, *load.place, 1.0), (len(one), len(_COLUMNS))) * (mass > 0.0)[:, None]
            )
            values[:, 0] *= mass
            for name, column in zip(_COLUMNS, values.T, strict=True):
                columns[name] += column
        out.append(one.replace(columns={**one.columns, **columns}))
    return out


def _groups(fit: Compared) -> list[list[int]]:
    """Recordings that carry the same, the lightest first."""
    groups: list[list[int]] = []
    for k in np.argsort(fit.loads[:, 0]).tolist():
        if groups and not _is_heavier(fit, k, groups[-1]):
            groups[-1].append(k)
        else:
            groups.append([k])
    return groups


def _is_heavier(fit: Compared, k: int, group: Sequence[int]) -> bool:
    apart = fit.loads[k, 0] - fit.mean(group)[0]
    if apart < SURE * math.hypot(fit.sigma([k]), fit.sigma(group)):
        return False
    return fit.squares(k, fit.loads[k]) < PART * fit.squares(k, fit.mean(group))


@dataclass(frozen=True)
class _Half:
    """Rows of half a recording, joint below joint, without what its friction and offsets take up."""

    name: str
    links: Floats  # shape=(n, 10 links) torques by the parameters of the links
    rigid: Floats  # shape=(n,) [Nm | N] torques of the file's links
    left: Floats  # shape=(n,) [Nm | N] measured torques less these
    joint: NDArray[np.intp]  # shape=(n,)

    @property
    def load(self) -> Floats:
        return self.links[:, -10 : -10 + OF_LOAD]


def _halves(robot: _core.Robot, grid: Grid) -> list[_Half]:
    rows = grid.rows[:: max(1, len(grid.rows) // ROWS)]
    halves = (_half(robot, grid, part) for part in np.array_split(rows, 2))
    return [half for half in halves if len(half.left) >= FEWEST]


def _half(robot: _core.Robot, grid: Grid, rows: NDArray[np.intp]) -> _Half:
    motion = grid.q[rows], grid.qd[rows], grid.qdd[rows]
    regressor = np.asarray(_core.torque_regressor(robot, *motion))
    rigid = np.asarray(_core.rigid_torques(robot, *motion))
    left = grid.torque[rows] - rigid
    moving = np.abs(motion[1]) > speeds_at_rest(robot)  # at rest friction takes up a part of the weight
    parts, joints = [], []
    for j in range(left.shape[1]):
        there = ~np.isnan(left[:, j]) & moving[:, j]
        usual = [grid.direction[rows, j], grid.qd[rows, j], grid.qdd[rows, j], np.ones(len(rows))]
        columns = np.column_stack([regressor[:, j], rigid[:, j], left[:, j]])
        x, both = np.column_stack(usual)[there], columns[there]
        parts.append(both - x @ (np.linalg.pinv(x.T @ x, hermitian=True) @ (x.T @ both)))
        joints.append(np.full(len(both), j))
    whole = np.concatenate(parts)
    return _Half(grid.name, whole[:, :-2], whole[:, -2], whole[:, -1], np.concatenate(joints))


@dataclass(frozen=True)
class Compared:
    """Loads of recordings over links that they have in common."""

    halves: list[list[_Half]]
    weight: Floats  # shape=(joints,) one over what is left of a joint's torque, rms
    links: Floats  # shape=(10 links,) what their parameters are more than the file's
    loads: Floats  # shape=(recordings, 4) [kg, kg m] of the last link, in each
    variance: Floats  # shape=(recordings,) [kg^2] of the masses

    @classmethod
    def of(cls, seen: list[list[_Half]], joints: int, links_known: bool = False) -> Compared:
        """Least squares, joints weighed by what is left of them. What noise that goes on from row to row adds
        to the variance shows where two halves of a recording do not carry the same."""
        halves = [half for two in seen for half in two]
        weight = np.ones(joints)
        for _ in range(ROUNDS):
            links, loads, variance = _solved(halves, weight, links_known)
            squares, n = np.zeros(joints), np.zeros(joints)
            for half, load in zip(halves, loads, strict=True):
                squares += np.bincount(half.joint, _left(half, links, load) ** 2, joints)
                n += np.bincount(half.joint, minlength=joints)
            rms = np.sqrt(squares / np.maximum(n, 1))
            weight = 1.0 / np.maximum(rms, 1e-6 * rms.max())
        apart = loads[0::2, 0] - loads[1::2, 0]
        between = variance[0::2] + variance[1::2]
        coloured = max(1.0, float(np.mean(apart**2 / between)))
        share = (1.0 / variance)[:, None]
        both = (share[0::2] * loads[0::2] + share[1::2] * loads[1::2]) / (share[0::2] + share[1::2])
        known = coloured / (1.0 / variance[0::2] + 1.0 / variance[1::2])
        return cls(seen, weight, links, both, np.maximum(known, (BY_HALVES * apart) ** 2))

    @property
    def names(self) -> list[str]:
        return [two[0].name for two in self.halves]

    def mean(self, group: Sequence[int]) -> Floats:
        """Load of recordings that carry the same. shape=(4,)"""
        return np.asarray(np.average(self.loads[group], axis=0, weights=1.0 / self.variance[group]))

    def sigma(self, group: Sequence[int]) -> float:
        """[kg] standard error of its mass."""
        return float(1.0 / np.sqrt(np.sum(1.0 / self.variance[group])))

    def _weighed(self, k: int) -> tuple[Floats, Floats]:
        """Measured torques of a recording and those of the common links, in units of what joints leave."""
        weights = np.concatenate([self.weight[half.joint] for half in self.halves[k]])
        measured = np.concatenate([half.left + half.rigid for half in self.halves[k]])
        common = np.concatenate([half.rigid + half.links @ self.links for half in self.halves[k]])
        return weights * measured, weights * common

    def scale(self, k: int) -> float:
        """Measured torques of a recording over those of the common links, by least squares."""
        measured, common = self._weighed(k)
        return float(measured @ common / (common @ common))

    def squares_scaled(self, k: int, scale: float) -> float:
        """What a recording leaves with a multiple of the common links' torques and no load."""
        measured, common = self._weighed(k)
        return float(np.sum((measured - scale * common) ** 2))

    def squares(self, k: int, load: Floats) -> float:
        """What a recording leaves with a load, in units of what joints leave."""
        return float(
            sum(
                np.sum((self.weight[half.joint] * _left(half, self.links, load)) ** 2)
                for half in self.halves[k]
            )
        )


def _left(half: _Half, links: Floats, load: Floats) -> Floats:
    return np.asarray(half.left - half.links @ links - half.load @ load)


def _solved(halves: Sequence[_Half], weight: Floats, links_known: bool) -> tuple[Floats, Floats, Floats]:
    """Common links, loads of the halves, shape=(halves, 4), and variances of their masses, the links being
    known: by elimination of the loads (Schur). links_known: they are the robot's."""
    grams, cross, own, right_of_links, right_of_loads = [], [], [], [], []
    for half in halves:
        w = weight[half.joint][:, None]
        x, y, z = w * half.links, w * half.load, w[:, 0] * half.left
        grams.append(x.T @ x)
        cross.append(x.T @ y)
        own.append(y.T @ y)
        right_of_links.append(x.T @ z)
        right_of_loads.append(y.T @ z)
    whole = np.sum(grams, axis=0)
    ridge = RIDGE * float(np.trace(whole)) / len(whole)
    inverses = [np.linalg.inv(one + ridge * np.eye(OF_LOAD)) for one in own]
    reduced = (
        whole + ridge * np.eye(len(whole)) - sum(c @ i @ c.T for c, i in zip(cross, inverses, strict=True))
    )
    side = np.sum(right_of_links, axis=0) - sum(
        c @ i @ r for c, i, r in zip(cross, inverses, right_of_loads, strict=True)
    )
    links = np.zeros(len(whole)) if links_known else np.linalg.solve(reduced, side)
    loads = [i @ (r - c.T @ links) for i, r, c in zip(inverses, right_of_loads, cross, strict=True)]
    return links, np.array(loads), np.array([i[0, 0] for i in inverses])
