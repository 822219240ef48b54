# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A payload that is known: it is part of the model, and tells masses from the drives' constants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from truing.dynamics import Recording, identify, load_recordings, predict, with_payload
from truing.errors import InputError
from truing.model import AppliedEffect, Robot
from truing.testing.dynamics import NOISE, USUAL, coloured_noise, demo_arm, fourier_motion

OFF = (0.12, -0.10, 0.08, -0.15, 0.05)  # of the drives' constants, J1 … J5
LOAD = 5.0  # [kg]


def motion(seed: int, seconds: float = 24.0) -> Recording:
    time = np.arange(0.0, seconds, 0.01)
    return Recording(
        f"motion{seed}", time=time, position=fourier_motion(time, 6, np.random.default_rng([7, seed]))
    )


def test_known_payloads_give_masses_and_drive_constants_within_3_percent() -> None:
    arm = demo_arm()
    truth = arm.copy()
    for joint, factor in zip(truth.joints, (1.0, 1.1, 0.9, 1.05, 1.0, 1.0), strict=True):
        assert joint.mass is not None
        joint.mass *= factor
    bodies = truth.copy()
    friction = [
        AppliedEffect(effect, [joint.name], {f"{effect}.{joint.name}": values[k]})
        for joint, values in zip(arm.joints, USUAL, strict=True)
        for k, effect in enumerate(("coulomb", "viscous"))
    ]
    drives = [
        AppliedEffect("motor_constant", [joint.name], {f"motor_constant.{joint.name}": off})
        for joint, off in zip(arm.joints, OFF, strict=False)
    ]
    truth.torque_effects = [*friction, *drives]
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


def test_a_payload_is_put_where_none_is_stated() -> None:
    stated = motion(0, 2.0).replace(name="stated", columns={"payload_kg": np.full(200, 1.0)})
    kept, added = with_payload([stated, motion(1, 2.0)], 2.0, (0.0, 0.1, 0.0))
    assert set(kept.columns) == {"payload_kg"} and kept.columns["payload_kg"][0] == 1.0
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
