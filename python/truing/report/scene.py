# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A 3-D plot of lines and points; seen from above and from the side where a browser has no WebGL."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import packed
from truing.report.page import Page

Floats = NDArray[np.float64]

VIEWS = (("top", 1), ("side", 2))  # of the axes, which one goes up


def polyline(pieces: Sequence[Floats]) -> Floats:
    """Lines as one, shape=(n, 3), with gaps between them."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([part for piece in pieces for part in (piece, gap)]) if pieces else np.empty((0, 3))


class Scene3d:
    """Collects what is drawn. Points are in metres, shape=(n, 3)."""

    def __init__(self) -> None:
        self._traces: list[dict[str, Any]] = []
        self._flat: dict[str, list[dict[str, Any]]] = {view: [] for view, _ in VIEWS}

    def add_line(self, xyz: Floats, name: str, colour: str, width: float, flat_width: float) -> None:
        """A line, broken at NaN. Widths in pixels: of the 3-D plot, of the flat ones."""
        line = {"type": "scatter3d", "mode": "lines", "name": name, "hoverinfo": "name"}
        self._traces.append({**line, **_xyz(xyz), "line": {"color": colour, "width": width}})
        for view, up in VIEWS:
            self._flat[view].append(
                {
                    **line,
                    "type": "scatter",
                    "x": packed(xyz[:, 0]),
                    "y": packed(xyz[:, up]),
                    "line": {"color": colour, "width": flat_width},
                }
            )

    def add_points(
        self,
        xyz: Floats,
        name: str,
        marker: Mapping[str, Any],
        hover: Mapping[str, Any],
        flat_size: float | None = None,
    ) -> None:
        """Points, with plotly's `marker` and hover text; in the flat plots too if these have a size."""
        points = {"type": "scatter3d", "mode": "markers", "name": name, **hover}
        self._traces.append({**points, **_xyz(xyz), "marker": dict(marker)})
        for view, up in VIEWS:
            if flat_size is not None:
                self._flat[view].append(
                    {
                        **points,
                        "type": "scatter",
                        "x": packed(xyz[:, 0]),
                        "y": packed(xyz[:, up]),
                        "marker": {**marker, "size": flat_size},
                    }
                )

    def draw(self, page: Page, *, eye: tuple[float, float, float], center: float, size: str) -> None:
        """The plot in its place on the page. `eye` and height of the `center`: in plotly's units."""
        page.chart(
            "workspace",
            self._traces,
            {
                "scene": {
                    **{
                        f"{axis}axis": {
                            "title": {"text": f"{axis} [m]"},
                            "backgroundcolor": "#fff",
                            "gridcolor": "#e6e9ed",
                        }
                        for axis in "xyz"
                    },
                    "aspectmode": "data",
                    "camera": {
                        "eye": dict(zip("xyz", eye, strict=True)),
                        "center": {"x": 0, "y": 0, "z": center},
                    },
                },
                "fallback": self._flat,
            },
            size=size,
        )


def _xyz(points: Floats) -> dict[str, Any]:
    return {axis: packed(points[:, k]) for k, axis in enumerate("xyz")}
