# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The text of ``result.json``."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np


def without_nan(value: Any) -> Any:
    """The same, ready for JSON: numpy types become Python's, what is not finite becomes None."""
    if isinstance(value, Mapping):
        return {str(key): without_nan(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return without_nan(value.tolist())
    if isinstance(value, (list, tuple)):
        return [without_nan(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


_NUMBER = r"(?:-?[0-9][0-9.e+-]*|null)"
_ROW_OF_NUMBERS = re.compile(
    rf"\[\n *({_NUMBER}(?:,\n *{_NUMBER})*)\n *\]"
)  # no text of JSON holds a line break


def to_json(result: Mapping[str, Any]) -> str:
    """Text of ``result.json``: no NaN, rows of numbers on one line, one line break at the end."""
    text = json.dumps(without_nan(result), indent=2, allow_nan=False, ensure_ascii=False)
    return _ROW_OF_NUMBERS.sub(lambda row: f"[{' '.join(row[1].split())}]", text) + "\n"
