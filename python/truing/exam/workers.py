# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Jobs dealt to processes that die with whoever deals them, and whose crash costs one job only.

A pool of the standard library waits for what its workers have begun when it is interrupted, and leaves them
behind when it is killed. Here an interrupted dealer kills them at once, and each of them watches whether it
is alive.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Generic, TypeVar

Result = TypeVar("Result")
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass
class _Worker(Generic[Result]):
    process: BaseProcess
    line: Connection
    job: str = ""  # what it works at; "": nothing


def dealt(jobs: Mapping[str, Callable[[], Result]], workers: int) -> Iterator[tuple[str, Result | None]]:
    """Names of jobs and their results as they come; None: the job took its process down. Jobs must be
    pickled: a function at the top of a module, or a `partial` of one. What a job raises is raised here.
    """
    # One thread for linear algebra in each process: more would fight over the processors.
    for variable in _THREADS:
        os.environ.setdefault(variable, "1")
    waiting = list(jobs)[::-1]
    team: list[_Worker[Result]] = []
    try:
        while waiting or any(worker.job for worker in team):
            while waiting and len(team) < workers:
                team.append(_started())
            for worker in team:
                if waiting and not worker.job:
                    worker.job = waiting.pop()
                    worker.line.send(jobs[worker.job])
            busy = [worker for worker in team if worker.job]
            ready = wait([worker.line for worker in busy])
            for worker in busy:
                if worker.line in ready:
                    name, worker.job = worker.job, ""
                    yield name, _result(worker, team)
    finally:
        for worker in team:
            worker.process.kill()
        for worker in team:
            worker.process.join()


def _result(worker: _Worker[Result], team: list[_Worker[Result]]) -> Result | None:
    try:
        result, error = worker.line.recv()
    except (EOFError, ConnectionResetError):
        team.remove(worker)
        worker.process.join()
        return None
    if error is not None:
        raise error
    found: Result = result
    return found


def _started() -> _Worker[Result]:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there,), daemon=True)
    process.start()
    there.close()
    return _Worker(process, here)


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
