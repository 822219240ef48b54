# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of ``truing performance report``: its first part prints on one page of A4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import AFTER, BEFORE, INK, MUTED
from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.scene import Scene3d, polyline
from truing.report.words import angle_text, counted, escaped, figures_text, length_text

Floats = NDArray[np.float64]
Row = Mapping[str, Any]

NAMES = {
    "AP": "pose accuracy",
    "RP": "pose repeatability",
    "vAP": "variation over directions",
    "AD": "distance accuracy",
    "RD": "distance repeatability",
    "AT": "path accuracy",
    "RT": "path repeatability",
    "dAP": "drift of pose accuracy",
    "dRP": "drift of pose repeatability",
    "travel": "motion while warming up",
}
PLUS_MINUS = ("RD", "RP_a", "RP_b", "RP_c")  # which the standard writes with a sign of plus or minus
_COLOURS = (BEFORE, AFTER, "#1e7a46", "#7a4aa0", MUTED)


def performance_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing performance report`` from what ``result.json`` holds."""
    page = Page(f"{result['robot'] or 'Robot'}: performance", part_of_page("performance"))
    labels = [column["label"] for column in result["columns"]]
    conditions = conditions_of(result["quantities"])
    kicker = ("truing performance", escaped(result["robot"]), escaped(result["standard"]))
    page.add(
        f'<header><p class="kicker">{" · ".join(filter(None, kicker))}</p><h1>{headline(result)}</h1>'
        f'<p class="sub">{_how(result)}</p></header>'
    )
    for number, condition in enumerate(conditions):
        rows = short_rows([row for row in result["quantities"] if condition_of(row) == condition])
        page.add(_table(rows, labels, condition, result, later=number > 0))
    if result["warm_up"]:
        _warm_up(page, result["warm_up"])
    page.add(_not_found(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- In words ----------------------------------------------------------------------------------------------


def condition_of(row: Row) -> tuple[float | None, float | None]:
    """Load and speed [%]."""
    return row["load_percent"], row["speed_percent"]


def conditions_of(rows: Sequence[Row]) -> list[tuple[float | None, float | None]]:
    """Largest load and speed first."""
    found = {condition_of(row) for row in rows}
    return sorted(found, key=lambda pair: tuple(-(value or 0.0) for value in pair))


def condition_text(condition: tuple[float | None, float | None], result: Mapping[str, Any]) -> str:
    """ "100 % of the rated load (10 kg), 50 % of the rated speed" """
    words = []
    for percent, noun, key, unit in zip(
        condition, ("load", "speed"), ("load_kg", "speed_m_s"), ("kg", "m/s"), strict=True
    ):
        rated = result["rated"][key]
        if percent is None:
            words.append(f"{noun} not said")
        else:
            size = "" if rated is None else f" ({figures_text(rated * percent / 100)} {unit})"
            words.append(f"{percent:g} % of the rated {noun}{size}")
    return ", ".join(words)


def value_text(value: float, unit: str) -> str:
    return length_text(value) if unit == "m" else angle_text(value)


def interval_text(ci: Sequence[float]) -> str:
    """ "0.021 … 0.034": in the unit that `fixed_text` has."""
    return f"{ci[0] * 1e3:.3f} … {ci[1] * 1e3:.3f}"


def fixed_text(value: float, unit: str) -> str:
    """With thousandths of a millimetre or a milliradian: numbers of a table stand below each other."""
    return f"{value * 1e3:.3f}\u202f{'mm' if unit == 'm' else 'mrad'}"


def quantity_text(name: str) -> str:
    """ "pose accuracy, angle" """
    stem, _, letter = name.partition("_")
    return NAMES[stem] + (", angle" if letter else "")


def largest(rows: Sequence[Row], name: str, label: str) -> Row | None:
    """The row with the largest value of one column."""
    there = [row for row in rows if row["quantity"] == name and label in row["values"]]
    return max(there, key=lambda row: abs(row["values"][label]["value"]), default=None)


def headline(result: Mapping[str, Any]) -> str:
    """The largest pose accuracy and repeatability, first column and last."""
    labels = [column["label"] for column in result["columns"]]
    first = conditions_of(result["quantities"])[0]
    rows = [row for row in result["quantities"] if condition_of(row) == first]
    names = [name for name in ("AP", "RP") if any(largest(rows, name, label) for label in labels)]
    parts = []
    for name in names or list(dict.fromkeys(row["quantity"] for row in rows))[:2]:
        ends = [row for label in (labels[0], labels[-1]) if (row := largest(rows, name, label))]
        if not ends:
            continue
        texts = [
            value_text(abs(row["values"][label]["value"]), row["unit"])
            for label in (labels[0], labels[-1])
            if (row := largest(rows, name, label))
        ]
        arrow = f'<span class="before">{texts[0]}</span> → ' if len(labels) > 1 and len(texts) > 1 else ""
        parts.append(f'{name} {arrow}<span class="after">{texts[-1]}</span>')
    return ", ".join(parts) + " at the worst pose." if names else ", ".join(parts) + "."


def _how(result: Mapping[str, Any]) -> str:
    instrument = result["instrument"]
    words = []
    if instrument["name"] or instrument["uncertainty_m"] is not None:
        name = escaped(instrument["name"] or "the instrument")
        size = [
            text
            for text in (
                None if instrument["uncertainty_m"] is None else length_text(instrument["uncertainty_m"]),
                None if instrument["uncertainty_rad"] is None else angle_text(instrument["uncertainty_rad"]),
            )
            if text
        ]
        words.append(f"Measured by {name}" + (f", uncertainty {' and '.join(size)} (k = 2)" if size else ""))
    else:
        words.append("The instrument and its uncertainty are not said")
    if result["measured_point"]:
        words.append(f"measured point: {escaped(result['measured_point'])}")
    temperatures = [t for course in result["warm_up"] for t in course["temp_C"] or () if t is not None]
    if temperatures:
        words.append(f"{min(temperatures):.1f} to {max(temperatures):.1f} °C while warming up")
    aligned = [column for column in result["columns"] if column["aligned"]]
    if aligned:
        words.append(
            "the instrument's frame was fitted to the commanded poses: AP leaves out what a rigid motion"
            " explains"
        )
    return "; ".join(words) + "."


# ---- Tables ------------------------------------------------------------------------------------------------


def short_rows(rows: Sequence[Row]) -> list[Row]:
    """As they are, but of the angles the largest alone: nine of them a pose would hide the rest."""
    kept = [row for row in rows if "_" not in row["quantity"]]
    for stem in ("AP", "RP"):
        angles = [row for row in rows if row["quantity"].startswith(f"{stem}_")]
        if angles:
            kept.append(max(angles, key=lambda row: max(abs(v["value"]) for v in row["values"].values())))
    order = {name: place for place, name in enumerate(NAMES)}
    return sorted(kept, key=lambda row: (order[row["quantity"].split("_")[0]], "_" in row["quantity"]))


def _table(
    rows: Sequence[Row],
    labels: Sequence[str],
    condition: tuple[float | None, float | None],
    result: Mapping[str, Any],
    later: bool,
) -> str:
    """Quantities down, columns of the test across."""
    body, before = [], ""
    for row in rows:
        name = quantity_text(row["quantity"])
        symbol = _symbol(row["quantity"])
        clause = f' <small class="muted">{row["clause"]}</small>' if row["clause"] else ""
        shown = "" if name == before else f"<b>{escaped(symbol)}</b> {escaped(name)}{clause}"
        cells = "".join(_cell(row, label) for label in labels)
        tone = "" if name == before else ' class="new"'
        body.append(f"<tr{tone}><th>{shown}</th><td class='at'>{escaped(row['at'])}</td>{cells}</tr>")
        before = name
    head = "".join(f"<th>{escaped(label)}</th><th class='ci'>95 %</th>" for label in labels)
    floor = any(value["at_floor"] for row in rows for value in row["values"].values())
    note = (
        "† at the instrument's floor: its uncertainty is more than a quarter of the value, which says of the"
        " robot only that it is no larger. "
        if floor
        else ""
    )
    cycles = _cycles(rows)
    return (
        f'<section class="card{" later" if later else ""}"><h2>{condition_text(condition, result)}</h2><div'
        f' class="scroll"><table class="iso"><thead><tr><th>characteristic</th><th class="at">at</th>{head}'
        f'</tr></thead><tbody>{"".join(body)}</tbody></table></div><p class="note">{note}{cycles}Intervals:'
        " bootstrap, 95 %. Of the angles the largest stands here; result.json has all.</p></section>"
    )


def _symbol(name: str) -> str:
    """ "AP a" as the standard's index; what is not in it has no symbol."""
    return "" if name == "travel" else name.replace("_", " ")


def _cell(row: Row, label: str) -> str:
    if label not in row["values"]:
        return "<td>–</td><td class='ci'></td>"
    value = row["values"][label]
    sign = "±" if row["quantity"] in PLUS_MINUS else ""
    mark = " †" if value["at_floor"] else ""
    tone = ' class="floor"' if value["at_floor"] else ""
    return (
        f"<td{tone}>{sign}{fixed_text(value['value'], row['unit'])}{mark}</td>"
        f"<td class='ci'>{interval_text(value['ci'])}</td>"
    )


def _cycles(rows: Sequence[Row]) -> str:
    """ "Cycles: AP 30, RT 10." """
    found: dict[str, set[int]] = {}
    for row in rows:
        name = "motion" if row["quantity"] == "travel" else row["quantity"].split("_")[0]
        found.setdefault(name, set()).update(value["cycles"] for value in row["values"].values())
    by_count: dict[str, list[str]] = {}
    for name, counts in found.items():
        text = str(min(counts)) if len(counts) == 1 else f"{min(counts)} to {max(counts)}"
        by_count.setdefault(text, []).append(name)
    return "Cycles: " + "; ".join(f"{', '.join(names)} {text}" for text, names in by_count.items()) + ". "


# ---- Warm-up -----------------------------------------------------------------------------------------------


def _warm_up(page: Page, courses: Sequence[Row]) -> None:
    """How far the mean position went over the warm-up, and what compensation would leave of it."""
    page.add('<section class="card warm"><h2>Warming up</h2>')
    traces: list[dict[str, Any]] = []
    for number, course in enumerate(courses):
        colour = _COLOURS[number % len(_COLOURS)]
        hours = [value / 3600 for value in course["t_s"]] if "t_s" in course else course["block"]
        name = f"{course['label']}, {course['pose']}"
        traces.append(_line(hours, course["travel_m"], name, colour, "solid"))
        if course["compensated_m"]:
            traces.append(_line(hours, course["compensated_m"], f"{name}, compensated", colour, "dot"))
    page.chart(
        "warm-up",
        traces,
        {
            "xaxis": {"title": {"text": "time [h]" if "t_s" in courses[0] else "blocks since the first"}},
            "yaxis": {"title": {"text": "from the first block [mm]"}, "rangemode": "tozero"},
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.16, "x": 0},
        },
        size="warming",
    )
    words = "; ".join(dict.fromkeys(_thermal_words(course) for course in courses))
    page.add(f'<p class="note">{words}.</p></section>')


def _line(x: Sequence[float], metres: Sequence[float], name: str, colour: str, dash: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "x": list(x),
        "y": [1e3 * value for value in metres],
        "name": name,
        "line": {"color": colour, "width": 2, "dash": dash},
        "marker": {"color": colour, "size": 5},
    }


def _thermal_words(course: Row) -> str:
    if course["compensated_m"] is None:
        return f"Thermal effects were not fitted: {escaped(course['not_compensated_because'])}"
    names = ", ".join(escaped(name) for name in course["thermal_effects"])
    return (
        f"{escaped(course['label'])}, {escaped(course['pose'])}: moved by up to"
        f" {length_text(max(course['travel_m']))}; with the thermal effects of the catalogue compensated,"
        " each block predicted from others, by up to"
        f" {length_text(max(course['compensated_m']))} ({names})"
    )


def _not_found(result: Mapping[str, Any]) -> str:
    """What the measurements do not give; the same reason at several places is said once."""
    together: dict[tuple[str, str], list[str]] = {}
    for one in result["not_found"]:
        places = together.setdefault((one["quantity"], one["why"]), [])
        if one["at"] not in places:
            places.append(one["at"])
    items = "".join(
        f"<li><b>{escaped(name)}</b> at {escaped(', '.join(places))}: {escaped(why)}</li>"
        for (name, why), places in together.items()
    )
    return (
        f'<section class="card"><h2>Not found</h2><ul class="plain">{items}</ul></section>' if items else ""
    )


# ---- The plan ----------------------------------------------------------------------------------------------


def performance_plan_report(
    result: Mapping[str, Any], names: Sequence[str], paths: Sequence[str], positions: Floats
) -> str:
    """The report of ``truing performance plan``. positions: shape=(n, 3) [m] of the poses in the base."""
    page = Page(f"{result['robot'] or 'Robot'}: performance test", part_of_page("performance"))
    cube = result["cube"]
    centre = np.array(cube["centre_m"])
    place = ", ".join(length_text(value) for value in cube["centre_m"])
    speeds = ", ".join(f"{speed:g}" for speed in result["speeds_percent"])
    page.add(
        f'<header><p class="kicker">truing performance plan · {escaped(result["robot"])} ·'
        f" {escaped(result['standard'])}</p><h1>A cube of"
        f' <span class="after">{length_text(cube["edge_m"])}</span>, {counted(result["sheet_rows"], "row")}'
        f' to measure.</h1><p class="sub">Its centre is at {place} in the robot\'s base. Poses'
        f" {result['cycles']['pose']} times, paths {result['cycles']['path']} times, at {speeds} % of the"
        " rated speed, with the rated load; the warm-up comes first, from cold.</p></header>"
    )
    page.add('<section class="card"><h2>The cube, its poses and paths</h2>')
    scene = Scene3d()
    half = 0.5 * cube["edge_m"]
    scene.add_line(polyline(_edges(centre, half)), "cube", MUTED, 2)
    for path, colour in zip(dict.fromkeys(filter(None, paths)), _COLOURS, strict=False):
        on_path = positions[[one == path for one in paths]]
        scene.add_line(on_path, path, colour, 4)
    single = [k for k, path in enumerate(paths) if not path]
    scene.add_points(
        positions[single],
        "poses",
        5.0,
        INK,
        texts=[names[k] for k in single],
    )
    scene.draw(page, eye=(1.2, -1.6, 0.8), size="cloud")
    page.add("</section>")
    page.add(_poses_table(names, paths, positions))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _edges(centre: Floats, half: float) -> list[Floats]:
    """The twelve edges of a cube, shape=(2, 3) each."""
    corners = [np.array(signs) for signs in product((-1.0, 1.0), repeat=3)]
    return [
        np.array([centre + half * a, centre + half * b])
        for a, b in combinations(corners, 2)
        if np.abs(a - b).sum() == 2
    ]


def _poses_table(names: Sequence[str], paths: Sequence[str], positions: Floats) -> str:
    rows = "".join(
        f"<tr><th>{escaped(name)}</th>{''.join(f'<td>{1e3 * value:.3f}</td>' for value in position)}</tr>"
        for name, path, position in zip(names, paths, positions, strict=True)
        if not path
    )
    return (
        '<section class="card"><h2>Commanded poses, in the base</h2><div class="scroll"><table'
        ' class="iso"><thead><tr><th>pose</th><th>x [mm]</th><th>y [mm]</th><th>z [mm]</th></tr></thead>'
        f'<tbody>{rows}</tbody></table></div><p class="note">P1.1 … are where approaches begin, along x, y,'
        " z of the base. Orientations and the points of the paths are in poses.csv. Look through the programs"
        " at low speed first: collisions are not known here.</p></section>"
    )
