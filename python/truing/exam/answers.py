# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as a plain value, and what simpler methods would have said by the same candidates."""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

import truing

_FRAMES = frozenset({"base_frame", "tool_frame"})  # fitted anyway, never an answer
# |z| below which fitting everything names nothing: of some 60 values, noise alone stays below it in 99.6 %
_SURE = 4.0
BASELINES = ("gain", "bic", "z")


class UnreadableAnswerError(ValueError):
    """What a candidate answered cannot be read. That is the candidate's error, and a wrong answer."""


@dataclass(frozen=True)
class Named:
    """An effect that was named, and those said to look the same."""

    effect: str
    joints: tuple[str, ...]
    probability: float = 1.0
    same: tuple[tuple[str, tuple[str, ...]], ...] = ()
    share: float = math.nan  # of the gap's mean square that it is said to close
    order: float = math.nan  # of transmission_error@96
    grounds: Mapping[str, float] = field(default_factory=dict)  # what its probability was worked out from

    def members(self) -> list[tuple[str, tuple[str, ...]]]:
        return [(self.effect, self.joints), *self.same]


@dataclass(frozen=True)
class Unknown:
    joint: str
    inputs: tuple[str, ...]
    probability: float = 1.0


@dataclass(frozen=True)
class Answer:
    """What was said of one set."""

    verdict: str
    effects: tuple[Named, ...] = ()
    unknown: tuple[Unknown, ...] = ()
    not_testable: tuple[tuple[str, tuple[str, ...]], ...] = ()
    shrink: tuple[float, float, float] | None = None  # promised: value, 90 % interval
    realised: float | None = None  # on fresh poses
    fresh: Mapping[str, float] = field(
        default_factory=dict
    )  # rms error there [m] of "frames", "robot", "geometry"
    findings: tuple[str, ...] = ()  # kinds of what was said of the data themselves
    seconds: float = (
        math.nan
    )  # of the diagnosis, by the clock; with the making of its set where it did not end
    processor_seconds: float = math.nan  # of its process; NaN where that is gone
    sentence: str = ""
    error: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)  # by full name, of what was named

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def answer_from(stored: Mapping[str, Any]) -> Answer:
    """From what `Answer.to_dict` gave, be it read from JSON."""
    effects = (
        {**item, "joints": tuple(item["joints"]), "same": tuple(_pair(other) for other in item["same"])}
        for item in stored["effects"]
    )
    unknown = ({**item, "inputs": tuple(item["inputs"])} for item in stored["unknown"])
    return Answer(
        **{
            **stored,
            "effects": tuple(Named(**item) for item in effects),
            "unknown": tuple(Unknown(**item) for item in unknown),
            "not_testable": tuple(_pair(item) for item in stored["not_testable"]),
            "shrink": tuple(stored["shrink"]) if stored["shrink"] else None,
            "findings": tuple(stored["findings"]),
        }
    )


def _pair(item: Sequence[Any]) -> tuple[str, tuple[str, ...]]:
    return str(item[0]), tuple(item[1])


def failed(why: str, seconds: float = math.nan, processor_seconds: float = math.nan) -> Answer:
    """Of a diagnosis that ended in an error, or did not end."""
    return Answer("error", error=why, seconds=seconds, processor_seconds=processor_seconds)


def answer_of(diagnosis: Any) -> Answer:
    """From a `Diagnosis`, or whatever has its attributes. Raises UnreadableAnswerError."""
    try:
        return _answer_of(diagnosis)
    except UnreadableAnswerError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise UnreadableAnswerError(f"{type(error).__name__}: {error}") from error


def _answer_of(diagnosis: Any) -> Answer:
    share = diagnosis.shrink
    return Answer(
        verdict=str(diagnosis.verdict),
        effects=_once(_named(found) for found in diagnosis.effects if _plain(found.effect) not in _FRAMES),
        unknown=tuple(
            Unknown(str(u.joint), tuple(u.inputs), _probability(u.probability)) for u in diagnosis.unknown
        ),
        not_testable=tuple(_known(item) for item in diagnosis.not_testable),
        shrink=(float(share.value), float(share.low), float(share.high)),
        sentence=str(diagnosis.sentence),
        findings=tuple(str(finding.kind) for finding in diagnosis.sanity),
    )


def _once(named: Iterable[Named]) -> tuple[Named, ...]:
    """A drift that is even at first and wanders later is one drift; the first naming counts."""
    first: dict[tuple[str, tuple[str, ...]], Named] = {}
    for item in named:
        first.setdefault((item.effect, item.joints), item)
    return tuple(first.values())


def _plain(effect: str) -> str:
    """transmission_error@96 -> transmission_error."""
    return str(effect).partition("@")[0]


def _named(found: Any) -> Named:
    effect, joints = _known(found)
    same = tuple(_known(other) for other in found.confounded_with)
    probability = _probability(found.probability)
    grounds = dict(getattr(found, "grounds", {}))
    return Named(effect, joints, probability, same, float(found.share), _order(found.effect), grounds)


def _known(item: Any) -> tuple[str, tuple[str, ...]]:
    """Effect and joints; an order that comes with the effect must be one."""
    _order(item.effect)
    return _plain(item.effect), tuple(item.joints)


def _order(effect: str) -> float:
    """transmission_error@96 -> 96; NaN: none is said."""
    name, at, text = str(effect).partition("@")
    if not at:
        return math.nan
    try:
        order = float(text)
    except ValueError:
        order = math.nan
    if not (math.isfinite(order) and order > 0.0):
        raise UnreadableAnswerError(
            f"effect {effect!r}: found the order {text!r}, expected a number above 0, as in {name}@96"
        )
    return order


def _probability(said: Any) -> float:
    value = float(said)
    if not 0.0 <= value <= 1.0:
        raise UnreadableAnswerError(f"found the probability {said!r}, expected a number from 0 to 1")
    return value


def realised_shrink(diagnosis: Any, fresh: Mapping[str, float]) -> float | None:
    """Fall of the rms error on fresh poses, from the robot with fitted frames to the diagnosed one. None: it
    cannot be evaluated.
    """
    if not diagnosis.effects or diagnosis.unknown or not {"frames", "robot"} <= set(fresh):
        return None
    return 1.0 - fresh["robot"] / fresh["frames"] if fresh["frames"] > 0.0 else None


def fresh_errors(
    diagnosis: Any, robot: truing.Robot, data: truing.Measurements, fresh: truing.Measurements, geometry: bool
) -> dict[str, float]:
    """Rms errors on fresh poses [m]: of the robot with fitted frames, of the diagnosed one, and, if asked
    for, of one whose link values were identified from the same training rows: what one does who asks for no
    cause. What cannot be evaluated is left out.
    """
    robots = {"frames": diagnosis.robot_before, "robot": diagnosis.robot}
    if geometry:
        with contextlib.suppress(truing.InputError):
            train = _train(diagnosis, data)
            robots["geometry"] = truing.identify(robot, train, raise_if_not_converged=False).robot
    found = {}
    for name, made in robots.items():
        with contextlib.suppress(truing.InputError, ValueError):
            found[name] = _rms(made, fresh)
    return found


def _train(diagnosis: Any, data: truing.Measurements) -> truing.Measurements:
    """The data, those rows held out that the diagnosis did not learn from."""
    return data.replace(set=np.asarray(diagnosis.set, dtype=np.int8))


def _rms(robot: truing.Robot, data: truing.Measurements) -> float:
    with warnings.catch_warnings():  # fresh poses may be warmer or colder than any before
        warnings.simplefilter("ignore", truing.InputWarning)
        error = np.asarray(truing.residuals(robot, data).position)
    return float(np.sqrt(np.nanmean(np.sum(error**2, axis=1))))


# ---- Simpler methods -----------------------------------------------------------------------------


def baseline(
    method: str, candidates: Iterable[Any], rows: int, ignored: frozenset[str] = frozenset()
) -> Answer:
    """gain: the largest improvement of the fit; bic: the same, columns paid for; z: the largest |z| when
    everything is fitted at once.
    """
    score = {"gain": _gain, "bic": _bic, "z": _z}[method]
    entered = [c for c in candidates if _plain(c.effect) not in _FRAMES | ignored]
    rated = [(score(c, 3 * rows), c) for c in entered]
    rated = [(value, c) for value, c in rated if math.isfinite(value) and value > 0.0]
    if not rated:
        return Answer("none")
    best = max(rated, key=lambda item: item[0])[1]
    return Answer("effects", (Named(_plain(best.effect), tuple(best.joints)),))


def _gain(candidate: Any, numbers: int) -> float:
    return float(candidate.gain)


def _bic(candidate: Any, numbers: int) -> float:
    return float(candidate.gain) - float(candidate.columns) * math.log(numbers)


def _z(candidate: Any, numbers: int) -> float:
    return float(candidate.largest_z) - _SURE


def baselines(candidates: Sequence[Any], rows: int, geometry_underneath: bool) -> dict[str, Answer]:
    """Where link values are wrong everywhere, they are taken for granted: else these methods would name
    nothing else.
    """
    ignored = frozenset({"link_geometry", "joint_offset"}) if geometry_underneath else frozenset()
    return {method: baseline(method, candidates, rows, ignored) for method in BASELINES}
