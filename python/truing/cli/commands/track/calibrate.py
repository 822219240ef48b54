# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find the frames of tracker, receiver, inertial sensor and tool, gravity, and the clocks, from a recording.

The arm goes from one test position to the next and stands still at each for three seconds or more. Writes
result.json, report.html, setup.yaml.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, File, RobotFile, Time, TipLink, keyword
from truing.cli.streams import IMU, JointsFile, TrackerFile, clock_text, frequencies
from truing.cli.tables import AXES, mm, mrad, say, table

if TYPE_CHECKING:
    from truing.files.stream_file import ImuData, JointData, PoseData, ToolPoses, TrackerData
    from truing.model import Robot
    from truing.tracking.api import TrackCalibration


@dataclass(frozen=True)
class Loaded:
    robot: Robot
    joints: JointData
    tracker: TrackerData
    imu: ImuData | None
    plan: PoseData | None
    tool: ToolPoses | None


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "TrackCalibration"]):
    doing = "calibrating"
    sometimes = ("setup.yaml",)

    robot: RobotFile
    joints: JointsFile
    tracker: TrackerFile
    imu: Annotated[Path | None, File(f"{IMU} `track run` needs it.", metavar="IMU.csv")] = None
    plan: Annotated[
        Path | None,
        File(
            "Planned tool in the base frame: gives the actuators' lag and the modes of the sway.",
            metavar="PLAN.csv",
        ),
    ] = None
    tool: Annotated[
        Path | None,
        File(
            "Joints at prescribed poses of the tool: q1_rad …, kind (pivot, orientation), qw … Default: the"
            " robot file's tool.",
            metavar="TOOL.csv",
        ),
    ] = None
    clock_wanted: Annotated[
        float,
        Time("Standard error of the clock offset that is wanted. If it is larger, advice is given.", above=0),
    ] = keyword("truing.tracking.api:track_calibrate", "clock_wanted")
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files.stream_file import load_imu, load_joints, load_plan, load_tool_poses, load_tracker

        robot = load_robot(self.robot, self.base_link, self.tip_link)
        return Loaded(
            robot,
            load_joints(self.joints, robot),
            load_tracker(self.tracker),
            None if self.imu is None else load_imu(self.imu),
            None if self.plan is None else load_plan(self.plan),
            None if self.tool is None else load_tool_poses(self.tool, robot),
        )

    def solve(self, loaded: Loaded, progress: run.Progress) -> TrackCalibration:
        import truing

        return truing.track_calibrate(
            loaded.robot,
            loaded.joints,
            loaded.tracker,
            loaded.imu,
            plan=loaded.plan,
            tool=loaded.tool,
            clock_wanted=self.clock_wanted,
        )

    def write(
        self, folder: Path, loaded: Loaded, found: TrackCalibration, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.tracking.result import write_calibration

        return write_calibration(folder, loaded.robot, found, source=self.tracker.name, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: TrackCalibration) -> None:
        if result["frames"]:
            print_frames(result["frames"])
            print_positions(result["positions"])
            if "offset_s" in result["clock"]:
                say(f"{clock_text(result['clock'])}. {result['clock']['advice']}".strip())
            if result["actuator_lag_s"] is not None:
                say(f"actuators: {1e3 * result['actuator_lag_s']:.1f} ms behind the plan")
            if result["modes"] and result["modes"]["modes"]:
                say(f"modes: {frequencies(result['modes']['modes'])}")
        for note in result["notes"]:
            say(f"note: {note}")

    def failure(self, result: Mapping[str, Any]) -> str:
        return "" if result["status"] == "done" else f"{result['status']}: {result['message']}"


def print_frames(frames: Mapping[str, Any]) -> None:
    lines = []
    for name, frame in frames.items():
        sigma = frame["sigma"]
        cells = []
        for axis in AXES:
            error = "" if sigma is None else f" +- {1e3 * sigma[f'{axis}_m']:.2g}"
            cells.append(f"{1e3 * frame[f'{axis}_m']:.2f} mm{error}")
        lines.append((name, *cells))
    table("frames", ("", *AXES), lines)


def print_positions(positions: Mapping[str, Any]) -> None:
    what = "test positions" if positions["source"] == "standstills" else "poses of the motion"
    say(
        f"{len(positions['errors'])} {what}: standard deviation {mm(positions['position_sigma_m'])},"
        f" {mrad(positions['rotation_sigma_rad'])} per component"
    )
