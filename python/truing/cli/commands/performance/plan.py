# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Plan a performance test after ISO 9283: cube, poses, paths, the order of the cycles, and programs.

Writes poses.csv (commanded, in the robot's base), joints.csv, sheet.csv (to be filled in with what was
measured), programs of five makers in a folder each, result.json, report.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import (
    BaseLink,
    Count,
    Length,
    Numbers,
    Parts,
    RobotFile,
    Speed,
    Time,
    TipLink,
)
from truing.cli.tables import mm, say, table

if TYPE_CHECKING:
    from truing.model import Robot
    from truing.performance.plan import PerformancePlan

CUBE = "Cube"
PROGRAMS = "Programs"
_LENGTHS = (Length(), Length(), Length())


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Robot", "PerformancePlan"]):
    doing = "looking for the cube"

    robot: RobotFile
    edge: Annotated[
        float | None, Length("Edge of the cube. Default: the largest that is reached.", above=0, panel=CUBE)
    ] = None
    centre: Annotated[
        tuple[float, float, float] | None,
        Parts(
            "Its centre in the robot's base. Default: where it is largest.",
            _LENGTHS,
            "three lengths, such as 800mm,0mm,900mm",
            metavar="X,Y,Z",
            panel=CUBE,
        ),
    ] = None
    cycles: Annotated[int, Count("Cycles of poses and approaches.", least=3)] = 30
    path_cycles: Annotated[int, Count("Cycles of paths.", least=3)] = 10
    path_points: Annotated[int, Count("Points at which a path is judged.", least=5, most=1001)] = 21
    speeds: Annotated[
        list[float], Numbers("Speeds to test at, in percent of the rated one. Default: 100,50,10.")
    ] = ()  # type: ignore[assignment]
    warm_up_blocks: Annotated[
        int, Count("Blocks of ten cycles over the eight hours of a warm-up.", least=2)
    ] = 24
    rated_speed: Annotated[float, Speed("On lines and circles at 100 %.", above=0, panel=PROGRAMS)] = 1.0
    dwell: Annotated[float, Time("Stop at every measured pose.", least=0, panel=PROGRAMS)] = 3.0
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Robot:
        from truing.cli.reading import load_robot

        return load_robot(self.robot, self.base_link, self.tip_link)

    def solve(self, loaded: Robot, progress: run.Progress) -> PerformancePlan:
        from truing.performance.plan import SPEEDS, PlanOptions, plan_test

        options = PlanOptions(
            cycles=self.cycles,
            path_cycles=self.path_cycles,
            path_points=self.path_points,
            speeds=tuple(self.speeds) or SPEEDS,
            edge=self.edge,
            centre=self.centre,
            warm_up_blocks=self.warm_up_blocks,
        )
        return plan_test(loaded, options)

    def write(
        self, folder: Path, loaded: Robot, found: PerformancePlan, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.performance.drive import DriveOptions
        from truing.performance.result import write_performance_plan

        drive = DriveOptions(dwell=self.dwell, rated_speed=self.rated_speed)
        return write_performance_plan(folder, loaded, found, drive, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: PerformancePlan) -> None:
        cube = result["cube"]
        lines = [
            ("cube", f"edge {mm(cube['edge_m'])}, centre {', '.join(mm(c) for c in cube['centre_m'])}"),
            ("commanded", f"{result['poses']} poses, {len(result['paths'])} paths"),
            ("to be measured", f"{result['sheet_rows']} rows of sheet.csv"),
            ("programs", ", ".join(result["programs"]) or "none"),
        ]
        table(f"{result['robot']}: performance test", ("", ""), lines, words=True)
        say(f"to be filled in: {self.out / 'sheet.csv'}")
