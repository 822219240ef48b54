# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the code blocks of a tutorial, in order, in a folder of their own. Its first line says what one is:

```sh                          commands, run by bash; the page goes on only if they succeed
```python                      run as well; all blocks of a page are one program
```yaml title="robot.yaml"     a file, written under that name (any language)
```text                        what the block before prints: its lines, numbers to about a tenth
```console                     not run: it needs an instrument, a network or a robot
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FENCE = re.compile(
    r"^(?P<fence>```+)(?P<info>[^`\n]*)\n(?P<body>.*?)^(?P=fence)[ \t]*$", re.MULTILINE | re.DOTALL
)
TITLE = re.compile(r'title="([^"]+)"')
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
TOLERANCE = 0.1  # of printed numbers: they differ a little from machine to machine
TIME_LIMIT = 300.0  # [s] of one block


@dataclass
class Block:
    language: str
    title: str  # file name, or none
    body: str
    line: int  # of its fence


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for match in FENCE.finditer(text):
        language = match["info"].split()[0] if match["info"].split() else ""
        title = TITLE.search(match["info"])
        line = text.count("\n", 0, match.start()) + 1
        yield Block(language, title[1] if title else "", match["body"], line)


class PageError(AssertionError):
    """A block that fails, or a page that says what is not so."""


def run_page(page: Path, folder: Path) -> int:
    """Runs the page in `folder`; the number of blocks that ran. Raises PageError, which names the line."""
    printed = ""
    count = 0
    program: dict[str, Any] = {"__name__": "__main__"}
    with _inside(folder):
        for block in blocks(page):
            where = f"{page.name}:{block.line}"
            if block.title:
                (folder / block.title).write_text(block.body, encoding="utf-8")
            elif block.language == "sh":
                printed, count = _run_shell(block, where), count + 1
            elif block.language == "python":
                printed, count = _run_python(block, program, where), count + 1
            elif block.language == "text":
                _compare(block.body, printed, where)
            elif block.language != "console":
                raise PageError(f"{where}: a block of {block.language or 'no language'}: see page_blocks.py")
    return count


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _run_shell(block: Block, where: str) -> str:
    # The environment's own commands, in a window that is wide enough for every table.
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", block.body],
        env={**os.environ, "PATH": path, "COLUMNS": "160"},
        capture_output=True,
        text=True,
        timeout=TIME_LIMIT,
    )
    if done.returncode != 0:
        raise PageError(f"{where}: exit status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def _run_python(block: Block, program: dict[str, Any], where: str) -> str:
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out):
            exec(compile("\n" * block.line + block.body, where, "exec"), program)
    except Exception as error:
        raise PageError(f"{where}: {type(error).__name__}: {error}") from error
    return out.getvalue()


def _compare(shown: str, printed: str, where: str) -> None:
    """Every line that the page shows was printed, in this order; `...` stands for lines left out."""
    lines = iter([line for line in printed.splitlines() if line.strip()])
    for wanted in shown.splitlines():
        if wanted.strip() in ("", "..."):
            continue
        if not any(_alike(wanted, line) for line in lines):
            raise PageError(f"{where}: this line is not printed (any more):\n{wanted}\nbut:\n{printed}")


def _alike(a: str, b: str) -> bool:
    """Equal but for blanks, and for numbers that are nearly equal."""
    if "".join(NUMBER.sub("#", a).split()) != "".join(NUMBER.sub("#", b).split()):
        return False
    return all(
        x == y or abs(x - y) <= TOLERANCE * max(abs(x), abs(y))
        for x, y in zip(_numbers(a), _numbers(b), strict=True)
    )


def _numbers(line: str) -> list[float]:
    return [float(number.replace("−", "-")) for number in NUMBER.findall(line)]
