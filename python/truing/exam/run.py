# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sitting the examination: sets are made and sealed, answered, stored; then labels are opened and scored."""

from __future__ import annotations

import functools
import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import mujoco  # noqa: F401  (what is not installed is said here, not by a worker)

import truing
from truing.exam import sets
from truing.exam.answers import (
    Answer,
    answer_from,
    answer_of,
    baselines,
    failed,
    fresh_errors,
    realised_shrink,
)
from truing.exam.builds import package_build
from truing.exam.scenes import Case, NoSetError
from truing.exam.score import Scores, Sheet, cost_markdown, markdown, score, told_left_out
from truing.exam.sealing import BrokenSealError, Envelope, fingerprint, opened, resealed, sealed
from truing.exam.sitting import Clock, append, folder_of, limited, sat
from truing.exam.workers import Lost

Candidate = Callable[[truing.Robot, truing.Measurements], Any]
"""Who sits the examination: gets robot and data, returns a Diagnosis or what has its attributes."""
Progress = Callable[[int, int], None]
"""Sets done, sets in all."""


_AGAINST_GEOMETRY = frozenset({"few", "mistaken"})
"""Families in which the result is compared with what identifying link values alone would have given."""


@dataclass(frozen=True)
class Paper:
    """What comes back from one set, its label still in the envelope."""

    id: str
    seal: str
    envelope: Envelope
    answer: Answer
    others: dict[str, Answer]


@dataclass(frozen=True)
class LeftOut:
    """A set that cannot be made, and why: nobody is asked, and no other set takes its place."""

    id: str
    why: str


def diagnose(robot: truing.Robot, data: truing.Measurements) -> Any:
    """The candidate that the examination is for."""
    return truing.diagnose(robot, data, seed=0, threads=1)  # workers share the processors already


def run_exam(
    which: Literal["development", "examination"] = "development",
    *,
    quick: bool = False,
    seed: int = 0,
    families: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    limit: int | None = None,
    build: str = "",
    resume: bool = False,
    workers: int = 2,
    out: Path | str | None = None,
    progress: Progress | None = None,
    timeout: float | None = 600.0,
    candidate: Candidate = diagnose,
) -> Scores:
    """Makes the sets, has them answered, opens the labels, and scores.

    which: "development" is there to be looked at and learned from, "examination" is not: other robots, seeds,
    unlisted effects. quick: some 60 sets that take a minute. families: only these, see `sets.COUNTS`. only:
    only these sets, "single/12". limit: at most so many sets of each family. build: what tells this candidate
    from others, beside the code of the package. resume: answers stored in `out` are kept, and their sets not
    asked again; InputError, and nothing is written, if they are of another set, seed or build. workers:
    processes, beside this one; sets are the same bits whatever their number. timeout: a diagnosis that takes
    longer [s], the making of its set included, has failed; None: it may take for ever. candidate: a function
    at the top of a module. A diagnosis that fails counts as wrong in every score.
    out: folder for sealed.jsonl (written before the answers), salts.jsonl, answers.jsonl, labels.jsonl (after
    them), scores.json and scores.md.
    """
    names = limited(sets.ids(which, quick=quick, families=families, only=only, seed=seed), limit)
    folder, stored = folder_of(
        out, {"set": which, "seed": seed, "build": f"{package_build()} {build}"}, resume
    )
    left_out = dict(sets.skipped(which, names))
    names = [name for name in names if name not in left_out]
    papers = []
    jobs = {name: functools.partial(sit, name, candidate, folder, stored.get(name)) for name in names}
    give_up = functools.partial(_give_up, folder)
    for done, paper in enumerate(sat(jobs, give_up, workers, timeout), 1):
        if isinstance(paper, LeftOut):
            left_out[paper.id] = paper.why
        else:
            papers.append(paper)
        if progress:
            progress(done, len(names))
    papers.sort(key=lambda paper: names.index(paper.id))
    sheets = [Sheet(p.id, opened(p.envelope, p.seal), p.answer, p.others) for p in papers]
    scores = score(sheets, which, left_out)
    for text in told_left_out(left_out):
        warnings.warn(text, truing.InputWarning, stacklevel=2)
    if folder:
        write_papers(folder, papers, sheets, scores)
    return scores


def sit(
    id: str,
    candidate: Candidate = diagnose,
    folder: Path | None = None,
    stored: Mapping[str, Any] | None = None,
) -> Paper | LeftOut:
    """One set: made, sealed, answered. stored: its seal, salt and answer of an earlier sitting."""
    try:
        case = sets.build(id)
    except NoSetError as error:
        return LeftOut(id, str(error))
    if stored:
        return again(id, case.label, stored)
    envelope = _seal(id, case, folder)
    clock = Clock()
    try:
        diagnosis = candidate(case.robot, case.data)
        seconds, processor = clock.spent()
        said = answer_of(diagnosis)
        others = baselines(diagnosis.candidates, case.data.rows, bool(case.label["geometry_underneath"]))
    except Exception as error:  # a candidate that fails has answered wrongly, the others still sit
        why = f"{type(error).__name__}: {error}"
        return _answered(id, envelope, failed(why, *clock.spent()), {}, folder)
    alone, poses = case.label["family"] in _AGAINST_GEOMETRY, case.fresh()
    try:
        fresh = fresh_errors(diagnosis, case.robot, case.data, poses, alone)
    except Exception as error:  # a robot that cannot be evaluated is part of the answer
        why = f"robot: {type(error).__name__}: {error}"
        return _answered(id, envelope, failed(why, seconds, processor), {}, folder)
    answer = replace(
        said,
        seconds=seconds,
        processor_seconds=processor,
        fresh=fresh,
        realised=realised_shrink(diagnosis, fresh),
    )
    return _answered(id, envelope, answer, others, folder)


def _give_up(folder: Path | None, id: str, lost: Lost) -> Callable[[], Paper | LeftOut]:
    return functools.partial(_given_up, folder, id, lost)


def _given_up(folder: Path | None, id: str, lost: Lost) -> Paper | LeftOut:
    """A set whose process is gone, and its envelope with it: it is sealed again, and counts as wrong."""
    envelope = _seal(id, sets.build(id), folder)
    return _answered(id, envelope, failed(lost.why, lost.seconds), {}, folder)


def _seal(id: str, case: Case, folder: Path | None) -> Envelope:
    envelope = sealed(case.label)
    append(folder, "salts.jsonl", {"id": id, "salt": envelope.salt})
    append(folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": fingerprint(case.data)})
    return envelope


def _answered(
    id: str, envelope: Envelope, answer: Answer, others: dict[str, Answer], folder: Path | None
) -> Paper:
    told = {name: other.to_dict() for name, other in others.items()}
    append(folder, "answers.jsonl", {"id": id, "answer": answer.to_dict(), "others": told})
    return Paper(id, envelope.seal, envelope, answer, others)


def again(id: str, label: dict[str, Any], stored: Mapping[str, Any]) -> Paper:
    """An answer of before, with the label made anew: it must be the one that was sealed then."""
    envelope = resealed(label, stored["salt"])
    try:
        opened(envelope, stored["seal"])
    except BrokenSealError:
        raise BrokenSealError(
            f"{id}: the examiner makes another label than when this set was sealed, sit it from the start"
        ) from None
    others = {name: answer_from(other) for name, other in stored["others"].items()}
    return Paper(id, envelope.seal, envelope, answer_from(stored["answer"]), others)


def write_papers(folder: Path, papers: Sequence[Paper], sheets: Sequence[Sheet], scores: Scores) -> None:
    for paper, sheet in zip(papers, sheets, strict=True):
        append(
            folder,
            "labels.jsonl",
            {"id": sheet.id, "seal": paper.seal, "salt": paper.envelope.salt, "label": paper.envelope.text},
        )
    (folder / "scores.json").write_text(json.dumps(scores.to_dict(), indent=1), encoding="utf-8")
    (folder / "scores.md").write_text(markdown(scores) + "\n" + cost_markdown(scores), encoding="utf-8")
