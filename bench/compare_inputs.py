# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Input files for compare_cases.txt that no command writes: poses, hand-eye scenes, a recording, robots.

Made by numpy alone, with fixed seeds and rounded to 12 digits, so that two versions of truing get the same.
"""

from __future__ import annotations

import csv
import inspect
import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = ("irb120", "ur10", "palletizer", "large_boom")

# theta, d, a, alpha of the shipped irb120.yaml, its tool and its limits.
IRB120 = np.array(
    [
        [0.0, 0.290, 0.0, -90.0],
        [-90.0, 0.0, 0.270, 0.0],
        [0.0, 0.0, 0.070, -90.0],
        [0.0, 0.302, 0.0, 90.0],
        [0.0, 0.0, 0.0, -90.0],
        [180.0, 0.072, 0.0, 0.0],
    ]
) * [math.pi / 180, 1.0, 1.0, math.pi / 180]
TOOL = np.array([0.05, 0.02, 0.08])
LIMITS = np.radians([[-165, -110, -110, -160, -120, -200], [165, 110, 70, 160, 120, 200]])

GANTRY_RAILS = """\
  - {name: X, type: prismatic, theta: 0, d: 0, a: 0, alpha: -90, limits: [0, 10]}
  - {name: Y, type: prismatic, theta: 90, d: 0, a: 0, alpha: 90, limits: [0, 4]}
  - {name: Z, type: prismatic, theta: 0, d: 0, a: 0, alpha: 0, limits: [0, 2]}
"""

SCENE = """\
format: truing-scene/1
units: {length: mm, angle: deg}
obstacles:
  - {name: table, shape: box, xyz: [600, 0, -20], rpy: [0, 0, 90], size: [800, 400, 40]}
  - {name: post, shape: capsule, xyz: [0, 500, 0], length: 900, radius: 40}
  - {name: ball, shape: sphere, xyz: [300, 300, 500], radius: 80}
capsules:
  - {name: forearm, link: J4, start: [0, 0, -250], end: [0, 0, 0], radius: 60}
  - {name: hand, link: tool, start: [0, 0, -50], end: [0, 0, 0], radius: 20}
clearance: 5
ignored: [[forearm, post]]
"""

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/> <link name="shoulder"/> <link name="upper"/> <link name="fore"/> <link name="wrist"/>
  <link name="flange"/>
  <joint name="pan" type="revolute"> <parent link="base"/> <child link="shoulder"/>
    <origin xyz="0 0 0.4"/> <axis xyz="0 0 1"/> <limit lower="-3" upper="3" effort="1" velocity="1"/> </joint>
  <joint name="lift" type="revolute"> <parent link="shoulder"/> <child link="upper"/>
    <origin xyz="0.1 0 0"/> <axis xyz="0 1 0"/> <limit lower="-2" upper="2" effort="1" velocity="1"/> </joint>
  <joint name="elbow" type="revolute"> <parent link="upper"/> <child link="fore"/>
    <origin xyz="0 0 0.5"/> <axis xyz="0 1 0"/> <limit lower="-2" upper="2" effort="1" velocity="1"/> </joint>
  <joint name="roll" type="revolute"> <parent link="fore"/> <child link="wrist"/>
    <origin xyz="0.3 0 0"/> <axis xyz="1 0 0"/> <limit lower="-3" upper="3" effort="1" velocity="1"/> </joint>
  <joint name="mount" type="fixed"> <parent link="wrist"/> <child link="flange"/>
    <origin xyz="0.1 0 0.03" rpy="0 1.5708 0"/> </joint>
</robot>
"""

# The part of bench/track_real.py that has no command. Names are looked for where versions have them.
INERTIAL = """\
def known(name):
    modules = ["truing", "truing.model", "truing.tracking", "truing.track", "truing.files"]
    for module in modules:
        try:
            return getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError):
            pass
    raise SystemExit(f"{name} is in none of {modules}")

folder = sys.argv[1]
robot = known("load_robot")(folder + "/robot.yaml")
imu, joints = known("load_imu")(folder + "/imu.csv"), known("load_joints")(folder + "/joints.csv", robot)
end = joints.t[0] + 60.0
early, sensed = joints.t < end, imu.t < end
flange = np.asarray(known("flange_poses")(robot, joints.joints[early]))
turns = np.array([quaternion(T[:3, :3]) for T in flange])
found = known("calibrate_inertial")(
    imu.t[sensed], imu.gyro[sensed], imu.accel[sensed], joints.t[early], flange[:, :3, 3], turns
)
frame = found.T_receiver_imu
print(found.status, repr(found.clock_offset), repr(found.clock_offset_sigma))
for values in (frame.T, frame.covariance, found.gravity):
    print(np.asarray(values).tolist())
"""


# ---- Geometry ----------------------------------------------------------------------------------------------


def rotation(vector: Sequence[float] | Floats) -> Floats:
    """Of a rotation vector (Rodrigues)."""
    v = np.asarray(vector, dtype=float)
    angle = float(np.linalg.norm(v))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = v / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K))


def rotation_vector(R: Floats) -> Floats:
    """Of a rotation by less than half a turn."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = 0.5 * float(np.linalg.norm(axis))
    return (
        np.asarray(axis * 0.5 * math.atan2(sine, 0.5 * (float(np.trace(R)) - 1.0)) / sine)
        if sine
        else np.zeros(3)
    )


def frame(position: Sequence[float] | Floats, vector: Sequence[float] | Floats) -> Floats:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(vector), position
    return T


def quaternion(R: Floats) -> Floats:
    """w x y z, w not negative: by the largest eigenvalue of Bar-Itzhack's matrix (2000)."""
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)],
        ]
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)


def flanges_of(joints: Floats, links: Floats = IRB120) -> Floats:
    """T_base_flange of the IRB 120, shape=(n, 4, 4): Rz Tz Tx Rx of each link (Denavit, Hartenberg 1955)."""
    T = np.tile(np.eye(4), (len(joints), 1, 1))
    for (theta, d, a, alpha), q in zip(links, joints.T, strict=True):
        c, s, ca, sa = np.cos(theta + q), np.sin(theta + q), math.cos(alpha), math.sin(alpha)
        zero, one = np.zeros_like(q), np.ones_like(q)
        link = [
            c,
            -s * ca,
            s * sa,
            a * c,
            s,
            c * ca,
            -c * sa,
            a * s,
            zero,
            sa * one,
            ca * one,
            d * one,
            zero,
            zero,
            zero,
            one,
        ]
        T = T @ np.array(link).T.reshape(-1, 4, 4)
    return T


def tips_of(joints: Floats, links: Floats = IRB120) -> Floats:
    """Positions of the tool, shape=(n, 3)."""
    return np.asarray((flanges_of(joints, links) @ np.array([*TOOL, 1.0]))[:, :3])


# ---- Files -------------------------------------------------------------------------------------------------


def write_csv(path: Path, columns: Mapping[str, Any]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([cell if isinstance(cell, str) else f"{float(cell):.12g}" for cell in row])


def joint_columns(joints: Floats, name: str = "q{}_rad") -> dict[str, Any]:
    return {name.format(k + 1): joints[:, k] for k in range(joints.shape[1])}


def position_columns(positions: Floats) -> dict[str, Any]:
    return dict(zip(("x_m", "y_m", "z_m"), positions.T, strict=True))


def pose_columns(frames: Floats, before: str = "") -> dict[str, Any]:
    turns = np.array([quaternion(T[:3, :3]) for T in frames])
    names = [f"{before}{part}" for part in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")]
    return dict(zip(names, np.column_stack([frames[:, :3, 3], turns]).T, strict=True))


def usual_joints(count: int, seed: int) -> Floats:
    """Of the IRB 120, away from its limits and its singular poses."""
    middle, half = LIMITS.mean(axis=0), 0.35 * (LIMITS[1] - LIMITS[0])
    q = np.random.default_rng(seed).uniform(middle - half, middle + half, (count, 6))
    q[:, 2] = np.clip(q[:, 2], -1.0, 0.8)
    q[:, 4] = np.where(q[:, 4] < 0, -1.0, 1.0) * np.maximum(np.abs(q[:, 4]), 0.3)
    return q


# ---- What is made ------------------------------------------------------------------------------------------


def make(folder: Path, data: Path | None) -> None:
    """Writes every input into `folder`; of the recordings in `data` those that need another form."""
    folder.mkdir(parents=True, exist_ok=True)
    robots(folder)
    targets(folder)
    measurements(folder)
    hand_eye(folder)
    recording(folder)
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    imports = "from __future__ import annotations\nimport importlib, sys\nimport numpy as np\n\n"
    (folder / "inertial.py").write_text(imports + inspect.getsource(quaternion) + INERTIAL, encoding="utf-8")
    if data is not None:
        recorded(folder, data)


def robots(folder: Path) -> None:
    for name in ROBOTS:
        shutil.copyfile(next((ROOT / "python").rglob(f"{name}.yaml")), folder / f"{name}.yaml")
    text = (folder / "irb120.yaml").read_text(encoding="utf-8")
    hanging = "base: {xyz: [0, 0, 3], rpy: [0, 90, 0]}\njoints:\n"
    gantry = text.replace("name: irb120", "name: gantry").replace("joints:\n", hanging + GANTRY_RAILS)
    (folder / "gantry.yaml").write_text(gantry, encoding="utf-8")
    (folder / "wire.yaml").write_text(text + "anchor: {xyz: [1.0, 0.2, 0.1], zero: 0.01}\n", encoding="utf-8")
    (folder / "arm.urdf").write_text(URDF, encoding="utf-8")


def targets(folder: Path) -> None:
    """Poses, some beyond reach; with what effects ask for; a path, a program, joints of the gantry."""
    rng = np.random.default_rng(11)
    q = usual_joints(40, 12)
    frames = flanges_of(q) @ frame(TOOL, [0, 0, 0])
    far = frames.copy()
    far[[7, 23], :3, 3] *= 4.0
    write_csv(folder / "targets.csv", pose_columns(far))
    seeds = joint_columns(q + rng.normal(0.0, 0.1, q.shape))
    asked = {
        "payload_kg": rng.choice([0.0, 2.0, 5.0], 40),
        **joint_columns(rng.choice([-1.0, 1.0], q.shape), "dir{}"),
    }
    write_csv(folder / "targets_seeded.csv", {**pose_columns(frames), **seeds, **asked})
    write_csv(folder / "program.csv", {**joint_columns(q), **asked})
    line = np.linspace([-0.4, 0.1, 0.1, -0.5, 0.8, 0.2], [0.5, 0.5, -0.2, 0.4, 1.1, -0.3], 60)
    write_csv(folder / "path.csv", pose_columns(flanges_of(line) @ frame(TOOL, [0, 0, 0])))
    rails = rng.uniform([1, 0.5, 0.2], [9, 3.5, 1.8], (20, 3))
    gantry = {"q1_m": rails[:, 0], "q2_m": rails[:, 1], "q3_m": rails[:, 2]}
    arm = {f"q{k + 4}_rad": q[:20, k] for k in range(6)}
    write_csv(folder / "gantry_joints.csv", {**gantry, **arm})


def measurements(folder: Path) -> None:
    """Of what `truing simulate` has no column for: a late clock, wound-up gears, a stuck cable, a wire."""
    rng = np.random.default_rng(21)
    q = usual_joints(200, 22)

    def noisy(joints: Floats) -> dict[str, Any]:
        return position_columns(tips_of(joints) + rng.normal(0.0, 3e-5, (len(joints), 3)))

    speed, torque = rng.normal(0.0, 0.6, q.shape), rng.normal(0.0, 30.0, q.shape)
    speeds = joint_columns(speed, "qd{}_rad_s")
    write_csv(folder / "time_offset.csv", {**joint_columns(q), **speeds, **noisy(q + 4e-4 * speed)})
    wound = torque * [0, 8e-6, 0, 0, 0, 0]
    write_csv(
        folder / "windup.csv", {**joint_columns(q), **joint_columns(torque, "tau{}_Nm"), **noisy(q + wound)}
    )
    stuck = np.where(q[:, :1] > 0.3, 4e-4, -4e-4) * [1, 0, 0, 0, 0, 0]
    write_csv(folder / "cable.csv", {**joint_columns(q), **noisy(q + stuck)})
    links = IRB120 + rng.normal(0.0, 1.0, IRB120.shape) * [1e-3, 4e-4, 4e-4, 6e-4]
    length = (
        np.linalg.norm(tips_of(q, links) - [1.003, 0.198, 0.104], axis=1)
        + 0.012
        + rng.normal(0.0, 1e-4, len(q))
    )
    write_csv(folder / "wire.csv", {**joint_columns(q), "dist_m": length})


def hand_eye(folder: Path) -> None:
    for name, setup, one_axis in (
        ("in_hand", "eye-in-hand", False),
        ("to_hand", "eye-to-hand", False),
        ("one_axis", "eye-in-hand", True),
    ):
        hands, boards = seen_boards(setup, 25, 31, one_axis)
        if name == "in_hand":
            boards[6, 1, 3] += 0.4  # one that was read wrongly
        parts = {"set": ["test" if k % 5 == 0 else "train" for k in range(25)]} if name == "to_hand" else {}
        write_csv(
            folder / f"{name}.csv",
            {**pose_columns(hands, "hand_"), **pose_columns(boards, "board_"), **parts},
        )
    two_clocks(folder)
    with_joints(folder)


def seen_boards(setup: str, count: int, seed: int, one_axis: bool) -> tuple[Floats, Floats]:
    """T_base_hand and T_camera_board with noise, shape=(count, 4, 4) each."""
    rng = np.random.default_rng(seed)
    in_hand = setup == "eye-in-hand"
    X = frame([0.04, -0.02, 0.09], [0.1, -0.2, 1.5]) if in_hand else frame([1.1, 0.2, 0.7], [-1.9, 0.1, 0.3])
    Y = (
        frame([0.62, 0.05, 0.02], [3.0, 0.1, 0.05])
        if in_hand
        else frame([0.02, -0.03, 0.06], [0.2, 0.1, -0.4])
    )
    hands, boards = [], []
    for _ in range(count):
        seen = frame([*rng.uniform(-0.08, 0.08, 2), rng.uniform(0.4, 0.6)], rng.uniform(-0.5, 0.5, 3))
        hand = Y @ np.linalg.inv(X @ seen) if in_hand else X @ seen @ np.linalg.inv(Y)
        if one_axis:
            turn = frame(rng.uniform(-0.1, 0.1, 3), [0, 0, rng.uniform(-0.5, 0.5)])
            hand = turn @ frame([0.5, 0, 0.5], [2.9, 0.1, 0.2])
        board = np.linalg.inv(X) @ (np.linalg.inv(hand) if in_hand else hand) @ Y
        hands.append(hand @ frame(rng.normal(0, 1e-4, 3), rng.normal(0, 3e-4, 3)))
        boards.append(board @ frame(rng.normal(0, 3e-4, 3), rng.normal(0, 8e-4, 3)))
    return np.array(hands), np.array(boards)


def two_clocks(folder: Path) -> None:
    """Hand and board, each with times of its own: t_hand = t_camera + 0.25 s."""
    rng = np.random.default_rng(41)
    X, Y = frame([0.04, -0.02, 0.09], [0.1, -0.2, 1.5]), frame([0.62, 0.05, 0.02], [3.0, 0.1, 0.05])

    def hand_at(t: float) -> Floats:
        t = t + 0.3 * math.sin(0.37 * t)  # uneven, so that times which belong together show
        waves = np.array([math.sin(k * t + 0.5 * k) for k in (2.1, 1.7, 1.3, 3.1, 2.6)])
        seen = frame([0.06 * waves[0], 0.06 * waves[1], 0.5 + 0.08 * waves[2]], 0.4 * waves[2:])
        return np.asarray(Y @ np.linalg.inv(X @ seen))

    hand_t, board_t = np.arange(0.0, 20.0, 0.02), np.arange(0.5, 19.0, 0.1)
    hands = np.array([hand_at(t) @ frame(rng.normal(0, 5e-5, 3), rng.normal(0, 1e-4, 3)) for t in hand_t])
    boards = np.array([np.linalg.inv(X) @ np.linalg.inv(hand_at(t)) @ Y for t in board_t])
    boards = np.array([T @ frame(rng.normal(0, 2e-4, 3), rng.normal(0, 5e-4, 3)) for T in boards])
    write_csv(folder / "clock_hand.csv", {"t_s": hand_t, **pose_columns(hands, "hand_")})
    write_csv(folder / "clock_board.csv", {"t_s": board_t - 0.25, **pose_columns(boards, "board_")})


def with_joints(folder: Path) -> None:
    """The arm's links are off as well, and its joints are known."""
    rng = np.random.default_rng(51)
    q = usual_joints(50, 52)
    links = IRB120 + rng.normal(0.0, 1.0, IRB120.shape) * [1e-3, 4e-4, 4e-4, 6e-4]
    X, Y = frame([0.04, -0.02, 0.09], [0.1, -0.2, 1.5]), frame([0.62, 0.05, 0.02], [3.0, 0.1, 0.05])
    hands = flanges_of(q)
    boards = np.linalg.inv(flanges_of(q, links) @ X) @ Y
    boards = np.array([T @ frame(rng.normal(0, 1e-4, 3), rng.normal(0, 2e-4, 3)) for T in boards])
    both = {**pose_columns(hands, "hand_"), **pose_columns(boards, "board_")}
    write_csv(folder / "with_joints.csv", {**joint_columns(q), **both})


def recording(folder: Path) -> None:
    """A stiff arm goes from test position to test position; stamps of tracker and controller are off."""
    folder = folder / "recording"
    folder.mkdir(exist_ok=True)
    rng = np.random.default_rng(61)
    stops = usual_joints(12, 62) * 0.8
    rest, move = 3.4, 2.2
    length = 1.0 + 11 * (move + rest) + rest
    base, receiver = frame([2.0, -1.0, 0.5], [0.02, -0.03, 2.1]), frame([0.05, 0.03, 0.10], [0.3, -0.2, 1.0])
    sensor = frame([0.02, -0.04, 0.06], [-0.1, 0.2, -0.7])

    def joints_at(t: Floats) -> Floats:
        q = np.tile(stops[0], (len(t), 1))
        for k in range(1, len(stops)):
            x = np.clip((t - 1.0 - rest - (k - 1) * (move + rest)) / move, 0.0, 1.0)
            q += (x**3 * (10 - 15 * x + 6 * x**2))[:, None] * (stops[k] - stops[k - 1])
        return q

    def flange_at(t: Floats) -> Floats:
        return flanges_of(joints_at(t))

    t = np.arange(0.01, length, 0.01)
    before, now, after = (flange_at(t + step) @ sensor for step in (-1e-3, 0.0, 1e-3))
    gyro = np.array(
        [rotation_vector(a[:3, :3].T @ b[:3, :3]) / 2e-3 for a, b in zip(before, after, strict=True)]
    )
    force = (before + after - 2 * now)[:, :3, 3] / 1e-6 + [0, 0, 9.81]
    accel = np.einsum("nji,nj->ni", now[:, :3, :3], force)
    sensed = np.hstack([gyro + rng.normal(0.0, 1e-3, gyro.shape), accel + rng.normal(0.0, 1e-2, accel.shape)])
    names = ("gx_rad_s", "gy_rad_s", "gz_rad_s", "ax_m_s2", "ay_m_s2", "az_m_s2")
    write_csv(folder / "imu.csv", {"t_s": t, **dict(zip(names, sensed.T, strict=True))})
    t = np.arange(0.013, length, 0.02)
    poses = [
        base @ T @ receiver @ frame(rng.normal(0, 2e-4, 3), rng.normal(0, 3e-4, 3)) for T in flange_at(t)
    ]
    write_csv(folder / "tracker.csv", {"t_s": t + 0.35, **pose_columns(np.array(poses))})
    t = np.arange(0.0, length, 0.01)
    write_csv(folder / "joints.csv", {"t_s": t + 0.12, **joint_columns(joints_at(t))})
    t = np.arange(0.0, length + 0.5, 0.02)
    planned = flange_at(t + 0.05) @ frame(TOOL, [0, 0, 0])
    write_csv(folder / "plan.csv", {"t_s": t + 0.12, **pose_columns(planned)})


def recorded(folder: Path, data: Path) -> None:
    """Of the recordings: joints read back in place of those commanded; hand-eye poses with joints beside."""
    source = data / "irb120_faro/measurements.csv"
    if source.is_file():
        columns = read_csv(source)
        read_back = {f"q{k}_rad": columns.pop(f"qr{k}_rad") for k in range(1, 7)}
        write_texts(folder / "read_back.csv", {**columns, **read_back})
    source = data / "handeye_fr3"
    if source.is_dir():
        joints = {
            k: v for k, v in read_csv(source / "measurements.csv").items() if k[0] == "q" and k[1].isdigit()
        }
        write_texts(folder / "fr3.csv", {**joints, **read_csv(source / "poses.csv")})


def read_csv(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return {name: [row[k] for row in rows] for k, name in enumerate(header)}


def write_texts(path: Path, columns: Mapping[str, Sequence[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([list(columns), *zip(*columns.values(), strict=True)])
