# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Code on the other pages names files that only a reader has, so it is not run. But its commands and options
exist, its Python is Python, and its YAML is YAML.
"""

from __future__ import annotations

import ast
import importlib
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from page_blocks import blocks
from truing.cli.app import COMMANDS, Place, bind, places
from truing.cli.options import Choice

ROOT = Path(__file__).resolve().parents[3]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMAND = re.compile(r"^(?:\$ |\S*/)?truing (?=[a-z-])(?!finds )")


def commands(page: Path) -> Iterator[tuple[int, str]]:
    """Lines of code, in fences or indented, that call truing, continued ones whole; with their numbers."""
    number, whole, fenced = 0, "", False
    for line in page.read_text(encoding="utf-8").splitlines():
        number += 1
        fenced ^= line.startswith("```")
        code = line if fenced else line[4:] if line.startswith("    ") else ""
        if whole or COMMAND.match(code):
            whole += code.removesuffix("\\")
            if not code.endswith("\\"):
                yield number, whole
                whole = ""


def command_of(words: list[str]) -> tuple[Place | None, list[str]]:
    """The command that these words call, if there is one, and the words behind it."""
    folder = COMMANDS
    for k, word in enumerate(words):
        place = places(folder).get(word)
        if place is None or not place.is_group:
            return place, words[k + 1 :]
        folder = place.path
    return None, []


def wrong_with(line: str) -> Iterator[str]:
    """What of a command does not exist: the command, an option, a word that an option takes."""
    words = shlex.split(COMMAND.sub("", line), comments=True)
    if words == ["--version"]:
        return
    place, rest = command_of(words)
    if place is None:
        yield f"no command: truing {' '.join(words)}"
        return
    options = {one.flag: one.kind for one in bind(importlib.import_module(place.module).Command, place.name)}
    for word, value in zip(rest, [*rest, ""][1:], strict=True):
        if not word.startswith("--"):
            continue
        kind = options.get(word)
        if kind is None and word != "--help":
            yield f"{place.name} has no {word}"
        elif isinstance(kind, Choice) and value not in kind.values:
            yield f"{place.name} {word} does not take {value!r}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_and_their_options_exist(page: Path) -> None:
    problems = [f"{page.name}:{at}: {what}" for at, line in commands(page) for what in wrong_with(line)]
    assert problems == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_python_and_yaml_can_be_read(page: Path) -> None:
    for block in blocks(page):
        if block.language == "python":
            ast.parse(block.body, f"{page.name}:{block.line}")
        elif block.language == "yaml":
            list(yaml.safe_load_all(block.body))


def test_the_commands_of_the_pages_are_read() -> None:
    assert sum(1 for page in PAGES for _ in commands(page)) > 60


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("truing identify robot.yaml --seed 1  # a fit", []),
        ("$ truing dynamics plan a.urdf", []),
        ("truing identfy robot.yaml", ["no command: truing identfy robot.yaml"]),
        ("truing dynamics plane a.urdf", ["no command: truing dynamics plane a.urdf"]),
        ("truing identify robot.yaml --sed 1", ["identify has no --sed"]),
        ("truing identify robot.yaml --solver magic", ["identify --solver does not take 'magic'"]),
    ],
)
def test_what_does_not_exist_is_found(line: str, wrong: list[str]) -> None:
    assert list(wrong_with(line)) == wrong
