# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye calibration of two recorded set-ups: the section of docs/benchmarks/real-robots.md between its \
markers.

    python bench/handeye_real.py [--data FOLDER]

FOLDER as for bench/real_data.py. The images need OpenCV (`pip install "truing[images]"`).
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import truing
from truing.hand_eye import HandEyeErrors, HandEyePoses, handeye_with_kinematics

ROOT = Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- hand-eye: written by bench/handeye_real.py -->", "<!-- end of hand-eye -->"
HEADER = [
    "| | rms | mean | p95 | max [mm] | rotation rms [deg] | poses |",
    "| --- | --- | --- | --- | --- | --- | --- |",
]


def line(what: str, e: HandEyeErrors) -> str:
    mm = " | ".join(
        f"{1e3 * value:.3f}" for value in (e.position_rms, e.position_mean, e.position_p95, e.position_max)
    )
    return f"| {what} | {mm} | {math.degrees(e.rotation_rms):.3f} | {e.n} |"


def fr3(folder: Path) -> list[str]:
    data = truing.load_handeye(folder / "poses.csv")
    robot = truing.load_robot(folder / "robot.yaml")
    joints = truing.load_measurements(folder / "measurements.csv", robot).joints
    lines = ["| **FR3, camera on the flange, board poses**" + " |" * 7]
    for method in ("closed-form", "refined"):
        found = truing.handeye(data, method=method)
        assert found.test is not None
        lines.append(line(f"truing, {method}", found.test))
        if method == "closed-form":
            lines.append("| baseline, closed form | 8.342 | 7.670 | 12.269 | 16.365 | 0.633 | 35 |")
    lines.append("| baseline, least squares | 8.762 | 7.816 | 15.386 | 19.920 | 0.951 | 35 |")
    both = handeye_with_kinematics(robot, joints, data, loss="none")
    assert both.test_after is not None
    lines += [
        line("truing, with kinematics", both.test_after),
        "| baseline, with link parameters | 1.341 | 1.075 | 2.506 | 3.951 | 0.279 | 35 |",
    ]
    return lines


def images(folder: Path) -> list[str]:
    data = truing.load_handeye(folder / "poses.csv", board="circles:10x10:25.4mm")
    poses = data.poses
    plain = HandEyePoses(
        poses.T_base_hand, poses.T_camera_board, set=poses.set, board_symmetries=poses.board_symmetries
    )
    everything = HandEyePoses(
        poses.T_base_hand, poses.T_camera_board, board_symmetries=poses.board_symmetries
    )
    with_pixels = HandEyePoses(
        poses.T_base_hand,
        poses.T_camera_board,
        images=poses.images,
        camera=poses.camera,
        board_symmetries=poses.board_symmetries,
    )
    lines = ["| **Industrial arm, dot grid in images**" + " |" * 7]
    for name, found in (
        ("truing, closed form on board poses", truing.handeye(plain, method="closed-form")),
        ("truing, board poses", truing.handeye(plain)),
        ("truing, pixels", truing.handeye(data)),
    ):
        assert found.test is not None
        lines.append(line(name, found.test))
    lines += [
        "| baseline, closed form | 12.798 | 10.704 | 19.103 | 20.349 | 0.912 | 3 |",
        "| baseline, least squares | 8.270 | 7.668 | 11.301 | 11.792 | 0.746 | 3 |",
    ]
    lines += [
        line("truing, board poses, each of the eight left out", truing.handeye(everything).left_out),
        line("truing, pixels, each of the eight left out", truing.handeye(with_pixels).left_out),
    ]
    return lines


def section(folder: Path) -> str:
    lines = [
        BEGIN,
        "## Hand-eye",
        "",
        (
            "Closures of the loop hand, camera, board at the board, on poses that were held out; baselines"
            " are those of another program on the same split."
        ),
        "",
        *HEADER,
    ]
    for name, table in (("handeye_fr3", fr3), ("handeye_ros_industrial", images)):
        lines += table(folder / name) if (folder / name).is_dir() else [f"| not there: `{name}`" + " |" * 7]
    lines += [
        "",
        (
            "**FR3.** What hand-eye alone leaves is the arm, not the camera, and it says so: plain weights"
            " predict left-out poses better than weights by any noise of robot and camera,"
        ),
        (
            "and the joint values and the robot model are asked for. With them (`--with-kinematics`) a"
            " millimetre is left."
        ),
        "",
        (
            "**Dot grid.** Five training images and three to test on: what the three show is a matter of"
            " luck, so each of the eight is left out as well. The dots see their board to 0.1 px, and"
        ),
        (
            "yet poses close to 8 mm: the robot's poses, or a camera that moved while it looked, are off by"
            " more than the board's poses, and pixels cannot mend that."
        ),
        END,
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with a subfolder for each recording")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/benchmarks/real-robots.md")
    args = parser.parse_args()
    text = args.page.read_text(encoding="utf-8")
    if BEGIN not in text:
        sys.exit(f"{args.page} has no line {BEGIN}")
    head, rest = text.split(BEGIN)
    written = section(args.data)
    args.page.write_text(head + written + rest.split(END)[1], encoding="utf-8")
    print(written)


if __name__ == "__main__":
    main()
