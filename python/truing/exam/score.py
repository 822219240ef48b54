# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""From answers and opened labels to the table of scores."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.exam.answers import Answer, Named, Unknown
from truing.exam.names import FINDINGS

_Z90 = 1.6448536269514722
_CONFIDENT = 0.9
_GEOMETRY = ("link_geometry", "joint_offset")  # what lies underneath, by either name
_RECORDED = frozenset({"transmission_error"})
"""What lies under spikes: recorded arms have teeth, which no flexible fit of smooth functions takes away."""
_SHARED = frozenset({"several", "teeth"})  # one cause on several joints: the smallest may be named or not
_WHOLE = frozenset({"drift", "scale", "joint_coupling", "time_offset"})
Floats = NDArray[np.float64]
_BINS = 10
_DRAWS = 1000  # of hits by stated probabilities
_SMALL_SHARE = 0.02
_TOLD = 5  # sets that a message names
_FEWEST = 20  # names of a family from which its ECE is judged: of fewer, ten bins show chance
MARKER = ("<!-- scores -->", "<!-- /scores -->")

Label = dict[str, Any]
Effect = tuple[str, tuple[str, ...]]


@dataclass(frozen=True)
class Sheet:
    """One set: its label, opened, and the answers to it."""

    id: str
    label: Label
    answer: Answer
    others: dict[str, Answer] = field(default_factory=dict)  # of simpler methods


@dataclass(frozen=True)
class Row:
    """One line of the table. A share with its counts, or a value."""

    key: str
    text: str
    target: str = ""
    hits: int = 0
    n: int = 0
    value: float = math.nan
    met: bool | None = None
    percent: bool = True
    brier: float = math.nan  # beside a calibration error
    chance: tuple[float, float] = (math.nan, math.nan)  # that error of exact probabilities: mean, 95 % below
    note: str = ""  # why it is not judged

    def interval(self) -> tuple[float, float]:
        return wilson(self.hits, self.n) if self.percent and self.n else (math.nan, math.nan)


def wilson(hits: int, n: int, z: float = _Z90) -> tuple[float, float]:
    """90 % interval of a share (Wilson 1927)."""
    if n == 0:
        return 0.0, 1.0
    p = hits / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)


# ---- What is right -------------------------------------------------------------------------------


def _pairs(items: Iterable[dict[str, Any]]) -> list[Effect]:
    return [(str(item["effect"]), tuple(item["joints"])) for item in items]


def same(said: Effect, true: Effect) -> bool:
    """The same effect at the same joints. Of geometry it is enough that the joint is among those named; an
    effect of the robot as a whole may be said of any joint.
    """
    if said[0] != true[0]:
        return False
    if true[0] in _WHOLE or not true[1]:
        return True
    if true[0] == "link_geometry":
        return not said[1] or set(true[1]) <= set(said[1])
    return set(said[1]) == set(true[1])


def holds(named: Named, true: Effect) -> bool:
    """Whether a named effect or one of its class is the true one."""
    return any(same(member, true) for member in named.members())


def right(named: Named, label: Label) -> bool:
    """A true effect, or one that looks the same by the label. Said of several joints at once, it is so at
    each.
    """
    every = _pairs(label["effects"]) + _pairs(label["acceptable"])
    return any(
        any(same(member, true) for true in every)
        or all(any(same(part, true) for true in every) for part in _parts(member))
        for member in named.members()
    )


def stands_for(named: Named, label: Label, place: int) -> bool:
    """Whether a name is the true effect at this place in the label, or one of those that the examiner holds
    for the same as this one. What looks like another effect does not stand for it.
    """
    own = [_pairs(label["effects"])[place]]
    own += _pairs(item for item in label["acceptable"] if item.get("of") == place)
    if any(holds(named, one) for one in own):
        return True
    parts = [part for member in named.members() for part in _parts(member)]
    return right(named, label) and any(same(part, one) for part in parts for one in own)


def _parts(said: Effect) -> list[Effect]:
    """An effect of several joints, joint by joint."""
    return [(said[0], (joint,)) for joint in said[1]] or [said]


def among(named: Named, label: Label, true: Effect) -> bool:
    """Whether the true effect is named: by itself, or rightly among several joints."""
    if holds(named, true):
        return True
    return right(named, label) and any(same(part, true) for m in named.members() for part in _parts(m))


def called_right(named: Named, label: Label) -> bool:
    """The kind of effect is right, wherever."""
    said = {effect for effect, _ in named.members()}
    return bool(said & {effect for effect, _ in _pairs(label["effects"]) + _pairs(label["acceptable"])})


def underneath(label: Label) -> frozenset[str]:
    """What is rightly named of any joint: link values, or inertias, are wrong, or the recording has it."""
    recorded = _RECORDED if label["source"] == "spike" else frozenset()
    if not label["geometry_underneath"]:
        return recorded
    return recorded | frozenset(label.get("underneath", _GEOMETRY))


def counted(sheet: Sheet) -> list[Named]:
    """Named effects, without what is wrong underneath: naming that is right and says nothing."""
    named = list(sheet.answer.effects)
    beneath = underneath(sheet.label)
    others = [item for item in named if item.effect not in beneath or right(item, sheet.label)]
    return others or named


def first_right(sheet: Sheet) -> bool:
    named = counted(sheet)
    return bool(named) and right(named[0], sheet.label)


def main_first(sheet: Sheet) -> bool:
    """The label's first effect is named first, or what looks the same as this one."""
    named = counted(sheet)
    return bool(named) and stands_for(named[0], sheet.label, 0)


def exact_set(sheet: Sheet) -> bool:
    named = counted(sheet)
    return (
        both_present(sheet)
        and not sheet.answer.unknown
        and all(right(item, sheet.label) for item in named)
        and (len(named) == len(sheet.label["effects"]) or sheet.label["family"] in _SHARED)
    )


def both_present(sheet: Sheet) -> bool:
    """Every true effect is named, or one that looks like this one, each by another name."""
    named, label = counted(sheet), sheet.label
    truths = _pairs(label["effects"])
    missed = [k for k, true in enumerate(truths) if not any(among(item, label, true) for item in named)]
    rest = [item for item in named if not any(among(item, label, true) for true in truths)]
    return _all_taken([{n for n, item in enumerate(rest) if stands_for(item, label, k)} for k in missed])


def _all_taken(choices: Sequence[set[int]]) -> bool:
    """Whether each can be given one of its choices, and none is given twice."""
    if not choices:
        return True
    first, *others = choices
    return any(_all_taken([choice - {taken} for choice in others]) for taken in first)


def _not_testable(sheet: Sheet, true: Effect) -> bool:
    return any(
        effect == true[0] and (not joints or not true[1] or set(true[1]) <= set(joints))
        for effect, joints in sheet.answer.not_testable
    )


def class_returned(sheet: Sheet) -> bool:
    """Effect and twin are both there: named, listed as the same, or declared untestable, and one of them is
    named.
    """
    label, named = sheet.label, sheet.answer.effects
    others = [item for item in label["acceptable"] if item.get("of") == 0]
    true = _pairs([label["effects"][0], *others])
    rival = _pairs([label["rival"], *label.get("rival_names", [])])
    met = [any(_covers(item, one) for item in named for one in names) for names in (true, rival)]
    told = [
        hit or any(_not_testable(sheet, one) for one in names)
        for hit, names in zip(met, (true, rival), strict=True)
    ]
    return any(met) and all(told)


def _covers(named: Named, one: Effect) -> bool:
    """Three zones of stiffness are a linear spring with room to spare."""
    zones = ("stiffness_zones", one[1]) if one[0] == "joint_compliance" else one
    return holds(named, one) or holds(named, zones)


def confidently_wrong(sheet: Sheet) -> bool:
    """Some name is given as all but certain, and the true effect is not in its class."""
    truths = _pairs(sheet.label["effects"])
    return any(
        item.probability > _CONFIDENT and not _excused(sheet, item, truths) for item in sheet.answer.effects
    )


def _excused(sheet: Sheet, item: Named, truths: Sequence[Effect]) -> bool:
    if any(holds(item, true) or _not_testable(sheet, true) and right(item, sheet.label) for true in truths):
        return True
    inside = item.effect == "link_geometry" and any(
        true[0] == "joint_offset" and set(true[1]) <= set(item.joints) for true in truths
    )
    beneath = item.effect in underneath(sheet.label)
    if sheet.label["family"] == "confounded":  # the twin alone, for certain, is what must not be said
        return inside or beneath
    return inside or beneath or right(item, sheet.label)


def false_alarm(sheet: Sheet) -> bool:
    """Something is named though nothing is wrong. The drift of a wandering frame is right."""
    return bool(sheet.answer.unknown) or any(not right(item, sheet.label) for item in sheet.answer.effects)


def place_right(sheet: Sheet) -> bool:
    """Joint and input of an unlisted effect. Of two inputs one is enough if nothing else is said."""
    if not sheet.answer.unknown:
        return False
    found, label = sheet.answer.unknown[0], sheet.label
    places = label.get("places", [[label["unlisted_joint"], label["unlisted_inputs"]]])
    return any(_is_at(found, joint, set(inputs)) for joint, inputs in places)


def _is_at(found: Unknown, joint: str, wanted: set[str]) -> bool:
    """joint: "" is any."""
    said = set(found.inputs)
    inputs = wanted <= said if len(wanted) == 1 else bool(said) and said <= wanted
    return inputs and joint in ("", found.joint)


def first_or_unknown(sheet: Sheet) -> bool:
    """The effect is named first, or called unknown at the right joint and input: nameless, but no error."""
    return first_right(sheet) or place_right(sheet)


def order_right(sheet: Sheet) -> bool:
    """Some true joint has the true order per turn, or one that no pose of an even grid tells from it."""
    order, spacing = float(sheet.label["order"]), sheet.label["spacing"]
    for item in sheet.answer.effects:
        for joint in set(item.joints) & set(spacing):
            if math.isfinite(item.order) and _same_order(item.order, order, float(spacing[joint])):
                return True
    return False


def _same_order(said: float, true: float, spacing: float) -> bool:
    """To half an order, or sum or difference is a whole number of the grid's steps per turn."""
    per_turn = 2.0 * math.pi / spacing if spacing > 0.0 else math.inf
    off = [abs(said - true), said + true]
    if math.isfinite(per_turn):
        off = [min(value % per_turn, -value % per_turn) for value in off]
    return off[0] <= 0.5 or (math.isfinite(per_turn) and off[1] <= 0.5)


def told_or_untestable(sheet: Sheet) -> bool:
    return first_right(sheet) or any(_not_testable(sheet, true) for true in _pairs(sheet.label["effects"]))


def mistake_told(sheet: Sheet) -> bool:
    """What is wrong with the columns is said, or that what was found does not hold."""
    said = FINDINGS[sheet.label["mistake"]] & set(sheet.answer.findings)
    return bool(said) or sheet.answer.verdict == "does_not_hold"


def worse_than(sheet: Sheet, other: str, by: float = 1.05) -> bool:
    """Whether the diagnosed robot is worse than another one on fresh poses. No result counts as worse."""
    fresh = sheet.answer.fresh
    if "robot" not in fresh:
        return True
    return other in fresh and fresh["robot"] > by * fresh[other]


def small_false_name(sheet: Sheet) -> bool:
    """A name that is not in the truth, of what closes less than 2 % of the gap."""
    return any(item.share < _SMALL_SHARE and not _excusable(sheet, item) for item in counted(sheet))


def _excusable(sheet: Sheet, item: Named) -> bool:
    return item.effect in underneath(sheet.label) or right(item, sheet.label)


# ---- The table -----------------------------------------------------------------------------------


Test = Callable[[Sheet], bool]


@dataclass(frozen=True)
class Line:
    """A row that is a share: of the sets chosen, those that pass. A failed diagnosis is a failure in each."""

    key: str
    text: str
    chosen: Test  # by the label
    passed: Test
    at_least: float = math.nan
    at_most: float = math.nan
    good: bool = True  # whether a set that passes is a success (else a failure)
    given: Test | None = None  # of the chosen only those with such an answer, or with none at all

    def of(self, sheets: Sequence[Sheet]) -> list[Sheet]:
        """The sets that count."""
        chosen = [sheet for sheet in sheets if self.chosen(sheet)]
        return [sheet for sheet in chosen if sheet.answer.error or self.given is None or self.given(sheet)]

    def passes(self, sheet: Sheet) -> bool:
        return not self.good if sheet.answer.error else self.passed(sheet)


def family(*families: str) -> Test:
    return lambda s: s.label["family"] in families


def _single(sources: Sequence[str], low: float, high: float = math.inf) -> Test:
    return lambda s: (
        s.label["family"] == "single"
        and s.label["source"] in sources
        and low <= s.label["size_over_noise"] < high
    )


def _none(*kinds: str) -> Test:
    return lambda s: s.label["family"] == "none" and s.label["kind"] in kinds


def _many(count: int) -> Test:
    return lambda s: s.label["family"] == "double" and len(s.label["effects"]) == count


def _unlisted(s: Sheet) -> bool:
    return bool(s.label["family"] == "unlisted" and s.label["size_over_noise"] >= 3.0)


def _known_background(s: Sheet) -> bool:
    """Listed effects on robots that hide nothing else; what real recordings hide nobody knows."""
    return s.label["family"] in ("single", "double") and s.label["source"] != "spike"


def _mistake(kind: str) -> Test:
    return lambda s: s.label["family"] == "mistaken" and s.label["mistake"] == kind


def _machine(kind: str) -> Test:
    return lambda s: s.label["family"] == "machines" and s.label["kind"] == kind


def _teeth(kind: str) -> Test:
    return lambda s: s.label["family"] == "teeth" and s.label["kind"] == kind


def _known_truth(s: Sheet) -> bool:
    """Sets of which all that is hidden is known and listed."""
    return bool(
        s.label["effects"]
        and s.label["source"] != "spike"
        and s.label["family"] not in ("missing", "confounded")
    )


def _called(s: Sheet) -> bool:
    return bool(counted(s)) and called_right(counted(s)[0], s.label) and counted(s)[0].effect not in _WHOLE


LINES = (
    Line(
        "first_physics",
        "first-named effect right, ≥ 1 × noise, physics",
        _single(["physics"], 1.0),
        first_right,
        at_least=0.98,
    ),
    Line(
        "first_departures",
        "the same on departures and spike-in",
        _single(["departures", "spike"], 1.0),
        first_right,
        at_least=0.94,
    ),
    Line(
        "joint",
        "joint right given the effect",
        family("single", "double"),
        lambda s: right(counted(s)[0], s.label),
        at_least=0.98,
        given=_called,
    ),
    Line("two_exact", "two effects: exact set", _many(2), exact_set, at_least=0.88),
    Line("two_present", "two effects: both present", _many(2), both_present, at_least=0.96),
    Line(
        "class", "confounded by design: class returned", family("confounded"), class_returned, at_least=0.95
    ),
    Line(
        "class_wrong",
        "confounded by design: confident single wrong name",
        family("confounded"),
        confidently_wrong,
        at_most=0.01,
        good=False,
    ),
    Line("alarm_white", "false alarms: white noise", _none("white"), false_alarm, at_most=0.01, good=False),
    Line(
        "alarm_other",
        "false alarms: drift, heavy tails, outliers",
        _none("drift", "heavy", "outliers"),
        false_alarm,
        at_most=0.01,
        good=False,
    ),
    Line(
        "unlisted",
        "unlisted effect recognised, ≥ 3 × noise",
        _unlisted,
        lambda s: bool(s.answer.unknown),
        at_least=0.93,
    ),
    Line(
        "unknown_of_listed",
        "“unknown” said of a listed effect",
        _known_background,
        lambda s: bool(s.answer.unknown),
        at_most=0.04,
        good=False,
    ),
    Line(
        "unlisted_place",
        "joint and input of the unlisted effect right",
        _unlisted,
        place_right,
        at_least=0.90,
        given=lambda s: bool(s.answer.unknown),
    ),
    Line(
        "unlisted_wrong",
        "unlisted effect: a listed one named for certain",
        family("unlisted"),
        confidently_wrong,
        at_most=0.03,
        good=False,
    ),
    Line(
        "wrong_law",
        "right effect named first though its law is wrong",
        family("wrong_law"),
        first_right,
        at_least=0.88,
    ),
    Line("three_exact", "three effects: exact set", _many(3), exact_set, at_least=0.82),
    Line("three_present", "three effects: all present", _many(3), both_present, at_least=0.93),
    Line(
        "few_worse",
        "25-70 poses: robot.yaml worse than geometry alone on fresh poses by > 5 %",
        family("few"),
        lambda s: worse_than(s, "geometry"),
        at_most=0.02,
        good=False,
    ),
)
# Told as well, without a target.
MORE = (
    Line(
        "first_small",
        "first-named effect right, 0.5 to 1 × noise",
        _single(["physics", "departures", "spike"], 0.0, 1.0),
        first_right,
    ),
    Line(
        "first_spike",
        "first-named effect right, ≥ 1 × noise, spike-in alone",
        _single(["spike"], 1.0),
        first_right,
    ),
    Line(
        "spike_unknown",
        "“unknown” said beside a spike: the recordings' own secrets",
        lambda s: s.label["source"] == "spike",
        lambda s: bool(s.answer.unknown),
        good=False,
    ),
    Line(
        "first_geometry",
        "first-named right over wrong geometry, ≥ 1 × noise",
        lambda s: _single(["physics", "departures"], 1.0)(s) and bool(s.label["geometry_underneath"]),
        first_right,
    ),
    Line(
        "companion",
        "a second effect named beside one of wrong law",
        family("wrong_law"),
        lambda s: len(counted(s)) > 1,
        good=False,
    ),
    Line(
        "missing_wrong",
        "column withheld: confident wrong name",
        family("missing"),
        confidently_wrong,
        good=False,
    ),
    Line(
        "missing_told",
        "column withheld: named, or called not testable",
        family("missing"),
        told_or_untestable,
    ),
    Line(
        "few_worse_frames",
        "25-70 poses: robot.yaml worse than base and tool alone by > 5 %",
        family("few"),
        lambda s: worse_than(s, "frames"),
        good=False,
    ),
    Line("few_wrong", "25-70 poses: confident wrong name", family("few"), confidently_wrong, good=False),
    Line(
        "few_first",
        "25-70 poses, one effect or two: first-named right",
        lambda s: family("few")(s) and bool(s.label["effects"]),
        first_right,
    ),
    Line("grid", "poses on a grid: first-named right", family("grid"), first_right),
    Line(
        "grid_wrong", "poses on a grid: confident wrong name", family("grid"), confidently_wrong, good=False
    ),
    *(
        Line(f"mistake_{kind}", f"{text}: said", _mistake(kind), mistake_told)
        for kind, text in (
            ("exchanged", "joint columns exchanged"),
            ("sign", "wrong sign of a joint"),
            ("convention", "table of the other DH convention"),
        )
    ),
    Line(
        "mistake_worse",
        "such a mistake: robot.yaml worse than base and tool alone on fresh poses",
        family("mistaken"),
        lambda s: worse_than(s, "frames", 1.0),
        good=False,
    ),
    Line(
        "mistake_wrong", "such a mistake: confident name", family("mistaken"), confidently_wrong, good=False
    ),
    *(
        Line(f"machine_{kind}", f"{text}: named first", _machine(kind), first_right)
        for kind, text in (
            ("rods", "four-bar linkage at a palletizer's wrist"),
            ("elbow_rods", "four-bar linkage at an elbow"),
            ("warm_robot", "the whole robot warm"),
            ("wobble_twice", "axis that wobbles twice per turn"),
            ("neighbour", "joint dragged along by the next"),
            ("hard_spring", "spring that hardens all the way"),
        )
    ),
    Line(
        "machine_place",
        "laws that machines have: named first, or unknown at the right joint and input",
        family("machines"),
        first_or_unknown,
    ),
    Line(
        "machine_wrong",
        "laws that machines have: confident wrong name",
        family("machines"),
        confidently_wrong,
        good=False,
    ),
    *(
        Line(
            f"teeth_{kind}",
            f"teeth, {text}: named first, or called not testable",
            _teeth(kind),
            told_or_untestable,
        )
        for kind, text in (
            ("even_grid", "even grid"),
            ("uneven_grid", "uneven grid"),
            ("anywhere", "poses anywhere"),
        )
    ),
    Line(
        "teeth_place",
        "teeth: so, or unknown at the right joint and input",
        family("teeth"),
        lambda s: told_or_untestable(s) or place_right(s),
    ),
    Line("teeth_present", "teeth: every joint named", family("teeth"), both_present),
    Line(
        "teeth_order",
        "teeth: order per turn right, where an order is said",
        family("teeth"),
        order_right,
        given=lambda s: any(math.isfinite(item.order) for item in s.answer.effects),
    ),
    Line("teeth_wrong", "teeth: confident wrong name", family("teeth"), confidently_wrong, good=False),
    Line("several_first", "one cause on several joints: first-named right", family("several"), first_right),
    Line("several_present", "one cause on several joints: every joint", family("several"), both_present),
    Line("several_exact", "one cause on several joints: and nothing else", family("several"), exact_set),
    Line(
        "several_wrong",
        "one cause on several joints: confident wrong name",
        family("several"),
        confidently_wrong,
        good=False,
    ),
    Line(
        "small_false",
        "a name not in the truth that closes < 2 %, all families",
        _known_truth,
        small_false_name,
        good=False,
    ),
    Line(
        "small_false_companion",
        "the same beside an effect of 1 to 2 % of the gap",
        family("companion"),
        small_false_name,
        good=False,
    ),
    Line(
        "companion_main",
        "beside a small companion: the large effect first",
        family("companion"),
        main_first,
    ),
    Line(
        "failed",
        "the diagnosis failed with an error, or did not end",
        lambda s: True,
        lambda s: bool(s.answer.error),
        good=False,
    ),
    Line("twenty", "twenty poses: first-named right", family("twenty"), first_right),
    Line(
        "twenty_wrong", "twenty poses: confident wrong name", family("twenty"), confidently_wrong, good=False
    ),
)


@dataclass(frozen=True)
class Scores:
    """The whole table, and who failed."""

    rows: list[Row]
    others: dict[str, list[Row]]  # of simpler methods, the lines that make sense for them
    failures: list[dict[str, Any]]
    sets: int
    which: str = ""
    left_out: dict[str, str] = field(default_factory=dict)  # sets that could not be made, and why
    drawn_anew: dict[str, dict[str, int]] = field(default_factory=dict)  # family: why, and how often
    costs: dict[str, Cost] = field(default_factory=dict)  # of each family, and "all"

    def row(self, key: str) -> Row:
        return next(row for row in self.rows if row.key == key)

    def to_dict(self) -> dict[str, Any]:
        return {
            "format": "truing-exam/1",
            "which": self.which,
            "sets": self.sets,
            "left_out": self.left_out,
            "drawn_anew": self.drawn_anew,
            "costs": {family: _cost_dict(cost) for family, cost in self.costs.items()},
            "rows": [_row_dict(row) for row in self.rows],
            "others": {name: [_row_dict(row) for row in rows] for name, rows in self.others.items()},
            "failures": self.failures,
        }


def _row_dict(row: Row) -> dict[str, Any]:
    low, high = row.interval()
    told = {
        "key": row.key,
        "text": row.text,
        "target": row.target,
        "n": row.n,
        "met": row.met,
        "value": _none_if_nan(row.value),
        "note": row.note,
    }
    if math.isfinite(row.brier):
        told["brier"] = row.brier
    return (
        {**told, "hits": row.hits, "low": _none_if_nan(low), "high": _none_if_nan(high)}
        if row.percent
        else told
    )


def _cost_dict(cost: Cost) -> dict[str, Any]:
    return {
        "sets": cost.sets,
        "median_s": _none_if_nan(cost.median),
        "p95_s": _none_if_nan(cost.slow),
        "total_s": cost.total,
        "processor_s": cost.processor,
    }


def _none_if_nan(value: float) -> float | None:
    return value if math.isfinite(value) else None


def score(sheets: Sequence[Sheet], which: str = "", left_out: Mapping[str, str] | None = None) -> Scores:
    """Every row of the table, from all sheets. left_out: sets that could not be made, and why."""
    rows = [share(line, sheets) for line in LINES] + _values(sheets) + [share(line, sheets) for line in MORE]
    names = sorted({name for sheet in sheets for name in sheet.others})
    single = (
        "first_physics",
        "first_departures",
        "joint",
        "alarm_white",
        "alarm_other",
        "first_small",
        "first_geometry",
        "wrong_law",
        "twenty",
        "grid",
        "several_first",
        "companion_main",
    )
    others = {}
    for name in names:
        # They choose among the candidates of a diagnosis: where it failed, they have none to choose from.
        theirs = [
            Sheet(s.id, s.label, s.others.get(name, s.answer))
            for s in sheets
            if name in s.others or s.answer.error
        ]
        others[name] = [share(line, theirs) for line in (*LINES, *MORE) if line.key in single]
    return Scores(
        rows,
        others,
        failures(sheets, (*LINES, *MORE)),
        len(sheets),
        which,
        left_out=dict(left_out or {}),
        drawn_anew=drawn_anew(sheets),
        costs={family: cost_of(of) for family, of in {**by_family(sheets), "all": sheets}.items()},
    )


def drawn_anew(sheets: Sequence[Sheet]) -> dict[str, dict[str, int]]:
    """Draws that the examiner threw away while it made the sets of each family, by the reason."""
    found: dict[str, Counter[str]] = {}
    for sheet in sheets:
        found.setdefault(sheet.label["family"], Counter()).update(sheet.label.get("drawn_anew", {}))
    return {family: dict(sorted(reasons.items())) for family, reasons in found.items() if reasons}


def told_left_out(left_out: Mapping[str, str]) -> list[str]:
    """A line for each reason: how many sets it left out, and which."""
    reasons = dict.fromkeys(left_out.values())
    lines = []
    for why in reasons:
        names = [name for name, of in left_out.items() if of == why]
        some = ", ".join(names[:_TOLD]) + (f" and {len(names) - _TOLD} more" if len(names) > _TOLD else "")
        lines.append(f"left out: {len(names)} of the sets: {why} ({some})")
    return lines


def told_drawn_anew(drawn_anew: Mapping[str, Mapping[str, int]]) -> list[str]:
    """A line for each reason: how many draws were thrown away for it, and in which families."""
    reasons = sorted({why for of_family in drawn_anew.values() for why in of_family})
    lines = []
    for why in reasons:
        counts = {family: of[why] for family, of in drawn_anew.items() if why in of}
        places = ", ".join(f"{family} {count}" for family, count in counts.items())
        lines.append(f"drawn anew: {sum(counts.values())} times, {why} ({places})")
    return lines


def share(line: Line, sheets: Sequence[Sheet]) -> Row:
    chosen = line.of(sheets)
    hits = sum(line.passes(sheet) for sheet in chosen)
    value = hits / len(chosen) if chosen else math.nan
    target, met = "", None
    if math.isfinite(line.at_least):
        target, met = f"≥ {100 * line.at_least:.0f} %", value >= line.at_least
    elif math.isfinite(line.at_most):
        target, met = f"≤ {100 * line.at_most:.0f} %", value <= line.at_most
    return Row(line.key, line.text, target, hits, len(chosen), value, met if chosen else None)


def _shrinks(sheets: Sequence[Sheet]) -> list[Row]:
    # Fresh poses are measured by a quiet instrument: heavy tails and gross errors of the set would be
    # compared with none.
    told = [s for s in sheets if s.label["family"] != "unlisted" and s.label["noise"] in ("white", "real")]
    wrong, covered = [], 0
    for sheet in told:
        shrink, real = sheet.answer.shrink, sheet.answer.realised
        if sheet.answer.error and sheet.label["effects"]:  # there was something to shrink
            wrong.append(math.inf)
        elif shrink and real is not None:
            wrong.append(abs(shrink[0] - real))
            covered += shrink[1] <= real <= shrink[2]
    n = len(wrong)
    median = 100.0 * float(np.median(wrong)) if n else math.nan
    share = covered / n if n else math.nan
    return [
        Row(
            "shrink",
            "predicted shrink against realised: median difference [points]",
            "≤ 2",
            n=n,
            value=median,
            met=_met(median <= 2.0, wrong),
            percent=False,
        ),
        Row(
            "shrink_covered",
            "predicted shrink: 90 % interval covers",
            "85-95 %",
            covered,
            n,
            share,
            _met(0.85 <= share <= 0.95, wrong),
        ),
    ]


def _values(sheets: Sequence[Sheet]) -> list[Row]:
    told = [("calibration", "stated confidence against frequency", 0.03, sheets)]
    told += [
        (f"calibration_{family}", f"the same within {family}", 0.08, of_family)
        for family, of_family in by_family(sheets).items()
    ]
    cost = cost_of(sheets)
    return [
        *_shrinks(sheets),
        *(calibration_row(*one) for one in told),
        Row(
            "seconds",
            "seconds per set, median",
            "≤ 0.6",
            n=cost.sets,
            value=cost.median,
            met=cost.median <= 0.6 if cost.sets else None,
            percent=False,
        ),
        Row("seconds_p95", "seconds per set, 95th percentile", n=cost.sets, value=cost.slow, percent=False),
    ]


def by_family(sheets: Sequence[Sheet]) -> dict[str, list[Sheet]]:
    found: dict[str, list[Sheet]] = {}
    for sheet in sheets:
        found.setdefault(sheet.label["family"], []).append(sheet)
    return found


def calibration_row(key: str, text: str, most: float, sheets: Sequence[Sheet]) -> Row:
    """Few names are said to be few, and not judged: ten bins of them show chance."""
    found = calibration(sheets)
    few = found.n < _FEWEST
    return Row(
        key,
        f"{text}, of names (ECE, Brier score)",
        f"≤ {most:g}",
        n=found.n,
        value=found.error,
        met=None if few else found.error <= most,
        percent=False,
        brier=found.brier,
        chance=found.chance,
        note=f"too few to judge: {found.n} names, {_FEWEST} needed" if few else "",
    )


@dataclass(frozen=True)
class Cost:
    """What diagnoses took [s]."""

    sets: int
    median: float
    slow: float  # 95th percentile
    total: float
    processor: float  # of their processes, together


def cost_of(sheets: Sequence[Sheet]) -> Cost:
    """By the clock; of failed ones what they took until then."""
    seconds = np.array([s.answer.seconds for s in sheets if math.isfinite(s.answer.seconds)])
    processor = np.array([s.answer.processor_seconds for s in sheets])
    known = float(processor[np.isfinite(processor)].sum())
    if not len(seconds):
        return Cost(0, math.nan, math.nan, 0.0, known)
    middle, slow = (float(np.quantile(seconds, share)) for share in (0.5, 0.95))
    return Cost(len(seconds), middle, slow, float(seconds.sum()), known)


def _met(passed: bool, of: Sequence[Any] | Any) -> bool | None:
    return bool(passed) if len(of) else None


@dataclass(frozen=True)
class Calibration:
    """How stated probabilities of names agree with how often they were right."""

    error: float  # expected calibration error, in ten bins
    brier: float  # mean squared difference of a probability from 1 (right) or 0 (wrong); Brier 1950
    n: int  # names
    chance: tuple[float, float] = (math.nan, math.nan)
    """What the error would be of so many names if the same probabilities were exact: its mean, and what 95 %
    of draws stay below."""


def stated_names(sheet: Sheet) -> list[tuple[Named, bool]]:
    """Every named effect of which it is known whether it is right; of recordings none is."""
    if sheet.label["source"] == "spike":
        return []
    return [(item, _excusable(sheet, item)) for item in sheet.answer.effects]


def calibration(sheets: Sequence[Sheet]) -> Calibration:
    """Of all named effects. Not of recordings: what else is in these nobody knows."""
    said, true = [], []
    for sheet in sheets:
        if sheet.label["source"] == "spike":
            continue
        if sheet.answer.error:  # as wrong as can be: no answer, for certain
            said.append(1.0)
            true.append(0.0)
        for item, is_right in stated_names(sheet):
            said.append(item.probability)
            true.append(float(is_right))
    if not said:
        return Calibration(math.nan, math.nan, 0)
    p, hit = np.clip(np.array(said), 0.0, 1.0), np.array(true)
    return Calibration(calibration_error(p, hit), float(np.mean((p - hit) ** 2)), len(p), _error_by_chance(p))


def calibration_error(p: Floats, hit: Floats) -> float:
    """Of probabilities and hits, shape=(names,)."""
    return float(_calibration_error(p, hit))


def _calibration_error(p: Floats, hit: Floats) -> Floats:
    """Of probabilities, shape=(names,), for hits, shape=(..., names): bins' differences of mean probability
    and frequency, weighed by their names (Naeini et al. 2015)."""
    bins = np.minimum((p * _BINS).astype(int), _BINS - 1)
    members = (bins == np.arange(_BINS)[:, None]).astype(float)
    return np.asarray(np.abs((hit - p) @ members.T).sum(axis=-1) / len(p))


def _error_by_chance(p: Floats) -> tuple[float, float]:
    """Mean and 95 % quantile of the error where the probabilities are exact (consistency resampling, Broecker
    and Smith 2007)."""
    hits = (np.random.default_rng(0).random((_DRAWS, len(p))) < p).astype(np.float64)
    errors = _calibration_error(p, hits)
    return float(errors.mean()), float(np.quantile(errors, 0.95))


def failures(sheets: Sequence[Sheet], lines: Sequence[Line]) -> list[dict[str, Any]]:
    """Every set that failed a row, with label and answer."""
    found = []
    for sheet in sheets:
        failed = [line.key for line in lines if line.of([sheet]) and line.passes(sheet) != line.good]
        if failed or sheet.answer.error:
            found.append(
                {"id": sheet.id, "failed": failed, "label": sheet.label, "answer": sheet.answer.to_dict()}
            )
    return found


# ---- Printing ------------------------------------------------------------------------------------


def _cell(row: Row) -> str:
    if row.n == 0 or math.isnan(row.value):
        return "–"
    if not row.percent:
        beside = f", Brier {row.brier:.3g}" if math.isfinite(row.brier) else ""
        if math.isfinite(row.chance[0]):
            beside += f"; exact ones {row.chance[0]:.2g}, 95 % below {row.chance[1]:.2g}"
        return (f"{row.value:.3g}" if math.isfinite(row.value) else "∞") + beside
    low, high = row.interval()
    return f"{100 * row.value:.1f} % ({100 * low:.0f}–{100 * high:.0f})"


_TITLES = {"gain": "largest gain", "bic": "BIC", "z": "fit all, largest z"}


def markdown(scores: Scores) -> str:
    """The table: every score with its number of sets, 90 % interval, target, and the simpler methods beside
    it.
    """
    names = list(scores.others)
    head = ["score", "target", "sets", "truing", ""] + [_TITLES.get(name, name) for name in names]
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    theirs = {name: {row.key: row for row in rows} for name, rows in scores.others.items()}
    for row in scores.rows:
        mark = {True: "met", False: "**missed**", None: row.note}[row.met]
        cells = [row.text, row.target, str(row.n), _cell(row), mark] + [
            _cell(theirs[n][row.key]) if row.key in theirs[n] else "" for n in names
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def table(scores: Scores) -> list[dict[str, Any]]:
    """The same as rows of text, `passed` where there is a target."""
    theirs = {name: {row.key: row for row in rows} for name, rows in scores.others.items()}
    rows = []
    for row in scores.rows:
        cells: dict[str, Any] = {
            "score": row.text,
            "target": row.target,
            "sets": row.n,
            "truing": _cell(row),
            "passed": row.met,
            "note": row.note,
        }
        cells.update(
            {
                _TITLES.get(name, name): _cell(found[row.key]) if row.key in found else ""
                for name, found in theirs.items()
            }
        )
        rows.append(cells)
    return rows


def cost_table(scores: Scores) -> list[dict[str, Any]]:
    """What diagnoses took, family by family, as rows of text."""
    return [
        {
            "family": family,
            "sets": cost.sets,
            "median [s]": f"{cost.median:.2f}",
            "p95 [s]": f"{cost.slow:.2f}",
            "total [s]": f"{cost.total:.1f}",
            "processor [s]": f"{cost.processor:.1f}",
        }
        for family, cost in scores.costs.items()
        if cost.sets
    ]


def cost_markdown(scores: Scores) -> str:
    """The same as a table of markdown."""
    rows = cost_table(scores)
    head = list(rows[0]) if rows else ["family"]
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return (
        "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row.values()) + " |" for row in rows])
        + "\n"
    )


def plain(scores: Scores) -> str:
    """The same for a terminal."""
    width = max(len(row.text) for row in scores.rows)
    lines = [f"{scores.which}: {scores.sets} sets", *told_left_out(scores.left_out)]
    lines += told_drawn_anew(scores.drawn_anew)
    for row in scores.rows:
        mark = {True: "met", False: "MISSED", None: row.note}[row.met]
        lines.append(f"{row.text:{width}}  {row.target:8} {row.n:5}  {_cell(row):22} {mark}")
    for cost in cost_table(scores):
        lines.append(
            f"{cost['family']}: {cost['sets']} sets, {cost['median [s]']} s each, 95 % within"
            f" {cost['p95 [s]']} s, {cost['total [s]']} s together, {cost['processor [s]']} s of processors"
        )
    return "\n".join(lines)


def write_markdown(path: Path | str, scores: Scores) -> None:
    """Puts the table between the markers of a page, in place of what stood there."""
    page = Path(path)
    text = page.read_text(encoding="utf-8")
    start, end = (text.find(marker) for marker in MARKER)
    if start < 0 or end < start:
        raise ValueError(f"{page} has no place for scores: expected {MARKER[0]} and {MARKER[1]}")
    page.write_text(text[: start + len(MARKER[0])] + "\n" + markdown(scores) + text[end:], encoding="utf-8")
