# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write what was found as a simulator's model, and list what could not be written.

Writes the model (MJCF and perhaps callbacks.py; URDF; URDF and actuators.py), not_written.yaml, result.json.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import Choice, File
from truing.cli.tables import say, table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.dynamics import Recording
    from truing.dynamics.export import Exported
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True)
class Loaded:
    robot: Robot
    recordings: list[Recording]


@dataclass(frozen=True)
class Found:
    exported: Exported
    files: dict[str, str]  # text by name


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, Found]):
    doing = "writing"
    sometimes = ("callbacks.py", "actuators.py")

    result: Annotated[
        Path,
        File(
            "Folder of `truing dynamics diagnose` or `identify`, or a robot.yaml.",
            argument=True,
            metavar="RESULT",
        ),
    ]
    to: Annotated[Literal["mjcf", "urdf", "isaaclab"], Choice("Simulator's format.")] = "mjcf"
    source: Annotated[
        Path | None,
        File(
            "URDF that the robot was read from: its meshes and names are kept. Not for mjcf.",
            metavar="ROBOT.urdf",
        ),
    ] = None
    recording: Annotated[
        Sequence[Path],
        File(
            "Motion on which sizes of what is not written are stated. May be repeated. Default: a motion"
            " through the robot's range.",
            metavar="REC",
            several=True,
        ),
    ] = ()

    def load(self, progress: run.Progress) -> Loaded:
        from truing.files import load_recordings, load_robot

        file = self.result / "robot.yaml" if self.result.is_dir() else self.result
        if not file.exists():
            raise InputError(
                f"{file}: there is no such file: expected the folder that `truing dynamics diagnose` or"
                " `identify` wrote, or a robot.yaml"
            )
        robot = load_robot(file)
        found = load_recordings(self.recording, robot) if self.recording else ()
        return Loaded(robot, list(found))

    def solve(self, loaded: Loaded, progress: run.Progress) -> Found:
        from truing.dynamics.export import export

        with tempfile.TemporaryDirectory() as folder:
            exported = export(
                loaded.robot,
                self.to,
                Path(folder) / "model",
                source=self.source,
                recordings=loaded.recordings,
            )
            files = {path.name: path.read_text(encoding="utf-8") for path in exported.folder.iterdir()}
        return Found(exported, files)

    def write(self, folder: Path, loaded: Loaded, found: Found, warnings: list[str]) -> Mapping[str, Any]:
        from truing.dynamics.result import export_dict
        from truing.report.json_text import to_json

        for name, text in found.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        result = export_dict(
            loaded.robot, self.to, found.exported.model.name, found.exported.not_written, warnings=warnings
        )
        (folder / "result.json").write_text(to_json(result), encoding="utf-8")
        return result

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        lines = [
            (n["name"], "-" if n["size_Nm"] is None else f"{n['size_Nm']:.2g} Nm", n["reason"])
            for n in result["not_written"]
        ]
        if lines:
            table("what the model lacks", ("", "size", "why"), lines, words=True)
        if "callbacks.py" in found.files:
            say(f"torques that MuJoCo has no field for: {self.out / 'callbacks.py'}")
        say(f"model: {self.out / result['model']}")
