# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a sitting keeps in its folder: seals, salts, answers, and whose they are."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import truing
from truing.exam.workers import Lost, dealt

Paper = TypeVar("Paper")

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


def sat(
    jobs: Mapping[str, Callable[[], Paper]],
    give_up: Callable[[str, Lost], Callable[[], Paper]],
    workers: int,
    timeout: float | None,
) -> Iterator[Paper]:
    """Papers as they come. Every set is made by a worker, be it the only one: one thread of linear algebra
    makes the same bits as another one, several do not. give_up: the job that stands for one whose process is
    gone.
    """
    lost: dict[str, Lost] = {}
    for name, paper in dealt(jobs, max(workers, 1), timeout):
        if isinstance(paper, Lost):
            lost[name] = paper
        else:
            yield paper
    for name, paper in dealt({name: give_up(name, why) for name, why in lost.items()}, max(workers, 1)):
        if isinstance(paper, Lost):
            raise RuntimeError(f"{name}: the examiner cannot make this set: {paper.why}")
        yield paper
