# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files of controllers: what they say comes out as a robot, and what they do not say is said."""

from __future__ import annotations

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

import truing
from controller_files import LIMITS, MOTORS, UR5, UR10, conf, kinematics, moc, small_urdf, urp
from truing.files import ARMS, load_calibration, load_controller, load_robot, save_robot
from truing.files.lerobot_calibration import load_lerobot_calibration


def written(folder: Path, text: str | bytes, name: str = "calibration.conf") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def long_way(arm: str, values: dict[str, str], q: np.ndarray) -> np.ndarray:
    """The chain as the controller multiplies it, with 64 bits of mantissa."""
    L = np.longdouble
    T = np.eye(4, dtype=L)
    pi = L(math.pi) + L(1.2246467991473532e-16)  # to 34 digits
    for k, row in enumerate(ARMS[arm].rows):
        alpha = L(round(row.alpha / (math.pi / 2))) * pi / 2 + L(values["alpha"].split()[k])
        theta = L(q[k]) + L(values["theta"].split()[k])
        a, d = (L(repr(getattr(row, key))) + L(values[key].split()[k]) for key in ("a", "d"))
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        link = [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        T = T @ np.array(link, dtype=L)
    return T


@pytest.mark.parametrize(("arm", "values"), [("ur5", UR5), ("ur10", UR10)])
def test_the_product_of_a_factory_calibration_is_exact(
    tmp_path: Path, arm: str, values: dict[str, str]
) -> None:
    robot = load_robot(written(tmp_path, conf(values)), arm=arm)
    assert max(abs(joint.d) for joint in robot.joints) < 0.2  # no long way is left
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (50, 6)):
        found = truing.forward_kinematics(robot, q)[-1]
        true = long_way(arm, values, q)
        assert np.abs(found[:3, 3] - true[:3, 3]).max() < 1e-11
        np.testing.assert_allclose(found[:3, :3], true[:3, :3].astype(float), atol=1e-13)


def test_lengths_are_those_of_the_arm_again(tmp_path: Path) -> None:
    model = load_controller(written(tmp_path, conf(UR10)), "UR10")
    sheet = ARMS["ur10"].robot()
    for joint, drawn in zip(model.robot.joints, sheet.joints, strict=True):
        assert abs(joint.a - drawn.a) < 2e-3
        assert abs(joint.d - drawn.d) < 2e-3
        assert joint.mass == drawn.mass
        assert joint.upper == drawn.upper
    assert model.warnings == ()
    assert dict(model.understood)["calibration status"] == "linearised"


def test_the_arm_stands_behind_an_at_wherever_a_robot_is_read(tmp_path: Path) -> None:
    path = written(tmp_path, conf(UR5))
    by_name, by_option = load_robot(f"{path}@ur5"), load_robot(path, arm="ur5")
    assert [joint.a for joint in by_name.joints] == [joint.a for joint in by_option.joints]
    save_robot(tmp_path / "robot.yaml", by_name, calibration=load_calibration(f"{path}@ur5"))
    again = load_robot(tmp_path / "robot.yaml")
    q = np.full(6, 0.3)
    np.testing.assert_array_equal(truing.forward_kinematics(again, q), truing.forward_kinematics(by_name, q))
    assert load_calibration(tmp_path / "robot.yaml")["arm"] == "ur5"


BAD_CONF = [
    (conf(UR5), "", r"does not say which arm .* its values fit ur5, ur5e"),
    (conf(UR5), "ur16e", "it is of another arm .ur5, ur5e would fit"),
    (conf(UR5), "irb120", "there is no data sheet of 'irb120'"),
    (conf(UR5).replace("delta_d", "delta_x"), "ur5", "delta_d is missing"),
    (conf(UR5).replace("e-06, 0]", "e-06]"), "ur5", "line 3: delta_a: found 5 numbers, expected six"),
    (conf(UR5).replace("278.2", "2x8.2"), "ur5", r"line 4: delta_d = .*expected \[six numbers\]"),
    (conf(UR5).replace("278.2", "nan278.2"), "ur5", r"expected \[six numbers\]"),
    (conf(UR5).replace("278.244144925623573", "inf"), "ur5", "expected lengths in m"),
    (conf(UR5) + "delta_a = [0]\n", "ur5", "delta_a is there twice .first in line 3"),
    ("[mounting]\nfoo\n", "ur5", "line 2: found 'foo', expected `key = value`"),
    ("x: 1\n", "ur5", "expected `key = value`"),
    ("", "ur5", r"found no section \[mounting\]"),
    ("\0\1", "ur5", "is a binary file"),
]


@pytest.mark.parametrize(("text", "arm", "message"), BAD_CONF)
def test_a_calibration_conf_that_cannot_be_used_is_refused(
    tmp_path: Path, text: str, arm: str, message: str
) -> None:
    with pytest.raises(truing.InputError, match=message):
        load_robot(written(tmp_path, text), arm=arm)


def test_a_controller_that_may_not_use_its_calibration_is_said(tmp_path: Path) -> None:
    path = written(tmp_path, conf(UR5, "calibration_status = 1\njoint_checksum = [ 0x1, 0x2]\nfoo = 3\n"))
    with pytest.warns(truing.InputWarning, match="may work with the data sheet"):
        load_robot(path, arm="ur5")
    model = load_controller(path, "ur5")
    assert [text.split(":")[0] for text in model.not_understood] == [
        "joint_checksum (line 7)",
        "foo (line 8)",
    ]


# ---- .urp ----------------------------------------------------------------------------------------


def test_a_program_carries_the_arm_that_it_was_taught_on(tmp_path: Path) -> None:
    text = urp(kinematics(), '<Kinematics reference="../../../Waypoint/position/Kinematics"/>', kinematics())
    model = load_controller(written(tmp_path, gzip.compress(text.encode()), "program.urp"))
    assert model.arm == "ur10e"
    assert model.warnings == ()
    assert model.robot.joints[1].a == pytest.approx(-0.6127, abs=1e-3)
    np.testing.assert_allclose(model.robot.targets[0].T_last_target[:3, 3], [0, 0, 0.1])
    plain = load_robot(written(tmp_path, text, "plain.urp"))
    assert plain.joints[2].beta == model.robot.joints[2].beta


def test_waypoints_taught_on_another_arm_are_said_with_how_far(tmp_path: Path) -> None:
    path = written(tmp_path, urp(kinematics(), kinematics(), kinematics(d1="0.18207019996630838")), "p.urp")
    with pytest.warns(truing.InputWarning, match=r"waypoint Point_3 disagree.* up to 1\.00 mm elsewhere"):
        robot = load_robot(path)
    assert robot.joints[0].d == 0.18107019996630838


BAD_URP = [
    (b"\x1f\x8b\x08garbage", "is damaged"),
    (gzip.compress(urp(kinematics()).encode())[:-20], "is damaged"),
    (b"<URProgram>", "is no program of PolyScope"),
    (b"<robot/>", "found <robot>, expected <URProgram>"),
    (b'<!DOCTYPE a [<!ENTITY b "c">]><URProgram/>', "declares entities"),
    (urp().encode(), "holds no kinematics"),
    (urp(kinematics().replace("-11.98", "x")).encode(), "waypoint Point_1: d = .*expected six numbers"),
    (urp(kinematics().replace("<a value", "<b value")).encode(), "waypoint Point_1: <Kinematics> has no <a>"),
    (urp(kinematics(d1="400")).encode(), "have a link of 400.0 m: they are no arm's"),
    (urp(kinematics().replace("1.5705736146", "90.0")).encode(), "alpha: found .* expected angles in rad"),
    (urp(kinematics(), tool="1,2").encode(), "TCPOffset '1,2', expected x, y, z, rx, ry, rz"),
]


@pytest.mark.parametrize(("data", "message"), BAD_URP)
def test_a_program_that_cannot_be_used_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(truing.InputError, match=message):
        load_robot(written(tmp_path, data, "p.urp"))


def test_an_arm_without_a_data_sheet_is_still_an_arm(tmp_path: Path) -> None:
    path = written(tmp_path, urp(kinematics(d1="0.28107019996630838")), "p.urp")
    with pytest.warns(truing.InputWarning, match="of no arm whose data sheet is known here"):
        robot = load_robot(path)
    assert robot.joints[1].a == pytest.approx(-0.6127, abs=1e-3)
    assert robot.joints[1].d == 0.0
    assert robot.joints[1].mass is None


def test_the_kinematics_of_a_data_sheet_are_no_calibration(tmp_path: Path) -> None:
    path = written(tmp_path, urp(kinematics(status="NOT_INITIALIZED", valid="false")), "p.urp")
    with pytest.warns(truing.InputWarning, match="are not calibrated"):
        load_robot(path)
    with pytest.raises(truing.InputError, match="are not those of ur5, but of ur10e"):
        load_robot(path, arm="ur5")


# ---- MOC.cfg -------------------------------------------------------------------------------------


def test_limits_and_motors_are_those_of_the_file_and_lengths_those_of_the_data_sheet(tmp_path: Path) -> None:
    model = load_controller(written(tmp_path, moc(), "MOC.cfg"))
    assert model.arm == "irb120"
    assert [(j.lower, j.upper) for j in model.robot.joints] == [*LIMITS]
    assert model.robot.joints[1].a == pytest.approx(0.27)
    assert model.calibration["cal_offset_motor_rad"]["rob1_3"] == 3.5
    assert [joint.offset for joint in model.robot.joints] == [
        0.0
    ] * 6  # what the controller subtracts is no error
    assert "absolute accuracy is off" in model.warnings[0]
    assert "MOTION_PLANNER" in model.not_understood[-1]


def test_gear_ratios_bring_motor_radians_to_the_joint(tmp_path: Path) -> None:
    after = 'TRANSMISSION:\n\n      -name "rob1_2" -transm_joint 100\n'
    model = load_controller(written(tmp_path, moc(after=after), "MOC.cfg"))
    line = dict(model.understood)["motor at calibration, rob1_2"]
    assert line == f"2.50000 rad at the motor, {math.degrees(0.025):.5f} deg at the joint"
    assert model.calibration["motor_turns_per_joint_turn"] == {"rob1_2": 100.0}


def test_a_controller_that_corrects_itself_is_said(tmp_path: Path) -> None:
    table = (
        'ARM_CALIB:\n\n      -name "rob1_2" -error_offset_x 3E-4 -error_offset_y 0.0004 -error_roll 1E-3\n#\n'
        'JOINT_CALIB:\n\n      -name "rob1_2" -Compl 4.98678E-007\n'
    )
    path = written(tmp_path, moc(calib="r1_calib", after=table), "MOC.cfg")
    with pytest.warns(
        truing.InputWarning, match=r"absolute accuracy is on .* up to 0\.500 mm and 1\.000 mrad"
    ):
        load_robot(path)
    assert any("4.98678E-007" in text for text in load_controller(path).not_understood)


def test_arm_loads_are_told_and_not_guessed_into_a_frame(tmp_path: Path) -> None:
    after = 'ARM_LOAD:\n\n      -name "r1_load_3" -mass 20 -mass_centre_x 1 -mass_centre_z 0.45\n'
    path = written(tmp_path, moc(after=after, load=' -use_customer_arm_load "r1_load_3"'), "MOC.cfg")
    model = load_controller(path)
    assert dict(model.understood)["arm load r1_load_3"] == "20 kg at 1, 0, 0.45 m, on rob1_3"
    assert model.not_understood[0].startswith("ARM_LOAD r1_load_3: 20 kg hang on rob1_3")
    assert model.robot.joints[2].mass is None


def test_where_the_robot_stands_is_taken_over(tmp_path: Path) -> None:
    more = "\\\n      -base_frame_pos_x 1.5 -base_frame_orient_u0 0 -base_frame_orient_u1 1"
    robot = load_controller(written(tmp_path, moc(more=more), "MOC.cfg")).robot
    np.testing.assert_allclose(robot.T_measurement_base, np.diag([1, -1, -1, 1]) + 1.5 * np.eye(4, k=3))


def test_another_arm_of_this_maker_comes_from_a_robot_file(tmp_path: Path) -> None:
    path = written(tmp_path, moc(type="ROB1_6660_1.90_205"), "MOC.cfg")
    with pytest.raises(truing.InputError, match="there is no data sheet of ROB1_6660_1.90_205 here"):
        load_robot(path)
    save_robot(tmp_path / "irb6660.yaml", ARMS["irb4600-40"].robot())
    robot = load_controller(f"{path}@irb6660.yaml").robot  # beside it
    assert robot.joints[1].a == 1.095
    assert robot.joints[1].upper == LIMITS[1][1]


BAD_MOC = [
    ("EIO:CFG_1.0:6:0::\n", "line 1: found 'EIO:CFG_1.0:6:0::', expected MOC:CFG_1.0"),
    ("", "line 1: found '', expected MOC"),
    (moc().replace("ROBOT:", "ROBOTS:"), "has 0 robots, expected one"),
    (moc().replace('-use_joint_5 "rob1_6"', ""), "line 10: ROB_1 has 5 joints .* irb120 has 6"),
    (moc().replace('-name "rob1_4" -use_arm', '-name "x" -use_arm'), 'ARM has no entry of joint "rob1_4"'),
    (
        moc().replace("bound -2.9", "bound two"),
        "line 21: -lower_joint_bound of 'rob1_1' is 'two', expected a number",
    ),
    (moc().replace("bound -2.9", "bound 3"), "joint bounds of rob1_1 are 3 and 2.9, expected lower < upper"),
    (
        moc().replace("-restricted_circlepoint", '-a "b" "c"'),
        "line 5: found '\"c\"', expected -key value",
    ),
    (moc() + 'X:\n      -name "a"\\\n', "the file is cut off"),
    (moc(more=" -base_frame_orient_u0 0.5"), "expected a quaternion of length 1"),
]


@pytest.mark.parametrize(("text", "message"), BAD_MOC)
def test_a_moc_cfg_that_cannot_be_used_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(truing.InputError, match=message):
        load_controller(written(tmp_path, text, "MOC.cfg"))


# ---- LeRobot -------------------------------------------------------------------------------------


def follower(folder: Path, motors: object = None, urdf: str = "") -> Path:
    written(folder, urdf or small_urdf(), "arm.urdf")
    return written(folder, json.dumps(MOTORS if motors is None else motors), "follower.json")


def test_ranges_of_servos_become_limits_about_a_zero_that_somebody_held(tmp_path: Path) -> None:
    path = follower(tmp_path)
    with pytest.warns(truing.InputWarning, match="recorded by hand"):
        robot = load_robot(path)  # the only URDF beside it
    assert math.degrees(robot.joints[0].upper) == pytest.approx((3292 - 758) / 2 * 360 / 4095)
    assert robot.joints[0].lower == -robot.joints[0].upper
    model = load_controller(f"{path}@arm.urdf")
    assert model.not_understood == ("gripper: no joint of the chain",)
    assert model.calibration["motors"]["elbow_flex"]["homing_offset"] == -1103


def test_numbered_joints_take_motors_in_the_order_of_their_ids(tmp_path: Path) -> None:
    motors = {name: MOTORS[name] for name in ("elbow_flex", "shoulder_lift", "shoulder_pan")}
    model = load_controller(follower(tmp_path, motors, small_urdf(("1", "2", "3"))))
    assert [line[0] for line in model.understood] == ["geometry", "1", "2", "3"]
    assert "homing offset -46" in model.understood[1][1]


def test_a_urdf_whose_zero_is_elsewhere_is_said(tmp_path: Path) -> None:
    model = load_controller(follower(tmp_path, urdf=small_urdf(low=-0.5)))
    assert "the two zeros are not the same" in model.warnings[0]
    assert "+28.6 deg" in model.warnings[0]


def changed(**values: object) -> dict[str, object]:
    return {**MOTORS, "shoulder_pan": {**MOTORS["shoulder_pan"], **values}}


BAD_JSON = [
    ("{", "is no JSON"),
    ("[]", "expected motors by name"),
    ('{"motor_names": [], "calib_mode": []}', "a calibration of LeRobot before"),
    ('{"a": 3}', "'a' is 3, expected id, drive_mode"),
    (
        json.dumps(changed(homing_offset=1.5)),
        "homing_offset of 'shoulder_pan' is 1.5, expected a whole number",
    ),
    (json.dumps(changed(range_min=4000)), "the range of 'shoulder_pan' is 4000 to 3292"),
    (json.dumps(changed(range_max=9000)), "more than the 4096 counts"),
    (json.dumps(changed(id=2)), "shoulder_lift and shoulder_pan both have id 2"),
    (json.dumps({"a": MOTORS["gripper"]}), "has no motor for joint shoulder_pan, shoulder_lift, elbow_flex"),
]


@pytest.mark.parametrize(("text", "message"), BAD_JSON)
def test_a_calibration_of_servos_that_cannot_be_used_is_refused(
    tmp_path: Path, text: str, message: str
) -> None:
    written(tmp_path, small_urdf(), "arm.urdf")
    with pytest.raises(truing.InputError, match=message):
        load_robot(written(tmp_path, text, "follower.json"))


def test_servos_without_a_urdf_are_no_robot(tmp_path: Path) -> None:
    path = written(tmp_path, json.dumps(MOTORS), "follower.json")
    with pytest.raises(truing.InputError, match="beside it are 0 URDFs"):
        load_robot(path)
    with pytest.raises(truing.InputError, match="there is no data sheet of 'gone.urdf'"):
        load_robot(f"{path}@gone.urdf")
    assert list(load_lerobot_calibration(path)) == list(MOTORS)


# ---- Data sheets ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(ARMS))
def test_a_data_sheet_is_a_robot(name: str) -> None:
    robot = ARMS[name].robot()
    assert robot.driven_count == 6
    assert all(joint.lower < joint.upper for joint in robot.joints)


def test_the_tool_of_an_abb_arm_looks_forward_at_zero() -> None:
    """As its maker draws it: flange in front, z forward, x down; IRB 4600-40/2.55 at 1.27 + 0.135 + 0.175
    m.
    """
    T = truing.forward_kinematics(ARMS["irb4600-40"].robot(), np.zeros(6))[-1]
    np.testing.assert_allclose(T[:3, 3], [1.58, 0, 0.495 + 1.095 + 0.175], atol=1e-12)
    np.testing.assert_allclose(T[:3, :3], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-12)


def test_a_ur_arm_at_zero_lies_along_minus_x() -> None:
    """x = a2 + a3, y = -(d4 + d6), z = d1 - d5."""
    T = truing.forward_kinematics(ARMS["ur10e"].robot(), np.zeros(6))[-1]
    np.testing.assert_allclose(T[:3, 3], [-1.18425, -0.2907, 0.06085], atol=1e-12)


def test_an_arm_is_for_files_of_controllers_alone(tmp_path: Path) -> None:
    save_robot(tmp_path / "robot.yaml", ARMS["ur5"].robot())
    with pytest.raises(truing.InputError, match="an arm is named for files of controllers"):
        load_robot(tmp_path / "robot.yaml", arm="ur5")


# ---- Faults --------------------------------------------------------------------------------------

FAULTS = [
    b"0",
    b"1",
    b"5",
    b"9",
    b"-",
    b".",
    b"e",
    b"nan",
    b"\0",
    b"\xff",
    b'"',
    b"\\",
    b"",
    b"<",
    b"]",
    b"1e400",
]


@pytest.mark.filterwarnings("ignore::truing.InputWarning")
@pytest.mark.parametrize(
    ("name", "text", "arm"),
    [
        ("calibration.conf", conf(UR5), "ur5"),
        ("program.urp", urp(kinematics(), kinematics(d1="0.19")), ""),
        (
            "MOC.cfg",
            moc(more=" -base_frame_pos_x 1", after='TRANSMISSION:\n\n -name "rob1_1" -transm_joint 4\n'),
            "",
        ),
        ("follower.json", json.dumps(MOTORS), ""),
    ],
)
def test_a_file_with_faults_is_refused_in_one_line_or_is_a_robot_that_can_be_saved(
    tmp_path: Path, name: str, text: str, arm: str
) -> None:
    written(tmp_path, small_urdf(), "arm.urdf")
    rng = np.random.default_rng(11)
    refused = 0
    for _ in range(100):
        data = bytearray(text.encode())
        for place in rng.integers(0, len(data), rng.integers(1, 3)):
            data[place : place + 1] = FAULTS[rng.integers(len(FAULTS))]
        try:
            model = load_controller(written(tmp_path, bytes(data), name), arm)
        except truing.InputError as error:
            refused += 1
            assert "\n" not in str(error)
            continue
        save_robot(tmp_path / "robot.yaml", model.robot, calibration=model.calibration)
        again = load_robot(tmp_path / "robot.yaml")
        q = np.full(again.driven_count, 0.5)
        assert np.isfinite(truing.forward_kinematics(again, q)).all()
    assert 20 < refused < 100
