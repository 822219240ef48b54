# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Jobs dealt to processes that die with whoever deals them, and whose crash costs one job only.

Linear algebra has one thread in each of them, whatever the dealer's has: sums over rows are then taken in one
order, and results are the same bits however many processes there are.

A pool of the standard library waits for what its workers have begun when it is interrupted, and leaves them
behind when it is killed. Here an interrupted dealer kills them at once, and each of them watches whether it
is alive.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Generic, TypeVar

Result = TypeVar("Result")
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@dataclass(frozen=True)
class Lost:
    """What stands for the result of a job that has none: its process crashed, or it took too long."""

    why: str
    seconds: float  # from when it was dealt


@dataclass
class _Worker(Generic[Result]):
    process: BaseProcess
    line: Connection
    job: str = ""  # what it works at; "": nothing
    since: float = 0.0  # when it was dealt [s]


def dealt(
    jobs: Mapping[str, Callable[[], Result]], workers: int, timeout: float | None = None
) -> Iterator[tuple[str, Result | Lost]]:
    """Names of jobs and their results as they come, or `Lost`. Jobs must be pickled: a function at the top of
    a module, or a `partial` of one. What a job raises is raised here. timeout: a job's process is ended after
    so long [s]; None: never.
    """
    waiting = list(jobs)[::-1]
    team: list[_Worker[Result]] = []
    try:
        while waiting or any(worker.job for worker in team):
            while waiting and len(team) < workers:
                team.append(_started())
            for worker in team:
                if waiting and not worker.job:
                    worker.job, worker.since = waiting.pop(), time.monotonic()
                    worker.line.send(jobs[worker.job])
            busy = [worker for worker in team if worker.job]
            ready = wait([worker.line for worker in busy], _until_the_first_is_late(busy, timeout))
            for worker in busy:
                late = timeout is not None and time.monotonic() - worker.since >= timeout
                if worker.line in ready:
                    name, worker.job = worker.job, ""
                    result = _result(worker, team)
                    yield name, result
                elif late:
                    yield worker.job, _ended(worker, team, f"no answer after {timeout:g} s")
    finally:
        for worker in team:
            worker.process.kill()
        for worker in team:
            worker.process.join()


def _until_the_first_is_late(busy: list[_Worker[Result]], timeout: float | None) -> float | None:
    if timeout is None:
        return None
    return max(0.0, min(worker.since for worker in busy) + timeout - time.monotonic())


def _ended(worker: _Worker[Result], team: list[_Worker[Result]], why: str) -> Lost:
    team.remove(worker)
    worker.process.kill()
    worker.process.join()
    return Lost(why, time.monotonic() - worker.since)


def _result(worker: _Worker[Result], team: list[_Worker[Result]]) -> Result | Lost:
    try:
        result, error = worker.line.recv()
    except (EOFError, ConnectionResetError):
        return _ended(worker, team, "the process crashed")
    if error is not None:
        raise error
    found: Result = result
    return found


def _started() -> _Worker[Result]:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there,), daemon=True)
    with _one_thread():
        process.start()
    there.close()
    return _Worker(process, here)


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    """What is started meanwhile has one thread for linear algebra, which is read when numpy is imported."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _work(line: Connection) -> None:
    """What a worker does: one job after the other, until the dealer hangs up."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # the terminal tells the dealer as well, and that one ends us
    threading.Thread(target=_die_with_the_dealer, daemon=True).start()
    while True:
        try:
            job = line.recv()
        except EOFError:
            return
        try:
            result = job()
        except Exception as error:  # it is the dealer's to judge
            line.send((None, error))
        else:
            line.send((result, None))


def _die_with_the_dealer() -> None:
    dealer = multiprocessing.parent_process()
    if dealer is not None:
        wait([dealer.sentinel])
        os._exit(1)
