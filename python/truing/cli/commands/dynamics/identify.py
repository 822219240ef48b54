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
from truing.cli.options import Flag, Threads, TorqueEffectNames, core
from truing.cli.recordings import TestShare, TorqueCommand, mistaken, print_errors, print_findings
from truing.cli.tables import say

if TYPE_CHECKING:
    from truing.dynamics import CheckedRecordings, TorqueFit

PANEL = "Dynamics"


@dataclass(frozen=True, kw_only=True)
class Command(TorqueCommand["TorqueFit"]):
    doing = "identifying"

    effects: Annotated[
        str,
        TorqueEffectNames(
            "Effects to fit: 'coulomb,viscous,load_friction:J2+J3'. Default: armature, Coulomb and viscous"
            " friction, an offset at every joint."
        ),
    ] = ""
    keep_inertias: Annotated[bool, Flag("Masses and inertias of the links stay as they are.")] = False
    test_share: TestShare = core("TorqueOptions", "test_share")
    threads: Threads = core("TorqueOptions", "threads")

    def solve(self, loaded: CheckedRecordings, progress: run.Progress) -> TorqueFit:
        from truing.dynamics import identify

        options: dict[str, Any] = {
            "effects": self.effects,
            "fit_inertials": not self.keep_inertias,
            "test_share": self.test_share,
            "threads": self.threads,
            "cutoff": loaded.cutoff if self.cutoff is None else self.cutoff,
        }
        return identify(loaded.robot, loaded.recordings, **options)

    def write(
        self, folder: Path, loaded: CheckedRecordings, found: TorqueFit, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_fit

        return write_fit(
            folder,
            found,
            loaded.recordings,
            sanity=loaded.findings,
            warnings=warnings,
            nominal_file=self.robot,
            test_share=self.test_share,
        )

    def failure(self, result: Mapping[str, Any]) -> str:
        return mistaken(result)

    def table(self, result: Mapping[str, Any], found: TorqueFit) -> None:
        print_findings(result)
        models = (("nominal", "nominal"), ("standard", "standard"), ("named", "fitted"))
        print_errors(result, models)
        say(f"{len(result['parameters'])} parameters fitted; low-pass at {result['cutoff_hz']:.3g} Hz")
