# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An HTML report: one file, with plotly.js inside, that opens without a network.

The first screen of a report answers what its reader came to ask. What is below is for finding out why. A
report is made from the dictionary that is written as ``result.json`` and from tables of rows, so it never
knows more than what is on disk.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from truing.report.json_text import without_nan
from truing.report.words import escaped


def part_of_page(room: str, file: str = "page.css") -> str:
    """What a room adds to its pages, from a file beside the code."""
    return "\n" + (resources.files("truing") / room / file).read_text(encoding="utf-8")


class Page:
    """Collects markup and charts; charts are drawn by plotly.js once the page is there. `style`: more of it,
    after the common one.
    """

    def __init__(self, title: str, style: str = "") -> None:
        self._title = title
        self._style = part_of_page("report", "page.css") + style
        self._body: list[str] = []
        self._charts: list[dict[str, Any]] = []

    def add(self, markup: str) -> None:
        self._body.append(markup)

    def chart(self, name: str, data: list[dict[str, Any]], layout: dict[str, Any], size: str) -> None:
        self._body.append(f'<div class="chart {size}" id="{name}"></div>')
        self._charts.append({"id": name, "data": data, "layout": layout})

    def html(self) -> str:
        # Late: it is the slowest import of all, and most commands need none.
        from plotly.offline import get_plotlyjs

        scripts = [get_plotlyjs(), part_of_page("report", "page.js")]
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport"'
            ' content="width=device-width, initial-scale=1">'
            f'<meta http-equiv="Content-Security-Policy" content="{_policy(scripts)}">'
            f"<title>{escaped(self._title)}</title><style>{self._style}</style></head>\n<body><main>\n"
            + "\n".join(self._body)
            + f'\n</main>\n<script>{scripts[0]}</script>\n<script type="application/json"'
            f' id="charts">{_json_in_html(self._charts)}</script>\n<script>{scripts[1]}</script>'
            "\n</body></html>\n"
        )


def _json_in_html(value: Any) -> str:
    """JSON that stands in a script element. That ends not only at "</script": after "<!--<script" it ends
    nowhere (HTML standard, 13.2.5, "script data double escaped state"), so that no "<" may be left in it.
    """
    text = json.dumps(without_nan(value), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _policy(scripts: Sequence[str]) -> str:
    """What the page may do: run these very scripts, and load nothing. Names in it come from files of others.

    plotly.js compiles its shaders' bindings with Function ("unsafe-eval"), sets styles, and makes its
    pictures from data and blob addresses.
    """
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed} 'unsafe-eval'; style-src 'unsafe-inline';"
        " img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def table_cell(value: float, text: str) -> str:
    return f'<td data-v="{value:.9g}">{text}</td>'


def warnings_card(result: Mapping[str, Any]) -> str:
    items = "".join(f"<li>{escaped(w)}</li>" for w in result.get("warnings", []))
    return (
        f'<section class="card" id="warnings"><h2>Warnings</h2><ul class="plain">{items}</ul></section>'
        if items
        else ""
    )


def footer(result: Mapping[str, Any]) -> str:
    parts = [f"truing {escaped(result.get('version', ''))}", escaped(result["format"])]
    if "solver" in result:
        parts.append(f"{escaped(result['solver']['name'])}: {escaped(result['solver']['stopped_because'])}")
    if "seed" in result:
        parts.append(f"seed {result['seed']}")
    return f"<footer>{' · '.join(parts)}</footer>"
