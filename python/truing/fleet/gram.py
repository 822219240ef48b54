# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A Gram: what some rows of measurements say of a robot's parameters, as sums. Grams of other rows add to it.

A Gram of p parameters is p x p numbers, whatever the rows. Everything that `truing.fleet` finds, it finds
from these sums.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.files.common import PathLike
from truing.files.gram_file import load_gram_arrays, save_gram_arrays
from truing.files.robot_file import robot_to_yaml

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]

ROTATION_LENGTH = 0.1  # [m] a rotation error of 1 rad counts as this length, as `identify` has it
_LOWEST, _DECADES, _PER_DECADE = -10, 13, 64  # 1e-10 to 1e3 m or rad: neighbours differ by 3.7 %
_BINS = _DECADES * _PER_DECADE + 2  # what lies below and what lies above has a bin each


@dataclass(frozen=True)
class ErrorCounts:
    """How long the errors of some rows are: a histogram on a logarithmic scale, and sums. They add.

    counts: shape=(834,): below 1e-10, 64 to each decade up to 1e3, and above. total [m | rad], squares
    [m^2 | rad^2]: sums of the lengths and their squares. largest [m | rad].
    """

    counts: Integers
    total: float
    squares: float
    largest: float

    @classmethod
    def of(cls, lengths: Floats) -> ErrorCounts:
        """lengths: shape=(n,) [m | rad]; NaN: not measured."""
        known = lengths[np.isfinite(lengths)]
        with np.errstate(divide="ignore"):
            place = np.floor((np.log10(known) - _LOWEST) * _PER_DECADE) + 1
        bins = np.clip(place, 0, _BINS - 1).astype(np.int64)
        return cls(
            np.bincount(bins, minlength=_BINS).astype(np.int64),
            float(known.sum()),
            float(known @ known),
            float(known.max(initial=0.0)),
        )

    def __add__(self, other: ErrorCounts) -> ErrorCounts:
        return ErrorCounts(
            self.counts + other.counts,
            self.total + other.total,
            self.squares + other.squares,
            max(self.largest, other.largest),
        )

    @property
    def n(self) -> int:
        """Number of errors counted."""
        return int(self.counts.sum())

    @property
    def rms(self) -> float:
        """Root mean square [m | rad]; NaN: none counted."""
        return math.sqrt(self.squares / self.n) if self.n else math.nan

    @property
    def mean(self) -> float:
        """Mean [m | rad]; NaN: none counted."""
        return self.total / self.n if self.n else math.nan

    def quantile(self, share: float) -> float:
        """The length that this share of the errors does not exceed [m | rad], to about 1 %: the bin's share
        is spread evenly over the logarithm of its lengths. NaN: none counted.
        """
        if not self.n:
            return math.nan
        below = np.cumsum(self.counts)
        k = int(np.searchsorted(below, share * self.n))
        before = int(below[k - 1]) if k else 0
        within = (share * self.n - before) / max(1, int(self.counts[k]))
        return float(min(self.largest, 10.0 ** (_LOWEST + (k - 1 + within) / _PER_DECADE)))


@dataclass(frozen=True)
class Gram:
    """Normal equations of the rows of one arm at given parameters, and the errors of these rows. Grams add.

        whole = truing.Gram.of(robot, {"J2.a": 0.612, "J2.d": 0.0}, first) + truing.Gram.of(...)

    names, units: of the p parameters. point: shape=(p,), their values. xx: shape=(p, p) JᵀWJ. xr: shape=(p,)
    JᵀWr, r predicted minus measured. rr: rᵀWr. values: measured numbers that went in. scores: shape=(p, p),
    sum over poses of g gᵀ, g = JᵀWr of the pose's rows; shape=(0, 0) where it was not asked for. left_out:
    rows that count for nothing. mark: says which these are, as far as one number can. errors, held_out: of
    the rows that are fitted (those left out included) and of those held out, position or distance [m]; turns,
    held_out_turns: their rotation errors [rad]. fingerprint: of model, units, point and weighing. Grams of
    another one do not add: InputError.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    point: Floats
    xx: Floats
    xr: Floats
    rr: float
    values: int
    scores: Floats
    left_out: int
    mark: int
    errors: ErrorCounts
    held_out: ErrorCounts
    turns: ErrorCounts
    held_out_turns: ErrorCounts
    fingerprint: str

    @classmethod
    def of(
        cls,
        robot: _core.Robot,
        parameters: Mapping[str, float],
        data: _core.Measurements,
        *,
        effects: Sequence[_core.EffectRequest] = (),
        counts: Bools | None = None,
        held_out: Bools | None = None,
        rotation_length: float = ROTATION_LENGTH,
        scores: bool = False,
    ) -> Gram:
        """Sums the rows of `data`.

        parameters: values by name, in the order of the model (`truing.fleet.parameters` gives both); frames
        turn from where `robot` has them. effects: what names of effects belong to. counts: shape=(n,), False
        for rows that are left out. held_out: shape=(n,), True for rows of which only the errors are told.
        rotation_length: [m] a rotation error of 1 rad counts as this length. scores: sum the poses' scores
        too.

        Raises InputError on data that cannot be used, and on names that the model does not have.
        """
        names, point = tuple(parameters), np.array(list(parameters.values()), dtype=np.float64)
        counted = np.ones(data.rows, dtype=np.bool_) if counts is None else counts
        kept_back = np.zeros(data.rows, dtype=np.bool_) if held_out is None else held_out
        sums = _core.sum_rows(
            robot,
            data,
            names,
            point,
            counted & ~kept_back,
            effects=effects,
            rotation_length=rotation_length,
            scores=scores,
        )
        lost = ~counted & ~kept_back
        lengths, turns = np.asarray(sums.position_error), np.asarray(sums.rotation_error)
        turns = turns if len(turns) else np.full(data.rows, math.nan)
        return cls(
            names,
            tuple(sums.units),
            point,
            np.asarray(sums.gram),
            np.asarray(sums.gradient),
            sums.squares,
            sums.values,
            np.asarray(sums.scores),
            int(lost.sum()),
            int((row_hash(data)[lost] >> np.uint64(1)).sum(dtype=np.uint64)) if lost.any() else 0,
            ErrorCounts.of(lengths[~kept_back]),
            ErrorCounts.of(lengths[kept_back]),
            ErrorCounts.of(turns[~kept_back]),
            ErrorCounts.of(turns[kept_back]),
            fingerprint(robot, names, point, effects, rotation_length, scores),
        )

    def __add__(self, other: Gram) -> Gram:
        if not isinstance(other, Gram):
            return NotImplemented
        if self.fingerprint != other.fingerprint:
            raise InputError(_why_not(self, other))
        return Gram(
            self.names,
            self.units,
            self.point,
            self.xx + other.xx,
            self.xr + other.xr,
            self.rr + other.rr,
            self.values + other.values,
            self.scores + other.scores,
            self.left_out + other.left_out,
            (self.mark + other.mark) % 2**64,
            self.errors + other.errors,
            self.held_out + other.held_out,
            self.turns + other.turns,
            self.held_out_turns + other.held_out_turns,
            self.fingerprint,
        )

    def __eq__(self, other: object) -> bool:
        """The same to the last bit."""
        return isinstance(other, Gram) and all(
            np.array_equal(mine, theirs)
            for mine, theirs in zip(self._arrays().values(), other._arrays().values(), strict=True)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Gram({self.values} values, {len(self.names)} parameters, rms {1e3 * self.errors.rms:.4g} mm)"

    def save(self, path: PathLike) -> None:
        """Writes a `.gram` file, whole or not at all (docs/reference/files.md)."""
        save_gram_arrays(path, self._arrays())

    @classmethod
    def load(cls, path: PathLike) -> Gram:
        """Reads a `.gram` file. Raises InputError on any other."""
        found = load_gram_arrays(path, _KINDS)
        errors = {
            name: ErrorCounts(found[f"{name}_counts"], *(float(x) for x in found[f"{name}_sums"]))
            for name in _ERRORS
        }
        p = len(found["names"])
        if found["xx"].shape != (p, p) or found["xr"].shape != (p,) or found["point"].shape != (p,):
            raise InputError(f"{path}: has {p} names, expected as many rows and columns of xx: write it anew")
        return cls(
            tuple(str(name) for name in found["names"]),
            tuple(str(unit) for unit in found["units"]),
            found["point"],
            found["xx"],
            found["xr"],
            float(found["rr"]),
            int(found["values"]),
            found["scores"],
            int(found["left_out"]),
            int(found["mark"]),
            fingerprint=str(found["fingerprint"]),
            **errors,
        )

    def _arrays(self) -> dict[str, NDArray[np.generic]]:
        """Every field as an array, as the file has them."""
        out: dict[str, NDArray[np.generic]] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, ErrorCounts):
                out[f"{field.name}_counts"] = value.counts
                out[f"{field.name}_sums"] = np.array([value.total, value.squares, value.largest])
            elif field.name == "mark":
                out["mark"] = np.array(value, dtype=np.uint64)
            elif field.name in ("names", "units"):
                out[field.name] = np.array(value, dtype=np.str_)
            else:
                out[field.name] = np.asarray(value)
        return out


_ERRORS = ("errors", "held_out", "turns", "held_out_turns")
_KINDS = {
    **{"names": "U", "units": "U", "fingerprint": "U", "point": "f", "xx": "f", "xr": "f", "rr": "f"},
    **{"values": "i", "scores": "f", "left_out": "i", "mark": "u"},
    **{f"{name}_counts": "i" for name in _ERRORS},
    **{f"{name}_sums": "f" for name in _ERRORS},
}


def fingerprint(
    robot: _core.Robot,
    names: Sequence[str],
    point: Floats,
    effects: Sequence[_core.EffectRequest],
    rotation_length: float,
    scores: bool,
) -> str:
    """Of all that two Grams must have in common to be added, and of the version that made them."""
    parts = [
        _core.version(),
        robot_to_yaml(robot),
        list(names),
        [float(value).hex() for value in point],
        [[request.effect, *request.joints] for request in effects],
        float(rotation_length).hex(),
        scores,
    ]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


def _why_not(one: Gram, other: Gram) -> str:
    """Why two Grams do not add, in words."""
    if one.names != other.names:
        differ = sorted(set(one.names) ^ set(other.names)) or ["their order"]
        return f"Grams of other parameters do not add: they differ in {', '.join(differ[:5])}"
    if one.units != other.units:
        return f"Grams in other units do not add: found {one.units} and {other.units}"
    if not np.array_equal(one.point, other.point):
        k = int(np.argmax(one.point != other.point))
        return (
            f"Grams at other values do not add: {one.names[k]} is {one.point[k]:.9g} in one and"
            f" {other.point[k]:.9g} in the other"
        )
    return "Grams of another robot, weighing or version of truing do not add: make them anew, from one robot"


def row_hash(data: _core.Measurements) -> NDArray[np.uint64]:
    """shape=(n,): a number for the joint readings of every row (splitmix64's finaliser, joint by joint), the
    same in whichever partition the row stands.
    """
    out = np.zeros(data.rows, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for column in np.asarray(data.joints).T:
            out = out * np.uint64(31) + np.ascontiguousarray(column).view(np.uint64)
            out = (out ^ (out >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            out = (out ^ (out >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            out ^= out >> np.uint64(31)
    return out
