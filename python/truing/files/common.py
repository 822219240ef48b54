# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the readers and writers share: units, messages, tables."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import ArrayLike, NDArray

from truing.errors import InputError
from truing.files.output import (
    PathLike as PathLike,
    atomic_output_dir as atomic_output_dir,
    atomic_write as atomic_write,
    reason as reason,
    require_whole_file,
)
from truing.rotations import quaternions_from_rotations

if TYPE_CHECKING:
    from truing._core import Robot

LengthUnit = Literal["m", "mm"]
AngleUnit = Literal["rad", "deg"]

# Names of a small motion's six components, as covariances and standard errors have them.
MOTIONS = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")
PARQUET_SUFFIXES = (".parquet", ".pq")


@dataclass(frozen=True)
class Units:
    """The units of a file. In memory everything is SI (m, rad, kg)."""

    length: LengthUnit = "m"
    angle: AngleUnit = "rad"

    def __post_init__(self) -> None:
        if self.length not in ("m", "mm") or self.angle not in ("rad", "deg"):
            raise InputError(
                f"units: found length {self.length!r} and angle {self.angle!r}, expected length m or mm,"
                " angle rad or deg"
            )


def shown(value: object, limit: int = 60) -> str:
    """`value` as an error message quotes it: one line, not too long."""
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def listed(names: Sequence[str], limit: int = 30) -> str:
    """'a, b, c' for a message; a very long list is cut and says so."""
    text = ", ".join(names[:limit])
    return text if len(names) <= limit else f"{text}, ... ({len(names)} in all)"


def read_bytes(path: Path, largest: int) -> bytes:
    """The whole file. InputError if it is not there, cannot be read, or has more than `largest` bytes."""
    require_whole_file(path)
    try:
        with path.open("rb") as file:
            data = file.read(largest + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {reason(error)}") from None
    if len(data) > largest:
        raise InputError(
            f"{path}: has more than {largest // 1_000_000} MB, far too much for this kind of file"
        )
    return data


# How files begin that are none of ours, and what to do about it.
_OTHER_KINDS = (
    (b"\x1f\x8b", "is compressed by gzip: unpack it first (gunzip)"),
    (b"BZh", "is compressed by bzip2: unpack it first (bunzip2)"),
    (b"\xfd7zXZ", "is compressed by xz: unpack it first (unxz)"),
    (b"\x28\xb5\x2f\xfd", "is compressed by zstd: unpack it first (unzstd)"),
    (b"PK\x03\x04", "is a zip archive or a workbook (.xlsx, .ods): unpack it, or save its sheet as CSV"),
    (b"\xd0\xcf\x11\xe0", "is a workbook (.xls): save its sheet as CSV (UTF-8)"),
    (b"\x93NUMPY", "is an array of numpy: save it as CSV or Parquet, with the names of its columns"),
    (b"\x89HDF", "is an HDF5 file: save its table as CSV or Parquet"),
    (b"MATLAB 5.0 MAT-file", "is a MAT-file: save its table as CSV or Parquet (writetable)"),
    (b"%PDF-", "is a PDF, expected text"),
    (b"\x89PNG", "is a picture, expected text"),
    (b"version https://git-lfs", "stands for a file that was not fetched: `git lfs pull` fetches it"),
)
_WEB_PAGE = re.compile(rb"\s*<(!doctype html|html)", re.IGNORECASE)


def refuse_other_kinds(path: Path, head: bytes) -> None:
    """Raises InputError for a file that begins as one of another kind does."""
    for beginning, kind in _OTHER_KINDS:
        if head.startswith(beginning):
            raise InputError(f"{path}: {kind}")
    if _WEB_PAGE.match(head):
        raise InputError(f"{path}: is a web page, not the file that it speaks of: download that")


def decoded(path: Path, data: bytes) -> str:
    """`data` as text; an InputError that says why when it is not UTF-8 text."""
    refuse_other_kinds(path, data)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path}: is UTF-16 text, expected UTF-8: save it again as UTF-8")
    position = data.find(b"\0")
    if position >= 0:
        raise InputError(f"{path}: is a binary file (byte {position} is zero), expected UTF-8 text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{path}, line {line}: byte 0x{data[error.start]:02x} is not UTF-8: a binary file, or text in"
            " another encoding"
        ) from None


# ---- Tables --------------------------------------------------------------------------------------


def write_table(path: PathLike, columns: Mapping[str, ArrayLike | Sequence[str | None]]) -> None:
    """Write named columns of equal length as CSV, or as Parquet when `path` ends in .parquet.

    Numbers are written so that reading gives the same bits; NaN and None become empty cells. Atomic.
    """
    path = Path(path)
    arrays = {name: _arrow_column(values) for name, values in columns.items()}
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"columns of different lengths: {lengths}")
    table = pa.table(arrays)
    with atomic_write(path) as temporary:
        if path.suffix.lower() in PARQUET_SUFFIXES:
            pa.parquet.write_table(table, temporary)
        else:
            _write_csv(temporary, table)


def _arrow_column(values: Any) -> Any:
    if isinstance(values, np.ndarray) or not any(value is None or isinstance(value, str) for value in values):
        values = np.asarray(values)
        if values.ndim != 1:
            raise ValueError(f"a column has shape {values.shape}, expected one dimension")
        if values.dtype.kind == "U":
            return _text_column(values.tolist())
        return _doubles_column(values) if values.dtype == np.float64 else pa.array(values, from_pandas=True)
    return _text_column(list(values))


# Of buffers, as Arrow's own conversions load pandas where that is installed: a third of a second.
def _doubles_column(values: NDArray[np.float64]) -> Any:
    absent = np.isnan(values)
    buffers = [_valid(~absent), pa.py_buffer(np.ascontiguousarray(values))]
    return pa.Array.from_buffers(pa.float64(), len(values), buffers)


def _text_column(values: list[str | None]) -> Any:
    words = [b"" if value is None else value.encode() for value in values]
    ends = np.cumsum([0, *map(len, words)])
    if ends[-1] > np.iinfo(np.int32).max:  # Arrow parts it
        return pa.array(values, pa.string())
    valid = _valid(np.array([value is not None for value in values], dtype=np.bool_))
    buffers = [valid, pa.py_buffer(ends.astype(np.int32)), pa.py_buffer(b"".join(words))]
    return pa.Array.from_buffers(pa.string(), len(values), buffers)


def _valid(there: NDArray[np.bool_]) -> Any:
    """Arrow's bits; None: all are."""
    return None if there.all() else pa.py_buffer(np.packbits(there, bitorder="little"))


def _write_csv(path: Path, table: Any) -> None:
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(table.column_names)

    # Arrow's "needed" puts quotes around all text; "none" refuses text that does need them.
    for quoting in ("none", "needed"):
        with path.open("wb") as file:
            file.write(header.getvalue().encode())
            options = pa.csv.WriteOptions(include_header=False, quoting_style=quoting)
            try:
                pa.csv.write_csv(table, file, options)
            except pa.ArrowInvalid:
                if quoting == "needed":
                    raise
                continue
        return


def joint_columns(robot: Robot, joints: NDArray[np.float64]) -> dict[str, Any]:
    """Joint readings as columns: `q1_rad` …, `_m` for prismatic joints."""
    units = ["rad" if robot.joints[index].type == "revolute" else "m" for index in robot.driven_joints()]
    return {f"q{k + 1}_{unit}": joints[:, k] for k, unit in enumerate(units)}


def frame_dict(T: NDArray[np.float64]) -> dict[str, float]:
    """A frame as files have it: x_m y_m z_m qw qx qy qz."""
    q = quaternions_from_rotations(np.asarray(T)[None, :3, :3])[0]
    return {
        **{f"{axis}_m": float(T[k, 3]) for k, axis in enumerate("xyz")},
        **dict(zip(("qw", "qx", "qy", "qz"), map(float, q), strict=True)),
    }
