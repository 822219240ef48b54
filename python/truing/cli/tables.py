# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a command says on the terminal: tables and lines on stdout, warnings and errors on stderr."""

from __future__ import annotations

import os
import sys
import unicodedata
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

AXES = "xyz"

_ENDLESS = 10_000  # letters of a line that is never folded
_ROOM = 24  # letters that the first column of a folded table keeps


# Of Unicode's categories: control and format characters (escape sequences, text run backwards), half
# characters, breaks of line and paragraph.
_UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")


def harmless(text: str) -> str:
    """`text` with what steers a terminal written out, as \\x1b: names come from files of others."""
    return "".join(
        character.encode("unicode_escape").decode()
        if character != "\n" and unicodedata.category(character) in _UNSEEN
        else character
        for character in text
    )


def console(**options: Any) -> Console:
    """Lines are folded at the terminal's width, or at COLUMNS; in a pipe or a file a row stays a line."""
    from rich.console import Console

    if "COLUMNS" not in os.environ and not sys.stdout.isatty():
        options.setdefault("width", _ENDLESS)

    class Plain(Console):
        def on_broken_pipe(self) -> None:
            """Rich would end the program here; what to do of it is for `app` to say."""
            raise BrokenPipeError

    return Plain(highlight=False, **options)


def error_console() -> Console:
    return console(stderr=True, soft_wrap=True)


def say(text: str) -> None:
    """A line that is never wrapped: a path stays a path."""
    console().print(harmless(text), soft_wrap=True, markup=False)


def say_first(lines: Sequence[str], most: int, rest: str) -> None:
    """The first lines, and how many there are more: `rest` is "more gaps: see the report"."""
    for line in lines[:most]:
        say(line)
    if len(lines) > most:
        say(f"and {len(lines) - most} {rest}")


def joined(words: Sequence[str], most: int) -> str:
    """ "a; b; and 3 more"."""
    more = f"; and {len(words) - most} more" if len(words) > most else ""
    return "; ".join(words[:most]) + more


def warn(messages: Sequence[str]) -> None:
    for message in messages:
        error_console().print(f"warning: {harmless(message)}", style="yellow", markup=False)


def fail(message: str) -> None:
    """Why a command ends with exit status 1."""
    error_console().print(f"truing: {harmless(message)}", style="bold red", markup=False, highlight=False)


def table(title: str, head: Sequence[str], lines: Sequence[Sequence[str]], words: bool = False) -> None:
    """A table on stdout. `words`: its cells are no numbers."""
    cells = [[harmless(cell) for cell in line] for line in lines]
    out = console()
    drawn = _drawn(title, head, cells, words, kept=False)
    if out.measure(drawn, options=out.options.update(max_width=_ENDLESS)).maximum > out.width:
        # What a line is about keeps its room; the other columns give way.
        room = min(_ROOM, out.width // 3)
        cells = [[_folded(line[0], room, out), *line[1:]] for line in cells]
        drawn = _drawn(title, head, cells, words, kept=True)
    out.print(drawn)


def _folded(text: str, room: int, out: Console) -> str:
    from rich.text import Text

    return "\n".join(line.plain.rstrip() for line in Text(text).wrap(out, room))


def _drawn(
    title: str, head: Sequence[str], cells: Sequence[Sequence[str]], words: bool, *, kept: bool
) -> Table:
    """`kept`: the first column stays as wide as it is."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    # Text, not str: in that rich looks for markup, and a robot may be called "arm [/x]".
    drawn = Table(
        title=Text(harmless(title), style="table.title"),
        title_justify="left",
        box=box.SIMPLE_HEAD,
        show_header=any(head),
    )
    for k, name in enumerate(head):
        left = k == 0 or len(head) == 2 or words
        drawn.add_column(
            Text(harmless(name)),
            justify="left" if left else "right",
            overflow="fold",
            no_wrap=kept and k == 0,
        )
    for line in cells:
        drawn.add_row(*(Text(cell) for cell in line))
    return drawn


def mm(metres: float | None) -> str:
    return "-" if metres is None else f"{metres * 1e3:.4f} mm"


def mrad(radians: float | None) -> str:
    return "-" if radians is None else f"{radians * 1e3:.4f} mrad"


def ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3f} ms"


def statistics(e: Mapping[str, Any]) -> list[str]:
    """Mean, 95 % and maximum of an error."""
    return [mm(e[key]) for key in ("mean_m", "p95_m", "max_m")]
