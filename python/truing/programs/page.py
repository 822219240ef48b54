# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of ``truing apply``.

First screen: how many targets were changed, how far off the robot would have been and is, where they are.
Below: each changed target before and after, and why others stayed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import AFTER, BEFORE, INK, REJECTED, distribution_chart
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.scene import Scene3d
from truing.report.words import angle_text, counted, escaped, length_text

Floats = NDArray[np.float64]

LISTED = 400
_DRAWN = 0.08  # [m] the longest correction in the plot, however small it is
MAKERS = {"kuka": "KUKA", "abb": "ABB", "fanuc": "FANUC", "ur": "Universal Robots", "yaskawa": "Yaskawa"}


@dataclass(frozen=True)
class Drawing:
    """What the report draws, in the robot base."""

    places: Floats  # shape=(n, 3) [m] of the tool, as the programs want it
    commands: Floats  # shape=(n, 3) [m]; NaN where a target stays
    changed: NDArray[np.bool_]  # shape=(n,)
    texts: tuple[str, ...]
    robots: tuple[Floats, ...]  # shape=(joints + 2, 3) [m]
    before: Floats  # shape=(n,) [m]
    after: Floats  # shape=(n,) [m]


def programs_report(result: Mapping[str, Any], drawing: Drawing) -> str:
    """The report.

    Args:
        result: What ``result.json`` holds (format ``truing-programs/1``).
        drawing: Where targets and robot are.
    """
    page = Page(f"{result.get('calibrated') or 'Robot'}: programs", part_of_page("programs"))
    page.add(_headline(result))
    page.add('<div class="first">')
    _map(page, drawing)
    page.add('<div class="column">')
    page.add(_files(result))
    _errors(page, result, drawing)
    page.add("</div></div>")
    page.add(_stayed(result))
    page.add(_changed(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _headline(result: Mapping[str, Any]) -> str:
    targets, left = result["targets"], len(result["stayed"])
    done = [one for one in targets if one["status"] != "stayed"]
    whole = not left and not result["refused"]
    label = "all targets" if whole else "some stayed as they are"
    kicker = (
        f'<p class="kicker">truing apply · {MAKERS[result["brand"]]} · {escaped(result["nominal"])} →'
        f" {escaped(result['calibrated'])}"
        f'<span class="verdict {"found" if whole else "open"}">{label}</span></p>'
    )
    before, after, digits = result["before"], result["after"], result["printed_digits"]
    if not done:
        return f'<header>{kicker}<h1>No target was changed.</h1><p class="sub">See below why.</p></header>'
    first = (
        "As they were, targets would be missed by"
        f' <span class="before">{length_text(before["mean_m"])}</span> on average,'
        f" {length_text(before['max_m'])} at most.<br>With the new numbers, by the model,"
        f' <span class="after">{length_text(after["mean_m"])}</span> remain.'
    )
    sub = (
        f"{sum(one['status'] == 'changed' for one in done)} of {counted(len(targets), 'literal target')}"
        f" changed, by up to {length_text(result['moved']['max_m'])}. "
        f"What remains is what the printed digits leave, up to {length_text(digits['max_m'])} and"
        f" {angle_text(digits['rotation_max_rad'])}. What the calibration does not know comes on top. "
    )
    if left:
        sub += f'<a href="#stayed">{counted(left, "place")} stayed</a>, each with its reason.'
    return f'<header>{kicker}<h1 class="long">{first}</h1><p class="sub">{sub}</p></header>'


def _files(result: Mapping[str, Any]) -> str:
    rows = "".join(
        f'<tr><th class="wrap">{escaped(one["written"])}</th><td>{one["changed"]}</td><td>{one["same"]}</td>'
        f"<td>{one['stayed']}</td></tr>"
        for one in result["files"]
    )
    refused = "".join(f"<li>{escaped(one['why'])}</li>" for one in result["refused"])
    refused = (
        f'<p class="note">Nothing is written for:</p><ul class="plain">{refused}</ul>' if refused else ""
    )
    notes = "".join(f'<p class="note">{escaped(note)}</p>' for note in result["notes"])
    return (
        '<section class="card"><h2>Programs</h2><table class="left"><thead><tr><th>written</th>'
        "<th>changed</th>"
        f"<th>same</th><th>stayed</th></tr></thead><tbody>{rows}</tbody></table>{refused}{notes}</section>"
    )


def _map(page: Page, drawing: Drawing) -> None:
    page.add('<section class="card"><h2>Where, and which way</h2>')
    plot = Scene3d()
    for robot in drawing.robots:
        plot.add_line(robot, "robot", INK, 5, opacity=0.6)
    moves = drawing.commands - drawing.places
    longest = float(np.nanmax(np.linalg.norm(moves, axis=1), initial=0.0)) if len(moves) else 0.0
    factor = _DRAWN / longest if longest > 0 else 1.0
    if len(moves):
        plot.add_arrows(drawing.places, factor * moves, "correction", AFTER, 2)
    if len(drawing.places) > 1:
        plot.add_line(drawing.places, "order of the moves", INK, 1.5, opacity=0.25)
    for chosen, name, colour in (
        (drawing.changed, "changed", AFTER),
        (~drawing.changed, "as it was", REJECTED),
    ):
        rows = np.flatnonzero(chosen)
        if rows.size:
            texts = [drawing.texts[k] for k in rows]
            plot.add_points(drawing.places[rows], name, 3.5, colour, texts=texts)
    plot.draw(page, eye=(1.7, -1.7, 0.9), size="cloud map")
    page.add(
        f'<p class="legend"><i class="dot" style="background:{AFTER}"></i>changed'
        f' <i class="dot" style="background:{REJECTED}"></i>as it was</p>'
        f'<p class="note">Corrections are drawn {factor:.3g} times as long as they are.</p></section>'
    )


def _errors(page: Page, result: Mapping[str, Any], drawing: Drawing) -> None:
    page.add('<section class="card"><h2>How far off, by the model</h2>')
    # What remains is often far below anything that could be drawn beside it.
    traces, layout = distribution_chart(
        [(drawing.before, BEFORE, "as it was"), (drawing.after, AFTER, "new numbers")]
    )
    if traces:
        layout["yaxis"]["title"] = {"text": "fraction of targets [%]"}
        low, high = layout["xaxis"]["range"]
        layout["xaxis"]["range"] = [low - 0.5, high + 0.5]  # room for the names above the peaks
        page.chart("errors", traces, layout, size="small")
    page.add("</section>")


def _stayed(result: Mapping[str, Any]) -> str:
    stayed = result["stayed"]
    if not stayed:
        return ""
    rows = "".join(
        f"<tr><th>{escaped(one['file'])}</th><td>{one['line']}</td>"
        f'<td class="wrap"><code>{escaped(one["what"])}</code></td>'
        f'<td class="wrap">{escaped(one["why"])}</td></tr>'
        for one in stayed[:LISTED]
    )
    more = (
        f'<p class="note">The first {LISTED} of {len(stayed)}; all are in result.json.</p>'
        if len(stayed) > LISTED
        else ""
    )
    return (
        '<section class="card" id="stayed"><h2>What stayed as it is, and why</h2>'
        '<table class="left"><thead><tr>'
        "<th>file</th><th>line</th><th>what</th><th>why</th></tr></thead>"
        f"<tbody>{rows}</tbody></table>{more}</section>"
    )


def _changed(result: Mapping[str, Any]) -> str:
    done = [one for one in result["targets"] if one["status"] != "stayed"]
    if not done:
        return ""
    rows = "".join(_row(one) for one in done[:LISTED])
    more = (
        f'<p class="note">The first {LISTED} of {len(done)}; all are in result.json.</p>'
        if len(done) > LISTED
        else ""
    )
    return (
        '<section class="card"><h2>Each target, before and after</h2><table class="left sortable"><thead><tr>'
        "<th>file</th><th>line</th><th>target</th><th>numbers before</th><th>after</th><th>moved</th>"
        "<th>off before</th><th>off after</th></tr></thead>"
        f"<tbody>{rows}</tbody></table>{more}</section>"
    )


def _row(one: Mapping[str, Any]) -> str:
    notes = f"<br>{escaped('; '.join(one['notes']))}" if one["notes"] else ""
    return (
        f"<tr><th>{escaped(one['file'])}</th><td>{one['line']}</td>"
        f'<td class="wrap">{escaped(one["move"])} {escaped(_short(one["name"]))}{notes}</td>'
        f'<td class="wrap">{_numbers(one["before"], one["after"])}</td>'
        f'<td class="wrap">{_numbers(one["after"], one["before"])}</td>'
        + "".join(
            table_cell(one[key] or 0.0, length_text(one[key]))
            for key in ("moved_m", "error_before_m", "error_after_m")
        )
        + "</tr>"
    )


def _short(name: str) -> str:
    """Nothing of a target that has no name: its numbers stand beside it."""
    return "" if name.startswith(("{", "[", "p[")) else name


def _numbers(texts: list[str], others: list[str]) -> str:
    """Numbers, those in bold that differ."""
    return ", ".join(
        escaped(text) if text == other else f"<b>{escaped(text)}</b>"
        for text, other in zip(texts, others, strict=True)
    )
