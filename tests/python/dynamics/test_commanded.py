# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""MJCF with servos, driven by recorded commands: a model repeats the motion of the robot that it is, and
`truing dynamics compare` finds the worse of two."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from truing.cli import main
from truing.dynamics.commanded import CommandRunner, command_kind, commanded_mjcf, commanded_track
from truing.dynamics.comparison import compare
from truing.errors import InputError, InputWarning
from truing.files import write_table

Floats = NDArray[np.float64]

ROWS, RATE = 600, 50.0
SERVOS = """
<mujoco model="two_servos">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="upper" pos="0 0 0.3">
      <joint name="shoulder" axis="0 1 0" damping="0.1" armature="0.01" frictionloss="0.04"
             solreffriction="0.004" ref="{ref}"/>
      <inertial pos="0.1 0 0" mass="0.2" diaginertia="1e-4 3e-4 3e-4"/>
      <body name="lower" pos="0.2 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.08" armature="0.01"/>
        <inertial pos="0.08 0 0" mass="0.1" diaginertia="1e-5 1e-4 1e-4"/>
        <body name="jaw" pos="0.1 0 0">
          <joint name="jaw" axis="1 0 0" damping="0.01" armature="0.001"/>
          <inertial pos="0.01 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="u_jaw" joint="jaw" kp="1"/>
    {first}
    <pid name="u2" joint="elbow" kp="{kp}" kv="0.3" ki="2" slewmax="2.5" input="pos" forcerange="-2 2"/>
  </actuator>
</mujoco>
"""
DELAYED = (
    '<position name="u1" joint="shoulder" kp="14" kv="0.4" delay="0.03" nsample="17" interp="linear"'
    ' gear="2"/>'
)


def servos(folder: Path, name: str, kp: float = 9.0, ref: float = 0.0, first: str = DELAYED) -> Path:
    path = folder / f"{name}.xml"
    path.write_text(SERVOS.format(kp=kp, ref=ref, first=first), encoding="utf-8")
    return path


def commands(seed: int) -> Floats:
    """Waypoints, each held, and a sine; shape=(rows, 2) [rad]."""
    rng = np.random.default_rng(seed)
    points = np.repeat(rng.uniform(-0.7, 0.7, size=(ROWS // 60, 2)), 60, axis=0)
    return points + 0.1 * np.sin(np.arange(ROWS) / 9.0)[:, None]


def record(path: Path, name: str, command: Floats, power: float = 1.0) -> truing.dynamics.Recording:
    """The motion of a model, stepped one by one with the command of each row held.

    power: of the gear by which a command is multiplied to be the actuator's (of positions 1, of torques -1).
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    joints = [model.joint(one).qposadr[0] for one in ("shoulder", "elbow")]
    controls = [model.actuator(one).id for one in ("u1", "u2")]
    gear = model.actuator_gear[controls, 0] ** power
    steps = round(1.0 / RATE / model.opt.timestep)
    position = np.empty_like(command)
    for k, row in enumerate(command):
        position[k] = data.qpos[joints]
        data.ctrl[controls] = gear * row
        mujoco.mj_step(model, data, steps)
    return truing.dynamics.Recording(
        name, time=np.arange(len(command)) / RATE, position=position, command=command
    )


def robot_of(path: Path) -> truing.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # the jaw is off the chain
        return truing.load_robot(path, tip_link="lower", any_tool=True)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[truing.dynamics.Recording]:
    path = servos(tmp_path_factory.mktemp("truth"), "truth", ref=0.2)
    return [record(path, f"motion{k}", commands(k)) for k in range(2)]


def written(folder: Path, recordings: list[truing.dynamics.Recording]) -> str:
    for one in recordings:
        columns: dict[str, Any] = {"t_s": one.time}
        for j in range(2):
            columns[f"q{j + 1}_rad"], columns[f"u{j + 1}_rad"] = one.position[:, j], one.command[:, j]
        write_table(folder / f"{one.name}.csv", columns)
    return str(folder / "motion*.csv")


def test_a_model_repeats_its_own_motion_with_delay_rate_limit_gear_and_zero(
    tmp_path: Path, recordings: list[truing.dynamics.Recording]
) -> None:
    # From the middle of the motion: commands on their way, a setpoint whose rate is limited, its integral.
    path = servos(tmp_path, "truth", ref=0.2)
    model = commanded_mjcf(path, robot_of(path), "position")
    track, free = commanded_track(recordings[0], model.robot, 0.05)
    assert free.all()
    ahead, starts = np.array([0.02, 0.1, 0.5]), np.array([3.7, 5.1, 7.0])
    found = CommandRunner(model, [track]).run(starts, np.zeros(3, dtype=np.intp), ahead)
    for k, start in enumerate(starts):
        expected = recordings[0].position[np.round((start + ahead) * RATE).astype(int)]
        np.testing.assert_allclose(found[k], expected, atol=2e-3)


def test_a_delay_begins_with_the_commands_that_are_on_their_way(tmp_path: Path) -> None:
    path = servos(tmp_path, "truth")
    model = commanded_mjcf(path, robot_of(path), "position")
    ahead = np.array([0.018, 0.06])
    found = []
    for step in (0.0, 0.5):
        command = np.zeros((100, 2))
        command[50:, 0] = step  # at 1.0 s
        recording = truing.dynamics.Recording(
            "step", time=np.arange(100) / RATE, position=np.zeros((100, 2)), command=command
        )
        track, _ = commanded_track(recording, model.robot, 0.05)
        found.append(CommandRunner(model, [track]).run(np.array([1.01]), np.zeros(1, dtype=np.intp), ahead))
    moved = (found[1] - found[0])[0, :, 0]
    assert moved[0] == 0.0  # 28 ms after the step, of a delay of 30 ms
    assert moved[1] > 0.01


def test_the_worse_servo_ends_with_1_and_the_same_one_with_0(
    tmp_path: Path, recordings: list[truing.dynamics.Recording], capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad = servos(tmp_path, "good", ref=0.2), servos(tmp_path, "bad", kp=4.0, ref=0.2)
    files = written(tmp_path, recordings)
    common = [files, "--tip-link", "lower", "--out"]
    assert main(["dynamics", "compare", str(good), str(bad), *common, str(tmp_path / "worse")]) == 1
    assert "worse than MODEL_A by more than 5 %" in capsys.readouterr().err
    result = json.loads((tmp_path / "worse" / "result.json").read_text())
    assert (result["driven_by"], result["nearer"], result["torque"]) == ("commands", "A", {})
    assert result["rollout"]["horizon_s"] == [0.1, 0.5, 2.0, 5.0]
    joints = result["ratios"][-1]["joints"]
    assert joints["elbow"] > 1.2 and joints["elbow"] > joints["shoulder"]
    page = (tmp_path / "worse" / "report.html").read_text(encoding="utf-8")
    assert "recorded commands" in page and "commanded" in page

    assert main(["dynamics", "compare", str(bad), str(good), *common, str(tmp_path / "better")]) == 0
    assert json.loads((tmp_path / "better" / "result.json").read_text())["nearer"] == "B"
    assert main(["dynamics", "compare", str(good), str(good), *common, str(tmp_path / "same")]) == 0
    assert json.loads((tmp_path / "same" / "result.json").read_text())["nearer"] == "neither"


def test_rows_with_drives_off_are_not_simulated(
    tmp_path: Path, recordings: list[truing.dynamics.Recording]
) -> None:
    path = servos(tmp_path, "good", ref=0.2)
    model = commanded_mjcf(path, robot_of(path), "position")
    enabled = (np.arange(ROWS) < ROWS // 2).astype(float)
    half = recordings[0].replace(columns={"enabled": enabled})
    found = compare(model, model, [half], horizons=(0.5,))
    assert found.judgement.windows.starts.max() + 0.5 <= 0.5 * ROWS / RATE + 1e-9


def test_torque_commands_drive_motors(tmp_path: Path) -> None:
    motors = servos(tmp_path, "motors", first='<motor name="u1" joint="shoulder" gear="3"/>')
    text = motors.read_text().replace("<pid", "<motor").replace('kp="9.0" kv="0.3" ki="2" slewmax="2.5"', "")
    motors.write_text(text.replace('input="pos"', ""), encoding="utf-8")
    torque = 0.05 * commands(3)
    recording = record(motors, "free", torque, power=-1.0)
    named = truing.dynamics.Recording(
        "free", time=recording.time, position=recording.position, torque_command=torque
    )
    assert command_kind([named]) == "torque"
    model = commanded_mjcf(motors, robot_of(motors), "torque")
    track, _ = commanded_track(named, model.robot, 0.05)
    found = CommandRunner(model, [track]).run(np.array([2.0]), np.zeros(1, dtype=np.intp), np.array([0.1]))
    np.testing.assert_allclose(found[0, 0], recording.position[105], atol=5e-3)
    with pytest.raises(InputError, match="expected one position servo"):
        commanded_mjcf(motors, robot_of(motors), "position")


def test_what_cannot_be_compared_is_refused(
    tmp_path: Path,
    recordings: list[truing.dynamics.Recording],
    capsys: pytest.CaptureFixture[str],
) -> None:
    good = servos(tmp_path, "good")
    files = written(tmp_path, recordings)
    yaml = tmp_path / "arm.yaml"
    truing.save_robot(yaml, robot_of(good))
    out = tmp_path / "out"
    assert main(["dynamics", "compare", str(yaml), str(yaml), files, "--out", str(out)]) == 2
    assert "expected an MJCF with an actuator at every joint" in capsys.readouterr().err
    assert not out.exists()
    torques = recordings[0].replace(name="other", torque=np.zeros((ROWS, 2)))
    with pytest.raises(InputError, match="take recordings of one kind"):
        command_kind([recordings[0], torques])
    nothing = recordings[0].replace(name="bare", command=None)
    with pytest.raises(InputError, match="nor a command"):
        command_kind([nothing])


def test_recordings_marked_as_test_are_those_that_count(
    tmp_path: Path, recordings: list[truing.dynamics.Recording]
) -> None:
    good, bad = servos(tmp_path, "good", ref=0.2), servos(tmp_path, "bad", kp=4.0, ref=0.2)
    files = written(tmp_path, recordings)
    held = tmp_path / "motion1.csv"
    head, *rows = held.read_text().splitlines()
    held.write_text("\n".join([f"{head},set", *(f"{row},test" for row in rows)]) + "\n")
    common = [files, "--tip-link", "lower", "--out", str(tmp_path / "out")]
    assert main(["dynamics", "compare", str(bad), str(good), *common]) == 0
    assert json.loads((tmp_path / "out" / "result.json").read_text())["recordings"] == ["motion1"]
