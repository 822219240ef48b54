# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""`truing export`: files of every format from a result's folder, and nothing of bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truing
from truing.cli import main
from truing.files import ARMS, save_robot


@pytest.fixture
def result(tmp_path: Path) -> Path:
    nominal = ARMS["ur5e"].robot()
    nominal.targets[0].T_last_target = truing.frame_from_xyz_rpy([0.01, 0.02, 0.15], [0, 0, 0])
    save_robot(tmp_path / "nominal.yaml", nominal)
    found = nominal.copy()
    found.joints[1].theta += 2e-3
    found.joints[2].a += 5e-4
    found.joints[3].ratio = 1.0005
    save_robot(tmp_path / "robot.yaml", found)
    return tmp_path


@pytest.mark.parametrize(
    ("to", "files"),
    [
        ("frames", ["kuka.txt", "abb.txt", "fanuc.txt", "ur.txt", "yaskawa.txt"]),
        ("ur_description", ["kinematics.yaml"]),
        ("urdf", ["robot.urdf"]),
        ("tf", ["static_transforms.sh"]),
        ("ros2_control", ["transmissions.xml", "joint_offsets.xml"]),
        ("zeros", ["zeros.html", "zeros.csv"]),
    ],
)
def test_each_format_is_written_with_what_it_drops(
    result: Path, to: str, files: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    out = result / "out"
    nominal = ["--nominal", str(result / "nominal.yaml")]
    assert main(["export", str(result), "--to", to, *nominal, "--out", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == files
    assert said == json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert sorted(path.name for path in out.iterdir()) == sorted([*files, "result.json"])
    dropped = {item["name"] for item in said["dropped"]}
    assert dropped == (
        {"lengths and twists of links"} if to == "ros2_control" else dropped | {"wrist_1.ratio"}
    )
    assert 0 < said["remaining"]["max_m"] < 3e-3


def test_files_of_another_format_do_not_stay(result: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = result / "out"
    for to in ("ur_description", "frames"):
        assert main(["export", str(result), "--to", to, "--brand", "ur", "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["result.json", "ur.txt"]
    assert "set_tcp(p[0.0100000" in (out / "ur.txt").read_text(encoding="utf-8")
    assert "not written" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--to", "zeros"], "needs --nominal"),
        (["--to", "lerobot", "--nominal", "nominal.yaml"], "needs --calibration"),
        (["--to", "excel"], "--to: found 'excel'"),
        (["--brand", "acme"], "--brand: found 'acme'"),
        (["--to", "zeros", "--nominal", "gone.yaml"], "gone.yaml"),
        (["--to", "urdf", "--source", "gone.urdf"], "has convention dh"),
    ],
)
def test_nothing_is_written_of_bad_input(
    result: Path,
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(result)
    assert main(["export", ".", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert sorted(path.name for path in result.iterdir()) == ["nominal.yaml", "robot.yaml"]
