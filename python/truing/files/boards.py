# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Calibration boards: what they are called, where their points are, and how they are found in images (by
OpenCV, which is imported only then).

    board = truing.files.parse_board("chessboard:9x6:25mm")
    views = truing.files.find_board(["0.png", "1.png", ...], board)

A board's frame has its origin at the first point, x along a row, y along a column and z into the board, away
from the camera; that of AprilTags is Kalibr's, origin at the bottom left, y up and z towards the camera.
Pixels count from the centre of the top left pixel.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from truing._core import Camera
from truing.errors import InputError, InputWarning
from truing.files.output import require_whole_file
from truing.files.tags import FAMILIES as TAG_FAMILIES, TagFinder, TagGrid

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
_FROM_TOP = "top-left"
Kind = Literal["chessboard", "charuco", "circles", "acircles", "apriltag"]

_EXPECTED = (
    "chessboard:9x6:25mm (inner corners, square), charuco:5x7:40mm:30mm (squares, square, marker),"
    " circles:10x10:25.4mm (dots, distance), acircles:4x11:20mm (dots in a row, rows, distance of rows),"
    " apriltag:36h11:6x6:88mm:0.3 (family, tags, side, gap over side) or apriltag:36h11:88mm:5 (one tag)"
)
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_FEWEST_VIEWS = 3
_FEWEST_POINTS = 6  # of a ChArUco board: fewer do not fix its pose well
_CALIBRATION_VIEWS = 40  # more add little to intrinsics that are refined later
_CALIBRATION_STEPS = 1000  # OpenCV stops at 30, and does not say so; wide lenses take hundreds
_OTHER_STARTS = (0.6, 1.2)  # focal lengths over the image's width, where OpenCV's own start leads nowhere
_TRIED = 4  # images in which another board is looked for
_SAMPLES = 7  # grey values along a square
# A pixel is nothing like this far off where the board is the one that was named.
_BAD_PIXELS = 2.0
_BAD_SHARE = 0.003  # of the image's width
_WORTH_A_LOOK = 0.5  # [px] a camera whose rms is below fits well enough to start from
_LEAST_TILT = math.radians(8)
_MISPLACED = 6.0  # times the usual error of points, in all images and in its own, and no less than
_LEAST_MISPLACED = 0.2  # [px]
_MISPLACED_ROUNDS = 5  # what is far off hides what is less
_MOST_MISPLACED = 0.2  # of the points of an image: where more are off, it is not single ones that are
_DOT_EDGE = 24  # points on the edge of a dot
_DOT_ROUNDS = 2  # its centre shifts by a small part of its radius, and that by a smaller one
_FEWEST_MARKERS = 6  # to tell how large they are
_MARKER = 0.1  # of a marker's side: less misplaces no corner
_MARKER_EDGE = 2.0  # [px] its edges as they are found
_MOST_PIXELS = 200_000_000
_LARGEST_RATIO = 1e4  # of focal length and image size

_FAMILIES = ("4X4", "5X5", "6X6", "7X7")
_FAMILY_SIZES = (50, 100, 250, 1000)
_OTHER_DICTIONARIES = ("ARUCO_ORIGINAL", "APRILTAG_36h11", "APRILTAG_25h9", "APRILTAG_16h5")


@dataclass(frozen=True)
class Board:
    """A flat calibration board. Lengths in m.

    chessboard: `columns` x `rows` inner corners, `size` of a square. charuco: `columns` x `rows` squares,
    `size` of a square, `marker` of a marker.
    circles: `columns` x `rows` dots, `size` from dot to dot. acircles: `columns` dots in a row, `rows` rows
    (an odd number), each shifted by half; `size` from row to row (half the distance of dots in a row).
    apriltag: `columns` x `rows` tags of the family `dictionary`, `size` of a tag, `spacing` from tag to tag
    over it, numbered from `first` at the bottom left upward, or `from_top` from the top left downward (None:
    of one tag, the one that is seen).
    """

    kind: Kind
    columns: int
    rows: int
    size: float
    marker: float = 0.0
    dictionary: str = ""  # of a charuco board; empty: found from the images
    legacy: bool | None = (
        None  # of a charuco board: pattern of OpenCV before 4.6; None: found from the images
    )
    spacing: float = 0.0
    first: int | None = 0
    from_top: bool = False

    def __str__(self) -> str:
        if self.kind == "apriltag":
            return self._name_of_tags()
        text = f"{self.kind}:{self.columns}x{self.rows}:{_length(self.size)}"
        if self.kind == "charuco":
            text += f":{_length(self.marker)}" + (f":{self.dictionary}" if self.dictionary else "")
        return text

    def _name_of_tags(self) -> str:
        text = f"{self.kind}:{self.dictionary}"
        if self.columns * self.rows > 1:
            counting = f":{_FROM_TOP}" if self.from_top else ""
            return f"{text}:{self.columns}x{self.rows}:{_length(self.size)}:{self.spacing:.6g}{counting}"
        return f"{text}:{_length(self.size)}" + (f":{self.first}" if self.first is not None else "")

    @property
    def tags(self) -> TagGrid:
        """Of an apriltag board: its tags."""
        layout = (self.columns, self.rows, self.size, self.spacing, self.first, self.from_top)
        return TagGrid(self.dictionary, *layout)

    @property
    def points(self) -> Floats:
        """All points, shape=(n, 3) [m] in the board's frame: row by row, or the corners tag by tag."""
        if self.kind == "apriltag":
            return self.tags.points
        if self.kind == "acircles":
            return np.array(
                [
                    [(2 * j + i % 2) * self.size, i * self.size, 0.0]
                    for i in range(self.rows)
                    for j in range(self.columns)
                ]
            )
        less = 1 if self.kind == "charuco" else 0
        first = 1 if self.kind == "charuco" else 0  # a ChArUco board counts from its outer edge
        x, y = np.meshgrid(np.arange(self.columns - less) + first, np.arange(self.rows - less) + first)
        return np.column_stack([x.ravel() * self.size, y.ravel() * self.size, np.zeros(x.size)])

    def symmetries(self) -> tuple[Floats, ...]:
        """Turns after which the board looks the same, T_board_turned, shape=(4, 4), without the identity."""
        quarter_turns: tuple[int, ...] = ()
        c, r = self.columns, self.rows
        if self.kind == "circles":
            quarter_turns = (1, 2, 3) if c == r else (2,)
        elif self.kind == "chessboard" and (c + r) % 2 == 0:
            # A turn by 90 degrees changes black and white unless there is a square in the middle.
            quarter_turns = (1, 2, 3) if c == r and c % 2 == 0 else (2,)
        points = self.points
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        turns = []
        for k in quarter_turns:
            turned = np.eye(4)
            cosine, sine = (1, 0, -1, 0)[k], (0, 1, 0, -1)[k]
            turned[:2, :2] = [[cosine, -sine], [sine, cosine]]
            turned[:3, 3] = middle - turned[:3, :3] @ middle
            turns.append(turned)
        return tuple(turns)


@dataclass(frozen=True)
class BoardViews:
    """A board as it was found in images. One entry per image in which it was found."""

    board: Board  # with dictionary and pattern, where they were found from the images
    found: tuple[int, ...]  # numbers of these images
    missing: tuple[int, ...]  # numbers of the others
    points: tuple[Floats, ...]  # shape=(m, 3) [m] in the board's frame
    pixels: tuple[Floats, ...]  # shape=(m, 2) [px]; of dots, where their centres are seen
    T_camera_board: Floats  # shape=(n, 4, 4), from the points of each image alone
    rms: Floats  # shape=(n,) [px] of these poses
    camera: Camera
    calibrated: bool  # the camera's values were found from these images
    calibration_rms: float = math.nan  # [px]


def parse_board(text: str) -> Board:
    """A board by its name: chessboard:9x6:25mm (inner corners), charuco:5x7:40mm:30mm[:DICTIONARY] (squares),
    circles:10x10:25.4mm, acircles:4x11:20mm, apriltag:36h11:6x6:88mm:0.3 (a grid as Kalibr's: family, tags,
    side, gap over side; with :top-left counted from there), apriltag:36h11:88mm[:NUMBER] (one tag).

    Raises InputError that says what was expected.
    """
    try:
        return _parsed_board(text)
    except _NoBoard as error:
        raise InputError(f"--board: found {text!r}: {error}; expected {_EXPECTED}") from None


class _NoBoard(Exception):
    """What is wrong with the name of a board."""


def _parsed_board(text: str) -> Board:
    kind, *parts = (part.strip() for part in text.split(":"))
    if kind not in get_args(Kind):
        raise _NoBoard(f"no kind of board is called {kind!r}")
    if kind == "apriltag":
        return _parsed_tags(parts)
    charuco = kind == "charuco"
    lengths = 2 if charuco else 1
    if len(parts) < 1 + lengths:
        raise _NoBoard("something is missing")
    columns, rows = _board_counts(kind, parts[0])
    sizes = [_board_length(part) for part in parts[1 : 1 + lengths]]
    rest = parts[1 + lengths :]
    dictionary = _dictionary_name(rest.pop(0)) if rest and charuco else ""
    if rest:
        raise _NoBoard(f"{':'.join(rest)!r} is too much")
    if kind == "acircles" and rows % 2 == 0:
        raise _NoBoard(
            f"of a shifted grid with {rows} rows, an even number, OpenCV finds no order; use an odd number of"
            " rows"
        )
    if charuco and sizes[1] >= sizes[0]:
        raise _NoBoard("the marker is not smaller than its square")
    return Board(cast(Kind, kind), columns, rows, sizes[0], sizes[1] if charuco else 0.0, dictionary)


def _parsed_tags(parts: Sequence[str]) -> Board:
    """FAMILY:COLUMNSxROWS:SIDE:SPACING[:top-left], or FAMILY:SIDE[:NUMBER]."""
    family = (
        parts[0].lower().removeprefix("dict_").removeprefix("apriltag_").removeprefix("tag") if parts else ""
    )
    if family not in TAG_FAMILIES:
        raise _NoBoard(f"there is no family of AprilTags {family!r}; there are {', '.join(TAG_FAMILIES)}")
    rest = list(parts[1:])
    if not rest:
        raise _NoBoard("something is missing")
    if "x" not in rest[0]:
        side, *number = rest
        if len(number) > 1 or (number and not re.fullmatch(r"[0-9]{1,4}", number[0])):
            raise _NoBoard(f"{':'.join(number)!r} is no number of a tag")
        first = int(number[0]) if number else None
        return Board("apriltag", 1, 1, _board_length(side), dictionary=family, first=first)
    counts = re.fullmatch(r"([0-9]{1,3})x([0-9]{1,3})", rest[0])
    if not counts or not 1 < int(counts[1]) * int(counts[2]) <= 600:
        raise _NoBoard(f"{rest[0]!r} is no pair of numbers of tags such as 6x6")
    from_top = rest[3:] == [_FROM_TOP]
    if len(rest) != 3 + from_top:
        raise _NoBoard(f"expected tags, side and spacing after the family, and {_FROM_TOP} or nothing")
    if not re.fullmatch(r"[0-9]*\.?[0-9]+", rest[2]) or not 0 < float(rest[2]) < 10:
        raise _NoBoard(
            f"{rest[2]!r} is no spacing: the gap between two tags over the side of one, such as 0.3"
        )
    return Board(
        "apriltag",
        int(counts[1]),
        int(counts[2]),
        _board_length(rest[1]),
        dictionary=family,
        spacing=float(rest[2]),
        from_top=from_top,
    )


def _board_counts(kind: str, text: str) -> tuple[int, int]:
    counts = re.fullmatch(r"([0-9]{1,4})\s*[xX×]\s*([0-9]{1,4})", text)
    if not counts:
        raise _NoBoard(f"{text!r} is no pair of numbers such as 9x6")
    columns, rows = int(counts[1]), int(counts[2])
    too_small = min(columns, rows) < (2 if kind in ("circles", "acircles") else 3)
    if too_small or columns * rows > 20_000:
        raise _NoBoard(
            f"a board of {columns} x {rows} {'squares' if kind == 'charuco' else 'points'}"
            f" {'is too small' if too_small else 'is too large'}"
        )
    return columns, rows


def _board_length(text: str) -> float:
    match = re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+)\s*([a-z]*)", text)
    if not match or match[2] not in _LENGTHS:
        raise _NoBoard(f"{text!r} is no length with its unit (m, cm, mm)")
    length = float(match[1]) * _LENGTHS[match[2]]
    if not 1e-4 <= length <= 10:
        raise _NoBoard(f"a distance of {length:g} m is not that of a board")
    return length


def _dictionary_name(text: str) -> str:
    wanted = text.upper().removeprefix("DICT_")
    for name in _dictionaries():
        if name.upper() == wanted:
            return name
    raise _NoBoard(f"there is no dictionary {text!r}; there are {', '.join(_dictionaries())}")


def _dictionaries() -> list[str]:
    return [f"{family}_{size}" for family in _FAMILIES for size in _FAMILY_SIZES] + list(_OTHER_DICTIONARIES)


def _length(metres: float) -> str:
    return f"{metres * 1e3:.6g}mm"


def plausible_camera(camera: Camera) -> tuple[str, str] | None:
    """Which value of a camera cannot be, and why; None: all can."""
    for name in ("fx", "fy"):
        value = getattr(camera, name)
        if not (value > 0 and camera.width / 100 < value < camera.width * _LARGEST_RATIO):
            return (
                name,
                (
                    f"found {value:g}, expected a focal length in pixels, of about the image's width"
                    f" ({camera.width})"
                ),
            )
    if not 0.5 < camera.fx / camera.fy < 2:
        return (
            "fy",
            f"found {camera.fy:g} beside fx {camera.fx:g}, expected nearly equal focal lengths in pixels",
        )
    for name, size, what in (("cx", camera.width, "width"), ("cy", camera.height, "height")):
        if not 0 < getattr(camera, name) < size:
            return (
                name,
                (
                    f"found {getattr(camera, name):g}, outside the image's {what} of {size} pixels: are these"
                    " the values of images of another size?"
                ),
            )
    return None


# ---- Finding -------------------------------------------------------------------------------------


def opencv(purpose: str) -> Any:
    """OpenCV; InputError where it is not there. purpose: what needs it, for the message."""
    # A header of a few bytes may promise any number of pixels. OpenCV reads its limit, else a thousand
    # million, from here when it is loaded.
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(_MOST_PIXELS))
    try:
        import cv2
    except ImportError as error:
        missing = error.name == "cv2"
        why = "which is not installed" if missing else f"which cannot be imported ({error})"
        raise InputError(
            f'{purpose} needs OpenCV, {why}: pip install "truing[images]" (or opencv-python-headless)'
        ) from None
    return cv2


def find_board(
    images: Sequence[Path | str | Image],
    board: Board | str,
    *,
    camera: Camera | None = None,
    names: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    where: str = "",
) -> BoardViews:
    """Find a board in images: its points to a fraction of a pixel, and its pose in each.

    images: files, or arrays of grey values (or BGR), shape=(height, width). camera: its values; None: they
    are found from these images.
    names: what messages call the images. where: what messages call the camera's file. progress: called with
    images done, and images in all.

    Images without the board are listed in the result. Raises InputError when fewer than three show it (and
    says which board they do show), when images differ in size, when the camera is not theirs, or OpenCV is
    not there.
    """
    cv = opencv("finding a board in images")
    called = (
        [str(name) for name in names]
        if names is not None
        else [
            str(image) if isinstance(image, (str, Path)) else f"image {k}" for k, image in enumerate(images)
        ]
    )
    board = parse_board(board) if isinstance(board, str) else board
    if camera is None and board.kind == "apriltag" and board.columns * board.rows == 1:
        raise InputError(
            f"one tag ({board}) has four corners, too few to find the camera's values from: give --camera"
        )
    search = _Search(cv, board, called, camera, where)
    if progress is not None:
        progress(0, len(images))
    for number, image in enumerate(images):
        search.look(number, image)
        if progress is not None:
            progress(number + 1, len(images))
    search.look_again(images)
    search.refuse_other_sizes()
    board, seen = search.board, search.seen
    found = sorted(seen)
    missing = [number for number in range(len(images)) if number not in seen]
    if len(found) < _FEWEST_VIEWS:
        _refuse_too_few(cv, images, called, board, found, missing)
    assert search.size is not None
    points, pixels = [seen[number][0] for number in found], [seen[number][1] for number in found]
    larger = _larger_board(cv, [images[number] for number in found[:2]], board)
    if larger is not None:
        raise InputError(
            f"the board in the images is larger than {board}: {larger} is found as well, and of {board}"
            f" nobody knows which part; say --board {larger}"
        )
    radius = search.dot_radius()
    return _with_poses(
        cv, board, images, called, found, missing, points, pixels, search.size, camera, where, radius
    )


class _Search:
    """Looks for a board in one image after the other. The first that shows a ChArUco board settles which
    dictionary it has.
    """

    def __init__(
        self, cv: Any, board: Board, called: Sequence[str], camera: Camera | None, where: str
    ) -> None:
        self.board = board
        self.size: tuple[int, int] | None = None  # of every image [px]
        self.seen: dict[int, tuple[Floats, Floats]] = {}  # points and pixels, by the image's number
        self._cv, self._called, self._camera, self._where = cv, called, camera, where
        self._finder: _Finder | None = None if board.kind == "charuco" else _Finder(cv, board)
        self._undecided: list[int] = []  # images that were looked at before the dictionary was known

    def look(self, number: int, image: Path | str | Image) -> None:
        grey = _grey(self._cv, image, self._called[number])
        self._check_size(number, (grey.shape[1], grey.shape[0]))
        if self._finder is None:
            self._finder = _charuco_finder(self._cv, self.board, grey)
            if self._finder is None:
                self._undecided.append(number)
                return
            self.board = self._finder.board
        self._find(number, grey)

    def look_again(self, images: Sequence[Path | str | Image]) -> None:
        """At the images that were seen before the dictionary was known."""
        if self._finder is not None:
            for number in self._undecided:
                self._find(number, _grey(self._cv, images[number], self._called[number]))

    def dot_radius(self) -> float:
        """[m] 0 where there are no dots."""
        return self._finder.dot_radius() if self._finder is not None else 0.0

    def refuse_other_sizes(self) -> None:
        """Raises InputError where markers are of another size beside their squares than was said, or tags not
        as far apart: then nothing else is right.
        """
        if self._finder is None:
            return
        marker = self._finder.marker_seen()
        if marker is not None:
            board = self.board
            raise InputError(
                f"--board {board}: markers in the images have {marker / board.size:.3g} times the side of"
                f" their squares ({marker * 1e3:.3g} mm of {board.size * 1e3:.4g} mm), and what was said is"
                f" {board.marker / board.size:.3g} times: measure both on the board"
            )
        spacing = self._finder.spacing_seen()
        if spacing is None:
            return
        said, side = self.board.spacing, self.board.size * 1e3
        raise InputError(
            f"--board {self.board}: between neighbouring tags are gaps of {spacing:.3g} times their side in"
            f" the images ({spacing * side:.3g} mm of {side:.4g} mm), and the spacing that was said is"
            f" {said:g}: measure side (its black border included) and gap on the board"
        )

    def _find(self, number: int, grey: Image) -> None:
        assert self._finder is not None
        hit = self._finder(grey)
        if hit is not None:
            self.seen[number] = hit

    def _check_size(self, number: int, size: tuple[int, int]) -> None:
        if self.size is None:
            self.size = size
            _check_size(self._camera, size, self._called[number], self._where)
        elif self.size != size:
            raise InputError(
                f"{self._called[number]}: has {size[0]} x {size[1]} pixels, but {self._called[0]} has"
                f" {self.size[0]} x {self.size[1]}: expected images of one camera, all of one size"
            )


def _grey(cv: Any, image: Path | str | Image, name: str) -> Image:
    if isinstance(image, (str, Path)):
        try:
            require_whole_file(Path(image))
            data = np.frombuffer(Path(image).read_bytes(), dtype=np.uint8)
            grey = cv.imdecode(data, cv.IMREAD_GRAYSCALE | cv.IMREAD_ANYDEPTH) if data.size else None
        except OSError as error:
            raise InputError(f"{name}: cannot be read: {error.strerror}") from None
        except cv.error:
            raise InputError(
                f"{name}: cannot be decoded: damaged, or more than {_MOST_PIXELS // 10**6} million pixels"
            ) from None
        if grey is None:
            raise InputError(f"{name}: is no image that OpenCV can read (PNG, JPEG, TIFF, BMP …)")
    else:
        grey = np.asarray(image)
        if grey.ndim == 3:
            grey = cv.cvtColor(grey, cv.COLOR_BGR2GRAY)
    grey = _eight_bits(grey)
    if grey.dtype != np.uint8 or grey.ndim != 2:
        raise InputError(
            f"{name}: found pixels of {grey.dtype}, shape {grey.shape}, expected grey values of 8 or 16 bits,"
            " shape (height, width)"
        )
    if min(grey.shape) < 32:
        raise InputError(f"{name}: has {grey.shape[1]} x {grey.shape[0]} pixels only")
    return np.ascontiguousarray(grey)


def _eight_bits(grey: NDArray[Any]) -> NDArray[Any]:
    """Of pixels of 16 bits the highest eight that are used: cameras write their 10 or 12 bits so."""
    if grey.dtype != np.uint16:
        return grey
    spare = max(0, int(grey.max()).bit_length() - 8)
    return (grey >> spare).astype(np.uint8)


def _check_size(camera: Camera | None, size: tuple[int, int], name: str, where: str) -> None:
    if camera is None or (camera.width, camera.height) == size:
        return
    whose = where or "the camera"
    ratio = size[0] / camera.width
    hint = (
        f" If the images were only scaled: fx, fy, cx and cy are those of {whose} times {ratio:.6g}."
        if abs(size[1] / camera.height - ratio) < 1e-3
        else ""
    )
    raise InputError(
        f"{name}: has {size[0]} x {size[1]} pixels, but the values of {whose} are for {camera.width} x"
        f" {camera.height}.{hint} Leave the camera out, and its values are found from the images"
    )


class _Finder:
    """Finds one board, image by image: its points, shape=(m, 3) [m], and where they are seen, shape=(m, 2)
    [px].
    """

    def __init__(self, cv: Any, board: Board, *, quick: bool = False) -> None:
        self.cv = cv
        self.board = board
        self._quick = quick
        self._points = board.points
        self._detector: Any = _charuco_detector(cv, board) if board.kind == "charuco" else None
        self._tags = TagFinder(cv, board.tags) if board.kind == "apriltag" else None
        self._radii: list[float] = []  # [m] of dots, of images
        self._markers: list[tuple[float, float]] = []  # of images, sides of ArUco markers: [m], [px]

    def __call__(self, grey: Image) -> tuple[Floats, Floats] | None:
        try:
            if self.board.kind == "charuco":
                return self._charuco(grey)
            if self._tags is not None:
                return self._tags(grey)
            pixels = self._chessboard(grey) if self.board.kind == "chessboard" else self._circles(grey)
        except self.cv.error:  # its searches give up on odd images so
            return None
        return None if pixels is None else (self._points, pixels)

    def spacing_seen(self) -> float | None:
        """Of a grid of tags, where it is another one than was said: gap between two over their side."""
        return None if self._tags is None else self._tags.spacing_seen()

    def marker_seen(self) -> float | None:
        """Of a ChArUco board, where it is another one than was said: side of a marker [m]."""
        if not self._markers:
            return None
        side, pixels = np.median(self._markers, axis=0)
        allowed = _MARKER + _MARKER_EDGE / pixels
        return float(side) if abs(side / self.board.marker - 1.0) > allowed else None

    # -- chessboard

    def _chessboard(self, grey: Image) -> Floats | None:
        cv, shape = self.cv, (self.board.columns, self.board.rows)
        usual = cv.CALIB_CB_NORMALIZE_IMAGE | cv.CALIB_CB_ACCURACY
        for flags in (usual,) if self._quick else (usual, usual | cv.CALIB_CB_EXHAUSTIVE):
            found, corners = cv.findChessboardCornersSB(grey, shape, flags=flags)
            if found:
                return self._in_order(grey, np.asarray(corners, dtype=np.float64).reshape(-1, 2))
        if self._quick:
            return None
        found, corners = cv.findChessboardCorners(
            grey,
            shape,
            flags=cv.CALIB_CB_ADAPTIVE_THRESH | cv.CALIB_CB_NORMALIZE_IMAGE | cv.CALIB_CB_FAST_CHECK,
        )
        if not found:
            return None
        corners = np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2)
        step = float(
            np.median(
                np.linalg.norm(
                    np.diff(corners.reshape(self.board.rows, self.board.columns, 2), axis=1), axis=2
                )
            )
        )
        half = max(2, min(11, int(step / 3)))
        corners = cv.cornerSubPix(
            grey,
            corners,
            (half, half),
            (-1, -1),
            (cv.TERM_CRITERIA_EPS | cv.TERM_CRITERIA_MAX_ITER, 50, 1e-3),
        )
        return self._in_order(grey, np.asarray(corners, dtype=np.float64).reshape(-1, 2))

    def _in_order(self, grey: Image, pixels: Floats) -> Floats:
        """The corners so that the frame is right-handed and the first square is dark: what is left to choose,
        the board's symmetries are.
        """
        grid = _right_handed(pixels.reshape(self.board.rows, self.board.columns, 2))
        if not _first_square_is_dark(grey, grid):
            if (self.board.columns + self.board.rows) % 2:
                grid = grid[::-1, ::-1]
            elif self.board.columns == self.board.rows:
                grid = np.transpose(grid, (1, 0, 2))[:, ::-1]  # by 90 degrees
        return np.ascontiguousarray(grid).reshape(-1, 2)

    # -- dots

    def _circles(self, grey: Image) -> Floats | None:
        cv, shape = self.cv, (self.board.columns, self.board.rows)
        flags = cv.CALIB_CB_SYMMETRIC_GRID if self.board.kind == "circles" else cv.CALIB_CB_ASYMMETRIC_GRID
        tries = [
            (image, effort, extra)
            for image in (grey, 255 - grey)
            for effort, extra in ((0, 0), (1, 0), (1, cv.CALIB_CB_CLUSTERING))
        ]
        for image, effort, extra in tries[: 1 if self._quick else None]:
            found, centres = cv.findCirclesGrid(
                image, shape, flags=flags | extra, blobDetector=self._blobs(grey, effort)
            )
            if found:
                pixels, area = _dot_middles(cv, image, np.asarray(centres, dtype=np.float64).reshape(-1, 2))
                grid = pixels.reshape(self.board.rows, self.board.columns, 2)
                ordered = (
                    _right_handed(grid).reshape(-1, 2)
                    if self.board.kind == "circles"
                    else self._asymmetric(grid)
                )
                if ordered is not None:
                    self._measure_dots(ordered, area)
                return ordered
        return None

    def _measure_dots(self, pixels: Floats, area: float) -> None:
        """Their radius, from the area [px^2] of the usual one; a homography H scales areas by det H / w^3."""
        H, _ = self.cv.findHomography(self._points[:, :2], pixels)
        if H is None or not math.isfinite(area):
            return
        w = np.column_stack([self._points[:, :2], np.ones(len(pixels))]) @ np.asarray(H)[2]
        scale = float(np.median(np.linalg.det(H) / w**3))
        if scale > 0:
            self._radii.append(math.sqrt(area / scale / math.pi))

    def dot_radius(self) -> float:
        """[m] of dots as they are seen; 0: it is no board of dots, or they were not measured."""
        return float(np.median(self._radii)) if self._radii else 0.0

    def _asymmetric(self, grid: Floats) -> Floats | None:
        """Of the orders in which the rows may have been counted, the one that a plane shows so."""
        best: tuple[float, Floats | None] = (math.inf, None)
        for order in (grid, grid[::-1, ::-1], grid[::-1], grid[:, ::-1]):
            pixels = np.ascontiguousarray(order).reshape(-1, 2)
            H, _ = self.cv.findHomography(self._points[:, :2], pixels)
            if H is None or _handedness(order) <= 0:
                continue
            mapped = np.column_stack([self._points[:, :2], np.ones(len(pixels))]) @ np.asarray(H).T
            off = float(np.sqrt(np.mean(np.sum((mapped[:, :2] / mapped[:, 2:] - pixels) ** 2, axis=1))))
            if off < 0.9 * best[0]:
                best = (off, pixels)
        step = float(np.median(np.linalg.norm(np.diff(grid, axis=1), axis=2)))
        return best[1] if best[0] < 0.2 * step else None

    def _blobs(self, grey: Image, effort: int) -> Any:
        parameters = self.cv.SimpleBlobDetector_Params()
        if effort:
            cell = grey.size / (self.board.columns * self.board.rows)
            parameters.minArea, parameters.maxArea = 12.0, max(5000.0, cell)
            parameters.minDistBetweenBlobs = 4.0
            parameters.filterByConvexity, parameters.minConvexity = True, 0.85
            parameters.thresholdStep = 6.0
        return self.cv.SimpleBlobDetector_create(parameters)

    # -- ChArUco

    def _charuco(self, grey: Image) -> tuple[Floats, Floats] | None:
        corners, identities, markers, numbers = self._detector.detectBoard(grey)
        if numbers is not None:
            self._measure_markers(np.asarray(markers, dtype=np.float64), np.asarray(numbers).ravel())
        if identities is None or len(identities) < _FEWEST_POINTS:
            return None
        order = np.asarray(identities).ravel()
        points, pixels = self._points[order], np.asarray(corners, dtype=np.float64).reshape(-1, 2)
        flat = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if flat[1] < 0.1 * flat[0]:  # corners in one line fix no pose
            return None
        # Corners that no plane shows so are misplaced; where the counts are others than was said, most are.
        square = (
            self.board.size
            * float(np.linalg.norm(np.ptp(pixels, axis=0)))
            / float(np.linalg.norm(np.ptp(points, axis=0)))
        )
        H, inside = self.cv.findHomography(points[:, :2], pixels, self.cv.RANSAC, 0.25 * square)
        if H is None:
            return None
        good = np.asarray(inside).ravel() > 0
        return (points[good], pixels[good]) if good.sum() >= max(_FEWEST_POINTS, 0.7 * len(good)) else None

    def _measure_markers(self, markers: Floats, numbers: NDArray[np.intp]) -> None:
        """Sides of the markers in an image. Their middles are where they are whatever their size is."""
        on_board = np.asarray(self._detector.getBoard().getObjPoints(), dtype=np.float64)[:, :, :2]
        markers = markers.reshape(-1, 4, 2)[numbers < len(on_board)]
        numbers = numbers[numbers < len(on_board)]
        if len(numbers) < _FEWEST_MARKERS:
            return
        middles = on_board[numbers].mean(axis=1)
        H, _ = self.cv.findHomography(markers.mean(axis=1), middles, self.cv.RANSAC, 0.1 * self.board.size)
        if H is None:
            return
        flat = self.cv.perspectiveTransform(markers.reshape(-1, 1, 2), H).reshape(-1, 4, 2)
        sides = [np.linalg.norm(one - np.roll(one, 1, axis=1), axis=2) for one in (flat, markers)]
        self._markers.append((float(np.median(sides[0])), float(np.median(sides[1]))))


def _charuco_detector(cv: Any, board: Board) -> Any:
    if not hasattr(cv, "aruco") or not hasattr(cv.aruco, "CharucoDetector"):
        raise InputError(
            f"a ChArUco board needs OpenCV 4.8 or newer with its ArUco module, found {cv.__version__}: pip"
            " install opencv-python-headless"
        )
    dictionary = cv.aruco.getPredefinedDictionary(getattr(cv.aruco, f"DICT_{board.dictionary}"))
    pattern = cv.aruco.CharucoBoard((board.columns, board.rows), board.size, board.marker, dictionary)
    if hasattr(pattern, "setLegacyPattern"):
        pattern.setLegacyPattern(bool(board.legacy))
    parameters = cv.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = (
        cv.aruco.CORNER_REFINE_NONE
    )  # that of the chessboard corners is another, and always done
    # The usual ones are quick and miss markers that are small in the image.
    (
        parameters.adaptiveThreshWinSizeMax,
        parameters.adaptiveThreshWinSizeStep,
        parameters.minMarkerPerimeterRate,
    ) = (
        43,
        4,
        0.01,
    )
    corners = cv.aruco.CharucoParameters()
    corners.minMarkers = 1  # of the two beside a corner: a plane tells below where a corner was misplaced
    return cv.aruco.CharucoDetector(pattern, corners, parameters)


def _charuco_finder(cv: Any, board: Board, grey: Image) -> _Finder | None:
    """The dictionary and pattern (OpenCV changed it in 4.6 for boards with an even number of rows) that
    explain most of an image; None: no such board there.
    """
    dictionary = board.dictionary or _dictionary(cv, grey, board.columns * board.rows // 2)
    patterns = [board.legacy] if board.legacy is not None else [False] if board.rows % 2 else [False, True]
    best: tuple[int, _Finder | None] = (_FEWEST_POINTS - 1, None)
    for legacy in patterns if dictionary else ():
        finder = _Finder(cv, replace(board, dictionary=dictionary, legacy=bool(legacy)))
        hit = finder(grey)
        if hit is not None and len(hit[0]) > best[0]:
            best = (len(hit[0]), finder)
    return best[1]


def _dictionary(cv: Any, grey: Image, markers: int) -> str:
    """The dictionary that most markers in an image are of, in the smallest size that has so many markers;
    empty: there are none.
    """
    return _smallest(_markers_in(cv, grey)[0], markers)


def _smallest(family: str, markers: int) -> str:
    """The dictionary of a family: a smaller size begins with the same markers."""
    if family not in _FAMILIES:
        return family
    return f"{family}_{next((size for size in _FAMILY_SIZES if size >= markers), _FAMILY_SIZES[-1])}"


def _markers_in_all(cv: Any, images: Sequence[Image]) -> tuple[str, int]:
    """The family of markers in images, and how many they are by the highest number; empty: there are none."""
    families, numbers = zip(*(_markers_in(cv, grey) for grey in images), strict=True) if images else ((), ())
    family = max(families, key=families.count, default="")
    alike = [seen for name, seen in zip(families, numbers, strict=True) if name == family and seen]
    return (family, max(map(max, alike)) + 1) if alike else ("", 0)


def _markers_in(cv: Any, grey: Image) -> tuple[str, list[int]]:
    """The family that most markers in an image are of, and their numbers; empty: there are none."""
    best: tuple[str, list[int]] = ("", [])
    if not hasattr(cv, "aruco"):
        return best
    for name in [f"{family}_{_FAMILY_SIZES[-1]}" for family in _FAMILIES] + list(_OTHER_DICTIONARIES):
        if not hasattr(cv.aruco, f"DICT_{name}"):
            continue
        _, identities, _ = cv.aruco.ArucoDetector(
            cv.aruco.getPredefinedDictionary(getattr(cv.aruco, f"DICT_{name}"))
        ).detectMarkers(grey)
        numbers = [] if identities is None else np.unique(identities).tolist()
        if len(numbers) > max(1, len(best[1])):
            best = (name.removesuffix(f"_{_FAMILY_SIZES[-1]}"), numbers)
    return best


def _handedness(grid: Floats) -> float:
    """Above 0 where columns run clockwise before rows, as on a board seen from its front."""
    x, y = grid[:, -1].mean(axis=0) - grid[:, 0].mean(axis=0), grid[-1].mean(axis=0) - grid[0].mean(axis=0)
    return float(x[0] * y[1] - x[1] * y[0])


def _right_handed(grid: Floats) -> Floats:
    return grid if _handedness(grid) > 0 else grid[:, ::-1]


def _first_square_is_dark(grey: Image, grid: Floats) -> bool:
    """Whether squares such as the one between the first four corners are darker than their neighbours."""
    rows, columns = grid.shape[:2]
    middles = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:])
    place = np.clip(np.rint(middles).astype(np.intp), 0, [grey.shape[1] - 1, grey.shape[0] - 1])
    values = grey[place[..., 1], place[..., 0]].astype(np.float64)
    alike = (np.add.outer(np.arange(rows - 1), np.arange(columns - 1)) % 2) == 0
    return bool(values[alike].mean() < values[~alike].mean())


def _dot_middles(cv: Any, grey: Image, centres: Floats) -> tuple[Floats, float]:
    """Centres of gravity of the dots: dark grey values around each, weighed by how dark they are. And the
    area of the usual dot [px^2], NaN where none could be weighed.
    """
    nearest = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    np.fill_diagonal(nearest, np.inf)
    out, areas = centres.copy(), []
    for k, (x, y) in enumerate(centres):
        half = int(np.clip(0.6 * nearest[k].min(), 3, 200))
        left, top = max(0, round(x) - half), max(0, round(y) - half)
        window = grey[top : round(y) + half + 1, left : round(x) + half + 1].astype(np.float64)
        if min(window.shape) < 5:
            continue
        bright, dark = np.percentile(window, 90), np.percentile(window, 2)
        if bright - dark < 20:
            continue
        inside = (window < 0.5 * (bright + dark)).astype(np.uint8)
        _, labels = cv.connectedComponents(inside, connectivity=4)
        row, column = round(y) - top, round(x) - left
        if not (0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]) or labels[row, column] == 0:
            continue
        own = (labels == labels[row, column]).astype(np.uint8)
        if own[0].any() or own[-1].any() or own[:, 0].any() or own[:, -1].any():  # runs into something
            continue
        own = cv.dilate(own, np.ones((5, 5), np.uint8))
        level = (
            np.median(window[(own == 0) & (inside == 0)]) if ((own == 0) & (inside == 0)).any() else bright
        )
        weight = np.clip(level - window, 0.0, None) * own
        weight[weight < 0.05 * (level - dark)] = 0.0  # noise of the paper
        total = weight.sum()
        if total > 0:
            yy, xx = np.mgrid[0 : window.shape[0], 0 : window.shape[1]]
            out[k] = left + (weight * xx).sum() / total, top + (weight * yy).sum() / total
            areas.append(total / (level - dark))
    return out, float(np.median(areas)) if areas else math.nan


# ---- Another board than was said -----------------------------------------------------------------


def _neighbours(board: Board) -> list[Board]:
    """What the board may be instead: squares counted for corners, a row too few, rows and columns exchanged,
    another kind.
    """
    c, r = board.columns, board.rows
    pairs = [
        (c - 1, r - 1),
        (c + 1, r + 1),
        (r, c),
        (c - 1, r),
        (c, r - 1),
        (c + 1, r),
        (c, r + 1),
        (r - 1, c - 1),
        (r + 1, c + 1),
    ]
    odd, tags = board.kind == "acircles", board.kind == "apriltag"
    out = [
        replace(board, columns=x, rows=y, legacy=None, dictionary=board.dictionary if tags else "")
        for x, y in dict.fromkeys(pairs)
        if min(x, y) >= (1 if tags else 3) and (x, y) != (c, r) and not (odd and y % 2 == 0)
    ]
    if board.kind == "charuco":
        out = [
            replace(board, legacy=None, dictionary=""),
            *out,
            Board("chessboard", max(2, c - 1), max(2, r - 1), board.size),
        ]
    elif board.kind == "chessboard":
        out += [
            Board("charuco", c + 1, r + 1, board.size, 0.75 * board.size),
            Board("charuco", c, r, board.size, 0.75 * board.size),
            Board("circles", c, r, board.size),
        ]
    elif board.kind == "circles":
        out += [
            Board("chessboard", c, r, board.size),
            *([Board("acircles", c, r, board.size)] if r % 2 else []),
        ]
    elif board.kind == "acircles":
        out += [Board("circles", c, r, board.size)]
    return out


def _hits(cv: Any, images: Sequence[Image], board: Board) -> tuple[int, float]:
    """In how many images the board is, and how much of it: points seen, less half of those that are not."""
    count, points = 0, 0.0
    finder = None if board.kind == "charuco" else _Finder(cv, board, quick=True)
    for grey in images:
        finder = finder if finder is not None else _charuco_finder(cv, board, grey)
        hit = finder(grey) if finder is not None else None
        if hit is not None:
            count, points = count + 1, points + 1.5 * len(hit[0]) - 0.5 * len(board.points)
    return count, points


def _refuse_too_few(
    cv: Any,
    images: Sequence[Path | str | Image],
    called: Sequence[str],
    board: Board,
    found: Sequence[int],
    missing: Sequence[int],
) -> None:
    """Raises InputError: which images do not show the board, and which board they seem to show."""
    which = ", ".join(called[number] for number in missing[:8]) + (
        f" … ({len(missing)} in all)" if len(missing) > 8 else ""
    )
    head = (
        f"the board {board} was found in {len(found)} of {len(images)} images, expected at least"
        f" {_FEWEST_VIEWS}"
    )
    tried = [
        _grey(cv, images[number], called[number])
        for number in missing[:: max(1, len(missing) // _TRIED)][:_TRIED]
    ]
    if board.kind == "apriltag":
        raise InputError(f"{head}; {_aruco_in_sight(cv, tried)}{_tags_in_sight(cv, tried, board)}")
    best, hits, family = _board_in_sight(cv, tried, board)
    if best is not None and hits >= 0.5 * len(tried):
        counting = ""
        if board.kind == best.kind == "chessboard" and (
            best.columns - board.columns,
            best.rows - board.rows,
        ) in ((-1, -1), (1, 1)):
            counting = (
                ": count inner corners, where four squares meet, not squares"
                if best.columns < board.columns
                else ": these are one more each way than was said"
            )
        if best.kind == "charuco" and board.dictionary and not board.dictionary.startswith(family):
            counting = f": its markers are of {family}, not of {board.dictionary}"
        named = f"{best.kind}:{best.columns}x{best.rows}"
        best = replace(best, dictionary="", legacy=None)
        say = f"--board {best}" if best.kind == board.kind else f"--board {named}:… with its size"
        raise InputError(
            f"{head}; but {named} is in {hits} of the {len(tried)} that were looked at again{counting}. Say"
            f" {say}"
        )
    if board.kind == "charuco" and _hits(cv, [grey[:, ::-1].copy() for grey in tried], board)[0]:
        raise InputError(f"{head}; but it is there in mirrored images: give them as the camera took them")
    margin = {
        "chessboard": "its white margin",
        "charuco": "its markers",
        "circles": "all of its dots",
        "acircles": "all of its dots",
    }[board.kind]
    raise InputError(
        f"{head}; not found in {which}. Boards of neighbouring counts are not there either: does every image"
        f" show the whole board, sharp and evenly lit, with {margin}? Expected {_EXPECTED}"
    )


def _board_in_sight(cv: Any, tried: Sequence[Image], board: Board) -> tuple[Board | None, int, str]:
    """The board that images seem to show instead, in how many of them, and the family of their markers."""
    best, most = None, (0, -math.inf)
    # Of a grid of dots, and of numbered corners, a smaller one is found as well: most points win.
    family, markers = _markers_in_all(cv, tried)
    others = [other for other in _neighbours(board) if other.kind != "charuco" or markers]
    others.sort(key=lambda other: other.kind == "charuco" and other.columns * other.rows // 2 != markers)
    for other in others:
        if other.kind == "charuco":
            other = replace(other, dictionary=_smallest(family, other.columns * other.rows // 2))
        this = _hits(cv, tried, other)
        if this > most:
            best, most = other, this
        if other.kind == "charuco" and most[1] >= 0.85 * len(tried) * len(other.points):
            break  # a row more would find its corners at this board's edge
    return best, most[0], family


def _aruco_in_sight(cv: Any, images: Sequence[Image]) -> str:
    """A hint at a ChArUco board where another one was named."""
    family, markers = _markers_in_all(cv, images)
    if family not in _FAMILIES:
        return ""
    return f"ArUco markers of {family} are there, numbers up to {markers - 1} (is it a ChArUco board?); "


def _tags_in_sight(cv: Any, images: Sequence[Image], board: Board) -> str:
    """Which tags are there instead, of this family and of others."""
    said = []
    for family in dict.fromkeys((board.dictionary, *TAG_FAMILIES)):
        finder = TagFinder(cv, replace(board, dictionary=family).tags)
        seen = [numbers for numbers in map(finder.in_sight, images) if numbers]
        if len(seen) >= 0.5 * len(images) and (family == board.dictionary or max(map(len, seen)) > 1):
            lowest, highest = min(map(min, seen)), max(map(max, seen))
            said.append(f"tags of {family} with numbers from {lowest} to {highest} in {len(seen)}")
    if not said:
        return (
            f"no tags of {', '.join(TAG_FAMILIES)} are in the {len(images)} that were looked at again: are"
            " they sharp, evenly lit and printed with their white margin?"
        )
    count = board.columns * board.rows
    expected_tags = (
        f"{' and '.join(said)} of the {len(images)} that were looked at again, expected those of"
        f" {board.dictionary} from {board.first or 0} to {(board.first or 0) + count - 1}, counted from the"
        f" {'top left downward' if board.from_top else 'bottom left upward as Kalibr does'}"
    )
    other = replace(board, from_top=not board.from_top)
    finder = TagFinder(cv, other.tags)
    if sum(finder(image) is not None for image in images) >= 0.5 * len(images):
        return f"{expected_tags}; they are counted the other way: say --board {other}"
    return f"{expected_tags}: are family, counts and spacing right?"


def _larger_board(cv: Any, images: Sequence[Path | str | Image], board: Board) -> Board | None:
    """A board of more dots that contains the one that was named; of chessboards and ChArUco boards no part is
    taken for the whole.
    """
    if board.kind not in ("circles", "acircles"):
        return None
    greys = [_grey(cv, image, "") for image in images]
    steps = ((1, 1), (1, 0), (0, 1))
    for wide, high in steps:
        other = replace(
            board,
            columns=board.columns + wide,
            rows=board.rows + high * (2 if board.kind == "acircles" else 1),
        )
        if _hits(cv, greys, other)[0] == len(greys):
            return other
    return None


# ---- Poses and intrinsics ------------------------------------------------------------------------


def _matrix(camera: Camera) -> tuple[Floats, Floats]:
    return np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]]), np.asarray(
        camera.distortion, dtype=np.float64
    )


def _pose(cv: Any, points: Floats, pixels: Floats, camera: Camera) -> tuple[Floats, float]:
    """Pose of a flat board from one image, and its rms [px]. Two poses look nearly alike from afar: the one
    that fits better is taken.
    """
    matrix, distortion = _matrix(camera)
    # The flat-board solver wants the plane through the origin, and is at its best in the middle.
    middle = points.mean(axis=0)
    flat, seen = np.ascontiguousarray(points - middle), np.ascontiguousarray(pixels.reshape(-1, 1, 2))
    best, frame = math.inf, np.eye(4)
    count, turns, shifts, _ = cv.solvePnPGeneric(flat, seen, matrix, distortion, flags=cv.SOLVEPNP_IPPE)
    for turn, shift in zip(turns[:count], shifts[:count], strict=True):
        refined, moved = cv.solvePnPRefineLM(
            flat,
            seen,
            matrix,
            distortion,
            np.array(turn, dtype=np.float64),
            np.array(shift, dtype=np.float64),
        )
        predicted, _ = cv.projectPoints(flat, refined, moved, matrix, distortion)
        rms = float(np.sqrt(np.mean(np.sum((np.asarray(predicted).reshape(-1, 2) - pixels) ** 2, axis=1))))
        rotation, _ = cv.Rodrigues(refined)
        if math.isfinite(rms) and rms < best and float(np.asarray(moved).ravel()[2]) > 0:
            best, frame = rms, np.eye(4)
            frame[:3, :3] = _orthonormal(np.asarray(rotation, dtype=np.float64))
            frame[:3, 3] = np.asarray(moved, dtype=np.float64).ravel() - frame[:3, :3] @ middle
    return frame, best


def _poses(
    cv: Any, points: Sequence[Floats], pixels: Sequence[Floats], camera: Camera
) -> tuple[list[Floats], Floats]:
    """Of all images: poses of the board, and their rms [px]."""
    found = [_pose(cv, p, seen, camera) for p, seen in zip(points, pixels, strict=True)]
    return [frame for frame, _ in found], np.array([rms for _, rms in found])


def _well_placed(
    cv: Any, points: Sequence[Floats], pixels: Sequence[Floats], frames: Sequence[Floats], camera: Camera
) -> list[NDArray[np.bool_]]:
    """Which points are where the others of their image have them. A corner between small squares may be drawn
    to the edge of a marker: one that is off by a pixel bends pose and lens by more than all others tell.
    """
    matrix, distortion = _matrix(camera)
    off = []
    for object_points, seen, frame in zip(points, pixels, frames, strict=True):
        turn, shift = cv.Rodrigues(frame[:3, :3])[0], frame[:3, 3]
        predicted, _ = cv.projectPoints(object_points, turn, shift, matrix, distortion)
        off.append(np.linalg.norm(np.asarray(predicted).reshape(-1, 2) - seen, axis=1))
    usual = float(np.median(np.concatenate(off)))
    limits = [max(_LEAST_MISPLACED, _MISPLACED * max(usual, float(np.median(one)))) for one in off]
    right = [one <= limit for one, limit in zip(off, limits, strict=True)]
    return [
        mask if (~mask).mean() <= _MOST_MISPLACED and mask.sum() >= _FEWEST_POINTS else np.ones_like(mask)
        for mask in right
    ]


def _beside_centres(cv: Any, points: Floats, frame: Floats, camera: Camera, radius: float) -> Floats:
    """By how much the middle of each dot's picture lies beside the picture of its centre [px]: a dot's nearer
    half is larger (Heikkila 2000, "Geometric camera calibration using circular control points", section 2).
    """
    matrix, distortion = _matrix(camera)
    turn, shift = cv.Rodrigues(frame[:3, :3])[0], frame[:3, 3]
    angle = np.linspace(0.0, 2.0 * math.pi, _DOT_EDGE, endpoint=False)
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    both = np.concatenate([points[:, None], points[:, None] + ring], axis=1)  # centre, then edge
    pictures, _ = cv.projectPoints(both.reshape(-1, 3), turn, shift, matrix, distortion)
    pictures = np.asarray(pictures).reshape(len(points), -1, 2)
    edge = pictures[:, 1:] - pictures[:, :1]
    following = np.roll(edge, -1, axis=1)
    twice = edge[..., 0] * following[..., 1] - edge[..., 1] * following[..., 0]  # areas of triangles
    moments = ((edge + following) * twice[..., None]).sum(axis=1)
    return np.asarray(moments / (3.0 * twice.sum(axis=1)[:, None]))


def _chosen(values: Sequence[Floats], masks: Sequence[NDArray[np.bool_]]) -> list[Floats]:
    return [one[mask] for one, mask in zip(values, masks, strict=True)]


def _orthonormal(rotation: Floats) -> Floats:
    u, _, vt = np.linalg.svd(rotation)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _calibrate(
    cv: Any, points: Sequence[Floats], pixels: Sequence[Floats], size: tuple[int, int]
) -> tuple[Camera, float, float]:
    """Intrinsics from views of a board, their rms [px], and the standard error of the focal length over the
    focal length.
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, min(len(points), _CALIBRATION_VIEWS)).astype(np.intp))
    objects = [np.ascontiguousarray(points[k], dtype=np.float32).reshape(-1, 1, 3) for k in chosen]
    seen = [np.ascontiguousarray(pixels[k], dtype=np.float32).reshape(-1, 1, 2) for k in chosen]
    flags = cv.CALIB_FIX_K3 if len(chosen) < 10 else 0  # it bends what few images do not hold
    enough = (cv.TERM_CRITERIA_EPS | cv.TERM_CRITERIA_MAX_ITER, _CALIBRATION_STEPS, 1e-12)

    def fit(start: Floats | None, more: int = 0) -> Any:
        lens = None if start is None else np.zeros(5)
        return cv.calibrateCameraExtended(
            objects, seen, size, start, lens, flags=flags | more, criteria=enough
        )

    # OpenCV adds up what its threads did in the order in which they are done: on one the bits are the same
    # every time. Corners are found by as many as there are, each in a part of its own.
    threads = cv.getNumThreads()
    cv.setNumThreads(1)
    try:
        best = fit(None)
        for ratio in _OTHER_STARTS if not best[0] < _WORTH_A_LOOK else ():
            focal, middle = ratio * size[0], (0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
            start = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1.0]])
            best = min(best, fit(start, cv.CALIB_USE_INTRINSIC_GUESS), key=lambda found: found[0])
    finally:
        cv.setNumThreads(threads)
    rms, matrix, distortion, turns, _, sigma, _, _ = best
    coefficients = np.zeros(5)
    coefficients[: min(5, np.size(distortion))] = np.asarray(distortion).ravel()[:5]
    camera = Camera(
        width=size[0],
        height=size[1],
        fx=float(matrix[0, 0]),
        fy=float(matrix[1, 1]),
        cx=float(matrix[0, 2]),
        cy=float(matrix[1, 2]),
        distortion=coefficients.tolist(),
    )
    # Boards seen from the front look the same to every focal length, whatever its standard error says.
    tilt = max(math.acos(min(1.0, abs(float(np.asarray(cv.Rodrigues(turn)[0])[2, 2])))) for turn in turns)
    return (
        camera,
        float(rms),
        float(np.asarray(sigma).ravel()[0]) / float(matrix[0, 0]) if tilt > _LEAST_TILT else math.inf,
    )


def _calibrated(
    cv: Any, points: Sequence[Floats], pixels: Sequence[Floats], size: tuple[int, int]
) -> tuple[Camera, float]:
    """The camera and its rms [px]; raises InputError where the images do not hold it."""
    try:
        camera, rms, focal = _calibrate(cv, points, pixels, size)
    except cv.error as error:
        raise InputError(
            "the camera's values cannot be found from these images"
            f" ({str(error).strip().splitlines()[-1][:120]}): give --camera, or images with the board"
            " tilted by 20 to 40 degrees about different axes"
        ) from None
    if not math.isfinite(rms) or plausible_camera(camera) is not None or not focal < 0.1:
        raise InputError(
            "the camera's values cannot be found from these images: the focal length came out as"
            f" {camera.fx:.4g} px"
            + (f" ± {focal * camera.fx:.2g}" if math.isfinite(focal) else ", but no board is tilted")
            + ". "
            "Tilt the board against the camera by 20 to 40 degrees about different axes, or give --camera"
        )
    return camera, rms


def _with_poses(
    cv: Any,
    board: Board,
    images: Sequence[Path | str | Image],
    called: Sequence[str],
    found: Sequence[int],
    missing: Sequence[int],
    points: Sequence[Floats],
    pixels: Sequence[Floats],
    size: tuple[int, int],
    camera: Camera | None,
    where: str,
    dot_radius: float,
) -> BoardViews:
    given = camera is not None
    calibration_rms = math.nan
    limit = max(_BAD_PIXELS, _BAD_SHARE * size[0])
    if camera is None:
        camera, calibration_rms = _calibrated(cv, points, pixels, size)
        if calibration_rms > limit:
            raise InputError(_bad_fit(cv, images, called, found, board, calibration_rms))
    frames, errors = _poses(cv, points, pixels, camera)
    for _ in range(_MISPLACED_ROUNDS):
        right = _well_placed(cv, points, pixels, frames, camera)
        if all(mask.all() for mask in right):
            break
        points, pixels = _chosen(points, right), _chosen(pixels, right)
        if not given:
            camera, calibration_rms = _calibrated(cv, points, pixels, size)
        frames, errors = _poses(cv, points, pixels, camera)
    middles = pixels
    for _ in range(_DOT_ROUNDS if dot_radius > 0 else 0):
        pixels = [
            seen - _beside_centres(cv, p, frame, camera, dot_radius)
            for p, seen, frame in zip(points, middles, frames, strict=True)
        ]
        if not given:
            camera, calibration_rms = _calibrated(cv, points, pixels, size)
        frames, errors = _poses(cv, points, pixels, camera)
    usual = float(np.median(errors))
    if given and usual > _WORTH_A_LOOK:
        try:
            _, own, _ = _calibrate(cv, points, pixels, size)
        except cv.error:
            own = usual
        if own > limit:
            raise InputError(_bad_fit(cv, images, called, found, board, own))
        if usual > 3 * own:
            text = (
                f"{where or 'the camera'} does not fit the images: the board's points are off by {usual:.2g}"
                f" px (median rms), and by {own:.2g} px with values found from these images; leave the camera"
                " out, or have it refined"
            )
            if usual > limit:
                raise InputError(text)
            warnings.warn(InputWarning(text), stacklevel=3)
    good = np.isfinite(errors)
    if good.sum() < _FEWEST_VIEWS:
        raise InputError(
            f"the board {board} was found in {len(found)} images, but its pose could be found in"
            f" {int(good.sum())} only"
        )
    keep = np.flatnonzero(good).tolist()
    return BoardViews(
        board,
        tuple(found[k] for k in keep),
        tuple(sorted([*missing, *(found[k] for k in np.flatnonzero(~good).tolist())])),
        tuple(points[k] for k in keep),
        tuple(pixels[k] for k in keep),
        np.array([frames[k] for k in keep]),
        errors[keep],
        camera,
        not given,
        calibration_rms,
    )


def _bad_fit(
    cv: Any,
    images: Sequence[Path | str | Image],
    called: Sequence[str],
    found: Sequence[int],
    board: Board,
    rms: float,
) -> str:
    """The points are not where a board of this kind has them: says so, and which one they do fit."""
    tried = [
        _grey(cv, images[number], called[number])
        for number in found[:: max(1, len(found) // _TRIED)][:_TRIED]
    ]
    for other in sorted(_neighbours(board), key=lambda other: other.kind != "charuco"):
        if _hits(cv, tried, other)[0] == len(tried):
            return (
                f"the points found are not those of {board}: no camera sees them so, {rms:.3g} px rms are"
                f" left; {other.kind}:{other.columns}x{other.rows} is in the images as well: is it this one?"
            )
    return (
        f"the points found are not those of a flat board {board}: no camera sees them so, {rms:.3g} px rms"
        " are left. Is the board flat, and are its counts right?"
    )
