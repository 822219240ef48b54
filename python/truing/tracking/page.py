# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML reports of ``truing track run`` and ``truing track calibrate``.

The first screen: how far predictions were from what the tracker said when their time had come, beside what
simpler ways would have said, and whether to
trust them. Below: the sway and its prediction, errors over time, status, clock, consistency, modes, what
became of the samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import AFTER, BEFORE, INK, MUTED, REJECTED, packed
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.trust import BAD, GOOD, LOOK, Check, grade_of
from truing.report.words import counted, escaped, figures_text, length_text
from truing.rotations import interpolated

Floats = NDArray[np.float64]

HELD, TRUTH = "#7a5195", "#2e8b57"
NAMES = {
    "truing": "truing",
    "hold": "hold: the last tracker sample",
    "velocity": "tracker, constant velocity",
    "fk": "forward kinematics",
    "fk_velocity": "forward kinematics, constant velocity",
}
COLOURS = {"truing": AFTER, "hold": MUTED, "velocity": BEFORE, "fk": HELD, "fk_velocity": "#c28fbf"}
STATUS_COLOURS = {"valid": TRUTH, "coasting": "#d9a300", "hold": BEFORE, "lost": REJECTED}
_DRAWN = 3000
# Where a check turns from good to worth a look, and to bad.
_CONSISTENT, _INCONSISTENT = (0.5, 1.6), (0.25, 3.0)
_MANY_OUTLIERS = 0.02


@dataclass(frozen=True)
class Replayed:
    """What the report draws, beside what result.json holds: the tables of a replay, by column."""

    compensation: Mapping[str, Any]
    graded: Mapping[str, Any]
    timeline: Mapping[str, Any]
    innovations: Mapping[str, Any]
    true_tool: tuple[Floats, Floats] | None = None  # times, shape=(n,) [s], and frames, shape=(n, 4, 4)


def run_report(result: Mapping[str, Any], run: Replayed) -> str:
    """The report of ``truing track run``.

    Args:
        result: What ``result.json`` holds (format ``truing-track-run/1``).
        run: The replay's tables.
    """
    page = Page(f"{result['robot'] or 'Robot'}: tracking", part_of_page("tracking"))
    page.add(_headline(result))
    page.add('<div class="first">')
    _errors(page, result)
    page.add(_trust(result))
    page.add("</div>")
    _what_happened(page, result, run)
    _over_time(page, result, run)
    _status(page, result, run)
    page.add('<div class="pair">')
    _clock(page, result, run)
    _consistency(page, run)
    page.add("</div>")
    page.add(_table(result))
    page.add(_truth(result))
    page.add(_modes(result))
    page.add(_shifts(result))
    page.add(_samples(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- First screen --------------------------------------------------------------------------------


def at_horizon(result: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The errors at the horizon that compensations are made for, or the nearest one; None: no predictions
    were graded.
    """
    rows = [row for row in result["errors"] if row["truing"]["n"]]
    return min(rows, key=lambda row: abs(row["horizon_s"] - result["horizon_s"])) if rows else None


def _headline(result: Mapping[str, Any]) -> str:
    told = at_horizon(result)
    kicker = f'<p class="kicker">truing track run · {escaped(result["robot"])}</p>'
    if told is None:
        return (
            f'<header>{kicker}<h1 class="long">No prediction could be compared with the tracker.</h1><p'
            ' class="sub">It gave nothing, or nothing in the time of the other streams.</p></header>'
        )
    simpler = {name: told[name]["rms_m"] for name in ("hold", "velocity", "fk", "fk_velocity")}
    best = min(simpler, key=lambda name: simpler[name])
    first = (
        f"{figures_text(1e3 * told['horizon_s'], 2)} ms ahead the receiver was predicted to <span"
        f' class="after">{length_text(told["truing"]["rms_m"])}</span> rms; the best simpler way would have'
        f' been <span class="before">{length_text(simpler[best])}</span> off.'
    )
    sub = (
        f"Measured against {counted(told['truing']['n'], 'later sample')} of the tracker itself, whose noise"
        f" is in these figures. Best of the simpler ways: {NAMES[best]}."
    )
    if result["truth"] and result["truth"]["n"]:
        sub += (
            f" Against the true tool, {length_text(result['truth']['rms_m'])} rms at"
            f" {figures_text(1e3 * result['horizon_s'], 2)} ms."
        )
    return f'<header>{kicker}<h1>{first}</h1><p class="sub">{sub}</p></header>'


def _errors(page: Page, result: Mapping[str, Any]) -> None:
    page.add('<section class="card"><h2>Error of predictions, by how far ahead</h2>')
    rows = [row for row in result["errors"] if row["truing"]["n"]]
    x = [f"{figures_text(1e3 * row['horizon_s'], 2)} ms" for row in rows]
    traces = [
        {
            "type": "bar",
            "x": x,
            "y": [None if row[name]["rms_m"] is None else 1e3 * row[name]["rms_m"] for row in rows],
            "name": NAMES[name],
            "marker": {"color": COLOURS[name]},
            "customdata": [
                [length_text(row[name]["p95_m"]), length_text(row[name]["max_m"])] for row in rows
            ],
            "hovertemplate": (
                f"{NAMES[name]}<br>%{{y:.3g}} mm rms, 95 %% below %{{customdata[0]}}, worst"
                " %{customdata[1]}<extra></extra>".replace("%%", "%")
            ),
        }
        for name in NAMES
    ]
    values = [1e3 * row[name]["rms_m"] for row in rows for name in NAMES if row[name]["rms_m"]]
    axis: dict[str, Any] = {"title": {"text": "rms [mm]"}}
    if values and max(values) > 12 * min(values):
        axis |= {"type": "log", "dtick": 1}
    page.chart(
        "horizons",
        traces,
        {
            "barmode": "group",
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.22, "x": 0},
            "yaxis": axis,
            "xaxis": {"type": "category"},
            "margin": {"l": 56, "r": 10, "t": 64, "b": 40},
        },
        size="tall",
    )
    page.add(
        '<p class="note">Of the receiver, against the tracker\'s sample for that instant, which nobody had'
        " seen when the prediction was made. The first seconds, in which clock and biases settle, are left"
        " out.</p></section>"
    )


def _trust(result: Mapping[str, Any]) -> str:
    return _trust_card(
        [
            *_against_simpler(result),
            *_surety(result),
            _there(result["status"]),
            _jumps(result["shifts"]),
            _clock_offset(result["clock"]),
            _outliers(result["consistency"]),
            *_limited(result["correction"]),
        ]
    )


def _trust_card(checks: Sequence[Check]) -> str:
    worst = max(check.grade for check in checks)
    items = "".join(
        f'<li class="g{check.grade}"><i>{"✓!✗"[check.grade]}</i>'
        f"<div><b>{escaped(check.head)}</b><span>{escaped(check.text)}</span></div></li>"
        for check in checks
    )
    verdict = ("Yes", "Yes, but look", "Not as it is")[worst]
    return (
        f'<section class="card trust t{worst}"><h2>Can I trust it? {verdict}.</h2><ul>{items}</ul></section>'
    )


def _against_simpler(result: Mapping[str, Any]) -> list[Check]:
    told = at_horizon(result)
    if told is None:
        return []
    simpler = min(told[name]["rms_m"] for name in ("hold", "velocity", "fk", "fk_velocity"))
    ratio = told["truing"]["rms_m"] / simpler if simpler else 1.0
    grade = grade_of(ratio, 0.9, 1.05)
    head = (
        "Better than the simpler ways",
        "No better than the simpler ways",
        "Worse than a simpler way",
    )[grade]
    return [Check(grade, head, f"{figures_text(ratio, 2)} of the best one's error")]


def _surety(result: Mapping[str, Any]) -> list[Check]:
    """Whether filter and predictions are as wrong as they say."""
    checks = []
    nis = result["consistency"]["nis_per_dimension"]
    if nis is not None:
        checks.append(
            _ratio_check(
                nis,
                "The filter is as sure as it should be",
                "The filter is too sure of itself",
                "The filter is too cautious",
                f"innovations squared are {figures_text(nis, 2)} of what it expects; noise in `filter` of"
                " setup.yaml",
            )
        )
    told = at_horizon(result)
    if told is not None and told["squares_per_dimension"] is not None:
        squares = told["squares_per_dimension"]
        checks.append(
            _ratio_check(
                squares,
                "Predictions are as sure as they should be",
                "Predictions are too sure of themselves",
                "Predictions are too cautious",
                f"errors squared are {figures_text(squares, 2)} of what they say",
            )
        )
    return checks


def _there(shares: Mapping[str, float]) -> Check:
    away = shares["hold"] + shares["lost"]
    return Check(
        grade_of(away, 0.01, 0.1),
        "Tracker and inertial sensor were there" if away < 0.01 else "Corrections stood still for a while",
        f"valid {100 * shares['valid']:.1f} %, coasting {100 * shares['coasting']:.1f} %, hold"
        f" {100 * shares['hold']:.1f} %, lost {100 * shares['lost']:.1f} % of the time",
    )


def _jumps(shifts: Sequence[Mapping[str, Any]]) -> Check:
    if not shifts:
        text = "no jump of the tracker against inertial sensor and encoders"
        return Check(GOOD, "Neither base station nor receiver has moved", text)
    times = "" if len(shifts) == 1 else f" {len(shifts)} times"
    return Check(BAD, f"The tracker jumped{times}", "calibrate anew; see below")


def _clock_offset(clock: Mapping[str, Any]) -> Check:
    sign = "" if clock["offset_s"] >= 0 else "−"
    text = (
        f"± {figures_text(1e3 * clock['sigma_s'], 2)} ms,"
        f" drift {figures_text(1e6 * abs(clock['drift']), 2)} ppm"
        if clock["estimated"]
        else "taken as known: setup.yaml gives it no sigma"
    )
    return Check(GOOD, f"Clock offset {sign}{figures_text(1e3 * abs(clock['offset_s']), 3)} ms", text)


def _outliers(consistency: Mapping[str, Any]) -> Check:
    share = consistency["outliers"] / max(1, consistency["outliers"] + consistency["innovations"])
    few = share < _MANY_OUTLIERS
    return Check(
        GOOD if few else LOOK,
        "Few outliers" if few else "Many outliers of the tracker",
        f"{100 * share:.2g} % of its samples",
    )


def _limited(correction: Mapping[str, Any]) -> list[Check]:
    share = correction["limited"]
    if share <= 0.01:
        return []
    text = f"{100 * share:.0f} % of them: limits on size, rate and jerk (`limits` of setup.yaml)"
    return [Check(LOOK, "Corrections were limited", text)]


def _ratio_check(value: float, good: str, sure: str, cautious: str, text: str) -> Check:
    if _CONSISTENT[0] <= value <= _CONSISTENT[1]:
        return Check(GOOD, good, text)
    far = not _INCONSISTENT[0] <= value <= _INCONSISTENT[1]
    return Check(BAD if far and value > 1 else LOOK, sure if value > 1 else cautious, text)


# ---- Below ---------------------------------------------------------------------------------------


def _thinned(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    return rows if rows.size <= _DRAWN else rows[np.linspace(0, rows.size - 1, _DRAWN).astype(np.intp)]


def _what_happened(page: Page, result: Mapping[str, Any], run: Replayed) -> None:
    """Deviation of the tool from its plan, predicted; and the true one where it is known. Axis by axis."""
    rows = run.compensation
    made = np.flatnonzero(rows["made"])
    if not made.size:
        return
    page.add(
        '<section class="card"><h2>The tool, away from its plan</h2><p class="lead">As predicted '
        f"{figures_text(1e3 * result['horizon_s'], 2)} ms before, in the base frame"
        f"{'' if run.true_tool is None else '; <span class=truth>green</span>: what then happened'}."
        " Minus this is what is sent to the arm.</p>"
    )
    every = _thinned(made)
    t = rows["t"][every]
    predicted = rows["T_base_tool"][every][:, :3, 3] - rows["T_base_tool_planned"][every][:, :3, 3]
    sent = -rows["correction"][every][:, :3]
    true = None
    if run.true_tool is not None:
        times, frames = run.true_tool
        inside = (t >= times[0]) & (t <= times[-1])
        true = np.full_like(predicted, np.nan)
        true[inside] = (
            interpolated(times, frames, t[inside])[:, :3, 3]
            - rows["T_base_tool_planned"][every][inside][:, :3, 3]
        )
    for k, axis in enumerate("xyz"):
        traces = [
            _line(t, 1e3 * predicted[:, k], AFTER, "predicted", 1.6),
            _line(t, 1e3 * sent[:, k], MUTED, "minus what is sent", 1.0, "dot"),
        ]
        if true is not None:
            traces.insert(0, _line(t, 1e3 * true[:, k], TRUTH, "what then happened", 3.0))
        page.chart(
            f"deviation_{axis}",
            traces,
            {
                "yaxis": {"title": {"text": f"{axis} [mm]"}},
                "xaxis": {"title": {"text": "time [s]" if axis == "z" else ""}, "range": _window(t)},
                "showlegend": axis == "x",
                "legend": {"orientation": "h", "y": 1.2, "x": 0},
                "margin": {"l": 60, "r": 10, "t": 34 if axis == "x" else 8, "b": 36},
            },
            size="strip",
        )
    page.add('<p class="note">The last twenty seconds; drag or double-click for others.</p></section>')


def _window(t: Floats) -> list[float]:
    return [max(float(t[0]), float(t[-1]) - 20.0), float(t[-1])]


def _line(x: Floats, y: Floats, colour: str, name: str, width: float, dash: str = "solid") -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": packed(x),
        "y": packed(y),
        "name": name,
        "line": {"color": colour, "width": width, "dash": dash},
        "hovertemplate": "%{y:.3g}<extra>" + name + "</extra>",
    }


def _over_time(page: Page, result: Mapping[str, Any], run: Replayed) -> None:
    """Errors against the tracker over the recording, running rms over a second."""
    told, graded = at_horizon(result), run.graded
    if told is None:
        return
    rows = np.flatnonzero((graded["horizon"] == told["horizon_s"]) & (graded["dimensions"] > 0))
    t = graded["t"][rows]
    series = {
        "truing": np.linalg.norm(graded["position"][rows], axis=1),
        **{name: graded[name][rows] for name in ("hold", "velocity", "fk", "fk_velocity")},
    }
    edges = np.arange(t[0], t[-1] + 1.0, max(0.5, (t[-1] - t[0]) / 600))
    which = np.clip(np.digitize(t, edges) - 1, 0, len(edges) - 1)
    page.add(
        f'<section class="card"><h2>Error over time, {figures_text(1e3 * told["horizon_s"], 2)} ms ahead</h2>'
    )
    traces = []
    for name, e in series.items():
        ok = np.isfinite(e)
        n = np.bincount(which[ok], minlength=len(edges))
        squares = np.bincount(which[ok], weights=e[ok] ** 2, minlength=len(edges))
        there = n > 0
        traces.append(
            _line(
                edges[there],
                1e3 * np.sqrt(squares[there] / n[there]),
                COLOURS[name],
                NAMES[name],
                2.2 if name == "truing" else 1.2,
            )
        )
    page.chart(
        "over_time",
        traces,
        {
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.2, "x": 0},
            "yaxis": {"type": "log", "title": {"text": "rms [mm]"}},
            "xaxis": {"title": {"text": "time [s]"}},
            "margin": {"l": 60, "r": 10, "t": 44, "b": 42},
        },
        size="wide",
    )
    page.add("</section>")


def _status(page: Page, result: Mapping[str, Any], run: Replayed) -> None:
    timeline = run.timeline
    t, status = timeline["t"], np.array(timeline["status"], dtype=str)
    if not t.size:
        return
    page.add('<section class="card"><h2>Status</h2>')
    starts = np.flatnonzero(np.concatenate([[True], status[1:] != status[:-1]]))
    ends = np.append(t[starts[1:]], t[-1])
    traces = []
    for name, colour in STATUS_COLOURS.items():
        mine = [k for k in range(len(starts)) if status[starts[k]] == name]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "y": ["status"] * len(mine),
                "base": [float(t[starts[k]]) for k in mine],
                "x": [float(ends[k] - t[starts[k]]) for k in mine],
                "name": name,
                "marker": {"color": colour},
                "hovertemplate": f"{name} from %{{base:.2f}} s<extra></extra>",
            }
        )
    gone = result["dropouts"]
    traces.append(
        {
            "type": "bar",
            "orientation": "h",
            "y": ["no tracker"] * len(gone),
            "base": [d["start_s"] for d in gone],
            "x": [d["seconds"] for d in gone],
            "name": "no tracker",
            "marker": {"color": INK},
            "hovertemplate": "from %{base:.2f} s for %{x:.2f} s<extra></extra>",
        }
    )
    marks = [
        {
            "type": "line",
            "x0": s["flagged_s"],
            "x1": s["flagged_s"],
            "y0": 0,
            "y1": 1,
            "yref": "paper",
            "line": {"color": REJECTED, "width": 2},
        }
        for s in result["shifts"]
    ]
    page.chart(
        "status",
        traces,
        {
            "barmode": "overlay",
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.45, "x": 0},
            "shapes": marks,
            "xaxis": {"title": {"text": "time [s]"}, "range": [float(t[0]), float(t[-1])]},
            "margin": {"l": 80, "r": 10, "t": 40, "b": 42},
        },
        size="flatbar",
    )
    note = (
        "valid: tracker and inertial sensor; coasting: inertial sensor and encoders; hold: encoders or plan,"
        " and the last static deviation; lost: nothing to go by."
    )
    if result["shifts"]:
        note += " Red lines: jumps of the tracker as they were noticed."
    page.add(f'<p class="note">{note}</p></section>')


def _clock(page: Page, result: Mapping[str, Any], run: Replayed) -> None:
    timeline, clock = run.timeline, result["clock"]
    page.add('<section class="card"><h2>Clock of the tracker</h2>')
    if clock["estimated"] and len(timeline["t"]):
        rows = _thinned(np.arange(len(timeline["t"])))
        t, offset, sigma = timeline["t"][rows], 1e3 * timeline["offset"][rows], 1e3 * timeline["sigma"][rows]
        settled = slice(len(t) // 20, None)
        low, high = float((offset - 4 * sigma)[settled].min()), float((offset + 4 * sigma)[settled].max())
        band = {
            "type": "scatter",
            "mode": "lines",
            "x": packed(np.concatenate([t, t[::-1]])),
            "y": packed(np.concatenate([offset + 3 * sigma, (offset - 3 * sigma)[::-1]])),
            "fill": "toself",
            "line": {"width": 0},
            "fillcolor": "rgba(31,95,168,0.18)",
            "name": "3 sigma",
            "hoverinfo": "skip",
        }
        page.chart(
            "clock",
            [band, _line(t, offset, AFTER, "offset", 2.0)],
            {
                "yaxis": {"title": {"text": "offset [ms]"}, "range": [low, high]},
                "xaxis": {"title": {"text": "time [s]"}},
            },
            size="small",
        )
        page.add(
            f'<p class="note">t_imu = t_tracker − {figures_text(1e3 * abs(clock["offset_s"]), 4)}'
            f" ms{'' if clock['offset_s'] >= 0 else ' (negative)'}, ±"
            f" {figures_text(1e3 * clock['sigma_s'], 2)} ms; shaded: three standard errors.</p></section>"
        )
    else:
        page.add(
            "<p>The offset is taken as known. With <code>clock_offset_sigma_s</code> above 0 in setup.yaml it"
            " is estimated.</p></section>"
        )


def _consistency(page: Page, run: Replayed) -> None:
    """Innovations squared, as a running mean, against what the filter expects."""
    i = run.innovations
    used = (i["accepted"] > 0) & (i["dimensions"] > 0)
    page.add('<section class="card"><h2>Is the filter as sure as it should be?</h2>')
    if used.sum() < 20:
        page.add("<p>Too few tracker samples to say.</p></section>")
        return
    t, ratio = i["t"][used], i["nis"][used] / i["dimensions"][used]
    count = max(10, min(200, len(t) // 40))
    mean = np.convolve(ratio, np.ones(count) / count, mode="valid")
    rows = _thinned(np.arange(len(mean)))
    spread = 3 * np.sqrt(2 / (count * float(i["dimensions"][used].mean())))
    lines = [
        {
            "type": "line",
            "x0": float(t[0]),
            "x1": float(t[-1]),
            "y0": y,
            "y1": y,
            "line": {"color": MUTED, "width": 1, "dash": "dot"},
        }
        for y in (1 - spread, 1 + spread)
    ]
    page.chart(
        "nis",
        [_line(t[count - 1 :][rows], mean[rows], AFTER, f"mean of {count}", 1.6)],
        {
            "yaxis": {"title": {"text": "NIS per dimension"}, "rangemode": "tozero"},
            "xaxis": {"title": {"text": "time [s]"}},
            "shapes": lines,
        },
        size="small",
    )
    page.add(
        f'<p class="note">Innovations squared, normalised: 1 is expected, {count} of them average to between'
        " the dotted lines if noise is what setup.yaml says.</p></section>"
    )


def _table(result: Mapping[str, Any]) -> str:
    body = []
    for row in result["errors"]:
        for name in NAMES:
            e = row[name]
            if e["n"]:
                body.append(
                    f"<tr><th>{figures_text(1e3 * row['horizon_s'], 2)}"
                    f" ms</th><td>{escaped(NAMES[name])}</td>"
                    + "".join(
                        table_cell(e[key], length_text(e[key]))
                        for key in ("rms_m", "median_m", "p95_m", "max_m")
                    )
                    + f"<td>{e['n']}</td></tr>"
                )
    head = "".join(
        f'<th><button type="button">{name}</button></th>'
        for name in ("ahead", "by", "rms", "median", "95 %", "worst", "samples")
    )
    return (
        '<section class="card"><h2>The figures</h2><div class="scroll"><table class="sortable'
        f' left"><thead><tr>{head}</tr></thead><tbody>{"".join(body)}</tbody></table></div></section>'
        if body
        else ""
    )


def _truth(result: Mapping[str, Any]) -> str:
    e = result["truth"]
    if not e or not e["n"]:
        return ""
    before = e["without_compensation"]
    return (
        '<section class="card"><h2>Against the true tool</h2><div class="big"><div class="number"><p>away'
        f' from the plan, rms</p><strong class="before">{length_text(before["rms_m"])}</strong></div><div'
        ' class="number"><p>of which not predicted</p><strong'
        f' class="after">{length_text(e["rms_m"])}</strong></div><div class="number"><p>NEES (6 expected,'
        f" below: cautious)</p><strong>{figures_text(e['nees'], 3)}</strong></div></div><p"
        f' class="note">{counted(e["n"], "row")} of compensation.csv; {100 * e["inside_3_sigma"]:.2f} % of'
        " the components within three standard"
        f" deviations{', before the tracker jumped' if result['shifts'] else ''}. Rotation"
        f" {figures_text(1e3 * e['rotation_rms_rad'], 2)} mrad rms.</p></section>"
    )


def _modes(result: Mapping[str, Any]) -> str:
    modes = result["modes"]
    if not modes["modes"]:
        why = f" {escaped(modes['stopped_because'])}." if modes["stopped_because"] else ""
        return (
            '<section class="card"><h2>Modes</h2><p>None: predictions go by constant acceleration of the'
            f" deviation from the plan.{why}</p></section>"
        )
    body = "".join(
        f"<tr><th>{figures_text(m['frequency_hz'], 3)} Hz</th><td>{figures_text(100 * m['damping'], 2)}"
        f" %</td><td>{figures_text(m['tracked_hz'] or 0.0, 3)} Hz</td></tr>"
        for m in modes["modes"]
    )
    since = f", used from {figures_text(modes['used_from_s'], 3)} s on" if modes["used_from_s"] else ""
    return (
        '<section class="card"><h2>Modes</h2><p class="lead">From'
        f" {escaped(modes['source'])}{since}.</p><table"
        ' class="narrow"><thead><tr><th>frequency</th><th>damping</th><th>tracked'
        f" to</th></tr></thead><tbody>{body}</tbody></table></section>"
    )


def _shifts(result: Mapping[str, Any]) -> str:
    if not result["shifts"]:
        return ""
    causes = {
        "station": "a base station was moved",
        "receiver": "the receiver has slipped",
        "station_or_receiver": "base station or receiver: not told apart, the arm has to move and turn",
    }
    items = "".join(
        f"<li><b>At {figures_text(s['t_s'], 4)} s the tracker jumped by {length_text(s['jump_m'])} and"
        f" {figures_text(1e3 * s['jump_rad'], 2)} mrad</b>, noticed after"
        f" {figures_text(max(0.0, s['flagged_s'] - s['t_s']), 2)} s: {causes[s['cause']]}. The noise of a"
        f" sample is {length_text(s['position_noise_m'])} and"
        f" {figures_text(1e3 * s['rotation_noise_rad'], 2)} mrad.</li>"
        for s in result["shifts"]
    )
    return (
        f'<section class="card look"><h2>The tracker jumped</h2><ul class="plain">{items}</ul><p'
        ' class="note">The filter follows the tracker after a jump. Calibrate anew.</p></section>'
    )


def _samples(result: Mapping[str, Any]) -> str:
    rows = []
    for stream, counts in result["samples"].items():
        met = [f"{name.replace('_', ' ')} {count}" for name, count in counts.items() if count]
        words = escaped(", ".join(met) or "none")
        rows.append(f"<tr><th>{escaped(stream)}</th><td class='wrap'>{words}</td></tr>")
    body = "".join(rows)
    return (
        '<section class="card"><h2>What became of the samples</h2><table class="left'
        f' narrow"><tbody>{body}</tbody></table></section>'
    )


# ---- Calibration ---------------------------------------------------------------------------------


def calibration_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing track calibrate``, from what ``result.json`` holds (format
    ``truing-track-calibration/1``).
    """
    page = Page(f"{result['robot'] or 'Robot'}: tracking calibration", part_of_page("tracking"))
    page.add(_calibration_headline(result))
    if result["positions"]["errors"]:
        page.add('<div class="first">')
        _positions(page, result)
        page.add(_calibration_trust(result))
        page.add("</div>")
    page.add(_frames_table(result))
    page.add(_clocks_card(result))
    page.add(_tool_card(result))
    page.add(_found_modes(result))
    if result["notes"]:
        page.add(
            '<section class="card"><h2>What to know</h2><ul class="plain">'
            + "".join(f"<li>{escaped(note)}</li>" for note in result["notes"])
            + "</ul></section>"
        )
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _calibration_headline(result: Mapping[str, Any]) -> str:
    kicker = f'<p class="kicker">truing track calibrate · {escaped(result["robot"])}</p>'
    if result["status"] != "done":
        return (
            f'<header>{kicker}<h1 class="long">{escaped(result["message"])}</h1><p class="sub">No set-up is'
            " written: what these data say about it is not to be relied on"
            f" ({escaped(result['status'])}).</p></header>"
        )
    positions, clock = result["positions"], result["clock"]
    offset = (
        f' The inertial clock is <span class="after">{_milliseconds(clock["offset_s"])}</span> from the'
        f" tracker's, ±{figures_text(1e3 * clock['sigma_s'], 2)} ms."
        if "offset_s" in clock
        else ""
    )
    what = "test position" if positions["source"] == "standstills" else "pose of the motion"
    return (
        f'<header>{kicker}<h1 class="long">Tracker and robot agree to <span'
        f' class="after">{length_text(positions["position_sigma_m"])}</span> and <span'
        f' class="after">{figures_text(1e3 * positions["rotation_sigma_rad"], 2)} mrad</span> a'
        f' component.{offset}</h1><p class="sub">{counted(len(positions["errors"]), what)}. setup.yaml holds'
        " the frames, their covariance and the clocks.</p></header>"
    )


def _milliseconds(seconds: float) -> str:
    return f"{'−' if seconds < 0 else ''}{figures_text(1e3 * abs(seconds), 4)} ms"


def _positions(page: Page, result: Mapping[str, Any]) -> None:
    errors = result["positions"]["errors"]
    t = [e["t_s"] for e in errors]
    page.add(
        '<section class="card"><h2>Error of each position</h2><p class="lead">How far the receiver was from'
        " where the frames found put it. Positions that are far off count little; size: what they"
        " counted.</p>"
    )
    size = [5 + 7 * min(1.5, e["weight"]) for e in errors]
    for name, key, unit in (("positions", "position_m", "mm"), ("rotations", "rotation_rad", "mrad")):
        page.chart(
            name,
            [
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": t,
                    "y": [1e3 * e[key] for e in errors],
                    "marker": {"color": AFTER, "size": size, "opacity": 0.8},
                    "customdata": [figures_text(e["weight"], 2) for e in errors],
                    "hovertemplate": (
                        f"%{{x:.1f}} s: %{{y:.3g}} {unit}, weight %{{customdata}}<extra></extra>"
                    ),
                }
            ],
            {
                "yaxis": {"title": {"text": unit}, "rangemode": "tozero"},
                "xaxis": {"title": {"text": "time [s]" if name == "rotations" else ""}},
                "margin": {"l": 56, "r": 10, "t": 8, "b": 40},
            },
            size="strip",
        )
    page.add("</section>")


def _calibration_trust(result: Mapping[str, Any]) -> str:
    return _trust_card(
        [
            *_test_positions(result["positions"]),
            *_rich_motion(result["clock"]),
            *_inertial(result["inertial"]),
        ]
    )


def _test_positions(positions: Mapping[str, Any]) -> list[Check]:
    n = len(positions["errors"])
    if positions["source"] != "standstills":
        text = "stand still for three seconds or more at ten places, turned about different axes"
        source = Check(LOOK, "No test positions: frames come from the motion", text)
    else:
        text = f"{n}; more of them, turned about different axes, make frames surer"
        enough = n >= 10
        head = "Enough test positions" if enough else "Few test positions"
        source = Check(GOOD if enough else LOOK, head, text)
    low = sum(e["weight"] < 0.3 for e in positions["errors"])
    fits = (
        Check(LOOK, f"{counted(low, 'position')} off", "they count little; what moved there?")
        if low
        else Check(GOOD, "Every position fits the others", "")
    )
    return [source, fits]


def _rich_motion(clock: Mapping[str, Any] | None) -> list[Check]:
    if not clock or "rich_enough" not in clock:
        return []
    rich = clock["rich_enough"]
    return [
        Check(
            GOOD if rich else LOOK,
            f"The motion was {'' if rich else 'not '}rich enough for the clock",
            f"± {figures_text(1e3 * clock['sigma_s'], 2)} ms. {clock['advice']}",
        )
    ]


def _inertial(inertial: Mapping[str, Any] | None) -> list[Check]:
    if inertial is None:
        return []
    up = inertial["tracker_up"]
    upright = up == "+z"
    return [
        Check(
            GOOD,
            f"Inertial data follow the tracker to {length_text(inertial['position_rms_m'])}",
            f"and {figures_text(1e3 * inertial['rotation_rms_rad'], 2)} mrad a component, integrated over two"
            " seconds",
        ),
        Check(
            GOOD if upright else LOOK,
            f"The tracker's {up} points up",
            "" if upright else "its frame is not z-up; the set-up takes that into account",
        ),
    ]


def _frames_table(result: Mapping[str, Any]) -> str:
    if not result["frames"]:
        return ""
    body = []
    for name, f in result["frames"].items():
        sigma = f["sigma"]
        error = {
            axis: "" if sigma is None else f" ± {figures_text(1e3 * sigma[f'{axis}_m'], 2)}" for axis in "xyz"
        }
        place = "".join(f"<td>{1e3 * f[f'{axis}_m']:.2f}{error[axis]}</td>" for axis in "xyz")
        turn = "".join(
            f"<td>{'–' if sigma is None else figures_text(1e3 * sigma[f'r{axis}_rad'], 2)}</td>"
            for axis in "xyz"
        )
        quaternion = " ".join(f"{f[part]:.5f}" for part in ("qw", "qx", "qy", "qz"))
        body.append(f"<tr><th>{name}</th>{place}<td>{quaternion}</td>{turn}</tr>")
    head = "".join(
        f"<th>{name}</th>"
        for name in (
            "frame",
            "x [mm]",
            "y [mm]",
            "z [mm]",
            "quaternion w x y z",
            "σ about x [mrad]",
            "y",
            "z",
        )
    )
    return (
        '<section class="card"><h2>Frames</h2><div'
        f' class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        "</div></section>"
    )


def _clocks_card(result: Mapping[str, Any]) -> str:
    clock = result["clock"]
    if not clock:
        return ""
    lines = []
    if "offset_s" in clock:
        lines.append(
            f"t_imu = t_tracker − ({_milliseconds(clock['offset_s'])}), ±"
            f" {figures_text(1e3 * clock['sigma_s'], 2)} ms. {escaped(clock['advice'])}"
        )
    lines.append(
        "Joints and plan are taken to have the inertial sensor's clock."
        if clock["same_clock"]
        else f"t_imu = t_controller − ({_milliseconds(clock['controller_clock_offset_s'])})"
    )
    if result["actuator_lag_s"] is not None:
        lines.append(
            f"The joints are where the plan was {figures_text(1e3 * result['actuator_lag_s'], 3)} ms ago."
        )
    return (
        '<section class="card"><h2>Clocks</h2><ul class="plain">'
        + "".join(f"<li>{line}</li>" for line in lines)
        + "</ul></section>"
    )


def _tool_card(result: Mapping[str, Any]) -> str:
    tool = result["tool"]
    if tool is None:
        return ""
    pivots = ", ".join(length_text(e) for e in tool["pivot_error_m"])
    return f'<section class="card"><h2>Tool</h2><p>{escaped(tool["message"])} Each: {pivots}.</p></section>'


def _found_modes(result: Mapping[str, Any]) -> str:
    modes = result["modes"]
    if modes is None:
        return ""
    body = "".join(
        f"<tr><th>{figures_text(m['frequency_hz'], 3)} ± {figures_text(m['frequency_sigma_hz'], 2)}"
        f" Hz</th><td>{figures_text(100 * m['damping'], 2)} %</td></tr>"
        for m in modes["modes"]
    )
    return (
        '<section class="card"><h2>Modes of the sway</h2><p'
        f' class="lead">{escaped(modes["stopped_because"])}</p><table'
        ' class="narrow"><thead><tr><th>frequency</th><th>damping</th></tr></thead>'
        f"<tbody>{body}</tbody></table></section>"
    )
