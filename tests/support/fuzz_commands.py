# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The commands of truing on files with faults, each in a process of its own with limits of time and memory.

    python tests/support/fuzz_commands.py FOLDER --cases 500 --seed 1 --jobs 2

A case is its seed and its number: `--only 137` runs that one again and leaves its files in FOLDER. What may
come of it is an exit status of 0, 1 or 2, with 2 one line on stderr and no file; nothing else. Everything is
imported once, and every case is a fork of that: most of a command's time is otherwise its imports.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import random
import re
import resource
import shutil
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fuzz_inputs import write_inputs
from fuzzing import TOKENS
from handeye_scenes import scene, write_scene
from scene_files import SCENE

SECONDS = 60  # a case may take so long
MEMORY = 3_000_000_000  # [bytes] a case may add so much

ROBOT = b"""\
format: truing-robot/1
name: arm
units: {length: mm, angle: deg, mass: kg}
convention: dh
joints:
  - {name: J1, type: revolute, theta: 0, d: 290, a: 10, alpha: -90, limits: [-165, 165], mass: 5}
  - {name: J2, type: revolute, theta: -90, d: 0, a: 270, alpha: 0, limits: [-110, 110]}
  - {name: J3, type: revolute, theta: 0, d: 10, a: 170, alpha: 90, limits: [-110, 70]}
tool: {xyz: [0, 10, 109], rpy: [10, 20, -30]}
"""
URDF = b"""\
<robot name="arm"><link name="base"/><link name="upper"/><link name="middle"/><link name="hand"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.29" rpy="0 0 0"/>
<axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="upper"/><child link="middle"/>
<origin xyz="0.01 0 0" rpy="-1.5708 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1.9" upper="1.9" effort="1" velocity="1"/></joint>
<joint name="j3" type="revolute"><parent link="middle"/><child link="hand"/>
<origin xyz="0.27 0 0" rpy="0 0 0"/>
<axis xyz="0 0 1"/><limit lower="-1.9" upper="1.2" effort="1" velocity="1"/></joint></robot>
"""

TOOLS = ["--tool", "0,0,100,0,0,0", "--frame", "0,0,0,0,0,0"]  # of whatever name
STREAMS = ["--imu", "imu.csv", "--tracker", "tracker.csv", "--joints", "joints.csv"]
COMMANDS: dict[str, tuple[tuple[str, ...], list[str]]] = {
    "identify": (("robot.yaml", "data.csv"), ["identify", "robot.yaml", "data.csv"]),
    "identify --loss": (
        ("robot.yaml", "data.csv"),
        ["identify", "robot.yaml", "data.csv", "--loss", "huber"],
    ),
    "predict": (("robot.yaml", "data.csv"), ["predict", "robot.yaml", "data.csv"]),
    "predict urdf": (("arm.urdf", "data.csv"), ["predict", "arm.urdf", "data.csv"]),
    "simulate": (("robot.yaml",), ["simulate", "robot.yaml", "--poses", "20"]),
    "simulate urdf": (("arm.urdf",), ["simulate", "arm.urdf", "--poses", "20"]),
    "plan": (("robot.yaml",), ["plan", "robot.yaml", "--poses", "12"]),
    "diagnose": (("robot.yaml", "data.csv"), ["diagnose", "robot.yaml", "data.csv"]),
    "handeye": (("poses.csv",), ["handeye", "poses.csv"]),
    "ik": (
        ("robot.yaml", "targets.csv", "scene.yaml"),
        ["ik", "robot.yaml", "targets.csv", "--task", "point", "--scene", "scene.yaml"],
    ),
    "compensate": (
        ("robot.yaml", "found.yaml", "targets.csv"),
        ["compensate", "robot.yaml", "found.yaml", "targets.csv", "--task", "point"],
    ),
    "track calibrate": (
        ("boom.yaml", "imu.csv", "tracker.csv", "joints.csv"),
        ["track", "calibrate", "boom.yaml", *STREAMS],
    ),
    "track run": (
        ("boom.yaml", "setup.yaml", "imu.csv", "tracker.csv", "joints.csv", "plan.csv"),
        ["track", "run", "boom.yaml", "--setup", "setup.yaml", *STREAMS, "--plan", "plan.csv"],
    ),
    "dynamics identify": (
        ("moving.yaml", "motion1.csv", "motion2.csv"),
        ["dynamics", "identify", "moving.yaml", "motion1.csv", "motion2.csv"],
    ),
    "dynamics diagnose": (
        ("moving.yaml", "motion1.csv", "motion2.csv"),
        ["dynamics", "diagnose", "moving.yaml", "motion1.csv", "motion2.csv"],
    ),
    "dynamics predict": (
        ("moving.yaml", "motion1.csv"),
        ["dynamics", "predict", "moving.yaml", "motion1.csv", "--simulate", "0.5s"],
    ),
    "dynamics plan": (("moving.yaml",), ["dynamics", "plan", "moving.yaml", "--columns", "current,payload"]),
    "dynamics compare": (
        ("moving.xml", "moving.yaml", "motion1.csv"),
        ["dynamics", "compare", "moving.xml", "moving.yaml", "motion1.csv"],
    ),
    "dynamics export": (("moving.yaml",), ["dynamics", "export", "moving.yaml", "--to", "mjcf"]),
    "apply kuka": (
        ("kuka.yaml", "kuka_real.yaml", "kuka_points.src", "kuka_points.dat"),
        ["apply", "kuka_points.src", *TOOLS, "--nominal", "kuka.yaml", "--real", "kuka_real.yaml"],
    ),
    "apply abb": (
        ("abb.yaml", "abb_real.yaml", "abb_named.mod"),
        ["apply", "abb_named.mod", "--nominal", "abb.yaml", "--real", "abb_real.yaml"],
    ),
    "apply fanuc": (
        ("fanuc.yaml", "fanuc_real.yaml", "fanuc_plain.ls"),
        ["apply", "fanuc_plain.ls", *TOOLS, "--nominal", "fanuc.yaml", "--real", "fanuc_real.yaml"],
    ),
    "apply ur": (
        ("ur.yaml", "ur_real.yaml", "ur_waypoints.script"),
        ["apply", "ur_waypoints.script", "--nominal", "ur.yaml", "--real", "ur_real.yaml"],
    ),
    "apply yaskawa": (
        ("yaskawa.yaml", "yaskawa_real.yaml", "yaskawa_mixed.jbi"),
        ["apply", "yaskawa_mixed.jbi", *TOOLS, "--nominal", "yaskawa.yaml", "--real", "yaskawa_real.yaml"],
    ),
    "ik program": (("ur.yaml", "ur_waypoints.script"), ["ik", "ur.yaml", "ur_waypoints.script"]),
    **{
        f"export {to}": (
            ("robot.yaml", "found.yaml"),
            ["export", "found.yaml", "--to", to, "--nominal", "robot.yaml"],
        )
        for to in ("frames", "urdf", "ros2_control", "tf", "zeros")
    },
    "export lerobot": (
        ("follower.json", "so.urdf"),
        ["export", "so.urdf", "--to", "lerobot", "--nominal", "so.urdf", "--calibration", "follower.json"],
    ),
    "load conf": (("calibration.conf",), ["load", "calibration.conf", "--arm", "ur5"]),
    "load urp": (("program.urp",), ["load", "program.urp"]),
    "load plain urp": (("plain.urp",), ["load", "plain.urp"]),
    "load moc": (("MOC.cfg",), ["load", "MOC.cfg"]),
    "load lerobot": (("follower.json", "so.urdf"), ["load", "follower.json@so.urdf"]),
    "performance plan": (("ur.yaml",), ["performance", "plan", "ur.yaml", "--edge", "0.3m"]),
    "performance report": (
        ("commanded.csv", "measured.csv"),
        ["performance", "report", "measured.csv", "--commanded", "commanded.csv"],
    ),
}
# Those that take long where nothing is wrong come up less often.
SLOW = ("diagnose", "track calibrate", "track run", "dynamics diagnose", "performance plan")
WEIGHTS = {**dict.fromkeys(SLOW, 0.4), "dynamics plan": 0.1}

NUMBERS = [
    "1e160",
    "-1e308",
    "9" * 160,
    "1e50",
    "nan",
    "inf",
    "-0",
    "0",
    "1e-300",
    "-1",
    "1e5",
    "1000.5",
    "3.2e2",
]
NAMES = [
    "arm [/x]",
    "[bold]",
    "<!--<script>",
    "\x1b[31m",
    "\u202e",
    "a" * 300,
    "../../x",
    "%s",
    "{}",
    "\ud800",
]
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"\b[A-Za-z]\w*")


# ---- Faults --------------------------------------------------------------------------------------


def mutated(data: bytes, draw: random.Random) -> bytes:
    """`data` with one to four faults."""
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        data = draw.choice(FAULTS)(data, draw)
    return data


def put_token(data: bytes, draw: random.Random) -> bytes:
    start = draw.randint(0, len(data))
    return data[:start] + draw.choice(TOKENS) + data[min(len(data), start + draw.choice((0, 1, 5, 20))) :]


def put_number(data: bytes, draw: random.Random) -> bytes:
    return _replaced(data, draw, _NUMBER, draw.choice(NUMBERS).encode())


def put_spike(data: bytes, draw: random.Random) -> bytes:
    spike = draw.choice((1.0, 100.0, -1000.0, 1e6))
    places = list(_NUMBER.finditer(data))
    if not places:
        return data
    place = draw.choice(places)
    return data[: place.start()] + repr(float(place[0]) + spike).encode() + data[place.end() :]


def put_name(data: bytes, draw: random.Random) -> bytes:
    return _replaced(data, draw, _WORD, draw.choice(NAMES).encode("utf-8", "surrogatepass"))


def _replaced(data: bytes, draw: random.Random, pattern: re.Pattern[bytes], new: bytes) -> bytes:
    places = list(pattern.finditer(data))
    if not places:
        return data
    place = draw.choice(places)
    return data[: place.start()] + new + data[place.end() :]


def swap_lines(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    i, k = draw.randrange(len(lines)), draw.randrange(len(lines))
    lines[i], lines[k] = lines[k], lines[i]
    return b"\n".join(lines)


def drop_lines(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    return b"\n".join(lines[: draw.choice((1, 2, 3, 5, len(lines) // 2))] + lines[len(lines) :])


def double_part(data: bytes, draw: random.Random) -> bytes:
    start = draw.randint(0, len(data))
    return data[: min(len(data), start + draw.choice((10, 200)))] + data[start:]


def cut(data: bytes, draw: random.Random) -> bytes:
    return data[: draw.randint(0, len(data))]


def change_column(data: bytes, draw: random.Random) -> bytes:
    """Every number of a column made equal, enlarged, emptied; in a file without columns nothing happens."""
    lines = data.split(b"\n")
    count = lines[0].count(b",") + 1
    if count < 3:
        return data
    column, how = draw.randrange(count), draw.choice(("equal", "mm", "empty", "gone"))
    out = []
    for number, line in enumerate(lines):
        cells = line.split(b",")
        if len(cells) == count and how == "gone":
            del cells[column]
        elif len(cells) == count and number:
            cells[column] = {
                "equal": b"0.25",
                "mm": cells[column] + b"e3",
                "empty": b"",
            }[how]
        out.append(b",".join(cells))
    return b"\n".join(out)


FAULTS = (
    put_token, put_number, put_number, put_spike, put_spike, put_name, swap_lines, drop_lines, double_part,
    cut, change_column, change_column,
)  # fmt: skip


# ---- A case --------------------------------------------------------------------------------------


class Case(NamedTuple):
    number: int
    name: str
    arguments: list[str]
    files: dict[str, bytes]


def case_of(seed: int, number: int, sound: dict[str, bytes]) -> Case:
    draw = random.Random(f"{seed}:{number}")
    names = list(COMMANDS)
    name = draw.choices(names, [WEIGHTS.get(name, 1.0) for name in names])[0]
    inputs, arguments = COMMANDS[name]
    files = {file: sound[file] for file in inputs}
    for _ in range(draw.choice((1, 1, 1, 2))):
        file = draw.choice(inputs)
        if draw.random() < 0.03:
            files[file] = draw.choice(list(sound.values()))  # another kind of file
        else:
            files[file] = mutated(files[file], draw)
    return Case(number, name, [*arguments, "--out", "out"], files)


def run_case(case: Case, folder: Path) -> tuple[str, float]:
    """What is wrong with its outcome ("": nothing), and how long it took [s]."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, data in case.files.items():
        (folder / name).write_bytes(data)
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        _child(case, folder)
    while True:
        done, status, _ = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() - start > SECONDS:
            os.kill(child, signal.SIGKILL)
            os.wait4(child, 0)
            return f"hangs for more than {SECONDS} s", time.monotonic() - start
        time.sleep(0.002)
    return _fault_of(case, folder, status), time.monotonic() - start


def _child(case: Case, folder: Path) -> None:
    code = 77
    try:
        os.chdir(folder)
        for descriptor, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(f"../{folder.name}.{name}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), descriptor)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        from truing.cli import main

        code = main(case.arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        os._exit(code)


def _fault_of(case: Case, folder: Path, status: int) -> str:
    said = (folder.parent / f"{folder.name}.stderr").read_text(encoding="utf-8", errors="replace")
    out = (folder.parent / f"{folder.name}.stdout").read_bytes()
    if os.WIFSIGNALED(status):
        return f"is ended by signal {os.WTERMSIG(status)}"
    code = os.WEXITSTATUS(status)
    if "Traceback" in said or code not in (0, 1, 2):
        return f"exit status {code}: {' '.join(said.split())[-600:]}"
    if "\x1b" in said or b"\x1b" in out:
        return "an escape sequence reached the terminal"
    if "the memory does not suffice" in said:
        return f"takes more than {MEMORY // 10**9} GB"
    left = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} - set(case.files)
    if any(".truing-" in name for name in left):
        return f"left {sorted(left)[:3]}"
    if code == 2 and (left or out or not is_refused(said)):
        return f"exit status 2, files {sorted(left)[:3]}, stdout {out[:80]!r}, stderr {said[-300:]!r}"
    if code == 0 and not left & {"out/result.json", "out/measurements.csv", "out"}:
        return f"exit status 0 without a result: {sorted(left)[:3]}"
    return ""


def is_refused(said: str) -> bool:
    """Whether the last line says why, and only that; warnings may come before it."""
    lines = said.splitlines()
    return [line.startswith("truing: ") for line in lines] == [False] * (len(lines) - 1) + [True]


# ---- All of them ---------------------------------------------------------------------------------


def write_sound_files(folder: Path, seconds: int = 4) -> None:
    """Whatever the arguments in COMMANDS name. seconds: of the recording of a robot that sways."""
    from truing.cli import main
    from truing.examples import example

    for name, data in (
        ("robot.yaml", ROBOT),
        ("arm.urdf", URDF),
        ("scene.yaml", SCENE.replace(b"J4", b"J3")),
    ):
        (folder / name).write_bytes(data)
    write_scene(folder / "poses.csv", scene(12, seed=1))
    write_inputs(folder)
    shutil.copy(example("large_boom"), folder / "boom.yaml")
    sim, found, stream = (folder / name for name in ("sim", "found", "stream"))
    for arguments in (
        ["simulate", folder / "robot.yaml", "--poses", 40, "--seed", 1, "--out", sim],
        ["identify", sim / "robot.yaml", sim / "measurements.csv", "--out", found],
        [
            "simulate",
            folder / "boom.yaml",
            "--stream",
            "--seconds",
            f"{seconds}s",
            "--seed",
            1,
            "--out",
            stream,
        ],
    ):
        assert main([str(word) for word in arguments]) == 0
    shutil.copy(sim / "measurements.csv", folder / "data.csv")
    shutil.copy(found / "robot.yaml", folder / "found.yaml")
    for name in ("imu.csv", "tracker.csv", "joints.csv", "plan.csv", "setup.yaml"):
        shutil.copy(stream / name, folder / name)
    rng = np.random.default_rng(1)
    rows = [",".join(f"{v:.4f}" for v in rng.uniform([0.15, -0.2, 0.3], [0.3, 0.2, 0.6])) for _ in range(8)]
    (folder / "targets.csv").write_text("x_m,y_m,z_m\n" + "\n".join(rows) + "\n")


def sound_files(folder: Path) -> dict[str, bytes]:
    """The files before they are damaged, made by the program itself."""
    folder.mkdir(parents=True, exist_ok=True)
    pid = os.fork()  # whatever threads this starts end with it
    if pid == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        write_sound_files(folder)
        os._exit(0)
    if os.waitpid(pid, 0)[1] != 0:
        raise SystemExit("the sound files could not be made")
    names = {name for inputs, _ in COMMANDS.values() for name in inputs}
    return {name: (folder / name).read_bytes() for name in sorted(names)}


def import_all() -> None:
    """What commands import when they run."""
    import cv2
    import rich.console
    import rich.progress
    import rich.table

    import truing
    from truing.report.page import Page

    assert cv2 and rich and truing.load_robot
    assert Page("").html()  # its script is compressed once
    package = Path(truing.__file__).parent
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package.parent).with_suffix("").parts
        if "exam" not in parts and parts[-1] not in ("__init__", "__main__"):
            importlib.import_module(".".join(parts))


def _share(seed: int, numbers: Sequence[int], folder: Path, sound: dict[str, bytes]) -> Iterator[str]:
    for number in numbers:
        case = case_of(seed, number, sound)
        fault, seconds = run_case(case, folder)
        yield f"{number}\t{case.name}\t{seconds:.2f}\t{fault}\n"
    with contextlib.suppress(OSError):
        shutil.rmtree(folder)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", type=int)
    options = parser.parse_args()
    folder = options.folder.absolute()
    sound = sound_files(folder / "sound")
    import_all()
    if options.only is not None:
        case = case_of(options.seed, options.only, sound)
        fault, seconds = run_case(case, folder / "case")
        sys.stdout.write(
            f"truing {' '.join(case.arguments)}\n{seconds:.2f} s\n{fault or 'as it should be'}\n"
        )
        return 1 if fault else 0
    workers = []
    for job in range(options.jobs):
        pid = os.fork()
        if pid == 0:
            log = (folder / f"log.{job}").open("w", encoding="utf-8", errors="backslashreplace")
            for line in _share(
                options.seed, range(job, options.cases, options.jobs), folder / f"case.{job}", sound
            ):
                log.write(line)
                log.flush()
            os._exit(0)
        workers.append(pid)
    for pid in workers:
        os.waitpid(pid, 0)
    lines = [
        line.split("\t")
        for job in range(options.jobs)
        for line in (folder / f"log.{job}").read_text(encoding="utf-8").splitlines()
    ]
    faults = [line for line in lines if line[3]]
    for name, count in Counter(line[1] for line in lines).items():
        seconds = sum(float(line[2]) for line in lines if line[1] == name)
        sys.stdout.write(f"{name}: {count} cases, {seconds:.1f} s\n")
    for number, name, _, fault in faults:
        sys.stdout.write(f"FAULT {number} ({name}): {fault}\n")
    sys.stdout.write(f"{len(lines)} cases of {options.cases}, {len(faults)} faults\n")
    return 0 if len(lines) == options.cases and not faults else 1


if __name__ == "__main__":
    sys.exit(main())
