# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where another program says that the camera is: results of easy_handeye, easy_handeye2, MoveIt,
cv::calibrateHandEye, ViSP and of ``truing handeye``, told by what stands in the file.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.common import decoded, listed, read_bytes
from truing.files.opencv_file import read_opencv_camera_frame
from truing.files.other_poses import Setup, read_other_poses
from truing.files.rigid import frames_from_quaternions
from truing.files.visp_file import visp_frame
from truing.files.yaml_tree import Document, found

Floats = NDArray[np.float64]

_LARGEST = 20_000_000  # [bytes] a result.json with its residuals
_LARGEST_LAUNCH = 1_000_000  # [bytes]
_PUBLISHER = "static_transform_publisher"
_NUMBERS = ("x", "y", "z", "qx", "qy", "qz", "qw")
_MOUNTS: dict[str, Setup] = {"EYE-IN-HAND": "eye-in-hand", "EYE-TO-HAND": "eye-to-hand"}
_EXPECTED = (
    "the result of easy_handeye, easy_handeye2 (.calib), MoveIt (a launch file), OpenCV (R_cam2gripper,"
    " t_cam2gripper; R_cam2base, t_cam2base), ViSP (eMc.yaml), truing handeye (result.json), or one 4 x 4"
    " matrix"
)


@dataclass(frozen=True)
class HandEyeAnswer:
    """Where the camera is in the hand (eye in hand) or in the base (eye to hand)."""

    path: Path
    tool: str  # what the file looks like, in words
    setup: Setup | None  # None: the file does not say
    T_parent_camera: Floats  # shape=(4, 4) [m]


def read_handeye_answer(path: Path) -> HandEyeAnswer:
    """Reads such a file. Raises InputError that names the line or node, what was found, what was expected."""
    text = decoded(path, read_bytes(path, _LARGEST))
    start = text.lstrip()
    if _PUBLISHER in text:
        return _of_launch(path, text)
    if start.startswith("{") and "opencv" not in text:
        return _of_truing(path, text)
    if start.startswith(("%YAML", "<", "{")) or "opencv-matrix" in text:
        setup, T = read_opencv_camera_frame(path)
        return HandEyeAnswer(path, "matrices of OpenCV", setup, T)
    if re.match(r"(---|#|\w+:)", start) and re.search(r"^transform(ation)?:", text, re.MULTILINE):
        return _of_easy_handeye(path)
    if re.match(r"(---|#|\w+:)", start) and re.search(r"^rows:", text, re.MULTILINE):
        return HandEyeAnswer(
            path, "the result of ViSP", None, visp_frame(Document.read(path, "result of ViSP"))
        )
    return _of_numbers(path)


# ---- easy_handeye --------------------------------------------------------------------------------


def _of_easy_handeye(path: Path) -> HandEyeAnswer:
    """``transformation: {x … qw}`` of easy_handeye, ``transform: {translation, rotation}`` of easy_handeye2:
    the camera in the effector, or in the base where it stands there, as their publishers send it.
    """
    document = Document.read(path, "result of easy_handeye")
    value = document.value
    if "transform" in value:
        place, tool = "transform", "easy_handeye2"
        parts = _mapping(document, value, place)
        position, turn = (_mapping(document, parts, key) for key in ("translation", "rotation"))
        held: dict[str, Any] = {
            **{key: position.get(key) for key in "xyz"},
            **{f"q{key}": turn.get(key) for key in "xyzw"},
        }
    else:
        place, tool = "transformation", "easy_handeye"
        held = _mapping(document, value, place)
    numbers = []
    for key in _NUMBERS:
        try:
            numbers.append(float(held[key]))
        except (KeyError, TypeError, ValueError):
            document.refuse((place,), f"{key}: found {found(held.get(key))}, expected a number")
    T = _frame(numbers, f"{path}, line {document.line((place,))}")
    return HandEyeAnswer(path, f"the result of {tool}", _setup_of_easy_handeye(document), T)


def _mapping(document: Document, value: Any, key: str) -> dict[str, Any]:
    inside = value.get(key)
    if not isinstance(inside, dict):
        document.refuse((), f"{key}: found {found(inside)}, expected a transform; give {_EXPECTED}")
    return inside


def _setup_of_easy_handeye(document: Document) -> Setup | None:
    parameters = document.value.get("parameters")
    if not isinstance(parameters, dict):
        return None
    on_hand = parameters.get("eye_on_hand")
    if isinstance(on_hand, bool):
        return "eye-in-hand" if on_hand else "eye-to-hand"
    kinds: dict[str, Setup] = {"eye_in_hand": "eye-in-hand", "eye_on_base": "eye-to-hand"}
    return kinds.get(str(parameters.get("calibration_type")))


# ---- MoveIt --------------------------------------------------------------------------------------


def _of_launch(path: Path, text: str) -> HandEyeAnswer:
    """What MoveIt's "Save camera pose" writes: a launch file, of XML (ROS 1) or Python (ROS 2)."""
    if len(text) > _LARGEST_LAUNCH:
        raise InputError(f"{path}: is far too large for a launch file")
    arguments = _of_xml(text) if text.lstrip().startswith("<") else _of_python(path, text)
    if len(arguments) != 1:
        raise InputError(
            f"{path}: found {len(arguments)} calls of {_PUBLISHER} with a pose, expected one: the camera's"
        )
    numbers = _pose_of(arguments[0])
    if numbers is None:
        raise InputError(
            f"{path}: found {_PUBLISHER} with {listed(arguments[0])}, expected x y z and qx qy qz qw"
        )
    mounts = {_MOUNTS[word] for word in _MOUNTS if word in text}
    setup = mounts.pop() if len(mounts) == 1 else None
    return HandEyeAnswer(path, "the camera pose of MoveIt", setup, _frame(numbers, str(path)))


def _of_xml(text: str) -> list[list[str]]:
    bare = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    nodes = [node for node in re.findall(r"<node\b[^>]*>", bare) if _PUBLISHER in node]
    found_in = [re.search(r"""\bargs\s*=\s*(["'])(.*?)\1""", node, re.DOTALL) for node in nodes]
    return [match[2].split() for match in found_in if match]


def _of_python(path: Path, text: str) -> list[list[str]]:
    """The `arguments` of every Node that is such a publisher; nothing is run."""
    try:
        tree = ast.parse(text)
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{path}: is neither XML nor Python, expected {_EXPECTED}") from None
    out = []
    for call in calls:
        given = {keyword.arg: keyword.value for keyword in call.keywords}
        program, arguments = given.get("executable"), given.get("arguments")
        if not (isinstance(program, ast.Constant) and program.value == _PUBLISHER):
            continue
        if isinstance(arguments, (ast.List, ast.Tuple)):
            out.append([str(item.value) for item in arguments.elts if isinstance(item, ast.Constant)])
    return out


def _pose_of(arguments: Sequence[str]) -> list[float] | None:
    """x y z qx qy qz qw of ``--x 1 --qx 0 …``, or of nine arguments in their order."""
    words = list(arguments)
    named = {name: words[words.index(f"--{name}") + 1 :] for name in _NUMBERS if f"--{name}" in words}
    texts = [rest[0] for rest in named.values() if rest] if named else words[:7] if len(words) >= 9 else []
    try:
        numbers = [float(text) for text in texts]
    except ValueError:
        return None
    return numbers if len(numbers) == len(_NUMBERS) else None


# ---- Our own, and plain numbers ------------------------------------------------------------------


def _of_truing(path: Path, text: str) -> HandEyeAnswer:
    try:
        result = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is no JSON: {error}") from None
    if not isinstance(result, dict) or result.get("format") != "truing-handeye/1":
        raise InputError(f"{path}: found JSON of another kind, expected {_EXPECTED}")
    camera = result.get("camera")
    try:
        numbers = [float(camera[key]) for key in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")]  # type: ignore[index]
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{path}: no camera was found in that run ({result.get('status')})") from None
    setup: Setup = "eye-to-hand" if result.get("setup") == "eye-to-hand" else "eye-in-hand"
    return HandEyeAnswer(path, "a result of truing handeye", setup, _frame(numbers, str(path)))


def _of_numbers(path: Path) -> HandEyeAnswer:
    poses = read_other_poses(path)
    if poses is None or poses.either is None or len(poses.either) != 1:
        count = "no pose" if poses is None or poses.either is None else f"{len(poses.either)} poses"
        raise InputError(f"{path}: found {count} of a camera, expected {_EXPECTED}")
    return HandEyeAnswer(path, "one matrix", None, poses.either[0])


def _frame(numbers: Sequence[float], where: str) -> Floats:
    """Of x y z qx qy qz qw."""
    values = np.array([numbers])
    frames = frames_from_quaternions(values[:, :3], values[:, [6, 3, 4, 5]], lambda row: where)
    return frames.reshape(4, 4)
