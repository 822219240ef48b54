# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques of real arms: held-out errors of truing and of other methods, on the same rows.

    python bench/real_dynamics.py [--data FOLDER] [--rows PROGRAM] [--peers ENVS] [--write PAGE]

FOLDER as for bench/real_data.py; sets that are not there are left out. PROGRAM: bench_dynamics_rows, which
writes the rows for the others (dynamics_peers.py); ENVS: what peers/setup_peers.sh made, for FIGAROH.
--write: the page whose markers take the tables.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
import resource
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import dynamics_ends as ends
import dynamics_peers as peers
import numpy as np
from numpy.typing import NDArray

import truing
from truing.dynamics import (
    Recording,
    TorqueDiagnosis,
    TorqueError,
    check_recordings,
    diagnose,
    load_recordings,
    rollout,
)
from truing.dynamics.rollout import held_out_blocks
from truing.model import Robot

ROOT = Path(__file__).resolve().parent.parent
UR10E_GAINS = (10.0, 10.6956, 8.4566, 9.0029, 9.4800, 10.1232)  # [Nm/A] published beside the recordings
START, END = "<!-- table -->", "<!-- end -->"
USUAL_CUTOFF = 8.0  # [Hz]
AHEAD = 0.5  # [s] of simulated motion, by joint
USUAL_TESTS = (("h7_20s", "h12_40s"), ("ptp10",))  # of the UR10e
ONE_JOINT_AT_A_TIME = ("single_j2", "single_j3", "single_j5")
RUNS = 20  # of which the fastest is told: an hour is a fifth slower than another
SHARES = (0.2, 0.4, 0.5)  # of one recording held out, beside the usual 0.3: other blocks of its time
MOVING = {"standard": "truing, its standard practice", "named": "truing, named"}
HEADER = (
    "| | J1 … J6, held out [%] | × truing | processor s |",
    "| --- | --- | --- | --- |",
)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Arm:
    """A set: what is fitted to what."""

    name: str
    urdf: Path
    robot: Robot
    recordings: list[Recording]
    cutoff: float = USUAL_CUTOFF  # [Hz]


def robot_of(folder: Path, torque_per_ampere: Sequence[float] = ()) -> Robot:
    robot = truing.load_robot(folder / "robot.urdf", any_tool=True)
    for index, gain in zip(robot.driven_joints(), torque_per_ampere, strict=False):
        robot.joints[index].torque_per_ampere = gain
    return robot


def ur10e(folder: Path, held_out: Sequence[str], left_out: Sequence[str] = ()) -> Arm:
    """Fitted: all recordings without a load that are not marked as test, but those that are `left_out`."""
    robot = robot_of(folder, UR10E_GAINS)
    files = [file for file in sorted(folder.glob("*.csv")) if not file.stem.endswith("_load")]
    recordings = [
        one.replace(test=one.name in held_out)
        for one in load_recordings(files, robot)
        if one.name in held_out or not (one.test or one.name in left_out)
    ]
    checked = check_recordings(robot, recordings)
    return Arm(
        f"UR10e, {' + '.join(held_out)}", folder / "robot.urdf", checked.robot, list(checked.recordings)
    )


def one_recording(name: str, folder: Path, cutoff: float | None = None) -> Arm:
    """cutoff: [Hz]; None: as the recording shows it."""
    robot = robot_of(folder)
    checked = check_recordings(robot, load_recordings([folder / "run.csv"], robot))
    cutoff = cutoff or checked.cutoff
    return Arm(name, folder / "robot.urdf", checked.robot, list(checked.recordings), cutoff)


def arms(data: Path) -> list[Arm]:
    found = []
    if (folder := data / "dyn_ur10e").exists():
        found += [ur10e(folder, held_out) for held_out in USUAL_TESTS]
    if (folder := data / "dyn_tx40").exists():
        found.append(one_recording("TX40", folder, cutoff=20.0))
    if (folder := data / "dyn_ur10").exists():
        found.append(one_recording("UR10", folder))
    return found


# ---- Tables ------------------------------------------------------------------------------------------


def line(name: str, percent: Floats, named: Floats, seconds: float | None = None) -> str:
    """A row of the table: × truing is the geometric mean over the joints."""
    times = float(np.exp(np.mean(np.log(percent / named))))
    took = "" if seconds is None else f"{seconds:.1f}"
    return f"| {name} | {' '.join(f'{one:.1f}' for one in percent)} | {times:.2f} | {took} |"


def joints_of(found: TorqueDiagnosis, model: str, moving: bool = False) -> Sequence[TorqueError]:
    """Held-out errors of every joint. moving: of rows in which the joint moves."""
    errors = next(e for e in found.errors if e.model == model)
    return errors.in_motion if moving else errors.held_out


def percent_of(found: TorqueDiagnosis, model: str, moving: bool = False) -> Floats:
    return np.array([joint.percent for joint in joints_of(found, model, moving)])


def causes(found: TorqueDiagnosis, most: int = 6) -> str:
    named = [effect for effect in found.effects if not effect.standard][:most]
    return ", ".join(
        f"{e.effect} {'+'.join(e.joints)} ({100 * e.share.value:.0f} %, sure {e.probability:.2f})"
        for e in named
    )


def unknown(found: TorqueDiagnosis) -> str:
    """In words; "" for none."""
    said = [f"{u.joint} over {' and '.join(u.inputs)} (sure {u.probability:.2f})" for u in found.unknown]
    return f" Unknown: {', '.join(said)}." if said else ""


def waves(found: TorqueDiagnosis) -> str:
    """What is left and repeats many times a turn, in words; "" for nothing."""
    said = [
        f"{o.order:g} a turn of {o.joint}{' with the direction of motion' if o.with_direction else ''}"
        f" ({o.amplitude:.2f} Nm, {100 * o.share:.1f} % of what is left there)"
        for o in found.orders
    ]
    return f" Waves that are left: {', '.join(said)}." if said else ""


def processor_seconds() -> float:
    """Of this process and those that it has waited for: other work on the machine does not count."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def methods(figaroh: Path | None) -> list[tuple[str, Callable[[peers.Rows], Floats]]]:
    return [
        ("base parameters, Coulomb, viscous, offset, weighted", peers.standard),
        ("the same and rotor inertias", peers.with_rotors),
        ("FIGAROH", functools.partial(peers.figaroh, python=figaroh)),
        ("every column of the catalogue, one ridge", peers.ridge),
        ("boosted trees", peers.trees),
        ("boosted trees on standard practice", peers.trees_on_standard),
    ]


def compared(arm: Arm, program: Path | None, figaroh: Path | None) -> tuple[TorqueDiagnosis, list[str]]:
    """The diagnosis, and the table of everybody."""
    start = processor_seconds()
    found = diagnose(arm.robot, arm.recordings, cutoff=arm.cutoff)
    seconds = processor_seconds() - start
    named = percent_of(found, "named")
    lines = [f"**{arm.name}**, low-passed at {arm.cutoff:g} Hz", "", *HEADER]
    lines.append(line("the URDF", percent_of(found, "nominal"), named))
    lines.append(line("truing, its standard practice", percent_of(found, "standard"), named))
    lines.append(line("**truing, named**", named, named, seconds))
    words = "truing, named, and what has no name"
    lines.append(line(words, percent_of(found, "with_unknown"), named))
    in_motion = percent_of(found, "named", moving=True)
    for model, words in MOVING.items():
        percent = percent_of(found, model, moving=True)
        lines.append(line(f"{words}, rows in which the joint moves", percent, in_motion))
    if program is None:
        return found, lines
    rows = peers.rows_of(program, arm.urdf, arm.robot, arm.recordings, arm.cutoff)
    if not np.allclose(rows.percent(rows.nominal), percent_of(found, "nominal"), rtol=1e-6):
        raise SystemExit(
            f"{arm.name}: {program} writes other rows than those of the diagnosis: build it again"
        )
    for name, method in methods(figaroh):
        start = processor_seconds()
        try:
            percent = rows.percent(method(rows))
        except peers.NotInstalledError as error:
            lines.append(f"| {name} | {error} | | |")
        else:
            lines.append(line(name, percent, named, processor_seconds() - start))
    return found, lines


def splits(arm: Arm) -> list[str]:
    """One recording with other blocks of its time held out, and with the usual low-pass."""
    lines = ["| low-pass | held out, of ten blocks | standard practice | named | with the unknown |"]
    lines.append("| --- | --- | --- | --- | --- |")
    for cutoff in (arm.cutoff, *([USUAL_CUTOFF] if arm.cutoff < USUAL_CUTOFF else [])):
        for share in (0.3, *SHARES):
            found = diagnose(arm.robot, arm.recordings, cutoff=cutoff, test_share=share)
            (spans,) = held_out_blocks(arm.recordings, share)
            begin, end = arm.recordings[0].time[0], arm.recordings[0].time[-1]
            blocks = ", ".join(f"{1 + round(10 * (one[0] - begin) / (end - begin))}" for one in spans)
            errors = [percent_of(found, model) for model in ("standard", "named", "with_unknown")]
            shown = " | ".join(" ".join(f"{one:.1f}" for one in row) for row in errors)
            lines.append(f"| {cutoff:g} Hz | {blocks} | {shown} |")
    return [*lines, ""]


def fewer_rows(folder: Path) -> list[str]:
    """Recordings that move one joint at a time are not fitted: in them most joints rest."""
    lines = ["**UR10e, recordings that move one joint at a time not fitted**", ""]
    lines += ["| held out | standard practice | named | named, rows in which the joint moves |"]
    lines += ["| --- | --- | --- | --- |"]
    for held_out in (*USUAL_TESTS, ONE_JOINT_AT_A_TIME):
        arm = ur10e(folder, held_out, left_out=ONE_JOINT_AT_A_TIME)
        found = diagnose(arm.robot, arm.recordings, cutoff=arm.cutoff)
        kinds = (("standard", False), ("named", False), ("named", True))
        errors = [[(e.percent, e.n) for e in joints_of(found, *kind)] for kind in kinds]
        shown = " | ".join(" ".join(f"{p:.1f}" if n > 0 else "–" for p, n in joints) for joints in errors)
        lines.append(f"| {' + '.join(held_out)} | {shown} |")
    return [*lines, ""]


def without_ends(folder: Path) -> list[str]:
    """What was fitted to the fewer recordings, judged where no recording begins or ends."""
    lines = [f"**UR10e, without the first and last {ends.END:g} s of each recording**, the same fit", ""]
    lines += ["| held out | the URDF | standard practice, fitted to such rows | named |"]
    lines += ["| --- | --- | --- | --- |"]
    for held_out in USUAL_TESTS:
        arm = ur10e(folder, held_out, left_out=ONE_JOINT_AT_A_TIME)
        robot = diagnose(arm.robot, arm.recordings, cutoff=arm.cutoff).robot
        fitted, tested = (
            ends.rows_without_ends(
                arm.urdf, robot, [one for one in arm.recordings if one.test == test], arm.cutoff
            )
            for test in (False, True)
        )
        models = (tested.nominal, ends.standard_practice(fitted, tested), tested.named)
        errors = [peers.percent(model, tested.measured) for model in models]
        shown = " | ".join(" ".join(f"{one:.1f}" for one in joints) for joints in errors)
        lines.append(f"| {' + '.join(held_out)} | {shown} |")
    return [*lines, ""]


def fitted_rows(arm: Arm) -> int:
    return sum(len(one.time) for one in arm.recordings if not one.test)


def seconds_of(folder: Path) -> list[str]:
    """The whole diagnosis by the clock."""
    threads = len(os.sched_getaffinity(0))
    lines = [f"**Seconds of a diagnosis of the UR10e**, {threads} threads, the fastest of {RUNS} runs", ""]
    lines += [
        "| recordings fitted | their rows | by the clock | of the processor |",
        "| --- | --- | --- | --- |",
    ]
    sets = {
        "that move all joints at once": ur10e(folder, USUAL_TESTS[0], left_out=ONE_JOINT_AT_A_TIME),
        "all": ur10e(folder, USUAL_TESTS[0]),
    }
    for name, arm in sets.items():
        runs = []
        for _ in range(RUNS):
            clock, processor = time.perf_counter(), processor_seconds()
            diagnose(arm.robot, arm.recordings, cutoff=arm.cutoff)
            runs.append((time.perf_counter() - clock, processor_seconds() - processor))
        clock, processor = min(runs)
        lines.append(f"| {name} | {fitted_rows(arm)} | {clock:.2f} | {processor:.2f} |")
    return [*lines, ""]


def loaded(robot: Robot, file: Path) -> list[str]:
    """The recording with a load that nobody told, against the robot that was found."""
    untold = [
        one.replace(columns={name: of for name, of in one.columns.items() if name != "payload_kg"})
        for one in load_recordings([file], robot)
    ]
    found = diagnose(robot, check_recordings(robot, untold).recordings)
    mass = next((p.value for p in found.effects[0].parameters if p.name.endswith(".m")), float("nan"))
    named = percent_of(found, "named")
    lines = ["**UR10e with a load, against the robot found**", "", *HEADER]
    lines += [line("the robot found", percent_of(found, "nominal"), named), line("**named**", named, named)]
    return [*lines, "", f"Named: {causes(found, 1)}: {mass:.2f} kg.", ""]


def report(data: Path, program: Path | None, figaroh: Path | None) -> list[str]:
    lines: list[str] = []
    for number, arm in enumerate(arms(data)):
        found, table = compared(arm, program, figaroh)
        lines += [*table, "", f"Named: {causes(found)}.{unknown(found)}{waves(found)}", ""]
        print("\n".join(lines[-len(table) - 3 :]), flush=True)
        file = data / "dyn_ur10e" / "h14_50s_load.csv"
        if number == 0:
            lines += ["| simulated motion | 0.1 s | 0.5 s | 2 s | J1 … J6, 0.5 s |"]
            lines += ["| --- | --- | --- | --- | --- |"]
            lines += [*moved(arm.name, arm.robot, arm.recordings, found), ""]
        if number == 0 and file.exists():
            lines += loaded(found.robot, file)
        if len(arm.recordings) == 1:
            lines += splits(arm)
    if (data / "dyn_ur10e").exists():
        folder = data / "dyn_ur10e"
        more = [*fewer_rows(folder), *without_ends(folder), *seconds_of(folder)]
        print("\n".join(more), flush=True)
        lines += more
    return lines


def moved(name: str, robot: Robot, recordings: Sequence[Recording], found: TorqueDiagnosis) -> list[str]:
    """Lines of simulated motion: median of the worst joint, 0.1, 0.5 and 2 s ahead of held-out states, and of
    every joint."""
    start = processor_seconds()
    motion = rollout(robot, found, recordings)
    if motion.judgement is None:
        return [f"| {name} | not judged: {motion.why_not} |"]
    judged, lines = motion.judgement, []
    for model in judged.simulated:
        worst = " | ".join(degrees(judged.worst_joint(model, h)) for h in judged.windows.horizons)
        joints = np.median(np.abs(judged.errors(model, AHEAD)), axis=0)
        lines.append(f"| {name}, {model} | {worst} | {' '.join(map(degrees, joints))} |")
    windows, seconds = judged.windows.starts.size, processor_seconds() - start
    return [*lines, f"\n{name}: {windows} windows, {seconds:.1f} s of processor time for the four models"]


def degrees(radians: float) -> str:
    return "left" if radians > 2.0 * math.pi else f"{math.degrees(radians):.2f}°"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("TRUING_REALDATA", "data")))
    parser.add_argument("--rows", type=Path, help="bench_dynamics_rows; without it truing alone is judged")
    parser.add_argument("--peers", type=Path, default=ROOT / "build" / "peers")
    parser.add_argument(
        "--write", type=Path, help=f"the page whose markers {START} and {END} take the tables"
    )
    arguments = parser.parse_args()
    page = arguments.write.read_text(encoding="utf-8") if arguments.write else f"{START}{END}"
    if START not in page or END not in page:
        parser.error(f"{arguments.write} has no markers {START} and {END}")
    figaroh = arguments.peers / "numpy2" / "bin" / "python"
    lines = report(arguments.data, arguments.rows, figaroh)
    if not lines:
        print(f"{arguments.data}: none of the recordings is there", file=sys.stderr)
        return 1
    if arguments.write:
        begin, end = page.index(START) + len(START), page.index(END)
        text = page[:begin] + "\n" + "\n".join(lines) + page[end:]
        arguments.write.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
