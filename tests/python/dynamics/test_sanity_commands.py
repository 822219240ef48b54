# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands of servo arms beside what their joints did: units, signs and order are said or corrected."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from truing import _core
from truing.dynamics import CheckedRecordings, Recording, RecordingFinding, check_recordings, load_recordings
from truing.dynamics.sanity import check_commands
from truing.dynamics.sanity.commands import other_order
from truing.testing.dynamics import demo_arm

Floats = NDArray[np.float64]
REAL = Path(os.environ.get("TRUING_REALDATA", ""))
ARM = demo_arm()
JOINTS = [joint.name for joint in ARM.joints]
STEP, LATE = 0.02, 0.06  # [s]


def recorded(seed: int, short: float = 1.0) -> Recording:
    """Joints that go where they are sent, a little late, `short` of the way, and not for sure."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, STEP)
    u = sum(
        0.3 * np.sin(2.0 * math.pi * f * t[:, None] + random.uniform(0.0, 6.0, 6)) for f in (0.11, 0.31, 0.7)
    )
    before = np.column_stack([np.interp(t - LATE, t, column) for column in np.asarray(u).T])
    return Recording(
        f"r{seed}", time=t, position=short * before + random.normal(0.0, 1e-3, u.shape), command=u
    )


MOTIONS = [recorded(seed) for seed in (1, 2)]


def changed(**tables: Callable[[Recording], Any]) -> CheckedRecordings:
    made = [one.replace(**{name: of(one) for name, of in tables.items()}) for one in MOTIONS]
    return check_recordings(ARM, made)


def only(checked: CheckedRecordings) -> RecordingFinding:
    assert len(checked.findings) == 1, [one.evidence for one in checked.findings]
    return checked.findings[0]


@pytest.mark.parametrize("short", [1.0, 0.3])
def test_of_commands_that_joints_follow_nothing_is_said(short: float) -> None:
    recordings = [recorded(seed, short) for seed in (3, 4)]
    checked = check_recordings(ARM, recordings)
    assert checked.findings == () and list(checked.recordings) == recordings


def test_commands_in_degrees_are_converted() -> None:
    checked = changed(command=lambda one: np.degrees(one.command))
    assert only(checked).finding == "command_unit" and only(checked).applied
    for one, other in zip(checked.recordings, MOTIONS, strict=True):
        assert np.allclose(one.command, other.command, atol=1e-12)


def test_angles_and_commands_in_degrees_are_converted_where_limits_prove_it() -> None:
    both = {name: (lambda one, name=name: np.degrees(getattr(one, name))) for name in ("position", "command")}
    checked = changed(**both)
    assert only(checked).finding == "position_unit" and only(checked).applied
    for one, other in zip(checked.recordings, MOTIONS, strict=True):
        assert np.allclose(one.command, other.command) and np.allclose(one.position, other.position)


def test_a_joint_that_goes_the_other_way_is_a_mistake() -> None:
    checked = changed(command=lambda one: one.command * np.array([1, 1, -1, 1, 1, 1]))
    assert only(checked).finding == "command_sign" and only(checked).mistake
    assert only(checked).joints == (JOINTS[2],)


def test_commands_in_another_order_are_a_mistake() -> None:
    checked = changed(command=lambda one: np.asarray(one.command)[:, [0, 2, 1, 3, 4, 5]])
    assert only(checked).finding == "command_order" and only(checked).mistake
    assert only(checked).joints == (JOINTS[1], JOINTS[2])
    assert f"u3 is that of {JOINTS[1]}" in only(checked).evidence


def test_ticks_are_a_mistake_that_names_them() -> None:
    ticks = np.array([1, 1, 1, 1, 1, 4096 / (2.0 * math.pi)])
    checked = changed(command=lambda one: one.command * ticks)
    assert only(checked).finding == "command_unit" and only(checked).mistake
    assert only(checked).joints == (JOINTS[5],) and "4096 a turn" in only(checked).evidence


def test_rows_that_repeat_the_last_angles_in_the_middle_of_a_motion_are_left_out() -> None:
    position = np.array(MOTIONS[0].position)
    position[300:312] = position[299]
    stuck = MOTIONS[0].replace(position=position)
    checked = check_recordings(ARM, [stuck, MOTIONS[1]])
    assert only(checked).finding == "frozen" and only(checked).applied and only(checked).value == 12
    kept = np.delete(np.arange(len(position)), np.arange(300, 312))
    assert np.array_equal(checked.recordings[0].position, position[kept])


def test_no_order_is_told_where_two_joints_are_like_one_command() -> None:
    both = np.array([[0.1, 0.99, 0.0], [0.2, 0.99, 0.0], [0.0, 0.0, 0.99]])
    assert other_order(both) is None
    assert other_order(both[[1, 0, 2]][:, [1, 0, 2]]) is None
    assert other_order(np.array([[0.1, 0.99], [0.98, 0.2]])) == (1, 0)


@pytest.mark.realdata
@pytest.mark.parametrize(("folder", "tip"), [("dyn_so101", "gripper"), ("dyn_xl330", None)])
def test_of_real_servos_nothing_is_said(folder: str, tip: str | None) -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / folder).exists():
        pytest.skip(f"TRUING_REALDATA does not hold {folder}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the jaw moves off the chain
        robot = truing.load_robot(REAL / folder / "robot.xml", any_tool=True, tip_link=tip)
    recordings = load_recordings(str(REAL / folder / "*.csv"), robot)
    assert check_recordings(robot, recordings).findings == ()


def held_up(seed: int) -> Recording:
    """Commands are ahead of the angles by what torque takes of a stiff servo, whose noise is small."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 0.01)
    q = np.sum(
        [0.35 * np.sin(2.0 * math.pi * f * t[:, None] + random.uniform(0.0, 6.0, 6)) for f in (0.11, 0.31)],
        axis=0,
    )
    qd = np.gradient(q, t, axis=0)
    torque = np.asarray(_core.rigid_torques(ARM, q, qd, np.gradient(qd, t, axis=0)))
    scale = torque.std(axis=0)
    lead = (torque + 0.3 * scale * np.tanh(qd / 0.01)) / (40.0 * scale) + 0.02 * qd
    return Recording(f"s{seed}", time=t, position=q, command=q + lead + random.normal(0.0, 1e-4, q.shape))


def test_angles_of_servos_counted_from_another_zero_or_the_other_way_are_a_mistake() -> None:
    recordings = [held_up(seed) for seed in (5, 6)]
    assert check_recordings(ARM, recordings).findings == ()
    signs, zero = np.array([1, 1, -1, 1, 1, 1]), np.array([0, 0.5 * math.pi, 0, 0, 0, 0])
    moved = [
        one.replace(position=one.position * signs + zero, command=one.command * signs + zero)
        for one in recordings
    ]
    said = only(check_recordings(ARM, moved))
    assert said.finding == "angle_convention" and said.mistake
    assert f"{JOINTS[1]} minus 90°, {JOINTS[2]} with the opposite sign" in said.evidence
    assert check_commands(ARM, moved).findings == (), "by themselves they are sound"
