# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sound files of recordings, programs, controllers and performance tests, for `fuzz_commands`."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller_files import MOTORS, UR5, conf, kinematics, moc, small_urdf, urp
from program_corpus import CORPUS
from program_robots import built, nominal

Floats = NDArray[np.float64]

DYNAMIC_ROBOT = b"""\
format: truing-robot/1
name: moving
units: {length: m, angle: rad, mass: kg}
convention: dh
gravity: [0, -9.81, 0]
joints:
  - {name: J1, type: revolute, theta: 0, d: 0, a: 0.4, alpha: 0, limits: [-2.5, 2.5], mass: 4,
     com: [-0.2, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0], rotor_inertia: 0.1, torque_per_ampere: 2}
  - {name: J2, type: revolute, theta: 0, d: 0, a: 0.3, alpha: 0, limits: [-2.5, 2.5], mass: 2,
     com: [-0.15, 0, 0], inertia: [0.005, 0.02, 0.02, 0, 0, 0], rotor_inertia: 0.05, torque_per_ampere: 1}
tool: {xyz: [0, 0, 0], rpy: [0, 0, 0]}
torque_effects:
  - {effect: coulomb, joints: [J1, J2], parameters: {coulomb.J1: 2.0, coulomb.J2: 1.0}}
  - {effect: viscous, joints: [J1, J2], parameters: {viscous.J1: 0.8, viscous.J2: 0.5}}
"""
PROGRAMS = ("kuka_points.src", "kuka_points.dat", "abb_named.mod", "fanuc_plain.ls", "ur_waypoints.script")
PROGRAMS += ("yaskawa_mixed.jbi",)
BRANDS = ("kuka", "abb", "fanuc", "ur", "yaskawa")


def write_controllers(folder: Path) -> None:
    (folder / "calibration.conf").write_text(conf(UR5))
    (folder / "program.urp").write_bytes(gzip.compress(urp(kinematics()).encode(), mtime=0))
    (folder / "plain.urp").write_text(urp(kinematics(), kinematics()))
    (folder / "MOC.cfg").write_text(moc())
    (folder / "follower.json").write_text(json.dumps(MOTORS, indent=1))
    (folder / "so.urdf").write_text(small_urdf())


def write_programs(folder: Path) -> None:
    """Programs of the corpus, and the robots that they are of."""
    from truing.files import save_robot

    for name in PROGRAMS:
        shutil.copy(CORPUS / name, folder / name)
    for brand in BRANDS:
        save_robot(folder / f"{brand}.yaml", nominal(brand))
        save_robot(folder / f"{brand}_real.yaml", built(brand))


def write_recordings(folder: Path) -> None:
    """Two swings of a robot with friction: 5 s at 50 Hz, torques and a payload."""
    from truing.dynamics import Recording, export, load_recordings, predict
    from truing.files import load_robot

    (folder / "moving.yaml").write_bytes(DYNAMIC_ROBOT)
    robot = load_robot(folder / "moving.yaml")
    random = np.random.default_rng(1)
    time = np.arange(0.0, 5.0, 0.02)
    for number in (1, 2):
        phase = random.uniform(0.0, 6.0, 4)
        q = np.column_stack(
            [
                0.8 * np.sin((1.7 + k) * time + phase[k]) + 0.2 * np.sin(5.1 * time + phase[k + 2])
                for k in range(2)
            ]
        )
        torque = np.asarray(predict(robot, Recording("a", time=time, position=q)).torque)
        torque = torque + 0.05 * random.standard_normal(torque.shape)
        columns = np.column_stack([time, q, torque, np.full(time.size, 0.5 * (number - 1))])
        head = "t_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm,payload_kg"
        text = "\n".join([head, *(",".join(f"{value:.6g}" for value in row) for row in columns)])
        (folder / f"motion{number}.csv").write_text(text + "\n")
    assert load_recordings(folder / "motion1.csv", robot)
    shutil.copy(export.export(robot, "mjcf", folder / "mjcf").model, folder / "moving.xml")


def write_performance(folder: Path) -> None:
    """Commanded poses, and thirty cycles of them with a scatter of 0.02 mm; a path and a short warm-up."""
    random = np.random.default_rng(2)
    poses = {f"P{k}": random.uniform([0.4, -0.2, 0.3], [0.8, 0.2, 0.7]) for k in range(1, 6)}
    lines = ["pose,x_m,y_m,z_m,qw,qx,qy,qz,path,point"]
    lines += [f"{name},{_row(place)},1,0,0,0,," for name, place in poses.items()]
    points = [np.array([0.5, 0.0, 0.4 + 0.01 * k]) for k in range(5)]
    lines += [f"line.{k},{_row(place)},1,0,0,0,line,{k}" for k, place in enumerate(points, 1)]
    (folder / "commanded.csv").write_text("\n".join(lines) + "\n")
    rows = ["test,pose,path,load_percent,speed_percent,cycle,approach,block,point,x_mm,y_mm,z_mm"]

    def add(test: str, pose: str, path: str, numbers: tuple[object, ...], place: Floats) -> None:
        cycle, approach, block, point = numbers
        at = 1e3 * (place + 2e-5 * random.standard_normal(3))
        rows.append(f"{test},{pose},{path},100,100,{cycle},{approach},{block},{point},{_row(at)}")

    for cycle in range(1, 6):
        for name, place in poses.items():
            add("pose", name, "", (cycle, "", "", ""), place)
        for approach in (1, 2):
            add("approach", "P1", "", (cycle, approach, "", ""), poses["P1"])
        for k, place in enumerate(points, 1):
            add("path", "", "line", (cycle, "", "", k), place)
        for block in (1, 2, 3):
            add("warm-up", "P1", "", (cycle, "", block, ""), poses["P1"] + 1e-5 * block)
    (folder / "measured.csv").write_text("\n".join(rows) + "\n")


def _row(values: Floats) -> str:
    return ",".join(f"{value:.5f}" for value in values)


def write_inputs(folder: Path) -> None:
    """All of them."""
    write_controllers(folder)
    write_programs(folder)
    write_recordings(folder)
    write_performance(folder)
