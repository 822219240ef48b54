# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A pass over a fleet's rows: every partition is summed to a Gram for each arm in it, and these add up.

What a worker does depends on the partition and on what it is given, nothing else; sums are taken in the order
of the partitions, sixteen at a time. So a pass gives the same bits on one worker or many, and a worker that
dies is replaced by another that does the same again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.gram import ROTATION_LENGTH, Gram, row_hash
from truing.fleet.source import Partition, Source
from truing.fleet.workers import Workers

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

AT_A_TIME = 16  # sums that one task adds, in their order: the tree is the same whoever climbs it
SAMPLE_ROWS = 600  # of an arm, to start from
_SAMPLE_OF_PARTITION = 600  # rows of an arm that a partition offers


@dataclass(frozen=True)
class Arm:
    """One arm, where a pass finds it."""

    robot: _core.Robot  # frames count from where it has them
    names: tuple[str, ...]
    point: Floats  # shape=(p,), values of these
    effects: tuple[_core.EffectRequest, ...] = ()
    # Rows whose errors at `judged` exceed the bounds are left out.
    judged: Floats | None = None
    longest: float = math.inf  # [m]
    widest: float = math.inf  # [rad]


@dataclass(frozen=True)
class Task:
    """What a pass does with every partition."""

    nominal: _core.Robot
    arms: Mapping[str, Arm]
    test_share: float = 0.0
    seed: int = 0
    rotation_length: float = ROTATION_LENGTH
    scores: bool = False


@dataclass(frozen=True)
class Sums:
    """Of some partitions: a Gram for each arm, and the partitions that could not be read."""

    grams: Mapping[str, Gram]
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sample:
    """Of some partitions: rows of each arm, how many and a sample; partitions that cannot be read, and what
    reading the others warns of.
    """

    rows: Mapping[str, int]
    data: Mapping[str, tuple[_core.Measurements, ...]]
    faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


# ---- What a worker does ------------------------------------------------------------------------------------


def sum_partition(partition: Partition, task: Task, frame: Any = None) -> Sums:
    """A Gram for each arm in a partition."""
    try:
        found, _ = partition.read(task.nominal, frame)  # the first pass has told the warnings
    except InputError as error:
        return Sums({}, (str(error),))
    try:
        grams = {name: _gram(data, task, name) for name, data in sorted(found.items()) if name in task.arms}
    except InputError as error:
        return Sums({}, (f"{partition.called}: {error}",))
    return Sums(grams)


def _gram(data: _core.Measurements, task: Task, name: str) -> Gram:
    arm = task.arms[name]
    held_out = rows_held_out(data, task.test_share, task.seed)
    return Gram.of(
        arm.robot,
        dict(zip(arm.names, arm.point, strict=True)),
        data,
        effects=arm.effects,
        counts=_plausible(data, arm),
        held_out=held_out,
        rotation_length=task.rotation_length,
        scores=task.scores,
    )


def _plausible(data: _core.Measurements, arm: Arm) -> Bools | None:
    """Rows within the bounds of their errors; None: all are."""
    if arm.judged is None or not (math.isfinite(arm.longest) or math.isfinite(arm.widest)):
        return None
    nothing = np.zeros(data.rows, dtype=np.bool_)
    at = _core.sum_rows(arm.robot, data, arm.names, arm.judged, nothing, effects=arm.effects)
    good = ~(np.asarray(at.position_error) > arm.longest)
    if len(at.rotation_error):
        good &= ~(np.asarray(at.rotation_error) > arm.widest)
    return np.asarray(good)


def rows_held_out(data: _core.Measurements, share: float, seed: int) -> Bools:
    """shape=(n,): those that the column `set` holds out, or this share of the poses, drawn with the seed:
    rows with equal readings fall to one side, in whichever partition they stand.
    """
    if data.set is not None:
        return np.asarray(np.asarray(data.set) == 1)
    if share <= 0.0:
        return np.zeros(data.rows, dtype=np.bool_)
    with np.errstate(over="ignore"):
        drawn = row_hash(data) ^ np.uint64(seed)
        drawn = (drawn ^ (drawn >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        drawn = (drawn ^ (drawn >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        drawn ^= drawn >> np.uint64(31)
    return np.asarray((drawn >> np.uint64(11)).astype(np.float64) * 2.0**-53 < share)


def sample_partition(partition: Partition, nominal: _core.Robot, frame: Any = None) -> Sample:
    """How many rows each arm has in a partition, and an even sample of them."""
    try:
        found, told = partition.read(nominal, frame)
        for data in found.values():
            _core.validate_measurements(data, nominal)
    except InputError as error:
        return Sample({}, {}, (_with_name(partition, error),))
    names = sorted(found)
    return Sample(
        {name: found[name].rows for name in names},
        {name: (some_rows(found[name], _SAMPLE_OF_PARTITION),) for name in names},
        notes=told,
    )


def _with_name(partition: Partition, error: InputError) -> str:
    text = str(error)
    return text if (partition.path or partition.called) in text else f"{partition.called}: {text}"


def some_rows(data: _core.Measurements, most: int) -> _core.Measurements:
    """An even sample of at most so many rows, with memory of its own."""
    return chosen_rows(data, np.arange(0, data.rows, max(1, math.ceil(data.rows / most))))


_BLOCKS = ("joints", "positions", "orientations", "directions", "joint_speeds")
_COLUMNS = (
    *("distances", "fixed_points", "targets", "payload", "temperature", "time", "pose", "set"),
    *("position_sigma", "rotation_sigma", "weight"),
)


def chosen_rows(data: _core.Measurements, rows: NDArray[np.intp]) -> _core.Measurements:
    """These rows, with memory of their own."""
    given: dict[str, Any] = {}
    for name in (*_BLOCKS, *_COLUMNS):
        value = getattr(data, name)
        if value is not None:
            given[name] = np.array(np.asarray(value)[rows])
    given["covariates"] = {name: np.array(column[rows]) for name, column in data.covariates.items()}
    return data.replace(**given)


# ---- Adding up ---------------------------------------------------------------------------------------------


def add_sums(parts: Sequence[Sums]) -> Sums:
    """Sums of several lots of partitions, in their order."""
    grams: dict[str, Gram] = {}
    for part in parts:
        for name, gram in part.grams.items():
            grams[name] = grams[name] + gram if name in grams else gram
    return Sums(grams, tuple(fault for part in parts for fault in part.faults))


def add_samples(parts: Sequence[Sample]) -> Sample:
    """Samples of several lots of partitions; of each arm no more rows are kept than a fit starts from."""
    rows: dict[str, int] = {}
    data: dict[str, tuple[_core.Measurements, ...]] = {}
    for part in parts:
        for name, count in part.rows.items():
            rows[name] = rows.get(name, 0) + count
            data[name] = (*data.get(name, ()), *part.data[name])
    kept = {name: (together(some, SAMPLE_ROWS),) for name, some in data.items()}
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return Sample(rows, kept, tuple(fault for part in parts for fault in part.faults), notes)


def together(parts: Sequence[_core.Measurements], most: int) -> _core.Measurements:
    """An even sample of several tables as one. Columns that one of them lacks are left out."""
    if len(parts) == 1:
        return some_rows(parts[0], most)
    each = [some_rows(part, max(2, most // len(parts))) for part in parts[:most]]
    given: dict[str, Any] = {}
    for name in (*_BLOCKS, *_COLUMNS):
        values = [getattr(part, name) for part in each]
        if all(value is not None for value in values) and name not in ("pose", "fixed_points"):
            given[name] = np.concatenate([np.asarray(value) for value in values])
    shared = set.intersection(*(set(part.covariates) for part in each))
    given["covariates"] = {
        name: np.concatenate([part.covariates[name] for part in each]) for name in sorted(shared)
    }
    return _core.Measurements(given.pop("joints"), **given)


# ---- The passes --------------------------------------------------------------------------------------------


def sum_all(workers: Workers, source: Source, task: Task) -> Sums:
    """One pass: the Gram of every arm."""
    return workers.run(sum_partition, source, task, add_sums, AT_A_TIME)


def sample_all(workers: Workers, source: Source, nominal: _core.Robot) -> Sample:
    """The first pass: which arms there are, and rows of each to start from. Every cell is checked."""
    return workers.run(sample_partition, source, nominal, add_samples, AT_A_TIME)
