# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Name what all arms of a type have, and the arms that have what the others do not.

Writes result.json, report.html, robot.yaml (of the type), robot_NAME.yaml (of every arm), arms.csv.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.fleets import FleetCommand, say_errors
from truing.cli.options import EffectNames
from truing.cli.tables import mm, say, table

if TYPE_CHECKING:
    from truing.fleet import FleetDiagnosis
    from truing.model import Robot

PANEL = "Fleets"


@dataclass(frozen=True, kw_only=True)
class Command(FleetCommand["FleetDiagnosis"]):
    doing = "diagnosing"

    leave_out: Annotated[
        str, EffectNames("Effects that are not to be considered: 'harmonic,axis_wobble'.")
    ] = ""

    def solve(self, loaded: Robot, progress: run.Progress) -> FleetDiagnosis:
        import truing

        with self.client() as client:
            return truing.fleet.diagnose(
                loaded, self.source, client, leave_out=self.leave_out, **self.options(progress)
            )

    def write(
        self, folder: Path, loaded: Robot, found: FleetDiagnosis, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.fleet.result import write_fleet

        return write_fleet(folder, found, nominal_file=self.robot, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: FleetDiagnosis) -> None:
        say(result["sentence"])
        lines = [("all arms", effect) for effect in result["of_all"]]
        lines += [(name, effect) for name, effects in result["of_arms"].items() for effect in effects]
        if lines:
            rows = [
                (who, " ".join((e["effect"].replace("_", " "), *e["joints"])), mm(e["size_at_tip_m"]))
                for who, e in lines
            ]
            table("what was found", ("arm", "effect", "at the tip, rms"), rows)
        say_errors(result)
