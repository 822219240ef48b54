# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find the robot's parameters from measurements.

Writes result.json, report.html, robot.yaml (calibrated), covariance.csv, residuals.csv.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import (
    BaseLink,
    Choice,
    DataFile,
    Effects,
    Flag,
    Fraction,
    Free,
    Length,
    Names,
    ProgramFile,
    RobotFile,
    Seed,
    Threads,
    TipLink,
    core,
)
from truing.cli.reading import robot_and_measurements
from truing.cli.tables import mm, say, table

if TYPE_CHECKING:
    from truing.identification import Identification, Mistake
    from truing.model import Measurements, Robot

    Found = tuple[Identification, Mistake | None]

PANEL = "Calibrate"
FIT = "Fit"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, Measurements]", "Found"]):
    doing = "identifying"

    robot: RobotFile
    data: DataFile
    program: ProgramFile = None
    free: Free = ""
    hold: Annotated[str, Names("Names and globs that stay at nominal: 'base.*,J6.*'.")] = ""
    effects: Effects = ""
    loss: Annotated[
        Literal["reject", "none", "huber", "cauchy", "tukey"],
        Choice("What to do about outliers: find and reject them, or weigh large errors down.", panel=FIT),
    ] = core("IdentifyOptions", "loss")
    solver: Annotated[
        Literal["lm", "ceres"],
        Choice("Levenberg-Marquardt of the palletizer method, or Ceres.", panel=FIT),
    ] = core("IdentifyOptions", "solver")
    frame_by: Annotated[
        Literal["parameters", "svd"],
        Choice("Measurement frame: six more parameters, or registered after every step.", panel=FIT),
    ] = core("IdentifyOptions", "frame_by")
    rotation_length: Annotated[
        float, Length("A rotation error of 1 rad counts as this length.", above=0, panel=FIT)
    ] = core("IdentifyOptions", "rotation_length")
    test_share: Annotated[
        float, Fraction("Fraction of the poses held out, when the data has no `set` column.", panel=FIT)
    ] = core("IdentifyOptions", "test_share")
    large_errors: Annotated[
        bool, Flag("The robot is known to be far from its file: links may change by any amount.")
    ] = False
    seed: Seed = core("IdentifyOptions", "seed")
    threads: Threads = core("IdentifyOptions", "threads")
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, Measurements]:
        return robot_and_measurements(
            self.robot, self.data, self.base_link, self.tip_link, program=self.program
        )

    def solve(self, loaded: tuple[Robot, Measurements], progress: run.Progress) -> Found:
        import truing

        options: dict[str, Any] = {
            "free": self.free,
            "hold": self.hold,
            "effects": self.effects,
            "solver": self.solver,
            "loss": self.loss,
            "frame_by": self.frame_by,
            "rotation_length": self.rotation_length,
            "test_share": self.test_share,
            "seed": self.seed,
            "threads": self.threads,
        }
        found = truing.identify(*loaded, raise_if_not_converged=False, **options)
        return found, truing.review(*loaded, found, **options)

    def write(
        self, folder: Path, loaded: tuple[Robot, Measurements], found: Found, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.identification.result import write_identification

        return write_identification(
            folder,
            found[0],
            loaded[1],
            seed=self.seed,
            source=self.data.name,
            warnings=warnings,
            mistake=found[1],
            nominal_file=self.robot,
            base_link=self.base_link,
            tip_link=self.tip_link,
        )

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        if result["mistake"]:
            say(f"look at the robot file and the columns first: {result['mistake']['text']}")
        table(
            f"{result['robot']}: errors before and after",
            ("", "before", "after"),
            error_lines(result["errors"]),
        )
        solver, frozen = result["solver"], result["frozen"]
        say(
            f"{result['rank']} of {result['columns']} parameters found; {noise_text(result)};"
            f" {len(result['rejected_rows'])} rows rejected; {solver['iterations']} iterations:"
            f" {solver['stopped_because']}"
        )
        if frozen:
            more = f" and {len(frozen) - 8} more" if len(frozen) > 8 else ""
            names = ", ".join(f["parameter"] for f in frozen[:8])
            say(f"not observable with these data, kept at nominal: {names}{more}")

    def failure(self, result: Mapping[str, Any]) -> str:
        solver = result["solver"]
        if not solver["converged"]:
            return f"did not converge: {solver['stopped_because']}"
        if result["mistake"] and not self.large_errors:
            return "the robot file or the columns are to be corrected first (--large-errors: the robot is so)"
        return worse_than_drawn(result["errors"])


def noise_text(result: Mapping[str, Any]) -> str:
    """What the model leaves, and what of it is noise, of one component (1 sigma)."""
    left, repeats = result["noise_sigma_m"], result["noise_from_repeats_m"]
    if repeats is None:
        return f"noise and what no parameter explains {mm(left)} (1 sigma)"
    return f"noise of repeats {mm(repeats)} (1 sigma); with structure not explained {mm(left)}"


def worse_than_drawn(errors: Mapping[str, Any]) -> str:
    """Why the robot as found is not to be used: it predicts held-out poses worse than the robot as drawn."""
    if "test" not in errors:
        return ""
    before, after = errors["test"]["before"], errors["test"]["after"]
    if after["rms_m"] <= before["rms_m"] or after["median_m"] <= before["median_m"]:
        return ""
    return (
        f"held-out poses are predicted worse than by the robot as drawn: {mm(after['rms_m'])} rms against"
        f" {mm(before['rms_m'])}"
    )


def error_lines(errors: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Mean, 95 % and maximum of the held-out poses, or of the fitted ones if none are held out."""
    every = (("mean_m", "mean"), ("p95_m", "95 %"), ("max_m", "maximum"))
    held_out = "test" in errors
    lines = []
    for name, label in (("test", "held out"), ("train", "fitted")):
        if name in errors:
            e = errors[name]
            shown = every if name == "test" or not held_out else every[:1]
            lines += [(f"{label}, {what}", mm(e["before"][key]), mm(e["after"][key])) for key, what in shown]
    return lines
