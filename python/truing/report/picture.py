# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Static pictures of charts, as SVG: what a page shows where its script does not run."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.arrays import mixed, outline, subsample, unpacked
from truing.report.words import escaped

Floats = NDArray[np.float64]
USUAL_SIZE = (700, 300)  # [px] of a picture, for its place on the page
SIZES = {"wide": (1200, 340), "tall": (700, 350), "small": (400, 240), "pane": (400, 260), "free": (900, 600)}
MOST_POINTS, MOST_OF_LINE, MOST_CELLS = 250, 300, 2500  # of a trace: a picture is to weigh little
MARGIN = (58, 12, 14, 46)  # [px] left, right, top, bottom
TITLE = 18  # [px] that a title needs
CHARACTER = 6.6  # [px] of the font, about
COLOURS = ("#1f5fa8", "#d98324", "#1b8a6b", "#8a5bb5", "#b3261e", "#5b6673")
VIRIDIS = ("#440154", "#3b528b", "#21918c", "#5ec962", "#fde725")
_TAGS = re.compile(r"</?(?:b|i|br|sub|sup|span|em|strong)\b[^>]*>", re.IGNORECASE)


def plain(text: Any) -> str:
    """Text of a chart (plotly.js reads a few tags and entities in it) as text of the page."""
    return escaped(html.unescape(_TAGS.sub(" ", str(text))).strip())


def number(value: float) -> str:
    """A coordinate: tenths of a pixel are enough."""
    return f"{value:.1f}".removesuffix(".0")


@dataclass
class Axis:
    """Values to pixels."""

    kind: str  # "linear" | "log" | "category"
    low: float
    high: float
    start: float  # [px] where `low` is
    end: float
    names: list[str] = field(default_factory=list)
    spec: Mapping[str, Any] = field(default_factory=dict)

    def numbers(self, values: Any) -> Floats:
        """Values of a trace as numbers along the axis."""
        if self.kind == "category":
            place = {name: k for k, name in enumerate(self.names)}
            return np.array([place[str(v)] for v in _listed(values)], dtype=np.float64)
        read = unpacked(values)
        if self.kind != "log":
            return read
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(read > 0, np.log10(np.abs(read)), np.nan)

    def pixels(self, numbers: Floats) -> Floats:
        """Places of numbers along the axis [px]."""
        span = self.high - self.low or 1.0
        return self.start + (numbers - self.low) / span * (self.end - self.start)

    def ticks(self, room: float) -> list[tuple[float, str]]:
        """Places along the axis and what stands there."""
        if self.kind == "category":
            every = max(1, math.ceil(len(self.names) * 13 / room))
            return [(k, plain(name)) for k, name in enumerate(self.names) if k % every == 0]
        if "tickvals" in self.spec:
            places = [math.log10(v) if self.kind == "log" else v for v in self.spec["tickvals"]]
            return list(zip(places, map(plain, self.spec["ticktext"]), strict=True))
        low, high = sorted((self.low, self.high))
        if self.kind == "log":
            return [(float(k), f"{10.0**k:g}") for k in range(math.ceil(low), math.floor(high) + 1)]
        step = _step((high - low) / max(2.0, room / 80))
        suffix = plain(self.spec.get("ticksuffix", ""))
        first = math.ceil(low / step - 1e-9)
        count = int((high - low) / step + 1e-9) + 1
        values = [step * (first + k) for k in range(count) if step * (first + k) <= high + 1e-9 * step]
        return [(v, f"{v if abs(v) > 1e-9 * step else 0:.6g}{suffix}") for v in values]


def _listed(values: Any) -> list[Any]:
    return unpacked(values).tolist() if isinstance(values, dict) else list(values)


def _step(least: float) -> float:
    if not (least > 0 and math.isfinite(least)):
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    return next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= least * (1 - 1e-9))


def chart_picture(data: Sequence[Mapping[str, Any]], layout: Mapping[str, Any], size: tuple[int, int]) -> str:
    """The chart of a figure of plotly.js: lines, points, bars, heat maps, with axes and names. Traces that
    are hidden at first are left out. `size`: [px].
    """
    width, height = size
    shown = [trace for trace in data if trace.get("visible", True) is True]
    x = _axis(shown, layout, "x")
    y = _axis(shown, layout, "y")
    named = layout.get("showlegend") and [t for t in shown if t.get("name") and t.get("showlegend", True)]
    title = plain((layout.get("title") or {}).get("text", ""))
    names = x.names if x.kind == "category" else []
    left = MARGIN[0] if y.kind != "category" else min(16 + CHARACTER * max(map(len, y.names), default=1), 240)
    low_room = MARGIN[3] + (40 if len(names) * 60 > width else 0)
    top = MARGIN[2] + (TITLE if title or named else 0)
    x.start, x.end = left, width - MARGIN[1]
    y.start, y.end = height - low_room, top
    if "scaleanchor" in (layout.get("yaxis") or {}) and x.kind == y.kind == "linear":
        _equal(x, y)
    parts = [*_frame(x, y, tilted=low_room > MARGIN[3])]
    for number_of, trace in enumerate(shown):
        kind = trace.get("type", "scatter")
        draw = {"bar": _bars, "heatmap": _cells}.get(kind, _scatter)
        parts += draw(trace, x, y, shown, COLOURS[number_of % len(COLOURS)])
    parts += _shapes(layout, x, y) + _notes(layout, x, y)
    if title:
        parts.append(f'<text x="{left}" y="14" font-size="14">{title}</text>')
    if named:
        parts.append(_legend(named, left, width))
    return (
        f'<svg class="picture" viewBox="0 0 {width} {height}" role="img" font-family="sans-serif"'
        f' font-size="12" fill="#1c2530">{"".join(parts)}</svg>'
    )


def _axis(traces: Sequence[Mapping[str, Any]], layout: Mapping[str, Any], letter: str) -> Axis:
    spec = layout.get(f"{letter}axis") or {}
    values = [trace[letter] for trace in traces if letter in trace]
    texts = any(isinstance(v, str) for some in values if not isinstance(some, dict) for v in some)
    if spec.get("type") == "category" or texts:
        names = list(dict.fromkeys(str(v) for some in values for v in _listed(some)))
        axis = Axis("category", -0.5, max(len(names), 1) - 0.5, 0, 1, names, spec)
    else:
        axis = Axis(str(spec.get("type", "linear")), 0.0, 1.0, 0, 1, [], spec)
        if "range" in spec:
            axis.low, axis.high = (float(v) for v in spec["range"])
        else:
            axis.low, axis.high = _ends(axis, traces, letter)
    if spec.get("autorange") == "reversed":
        axis.low, axis.high = axis.high, axis.low
    return axis


def _ends(axis: Axis, traces: Sequence[Mapping[str, Any]], letter: str) -> tuple[float, float]:
    every = [np.zeros(0)]
    for trace in traces:
        if letter not in trace:
            continue
        values = axis.numbers(trace[letter])
        every.append(values)
        along = (trace.get("orientation") == "h") == (letter == "x")
        if trace.get("type") == "bar" and along and axis.kind != "log":
            base = _base(trace, values.size)
            every += [base, base + values]
        if trace.get("fill") == "tozeroy" and letter == "y":
            every.append(np.zeros(1))
    known = np.concatenate(every)
    known = known[np.isfinite(known)]
    if known.size == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    room = 0.05 * (high - low) or 0.5
    return low - (0.0 if low == 0 else room), high + (0.0 if high == 0 else room)


def _base(trace: Mapping[str, Any], size: int) -> Floats:
    base = trace.get("base", 0.0)
    return np.full(size, float(base)) if isinstance(base, (int, float)) else unpacked(base)


def _equal(x: Axis, y: Axis) -> None:
    """One scale on both axes."""
    scale = max((x.high - x.low) / abs(x.end - x.start), (y.high - y.low) / abs(y.end - y.start))
    for axis in (x, y):
        middle, half = 0.5 * (axis.low + axis.high), 0.5 * scale * abs(axis.end - axis.start)
        axis.low, axis.high = middle - half, middle + half


def _frame(x: Axis, y: Axis, tilted: bool) -> list[str]:
    parts = []
    for place, text in x.ticks(abs(x.end - x.start) * (0.25 if x.kind == "category" and not tilted else 1)):
        at = float(x.pixels(np.array(place)))
        if not x.start - 1 <= at <= x.end + 1:
            continue
        parts.append(f'<path d="M{number(at)} {number(y.end)}V{number(y.start)}" stroke="#e6e9ed"/>')
        turn = f' transform="rotate(-35 {number(at)} {number(y.start + 14)})"' if tilted else ""
        anchor = "end" if tilted else "middle"
        parts.append(
            f'<text x="{number(at)}" y="{number(y.start + 16)}" text-anchor="{anchor}"{turn}>{text}</text>'
        )
    for place, text in y.ticks(abs(y.end - y.start)):
        at = float(y.pixels(np.array(place)))
        if not y.end - 1 <= at <= y.start + 1:
            continue
        parts.append(f'<path d="M{number(x.start)} {number(at)}H{number(x.end)}" stroke="#e6e9ed"/>')
        parts.append(f'<text x="{number(x.start - 6)}" y="{number(at + 4)}" text-anchor="end">{text}</text>')
    titles = [plain((axis.spec.get("title") or {}).get("text", "")) for axis in (x, y)]
    middle = number(0.5 * (x.start + x.end)), number(0.5 * (y.start + y.end))
    if titles[0]:
        low = y.start + (70 if tilted else 36)
        parts.append(f'<text x="{middle[0]}" y="{number(low)}" text-anchor="middle">{titles[0]}</text>')
    if titles[1]:
        parts.append(
            f'<text x="13" y="{middle[1]}" text-anchor="middle"'
            f' transform="rotate(-90 13 {middle[1]})">{titles[1]}</text>'
        )
    return parts


def _colour(style: Mapping[str, Any], usual: str) -> str:
    colour = style.get("color", usual)
    return colour if isinstance(colour, str) else usual


def _scatter(
    trace: Mapping[str, Any], x: Axis, y: Axis, _: Sequence[Mapping[str, Any]], usual: str
) -> list[str]:
    px, py = x.pixels(x.numbers(trace["x"])), y.pixels(y.numbers(trace["y"]))
    px, py = px[: py.size], py[: px.size]
    mode = str(trace.get("mode", "lines"))
    parts = []
    if "lines" in mode or trace.get("fill"):
        parts.append(_line(trace, px, py, y, usual))
    if "markers" in mode:
        marker = trace.get("marker") or {}
        known = np.flatnonzero(np.isfinite(px) & np.isfinite(py))
        pick = subsample(known, MOST_POINTS)
        size = marker.get("size", 6)
        radius = (float(size) if isinstance(size, (int, float)) else 6.0) / 2
        colours = _colours(marker, px.size, usual)
        opacity = float(marker.get("opacity", 1.0))
        groups: dict[str, list[str]] = {}
        for k in pick:
            dot = f"M{number(float(px[k]))} {number(float(py[k]))}h0"
            groups.setdefault(colours[k], []).append(dot)
        for colour, dots in groups.items():
            parts.append(
                f'<path d="{"".join(dots)}" stroke="{escaped(colour)}" stroke-opacity="{opacity:g}"'
                f' stroke-width="{number(2 * radius)}" stroke-linecap="round" fill="none"/>'
            )
    if "text" in mode and not isinstance(trace.get("text"), (str, type(None))):
        for at, text in enumerate(trace["text"]):
            parts.append(
                f'<text x="{number(float(px[at]))}" y="{number(float(py[at]) - 7)}"'
                f' text-anchor="middle">{plain(text)}</text>'
            )
    return parts


def _line(trace: Mapping[str, Any], px: Floats, py: Floats, y: Axis, usual: str) -> str:
    style = trace.get("line") or {}
    pieces, current = [], []
    filled = trace.get("fill")
    pick = np.arange(px.size) if filled == "toself" else outline(py, MOST_OF_LINE)
    for k in pick:
        if math.isfinite(px[k]) and math.isfinite(py[k]):
            current.append(f"{number(float(px[k]))} {number(float(py[k]))}")
        elif current:
            pieces.append(current)
            current = []
    pieces += [current] if current else []
    path = "".join("M" + "L".join(piece) for piece in pieces)
    fill = "none"
    if filled and pieces:
        fill = str(trace.get("fillcolor", "rgba(31,95,168,0.2)"))
        if filled == "tozeroy":
            floor = number(
                float(y.pixels(np.array(max(0.0, min(y.low, y.high)) if y.kind != "log" else y.low)))
            )
            first, last = pieces[0][0].split()[0], pieces[-1][-1].split()[0]
            path = f"M{first} {floor}L" + "L".join(p for piece in pieces for p in piece) + f"L{last} {floor}"
    width = float(style.get("width", 2))
    dash = ' stroke-dasharray="5 4"' if style.get("dash") not in (None, "solid") else ""
    stroke = _colour(style, usual) if "lines" in str(trace.get("mode", "lines")) and width else "none"
    return (
        f'<path d="{path}" fill="{escaped(fill)}" stroke="{escaped(stroke)}"'
        f' stroke-width="{number(width)}"{dash} stroke-linejoin="round"/>'
    )


def _scale(spec: Any) -> tuple[str, ...]:
    """The colours of a scale, evenly spaced."""
    if isinstance(spec, (list, tuple)):
        places, colours = zip(*spec, strict=True)
        if all(isinstance(c, str) and re.fullmatch("#[0-9a-f]{6}|#[0-9a-f]{3}", c) for c in colours):
            whole = [c if len(c) == 7 else "#" + "".join(2 * v for v in c[1:]) for c in colours]
            return tuple(_between(places, whole, k / 8) for k in range(9))
    return VIRIDIS


def _between(places: Sequence[float], colours: Sequence[str], at: float) -> str:
    for k in range(1, len(places)):
        if at <= places[k] + 1e-12:
            return mixed(colours[k - 1 : k + 1], (at - places[k - 1]) / ((places[k] - places[k - 1]) or 1.0))
    return colours[-1]


def _colours(marker: Mapping[str, Any], count: int, usual: str) -> list[str]:
    """Of every point."""
    colour = marker.get("color", usual)
    if isinstance(colour, str):
        return [colour] * count
    if isinstance(colour, (list, tuple)) and colour and isinstance(colour[0], str):
        return list(colour)
    values = unpacked(colour)
    low = float(marker.get("cmin", np.nanmin(values) if values.size else 0.0))
    high = float(marker.get("cmax", np.nanmax(values) if values.size else 1.0))
    scale = _scale(marker.get("colorscale"))
    scale = scale[::-1] if marker.get("reversescale") else scale
    fractions = np.nan_to_num(np.round((values - low) / ((high - low) or 1.0) * 16) / 16)
    return [mixed(scale, float(f)) for f in fractions]


def _bars(
    trace: Mapping[str, Any], x: Axis, y: Axis, traces: Sequence[Mapping[str, Any]], usual: str
) -> list[str]:
    lying = trace.get("orientation") == "h"
    across, along = (y, x) if lying else (x, y)
    letters = ("y", "x") if lying else ("x", "y")
    places = across.numbers(trace[letters[0]])
    values = along.numbers(trace[letters[1]])
    base = _base(trace, values.size) if along.kind != "log" else np.full(values.size, along.low)
    ends = base + values if along.kind != "log" else values
    others = np.unique(places[np.isfinite(places)])
    gap = float(np.diff(others).min()) if others.size > 1 else 1.0
    wide = trace.get("width")
    half = 0.36 * gap if not isinstance(wide, (int, float)) else 0.5 * wide
    bars = [t for t in traces if t.get("type") == "bar"]
    if len(bars) > 1 and "base" not in trace and wide is None:  # beside one another
        part = 2 * half / len(bars)
        places = places - half + part * (next(k for k, t in enumerate(bars) if t is trace) + 0.5)
        half = 0.5 * part
    colours = _colours(trace.get("marker") or {}, values.size, usual)
    parts = []
    for k in np.flatnonzero(np.isfinite(places) & np.isfinite(ends))[: MOST_POINTS * 2]:
        sides = sorted(float(v) for v in across.pixels(np.array([places[k] - half, places[k] + half])))
        edge = sorted(float(v) for v in along.pixels(np.array([base[k], ends[k]])))
        left, right, top, bottom = (*edge, *sides) if lying else (*sides, *edge)
        parts.append(
            f'<rect x="{number(left)}" y="{number(top)}" width="{number(right - left)}"'
            f' height="{number(bottom - top)}" fill="{escaped(colours[k])}"/>'
        )
    return parts + _error_bars(trace, places, ends, across, along, lying)


def _error_bars(
    trace: Mapping[str, Any], places: Floats, ends: Floats, across: Axis, along: Axis, lying: bool
) -> list[str]:
    errors = trace.get("error_x" if lying else "error_y")
    if not errors or "array" not in errors:
        return []
    up = unpacked(errors["array"])
    down = unpacked(errors.get("arrayminus", errors["array"]))
    path = ""
    for k in np.flatnonzero(np.isfinite(places) & np.isfinite(ends)):
        at = number(float(across.pixels(np.array(places[k]))))
        low, high = (number(float(along.pixels(np.array(v)))) for v in (ends[k] - down[k], ends[k] + up[k]))
        path += f"M{low} {at}H{high}" if lying else f"M{at} {low}V{high}"
    return [f'<path d="{path}" stroke="#1c2530" stroke-width="1.5" fill="none"/>']


def _cells(trace: Mapping[str, Any], x: Axis, y: Axis, _: Sequence[Mapping[str, Any]], __: str) -> list[str]:
    z = np.array([[np.nan if v is None else float(v) for v in row] for row in _grid(trace["z"])])
    if z.size == 0:
        return []
    step = max(1, math.ceil(math.sqrt(z.size / MOST_CELLS)))
    known = z[np.isfinite(z)]
    low = float(trace.get("zmin", known.min() if known.size else 0.0))
    high = float(trace.get("zmax", known.max() if known.size else 1.0))
    scale = _scale(trace.get("colorscale"))
    columns = x.numbers(trace["x"]) if "x" in trace else np.arange(z.shape[1], dtype=np.float64)
    rows = y.numbers(trace["y"]) if "y" in trace else np.arange(z.shape[0], dtype=np.float64)
    wide, tall = (_spacing(values) * step for values in (columns, rows))
    parts = []
    for i in range(0, z.shape[0], step):
        for j in range(0, z.shape[1], step):
            if not math.isfinite(z[i, j]):
                continue
            left, right = sorted(x.pixels(np.array([columns[j] - wide / 2, columns[j] + wide / 2])))
            top, bottom = sorted(y.pixels(np.array([rows[i] - tall / 2, rows[i] + tall / 2])))
            fill = mixed(scale, (z[i, j] - low) / ((high - low) or 1.0))
            parts.append(
                f'<rect x="{number(left)}" y="{number(top)}" width="{number(right - left)}"'
                f' height="{number(bottom - top)}" fill="{fill}"/>'
            )
    return parts


def _grid(z: Any) -> Any:
    if isinstance(z, dict):
        rows, columns = (int(v) for v in str(z["shape"]).split(","))
        return unpacked(z).reshape(rows, columns)
    return z


def _spacing(values: Floats) -> float:
    return float(np.abs(np.diff(values)).min()) if values.size > 1 else 1.0


def _place(axis: Axis, value: Any, paper: bool, flipped: bool) -> float:
    if paper:
        share = float(value)
        return axis.start + (share) * (axis.end - axis.start)
    if axis.kind == "category":
        place = axis.names.index(value) if value in axis.names else float(value)
        return float(axis.pixels(np.array(place)))
    if isinstance(value, str):
        return axis.start
    return float(axis.pixels(np.array(float(value) if not flipped else value)))


def _shapes(layout: Mapping[str, Any], x: Axis, y: Axis) -> list[str]:
    parts = []
    for shape in layout.get("shapes") or []:
        values = {}
        for key in ("x0", "x1", "y0", "y1"):
            axis, ref = (x, "xref") if key[0] == "x" else (y, "yref")
            value, on_paper = shape.get(key, 0), shape.get(ref) == "paper"
            if axis.kind == "log" and not on_paper:  # of shapes, plotly.js takes values themselves
                value = math.log10(value) if value > 0 else axis.low
            values[key] = min(max(_place(axis, value, on_paper, False), -50.0), 5000.0)
        line = shape.get("line") or {}
        colour = escaped(line.get("color", "none" if shape.get("type") == "rect" else "#5b6673"))
        width = number(float(line.get("width", 1)))
        left, right = sorted((values["x0"], values["x1"]))
        top, bottom = sorted((values["y0"], values["y1"]))
        if shape.get("type") == "rect":
            fill, opacity = escaped(shape.get("fillcolor", "none")), float(shape.get("opacity", 1))
            parts.append(
                f'<rect x="{number(left)}" y="{number(top)}" width="{number(right - left)}"'
                f' height="{number(bottom - top)}" fill="{fill}" opacity="{opacity:g}" stroke="{colour}"'
                f' stroke-width="{width if line else 0}"/>'
            )
        elif shape.get("type") == "line":
            parts.append(
                f'<path d="M{number(values["x0"])} {number(values["y0"])}L{number(values["x1"])}'
                f' {number(values["y1"])}" stroke="{colour}" stroke-width="{width}"/>'
            )
    return parts


def _notes(layout: Mapping[str, Any], x: Axis, y: Axis) -> list[str]:
    parts = []
    for note in layout.get("annotations") or []:
        px = _place(x, note.get("x", 0), note.get("xref") == "paper", False)
        py = _place(y, note.get("y", 0), note.get("yref") == "paper", False) - float(note.get("yshift", 0))
        font = note.get("font") or {}
        anchor = {"left": "start", "right": "end"}.get(str(note.get("xanchor")), "middle")
        parts.append(
            f'<text x="{number(px)}" y="{number(py)}" text-anchor="{anchor}"'
            f' fill="{escaped(font.get("color", "#1c2530"))}" font-size="{font.get("size", 12)}">'
            f"{plain(note.get('text', ''))}</text>"
        )
    return parts


def _legend(traces: Sequence[Mapping[str, Any]], left: float, width: int) -> str:
    parts, at = [], float(left)
    for k, trace in enumerate(traces):
        style = trace.get("line") or trace.get("marker") or {}
        colour, name = _colour(style, COLOURS[k % len(COLOURS)]), plain(trace["name"])
        if at + CHARACTER * len(name) + 24 > width:
            break
        parts.append(
            f'<rect x="{number(at)}" y="6" width="12" height="8" fill="{escaped(colour)}"/>'
            f'<text x="{number(at + 16)}" y="14">{name}</text>'
        )
        at += CHARACTER * len(name) + 34
    return "".join(parts)
