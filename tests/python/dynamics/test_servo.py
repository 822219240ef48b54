# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms diagnosed from commands: a pendulum on a servo, simulated by the chain itself."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo import PARAMETERS, ServoDiagnosis, charge, servo_diagnose, servo_dict
from truing.dynamics.servo.apart import Apart, longer_step
from truing.dynamics.servo.api import LONGEST_STEP, Judge, Prepared, _veto as vetoed, prepare, removes
from truing.dynamics.servo.candidates import Candidate, candidates_of
from truing.dynamics.servo.data import servo_data
from truing.dynamics.servo.export.held import held, uses_of
from truing.dynamics.servo.export.mjcf import write as write_mjcf
from truing.dynamics.servo.firm import firmly, serves
from truing.dynamics.servo.fit import Fitted, Fitter, Noise, cut_of, rows_of, sums
from truing.dynamics.servo.free import Sizes, free_value, usual_values
from truing.dynamics.servo.ground import (
    _better_start as better_start,
    _from_file as from_file,
    first_guess,
    groundwork,
    other_places,
    shared_scale,
    sizes_of,
    with_limits,
)
from truing.dynamics.servo.naming import (
    Account,
    Namer,
    Rank,
    Refit,
    Sureness,
    Weight,
    _sure as sure_of,
)
from truing.dynamics.servo.result import FoundServoEffect, ServoParameter, departing
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator, chain_of, point_of
from truing.dynamics.servo.unknown import Unknown
from truing.dynamics.servo.words import _causes as causes, _orders as orders_of
from truing.errors import InputError, InputWarning
from truing.examples import copy_servo_arm
from truing.files import load_recordings, load_robot

mujoco = pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
STEP = 0.01  # [s] between rows
ENCODER = 1.5e-3  # [rad]
PENDULUM = """<mujoco>
  <worldbody>
    <body name="arm">
      <joint name="swing" axis="0 1 0" damping="0.05" frictionloss="0.03" armature="0.004"/>
      <inertial pos="0 0 -0.15" mass="0.4" diaginertia="1e-4 1e-4 1e-4"/>
    </body>
  </worldbody>
  <actuator><position joint="swing" kp="4" kv="0.02"/></actuator>
</mujoco>
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "pendulum.xml"
    path.write_text(PENDULUM, encoding="utf-8")
    return path


def commands(number: int, seconds: float = 5.0) -> Floats:
    """Steps, and sines of several speeds. shape=(n, 1) [rad]"""
    t = STEP * np.arange(round(seconds / STEP))
    random = np.random.default_rng(number)
    if number % 2:
        levels = random.uniform(-0.9, 0.9, 12)
        return np.asarray(levels[np.minimum((t / 0.6).astype(int), 11)][:, None])
    rates = random.uniform(0.2, 1.6, 4)
    phases = random.uniform(0.0, 6.28, 4)
    return np.asarray(0.4 * np.sin(6.28 * np.outer(t, rates) + phases).sum(axis=1))[:, None] / 1.6


def recording(name: str, command: Floats, position: Floats, test: bool = False) -> _core.Recording:
    time = STEP * np.arange(len(command))
    return _core.Recording(name, time=time, position=position, command=command, test=test)


def resting(number: int) -> _core.Recording:
    command = commands(number)
    command[:20] = 0.0  # begins at rest, where the arm hangs
    return recording(f"r{number}", command, np.zeros_like(command), number >= 4)


def recordings_of(file: Path, noise: float = 0.0, **values: float) -> list[_core.Recording]:
    """Six recordings of the pendulum with other values of its chain, as encoders read it."""
    out = []
    for number in range(6):
        rest = resting(number)
        of = prepare(file, [replace_test(rest)], window=np.inf)
        point = point_of(of.arm.nominal)
        for field, value in values.items():
            point = point.with_value(0, field, value)
        motion = of.simulator.run([point], of.windows)[0][0]
        position = np.concatenate([np.zeros((1, 1)), motion])
        shaken = position + noise * np.random.default_rng(100 + number).standard_normal(position.shape)
        shown = np.round(shaken / ENCODER) * ENCODER if noise else position
        out.append(recording(f"r{number}", np.asarray(rest.command), shown, number >= 4))
    return out


def replace_test(one: _core.Recording) -> _core.Recording:
    return one.replace(test=False)


def prepared_of(file: Path, recordings: list[_core.Recording], **options: float) -> Prepared:
    return prepare(file, recordings, window=np.inf, **options)  # type: ignore[arg-type]


def test_the_fields_of_the_chain_are_those_that_the_simulator_takes() -> None:
    assert tuple(PARAMETERS) == FIELDS == tuple(_core.servo_fields())


def test_motion_of_the_chain_itself_leaves_no_residual(file: Path) -> None:
    values = {"delay": 0.013, "load_friction": 0.2, "drive_law": 0.8, "damping_gain": 0.03}
    of = prepared_of(file, recordings_of(file, 0.0, **values))
    point = point_of(of.arm.nominal)
    for field, value in values.items():
        point = point.with_value(0, field, value)
    rows = rows_of(of.data, of.windows)
    errors = rows.measured - of.simulator.run([point], of.windows)[0][0]
    assert np.abs(errors).max() < 2e-3  # of states that are smoothed where a window begins
    usual = rows.measured - of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
    assert np.abs(usual).max() > 0.05


def test_one_thread_and_two_give_the_same_bits(file: Path) -> None:
    recordings = recordings_of(file)
    one, two = (prepared_of(file, recordings, threads=threads) for threads in (1, 2))
    points = [point_of(one.arm.nominal).with_value(0, "command_gain", k) for k in (2.0, 4.0, 8.0)]
    for a, b in zip(*(of.simulator.run(points, of.windows)[0] for of in (one, two)), strict=True):
        assert np.array_equal(a, b)


def test_a_set_leaves_nothing_behind_for_the_next(file: Path) -> None:
    of = prepared_of(file, recordings_of(file))
    point = point_of(of.arm.nominal)
    heavy = replace(point, payload=0.3, place=(0.0, 0.0, -0.2), weight=1.4, links=(("arm", 1.5),))
    alone = of.simulator.run([point], of.windows)[0][0]
    beside = Simulator(of.arm, of.data, 1).run([heavy, point, heavy, point], of.windows)[0]
    assert np.array_equal(alone, beside[1]) and np.array_equal(alone, beside[3])
    assert np.abs(beside[0] - alone).max() > 0.02


TWO = """<mujoco>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.1" frictionloss="0.02" armature="0.06"/>
      <inertial pos="0.02 0 -0.1" mass="0.4" diaginertia="4e-4 4e-4 1e-4"/>
      <body name="fore" pos="0 0 -0.2">
        <joint name="elbow" axis="0 1 0" damping="0.05" frictionloss="0.02" armature="0.03"/>
        <inertial pos="0 0.01 -0.08" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>
        <body name="slider">
          <joint name="rail" type="slide" axis="0.6 0 0.8" damping="5" frictionloss="0.1" armature="1"/>
          <inertial pos="0 0 -0.05" mass="0.1" diaginertia="1e-5 1e-5 1e-5"/>
          <site name="tool" pos="0 0 -0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="shoulder" kp="6"/><position joint="elbow" kp="4"/>
    <position joint="rail" kp="300"/></actuator>
</mujoco>
"""


def moved_by_itself(tmp_path: Path) -> tuple[Path, list[_core.Recording]]:
    """Three joints under commands, as the simulator moves the whole arm."""
    file = tmp_path / "two.xml"
    file.write_text(TWO, encoding="utf-8")
    command = np.column_stack([commands(0), commands(2), 0.05 * commands(4)])
    rest = recording("r", command * np.minimum(1.0, np.arange(len(command)) / 40.0)[:, None], 0.0 * command)
    motion = rest
    for _ in range(2):  # begins where it is from the second time on
        of = prepare(file, [motion], window=np.inf)
        moved = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
        motion = rest.replace(position=np.concatenate([motion.position[:1], moved]))
    return file, [motion]


def test_joints_apart_move_as_the_whole_arm_does(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    apart, point = Apart(of.simulator), point_of(of.arm.nominal)
    whole = of.simulator.run([point], of.windows)[0][0]
    one = apart.run([point], of.windows)[0][0]
    assert (np.std(whole - one, axis=0) < 0.02 * np.std(whole, axis=0)).all()


def test_masses_do_to_a_joint_apart_what_they_do_to_the_arm(file: Path) -> None:
    """Of one joint, which is apart by itself."""
    of = prepared_of(file, recordings_of(file))
    apart, point = Apart(of.simulator), point_of(of.arm.nominal)
    whole = of.simulator.run([point], of.windows)[0][0]
    one = apart.run([point], of.windows)[0][0]
    assert np.abs(whole - one).max() < 2e-3
    for other in (
        replace(point, weight=1.3),
        replace(point, payload=0.1),
        replace(point, links=(("arm", 1.4),)),
    ):
        change = of.simulator.run([other], of.windows)[0][0] - whole
        alone = apart.run([other], of.windows)[0][0] - one
        assert np.linalg.norm(alone - change) < 0.05 * np.linalg.norm(change)


def test_one_joint_alone_is_the_same_joint(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    point = point_of(of.arm.nominal).with_value(1, "load_friction", 0.2)
    every, alone = (Apart(of.simulator).run([point], of.windows, only=[joint])[0][0] for joint in (-1, 1))
    assert np.array_equal(every[:, 1], alone[:, 1]) and not alone[:, 0].any()


def test_joints_side_by_side_do_what_each_does_alone(tmp_path: Path) -> None:
    """More of them than go through a window at once."""
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    apart, base = Apart(of.simulator), point_of(of.arm.nominal)
    values = {"delay": 0.02, "backlash": 0.05, "supply_sag": 0.2, "presliding": 0.02, "rate_limit": 0.5}
    points = [base, *(base.with_value(0, name, value) for name, value in values.items())]
    joints = [-1, 0, -1, 0, 0, -1]
    together = apart.run(points, of.windows, only=joints)[0]
    for point, joint, motion in zip(points, joints, together, strict=True):
        assert np.array_equal(Apart(of.simulator).run([point], of.windows, only=[joint])[0][0], motion)


def test_joints_that_were_simulated_before_are_not_simulated_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of chains that differ at another joint; where one leaves, its arm stands still, as without the rest."""
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    apart, base = Apart(of.simulator), point_of(of.arm.nominal)
    leaves = base.with_value(0, "command_gain", -1e6).with_value(0, "coulomb", 0.0)
    both = base.with_value(0, "coulomb", 0.3).with_value(1, "coulomb", 0.2)
    points = [base, base.with_value(0, "coulomb", 0.3), base.with_value(1, "coulomb", 0.2), both, leaves]
    sets: list[int] = []
    simulate = _core.simulate_servos_apart

    def counted(*arguments: object) -> object:
        sets.append(len(arguments[4]))  # type: ignore[arg-type]
        return simulate(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(_core, "simulate_servos_apart", counted)
    first, again = (apart.run(points, of.windows)[0] for _ in range(2))
    assert sets == [4, 1, 1]  # not `both`; what leaves once more, as a whole
    for point, *motions in zip(points, first, again, strict=True):
        expected = Apart(of.simulator).run([point], of.windows)[0][0]
        assert all(np.array_equal(motion, expected) for motion in motions)
    assert np.abs(first[-1]).max() == 1e3


def test_steps_of_joints_apart_are_the_longest_that_rows_are_whole_numbers_of(file: Path) -> None:
    """Of a simulator that takes 11 steps a row, which no other number divides."""
    data = replace(prepared_of(file, recordings_of(file)).data, step=STEP / 11.0)
    assert longer_step(data, 0.0) == pytest.approx(STEP / 11.0)
    assert longer_step(data, 0.004) == pytest.approx(STEP / 3.0)
    assert longer_step(data, 0.02) == pytest.approx(STEP)


def test_a_chain_is_judged_once(file: Path) -> None:
    of = prepared_of(file, recordings_of(file))
    nominal = point_of(of.arm.nominal)
    judge = Judge(of, Apart(of.simulator), nominal, nominal.with_value(0, "coulomb", 0.1))
    first = judge.errors([nominal, judge.standard, nominal])
    once = of.simulator.simulated
    assert once == 2 * len(judge.rows.windows) and np.array_equal(first[0], first[2])
    assert np.array_equal(judge.errors([judge.standard])[0], first[1]) and of.simulator.simulated == once
    function = (0, "speed", -1.0, 1.0, np.array([0.1, 0.0, -0.1]))
    assert not np.array_equal(judge.errors([replace(nominal, functions=(function,))])[0], first[0])


def test_motions_that_are_remembered_are_no_more_than_there_is_room_for(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = prepared_of(file, recordings_of(file))
    rows = sum(w.rows for w in of.windows)
    monkeypatch.setattr("truing.dynamics.servo.simulator._REMEMBERED", rows)
    nominal = point_of(of.arm.nominal)
    other = nominal.with_value(0, "coulomb", 0.1)
    first = of.simulator.run([nominal], of.windows)[0][0]
    of.simulator.run([other], of.windows)
    begun = of.simulator.simulated
    again = of.simulator.run([nominal], of.windows)[0][0]
    assert np.array_equal(first, again) and of.simulator.simulated == begun + len(of.windows)


def test_an_anchor_makes_errors_those_of_the_whole_arm(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    rows = rows_of(of.data, of.windows)
    fitter = Fitter(Apart(of.simulator), rows)
    point = point_of(of.arm.nominal).with_value(0, "command_gain", 5.0)
    fitter.anchor(point)
    whole = rows.measured - of.simulator.run([point], of.windows)[0][0]
    assert np.abs(fitter.errors(fitter.motions([point])[0]) - whole).max() < 1e-9


def test_a_payload_hangs_at_the_tool(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    chain = prepare(file, recordings, window=np.inf).arm.nominal
    assert (chain.payload_body, chain.payload_place) == ("slider", (0.0, 0.0, -0.1))


def test_columns_are_the_differences_of_whole_simulations(file: Path) -> None:
    of = prepared_of(file, recordings_of(file))
    fitter = Fitter(of.simulator, rows_of(of.data, of.windows))
    point = point_of(of.arm.nominal)
    sizes = Sizes(*(np.ones(1) for _ in range(4)))
    free = [free_value(name, 0, sizes) for name in ("command_gain", "viscous", "delay")]
    _, table = fitter.columns(point, free)
    for (_, column), one in zip(table, free, strict=True):
        step = 0.3 * one.step
        two = [one.put(point, one.at(point) + step), point]
        up, base = of.simulator.run(two, of.windows)[0]
        near = (up - base)[:, 0] / step
        assert np.linalg.norm(column - near) < 0.1 * np.linalg.norm(near)


@pytest.mark.parametrize("field", ["backlash", "elasticity"])
def test_rotor_and_link_with_next_to_nothing_between_move_as_one(file: Path, field: str) -> None:
    """What the rotor gives to the link it gives: with a heavy rotor all momentum goes through the contact."""
    of = prepared_of(file, [resting(1).replace(test=False)])
    rigid = point_of(of.arm.nominal).with_value(0, "armature", 0.03)
    one, two = of.simulator.run([rigid, rigid.with_value(0, field, 1e-6)], of.windows)[0]
    assert np.sqrt(np.mean((one - two) ** 2)) < 0.03 * np.std(one)
    one, two = Apart(of.simulator, LONGEST_STEP).run([rigid, rigid.with_value(0, field, 1e-6)], of.windows)[0]
    assert np.sqrt(np.mean((one - two) ** 2)) < 0.03 * np.std(one)


def rotors(file: Path, encoder: float, **value: float) -> tuple[Prepared, list[Point]]:
    """A rigid arm, and one whose rotor is behind a play or a spring."""
    of = prepared_of(file, [resting(0).replace(test=False)])
    rigid = point_of(of.arm.nominal).with_value(0, "armature", 0.02)
    (field, at), *_ = value.items()
    return of, [rigid, rigid.with_value(0, field, at).with_value(0, "motor_encoder", encoder)]


def what_it_does(motions: list[Floats]) -> Floats:
    return np.asarray(motions[1] - motions[0])


def in_short_steps(of: Prepared, points: list[Point]) -> Floats:
    apart = Apart(of.simulator, LONGEST_STEP)
    apart._core_arm = of.simulator.core_arm_with(STEP / 200.0)
    return what_it_does(apart.run(points, of.windows)[0])


@pytest.mark.parametrize("field, value", [("backlash", 0.03), ("elasticity", 0.05)])
@pytest.mark.parametrize("encoder", [0.0, 1.0])
def test_steps_of_a_joint_apart_are_short_enough_for_a_rotor(
    file: Path, field: str, value: float, encoder: float
) -> None:
    of, points = rotors(file, encoder, **{field: value})
    short = in_short_steps(of, points)
    long = what_it_does(Apart(of.simulator, LONGEST_STEP).run(points, of.windows)[0])
    assert np.std(short) > 2e-3
    assert np.std(long - short) < 0.25 * np.std(short)


@pytest.mark.parametrize("field, value", [("backlash", 0.03), ("elasticity", 0.05)])
@pytest.mark.parametrize("encoder", [0.0, 1.0])
def test_the_whole_arm_has_a_rotor_as_short_steps_have_it(
    file: Path, field: str, value: float, encoder: float
) -> None:
    of, points = rotors(file, encoder, **{field: value})
    short = in_short_steps(of, points)
    whole = what_it_does(of.simulator.run(points, of.windows)[0])
    assert np.std(whole - short) < 0.2 * np.std(short)


@pytest.mark.parametrize("encoder", [0.0, 1.0])
@pytest.mark.parametrize("field, value", [("elasticity", 0.1), ("backlash", 0.1)])
def test_a_rotor_that_holds_a_weight_stands_where_it_does_when_a_window_begins(
    tmp_path: Path, field: str, value: float, encoder: float
) -> None:
    """Held out level the weight twists the spring by 59 mrad, or lies on a stop of the play: nothing moves,
    of the whole arm as of a joint apart."""
    path = tmp_path / "level.xml"
    path.write_text(PENDULUM.replace('pos="0 0 -0.15"', 'pos="0.15 0 0"'), encoding="utf-8")
    rows = np.zeros((200, 1))
    one = recording("held", rows - 0.4 * 9.81 * 0.15 / 4.0, rows)  # by a gain of 4 Nm/rad
    of = prepare(path, [one], window=np.inf)
    point = point_of(of.arm.nominal)
    for name, size in ((field, value), ("motor_encoder", encoder)):
        point = point.with_value(0, name, size)
    for simulator in (of.simulator, Apart(of.simulator, LONGEST_STEP)):
        moved = simulator.run([point], of.windows)[0][0]
        assert np.abs(moved).max() < 1e-3


def test_an_integral_holds_the_weight_that_it_held_before_a_recording_began(tmp_path: Path) -> None:
    """A recording of eight seconds less its first three is moved as the whole of it was: what the integral
    held then is found, where nothing would leave the arm to fall by what it carries."""
    path = tmp_path / "level.xml"
    path.write_text(PENDULUM.replace('pos="0 0 -0.15"', 'pos="0.15 0 0"'), encoding="utf-8")
    command = 0.5 * commands(2, 8.0)
    whole = prepare(path, [recording("r", command, np.zeros_like(command))], window=np.inf)
    point = point_of(whole.arm.nominal).with_value(0, "integral_gain", 6.0)
    start = np.zeros((1, 1))
    moved = whole.simulator._with([point], whole.windows, [start], False, None)[0][0]
    late = recording("late", command[301:], moved[300 : len(command) - 1])
    of = prepare(path, [late], window=np.inf)
    held = np.sum(command[:301] - np.vstack([start, moved[:300]])) * STEP
    for simulator in (of.simulator, Apart(of.simulator, LONGEST_STEP)):
        found = simulator._charges.of([point], of.windows)[0]
        assert found.shape == (1, 1) and abs(found[0, 0] - held) < 0.05 * abs(held)
        errors = Fitter(simulator, rows_of(of.data, of.windows)).errors(
            simulator.run([point], of.windows)[0][0]
        )
        assert np.sqrt(np.mean(errors**2)) < 3e-3  # 39e-3 without
    assert not of.simulator._charges.of([point_of(of.arm.nominal)], of.windows)[0].size


def test_another_place_to_look_from_has_the_files_torques_where_these_were_left(file: Path) -> None:
    """All torques of a fit ten times the file's: beside it stands one with the file's gain, the others fitted
    to it; of a fit at the file's torques there is none."""
    of = prepared_of(file, recordings_of(file))
    fitter, nominal = Fitter(of.simulator, rows_of(of.data, of.train)), point_of(of.arm.nominal)
    sizes = sizes_of(of.simulator, nominal, of.train)
    free = usual_values(of.arm.nominal, sizes, False)
    start = np.array([f.at(nominal) for f in free])
    fitted = fitter.fit(nominal, free, start, None, 1)
    assert other_places(fitter, fitted, nominal, sizes) == []
    torques = [FIELDS.index(name) for name in ("command_gain", "viscous", "coulomb", "armature")]
    chain = nominal.chain.copy()
    chain[:, torques] *= 10.0
    far = replace(fitted, point=replace(nominal, chain=chain))
    (place,) = other_places(fitter, far, nominal, sizes)
    assert place.joints == [0] and place.held == "command_gain"
    near = place.near
    assert near.point.value(0, "command_gain") == nominal.value(0, "command_gain")
    assert np.mean(near.errors**2) < 0.1 * np.mean(fitter.errors(fitter.motions([far.point])[0]) ** 2)


def test_a_value_that_nothing_depends_on_does_not_overflow(file: Path) -> None:
    of = prepared_of(file, recordings_of(file))
    free = free_value("saturation", 0, Sizes(*(np.ones(1) for _ in range(4))))
    point = free.put(point_of(of.arm.nominal), 1e6)
    assert np.isfinite(point.value(0, "saturation")) and point.value(0, "saturation") > 1e100


def test_dry_friction_holds_a_joint_of_little_inertia(file: Path) -> None:
    """A hundredth of the pendulum's inertia: held level by friction alone, it moves no more."""
    light = PENDULUM.replace('pos="0 0 -0.15"', 'pos="0 0 -0.005"').replace(' armature="0.004"', "")
    file.write_text(light, encoding="utf-8")
    rest = resting(0)
    level = np.full((len(rest), 1), 1.57)
    columns = {"enabled": np.zeros(len(rest))}
    of = prepared_of(file, [rest.replace(columns=columns, position=level, command=level)])
    motion = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
    assert abs(motion[-1, 0] - 1.57) < 0.01


def wrists(gain: float) -> str:
    """Three light joints that turn about the vertical: masses of some grams say how large torques are."""
    text = ""
    for k in range(3):
        text += f"""<body name="b{k}"><joint name="j{k}" axis="0 0 1" damping="{0.04 * gain}"
            frictionloss="{0.02 * gain}" armature="1e-5"/>
            <inertial pos="0.01 0 0" mass="0.02" diaginertia="1e-6 1e-6 1e-6"/>"""
    drives = "".join(f'<position joint="j{k}" kp="{gain}"/>' for k in range(3))
    return f"<mujoco><worldbody>{text}{'</body>' * 3}</worldbody><actuator>{drives}</actuator></mujoco>"


def test_drives_of_one_kind_have_one_scale_where_motion_does_not_say(tmp_path: Path) -> None:
    """Seeds of the noise: 7."""
    file = tmp_path / "wrists.xml"
    file.write_text(wrists(5.0), encoding="utf-8")
    command = np.column_stack([commands(0), commands(2), commands(4)])
    command *= np.minimum(1.0, np.arange(len(command)) / 40.0)[:, None]
    rest = recording("r", command, 0.0 * command)
    of = prepare(file, [rest], window=np.inf)
    moved = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
    shaken = np.concatenate([np.zeros((1, 3)), moved])
    shaken += 5e-4 * np.random.default_rng(7).standard_normal(shaken.shape)
    file.write_text(wrists(300.0), encoding="utf-8")
    of = prepare(file, [rest.replace(position=shaken)], window=np.inf)
    fitter = Fitter(Apart(of.simulator), rows_of(of.data, of.windows))
    point = groundwork(fitter, point_of(of.arm.nominal), of.data)[0].point
    gains = np.array([point.value(j, "command_gain") for j in range(3)])
    assert np.ptp(np.log(gains)) < 0.3
    assert point.place == of.arm.nominal.payload_place


def test_a_rotor_that_a_scan_left_at_nothing_comes_back(tmp_path: Path) -> None:
    """The tutorial's arm, whose servos are late: damping and no rotor do at the elbow a part of what a delay
    does, and a fit that begins there ends there."""
    arm, joints = tmp_path / "arm", ("shoulder_pan", "shoulder_lift", "elbow_flex")
    copy_servo_arm(arm)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        robot = load_robot(arm / "arm.xml", any_tool=True, tip_link="gripper")
        recordings = list(load_recordings([arm / "recordings"], robot, units="deg"))
    of = prepare(arm / "arm.xml", recordings, joints=joints)
    fitter = Fitter(Apart(of.simulator, LONGEST_STEP), rows_of(of.data, of.train))
    nominal = point_of(of.arm.nominal).with_value(slice(None), "limited_damping", 0.0)
    scanned = first_guess(fitter.simulator, fitter.rows, nominal, False)
    sizes = sizes_of(fitter.simulator, scanned, fitter.rows.windows)
    free = usual_values(of.arm.nominal, sizes, False)
    start = np.array([one.at(scanned) for one in free])
    alone = fitter.fit(scanned, free, start, None, 20, shown=False).errors
    both = better_start(fitter, scanned, nominal, sizes, free, start)
    error = fitter.errors(fitter.motions([both])[0])
    assert (np.std(error, axis=0) < 1.01 * np.std(alone, axis=0)).all()
    assert np.std(error[:, 2]) < 0.5 * np.std(alone[:, 2])
    assert scanned.value(2, "armature") < 1e-3 < both.value(2, "armature")


def test_dry_friction_is_held_as_newtons_method_holds_it(tmp_path: Path) -> None:
    arm, joints = tmp_path / "arm", ("shoulder_pan", "shoulder_lift", "elbow_flex")
    copy_servo_arm(arm)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        robot = load_robot(arm / "arm.xml", any_tool=True, tip_link="gripper")
        recordings = list(load_recordings([arm / "recordings"], robot, units="deg"))
    fast, slow = (prepare(arm / "arm.xml", recordings, joints=joints) for _ in range(2))
    for model in slow.simulator._models:
        assert model.opt.solver == mujoco.mjtSolver.mjSOL_PGS
        model.opt.solver, model.opt.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, 1e-14
    point = point_of(fast.arm.nominal)
    for coulomb in (0.0, 0.1, 5.0):
        rubs = point.with_value(slice(None), "coulomb", coulomb)
        motions = [of.simulator.run([rubs], of.windows)[0][0] for of in (fast, slow)]
        assert np.abs(motions[0] - motions[1]).max() < 1e-6


def test_more_charges_than_are_kept_serve_a_batch(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    of = prepared_of(file, recordings_of(file))
    sums = [point_of(of.arm.nominal).with_value(0, "integral_gain", k) for k in (1.0, 2.0, 3.0)]
    kept = of.simulator.run(sums, of.windows, torques=True)[0]
    monkeypatch.setattr(charge, "_KEPT", 1)
    again = prepared_of(file, recordings_of(file))
    for one, other in zip(kept, again.simulator.run(sums, again.windows, torques=True)[0], strict=True):
        assert np.array_equal(one, other)


def test_torques_that_share_a_factor_are_one_departure(file: Path) -> None:
    nominal = point_of(prepared_of(file, recordings_of(file)).arm.nominal)
    fields = ("command_gain", "viscous", "coulomb", "armature")
    scaled = nominal
    for field, factor in zip(fields, (0.8, 0.82, 0.79, 0.7), strict=True):
        scaled = scaled.with_value(0, field, factor * nominal.value(0, field))
    assert shared_scale(scaled, nominal)[0] == pytest.approx(np.median(np.log([0.8, 0.82, 0.79, 0.7])))
    assert shared_scale(nominal, nominal)[0] == 0.0
    grown = scaled.with_value(0, "coulomb", 2.0 * nominal.value(0, "coulomb"))
    assert shared_scale(grown, nominal)[0] == 0.0


def test_usual_parameters_depart_by_more_than_the_factor_that_all_share(file: Path) -> None:
    """A heavier arm is that of weaker drives: the gain says so, and nothing beside it does."""
    of = prepared_of(file, [one.replace(test=False) for one in recordings_of(file)])
    heavy = replace(point_of(of.arm.nominal), links=(("arm", 1.25),))
    motion = of.simulator.run([heavy], of.windows)[0][0]
    rows = of.windows[0].rows
    recordings = [
        one.replace(position=np.concatenate([one.position[:1], motion[k * rows : (k + 1) * rows]]))
        for k, one in enumerate(recordings_of(file))
    ]
    every = {known.effect for known in PARAMETERS.values()} | {"payload", "link_inertia"}
    found = servo_diagnose(file, recordings, leave_out=sorted(every), window=np.inf)
    said = {one.effect: one.probability for one in found.effects}
    assert said["command_gain"] > 0.99 and said["viscous"] == 0.0
    assert found.chains["standard"].drives[0].viscous == pytest.approx(0.07 / 1.25, rel=0.1)  # kv is damping


def departed(found: ServoDiagnosis) -> list[FoundServoEffect]:
    return [e for e in found.effects if e.standard and e.probability > 0.0]


def test_what_a_payload_does_to_the_usual_parameters_may_be_the_payload(file: Path, tmp_path: Path) -> None:
    heavier = tmp_path / "heavier.xml"
    text = PENDULUM.replace(
        'mass="0.4" diaginertia="1e-4 1e-4 1e-4"', 'mass="0.5" diaginertia="1e-4 1e-4 1e-4"'
    )
    heavier.write_text(text, encoding="utf-8")
    found = servo_diagnose(file, recordings_of(heavier, 5e-4))
    assert departed(found)
    for one in departed(found):
        assert one.probability > 0.9
        assert {"payload", "link_inertia"} & {other.effect for other in one.confounded_with}
    told = [c for c in found.classes if "may as well be one cause" in c.sentence]
    assert len(told) == 1 and "payload" in told[0].effects


def test_a_weaker_drive_alone_is_nothing_else(file: Path) -> None:
    found = diagnosed(file, command_gain=3.2)
    assert [(e.effect, e.confounded_with) for e in departed(found)] == [("command_gain", ())]


def test_a_light_joints_torques_are_the_files_where_these_move_the_arm_better(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    fitter, nominal = Fitter(Apart(of.simulator), rows_of(of.data, of.windows)), point_of(of.arm.nominal)
    sizes = sizes_of(fitter.simulator, nominal, fitter.rows.windows)
    free = usual_values(of.arm.nominal, sizes, False)
    drifted = nominal
    for field in ("command_gain", "viscous", "coulomb", "armature"):
        drifted = drifted.with_value(1, field, 2.7 * nominal.value(1, field))
    start = np.array([one.at(drifted) for one in free])
    fitter.anchor(drifted)
    fitted = fitter.fit(drifted, free, start, None, 0)
    back = from_file(fitter, fitted, nominal)
    assert back.point.value(1, "command_gain") == pytest.approx(nominal.value(1, "command_gain"), rel=0.05)
    again = from_file(fitter, back, nominal)
    assert np.mean(again.errors**2) <= 1.01 * np.mean(back.errors**2)


def test_nothing_unknown_is_said_of_what_encoders_do_not_show(file: Path) -> None:
    """A bump of the torque at one angle."""
    of = prepared_of(file, [replace_test(one) for one in recordings_of(file)])
    point = point_of(of.arm.nominal)
    bump = (0, "angle", -0.9, 0.3, np.array([0.0, 0.0, 0.0, 0.3, -0.3, 0.0, 0.0]))
    motion = of.simulator.run([replace(point, functions=(bump,))], of.windows)[0][0]
    moved = [
        one.replace(position=np.concatenate([one.position[:1], part]))
        for one, part in zip(recordings_of(file), np.split(motion, 6), strict=True)
    ]
    of = prepared_of(file, moved)
    fitter = Fitter(Apart(of.simulator), rows_of(of.data, of.train))
    standard, sizes = groundwork(fitter, point, of.data)
    namer, account = Namer(fitter, (), 1), Account(standard, standard, [], sizes, point)
    (found,) = Unknown(namer, account).found(False, lambda point: True)
    assert found.input in ("angle", "directed_angle")
    namer.resolution = np.array([0.5])
    assert not Unknown(namer, account).found(False, lambda point: True)


def on_a_base(gravity: str) -> str:
    """A shoulder and an elbow whose axes are not parallel."""
    return f"""<mujoco>
  <option gravity="{gravity}"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.1" frictionloss="0.03" armature="0.01"/>
      <inertial pos="0 0 -0.1" mass="0.5" diaginertia="1e-4 1e-4 1e-4"/>
      <body name="fore" pos="0 0 -0.2">
        <joint name="elbow" axis="1 0 0" damping="0.05" frictionloss="0.02" armature="0.005"/>
        <inertial pos="0 0.02 -0.1" mass="0.3" diaginertia="1e-4 1e-4 1e-4"/>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="shoulder" kp="6"/><position joint="elbow" kp="3"/></actuator>
</mujoco>
"""


def of_two_joints(file: Path) -> list[_core.Recording]:
    out = []
    for number in range(6):
        command = np.column_stack([commands(number)[:, 0], commands(number + 10)[:, 0]])
        command[:20] = 0.0
        rest = recording(f"r{number}", command, np.zeros_like(command), number >= 4)
        of = prepare(file, [replace_test(rest)], window=np.inf)
        motion = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
        shaken = np.concatenate([np.zeros((1, 2)), motion])
        shaken = shaken + 5e-4 * np.random.default_rng(number).standard_normal(shaken.shape)
        out.append(rest.replace(position=np.round(shaken / ENCODER) * ENCODER))
    return out


@pytest.mark.slow
def test_an_arm_on_a_wall_whose_file_stands_is_turned(tmp_path: Path) -> None:
    standing, wall = tmp_path / "standing.xml", tmp_path / "wall.xml"
    standing.write_text(on_a_base("0 0 -9.81"), encoding="utf-8")
    wall.write_text(on_a_base("0 -9.81 0"), encoding="utf-8")  # about the shoulder it would be its zero
    recordings = of_two_joints(standing)
    found = servo_diagnose(wall, recordings)
    gravity = found.chains["named"].gravity
    assert gravity is not None and np.allclose(gravity, (0.0, 0.0, -9.81), atol=0.6)
    assert "the base is turned by" in found.warnings[0]
    assert not names(found) and not found.unknown
    used = uses_of(found.chains["named"], recordings)
    exported, _ = write_mjcf(found.chains["named"], held(found.chains["named"], used), used, wall)
    assert np.allclose(mujoco.MjModel.from_xml_string(exported).opt.gravity, gravity, atol=1e-6)
    assert servo_diagnose(standing, recordings).chains["named"].gravity is None


@pytest.mark.slow
def test_a_hum_is_no_law_of_the_catalogue(file: Path) -> None:
    """Friction in a band of speeds, which derivatives at the wrong fit show a part of."""
    of = prepared_of(file, [replace_test(resting(number)) for number in range(6)])
    speeds = np.arange(-3.0, 3.01, 0.25)
    loss = 0.15 * np.sign(speeds) * np.exp(-(((np.abs(speeds) - 1.5) / 0.4) ** 2))
    point = replace(point_of(of.arm.nominal), functions=((0, "speed", -3.0, 0.25, loss),))
    motion = of.simulator.run([point], of.windows)[0][0]
    noise = np.random.default_rng(3)
    moved = []
    for number, part in enumerate(np.split(motion, 6)):
        shaken = np.concatenate([np.zeros((1, 1)), part])
        shaken = shaken + 5e-4 * noise.standard_normal(shaken.shape)
        moved.append(resting(number).replace(position=np.round(shaken / ENCODER) * ENCODER))
    found = servo_diagnose(file, moved)
    assert [one.inputs for one in found.unknown] == [("speed",)]
    assert not names(found)


def test_no_command_no_torque(file: Path) -> None:
    """`enabled` 0: the arm falls back to where it hangs."""
    rest = resting(0)
    columns = {"enabled": np.zeros(len(rest))}
    up = np.full((len(rest), 1), 0.8)
    of = prepared_of(file, [rest.replace(columns=columns, position=up, command=up, test=False)])
    motion = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
    assert abs(motion[-1, 0]) < 0.1 and abs(motion[0, 0] - 0.8) < 0.01


def switched_off(file: Path, **values: float) -> list[_core.Recording]:
    """Six recordings of the pendulum: it follows commands, is held up, lets go and swings."""
    out = []
    for number in range(6):
        command = np.asarray(resting(number).command).copy()
        command[220:] = 0.5 + 0.1 * number
        columns = {"enabled": (np.arange(len(command)) < 300).astype(float)}
        rest = recording(f"r{number}", command, 0.0 * command, number >= 4).replace(columns=columns)
        of = prepare(file, [replace_test(rest)], window=np.inf)
        point = point_of(of.arm.nominal)
        for field, value in values.items():
            point = point.with_value(0, field, value)
        motion = np.concatenate([np.zeros((1, 1)), of.simulator.run([point], of.windows)[0][0]])
        noise = 5e-4 * np.random.default_rng(100 + number).standard_normal(motion.shape)
        out.append(rest.replace(position=np.round((motion + noise) / ENCODER) * ENCODER))
    return out


def test_a_motor_brakes_while_it_is_switched_on_alone(file: Path) -> None:
    """With a play the rotor's friction is another one's to compute."""
    of = prepared_of(file, [one.replace(test=False) for one in switched_off(file)[:1]])
    on = slice(0, 299)
    for play in (0.0, 0.05):
        brakes = point_of(of.arm.nominal).with_value(0, "backlash", play)
        free = brakes.with_value(0, "back_emf", 0.9)
        first, second = of.simulator.run([brakes, free], of.windows)[0]
        assert np.array_equal(first[on], second[on])
        assert np.abs(second[400:]).max() > 1.3 * np.abs(first[400:]).max()


def test_a_motor_that_does_not_brake_when_it_is_off_is_named(file: Path) -> None:
    kept = {"back_emf", "viscous_law", "stribeck", "load_friction", "payload"}
    found = servo_diagnose(
        file, switched_off(file, back_emf=0.7), leave_out=names_left(kept), window=np.inf, max_effects=2
    )
    assert names(found)[:1] == ["back_emf"]
    assert found.chains["named"].drives[0].back_emf == pytest.approx(0.7, abs=0.1)


def test_what_no_switch_shows_is_not_testable(file: Path) -> None:
    of = prepared_of(file, recordings_of(file))
    sizes = Sizes(*(np.ones(1) for _ in range(4)))
    found, idle = candidates_of(of.arm, of.data, point_of(of.arm.nominal), sizes, np.ones((9, 1)), ())
    assert "back_emf" not in {c.effect for c in found} and "back_emf" in {effect for effect, _, _ in idle}


def diagnosed(file: Path, noise: float = 5e-4, **values: float) -> ServoDiagnosis:
    return servo_diagnose(file, recordings_of(file, noise, **values), window=np.inf)


def names(found: ServoDiagnosis) -> list[str]:
    return [effect.effect for effect in found.effects if not effect.standard]


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_hidden(file: Path) -> None:
    found = diagnosed(file)
    assert found.verdict == "none" and not names(found) and not found.unknown


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "field", "value"),
    [
        ("delay", "delay", 0.04),
        ("load_friction", "load_friction", 0.35),
        ("saturation", "saturation", 0.7),
        ("drive_law", "drive_law", 0.6),
    ],
)
def test_a_hidden_effect_is_named_first(file: Path, effect: str, field: str, value: float) -> None:
    found = diagnosed(file, **{field: value})
    assert names(found)[0] == effect
    first = next(e for e in found.effects if not e.standard)
    assert first.parameters[0].value == pytest.approx(value, rel=0.25)
    assert found.rollout.errors["named"][0, -1] < 0.5 * found.rollout.errors["standard"][0, -1]


def test_what_was_found_is_text(file: Path) -> None:
    """A short search: three effects alone."""
    every = {known.effect for known in PARAMETERS.values()} | {"payload", "link_inertia"}
    kept = {"delay", "damping_gain"}
    recordings = recordings_of(file, 5e-4, delay=0.04)
    found = servo_diagnose(file, recordings, window=np.inf, leave_out=sorted(every - kept), max_effects=1)
    written = servo_dict(found)
    assert written["from"] == "commands" and names(found) == ["delay"]
    assert "shares one scale" in written["classes"][0]["sentence"]
    assert len(written["covariance"]["matrix"]) == len(written["covariance"]["names"])
    assert written["rollout"]["held_out"]["named"]["swing"][-1] < 0.02
    assert written["held_out"] == ["r4", "r5"]


def test_what_held_out_motion_vetoes_leaves_the_chain(file: Path) -> None:
    """Recordings that are fitted have a delay, those that are held out have not."""
    every = {known.effect for known in PARAMETERS.values()} | {"payload", "link_inertia"}
    late, prompt = recordings_of(file, 5e-4, delay=0.04), recordings_of(file, 5e-4)
    found = servo_diagnose(
        file, [*late[:4], *prompt[4:]], window=np.inf, leave_out=sorted(every - {"delay"}), max_effects=1
    )
    assert not names(found) and found.chains["named"].drives[0].delay == 0.0
    assert any("not predicted better" in w and w.endswith(": delay at swing") for w in found.warnings)
    assert found.rollout.errors["named"][0, -1] == pytest.approx(
        found.rollout.errors["standard"][0, -1], rel=0.05
    )


def with_value(namer: Namer, account: Account, label: str) -> Candidate:
    """The form of this label, fitted beside all else."""
    fitted = account.fitted
    one = next(c for c in namer.all_candidates(fitted.point, account.sizes)[0] if c.label == label)
    start = np.array([*fitted.start, *(f.at(fitted.point) for f in one.free)])
    free, noise = [*fitted.free, *one.free], namer.noise_after(fitted)
    account.fitted = namer.fitter.settled(fitted.point, free, start, noise, 5, "")
    return one


def test_what_was_idle_beside_a_name_that_does_not_hold_is_tried_again(file: Path) -> None:
    recordings = recordings_of(file, 5e-4, delay=0.04)
    namer, standard = groundwork_of(file, recordings)
    nominal = point_of(namer.arm.nominal)
    sizes = sizes_of(namer.fitter.simulator, nominal, namer.fitter.rows.windows)
    found = {}
    for idle in (False, True):
        account = Account(standard, standard, [], sizes, nominal)
        late = next(c for c in namer.all_candidates(standard.point, sizes)[0] if c.label == "delay")
        account.idle = [late] if idle else []
        account.found = [with_value(namer, account, "spring")]
        namer.drop(account, 0)
        found[idle] = [one.effect for one in account.found]
    assert found == {False: [], True: ["delay"]}


def test_another_place_to_look_from_has_no_delay_where_a_joint_was_late(file: Path) -> None:
    namer, standard = groundwork_of(file, recordings_of(file, delay=0.04))
    nominal = point_of(namer.arm.nominal)
    sizes = sizes_of(namer.fitter.simulator, nominal, namer.fitter.rows.windows)
    assert not any(p.held == "delay" for p in other_places(namer.fitter, standard, nominal, sizes))
    account = Account(standard, standard, [], sizes, nominal)
    with_value(namer, account, "delay")
    assert account.fitted.point.value(0, "delay") == pytest.approx(0.04, abs=2e-3)
    places = other_places(namer.fitter, account.fitted, nominal, sizes)
    (place,) = (p for p in places if p.held == "delay")
    assert place.joints == [0] and place.near.point.value(0, "delay") == 0.0
    assert np.mean(place.near.errors**2) < 2.0 * np.mean(standard.errors**2)


# ---- values that few rows do not decide ---------------------------------------------------------------
def stalled(recordings: list[_core.Recording]) -> list[_core.Recording]:
    """The first is held fast for 1.5 s: angles stay, and then are again what they would have been."""
    position = np.asarray(recordings[0].position).copy()
    position[100:250] = position[100]
    return [one.replace(test=False) for one in (recordings[0].replace(position=position), *recordings[1:])]


def groundwork_of(file: Path, recordings: list[_core.Recording]) -> tuple[Namer, Fitted]:
    of = prepared_of(file, recordings)
    fitter = Fitter(Apart(of.simulator, LONGEST_STEP), rows_of(of.data, of.windows))
    standard, _ = groundwork(fitter, point_of(of.arm.nominal), of.data)
    return Namer(fitter, (), 0), standard


def test_a_gradient_is_that_of_the_loss() -> None:
    random = np.random.default_rng(0)
    errors, columns = random.standard_normal((50, 2)), random.standard_normal((3, 50))
    table = [(0, columns[0]), (1, columns[1]), (0, columns[2])]
    noise = Noise(np.array([0.7, 1.3]), np.ones(2), np.array([0.5, 1.0]))

    def loss(values: Floats) -> float:
        left = errors.copy()
        for (joint, column), value in zip(table, values, strict=True):
            left[:, joint] -= value * column
        return 0.5 * float(np.sum((noise.counted(left) * noise.weight) ** 2))

    step = 1e-5 * np.eye(3)
    by_loss = [(loss(-one) - loss(one)) / 2e-5 for one in step]
    assert sums(*noise.weighed(table, errors), noise)[1] == pytest.approx(by_loss, rel=1e-6)
    assert loss(np.zeros(3)) < 0.5 * float(np.sum((errors * noise.weight) ** 2))


def test_small_errors_are_squared_and_large_ones_go_on_straight() -> None:
    noise = Noise(np.ones(1), np.ones(1), np.array([2.0]))
    squares = noise.counted(np.array([[0.5], [-2.0], [3.0], [-4.0]]))[:, 0] ** 2
    assert squares == pytest.approx([0.25, 4.0, 8.0, 12.0])


def test_a_joint_that_mostly_rests_has_a_cut() -> None:
    errors = np.zeros((100, 1))
    errors[:10] = 1.0
    assert cut_of(errors)[0] == pytest.approx(1.345 / 3.0 * np.sqrt(0.1))


def test_a_stall_does_not_decide_the_values(file: Path) -> None:
    truth = point_of(prepared_of(file, recordings_of(file)).arm.nominal).chain
    namer, standard = groundwork_of(file, stalled(recordings_of(file, 5e-4)))
    assert serves(namer, standard)
    firm = firmly(namer, standard)

    def off(fitted: Fitted) -> Floats:
        return np.array([abs(f.at(fitted.point) - np.log(truth[0, k])) for f, k in fields])

    names = _core.servo_fields()
    fields = [(f, names.index(f.field)) for f in standard.free if f.field in ("viscous", "command_gain")]
    assert np.all(off(firm) < 0.5 * off(standard))


def test_squares_stay_where_nothing_stands_out(file: Path) -> None:
    namer, standard = groundwork_of(file, [one.replace(test=False) for one in recordings_of(file, 5e-4)])
    assert not serves(namer, standard) and firmly(namer, standard) is standard


SEARCH = """
import json, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from test_servo import PENDULUM, names_left, recordings_of
from truing.dynamics.servo import servo_diagnose, servo_dict
file = Path(sys.argv[2]) / "pendulum.xml"
recordings = recordings_of(file, 5e-4, load_friction=0.35)
kept = {"load_friction", "saturation", "delay", "gravity_scale", "supply_sag", "payload"}
found = servo_diagnose(file, recordings, leave_out=names_left(kept), threads=int(sys.argv[3]))
print(json.dumps(servo_dict(found), sort_keys=True))
"""


def names_left(kept: set[str]) -> list[str]:
    return sorted(({known.effect for known in PARAMETERS.values()} | {"payload", "link_inertia"}) - kept)


def test_a_search_gives_the_same_bits_on_one_and_two_threads(file: Path) -> None:
    """Of the simulation, and of numpy's products, which add in another order on two."""
    written = []
    for threads in ("1", "2"):
        surroundings = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        place = str(Path(__file__).parent)
        command = [sys.executable, "-c", SEARCH, place, str(file.parent), threads]
        done = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True)
        written.append(done.stdout)
    assert written[0] == written[1]
    assert '"effect": "load_friction"' in written[0]


def test_sums_of_columns_are_those_of_numpy_and_the_same_bits_on_threads() -> None:
    """Seed 5. Two joints; a column of each, and one of both."""
    random = np.random.default_rng(5)
    rows, weight = 1000, np.array([2.0, 0.5])
    first, second = random.standard_normal((2, rows))
    both, measured = random.standard_normal((2, rows, 2))
    fold = np.arange(rows) // 400
    columns = [(0, first), (1, second), (-1, both)]
    one, two = (_core.sum_columns(columns, measured, weight, fold, 3, 2, threads) for threads in (1, 2))
    dense = np.zeros((3, rows, 2))
    dense[0, :, 0], dense[1, :, 1], dense[2] = first, second, both
    for k, (xx, xy, yy, n) in enumerate(one):
        seen = (fold == k) & (np.arange(rows) % 2 == 0)
        x = (dense * weight)[:, seen].reshape(3, -1) * np.sqrt(2.0)
        y = (measured * weight)[seen].ravel() * np.sqrt(2.0)
        assert np.allclose(xx, x @ x.T) and np.allclose(xy, x @ y) and yy == pytest.approx(y @ y)
        assert n == seen.sum()
        assert np.array_equal(xx, two[k][0]) and np.array_equal(xy, two[k][1])
    for bad in ([(2, first)], [(0, first[1:])]):
        with pytest.raises(InputError):
            _core.sum_columns(bad, measured, weight, fold, 3)
    with pytest.raises(InputError):
        _core.sum_columns(columns, measured, weight, fold, 2)


def test_one_supply_feeds_all_drives(tmp_path: Path) -> None:
    file, recordings = moved_by_itself(tmp_path)
    of = prepare(file, recordings, window=np.inf)
    point, usual = point_of(of.arm.nominal), np.ones(3)
    sizes = Sizes(usual, usual, usual, usual)
    found, _ = candidates_of(of.arm, of.data, point, sizes, np.ones((9, 3)), ())
    sags = [one for one in found if one.effect == "supply_sag"]
    assert [(one.joint, one.joints) for one in sags] == [(-1, ())]
    on = sags[0].free[0].put(point, 0.1)
    assert [on.value(j, "supply_sag") for j in range(3)] == [0.1] * 3
    assert np.array_equal(sags[0].off(on).chain, point.chain)


def test_inputs_that_rose_in_one_order_are_one_class() -> None:
    """Gains of the firmware by twice, temperatures by ever more."""
    command = commands(0)
    some = [
        recording(f"r{k}", command, command).replace(
            columns={
                "kp1_raw": np.full(len(command), 100.0 * 2**k),
                "temp1_C": np.full(len(command), 25.0 + k**3),
            }
        )
        for k in range(4)
    ]
    assert ("gain_law", "thermal_friction") in [c.effects for c in orders_of(servo_data(some, 1))]
    some[0], some[3] = (
        one.replace(columns={**one.columns, "temp1_C": other.columns["temp1_C"]})
        for one, other in ((some[0], some[3]), (some[3], some[0]))
    )
    assert not orders_of(servo_data(some, 1))


def test_the_sentence_fits_into_two_lines() -> None:
    some = [effect_of("stribeck", f"joint_number_{k}", 0.5 - 0.1 * k) for k in range(2)]
    some += [effect_of(name, "elbow", 0.1) for name in ("delay", "drive_law", "backlash", "spring")]
    said = causes(some)
    assert said == (
        "dry friction that falls with speed (joint_number_0, joint_number_1), a delay from command to torque"
        " (elbow), a drive whose torque does not grow in proportion with the effort (elbow) and 2 smaller"
    )
    assert len(said) < 220


def effect_of(effect: str, joint: str, share: float) -> FoundServoEffect:
    return FoundServoEffect(effect, (joint,), False, 0.9, (), share, (share, share), 0.1, 0.0)


def usual_of(value: float, standard: float, before: float, sure: float = 1.0) -> FoundServoEffect:
    """The gain of the file is 10; with the usual parameters 0.01 rad are left."""
    gain = ServoParameter("command_gain.elbow", value, 0.1, "Nm/rad", 10.0, standard)
    return FoundServoEffect("command_gain", ("elbow",), True, sure, (gain,), 0.2, (0.2, 0.2), before, 0.01)


def test_a_usual_parameter_that_the_file_has_otherwise_is_told() -> None:
    weak = usual_of(8.0, 8.0, 0.05)
    assert departing([weak, usual_of(9.9, 9.9, 0.0101), effect_of("delay", "elbow", 0.5)]) == [weak]
    assert departing([usual_of(8.0, 8.0, 0.05, sure=0.0)]) == []
    assert departing([usual_of(9.9, 7.0, 0.05)]) == []  # a name beside it takes its place
    assert departing([usual_of(8.0, 8.0, 0.012)]) == []  # most of the error is something else


@pytest.mark.parametrize(
    ("without", "of_class", "said"),
    [
        (0.05, 0.9, None),  # [rad] error without the effect; with it 0.01
        (0.05, 0.1, "so little"),
        (0.0105, 0.9, "not predicted better"),
        (0.009, 0.9, "not predicted better"),
    ],
)
def test_a_name_needs_held_out_motion(without: float, of_class: float, said: str | None) -> None:
    rows = np.ones((100, 1))
    held = [0.2 * rows, 0.05 * rows, 0.01 * rows, without * rows]
    found = vetoed([Sureness(of_class, (), of_class)], held, np.arange(100) // 10, np.array([1e-3]), [0])
    assert found is None if said is None else found is not None and said in found[1]


def test_a_name_moves_the_arm_by_more_than_encoders_show() -> None:
    rows = np.ones((100, 1))
    held = [0.2 * rows, 5e-4 * rows, 1e-4 * rows, 5e-4 * rows]
    sure = [Sureness(0.9, (), 0.9)]
    blocks = np.arange(100) // 10
    assert vetoed(sure, held, blocks, np.array([3e-4]), [0]) is None
    found = vetoed(sure, held, blocks, np.array([5e-4]), [0])
    assert found is not None and "encoders" in found[1]


BLOCKS = np.arange(400) // 20


def removed(before: Floats, after: Floats) -> tuple[bool, bool]:
    """By block, of a joint where the usual parameters leave 1."""
    return removes(*(one[BLOCKS, None] for one in (before, after, np.ones(20))), BLOCKS)


def test_held_out_errors_fall_for_certain_in_a_few_seconds_or_in_most() -> None:
    """In six blocks of twenty; in all, though nearly all of it in one; in as many as they rise in."""
    few, random = np.ones(20), np.ones(20)
    few[:6], few[6:], random[::2], random[1::2] = 0.3, 1.005, 1.3, 0.6
    assert removed(np.ones(20), few)[0]
    assert removed(np.append([5.0], np.ones(19)), np.append([0.5], np.full(19, 0.9)))[0]
    assert not removed(np.ones(20), random)[0]


def test_held_out_errors_fall_by_enough_of_what_others_leave() -> None:
    """A tenth of what is there without a name, and 3 % of what other names removed there."""
    left = np.full(20, np.sqrt(0.15))
    assert removed(left, np.full(20, np.sqrt(0.10)))[1]
    assert not removed(left, np.full(20, np.sqrt(0.12)))[1]
    assert not removed(np.full(20, np.sqrt(0.05)), np.full(20, np.sqrt(0.03)))[1]
    assert not removed(np.ones(20), np.full(20, np.sqrt(0.92)))[1]


def test_a_rival_that_explains_nearly_as_much_shares_the_name() -> None:
    """Seed 3: a column, and what two others do as well as it by a half and by nothing."""
    weight = Weight(np.array([10.0]), np.array([1.0]), 500.0, Point(np.zeros((1, 1))))
    rank = Rank(0, 500.0, 0.9, np.ones(1), np.ones(1), 1.0)
    one, other = (Candidate(name, 0, ("j",), (), label=name) for name in ("spring", "payload"))
    alone = sure_of(1, one, [other], weight, [rank], [], False)
    assert alone.probability == pytest.approx(alone.of_class) and alone.probability > 0.9
    shared = sure_of(1, one, [other], weight, [rank], [Refit(other, 0.0, 500.0)], False)
    assert shared.probability == pytest.approx(0.5 * alone.probability)
    assert shared.of_class == pytest.approx(alone.of_class)
    assert shared.confounded == ((other, pytest.approx(shared.probability)),)
    far = sure_of(1, one, [other], weight, [rank], [Refit(other, 100.0, 500.0)], False)
    assert not far.confounded


def test_a_limit_of_the_file_goes_with_what_all_torques_share(file: Path) -> None:
    limited = PENDULUM.replace('kp="4"', 'kp="4" forcerange="-2 2"')
    file.write_text(limited, encoding="utf-8")
    nominal = point_of(prepared_of(file, [resting(0)]).arm.nominal)
    all_of_them = ("command_gain", "viscous", "coulomb", "armature")

    def limit(**factors: float) -> float:
        point = nominal
        for name, factor in factors.items():
            point = point.with_value(0, name, factor * point.value(0, name))
        return with_limits(point, nominal).value(0, "saturation")

    assert limit() == 2.0
    assert limit(**dict.fromkeys(all_of_them, 3.0)) == pytest.approx(6.0)
    assert limit(command_gain=0.5, viscous=0.3, coulomb=0.4, armature=0.2) == pytest.approx(
        2.0 * math.sqrt(0.12)
    )
    assert limit(command_gain=5.0) == 2.0
    assert limit(command_gain=5.0, viscous=0.2, coulomb=3.0, armature=2.0) == 2.0


def turntable(scale: float) -> str:
    """A body about the vertical; its inertia alone says how large torques are."""
    limit = 0.4 * scale
    return f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody><body name="b">
      <joint name="j" axis="0 0 1" damping="{0.04 * scale}" frictionloss="{0.02 * scale}"
        armature="{5e-4 * scale}" solreffriction="0.004 1"/>
      <inertial pos="0 0 0" mass="0.5" diaginertia="2e-3 2e-3 2e-3"/></body></worldbody>
      <actuator><position joint="j" kp="{5.0 * scale}" forcerange="{-limit} {limit}"/></actuator></mujoco>"""


def stepped(text: str) -> Floats:
    """Angle after a command of 1.5 rad, which the torque's limit holds back [rad]."""
    model = mujoco.MjModel.from_xml_string(text)
    data, out = mujoco.MjData(model), []
    data.ctrl[:] = 1.5
    for _ in range(round(0.4 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        out.append(data.qpos[0])
    return np.interp(np.linspace(0.0, 0.4, 50), model.opt.timestep * np.arange(1, len(out) + 1), out)


def test_an_exported_limit_has_the_torques_scale(tmp_path: Path) -> None:
    """The file's torques are all thirty times too large; recorded motion does not reach a limit."""
    file = tmp_path / "table.xml"
    file.write_text(turntable(1.0), encoding="utf-8")
    command = 0.2 * commands(0) * np.minimum(1.0, np.arange(500) / 40.0)[:, None]
    rest = recording("r", command, 0.0 * command)
    of = prepare(file, [rest], window=np.inf)
    motion, torque = of.simulator.run([point_of(of.arm.nominal)], of.windows, torques=True)
    assert np.abs(torque[0]).max() < 0.35
    file.write_text(turntable(30.0), encoding="utf-8")
    moved = rest.replace(position=np.concatenate([np.zeros((1, 1)), motion[0]]))
    of = prepare(file, [moved], window=np.inf)
    fitter = Fitter(Apart(of.simulator), rows_of(of.data, of.windows))
    chain = chain_of(groundwork(fitter, point_of(of.arm.nominal), of.data)[0].point, of.arm.nominal)
    assert chain.drives[0].saturation < 1.0  # of 12 in the file; the scale itself is hardly seen
    uses = uses_of(chain, [moved])
    text, _ = write_mjcf(chain, held(chain, uses), uses, file)
    wanted = stepped(turntable(1.0))
    assert np.abs(stepped(text) - wanted).max() < 0.05
    assert np.abs(stepped(turntable(1.0).replace("0.4", "12")) - wanted).max() > 0.3


def test_commands_are_those_of_their_rows_where_times_are_rounded() -> None:
    """Thirty rows a second, in single precision: even rows end a rounding before those of the recording."""
    command = commands(0)
    time = np.float32(np.arange(len(command)) / 30.0).astype(float)
    stream = servo_data([_core.Recording("r", time=time, position=command, command=command)], 1).streams[0]
    assert np.array_equal(stream.command, command[: len(stream.command)])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joints": ["swing", "no"]}, "there is no joint no"),
        ({"window": 0.0}, "window"),
        ({"test_share": 1.5}, "test_share"),
    ],
)
def test_options_that_cannot_be_used_are_refused(file: Path, change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        prepare(file, [resting(0)], **change)  # type: ignore[arg-type]


def test_recordings_that_cannot_be_used_are_refused(file: Path) -> None:
    good = resting(0)
    bad = np.array(good.command)
    bad[7] = np.nan
    with pytest.raises(InputError, match="r0: command of joint 1, row 8"):
        prepare(file, [good.replace(command=bad)])
    with pytest.raises(InputError, match="r0: there are no commands"):
        prepare(file, [good.replace(command=np.zeros((len(good), 0)))])
    with pytest.raises(InputError, match="there is no such file"):
        prepare(file.with_name("no.xml"), [good])


def test_a_free_body_is_refused(file: Path) -> None:
    file.write_text(
        PENDULUM.replace('<joint name="swing" axis="0 1 0"', '<freejoint name="swing"/><!--')
        .replace('armature="0.004"/>', "-->")
        .split("<actuator>")[0]
        + "</mujoco>",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="is free or a ball"):
        prepare(file, [resting(0)])


def test_a_point_is_its_chain(file: Path) -> None:
    of = prepared_of(file, [resting(0)])
    assert isinstance(point_of(of.arm.nominal), Point)
    assert point_of(of.arm.nominal).value(0, "command_gain") == 4.0
    assert point_of(of.arm.nominal).value(0, "viscous") == pytest.approx(0.07)
