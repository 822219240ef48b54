# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Who does the work: Dask as it is, a cluster of this machine's own or the scheduler at an address, or this
process.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from truing.errors import InputError
from truing.fleet.source import Source

Common = TypeVar("Common")
Value = TypeVar("Value")

ANSWER_WITHIN = 10.0  # [s] a scheduler that is there answers within a fraction of a second
_MEMORY = "1GiB"  # of a worker of our own: a row group of a million rows takes a quarter of it


class Workers:
    """Runs a function over partitions and adds what it gives, in their order. client: of Dask; None: this
    process.
    """

    def __init__(self, client: Any = None) -> None:
        self.client = client
        self.passes = 0

    def run(
        self,
        work: Callable[..., Value],
        source: Source,
        common: Common,
        add: Callable[[Sequence[Value]], Value],
        at_a_time: int,
    ) -> Value:
        """`work(partition, common)` of every partition, added `at_a_time`, these sums again, and so on."""
        self.passes += 1
        partitions, frames = source.partitions, source.frames
        if self.client is None:
            done = [
                work(p, common, frames[k].compute(scheduler="synchronous") if frames else None)
                for k, p in enumerate(partitions)
            ]
            return _climb(done, add, at_a_time)  # type: ignore[no-any-return]
        from dask.delayed import delayed

        shared = delayed(
            common, pure=False, traverse=False
        )  # sent once, and known to the scheduler when a worker dies
        each, sum_up = delayed(work, pure=False), delayed(add, pure=False)
        given = frames or [None] * len(partitions)
        lots = [each(p, shared, frame) for p, frame in zip(partitions, given, strict=True)]
        total: Value = _computed(self.client, _climb(lots, sum_up, at_a_time))
        return total


def _climb(parts: list[Any], add: Callable[[Sequence[Any]], Any], at_a_time: int) -> Any:
    """The sum of all, by a tree whose shape depends on their number alone."""
    while True:
        parts = [add(parts[k : k + at_a_time]) for k in range(0, len(parts), at_a_time)]
        if len(parts) == 1:
            return parts[0]


def _computed(client: Any, task: Any) -> Any:
    from distributed import KilledWorker

    try:
        return client.compute(task, sync=True)
    except KilledWorker as error:
        raise OSError(
            "workers died again and again over one partition: the rows of a partition may be too many for"
            f" their memory; write Parquet with row groups of a million rows or less ({error.task})"
        ) from None


@contextlib.contextmanager
def workers_of(client: Any = None, workers: int | None = None) -> Iterator[Workers]:
    """Those of a client of Dask, or of a cluster on this machine that ends with the block. workers: of that
    cluster; 0: this process alone; None: one a processor.
    """
    if client is not None or workers == 0:
        yield Workers(client)
        return
    distributed = _distributed()
    import dask

    if _is_starting():  # a worker that runs its parent's script: the parent says what is wrong
        sys.exit(1)
    quiet = {"distributed.worker.daemon": True, "distributed.admin.system-monitor.gil.enabled": False}
    with (
        dask.config.set(quiet),
        _cluster_of(distributed, workers or os.cpu_count() or 1) as cluster,
        distributed.Client(cluster) as own,
    ):
        yield Workers(own)


def _is_starting() -> bool:
    """This process is being started by multiprocessing, and runs the script that its parent runs."""
    return bool(getattr(multiprocessing.current_process(), "_inheriting", False))


def _cluster_of(distributed: Any, workers: int) -> Any:
    """A cluster on this machine. Raises InputError where its processes end as soon as they begin."""
    try:
        return distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=_MEMORY,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        )
    except RuntimeError as error:
        raise InputError(
            f"the worker processes did not start ({str(error).rstrip('.')}). Each of them imports the script"
            " that starts them: in a script, put what calls truing.fleet under"
            ' `if __name__ == "__main__":`, or give workers=0'
        ) from None


@contextlib.contextmanager
def client_at(address: str) -> Iterator[Any]:
    """A client of the Dask scheduler at this address. Raises InputError where none answers, or has no
    workers.
    """
    distributed = _distributed()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    expected = "expected the address of a Dask scheduler, such as tcp://192.168.0.7:8786"
    try:
        client = distributed.Client(address, timeout=ANSWER_WITHIN, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).split("\n")[0][:120] or type(error).__name__
        raise InputError(
            f"--scheduler: found {address!r}, where none answers ({reason}); {expected}"
        ) from None
    try:
        if not client.scheduler_info()["workers"]:
            raise InputError(
                f"--scheduler: the scheduler at {address} has no workers: start some, `dask worker {address}`"
            )
        yield client
    finally:
        client.close()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError('fleets need Dask: pip install "truing[fleet]", or --workers 0') from None
    return distributed
