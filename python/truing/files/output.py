# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Output that is whole or not there, and what of it was left unfinished is not read.

A folder is filled beside its place and then moved there. Where a folder is there already, its files can only
be replaced one by one: a list of them stands in the folder meanwhile, so that after a power cut or `kill -9`
no reader takes a mixture of old and new for one result.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import re
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from truing.errors import InputError

PathLike = str | os.PathLike[str]

RESULT = "result.json"
MANIFEST = ".truing-unfinished"
"""Names the files of its folder that are being replaced."""

_FOLDER = re.compile(r"\.truing-[0-9a-f]{8}")
# The machine's trouble, not a path that cannot be: it is no use to name another one.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


def reason(error: BaseException) -> str:
    """The part of an operating system's error that a user needs."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error).strip().split("\n")[0] or type(error).__name__


_noting: list[list[Path]] = []  # of every `files_read` that is open, in whichever thread


@contextlib.contextmanager
def files_read() -> Iterator[list[Path]]:
    """The files that are read in the block, those included that other files name."""
    read: list[Path] = []
    _noting.append(read)
    try:
        yield read
    finally:
        _noting[:] = [other for other in _noting if other is not read]


def require_whole_file(path: Path) -> None:
    """Raises InputError for what cannot be read to its end (a pipe, a device), and for a file that a run was
    replacing when it was ended. Every reader asks this first: `files_read` knows them all from here.
    """
    for read in _noting:
        read.append(path)
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return  # opening it says why
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise InputError(f"{path}: is a pipe or a device, expected a file: write what it gives into a file")
    try:
        names = (path.parent / MANIFEST).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return
    if path.name in names:
        raise InputError(
            f"{path}: a run that was ended while it replaced the files of this folder left old and new ones"
            f" mixed: run it again, or remove {path.parent / MANIFEST} if you know that they belong together"
        )


def _not_written(path: Path, error: OSError | ValueError) -> Exception:
    """What to raise for an output that cannot be written."""
    text = f"{path}: cannot be written: {reason(error)}"
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        return OSError(error.errno, text)
    return InputError(text)


@contextlib.contextmanager
def atomic_write(path: PathLike) -> Iterator[Path]:
    """Write a file so that it is there as a whole or not at all.

    Yields the path of an empty temporary file in the same folder (with the same suffix) to write to; it is
    renamed to `path` when the block ends well and removed when it raises, Ctrl-C included. Raises InputError
    when `path` cannot be written, OSError when the disk is full.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, expected the name of a file to write")
        temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
        temporary.touch(exist_ok=False)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise _not_written(path, error) from None
    try:
        yield temporary
        try:
            temporary.replace(path)
        except OSError as error:
            raise _not_written(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def atomic_output_dir(
    path: PathLike, *, inputs: Sequence[Path] = (), obsolete: Collection[str] = ()
) -> Iterator[Path]:
    """Write several files so that all of them appear, or none.

    Yields a temporary folder on the same disk. When the block ends well its content moves to `path` (made if
    needed; files of the same names are replaced, others stay); when it raises, Ctrl-C included, nothing is
    left behind. inputs: files that were read; none of them is replaced or removed, nor is the result.json
    beside them, unless the same command wrote it. obsolete: names of an earlier run's
    files that go unless they were written anew. Raises InputError when `path` cannot be written, OSError when
    the disk is full.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"{path}: is a file, expected a folder to write to")
    except OSError as error:
        raise _not_written(path, error) from None
    made: list[tuple[Path, int]] = []
    try:
        with _interrupts_held_back():
            try:
                made.append(_locked_folder(_cleared_home(path)))
            except (OSError, ValueError) as error:
                raise _not_written(path, error) from None
        temporary = made[0][0]
        yield temporary
        _require_no_input(temporary, path, inputs)
        _require_same_command(temporary, path, inputs)
        with _interrupts_held_back():
            try:
                _move_content(
                    temporary, path, [name for name in obsolete if not is_one_of(path / name, inputs)]
                )
            except OSError as error:
                raise _not_written(path, error) from None
    finally:
        with _interrupts_held_back():
            for folder, lock in made:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(lock)


def _cleared_home(path: Path) -> Path:
    """Where a temporary folder is on the same disk as `path`; what killed runs left there is removed."""
    # Inside the folder if it exists (it may be a disk of its own), else as near to it as there is one.
    home = path.absolute()
    while not home.is_dir():
        home = home.parent
    for folder in {home, path.absolute().parent}:
        _clear(folder)
    return home


def _locked_folder(home: Path) -> tuple[Path, int]:
    """A new folder, and the lock by which others see that its run is alive."""
    while True:
        folder = home / f".truing-{secrets.token_hex(4)}"
        folder.mkdir()
        with contextlib.suppress(FileNotFoundError):
            lock = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
            with contextlib.suppress(OSError):  # of a disk without locks: nobody clears folders there
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            if folder.exists():  # else another run cleared it away before it was locked
                return folder, lock
            os.close(lock)


def _clear(home: Path) -> None:
    """Removes the temporary folders of runs that were killed: nobody holds their locks."""
    if not home.is_dir():
        return
    for folder in home.glob(".truing-*"):
        if not _FOLDER.fullmatch(folder.name):
            continue
        with contextlib.suppress(OSError):
            lock = os.open(folder, os.O_RDONLY | os.O_CLOEXEC | os.O_DIRECTORY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)


def is_one_of(file: Path, others: Sequence[Path]) -> bool:
    """Whether a file is one of these, by whatever name."""
    for other in others:
        with contextlib.suppress(OSError, ValueError):
            if file.samefile(other):
                return True
    return False


def _require_no_input(source: Path, destination: Path, inputs: Sequence[Path]) -> None:
    for file in source.rglob("*"):
        target = destination / file.relative_to(source)
        if is_one_of(target, inputs):
            raise InputError(
                f"{target}: is an input of this run, and would be replaced by its result: write to another"
                " folder (--out)"
            )


def _require_same_command(source: Path, destination: Path, inputs: Sequence[Path]) -> None:
    """A result that was read from belongs together: no other command's result.json replaces its own."""
    if not is_one_of(destination, [file.parent for file in inputs if file.is_file()]):
        return
    there, new = _format_of(destination / RESULT), _format_of(source / RESULT)
    if there and new and there != new:
        raise InputError(
            f"{destination}: this run reads files of the result there ({there}), and would replace a part of"
            f" it ({new}): write to another folder (--out)"
        )


def _format_of(file: Path) -> str:
    """What a result.json says of itself; "" if it is none."""
    try:
        found = json.loads(file.read_text(encoding="utf-8")).get("format", "")
    except (OSError, ValueError, AttributeError, RecursionError):
        return ""
    return found if isinstance(found, str) else ""


def _move_content(source: Path, destination: Path, obsolete: Collection[str]) -> None:
    if not destination.exists():
        destination.parent.mkdir(parents=True, exist_ok=True)
        source.replace(destination)
        return
    files = [file.relative_to(source) for file in sorted(source.rglob("*")) if not file.is_dir()]
    for file in files:
        # First look for what would stop us half-way.
        if (destination / file).is_dir():
            raise IsADirectoryError(0, f"{file} is a folder there")
    gone = [name for name in obsolete if Path(name) not in files and (destination / name).exists()]
    manifest = destination / MANIFEST
    _write_through(manifest, "".join(f"{name}\n" for name in sorted({file.name for file in files} | {*gone})))
    for file in files:
        target = destination / file
        target.parent.mkdir(parents=True, exist_ok=True)
        (source / file).replace(target)
    for name in gone:
        (destination / name).unlink(missing_ok=True)
    manifest.unlink()


def _write_through(path: Path, text: str) -> None:
    """Writes a file that is on the disk before anything that is written after it."""
    with path.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Ctrl-C waits until the block is done. Only the main thread gets signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    previous = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous if previous is not None else signal.SIG_DFL)
        if held:
            raise KeyboardInterrupt
