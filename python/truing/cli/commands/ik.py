# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find the joints that bring the robot, nominal or calibrated, to each target; or say why there are none.

Writes joints.csv, result.json, report.html. Exit status 1 if a target is not reached, or the path has a gap.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import Angle, BaseLink, File, Flag, Length, RobotFile, Threads, TipLink, core
from truing.cli.tables import mm, say, say_first
from truing.cli.targets import (
    Choose,
    FreeAxis,
    Retreat,
    SceneFile,
    SeedJoints,
    TargetName,
    TaskOption,
    Wanted,
    inverse_options,
    not_whole,
    print_reasons,
    seed_joints,
    target_index,
    warn_of_few_joints,
)
from truing.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from truing.files import TargetData
    from truing.inverse_kinematics import InverseSolver, Solution
    from truing.inverse_kinematics.result import Solved

PANEL = "Inverse kinematics"
PATH = "Path"


@dataclass(frozen=True)
class Loaded:
    data: TargetData
    solver: InverseSolver
    start: NDArray[Any] | None


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "Solved"]):
    doing = "solving"

    robot: RobotFile
    targets: Annotated[
        Path,
        File(
            "CSV or Parquet, one row per target: x_m y_m z_m qw qx qy qz, and optional columns;"
            " or a robot program (.src .mod .ls .script .jbi).",
            argument=True,
            metavar="TARGETS",
        ),
    ]
    task: TaskOption = None
    free_axis: FreeAxis = None
    seed: SeedJoints = ""
    choose: Choose = core("InverseOptions", "choose")
    all_branches: Annotated[bool, Flag("Every configuration that reaches a full pose, a row each.")] = False
    target: TargetName = ""
    path: Annotated[
        bool, Flag("The targets are a path: joints in steps as short as possible.", panel=PATH)
    ] = False
    longest_turn: Annotated[
        float,
        Angle(
            "With --path: a larger step of a revolute joint between neighbouring targets is a gap.",
            above=0,
            panel=PATH,
        ),
    ] = core("PathOptions", "longest_turn")
    longest_slide: Annotated[
        float, Length("With --path: the same of a prismatic joint.", above=0, panel=PATH)
    ] = core("PathOptions", "longest_slide")
    scene: SceneFile = None
    retreat: Retreat = None
    threads: Threads = 0
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files import load_targets
        from truing.inverse_kinematics import InverseSolver

        if self.path and self.all_branches:
            raise InputError(
                "--path and --all-branches: a path takes one configuration at every target; choose one of"
                " the two"
            )
        like = Wanted(self.task, self.free_axis, self.retreat).like()
        if self.all_branches and like.kind != "pose":
            raise InputError(
                f"--all-branches: is for full poses; a {like.kind} leaves something free, and has infinitely"
                " many solutions"
            )
        robot = load_robot(self.robot, self.base_link, self.tip_link)
        index = target_index(robot, self.target)
        data = load_targets(self.targets, robot, like=like)
        if self.all_branches and any(one.kind != "pose" for one in data.tasks):
            raise InputError(
                f"{self.targets}: --all-branches is for full poses, but its column task holds others"
            )
        start = seed_joints(self.seed, robot, data)
        if self.path:
            data.path_conditions()  # what no path can have is refused before anything is computed
        options = inverse_options(robot, self.choose, self.scene)
        first = data.conditions[0] if data.conditions else None
        return Loaded(data, InverseSolver(robot, options, first, target=index), start)

    def solve(self, loaded: Loaded, progress: run.Progress) -> Solved:
        import numpy as np

        from truing.inverse_kinematics.result import Solved

        if self.path:
            return self._path(loaded, progress)
        if self.all_branches:
            return every_branch(loaded, progress)
        data, solver = loaded.data, loaded.solver
        found = solver.solve_batch(
            data.tasks,
            loaded.start,
            data.conditions or None,
            threads=self.threads,
            progress=progress.counting(data.count),
        )
        warn_of_few_joints(solver.robot, {task.kind for task in data.tasks}, found.reached)
        return Solved(data, solver, list(found), np.arange(data.count))

    def _path(self, loaded: Loaded, progress: run.Progress) -> Solved:
        import numpy as np

        from truing.inverse_kinematics import PathOptions
        from truing.inverse_kinematics.result import Solved

        data, solver, start = loaded.data, loaded.solver, loaded.start
        steps = PathOptions(longest_turn=self.longest_turn, longest_slide=self.longest_slide)
        first = start if start is None or start.ndim == 1 else start[0]
        found = solver.path(
            data.tasks, first, steps, data.path_conditions(), progress=progress.counting(data.count)
        )
        return Solved(data, solver, list(found.solutions), np.arange(data.count), path=found, steps=steps)

    def write(self, folder: Path, loaded: Loaded, found: Solved, warnings: list[str]) -> Mapping[str, Any]:
        from truing.files import looks_of
        from truing.inverse_kinematics.result import write_inverse

        looks = looks_of(self.robot, found.solver.robot, self.base_link)
        return write_inverse(folder, found, looks=looks, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Solved) -> None:
        print_reasons(
            result, f"{result['robot']}: {result['reached']} of {result['targets']} targets reached"
        )
        if "branches" in result:
            say(f"{result['branches']['rows']} solutions in all")
        largest = result["worst"]
        if largest["position_m"] is not None:
            say(
                f"largest error of a target that is reached: {largest['position_m']:.2g} m,"
                f" {largest['rotation_rad']:.2g} rad"
            )
        if result.get("path") is not None:
            print_path(result["path"], slides=any(joint["unit"] == "m" for joint in result["joints"]))
        say(f"joints: {self.out / 'joints.csv'}")

    def failure(self, result: Mapping[str, Any]) -> str:
        return not_whole(result)


def every_branch(loaded: Loaded, progress: run.Progress) -> Solved:
    """All configurations of every target; of a target without any, why."""
    import numpy as np

    from truing.inverse_kinematics.result import Solved

    data, solver, start = loaded.data, loaded.solver, loaded.start
    solutions: list[Solution] = []
    owners: list[int] = []
    for k, task in enumerate(data.tasks):
        seed = start if start is None or start.ndim == 1 else start[k]
        conditions = data.conditions[k] if data.conditions else None
        found = solver.branches(task, seed, conditions).solutions or (solver.solve(task, seed, conditions),)
        solutions.extend(found)
        owners.extend([k] * len(found))
        progress.of(k + 1, data.count)
    return Solved(data, solver, solutions, np.array(owners, dtype=np.intp), all_branches=True)


def print_path(path: Mapping[str, Any], *, slides: bool) -> None:
    turn = f"{math.degrees(path['longest_turn_rad']):.4g} deg"
    slide = f", {mm(path['longest_slide_m'])}" if slides else ""
    say(f"longest step: {turn}{slide}" + ("" if path["gaps"] else "; the path is continuous"))
    lines = []
    for gap in path["gaps"]:
        step = f"{math.degrees(gap['step_rad']):.4g} deg" if "step_rad" in gap else mm(gap.get("step_m"))
        size = f": {gap['joint']} would step {step}" if "step_rad" in gap or "step_m" in gap else ""
        lines.append(f"no continuous path from target {gap['from']} to {gap['to']}{size}")
    say_first(lines, 8, "more gaps: see the report")
    lines = [
        f"collision from target {one['from']} to {one['to']}: {one['first']} and {one['second']},"
        f" {mm(one['distance_m'])} apart"
        for one in path.get("collisions", ())
    ]
    say_first(lines, 8, "more collisions: see result.json")
