# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a dynamic diagnosis said of a set, in the examiner's own form: the one place that knows its
attributes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from truing.exam.answers import Answer, Named, Unknown, UnreadableAnswerError

STANDARD = frozenset({"coulomb", "viscous", "current_offset"})
"""Standard practice: fitted anyway, never an answer."""
_INPUTS = (
    ("temperature", r"temp"),
    ("time", r"\btime\b|^t$"),
    ("torque", r"torque|load|\btau"),
    ("acceleration", r"accel|\bqdd"),
    ("speed", r"speed|veloc|\bqd"),
    ("angle", r"angle|position|\bq\d*\b"),
)


def answer_of(diagnosis: Any, usual: bool = False) -> Answer:
    """From what `truing.dynamics.diagnose` gives, or whatever has its attributes: effects (effect, joints,
    probability, confounded_with; parameters, share), unknown (joint, input), verdict; not_testable, shrink,
    sentence where there are any. usual: what everybody fits is an answer as well, since it is what was hidden
    or looks the same; so are the members of classes. Raises UnreadableAnswerError.
    """
    try:
        return _answer_of(diagnosis, usual)
    except UnreadableAnswerError:
        raise
    except (AttributeError, TypeError, ValueError) as error:
        raise UnreadableAnswerError(f"{type(error).__name__}: {error}") from error


def _answer_of(diagnosis: Any, usual: bool) -> Answer:
    effects = [found for found in diagnosis.effects if usual or not _is_standard(found)]
    return Answer(
        verdict=str(diagnosis.verdict),
        effects=tuple(_named(found) for found in effects),
        unknown=tuple(_unknown(one) for one in diagnosis.unknown),
        not_testable=(*_not_testable(diagnosis), *(_of_classes(diagnosis) if usual else ())),
        shrink=_shrink(getattr(diagnosis, "shrink", None)),
        sentence=str(getattr(diagnosis, "sentence", "")),
        parameters={name: value for found in effects for name, value in _parameters(found).items()},
    )


def _is_standard(found: Any) -> bool:
    return str(found.effect) in STANDARD or bool(getattr(found, "standard", False))


def _not_testable(diagnosis: Any) -> list[tuple[str, tuple[str, ...]]]:
    return [_known(item) for item in getattr(diagnosis, "not_testable", ()) if hasattr(item, "effect")]


def _of_classes(diagnosis: Any) -> list[tuple[str, tuple[str, ...]]]:
    """Members of classes that are told by name: "payload", "command_gain:J2"."""
    names = [name for one in getattr(diagnosis, "classes", ()) for name in getattr(one, "effects", ())]
    told = [str(name).partition(":") for name in names if isinstance(name, str)]
    return [(effect, (joint,) if joint else ()) for effect, _, joint in told]


def realised(diagnosis: Any, kept_back: Sequence[Path]) -> float | None:
    """How far the simulated motion's error falls on recordings that nobody had, as a share, where a diagnosis
    can say it: `improvement_on(files)`, the counterpart of its `shrink`.
    """
    found = getattr(diagnosis, "improvement_on", None)
    return float(found(list(kept_back))) if found and kept_back else None


def _named(found: Any) -> Named:
    effect, joints = _known(found)
    same = tuple(_known(other) for other in found.confounded_with)
    probability = float(found.probability)
    if not 0.0 <= probability <= 1.0:
        raise UnreadableAnswerError(
            f"found the probability {found.probability!r} of {effect}, expected a number from 0 to 1"
        )
    share = getattr(found, "share", math.nan)
    grounds = dict(getattr(found, "grounds", {}))
    return Named(effect, joints, probability, same, float(getattr(share, "value", share)), grounds=grounds)


def _known(item: Any) -> tuple[str, tuple[str, ...]]:
    return str(item.effect), tuple(str(joint) for joint in item.joints)


def _unknown(one: Any) -> Unknown:
    joint = str(one.joint)
    said = getattr(one, "inputs", None)
    inputs = [str(text) for text in said] if said is not None else [str(one.input)]
    found = sorted({plain for text in inputs for plain in inputs_in(text, joint)})
    return Unknown(joint, tuple(found), float(getattr(one, "probability", 1.0)))


def inputs_in(text: str, joint: str) -> list[str]:
    """An input in the examiner's words: "direction x torque" is the torque's, "q3" at J5 is "angle J3"."""
    low = text.lower()
    plain = next((name for name, pattern in _INPUTS if re.search(pattern, low)), low)
    number = re.search(r"(?:\bj|\bq|\bqd|\btau)(\d+)", low)
    if number and f"J{number.group(1)}" != joint:
        return [f"{plain} J{number.group(1)}"]
    return [plain]


def _parameters(found: Any) -> Mapping[str, float]:
    told = getattr(found, "parameters", ())
    if isinstance(told, Mapping):
        return {str(name): float(value) for name, value in told.items()}
    return {str(one.name): float(one.value) for one in told}


def _shrink(told: Any) -> tuple[float, float, float] | None:
    return None if told is None else (float(told.value), float(told.low), float(told.high))
