# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of Universal Robots' Real-Time Data Exchange: what its recorder writes (`record.py`, columns
apart by a space), and ur_rtde's (by a comma).

Names and units are those of the outputs in the RTDE guide.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from truing import _core
from truing.errors import InputError
from truing.files.output import reason
from truing.files.recording_table import recordings_of
from truing.files.table import Table

# Vectors over the joints, counted from 0 there and from 1 here.
_OF_JOINTS = {
    "actual_q": "q{}_rad",
    "actual_qd": "qd{}_rad_s",
    "actual_current": "i{}_A",
    "actual_current_as_torque": "tau{}_Nm",
    "target_q": "u{}_rad",
    "target_qd": "ud{}_rad_s",
    "joint_temperatures": "temp{}_C",
}
_OTHERS = {
    "timestamp": "t_s",
    "actual_robot_voltage": "volt_V",
    "payload": "payload_kg",
    "payload_cog_0": "payload_x_m",
    "payload_cog_1": "payload_y_m",
    "payload_cog_2": "payload_z_m",
}
_OF_JOINT = re.compile(r"(\w+)_([0-9])", re.ASCII)
_LONGEST_HEADER = 65536


def is_rtde(path: Path) -> bool:
    """A text whose first line names the outputs `timestamp` and `actual_q`."""
    return {"timestamp", "actual_q_0"} <= set(_header(path)[0])


def _header(path: Path) -> tuple[list[str], str]:
    """Names in the first line, and what stands between them."""
    try:
        with path.open("rb") as file:
            line = file.readline(_LONGEST_HEADER).decode("utf-8-sig").strip()
    except (OSError, ValueError):
        return [], " "
    between = "," if "," in line else " "
    return [name.strip() for name in line.split(between)], between


def called(name: str) -> str:
    """What an output of RTDE is called in a table of ours; others keep their names."""
    if name in _OTHERS:
        return _OTHERS[name]
    of_joint = _OF_JOINT.fullmatch(name)
    if of_joint and of_joint[1] in _OF_JOINTS:
        return _OF_JOINTS[of_joint[1]].format(int(of_joint[2]) + 1)
    return name


def read_rtde(
    path: Path, name: str, robot: _core.Robot, joints: Sequence[str] | None
) -> list[_core.Recording]:
    """The recordings of a file: one, or one for each run of rows of a set."""
    names, between = _header(path)
    numbers = {output: pa.float64() for output in names if called(output) != output}
    try:
        table = pyarrow.csv.read_csv(
            path,
            read_options=pyarrow.csv.ReadOptions(use_threads=False),  # else a fault's row is not said
            parse_options=pyarrow.csv.ParseOptions(delimiter=between),
            convert_options=pyarrow.csv.ConvertOptions(column_types=numbers),
        )
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{path}: is not a table of RTDE outputs: {reason(error)[:200]}") from None
    table = table.rename_columns([called(output.strip()) for output in table.column_names])
    return recordings_of(Table.of(table, str(path)), name, robot, joints)
