# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses in other programs' files are read as these programs mean them; what is wrong is named with its place,
what was found and what was expected.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from board_images import Floats
from fuzzing import mutated, quick
from handeye_scenes import HandEyeScene, scene, write_scene
from truing import InputError, InputWarning, load_handeye
from truing.cli.app import main
from truing.files import load_stream, pair_rows
from truing.files.other_poses import read_other_poses
from truing.rotations import quaternions_from_rotations

SCENE = scene(8, seed=2)
IN_CELL = scene(8, "eye-to-hand", seed=3)


def lines_of(T: Floats, count: int = 16, separator: str = " ") -> str:
    rows = T.reshape(len(T), 16)[:, :count]
    return "\n".join(separator.join(repr(float(v)) for v in row) for row in rows) + "\n"


def transform(T: Floats) -> dict[str, Any]:
    w, x, y, z = map(float, quaternions_from_rotations(T[None, :3, :3])[0])
    position = dict(zip("xyz", map(float, T[:3, 3]), strict=True))
    return {"translation": position, "rotation": {"x": x, "y": y, "z": z, "w": w}}


def moveit(s: HandEyeScene) -> str:
    samples = [
        {"effector_wrt_world": a.ravel().tolist(), "object_wrt_sensor": b.ravel().tolist()}
        for a, b in zip(s.A, s.B, strict=True)
    ]
    return yaml_text(samples)


def easy_handeye2(s: HandEyeScene, kind: str) -> str:
    """That of a camera in the cell has the base in the hand: handeye_sampler.py looks it up so."""
    hand = np.linalg.inv(s.A) if s.setup == "eye-to-hand" else s.A
    samples = [{"robot": transform(a), "tracking": transform(b)} for a, b in zip(hand, s.B, strict=True)]
    return yaml_text({"parameters": {"name": "x", "calibration_type": kind}, "samples": samples})


def easy_handeye(s: HandEyeScene) -> str:
    hand = np.linalg.inv(s.A) if s.setup == "eye-to-hand" else s.A
    lists = {
        "hand_world_samples": {"transforms": [transform(a) for a in hand]},
        "camera_marker_samples": {"transforms": [transform(b) for b in s.B]},
    }
    return yaml_text({"samples": lists})


def yaml_text(value: Any, indent: str = "") -> str:
    """Block YAML, one key or entry a line."""
    if isinstance(value, list):
        return "".join(
            f"{indent}- {item!r}\n"
            if isinstance(item, float)
            else f"{indent}-\n{yaml_text(item, indent + '  ')}"
            for item in value
        )
    return "".join(
        f"{indent}{key}:\n{yaml_text(item, indent + '  ')}"
        if isinstance(item, (dict, list))
        else f"{indent}{key}: {json.dumps(item)}\n"
        for key, item in value.items()
    )


def ros_csv(T: Floats, message: str = "field.", part: str = "pose", rate: float = 0.5) -> str:
    names = ("position", "orientation") if part == "pose" else ("translation", "rotation")
    header = [
        "%time",
        f"{message}header.seq",
        f"{message}header.stamp",
        f"{message}header.frame_id",
        *(f"{message}{part}.{names[0]}.{axis}" for axis in "xyz"),
        *(f"{message}{part}.{names[1]}.{axis}" for axis in "xyzw"),
    ]
    rows = [",".join(header)]
    for k, t in enumerate(T):
        w, x, y, z = quaternions_from_rotations(t[None, :3, :3])[0]
        stamp = 1_600_000_000_000_000_000 + round(k / rate * 1e9)
        numbers = ",".join(repr(float(v)) for v in (*t[:3, 3], x, y, z, w))
        rows.append(f"{stamp + 5_000_000},{k},{stamp},base,{numbers}")
    return "\n".join(rows) + "\n"


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def refused(message: str, read: Callable[[], Any]) -> None:
    with pytest.raises(InputError) as error, warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        read()
    assert re.search(message, str(error.value)), str(error.value)


# ---- Lines of numbers ----------------------------------------------------------------------------


@pytest.mark.parametrize("count", [16, 12])
@pytest.mark.parametrize("separator", [" ", ",", "; ", "\t"])
def test_lines_of_16_and_12_numbers_are_matrices(tmp_path: Path, count: int, separator: str) -> None:
    path = written(tmp_path / "hand.txt", "# hand\n" + lines_of(SCENE.A, count, separator))
    stream = load_stream(path, "hand")
    assert np.allclose(stream.T, SCENE.A, atol=1e-12) and stream.time is None


def test_matrices_may_take_four_lines_each(tmp_path: Path) -> None:
    text = "\n\n".join("\n".join(" ".join(map(repr, row.tolist())) for row in T) for T in SCENE.A)
    assert np.allclose(load_stream(written(tmp_path / "a.txt", text), "board").T, SCENE.A, atol=1e-12)


def test_matrices_column_by_column_are_read_so_and_it_is_said(tmp_path: Path) -> None:
    path = written(tmp_path / "hand.txt", lines_of(np.swapaxes(SCENE.A, 1, 2)))
    with pytest.warns(InputWarning, match="column by column"):
        assert np.allclose(load_stream(path, "hand").T, SCENE.A, atol=1e-12)


def test_lines_of_eight_are_time_position_and_quaternion_scalar_last(tmp_path: Path) -> None:
    q = quaternions_from_rotations(SCENE.A[:, :3, :3])
    rows = np.column_stack([np.arange(8.0) + 3, SCENE.A[:, :3, 3], q[:, [1, 2, 3, 0]]])
    text = "# timestamp tx ty tz qx qy qz qw\n" + "\n".join(" ".join(map(repr, r.tolist())) for r in rows)
    stream = load_stream(written(tmp_path / "tum.txt", text), "hand")
    assert stream.time is not None and stream.time[0] == 3.0 and np.allclose(stream.T, SCENE.A, atol=1e-12)


def test_faults_in_lines_of_numbers_are_named(tmp_path: Path) -> None:
    def read(text: str) -> Callable[[], Any]:
        return lambda: load_stream(written(tmp_path / "hand.txt", text), "hand")

    good = lines_of(SCENE.A)
    lines = good.splitlines()
    scaled, mirrored, last = SCENE.A.copy(), SCENE.A.copy(), SCENE.A.copy()
    scaled[3, :3, :3] *= 1.1
    mirrored[2, :3, 0] *= -1
    last[1, 3, 3] = 2.0
    refused(
        r"hand\.txt, line 3: found 15 numbers, expected 16",
        read("\n".join([*lines[:2], lines[2].rsplit(" ", 1)[0]])),
    )
    refused(
        r"line 2: found 'none', expected a number", read(lines[0] + "\n" + lines[1].replace(" ", " none ", 1))
    )
    refused(r"line 4: its three columns of rotation are not of unit length", read(lines_of(scaled)))
    refused(r"line 3: the rotation is a mirror", read(lines_of(mirrored)))
    refused(r"line 2: the matrix ends in .* expected its last row 0 0 0 1", read(lines_of(last)))
    refused(r"line 1: found 7 numbers, expected 16 .*a line of names says", read("1 2 3 0 0 0 1\n" * 4))
    refused(r"ends within a matrix: it has 6 lines", read("1 0 0 0\n" * 6))
    refused(r"has 2 poses, expected at least 3", read("\n".join(lines[:2])))
    refused(r"hold the poses of one side.*--board-poses", lambda: load_handeye(tmp_path / "hand.txt"))


# ---- Two files -----------------------------------------------------------------------------------


def run(folder: Path, *arguments: str) -> tuple[int, dict[str, Any]]:
    out = folder / "out"
    code = main(["handeye", *arguments, "--out", str(out)])
    return code, json.loads((out / "result.json").read_text()) if (out / "result.json").exists() else {}


def camera_of(result: dict[str, Any]) -> Floats:
    return np.array([result["camera"][f"{axis}_m"] for axis in "xyz"])


def test_files_without_times_belong_together_row_by_row(tmp_path: Path) -> None:
    s = scene(15, seed=5)
    hand = written(tmp_path / "hand.txt", lines_of(s.A))
    board = written(tmp_path / "board.txt", lines_of(s.B, 12))
    code, result = run(tmp_path, str(hand), "--board-poses", str(board))
    assert code == 0 and np.linalg.norm(camera_of(result) - s.X[:3, 3]) < 2e-3
    assert "clock" not in result
    short = written(tmp_path / "short.txt", lines_of(s.B[:-1]))
    refused(
        r"short\.txt: has 14 poses, expected 15 as in .*hand\.txt: .* row by row",
        lambda: pair_rows(load_stream(hand, "hand"), load_stream(short, "board")),
    )


def test_ros_messages_taken_at_rest_belong_together_row_by_row(tmp_path: Path) -> None:
    s = scene(15, seed=6)
    hand = written(tmp_path / "hand.csv", ros_csv(s.A))
    board = written(tmp_path / "board.csv", ros_csv(s.B, "", "transform"))
    code, result = run(tmp_path, str(hand), "--board-poses", str(board))
    assert code == 0 and np.linalg.norm(camera_of(result) - s.X[:3, 3]) < 2e-3 and "clock" not in result


@pytest.mark.parametrize(
    ("message", "part"),
    [("field.", "pose"), ("", "pose"), ("/tracker/pose/", "pose"), ("transforms[0].", "transform")],
)
def test_ros_messages_are_read_scalar_last_with_the_stamp_of_their_header(
    tmp_path: Path, message: str, part: str
) -> None:
    text = ros_csv(SCENE.A, message, part)
    if "/" in message:
        text = text.replace("pose.position.", "pose/position/").replace(
            "pose.orientation.", "pose/orientation/"
        )
    stream = load_stream(written(tmp_path / "a.csv", text), "hand")
    assert np.allclose(stream.T, SCENE.A, atol=1e-12)
    assert stream.time is not None and np.allclose(stream.time - 1.6e9, 2 * np.arange(8), atol=1e-6)


def test_seconds_and_nanoseconds_are_one_time(tmp_path: Path) -> None:
    rows = [
        "header.stamp.secs,header.stamp.nsecs,pose.position.x,pose.position.y,pose.position.z,"
        "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w"
    ]
    rows += [f"{k},{500_000_000},{k},0,0,0,0,0,1" for k in range(4)]
    stream = load_stream(written(tmp_path / "a.csv", "\n".join(rows)), "hand")
    assert stream.time is not None and np.allclose(stream.time, np.arange(4) + 0.5)


def _names_of(message: str) -> str:
    names = [f"{message}.position.{axis}" for axis in "xyz"]
    return ",".join([*names, *(f"{message}.orientation.{axis}" for axis in "xyzw"), "time"])


def test_faults_in_ros_messages_are_named(tmp_path: Path) -> None:
    def read(text: str) -> Callable[[], Any]:
        return lambda: load_stream(written(tmp_path / "a.csv", text), "hand")

    good = ros_csv(SCENE.A)
    refused(
        r"line 4, column 'field\.header\.frame_id': found the frame 'tool', expected 'base'",
        read(re.sub(r"(\n1.*\n1.*\n1.*),base,", r"\1,tool,", good, count=1)),
    )
    refused(
        r"found 2 poses in each row \(other\.pose, field\)",
        read(
            good.replace("field.pose", "field")
            .replace("%time", _names_of("other.pose"))
            .replace("\n1", "\n0,0,0,0,0,0,0,1")
        ),
    )
    lines = good.splitlines()
    cells = lines[3].split(",")
    cells[-1] = "2.0"
    refused(
        r"line 4: found the quaternion .* of length",
        read("\n".join([*lines[:3], ",".join(cells), *lines[4:]])),
    )
    again = "\n".join([*lines[:3], lines[2], *lines[3:]])
    refused(r"the time of pose 2 \(from 0\), .* is not later", read(again))


# ---- Samples -------------------------------------------------------------------------------------


@pytest.mark.parametrize("s", [SCENE, IN_CELL], ids=["eye-in-hand", "eye-to-hand"])
def test_samples_of_moveit_are_hand_in_base_and_board_in_camera(tmp_path: Path, s: HandEyeScene) -> None:
    data = load_handeye(written(tmp_path / "samples.yaml", moveit(s)))
    assert np.allclose(data.poses.T_base_hand, s.A, atol=1e-12)
    assert np.allclose(data.poses.T_camera_board, s.B, atol=1e-12) and data.convention == "samples of MoveIt"


@pytest.mark.parametrize(("s", "kind"), [(SCENE, "eye_in_hand"), (IN_CELL, "eye_on_base")])
def test_samples_of_easy_handeye_are_turned_round_where_the_camera_stands_in_the_cell(
    tmp_path: Path, s: HandEyeScene, kind: str
) -> None:
    setup: Any = s.setup
    told = written(tmp_path / "a.samples", easy_handeye2(s, kind))
    untold = written(tmp_path / "b.samples", easy_handeye2(s, ""))
    first = written(tmp_path / "c.yaml", easy_handeye(s))
    for data in (load_handeye(told), load_handeye(untold, setup=setup), load_handeye(first, setup=setup)):
        assert np.allclose(data.poses.T_base_hand, s.A, atol=1e-9)
        assert np.allclose(data.poses.T_camera_board, s.B, atol=1e-9)
    other: Any = "eye-in-hand" if setup == "eye-to-hand" else "eye-to-hand"
    refused(
        rf"line 1: .*a camera {setup}, expected {other}: say --setup {setup}",
        lambda: load_handeye(told, setup=other),
    )


def test_samples_are_solved_as_they_are(tmp_path: Path) -> None:
    s = scene(15, "eye-to-hand", seed=7)
    path = written(tmp_path / "cell.samples", easy_handeye2(s, "eye_on_base"))
    code, result = run(tmp_path, str(path), "--setup", "eye-to-hand")
    assert code == 0 and np.linalg.norm(camera_of(result) - s.X[:3, 3]) < 3e-3
    assert result["convention"]["orientation"] == "samples of easy_handeye2"


def test_faults_in_samples_are_named(tmp_path: Path) -> None:
    def read(text: str, name: str = "a.samples") -> Callable[[], Any]:
        return lambda: load_handeye(written(tmp_path / name, text))

    good = easy_handeye2(SCENE, "eye_in_hand")
    refused(
        r"line \d+: samples\[2\] robot translation x: found 'far', expected a finite number",
        read(_third_x(good, '"far"')),
    )
    refused(
        r"samples\[0\]: found the keys .* expected one called robot", read(good.replace("robot:", "arm:", 1))
    )
    refused(
        r"line 3: parameters calibration_type: found 'eye_up', expected eye_in_hand or eye_on_base",
        read(good.replace("eye_in_hand", "eye_up")),
    )
    refused(
        r"found the quaternion .* of length 3",
        read(
            re.sub(
                r"rotation:\n( +)x: .*\n +y: .*\n +z: .*\n +w: .*\n",
                r"rotation:\n\1x: 3.0\n\1y: 0\n\1z: 0\n\1w: 0\n",
                good,
                count=1,
            )
        ),
    )
    many = moveit(SCENE)
    refused(
        r"\[1\] object_wrt_sensor: found a list of 15, expected a list of 16 numbers",
        read(_without_last(many, 4)),
    )
    refused(
        r"found the result of a calibration .* give the file of samples",
        read(yaml_text({"parameters": {"name": "x"}, "transform": transform(SCENE.X)})),
    )
    refused(r"found a launch file", read('<launch>\n  <node args="1 2 3"/>\n</launch>', "camera.launch"))
    refused(r"found the keys robots, expected samples of", read("robots: 3\n"))
    refused(
        r"a board was named, but samples of easy_handeye2 name no images",
        lambda: load_handeye(written(tmp_path / "a.samples", good), board="chessboard:9x6:25mm"),
    )


def _third_x(text: str, value: str) -> str:
    parts = re.split(r"( x: [^\n]*\n)", text)
    parts[2 * 8 + 1] = f" x: {value}\n"  # four a sample: robot and tracking, each twice
    return "".join(parts)


def _without_last(text: str, block: int) -> str:
    """The block-th list of numbers without its last."""
    parts = re.split(r"((?: +- [^\n]*\n){16})", text)
    place = 2 * (block - 1) + 1
    parts[place] = parts[place].rsplit("\n", 2)[0] + "\n"
    return "".join(parts)


# ---- OpenCV --------------------------------------------------------------------------------------


def storage(path: Path, matrices: dict[str, Any]) -> Path:
    cv2 = pytest.importorskip("cv2")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in matrices.items():
        if isinstance(value, list):
            file.startWriteStruct(name, cv2.FileNode_SEQ)
            for item in value:
                file.write("", item)
            file.endWriteStruct()
        else:
            file.write(name, value)
    file.release()
    return path


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
def test_matrices_of_opencv_are_found_by_the_names_of_calibratehandeye(tmp_path: Path, suffix: str) -> None:
    s = SCENE
    layouts: list[dict[str, Any]] = [
        {
            "R_gripper2base": [T[:3, :3].copy() for T in s.A],
            "t_gripper2base": [T[:3, 3:].copy() for T in s.A],
            "R_target2cam": [T[:3, :3].copy() for T in s.B],
            "t_target2cam": [T[:3, 3:].copy() for T in s.B],
        },
        {
            "R_gripper2base": s.A[:, :3, :3].reshape(-1, 3),
            "t_gripper2base": s.A[:, :3, 3].copy(),
            "T_target2cam": s.B.reshape(-1, 4),
        },
        {"T_base2gripper": list(np.linalg.inv(s.A)), "T_cam2target": list(np.linalg.inv(s.B))},
        {
            **{f"T_gripper2base_{k}": T for k, T in enumerate(s.A)},
            **{f"T_target2cam_{k}": T for k, T in enumerate(s.B)},
        },
        {"gripper2base": s.A.reshape(-1, 16), "extrinsic_parameters": _vectors(s.B)},
    ]
    for k, layout in enumerate(layouts):
        data = load_handeye(storage(tmp_path / f"{k}.{suffix}", layout))
        assert np.allclose(data.poses.T_base_hand, s.A, atol=1e-9), k
        assert np.allclose(data.poses.T_camera_board, s.B, atol=1e-9), k
    one = load_stream(storage(tmp_path / f"one.{suffix}", {"poses": list(s.A)}), "board")
    assert np.allclose(one.T, s.A, atol=1e-12)


def _vectors(T: Floats) -> Floats:
    cv2 = pytest.importorskip("cv2")
    return np.array([[*cv2.Rodrigues(t[:3, :3].copy())[0].ravel(), *t[:3, 3]] for t in T])


def test_faults_in_matrices_of_opencv_are_named(tmp_path: Path) -> None:
    def read(layout: dict[str, Any]) -> Callable[[], Any]:
        return lambda: load_handeye(storage(tmp_path / "a.yml", layout))

    good = {"T_gripper2base": list(SCENE.A), "T_target2cam": list(SCENE.B)}
    bad = SCENE.B.copy()
    bad[3, 0, 0] += 0.2
    refused(
        r"a\.yml, node 'T_target2cam', pose 3: its three columns", read(good | {"T_target2cam": list(bad)})
    )
    refused(r"has 8 poses of the hand, but 7 of the board", read(good | {"T_target2cam": list(SCENE.B[:7])}))
    refused(
        r"found R_gripper2base without positions",
        read({"R_gripper2base": [T[:3, :3].copy() for T in SCENE.A]}),
    )
    refused(
        r"with poses of the hand alone, expected poses of the board", read({"T_gripper2base": list(SCENE.A)})
    )
    refused(r"found the nodes camera_matrix, expected R_gripper2base", read({"camera_matrix": np.eye(3)}))
    text = storage(tmp_path / "a.yml", good).read_text()
    for found, said, message in (
        ("cols: 4", "cols: 4000000", "has 16 numbers, expected 4 x 4000000"),
        ("rows: 4", "rows: -4", "has 16 numbers, expected -4 x 4"),
        ("[ ", "[ .Nan, ", "has 17 numbers"),
    ):
        written(tmp_path / "b.yml", text.replace(found, said, 1))
        refused(rf"b\.yml.*{message}", lambda: load_handeye(tmp_path / "b.yml"))
    deep = written(tmp_path / "deep.json", '{"a": ' + "[" * 100_000)
    refused(r"deep\.json, line 1: is nested too deeply", lambda: load_handeye(deep))


# ---- Any file ------------------------------------------------------------------------------------


def test_tables_with_named_columns_are_left_to_their_reader(tmp_path: Path) -> None:
    assert read_other_poses(write_scene(tmp_path / "poses.csv", SCENE)) is None
    assert read_other_poses(write_scene(tmp_path / "poses.parquet", SCENE)) is None
    assert read_other_poses(tmp_path / "missing.csv") is None


FEW = scene(3, seed=1)
FILES = {
    "a.txt": lines_of(FEW.A),
    "a.csv": ros_csv(FEW.A),
    "a.yaml": moveit(FEW),
    "a.samples": easy_handeye2(FEW, "eye_in_hand"),
    "b.yaml": easy_handeye(FEW),
    "c.json": json.dumps({"T_gripper2base": FEW.A.tolist(), "T_target2cam": FEW.B.tolist()}),
}


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_give_poses_or_an_input_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / name

    @quick
    @given(mutated(FILES[name].encode()))
    def check(data: bytes) -> None:
        path.write_bytes(data)
        for read in (lambda: load_handeye(path), lambda: load_stream(path, "board")):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    found: Any = read()
                except InputError as error:
                    assert str(path) in str(error)
                else:
                    assert np.isfinite(found.T if hasattr(found, "T") else found.poses.T_base_hand).all()

    check()
