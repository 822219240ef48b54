# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings longer than memory: Parquet files that are read a piece at a time."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from truing._core import Recording
from truing.dynamics import check_recordings, identify, load_recordings, predict, validate_recording
from truing.dynamics.result import write_fit
from truing.dynamics.servo.data import servo_data
from truing.errors import InputError
from truing.files import recording_table
from truing.testing.dynamics import SimulatedMotion, simulate_motion

ROWS = 500  # of a piece


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seed=5, recordings=2, held_out=1, seconds=40.0)


@pytest.fixture(autouse=True)
def small_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_table, "MOST_IN_MEMORY", 1000)
    monkeypatch.setattr(recording_table, "PIECE_ROWS", ROWS)
    monkeypatch.setattr(recording_table, "PASS_ROWS", ROWS)


def columns_of(recording: Recording) -> dict[str, np.ndarray]:
    out = {"t_s": np.asarray(recording.time)}
    for k in range(recording.position.shape[1]):
        out[f"q{k + 1}_rad"] = np.asarray(recording.position[:, k])
        out[f"tau{k + 1}_Nm"] = np.asarray(recording.torque[:, k])
    return out


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    pa.parquet.write_table(pa.table(columns), path, row_group_size=2 * ROWS)
    return path


def test_a_long_file_stays_on_disk_and_is_all_there(tmp_path: Path, simulated: SimulatedMotion) -> None:
    whole = simulated.recordings[0]
    columns = {**columns_of(whole), "temp_C": 20 + whole.time, "gaps": np.where(whole.time > 30, np.nan, 1.0)}
    (found,) = load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)
    assert len(found) == ROWS
    assert found.pieces is not None
    for _ in range(2):  # as often as it is asked
        pieces = list(found.pieces())
        assert sum(len(piece) for piece in pieces) == len(whole)
        assert max(len(piece) for piece in pieces) == ROWS
        for name in ("time", "position", "torque"):
            both = np.concatenate([getattr(piece, name) for piece in pieces])
            assert np.array_equal(both, getattr(whole, name))
        assert all(set(piece.columns) == {"temp_C"} for piece in pieces)
    assert found.end == whole.time[-1]
    assert "more on disk" in repr(found)
    assert found.replace(test=True).pieces is found.pieces
    validate_recording(found, simulated.nominal)
    assert list(pickle.loads(pickle.dumps(found)).pieces())[-1].time[-1] == whole.time[-1]


def test_the_fit_is_that_of_the_recordings_in_memory(tmp_path: Path, simulated: SimulatedMotion) -> None:
    files = []
    for number, whole in enumerate(simulated.recordings):
        sets = np.full(len(whole), "test" if whole.test else "train")
        files.append(written(tmp_path / f"m{number}.parquet", {**columns_of(whole), "set": sets}))
    found = identify(simulated.nominal, load_recordings(files, simulated.nominal))
    expected = identify(simulated.nominal, simulated.recordings)
    for one, other in zip(found.errors, expected.errors, strict=True):
        assert [e.rms for e in one.held_out] == pytest.approx([e.rms for e in other.held_out], rel=1e-9)
        assert [e.n for e in one.train] == [e.n for e in other.train]


def test_residuals_are_written_of_what_is_in_memory(tmp_path: Path, simulated: SimulatedMotion) -> None:
    long = load_recordings(
        written(tmp_path / "long.parquet", columns_of(simulated.recordings[0])), simulated.nominal
    )
    found = identify(simulated.nominal, simulated.recordings)
    for recordings, there in ((long, False), ((*long, simulated.recordings[1]), True)):
        folder = tmp_path / str(there)
        folder.mkdir()
        write_fit(folder, found, recordings)
        assert (folder / "residuals.parquet").exists() is there


def test_stamps_since_1970_are_counted_from_the_first_row(tmp_path: Path, simulated: SimulatedMotion) -> None:
    whole = simulated.recordings[0]
    columns = columns_of(whole)
    columns["t_ns"] = (1.7e18 + 1e9 * columns.pop("t_s")).astype(np.int64)
    (found,) = load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)
    assert found.pieces is not None
    both = np.concatenate([piece.time for piece in found.pieces()])
    assert both == pytest.approx(whole.time, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t_s": (900, -1.0)}, r"row 901, column 't_s': time goes backwards"),
        ({"t_s": (1000, -1.0)}, r"row 1001.*time goes backwards"),
        ({"q2_rad": (1234, np.nan)}, r"row 1235, column 'q2_rad': found 'nan'"),
    ],
)
def test_faults_are_found_where_they_are_in_the_file(
    tmp_path: Path, simulated: SimulatedMotion, change: dict[str, tuple[int, float]], message: str
) -> None:
    columns = {name: values.copy() for name, values in columns_of(simulated.recordings[0]).items()}
    for name, (row, value) in change.items():
        columns[name][row] = value
    with pytest.raises(InputError, match=message):
        load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)


def test_a_joint_that_is_recorded_in_a_part_is_refused(tmp_path: Path, simulated: SimulatedMotion) -> None:
    columns = columns_of(simulated.recordings[0])
    columns["tau1_Nm"] = np.where(np.arange(len(columns["t_s"])) < 2 * ROWS, columns["tau1_Nm"], np.nan)
    with pytest.raises(InputError, match=r"row 1001: a joint's column is empty from here on"):
        load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)


def test_a_set_that_changes_asks_for_files_of_their_own(tmp_path: Path, simulated: SimulatedMotion) -> None:
    columns = columns_of(simulated.recordings[0])
    columns["set"] = np.where(np.arange(len(columns["t_s"])) < 2 * ROWS, "train", "test")
    with pytest.raises(InputError, match=r"column 'set': changes within a file that is read in pieces"):
        load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)


def test_a_fault_while_it_is_read_again_comes_out(tmp_path: Path, simulated: SimulatedMotion) -> None:
    path = written(tmp_path / "long.parquet", columns_of(simulated.recordings[0]))
    found = load_recordings(path, simulated.nominal)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(InputError, match="damaged Parquet file"):
        identify(simulated.nominal, found)


def test_torques_are_predicted_of_recordings_in_memory(tmp_path: Path, simulated: SimulatedMotion) -> None:
    (found,) = load_recordings(
        written(tmp_path / "long.parquet", columns_of(simulated.recordings[0])), simulated.nominal
    )
    with pytest.raises(InputError, match="longer than memory"):
        predict(simulated.nominal, found)


def with_spikes(q: np.ndarray, tau: np.ndarray) -> None:
    tau[50::400, 1] += 3000.0


def frozen(q: np.ndarray, tau: np.ndarray) -> None:
    for first in (100, 2100):
        q[first : first + 30] = q[first - 1]


def folded(q: np.ndarray, tau: np.ndarray) -> None:
    q[:, 0] = (q[:, 0] + 3.0 + np.pi) % (2.0 * np.pi) - np.pi


def in_degrees(q: np.ndarray, tau: np.ndarray) -> None:
    q *= 180.0 / np.pi


@pytest.mark.parametrize(
    ("spoil", "finding", "rows"),
    [
        (with_spikes, "spikes", 4000),
        (frozen, "frozen", 3940),
        (folded, "angle_folded", 4000),
        (in_degrees, "position_unit", 4000),
    ],
)
def test_what_is_corrected_is_corrected_in_all_pieces(
    tmp_path: Path, simulated: SimulatedMotion, spoil: Callable[..., None], finding: str, rows: int
) -> None:
    files = []
    for one in simulated.recordings:
        q, tau = np.array(one.position), np.array(one.torque)
        spoil(q, tau)
        columns = columns_of(one.replace(position=q, torque=tau))
        files.append(written(tmp_path / f"{one.name}.parquet", columns))
    checked = check_recordings(simulated.nominal, load_recordings(files, simulated.nominal))
    assert finding in {one.finding for one in checked.findings if one.applied}
    for found, one in zip(checked.recordings, simulated.recordings, strict=True):
        assert found.pieces is not None
        pieces = list(pickle.loads(pickle.dumps(found.pieces))())
        whole = {name: np.concatenate([getattr(p, name) for p in pieces]) for name in ("position", "torque")}
        assert len(whole["position"]) == rows
        assert np.abs(np.diff(whole["position"], axis=0)).max() < 2.0
        assert np.abs(whole["position"]).max() < np.abs(one.position).max() + 4.0
        assert np.abs(whole["torque"]).max() < 1.5 * np.abs(one.torque).max()


def test_rows_with_the_drives_off_are_left_out_of_all_pieces(
    tmp_path: Path, simulated: SimulatedMotion
) -> None:
    """One piece is off as a whole, and the last one is a single row."""
    rows = 6 * ROWS + 1
    columns = {name: values[:rows] for name, values in columns_of(simulated.recordings[0]).items()}
    number = np.arange(rows)
    columns["enabled"] = np.where((number > 10) & ((number < 2 * ROWS) | (number >= 4 * ROWS)), 1.0, 0.0)
    (found,) = load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)
    checked = check_recordings(simulated.nominal, [found])
    (said,) = [one for one in checked.findings if one.finding == "drives_off"]
    assert said.applied and "by the column enabled" in said.evidence
    pieces = checked.recordings[0].pieces
    assert pieces is not None
    time = np.concatenate([np.asarray(piece.time) for piece in pieces()])
    assert np.array_equal(time, columns["t_s"][columns["enabled"] > 0.5])


def test_commands_longer_than_memory_are_refused_and_not_cut_short(
    tmp_path: Path, simulated: SimulatedMotion
) -> None:
    columns = columns_of(simulated.recordings[0])
    for k in range(6):
        columns[f"u{k + 1}_rad"] = columns[f"q{k + 1}_rad"]
        del columns[f"tau{k + 1}_Nm"]
    recordings = load_recordings(written(tmp_path / "long.parquet", columns), simulated.nominal)
    with pytest.raises(InputError, match="long: is longer than memory"):
        servo_data(recordings, 6)
