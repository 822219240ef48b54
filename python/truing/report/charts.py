# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Charts that several reports draw, and the pieces of which every chart is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.arrays import packed as packed, subsample as subsample
from truing.report.page import Page
from truing.report.rows import Rows
from truing.report.words import drawn_of, figures_text, length_unit

Floats = NDArray[np.float64]
# Colours that stay apart for colour-blind readers and in grey print: before is light and warm, after dark and
# cool.
BEFORE, AFTER, REJECTED, INK, MUTED, GRID = "#d98324", "#1f5fa8", "#b3261e", "#1c2530", "#5b6673", "#e6e9ed"
ROW_POINTS = 1500  # shown over the row order


def labelled_bars(
    at: Sequence[str], values: Sequence[float | None], top: float, name: str, colour: str, unit: str = ""
) -> dict[str, Any]:
    """Bars with their numbers on them, those beyond `top` cut off there."""
    return {
        "type": "bar",
        "x": list(at),
        "y": [None if v is None else min(v, top) for v in values],
        "text": ["" if v is None else figures_text(v, 2) for v in values],
        "textposition": "auto",
        "textangle": -90,
        "constraintext": "none",
        "textfont": {"size": 11},
        "cliponaxis": False,
        "name": name,
        "marker": {"color": colour},
        "customdata": list(values),
        "hovertemplate": f"%{{x}}: %{{customdata:.3~r}}{unit}<extra>{name}</extra>",
    }


def distribution_chart(
    series: Sequence[tuple[Floats, str, str]],
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Fraction of rows over the error, on a logarithmic axis: steps, filled, named where they peak."""
    finite = [(values[np.isfinite(values)], colour, name) for values, colour, name in series]
    everything = np.concatenate([values for values, _, _ in finite]) if finite else np.empty(0)
    if everything.size == 0 or everything.max() <= 0:
        return [], {"xaxis": {}, "yaxis": {}}
    low = max(float(np.quantile(everything, 0.002)), float(everything.max()) * 1e-5)
    high = float(everything.max()) * 1.15
    edges = np.geomspace(low / 1.15, high, 46)
    unit, scale = length_unit(float(np.median(everything)), big=True)
    traces: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    top = 0.0
    for values, colour, name in finite:
        if values.size == 0:
            continue
        counts = np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / values.size * 100
        # A step line that starts and ends on the floor.
        x = np.repeat(edges, 2) * scale
        y = np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": packed(x),
                "y": packed(y),
                "name": name,
                "fill": "tozeroy",
                "line": {"color": colour, "width": 2},
                "fillcolor": faded(colour, 0.28),
                "hoverinfo": "skip",
            }
        )
        peak = int(np.argmax(counts))
        annotations.append(
            {
                "x": math.log10(math.sqrt(edges[peak] * edges[peak + 1]) * scale),
                "y": float(counts[peak]),
                "text": f"<b>{name}</b>",
                "showarrow": False,
                "yshift": 12,
                "font": {"color": colour, "size": 15},
            }
        )
        top = max(top, float(counts[peak]))
        for quantile, label in ((float(values.mean()), "mean"),):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": [quantile * scale] * 2,
                    "y": [0, float(counts[peak])],
                    "line": {"color": colour, "width": 1.5, "dash": "dot"},
                    "name": f"{name}, {label}",
                    "hoverinfo": "name",
                }
            )
    tick_values, tick_texts = _log_ticks(edges[0] * scale, edges[-1] * scale)
    layout = {
        "xaxis": {
            "type": "log",
            "title": {"text": f"error [{unit}]"},
            "tickvals": tick_values,
            "ticktext": tick_texts,
            "range": [math.log10(edges[0] * scale), math.log10(edges[-1] * scale)],
        },
        "yaxis": {"title": {"text": "fraction of rows [%]"}, "range": [0, top * 1.18]},
        "annotations": annotations,
    }
    return traces, layout


def chart_over_rows(page: Page, rows: Rows, out_word: str = "rejected") -> None:
    """Errors before and after over time, or over the order of the rows. `out_word`: what the rows in
    `rows.rejected` are.
    """
    order = rows.time if rows.time is not None else np.arange(rows.count, dtype=np.float64)
    usable = np.flatnonzero(
        np.isfinite(rows.magnitude_after) & np.isfinite(rows.magnitude_before) & ~rows.rejected
    )
    pick = subsample(usable, ROW_POINTS)
    everything = np.concatenate(
        [rows.magnitude_before[usable], rows.magnitude_after[usable], rows.magnitude_after[rows.rejected]]
    )
    limits, axis = log_error_axis(everything)
    traces = [
        points_trace(order[pick], rows.magnitude_before[pick] * limits, BEFORE, "before", 4, opacity=0.5),
        points_trace(order[pick], rows.magnitude_after[pick] * limits, AFTER, "after", 4, opacity=0.6),
    ]
    if rows.rejected.any():
        out = subsample(np.flatnonzero(rows.rejected), 500)
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": packed(order[out]),
                "y": packed(rows.magnitude_after[out] * limits),
                "name": out_word,
                "text": [f"row {i}" for i in out],
                "marker": {"symbol": "x-thin", "size": 9, "line": {"color": REJECTED, "width": 2}},
            }
        )
    page.chart(
        "rows",
        traces,
        {
            "xaxis": {"title": {"text": "time [s]" if rows.time is not None else "row"}},
            "yaxis": axis,
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.12, "x": 0},
        },
        size="wide",
    )
    page.add(
        f'<p class="note">{drawn_of(pick.size, usable.size, "row")} A trend here means drift: warming up, a'
        " tracker that moved, a loose target.</p>"
    )


def faded(colour: str, alpha: float) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


def points_trace(
    x: Floats | NDArray[np.integer[Any]], y: Floats, colour: str, name: str, size: int, opacity: float = 0.8
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "markers",
        "x": packed(x),
        "y": packed(y),
        "name": name,
        "marker": {"color": colour, "size": size, "opacity": opacity},
    }


def round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten."""
    if not (value > 0 and math.isfinite(value)):
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(factor for factor in (1, 2, 5) if factor * power <= value * (1 + 1e-9)) * power


def _log_ticks(low: float, high: float) -> tuple[list[float], list[str]]:
    """Ticks at 1, 2, 5 of every decade; only 1 when there are many decades."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    factors = (1, 2, 5) if len(decades) <= 3 else (1, 3) if len(decades) <= 4 else (1,)
    values = [factor * 10.0**decade for decade in decades for factor in factors]
    values = [value for value in values if low <= value <= high]
    return values, [f"{value:g}" for value in values]


def log_error_axis(errors: Floats) -> tuple[float, dict[str, Any]]:
    """Scale from metres, and a logarithmic axis that holds the errors."""
    positive = errors[np.isfinite(errors) & (errors > 0)]
    if positive.size == 0:
        return 1e3, {"title": {"text": "error [mm]"}}
    unit, scale = length_unit(float(np.median(positive)), big=True)
    low, high = float(np.quantile(positive, 0.003)) / 1.3 * scale, float(positive.max()) * 1.3 * scale
    values, texts = _log_ticks(low, high)
    return scale, {
        "type": "log",
        "title": {"text": f"error [{unit}]"},
        "tickvals": values,
        "ticktext": texts,
        "range": [math.log10(low), math.log10(high)],
    }


def square_layout(height: int) -> dict[str, Any]:
    """Of a heat map with the same names along both axes."""
    axis = {"showgrid": False, "dtick": 1, "tickfont": {"size": 10}, "automargin": True}
    return {
        "xaxis": {"tickangle": -90, **axis},
        "yaxis": {"autorange": "reversed", **axis, "zeroline": False},
        "height": height,
    }
