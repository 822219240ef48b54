# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of ``truing exam``: its score table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.words import counted, escaped


def exam_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing exam``: its score table.

    Args:
        result: What ``result.json`` holds; `scores` and `costs` are lists of mappings, one per line.
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
    page.add(_card("Scores", scores))
    if result.get("costs"):
        page.add(_card("Cost of a diagnosis", result["costs"]))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _card(title: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """A table with a line per row; a row that did not pass is shown so."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    body = []
    for row in rows:
        cells = "".join(f"<td>{escaped(plain(row.get(name)))}</td>" for name in names[1:])
        tone = ' class="missed"' if row.get("passed") is False else ""
        body.append(f"<tr{tone}><th>{escaped(plain(row.get(names[0])))}</th>{cells}</tr>")
    heading = "".join(f"<th>{escaped(name.replace('_', ' '))}</th>" for name in names)
    return (
        f'<section class="card"><h2>{escaped(title)}</h2><div'
        f' class="scroll"><table><thead><tr>{heading}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        "</div></section>"
    )


def plain(value: object) -> str:
    """A cell of the score table as text."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return " … ".join(plain(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
