# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A sitting of either half: sets are made and sealed, answered, stored; then labels are opened and scored.

Its folder holds seals, salts and answers, and whose they are.
"""

from __future__ import annotations

import contextlib
import functools
import json
import tempfile
import time
import warnings
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, Protocol, TypedDict, TypeVar

import truing
from truing.exam.answers import Answer, answer_from, failed
from truing.exam.builds import package_build
from truing.exam.scenes import NoSetError
from truing.exam.score import Scores, Sheet, cost_markdown, markdown, told_left_out
from truing.exam.sealing import BrokenSealError, Envelope, opened, resealed, sealed
from truing.exam.workers import Lost, dealt

Which = Literal["development", "examination"]
Progress = Callable[[int, int], None]
"""Sets done, sets in all."""


class Labelled(Protocol):
    """A set with everything about it."""

    @property
    def label(self) -> dict[str, Any]: ...


Case = TypeVar("Case", bound=Labelled)
Handed = TypeVar("Handed")


class Half(ABC, Generic[Case, Handed]):
    """What is one half's own. Workers are given it: it must be pickled."""

    about: ClassVar[Mapping[str, str]] = {}
    """What tells its sittings from those of the other half."""

    @abstractmethod
    def ids(self, which: str, plan: Plan) -> list[str]:
        """Names of the sets that a plan asks for. Raises InputError."""

    @abstractmethod
    def skipped(self, which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Sets that cannot be made here, and why."""

    @abstractmethod
    def build(self, id: str) -> Case:
        """A set, the same every time. Raises NoSetError."""

    @abstractmethod
    def hand_over(self, id: str, case: Case, place: Path) -> tuple[Handed, str]:
        """What the candidate gets, and the fingerprint of it. place: a folder, gone after the answer."""

    @abstractmethod
    def ask(self, case: Case, handed: Handed) -> tuple[Answer, dict[str, Answer]]:
        """What the candidate answers, and what simpler methods would have said. Whatever a candidate raises
        is a wrong answer.
        """

    @abstractmethod
    def score(self, sheets: Sequence[Sheet], which: str, left_out: Mapping[str, str]) -> Scores: ...


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How an examination is sat."""

    quick: bool = False
    """A few small sets of every family, that the whole examination does not have."""
    seed: int = 0
    families: Sequence[str] | None = None
    """Only these, see COUNTS of the half's sets."""
    only: Sequence[str] | None = None
    """Only these sets, "single/12"."""
    limit: int | None = None
    """At most so many sets of each family."""
    build: str = ""
    """What tells this candidate from others, beside the code of the package."""
    resume: bool = False
    """Answers stored in `out` are kept, and their sets not asked again; InputError, and nothing is written,
    if they are of another set, seed or build.
    """
    workers: int = 2
    """Processes, beside this one; sets are the same bits whatever their number."""
    out: Path | str | None = None
    """Folder for sealed.jsonl (written before the answers), salts.jsonl, answers.jsonl, labels.jsonl (after
    them), scores.json and scores.md.
    """
    progress: Progress | None = None
    timeout: float | None = 600.0
    """[s] A diagnosis that takes longer, the making of its set included, has failed; None: it may take for
    ever.
    """


class PlanKeywords(TypedDict, total=False):
    """Fields of `Plan`."""

    quick: bool
    seed: int
    families: Sequence[str] | None
    only: Sequence[str] | None
    limit: int | None
    build: str
    resume: bool
    workers: int
    out: Path | str | None
    progress: Progress | None
    timeout: float | None


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


# ---- Its folder ----------------------------------------------------------------------------------

_ANSWERED = ("sealed.jsonl", "salts.jsonl", "answers.jsonl")
_AFTERWARDS = ("labels.jsonl", "scores.json", "scores.md")
_SITTING = "sitting.json"
"""Of which set, seed and build the answers are."""


def folder_of(
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


def append(folder: Path | None, name: str, line: dict[str, Any]) -> None:
    if folder is None:
        return
    with open(folder / name, "a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def limited(names: Sequence[str], limit: int | None) -> list[str]:
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


class Clock:
    """What a diagnosis costs, from when this is made."""

    def __init__(self) -> None:
        self.began = time.perf_counter(), time.process_time()

    def spent(self) -> tuple[float, float]:
        """By the clock, and by the processor [s]."""
        return time.perf_counter() - self.began[0], time.process_time() - self.began[1]


# ---- A sitting -----------------------------------------------------------------------------------


def held(half: Half[Any, Any], which: Which, plan: Plan) -> Scores:
    """Makes the sets, has them answered, opens the labels, and scores. A diagnosis that fails counts as wrong
    in every score.
    """
    names = limited(half.ids(which, plan), plan.limit)
    about = {"set": which, **half.about, "seed": plan.seed, "build": f"{package_build()} {plan.build}"}
    folder, stored = folder_of(plan.out, about, plan.resume)
    left_out = dict(half.skipped(which, names))
    names = [name for name in names if name not in left_out]
    papers = []
    jobs = {name: functools.partial(sit, name, half, folder, stored.get(name)) for name in names}
    for done, paper in enumerate(_sat(jobs, functools.partial(_give_up, half, folder), plan), 1):
        if isinstance(paper, LeftOut):
            left_out[paper.id] = paper.why
        else:
            papers.append(paper)
        if plan.progress:
            plan.progress(done, len(names))
    papers.sort(key=lambda paper: names.index(paper.id))
    sheets = [Sheet(p.id, opened(p.envelope, p.seal), p.answer, p.others) for p in papers]
    scores = half.score(sheets, which, left_out)
    for text in told_left_out(left_out):
        warnings.warn(text, truing.InputWarning, stacklevel=3)
    if folder:
        _write_papers(folder, papers, sheets, scores)
    return scores


def _sat(
    jobs: Mapping[str, Callable[[], Paper | LeftOut]],
    give_up: Callable[[str, Lost], Callable[[], Paper | LeftOut]],
    plan: Plan,
) -> Iterator[Paper | LeftOut]:
    """Papers as they come. Every set is made by a worker, be it the only one: one thread of linear algebra
    makes the same bits as another one, several do not. give_up: the job that stands for one whose process is
    gone.
    """
    lost: dict[str, Lost] = {}
    workers = max(plan.workers, 1)
    for name, paper in dealt(jobs, workers, plan.timeout):
        if isinstance(paper, Lost):
            lost[name] = paper
        else:
            yield paper
    for name, paper in dealt({name: give_up(name, why) for name, why in lost.items()}, workers):
        if isinstance(paper, Lost):
            raise RuntimeError(f"{name}: the examiner cannot make this set: {paper.why}")
        yield paper


def sit(
    id: str, half: Half[Any, Any], folder: Path | None = None, stored: Mapping[str, Any] | None = None
) -> Paper | LeftOut:
    """One set: made, sealed, answered. stored: its seal, salt and answer of an earlier sitting."""
    try:
        case = half.build(id)
    except NoSetError as error:
        return LeftOut(id, str(error))
    if stored:
        return _again(id, case.label, stored)
    with _sealed(id, half, case, folder) as (envelope, handed):
        return _answered(id, envelope, *half.ask(case, handed), folder)


def _give_up(half: Half[Any, Any], folder: Path | None, id: str, lost: Lost) -> Callable[[], Paper]:
    return functools.partial(_given_up, half, folder, id, lost)


def _given_up(half: Half[Any, Any], folder: Path | None, id: str, lost: Lost) -> Paper:
    """A set whose process is gone, and its envelope with it: it is sealed again, and counts as wrong."""
    with _sealed(id, half, half.build(id), folder) as (envelope, _):
        return _answered(id, envelope, failed(lost.why, lost.seconds), {}, folder)


@contextlib.contextmanager
def _sealed(
    id: str, half: Half[Case, Handed], case: Case, folder: Path | None
) -> Iterator[tuple[Envelope, Handed]]:
    """The envelope of a set, its seal given away, and what is handed over."""
    with tempfile.TemporaryDirectory(prefix="truing-exam-") as place:
        handed, fingerprint = half.hand_over(id, case, Path(place))
        envelope = sealed(case.label)
        append(folder, "salts.jsonl", {"id": id, "salt": envelope.salt})
        append(folder, "sealed.jsonl", {"id": id, "seal": envelope.seal, "data": fingerprint})
        yield envelope, handed


def _answered(
    id: str, envelope: Envelope, answer: Answer, others: dict[str, Answer], folder: Path | None
) -> Paper:
    told = {name: other.to_dict() for name, other in others.items()}
    append(folder, "answers.jsonl", {"id": id, "answer": answer.to_dict(), "others": told})
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


def _write_papers(folder: Path, papers: Sequence[Paper], sheets: Sequence[Sheet], scores: Scores) -> None:
    for paper, sheet in zip(papers, sheets, strict=True):
        append(
            folder,
            "labels.jsonl",
            {"id": sheet.id, "seal": paper.seal, "salt": paper.envelope.salt, "label": paper.envelope.text},
        )
    (folder / "scores.json").write_text(json.dumps(scores.to_dict(), indent=1), encoding="utf-8")
    (folder / "scores.md").write_text(markdown(scores) + "\n" + cost_markdown(scores), encoding="utf-8")
