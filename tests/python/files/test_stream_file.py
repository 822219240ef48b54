# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Streams and set-up files are read in SI; what is wrong is named with line, column, what was found and what
was expected.
"""

from __future__ import annotations

import csv
import functools
import re
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, strategies as st
from numpy.typing import NDArray

import truing
from fuzzing import mutated, quick
from truing import InputError, InputWarning
from truing.examples import example as robot_file
from truing.files.stream_file import SetupData, save_imu, save_joints, save_plan, save_tracker
from truing.testing import SimulatedStreams, simulate_streams
from truing.tracking import ModalModel, Tracker

Floats = NDArray[np.float64]
ROBOT = truing.load_robot(robot_file("large_boom"))


@functools.lru_cache(maxsize=1)
def recording() -> SimulatedStreams:
    return simulate_streams(ROBOT, seconds=3.0, imu_rate=200.0, seed=1)


def write(folder: Path) -> dict[str, Path]:
    """A good recording as files."""
    s = recording()
    paths = {name: folder / f"{name}.csv" for name in ("imu", "tracker", "joints", "plan")}
    save_imu(paths["imu"], **s.imu)
    save_tracker(paths["tracker"], **s.tracker)
    save_joints(paths["joints"], ROBOT, **s.joints)
    save_plan(paths["plan"], s.plan["t"], s.plan["T_base_tool"], s.plan["arrival"])
    return paths


def load(kind: str, path: Path) -> Any:
    readers: dict[str, Callable[[Path], Any]] = {
        "imu": truing.load_imu,
        "tracker": truing.load_tracker,
        "joints": lambda p: truing.load_joints(p, ROBOT),
        "plan": truing.load_plan,
    }
    return readers[kind](path)


def edited(path: Path, change: Callable[[list[str], list[list[str]]], None]) -> Path:
    """The file with `change` made to its names and cells."""
    with path.open(newline="") as file:
        names, *rows = list(csv.reader(file))
    change(names, rows)
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([names, *rows])
    return path


# ---- Good files ----------------------------------------------------------------------------------


def test_streams_are_read_as_they_are_written(tmp_path: Path) -> None:
    s, paths = recording(), write(tmp_path)
    imu, tracker, joints, plan = (load(kind, paths[kind]) for kind in ("imu", "tracker", "joints", "plan"))
    assert (
        (imu.t == s.imu["t"]).all()
        and (imu.gyro == s.imu["gyro"]).all()
        and (imu.accel == s.imu["accel"]).all()
        and (imu.arrival == s.imu["arrival"]).all()
    )
    assert (tracker.t == s.tracker["t"]).all() and (tracker.position == s.tracker["position"]).all()
    assert np.allclose(tracker.orientation, s.tracker["orientation"], atol=1e-15)
    assert (
        (joints.joints == s.joints["joints"]).all()
        and (plan.t == s.plan["t"]).all()
        and np.allclose(plan.T, s.plan["T_base_tool"], atol=1e-14)
    )


def test_units_in_names_are_converted_and_gaps_of_the_tracker_left_out(tmp_path: Path) -> None:
    paths = write(tmp_path)

    def millimetres(names: list[str], rows: list[list[str]]) -> None:
        for axis in "xyz":
            at = names.index(f"{axis}_m")
            names[at] = f"{axis}_mm"
            for row in rows:
                row[at] = repr(1000 * float(row[at]))
        rows[5][1:8] = [""] * 7

    with pytest.warns(InputWarning, match="1 of .* rows have no pose"):
        tracker = truing.load_tracker(edited(paths["tracker"], millimetres))
    s = recording().tracker
    assert len(tracker.t) == len(s["t"]) - 1 and np.allclose(
        tracker.position[5], s["position"][6], atol=1e-12
    )

    def degrees(names: list[str], rows: list[list[str]]) -> None:
        names[1] = "q1_deg"
        for row in rows:
            row[1] = repr(np.degrees(float(row[1])).item())

    assert np.allclose(
        truing.load_joints(edited(paths["joints"], degrees), ROBOT).joints,
        recording().joints["joints"],
        atol=1e-14,
    )


def test_late_and_double_rows_are_read_where_arrivals_tell_their_order(tmp_path: Path) -> None:
    paths = write(tmp_path)
    edited(paths["tracker"], lambda names, rows: rows.__setitem__(slice(3, 5), [rows[4], rows[3], rows[3]]))
    t = truing.load_tracker(paths["tracker"]).t
    assert t[3] > t[4] == t[5]


# ---- Bad streams ---------------------------------------------------------------------------------


def _cell(column: str, row: int, text: str) -> Callable[[list[str], list[list[str]]], None]:
    return lambda names, rows: rows[row].__setitem__(names.index(column), text)


def _rename(old: str, new: str) -> Callable[[list[str], list[list[str]]], None]:
    return lambda names, rows: names.__setitem__(names.index(old), new)


def _drop(column: str) -> Callable[[list[str], list[list[str]]], None]:
    def change(names: list[str], rows: list[list[str]]) -> None:
        at = names.index(column)
        for row in (names, *rows):
            del row[at]

    return change


def _scale(columns: str, factor: float) -> Callable[[list[str], list[list[str]]], None]:
    def change(names: list[str], rows: list[list[str]]) -> None:
        for k, name in enumerate(names):
            if re.fullmatch(columns, name):
                for row in rows:
                    row[k] = repr(factor * float(row[k]))

    return change


def _both(
    *changes: Callable[[list[str], list[list[str]]], None],
) -> Callable[[list[str], list[list[str]]], None]:
    def change(names: list[str], rows: list[list[str]]) -> None:
        for one in changes:
            one(names, rows)

    return change


BAD = [
    ("imu", _cell("t_s", 7, "0.01"), r"line 9, column 't_s': time goes backwards: found 0.01 after 0.03"),
    ("imu", _cell("t_s", 7, "0.03"), r"line 9, column 't_s': found 0.03 a second time"),
    ("imu", _cell("gx_rad_s", 4, "nan"), r"line 6, column 'gx_rad_s': found 'nan', expected a finite number"),
    ("imu", _cell("ay_m_s2", 4, ""), r"line 6, column 'ay_m_s2': found an empty cell"),
    ("imu", _cell("ay_m_s2", 4, "up"), r"line 6, column 'ay_m_s2': found 'up', expected a number"),
    (
        "imu",
        _rename("gx_rad_s", "gx_deg_s"),
        r"column 'gx_deg_s': found the unit 'deg_s' in the name, expected gx_rad_s",
    ),
    ("imu", _rename("ax_m_s2", "ax"), r"column 'ax': found the unit 'nothing' in the name, expected ax_m_s2"),
    ("imu", _rename("t_s", "t_ms"), r"column 't_ms': found the unit 'ms' in the name, expected t_s"),
    ("imu", _rename("gz_rad_s", "gyro_z"), r"there is no column gz_rad_s"),
    (
        "imu",
        _scale("g._rad_s", 1e6),
        r"column 'gx_rad_s': a tenth of the rates are above .*: these look like deg/s",
    ),
    (
        "imu",
        _scale("a._m_s2", 1 / 9.81),
        r"column 'ax_m_s2': the median length is 1\.?\d*, expected about 9.81 .*look like g",
    ),
    ("imu", _scale("a._m_s2", 1e-3), r"gravity seems to have been taken off"),
    (
        "imu",
        _scale("t_s", 1e6),
        r"column 't_s': samples are 5000 apart: these look like milliseconds or counts, expected seconds",
    ),
    (
        "tracker",
        _both(_drop("arrival_s"), lambda names, rows: rows.__setitem__(slice(3, 5), [rows[4], rows[3]])),
        r"time goes backwards: .*need a column arrival_s",
    ),
    ("tracker", _cell("qw", 2, "5"), r"line 4, column 'qw': the quaternion .* has length .*, expected 1"),
    ("tracker", _cell("y_m", 2, ""), r"line 4: found some empty cells, expected a whole pose or none"),
    ("tracker", _cell("y_m", 2, "nan"), r"line 4, column 'y_m': found 'nan'"),
    ("tracker", _drop("qz"), r"there is qw, qx, qy, but not qz: a quaternion has four parts"),
    (
        "tracker",
        _scale("[xyz]_m", 1e3),
        r"column 'x_m': positions are .* m away: these look like millimetres",
    ),
    ("joints", _drop("q3_rad"), r"there is no column q3_rad"),
    ("joints", _rename("q4_rad", "q5_rad"), r"there is no column q4_rad"),
    (
        "joints",
        _scale("q2_rad", 180 / np.pi),
        r"column 'q2_rad': values from .* look like degrees: call the column q2_deg",
    ),
    (
        "joints",
        _rename("q2_rad", "q2_m"),
        r"column 'q2_m': found the unit 'm' in the name, expected q2_rad or q2_deg",
    ),
    ("plan", _cell("t_s", 7, "-5"), r"line 9, column 't_s': time goes backwards"),
    ("plan", _drop("qz"), r"there is no column qz \(planned tool in the base frame\)"),
    ("plan", _scale("[xyz]_m", 1e3), r"look like millimetres"),
    (
        "plan",
        lambda names, rows: rows.__delitem__(slice(1, None)),
        r"has 1 row, expected a stream of samples",
    ),
]


@pytest.mark.parametrize(("kind", "change", "message"), BAD)
def test_a_bad_stream_is_named(
    tmp_path: Path, kind: str, change: Callable[[list[str], list[list[str]]], None], message: str
) -> None:
    path = edited(write(tmp_path)[kind], change)
    with pytest.raises(InputError) as error:
        load(kind, path)
    assert re.search(message, str(error.value)), str(error.value)
    assert str(path) in str(error.value)


def test_a_joint_too_many_is_named(tmp_path: Path) -> None:
    path = edited(write(tmp_path)["joints"], _rename("arrival_s", "q5_rad"))
    with pytest.raises(InputError, match="column 'q5_rad': the robot 'large_boom' has 4 driven joints"):
        truing.load_joints(path, ROBOT)


def test_a_column_that_nobody_knows_is_said(tmp_path: Path) -> None:
    path = edited(write(tmp_path)["imu"], _rename("arrival_s", "lamp"))
    with pytest.warns(InputWarning, match="not used: lamp"):
        assert truing.load_imu(path).arrival is None


# ---- Streams that do not belong together ---------------------------------------------------------


def parts(tmp_path: Path) -> dict[str, Any]:
    paths = write(tmp_path)
    return {kind: load(kind, paths[kind]) for kind in ("imu", "tracker", "joints")}


def _replace(data: Any, **changes: Any) -> Any:
    import dataclasses

    return dataclasses.replace(data, **changes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda p: {
                **p,
                "tracker": _replace(p["tracker"], position=p["tracker"].position[:, [0, 2, 1]] * [1, 1, -1]),
            },
            r"a y-up frame: the set-up's x y z are its x -z y",
        ),
        (
            lambda p: {**p, "tracker": _replace(p["tracker"], position=p["tracker"].position * [1, -1, 1])},
            r"left-handed axes: the set-up's x y z are its x -y z",
        ),
        (
            lambda p: {**p, "tracker": _replace(p["tracker"], position=p["tracker"].position * 9.9)},
            r"is this the set-up of this recording\?",
        ),
        (
            lambda p: {
                **p,
                "tracker": _replace(p["tracker"], orientation=p["tracker"].orientation[:, [1, 2, 3, 0]]),
            },
            r"if the quaternions are scalar last",
        ),
        (
            lambda p: {**p, "imu": _replace(p["imu"], gyro=np.degrees(p["imu"].gyro))},
            r"column 'gx_rad_s': the rates are .* times those of the joints: these look like deg/s",
        ),
        (
            lambda p: {
                **p,
                "imu": _replace(
                    p["imu"],
                    gyro=p["imu"].gyro[:, [0, 2, 1]] * [1, 1, -1],
                    accel=p["imu"].accel[:, [0, 2, 1]] * [1, 1, -1],
                ),
            },
            r"column 'ax_m_s2': .* deg from where encoders and T_flange_imu of the set-up have it",
        ),
        (
            lambda p: {**p, "tracker": _replace(p["tracker"], t=p["tracker"].t + 1000)},
            r"expected streams of the same time; is the clock offset in the set-up file right\?",
        ),
        (
            lambda p: {**p, "joints": _replace(p["joints"], t=p["joints"].t - 1000)},
            r"expected streams of the same time",
        ),
    ],
)
def test_what_cannot_be_is_named(
    tmp_path: Path, change: Callable[[dict[str, Any]], dict[str, Any]], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        truing.recorded_streams(ROBOT, recording().setup, **change(parts(tmp_path)))


def test_inverted_quaternions_are_named(tmp_path: Path) -> None:
    setup = recording().setup.replace(
        T_tracker_base=truing.frame_from_xyz_rpy([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    )
    s = simulate_streams(ROBOT, seconds=3.0, imu_rate=200.0, setup=setup)
    p = parts(tmp_path)
    tracker = _replace(
        p["tracker"],
        t=s.tracker["t"],
        position=s.tracker["position"],
        orientation=s.tracker["orientation"] * [1, -1, -1, -1],
        arrival=s.tracker["arrival"],
    )
    joints = _replace(p["joints"], t=s.joints["t"], joints=s.joints["joints"], arrival=s.joints["arrival"])
    with pytest.raises(
        InputError,
        match=(
            "column 'qw': orientations are .* rad from what encoders and set-up say, but .* if the"
            " quaternions are inverted"
        ),
    ):
        truing.recorded_streams(ROBOT, setup, imu=p["imu"], tracker=tracker, joints=joints)


def test_sign_flips_of_quaternions_change_nothing(tmp_path: Path) -> None:
    p, setup = parts(tmp_path), recording().setup
    flipped = _replace(
        p["tracker"],
        orientation=p["tracker"].orientation
        * np.where(np.arange(len(p["tracker"].t)) % 2, 1.0, -1.0)[:, None],
    )
    a, b = (
        truing.replay(truing.recorded_streams(ROBOT, setup, **{**p, "tracker": tracker}), setup).graded
        for tracker in (p["tracker"], flipped)
    )
    assert len(a["t"]) > 100 and np.allclose(a["position"], b["position"], atol=1e-12)


# ---- Set-up files --------------------------------------------------------------------------------


def setup_data() -> SetupData:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(6, 6))
    modes = ModalModel([0.6, 1.4], [0.02, 0.015], rng.normal(size=(2, 6, 3)), [0.01, 0.02])
    setup = recording().setup.replace(
        clock_offset=0.008,
        clock_offset_sigma=0.001,
        controller_clock_offset=-0.5,
        gravity=[0.1, 0.0, -9.80],
        gyro_bias=[1e-3, -2e-3, 3e-4],
        gyro_bias_sigma=2e-5,
        accel_bias=[0.02, 0.01, -0.05],
        accel_bias_sigma=4e-3,
    )
    return SetupData(
        setup,
        {"T_tracker_base": 1e-6 * A @ A.T},
        1e-3,
        42.0,
        modes,
        {"position_sigma": 2e-3, "reacquire_after": 12},
        {"position": 0.1},
        calibration={"source": "tests"},
    )


def test_a_set_up_comes_back_as_it_was_written(tmp_path: Path) -> None:
    given_data = setup_data()
    truing.save_setup(tmp_path / "setup.yaml", given_data)
    read = truing.load_setup(tmp_path / "setup.yaml")
    for name in ("T_tracker_base", "T_flange_receiver", "T_flange_tool", "T_flange_imu", "gravity"):
        assert np.allclose(getattr(read.setup, name), getattr(given_data.setup, name), atol=1e-14)
    for name in ("clock_offset", "clock_offset_sigma", "controller_clock_offset", "actuator_lag"):
        assert getattr(read.setup, name) == getattr(given_data.setup, name)
    for name in ("gyro_bias", "accel_bias"):
        assert (getattr(read.setup, name) == getattr(given_data.setup, name)).all()
        assert getattr(read.setup, f"{name}_sigma") == getattr(given_data.setup, f"{name}_sigma")
    assert np.allclose(
        read.covariance["T_tracker_base"], given_data.covariance["T_tracker_base"], rtol=1e-12, atol=0
    )
    assert (read.modes.frequency == given_data.modes.frequency).all() and (
        read.modes.gain == given_data.modes.gain
    ).all()
    assert (read.clock_drift, read.clock_reference) == (1e-3, 42.0) and read.steady(
        np.array([52.0])
    ).tolist() == [51.99]
    options = read.options()
    assert (options.filter.position_sigma, options.filter.reacquire_after, options.limits.position) == (
        2e-3,
        12,
        0.1,
    )


def test_millimetres_of_a_set_up_are_read_as_metres(tmp_path: Path) -> None:
    truing.save_setup(tmp_path / "setup.yaml", SetupData(recording().setup))
    text = (tmp_path / "setup.yaml").read_text()
    at = np.asarray(recording().setup.T_tracker_base)[:3, 3]
    text = text.replace("length: m,", "length: mm,").replace(
        f"xyz: [{', '.join(repr(float(v)) for v in at)}]",
        f"xyz: [{', '.join(repr(float(1000 * v)) for v in at)}]",
    )
    (tmp_path / "mm.yaml").write_text(text)
    assert np.allclose(
        np.asarray(truing.load_setup(tmp_path / "mm.yaml").setup.T_tracker_base)[:3, 3], at, atol=1e-12
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "format: truing-track/1",
            "format: truing-robot/1",
            r"line 1: format: found 'truing-robot/1', expected truing-track/1",
        ),
        ("T_flange_imu:", "T_flange_sensor:", r"T_flange_sensor: unknown key; did you mean"),
        (
            "units: {length: m, angle: rad}",
            "units: {length: inch, angle: rad}",
            r"line 2: units length: found 'inch', expected one of m, mm",
        ),
        ("units: {length: m, angle: rad}\n", "", r"key 'units' is missing"),
        (
            "clock_offset_sigma_s: 0.001",
            "clock_offset_sigma_s: -1",
            r"clock_offset_sigma_s: found -1, expected a number that is not below 0",
        ),
        ("gravity: [0.1,", "gravity: [100,", r"gravity: has length"),
        (
            "position_sigma:",
            "position_sgima:",
            r"filter position_sgima: unknown key; did you mean 'position_sigma'\?",
        ),
        (
            "frequency_hz: 0.6",
            "frequency_hz: 60",
            r"modes\[0\] frequency_hz: found 60, expected a frequency between 0 and 25 Hz",
        ),
        (
            "gyro_bias_rad_s: [0.001,",
            "gyro_bias_rad_s: [1.0,",
            r"gyro_bias_rad_s: found 1, expected at most 0\.5: no inertial sensor is so far off",
        ),
        ("damping: 0.02", "damping: .nan", r"modes\[0\] damping: found NaN"),
        ("  qw: ", "  qw: 3", r"qw: the quaternion has length .*, expected 1"),
    ],
)
def test_a_bad_set_up_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "setup.yaml"
    truing.save_setup(path, setup_data())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        truing.load_setup(path)
    assert re.search(message, str(error.value)), str(error.value)
    assert str(path) in str(error.value)


# ---- Whatever is in a file -----------------------------------------------------------------------

TRACKER = b"""\
t_s,x_m,y_m,z_m,qw,qx,qy,qz,arrival_s
0.00,1,2,3,1,0,0,0,0.03
0.01,1,2,3.001,1,0,0,0,0.04
0.03,1,2.001,3,0.8,0.6,0,0,0.05
"""
IMU = b"""\
t_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2
0.00,0,0.1,0,0,0,9.81
0.01,0,0.1,0,0.1,0,9.81
0.02,0,0.1,-0.1,0,0,9.8
"""
SETUP = b"""\
format: truing-track/1
units: {length: m, angle: rad}
T_tracker_base: {xyz: [1, 2, 3], qw: 1, qx: 0, qy: 0, qz: 0}
T_flange_receiver: {xyz: [0, 0, 0.1], qw: 0.6, qx: 0.8, qy: 0, qz: 0}
T_flange_tool: {xyz: [0, 0, 0.3], qw: 1, qx: 0, qy: 0, qz: 0}
T_flange_imu: {xyz: [0, 0.05, 0], qw: 1, qx: 0, qy: 0, qz: 0}
clock_offset_s: 0.008
modes:
  - \
{frequency_hz: 0.6, damping: 0.02, gain: [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]}
filter: {position_sigma: 0.002}
"""


def sound(reader: Callable[[Path], Any], data: bytes) -> None:
    """A sound object or InputError; nothing that is not finite gets through."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        path = Path(folder) / "file.csv"
        path.write_bytes(data)
        try:
            read = reader(path)
        except InputError as error:
            assert str(path) in str(error)
            return
        for value in vars(read).values():
            if isinstance(value, np.ndarray):
                assert np.isfinite(value).all()


@quick
@given(mutated(TRACKER))
@example(TRACKER)
def test_any_tracker_file(data: bytes) -> None:
    sound(truing.load_tracker, data)


@quick
@given(mutated(IMU))
@example(IMU)
def test_any_inertial_file(data: bytes) -> None:
    sound(truing.load_imu, data)


@quick
@given(mutated(SETUP))
@example(SETUP)
def test_any_set_up_file(data: bytes) -> None:
    def reader(path: Path) -> Any:
        read = truing.load_setup(path)
        Tracker(read.setup)
        assert (
            np.isfinite(np.asarray(read.setup.T_tracker_base)).all()
            and np.isfinite(np.asarray(read.modes.gain)).all()
        )
        return read

    sound(reader, data)


@quick
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["imu", "pose", "joints", "plan"]),
            st.floats(allow_nan=True, allow_infinity=True, width=32),
            st.floats(allow_nan=True, allow_infinity=True),
        ),
        max_size=30,
    )
)
def test_whatever_is_pushed_nothing_that_is_not_finite_comes_out(
    pushes: list[tuple[str, float, float]],
) -> None:
    tracker = Tracker(recording().setup)
    for kind, t, value in pushes:
        if kind == "imu":
            tracker.push_imu(t, [value, 0.0, 0.0], [0.0, value, 9.81])
        elif kind == "pose":
            tracker.push_pose(t, [value, 1.0, 2.0], [1.0, 0.0, 0.0, 0.0])
        elif kind == "joints":
            tracker.push_joints(t, np.eye(4))
        else:
            tracker.push_plan(t, np.eye(4))
    predicted = tracker.predict(tracker.now + 0.04 if abs(tracker.now) < 1e200 else 0.0)
    assert np.isfinite(predicted.T_base_tool).all() and np.isfinite(predicted.covariance).all()
