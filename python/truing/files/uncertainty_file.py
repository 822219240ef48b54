# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What an identification left unknown: the fitted parameters of its result.json, and covariance.csv beside
it.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing.errors import InputError
from truing.files.common import PathLike, decoded, listed, read_bytes
from truing.files.table import Floats, Table

_FORMAT = "truing-identification/1"
_LARGEST = 256_000_000
_COVARIANCE = "covariance.csv"


@dataclass(frozen=True)
class Uncertainty:
    """Fitted parameters and their covariance, for `truing.compensate`."""

    names: tuple[str, ...]
    values: tuple[float, ...]  # in the parameters' units
    covariance: Floats  # shape=(n, n), in the products of these units


def load_uncertainty(path: PathLike) -> Uncertainty:
    """Read what `truing identify` wrote: result.json at `path`, and covariance.csv in the same folder.

    Raises InputError that names the file and what is wrong with it.
    """
    path = Path(path)
    values = _fitted(path)
    table = Table(path.with_name(_COVARIANCE))
    names = [name for name in table.names if name != "name"]
    if "name" not in table.names:
        table.refuse(f"there is no column 'name'; the columns are {listed(table.names)}")
    missing, more = (
        [name for name in values if name not in names],
        [name for name in names if name not in values],
    )
    if missing or more:
        table.refuse(
            f"{'lacks' if missing else 'has'} {listed(missing or more)}, which"
            f" {'was' if missing else 'was not'} fitted in {path}: the two files are not of one"
            " identification"
        )
    table.read(names, ["name"])
    codes, rows = table.labels("name")
    if [rows[code] if code >= 0 else "" for code in codes] != names:
        table.refuse("rows and columns have different names: this is no covariance of truing identify")
    covariance = np.column_stack([table.numbers(name) for name in names]) if names else np.empty((0, 0))
    if (
        np.abs(covariance - covariance.T).max(initial=0.0) > 1e-6 * np.abs(covariance).max(initial=0.0)
        or (np.diag(covariance) < 0).any()
    ):
        table.refuse("is not symmetric, or has a variance below zero: this is no covariance")
    return Uncertainty(tuple(names), tuple(values[name] for name in names), covariance)


def _fitted(path: Path) -> dict[str, float]:
    """Value by name of the parameters that were fitted."""
    text = decoded(path, read_bytes(path, _LARGEST))
    try:
        result: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON: {error}") from None
    if not isinstance(result, dict) or result.get("format") != _FORMAT:
        found = result.get("format") if isinstance(result, dict) else None
        raise InputError(
            f"{path}: found format {found!r}, expected {_FORMAT!r}: the result.json of truing identify"
        )
    try:
        fitted = {str(p["name"]): float(p["value"]) for p in result["parameters"] if not p["frozen"]}
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"{path}: its parameters cannot be read, expected a list of name, value, frozen"
        ) from None
    if not fitted or not all(math.isfinite(value) for value in fitted.values()):
        raise InputError(f"{path}: has no fitted parameters, or values that are not finite")
    return fitted
