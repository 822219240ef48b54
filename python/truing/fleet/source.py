# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where a fleet's rows are: files, folders of Parquet, Dask dataframes; and partitions, which are read one by
one.

The list of partitions and their order depend on the source alone, never on who reads them.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files.common import PARQUET_SUFFIXES
from truing.files.measurement_file import load_partition
from truing.files.recording_table import PIECE_ROWS, read_row_groups, read_table
from truing.files.table import Table

ONE_ARM = "arm"
"""What the only arm is called, where nothing names it."""

_TOLD = 20  # warnings of what was read; the others are counted
_SUFFIXES = (".csv", *PARQUET_SUFFIXES)
_ARM_FOLDER = re.compile(r"arm=(.+)")


@contextmanager
def heard() -> Iterator[list[warnings.WarningMessage]]:
    """Warnings of what runs in it, in place of their being shown: a worker has nobody to show them to."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", InputWarning)
        yield told


def notes_of(told: Sequence[warnings.WarningMessage]) -> tuple[str, ...]:
    """What was said of the input, each once."""
    return tuple(dict.fromkeys(str(one.message) for one in told if issubclass(one.category, InputWarning)))


def first_notes(notes: Sequence[str], of: str) -> tuple[str, ...]:
    """The first twenty warnings, and the number of the others. of: what they are of, in words."""
    more = len(notes) - _TOLD
    return (*notes[:_TOLD], *((f"and {more} more warnings of {of}",) if more > 0 else ()))


@dataclass(frozen=True)
class Partition:
    """A part of the rows that is read, summed and forgotten as a whole."""

    called: str  # in messages
    path: str = ""  # "": the rows are handed over as a table in memory
    row_group: int | None = None  # of a Parquet file; None: the whole file
    arm: str = ONE_ARM  # the arm of rows that name none

    def read(
        self, robot: _core.Robot, frame: Any = None
    ) -> tuple[dict[str, _core.Measurements], tuple[str, ...]]:
        """Measurements of every arm in it, by name, and what reading it warns of. frame: the table that was
        handed over.

        Raises InputError that names the partition.
        """
        if frame is None:
            table = Table(Path(self.path))
        else:
            table = Table.of(frame, self.called)
        with heard() as told:
            found = load_partition(table, robot, self.row_group)
        return {name or self.arm: data for name, data in found.items()}, notes_of(told)


@dataclass(frozen=True)
class RecordingPartition(Partition):
    """A file of recordings of motion, or some row groups of one."""

    row_groups: tuple[int, ...] = ()  # none: the whole file

    def recordings(self, robot: _core.Robot) -> tuple[list[_core.Recording], tuple[str, ...]]:
        """What is in it, and what reading it warns of. Raises InputError that names the partition."""
        path = Path(self.path)
        with heard() as told:
            if self.row_groups:
                found = read_row_groups(path, path.stem, robot, self.row_groups)
            else:
                found = read_table(path, path.stem, robot, None)
        return found, notes_of(told)


@dataclass(frozen=True)
class Source:
    """The partitions of a fleet's rows in their order, and the tables of those that are in memory."""

    partitions: tuple[Partition, ...]
    frames: tuple[Any, ...] = ()  # Dask's delayed tables, one a partition; empty: all are in files


def partitions_of(source: Any, *, one_arm: bool = False) -> Source:
    """The partitions of a list of files, of a folder of Parquet files, or of a dask.dataframe.

    A partition is a CSV file, a row group of a Parquet file, or a partition of the dataframe. A row is of the
    arm that its column `arm` names; without one, of the arm of its folder (`arm=NAME/`), or of the file's
    name. one_arm: rows that name no arm are all of one, which the files are parts of.

    Raises InputError where there is nothing, or nothing that can be read.
    """
    if hasattr(source, "to_delayed"):
        frames = tuple(source.to_delayed())
        return Source(tuple(Partition(f"partition {k}") for k in range(len(frames))), frames)
    files = _files_of(source)
    found: list[Partition] = []
    for path, arm in files:
        name = ONE_ARM if one_arm else arm or path.stem
        if path.suffix.lower() in PARQUET_SUFFIXES:
            found += _row_groups(path, name)
        else:
            found.append(Partition(str(path), str(path), None, name))
    return Source(tuple(found))


def recordings_of(source: Any, *, one_arm: bool = False) -> Source:
    """The partitions of recordings of motion: a CSV file, or row groups of a Parquet file that are next to
    one another, of 65 536 rows or more together.

    A recording is of the arm of its folder (`arm=NAME/`), or of its file's name. one_arm: all are of one.

    Raises InputError where there is nothing, or nothing that can be read.
    """
    if hasattr(source, "to_delayed"):
        raise InputError(
            "recordings of motion are given as files or folders, not as a dask.dataframe: the order of their"
            " rows is part of them"
        )
    found: list[Partition] = []
    for path, arm in _files_of(source):
        name = ONE_ARM if one_arm else arm or path.stem
        lots: list[tuple[int, ...]] = [()]
        if path.suffix.lower() in PARQUET_SUFFIXES:
            try:
                lots = Table(path).lots_of_groups(PIECE_ROWS)
            except InputError:
                pass  # reading it says why
        for lot in lots if len(lots) > 1 else [()]:
            called = f"{path}, row groups {lot[0]} to {lot[-1]}" if lot else str(path)
            found.append(RecordingPartition(called, str(path), None, name, lot))
    return Source(tuple(found))


def _row_groups(path: Path, arm: str) -> list[Partition]:
    """A file that is damaged is one partition: reading it says why, or passes over it if asked to."""
    try:
        groups = Table(path).row_groups()
    except InputError:
        return [Partition(str(path), str(path), None, arm)]
    if groups < 2:
        return [Partition(str(path), str(path), 0 if groups else None, arm)]
    return [Partition(f"{path}, row group {k}", str(path), k, arm) for k in range(groups)]


def _files_of(source: Any) -> list[tuple[Path, str]]:
    """Files in order, each with the arm that its folder names."""
    given = [source] if isinstance(source, str | os.PathLike) else list(source)
    files: list[tuple[Path, str]] = []
    for item in given:
        path = Path(item)
        if path.is_dir():
            inside = sorted(p for p in path.rglob("*") if p.suffix.lower() in _SUFFIXES and p.is_file())
            if not inside:
                raise InputError(
                    f"{path}: has no {', '.join(_SUFFIXES)} files, expected a fleet's recordings"
                )
            files += [(p, _arm_of_folder(p.relative_to(path))) for p in inside]
        elif path.exists():
            files.append((path, _arm_of_folder(path)))
        else:
            raise InputError(f"{path}: there is no such file or folder")
    if not files:
        raise InputError("no files: expected a list of files, a folder of Parquet files or a dask.dataframe")
    return files


def _arm_of_folder(path: Path) -> str:
    for folder in reversed(path.parts[:-1]):
        if match := _ARM_FOLDER.fullmatch(folder):
            return match[1]
    return ""
