# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The calibrated robot as a simulator's model: what the written model computes is what the robot says."""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yaml
from numpy.typing import NDArray

import truing
from truing.dynamics import Recording, predict
from truing.dynamics.export import Exported, Simulator, coupling_matrix, export, set_readings
from truing.dynamics.export.lever import lever_for
from truing.model import AppliedEffect, Joint, Robot, forward_kinematics, robot_from_urdf

Floats = NDArray[np.float64]


def applied(effect: str, **parameters: float) -> AppliedEffect:
    """applied("viscous", J1=2.0) and applied("viscous_law", J1__cubic=2.0)."""
    full = {f"{effect}.{key.replace('__', '.')}": value for key, value in parameters.items()}
    return AppliedEffect(effect, sorted({key.split("__")[0] for key in parameters}), full)


def body(rng: np.random.Generator) -> dict[str, Any]:
    """Mass, centre and inertia of a cloud of points."""
    points = rng.normal(size=(12, 3)) * 0.1 + rng.normal(size=3) * 0.1
    mass = float(rng.uniform(1.0, 5.0))
    center = points.mean(axis=0)
    spread = np.cov(points.T, bias=True)
    return {
        "mass": mass,
        "center_of_mass": center,
        "inertia": mass * (np.trace(spread) * np.eye(3) - spread),
    }


def arm(convention: str, seed: int = 1) -> Robot:
    """Four joints, one of them a slide, with ratios, zeros and a tool."""
    rng = np.random.default_rng(seed)
    joints = []
    for k in range(4):
        common = {
            "type": "prismatic" if k == 2 else "revolute",
            "ratio": (1.0, -1.02, 0.99, 1.0)[k],
            "offset": float(rng.normal(scale=0.1)),
            "rotor_inertia": float(rng.uniform(0.1, 0.5)),
            **body(rng),
        }
        if convention == "urdf":
            axis = rng.normal(size=3)
            T = np.eye(4)
            T[:3, :3] = pin.exp3(rng.normal(size=3))
            T[:3, 3] = rng.normal(size=3) * 0.3
            joints.append(Joint(f"J{k + 1}", T_parent_joint=T, axis=axis / np.linalg.norm(axis), **common))
        else:
            links = dict(zip(("theta", "d", "a", "alpha", "beta"), rng.normal(size=5) * 0.5, strict=True))
            joints.append(Joint(f"J{k + 1}", **links, **common))
    tool = np.eye(4)
    tool[:3, 3] = [0.1, 0.2, 0.3]
    return Robot(
        "an arm",
        joints=joints,
        convention=convention,  # type: ignore[arg-type]
        gravity=[0.5, -1.0, -9.7],
        targets=[truing.Target("tool", T_last_target=tool)],
    )


def pinocchio_torques(robot: Robot, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """Rigid torques at the readings, by Pinocchio, from link frames that forward_kinematics gives."""
    frames = [np.eye(4), *forward_kinematics(robot, np.zeros_like(q))[:-1]]
    steps = [np.linalg.inv(a) @ np.array(b) for a, b in zip(frames[:-1], frames[1:], strict=True)]
    model = pin.Model()
    parent, before = 0, np.eye(4)
    for joint, step in zip(robot.joints, steps, strict=True):
        # DH moves first and then goes along the link; the others end at the joint, whose zero is in `step`.
        place, after = (before, step) if robot.convention == "dh" else (before @ step, np.eye(4))
        axis = np.array(joint.axis) if robot.convention == "urdf" else np.array([0.0, 0.0, 1.0])
        kind = (
            pin.JointModelPrismaticUnaligned(axis)
            if joint.type == "prismatic"
            else pin.JointModelRevoluteUnaligned(axis)
        )
        parent = model.addJoint(parent, kind, pin.SE3(place), joint.name)
        inertia = pin.Inertia(joint.mass, np.array(joint.center_of_mass), np.array(joint.inertia))
        model.appendBodyToJoint(parent, inertia, pin.SE3(after))
        before = after
    model.gravity.linear = np.array(robot.gravity)
    ratio = np.array([joint.ratio for joint in robot.joints])
    torque = pin.rnea(model, model.createData(), ratio * q, ratio * qd, ratio * qdd)
    rotors = np.array([joint.rotor_inertia for joint in robot.joints])
    return np.asarray(ratio * torque + rotors * qdd)


def mujoco_torques(exported: Exported, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """What the drives of the written model must give at the readings, dry friction apart."""
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS | mujoco.mjtDisableBit.mjDSBL_EQUALITY
    data = mujoco.MjData(model)
    C = coupling_matrix(exported.chain)
    set_readings(exported.chain, model, data, q)
    dofs = [model.joint(link.name).dofadr[0] for link in exported.chain.links]
    data.qvel[dofs] = C @ qd
    mujoco.mj_forward(model, data)
    passive = data.qfrc_actuator.copy()
    data.qacc[dofs] = C @ qdd
    mujoco.mj_inverse(model, data)
    return np.asarray(C.T @ (data.qfrc_inverse - passive)[dofs])


def states(count: int, joints: int, seed: int = 5) -> list[Floats]:
    return list(np.random.default_rng(seed).uniform(-1.5, 1.5, size=(count, 3, joints)))


SMOOTH = [
    applied("viscous", J1=3.0, J2=4.0, J3=5.0, J4=1.0),
    applied("viscous_law", J1__quadratic=0.7, J2__cubic=0.3),
    applied("current_offset", J1=0.4, J3=-2.0),
    applied("spring", J2=11.0, J4=-3.0),
    applied("ripple", J1__sin2=0.3, J1__cos2=-0.2, J1__sin7=0.1, J4__cos3=0.5),
    applied("armature", J4=0.3, J2=0.1),
    applied("coulomb", J1=5.0, J2=6.0),
]


def smooth_torques(q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """The laws of SMOOTH, written out; dry friction apart."""
    out = np.array([3.0, 4.0, 5.0, 1.0]) * qd
    out[0] += 0.7 * qd[0] * abs(qd[0]) + 0.4
    out[0] += 0.3 * np.sin(2 * q[0]) - 0.2 * np.cos(2 * q[0]) + 0.1 * np.sin(7 * q[0])
    out[1] += 0.3 * qd[1] ** 3 + 11.0 * q[1] + 0.1 * qdd[1]
    out[2] += -2.0
    out[3] += -3.0 * q[3] + 0.5 * np.cos(3 * q[3]) + 0.3 * qdd[3]
    return np.asarray(out)


@pytest.mark.parametrize("convention", ["dh", "mdh", "urdf"])
def test_the_written_model_needs_the_robots_torques(tmp_path: Path, convention: str) -> None:
    robot = arm(convention).replace(torque_effects=SMOOTH)
    exported = export(robot, "mjcf", tmp_path / "model")
    assert exported.not_written == ()
    assert exported.callbacks is None
    for q, qd, qdd in states(20, 4):
        expected = pinocchio_torques(robot, q, qd, qdd) + smooth_torques(q, qd, qdd)
        found = mujoco_torques(exported, q, qd, qdd)
        assert np.abs(found - expected).max() < 1e-9 * (1.0 + np.abs(expected).max())


def test_dry_friction_is_written_and_holds(tmp_path: Path) -> None:
    robot = arm("urdf").replace(torque_effects=[applied("coulomb", J2=6.0)], gravity=[0.0, 0.0, 0.0])
    exported = export(robot, "mjcf", tmp_path)
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    assert model.dof_frictionloss[1] == pytest.approx(6.0 / 1.02)
    assert np.all(model.dof_solref[:, 0] == 0.004)
    data = mujoco.MjData(model)
    data.ctrl[1] = 5.0
    mujoco.mj_step(model, data, 500)
    held = abs(data.qpos[1])
    assert held < 1e-5  # with MuJoCo's own solimpfriction it creeps a thousand times as far
    data.ctrl[1] = 7.0
    mujoco.mj_step(model, data, 500)
    assert abs(data.qpos[1]) > 50.0 * held


def test_payload_and_link_changes_are_in_the_bodies(tmp_path: Path) -> None:
    robot = arm("dh")
    changes = [
        AppliedEffect("payload", ["J4"], {"payload.m": 0.5, "payload.mx": 0.02, "payload.mz": 0.03}),
        applied("link_inertia", J2__m=0.3, J2__mx=0.01, J2__xx=0.2, J2__yy=0.2, J2__zz=0.2, J2__xy=0.01),
    ]
    exported = export(robot.replace(torque_effects=changes), "mjcf", tmp_path)
    assert exported.not_written == ()
    changed = robot.copy()
    for name, m, h, change in (
        ("J4", 0.5, [0.02, 0.0, 0.03], np.zeros((3, 3))),
        (
            "J2",
            0.3,
            [0.01, 0.0, 0.0],
            np.diag([0.2, 0.2, 0.2]) + 0.01 * np.eye(3)[[1, 0, 2]] * [[1], [1], [0]],
        ),
    ):
        joint = changed.joint(name)
        old, c = joint.mass or 0.0, np.array(joint.center_of_mass)
        about_origin = np.array(joint.inertia) + old * (c @ c * np.eye(3) - np.outer(c, c)) + change
        new = (old * c + h) / (old + m)
        joint.mass, joint.center_of_mass = old + m, new
        joint.inertia = about_origin - (old + m) * (new @ new * np.eye(3) - np.outer(new, new))
    for q, qd, qdd in states(10, 4):
        expected = pinocchio_torques(changed, q, qd, qdd)
        assert np.abs(mujoco_torques(exported, q, qd, qdd) - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_body_that_cannot_exist_is_changed_as_little_as_possible_and_named(tmp_path: Path) -> None:
    robot = arm("dh")
    robot.joint("J3").inertia = np.diag([0.1, 0.1, 0.3])  # more than 0.1 + 0.1 about z
    exported = export(robot, "mjcf", tmp_path)
    (item,) = exported.not_written
    assert item.name == "inertia.J3"
    assert item.size > 0.0
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    moments = np.sort(model.body("J3_link").inertia)
    assert moments == pytest.approx([0.15, 0.15, 0.3], rel=1e-6)
    assert model.body("J3_link").mass[0] == robot.joint("J3").mass


def test_a_joint_that_follows_two_others_does_so(tmp_path: Path) -> None:
    robot = arm("urdf", seed=3)
    joints = [joint.copy() for joint in robot.joints]
    joints[2] = joints[2].replace(type="revolute", ratio=1.0, rotor_inertia=0.0)
    leads = {"J2": -1.0, "J3": 0.5}
    joints[3] = joints[3].replace(offset=0.03, ratio=1.0, rotor_inertia=0.0, driven_by=leads)
    robot = robot.replace(joints=joints)
    exported = export(robot, "mjcf", tmp_path)
    free = robot.replace(joints=[*joints[:3], joints[3].replace(driven_by=[], offset=0.0)])
    C = np.vstack([np.eye(3), [0.0, -1.0 * joints[1].ratio, 0.5]])
    zero = -joints[1].offset + 0.5 * joints[2].offset + joints[3].offset
    for q, qd, qdd in states(5, 3):
        all_q = C @ q
        all_q[3] += zero
        expected = C.T @ pinocchio_torques(free, all_q, C @ qd, C @ qdd)
        assert mujoco_torques(exported, q, qd, qdd) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    follows = -data.qpos[1] + 0.5 * data.qpos[2]
    assert abs(data.qpos[1]) > 0.01
    assert data.qpos[3] == pytest.approx(follows, abs=2e-3)


def test_presliding_bends_like_a_bristle_and_then_slides(tmp_path: Path) -> None:
    effects = [applied("presliding", J1=2.0, J1__x0=1e-3), applied("stribeck", J1=1.0, J1__vs=0.1)]
    exported = export(arm("urdf").replace(torque_effects=effects), "mjcf", tmp_path)
    assert exported.not_written == ()
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    data = mujoco.MjData(model)
    work = 0.0
    for speed, level, steps in (
        (-1e-3, 3.0, 14000),
        (1e-3, 3.0, 14000),
        (0.1, 2.0 + np.exp(-1.0), 500),
        (2.0, 2.0, 50),
    ):
        for _ in range(steps):
            data.qpos[:], data.qvel[:] = 0.0, [speed, 0.0, 0.0, 0.0]
            mujoco.mj_step(model, data)
            if speed == 1e-3:
                work += (3.0 - -data.qfrc_actuator[0]) * speed * model.opt.timestep
        assert data.qfrc_actuator[0] == pytest.approx(-np.sign(speed) * level, rel=2e-3)
    # A reversal costs as much work less as with the stop operator, whose x0 grows with the level.
    assert work == pytest.approx(2.0 * 3.0 * 1e-3 * 1.5, rel=0.02)


def load(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location("callbacks_of_a_test", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


BESIDE = [
    applied("coulomb", J1=1.0, J2=0.5),
    applied("load_friction", J1=0.1, J1__links=0.2),
    applied("position_friction", J2__sin=0.2, J2__cos=-0.1),
    applied("viscous_law", J4__root=0.7),
    applied("viscous_law", J4__saturating=0.4, J4__v0=0.2),
    applied("asymmetric_friction", J1=0.3),
    applied("thermal_friction", J1__coulomb=0.01, J1__viscous=0.02),
    applied("warmup", J2__coulomb=0.001, J2__viscous=0.002),
    applied("coupling", J3__J4__viscous=0.6),
]


def test_callbacks_have_the_laws_that_mujoco_lacks(tmp_path: Path) -> None:
    exported = export(arm("urdf").replace(torque_effects=BESIDE), "mjcf", tmp_path)
    assert exported.callbacks is not None
    beside = load(exported.callbacks)
    rng = np.random.default_rng(0)
    q, qd, drive, links = rng.normal(size=(4, 30, 4))
    dry = beside.dry_friction(q, qd, drive, temperature=35.0, time=100.0, links=links)
    v = np.abs(qd)
    of_load = 0.1 * np.abs(drive[:, 0]) + 0.2 * np.abs(links[:, 0])
    assert dry[:, 0] == pytest.approx(1.0 + of_load + 0.01 * 15.0)
    second = 0.5 + 0.2 * np.sin(q[:, 1]) - 0.1 * np.cos(q[:, 1]) + 0.001 * 100.0
    assert dry[:, 1] == pytest.approx(second)
    assert dry[:, 3] == pytest.approx(0.7 * np.sqrt(v[:, 3]) + 0.4 * np.tanh(v[:, 3] / 0.2))
    smooth = beside.smooth_torques(q, qd, drive, temperature=35.0, time=100.0)
    assert smooth[:, 0] == pytest.approx(-0.3 * v[:, 0] - 0.02 * 15.0 * qd[:, 0])
    assert smooth[:, 1] == pytest.approx(-0.002 * 100.0 * qd[:, 1])
    assert smooth[:, 2] == pytest.approx(-0.6 * qd[:, 3])
    names = {item.name for item in exported.not_written}
    assert {"load_friction.J1", "position_friction.J2", "asymmetric_friction.J1", "coupling.J3.J4"} <= names
    listed = yaml.safe_load((tmp_path / "not_written.yaml").read_text(encoding="utf-8"))
    assert {item["name"] for item in listed["not_written"]} == names


@contextmanager
def with_callbacks(effects: list[AppliedEffect], folder: Path) -> Iterator[tuple[Any, Any]]:
    """Model and data of the arm without gravity, its callbacks installed."""
    robot = arm("urdf").replace(torque_effects=effects, gravity=[0.0, 0.0, 0.0])
    exported = export(robot, "mjcf", folder)
    assert exported.callbacks is not None
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    load(exported.callbacks).install(model)
    try:
        yield model, mujoco.MjData(model)
    finally:
        mujoco.set_mjcb_passive(None)


def test_installed_callbacks_hold_a_loaded_joint(tmp_path: Path) -> None:
    # Friction is 0.3 of the drive's torque and 1 Nm: it holds 1.2 Nm, and not 2 Nm.
    effects = [applied("load_friction", J1=0.3), applied("coulomb", J1=1.0)]
    with with_callbacks(effects, tmp_path) as (model, data):
        data.ctrl[0] = 1.2
        mujoco.mj_step(model, data, 300)
        held = abs(data.qpos[0])
        assert model.dof_frictionloss[0] == pytest.approx(1.0 + 0.3 * 1.2)
        data.ctrl[0] = 2.0
        mujoco.mj_step(model, data, 300)
        assert abs(data.qpos[0]) > 20.0 * held


def test_installed_callbacks_ask_mujoco_what_a_link_takes(tmp_path: Path) -> None:
    # A link that is pushed against 1 Nm takes what makes it faster, and not what friction and rotor take.
    effects = [
        applied("load_friction", J1__links=0.3),
        applied("coulomb", J1=1.0),
        applied("armature", J1=2.0),
    ]
    with with_callbacks(effects, tmp_path) as (model, data):
        data.ctrl[0] = 4.0
        mujoco.mj_step(model, data, 300)
        assert data.qfrc_constraint[0] == pytest.approx(-model.dof_frictionloss[0], rel=1e-3)
        left = 4.0 + data.qfrc_constraint[0] + data.qfrc_passive[0]
        link = left - data.qacc[0] * model.dof_armature[0]
        assert link > 0.1
        assert model.dof_frictionloss[0] == pytest.approx(1.0 + 0.3 * link, rel=1e-3)


def test_a_coupling_that_acts_both_ways_is_a_tendon(tmp_path: Path) -> None:
    both = [
        applied("viscous", J1=3.0, J4=2.0),
        applied("armature", J1=0.3, J4=0.2),
        applied("coupling", J1__J4__viscous=-1.5, J1__J4__inertia=0.1),
        applied("coupling", J4__J1__viscous=-1.5, J4__J1__inertia=0.1),
    ]
    robot = arm("mdh").replace(torque_effects=both)
    exported = export(robot, "mjcf", tmp_path)
    assert exported.not_written == () and exported.callbacks is None
    for q, qd, qdd in states(10, 4):
        expected = pinocchio_torques(robot, q, qd, qdd)
        expected[0] += 3.0 * qd[0] - 1.5 * qd[3] + 0.3 * qdd[0] + 0.1 * qdd[3]
        expected[3] += 2.0 * qd[3] - 1.5 * qd[0] + 0.2 * qdd[3] + 0.1 * qdd[0]
        assert mujoco_torques(exported, q, qd, qdd) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_tool_force_acts_on_the_tool(tmp_path: Path) -> None:
    force = np.array([3.0, -2.0, 5.0])
    effect = AppliedEffect(
        "tool_force", [], dict(zip(("tool_force.x", "tool_force.y", "tool_force.z"), force, strict=True))
    )
    robot = arm("urdf").replace(torque_effects=[effect])
    exported = export(robot, "mjcf", tmp_path)

    def tool(q: Floats) -> Floats:
        return np.array(forward_kinematics(robot, q)[-1])[:3, 3]

    for q, qd, qdd in states(5, 4):
        rigid = pinocchio_torques(robot, q, qd, qdd)
        J = np.array([(tool(q + d) - tool(q - d)) / 2e-6 for d in 1e-6 * np.eye(4)])
        found = mujoco_torques(exported, q, qd, qdd)
        assert found - rigid == pytest.approx(J @ force, abs=1e-6)


def test_a_tilted_base_is_another_gravity(tmp_path: Path) -> None:
    tilt = np.array([0.02, -0.05, 0.0])
    robot = arm("urdf")
    tilted = robot.replace(
        torque_effects=[AppliedEffect("base_tilt", [], {"base_tilt.x": tilt[0], "base_tilt.y": tilt[1]})]
    )
    other = robot.replace(gravity=np.array(robot.gravity) - np.cross(tilt, robot.gravity))
    exported = export(tilted, "mjcf", tmp_path)
    assert exported.not_written == ()
    for q, qd, qdd in states(5, 4):
        expected = pinocchio_torques(other, q, qd, qdd)
        assert mujoco_torques(exported, q, qd, qdd) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert "base_tilt" in [one.name for one in export(tilted, "urdf", tmp_path / "urdf").not_written]


def test_what_belongs_to_the_measurement_is_said_and_not_written(tmp_path: Path) -> None:
    effects = [
        applied("motor_constant", J1=0.1),
        applied("torque_lag", J1=0.01),
        AppliedEffect("time_offset", [], {"time_offset": 0.01}),
        applied("backlash", J2=1e-3),
        applied("joint_elasticity", J2=1e-5),
        AppliedEffect("my_own", ["J1"], {"my_own.J1": 1.0}),
    ]
    plain = export(arm("urdf"), "mjcf", tmp_path / "plain")
    exported = export(arm("urdf").replace(torque_effects=effects), "mjcf", tmp_path / "effects")
    assert {item.name for item in exported.not_written} == {
        "motor_constant.J1",
        "torque_lag.J1",
        "time_offset",
        "backlash.J2",
        "joint_elasticity.J2",
        "my_own",
    }
    assert exported.model.read_text(encoding="utf-8") == plain.model.read_text(encoding="utf-8")


@pytest.mark.parametrize("to", ["mjcf", "urdf"])
def test_friction_that_fades_at_rest_is_said_with_what_the_torques_lose(
    tmp_path: Path, to: Simulator
) -> None:
    robot = arm("urdf")
    time = np.arange(0.0, 12.0, 0.01)
    position = np.zeros((time.size, len(robot.driven_joints())))
    for begin, way in ((0.0, 0.5), (4.0, -0.7), (8.0, 0.5)):  # in a second, then at rest
        s = np.clip(time - begin, 0.0, 1.0)
        position[:, 0] += way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    motion = Recording("rests", time=time, position=position, torque=np.zeros_like(position))
    constants = {"J1": 3.0, "J1__turn_travel": 1e-4}
    lasting = robot.replace(torque_effects=[applied("coulomb", **constants)])
    fading = robot.replace(torque_effects=[applied("coulomb", **constants, J1__turn_fade=1.0)])
    lost = predict(fading, motion).torque - predict(lasting, motion).torque
    left = {item.name: item for item in export(fading, to, tmp_path / to, recordings=[motion]).not_written}
    item = left.pop("coulomb.J1.turn_fade")
    assert "holds a resting joint" in item.reason
    # Of other filters: a bristle of 0.1 mrad feels what is left of a motion where it ends.
    assert item.size == pytest.approx(np.sqrt(np.mean(lost[:, 0] ** 2)), rel=0.15)
    assert item.size > 1.0
    lasts = export(lasting, to, tmp_path / "lasting", recordings=[motion])
    assert {item.name for item in lasts.not_written} == set(left)


def test_urdf_written_anew_is_the_same_robot(tmp_path: Path) -> None:
    base = arm("mdh")
    joints = [joint.replace(ratio=1.0, rotor_inertia=0.0, speed_limit=2.0) for joint in base.joints]
    effects = [applied("viscous", J1=3.0), applied("coulomb", J1=5.0), applied("armature", J2=0.2)]
    robot = base.replace(joints=joints, torque_effects=effects, gravity=[0.0, 0.0, -9.81])
    exported = export(robot, "urdf", tmp_path)
    text = exported.model.read_text(encoding="utf-8")
    assert 'damping="3.0" friction="5.0"' in text
    assert [item.name for item in exported.not_written] == ["armature.J2"]
    model = pin.buildModelFromXML(text)
    assert model.names[1] == "J1" and model.nv == 4
    again = robot_from_urdf(text)
    for q, qd, qdd in states(10, 4):
        assert np.array(forward_kinematics(again, q)[-1]) == pytest.approx(
            np.array(forward_kinematics(robot, q)[-1]), abs=1e-9
        )
        in_urdf = (
            q
            if model.nq == 4
            else np.concatenate([[np.cos(v), np.sin(v)] if k != 2 else [v] for k, v in enumerate(q)])
        )
        expected = pinocchio_torques(robot, q, qd, qdd)
        assert pin.rnea(model, model.createData(), in_urdf, qd, qdd) == pytest.approx(
            expected, rel=1e-8, abs=1e-8
        )


SOURCE = """<?xml version="1.0"?>
<robot name="two">
  <link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <link name="upper"><inertial><mass value="2"/><origin xyz="0 0 0.1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><inertial><mass value="0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="J1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="100" velocity="2"/></joint>
  <joint name="J2" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>
    <origin xyz="0 0 0.4"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
  <joint name="F" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0 0 0.3"/></joint>
</robot>
"""


def two_links() -> Robot:
    robot = robot_from_urdf(SOURCE)
    joints = [
        joint.replace(inertia=0.1 * np.eye(3), speed_limit=2.0 + k, torque_limit=100.0 / (k + 1))
        for k, joint in enumerate(robot.joints)
    ]
    return robot.replace(joints=joints)


def test_a_source_urdf_keeps_its_looks_and_gets_the_calibration(tmp_path: Path) -> None:
    (tmp_path / "source.urdf").write_text(SOURCE, encoding="utf-8")
    robot = two_links().replace(torque_effects=[applied("coulomb", J1=2.0)])
    robot.joint("J2").offset = 0.05
    exported = export(robot, "urdf", tmp_path / "out", source=tmp_path / "source.urdf")
    text = exported.model.read_text(encoding="utf-8")
    assert "<box" in text and 'friction="2.0"' in text and "Calibrated by truing" in text
    again = robot_from_urdf(text, "base", "tip")
    q = np.array([0.3, -0.4])
    assert np.array(forward_kinematics(again, q)[-1]) == pytest.approx(
        np.array(forward_kinematics(robot, q)[-1]), abs=1e-9
    )
    for old, new in zip(robot.joints, again.joints, strict=True):
        assert new.mass == pytest.approx(old.mass)
        assert np.array(new.center_of_mass) == pytest.approx(np.array(old.center_of_mass))


def test_isaac_lab_gets_actuators_and_a_urdf(tmp_path: Path) -> None:
    effects = [
        applied("coulomb", J1=5.0, J2=1.0),
        applied("stribeck", J1=1.0, J1__vs=0.1),
        applied("presliding", J2=2.0, J2__x0=0.01),
        applied("viscous", J1=3.0),
        applied("armature", J1=0.4),
        applied("load_friction", J1=0.1),
    ]
    exported = export(two_links().replace(torque_effects=effects), "isaaclab", tmp_path)
    tree = ast.parse(exported.model.read_text(encoding="utf-8"))
    tables = {node.targets[0].id: node.value for node in tree.body if isinstance(node, ast.Assign)}  # type: ignore[attr-defined]
    first = tables["ACTUATORS"].values[0]  # type: ignore[attr-defined]
    values = {keyword.arg: ast.literal_eval(keyword.value) for keyword in first.keywords}
    assert first.func.id == "ImplicitActuatorCfg"
    assert values["joint_names_expr"] == ["J1"]
    assert values["armature"] == 0.4 and values["viscous_friction"] == 3.0
    assert values["friction"] == pytest.approx(values["dynamic_friction"] + 1.0)
    assert values["dynamic_friction"] > 5.0  # the mean of load friction is in it
    assert values["effort_limit_sim"] == 100.0 and values["velocity_limit_sim"] == 2.0
    assert len(tables["DC_MOTORS"].values) == 2  # type: ignore[attr-defined]
    assert {"load_friction.J1", "stribeck.J1", "presliding.J2"} == {
        item.name for item in exported.not_written
    }
    assert (tmp_path / "two.urdf").is_file()


def test_bad_input_is_one_clear_message_and_leaves_nothing(tmp_path: Path) -> None:
    robot = arm("urdf")
    out = tmp_path / "out"
    with pytest.raises(
        truing.InputError, match="'gazebo' is not known, expected one of mjcf, urdf, isaaclab"
    ):
        export(robot, "gazebo", out)  # type: ignore[arg-type]
    with pytest.raises(
        truing.InputError, match="J9, which has no reading; joints with one are J1, J2, J3, J4"
    ):
        export(robot.replace(torque_effects=[applied("coulomb", J9=1.0)]), "mjcf", out)
    with pytest.raises(truing.InputError, match="presliding.J1.x0 is missing, expected a positive number"):
        export(robot.replace(torque_effects=[applied("presliding", J1=1.0)]), "mjcf", out)
    with pytest.raises(
        truing.InputError, match="viscous_law of J1 has a parameter that ends in 'fifth', expected quad"
    ):
        export(robot.replace(torque_effects=[applied("viscous_law", J1__fifth=1.0)]), "mjcf", out)
    with pytest.raises(
        truing.InputError, match="ripple of J1 has a parameter that ends in 'tan2', expected sin1"
    ):
        export(robot.replace(torque_effects=[applied("ripple", J1__tan2=1.0)]), "mjcf", out)
    with pytest.raises(truing.InputError, match="link_inertia is of J9; joints are J1, J2, J3, J4"):
        export(robot.replace(torque_effects=[applied("link_inertia", J9__m=1.0)]), "mjcf", out)
    with pytest.raises(truing.InputError, match="coulomb.J1 is nan, expected a finite number"):
        export(robot.replace(torque_effects=[applied("coulomb", J1=float("nan"))]), "mjcf", out)
    with pytest.raises(truing.InputError, match="no mass is known of the links of J2"):
        joints = [j.replace(mass=None) if j.name == "J2" else j for j in robot.joints]
        export(robot.replace(joints=joints), "mjcf", out)
    (tmp_path / "source.urdf").write_text(SOURCE, encoding="utf-8")
    with pytest.raises(truing.InputError, match="the source URDF has no joint J3"):
        export(robot, "urdf", out, source=tmp_path / "source.urdf")
    with pytest.raises(truing.InputError, match="source is not used for mjcf"):
        export(robot, "mjcf", out, source=tmp_path / "source.urdf")
    assert not out.exists()


def pendulum() -> Robot:
    """A turning column and a horizontal joint with a weight, whose reading goes the other way round."""
    weight = {"mass": 8.0, "center_of_mass": [0.0, 0.0, 0.4], "inertia": np.eye(3) * 0.05}
    column = {"mass": 5.0, "center_of_mass": [0.0, 0.0, 0.1], "inertia": np.eye(3) * 0.05}
    T = np.eye(4)
    T[:3, 3] = [0.1, 0.2, 0.5]
    return Robot(
        "pendulum",
        joints=[
            Joint("J1", axis=[0.0, 0.0, 1.0], **column),
            Joint("J2", T_parent_joint=T, axis=[0.0, 1.0, 0.0], ratio=-1.02, offset=0.3, **weight),
        ],
        convention="urdf",
        gravity=[0.0, 0.0, -9.81],
    )


def test_friction_by_the_load_of_an_upright_joint_is_that_of_a_tendon(tmp_path: Path) -> None:
    robot = pendulum().replace(torque_effects=[applied("coulomb", J2=2.0), applied("load_friction", J2=0.2)])
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 120.0, 0.04)  # so slow that the load is the weight
    waves = [rng.uniform(0.4, 1.2) * np.sin(w * time + rng.uniform(0, 6)) for w in (0.05, 0.1, 0.2, 0.35)]
    q = np.column_stack([0.3 * waves[0], sum(waves)])
    motion = Recording("motion", time=time, position=q, torque=np.zeros_like(q))
    motion = motion.replace(torque=predict(robot, motion).torque)
    exported = export(robot, "mjcf", tmp_path, recordings=[motion])
    (left,) = exported.not_written
    assert left.name == "load_friction.J2" and "tendon" in left.reason
    assert exported.refitted == () and exported.callbacks_model is not None
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    assert np.all(model.dof_damping >= 0.0)
    data = mujoco.MjData(model)

    def needed(angle: float, speed: float) -> float:
        set_readings(exported.chain, model, data, np.array([0.0, angle]))
        data.qvel[:] = [0.0, -1.02 * speed]
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        return float(-1.02 * data.qfrc_inverse[1])

    for angle in np.linspace(-2.0, 2.0, 9):
        held = 0.5 * (needed(angle, 1.0) - needed(angle, -1.0))
        weighs = abs(0.5 * (needed(angle, 1.0) + needed(angle, -1.0)))
        assert held == pytest.approx(2.0 + 0.2 * weighs, abs=0.5)  # 2 to 8 Nm; the load has friction, too
    flat = export(robot, "mjcf", tmp_path / "flat")  # no motion says what the joint's angles are
    assert "<spatial" not in flat.model.read_text(encoding="utf-8")


def test_a_lever_has_no_damping_that_pushes() -> None:
    """Friction that falls with the speed: damping below zero would drive the joint."""
    rng = np.random.default_rng(8)
    q, qd = rng.uniform(-2.0, 2.0, 500), rng.uniform(-2.0, 2.0, 500)
    lever = lever_for(5.0 + 3.0 * np.abs(np.sin(q - 0.5)) - 0.3 * np.abs(qd), q, qd)
    assert lever is not None
    assert lever.slope == 0.0 and lever.amplitude == pytest.approx(3.0, abs=0.1)
    assert lever.zero == pytest.approx(0.5, abs=0.05)
    assert lever_for(5.0 + 0.3 * np.abs(qd), q, qd) is None
