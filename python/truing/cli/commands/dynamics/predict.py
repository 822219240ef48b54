# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Compute the torques of a recording, row by row: links, rotors, and the effects that the robot carries.

Writes predicted.csv (t_s and the columns that were measured, under their names; one row per row),
result.json, report.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, File, Frequency, TipLink, keyword
from truing.cli.recordings import (
    Joints,
    KnownPayload,
    RobotWithMasses,
    Topic,
    TorquePerAmpere,
    Units,
    robot_and_recordings,
)
from truing.cli.tables import table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.dynamics import Recording, TorquePrediction
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, Recording]", "TorquePrediction"]):
    doing = "predicting"

    robot: RobotWithMasses
    recording: Annotated[
        Path,
        File("One recording of motion, with torques or without.", argument=True, metavar="REC"),
    ]
    cutoff: Annotated[
        float,
        Frequency("Of the low-pass that the angles go through for their derivatives.", above=0),
    ] = keyword("truing.dynamics.api:predict", "cutoff")
    joints: Joints = ""
    torque_per_ampere: TorquePerAmpere = None
    payload: KnownPayload = None
    topic: Topic = ""
    units: Units = None
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, Recording]:
        robot, recordings = robot_and_recordings(
            self.robot,
            [self.recording],
            base_link=self.base_link,
            tip_link=self.tip_link,
            joints=self.joints,
            topic=self.topic,
            units=self.units,
            torque_per_ampere=self.torque_per_ampere,
            payload=self.payload,
        )
        if len(recordings) != 1:
            raise InputError(
                f"{self.recording}: holds {len(recordings)} recordings, expected one: predict them one by one"
            )
        return robot, recordings[0]

    def solve(self, loaded: tuple[Robot, Recording], progress: run.Progress) -> TorquePrediction:
        from truing.dynamics import predict

        return predict(*loaded, cutoff=self.cutoff)

    def write(
        self, folder: Path, loaded: tuple[Robot, Recording], found: TorquePrediction, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_prediction

        return write_prediction(folder, *loaded, found, cutoff=self.cutoff, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: TorquePrediction) -> None:
        lines = [
            (joint, f"{e['rms']:.4g} {e['unit']}", "-" if e["percent"] is None else f"{e['percent']:.1f} %")
            for joint, e in result["errors"].items()
        ]
        if lines:
            head = ("", "rms error", "of the torque")
            table(f"{result['robot']}: prediction against {result['recording']}", head, lines)
        else:
            table(f"{result['robot']}: prediction", ("", ""), [("rows predicted", str(result["rows"]))])
