# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Whatever is in a file, reading it gives a sound object or InputError: no other exception, no crash, no
half-read data.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from fuzzing import mutated, quick
from truing import _core
from truing.errors import InputError
from truing.files import (
    Units,
    load_calibration,
    load_measurements,
    load_robot,
    load_units,
    save_measurements,
    save_robot,
)

ROBOT = b"""\
format: truing-robot/1
name: arm
units: {length: mm, angle: deg, mass: kg}
convention: dh
gravity: [0, 0, -9.81]
base: {xyz: [1, 2, 3], rpy: [0, 0, 30]}
joints:
  - \
{name: J1, type: revolute, theta: 0, d: 290, a: 0, alpha: -90, limits: [-165, 165], mass: 5, com: [0, 0, 1]}
  - {name: J2, type: revolute, theta: -90, d: 0, a: 270, alpha: 0, beta: 0.1, ratio: 1.001, offset: 0.2}
  - {name: P, type: revolute, theta: 0, d: 0, a: 70, alpha: -90, driven_by: {J2: -1}}
  - {name: S, type: prismatic, theta: 0, d: 302, a: 0, alpha: 90}
tool: {xyz: [0, 0, 109], rpy: [10, 20, -30]}
targets: {smr2: {xyz: [0, 50, 120]}}
anchor: {xyz: [100, 0, 0], zero: 3}
effects:
  - {effect: backlash, joints: [J2], parameters: {backlash.J2: 1e-4}}
calibration: {date: 2026-02-03, rms_m: 4e-5}
"""

CHAIN = b"""\
format: truing-robot/1
units: {length: m, angle: rad, mass: kg}
convention: urdf
joints:
  - {name: a, type: revolute, xyz: [0, 0, 0.3], rpy: [1.5, 0, 0.1], axis: [0, 0, 1]}
  - {name: b, type: prismatic, xyz: [0.2, 0, 0], axis: [0, 0.6, 0.8]}
"""

URDF = b"""\
<robot name="arm"><link name="base"/><link name="upper"/><link name="hand"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="j2" type="prismatic"><parent link="upper"/><child link="hand"/><origin xyz="0.2 0 0" rpy="1.5 0 \
0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="j1" \
multiplier="0.5"/></joint></robot>
"""

MODEL = _core.Robot(
    "fuzzed",
    joints=[
        _core.Joint("J1", d=0.3, a=0.1, alpha=1.5, lower=-3.0, upper=3.0),
        _core.Joint("S", type="prismatic", a=0.4),
    ],
    targets=[_core.Target("tool"), _core.Target("p1")],
)

CSV = b"""\
pose,q1_rad,q2_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,dist_m,fixed_point,dir1,dir2,payload_kg,temp_C,t_s,target,sigma_mm,weight,qd1_rad_s,u1_deg,other,set
1,0.1,100,10,20,30,1,0,0,0,,,1,0,2.5,20,0,p1,0.1,1,0.1,5,1,train
1,0.1,100,11,21,31,,,,,,,1,-1,2.5,20.5,1,,0.1,0.5,0.2,6,nan,train
2,-0.4,150.5,,,,,,,,0.5,,0,1,2.5,21,2.5,tool,0.2,1,0.3,7,,test
3,1.2,-50,,,,,,,,,cone,-1,0,0,22,3,,0.1,1,0.4,8,4e3,test
"""


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def check_robot(folder: Path, data: bytes, name: str = "robot.yaml") -> None:
    path = folder / name
    path.write_bytes(data)
    try:
        robot = load_robot(path)
    except InputError as error:
        assert name in str(error)
        assert "\n" not in str(error)
        return
    _core.validate_robot(robot)
    load_units(path)
    load_calibration(path)
    for units in (Units(), Units("mm", "deg")):
        try:
            save_robot(folder / "saved.yaml", robot, units=units)
            again = load_robot(folder / "saved.yaml")
        except InputError as error:
            # The units of a robot that is odd enough look wrong in another unit.
            assert "looks like" in str(error) or "called 'tool'" in str(error)
            continue
        assert [joint.name for joint in again.joints] == [joint.name for joint in robot.joints]
        assert [joint.d for joint in again.joints] == [joint.d for joint in robot.joints]


def check_measurements(folder: Path, data: bytes, name: str = "data.csv") -> None:
    path = folder / name
    path.write_bytes(data)
    for joints_only in (False, True):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                read = load_measurements(path, MODEL, joints_only=joints_only)
            except InputError as error:
                assert name in str(error)
                assert "\n" not in str(error)
                continue
            assert read.rows > 0
            assert np.isfinite(read.joints).all()
            _core.validate_measurements(read, MODEL, joints_only)
            save_measurements(folder / "saved.csv", read, MODEL)
            again = load_measurements(folder / "saved.csv", MODEL, joints_only=joints_only)
            assert np.array_equal(again.joints, read.joints)


@quick
@given(data=st.binary(max_size=300))
def test_robot_of_any_bytes(folder: Path, data: bytes) -> None:
    check_robot(folder, data)


@quick
@given(text=st.text(alphabet="ab:{}[]-,#&*!|>'\"%@`? \n\t019.~", max_size=80))
def test_robot_of_any_yaml(folder: Path, text: str) -> None:
    check_robot(folder, text.encode())
    check_robot(folder, b"format: truing-robot/1\n" + text.encode())


@quick
@given(data=mutated(ROBOT))
@example(data=ROBOT)
def test_robot_with_faults(folder: Path, data: bytes) -> None:
    check_robot(folder, data)


@quick
@given(data=mutated(CHAIN))
@example(data=CHAIN)
def test_chain_with_faults(folder: Path, data: bytes) -> None:
    check_robot(folder, data)


@quick
@given(data=st.one_of(mutated(URDF), st.binary(max_size=100)))
@example(data=URDF)
def test_urdf_with_faults(folder: Path, data: bytes) -> None:
    check_robot(folder, data, "arm.urdf")


@quick
@given(data=st.binary(max_size=300))
def test_measurements_of_any_bytes(folder: Path, data: bytes) -> None:
    check_measurements(folder, data)


@quick
@given(text=st.text(alphabet='0123456789.,-+e"\n\r na', max_size=120))
def test_measurements_of_any_cells(folder: Path, text: str) -> None:
    check_measurements(folder, b"q1_rad,q2_m,x_m,y_m,z_m\n" + text.encode())


@quick
@given(data=mutated(CSV))
@example(data=CSV)
def test_measurements_with_faults(folder: Path, data: bytes) -> None:
    check_measurements(folder, data)


@pytest.fixture(scope="module")
def parquet(folder: Path) -> bytes:
    (folder / "plain.csv").write_bytes(CSV)
    save_measurements(folder / "plain.parquet", load_measurements(folder / "plain.csv", MODEL), MODEL)
    return (folder / "plain.parquet").read_bytes()


@quick
@given(cut=st.integers(0, 4000), damage=st.binary(min_size=1, max_size=8))
def test_damaged_parquet(folder: Path, parquet: bytes, cut: int, damage: bytes) -> None:
    cut %= len(parquet)
    check_measurements(folder, parquet[:cut], "data.parquet")
    check_measurements(folder, parquet[:cut] + damage + parquet[cut + len(damage) :], "data.parquet")
