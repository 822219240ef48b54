# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say what to command to a controller that believes in the nominal robot, so that the real one goes where it
is wanted.

Writes joints.csv and poses.csv (joints and poses to command), result.json, report.html. Exit status 1 if a
target is not reached.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, File, Flag, Threads, TipLink, core
from truing.cli.tables import say, statistics, table
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
from truing.errors import InputError, InputWarning

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from truing.files import TargetData
    from truing.inverse_kinematics import Compensations, Compensator, Task
    from truing.model import Robot

PANEL = "Inverse kinematics"


@dataclass(frozen=True)
class Loaded:
    data: TargetData
    compensator: Compensator
    start: NDArray[Any] | None
    like: Task


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "Compensations"]):
    doing = "compensating"

    nominal: Annotated[
        Path,
        File(
            "Robot file that the controller believes in: robot.yaml or URDF.",
            argument=True,
            metavar="NOMINAL",
        ),
    ]
    calibrated: Annotated[
        Path,
        File(
            "Robot file of the real robot, as `truing identify` or `diagnose` wrote it.",
            argument=True,
            metavar="CALIBRATED",
        ),
    ]
    targets: Annotated[
        Path,
        File(
            "CSV or Parquet: poses as for `truing ik`, or a program of joint positions (q1_rad …).",
            argument=True,
            metavar="TARGETS",
        ),
    ]
    task: TaskOption = None
    free_axis: FreeAxis = None
    seed: SeedJoints = ""
    choose: Choose = core("InverseOptions", "choose")
    target: TargetName = ""
    uncertainty: Annotated[
        Path | None,
        File(
            "result.json of `truing identify`, with covariance.csv beside it: gives the standard error of"
            " what remains.",
            metavar="RESULT",
        ),
    ] = None
    in_base: Annotated[
        bool,
        Flag(
            "Poses are in the robot's own base frame, as controllers have them. Without it: in the"
            " measurement frame."
        ),
    ] = False
    scene: SceneFile = None
    retreat: Retreat = None
    threads: Threads = 0
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.files import load_targets

        like = Wanted(self.task, self.free_axis, self.retreat).like()
        believed, real = self._robots()
        index = target_index(believed, self.target)
        data = load_targets(self.targets, believed, like=like, program=True, in_base=self.in_base)
        if not self.in_base:
            warn_of_other_base(believed, real)
        start = None if data.is_program else seed_joints(self.seed, believed, data)
        if data.is_program and self.seed:
            raise InputError("--seed: a program of joint positions says itself where the robot comes from")
        if data.is_program and self.retreat:
            raise InputError(
                "--retreat: a program of joint positions is given back where it is, or not at all"
            )
        return Loaded(data, self._compensator(believed, real, data, index), start, like)

    def _robots(self) -> tuple[Robot, Robot]:
        from truing.cli.reading import load_robot

        believed = load_robot(self.nominal, self.base_link, self.tip_link)
        # A calibrated robot of convention urdf is written as YAML, which has no links to choose.
        is_urdf = self.calibrated.suffix.lower() in (".urdf", ".xml")
        links = (self.base_link, self.tip_link) if is_urdf else ()
        real = load_robot(self.calibrated, *links)
        if believed.driven_count != real.driven_count:
            raise InputError(
                f"{self.calibrated}: has {real.driven_count} driven joints, but {self.nominal} has"
                f" {believed.driven_count}: these are not the same robot"
            )
        return believed, real

    def _compensator(self, believed: Robot, real: Robot, data: TargetData, index: int) -> Compensator:
        from truing.files import load_uncertainty
        from truing.inverse_kinematics import CompensateOptions, Compensator

        options = CompensateOptions(
            inverse=inverse_options(believed, self.choose, self.scene), in_base=self.in_base
        )
        maker = Compensator(
            believed, real, options, data.conditions[0] if data.conditions else None, target=index
        )
        if self.uncertainty is not None:
            known = load_uncertainty(self.uncertainty)
            try:
                maker.set_uncertainty(known.names, known.values, known.covariance)
            except InputError as error:
                raise InputError(
                    f"{self.uncertainty}: {error}; was this identification made for {self.calibrated}?"
                ) from None
        return maker

    def solve(self, loaded: Loaded, progress: run.Progress) -> Compensations:
        data, count = loaded.data, progress.counting(loaded.data.count)
        conditions = data.conditions or None
        if data.is_program:
            assert data.joints is not None
            kinds = {loaded.like.kind}
            found = loaded.compensator.joints_batch(
                data.joints, conditions, like=loaded.like, threads=self.threads, progress=count
            )
        else:
            kinds = {task.kind for task in data.tasks}
            found = loaded.compensator.pose_batch(
                data.tasks, loaded.start, conditions, threads=self.threads, progress=count
            )
        warn_of_few_joints(loaded.compensator.calibrated.robot, kinds, found.solutions.reached)
        return found

    def write(
        self, folder: Path, loaded: Loaded, found: Compensations, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.files import looks_of
        from truing.inverse_kinematics.result import CompensatedProgram, write_compensation

        program = CompensatedProgram(
            loaded.data, loaded.compensator, found, self.in_base, self.uncertainty is not None
        )
        looks = looks_of(self.nominal, loaded.compensator.nominal.robot, self.base_link)
        return write_compensation(folder, program, looks=looks, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Compensations) -> None:
        print_reasons(
            result, f"{result['calibrated']}: {result['reached']} of {result['targets']} targets reached"
        )
        if result["after"]["mean_m"] is not None:
            lines = [
                ("error if commanded as it is", *statistics(result["before"])),
                ("error by the model, compensated", *statistics(result["after"])),
                ("commands are moved by", *statistics(result["correction"])),
            ]
            if "standard_error" in result:
                remaining = result["standard_error"]["position_m"]
                lines.append(("standard error of what remains", *statistics(remaining)))
            table("compensation", ("", "mean", "95 %", "maximum"), lines)
        others = result["other_configuration"]
        if others:
            which = ", ".join(map(str, others[:12])) + (" …" if len(others) > 12 else "")
            say(
                "joints far from those that the nominal robot would take, so that a controller that is given"
                f" poses may choose others: targets {which}"
            )
        say(f"commands: {self.out / 'joints.csv'}, {self.out / 'poses.csv'}")

    def failure(self, result: Mapping[str, Any]) -> str:
        return not_whole(result)


FAR = 0.05  # [m], and [rad]: no calibration moves a base so far that was known in the measurement frame


def warn_of_other_base(believed: Robot, real: Robot) -> None:
    """Poses are wanted in the measurement frame, of which the controller's robot knows nothing."""
    import numpy as np

    between = np.linalg.inv(believed.T_measurement_base) @ real.T_measurement_base
    away = float(np.linalg.norm(between[:3, 3]))
    turned = float(np.arccos(np.clip((np.trace(between[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    if away > FAR or turned > FAR:
        warnings.warn(
            f"the base of CALIBRATED is {1e3 * away:.4g} mm and {np.degrees(turned):.3g} deg from that of"
            " NOMINAL: targets and commands are in the frame of the measurements; --in-base takes them in"
            " each robot's own base frame, as a controller's program has them",
            InputWarning,
            stacklevel=2,
        )
