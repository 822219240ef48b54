# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A simulator's model is the best that its format can hold: the rest is fitted without what it lacks."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import yaml

from truing.dynamics import Recording, identify
from truing.dynamics.export import Exported, export, refit
from truing.dynamics.export.refit import lacking, training
from truing.dynamics.runner import runnable
from truing.dynamics.simulate import judge
from truing.errors import InputError
from truing.model import AppliedEffect, Robot
from truing.testing.dynamics import SimulatedMotion, simulate_motion

HIDDEN = {
    "load_friction": (["J2", "J3"], {"load_friction.J2": 0.15, "load_friction.J3": 0.15}),
    "presliding": (["J4"], {"presliding.J4": 0.8, "presliding.J4.x0": 0.02}),
    "armature": (["J3"], {"armature.J3": 1.6}),
}


def load(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location("callbacks_of_a_refit", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seconds=14.0, recordings=8, held_out=3, hidden=HIDDEN)


@pytest.fixture(scope="module")
def trained(simulated: SimulatedMotion) -> list[Recording]:
    return [recording for recording in simulated.recordings if not recording.test]


@pytest.fixture(scope="module")
def written(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path_factory: pytest.TempPathFactory
) -> Exported:
    return export(simulated.truth, "mjcf", tmp_path_factory.mktemp("model"), recordings=trained)


def test_what_the_format_lacks_is_left_out_and_said(written: Exported) -> None:
    assert written.refitted == ("load_friction.J2", "load_friction.J3")
    assert written.not_refitted == ""
    said = yaml.safe_load((written.folder / "not_written.yaml").read_text(encoding="utf-8"))
    assert said["refitted"] == ["load_friction.J2", "load_friction.J3"]
    assert {item["name"] for item in said["not_written"]} == {"load_friction.J2", "load_friction.J3"}
    assert all("fitted anew without it" in item["reason"] for item in said["not_written"])
    assert "fitted anew without load_friction.J2" in written.summary()


def test_the_model_alone_moves_better_than_with_friction_that_stands_in(
    simulated: SimulatedMotion, written: Exported
) -> None:
    held = [recording for recording in simulated.recordings if recording.test]
    assert written.callbacks_model is not None
    stands_in = replace(written, model=written.callbacks_model, callbacks=None, callbacks_model=None)
    models = {
        "whole": runnable(written),
        "alone": runnable(written, callbacks=False),
        "stands in": runnable(stands_in),
    }
    judged = judge(models, held, horizons=(0.5, 2.0), most=40)
    for horizon in judged.windows.horizons:
        whole, alone, instead = (judged.worst_joint(name, horizon) for name in models)
        assert whole < alone < 1.03 * instead
    assert alone < 0.9 * instead  # 2 s ahead


def test_callbacks_belong_to_the_model_with_all_laws(
    simulated: SimulatedMotion, written: Exported, tmp_path: Path
) -> None:
    assert written.callbacks is not None and written.callbacks_model is not None
    beside = load(written.callbacks)
    alone = mujoco.MjModel.from_xml_path(str(written.model))
    with pytest.raises(ValueError, match=r"belong to callbacks\.xml"):
        beside.prepare(alone)
    whole = mujoco.MjModel.from_xml_path(str(written.callbacks_model))
    beside.prepare(whole)
    as_it_is = mujoco.MjModel.from_xml_path(str(export(simulated.truth, "mjcf", tmp_path).model))
    assert np.array_equal(whole.body_mass, as_it_is.body_mass)
    assert not np.allclose(whole.body_mass, alone.body_mass, rtol=1e-6)
    assert whole.joint("J2").frictionloss[0] == pytest.approx(7.0)  # coulomb.J2, which load friction adds to


def test_without_recordings_it_is_said_that_nothing_was_fitted(
    simulated: SimulatedMotion, tmp_path: Path
) -> None:
    exported = export(simulated.truth, "mjcf", tmp_path)
    assert exported.refitted == () and exported.callbacks_model is None
    assert "needs the recordings" in exported.not_refitted
    said = yaml.safe_load((tmp_path / "not_written.yaml").read_text(encoding="utf-8"))
    assert said["refitted"] == [] and said["not_refitted"] == exported.not_refitted


def test_a_urdf_gets_friction_for_presliding_and_inertia_for_rotors(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path: Path
) -> None:
    exported = export(simulated.truth, "urdf", tmp_path, recordings=trained)
    assert set(exported.refitted) == {
        "load_friction.J2",
        "load_friction.J3",
        "presliding.J4",
        "presliding.J4.x0",
        "armature.J3",
    }
    assert lacking(simulated.truth, exported.not_written) == list(exported.refitted)
    assert exported.callbacks is None and exported.callbacks_model is None


def test_no_law_of_the_speed_stands_for_friction_that_goes_with_time(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path: Path
) -> None:
    warm = AppliedEffect("warmup", ["J1"], {"warmup.J1.coulomb": -0.01})
    robot = simulated.truth.replace(torque_effects=[*simulated.truth.torque_effects, warm])
    exported = export(robot, "mjcf", tmp_path, recordings=trained)
    assert "warmup.J1.coulomb" in exported.refitted
    joints = ElementTree.parse(exported.model).iter("joint")
    damping = {joint.get("name"): np.array(joint.get("damping", "").split(), float) for joint in joints}
    assert np.all(damping["J1"][1:] == 0.0)


def test_no_written_friction_pushes_at_speeds_that_nobody_recorded(tmp_path: Path) -> None:
    """A polynomial follows friction that saturates by a negative power of the speed, without end."""
    bends = {"viscous_law": (["J2"], {"viscous_law.J2.saturating": 40.0, "viscous_law.J2.v0": 0.5})}
    simulated = simulate_motion(seconds=8.0, recordings=4, held_out=1, hidden=bends)
    trained = [recording for recording in simulated.recordings if not recording.test]
    free = identify(
        simulated.nominal,
        trained,
        effects="coulomb,viscous,viscous_law",
        leave_out_forms=("viscous_law.root", "viscous_law.saturating"),
    )
    (law,) = [e for e in free.robot.torque_effects if e.effect == "viscous_law" and "J2" in e.joints]
    assert min(law.parameters.values()) < 0.0  # what the best fit has
    exported = export(simulated.truth, "mjcf", tmp_path, recordings=trained)
    assert "viscous_law.J2.saturating" in exported.refitted
    for joint in ElementTree.parse(exported.model).iter("joint"):
        powers = np.trim_zeros(np.array(joint.get("damping", "").split(), float), "b")
        assert powers.size == 0 or powers[-1] > 0.0


def test_the_constant_of_a_single_drive_is_fitted_anew(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path: Path
) -> None:
    """What it is taken for depends on friction that grows with the load."""
    exported = export(with_constants(simulated.truth, J3=0.2), "mjcf", tmp_path, recordings=trained)
    again = refit.fit_without(
        with_constants(simulated.truth, J3=-0.2), exported.refitted, "mjcf", trained, None, ("J2", "J3")
    )
    found = constants(exported.alone)["motor_constant.J3"]
    assert abs(found) < 0.1
    assert constants(again)["motor_constant.J3"] == pytest.approx(found, abs=0.02)
    assert (
        runnable(exported, callbacks=False).robot is exported.alone
    )  # measured torques are those of its drive
    assert runnable(exported).robot is exported.robot


def test_friction_that_fades_at_rest_is_fitted_anew_as_one_that_holds(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path: Path
) -> None:
    """At its joint alone: 7 Nm, which a fit that lets it fade would have put elsewhere."""
    fades = {"coulomb.J2": 3.0, "coulomb.J2.turn_travel": 1e-4, "coulomb.J2.turn_fade": 1.0}
    dry = [effect for effect in simulated.truth.torque_effects if effect.effect == "coulomb"]
    whole = {key: value for effect in dry for key, value in effect.parameters.items()}
    one = AppliedEffect("coulomb", [joint for effect in dry for joint in effect.joints], {**whole, **fades})
    effects = [one, *(effect for effect in simulated.truth.torque_effects if effect not in dry)]
    robot = simulated.truth.replace(torque_effects=effects)
    late = AppliedEffect("time_offset", [], {"time_offset": 0.0})  # of no joint
    kept = refit.with_friction_that_holds(robot.replace(torque_effects=[*effects, late]), trained, None)
    assert "time_offset" in [effect.effect for effect in kept.torque_effects]
    exported = export(robot, "mjcf", tmp_path, recordings=trained)
    assert exported.refitted == ("coulomb.J2.turn_fade", "load_friction.J2", "load_friction.J3")
    (said,) = [item for item in exported.not_written if item.name == "coulomb.J2.turn_fade"]
    assert "fitted anew without it" in said.reason
    assert exported.callbacks is not None and exported.callbacks_model is not None
    holds = mujoco.MjModel.from_xml_path(str(exported.callbacks_model))
    load(exported.callbacks).prepare(holds)
    assert holds.joint("J2").frictionloss[0] == pytest.approx(7.0, rel=0.05)
    as_it_is = mujoco.MjModel.from_xml_path(str(export(robot, "mjcf", tmp_path / "as it is").model))
    for joint in ("J1", "J4"):
        assert holds.joint(joint).frictionloss[0] == as_it_is.joint(joint).frictionloss[0]
    assert "needs the recordings" in export(robot, "urdf", tmp_path / "urdf").not_refitted


def test_constants_of_several_drives_stay(simulated: SimulatedMotion, trained: list[Recording]) -> None:
    """They share a scale with all masses."""
    robot = with_constants(simulated.truth, J2=0.01, J3=0.02)
    kept = refit.fit_without(robot, ["load_friction.J2"], "mjcf", trained, None)
    assert constants(kept) == {"motor_constant.J2": 0.01, "motor_constant.J3": 0.02}


def with_constants(robot: Robot, **sizes: float) -> Robot:
    told = {f"motor_constant.{joint}": size for joint, size in sizes.items()}
    constant = AppliedEffect("motor_constant", list(sizes), told)
    return robot.replace(torque_effects=[*robot.torque_effects, constant])


def constants(robot: Robot) -> dict[str, float]:
    (found,) = [dict(e.parameters) for e in robot.torque_effects if e.effect == "motor_constant"]
    return found


def test_what_was_held_out_is_not_fitted_to(simulated: SimulatedMotion) -> None:
    one, other, test = simulated.recordings[0], simulated.recordings[1], simulated.recordings[-1]
    rows = np.zeros(len(one), dtype=bool)
    rows[400:700] = True
    rows[-50:] = True
    parts = training(
        [(one, rows), (other, np.zeros(len(other), dtype=bool)), (test, np.ones(len(test), dtype=bool))]
    )
    assert [len(part) for part in parts] == [400, len(one) - 750, len(other)]
    assert np.array_equal(parts[1].torque, one.torque[700:-50]) and not any(part.test for part in parts)
    with pytest.raises(InputError, match="longer than memory"):
        training([(one.replace(pieces=lambda: iter([one]), end=float(one.time[-1])), rows)])


def test_forms_of_laws_can_be_left_out(simulated: SimulatedMotion, trained: list[Recording]) -> None:
    forms = ("viscous_law.root", "viscous_law.saturating", "viscous_law.cubic")
    fit = identify(simulated.nominal, trained, effects="coulomb,viscous_law", leave_out_forms=forms)
    (laws,) = [e for e in fit.robot.torque_effects if e.effect == "viscous_law" and "J2" in e.joints]
    assert list(laws.parameters) == ["viscous_law.J2.quadratic"]


def test_only_the_joint_whose_law_cannot_be_written_goes_without_one(
    simulated: SimulatedMotion, trained: list[Recording], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit, bare = refit.fit_without, []

    def with_a_curve_that_rises(*given: Any) -> Any:
        bare.append(set(given[-1]))
        robot = fit(*given)
        if "J4" in bare[-1]:
            return robot
        curve = AppliedEffect("stribeck", ["J4"], {"stribeck.J4": -1.0, "stribeck.J4.vs": 0.02})
        return robot.replace(torque_effects=[*robot.torque_effects, curve])

    monkeypatch.setattr(refit, "fit_without", with_a_curve_that_rises)
    export(simulated.truth, "mjcf", tmp_path, recordings=trained)
    assert bare == [set(), {"J4"}]
