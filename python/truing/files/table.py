# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""CSV and Parquet files as columns of numbers and labels, with errors that name line and column.

Arrow reads on all cores. Where a file is at fault it says so in its own words, or not at which line; the file
is then read a
second time, slowly, to find the place: only a file that is refused anyway costs that time.
"""

from __future__ import annotations

import copy
import csv
import math
import mmap
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.common import PARQUET_SUFFIXES, decoded, listed, reason, shown
from truing.files.output import require_whole_file
from truing.limits import LARGEST_NUMBER

Floats = NDArray[np.float64]
Codes = NDArray[np.int32]

_PARQUET_MAGIC = b"PAR1"
_MARK = b"\xef\xbb\xbf"  # of UTF-8 text, before its first line
_LONGEST_HEADER = 1_000_000
_MOST_COLUMNS = 2000
_MOST_CELLS = 200_000_000  # 1.6 GB of doubles
_LARGEST_CSV = 8_000_000_000  # [bytes]
_LARGEST_COVARIATE = 1e30  # its square, and sums of such squares, are still numbers
_READ_AHEAD = 1 << 18  # [bytes] of a column of a Parquet file read in parts; else a row group is held
# What programs write for "no value"; "nan" is not among them: a number that came out as NaN is another
# matter.
_EMPTY = ["", "NA", "N/A", "#N/A", "null", "NULL"]
# A line that begins so is a comment; what Excel writes of a sum that went wrong (#DIV/0!) is a cell.
_COMMENT = re.compile(r"#(?!(DIV/0!|N/A|NAME\?|NULL!|NUM!|REF!|VALUE!))")
_COMMENT_LINE = re.compile(b"(?m)^" + _COMMENT.pattern.encode() + b".*\n?")
_NUMBER = re.compile(
    r"\s*[-+]?(([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?|inf(inity)?|nan)\s*", re.IGNORECASE
)


@dataclass(frozen=True)
class Beside:
    """Columns of numbers that another file gives, one entry per row of a table and in its order."""

    file: Path
    columns: dict[str, Floats]

    def require(self, rows: int, path: Path) -> None:
        """Raises InputError where the table `path` has other rows."""
        count = len(next(iter(self.columns.values())))
        if count != rows:
            raise InputError(
                f"{path}: has {rows} {'row' if rows == 1 else 'rows'}, but {self.file} gives {count}:"
                " expected one row for each, in the same order"
            )


def _lots_of_groups(metadata: Any, rows: int) -> Iterator[list[int]]:
    """Row groups of a Parquet file one after the other, together where they are small: Arrow keeps what it
    reads of all that it is given until the last batch.
    """
    lot: list[int] = []
    count = 0
    for group in range(metadata.num_row_groups):
        lot.append(group)
        count += metadata.row_group(group).num_rows
        if count >= rows:
            yield lot
            lot, count = [], 0
    if lot:
        yield lot


def _numbers_of(chunk: Any, absent: float) -> NDArray[Any]:
    """Numbers of an Arrow array, empty cells as `absent`, without a copy where there are none.

    Arrow's own way loads pandas, where that is installed, which takes longer than to read a recording.
    """
    full = chunk.fill_null(absent) if chunk.null_count else chunk
    values = full.buffers()[1] if len(full) else b""
    kind = np.dtype(full.type.to_pandas_dtype())
    return np.frombuffer(values, kind, len(full), full.offset * kind.itemsize)


class Table:
    """A table on disk. `names` is known at once; `read` loads it; then columns are taken out one by one.

    comments: lines of a CSV file that begin with # are passed over; the last of those above the first row may
    be the column names, as numpy.savetxt writes them. beside: columns that it has from another file.
    """

    def __init__(self, path: Path, *, comments: bool = False, beside: Beside | None = None) -> None:
        self.path = path
        self.rows = 0
        self._beside = beside
        self._columns: dict[str, Any] = {}
        self._comments = comments
        self._header = 1  # line of the column names
        self._first_row = 0  # of the file, where this is a part of it
        self._header_is_comment = False
        self._in_memory: Any = None
        require_whole_file(path)
        try:
            with path.open("rb") as file:
                head = file.read(65536)
                file.seek(0)
                first_line = self._header_line(file)
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read: {reason(error)}") from None
        if not head.strip():
            raise InputError(f"{path}: is empty, expected a table: column names, then one line per row")
        self._is_parquet = head.startswith(_PARQUET_MAGIC)
        if not self._is_parquet and path.suffix.lower() in PARQUET_SUFFIXES:
            raise InputError(f"{path}: is not a Parquet file, though its name says so")
        self._own = self._parquet_names() if self._is_parquet else self._csv_names(head, first_line)
        self.names: list[str] = [*self._own, *(beside.columns if beside else ())]
        self._check_names()

    @classmethod
    def of(cls, table: Any, called: str) -> Table:
        """A table of Arrow or pandas that is in memory; messages say what it is called."""
        if not isinstance(table, pa.Table):
            try:
                table = pa.Table.from_pandas(table, preserve_index=False, nthreads=1)
            except (pa.ArrowException, TypeError, ValueError, AttributeError) as error:
                raise InputError(f"{called}: cannot be read as a table: {reason(error)[:200]}") from None
        out = cls.__new__(cls)
        out.path, out.rows, out._columns, out._first_row = Path(called), 0, {}, 0
        out._comments, out._header, out._header_is_comment, out._is_parquet = False, 1, False, True
        out._beside = None
        out._own = out.names = [str(name).strip() for name in table.column_names]
        out._check_names()
        out._in_memory = table
        return out

    def refuse(self, message: str, *, row: int | None = None, column: str | None = None) -> NoReturn:
        """Raises InputError about the file, a column, or the cell in `row` (counted from 0)."""
        where = [str(self.path)]
        if row is not None:
            where.append(
                f"row {self._first_row + row + 1}"
                if self._is_parquet
                else f"line {self._csv_cell(row, None)[0]}"
            )
        if column is not None:
            where.append(f"column {column!r}")
        raise InputError(f"{', '.join(where)}: {message}")

    def refuse_cell(self, row: int, column: str, expected: str) -> NoReturn:
        """Raises InputError: what the file holds there, and what was expected."""
        cell = self._text_of(row, column)
        found = "an empty cell" if cell in ("", "None") else shown(cell)
        self.refuse(f"found {found}, expected {expected}", row=row, column=column)

    def _text_of(self, row: int, column: str) -> str:
        if self._beside is not None and column in self._beside.columns:
            return f"{self._beside.columns[column][row]:.6g}"
        if self._is_parquet:
            return str(self._columns[column][row].as_py())
        return self._csv_cell(row, column)[1]

    def read(self, numbers: Collection[str], labels: Collection[str]) -> None:
        """Loads the table. All other columns may hold numbers or nothing; text in them is refused."""
        if self._in_memory is not None:
            table = self._in_memory
        else:
            table = self._read_parquet() if self._is_parquet else self._read_csv(numbers, labels)
        self._take(table, numbers, labels)

    def read_row_groups(
        self, groups: Sequence[int], numbers: Collection[str], labels: Collection[str]
    ) -> None:
        """Loads row groups of a Parquet file that are next to one another; messages count rows from the first
        of the file.
        """
        try:
            with pa.parquet.ParquetFile(self.path, read_dictionary=self._text_columns()) as file:
                if groups[-1] >= file.metadata.num_row_groups:
                    self.refuse(
                        f"has {file.metadata.num_row_groups} row groups, expected {groups[-1] + 1} or more"
                    )
                self._first_row = sum(file.metadata.row_group(k).num_rows for k in range(groups[0]))
                # One thread: workers that share a machine are as many as it has processors.
                table = file.read_row_groups(list(groups), use_threads=False)
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None
        self._take(table, numbers, labels)

    def lots_of_groups(self, rows: int) -> list[tuple[int, ...]]:
        """Numbers of a Parquet file's row groups, together where they are small, without reading them."""
        try:
            with pa.parquet.ParquetFile(self.path) as file:
                return [tuple(lot) for lot in _lots_of_groups(file.metadata, rows)]
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None

    def row_groups(self) -> int:
        """Number of row groups of a Parquet file, without reading them."""
        try:
            with pa.parquet.ParquetFile(self.path) as file:
                return int(file.metadata.num_row_groups)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None

    def _take(self, table: Any, numbers: Collection[str], labels: Collection[str]) -> None:
        self.rows = table.num_rows
        if self.rows == 0:
            self.refuse("has column names but no rows")
        if self._beside is not None:
            self._beside.require(self.rows, self.path)
        self._columns = dict(zip(self._own, table.columns, strict=True))
        for name in self._own:
            kind = self._columns[name].type
            if pa.types.is_dictionary(kind):
                kind = kind.value_type
            if name not in labels and not _is_number(kind):
                self._refuse_text(name, str(kind), known=name in numbers)

    @property
    def is_parquet(self) -> bool:
        return self._is_parquet

    def count_rows(self) -> int:
        """Of a Parquet file, without reading it."""
        return int(self._metadata()[0])

    def parts(self, rows: int, numbers: Collection[str], labels: Collection[str]) -> Iterator[Table]:
        """A Parquet file as tables of so many rows, one after the other; no more of it is in memory. Messages
        count rows from the first of the file.
        """
        first = 0
        try:
            with pa.parquet.ParquetFile(
                self.path,
                read_dictionary=self._text_columns(),
                pre_buffer=False,
                buffer_size=_READ_AHEAD,
            ) as file:
                for groups in _lots_of_groups(file.metadata, rows):
                    for batch in file.iter_batches(batch_size=rows, row_groups=groups):
                        part = copy.copy(self)
                        part._first_row = first
                        part._take(pa.Table.from_batches([batch]), numbers, labels)
                        first += part.rows
                        yield part
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None
        finally:
            pa.default_memory_pool().release_unused()  # else it is kept for the next table

    def numbers(
        self,
        name: str,
        expected: str = "a finite number",
        *,
        gaps: bool = False,
        any_value: bool = False,
        largest: float = LARGEST_NUMBER,
    ) -> Floats:
        """The column as contiguous doubles, without a copy where Arrow has them so.

        Empty cells become NaN if `gaps`, else they are refused; NaN and infinity in the file are refused.
        With `any_value` (a column without a meaning of its own) NaN and infinity are taken.
        """
        if self._beside is not None and name in self._beside.columns:
            return self._beside.columns[name].copy()
        column = self._columns[name]
        if column.type != pa.float64():
            column = column.cast(pa.float64(), safe=False)
        chunks = column.chunks
        if len(chunks) == 1:
            values = _numbers_of(chunks[0], math.nan)
        else:
            values = np.empty(self.rows)
            start = 0
            for chunk in chunks:
                values[start : start + len(chunk)] = _numbers_of(chunk, math.nan)
                start += len(chunk)
        if not any_value:
            wrong = ~np.isfinite(values)
            if gaps and wrong.any() and column.null_count:
                wrong &= ~column.is_null().to_numpy()
            if wrong.any():
                self.refuse_cell(int(np.argmax(wrong)), name, expected)
        limit = _LARGEST_COVARIATE if any_value else largest
        with np.errstate(invalid="ignore"):
            huge = np.isfinite(values) & (np.abs(values) > limit)
        if huge.any():
            self.refuse_cell(int(np.argmax(huge)), name, f"a number between -{limit:g} and {limit:g}")
        if not self._is_parquet:
            del self._columns[name]  # the memory can go; what an error message needs is in the file
        return np.asarray(values, dtype=np.float64)

    def labels(self, name: str) -> tuple[Codes, list[str]]:
        """The column of text as codes into a list of names without spaces around them; -1: an empty cell."""
        column = self._columns[name]
        try:
            if not pa.types.is_dictionary(column.type):
                column = column.cast(pa.string()).dictionary_encode()
            column = column.unify_dictionaries()
            words = [str(word or "").strip() for word in column.chunk(0).dictionary.to_pylist()]
        except (pa.ArrowException, ValueError) as error:
            self.refuse(f"found {column.type} values, expected text ({reason(error)})", column=name)
        names = [word for word in dict.fromkeys(words) if word]
        for name_found in names:
            if not name_found.isprintable():
                self.refuse(
                    f"found {shown(name_found)}, expected a name without unprintable characters", column=name
                )
        place = {word: code for code, word in enumerate(names)}
        lookup = np.array([*(place.get(word, -1) for word in words), -1], dtype=np.int32)
        codes = np.empty(self.rows, dtype=np.int32)
        start = 0
        for chunk in column.chunks:
            codes[start : start + len(chunk)] = lookup[_numbers_of(chunk.indices, len(words))]
            start += len(chunk)
        return codes, names

    # ---- Names

    def _header_line(self, file: BinaryIO) -> bytes:
        """The line of the column names: the first one, comments aside."""
        line = file.readline(_LONGEST_HEADER)
        comment = b""
        while self._comments and line.removeprefix(_MARK).startswith(b"#") and line.endswith(b"\n"):
            comment, line = line, file.readline(_LONGEST_HEADER)
            self._header += 1
        if comment.count(b",") == line.count(b",") > 0 and all(map(_is_cell_of_number, line.split(b","))):
            self._header -= 1
            self._header_is_comment = True
            return comment.removeprefix(_MARK).lstrip(b"# ")
        return line

    def _check_names(self) -> None:
        where = self.path if self._is_parquet else f"{self.path}, line {self._header}"
        if self._beside is not None:
            for name in self._own:
                if name in self._beside.columns:
                    raise InputError(
                        f"{where}: has the column {name!r}, which {self._beside.file} gives as well"
                    )
        self._check_first_line(where)
        if len(self.names) > _MOST_COLUMNS:
            raise InputError(f"{where}: has {len(self.names)} columns, expected at most {_MOST_COLUMNS}")
        first: dict[str, int] = {}
        for number, name in enumerate(self.names, 1):
            if not name:
                end = "; the line ends with a comma: remove it" if number == len(self.names) else ""
                raise InputError(
                    f"{where}: column {number} has no name; the others are"
                    f" {listed([n for n in self.names if n])}{end}"
                )
            if not name.isprintable():
                raise InputError(
                    f"{where}: the name of column {number}, {shown(name)}, holds characters that cannot be"
                    " printed"
                )
            if name in first:
                raise InputError(
                    f"{where}: columns {first[name]} and {number} are both called {name!r}: remove one"
                )
            first[name] = number

    def _check_first_line(self, where: str | Path) -> None:
        """Is it one of column names at all?"""
        first = self.names[0]
        if first.startswith("#") and not self._is_parquet:
            raise InputError(
                f"{where}: found {shown(first)}, expected column names: remove lines that begin with #, or"
                " the # before the names"
            )
        if all(name and _is_cell_of_number(name.encode()) for name in self.names):
            raise InputError(f"{where}: found {listed(self.names, 6)}, expected the names of the columns")
        if len(self.names) > 1:
            return
        for separator, called in ((";", "semicolons"), ("\t", "tabs"), (" ", "blanks")):
            if separator in first:
                raise InputError(
                    f"{where}: columns are separated by {called}, expected commas (and points as decimal"
                    " marks)"
                )

    def _parquet_names(self) -> list[str]:
        try:
            return [str(name).strip() for name in pa.parquet.read_schema(self.path).names]
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None

    def _csv_names(self, head: bytes, first_line: bytes) -> list[str]:
        decoded(self.path, head[: head.rfind(b"\n") + 1] or head)  # binary or of another encoding?
        if len(first_line) >= _LONGEST_HEADER:
            raise InputError(
                f"{self.path}, line {self._header}: has more than {_LONGEST_HEADER} characters, expected"
                " column names"
            )
        line = re.split(r"[\r\n]", decoded(self.path, first_line))[0]
        if not line.strip():
            raise InputError(f"{self.path}, line {self._header}: is blank, expected column names")
        if line.count('"') % 2:
            raise InputError(f"{self.path}, line {self._header}: a quotation mark is not closed")
        try:
            return [name.strip() for name in next(csv.reader([line]))]
        except (csv.Error, StopIteration) as error:
            raise InputError(
                f"{self.path}, line {self._header}: expected column names, separated by commas ({error})"
            ) from None

    # ---- Loading

    def _metadata(self) -> tuple[int, Any]:
        """Number of rows, and the schema, of a Parquet file."""
        try:
            with pa.parquet.ParquetFile(self.path) as file:
                return file.metadata.num_rows, file.schema_arrow
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None

    def _text_columns(self) -> list[str]:
        return [field.name for field in self._metadata()[1] if pa.types.is_string(field.type)]

    def _read_parquet(self) -> Any:
        rows = self.count_rows()
        # Equal values take hardly any room in the file, and all of it in memory.
        if rows * len(self.names) > _MOST_CELLS:
            self.refuse(
                f"has {rows:,} rows of {len(self.names)} columns, expected at most"
                f" {_MOST_CELLS // len(self.names):,}: take every n-th row"
            )
        try:
            # `read_table` loads pandas, where that is installed.
            with pa.parquet.ParquetFile(self.path, read_dictionary=self._text_columns()) as file:
                return file.read()
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputError(f"{self.path}: is a damaged Parquet file: {reason(error)[:200]}") from None

    def _read_csv(self, numbers: Collection[str], labels: Collection[str]) -> Any:
        numbers = [name for name in numbers if name in self._own]
        types = dict.fromkeys(numbers, pa.float64()) | dict.fromkeys(
            labels, pa.dictionary(pa.int32(), pa.string())
        )
        if self.path.stat().st_size > _LARGEST_CSV:
            self.refuse(f"has more than {_LARGEST_CSV // 10**9} GB: take every n-th row")
        # The header is skipped, not parsed again: Arrow would leave spaces around the names.
        source, above = self._without_comments()
        read = pa.csv.ReadOptions(column_names=self._own, skip_rows=above)
        convert = pa.csv.ConvertOptions(
            column_types=types, null_values=_EMPTY, true_values=[], false_values=[]
        )
        try:
            return pa.csv.read_csv(source, read_options=read, convert_options=convert)
        except (pa.ArrowException, OSError, ValueError) as error:
            complaint = reason(error)
        if "Empty CSV file" in complaint or "Could not skip initial" in complaint:
            self.refuse("has column names but no rows")
        self._find_fault(numbers)
        raise InputError(f"{self.path}: cannot be read as a table: {complaint[:200]}")

    def _without_comments(self) -> tuple[Any, int]:
        """What Arrow reads, and how many lines it skips at the top."""
        if not self._comments:
            return str(self.path), 1
        with self.path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            # Not mmap.find: before CPython 3.11.5 it reads a byte beyond a file that fills its last page.
            if not re.search(rb"\n#", data) and self._header == 1 and not self._header_is_comment:
                return str(self.path), 1
            kept = _COMMENT_LINE.sub(b"", data[:].removeprefix(_MARK))
        return pa.BufferReader(kept), 0 if self._header_is_comment else 1

    def _csv_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Line number and cells of every row, the slow way."""
        with self.path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            for _ in range(self._header - 1):
                file.readline()
            reader = csv.reader(file)
            next(reader)  # the column names, in a comment or not
            for cells in reader:
                if cells and self._comments and _COMMENT.match(cells[0]):
                    continue
                if cells:  # Arrow passes over blank lines, too
                    yield self._header - 1 + reader.line_num, cells

    def _find_fault(self, numbers: Collection[str]) -> None:
        """Raises InputError for the first line with a wrong number of cells, or without a number where one
        belongs.
        """
        places = [(self._own.index(name), name) for name in numbers]
        last = 1
        try:
            for line, cells in self._csv_lines():
                last = line
                if len(cells) != len(self._own):
                    raise InputError(
                        f"{self.path}, line {line}: found {len(cells)} cell{'' if len(cells) == 1 else 's'},"
                        f" expected {len(self._own)} as there are column names"
                        f"{'; a comment? remove it' if cells[0].startswith('#') else ''}"
                    )
                for place, name in places:
                    if cells[place] not in _EMPTY and not _NUMBER.fullmatch(cells[place]):
                        self._refuse_word(line, name, cells[place])
        except csv.Error as error:
            raise InputError(f"{self.path}, after line {last}: cannot be read as a table: {error}") from None

    def _refuse_word(self, line: int, name: str, cell: str) -> NoReturn:
        hint = " with a point as decimal mark" if "," in cell else ""
        if "\n" in cell:
            hint = ": a quotation mark that is not closed?"
        raise InputError(
            f"{self.path}, line {line}, column {name!r}: found {shown(cell)}, expected a number{hint}"
        )

    def _csv_cell(self, row: int, column: str | None) -> tuple[int, str]:
        """Line number of a row, and the text in one of its cells."""
        place = None if column is None else self._own.index(column)
        try:
            for index, (line, cells) in enumerate(self._csv_lines()):
                if index == row:
                    return line, cells[place].strip() if place is not None and place < len(cells) else ""
        except (csv.Error, OSError):
            pass
        return row + 2, "?"

    def _refuse_text(self, name: str, kind: str, *, known: bool) -> NoReturn:
        if self._is_parquet:
            unknown = "" if known else ", or no such column: remove it"
            self.refuse(f"holds {kind} values, expected numbers{unknown}", column=name)
        place = self._own.index(name)
        for line, cells in self._csv_lines():
            if place < len(cells) and cells[place] not in _EMPTY and not _NUMBER.fullmatch(cells[place]):
                what = (
                    "a number"
                    if known
                    else "a number: an unknown column is kept as a covariate, and text cannot be one: remove"
                    " the column"
                )
                raise InputError(
                    f"{self.path}, line {line}, column {name!r}: found {shown(cells[place])}, expected {what}"
                )
        self.refuse(f"holds {kind} values, expected numbers", column=name)


def _is_number(kind: Any) -> bool:
    types = pa.types
    return bool(
        types.is_integer(kind)
        or types.is_floating(kind)
        or types.is_decimal(kind)
        or types.is_boolean(kind)  # 0 and 1; of Parquet alone
        or types.is_null(kind)
    )


def _is_cell_of_number(cell: bytes) -> bool:
    text = cell.decode("utf-8", errors="replace").strip()
    return text in _EMPTY or _NUMBER.fullmatch(text) is not None


def sample_rows(rows: int, at_most: int) -> NDArray[np.intp]:
    """`at_most` rows spread evenly over a table, or all of them."""
    step = max(1, math.ceil(rows / at_most))
    return np.arange(0, rows, step, dtype=np.intp)
