# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques of real arms diagnosed: held-out errors of the nominal model, standard practice and what was named.

    TRUING_REALDATA=... python bench/real_dynamics.py

prints the tables of docs/benchmarks/real-dynamics.md. Sets that are not there are left out.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import truing
from truing.dynamics import Recording, TorqueDiagnosis, diagnose, load_recordings, rollout
from truing.model import Robot

UR10E_GAINS = (10.0, 10.6956, 8.4566, 9.0029, 9.4800, 10.1232)  # [Nm/A] published beside the recordings
MODELS = ("nominal", "standard", "named")


def robot_of(folder: Path, torque_per_ampere: Sequence[float] = ()) -> Robot:
    robot = truing.load_robot(folder / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), torque_per_ampere, strict=False):
        robot.joints[index].torque_per_ampere = gain
    return robot


def ur10e(folder: Path, held_out: Sequence[str]) -> tuple[Robot, list[Recording]]:
    """All recordings without a load that are not marked as test, and these of the marked ones."""
    robot = robot_of(folder, UR10E_GAINS)
    files = [file for file in sorted(folder.glob("*.csv")) if not file.stem.endswith("_load")]
    recordings = load_recordings(files, robot)
    return robot, [r for r in recordings if not r.test or r.name in held_out]


def row(name: str, found: TorqueDiagnosis, seconds: float) -> str:
    errors = {e.model: " ".join(f"{joint.percent:.1f}" for joint in e.held_out) for e in found.errors}
    return f"| {name} | " + " | ".join(errors[model] for model in MODELS) + f" | {seconds:.1f} |"


def causes(found: TorqueDiagnosis, most: int = 6) -> str:
    named = [effect for effect in found.effects if not effect.standard][:most]
    return ", ".join(
        f"{e.effect} {'+'.join(e.joints)} ({100 * e.share.value:.0f} %, sure {e.probability:.2f})"
        for e in named
    )


def diagnosed(name: str, robot: Robot, recordings: Sequence[Recording], **options: float) -> TorqueDiagnosis:
    start = time.perf_counter()
    found = diagnose(robot, recordings, **options)
    print(row(name, found, time.perf_counter() - start))
    return found


def moved(name: str, robot: Robot, recordings: Sequence[Recording], found: TorqueDiagnosis) -> list[str]:
    """Lines of simulated motion: median of the worst joint, 0.1, 0.5 and 2 s ahead of held-out states."""
    start = time.perf_counter()
    motion = rollout(robot, found, recordings)
    if motion.judgement is None:
        return [f"| {name} | not judged: {motion.why_not} |"]
    judged, lines = motion.judgement, []
    for model in judged.simulated:
        degrees = (math.degrees(judged.worst_joint(model, h)) for h in judged.windows.horizons)
        shown = " | ".join("left" if value > 360.0 else f"{value:.2f}°" for value in degrees)
        lines.append(f"| {name}, {model} | {shown} |")
    windows, seconds = judged.windows.starts.size, time.perf_counter() - start
    return [*lines, f"\n{name}: {windows} windows, {seconds:.1f} s for the four models"]


def main() -> int:
    data = Path(os.environ.get("TRUING_REALDATA", "data"))
    lists: list[str] = []
    motion: list[str] = []
    print("| set | nominal | standard practice | named | s |\n| --- | --- | --- | --- | --- |")
    if (folder := data / "dyn_ur10e").exists():
        found = diagnosed("UR10e, h7_20s + h12_40s", *ur10e(folder, ("h7_20s", "h12_40s")))
        lists.append(f"- UR10e: {causes(found)}")
        motion = moved("UR10e", *ur10e(folder, ("h7_20s", "h12_40s")), found)
        diagnosed("UR10e, ptp10", *ur10e(folder, ("ptp10",)))
        loaded = load_recordings([folder / "h14_50s_load.csv"], found.robot)
        carried = diagnosed("UR10e with a load, against the robot found", found.robot, loaded)
        mass = next((p.value for p in carried.effects[0].parameters if p.name.endswith(".m")), float("nan"))
        lists.append(f"- the load: {causes(carried, 1)}, {mass:.2f} kg")
    if (folder := data / "dyn_tx40").exists():
        robot = robot_of(folder)
        found = diagnosed("TX40", robot, load_recordings([folder / "run.csv"], robot), cutoff=20.0)
        lists.append(f"- TX40: {causes(found)}")
    if (folder := data / "dyn_ur10").exists():
        robot = robot_of(folder)
        found = diagnosed("UR10", robot, load_recordings([folder / "run.csv"], robot))
        lists.append(f"- UR10: {causes(found)}")
    print("\n" + "\n".join(lists))
    if motion:
        print("\n| simulated motion | 0.1 s | 0.5 s | 2 s |\n| --- | --- | --- | --- |")
        print("\n".join(motion))
    return 0 if lists else 1


if __name__ == "__main__":
    sys.exit(main())
