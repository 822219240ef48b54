# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say where the robot will be, row by row.

Writes predicted.csv (one row per data row), result.json, report.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import BaseLink, File, RobotFile, TipLink
from truing.cli.reading import robot_and_measurements
from truing.cli.tables import mm, table

if TYPE_CHECKING:
    from truing.identification import Prediction
    from truing.model import Measurements, Robot

PANEL = "Calibrate"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, Measurements]", "Prediction"]):
    doing = "predicting"

    robot: RobotFile
    data: Annotated[
        Path,
        File("Rows of joints and inputs (CSV or Parquet), measured or not.", argument=True, metavar="DATA"),
    ]
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, Measurements]:
        return robot_and_measurements(self.robot, self.data, self.base_link, self.tip_link, joints_only=True)

    def solve(self, loaded: tuple[Robot, Measurements], progress: run.Progress) -> Prediction:
        import truing

        return truing.predict(*loaded)

    def write(
        self, folder: Path, loaded: tuple[Robot, Measurements], found: Prediction, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.identification.result import write_prediction

        return write_prediction(folder, *loaded, found, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Prediction) -> None:
        lines = [("rows predicted", str(result["rows"]))]
        if "errors" in result:
            shown = (("mean", "mean_m"), ("rms", "rms_m"), ("95 %", "p95_m"), ("maximum", "max_m"))
            lines += [(f"measured error, {name}", mm(result["errors"][key])) for name, key in shown]
        table(f"{result['robot']}: prediction", ("", ""), lines)
