# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of a report sees."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from typing import Any
from xml.etree import ElementTree


def visible(page: str) -> str:
    """The text of a page, without plotly.js and style."""
    page = re.sub(r"<(script|style).*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]+>", " ", page).replace("\u202f", " ").split())


def charts_of(page: str) -> dict[str, Any]:
    found = re.search(r'id="charts">(.*?)</script>', page, flags=re.DOTALL)
    assert found is not None
    return {chart["id"]: chart for chart in json.loads(found[1])}


LARGEST = 2_000_000  # [bytes] of a report
# What a page may do: run the scripts of these digests, style itself, show pictures that stand in it.
POLICY = re.compile(
    r"default-src 'none'; script-src( 'sha256-[A-Za-z0-9+/=]{44}'){2}; style-src 'unsafe-inline';"
    r" img-src data: blob:; base-uri 'none'; form-action 'none'"
)
FETCHES = (
    "src",
    "srcset",
    "href",
    "xlink:href",
    "data",
    "poster",
    "action",
    "formaction",
    "background",
    "ping",
)
VOID = ("meta", "br", "img", "input", "hr", "col")


class _Elements(HTMLParser):
    """Every tag is closed where it should be, and what the elements would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            inside = (value or "").startswith(("#", "data:"))
            if name in FETCHES and not inside:
                self.faults.append(f"<{tag} {name}={value!r}> fetches")
            if name.startswith("on"):
                self.faults.append(f"<{tag} {name}> runs a script")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open[-1] != tag:
            self.faults.append(f"</{tag}> closes {self.open[-1:]}")
        else:
            self.open.pop()


def faults_of(page: str) -> Iterator[str]:
    """Why a report is not one file of at most 2 MB that opens without a network, says numbers where it says
    something, and says it without its script too. Nothing: it is.
    """
    size = len(page.encode())
    if size > LARGEST:
        yield f"it has {size} bytes"
    policy = re.search('<meta http-equiv="Content-Security-Policy" content="(.*?)">', page)
    if policy is None or POLICY.fullmatch(policy[1]) is None or page.index("<script") < policy.end():
        yield f"its policy is {policy and policy[1]}"
    bare = re.sub("<script.*?</script>", "", page, flags=re.DOTALL)
    elements = _Elements()
    elements.feed(bare)
    yield from elements.faults
    yield from (f"{found} fetches" for found in re.findall(r"@import[^;]*|url\([^)]*", bare))
    boot = page[page.rindex("<script>") :]
    yield from (f"its script has {word}" for word in ("fetch", "import", "http") if word in boot)
    shown = visible(re.sub(r">None[.:]", ">", page))  # a sentence may begin so
    data = re.findall(r'<script type="application/json" id="\w+">(.*?)</script>', page, flags=re.DOTALL)
    for text in (shown, *_texts([json.loads(text) for text in data])):
        yield from (
            f"it shows {word}" for word in re.findall(r"\b(?:nan|NaN|None|undefined|https?:\S*)\b", text)
        )
    if len(data) != 2:
        yield "its charts and 3-D pictures are not there"
    for drawn in (one for text in data for one in json.loads(text)):
        still = re.search(
            f'id="{re.escape(drawn["id"])}">(?:<div class="picture">)?(<svg class="picture".*?</svg>)', bare
        )
        if still is None or len(list(ElementTree.fromstring(still[1]).iter())) < 4:
            yield f"without its script there is no {drawn['id']}"
    if len(shown) < 100:
        yield "without its script it says next to nothing"


def _texts(value: Any) -> Iterator[str]:
    """Every text in data, but arrays of numbers."""
    if isinstance(value, dict):
        yield from (text for key, each in value.items() if key != "bdata" for text in _texts(each))
    elif isinstance(value, list):
        yield from (text for each in value for text in _texts(each))
    elif isinstance(value, str):
        yield value
