# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a fleet: what all arms share, and which arms stand out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from truing.identification.page import frozen_card, parameter_table
from truing.report.charts import AFTER, BEFORE
from truing.report.page import Page, footer, table_cell, warnings_card
from truing.report.words import counted, escaped, figures_text, length_text

_NAMED = 400  # arms, above which the chart has no room for their names


def fleet_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing fleet identify`` and ``truing fleet diagnose``, from the dictionary of
    result.json.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: fleet of {len(result['arms'])}")
    errors = result["errors"].get("test", result["errors"]["train"])
    which = "held-out poses" if "test" in result["errors"] else "fitted poses"
    headline = result.get("sentence") or (
        f"{counted(len(result['arms']), 'arm')}: {length_text(errors['before']['rms_m'])} rms before,"
        f" {length_text(errors['after']['rms_m'])} after."
    )
    before, after = (length_text(errors[when]["rms_m"]) for when in ("before", "after"))
    rows, partitions = counted(result["rows"], "row"), counted(result["partitions"], "partition")
    page.add(
        f'<header><p class="kicker">truing fleet · {escaped(result.get("robot"))}</p>'
        f'<h1>{escaped(headline)}</h1><p class="sub">{rows} in {partitions}, read'
        f" {result['solver']['passes']} times. {which.capitalize()}: {before} rms before, {after}"
        " after.</p></header>"
    )
    if "of_all" in result:
        page.add(_effects("All arms of this type", [("", e) for e in result["of_all"]]))
        each = [(name, e) for name, effects in result["of_arms"].items() for e in effects]
        page.add(_effects("Arms by themselves", each))
    _arms_chart(page, result["arms"])
    page.add(parameter_table(result["parameters"]))
    page.add(_arms_table(result["arms"]))
    page.add(frozen_card([f for f in result["frozen"] if f["combination"]]))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _effects(title: str, effects: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    if not effects:
        return f'<section class="card"><h2>{title}</h2><p class="lead">Nothing was found.</p></section>'
    rows = []
    for arm, e in effects:
        sizes = "; ".join(
            f"{escaped(p['name'])} {p['value'] - p['nominal']:+.3g} {escaped(p['unit'])}"
            for p in e["parameters"]
        )
        cells = [
            f"<th>{escaped(arm)}</th>" if arm else "",
            f"<td>{escaped(e['effect'].replace('_', ' '))} {escaped(' '.join(e['joints']))}</td>",
            table_cell(e["size_at_tip_m"], length_text(e["size_at_tip_m"])),
            f"<td>{sizes}</td>",
            table_cell(e["nats"], figures_text(e["nats"], 3)),
            f"<td>{escaped(', '.join(e['confounded_with'])) or '–'}</td>",
        ]
        rows.append(f"<tr>{''.join(cells)}</tr>")
    names = ["effect", "at the tip, rms", "size", "evidence, nats", "not told from"]
    if effects[0][0]:
        names = ["arm", *names]
    head = "".join(f'<th><button type="button">{name}</button></th>' for name in names)
    return (
        f'<section class="card"><h2>{title}</h2><div class="scroll"><table class="sortable"><thead>'
        f"<tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def _arms_chart(page: Page, arms: Mapping[str, Any]) -> None:
    """Every arm's error before and after, largest first."""
    order = sorted(arms, key=lambda name: -(arms[name]["errors"]["train"]["after"]["rms_m"] or 0.0))
    names = [escaped(name) for name in order]
    traces = []
    for when, colour in (("before", BEFORE), ("after", AFTER)):
        rms = [1e3 * (arms[name]["errors"]["train"][when]["rms_m"] or 0.0) for name in order]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": names if len(names) <= _NAMED else list(range(1, len(names) + 1)),
                "y": rms,
                "name": when,
                "marker": {"color": colour, "size": 6},
                "hovertemplate": "%{x}: %{y:.3g} mm<extra></extra>",
            }
        )
    page.add('<section class="card"><h2>Every arm\'s error, largest first</h2>')
    page.chart(
        "arms",
        traces,
        {
            "xaxis": {"type": "category" if len(names) <= _NAMED else "linear", "title": {"text": "arm"}},
            "yaxis": {"type": "log", "title": {"text": "rms error [mm]"}},
        },
        size="wide",
    )
    page.add("</section>")


def _arms_table(arms: Mapping[str, Any]) -> str:
    rows = []
    for name, arm in arms.items():
        errors = arm["errors"]["train"]
        cells = [f"<th>{escaped(name)}</th>", table_cell(arm["rows"], f"{arm['rows']:,}")]
        cells += [
            table_cell(errors[w]["rms_m"] or 0.0, length_text(errors[w]["rms_m"]))
            for w in ("before", "after")
        ]
        cells.append(table_cell(arm["left_out"], str(arm["left_out"])))
        rows.append(f"<tr>{''.join(cells)}</tr>")
    names = ("arm", "rows", "rms before", "rms after", "rows left out")
    head = "".join(f'<th><button type="button">{name}</button></th>' for name in names)
    return (
        '<section class="card"><h2>Arms</h2><p class="lead">What each has of its own is in arms.csv, its'
        f' robot in robot_NAME.yaml.</p><div class="scroll"><table class="sortable"><thead><tr>{head}</tr>'
        f"</thead><tbody>{''.join(rows)}</tbody></table></div></section>"
    )
