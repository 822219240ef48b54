# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Configuration data of programs: which of a robot's ways to reach a pose is meant.

What the makers count, for arms of six joints whose last three axes meet:

| maker | front or behind axis 1 | elbow | wrist | turns |
| --- | --- | --- | --- | --- |
| KUKA, S and T | S bit 0: behind | S bit 1: A3 beyond straight | S bit 2: A5 <= 0 | T bit n: A(n+1) < 0 |
| ABB, confdata | cfx & 4: behind | cfx & 2: behind lower arm | cfx & 1: axis 5 < 0 | quadrants of 1, 4, 6 |
| FANUC, CONFIG | T front, B back | U up, D down | F: J5 >= 0, N: J5 < 0 | whole turns of J4, J5, J6 |
| Yaskawa, RCONF | 3rd: behind | 2nd: lower | 1st: R beyond 90 deg | 4th to 6th: R, T, S beyond 180 deg |

Sources: KUKA System Software, "Status" and "Turn"; ABB "confdata"; FANUC "configuration string"; Yaskawa
NX100, "Manipulator types". Forward is +x of the base where joint 1 reads 0, as all four have it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing.files.programs import Configuration, Number

Floats = NDArray[np.float64]
Forward = Callable[[Floats], Floats]  # joints [rad] to the flange in the base, shape=(4, 4) [m]

_MEET = 1e-3  # [m] axes 4, 5, 6 of a nominal robot that miss each other by more do not meet
_PARALLEL = 1e-12  # added to a sum of projections, so that parallel lines have a nearest point too
_EDGE = 2e-5  # [rad] or [m] nearer to a limit between two counts either is right: printed digits


@dataclass(frozen=True)
class Posture:
    """What configuration data are about. Angles as the controller reads them."""

    joints: Floats  # shape=(6,) [rad]
    ahead: float  # [m] of the wrist centre before axis 1
    elbow: float  # [rad] from the lower arm to the line elbow - wrist, about the robot's left
    meets: float  # [m] how far axes 4, 5, 6 miss each other

    @property
    def up(self) -> float:
        """Positive where the elbow is up, in front of axis 1 or behind it."""
        return self.elbow if self.ahead >= 0 else -self.elbow


def _axis(forward: Forward, joints: Floats, joint: int) -> tuple[Floats, Floats]:
    """The axis that a joint turns about: its direction, and its point nearest to the base."""
    turned = joints.copy()
    turned[joint] += 1.0
    before, after = forward(joints), forward(turned)
    R = after[:3, :3] @ before[:3, :3].T
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    direction = sine / math.sqrt(float(sine @ sine))
    # A turn by 1 rad about a point p moves the origin by t = (I - R) p, across the axis.
    t = after[:3, 3] - R @ before[:3, 3]
    t = t - direction * float(direction @ t)
    point = 0.5 * (t + _cross(direction, t) / math.tan(0.5))
    return direction, point


def _cross(a: Floats, b: Floats) -> Floats:
    """As numpy.cross, for one pair, which it takes longer to look at than to multiply."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _meeting_point(axes: list[tuple[Floats, Floats]]) -> tuple[Floats, float]:
    """The point nearest to all of these lines, and how far it is from the farthest."""
    across = np.array([np.eye(3) - np.outer(direction, direction) for direction, _ in axes])
    points = np.array([point for _, point in axes])
    right = np.einsum("kij,kj->i", across, points)
    # Of parallel lines one of many points.
    centre: Floats = np.linalg.solve(across.sum(axis=0) + _PARALLEL * np.eye(3), right)
    misses = np.einsum("kij,kj->ki", across, centre - points)
    return centre, float(np.linalg.norm(misses, axis=1).max())


def _circle_centre(points: list[Floats]) -> Floats:
    """Of the circle through three points."""
    a, b, c = points
    u, v = b - a, c - a
    n = _cross(u, v)
    return np.asarray(a + ((v @ v) * _cross(n, u) - (u @ u) * _cross(n, v)) / (2 * (n @ n)))


def posture_of(forward: Forward, joints: Floats) -> Posture:
    """Where wrist and elbow of a robot of six turning joints are. `forward`: of the nominal robot."""
    axes = [_axis(forward, joints, joint) for joint in (0, 3, 4, 5)]
    up, foot = axes[0]
    centre, far = _meeting_point(axes[1:])
    # The robot faces +x where joint 1 reads 0.
    c, s, x = math.cos(joints[0]), math.sin(joints[0]), np.array([1.0, 0.0, 0.0])
    front = c * x + s * _cross(up, x) + (1 - c) * np.dot(up, x) * up
    side = _cross(np.array([0.0, 0.0, 1.0]), front)
    side /= np.linalg.norm(side) or 1.0

    def in_plane(point: Floats) -> Floats:
        return np.asarray(point - np.dot(point - centre, side) * side)

    elbows = []
    for turn in (0.0, 1.0, -1.0):  # the elbow goes round the shoulder, whatever joint 3 is coupled to
        moved = joints.copy()
        moved[1] += turn
        elbows.append(in_plane(_axis(forward, moved, 2)[1]))
    lower, upper = elbows[0] - _circle_centre(elbows), centre - elbows[0]
    elbow = math.atan2(float(_cross(lower, upper) @ side), float(np.dot(lower, upper)))
    return Posture(joints, float(np.dot(centre - foot, front)), elbow, far)


# ---- What the data say -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Flag:
    """One of two: what decides, and whether it shall be positive."""

    name: str
    decides: float
    positive: bool

    def holds(self) -> bool:
        return abs(self.decides) <= _EDGE or (self.decides > 0) == self.positive


@dataclass(frozen=True)
class _Turn:
    """A count of turns: which joint, by which rule, and what it shall be."""

    name: str
    index: int  # in the configuration's values
    angle: float  # [rad]
    count: Callable[[float], int]
    wanted: int

    def holds(self) -> bool:
        return self.wanted in {self.count(self.angle + edge) for edge in (-_EDGE, 0.0, _EDGE)}


def _flags(configuration: Configuration, posture: Posture) -> Iterator[_Flag]:
    values, q = configuration.values, posture.joints
    if configuration.brand == "kuka" and (status := values[0]) is not None:
        yield _Flag("S bit 0 (front or behind)", posture.ahead, not status & 1)
        yield _Flag("S bit 1 (elbow)", posture.elbow, bool(status & 2))
        yield _Flag("S bit 2 (A5)", q[4], not status & 4)
    if configuration.brand == "abb" and (cfx := values[3]) is not None:
        yield _Flag("cfx (front or behind)", posture.ahead, not cfx & 4)
        yield _Flag("cfx (elbow)", posture.elbow, not cfx & 2)
        yield _Flag("cfx (axis 5)", q[4], not cfx & 1)
    if configuration.brand == "fanuc":
        yield _Flag("F/N (J5)", q[4], bool(values[0]))
        yield _Flag("U/D (elbow)", posture.up, bool(values[1]))
        yield _Flag("T/B (front or back)", posture.ahead, bool(values[2]))
    if configuration.brand == "yaskawa":
        yield _Flag("RCONF 1 (R within 90 deg)", math.cos(q[3]), not values[0])
        yield _Flag("RCONF 2 (elbow)", posture.up, not values[1])
        yield _Flag("RCONF 3 (front or behind)", posture.ahead, not values[2])
        for value, joint, name in ((values[3], 3, "R"), (values[4], 5, "T"), (values[5], 0, "S")):
            yield _Flag(f"RCONF ({name} within 180 deg)", math.pi - abs(q[joint]), not value)


def _negative(angle: float) -> int:
    return int(angle < 0)


def _quadrant(angle: float) -> int:
    return math.floor(angle / (math.pi / 2))


def _whole_turns(angle: float) -> int:
    return round(angle / (2 * math.pi))


def _turns(configuration: Configuration, posture: Posture) -> Iterator[_Turn]:
    values, q = configuration.values, posture.joints
    if configuration.brand == "kuka" and (turn := values[1]) is not None:
        for joint in range(6):
            yield _Turn(f"T bit {joint}", 1, q[joint], _negative, turn >> joint & 1)
    if configuration.brand == "abb":
        for index, joint in enumerate((0, 3, 5)):
            if (wanted := values[index]) is not None:
                yield _Turn(f"cf{joint + 1}", index, q[joint], _quadrant, wanted)
    if configuration.brand == "fanuc":
        for index, joint in enumerate((3, 4, 5), start=3):
            if (wanted := values[index]) is not None:
                yield _Turn(f"turn of J{joint + 1}", index, q[joint], _whole_turns, wanted)


def understood(configuration: Configuration, posture: Posture) -> str:
    """Why configuration data say nothing of this robot; "" if they do."""
    if posture.meets > _MEET:
        return (
            f"its configuration {configuration.text} is of robots whose axes 4, 5, 6 meet; here they miss by"
            f" {1e3 * posture.meets:.3g} mm"
        )
    return ""


def fits(configuration: Configuration, posture: Posture) -> bool:
    """Whether joints are those that the configuration data mean."""
    return all(flag.holds() for flag in _flags(configuration, posture)) and all(
        turn.holds() for turn in _turns(configuration, posture)
    )


def after_move(configuration: Configuration, posture: Posture) -> dict[Number, int] | str:
    """Configuration data at new joints: counts of turns to write anew, or why the target cannot be given."""
    for flag in _flags(configuration, posture):
        if not flag.holds():
            return f"the correction would change its configuration {configuration.text}: {flag.name}"
    written: dict[int, int] = {}
    for turn in _turns(configuration, posture):
        if turn.holds():
            continue
        if turn.index not in configuration.numbers:
            return f"the correction would change its configuration {configuration.text}: {turn.name}"
        if configuration.brand == "kuka":
            old = written.get(turn.index, configuration.values[turn.index] or 0)
            bit = 1 << int(turn.name.rpartition(" ")[2])
            written[turn.index] = old ^ bit
        else:
            written[turn.index] = turn.count(turn.angle)
    return {configuration.numbers[index]: value for index, value in written.items()}
