# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""truing's inverse kinematics beside others', on the same robots, targets and seeds in one run.

    bench/peers/setup_inverse.sh PEERS                # once: the peers, in an environment of their own
    python bench/inverse.py --peers PEERS [--quick] [--only branches,one,...]
                            [--write docs/benchmarks/inverse.md]

Robots and targets are those of bench/inverse.cpp (seeds 7 and 13; errors of the calibrated robots 11, 12,
14), which writes them and truing's answers
into a folder; bench/peers/inverse_peers.py hands them to one peer at a time. Every answer, truing's too, is
judged here by Pinocchio's
forward kinematics of a chain that is built from the link parameters apart from the library. `--write` puts
the tables between the markers of the page.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

PEER_FOLDER = Path(__file__).resolve().parent / "peers"
sys.path.insert(0, str(PEER_FOLDER))
from inverse_chain import Cases, Chain, read_cases, read_chains  # noqa: E402
from inverse_peers import PEERS  # noqa: E402

Floats = NDArray[np.float64]
METRES = RADIANS = 1e-6
BEYOND = 1e-6  # of limits, before an answer is called wrong [rad | m]
ROUNDING = 1e-9  # a fraction of the tolerances
JUMP = 0.1  # on a path whose steps are a tenth of it [rad | m]
SAME = 1e-4  # branches that differ by less are one [rad]
NEAR = 1e-2  # and rough ones are near one [rad]
WITHOUT_LIMITS = (
    "EAIK",
)  # knows none: whole turns are added here, and what stays outside is left out, not held against it
LEFT_OUT = {
    "tracikpy": "pip finds no distribution; pytracik is the same TRAC-IK",
    "kinpy": "minimises by BFGS without joint limits and without a word on success",
    "Tesseract": (
        "its grid over rails takes files of its own for every robot; rebuilt here from truing's own branches"
    ),
}


@dataclass
class Result:
    """One program on one task and robot."""

    who: str
    task: str
    robot: str
    targets: int
    median_us: float = math.nan
    p99_us: float = math.nan
    reached: float = math.nan  # fraction of the targets with an answer that holds
    wrong: int = 0  # answers that were said to hold and do not
    worst: float = 0.0  # error of the worst of these [m | rad]
    note: str = ""
    branches: list[list[Floats]] = field(default_factory=list)  # those that hold, a list a target
    rough: list[tuple[int, Floats]] = field(
        default_factory=list
    )  # those that the program itself says are not good enough: target, joints
    raw: dict[str, Any] = field(default_factory=dict)  # of truing.jsonl


# ---- Judging -------------------------------------------------------------------------------------


class Oracle:
    """Forward kinematics by Pinocchio."""

    def __init__(self, chain: Chain) -> None:
        self.chain, self.model, self.last = chain, pin.Model(), 0
        for k in range(chain.joints):
            joint = pin.JointModelPZ() if chain.prismatic[k] else pin.JointModelRZ()
            self.last = self.model.addJoint(self.last, joint, pin.SE3(chain.placements[k]), f"joint{k}")
        self.data = self.model.createData()

    def tip(self, q: Floats) -> Floats:
        """(4, 4), T_measurement_target."""
        pin.forwardKinematics(self.model, self.data, q)
        return np.asarray(self.data.oMi[self.last].homogeneous @ self.chain.tool)

    def within_limits(self, q: Floats) -> bool:
        return bool(np.all(q >= self.chain.lower - BEYOND) and np.all(q <= self.chain.upper + BEYOND))

    def miss(self, q: Floats, wanted: Floats, torch: bool) -> float:
        """How far from the task: the larger of position [m] and angle [rad], of the tool's z alone for a
        torch; infinite for joints beyond limits.
        """
        if not np.all(np.isfinite(q)) or not self.within_limits(q):
            return math.inf
        T = self.tip(q)
        if torch:
            a, b = T[:3, 2], wanted[:3, 2]
            angle = math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
        else:
            angle = float(np.linalg.norm(pin.log3(T[:3, :3].T @ wanted[:3, :3])))
        return max(float(np.linalg.norm(T[:3, 3] - wanted[:3, 3])), angle)

    def into_limits(self, q: Floats) -> Floats | None:
        """The same configuration by whole turns; None: there is none within limits."""
        turns = np.where(self.chain.prismatic, 0.0, np.ceil((self.chain.lower - BEYOND - q) / (2 * np.pi)))
        moved = q + 2 * np.pi * turns
        return moved if self.within_limits(moved) else None


def apart(a: Floats, b: Floats) -> float:
    """The largest difference, whole turns aside [rad]."""
    return float(np.max(np.abs(np.remainder(a - b + np.pi, 2 * np.pi) - np.pi)))


def add_new(branches: list[Floats], q: Floats) -> None:
    if all(apart(q, other) > SAME for other in branches):
        branches.append(q)


def judge(result: Result, chain: Chain, cases: Cases, answers: Floats) -> None:
    """answers (m, 2 + n): target, 1 if said to be reached, joints."""
    oracle, n = Oracle(chain), chain.joints
    good: list[list[Floats]] = [[] for _ in range(result.targets)]
    for row in answers:
        k, q = int(row[0]), row[2 : 2 + n]
        if row[1] < 0.5:
            result.rough.append((k, q))
            continue
        if result.who in WITHOUT_LIMITS:
            moved = oracle.into_limits(q)
            if moved is None:
                continue
            q = moved
        miss = oracle.miss(q, cases.wanted[k], result.task == "torch")
        if miss <= METRES * (1 + ROUNDING):
            add_new(good[k], q) if result.task == "branches" else good[k].append(q)
        else:
            result.wrong += 1
            result.worst = max(result.worst, miss)
    if result.task == "branches":
        result.branches = good
        result.reached = float(
            np.mean(
                [
                    any(apart(q, truth) < SAME for q in found)
                    for found, truth in zip(good, cases.truth[: result.targets], strict=True)
                ]
            )
        )
    else:
        result.reached = float(np.mean([bool(found) for found in good]))
    if result.task in ("path", "follow"):
        path = answers[:, 2 : 2 + n]
        steps = np.max(np.abs(np.diff(path, axis=0)), axis=1)
        longest = float(np.max(np.abs(np.diff(cases.truth, axis=0))))
        jumps = int(np.sum(steps > JUMP))
        result.raw["jumps"] = jumps
        result.note = (
            f"{jumps or 'no'} jump{'s' if jumps != 1 else ''}, longest step {np.max(steps):.4f} (of the path"
            f" itself {longest:.4f})"
        )


# ---- Running -------------------------------------------------------------------------------------


def note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def run_truing(program: Path, folder: Path, quick: bool) -> list[Result]:
    command = [str(program), *(["--quick"] if quick else []), "--write", str(folder)]
    subprocess.run(command, check=True, stdout=sys.stderr)
    chains, results = read_chains(folder), []
    for line in (folder / "truing.jsonl").read_text(encoding="utf-8").splitlines():
        raw = json.loads(line)
        result = Result(
            "truing",
            raw["task"],
            raw["robot"],
            raw["targets"],
            raw["median_us"],
            raw["p99_us"],
            note=raw["note"],
            raw=raw,
        )
        chain = chains[raw["robot"]]
        file = folder / f"truing.{raw['robot']} {raw['task']}.answers"
        answers = np.fromfile(file)
        if len(answers):
            cases = read_cases(folder, raw["set"], chain.joints)
            extra = 16 if raw["task"] == "compensate" else 2 if raw["task"].startswith("best") else 0
            answers = answers.reshape(-1, 2 + chain.joints + extra)
            result.raw["answers"] = answers
            if raw["task"] == "compensate":
                judge_compensation(result, chains["irb"], chain, cases, answers)
            else:
                judge(result, chain, cases, answers)
        else:
            result.reached = raw["reached"] / raw["targets"]
        results.append(result)
    return results


def judge_compensation(
    result: Result, nominal: Chain, calibrated: Chain, cases: Cases, answers: Floats
) -> None:
    """The calibrated robot at the joints is where it is wanted, to 1e-9; the nominal one at the same joints
    is where it is told to be.
    """
    real, believed, n = Oracle(calibrated), Oracle(nominal), nominal.joints
    held = 0
    for row in answers[answers[:, 1] > 0.5]:
        q, wanted = row[2 : 2 + n], cases.wanted[int(row[0])]
        miss = max(real.miss(q, wanted, False), believed.miss(q, row[2 + n :].reshape(4, 4), False))
        held += miss <= 1.001e-9
        result.wrong += miss > 1.001e-9
        result.worst = max(result.worst, miss)
    result.reached = held / result.targets
    result.raw["labelled"] = int(np.sum(answers[:, 1] < 0.5))


def run_peer(
    name: str, environment: Path, folder: Path, quick: bool, timeout: float
) -> tuple[list[Result], dict[str, str]]:
    """Results, the peer's versions. A peer that cannot run has results without figures; notes say why."""
    python, out = environment.absolute() / "bin" / "python", folder / f"{name}.npz"
    cache = environment.absolute() / "share" / "inverse"
    reason = ""
    if not python.exists():
        reason = "not installed: bench/peers/setup_inverse.sh"
    else:
        cache.mkdir(parents=True, exist_ok=True)
        one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        command = [
            str(python),
            str(PEER_FOLDER / "inverse_peers.py"),
            name,
            str(folder),
            str(out),
            "--cache",
            str(cache),
            *(["--quick"] if quick else []),
        ]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=timeout, env={**os.environ, **one_thread}
            )
            if done.returncode:
                reason = (done.stderr.strip().splitlines() or ["ended without a word"])[-1]
        except subprocess.TimeoutExpired:
            reason = f"stopped after {timeout:g} s"
    chains, results, versions, finished = read_chains(folder), [], {}, set()
    if out.exists():
        with np.load(out) as saved:
            summary = json.loads(str(saved["summary"]))
            versions = summary["versions"]
            for k, job in enumerate(summary["jobs"]):
                finished.add((job["task"], job["robot"]))
                result = Result(name, job["task"], job["robot"], job["targets"], note=job["note"])
                if f"times_{k}" in saved:
                    chain = chains[job["robot"]]
                    kind = "pose" if job["task"] in ("branches", "one") else job["task"]
                    cases = read_cases(folder, f"{job['robot']}.{kind}", chain.joints).first(job["targets"])
                    times = saved[f"times_{k}"]
                    result.median_us, result.p99_us = (
                        1e6 * float(np.median(times)),
                        1e6 * float(np.quantile(times, 0.99)),
                    )
                    judge(result, chain, cases, saved[f"answers_{k}"])
                results.append(result)
    results += [
        Result(name, task, robot, 0, note=reason)
        for task, robot in PEERS[name].jobs
        if (task, robot) not in finished
    ]
    return results, versions


# ---- Tables --------------------------------------------------------------------------------------


def number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def times(result: Result) -> str:
    return "–" if math.isnan(result.median_us) else f"{number(result.median_us)} / {number(result.p99_us)}"


def share(result: Result) -> str:
    return "–" if math.isnan(result.reached) else f"{100 * result.reached:.2f} %"


def wrong(result: Result) -> str:
    if math.isnan(result.reached):
        return "–"
    if not result.wrong:
        return "0"
    return (
        f"{result.wrong} (beyond limits)"
        if math.isinf(result.worst)
        else f"{result.wrong} (by up to {result.worst:.2g})"
    )


def table(
    results: list[Result], robots: tuple[str, ...], tasks: tuple[str, ...], reached: str = "reached"
) -> Iterator[str]:
    for robot in robots:
        rows = [one for task in tasks for one in results if one.robot == robot and one.task == task]
        yield from (
            "",
            f"{robot.replace('_', ' ')}:",
            "",
            f"| | targets | µs, median / p99 | {reached} | claimed wrongly | |",
            "| --- |" + " --- |" * 5,
        )
        for one in rows:
            name = one.who if one.who != "truing" or one.task == tasks[0] else f"truing, {one.task}"
            yield (
                f"| {name} | {one.targets or '–'} | {times(one)} | {share(one)} | {wrong(one)} |"
                f" {one.note.replace('|', '/')} |"
            )


def find(results: list[Result], who: str, task: str, robot: str) -> Result | None:
    return next((one for one in results if (one.who, one.task, one.robot) == (who, task, robot)), None)


def count_branches(results: list[Result]) -> None:
    """Of each, how many of all that anybody found on the targets that it was given."""
    for robot in {one.robot for one in results if one.task == "branches"}:
        those = [one for one in results if one.task == "branches" and one.robot == robot and one.branches]
        if not those:
            continue
        union: list[list[Floats]] = []
        for k in range(max(len(one.branches) for one in those)):
            found: list[Floats] = []
            for one in those:
                for q in one.branches[k] if k < len(one.branches) else []:
                    add_new(found, q)
            union.append(found)
        for one in those:
            there = sum(len(found) for found in union[: len(one.branches)])
            have = sum(len(found) for found in one.branches)
            one.raw["lost"] = there - have
            more = ", limits applied afterwards and not timed" if one.who in WITHOUT_LIMITS else ""
            if one.rough and one.who not in WITHOUT_LIMITS:
                known = sum(any(apart(q, other) < NEAR for other in union[k]) for k, q in one.rough)
                more = (
                    f", and {len(one.rough)} that it says are off by more than 1e-6, {known} of them near one"
                    " that somebody found"
                )
            one.note = f"{have} of the {there} branches that all together found{more}"


def branches(results: list[Result]) -> Iterator[str]:
    yield from table(
        results, ("ur10", "irb", "ur10_calibrated", "irb_calibrated"), ("branches",), "own branch found"
    )
    yield from (
        "",
        "Own branch: the joints that the target was made from are among the answers, whole turns aside.",
    )


def one_answer(results: list[Result]) -> Iterator[str]:
    yield from table(
        results,
        ("ur10", "irb", "ur10_calibrated", "irb_calibrated", "gantry_calibrated"),
        ("one", "one by descent alone"),
    )


def torch(results: list[Result]) -> Iterator[str]:
    yield from table(results, ("ur10_calibrated", "irb_calibrated", "gantry_calibrated"), ("torch",))


def rails(results: list[Result]) -> Iterator[str]:
    yield from (
        "",
        (
            "| robot | best by | targets | truing µs, median / p99 | grid of 0.1 m µs, mean | reached |"
            " claimed wrongly | worse than the grid's | by up to | better |"
        ),
    )
    yield "| --- |" + " --- |" * 9
    for one in results:
        if not one.task.startswith("best"):
            continue
        worse, by, better = compare(one)
        yield (
            f"| {one.robot.replace('_', ' ')} | {one.task.removeprefix('best ')} | {one.targets} |"
            f" {times(one)} | {one.raw['grid_us']:.0f} | {share(one)} | {wrong(one)} | {worse} |"
            f" {f'{100 * by:.3g} %' if worse else '–'} | {better} |"
        )
    yield from (
        "",
        (
            "The grid: all of truing's branches with every rail at multiples of 0.1 m, the best of them"
            " taken; one that the grid finds no answer for counts as neither. Worse or better: by more than a"
            " millionth of the value."
        ),
    )


def compare(one: Result) -> tuple[int, float, int]:
    """Targets on which the grid's merit is larger, by which fraction at most, and targets on which it is
    smaller.
    """
    ours, grid = one.raw["answers"][:, -2], one.raw["answers"][:, -1]
    has = np.isfinite(grid)
    by = (grid[has] - ours[has]) / np.maximum(np.abs(grid[has]), 1e-3)
    return int(np.sum(by > 1e-6)), float(np.max(by, initial=0.0)), int(np.sum(by < -1e-6))


def paths(results: list[Result]) -> Iterator[str]:
    yield from table(results, ("ur10_calibrated", "irb_calibrated", "gantry_calibrated"), ("follow", "path"))
    yield from (
        "",
        (
            f"A jump: a joint moves by more than {JUMP} rad or m between neighbours. truing's first row is"
            " `follow`, from pose to pose as the peers do; the second is `path`, which looks over all"
            " branches and rail places first, per pose."
        ),
    )


def compensation(results: list[Result]) -> Iterator[str]:
    yield from (
        "",
        "| | targets | µs, median / p99 | to 1e-9 m | claimed wrongly | |",
        "| --- |" + " --- |" * 5,
    )
    for task in ("fake targets", "compensate"):
        for one in results:
            if one.task == task:
                yield (
                    f"| {'truing' if task == 'compensate' else 'fake targets'} | {one.targets} | {times(one)}"
                    f" | {share(one)} | {wrong(one)} | {one.note} |"
                )
    yield from (
        "",
        (
            "Fake targets: both models are truing's, the controller's inverse kinematics takes the answer"
            " nearest to the one before; timed with two corrections."
        ),
    )


TABLES: dict[str, tuple[str, Callable[[list[Result]], Iterator[str]]]] = {
    "branches": ("All branches", branches),
    "one": ("One answer from a random seed", one_answer),
    "torch": ("Torch: roll free", torch),
    "rails": ("Best over rails", rails),
    "paths": ("Smooth path", paths),
    "compensation": ("Compensation", compensation),
}


@dataclass(frozen=True)
class Reach:
    """What was set out to be reached. Median and p99 must hold for every robot."""

    what: str
    table: str
    tasks: tuple[str, ...]
    robots: tuple[str, ...]
    median_us: float
    p99_us: float = math.inf
    more: str = ""
    holds: Callable[[Result], bool] = lambda one: True
    share: float = 1.0


def nothing_lost(one: Result) -> bool:
    return int(one.raw.get("lost", 0)) == 0


BEST = ("best limits margin", "best manipulability", "best rail travel")
REACHES = (
    Reach("6R nominal, all branches", "branches", ("branches",), ("ur10", "irb"), 5.0, more="limits applied"),
    Reach(
        "6R calibrated, all branches",
        "branches",
        ("branches",),
        ("ur10_calibrated", "irb_calibrated"),
        30.0,
        60.0,
        "none lost",
        nothing_lost,
    ),
    Reach(
        "6R calibrated, one answer",
        "one",
        ("one",),
        ("ur10_calibrated", "irb_calibrated"),
        20.0,
        150.0,
        "100 %",
    ),
    Reach("3P+6R, one answer", "one", ("one",), ("gantry_calibrated",), 8.0, 60.0, "100 %"),
    Reach(
        "torch, random roll",
        "torch",
        ("torch",),
        ("ur10_calibrated", "irb_calibrated", "gantry_calibrated"),
        20.0,
        more="100 %, true on the task",
    ),
    Reach(
        "best over rails",
        "rails",
        BEST,
        ("rail", "rail_calibrated", "gantry_calibrated"),
        300.0,
        more="no worse than the 0.1 m grid's",
        holds=lambda one: not compare(one)[0],
    ),
    Reach(
        "path of 1000 poses",
        "paths",
        ("follow",),
        ("ur10_calibrated", "irb_calibrated", "gantry_calibrated"),
        3.0,
        more="no jump",
        holds=lambda one: int(one.raw.get("jumps", 1)) == 0,
    ),
    Reach(
        "compensation",
        "compensation",
        ("compensate",),
        ("irb_calibrated",),
        10.0,
        more="100 % to 1e-9 m or labelled",
        share=0.0,
        holds=lambda one: round(one.reached * one.targets) + one.raw["labelled"] == one.targets,
    ),
)


def best_peer(results: list[Result], reach: Reach) -> str:
    """The one that reaches most; among those within a thousandth of it, the fastest."""
    peers = [
        one
        for one in results
        if one.who != "truing"
        and one.robot in reach.robots
        and not math.isnan(one.reached)
        and (one.task in reach.tasks or (reach.table == "paths" and one.task == "path"))
    ]
    grids = [
        one
        for one in results
        if one.task in reach.tasks and one.robot in reach.robots and one.raw.get("grid_us")
    ]
    if grids:
        return f"grid of 0.1 m: {number(max(one.raw['grid_us'] for one in grids))} µs"
    if reach.table == "compensation":
        fake = find(results, "truing", "fake targets", "irb_calibrated")
        return f"fake targets: {share(fake)} in 50 corrections" if fake else "–"
    if not peers:
        return "–"
    most = max(one.reached for one in peers)
    best = min((one for one in peers if one.reached >= most - 1e-3), key=lambda one: one.median_us)
    return f"{best.who}: {times(best)}, {share(best)}" + (f", {best.wrong} wrong" if best.wrong else "")


def reaches(results: list[Result]) -> Iterator[str]:
    yield from ("| task | best peer in this run | reach | truing, worst robot | |", "| --- |" + " --- |" * 4)
    for reach in REACHES:
        ours = [
            one
            for one in results
            if one.who == "truing" and one.task in reach.tasks and one.robot in reach.robots
        ]
        if not ours:
            continue
        median, p99 = max(one.median_us for one in ours), max(one.p99_us for one in ours)
        reached, mistaken = min(one.reached for one in ours), sum(one.wrong for one in ours)
        missed = [
            why
            for why, bad in (
                ("median", median > reach.median_us),
                ("p99", p99 > reach.p99_us),
                ("fraction", reached < reach.share),
                ("wrong claims", mistaken > 0),
                (reach.more, not all(reach.holds(one) for one in ours)),
            )
            if bad
        ]
        limit = (
            f"≤ {reach.median_us:g}"
            + (f" / {reach.p99_us:g}" if math.isfinite(reach.p99_us) else "")
            + " µs"
            + (f", {reach.more}" if reach.more else "")
        )
        said = f"{number(median)} / {number(p99)}, {100 * reached:.2f} %" + (
            f", {mistaken} wrong" if mistaken else ""
        )
        yield (
            f"| {reach.what} | {best_peer(results, reach)} | {limit} | {said} |"
            f" {'reached' if not missed else 'missed: ' + ', '.join(missed)} |"
        )


def machine() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor() or platform.machine()
    return (
        f"{processor}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()},"
        f" Pinocchio {pin.__version__} as judge"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--bench",
        type=Path,
        default=Path("build/release/bench/bench_inverse"),
        help="the program built from bench/inverse.cpp",
    )
    parser.add_argument(
        "--peers", type=Path, help="folder given to bench/peers/setup_inverse.sh; none: truing alone"
    )
    parser.add_argument("--quick", action="store_true", help="a tenth of the targets")
    parser.add_argument("--only", default=",".join(TABLES), help="tables to make, with commas between")
    parser.add_argument("--timeout", type=float, default=1800.0, help="of one peer [s]")
    parser.add_argument(
        "--write", type=Path, help="the page whose markers <!-- table --> and <!-- end --> take the tables"
    )
    arguments = parser.parse_args()
    chosen = arguments.only.split(",")
    unknown = [name for name in chosen if name not in TABLES]
    if unknown:
        parser.error(f"no table {unknown[0]!r}; there are {', '.join(TABLES)}")
    if not arguments.bench.exists():
        parser.error(
            f"no program {arguments.bench}: cmake -DTRUING_BUILD_BENCHMARKS=ON, then --bench"
            " BUILD/bench_inverse"
        )
    page = arguments.write.read_text(encoding="utf-8") if arguments.write else ""
    if arguments.write and not ("<!-- table -->" in page and "<!-- end -->" in page):
        parser.error(f"{arguments.write} has no markers <!-- table --> and <!-- end -->")

    before = os.getloadavg()[0]
    versions: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        results = run_truing(arguments.bench, Path(folder), arguments.quick)
        for name in PEERS if arguments.peers else ():
            found, its = run_peer(name, arguments.peers, Path(folder), arguments.quick, arguments.timeout)
            results += found
            versions.update(its)
            lines = [f"{one.task} {one.robot} {times(one)} {share(one)} {one.note}" for one in found]
            note(f"{name}: {'; '.join(lines)}")
    count_branches(results)

    command = (
        "python bench/inverse.py"
        + (" --quick" if arguments.quick else "")
        + (f" --only {arguments.only}" if chosen != list(TABLES) else "")
    )
    lines = [
        f"From `{command}` on {datetime.now(timezone.utc):%Y-%m-%d}: {machine()}; peers: "
        + (", ".join(f"{name} {version}" for name, version in versions.items()) or "none")
        + f". Load average {before:.1f} before and {os.getloadavg()[0]:.1f} after, this program's own work"
        " included; above the number of cores, believe no time but in ratio.",
        "",
        *reaches(results),
    ]
    for name in chosen:
        title, make = TABLES[name]
        lines += ["", f"## {title}", *make(results)]
    lines += ["", "## Left out", "", *(f"- {name}: {why}." for name, why in LEFT_OUT.items())]
    if not arguments.write:
        print("\n".join(lines))
        return
    start, end = page.index("<!-- table -->") + len("<!-- table -->"), page.index("<!-- end -->")
    arguments.write.write_text(page[:start] + "\n" + "\n".join(lines) + "\n" + page[end:], encoding="utf-8")


if __name__ == "__main__":
    main()
