# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Times truing and its peers in one run, and writes what came out: bench/results.json and \
docs/benchmarks/identify.md.

    scripts/bench.sh [--quick]       # builds everything, then calls this

What is compared was measured in one run on one machine: nothing is taken from earlier runs. BLAS is timed
before and after
our part, the C++ bench twice, and of both the better time counts. Times are the best of several runs, ours
and those of fast peers alike.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

import truing

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PEERS = HERE / "peers"
sys.path.insert(0, str(PEERS))
from dynamics import figures as dynamics_figures  # noqa: E402  (beside this file)
from make_data import make  # noqa: E402  (shared with the peers)
from result import score  # noqa: E402

FIT_PEERS = (
    "numpy",
    "numpy-2-threads",
    "robotkinecal",
    "figaroh",
    "figaroh-excitation",
    "pybotics-trf",
    "pybotics-lm",
)
CPP = "build/release/bench/bench_identify"
AVX2 = "TRUING_KERNEL=avx2 " + CPP
PYTHON = "python bench/run.py"
DYNAMICS = "python bench/dynamics.py build/release/bench/bench_dynamics"


@dataclass(frozen=True)
class Row:
    """One figure; `reach` is the bound that we set ourselves, `ratio` what a peer takes as a multiple of
    ours.
    """

    name: str
    value: float
    unit: str
    reach: str = ""  # "<= 40", ">= 1.8" or nothing
    peer: str = ""
    peer_value: float | None = None
    ratio: float | None = None
    machine: str = ""
    command: str = ""
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the reach is reached; None: there is none."""
        if not self.reach:
            return None
        sign, limit = self.reach.split()
        return self.value <= float(limit) if sign == "<=" else self.value >= float(limit)


# ---- Running things ------------------------------------------------------------------------------


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def machine() -> str:
    return (
        f"{processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()},"
        f" NumPy {np.__version__}"
    )


def run_cpp(program: Path, kernel: str = "") -> dict[str, Any]:
    """Figures of the C++ bench by name; empty where this machine lacks the instruction set."""
    environment = {**os.environ, **({"TRUING_KERNEL": kernel} if kernel else {})}
    done = subprocess.run([str(program)], env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        if kernel:
            print(f"  no figures for {kernel}: {done.stderr.strip().splitlines()[-1:]}")
            return {}
        raise SystemExit(f"{program} failed:\n{done.stderr}")
    return {row["name"]: row["value"] for row in map(json.loads, done.stdout.splitlines())}


def better(one: dict[str, Any], two: dict[str, Any]) -> dict[str, Any]:
    """Of two runs of the C++ bench the better of every time; what is no time is the same in both."""
    return {
        name: (
            value
            if isinstance(value, str)
            else (max if name.startswith("threads_speedup") else min)(value, two[name])
        )
        for name, value in one.items()
    }


def run_peers(data: Path, envs: Path, out: Path, *options: str) -> list[dict[str, Any]]:
    command = [
        sys.executable,
        str(PEERS / "peers.py"),
        str(data),
        "--envs",
        str(envs),
        "--out",
        str(out),
        *options,
    ]
    if subprocess.run(command).returncode != 0 or not out.exists():
        return [{"peer": "all", "error": "bench/peers/peers.py failed"}]
    results: list[dict[str, Any]] = json.loads(out.read_text(encoding="utf-8"))["results"]
    return results


class OtherWork:
    """How many cores other processes kept busy since the start; None where the system does not say."""

    def __init__(self) -> None:
        self.start = self._now()

    @staticmethod
    def _now() -> tuple[float, float, float]:
        own = os.times()
        try:
            user, nice, system, _, _, irq, softirq, steal = map(
                int, Path("/proc/stat").read_text(encoding="ascii").split("\n")[0].split()[1:9]
            )
            busy = (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")
        except (OSError, ValueError):
            busy = float("nan")
        return own.elapsed, busy, own.user + own.system + own.children_user + own.children_system

    def cores(self) -> float | None:
        elapsed, busy, own = (now - then for now, then in zip(self._now(), self.start, strict=True))
        return max(0.0, (busy - own) / elapsed) if np.isfinite(busy) and elapsed > 0 else None


def best_seconds(runs: int, work: Callable[[], Any]) -> float:
    """Median of so many runs, after one that warms up."""
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


# ---- truing from Python --------------------------------------------------------------------------


def nominal_robot(data: dict[str, Any]) -> truing.Robot:
    joints = [
        truing.Joint(f"J{k}", alpha=alpha, a=a, beta=beta, theta=theta, d=d)
        for k, (alpha, a, beta, theta, d) in enumerate(np.asarray(data["dh"]).tolist(), 1)
    ]
    tool = np.eye(4)
    tool[:3, 3] = data["tool"]
    return truing.Robot(
        "ur10",
        convention="mdh",
        joints=joints,
        targets=[truing.Target("tool", tool)],
        T_measurement_base=data["base"],
    )


def time_python(data: dict[str, Any]) -> dict[str, Any]:
    """The peers' own data file, from NumPy arrays to the result with rank and covariance."""
    robot, q, p = nominal_robot(data), data["q_train"], data["p_train"]

    def fit() -> truing.identification.Identification:
        return truing.identify(robot, truing.Measurements(q, positions=p), test_share=0.0)

    seconds = best_seconds(100, fit)
    found = fit()
    scored = score(
        data, np.asarray(truing.predict(found.robot, truing.Measurements(data["q_test"])).position)
    )
    return {
        "seconds": seconds,
        "rank": found.rank,
        "columns": found.columns,
        "iterations": found.solver.iterations,
        **scored,
    }


def time_csv(folder: Path, rows: int) -> dict[str, float]:
    """MB/s of load_measurements, everything that it checks included. The file is in the system's cache."""
    import pyarrow as pa
    import pyarrow.csv

    data = make(train=1, test=1)
    robot = nominal_robot(data)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (rows, 6))
    p = np.asarray(truing.predict(robot, truing.Measurements(q)).position)
    columns = {
        **{f"q{k + 1}_rad": q[:, k] for k in range(6)},
        **{f"{axis}_m": p[:, k] for k, axis in enumerate("xyz")},
    }
    path = folder / "million.csv"
    pa.csv.write_csv(pa.table(columns), path)
    megabytes = path.stat().st_size / 1e6
    seconds = best_seconds(3, lambda: truing.load_measurements(path, robot))
    loaded = truing.load_measurements(path, robot)
    if loaded.rows != rows or not np.array_equal(loaded.joints, q):
        raise SystemExit("the CSV did not read back bit for bit")
    path.unlink()
    return {"megabytes": megabytes, "seconds": seconds}


# ---- The table -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Timings:
    """What was timed in one run."""

    cpp: dict[str, Any]
    avx2: dict[str, Any]  # empty where the widest kernel of this machine is AVX2
    python: dict[str, Any]
    csv: dict[str, float]
    blas: list[dict[str, Any]]
    peers: list[dict[str, Any]]
    dynamics: dict[str, Any]

    def kernels(self) -> list[tuple[dict[str, Any], str]]:
        """Figures of each kernel with the command that they are from, the widest first."""
        second = [(self.avx2, AVX2)] if self.avx2 and self.cpp["kernel"] != "avx2" else []
        return [(self.cpp, CPP), *second]


def collect(timings: Timings) -> list[Row]:
    """The rows of the table, in its order."""
    rows = [
        *kernel_rows(timings),
        *fit_rows(timings),
        *iteration_rows(timings),
        *large_rows(timings.cpp, timings.csv),
        *dynamics_rows(timings.dynamics),
    ]
    here = machine()
    return [replace(row, machine=here) for row in rows]


def against(ours: Row, peers: list[dict[str, Any]], task: str, wanted: tuple[str, ...]) -> list[Row]:
    """A row for every peer, those without a figure included."""
    scale = {"us": 1e6, "ms": 1e3}[ours.unit]
    there = [r for r in peers if r["peer"] in wanted and r.get("task", task) == task]
    rows = []
    for r in there or [{"peer": "", "error": "no peer was run"}]:
        theirs = r["seconds"] * scale if "seconds" in r else None
        note = r.get("note", r.get("error", r.get("skipped", "")))
        ratio = theirs and theirs / ours.value
        rows.append(replace(ours, peer=r["peer"], peer_value=theirs, ratio=ratio, note=note))
    return rows


def kernel_rows(timings: Timings) -> list[Row]:
    rows = []
    for figures, command in timings.kernels():
        kernel = figures["kernel"]
        ours = Row(
            f"FK and position Jacobian, {timings.cpp['jacobian_columns']:g} columns, 1000 poses, one core,"
            f" {kernel}",
            figures["fk_jacobian_1000"],
            "us",
            {"avx512": "<= 40", "avx2": "<= 80"}.get(kernel, ""),
            command=command,
        )
        rows += against(ours, timings.peers, "fk+regressor", ("pinocchio",))
        rows += against(ours, timings.peers, "fk+jacobian", ("numpy",))
    return rows


def fit_rows(timings: Timings) -> list[Row]:
    """Whole fits: how long, and how well."""
    cpp, python = timings.cpp, timings.python
    what = (
        f"identification, 1000 poses, {cpp['identify_1000_rank']:g} parameters of"
        f" {cpp['identify_1000_columns']:g}, rank and covariance"
    )
    ours = Row(f"{what}, C++, {cpp['kernel']}", cpp["identify_1000"], "ms", "<= 2", command=CPP)
    rows = against(ours, timings.peers, "fit", FIT_PEERS)
    for figures, command in timings.kernels()[1:]:
        rows.append(Row(f"{what}, C++, avx2", figures["identify_1000"], "ms", command=command))
    what = (
        f"identification, 1000 poses, {python['rank']} parameters of {python['columns']}, from NumPy arrays"
    )
    ours = Row(what, 1e3 * python["seconds"], "ms", "<= 5", command=PYTHON)
    rows += against(ours, timings.peers, "fit", FIT_PEERS)
    for poses in (200, 1000):
        what = f"rms error on fresh noise-free poses, median of 20 seeds, {poses} poses"
        rows.append(Row(what, cpp[f"accuracy_{poses}"], "sigma sqrt(p/N)", "<= 1.1", command=CPP))
    return rows


def iteration_rows(timings: Timings) -> list[Row]:
    """One iteration over many poses, and beside BLAS on a matrix of that size."""
    grams = [r for r in timings.blas if "seconds" in r]
    rows = []
    for figures, command in timings.kernels():
        iteration = figures["iteration_1000000_threads_2"]
        name = (
            f"one iteration, 1 000 000 poses x {timings.cpp['jacobian_columns']:g} columns, 2 threads,"
            f" {figures['kernel']}"
        )
        rows.append(Row(name, iteration, "ms", command=command))
        name += ", over BLAS dsyrk of 3 000 000 x 39"
        if not grams:
            note = "; ".join(str(r.get("error", r.get("skipped"))) for r in timings.blas)
            rows.append(Row(name, float("nan"), "x", "<= 0.4", "blas", command=command, note=note))
            continue
        best = min(grams, key=lambda r: float(r["seconds"]))
        dsyrk = 1e3 * float(best["seconds"])
        note = (
            f"dsyrk {dsyrk:.0f} ms: {best['note']}; the better of {len(grams)} timings before and after ours"
        )
        # the reach is stated for the widest kernel; the narrower one is shown beside it
        reach = "<= 0.4" if command == CPP else ""
        rows.append(
            Row(name, iteration / dsyrk, "x", reach, "blas", 1.0, dsyrk / iteration, "", command, note)
        )
    return rows


def large_rows(cpp: dict[str, Any], csv: dict[str, float]) -> list[Row]:
    iterations = f"{cpp['identify_1000000_iterations']:g} iterations"
    read = f"{csv['megabytes']:.0f} MB in {csv['seconds']:.2f} s, all checks included"
    memory, speedup = cpp["identify_1000000_memory"], cpp["threads_speedup_100000"]
    poses = "identification, 1 000 000 poses"
    return [
        Row(poses, cpp["identify_1000000"], "s", "<= 1", command=CPP, note=iterations),
        Row("memory above the data, 1 000 000 poses", memory, "MB", "<= 50", command=CPP),
        Row("two threads against one, 100 000 poses", speedup, "x", ">= 1.8", command=CPP),
        Row(
            "CSV of 1 000 000 rows",
            csv["megabytes"] / csv["seconds"],
            "MB/s",
            ">= 50",
            command=PYTHON,
            note=read,
        ),
    ]


def dynamics_rows(found: dict[str, Any]) -> list[Row]:
    """The torque regressor of six joints; more samples a second are better here."""
    kernel, theirs = found["kernel"], found["pinocchio"]
    note = "" if theirs else "Pinocchio is not installed"
    rows = [
        (f"torque regressor, six joints, one core, {kernel}", f"regressor_{kernel}", ""),
        (
            "torque regressor and Grams of six joints, 70 effect columns each, 2 threads",
            "grams_70_threads_2",
            ">= 0.4",
        ),
    ]
    return [
        Row(
            name,
            1e-6 * found[figure],
            "M samples/s",
            reach,
            "pinocchio, regressor alone, from Python",
            theirs and 1e-6 * theirs,
            theirs and found[figure] / theirs,
            command=DYNAMICS,
            note=note,
        )
        for name, figure, reach in rows
    ]


def number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


_SYMBOLS = {"us": "µs", "x": "×", "sigma sqrt(p/N)": "σ√(p/N)"}


def shown(value: float | None, unit: str) -> str:
    return f"{number(value)} {_SYMBOLS.get(unit, unit)}"


def bound(row: Row) -> str:
    return (
        f"{row.reach.replace('<=', '≤').replace('>=', '≥')} {_SYMBOLS.get(row.unit, row.unit)}"
        if row.reach
        else ""
    )


def print_table(rows: list[Row]) -> None:
    last = ""
    for row in rows:
        if row.name != last:
            verdict = {None: "", True: f"reach {bound(row)}", False: f"reach {bound(row)} MISSED"}[row.met]
            print(f"{row.name:90} {shown(row.value, row.unit):16} {verdict}")
        last = row.name
        if row.peer_value is not None:
            print(f"{'':8}{row.peer:20} {shown(row.peer_value, row.unit):16} {number(row.ratio)} times ours")
        elif row.peer:
            print(f"{'':8}{row.peer:20} {row.note}")


def markdown(rows: list[Row], timings: Timings, about: dict[str, Any]) -> str:
    """The page."""
    return "\n".join(
        [
            *introduction(about),
            *reach_table(rows),
            *peer_table(rows),
            *fit_table(timings.python, timings.peers),
            *commands(timings.peers),
        ]
    )


def introduction(about: dict[str, Any]) -> list[str]:
    lines = [
        "# Benchmarks",
        "",
        "<!-- Written by bench/run.py: change that file, not this one. -->",
        "",
        f"From `{about['command']}` on {about['date']}: {machine()}.",
        (
            f"Load average {about['load_before']:.1f} before and {about['load_after']:.1f} after, the bench's"
            " own work included."
        ),
    ]
    other = about["other_work"]
    if other is not None:
        lines.append(f"While truing and BLAS were timed, other programs kept {other:.1f} cores busy.")
    lines.append("")
    if other is None or other > 0.1 * (os.cpu_count() or 1):
        lines += [
            (
                "So absolute times are too long, and two threads had less than two cores. Ratios within this"
                " run say more, and they too are uneven."
            ),
            "",
        ]
    if about["quick"]:
        lines += ["`--quick`: peers that take more than 20 s were left out.", ""]
    return [
        *lines,
        (
            "The robot is a UR10: modified DH with Hayati's beta, base and tool unknown. Times are the best"
            " of several runs, ours, and those of peers that take less than a second. Files, peers and their"
            " fairness: [bench/peers](../../bench/peers/README.md)."
        ),
        "",
    ]


def reach_table(rows: list[Row]) -> list[str]:
    lines = ["## What we set out to reach", "", "| | measured | reach | |", "| --- | --- | --- | --- |"]
    seen = set()
    for row in rows:
        if row.reach and row.name not in seen:
            seen.add(row.name)
            lines.append(
                f"| {row.name} | {shown(row.value, row.unit)} | {bound(row)} |"
                f" {'reached' if row.met else '**missed**'} |"
            )
    return [*lines, ""]


def peer_table(rows: list[Row]) -> list[str]:
    lines = [
        "## Beside others",
        "",
        "| | truing | | peer | times ours | |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        if row.peer or not row.reach:
            theirs = shown(row.peer_value, row.unit) if row.peer_value is not None else "–"
            lines.append(
                f"| {row.name} | {shown(row.value, row.unit)} | {row.peer} | {theirs} | {number(row.ratio)} |"
                f" {row.note} |"
            )
    return [*lines, ""]


def fit_table(python: dict[str, Any], peers: list[dict[str, Any]]) -> list[str]:
    """The same file fitted by all, with errors against the truth."""
    lines = [
        "## The same file, fitted by all",
        "",
        (
            "1000 poses with 0.03 mm of noise per axis; errors on 300 other poses against the points without"
            " noise."
        ),
        "",
        "| | time | mean | rms | max [µm] | |",
        "| --- | --- | --- | --- | --- | --- |",
        (
            f"| truing, from Python | {1e3 * python['seconds']:.2f} ms | {1e6 * python['test_mean_m']:.1f} |"
            f" {1e6 * python['test_rms_m']:.1f} | {1e6 * python['test_max_m']:.1f} | rank {python['rank']},"
            f" {python['iterations']} iterations |"
        ),
    ]
    for r in peers:
        if r.get("task") == "fit":
            took = f"{r['seconds']:.1f} s" if r["seconds"] >= 1 else f"{1e3 * r['seconds']:.1f} ms"
            lines.append(
                f"| {r['peer']} | {took} | {1e6 * r['test_mean_m']:.1f} | {1e6 * r['test_rms_m']:.1f} |"
                f" {1e6 * r['test_max_m']:.1f} | {r['note']} |"
            )
        elif "error" in r or "skipped" in r:
            lines.append(
                f"| {r['peer']} | – | – | – | – |"
                f" {'failed: ' + r['error'] if 'error' in r else 'left out: ' + r['skipped']} |"
            )
    return [*lines, ""]


def commands(peers: list[dict[str, Any]]) -> list[str]:
    versions = sorted(
        {f"{name} {version}" for r in peers for name, version in r.get("versions", {}).items() if version}
    )
    return [
        f"Versions: {', '.join(versions)}." if versions else "No peer ran.",
        "",
        "## Again",
        "",
        "    scripts/bench.sh            # everything, into bench/results.json and this page",
        "    scripts/bench.sh --quick    # without the slow peers",
        f"    {CPP}",
        f"    {AVX2}",
        "",
    ]


# ---- The run -------------------------------------------------------------------------------------


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="leave out peers that take more than 20 s")
    parser.add_argument(
        "--no-peers", action="store_true", help="time truing and nothing else (the tables will say so)"
    )
    parser.add_argument("--cpp", type=Path, default=ROOT / CPP, help="the C++ bench")
    parser.add_argument(
        "--envs",
        type=Path,
        default=ROOT / "build/peers",
        help="the peers' environments, made by bench/peers/setup_peers.sh",
    )
    parser.add_argument("--timeout", type=float, default=600, help="limit for one peer [s]")
    parser.add_argument("--rows", type=int, default=1_000_000, help="of the CSV")
    parser.add_argument("--results", type=Path, default=HERE / "results.json")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/benchmarks/identify.md")
    args = parser.parse_args()
    if not args.cpp.exists():
        raise SystemExit(f"{args.cpp} is missing: run scripts/bench.sh, which builds it")
    return args


def time_all(args: argparse.Namespace, folder: Path) -> tuple[Timings, float | None]:
    """Times everything, in an order that is fair to all; and how many cores others kept busy meanwhile."""
    data = make(seed=1)
    np.savez(folder / "ur10.npz", **data)

    def peers(*options: str) -> list[dict[str, Any]]:
        if args.no_peers:
            return [{"peer": "all", "skipped": "--no-peers"}]
        return run_peers(
            folder / "ur10.npz", args.envs, folder / "peers.json", "--timeout", str(args.timeout), *options
        )

    other_work = OtherWork()
    print("BLAS, before ...", flush=True)
    blas = peers("--only", "blas")
    print("truing, C++ ...", flush=True)
    cpp = run_cpp(args.cpp)
    avx2 = run_cpp(args.cpp, "avx2")
    print("truing, Python ...", flush=True)
    python = time_python(data)
    csv = time_csv(folder, args.rows)
    cpp = better(cpp, run_cpp(args.cpp))
    avx2 = avx2 and better(avx2, run_cpp(args.cpp, "avx2"))
    print("BLAS, after ...", flush=True)
    blas += peers("--only", "blas")
    print("truing, torques ...", flush=True)
    dynamics = dynamics_figures(args.cpp.with_name("bench_dynamics"))
    busy = other_work.cores()
    print("peers ...", flush=True)
    names = ",".join(("pinocchio", *FIT_PEERS))
    others = peers("--only", names, *(("--quick",) if args.quick else ()))
    return Timings(cpp, avx2, python, csv, blas, others, dynamics), busy


def results_text(rows: list[Row]) -> str:
    """The rows as JSON; what is no number is null."""
    plain = [
        {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(row).items()}
        for row in rows
    ]
    return json.dumps(plain, indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    args = arguments()
    folder = ROOT / "build/run/bench"
    folder.mkdir(parents=True, exist_ok=True)
    load_before = os.getloadavg()[0]
    timings, busy = time_all(args, folder)
    rows = collect(timings)
    about = {
        "command": " ".join(["scripts/bench.sh", *sys.argv[1:]]),
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
        "load_before": load_before,
        "load_after": os.getloadavg()[0],
        "quick": args.quick,
        "other_work": busy,
    }
    print()
    print_table(rows)
    args.results.write_text(results_text(rows), encoding="utf-8")
    args.page.parent.mkdir(parents=True, exist_ok=True)
    args.page.write_text(markdown(rows, timings, about), encoding="utf-8")
    if busy is not None:
        print(
            f"\nwhile truing and BLAS were timed, other programs kept {busy:.1f} of {os.cpu_count()} cores"
            " busy"
        )
    missed = {row.name for row in rows if row.met is False}
    print(
        f"\nwritten: {args.results}, {args.page}"
        + (f"\n{len(missed)} missed: " + "; ".join(sorted(missed)) if missed else "")
    )


if __name__ == "__main__":
    main()
