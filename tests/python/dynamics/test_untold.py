# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A load that neither a recording nor the fitted robot states is said beside what is made of it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from truing.cli import main
from truing.dynamics import Recording, diagnose, load_recordings, predict, with_payload
from truing.dynamics.result import recording_columns
from truing.dynamics.sanity.untold import untold_load
from truing.files import load_robot, save_robot
from truing.files.common import write_table
from truing.model import AppliedEffect, Robot
from truing.testing.dynamics import NOISE, USUAL, coloured_noise, demo_arm, fourier_motion

REAL = Path(os.environ.get("TRUING_REALDATA", ""))
UR10E_CONSTANTS = (10.0, 10.6956, 8.4566, 9.0029, 9.48, 10.1232)  # [Nm/A] published beside the recordings
PLACE = (0.02, -0.04, 0.11)  # [m]
LOAD = 3.0  # [kg]


def fitted() -> Robot:
    arm = demo_arm()
    arm.torque_effects = [
        AppliedEffect(effect, [joint.name], {f"{effect}.{joint.name}": values[k]})
        for joint, values in zip(arm.joints, USUAL, strict=True)
        for k, effect in enumerate(("coulomb", "viscous"))
    ]
    return arm


def recording(mass: float, seed: int, gains: float = 1.0, picked: bool = False) -> Recording:
    """With torques, and no column that tells the load. picked: it hangs there in the second half alone."""
    time = np.arange(0.0, 24.0, 0.01)
    q = fourier_motion(time, 6, np.random.default_rng([51, seed]))
    made = Recording(f"motion{seed}", time=time, position=q)
    loaded = with_payload([made], mass, PLACE)[0]
    if picked:
        there = np.asarray(loaded.columns["payload_kg"]) * (time > 12.0)
        loaded = loaded.replace(columns={**loaded.columns, "payload_kg": there})
    torque = gains * np.asarray(predict(fitted(), loaded, cutoff=30.0).torque)
    noise = coloured_noise(torque.shape, np.random.default_rng([52, seed])) * NOISE * torque.std(axis=0)
    return made.replace(torque=torque + noise)


@pytest.mark.parametrize("seed", range(3))
def test_what_hangs_there_from_end_to_end_is_said_with_its_mass_and_place(seed: int) -> None:
    said = untold_load(fitted(), recording(LOAD, seed))
    mass = float(said.split("carry ")[1].split(" kg")[0])
    place = [float(v) for v in said.split("@")[1].removesuffix("mm)").split(",")]
    assert mass == pytest.approx(LOAD, rel=0.04)
    assert place == pytest.approx([1e3 * v for v in PLACE], abs=6.0)


def test_what_is_picked_up_is_said_with_its_times() -> None:
    said = untold_load(fitted(), recording(LOAD, 1, picked=True))
    mass = float(said.split("carry ")[1].split(" kg")[0])
    begin, end = (float(v) for v in said.split("from ")[1].split(" s,")[0].split(" to "))
    assert mass == pytest.approx(LOAD, rel=0.04)
    assert (begin, end) == (pytest.approx(12.0, abs=0.5), pytest.approx(24.0, abs=1.0))


@pytest.mark.parametrize("gains", [1.0, 1.2])
def test_without_a_load_nothing_is_said(gains: float) -> None:
    """Nor where all torques are of another scale: no mass at the tool looks like that."""
    assert untold_load(fitted(), recording(0.0, 2, gains)) == ""


def test_a_robot_that_was_not_fitted_and_a_stated_load_are_not_asked() -> None:
    loaded = recording(LOAD, 0)
    assert untold_load(demo_arm(), loaded) == ""
    assert untold_load(fitted(), with_payload([loaded], LOAD, PLACE)[0]) == ""
    assert untold_load(fitted(), loaded.replace(torque=None)) == ""


def test_predict_says_it_and_what_it_says_mends_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loaded = recording(LOAD, 0)
    save_robot(tmp_path / "robot.yaml", fitted())
    write_table(tmp_path / "loaded.csv", recording_columns(fitted(), loaded))
    command = ["dynamics", "predict", str(tmp_path / "robot.yaml"), str(tmp_path / "loaded.csv")]
    assert main([*command, "--out", str(tmp_path / "without")]) == 0
    result = json.loads((tmp_path / "without" / "result.json").read_text(encoding="utf-8"))
    (said,) = result["warnings"]
    option = said.split("--payload ")[1].rstrip(")")
    assert "carry 3.0" in capsys.readouterr().err.replace("\n", " ")
    assert main([*command, "--out", str(tmp_path / "with"), "--payload", option]) == 0
    mended = json.loads((tmp_path / "with" / "result.json").read_text(encoding="utf-8"))
    assert mended["warnings"] == []
    assert mended["errors"]["J2"]["rms"] < 0.5 * result["errors"]["J2"]["rms"]


@pytest.mark.realdata
def test_the_load_of_a_real_arm_is_said_and_of_unloaded_recordings_nothing() -> None:
    if not os.environ.get("TRUING_REALDATA") or not (REAL / "dyn_ur10e").exists():
        pytest.skip("TRUING_REALDATA does not hold dyn_ur10e")
    robot = load_robot(REAL / "dyn_ur10e" / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), UR10E_CONSTANTS, strict=True):
        robot.joints[index].torque_per_ampere = gain
    names = ("h5_20s", "h8_20s", "h10_20s", "h12_30s", "h12_50s", "h14_50s")
    files = [REAL / "dyn_ur10e" / f"{name}.csv" for name in (*names, "h12_40s", "ptp10", "h14_50s_load")]
    recordings = [one.replace(columns={}) for one in load_recordings(files, robot)]
    found = diagnose(robot, recordings[: len(names)])
    said = [untold_load(found.robot, one) for one in recordings[len(names) :]]
    assert said[:2] == ["", ""]
    assert float(said[2].split("carry ")[1].split(" kg")[0]) == pytest.approx(2.805, rel=0.15)
