# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Replay a recording: fuse, predict, correct; nothing is used before it arrived.

Writes result.json, report.html, compensation.csv (one row for each row of the plan), and setup.yaml with the
modes if they were identified. Exit status 1 if there is a plan and none of it could be compensated.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, File, RobotFile, Time, TipLink, core
from truing.cli.streams import IMU, JointsFile, TrackerFile, clock_text, frequencies
from truing.cli.tables import mm, mrad, say, table

if TYPE_CHECKING:
    from truing.files.stream_file import ImuData, JointData, PoseData, SetupData, TrackerData
    from truing.model import Robot
    from truing.tracking.result import Played

UNPLACED = 0.1  # of the tracker's samples: when more are not used, it is said
GRADED_AT = (0.02, 0.04, 0.08)  # [s] horizons at which predictions are graded, besides --horizon
BASELINES = {
    "truing": "truing",
    "hold": "hold",
    "velocity": "tracker velocity",
    "fk": "joints",
    "fk_velocity": "joints' velocity",
}


@dataclass(frozen=True)
class Loaded:
    robot: Robot
    where: SetupData
    imu: ImuData
    tracker: TrackerData
    joints: JointData
    plan: PoseData | None
    truth: PoseData | None


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "Played"]):
    doing = "replaying"
    folder = "truing-track"
    sometimes = ("compensation.csv", "setup.yaml")

    robot: RobotFile
    setup: Annotated[
        Path,
        File(
            "Where sensors are and how clocks differ, as `truing track calibrate` finds it.",
            metavar="SETUP.yaml",
        ),
    ]
    imu: Annotated[Path, File(IMU, metavar="IMU.csv")]
    tracker: TrackerFile
    joints: JointsFile
    plan: Annotated[
        Path | None,
        File(
            "Planned tool in the base frame: t_s, x_m …, qw … Without it nothing is compensated; predictions"
            " are still graded.",
            metavar="PLAN.csv",
        ),
    ] = None
    horizon: Annotated[
        float, Time("A compensation is made this long before the instant it is for.", above=0, most=1.0)
    ] = core("DeviationOptions", "horizon")
    learn_modes: Annotated[
        float,
        Time(
            "Modes of the sway are identified from this much of the recording's start, unless setup.yaml has"
            " some. 0s: never.",
            least=0,
        ),
    ] = 30.0
    truth: Annotated[
        Path | None,
        File("True tool poses of a simulated recording, for the report.", metavar="TRUTH.csv"),
    ] = None
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files.stream_file import load_imu, load_joints, load_plan, load_setup, load_tracker

        robot = load_robot(self.robot, self.base_link, self.tip_link)
        return Loaded(
            robot,
            load_setup(self.setup),
            load_imu(self.imu),
            load_tracker(self.tracker),
            load_joints(self.joints, robot),
            None if self.plan is None else load_plan(self.plan),
            None if self.truth is None else load_plan(self.truth),
        )

    def solve(self, loaded: Loaded, progress: run.Progress) -> Played:
        import numpy as np

        import truing
        from truing.tracking.result import Played

        where, plan = loaded.where, loaded.plan
        streams = truing.recorded_streams(
            loaded.robot, where, imu=loaded.imu, tracker=loaded.tracker, joints=loaded.joints, plan=plan
        )
        options = where.options()
        options.deviation.horizon = self.horizon
        played = truing.replay(
            streams,
            where.setup,
            options,
            horizons=sorted({*GRADED_AT, self.horizon}),
            learn_modes=0.0 if where.modes.count or plan is None else self.learn_modes,
            progress=progress.fraction,
        )
        say_unplaced(loaded.tracker.path, played.counters["pose"])
        tracker_t = where.steady(loaded.tracker.t) - where.setup.clock_offset
        plan_t = np.empty(0) if plan is None else plan.t
        return Played(loaded.robot, where, played, self.horizon, plan_t, tracker_t, loaded.truth)

    def write(self, folder: Path, loaded: Loaded, found: Played, warnings: list[str]) -> Mapping[str, Any]:
        from truing.tracking.result import write_run

        return write_run(folder, found, warnings=warnings)

    def keeps(self, file: Path) -> bool:
        return file == self.setup

    def table(self, result: Mapping[str, Any], found: Played) -> None:
        lines = [
            (f"{1e3 * row['horizon_s']:g} ms", *(mm(row[name]["rms_m"]) for name in BASELINES))
            for row in result["errors"]
        ]
        title = "error of predictions against the tracker's later samples, rms"
        table(title, ("ahead", *BASELINES.values()), lines)
        print_compensation(result)
        if result["clock"]["estimated"]:
            say(clock_text(result["clock"]))
        if result["modes"]["modes"]:
            say(f"modes: {frequencies(result['modes']['modes'])} (from {result['modes']['source']})")
        fractions = [f"{name} {100 * part:.1f} %" for name, part in result["status"].items() if part > 0]
        say("status: " + ", ".join(fractions))
        for shift in result["shifts"]:
            say(jump_text(shift))

    def failure(self, result: Mapping[str, Any]) -> str:
        if self.plan is None or result["made"]:
            return ""
        return (
            "no row of the plan could be compensated: the streams do not reach it, or the tracker was never"
            " there"
        )


def say_unplaced(tracker: Path, counts: Mapping[str, int]) -> None:
    """Says so where stamps of the tracker do not fit the inertial sensor's clock."""
    from truing.errors import InputWarning

    future, late = counts.get("future", 0), counts.get("too_late", 0)
    every = sum(counts.values()) - counts.get("outlier", 0) - counts.get("reacquired", 0)
    if future + late > UNPLACED * every:
        warnings.warn(
            f"{tracker}: {future} of {every} samples have stamps ahead of the inertial sensor's clock, {late}"
            " came too late, and are not used: has the tracker's clock jumped?",
            InputWarning,
            stacklevel=2,
        )


def jump_text(shift: Mapping[str, Any]) -> str:
    """One jump of the tracker, beside the noise it was judged against."""
    cause = shift["cause"].replace("_", " ")
    return (
        f"the tracker jumped by {mm(shift['jump_m'])}, {mrad(shift['jump_rad'])} at {shift['t_s']:.2f} s"
        f" ({cause}), where its noise is {mm(shift['position_noise_m'])},"
        f" {mrad(shift['rotation_noise_rad'])}: calibrate anew"
    )


def print_compensation(result: Mapping[str, Any]) -> None:
    true = result["truth"]
    if true and true["n"]:
        say(
            f"true tool, {1e3 * result['horizon_s']:g} ms ahead: {mm(true['rms_m'])} rms, maximum"
            f" {mm(true['max_m'])}; away from the plan {mm(true['without_compensation']['rms_m'])} rms; NEES"
            f" {true['nees']:.3g} (6 expected)"
        )
    if result["rows"]:
        limited = result["correction"]["limited"]
        words = f", {100 * limited:.0f} % of them limited" if limited > 0.005 else ""
        say(f"{result['made']} of {result['rows']} rows of the plan compensated{words}")
