# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The Python face of the C++ core: nothing is copied that need not be, nothing is lost without an error."""

from __future__ import annotations

import copy
import gc
import inspect
import pickle
import threading
import time
from typing import Any

import numpy as np
import pytest

import truing
from truing import _core
from truing.diagnosis import DiagnoseOptions
from truing.effects import Inputs, parse_effects
from truing.hand_eye import HandEyeOptions, HandEyePlanOptions, handeye_plan
from truing.identification import Identification, IdentifyOptions
from truing.inverse_kinematics import InverseOptions, PathOptions
from truing.keywords import fields, made
from truing.model import (
    Anchor,
    AppliedEffect,
    catalogue,
    gravity_torques,
    pose_groups,
    rotation_from_rpy,
    rpy_from_rotation,
    validate_measurements,
    validate_robot,
)
from truing.planning import DistinguishOptions, PlanOptions


@pytest.fixture
def robot() -> truing.Robot:
    """Six driven joints and a passive one, near to a palletizer's start and a wrist."""
    rows = [
        (0.5, 0.2, -1.57),
        (0.0, 0.9, 0.0),
        (0.1, 0.15, -1.57),
        (0.0, 0.05, 1.57),
        (0.8, 0.0, -1.57),
        (0.0, 0.0, 1.57),
        (0.1, 0.0, 0.0),
    ]
    joints = [
        truing.Joint(f"J{i}", d=d, a=a, alpha=alpha, mass=5.0) for i, (d, a, alpha) in enumerate(rows, 1)
    ]
    joints[3].driven_by = {"J2": -1.0, "J3": -0.5}
    tool = np.eye(4)
    tool[:3, 3] = 0.05, 0.02, 0.15
    return truing.Robot("arm", joints=joints, targets=[truing.Target("tool", tool)])


@pytest.fixture
def q() -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.5, 1.5, (120, 6))


def turn(axis: int, angle: float) -> np.ndarray:
    frame = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    frame[i, i] = frame[j, j] = np.cos(angle)
    frame[i, j], frame[j, i] = -np.sin(angle), np.sin(angle)
    return frame


# ---- Keywords and values -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make",
    [
        lambda r, q: truing.Joint("J1", alfa=1.0),
        lambda r, q: truing.Robot("arm", joints=[], tool=1),
        lambda r, q: truing.Measurements(q, position=q[:, :3]),
        lambda r, q: IdentifyOptions(losss="none"),
        lambda r, q: PlanOptions(pose=3),
        lambda r, q: truing.identify(r, truing.Measurements(q), iterations=3),
        lambda r, q: r.replace(joint=[]),
        lambda r, q: r.joints[0].replace(alfa=1.0),
    ],
)
def test_a_keyword_typo_raises(make: Any, robot: truing.Robot, q: np.ndarray) -> None:
    with pytest.raises(TypeError):
        make(robot, q)


def test_an_attribute_typo_raises(robot: truing.Robot) -> None:
    with pytest.raises(AttributeError):
        robot.joints[0].alfa = 1.0  # type: ignore[attr-defined]
    with pytest.raises(AttributeError):
        IdentifyOptions().losss = "none"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("make", "choices"),
    [
        (lambda: truing.Joint("J1", type="spherical"), "'revolute', 'prismatic'"),
        (lambda: IdentifyOptions(solver="gauss"), "'lm', 'ceres'"),
        (lambda: PlanOptions(index="best"), "'d_optimal'"),
    ],
)
def test_an_unknown_word_lists_the_choices(make: Any, choices: str) -> None:
    with pytest.raises(truing.InputError, match=choices):
        make()


@pytest.mark.parametrize(
    ("function", "options"),
    [
        (truing.identify, IdentifyOptions()),
        (truing.plan, PlanOptions()),
        (truing.distinguish, DistinguishOptions()),
        (truing.diagnose, DiagnoseOptions()),
        (truing.handeye, HandEyeOptions()),
        (truing.inverse, InverseOptions()),
        (truing.inverse_path, PathOptions()),
        (truing.compensate, InverseOptions()),
    ],
)
def test_functions_take_the_fields_of_their_options_and_say_what_they_mean(
    function: Any, options: Any
) -> None:
    taken, names = inspect.signature(function).parameters, fields(type(options))
    assert names and "options" not in taken
    for name in names:
        assert taken[name].default == getattr(options, name) or name == "scene", name
        first = (getattr(type(options), name).__doc__ or "").split()[0]
        assert f"\n{name} = " in function.__doc__ and first in function.__doc__, name


def test_the_plan_of_hand_poses_takes_the_fields_of_its_options() -> None:
    taken, names = inspect.signature(handeye_plan).parameters, fields(HandEyePlanOptions)
    assert names == ["count", "candidates", "tilt", "reach", "seed"]
    assert [taken[name].default for name in names] == [getattr(HandEyePlanOptions(), name) for name in names]
    assert all(f"\n{name} = " in (handeye_plan.__doc__ or "") for name in names)


def test_names_may_be_one_text() -> None:
    made_of = made(IdentifyOptions, {"free": "J2.*, tool.x", "hold": ["base.*"], "loss": "none"})
    assert made_of.free == ("J2.*", "tool.x") and made_of.hold == ("base.*",) and made_of.loss == "none"


def test_what_is_set_on_a_joint_reaches_the_robot(robot: truing.Robot) -> None:
    robot.joints[1].a = 0.3
    robot.joint("J3").offset = 0.01
    robot.targets[0].name = "ball"
    assert [robot.joints[1].a, robot.joints[2].offset, robot.targets[0].name] == [0.3, 0.01, "ball"]
    with pytest.raises(truing.InputError, match="J7"):
        robot.joint("J9")


def test_changes_that_would_be_lost_raise(robot: truing.Robot) -> None:
    with pytest.raises(ValueError, match="read-only"):
        robot.gravity[2] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        robot.T_measurement_base[0, 3] = 1.0
    with pytest.raises(TypeError):
        robot.joints[0] = truing.Joint("J1")  # type: ignore[index]
    with pytest.raises(AttributeError):
        robot.joints = []  # type: ignore[misc, assignment]
    with pytest.raises(AttributeError):
        IdentifyOptions().free.append("J1.a")  # type: ignore[attr-defined]
    effect = AppliedEffect("backlash", ["J2"], {"backlash.J2": 1e-4})
    with pytest.raises(TypeError):
        effect.parameters["backlash.J2"] = 0.0  # type: ignore[index]


def test_a_joint_keeps_its_robot_alive(robot: truing.Robot) -> None:
    joint = robot.copy().joints[1]
    gc.collect()
    assert joint.a == 0.9


def test_copy_replace_and_pickle_make_independent_equals(robot: truing.Robot, q: np.ndarray) -> None:
    robot.effects = [AppliedEffect("backlash", ["J2"], {"backlash.J2": 1e-4})]
    robot.anchor = Anchor([1.0, 2.0, 3.0], 0.1)
    robot.T_measurement_base = turn(2, 0.3)
    expected = truing.forward_kinematics(robot, q[0])
    for twin in (robot.copy(), copy.deepcopy(robot), robot.replace(), pickle.loads(pickle.dumps(robot))):
        np.testing.assert_array_equal(truing.forward_kinematics(twin, q[0]), expected)
        assert twin.joints[3].driven_by == (("J2", -1.0), ("J3", -0.5))
        assert dict(twin.effects[0].parameters) == {"backlash.J2": 1e-4}
        assert twin.anchor is not None and twin.anchor.zero == 0.1
        twin.joints[0].d = 9.0
        assert robot.joints[0].d == 0.5
    fewer = robot.replace(joints=[joint.replace(driven_by={}) for joint in robot.joints[:5]], name="short")
    assert (fewer.name, len(fewer.joints), fewer.driven_count) == ("short", 5, 5)


def test_reprs_tell_what_matters(robot: truing.Robot, q: np.ndarray) -> None:
    assert repr(robot) == "Robot('arm', dh, 7 joints (6 driven), targets: tool)"
    assert "driven_by={'J2': -1, 'J3': -0.5}" in repr(robot.joints[3])
    assert (
        repr(truing.Measurements(q, positions=q[:, :3])) == "Measurements(120 rows, 6 joints, 120 positions)"
    )


# ---- Frames --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (np.eye(3), r"shape \(3, 3\)"),
        (np.diag([1.1, 1.0, 1.0, 1.0]), "off orthonormal"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "left-handed"),
        (np.ones((4, 4)), "last row"),
        (np.full((4, 4), np.nan), "finite"),
    ],
)
def test_a_frame_that_is_not_rigid_raises(frame: np.ndarray, message: str, robot: truing.Robot) -> None:
    with pytest.raises(truing.InputError, match=message):
        robot.T_measurement_base = frame
    with pytest.raises(truing.InputError, match=message):
        truing.Target("tool", frame)


def test_a_frame_comes_back_bit_for_bit_and_a_rounded_one_becomes_rigid(robot: truing.Robot) -> None:
    frame = turn(0, 0.7) @ turn(1, -0.2)
    robot.T_measurement_base = frame
    np.testing.assert_array_equal(robot.T_measurement_base, frame)
    robot.T_measurement_base = np.round(frame, 7)
    rotation = robot.T_measurement_base[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-15)


def test_frames_of_a_chain(robot: truing.Robot, q: np.ndarray) -> None:
    frames = truing.forward_kinematics(robot, q[0])
    assert frames.shape == (8, 4, 4)
    np.testing.assert_allclose(frames[-1], frames[-2] @ robot.targets[0].T_last_target, atol=1e-15)
    predicted = truing.predict(robot, truing.Measurements(q[:1]))
    np.testing.assert_allclose(predicted.position[0], frames[-1, :3, 3], atol=1e-12)


# ---- Measurements --------------------------------------------------------------------------------


def test_float64_arrays_are_not_copied_whatever_their_strides() -> None:
    table = np.arange(200.0).reshape(20, 10)
    wide = np.zeros((40, 10))
    data = truing.Measurements(
        table[::2, 1:7],
        positions=table[::2, 7:10].copy(order="F"),
        temperature=table[::-2, 0],
        time=wide[5:15, 3],
    )
    np.testing.assert_array_equal(data.joints, table[::2, 1:7])
    np.testing.assert_array_equal(data.temperature, table[::-2, 0])
    table[2, 3] = -7.0
    table[1, 0] = -8.0
    wide[6, 3] = 2.5
    assert data.joints[1, 2] == -7.0
    assert data.temperature is not None and data.temperature[-1] == -8.0
    assert data.time is not None and data.time[1] == 2.5


def test_columns_are_taken_without_a_copy_and_kept_alive() -> None:
    pa = pytest.importorskip("pyarrow")
    columns = [np.arange(5.0) + i for i in range(6)]
    data = truing.Measurements(columns, positions=tuple(pa.array(np.arange(5.0) * i) for i in range(3)))
    columns[4][2] = 99.0
    assert data.joints[2, 4] == 99.0
    time_column = truing.Measurements(np.zeros((3, 6)), time=np.arange(3.0)).time
    del columns
    gc.collect()
    assert data.joints[2, 4] == 99.0
    np.testing.assert_array_equal(data.positions, np.outer(np.arange(5.0), np.arange(3.0)))
    np.testing.assert_array_equal(time_column, [0.0, 1.0, 2.0])


def test_what_is_not_float64_is_converted() -> None:
    odd = np.frombuffer(b"\0" + np.arange(4.0).tobytes(), dtype=np.uint8)[1:].view("f8")  # not aligned
    packed = np.zeros(4, dtype=[("flag", "i1"), ("value", "f8")])  # strides of 9 bytes
    packed["value"] = np.arange(4.0)
    masked = np.ma.masked_array([0.0, 1.0, 2.0, 3.0], mask=[0, 1, 0, 0])
    data = truing.Measurements(
        [[0] * 6] * 4,
        distances=odd,
        time=packed["value"],
        temperature=np.arange(4, dtype=np.float32),
        payload=2.5,
        covariates={"hall": masked, "big": np.arange(4.0).astype(">f8")},
    )
    for values in (data.distances, data.time, data.temperature, data.covariates["big"]):
        np.testing.assert_array_equal(values, np.arange(4.0))
    np.testing.assert_array_equal(data.payload, [2.5] * 4)
    assert np.isnan(data.covariates["hall"][1])


def test_labels_become_numbers(robot: truing.Robot) -> None:
    q = np.zeros((4, 6))
    data = truing.Measurements(
        q,
        fixed_points=["hole", "", None, "pin"],
        pose=["b", "a", "b", "a"],
        set=["train", "test", "train", "test"],
        targets=np.array(["tool"] * 4),
        robot=robot,
    )
    assert data.fixed_point_names == ("hole", "pin")
    for found, expected in (
        (data.fixed_points, [0, -1, -1, 1]),
        (data.pose, [0, 1, 0, 1]),
        (data.set, [0, 1, 0, 1]),
        (data.targets, [0] * 4),
    ):
        np.testing.assert_array_equal(found, expected)
    same = truing.Measurements(
        q,
        fixed_points=np.array([0, -1, -1, 1]),
        fixed_point_names=["hole", "pin"],
        set=np.array([0, 1, 0, 1], np.int8),
    )
    np.testing.assert_array_equal(same.fixed_points, data.fixed_points)
    np.testing.assert_array_equal(pose_groups(data), [0, 1, 0, 1])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"positions": np.zeros((4, 3))}, "positions has 4 rows, joints has 5"),
        ({"positions": np.zeros((5, 2))}, "positions has 2 columns, expected 3"),
        ({"positions": np.zeros(5)}, r"positions must have shape \(n, 3\); found shape \(5,\)"),
        ({"positions": [np.zeros(3)] * 5}, "a list of arrays holds columns"),
        ({"time": 3.0}, r"time must have shape \(n,\)"),
        ({"time": ["a"] * 5}, "time holds <U1 values, not numbers"),
        ({"time": [1.0, None, 2.0, 3.0, 4.0]}, "write NaN"),
        ({"directions": np.zeros((5, 4))}, "directions has 4 columns, expected 6"),
        (
            {"set": ["train", "test", "hold", "test", "test"]},
            "set: row 2 holds 'hold', expected one of: train, test",
        ),
        ({"set": [0, 1, 2, 0, 0]}, "set: row 2 holds 2"),
        ({"set": ["train"]}, "set has 1 rows"),
        ({"targets": ["tool", "ball", "tool", "tool", "tool"]}, "targets: row 1 holds 'ball'"),
        ({"fixed_points": [0, 1, 0, 0, 0], "fixed_point_names": ["hole"]}, "fixed_points: row 1 holds 1"),
        ({"pose": [0.0] * 5}, "pose: row 0 holds 0.0"),
        ({"covariates": {"hall": np.zeros(4)}}, "covariate hall has 4 rows"),
    ],
)
def test_columns_that_do_not_fit_are_named(columns: dict[str, Any], message: str) -> None:
    with pytest.raises(truing.InputError, match=message):
        truing.Measurements(np.zeros((5, 6)), **columns)


def test_measurements_can_be_pickled_and_replaced(q: np.ndarray) -> None:
    data = truing.Measurements(
        q,
        positions=q[:, :3],
        set=["train", "test"] * 60,
        fixed_points=["a"] * 120,
        payload=1.0,
        covariates={"x": q[:, 0]},
    )
    twin = pickle.loads(pickle.dumps(data))
    np.testing.assert_array_equal(twin.positions, data.positions)
    np.testing.assert_array_equal(twin.set, data.set)
    np.testing.assert_array_equal(twin.covariates["x"], q[:, 0])
    assert twin.fixed_point_names == ("a",)
    assert data.replace(set=None).set is None


def test_a_million_rows_cost_next_to_nothing() -> None:
    joints, positions = np.zeros((1_000_000, 6)), np.zeros((1_000_000, 3))
    best = min(
        _seconds(lambda: truing.Measurements(joints, positions=positions, time=joints[:, 0]))
        for _ in range(5)
    )
    assert best < 5e-3


def _seconds(function: Any) -> float:
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def test_validation_names_the_row(robot: truing.Robot, q: np.ndarray) -> None:
    q[3, 1] = np.nan
    with pytest.raises(truing.InputError, match="3"):
        validate_measurements(truing.Measurements(q, positions=q[:, :3]), robot)
    with pytest.raises(ValueError):  # InputError is one
        validate_robot(robot.replace(joints=[]))


# ---- Effects -------------------------------------------------------------------------------------


def test_effects_are_read_from_text() -> None:
    requests = parse_effects("backlash, harmonic:J2+J3")
    assert [(r.effect, r.joints) for r in requests] == [("backlash", ()), ("harmonic", ("J2", "J3"))]
    for text in ("backlash,", "harmonic:", ":J2", "harmonic:J2+"):
        with pytest.raises(truing.InputError, match="cannot read the effects"):
            parse_effects(text)


def test_inputs_are_views_of_the_data(robot: truing.Robot, q: np.ndarray) -> None:
    data = truing.Measurements(
        q, directions=np.sign(q), temperature=q[:, 0], payload=3.0, covariates={"hall": q[:, 5]}
    )
    inputs = Inputs(robot, data)
    robot.joints[1].ratio = 1.1  # what was read does not depend on the parameters
    np.testing.assert_array_equal(inputs.joint("J3"), q[:, 2])
    np.testing.assert_allclose(inputs.joint("J4"), -q[:, 1] - 0.5 * q[:, 2], rtol=1e-15)
    np.testing.assert_array_equal(inputs.direction("J5"), np.sign(q[:, 3]))
    np.testing.assert_array_equal(inputs.temperature, q[:, 0])
    np.testing.assert_array_equal(inputs.column("hall"), q[:, 5])
    np.testing.assert_allclose(inputs.gravity_torque("J2")[7], gravity_torques(robot, q[7], 3.0)[1])
    assert len(inputs) == len(q)
    with pytest.raises(truing.InputError, match="passive"):
        inputs.direction("J4")
    with pytest.raises(truing.InputError, match="t_s"):
        _ = inputs.time
    with pytest.raises(truing.InputError, match="its covariates are: hall"):
        inputs.column("current")


@pytest.mark.parametrize(
    ("basis", "message"),
    [
        (lambda d: 1.0, r"shape \(\), expected \(120,\)"),
        (lambda d: np.zeros(3), r"shape \(3,\)"),
        (lambda d: np.where(np.arange(len(d)) == 5, np.nan, 1.0), "row 5"),
        (lambda d: ["a"] * len(d), "numbers"),
        (lambda d: {}, "empty mapping"),
        (lambda d: d.joint("J9"), "J9"),
    ],
)
def test_a_basis_that_cannot_be_used_says_why(
    basis: Any, message: str, robot: truing.Robot, q: np.ndarray
) -> None:
    with pytest.raises(truing.InputError, match=message):
        truing.Effect("mine", "J2", basis).evaluate(robot, truing.Measurements(q))


def test_an_effect_that_cannot_be_placed_says_why(robot: truing.Robot, q: np.ndarray) -> None:
    def basis(d: Inputs) -> np.ndarray:
        return np.ones(len(d))

    with pytest.raises(truing.InputError, match="taken by the catalogue"):
        truing.Effect("backlash", "J2", basis)
    with pytest.raises(truing.InputError, match="one word"):
        truing.Effect("my effect", "J2", basis)
    with pytest.raises(truing.InputError, match="'J9' does not exist"):
        truing.Effect("mine", "J9", basis).evaluate(robot, truing.Measurements(q))
    with pytest.raises(truing.InputError, match="plan cannot use own effects"):
        truing.plan(robot, effects=truing.Effect("mine", "J2", basis))


def test_own_effects_are_found_and_predicted(robot: truing.Robot, q: np.ndarray) -> None:
    calls = []

    def once_per_turn(d: Inputs) -> dict[str, np.ndarray]:
        calls.append(len(d))
        return {"cos": np.cos(2 * d.joint("J2")), "sin": np.sin(2 * d.joint("J2"))}

    wave = truing.Effect("wave", "J2", once_per_turn)
    sag = truing.Effect(
        "sag",
        "*",
        lambda d, joint: d.column("heat") * (1.0 if joint == "J5" else d.joint(joint)),
        unit="rad/K",
    )
    heat = np.random.default_rng(4).uniform(0.0, 10.0, len(q))
    truth = robot.replace(
        effects=[
            AppliedEffect("wave", ["J2"], {"wave.J2.cos": 3e-4, "wave.J2.sin": -2e-4}),
            AppliedEffect("sag", ["J5"], {"sag.J5": 4e-5}),
        ]
    )
    rows = truing.Measurements(q, covariates={"heat": heat})
    measured = truing.predict(truth, rows, effects=[wave, sag]).position
    data = rows.replace(positions=measured)
    assert calls == [len(q)]

    found = truing.identify(
        robot,
        data,
        free=["J3.offset"],
        effects=[wave, truing.Effect("sag", "J5", lambda d: d.column("heat"))],
        loss="none",
    )
    assert calls == [len(q)] * 2
    values = {p.name: p.value for p in found.parameters}
    np.testing.assert_allclose(
        [values["wave.J2.cos"], values["wave.J2.sin"], values["sag.J5"]], [3e-4, -2e-4, 4e-5], atol=1e-9
    )
    assert found.parameter("sag.J5").unit == "rad"
    again = truing.residuals(found.robot, data, effects=[wave, sag])
    assert np.abs(again.position).max() < 1e-8
    with pytest.raises(truing.InputError, match="wave"):
        truing.predict(found.robot, data)


# ---- The four verbs ------------------------------------------------------------------------------


@pytest.fixture
def data(robot: truing.Robot, q: np.ndarray) -> truing.Measurements:
    truth = robot.copy()
    truth.joints[1].a += 1e-3
    truth.joints[2].offset += 2e-3
    position = truing.predict(truth, truing.Measurements(q)).position
    return truing.Measurements(
        q, positions=position + np.random.default_rng(5).normal(0.0, 2e-5, position.shape)
    )


def test_identify_returns_what_was_wrong(robot: truing.Robot, data: truing.Measurements) -> None:
    found = truing.identify(robot, data, free="J2.a, J3.offset", seed=2)
    assert found.solver.converged
    assert found.parameter("J2.a").value == pytest.approx(robot.joints[1].a + 1e-3, abs=5e-5)
    assert found.robot.joint("J3").offset == pytest.approx(2e-3, abs=5e-5)
    assert robot.joint("J3").offset == 0.0
    assert set(found.errors) == {"train", "test"}
    assert found.errors["train"].after.rms < found.train.before.rms
    assert found.covariance.shape == (found.rank, found.rank)
    assert len(found.set) == len(data) and set(np.unique(found.set)) == {0, 1}
    assert "converged" in found.summary()
    assert "J2.a" in repr(found.parameters[[p.name for p in found.parameters].index("J2.a")])
    with pytest.raises(truing.InputError, match="J2.a"):
        found.parameter("J2.b")
    with pytest.raises(AttributeError):
        found.rank = 3  # type: ignore[misc]


def test_a_fit_that_does_not_converge_raises_with_its_result(
    robot: truing.Robot, data: truing.Measurements
) -> None:
    with pytest.raises(truing.NotConvergedError, match="did not converge") as raised:
        truing.identify(robot, data, max_iterations=1, loss="none")
    assert isinstance(raised.value.result, Identification)
    assert not truing.identify(
        robot, data, max_iterations=1, loss="none", raise_if_not_converged=False
    ).solver.converged


def test_bad_options_and_data_are_input_errors(
    robot: truing.Robot, data: truing.Measurements, q: np.ndarray
) -> None:
    with pytest.raises(truing.InputError):
        truing.identify(robot, data, free=["J2.aa"])
    with pytest.raises(truing.InputError):
        truing.identify(robot, data, max_iterations=0)
    with pytest.raises(truing.InputError, match="dir2"):
        truing.identify(robot, data, effects="backlash:J2")
    with pytest.raises(truing.InputError, match="joints"):
        truing.predict(robot, truing.Measurements(q[:, :5]))


def test_other_threads_run_while_the_core_works(robot: truing.Robot) -> None:
    many = truing.Measurements(np.random.default_rng(6).uniform(-1.0, 1.0, (300_000, 6)))
    done = threading.Event()

    def work() -> None:
        truing.predict(robot, many, threads=1)
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    turns = 0
    while not done.is_set():
        turns += 1
        time.sleep(1e-4)
    thread.join()
    assert turns > 3


def test_distinguish_says_what_a_plan_tells_apart(robot: truing.Robot, q: np.ndarray) -> None:
    seen = truing.distinguish(robot, q[:40], columns="dir,temp", separate="backlash:J2,thermal_zero:J2")
    assert {e.effect for e in seen.effects} == {"backlash", "thermal_zero"}
    assert seen.r2.shape == (2, 2) and np.allclose(np.diag(seen.r2), 1)
    assert seen.direction is not None and seen.direction.shape == (40 + seen.added, 6)
    assert seen.temperature is not None and seen.payload is None and seen.time is None
    assert np.array_equal(seen.joints[:40], q[:40])
    (pair,) = seen.separated
    assert pair.r2 < 0.98 and pair.size > 0 and "EffectPair(" in repr(pair)
    with pytest.raises(truing.InputError, match="dir, payload, temp, t"):
        truing.distinguish(robot, q, columns="humidity")
    with pytest.raises(truing.InputError, match="driven"):
        truing.distinguish(robot, q[:, :3])
    with pytest.raises(truing.InputError, match="shape"):
        truing.distinguish(robot, q[0])
    mine = truing.Effect("mine", "J2", lambda d: np.ones(len(d)))
    asked = truing.distinguish(robot, q, separate=[mine, *parse_effects("joint_offset:J2")], add=0)
    assert {e.effect for e in asked.effects} == {"mine", "joint_offset"}


def test_plan_gives_poses(robot: truing.Robot) -> None:
    planned = truing.plan(robot, poses=20, free=["J2.*", "J3.*"], sweeps=1, proposals=4)
    assert planned.joints.shape == (20, 6)
    assert planned.index_end >= planned.index_start
    assert all(isinstance(p, truing.common.Parameter) for p in planned.parameters)


def test_the_core_is_documented() -> None:
    for name in dir(_core):
        assert name.startswith("_") or getattr(_core, name).__doc__, name
    assert truing.__version__ == _core.version()
    assert ("backlash" in dict(catalogue())) and all(summary for _, summary in catalogue())


@pytest.mark.parametrize("rpy", [(0.1, -0.2, 0.3), (3.0, 1.5, -3.0)])
def test_roll_pitch_yaw(rpy: tuple[float, float, float]) -> None:
    rotation = rotation_from_rpy(rpy)
    x, y, z = (turn(axis, angle)[:3, :3] for axis, angle in enumerate(rpy))
    np.testing.assert_allclose(rotation, z @ y @ x, atol=1e-15)
    np.testing.assert_allclose(rpy_from_rotation(rotation), rpy, atol=1e-12)
    np.testing.assert_array_equal(truing.frame_from_xyz_rpy([1, 2, 3], rpy)[:3, 3], [1, 2, 3])
