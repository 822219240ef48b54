# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of ``truing exam``: its score table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.words import counted, escaped


def exam_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing exam``: its score table.

    Args:
        result: What ``result.json`` holds; `scores` is a list of mappings, one per line of the table.
    """
    page = Page("Examination of the diagnosis", part_of_page("exam"))
    scores = result["scores"]
    judged = [s for s in scores if s.get("passed") is not None]
    passed = sum(bool(s["passed"]) for s in judged)
    page.add(
        f'<header><p class="kicker">truing exam · {escaped(result.get("set"))}</p><h1>{passed} of'
        f' {counted(len(judged), "target")} met.</h1><p class="sub">Effects were hidden in simulated and'
        " recorded data; the diagnosis saw robot and data only, and its answers were stored before the"
        " labels were opened.</p></header>"
    )
    names = list(dict.fromkeys(name for score in scores for name in score))
    body = []
    for score in scores:
        cells = "".join(f"<td>{escaped(plain(score.get(name)))}</td>" for name in names[1:])
        tone = ' class="missed"' if score.get("passed") is False else ""
        body.append(f"<tr{tone}><th>{escaped(plain(score.get(names[0])))}</th>{cells}</tr>")
    heading = "".join(f"<th>{escaped(name.replace('_', ' '))}</th>" for name in names)
    page.add(
        '<section class="card"><h2>Scores</h2><div'
        f' class="scroll"><table><thead><tr>{heading}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        "</div></section>"
    )
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def plain(value: object) -> str:
    """A cell of the score table as text."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return " … ".join(plain(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
