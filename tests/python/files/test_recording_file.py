# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion as tables: what is read, and that what cannot be is refused at its line and column."""

from __future__ import annotations

import math
import mmap
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from fuzzing import mutated, quick
from truing import _core
from truing.dynamics import load_recordings
from truing.errors import InputError, InputWarning
from truing.files import write_table

ROBOT = _core.Robot(
    "arm",
    joints=[
        _core.Joint("J1", d=0.3, alpha=1.5),
        _core.Joint("P", a=0.2, driven_by={"J1": -1.0}),
        _core.Joint("S", type="prismatic", a=0.4),
    ],
)
ROWS = 40
T = np.round(np.arange(ROWS) * 0.01, 5)
Q1, Q2 = np.sin(T), 0.1 * np.cos(T)


def table(**other: object) -> dict[str, object]:
    return {"t_s": T, "q1_rad": Q1, "q2_m": Q2, **other}


def text_of(columns: dict[str, object]) -> list[str]:
    values = [np.broadcast_to(np.asarray(column, dtype=object), ROWS) for column in columns.values()]
    return [",".join(columns), *(",".join(map(str, row)) for row in zip(*values, strict=True))]


def csv(folder: Path, columns: dict[str, object], name: str = "run.csv") -> Path:
    path = folder / name
    path.write_text("\n".join(text_of(columns)) + "\n")
    return path


def with_cell(column: object, row: int, value: object) -> list[object]:
    values = list(np.broadcast_to(np.asarray(column, dtype=object), ROWS))
    values[row] = value
    return values


def refusal(path: Path | str, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        load_recordings(path, ROBOT, **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_recording_has_every_table_of_its_file(tmp_path: Path) -> None:
    given = table(
        qd1_rad_s=1.5,
        qd2_m_s=0.2,
        tau1_Nm=3,
        tau2_N=4,
        i1_A=0.5,
        u1_rad=Q1,
        u1_Nm=7,
        ud1_rad_s=2,
        payload_kg=2.5,
    )
    (found,) = load_recordings(csv(tmp_path, {**given, "enabled": 1, "load_raw": 17, "set": "test"}), ROBOT)
    assert found.name == "run" and len(found) == ROWS and found.test
    assert np.array_equal(found.time, T)
    assert np.array_equal(found.position, np.column_stack([Q1, Q2]))
    assert (found.speed == [1.5, 0.2]).all()
    assert (found.torque == [3.0, 4.0]).all()
    assert (found.current[:, 0] == 0.5).all() and np.isnan(found.current[:, 1]).all()
    assert np.array_equal(found.command[:, 0], Q1) and np.isnan(found.command[:, 1]).all()
    assert (found.torque_command[:, 0] == 7.0).all()
    assert (found.speed_command[:, 0] == 2.0).all()
    assert sorted(found.columns) == ["enabled", "load_raw", "payload_kg"]
    assert (found.columns["load_raw"] == 17.0).all()


def test_a_table_that_was_not_recorded_has_no_columns(tmp_path: Path) -> None:
    (found,) = load_recordings(csv(tmp_path, table(tau1_Nm="", payload_kg="")), ROBOT)
    assert found.torque.shape == found.current.shape == (ROWS, 0)
    assert not found.columns and not found.test


@pytest.mark.parametrize(
    ("column", "value", "field", "joint", "expected"),
    [
        ("qd1_deg_s", 180.0, "speed", 0, math.pi),
        ("qd1_rpm", 60.0, "speed", 0, 2.0 * math.pi),
        ("qd2_mm_s", 250.0, "speed", 1, 0.25),
        ("tau1_mNm", 1500.0, "torque", 0, 1.5),
        ("i2_mA", 700.0, "current", 1, 0.7),
        ("u1_deg", -90.0, "command", 0, -math.pi / 2.0),
        ("u2_mm", 5.0, "command", 1, 0.005),
        ("u2_N", 5.0, "torque_command", 1, 5.0),
        ("ud1_rpm", -60.0, "speed_command", 0, -2.0 * math.pi),
    ],
)
def test_units_come_from_the_name(
    tmp_path: Path, column: str, value: float, field: str, joint: int, expected: float
) -> None:
    (found,) = load_recordings(csv(tmp_path, table(**{column: value})), ROBOT)
    assert getattr(found, field)[:, joint] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("column", "value", "name", "expected"),
    [
        ("temp1_K", 300.0, "temp1_C", 26.85),
        ("temp_C", 31.0, "temp_C", 31.0),
        ("temp_K", 273.15, "temp_C", 0.0),
        ("volt_mV", 12500.0, "volt_V", 12.5),
        ("payload_g", 250.0, "payload_kg", 0.25),
    ],
)
def test_other_columns_get_their_si_name(
    tmp_path: Path, column: str, value: float, name: str, expected: float
) -> None:
    (found,) = load_recordings(csv(tmp_path, table(**{column: value})), ROBOT)
    assert found.columns[name] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "size"), [("t_ms", 1e3), ("time_us", 1e6), ("timestamp_ns", 1e9), ("time_s", 1)]
)
def test_stamps_of_a_recorder_s_clock_begin_at_zero(tmp_path: Path, name: str, size: float) -> None:
    columns = table()
    del columns["t_s"]
    stamps = [f"{round((1_760_000_000 + k / 100) * size)}" for k in range(ROWS)]
    if size == 1:
        stamps = [f"{1_760_000_000 + k / 100:.2f}" for k in range(ROWS)]
    (found,) = load_recordings(csv(tmp_path, {name: stamps, **columns}), ROBOT)
    assert found.time[0] == 0.0
    assert found.time == pytest.approx(np.arange(ROWS) / 100.0, abs=1e-6)


def test_stamps_since_the_start_stay_and_a_further_clock_is_kept(tmp_path: Path) -> None:
    (found,) = load_recordings(csv(tmp_path, table(t_s=T + 12.5, timestamp_ns=T * 1e9)), ROBOT)
    assert found.time[0] == 12.5
    assert np.array_equal(found.columns["timestamp_ns"], T * 1e9)


def test_gaps_and_jitter_are_kept(tmp_path: Path) -> None:
    t = T + 0.003 * np.sin(np.arange(ROWS))
    t[20:] += 5.0
    (found,) = load_recordings(csv(tmp_path, table(t_s=t)), ROBOT)
    assert np.array_equal(found.time, t)


def test_runs_of_a_set_are_recordings_of_their_own(tmp_path: Path) -> None:
    sets = ["train"] * 20 + ["test"] * 20
    first, second = load_recordings(csv(tmp_path, table(set=sets, x=np.arange(ROWS))), ROBOT)
    assert (first.name, first.test, second.name, second.test) == ("run#1", False, "run#2", True)
    assert np.array_equal(second.time, T[20:])
    assert np.array_equal(second.columns["x"], np.arange(20, ROWS))
    message = refusal(csv(tmp_path, table(set=["train"] * 33 + ["test"] * 7)))
    assert "recording 'run#2': has 7 rows, expected at least 20" in message and "run.csv" in message


def test_joints_says_which_joint_each_number_is(tmp_path: Path) -> None:
    columns = {
        "t_s": T,
        "q1_rad": 9.0,
        "q2_m": Q2,
        "q3_deg": 90.0,
        "tau3_Nm": 5.0,
        "temp3_C": 40.0,
        "tau1_Nm": "",
    }
    (found,) = load_recordings(csv(tmp_path, columns), ROBOT, joints="-, S, J1")
    assert np.array_equal(found.position, np.column_stack([np.full(ROWS, math.pi / 2.0), Q2]))
    assert (found.torque[:, 0] == 5.0).all()
    assert list(found.columns) == ["temp1_C"]
    message = refusal(csv(tmp_path, columns))
    assert "column 'q1_rad'" not in message and "column 'q3_deg': the robot has 2 joints" in message
    assert "no joint 'P' with a reading; it has J1, S" in refusal(csv(tmp_path, columns), joints=["J1", "P"])
    assert "there is no S" in refusal(csv(tmp_path, columns), joints=["J1"])
    assert "--joints: found 'J1' twice" in refusal(csv(tmp_path, columns), joints=["J1", "J1", "S"])


def test_comments_are_passed_over_and_lines_still_counted(tmp_path: Path) -> None:
    lines = text_of(table(tau1_Nm=1.0))
    path = tmp_path / "run.csv"
    commented = ["# recorded by hand", "#", lines[0], *lines[1:6], "# paused, here", *lines[6:]]
    path.write_text("\ufeff" + "\n".join(commented) + "\n", encoding="utf-8")
    (found,) = load_recordings(path, ROBOT)
    assert np.array_equal(found.time, T)
    commented[12] = commented[12].replace(",1.0", ",one")
    path.write_text("\n".join(commented) + "\n")
    assert "line 13, column 'tau1_Nm': found 'one', expected a number" in refusal(path)
    commented[12] = commented[12].replace(",one", ",nan")
    path.write_text("\n".join(commented) + "\n")
    assert "line 13, column 'tau1_Nm': found 'nan', expected a finite number" in refusal(path)


@pytest.mark.parametrize("length", range(3))
def test_nothing_is_read_beyond_a_file_that_fills_its_last_page(tmp_path: Path, length: int) -> None:
    """The byte after it is that of another mapping: here one that must not be read."""
    lines = text_of(table())
    lines[-2] += "0" * length  # decimals; some lengths of the last line end a search early
    lines[-1] += "0" * (-len("\n".join([*lines, ""])) % mmap.PAGESIZE)
    path = tmp_path / "run.csv"
    path.write_text("\n".join([*lines, ""]))
    size = path.stat().st_size
    assert size % mmap.PAGESIZE == 0
    unreadable = [mmap.mmap(-1, size, prot=0) for _ in range(500)]  # no gap is left elsewhere
    (found,) = load_recordings(path, ROBOT)
    assert np.array_equal(found.time, T)
    del unreadable


def test_column_names_may_be_a_comment_as_numpy_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = np.column_stack([T, Q1, Q2])
    np.savetxt(path, rows, delimiter=",", header="by hand\nt_s,q1_rad,q2_m")
    (found,) = load_recordings(path, ROBOT)
    assert np.array_equal(found.time, T)
    assert np.array_equal(found.position, rows[:, 1:])
    rows[5, 1] = np.nan
    np.savetxt(path, rows, delimiter=",", header="t_s,q1_rad,q2_m")
    assert "line 7, column 'q1_rad': found 'nan'" in refusal(path)


def test_a_row_that_begins_with_a_sum_gone_wrong_is_no_comment(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    lines = [f"{t},{a},{b}" for t, a, b in zip(T, Q1, Q2, strict=True)]
    lines[4] = "#DIV/0!,0,0"
    path.write_text("\n".join(["# made by a workbook", "t_s,q1_rad,q2_m", *lines, ""]))
    assert "line 7, column 't_s': found '#DIV/0!', expected" in refusal(path)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            table(tau1_Nm=with_cell(1.0, 7, "")),
            "line 9, column 'tau1_Nm': found an empty cell, expected a finite",
        ),
        (
            table(q2_m=with_cell(Q2, 7, "nan")),
            "line 9, column 'q2_m': found 'nan', expected a finite number: leave",
        ),
        (table(q2_m=""), "line 2, column 'q2_m': found an empty cell"),
        (
            table(i1_A=with_cell(1.0, 0, 1e13)),
            "line 2, column 'i1_A': found '10000000000000.0', expected a number",
        ),
        (table(t_s=with_cell(T, 8, 0.07)), "line 10, column 't_s': found 0.07 s a second time"),
        (
            table(t_s=with_cell(T, 8, 0.01)),
            "line 10, column 't_s': time goes backwards: found 0.01 s after 0.07 s",
        ),
        (table(t_s=with_cell(T, 8, "")), "line 10, column 't_s': found an empty cell, expected a time"),
        (table(t_s=T * 1e5), "column 't_s': rows are 1000 s apart: the unit"),
        (table(payload_kg=with_cell(1.0, 3, -2)), "line 5, column 'payload_kg': found '-2', expected a mass"),
        (table(enabled=with_cell(1, 3, 2)), "line 5, column 'enabled': found '2', expected 0 or 1"),
        (
            table(set=with_cell("train", 3, "hold")),
            "line 5, column 'set': found 'hold', expected train or test",
        ),
        (table(note=with_cell(1.0, 3, "ouch")), "line 5, column 'note': found 'ouch', expected a number"),
        (
            table(qd1=1.0),
            "column 'qd1': there is no unit in the name, expected qd1_rad_s or qd1_deg_s or qd1_rpm",
        ),
        (table(tau1_N=1.0), "column 'tau1_N': found the unit 'N' in the name, expected tau1_Nm or tau1_mNm"),
        (table(qd1_rpm=1.0, qd1_rad_s=1.0), "column 'qd1_rad_s': column 'qd1_rpm' is there too"),
        (table(temp1_F=1.0), "column 'temp1_F': found the unit 'F' in the name, expected temp1_C or temp1_K"),
        (
            table(payload=1.0),
            "column 'payload': there is no unit in the name, expected payload_kg or payload_g",
        ),
        (table(q3_rad=1.0), "column 'q3_rad': the robot has 2 joints with a reading: J1, S;"),
        (table(q3_rad=1.0), "'-' for none: 'J1,S,-' if the last are others"),
        (
            {"t_s": T, "q1_m": Q1, "q2_m": Q2},
            "column 'q1_m': found the unit 'm' in the name, expected q1_rad",
        ),
        (
            {"t_s": T, "q1_rad": Q1, "Q2_m": Q2},
            "no column q2_m or q2_mm, the position of joint 'S'; did you mean",
        ),
        (
            {"t_s": T, "q1_rad": Q1},
            "the position of joint 'S'; joints up to the tip are left out by the name of the link before them"
            " (--tip-link); the columns are t_s, q1_rad",
        ),
        ({"t_s": T, "q2_m": Q2}, "the position of joint 'J1'; the columns are t_s, q2_m"),
        ({"q1_rad": Q1, "q2_m": Q2}, "there is no column t_s (or t_ms, t_us, t_ns)"),
        ({"time": T, "q1_rad": Q1, "q2_m": Q2}, "the name 'time' says no unit: call the column time_s"),
        (
            {"t_ms": T, "time_us": T, "q1_rad": Q1, "q2_m": Q2},
            "column 't_ms': column 'time_us' is a time too",
        ),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(
    tmp_path: Path, columns: dict[str, object], message: str
) -> None:
    path = csv(tmp_path, columns)
    found = refusal(path)
    assert message in found
    assert str(path) in found


def test_a_run_of_missing_values_is_counted(tmp_path: Path) -> None:
    torque = np.ones(ROWS, dtype=object)
    torque[10:14] = ""
    torque[30] = ""
    message = refusal(csv(tmp_path, table(tau1_Nm=torque)))
    assert "line 12" in message and "(in 4 rows from here, 5 of 40 in all)" in message


def test_a_few_rows_are_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "short.csv"
    path.write_text("\n".join(text_of(table())[:11]) + "\n")
    assert "short.csv: recording 'short': has 10 rows, expected at least 20" in refusal(path)


def test_a_column_of_one_s_own_with_gaps_is_left_out_and_said(tmp_path: Path) -> None:
    path = csv(tmp_path, table(humidity=with_cell(0.4, 5, "nan"), empty=""))
    with pytest.warns(
        InputWarning, match=r"run.csv, column 'humidity': is left out: found nan in row 6"
    ) as said:
        (found,) = load_recordings(path, ROBOT)
    assert len(said) == 1
    assert not found.columns


def test_parquet_is_the_same_recording(tmp_path: Path) -> None:
    columns = table(tau1_Nm=np.cos(T), payload_kg=2.0 * np.ones(ROWS), set=["test"] * ROWS)
    write_table(tmp_path / "run.parquet", columns)  # type: ignore[arg-type]
    write_table(tmp_path / "run.csv", columns)  # type: ignore[arg-type]
    (left,), (right,) = (load_recordings(tmp_path / name, ROBOT) for name in ("run.parquet", "run.csv"))
    for field in ("time", "position", "torque"):
        assert np.array_equal(getattr(left, field), getattr(right, field), equal_nan=True)
    assert left.test and right.test
    write_table(tmp_path / "on.parquet", {**columns, "enabled": T > 0.1})  # type: ignore[arg-type]
    (found,) = load_recordings(tmp_path / "on.parquet", ROBOT)
    assert np.array_equal(found.columns["enabled"], T > 0.1)
    write_table(tmp_path / "bad.parquet", {**columns, "tau1_Nm": np.where(T == 0.1, np.nan, 1.0)})  # type: ignore[arg-type]
    assert "bad.parquet, row 11, column 'tau1_Nm': found an empty cell" in refusal(tmp_path / "bad.parquet")


def test_patterns_names_and_files_that_are_not_there(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    first = csv(tmp_path, table(), "one.csv")
    second, third = csv(tmp_path, table(), "two.csv"), csv(tmp_path / "b", table(), "two.csv")
    found = load_recordings(str(tmp_path / "*.csv"), ROBOT)
    assert [recording.name for recording in found] == ["one", "two"]
    found = load_recordings([first, second, third], ROBOT)
    assert [recording.name for recording in found] == ["one", second.as_posix(), third.as_posix()]
    assert "no file matches this pattern" in refusal(str(tmp_path / "*.txt"))
    assert "is given 2 times" in refusal([first, str(first)])  # type: ignore[arg-type]
    assert "no recordings are given" in refusal([])  # type: ignore[arg-type]
    assert "cannot be read" in refusal(tmp_path / "none.csv")


CSV = "\n".join(text_of(table(tau1_Nm=1.5, temp1_C=20, enabled=1, set="train", x=3))[:26]).encode()


def check(folder: Path, data: bytes) -> None:
    path = folder / "data.csv"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            read = load_recordings(path, ROBOT)
        except InputError as error:
            assert "data.csv" in str(error)
            assert "\n" not in str(error)
            return
    for recording in read:
        _core.validate_recording(recording, ROBOT)
        assert np.isfinite(recording.position).all()


@quick
@given(data=mutated(CSV))
@example(data=CSV)
def test_recordings_with_faults(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    check(tmp_path_factory.getbasetemp(), data)


@settings(quick, suppress_health_check=list(HealthCheck))
@given(text=st.text(alphabet='0123456789.,-+e"#\n\r na', max_size=120))
def test_recordings_of_any_cells(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    check(tmp_path_factory.getbasetemp(), b"t_s,q1_rad,q2_m\n" + text.encode())


WITHOUT_PANDAS = """
import sys
from truing import _core
from truing.dynamics import load_recordings
from truing.files import write_table

robot = _core.Robot("arm", joints=[_core.Joint("J1", d=0.3)])
(found,) = load_recordings(sys.argv[1], robot)
write_table(sys.argv[2], {"t_s": found.time, "set": ["train", None] * (len(found) // 2)})
print(len(found), "pandas" in sys.modules)
"""


def test_tables_are_read_and_written_without_loading_pandas(tmp_path: Path) -> None:
    files = [str(tmp_path / "run.parquet"), str(tmp_path / "again.csv")]
    write_table(files[0], {"t_s": T, "q1_rad": Q1, "tau1_Nm": Q1, "set": ["train"] * ROWS})
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_PANDAS, *files], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [str(ROWS), "False"]


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_empty_cells_of_numbers_and_text_come_back(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"table.{ending}"
    write_table(
        path, {"a": np.array([1.5, np.nan, -3.0]), "b": ["x", None, "ü"], "c": np.array([True, False, True])}
    )
    read = pa.parquet.read_table(path) if ending == "parquet" else pa.csv.read_csv(path)
    read.validate(full=True)
    assert read["a"].to_pylist() == [1.5, None, -3.0]
    assert [word or None for word in read["b"].to_pylist()] == ["x", None, "ü"]
    assert read["c"].to_pylist() == [True, False, True]
