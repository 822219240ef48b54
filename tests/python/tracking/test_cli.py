# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing simulate --stream` and `truing track run` keep the contract of the command line, and the report
says what result.json says.
"""

from __future__ import annotations

import json
import math
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from pages import charts_of, visible
from tables import columns
from truing.cli import main
from truing.examples import example
from truing.files.stream_file import save_plan, save_tracker
from truing.rotations import rotations_from_quaternions

FORMAT = {
    "format",
    "version",
    "robot",
    "horizon_s",
    "rows",
    "made",
    "status",
    "predictors",
    "correction",
    "errors",
    "truth",
    "consistency",
    "clock",
    "modes",
    "shifts",
    "dropouts",
    "samples",
    "warnings",
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    assert (
        main(
            [
                "simulate",
                str(example("large_boom")),
                "--stream",
                "--seconds",
                "14s",
                "--motion",
                "stop-and-go",
                "--tip-speed",
                "1m/s",
                "--clock-offset",
                "5ms",
                "--dropout",
                "9s:1s",
                "--seed",
                "3",
                "--out",
                str(folder),
            ]
        )
        == 0
    )
    return folder


def arguments(folder: Path, *more: str, **files: Path) -> list[str]:
    paths = {name: folder / f"{name}.csv" for name in ("imu", "tracker", "joints", "plan")} | files
    return [
        "track",
        "run",
        str(folder / "robot.yaml"),
        "--setup",
        str(files.get("setup", folder / "setup.yaml")),
        *(word for name, path in paths.items() if name != "setup" for word in (f"--{name}", str(path))),
        *more,
    ]


@pytest.fixture(scope="module")
def run(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("run") / "found"
    assert main(arguments(recording, "--truth", str(recording / "truth.csv"), "--out", str(out))) == 0
    return out


def result_of(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "result.json").read_text()))


def test_a_recording_is_simulated_whole(recording: Path) -> None:
    assert {path.name for path in recording.iterdir()} == {
        "imu.csv",
        "tracker.csv",
        "joints.csv",
        "plan.csv",
        "setup.yaml",
        "robot.yaml",
        "truth.csv",
        "truth.json",
    }
    truth = json.loads((recording / "truth.json").read_text())
    assert (
        truth["format"] == "truing-track-simulation/1"
        and truth["clock_offset_s"] == 0.005
        and len(truth["modes"]) == 4
    )
    assert truth["dropouts"] == [{"start_s": 9.0, "seconds": 1.0}]
    imu, tracker = columns(recording / "imu.csv"), columns(recording / "tracker.csv")
    assert list(imu) == [
        "t_s",
        "gx_rad_s",
        "gy_rad_s",
        "gz_rad_s",
        "ax_m_s2",
        "ay_m_s2",
        "az_m_s2",
        "arrival_s",
    ]
    assert list(tracker) == ["t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "arrival_s"]
    assert len(imu["t_s"]) == truth["samples"]["imu"] == 14001
    text = (recording / "setup.yaml").read_text()
    assert (
        "clock_offset_s: 0.0 " in text and "clock_offset_sigma_s: 0.01 " in text
    )  # what the simulation knows, the set-up does not


def test_the_same_seed_gives_the_same_files(recording: Path, tmp_path: Path) -> None:
    again = ["simulate", str(example("large_boom")), "--stream", "--seconds", "1s", "--seed", "3"]
    for name in ("a", "b"):
        assert main([*again, "--out", str(tmp_path / name)]) == 0
    assert all(
        path.read_bytes() == (tmp_path / "b" / path.name).read_bytes() for path in (tmp_path / "a").iterdir()
    )


def test_everything_is_written(run: Path, recording: Path) -> None:
    result = result_of(run)
    assert set(result) == FORMAT and result["format"] == "truing-track-run/1"
    assert {path.name for path in run.iterdir()} >= {"result.json", "report.html", "compensation.csv"}
    rows = columns(run / "compensation.csv")
    assert list(rows)[:3] == ["t_s", "plan_t_s", "made_s"] and list(rows)[-2:] == ["predictor", "status"]
    plan = columns(recording / "plan.csv")
    assert rows["plan_t_s"] == plan["t_s"] and len(rows["t_s"]) == result["rows"]
    assert {
        "x_m",
        "qz",
        "dx_m",
        "drz_rad",
        "flange_x_m",
        "flange_qz",
        "sigma_x_m",
        "sigma_rz_rad",
        "limited",
    } <= set(rows)


def test_corrected_joints_bring_the_tool_where_it_was_corrected_to(run: Path, recording: Path) -> None:
    rows = columns(run / "compensation.csv")
    robot, T_flange_tool = (
        truing.load_robot(example("large_boom")),
        np.asarray(truing.load_setup(recording / "setup.yaml").setup.T_flange_tool),
    )
    at = [k for k, word in enumerate(rows["status"]) if word != "lost" and rows["q1_rad"][k] != ""]
    assert len(at) > 0.95 * sum(word != "lost" for word in rows["status"])

    def values(names: list[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
        return np.array([[float(rows[name][k]) for name in names] for k in at])

    joints, flange = (
        values([f"q{k}_rad" for k in range(1, 5)]),
        values([f"flange_{axis}_m" for axis in "xyz"]),
    )
    wanted = (
        flange
        + rotations_from_quaternions(values([f"flange_q{part}" for part in "wxyz"])) @ T_flange_tool[:3, 3]
    )
    reached = np.array(
        [(truing.forward_kinematics(robot, q)[-1] @ T_flange_tool)[:3, 3] for q in joints]
    )  # the boom's own tool is at its flange
    assert np.abs(reached - wanted).max() < 1e-6
    assert np.abs(np.diff(joints, axis=0)).max() < 0.05  # no jumps


def test_a_row_that_could_not_be_made_is_empty_and_lost(run: Path) -> None:
    rows = columns(run / "compensation.csv")
    made = [word != "lost" for word in rows["status"]]
    assert sum(made) == result_of(run)["made"] > 1300 and not made[-1]
    for name, cells in rows.items():
        for cell, there in zip(cells, made, strict=True):
            assert (cell != "") == there or name in ("t_s", "plan_t_s", "status")
        if name not in ("predictor", "status"):
            assert all(math.isfinite(float(cell)) for cell in cells if cell)


def test_the_answers_are_right(run: Path) -> None:
    result = result_of(run)
    at = next(row for row in result["errors"] if row["horizon_s"] == 0.04)
    assert at["truing"]["rms_m"] < min(
        at[name]["rms_m"] for name in ("hold", "velocity", "fk", "fk_velocity")
    )
    assert (
        result["truth"]["rms_m"] < 0.4 * result["truth"]["without_compensation"]["rms_m"]
        and result["truth"]["inside_3_sigma"] > 0.95
    )
    assert abs(result["clock"]["offset_s"] - 0.005) < 4 * result["clock"]["sigma_s"] + 1e-4
    assert len(result["dropouts"]) == 1 and result["dropouts"][0]["start_s"] == pytest.approx(9.0, abs=0.05)
    assert result["status"]["coasting"] + result["status"]["hold"] == pytest.approx(0.8 / 14, abs=0.02)
    assert not result["shifts"]


def test_the_report_says_what_the_result_says(run: Path) -> None:
    result, page = result_of(run), (run / "report.html").read_text()
    text, charts = visible(page), charts_of(page)
    at = next(row for row in result["errors"] if row["horizon_s"] == 0.04)
    assert (
        "40 ms ahead the receiver was predicted to" in text[:300]
        and f"{1e3 * at['truing']['rms_m']:.2f}"[:3] in text[:300]
    )
    assert (
        text.index("Error of predictions")
        < text.index("Can I trust it?")
        < text.index("The tool, away from its plan")
        < text.index("Status")
    )
    assert {
        "horizons",
        "deviation_x",
        "deviation_y",
        "deviation_z",
        "over_time",
        "status",
        "clock",
        "nis",
    } <= set(charts)
    bars = {trace["name"]: trace for trace in charts["horizons"]["data"]}
    assert bars["truing"]["y"] == pytest.approx([1e3 * row["truing"]["rms_m"] for row in result["errors"]])
    assert "NEES" in text and "://" not in page.split("<script>")[0]


def test_a_horizon_of_its_own_is_graded_too(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(arguments(recording, "--horizon", "60ms", "--learn-modes", "0s", "--out", str(tmp_path / "out")))
        == 0
    )
    result = result_of(tmp_path / "out")
    assert [row["horizon_s"] for row in result["errors"]] == [0.02, 0.04, 0.06, 0.08] and result[
        "truth"
    ] is None
    rows = columns(tmp_path / "out/compensation.csv")
    ahead = [float(t) - float(made) for t, made in zip(rows["t_s"], rows["made_s"], strict=True) if made]
    assert 0.055 < np.median(ahead) < 0.061
    out = capsys.readouterr().out
    assert out.strip().splitlines()[-1] == f"report: {tmp_path / 'out/report.html'}" and "60 ms" in out


def test_without_a_plan_predictions_are_graded_all_the_same(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = arguments(recording, "--json", "--out", str(tmp_path / "out"))
    at = words.index("--plan")
    assert main([*words[:at], *words[at + 2 :]]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (
        result["rows"] == 0
        and result["errors"][1]["truing"]["n"] > 500
        and not (tmp_path / "out/compensation.csv").exists()
    )


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--horizon", "40"], "--horizon: found '40', expected a time with its unit"),
        (["--horizon", "2s"], "--horizon: found '2s', expected a time of at most 1s"),
        (["--learn-modes", "-1s"], "--learn-modes: found '-1s'"),
    ],
)
def test_options_are_checked(
    recording: Path, tmp_path: Path, option: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments(recording, *option, "--out", str(tmp_path / "out"))) == 2
    assert message in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--dropout", "20s"], "--dropout: found '20s', expected a time and how long, such as 20s:2s"),
        (["--station-shift", "5mm"], "--station-shift: found '5mm', expected a time, a length and an angle"),
        (["--seconds", "-3s"], "--seconds: found '-3s', expected a time above 0"),
    ],
)
def test_options_of_the_simulation_are_checked(
    tmp_path: Path, option: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(["simulate", str(example("large_boom")), "--stream", *option, "--out", str(tmp_path / "out")])
        == 2
    )
    assert message in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_bad_input_is_one_line_and_nothing_is_written(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (recording / "imu.csv").read_text().splitlines()
    lines[50], lines[51] = lines[51], lines[50]
    bad = tmp_path / "imu.csv"
    bad.write_text("\n".join(lines) + "\n")
    assert main(arguments(recording, "--out", str(tmp_path / "out"), imu=bad)) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and f"{bad}, line 52, column 't_s': time goes backwards" in error
    assert not (tmp_path / "out").exists()


def test_a_plan_of_another_tool_is_said(recording: Path, tmp_path: Path) -> None:
    plan = truing.load_plan(recording / "plan.csv")
    T = plan.T.copy()
    T[:, :3, 3] += 0.3 * T[:, :3, 0]
    other = tmp_path / "plan.csv"
    save_plan(other, plan.t, T)
    assert main(arguments(recording, "--out", str(tmp_path / "out"), plan=other)) == 0
    assert "the planned tool is 0.3 m from" in " ".join(result_of(tmp_path / "out")["warnings"])


def test_a_tracker_clock_that_jumps_is_said(recording: Path, tmp_path: Path) -> None:
    """By 1 s, seed 3."""
    tracker = truing.load_tracker(recording / "tracker.csv")
    assert tracker.orientation is not None and tracker.arrival is not None
    jumped = tmp_path / "tracker.csv"
    t = tracker.t + (tracker.t > tracker.t.mean())
    save_tracker(jumped, t, tracker.position, tracker.orientation, tracker.arrival)
    assert main(arguments(recording, "--out", str(tmp_path / "out"), tracker=jumped)) == 0
    assert "has the tracker's clock jumped" in " ".join(result_of(tmp_path / "out")["warnings"])


def test_ctrl_c_leaves_nothing(recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import truing

    def interrupted(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(truing, "replay", interrupted)
    done = threading.Event()
    other = threading.Thread(target=done.wait)  # the caller's, who goes on
    other.start()
    try:
        assert main(arguments(recording, "--out", str(tmp_path / "out"))) == 130
    finally:
        done.set()
        other.join()
    assert not (tmp_path / "out").exists() and not list(tmp_path.iterdir())
