# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What all arms share and what each has of its own are told apart; partitions, workers and faults change
nothing.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import truing
from truing.cli import main
from truing.examples import example
from truing.fleet import FleetIdentification
from truing.fleet.result import write_fleet
from truing.fleet.source import first_notes
from truing.testing.fleet import FleetSimulation, save_fleet, simulate_fleet

ARMS, POSES = 8, 80


@pytest.fixture(scope="module")
def robot() -> truing.Robot:
    return truing.load_robot(example("ur10"))


@pytest.fixture(scope="module")
def fleet(robot: truing.Robot) -> FleetSimulation:
    return simulate_fleet(robot, arms=ARMS, poses=POSES, faults=0, columns=(), seed=21)


@pytest.fixture(scope="module")
def folder(robot: truing.Robot, fleet: FleetSimulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("fleet")
    save_fleet(place, fleet, robot)
    return place


@pytest.fixture(scope="module")
def found(robot: truing.Robot, folder: Path) -> FleetIdentification:
    return truing.fleet.identify(robot, folder, workers=0)


def bits(found: FleetIdentification) -> str:
    """Every number that was found, digit by digit."""
    return repr(
        (
            found.parameters,
            found.covariance.tolist(),
            found.after,
            [a.parameters for a in found.arms.values()],
        )
    )


# ---- What is found


def test_every_arms_robot_predicts_the_true_one(fleet: FleetSimulation, found: FleetIdentification) -> None:
    assert found.converged
    assert list(found.arms) == list(fleet.arms)
    for name, simulation in fleet.arms.items():
        truth = truing.predict(simulation.truth.robot, simulation.data).position
        error = np.linalg.norm(
            truing.predict(found.arms[name].robot, simulation.data).position - truth, axis=1
        )
        assert error.mean() < 4e-5, name  # noise of a coordinate is 5e-5


def test_shared_and_own_parameters_lie_within_their_intervals(
    fleet: FleetSimulation, found: FleetIdentification
) -> None:
    true = {name: value for name, (_, value, _) in fleet.type_of.parameters.items()}
    away = [(p.value - true[p.name]) / p.sigma for p in found.parameters if not p.frozen and p.name in true]
    # What is frozen moves others with it; a twist and a length of the elbow are seen by themselves.
    for name in ("shoulder_lift.a", "elbow.a", "shoulder_lift.beta", "elbow.alpha"):
        p = found.parameter(name)
        assert abs(p.value - true[name]) < 4.0 * p.sigma, name
    assert len(away) >= 10
    for name, simulation in fleet.arms.items():
        zero = found.arms[name].parameter("elbow.offset")
        assert abs(zero.value - simulation.truth.parameters["elbow.offset"][1]) < 4.0 * zero.sigma


def test_sharing_the_geometry_makes_it_surer(
    robot: truing.Robot, fleet: FleetSimulation, found: FleetIdentification
) -> None:
    alone = truing.identify(robot, fleet.arms["a001"].data, free="*.a,*.alpha,*.beta,*.d,*.offset,tool.*")
    assert found.parameter("elbow.a").sigma < 0.6 * alone.parameter("elbow.a").sigma


def test_one_arm_is_what_identify_finds(robot: truing.Robot, tmp_path: Path) -> None:
    data = truing.simulate(robot, poses=300, seed=2).data
    truing.save_measurements(tmp_path / "a.parquet", data, robot)
    ours = truing.fleet.identify(robot, tmp_path, own="", test_share=0.0, workers=0)
    theirs = truing.identify(robot, data, test_share=0.0)
    for p in ours.parameters:
        if not p.frozen:
            assert p.value == pytest.approx(theirs.parameter(p.name).value, abs=0.02 * p.sigma), p.name
            assert p.sigma == pytest.approx(theirs.parameter(p.name).sigma, rel=0.2), p.name
    assert ours.after.fitted.rms == pytest.approx(theirs.train.after.rms, rel=1e-5)


def test_what_reading_warns_of_reaches_the_result(
    robot: truing.Robot, folder: Path, found: FleetIdentification, tmp_path: Path
) -> None:
    tight = robot.copy()  # its elbow may hardly turn: every file has rows beyond
    tight.joints[2].lower, tight.joints[2].upper = -0.5, 0.5
    assert not found.warnings
    warned = truing.fleet.identify(tight, folder, workers=0)
    names = [file.name for file in sorted(folder.rglob("*.parquet"))]
    assert names and len(warned.warnings) == len(names)
    for name, note in zip(names, warned.warnings, strict=True):
        assert name in note and "beyond its limits" in note
    write_fleet(tmp_path, warned, nominal_file=example("ur10"))
    assert json.loads((tmp_path / "result.json").read_text())["warnings"][0] == warned.warnings[0]


def test_of_many_warnings_the_first_are_told_and_the_others_counted() -> None:
    notes = [f"note {k}" for k in range(23)]
    assert first_notes(notes, "rows") == (*notes[:20], "and 3 more warnings of rows")
    assert first_notes(notes[:20], "rows") == tuple(notes[:20])


def test_gross_outliers_are_left_out_arm_by_arm(robot: truing.Robot, tmp_path: Path) -> None:
    fleet = simulate_fleet(robot, arms=3, poses=100, faults=0, columns=(), seed=5)
    save_fleet(tmp_path, fleet, robot)
    data = fleet.arms["a002"].data
    positions = np.array(data.positions)
    positions[::25] += 0.3  # metres
    truing.save_measurements(tmp_path / "a002.parquet", data.replace(positions=positions), robot)
    found = truing.fleet.identify(robot, tmp_path, test_share=0.0, workers=0)
    assert [arm.left_out for arm in found.arms.values()] == [0, 4, 0]
    truth = truing.predict(fleet.arms["a002"].truth.robot, data).position
    predicted = truing.predict(found.arms["a002"].robot, data).position
    assert np.linalg.norm(predicted - truth, axis=1).mean() < 6e-5


# ---- Partitions


def test_row_groups_and_files_give_the_same_answer(robot: truing.Robot, folder: Path, tmp_path: Path) -> None:
    """Not the same bits: the rows are summed in another order."""
    for path in sorted(folder.glob("*.parquet")):
        pq.write_table(pq.read_table(path), tmp_path / path.name, row_group_size=30)
    whole, parts = (truing.fleet.identify(robot, f, workers=0) for f in (folder, tmp_path))
    assert parts.partitions == 3 * whole.partitions
    for one, other in zip(whole.parameters, parts.parameters, strict=True):
        assert one.frozen or one.value == pytest.approx(other.value, abs=0.01 * one.sigma)
    assert whole.after.held_out.n == parts.after.held_out.n  # the same poses are held out


def test_arms_are_told_by_column_folder_and_file(robot: truing.Robot, folder: Path, tmp_path: Path) -> None:
    tables = {path.stem: pq.read_table(path) for path in sorted(folder.glob("*.parquet"))[:3]}
    together = pa.concat_tables(
        [t.append_column("arm", pa.array([name] * t.num_rows)) for name, t in tables.items()]
    )
    column, folders, one = (tmp_path / name for name in ("column", "folders", "one"))
    for place in (column, folders, one):
        place.mkdir()
    pq.write_table(together, column / "all.parquet")
    for name, table in tables.items():
        (folders / f"arm={name}").mkdir()
        pq.write_table(table, folders / f"arm={name}" / "part-0.parquet")
    by_column, by_folder = (truing.fleet.identify(robot, f, workers=0) for f in (column, folders))
    assert list(by_column.arms) == list(by_folder.arms) == ["a001", "a002", "a003"]
    assert [a.rows for a in by_column.arms.values()] == [POSES] * 3
    assert by_column.parameter("elbow.a") == by_folder.parameter("elbow.a")
    part = tables["a001"]
    pq.write_table(part.slice(0, 40), one / "monday.parquet")
    pq.write_table(part.slice(40), one / "tuesday.parquet")
    assert list(truing.fleet.identify(robot, one, one_arm=True, workers=0).arms) == ["arm"]


def test_a_corrupt_partition_is_named_and_passed_over_on_request(
    robot: truing.Robot, folder: Path, tmp_path: Path
) -> None:
    for path in folder.glob("*.parquet"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    whole = (tmp_path / "a003.parquet").read_bytes()
    (tmp_path / "a003.parquet").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(truing.InputError, match=r"a003\.parquet: is a damaged Parquet file.*--skip-corrupt"):
        truing.fleet.identify(robot, tmp_path, workers=0)
    found = truing.fleet.identify(robot, tmp_path, workers=0, skip_corrupt=True)
    assert len(found.arms) == ARMS - 1
    assert len(found.skipped) == 1 and "a003.parquet" in found.skipped[0]


def test_a_partition_with_a_wrong_cell_is_named(robot: truing.Robot, folder: Path, tmp_path: Path) -> None:
    table = pq.read_table(folder / "a001.parquet")
    q1 = table["q1_rad"].to_numpy().copy()
    q1[70] = np.nan
    table = table.set_column(table.column_names.index("q1_rad"), "q1_rad", pa.array(q1))
    pq.write_table(table, tmp_path / "a001.parquet", row_group_size=40)
    with pytest.raises(truing.InputError, match=r"a001\.parquet, row 71, column 'q1_rad': found .nan"):
        truing.fleet.identify(robot, tmp_path, workers=0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"effects": "stiffness_zones"}, "takes constants from the rows"),
        ({"loss": "huber"}, "expected 'reject' or 'none'"),
        ({"test_share": 1.0}, "expected a fraction"),
        ({"free": "J9.a"}, "J9.a"),
    ],
)
def test_options_that_cannot_be_used_are_refused(
    robot: truing.Robot, folder: Path, options: dict[str, object], message: str
) -> None:
    with pytest.raises(truing.InputError, match=message):
        truing.fleet.identify(robot, folder, workers=0, **options)  # type: ignore[arg-type]


def test_sources_that_hold_nothing_are_refused(robot: truing.Robot, tmp_path: Path) -> None:
    with pytest.raises(truing.InputError, match="there is no such file or folder"):
        truing.fleet.identify(robot, [tmp_path / "none.csv"], workers=0)
    with pytest.raises(truing.InputError, match=r"has no \.csv, \.parquet, \.pq files"):
        truing.fleet.identify(robot, tmp_path, workers=0)
    with pytest.raises(truing.InputError, match="no files"):
        truing.fleet.identify(robot, [], workers=0)


# ---- The command


def test_the_command_writes_every_arm(robot: truing.Robot, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert (
        main(["fleet", "identify", str(example("ur10")), str(folder), "--workers", "0", "--out", str(out)])
        == 0
    )
    result = json.loads((out / "result.json").read_text())
    assert result["format"] == "truing-fleet/1" and len(result["arms"]) == ARMS
    again = truing.load_robot(out / "robot_a004.yaml")
    assert again.joint("elbow").offset == pytest.approx(
        next(p["value"] for p in result["arms"]["a004"]["parameters"] if p["name"] == "elbow.offset"),
        abs=1e-9,
    )
    assert (out / "arms.csv").read_text().count("\n") == ARMS + 1
    assert "a004" in (out / "report.html").read_text()
