# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A servo's chain as files: an MJCF that moves as the robot it was recorded from; what it lacks, by name."""

from __future__ import annotations

import ast
import json
import math
import warnings
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

import truing
from pages import visible
from truing.cli import main
from truing.dynamics.commanded import CommandRunner, commanded_mjcf, commanded_track
from truing.dynamics.servo.arm import servo_arm
from truing.dynamics.servo.chain import ServoChain, ServoJoint
from truing.dynamics.servo.data import Window, servo_data
from truing.dynamics.servo.export import export_servo
from truing.dynamics.servo.export.fitted import at_firmware, firmware_of, fitted_without
from truing.dynamics.servo.export.held import drive_torque, held, uses_of
from truing.dynamics.servo.export.verified import judge_servo
from truing.dynamics.servo.simulator import Simulator, point_of
from truing.errors import InputError, InputWarning
from truing.files import commanded_columns, write_table
from truing.report.json_text import to_json

Floats = NDArray[np.float64]

ROWS, RATE = 500, 50.0
ARM = """
<mujoco model="two_servos">
  <compiler angle="radian"/>
  <option timestep="0.005"/>
  <default><joint damping="1" frictionloss="0.3" armature="0.02"/><position kp="900" kv="3"/></default>
  <worldbody>
    <body name="upper" pos="0 0 0.3">
      <joint name="shoulder" axis="0 1 0" range="-1.5 1.5"/>
      <inertial pos="0.1 0 0" mass="0.2" diaginertia="1e-4 3e-4 3e-4"/>
      <body name="lower" pos="0.2 0 0">
        <joint name="elbow" axis="0 1 0" range="-2 2"/>
        <inertial pos="0.08 0 0" mass="0.1" diaginertia="1e-5 1e-4 1e-4"/>
        <site name="tip" pos="0.15 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="m1" joint="shoulder" gear="2" ctrlrange="-3 3" forcerange="-9 9"/>
    <position name="m2" joint="elbow" ctrlrange="-2 2"/>
  </actuator>
  <keyframe><key name="home" qpos="0.1 0.2" ctrl="0.1 0.2"/></keyframe>
</mujoco>
"""
TRUTH = """
<mujoco><compiler angle="radian"/>
<option timestep="0.002" integrator="implicitfast" gravity="0 0 -12.753"/><worldbody>
  <body name="upper" pos="0 0 0.3">
    <joint name="shoulder" axis="0 1 0" ref="0.2" damping="0.9 0.05" armature="0.012" frictionloss="0.03"
           solreffriction="0.004"/>
    <inertial pos="0.1 0 0" mass="0.2" diaginertia="1e-4 3e-4 3e-4"/>
    <body name="lower" pos="0.2 0 0">
      <joint name="elbow" axis="0 1 0" damping="0.4" armature="0.01"/>
      <inertial pos="0.08 0 0" mass="0.1" diaginertia="1e-5 1e-4 1e-4"/>
    </body>
  </body></worldbody>
  <actuator>
    <position name="m1" joint="shoulder" kp="30" delay="0.03" nsample="17" interp="linear"
              forcerange="-2.5 2.5"/>
    <pid name="m2" joint="elbow" kp="12" ki="3" slewmax="2.5" input="pos"/>
    <dcmotor name="f" joint="elbow" motorconst="0 0" resistance="1" input="none" lugre="15 0 0.03 0.045 0.2"/>
  </actuator>
</mujoco>
"""


def truth_chain() -> ServoChain:
    """What TRUTH is, as a diagnosis would say it of ARM."""
    shoulder = ServoJoint(
        command_gain=30.0,
        delay=0.03,
        viscous=0.9,
        viscous_law=0.05,
        coulomb=0.03,
        armature=0.012,
        saturation=2.5,
        zero=0.2,
    )
    elbow = ServoJoint(
        command_gain=12.0,
        integral_gain=3.0,
        rate_limit=2.5,
        viscous=0.4,
        coulomb=0.03,
        armature=0.01,
        stribeck=0.015,
        stribeck_speed=0.2,
        presliding=0.002,
    )
    return ServoChain(joints=("shoulder", "elbow"), prismatic=(False, False), drives=(shoulder, elbow))


def recorded() -> truing.dynamics.Recording:
    """TRUTH driven by held waypoints."""
    model = mujoco.MjModel.from_xml_string(TRUTH)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(5)
    command = np.repeat(rng.uniform(-0.6, 0.6, size=(ROWS // 50, 2)), 50, axis=0)
    command += 0.1 * np.sin(np.arange(ROWS) / 8.0)[:, None]
    position = np.empty_like(command)
    for k, row in enumerate(command):
        position[k] = data.qpos
        data.ctrl[:] = row
        mujoco.mj_step(model, data, round(1.0 / RATE / model.opt.timestep))
    time = np.arange(ROWS) / RATE
    return truing.dynamics.Recording("waypoints", time=time, position=position, command=command)


@pytest.fixture(scope="module")
def recording() -> truing.dynamics.Recording:
    return recorded()


@pytest.fixture
def source(tmp_path: Path) -> Path:
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    return tmp_path / "arm.xml"


def motion_errors(path: Path, recording: truing.dynamics.Recording) -> Floats:
    """Simulated less measured motion 2 s ahead of states that are steady enough to begin at. shape=(2,)"""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        robot = truing.load_robot(path, any_tool=True)
    model = commanded_mjcf(path, robot, "position")
    track, _ = commanded_track(recording, robot, 0.05)
    starts = np.array([1.8, 3.8, 5.8])
    ahead = np.arange(0.1, 2.0, 0.02)
    found = CommandRunner(model, [track]).run(starts, np.zeros(3, dtype=np.intp), ahead)
    rows = np.round((starts[:, None] + ahead) * RATE).astype(int)
    return np.asarray(np.sqrt(np.mean((found - np.asarray(recording.position)[rows]) ** 2, axis=(0, 1))))


def test_the_written_mjcf_moves_as_the_robot_that_the_chain_says(
    source: Path, tmp_path: Path, recording: truing.dynamics.Recording
) -> None:
    before = motion_errors(source, recording)
    chain = replace(truth_chain(), weight_scale=1.3)
    written = export_servo(chain, "mjcf", tmp_path / "out", source=source, recordings=[recording])
    assert written.model == "robot.xml" and written.not_written == ()
    after = motion_errors(tmp_path / "out" / "robot.xml", recording)
    assert (after < 0.003).all() and (after < 0.1 * before).all()
    export_servo(truth_chain(), "mjcf", tmp_path / "light", source=source, recordings=[recording])
    assert motion_errors(tmp_path / "light" / "robot.xml", recording)[0] > 10.0 * after[0]


def test_names_order_ranges_and_keyframes_of_the_source_stay(source: Path, tmp_path: Path) -> None:
    export_servo(truth_chain(), "mjcf", tmp_path / "out", source=source)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert [model.actuator(i).name for i in range(2)] == ["m1", "m2"]
    assert model.site("tip").id >= 0 and model.opt.timestep == pytest.approx(0.002)
    # Readings of the recorded robot are 0.2 above the model's: so are range, commands and the keyframe.
    np.testing.assert_allclose(model.jnt_range[0], [-1.3, 1.7])
    np.testing.assert_allclose(model.actuator_ctrlrange[0], [-1.3, 1.7])  # the gear of 2 is gone
    np.testing.assert_allclose(model.key_qpos[0], [0.3, 0.2])
    np.testing.assert_allclose(model.actuator_forcerange[0], [-2.5, 2.5])
    assert model.dof_frictionloss[1] == 0.0  # it is in the bristle


def test_weights_go_to_the_bodies_and_a_payload_is_a_body(source: Path, tmp_path: Path) -> None:
    chain = replace(
        truth_chain(),
        weight_scale=1.2,
        payload_mass=0.05,
        payload_place=(0.1, 0.0, 0.0),
        payload_body="lower",
        link_scale={"upper": 0.5},
    )
    export_servo(chain, "mjcf", tmp_path / "out", source=source)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    np.testing.assert_allclose(model.body_gravcomp[1:4], -0.2, atol=1e-9)
    assert model.body_mass[model.body("upper").id] == pytest.approx(0.1)
    payload = model.body("payload").id
    assert model.body_mass[payload] == pytest.approx(0.05)
    assert model.body(model.body_parentid[payload]).name == "lower"


def test_weight_at_one_joint_is_given_to_the_bodies_as_well_as_they_can(source: Path, tmp_path: Path) -> None:
    only_elbow = truth_chain().with_drive("elbow", gravity_scale=1.5)
    written = export_servo(only_elbow, "mjcf", tmp_path / "out", source=source)
    assert [item.name for item in written.not_written] == ["gravity_scale.elbow"]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = [0.2, 0.0]  # the model's zero: both links level
    mujoco.mj_forward(model, data)
    found = np.abs(data.qfrc_bias - data.qfrc_gravcomp)
    shoulder, elbow = 9.81 * (0.2 * 0.1 + 0.1 * 0.28), 9.81 * 0.1 * 0.08
    wanted, usual = np.array([shoulder, 1.5 * elbow]), np.array([shoulder, elbow])
    assert np.linalg.norm(found - wanted) < 0.75 * np.linalg.norm(usual - wanted)


def test_play_and_twist_are_a_further_hinge_where_the_encoder_is_on_the_motor(
    source: Path, tmp_path: Path
) -> None:
    chain = truth_chain().with_drive("elbow", backlash=0.04, elasticity=0.0, motor_encoder=1.0)
    export_servo(chain, "mjcf", tmp_path / "out", source=source)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    np.testing.assert_allclose(model.joint("elbow_play").range, [-0.02, 0.02])
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.0
    mujoco.mj_step(model, data, 1500)
    assert data.joint("elbow_play").qpos[0] == pytest.approx(0.02, abs=2e-3)  # the link lies on its stop
    behind = truth_chain().with_drive("elbow", backlash=0.04)
    left = export_servo(behind, "mjcf", tmp_path / "behind", source=source).not_written
    assert [item.name for item in left] == ["backlash.elbow"]


def test_what_no_servo_of_a_simulator_has_is_replaced_and_listed(
    source: Path, tmp_path: Path, recording: truing.dynamics.Recording
) -> None:
    drive = replace(
        truth_chain().drives[1],
        drive_law=0.6,
        drive_reference=0.5,
        load_friction=0.2,
        thermal_friction=0.01,
        back_emf=0.4,
    )
    chain = replace(truth_chain(), drives=(truth_chain().drives[0], drive))
    uses = uses_of(chain, [recording])
    values = held(chain, uses).joints["elbow"]
    error = uses["elbow"].error
    torque = drive_torque(drive, error)
    # No other gain is nearer over these errors.
    for gain in (0.9 * values.gain, 1.1 * values.gain):
        assert np.sum((torque - gain * error) ** 2) > np.sum((torque - values.gain * error) ** 2)
    assert values.friction == pytest.approx(0.03 + 0.2 * np.abs(torque).mean())
    written = export_servo(chain, "mjcf", tmp_path / "out", source=source, recordings=[recording])
    read = yaml.safe_load((tmp_path / "out" / "not_written.yaml").read_text())
    names = [item["name"] for item in read["not_written"]]
    laws = ("drive_law", "load_friction", "thermal_friction", "back_emf")
    assert set(names) == {f"{law}.elbow" for law in laws}
    sizes = {item.name: item.size for item in written.not_written}
    assert sizes["drive_law.elbow"] == pytest.approx(np.sqrt(np.mean((torque - values.gain * error) ** 2)))
    assert sizes["thermal_friction.elbow"] == pytest.approx(10 * 0.01 * 0.03)


def simulated(
    chain: ServoChain, source: Path, recording: truing.dynamics.Recording
) -> truing.dynamics.Recording:
    """The recording's commands, moved by a chain."""
    data = servo_data([recording.replace(test=False)], 2)
    whole = [Window(0, 0, len(data.streams[0].time) - 1)]
    motion = Simulator(servo_arm(source), data).run([point_of(chain)], whole)[0][0]
    position = np.concatenate([np.asarray(recording.position[:1]), motion])
    return recording.replace(position=position[: len(recording)])


def test_joints_that_lose_a_law_are_fitted_anew(source: Path, recording: truing.dynamics.Recording) -> None:
    chain = truth_chain().with_drive("elbow", load_friction=0.5, back_emf=0.5, presliding=0.0, stribeck=0.0)
    moved = simulated(chain, source, recording)
    nearest = held(chain, uses_of(chain, [moved]))
    found = fitted_without(chain, nearest, source, [moved])
    assert found.drive("elbow").load_friction == 0.0 and found.drive("elbow").back_emf == 0.0
    assert found.drives[0] == chain.drives[0]  # it loses nothing
    values = nearest.joints["elbow"]
    before = found.with_drive(
        "elbow",
        **{**vars(chain.drives[1]), "load_friction": 0.0, "back_emf": 0.0, "coulomb": values.friction},
    )
    errors = [
        np.std(np.asarray(simulated(one, source, moved).position - moved.position)[:, 1])
        for one in (before, found)
    ]
    assert errors[1] < 0.8 * errors[0]


def test_gains_are_those_at_the_firmwares_gain_that_the_arm_will_have(
    source: Path, tmp_path: Path, recording: truing.dynamics.Recording
) -> None:
    chain = replace(truth_chain(), gain_reference=100.0).with_drive("elbow", gain_law=0.5)
    used = recording.replace(columns={"kp_raw": np.full(len(recording), 400.0)})
    export_servo(chain, "mjcf", tmp_path / "out", source=source, used=[used])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert model.actuator_gainprm[0, 0] == pytest.approx(4.0 * 30.0)
    assert held(at_firmware(chain, 4.0), uses_of(chain, [])).joints["elbow"].gain == pytest.approx(2.0 * 12.0)
    # Several gains are none that a model could have.
    mixed = [used, used.replace(columns={"kp_raw": np.full(len(recording), 200.0)})]
    assert firmware_of(chain, mixed) == 1.0 and firmware_of(chain, [recording]) == 1.0
    text = (tmp_path / "out" / "not_written.yaml").read_text()
    assert "gains are those at the firmware's gain 400" in text


def test_a_torque_for_the_commands_speed_is_a_shorter_delay(source: Path) -> None:
    chain = truth_chain().with_drive("shoulder", damping_gain=0.3)
    values = held(chain, uses_of(chain, [])).joints["shoulder"]
    assert (values.delay, values.damping_gain) == (pytest.approx(0.03 - 0.3 / 30.0), 0.3)
    early = truth_chain().with_drive("shoulder", damping_gain=3.0)
    left = held(early, uses_of(early, []))
    assert left.joints["shoulder"].delay == 0.0
    assert [item.name for item in left.not_written] == ["damping_gain.shoulder"]


# ---- Isaac Lab, URDF, LeRobot ------------------------------------------------------------------------
def actuators(path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """actuators.py with stand-ins of Isaac Lab's configurations, which keep what they are given."""
    fake = ModuleType("isaaclab.actuators")
    for name in ("DelayedPDActuatorCfg", "DCMotorCfg"):
        setattr(fake, name, SimpleNamespace)
    import sys

    monkeypatch.setitem(sys.modules, "isaaclab", ModuleType("isaaclab"))
    monkeypatch.setitem(sys.modules, "isaaclab.actuators", fake)
    names: dict[str, Any] = {}
    exec(compile(path.read_text(), str(path), "exec"), names)
    return SimpleNamespace(**{key: value for key, value in names.items() if not key.startswith("__")})


def test_isaac_lab_gets_delayed_servos_and_motors(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = export_servo(truth_chain(), "isaaclab", tmp_path / "out", source=source)
    ast.parse((tmp_path / "out" / "actuators.py").read_text())
    module = actuators(tmp_path / "out" / "actuators.py", monkeypatch)
    shoulder = module.ACTUATORS["shoulder"]
    assert (shoulder.stiffness, shoulder.min_delay, shoulder.max_delay) == (30.0, 6, 6)  # of 5 ms
    assert module.delayed_pd(0.01)["shoulder"].max_delay == 3
    assert (shoulder.armature, shoulder.viscous_friction, shoulder.effort_limit) == (0.012, 0.9, 2.5)
    motor = module.DC_MOTORS["shoulder"]
    assert motor.velocity_limit == pytest.approx(2.5 / 0.9) and "elbow" not in module.DC_MOTORS
    assert (motor.damping, motor.viscous_friction) == (0.9, 0.0)  # what brakes is part of the motor's curve
    assert module.ACTUATORS["elbow"].friction == pytest.approx(0.045)
    names = {item.name for item in written.not_written}
    assert {"integral_gain.elbow", "rate_limit.elbow", "presliding.elbow", "viscous_law.shoulder"} == names


def test_a_urdf_gets_frames_friction_and_masses(source: Path, tmp_path: Path) -> None:
    chain = replace(truth_chain(), link_scale={"lower": 1.3})
    written = export_servo(chain, "urdf", tmp_path / "out", source=source)
    robot = truing.load_robot(tmp_path / "out" / written.model, any_tool=True)
    assert [joint.name for joint in robot.joints] == ["shoulder", "elbow"]
    assert robot.joints[1].mass == pytest.approx(0.13)
    # Where the recorded robot reads 0.2 the file's is at zero: the links are level.
    tip = truing.forward_kinematics(robot, np.array([0.2, 0.0]))[-1]
    assert np.asarray(tip)[2, 3] == pytest.approx(0.3, abs=1e-6)
    names = {item.name for item in written.not_written}
    assert {"command_gain.shoulder", "command_gain.elbow"} <= names


def test_lerobot_gets_zeros_as_moved_middles(tmp_path: Path, source: Path) -> None:
    motor = {"drive_mode": 0, "homing_offset": 5, "range_min": 1000, "range_max": 3000}
    file = tmp_path / "follower.json"
    file.write_text(json.dumps({"shoulder": {"id": 1, **motor}, "elbow": {"id": 2, **motor}}))
    export_servo(truth_chain(), "lerobot", tmp_path / "out", source=source, calibration=file)
    read = json.loads((tmp_path / "out" / "follower.json").read_text())
    counts = 0.2 / (2 * math.pi / 4095)
    middle = 0.5 * (read["shoulder"]["range_min"] + read["shoulder"]["range_max"])
    # A reading is (count - middle): with the middle moved up the robot reads 0.2 rad less, as the model does.
    assert middle - 2000 == pytest.approx(counts, abs=0.6)
    assert read["elbow"] == {"id": 2, **motor}
    offsets = json.loads((tmp_path / "out" / "offsets.json").read_text())
    assert offsets["shoulder"]["zero_deg"] == pytest.approx(math.degrees(0.2))
    export_servo(truth_chain(), "lerobot", tmp_path / "alone", source=source)
    assert not (tmp_path / "alone" / "follower.json").exists()


def test_what_cannot_be_written_is_refused(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    other = replace(truth_chain(), joints=("a", "b"))
    for chain, options, match in (
        (other, {"to": "mjcf"}, "has no joint a; its joints are shoulder, elbow"),
        (truth_chain(), {"to": "gazebo"}, "is not known"),
        (truth_chain(), {"to": "mjcf", "source": tmp_path / "not_written.xml"}, "does not take it"),
    ):
        given: dict[str, Any] = {"source": source, **options}
        with pytest.raises(InputError, match=match):
            export_servo(chain, out=out, **given)
        assert not out.exists()


# ---- The command -------------------------------------------------------------------------------------
@pytest.fixture
def result(source: Path, tmp_path: Path, recording: truing.dynamics.Recording) -> Path:
    """The folder that a diagnosis from commands leaves."""
    folder = tmp_path / "result"
    folder.mkdir()
    chains = {"nominal": truth_chain(), "named": replace(truth_chain(), weight_scale=1.3)}
    document = {
        "format": "truing-dynamics/1",
        "command": "diagnose",
        "from": "commands",
        "robot": "two servos",
        "chains": {name: chain.to_dict() for name, chain in chains.items()},
        "held_out": ["waypoints"],
    }
    (folder / "result.json").write_text(to_json(document))
    (folder / "arm.xml").write_text(servo_arm(source).mjcf)
    held_rows = [np.arange(ROWS) >= ROWS // 2]
    write_table(folder / "motion.parquet", commanded_columns([recording], (False, False), held_rows))
    return folder


def test_the_command_writes_runs_and_says_how_far_it_is_off(
    result: Path, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "model"
    arguments = ["dynamics", "export", str(result), "--source", str(source), "--out", str(out)]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "as it was" in said and "as written" in said and "model: " in said
    read = json.loads((out / "result.json").read_text())
    assert read["driven_by"] == "commands" and read["model"] == "robot.xml"
    errors = read["rollout"]["held_out"]
    assert errors["exported"]["shoulder"][-1] < 0.1 * errors["nominal"]["shoulder"][-1]
    page = visible((out / "report.html").read_text(encoding="utf-8"))
    assert "the written MJCF is off by" in page and "commanded" in page
    assert (out / "not_written.yaml").exists()

    assert main(["dynamics", "export", str(result), "--to", "lerobot", "--out", str(tmp_path / "zeros")]) == 0
    assert "shoulder" in json.loads((tmp_path / "zeros" / "offsets.json").read_text())
    # Without the source: the model of the result, without meshes.
    assert main(["dynamics", "export", str(result), "--out", str(tmp_path / "bare")]) == 0
    assert (tmp_path / "bare" / "robot.xml").exists()


def test_a_folder_that_lacks_something_is_refused(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (result / "arm.xml").unlink()
    out = tmp_path / "model"
    assert main(["dynamics", "export", str(result), "--out", str(out)]) == 2
    assert "arm.xml: cannot be read" in capsys.readouterr().err and not out.exists()
    yaml_robot = tmp_path / "robot.yaml"
    yaml_robot.write_text("format: truing-robot/1\n")
    assert main(["dynamics", "export", str(yaml_robot), "--to", "lerobot", "--out", str(out)]) == 2
    assert "expected the result of a diagnosis from commands" in capsys.readouterr().err


def test_the_chain_itself_is_judged_beside_what_is_written(
    source: Path, tmp_path: Path, recording: truing.dynamics.Recording
) -> None:
    chain = replace(truth_chain(), weight_scale=1.3)
    export_servo(chain, "mjcf", tmp_path / "out", source=source, recordings=[recording])
    models = {"exported": tmp_path / "out" / "robot.xml"}
    held_rows = np.arange(ROWS) >= ROWS // 2
    ours = (chain, servo_arm(source).mjcf)
    judged = judge_servo(models, chain.joints, [(recording, held_rows)], ours).judgement
    assert judged is not None and list(judged.simulated) == ["named", "exported"]
    # Two programs, one chain: they part where a bristle is modelled (the elbow), and where the chain's
    # integral begins with what it held before the recording, here wrong weight's, and MuJoCo's at zero.
    apart = np.sqrt(np.mean((judged.simulated["named"] - judged.simulated["exported"]) ** 2, axis=(0, 1)))
    assert apart[0] < math.radians(0.1) and apart[1] < math.radians(1.0)
    # With the masses of the file the chain is somewhere else.
    light = judge_servo(models, chain.joints, [(recording, held_rows)], (truth_chain(), ours[1])).judgement
    assert light is not None
    off = np.sqrt(np.mean((light.simulated["named"] - judged.simulated["named"]) ** 2, axis=(0, 1)))
    assert off[0] > 3.0 * apart[0]
