# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""AprilTags in images: grids of them, laid out as Kalibr's, and single ones.

A grid is counted as Kalibr counts it (GridCalibrationTargetAprilgrid): tag 0 at the bottom left, then to the
right, then the next row above; or from the top left downward, as OpenCV's GridBoard and most drawing programs
do. However it is counted, its frame has the origin at the bottom left corner of the tag at the bottom left, x
to the right, y up, and so z out of the board.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

FAMILIES = {"36h11": 6, "25h9": 5, "16h5": 4}  # cells in a row, without the border
_BORDERS = (1, 2)  # black cells around them: 2 of Kalibr's boards, 1 of all others
_FEWEST = 2  # tags of a grid: one alone does not show which way its corners are counted
_AGREEING = 0.7  # of the corners lie where a plane has them
_OFF = 0.1  # of a tag's side: further away a corner is not where a plane has it
_IN_FROM_EDGE = 0.8  # of the border: a corner's surroundings that hold no other corner


# How far the gaps that are seen may be from the spacing that was said.
_FEWEST_GAPS = 4  # two neighbours show two
_SPACING = 0.02  # as it was measured or rounded
_CORNER = 0.7  # [px] of a side, by which blur and the print of dark ink may move its ends
_LENS = 0.3  # times (side over the image's width)^2: what a wide lens bends
_ERRORS = 5.0  # standard errors of the median


@dataclass(frozen=True)
class TagGrid:
    """`columns` x `rows` tags of side `size` [m], gaps of `spacing` times that between them; `first`: the
    number of the tag at the bottom left, or with `from_top` at the top left; None: of a single tag, the one
    that is seen.
    """

    family: str
    columns: int
    rows: int
    size: float
    spacing: float = 0.0
    first: int | None = 0
    from_top: bool = False  # rows are counted downward

    @property
    def count(self) -> int:
        return self.columns * self.rows

    @property
    def points(self) -> Floats:
        """Corners, shape=(4 count, 3) [m], tag by tag: top left, top right, bottom right, bottom left."""
        corners = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]) * self.size
        step = (1.0 + self.spacing) * self.size
        heights = range(self.rows)[:: -1 if self.from_top else 1]
        places = [[c * step, r * step] for r in heights for c in range(self.columns)]
        flat = (np.array(places)[:, None] + corners).reshape(-1, 2)
        return np.column_stack([flat, np.zeros(len(flat))])


@dataclass(frozen=True)
class _Seen:
    """Tags in an image."""

    numbers: NDArray[np.intp]
    corners: Floats  # shape=(n, 4, 2) [px] clockwise from the top left

    @property
    def area(self) -> float:
        """Of all of them [px^2]. A border two cells wide may be read as that of a smaller tag, one wide:
        where as many tags are read with either, it is the larger ones that are printed.
        """
        diagonals = self.corners[:, 2:] - self.corners[:, :2]
        across, down = diagonals[:, 0], diagonals[:, 1]
        return float(0.5 * np.sum(np.abs(across[:, 0] * down[:, 1] - across[:, 1] * down[:, 0])))


class TagFinder:
    """Finds a grid of tags, or one tag, image by image. Which border the tags have, and at which corner they
    begin, the first image settles in which the grid is found.
    """

    def __init__(self, cv: Any, grid: TagGrid) -> None:
        if not hasattr(cv, "aruco") or not hasattr(cv.aruco, "ArucoDetector"):
            raise InputError(
                f"AprilTags need OpenCV 4.8 or newer with its ArUco module, found {cv.__version__}: pip"
                " install opencv-python-headless"
            )
        self.grid = grid
        self._cv = cv
        self._points = grid.points.reshape(-1, 4, 3)
        self._borders: tuple[int, ...] = _BORDERS
        self._turns: tuple[int, ...] = (0, 1, 2, 3) if grid.count > 1 else (0,)
        self._first = grid.first
        self._gaps: list[Floats] = []  # of each image, as _gaps_of has them

    def __call__(self, grey: Image) -> tuple[Floats, Floats] | None:
        """Points, shape=(m, 3) [m], and where they are seen, shape=(m, 2) [px]."""
        border, seen = max(
            ((border, self._seen(grey, border)) for border in self._borders), key=lambda one: one[1].area
        )
        hits = [(turn, hit) for turn in self._turns if (hit := self._in_plane(seen, turn)) is not None]
        if not hits:
            gaps = [self._gaps_of(seen, turn, grey.shape[1]) for turn in self._turns]
            self._gaps.append(max(gaps, key=len))
            return None
        turn, hit = max(hits, key=lambda one: len(one[1][0]))
        self._borders, self._turns = (border,), (turn,)
        self._gaps.append(self._gaps_of(seen, turn, grey.shape[1]))
        return hit

    def spacing_seen(self) -> float | None:
        """Gap between neighbouring tags over their side, of all images so far; None: too few neighbours, or
        it is that of the grid as far as they tell.
        """
        gaps = np.concatenate([np.empty((0, 3)), *self._gaps])
        if len(gaps) < _FEWEST_GAPS:
            return None
        spacing, side, of_image = (float(value) for value in np.median(gaps, axis=0))
        error = 1.4826 * float(np.median(np.abs(gaps[:, 0] - spacing))) / np.sqrt(len(gaps))
        allowed = _SPACING + _CORNER / side + _LENS * of_image**2 + _ERRORS * error
        return spacing if abs(spacing - self.grid.spacing) > allowed else None

    def in_sight(self, grey: Image) -> list[int]:
        """Numbers of all tags of the family in an image, whatever the grid."""
        return sorted(
            {
                int(n)
                for border in _BORDERS
                for n in detected(self._cv, grey, self.grid.family, border).numbers
            }
        )

    def _seen(self, grey: Image, border: int) -> _Seen:
        """Tags of the grid, each once, their corners refined."""
        seen = detected(self._cv, grey, self.grid.family, border)
        if self._first is None and len(seen.numbers):
            self._first = self._only(seen)
        numbers, counts = np.unique(seen.numbers, return_counts=True)
        once = numbers[counts == 1]
        first = self._first or 0
        keep = (
            np.isin(seen.numbers, once) & (seen.numbers >= first) & (seen.numbers < first + self.grid.count)
        )
        corners = seen.corners[keep]
        share = _IN_FROM_EDGE * border / (FAMILIES[self.grid.family] + 2 * border)
        return _Seen(seen.numbers[keep] - first, self._refined(grey, corners, share))

    def _only(self, seen: _Seen) -> int:
        numbers = sorted(set(seen.numbers.tolist()))
        if len(numbers) > 1:
            raise InputError(
                f"--board: of the family {self.grid.family} the tags {', '.join(map(str, numbers))} are in"
                " one image: say which, such as"
                f" apriltag:{self.grid.family}:{self.grid.size * 1e3:.6g}mm:{numbers[0]}"
            )
        return int(numbers[0])

    def _refined(self, grey: Image, corners: Floats, share: float) -> Floats:
        """To a fraction of a pixel: where grey values around a corner, as far as `share` of a side, rise
        square to lines through it.
        """
        cv, out = self._cv, corners.copy()
        for k, tag in enumerate(corners):
            side = min(np.linalg.norm(tag - np.roll(tag, 1, axis=0), axis=1))
            half = int(np.clip(share * side, 2, 9))
            found = cv.cornerSubPix(
                grey,
                np.ascontiguousarray(tag, dtype=np.float32).reshape(-1, 1, 2),
                (half, half),
                (-1, -1),
                (cv.TERM_CRITERIA_EPS | cv.TERM_CRITERIA_MAX_ITER, 50, 1e-3),
            )
            out[k] = np.asarray(found, dtype=np.float64).reshape(4, 2)
        return out

    def _in_plane(self, seen: _Seen, turn: int) -> tuple[Floats, Floats] | None:
        """Corners that one plane shows so; None: too few."""
        if len(seen.numbers) < min(_FEWEST, self.grid.count):
            return None
        points = self._points[seen.numbers].reshape(-1, 3)
        pixels = np.roll(seen.corners, turn, axis=1).reshape(-1, 2)
        if self.grid.count == 1:
            return points, pixels
        sides = np.linalg.norm(seen.corners - np.roll(seen.corners, 1, axis=1), axis=2)
        H, inside = self._cv.findHomography(
            points[:, :2], pixels, self._cv.RANSAC, max(1.0, _OFF * float(np.median(sides)))
        )
        if H is None or np.linalg.det(np.asarray(H)[:2, :2]) >= 0:  # y is up: a front view is mirrored
            return None
        good = np.asarray(inside).ravel() > 0
        return (points[good], pixels[good]) if good.sum() >= max(6, _AGREEING * len(good)) else None

    def _gaps_of(self, seen: _Seen, turn: int, width: int) -> Floats:
        """Between neighbours in a row (of a single column: in that): gap over side, side [px], side
        over the image's width; shape=(m, 3).
        """
        tags = dict(zip(seen.numbers.tolist(), np.roll(seen.corners, turn, axis=1), strict=True))
        columns, out = self.grid.columns, []
        above = ((0, 3), (1, 2)) if self.grid.from_top else ((3, 0), (2, 1))
        edges = ((0, 1), (3, 2)) if columns > 1 else above
        for number, tag in tags.items():
            if number + 1 not in tags or (columns > 1 and (number + 1) % columns == 0):
                continue
            for begin, end in edges:
                out += _gap_in_line(np.array([*tag[[begin, end]], *tags[number + 1][[begin, end]]]))
        gaps = np.array(out).reshape(-1, 2)
        return np.column_stack([gaps, gaps[:, 1] / width])


def _gap_in_line(corners: Floats) -> list[tuple[float, float]]:
    """Of two equal sides and the gap between them, seen in perspective, shape=(4, 2) [px]: gap over side, and
    the side [px]; none where they are not one after the other in one line.
    """
    way = corners[3] - corners[0]
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return []
    way /= length
    away = corners - corners[0]
    t, off = away @ way, np.abs(away @ [-way[1], way[0]])
    sides = t[1] - t[0], t[3] - t[2]
    if not (0.0 < t[1] < t[2] < t[3]) or off.max() > _OFF * max(sides):
        return []
    # (side + gap)^2 / (gap (2 side + gap)), whatever the perspective.
    ratio = (t[2] - t[0]) * (t[3] - t[1]) / ((t[2] - t[1]) * (t[3] - t[0]))
    return [(float(np.sqrt(ratio / (ratio - 1.0)) - 1.0), float(sum(sides) / 2))]


def detected(cv: Any, grey: Image, family: str, border: int) -> _Seen:
    """All tags of a family with a border of so many cells, as OpenCV finds them."""
    parameters = cv.aruco.DetectorParameters()
    parameters.markerBorderBits = border
    parameters.cornerRefinementMethod = cv.aruco.CORNER_REFINE_NONE
    # The usual ones are quick and miss tags that are small in the image.
    parameters.adaptiveThreshWinSizeMax, parameters.adaptiveThreshWinSizeStep = 43, 4
    parameters.minMarkerPerimeterRate = 0.01
    dictionary = cv.aruco.getPredefinedDictionary(getattr(cv.aruco, f"DICT_APRILTAG_{family}"))
    corners, numbers, _ = cv.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    if numbers is None or not len(numbers):
        return _Seen(np.empty(0, dtype=np.intp), np.empty((0, 4, 2)))
    return _Seen(
        np.asarray(numbers, dtype=np.intp).ravel(),
        np.array([np.asarray(tag, dtype=np.float64).reshape(4, 2) for tag in corners]),
    )
