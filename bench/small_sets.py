# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses few poses of long recordings, and judges what was found on all other poses of the recording.

    python bench/small_sets.py [--data FOLDER] [--draws 12] [--poses 25,40,70] [--seed 0] [--only WORD]

FOLDER as for bench/real_data.py. Of each recording so many poses are drawn, several times. What counts is how
often robot.yaml, as `diagnose` writes it, is worse on poses that it never saw than plain geometry (least
squares of all links), than `identify`, and than base and tool alone, by more than 5 %.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import truing

sys.path.insert(0, str(Path(__file__).resolve().parent))
from real_data import RECORDINGS, Figures, Recording, default_folder, fit, load

NO_BASELINE = Figures(rms=float("nan"))
ARMS = tuple(
    Recording(
        f"Meca500 {side}", "meca500_arms", NO_BASELINE, NO_BASELINE, measurements=f"measurements_{side}.csv"
    )
    for side in ("left", "right")
)
COLUMNS = (
    "joints",
    "positions",
    "orientations",
    "distances",
    "fixed_points",
    "targets",
    "directions",
    "joint_speeds",
    "payload",
    "temperature",
    "time",
    "pose",
    "position_sigma",
    "rotation_sigma",
    "weight",
)


def subset(data: truing.Measurements, rows: Any, robot: truing.Robot) -> truing.Measurements:
    """These rows of the data, without a split."""
    columns = {
        name: np.asarray(column)[rows] for name in COLUMNS if (column := getattr(data, name)) is not None
    }
    if "targets" in columns:
        columns["target_names"] = [target.name for target in robot.targets]
    if "fixed_points" in columns:
        columns["fixed_point_names"] = data.fixed_point_names
    covariates = {name: np.asarray(column)[rows] for name, column in data.covariates.items()}
    return truing.Measurements(**columns, covariates=covariates)


def rms(robot: truing.Robot | None, data: truing.Measurements) -> float:
    """Of position or distance errors [mm]; the worst 2 % of the rows, the recording's own, are left out."""
    if robot is None:
        return float("inf")
    left = truing.residuals(robot, data)
    error = np.abs(left.distance) if data.distances is not None else np.linalg.norm(left.position, axis=1)
    error = np.sort(error[np.isfinite(error)])
    return 1e3 * float(np.sqrt(np.mean(error[: round(0.98 * len(error))] ** 2)))


def geometry_of(
    robot: truing.Robot, data: truing.Measurements, seed: int, **options: Any
) -> truing.Robot | None:
    """None: too few values."""
    try:
        return fit(robot, data, seed=seed, **options).robot
    except truing.InputError:
        return None


def with_directions(data: truing.Measurements, directions: Any) -> truing.Measurements:
    """Approach directions at random, where `diagnose` inferred those of the poses drawn."""
    if directions is None or data.directions is not None:
        return data
    return data.replace(
        directions=np.random.default_rng(0).choice([-1.0, 1.0], size=np.asarray(data.joints).shape)
    )


def one(recording: Recording, folder: Path, poses: Sequence[int], draws: int, seed: int) -> list[list[float]]:
    robot, data = load(folder, recording)
    group = np.asarray(truing.model.pose_groups(data))
    groups = np.unique(group)
    table = []
    for count in poses:
        if len(groups) < 2 * count and len(groups) < count + 40:
            continue
        for draw in range(draws):
            rng = np.random.default_rng([seed, count, draw])
            chosen = np.isin(group, rng.permutation(groups)[:count])
            few = subset(data, chosen, robot)
            fresh = subset(data, ~chosen, robot)
            found = truing.diagnose(robot, few, seed=draw)
            fresh = with_directions(fresh, found.directions)
            plain_robot = geometry_of(robot, few, draw, shrink_beyond=float("inf"))
            nothing, plain, identified, ours = (
                rms(r, fresh)
                for r in (found.robot_before, plain_robot, geometry_of(robot, few, draw), found.robot)
            )
            names = " ".join(
                f"{e.effect}{':' + '+'.join(e.joints) if len(e.joints) < 3 else ''}" for e in found.effects
            )
            print(
                f"{recording.name:32s} {count:3d} {draw:2d}  frames {nothing:8.3f}  geometry {plain:8.3f}"
                f"  identify {identified:8.3f}  diagnose {ours:8.3f}"
                f"  said {1e3 * found.gap.rms:.3f} to {1e3 * found.after.rms:.3f}"
                f" {found.verdict}: {names}",
                flush=True,
            )
            table.append([nothing, plain, identified, ours])
    return table


def share(worse: Any) -> str:
    return f"{np.sum(worse)} of {len(worse)} ({100 * np.mean(worse):.1f} %)"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=default_folder())
    parser.add_argument("--draws", type=int, default=12)
    parser.add_argument("--poses", default="25,40,70")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    table: list[list[float]] = []
    for recording in (*RECORDINGS, *ARMS):
        if arguments.only in recording.name and (arguments.data / recording.folder).is_dir():
            poses = [int(word) for word in arguments.poses.split(",")]
            table += one(recording, arguments.data, poses, arguments.draws, arguments.seed)
    nothing, plain, identified, ours = np.array(table).T
    others = {"geometry": plain, "identify": identified, "base and tool alone": nothing}
    for name, theirs in others.items():
        print(f"diagnose worse than {name} by more than 5 %: {share(~(ours <= 1.05 * theirs))}")
        ratio = ours / theirs
        print(f"  median of diagnose / {name}: {np.median(ratio):.3f}; worst {np.max(ratio):.3f}")
    print(f"identify worse than geometry by more than 5 %: {share(identified > 1.05 * plain)}")
    ratio = (identified / plain)[np.isfinite(plain)]
    mean = np.exp(np.mean(np.log(ratio)))
    print(f"  geometric mean of identify / geometry: {mean:.3f}; worst {np.max(ratio):.3f}")


if __name__ == "__main__":
    main()
