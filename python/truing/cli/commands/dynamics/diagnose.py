# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Name the effects that the model lacks: friction laws, rotor inertia, payload, couplings …

Inertias, Coulomb and viscous friction and an offset are fitted in any case; what is named comes on top, and
is judged on recordings that nothing was fitted to: by torque, and by simulated motion (MuJoCo). Writes
result.json, report.html, robot.yaml (with what was named), residuals.parquet. Of recordings with commands
and no torque (servo arms) the actuators are diagnosed by simulated motion; then arm.xml and motion.parquet
stand beside result.json and report.html.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import Flag, Threads, TorqueEffectNames, core
from truing.cli.recordings import (
    TestShare,
    TorqueCommand,
    checked,
    mistaken,
    print_errors,
    print_findings,
    print_motion,
)
from truing.cli.tables import joined, say, table

if TYPE_CHECKING:
    from truing.dynamics import CheckedRecordings, TorqueDiagnosis
    from truing.dynamics.rollout import Rollout
    from truing.dynamics.servo import ServoDiagnosis

PANEL = "Dynamics"
SIMULATED = (".xml", ".mjcf", ".urdf")  # files that the simulator reads itself
DOES_NOT_HOLD = "what was found does not hold on recordings that it was not fitted to"
LISTED = 12  # causes on the terminal; the report has all


@dataclass(frozen=True)
class Answer:
    """What was found, and what motion says of it."""

    found: TorqueDiagnosis
    rollout: Rollout


@dataclass(frozen=True)
class ServoAnswer:
    """What was found from commands alone."""

    found: ServoDiagnosis


@dataclass(frozen=True, kw_only=True)
class Command(TorqueCommand[Answer | ServoAnswer]):
    doing = "diagnosing"

    leave_out: Annotated[
        str, TorqueEffectNames("Effects that are not to be considered: 'coupling,ripple'.")
    ] = ""
    test_share: TestShare = core("TorqueDiagnoseOptions", "test_share")
    no_rollout: Annotated[
        bool, Flag("Not judged by simulated motion, which takes some seconds and needs truing[dynamics].")
    ] = False
    threads: Threads = core("TorqueDiagnoseOptions", "threads")

    def load(self, progress: run.Progress) -> CheckedRecordings:
        from truing.dynamics import check_recordings
        from truing.dynamics.magnitudes import commands_for_magnitudes
        from truing.dynamics.servo import by_commands

        robot, recordings = self.read(self.recordings)
        recordings = commands_for_magnitudes(robot, recordings)
        if by_commands(recordings):
            return check_recordings(robot, recordings)
        return checked((robot, recordings))

    def solve(self, loaded: CheckedRecordings, progress: run.Progress) -> Answer | ServoAnswer:
        from truing.dynamics import diagnose
        from truing.dynamics.servo import by_commands

        if by_commands(loaded.recordings):
            return ServoAnswer(self._from_commands(loaded, progress))
        options: dict[str, Any] = {
            "leave_out": self.leave_out,
            "test_share": self.test_share,
            "threads": self.threads,
            "cutoff": loaded.cutoff if self.cutoff is None else self.cutoff,
        }
        found = diagnose(loaded.robot, loaded.recordings, **options)
        return Answer(found, self._judged(loaded, found, progress))

    def _from_commands(self, loaded: CheckedRecordings, progress: run.Progress) -> ServoDiagnosis:
        from truing.dynamics.servo import servo_diagnose
        from truing.effects import name_list

        return servo_diagnose(
            self.robot if self.robot.suffix.lower() in SIMULATED else loaded.robot,
            loaded.recordings,
            joints=[joint.name for joint in loaded.robot.joints if not joint.passive],
            leave_out=name_list(self.leave_out) if self.leave_out else (),
            test_share=self.test_share,
            threads=self.threads,
            progress=progress.now,
        )

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
        found: Answer | ServoAnswer,
        warnings: list[str],
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_diagnosis
        from truing.dynamics.servo.written import write_servo

        if isinstance(found, ServoAnswer):
            return write_servo(
                folder,
                found.found,
                loaded.recordings,
                sanity=loaded.findings,
                warnings=warnings,
                test_share=self.test_share,
            )
        return write_diagnosis(
            folder,
            found.found,
            loaded.recordings,
            found.rollout,
            sanity=loaded.findings,
            warnings=warnings,
            nominal_file=self.robot,
            base_link=self.base_link,
            test_share=self.test_share,
        )

    def failure(self, result: Mapping[str, Any]) -> str:
        if mistaken(result) or result["verdict"] != "does_not_hold":
            return mistaken(result)
        return DOES_NOT_HOLD

    def table(self, result: Mapping[str, Any], found: Answer | ServoAnswer) -> None:
        if isinstance(found, ServoAnswer):
            print_servo(result)
        else:
            print_diagnosis(result)


def print_diagnosis(result: Mapping[str, Any]) -> None:
    """What looks wrong with the recordings, the verdict, the errors, and the causes."""
    from truing.dynamics.page import orders_sentence, remainder_sentence

    print_findings(result)
    say(result["sentence"])
    models = [("nominal", "nominal"), ("standard", "standard"), ("named", "named")]
    if result["unknown"] or result["remainders"]:
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
        say(f"and {len(lines) - LISTED} more: see the report")
    for unknown in result["unknown"]:
        say(f"unknown: something at {unknown['joint']} goes with {joined(unknown['inputs'], 3)}")
    for sentence in (remainder_sentence(result["remainders"]), orders_sentence(result["orders"])):
        if sentence:
            say(f"note: {sentence}")
    for one in result["classes"][:3]:
        say(f"note: {one['sentence']}")
    if result["not_testable"]:
        words = list(dict.fromkeys(n["effect"].replace("_", " ") for n in result["not_testable"]))
        say(f"not testable with these recordings (why: report.html): {joined(words, 12)}")


def print_servo(result: Mapping[str, Any]) -> None:
    """The verdict from commands, errors by joint, the causes, and what the recordings cannot tell."""
    from truing.report.words import sure_text

    print_findings(result)
    say(result["sentence"])
    found = result["rollout"]
    at, main = found["horizon_s"], found["main_horizon_s"]
    column = at.index(main) if main in at else len(at) - 1
    models = tuple(found["held_out"])
    lines = [
        (joint, *(motion_text(found["held_out"][m][joint][column], unit) for m in models))
        for joint, unit in found["units"].items()
    ]
    ahead = at[column] if isinstance(at[column], str) else f"{at[column]:g} s"
    table(f"{result['robot']}: simulated less held-out motion, rms ({ahead})", ("", *models), lines)
    causes = [
        (
            f"{e['effect'].replace('_', ' ')} {', '.join(e['joints'])}",
            f"{100 * e['share']:.1f} %",
            sure_text(e["probability"]),
            e["sentence"].rpartition(": ")[2],
        )
        for e in result["effects"]
        if e["departs"] or not e["standard"]
    ]
    if causes:
        head = ("", "removes", "sure", "size")
        table(
            "what causes it, and what part of the squared error it removes", head, causes[:LISTED], words=True
        )
    for unknown in result["unknown"]:
        say(f"unknown: something at {unknown['joint']} goes with {joined(unknown['inputs'], 3)}")
    for one in result["classes"][:3]:
        say(f"note: {one['sentence']}; to tell: {one['separated_by']}")


def motion_text(value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    return f"{math.degrees(value):.2f}°" if unit == "rad" else f"{1e3 * value:.2f} mm"


def print_rollout(result: Mapping[str, Any]) -> None:
    """How far simulations are off, joint by joint and at every horizon; or why there are none."""
    found = result["rollout"]
    if found["why_not"]:
        say(f"not judged by motion: {found['why_not']}")
        return
    print_motion(result["robot"], found, "held_out", tuple(found["held_out"]))


def cause_lines(result: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """What was named beyond standard practice, as in the report's table."""
    from truing.dynamics.page import beyond_standard, is_load, others, place, size_text
    from truing.report.words import sure_text

    lines = []
    for effect in beyond_standard(result):
        name = " ".join(filter(None, (effect["effect"].replace("_", " "), place(effect), others(effect, 1))))
        removes = "first" if is_load(effect) else f"{100 * (effect['share'] or 0.0):.1f} %"
        lines.append((name, removes, sure_text(effect["probability"]), size_text(effect)))
    return lines
