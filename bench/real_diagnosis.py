# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses recorded measurements of real robots and writes what was named: \
docs/benchmarks/real-diagnosis.md.

    python bench/real_diagnosis.py [--data FOLDER]

FOLDER as for bench/real_data.py. Every figure is of the rows that the recording itself holds out.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import truing

sys.path.insert(0, str(Path(__file__).resolve().parent))
from real_data import RECORDINGS, ROOT, Recording, default_folder, fit, load

MOST = 6  # names in a cell


def millimetres(statistics: truing.common.ErrorStatistics) -> str:
    return f"{1e3 * statistics.rms:.3f} / {1e3 * statistics.median:.3f} / {1e3 * statistics.p95:.3f}"


def named(found: truing.diagnosis.Diagnosis) -> str:
    names = [
        f"{effect.effect}{' ' + '+'.join(effect.joints) if 0 < len(effect.joints) <= 2 else ''}"
        f" ({effect.probability:.2f})"
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
        "| set | base and tool | geometry | named effects | and unknown ones | named (probability) | unknown"
        " | left to a nearest neighbour | seconds |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for recording in RECORDINGS:
        line = one(folder, recording)
        if line:
            yield line
            print(line, file=sys.stderr, flush=True)


def one(folder: Path, recording: Recording) -> str:
    if not (folder / recording.folder).is_dir():
        return f"| {recording.name} | not there | | | | | | | |"
    robot, data = load(folder, recording)
    started = time.perf_counter()
    found = truing.diagnose(robot, data)
    seconds = time.perf_counter() - started
    geometry = fit(robot, data).test
    return (
        f"| {recording.name} | {millimetres(found.gap)} | {millimetres(geometry.after) if geometry else '–'}"
        f" | {millimetres(found.after)} | {millimetres(found.after_unknown)} | {named(found)} |"
        f" {unknown(found)} | {100 * found.neighbour_share:.0f} % | {seconds:.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=default_folder())
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "benchmarks" / "real-diagnosis.md")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    table = "\n".join(rows(arguments.data))
    page = arguments.out.read_text(encoding="utf-8")
    start, end = page.index("<!-- table -->") + len("<!-- table -->"), page.index("<!-- end -->")
    arguments.out.write_text(page[:start] + "\n" + table + "\n" + page[end:], encoding="utf-8")


if __name__ == "__main__":
    main()
