# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What simulated motion says, as parts of a report and lines of a table: simulated and real motion drawn over
each other, and how far apart they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.arrays import outline
from truing.report.charts import AFTER, BEFORE, INK, MUTED, packed
from truing.report.page import Page
from truing.report.scene import RobotPicture, Scene3d
from truing.report.words import escaped

Floats = NDArray[np.float64]
NOMINAL, ALONE = "#98a2ad", "#1e8a6e"
MODELS = {
    "nominal": ("nominal", NOMINAL),
    "standard": ("standard", BEFORE),
    "named": ("named", AFTER),
    "exported": ("exported", ALONE),
}
KEYS = {
    "nominal": "nominal model",
    "standard": "standard practice",
    "named": "named effects",
    "exported": "the written file alone",
}
_BUTTONS, _LETTERS = 8, 60  # side by side above a chart; more are a menu
_DRIVEN = {
    "torques": "are driven by the measured torques alone; errors grow even of a perfect model. Named: with"
    " all laws, callbacks.py too. Exported: the written file alone.",
    "commands": "are driven by the recorded commands. Named: the drives with all their laws. Exported: the"
    " written file, by MuJoCo alone.",
}
LINE_POINTS = 800  # of a line over time: more are not seen
HEADROOM = 0.6  # of the measured motion's range that simulations may leave it by and still be seen
TURN = 2.0 * math.pi  # [rad] a simulation that is so far off has left
FAR = 100.0  # [m] the same


def _low_passed(result: Mapping[str, Any]) -> str:
    """Of torques that were low-passed before they were recorded: what drives the models is incomplete."""
    ends = [one["value"] for one in result.get("sanity", ()) if one["finding"] == "torques_low_passed"]
    if not ends:
        return ""
    return (
        f" These torques end at {ends[0]:.2g} Hz: what friction takes while a joint turns is not in them, so"
        " part of the errors may be the recording's."
    )


def rollout_card(
    page: Page,
    result: Mapping[str, Any],
    paths: Sequence[Mapping[str, Any]],
    arm: RobotPicture | None = None,
) -> None:
    """Motion of one joint over time, buttons choose it; errors in a table beside it; the arm, played."""
    found = result["rollout"]
    if found["why_not"]:
        page.add(
            '<section class="card"><h2>Simulated motion</h2><p>Not judged by motion:'
            f" {escaped(found['why_not'])}.</p></section>"
        )
        return
    page.add('<div class="first">')
    models = {model: MODELS[model] for model in found["held_out"]}
    of = found["held_out"].get("standard", found["held_out"]["exported"])
    motion_chart(page, paths, models, KEYS, worst_first(of, found["horizon_s"]))
    page.add(
        '<section class="card"><h2>Simulated less real motion <span class="muted">held out, rms</span></h2>'
    )
    page.add(error_table(found, "held_out", MODELS))
    page.add(
        f'<p class="note">{found["windows"]} simulations of each model (MuJoCo) begin at measured states and'
        f" {_DRIVEN[result.get('driven_by', 'torques')]}{_low_passed(result)}</p>"
    )
    items = "".join(
        f'<div class="apart">{escaped(text[:1].upper() + text[1:])}.</div>' for text in found["worse"]
    )
    page.add(f"{items}</section></div>")
    arm_card(page, arm)


def arm_card(page: Page, arm: RobotPicture | None) -> None:
    """The recorded arm and the simulated one over each other."""
    if arm is None:
        return
    page.add('<section class="card"><h2>The recorded arm and the simulated one</h2>')
    scene = Scene3d()
    scene.set_robot(arm)
    scene.draw(page, eye=(1.3, -1.3, 0.7), size="cloud", name="arm")
    page.add("</section>")


def worst_first(errors: Mapping[str, Sequence[float]], horizons: Sequence[float]) -> list[str]:
    """Joints by their error at the middle horizon."""
    return sorted(errors, key=lambda joint: -(errors[joint][len(horizons) // 2] or 0.0))


def response_card(
    page: Page,
    found: Mapping[str, Any],
    paths: Sequence[Mapping[str, Any]],
    arm: RobotPicture | None = None,
) -> None:
    """What ``predict --simulate`` adds: the motion of one joint, and the error of every one."""
    errors = found["errors"]
    order = sorted(errors, key=lambda joint: -(errors[joint]["rms"] or 0.0))
    motion_chart(page, paths, {"named": ("simulated", AFTER)}, {"named": "simulated"}, order)
    rows = "".join(
        f"<tr><td>{escaped(joint)}</td><td>{error_text(e['rms'], e['unit'])}</td>"
        f"<td>{error_text(e['end_rms'], e['unit'])}</td></tr>"
        for joint, e in errors.items()
    )
    page.add(
        '<section class="card"><h2>Simulated less measured motion <span class="muted">'
        f"{found['windows']} windows of {found['horizon_s']:g} s</span></h2>"
        '<div class="scroll"><table><thead><tr><th></th><th>rms</th><th>rms at their ends</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div></section>"
    )
    arm_card(page, arm)


# ---- Table -----------------------------------------------------------------------------------------
def error_text(value: float | None, unit: str) -> str:
    """Degrees or millimetres; "left" where a simulation went away."""
    if value is None or value >= (TURN if unit == "rad" else FAR):
        return "left"
    return f"{math.degrees(value):.2f}°" if unit == "rad" else f"{1e3 * value:.2f} mm"


def main_horizon(horizons: Sequence[float]) -> int:
    """The number of the one that tables are of: half a second, or what is next to it."""
    return min(range(len(horizons)), key=lambda k: abs(horizons[k] - 0.5))


def rollout_lines(found: Mapping[str, Any], key: str = "held_out") -> tuple[list[list[str]], list[list[str]]]:
    """Rms of every joint at the main horizon; and the median of the worst joint at every horizon. A column
    for each model."""
    horizons, errors, units = found["horizon_s"], found[key], found["units"]
    main = main_horizon(horizons)
    unit = "rad" if "rad" in units.values() else "m"
    joints = [[j, *(error_text(e[j][main], units[j]) for e in errors.values())] for j in units]
    medians = found["worst_joint_median"]
    worst = [
        [f"{h:g} s", *(error_text(medians[model][k], unit) for model in errors)]
        for k, h in enumerate(horizons)
    ]
    return joints, worst


def error_table(found: Mapping[str, Any], key: str, models: Mapping[str, tuple[str, str]]) -> str:
    """The same lines in HTML."""
    head = "".join(f"<th>{escaped(models[model][0])}</th>" for model in found[key])
    main = found["horizon_s"][main_horizon(found["horizon_s"])]
    joints, worst = rollout_lines(found, key)
    groups = ((f"rms, {main:g} s ahead", joints), ("worst joint, median", worst))
    rows = ""
    for title, lines in groups:
        rows += f'<tr><td class="held" colspan="{1 + len(found[key])}">{title}</td></tr>'
        for label, *cells in lines:
            numbers = "".join(f"<td>{escaped(cell)}</td>" for cell in cells)
            rows += f"<tr><td>{escaped(label)}</td>{numbers}</tr>"
    return (
        f'<div class="scroll"><table class="tight"><thead><tr><th></th>{head}</tr></thead><tbody>{rows}'
        "</tbody></table></div>"
    )


# ---- Motion over time --------------------------------------------------------------------------------
def motion_chart(
    page: Page,
    paths: Sequence[Mapping[str, Any]],
    models: Mapping[str, tuple[str, str]],
    keys: Mapping[str, str],
    order: Sequence[str],
) -> None:
    """Measured and simulated motion drawn over each other, joints to choose."""
    by_joint = {path["joint"]: path for path in paths}
    joints = [joint for joint in order if joint in by_joint]
    drawn: list[dict[str, Any]] = []
    owners: list[str] = []
    for joint in joints:
        traces = _traces(by_joint[joint], models)
        drawn += [{**trace, "visible": joint == joints[0]} for trace in traces]
        owners += [joint] * len(traces)
    first = by_joint[joints[0]]
    page.add(
        '<section class="card"><h2>Simulated and real motion <span class="muted">'
        f"{escaped(first['recording'])}; at every dot the simulations begin</span></h2>"
    )
    commanded = '<i class="commanded"></i>commanded' if "commanded" in first else ""
    page.add(
        f'<p class="key"><i class="measured"></i>measured{commanded}'
        + "".join(
            f'<i class="{model}{" dash" if model == "nominal" else ""}"></i>{escaped(keys[model])}'
            for model in models
        )
        + "</p>"
    )
    page.chart("motion", drawn, _layout(joints, by_joint, owners), size="trace")
    page.add("</section>")


def _traces(path: Mapping[str, Any], models: Mapping[str, tuple[str, str]]) -> list[dict[str, Any]]:
    low, high = _range(path)
    measured = {"name": "measured", "line": {"color": INK, "width": 2.6}}
    lines = [(path["time"], path["measured"], measured)]
    if "commanded" in path:
        dashed = {"color": MUTED, "width": 1.2, "dash": "dash", "shape": "hv"}
        lines.insert(0, (path["time"], path["commanded"], {"name": "commanded", "line": dashed}))
    for model, (name, colour) in models.items():
        line = {"color": colour, "width": 1.8, "dash": "dot" if model == "nominal" else "solid"}
        lines.append((path["ahead"], _seen(path, model, low, high), {"name": name, "line": line}))
    begun = np.flatnonzero(np.isnan(np.concatenate([[np.nan], path["ahead"][:-1]])))
    at = np.asarray(path["ahead"])[begun]
    dots = np.interp(at, path["time"], path["measured"])
    return [_drawn_line(np.asarray(x), np.asarray(y), more) for x, y, more in lines] + [
        {
            "type": "scatter",
            "mode": "markers",
            "x": packed(at),
            "y": packed(dots),
            "name": "start",
            "marker": {"color": INK, "size": 7},
            "hoverinfo": "skip",
        }
    ]


def _drawn_line(x: Floats, y: Floats, more: Mapping[str, Any]) -> dict[str, Any]:
    pick = outline(y, LINE_POINTS)
    return {"type": "scatter", "mode": "lines", "x": packed(x[pick]), "y": packed(y[pick]), **more}


def _seen(path: Mapping[str, Any], model: str, low: float, high: float) -> Floats:
    """A model's path, of every window up to where it leaves the picture."""
    out = np.array(path["simulated"][model])
    left = False
    for k, (time, value) in enumerate(zip(path["ahead"], out, strict=True)):
        left = not math.isnan(time) and (left or not low < value < high)
        if left:
            out[k] = math.nan
    return out


def _range(path: Mapping[str, Any]) -> tuple[float, float]:
    low, high = float(np.nanmin(path["measured"])), float(np.nanmax(path["measured"]))
    more = HEADROOM * max(high - low, 1e-3)
    return low - more, high + more


def _axis(path: Mapping[str, Any]) -> dict[str, Any]:
    """What a button of a joint changes."""
    return {"yaxis.range": list(_range(path)), "yaxis.title.text": f"{path['joint']} [{path['unit']}]"}


def _layout(
    joints: Sequence[str], by_joint: Mapping[str, Mapping[str, Any]], owners: Sequence[str]
) -> dict[str, Any]:
    buttons = [
        {
            "label": joint,
            "method": "update",
            "args": [
                {"visible": [owner == joint for owner in owners]},
                _axis(by_joint[joint]),
            ],
        }
        for joint in joints
    ]
    first = by_joint[joints[0]]
    return {
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"title": {"text": f"{joints[0]} [{first['unit']}]"}, "range": list(_range(first))},
        "updatemenus": joint_menu(buttons),
        "margin": {"l": 56, "r": 12, "t": 44, "b": 44},
    }


def joint_menu(buttons: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Buttons above a chart, or a list where they are many; none to choose from one."""
    menu = {
        "type": "buttons",
        "direction": "right",
        "buttons": buttons,
        "x": 0,
        "xanchor": "left",
        "y": 1.02,
        "yanchor": "bottom",
        "pad": {"t": 0, "b": 4},
        "bgcolor": "#ffffff",
        "bordercolor": "#c8ced6",
        "font": {"size": 12},
    }
    if len(buttons) > _BUTTONS or sum(len(b["label"]) for b in buttons) > _LETTERS:
        menu["type"] = "dropdown"
    return [menu] if len(buttons) > 1 else []
