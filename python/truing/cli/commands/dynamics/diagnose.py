# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Name the effects that the model lacks: friction laws, rotor inertia, payload, couplings …

Inertias, Coulomb and viscous friction and an offset are fitted in any case; what is named comes on top, and
is judged on recordings that nothing was fitted to: by torque, and by simulated motion (MuJoCo). Writes
result.json, report.html, robot.yaml (with what was named), residuals.parquet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import Flag, Threads, TorqueEffectNames, core
from truing.cli.recordings import (
    TestShare,
    TorqueCommand,
    mistaken,
    print_errors,
    print_findings,
    print_motion,
)
from truing.cli.tables import joined, say, table

if TYPE_CHECKING:
    from truing.dynamics import CheckedRecordings, TorqueDiagnosis
    from truing.dynamics.rollout import Rollout

PANEL = "Dynamics"
LISTED = 12  # causes on the terminal; the report has all


@dataclass(frozen=True)
class Answer:
    """What was found, and what motion says of it."""

    found: TorqueDiagnosis
    rollout: Rollout


@dataclass(frozen=True, kw_only=True)
class Command(TorqueCommand[Answer]):
    doing = "diagnosing"

    leave_out: Annotated[
        str, TorqueEffectNames("Effects that are not to be considered: 'coupling,ripple'.")
    ] = ""
    test_share: TestShare = core("TorqueDiagnoseOptions", "test_share")
    no_rollout: Annotated[
        bool, Flag("Not judged by simulated motion, which takes some seconds and needs truing[dynamics].")
    ] = False
    threads: Threads = core("TorqueDiagnoseOptions", "threads")

    def solve(self, loaded: CheckedRecordings, progress: run.Progress) -> Answer:
        from truing.dynamics import diagnose

        options: dict[str, Any] = {
            "leave_out": self.leave_out,
            "test_share": self.test_share,
            "threads": self.threads,
        }
        if self.cutoff is not None:
            options["cutoff"] = self.cutoff
        found = diagnose(loaded.robot, loaded.recordings, **options)
        return Answer(found, self._judged(loaded, found, progress))

    def _judged(self, loaded: CheckedRecordings, found: TorqueDiagnosis, progress: run.Progress) -> Rollout:
        from truing.dynamics.rollout import Rollout, rollout

        if self.no_rollout:
            return Rollout(None, "not asked for (--no-rollout)")
        progress.now("simulating")
        return rollout(loaded.robot, found, loaded.recordings, test_share=self.test_share)

    def write(
        self,
        folder: Path,
        loaded: CheckedRecordings,
        found: Answer,
        warnings: list[str],
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_diagnosis

        return write_diagnosis(
            folder,
            found.found,
            loaded.recordings,
            found.rollout,
            sanity=loaded.findings,
            warnings=warnings,
            nominal_file=self.robot,
            test_share=self.test_share,
        )

    def failure(self, result: Mapping[str, Any]) -> str:
        if mistaken(result) or result["verdict"] != "does_not_hold":
            return mistaken(result)
        return "what was found does not hold on recordings that it was not fitted to"

    def table(self, result: Mapping[str, Any], found: Answer) -> None:
        print_diagnosis(result)


def print_diagnosis(result: Mapping[str, Any]) -> None:
    """What looks wrong with the recordings, the verdict, the errors, and the causes."""
    print_findings(result)
    say(result["sentence"])
    models = [("nominal", "nominal"), ("standard", "standard"), ("named", "named")]
    if result["unknown"]:
        models.append(("with_unknown", "+ unknown"))
    print_errors(result, models)
    print_rollout(result)
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


def print_rollout(result: Mapping[str, Any]) -> None:
    """How far simulations are off, joint by joint and at every horizon; or why there are none."""
    found = result["rollout"]
    if found["why_not"]:
        say(f"not judged by motion: {found['why_not']}")
        return
    print_motion(result["robot"], found, "held_out", tuple(found["held_out"]))


def cause_lines(result: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """What was named beyond standard practice, as in the report's table."""
    from truing.dynamics.page import beyond_standard, others, place, size_text

    lines = []
    for effect in beyond_standard(result):
        name = " ".join(filter(None, (effect["effect"].replace("_", " "), place(effect), others(effect, 1))))
        share, sure = 100 * (effect["share"] or 0.0), 100 * effect["probability"]
        lines.append((name, f"{share:.1f} %", f"{sure:.0f} %", size_text(effect)))
    return lines
