# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of a report sees."""

from __future__ import annotations

import json
import re
from typing import Any


def visible(page: str) -> str:
    """The text of a page, without plotly.js and style."""
    page = re.sub(r"<(script|style).*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]+>", " ", page).replace("\u202f", " ").split())


def charts_of(page: str) -> dict[str, Any]:
    found = re.search(r'id="charts">(.*?)</script>', page, flags=re.DOTALL)
    assert found is not None
    return {chart["id"]: chart for chart in json.loads(found[1])}
