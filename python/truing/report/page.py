# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An HTML report: one file, with its script inside, that opens without a network.

The first screen of a report answers what its reader came to ask. What is below is for finding out why. A
report is made from the dictionary that is written as ``result.json`` and from tables of rows, so it never
knows more than what is on disk.

The script (``report.js``, built from ``web/``) draws what the page holds as JSON. Where it does not run,
tables and static pictures are there already.
"""

from __future__ import annotations

import base64
import functools
import gzip
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from truing.report.json_text import without_nan
from truing.report.picture import SIZES, USUAL_SIZE, chart_picture
from truing.report.words import escaped


def part_of_page(room: str, file: str = "page.css") -> str:
    """What a room adds to its pages, from a file beside the code."""
    return "\n" + (resources.files("truing") / room / file).read_text(encoding="utf-8")


@functools.lru_cache(maxsize=1)
def _script() -> tuple[str, str]:
    """The script of every page, compressed (gzip, base64), and its digest."""
    text = (resources.files("truing") / "report" / "report.js").read_bytes()
    return base64.b64encode(gzip.compress(text, mtime=0)).decode(), _digest(text)


def _digest(text: bytes) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text).digest()).decode()}'"


class Page:
    """Collects markup, charts and 3-D pictures. `style`: more of it, after the common one."""

    def __init__(self, title: str, style: str = "") -> None:
        self._title = title
        self._style = part_of_page("report", "page.css") + style
        self._body: list[str] = []
        self._charts: list[dict[str, Any]] = []
        self._scenes: list[Mapping[str, Any]] = []

    def add(self, markup: str) -> None:
        self._body.append(markup)

    def chart(self, name: str, data: list[dict[str, Any]], layout: dict[str, Any], size: str) -> None:
        """A chart of plotly.js: traces of type scatter, bar or heatmap."""
        width, height = SIZES.get(size.split()[0], USUAL_SIZE)
        picture = chart_picture(data, layout, (width, int(layout.get("height", height))))
        self._body.append(f'<div class="chart {size}" id="{name}">{picture}</div>')
        self._charts.append({"id": name, "data": data, "layout": layout})

    def scene(self, name: str, spec: Mapping[str, Any], picture: str, size: str) -> None:
        """A 3-D picture (`report.scene.Scene3d` makes it), and the static one that stands for it."""
        self._body.append(f'<div class="scene {size}" id="{name}"><div class="picture">{picture}</div></div>')
        self._scenes.append(spec)

    def html(self) -> str:
        """The whole page."""
        code, digest = _script()
        boot = part_of_page("report", "boot.js")
        policy = _policy((digest, _digest(boot.encode())))
        data = "".join(
            f'<script type="application/json" id="{name}">{_json_in_html(value)}</script>\n'
            for name, value in (("charts", self._charts), ("scenes", self._scenes))
        )
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport"'
            ' content="width=device-width, initial-scale=1">'
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
            f"<title>{escaped(self._title)}</title><style>{self._style}</style></head>\n<body><main>\n"
            + "\n".join(self._body)
            + f'\n</main>\n{data}<script type="text/plain" id="code">{code}</script>\n'
            f"<script>{boot}</script>\n</body></html>\n"
        )


def _json_in_html(value: Any) -> str:
    """JSON that stands in a script element. That ends not only at "</script": after "<!--<script" it ends
    nowhere (HTML standard, 13.2.5, "script data double escaped state"), so that no "<" may be left in it.
    """
    text = json.dumps(without_nan(value), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _policy(digests: Sequence[str]) -> str:
    """What the page may do: run these very scripts, and load nothing. Names in it come from files of others.

    plotly.js sets styles; pictures that are saved from it are data and blob addresses.
    """
    return (
        f"default-src 'none'; script-src {' '.join(digests)}; style-src 'unsafe-inline';"
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
