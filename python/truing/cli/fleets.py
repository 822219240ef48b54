# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the commands of `truing fleet` share: options, and the workers that they run on."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from truing.cli import run
from truing.cli.options import (
    BaseLink,
    Choice,
    Count,
    File,
    Flag,
    Fraction,
    Kind,
    RobotFile,
    Seed,
    TipLink,
)
from truing.cli.run import Found
from truing.cli.tables import mm, say
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.model import Robot

WORKERS = "Workers"

SourceFiles = Annotated[
    list[Path],
    File(
        "Measurements of the arms: CSV or Parquet files, or a folder of them. A row's arm is named by its"
        " column arm, its folder arm=NAME, or its file.",
        argument=True,
        metavar="SOURCE",
        several=True,
    ),
]


RecordingFiles = Annotated[
    list[Path],
    File(
        "Recordings of motion and torque of the arms: CSV or Parquet files, or a folder of them. A file's arm"
        " is named by its folder arm=NAME, or is the file's own name.",
        argument=True,
        metavar="SOURCE",
        several=True,
    ),
]


@dataclass(frozen=True, kw_only=True)
class FleetWork(run.Command["Robot", Found]):
    """A command whose work is done by workers."""

    own_processes = True
    torques: ClassVar[bool] = False
    """Whether the robot's effects on torques count, not those on its poses."""

    robot: RobotFile
    scheduler: Annotated[
        str,
        Kind(
            "Address of a Dask scheduler, tcp://HOST:8786, whose workers have truing and see the files."
            " Default: workers of this machine.",
            metavar="ADDRESS",
            panel=WORKERS,
        ),
    ] = ""
    workers: Annotated[
        int | None,
        Count(
            "Worker processes on this machine; 0: none, all in this process. Default: one a processor.",
            most=1024,
            panel=WORKERS,
        ),
    ] = None
    one_arm: Annotated[bool, Flag("All files are parts of one recording of one arm.")] = False
    skip_corrupt: Annotated[
        bool, Flag("Pass over files and row groups that cannot be read; the result names them.")
    ] = False
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Robot:
        from truing.cli.reading import load_robot

        if self.scheduler and self.workers is not None:
            raise InputError(
                "--scheduler and --workers: found both, expected one: a scheduler has workers of its own"
            )
        return load_robot(self.robot, self.base_link, self.tip_link, torques=self.torques)

    @contextlib.contextmanager
    def client(self) -> Iterator[Any]:
        """Of the scheduler that was named; None: workers of this machine."""
        from truing.fleet import client_at

        if not self.scheduler:
            yield None
            return
        with client_at(self.scheduler) as client:
            yield client

    def failure(self, result: Mapping[str, Any]) -> str:
        solver = result["solver"]
        return "" if solver["converged"] else f"did not converge: {solver['stopped_because']}"


@dataclass(frozen=True, kw_only=True)
class FleetCommand(FleetWork[Found]):
    """A command that reads a fleet's measurements."""

    source: SourceFiles
    loss: Annotated[
        Literal["reject", "none"],
        Choice("What to do about outliers: leave them out, arm by arm, or nothing."),
    ] = "reject"
    test_share: Annotated[
        float, Fraction("Fraction of the poses held out, when the data has no `set` column.")
    ] = 0.2
    seed: Seed = 0

    def options(self, progress: run.Progress) -> dict[str, Any]:
        """Keywords that the verbs of a fleet have in common."""
        return {
            "one_arm": self.one_arm,
            "skip_corrupt": self.skip_corrupt,
            "loss": self.loss,
            "test_share": self.test_share,
            "seed": self.seed,
            "workers": self.workers,
            "tell": progress.now,
        }


def say_errors(result: Mapping[str, Any]) -> None:
    """Rows, passes, and the error of all arms before and after."""
    held_out = "test" in result["errors"]
    errors = result["errors"]["test" if held_out else "train"]
    say(
        f"{len(result['arms'])} arms, {result['rows']} rows, {result['partitions']} partitions read"
        f" {result['solver']['passes']} times"
    )
    say(
        f"rms error of the {'held-out' if held_out else 'fitted'} poses:"
        f" {mm(errors['before']['rms_m'])} before, {mm(errors['after']['rms_m'])} after"
    )
