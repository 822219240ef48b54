# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one's own that carry traits are diagnosed, planned and simulated like those of the catalogue."""

from __future__ import annotations

import numpy as np
import pytest

import truing
from truing.examples import example
from truing.model import EffectTraits, catalogue_effects

COOL = "let the arm cool down between poses"


def creep(joint: str) -> truing.Effect:
    """The same at one joint as the catalogue's joint zero that moves with temperature."""
    return truing.Effect(
        "creep",
        site=joint,
        basis=lambda d: d.temperature - 20.0,
        unit="rad/K",
        traits=EffectTraits(
            driver="temperature", law="of_warmth", separated_by={"": COOL}, usual=3e-5, plausible=2e-4
        ),
    )


def test_an_own_effect_is_named_drawn_and_told_apart_in_its_own_words() -> None:
    robot = truing.load_robot(example("ur10"))
    joint = robot.joints[1].name
    simulated = truing.simulate(
        robot,
        poses=120,
        effects={f"creep.{joint}": 8e-5},
        own_effects=creep(joint),
        lengths=0.0,
        angles=0.0,
        seed=3,
    )
    found = truing.diagnose(robot, simulated.data, effects=creep(joint), resamples=8, seed=1)
    named = {(e.effect, e.joints): e for e in found.effects}
    key = next(key for key in named if key[1] == (joint,) and key[0] in ("creep", "thermal_zero"))
    others = {a.effect: a.separated_by for a in named[key].confounded_with}
    assert {key[0], *others} >= {"creep", "thermal_zero"}
    assert COOL in others.values()
    assert any(curve.input == "temp" for curve in named[key].curves)


def test_a_plan_says_how_small_an_own_effect_it_would_show() -> None:
    robot = truing.load_robot(example("ur10"))
    joint = robot.joints[1].name
    poses = truing.plan(robot, poses=30, sweeps=1, proposals=4, seed=1).joints
    seen = truing.distinguish(robot, poses, columns="temp", effects=creep(joint))
    size = next(e for e in seen.effects if e.effect == "creep")
    same = next(e for e in seen.effects if e.effect == "thermal_zero" and e.joint == joint)
    assert size.joint == joint and size.unit == "rad/K"
    assert size.size == pytest.approx(same.size, rel=1e-6)
    pair = next(
        p for p in seen.alike if {p.effect, p.other} == {"creep", "thermal_zero"} and p.joint == joint
    )
    assert pair.separated_by == COOL


def test_what_a_plan_does_not_record_makes_an_own_effect_not_testable() -> None:
    robot = truing.load_robot(example("ur10"))
    poses = truing.plan(robot, poses=30, sweeps=1, proposals=4, seed=1).joints
    seen = truing.distinguish(robot, poses, effects=creep(robot.joints[1].name))
    assert any(n.effect == "creep" and "temp_C" in n.why for n in seen.not_testable)


def test_an_own_effect_is_simulated_with_the_column_that_drives_it() -> None:
    robot = truing.load_robot(example("ur10"))
    joint = robot.joints[1].name
    hidden = truing.simulate(
        robot, poses=40, effects={f"creep.{joint}": None}, own_effects=creep(joint), noise=0.0, seed=2
    )
    plain = truing.simulate(robot, poses=40, columns=["temp"], noise=0.0, seed=2)
    assert hidden.columns == ("temp",)
    (drawn,) = hidden.truth.effects
    assert 1.5e-5 <= abs(drawn.value) <= 4.5e-5
    moved = np.linalg.norm(np.asarray(hidden.data.positions) - np.asarray(plain.data.positions), axis=1)
    assert moved.max() > 1e-5


def test_traits_that_mean_nothing_are_errors_that_list_what_there_is() -> None:
    with pytest.raises(truing.InputError, match="driver: found 'heat', expected one of .*'temperature'"):
        EffectTraits(driver="heat")
    with pytest.raises(truing.InputError, match="law_test needs a law"):
        EffectTraits(law_test="of_driver")


@pytest.mark.parametrize(
    "effect", [e for e in catalogue_effects() if e.traits.usual > 0 and not e.traits.stands_for]
)
def test_sizes_drawn_for_effects_of_the_catalogue_are_plausible(effect: object) -> None:
    assert 1.5 * effect.traits.usual <= effect.traits.plausible  # type: ignore[attr-defined]
