# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A payload that is known: it is part of the model, and tells masses from the drives' constants."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from truing.dynamics import (
    Recording,
    check_recordings,
    diagnose,
    identify,
    load_recordings,
    predict,
    with_payload,
)
from truing.dynamics.sanity import loads
from truing.dynamics.sanity.grids import grids_of
from truing.dynamics.told import told
from truing.errors import InputError
from truing.files import load_robot
from truing.model import AppliedEffect, Robot
from truing.testing.dynamics import NOISE, USUAL, coloured_noise, demo_arm, fourier_motion

REAL = Path(os.environ.get("TRUING_REALDATA", ""))
CONSTANTS = np.array((12.0, 11.0, 9.5, 4.0, 4.5, 3.5))  # [Nm/A]
UR10E_CONSTANTS = (10.0, 10.6956, 8.4566, 9.0029, 9.48, 10.1232)  # [Nm/A] published beside the recordings
PLACE = (0.02, -0.04, 0.11)  # [m]
OFF = (0.12, -0.10, 0.08, -0.15, 0.05)  # of the drives' constants, J1 … J5
LOAD = 5.0  # [kg]


def motion(seed: int, seconds: float = 24.0) -> Recording:
    time = np.arange(0.0, seconds, 0.01)
    return Recording(
        f"motion{seed}", time=time, position=fourier_motion(time, 6, np.random.default_rng([7, seed]))
    )


def usual_friction(arm: Robot) -> list[AppliedEffect]:
    return [
        AppliedEffect(effect, [joint.name], {f"{effect}.{joint.name}": values[k]})
        for joint, values in zip(arm.joints, USUAL, strict=True)
        for k, effect in enumerate(("coulomb", "viscous"))
    ]


def test_known_payloads_give_masses_and_drive_constants_within_3_percent() -> None:
    arm = demo_arm()
    truth = arm.copy()
    for joint, factor in zip(truth.joints, (1.0, 1.1, 0.9, 1.05, 1.0, 1.0), strict=True):
        assert joint.mass is not None
        joint.mass *= factor
    bodies = truth.copy()
    drives = [
        AppliedEffect("motor_constant", [joint.name], {f"motor_constant.{joint.name}": off})
        for joint, off in zip(arm.joints, OFF, strict=False)
    ]
    truth.torque_effects = [*usual_friction(arm), *drives]
    recordings = []
    for seed in range(5):
        loaded = with_payload([motion(seed)], LOAD * (seed % 2), (0.0, 0.0, 0.1))[0]
        torque = np.asarray(predict(truth, loaded, cutoff=30.0).torque)
        noise = coloured_noise(torque.shape, np.random.default_rng([8, seed])) * NOISE * torque.std(axis=0)
        recordings.append(loaded.replace(torque=torque + noise, test=seed > 3))
    fit = identify(arm, recordings, effects="coulomb,viscous,current_offset,motor_constant")
    values = {p.name: p.value for p in fit.parameters}
    for k, off in enumerate(OFF, 1):
        assert 1.0 + values[f"motor_constant.J{k}"] == pytest.approx(1.0 + off, rel=0.03)
    found = fit.robot.copy()
    found.torque_effects = []
    wanted, rigid = (np.asarray(predict(robot, motion(9)).torque) for robot in (bodies, found))
    scale = (wanted * rigid).sum(axis=0) / (wanted**2).sum(axis=0)  # of all that is weighed, joint by joint
    assert scale[:5] == pytest.approx(np.ones(5), abs=0.03)


def currents(loads: tuple[float, ...], seconds: float = 24.0) -> list[Recording]:
    """What drives of such constants draw, with loads at PLACE, where that is not stated."""
    arm = demo_arm()
    arm.torque_effects = usual_friction(arm)
    out = []
    for seed, load in enumerate(loads):
        one = with_payload([motion(20 + seed, seconds)], load, PLACE)[0]
        torque = np.asarray(predict(arm, one, cutoff=30.0).torque)
        noise = coloured_noise(torque.shape, np.random.default_rng([9, seed])) * NOISE * torque.std(axis=0)
        mass = {"payload_kg": np.full(len(one), load)}
        out.append(one.replace(columns=mass, current=(torque + noise) / CONSTANTS))
    return out


def test_a_known_load_tells_the_constants_of_drives_and_where_it_hangs() -> None:
    checked = check_recordings(demo_arm(), currents((0.0, LOAD, 0.0, LOAD)))
    of_drives, of_place = checked.findings
    assert (of_drives.finding, of_drives.applied, of_drives.unit) == ("gain_from_load", True, "Nm/A")
    found = np.array([joint.torque_per_ampere for joint in checked.robot.joints], dtype=float)
    assert found[:5] == pytest.approx(CONSTANTS[:5], rel=0.03)
    assert of_place.finding == "load_place" and of_place.applied
    hangs = [checked.recordings[1].columns[f"payload_{axis}_m"][0] for axis in "xyz"]
    assert hangs == pytest.approx(PLACE, abs=0.004)
    diagnosis = diagnose(checked.robot, checked.recordings)
    # The first joint's constant stays 0.9 % off, which may just have a name.
    assert all(one.standard or one.probability < 0.6 for one in diagnosis.effects)


def test_a_base_that_is_not_level_is_not_taken_for_a_constant() -> None:
    arm = demo_arm()
    arm.gravity = np.array(arm.gravity) + np.cross([0.04, -0.05, 0.0], arm.gravity)
    checked = check_recordings(arm, currents((0.0, LOAD, 0.0, LOAD)))
    found = np.array([joint.torque_per_ampere for joint in checked.robot.joints], dtype=float)
    assert found[0] == pytest.approx(CONSTANTS[0], rel=0.06)  # it carries weight by the tilt alone
    assert found[1:5] == pytest.approx(CONSTANTS[1:5], rel=0.03)
    assert "base_tilt" in [one.effect for one in diagnose(checked.robot, checked.recordings).effects]


def test_recordings_that_state_no_load_beside_a_known_one_are_said() -> None:
    first, *others = currents((0.0, LOAD, 0.0, LOAD))
    checked = check_recordings(demo_arm(), [first.replace(columns={}), *others])
    said = next(one.evidence for one in checked.findings if one.finding == "load_place")
    assert said.endswith(f"no payload_kg in {first.name}: taken to be without a payload")


@pytest.mark.parametrize("loads", [(0.0, 0.0), (LOAD, LOAD)])
def test_loads_that_are_all_the_same_tell_no_constants(loads: tuple[float, ...]) -> None:
    found = check_recordings(demo_arm(), currents(loads, 12.0)).findings
    assert [one.finding for one in found] == ["gain_unknown"]


def untold(loads: tuple[float, ...], seconds: float = 24.0) -> list[Recording]:
    """Torques with loads at PLACE that no column states."""
    made = currents(loads, seconds)
    return [one.replace(columns={}, current=None, torque=np.asarray(one.current) * CONSTANTS) for one in made]


def test_a_load_that_some_recordings_carry_untold_is_found_and_taken_into_account() -> None:
    recordings = untold((0.0, LOAD, 0.0, 0.4 * LOAD, LOAD))
    checked = check_recordings(demo_arm(), recordings)
    lighter, heavier = (one for one in checked.findings if one.finding == "load_differs")
    assert lighter.applied and heavier.applied
    assert lighter.recordings == (recordings[3].name,) and lighter.value == pytest.approx(
        0.4 * LOAD, rel=0.03
    )
    assert heavier.recordings == (recordings[1].name, recordings[4].name)
    assert heavier.value == pytest.approx(LOAD, rel=0.03)
    assert [one.columns["payload_found"][0] for one in checked.recordings] == [0.0, 1.0, 0.0, 1.0, 1.0]
    hangs = [checked.recordings[1].columns[f"payload_{axis}_m"][0] for axis in "xyz"]
    assert hangs == pytest.approx(PLACE, abs=0.004)
    found = diagnose(checked.robot, checked.recordings)
    assert found.verdict == "none"
    said = told(found, checked.findings)
    assert said.verdict == "effects" and said.sentence.endswith("No other gap beyond noise is left")
    both = f"loads of {lighter.value:.2f} and {heavier.value:.2f} kg that nobody told"
    assert both in said.sentence and recordings[3].name in said.sentence
    assert [(one.effect, one.joints) for one in said.effects if not one.standard] == [("payload", ())] * 2
    sizes = {p.name: p.value for p in said.loads[1].parameters}
    assert sizes == pytest.approx({"payload.m": heavier.value, **_named(hangs)})
    # What nobody weighed tells no drive's constant, and no place better than it was found.
    assert {one.effect for one in found.not_testable} >= {"motor_constant", "payload_place"}


def _named(place: list[float]) -> dict[str, float]:
    return {f"payload.{axis}": value for axis, value in zip("xyz", place, strict=True)}


def test_a_load_is_known_no_better_than_its_halves_agree() -> None:
    """Of the last recording one half carries less, and neither half's own noise tells."""
    recordings = untold((LOAD, LOAD, LOAD))
    first = np.arange(len(recordings[2])) < len(recordings[2]) // 2
    lighter = np.asarray(untold((LOAD, LOAD, 0.5 * LOAD))[2].torque)
    torque = np.where(first[:, None], lighter, np.asarray(recordings[2].torque))
    arm = demo_arm()
    mixed = [*recordings[:2], recordings[2].replace(torque=torque)]
    alike, apart = (
        loads.Compared.of([loads._halves(arm, grid) for grid in grids_of(arm, them)], 6)
        for them in (recordings, mixed)
    )
    assert alike.sigma([2]) < 0.05 * LOAD
    assert apart.sigma([2]) >= 0.9 * loads.BY_HALVES * 0.5 * LOAD


def test_rows_at_rest_tell_no_load() -> None:
    """There friction takes up what part of the weight it likes."""
    arm = demo_arm()
    (grid, *_) = grids_of(arm, untold((0.0, 0.0)))
    still = replace(grid, qd=grid.qd.copy())
    still.qd[: len(grid.qd) // 4] = 0.0
    counted = [sum(len(half.left) for half in loads._halves(arm, one)) for one in (grid, still)]
    assert counted[1] < 0.85 * counted[0]


def test_of_an_untold_load_on_unknown_drives_it_is_asked_to_weigh_it() -> None:
    made = [one.replace(columns={}) for one in currents((0.0, LOAD, 0.0))]
    checked = check_recordings(demo_arm(), made)
    (said,) = [one for one in checked.findings if one.finding == "load_differs"]
    assert said.mistake and not said.applied and said.recordings == (made[1].name,)
    assert said.value == pytest.approx(LOAD, rel=0.3) and "state it" in said.evidence
    assert all("payload_kg" not in one.columns for one in checked.recordings)


@pytest.mark.parametrize("loads", [(0.0, 0.0, 0.0), (LOAD, LOAD, LOAD)])
def test_loads_that_are_all_the_same_are_no_difference(loads: tuple[float, ...]) -> None:
    findings = check_recordings(demo_arm(), untold(loads)).findings
    assert "load_differs" not in [one.finding for one in findings]


def test_a_robot_that_carries_a_places_correction_moves_without_a_load_too() -> None:
    arm = demo_arm()
    bare = predict(arm, motion(1)).torque
    arm.torque_effects = [
        AppliedEffect("payload_place", [], {f"payload_place.{axis}": 0.01 for axis in "xyz"})
    ]
    assert np.array_equal(predict(arm, motion(1)).torque, bare)


@pytest.mark.realdata
def test_the_load_of_a_real_arm_is_found_where_nobody_told_it() -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10e").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10e")
    robot = load_robot(REAL / "dyn_ur10e" / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), UR10E_CONSTANTS, strict=True):
        robot.joints[index].torque_per_ampere = gain
    recordings = load_recordings(str(REAL / "dyn_ur10e" / "*.csv"), robot)
    untold = [one.replace(columns={}) for one in recordings]
    (found,) = [one for one in check_recordings(robot, untold).findings if one.finding == "load_differs"]
    assert found.recordings == ("h14_50s_load",)
    assert found.value == pytest.approx(2.805, rel=0.15)  # with the published constants


@pytest.mark.realdata
def test_the_load_of_a_real_arm_tells_its_drives_constants() -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10e").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10e")
    robot = load_robot(REAL / "dyn_ur10e" / "robot.urdf", any_tool=True)
    names = ("h10_20s", "h12_30s", "h14_50s", "h14_50s_load")
    recordings = load_recordings([REAL / "dyn_ur10e" / f"{name}.csv" for name in names], robot)
    checked = check_recordings(robot, recordings)
    assert {"gain_from_load", "load_place"} <= {one.finding for one in checked.findings}
    found = np.array([joint.torque_per_ampere for joint in checked.robot.joints], dtype=float)
    low = np.array(UR10E_CONSTANTS)  # of two papers; J1 carries no weight
    high = np.array((14.87, 13.26, 11.13, 10.62, 11.03, 11.47))
    assert (found[1:] > 0.95 * low[1:]).all() and (found[1:] < 1.05 * high[1:]).all()


def test_a_payload_is_put_where_none_is_stated() -> None:
    stated = motion(0, 2.0).replace(name="stated", columns={"payload_kg": np.full(200, 1.0)})
    kept, placed = (with_payload([stated], 2.0, place)[0] for place in ((0.0, 0.0, 0.0), (0.0, 0.1, 0.0)))
    assert set(kept.columns) == {"payload_kg"} and kept.columns["payload_kg"][0] == 1.0
    assert placed.columns["payload_kg"][0] == 1.0 and placed.columns["payload_y_m"][0] == 0.1
    assert with_payload([placed], 2.0, (0.0, 0.0, 0.3))[0].columns["payload_z_m"][0] == 0.0
    (added,) = with_payload([motion(1, 2.0)], 2.0, (0.0, 0.1, 0.0))
    assert added.columns["payload_kg"][5] == 2.0 and added.columns["payload_y_m"][5] == 0.1


@pytest.mark.parametrize("mass", [-1.0, np.nan, np.inf])
def test_a_payload_that_cannot_be_is_refused(mass: float) -> None:
    with pytest.raises(InputError, match="payload: found"):
        with_payload([motion(0, 2.0)], mass)


def written(path: Path, column: str, value: float) -> Path:
    columns = ["t_s", *(f"q{k}_rad" for k in range(1, 7)), "payload_kg", column]
    rows = [f"{0.01 * k:.2f},{','.join(['0.1'] * 6)},2,{value}" for k in range(30)]
    path.write_text("\n".join([",".join(columns), *rows]), encoding="utf-8")
    return path


def test_where_the_payload_hangs_is_read_with_its_unit(tmp_path: Path) -> None:
    arm: Robot = demo_arm()
    (recording,) = load_recordings(written(tmp_path / "a.csv", "payload_z_mm", 60.0), arm)
    assert recording.columns["payload_z_m"] == pytest.approx(np.full(30, 0.06))
    with pytest.raises(InputError, match="expected payload_z_m or payload_z_mm"):
        load_recordings(written(tmp_path / "b.csv", "payload_z_inch", 2.0), arm)
