# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML reports of ``truing ik`` and ``truing compensate``.

First screens: how many targets are reached, where the others are and why they are not; how far off the robot
would be, and is with compensation.
Below: joints against their limits, the path, corrections, every target that is not reached.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import (
    AFTER,
    BEFORE,
    INK,
    MUTED,
    REJECTED,
    distribution_chart,
    faded,
    packed,
    round_down,
    subsample,
)
from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.scene import RobotPicture, Scene3d, polyline
from truing.report.words import angle_text, counted, escaped, figures_text, length_text

Floats = NDArray[np.float64]

_DRAWN = 0.12  # of the targets' extent: how long the largest corrections are drawn
CLOUD_POINTS = 4000
PATH_POINTS = 2000
LISTED = 200
NEAR_LIMIT = 0.02  # fraction of a joint's range
# In the order of the core's reasons: what is said of a target, and its colour.
REASONS: Mapping[str, tuple[str, str]] = {
    "reached": ("reached", AFTER),
    "retreated": ("reached after a retreat", "#2e8b57"),
    "collision": ("something is in the way", "#7b3fa0"),
    "out_of_reach": ("out of reach", REJECTED),
    "limit": ("a joint's limit is in the way", BEFORE),
    "singular": ("singular", INK),
}


@dataclass(frozen=True)
class Drawing:
    """What the reports draw, beside what result.json holds. In the measurement frame, or in the robot's base
    frame where the targets are.
    """

    wanted: Floats  # shape=(n, 3) [m] wanted places of the targets
    reasons: tuple[str, ...]  # n of them
    texts: tuple[str, ...]  # n of them: in words
    robots: tuple[Floats, ...]  # shape=(joints + 2, 3) [m]: base, every joint's frame, target
    joints: Floats  # shape=(n, driven joints) [rad | m]; NaN where there are none to command
    obstacles: tuple[
        tuple[str, Floats], ...
    ] = ()  # name, and a line along its outline, shape=(k, 3) [m]; gaps are NaN
    correction: Floats | None = None  # shape=(n, 3) [m] of compensated commands
    before: Floats | None = None  # shape=(n,) [m]
    sigma: Floats | None = None  # shape=(n, 6) [m], [rad]
    robot: RobotPicture | None = None


def inverse_report(result: Mapping[str, Any], drawing: Drawing) -> str:
    """The report of ``truing ik``.

    Args:
        result: What ``result.json`` holds (format ``truing-inverse/1``).
        drawing: Where targets and robot are.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: inverse kinematics", part_of_page("inverse_kinematics"))
    page.add(_inverse_headline(result))
    page.add('<div class="first">')
    _map(page, drawing)
    page.add('<div class="column">')
    page.add(_why(result))
    _ranges(page, result)
    page.add("</div></div>")
    if "path" in result:
        _path(page, result, drawing)
    page.add(_failures(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def compensation_report(result: Mapping[str, Any], drawing: Drawing) -> str:
    """The report of ``truing compensate``.

    Args:
        result: What ``result.json`` holds (format ``truing-compensation/1``).
        drawing: Where targets and robot are, errors and corrections.
    """
    page = Page(f"{result.get('calibrated') or 'Robot'}: compensation", part_of_page("inverse_kinematics"))
    page.add(_compensation_headline(result))
    page.add('<div class="first">')
    _errors(page, result, drawing)
    page.add('<div class="column">')
    page.add(_why(result))
    page.add(_remaining(result))
    page.add("</div></div>")
    page.add('<div class="pair wide">')
    _map(page, drawing)
    page.add('<div class="column">')
    _corrections(page, drawing)
    _ranges(page, result)
    page.add("</div></div>")
    page.add(_failures(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- First screens -------------------------------------------------------------------------------


def _verdict(result: Mapping[str, Any]) -> str:
    path = result.get("path", {})
    label = (
        "not all reached"
        if result["reached"] < result["targets"]
        else "path has gaps"
        if path.get("gaps")
        else "path collides"
        if path.get("collisions")
        else "all reached"
    )
    whole = label == "all reached"
    return f'<span class="verdict {"found" if whole else "open"}">{label}</span>'


def _inverse_headline(result: Mapping[str, Any]) -> str:
    n, reached = result["targets"], result["reached"]
    kinds = ", ".join(f"{counted(count, 'target')} of kind {kind}" for kind, count in result["tasks"].items())
    kicker = f'<p class="kicker">truing ik · {escaped(result["robot"])} · {kinds}{_verdict(result)}</p>'
    first = (
        f'<span class="after">{reached}</span> of {counted(n, "target")} {"is" if reached == 1 else "are"}'
        " reached."
    )
    path = result.get("path")
    if path is not None:
        first += (
            " The path is continuous."
            if path["continuous"]
            else f" The path has {counted(len(path['gaps']), 'gap')}."
        )
        if path.get("collisions"):
            first += f" Between targets it has {counted(len(path['collisions']), 'collision')}."
    worst = result["worst"]
    sub = "Each answer was put into the forward model again, with its effects, and its limits were looked at"
    sub += "; so was what is in its way. " if "scene" in result else ". "
    if worst["position_m"] is not None:
        sub += (
            f"The worst misses its task by {_small(worst['position_m'], 'm')} and"
            f" {_small(worst['rotation_rad'], 'rad')}. "
        )
    if result["effects"]:
        sub += f"The robot is calibrated, with {escaped(', '.join(dict.fromkeys(result['effects'])))}. "
    if "branches" in result:
        sub += f"{counted(result['branches']['rows'], 'answer')} in all. "
    return f'<header>{kicker}<h1>{first}</h1><p class="sub">{sub}</p></header>'


def _compensation_headline(result: Mapping[str, Any]) -> str:
    n, reached = result["targets"], result["reached"]
    kicker = (
        f'<p class="kicker">truing compensate · {escaped(result["nominal"])} →'
        f" {escaped(result['calibrated'])} · {counted(n, 'target')} from"
        f" {result['from']}{_verdict(result)}</p>"
    )
    before, after = result["before"], result["after"]
    if after["mean_m"] is None:
        return (
            f'<header>{kicker}<h1>None of {counted(n, "target")} is reached.</h1><p class="sub">See below'
            " why.</p></header>"
        )
    remains = result.get("standard_error", {}).get("position_m", {}).get("rms_m")
    if before["mean_m"] is None:
        first = "The nominal robot cannot reach any of these targets; the calibrated one can."
    else:
        first = (
            "Commanded as they are, targets would be missed by <span"
            f' class="before">{length_text(before["mean_m"])}</span> on average.<br>Compensated, they are met'
            " as well as the "
        )
        first += "model is known" + (
            f': <span class="after">±{length_text(remains)}</span>.' if remains is not None else "."
        )
    sub = (
        f"{reached} of {counted(n, 'target')} {'is' if reached == 1 else 'are'} reached with the compensated"
        " commands. "
    )
    others = len(result["other_configuration"])
    if others:
        sub += (
            f"At {counted(others, 'target')} the joints are far from those that the nominal robot would take,"
            " so that a controller that is given poses may choose others: command joints there. "
        )
    if remains is None:
        sub += (
            "How well that is was not told (--uncertainty). What remains in truth is what the identification"
            " left as its error."
        )
    else:
        sub += (
            "± is one standard error of the position, all three axes together, by what the identification"
            " does not know of its parameters; what the model does not hold comes on top."
        )
    return f'<header>{kicker}<h1 class="long">{first}</h1><p class="sub">{sub}</p></header>'


def _why(result: Mapping[str, Any]) -> str:
    """How many targets came to what."""
    rows = []
    for reason, (label, colour) in REASONS.items():
        count = result["reasons"].get(reason, 0)
        if count:
            percent = f"{100 * count / result['targets']:.3g} %"
            rows.append(
                f'<tr><th><i class="dot" style="background:{colour}"></i>{label}</th><td>{count}</td>'
                f"<td>{percent}</td></tr>"
            )
    notes = [*_limits_in_the_way(result), *_parts_in_the_way(result)]
    if result["failures"]:
        notes.append('<a href="#failures">Every one of them</a>, with the nearest that can be reached.')
    whole = result["reached"] == result["targets"]
    text = f'<p class="note">{" ".join(notes)}</p>' if notes else ""
    heading = "Every target is reached" if whole else "What came of the targets"
    return (
        f'<section class="card trust {"t0" if whole else "t1"}"><h2>{heading}</h2>'
        f'<table class="narrow"><tbody>{"".join(rows)}</tbody></table>{text}</section>'
    )


def _most_frequent(names: Iterable[str]) -> list[tuple[str, int]]:
    return sorted(Counter(names).items(), key=lambda item: -item[1])


def _limits_in_the_way(result: Mapping[str, Any]) -> list[str]:
    limits = _most_frequent(f["joint"] for f in result["failures"] if f["reason"] == "limit")
    listed = ", ".join(f"{escaped(name)} ({count})" for name, count in limits)
    return [f"Limits in the way: {listed}."] if limits else []


def _parts_in_the_way(result: Mapping[str, Any]) -> list[str]:
    met = [f for f in result["failures"] if f["reason"] == "collision"]
    pairs = _most_frequent(" and ".join(f["pair"]) for f in met)
    if not pairs:
        return []
    listed = ", ".join(f"{escaped(pair)} ({count})" for pair, count in pairs[:6])
    notes = [f"In the way: {listed}."]
    if any(f["own_parts"] for f in met) and pairs[0][1] > 0.5 * result["targets"]:
        notes.insert(
            0,
            "Parts of the robot that touch each other nearly everywhere, and may, belong into"
            " <code>ignored</code> of the scene.",
        )
    return notes


# ---- The map -------------------------------------------------------------------------------------


def _map(page: Page, drawing: Drawing) -> None:
    """Targets by what came of them, and the robot."""
    page.add('<section class="card"><h2>Where</h2>')
    plot = Scene3d()
    for name, outline in drawing.obstacles:
        plot.add_line(outline, name, MUTED, 2, opacity=0.7)
    _add_robots(plot, drawing)
    _add_targets(plot, drawing)
    factor = _add_corrections(plot, drawing)
    plot.draw(page, eye=(1.35, -1.35, 0.8), size="cloud map")
    drawn = (
        f"The robot stands at the first of {counted(len(drawing.robots), 'target')} that are drawn."
        if drawing.robots
        else "No target is reached; the robot stands where it may."
    )
    if factor:
        drawn += (
            f" Arrows: from a target to the pose that is commanded in its place, enlarged {factor:g} times."
        )
    legend = " ".join(
        f'<i class="dot" style="background:{colour}"></i>{label}'
        for reason, (label, colour) in REASONS.items()
        if reason in drawing.reasons
    )
    page.add(
        f'<p class="legend">{legend}</p><p class="note">{drawn} Its lines go from joint frame to joint frame,'
        " as the link table has them.</p></section>"
    )


def _add_robots(plot: Scene3d, drawing: Drawing) -> None:
    for number, robot in enumerate(drawing.robots):
        if number or drawing.robot is None:
            opacity, width = (0.9, 6.0) if number == 0 else (0.2, 3.0)
            plot.add_line(robot, "robot", INK, width, opacity=opacity)
    if drawing.robot is not None:
        plot.set_robot(drawing.robot)


def _add_corrections(plot: Scene3d, drawing: Drawing) -> float:
    """Arrows to the compensated commands; how many times they are enlarged, 0 where there are none."""
    if drawing.correction is None or not np.isfinite(drawing.correction).all(axis=1).any():
        return 0.0
    rows = subsample(np.flatnonzero(np.isfinite(drawing.correction).all(axis=1)), CLOUD_POINTS)
    longest = float(np.quantile(np.linalg.norm(drawing.correction[rows], axis=1), 0.98))
    extent = float(np.ptp(drawing.wanted[rows], axis=0).max()) or 1.0
    if longest <= 0:
        return 0.0
    factor = max(round_down(_DRAWN * extent / longest), 1.0)
    plot.add_arrows(drawing.wanted[rows], factor * drawing.correction[rows], "correction", BEFORE, 2.0)
    return factor


def _add_targets(plot: Scene3d, drawing: Drawing) -> None:
    for reason, (label, colour) in REASONS.items():
        rows = np.flatnonzero(np.array([r == reason for r in drawing.reasons]))
        pick = subsample(rows, CLOUD_POINTS)
        if pick.size:
            reached = reason == "reached"
            size = 3.0 if reached else 4.5
            texts = [f"target {k}: {label if reached else drawing.texts[k]}" for k in pick]
            plot.add_points(
                drawing.wanted[pick],
                label,
                size,
                colour,
                opacity=0.85,
                texts=texts,
            )


# ---- The joints ----------------------------------------------------------------------------------


def _ranges(page: Page, result: Mapping[str, Any]) -> None:
    """What of each joint's range is used."""
    joints = [joint for joint in result["joints"] if joint["used"] is not None]
    if not joints:
        return
    page.add('<section class="card"><h2>Joint ranges used</h2>')
    traces: list[dict[str, Any]] = []
    near, texts = [], []
    for joint in joints:
        scale, unit = (180 / math.pi, "°") if joint["unit"] == "rad" else (1e3, " mm")
        low, high = joint["limits"]
        used = joint["used"]
        numbers = f"{used[0] * scale:.1f} to {used[1] * scale:.1f}{unit}".replace("-", "−")
        if low is None or high is None:
            texts.append((joint["joint"], 0.0, 100.0, f"{numbers}, no limits", True))
            continue
        width = (high - low) or 1.0
        start, end = (used[0] - low) / width, (used[1] - low) / width
        texts.append(
            (
                joint["joint"],
                100 * start,
                100 * end,
                f"{numbers} of {low * scale:.1f} to {high * scale:.1f}{unit}".replace("-", "−"),
                False,
            )
        )
        if start < NEAR_LIMIT or end > 1 - NEAR_LIMIT:
            near.append(joint["joint"])
    names = [text[0] for text in texts]
    traces.append(
        {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "x": [100] * len(names),
            "marker": {"color": "#eef0f3"},
            "hoverinfo": "skip",
        }
    )
    traces.append(
        {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "base": [text[1] for text in texts],
            "x": [max(0.6, text[2] - text[1]) for text in texts],
            "marker": {
                "color": [
                    faded(MUTED, 0.4) if text[4] else REJECTED if text[0] in near else AFTER for text in texts
                ]
            },
            "customdata": [text[3] for text in texts],
            "hovertemplate": "%{y}: %{customdata}<extra></extra>",
        }
    )
    page.chart(
        "ranges",
        traces,
        {
            "barmode": "overlay",
            "bargap": 0.35,
            "xaxis": {"title": {"text": "fraction of the joint's range [%]"}, "range": [0, 100]},
            "yaxis": {"autorange": "reversed", "type": "category", "dtick": 1, "ticks": ""},
            "margin": {"l": 60, "r": 12, "t": 4, "b": 42},
            "height": 70 + 26 * len(names),
        },
        size="free",
    )
    words = (
        f"Within {100 * NEAR_LIMIT:.0f} % of a limit: {escaped(', '.join(near))}."
        if near
        else "No joint comes near its limits."
    )
    page.add(f'<p class="note">Of the targets that are reached. {words}</p></section>')


def _path(page: Page, result: Mapping[str, Any], drawing: Drawing) -> None:
    """Joints along the path, gaps marked, and what bounds its steps."""
    gaps = result["path"]["gaps"]
    page.add(
        '<section class="card"><h2>The path, joint by joint</h2><p'
        f' class="lead">{_path_words(result)}</p><div class="multiples">'
    )
    count = len(drawing.joints)
    pick = subsample(np.arange(count), PATH_POINTS)
    bands = [_gap_band(gap) for gap in gaps[:LISTED]]
    for k, joint in enumerate(result["joints"]):
        scale, unit = (180 / math.pi, "°") if joint["unit"] == "rad" else (1e3, "mm")
        page.chart(
            f"path{k}",
            [
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(pick),
                    "y": packed(drawing.joints[pick, k] * scale),
                    "line": {"color": AFTER, "width": 2},
                    "name": joint["joint"],
                    "hovertemplate": f"target %{{x}}: %{{y:.2f}} {unit}<extra></extra>",
                }
            ],
            {
                "xaxis": {"title": {"text": "target"}, "range": [0, max(1, count - 1)]},
                "yaxis": {"title": {"text": f"{joint['joint']} [{unit}]"}},
                "shapes": [*bands, *_limit_lines(joint["limits"], drawing.joints[:, k], scale)],
            },
            size="small",
        )
    page.add("</div>")
    if gaps:
        page.add(_gap_table(gaps))
    page.add("</section>")


def _gap_band(gap: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": gap["from"],
        "x1": gap["to"],
        "y0": 0,
        "y1": 1,
        "fillcolor": faded(REJECTED, 0.25),
        "line": {"color": REJECTED, "width": 1},
    }


def _limit_lines(limits: Sequence[float | None], joints: Floats, scale: float) -> list[dict[str, Any]]:
    """Limits of a joint that are near to where it moves."""
    values = joints[np.isfinite(joints)] * scale
    if not values.size:
        return []
    margin = 0.3 * (np.ptp(values) + 1)
    return [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": limit * scale,
            "y1": limit * scale,
            "line": {"color": BEFORE, "width": 1.5, "dash": "dot"},
        }
        for limit in limits
        if limit is not None and values.min() - margin < limit * scale < values.max() + margin
    ]


def _gap_table(gaps: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for gap in gaps[:LISTED]:
        joint = escaped(gap["joint"]) if gap["joint"] else "one of them is not reached"
        rows.append(f"<tr><th>{gap['from']} → {gap['to']}</th><td>{joint}</td><td>{_step(gap)}</td></tr>")
    more = (
        f'<p class="note">The first {LISTED} of {len(gaps)}; result.json has all.</p>'
        if len(gaps) > LISTED
        else ""
    )
    return (
        '<h3>Where no continuous path is</h3><div class="scroll"><table class="narrow">'
        "<thead><tr><th>targets</th><th>joint</th><th>step</th></tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>{more}"
    )


def _path_words(result: Mapping[str, Any]) -> str:
    path = result["path"]
    bounds = path["bounds"]
    longest = [
        f"{angle_text(path['longest_turn_rad'])} of a turning joint (allowed"
        f" {angle_text(bounds['turn_rad'])})"
    ]
    if any(joint["unit"] == "m" for joint in result["joints"]):
        longest.append(
            f"{length_text(path['longest_slide_m'])} of a sliding joint (allowed"
            f" {length_text(bounds['slide_m'])})"
        )
    text = f"The longest step between neighbouring targets is {' and '.join(longest)}."
    return (
        text
        + (
            " Red bands are gaps: no choice of roll, rail and configuration passes there within the bounds."
            if path["gaps"]
            else ""
        )
        + " Dotted lines are limits."
    )


def _step(gap: Mapping[str, Any]) -> str:
    if gap.get("step_rad") is not None:
        return angle_text(gap["step_rad"])
    return length_text(gap["step_m"]) if gap.get("step_m") is not None else "–"


# ---- Compensation --------------------------------------------------------------------------------


def _errors(page: Page, result: Mapping[str, Any], drawing: Drawing) -> None:
    """Before, and what is known of after."""
    assert drawing.before is not None
    page.add('<section class="card"><h2>How far off, before and after</h2>')
    series = [(drawing.before, BEFORE, "before")]
    if drawing.sigma is not None:
        series.append((np.sqrt(np.sum(drawing.sigma[:, :3] ** 2, axis=1)), AFTER, "after, ±1σ"))
    shown = [(values[np.isfinite(values) & (values > 0)], colour, name) for values, colour, name in series]
    page.chart("distribution", *distribution_chart([part for part in shown if part[0].size]), size="tall")
    worst = result["after"]["max_m"]
    remains = " “After”: the standard error of what remains." if drawing.sigma is not None else ""
    after = (
        f" On the calibrated model itself every compensated target is met to {_small(worst, 'm')} or better:"
        " that is no error bar, but the model's own zero."
        if worst is not None
        else ""
    )
    page.add(
        '<p class="note">“Before”: where the calibrated model says the robot goes if the wanted pose is'
        f" commanded as it is.{remains}{after} The scale is logarithmic.</p></section>"
    )


def _remaining(result: Mapping[str, Any]) -> str:
    """Errors and standard errors as a table."""
    rows = []
    for key, label, tone in (
        ("before", "before", "before"),
        ("after", "after, by the model", "after"),
        ("correction", "commands moved by", ""),
    ):
        e = result[key]
        if e["mean_m"] is not None:
            rows.append(
                f"<tr><th>{label}</th>"
                + "".join(
                    f'<td><span class="{tone}">{_small(e[name], "m")}</span></td>'
                    for name in ("mean_m", "p95_m", "max_m")
                )
                + "</tr>"
            )
    error = result.get("standard_error")
    if error is not None:
        e = error["position_m"]
        rows.append(
            "<tr><th>standard error</th>"
            + "".join(f"<td>±{length_text(e[name])}</td>" for name in ("mean_m", "p95_m", "max_m"))
            + "</tr>"
        )
    axes = ""
    if error is not None:
        rms = error["rms"]
        axes = (
            '<p class="note">By axis of the measurement frame, rms: '
            + ", ".join(f"{axis} ±{length_text(rms[f'{axis}_m'])}" for axis in "xyz")
            + "; rotation "
            + ", ".join(f"±{angle_text(rms[f'r{axis}_rad'])}" for axis in "xyz")
            + ".</p>"
        )
    return (
        '<section class="card"><h2>In numbers</h2><div class="scroll"><table'
        ' class="number-table"><thead><tr><th></th><th>mean</th><th>95'
        f" %</th><th>worst</th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>{axes}</section>"
    )


def _corrections(page: Page, drawing: Drawing) -> None:
    """How far commands are moved, over the workspace."""
    assert drawing.correction is not None
    known = np.flatnonzero(np.isfinite(drawing.correction).all(axis=1))
    pick = subsample(known, CLOUD_POINTS)
    if not pick.size:
        return
    size = np.linalg.norm(drawing.correction[pick], axis=1)
    limit = float(np.quantile(size, 0.98)) or 1e-9
    extent = float(np.ptp(drawing.wanted[pick], axis=0).max()) or 1.0
    factor = round_down(0.08 * extent / limit)
    start, tips = drawing.wanted[pick], drawing.wanted[pick] + factor * drawing.correction[pick]
    lines = polyline([np.stack(pair) for pair in zip(start, tips, strict=True)])
    page.add('<section class="card"><h2>Corrections, from above</h2>')
    page.chart(
        "corrections",
        [
            {
                "type": "scatter",
                "mode": "lines",
                "x": packed(lines[:, 0]),
                "y": packed(lines[:, 1]),
                "line": {"color": faded(INK, 0.45), "width": 1},
                "hoverinfo": "skip",
            },
            {
                "type": "scatter",
                "mode": "markers",
                "x": packed(start[:, 0]),
                "y": packed(start[:, 1]),
                "marker": {
                    "size": 5,
                    "color": packed(1e3 * size),
                    "colorscale": "Viridis",
                    "reversescale": True,
                    "cmin": 0,
                    "cmax": 1e3 * limit,
                    "colorbar": {"title": {"text": "mm"}, "thickness": 12},
                },
                "text": [f"target {k}" for k in pick],
                "hovertemplate": "%{text}: %{marker.color:.3g} mm<extra></extra>",
            },
        ],
        {"xaxis": {"title": {"text": "x [m]"}}, "yaxis": {"title": {"text": "y [m]"}, "scaleanchor": "x"}},
        size="tall",
    )
    page.add(
        f'<p class="note">From the wanted to the commanded place, enlarged {factor:g} times.</p></section>'
    )


# ---- The failures --------------------------------------------------------------------------------


def _failures(result: Mapping[str, Any]) -> str:
    failures = result["failures"]
    if not failures:
        return ""
    names = [joint["joint"] for joint in result["joints"]]
    units = [joint["unit"] for joint in result["joints"]]
    body = []
    for f in failures[:LISTED]:
        label, colour = REASONS[f["reason"]]
        nearest = f.get("nearest")
        joints = (
            ""
            if nearest is None
            else " ".join(
                f"{value * 180 / math.pi:.1f}°" if unit == "rad" else f"{1e3 * value:.0f} mm"
                for value, unit in zip(nearest["joints"], units, strict=True)
            ).replace("-", "−")
        )
        off = (
            "–"
            if nearest is None
            else f"{_small(nearest['position_error_m'], 'm')}, {_small(nearest['rotation_error_rad'], 'rad')}"
        )
        body.append(
            f'<tr><th>{f["target"]}</th><td class="wrap"><i class="dot"'
            f' style="background:{colour}"></i>{label}</td><td'
            f' class="wrap">{escaped(f["text"])}</td><td>{off}</td><td class="wrap">{joints}</td></tr>'
        )
    more = (
        f'<p class="note">The first {LISTED} of {len(failures)}; result.json has all.</p>'
        if len(failures) > LISTED
        else ""
    )
    return (
        '<section class="card" id="failures"><h2>Targets that are not reached</h2><p class="lead">Targets'
        " count from 0, in the order of the file. “Nearest” is within limits, and misses the task by so"
        f' much; joints in the order {escaped(", ".join(names))}.</p><div class="scroll"><table class="left'
        ' sortable"><thead><tr><th><button>target</button></th><th><button>reason</button></th><th>in'
        " words</th><th>nearest misses by</th><th>nearest"
        f" joints</th></tr></thead><tbody>{''.join(body)}</tbody></table></div>{more}</section>"
    )


def _small(value: float | None, unit: str) -> str:
    """Of sizes down to rounding: 3.1 nm, 0.2 µrad."""
    if value is None:
        return "–"
    if value == 0:
        return f"0\u202f{unit}"
    if unit == "rad" and abs(value) > 2e-3:
        return angle_text(value)
    for factor, prefix in ((1e3, "m"), (1e6, "µ"), (1e9, "n")):
        if abs(value) * factor >= 0.1:
            return f"{figures_text(value * factor, 2)}\u202f{prefix}{unit}"
    return f"&lt;\u202f0.1\u202fn{unit}"
