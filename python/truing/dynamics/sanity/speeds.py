# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Speeds as recorded against derivatives of the angles: units, signs, order of columns, clocks.

A derivative is no model: what it proves is certain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid

Floats = NDArray[np.float64]

DEGREE = math.pi / 180.0
# Recorded speed over derivative of the recorded angle: what speed and angle then are.
_TURNING = {
    1.0 / DEGREE: ("deg/s", ""),
    60.0 / (2.0 * math.pi): ("rpm", ""),
    1.0 / (2.0 * math.pi): ("turns/s", ""),
    DEGREE: ("", "deg"),
    1.0 / 6.0: ("rpm", "deg"),
}
_SLIDING = {1e3: ("mm/s", ""), 1e-3: ("", "mm")}
_SIZE = {"deg/s": DEGREE, "rpm": 2.0 * math.pi / 60.0, "turns/s": 2.0 * math.pi, "mm/s": 1e-3}
_POSITION_SIZE = {"deg": DEGREE, "mm": 1e-3}
_FEWEST = 50  # rows: of fewer a correlation says nothing
ROWS = 500  # of a recording, evenly picked
ALIKE = 0.95  # correlation of a speed with the derivative: it is that joint's
OTHER = 0.8  # correlation below which a speed is not that of its joint
UNIT = 0.03  # relative: a ratio that is a unit's
RATIO = 0.1  # relative: a ratio that is none
LATEST = 0.25  # [s] largest shift that is looked for
LAG = 0.02  # [s] from here on, and from a step of the recording on, a shift is said
LAG_SPREAD = 0.25  # of the shift: joints must agree on it


@dataclass(frozen=True)
class _Match:
    """Of one joint of a recording: its speed column against the derivative of its angle."""

    ratio: float
    correlation: float
    lag: float  # [s] by which the speed is late


def speeds(
    robot: _core.Robot, grids: Sequence[Grid]
) -> tuple[list[RecordingFinding], dict[str, Floats], dict[str, Floats]]:
    """Findings; and by recording what its speeds (`[0]`) and its angles are to be multiplied by."""
    joints = driven_joints(robot)
    kinds: dict[tuple[str, str], list[tuple[str, int, float]]] = {}
    by_speed: dict[str, Floats] = {}
    by_angle: dict[str, Floats] = {}
    for grid in grids:
        if not grid.speed.shape[1]:
            continue
        by_speed[grid.name], by_angle[grid.name] = np.ones(len(joints)), np.ones(len(joints))
        matches = {k: _match(grid, k) for k in range(len(joints))}
        for k, match in matches.items():
            if match is None:
                continue
            units = _TURNING if joints[k].type == "revolute" else _SLIDING
            kind, word, of_speed, of_angle = _judged(match, units)
            if not kind:
                continue
            value = match.correlation if kind == "speed_mismatch" else match.ratio
            kinds.setdefault((kind, word), []).append((grid.name, k, value))
            by_speed[grid.name][k] *= of_speed
            by_angle[grid.name][k] *= of_angle
        late = [m.lag for m in matches.values() if m is not None and abs(m.correlation) > ALIKE]
        lag = _common(late, max(LAG, grid.raw_step))
        if lag:
            kinds.setdefault(("speed_lag", ""), []).append((grid.name, -1, lag))
    names = [joint.name for joint in joints]
    found = [_finding(kind, word, cases, names) for (kind, word), cases in kinds.items()]
    return found, by_speed, by_angle


def _match(grid: Grid, k: int) -> _Match | None:
    """None: the joint does not move, or its speed was not recorded."""
    rows = grid.rows[grid.moving[grid.rows, k]]
    speed, rate = grid.speed[:, k], grid.qd[:, k]
    if len(rows) < _FEWEST or np.isnan(speed[0]) or np.ptp(speed) == 0.0:
        return None
    reach = int(LATEST / grid.step)
    rows = rows[(rows >= reach) & (rows < len(rate) - reach)]
    rows = rows[:: max(1, len(rows) // ROWS)]
    if len(rows) < _FEWEST:
        return None
    shifts = np.arange(-reach, reach + 1)
    coarse = shifts[:: max(1, reach // 8)]
    scores = np.array([_correlation(speed[rows + s], rate[rows]) for s in coarse])
    centre = coarse[int(np.argmax(np.abs(scores)))]
    near = shifts[np.abs(shifts - centre) <= max(1, reach // 8)]
    scores = np.array([_correlation(speed[rows + s], rate[rows]) for s in near])
    best = int(np.argmax(np.abs(scores)))
    lag = near[best] + vertex(np.abs(scores), best)
    ratio = float(rate[rows] @ speed[rows + near[best]] / (rate[rows] @ rate[rows]))
    return _Match(ratio, float(scores[best]), float(lag) * grid.step)


def _correlation(x: Floats, y: Floats) -> float:
    norm = math.sqrt(float(x @ x) * float(y @ y))
    return float(x @ y) / norm if norm > 0.0 else 0.0


def vertex(scores: Floats, best: int) -> float:
    """Of the parabola through a largest score and its neighbours, in steps from it."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    before, here, after = scores[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return float(0.5 * (before - after) / bend) if bend < 0.0 else 0.0


def _judged(match: _Match, units: Mapping[float, tuple[str, str]]) -> tuple[str, str, float, float]:
    """Kind, words, and the factors that mend it, of the speed and of the angle."""
    if abs(match.correlation) < ALIKE:
        return ("" if abs(match.correlation) > OTHER else "speed_mismatch"), "", 1.0, 1.0
    sign, size = math.copysign(1.0, match.ratio), abs(match.ratio)
    for ratio, (speed, angle) in units.items():
        if abs(size / ratio - 1.0) > UNIT:
            continue
        words = " and the speed in ".join(word for word in (angle, speed) if word)
        kind = "position_unit" if angle else "speed_unit"
        return kind, words, sign * _SIZE.get(speed, 1.0), _POSITION_SIZE.get(angle, 1.0)
    if abs(size - 1.0) > RATIO:
        return "speed_scale", "", 1.0, 1.0
    return ("speed_sign" if sign < 0 else ""), "", sign, 1.0


def _common(late: Sequence[float], least: float) -> float:
    """The shift [s] that the joints agree on; 0: none that is worth a word."""
    if not late:
        return 0.0
    middle = float(np.median(late))
    spread = float(np.median(np.abs(np.array(late) - middle)))
    return middle if abs(middle) > least and spread < LAG_SPREAD * abs(middle) else 0.0


def _finding(
    kind: str, word: str, cases: Sequence[tuple[str, int, float]], names: Sequence[str]
) -> RecordingFinding:
    recordings = tuple(dict.fromkeys(case[0] for case in cases))
    joints = tuple(names[k] for k in sorted({case[1] for case in cases if case[1] >= 0}))
    value = float(np.median([case[2] for case in cases]))
    where = f"{listed(recordings)}{f' ({listed(joints)})' if joints else ''}: "
    ratio = f"{abs(value):.4g} times the derivative of the angle"
    applied = kind in ("speed_unit", "speed_sign", "position_unit")
    words, unit = {
        "speed_unit": (f"the speed is {ratio}, so it is in {word}; it is converted", "-"),
        "speed_sign": ("the speed has the sign opposite to the derivative of the angle; it is turned", "-"),
        "position_unit": (f"the speed is {ratio}, so the angle is in {word}; it is converted", "-"),
        "speed_scale": (f"the speed is {ratio}, which is no unit's: of the motor, before the gear?", "-"),
        "speed_mismatch": (
            f"the speed is not the derivative of the angle (correlation {value:.2f}): another"
            " joint's column?",
            "-",
        ),
        "speed_lag": (f"the speed is {1000 * value:.0f} ms late against the derivative of the angle", "s"),
    }[kind]
    if kind == "speed_lag" and value < 0:
        words = f"the speed is {-1000 * value:.0f} ms ahead of the derivative of the angle"
    return RecordingFinding(kind, recordings, joints, where + words, value, unit, applied)
