# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find what all arms of a type share, and each arm's own base, tool and zeros.

Writes result.json, report.html, robot.yaml (of the type), robot_NAME.yaml (of every arm), arms.csv.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.fleets import FleetCommand, say_errors
from truing.cli.options import EffectNames, Free, Names
from truing.cli.tables import say

if TYPE_CHECKING:
    from truing.fleet import FleetIdentification
    from truing.model import Robot

PANEL = "Fleets"


@dataclass(frozen=True, kw_only=True)
class Command(FleetCommand["FleetIdentification"]):
    doing = "identifying"

    free: Free = ""
    hold: Annotated[str, Names("Names and globs that stay at nominal: 'base.*,J6.*'.")] = ""
    effects: Annotated[
        str, EffectNames("Effects to find as well, of one size in all arms: 'backlash,harmonic:J2+J3'.")
    ] = ""
    own: Annotated[str, Names("What every arm has of its own, beside base and tool: names and globs.")] = (
        "*.offset"
    )

    def solve(self, loaded: Robot, progress: run.Progress) -> FleetIdentification:
        import truing

        with self.client() as client:
            return truing.fleet.identify(
                loaded,
                self.source,
                client,
                free=self.free,
                hold=self.hold,
                effects=self.effects,
                own=self.own,
                **self.options(progress),
            )

    def write(
        self, folder: Path, loaded: Robot, found: FleetIdentification, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.fleet.result import write_fleet

        return write_fleet(folder, found, nominal_file=self.robot, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: FleetIdentification) -> None:
        say_errors(result)
        shown = [p for p in result["parameters"] if not p["frozen"]]
        say(f"{len(shown)} of {len(result['parameters'])} parameters that all arms share were found")
