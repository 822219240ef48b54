# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Gram files (`.gram`): arrays by name in one npz, with the format's name among them."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.common import PathLike, atomic_write, reason
from truing.files.output import require_whole_file

GRAM_FORMAT = "truing-gram/1"


def save_gram_arrays(path: PathLike, arrays: Mapping[str, Any]) -> None:
    """Writes arrays by name, whole or not at all."""
    with atomic_write(path) as whole, whole.open("wb") as file:
        np.savez(file, allow_pickle=False, format=np.array(GRAM_FORMAT), **arrays)


def load_gram_arrays(path: PathLike, names: Mapping[str, str]) -> dict[str, NDArray[Any]]:
    """Reads what `save_gram_arrays` wrote. names: the arrays expected, and the kind of each as numpy has it.

    Raises InputError on any other file.
    """
    path = Path(path)
    require_whole_file(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise InputError(f"{path}: is not a Gram file: {reason(error)[:200]}") from None
    tag = str(found.pop("format", "no format"))
    if tag != GRAM_FORMAT:
        raise InputError(f"{path}: found {tag}, expected the format {GRAM_FORMAT}")
    for name, kind in names.items():
        if name not in found or found[name].dtype.kind != kind:
            what = "no such array" if name not in found else f"numbers of kind {found[name].dtype.kind!r}"
            raise InputError(f"{path}, {name!r}: found {what}, expected kind {kind!r}: write the file anew")
    return found
