# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that every relative link in the repository's *.md files leads to a file, and every #anchor to a
heading.
"""

from __future__ import annotations

import pathlib
import re
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOT_OURS = {".git", ".venv", "build", "demo", "node_modules"}

FENCE = re.compile(r"^ {0,3}(```+|~~~+).*?^ {0,3}\1[`~]*\s*?$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
INLINE = re.compile(r"\]\(\s*<?([^()<>\s]+(?:\([^()\s]*\))?)>?(?:\s+[\"'(][^)]*)?\s*\)")
REFERENCE = re.compile(r"^ {0,3}\[[^\]]+\]:\s*<?([^\s>]+)", re.MULTILINE)
HTML = re.compile(r"<(?:a|img)\b[^>]*?\b(?:href|src)\s*=\s*[\"']([^\"']+)[\"']", re.IGNORECASE)
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.*?)\s*#*\s*$", re.MULTILINE)
HTML_ID = re.compile(r"\b(?:id|name)\s*=\s*[\"']([^\"']+)[\"']")


def blank(pattern: re.Pattern[str], text: str) -> str:
    """Replaces what matches by blanks, so that line numbers stay."""
    return pattern.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), text)


def anchors(path: pathlib.Path) -> set[str]:
    """The anchors that GitHub gives to the headings of a file."""
    text = blank(COMMENT, blank(FENCE, path.read_text(encoding="utf-8")))
    found: set[str] = set(HTML_ID.findall(text))
    counts: dict[str, int] = {}
    for heading in HEADING.findall(text):
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
        count = counts.get(slug, 0)
        counts[slug] = count + 1
        found.add(f"{slug}-{count}" if count else slug)
    return found


def broken_links(path: pathlib.Path) -> list[str]:
    text = blank(CODE, blank(COMMENT, blank(FENCE, path.read_text(encoding="utf-8"))))
    problems = []
    for pattern in (INLINE, REFERENCE, HTML):
        for match in pattern.finditer(text):
            link = match.group(1)
            if re.match(r"[a-zA-Z][a-zA-Z0-9+.-]*:|//", link):
                continue
            where = f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}"
            target_text, _, anchor = link.partition("#")
            target_text = urllib.parse.unquote(target_text.partition("?")[0])
            if target_text.startswith("/"):
                target = ROOT / target_text.lstrip("/")
            else:
                target = path.parent / target_text if target_text else path
            if not target.exists():
                problems.append(f"{where}: {link}: there is no {target_text}")
            elif not target.resolve().is_relative_to(ROOT):
                problems.append(f"{where}: {link}: leads out of the repository")
            elif anchor and target.suffix == ".md" and urllib.parse.unquote(anchor) not in anchors(target):
                problems.append(f"{where}: {link}: {target.name} has no heading for #{anchor}")
    return problems


def main() -> int:
    pages = sorted(
        path for path in ROOT.rglob("*.md") if not NOT_OURS.intersection(path.relative_to(ROOT).parts)
    )
    problems = [problem for page in pages for problem in broken_links(page)]
    for problem in problems:
        print(problem)
    print(f"links: {len(pages)} pages, {len(problems)} broken links")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
