# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measurement files load, or say in which line and column what is wrong."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files import Units, load_measurements, load_robot, robot_to_yaml, save_measurements, write_table

Floats = NDArray[np.float64]
Columns = dict[str, Any]

ROWS = 40
QUARTER = math.pi / 2


def six_axis(lower: float = -math.inf, upper: float = math.inf) -> _core.Robot:
    """An arm of 0.9 m reach with three targets."""
    table = [
        (0.29, 0.0, -QUARTER),
        (0.0, 0.27, 0.0),
        (0.0, 0.07, -QUARTER),
        (0.302, 0.0, QUARTER),
        (0.0, 0.0, -QUARTER),
        (0.072, 0.0, 0.0),
    ]
    joints = [
        _core.Joint(f"J{i}", d=d, a=a, alpha=alpha, lower=lower, upper=upper)
        for i, (d, a, alpha) in enumerate(table, 1)
    ]
    targets = [
        _core.Target(name, _core.frame_from_xyz_rpy([x, 0.02, 0.1], [0, 0, 0]))
        for name, x in (("tool", 0.1), ("p1", 0.0), ("p2", -0.1))
    ]
    return _core.Robot("arm", joints=joints, targets=targets)


def rail() -> _core.Robot:
    """A prismatic joint, a revolute one, and a passive one between."""
    return _core.Robot(
        "rail",
        joints=[
            _core.Joint("lift", type="prismatic", d=0.3),
            _core.Joint("passive", a=0.2, driven_by={"turn": -1.0}),
            _core.Joint("turn", a=0.4),
        ],
    )


def measured(robot: _core.Robot, joints: Floats, target: int = 0) -> Floats:
    return np.array([_core.forward_kinematics(robot, row, target)[-1, :3, 3] for row in joints])


def table(robot: _core.Robot, joints: Floats | None = None, seed: int = 3) -> Columns:
    """A plain measurement table in m and rad."""
    random = np.random.default_rng(seed)
    if joints is None:
        joints = random.uniform(-1.5, 1.5, (ROWS, robot.driven_count))
    columns: Columns = {f"q{number}_rad": values for number, values in enumerate(joints.T, 1)}
    # The tracker stands anywhere.
    T = _core.frame_from_xyz_rpy([2.0, -1.0, 0.5], [0.1, -0.3, 2.0])
    positions = measured(robot, joints) @ T[:3, :3].T + T[:3, 3]
    columns |= dict(zip(("x_m", "y_m", "z_m"), positions.T, strict=True))
    return columns


def write(folder: Path, columns: Mapping[str, Any], name: str = "data.csv") -> Path:
    write_table(folder / name, columns)
    return folder / name


def write_text(folder: Path, text: str | bytes, name: str = "data.csv") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.fixture(autouse=True)
def warnings_are_errors() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def read(path: Path, robot: _core.Robot, **options: bool) -> Any:
    return load_measurements(path, robot, **options)


# ---- What is read --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["data.csv", "data.parquet"])
def test_every_column_arrives_in_si(tmp_path: Path, name: str) -> None:
    robot = six_axis()
    columns = table(robot)
    random = np.random.default_rng(4)
    quaternions = random.normal(size=(ROWS, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    quaternions[5] = np.nan  # not measured there
    for number in range(1, 7):
        columns[f"dir{number}"] = random.integers(-1, 2, ROWS)
        columns[f"qr{number}_deg"] = np.degrees(columns[f"q{number}_rad"])
        columns[f"qd{number}_deg_s"] = random.normal(size=ROWS)
        columns[f"tau{number}_Nm"] = random.normal(size=ROWS)
    columns |= dict(zip(("qw", "qx", "qy", "qz"), quaternions.T, strict=True))
    columns |= {
        "payload_kg": np.full(ROWS, 2.5),
        "temp_C": random.normal(20, 1, ROWS),
        "t_s": np.arange(ROWS) * 0.5,
        "pose": np.arange(ROWS) // 2,
        "target": ["p1", None, "p2", "tool"] * (ROWS // 4),
        "set": ["train", "test"] * (ROWS // 2),
        "sigma_mm": np.full(ROWS, 0.05),
        "sigma_deg": np.full(ROWS, 0.1),
        "weight": np.linspace(0, 1, ROWS),
        "humidity": np.linspace(40, 50, ROWS),
        "std_x_mm": np.ones(ROWS),
        "u95_m": np.full(ROWS, 1e-5),
        "u95_x_m": np.full(ROWS, 1e-5),
        "empty": np.full(ROWS, np.nan),
    }
    data = read(write(tmp_path, columns, name), robot)

    assert data.rows == ROWS
    assert np.array_equal(data.joints, np.column_stack([columns[f"q{number}_rad"] for number in range(1, 7)]))
    assert np.array_equal(data.positions, np.column_stack([columns[axis] for axis in ("x_m", "y_m", "z_m")]))
    assert np.array_equal(data.orientations, quaternions, equal_nan=True)
    assert np.array_equal(
        data.directions, np.column_stack([columns[f"dir{number}"] for number in range(1, 7)])
    )
    np.testing.assert_allclose(data.joint_speeds[:, 2], np.radians(columns["qd3_deg_s"]))
    assert np.array_equal(data.payload, columns["payload_kg"])
    assert np.array_equal(data.temperature, columns["temp_C"])
    assert np.array_equal(data.time, columns["t_s"])
    assert np.array_equal(data.pose, columns["pose"])
    assert list(data.targets[:4]) == [1, 0, 2, 0]
    assert list(data.set[:2]) == [0, 1]
    np.testing.assert_allclose(data.position_sigma, 5e-5)
    np.testing.assert_allclose(data.rotation_sigma, np.radians(0.1))
    assert np.array_equal(data.weight, columns["weight"])
    names = {
        f"{stem}{number}_{unit}"
        for number in range(1, 7)
        for stem, unit in (("qr", "rad"), ("qd", "rad_s"), ("tau", "Nm"))
    }
    assert set(data.covariates) == names | {"humidity", "std_x_mm", "u95_m", "u95_x_m", "empty"}
    np.testing.assert_allclose(data.covariates["qr2_rad"], columns["q2_rad"])
    assert np.isnan(data.covariates["empty"]).all()


def test_prismatic_and_passive_joints(tmp_path: Path) -> None:
    columns = {
        "q1_mm": [100.0, 250.0],
        "q2_deg": [0.0, 90.0],
        "x_mm": [1.0, 2.0],
        "y_mm": [1.0, 2.0],
        "z_mm": [1.0, 290.0],
    }
    data = read(write(tmp_path, columns), rail())
    assert data.joints.tolist() == [[0.1, 0.0], [0.25, math.pi / 2]]
    assert data.positions[1].tolist() == [0.002, 0.002, 0.29]  # the nearest doubles


def test_units_may_differ_between_columns(tmp_path: Path) -> None:
    robot = six_axis()
    columns = table(robot)
    plain = read(write(tmp_path, columns), robot)
    columns["q2_deg"] = np.degrees(columns.pop("q2_rad"))
    columns["z_mm"] = columns.pop("z_m") * 1000
    mixed = read(write(tmp_path, columns), robot)
    np.testing.assert_allclose(mixed.joints, plain.joints, rtol=0, atol=1e-15)
    np.testing.assert_allclose(mixed.positions, plain.positions, rtol=0, atol=1e-15)


def test_distances_and_fixed_points_share_a_file(tmp_path: Path) -> None:
    columns = {
        "q1_m": [0.1, 0.2, 0.3],
        "q2_rad": [0, 1, 2],
        "dist_mm": [500.0, None, np.nan],
        "fixed_point": [None, "cone", "plate"],
    }
    columns["dist_mm"] = np.array([500.0, np.nan, np.nan])
    data = read(write(tmp_path, columns), rail())
    assert data.distances[0] == 0.5
    assert data.positions is None
    assert data.fixed_points.tolist() == [-1, 0, 1]
    assert data.fixed_point_names == ("cone", "plate")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: b"\xef\xbb\xbf" + text,
        lambda text: text.replace(b"\n", b"\r\n"),
        lambda text: text.replace(b",", b" , "),
        lambda text: text.replace(b"\n", b"\n\n", 3)[:-1],
        lambda text: (
            b",".join(b'"%s"' % name for name in text.split(b"\n")[0].split(b",")) + text[text.index(b"\n") :]
        ),
    ],
)
def test_how_the_text_was_saved_does_not_matter(tmp_path: Path, change: Callable[[bytes], bytes]) -> None:
    robot = six_axis()
    columns = table(robot) | {"target": ["p1"] * ROWS, "set": ["train"] * ROWS}
    path = write(tmp_path, columns)
    plain = read(path, robot)
    first, rest = path.read_bytes().split(b"\n", 1)
    changed = change(first + b"\n" + rest)
    if (
        changed.startswith(b"q1_rad,") and b"\n\n" in changed
    ):  # a blank line is passed over below the names, not above
        changed = changed.replace(b"\n\n", b"\n", 1)
    path.write_bytes(changed)
    data = read(path, robot)
    assert np.array_equal(data.joints, plain.joints)
    assert data.targets.tolist() == [1] * ROWS


def test_rows_without_measurements_can_be_asked_for(tmp_path: Path) -> None:
    robot = six_axis()
    columns = {name: values for name, values in table(robot).items() if name.startswith("q")} | {
        "temp_C": np.full(ROWS, 20.0)
    }
    path = write(tmp_path, columns)
    with pytest.raises(
        InputError, match="nothing is measured: expected the columns x_m y_m z_m, or dist_m, or fixed_point"
    ):
        read(path, robot)
    data = read(path, robot, joints_only=True)
    assert (data.rows, data.positions) == (ROWS, None)


def test_set_column_can_be_passed_over(tmp_path: Path) -> None:
    robot = six_axis()
    path = write(tmp_path, table(robot) | {"set": ["validation"] * ROWS})
    assert read(path, robot, set_column=False).set is None


def test_incomplete_joint_speeds_are_covariates(tmp_path: Path) -> None:
    robot = six_axis()
    data = read(write(tmp_path, table(robot) | {"qd1_rad_s": np.zeros(ROWS)}), robot)
    assert data.joint_speeds is None
    assert list(data.covariates) == ["qd1_rad_s"]


# ---- What is written -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["data.csv", "data.parquet"])
def test_saved_measurements_load_bit_for_bit(tmp_path: Path, name: str) -> None:
    robot = six_axis()
    random = np.random.default_rng(5)
    joints = random.uniform(-1.5, 1.5, (ROWS, 6))
    quaternions = random.normal(size=(ROWS, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    data = _core.Measurements(
        joints,
        positions=measured(robot, joints),
        orientations=quaternions,
        targets=random.integers(0, 3, ROWS),
        directions=random.integers(-1, 2, (ROWS, 6)),
        joint_speeds=random.normal(size=(ROWS, 6)),
        payload=random.uniform(0, 5, ROWS),
        temperature=random.normal(size=ROWS),
        time=random.normal(size=ROWS),
        pose=random.integers(0, 9, ROWS),
        set=random.integers(0, 2, ROWS),
        position_sigma=np.full(ROWS, 1e-5),
        rotation_sigma=np.full(ROWS, 1e-4),
        weight=random.uniform(0, 1, ROWS),
        covariates={"u1_rad": random.normal(size=ROWS), "strange name": random.normal(size=ROWS)},
    )
    save_measurements(tmp_path / name, data, robot)
    again = read(tmp_path / name, robot)
    for field in (
        "joints",
        "positions",
        "orientations",
        "targets",
        "directions",
        "joint_speeds",
        "payload",
        "temperature",
        "time",
        "pose",
        "set",
        "position_sigma",
        "rotation_sigma",
        "weight",
    ):
        assert np.array_equal(getattr(again, field), getattr(data, field)), field
    for covariate in data.covariates:
        assert np.array_equal(again.covariates[covariate], data.covariates[covariate])


def test_saved_in_other_units(tmp_path: Path) -> None:
    robot = six_axis()
    data = read(write(tmp_path, table(robot)), robot)
    save_measurements(tmp_path / "mm.csv", data, robot, units=Units("mm", "deg"))
    header = (tmp_path / "mm.csv").read_text().split("\n")[0]
    assert header == "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm"
    again = read(tmp_path / "mm.csv", robot)
    np.testing.assert_allclose(again.joints, data.joints, rtol=1e-15)
    np.testing.assert_allclose(again.positions, data.positions, rtol=1e-15)


def test_touched_points_survive(tmp_path: Path) -> None:
    data = _core.Measurements(
        np.zeros((3, 2)), fixed_points=["cone", None, "plate"], distances=np.array([np.nan, 0.5, np.nan])
    )
    save_measurements(tmp_path / "data.csv", data, rail())
    again = read(tmp_path / "data.csv", rail())
    assert again.fixed_points.tolist() == [0, -1, 1]
    assert again.fixed_point_names == ("cone", "plate")
    assert np.isnan(again.distances).tolist() == [True, False, True]


def test_a_covariate_must_not_pass_for_something_else(tmp_path: Path) -> None:
    robot = six_axis()
    data = _core.Measurements(np.zeros((2, 6)), positions=np.zeros((2, 3)), covariates={"x_m": np.zeros(2)})
    with pytest.raises(InputError, match="'x_m', which means something else"):
        save_measurements(tmp_path / "data.csv", data, robot)
    assert list(tmp_path.iterdir()) == []


# ---- What is refused -----------------------------------------------------------------------------


def renamed(old: str, new: str) -> Callable[[Columns], Any]:
    def change(columns: Columns) -> None:
        items = [(new if name == old else name, values) for name, values in columns.items()]
        columns.clear()
        columns.update(items)

    return change


def put(name: str, row: int, value: Any) -> Callable[[Columns], Any]:
    """`value` in one cell, as text."""

    def change(columns: Columns) -> None:
        values = ["" if item is None else str(item) for item in columns.get(name, ["0"] * ROWS)]
        values[row] = str(value)
        columns[name] = values

    return change


def added(**more: Any) -> Callable[[Columns], Any]:
    return lambda columns: columns.update(more)


def without(name: str) -> Callable[[Columns], Any]:
    return lambda columns: columns.pop(name)


WRONG_NAMES: dict[str, tuple[Callable[[Columns], Any], str]] = {
    "unknown length unit": (renamed("x_m", "x_cm"), "column 'x_cm': unknown unit 'cm', expected x_m or x_mm"),
    "no length unit": (renamed("x_m", "x"), "column 'x': no unit, expected x_m or x_mm"),
    "unknown joint unit": (
        renamed("q1_rad", "q1_foo"),
        "column 'q1_foo': unknown unit 'foo', expected q1_rad or q1_deg or q1_m",
    ),
    "no joint unit": (renamed("q1_rad", "q1"), "column 'q1': no unit, expected q1_rad"),
    "unknown distance unit": (
        renamed("x_m", "dist_ft"),
        "column 'dist_ft': unknown unit 'ft', expected dist_m or dist_mm",
    ),
    "unknown temperature unit": (
        added(temp_K=np.ones(ROWS)),
        "column 'temp_K': unknown unit 'K', expected temp_C",
    ),
    "unknown time unit": (added(t_ms=np.ones(ROWS)), "column 't_ms': unknown unit 'ms', expected t_s"),
    "unknown torque unit": (
        added(tau1_kNm=np.ones(ROWS)),
        "column 'tau1_kNm': unknown unit 'kNm', expected tau1_Nm or tau1_N",
    ),
    "unknown speed unit": (
        added(qd1_rad=np.ones(ROWS)),
        "column 'qd1_rad': unknown unit 'rad', expected qd1_rad_s",
    ),
    "direction with a unit": (added(dir1_rad=np.ones(ROWS)), "column 'dir1_rad': a direction has no unit"),
    "length for a revolute joint": (
        renamed("q1_rad", "q1_mm"),
        "column 'q1_mm': joint 'J1' is revolute, expected q1_rad or q1_deg",
    ),
    "missing joint": (without("q3_rad"), "no column q3_rad or q3_deg for joint 'J3'"),
    "joint in capitals": (renamed("q3_rad", "Q3_rad"), "no column q3_rad .* did you mean 'Q3_rad'"),
    "one joint too many": (
        added(q7_rad=np.ones(ROWS)),
        "column 'q7_rad': the robot has 6 driven joints: J1, J2",
    ),
    "joint twice": (added(q1_deg=np.ones(ROWS)), "column 'q1_deg': column 'q1_rad' is there too"),
    "position twice": (added(x_mm=np.ones(ROWS)), "column 'x_mm': column 'x_m' is there too"),
    "record twice": (
        added(qr1_deg=np.ones(ROWS), qr1_rad=np.ones(ROWS)),
        "column 'qr1_rad': column 'qr1_deg' is there too",
    ),
    "two coordinates": (
        without("z_m"),
        "there is x_m but no column z_m or z_mm: a position has three coordinates",
    ),
    "half a quaternion": (added(qw=np.ones(ROWS)), "there is qw but no column qx"),
    "one direction": (
        added(dir2=np.ones(ROWS)),
        "there is dir2 but no column dir1: .* 0 where it is not known",
    ),
    "nothing measured": (lambda columns: [columns.pop(f"{axis}_m") for axis in "xyz"], "nothing is measured"),
    "blank name": (added(**{"": np.ones(ROWS)}), "line 1: column 10 has no name"),
}

WRONG_CELLS: dict[str, tuple[Callable[[Columns], Any], str]] = {
    # Row 7 stands in line 9.
    "empty joint": (
        put("q3_rad", 7, ""),
        "line 9, column 'q3_rad': found an empty cell, expected a finite number",
    ),
    "NaN joint": (put("q3_rad", 7, "nan"), "line 9, column 'q3_rad': found 'nan', expected a finite number"),
    "infinite joint": (
        put("q3_rad", 7, "inf"),
        "line 9, column 'q3_rad': found 'inf', expected a finite number",
    ),
    "huge joint": (
        put("q3_rad", 7, "1e999"),
        "line 9, column 'q3_rad': found '1e999', expected a finite number",
    ),
    "text in a joint": (put("q3_rad", 7, "abc"), "line 9, column 'q3_rad': found 'abc', expected a number"),
    "half a position": (
        put("y_m", 7, ""),
        "line 9, column 'y_m': found an empty cell, expected a coordinate",
    ),
    "NaN position": (put("y_m", 7, "NaN"), "line 9, column 'y_m': found 'NaN', expected a finite number"),
    "infinite position": (
        put("y_m", 7, "-inf"),
        "line 9, column 'y_m': found '-inf', expected a finite number",
    ),
    "decimal comma": (
        put("y_m", 7, '"0,5"'),
        "line 9, column 'y_m': found '0,5', expected a number with a point",
    ),
    "NaN temperature": (
        put("temp_C", 7, ""),
        "line 9, column 'temp_C': found an empty cell, expected a finite number",
    ),
    "negative payload": (
        put("payload_kg", 7, "-1"),
        "line 9, column 'payload_kg': found '-1', expected a mass of zero or more",
    ),
    "sigma of zero": (
        put("sigma_m", 7, "0"),
        "column 'sigma_m': found '0', expected a standard deviation above zero",
    ),
    "negative weight": (
        put("weight", 7, "-0.5"),
        "line 9, column 'weight': found '-0.5', expected a weight of zero or more",
    ),
    "half a pose number": (
        put("pose", 7, "1.5"),
        "line 9, column 'pose': found '1.5', expected the number of a pose",
    ),
    "pose with a name": (put("pose", 7, "A7"), "line 9, column 'pose': found 'A7', expected a number"),
    "unknown target": (
        put("target", 7, "smr9"),
        "column 'target': the robot has no target '0'; its targets are tool, p1, p2",
    ),
    "unknown set": (put("set", 7, "validate"), "line 2, column 'set': found '0', expected train or test"),
    "text column": (
        put("operator", 7, "Jane"),
        "line 9, column 'operator': found 'Jane', expected a number: an unknown column",
    ),
    "too few cells": (put("z_m", 7, "cut here"), "line 9: found 8 cells, expected 9"),
    "too many cells": (put("z_m", 7, "1,2"), "line 9: found 10 cells, expected 9"),
}


@pytest.mark.parametrize("case", WRONG_NAMES)
def test_wrong_columns_are_named(tmp_path: Path, case: str) -> None:
    change, message = WRONG_NAMES[case]
    robot = six_axis()
    columns = table(robot)
    change(columns)
    with pytest.raises(InputError, match=message) as error:
        read(write(tmp_path, columns), robot)
    assert "data.csv" in str(error.value)
    if case == "blank name":
        return
    with pytest.raises(InputError, match=message):
        read(write(tmp_path, columns, "data.parquet"), robot)


@pytest.mark.parametrize("case", WRONG_CELLS)
def test_wrong_cells_are_named_with_line_and_column(tmp_path: Path, case: str) -> None:
    change, message = WRONG_CELLS[case]
    robot = six_axis()
    columns = table(robot)
    change(columns)
    rows = [
        ",".join(columns),
        *(",".join(str(cell) for cell in row) for row in zip(*columns.values(), strict=True)),
    ]
    text = "\n".join(rows) + "\n"
    with pytest.raises(InputError, match=message) as error:
        read(write_text(tmp_path, text.replace(",cut here", "")), robot)
    assert "data.csv" in str(error.value)


def test_lines_are_counted_as_an_editor_does(tmp_path: Path) -> None:
    text = "q1_m,q2_rad,dist_m\n0,0,1\n\n0,0,1\r\n\n0,nan,1\n"
    with pytest.raises(InputError, match="line 6, column 'q2_rad': found 'nan'"):
        read(write_text(tmp_path, text), rail())


def test_a_fault_far_down_a_long_file_is_found(tmp_path: Path) -> None:
    rows = ["0.1,0.2,0.5"] * 200_000
    rows[150_000] = "0.1,0.2"
    with pytest.raises(InputError, match="line 150002: found 2 cells, expected 3"):
        read(write_text(tmp_path, "\n".join(["q1_m,q2_rad,dist_m", *rows])), rail())
    rows[150_000] = "0.1,,0.5"
    with pytest.raises(InputError, match="line 150002, column 'q2_rad': found an empty cell"):
        read(write_text(tmp_path, "\n".join(["q1_m,q2_rad,dist_m", *rows])), rail())


@pytest.mark.parametrize(
    ("quaternion", "message"),
    [
        (
            (1.0, 0.1, 0.0, 0.0),
            r"line 9: found the quaternion 1 0.1 0 0, of length 1.00499; expected a unit quaternion",
        ),
        ((0.0, 0.0, 0.0, 0.0), "of length 0"),
        ((1.0, np.nan, 0.0, 0.0), "which is incomplete"),
        ((np.inf, 0.0, 0.0, 0.0), "which is incomplete"),
    ],
)
def test_quaternions_are_of_unit_length(tmp_path: Path, quaternion: tuple[float, ...], message: str) -> None:
    robot = six_axis()
    columns = table(robot) | {
        "qw": np.ones(ROWS),
        "qx": np.zeros(ROWS),
        "qy": np.zeros(ROWS),
        "qz": np.zeros(ROWS),
    }
    read(write(tmp_path, columns), robot)
    for name, value in zip(("qw", "qx", "qy", "qz"), quaternion, strict=True):
        columns[name][7] = value
    with pytest.raises(InputError, match=message):
        read(write(tmp_path, columns), robot)


def test_every_row_needs_a_measurement(tmp_path: Path) -> None:
    robot = six_axis()
    columns = table(robot)
    for axis in "xyz":
        columns[f"{axis}_m"][7] = np.nan
    with pytest.raises(
        InputError, match="line 9: nothing is measured: found empty cells, expected values in x_m, y_m, z_m"
    ):
        read(write(tmp_path, columns), robot)
    columns["dist_m"] = np.where(np.arange(ROWS) == 7, 0.4, np.nan)
    read(write(tmp_path, columns), robot)
    columns |= {"qw": np.ones(ROWS), "qx": np.zeros(ROWS), "qy": np.zeros(ROWS), "qz": np.zeros(ROWS)}
    with pytest.raises(InputError, match="line 9: found an orientation without a position"):
        read(write(tmp_path, columns), robot)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n \n", "is empty"),
        (b"q1_m,q2_rad,dist_m\n", "has column names but no rows"),
        (b"q1_m,q2_rad,dist_m", "has column names but no rows"),
        (b"q1_m,q2_rad,dist_m\n\n\n", "has column names but no rows"),
        (b"\nq1_m,q2_rad,dist_m\n0,0,1\n", "line 1: is blank, expected column names"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "is a picture, expected text"),
        (b"\x1f\x8b\x08\x00\x00", "is compressed by gzip: unpack it first"),
        (b"PK\x03\x04\x14\x00", "a workbook .*save its sheet as CSV"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 1\n", "git lfs pull"),
        (b"\n<!DOCTYPE html><html><body>404</body></html>\n", "is a web page"),
        (b"# recorded on Monday\nq1_m,q2_rad,dist_m\n0,0,1\n", "line 1: found '# recorded .*begin with #"),
        (
            b"q1_m,q2_rad,dist_m\n# pause\n0,0,1\n",
            "line 2: found 1 cell, expected 3 .*a comment\\? remove it",
        ),
        (b"0.5,0,1\n0.5,0,2\n", "line 1: found 0.5, 0, 1, expected the names of the columns"),
        (b"q1_m q2_rad dist_m\n0 0 1\n", "line 1: columns are separated by blanks"),
        (b"q1_m,q2_rad,dist_m,\n0,0,1,\n", "line 1: column 4 has no name; .*ends with a comma: remove it"),
        (
            b'q1_m,q2_rad,dist_m\n"0,0,1\n0,0,1\n"0,0,1\n',
            "column 'q1_m': .*a quotation mark that is not closed",
        ),
        (b"Q1_M,q2_rad,dist_m\n0,0,1\n", "did you mean 'Q1_M'\\? "),
        (
            b"q1_m,q2_rad,dist_m,remark\n0,0,1,good\n",
            "column 'remark': .*text cannot be one: remove the column",
        ),
        (b"\xff\xfeq\x001\x00", "UTF-16"),
        (b"q1_m,q2_rad,Temp\xe9rature\n0,0,1\n", "line 1: byte 0xe9 is not UTF-8"),
        (b"q1_m;q2_rad;dist_m\n0;0;1\n", "line 1: columns are separated by semicolons, expected commas"),
        (b"q1_m\tq2_rad\tdist_m\n0\t0\t1\n", "line 1: columns are separated by tabs"),
        (b"q1_m,q2_rad,q1_m,dist_m\n0,0,0,1\n", "line 1: columns 1 and 3 are both called 'q1_m'"),
        (b'q1_m,q2_rad,"dist_m\n0,0,1\n', "line 1: a quotation mark is not closed"),
        (b"PAR1 but no more", "damaged Parquet"),
        (b"q1_m,q2_rad,dist_m\n0,0,1\n0,\x00,1\n", "binary file"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(write_text(tmp_path, content), rail())


def test_missing_files_and_false_names_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read(tmp_path / "none.csv", rail())
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path, rail())
    with pytest.raises(InputError, match="is not a Parquet file"):
        read(write_text(tmp_path, "q1_m,q2_rad,dist_m\n0,0,1\n", "data.parquet"), rail())


def test_parquet_columns_of_other_types_are_refused(tmp_path: Path) -> None:
    columns = {"q1_m": [0.0], "q2_rad": [0.0], "dist_m": [1.0]}
    for name, values, message in (
        ("q1_m", ["a"], "column 'q1_m': holds string values, expected numbers"),
        ("when", pa.array([0], pa.timestamp("s")), "column 'when': holds timestamp"),
        ("nested", [[1.0]], "column 'nested': holds list"),
        ("target", [1.5], "the robot has no target '1.5'"),
    ):
        pa.parquet.write_table(pa.table(columns | {name: values}), tmp_path / "data.parquet")
        with pytest.raises(InputError, match=message):
            read(tmp_path / "data.parquet", rail())
    pa.parquet.write_table(
        pa.table({"q1_m": [0, 1], "q2_rad": [None, 1], "dist_m": [1.0, 1.0]}), tmp_path / "data.parquet"
    )
    with pytest.raises(
        InputError, match="row 1, column 'q2_rad': found an empty cell, expected a finite number"
    ):
        read(tmp_path / "data.parquet", rail())


# ---- Suspicions ----------------------------------------------------------------------------------


def scaled(factor: float, *names: str) -> Callable[[Columns], Any]:
    def change(columns: Columns) -> None:
        for name in names:
            columns[name] = np.asarray(columns[name]) * factor

    return change


JOINTS = tuple(f"q{number}_rad" for number in range(1, 7))


def test_degrees_in_columns_of_radians(tmp_path: Path) -> None:
    columns = table(six_axis())
    scaled(180 / math.pi, *JOINTS)(columns)
    with pytest.raises(InputError, match="column 'q1_rad': values from .* look like degrees.*q1_deg"):
        read(write(tmp_path, columns), six_axis())


def test_one_column_of_degrees_is_found_by_its_limits(tmp_path: Path) -> None:
    robot = six_axis(lower=-3.0, upper=3.0)
    columns = table(robot)
    scaled(180 / math.pi, "q4_rad")(columns)
    with pytest.raises(InputError, match="column 'q4_rad': .* look like degrees.*limits are -3 to 3 rad"):
        read(write(tmp_path, columns), robot)


def test_radians_in_columns_of_degrees(tmp_path: Path) -> None:
    columns = table(six_axis())
    for name in JOINTS:
        renamed(name, name.replace("rad", "deg"))(columns)
    with pytest.raises(InputError, match="follow the robot model only if these are radians"):
        read(write(tmp_path, columns), six_axis())


@pytest.mark.parametrize("tool", ["known", "unknown"])
def test_millimetres_in_columns_of_metres_and_back(tmp_path: Path, tool: str) -> None:
    robot = six_axis()
    columns = table(robot)
    if tool == "unknown":
        robot = robot.replace(targets=[_core.Target("tool")])
    metres = ("x_m", "y_m", "z_m")
    too_large = dict(columns)
    scaled(1000.0, *metres)(too_large)
    with pytest.raises(InputError, match="robot reaches no further than .*look like millimetres"):
        read(write(tmp_path, too_large), robot)
    for name in metres:
        renamed(name, name.replace("_m", "_mm"))(columns)
    with pytest.raises(InputError, match=r"at a scale of 0\.001\d*: they look like metres"):
        read(write(tmp_path, columns), robot)


def test_millimetres_in_a_column_of_distances(tmp_path: Path) -> None:
    robot = six_axis()
    columns = table(robot)
    for axis in "xyz":
        columns.pop(f"{axis}_m")
    columns["dist_m"] = np.random.default_rng(6).uniform(300, 900, ROWS)
    with pytest.raises(InputError, match="column 'dist_m': .*look like millimetres"):
        read(write(tmp_path, columns), robot)


@pytest.mark.parametrize(
    ("column", "word"), [("q1_rad", "radians"), ("q3_rad", "radians"), ("q2_deg", "degrees")]
)
def test_one_column_in_another_angle_unit_is_found_by_where_the_robot_was(
    tmp_path: Path, column: str, word: str
) -> None:
    robot = six_axis()
    columns = table(robot)
    if word == "radians":  # called degrees, but radians
        columns = {
            (name.replace("_rad", "_deg") if name == column else name): values
            for name, values in columns.items()
        }
    else:
        columns = {
            name: np.degrees(values) if name == "q2_rad" else values for name, values in columns.items()
        }
    with pytest.raises(InputError, match=f"{column[:2]}.* look like {word}"):
        read(write(tmp_path, columns), robot)


@pytest.mark.parametrize("tool", ["known", "unknown"])
@pytest.mark.parametrize("size", [1e-4, 0.01, 0.05])
def test_small_motions_in_degrees_are_believed(tmp_path: Path, size: float, tool: str) -> None:
    robot = six_axis()
    joints = np.random.default_rng(7).uniform(-size, size, (ROWS, 6))
    columns = table(robot, joints)
    if tool == "unknown":
        robot = robot.replace(targets=[_core.Target("tool")])
    for name in JOINTS:
        scaled(180 / math.pi, name)(columns)
        renamed(name, name.replace("rad", "deg"))(columns)
    read(write(tmp_path, columns), robot)


def test_one_point_touched_from_all_sides_is_believed(tmp_path: Path) -> None:
    """The joints move, the tip hardly does: as in calibrating a tool centre point."""
    robot = six_axis()
    columns = table(robot)
    for name in ("x_m", "y_m", "z_m"):
        columns[name] = np.random.default_rng(8).normal(500, 0.3, ROWS)
        renamed(name, name.replace("_m", "_mm"))(columns)
    read(write(tmp_path, columns), robot)


@pytest.mark.parametrize(
    "change",
    [
        scaled(4.0, *JOINTS),  # up to 6 rad
        scaled(60.0, "q6_rad"),  # a turntable that counts its turns
        lambda columns: columns["x_m"].__setitem__(slice(0, 3), 1e4),  # gross outliers are not a unit
        lambda columns: columns.update(q1_rad=np.zeros(ROWS)),  # a joint that stands still
    ],
)
def test_odd_data_are_believed(tmp_path: Path, change: Callable[[Columns], Any]) -> None:
    columns = table(six_axis())
    change(columns)
    read(write(tmp_path, columns), six_axis())


def test_a_joint_beyond_its_limits_is_a_warning(tmp_path: Path) -> None:
    robot = six_axis(lower=-1.5, upper=1.5)
    columns = table(robot)
    columns["q2_rad"][7] = 1.5009  # within 1e-3
    read(write(tmp_path, columns), robot)
    columns["q2_rad"][7] = 1.6
    with pytest.warns(
        InputWarning,
        match=r"line 9, column 'q2_rad': joint 'J2' is at 1.6 rad, beyond its limits -1.5 to 1.5",
    ) as found:
        read(write(tmp_path, columns), robot)
    assert found[0].filename == __file__


# ---- Recorded data -------------------------------------------------------------------------------


@pytest.mark.realdata
def test_recorded_data_load(tmp_path: Path) -> None:
    """TRUING_REALDATA: a folder of data sets, each with robot*.yaml and measurements*.csv."""
    root = os.environ.get("TRUING_REALDATA")
    if not root:
        pytest.skip("TRUING_REALDATA is not set")
    loaded = 0
    for folder in sorted(Path(root).iterdir()):
        robots = {path: load_robot(path) for path in sorted(folder.glob("robot*.yaml"))}
        for path in sorted(folder.glob("measurements*.csv")):
            side = path.stem.replace("measurements", "robot")
            robot = robots.get(folder / f"{side}.yaml") or robots[sorted(robots)[-1]]
            data = read(path, robot)
            save_measurements(tmp_path / "saved.csv", data, robot)
            again = read(tmp_path / "saved.csv", robot)
            assert np.array_equal(again.joints, data.joints)
            loaded += data.rows
        for path, robot in robots.items():
            (tmp_path / "saved.yaml").write_text(robot_to_yaml(robot))
            assert robot_to_yaml(load_robot(tmp_path / "saved.yaml")) == robot_to_yaml(robot), path
    assert loaded > 0
