# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses recorded measurements of real robots and writes what was named: \
docs/benchmarks/real-diagnosis.md.

    python bench/real_diagnosis.py [--data FOLDER]
    python bench/real_diagnosis.py --splits 10 --json AFTER.json [--before BEFORE.json] [--only WORD]
    python bench/real_diagnosis.py --splits 10 --after AFTER.json ... --before BEFORE.json ... --write

FOLDER as for bench/real_data.py. Without --splits every figure is of the rows that the recording itself holds
out.

With --splits each recording is parted so many times at random (--seed), with as many rows held out as it
holds out itself; the rows of one pose stay together. Printed are mean and worst rms error on held-out
rows, and --json stores those of every split. With --before, what another build stored for the same splits
stands beside; with --after, what was stored is not diagnosed again; --write puts the table into the page.
Both take one file, or several with some recordings each. An older build stores its own by running this file
with its interpreter. One split is luck: what changes a figure by less than its splits differ has changed
nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import truing
from truing.identification import Identification

sys.path.insert(0, str(Path(__file__).resolve().parent))
from real_data import RECORDINGS, ROOT, Recording, default_folder, fit, load
from small_sets import ARMS

MOST = 6  # names in a cell
MANY = 0.05  # of the rows: outliers that are no exceptions, and by which the diagnosis is judged too
FORMAT = "truing-real-splits/1"
COLUMNS = {
    "gap": "base and tool",
    "geometry": "geometry",
    "named": "named effects",
    "unknown": "and unknown ones",
}
"""Of a split: rms errors on its held-out rows [mm]."""
JUDGED = ("named", "unknown")
"""Those that a change of the diagnosis changes."""
PLAIN = 1.05  # so many times better or worse is a difference

Split = dict[str, Any]
"""Errors of one split, None where there are none, and `error`, why."""


class Errors(NamedTuple):
    """Of held-out rows [m], as `truing.common.ErrorStatistics` has them."""

    rms: float
    median: float
    p95: float


def millimetres(statistics: truing.common.ErrorStatistics | Errors) -> str:
    return f"{1e3 * statistics.rms:.3f} / {1e3 * statistics.median:.3f} / {1e3 * statistics.p95:.3f}"


def named(found: truing.diagnosis.Diagnosis) -> str:
    names = [
        f"{effect.effect}{' ' + '+'.join(effect.joints) if 0 < len(effect.joints) <= 2 else ''}"
        f" ({'> 0.99' if effect.probability >= 0.995 else f'{effect.probability:.2f}'})"
        for effect in found.effects
    ]
    return (
        ", ".join(names[:MOST]) + (f" and {len(names) - MOST} more" if len(names) > MOST else "") or "nothing"
    )


def unknown(found: truing.diagnosis.Diagnosis) -> str:
    said = [
        (
            f"{one.joint} over {' and '.join(one.inputs)}"
            + (f": {one.looks_like}" if one.looks_like and len(one.inputs) == 1 else "")
            if one.inputs
            else "more than repeats show"
        )
        for one in found.unknown
    ]
    return "; ".join(said[:MOST]) or "nothing"


def rows(folder: Path) -> Iterator[str]:
    yield (
        "| set | base and tool | geometry | named effects | and unknown ones | robot.yaml | with tables"
        " | named (probability) | unknown | left to a nearest neighbour | seconds |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for recording in (*RECORDINGS, *ARMS):
        line = one(folder, recording)
        if line:
            yield line
            print(line, file=sys.stderr, flush=True)


def one(folder: Path, recording: Recording) -> str:
    if not (folder / recording.folder).is_dir():
        return f"| {recording.name} | not there | | | | | | | | | |"
    robot, data = load(folder, recording)
    started = time.perf_counter()
    found = truing.diagnose(robot, data)
    seconds = time.perf_counter() - started
    geometry = on_the_same_rows(found, fit(robot, data), data)
    return (
        f"| {recording.name} | {millimetres(found.gap)} | {millimetres(geometry) if geometry else '–'}"
        f" | {millimetres(found.after)} | {millimetres(found.after_unknown)} | {robots(found)}"
        f" | {named(found)} | {unknown(found)} | {100 * found.neighbour_share:.0f} % | {seconds:.1f} |"
    )


def robots(found: truing.diagnosis.Diagnosis) -> str:
    """What the robots leave that are handed over: two cells, rms."""
    by_tables = found.after_robot_with_unknown.rms if found.robot_with_unknown else None
    by_names = found.gap.rms * (1.0 - found.shrink.value)
    return f"{1e3 * by_names:.3f} | {'–' if by_tables is None else f'{1e3 * by_tables:.3f}'}"


def on_the_same_rows(
    found: truing.diagnosis.Diagnosis, geometry: Identification, data: truing.Measurements
) -> Errors | None:
    """Errors of plain geometry on the held-out rows that the diagnosis is judged by: without a few that stand
    far out, as `outliers` says. None: no row is held out."""
    if geometry.test is None:
        return None
    left = truing.residuals(geometry.robot, data)
    errors = np.abs(left.distance) if data.distances is not None else np.linalg.norm(left.position, axis=1)
    counted = np.asarray(found.set) != 0
    if len(found.outliers) < MANY * len(counted):
        counted[np.asarray(found.outliers, dtype=int)] = False
    errors = errors[counted & np.isfinite(errors)]
    return Errors(float(np.sqrt(np.mean(errors**2))), *(float(np.quantile(errors, p)) for p in (0.5, 0.95)))


# ---- Random splits -------------------------------------------------------------------------------


def parted(group: Any, held: int, number: int, seed: int) -> Any:
    """The split of a number: 0 train, 1 held out, shape=(n,). group: rows of one pose share a value; held: so
    many rows, or a few more.
    """
    rng = np.random.default_rng([seed, number])
    names, count = np.unique(group, return_counts=True)
    order = rng.permutation(len(names))
    enough = int(np.searchsorted(np.cumsum(count[order]), held)) + 1
    return np.isin(group, names[order[:enough]]).astype(np.int8)


def errors_of(robot: truing.Robot, data: truing.Measurements) -> Split:
    """Of one split. What cannot be diagnosed has no errors."""
    started = time.perf_counter()
    try:
        found = truing.diagnose(robot, data)
    except (truing.InputError, ValueError, RuntimeError) as error:
        return {**dict.fromkeys(COLUMNS), "error": f"{type(error).__name__}: {error}"}
    seconds = time.perf_counter() - started
    geometry = on_the_same_rows(found, fit(robot, data), data)
    figures = (found.gap, geometry, found.after, found.after_unknown)
    rms = {name: 1e3 * of.rms if of else None for name, of in zip(COLUMNS, figures, strict=True)}
    return {**rms, "seconds": seconds, "verdict": str(found.verdict), "names": named(found)}


def splits_of(folder: Path, recording: Recording, splits: int, seed: int) -> list[Split]:
    robot, data = load(folder, recording)
    held = int(np.count_nonzero(data.set)) if data.set is not None else round(0.3 * data.rows)
    group = truing.model.pose_groups(data)
    found = []
    for number in range(splits):
        found.append(errors_of(robot, data.replace(set=parted(group, held, number, seed))))
        print(f"{recording.name}, split {number}: {found[-1]}", file=sys.stderr, flush=True)
    return found


def column(splits: Sequence[Split], name: str) -> Any:
    """Errors of all splits [mm]; infinite where the diagnosis failed."""
    return np.array([np.inf if split[name] is None else split[name] for split in splits])


def mean_and_worst(splits: Sequence[Split], name: str) -> str:
    errors = column(splits, name)
    return f"{errors.mean():.3f} / {errors.max():.3f}".replace("inf", "∞")


def beside(before: Sequence[Split], after: Sequence[Split], name: str) -> str:
    """Mean and worst of both, and in how many splits the later one is better or worse by more than 5 %."""
    old, new = column(before, name), column(after, name)
    better, worse = int(np.sum(old > PLAIN * new)), int(np.sum(new > PLAIN * old))
    return f"{mean_and_worst(before, name)} | {mean_and_worst(after, name)} | {better} : {worse}"


def split_table(after: Mapping[str, list[Split]], before: Mapping[str, list[Split]] | None) -> list[str]:
    """Lines of markdown, one per recording: mean / worst [mm]."""
    head = ["set", "splits", "failed", *(text for name, text in COLUMNS.items() if name not in JUDGED)]
    for name in JUDGED:
        text = COLUMNS[name]
        head += [text] if before is None else [f"{text}, before", "after", "better : worse"]
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    for recording, splits in after.items():
        cells = [recording, str(len(splits)), str(sum("error" in split for split in splits))]
        cells += [mean_and_worst(splits, name) for name in COLUMNS if name not in JUDGED]
        for name in JUDGED:
            if before is None:
                cells.append(mean_and_worst(splits, name))
            else:
                cells.append(beside(before[recording], splits, name))
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def stored(files: Sequence[Path], seed: int, splits: int, names: Sequence[str]) -> dict[str, list[Split]]:
    """What a build found for these splits of these recordings, in one file or several; ends the program if it
    is of others.
    """
    found: dict[str, list[Split]] = {}
    for file in files:
        try:
            told = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise SystemExit(f"{file}: cannot be read: {error}") from None
        wanted = {"format": FORMAT, "seed": seed, "splits": splits}
        for name, value in wanted.items():
            if not isinstance(told, dict) or told.get(name) != value:
                raise SystemExit(
                    f"{file}: expected {name} {value}: store it by --splits {splits} --seed {seed} --json"
                )
        found.update(told["recordings"])
    absent = [name for name in names if name not in found]
    if absent:
        raise SystemExit(f"{files[0]}: has no {absent[0]}: store it with all recordings that are compared")
    return {name: found[name] for name in names}


def judge_splits(arguments: argparse.Namespace) -> None:
    chosen = [
        one
        for one in (*RECORDINGS, *ARMS)
        if arguments.only in one.name and (arguments.data / one.folder).is_dir()
    ]
    names = [one.name for one in chosen]
    before = None
    if arguments.before:
        before = stored(arguments.before, arguments.seed, arguments.splits, names)
    if arguments.after:
        after = stored(arguments.after, arguments.seed, arguments.splits, names)
    else:
        after = {one.name: splits_of(arguments.data, one, arguments.splits, arguments.seed) for one in chosen}
    if arguments.json:
        told = {"format": FORMAT, "seed": arguments.seed, "splits": arguments.splits, "recordings": after}
        arguments.json.write_text(json.dumps(told, indent=1), encoding="utf-8")
    table = "\n".join(split_table(after, before))
    print(table)
    if arguments.write:
        write(arguments.out, "<!-- splits -->", "<!-- end of splits -->", table)


def write(page: Path, start: str, end: str, table: str) -> None:
    """Puts the table between two marks of a page."""
    text = page.read_text(encoding="utf-8")
    first, last = text.index(start) + len(start), text.index(end)
    page.write_text(text[:first] + "\n" + table + "\n" + text[last:], encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=default_folder())
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "benchmarks" / "real-diagnosis.md")
    parser.add_argument("--splits", type=int, default=0, help="random splits; 0: the recording's own")
    parser.add_argument("--seed", type=int, default=0, help="of the splits")
    parser.add_argument("--only", default="", help="recordings with this word in their name")
    parser.add_argument("--json", type=Path, help="where the errors of every split go")
    parser.add_argument("--before", type=Path, nargs="+", help="what --json wrote by another build")
    parser.add_argument("--after", type=Path, nargs="+", help="what --json wrote: nothing is diagnosed")
    parser.add_argument("--write", action="store_true", help="puts the table of the splits into the page")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    of_splits = ("json", "before", "after", "write", "only", "seed")
    if arguments.splits < 1 and any(getattr(arguments, name) for name in of_splits):
        parser.error("--json, --before, --after, --write, --only and --seed are of --splits")
    if arguments.splits >= 1:
        judge_splits(arguments)
        return
    write(arguments.out, "<!-- table -->", "<!-- end -->", "\n".join(rows(arguments.data)))


if __name__ == "__main__":
    main()
