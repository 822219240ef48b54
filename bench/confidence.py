# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fits the weights by which a name's grounds make its stated confidence, to how often names were right.

    python bench/confidence.py OUT [OUT ...]

OUT: folders of `truing exam ... --out OUT`, one seed each. Maximum likelihood of a logistic map (Platt 1999)
times the posterior, never below one half, as in cpp/src/estimation/confidence.hpp; judged where each seed is
left out of the fit. Beside it what the answers themselves stated.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from truing.exam.answers import answer_from
from truing.exam.score import Sheet, calibration_error, stated_names

LEAST = 0.5  # as kNamed
SHRINK = 1e-3  # of each squared weight, in log likelihood: weights stay finite where all names were right


def sheets_of(folder: Path) -> list[Sheet]:
    """A sitting's labels and answers."""
    place = next(folder.rglob("answers.jsonl")).parent
    lines = {name: (place / name).read_text().splitlines() for name in ("labels.jsonl", "answers.jsonl")}
    labels = {one["id"]: json.loads(one["label"]) for one in map(json.loads, lines["labels.jsonl"])}
    answers = [json.loads(line) for line in lines["answers.jsonl"]]
    return [
        Sheet(one["id"], labels[one["id"]], answer_from(one["answer"]), {})
        for one in answers
        if one["id"] in labels
    ]


class Names:
    """Names that were stated with their grounds, of all sittings."""

    def __init__(self, folders: list[Path]) -> None:
        rows = [
            (at, sheet.label["family"], item, hit)
            for at, folder in enumerate(folders)
            for sheet in sheets_of(folder)
            if sheet.answer.verdict != "does_not_hold"
            for item, hit in stated_names(sheet)
            if item.grounds
        ]
        self.grounds = [name for name in rows[0][2].grounds if name != "posterior"]
        self.seed = np.array([row[0] for row in rows])
        self.family = np.array([row[1] for row in rows])
        self.stated = np.array([row[2].probability for row in rows])
        self.hit = np.array([float(row[3]) for row in rows])
        self.posterior = np.array([row[2].grounds["posterior"] for row in rows])
        self.x = np.array([[row[2].grounds[name] for name in self.grounds] for row in rows])

    def map(self, weights: Any, at: Any) -> Any:
        return self.posterior[at] / (1.0 + np.exp(-np.clip(self.x[at] @ weights, -40.0, 40.0)))

    def fit(self, at: Any) -> Any:
        def loss(weights: Any) -> float:
            return log_loss(self.map(weights, at), self.hit[at]) + SHRINK * float(weights @ weights) / len(at)

        return minimize(loss, np.zeros(self.x.shape[1]), method="BFGS").x


def log_loss(p: Any, hit: Any) -> float:
    p = np.clip(p, 1e-9, 1.0 - 1e-9)
    return -float(np.mean(hit * np.log(p) + (1.0 - hit) * np.log(1.0 - p)))


def figures(p: Any, names: Names) -> str:
    hit, seeds = names.hit, set(names.seed)
    each = np.mean([calibration_error(p[names.seed == s], hit[names.seed == s]) for s in seeds])
    certain = p > 0.9
    return (
        f"log loss {log_loss(p, hit):.4f}, Brier {np.mean((p - hit) ** 2):.4f}, "
        f"ECE {calibration_error(p, hit):.4f}, of one seed {each:.4f}; "
        f"above .9: {certain.sum()}, wrong {int((certain & (hit == 0)).sum())}"
    )


def main(folders: list[Path]) -> None:
    names = Names(folders)
    print(f"{len(names.hit)} names of {len(folders)} seeds, {int(names.hit.sum())} right")
    print("as stated:     ", figures(names.stated, names))
    everything = np.arange(len(names.hit))
    weights = names.fit(everything)
    print("fitted:        ", figures(np.maximum(LEAST, names.map(weights, everything)), names))
    if len(folders) > 1:
        p = np.zeros(len(names.hit))
        for seed in set(names.seed):
            left_out = np.flatnonzero(names.seed == seed)
            p[left_out] = names.map(names.fit(np.flatnonzero(names.seed != seed)), left_out)
        p = np.maximum(LEAST, p)
        print("seeds left out:", figures(p, names))
        for family in sorted(set(names.family)):
            of = names.family == family
            said, right = p[of].mean(), names.hit[of].mean()
            ece = calibration_error(p[of], names.hit[of])
            print(f"  {family}: {of.sum()} names, said {said:.3f}, right {right:.3f}, ECE {ece:.3f}")
    for name, weight in zip(names.grounds, weights, strict=True):
        print(f"{name}: {weight:.3g}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main([Path(argument) for argument in sys.argv[1:]])
