# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say which effects cause the gap between robot and model, at which joints, and how far it can be closed.

Writes result.json, report.html, robot.yaml (with what was named), robot_with_unknown.yaml (with the unknown
functions as tables, where held-out poses gain by them), residuals.csv, and next_poses.csv if more should be
measured.
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
    EffectNames,
    Fraction,
    ProgramFile,
    RobotFile,
    Seed,
    Threads,
    TipLink,
    core,
)
from truing.cli.reading import robot_and_measurements
from truing.cli.tables import joined, mm, say, table

if TYPE_CHECKING:
    from truing.diagnosis import Diagnosis
    from truing.model import Measurements, Robot

PANEL = "Diagnose"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, Measurements]", "Diagnosis"]):
    doing = "diagnosing"
    sometimes = ("next_poses.csv", "robot_with_unknown.yaml", "robot_with_unknown.urdf")

    robot: RobotFile
    data: DataFile
    program: ProgramFile = None
    leave_out: Annotated[
        str, EffectNames("Effects that are not considered: 'drift,scale'. `truing effects` lists them.")
    ] = ""
    false_alarm: Annotated[
        float,
        Fraction(
            "False-positive rate: how often a robot without any gap is said to have one.", above=0, below=0.5
        ),
    ] = core("DiagnoseOptions", "false_alarm")
    record: Annotated[
        Literal["q", "qr"],
        Choice(
            "qr: use the second record of the joints (qr1_rad …). q: use the one that explains the"
            " measurements better."
        ),
    ] = "q"
    seed: Seed = core("DiagnoseOptions", "seed")
    threads: Threads = core("DiagnoseOptions", "threads")
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, Measurements]:
        robot, data = robot_and_measurements(
            self.robot, self.data, self.base_link, self.tip_link, program=self.program
        )
        if self.record == "qr":
            from truing.diagnosis.result import with_second_record

            data = with_second_record(robot, data)
        return robot, data

    def solve(self, loaded: tuple[Robot, Measurements], progress: run.Progress) -> Diagnosis:
        import truing

        return truing.diagnose(
            *loaded,
            leave_out=self.leave_out,
            false_alarm=self.false_alarm,
            seed=self.seed,
            threads=self.threads,
        )

    def write(
        self, folder: Path, loaded: tuple[Robot, Measurements], found: Diagnosis, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.diagnosis.result import write_diagnosis

        return write_diagnosis(
            folder,
            found,
            loaded[1],
            source=self.data.name,
            warnings=warnings,
            nominal_file=self.robot,
            base_link=self.base_link,
            tip_link=self.tip_link,
        )

    def failure(self, result: Mapping[str, Any]) -> str:
        if any(finding["mistake"] for finding in result["sanity"]):
            return "the robot file or the columns are to be corrected first"
        return (
            "what was found does not hold on held-out poses" if result["verdict"] == "does_not_hold" else ""
        )

    def table(self, result: Mapping[str, Any], found: Diagnosis) -> None:
        from truing.diagnosis.page import plain_name, trouble

        for finding in trouble(result):
            say(f"look at the data first: {finding['text']}")
        say(f"{result['robot']}: {result['explained']}")
        say(result["sentence"])
        print_errors(result)
        causes = cause_lines(result)
        if causes:
            head = ("", "of gap", "at tip", "without", "sure", "size")
            table("what causes it: rms at the tip, rms error without it", head, causes, words=True)
        if result["not_testable"]:
            words = list(dict.fromkeys(plain_name(n["effect"]) for n in result["not_testable"]))
            say(f"not testable with these data (why: report.html): {joined(words, 12)}")
        for finding in result["sanity"]:
            if finding not in trouble(result) and not finding["mistake"]:  # that is the sentence
                say(f"note: {finding['text']}")
        if result["next_measurements"]:
            say(f"measure next: {self.out / 'next_poses.csv'} ({len(result['next_measurements'])} poses)")


def print_errors(result: Mapping[str, Any]) -> None:
    """Errors of held-out poses before and after; columns that would be empty are left out."""
    gap, after, by_all, shrink = result["gap"], result["after"], result["after_unknown"], result["shrink"]
    columns = [("before", gap)]
    if result["effects"]:
        columns.append(("with what is named", after))
    if any(u["inputs"] for u in result["unknown"]):
        columns.append(("with free functions", by_all))
    lines = [
        [label, *(mm(e[key]) for _, e in columns)] for label, key in (("rms", "rms_m"), ("95 %", "p95_m"))
    ]
    if gap["noise_floor_m"]:
        lines.append(["noise", mm(gap["noise_floor_m"]), *[""] * (len(columns) - 1)])
    table(f"{result['robot']}: error of held-out poses", ["", *(name for name, _ in columns)], lines)
    if result["effects"]:
        low, high = shrink["ci"]
        say(
            f"robot.yaml takes {100 * shrink['value']:.0f} % off the error (90 % interval {100 * low:.0f} to"
            f" {100 * high:.0f} %)"
        )
    if tables := result["after_robot_with_unknown"]:
        say(f"robot_with_unknown.yaml leaves {mm(tables['rms_m'])} rms: it has what is unknown as tables")


def cause_lines(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """What was named, and what is unknown: as in the report's first table."""
    from truing.diagnosis.page import at_joints, contender, size_text

    lines: list[tuple[float, tuple[str, ...]]] = []
    for effect in result["effects"]:
        rival = contender(effect)
        name = at_joints(effect) + (f" or {at_joints(rival)}" if rival else "")
        lines.append((effect["share"], cause_line(effect, name, size_text(effect))))
    for unknown in result["unknown"]:
        place = f"unknown at {unknown['joint']}" if unknown["joint"] else "unknown somewhere"
        shape = unknown["looks_like"] or f"over {', '.join(unknown['inputs'])}"
        lines.append((unknown["share"], cause_line(unknown, place, shape)))
    return [line for _, line in sorted(lines, key=lambda line: -line[0])]


def cause_line(found: Mapping[str, Any], name: str, size: str) -> tuple[str, ...]:
    """Fraction of the gap, rms motion of the tip, rms error without it, how sure, size."""
    from truing.report.words import length_text, sure_text

    sure = sure_text(found["probability"])
    if not found.get("inputs", True):  # what no function describes has no size
        return name, "–", "–", "–", sure, size
    without = length_text(found["held_out"]["before_rms_m"])
    return name, f"{100 * found['share']:.0f} %", length_text(found["size_at_tip_m"]), without, sure, size
