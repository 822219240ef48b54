# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find links and friction of a type, what each arm has of its own, and the arms that stand out, from torques.

Writes result.json, report.html, robot.yaml (of the type), robot_NAME.yaml (of every arm), arms.csv.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truing.cli import run
from truing.cli.fleets import FleetWork, RecordingFiles
from truing.cli.recordings import CutOff, TestShare
from truing.cli.tables import say, table

if TYPE_CHECKING:
    from truing.fleet import FleetDynamics
    from truing.model import Robot

PANEL = "Fleets"


@dataclass(frozen=True, kw_only=True)
class Command(FleetWork["FleetDynamics"]):
    doing = "summing"
    torques = True

    source: RecordingFiles
    cutoff: CutOff = None
    test_share: TestShare = 0.2

    def solve(self, loaded: Robot, progress: run.Progress) -> FleetDynamics:
        import truing

        with self.client() as client:
            return truing.fleet.dynamics(
                loaded,
                self.source,
                client,
                one_arm=self.one_arm,
                cutoff=self.cutoff,
                test_share=self.test_share,
                skip_corrupt=self.skip_corrupt,
                workers=self.workers,
                tell=progress.now,
            )

    def write(
        self, folder: Path, loaded: Robot, found: FleetDynamics, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.fleet.torque_result import write_fleet_dynamics

        return write_fleet_dynamics(folder, found, nominal_file=self.robot, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: FleetDynamics) -> None:
        say(result["sentence"])
        if found.stands_out:
            rows = [
                (
                    s.arm,
                    s.parameter,
                    f"{s.value:+.3g} ± {s.sigma:.2g} {s.unit}".removesuffix(" -"),
                    f"{s.others:+.2g} ± {s.scatter:.2g}",
                )
                for s in found.stands_out
            ]
            table("arms that stand out", ("arm", "parameter", "departs by", "others"), rows)
        errors = [(e.joint, *(f"{x:.1f} %" for x in (e.nominal, e.shared, e.own))) for e in found.errors]
        table("held-out error of the torque", ("joint", "nominal", "shared", "with its own"), errors)
        say(
            f"{len(result['arms'])} arms, {result['rows']} rows, {result['partitions']} partitions read"
            f" {result['solver']['passes']} times"
        )
