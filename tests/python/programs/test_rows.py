# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs that give the joints of a table of measurements: identify and diagnose with --program."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from program_corpus import applied, programs
from program_robots import built, nominal
from truing import InputError
from truing.cli.app import main
from truing.files import load_handeye, load_measurements, save_robot, write_table
from truing.files.brand_frames import NOTATIONS, numbers_from_frame
from truing.files.stream_file import pose_columns
from truing.inverse_kinematics import InverseSolver
from truing.programs import commanded_hand, commanded_joints

ROWS = 40


def driven() -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.radians([0, 10, 0, 0, -60, 0] + rng.uniform(-25, 25, (ROWS, 6)))


def job(points: list[str], moves: list[int]) -> str:
    lines = "".join(f" {k}:J P[{p}] 50% FINE ;\n" for k, p in enumerate(moves, 1))
    texts = "".join(f"P[{k}]{{\n GP1:\n UF : 0, UT : 0,{text}\n}};\n" for k, text in enumerate(points, 1))
    return f"/PROG W\n/MN\n{lines}/POS\n{texts}/END\n"


def joint_text(q: np.ndarray) -> str:
    """The pendant counts J3 from the horizon."""
    shown = np.degrees([q[0], q[1], q[2] - q[1], *q[3:]])
    return " " + ", ".join(f"J{k + 1}= {value:.3f} deg" for k, value in enumerate(shown))


def pose_text(q: np.ndarray) -> str:
    numbers = numbers_from_frame("fanuc", InverseSolver(nominal("fanuc")).forward(q))
    named = zip(NOTATIONS["fanuc"].names, numbers, strict=True)
    values = ", ".join(f"{name} = {value:.3f} {'mm' if name in 'XYZ' else 'deg'}" for name, value in named)
    return f" CONFIG : 'N U T, 0, 0, 0',\n {values}"


def measured(folder: Path, rows: int = ROWS) -> Path:
    """What a tracker saw of the real robot there, without joints."""
    real = InverseSolver(built("fanuc"))
    seen = np.array([real.forward(q)[:3, 3] for q in driven()[:rows]])
    path = folder / "measured.csv"
    write_table(path, {f"{axis}_m": seen[:, k] for k, axis in enumerate("xyz")})
    return path


@pytest.mark.parametrize(("text", "digits"), [(joint_text, 1e-5), (pose_text, 1e-4)])
def test_a_program_gives_the_joints_of_its_moves(tmp_path: Path, text, digits: float) -> None:  # type: ignore[no-untyped-def]
    """Targets that are joints, and targets that are poses, whose joints the nominal robot says."""
    path = tmp_path / "w.ls"
    moves = [2, 1, 3, 1]  # a target that two moves go to has two rows
    path.write_text(job([text(q) for q in driven()[:3]], moves))
    found = np.column_stack(list(commanded_joints(path, nominal("fanuc")).columns.values()))
    assert np.allclose(found, driven()[[1, 0, 2, 0]], atol=digits)


@pytest.mark.parametrize("text", [joint_text, pose_text])
def test_identify_finds_as_much_as_with_the_joints_in_the_table(tmp_path: Path, text) -> None:  # type: ignore[no-untyped-def]
    save_robot(tmp_path / "robot.yaml", nominal("fanuc"))
    program = tmp_path / "w.ls"
    program.write_text(job([text(q) for q in driven()], list(range(1, ROWS + 1))))
    command = ["identify", str(tmp_path / "robot.yaml"), str(measured(tmp_path)), "--program", str(program)]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    errors = json.loads((tmp_path / "out" / "result.json").read_text())["errors"]["test"]
    # Three printed decimals of a degree leave 0.01 mm at a metre.
    assert errors["before"]["mean_m"] > 1e-4 and errors["after"]["mean_m"] < 2e-5


def test_the_table_of_poses_out_is_taken_as_well(tmp_path: Path) -> None:
    write_table(tmp_path / "p.csv", {f"q{k + 1}_rad": column for k, column in enumerate(driven().T)})
    beside = commanded_joints(tmp_path / "p.csv", nominal("fanuc"))
    data = load_measurements(measured(tmp_path), nominal("fanuc"), beside=beside)
    assert np.array_equal(data.joints, driven()) and data.positions is not None


def refusal(folder: Path, program: str, rows: int = ROWS, name: str = "w.ls") -> str:
    (folder / name).write_text(program)
    robot = nominal("fanuc")
    with pytest.raises(InputError) as refused:
        load_measurements(measured(folder, rows), robot, beside=commanded_joints(folder / name, robot))
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_rows_that_are_not_the_programs_moves_are_refused(tmp_path: Path) -> None:
    points = [joint_text(q) for q in driven()]
    moves = list(range(1, ROWS + 1))
    assert "has 39 rows, but" in refusal(tmp_path, job(points, moves), 39)
    assert "has 40 rows, but" in refusal(tmp_path, job(points, [*moves, 1]))
    computed = job(points, moves).replace(" 2:J P[2]", " 2:J PR[2]")
    assert "nor which row was measured there" in refusal(tmp_path, computed)
    assert "has no move to a literal target" in refusal(tmp_path, job(points, []))
    unknown = job([pose_text(q) for q in driven()], moves).replace("UT : 0", "UT : 3")
    assert "tool 3 is not defined" in refusal(tmp_path, unknown)


def test_joints_in_both_places_are_refused(tmp_path: Path) -> None:
    (tmp_path / "w.ls").write_text(job([joint_text(q) for q in driven()[:1]], [1]))
    beside = commanded_joints(tmp_path / "w.ls", nominal("fanuc"))
    (tmp_path / "m.csv").write_text("q1_rad,x_m,y_m,z_m\n0,1,0,1\n")
    with pytest.raises(InputError, match=r"'q1_rad', which .*w\.ls gives as well"):
        load_measurements(tmp_path / "m.csv", nominal("fanuc"), beside=beside)


def test_a_bad_cell_is_still_named_by_its_line(tmp_path: Path) -> None:
    (tmp_path / "w.ls").write_text(job([joint_text(q) for q in driven()[:2]], [1, 2]))
    beside = commanded_joints(tmp_path / "w.ls", nominal("fanuc"))
    (tmp_path / "m.csv").write_text("x_m,y_m,z_m\n1,0,1\n1,0,?\n")
    with pytest.raises(InputError, match="line 3, column 'z_m': found '\\?'"):
        load_measurements(tmp_path / "m.csv", nominal("fanuc"), beside=beside)


def test_handeye_takes_hand_poses_from_a_program(tmp_path: Path) -> None:
    """The table has what the camera saw alone; the camera is found where it is."""
    forward = InverseSolver(nominal("fanuc")).forward
    camera, board = np.eye(4), np.eye(4)
    camera[:3, 3], board[:3, 3] = [0.05, -0.03, 0.1], [0.8, 0.1, 0.2]
    seen = np.array([np.linalg.inv(forward(q) @ camera) @ board for q in driven()[:15]])
    write_table(tmp_path / "board.csv", pose_columns(seen, "board_"))
    (tmp_path / "w.ls").write_text(job([pose_text(q) for q in driven()[:15]], list(range(1, 16))))
    command = ["handeye", str(tmp_path / "board.csv"), "--program", str(tmp_path / "w.ls")]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    data = load_handeye(tmp_path / "board.csv", beside=commanded_hand(tmp_path / "w.ls"))
    assert data.count == 15
    found = json.loads((tmp_path / "out" / "result.json").read_text())["camera"]
    assert np.allclose([found["x_m"], found["y_m"], found["z_m"]], camera[:3, 3], atol=1e-5)
    write_table(tmp_path / "board.csv", pose_columns(seen[:14], "board_"))
    assert main([*command, "--out", str(tmp_path / "few")]) == 2
    assert not (tmp_path / "few").exists()


@pytest.mark.parametrize("path", programs(), ids=lambda path: path.name)
def test_the_first_of_a_targets_moves_is_its_order(path: Path) -> None:
    outcome = applied(path)
    for one in outcome.targets:
        assert bool(one.target.move) == bool(one.target.moves)
        assert not one.target.moves or one.target.moves[0] == one.target.order
