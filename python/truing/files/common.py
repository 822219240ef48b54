# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the readers and writers share: units, messages, output that is never half-written."""

from __future__ import annotations

import contextlib
import csv
import io
import os
import secrets
import shutil
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import ArrayLike, NDArray

from truing.errors import InputError
from truing.rotations import quaternions_from_rotations

if TYPE_CHECKING:
    from truing._core import Robot

PathLike = str | os.PathLike[str]
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


def decoded(path: Path, data: bytes) -> str:
    """`data` as text; an InputError that says why when it is not UTF-8 text."""
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


def reason(error: BaseException) -> str:
    """The part of an operating system's error that a user needs."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error).strip().split("\n")[0] or type(error).__name__


# ---- Output that is whole or not there -----------------------------------------------------------


def _temporary_beside(path: Path) -> Path:
    return path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")


@contextlib.contextmanager
def atomic_write(path: PathLike) -> Iterator[Path]:
    """Write a file so that it is there as a whole or not at all.

    Yields the path of an empty temporary file in the same folder (with the same suffix) to write to; it is
    renamed to `path` when the block ends well and removed when it raises, Ctrl-C included. Raises InputError
    when `path` cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected the name of a file to write")
    try:
        temporary = _temporary_beside(path)
        temporary.touch(exist_ok=False)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    try:
        yield temporary
        try:
            temporary.replace(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def atomic_output_dir(path: PathLike) -> Iterator[Path]:
    """Write several files so that all of them appear, or none.

    Yields a temporary folder on the same disk. When the block ends well its content moves to `path` (made if
    needed; files of the same names are replaced, others stay); when it raises, Ctrl-C included, nothing is
    left behind. Raises InputError when `path` cannot be written.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is a file, expected a folder to write to")
    # Inside the folder if it exists (it may be a disk of its own), else as near to it as there is one.
    home = path.absolute()
    while not home.is_dir():
        home = home.parent
    temporary = home / f".truing-{secrets.token_hex(4)}"
    try:
        temporary.mkdir()
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    try:
        yield temporary
        with _interrupts_held_back():
            try:
                _move_content(temporary, path)
            except OSError as error:
                raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _move_content(source: Path, destination: Path) -> None:
    if not destination.exists():
        destination.parent.mkdir(parents=True, exist_ok=True)
        source.replace(destination)
        return
    files = [file for file in sorted(source.rglob("*")) if not file.is_dir()]
    for file in files:
        # First look for what would stop us half-way.
        if (destination / file.relative_to(source)).is_dir():
            raise IsADirectoryError(0, f"{file.relative_to(source)} is a folder there")
    for file in files:
        target = destination / file.relative_to(source)
        target.parent.mkdir(parents=True, exist_ok=True)
        file.replace(target)


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
            return pa.array(values.tolist(), pa.string())
        return pa.array(values, from_pandas=True)
    return pa.array(list(values), pa.string())


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
