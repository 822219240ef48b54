# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""AprilTags in images: grids of them, laid out as Kalibr's, and single ones.

A grid is counted as Kalibr counts it (GridCalibrationTargetAprilgrid): tag 0 at the bottom left, then to the
right, then the next row above. Its frame has the origin at the bottom left corner of tag 0, x to the right, y
up, and so z out of the board.
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


@dataclass(frozen=True)
class TagGrid:
    """`columns` x `rows` tags of side `size` [m], gaps of `spacing` times that between them; `first`: the
    number of the tag at the bottom left; None: of a single tag, the one that is seen.
    """

    family: str
    columns: int
    rows: int
    size: float
    spacing: float = 0.0
    first: int | None = 0

    @property
    def count(self) -> int:
        return self.columns * self.rows

    @property
    def points(self) -> Floats:
        """Corners, shape=(4 count, 3) [m], tag by tag: top left, top right, bottom right, bottom left."""
        corners = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]) * self.size
        step = (1.0 + self.spacing) * self.size
        places = [[c * step, r * step] for r in range(self.rows) for c in range(self.columns)]
        flat = (np.array(places)[:, None] + corners).reshape(-1, 2)
        return np.column_stack([flat, np.zeros(len(flat))])


@dataclass(frozen=True)
class _Seen:
    """Tags in an image."""

    numbers: NDArray[np.intp]
    corners: Floats  # shape=(n, 4, 2) [px] clockwise from the top left


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

    def __call__(self, grey: Image) -> tuple[Floats, Floats] | None:
        """Points, shape=(m, 3) [m], and where they are seen, shape=(m, 2) [px]."""
        best: tuple[tuple[Floats, Floats], int, int] | None = None
        for border in self._borders:
            seen = self._seen(grey, border)
            for turn in self._turns:
                hit = self._in_plane(seen, turn)
                if hit is not None and (best is None or len(hit[0]) > len(best[0][0])):
                    best = hit, border, turn
        if best is None:
            return None
        hit, border, turn = best
        self._borders, self._turns = (border,), (turn,)
        return hit

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
