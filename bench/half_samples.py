# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Standard errors of real robots' parameters against what half-samples scatter by.

    python bench/half_samples.py [--data FOLDER] [--splits 8] [--seed 5] [--only WORD] [--shrink-beyond 0.05]

The poses of each recording are parted in two halves at random, repeats of a pose together, and `identify`
is run on either. Two fits to different poses differ by sqrt(s1^2 + s2^2) where their standard errors s1, s2
are right. Printed are the rms of these ratios over all parameters and splits, and their median over that of
a normal number, which a few parameters that are hardly seen do not move. 1: the errors are the scatter.
Where links are fitted near the nominal robot, parameters do not count of whose variance their prior has
as much as the rows or more: both halves have these where the nominal robot does, and so a base that the rows
can hardly tell from the first links.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from real_diagnosis import ARMS, RECORDINGS, default_folder, fit, load, parted

import truing
from truing.identification import Identification

NORMAL = 0.6745  # median of the size of a normal number


def poses_of(data: truing.Measurements) -> Any:
    """Rows at the same joints share a number. shape=(n,)"""
    return np.unique(np.round(np.asarray(data.joints), 9), axis=0, return_inverse=True)[1].ravel()


def seen(robot: truing.Robot, found: Identification) -> list[Any]:
    """Fitted parameters that the rows say more of than a prior of the links.

    To first order C = H^-1 of H = J^T J / noise^2 + P, with P = 1 / shrunk_to^2 for links: of a variance the
    prior has what C P C has of C.
    """
    fitted = [p for p in found.parameters if not p.frozen]
    if not found.shrunk_to > 0.0:
        return [p for p in fitted if p.sigma > 0.0]
    joints = {joint.name for joint in robot.joints}
    links = [k for k, p in enumerate(fitted) if p.name.split(".")[0] in joints]
    by_prior = (np.asarray(found.covariance)[:, links] ** 2).sum(axis=1) / found.shrunk_to**2
    return [p for p, part in zip(fitted, by_prior, strict=True) if p.sigma > 0.0 and part <= 0.5 * p.sigma**2]


def ratios(
    robot: truing.Robot, data: truing.Measurements, splits: int, seed: int, **options: Any
) -> NDArray[np.float64]:
    """Differences of two halves' parameters over the standard errors of these; options: of `identify`."""
    group, out = poses_of(data), []
    for number in range(splits):
        one = parted(group, len(group) // 2, number, seed)
        halves = [
            {p.name: p for p in seen(robot, fit(robot, data.replace(set=half), **options))}
            for half in (one, 1 - one)
        ]
        for name in halves[0].keys() & halves[1].keys():
            a, b = halves[0][name], halves[1][name]
            out.append((a.value - b.value) / np.hypot(a.sigma, b.sigma))
    return np.array(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=default_folder())
    parser.add_argument("--splits", type=int, default=8)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--only", default="", help="recordings with this word in their name")
    parser.add_argument("--shrink-beyond", type=float, default=0.05, help="of identify")
    arguments = parser.parse_args()
    print("| set | poses | rms | by the median |\n| --- | --- | --- | --- |")
    for recording in (*RECORDINGS, *ARMS):
        if arguments.only not in recording.name:
            continue
        if not (arguments.data / recording.folder).is_dir():
            print(f"{recording.name}: not there", file=sys.stderr)
            continue
        robot, data = load(arguments.data, recording)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of columns that every fit would say again
            found = ratios(
                robot, data, arguments.splits, arguments.seed, shrink_beyond=arguments.shrink_beyond
            )
        poses = len(np.unique(poses_of(data)))
        rms, median = np.sqrt(np.mean(found**2)), np.median(np.abs(found)) / NORMAL
        print(f"| {recording.name} | {poses} | {rms:.2f} | {median:.2f} |", flush=True)


if __name__ == "__main__":
    main()
