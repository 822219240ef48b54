# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML reports of ``truing dynamics``, in the order in which people ask.

The first screen: how far the error of the torque falls on recordings that nothing was fitted to, by what;
torque over time, measured and as the models say; the error of every joint. Below: simulated and real motion;
every cause with its size; friction over speed; where in the motion something is left; what could not be told
apart, or tested.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.rollout.page import joint_menu, response_card, rollout_card
from truing.report.charts import AFTER, BEFORE, INK, MUTED, faded, labelled_bars, packed
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.scene import RobotPicture
from truing.report.words import counted, escaped, figures_text, sure_text

Floats = NDArray[np.float64]
NOMINAL, UNKNOWN = "#98a2ad", "#8a5bb5"
HEAT = [[0, "#ffffff"], [0.25, "#fdf0d5"], [0.5, "#f6bd60"], [0.75, "#dd6b2f"], [1, "#8f1d1d"]]
CAUSES = 3  # that the headline names
FEW = 2  # joints of a cause that the headline names, of more their number
CONTENDER = 0.25  # of a cause's probability: another that is as likely is named with it
ROOM = 115  # characters of the causes in a headline of two lines
LONG = 75  # characters of a headline in large type
POINTS = 3000  # of a line, over time
TRACE_SECONDS = 20.0  # of a prediction's report: what one can look at
BAND = 2  # standard errors
BAR = 120  # [px] of a cause that removes all of it
AXIS = ("standard", "named")  # models that the axis of errors is for; others may be far off
HEADROOM = 1.6  # of that axis over their largest error
LITTLE = 0.95  # of an error: one that is closer to it is the same
_EXACT = 1e-9  # [%] no error is smaller
EMPTY_BIN = 0.005  # of a joint's rows: parts of the motion with fewer say nothing
READ_OTHERWISE = (
    "gravity_direction",
    "torque_sign",
    "position_unit",
    "command_unit",
    "load_differs",
    "load_comes_and_goes",
    "tool_pushed",
)  # findings that change what is read
TONES = {
    "none": ("no gap beyond noise", "good"),
    "effects": ("explained", "found"),
    "effects+unknown": ("partly explained", "open"),
    "unknown": ("not explained", "open"),
    "does_not_hold": ("does not hold", "bad"),
}
MODELS = {
    "nominal": ("nominal model", NOMINAL),
    "standard": ("standard practice", BEFORE),
    "named": ("named effects", AFTER),
    "with_unknown": ("and what has no name", UNKNOWN),
}
INPUTS = {
    "speed": ("speed", "slow", "fast"),
    "direction": ("direction", "−", "+"),
    "acceleration": ("acceleration", "low", "high"),
    "load": ("load", "low", "high"),
    "angle": ("angle", "low", "high"),
    "time": ("time", "early", "late"),
    "temperature": ("temperature", "cold", "warm"),
}
USUAL = "Standard practice: inertias, Coulomb and viscous friction, an offset: what is usually fitted."


def diagnosis_report(
    result: Mapping[str, Any],
    traces: Sequence[Mapping[str, Any]],
    recordings: int,
    paths: Sequence[Mapping[str, Any]] = (),
    arm: RobotPicture | None = None,
) -> str:
    """The report of ``truing dynamics diagnose``.

    Args:
        result: What ``result.json`` holds (format ``truing-dynamics/1``).
        traces: Of every joint a held-out stretch: recording, joint, and arrays over its rows: time [s],
            measured, nominal, standard, named [Nm | N].
        recordings: How many there were.
        paths: Of every joint a held-out stretch of motion (`truing.dynamics.rollout.paths_of`).
        arm: The same, to be played.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: torques", part_of_page("dynamics"))
    page.add(_headline(result, recordings))
    page.add(mistakes_card(result))
    page.add('<div class="first">')
    _trace_card(page, traces, worst_first(result))
    _error_card(page, result)
    page.add("</div>")
    rollout_card(page, result, paths, arm)
    page.add(_causes(result))
    _friction(page, result["friction"])
    _where(page, result)
    _unknown(page, result)
    page.add(_classes(result))
    page.add(_not_testable(result))
    page.add(notes_card(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def fit_report(result: Mapping[str, Any], recordings: int) -> str:
    """The report of ``truing dynamics identify``. result: what ``result.json`` holds."""
    page = Page(f"{result.get('robot') or 'Robot'}: torques", part_of_page("dynamics"))
    before, after = (mean_percent(result, model) for model in ("nominal", "named"))
    page.add(
        f"<header>{_kicker('identify', result, recordings)}<h1>Held-out torque error: {_percent(before)} with"
        f" the nominal model, {_percent(after)} with what was fitted</h1>{_about(result)}</header>"
    )
    page.add(mistakes_card(result))
    page.add('<div class="first">')
    page.add(_parameters(result))
    _error_card(page, result)
    page.add("</div>")
    _friction(page, result["friction"])
    page.add(_not_testable(result))
    page.add(notes_card(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def prediction_report(
    result: Mapping[str, Any],
    traces: Sequence[Mapping[str, Any]],
    paths: Sequence[Mapping[str, Any]] = (),
    arm: RobotPicture | None = None,
) -> str:
    """The report of ``truing dynamics predict``. result: what ``result.json`` holds; traces: of every joint,
    time [s], measured (NaN: it was not) and named, the prediction [Nm | N]; paths: of every joint simulated
    motion, if there is any; arm: the same, to be played.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: predicted torques", part_of_page("dynamics"))
    errors = result["errors"]
    percents = [e["percent"] for e in errors.values() if e["percent"] is not None]
    title = (
        f"Torques of {counted(result['rows'], 'row')} predicted"
        if not percents
        else f"Predicted torques miss the measured ones by {_percent(_rms(percents))}"
    )
    note = "Rms over the joints, in % of each torque's standard deviation, noise of the measurement included."
    page.add(
        f'<header><p class="kicker">truing dynamics predict · {escaped(result.get("robot"))} ·'
        f" {escaped(result['recording'])}</p><h1>{title}</h1>"
        f'<p class="sub">{note if percents else ""}</p></header>'
    )
    start = [_stretch(trace) for trace in traces]
    order = sorted(errors, key=lambda joint: -(errors[joint]["percent"] or 0.0))
    _trace_card(page, start, order or [trace["joint"] for trace in traces])
    if result["simulated"] is not None:
        response_card(page, result["simulated"], paths, arm)
    lines = "".join(
        f"<tr><td>{escaped(joint)}</td>{table_cell(e['rms'], figures_text(e['rms']) + ' ' + e['unit'])}"
        f"<td>{_percent(e['percent'])}</td></tr>"
        for joint, e in errors.items()
    )
    if lines:
        page.add(
            '<section class="card"><h2>Error of every joint</h2><div'
            ' class="scroll"><table><thead><tr><th></th>'
            f"<th>rms</th><th>of the torque</th></tr></thead><tbody>{lines}</tbody></table></div></section>"
        )
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def export_report(
    result: Mapping[str, Any], paths: Sequence[Mapping[str, Any]], arm: RobotPicture | None = None
) -> str:
    """The report of ``truing dynamics export``: the written model's motion beside the robot's, and what the
    model lacks. result: what ``result.json`` holds; paths: of every joint a held-out stretch of motion; arm:
    the same, to be played."""
    page = Page(f"{result.get('robot') or 'Robot'}: {result['model']}", part_of_page("dynamics"))
    motion, lacks = result["rollout"], result["not_written"]
    title = (
        motion["sentence"] if not motion["why_not"] else f"{result['model']} is written, not judged by motion"
    )
    page.add(
        f'<header><p class="kicker">truing dynamics export · {escaped(result.get("robot"))} ·'
        f" {escaped(result['to'])} · {escaped(result['model'])}</p>"
        f'<h1 class="long">{escaped(title)}</h1></header>'
    )
    rollout_card(page, result, paths, arm)
    lines = "".join(
        f'<tr><td>{escaped(n["name"])}</td><td class="n">'
        f"{'' if n['size_Nm'] is None else figures_text(n['size_Nm']) + ' Nm'}</td>"
        f'<td class="wrap">{escaped(n["reason"])}</td></tr>'
        for n in lacks
    )
    if lines:
        said = "".join(f'<p class="note">{escaped(text)}.</p>' for text in result.get("notes", ()))
        page.add(
            f'<section class="card"><h2>What the model lacks</h2>{said}<div class="scroll">'
            f'<table class="causes"><tbody>{lines}</tbody></table></div></section>'
        )
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- Words -----------------------------------------------------------------------------------------
def _percent(value: float | None) -> str:
    return "–" if value is None or not math.isfinite(value) else f"{figures_text(value, 2)}\u202f%"


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def mean_percent(result: Mapping[str, Any], model: str) -> float:
    """Geometric mean over the joints of a model's held-out error [%], as the core has it."""
    errors = result["torque"]["held_out"].get(model, {})
    logs = [math.log(max(value, _EXACT)) for value in errors.values() if value is not None]
    return math.exp(sum(logs) / len(logs)) if logs else math.nan


def worst_first(result: Mapping[str, Any]) -> list[str]:
    """Joints by what standard practice leaves."""
    errors = result["torque"]["held_out"].get("standard", {})
    return sorted(errors, key=lambda joint: -(errors[joint] or 0.0))


def plain(effect: Mapping[str, Any]) -> str:
    """What an effect is, without its joints and sizes: "friction that grows with the load"."""
    if is_load(effect):
        return "load at the tool that nobody told"
    text = str(effect["sentence"]).split(":")[0]
    at = text.rfind(" at ") if effect["joints"] else -1
    text = (text if at < 0 else text[:at]) or effect["effect"].replace("_", " ")
    return text[:1].lower() + text[1:]


def place(effect: Mapping[str, Any]) -> str:
    joints = list(effect["joints"])
    if is_load(effect):
        return f"in {_listed(effect['recordings'])}"
    if effect["effect"] == "coupling" and len(joints) == 2:
        return f"at {joints[0]} from {joints[1]}"
    return f"at {_listed(joints)}" if joints else ""


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


def beyond_standard(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [effect for effect in result["effects"] if not effect["standard"]]


def is_load(effect: Mapping[str, Any]) -> bool:
    """A load of some recordings, which nobody told: they carry it, and not the robot."""
    return bool(effect.get("recordings"))


def causes_in_words(result: Mapping[str, Any]) -> str:
    """The largest causes with their joints, and how many more there are, as much of it as two lines hold."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for effect in beyond_standard(result):
        if is_load(effect):
            continue
        key = effect["effect"] if effect["effect"] != "coupling" else f"{effect['effect']} {effect['joints']}"
        groups.setdefault(key, []).append(effect)
    ordered = sorted(groups.values(), key=lambda group: -sum(effect["share"] or 0.0 for effect in group))
    text = ""
    for most in range(CAUSES, 0, -1):
        rest = sum(len(group) for group in ordered[most:])
        for few in (FEW, 1):
            text = "; ".join(_cause(group, few) for group in ordered[:most])
            text += f"; and {rest} smaller" if rest else ""
            if len(text) <= ROOM:
                return text
    return text


def _cause(group: Sequence[Mapping[str, Any]], few: int) -> str:
    """A cause and its joints, of more than a few of them their number."""
    if group[0]["effect"] == "coupling":
        return f"{plain(group[0])} ({group[0]['joints'][1]} on {group[0]['joints'][0]})"
    joints = [joint for effect in group for joint in effect["joints"]]
    other = _or_else(group[0]) if len(group) == 1 and len(joints) <= 1 else ""
    where = ", ".join(joints) if len(joints) <= few else f"{len(joints)} joints"
    return plain(group[0]) + (f" ({where})" if joints else "") + other


def _or_else(effect: Mapping[str, Any]) -> str:
    """Another cause that is not much less likely."""
    other = max(effect["confounded_with"], key=lambda one: float(one["probability"]), default=None)
    if other is None or other["probability"] < CONTENDER * effect["probability"]:
        return ""
    where = f" ({', '.join(other['joints'])})" if other["joints"] not in ([], effect["joints"]) else ""
    return f" or {other['effect'].replace('_', ' ')}{where}: these recordings cannot tell"


def _kicker(command: str, result: Mapping[str, Any], recordings: int, badge: str = "") -> str:
    return (
        f'<p class="kicker">truing dynamics {command} · {escaped(result.get("robot"))} ·'
        f" {counted(recordings, 'recording')}{badge}</p>"
    )


def _about(result: Mapping[str, Any]) -> str:
    """What the percentages of the headline are."""
    held_out = ", ".join(escaped(name) for name in result["held_out"]) or "none"
    return (
        '<p class="sub">Geometric mean over the joints of the rms error, in % of each joint\'s torque (its'
        " standard deviation), on what was"
        f" held out and never fitted: <b>{held_out}</b>. Torque and models low-passed at"
        f" {figures_text(result['cutoff_hz'])} Hz.</p>"
    )


def _moves(result: Mapping[str, Any]) -> str:
    """What simulated motion says, in a line."""
    motion = result["rollout"]
    if motion["why_not"]:
        return ""
    return f'<p class="sub">{escaped(motion["sentence"])}.</p>'


def _headline(result: Mapping[str, Any], recordings: int) -> str:
    label, tone = TONES[result["verdict"]] if not mistaken_ones(result) else ("data to be corrected", "bad")
    before, after = result["without_names_percent"], mean_percent(result, "named")
    loads = [effect for effect in beyond_standard(result) if is_load(effect)]
    if len(beyond_standard(result)) > len(loads) and result["verdict"] != "does_not_hold":
        carried = f"{escaped(result['load_sentence'])}. " if loads else ""
        text = (
            f'{carried}Torque error falls from <span class="before">{_percent(before)}</span> to'
            f' <span class="after">{_percent(after)}</span>: {escaped(causes_in_words(result))}'
        )
        length = len(carried) + len(causes_in_words(result)) + 40
    else:
        text = escaped(result["sentence"])
        length = len(text)
    badge = f'<span class="verdict {tone}">{label}</span>'
    if result["rollout"].get("verdict"):
        badge += '<span class="verdict bad">worse in motion</span>'
    return (
        f"<header>{_kicker('diagnose', result, recordings, badge)}<h1"
        f"{' class=long' if length > LONG else ''}>{text}</h1>"
        f"{corrected_lines(result)}{_about(result)}{_moves(result)}</header>"
    )


def corrected_lines(result: Mapping[str, Any]) -> str:
    """What was read otherwise than it is written, before anything else: a line each."""
    found = [f for f in result["sanity"] if f["applied"] and f["finding"] in READ_OTHERWISE]
    return "".join(f'<p class="sub"><b>Corrected first:</b> {escaped(f["evidence"])}.</p>' for f in found)


# ---- The recordings themselves ---------------------------------------------------------------------
def mistakes_card(result: Mapping[str, Any]) -> str:
    """What is wrong with the recordings comes before anything that was concluded from them."""
    return _findings_card("Look at the data first", "card look", mistaken_ones(result))


def mistaken_ones(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [finding for finding in result["sanity"] if finding["mistake"]]


def notes_card(result: Mapping[str, Any]) -> str:
    found = [f for f in result["sanity"] if not f["mistake"]]
    return _findings_card("What the recordings look like", "card", found)


def _findings_card(title: str, style: str, found: Sequence[Mapping[str, Any]]) -> str:
    lines = "".join(
        f"<tr><td>{escaped(f['finding'].replace('_', ' '))}</td>"
        f'<td class="wrap">{escaped(f["evidence"])}</td>'
        f"<td>{'allowed for' if f['applied'] else ''}</td></tr>"
        for f in found
    )
    return (
        f'<section class="{style}"><h2>{title}</h2><div class="scroll"><table class="causes"><tbody>{lines}'
        "</tbody></table></div></section>"
        if lines
        else ""
    )


# ---- Torque over time, and error of every joint ---------------------------------------------------
def _stretch(trace: Mapping[str, Any]) -> dict[str, Any]:
    """The first seconds of a trace."""
    time = trace["time"]
    rows = time <= time[0] + TRACE_SECONDS
    return {k: v[rows] if isinstance(v, np.ndarray) else v for k, v in trace.items()}


def _drawable(trace: Mapping[str, Any]) -> dict[str, Any]:
    """A trace of about POINTS rows, with a row of NaN in each pause of more than five of its steps.

    What was held out may be blocks of time, and no line is drawn from one to the next.
    """
    every = max(1, len(trace["time"]) // POINTS)
    thinned = {k: v[::every] if isinstance(v, np.ndarray) else v for k, v in trace.items()}
    steps = np.diff(thinned["time"], prepend=thinned["time"][0])
    pauses = np.flatnonzero(steps > 5.0 * np.median(steps))
    return {k: np.insert(v, pauses, np.nan) if isinstance(v, np.ndarray) else v for k, v in thinned.items()}


def _trace_card(page: Page, traces: Sequence[Mapping[str, Any]], order: Sequence[str]) -> None:
    """Torque of one joint over time; buttons choose the joint, the first is shown."""
    by_joint = {trace["joint"]: trace for trace in traces if len(trace["time"])}
    shown = [joint for joint in order if joint in by_joint]
    shown += [joint for joint in by_joint if joint not in shown]
    if not shown:
        return
    drawn, owners = [], []
    for joint in shown:
        trace = _drawable(by_joint[joint])
        for key, name, colour, dash, width in (
            ("nominal", "nominal", NOMINAL, "dot", 1.6),
            ("standard", "standard", BEFORE, "solid", 1.8),
            ("measured", "measured", INK, "solid", 2.6),
            ("named", "named", AFTER, "solid", 1.8),
        ):
            if key not in trace or np.isnan(trace[key]).all():
                continue
            drawn.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(trace["time"]),
                    "y": packed(trace[key]),
                    "name": name,
                    "line": {"color": colour, "width": width, "dash": dash},
                    "visible": joint == shown[0],
                }
            )
            owners.append(joint)
    names = {str(trace["name"]) for trace in drawn}
    recordings = {joint: by_joint[joint]["recording"] for joint in shown}
    where, labels = _trace_words(recordings, "standard" in names)
    buttons = [
        {"label": label, "method": "restyle", "args": ["visible", [owner == joint for owner in owners]]}
        for joint, label in zip(shown, labels, strict=True)
    ]
    page.add(f'<section class="card"><h2>Torque over time <span class="muted">{where}</span></h2>')
    words = {"measured": "measured", "nominal": "nominal model", "standard": "standard practice"}
    words["named"] = "named effects" if "standard" in names else "predicted"
    page.add(
        '<p class="key">'
        + "".join(
            f'<i class="{key}{" dash" if key == "nominal" else ""}"></i>{word}'
            for key, word in words.items()
            if key in names
        )
        + "</p>"
    )
    page.chart("trace", drawn, _trace_layout(buttons), size="trace")
    page.add("</section>")


def _trace_words(recordings: Mapping[str, str], judged: bool) -> tuple[str, list[str]]:
    """What stands beside the title; buttons of joints, worst first, with their recordings if these differ."""
    joints = list(recordings)
    apart = len(set(recordings.values())) > 1
    words = [] if apart else [escaped(recordings[joints[0]])]
    if judged:
        words = [": ".join(["held out", *words])]
        if len(joints) > 1:
            words.append(f"{escaped(joints[0])} was worst, others to choose")
    return "; ".join(words), [f"{joint}, {name}" if apart else joint for joint, name in recordings.items()]


def _trace_layout(buttons: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"title": {"text": "torque [Nm]"}},
        "updatemenus": joint_menu(buttons),
        "margin": {"l": 56, "r": 12, "t": 44, "b": 44},
    }


def remainder_sentence(joints: Sequence[str]) -> str:
    """What errors with a little of every effect tell of these joints; empty where there are none."""
    if not joints:
        return ""
    return (
        f"At {_listed(joints)} a little of every other effect beside what was named predicts torques"
        " that it was not fitted to better: small causes, or other laws, that cannot be told apart."
    )


def _error_card(page: Page, result: Mapping[str, Any]) -> None:
    """Held-out error of every joint and model. Bars of the nominal model may be cut off; all have numbers."""
    errors = result["torque"]["held_out"]
    nameless = result.get("unknown") or result.get("remainders")
    models = [m for m in MODELS if errors.get(m) and (m != "with_unknown" or nameless)]
    page.add(
        '<section class="card"><h2>Error of every joint <span class="muted">held out, in % of its torque'
        "</span></h2>"
    )
    page.add('<p class="key">' + "".join(f'<i class="{_css(m)}"></i>{MODELS[m][0]}' for m in models) + "</p>")
    joints = list(errors[models[0]]) if models else []
    largest = max((errors[m][j] or 0.0 for m in models if m in AXIS for j in joints), default=1.0)
    top = HEADROOM * largest
    drawn = [
        labelled_bars(joints, [errors[model][joint] for joint in joints], top, *MODELS[model], unit=" %")
        for model in models
    ]
    layout = {
        "barmode": "group",
        "bargap": 0.2,
        "yaxis": {"title": {"text": "rms error [% of the torque]"}, "range": [0, top]},
        "xaxis": {"type": "category", "tickangle": -35 if sum(len(j) for j in joints) > 40 else 0},
        "margin": {"l": 56, "r": 12, "t": 12, "b": 44},
    }
    page.chart("errors", drawn, layout, size="bars")
    off = any((errors[m][j] or 0.0) > top for m in models for j in joints)
    page.add(
        f'<p class="note">{USUAL}{" Bars that reach the top are cut off: their numbers hold." if off else ""}'
        f" {escaped(in_motion_sentence(result))}"
        f" {escaped(remainder_sentence(result.get('remainders', ())))}</p></section>"
    )


def in_motion_sentence(result: Mapping[str, Any]) -> str:
    """What named effects leave where a joint moves; "" where rests make little difference."""
    errors, moving = (result["torque"].get(rows, {}).get("named", {}) for rows in ("held_out", "in_motion"))
    if not any((moving.get(joint) or math.inf) < LITTLE * (errors[joint] or 0.0) for joint in errors):
        return ""
    listed = ", ".join(f"{joint} {_percent(moving.get(joint))}" for joint in errors)
    return (
        "Rows at rest are counted, where friction is what earlier motion left, and a recording that begins"
        f" at rest does not show that motion. Where the joint moves, named effects leave {listed}."
    )


def _css(model: str) -> str:
    return "unknown" if model == "with_unknown" else model


# ---- Causes ----------------------------------------------------------------------------------------
def size_text(effect: Mapping[str, Any], most: int = 3) -> str:
    """ "0.0653 ± 0.0023"; constants of the law without an error; of several parameters which."""
    texts = []
    most += is_load(effect)  # its mass and place
    for p in effect["parameters"][:most]:
        unit = "" if p["unit"] in ("-", "") else f" {p['unit']}"
        parts = p["name"].split(".")
        named = len(effect["parameters"]) > 1 and parts[-1] not in effect["joints"]
        word = f"{parts[-1]} " if named else ""
        sigma = "" if p["frozen"] or not p["sigma"] else f" ± {figures_text(p['sigma'], 2)}"
        texts.append(f"{word}{figures_text(p['value'])}{sigma}{unit}")
    more = len(effect["parameters"]) - most
    return ", ".join(texts) + (f" and {more} more" if more > 0 else "")


def others(effect: Mapping[str, Any], most: int = 3) -> str:
    """ "or motor constant at J6": what these recordings cannot tell it from."""
    names = [
        f"{a['effect'].replace('_', ' ')}{' ' + place(a) if a['joints'] else ''}"
        for a in effect["confounded_with"]
    ]
    more = f" or {len(names) - most} more" if len(names) > most else ""
    return f"or {' or '.join(names[:most])}{more}" if names else ""


def _causes(result: Mapping[str, Any]) -> str:
    named = beyond_standard(result)
    usual = [effect for effect in result["effects"] if effect["standard"]]
    if not named and not usual:
        return ""
    lines = "".join(_cause_line(effect) for effect in named)
    table = (
        '<div class="scroll"><table class="causes"><thead><tr><th>cause</th><th>joint</th><th>removes</th>'
        f"<th>torque, rms</th><th>sure</th><th>size</th></tr></thead><tbody>{lines}</tbody></table></div>"
        '<p class="note">Removes: fraction of the squared error that standard practice leaves, all other'
        " causes in, on recordings that were not fitted (90 % interval). Sure: that it is this cause, or one"
        " that stands behind “or”, which these recordings cannot tell from it.</p>"
        if named
        else "<p>Nothing beyond standard practice was found.</p>"
    )
    many = [effect for effect in named if len(effect["joints"]) > FEW and len(effect["parameters"]) > FEW]
    folds = _folded("The values of each joint", many) + _folded("What is usually fitted", usual)
    return f'<section class="card"><h2>What was found</h2>{table}{folds}</section>'


def _folded(title: str, effects: Sequence[Mapping[str, Any]]) -> str:
    """All parameters of effects, to be unfolded."""
    rows = "".join(
        f'<tr><td>{escaped(plain(e))}</td><td class="wide">{escaped(p["name"])}</td><td class="n">'
        f"{figures_text(p['value'])}</td><td>{_sigma(p)}</td>"
        f"<td>{escaped(p['unit'])}</td></tr>"
        for e in effects
        for p in e["parameters"]
    )
    return (
        f'<details><summary>{title}</summary><div class="scroll"><table class="causes"><tbody>'
        f"{rows}</tbody></table></div></details>"
        if rows
        else ""
    )


def _cause_line(effect: Mapping[str, Any]) -> str:
    share, (low, high) = effect["share"] or 0.0, effect["ci"]
    width = max(1, round(BAR * min(1.0, max(0.0, share))))
    maybe = others(effect)
    interval = "" if low is None or high is None else f"{100 * low:.1f} to {min(100.0, 100 * high):.1f}"
    removes = (
        f'<span class="bar" style="width:{width}px"></span>{100 * share:.1f} %'
        f' <span class="muted">{interval}</span>'
    )
    if is_load(effect):
        removes = '<span class="muted">taken into account first</span>'
    size = "" if is_load(effect) else f"{figures_text(effect['rms_Nm'] or 0.0)} Nm"
    return (
        f'<tr><td>{escaped(plain(effect))}<span class="maybe">{escaped(maybe)}</span></td>'
        f'<td class="wrap">{escaped(place(effect).removeprefix("at "))}</td><td>{removes}</td>'
        f'<td class="n">{size}</td>'
        f"<td>{escaped(sure_text(effect['probability']))}</td>"
        f'<td class="wide">{escaped(size_text(effect))}</td></tr>'
    )


def _sigma(parameter: Mapping[str, Any]) -> str:
    """ "± 0.02"; nothing where no standard error is known."""
    return f"± {figures_text(parameter['sigma'], 2)}" if parameter["sigma"] else ""


def _parameters(result: Mapping[str, Any]) -> str:
    """What was fitted: effects first; changes of the links' inertias are folded away."""
    inertias = [p for p in result["parameters"] if p["name"].startswith("link_inertia.")]
    effects = [p for p in result["parameters"] if p not in inertias]
    fold = (
        "<details><summary>Changes of the links' inertias: what motion cannot tell"
        f" stays near nominal</summary>{_parameter_table(inertias)}</details>"
        if inertias
        else ""
    )
    return f'<section class="card"><h2>What was fitted</h2>{_parameter_table(effects)}{fold}</section>'


def _parameter_table(parameters: Sequence[Mapping[str, Any]]) -> str:
    lines = []
    for p in parameters:
        value = 0.0 if abs(p["value"]) < 1e-3 * (p["sigma"] or 0.0) else p["value"]
        lines.append(
            f"<tr><td>{escaped(p['name'])}</td>{table_cell(p['value'], figures_text(value))}"
            f"<td>{_sigma(p)}</td><td>{escaped(p['unit'])}</td></tr>"
        )
    return (
        '<div class="scroll"><table><thead><tr><th>parameter</th><th>value</th><th>standard error</th>'
        f"<th></th></tr></thead><tbody>{''.join(lines)}</tbody></table></div>"
    )


# ---- Friction --------------------------------------------------------------------------------------
def _friction(page: Page, friction: Sequence[Mapping[str, Any]]) -> None:
    """Friction of steady motion over speed, at no load and under load."""
    if not friction:
        return
    page.add('<section class="card"><h2>Friction over speed <span class="muted">steady motion</span></h2>')
    if any(len(joint["curves"]) > 1 for joint in friction):
        page.add(
            '<p class="key"><i class="named"></i>no load<i class="standard"></i>under a large load that was'
            " recorded</p>"
        )
    page.add('<div class="multiples">')
    for number, joint in enumerate(friction):
        drawn = []
        for curve in reversed(joint["curves"]):
            loaded = curve["load"] > 0
            drawn.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": joint["speed"],
                    "y": curve["friction"],
                    "name": f"at {figures_text(curve['load'])} {joint['unit']}" if loaded else "no load",
                    "line": {"color": BEFORE if loaded else AFTER, "width": 2.4},
                }
            )
        layout = {
            "title": {"text": joint["joint"]},
            "xaxis": {"title": {"text": f"speed [{joint['speed_unit']}]"}, "zeroline": True},
            "yaxis": {"title": {"text": f"friction [{joint['unit']}]"}, "zeroline": True},
        }
        page.chart(f"friction{number}", drawn, layout, size="curve")
    page.add("</div></section>")


# ---- Where -----------------------------------------------------------------------------------------
def _where(page: Page, result: Mapping[str, Any]) -> None:
    """What is left, joint by joint, in the parts of the motion; units of each joint's own torque."""
    regimes = result["where"]["regimes"]
    spread = _spreads(result)
    inputs = [name for name in INPUTS if any(w["input"] == name for w in regimes)]
    if not inputs or not spread:
        return
    joints = list(spread)
    columns = _columns(regimes, inputs)
    z = {model: np.full((len(joints), len(columns)), np.nan) for model in ("standard", "named")}
    texts = [["" for _ in columns] for _ in joints]
    for row, joint in enumerate(joints):
        for k, (name, number) in enumerate(columns):
            bins = [w for w in regimes if w["joint"] == joint and w["input"] == name]
            cell = _bin(bins, number)
            if cell is None or cell["n"] < EMPTY_BIN * sum(w["n"] for w in bins):
                continue
            for model in z:
                z[model][row, k] = 100.0 * cell[f"{model}_rms_Nm"] / spread[joint]
            texts[row][k] = f"{name} {figures_text(cell['low'])} to {figures_text(cell['high'])}"
    page.add(
        '<section class="card"><h2>Where it is left <span class="muted">held-out error in the parts of'
        " the motion,"
        " % of the joint's torque</span></h2>"
    )
    page.chart("where", _heat(z, texts, joints, len(columns)), _heat_layout(columns, inputs), size="heat")
    words = f"{_where_words(result)} {escaped(orders_sentence(result.get('orders', ())))}"
    page.add(f'<p class="note">{words}</p></section>')


def _spreads(result: Mapping[str, Any]) -> dict[str, float]:
    """Standard deviation of every joint's held-out torque [Nm | N]."""
    percent = result["torque"]["held_out"].get("standard", {})
    rms = result["torque_rms_Nm"]["held_out"].get("standard", {})
    return {j: 100.0 * rms[j] / percent[j] for j in percent if percent[j] and rms[j]}


def _columns(regimes: Sequence[Mapping[str, Any]], inputs: Sequence[str]) -> list[tuple[str, int]]:
    """Every part of every input, from low to high."""
    return [(name, k) for name in inputs for k in range(2 if name == "direction" else 5)]


def _bin(bins: Sequence[Mapping[str, Any]], number: int) -> Mapping[str, Any] | None:
    """The part with that number. Parts that nothing fell into are not there; all have the same width."""
    if not bins:
        return None
    width = bins[0]["high"] - bins[0]["low"]
    start = {"direction": -1.0}.get(bins[0]["input"])
    if start is None:
        signed = bins[0]["input"] in ("angle", "temperature")
        start = min(w["low"] for w in bins) if signed else 0.0
    return next((w for w in bins if width > 0 and round((w["low"] - start) / width) == number), None)


def _heat(
    z: Mapping[str, Floats], texts: Sequence[Any], joints: Sequence[str], n: int
) -> list[dict[str, Any]]:
    top = float(np.nanquantile(z["standard"], 0.98)) if np.isfinite(z["standard"]).any() else 1.0
    return [
        {
            "type": "heatmap",
            "z": [[None if not math.isfinite(v) else float(v) for v in row] for row in z[model]],
            "x": list(range(n)),
            "y": list(joints),
            "text": texts,
            "hovertemplate": "%{y}, %{text}: %{z:.1f} %<extra></extra>",
            "colorscale": HEAT,
            "zmin": 0,
            "zmax": top,
            "xgap": 1,
            "ygap": 2,
            "colorbar": {"ticksuffix": " %", "thickness": 12, "outlinewidth": 0},
            "visible": model == "named",
        }
        for model in ("named", "standard")
    ]


def _heat_layout(columns: Sequence[tuple[str, int]], inputs: Sequence[str]) -> dict[str, Any]:
    ticks, words, headings, lines = [], [], [], []
    for name in inputs:
        places = [k for k, column in enumerate(columns) if column[0] == name]
        title, low, high = INPUTS[name]
        ticks += [places[0], places[-1]]
        words += [low, high]
        middle = 0.5 * (places[0] + places[-1])
        heading = {"x": middle, "y": 1.02, "yref": "paper", "yanchor": "bottom", "showarrow": False}
        headings.append({**heading, "text": f"<b>{title}</b>", "font": {"size": 13}})
        if places[0]:
            edge = {"x0": places[0] - 0.5, "x1": places[0] - 0.5, "y0": 0, "y1": 1, "yref": "paper"}
            lines.append({"type": "line", **edge, "line": {"color": MUTED, "width": 1.5}})
    show = [
        {"label": word, "method": "restyle", "args": ["visible", [model == "named", model != "named"]]}
        for word, model in (("named effects", "named"), ("standard practice", "standard"))
    ]
    menu = {"type": "buttons", "direction": "right", "buttons": show, "x": 0, "xanchor": "left"}
    return {
        "xaxis": {"tickvals": ticks, "ticktext": words, "showgrid": False, "tickangle": 0},
        "yaxis": {"autorange": "reversed", "type": "category", "showgrid": False, "ticks": ""},
        "annotations": headings,
        "shapes": lines,
        "updatemenus": [
            {**menu, "y": 1.14, "yanchor": "bottom", "bgcolor": "#ffffff", "bordercolor": "#c8ced6"}
        ],
        "margin": {"l": 56, "r": 12, "t": 72, "b": 30},
    }


def _where_words(result: Mapping[str, Any]) -> str:
    """Where the gap was, in a sentence."""
    joints = sorted(result["where"]["joints"], key=lambda w: -(w["share"] or 0.0))[:2]
    inputs = [w for w in result["where"]["inputs"][:2] if (w["share"] or 0.0) >= 0.1]
    text = "Of what standard practice left, " + " and ".join(
        f"{100 * w['share']:.0f} % was at {escaped(w['joint'])}" for w in joints
    )
    if inputs:
        text += f"; it was least even over {' and '.join(w['input'] for w in inputs)}"
    return text + ". White: no error; empty parts had too little motion."


def orders_sentence(orders: Sequence[Mapping[str, Any]]) -> str:
    """What is left and repeats with the turn of a joint, by joint; empty where nothing does."""
    if not orders:
        return ""
    waves = [
        f"{o['joint']} {o['order']:g} a turn{' with the direction of motion' if o['with_direction'] else ''}"
        f" ({figures_text(o['amplitude'])} {o['unit']}, {_percent(100.0 * o['share'])} of what is left there)"
        for o in orders
    ]
    return (
        f"What is left repeats over the joint's angle: {_listed(waves)}. So often a motor turns behind a gear"
        " of that ratio; behind a harmonic drive half as often."
    )


# ---- What is unknown, not told apart, not tested ---------------------------------------------------
def _unknown(page: Page, result: Mapping[str, Any]) -> None:
    if not result["unknown"]:
        return
    page.add(
        '<section class="card"><h2>What no known effect explains <span class="muted">free functions of'
        " what was"
        ' recorded, 2 standard errors</span></h2><div class="multiples">'
    )
    for number, unknown in enumerate(result["unknown"]):
        curve = np.array([[np.nan if v is None else v for v in p] for p in unknown["curve"]])
        if curve.size:
            _unknown_chart(page, unknown, curve, number)
    page.add("</div>")
    items = "".join(
        f"<li>{escaped(u['joint'])}: goes with {escaped(_listed(u['inputs']))},"
        f" {figures_text(u['rms_Nm'] or 0.0)}"
        f" Nm rms, removes {100 * (u['share'] or 0.0):.1f} %"
        f" ({escaped(sure_text(u['probability']))} sure)</li>"
        for u in result["unknown"]
    )
    page.add(f'<ul class="plain">{items}</ul></section>')


def _unknown_chart(page: Page, unknown: Mapping[str, Any], curve: Floats, number: int) -> None:
    x, y, sigma = curve.T
    band = {
        "type": "scatter",
        "mode": "lines",
        "x": packed(np.concatenate([x, x[::-1]])),
        "y": packed(np.concatenate([y + BAND * sigma, (y - BAND * sigma)[::-1]])),
        "fill": "toself",
        "fillcolor": faded(UNKNOWN, 0.2),
        "line": {"width": 0},
        "hoverinfo": "skip",
    }
    line = {"type": "scatter", "mode": "lines", "x": packed(x), "y": packed(y)}
    layout = {
        "title": {"text": unknown["joint"]},
        "xaxis": {
            "title": {"text": ", ".join(unknown["inputs"])},
            "tickvals": [float(x[0]), float(x[-1])],
            "ticktext": ["low", "high"],
        },
        "yaxis": {"title": {"text": "torque [Nm]"}},
    }
    page.chart(
        f"unknown{number}", [band, {**line, "line": {"color": UNKNOWN, "width": 2.2}}], layout, "curve"
    )


def _classes(result: Mapping[str, Any]) -> str:
    items = "".join(f'<div class="apart">{escaped(c["sentence"])}</div>' for c in result["classes"])
    return (
        f'<section class="card"><h2>What these recordings cannot tell apart</h2>{items}</section>'
        if items
        else ""
    )


def _not_testable(result: Mapping[str, Any]) -> str:
    """One line for each reason."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for n in result["not_testable"]:
        reasons.setdefault((n["effect"], without_joint_number(n["why"])), []).extend(n["joints"])
    lines = "".join(
        f'<tr><td>{escaped(effect.replace("_", " "))}</td><td class="wrap">{escaped(", ".join(joints))}</td>'
        f'<td class="wrap">{escaped(why)}</td></tr>'
        for (effect, why), joints in reasons.items()
    )
    return (
        '<section class="card"><h2>What these recordings could not show</h2><div class="scroll"><table'
        f' class="causes"><tbody>{lines}</tbody></table></div></section>'
        if lines
        else ""
    )


def without_joint_number(why: str) -> str:
    """Reasons that differ in the number of a column alone are one: "temp3_C" is any joint's "temp1_C"."""
    return re.sub(r"\b(temp|qd|q|tau|i)[0-9]+_", r"\g<1>1_", why)
