# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What is read of an MJCF, against MuJoCo itself: its inverse dynamics are ours at any motion."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from truing import _core
from truing.cli import main
from truing.errors import InputError, InputWarning

mujoco = pytest.importorskip("mujoco", reason="MuJoCo (pip package 'mujoco') is not installed")

Floats = NDArray[np.float64]


def laws(robot: truing.Robot, q: Floats, qd: Floats) -> Floats:
    """Torques of the effects that an MJCF states, as the catalogue has them."""
    out = np.zeros_like(q)
    driven = [robot.joints[index].name for index in robot.driven_joints()]
    for effect in robot.torque_effects:
        k = driven.index(effect.joints[0])
        s, v = np.sign(qd[:, k]), qd[:, k]
        for name, value in effect.parameters.items():
            part = name.removeprefix(f"{effect.effect}.{effect.joints[0]}")
            basis = {
                "coulomb": s,
                "viscous": v,
                "viscous_law.quadratic": v * np.abs(v),
                "viscous_law.cubic": v**3,
                "spring": q[:, k],
                "current_offset": np.ones(len(q)),
            }[effect.effect + part]
            out[:, k] += value * basis
    return out


def motion(robot: truing.Robot, n: int, seed: int) -> tuple[Floats, Floats, Floats]:
    """Fast enough everywhere that MuJoCo's soft dry friction has its full size."""
    random = np.random.default_rng(seed)
    shape = (n, robot.driven_count)
    q = random.uniform(-2.5, 2.5, shape)
    qd = random.uniform(0.5, 3.0, shape) * random.choice([-1.0, 1.0], shape)
    return q, qd, random.uniform(-5.0, 5.0, shape)


def torques(robot: truing.Robot, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    return np.asarray(_core.rigid_torques(robot, q, qd, qdd)) + laws(robot, q, qd)


def mujocos(model: Any, names: list[str], q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """qfrc_inverse at the joints of these names; all others are held at their references."""
    data = mujoco.MjData(model)
    joints = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in names]
    where, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    out = []
    for row in range(len(q)):
        data.qpos[:] = model.qpos0
        data.qvel[:] = data.qacc[:] = 0.0
        data.qpos[where], data.qvel[dofs], data.qacc[dofs] = q[row], qd[row], qdd[row]
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse[dofs].copy())
    return np.array(out)


def driven_names(robot: truing.Robot) -> list[str]:
    return [robot.joints[index].name for index in robot.driven_joints()]


def load(tmp_path: Path, text: str, tip: str = "", base: str = "", warns: str = "") -> truing.Robot:
    path = tmp_path / "robot.xml"
    path.write_text(text)
    if warns:
        with pytest.warns(InputWarning, match=warns):
            return truing.load_robot(path, base, tip)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return truing.load_robot(path, base, tip)


def assert_same_torques(text: str, robot: truing.Robot, seed: int = 1) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    q, qd, qdd = motion(robot, 200, seed)
    expected = mujocos(model, driven_names(robot), q, qd, qdd)
    np.testing.assert_allclose(torques(robot, q, qd, qdd), expected, rtol=0, atol=1e-9)


# Origins and inertias turned, anchors and axes off the frames, references, springs, laws of every kind, three
# joints on one body, a rail, bodies without joints between and behind, gravity that is not along an axis.
ARM = """<mujoco model="arm"><compiler angle="radian" autolimits="true"/>
<option gravity="1 -2 -9"/>
<worldbody><body name="pedestal" pos="0.1 0.2 0.5" euler="0.3 -0.2 1">
  <inertial pos="0 0 0" mass="80" diaginertia="1 1 1"/>
  <body name="a" pos="0 0.1 0.4" euler="0.1 0.2 -0.3"><joint name="A" type="hinge" axis="0 1 2"
      pos="0.02 0.03 -0.01" range="-2 1.5" ref="0.3" armature="0.7" damping="0.4" frictionloss="1.1"
      stiffness="3" springref="0.9"/>
    <inertial pos="0.1 0.02 0.3" quat="1 0.2 -0.3 0.5" mass="4" diaginertia="0.3 0.2 0.4"/>
    <body name="cover" pos="0.2 0 0.1" euler="1 0 0">
      <inertial pos="0.05 0 0" mass="0.7" fullinertia="0.01 0.02 0.015 0.001 -0.002 0.003"/></body>
    <body name="b" pos="0.3 0 0.1" euler="0 0.4 0">
      <joint name="B1" type="hinge" axis="1 0 0" pos="0 0.1 0" damping="0.2 0.05 0.01" armature="0.01"/>
      <joint name="B2" type="slide" axis="0 0.6 -0.8" ref="-0.1" frictionloss="2" stiffness="50"/>
      <joint name="B3" type="hinge" axis="0 0 1" pos="0.05 0 0.02"/>
      <inertial pos="0 0.1 0.1" mass="2" diaginertia="0.03 0.02 0.04"/>
      <body name="spacer" pos="0 0 0.2" euler="0 0 2">
        <inertial pos="0 0 0.1" mass="0.5" diaginertia="0.01 0.01 0.01"/>
        <body name="c" pos="0.1 0 0.2"><joint name="C" type="hinge" axis="-1 2 0.5" stiffness="0.4"
            springref="-1"/>
          <inertial pos="0.02 0 0.15" mass="1.2" diaginertia="0.01 0.02 0.015"/>
          <body name="flange" pos="0 0.1 0.3" euler="0.5 0 0">
            <inertial pos="0 0 0.02" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/>
            <site name="tcp" pos="0 0 0.1" euler="0 0.7 0"/></body></body></body></body></body></body>
</worldbody>
<actuator><motor name="m" joint="A" gear="20" armature="0.001" damping="0.002" forcerange="-5 4"/>
  <motor joint="C" forcerange="-7 7"/></actuator>
</mujoco>"""


def test_inverse_dynamics_are_mujocos(tmp_path: Path) -> None:
    robot = load(tmp_path, ARM)
    assert driven_names(robot) == ["A", "B1", "B2", "B3", "C"]
    assert {e.effect for e in robot.torque_effects} == {
        *("coulomb", "viscous", "viscous_law", "spring", "current_offset")
    }
    assert_same_torques(ARM, robot)


@pytest.mark.parametrize("tip", ["flange", "tcp"])
def test_frames_are_mujocos(tmp_path: Path, tip: str) -> None:
    robot = load(tmp_path, ARM, tip)
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    for q in np.random.default_rng(2).uniform(-2, 2, (20, 5)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        place = data.body(tip) if tip == "flange" else data.site(tip)
        found = np.array(truing.forward_kinematics(robot, q))[-1]
        np.testing.assert_allclose(found[:3, 3], place.xpos, rtol=0, atol=1e-13)
        np.testing.assert_allclose(found[:3, :3], place.xmat.reshape(3, 3), rtol=0, atol=1e-13)


def test_limits_in_the_wrong_order_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(ARM.replace('range="-2 1.5"', 'range="1.5 -2"'))
    with pytest.raises(InputError, match="^[^:]+: joint '.*': its range is 1.5 to -2, expected the lower"):
        truing.load_robot(path)


def test_ranges_limits_and_names_come_over(tmp_path: Path) -> None:
    robot = load(tmp_path, ARM)
    first = robot.joint("A")
    assert robot.name == "arm"
    assert (first.lower, first.upper, first.offset, first.torque_limit) == (-2.0, 1.5, -0.3, 100.0)
    assert first.rotor_inertia == pytest.approx(0.7 + 400 * 0.001, rel=1e-15)
    assert robot.joint("C").torque_limit == 7.0
    assert robot.joint("B2").type == "prismatic" and robot.joint("B2").upper == np.inf
    assert robot.joint("B1").mass == 0.0  # of several joints on one body the last one carries it
    assert robot.joint("A").mass == pytest.approx(4.7)  # with its cover


def test_a_robot_that_came_from_mjcf_survives_in_yaml(tmp_path: Path) -> None:
    robot = load(tmp_path, ARM)
    truing.save_robot(tmp_path / "robot.yaml", robot)
    again = truing.load_robot(tmp_path / "robot.yaml")
    q, qd, qdd = motion(robot, 20, 3)
    np.testing.assert_allclose(torques(again, q, qd, qdd), torques(robot, q, qd, qdd), rtol=0, atol=1e-12)


def test_gravity_is_turned_into_the_base_that_is_named(tmp_path: Path) -> None:
    whole, part = load(tmp_path, ARM), load(tmp_path, ARM, base="pedestal")
    assert np.linalg.norm(part.gravity - whole.gravity) > 1.0
    q, qd, qdd = motion(whole, 20, 4)
    np.testing.assert_allclose(torques(part, q, qd, qdd), torques(whole, q, qd, qdd), rtol=0, atol=1e-12)
    still = load(tmp_path, ARM.replace("<option ", '<option><flag gravity="disable"/></option><option '))
    assert np.array_equal(still.gravity, np.zeros(3))


@pytest.mark.realdata
@pytest.mark.parametrize("name", ["dyn_so101", "dyn_xl330"])
def test_inverse_dynamics_of_published_models_are_mujocos(name: str) -> None:
    path = Path(os.environ.get("TRUING_REALDATA", "")) / name / "robot.xml"
    if not path.exists():
        pytest.skip(f"{name} is not there: set TRUING_REALDATA to the folder of recordings")
    assert_same_torques(path.read_text(), truing.load_robot(path))


def test_a_robot_from_mjcf_is_calibrated_like_any_other(tmp_path: Path) -> None:
    """Its file is no URDF, so that none is written."""
    path, out = tmp_path / "robot.xml", tmp_path / "out"
    path.write_text(ARM.replace('frictionloss="2"', 'frictionloss="2" range="0 1"'))
    assert main(["simulate", str(path), "--poses", "60", "--out", str(out)]) == 0
    data = str(out / "measurements.csv")
    assert main(["identify", str(path), data, "--tip-link", "tcp", "--out", str(tmp_path / "found")]) == 0
    found = truing.load_robot(tmp_path / "found" / "robot.yaml")
    assert len(found.torque_effects) == len(load(tmp_path, ARM).torque_effects)
    assert not (tmp_path / "found" / "robot.urdf").exists()


# ---- Branches, followers -------------------------------------------------------------------------

JAW = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="l1"><joint name="J1" axis="0 1 0"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
    <body name="l2" pos="0.4 0 0"><joint name="J2" axis="0 1 0"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="left" pos="0.2 0.05 0" euler="0 0 1"><joint name="L" axis="0 0 1" ref="0.2"/>
        <inertial pos="0.05 0 0" mass="0.3" diaginertia="1e-4 2e-4 3e-4"/></body>
      <body name="right" pos="0.2 -0.05 0"><joint name="R" type="slide" axis="0 1 0"/>
        <inertial pos="0.05 0 0" mass="0.4" diaginertia="1e-4 2e-4 3e-4"/></body></body></body>
</worldbody>EXTRA</mujoco>"""


def test_of_several_ends_one_must_be_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"2 branches end, at 'left', 'right': name the tip \(--tip-link"):
        load(tmp_path, JAW.replace("EXTRA", ""))


def test_a_moving_branch_is_merged_as_it_stands_and_said(tmp_path: Path) -> None:
    text = JAW.replace("EXTRA", "")
    robot = load(tmp_path, text, tip="l2", warns="'left' moves off the chain.*; 'right' moves off the chain")
    assert driven_names(robot) == ["J1", "J2"]
    assert robot.joint("J2").mass == pytest.approx(1.7)
    assert_same_torques(text, robot)
    through = load(tmp_path, text, tip="left", warns="'right' moves off the chain")
    assert_same_torques(text, through)


def test_of_several_ends_the_only_chain_with_motors_is_taken(tmp_path: Path) -> None:
    motors = "<actuator><motor joint='J1'/><motor joint='J2'/></actuator>"
    assert driven_names(load(tmp_path, JAW.replace("EXTRA", motors), warns="moves off")) == ["J1", "J2"]
    all_motors = "<actuator><motor joint='J1'/><motor joint='L'/><motor joint='R'/></actuator>"
    with pytest.raises(InputError, match="name the tip"):
        load(tmp_path, JAW.replace("EXTRA", all_motors))


def test_of_several_ends_that_with_the_only_site_is_taken(tmp_path: Path) -> None:
    text = JAW.replace("EXTRA", "").replace(
        '<body name="left"', '<site name="tcp" pos="0.3 0 0"/><body name="left"'
    )
    robot = load(tmp_path, text, warns="moves off")
    assert driven_names(robot) == ["J1", "J2"]
    np.testing.assert_allclose(robot.targets[0].T_last_target[:3, 3], [0.3, 0, 0], atol=1e-15)


def test_a_joint_equality_makes_a_passive_joint(tmp_path: Path) -> None:
    """q2 - ref2 = 0.1 - 1.5 (q1 - ref1); what the follower needs, the other feels."""
    text = """<mujoco><compiler angle="radian"/><worldbody>
      <body name="l1"><joint name="J1" axis="0 1 0" ref="0.2" damping="0.1"/>
        <inertial pos="0.1 0 0.02" mass="1" diaginertia="0.01 0.02 0.03"/>
        <body name="l2" pos="0.4 0 0"><joint name="J2" axis="0.6 0.8 0" ref="-0.3" armature="0.05"
            damping="0.2 0.03 0.01" frictionloss="0.7" stiffness="2" springref="0.5"/>
          <inertial pos="0.1 0 0.1" mass="1" diaginertia="0.01 0.02 0.03"/></body></body>
      </worldbody><equality><joint joint1="J2" joint2="J1" polycoef="0.1 -1.5 0 0 0"/></equality></mujoco>"""
    robot = load(tmp_path, text)
    assert driven_names(robot) == ["J1"]
    assert list(robot.joint("J2").driven_by) == [("J1", -1.5)]
    q, qd, qdd = motion(robot, 100, 5)
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
    both = [
        np.hstack([q, -0.3 + 0.1 - 1.5 * (q - 0.2)]),
        np.hstack([qd, -1.5 * qd]),
        np.hstack([qdd, -1.5 * qdd]),
    ]
    expected = mujocos(model, ["J1", "J2"], *both) @ [1.0, -1.5]  # virtual work
    np.testing.assert_allclose(torques(robot, q, qd, qdd)[:, 0], expected, rtol=0, atol=1e-9)


def test_a_joint_that_is_held_is_part_of_its_link(tmp_path: Path) -> None:
    held = "<equality><joint joint1='J2' polycoef='0.4 0 0 0 0'/></equality>"
    text = JAW.replace("EXTRA", held)
    robot = load(tmp_path, text, tip="left", warns="'right'")
    assert driven_names(robot) == ["J1", "L"]
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
    q, qd, qdd = motion(robot, 50, 6)
    stretched = [np.insert(q, 1, 0.4, axis=1), np.insert(qd, 1, 0.0, axis=1), np.insert(qdd, 1, 0.0, axis=1)]
    expected = mujocos(model, ["J1", "J2", "L"], *stretched)[:, [0, 2]]
    np.testing.assert_allclose(torques(robot, q, qd, qdd), expected, rtol=0, atol=1e-9)


# ---- What is refused, what is warned of ----------------------------------------------------------


@pytest.mark.parametrize("bodies", ["body1='lead' body2='l2'", "body1='l2' body2='lead'"])
def test_a_mocap_body_that_leads_the_hand_is_left_out_and_said(tmp_path: Path, bodies: str) -> None:
    led = JAW.replace("</worldbody>", "<body name='lead' mocap='true'/></worldbody>")
    led = led.replace("EXTRA", f"<equality><weld {bodies}/></equality>")
    robot = load(tmp_path, led, tip="l2", warns="mocap body 'lead' leads 'l2': not read")
    assert driven_names(robot) == ["J1", "J2"]
    assert_same_torques(JAW.replace("EXTRA", ""), robot)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '<joint name="J1" axis="0 1 0"/>',
            '<freejoint name="root"/>',
            "'root' is free: a floating base is not read",
        ),
        ('<joint name="J1" axis="0 1 0"/>', '<joint name="J1" type="ball"/>', "'J1' is a ball"),
        (
            "EXTRA",
            "<equality><connect body1='left' body2='l1' anchor='0 0 0'/></equality>",
            "`connect` between 'left' and 'l1' closes a loop",
        ),
        (
            "EXTRA",
            "<equality><weld body1='left'/></equality>",
            "`weld` between 'left' and the world closes a loop",
        ),
        (
            "EXTRA",
            "<equality><joint joint1='J2' joint2='J1' polycoef='0 1 0.5 0 0'/></equality>",
            "'J2' follows another by a polynomial of higher order",
        ),
        (
            "EXTRA",
            "<equality><joint joint1='J2' joint2='R'/></equality>",
            "'J2' follows 'R', which does not move between base and tip",
        ),
        ("mass=", "mas=", "not an MJCF that MuJoCo .* takes: .*mas"),
        ("</worldbody>", "", "not an MJCF that MuJoCo"),
        ('name="J2"', 'name="base"', "'base'.*rename it"),
    ],
)
@pytest.mark.filterwarnings("ignore::truing.InputWarning")
def test_what_cannot_be_read_is_said(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in JAW
    path = tmp_path / "robot.xml"
    path.write_text(JAW.replace(old, new, 1).replace("EXTRA", ""))
    with pytest.raises(InputError, match=message) as error:
        truing.load_robot(path, tip_link="left")
    assert str(error.value).startswith(f"{path}: ") and "\n" not in str(error.value)


@pytest.mark.parametrize("old", ["mass=", "ref="])
@pytest.mark.filterwarnings("ignore::truing.InputWarning")
def test_numbers_that_are_none_leave_no_file_of_mujoco(
    tmp_path: Path, old: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert old in JAW
    Path("robot.xml").write_text(re.sub(old + "(['\"])[^'\"]*", old + r"\1nan", JAW.replace("EXTRA", "")))
    with contextlib.suppress(InputError):
        truing.load_robot("robot.xml", tip_link="left")
    assert [path.name for path in Path.cwd().iterdir()] == ["robot.xml"]


@pytest.mark.parametrize(
    ("base", "tip", "message"),
    [
        ("", "hand", "tip 'hand' does not exist; the bodies are world, l1, l2, left, right"),
        ("foot", "left", "base body 'foot' does not exist; the bodies are world, l1"),
        ("l2", "l1", "tip 'l1' is not below base 'l2'"),
    ],
)
def test_base_and_tip_must_be_there(tmp_path: Path, base: str, tip: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(tmp_path, JAW.replace("EXTRA", ""), tip, base)


def test_a_loop_within_a_branch_does_not_matter(tmp_path: Path) -> None:
    loop = "<equality><connect body1='left' body2='right' anchor='0 0 0'/></equality>"
    load(tmp_path, JAW.replace("EXTRA", loop), tip="l2", warns="moves off the chain")


BALL = """<mujoco><worldbody>GROUND
  <body name="l1" pos="0 0 1"><joint name="J1" axis="0 1 0"/>
    <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
    <body name="l2" pos="0.4 0 0"><joint name="J2" axis="0 1 0"/>
      <geom type="sphere" size="0.05" COLLIDES/></body></body>
</worldbody></mujoco>"""


def test_contacts_are_ignored_with_a_warning_where_geoms_can_collide(tmp_path: Path) -> None:
    ground = BALL.replace("GROUND", '<geom type="plane" size="1 1 1"/>')
    load(
        tmp_path,
        ground.replace("COLLIDES", ""),
        warns="geoms may collide .*'l1' and the world.*contacts are ignored",
    )
    # A link and its neighbour are no pair, nor is what MuJoCo is told to leave out.
    for text in (
        BALL.replace("GROUND", "").replace("COLLIDES", ""),
        BALL.replace("GROUND", "").replace("COLLIDES", 'contype="0" conaffinity="0"'),
        ground.replace("COLLIDES", "").replace(
            "<worldbody>", '<option><flag contact="disable"/></option><worldbody>'
        ),
    ):
        robot = load(tmp_path, text)
        assert robot.joint("J2").mass == pytest.approx(1000 * 4 / 3 * np.pi * 0.05**3, rel=1e-12)


def test_what_forces_are_left_out_is_said(tmp_path: Path) -> None:
    text = JAW.replace("EXTRA", "").replace('name="l2"', 'name="l2" gravcomp="1"')
    load(
        tmp_path,
        text.replace("<worldbody>", '<option density="1"/><worldbody>'),
        "l2",
        warns="gravcomp.*density",
    )


def test_a_model_whose_meshes_are_not_there_is_read_where_inertials_are_stated(tmp_path: Path) -> None:
    mesh = '<asset><mesh name="m" file="gone.stl"/></asset>'
    text = ARM.replace("<worldbody>", mesh + "<worldbody>").replace(
        '<body name="cover" pos="0.2 0 0.1" euler="1 0 0">',
        '<body name="cover" pos="0.2 0 0.1" euler="1 0 0"><geom type="mesh" mesh="m"/>',
    )
    assert_same_torques(ARM, load(tmp_path, text))
    first = text.index('<inertial pos="0.1 0.02 0.3"')
    with pytest.raises(InputError, match="gone.stl"):
        load(tmp_path, text[:first] + text[text.index("/>", first) + 2 :])


def test_a_urdf_in_a_file_called_xml_is_still_a_urdf(tmp_path: Path) -> None:
    text = """<?xml version="1.0"?><!-- <mujoco> --><robot name="r"><link name="l0"/><link name="l1"/>
      <joint name="j" type="continuous"><parent link="l0"/><child link="l1"/></joint></robot>"""
    assert load(tmp_path, text).joints[0].name == "j"


def test_without_mujoco_the_message_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r'pip install "truing\[dynamics\]"'):
        load(tmp_path, ARM)
    assert main(["plan", str(tmp_path / "robot.xml"), "--out", str(tmp_path / "out")]) == 2
    assert 'pip install "truing[dynamics]"' in capsys.readouterr().err
