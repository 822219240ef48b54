# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sitting the examination: sets are made and sealed, answered, stored; then labels are opened and scored."""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import mujoco  # noqa: F401  (what is not installed is said here, not by a worker)

import truing
from truing.exam import sets
from truing.exam.answers import Answer, answer_of, baselines, realised_shrink
from truing.exam.score import Scores, Sheet, markdown, score
from truing.exam.sealing import Envelope, fingerprint, opened, sealed

Candidate = Callable[[truing.Robot, truing.Measurements], Any]
"""Who sits the examination: gets robot and data, returns a Diagnosis or what has its attributes."""
Progress = Callable[[int, int], None]
"""Sets done, sets in all."""


@dataclass(frozen=True)
class Paper:
    """What comes back from one set, its label still in the envelope."""

    id: str
    seal: str
    envelope: Envelope
    answer: Answer
    others: dict[str, Answer]


def diagnose(robot: truing.Robot, data: truing.Measurements) -> Any:
    """The candidate that the examination is for."""
    return truing.diagnose(robot, data, seed=0, threads=1)  # workers share the processors already


def run_exam(
    which: Literal["development", "examination"] = "development",
    *,
    quick: bool = False,
    seed: int = 0,
    families: Sequence[str] | None = None,
    limit: int | None = None,
    workers: int = 2,
    out: Path | str | None = None,
    progress: Progress | None = None,
    candidate: Candidate = diagnose,
) -> Scores:
    """Makes the sets, has them answered, opens the labels, and scores.

    which: "development" is there to be looked at and learned from, "examination" is not: other robots, seeds,
    unlisted effects.
    quick: some 60 sets that take a minute. families: only these, see `sets.COUNTS`. limit: at most so many
    sets of each family.
    workers: processes; 1: none but this one. candidate: a function at the top of a module if there are more
    workers than one.
    out: folder for sealed.jsonl (written before the answers), answers.jsonl, labels.jsonl (after them),
    scores.json and scores.md.
    """
    folder = _folder(out)
    names = _limited(sets.ids(which, quick=quick, families=families, seed=seed), limit)
    left_out = dict(sets.skipped(which, names))
    names = [name for name in names if name not in left_out]
    papers = []
    for paper in _sat(names, candidate, workers, folder):
        papers.append(paper)
        if progress:
            progress(len(papers), len(names))
    papers.sort(key=lambda paper: names.index(paper.id))
    sheets = [Sheet(p.id, opened(p.envelope, p.seal), p.answer, p.others) for p in papers]
    scores = score(sheets, which, dict(Counter(left_out.values())))
    if folder:
        _write(folder, papers, sheets, scores)
    return scores


def sit(id: str, candidate: Candidate = diagnose, folder: Path | None = None) -> Paper:
    """One set: made, sealed, answered."""
    case = sets.build(id)
    envelope = sealed(case.label)
    _append(folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": fingerprint(case.data)})
    started = time.perf_counter()
    try:
        diagnosis = candidate(case.robot, case.data)
    except Exception as error:  # a candidate that fails has answered wrongly, the others still sit
        answer, others = Answer("error", error=f"{type(error).__name__}: {error}"), {}
    else:
        seconds = time.perf_counter() - started
        answer = replace(
            answer_of(diagnosis), seconds=seconds, realised=realised_shrink(diagnosis, case.fresh())
        )
        others = baselines(diagnosis.candidates, case.data.rows, bool(case.label["geometry_underneath"]))
    _append(folder, "answers.jsonl", {"id": id, "answer": answer.to_dict()})
    return Paper(id, envelope.seal, envelope, answer, others)


def _limited(names: Sequence[str], limit: int | None) -> list[str]:
    if limit is None:
        return list(names)
    met: Counter[str] = Counter()
    kept = []
    for name in names:
        family = name.split("/")[1]
        met[family] += 1
        if met[family] <= limit:
            kept.append(name)
    return kept


def _sat(names: Sequence[str], candidate: Candidate, workers: int, folder: Path | None) -> Iterator[Paper]:
    if workers <= 1:
        for name in names:
            yield sit(name, candidate, folder)
        return
    # Each worker is a process with one thread for linear algebra: more would fight over the processors.
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    left = dict.fromkeys(names)
    while left:
        for paper in _until_one_crashes(list(left), candidate, workers, folder):
            del left[paper.id]
            yield paper
        # A candidate that takes its process down takes the others' sets with it: find out which set it was,
        # then go on with all workers.
        for name in list(left):
            alone = next(_until_one_crashes([name], candidate, 1, folder), None)
            del left[name]
            yield alone or _crashed(name, folder)
            if alone is None:
                break


def _until_one_crashes(
    names: Sequence[str], candidate: Candidate, workers: int, folder: Path | None
) -> Iterator[Paper]:
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            for done in as_completed([pool.submit(sit, name, candidate, folder) for name in names]):
                yield done.result()
        except BrokenProcessPool:
            return


def _crashed(name: str, folder: Path | None) -> Paper:
    """The first envelope went down with the process; its set is sealed again, and counts as wrong."""
    case = sets.build(name)
    envelope = sealed(case.label)
    _append(folder, "sealed.jsonl", {"id": name, "seal": envelope.seal, "data": fingerprint(case.data)})
    answer = Answer("error", error="the process crashed")
    _append(folder, "answers.jsonl", {"id": name, "answer": answer.to_dict()})
    return Paper(name, envelope.seal, envelope, answer, {})


def _folder(out: Path | str | None) -> Path | None:
    if out is None:
        return None
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("sealed.jsonl", "answers.jsonl", "labels.jsonl"):
        (folder / name).unlink(missing_ok=True)
    return folder


def _append(folder: Path | None, name: str, line: dict[str, Any]) -> None:
    if folder is None:
        return
    with open(folder / name, "a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def _write(folder: Path, papers: Sequence[Paper], sheets: Sequence[Sheet], scores: Scores) -> None:
    for paper, sheet in zip(papers, sheets, strict=True):
        _append(
            folder,
            "labels.jsonl",
            {"id": sheet.id, "seal": paper.seal, "salt": paper.envelope.salt, "label": paper.envelope.text},
        )
    (folder / "scores.json").write_text(json.dumps(scores.to_dict(), indent=1), encoding="utf-8")
    (folder / "scores.md").write_text(markdown(scores), encoding="utf-8")
