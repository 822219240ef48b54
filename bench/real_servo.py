# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms whose torques nobody knows: simulated motion on held-out recordings, by what others use.

    python bench/real_servo.py [--data FOLDER] [--peers ENVS] [--write PAGE]

FOLDER as for bench/real_data.py; sets that are not there are left out. ENVS: what peers/setup_sysid.sh made.
--write: the page whose markers take the tables.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from servo_replay import Usual, as_published, ask_sysid, firmware_scale, of_file, replay, sysid_task

import truing
from truing.dynamics import Recording, load_recordings
from truing.dynamics.servo import PARAMETERS, ServoDiagnosis, servo_diagnose
from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.api import LONGEST_STEP, prepare
from truing.dynamics.servo.data import Window
from truing.dynamics.servo.firm import firmly
from truing.dynamics.servo.fit import Fitter, rows_of
from truing.dynamics.servo.free import free_value
from truing.dynamics.servo.ground import groundwork, sizes_of
from truing.dynamics.servo.naming import Account, Namer
from truing.dynamics.servo.simulator import chain_of, point_of

ROOT = Path(__file__).resolve().parent.parent
START, END = "<!-- table -->", "<!-- end -->"
XL330_REFERENCE = 200.0  # firmware gain at which the file's gain is taken to hold: it says none
SO101_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
SO101_TRAIN = ("multisine", "step_response")
SO101_MAIN = ("slow_precision", "random_waypoints")
SO101_MORE = ("inertia_coupling", "lissajous_pattern", "pick_place")
WINDOW = 5.0  # [s]
SENSITIVITY_SECONDS, SENSITIVITY_AIM = 140.0, 6.0  # [s]
SENSITIVITY_FIELDS = ("delay", "damping_gain", "viscous_law", "load_friction", "spring")  # beside the usual
ROUND_RECORDINGS, ROUND_AIM = 10, 2.0  # of 6 s each; [s]

Floats = NDArray[np.float64]


def degrees(error: Floats) -> Floats:
    """Rms over rows, joint by joint."""
    return np.asarray(np.degrees(np.sqrt(np.mean(error**2, axis=0))))


def judged(file: Path, usual: Usual, test: Sequence[Recording]) -> float:
    """[deg] rms over all rows of all recordings, replayed by MuJoCo."""
    errors = [
        replay(file, ["q1"], usual, one, firmware_scale(one, XL330_REFERENCE)) - one.position for one in test
    ]
    return float(degrees(np.concatenate(errors))[0])


def xl330(folder: Path, sysid: Path) -> list[str]:
    file = folder / "robot.xml"
    recordings = list(load_recordings(sorted(folder.glob("*.csv")), truing.load_robot(file, any_tool=True)))
    train, test = ([r for r in recordings if r.test == held] for held in (False, True))
    lines = ["**XL330, firmware gain 200 held out**", ""]
    lines += ["| | rms [deg] | on the recordings fitted | processor s |", "| --- | --- | --- | --- |"]
    command = [degrees(np.concatenate([r.command - r.position for r in some]))[0] for some in (test, train)]
    lines.append(f"| the command taken as the response | {command[0]:.2f} | {command[1]:.2f} | |")
    lines.append(f"| the MJCF | {both(file, of_file(file, ['q1']), test, train)} | |")
    lines += by_truing(file, recordings, test, train)
    answer = ask_sysid(sysid, sysid_task(file, ["q1"], train, XL330_REFERENCE))
    if isinstance(answer, str):
        return [*lines, f"| mujoco.sysid, gain, damping, dry friction, rotor | {answer} | | |", ""]
    gain, damping, friction, armature = (
        np.array(answer[name]) for name in ("gain", "damping", "frictionloss", "armature")
    )
    theirs = Usual(gain, damping, friction, armature, np.zeros(1))
    lines.append(
        f"| mujoco.sysid {answer['version']}, gain, damping, dry friction, rotor"
        f" | {both(file, theirs, test, train)} | {answer['processor_seconds']:.1f} |"
    )
    return [*lines, ""]


def both(file: Path, usual: Usual, test: Sequence[Recording], train: Sequence[Recording]) -> str:
    return " | ".join(f"{judged(file, usual, some):.2f}" for some in (test, train))


def by_truing(
    file: Path, recordings: Sequence[Recording], test: Sequence[Recording], train: Sequence[Recording]
) -> list[str]:
    """Its usual parameters, replayed as the peer's; and what it names, in its own simulation."""
    begun = time.process_time()
    of = prepare(file, list(recordings))
    fitter = Fitter(Apart(of.simulator, LONGEST_STEP), rows_of(of.data, of.train))
    standard, _ = groundwork(fitter, point_of(of.arm.nominal), of.data)
    standard = firmly(Namer(fitter, (), 0), standard)
    alone = time.process_time() - begun
    chain = chain_of(standard.point, of.arm.nominal)
    drive = chain.drives[0]
    law = (XL330_REFERENCE / chain.gain_reference) ** drive.gain_law
    values = (drive.command_gain * law, drive.viscous, drive.coulomb, drive.armature, drive.zero)
    usual = both(file, Usual(*(np.array([value]) for value in values)), test, train)
    begun = time.process_time()
    found = servo_diagnose(file, list(recordings))
    seconds = time.process_time() - begun
    named = np.degrees([found.rollout.errors["named"][0, -1], found.rollout.train["named"][0]])
    return [
        f"| truing, gain, damping, dry friction, rotor, zero | {usual} | {alone:.1f} |",
        f"| truing, and what it names: {names_of(found)} | {' | '.join(f'{e:.2f}' for e in named)}"
        f" | {seconds:.1f} |",
    ]


def names_of(found: ServoDiagnosis) -> str:
    more = len(found.chains["named"].joints) > 1
    named = [
        f"{e.effect}{' ' + ', '.join(e.joints) if more else ''} ({e.probability:.2f})"
        for e in found.effects
        if not e.standard
    ]
    return ", ".join(named) or "nothing"


def so101_recordings(folder: Path) -> list[Recording]:
    robot = truing.load_robot(folder / "robot.xml", any_tool=True, tip_link="gripper")  # without the jaw
    names = (*SO101_TRAIN, *SO101_MAIN, *SO101_MORE)
    return [
        one.replace(test=one.name not in SO101_TRAIN)
        for one in load_recordings([folder / f"{name}.csv" for name in names], robot)
    ]


def so101(folder: Path) -> list[str]:
    file = folder / "robot.xml"
    recordings = so101_recordings(folder)
    begun = time.process_time()
    found = servo_diagnose(file, recordings, joints=SO101_JOINTS, window=WINDOW)
    seconds = time.process_time() - begun
    by_name = {r.name: r for r in recordings}
    lines = ["**SO-101, windows of 5 s**", "", "| | J1 … J5 [deg] | mean |", "| --- | --- | --- |"]
    groups = [(" + ".join(SO101_MAIN), SO101_MAIN), *((name, (name,)) for name in SO101_MORE)]
    for title, group in groups:
        own = [by_name[name] for name in group]
        lines.append(f"| *{title}* | | |")
        command = degrees(np.concatenate([one.command - one.position for one in own]))
        published = [as_published(file, SO101_JOINTS, one, WINDOW) - one.position for one in own]
        lines.append(row("the command taken as the response", command))
        lines.append(row("the MJCF", degrees(np.concatenate(published))))
        lines.append(
            row("truing, gain, damping, dry friction, rotor, zero", held_out(found, "standard", own))
        )
        lines.append(row("truing, and what it names", held_out(found, "named", own)))
    lines += [
        "",
        f"truing names: {names_of(found)}; {seconds:.0f} s of the processor for the whole diagnosis.",
    ]
    return [*lines, ""]


def speed(data: Path) -> list[str]:
    """Seconds of what a diagnosis is made of, beside what is aimed at by the clock."""
    lines = [f"**Speed, {os.cpu_count()} cores**", ""]
    lines += ["| | s by the clock | aim | processor s |", "| --- | --- | --- | --- |"]
    if (folder := data / "dyn_so101").exists():
        lines += sensitivities(folder)
    if (folder := data / "dyn_xl330").exists():
        lines.append(one_round(folder))
    return [*lines, ""]


def sensitivities(folder: Path) -> list[str]:
    """Of 50 values over 140 s of five joints, in one batch."""
    of = prepare(folder / "robot.xml", so101_recordings(folder), joints=SO101_JOINTS, window=WINDOW)
    windows: list[Window] = []
    for window in of.train:
        seconds = [w.rows * of.data.streams[w.stream].step for w in windows]
        if sum(seconds) < SENSITIVITY_SECONDS:
            windows.append(window)
    point, apart = point_of(of.arm.nominal), Apart(of.simulator, LONGEST_STEP)
    sizes = sizes_of(apart, point, windows)
    names = [*(name for name, known in PARAMETERS.items() if known.usual), *SENSITIVITY_FIELDS]
    free = [free_value(name, joint, sizes) for name in names for joint in range(len(SO101_JOINTS))]
    ways = (
        (of.simulator, True, "the whole arm in MuJoCo, each value by itself", f"{SENSITIVITY_AIM:g}"),
        (of.simulator, False, "the same, one value at all joints at once", ""),
        (apart, False, "joints apart, as the search takes them", ""),
    )
    lines = []
    for simulator, exact, how, aim in ways:
        fitter, begun = Fitter(simulator, rows_of(of.data, windows)), clocks()
        fitter.columns(point, free, exact)
        what = f"one batch of {len(free)} sensitivities over {SENSITIVITY_SECONDS:g} s of SO-101: {how}"
        lines.append(timed(what, aim, begun))
    return lines


def clocks() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def timed(what: str, aim: str, begun: tuple[float, float]) -> str:
    wall, processor = (now - then for now, then in zip(clocks(), begun, strict=True))
    return f"| {what} | {wall:.1f} | {aim} | {processor:.1f} |"


def one_round(folder: Path) -> str:
    """One joint, a minute of it: all candidates ranked, the best refitted without linearisation."""
    robot = truing.load_robot(folder / "robot.xml", any_tool=True)
    fitted = [one for one in load_recordings(sorted(folder.glob("*.csv")), robot) if not one.test]
    of = prepare(folder / "robot.xml", [one.replace(test=False) for one in fitted[:ROUND_RECORDINGS]])
    rows = rows_of(of.data, of.windows)
    fitter, nominal = Fitter(Apart(of.simulator, LONGEST_STEP), rows), point_of(of.arm.nominal)
    standard, sizes = groundwork(fitter, nominal, of.data)
    namer = Namer(fitter, (), 1)
    count = len(namer.all_candidates(standard.point, sizes)[0])
    length = sum(w.rows * of.data.streams[w.stream].step for w in of.windows)
    begun = clocks()
    best, _ = namer.best_beside(Account(standard, standard, [], sizes, nominal), set())
    what = f"one joint (XL330), {length:.0f} s of it, {count} candidates, refits included: one round"
    return timed(f"{what} ({len(best)} may be named)", f"{ROUND_AIM:g}", begun)


def held_out(found: ServoDiagnosis, model: str, recordings: Sequence[Recording]) -> Floats:
    """[deg] rms of a chain over the rows of all of the recordings, joint by joint."""
    rows = [len(one) for one in recordings]
    squares = [found.rollout.recordings[model][one.name] ** 2 for one in recordings]
    return np.asarray(np.degrees(np.sqrt(np.average(squares, axis=0, weights=rows))))


def row(text: str, error: Floats) -> str:
    return f"| {text} | {' '.join(f'{one:.2f}' for one in error)} | {float(np.mean(error)):.2f} |"


def report(data: Path, sysid: Path) -> list[str]:
    lines: list[str] = []
    if (folder := data / "dyn_xl330").exists():
        lines += xl330(folder, sysid)
    if (folder := data / "dyn_so101").exists():
        lines += so101(folder)
    if lines:
        lines += speed(data)
    print("\n".join(lines))
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("TRUING_REALDATA", "data")))
    parser.add_argument("--peers", type=Path, default=ROOT / "build" / "peers")
    parser.add_argument(
        "--write", type=Path, help=f"the page whose markers {START} and {END} take the tables"
    )
    arguments = parser.parse_args()
    page = arguments.write.read_text(encoding="utf-8") if arguments.write else f"{START}{END}"
    if START not in page or END not in page:
        parser.error(f"{arguments.write} has no markers {START} and {END}")
    lines = report(arguments.data, arguments.peers / "sysid" / "bin" / "python")
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
