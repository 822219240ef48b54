# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion in LeRobot data sets, versions 2.0 to 3.0: every episode is a recording."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files.common import decoded, listed, read_bytes, reason, shown
from truing.files.output import require_whole_file
from truing.files.recording_parts import checked_times, joints_of_names, make_recordings
from truing.files.table import Floats

# Degrees; radians; or percent of the joint's range, -100 to 100 (a gripper: 0 to 100). The files do not say.
LeRobotUnits = Literal["deg", "rad", "percent"]

_INFO = Path("meta") / "info.json"
_STATE, _ACTION, _TIME, _EPISODE = "observation.state", "action", "timestamp", "episode_index"
_LARGEST_INFO = 10_000_000  # [bytes]
_MOST_CELLS = 200_000_000
_FEWEST_ROWS = 20
_MOST_TURNS = 4.0 * math.pi  # [rad] beyond it numbers look like degrees
_BEYOND = 1.0  # [percent] a reading may be off its range by this


def is_lerobot(path: Path) -> bool:
    return (path / _INFO).is_file()


def read_lerobot(
    path: Path, name: str, robot: _core.Robot, joints: Sequence[str] | None, units: LeRobotUnits | None
) -> list[_core.Recording]:
    """The recordings of a data set, one an episode."""
    info = _read_info(path / _INFO)
    states = _names(path, info, _STATE)
    place = joints_of_names(robot, joints, states, f"{path}, {_STATE}")
    data = _read_data(path, [_STATE, _TIME, _EPISODE], _ACTION if _ACTION in info["features"] else None)
    episode = _episodes(path, data)
    time = _values(path, data[_TIME], _TIME)
    state = _vectors(path, data, _STATE, len(states))[:, place]
    scale = _Scale(path, robot, [states[k] for k in place], units, state)
    action = _actions(path, info, data, states, place)
    held_out = _test_episodes(info)

    out: list[_core.Recording] = []
    seen: set[int] = set()
    starts = [0, *(np.flatnonzero(np.diff(episode)) + 1), len(episode)]
    for start, end in zip(starts[:-1], starts[1:], strict=True):
        number = int(episode[start])
        where = f"{path}, episode {number}"
        if number in seen:
            raise InputError(f"{where}: is there twice, with another one in between")
        seen.add(number)
        if end - start < _FEWEST_ROWS:
            few = f"has {end - start} rows and is left out: a recording has at least {_FEWEST_ROWS}"
            warnings.warn(InputWarning(f"{where}: {few}"), stacklevel=3)
            continue

        def refuse(
            message: str, *, row: int | None = None, column: str | None = None, at: str = where
        ) -> Any:
            raise InputError(f"{at}{'' if row is None else f', row {row + 1}'}, {column}: {message}")

        tables = {
            "time": checked_times(time[start:end], refuse, _TIME),
            "position": scale.angles(state[start:end], refuse, _STATE),
        }
        if action is not None:
            tables["command"] = scale.angles(action[start:end], refuse, _ACTION)
        test = np.full(end - start, number in held_out)
        out += make_recordings(where, f"{name}/episode_{number:06d}", robot, tables, {}, test)
    if not out:
        raise InputError(f"{path}: holds no episode of at least {_FEWEST_ROWS} rows")
    return out


# ---- The data set


def _read_info(path: Path) -> dict[str, Any]:
    try:
        info = json.loads(decoded(path, read_bytes(path, _LARGEST_INFO)))
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: is not JSON: {error}") from None
    features = info.get("features") if isinstance(info, dict) else None
    if not isinstance(features, dict) or _STATE not in features:
        found = listed([str(key) for key in features]) if isinstance(features, dict) else "no features"
        raise InputError(
            f"{path}: found {found}, expected the feature {_STATE!r}: the positions of the joints"
        )
    return dict(info)


def _names(path: Path, info: Mapping[str, Any], feature: str) -> list[str]:
    """What the components of a feature are called, without what LeRobot adds to a joint's name; numbers if
    the data set names none.
    """
    described = info["features"][feature]
    names = described.get("names") if isinstance(described, dict) else None
    if isinstance(names, dict) and len(names) == 1:  # {"motors": [...]}
        names = next(iter(names.values()))
    if isinstance(names, list) and names and all(isinstance(name, str) for name in names):
        return [name.removesuffix(".pos").removeprefix("main_") for name in names]
    shape = described.get("shape") if isinstance(described, dict) else None
    if isinstance(shape, list) and len(shape) == 1 and isinstance(shape[0], int) and 0 < shape[0] < 1000:
        return [str(k) for k in range(1, shape[0] + 1)]
    raise InputError(
        f"{path / _INFO}: the feature {feature!r} has the names {shown(names)}, expected a list of joints"
    )


def _read_data(path: Path, columns: Sequence[str], optional: str | None) -> Any:
    files = sorted(path.glob("data/chunk-*/*.parquet"))
    if not files:
        raise InputError(f"{path}: there is no file data/chunk-*/*.parquet, the data of the episodes")
    tables, cells = [], 0
    for file in files:
        require_whole_file(file)
        try:
            with pa.parquet.ParquetFile(file) as opened:
                there, rows = opened.schema_arrow.names, opened.metadata.num_rows
                missing = [column for column in columns if column not in there]
                if missing:
                    raise InputError(
                        f"{file}: there is no column {missing[0]!r}; the columns are {listed(there)}"
                    )
                cells += rows * 20
                if cells > _MOST_CELLS:
                    raise InputError(f"{path}: has more than {_MOST_CELLS // 20:,} rows: take fewer episodes")
                tables.append(opened.read(columns=[*columns, *([optional] if optional in there else [])]))
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{file}: is a damaged Parquet file: {reason(error)[:200]}") from None
    try:
        return pa.concat_tables(tables, promote_options="permissive")
    except pa.ArrowException as error:
        raise InputError(f"{path}: the files of its data differ: {reason(error)[:200]}") from None


def _episodes(path: Path, data: Any) -> Any:
    values = _values(path, data[_EPISODE], _EPISODE)
    good = (values == np.floor(values)) & (values >= 0.0) & (values < 2**31)
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(
            f"{path}, column {_EPISODE!r}, row {row + 1}: found {values[row]:g}, expected an episode"
        )
    return values.astype(np.int64)


def _values(path: Path, column: Any, name: str) -> Floats:
    try:
        values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    except (pa.ArrowException, ValueError) as error:
        raise InputError(f"{path}, column {name!r}: found {column.type}, expected numbers: {error}") from None
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise InputError(
            f"{path}, column {name!r}, value {row + 1}: found {values[row]}, expected a finite number"
        )
    return np.asarray(values, dtype=np.float64)


def _vectors(path: Path, data: Any, name: str, width: int) -> Floats:
    """shape=(rows, width) of a column of lists."""
    column = data[name].combine_chunks()
    kind = column.type
    if not (pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)):
        raise InputError(
            f"{path}, column {name!r}: found {kind}, expected a list of {width} numbers in each row"
        )
    lengths = pa.compute.list_value_length(column).fill_null(-1).to_numpy(zero_copy_only=False)
    if (lengths != width).any():
        row = int(np.argmax(lengths != width))
        raise InputError(
            f"{path}, column {name!r}, row {row + 1}: found {max(int(lengths[row]), 0)} numbers, expected"
            f" {width} as meta/info.json names them"
        )
    return _values(path, column.flatten(), name).reshape(-1, width)


def _actions(
    path: Path, info: Mapping[str, Any], data: Any, states: Sequence[str], place: Sequence[int]
) -> Floats | None:
    """Positions commanded, in the units of the file; None where actions are none of the joints' positions."""
    if _ACTION not in data.column_names:
        return None
    if _names(path, info, _ACTION) != list(states):
        warnings.warn(
            InputWarning(
                f"{path}: actions are not the positions of the joints of {_STATE} and are left out: they are"
                f" {listed(_names(path, info, _ACTION))}"
            ),
            stacklevel=4,
        )
        return None
    return _vectors(path, data, _ACTION, len(states))[:, place]


def _test_episodes(info: Mapping[str, Any]) -> range:
    """Episodes of the split "test": "40:50"."""
    splits = info.get("splits")
    words = str(splits.get("test", "")).split(":") if isinstance(splits, dict) else []
    if len(words) == 2 and all(word.isdecimal() and len(word) < 10 for word in words):
        return range(int(words[0]), int(words[1]))
    return range(0)


# ---- Units


class _Scale:
    """From the numbers of the file to rad (m). Refuses units that cannot be those of the file."""

    def __init__(
        self,
        path: Path,
        robot: _core.Robot,
        names: Sequence[str],
        units: LeRobotUnits | None,
        state: Floats,
    ) -> None:
        self.joints = [robot.joints[index] for index in robot.driven_joints()]
        largest = float(np.abs(state).max()) if state.size else 0.0
        if units not in ("deg", "rad", "percent"):
            raise InputError(
                f"{path}: does not say in which unit positions are (the largest is {largest:.4g}): say"
                " --units deg for degrees, rad for radians, or percent for -100 to 100 of each joint's range,"
                " as LeRobot normalises them by default (in Python: units=)"
            )
        if units == "rad" and largest > _MOST_TURNS:
            raise InputError(
                f"{path}: the largest position is {largest:.4g}, expected radians as --units (in"
                " Python: units=) says: it looks like degrees or percent"
            )
        self.lowest, self.size, self.ranges = [], [], []
        for name, joint in zip(names, self.joints, strict=True):
            gripper = "gripper" in name and units != "rad"
            if units == "percent" or gripper:
                self._add_range(path, name, joint, 0.0 if gripper else -100.0)
            else:
                degrees = units == "deg" and joint.type == "revolute"
                self.lowest.append(0.0)
                self.size.append(math.pi / 180.0 if degrees else 1.0)
                self.ranges.append((-math.inf, math.inf))

    def _add_range(self, path: Path, name: str, joint: _core.Joint, bottom: float) -> None:
        """bottom to 100 are the joint's lower and upper limit."""
        if not (math.isfinite(joint.lower) and math.isfinite(joint.upper)):
            raise InputError(
                f"{path}: positions of {name!r} are percent of its range, but joint {joint.name!r} of the"
                " robot has no limits: give the robot limits, those of the calibration of the recorded arm"
            )
        size = (joint.upper - joint.lower) / (100.0 - bottom)
        self.lowest.append(joint.lower - bottom * size)
        self.size.append(size)
        self.ranges.append((bottom - _BEYOND, 100.0 + _BEYOND))

    def angles(self, values: Floats, refuse: Any, column: str) -> Floats:
        for k, (low, high) in enumerate(self.ranges):
            good = (values[:, k] >= low) & (values[:, k] <= high)
            if not good.all():
                row = int(np.argmin(good))
                refuse(
                    f"found {values[row, k]:.5g} for joint {self.joints[k].name!r}, expected percent of its"
                    f" range from {low + _BEYOND:g} to 100",
                    row=row,
                    column=column,
                )
        return np.asarray(values * np.array(self.size) + np.array(self.lowest), order="F")
