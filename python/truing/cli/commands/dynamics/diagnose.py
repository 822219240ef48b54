# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Name the effects that the model lacks: friction laws, rotor inertia, payload, couplings …

Inertias, Coulomb and viscous friction and an offset are fitted in any case; what is named comes on top, and
is judged on recordings that nothing was fitted to. Writes result.json, report.html, robot.yaml (with what was
named), residuals.parquet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, Names, Threads, TipLink, core
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
from truing.cli.tables import joined, say, table

if TYPE_CHECKING:
    from truing.dynamics import Recording, TorqueDiagnosis
    from truing.model import Robot

PANEL = "Dynamics"
LISTED = 12  # causes on the terminal; the report has all


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, list[Recording]]", "TorqueDiagnosis"]):
    doing = "diagnosing"

    robot: RobotWithMasses
    recordings: RecordingFiles
    leave_out: Annotated[str, Names("Effects that are not to be considered: 'coupling,ripple'.")] = ""
    cutoff: CutOff = None
    test_share: TestShare = core("TorqueDiagnoseOptions", "test_share")
    threads: Threads = core("TorqueDiagnoseOptions", "threads")
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

    def solve(self, loaded: tuple[Robot, list[Recording]], progress: run.Progress) -> TorqueDiagnosis:
        from truing.dynamics import diagnose

        options: dict[str, Any] = {
            "leave_out": self.leave_out,
            "test_share": self.test_share,
            "threads": self.threads,
        }
        if self.cutoff is not None:
            options["cutoff"] = self.cutoff
        return diagnose(*loaded, **options)

    def write(
        self,
        folder: Path,
        loaded: tuple[Robot, list[Recording]],
        found: TorqueDiagnosis,
        warnings: list[str],
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_diagnosis

        return write_diagnosis(folder, found, loaded[1], warnings=warnings, nominal_file=self.robot)

    def failure(self, result: Mapping[str, Any]) -> str:
        if result["verdict"] != "does_not_hold":
            return ""
        return "what was found does not hold on recordings that it was not fitted to"

    def table(self, result: Mapping[str, Any], found: TorqueDiagnosis) -> None:
        print_diagnosis(result)


def print_diagnosis(result: Mapping[str, Any]) -> None:
    """The verdict, the errors, and the causes."""
    say(result["sentence"])
    models = [("nominal", "nominal"), ("standard", "standard"), ("named", "named")]
    if result["unknown"]:
        models.append(("with_unknown", "+ unknown"))
    print_errors(result, models)
    lines = cause_lines(result)
    if lines:
        head = ("", "removes", "sure", "size")
        table(
            "what causes it, and what part of the squared error it removes", head, lines[:LISTED], words=True
        )
    if len(lines) > LISTED:
        say(f"and {len(lines) - LISTED} smaller: see the report")
    for unknown in result["unknown"]:
        say(f"unknown: something at {unknown['joint']} goes with {joined(unknown['inputs'], 3)}")
    for one in result["classes"][:3]:
        say(f"note: {one['sentence']}")
    if result["not_testable"]:
        words = list(dict.fromkeys(n["effect"].replace("_", " ") for n in result["not_testable"]))
        say(f"not testable with these recordings (why: report.html): {joined(words, 12)}")


def cause_lines(result: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """What was named beyond standard practice, as in the report's table."""
    from truing.dynamics.page import beyond_standard, others, place, size_text

    lines = []
    for effect in beyond_standard(result):
        name = " ".join(filter(None, (effect["effect"].replace("_", " "), place(effect), others(effect, 1))))
        share, sure = 100 * (effect["share"] or 0.0), 100 * effect["probability"]
        lines.append((name, f"{share:.1f} %", f"{sure:.0f} %", size_text(effect)))
    return lines
