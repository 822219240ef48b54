# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A 3-D picture of lines, points, arrows and a robot, which its reader turns; where the page's script does
not run, the same as a static picture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.arrays import mixed, outline, packed, subsample
from truing.report.charts import round_down
from truing.report.page import Page
from truing.report.picture import VIRIDIS, number
from truing.report.words import escaped, length_unit

Floats = NDArray[np.float64]

STATIC_SIZE = (1000, 540)  # [px] of the static picture
STATIC_POINTS, STATIC_LINE = 300, 400  # of a set: a picture is to weigh little
FAR = 1.6  # reaches of the robot from its base: what is beyond is not brought into the picture
HEAD = 0.012  # of the picture's width: the head of an arrow


@dataclass(frozen=True)
class RobotPicture:
    """A robot for a picture (`truing.drawing.robot_picture` makes it)."""

    scene: Mapping[str, Any]  # what the page's script needs of it
    stand: Floats  # shape=(n, 3) [m] the line of its joints at the pose that it has at first
    # Points of the line to be looked at: their colours.
    marked: Mapping[int, str] = field(default_factory=dict)


# To the sides, edges and corners of a cube.
DIRECTIONS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


def polyline(pieces: Sequence[Floats]) -> Floats:
    """Lines as one, shape=(n, 3), with gaps between them."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([part for piece in pieces for part in (piece, gap)]) if pieces else np.empty((0, 3))


class Scene3d:
    """Collects what is drawn. Points are in metres, shape=(n, 3). What has a `group` is shown when that group
    is chosen; the first group that is named is shown at first.
    """

    def __init__(self) -> None:
        self._lines: list[dict[str, Any]] = []
        self._arrows: list[dict[str, Any]] = []
        self._points: list[dict[str, Any]] = []
        self._groups: list[str] = []
        self._drawn: list[
            tuple[str, Floats, Mapping[str, Any]]
        ] = []  # of the static picture: kind, points, style
        self._extent: list[Floats] = []
        self._robot: Mapping[str, Any] | None = None
        self._stand: Floats = np.zeros((1, 3))

    def _keep(self, kind: str, points: Floats, style: Mapping[str, Any], group: str) -> None:
        if group and group not in self._groups:
            self._groups.append(group)
        if not group or group == self._groups[0]:
            self._drawn.append((kind, points, style))
        self._extent.append(points.reshape(-1, 3))

    def add_line(
        self, xyz: Floats, name: str, colour: str, width: float, *, opacity: float = 1.0, group: str = ""
    ) -> None:
        """A line, broken at NaN; `width` in pixels."""
        style = {"name": name, "colour": colour, "width": width, "opacity": opacity}
        self._lines.append({**style, "xyz": packed(xyz.ravel()), "group": group})
        self._keep("line", xyz, style, group)

    def add_arrows(
        self,
        start: Floats,
        along: Floats,
        name: str,
        colour: str,
        width: float,
        *,
        opacity: float = 1.0,
        group: str = "",
    ) -> None:
        """Arrows from `start` to `start + along`."""
        known = np.isfinite(start).all(axis=1) & np.isfinite(along).all(axis=1)
        start, along = start[known], along[known]
        style = {"name": name, "colour": colour, "width": width, "opacity": opacity}
        both = {"start": packed(start.ravel()), "along": packed(along.ravel())}
        self._arrows.append({**style, **both, "group": group})
        self._keep("arrows", np.stack([start, start + along], axis=1), style, group)

    def add_points(
        self,
        xyz: Floats,
        name: str,
        size: float,
        colour: str | Sequence[str],
        *,
        opacity: float = 1.0,
        texts: Sequence[str] | None = None,
        group: str = "",
    ) -> None:
        """Points of one colour, or of a colour each; `texts` are shown where the pointer is."""
        style: dict[str, Any] = {"name": name, "size": size, "opacity": opacity}
        style |= {"colour": colour} if isinstance(colour, str) else {"colours": list(colour)}
        said = {} if texts is None else {"texts": list(texts)}
        self._points.append({**style, **said, "xyz": packed(xyz.ravel()), "group": group})
        self._keep("points", xyz, style, group)

    def add_lengths(
        self,
        xyz: Floats,
        lengths: Floats,
        limit: float,
        name: str,
        size: float,
        *,
        texts: Sequence[str] | None = None,
        group: str = "",
    ) -> None:
        """Points coloured by a length each [m], from 0 to `limit`, with a bar that explains the colours."""
        unit, scale = length_unit(limit)
        colours = VIRIDIS[::-1]
        style: dict[str, Any] = {"name": name, "size": size, "opacity": 1.0, "shades": colours}
        each = {"values": packed(lengths * scale), "limit": limit * scale, "unit": unit}
        said = {} if texts is None else {"texts": list(texts)}
        self._points.append({**style, **each, **said, "xyz": packed(xyz.ravel()), "group": group})
        shades = [mixed(colours, float(v) / limit) for v in np.nan_to_num(lengths)]
        self._keep("points", xyz, {**style, "colours": shades}, group)

    def set_robot(self, robot: RobotPicture) -> None:
        """The robot of the picture."""
        self._robot, self._stand = robot.scene, robot.stand
        stand = robot.stand
        self._extent.append(stand)
        around = 0.3 * robot.scene["reach"]  # the reader turns its joints: room to stay in the picture
        self._extent += [stand[:1] + around * np.array(v) for v in ((1, 1, 0), (-1, -1, 0))]
        style = {"name": "robot", "colour": "#8b95a1", "width": 9.0, "opacity": 0.9}
        self._drawn.append(("line", stand, style))
        self._drawn.append(("points", stand, {"name": "", "size": 6.0, "opacity": 1.0, "colour": "#5b6673"}))
        for joint, colour in robot.marked.items():
            style = {"name": "", "size": 11.0, "opacity": 1.0, "colour": colour}
            self._drawn.append(("points", stand[joint : joint + 1], style))

    def draw(
        self, page: Page, *, eye: tuple[float, float, float], size: str, name: str = "workspace"
    ) -> None:
        """The picture in its place on the page, seen from `eye`, a direction."""
        every = np.concatenate(self._extent) if self._extent else np.zeros((1, 3))
        every = every[np.isfinite(every).all(axis=1)]
        every = every if len(every) else np.zeros((1, 3))
        if self._robot is not None:  # what is far from it would leave it a dot
            every = every[np.linalg.norm(every - self._stand[0], axis=1) < FAR * self._robot["reach"]]
        spec = {
            "id": name,
            "eye": eye,
            "bounds": [every.min(axis=0), every.max(axis=0)],
            "outermost": every[np.unique(np.argmax(every @ DIRECTIONS.T, axis=0))],
            "groups": self._groups,
            "lines": self._lines,
            "arrows": self._arrows,
            "points": self._points,
            "robot": self._robot,
        }
        page.scene(name, spec, self._picture(np.array(eye), every), size)
        if self._robot is not None and self._robot.get("note"):
            page.add(f'<p class="note">{escaped(self._robot["note"])}</p>')

    def _picture(self, eye: Floats, every: Floats) -> str:
        """Everything seen along `eye`, without perspective."""
        view = _Projection(eye, every)
        parts = [view.floor(float(every[:, 2].min()))]
        parts += [
            {"line": view.line, "arrows": view.arrows, "points": view.points}[kind](points, style)
            for kind, points, style in self._drawn
        ]
        width, height = STATIC_SIZE
        return f'<svg class="picture" viewBox="0 0 {width} {height}" role="img">{"".join(parts)}</svg>'


class _Projection:
    """A parallel view onto a picture of STATIC_SIZE."""

    def __init__(self, eye: Floats, every: Floats) -> None:
        to = eye / np.linalg.norm(eye)
        right = np.cross([0.0, 0.0, 1.0], to)
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1.0, 0.0, 0.0])
        self._axes = np.stack([right, np.cross(to, right)])
        flat = every @ self._axes.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        width, height = STATIC_SIZE
        self._scale = 0.88 * float(min(np.array([width, height]) / np.maximum(high - low, 1e-9)))
        self._middle = 0.5 * (low + high)
        self._ground = every[:, :2].min(axis=0), every[:, :2].max(axis=0)

    def _pixels(self, xyz: Floats) -> Floats:
        flat = (xyz @ self._axes.T - self._middle) * self._scale
        return np.asarray(flat * np.array([1.0, -1.0]) + 0.5 * np.array(STATIC_SIZE))

    def floor(self, z: float) -> str:
        """Squares below everything."""
        low, high = self._ground
        wide = float(max(*(high - low), 1e-3))
        step = round_down(wide / 5)
        ends = [np.arange(math.floor(low[k] / step), math.ceil(high[k] / step) + 1) * step for k in range(2)]
        lines = [np.array([[x, ends[1][0], z], [x, ends[1][-1], z]]) for x in ends[0]]
        lines += [np.array([[ends[0][0], y, z], [ends[0][-1], y, z]]) for y in ends[1]]
        path = "".join(self._path(line) for line in lines)
        unit, scale = length_unit(step)
        return (
            f'<path d="{path}" stroke="#dfe3e8" fill="none"/><text x="12" y="{STATIC_SIZE[1] - 12}"'
            f' font-family="sans-serif" font-size="13" fill="#5b6673">a square of the floor:'
            f" {step * scale:g} {unit}</text>"
        )

    def _path(self, xyz: Floats) -> str:
        at = self._pixels(xyz)
        out, pen = [], "M"
        for x, y in at.tolist():
            if not (math.isfinite(x) and math.isfinite(y)):
                pen = "M"
                continue
            out.append(f"{pen}{number(x)} {number(y)}")
            pen = "L"
        return "".join(out)

    def line(self, xyz: Floats, style: Mapping[str, Any]) -> str:
        """A line with gaps."""
        drawn = xyz
        if len(xyz) > STATIC_LINE and np.isfinite(xyz).all():
            at = self._pixels(xyz)
            drawn = xyz[np.union1d(outline(at[:, 0], STATIC_LINE), outline(at[:, 1], STATIC_LINE))]
        return (
            f'<path d="{self._path(drawn)}" stroke="{escaped(style["colour"])}" fill="none"'
            f' stroke-width="{style["width"]:g}" stroke-opacity="{style["opacity"]:g}"'
            ' stroke-linejoin="round" stroke-linecap="round"/>'
        )

    def arrows(self, pairs: Floats, style: Mapping[str, Any]) -> str:
        """Strokes, shape=(n, 2, 3), with open heads."""
        pick = subsample(np.arange(len(pairs)), STATIC_POINTS)
        path = ""
        for pair in pairs[pick]:
            a, b = self._pixels(pair)
            path += f"M{number(a[0])} {number(a[1])}L{number(b[0])} {number(b[1])}"
            length = float(np.hypot(*(b - a)))
            if length > 4:
                back = (a - b) / length * min(HEAD * STATIC_SIZE[0], 0.5 * length)
                side = 0.45 * np.array([-back[1], back[0]])
                ends = [b + back + side, b, b + back - side]
                path += "M" + "L".join(f"{number(e[0])} {number(e[1])}" for e in ends)
        return (
            f'<path d="{path}" stroke="{escaped(style["colour"])}" fill="none"'
            f' stroke-width="{style["width"]:g}" stroke-opacity="{style["opacity"]:g}"/>'
        )

    def points(self, xyz: Floats, style: Mapping[str, Any]) -> str:
        """Dots."""
        known = np.flatnonzero(np.isfinite(xyz).all(axis=1))
        groups: dict[str, list[str]] = {}
        at = self._pixels(xyz)
        for k in subsample(known, STATIC_POINTS):
            colour = style["colours"][k] if "colours" in style else style["colour"]
            groups.setdefault(str(colour), []).append(f"M{number(at[k, 0])} {number(at[k, 1])}h0")
        return "".join(
            f'<path d="{"".join(dots)}" stroke="{escaped(colour)}" stroke-width="{2 * style["size"]:g}"'
            f' stroke-opacity="{style["opacity"]:g}" stroke-linecap="round"/>'
            for colour, dots in groups.items()
        )
