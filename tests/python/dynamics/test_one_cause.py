# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The same effect at most joints is one cause, and one line; its values are those of each joint."""

from __future__ import annotations

from pathlib import Path

import pytest

from pages import visible
from truing.dynamics import TorqueDiagnosis, diagnose
from truing.dynamics.result import write_diagnosis
from truing.testing.dynamics import USUAL, simulate_motion

JOINTS = [f"J{k}" for k in range(1, 7)]


def warming(joints: list[str], part: float = -0.02) -> TorqueDiagnosis:
    """Friction of these joints falls by so much of itself each second."""
    values = {
        f"warmup.{joint}.{name}": part * size
        for joint, sizes in zip(JOINTS, USUAL, strict=True)
        if joint in joints
        for name, size in zip(("coulomb", "viscous"), sizes, strict=True)
    }
    made = simulate_motion(hidden={"warmup": (joints, values)}, seed=4)
    return diagnose(made.nominal, made.recordings)


def test_an_arm_that_warms_up_is_one_line_with_the_values_of_each_joint(tmp_path: Path) -> None:
    found = warming(JOINTS)
    (one,) = [effect for effect in found.effects if not effect.standard]
    assert (one.effect, list(one.joints)) == ("warmup", JOINTS)
    assert one.probability >= 0.9
    assert one.sentence.endswith("at all joints")
    assert "at all joints" in found.sentence
    values = {p.name: p.value for p in one.parameters}
    for joint, (coulomb, viscous) in zip(JOINTS, USUAL, strict=True):
        assert values[f"warmup.{joint}.coulomb"] == pytest.approx(-0.02 * coulomb, rel=0.2)
        assert values[f"warmup.{joint}.viscous"] == pytest.approx(-0.02 * viscous, rel=0.2)
    assert 0.5 < one.share.value <= 1.0
    write_diagnosis(tmp_path, found, [])
    text = visible((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "as the arm warms up (6 joints)" in text
    before, values_of_joints = text.split("The values of each joint")
    assert before.count("as the arm warms up J1, J2, J3, J4, J5 and J6") == 1
    assert "warmup.J4.viscous" not in before and "warmup.J4.viscous" in values_of_joints


def test_four_of_six_joints_are_one_cause_and_said() -> None:
    joints = ["J1", "J2", "J3", "J5"]
    (one,) = [effect for effect in warming(joints).effects if not effect.standard]
    assert (one.effect, list(one.joints)) == ("warmup", joints)
    assert one.sentence.endswith("at J1, J2, J3, J5")


def test_two_joints_are_two_causes() -> None:
    found = [effect for effect in warming(["J2", "J4"]).effects if not effect.standard]
    assert sorted((effect.effect, *effect.joints) for effect in found) == [("warmup", "J2"), ("warmup", "J4")]
