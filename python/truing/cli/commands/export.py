# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write what was found for a controller or a robot description, and say in millimetres what it cannot hold.

Writes the files of the format, result.json.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import BaseLink, Choice, File, Kind, TipLink
from truing.cli.tables import mm, say, table

if TYPE_CHECKING:
    from truing.controllers import Calibration, Exported, ExportOptions

    Loaded = tuple[Calibration, ExportOptions]

PANEL = "Calibrate"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Loaded", "Exported"]):
    doing = "writing"
    sometimes = (
        *(f"{brand}.txt" for brand in ("kuka", "abb", "fanuc", "ur", "yaskawa")),
        "kinematics.yaml",
        "robot.urdf",
        "transmissions.xml",
        "joint_offsets.xml",
        "static_transforms.sh",
        "zeros.html",
        "zeros.csv",
    )

    result: Annotated[
        Path,
        File(
            "Folder of `truing identify`, `diagnose` or `handeye`, or a calibrated robot file.",
            argument=True,
            metavar="RESULT",
        ),
    ]
    to: Annotated[
        Literal["frames", "ur_description", "urdf", "ros2_control", "tf", "lerobot", "zeros"],
        Choice("What to write."),
    ] = "frames"
    nominal: Annotated[
        str,
        Kind("Robot that the controller believes in: zeros are against it.", metavar="ROBOT"),
    ] = ""
    brand: Annotated[
        Sequence[str],
        Choice(
            "Of frames: only in this maker's notation. May be repeated.",
            {brand: brand for brand in ("kuka", "abb", "fanuc", "ur", "yaskawa")},
            several=True,
        ),
    ] = ()
    source: Annotated[
        Path | None,
        File(
            "Of urdf: the URDF that the robot was read from, whose meshes and names stay.",
            metavar="ROBOT.urdf",
        ),
    ] = None
    calibration: Annotated[
        Path | None,
        File("Of lerobot: the JSON that the arm was recorded with.", metavar="FILE.json"),
    ] = None
    parent: Annotated[
        str,
        Kind(
            "Of tf: name of the frame that all are in. Default: tool0 for tools, base else.", metavar="FRAME"
        ),
    ] = ""
    child: Annotated[
        str, Kind("Of tf and frames: name of the first frame. Default: as in the result.", metavar="FRAME")
    ] = ""
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.controllers import ExportOptions, load_result
        from truing.controllers.frames import BRANDS
        from truing.files import is_urdf

        calibration = load_result(self.result)
        links = (
            (self.base_link, self.tip_link)
            if self.nominal and is_urdf(self.nominal.rpartition("@")[2])
            else ()
        )
        options = ExportOptions(
            nominal=load_robot(self.nominal, *links) if self.nominal else None,
            brands=[brand for brand in BRANDS if not self.brand or brand in self.brand],
            source=self.source,
            base_link=self.base_link,
            tip_link=self.tip_link,
            lerobot=self.calibration,
            parent=self.parent,
            child=self.child,
        )
        return calibration, options

    def solve(self, loaded: Loaded, progress: run.Progress) -> Exported:
        from truing.controllers import export

        return export(loaded[0], self.to, loaded[1])

    def write(self, folder: Path, loaded: Loaded, found: Exported, warnings: list[str]) -> Mapping[str, Any]:
        from truing.controllers.result import write_export

        return write_export(folder, found, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Exported) -> None:
        table(f"{result['name']}: {result['to']}", ("", ""), list(found.written.lines), words=True)
        if result["dropped"]:
            lines = [(item["name"], mm(item["size_m"]), item["reason"]) for item in result["dropped"]]
            table("not written", ("", "moves the tool by up to", "why"), lines, words=True)
        if result["before"] is not None:
            say(f"from the calibrated robot, tool and base alone fitted: {_distance(result['before'])}")
        if result["remaining"] is not None:
            say(f"from the calibrated robot, with what was written: {_distance(result['remaining'])}")
        for note in result["notes"]:
            say(f"note: {note}")
        say(f"files: {', '.join(str(self.out / name) for name in result['files'])}")


def _distance(distance: Mapping[str, float]) -> str:
    return f"{mm(distance['rms_m'])} rms, at most {mm(distance['max_m'])}"
