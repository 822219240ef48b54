# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML reports of ``truing ik`` and ``truing compensate``.

First screens: how many targets are reached, where the others are and why they are not; how far off the robot
would be, and is with compensation.
Below: joints against their limits, the path, corrections, every target that is not reached.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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
from truing.report.words import angle_text, counted, escaped, figures_text, length_text

Floats = NDArray[np.float64]

CLOUD_POINTS = 4000
PATH_POINTS = 2000
LISTED = 200
NEAR_LIMIT = 0.02  # share of a joint's range
# In the order of the core's reasons: what is said of a target, and its colour.
REASONS: Mapping[str, tuple[str, str]] = {
    "reached": ("reached", AFTER),
    "retreated": ("reached after a retreat", "#2e8b57"),
    "interference": ("something is in the way", "#7b3fa0"),
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
    whole = result["reached"] == result["targets"] and not result.get("path", {}).get("gaps")
    label = (
        "all reached"
        if whole
        else "not all reached"
        if result["reached"] < result["targets"]
        else "path has gaps"
    )
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
            rows.append(
                '<tr><th><i class="dot"'
                f' style="background:{colour}"></i>{label}</th><td>{count}</td><td>{100 * count / result["targets"]:.3g}'
                " %</td></tr>"
            )
    notes = []
    by_joint: dict[str, int] = {}
    for failure in result["failures"]:
        if failure["reason"] == "limit":
            by_joint[failure["joint"]] = by_joint.get(failure["joint"], 0) + 1
    if by_joint:
        notes.append(
            "Limits in the way: "
            + ", ".join(
                f"{escaped(name)} ({count})"
                for name, count in sorted(by_joint.items(), key=lambda item: -item[1])
            )
            + "."
        )
    pairs: dict[str, int] = {}
    for failure in result["failures"]:
        if failure["reason"] == "interference":
            pair = " and ".join(failure["pair"])
            pairs[pair] = pairs.get(pair, 0) + 1
    if pairs:
        if (
            any(f["reason"] == "interference" and f["own_parts"] for f in result["failures"])
            and max(pairs.values()) > 0.5 * result["targets"]
        ):
            notes.append(
                "Parts of the robot that touch each other nearly everywhere, and may, belong into"
                " <code>ignored</code> of the scene."
            )
        notes.append(
            "In the way: "
            + ", ".join(
                f"{escaped(pair)} ({count})"
                for pair, count in sorted(pairs.items(), key=lambda item: -item[1])[:6]
            )
            + "."
        )
    if result["failures"]:
        notes.append('<a href="#failures">Every one of them</a>, with the nearest that can be reached.')
    whole = result["reached"] == result["targets"]
    text = f'<p class="note">{" ".join(notes)}</p>' if notes else ""
    return (
        '<section class="card trust'
        f' {"t0" if whole else "t1"}"><h2>{"Every target is reached" if whole else "What came of the targets"}</h2><table'
        f' class="narrow"><tbody>{"".join(rows)}</tbody></table>{text}</section>'
    )


# ---- The map -------------------------------------------------------------------------------------


def _lines(pieces: Sequence[Floats]) -> Floats:
    """Polylines as one, gaps between them."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([part for piece in pieces for part in (piece, gap)]) if pieces else np.empty((0, 3))


def _map(page: Page, drawing: Drawing) -> None:
    """Targets by what came of them, and the robot."""
    page.add('<section class="card"><h2>Where</h2>')
    traces: list[dict[str, Any]] = []
    flat: dict[str, list[dict[str, Any]]] = {"top": [], "side": []}

    def points(xyz: Floats, name: str, colour: str, size: float, texts: Sequence[str] | None) -> None:
        hover = (
            {"text": [escaped(text) for text in texts], "hovertemplate": "%{text}<extra></extra>"}
            if texts is not None
            else {"hoverinfo": "name"}
        )
        marker = {"size": size, "color": colour, "opacity": 0.85}
        traces.append(
            {
                "type": "scatter3d",
                "mode": "markers",
                **{axis: packed(xyz[:, k]) for k, axis in enumerate("xyz")},
                "name": name,
                "marker": marker,
                **hover,
            }
        )
        for view, second in (("top", 1), ("side", 2)):
            flat[view].append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": packed(xyz[:, 0]),
                    "y": packed(xyz[:, second]),
                    "name": name,
                    "marker": {**marker, "size": 1.6 * size},
                    **hover,
                }
            )

    def line(xyz: Floats, name: str, colour: str, width: float) -> None:
        traces.append(
            {
                "type": "scatter3d",
                "mode": "lines",
                **{axis: packed(xyz[:, k]) for k, axis in enumerate("xyz")},
                "name": name,
                "line": {"color": colour, "width": width},
                "hoverinfo": "name",
            }
        )
        for view, second in (("top", 1), ("side", 2)):
            flat[view].append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(xyz[:, 0]),
                    "y": packed(xyz[:, second]),
                    "name": name,
                    "line": {"color": colour, "width": max(1.5, width / 2.5)},
                    "hoverinfo": "name",
                }
            )

    for name, outline in drawing.obstacles:
        line(outline, name, faded(MUTED, 0.7), 3)
    for number, robot in enumerate(drawing.robots):
        line(robot, "robot", faded(INK, 0.9 if number == 0 else 0.3), 7 if number == 0 else 4)
    if drawing.robots:
        points(drawing.robots[0], "its joints", INK, 4.0, None)
    for reason, (label, colour) in REASONS.items():
        rows = np.flatnonzero(np.array([r == reason for r in drawing.reasons]))
        pick = subsample(rows, CLOUD_POINTS)
        if pick.size:
            texts = [
                f"target {k}: {label}" if reason == "reached" else f"target {k}: {drawing.texts[k]}"
                for k in pick
            ]
            points(drawing.wanted[pick], label, colour, 3.0 if reason == "reached" else 4.5, texts)
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} [m]"}, "backgroundcolor": "#fff", "gridcolor": "#e6e9ed"}
        for axis in "xyz"
    }
    page.chart(
        "workspace",
        traces,
        {
            "scene": {
                **axes,
                "aspectmode": "data",
                "camera": {"eye": {"x": 1.35, "y": -1.35, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.1}},
            },
            "fallback": flat,
        },
        size="cloud map",
    )
    drawn = (
        f"The robot is drawn at {counted(len(drawing.robots), 'target')}."
        if drawing.robots
        else "No target is reached, so that no robot is drawn."
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
            "xaxis": {"title": {"text": "share of the joint's range [%]"}, "range": [0, 100]},
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
    path = result["path"]
    page.add(
        '<section class="card"><h2>The path, joint by joint</h2><p'
        f' class="lead">{_path_words(result)}</p><div class="multiples">'
    )
    count = len(drawing.joints)
    pick = subsample(np.arange(count), PATH_POINTS)
    bands = [
        {
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
        for gap in path["gaps"][:LISTED]
    ]
    for k, joint in enumerate(result["joints"]):
        scale, unit = (180 / math.pi, "°") if joint["unit"] == "rad" else (1e3, "mm")
        traces: list[dict[str, Any]] = [
            {
                "type": "scatter",
                "mode": "lines",
                "x": packed(pick),
                "y": packed(drawing.joints[pick, k] * scale),
                "line": {"color": AFTER, "width": 2},
                "name": joint["joint"],
                "hovertemplate": f"target %{{x}}: %{{y:.2f}} {unit}<extra></extra>",
            }
        ]
        shapes = list(bands)
        values = drawing.joints[:, k][np.isfinite(drawing.joints[:, k])] * scale
        for limit in joint["limits"]:
            if (
                limit is not None
                and values.size
                and values.min() - 0.3 * (np.ptp(values) + 1)
                < limit * scale
                < values.max() + 0.3 * (np.ptp(values) + 1)
            ):
                shapes.append(
                    {
                        "type": "line",
                        "xref": "paper",
                        "x0": 0,
                        "x1": 1,
                        "y0": limit * scale,
                        "y1": limit * scale,
                        "line": {"color": BEFORE, "width": 1.5, "dash": "dot"},
                    }
                )
        page.chart(
            f"path{k}",
            traces,
            {
                "xaxis": {"title": {"text": "target"}, "range": [0, max(1, count - 1)]},
                "yaxis": {"title": {"text": f"{joint['joint']} [{unit}]"}},
                "shapes": shapes,
            },
            size="small",
        )
    page.add("</div>")
    if path["gaps"]:
        body = "".join(
            f"<tr><th>{gap['from']} →"
            f" {gap['to']}</th><td>{escaped(gap['joint']) if gap['joint'] else 'one of them is not reached'}</td><td>{_step(gap)}</td></tr>"
            for gap in path["gaps"][:LISTED]
        )
        more = (
            f'<p class="note">The first {LISTED} of {len(path["gaps"])}; result.json has all.</p>'
            if len(path["gaps"]) > LISTED
            else ""
        )
        page.add(
            '<h3>Where no continuous path is</h3><div class="scroll"><table'
            f' class="narrow"><thead><tr><th>targets</th><th>joint</th><th>step</th></tr></thead><tbody>{body}</tbody></table></div>{more}'
        )
    page.add("</section>")


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
    lines = _lines([np.stack(pair) for pair in zip(start, tips, strict=True)])
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
