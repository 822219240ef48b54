# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of ``truing plan``: what the planned poses will show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.identification.page import frozen_card, parameter_table
from truing.report.charts import AFTER, BEFORE, points_trace, square_layout
from truing.report.page import Page, footer, table_cell, warnings_card
from truing.report.words import angle_text, counted, escaped, figures_text, length_text

Floats = NDArray[np.float64]


def plan_report(
    result: Mapping[str, Any], joint_names: Sequence[str], joints: Floats, units: Sequence[str]
) -> str:
    """The report of ``truing plan``: what standard errors the planned poses promise."""
    page = Page(f"{result.get('robot') or 'Robot'}: measurement plan")
    seen = [p for p in result["parameters"] if not p["frozen"]]
    lost = len(result["parameters"]) - len(seen)
    lengths = [p["sigma"] for p in seen if p["unit"] == "m" and p["sigma"] is not None]
    angles = [p["sigma"] for p in seen if p["unit"] == "rad" and p["sigma"] is not None]
    promise = " and ".join(
        text
        for text in (
            f'lengths to <span class="after">±{length_text(max(lengths))}</span>' if lengths else "",
            f'angles to <span class="after">±{angle_text(max(angles))}</span>' if angles else "",
        )
        if text
    )
    page.add(
        f'<header><p class="kicker">truing plan · {escaped(result.get("robot"))}</p>'
        f"<h1>{counted(len(joints), 'pose')} will find "
        + (f"{promise}, or better." if promise else f"{len(seen)} parameters.")
        + "</h1>"
        '<p class="sub">One standard error, if every position is measured with'
        f" {length_text(result['noise_m'])} noise per axis. "
        f"{counted(len(seen), 'parameter')} can be"
        f" found{f'; {lost} cannot, by measurements of this kind' if lost else ', all there are'}. "
        f"Exchange raised the {escaped(result['index']['name'])} index from {result['index']['start']:.4g} to"
        f" {result['index']['end']:.4g}.</p></header>"
    )
    page.add('<section class="card"><h2>The poses, joint by joint</h2><div class="multiples">')
    scale = [180 / math.pi if unit == "rad" else 1000.0 for unit in units]
    for column, name in enumerate(joint_names):
        values = joints[:, column] * scale[column]
        unit = "°" if units[column] == "rad" else "mm"
        page.chart(
            f"joint{column}",
            [points_trace(np.arange(1, len(values) + 1), values, AFTER, name, 6)],
            {"xaxis": {"title": {"text": "pose"}}, "yaxis": {"title": {"text": f"{name} [{unit}]"}}},
            size="small",
        )
    page.add("</div></section>")
    if "distinguish" in result:
        _told_apart(page, result["distinguish"])
    page.add(parameter_table(result["parameters"], promised=True))
    page.add(frozen_card(result.get("frozen", [])))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def effect_at(effect: str, joint: str) -> str:
    """ "joint offset J2" """
    return f"{effect.replace('_', ' ')} {joint}".rstrip()


def size_words(value: float | None, unit: str) -> str:
    """A size with a prefix that makes it a number people read: "0.12 mrad", "23 ppm"."""
    if value is None:
        return "–"
    if unit in ("", "-"):
        return f"{figures_text(value * 1e6, 2)} ppm" if abs(value) < 1e-2 else figures_text(value, 2)
    if unit == "1/K":
        return f"{figures_text(value * 1e6, 2)} ppm/K"
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n")):
        if abs(value) * factor >= 0.05 and not (unit == "m" and factor == 1.0 and abs(value) < 1.0):
            return f"{figures_text(value * factor, 2)} {prefix}{unit}"
    return f"{value:.2g} {unit}"


def _told_apart(page: Page, seen: Mapping[str, Any]) -> None:
    """What a plan tells apart: smallest sizes, R² of every pair of effects, what poses were added for."""
    if seen["separated"]:
        page.add(_separated(seen))
    if seen["effects"]:
        _smallest(page, seen["effects"])
    if len(seen["effects"]) > 1:
        _alike(page, seen)
    if seen["not_testable"]:
        items = "".join(
            f"<li><b>{escaped(effect_at(n['effect'], ', '.join(n['joints'])))}</b>: {escaped(n['why'])}</li>"
            for n in seen["not_testable"]
        )
        page.add(
            '<section class="card"><h2>Not testable with such data</h2><ul'
            f' class="plain">{items}</ul></section>'
        )


def _separated(seen: Mapping[str, Any]) -> str:
    """The pairs that poses were added for, before and after."""
    rows = []
    for p in seen["separated"]:
        after = p["r2_after"]
        cells = [
            f"<td>{escaped(effect_at(p['other'], p['other_joint']))}</td>",
            table_cell(p["r2"], f"{p['r2']:.3f}"),
            "<td>–</td>" if after is None else table_cell(after, f"{after:.3f}"),
            f"<td>{_told_from_size(p['size'], p['unit'])}</td>",
            f"<td>{'–' if after is None else _told_from_size(p['size_after'], p['unit'])}</td>",
        ]
        rows.append(f"<tr><th>{escaped(effect_at(p['effect'], p['joint']))}</th>{''.join(cells)}</tr>")
    head = "".join(
        f'<th><button type="button">{name}</button></th>'
        for name in ("effect", "told from", "R² before", "R² after", "from this size on, before", "after")
    )
    return (
        f'<section class="card"><h2>To be told apart: {counted(seen["added_poses"], "pose")} added</h2><p'
        ' class="lead">R² is the fraction of the first effect that the second one explains, once base'
        " and tool are fitted. The added poses are the last ones of poses.csv.</p><div"
        f' class="scroll"><table class="sortable"><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def _told_from_size(size: float | None, unit: str) -> str:
    return "never" if size is None else escaped(size_words(size, unit))


def _smallest(page: Page, effects: Sequence[Mapping[str, Any]]) -> None:
    """How small every effect would still be seen."""
    shown = sorted(effects, key=lambda e: -e["size_at_tip_m"])
    labels = [effect_at(e["effect"], e["joint"]) for e in shown]
    sizes = [
        [size_words(e["size"], e["unit"]), size_words(e["size_with_geometry"], e["unit"]), e["parameter"]]
        for e in shown
    ]
    with_geometry = [e["size_with_geometry_at_tip_m"] for e in shown]
    tips = [e["size_at_tip_m"] for e in shown] + [tip for tip in with_geometry if tip is not None]
    page.add(
        '<section class="card"><h2>The smallest effects that would be seen</h2><p class="lead">How far'
        ' the tip would move (rms) by an effect that just shows: <span class="after">dark</span> with'
        ' base and tool fitted, <span class="before">light</span> with all geometry fitted as well.'
        " Without a light mark, geometry takes the effect up. Short is good.</p>"
    )
    hover = "%{y}: %{x:.3g} mm at the tip<br>%{customdata[2]}: %{customdata["
    page.chart(
        "smallest",
        [
            {
                "type": "bar",
                "orientation": "h",
                "y": labels,
                "x": [1e3 * e["size_at_tip_m"] for e in shown],
                "marker": {"color": AFTER},
                "name": "base and tool fitted",
                "customdata": sizes,
                "hovertemplate": hover + "0]}<extra></extra>",
            },
            {
                "type": "scatter",
                "mode": "markers",
                "y": labels,
                "x": [None if tip is None else 1e3 * tip for tip in with_geometry],
                "marker": {"color": BEFORE, "size": 9, "symbol": "diamond"},
                "name": "all geometry fitted too",
                "customdata": sizes,
                "hovertemplate": hover + "1]}<extra></extra>",
            },
        ],
        {
            "xaxis": {
                "type": "log" if max(tips) > 30 * min(tips) else "linear",
                "title": {"text": "rms motion of the tip [mm]"},
            },
            "yaxis": {
                "dtick": 1,
                "tickfont": {"size": 11},
                "automargin": True,
                "showgrid": False,
                "range": [-0.6, len(shown) - 0.4],
            },
            "height": max(300, 17 * len(shown) + 90),
        },
        size="free",
    )
    page.add("</section>")


def _alike(page: Page, seen: Mapping[str, Any]) -> None:
    """Which effects could pass for which."""
    labels = [effect_at(e["effect"], e["joint"]) for e in seen["effects"]]
    size = max(440, 15 * len(labels) + 190)
    page.add(
        '<section class="card"><h2>Which effects look alike</h2><p class="lead">How much of the effect'
        " on the left the effect below explains (R²), once base and tool are fitted. Dark pairs"
        ' cannot be told apart by this plan.</p><div class="scroll"><div'
        f' style="min-width:{min(size, 1180)}px">'
    )
    page.chart(
        "alike",
        [
            {
                "type": "heatmap",
                "z": [[round(float(v), 3) for v in row] for row in seen["r2"]],
                "x": labels,
                "y": labels,
                "zmin": 0,
                "zmax": 1,
                "colorscale": [
                    [0, "#ffffff"],
                    [0.5, "#cfe0f2"],
                    [0.9, "#5f97cf"],
                    [0.98, "#1f5fa8"],
                    [1, "#0d2f57"],
                ],
                "colorbar": {"thickness": 12},
                "hovertemplate": "%{y}, of which %{x} explains %{z:.2f}<extra></extra>",
            }
        ],
        square_layout(size),
        size="free",
    )
    page.add("</div></div>")
    if seen["alike"]:
        items = "".join(
            f"<li><b>{escaped(effect_at(p['effect'], p['joint']))}</b> is not told from"
            f" <b>{escaped(effect_at(p['other'], p['other_joint']))}</b> (R² {p['r2']:.3f}). To tell:"
            f" {escaped(p['separated_by'])}.</li>"
            for p in seen["alike"]
        )
        page.add(f'<ul class="plain">{items}</ul>')
    page.add("</section>")
