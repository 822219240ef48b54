# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands that are late at all joints of an arm, at one, or at none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo import ServoDiagnosis, servo_diagnose
from truing.dynamics.servo.api import prepare
from truing.dynamics.servo.candidates import BUS, Candidate
from truing.dynamics.servo.fit import Fitted, Noise
from truing.dynamics.servo.free import Free, Sizes, free_value
from truing.dynamics.servo.naming import Account, Namer, Sums, squares_of_folds
from truing.dynamics.servo.simulator import FIELDS, Point, point_of

pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
STEP = 0.02  # [s]
ENCODER = 1.5e-3  # [rad]
ARM = """<mujoco>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="turn" axis="0 0 1" damping="1.5" frictionloss="0.05" armature="0.04"/>
      <inertial pos="0.05 0 0" mass="0.8" diaginertia="2e-3 2e-3 2e-3"/>
      <body name="arm">
        <joint name="lift" axis="0 1 0" damping="1.2" frictionloss="0.05" armature="0.03"/>
        <inertial pos="0.1 0 0" mass="0.5" diaginertia="1e-3 1e-3 1e-3"/>
        <body name="hand" pos="0.2 0 0">
          <joint name="wrist" axis="0 1 0" damping="0.3" frictionloss="0.02" armature="0.01"/>
          <inertial pos="0.05 0 0" mass="0.2" diaginertia="2e-4 2e-4 2e-4"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="turn" kp="40"/><position joint="lift" kp="40"/><position joint="wrist" kp="8"/>
  </actuator>
</mujoco>
"""


def commands(number: int) -> Floats:
    """Sines of several speeds that begin at rest. shape=(n, 3) [rad]"""
    t = STEP * np.arange(400)
    random = np.random.default_rng(number)
    rates, sizes = random.uniform(0.1, 0.8, (3, 4)), random.uniform(0.1, 0.3, (3, 4))
    waves = [np.sin(2.0 * np.pi * np.outer(t, rate)) @ size for rate, size in zip(rates, sizes, strict=True)]
    return np.column_stack(waves) * np.minimum(1.0, t / 0.5)[:, None]


def recordings(file: Path, delay: Sequence[float]) -> list[_core.Recording]:
    """Four of an arm whose joints take commands so late [s], as encoders read them."""
    out = []
    for number in range(4):
        command = commands(number)
        position = np.zeros_like(command)
        for _ in range(2):  # begins where it is from the second time on
            rest = _core.Recording("r", time=STEP * np.arange(400), position=position, command=command)
            of = prepare(file, [rest], window=np.inf)
            late = point_of(of.arm.nominal)
            for joint, seconds in enumerate(delay):
                late = late.with_value(joint, "delay", seconds)
            position = np.concatenate([position[:1], of.simulator.run([late], of.windows)[0][0]])
        shaken = position + 0.3 * ENCODER * np.random.default_rng(100 + number).standard_normal(
            position.shape
        )
        shown = np.round(shaken / ENCODER) * ENCODER
        out.append(rest.replace(name=f"r{number}", position=shown, test=number == 3))
    return out


def diagnosed(tmp_path: Path, delay: Sequence[float]) -> ServoDiagnosis:
    file = tmp_path / "arm.xml"
    file.write_text(ARM, encoding="utf-8")
    return servo_diagnose(file, recordings(file, delay))


def test_commands_that_are_late_at_all_joints_are_one_cause(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, (0.03, 0.03, 0.03))
    (late,) = [one for one in found.effects if not one.standard]
    assert (late.effect, late.joints) == ("delay", ()) and late.probability > 0.9
    assert [p.name for p in late.parameters] == ["delay.turn", "delay.lift", "delay.wrist"]
    assert all(p.value == pytest.approx(0.03, abs=0.004) for p in late.parameters)
    assert "ms late at all joints" in found.sentence
    said = float(found.sentence.split("arrive ")[1].split(" ms")[0])
    assert said == pytest.approx(30.0, abs=1.5)
    assert "late at all joints" in late.sentence and "±" in late.sentence.rsplit(": ", 1)[1]
    assert not any("delay:" in effect for one in found.classes for effect in one.effects)


@pytest.mark.parametrize("delay", [(0.0, 0.03, 0.0), (0.0, 0.0, 0.0)])
def test_what_is_late_at_one_joint_is_not_late_at_all(tmp_path: Path, delay: tuple[float, ...]) -> None:
    found = diagnosed(tmp_path, delay)
    named = [(one.effect, one.joints) for one in found.effects if not one.standard]
    assert named == ([("delay", ("lift",))] if any(delay) else [])


def test_a_bus_may_have_some_of_the_joints(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, (0.0, 0.03, 0.03))
    (late,) = [one for one in found.effects if not one.standard]
    assert (late.effect, late.joints) == ("delay", ("lift", "wrist"))
    assert "late at lift, wrist" in found.sentence


def test_delays_are_not_asked_for_where_they_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "arm.xml"
    file.write_text(ARM, encoding="utf-8")
    found = servo_diagnose(file, recordings(file, (0.03, 0.03, 0.03)), leave_out=["delay"])
    assert not any(one.effect == "delay" for one in found.effects)


@pytest.mark.parametrize(
    ("values", "joined"),
    [
        ({0: 0.02, 1: 0.022, 2: 0.019}, ()),
        ({0: 0.02, 2: 0.021}, ("turn", "wrist")),
        ({0: 0.02, 1: 0.04, 2: 0.02}, None),
        ({1: 0.02}, None),
    ],
)
def test_delays_that_were_found_one_by_one_are_one_where_they_are_alike(
    values: dict[int, float], joined: tuple[str, ...] | None
) -> None:
    names, one = ("turn", "lift", "wrist"), np.ones(3)
    point, sizes = Point(np.zeros((3, len(FIELDS)))), Sizes(one, one, one, one)
    found = [Candidate("payload", -1, (), (Free("payload_mass", -1, "linear", 1.0, 0.0, 9.0, "kg"),))]
    for joint, value in values.items():
        point = point.with_value(joint, "delay", value)
        found.append(Candidate("delay", joint, (names[joint],), (free_value("delay", joint, sizes),)))
    fitted = Fitted(point, [], np.zeros(0), np.zeros((1, 3)), [])
    account = Account(fitted, fitted, list(found), sizes, point)
    namer = Namer.__new__(Namer)
    namer.joints, namer.arm = 3, SimpleNamespace(nominal=SimpleNamespace(joints=names))  # type: ignore[assignment]
    namer._join(account)
    if joined is None:
        assert account.found == found
    else:
        assert account.found[0] is found[0] and len(account.found) == 2
        assert (account.found[1].joints, account.found[1].label) == (joined, BUS)
        assert [f.joint for f in account.found[1].free] == sorted(values)


def test_values_that_go_together_are_held_back_together() -> None:
    """Along a valley: two columns that are nearly one, and a fit that ended far from the best of it."""
    rows = np.random.default_rng(1).standard_normal((2, 400))
    x = np.array([rows[0], rows[0] + 0.01 * rows[1]])
    e = 30.0 * (x[1] - x[0])
    folds = []
    for part in np.split(np.arange(400), 4):
        here, left = x[:, part], e[part]
        folds.append((here @ here.T, here @ left, float(left @ left), 100.0))
    free = [Free("delay", 0, "linear", 1e3, -1e6, 1e6, "s"), Free("spring", 0, "linear", 1e3, -1e6, 1e6, "1")]
    point = Point(np.zeros((1, 40)))
    fitted = Fitted(point, free, np.array([f.at(point) for f in free]), e[:, None], [])
    squares = squares_of_folds(Sums(folds, 2, Noise(np.ones(1), np.ones(1))), fitted)
    assert np.all(squares <= np.array([fold[2] for fold in folds]))
