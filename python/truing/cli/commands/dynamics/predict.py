# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Compute the torques of a recording, row by row: links, rotors, and the effects that the robot carries.

With --simulate also the motion that its torques make of the robot in MuJoCo. Writes predicted.csv (t_s and
the columns that were measured, under their names; one row per row), result.json, report.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import File, Frequency, Time
from truing.cli.recordings import MotionCommand
from truing.cli.tables import table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.dynamics import Recording, TorquePrediction
    from truing.dynamics.simulate import Response
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True)
class Found:
    """Torques, and with --simulate the motion."""

    torques: TorquePrediction
    response: Response | None


@dataclass(frozen=True, kw_only=True)
class Command(MotionCommand["tuple[Robot, Recording]", Found]):
    doing = "predicting"

    recording: Annotated[
        Path,
        File("One recording of motion, with torques or without.", argument=True, metavar="REC"),
    ]
    cutoff: Annotated[
        float | None,
        Frequency(
            "Of the low-pass that the angles go through for their derivatives. Default: that of the robot's"
            " effects, or 8 Hz.",
            above=0,
        ),
    ] = None
    simulate: Annotated[
        float | None,
        Time(
            "Also simulates the motion that the recorded torques make (MuJoCo), begun anew at the measured"
            " state after every HORIZON.",
            metavar="HORIZON",
            above=0,
        ),
    ] = None

    def load(self, progress: run.Progress) -> tuple[Robot, Recording]:
        robot, recordings = self.read([self.recording])
        if len(recordings) != 1:
            raise InputError(
                f"{self.recording}: holds {len(recordings)} recordings, expected one: predict them one by one"
            )
        return robot, recordings[0]

    def solve(self, loaded: tuple[Robot, Recording], progress: run.Progress) -> Found:
        from truing.dynamics import predict

        torques = predict(*loaded, cutoff=self.cutoff)
        if self.simulate is None:
            return Found(torques, None)
        from truing.dynamics.runner import simulator_of
        from truing.dynamics.simulate import simulated_response

        progress.now("simulating")
        robot, recording = loaded
        return Found(torques, simulated_response(simulator_of(self.robot, robot), recording, self.simulate))

    def write(
        self, folder: Path, loaded: tuple[Robot, Recording], found: Found, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_prediction
        from truing.dynamics.sanity.untold import untold_load

        load = untold_load(*loaded)
        return write_prediction(
            folder,
            *loaded,
            found.torques,
            found.response,
            warnings=[*warnings, *([load] if load else [])],
        )

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        lines = [
            (joint, f"{e['rms']:.4g} {e['unit']}", "-" if e["percent"] is None else f"{e['percent']:.1f} %")
            for joint, e in result["errors"].items()
        ]
        if lines:
            head = ("", "rms error", "of the torque")
            table(f"{result['robot']}: prediction against {result['recording']}", head, lines)
        else:
            table(f"{result['robot']}: prediction", ("", ""), [("rows predicted", str(result["rows"]))])
        motion = result["simulated"]
        if motion is not None:
            from truing.dynamics.rollout.page import error_text

            lines = [
                (joint, error_text(e["rms"], e["unit"]), error_text(e["end_rms"], e["unit"]))
                for joint, e in motion["errors"].items()
            ]
            title = f"motion in {motion['windows']} windows of {motion['horizon_s']:g} s, less measured"
            table(title, ("", "rms", "rms at their ends"), lines)
