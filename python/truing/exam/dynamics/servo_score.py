# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Rows of the table for servo arms, of which commands and motion are known and no torque."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from truing.exam.answers import Named
from truing.exam.score import (
    Line,
    Sheet,
    called_right,
    confidently_wrong,
    counted,
    family,
    first_right,
    place_right,
    right,
    underneath,
)

_JUST = 1e-9
_CERTAIN = 0.9
_SMALL = 0.02
"""Share of the motion below which nothing is asked for by the targets."""


def of_servos(s: Sheet) -> bool:
    return str(s.label["family"]).startswith("servo_")


def _sized(size: float) -> Any:
    """One effect of this share of the motion."""
    return lambda s: s.label["family"] == "servo_single" and abs(s.label["size_over_noise"] - size) < _JUST


def _usual(s: Sheet) -> bool:
    return bool(s.label["family"] == "servo_single" and s.label["usual"])


def _null(wrong: bool) -> Any:
    return lambda s: s.label["family"] == "servo_none" and s.label["geometry_underneath"] == wrong


def false_alarm(s: Sheet) -> bool:
    """Something is named though nothing is hidden; wrong usual parameters may be named."""
    beneath = underneath(s.label)
    return bool(s.answer.unknown) or any(item.effect not in beneath for item in s.answer.effects)


def _called(s: Sheet) -> bool:
    named = counted(s)
    return bool(named) and called_right(named[0], s.label) and bool(s.label["effects"][0]["joints"])


def _is_of(said: tuple[str, tuple[str, ...]], want: Mapping[str, Any]) -> bool:
    joints = set(want["joints"])
    return said[0] == want["effect"] and (not joints or not said[1] or bool(joints & set(said[1])))


def class_returned(s: Sheet) -> bool:
    """Effect and one of its twins are both there: named, listed as the same, or members of a class that is
    told; and one of them is named.
    """
    named = [member for item in s.answer.effects for member in item.members()]
    told = [*named, *s.answer.not_testable]
    true, rivals = [s.label["effects"][0]], s.label["rivals"]
    met = any(_is_of(one, want) for one in named for want in (*true, *rivals))
    return met and all(any(_is_of(one, want) for one in told for want in names) for names in (true, rivals))


def single_wrong_name(s: Sheet) -> bool:
    """A twin alone for certain, or something else, and no class that has the effect."""
    true = s.label["effects"][0]

    def wrong(item: Named) -> bool:
        said = item.members()
        return item.probability > _CERTAIN and not any(_is_of(member, true) for member in said)

    untold = not any(_is_of(one, true) for one in s.answer.not_testable)
    return untold and any(wrong(item) for item in s.answer.effects)


SERVO_LINES = (
    Line(
        "servo_first",
        "servo arms, 3 % of the motion: first-named class right",
        _sized(0.03),
        first_right,
        at_least=0.92,
    ),
    Line(
        "servo_joint",
        "servo arms: joint right given the effect",
        family("servo_single"),
        lambda s: right(counted(s)[0], s.label),
        at_least=0.98,
        given=_called,
    ),
    Line(
        "servo_alarm",
        "servo arms: false alarms",
        family("servo_none"),
        false_alarm,
        at_most=0.03,
        good=False,
    ),
    Line(
        "servo_unlisted",
        "servo arms, unlisted law of 3 % or more: recognised",
        lambda s: s.label["family"] == "servo_unlisted" and s.label["size_over_noise"] > _SMALL,
        lambda s: bool(s.answer.unknown),
        at_least=0.85,
    ),
    Line(
        "servo_class",
        "servo arms, inherently confounded: class said",
        family("servo_confounded"),
        class_returned,
        at_least=0.90,
    ),
)
SERVO_MORE = (
    Line(
        "servo_first_large",
        "servo arms, 10 % of the motion: first-named class right",
        _sized(0.10),
        first_right,
    ),
    Line(
        "servo_first_small",
        "servo arms, 1 % of the motion: first-named class right",
        _sized(0.01),
        first_right,
    ),
    Line(
        "servo_named",
        "servo arms, 3 % or more: named at all",
        lambda s: s.label["family"] == "servo_single" and s.label["size_over_noise"] > _SMALL,
        lambda s: any(right(item, s.label) for item in s.answer.effects),
    ),
    Line(
        "servo_usual",
        "servo arms: a wrong gain or delay of one joint said first",
        _usual,
        first_right,
    ),
    Line(
        "servo_alarm_right",
        "servo arms: false alarms, usual parameters right",
        _null(False),
        false_alarm,
        good=False,
    ),
    Line(
        "servo_class_wrong",
        "servo arms, inherently confounded: confident single wrong name",
        family("servo_confounded"),
        single_wrong_name,
        good=False,
    ),
    Line(
        "servo_unlisted_small",
        "servo arms, unlisted law of 1 %: recognised",
        lambda s: s.label["family"] == "servo_unlisted" and s.label["size_over_noise"] <= _SMALL,
        lambda s: bool(s.answer.unknown),
    ),
    Line(
        "servo_place",
        "servo arms, unlisted law: joint and input right",
        family("servo_unlisted"),
        place_right,
        given=lambda s: bool(s.answer.unknown),
    ),
    Line(
        "servo_unlisted_wrong",
        "servo arms, unlisted law: a listed one named for certain",
        family("servo_unlisted"),
        confidently_wrong,
        good=False,
    ),
    Line(
        "servo_unknown",
        "servo arms: “unknown” said of a listed effect",
        family("servo_single"),
        lambda s: bool(s.answer.unknown),
        good=False,
    ),
    Line(
        "servo_missing",
        "servo arms, column withheld: confident wrong name",
        family("servo_missing"),
        confidently_wrong,
        good=False,
    ),
)
