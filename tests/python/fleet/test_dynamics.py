# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What all arms of a type need of torque and what one arm has of its own are told apart; partitions, workers
and faults change nothing.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import truing
from truing.fleet import FleetDynamics
from truing.fleet.workers import workers_of
from truing.testing.fleet import TorqueFleet, save_torque_fleet, simulate_torque_fleet

SEEDS = (8101, 8102)


@pytest.fixture(scope="module")
def fleets() -> dict[int, TorqueFleet]:
    return {seed: simulate_torque_fleet(seed=seed) for seed in SEEDS}


@pytest.fixture(scope="module")
def folders(fleets: dict[int, TorqueFleet], tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    out = {}
    for seed, fleet in fleets.items():
        out[seed] = tmp_path_factory.mktemp(f"fleet{seed}")
        save_torque_fleet(out[seed], fleet)
    return out


@pytest.fixture(scope="module")
def found(fleets: dict[int, TorqueFleet], folders: dict[int, Path]) -> dict[int, FleetDynamics]:
    return {
        seed: truing.fleet.dynamics(fleet.nominal, folders[seed], workers=0) for seed, fleet in fleets.items()
    }


def bits(found: FleetDynamics) -> str:
    """Every number that was found, digit by digit."""
    own = [(arm.parameters, arm.errors, arm.rows) for arm in found.arms.values()]
    return repr((found.parameters, found.covariance.tolist(), own, found.stands_out, found.errors))


# ---- What is found


@pytest.mark.parametrize("seed", SEEDS)
def test_arms_with_a_fault_are_named_and_no_others(
    seed: int, fleets: dict[int, TorqueFleet], found: dict[int, FleetDynamics]
) -> None:
    named = {one.arm: one.parameter for one in found[seed].stands_out}
    assert len(fleets[seed].faults) == 2
    assert named == fleets[seed].faults
    assert found[seed].unexplained == ()
    assert found[seed].converged
    for one in found[seed].stands_out:
        assert abs(one.value - one.others) > 5.0 * np.hypot(one.sigma, one.scatter)
        assert one.arm in found[seed].sentence


@pytest.mark.parametrize("seed", (8103, 8104))
def test_in_a_fleet_without_faults_no_arm_is_named(seed: int, tmp_path: Path) -> None:
    fleet = simulate_torque_fleet(faults=0, seed=seed)
    save_torque_fleet(tmp_path, fleet)
    found = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    assert found.stands_out == () and found.unexplained == ()
    assert found.sentence == "None of 12 arms stands out."


@pytest.mark.parametrize("seed", SEEDS)
def test_own_and_shared_parameters_lie_within_their_errors(
    seed: int, fleets: dict[int, TorqueFleet], found: dict[int, FleetDynamics]
) -> None:
    """Own ones are departures from the type: what is common to all arms is the type's."""
    off: dict[str, list[float]] = {}
    for parameter in next(iter(found[seed].arms.values())).parameters:
        true = np.array([own.get(parameter.name, 0.0) for own in fleets[seed].own.values()])
        mine = [arm.parameter(parameter.name) for arm in found[seed].arms.values()]
        apart = np.array([p.value for p in mine]) - true
        apart -= np.median(apart)
        off.setdefault(parameter.name.partition(".")[0], []).extend(apart / [p.sigma for p in mine])
    for effect in ("coulomb", "viscous", "current_offset"):
        assert 0.7 < np.std(off[effect]) < 1.5, effect
    assert (
        np.std(off["motor_constant"]) < 1.3
    )  # what is left to the scale of all masses is common to the arms
    friction = found[seed].robot.torque_effects
    sizes = {name: value for effect in friction for name, value in effect.parameters.items()}
    for effect in fleets[seed].type_of.torque_effects:
        for name, value in effect.parameters.items():
            assert sizes[name] == pytest.approx(value, rel=0.05), name  # 12 arms that scatter by 3 %


@pytest.mark.parametrize("seed", SEEDS)
def test_each_model_predicts_better_than_the_one_before(seed: int, found: dict[int, FleetDynamics]) -> None:
    for error in found[seed].errors:
        assert error.own < error.shared < 0.3 * error.nominal
        assert 1.0 < error.own < 3.0  # the noise is 2 %


def test_robots_of_arms_predict_motion_that_was_not_fitted(tmp_path: Path) -> None:
    fleet = simulate_torque_fleet(arms=6, held_out=True, seed=8105)
    save_torque_fleet(tmp_path, fleet)
    found = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    assert found.held_out == "recordings marked as test"
    assert sum(arm.recordings for arm in found.arms.values()) == 12
    for name, recordings in fleet.recordings.items():
        measured = np.asarray(recordings[1].torque)
        error = {
            who: np.sqrt(
                np.mean((np.asarray(truing.dynamics.predict(robot, recordings[1]).torque) - measured) ** 2, 0)
            )
            for who, robot in (("type", found.robot), ("arm", found.arms[name].robot))
        }
        assert (error["arm"] < error["type"]).mean() > 0.8, name
        assert (error["arm"] / measured.std(axis=0) < 0.05).all(), name


def test_a_joint_that_rests_keeps_the_types_values(tmp_path: Path) -> None:
    fleet = simulate_torque_fleet(arms=5, faults=0, seed=8106)
    save_torque_fleet(tmp_path, fleet)
    path = tmp_path / "arm=a002" / "run1.parquet"
    table = pq.read_table(path)
    place = table.column_names.index("q6_rad")
    pq.write_table(table.set_column(place, "q6_rad", pa.array(np.zeros(table.num_rows))), path)
    found = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    held = {p.name for p in found.arms["a002"].parameters if p.frozen}
    assert held == {"motor_constant.J6", "coulomb.J6", "viscous.J6", "current_offset.J6"}
    assert found.arms["a002"].parameter("coulomb.J5").sigma > 0.0


def test_an_arm_that_leads_all_masses_away_is_said(tmp_path: Path) -> None:
    """Torques of one arm in another unit: no motor has such a gain."""
    fleet = simulate_torque_fleet(arms=6, faults=0, seed=8108)
    save_torque_fleet(tmp_path, fleet)
    path = tmp_path / "arm=a004" / "run1.parquet"
    table = pq.read_table(path)
    for k, name in enumerate(table.column_names):
        if name.startswith("tau"):
            table = table.set_column(k, name, pa.array(8.0 * table[name].to_numpy()))
    pq.write_table(table, path)
    found = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    assert [w for w in found.warnings if w.startswith("motor gains from") and "look at a004" in w]


# ---- Partitions


def test_what_reading_warns_of_reaches_the_result(tmp_path: Path) -> None:
    fleet = simulate_torque_fleet(faults=0, seed=8107)
    save_torque_fleet(tmp_path, fleet)
    file = sorted(tmp_path.rglob("*.parquet"))[0]
    table = pq.read_table(file)
    gaps = pa.array([1.0] + [float("nan")] * (table.num_rows - 1))
    pq.write_table(table.append_column("gaps", gaps), file)
    found = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    assert [note for note in found.warnings if str(file) in note and "'gaps'" in note]


def test_row_groups_are_partitions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not the same numbers: at the ends of a partition the filter leaves rows out."""
    fleet = simulate_torque_fleet(arms=5, faults=0, seconds=40.0, seed=8107)
    save_torque_fleet(tmp_path, fleet)
    whole = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    for path in tmp_path.rglob("*.parquet"):
        pq.write_table(pq.read_table(path), path, row_group_size=1000)
    monkeypatch.setattr("truing.fleet.source.PIECE_ROWS", 2000)
    parts = truing.fleet.dynamics(fleet.nominal, tmp_path, workers=0)
    assert (whole.partitions, parts.partitions) == (5, 10)
    for one, other in zip(whole.parameters, parts.parameters, strict=True):
        if not one.name.startswith("link_inertia."):
            assert one.value == pytest.approx(other.value, abs=4.0 * one.sigma), one.name


def test_a_corrupt_file_is_named_and_passed_over_if_asked(
    fleets: dict[int, TorqueFleet], folders: dict[int, Path], tmp_path: Path
) -> None:
    for path in sorted(folders[SEEDS[0]].rglob("*.parquet"))[:6]:
        (tmp_path / path.parent.name).mkdir()
        (tmp_path / path.parent.name / path.name).write_bytes(path.read_bytes())
    bad = tmp_path / "arm=a003" / "run1.parquet"
    bad.write_bytes(bad.read_bytes()[:5000])
    nominal = fleets[SEEDS[0]].nominal
    with pytest.raises(truing.InputError, match=r"arm=a003.run1\.parquet.*skip_corrupt"):
        truing.fleet.dynamics(nominal, tmp_path, workers=0)
    found = truing.fleet.dynamics(nominal, tmp_path, workers=0, skip_corrupt=True)
    assert list(found.arms) == ["a001", "a002", "a004", "a005", "a006"]
    assert len(found.skipped) == 1 and str(bad) in found.skipped[0]


# ---- Workers


@pytest.mark.parametrize("count", (1, 2))
def test_workers_find_the_same_bits_as_this_process(
    count: int, fleets: dict[int, TorqueFleet], folders: dict[int, Path], found: dict[int, FleetDynamics]
) -> None:
    pytest.importorskip("distributed")
    seed = SEEDS[0]
    assert bits(truing.fleet.dynamics(fleets[seed].nominal, folders[seed], workers=count)) == bits(
        found[seed]
    )


@pytest.mark.slow
def test_a_worker_killed_at_work_changes_no_bit(
    fleets: dict[int, TorqueFleet], folders: dict[int, Path], found: dict[int, FleetDynamics]
) -> None:
    pytest.importorskip("distributed")
    seed = SEEDS[0]
    with workers_of(workers=2) as workers:
        pids = list(workers.client.run(os.getpid).values())
        killer = threading.Thread(target=_kill_at_work, args=(workers.client, pids[0]), daemon=True)
        killer.start()
        again = truing.fleet.dynamics(fleets[seed].nominal, folders[seed], workers.client)
        killer.join(1.0)
        assert not killer.is_alive()
        assert pids[0] not in workers.client.run(os.getpid).values()  # it was replaced
    assert bits(again) == bits(found[seed])


def _kill_at_work(client: Any, pid: int) -> None:
    while not any(client.processing().values()):
        time.sleep(0.002)
    os.kill(pid, signal.SIGKILL)
