# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write what was found as a simulator's model, and list what could not be written.

Writes the model (MJCF and perhaps callbacks.py; URDF; URDF and actuators.py), not_written.yaml, result.json,
report.html: how far the model, as it is written, is from held-out motion.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import Choice, File
from truing.cli.recordings import print_motion
from truing.cli.tables import say, table
from truing.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from truing.dynamics import Recording
    from truing.dynamics.export import Exported
    from truing.dynamics.rollout import Rollout
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True)
class Loaded:
    robot: Robot
    recordings: list[Recording]
    held_out: list[tuple[Recording, NDArray[np.bool_]]]  # and which of their rows


@dataclass(frozen=True)
class Found:
    exported: Exported
    files: dict[str, str]  # text by name
    rollout: Rollout


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
            "Motion on which sizes of what is not written are stated. May be repeated. Default: what RESULT"
            " was fitted to; of a robot.yaml a motion through the robot's range.",
            metavar="REC",
            several=True,
        ),
    ] = ()
    held_out: Annotated[
        Sequence[Path],
        File(
            "Motion on which the written model is judged (MuJoCo). May be repeated. Default: what RESULT held"
            " out.",
            metavar="REC",
            several=True,
        ),
    ] = ()

    def load(self, progress: run.Progress) -> Loaded:
        from truing.files import load_recordings, load_residual_motion, load_robot

        file = self.result / "robot.yaml" if self.result.is_dir() else self.result
        if not file.exists():
            raise InputError(
                f"{file}: there is no such file: expected the folder that `truing dynamics diagnose` or"
                " `identify` wrote, or a robot.yaml"
            )
        robot = load_robot(file)
        residuals = self.result / "residuals.parquet"
        motion = load_residual_motion(residuals, robot) if residuals.exists() else []
        train = [recording for recording, held in motion if not held.all()]
        if self.recording:
            train = list(load_recordings(self.recording, robot))
        if self.held_out:
            given = load_recordings(self.held_out, robot)
            motion = [(recording, recording.time > -math.inf) for recording in given]
        return Loaded(robot, train, motion)

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
            return Found(exported, files, self._judged(loaded, exported, Path(folder), progress))

    def _judged(self, loaded: Loaded, exported: Exported, folder: Path, progress: run.Progress) -> Rollout:
        from truing.dynamics.export import export
        from truing.dynamics.rollout import Rollout, judge_written
        from truing.dynamics.runner import runnable
        from truing.files import load_robot

        if self.to == "isaaclab":
            return Rollout(None, "Isaac Lab is not here to run it")
        progress.now("simulating")
        if self.to == "mjcf":
            return judge_written(exported, None, loaded.held_out)
        if not any(held.any() for _, held in loaded.held_out):  # do not write two models for nothing
            return judge_written(exported, None, [])
        try:
            ours = export(loaded.robot, "mjcf", folder / "ours", recordings=loaded.recordings)
            written = load_robot(exported.model, any_tool=True)
            return judge_written(ours, runnable(export(written, "mjcf", folder / "urdf")), loaded.held_out)
        except InputError as error:
            return Rollout(None, str(error))

    def write(self, folder: Path, loaded: Loaded, found: Found, warnings: list[str]) -> Mapping[str, Any]:
        from truing.dynamics.result import write_export

        for name, text in found.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        return write_export(folder, loaded.robot, found.exported, self.to, found.rollout, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        lines = [
            (n["name"], "-" if n["size_Nm"] is None else f"{n['size_Nm']:.2g} Nm", n["reason"])
            for n in result["not_written"]
        ]
        if lines:
            table("what the model lacks", ("", "size", "why"), lines, words=True)
        motion = result["rollout"]
        if motion["why_not"]:
            say(f"not judged by motion: {motion['why_not']}")
        else:
            titles = ("with callbacks.py" if self.to == "mjcf" else "MJCF, callbacks.py", "as written")
            print_motion(result["robot"], motion, "held_out", titles)
        if "callbacks.py" in found.files:
            say(f"torques that MuJoCo has no field for: {self.out / 'callbacks.py'}")
        say(f"model: {self.out / result['model']}")
