# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does another version of truing compute the same? Runs a list of commands, compares all numbers.

    python bench/compare_results.py collect TRUING OUT [--data DIR] [--examples DIR] [--jobs N] [--only NAMES]
    python bench/compare_results.py compare A B

`collect` runs every command of compare_cases.txt with the executable TRUING; what a command writes is in
OUT/NAME. DIR holds the recordings (bench/real_data.py); without it those runs are left out. `compare` holds B
against A: JSON, CSV, YAML, URDF and the charts of reports.

- A number is compared with the standard error beside it (`sigma`, `sigma_x_m` …), else with its own size, or
  with FLOOR where it is smaller than that.
- Sentences may change: they are counted, and listed with --words. A word without spaces, a name, may not.
- What B has and A has not is counted; what A has and B has not is a difference.

The exit status is 1 if anything differs by more than LIMIT.
"""

from __future__ import annotations

import argparse
import base64
import concurrent.futures as futures
import csv
import fnmatch
import json
import math
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import compare_inputs  # noqa: E402  (beside this file)

LIMIT = 1e-9  # of a standard error
FLOOR = 1e-5  # [m | rad | …] about a standard error of a good calibration

# What tells of the run and not of its result: keys of JSON and YAML, and files.
IGNORED_KEYS = frozenset({"version", "date"})
IGNORED_FILES = ("stderr.txt", "run.json")
# Keys, columns and names that were renamed: {before: now}.
RENAMED: Mapping[str, str] = {}
CASES = HERE / "compare_cases.txt"
# OpenCV's calibration of a camera sums in the order in which its threads end: 4e-9 of a lens from run to run.
SETTINGS = {"OPENCV_FOR_THREADS_NUM": "1"}
MAY_FAIL = ("identify", "handeye", "ik", "compensate", "track")  # exit status 1: not found, and says why
NO_FOLDER = ("effects",)  # commands without --out
COMPARED = (".json", ".csv", ".yaml", ".urdf", ".html")
PLACE = re.compile(r"\{([\w-]+)\}")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


# ---- Collecting --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Runner:
    """Runs commands of one version of truing in the folder `out`, so that paths in messages are the same."""

    truing: Sequence[str]
    python: Sequence[str]
    out: Path
    places: Mapping[str, str]

    def words(self, name: str, command: str) -> list[str]:
        """The command as it is run."""
        words = [
            PLACE.sub(lambda found: self.places.get(found[1], found[1]), word)
            for word in shlex.split(command)
        ]
        if words[0] == "python":
            return [*self.python, *words[1:]]
        return [*self.truing, *words, *([] if words[0] in NO_FOLDER else ["--out", name])]

    def run(self, name: str, command: str) -> tuple[int, float]:
        """Exit status and seconds. What is printed is kept beside what is written."""
        started = time.perf_counter()
        words, settings = self.words(name, command), {**os.environ, **SETTINGS}
        done = subprocess.run(words, cwd=self.out, env=settings, capture_output=True, text=True)
        seconds = time.perf_counter() - started
        folder = self.out / name
        folder.mkdir(exist_ok=True)
        (folder / "stdout.txt").write_text(done.stdout, encoding="utf-8")
        (folder / "stderr.txt").write_text(done.stderr, encoding="utf-8")
        (folder / "status.json").write_text(json.dumps({"exit": done.returncode}), encoding="utf-8")
        (folder / "run.json").write_text(
            json.dumps({"command": command, "seconds": round(seconds, 2)}), encoding="utf-8"
        )
        return done.returncode, seconds


def listed() -> dict[str, str]:
    """Names and commands of compare_cases.txt."""
    lines = (
        line.partition(": ")
        for line in CASES.read_text(encoding="utf-8").splitlines()
        if line and line[0] != "#"
    )
    return {name: command for name, _, command in lines}


def interpreter(truing: Sequence[str]) -> list[str]:
    """The Python of `truing`: the one beside it, or the one that it is called with (python -m truing.cli)."""
    if "-m" in truing:
        return list(truing[: truing.index("-m")])
    return [str(Path(truing[0]).absolute().parent / "python")]


def needed(command: str) -> set[str]:
    """Runs and folders that a command refers to."""
    return set(PLACE.findall(command))


def chosen(cases: Mapping[str, str], only: str, data: bool) -> dict[str, str]:
    """The cases whose names match, and those that they build on, in order."""
    patterns = only.split(",") if only else ["*"]
    wanted = {name for name in cases if any(fnmatch.fnmatch(name, pattern) for pattern in patterns)}
    for name in reversed(list(cases)):  # what a case needs stands before it
        if name in wanted:
            wanted |= needed(cases[name]) & set(cases)
    return {
        name: cases[name] for name in cases if name in wanted and (data or not builds_on_data(name, cases))
    }


def builds_on_data(name: str, cases: Mapping[str, str]) -> bool:
    places = needed(cases[name])
    return "data" in places or any(builds_on_data(place, cases) for place in places if place in cases)


def run_all(runner: Runner, cases: Mapping[str, str], jobs: int) -> Iterator[tuple[str, int, float]]:
    """Name, exit status and seconds of each case, in order; a case waits for those that it builds on."""
    waiting: dict[str, futures.Future[tuple[int, float]]] = {}

    def run(name: str, command: str) -> tuple[int, float]:
        futures.wait([waiting[before] for before in needed(command) & set(waiting)])
        return runner.run(name, command)

    with futures.ThreadPoolExecutor(jobs) as pool:
        for name, command in cases.items():
            waiting[name] = pool.submit(run, name, command)
        for name, done in waiting.items():
            yield name, *done.result()


def collect(truing: str, out: Path, data: Path | None, examples: Path, jobs: int, only: str = "") -> None:
    """Runs everything; prints what failed and how long it took."""
    started = time.perf_counter()
    compare_inputs.make(out / "inputs", data)
    words = shlex.split(truing)
    words[0] = str(Path(words[0]).absolute()) if "/" in words[0] else words[0]
    folders = {"in": "inputs", "examples": str(examples.absolute()), "data": str(data and data.absolute())}
    runner = Runner(words, interpreter(words), out, folders)
    cases = chosen(listed(), only, data is not None)
    took: dict[str, float] = {}
    for name, status, took[name] in run_all(runner, cases, jobs):
        error = (out / name / "stderr.txt").read_text(encoding="utf-8").strip()
        if status > int(cases[name].startswith(MAY_FAIL)) or "Traceback" in error:
            print(f"{name}: exit status {status}: {error[-300:]}")
    slowest = ", ".join(f"{name} {took[name]:.1f} s" for name in sorted(took, key=lambda n: -took[n])[:5])
    seconds, used = time.perf_counter() - started, os.times()
    used_seconds = used.children_user + used.children_system
    print(f"{len(cases)} runs in {seconds:.0f} s, {used_seconds:.0f} s of processor time; slowest: {slowest}")


# ---- Reading what was written ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Leaf:
    """One value of a file, with the standard error beside it if there is one."""

    value: Any
    sigma: float | None = None


def standard_error(of: Mapping[str, Any], key: str) -> float | None:
    """That of of[key]: `sigma`, for all or by name, or a key such as sigma_x_m, frequency_sigma_hz."""
    sigma = of.get("sigma")
    if isinstance(sigma, Mapping):
        turns = [value for name, value in sigma.items() if name.endswith("_rad")]
        sigma = max(turns) if key in ("qw", "qx", "qy", "qz") and turns else sigma.get(key)
    stem, _, unit = key.rpartition("_")
    for name in (f"sigma_{key}", f"sigma_{unit}", f"{stem}_sigma_{unit}", f"{key}_sigma"):
        sigma = of.get(name) if sigma is None and "sigma" not in key else sigma
    if key == "sigma" or not isinstance(sigma, int | float):
        return None
    return float(sigma) if math.isfinite(sigma) and sigma > 0 else None


def leaves(tree: Any, path: str = "", sigma: float | None = None) -> Iterator[tuple[str, Leaf]]:
    """Every value of a JSON tree with its path."""
    if isinstance(tree, Mapping):
        if set(tree) >= {"dtype", "bdata"}:  # an array of a chart
            tree = {
                **tree,
                "bdata": np.frombuffer(base64.b64decode(tree["bdata"]), np.dtype(tree["dtype"])).tolist(),
            }
        for key, value in tree.items():
            if key not in IGNORED_KEYS:
                yield from leaves(value, f"{path}.{key}" if path else key, standard_error(tree, key))
    elif isinstance(tree, list):
        for k, value in enumerate(tree):
            yield from leaves(value, f"{path}[{k}]", sigma)
    else:
        yield path, Leaf(tree, sigma)


def cell(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def csv_leaves(text: str) -> Iterator[tuple[str, Leaf]]:
    header, *rows = csv.reader(text.splitlines())
    for k, row in enumerate(rows):
        yield from leaves(dict(zip(header, map(cell, row), strict=True)), f"row {k}")


def text_leaves(text: str) -> Iterator[tuple[str, Leaf]]:
    """Of YAML and URDF: numbers and words, line by line, without comments and what is ignored."""
    keys = "|".join(sorted(IGNORED_KEYS))
    kept = re.sub(rf"#.*|\b(?:{keys})\s*:[^,}}\n]*", "", text)
    for number, line in enumerate(kept.splitlines()):
        for k, found in enumerate(re.finditer(r"[\w.+-]+", line)):
            yield f"line {number + 1}, word {k + 1}", Leaf(cell(found[0]))


def numbers_printed(text: str) -> Iterator[tuple[str, Leaf]]:
    """Of what a program printed: the figures in their order, whatever stands between them."""
    for k, found in enumerate(NUMBER.finditer(text)):
        yield f"number {k + 1}", Leaf(float(found[0]))


def charts(page: str) -> Any:
    """The data of a report's charts, by their names."""
    found = re.search(r'id="charts">(.*?)</script>', page, flags=re.DOTALL)
    return {chart["id"]: chart for chart in json.loads(found[1])} if found else {}


def read(path: Path) -> dict[str, Leaf]:
    """Every value in a file by its path in it."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        return dict(leaves(json.loads(text)))
    if path.suffix == ".html":
        return dict(leaves(charts(text)))
    if path.suffix == ".csv":
        return dict(csv_leaves(text))
    return dict(numbers_printed(text) if path.suffix == ".txt" else text_leaves(text))


# ---- Comparing ---------------------------------------------------------------------------------------------


@dataclass
class Comparison:
    """What two folders of one run have in common."""

    name: str
    files: int = 0
    largest: float = 0.0  # difference of a number, in standard errors
    at: str = ""
    small: int = 0  # numbers that differ by LIMIT or less
    wrong: list[str] = field(default_factory=list)  # differences that may not be
    words: list[str] = field(default_factory=list)
    added: list[str] = field(default_factory=list)

    @property
    def bit_equal(self) -> bool:
        return not self.wrong and self.largest == 0.0

    @property
    def same(self) -> bool:
        return not self.wrong and self.largest <= LIMIT


def now_called(text: str) -> str:
    return re.sub(r"[\w@]+", lambda found: RENAMED.get(found[0], found[0]), text) if RENAMED else text


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def distance(before: Leaf, after: Leaf) -> float:
    """Of two numbers, in standard errors, or as a fraction of their size where there is none."""
    a, b = float(before.value), float(after.value)
    if a == b or (math.isnan(a) and math.isnan(b)):
        return 0.0
    scale = before.sigma or max(abs(a), abs(b), FLOOR)
    return abs(a - b) / scale if math.isfinite(a - b) else math.inf


def compare_values(result: Comparison, where: str, before: Leaf, after: Leaf) -> None:
    a, b = before.value, after.value
    if is_number(a) and is_number(b):
        off = distance(before, after)
        if off > result.largest:
            result.largest, result.at = off, where
        if off > LIMIT:
            unit = "standard errors" if before.sigma else "of its size"
            result.wrong.append(f"{where}: {a!r} -> {b!r}, {off:.3g} {unit}")
        elif off:
            result.small += 1
    elif isinstance(a, str) and isinstance(b, str):
        if now_called(a) != b:
            sentence = " " in a.strip() or " " in b.strip()
            (result.words if sentence else result.wrong).append(f"{where}: {a!r} -> {b!r}")
    elif a != b:
        result.wrong.append(f"{where}: {a!r} -> {b!r}")


def compare_files(result: Comparison, name: str, a: Path, b: Path) -> None:
    result.files += 1
    if a.read_bytes() == b.read_bytes():
        return
    before, after = {now_called(key): leaf for key, leaf in read(a).items()}, read(b)
    for key, leaf in before.items():
        if key in after:
            compare_values(result, f"{name}: {key}", leaf, after[key])
        else:
            result.wrong.append(f"{name}: {key} is missing")
    result.added += [f"{name}: {key}" for key in after if key not in before]


def kept_files(folder: Path) -> dict[str, Path]:
    """Files to compare. What is printed counts where nothing else is written."""
    files = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*")) if path.is_file()}
    kept = {
        name: path
        for name, path in files.items()
        if path.suffix in COMPARED and path.name not in IGNORED_FILES
    }
    if set(kept) <= {"status.json"} and "stdout.txt" in files:
        kept["stdout.txt"] = files["stdout.txt"]
    return kept


def compare_folders(name: str, a: Path, b: Path) -> Comparison:
    result = Comparison(name)
    before, after = kept_files(a), kept_files(b)
    for file, path in before.items():
        if file in after:
            compare_files(result, file, path, after[file])
        else:
            result.wrong.append(f"{file} is missing")
    result.added += [file for file in after if file not in before]
    return result


def compare(a: Path, b: Path) -> list[Comparison]:
    """Every run that A has."""
    names = sorted(folder.name for folder in a.iterdir() if folder.is_dir())
    return [compare_folders(name, a / name, b / name) for name in names]


# ---- Saying ------------------------------------------------------------------------------------------------


def line(result: Comparison) -> str:
    if result.bit_equal:
        verdict = "bit-equal"
    elif result.same:
        verdict = f"{result.largest:.2g} at most, of {result.small} numbers ({result.at})"
    else:
        verdict = f"DIFFERS in {len(result.wrong)}" + (
            f", by {result.largest:.2g} at most" if result.largest else ""
        )
    counts = [
        f"{len(list_)} {word}"
        for word, list_ in (("sentences", result.words), ("added", result.added))
        if list_
    ]
    return f"{result.name:32} {result.files:5}  {verdict}" + (f"  [{', '.join(counts)}]" if counts else "")


def report(results: Sequence[Comparison], words: bool, most: int) -> int:
    """Prints the table; the exit status."""
    print(f"{'run':32} {'files':>5}  largest difference [standard errors]")
    for result in results:
        print(line(result))
        for text in result.wrong[:most]:
            print(f"    {text}")
        if len(result.wrong) > most:
            print(f"    and {len(result.wrong) - most} more")
        if words:
            print("".join(f"    words: {text}\n" for text in result.words), end="")
    equal, same = sum(result.bit_equal for result in results), sum(result.same for result in results)
    files, differ = sum(result.files for result in results), len(results) - same
    counts = f"{equal} runs bit-equal, {same - equal} within {LIMIT:g}, {differ} differ"
    print(f"{len(results)} runs, {files} files: {counts}")
    ignored = f"keys {', '.join(sorted(IGNORED_KEYS))}; files {', '.join(IGNORED_FILES)}"
    print(f"not compared: {ignored}; of reports all but their charts")
    return 0 if same == len(results) else 1


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("collect", help="run every command with one version of truing")
    one.add_argument("truing", help="executable, or a command in quotes: 'python -m truing.cli'")
    one.add_argument("out", type=Path)
    one.add_argument("--data", type=Path, help="folder with the recordings")
    one.add_argument(
        "--examples",
        type=Path,
        default=HERE.parent / "examples/python",
        help="example programs of that version",
    )
    one.add_argument("--jobs", type=int, default=2)
    one.add_argument("--only", default="", help="names and globs, with a comma between")
    two = commands.add_parser("compare", help="hold one collection against another")
    two.add_argument("a", type=Path)
    two.add_argument("b", type=Path)
    two.add_argument("--words", action="store_true", help="list the sentences that are put otherwise")
    two.add_argument("--most", type=int, default=5, help="differences listed for each run")
    given = parser.parse_args(arguments)
    if given.command == "collect":
        collect(given.truing, given.out, given.data, given.examples, given.jobs, given.only)
        return 0
    return report(compare(given.a, given.b), given.words, given.most)


if __name__ == "__main__":
    sys.exit(main())
