# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of a diagnosis from commands alone.

The first screen: what stands between the simulator and the robot, in a sentence; commanded, real and
simulated motion over each other on a held-out stretch; the error of every joint at every horizon. Below:
every cause with its size, what the recordings cannot tell apart and what to record next, where it is left,
the usual parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.page import (
    TONES,
    corrected_lines,
    mistaken_ones,
    mistakes_card,
    notes_card,
    others,
    place,
    plain,
)
from truing.dynamics.rollout.page import error_text, joint_menu, motion_chart
from truing.report.charts import AFTER, BEFORE, INK, faded, labelled_bars, packed
from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.words import counted, escaped, figures_text, sure_text

Floats = NDArray[np.float64]
NOMINAL, UNKNOWN = "#98a2ad", "#8a5bb5"
MODELS = {"nominal": ("nominal", NOMINAL), "standard": ("standard", BEFORE), "named": ("named", AFTER)}
KEYS = {
    "nominal": "the file as it is",
    "standard": "usual parameters",
    "named": "named effects",
}
LONG = 75  # characters of a headline in large type
EXPLAINED = 0.5  # of the error that the usual parameters leave: with more left, causes explain it partly
POINTS = 1500  # of a line over time
BAR = 120  # [px] of a cause that removes all of it
BAND = 2  # standard errors
HEADROOM = 1.6  # of the axis of errors over those of the usual parameters; the file may be far off
TURN = math.degrees(1.0)
REGIMES = {"reversals": "turning round", "slow": "slow", "fast": "fast", "holding": "at rest"}
USUAL = (
    "Usual parameters: gain, damping, dry friction, rotor inertia and zero of every joint, fitted to the same"
    " recordings."
)


def servo_report(result: Mapping[str, Any], traces: Sequence[Mapping[str, Any]]) -> str:
    """The report of ``truing dynamics diagnose`` on recordings without torques.

    result: what ``result.json`` holds. traces: of joints and held-out recordings (`ServoTrace` as a mapping):
    recording, joint, unit, and over rows time [s], command, measured [rad | m], simulated by model (NaN where
    a simulation begins).
    """
    page = Page(f"{result.get('robot') or 'Arm'}: servos", part_of_page("dynamics"))
    _headline(page, result)
    page.add(mistakes_card(result))
    order = worst_first(result)
    page.add('<div class="first">')
    _motion(page, result, traces, order)
    _errors(page, result)
    page.add("</div>")
    page.add(_causes(result))
    page.add(_next(result))
    _off(page, traces, order)
    page.add(_where(result))
    _unknown(page, result)
    page.add(_usual(result))
    page.add(_not_testable(result))
    page.add(notes_card(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- Words and numbers -------------------------------------------------------------------------------
def beyond(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """What was named beyond the usual parameters."""
    return [effect for effect in result["effects"] if not effect["standard"]]


def departing(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Usual parameters that the file has otherwise, and that matter."""
    return [effect for effect in result["effects"] if effect.get("departs")]


def main_number(result: Mapping[str, Any]) -> int:
    """Of the main horizon among all."""
    motion = result["rollout"]
    horizons = list(motion["horizon_s"])
    main = motion["main_horizon_s"]
    return horizons.index(main) if main in horizons else len(horizons) - 1


def mean_error(result: Mapping[str, Any], model: str) -> float:
    """Mean over the joints that turn (of slides where none does) at the main horizon [rad | m]."""
    errors, units = result["rollout"]["held_out"].get(model, {}), result["rollout"]["units"]
    number = main_number(result)
    turning = [j for j in errors if units[j] == "rad"] or list(errors)
    values = [errors[j][number] for j in turning if errors[j][number] is not None]
    return sum(values) / len(values) if values else math.nan


def mean_unit(result: Mapping[str, Any]) -> str:
    return "rad" if "rad" in result["rollout"]["units"].values() else "m"


def worst_first(result: Mapping[str, Any]) -> list[str]:
    """Joints by what the usual parameters leave."""
    errors = result["rollout"]["held_out"].get("standard", {})
    number = main_number(result)
    return sorted(errors, key=lambda joint: -(errors[joint][number] or 0.0))


def ahead(horizon: float | str) -> str:
    return "whole recordings" if horizon == "whole" else f"{horizon:g} s"


def _badge(result: Mapping[str, Any]) -> tuple[str, str]:
    """In a word or two, and its colour: how much is left counts, not only that there are names."""
    verdict = result["verdict"]
    if mistaken_ones(result):
        return "data to be corrected", "bad"
    before, after = (mean_error(result, m) for m in ("standard", "named"))
    if verdict == "none" and departing(result):
        return "the file's values differ", "found"
    if verdict == "effects" and not after < EXPLAINED * before:
        return TONES["effects+unknown"]
    return ("no further cause found", "good") if verdict == "none" else TONES[verdict]


def _headline(page: Page, result: Mapping[str, Any]) -> None:
    label, tone = _badge(result)
    unit = mean_unit(result)
    before, after = (error_text(mean_error(result, m), unit) for m in ("standard", "named"))
    nominal = error_text(mean_error(result, "nominal"), unit)
    horizon = ahead(result["rollout"]["main_horizon_s"])
    held = ", ".join(escaped(name) for name in result["held_out"]) or "none"
    text = str(result["sentence"])
    page.add(
        f'<header><p class="kicker">truing dynamics diagnose · {escaped(result.get("robot"))} · from commands'
        f'<span class="verdict {tone}">{label}</span></p>'
        f"<h1{' class=long' if len(text) > LONG else ''}>{escaped(text)}</h1>"
        f'<p class="sub">Simulated less real motion on what was held out (<b>{held}</b>), mean of the joints,'
        f' {horizon}: {nominal} with the file, <span class="before">{before}</span> with the usual'
        f' parameters, <span class="after">{after}</span> with what was named. {USUAL}</p>'
        f"{corrected_lines(result)}</header>"
    )


# ---- Motion --------------------------------------------------------------------------------------------
def paths_of(
    traces: Sequence[Mapping[str, Any]], order: Sequence[str], recordings: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Of every joint the trace to draw, in degrees or millimetres. recordings: which one, by joint."""
    out = []
    for joint in order:
        mine = [t for t in traces if t["joint"] == joint and len(t["time"]) > 1]
        if not mine:
            continue
        trace = next((t for t in mine if t["recording"] == recordings.get(joint)), mine[0])
        out.append(_path(trace))
    return out


def _path(trace: Mapping[str, Any]) -> dict[str, Any]:
    scale = TURN if trace["unit"] == "rad" else 1e3
    rows = slice(None, None, max(1, -(-len(trace["time"]) // POINTS)))
    simulated = {m: scale * np.asarray(v, dtype=float) for m, v in trace["simulated"].items()}
    kept = _kept(np.asarray(trace["time"], dtype=float), simulated, rows)
    some = next(iter(simulated.values()), np.empty(0))
    time = np.asarray(trace["time"], dtype=float)
    # A line ends where the next simulation begins; what comes before the first is not drawn.
    begins = np.where(np.isnan(some), np.nan, time)[kept]
    first = int(np.argmax(np.isfinite(begins))) if begins.size else 0
    path = {
        "recording": trace["recording"],
        "joint": trace["joint"],
        "unit": "°" if trace["unit"] == "rad" else "mm",
        "time": time[kept],
        "measured": scale * np.asarray(trace["measured"], dtype=float)[kept],
        "ahead": begins[first:],
        "simulated": {m: v[kept][first:] for m, v in simulated.items()},
    }
    if trace.get("command_unit", trace["unit"]) == trace["unit"]:
        path["commanded"] = scale * np.asarray(trace["command"], dtype=float)[kept]
    return path


def _kept(time: Floats, simulated: Mapping[str, Floats], rows: slice) -> NDArray[np.intp]:
    """Every so many rows, and all at which a simulation begins."""
    begins = [np.flatnonzero(np.isnan(v)) for v in simulated.values()]
    return np.unique(np.concatenate([np.arange(time.size)[rows], *begins])).astype(np.intp)


def telling(result: Mapping[str, Any]) -> dict[str, str]:
    """By joint the held-out recording on which the names help most."""
    found = result["rollout"]["recordings"]
    out = {}
    for joint in worst_first(result):
        gains = {
            name: (of.get(joint) or 0.0) - (found["named"][name].get(joint) or 0.0)
            for name, of in found.get("standard", {}).items()
            if name in found.get("named", {})
        }
        if gains:
            out[joint] = max(gains, key=lambda name: gains[name])
    return out


def _motion(
    page: Page, result: Mapping[str, Any], traces: Sequence[Mapping[str, Any]], order: Sequence[str]
) -> None:
    paths = paths_of(traces, order, telling(result))
    if not paths:
        page.add('<section class="card"><h2>Motion</h2><p>No held-out stretch to draw.</p></section>')
        return
    models = {m: MODELS[m] for m in MODELS if all(m in path["simulated"] for path in paths)}
    motion_chart(page, paths, models, KEYS, [path["joint"] for path in paths])


def _off(page: Page, traces: Sequence[Mapping[str, Any]], order: Sequence[str]) -> None:
    """Simulated less real motion of one joint over time, on all held-out recordings one after the other."""
    drawn: list[dict[str, Any]] = []
    owners: list[str] = []
    for joint in order:
        mine = [t for t in traces if t["joint"] == joint and len(t["time"]) > 1]
        for model, (name, colour) in MODELS.items():
            x, y = _errors_over_time([t for t in mine if model in t["simulated"]], model)
            if x.size:
                line = {"color": colour, "width": 1.5}
                drawn.append(
                    {
                        "type": "scatter",
                        "mode": "lines",
                        "x": packed(x),
                        "y": packed(y),
                        "name": name,
                        "line": line,
                    }
                )
                owners.append(joint)
    joints = list(dict.fromkeys(owners))
    if not joints:
        return
    for trace, owner in zip(drawn, owners, strict=True):
        trace["visible"] = owner == joints[0]
    buttons = [
        {"label": joint, "method": "update", "args": [{"visible": [o == joint for o in owners]}]}
        for joint in joints
    ]
    unit = next("°" if t["unit"] == "rad" else "mm" for t in traces if t["joint"] == joints[0])
    layout = {
        "xaxis": {"title": {"text": "time [s], held-out recordings one after the other"}},
        "yaxis": {"title": {"text": f"error [{unit}]"}, "zeroline": True},
        "updatemenus": joint_menu(buttons),
        "margin": {"l": 56, "r": 12, "t": 44, "b": 44},
    }
    page.add('<section class="card"><h2>Simulated less real motion over time</h2>' + _key(MODELS))
    page.chart("off", drawn, layout, size="trace")
    page.add("</section>")


def _errors_over_time(traces: Sequence[Mapping[str, Any]], model: str) -> tuple[Floats, Floats]:
    xs, ys, begun = [], [], 0.0
    for trace in traces:
        time = np.asarray(trace["time"], dtype=float)
        scale = TURN if trace["unit"] == "rad" else 1e3
        off = scale * (np.asarray(trace["simulated"][model]) - np.asarray(trace["measured"]))
        rows = _kept(time, {model: off}, slice(None, None, max(1, -(-time.size // POINTS))))
        xs.append(np.append(begun + time[rows] - time[0], np.nan))
        ys.append(np.append(off[rows], np.nan))
        begun += float(time[-1] - time[0]) + 1.0
    return (np.concatenate(xs), np.concatenate(ys)) if xs else (np.empty(0), np.empty(0))


def _key(models: Mapping[str, Any]) -> str:
    return '<p class="key">' + "".join(f'<i class="{m}"></i>{KEYS[m]}' for m in models) + "</p>"


# ---- Errors ------------------------------------------------------------------------------------------
def _errors(page: Page, result: Mapping[str, Any]) -> None:
    """Bars of every joint and model; buttons choose the horizon."""
    motion = result["rollout"]
    errors, units, horizons = motion["held_out"], motion["units"], motion["horizon_s"]
    models = [m for m in MODELS if m in errors]
    joints, main = list(units), main_number(result)
    drawn: list[dict[str, Any]] = []
    tops = []
    for number in range(len(horizons)):
        scaled = {m: [_shown(errors[m][j][number], units[j]) for j in joints] for m in models}
        largest = max((v for m in models if m != "nominal" for v in scaled[m] if v is not None), default=1.0)
        top = HEADROOM * largest
        tops.append(top)
        drawn += [
            labelled_bars(joints, scaled[m], top, *MODELS[m]) | {"visible": number == main} for m in models
        ]
    buttons = [
        {
            "label": ahead(horizon),
            "method": "update",
            "args": [
                {"visible": [k // len(models) == number for k in range(len(drawn))]},
                {"yaxis.range": [0, tops[number]]},
            ],
        }
        for number, horizon in enumerate(horizons)
    ]
    layout = {
        "barmode": "group",
        "bargap": 0.2,
        "yaxis": {"title": {"text": f"rms error [{_units(units)}]"}, "range": [0, tops[main]]},
        "xaxis": {"type": "category", "tickangle": -35 if sum(len(j) for j in joints) > 40 else 0},
        "updatemenus": [{**menu, "active": main} for menu in joint_menu(buttons)],
        "margin": {"l": 56, "r": 12, "t": 44, "b": 64},
    }
    page.add(
        '<section class="card"><h2>Simulated less real motion <span class="muted">held out; windows as long'
        " as the button says</span></h2>" + _key({m: MODELS[m] for m in models})
    )
    page.chart("errors", drawn, layout, size="bars")
    off = any((_shown(errors[m][j][main], units[j]) or 0.0) > tops[main] for m in models for j in joints)
    note = "Bars that reach the top are cut off: their numbers hold." if off else ""
    page.add(f'<p class="note">{note}</p></section>')


def _shown(value: float | None, unit: str) -> float | None:
    return None if value is None else value * (TURN if unit == "rad" else 1e3)


def _units(units: Mapping[str, str]) -> str:
    return "/".join({"rad": "°", "m": "mm"}[unit] for unit in dict.fromkeys(units.values()))


# ---- Causes, classes, what to record ---------------------------------------------------------------
def size_text(effect: Mapping[str, Any], most: int = 3) -> str:
    """ "0.65 ± 0.02 (1 with the file)"."""
    texts = []
    for p in effect["parameters"][:most]:
        unit = "" if p["unit"] in ("1", "-", "") else f" {p['unit']}"
        word = "" if len(effect["parameters"]) == 1 else f"{p['name'].partition('.')[0].replace('_', ' ')} "
        sigma = f" ± {figures_text(p['sigma'], 2)}" if p["sigma"] else ""
        texts.append(f"{word}{_value(p['value'])}{sigma}{unit}")
    more = len(effect["parameters"]) - most
    return ", ".join(texts) + (f" and {more} more" if more > 0 else "")


def _value(value: float | None) -> str:
    return "none" if value is None else figures_text(value)


def _causes(result: Mapping[str, Any]) -> str:
    lines = "".join(_cause_line(effect) for effect in [*beyond(result), *departing(result)])
    if not lines:
        nothing = "Nothing beyond the usual parameters."
        return f'<section class="card"><h2>What was found</h2><p>{nothing}</p></section>'
    return (
        '<section class="card"><h2>What was found</h2><div class="scroll"><table class="causes"><thead><tr>'
        "<th>cause</th><th>joint</th><th>removes</th><th>sure</th><th>size</th><th>with the file</th></tr>"
        f"</thead><tbody>{lines}</tbody></table></div>"
        '<p class="note">Removes: fraction of the squared error of motion that the usual parameters leave'
        " (one of these: that the file leaves), on recordings that were not fitted (90 % interval). Sure:"
        " that it is this cause, or one that stands behind “or”, which these recordings cannot tell from it."
        "</p></section>"
    )


def _cause_line(effect: Mapping[str, Any]) -> str:
    share, (low, high) = effect["share"] or 0.0, effect["ci"]
    width = max(1, round(BAR * min(1.0, max(0.0, share))))
    sure = effect["probability"] or 0.0
    interval = "" if low is None or high is None else f"{100 * low:.1f} to {min(100.0, 100 * high):.1f}"
    nominal = ", ".join(dict.fromkeys(_value(p["nominal"]) for p in effect["parameters"][:3]))
    return (
        f'<tr><td>{escaped(plain(effect))}<span class="maybe">{escaped(others(effect))}</span></td>'
        f"<td>{escaped(place(effect).removeprefix('at '))}</td>"
        f'<td><span class="bar" style="width:{width}px"></span>{100 * share:.1f} %'
        f' <span class="muted">{interval}</span></td>'
        f"<td>{'> 99 %' if sure > 0.99 else f'{100 * sure:.0f} %'}</td>"
        f'<td class="wide">{escaped(size_text(effect))}</td><td>{escaped(nominal)}</td></tr>'
    )


def _next(result: Mapping[str, Any]) -> str:
    """What these recordings cannot tell apart, and what would."""
    apart = "".join(
        f'<div class="apart">{escaped(one["sentence"])}'
        + (f"<br><b>Record</b> {escaped(one['separated_by'])}" if one.get("separated_by") else "")
        + "</div>"
        for one in result["classes"]
    )
    rest = [
        text
        for text in result["record_next"]
        if not any(text == c.get("separated_by") for c in result["classes"])
    ]
    items = "".join(f"<li>{escaped(text)}</li>" for text in rest)
    if not (apart or items):
        return ""
    listed = f'<ul class="plain">{items}</ul>' if items else ""
    return (
        '<section class="card"><h2>What cannot be told apart, and what to record next</h2>'
        f"{apart}{listed}</section>"
    )


# ---- Where it is left --------------------------------------------------------------------------------
def _where(result: Mapping[str, Any]) -> str:
    """Errors by what the joint was doing, and by recording."""
    motion = result["rollout"]
    regimes = _table(motion, motion["regimes"], REGIMES)
    names = {name: name for of in motion["recordings"].values() for name in of}
    recordings = _table(motion, motion["recordings"], names)
    if not (regimes or recordings):
        return ""
    return (
        '<section class="card"><h2>Where it is left <span class="muted">usual parameters → named effects, rms'
        f"</span></h2>{regimes}{recordings}</section>"
    )


def _table(motion: Mapping[str, Any], found: Mapping[str, Any], names: Mapping[str, str]) -> str:
    """A line for each name, a column for each joint: usual parameters and named effects."""
    before, after, units = found.get("standard", {}), found.get("named", {}), motion["units"]
    rows = ""
    for name, title in names.items():
        if name not in before or name not in after:
            continue
        cells = "".join(
            f"<td>{_pair(before[name].get(joint), after[name].get(joint), unit)}</td>"
            for joint, unit in units.items()
        )
        rows += f"<tr><td>{escaped(title)}</td>{cells}</tr>"
    head = "".join(f"<th>{escaped(joint)}</th>" for joint in units)
    return (
        f'<div class="scroll"><table class="tight"><thead><tr><th></th>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
        if rows
        else ""
    )


def _pair(before: float | None, after: float | None, unit: str) -> str:
    if before is None or after is None:
        return "–"
    return f"{error_text(before, unit)} → {error_text(after, unit)}"


# ---- Unknown, usual, not tested ----------------------------------------------------------------------
def _unknown(page: Page, result: Mapping[str, Any]) -> None:
    if not result["unknown"]:
        return
    page.add('<section class="card"><h2>What no known effect explains</h2>')
    for number, one in enumerate(result["unknown"]):
        words = " and ".join(name.replace("_", " ") for name in one["inputs"])
        page.add(
            f"<p>At <b>{escaped(one['joint'])}</b> something goes with {escaped(words)}"
            f" ({escaped(sure_text(one['probability'] or 0.0))} sure,"
            f" {100 * (one['share'] or 0.0):.1f} % of the squared error).</p>"
        )
        curve = np.array(one["curve"], dtype=float).reshape(-1, 3)
        if len(curve) > 1:
            _curve(page, curve, words, number)
    page.add("</section>")


def _curve(page: Page, curve: Floats, words: str, number: int) -> None:
    x, y, sigma = curve.T
    band = {"line": {"width": 0}, "hoverinfo": "skip", "mode": "lines", "type": "scatter"}
    drawn = [
        {**band, "x": packed(x), "y": packed(y - BAND * sigma)},
        {
            **band,
            "x": packed(x),
            "y": packed(y + BAND * sigma),
            "fill": "tonexty",
            "fillcolor": faded(UNKNOWN, 0.2),
        },
        {
            "type": "scatter",
            "mode": "lines",
            "x": packed(x),
            "y": packed(y),
            "line": {"color": INK, "width": 2},
        },
    ]
    layout = {
        "xaxis": {"title": {"text": words}},
        "yaxis": {"title": {"text": "torque [Nm]"}},
        "margin": {"l": 56, "r": 12, "t": 12, "b": 44},
    }
    page.chart(f"unknown{number}", drawn, layout, size="curve")


def _usual(result: Mapping[str, Any]) -> str:
    """The chain joint by joint: values of the file and as found."""
    chains = result["chains"]
    nominal, named = chains["nominal"]["joints"], chains["named"]["joints"]
    fields = [
        field
        for field in next(iter(named.values()), {})
        if field != "type" and any(named[j][field] != nominal[j].get(field) for j in named)
    ]
    head = "".join(f"<th>{escaped(joint)}</th>" for joint in named)
    rows = "".join(
        f"<tr><td>{escaped(field.replace('_', ' '))}</td>"
        + "".join(
            f"<td>{_value(nominal[joint].get(field))} → <b>{_value(named[joint][field])}</b></td>"
            for joint in named
        )
        + "</tr>"
        for field in fields
    )
    if not rows:
        return ""
    return (
        '<section class="card"><details><summary>Drives, the file’s values → as found (SI units)</summary>'
        f'<div class="scroll"><table class="tight"><thead><tr><th></th>{head}</tr></thead>'
        f'<tbody>{rows}</tbody></table></div><p class="note">{USUAL}</p></details></section>'
    )


def _not_testable(result: Mapping[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{escaped(n['effect'].replace('_', ' '))}</td><td>{escaped(', '.join(n['joints']))}</td>"
        f'<td class="wrap">{escaped(n["why"])}</td></tr>'
        for n in result["not_testable"]
    )
    count = counted(len(result["not_testable"]), "effect")
    return (
        f'<section class="card"><details><summary>Not testable with these recordings: {count}</summary>'
        f'<div class="scroll"><table class="causes"><tbody>{rows}</tbody></table></div></details></section>'
        if rows
        else ""
    )
