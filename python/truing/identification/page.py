# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The reports of ``truing identify`` and ``truing predict``.

The first screen answers three questions: how accurate was the robot, how accurate is it now, can this be
trusted.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import (
    AFTER,
    BEFORE,
    chart_over_rows,
    distribution_chart,
    log_error_axis,
    packed,
    points_trace,
    round_down,
    square_layout,
    subsample,
)
from truing.report.page import Page, footer, table_cell, warnings_card
from truing.report.rows import Rows
from truing.report.scene import RobotPicture, Scene3d
from truing.report.trust import BAD, GOOD, LOOK, Check, grade_of, shortened, trust_card
from truing.report.words import angle_text, counted, drawn_of, escaped, figures_text, length_text, length_unit

Floats = NDArray[np.float64]
CLOUD_POINTS = 800  # shown in the 3-D picture
ARROW = 0.08  # of the workspace: how long the longest errors are drawn
SMALL_POINTS = 500  # shown in each small plot
LISTED_REJECTED = 200
STRUCTURE = 1.5  # times the noise of repeats: more is left than noise
GROSS = 10  # times the median error: what no noise does
_SAID_BY_CHECKS = (
    "left out as gross outliers",
    "held-out error",
    "no rows were held out",
    "nothing was held out",
    "did not converge",
)


def identification_report(
    result: Mapping[str, Any],
    rows: Rows,
    correlation: tuple[Sequence[str], Floats] | None = None,
    robot: RobotPicture | None = None,
) -> str:
    """The report of ``truing identify``.

    Args:
        result: What ``result.json`` holds (format ``truing-identification/1``).
        rows: Errors of every row before and after.
        correlation: Names and correlation matrix, shape=(n, n), of the fitted parameters.
        robot: The robot before, and what was found.
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
    workspace(page, rows, robot)
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
    page.add(parameter_table(result["parameters"]))
    page.add(frozen_card(result.get("frozen", [])))
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
    if result.get("mistake"):
        return _mistake_headline(result, sentence)
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


def _mistake_headline(result: Mapping[str, Any], sentence: str) -> str:
    """A mistake is said first: numbers of a fit to it mean nothing."""
    mistake = result["mistake"]
    head = (
        "Links changed by more than a workshop makes."
        if mistake["kind"] == "unexplained"
        else "Robot file and measurements do not go together."
    )
    text = escaped(mistake["text"][:1].upper() + mistake["text"][1:])
    return (
        f'<header><p class="kicker">truing identify · look at the robot file and the columns first</p>'
        f'<h1>{head}</h1><p class="sub">{text} As it is: {sentence}</p></header>'
    )


def _trust_box(result: Mapping[str, Any], rows: Rows) -> str:
    """Checks in words, each good, worth a look, or bad; the worst of them is the verdict."""
    # Held-out rows are never rejected. A few gross outliers among them say nothing about the fit, so they are
    # judged apart.
    gross = _gross_held_out(result, rows)
    rest = rows.magnitude_after[rows.test & ~gross]
    checks = [
        *_mistake(result),
        _converged(result["solver"]),
        _unseen_poses(result["errors"], rest, bool(gross.any())),
        *_better_than_drawn(rows, gross),
        _enough_rows(result, rows),
        *_noise(result, rows),
        _rejected_share(rows),
        *_bad_measurements(gross, rest),
        _unseen_combinations(result.get("frozen", [])),
        *_more_warnings(result),
    ]
    return trust_card(
        checks,
        (
            "You can trust this calibration",
            "Usable, but look at the marked points",
            "Do not rely on this yet",
        ),
    )


def _mistake(result: Mapping[str, Any]) -> list[Check]:
    mistake = result.get("mistake")
    if mistake is None:
        return []
    head = "Links changed by more than a workshop makes"
    if mistake["kind"] != "unexplained":
        head = "Robot file and measurements do not go together"
    return [Check(BAD, head, "see the top of this page")]


def _converged(solver: Mapping[str, Any]) -> Check:
    if not solver.get("converged", True):
        return Check(BAD, "The fit did not converge", escaped(solver["stopped_because"]))
    text = f"{counted(solver['iterations'], 'iteration')}, {escaped(solver['name'])}"
    return Check(GOOD, "The fit converged", text)


def _gross_held_out(result: Mapping[str, Any], rows: Rows) -> NDArray[np.bool_]:
    """Held-out rows that are off as no noise is; none where there are too many to be outliers."""
    none = np.zeros_like(rows.test)
    if not result["errors"]["train"]["after"]["n"]:
        return none
    usual = float(np.median(rows.magnitude_after[~rows.test & ~rows.rejected]))
    if not usual:
        return none
    gross = rows.test & (rows.magnitude_after > GROSS * usual)
    return none if gross.sum() > 0.2 * rows.test.sum() else gross


def _unseen_poses(errors: Mapping[str, Any], rest: Floats, without_gross: bool) -> Check:
    if "test" not in errors:
        text = "the errors are those of the rows that were fitted, and flatter"
        return Check(LOOK, "Nothing was held out", text)
    train = errors["train"]["after"]["rms_m"]
    held_out = float(np.sqrt(np.nanmean(rest**2))) if without_gross else errors["test"]["after"]["rms_m"]
    grade = grade_of(held_out / train if train else 1.0, 1.35, 2)
    head = (
        "Unseen poses are as good as fitted ones",
        "Unseen poses are somewhat worse than fitted ones",
        "Unseen poses are much worse than fitted ones",
    )[grade]
    without = " (without bad measurements)" if without_gross else ""
    return Check(grade, head, f"rms {length_text(held_out)} held out{without}, {length_text(train)} fitted")


def _better_than_drawn(rows: Rows, gross: NDArray[np.bool_]) -> list[Check]:
    """Whether the robot as found predicts poses never seen better than the robot as drawn."""
    judged = rows.test & ~gross
    before, after = rows.magnitude_before[judged], rows.magnitude_after[judged]
    if not judged.any():
        return []
    sizes = [float(np.sqrt(np.nanmean(values**2))) for values in (before, after)]
    middles = [float(np.nanmedian(values)) for values in (before, after)]
    if sizes[1] <= sizes[0] or middles[1] <= middles[0]:
        return []
    text = f"rms {length_text(sizes[1])} held out, {length_text(sizes[0])} as drawn: keep the robot as drawn"
    return [Check(BAD, "Worse than the robot as drawn", text)]


def _enough_rows(result: Mapping[str, Any], rows: Rows) -> Check:
    rank, n = int(result["rank"]), result["errors"]["train"]["after"]["n"]
    per = n / rank if rank else math.inf
    numbers = rows.numbers_per_row * per
    grade = GOOD if numbers >= 10 else LOOK if numbers >= 4 else BAD
    head = ("Enough rows", "Few rows", "Too few rows")[grade] + " for the parameters"
    return Check(grade, head, f"{figures_text(per, 2)} rows per parameter ({n} rows, {rank} parameters)")


def _noise(result: Mapping[str, Any], rows: Rows) -> list[Check]:
    left, repeats = result.get("noise_sigma_m"), result.get("noise_from_repeats_m")
    if left is None:
        return []
    per = "reading" if rows.what == "distance" else "axis"
    if repeats is None:
        text = (
            f"{length_text(left)} per {per}: measurement noise, and structure that the model does not"
            " explain. Repeated poses would tell which"
        )
        return [Check(GOOD, "What the model leaves", text)]
    structure = math.sqrt(max(0.0, left**2 - repeats**2))
    if left < STRUCTURE * repeats:
        text = f"{length_text(left)} per {per}; repeats of a pose scatter by {length_text(repeats)}"
        return [Check(GOOD, "The model leaves noise alone", text)]
    text = (
        f"{length_text(repeats)} per {per} is noise, as repeats of a pose show it;"
        f" {length_text(structure)} is structure that the model does not explain: standard errors are too"
        " small. <code>truing diagnose</code> looks for its cause"
    )
    return [Check(LOOK, "The model leaves more than noise", text)]


def _rejected_share(rows: Rows) -> Check:
    rejected = int(rows.rejected.sum())
    share = rejected / max(1, int((~rows.test).sum()))
    return Check(
        GOOD if share <= 0.05 else LOOK,
        "No row rejected" if rejected == 0 else f"{counted(rejected, 'row')} rejected as gross outliers",
        f"{share:.1%} of the training rows" if rejected else "no gross outliers among the training rows",
    )


def _bad_measurements(gross: NDArray[np.bool_], rest: Floats) -> list[Check]:
    if not gross.any():
        return []
    look = "looks like a bad measurement" if gross.sum() == 1 else "look like bad measurements"
    text = (
        f"{GROSS} times the usual error or more, and counted above. Without: mean"
        f" {length_text(float(np.nanmean(rest)))}, worst {length_text(float(np.nanmax(rest)))}"
    )
    return [Check(LOOK, f"{counted(int(gross.sum()), 'held-out row')} {look}", text)]


def _unseen_combinations(frozen: Sequence[Mapping[str, Any]]) -> Check:
    if not frozen:
        return Check(GOOD, "Every parameter can be seen", "nothing had to be kept at nominal")
    names = ", ".join(escaped(f.get("parameter") or _main(f["combination"])) for f in frozen[:4])
    more = " …" if len(frozen) > 4 else ""
    return Check(
        GOOD,
        f"{counted(len(frozen), 'combination')} that these data cannot see",
        f'kept at nominal: {names}{more} (<a href="#frozen">in words</a>). Harmless for poses like these.',
    )


def _more_warnings(result: Mapping[str, Any]) -> list[Check]:
    """Warnings that no check says already."""
    other = [w for w in result.get("warnings", []) if not any(said in w for said in _SAID_BY_CHECKS)]
    checks = [Check(LOOK, "Warning", shortened(warning, 130, 120)) for warning in other[:3]]
    if len(other) > 3:
        text = f'<a href="#warnings">{counted(len(other) - 3, "more warning")}</a>'
        checks.append(Check(LOOK, "More warnings", text))
    return checks


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


def workspace(page: Page, rows: Rows, robot: RobotPicture | None = None) -> None:
    """Where the errors are: every measured place with an arrow to the predicted one, before and after, and
    the robot.
    """
    known = np.flatnonzero(
        np.isfinite(rows.position).all(axis=1) & np.isfinite(rows.magnitude_after) & ~rows.rejected
    )
    pick = subsample(known, CLOUD_POINTS)
    if pick.size == 0 and robot is None:
        page.add('<p class="note">No positions to draw.</p>')
        return
    scene = Scene3d()
    words = []
    position = rows.position[pick]
    extent = (float(np.ptp(position, axis=0).max()) if pick.size else 0.0) or 1.0
    for name, error, size, colour in (
        ("before", rows.error_before[pick], rows.magnitude_before[pick], BEFORE),
        ("after", rows.error_after[pick], rows.magnitude_after[pick], AFTER),
    ):
        if pick.size == 0:
            break
        limit = float(np.quantile(size, 0.98)) or 1e-9
        factor = round_down(ARROW * extent / limit)
        texts = [f"row {row}: {length_text(float(off))} {name}" for row, off in zip(pick, size, strict=True)]
        scene.add_lengths(position, size, limit, name, 3.5, texts=texts, group=name)
        if np.isfinite(error).all(axis=1).any():
            scene.add_arrows(position, factor * error, name, colour, 1.5, opacity=0.75, group=name)
            words.append(f"{name}: {factor:g} ×")
    if robot is not None:
        scene.set_robot(robot)
    scene.draw(page, eye=(1.25, 1.25, 0.6), size="cloud")
    arrows = (
        f" Arrows point from the measured to the predicted place, enlarged ({', '.join(words)})."
        if words
        else ""
    )
    drawn = drawn_of(pick.size, known.size, "row") if known.size else "No positions were measured."
    page.add(
        f'<p class="note">{drawn}{arrows} Rejected rows are left out. Colours stop at the 98 % quantile.</p>'
    )


def _joint_charts(page: Page, rows: Rows) -> None:
    usable = np.flatnonzero(
        np.isfinite(rows.magnitude_after) & np.isfinite(rows.magnitude_before) & ~rows.rejected
    )
    pick = subsample(usable, SMALL_POINTS)
    limits, axis = log_error_axis(
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
    page.add(
        f'</div><p class="note">{drawn_of(pick.size, usable.size, "row")} Medians are of all of them.</p>'
    )


def _running_median(x: Floats, y: Floats, bins: int = 14) -> tuple[Floats, Floats]:
    """Medians of `y` in `bins` runs of equal count along `x`."""
    order = np.argsort(x, kind="stable")
    runs = [run for run in np.array_split(order, max(1, min(bins, x.size // 4))) if run.size]
    return np.array([np.median(x[run]) for run in runs]), np.array([np.median(y[run]) for run in runs])


def _correlations(page: Page, names: Sequence[str], matrix: Floats) -> None:
    off = np.abs(matrix - np.diag(np.diag(matrix)))
    pairs = [
        (i, j)
        for i, j in zip(*np.unravel_index(np.argsort(-np.triu(off), axis=None)[:6], off.shape), strict=True)
        if off[i, j] > 0.9
    ]
    page.add('<section class="card"><h2>Correlations between parameters</h2>')
    if pairs:
        page.add(
            '<p class="lead">Strongly correlated (their sum or difference is known better than each alone): '
            + "; ".join(
                f"{escaped(names[i])} and {escaped(names[j])} ({matrix[i, j]:+.2f})" for i, j in pairs
            )
            + ".</p>"
        )
    else:
        page.add('<p class="lead">No two parameters are correlated by more than 0.9.</p>')
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
        square_layout(size),
        size="free",
    )
    page.add("</div></div></section>")


def parameter_table(parameters: Iterable[Mapping[str, Any]], promised: bool = False) -> str:
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


def frozen_card(frozen: Sequence[Mapping[str, Any]]) -> str:
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
        size = float(rows.magnitude_after[row])
        body.append(f"<tr><th>{row}</th>{table_cell(size, length_text(size))}{parts}</tr>")
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
        ' class="sortable"><thead><tr><th><button>row</button></th><th><button>error</button></th>'
        f"<th><button>x</button></th><th><button>y</button></th><th><button>z</button></th></tr></thead><tbody>{''.join(body)}</tbody></table></div>{more}</section>"
    )


def _signed_length(metres: float) -> str:
    return ("+" if metres >= 0 else "−") + length_text(abs(metres))


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
