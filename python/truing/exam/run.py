# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sitting the examination: sets are made and sealed, answered, stored; then labels are opened and scored."""

from __future__ import annotations

import functools
import json
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from truing.exam.workers import Lost, dealt

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
    names = _limited(sets.ids(which, quick=quick, families=families, only=only, seed=seed), limit)
    folder, stored = _folder(out, {"set": which, "seed": seed, "build": f"{package_build()} {build}"}, resume)
    left_out = dict(sets.skipped(which, names))
    names = [name for name in names if name not in left_out]
    papers = []
    for done, paper in enumerate(_sat(names, candidate, workers, timeout, folder, stored), 1):
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
        _write(folder, papers, sheets, scores)
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
        return _again(id, case.label, stored)
    envelope = _seal(id, case, folder)
    clock = _Clock()
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


class _Clock:
    """What a diagnosis costs, from when this is made."""

    def __init__(self) -> None:
        self.began = time.perf_counter(), time.process_time()

    def spent(self) -> tuple[float, float]:
        """By the clock, and by the processor [s]."""
        return time.perf_counter() - self.began[0], time.process_time() - self.began[1]


def _give_up(id: str, lost: Lost, folder: Path | None) -> Paper:
    """A set whose process is gone, and its envelope with it: it is sealed again, and counts as wrong."""
    envelope = _seal(id, sets.build(id), folder)
    return _answered(id, envelope, failed(lost.why, lost.seconds), {}, folder)


def _seal(id: str, case: Case, folder: Path | None) -> Envelope:
    envelope = sealed(case.label)
    _append(folder, "salts.jsonl", {"id": id, "salt": envelope.salt})
    _append(folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": fingerprint(case.data)})
    return envelope


def _answered(
    id: str, envelope: Envelope, answer: Answer, others: dict[str, Answer], folder: Path | None
) -> Paper:
    told = {name: other.to_dict() for name, other in others.items()}
    _append(folder, "answers.jsonl", {"id": id, "answer": answer.to_dict(), "others": told})
    return Paper(id, envelope.seal, envelope, answer, others)


def _again(id: str, label: dict[str, Any], stored: Mapping[str, Any]) -> Paper:
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


def _sat(
    names: Sequence[str],
    candidate: Candidate,
    workers: int,
    timeout: float | None,
    folder: Path | None,
    stored: Mapping[str, Mapping[str, Any]],
) -> Iterator[Paper | LeftOut]:
    """Papers as they come. Every set is made by a worker, be it the only one: one thread of linear algebra
    makes the same bits as another one, several do not.
    """
    jobs = {name: functools.partial(sit, name, candidate, folder, stored.get(name)) for name in names}
    lost: dict[str, Lost] = {}
    for name, paper in dealt(jobs, max(workers, 1), timeout):
        if isinstance(paper, Lost):
            lost[name] = paper
        else:
            yield paper
    again = {name: functools.partial(_give_up, name, why, folder) for name, why in lost.items()}
    for name, paper in dealt(again, max(workers, 1)):
        if isinstance(paper, Lost):
            raise RuntimeError(f"{name}: the examiner cannot make this set: {paper.why}")
        yield paper


_ANSWERED = ("sealed.jsonl", "salts.jsonl", "answers.jsonl")
_AFTERWARDS = ("labels.jsonl", "scores.json", "scores.md")
_SITTING = "sitting.json"
"""Of which set, seed and build the answers are."""


def _folder(
    out: Path | str | None, sitting: Mapping[str, Any], resume: bool
) -> tuple[Path | None, dict[str, dict[str, Any]]]:
    """Where files go, and what was answered there in the same sitting. Of another one nothing is touched."""
    if out is None:
        return None, {}
    folder = Path(out)
    if resume:
        _refuse_another(folder, sitting)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in _AFTERWARDS if resume else (*_ANSWERED, *_AFTERWARDS):
            (folder / name).unlink(missing_ok=True)
        (folder / _SITTING).write_text(json.dumps(sitting), encoding="utf-8")
    except OSError as error:
        raise truing.InputError(f"{folder}: cannot be written: {error.strerror}") from None
    return folder, _stored(folder) if resume else {}


def _refuse_another(folder: Path, sitting: Mapping[str, Any]) -> None:
    """InputError if the answers in a folder are of another sitting."""
    if not any((folder / name).is_file() for name in _ANSWERED):
        return
    try:
        before = json.loads(_text(folder / _SITTING))
        differ = [name for name, value in sitting.items() if before[name] != value]
    except (ValueError, KeyError, TypeError):
        raise truing.InputError(
            f"{folder}: holds answers, but no {_SITTING} that says whose they are: sit it from the start,"
            " without --resume"
        ) from None
    told = [
        f"another {name}" + ("" if name == "build" else f" ({before[name]}, expected {sitting[name]})")
        for name in differ
    ]
    if told:
        raise truing.InputError(
            f"{folder}: holds the answers of {' and '.join(told)}, and a sitting is of one: sit it from the"
            " start, without --resume, or in another folder"
        )


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8") if file.is_file() else ""


def _stored(folder: Path) -> dict[str, dict[str, Any]]:
    """Seal, salt and answer of every set that has all three; of sets sealed twice the last."""
    found: dict[str, dict[str, Any]] = {}
    for name in ("sealed.jsonl", "salts.jsonl", "answers.jsonl"):
        for entry in _whole_lines(folder / name):
            found.setdefault(entry["id"], {}).update(entry)
    needed = {"seal", "salt", "answer", "others"}
    return {id: entry for id, entry in found.items() if needed <= set(entry)}


def _whole_lines(file: Path) -> list[dict[str, Any]]:
    """What a file holds; the end of a line at which the sitting before was ended is cut off."""
    text = _text(file)
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        file.write_text(whole, encoding="utf-8")
    return [json.loads(line) for line in whole.splitlines()]


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
    (folder / "scores.md").write_text(markdown(scores) + "\n" + cost_markdown(scores), encoding="utf-8")
