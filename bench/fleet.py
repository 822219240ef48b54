# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Times passes over a long recording of positions on Dask workers, and says what they hold in memory.

    python bench/fleet.py FOLDER [--rows 1e7] [--files 10] [--workers 1,2] [--whole]

Writes simulated positions of a UR10 to FOLDER once: one Parquet file of rows / files rows in row groups of a
million, and hard links to it for the others, so that 10^8 rows take the disk of 10^7. A worker reads, checks
and sums every row of every file all the same; only the operating system's cache sees fewer bytes than those
of as many files. --whole times `truing.fleet.identify` from end to end as well.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import truing
from truing.examples import example
from truing.fleet.fit import Settings, plan_of
from truing.fleet.passes import Arm, Task, sum_all, sum_partition
from truing.fleet.source import partitions_of
from truing.fleet.workers import Workers, workers_of
from truing.testing.simulation import measure, true_robot

ROW_GROUP = 1_000_000
NOISE = 5e-5  # [m]


def write_recording(folder: Path, rows: int, files: int) -> list[Path]:
    """The files of a recording, written unless they are there."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"part-{k:03d}.parquet" for k in range(files)]
    if all(path.exists() for path in paths) and pq.read_metadata(paths[0]).num_rows == rows // files:
        return paths
    for path in paths:
        path.unlink(missing_ok=True)
    robot = truing.load_robot(example("ur10"))
    truth = true_robot(robot, lengths=5e-4, angles=5e-4, base_unknown=True, seed=1)
    names = [f"q{k + 1}_rad" for k in range(6)] + ["x_m", "y_m", "z_m"]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pq.ParquetWriter(paths[0], schema, compression="none", use_dictionary=False) as file:
        for group, first in enumerate(range(0, rows // files, ROW_GROUP)):
            count = min(ROW_GROUP, rows // files - first)
            simulated = measure(truth, poses=count, noise=NOISE, seed=100 + group).data
            columns = [*np.asarray(simulated.joints).T, *np.asarray(simulated.positions).T]
            file.write_table(pa.table(dict(zip(names, columns, strict=True)), schema), row_group_size=count)
    for path in paths[1:]:
        os.link(paths[0], path)
    return paths


def memory_of(workers: Workers) -> float:
    """The most that any worker held at any time [MB]."""

    def most() -> float:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    return max(workers.client.run(most).values()) if workers.client else most()


def processor_seconds(workers: Workers) -> float:
    """That the workers have used so far."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_SELF)
        return usage.ru_utime + usage.ru_stime

    return sum(workers.client.run(used).values())


def time_passes(paths: list[Path], count: int, repeats: int) -> dict[str, Any]:
    """A pass with Gram and errors over all rows, by so many workers."""
    robot = truing.load_robot(example("ur10"))
    source = partitions_of(paths, one_arm=True)
    with workers_of(workers=count) as workers:
        plan = plan_of(workers, partitions_of(paths[:1], one_arm=True), robot, Settings())
        arms = {name: Arm(arm.start, arm.names, arm.point) for name, arm in plan.arms.items()}
        # Every worker imports what it needs, and has its memory, before the first pass that is timed.
        workers.client.run(sum_partition, source.partitions[0], Task(robot, arms))
        seconds, used = [], []
        for _ in range(repeats):
            before, started = processor_seconds(workers), time.perf_counter()
            sums = sum_all(workers, source, Task(robot, arms))
            seconds.append(time.perf_counter() - started)
            used.append(processor_seconds(workers) - before)
        values = sum(gram.values for gram in sums.grams.values())
        return {
            "workers": count,
            "rows": values // 3,
            "columns": len(next(iter(arms.values())).names),
            "seconds": min(seconds),
            "processor": min(used),
            "memory": memory_of(workers),
        }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=float, default=1e7)
    parser.add_argument("--files", type=int, default=10)
    parser.add_argument("--workers", default="1,2")
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--whole", action="store_true")
    arguments = parser.parse_args()
    paths = write_recording(arguments.folder, int(arguments.rows), arguments.files)
    print(
        "| workers | rows | parameters | a pass [s] | rows a second | processor seconds | times one worker |"
        " memory of a worker [MB] |\n| --- | --- | --- | --- | --- | --- | --- | --- |"
    )
    first = 0.0
    for count in (int(word) for word in arguments.workers.split(",")):
        found = time_passes(paths, count, arguments.repeats)
        first = first or found["seconds"]
        print(
            f"| {count} | {found['rows']:.3g} | {found['columns']} | {found['seconds']:.1f} |"
            f" {found['rows'] / found['seconds']:.3g} | {found['processor']:.1f} |"
            f" {first / found['seconds']:.2f} | {found['memory']:.0f} |",
            flush=True,
        )
    if arguments.whole:
        robot = truing.load_robot(example("ur10"))
        count = int(arguments.workers.split(",")[-1])
        started = time.perf_counter()
        found = truing.fleet.identify(robot, paths, one_arm=True, workers=count)
        print(
            f"\nidentify on {count} workers: {time.perf_counter() - started:.1f} s, {found.passes} passes,"
            f" {found.rows:.3g} rows, held-out rms {1e3 * found.after.held_out.rms:.4f} mm"
        )


if __name__ == "__main__":
    main()
