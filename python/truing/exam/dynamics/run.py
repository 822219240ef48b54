# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sitting the dynamic half: sets are written as files and sealed, answered from the files, stored; then
labels are opened and scored.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import truing
from truing.exam.answers import failed
from truing.exam.builds import package_build
from truing.exam.dynamics import sets
from truing.exam.dynamics.answers import answer_of, realised
from truing.exam.dynamics.scenes import Case
from truing.exam.dynamics.score import score
from truing.exam.run import LeftOut, Paper, again, write_papers
from truing.exam.scenes import NoSetError
from truing.exam.score import Scores, Sheet, told_left_out
from truing.exam.sealing import opened, sealed
from truing.exam.sitting import Clock, append, folder_of, limited, sat
from truing.exam.workers import Lost

Candidate = Callable[[Path, Sequence[Path]], Any]
"""Who sits the examination: gets the files of robot and recordings, returns a diagnosis or what has its
attributes.
"""
Progress = Callable[[int, int], None]
"""Sets done, sets in all."""


def diagnose(robot: Path, recordings: Sequence[Path]) -> Any:
    """The candidate that the examination is for."""
    dynamics = importlib.import_module("truing.dynamics")
    arm = truing.load_robot(robot)
    return dynamics.diagnose(arm, dynamics.load_recordings(list(recordings), arm))


def has_candidate() -> bool:
    """Whether this truing has a dynamic diagnosis."""
    if importlib.util.find_spec("truing.dynamics") is None:
        return False
    return hasattr(importlib.import_module("truing.dynamics"), "diagnose")


@dataclass(frozen=True)
class Sitting:
    """What all sets of a sitting share."""

    candidate: Candidate
    folder: Path | None  # of seals and answers
    sets: Path | None  # where the sets' files are kept; None: nowhere


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
    keep: Path | str | None = None,
) -> Scores:
    """Makes the sets, has them answered from their files, opens the labels, and scores. Arguments as those of
    `truing.exam.run.run_exam`; keep: folder in which the files of every set stay.
    """
    if candidate is diagnose and not has_candidate():
        raise truing.InputError("this truing has no dynamic diagnosis: truing.dynamics.diagnose is not there")
    names = limited(sets.ids(which, quick=quick, families=families, only=only, seed=seed), limit)
    about = {"set": which, "half": "dynamics", "seed": seed, "build": f"{package_build()} {build}"}
    folder, stored = folder_of(out, about, resume)
    left_out = dict(sets.skipped(which, names))
    names = [name for name in names if name not in left_out]
    sitting = Sitting(candidate, folder, Path(keep) if keep else None)
    papers = []
    jobs = {name: functools.partial(sit, name, sitting, stored.get(name)) for name in names}
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


def sit(id: str, sitting: Sitting, stored: Mapping[str, Any] | None = None) -> Paper | LeftOut:
    """One set: made, written, sealed, answered. stored: its seal, salt and answer of an earlier sitting."""
    try:
        case = sets.build(id)
    except NoSetError as error:
        return LeftOut(id, str(error))
    if stored:
        return again(id, case.label, stored)
    if sitting.sets:
        return _asked(id, case, sitting, sitting.sets / id.replace("/", "_"))
    with tempfile.TemporaryDirectory(prefix="truing-exam-") as place:
        return _asked(id, case, sitting, Path(place))


def _asked(id: str, case: Case, sitting: Sitting, place: Path) -> Paper:
    robot, recordings = case.write(place)
    envelope = sealed(case.label)
    append(sitting.folder, "salts.jsonl", {"id": id, "salt": envelope.salt})
    handed = fingerprint([robot, *recordings])
    append(sitting.folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": handed})
    clock = Clock()
    try:
        diagnosis = sitting.candidate(robot, recordings)
        seconds, processor = clock.spent()
        said = answer_of(diagnosis)
        better = realised(diagnosis, case.write_kept_back(place / "kept_back"))
        answer = replace(said, seconds=seconds, processor_seconds=processor, realised=better)
    except Exception as error:  # a candidate that fails has answered wrongly, the others still sit
        answer = failed(f"{type(error).__name__}: {error}", *clock.spent())
    append(sitting.folder, "answers.jsonl", {"id": id, "answer": answer.to_dict(), "others": {}})
    return Paper(id, envelope.seal, envelope, answer, {})


def fingerprint(files: Sequence[Path]) -> str:
    """Of what was handed over: names and bytes."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def _give_up(folder: Path | None, id: str, lost: Lost) -> Callable[[], Paper | LeftOut]:
    return functools.partial(_given_up, folder, id, lost)


def _given_up(folder: Path | None, id: str, lost: Lost) -> Paper | LeftOut:
    """A set whose process is gone, and its envelope with it: it is sealed again, and counts as wrong."""
    envelope = sealed(sets.build(id).label)
    append(folder, "salts.jsonl", {"id": id, "salt": envelope.salt})
    append(folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": ""})
    answer = failed(lost.why, lost.seconds)
    append(folder, "answers.jsonl", {"id": id, "answer": answer.to_dict(), "others": {}})
    return Paper(id, envelope.seal, envelope, answer, {})
