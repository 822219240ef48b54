# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands that change more seldom than rows are recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo import servo_diagnose
from truing.dynamics.servo.api import prepare
from truing.dynamics.servo.beats import as_held, beat_of, rare_beat, smooth, straight
from truing.dynamics.servo.simulator import point_of

pytest.importorskip("mujoco")

Floats = NDArray[np.float64]
ROW, BEAT = 0.02, 0.05  # [s]
ARM = """<mujoco>
  <worldbody>
    <body name="arm" pos="0 0 1">
      <joint name="lift" axis="0 1 0" damping="1.2" frictionloss="0.05" armature="0.03"/>
      <inertial pos="0.1 0 0" mass="0.5" diaginertia="1e-3 1e-3 1e-3"/>
      <body name="hand" pos="0.2 0 0">
        <joint name="wrist" axis="0 1 0" damping="0.3" frictionloss="0.02" armature="0.01"/>
        <inertial pos="0.05 0 0" mass="0.2" diaginertia="2e-4 2e-4 2e-4"/>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="lift" kp="40"/><position joint="wrist" kp="8"/></actuator>
</mujoco>
"""


def wanted(t: Floats, number: int = 0) -> Floats:
    random = np.random.default_rng(number)
    rates, sizes = random.uniform(0.1, 0.5, (2, 4)), random.uniform(0.1, 0.3, (2, 4))
    waves = [np.sin(2.0 * np.pi * np.outer(t, rate)) @ size for rate, size in zip(rates, sizes, strict=True)]
    return np.column_stack(waves) * np.clip(t - 0.2, 0.0, 1.0)[:, None] ** 2  # from rest


def held(t: Floats, number: int = 0) -> Floats:
    return wanted(BEAT * np.floor(t / BEAT + 1e-9), number)


def filled_in(t: Floats, number: int = 0) -> Floats:
    """In a straight line to what was sent last."""
    beat = np.floor(t / BEAT + 1e-9)
    part = (t / BEAT - beat)[:, None]
    last, now = wanted(np.maximum(BEAT * (beat - 1.0), 0.0), number), wanted(BEAT * beat, number)
    return last + part * (now - last)


def recorded(t: Floats, command: Floats, position: Floats | None = None) -> _core.Recording:
    position = np.zeros_like(command) if position is None else position
    return _core.Recording("r", time=t, position=position, command=command)


def test_a_beat_is_found_that_is_no_whole_number_of_rows() -> None:
    t = ROW * np.arange(400)
    beat = beat_of(recorded(t, held(t)))
    assert beat is not None and beat.period == pytest.approx(BEAT, rel=1e-6)
    assert (beat.first / BEAT) == pytest.approx(round(beat.first / BEAT), abs=1e-3)


@pytest.mark.parametrize(
    "command",
    [
        lambda t: wanted(t),  # at every row
        lambda t: wanted(0.8 * np.floor(t / 0.8)),  # steps
        lambda t: wanted(
            np.maximum.accumulate(np.round(t + np.random.default_rng(1).uniform(0, 0.2, t.size), 1))
        ),
        lambda t: np.zeros((t.size, 2)),
    ],
)
def test_other_commands_have_no_beat(command: Callable[[Floats], Floats]) -> None:
    t = ROW * np.arange(400)
    assert beat_of(recorded(t, command(t))) is None


def test_steps_of_another_recording_are_on_the_same_beat() -> None:
    t = ROW * np.arange(400)
    steps = rare_beat(recorded(t, wanted(0.8 * np.floor(t / 0.8 + 1e-9))), BEAT)
    assert steps is not None and steps.period == BEAT
    assert steps.first / BEAT == pytest.approx(round(steps.first / BEAT), abs=1e-6)
    others = wanted(0.43 * np.floor(t / 0.43))  # no multiple of the period
    assert rare_beat(recorded(t, others), BEAT) is None
    assert rare_beat(recorded(t, np.zeros((t.size, 2))), BEAT) is None


def test_rows_have_what_was_held_on_their_average() -> None:
    t = ROW * np.arange(400)
    one = recorded(t, held(t))
    beat = beat_of(one)
    assert beat is not None
    fine = t[100:-20, None] + ROW * (np.arange(200) + 0.5) / 200

    def mean(of: Callable[[Floats], Floats]) -> Floats:
        return of(fine.ravel()).reshape(*fine.shape, 2).mean(axis=1)

    def off(command: Floats, of: Callable[[Floats], Floats]) -> float:
        return float(np.abs(command[100:-20] - mean(of)).max())

    assert off(as_held(one, beat).command, held) < 1e-9 < 0.01 < off(one.command, held)
    logged, lines = off(smooth(one, beat).command, wanted), off(straight(one, beat).command, wanted)
    assert logged < 0.5 * lines < 0.05 * off(one.command, wanted)


@pytest.mark.parametrize(
    ("sent", "said", "late"),
    [(held, "held until the next", None), (filled_in, "as if they went on between", 50.0)],
)
def test_the_motion_tells_what_commands_were_between(
    tmp_path: Path, sent: Callable[[Floats, int], Floats], said: str, late: float | None
) -> None:
    """Simulated at 200 Hz, recorded at 50."""
    file = tmp_path / "arm.xml"
    file.write_text(ARM, encoding="utf-8")
    fine = 0.005 * np.arange(1600)
    recordings = []
    for number in range(4):
        command = sent(fine, number) - sent(fine[:1], number)
        of = prepare(file, [recorded(fine, command)], window=np.inf)
        moved = of.simulator.run([point_of(of.arm.nominal)], of.windows)[0][0]
        position = np.concatenate([np.zeros((1, 2)), moved])[::4]
        noise = 3e-4 * np.random.default_rng(number).standard_normal(position.shape)
        shown = held(fine, number)[::4] - held(fine[:1], number)
        recordings.append(recorded(fine[::4], shown, position + noise).replace(name=f"r{number}"))
    found = servo_diagnose(file, recordings)
    assert any("every 50 ms" in text and said in text for text in found.warnings)
    named = [one for one in found.effects if not one.standard]
    if late is None:
        assert not named
    else:
        assert [(one.effect, one.joints) for one in named] == [("delay", ())]
        assert float(found.sentence.split("arrive ")[1].split(" ms")[0]) == pytest.approx(late, abs=3.0)
