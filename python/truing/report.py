# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML reports: one file each, with plotly.js inside, that opens without a network.

The first screen answers three questions (how accurate was the robot, how accurate is it now, can I trust
that); what is below
is for finding out why. Reports are made from the dictionary that is written as ``result.json`` and from the
table of
rows (:class:`truing.results.Rows`), so that they never know more than what is on disk.
"""

from __future__ import annotations

import base64
import html
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.results import Rows, without_nan

Floats = NDArray[np.float64]

# Colours that stay apart for colour-blind readers and in grey print: before is light and warm, after dark and
# cool.
BEFORE, AFTER, REJECTED, INK, MUTED, GRID = "#d98324", "#1f5fa8", "#b3261e", "#1c2530", "#5b6673", "#e6e9ed"
CLOUD_POINTS = 1200  # shown in the 3-D plot
SMALL_POINTS = 500  # shown in each small plot
ROW_POINTS = 1500  # shown over the row order
LISTED_REJECTED = 200
GROSS = 10  # times the median error: what no noise does
_SAID_BY_CHECKS = (
    "left out as gross outliers",
    "held-out error",
    "no rows were held out",
    "nothing was held out",
    "did not converge",
)


def identification_report(
    result: Mapping[str, Any], rows: Rows, correlation: tuple[Sequence[str], Floats] | None = None
) -> str:
    """The report of ``truing identify``.

    Args:
        result: What ``result.json`` holds (format ``truing-identification/1``).
        rows: Errors of every row before and after.
        correlation: Names and correlation matrix, shape=(n, n), of the fitted parameters.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: calibration report")
    held_out = "test" in result["errors"]
    errors = result["errors"]["test" if held_out else "train"]
    shown = rows.test if held_out else ~rows.test & ~rows.rejected
    before, after = rows.magnitude_before, rows.magnitude_after

    page.add(_headline(result, errors, held_out, rows.what))
    page.add('<div class="first">')
    page.add('<section class="card"><h2>How far off, before and after</h2>')
    page.chart(
        "distribution",
        *distribution_chart([(before[shown], BEFORE, "before"), (after[shown], AFTER, "after")]),
        size="tall",
    )
    page.add(
        f'<p class="note">{counted(int(shown.sum()), "row")}'
        f" {'held out of the fit' if held_out else 'of the fit'}. "
        f"“Before” is the nominal robot with its base and tool already fitted, so only the robot's own error"
        f" is compared. "
        f"The scale is logarithmic.</p></section>"
    )
    page.add(_trust_box(result, rows))
    page.add("</div>")

    page.add(_found(result))
    page.add('<section class="card"><h2>Where in the workspace</h2>')
    _workspace(page, rows)
    page.add(
        '</section><section class="card"><h2>Error over each joint</h2><p class="lead">A line that rises,'
        " falls or waves with a joint says that this joint still has an error that the model does not know."
        " Flat and low is good.</p>"
    )
    _joint_charts(page, rows)
    page.add(
        '</section><section class="card"><h2>Error over '
        + ("time" if rows.time is not None else "the order of the rows")
        + "</h2>"
    )
    chart_over_rows(page, rows)
    page.add("</section>")
    page.add(_parameter_table(result["parameters"]))
    page.add(_frozen(result.get("frozen", [])))
    if correlation is not None and len(correlation[0]) > 1:
        _correlations(page, *correlation)
    page.add(_rejected(rows))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def prediction_report(result: Mapping[str, Any], rows: Rows | None) -> str:
    """The report of ``truing predict``; `rows` (before and after are the same) is looked at when `result` has
    errors.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: prediction")
    if rows is None or "errors" not in result:
        page.add(
            f'<header><p class="kicker">truing predict</p><h1>{counted(result["rows"], "row")}'
            ' predicted.</h1><p class="sub">The data has no measurements, so there is nothing to compare'
            " with.</p></header>"
        )
    else:
        errors = result["errors"]
        page.add(
            f'<header><p class="kicker">truing predict · {escaped(result.get("robot"))}</p><h1>This robot'
            f' file misses the measurements by <span class="after">{length_text(errors["mean_m"])}</span> on'
            f' average.</h1><p class="sub">{counted(errors["n"], "measured row")}. Base and tool are those of'
            " the robot file; nothing was fitted.</p></header>"
        )
        page.add(
            '<div class="big">'
            + "".join(
                f'<div class="number"><p>{label}</p><strong'
                f' class="after">{length_text(errors[key])}</strong></div>'
                for label, key in (("mean", "mean_m"), ("95 % are below", "p95_m"), ("worst", "max_m"))
            )
            + "</div>"
        )
        page.add('<section class="card"><h2>Distribution</h2>')
        page.chart("distribution", *distribution_chart([(rows.magnitude_after, AFTER, "error")]), size="tall")
        page.add("</section>")
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


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
    page.add(_parameter_table(result["parameters"], promised=True))
    page.add(_frozen(result.get("frozen", [])))
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
    """What a plan tells apart: smallest sizes, a map of what is like what, what poses were added for."""
    effects = seen["effects"]
    if seen["separated"]:
        rows = "".join(
            f"<tr><th>{escaped(effect_at(p['effect'], p['joint']))}</th><td>{escaped(effect_at(p['other'], p['other_joint']))}</td>"
            + table_cell(p["r2"], f"{p['r2']:.3f}")
            + (
                table_cell(p["r2_after"], f"{p['r2_after']:.3f}")
                if p["r2_after"] is not None
                else "<td>–</td>"
            )
            + f"<td>{'never' if p['size'] is None else escaped(size_words(p['size'], p['unit']))}</td>"
            + f"<td>{'–' if p['r2_after'] is None else 'never' if p['size_after'] is None else escaped(size_words(p['size_after'], p['unit']))}</td></tr>"
            for p in seen["separated"]
        )
        head = "".join(
            f'<th><button type="button">{name}</button></th>'
            for name in ("effect", "told from", "R² before", "R² after", "from this size on, before", "after")
        )
        page.add(
            f'<section class="card"><h2>To be told apart: {counted(seen["added_poses"], "pose")} added</h2><p'
            ' class="lead">R² is the share of the first effect that the second one could pass for, once base'
            " and tool are fitted. The added poses are the last ones of poses.csv.</p><div"
            ' class="scroll"><table'
            f' class="sortable"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></section>'
        )
    if effects:
        shown = sorted(effects, key=lambda e: -e["size_at_tip_m"])
        labels = [effect_at(e["effect"], e["joint"]) for e in shown]
        sizes = [
            [size_words(e["size"], e["unit"]), size_words(e["size_with_geometry"], e["unit"]), e["parameter"]]
            for e in shown
        ]
        tips = [
            tip
            for e in shown
            for tip in (e["size_at_tip_m"], e["size_with_geometry_at_tip_m"])
            if tip is not None
        ]
        page.add(
            '<section class="card"><h2>The smallest effects that would be seen</h2><p class="lead">How far'
            ' the tip would move (rms) by an effect that just shows: <span class="after">dark</span> with'
            ' base and tool fitted, <span class="before">light</span> with all geometry fitted as well.'
            " Without a light mark, geometry takes the effect up. Short is good.</p>"
        )
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
                    "hovertemplate": (
                        "%{y}: %{x:.3g} mm at the tip<br>%{customdata[2]}: %{customdata[0]}<extra></extra>"
                    ),
                },
                {
                    "type": "scatter",
                    "mode": "markers",
                    "y": labels,
                    "x": [
                        (
                            None
                            if e["size_with_geometry_at_tip_m"] is None
                            else 1e3 * e["size_with_geometry_at_tip_m"]
                        )
                        for e in shown
                    ],
                    "marker": {"color": BEFORE, "size": 9, "symbol": "diamond"},
                    "name": "all geometry fitted too",
                    "customdata": sizes,
                    "hovertemplate": (
                        "%{y}: %{x:.3g} mm at the tip<br>%{customdata[2]}: %{customdata[1]}<extra></extra>"
                    ),
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
    if len(effects) > 1:
        labels = [effect_at(e["effect"], e["joint"]) for e in effects]
        size = max(440, 15 * len(labels) + 190)
        page.add(
            '<section class="card"><h2>Which effects look alike</h2><p class="lead">How much of the effect'
            " on the left the effect below could pass for (R²), once base and tool are fitted. Dark pairs"
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
            {
                "xaxis": {
                    "tickangle": -90,
                    "showgrid": False,
                    "dtick": 1,
                    "tickfont": {"size": 10},
                    "automargin": True,
                },
                "yaxis": {
                    "autorange": "reversed",
                    "showgrid": False,
                    "dtick": 1,
                    "tickfont": {"size": 10},
                    "automargin": True,
                    "zeroline": False,
                },
                "height": size,
            },
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
    if seen["not_testable"]:
        items = "".join(
            f"<li><b>{escaped(effect_at(n['effect'], ', '.join(n['joints'])))}</b>: {escaped(n['why'])}</li>"
            for n in seen["not_testable"]
        )
        page.add(
            '<section class="card"><h2>Not testable with such data</h2><ul'
            f' class="plain">{items}</ul></section>'
        )


# ------------------------------------------------------------------------------------------------------------------
# first screen


def _headline(result: Mapping[str, Any], errors: Mapping[str, Any], held_out: bool, what: str) -> str:
    before, after = errors["before"], errors["after"]
    name = escaped(result.get("robot") or "The robot")
    ratio = before["mean_m"] / after["mean_m"] if after["mean_m"] else math.inf
    was, now = (
        f'<span class="before">{length_text(before["mean_m"])}</span>',
        f'<span class="after">{length_text(after["mean_m"])}</span>',
    )
    if ratio > 1.05:
        sentence = f"{name} was off by {was} on average.<br>Calibrated, it is off by {now}."
    elif ratio > 0.95:
        sentence = (
            f"Calibration changed nothing that shows: {name} was off by {was} on average and still is by"
            f" {now}."
        )
    else:
        sentence = f"Calibration made {name} worse: off by {was} on average before, {now} after."
    n = after["n"]
    where = (
        f"Measured on {counted(n, 'row')} that the fit never saw"
        if held_out
        else f"Measured on the {counted(n, 'row')} of the fit itself, because nothing was held out"
    )
    if not result["solver"].get("converged", True):
        where += "; the fit did not converge"
    rotation = ""
    if before.get("rotation_rms_rad") is not None and after.get("rotation_rms_rad") is not None:
        rotation = (
            f" Orientation: {angle_text(before['rotation_rms_rad'])} →"
            f" {angle_text(after['rotation_rms_rad'])} rms."
        )
    cards = []
    for label, key in (
        ("mean error", "mean_m"),
        ("95 % of errors are below", "p95_m"),
        ("worst error", "max_m"),
    ):
        unit, scale = length_unit(before[key])
        times = before[key] / after[key] if after[key] else math.inf
        gain = (
            f"{figures_text(times, 2)} × better"
            if times > 1.05
            else ("no change" if times > 0.95 else f"{figures_text(1 / times, 2)} × worse")
        )
        tone = "" if times > 1.05 else "same" if times > 0.95 else "bad"
        cards.append(
            f'<div class="number"><p>{label}</p><div><span'
            f' class="before">{figures_text(before[key] * scale)}</span><span class="arrow">→</span><strong'
            f' class="after">{figures_text(after[key] * scale)}</strong><span class="unit">{unit}</span><em'
            f' class="{tone}">{gain}</em></div></div>'
        )
    return (
        f'<header><p class="kicker">truing identify · {"held-out " if held_out else ""}{what}'
        f' errors</p><h1>{sentence}</h1><p class="sub">{where}.{rotation}</p></header><div'
        f' class="big">{"".join(cards)}</div>'
    )


def _trust_box(result: Mapping[str, Any], rows: Rows) -> str:
    """Checks in words, each good, worth a look, or bad; the worst of them is the verdict."""
    checks: list[tuple[int, str, str]] = []
    errors, solver = result["errors"], result["solver"]
    train = errors["train"]["after"]
    if solver.get("converged", True):
        checks.append(
            (
                0,
                "The fit converged",
                f"{counted(solver['iterations'], 'iteration')}, {escaped(solver['name'])}",
            )
        )
    else:
        checks.append((2, "The fit did not converge", escaped(solver["stopped_because"])))
    # Held-out rows are never rejected. A few gross outliers among them say nothing about the fit, so they are
    # judged apart.
    usual = float(np.median(rows.magnitude_after[~rows.test & ~rows.rejected])) if train["n"] else 0.0
    wild = rows.test & (rows.magnitude_after > GROSS * usual) if usual else np.zeros_like(rows.test)
    if wild.sum() > 0.2 * rows.test.sum():
        wild = np.zeros_like(wild)
    rest = rows.magnitude_after[rows.test & ~wild]
    if "test" in errors:
        held_out = float(np.sqrt(np.nanmean(rest**2))) if wild.any() else errors["test"]["after"]["rms_m"]
        ratio = held_out / train["rms_m"] if train["rms_m"] else 1.0
        grade = 0 if ratio < 1.35 else 1 if ratio < 2 else 2
        text = (
            "Unseen poses are as good as fitted ones",
            "Unseen poses are somewhat worse than fitted ones",
            "Unseen poses are much worse than fitted ones",
        )[grade]
        checks.append(
            (
                grade,
                text,
                (
                    f"rms {length_text(held_out)} held"
                    f" out{' (without bad measurements)' if wild.any() else ''},"
                    f" {length_text(train['rms_m'])} fitted"
                ),
            )
        )
    else:
        checks.append(
            (1, "Nothing was held out", "the errors are those of the rows that were fitted, and flatter")
        )
    rank = int(result["rank"])
    per = train["n"] / rank if rank else math.inf
    grade = 0 if rows.numbers_per_row * per >= 10 else 1 if rows.numbers_per_row * per >= 4 else 2
    checks.append(
        (
            grade,
            ("Enough rows", "Few rows", "Too few rows")[grade] + " for the parameters",
            f"{figures_text(per, 2)} rows per parameter ({train['n']} rows, {rank} parameters)",
        )
    )
    noise = result.get("noise_sigma_m")
    if noise is not None:
        checks.append(
            (
                0,
                "What the model leaves",
                (
                    f"{length_text(noise)} per {'reading' if rows.what == 'distance' else 'axis'}:"
                    " measurement noise and what the robot cannot repeat"
                ),
            )
        )
    rejected = int(rows.rejected.sum())
    share = rejected / max(1, int((~rows.test).sum()))
    checks.append(
        (
            0 if share <= 0.05 else 1,
            "No row rejected" if rejected == 0 else f"{counted(rejected, 'row')} rejected as gross outliers",
            f"{share:.1%} of the training rows" if rejected else "no gross outliers among the training rows",
        )
    )
    if wild.any():
        checks.append(
            (
                1,
                (
                    f"{counted(int(wild.sum()), 'held-out row')}"
                    f" {'looks like a bad measurement' if wild.sum() == 1 else 'look like bad measurements'}"
                ),
                (
                    f"{GROSS} times the usual error or more, and counted above. Without: mean"
                    f" {length_text(float(np.nanmean(rest)))}, worst {length_text(float(np.nanmax(rest)))}"
                ),
            )
        )
    frozen = result.get("frozen", [])
    if frozen:
        names = ", ".join(escaped(f.get("parameter") or _main(f["combination"])) for f in frozen[:4]) + (
            " …" if len(frozen) > 4 else ""
        )
        checks.append(
            (
                0,
                f"{counted(len(frozen), 'combination')} that these data cannot see",
                f'kept at nominal: {names} (<a href="#frozen">in words</a>). Harmless for poses like these.',
            )
        )
    else:
        checks.append((0, "Every parameter can be seen", "nothing had to be kept at nominal"))
    # Warnings that a check above has already said are not said twice.
    other = [w for w in result.get("warnings", []) if not any(said in w for said in _SAID_BY_CHECKS)]
    for warning in other[:3]:
        short = (
            escaped(warning)
            if len(warning) < 130
            else escaped(warning[:120].rsplit(" ", 1)[0]) + ' … (<a href="#warnings">in full</a>)'
        )
        checks.append((1, "Warning", short))
    if len(other) > 3:
        checks.append(
            (1, "More warnings", f'<a href="#warnings">{counted(len(other) - 3, "more warning")}</a>')
        )
    worst = max(grade for grade, _, _ in checks)
    verdict = (
        "You can trust this calibration",
        "Usable, but look at the marked points",
        "Do not rely on this yet",
    )[worst]
    items = "".join(
        f'<li class="g{grade}"><i'
        f' aria-label="{("good", "look", "bad")[grade]}">{"✓!✕"[grade]}</i><div><b>{head}</b><span>{text}</span></div></li>'
        for grade, head, text in sorted(checks, key=lambda check: -check[0])
    )
    return f'<section class="card trust t{worst}"><h2>{verdict}</h2><ul>{items}</ul></section>'


def _found(result: Mapping[str, Any]) -> str:
    """The effects, in a sentence each, when any were fitted."""
    effects = result.get("effects") or []
    names = {name for effect in effects for name in effect.get("parameters", {})}
    if not names:
        return ""
    items = []
    for p in result["parameters"]:
        if p["name"] in names and p["sigma"] is not None:
            significance = abs(p["value"] - p["nominal"]) / p["sigma"] if p["sigma"] else math.inf
            say = (
                "clearly there"
                if significance > 5
                else "probably there"
                if significance > 3
                else "not distinguishable from none"
            )
            unit, scale = {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}.get(p["unit"], (p["unit"], 1.0))
            number = f"{p['value'] * scale:.3g} ± {p['sigma'] * scale:.2g}"
            items.append(
                f"<li><b>{escaped(p['name'])}</b> = {number} {escaped(unit)}: {say}"
                f" ({figures_text(min(significance, 99999), 2)} σ)</li>"
            )
    return (
        '<section class="card"><h2>Effects that were fitted</h2><ul'
        f' class="plain">{"".join(items)}</ul></section>'
        if items
        else ""
    )


# ----------------------------------------------------------------------------------------------------------------------
# the charts


def distribution_chart(
    series: Sequence[tuple[Floats, str, str]],
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Share of rows over the error, on a logarithmic axis: steps, filled, named where they peak."""
    finite = [(values[np.isfinite(values)], colour, name) for values, colour, name in series]
    everything = np.concatenate([values for values, _, _ in finite]) if finite else np.empty(0)
    if everything.size == 0 or everything.max() <= 0:
        return [], {"xaxis": {}, "yaxis": {}}
    low = max(float(np.quantile(everything, 0.002)), float(everything.max()) * 1e-5)
    high = float(everything.max()) * 1.15
    edges = np.geomspace(low / 1.15, high, 46)
    unit, scale = length_unit(float(np.median(everything)), big=True)
    traces: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    top = 0.0
    for values, colour, name in finite:
        if values.size == 0:
            continue
        counts = np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / values.size * 100
        # A step line that starts and ends on the floor.
        x = np.repeat(edges, 2) * scale
        y = np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": packed(x),
                "y": packed(y),
                "name": name,
                "fill": "tozeroy",
                "line": {"color": colour, "width": 2},
                "fillcolor": faded(colour, 0.28),
                "hoverinfo": "skip",
            }
        )
        peak = int(np.argmax(counts))
        annotations.append(
            {
                "x": math.log10(math.sqrt(edges[peak] * edges[peak + 1]) * scale),
                "y": float(counts[peak]),
                "text": f"<b>{name}</b>",
                "showarrow": False,
                "yshift": 12,
                "font": {"color": colour, "size": 15},
            }
        )
        top = max(top, float(counts[peak]))
        for quantile, label in ((float(values.mean()), "mean"),):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": [quantile * scale] * 2,
                    "y": [0, float(counts[peak])],
                    "line": {"color": colour, "width": 1.5, "dash": "dot"},
                    "name": f"{name}, {label}",
                    "hoverinfo": "name",
                }
            )
    tick_values, tick_texts = _log_ticks(edges[0] * scale, edges[-1] * scale)
    layout = {
        "xaxis": {
            "type": "log",
            "title": {"text": f"error [{unit}]"},
            "tickvals": tick_values,
            "ticktext": tick_texts,
            "range": [math.log10(edges[0] * scale), math.log10(edges[-1] * scale)],
        },
        "yaxis": {"title": {"text": "share of rows [%]"}, "range": [0, top * 1.18]},
        "annotations": annotations,
    }
    return traces, layout


def _workspace(page: Page, rows: Rows) -> None:
    known = np.flatnonzero(
        np.isfinite(rows.position).all(axis=1) & np.isfinite(rows.magnitude_after) & ~rows.rejected
    )
    pick = subsample(known, CLOUD_POINTS)
    if pick.size == 0:
        page.add('<p class="note">No positions to draw.</p>')
        return
    position = rows.position[pick]
    traces: list[dict[str, Any]] = []
    extent = float(np.ptp(position, axis=0).max()) or 1.0
    words = []
    flat: dict[str, list[dict[str, Any]]] = {"top": [], "side": []}
    for name, error, size, shown in (
        ("after", rows.error_after[pick], rows.magnitude_after[pick], True),
        ("before", rows.error_before[pick], rows.magnitude_before[pick], False),
    ):
        limit = float(np.quantile(size, 0.98)) or 1e-9
        unit, scale = length_unit(limit)
        marker = {
            "size": 3.5,
            "color": packed(size * scale),
            "colorscale": "Viridis",
            "reversescale": True,
            "cmin": 0,
            "cmax": limit * scale,
            "colorbar": {"title": {"text": unit}, "thickness": 12, "len": 0.7},
        }
        traces.append(
            {
                "type": "scatter3d",
                "mode": "markers",
                "visible": shown,
                "name": name,
                "marker": marker,
                **{axis: packed(position[:, i]) for i, axis in enumerate("xyz")},
                "hovertemplate": (
                    f"%{{marker.color:.3g}} {unit}<br>x %{{x:.3f}} y %{{y:.3f}} z %{{z:.3f}}"
                    f" m<extra>{name}</extra>"
                ),
            }
        )
        factor = _round_down(0.06 * extent / limit)
        drawn = np.isfinite(error).all(axis=1)
        tails = np.full((3 * int(drawn.sum()), 3), np.nan)
        tails[0::3], tails[1::3] = position[drawn], position[drawn] + factor * error[drawn]
        traces.append(
            {
                "type": "scatter3d",
                "mode": "lines",
                "visible": shown,
                "name": name,
                "hoverinfo": "skip",
                "line": {"color": faded(INK, 0.45), "width": 1.5},
                **{axis: packed(tails[:, i]) for i, axis in enumerate("xyz")},
            }
        )
        if drawn.any():
            words.append(f"{name}: {factor:g} ×")
        for view, (first, second) in {"top": (0, 1), "side": (0, 2)}.items():
            flat[view].append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "visible": shown,
                    "x": packed(position[:, first]),
                    "y": packed(position[:, second]),
                    "marker": {**marker, "size": 6},
                    "name": name,
                    "hovertemplate": f"%{{marker.color:.3g}} {unit}<extra>{name}</extra>",
                }
            )
    page.add(
        '<div class="toggle" role="group" aria-label="errors shown"><button data-show="after"'
        ' class="on">after</button><button data-show="before">before</button></div>'
    )
    axes = {f"{axis}axis": {"title": {"text": f"{axis} [m]"}} for axis in "xyz"}
    page.chart(
        "workspace",
        traces,
        {
            "scene": {
                **axes,
                "aspectmode": "data",
                "camera": {"eye": {"x": 1.25, "y": 1.25, "z": 0.75}, "center": {"x": 0, "y": 0, "z": -0.12}},
            },
            "fallback": flat,
        },
        size="cloud",
    )
    strokes = (
        f" Strokes point from the measured to the predicted place, enlarged ({', '.join(words)})."
        if words
        else ""
    )
    page.add(
        f'<p class="note">{_shown(pick.size, known.size, "row")}{strokes} Rejected rows are left out. Colours'
        " stop at the 98 % quantile.</p>"
    )


def _joint_charts(page: Page, rows: Rows) -> None:
    usable = np.flatnonzero(
        np.isfinite(rows.magnitude_after) & np.isfinite(rows.magnitude_before) & ~rows.rejected
    )
    pick = subsample(usable, SMALL_POINTS)
    limits, axis = _log_error_axis(
        np.concatenate([rows.magnitude_before[usable], rows.magnitude_after[usable]])
    )
    page.add(
        '<p class="legend"><i class="before"></i>before <i class="after"></i>after · lines are running'
        ' medians</p><div class="multiples">'
    )
    for column, name in enumerate(rows.joint_names):
        angle = rows.joint_units[column] == "rad"
        values = rows.joints[:, column] * (180 / math.pi if angle else 1000.0)
        traces = []
        for size, colour, label in (
            (rows.magnitude_before, BEFORE, "before"),
            (rows.magnitude_after, AFTER, "after"),
        ):
            traces.append(points_trace(values[pick], size[pick] * limits, colour, label, 3, opacity=0.35))
        for size, colour, label in (
            (rows.magnitude_before, BEFORE, "before"),
            (rows.magnitude_after, AFTER, "after"),
        ):
            middles, medians = _running_median(values[usable], size[usable])
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(middles),
                    "y": packed(medians * limits),
                    "hoverinfo": "skip",
                    "line": {"color": colour, "width": 3},
                    "name": label,
                }
            )
        page.chart(
            f"joint{column}",
            traces,
            {"xaxis": {"title": {"text": f"{name} [{'°' if angle else 'mm'}]"}}, "yaxis": axis},
            size="small",
        )
    page.add(f'</div><p class="note">{_shown(pick.size, usable.size, "row")} Medians are of all of them.</p>')


def chart_over_rows(page: Page, rows: Rows, out_word: str = "rejected") -> None:
    """Errors before and after over time, or over the order of the rows. `out_word`: what the rows in
    `rows.rejected` are.
    """
    order = rows.time if rows.time is not None else np.arange(rows.count, dtype=np.float64)
    usable = np.flatnonzero(
        np.isfinite(rows.magnitude_after) & np.isfinite(rows.magnitude_before) & ~rows.rejected
    )
    pick = subsample(usable, ROW_POINTS)
    everything = np.concatenate(
        [rows.magnitude_before[usable], rows.magnitude_after[usable], rows.magnitude_after[rows.rejected]]
    )
    limits, axis = _log_error_axis(everything)
    traces = [
        points_trace(order[pick], rows.magnitude_before[pick] * limits, BEFORE, "before", 4, opacity=0.5),
        points_trace(order[pick], rows.magnitude_after[pick] * limits, AFTER, "after", 4, opacity=0.6),
    ]
    if rows.rejected.any():
        out = subsample(np.flatnonzero(rows.rejected), 500)
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": packed(order[out]),
                "y": packed(rows.magnitude_after[out] * limits),
                "name": out_word,
                "text": [f"row {i}" for i in out],
                "marker": {"symbol": "x-thin", "size": 9, "line": {"color": REJECTED, "width": 2}},
            }
        )
    page.chart(
        "rows",
        traces,
        {
            "xaxis": {"title": {"text": "time [s]" if rows.time is not None else "row"}},
            "yaxis": axis,
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.12, "x": 0},
        },
        size="wide",
    )
    page.add(
        f'<p class="note">{_shown(pick.size, usable.size, "row")} A trend here means drift: warming up, a'
        " tracker that moved, a loose target.</p>"
    )


def _correlations(page: Page, names: Sequence[str], matrix: Floats) -> None:
    off = np.abs(matrix - np.diag(np.diag(matrix)))
    pairs = [
        (i, j)
        for i, j in zip(*np.unravel_index(np.argsort(-np.triu(off), axis=None)[:6], off.shape), strict=True)
        if off[i, j] > 0.9
    ]
    page.add('<section class="card"><h2>Which parameters lean on each other</h2>')
    if pairs:
        page.add(
            '<p class="lead">Strongly tied (their sum or difference is known better than each alone): '
            + "; ".join(
                f"{escaped(names[i])} and {escaped(names[j])} ({matrix[i, j]:+.2f})" for i, j in pairs
            )
            + ".</p>"
        )
    else:
        page.add('<p class="lead">No two parameters are tied more strongly than 0.9.</p>')
    labels = list(names)
    size = max(420, 15 * len(labels) + 140)
    page.add(f'<div class="scroll"><div style="min-width:{min(size, 980)}px">')
    page.chart(
        "correlation",
        [
            {
                "type": "heatmap",
                "z": [[round(float(v), 3) for v in row] for row in matrix],
                "x": labels,
                "y": labels,
                "zmin": -1,
                "zmax": 1,
                "colorscale": [[0, "#b2560d"], [0.5, "#ffffff"], [1, "#1f5fa8"]],
                "colorbar": {"thickness": 12},
                "hovertemplate": "%{y} · %{x}: %{z:.2f}<extra></extra>",
            }
        ],
        {
            "xaxis": {
                "tickangle": -90,
                "showgrid": False,
                "dtick": 1,
                "tickfont": {"size": 10},
                "automargin": True,
            },
            "yaxis": {
                "autorange": "reversed",
                "showgrid": False,
                "dtick": 1,
                "tickfont": {"size": 10},
                "automargin": True,
                "zeroline": False,
            },
            "height": size,
        },
        size="free",
    )
    page.add("</div></div></section>")


# -----------------------------------------------------------------------------------------------------------------------
# the tables


def _parameter_table(parameters: Iterable[Mapping[str, Any]], promised: bool = False) -> str:
    head = (
        ["parameter", "nominal", "standard error"]
        if promised
        else ["parameter", "nominal", "found", "change", "standard error", "significance"]
    )
    body = []
    # The robot first; where it stands was never nominal, so it comes last and has no significance.
    for p in sorted(parameters, key=lambda p: _placed(p["name"])):
        nominal, unit = _natural(p["nominal"], p["unit"])
        cells = [f"<th>{escaped(p['name'])}</th>", table_cell(nominal, f"{nominal:.6g} {unit}")]
        frozen = p.get("frozen", False) or p["sigma"] is None
        sigma = None if frozen else _natural(p["sigma"], p["unit"])[0]
        if promised:
            cells.append(
                '<td class="held" data-v="-1">cannot be found</td>'
                if sigma is None
                else table_cell(sigma, f"± {figures_text(sigma, 2)} {unit}")
            )
        elif sigma is None:
            cells.append(
                '<td class="held" colspan="4" data-v="-1">kept at nominal: the data cannot see it</td>'
            )
        else:
            value = _natural(p["value"], p["unit"])[0]
            change = value - nominal
            significance = abs(change) / sigma if sigma > 0 else math.inf
            decimals = min(9, max(0, 1 - math.floor(math.log10(sigma)))) if sigma > 0 else 6
            if _placed(p["name"]):
                cells += [
                    table_cell(value, f"{value:.{decimals}f} {unit}"),
                    table_cell(change, f"{change:+.{decimals}f}"),
                    table_cell(sigma, f"± {figures_text(sigma, 2)}"),
                    '<td class="held" data-v="-1">placement</td>',
                ]
                body.append(f"<tr>{''.join(cells)}</tr>")
                continue
            width = min(100.0, 25 * math.log10(1 + significance)) if math.isfinite(significance) else 100.0
            cells += [
                table_cell(value, f"{value:.{decimals}f} {unit}"),
                table_cell(change, f"{change:+.{decimals}f}"),
                table_cell(sigma, f"± {figures_text(sigma, 2)}"),
                (
                    f'<td data-v="{significance:.6g}"'
                    f' class="{"strong" if significance > 3 else "held"}"><span class="bar"'
                    f' style="width:{width * 0.6:.0f}px"></span>{figures_text(min(significance, 99999), 2)}'
                    " σ</td>"
                ),
            ]
        body.append(f"<tr>{''.join(cells)}</tr>")
    title = "What standard errors these poses promise" if promised else "Every parameter"
    lead = (
        ""
        if promised
        else (
            '<p class="lead">Significance is the change over its standard error: above 3 the robot really'
            " differs there from its data sheet; below, the data cannot tell. Click a heading to sort.</p>"
        )
    )
    columns = "".join(f'<th><button type="button">{h}</button></th>' for h in head)
    return (
        f'<section class="card"><h2>{title}</h2>{lead}<div class="scroll"><table'
        f' class="sortable"><thead><tr>{columns}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div></section>"
    )


def _frozen(frozen: Sequence[Mapping[str, Any]]) -> str:
    """The combinations that no measurement in this data depends on, as sentences."""
    if not frozen:
        return ""
    items = []
    for entry in frozen:
        combination = entry["combination"]
        held = entry.get("parameter") or _main(combination)
        others = [
            (name, weight) for name, weight in combination.items() if name != held and abs(weight) > 1e-3
        ]
        others.sort(key=lambda item: -abs(item[1]))
        if others:
            tied = ", ".join(f"{escaped(name)} ({weight:+.2g})" for name, weight in others[:5]) + (
                f" and {len(others) - 5} more" if len(others) > 5 else ""
            )
            text = (
                f"changing <b>{escaped(held)}</b> together with {tied} changes no measurement, so only the"
                f" combination is known. {escaped(held)} stays at nominal and the others take over its part."
            )
        else:
            text = f"<b>{escaped(held)}</b> changes no measurement at all; it stays at nominal."
        reason = entry.get("why") or ""
        why = (
            f' <span class="muted">({escaped(reason)})</span>'
            if reason and "changes no measurement" not in reason
            else ""
        )
        items.append(f"<li>{text[0].upper() + text[1:]}{why}</li>")
    return (
        '<section class="card" id="frozen"><h2>What these data cannot see</h2><ul'
        f' class="plain">{"".join(items)}</ul></section>'
    )


def _rejected(rows: Rows) -> str:
    out = np.flatnonzero(rows.rejected)
    if out.size == 0:
        return '<section class="card"><h2>Rejected rows</h2><p>None.</p></section>'
    body = []
    order = out[np.argsort(-np.nan_to_num(rows.magnitude_after[out]))]
    for row in order[:LISTED_REJECTED]:
        parts = (
            "".join(table_cell(float(v), _signed_length(float(v))) for v in rows.error_after[row])
            if np.isfinite(rows.error_after[row]).all()
            else "<td></td>" * 3
        )
        body.append(
            f"<tr><th>{row}</th>{table_cell(float(rows.magnitude_after[row]), length_text(float(rows.magnitude_after[row])))}{parts}</tr>"
        )
    more = (
        f'<p class="note">The {LISTED_REJECTED} largest of {out.size}; residuals.csv has all.</p>'
        if out.size > LISTED_REJECTED
        else ""
    )
    return (
        f'<section class="card"><h2>Rejected rows</h2><p class="lead">{counted(out.size, "training row")} so'
        " far from all others that the fit left "
        f"{'it' if out.size == 1 else 'them'} out. Rows count from 0, in the order of the data file.</p>"
        '<div class="scroll"><table'
        ' class="sortable"><thead><tr><th><button>row</button></th><th><button>error</button></th><th><button>x</button></th>'
        f"<th><button>y</button></th><th><button>z</button></th></tr></thead><tbody>{''.join(body)}</tbody></table></div>{more}</section>"
    )


def warnings_card(result: Mapping[str, Any]) -> str:
    items = "".join(f"<li>{escaped(w)}</li>" for w in result.get("warnings", []))
    return (
        f'<section class="card" id="warnings"><h2>Warnings</h2><ul class="plain">{items}</ul></section>'
        if items
        else ""
    )


def footer(result: Mapping[str, Any]) -> str:
    parts = [f"truing {escaped(result.get('version', ''))}", escaped(result["format"])]
    if "solver" in result:
        parts.append(f"{escaped(result['solver']['name'])}: {escaped(result['solver']['stopped_because'])}")
    if "seed" in result:
        parts.append(f"seed {result['seed']}")
    return f"<footer>{' · '.join(parts)}</footer>"


# -------------------------------------------------------------------------------------------------------------------------
# numbers


def escaped(text: object) -> str:
    return html.escape(str(text if text is not None else ""))


def counted(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}".replace(",", "\u202f")


def _shown(shown: int, total: int, noun: str) -> str:
    return (
        f"{counted(total, noun)}."
        if shown == total
        else f"{counted(shown, noun)} drawn of {counted(total, noun)}, evenly picked."
    )


def figures_text(value: float, figures: int | None = None) -> str:
    """Plain decimal text with `figures` significant figures (3 from 1 on, 2 below), never an exponent."""
    if not math.isfinite(value):
        return "∞" if value > 0 else "–"
    if value == 0:
        return "0"
    wanted = figures if figures is not None else 3 if abs(value) >= 1 else 2
    rounded = float(f"{value:.{wanted - 1}e}")  # 0.0999 has become 0.10, and needs a decimal less
    decimals = wanted - 1 - math.floor(math.log10(abs(rounded)))
    return f"{rounded:.{max(0, min(decimals, 9))}f}"


def length_unit(metres: float, big: bool = False) -> tuple[str, float]:
    """mm, unless that gives numbers nobody reads."""
    if not big and 0 < abs(metres) < 2e-6:
        return "µm", 1e6
    return ("m", 1.0) if abs(metres) >= 10 else ("mm", 1e3)


def length_text(metres: float | None) -> str:
    if metres is None:
        return "–"
    unit, scale = length_unit(metres)
    return f"{figures_text(metres * scale)}\u202f{unit}"


def _signed_length(metres: float) -> str:
    return ("+" if metres >= 0 else "−") + length_text(abs(metres))


def angle_text(radians: float) -> str:
    return (
        f"{figures_text(math.degrees(radians))}°"
        if abs(radians) > 2e-3
        else f"{figures_text(radians * 1e3)}\u202fmrad"
    )


def _natural(value: float, unit: str) -> tuple[float, str]:
    """In the unit a reader expects: lengths in mm, angles in degrees."""
    if unit == "m":
        return value * 1e3, "mm"
    if unit == "rad":
        return math.degrees(value), "°"
    return value, "" if unit == "-" else unit


def _placed(name: str) -> bool:
    """Whether a parameter says where the robot (or a fixed point, or an anchor) stands, not what it is."""
    return name.split(".")[0] in ("base", "anchor")


def _main(combination: Mapping[str, float]) -> str:
    return max(combination, key=lambda name: abs(combination[name]))


def table_cell(value: float, text: str) -> str:
    return f'<td data-v="{value:.9g}">{text}</td>'


def faded(colour: str, alpha: float) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


def packed(values: Floats | NDArray[np.integer[Any]]) -> dict[str, str]:
    """plotly.js's own form of a typed array: four bytes a number."""
    return {
        "dtype": "f4",
        "bdata": base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode(),
    }


def points_trace(
    x: Floats | NDArray[np.integer[Any]], y: Floats, colour: str, name: str, size: int, opacity: float = 0.8
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "markers",
        "x": packed(x),
        "y": packed(y),
        "name": name,
        "marker": {"color": colour, "size": size, "opacity": opacity},
    }


def subsample(indices: NDArray[np.integer[Any]], limit: int) -> NDArray[np.integer[Any]]:
    return (
        indices if indices.size <= limit else indices[np.linspace(0, indices.size - 1, limit).astype(np.intp)]
    )


def _running_median(x: Floats, y: Floats, bins: int = 14) -> tuple[Floats, Floats]:
    """Medians of `y` in `bins` runs of equal count along `x`."""
    order = np.argsort(x, kind="stable")
    runs = [run for run in np.array_split(order, max(1, min(bins, x.size // 4))) if run.size]
    return np.array([np.median(x[run]) for run in runs]), np.array([np.median(y[run]) for run in runs])


def _round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten."""
    if not (value > 0 and math.isfinite(value)):
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(factor for factor in (1, 2, 5) if factor * power <= value * (1 + 1e-9)) * power


def _log_ticks(low: float, high: float) -> tuple[list[float], list[str]]:
    """Ticks at 1, 2, 5 of every decade; only 1 when there are many decades."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    factors = (1, 2, 5) if len(decades) <= 3 else (1, 3) if len(decades) <= 4 else (1,)
    values = [factor * 10.0**decade for decade in decades for factor in factors]
    values = [value for value in values if low <= value <= high]
    return values, [f"{value:g}" for value in values]


def _log_error_axis(errors: Floats) -> tuple[float, dict[str, Any]]:
    """Scale from metres, and a logarithmic axis that holds the errors."""
    positive = errors[np.isfinite(errors) & (errors > 0)]
    if positive.size == 0:
        return 1e3, {"title": {"text": "error [mm]"}}
    unit, scale = length_unit(float(np.median(positive)), big=True)
    low, high = float(np.quantile(positive, 0.003)) / 1.3 * scale, float(positive.max()) * 1.3 * scale
    values, texts = _log_ticks(low, high)
    return scale, {
        "type": "log",
        "title": {"text": f"error [{unit}]"},
        "tickvals": values,
        "ticktext": texts,
        "range": [math.log10(low), math.log10(high)],
    }


# ---------------------------------------------------------------------------------------------------------------------------
# page


class Page:
    """Collects markup and charts; charts are drawn by plotly.js once the page is there. `style`: more of it,
    after the common one.
    """

    def __init__(self, title: str, style: str = "") -> None:
        self._title = title
        self._style = _STYLE + style
        self._body: list[str] = []
        self._charts: list[dict[str, Any]] = []

    def add(self, markup: str) -> None:
        self._body.append(markup)

    def chart(self, name: str, data: list[dict[str, Any]], layout: dict[str, Any], size: str) -> None:
        self._body.append(f'<div class="chart {size}" id="{name}"></div>')
        self._charts.append({"id": name, "data": data, "layout": layout})

    def html(self) -> str:
        from plotly.offline import (
            get_plotlyjs,
        )  # late: it is the slowest import of all, and most commands need none

        charts = json.dumps(without_nan(self._charts), separators=(",", ":"), allow_nan=False).replace(
            "</", "<\\/"
        )
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport"'
            ' content="width=device-width, initial-scale=1">'
            f"<title>{escaped(self._title)}</title><style>{self._style}</style></head>\n<body><main>\n"
            + "\n".join(self._body)
            + f'\n</main>\n<script>{get_plotlyjs()}</script>\n<script type="application/json"'
            f' id="charts">{charts}</script>\n<script>{_SCRIPT}</script>\n</body></html>\n'
        )


_STYLE = """
:root{--before:#b5650f;--after:#1f5fa8;--ink:#1c2530;--muted:#5b6673;--line:#dfe3e8;--good:#1e7a46;--look:#9a6700;--bad:#b3261e}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:#f5f6f8;color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:1320px;margin:0 auto;padding:24px 28px 40px;display:grid;gap:18px;grid-template-columns:minmax(0,1fr)}
header h1{font-size:clamp(23px,2.7vw,36px);line-height:1.2;font-weight:650;letter-spacing:-.012em;margin:2px 0 4px;text-wrap:balance}
header h1 span{white-space:nowrap}
.kicker{margin:0;color:var(--muted);font-size:14px;letter-spacing:.02em}
.sub{margin:0;color:var(--muted);max-width:95ch}
span.before{color:var(--before)} .after{color:var(--after)}
.big{display:grid;grid-template-columns:repeat(3,minmax(0,1fr));gap:14px}
.number,.card{background:#fff;border:1px solid var(--line);border-radius:10px}
.number{padding:12px 18px 14px;line-height:1.15}
.number p{margin:0 0 4px;color:var(--muted);font-size:15px}
.number span.before{font-size:27px;font-weight:550}
.number .arrow{color:var(--muted);font-size:23px;margin:0 9px}
.number strong{font-size:44px;font-weight:700;letter-spacing:-.02em}
.number .unit{color:var(--muted);font-size:18px;margin-left:6px}
.number div{display:flex;flex-wrap:wrap;align-items:baseline}
.number em{margin-left:auto;align-self:center;font-style:normal;font-size:14px;color:var(--good);background:#e9f5ee;border-radius:20px;padding:4px 11px;white-space:nowrap}
.number em.bad{color:var(--bad);background:#fbeceb} .number em.same{color:var(--muted);background:#eef0f3}
.first{display:grid;grid-template-columns:minmax(0,1.35fr) minmax(0,1fr);gap:18px}
.card{padding:16px 20px;min-width:0}
.card h2{font-size:19px;line-height:1.3;margin:0 0 8px;font-weight:650}
.lead,.note{margin:0 0 8px;color:var(--muted);max-width:125ch} .note{font-size:14px;margin:6px 0 0}
.muted{color:var(--muted)}
.trust{border-top:5px solid var(--good)} .trust.t1{border-top-color:#d99a00} .trust.t2{border-top-color:var(--bad)}
.trust ul{list-style:none;margin:0;padding:0;display:grid;gap:8px}
.trust li{display:grid;grid-template-columns:26px minmax(0,1fr);gap:8px;line-height:1.35;overflow-wrap:anywhere}
.trust i{font-style:normal;font-weight:700;width:24px;height:24px;border-radius:50%;text-align:center;line-height:24px;font-size:14px;color:#fff;background:var(--good)}
.trust .g1 i{background:var(--look)} .trust .g2 i{background:var(--bad)}
.trust b{display:block;font-weight:600} .trust span{color:var(--muted);font-size:14.5px}
a{color:var(--after)}
.chart{width:100%} .chart.tall{height:350px} .chart.cloud{height:600px} .chart.wide{height:340px} .chart.small{height:240px}
.flat{display:grid;grid-template-columns:repeat(auto-fit,minmax(290px,1fr));gap:10px} .flat>div{height:360px;min-width:0}
.multiples{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,330px),1fr));gap:10px}
.multiples .chart{min-width:0}
.legend{margin:0 0 6px;color:var(--muted)} .legend i{display:inline-block;width:12px;height:12px;border-radius:50%;margin:0 5px 0 10px;vertical-align:-1px}
.legend i.before{background:#d98324;margin-left:0} .legend i.after{background:var(--after)}
.toggle{display:inline-flex;border:1px solid var(--line);border-radius:8px;overflow:hidden}
.toggle button{border:0;background:#fff;padding:7px 18px;font:inherit;color:var(--muted);cursor:pointer}
.toggle button.on{background:var(--after);color:#fff}
.scroll{overflow-x:auto;-webkit-overflow-scrolling:touch}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:right;padding:5px 14px 5px 0;border-bottom:1px solid #eef0f3;white-space:nowrap;font-weight:400}
th:first-child,td:first-child{text-align:left;font-weight:550}
thead th{border-bottom:2px solid var(--line)} thead button{border:0;background:none;padding:0;font:inherit;font-weight:600;color:var(--muted);cursor:pointer}
.held{color:var(--muted)} td.held[colspan]{text-align:left;padding-left:24px} .strong{font-weight:600}
.bar{display:inline-block;height:9px;border-radius:2px;background:#9dbfe3;margin-right:8px}
.plain{margin:0;padding-left:20px;display:grid;gap:6px}
footer{color:var(--muted);font-size:13.5px;padding-top:4px;overflow-wrap:anywhere}
@media(max-width:900px){.first{grid-template-columns:minmax(0,1fr)}}
@media(max-width:640px){main{padding:14px 12px 30px;gap:12px}.card{padding:13px 13px}.big{grid-template-columns:minmax(0,1fr);gap:8px}
.number{padding:9px 14px}.number p{margin:0}.number span.before{font-size:21px}.number strong{font-size:32px}.number .arrow{margin:0 6px}
.chart.tall{height:280px}.chart.cloud{height:auto}}
@media print{body{background:#fff}.card,.number{break-inside:avoid}}
"""

_SCRIPT = """
(() => {
  const charts = JSON.parse(document.getElementById('charts').textContent);
  const narrow = matchMedia('(max-width: 640px)').matches;
  const font = {family: 'system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif', size: 13, color: '#1c2530'};
  const axis = {gridcolor: '#e6e9ed', zeroline: false, linecolor: '#c8ced6', ticks: 'outside', tickcolor: '#c8ced6', automargin: true};
  const config = {displaylogo: false, displayModeBar: false};
  const draw = (div, data, layout) => {
    const full = {font, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', showlegend: false, hovermode: 'closest',
      margin: {l: narrow ? 44 : 56, r: 12, t: layout.title || layout.showlegend ? 34 : 12, b: 44}, dragmode: narrow ? false : 'zoom', ...layout};
    for (const key of ['xaxis', 'yaxis']) if (full[key]) full[key] = {...axis, ...full[key], ...(narrow ? {fixedrange: true} : {})};
    if (full.title) full.title = {...full.title, font: {size: 15}, x: 0.02, xanchor: 'left', y: 0.97, yanchor: 'top'};
    Plotly.newPlot(div, data, full, config);
    if (window.ResizeObserver) new ResizeObserver(() => Plotly.relayout(div, {autosize: true})).observe(div);  // at once; plotly.js itself waits for the window
  };
  const webgl = () => { try { const c = document.createElement('canvas'); return !!(c.getContext('webgl2') || c.getContext('webgl')); } catch { return false; } };
  let cloud = [];  // the plots that before / after switches
  for (const {id, data, layout} of charts) {
    const div = document.getElementById(id);
    if (id !== 'workspace') { draw(div, data, layout); continue; }
    const {fallback, ...rest} = layout;
    if (webgl() && !narrow) {
      draw(div, data, {...rest, margin: {l: 0, r: 0, t: 0, b: 0}, dragmode: 'turntable'});
      cloud = [div];
    } else {  // no WebGL, or a phone, where a 3-D plot would swallow scrolling: two views instead
      div.classList.add('flat'); div.style.height = 'auto';
      for (const [view, second] of [['top', 'y'], ['side', 'z']]) {
        const part = document.createElement('div');
        div.appendChild(part);
        draw(part, fallback[view], {title: {text: view === 'top' ? 'from above' : 'from the side'}, margin: {l: 44, r: 8, t: 34, b: 44},
          xaxis: {title: {text: 'x [m]'}}, yaxis: {title: {text: second + ' [m]'}, scaleanchor: 'x'}});
        cloud.push(part);
      }
    }
  }
  for (const button of document.querySelectorAll('.toggle button')) button.addEventListener('click', () => {
    for (const other of document.querySelectorAll('.toggle button')) other.classList.toggle('on', other === button);
    for (const div of cloud) Plotly.restyle(div, {visible: div.data.map(trace => trace.name === button.dataset.show)});
  });
  for (const table of document.querySelectorAll('table.sortable')) table.querySelectorAll('thead button').forEach((button, column) => {
    let direction = column ? -1 : 1;
    button.addEventListener('click', () => {
      const value = row => { const cell = row.cells[Math.min(column, row.cells.length - 1)]; return column && cell.dataset.v !== undefined ? +cell.dataset.v : cell.textContent; };
      const rows = [...table.tBodies[0].rows].sort((a, b) => { const x = value(a), y = value(b);
        return direction * (typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), undefined, {numeric: true})); });
      direction = -direction;
      table.tBodies[0].append(...rows);
    });
  });
})();
"""
