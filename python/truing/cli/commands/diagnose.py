# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say which effects cause the gap between robot and model, at which joints, and how far it can be closed.

Writes result.json, report.html, robot.yaml (with what was named), residuals.csv, and next_poses.csv if more
should be measured.
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
    sometimes = ("next_poses.csv",)

    robot: RobotFile
    data: DataFile
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
        robot, data = robot_and_measurements(self.robot, self.data, self.base_link, self.tip_link)
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
        return (
            "what was found does not hold on held-out poses" if result["verdict"] == "does_not_hold" else ""
        )

    def table(self, result: Mapping[str, Any], found: Diagnosis) -> None:
        from truing.diagnosis.page import at_joints, trouble

        for finding in trouble(result):
            say(f"look at the data first: {finding['text']}")
        say(result["sentence"])
        print_errors(result)
        causes = cause_lines(result)
        if causes:
            head = ("what", "probability", "size", "off the error", "not told from")
            table("what causes it", head, causes, words=True)
        if result["not_testable"]:
            words = [f"{at_joints(n)} ({n['why']})" for n in result["not_testable"]]
            say(f"not testable with these data: {joined(words, 6)}")
        for finding in result["sanity"]:
            if finding not in trouble(result):
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
    lines.append(["noise", mm(gap["noise_floor_m"]), *[""] * (len(columns) - 1)])
    table(f"{result['robot']}: error of held-out poses", ["", *(name for name, _ in columns)], lines)
    if result["effects"]:
        low, high = shrink["ci"]
        say(
            f"robot.yaml takes {100 * shrink['value']:.0f} % off the error (90 % interval {100 * low:.0f} to"
            f" {100 * high:.0f} %)"
        )


def cause_lines(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """What was named, and what is unknown."""
    from truing.diagnosis.page import at_joints, size_text

    lines: list[tuple[str, ...]] = []
    for effect in result["effects"]:
        others = ", ".join(at_joints(other) for other in effect["confounded_with"])
        probability = f"{100 * effect['probability']:.0f} %"
        lines.append(
            (at_joints(effect), probability, size_text(effect), shrink_text(effect["held_out"]), others)
        )
    for unknown in result["unknown"]:
        place = f"at {unknown['joint']}" if unknown["joint"] else "somewhere"
        shape = unknown["looks_like"] or f"over {', '.join(unknown['inputs'])}"
        off = shrink_text(unknown["held_out"]) if unknown["inputs"] else ""
        lines.append((f"unknown {place}", f"{100 * unknown['probability']:.0f} %", shape, off, ""))
    return lines


def shrink_text(held: Mapping[str, Any]) -> str:
    """ "46 % [43, 48]": off the error, and the 90 % interval."""
    value, low, high = (round(100 * part) for part in (held["shrink"], *held["ci"]))
    return f"{value} % [{low}, {high}]"
