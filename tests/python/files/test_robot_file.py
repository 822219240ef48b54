# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot files load or say what is wrong and where; what is saved loads bit for bit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from truing import _core
from truing.errors import InputError
from truing.files import (
    Units,
    atomic_output_dir,
    atomic_write,
    load_calibration,
    load_robot,
    load_units,
    robot_to_yaml,
    save_robot,
    write_table,
)

PALLETIZER = """\
format: truing-robot/1
name: palletizer
units: {length: m, angle: rad, mass: kg}
convention: dh
gravity: [0, 0, -9.81]
base: {xyz: [0.1, -2, 0], rpy: [0, 0, 0.3]}
joints:
  - {name: J1, type: revolute, theta: 0, d: 0.7425, a: 0.26, alpha: -1.5708, beta: 0, limits: [-2.6, 2.6],
     mass: 220, com: [-0.1, 0.1, 0]}
  - \
{name: J2, type: revolute, theta: -1.5708, d: 0, a: 1.15, alpha: 0, beta: 1e-4, ratio: 1.0002, offset: 1e-3}
  - {name: J3, type: revolute, theta: 0, d: 0, a: 1.2, alpha: 0}
  - {name: J4, type: revolute, theta: 0, d: 0, a: 0.22, alpha: 1.5708, driven_by: {J2: -1, J3: -1}}
  - {name: J5, type: prismatic, theta: 0, d: 0.1, a: 0, alpha: 0, limits: [null, 0.5]}
tool: {xyz: [0.15, 0.08, 0.12], rpy: [0, 0, 0]}
targets: {smr2: {xyz: [0, 0.05, 0.12]}}
"""

UR10 = """\
format: truing-robot/1
name: ur10
units: {length: mm, angle: deg, mass: kg}
convention: dh
joints:
  - {name: shoulder_pan, type: revolute, theta: 0, d: 127.3, a: 0, alpha: 90}
  - {name: shoulder_lift, type: revolute, theta: 0, d: 0, a: -612, alpha: 0}
  - {name: elbow, type: revolute, theta: 0, d: 0, a: -572.3, alpha: 0}
  - {name: wrist_1, type: revolute, theta: 0, d: 163.941, a: 0, alpha: 90}
  - {name: wrist_2, type: revolute, theta: 0, d: 115.7, a: 0, alpha: -90}
  - {name: wrist_3, type: revolute, theta: 0, d: 92.2, a: 0, alpha: 0}
tool: {xyz: [0, 0, 109], rpy: [10, 20, -30]}
"""

CHAIN = """\
format: truing-robot/1
name: chain
units: {length: m, angle: rad, mass: kg}
convention: urdf
joints:
  - {name: lift, type: prismatic, xyz: [0, 0, 0.4], axis: [0, 0, 1], limits: [0, 0.8]}
  - {name: elbow, type: revolute, xyz: [0.3, 0, 0], rpy: [1.5708, 0, -0.2], axis: [0, 0.6, 0.8], mass: 2.5, \
com: [0, 0, 0.1]}
tool: {xyz: [0, 0, 0.1]}
anchor: {xyz: [1, 0.5, 0.2], zero: -0.03}
effects:
  - {effect: backlash, joints: [elbow], parameters: {backlash.elbow: 2.1e-4}}
fitted_range: {q1: [0.1, 0.7], q2: [-1.25, 2], payload: [0, 5]}
calibration: {source: tracker.csv, date: 2026-02-03, rms_m: 4.5e-5, covariance: covariance.csv, poses: 50}
"""

DYNAMIC = """\
format: truing-robot/1
units: {length: m, angle: rad, mass: kg}
convention: dh
joints:
  - {name: J1, type: revolute, theta: 0, d: 0.7, a: 0.3, alpha: -1.5708, mass: 220, com: [-0.1, 0.1, 0],
     inertia: [9, 8.5, 7, 0.25, -0.5, 1e-3], torque_per_ampere: -12.5, rotor_inertia: 0.75, speed_limit: 2.1,
     torque_limit: 9000}
  - {name: J2, type: prismatic, theta: 0, d: 0.1, a: 0, alpha: 0, rotor_inertia: 40, speed_limit: 0.7, \
torque_limit: 600.1}
torque_effects:
  - {effect: coulomb, joints: [J1], parameters: {coulomb.J1: 7.25}}
  - {effect: payload, joints: [], parameters: {payload.m: 2.5, payload.mx: 0, payload.my: 0, payload.mz: 0.1}}
"""

URDF = """\
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="hand"/>
  <joint name="j1" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="j2" type="revolute">
    <parent link="upper"/><child link="hand"/><origin xyz="0.2 0 0" rpy="1.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""


def write(folder: Path, text: str | bytes, name: str = "robot.yaml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def load(folder: Path, text: str | bytes) -> _core.Robot:
    return load_robot(write(folder, text))


def bits(values: Any) -> bytes:
    return (
        np.asarray(values, dtype=float) + 0.0
    ).tobytes()  # +0.0: the sign of a zero inside a rotation is no matter


def assert_same(found: _core.Robot, expected: _core.Robot) -> None:
    assert (found.name, found.convention) == (expected.name, expected.convention)
    assert bits(found.gravity) == bits(expected.gravity)
    assert bits(found.T_measurement_base) == bits(expected.T_measurement_base)
    assert len(found.joints) == len(expected.joints)
    for a, b in zip(found.joints, expected.joints, strict=True):
        assert (a.name, a.type, a.mass, list(a.driven_by)) == (b.name, b.type, b.mass, list(b.driven_by))
        assert (a.torque_per_ampere, a.torque_limit) == (b.torque_per_ampere, b.torque_limit)
        assert (a.inertia is None) == (b.inertia is None)
        if a.inertia is not None and b.inertia is not None:
            assert bits(a.inertia) == bits(b.inertia)
        for field in (
            *("theta", "d", "a", "alpha", "beta", "ratio", "offset", "lower", "upper"),
            *("rotor_inertia", "speed_limit"),
        ):
            assert np.float64(getattr(a, field)).tobytes() == np.float64(getattr(b, field)).tobytes(), (
                a.name,
                field,
            )
        for field in ("T_parent_joint", "axis", "center_of_mass"):
            assert bits(getattr(a, field)) == bits(getattr(b, field)), (a.name, field)
    assert [target.name for target in found.targets] == [target.name for target in expected.targets]
    for c, d in zip(found.targets, expected.targets, strict=True):
        assert bits(c.T_last_target) == bits(d.T_last_target)
    for found_list, expected_list in (
        (found.effects, expected.effects),
        (found.torque_effects, expected.torque_effects),
    ):
        assert [(e.effect, list(e.joints), dict(e.parameters)) for e in found_list] == [
            (e.effect, list(e.joints), dict(e.parameters)) for e in expected_list
        ]
    assert dict(found.fitted_range) == dict(expected.fitted_range)
    assert (found.anchor is None) == (expected.anchor is None)
    if found.anchor is not None and expected.anchor is not None:
        assert bits(found.anchor.point) == bits(expected.anchor.point)
        assert found.anchor.zero == expected.anchor.zero


# ---- What is read --------------------------------------------------------------------------------


def test_every_key_arrives_in_si(tmp_path: Path) -> None:
    robot = load(tmp_path, PALLETIZER)
    assert (robot.name, robot.convention, robot.driven_count) == ("palletizer", "dh", 4)
    first, second, _, fourth, rail = robot.joints
    assert (first.d, first.a, first.alpha, first.lower, first.upper, first.mass) == (
        0.7425,
        0.26,
        -1.5708,
        -2.6,
        2.6,
        220.0,
    )
    assert list(first.center_of_mass) == [-0.1, 0.1, 0.0]
    assert (second.beta, second.ratio, second.offset) == (1e-4, 1.0002, 1e-3)
    assert list(fourth.driven_by) == [("J2", -1.0), ("J3", -1.0)]
    assert (rail.type, rail.lower, rail.upper) == ("prismatic", -math.inf, 0.5)
    assert [target.name for target in robot.targets] == ["tool", "smr2"]
    np.testing.assert_allclose(
        robot.T_measurement_base[:2, 0], [math.cos(0.3), math.sin(0.3)], rtol=0, atol=1e-15
    )


def test_what_drives_and_what_is_driven_arrives(tmp_path: Path) -> None:
    robot = load(tmp_path, DYNAMIC)
    first, rail = robot.joints
    assert np.array_equal(first.inertia, [[9, 0.25, -0.5], [0.25, 8.5, 1e-3], [-0.5, 1e-3, 7]])
    assert (first.torque_per_ampere, first.rotor_inertia) == (-12.5, 0.75)
    assert (first.speed_limit, first.torque_limit) == (2.1, 9000)
    assert rail.inertia is None and rail.torque_per_ampere is None
    assert [(e.effect, list(e.joints), dict(e.parameters)) for e in robot.torque_effects] == [
        ("coulomb", ["J1"], {"coulomb.J1": 7.25}),
        ("payload", [], {"payload.m": 2.5, "payload.mx": 0.0, "payload.my": 0.0, "payload.mz": 0.1}),
    ]
    still = load(tmp_path, PALLETIZER).joints[0]
    assert (still.rotor_inertia, still.speed_limit, still.torque_limit) == (0, math.inf, math.inf)


def test_speeds_are_in_the_files_units(tmp_path: Path) -> None:
    text = DYNAMIC.replace("length: m, angle: rad", "length: mm, angle: deg")
    text = text.replace("-1.5708", "-90").replace("d: 0.7", "d: 700").replace("a: 0.3", "a: 300")
    first, rail = load(tmp_path, text.replace("d: 0.1", "d: 100")).joints
    assert first.speed_limit == pytest.approx(math.radians(2.1), rel=1e-15)
    assert rail.speed_limit == 0.7e-3
    assert (first.torque_limit, first.inertia[0, 0]) == (9000, 9)


def test_millimetres_and_degrees_are_converted_to_the_nearest_double(tmp_path: Path) -> None:
    robot = load(tmp_path, UR10)
    assert robot.joints[0].d == 0.1273
    assert robot.joints[0].alpha == math.pi / 2
    assert robot.targets[0].T_last_target[2, 3] == 0.109
    assert list(robot.gravity) == [0.0, 0.0, -9.81]
    assert load_units(tmp_path / "robot.yaml") == Units("mm", "deg")


def test_rpy_is_yaw_after_pitch_after_roll(tmp_path: Path) -> None:
    R = load(tmp_path, UR10).targets[0].T_last_target[:3, :3]
    roll, pitch, yaw = np.radians([10.0, 20.0, -30.0])
    Rx = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    Ry = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    Rz = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    np.testing.assert_allclose(R, Rz @ Ry @ Rx, rtol=0, atol=1e-15)


def test_chain_anchor_effects_and_calibration(tmp_path: Path) -> None:
    robot = load(tmp_path, CHAIN)
    lift, elbow = robot.joints
    assert (robot.convention, lift.type, elbow.mass) == ("urdf", "prismatic", 2.5)
    assert list(elbow.axis) == [0.0, 0.6, 0.8]
    assert list(elbow.T_parent_joint[:3, 3]) == [0.3, 0.0, 0.0]
    assert robot.anchor is not None
    assert (list(robot.anchor.point), robot.anchor.zero) == ([1.0, 0.5, 0.2], -0.03)
    (effect,) = robot.effects
    assert (effect.effect, list(effect.joints), dict(effect.parameters)) == (
        "backlash",
        ["elbow"],
        {"backlash.elbow": 2.1e-4},
    )
    assert dict(robot.fitted_range) == {"q1": (0.1, 0.7), "q2": (-1.25, 2.0), "payload": (0.0, 5.0)}
    calibration = load_calibration(tmp_path / "robot.yaml")
    assert calibration == {
        "source": "tracker.csv",
        "date": "2026-02-03",
        "rms_m": 4.5e-5,
        "covariance": "covariance.csv",
        "poses": 50,
    }


def test_urdf_is_a_robot_file(tmp_path: Path) -> None:
    robot = load_robot(write(tmp_path, URDF, "arm.urdf"), "base", "hand")
    assert (robot.convention, [joint.name for joint in robot.joints]) == ("urdf", ["j1", "j2"])
    save_robot(tmp_path / "robot.yaml", robot)
    assert_same(load_robot(tmp_path / "robot.yaml"), robot)


def test_who_wants_no_tool_need_not_name_the_tip(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    fixed = '<link name="LINK"/><joint name="J" type="fixed"><parent link="b"/><child link="LINK"/></joint>'
    path.write_text(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/>'
        '<child link="b"/></joint>'
        + fixed.replace("LINK", "tool0").replace('"J"', '"f"')
        + fixed.replace("LINK", "flange").replace('"J"', '"g"')
        + "</robot>"
    )
    with pytest.raises(InputError, match="has 2 ends, flange, tool0"):
        load_robot(path)
    robot = load_robot(path, any_tool=True)
    assert [joint.name for joint in robot.joints] == ["j"]
    assert np.array_equal(robot.targets[0].T_last_target, np.eye(4))
    with pytest.raises(InputError, match="arm.urdf: nothing moves below base link 'b'"):
        load_robot(path, "b", any_tool=True)


def test_bom_and_windows_line_ends_do_not_matter(tmp_path: Path) -> None:
    plain = load(tmp_path, PALLETIZER)
    assert_same(load(tmp_path, b"\xef\xbb\xbf" + PALLETIZER.replace("\n", "\r\n").encode()), plain)


def test_numbers_may_have_an_exponent_without_a_point(tmp_path: Path) -> None:
    assert load(tmp_path, PALLETIZER.replace("a: 0.26", "a: 26e-2")).joints[0].a == 0.26


# ---- What is written -----------------------------------------------------------------------------


@pytest.mark.parametrize("text", [PALLETIZER, UR10, CHAIN, DYNAMIC])
@pytest.mark.parametrize(
    "units", [Units("m", "rad"), Units("mm", "deg"), Units("mm", "rad"), Units("m", "deg")]
)
def test_saved_robot_loads_bit_for_bit(tmp_path: Path, text: str, units: Units) -> None:
    robot = load(tmp_path, text)
    save_robot(tmp_path / "saved.yaml", robot, units=units)
    assert_same(load_robot(tmp_path / "saved.yaml"), robot)
    assert load_units(tmp_path / "saved.yaml") == units


def symmetric(A: np.ndarray) -> np.ndarray:
    return np.asarray(np.triu(A) + np.triu(A, 1).T)


@pytest.mark.parametrize("units", [Units("m", "rad"), Units("mm", "deg")])
def test_arbitrary_doubles_survive_in_any_unit(tmp_path: Path, units: Units) -> None:
    random = np.random.default_rng(seed=1)
    for _ in range(20):
        joints = []
        for number in range(6):
            theta, d, a, alpha, offset = random.uniform(-1.5, 1.5, 5) * 10.0 ** random.integers(-9, 1, 5)
            joints.append(
                _core.Joint(
                    f"J{number}",
                    theta=theta,
                    d=d,
                    a=a,
                    alpha=alpha,
                    offset=offset,
                    ratio=random.normal(1, 1e-3),
                    lower=-random.uniform(1, 3),
                    upper=random.uniform(1, 3),
                    inertia=symmetric(random.normal(size=(3, 3)) * 10.0 ** random.integers(-9, 3)),
                    torque_per_ampere=random.normal(),
                    rotor_inertia=random.uniform(0, 1e-3),
                    speed_limit=random.uniform(1, 9),
                    torque_limit=random.uniform(1, 900),
                )
            )
        joints[0].a = random.uniform(0.5, 1.0)
        friction = _core.AppliedEffect("coulomb", ["J1"], {"coulomb.J1": random.normal()})
        robot = _core.Robot("random", joints=joints, gravity=random.normal(size=3), torque_effects=[friction])
        save_robot(tmp_path / "saved.yaml", robot, units=units)
        assert_same(load_robot(tmp_path / "saved.yaml"), robot)


def test_any_rotation_survives_to_the_last_digits(tmp_path: Path) -> None:
    random = np.random.default_rng(seed=2)
    angles = [random.uniform(-math.pi, math.pi, 3) for _ in range(50)]
    angles += [
        np.array([a, p, b])
        for p in (math.pi / 2, -math.pi / 2, math.pi / 2 - 1e-9)
        for a, b in random.uniform(-3, 3, (5, 2))
    ]
    for rpy in angles:
        first = _core.frame_from_xyz_rpy([0.1, 0.2, 0.3], rpy)
        # A product of rotations is what a fit comes to: no three angles make just these nine numbers.
        T = first @ _core.frame_from_xyz_rpy([0.0, 0.0, 0.0], [1e-3, 2e-3, -1e-3])
        robot = _core.Robot("r", joints=[_core.Joint("J1", d=0.5)], targets=[_core.Target("tool", T)])
        save_robot(tmp_path / "saved.yaml", robot)
        again = load_robot(tmp_path / "saved.yaml")
        np.testing.assert_allclose(again.targets[0].T_last_target, T, rtol=0, atol=1e-15)


def test_calibration_is_kept(tmp_path: Path) -> None:
    calibration = {
        "source": 'C:\\data\\new "set".csv',
        "date": "2026-02-03",
        "rms_m": 1e-5,
        "n": 50,
        "1e-3": True,
        "nested": {"list": [1, 2.5, "yes", None], "numpy": np.float64(0.1)},
    }
    save_robot(tmp_path / "saved.yaml", load(tmp_path, UR10), calibration=calibration)
    assert load_calibration(tmp_path / "saved.yaml") == calibration


def test_odd_names_survive(tmp_path: Path) -> None:
    names = [
        "no",
        "1.5",
        "a: b",
        "Gelenk äöü",
        "#1",
        "tab\there",
        "line\nbreak",
        "{x}",
        "null",
        '"',
        "\\",
        "\x85",
        "😀",
    ]
    robot = _core.Robot("true", joints=[_core.Joint(name, a=0.1) for name in names])
    save_robot(tmp_path / "saved.yaml", robot)
    assert_same(load_robot(tmp_path / "saved.yaml"), robot)


def test_few_digits_stay_few(tmp_path: Path) -> None:
    text = robot_to_yaml(load(tmp_path, UR10), units=Units("mm", "deg"))
    for line in UR10.splitlines()[5:]:
        assert line in text


@pytest.mark.parametrize(
    ("robot", "why"),
    [
        (_core.Robot("r", joints=[]), "has no joints"),
        (_core.Robot("r", joints=[_core.Joint("J1", a=math.nan)]), "finite"),
        (
            _core.Robot("r", joints=[_core.Joint("J1")], targets=[_core.Target("flange")]),
            "must be called 'tool'",
        ),
    ],
)
def test_an_unsound_robot_is_not_written(tmp_path: Path, robot: _core.Robot, why: str) -> None:
    with pytest.raises(InputError, match=why):
        save_robot(tmp_path / "saved.yaml", robot)
    assert list(tmp_path.iterdir()) == []


# ---- What is refused -----------------------------------------------------------------------------

WRONG: dict[str, tuple[str, str, str]] = {
    # name: (text in PALLETIZER, what it becomes, what the error says)
    "unknown key": (
        "beta: 0,",
        "betta: 0,",
        r"line 8: joints\[0\] \(J1\) betta: unknown key; did you mean 'beta'\?",
    ),
    "unknown key at the top": (
        "gravity:",
        "gravty:",
        r"line 5: gravty: unknown key; did you mean 'gravity'\?",
    ),
    "missing key": ("a: 1.15, ", "", r"line 10: joints\[1\] \(J2\): key 'a' is missing"),
    "missing units": ("units: {length: m, angle: rad, mass: kg}\n", "", "key 'units' is missing"),
    "missing unit": ("length: m, ", "", "line 3: units: key 'length' is missing"),
    "unknown unit": ("length: m,", "length: cm,", "line 3: units length: found 'cm', expected one of m, mm"),
    "duplicate key": (
        "a: 1.15,",
        "a: 1.15, a: 1.2,",
        r"line 10: key 'a' is there twice \(first in line 10\)",
    ),
    "duplicate key at the top": (
        "tool:",
        "name: two\ntool:",
        r"line 14: key 'name' is there twice \(first in line 2\)",
    ),
    "duplicate joint": (
        "name: J3",
        "name: J2",
        r"line 11: .*the name 'J2' is there twice \(first in line 10\)",
    ),
    "target called like a joint": ("smr2:", "J1:", "line 15: targets J1: the name 'J1' is there twice"),
    "target called tool": ("smr2:", "tool:", "line 15: targets tool: the name 'tool' is there twice"),
    "kept name": ("name: J3", "name: base", "line 11: .*'base' is kept for parameters"),
    "unknown driver": (
        "{J2: -1, J3: -1}",
        "{J2: -1, J9: -1}",
        "line 12: .*J9: there is no such joint; the joints are J1, J2",
    ),
    "own driver": ("{J2: -1, J3: -1}", "{J4: -1}", r"line 12: .*circle \(J4 -> J4\)"),
    "circle": (
        "a: 1.2, alpha: 0}",
        "a: 1.2, alpha: 0, driven_by: {J4: 1}}",
        r"line 11: .*circle \(J3 -> J4 -> J3\)",
    ),
    "no driver": ("{J2: -1, J3: -1}", "{}", "line 12: .*driven_by: is empty"),
    "ratio of a passive joint": (
        "driven_by:",
        "ratio: 1.1, driven_by:",
        "line 12: .*passive joint has no reading",
    ),
    "NaN": ("a: 1.15", "a: .nan", r"line 10: joints\[1\] \(J2\) a: found NaN, expected a finite number"),
    "infinity": ("a: 1.15", "a: .inf", "line 10: .*found Infinity, expected a finite number"),
    "too large": ("a: 1.15", "a: 1e999", "line 10: .*found Infinity, expected a finite number"),
    "text for a number": ("a: 1.15", "a: long", r"line 10: .* a: found 'long', expected a finite number"),
    "quoted number": ("a: 1.15", "a: '1.15'", r"line 10: .* a: found '1.15', expected a finite number"),
    "decimal comma": ("d: 0.7425", "d: 0,7425", "line 8: .*unknown key"),
    "nothing": ("a: 1.15", "a:", "line 10: .*found nothing, expected a finite number"),
    "short list": (
        "[0, 0, -9.81]",
        "[0, -9.81]",
        "line 5: gravity: found a list of 2, expected a list of 3 numbers",
    ),
    "long list": ("[0.15, 0.08, 0.12]", "[0.15, 0.08, 0.12, 1]", "line 14: tool xyz: found a list of 4"),
    "limits": ("[-2.6, 2.6]", "[2.6, -2.6]", r"line 8: .*limits: .*\[lower, upper\]"),
    "no list": ("[-2.6, 2.6]", "2.6", r"line 8: .*limits: found 2.6, expected a list of 2 numbers"),
    "unknown type": (
        "type: prismatic",
        "type: linear",
        "line 13: .*type: found 'linear', expected one of revolute, prismatic",
    ),
    "unknown convention": (
        "convention: dh",
        "convention: DH",
        "line 4: convention: found 'DH', expected one of dh, mdh, urdf",
    ),
    "keys of another convention": ("convention: dh", "convention: urdf", "line 8: .*theta: unknown key"),
    "wrong format": (
        "truing-robot/1",
        "truing-camera/1",
        "line 1: format: found 'truing-camera/1', expected 'truing-robot/1'",
    ),
    "no format": ("format: truing-robot/1\n", "", "key 'format' is missing"),
    "mass below zero": ("mass: 220", "mass: -220", "line 9: .*mass: found -220, expected zero or more"),
    "number as a name": ("name: J3", "name: 3", "line 11: .*name: found 3, expected a name .*quotes"),
    "joints no list": ("joints:\n", "joints: 5\nx:\n", "unknown key|expected a list"),
    "tag": ("a: 1.15", "a: !!python/object:os.system 1", "line 10: found the YAML tag"),
    "half a character": ("name: J3", 'name: "\\ud800"', "line 11: found half a character"),
    "key twice": ("name: J3", "name: J3, name: J4", "^[^ ]+, line 11: key 'name' is there twice"),
    "number in quotes": (
        "mass: 220",
        'mass: "220"',
        "found '220', expected a finite number, without quotation",
    ),
    "comma within a mapping": (
        "mass: 220",
        "mass: 220,5",
        "5: unknown key; a comma as decimal mark in what is before it",
    ),
    "not YAML": ("[-2.6, 2.6]", "[-2.6, 2.6", "line .*is not YAML"),
    "tab": ("  - {name: J3", "\t- {name: J3", "line 11.*is not YAML"),
    # Suspicions: right in form, but the unit cannot be meant.
    "degrees as rad": (
        "alpha: -1.5708",
        "alpha: -90",
        r"line 8: .*alpha: -90 looks like degrees.*angle: rad",
    ),
    "degrees as limits": ("[-2.6, 2.6]", "[-150, 150]", "line 8: .*limits: -150 looks like degrees"),
    "degrees as rpy": ("rpy: [0, 0, 0.3]", "rpy: [0, 0, 90]", "line 6: base rpy: 90 looks like degrees"),
    "millimetres as m": ("a: 1.15", "a: 1150", "line 10: .*a: 1150 looks like millimetres.*length: m"),
    "millimetres as tool": (
        "[0.15, 0.08, 0.12]",
        "[150, 80, 120]",
        "line 14: tool xyz: 150 looks like millimetres",
    ),
    "metres as mm": ("length: m,", "length: mm,", "line 3: .*looks like metres"),
    "radians as deg": ("angle: rad", "angle: deg", "line 8: .*alpha: -1.5708 looks like radians"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, case: str) -> None:
    old, new, message = WRONG[case]
    assert old in PALLETIZER
    with pytest.raises(InputError, match=message) as error:
        load(tmp_path, PALLETIZER.replace(old, new, 1))
    assert "robot.yaml" in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[9, 8.5, 7, 0.25, -0.5, 1e-3]",
            "[9, 8.5, 7]",
            r"line 6: joints\[0\] \(J1\) inertia: found a list of 3, expected a list of 6 numbers, \[ixx",
        ),
        ("[9, 8.5", "[.nan, 8.5", "line 6: .*inertia: found NaN, expected a finite number"),
        ("[9, 8.5", "[heavy, 8.5", "line 6: .*inertia: found 'heavy', expected a finite number"),
        ("-12.5", "0", "line 6: .*torque_per_ampere: found 0, expected Nm/A"),
        ("-12.5", ".inf", "line 6: .*torque_per_ampere: found Infinity"),
        (
            "rotor_inertia: 0.75",
            "rotor_inertia: -1",
            "line 6: .*rotor_inertia: found -1, expected zero or more",
        ),
        ("speed_limit: 2.1", "speed_limit: 0", "line 6: .*speed_limit: found 0, expected more than zero"),
        (
            "torque_limit: 9000",
            "torque_limit: -3",
            "line 7: .*torque_limit: found -3, expected more than zero",
        ),
        ("torque_limit: 9000", "torque_limits: 3", "line 7: .*unknown key; did you mean 'torque_limit'"),
        (
            "joints: [J1]",
            "joints: [J3]",
            r"line 10: torque_effects\[0\] \(coulomb\) joints\[0\]: there is no joint 'J3'",
        ),
        ("coulomb.J1: 7.25", "coulomb.J1: .nan", "line 10: .*found NaN"),
        ("effect: coulomb, ", "", "line 10: .*key 'effect' is missing"),
    ],
)
def test_what_is_wrong_with_drives_is_named_with_its_line(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in DYNAMIC
    with pytest.raises(InputError, match=message):
        load(tmp_path, DYNAMIC.replace(old, new, 1))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n# nothing here\n", "is empty"),
        (b"\x7fELF\x02\x01\x00\x00\x00", "binary file"),
        (b"\xff\xfef\x00o\x00r\x00", "UTF-16"),
        (b"name: caf\xe9\n", "line 1: byte 0xe9 is not UTF-8"),
        (b"<robot name='arm'/>", "is XML, expected a robot file: the name of a URDF ends in .urdf"),
        (b"just text", "line 1: found 'just text', expected a robot file"),
        (b"- 1\n- 2\n", "line 1: found a list of 2, expected a robot file"),
        (b"a: 1\n---\nb: 2\n", "is not YAML"),
        (b"a: &x [1]\nb: *x\n", "line 1: YAML anchors and aliases"),
        (b"a: &x [*x]\n", "line 1: YAML anchors and aliases"),
        (b"[" * 5_000, "robot.yaml"),
        (b'a: "\\UFFFFFFFF"', "is not YAML"),
        (b"? [1, 2]\n: 3\n", "line 1: found a list or mapping as a key"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(tmp_path, content)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.yaml: cannot be read: No such file"):
        load_robot(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="cannot be read"):
        load_robot(tmp_path)
    with pytest.raises(InputError, match="not one"):
        load_robot(write(tmp_path, UR10), base_link="base")


@pytest.mark.parametrize(
    "content", [b"", b"<robot", b"not xml", b"\x00\x01", URDF.replace("hand", "other", 1).encode()]
)
def test_urdf_that_is_none_is_refused(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(InputError, match=r"arm\.urdf"):
        load_robot(write(tmp_path, content, "arm.urdf"))


@pytest.mark.parametrize("axis", ["[0, 0, 0]", "[1, 1, 0]"])
def test_axis_must_be_a_unit_vector(tmp_path: Path, axis: str) -> None:
    with pytest.raises(InputError, match=r"line 6: joints\[0\] \(lift\) axis: has length"):
        load(tmp_path, CHAIN.replace("[0, 0, 1]", axis))


def test_effect_at_an_unknown_joint_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"line 11: effects\[0\] \(backlash\) joints\[0\]: there is no joint 'wrist'"
    ):
        load(tmp_path, CHAIN.replace("joints: [elbow]", "joints: [wrist]"))


@pytest.mark.parametrize(
    "text",
    [
        PALLETIZER.replace("[-2.6, 2.6]", "[-6.3, 6.3]"),
        PALLETIZER.replace("theta: -1.5708", "theta: 6.28"),
        UR10.replace("alpha: 90", "alpha: 89.98").replace("alpha: -90", "alpha: 0.0021"),
        UR10.replace("alpha: 90", "alpha: 0").replace("alpha: -90", "alpha: 0"),
    ],
)
def test_suspicion_does_not_fall_on_the_innocent(tmp_path: Path, text: str) -> None:
    load(tmp_path, text)


# ---- Output that is whole or not there -----------------------------------------------------------


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = write(tmp_path, "old", "result.json")
    with pytest.raises(KeyboardInterrupt), atomic_write(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]


@pytest.mark.parametrize("there_already", [False, True])
def test_an_interrupted_command_leaves_nothing(tmp_path: Path, there_already: bool) -> None:
    out = tmp_path / "deep" / "out"
    if there_already:
        out.mkdir(parents=True)
        (out / "other.txt").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(KeyboardInterrupt), atomic_output_dir(out) as temporary:
        (temporary / "result.json").write_text("{}")
        raise KeyboardInterrupt
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("there_already", [False, True])
def test_a_command_that_ends_well_leaves_all_its_files(tmp_path: Path, there_already: bool) -> None:
    out = tmp_path / "deep" / "out"
    if there_already:
        out.mkdir(parents=True)
        (out / "other.txt").write_text("mine")
        (out / "result.json").write_text("old")
    with atomic_output_dir(out) as temporary:
        (temporary / "result.json").write_text("{}")
        (temporary / "plots").mkdir()
        (temporary / "plots" / "a.txt").write_text("a")
    assert (out / "result.json").read_text() == "{}"
    assert (out / "plots" / "a.txt").read_text() == "a"
    assert (out / "other.txt").exists() == there_already
    assert not list(tmp_path.rglob(".truing*"))


def test_output_that_cannot_be_written_is_an_input_error(tmp_path: Path) -> None:
    file = write(tmp_path, "x", "file")
    with pytest.raises(InputError, match="is a file, expected a folder"), atomic_output_dir(file):
        pass
    with pytest.raises(InputError, match="is a folder"), atomic_write(tmp_path):
        pass
    with pytest.raises(InputError, match="cannot be written"), atomic_write(tmp_path / "none" / "x.csv"):
        pass
    with pytest.raises(InputError, match="cannot be written"), atomic_output_dir(file / "below"):
        pass


def test_tables_keep_every_bit_and_leave_gaps_empty(tmp_path: Path) -> None:
    values = np.array([0.1, 1e-300, -np.pi, np.nan])
    write_table(tmp_path / "t.csv", {"x": values, "n": [1, 2, 3, 4], "name": ["a", "b,c", None, 'd"e']})
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[0] == "x,n,name"
    assert [float(line.split(",")[0]) for line in lines[1:4]] == list(values[:3])
    assert lines[4].startswith(",4,")
    write_table(tmp_path / "plain.csv", {"name": ["a", None]})
    assert (tmp_path / "plain.csv").read_text().splitlines()[:2] == ["name", "a"]
    with pytest.raises(ValueError, match="different lengths"):
        write_table(tmp_path / "bad.csv", {"x": [1.0], "y": [1.0, 2.0]})


@pytest.mark.parametrize("name", ["arm.urdf.xacro", "arm.urdf"])
def test_a_xacro_is_refused_with_how_it_becomes_a_urdf(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text('<robot name="a"><xacro:include filename="b.xacro"/></robot>', encoding="utf-8")
    with pytest.raises(InputError, match=f"is a xacro, expected a URDF: `xacro {name} > robot.urdf`"):
        load_robot(path)


def test_what_xacro_wrote_may_quote_its_source(tmp_path: Path) -> None:
    quoted = '<link name="hand"/>\n<!-- <xacro:gripper\n parent="hand"/> --><!-- written by xacro -->'
    robot = load_robot(write(tmp_path, URDF.replace('<link name="hand"/>', quoted), "arm.urdf"))
    assert [joint.name for joint in robot.joints] == ["j1", "j2"]
