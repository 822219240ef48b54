# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The box that says whether a result can be trusted: checks in words, the worst of them is the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from truing.report.words import escaped

GOOD, LOOK, BAD = 0, 1, 2


@dataclass(frozen=True)
class Check:
    """A line of the box. `head` and `text` are HTML."""

    grade: int  # GOOD, LOOK or BAD
    head: str
    text: str


def grade_of(value: float, good: float, bad: float) -> int:
    """GOOD below `good`, LOOK below `bad`, else BAD."""
    return GOOD if value < good else LOOK if value < bad else BAD


def check_items(checks: Iterable[Check]) -> str:
    """The checks as items of a list, worst first."""
    return "".join(
        f'<li class="g{check.grade}"><i aria-label="{("good", "look", "bad")[check.grade]}">'
        f"{'✓!✕'[check.grade]}</i><div><b>{check.head}</b><span>{check.text}</span></div></li>"
        for check in sorted(checks, key=lambda check: -check.grade)
    )


def trust_card(checks: Sequence[Check], verdicts: tuple[str, str, str]) -> str:
    """The whole box. `verdicts`: its heading if the worst check is good, worth a look, bad."""
    worst = max(check.grade for check in checks)
    return (
        f'<section class="card trust t{worst}"><h2>{verdicts[worst]}</h2>'
        f"<ul>{check_items(checks)}</ul></section>"
    )


def shortened(warning: str, most: int, kept: int) -> str:
    """A warning of up to `most` characters; a longer one cut at `kept`, with a link to the whole."""
    if len(warning) < most:
        return escaped(warning)
    return escaped(warning[:kept].rsplit(" ", 1)[0]) + ' … (<a href="#warnings">in full</a>)'
