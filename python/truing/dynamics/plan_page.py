# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of ``truing dynamics plan``: what recordings along the planned motion could show.

First: how many effects would show, and how much better than along a random motion; the motion; the smallest
size of every effect. Below: what would stay together and what parts it; what would not show, and why.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.page import without_joint_number
from truing.report.charts import AFTER, BEFORE, MUTED, packed
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.words import counted, escaped, figures_text

Floats = NDArray[np.float64]
_SHOWN = 0.05  # of a unit: less is shown in a smaller one
_DRAWN = 1500  # points of a line: a chart is no wider
PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"))


def plan_report(result: Mapping[str, Any], time: Floats, position: Floats, units: Sequence[str]) -> str:
    """result: what ``result.json`` holds. time: shape=(n,) [s]. position: shape=(n, joints) [rad | m].
    units: of every joint, "rad" or "m".
    """
    page = Page(f"{result.get('robot') or 'Robot'}: motion plan", part_of_page("dynamics"))
    page.add(_headline(result))
    page.add('<div class="first">')
    _motion(page, result["joints"], time, position, units)
    page.add(_to_record(result))
    page.add("</div>")
    _sizes(page, result)
    page.add(_separated(result["separated"]))
    page.add(_alike(result["planned"]["alike"]))
    page.add(_not_testable("What these recordings could not show", result["planned"]["not_testable"]))
    if "given" in result:
        page.add(_given(result["given"]))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def label(effect: str, joints: Sequence[str]) -> str:
    """ "coupling J5, J6" """
    return f"{effect.replace('_', ' ')} {', '.join(joints)}".rstrip()


def size_text(value: float | None, unit: str) -> str:
    """A size in its unit: "0.12 Nm", "23 mrad"; no size: "never"."""
    if value is None:
        return "never"
    if unit in ("", "-"):
        return f"{figures_text(100 * value, 2)} %"
    if " " not in unit and "/" not in unit:
        for factor, prefix in PREFIXES:
            if abs(value) * factor >= _SHOWN:
                return f"{figures_text(value * factor, 2)} {prefix}{unit}"
    return f"{figures_text(value, 2)} {unit}"


def ratios(result: Mapping[str, Any]) -> dict[str, list[float]]:
    """By effect, joint by joint: the size that shows along the planned motion over that along the random one;
    of effects to be told apart the sizes from which they are.
    """
    field = "size_apart" if result["separated"] else "size"
    random = {(e["effect"], *e["joints"], e["parameter"]): e[field] for e in result["random"]["effects"]}
    out: dict[str, list[float]] = {}
    for e in result["planned"]["effects"]:
        before = random.get((e["effect"], *e["joints"], e["parameter"]))
        if before is not None and e[field] is not None:
            out.setdefault(e["effect"], []).append(e[field] / before)
    return out


def ratio_of(result: Mapping[str, Any]) -> float | None:
    """The median of these; None: no effect shows along both motions."""
    every = [value for values in ratios(result).values() for value in values]
    return float(np.median(every)) if every else None


def _headline(result: Mapping[str, Any]) -> str:
    effects = result["planned"]["effects"]
    apart = sum(e["size_apart"] is not None for e in effects)
    ratio = ratio_of(result)
    what = "told apart" if result["separated"] else "seen"
    better = (
        ""
        if ratio is None
        else f"To be {what} they need {100 * ratio:.0f} % of the size that they need along a random motion as"
        " long (median)."
    )
    return (
        f'<header><p class="kicker">truing dynamics plan · {escaped(result.get("robot"))}</p>'
        f"<h1>{result['duration_s']:g} s of motion show {counted(len(effects), 'effect')}, and"
        f' tell <span class="after">{apart}</span> from all others</h1>'
        f'<p class="sub">{better} Each effect at each joint counts once. Seen: beside link inertias, Coulomb'
        " and viscous friction and an offset, which are fitted in any case.</p></header>"
    )


def _motion(page: Page, joints: Sequence[str], time: Floats, position: Floats, units: Sequence[str]) -> None:
    page.add('<section class="card"><h2>The motion <span class="muted">motion.csv</span></h2>')
    scale = [180.0 / math.pi if unit == "rad" else 1e3 for unit in units]
    step = max(1, len(time) // _DRAWN)
    lines = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": packed(time[::step]),
            "y": packed(position[::step, k] * scale[k]),
            "name": name,
            "line": {"width": 1.6},
        }
        for k, name in enumerate(joints)
    ]
    words = {"rad": "angle [°]", "m": "position [mm]"}
    title = " or ".join(words[unit] for unit in dict.fromkeys(units))
    layout = {
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"title": {"text": title}},
        "showlegend": True,
        "legend": {"orientation": "h", "y": 1.1, "x": 0},
    }
    page.chart("motion", lines, layout, "trace")
    page.add("</section>")


def _to_record(result: Mapping[str, Any]) -> str:
    items = "".join(f"<li>{escaped(words)}</li>" for words in runs_in_words(result))
    noise = ", ".join(
        f"{escaped(joint)} {figures_text(value, 2)}" for joint, value in result["torque_noise_Nm"].items()
    )
    nats = result["information_nats"]
    return (
        f'<section class="card"><h2>What to record</h2><ul class="plain">{items}</ul>'
        "<p>Repeat them, and mark one of each as test (column <code>set</code>).</p>"
        f'<p class="note">Sizes are for torque noise of {noise} Nm (or N). {result["evaluated"]} motions were'
        f" looked at; the random one gives {nats['random']:.0f} nats, the planned one {nats['planned']:.0f}."
        "</p></section>"
    )


def runs_in_words(result: Mapping[str, Any]) -> list[str]:
    """The recordings to make: "the motion, with 2 kg at the tool, warm (35 °C)"."""
    warmest = max((r["temp_C"] for r in result["runs"] if r["temp_C"] is not None), default=None)
    out = []
    for run in result["runs"]:
        words = ["the motion"]
        if len({r["payload_kg"] for r in result["runs"]}) > 1:
            load = run["payload_kg"]
            words.append(f"with {load:g} kg at the tool" if load else "without a payload")
        if run["temp_C"] is not None:
            words.append(f"{'warm' if run['temp_C'] == warmest else 'cold'} ({run['temp_C']:g} °C)")
        out.append(", ".join(words))
    return out


def _sizes(page: Page, result: Mapping[str, Any]) -> None:
    """Sizes beside those along a random motion, and the table of sizes."""
    effects = result["planned"]["effects"]
    if not effects:
        return
    found = ratios(result)
    names = sorted(found, key=lambda name: float(np.median(found[name])))[::-1]
    what = "told apart" if result["separated"] else "seen"
    page.add(
        '<section class="card"><h2>The smallest effects that would be seen</h2><p class="lead">The size'
        f" from which an effect is {what}, in % of the size that it needs along a random motion as long:"
        " median over the joints, and every joint. Short is good.</p>"
    )
    page.chart(
        "sizes",
        [
            {
                "type": "bar",
                "orientation": "h",
                "y": [name.replace("_", " ") for name in names],
                "x": [100 * float(np.median(found[name])) for name in names],
                "marker": {"color": AFTER},
                "hovertemplate": "%{y}: %{x:.0f} %<extra></extra>",
            },
            {
                "type": "scatter",
                "mode": "markers",
                "y": [name.replace("_", " ") for name in names for _ in found[name]],
                "x": [100 * value for name in names for value in found[name]],
                "marker": {"color": BEFORE, "size": 6, "symbol": "diamond"},
                "hovertemplate": "%{y}: %{x:.0f} %<extra></extra>",
            },
        ],
        {
            "xaxis": {"title": {"text": "size, % of that along a random motion"}, "rangemode": "tozero"},
            "yaxis": {"automargin": True, "showgrid": False, "dtick": 1},
            "shapes": [
                {
                    "type": "line",
                    "x0": 100,
                    "x1": 100,
                    "y0": 0,
                    "y1": 1,
                    "yref": "paper",
                    "line": {"color": MUTED, "width": 1.5, "dash": "dot"},
                }
            ],
            "height": max(240, 26 * len(names) + 80),
        },
        size="free",
    )
    page.add(_size_table(effects))
    page.add("</section>")


def _size_table(effects: Sequence[Mapping[str, Any]]) -> str:
    rows = "".join(
        f"<tr><th>{escaped(label(e['effect'], e['joints']))}</th><td>{escaped(e['parameter'])}</td>"
        f"{table_cell(e['size'], escaped(size_text(e['size'], e['unit'])))}"
        f"{table_cell(e['torque_Nm'], figures_text(e['torque_Nm'], 2) + ' at ' + escaped(e['joint']))}"
        f"<td>{escaped(size_text(e['size_apart'], e['unit']))}</td>"
        f"<td>{escaped(label(e['closest'], e['closest_joints']))}</td>"
        f"{table_cell(e['r2'], format(e['r2'], '.2f'))}</tr>"
        for e in effects
    )
    head = "".join(
        f'<th><button type="button">{name}</button></th>'
        for name in ("effect", "parameter", "seen from", "rms torque [Nm]", "told apart from", "from", "R²")
    )
    return (
        "<details><summary>Every effect at every joint</summary>"
        '<p class="note">Seen from: the size that a diagnosis needs beside the groundwork. Told apart from:'
        " the size that it needs beside the effect that is most like it, which explains R² of it.</p>"
        f'<div class="scroll"><table class="sortable"><thead><tr>{head}</tr></thead><tbody>{rows}'
        "</tbody></table></div></details>"
    )


def _separated(pairs: Sequence[Mapping[str, Any]]) -> str:
    """Pairs that were to be told apart."""
    if not pairs:
        return ""
    rows = "".join(
        f"<tr><th>{escaped(label(p['effect'], p['joints']))}</th>"
        f"<td>{escaped(label(p['other'], p['other_joints']))}</td>"
        f"{table_cell(p['r2'], format(p['r2'], '.3f'))}"
        f'<td class="wrap">{escaped(p["separated_by"].replace("_", " "))}</td></tr>'
        for p in pairs
    )
    head = "".join(f"<th>{name}</th>" for name in ("effect", "explained by", "R²", "what helps further"))
    return (
        '<section class="card"><h2>To be told apart</h2><div class="scroll"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></section>"
    )


def _alike(pairs: Sequence[Mapping[str, Any]]) -> str:
    """What stays together, one line for each pair of effects."""
    groups: dict[tuple[str, str, str], list[str]] = {}
    for p in pairs:
        places = groups.setdefault((p["effect"], p["other"], p["separated_by"]), [])
        both = [", ".join(joints) for joints in (p["joints"], p["other_joints"])]
        places.append(" / ".join(dict.fromkeys(filter(None, both))))
    items = "".join(
        f'<div class="apart"><b>{escaped(a.replace("_", " "))}</b> is not told from'
        f" <b>{escaped(b.replace('_', ' '))}</b>"
        f" ({escaped('; '.join(filter(None, places)) or 'the whole arm')}). To tell: {escaped(how)}.</div>"
        for (a, b, how), places in groups.items()
    )
    return f'<section class="card"><h2>What would stay together</h2>{items}</section>' if items else ""


def reasons(missing: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], list[str]]:
    """Joints by effect and reason; what differs in the number of a joint's column alone is one."""
    out: dict[tuple[str, str], list[str]] = {}
    for n in missing:
        out.setdefault((n["effect"], without_joint_number(n["why"])), []).extend(n["joints"])
    return out


def _not_testable(title: str, missing: Sequence[Mapping[str, Any]]) -> str:
    rows = "".join(
        f'<tr><td>{escaped(effect.replace("_", " "))}</td><td class="wrap">{escaped(", ".join(joints))}</td>'
        f'<td class="wrap">{escaped(why)}</td></tr>'
        for (effect, why), joints in reasons(missing).items()
    )
    return (
        f'<section class="card"><h2>{escaped(title)}</h2><div class="scroll"><table class="causes"><tbody>'
        f"{rows}</tbody></table></div></section>"
        if rows
        else ""
    )


def _given(given: Mapping[str, Any]) -> str:
    """What the recordings that were given can show, and what their columns lack."""
    return (
        '<section class="card"><h2>The recordings that there are</h2>'
        f"<p>They can show {counted(len(given['effects']), 'effect')}.</p>{_size_table(given['effects'])}"
        f"</section>{_alike(given['alike'])}{_not_testable('What they lack', given['not_testable'])}"
    )
