# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The table of the dynamic half: its rows and targets. How rows are counted, judged and printed is that of
the static half.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from truing.exam.answers import Named
from truing.exam.dynamics.servo_score import SERVO_LINES, SERVO_MORE, of_servos
from truing.exam.score import (
    Line,
    Row,
    Scores,
    Sheet,
    both_present as every_present,
    by_family,
    calibration_row,
    called_right,
    confidently_wrong,
    cost_of,
    counted,
    drawn_anew,
    exact_set as set_exact,
    failures,
    family,
    first_right,
    place_right,
    right,
    share,
    underneath,
)

_PLAIN_KINDS = frozenset(
    {
        "armature",
        "asymmetric_friction",
        "coupling",
        "load_friction",
        "position_friction",
        "ripple",
        "time_offset",
        "viscous_law",
    }
)
"""Kinds that nothing mimics where the examiner's own columns find no other name."""
_JUST = 1e-9
_SEEN = 3.0
_CERTAIN = 0.9


def _sized(low: float, high: float = math.inf, *sources: str) -> Any:
    def chosen(s: Sheet) -> bool:
        size = s.label["size_over_noise"]
        return (
            s.label["family"] == "single"
            and s.label["source"] in sources
            and low - _JUST <= size < high - _JUST
            and s.label.get("kind") != "raw"
        )

    return chosen


def _spike(size: float) -> Any:
    return _sized(size, size + 0.1, "spike")


def _plain(s: Sheet) -> bool:
    label = s.label
    return bool(
        _sized(1.0, math.inf, "physics")(s)
        and label["effects"][0]["effect"] in _PLAIN_KINDS
        and not label["acceptable"]
    )


def _null(*kinds: str) -> Any:
    return lambda s: s.label["family"] == "none" and s.label["kind"] in kinds


def false_alarm(s: Sheet) -> bool:
    """Something is named though nothing is hidden; wrong inertials may be named."""
    beneath = underneath(s.label)
    return bool(s.answer.unknown) or any(item.effect not in beneath for item in s.answer.effects)


def _called(s: Sheet) -> bool:
    named = counted(s)
    return bool(named) and called_right(named[0], s.label) and bool(s.label["effects"][0]["joints"])


def _unlisted(s: Sheet) -> bool:
    return bool(s.label["family"] == "unlisted")


def class_returned(s: Sheet) -> bool:
    """Effect and twin are both there, at one of their joints at least: named, listed as the same, or not
    testable, and one of them is named.
    """
    named = [member for item in s.answer.effects for member in item.members()]
    untold = list(s.answer.not_testable)
    wanted = [s.label["effects"][0], s.label["rival"]]
    met = [any(_is_of(one, want) for one in named) for want in wanted]
    told = [hit or any(_is_of(one, want) for one in untold) for hit, want in zip(met, wanted, strict=True)]
    return any(met) and all(told)


def _is_of(said: tuple[str, tuple[str, ...]], want: Mapping[str, Any]) -> bool:
    joints = set(want["joints"])
    return said[0] == want["effect"] and (not joints or not said[1] or bool(joints & set(said[1])))


def single_wrong_name(s: Sheet) -> bool:
    """The twin alone for certain, or something else that is neither."""
    true, rival = s.label["effects"][0], s.label["rival"]

    def wrong(item: Named) -> bool:
        said = item.members()
        if item.probability <= _CERTAIN or any(_is_of(member, true) for member in said):
            return False
        return any(_is_of(member, rival) for member in said) or not right(item, s.label)

    return any(wrong(item) for item in s.answer.effects)


def payload_error(s: Sheet) -> float:
    """Of the mass that is said, over the true one. NaN: it was not named; a failed diagnosis is infinitely
    off.
    """
    true = s.label.get("payload_kg")
    if not true:
        return math.nan
    if s.answer.error:
        return math.inf
    last = f"link_inertia.J{len(s.label['noise_sigma'])}.m"
    said = s.answer.parameters.get("payload.m", s.answer.parameters.get(last, math.nan))
    return float(abs(said / true - 1.0))


LINES = (
    Line(
        "first_physics",
        "first-named class right, ≥ 1 × noise, physics",
        _sized(1.0, math.inf, "physics"),
        first_right,
        at_least=0.95,
    ),
    Line("first_plain", "the same of kinds that nothing mimics", _plain, first_right, at_least=0.98),
    Line(
        "spike_one",
        "spike-in on real residuals, 1 × noise: first-named right",
        _spike(1.0),
        first_right,
        at_least=0.95,
    ),
    Line("spike_half", "the same, 0.5 × noise", _spike(0.5), first_right, at_least=0.88),
    Line(
        "joint",
        "joint right given the effect",
        family("single", "double"),
        lambda s: right(counted(s)[0], s.label),
        at_least=0.98,
        given=_called,
    ),
    Line(
        "alarm_recorded",
        "false alarms: recorded spectrum",
        _null("coloured", "recorded"),
        false_alarm,
        at_most=0.03,
        good=False,
    ),
    Line("alarm_white", "false alarms: white", _null("white"), false_alarm, at_most=0.02, good=False),
    Line(
        "class", "inherently confounded: class returned", family("confounded"), class_returned, at_least=0.90
    ),
    Line(
        "class_wrong",
        "inherently confounded: confident single wrong name",
        family("confounded"),
        single_wrong_name,
        at_most=0.02,
        good=False,
    ),
    Line(
        "unlisted",
        "unlisted law: recognised",
        _unlisted,
        lambda s: bool(s.answer.unknown),
        at_least=0.85,
    ),
    Line(
        "unlisted_place",
        "unlisted law: joint and input right",
        _unlisted,
        place_right,
        at_least=0.80,
        given=lambda s: bool(s.answer.unknown),
    ),
)
FAILED = Line(
    "failed",
    "the diagnosis failed with an error, or did not end",
    lambda s: True,
    lambda s: bool(s.answer.error),
    good=False,
)
MORE = (
    Line(
        "first_departures",
        "first-named right, ≥ 1 × noise, departures",
        _sized(1.0, math.inf, "departures"),
        first_right,
    ),
    Line("spike_two", "spike-in on real residuals, 2 × noise: first-named right", _spike(2.0), first_right),
    Line(
        "spike_raw",
        "spike-in on torques as measured: named at all",
        lambda s: s.label.get("kind") == "raw",
        lambda s: any(right(item, s.label) for item in s.answer.effects),
    ),
    Line(
        "first_small",
        "first-named right, 0.5 × noise, physics and departures",
        _sized(0.0, 1.0, "physics", "departures"),
        first_right,
    ),
    Line(
        "first_inertials",
        "first-named right over wrong inertials, ≥ 1 × noise",
        lambda s: bool(_sized(1.0, math.inf, "physics")(s) and s.label["geometry_underneath"]),
        first_right,
    ),
    Line("two_exact", "two effects: exact set", family("double"), set_exact),
    Line("two_present", "two effects: both present", family("double"), every_present),
    Line("wrong_law", "right effect named first though its law is wrong", family("wrong_law"), first_right),
    Line(
        "companion",
        "a second effect named beside one of wrong law",
        family("wrong_law"),
        lambda s: len(counted(s)) > 1,
        good=False,
    ),
    Line(
        "unlisted_seen",
        "unlisted law: recognised, 3 × noise",
        lambda s: _unlisted(s) and s.label["size_over_noise"] >= _SEEN,
        lambda s: bool(s.answer.unknown),
    ),
    Line(
        "unlisted_wrong",
        "unlisted law: a listed one named for certain",
        _unlisted,
        confidently_wrong,
        good=False,
    ),
    Line(
        "unknown_of_listed",
        "“unknown” said of a listed effect",
        lambda s: s.label["family"] in ("single", "double") and s.label["source"] != "spike",
        lambda s: bool(s.answer.unknown),
        good=False,
    ),
    Line(
        "missing_wrong",
        "column withheld: confident wrong name, simulated arms",
        # What else is in a real arm's recordings nobody knows.
        lambda s: s.label["family"] == "missing" and s.label["source"] != "spike",
        confidently_wrong,
        good=False,
    ),
    Line(
        "missing_payload",
        "payload column of a real arm withheld: payload named",
        lambda s: s.label.get("kind") == "real_payload",
        lambda s: any(right(item, s.label) for item in s.answer.effects),
    ),
    FAILED,
)


def score(sheets: Sequence[Sheet], which: str = "", left_out: Mapping[str, str] | None = None) -> Scores:
    """Every row of the table, from all sheets. left_out: sets that could not be made, and why."""
    servos = [of_servos(s) for s in sheets]
    torques = not all(servos) or not servos
    first = (*(LINES if torques else ()), *(SERVO_LINES if any(servos) else ()))
    more = (*(MORE if torques else (FAILED,)), *(SERVO_MORE if any(servos) else ()))
    return Scores(
        [share(line, sheets) for line in first]
        + _values(sheets, torques)
        + [share(line, sheets) for line in more],
        {},
        failures(sheets, (*first, *more)),
        len(sheets),
        which,
        left_out=dict(left_out or {}),
        drawn_anew=drawn_anew(sheets),
        costs={name: cost_of(of) for name, of in {**by_family(sheets), "all": sheets}.items()},
    )


def _values(sheets: Sequence[Sheet], torques: bool = True) -> list[Row]:
    told = [("calibration", "stated confidence against frequency", 0.05, sheets)]
    told += [
        (f"calibration_{name}", f"the same within {name}", 0.08, of)
        for name, of in by_family(sheets).items()
        if name not in ("none", "servo_none")
    ]
    cost = cost_of(sheets)
    return [
        *([_payload_row(sheets)] if torques else []),
        _rollout_row(sheets),
        *(calibration_row(*one) for one in told),
        Row("seconds", "seconds per set, median", n=cost.sets, value=cost.median, percent=False),
        Row("seconds_p95", "seconds per set, 95th percentile", n=cost.sets, value=cost.slow, percent=False),
    ]


def _payload_row(sheets: Sequence[Sheet]) -> Row:
    """Median error of payloads that are named, where all inertias that were handed over are right."""
    errors = [payload_error(s) for s in sheets if s.label["family"] == "single"]
    known = np.array([error for error in errors if not math.isnan(error)])
    value = 100.0 * float(np.median(known)) if len(known) else math.nan
    met = value <= 3.0 if len(known) else None
    return Row(
        "payload_mass",
        "payload mass with known gain: median error [%]",
        "≤ 3",
        n=len(known),
        value=value,
        met=met,
        percent=False,
    )


def _rollout_row(sheets: Sequence[Sheet]) -> Row:
    """Promised against realised fall of the simulated motion's error, where a diagnosis says both."""
    wrong = [
        abs(s.answer.shrink[0] - s.answer.realised)
        for s in sheets
        if not s.label["family"].endswith("unlisted") and s.answer.shrink and s.answer.realised is not None
    ]
    value = 100.0 * float(np.median(wrong)) if wrong else math.nan
    return Row(
        "rollout",
        "predicted roll-out improvement against realised: median difference [points]",
        "≤ 5",
        n=len(wrong),
        value=value,
        met=value <= 5.0 if wrong else None,
        percent=False,
        note="" if wrong else "no diagnosis says both",
    )
