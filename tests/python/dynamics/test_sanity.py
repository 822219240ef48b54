# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sanity of recordings: every mistake is said with its number, what is certain is corrected, and of clean
recordings nothing is said.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truing
from truing import _core
from truing.dynamics import (
    CheckedRecordings,
    Recording,
    RecordingFinding,
    check_recordings,
    diagnose,
    load_recordings,
    predict,
)
from truing.dynamics.magnitudes import are_magnitudes, commands_for_magnitudes
from truing.dynamics.sanity import loads
from truing.dynamics.sanity.columns import resolution
from truing.dynamics.sanity.grids import grids_of
from truing.dynamics.sanity.jumps import spikes
from truing.dynamics.sanity.readings import rows_of
from truing.dynamics.servo import by_commands
from truing.dynamics.told import told
from truing.errors import InputError
from truing.files import write_table
from truing.testing.dynamics import HIDDEN, USUAL, demo_arm, simulate_motion

Floats = NDArray[np.float64]
REAL = Path(os.environ.get("TRUING_REALDATA", ""))
SIMULATED = simulate_motion(seed=5, seconds=14.0, recordings=3, held_out=1)
ARM, MOTIONS = SIMULATED.nominal, SIMULATED.recordings
STEP = 0.01  # [s]


def with_fields(motions: list[Recording] = MOTIONS, **fields: Callable[[Recording], Any]) -> list[Recording]:
    """Each recording with fields made anew from it."""
    return [one.replace(**{name: make(one) for name, make in fields.items()}) for one in motions]


def column(table: Any, k: int, change: Callable[[Floats], Any]) -> Floats:
    """A table with one column changed."""
    out = np.array(table)
    out[:, k] = change(out[:, k])
    return out


def speed_of(one: Recording) -> Floats:
    return np.asarray(np.gradient(one.position, one.time, axis=0))


def later(table: Any, rows: int) -> Floats:
    """Every row so many rows later."""
    held = np.repeat(np.asarray(table)[:1], rows, axis=0)
    return np.vstack([held, np.asarray(table)[: len(table) - rows]])


def only(checked: CheckedRecordings) -> RecordingFinding:
    assert len(checked.findings) == 1, [one.evidence for one in checked.findings]
    return checked.findings[0]


def kinds(checked: CheckedRecordings) -> list[str]:
    return [one.finding for one in checked.findings]


# ---- Nothing is wrong ------------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_said_of_clean_recordings(seed: int) -> None:
    simulated = simulate_motion(seed=seed, seconds=12.0, recordings=3, hidden=HIDDEN if seed % 2 else {})
    recordings = with_fields(simulated.recordings, speed=speed_of)
    checked = check_recordings(simulated.nominal, recordings)
    assert checked.findings == ()
    assert checked.robot is simulated.nominal
    assert all(one is other for one, other in zip(checked.recordings, recordings, strict=True))


@pytest.mark.parametrize("effect", ["spring.J1", "armature.J6", "current_offset.J4"])
def test_large_effects_that_the_model_lacks_are_no_mistakes(effect: str) -> None:
    name, joint = effect.split(".")
    hidden = {name: ([joint], {effect: {"spring": 40.0, "armature": 2.0, "current_offset": 30.0}[name]})}
    simulated = simulate_motion(seed=6, seconds=12.0, recordings=3, hidden=hidden)
    assert check_recordings(simulated.nominal, simulated.recordings).findings == ()


@pytest.mark.realdata
@pytest.mark.parametrize("folder", ["dyn_ur10", "dyn_tx40", "dyn_ur10e"])
def test_of_real_recordings_only_what_is_known_of_them_is_said(folder: str) -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / folder).exists():
        pytest.skip(f"TRUING_REALDATA does not hold {folder}")
    robot = truing.load_robot(REAL / folder / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), (10.0, 10.7, 8.5, 9.0, 9.5, 10.1), strict=True):
        robot.joints[index].torque_per_ampere = gain
    found = check_recordings(robot, load_recordings(str(REAL / folder / "*.csv"), robot)).findings
    expected = {
        "dyn_ur10": ["torques_low_passed", "one_recording"],
        "dyn_tx40": ["at_rest", "one_recording"],
        "dyn_ur10e": ["spikes", "load_place", "at_rest"],
    }
    assert [one.finding for one in found] == expected[folder]
    if folder == "dyn_ur10":
        assert found[0].value == pytest.approx(1.9, abs=0.1)
    rest = found[-1]
    if folder == "dyn_ur10e":  # one joint at a time, point to point
        assert {"single_j2", "single_j3", "single_j5", "ptp10"} <= set(
            rest.recordings
        ) and rest.value == 100.0


# ---- Friction of each recording ---------------------------------------------------------------------
FACTORS = (0.7, 1.0, 1.3)


def warmed(one: Recording, factor: float) -> Recording:
    """With so many times the friction of J2 and J5."""
    truth = SIMULATED.truth
    friction = predict(truth, one).torque - predict(truth.replace(torque_effects=[]), one).torque
    return one.replace(torque=one.torque + (factor - 1.0) * friction * np.array((0, 1, 0, 0, 1, 0)))


def test_friction_that_differs_from_recording_to_recording_is_no_noise() -> None:
    motions = [warmed(one, factor) for one, factor in zip(MOTIONS, FACTORS, strict=True)]
    checked = check_recordings(ARM, motions)
    finding = only(checked)
    assert finding.finding == "friction_differs" and not finding.mistake and not finding.applied
    assert {"J2"} <= set(finding.joints) <= {"J2", "J5"}
    assert finding.value == pytest.approx(100.0 * np.std(FACTORS), rel=0.35)
    nothing = SimpleNamespace(verdict="none", sentence="No gap beyond noise.")
    nothing.unknown = ()
    said = told(nothing, checked.findings)
    assert said.verdict == "unknown" and [one.joint for one in said.unknown] == [finding.joints[0]]
    assert said.sentence.startswith("Friction differs from recording to recording, by")
    quiet = told(nothing)
    assert (quiet.verdict, quiet.sentence, quiet.unknown) == ("none", "No gap beyond noise", ())
    warm = [one.replace(columns={"temp_C": np.full(len(one), 25.0 + k)}) for k, one in enumerate(motions)]
    assert check_recordings(ARM, warm).findings == ()  # a column may tell why


# ---- Magnitudes -------------------------------------------------------------------------------------
def without_sign(motions: list[Recording]) -> list[Recording]:
    return with_fields(motions, torque=lambda one: np.abs(one.torque))


def test_torques_without_their_sign_are_a_mistake_of_their_own() -> None:
    finding = only(check_recordings(ARM, without_sign(MOTIONS)))
    assert finding.finding == "torque_magnitude" and finding.mistake


def test_torques_that_hold_a_weight_all_the_time_are_no_magnitudes() -> None:
    """Two joints whose weight pulls to one side, the others at rest."""
    arm = demo_arm()
    time = np.arange(0.0, 10.0, STEP)
    position = np.zeros((len(time), len(arm.driven_joints())))
    position[:, 1] = position[:, 2] = 0.1 * np.sin(time)
    still = np.zeros_like(position)
    weight = np.asarray(_core.rigid_torques(arm, position, still, still))
    torque = np.abs(weight) + 0.01 * np.sign(np.cos(time))[:, None] * (np.abs(weight) > 1.0)
    recording = Recording("held", time=time, position=position, torque=torque)
    assert (np.abs(weight[:, 1:3]).min(axis=0) > 1.0).all()
    assert not are_magnitudes(arm, [recording])


def test_commands_take_the_place_of_magnitudes_and_of_nothing_else() -> None:
    commanded = with_fields(command=lambda one: one.position)
    assert all(one.torque.shape[1] for one in commands_for_magnitudes(ARM, commanded))
    with pytest.warns(truing.InputWarning, match="magnitudes"):
        taken = commands_for_magnitudes(ARM, without_sign(commanded))
    assert by_commands(taken)
    assert not by_commands(commands_for_magnitudes(ARM, without_sign(MOTIONS)))
    in_pieces = [one.replace(pieces=lambda one=one: iter([one]), end=1.0) for one in without_sign(commanded)]
    assert not by_commands(commands_for_magnitudes(ARM, in_pieces))


# ---- Which way is down --------------------------------------------------------------------------------
def tilted(arm: truing.Robot, angle: float, about: tuple[float, float, float]) -> truing.Robot:
    """The robot whose file says that gravity points elsewhere, turned by an angle [rad] (Rodrigues)."""
    down, axis = np.array(arm.gravity), np.array(about)
    out = arm.copy()
    out.gravity = down * math.cos(angle) + np.cross(axis, down) * math.sin(angle)
    return out


@pytest.mark.parametrize("angle", [0.4, 0.8, math.pi / 2, math.pi])
def test_a_robot_that_hangs_otherwise_than_its_file_says_is_turned(angle: float) -> None:
    checked = check_recordings(tilted(ARM, angle, (0.28, 0.96, 0.0)), MOTIONS)
    finding = only(checked)
    assert finding.finding == "gravity_direction" and finding.applied
    assert np.allclose(checked.robot.gravity, ARM.gravity, atol=1e-9)


def test_a_direction_of_gravity_off_the_coarse_ones_is_found_to_two_degrees() -> None:
    mounted = tilted(ARM, 0.7, (0.28, 0.96, 0.0))
    recordings = [  # as the mounted robot would feel it
        one.replace(
            torque=np.asarray(one.torque)
            + _core.rigid_torques(mounted, one.position, 0.0 * one.position, 0.0 * one.position)
            - _core.rigid_torques(ARM, one.position, 0.0 * one.position, 0.0 * one.position)
        )
        for one in MOTIONS
    ]
    found = np.array(check_recordings(ARM, recordings).robot.gravity)
    assert np.linalg.norm(found) == pytest.approx(9.81)
    assert np.degrees(np.arccos(found @ mounted.gravity / 9.81**2)) < 2.0


@pytest.mark.parametrize("size", [10.0, 60.0])
def test_a_force_at_the_tool_is_no_other_way_of_down(size: float) -> None:
    force = {"tool_force.x": 0.8 * size, "tool_force.y": 0.6 * size, "tool_force.z": 0.0}
    simulated = simulate_motion(seed=20, seconds=14.0, hidden={"tool_force": ([], force)})
    checked = check_recordings(simulated.nominal, simulated.recordings)
    assert "gravity_direction" not in kinds(checked)


@pytest.mark.realdata
def test_a_joint_that_moves_alone_tells_no_shift_of_its_recording() -> None:
    """In single_j3 of the UR10e its friction looked like torques that are 49 ms ahead."""
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10e").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10e")
    robot = truing.load_robot(REAL / "dyn_ur10e" / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), (10.0, 10.7, 8.5, 9.0, 9.5, 10.1), strict=True):
        robot.joints[index].torque_per_ampere = gain
    unloaded = [one for one in sorted((REAL / "dyn_ur10e").glob("*.csv")) if not one.stem.endswith("_load")]
    recordings = [one for one in load_recordings(unloaded, robot) if one.name not in ("ptp10", "single_j5")]
    assert "torque_shift" not in kinds(check_recordings(robot, recordings))


@pytest.mark.realdata
@pytest.mark.parametrize(("folder", "angle"), [("dyn_ur10", 0.35), ("dyn_tx40", 1.57), ("dyn_tx40", 3.14)])
def test_real_arms_are_found_to_stand_upright(folder: str, angle: float) -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / folder).exists():
        pytest.skip(f"TRUING_REALDATA does not hold {folder}")
    robot = truing.load_robot(REAL / folder / "robot.urdf", any_tool=True)
    recordings = load_recordings(str(REAL / folder / "*.csv"), robot)
    checked = check_recordings(tilted(robot, angle, (0.6, 0.8, 0.0)), recordings)
    assert "gravity_direction" in kinds(checked)
    assert np.allclose(checked.robot.gravity, robot.gravity, atol=1e-9)


@pytest.mark.realdata
def test_a_reading_that_leaves_far_more_is_no_rival_though_it_gains_nearly_as_much() -> None:
    """Of an arm on a wall, angles in degrees explain four fifths of what the right way of down explains."""
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10e").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10e")
    robot = truing.load_robot(REAL / "dyn_ur10e" / "robot.urdf", any_tool=True)
    files = [REAL / "dyn_ur10e" / f"{name}.csv" for name in ("h5_20s", "h8_20s", "h12_20s")]
    checked = check_recordings(tilted(robot, math.pi / 2, (0.0, 1.0, 0.0)), load_recordings(files, robot))
    down = next(one for one in checked.findings if one.finding == "gravity_direction")
    assert down.applied and "as well" not in down.evidence


def test_torques_without_the_weight_are_a_mistake() -> None:
    still = [0.0 * one.position for one in MOTIONS]
    recordings = [
        one.replace(torque=np.asarray(one.torque) - _core.rigid_torques(ARM, one.position, rest, rest))
        for one, rest in zip(MOTIONS, still, strict=True)
    ]
    finding = only(check_recordings(ARM, recordings))
    assert finding.finding == "gravity_removed" and finding.mistake


# ---- Angles that are counted otherwise -------------------------------------------------------------
def counted_otherwise(motions: list[Recording], signs: Floats, quarters: Floats) -> list[Recording]:
    """As a controller would write them whose zeros are so many quarter turns from the file's."""
    fields: dict[str, Callable[[Recording], Any]] = {
        "position": lambda one: one.position * signs + quarters * math.pi / 2.0
    }
    for name in ("speed", "torque", "current"):
        if getattr(motions[0], name).shape[1]:
            fields[name] = lambda one, name=name: getattr(one, name) * signs
    return with_fields(motions, **fields)


@pytest.mark.parametrize("quarters", [(0, 1, 0, 0, 0, 0), (0, -1, 2, 1, 0, 0)])
def test_zeros_that_are_quarter_turns_off_are_a_mistake(quarters: tuple[int, ...]) -> None:
    moved = counted_otherwise(MOTIONS, np.ones(6), np.array(quarters, dtype=float))
    finding = next(one for one in check_recordings(ARM, moved).findings if one.mistake)
    assert finding.finding == "angle_convention" and not finding.applied
    names = [joint.name for joint in ARM.joints]
    assert finding.joints == tuple(name for name, quarter in zip(names, quarters, strict=True) if quarter)
    added = {1: "minus 90°", -1: "plus 90°", 2: "plus 180°"}
    for name, quarter in zip(names, quarters, strict=True):
        assert not quarter or f"{name} {added[quarter]}" in finding.evidence


@pytest.mark.realdata
@pytest.mark.parametrize("folder", ["dyn_ur10", "dyn_ur10e"])
def test_real_arms_of_another_convention_are_recognised(folder: str) -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / folder).exists():
        pytest.skip(f"TRUING_REALDATA does not hold {folder}")
    robot = truing.load_robot(REAL / folder / "robot.urdf", any_tool=True)
    name = {"dyn_ur10": "run", "dyn_ur10e": "h12_20s"}[folder]
    recordings = load_recordings(str(REAL / folder / f"{name}.csv"), robot)
    signs, quarters = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0]), np.array([0.0, -1.0, 1.0, 0.0, 0.0, 0.0])
    moved = counted_otherwise(recordings, signs, quarters)
    finding = next(one for one in check_recordings(robot, moved).findings if one.mistake)
    assert finding.finding == "angle_convention"
    turned = "with the opposite sign (angle and torque)"
    said = f"shoulder_lift_joint plus 90°, elbow_joint minus 90°, wrist_1_joint {turned}"
    assert said in finding.evidence


def torques_of(robot: truing.Robot, one: Recording) -> Floats:
    speed = speed_of(one)
    acceleration = np.gradient(speed, one.time, axis=0)
    return np.asarray(_core.rigid_torques(robot, one.position, speed, acceleration))


def with_load(robot: truing.Robot, mass: float, offset: tuple[float, float, float]) -> truing.Robot:
    """The robot with a point mass [kg] beside its tool [m]."""
    heavy = robot.copy()
    last = heavy.joints[-1]
    place = np.array(heavy.targets[0].T_last_target)[:3, 3] + offset
    center = (last.mass * np.asarray(last.center_of_mass) + mass * place) / (last.mass + mass)
    inertia = np.array(last.inertia)
    for weight, at in ((last.mass, last.center_of_mass - center), (mass, place - center)):
        inertia += weight * (at @ at * np.eye(3) - np.outer(at, at))
    last.mass, last.center_of_mass, last.inertia = last.mass + mass, center, inertia
    return heavy


def test_a_heavy_gripper_that_the_file_lacks_is_no_other_convention() -> None:
    balanced = ARM.copy()  # its wrist hangs behind: a gripper turns the weight round
    for joint in balanced.joints[2:]:
        joint.center_of_mass = -3.0 * np.asarray(joint.center_of_mass)
    heavy = with_load(balanced, 8.0, (0.0, 0.1, 0.1))
    recordings = [
        one.replace(torque=np.asarray(one.torque) + torques_of(heavy, one) - torques_of(ARM, one))
        for one in MOTIONS
    ]
    finding = only(check_recordings(balanced, recordings))
    assert finding.finding == "gain" and "a load that the model lacks makes more than 1" in finding.evidence


# ---- The file of another robot ---------------------------------------------------------------------
def of_another(robot: truing.Robot, longer: float) -> truing.Robot:
    """A robot of the same kind, whose links are longer and, as they grow with it, heavier."""
    other = robot.copy()
    for joint in other.joints:
        joint.mass *= longer**2
        joint.inertia = np.asarray(joint.inertia) * longer**4
        joint.center_of_mass = np.asarray(joint.center_of_mass) * longer
        if robot.convention == "urdf":
            frame = np.array(joint.T_parent_joint)
            frame[:3, 3] *= longer
            joint.T_parent_joint = frame
        else:
            joint.a, joint.d = joint.a * longer, joint.d * longer
    return other


@pytest.mark.parametrize("longer", [0.6, 1.5])
def test_a_robot_of_another_size_is_a_mistake(longer: float) -> None:
    checked = check_recordings(of_another(ARM, longer), MOTIONS)
    found = next(one for one in checked.findings if one.finding == "link_length")
    assert found.mistake and checked.findings[0] is found
    j = [joint.name for joint in ARM.joints].index(found.joints[0])
    lengths = [abs(size) for size in (ARM.joints[j].a, ARM.joints[j].d) if size]
    assert min(abs(abs(found.value) - size) / size for size in lengths) < 0.15


@pytest.mark.parametrize("gain", [0.6, 1.6])
@pytest.mark.parametrize("joint", [1, 2])
def test_a_drive_of_another_constant_is_no_other_robot(joint: int, gain: float) -> None:
    scaled = with_fields(torque=lambda one: column(one.torque, joint, lambda torque: gain * torque))
    assert "link_length" not in kinds(check_recordings(ARM, scaled))


def test_a_robot_of_another_size_is_seen_without_one_of_the_torques() -> None:
    unmeasured = with_fields(torque=lambda one: column(one.torque, 5, lambda torque: np.nan * torque))
    found = check_recordings(of_another(ARM, 1.5), unmeasured).findings[0]
    assert found.finding == "link_length" and math.isfinite(found.value)


@pytest.mark.realdata
@pytest.mark.parametrize("longer", [0.6, 1.6])
def test_the_file_of_another_size_is_recognised_by_a_real_arm(longer: float) -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10")
    robot = truing.load_robot(REAL / "dyn_ur10" / "robot.urdf", any_tool=True)
    recordings = load_recordings(str(REAL / "dyn_ur10" / "run.csv"), robot)
    found = check_recordings(of_another(robot, longer), recordings).findings[0]
    assert found.finding == "link_length" and found.mistake
    assert found.joints[0] == "elbow_joint"
    assert found.value == pytest.approx(0.612, rel=0.15)


# ---- Scales ------------------------------------------------------------------------------------------
@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_torques_of_one_recording_on_another_scale_are_no_load(factor: float) -> None:
    scaled = MOTIONS[1].replace(torque=factor * np.asarray(MOTIONS[1].torque))
    finding = only(check_recordings(ARM, [MOTIONS[0], scaled, MOTIONS[2]]))
    assert finding.finding == "gain_differs" and finding.mistake
    assert finding.recordings == (scaled.name,)
    assert finding.value == pytest.approx(factor, rel=0.1)


def test_torques_that_do_not_follow_the_links_have_no_scale() -> None:
    """A drive's constant that is far off leaves multiples about zero: no recording's is another's."""
    scales = [-0.335, 0.004, -0.135, 0.318, -0.039, -0.212]
    fit: Any = SimpleNamespace(names=list("abcdef"), scale=lambda k: scales[k])
    assert loads.gain_differs(fit) == []


def test_a_factor_below_zero_is_no_scale() -> None:
    """Where links explain next to nothing of one recording: `math domain error` before."""
    scales = [0.02, -0.19, 0.021]
    fit: Any = SimpleNamespace(
        names=list("abc"),
        loads=np.zeros((3, 4)),
        scale=lambda k: scales[k],
        squares_scaled=lambda k, scale: abs(scale - scales[k]),
        squares=lambda k, load: 1.0,
    )
    assert loads.gain_differs(fit) == []


def test_torques_on_the_motors_side_are_a_mistake() -> None:
    ratios = np.array([100.0, 120.0, 100.0, 60.0, 60.0, 50.0])
    checked = check_recordings(ARM, with_fields(torque=lambda one: one.torque / ratios))
    finding = next(one for one in checked.findings if one.finding == "gain")
    assert finding.mistake and finding.value < 0.02


# ---- Values that no motion has ---------------------------------------------------------------------
def test_angles_folded_into_one_turn_go_on() -> None:
    far = with_fields(position=lambda one: one.position * 1.0 + np.array([3.0, 0, 0, 0, 0, 0]))
    folded = with_fields(far, position=lambda one: (one.position + math.pi) % (2.0 * math.pi) - math.pi)
    checked = check_recordings(ARM, folded)
    finding = next(one for one in checked.findings if one.finding == "angle_folded")
    assert finding.applied and finding.joints == (ARM.joints[0].name,) and finding.value > 0
    for one, other in zip(checked.recordings, far, strict=True):
        turns = (np.asarray(one.position) - other.position)[:, 0] / (2.0 * math.pi)
        assert np.ptp(turns) < 1e-9 and abs(turns[0] - round(turns[0])) < 1e-9


def test_single_values_far_from_their_neighbours_are_replaced() -> None:
    random = np.random.default_rng(11)
    rows = random.choice(np.arange(10, len(MOTIONS[0]) - 10, 5), 12, replace=False)

    def glitch(x: Floats) -> Floats:
        x[rows] += 8.0 * np.ptp(x) * random.choice([-1.0, 1.0], len(rows))
        return x

    spoilt = with_fields(MOTIONS[:1], torque=lambda one: column(one.torque, 1, glitch))
    checked = check_recordings(ARM, [*spoilt, *MOTIONS[1:]])
    finding = only(checked)
    assert finding.finding == "spikes" and finding.applied and finding.value == len(rows)
    assert finding.recordings == (MOTIONS[0].name,) and finding.joints == (ARM.joints[1].name,)
    mended, torque = np.asarray(checked.recordings[0].torque), np.asarray(MOTIONS[0].torque)
    untouched = np.delete(mended, rows, axis=0) == np.delete(torque, rows, axis=0)
    assert untouched.all()
    assert np.abs(mended - torque)[rows].max() < 0.1 * np.ptp(torque[:, 1])


def test_steps_of_friction_are_no_spikes() -> None:
    x = np.sin(np.arange(2000) * 0.01) + 5.0 * np.sign(np.sin(np.arange(2000) * 0.013))
    assert not spikes(x).any()
    x[777] += 40.0
    assert np.flatnonzero(spikes(x)).tolist() == [777]
    x[::20] += 40.0
    assert not spikes(x).any(), "of one in twenty nobody knows which are right"


# ---- Low-passed torques ----------------------------------------------------------------------------
def low_passed(table: Any, step: float, frequency: float) -> Any:
    """Without what is above, by the Fourier transform of the table beside its mirror image."""
    whole = np.vstack([table, np.asarray(table)[::-1]])
    spectrum = np.fft.rfft(whole, axis=0)
    spectrum[np.fft.rfftfreq(len(whole), step) > frequency] = 0.0
    return np.fft.irfft(spectrum, len(whole), axis=0)[: len(table)]


@pytest.mark.parametrize("frequency", [1.7, 2.4, 3.5])
def test_torques_that_were_low_passed_are_compared_below_that(frequency: float) -> None:
    simulated = simulate_motion(seed=7, seconds=24.0, recordings=3, held_out=1)
    filtered = [one.replace(torque=low_passed(one.torque, 0.01, frequency)) for one in simulated.recordings]
    checked = check_recordings(simulated.nominal, filtered)
    found = only(checked)
    assert found.finding == "torques_low_passed" and found.applied and not found.mistake
    assert found.value == pytest.approx(frequency, rel=0.1)
    assert checked.cutoff <= found.value < checked.cutoff + 0.1 + 1e-9
    errors = [
        diagnose(simulated.nominal, checked.recordings, cutoff=cutoff).errors[2].held_out
        for cutoff in (checked.cutoff, 8.0)
    ]
    below, beyond = (np.array([joint.percent for joint in some]) for some in errors)
    assert np.mean(np.log(below)) < np.mean(np.log(beyond)) - 0.2


def test_one_recording_with_the_whole_band_is_compared_in_it() -> None:
    simulated = simulate_motion(seed=7, seconds=24.0, recordings=3)
    filtered = [one.replace(torque=low_passed(one.torque, 0.01, 2.4)) for one in simulated.recordings[:2]]
    checked = check_recordings(simulated.nominal, [*filtered, simulated.recordings[2]])
    assert "torques_low_passed" not in kinds(checked) and checked.cutoff == 8.0


def test_friction_that_builds_up_slowly_is_no_low_pass() -> None:
    names = [f"J{k}" for k in range(1, 7)]
    slow = {f"presliding.{name}{part}": value for name in names for part, value in (("", 9.0), (".x0", 0.03))}
    less = {f"coulomb.{name}": -USUAL[k][0] for k, name in enumerate(names)}
    hidden = {"presliding": (names, slow), "coulomb": (names, less)}
    simulated = simulate_motion(seed=8, seconds=24.0, recordings=3, hidden=hidden)
    assert "torques_low_passed" not in kinds(check_recordings(simulated.nominal, simulated.recordings))


# ---- Signs -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_torque_whose_sign_friction_and_weight_contradict_is_turned(k: int) -> None:
    turned = with_fields(torque=lambda one: column(one.torque, k, np.negative))
    checked = check_recordings(ARM, turned)
    found = only(checked)
    assert (found.finding, found.joints, found.recordings) == ("torque_sign", (f"J{k + 1}",), ())
    assert found.applied and not found.mistake and found.value > 90.0
    for one, original in zip(checked.recordings, MOTIONS, strict=True):
        assert np.array_equal(one.torque, original.torque)


def test_a_sign_that_friction_alone_contradicts_is_said_and_left() -> None:
    checked = check_recordings(ARM, with_fields(torque=lambda one: column(one.torque, 5, np.negative)))
    found = only(checked)
    assert found.finding == "torque_sign" and found.joints == ("J6",)
    assert found.mistake and not found.applied
    assert "as well if the angle of J6 has the opposite sign" in found.evidence
    assert np.array_equal(checked.recordings[0].torque[:, 5], -MOTIONS[0].torque[:, 5])


@pytest.mark.parametrize(
    ("fields", "finding"),
    [(["position"], "position_sign"), (["position", "torque"], "joint_sign")],
)
def test_which_sign_is_wrong_is_told_apart(fields: list[str], finding: str) -> None:
    turned = with_fields(
        **{name: lambda one, name=name: column(getattr(one, name), 2, np.negative) for name in fields}
    )
    found = only(check_recordings(ARM, turned))
    assert (found.finding, found.joints, found.mistake) == (finding, ("J3",), True)


def test_the_sign_of_a_known_drive_is_its_constant() -> None:
    robot = ARM.copy()
    for joint in robot.joints:
        joint.torque_per_ampere = 10.0
    recordings = [
        Recording(
            one.name,
            time=one.time,
            position=one.position,
            current=column(np.asarray(one.torque) / 10.0, 1, np.negative),
        )
        for one in MOTIONS
    ]
    checked = check_recordings(robot, recordings)
    assert only(checked).finding == "torque_sign" and only(checked).applied
    assert [joint.torque_per_ampere for joint in checked.robot.joints] == [
        10.0,
        -10.0,
        10.0,
        10.0,
        10.0,
        10.0,
    ]
    assert np.array_equal(checked.recordings[0].current, recordings[0].current)


def test_one_recording_of_several_may_have_another_sign() -> None:
    one_turned = [*MOTIONS]
    one_turned[1] = with_fields([MOTIONS[1]], torque=lambda one: column(one.torque, 2, np.negative))[0]
    checked = check_recordings(ARM, one_turned)
    assert only(checked).recordings == ("motion2",) and only(checked).joints == ("J3",)
    assert np.array_equal(checked.recordings[1].torque, MOTIONS[1].torque)


# ---- Order -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("order", [(2, 1, 0, 3, 4, 5), (1, 2, 0, 3, 4, 5), (5, 4, 3, 2, 1, 0)])
def test_joints_in_another_order_are_said_as_one_types_them(order: tuple[int, ...], tmp_path: Path) -> None:
    columns = list(order)
    files = []
    for one in MOTIONS:
        table: dict[str, Any] = {"t_s": one.time}
        for number, k in enumerate(columns, 1):
            table |= {f"q{number}_rad": one.position[:, k], f"tau{number}_Nm": one.torque[:, k]}
        files.append(tmp_path / f"{one.name}.csv")
        write_table(files[-1], table)
    found = only(check_recordings(ARM, load_recordings(files, ARM)))
    assert found.finding == "joint_order" and found.mistake
    advice = found.evidence.rpartition("--joints ")[2]
    again = load_recordings(files, ARM, joints=advice)
    assert check_recordings(ARM, again).findings == ()
    assert np.allclose(again[0].torque, MOTIONS[0].torque, rtol=1e-12)


def test_torques_in_another_order_are_said() -> None:
    order = [2, 1, 0, 3, 4, 5]
    found = only(check_recordings(ARM, with_fields(torque=lambda one: np.asarray(one.torque)[:, order])))
    assert (found.finding, found.joints, found.mistake) == ("torque_order", ("J1", "J3"), True)
    assert "J3, J2, J1, J4, J5, J6" in found.evidence


def test_a_sign_is_not_turned_while_the_order_is_wrong() -> None:
    order = [2, 1, 0, 3, 4, 5]
    wrong = with_fields(torque=lambda one: column(one.torque, 1, np.negative)[:, order])
    checked = check_recordings(ARM, wrong)
    assert sorted(kinds(checked)) == ["torque_order", "torque_sign"]
    assert all(one.mistake and not one.applied for one in checked.findings)
    assert all(
        np.array_equal(one.torque, given.torque) for one, given in zip(checked.recordings, wrong, strict=True)
    )


# ---- Units and scales ------------------------------------------------------------------------------
@pytest.mark.parametrize(("unit", "size"), [("rpm", 60 / (2 * math.pi)), ("deg/s", 180 / math.pi)])
def test_speeds_in_another_unit_are_converted(unit: str, size: float) -> None:
    checked = check_recordings(ARM, with_fields(speed=lambda one: speed_of(one) * size))
    found = only(checked)
    assert found.finding == "speed_unit" and found.applied and f"in {unit}" in found.evidence
    assert found.value == pytest.approx(size, rel=1e-2)
    assert np.allclose(checked.recordings[0].speed, speed_of(MOTIONS[0]), atol=1e-12)


def test_a_speed_with_the_other_sign_is_turned() -> None:
    checked = check_recordings(ARM, with_fields(speed=lambda one: column(speed_of(one), 2, np.negative)))
    assert only(checked).finding == "speed_sign" and only(checked).joints == ("J3",)
    assert np.allclose(checked.recordings[0].speed, speed_of(MOTIONS[0]))


def test_a_speed_before_the_gear_is_said_with_its_ratio() -> None:
    found = only(
        check_recordings(ARM, with_fields(speed=lambda one: column(speed_of(one), 0, lambda x: 80 * x)))
    )
    assert (found.finding, found.applied, found.joints) == ("speed_scale", False, ("J1",))
    assert found.value == pytest.approx(80.0, rel=0.01)


def test_a_speed_of_another_joint_is_said() -> None:
    swapped = with_fields(speed=lambda one: speed_of(one)[:, [1, 0, 2, 3, 4, 5]])
    found = only(check_recordings(ARM, swapped))
    assert (found.finding, found.joints) == ("speed_mismatch", ("J1", "J2"))


@pytest.mark.parametrize("with_speed", [True, False])
def test_angles_in_degrees_are_converted_where_speeds_or_limits_prove_them(with_speed: bool) -> None:
    fields: dict[str, Callable[[Recording], Any]] = {"position": lambda one: np.degrees(one.position)}
    if with_speed:
        fields["speed"] = speed_of
    checked = check_recordings(ARM, with_fields(**fields))
    assert only(checked).finding == "position_unit" and only(checked).applied
    for one, original in zip(checked.recordings, MOTIONS, strict=True):
        assert np.allclose(one.position, original.position, atol=1e-12)


@pytest.mark.parametrize(
    ("size", "words"),
    [(math.degrees(1.0), "angles are in deg"), (60 / (2 * math.pi), "deg and the speed in rpm")],
)
def test_speeds_are_converted_with_their_angles(size: float, words: str) -> None:
    wrong = with_fields(speed=lambda one: size * speed_of(one), position=lambda one: np.degrees(one.position))
    checked = check_recordings(ARM, wrong)
    assert words in only(checked).evidence
    for mended, one in zip(checked.recordings, MOTIONS, strict=True):
        assert mended.position == pytest.approx(np.asarray(one.position))
        assert mended.speed == pytest.approx(speed_of(one), rel=1e-9, abs=1e-9)


def test_angles_in_degrees_without_any_proof_but_the_model_are_said() -> None:
    robot = ARM.copy()
    for joint in robot.joints:
        joint.lower, joint.upper = -math.inf, math.inf
    checked = check_recordings(robot, with_fields(position=lambda one: np.degrees(one.position)))
    found = checked.findings[0]
    assert (found.finding, found.applied, found.mistake) == ("position_unit", False, True)
    assert np.array_equal(checked.recordings[0].position, np.degrees(MOTIONS[0].position))


def test_radians_under_a_name_in_degrees_are_said() -> None:
    checked = check_recordings(ARM, with_fields(position=lambda one: np.radians(one.position)))
    assert kinds(checked) == ["position_unit"] and checked.findings[0].mistake
    assert "in rad, not in deg" in checked.findings[0].evidence


def test_torques_in_millinewtonmetres_are_said() -> None:
    found = only(check_recordings(ARM, with_fields(torque=lambda one: 1000.0 * np.asarray(one.torque))))
    assert found.finding == "torque_unit" and found.mistake and "mNm" in found.evidence
    assert found.value == pytest.approx(1000.0, rel=0.05)


def test_torques_in_per_cent_of_the_joints_limits_are_said() -> None:
    robot, limits = ARM.copy(), np.array([330.0, 330.0, 150.0, 56.0, 56.0, 56.0])
    for joint, limit in zip(robot.joints, limits, strict=True):
        joint.torque_limit = limit
    percent = with_fields(torque=lambda one: 100.0 * np.asarray(one.torque) / limits)
    found = only(check_recordings(robot, percent))
    assert found.finding == "torque_unit" and "per cent of the limit" in found.evidence


def test_a_wrong_gain_is_said_with_its_size() -> None:
    found = only(
        check_recordings(ARM, with_fields(torque=lambda one: column(one.torque, 1, lambda x: 3 * x)))
    )
    assert (found.finding, found.joints, found.applied, found.mistake) == ("gain", ("J2",), False, False)
    assert found.value == pytest.approx(3.0, rel=0.05)


def test_currents_without_constants_say_which_the_masses_would_need() -> None:
    currents = [
        Recording(one.name, time=one.time, position=one.position, current=np.asarray(one.torque) / 12.5)
        for one in MOTIONS
    ]
    found = only(check_recordings(ARM, currents))
    assert found.finding == "gain_unknown" and not found.mistake
    assert "share one scale" in found.evidence and "--torque-per-ampere" in found.evidence
    assert found.value == pytest.approx(12.5, rel=0.05)


# ---- Clocks ----------------------------------------------------------------------------------------
@pytest.mark.parametrize(("rows", "applied"), [(1, None), (2, False), (6, True), (20, True)])
def test_late_torques_are_measured_and_shifted_back_where_no_effect_could_take_it(
    rows: int, applied: bool | None
) -> None:
    checked = check_recordings(ARM, with_fields(torque=lambda one: later(one.torque, rows)))
    if applied is None:  # within a step, as what drives measure may be
        assert checked.findings == ()
        return
    found = only(checked)
    assert (found.finding, found.applied, found.unit) == ("torque_shift", applied, "s")
    assert found.value == pytest.approx(rows * STEP, abs=0.004)
    if applied:
        one, original = checked.recordings[0], MOTIONS[0]
        assert len(original) - 2 * rows <= len(one) < len(original)
        same = np.asarray(original.torque)[: len(one)]
        assert np.sqrt(np.mean((one.torque - same) ** 2)) < 0.03 * same.std()
        assert np.array_equal(one.position, np.asarray(original.position)[: len(one)])


def test_torques_of_one_recording_alone_may_be_late() -> None:
    recordings = [*MOTIONS]
    recordings[1] = MOTIONS[1].replace(torque=later(MOTIONS[1].torque, 10))
    checked = check_recordings(ARM, recordings)
    assert only(checked).recordings == ("motion2",) and only(checked).value == pytest.approx(0.1, abs=0.01)
    assert len(checked.recordings[0]) == len(MOTIONS[0]) > len(checked.recordings[1])


def test_torques_that_are_ahead_are_said_so() -> None:
    ahead = with_fields(torque=lambda one: later(np.asarray(one.torque)[::-1], 8)[::-1])
    found = only(check_recordings(ARM, ahead))
    assert found.value == pytest.approx(-0.08, abs=0.005) and "ahead of the motion" in found.evidence


def test_effects_are_named_after_a_shift_as_before_it() -> None:
    late = with_fields(torque=lambda one: later(one.torque, 10))
    checked = check_recordings(ARM, late)
    without, found = diagnose(ARM, late), diagnose(checked.robot, checked.recordings)
    named, wrong = (
        {(e.effect, tuple(e.joints)) for e in one.effects if not e.standard} for one in (found, without)
    )
    assert {(effect, tuple(joints)) for effect, (joints, _) in HIDDEN.items()} <= named
    assert "presliding" in {effect for effect, _ in wrong} - {effect for effect, _ in named}


def test_a_late_speed_is_said() -> None:
    found = only(check_recordings(ARM, with_fields(speed=lambda one: later(speed_of(one), 5))))
    assert found.finding == "speed_lag" and found.value == pytest.approx(0.05, abs=0.003)


def test_gaps_are_said() -> None:
    found = only(check_recordings(ARM, with_fields(time=lambda one: one.time + 3.0 * (one.time > 6.0))))
    assert found.finding == "gaps" and found.applied and found.value == pytest.approx(3.01, abs=0.001)
    assert "1 gap of up to 3.01 s" in found.evidence


def test_a_clock_that_jumped_is_a_gap_and_no_day_of_rows() -> None:
    jumped = with_fields(time=lambda one: one.time + np.where(one.time > 7.0, 1e8, 0.0))
    checked = check_recordings(ARM, jumped)
    assert "gap of up to 1e+08 s" in only(checked).evidence
    assert all(len(grid.q) <= len(MOTIONS[0].time) for grid in grids_of(ARM, jumped))


def test_stamps_of_the_recorder_give_way_to_even_ones() -> None:
    random = np.random.default_rng(11)
    jitter = [np.sort(one.time + random.normal(0.0, 0.002, len(one))) for one in MOTIONS]
    checked = check_recordings(ARM, [one.replace(time=t) for one, t in zip(MOTIONS, jitter, strict=True)])
    found = only(checked)
    assert found.finding == "jitter" and found.applied and 20.0 < found.value < 40.0
    assert np.abs(checked.recordings[0].time - MOTIONS[0].time).max() < 0.02


def test_uneven_stamps_that_are_the_motion_s_stay() -> None:
    random = np.random.default_rng(12)
    recordings = []
    for one in MOTIONS:
        time = np.sort(one.time + random.normal(0.0, 0.002, len(one)))
        tables = {
            name: np.column_stack([np.interp(time, one.time, x) for x in np.asarray(getattr(one, name)).T])
            for name in ("position", "torque")
        }
        recordings.append(Recording(one.name, time=time, **tables))
    checked = check_recordings(ARM, recordings)
    assert only(checked).finding == "jitter" and not only(checked).applied
    assert np.array_equal(checked.recordings[0].time, recordings[0].time)


# ---- Values ----------------------------------------------------------------------------------------
def test_clipped_torques_are_said_with_their_part_of_the_rows() -> None:
    highest = float(np.quantile(MOTIONS[0].torque[:, 1], 0.9))
    clipped = with_fields(torque=lambda one: column(one.torque, 1, lambda x: np.minimum(x, highest)))
    found = next(one for one in check_recordings(ARM, clipped).findings if one.finding == "clipped")
    assert (
        found.joints == ("J2",) and found.value >= 8.0 and "tau2 stays at its largest value" in found.evidence
    )


def test_coarse_torques_are_said_with_their_step() -> None:
    coarse = with_fields(torque=lambda one: column(one.torque, 3, lambda x: np.round(x / 0.9) * 0.9))
    found = next(one for one in check_recordings(ARM, coarse).findings if one.finding == "coarse_torque")
    assert found.joints == ("J4",) and found.value == pytest.approx(0.9)


def test_coarse_angles_are_said_with_their_step() -> None:
    coarse = with_fields(position=lambda one: column(one.position, 4, lambda x: np.round(x / 0.01) * 0.01))
    found = next(one for one in check_recordings(ARM, coarse).findings if one.finding == "coarse_position")
    assert found.joints == ("J5",) and found.value == pytest.approx(0.01)


def test_a_torque_that_never_changes_is_a_mistake() -> None:
    dead = with_fields(torque=lambda one: column(one.torque, 1, lambda x: 0.0 * x + 3.0))
    found = check_recordings(ARM, dead).findings[0]
    assert (found.finding, found.joints, found.mistake) == ("constant", ("J2",), True)


def test_the_resolution_is_the_step_between_values() -> None:
    x = np.sin(np.arange(4000) * 0.01)
    assert resolution(x) == 0.0
    assert resolution(np.round(x / 0.02) * 0.02) == pytest.approx(0.02)
    assert resolution(np.ones(4000)) == 0.0
    assert resolution(np.round(x, 5)) == 0.0  # digits of a file


# ---- Rest ------------------------------------------------------------------------------------------
def test_rows_at_rest_are_counted() -> None:
    def hold(one: Recording) -> Floats:
        return column(one.position, 3, lambda x: np.where(np.arange(len(x)) < len(x) // 2, x[len(x) // 2], x))

    found = next(one for one in check_recordings(ARM, with_fields(position=hold)).findings)
    assert (
        found.finding == "at_rest" and found.joints == ("J4",) and found.value == pytest.approx(50.0, abs=4.0)
    )


def test_what_never_moves_is_said() -> None:
    still = with_fields(position=lambda one: column(one.position, 3, lambda x: x[0] + 0.0 * x))
    found = {one.finding: one for one in check_recordings(ARM, still).findings}
    assert found["still"].joints == ("J4",)
    idle = [*MOTIONS]
    idle[1] = MOTIONS[1].replace(position=np.tile(MOTIONS[1].position[:1], (len(MOTIONS[1]), 1)))
    found = {one.finding: one for one in check_recordings(ARM, idle).findings}
    assert found["idle"].recordings == ("motion2",) and found["idle"].value == 100.0


# ---- Parts -----------------------------------------------------------------------------------------
def test_rows_are_about_as_many_as_asked_for() -> None:
    rows = rows_of(grids_of(ARM, MOTIONS), 100)
    assert 50 < len(rows.q) <= 100 + len(MOTIONS) and rows.moving.shape == rows.torque.shape == (
        len(rows.q),
        6,
    )


def test_joints_without_a_measured_torque_are_passed_over() -> None:
    some = with_fields(torque=lambda one: column(one.torque, 2, lambda x: x + np.nan))
    assert check_recordings(ARM, some).findings == ()
    none = [Recording(one.name, time=one.time, position=one.position) for one in MOTIONS]
    assert check_recordings(ARM, none).findings == ()


def test_recordings_that_are_too_short_to_be_smoothed_are_no_error() -> None:
    position = np.asarray(MOTIONS[0].position)[:25]
    short = [Recording(name, time=STEP * np.arange(25), position=position) for name in ("one", "two")]
    assert check_recordings(demo_arm(), short).findings == ()


def test_one_recording_is_said_to_be_alone() -> None:
    found = only(check_recordings(ARM, MOTIONS[:1]))
    assert found.finding == "one_recording" and not found.mistake and "surer than 90 %" in found.evidence


def test_recordings_of_another_robot_are_refused() -> None:
    with pytest.raises(InputError, match="position has shape"):
        check_recordings(ARM.replace(joints=list(ARM.joints)[:3]), MOTIONS)


SCARA = """<robot name="scara"><link name="base"/>{links}{joints}</robot>"""
LINK = """<link name="l{0}"><inertial><origin xyz="{1} 0 0"/><mass value="{2}"/>
<inertia ixx="{3}" iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{1}" type="{2}"><parent link="{3}"/><child link="l{0}"/><origin xyz="{4} 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="100" velocity="5"/></joint>"""


def test_a_joint_that_turns_is_never_taken_for_one_that_slides(tmp_path: Path) -> None:
    """Of the light last joints of a SCARA the columns would fit one another's torques."""
    links = [(1, 0.2, 8.0, 0.15), (2, 0.18, 6.0, 0.1), (3, 0.0, 1.5, 0.01), (4, 0.01, 0.5, 0.0005)]
    joints = [
        (1, "z1", "revolute", "base", 0.0),
        (2, "z2", "revolute", "l1", 0.4),
        (3, "z4", "prismatic", "l2", 0.35),
        (4, "z3", "revolute", "l3", 0.0),
    ]
    parts = {"links": "".join(LINK.format(*one) for one in links)}
    parts["joints"] = "".join(JOINT.format(*one) for one in joints)
    (tmp_path / "scara.urdf").write_text(SCARA.format(**parts))
    robot = truing.load_robot(tmp_path / "scara.urdf")
    random, made = np.random.default_rng(12), []
    for k in range(3):
        t = np.arange(0.0, 14.0, STEP)
        waves = [np.sin(2.0 * math.pi * f * t[:, None] + random.uniform(0, 6, 4)) for f in (0.2, 0.5, 0.9)]
        q = np.sum(waves, axis=0) * [0.4, 0.5, 0.05, 0.6]
        qd = np.gradient(q, t, axis=0)
        friction = np.tanh(qd / 0.01) * [6.0, 4.0, 9.0, 0.2] + qd * [2.0, 2.0, 9.0, 0.05]
        motors = np.gradient(qd, t, axis=0) * [0.0, 0.0, 0.5, 0.04]
        rigid = np.asarray(_core.rigid_torques(robot, q, qd, np.gradient(qd, t, axis=0)))
        noise = random.normal(size=q.shape) * [0.5, 0.3, 0.5, 0.02]
        made.append(Recording(f"r{k}", time=t, position=q, torque=rigid + friction + motors + noise))
    assert not {"joint_order", "torque_order"} & set(kinds(check_recordings(robot, made)))


def test_the_zero_of_a_single_joint_is_found(tmp_path: Path) -> None:
    link, joint = LINK.format(1, 0.2, 8.0, 0.15), JOINT.format(1, "J1", "revolute", "base", 0.0)
    text = SCARA.format(links=link, joints=joint).replace('xyz="0 0 1"', 'xyz="0 1 0"')
    (tmp_path / "one.urdf").write_text(text)
    robot, t = truing.load_robot(tmp_path / "one.urdf"), np.arange(0.0, 14.0, STEP)
    q = np.sin(0.9 * t[:, None]) + 0.4 * np.sin(2.3 * t[:, None])
    qd = np.gradient(q, t, axis=0)
    torque = _core.rigid_torques(robot, q, qd, np.gradient(qd, t, axis=0)) + np.tanh(qd / 0.01)
    made = [Recording(f"r{k}", time=t, position=q + 0.5 * math.pi, torque=torque) for k in (1, 2)]
    assert "J1 minus 90°" in next(o for o in check_recordings(robot, made).findings if o.mistake).evidence
