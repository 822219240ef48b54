# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing handeye` keeps the contract of the command line: the truth within its standard errors, or a refusal
that says what to do; never silence.
"""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from board_images import CAMERA, Floats, board_poses, frame, write_images
from handeye_scenes import CAMERA_IN_HAND, HandEyeScene, columns_of, scene, write_csv, write_scene
from tables import columns
from truing.cli import main
from truing.examples import example
from truing.hand_eye import (
    HandEyeOptions,
    HandEyePoses,
    handeye_closed_form,
    handeye_plan,
    handeye_readings,
    project,
)
from truing.rotations import rotations_from_quaternions

FORMAT = {
    "format",
    "version",
    "setup",
    "method",
    "status",
    "message",
    "poses",
    "camera",
    "board",
    "covariance",
    "working_point",
    "residuals",
    "rejected_poses",
    "observability",
    "convention",
    "noise",
    "errors",
    "board_scale",
    "next_poses",
    "solver",
    "seed",
    "warnings",
}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(s: HandEyeScene | Path, *options: str, **more: Any) -> tuple[int, dict[str, Any]]:
    path = s if isinstance(s, Path) else write_scene(Path("poses.csv"), s, **more)
    setup = [] if isinstance(s, Path) else ["--setup", s.setup]
    code = main(["handeye", str(path), *setup, "--out", "found", *options])
    return code, json.loads(Path("found/result.json").read_text())


def frame_of(found: dict[str, float]) -> Floats:
    T = np.eye(4)
    T[:3, :3] = rotations_from_quaternions(np.array([[found[name] for name in ("qw", "qx", "qy", "qz")]]))[0]
    T[:3, 3] = [found[f"{axis}_m"] for axis in "xyz"]
    return T


def off(found: Floats, true: Floats) -> tuple[float, float]:
    """[m], [rad]"""
    D = np.linalg.inv(true) @ found
    return float(np.linalg.norm(D[:3, 3])), math.acos(float(np.clip((np.trace(D[:3, :3]) - 1) / 2, -1, 1)))


# ---- What is written -----------------------------------------------------------------------------


@pytest.mark.parametrize("setup", ["eye-in-hand", "eye-to-hand"])
@pytest.mark.parametrize("method", ["refined", "closed-form"])
def test_the_camera_is_found_and_everything_is_written(
    setup: str, method: str, capsys: pytest.CaptureFixture[str]
) -> None:
    s = scene(30, setup, seed=4)
    code, result = run(s, "--method", method, set=["test" if k % 5 == 0 else "train" for k in range(30)])
    assert code == 0
    assert {path.name for path in Path("found").iterdir()} == {"result.json", "report.html", "residuals.csv"}
    assert set(result) >= FORMAT - ({"solver"} if method == "closed-form" else set())
    assert (result["format"], result["setup"], result["method"], result["status"]) == (
        "truing-handeye/1",
        setup,
        method,
        "done",
    )
    assert (
        result["camera"]["in"] == ("hand" if setup == "eye-in-hand" else "base")
        and result["board"]["in"] != result["camera"]["in"]
    )
    limit = (1e-3, 3e-3) if method == "refined" else (3e-3, 6e-3)
    for name, true in (("camera", s.X), ("board", s.Y)):
        position, rotation = off(frame_of(result[name]), true)
        assert position < limit[0] and rotation < limit[1]
    assert result["errors"]["test"]["n"] == 6 and result["errors"]["left_out"]["n"] == 24
    out = capsys.readouterr().out
    assert out.strip().splitlines()[-1] == "report: found/report.html"
    assert f"{result['camera']['x_m'] * 1e3:.3f} mm" in out


def test_standard_errors_agree_with_the_covariance_and_cover_the_truth() -> None:
    z = []
    for seed in range(12):
        s = scene(25, seed=seed)
        _, result = run(s)
        found = result["camera"]
        covariance = np.array(result["covariance"]["camera"])
        assert [found["sigma"][name] for name in result["covariance"]["of"]] == pytest.approx(
            np.sqrt(np.diag(covariance)).tolist(), rel=1e-9
        )
        off_by = np.array([found[f"{axis}_m"] for axis in "xyz"]) - s.X[:3, 3]
        z.extend(off_by / np.sqrt(np.diag(covariance))[:3])
        point = np.array(result["working_point"]["covariance_m2"])
        assert result["working_point"]["sigma_m"] == pytest.approx(math.sqrt(np.trace(point) / 3), rel=1e-9)
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.8


def test_intervals_are_students_where_the_noise_was_found() -> None:
    _, found = run(scene(10, seed=61))
    _, many = run(scene(40, seed=61))
    _, told = run(scene(10, seed=61), "--hand-sigma", "0.1mm,0.05deg", "--camera-sigma", "0.5mm,0.1deg")
    for of in ("camera", "board"):
        few, more = found[of]["degrees_of_freedom"], many[of]["degrees_of_freedom"]
        assert few.keys() == found[of]["sigma"].keys()
        assert all(5 < few[name] < 60 < more[name] for name in few)
        assert told[of]["degrees_of_freedom"] == dict.fromkeys(few)


def test_residuals_tell_the_same_as_result_json() -> None:
    _, result = run(scene(20))
    table = columns("found/residuals.csv")
    assert (
        [int(pose) for pose in table["pose"]] == [r["pose"] for r in result["residuals"]] == list(range(20))
    )
    for name in ("position_m", "rotation_rad", "position_left_out_m", "rotation_left_out_rad", "distance"):
        assert [float(value) for value in table[name]] == pytest.approx(
            [r[name] for r in result["residuals"]]
        )
    left_out = np.array([r["position_left_out_m"] for r in result["residuals"]])
    assert result["errors"]["left_out"]["rms_m"] == pytest.approx(
        float(np.sqrt(np.mean(left_out**2))), rel=1e-6
    )


def test_the_working_point_is_where_it_was_asked_for() -> None:
    _, near = run(scene(20), "--working-point", "0,0,300mm")
    _, far = run(scene(20), "--working-point", "0.1m,0,2m")
    assert near["working_point"]["in_camera_m"] == pytest.approx([0, 0, 0.3]) and far["working_point"][
        "in_camera_m"
    ] == pytest.approx([0.1, 0, 2])
    assert far["working_point"]["sigma_m"] > 1.5 * near["working_point"]["sigma_m"]


def test_noise_that_is_given_is_used() -> None:
    _, found = run(scene(20))
    _, given = run(scene(20), "--hand-sigma", "1mm,0.2deg", "--camera-sigma", "3mm,8mrad")
    assert found["noise"]["estimated"] and not given["noise"]["estimated"]
    assert given["noise"]["hand_rad"] == pytest.approx(math.radians(0.2))
    assert given["camera"]["sigma"]["x_m"] > 3 * found["camera"]["sigma"]["x_m"]


def test_json_is_all_that_is_printed_and_the_same_data_give_the_same(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, first = run(scene(12), "--json")
    assert json.loads(capsys.readouterr().out) == first
    report = Path("found/report.html").read_bytes()
    _, again = run(scene(12), "--json")
    assert again == first and Path("found/report.html").read_bytes() == report


# ---- Bad poses, and what the data cannot say -----------------------------------------------------


def test_bad_poses_are_listed_with_their_cause(capsys: pytest.CaptureFixture[str]) -> None:
    s = scene(24, "eye-to-hand", seed=2)
    A = s.A.copy()
    A[7, 1, 3] += 0.405
    code, result = run(dataclasses.replace(s, A=A))
    assert code == 0 and [p["pose"] for p in result["rejected_poses"]] == [7]
    assert "405 mm" in result["rejected_poses"][0]["cause"]
    assert "rejected: pose 7: " in capsys.readouterr().out
    table = columns("found/residuals.csv")
    assert [k for k, rejected in enumerate(table["rejected"]) if rejected == "1"] == [7] and table["cause"][
        7
    ] == result["rejected_poses"][0]["cause"]
    code, kept = run(dataclasses.replace(s, A=A), "--keep-all")
    assert kept["rejected_poses"] == []


@pytest.mark.parametrize(
    ("turns", "advice"), [(0.5, "rotate about a second one"), (0.0, "the hand did not turn")]
)
def test_motions_that_do_not_show_the_camera_are_refused_with_what_to_do(
    turns: float, advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, result = run(scene(20, one_axis=True, turns=turns))
    captured = capsys.readouterr()
    assert code == 1
    assert result["status"] == "not observable" and "camera" not in result and "covariance" not in result
    assert advice in result["observability"]["unobservable"][0]["advice"]
    assert advice in captured.out and "not observable" in captured.err
    assert "What to do" in Path("found/report.html").read_text()


def test_a_known_height_makes_one_axis_enough() -> None:
    s = scene(20, one_axis=True, hand=(2e-5, 5e-5), camera=(5e-5, 1e-4), seed=5)
    _, refused = run(s)
    axis = np.array(refused["observability"]["unobservable"][0]["direction"])
    code, result = run(s, "--known-height", f"{1e3 * float(axis @ CAMERA_IN_HAND[:3, 3]):.6f}mm")
    assert code == 0
    assert off(frame_of(result["camera"]), s.X)[0] < 3e-3


def test_poses_that_are_inverted_are_recognised_and_can_be_read_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    s = scene(24, "eye-to-hand", seed=3)
    inverted = dataclasses.replace(s, A=np.linalg.inv(s.A))
    code, result = run(inverted)
    captured = capsys.readouterr()
    assert code == 1 and result["status"] == "not closing" and "camera" not in result
    readings = {reading["reading"] for reading in result["convention"]["other_readings"]}
    assert "hand-inverted" in readings
    assert (
        "--reading hand-inverted" in captured.out
        and "--reading hand-inverted" in Path("found/report.html").read_text()
    )
    code, result = run(inverted, "--reading", "hand-inverted")
    assert code == 0 and result["convention"]["reading"] == "hand-inverted"
    assert off(frame_of(result["camera"]), s.X)[0] < 1.5e-3


def test_the_other_set_up_is_proposed_as_the_option_that_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    s = scene(24, "eye-to-hand", seed=3)
    path = write_scene(Path("poses.csv"), s)
    code, result = run(path, "--setup", "eye-in-hand")
    captured = capsys.readouterr()
    assert code == 1 and result["status"] == "not closing" and "camera" not in result
    best = result["convention"]["other_readings"][0]
    assert best["reading"] == "other-setup" and best["option"] == "--setup eye-to-hand"
    assert "the set-up is eye-to-hand, not eye-in-hand" in captured.err
    assert (
        "--setup eye-to-hand" in captured.out
        and "<code>--setup eye-to-hand</code>" in Path("found/report.html").read_text()
    )
    assert main(["handeye", str(path), "--reading", "other-setup", "--out", "elsewhere"]) == 2
    assert "give the set-up eye-to-hand" in capsys.readouterr().err and not Path("elsewhere").exists()


def test_poses_that_do_not_belong_together_are_no_camera() -> None:
    s = scene(20, seed=6)
    code, result = run(dataclasses.replace(s, A=s.A[np.random.default_rng(1).permutation(20)]))
    assert code == 1 and result["status"] == "not closing" and "camera" not in result


# ---- Images --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def imaged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Floats]:
    """poses.csv with images of a dot grid, which may be read from either end; and the truth."""
    pytest.importorskip("cv2")
    folder = tmp_path_factory.mktemp("imaged")
    board = truing.files.parse_board("circles:8x5:25mm")
    seen = board_poses(board, 14, seed=9)
    Y = frame([0.6, 0.1, 0.05], [3.0, 0.2, 0.1])
    rng = np.random.default_rng(0)
    hands = []
    for B in seen:
        A = Y @ np.linalg.inv(CAMERA_IN_HAND @ B)
        A[:3, 3] += rng.normal(0, 5e-5, 3)
        hands.append(A)
    names = write_images(folder, board, seen)
    truing.save_camera(folder / "camera.yaml", CAMERA)
    write_csv(folder / "poses.csv", {**columns_of("hand", np.array(hands)), "image": names})
    return folder, CAMERA_IN_HAND


def test_images_give_the_camera_and_its_own_values(imaged: tuple[Path, Floats]) -> None:
    folder, true = imaged
    code, result = run(folder / "poses.csv", "--board", "circles:8x5:25mm")
    assert code == 0
    assert {path.name for path in Path("found").iterdir()} == {
        "result.json",
        "report.html",
        "residuals.csv",
        "camera.yaml",
    }
    assert off(frame_of(result["camera"]), true)[0] < 3e-3
    found = truing.load_camera("found/camera.yaml")
    assert [found.fx, found.fy] == pytest.approx([CAMERA.fx, CAMERA.fy], rel=6e-3)
    assert result["images"]["found"] == 14 and not result["images"]["camera_given"]
    assert all(r["pixels"] >= 0 and r["image"] == f"images/{r['pose']}.png" for r in result["residuals"])
    assert {"image", "rms_px", "rms_corrected_px"} <= set(columns("found/residuals.csv"))


def test_a_camera_that_is_given_is_kept_unless_it_is_to_be_refined(imaged: tuple[Path, Floats]) -> None:
    folder, true = imaged
    options = ["--board", "circles:8x5:25mm", "--camera", str(folder / "camera.yaml")]
    code, result = run(folder / "poses.csv", *options)
    assert code == 0 and not Path("found/camera.yaml").exists()
    assert off(frame_of(result["camera"]), true)[0] < 1.5e-3
    assert result["noise"]["pixel"] < 0.2
    run(folder / "poses.csv", *options, "--refine-camera")
    assert Path("found/camera.yaml").exists()


def test_a_wrong_size_of_the_board_is_said(imaged: tuple[Path, Floats]) -> None:
    folder, _ = imaged
    code, result = run(
        folder / "poses.csv", "--board", "circles:8x5:26.5mm", "--camera", str(folder / "camera.yaml")
    )
    if code == 0:
        assert result["board_scale"]["value"] == pytest.approx(25 / 26.5, abs=0.02)
        assert any("check the size of its squares" in warning for warning in result["warnings"])
    else:
        assert result["status"] == "not closing"


# ---- Clocks, plan, kinematics --------------------------------------------------------------------


def moving(
    seconds: float, rate: float, offset: float = 0.0, *, still: bool = False, seed: int = 0
) -> tuple[Floats, Floats, Floats]:
    """Times, hand poses and board poses of an uneven motion; `offset` is added to the times at which the
    poses are taken.
    """
    t = np.arange(0, seconds, 1 / rate)
    rng = np.random.default_rng(5)  # of the motion: the same for every record of it
    speed, phase = rng.uniform(0.7, 4.0, (6, 4)), rng.uniform(0, 7, (6, 4))
    Y = frame([0.6, 0.0, 0.0], [3.1, 0, 0])
    noise = np.random.default_rng(seed)
    A, B = [], []
    for moment in t + offset:
        swing = np.sin(speed * moment + phase).mean(axis=1) * (0 if still else 1)
        T = frame(np.array([0.5, 0, 0.4]) + 0.15 * swing[:3], 0.8 * swing[3:]) @ frame(
            [0, 0, 0], [3.0, 0.1, 0.0]
        )
        A.append(T)
        seen = np.linalg.inv(T @ CAMERA_IN_HAND) @ Y
        seen[:3, 3] += noise.normal(0, 1e-4, 3)
        B.append(seen)
    return t, np.array(A), np.array(B)


def test_streams_with_clocks_of_their_own_are_brought_together() -> None:
    t, A, _ = moving(20, 100)
    s, _, B = moving(16, 25, offset=2.3)
    write_csv(Path("hand.csv"), {"t_s": t, **columns_of("hand", A)})
    write_csv(Path("board.csv"), {"t_s": s, **columns_of("board", B)})
    code, result = run(Path("hand.csv"), "--board-poses", "board.csv")
    assert code == 0
    assert result["clock"]["offset_s"] == pytest.approx(2.3, abs=3e-3)
    assert off(frame_of(result["camera"]), CAMERA_IN_HAND)[0] < 1e-3


def test_records_without_motion_have_no_offset_and_say_so(capsys: pytest.CaptureFixture[str]) -> None:
    t, A, _ = moving(5, 50, still=True)
    A = np.array(
        [
            A[k]
            @ frame(
                np.random.default_rng(k).normal(0, 1e-4, 3), np.random.default_rng(k + 999).normal(0, 1e-4, 3)
            )
            for k in range(len(A))
        ]
    )
    s, _, B = moving(5, 50, still=True)
    write_csv(Path("hand.csv"), {"t_s": t, **columns_of("hand", A)})
    write_csv(Path("board.csv"), {"t_s": s, **columns_of("board", B)})
    code, result = run(Path("hand.csv"), "--board-poses", "board.csv")
    assert code == 1 and result["status"] == "clock not found" and "camera" not in result
    assert result["message"] in capsys.readouterr().err


def test_next_poses_shrink_the_error_and_do_not_outlive_their_run() -> None:
    _, result = run(scene(8), "--plan", "4")
    assert len(result["next_poses"]) == 4
    sigmas = [result["working_point"]["sigma_m"], *(p["working_point_sigma_m"] for p in result["next_poses"])]
    assert (
        all(after <= before * (1 + 1e-9) for before, after in zip(sigmas, sigmas[1:], strict=False))
        and sigmas[-1] < 0.95 * sigmas[0]
    )
    table = columns("found/next_poses.csv")
    assert (
        list(table)[:7] == ["hand_x_m", "hand_y_m", "hand_z_m", "hand_qw", "hand_qx", "hand_qy", "hand_qz"]
        and len(table["hand_x_m"]) == 4
    )
    run(scene(8))
    assert not Path("found/next_poses.csv").exists()


def test_camera_and_robot_are_found_together() -> None:
    robot = truing.load_robot(example("ur10"))
    rng = np.random.default_rng(3)
    true = robot.copy()
    for joint in true.joints:
        joint.offset = float(rng.normal(0, 4e-3))
    Y = frame([0.2, -0.9, -0.3], [0.3, 0, 0])
    joints, A, B = [], [], []
    while len(joints) < 50:
        q = np.array([0.4, -1.4, 1.6, -1.7, -1.5, 0.3]) + rng.uniform(-0.5, 0.5, 6)
        T_true, T_nominal = (truing.forward_kinematics(r, q)[-1] for r in (true, robot))
        seen = np.linalg.inv(np.asarray(T_true) @ CAMERA_IN_HAND) @ Y
        joints.append(q)
        A.append(np.asarray(T_nominal))
        seen[:3, 3] += rng.normal(0, 1e-4, 3)
        B.append(seen)
    s = HandEyeScene("eye-in-hand", np.array(A), np.array(B), CAMERA_IN_HAND, Y)
    q_columns = {f"q{k + 1}_rad": np.array(joints)[:, k] for k in range(6)}
    code, result = run(s, "--with-kinematics", str(example("ur10")), "--free", "*.offset", **q_columns)
    assert code == 0
    errors = result["kinematics"]["errors"]["train"]
    assert errors["after"]["rms_m"] < 0.3 * errors["before"]["rms_m"]
    assert truing.load_robot("found/robot.yaml").joint(robot.joints[2].name).offset == pytest.approx(
        true.joints[2].offset, abs=3e-4
    )


# ---- Bad input -----------------------------------------------------------------------------------

BAD = [
    ["handeye"],
    ["handeye", "missing.csv"],
    ["handeye", "poses.csv", "--setup", "eye-on-stalk"],
    ["handeye", "poses.csv", "--method", "guess"],
    ["handeye", "poses.csv", "--board", "chessboard:9x6:25mm"],
    ["handeye", "poses.csv", "--board", "chessboard"],
    ["handeye", "poses.csv", "--camera", "camera.yaml"],
    ["handeye", "poses.csv", "--refine-camera"],
    ["handeye", "poses.csv", "--pixel-sigma", "0.2px"],
    ["handeye", "images.csv", "--board", "chessboard:9x6:25mm", "--camera-sigma", "1mm,1mrad"],
    ["handeye", "images.csv", "--board", "chessboard:9x6:25mm", "--pixel-sigma", "0.2"],
    ["handeye", "images.csv", "--board", "chessboard:9x6:25mm", "--camera", "missing.yaml"],
    ["handeye", "images.csv"],
    ["handeye", "poses.csv", "--hand-sigma", "0.1mm"],
    ["handeye", "poses.csv", "--hand-sigma", "0.1,0.05deg"],
    ["handeye", "poses.csv", "--hand-sigma", "0mm,0.05deg"],
    ["handeye", "poses.csv", "--hand-sigma=-1mm,0.05deg"],
    ["handeye", "poses.csv", "--working-point", "0,0,0.8"],
    ["handeye", "poses.csv", "--working-point", "0,0"],
    ["handeye", "poses.csv", "--working-point", "0,0,8kg"],
    ["handeye", "poses.csv", "--working-point", "x,y,zmm"],
    ["handeye", "poses.csv", "--known-height", "0.85"],
    ["handeye", "poses.csv", "--angles", "XYZ"],
    ["handeye", "poses.csv", "--reading", "upside-down"],
    ["handeye", "poses.csv", "--plan", "-1"],
    ["handeye", "poses.csv", "--with-kinematics", str(example("ur10"))],
    ["handeye", "poses.csv", "--with-kinematics", "missing.yaml"],
    ["handeye", "poses.csv", "--free", "J2.*"],
    ["handeye", "poses.csv", "--board-poses", "missing.csv"],
    ["handeye", "poses.csv", "--board-poses", "poses.csv"],
    ["handeye", "poses.csv", "--board-poses", "poses.csv", "--board", "chessboard:9x6:25mm"],
    ["handeye", "two.csv"],
    ["handeye", str(example("ur10"))],
]


@pytest.mark.parametrize(
    "arguments", BAD, ids=[" ".join(a[1:]).replace(str(example("ur10")), "ROBOT") or "none" for a in BAD]
)
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    s = scene(6)
    write_scene(Path("poses.csv"), s)
    write_csv(Path("images.csv"), {**columns_of("hand", s.A), "image": [f"{k}.png" for k in range(6)]})
    write_scene(Path("two.csv"), dataclasses.replace(s, A=s.A[:2], B=s.B[:2]))
    truing.save_camera("camera.yaml", CAMERA)
    before = sorted(Path().iterdir())
    code = main(arguments)
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert (
        captured.err.startswith("truing: ") and captured.err.count("\n") == 1 and captured.err.endswith("\n")
    )
    assert sorted(Path().iterdir()) == before


# ---- In Python -----------------------------------------------------------------------------------


def test_python_raises_where_the_data_do_not_decide_and_hands_the_result_over() -> None:
    s = scene(20, one_axis=True)
    poses = HandEyePoses(s.A, s.B)
    with pytest.raises(truing.UndecidedError, match="not observable") as error:
        truing.handeye(poses)
    assert error.value.result.unobservable
    assert truing.handeye(poses, raise_if_undecided=False).status == "not observable"


def test_the_summary_is_plain_sentences() -> None:
    s = scene(20)
    text = truing.handeye(HandEyePoses(s.A, s.B)).summary()
    assert "camera at 4" in text and "per axis" in text and "left out: rms" in text


def test_the_parts_can_be_had_alone() -> None:
    s = scene(20, "eye-to-hand")
    poses = HandEyePoses(s.A, s.B)
    closed = handeye_closed_form(poses, "eye-to-hand")
    assert off(np.asarray(closed.T_parent_camera), s.X)[0] < 3e-3
    found = truing.handeye(poses, setup="eye-to-hand", working_point=[0, 0, 0.4])
    following = handeye_plan(poses, found, count=2, setup="eye-to-hand")
    assert len(following) == 2 and following[0].T_base_hand.shape == (4, 4)
    assert "hand-inverted" in {reading.name for reading in handeye_readings()}
    with pytest.raises(truing.InputError, match="working_point"):
        truing.handeye(poses, working_point=[0, 0])
    with pytest.raises(truing.InputError, match="setup 'eye'; choose one of 'eye-in-hand', 'eye-to-hand'"):
        truing.handeye(poses, setup="eye")  # type: ignore[arg-type]


def test_poses_and_options_can_be_copied_and_pickled() -> None:
    import pickle

    s = scene(5)
    poses = HandEyePoses(
        s.A, s.B, set=[0, 0, 0, 1, 1], board_symmetries=[frame([0.1, 0, 0], [0, 0, math.pi])]
    )
    again = pickle.loads(pickle.dumps(poses))
    assert np.array_equal(again.T_base_hand, poses.T_base_hand) and np.array_equal(again.set, poses.set)
    assert again.replace(set=None).set is None
    options = HandEyeOptions(setup="eye-to-hand", hand_position_sigma=1e-4)
    assert pickle.loads(pickle.dumps(options)).hand_position_sigma == 1e-4 and options.pixel_sigma is None
    camera = pickle.loads(pickle.dumps(CAMERA))
    assert camera.distortion == CAMERA.distortion


def test_projection_is_that_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    points = np.random.default_rng(0).uniform([-0.3, -0.2, 0.5], [0.3, 0.2, 1.0], (50, 3))
    matrix = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(CAMERA.distortion))
    assert project(CAMERA, points) == pytest.approx(expected.reshape(-1, 2), abs=1e-9)
