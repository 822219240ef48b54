# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated measurements are what they claim to be."""

from __future__ import annotations

import math

import numpy as np
import pytest

import truing
from truing.examples import PALLETIZER_FREE, PALLETIZER_MODEL, example
from truing.testing.simulation import measure, random_joints, simulate, true_robot

EXAMPLES = ("palletizer", "ur10", "irb120")


@pytest.fixture(params=EXAMPLES)
def robot(request: pytest.FixtureRequest) -> truing.Robot:
    return truing.load_robot(example(request.param))


def test_the_nominal_robot_is_left_alone(robot: truing.Robot) -> None:
    before = truing.files.robot_to_yaml(robot)
    simulate(robot, poses=5, effects={f"backlash.{robot.joints[0].name}": 1e-4}, base_unknown=True)
    assert truing.files.robot_to_yaml(robot) == before


def test_without_errors_and_noise_the_nominal_robot_explains_everything(robot: truing.Robot) -> None:
    simulated = simulate(robot, poses=30, lengths=0, angles=0, noise=0, orientation=True, rotation_noise=0)
    residuals = truing.residuals(robot, simulated.data)
    assert np.abs(residuals.position).max() < 1e-14
    assert np.abs(residuals.rotation).max() < 1e-14
    assert simulated.truth.parameters == {}


def test_the_true_robot_leaves_nothing_but_the_noise(robot: truing.Robot) -> None:
    simulated = simulate(
        robot, poses=3000, noise=5e-5, orientation=True, rotation_noise=2e-4, base_unknown=True, seed=3
    )
    residuals = truing.residuals(simulated.truth.robot, simulated.data)
    assert np.std(residuals.position) == pytest.approx(5e-5, rel=0.05)
    assert np.std(residuals.rotation) == pytest.approx(2e-4, rel=0.05)


def test_hidden_errors_have_the_size_asked_for(robot: truing.Robot) -> None:
    found: dict[str, list[float]] = {"m": [], "rad": [], "-": []}
    for seed in range(40):
        for nominal, true, unit in true_robot(
            robot, lengths=2e-3, angles=5e-4, ratios=1e-4, seed=seed
        ).parameters.values():
            found[unit].append(true - nominal)
    for unit, sigma in (("m", 2e-3), ("rad", 5e-4), ("-", 1e-4)):
        assert np.std(found[unit]) == pytest.approx(sigma, rel=0.15)


def test_the_same_seed_gives_the_same_data_and_another_seed_does_not(robot: truing.Robot) -> None:
    first, again, other = (simulate(robot, poses=20, seed=seed) for seed in (5, 5, 6))
    assert (
        first.data.positions is not None
        and again.data.positions is not None
        and other.data.positions is not None
    )
    assert np.array_equal(first.data.positions, again.data.positions)
    assert not np.allclose(first.data.positions, other.data.positions)


def test_more_noise_does_not_change_the_robot_or_the_poses(robot: truing.Robot) -> None:
    quiet, loud = simulate(robot, poses=20, noise=0), simulate(robot, poses=20, noise=1e-3, columns=["temp"])
    assert quiet.truth.parameters == loud.truth.parameters
    assert np.array_equal(quiet.data.joints, loud.data.joints)


def test_only_the_chosen_values_get_errors() -> None:
    robot = truing.load_robot(example("palletizer"))
    truth = true_robot(robot, ratios=1e-4, only=PALLETIZER_MODEL)
    assert set(truth.parameters) == set(PALLETIZER_MODEL)
    assert len(PALLETIZER_MODEL) == 18
    with pytest.raises(truing.InputError, match="'J9.a' means no value"):
        true_robot(robot, only=["J9.a"])


def test_outliers_are_where_truth_says_and_as_long_as_asked_for(robot: truing.Robot) -> None:
    simulated = simulate(robot, poses=100, noise=0, outlier_share=0.05, outlier_length=5e-3)
    off = np.linalg.norm(truing.residuals(simulated.truth.robot, simulated.data).position, axis=1)
    assert len(simulated.outlier_rows) == 5
    assert np.flatnonzero(off > 1e-9).tolist() == list(simulated.outlier_rows)
    assert off[list(simulated.outlier_rows)] == pytest.approx(5e-3, rel=1e-9)


def test_backlash_brings_approach_directions_and_shifts_by_its_size() -> None:
    robot = truing.load_robot(example("irb120"))
    simulated = simulate(robot, poses=50, noise=0, lengths=0, angles=0, effects={"backlash.J1": 1e-3})
    assert simulated.data.directions is not None
    moved = np.linalg.norm(truing.residuals(robot, simulated.data).position, axis=1)
    frame = truing.predict(robot, simulated.data).position
    assert moved == pytest.approx(0.5e-3 * np.hypot(frame[:, 0], frame[:, 1]), rel=1e-3)


def test_effects_of_the_model_become_its_parameters() -> None:
    robot = truing.load_robot(example("irb120"))
    truth = true_robot(robot, lengths=0, angles=0, effects={"gear_ratio.J2": 1e-4, "joint_offset.J3": -2e-3})
    assert truth.robot.joint("J2").ratio == 1.0 + 1e-4
    assert truth.robot.joint("J3").offset == -2e-3
    assert truth.parameters == {"J2.ratio": (1.0, 1.0001, "-"), "J3.offset": (0.0, -2e-3, "rad")}


@pytest.mark.parametrize(
    ("effects", "complaint"),
    [
        ({"slack.J1": 1.0}, "there are"),
        ({"backlash.J9": 1.0}, "J9"),
        ({"link_geometry.J1": 1.0}, "link geometry"),
        ({"gear_ratio.J1.x": 1.0}, "one parameter"),
    ],
)
def test_an_effect_that_cannot_be_is_refused(effects: dict[str, float], complaint: str) -> None:
    with pytest.raises(truing.InputError, match=complaint):
        simulate(truing.load_robot(example("irb120")), effects=effects)


@pytest.mark.parametrize(
    "keywords", [{"poses": 0}, {"outlier_share": 1.0}, {"noise": -1.0}, {"columns": ["humidity"]}]
)
def test_what_makes_no_sense_is_refused(keywords: dict[str, object]) -> None:
    truth = true_robot(truing.load_robot(example("irb120")))
    with pytest.raises(truing.InputError):
        measure(truth, **keywords)  # type: ignore[arg-type]


def test_random_poses_keep_the_limits_and_need_them_for_rails(robot: truing.Robot) -> None:
    joints = random_joints(robot, 500)
    for column, index in enumerate(robot.driven_joints()):
        joint = robot.joints[index]
        assert joint.lower <= joints[:, column].min() and joints[:, column].max() <= joint.upper
    rail = truing.Robot("rail", joints=[truing.Joint("X", type="prismatic")])
    with pytest.raises(truing.InputError, match="give it `limits`"):
        random_joints(rail, 3)
    turntable = truing.Robot("turntable", joints=[truing.Joint("T")])
    assert np.abs(random_joints(turntable, 100)).max() <= math.pi


def test_a_urdf_robot_gets_errors_too() -> None:
    text = (
        '<robot name="two"><link name="a"/><link name="b"/><link name="c"/><joint name="j1"'
        ' type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.5"/><axis xyz="0 0'
        ' 1"/></joint><joint name="j2" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.4'
        ' 0 0"/><axis xyz="0 1 0"/></joint></robot>'
    )
    truth = true_robot(truing.model.robot_from_urdf(text))
    assert {"j1.x", "j2.rz", "j1.offset", "tool.z"} <= set(truth.parameters)
    assert len(measure(truth, poses=7).data) == 7


def test_truth_json_holds_what_a_judge_needs() -> None:
    simulated = simulate(
        truing.load_robot(example("palletizer")),
        poses=10,
        effects={"backlash.J2": 2e-4},
        outlier_share=0.1,
        seed=4,
    )
    truth = simulated.to_dict()
    assert truth["format"] == "truing-truth/1"
    assert truth["robot"]["format"] == "truing-robot/1"
    assert truth["effects"] == [
        {"effect": "backlash", "joint": "J2", "parameter": "backlash.J2", "value": 2e-4}
    ]
    assert truth["seed"] == 4 and truth["rows"] == 10 and len(truth["outlier_rows"]) == 1


@pytest.mark.parametrize("solver", ["lm", "ceres"])
def test_identification_finds_the_hidden_palletizer(solver: str) -> None:
    robot = truing.load_robot(example("palletizer"))
    simulated = simulate(
        robot,
        poses=150,
        only=PALLETIZER_MODEL,
        ratios=1e-3,
        effects={"backlash.J3": 4e-4},
        base_unknown=True,
        seed=2,
    )
    found = truing.identify(robot, simulated.data, free=PALLETIZER_FREE, effects="backlash:J3", solver=solver)  # type: ignore[arg-type]
    fresh = truing.Measurements(random_joints(robot, 500, 77), directions=np.ones((500, 4)))
    gap = truing.predict(found.robot, fresh).position - truing.predict(simulated.truth.robot, fresh).position
    assert np.linalg.norm(gap, axis=1).mean() < 3e-5
    tied = {name for frozen in found.frozen for name in frozen.combination}
    for p in found.parameters:
        if not p.frozen and p.name in simulated.truth.parameters and p.name not in tied:
            assert abs(p.value - simulated.truth.parameters[p.name][1]) < 4.5 * p.sigma, p.name


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("scale", ()),
        ("drift.base.x", ("t",)),
        ("thermal.elbow", ("temp",)),
        ("transmission_error@7.5.elbow.cos", ()),
        ("gravity_backlash.elbow", ("payload",)),
    ],
)
def test_effects_of_every_form_can_be_hidden(name: str, columns: tuple[str, ...]) -> None:
    robot = truing.load_robot(example("ur10"))
    plain = truing.simulate(robot, noise=0.0, poses=50, columns=columns, lengths=0.0, angles=0.0, seed=1)
    hidden = truing.simulate(
        robot, effects={name: 1e-4}, noise=0.0, poses=50, columns=columns, lengths=0.0, angles=0.0, seed=1
    )
    moved = np.linalg.norm(np.asarray(hidden.data.positions) - np.asarray(plain.data.positions), axis=1)
    assert moved.max() > 1e-6
