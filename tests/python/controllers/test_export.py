# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values that are written for controllers, read back by parsers that are not ours: the calibrated forward
kinematics come out of each within the digits that are printed, or within the millimetres that are said to be
missing.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shlex
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import truing
from truing.controllers import Calibration, ExportOptions, Format, export, load_result, nearest
from truing.controllers.zeros import words
from truing.files import ARMS, last_to_flange, save_robot, with_flange

TWO_JOINTS_AND_TOOL0 = """\
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="hand"/><link name="tool0"/>
  <joint name="j1" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="j2" type="revolute">
    <parent link="upper"/><child link="hand"/><origin xyz="0.2 0 0" rpy="1.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="to_tool0" type="fixed">
    <parent link="hand"/><child link="tool0"/><origin xyz="0 0.05 0.1" rpy="0 1.5 0.2"/>
  </joint>
</robot>
"""


def arm(name: str = "ur5e") -> truing.Robot:
    """A nominal arm with a tool off its last axis."""
    return (
        ARMS[name]
        .robot()
        .replace(
            targets=[truing.Target("tool", truing.frame_from_xyz_rpy([0.01, 0.02, 0.15], [0.1, 0.2, 0.3]))]
        )
    )


def calibrated(seed: int = 1, links: bool = True, name: str = "ur5e") -> truing.Robot:
    """As identify finds one: links of half a millimetre off, zeros of some mrad, base somewhere."""
    rng = np.random.default_rng(seed)
    robot = arm(name)
    for joint in robot.joints:
        joint.offset += rng.normal(0, 3e-3)
        if links:
            for key in ("a", "d", "alpha"):
                setattr(joint, key, getattr(joint, key) + rng.normal(0, 5e-4))
    robot.T_measurement_base = truing.frame_from_xyz_rpy([1.0, -2.0, 0.5], [0.02, -0.01, 2.0])
    return robot


def joints(count: int = 6, seed: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (30, count))


def tool_in_base(robot: truing.Robot, q: np.ndarray) -> np.ndarray:
    return np.asarray(truing.forward_kinematics(robot.replace(T_measurement_base=np.eye(4)), q)[-1])


def exported(robot: truing.Robot, to: Format, **options: Any) -> Any:
    return export(Calibration(Path("robot.yaml"), robot), to, ExportOptions(**options)).written


def pinocchio_tool(pinocchio: Any, urdf: str, q: np.ndarray, frame: str) -> np.ndarray:
    model = pinocchio.buildModelFromXML(urdf)
    data = model.createData()
    values = []
    for value, joint in zip(q, model.joints[1:], strict=True):  # continuous joints take cosine and sine
        values += [math.cos(value), math.sin(value)] if joint.nq == 2 else [value]
    pinocchio.framesForwardKinematics(model, data, np.array(values))
    return np.asarray(data.oMf[model.getFrameId(frame)].homogeneous)


# ---- ur_description, urdf ------------------------------------------------------------------------

XACRO = """<robot name="ur" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="file" default=""/>
  <xacro:property name="k" value="${xacro.load_yaml(xacro.arg('file'))['kinematics']}"/>
  <xacro:macro name="step" params="parent link joint">
    <link name="${link}_link"/>
    <joint name="${joint}" type="continuous">
      <parent link="${parent}"/><child link="${link}_link"/>
      <origin xyz="${k[link]['x']} ${k[link]['y']} ${k[link]['z']}"
        rpy="${k[link]['roll']} ${k[link]['pitch']} ${k[link]['yaw']}"/>
      <axis xyz="0 0 1"/>
    </joint>
  </xacro:macro>
  <link name="base_link_inertia"/>
  <xacro:step parent="base_link_inertia" link="shoulder" joint="shoulder_pan_joint"/>
  <xacro:step parent="shoulder_link" link="upper_arm" joint="shoulder_lift_joint"/>
  <xacro:step parent="upper_arm_link" link="forearm" joint="elbow_joint"/>
  <xacro:step parent="forearm_link" link="wrist_1" joint="wrist_1_joint"/>
  <xacro:step parent="wrist_1_link" link="wrist_2" joint="wrist_2_joint"/>
  <xacro:step parent="wrist_2_link" link="wrist_3" joint="wrist_3_joint"/>
</robot>
"""


def test_kinematics_of_ur_description_give_the_arm_through_xacro_and_pinocchio(tmp_path: Path) -> None:
    xacro, pinocchio = pytest.importorskip("xacro"), pytest.importorskip("pinocchio")
    robot = calibrated()
    out = exported(robot, "ur_description")
    (tmp_path / "kinematics.yaml").write_text(out.files["kinematics.yaml"], encoding="utf-8")
    # The joints of ur_description's ur_macro.xacro.
    text = XACRO.replace("xacro.arg('file')", repr(str(tmp_path / "kinematics.yaml")))
    (tmp_path / "ur.xacro").write_text(text, encoding="utf-8")
    urdf = xacro.process_file(str(tmp_path / "ur.xacro")).toxml()
    after = np.array(out.extra["T_wrist_3_tool"])
    for q in joints():
        found = pinocchio_tool(pinocchio, urdf, q, "wrist_3_link") @ after
        np.testing.assert_allclose(found, tool_in_base(robot, q), atol=1e-12)
    assert out.remaining.largest < 1e-12


def test_the_makers_own_default_kinematics_come_out_of_its_data_sheet() -> None:
    """config/ur30/default_kinematics.yaml of ur_description, as frames: its angles are another way to write
    them.
    """
    rows = yaml.safe_load(exported(ARMS["ur30"].robot(), "ur_description").files["kinematics.yaml"])[
        "kinematics"
    ]
    expected = {
        "shoulder": ([0, 0, 0.2363], [0, 0, 0]),
        "upper_arm": ([0, 0, 0], [1.570796327, 0, 0]),
        "forearm": ([-0.637, 0, 0], [0, 0, 0]),
        "wrist_1": ([-0.5037, 0, 0.201], [0, 0, 0]),
        "wrist_2": ([0, -0.1593, 0], [1.570796327, 0, 0]),
        "wrist_3": ([0, 0.1543, -3.1647e-11], [1.5707963265897931, 3.1415926535897931, 3.1415926535897931]),
    }
    for link, (xyz, rpy) in expected.items():
        row = rows[link]
        np.testing.assert_allclose([row["x"], row["y"], row["z"]], xyz, atol=1e-9)
        found = Rotation.from_euler("xyz", [row["roll"], row["pitch"], row["yaw"]])
        assert (found.inv() * Rotation.from_euler("xyz", rpy)).magnitude() < 1e-8
    assert rows["hash"].startswith("truing_")


@pytest.mark.parametrize("convention", ["dh", "mdh", "urdf"])
def test_a_urdf_gives_the_arm_through_pinocchio(convention: str, tmp_path: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    robot = calibrated()
    if convention == "mdh":
        robot = robot.replace(convention="mdh")
    if convention == "urdf":
        (tmp_path / "arm.urdf").write_text(exported(robot, "urdf").files["robot.urdf"], encoding="utf-8")
        robot = truing.load_robot(tmp_path / "arm.urdf", tip_link="tool")
        robot.joints[2].offset = 0.01
    out = exported(robot, "urdf")
    for q in joints():
        found = pinocchio_tool(pinocchio, out.files["robot.urdf"], q, "tool")
        np.testing.assert_allclose(found, tool_in_base(robot, q), atol=1e-12)
    assert out.remaining.largest < 1e-12


def test_a_mimic_joint_takes_along_its_leaders_zero(tmp_path: Path) -> None:
    leader, follower = "shoulder_lift", "elbow"
    robot = calibrated()
    robot = robot.replace(
        joints=[
            joint.replace(driven_by=[(leader, -1.0)], lower=-np.inf, upper=np.inf)
            if joint.name == follower
            else joint
            for joint in robot.joints
        ]
    )
    robot.joint(leader).offset, robot.joint(follower).offset = 0.02, -0.01
    out = exported(robot, "urdf")
    (tmp_path / "arm.urdf").write_text(out.files["robot.urdf"], encoding="utf-8")
    read = truing.load_robot(tmp_path / "arm.urdf", tip_link="tool")
    for q in joints()[:, :5]:
        np.testing.assert_allclose(tool_in_base(read, q), tool_in_base(robot, q), atol=1e-12)
    assert out.remaining.largest < 1e-12


def test_what_a_urdf_cannot_hold_is_counted_in_millimetres() -> None:
    robot = calibrated()
    robot.joints[1].ratio = 1.001
    robot.effects = [truing.model.AppliedEffect("backlash", ["elbow"], {"backlash.elbow": 1e-3})]
    out = exported(robot, "urdf")
    named = {item.name: item.size for item in out.dropped}
    assert set(named) == {"shoulder_lift.ratio", "backlash elbow"}
    assert 1e-3 < named["shoulder_lift.ratio"] < np.pi * 1e-3 * 1.2  # at most half a turn at full reach
    assert 1e-5 < named["backlash elbow"] < 0.5e-3 * 0.8
    assert 0 < out.remaining.largest <= sum(named.values())


def test_a_source_keeps_its_names(tmp_path: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    source = tmp_path / "arm.urdf"
    source.write_text(exported(arm(), "urdf").files["robot.urdf"], encoding="utf-8")
    robot = truing.load_robot(source, tip_link="tool")
    robot.joints[1].T_parent_joint = robot.joints[1].T_parent_joint @ truing.frame_from_xyz_rpy(
        [1e-3, 0, 0], [0, 0, 0.01]
    )
    out = exported(robot, "urdf", source=source, tip_link="tool")
    for q in joints():
        found = pinocchio_tool(pinocchio, out.files["robot.urdf"], q, "tool")
        np.testing.assert_allclose(found, tool_in_base(robot, q), atol=1e-12)


# ---- Frames --------------------------------------------------------------------------------------

NUMBER = r"-?\d+(?:\.\d+)?"


def numbers_of(text: str) -> list[float]:
    """Those of the last line that names a frame: comments before it."""
    return [float(word) for word in re.findall(rf"(?<![A-Za-z\d_]){NUMBER}(?![A-Za-z_])", text)]


def scipy_frame(brand: str, values: list[float]) -> np.ndarray:
    v = np.array(values)
    rotation = {
        "kuka": lambda: Rotation.from_euler("ZYX", v[3:], degrees=True),
        "abb": lambda: Rotation.from_quat(np.roll(v[3:], -1)),
        "fanuc": lambda: Rotation.from_euler("xyz", v[3:], degrees=True),
        "yaskawa": lambda: Rotation.from_euler("xyz", v[3:], degrees=True),
        "ur": lambda: Rotation.from_rotvec(v[3:]),
    }[brand]()
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), v[:3] * (1.0 if brand == "ur" else 1e-3)
    return T


@pytest.mark.parametrize(
    ("brand", "length", "angle"),
    [
        ("kuka", 1e-7, 1e-6),
        ("abb", 1e-7, 1e-7),
        ("fanuc", 1e-6, 2e-5),
        ("ur", 1e-7, 2e-7),
        ("yaskawa", 1e-6, 2e-6),
    ],
)
def test_frames_come_back_from_each_makers_notation_within_its_digits(
    brand: str, length: float, angle: float
) -> None:
    robot = calibrated()
    out = exported(robot, "frames", brands=[brand])
    assert list(out.files) == [f"{brand}.txt"]
    lines = [line for line in out.files[f"{brand}.txt"].splitlines() if line[0] not in ";!#"]
    base = np.asarray(robot.T_measurement_base)
    truth = [np.asarray(robot.targets[0].T_last_target), np.linalg.inv(base), base]
    for line, T in zip(lines, truth, strict=True):
        found = scipy_frame(brand, numbers_of(line.partition("=")[2] if brand in ("kuka", "abb") else line))
        assert np.abs(found[:3, 3] - T[:3, 3]).max() < length
        assert Rotation.from_matrix(found[:3, :3].T @ T[:3, :3]).magnitude() < angle


def test_frames_for_a_controller_that_keeps_its_links_take_what_they_can() -> None:
    """The first joint's zero and height go into the base, the last one's zero and length into the tool."""
    nominal = arm()
    robot = nominal.replace(
        T_measurement_base=truing.frame_from_xyz_rpy([1.0, -2.0, 0.5], [0.02, -0.01, 2.0])
    )
    robot.joints[0].theta, robot.joints[0].d = 0.01, robot.joints[0].d + 2e-3
    robot.joints[5].theta, robot.joints[5].d = -0.02, robot.joints[5].d + 1e-3
    out = exported(robot, "frames", nominal=nominal)
    assert out.remaining.largest < 1e-8
    found = nearest(nominal, robot, ()).robot
    entered = nominal.replace(T_measurement_base=found.T_measurement_base, targets=list(found.targets))
    for q in joints():
        T = truing.forward_kinematics(robot, q)[-1]
        np.testing.assert_allclose(truing.forward_kinematics(entered, q)[-1], T, atol=1e-8)
    apart = exported(calibrated(), "frames", nominal=nominal)
    assert apart.dropped[0].size == apart.remaining.largest > 1e-3


@pytest.mark.parametrize(("to", "alone"), [("frames", True), ("frames", False), ("zeros", False)])
def test_tools_stand_in_the_flange_that_a_urdf_has_at_its_tip(
    to: Format, alone: bool, tmp_path: Path
) -> None:
    """A calibrated robot keeps it in robot.yaml, where its tool is what was measured."""
    (tmp_path / "arm.urdf").write_text(TWO_JOINTS_AND_TOOL0, encoding="utf-8")
    nominal = truing.load_robot(tmp_path / "arm.urdf")
    T_flange_tool = truing.frame_from_xyz_rpy([0.01, 0.02, 0.15], [0.1, 0.2, 0.3])
    found = nominal.replace(targets=[truing.Target("tool", last_to_flange(nominal) @ T_flange_tool)])
    save_robot(tmp_path / "robot.yaml", with_flange(found, nominal))
    robot = truing.load_robot(tmp_path / "robot.yaml")
    np.testing.assert_allclose(last_to_flange(robot)[:3, 3], [0.0, 0.05, 0.1])
    out = exported(robot, to, **({} if alone else {"nominal": nominal}))
    if to == "frames":
        lines = [line for line in out.files["ur.txt"].splitlines() if line.startswith("set_tcp")]
    else:
        lines = re.findall(r"tool in the flange, ur</th><td>(.*?)</td>", out.files["zeros.html"])
    np.testing.assert_allclose(scipy_frame("ur", numbers_of(lines[0])), T_flange_tool, atol=1e-6)


# ---- tf ------------------------------------------------------------------------------------------


def handeye_result(folder: Path, setup: str = "eye-in-hand") -> Path:
    entry = {"x_m": 0.05, "y_m": -0.02, "z_m": 0.1, "qw": 0.5, "qx": 0.5, "qy": -0.5, "qz": 0.5}
    document = {
        "format": "truing-handeye/1",
        "status": "done",
        "setup": setup,
        "camera": entry,
        "board": entry,
    }
    (folder / "result.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def published(line: str) -> tuple[str, str, np.ndarray]:
    """What tf2_ros's static_transform_publisher makes of its arguments."""
    words_of_line = shlex.split(line)
    assert words_of_line[:4] == ["ros2", "run", "tf2_ros", "static_transform_publisher"]
    parser = argparse.ArgumentParser()
    for key in ("x", "y", "z", "qx", "qy", "qz", "qw"):
        parser.add_argument(f"--{key}", type=float, required=True)
    parser.add_argument("--frame-id", required=True)
    parser.add_argument("--child-frame-id", required=True)
    a = parser.parse_args(words_of_line[4:])
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat([a.qx, a.qy, a.qz, a.qw]).as_matrix()
    T[:3, 3] = (a.x, a.y, a.z)
    return a.frame_id, a.child_frame_id, T


@pytest.mark.parametrize(
    ("setup", "parents"), [("eye-in-hand", ["tool0", "base"]), ("eye-to-hand", ["base", "tool0"])]
)
def test_a_camera_is_published_where_handeye_found_it(tmp_path: Path, setup: str, parents: list[str]) -> None:
    calibration = load_result(handeye_result(tmp_path, setup))
    out = export(calibration, "tf", ExportOptions(child="camera color")).written
    lines = [line for line in out.files["static_transforms.sh"].splitlines() if not line.startswith("#")]
    parent, child, T = published(lines[0])
    assert (parent, child) == (parents[0], "camera color")
    np.testing.assert_allclose(T[:3, 3], [0.05, -0.02, 0.1], atol=1e-12)
    np.testing.assert_allclose(T[:3, :3], Rotation.from_quat([0.5, -0.5, 0.5, 0.5]).as_matrix(), atol=1e-12)
    assert published(lines[1])[:2] == (parents[1], "board")


# ---- Zeros ---------------------------------------------------------------------------------------


def inner_zeros() -> truing.Robot:
    """Wrong in zeros and one ratio alone, of joints that have a zero of their own."""
    robot = calibrated(links=False)
    robot.joints[0].offset = robot.joints[5].offset = 0.0
    return robot


def with_values(robot: truing.Robot, values: Any) -> truing.Robot:
    base, tool = (np.array(values[key]) for key in ("T_measurement_base", "T_flange_tool"))
    return robot.replace(T_measurement_base=base, targets=[truing.Target("tool", tool)])


def test_transmissions_give_the_arm_with_the_nominal_description() -> None:
    """By the formula of transmission_interface::SimpleTransmission, joint = actuator / reduction + offset."""
    robot = inner_zeros()
    robot.joints[2].ratio = 1.0004
    out = exported(robot, "ros2_control", nominal=arm())
    root = ElementTree.fromstring(out.files["transmissions.xml"])
    entries = [one.find("joint") for one in root.iter("transmission")]
    assert [one.get("name") for one in entries if one is not None] == [joint.name for joint in robot.joints]
    reductions = np.array(
        [float(one.findtext("mechanical_reduction", "")) for one in entries if one is not None]
    )
    offsets = np.array([float(one.findtext("offset", "")) for one in entries if one is not None])
    description = with_values(arm(), out.values)
    for q in joints():
        found = truing.forward_kinematics(description, q / reductions + offsets)[-1]
        np.testing.assert_allclose(found, truing.forward_kinematics(robot, q)[-1], atol=1e-8)
    params = ElementTree.fromstring(out.files["joint_offsets.xml"])
    assert [float(one.findtext("param", "")) for one in params.iter("joint")] == offsets.tolist()
    assert out.remaining.largest < 1e-8


def test_zeros_on_the_sheet_give_the_arm_and_links_are_counted() -> None:
    robot, nominal = calibrated(), arm()
    out = exported(robot, "zeros", nominal=nominal)
    rows = [line.split(",") for line in out.files["zeros.csv"].splitlines()[1:]]
    found = nearest(nominal, robot, ("offset",))
    entered = nominal.replace(
        T_measurement_base=found.robot.T_measurement_base, targets=list(found.robot.targets)
    )
    for joint, (name, offset, unit, shown) in zip(entered.joints, rows, strict=True):
        assert (joint.name, unit) == (name, "deg")
        assert float(shown) == -float(offset)
        joint.offset = math.radians(float(offset))
    apart = [
        np.linalg.norm(
            truing.forward_kinematics(entered, q)[-1][:3, 3] - truing.forward_kinematics(robot, q)[-1][:3, 3]
        )
        for q in joints()
    ]
    assert max(apart) <= 1.3 * out.remaining.largest
    assert out.remaining.rms < 0.5 * out.before.rms
    assert out.dropped[0].name == "lengths and twists of links"
    assert out.dropped[0].size == out.remaining.largest
    exact = exported(inner_zeros(), "zeros", nominal=nominal)
    assert exact.remaining.largest < 1e-5  # 0.0001 deg at 1 m, in six joints


def test_the_sheet_says_why_it_writes_no_counts_and_escapes_names() -> None:
    robot, nominal = calibrated(), arm()
    robot.name = nominal.name = "<script>alert(1)</script>"
    sheet = exported(robot, "zeros", nominal=nominal).files["zeros.html"]
    assert "Mastering counts and machine data are not written" in sheet
    assert "<script" not in sheet


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0.0000", "0: the joint stands where the controller says"),
        (
            "0.1000",
            "+0.1000 deg: the joint stands 0.1000 deg further on in its positive direction than",
        ),
        ("-0.2000", "at its true zero the controller shows +0.2000 deg"),
    ],
)
def test_signs_are_in_words(text: str, said: str) -> None:
    assert said in words(text, "deg")


# ---- LeRobot -------------------------------------------------------------------------------------

MOTORS = {
    joint.name: {
        "id": k,
        "drive_mode": 0,
        "homing_offset": 11 * k,
        "range_min": 800 + k,
        "range_max": 3200 - k,
    }
    for k, joint in enumerate(arm().joints, 1)
}


def lerobot_degrees(counts: np.ndarray, motors: dict[str, dict[str, int]]) -> np.ndarray:
    """MotorsBus._normalize of lerobot, MotorNormMode.DEGREES, resolution 4096."""
    middle = np.array([(motor["range_min"] + motor["range_max"]) / 2 for motor in motors.values()])
    return np.asarray((counts - middle) * 360 / 4095)


def test_lerobot_reads_the_zeros_that_were_found(tmp_path: Path) -> None:
    path = tmp_path / "follower.json"
    path.write_text(json.dumps({**MOTORS, "gripper": {**MOTORS["elbow"], "id": 9}}), encoding="utf-8")
    robot = inner_zeros()
    for joint, offset in zip(robot.joints[1:5], (0.1, -0.05, 0.03, -0.01), strict=True):
        joint.offset = offset
    out = exported(robot, "lerobot", nominal=arm(), lerobot=path)
    motors = json.loads(out.files["follower.json"])
    assert motors.pop("gripper") == {**MOTORS["elbow"], "id": 9}
    description = nearest(arm(), robot, ("offset",)).robot
    for joint in description.joints:
        joint.offset = 0.0
    counts = np.random.default_rng(7).integers(1000, 3000, (40, 6))
    apart = []
    for row in counts:
        before = np.radians(lerobot_degrees(row, MOTORS))
        after = np.radians(lerobot_degrees(row, motors))
        true = truing.forward_kinematics(robot, before)[-1]  # as it was recorded
        apart.append(np.linalg.norm(truing.forward_kinematics(description, after)[-1][:3, 3] - true[:3, 3]))
    assert max(apart) < 1.5e-3  # a quarter of a count is 0.4 mrad, in four joints
    assert max(apart) <= 1.3 * out.remaining.largest
    for name, motor in motors.items():
        assert motor["homing_offset"] == MOTORS[name]["homing_offset"]
        assert (
            MOTORS[name]["range_min"] <= motor["range_min"] < motor["range_max"] <= MOTORS[name]["range_max"]
        )


# ---- Bad input -----------------------------------------------------------------------------------


def palletizer() -> truing.Robot:
    return truing.load_robot(truing.examples.example("palletizer"))


BAD = [
    (calibrated, "zeros", {}, "needs --nominal"),
    (calibrated, "lerobot", {"nominal": arm()}, "needs --calibration"),
    (calibrated, "zeros", {"nominal": palletizer()}, "these are not the same robot"),
    (palletizer, "ur_description", {}, "six revolute joints in a row"),
    (palletizer, "urdf", {}, "follows 2 joints"),
    (calibrated, "urdf", {"source": Path("a.urdf")}, "has convention dh"),
    (calibrated, "tf", {"parent": "tool"}, "parent and child are both 'tool'"),
    (calibrated, "excel", {}, "format 'excel' is not known"),
]


@pytest.mark.parametrize(("robot", "to", "options", "message"), BAD)
def test_what_cannot_be_written_is_refused(robot: Any, to: Any, options: Any, message: str) -> None:
    with pytest.raises(truing.InputError, match=message):
        exported(robot(), to, **options)


def test_a_zero_too_far_off_is_to_be_homed_again(tmp_path: Path) -> None:
    path = tmp_path / "follower.json"
    path.write_text(json.dumps(MOTORS), encoding="utf-8")
    robot = inner_zeros()
    robot.joints[2].offset = 1.0
    with pytest.raises(truing.InputError, match=r"elbow: its zero is 57\.3 deg off"):
        exported(robot, "lerobot", nominal=arm(), lerobot=path)


def test_results_are_found_in_their_folders(tmp_path: Path) -> None:
    with pytest.raises(truing.InputError, match="holds no robot.yaml"):
        load_result(tmp_path)
    save_robot(tmp_path / "robot.yaml", calibrated())
    assert load_result(tmp_path).robot is not None
    for text, message in (
        ("{", "is no JSON"),
        (
            '{"format": "truing-handeye/1", "status": "not observable"}',
            "ended with 'not observable' and has no camera",
        ),
        ('{"format": "truing-handeye/1", "camera": {"x_m": 1}}', "expected x_m y_m z_m and a quaternion"),
    ):
        (tmp_path / "result.json").write_text(text, encoding="utf-8")
        with pytest.raises(truing.InputError, match=message):
            load_result(tmp_path / "result.json")
    calibration = load_result(handeye_result(tmp_path))
    with pytest.raises(truing.InputError, match="is of handeye and has frames alone"):
        export(calibration, "urdf")
