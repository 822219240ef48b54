# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What comes and goes while a robot is recorded, and nobody told: a load, a push at its tool."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from truing.dynamics import Recording, check_recordings, diagnose, load_recordings, predict, with_payload
from truing.dynamics.sanity import RecordingFinding, gravity
from truing.dynamics.sanity.findings import FoundParameter
from truing.dynamics.told import FoundLoad, sentence_of
from truing.files import load_robot
from truing.model import AppliedEffect, Robot
from truing.testing.dynamics import NOISE, USUAL, coloured_noise, demo_arm, fourier_motion

REAL = Path(os.environ.get("TRUING_REALDATA", ""))
PLACE = (0.02, -0.04, 0.11)  # [m]
SECONDS = 24.0
FINDING = "load_comes_and_goes"
PUSHED = "tool_pushed"


def there(recording: Recording, seed: int) -> NDArray[np.float64]:
    """1 while something hangs at the tool, for two to five seconds each time. shape=(n,)"""
    rng = np.random.default_rng([31, seed])
    time = np.asarray(recording.time)
    changes = time[0] + np.cumsum(rng.uniform(2.0, 5.0, int((time[-1] - time[0]) / 2.0) + 2))
    return np.searchsorted(changes, time) % 2 == 1


def carrying(recording: Recording, masses: Sequence[float], seed: int) -> Recording:
    """The recording with columns that say what it carries: these, one after the other."""
    at = there(recording, seed)
    number = np.cumsum(np.diff(at.astype(int), prepend=0) > 0)
    mass = np.array(masses)[(number - 1) % len(masses)] * at
    loaded = with_payload([recording], 1.0, PLACE)[0]
    columns = {name: np.where(at, values, 0.0) for name, values in loaded.columns.items()}
    return loaded.replace(columns={**columns, "payload_kg": mass})


def untold(*masses: float, count: int = 3, always: bool = False, seconds: float = SECONDS) -> list[Recording]:
    """Torques of the demo's arm that picks such masses up, without a column that says so. always: it holds
    the first all the time.
    """
    arm = demo_arm()
    arm.torque_effects = [
        AppliedEffect(effect, [joint.name], {f"{effect}.{joint.name}": values[k]})
        for joint, values in zip(arm.joints, USUAL, strict=True)
        for k, effect in enumerate(("coulomb", "viscous"))
    ]
    out = []
    for seed in range(count):
        time = np.arange(0.0, seconds, 0.01)
        q = fourier_motion(time, 6, np.random.default_rng([32, seed]))
        one = Recording(f"pick{seed}", time=time, position=q)
        loaded = with_payload([one], masses[0], PLACE)[0] if always else carrying(one, masses, seed)
        torque = np.asarray(predict(arm, loaded, cutoff=30.0).torque)
        noise = coloured_noise(torque.shape, np.random.default_rng([33, seed])) * NOISE * torque.std(axis=0)
        out.append(one.replace(torque=torque + noise))
    return out


def said(findings: Sequence[RecordingFinding], name: str = FINDING) -> RecordingFinding:
    (found,) = [one for one in findings if one.finding in (FINDING, PUSHED)]
    assert found.finding == name
    return found


def pushed(arm: Robot, recording: Recording, force: Sequence[float], seed: int) -> NDArray[np.float64]:
    """Torques that hold a force [N] at the tool, in the base frame, while it is there. shape=(n, joints)"""
    by_force = gravity.held_against(arm, np.asarray(recording.position)) @ np.array(force)
    return np.asarray(by_force * there(recording, seed)[:, None])


def test_what_is_picked_up_and_set_down_is_found_with_its_times() -> None:
    recordings = untold(3.0)
    checked = check_recordings(demo_arm(), recordings)
    found = said(checked.findings)
    assert found.applied and found.recordings == tuple(one.name for one in recordings)
    assert found.value == pytest.approx(3.0, rel=0.03)
    for seed, one in enumerate(checked.recordings):
        at = there(one, seed)
        spans = [span for name, *span in found.spans if name == one.name]
        assert sum(end - begin for begin, end in spans) == pytest.approx(0.01 * at.sum(), rel=0.05)
        mass = np.asarray(one.columns["payload_kg"])
        assert np.mean((mass > 0.0) == at) > 0.97
        assert np.array_equal(mass > 0.0, np.asarray(one.columns["payload_found"]) > 0.0)
        hangs = [one.columns[f"payload_{axis}_m"][mass > 0.0][0] for axis in "xyz"]
        assert hangs == pytest.approx(PLACE, abs=0.006)
    named = [one.effect for one in diagnose(checked.robot, checked.recordings).effects]
    assert "link_inertia" not in named and "payload" not in named


def test_different_loads_are_told_apart() -> None:
    findings = check_recordings(demo_arm(), untold(2.0, 4.0, seconds=60.0)).findings
    found = [one for one in findings if one.finding == FINDING]
    assert [one.value for one in found] == [pytest.approx(mass, rel=0.04) for mass in (2.0, 4.0)]


@pytest.mark.parametrize(("mass", "count"), [(0.0, 3), (3.0, 1), (3.0, 3)])
def test_what_always_hangs_there_does_not_come_and_go(mass: float, count: int) -> None:
    recordings = untold(mass, count=count, always=True)
    assert not {FINDING, PUSHED} & {one.finding for one in check_recordings(demo_arm(), recordings).findings}


def test_on_unknown_drives_it_is_asked_to_weigh_it() -> None:
    constants = np.array((12.0, 11.0, 9.5, 4.0, 4.5, 3.5))
    made = [one.replace(torque=None, current=np.asarray(one.torque) / constants) for one in untold(5.0)]
    found = said(check_recordings(demo_arm(), made).findings)
    assert found.mistake and not found.applied and "0 where there is none" in found.evidence


def test_a_stated_load_is_not_looked_for() -> None:
    stated = [carrying(one, (3.0,), seed) for seed, one in enumerate(untold(3.0))]
    assert FINDING not in [one.finding for one in check_recordings(demo_arm(), stated).findings]


@pytest.mark.parametrize("force", [(0.0, 0.0, 60.0), (40.0, -30.0, 0.0)])
def test_rows_in_which_the_tool_is_pushed_are_left_out(force: tuple[float, float, float]) -> None:
    arm, free = demo_arm(), untold(0.0)
    recordings = [
        one.replace(torque=np.asarray(one.torque) + pushed(arm, one, force, seed))
        for seed, one in enumerate(free)
    ]
    checked = check_recordings(arm, recordings)
    found = said(checked.findings, PUSHED)
    assert found.applied and found.value == pytest.approx(np.linalg.norm(force), rel=0.1)
    for seed, (one, whole) in enumerate(zip(checked.recordings, free, strict=True)):
        at = there(whole, seed)
        kept = np.isin(np.asarray(whole.time), np.asarray(one.time))
        assert np.mean(at[kept]) < 0.01 and kept.sum() > 0.6 * (~at).sum()


def real(name: str, constants: Sequence[float] = ()) -> tuple[Robot, list[Recording]]:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / name).exists():
        pytest.skip(f"TRUING_REALDATA does not hold {name}")
    robot = load_robot(REAL / name / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), constants, strict=False):
        robot.joints[index].torque_per_ampere = gain
    files = [file for file in sorted((REAL / name).glob("*.csv")) if not file.stem.endswith("_load")]
    return robot, [one.replace(columns={}) for one in load_recordings(files, robot)]


UR10E_CONSTANTS = (10.0, 10.6956, 8.4566, 9.0029, 9.48, 10.1232)  # [Nm/A] published beside the recordings


@pytest.mark.realdata
@pytest.mark.parametrize(
    ("name", "constants"), [("dyn_ur10e", UR10E_CONSTANTS), ("dyn_ur10", ()), ("dyn_tx40", ())]
)
def test_real_arms_that_pick_nothing_up_are_not_said_to(name: str, constants: Sequence[float]) -> None:
    robot, recordings = real(name, constants)
    for some in (recordings, *([one] for one in recordings)):
        assert not {FINDING, PUSHED} & {one.finding for one in check_recordings(robot, some).findings}


@pytest.mark.realdata
@pytest.mark.parametrize(
    ("name", "constants", "rel"), [("dyn_ur10e", UR10E_CONSTANTS, 0.05), ("dyn_ur10", (), 0.15)]
)
def test_a_load_put_into_torques_of_real_arms_is_found(
    name: str, constants: Sequence[float], rel: float
) -> None:
    robot, recordings = real(name, constants)
    loaded = []
    for seed, one in enumerate(recordings):
        with_it, without = (
            np.asarray(predict(robot, version).torque) for version in (carrying(one, (1.5,), seed), one)
        )
        current = np.asarray(one.current) * constants if constants else np.asarray(one.torque)
        loaded.append(one.replace(current=None, torque=current + with_it - without))
    found = said(check_recordings(robot, loaded).findings)
    assert found.value == pytest.approx(1.5, rel=rel)


@pytest.mark.realdata
def test_a_push_put_into_torques_of_a_real_arm_is_found() -> None:
    robot, recordings = real("dyn_ur10e", UR10E_CONSTANTS)
    force = (15.0, -10.0, 10.0)
    torques = [np.asarray(one.current) * UR10E_CONSTANTS for one in recordings]
    touching = [
        one.replace(current=None, torque=torque + pushed(robot, one, force, seed))
        for seed, (one, torque) in enumerate(zip(recordings, torques, strict=True))
    ]
    found = said(check_recordings(robot, touching).findings, PUSHED)
    assert found.applied and found.value == pytest.approx(np.linalg.norm(force), rel=0.15)


def test_several_loads_are_one_sentence() -> None:
    def load(mass: float, *recordings: str) -> FoundLoad:
        return FoundLoad(recordings, (FoundParameter("payload.m", mass, 0.01, "kg"),), f"a load of {mass} kg")

    assert sentence_of([]) == "" and sentence_of([load(0.5, "a")]) == "a load of 0.5 kg"
    said_of_all = sentence_of([load(0.5, "a"), load(1.0, "a", "b"), load(2.0, "b")])
    assert said_of_all == "a and b carry loads of 0.50, 1.00 and 2.00 kg that nobody told"
