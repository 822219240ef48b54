# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Domain randomisation: what the data settled is not drawn, what it left open is, with its correlations."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

import truing
from pages import visible
from truing.cli import main
from truing.dynamics.uncertainty import MASSES, Known, Randomisation, Uncertain, randomisation
from truing.dynamics.uncertainty.written import isaaclab_text, yaml_text
from truing.errors import InputError

Floats = NDArray[np.float64]


def servo_result(matrix: Floats, names: list[str], scales: list[str], values: list[float]) -> dict[str, Any]:
    return {
        "format": "truing-dynamics/1",
        "command": "diagnose",
        "from": "commands",
        "robot": "two servos",
        "classes": [{"effects": [], "sentence": "delay and damping are alike at low frequency"}],
        "covariance": {
            "names": names,
            "units": ["Nm/rad", "Nm", "s", "Nm s/rad"][: len(names)],
            "scales": scales,
            "values": values,
            "matrix": matrix.tolist(),
            "prior": [1.5, 2.0, 0.02, 1.0][: len(names)],
        },
    }


def four(sigma: tuple[float, ...] = (0.2, 0.3, 0.004, 0.2), between: float = 0.8) -> dict[str, Any]:
    """Gain and friction correlated, a delay and a damping against each other."""
    correlation = np.eye(4)
    correlation[0, 1] = correlation[1, 0] = between
    correlation[2, 3] = correlation[3, 2] = -0.6
    matrix = correlation * np.outer(sigma, sigma)
    names = ["command_gain.J1", "coulomb.J1", "delay.J1", "damping_gain.J1"]
    return servo_result(matrix, names, ["log", "log", "linear", "linear"], [20.0, 0.05, 0.03, 1.0])


def in_scales(left: Randomisation, samples: dict[str, Floats]) -> Floats:
    """Samples as the parameters' scales have them. shape=(n, parameters)"""
    table = np.column_stack([samples[one.name] for one in left.uncertain])
    logs = np.array([one.scale == "log" for one in left.uncertain])
    table[:, logs] = np.log(table[:, logs])
    return table


def test_samples_have_the_spread_and_the_correlations_that_were_left() -> None:
    left = randomisation(four(), mass_uncertainty=0.0)
    assert left.names == ["command_gain.J1", "coulomb.J1", "delay.J1", "damping_gain.J1"]
    table = in_scales(left, left.sample(20_000, seed=3))
    np.testing.assert_allclose(table.std(axis=0), [0.2, 0.3, 0.004, 0.2], rtol=0.03)
    np.testing.assert_allclose(np.corrcoef(table.T), left.correlation, atol=0.03)
    assert left.correlation[0, 1] == pytest.approx(0.8) and left.correlation[2, 3] == pytest.approx(-0.6)
    again = left.sample(50, seed=3)
    assert all(np.array_equal(again[name], left.sample(50, seed=3)[name]) for name in again)
    assert not np.array_equal(again["delay.J1"], left.sample(50, seed=4)["delay.J1"])


def test_what_is_known_is_not_drawn_and_says_how_well() -> None:
    left = randomisation(four(sigma=(0.01, 0.3, 0.0005, 0.2)), mass_uncertainty=0.0)
    assert left.names == ["coulomb.J1", "damping_gain.J1"]
    assert [one.name for one in left.known] == ["command_gain.J1", "delay.J1"]
    assert left.known[0].sigma == pytest.approx(0.2)  # 1 % of 20 Nm/rad
    assert "1 % of itself" in left.known[0].why and "2.5 % of its usual size" in left.known[1].why
    everything = randomisation(four(sigma=(0.01, 0.3, 0.0005, 0.2)), known=0.0, mass_uncertainty=0.0)
    assert len(everything.uncertain) == 4 and not everything.known


def test_torques_and_masses_share_a_factor_that_motion_does_not_show() -> None:
    left = randomisation(four(sigma=(0.001, 0.001, 0.0005, 0.001)), mass_uncertainty=0.2)
    assert left.names == ["command_gain.J1", "coulomb.J1", "damping_gain.J1", MASSES]
    np.testing.assert_allclose(left.correlation, np.ones((4, 4)), atol=1e-9)
    samples = left.sample(2000, seed=1)
    assert np.log(samples[MASSES]).std() == pytest.approx(0.2, rel=0.05)
    # Gain over masses, which is what motion shows, is as it was found.
    np.testing.assert_allclose(samples["command_gain.J1"] / samples[MASSES], 20.0, rtol=1e-6)
    np.testing.assert_allclose(samples["coulomb.J1"] / samples[MASSES], 0.05, rtol=1e-6)
    assert [one.name for one in left.known] == ["delay.J1"]
    assert any("20 %" in note for note in left.notes)
    assert left.classes == ("delay and damping are alike at low frequency",)


def test_draws_keep_the_bounds_of_the_parameters() -> None:
    result = four(sigma=(0.2, 0.3, 0.03, 0.2))  # a delay of 30 +- 30 ms
    left = randomisation(result, mass_uncertainty=0.0)
    samples = left.sample(3000, seed=2)
    assert samples["delay.J1"].min() >= 0.0 and samples["delay.J1"].size == 3000
    low, high = next(one.range for one in left.uncertain if one.name == "delay.J1")
    assert low == 0.0 and high == pytest.approx(0.03 + 1.645 * 0.03, rel=1e-3)
    with pytest.raises(InputError, match="expected one or more"):
        left.sample(0)


def test_a_fit_of_torques_gives_its_standard_errors_and_correlations() -> None:
    result = {
        "robot": "arm",
        "command": "identify",
        "parameters": [
            {"name": "viscous.J1", "value": 2.0, "sigma": 0.5, "unit": "Nm s/rad"},
            {"name": "coulomb.J1", "value": 1.0, "sigma": 0.01, "unit": "Nm"},
            {"name": "motor_constant.J1", "value": 0.1, "sigma": 0.05, "unit": "1"},
            {"name": "link_inertia.J2.mx", "value": 0.1, "sigma": 0.05, "unit": "kg m"},
            {"name": "viscous.J2", "value": 3.0, "sigma": 0.5, "unit": "Nm s/rad"},
        ],
        "covariance": {
            "names": ["viscous.J1", "coulomb.J1", "motor_constant.J1", "link_inertia.J2.mx", "viscous.J2"],
            "matrix": [
                [0.25, 0.0, 0.0, 0.0, -0.15],
                [0.0, 1e-4, 0.0, 0.0, 0.0],
                [0.0, 0.0, 2.5e-3, 0.0, 0.0],
                [0.0, 0.0, 0.0, 2.5e-3, 0.0],
                [-0.15, 0.0, 0.0, 0.0, 0.25],
            ],
        },
    }
    left = randomisation(result)
    assert left.names == ["viscous.J1", "viscous.J2"]
    assert [one.name for one in left.known] == ["coulomb.J1", "motor_constant.J1"]
    assert any("link_inertia.J2.mx" in note for note in left.notes)
    samples = left.sample(4000, seed=0)
    first, second = samples["viscous.J1"], samples["viscous.J2"]
    assert first.min() >= 0.0 and first.std() == pytest.approx(0.5, rel=0.06)
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(-0.6, abs=0.05)


def test_results_in_memory_and_in_a_folder_give_the_same(tmp_path: Path) -> None:
    from truing.testing.dynamics import simulate_motion

    simulated = simulate_motion(seconds=6.0, recordings=2, held_out=1)
    fit = truing.dynamics.identify(simulated.nominal, simulated.recordings, effects="coulomb,viscous")
    left = randomisation(fit, known=0.0)
    assert {name.partition(".")[0] for name in left.names} == {"coulomb", "viscous"}
    from truing.dynamics.result import fit_dict
    from truing.report.json_text import to_json

    (tmp_path / "result.json").write_text(to_json(fit_dict(fit)))
    assert randomisation(tmp_path, known=0.0).names == left.names


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        randomisation(tmp_path)
    (tmp_path / "result.json").write_text("{")
    with pytest.raises(InputError, match="is not JSON"):
        randomisation(tmp_path)
    (tmp_path / "result.json").write_text(json.dumps({"command": "export"}))
    with pytest.raises(InputError, match="is not a result of"):
        randomisation(tmp_path)
    with pytest.raises(InputError, match="expected zero or more"):
        randomisation(four(), known=-1.0)
    bad = four(sigma=(0.2, 0.3, 0.03, 0.2))
    bad["covariance"]["values"][2] = -1.0  # beyond its bounds by thirty standard deviations
    with pytest.raises(InputError, match="keep the bounds"):
        randomisation(bad).sample(10)
    assert math.isinf(randomisation(four()).uncertain[-1].bounds[1])


# ---- Files -------------------------------------------------------------------------------------------
def test_yaml_says_ranges_correlations_and_what_is_known() -> None:
    left = randomisation(four(sigma=(0.01, 0.3, 0.004, 0.2)), mass_uncertainty=0.1)
    read = yaml.safe_load(yaml_text(left))
    assert read["format"] == "truing-randomisation/1" and read["robot"] == "two servos"
    names = [one["name"] for one in read["randomised"]]
    assert names == left.names and MASSES in names
    np.testing.assert_allclose(read["correlation"], left.correlation, atol=1e-5)
    friction = next(one for one in read["randomised"] if one["name"] == "coulomb.J1")
    assert friction["low"] < 0.05 < friction["high"] and friction["scale"] == "log"
    assert friction["sigma"] == pytest.approx(math.hypot(0.3, 0.1), rel=1e-4)
    assert friction["own_sigma"] == pytest.approx(0.3, rel=1e-4)
    gain = next(one for one in read["randomised"] if one["name"] == "command_gain.J1")
    assert gain["own_sigma"] == 0.0 and gain["sigma"] == pytest.approx(0.1, rel=1e-4)
    nothing = randomisation(four(sigma=(1e-3, 1e-3, 1e-5, 1e-3)), mass_uncertainty=0.0)
    read = yaml.safe_load(yaml_text(nothing))
    assert read["randomised"] == [] and len(read["known"]) == 4 and nothing.sample(3) == {}


class Tensor(np.ndarray[Any, Any]):
    """So much of torch's as the events use."""

    def unsqueeze(self, axis: int) -> Any:
        return np.expand_dims(self, axis)

    def to(self, kind: Any) -> Any:
        return self.astype(kind)

    def clamp(self, low: float, high: float) -> Any:
        return np.clip(self, low, high)


def fake_torch() -> Any:
    def tensor(table: Any, **_: Any) -> Any:
        return np.asarray(table, dtype=float).view(Tensor)

    def mean_of(tables: list[Any]) -> Any:
        stacked = np.array(tables).view(Tensor)
        return SimpleNamespace(mean=lambda dim: stacked.mean(axis=dim))

    return SimpleNamespace(
        arange=lambda n, device: np.arange(n),
        as_tensor=tensor,
        stack=mean_of,
        full=lambda shape, value: np.full(shape, value),
        round=lambda t: np.round(t).view(Tensor),
        int=int,
        float32=float,
    )


class FakeArm:
    """Records what an event writes."""

    device = "cpu"

    def __init__(self, joints: list[str], envs: int) -> None:
        self.joints = joints
        self.written: dict[tuple[str, int], Floats] = {}
        self.lag: Floats = np.zeros(0)
        buffer = SimpleNamespace(set_time_lag=lambda steps, ids: setattr(self, "lag", steps))
        actuator = SimpleNamespace(
            joint_names=joints,
            stiffness=np.zeros((envs, len(joints))),
            damping=np.zeros((envs, len(joints))),
            positions_delay_buffer=buffer,
            cfg=SimpleNamespace(max_delay=12),
        )
        self.actuators = {"arm": actuator}

    def find_joints(self, name: str) -> tuple[list[int], list[str]]:
        return [self.joints.index(name)], [name]

    def write_joint_friction_coefficient_to_sim(self, *, joint_ids: Any, env_ids: Any, **values: Any) -> None:
        self.written.update({(name, joint_ids[0]): table for name, table in values.items()})

    write_joint_armature_to_sim = write_joint_friction_coefficient_to_sim


def test_isaac_lab_events_draw_together_and_write_what_an_actuator_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = randomisation(four(), mass_uncertainty=0.1)
    file = tmp_path / "events.py"
    file.write_text(isaaclab_text(left), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("events", file)
    assert spec is not None and spec.loader is not None
    events = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(events)
    drawn = events.draw(20_000, np.random.default_rng(1))
    logs = np.array(events.LOG)
    table = np.where(logs, np.log(np.where(logs, drawn, 1.0)), drawn)
    np.testing.assert_allclose(np.corrcoef(table.T), left.correlation, atol=0.03)

    monkeypatch.setitem(sys.modules, "torch", fake_torch())
    arm = FakeArm(["J0", "J1"], 500)
    env = SimpleNamespace(scene=Scene(arm, 500), physics_dt=0.005)
    events.randomise_servos(env, None, seed=4)
    gain = arm.actuators["arm"].stiffness[:, 1]
    friction = arm.written["joint_friction_coeff", 1][:, 0]
    assert np.corrcoef(np.log(gain), np.log(friction))[0, 1] > 0.7  # 0.8, and a factor of both
    assert not arm.actuators["arm"].stiffness[:, 0].any()
    assert set(np.unique(arm.lag)) <= set(range(13)) and 4 <= np.median(arm.lag) <= 8  # 30 ms of 5 ms
    assert "masses" in file.read_text()


def test_what_of_damping_is_the_controllers_goes_to_the_actuator() -> None:
    some = (
        Uncertain("viscous.J1", "Nm s/rad", "log", 2.0, 0.1, 0.1),
        Uncertain("viscous.J2", "Nm s/rad", "log", 3.0, 0.1, 0.1),
    )
    settled = (Known("damping_gain.J1", "Nm s/rad", 0.5, 0.0, "found well"),)
    left = Randomisation("arm", some, np.eye(2), settled, (), by_controller={"J1": 0.8})
    read: dict[str, Any] = {"__name__": "events"}
    exec(isaaclab_text(left), read)
    parts = [(field, joint, pytest.approx(part)) for _, field, joint, part in read["FIELDS"]]
    assert parts == [("viscous", "J1", 0.2), ("damping", "J1", 0.8), ("viscous", "J2", 1.0)]
    assert read["BESIDE"] == {("damping", "J1"): 0.5}
    assert read["FOUND"]["J1"] == {"viscous": pytest.approx(0.4), "damping": pytest.approx(2.1)}


class Scene(dict[str, Any]):
    def __init__(self, arm: FakeArm, envs: int) -> None:
        super().__init__(robot=arm)
        self.num_envs = envs


def test_the_command_writes_what_is_drawn_and_says_what_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = four(sigma=(0.01, 0.3, 0.0004, 0.2))
    (tmp_path / "result.json").write_text(json.dumps(result))
    out = tmp_path / "drawn"
    arguments = ["dynamics", "randomise", str(tmp_path), "--samples", "40", "--mass-uncertainty", "0%"]
    assert main([*arguments, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "2 parameters left uncertain by the data are drawn; 2 stay as they were found" in said
    names = {path.name for path in out.iterdir()}
    assert names == {"randomisation.yaml", "events.py", "samples.csv", "result.json", "report.html"}
    head, *rows = (out / "samples.csv").read_text().splitlines()
    assert head == "coulomb.J1 [Nm],damping_gain.J1 [Nm s/rad]" and len(rows) == 40
    page = visible((out / "report.html").read_text(encoding="utf-8"))
    assert "coulomb.J1" in page and "delay and damping are alike" in page and "2 % of its usual size" in page
    (tmp_path / "empty").mkdir()
    assert main(["dynamics", "randomise", str(tmp_path / "empty"), "--out", str(tmp_path / "no")]) == 2
    assert not (tmp_path / "no").exists()
