# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servos far from what their file says, and slow motion: where a fit begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.api import LONGEST_STEP, prepare, servo_diagnose
from truing.dynamics.servo.fit import Fitter, rows_of
from truing.dynamics.servo.scatter import best_of, narrowed, scattered, spread
from truing.dynamics.servo.simulator import FIELDS, Point, point_of

pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
STEP = 1.0 / 30.0  # [s] between rows
COUNT = 2.0 * np.pi / 4096  # [rad] of the encoder
STIFF = """<mujoco>
  <worldbody>
    <body name="arm">
      <joint name="lift" axis="0 1 0" damping="0.6" frictionloss="0.05" armature="0.028"/>
      <inertial pos="0 0 0.15" mass="0.5" diaginertia="1e-3 1e-3 1e-3"/>
    </body>
  </worldbody>
  <actuator><position joint="lift" kp="998" kv="2.7" forcerange="-3.35 3.35"/></actuator>
</mujoco>
"""
SOFT = {"command_gain": 18.0, "viscous": 1.2, "coulomb": 0.1, "limited_damping": 0.0}


def hands(number: int) -> Floats:
    """Somebody who leads an arm from place to place, and rests there. shape=(n, 1) [rad]"""
    time = STEP * np.arange(450)
    places = np.random.default_rng(number).uniform(-1.2, 1.2, 9)
    at, part = np.divmod(time / 2.0, 1.0)
    x = np.clip(part / 0.6, 0.0, 1.0)
    smooth = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    k = at.astype(int)
    return np.asarray(places[k] + (places[k + 1] - places[k]) * smooth)[:, None]


def soft_recordings(path: Path) -> list[_core.Recording]:
    out = []
    for number in range(3):
        time, command = STEP * np.arange(450), hands(number)
        rest = _core.Recording(f"r{number}", time=time, position=command, command=command, test=False)
        of = prepare(path, [rest], window=np.inf)
        point = point_of(of.arm.nominal)
        for name, value in SOFT.items():
            point = point.with_value(0, name, value)
        motion = of.simulator.run([point], of.windows)[0][0]
        position = np.concatenate([command[:1], motion])[: len(rest)]
        out.append(rest.replace(position=np.round(position / COUNT) * COUNT))
    return out


@pytest.fixture
def stiff(tmp_path: Path) -> Path:
    path = tmp_path / "stiff.xml"
    path.write_text(STIFF, encoding="utf-8")
    return path


def test_numbers_are_spread_evenly() -> None:
    numbers = spread(512, 4)
    assert numbers.shape == (512, 4) and 0.0 <= numbers.min() and numbers.max() < 1.0
    counts = np.histogram2d(numbers[:, 0], numbers[:, 3], bins=8, range=[[0, 1], [0, 1]])[0]
    assert counts.min() >= 4 and counts.max() <= 12  # eight each


def test_draws_hold_what_servos_may_be(stiff: Path) -> None:
    nominal = point_of(prepare(stiff, soft_recordings(stiff)).arm.nominal)
    drawn = scattered(nominal, np.array([0.012]))
    assert all(isinstance(one, Point) for one in drawn)
    gains = np.array([one.value(0, "command_gain") for one in drawn])
    assert gains.min() < 1.0 and gains.max() > 1e3
    kept = [FIELDS.index(name) for name in ("saturation", "limited_damping", "delay", "zero")]
    assert all(np.array_equal(one.chain[:, kept], nominal.chain[:, kept]) for one in drawn)


def test_narrower_draws_come_nearer(stiff: Path) -> None:
    of = prepare(stiff, soft_recordings(stiff), window=np.inf)
    fitter = Fitter(Apart(of.simulator, LONGEST_STEP), rows_of(of.data, of.windows))
    nominal = point_of(of.arm.nominal).with_value(0, "limited_damping", 0.0)
    drawn = scattered(nominal, np.array([0.012]))
    first, last = best_of(fitter, drawn, 1)[0], narrowed(fitter, drawn)
    errors = [np.std(fitter.errors(motion)) for motion in fitter.motions([first, last])]
    assert errors[1] < 0.5 * errors[0]


def test_a_soft_servo_is_found_from_the_file_of_a_stiff_one(stiff: Path) -> None:
    found = servo_diagnose(stiff, soft_recordings(stiff), window=np.inf, max_effects=0)
    drive = found.chains["standard"].drives[0]
    assert drive.command_gain == pytest.approx(18.0, rel=0.05)
    assert drive.viscous == pytest.approx(1.2, rel=0.05)
    assert drive.coulomb == pytest.approx(0.1, rel=0.3)
