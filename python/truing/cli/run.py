# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How every command runs: it reads, lets the core work, writes all of its files at once or none, and prints.

A command states only what is its own: options, `load`, `solve`, `write`, `table`.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from truing.cli import tables
from truing.cli.options import Json, OutFolder
from truing.errors import InputWarning

Loaded = TypeVar("Loaded")
Found = TypeVar("Found")
Value = TypeVar("Value")

_BAR_AFTER = 1.0  # [s] what is quicker shows no progress
_LOOK_EVERY = 0.1  # [s]


class Progress:
    """What a step tells while it works: which work it is, and how much of it is done."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.done = 0.0
        self.total: float | None = None
        self.stop = threading.Event()
        self.shown: Callable[[], None] = lambda: None

    def now(self, what: str) -> None:
        """Another work begins."""
        self.what, self.done, self.total = what, 0.0, None

    def of(self, done: float, total: float) -> None:
        """So many of so many are done."""
        self.done, self.total = float(done), float(total)
        self.shown()

    def fraction(self, done: float) -> bool:
        """This fraction is done. False: the user wants it to stop."""
        self.of(done, 1.0)
        return not self.stop.is_set()

    def counting(self, total: int) -> Callable[[int], None]:
        """For work that tells how many are done."""

        def tell(done: int) -> None:
            self.of(done, total)

        return tell


@dataclass(frozen=True, kw_only=True)
class Command(Generic[Loaded, Found]):
    """A command: its options are its fields."""

    doing: ClassVar[str]
    """What the progress bar says meanwhile: "identifying"."""
    folder: ClassVar[str] = ""
    """Where files go without --out; "truing-<command>" if this says nothing."""
    own_processes: ClassVar[bool] = False
    """`solve` starts processes, which the main thread must end: it runs there."""
    sometimes: ClassVar[tuple[str, ...]] = ()
    """Files that not every run writes. Those of an earlier run would be taken for this one's: they are
    removed.
    """

    out: OutFolder
    json: Json = False

    def load(self, progress: Progress) -> Loaded:
        """Reads the files."""
        raise NotImplementedError

    def solve(self, loaded: Loaded, progress: Progress) -> Found:
        """Computes. Runs in a thread of its own, so that Ctrl-C works while the core computes."""
        raise NotImplementedError

    def write(self, folder: Path, loaded: Loaded, found: Found, warnings: list[str]) -> Mapping[str, Any]:
        """Writes all files into `folder`, and returns what result.json holds. `warnings`: about the input."""
        raise NotImplementedError

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        """Prints the short answer."""
        raise NotImplementedError

    def failure(self, result: Mapping[str, Any]) -> str:
        """Why the exit status is 1; "" if it is 0."""
        return ""

    def keeps(self, file: Path) -> bool:
        """Whether a file of an earlier run stays although this run did not write it: it was read."""
        return False

    def inputs(self) -> list[Path]:
        """The files that its options name; the words of an option may be one."""
        values = [getattr(self, field.name) for field in fields(self) if field.name != "out"]
        words = [word for value in values for word in (value if isinstance(value, list) else [value])]
        return [Path(word) for word in words if isinstance(word, str | Path) and str(word)]

    def run(self) -> int:
        """Reads, solves, writes and prints; the exit status."""
        from truing.files.output import atomic_output_dir, files_read

        with warnings_heard() as heard, files_read() as read:
            loaded = working("reading", self.load)
            found = working(
                self.doing, lambda progress: self.solve(loaded, progress), in_thread=not self.own_processes
            )
            obsolete = [name for name in self.sometimes if not self.keeps(self.out / name)]
            with (
                atomic_output_dir(self.out, inputs=[*self.inputs(), *read], obsolete=obsolete) as folder,
                bar_of(Progress("writing")),
            ):
                result = self.write(folder, loaded, found, heard)
                written = {path.name for path in folder.iterdir()}
        tables.warn([text for text in result.get("warnings", ()) if text not in heard])
        failure = self.failure(result)
        with contextlib.suppress(BrokenPipeError):  # nobody reads on: the exit status still says how it ended
            if self.json:
                from truing.report.json_text import to_json

                sys.stdout.write(to_json(result))
            else:
                self.table(result, found)
                if "report.html" in written:
                    tables.say(f"report: {self.out / 'report.html'}")
            sys.stdout.flush()
        if failure:
            tables.fail(failure)
        return 1 if failure else 0


@contextlib.contextmanager
def warnings_heard() -> Iterator[list[str]]:
    """Warnings about the input go to stderr, a line each, and into the list."""
    heard: list[str] = []

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        heard.append(str(message))
        tables.warn([str(message)])

    with warnings.catch_warnings():
        warnings.simplefilter("always", InputWarning)
        warnings.showwarning = show
        yield heard


def working(what: str, work: Callable[[Progress], Value], in_thread: bool = True) -> Value:
    """Runs `work` in a thread, so that Ctrl-C works while the core computes; after a second a bar says how
    far it is.
    """
    progress = Progress(what)
    if not in_thread:
        with bar_of(progress) as progress.shown:
            return work(progress)
    outcome: list[Value] = []
    failure: list[BaseException] = []

    def job() -> None:
        try:
            outcome.append(work(progress))
        except BaseException as error:  # noqa: BLE001  is raised again below, in the caller's thread
            failure.append(error)

    # No daemon: one that comes back from the core while Python puts itself away would abort the process.
    thread = threading.Thread(target=job, name=f"truing {what}")
    thread.start()
    try:
        thread.join(_BAR_AFTER)
        if thread.is_alive():
            with bar_of(progress) as update:
                while thread.is_alive():
                    thread.join(_LOOK_EVERY)
                    update()
    except KeyboardInterrupt:
        progress.stop.set()
        raise
    if failure:
        raise failure[0]
    return outcome[0]


@contextlib.contextmanager
def bar_of(progress: Progress) -> Iterator[Callable[[], None]]:
    """A bar on stderr, if that is a terminal, which goes away again; the function brings it up to date."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.progress import BarColumn, Progress as Bars, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Bars(*columns, console=tables.error_console(), transient=True) as bars:
        task = bars.add_task(progress.what, total=None)
        yield lambda: bars.update(
            task, description=progress.what, completed=progress.done, total=progress.total
        )
