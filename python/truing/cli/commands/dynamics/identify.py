# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fit inertias and the effects asked for to recorded torques.

Writes result.json, report.html, robot.yaml (with what was fitted), covariance.csv (standard errors),
residuals.parquet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, Flag, Names, Threads, TipLink, core
from truing.cli.recordings import (
    CutOff,
    Joints,
    KnownPayload,
    RecordingFiles,
    RobotWithMasses,
    TestShare,
    Topic,
    TorquePerAmpere,
    Units,
    print_errors,
    require_torques,
    robot_and_recordings,
)
from truing.cli.tables import say

if TYPE_CHECKING:
    from truing.dynamics import Recording, TorqueFit
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, list[Recording]]", "TorqueFit"]):
    doing = "identifying"

    robot: RobotWithMasses
    recordings: RecordingFiles
    effects: Annotated[
        str,
        Names(
            "Effects to fit: 'coulomb,viscous,load_friction:J2+J3'. Default: armature, Coulomb and viscous"
            " friction, an offset at every joint."
        ),
    ] = ""
    keep_inertias: Annotated[bool, Flag("Masses and inertias of the links stay as they are.")] = False
    cutoff: CutOff = None
    test_share: TestShare = core("TorqueOptions", "test_share")
    threads: Threads = core("TorqueOptions", "threads")
    joints: Joints = ""
    torque_per_ampere: TorquePerAmpere = None
    payload: KnownPayload = None
    topic: Topic = ""
    units: Units = None
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, list[Recording]]:
        loaded = robot_and_recordings(
            self.robot,
            self.recordings,
            base_link=self.base_link,
            tip_link=self.tip_link,
            joints=self.joints,
            topic=self.topic,
            units=self.units,
            torque_per_ampere=self.torque_per_ampere,
            payload=self.payload,
        )
        require_torques(loaded[1])
        return loaded

    def solve(self, loaded: tuple[Robot, list[Recording]], progress: run.Progress) -> TorqueFit:
        from truing.dynamics import identify

        options: dict[str, Any] = {
            "effects": self.effects,
            "fit_inertials": not self.keep_inertias,
            "test_share": self.test_share,
            "threads": self.threads,
        }
        if self.cutoff is not None:
            options["cutoff"] = self.cutoff
        return identify(*loaded, **options)

    def write(
        self, folder: Path, loaded: tuple[Robot, list[Recording]], found: TorqueFit, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_fit

        return write_fit(folder, found, loaded[1], warnings=warnings, nominal_file=self.robot)

    def table(self, result: Mapping[str, Any], found: TorqueFit) -> None:
        models = (("nominal", "nominal"), ("standard", "standard"), ("named", "fitted"))
        print_errors(result, models)
        say(f"{len(result['parameters'])} parameters fitted; low-pass at {result['cutoff_hz']:.3g} Hz")
