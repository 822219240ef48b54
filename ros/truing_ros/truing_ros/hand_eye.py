# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing handeye`` wrote, as frames."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing_ros.frames import Frame

FORMAT = "truing-handeye/1"


@dataclass(frozen=True)
class Found:
    """Camera (optical frame: z forward, x right) and board, each in "hand" or "base"."""

    camera_in: str
    T_parent_camera: Frame
    board_in: str
    T_parent_board: Frame


def read(path: str | Path) -> Found:
    """``result.json`` of ``truing handeye``, or the folder it is in. Raises ValueError that names the file
    and what was expected.
    """
    path = Path(path)
    path = path / "result.json" if path.is_dir() else path
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise ValueError(f"{path}: is no JSON: {error}") from None
    if not isinstance(result, dict) or result.get("format") != FORMAT:
        raise ValueError(f"{path}: expected result.json of truing handeye (format {FORMAT})")
    if "camera" not in result:
        raise ValueError(f"{path}: no camera was found: {result.get('message', 'no reason is given')}")
    camera, board = result["camera"], result["board"]
    return Found(camera["in"], _frame(camera), board["in"], _frame(board))


def _frame(values: dict[str, Any]) -> Frame:
    return Frame(
        np.array([values[f"{axis}_m"] for axis in "xyz"], dtype=float),
        np.array([values[part] for part in ("qx", "qy", "qz", "qw")], dtype=float),
    )
