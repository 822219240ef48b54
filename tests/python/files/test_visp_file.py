# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses that ViSP writes, a file for each, are read in the order of their numbers; so is its result."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from board_images import Floats
from fuzzing import mutated, quick
from handeye_scenes import scene
from truing import InputError
from truing.cli.app import main
from truing.files import load_stream, read_handeye_answer
from truing.rotations import rotation_vectors

SCENE = scene(12, seed=3)


def visp(T: Floats) -> str:
    """As vpPoseVector::saveYAML writes it."""
    numbers = [*T[:3, 3], *rotation_vectors(T[None, :3, :3])[0]]
    return "rows: 6\ncols: 1\ndata: \n" + "".join(f"  - [{float(value)!r}]\n" for value in numbers)


def written(folder: Path, name: str, frames: Floats) -> Path:
    for number, T in enumerate(frames, 1):
        (folder / (name % number)).write_text(visp(T))
    return folder / name


def test_files_are_read_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    assert np.allclose(
        load_stream(written(tmp_path, "pose_fPe_%d.yaml", SCENE.A), "hand").T, SCENE.A, atol=1e-12
    )
    assert np.allclose(
        load_stream(written(tmp_path, "board-%04d.yaml", SCENE.B), "board").T, SCENE.B, atol=1e-12
    )


def test_hand_and_board_give_the_camera_and_a_result_of_visp_stands_beside_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hand, board = (
        written(tmp_path, name, T)
        for name, T in (("pose_fPe_%d.yaml", SCENE.A), ("pose_cPo_%d.yaml", SCENE.B))
    )
    (tmp_path / "eMc.yaml").write_text(visp(SCENE.X))
    assert np.allclose(read_handeye_answer(tmp_path / "eMc.yaml").T_parent_camera, SCENE.X, atol=1e-12)
    arguments = [str(hand), "--board-poses", str(board), "--compare", str(tmp_path / "eMc.yaml")]
    assert main(["handeye", *arguments, "--out", str(tmp_path / "out")]) == 0
    assert "(the result of ViSP)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("pose_fPe_1.yaml", r"found one pose of ViSP, expected all of them: .* pose_fPe_%d\.yaml"),
        ("pose_xPe_%d.yaml", r"found no file of that name with a number for %d"),
        ("gap_%d.yaml", r"found numbers from 1 to 12 without gap_5\.yaml"),
        ("word_%d.yaml", r"word_2\.yaml, line 4: data\[0\]: found 'far', expected a finite number"),
        ("short_%d.yaml", r"short_2\.yaml, line 3: data: found .*, expected 6 rows: the position"),
        ("other_%d.yaml", r"other_2\.yaml.*: found .*, expected a pose of ViSP: rows: 6, cols: 1 and data"),
    ],
)
def test_faults_are_named(tmp_path: Path, given: str, message: str) -> None:
    for name in ("pose_fPe_%d.yaml", "gap_%d.yaml", "word_%d.yaml", "short_%d.yaml", "other_%d.yaml"):
        written(tmp_path, name, SCENE.A)
    (tmp_path / "gap_5.yaml").unlink()
    pose = visp(SCENE.A[1])
    (tmp_path / "word_2.yaml").write_text(re.sub(r"\[.*?\]", "[far]", pose, count=1))
    (tmp_path / "short_2.yaml").write_text(pose.rsplit("  -", 1)[0])
    (tmp_path / "other_2.yaml").write_text("x: 1\n")
    with pytest.raises(InputError, match=message):
        load_stream(tmp_path / given, "hand")


def test_a_broken_file_is_refused_in_one_line(tmp_path: Path) -> None:
    pattern = written(tmp_path, "p_%d.yaml", SCENE.A[:3])

    @quick
    @given(mutated(visp(SCENE.A[1]).encode()))
    def check(data: bytes) -> None:
        (tmp_path / "p_2.yaml").write_bytes(data)
        try:
            assert np.isfinite(load_stream(pattern, "hand").T).all()
        except InputError as error:
            assert "\n" not in str(error)

    check()
