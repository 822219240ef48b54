# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses and cameras in OpenCV's own files (cv::FileStorage: YAML, XML or JSON).

Poses are found by the names that cv::calibrateHandEye gives its arguments: R_gripper2base, t_gripper2base,
R_target2cam, t_target2cam, or T_… for whole matrices.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from truing._core import Camera
from truing.errors import InputError
from truing.files.boards import opencv
from truing.files.common import decoded, listed, read_bytes
from truing.files.rigid import frames_from_parts, frames_from_rows
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]

_LARGEST_FILE = 20_000_000  # [bytes]
_MOST_NUMBERS = 2_000_000
_DEEPEST = 40  # OpenCV's parsers call themselves for each level
_HANDS = ("gripper", "hand", "flange", "tool", "ee", "eef", "end", "effector")
_BASES = ("base", "world", "robot")
_CAMERAS = ("cam", "camera", "sensor")
_BOARDS = ("target", "board", "marker", "object", "pattern", "chessboard")
_EXPECTED = (
    "R_gripper2base and t_gripper2base (or T_gripper2base) for the hand in the base, R_target2cam and"
    " t_target2cam (or T_target2cam) for the board in the camera"
)


@dataclass
class _Parts:
    """Numbers of one side, one row per pose, with the node's name."""

    rotations: tuple[str, Floats] | None = None  # shape=(n, 3, 3)
    positions: tuple[str, Floats] | None = None  # shape=(n, 3)
    poses: tuple[str, Floats] | None = None  # shape=(n, 12 or 16)
    inverted: bool = False
    numbered: dict[str, list[Floats]] = field(default_factory=dict)


def read_opencv_poses(path: Path) -> dict[str, Floats]:
    """Frames, shape=(n, 4, 4), by side: "hand" in the base, "board" in the camera; "either", of a single list
    of matrices whose name says nothing. Raises InputError that names the node.
    """
    nodes = _nodes(path)
    sides: dict[str, _Parts] = {}
    unnamed: dict[str, list[Floats]] = {}
    for name, arrays in nodes.items():
        side, inverted = _side_of(name)
        if side:
            parts = sides.setdefault(side, _Parts(inverted=inverted))
            if parts.inverted != inverted:
                _refuse(path, name, "found the other direction of poses that are there already: remove one")
            parts.numbered.setdefault(re.sub(r"_?[0-9]+$", "", name), []).extend(arrays)
        elif _is_poses(arrays):
            unnamed.setdefault(re.sub(r"_?[0-9]+$", "", name), []).extend(arrays)
    if not sides and len(unnamed) == 1:
        name, arrays = next(iter(unnamed.items()))
        return {"either": _whole(path, name, arrays)}
    if not sides:
        raise InputError(f"{path}: found the nodes {listed(list(nodes)) or '(none)'}, expected {_EXPECTED}")
    return {side: _frames(path, parts) for side, parts in sides.items()}


def read_opencv_camera_frame(path: Path) -> tuple[Literal["eye-in-hand", "eye-to-hand"] | None, Floats]:
    """What cv::calibrateHandEye gave: R_cam2gripper and t_cam2gripper, R_cam2base and t_cam2base, whole
    matrices, or the other way round; or one matrix whose name says nothing. The set-up that the name says,
    and T_parent_camera, shape=(4, 4). Raises InputError that names the node.
    """
    nodes = _nodes(path)
    sides: dict[str, _Parts] = {}
    unnamed: list[tuple[str, list[Floats]]] = []
    for name, arrays in nodes.items():
        side, inverted = _pair_of(
            name, (("eye-in-hand", _CAMERAS, _HANDS), ("eye-to-hand", _CAMERAS, _BASES))
        )
        if side:
            sides.setdefault(side, _Parts(inverted=inverted)).numbered.setdefault(name, []).extend(arrays)
        elif len(arrays) == 1 and _is_poses(arrays):
            unnamed.append((name, arrays))
    if len(sides) == 1:
        setup = cast('Literal["eye-in-hand", "eye-to-hand"]', next(iter(sides)))
        frames = _frames(path, sides[setup])
    elif not sides and len(unnamed) == 1:
        setup, frames = None, _whole(path, *unnamed[0])
    else:
        raise InputError(
            f"{path}: found the nodes {listed(list(nodes)) or '(none)'}, expected one camera: R_cam2gripper"
            " and t_cam2gripper (on the hand) or R_cam2base and t_cam2base (in the cell), or one 4 x 4 matrix"
        )
    if len(frames) != 1:
        raise InputError(f"{path}: found {len(frames)} cameras, expected one")
    return setup, frames[0]


def is_opencv_file(path: Path) -> bool:
    """Does the file hold matrices as cv::FileStorage writes them? Raises InputError: it cannot be read."""
    data = read_bytes(path, _LARGEST_FILE)
    return b"opencv-matrix" in data or b"opencv_storage" in data


def read_opencv_camera(path: Path) -> Camera:
    """camera_matrix, distortion_coefficients, image_width and image_height, as OpenCV's calibration program
    and its samples write them. Raises InputError that names the node.
    """
    nodes = _nodes(path)

    def numbers(what: str, *names: str) -> Floats:
        for name in names:
            if name in nodes:
                return np.concatenate([array.ravel() for array in nodes[name]])
        raise InputError(f"{path}: there is no node {names[0]} ({what}); found {listed(list(nodes))}")

    matrix = numbers("3 x 3", "camera_matrix", "Camera_Matrix", "cameraMatrix")
    distortion = numbers(
        "k1 k2 p1 p2 k3", "distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs"
    )
    width = numbers("pixels", "image_width", "image_Width")
    height = numbers("pixels", "image_height", "image_Height")
    if matrix.size != 9:
        _refuse(path, "camera_matrix", f"found {matrix.size} numbers, expected 9")
    if distortion.size > 5 and np.abs(distortion[5:]).max() > 0:
        _refuse(
            path,
            "distortion_coefficients",
            f"found {distortion.size} coefficients, expected 5, k1 k2 p1 p2 k3: more belong to another model,"
            " which is not read; calibrate the camera with five",
        )
    if not 4 <= distortion.size:
        _refuse(path, "distortion_coefficients", f"found {distortion.size} coefficients, expected 5 (or 4)")
    return Camera(
        width=int(width[0]),
        height=int(height[0]),
        fx=float(matrix[0]),
        fy=float(matrix[4]),
        cx=float(matrix[2]),
        cy=float(matrix[5]),
        distortion=[*map(float, distortion[:5]), *([0.0] * (5 - min(5, distortion.size)))],
    )


def _refuse(path: Path, name: str, message: str) -> NoReturn:
    raise InputError(f"{path}, node {name!r}: {message}")


# ---- What a name says ----------------------------------------------------------------------------


def _side_of(name: str) -> tuple[str, bool]:
    """ "hand" or "board" (empty: the name does not say), and whether the poses are the other way round."""
    words = re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower().replace("wrt", "2").replace("to", "2")
    words = re.sub(r"_?[0-9]+$", "", words)
    if words in ("rvecs", "tvecs", "extrinsic_parameters"):  # of cv::calibrateCamera
        return "board", False
    return _pair_of(words, (("hand", _HANDS, _BASES), ("board", _BOARDS, _CAMERAS)))


_Pairs = tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]


def _pair_of(name: str, pairs: _Pairs) -> tuple[str, bool]:
    """Which of `pairs` (a name, what is in it, in what) "cam2gripper" means, and whether turned round."""
    words = re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower().replace("wrt", "2").replace("to", "2")
    match = re.search(r"([a-z]+)_?2_?([a-z]+)$", words)
    if not match:
        return "", False
    a, b = match[1], match[2]
    for side, what, parent in pairs:
        if a in what and b in parent:
            return side, False
        if a in parent and b in what:
            return side, True
    return "", False


def _is_poses(arrays: list[Floats]) -> bool:
    return all(array.shape in ((4, 4), (3, 4)) or array.shape[-1] in (12, 16) for array in arrays)


# ---- Poses of one side ---------------------------------------------------------------------------


def _frames(path: Path, parts: _Parts) -> Floats:
    for name, arrays in parts.numbered.items():
        _sort_in(path, name, arrays, parts)
    if parts.poses is not None:
        name, values = parts.poses
        frames = frames_from_rows(values, lambda k: f"{path}, node {name!r}, pose {k}")[0]
    else:
        names = listed(list(parts.numbered))
        if parts.rotations is None or parts.positions is None:
            missing = "rotations" if parts.rotations is None else "positions"
            raise InputError(f"{path}: found {names} without {missing}, expected {_EXPECTED}")
        (name, rotations), (other, positions) = parts.rotations, parts.positions
        if len(rotations) != len(positions):
            _refuse(
                path, other, f"found {len(positions)} positions, expected {len(rotations)} as of {name!r}"
            )
        frames = frames_from_parts(rotations, positions, lambda k: f"{path}, node {name!r}, pose {k}")
    return np.asarray(np.linalg.inv(frames), dtype=np.float64) if parts.inverted else frames


def _sort_in(path: Path, name: str, arrays: list[Floats], parts: _Parts) -> None:
    first = name.lower()[0]
    size = arrays[0].shape
    if size in ((4, 4), (3, 4)) or size[-1] in (12, 16) or (size[-1] == 4 and size[0] % 4 == 0):
        parts.poses = name, _stacked(path, name, arrays, 4)
        return
    if size[-1] == 6:  # rotation vector and position
        rows = _rows(path, name, arrays, 6)
        parts.rotations = name, rotations_from_angles(rows[:, :3], "rotation-vector")
        parts.positions = name, rows[:, 3:]
    elif first == "t":
        parts.positions = name, _rows(path, name, arrays, 3)
    elif size == (3, 3) or size[-1] == 9 or _begins_with_rotation(arrays[0]):
        parts.rotations = name, _stacked(path, name, arrays, 3).reshape(-1, 3, 3)
    else:
        parts.rotations = name, rotations_from_angles(_rows(path, name, arrays, 3), "rotation-vector")


def _begins_with_rotation(array: Floats) -> bool:
    if array.ndim != 2 or array.shape[1] != 3 or array.shape[0] % 3:
        return False
    return bool(np.abs(array[:3] @ array[:3].T - np.eye(3)).max() < 1e-3)


def _rows(path: Path, name: str, arrays: list[Floats], width: int) -> Floats:
    """All numbers as rows of `width`."""
    for k, array in enumerate(arrays):
        if array.size % width:
            _refuse(path, f"{name}", f"entry {k} has {array.size} numbers, expected {width} for each pose")
    return np.concatenate([array.ravel() for array in arrays]).reshape(-1, width)


def _stacked(path: Path, name: str, arrays: list[Floats], rows: int) -> Floats:
    """Matrices one by one, below each other (of `rows` rows, or 3), or each in a row: as a row each."""
    height, width = arrays[0].shape
    if width in (3, 4):
        width *= rows if height % rows == 0 else 3
    return _rows(path, name, arrays, width)


def _whole(path: Path, name: str, arrays: list[Floats]) -> Floats:
    values = _stacked(path, name, arrays, 4)
    return frames_from_rows(values, lambda k: f"{path}, node {name!r}, pose {k}")[0]


# ---- The file ------------------------------------------------------------------------------------


def _nodes(path: Path) -> dict[str, list[Floats]]:
    """The nodes that hold numbers: a matrix each, or several. Others are passed over."""
    cv = opencv("a file of OpenCV (cv::FileStorage)")
    text = decoded(path, read_bytes(path, _LARGEST_FILE))
    _require_flat(path, text)
    try:
        storage = cv.FileStorage(text, cv.FILE_STORAGE_READ | cv.FILE_STORAGE_MEMORY)
        root = storage.root()
        if not storage.isOpened() or not root.isMap():
            raise InputError(f"{path}: is no file of OpenCV (cv::FileStorage), expected named matrices")
        nodes = {name: _arrays(path, name, root.getNode(name)) for name in root.keys()}
        storage.release()
    except (cv.error, SystemError, UnicodeDecodeError) as error:
        said = str(error).strip().splitlines()[0][:200] if str(error).strip() else "it is damaged"
        raise InputError(f"{path}: is no file of OpenCV (cv::FileStorage) that can be read: {said}") from None
    return {name: arrays for name, arrays in nodes.items() if arrays}


def _require_flat(path: Path, text: str) -> None:
    """Raises InputError on nesting that no matrices have."""
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        if text.lstrip("\ufeff \n").startswith("<"):
            depth += len(re.findall(r"<[A-Za-z_]", line)) - len(re.findall(r"</|/>", line))
        else:
            depth += sum(line.count(c) for c in "[{") - sum(line.count(c) for c in "]}")
        blanks = len(line) - len(line.lstrip(" -"))
        if depth > _DEEPEST or max(map(len, re.findall(r"[\[{<]+", line)), default=0) > _DEEPEST:
            raise InputError(f"{path}, line {number}: is nested too deeply for a file of matrices")
        if blanks > 10 * _DEEPEST:
            raise InputError(f"{path}, line {number}: is indented too deeply for a file of matrices")


def _arrays(path: Path, name: str, node: Any) -> list[Floats]:
    """A matrix, several, or numbers; none where the node holds something else."""
    if node.isReal() or node.isInt():
        return [np.array([[float(node.real())]])]
    if node.isMap():
        matrix = _matrix(path, name, node)
        return [] if matrix is None else [matrix]
    if not node.isSeq():
        return []
    items = [node.at(k) for k in range(min(node.size(), _MOST_NUMBERS + 1))]
    if items and all(item.isReal() or item.isInt() for item in items):
        return [_checked(path, name, np.array([[float(item.real()) for item in items]]))]
    out: list[Floats] = []
    for k, item in enumerate(items):
        part = _arrays(path, f"{name}[{k}]", item) if item.isMap() else _nested(path, f"{name}[{k}]", item)
        if not part:
            return []
        out += part
    return out


def _nested(path: Path, name: str, node: Any) -> list[Floats]:
    """A matrix as a list of lists."""
    if not node.isSeq():
        return []
    rows = [_arrays(path, name, node.at(k)) for k in range(node.size())]
    if rows and all(len(row) == 1 for row in rows) and len({row[0].size for row in rows}) == 1:
        return [np.array([row[0].ravel() for row in rows])]
    return []


def _matrix(path: Path, name: str, node: Any) -> Floats | None:
    parts = [node.getNode(part) for part in ("rows", "cols", "data")]
    if any(part.empty() for part in parts) or not parts[2].isSeq():
        return None
    rows, columns, count = int(parts[0].real()), int(parts[1].real()), parts[2].size()
    if rows < 1 or columns < 1 or rows * columns != count:
        _refuse(path, name, f"has {count} numbers, expected {rows} x {columns} as it says itself")
    values = [parts[2].at(k) for k in _numbers_up_to(path, name, count)]
    if not all(value.isReal() or value.isInt() for value in values):
        _refuse(path, name, "holds something else than numbers")
    numbers = np.array([float(value.real()) for value in values])
    return _checked(path, name, numbers.reshape(rows, columns))


def _numbers_up_to(path: Path, name: str, count: int) -> Iterator[int]:
    if count > _MOST_NUMBERS:
        _refuse(path, name, f"holds {count} numbers, expected at most {_MOST_NUMBERS}")
    return iter(range(count))


def _checked(path: Path, name: str, values: Floats) -> Floats:
    if not np.isfinite(values).all():
        _refuse(path, name, "holds a number that is not finite")
    return values
