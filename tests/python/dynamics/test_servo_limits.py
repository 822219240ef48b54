# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servos at their largest torque, as MuJoCo has it: the controller's damping is within the limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.api import prepare, servo_diagnose
from truing.dynamics.servo.arm import servo_arm
from truing.dynamics.servo.export.held import held, uses_of
from truing.dynamics.servo.export.mjcf import write as write_mjcf
from truing.dynamics.servo.fit import rows_of
from truing.dynamics.servo.simulator import point_of

mujoco = pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
STEP = 0.01  # [s] between rows
SERVO = """<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="arm">
      <joint name="swing" axis="0 1 0" damping="0.05" frictionloss="0.03" armature="0.004"/>
      <inertial pos="0 0 -0.15" mass="0.4" diaginertia="1e-4 1e-4 1e-4"/>
    </body>
  </worldbody>
  <actuator><position joint="swing" kp="40" kv="1" {limit}/></actuator>
</mujoco>
"""


@pytest.fixture
def weak(tmp_path: Path) -> Path:
    path = tmp_path / "weak.xml"
    path.write_text(SERVO.format(limit='forcerange="-1 1"'), encoding="utf-8")
    return path


def moved_by_mujoco(path: Path) -> _core.Recording:
    """Steps of the command, and what MuJoCo makes of them with the file's own actuator."""
    time = STEP * np.arange(500)
    levels = np.random.default_rng(1).uniform(-0.9, 0.9, 12)
    command = levels[np.minimum((time / 0.6).astype(int), 11)]
    command[:20] = 0.0
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    position = np.empty((time.size, 1))
    for k, value in enumerate(command):
        position[k], data.ctrl[0] = data.qpos, value
        for _ in range(round(STEP / model.opt.timestep)):
            mujoco.mj_step(model, data)
    return _core.Recording("steps", time=time, position=position, command=command[:, None], test=False)


def test_a_servo_at_its_limit_moves_as_in_mujoco(weak: Path) -> None:
    of = prepare(weak, [moved_by_mujoco(weak)], window=np.inf)
    measured, point = rows_of(of.data, of.windows).measured, point_of(of.arm.nominal)
    assert point.value(0, "limited_damping") == pytest.approx(1.0 / 1.05)
    outside = point.with_value(0, "limited_damping", 0.0)  # the damping stays where the motor gives no more
    within, beyond = (
        np.degrees(np.std(measured - motion)) for motion in of.simulator.run([point, outside], of.windows)[0]
    )
    assert within < 0.2 and beyond > 10.0


@pytest.mark.parametrize("within", [1.0 / 1.05, 0.0])
def test_the_groundwork_finds_where_damping_is_at_the_largest_torque(weak: Path, within: float) -> None:
    one = moved_by_mujoco(weak)
    of = prepare(weak, [one], window=np.inf)
    truth = point_of(of.arm.nominal).with_value(0, "limited_damping", within)
    motion = of.simulator.run([truth.with_value(0, "command_gain", 30.0)], of.windows)[0][0]
    position = np.concatenate([np.asarray(one.position[:1]), motion])[: len(one)]
    found = servo_diagnose(weak, [one.replace(position=position)], window=np.inf, max_effects=0)
    assert found.chains["standard"].drives[0].limited_damping == pytest.approx(within)
    assert found.chains["standard"].drives[0].command_gain == pytest.approx(30.0, rel=0.1)
    assert any("largest torque" in warning for warning in found.warnings) == (within == 0.0)


def test_damping_without_a_limit_is_that_of_the_joint(tmp_path: Path) -> None:
    path = tmp_path / "strong.xml"
    path.write_text(SERVO.format(limit=""), encoding="utf-8")
    drive = servo_arm(path).nominal.drives[0]
    assert drive.limited_damping == 0.0 and drive.viscous == pytest.approx(1.05)


def test_what_is_within_the_limit_is_written_there(weak: Path) -> None:
    chain = servo_arm(weak).nominal
    uses = uses_of(chain, [])
    text, left = write_mjcf(chain, held(chain, uses), uses, weak)
    model = mujoco.MjModel.from_xml_string(text)
    assert not left
    assert -model.actuator_biasprm[0, 2] == pytest.approx(1.0)
    assert np.ravel(model.dof_damping[0])[0] == pytest.approx(0.05)
    assert model.actuator_forcerange[0] == pytest.approx([-1.0, 1.0])
