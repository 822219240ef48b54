# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Looks for anything that a page of the built site would fetch from elsewhere: scripts, styles, pictures.

Links that a reader may follow are none of these.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

FETCHING = {"src", "srcset", "data", "poster", "action"}
STYLE = re.compile(r"(?:url\(\s*[\"']?|@import\s+[\"'])((?:https?:)?//[^\"')\s]+)")


def is_elsewhere(address: str | None) -> bool:
    return bool(address) and re.match(r"(?:[a-z]+:)?//", address or "", re.IGNORECASE) is not None


class Fetches(HTMLParser):
    """What a browser asks for by itself."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            fetched = name in FETCHING or (tag == "link" and name == "href")
            if fetched and is_elsewhere(value):
                self.found.append(f"<{tag} {name}={value}>")
            elif name == "style":
                self.found += STYLE.findall(value or "")


def fetched(path: Path) -> list[str]:
    """Addresses elsewhere that the file makes a browser ask for."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".css":
        return STYLE.findall(text)
    page = Fetches()
    page.feed(text)
    return page.found + STYLE.findall("".join(re.findall(r"<style.*?</style>", text, re.DOTALL)))


def main(site: Path) -> int:
    files = sorted(path for path in site.rglob("*") if path.suffix in (".html", ".css"))
    problems = [f"{path.relative_to(site)}: {what}" for path in files for what in fetched(path)]
    for problem in problems:
        print(f"site: fetches from elsewhere: {problem}")
    print(f"site: {site}/index.html, {sum(path.suffix == '.html' for path in files)} pages")
    return 1 if problems or not files else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
