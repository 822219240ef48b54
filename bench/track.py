# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Puts what `bench_track` prints into a page.

    (bench_track 5 100 gentle 8 101; bench_track 5 100 stop 8 101) | python bench/track.py --write
    docs/benchmarks/track.md

Reads the output of one run or of several from standard input; `--write` puts the tables between the markers
of the page, without it they are printed. Tables of the page that are not in the input stay as they are.
Every line must be one that `bench_track` writes; anything else ends it with exit 2 and nothing written.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import sys
from datetime import datetime, timezone
from pathlib import Path

ROW = re.compile(
    r"^  (?P<what>.{74}) +(?P<value>-?[0-9.]+|-?nan|-?inf) (?P<unit>\S*)\s*(?:target"
    r" (?P<target>.+?)\s+(?P<verdict>reached|MISSED))?$"
)
START, END = "<!-- table -->", "<!-- end -->"


def machine() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor() or platform.machine()
    return f"{processor}, {os.cpu_count()} cores, {platform.system()}"


def tables(text: str, about: str) -> tuple[list[str], int, int]:
    """Lines of the page, and how many targets were reached and missed. about: when and where it was made."""
    lines: list[str] = []
    commands: list[str] = []
    reached = missed = 0
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("command: "):
            commands.append(line.removeprefix("command: "))
        elif line and not line.startswith(" "):
            lines += [
                "",
                f"## {line[0].upper()}{line[1:]}",
                "",
                f"`{commands[-1]}`, {about}" if commands else about,
                "",
                "| | measured | to reach | |",
                "| --- | --- | --- | --- |",
            ]
        elif match := ROW.match(line):
            what, value, unit, target, verdict = (
                match[name] or "" for name in ("what", "value", "unit", "target", "verdict")
            )
            reached += verdict == "reached"
            missed += verdict == "MISSED"
            lines.append(
                f"| {what.strip()} | {value} {unit} | {target} |"
                f" {'**missed**' if verdict == 'MISSED' else verdict} |".replace("  ", " ")
            )
        else:
            raise ValueError(
                f"standard input, line {number}: found {line!r}, expected a line of bench_track's output"
            )
    if not reached + missed:
        raise ValueError(
            "standard input: no row with a target; pipe the output of bench_track into this program"
        )
    return lines, reached, missed


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--write", type=Path, help=f"the page whose markers {START} and {END} take the tables"
    )
    arguments = parser.parse_args()
    page = arguments.write.read_text(encoding="utf-8") if arguments.write else ""
    if arguments.write and not (START in page and END in page):
        parser.error(f"{arguments.write} has no markers {START} and {END}")
    about = f"{datetime.now(timezone.utc):%Y-%m-%d}: {machine()}."
    try:
        lines, reached, missed = tables(sys.stdin.read(), about)
    except ValueError as error:
        parser.error(str(error))
    text = "\n".join(lines).strip()
    if arguments.write:
        start, end = page.index(START) + len(START), page.index(END)
        text = merged(page[start:end], text)
        arguments.write.write_text(page[:start] + "\n" + text + "\n" + page[end:], encoding="utf-8")
    else:
        print(text)
    print(f"{reached} targets reached, {missed} missed", file=sys.stderr)


def merged(old: str, new: str) -> str:
    """The old tables, those of `new` put in their places: one is known by its title and its command."""

    def by_name(text: str) -> dict[tuple[str, str], str]:
        parts = [part.strip() for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]]
        return {(part.split("\n")[0], part.split("`")[1]): f"## {part}" for part in parts}

    return "\n\n".join({**by_name(old), **by_name(new)}.values())


if __name__ == "__main__":
    main()
