# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files that no machine wrote: numbers beyond any unit, depths and counts beyond any robot, headers that
promise more than memory. Each is refused at its line, before it costs time or memory.
"""

from __future__ import annotations

import re
import resource
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from truing import forward_kinematics
from truing.errors import InputError
from truing.examples import example
from truing.files import load_measurements, load_robot
from truing.files.stream_file import load_tracker

ROBOT = example("irb120").read_text()
HEAD = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_m,y_m,z_m,note\n"
ROW = "0.1,0.2,0.3,0.4,0.5,0.6,0.3,0.1,0.2,1\n"


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("value", ["1e50", "-1e300", "9" * 160, "0." + "1" * 160])
@pytest.mark.parametrize("key", ["theta", "d", "alpha"])
def test_a_number_beyond_any_robot_is_refused_at_its_line(tmp_path: Path, key: str, value: str) -> None:
    text, count = re.subn(rf"\b{key}: [-0-9.e]+", f"{key}: {value}", ROBOT, count=1)
    assert count == 1
    line = next(k for k, line in enumerate(text.splitlines(), 1) if value in line)
    with pytest.raises(InputError, match=rf"line {line}: .*{key}: found .*expected"):
        load_robot(write(tmp_path / "robot.yaml", text))


@pytest.mark.parametrize(
    ("column", "value"),
    [(0, "1e160"), (3, "-1e308"), (6, "1e20"), (7, "7" * 160), (9, "1e160"), (8, "1e999")],
)
def test_a_cell_beyond_any_measurement_is_refused_at_its_line(
    tmp_path: Path, column: int, value: str
) -> None:
    cells = ROW.strip().split(",")
    cells[column] = value
    path = write(tmp_path / "data.csv", HEAD + 5 * ROW + ",".join(cells) + "\n" + 5 * ROW)
    robot = load_robot(example("irb120"))
    name = HEAD.strip().split(",")[column]
    with pytest.raises(InputError, match=rf"line 7, column '{name}': found '.*expected a"):
        load_measurements(path, robot)


def nested(tags: int) -> str:
    return '<robot name="x">' + "<a>" * tags + "</a>" * tags + "</robot>"


def chain(joints: int) -> str:
    links = "".join(f'<link name="l{k}"/>\n' for k in range(joints + 1))
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    return (
        f'<robot name="x">\n{links}'
        + "".join(
            f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>{limit}'
            for k in range(joints)
        )
        + "</robot>"
    )


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (nested(40_000), "line 1: elements are nested too deeply"),
        (chain(40_000), r"line 5002: has more than 5000 links"),
        (chain(3000), "has 3000 joints, expected at most 200"),
    ],
)
def test_a_urdf_beyond_any_robot_is_refused(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        load_robot(write(tmp_path / "arm.urdf", text))


def test_more_joints_than_any_robot_has_are_refused_at_their_line(tmp_path: Path) -> None:
    start = ROBOT.index("joints:")
    joints = "".join(
        f"  - {{name: K{k}, type: revolute, theta: 0, d: 0, a: 0.1, alpha: 0}}\n" for k in range(3000)
    )
    text = ROBOT[:start] + "joints:\n" + joints
    with pytest.raises(InputError, match=r"line \d+: joints: has 3000 entries, expected at most 200"):
        load_robot(write(tmp_path / "robot.yaml", text))
    with pytest.raises(InputError, match="far too much for this kind of file"):
        load_robot(write(tmp_path / "robot.yaml", ROBOT + 14_000_000 * "#"))


def test_joints_that_are_driven_by_two_before_them_are_computed_once(tmp_path: Path) -> None:
    # Every path followed anew, the last of these would take 2^90 steps.
    joints = [
        f"  - {{name: K{k}, type: revolute, theta: 0, d: 0, a: 0.1, alpha: 0"
        + (f", driven_by: {{K{k - 1}: 0.5, K{k - 2}: 0.25}}" if k > 1 else "")
        + "}\n"
        for k in range(130)
    ]
    text = ROBOT[: ROBOT.index("joints:")] + "joints:\n" + "".join(joints)
    robot = load_robot(write(tmp_path / "robot.yaml", text))
    factor = np.zeros((130, 2))
    factor[0, 0] = factor[1, 1] = 1.0
    for k in range(2, 130):
        factor[k] = 0.5 * factor[k - 1] + 0.25 * factor[k - 2]
    q = np.array([0.3, -0.2])
    turned = forward_kinematics(robot, q)[-1][:3, :3]
    angle = float((factor @ q).sum())  # all axes are parallel
    tool = robot.targets[0].T_last_target[:3, :3]
    spin = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    base = robot.T_measurement_base[:3, :3]
    assert np.allclose(turned, base @ spin @ tool, atol=1e-12)


def test_a_table_of_equal_rows_is_refused_by_its_size(tmp_path: Path) -> None:
    names = HEAD.strip().split(",")
    path = tmp_path / "data.parquet"
    pa.parquet.write_table(pa.table({name: pa.nulls(25_000_000, pa.float64()) for name in names}), path)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(InputError, match=r"has 25,000,000 rows of 10 columns, expected at most 20,000,000"):
        load_measurements(path, load_robot(example("irb120")))


def test_one_wrong_stamp_is_refused_at_its_row(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},1,0,{0.001 * k}\n" for k in range(200)]
    rows[150] = "1000000,1,0,0\n"
    path = write(tmp_path / "tracker.csv", "t_s,x_m,y_m,z_m\n" + "".join(rows))
    with pytest.raises(
        InputError, match=r"line 152, column 't_s': found 1000000 after 1.49, expected stamps"
    ):
        load_tracker(path)


def png(width: int, height: int) -> bytes:
    """With as many bytes of pixels as 64 x 64 need, whatever its header says."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    pixels = zlib.compress(bytes(65 * 64))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


POSES = "hand_x_m,hand_y_m,hand_z_m,hand_qw,hand_qx,hand_qy,hand_qz,image\n" + "".join(
    f"0.{k},0,0.5,1,0,0,0,{k}.png\n" for k in range(5)
)


@pytest.mark.parametrize("size", [(32_000, 32_000), (65_535, 65_535)])
def test_an_image_beyond_memory_is_refused_before_it_is_decoded(
    tmp_path: Path, size: tuple[int, int]
) -> None:
    pytest.importorskip("cv2")
    content = png(*size)  # the header alone has to be enough
    for k in range(5):
        write(tmp_path / f"{k}.png", content)
    write(tmp_path / "poses.csv", POSES)
    done = subprocess.run(
        [
            str(Path(sys.executable).with_name("truing")),
            "handeye",
            "poses.csv",
            "--board",
            "chessboard:9x6:25mm",
        ],
        cwd=tmp_path,
        capture_output=True,
        check=False,
        timeout=60,
        preexec_fn=limited(3_000_000_000),
    )
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1
    assert b".png" in done.stderr and b"200 million pixels" in done.stderr, done.stderr


def limited(memory: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
