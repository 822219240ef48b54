# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say how accurate and repeatable a robot is, after ISO 9283, each number with its 95 % interval.

Several files stand side by side, nominal, calibrated and compensated, say. Writes result.json and
report.html, whose first part prints on one page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import Angle, BaseLink, File, Flag, Kind, Length, Mass, Seed, Speed, TipLink, Words
from truing.cli.tables import say_first, table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.files import CommandedPoses, MeasuredPoses
    from truing.model import Robot
    from truing.performance import Assessment

CONDITIONS = "Of the test"


@dataclass(frozen=True)
class Loaded:
    measured: dict[str, MeasuredPoses]
    commanded: CommandedPoses | None
    robot: Robot | None


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "dict[str, Assessment]"]):
    doing = "drawing samples"

    measured: Annotated[
        list[Path],
        File(
            "Measurements, one file each: the sheet that `truing performance plan` wrote, filled in.",
            argument=True,
            metavar="MEASURED",
            several=True,
        ),
    ]
    commanded: Annotated[
        Path | None,
        File("Commanded poses: pose, x_m …. Without them accuracies are not found.", metavar="POSES.csv"),
    ] = None
    labels: Annotated[
        list[str], Words("What the files are called: nominal,calibrated,compensated. Default: their names.")
    ] = ()  # type: ignore[assignment]
    align: Annotated[
        bool, Flag("Fit the instrument's frame to the commanded poses: measurements are not in the base.")
    ] = False
    robot: Annotated[
        Path | None,
        File(
            "Robot file: say what of a warm-up's drift its thermal effects would compensate.", metavar="ROBOT"
        ),
    ] = None
    instrument: Annotated[str, Kind("What it was measured with.", panel=CONDITIONS)] = ""
    instrument_uncertainty: Annotated[
        float | None,
        Length("Its expanded uncertainty (k = 2) of a position.", above=0, panel=CONDITIONS),
    ] = None
    angle_uncertainty: Annotated[
        float | None, Angle("The same of an orientation.", above=0, panel=CONDITIONS)
    ] = None
    rated_load: Annotated[float | None, Mass("The robot's rated load.", above=0, panel=CONDITIONS)] = None
    rated_speed: Annotated[float | None, Speed("The robot's rated speed.", above=0, panel=CONDITIONS)] = None
    measured_point: Annotated[
        str, Kind("Where the target sat: 'reflector, 120 mm from the flange'.", panel=CONDITIONS)
    ] = ""
    seed: Seed = 0
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files import load_commanded, load_measured

        labels = self.labels or [path.stem for path in self.measured]
        if len(labels) != len(self.measured):
            raise InputError(
                f"--labels: found {len(labels)} labels, expected one for each of {len(self.measured)} files"
            )
        if len(set(labels)) < len(labels):
            raise InputError(
                f"--labels: found {', '.join(labels)}, expected a label for each file of its own"
            )
        return Loaded(
            {label: load_measured(path) for label, path in zip(labels, self.measured, strict=True)},
            None if self.commanded is None else load_commanded(self.commanded),
            None if self.robot is None else load_robot(self.robot, self.base_link, self.tip_link),
        )

    def solve(self, loaded: Loaded, progress: run.Progress) -> dict[str, Assessment]:
        from truing.performance import assess

        found = {}
        for number, (label, measured) in enumerate(loaded.measured.items()):
            progress.of(number, len(loaded.measured))
            found[label] = assess(
                measured, loaded.commanded, align=self.align, robot=loaded.robot, seed=self.seed
            )
        return found

    def write(
        self, folder: Path, loaded: Loaded, found: dict[str, Assessment], warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.performance.result import ReportNotes, write_performance

        notes = ReportNotes(
            robot="" if loaded.robot is None else loaded.robot.name,
            instrument=self.instrument,
            length_uncertainty=self.instrument_uncertainty,
            angle_uncertainty=self.angle_uncertainty,
            rated_load=self.rated_load,
            rated_speed=self.rated_speed,
            measured_point=self.measured_point,
        )
        files = {label: one.file for label, one in loaded.measured.items()}
        return write_performance(
            folder, found, files, notes, commanded=self.commanded, seed=self.seed, warnings=warnings
        )

    def table(self, result: Mapping[str, Any], found: dict[str, Assessment]) -> None:
        print_quantities(result)
        lines = [f"{one['quantity']} at {one['at']}: {one['why']}" for one in result["not_found"]]
        say_first(list(dict.fromkeys(lines)), 6, "more that were not found: see the report")


def print_quantities(result: Mapping[str, Any]) -> None:
    """A table for every load and speed."""
    from truing.performance.page import (
        condition_of,
        condition_text,
        conditions_of,
        fixed_text,
        interval_text,
        short_rows,
    )

    labels = [column["label"] for column in result["columns"]]
    head = ["", "at", *(word for label in labels for word in (label, "95 %"))]
    for condition in conditions_of(result["quantities"]):
        lines = []
        for row in short_rows([row for row in result["quantities"] if condition_of(row) == condition]):
            cells = []
            for label in labels:
                value = row["values"].get(label)
                mark = " †" if value and value["at_floor"] else ""
                cells += (
                    [fixed_text(value["value"], row["unit"]).replace("\u202f", " ") + mark]
                    + [interval_text(value["ci"])]
                    if value
                    else ["-", ""]
                )
            lines.append([row["quantity"].replace("_", " "), row["at"], *cells])
        table(condition_text(condition, result), head, lines)
    if any(value["at_floor"] for row in result["quantities"] for value in row["values"].values()):
        from truing.cli.tables import say

        say("† at the instrument's floor: its uncertainty is more than a quarter of the value")
