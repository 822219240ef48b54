# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tool and base frames in the notation of five makers, to be typed in or pasted; what rounding to their
digits costs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.controllers.written import Written, name_in_file, numbers
from truing.files import NOTATIONS, Brand, frame_from_numbers, numbers_from_frame

Floats = NDArray[np.float64]

BRANDS: tuple[Brand, ...] = ("kuka", "abb", "fanuc", "ur", "yaskawa")

# Digits behind the point, of lengths and of what says the rotation: as many as the maker's programs keep.
_DIGITS: Mapping[Brand, tuple[int, int]] = {
    "kuka": (4, 5),
    "abb": (4, 8),
    "fanuc": (3, 3),
    "ur": (7, 7),
    "yaskawa": (3, 4),
}
_REACH = 1.0  # [m] at which a rotation is told as a length


@dataclass(frozen=True)
class NamedFrame:
    """T: shape=(4, 4) [m]. tool: in the flange; else in the robot's base. about: what it is, in words."""

    name: str
    T: Floats
    tool: bool
    about: str


def inverse(T: Floats) -> Floats:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = T[:3, :3].T, -T[:3, :3].T @ T[:3, 3]
    return out


def in_flange(target: _core.Target, T_last_flange: Floats) -> Floats:
    """shape=(4, 4) [m] a target in the flange."""
    return np.asarray(inverse(T_last_flange) @ target.T_last_target)


def written(frames: Sequence[NamedFrame], brands: Sequence[Brand], notes: Sequence[str] = ()) -> Written:
    files, lines = {}, []
    values: dict[str, dict[str, object]] = {}
    for brand in brands:
        texts = [_line(brand, frame) for frame in frames]
        files[f"{brand}.txt"] = "\n".join([*_head(brand), *texts]) + "\n"
        for frame in frames:
            said = printed(brand, frame.T)
            off = rounding(brand, frame)
            values.setdefault(frame.name, {})[brand] = {
                "text": said,
                "rounding_m": off,
            }
            lines.append((f"{frame.name}, {brand}", f"{' '.join(said)} (rounding {1e3 * off:.4f} mm)"))
    return Written(
        files=files,
        values={"frames": {frame.name: {"tool": frame.tool, "about": frame.about} for frame in frames}},
        lines=lines,
        notes=notes,
        extra={"printed": values},
    )


def printed(brand: Brand, T: Floats) -> list[str]:
    """The numbers as they are written, in the order of the brand's notation."""
    values = numbers_from_frame(brand, T)
    of_lengths, of_rotation = _DIGITS[brand]
    return [*numbers(values[:3], of_lengths), *numbers(values[3:], of_rotation)]


def rounding(brand: Brand, frame: NamedFrame) -> float:
    """How far the printed digits move what hangs on the frame [m]: a tool's point, or what lies 1 m from a
    base.
    """
    again = frame_from_numbers(brand, [float(text) for text in printed(brand, frame.T)])
    shift = float(np.linalg.norm(again[:3, 3] - frame.T[:3, 3]))
    between = again[:3, :3].T @ frame.T[:3, :3]
    skew = np.array(
        [between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]
    )
    angle = math.asin(min(1.0, 0.5 * float(np.linalg.norm(skew))))
    return shift + (0.0 if frame.tool else _REACH * angle)


def _head(brand: Brand) -> list[str]:
    comment = {"kuka": ";", "abb": "!", "ur": "#"}.get(brand, "#")
    notation = NOTATIONS[brand]
    unit = "mm" if notation.length != 1.0 else "m"
    angle = {"quaternion": "quaternion q1 (scalar) to q4", "rotation-vector": "rad, rotation vector"}.get(
        notation.rotation, "deg, Rz Ry Rx"
    )
    names = " ".join(notation.names)
    return [f"{comment} {names}: {unit}; {angle}. Tools are in the flange, bases in the robot's base."]


def _line(brand: Brand, frame: NamedFrame) -> str:
    texts = printed(brand, frame.T)
    name = name_in_file(frame.name)
    pairs = list(zip(NOTATIONS[brand].names, texts, strict=True))
    if brand == "kuka":
        variable = "$TOOL" if frame.tool else "$BASE"
        return f"; {frame.about}\n{variable}={{FRAME: {','.join(f'{key} {text}' for key, text in pairs)}}}"
    if brand == "abb":
        variable = f"{name}.tframe" if frame.tool else f"{name}.uframe"
        return f"! {frame.about}\n{variable}:=[[{','.join(texts[:3])}],[{','.join(texts[3:])}]];"
    if brand == "ur":
        pose = f"p[{', '.join(texts)}]"
        return f"# {frame.about}\n" + (f"set_tcp({pose})" if frame.tool else f"global {name} = {pose}")
    return f"# {frame.about}\n" + "  ".join(f"{key} = {text}" for key, text in pairs)
