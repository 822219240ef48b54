# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write what was found as a simulator's model, and list what could not be written.

Writes the model (MJCF and perhaps callbacks.py; URDF; URDF and actuators.py; zeros for LeRobot),
not_written.yaml, result.json, report.html: how far the model, as it is written, is from held-out motion.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
    from truing.dynamics.servo.export import ServoExported, ServoResult
    from truing.model import Robot

PANEL = "Dynamics"


@dataclass(frozen=True)
class Loaded:
    robot: Robot
    recordings: list[Recording]
    held_out: list[tuple[Recording, NDArray[np.bool_]]]  # and which of their rows
    cutoff: float | None  # [Hz] that the robot was fitted with


@dataclass(frozen=True)
class LoadedServo:
    """A diagnosis from commands, and recordings with which of their rows were held out."""

    result: ServoResult
    training: list[Recording]
    held_out: list[tuple[Recording, NDArray[np.bool_]]]


@dataclass(frozen=True)
class Found:
    exported: Exported | ServoExported
    files: dict[str, str]  # text by name
    rollout: Rollout


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Loaded | LoadedServo", Found]):
    doing = "writing"
    sometimes = ("callbacks.py", "callbacks.xml", "actuators.py", "offsets.json")

    result: Annotated[
        Path,
        File(
            "Folder of `truing dynamics diagnose` or `identify`, or a robot.yaml.",
            argument=True,
            metavar="RESULT",
        ),
    ]
    to: Annotated[
        Literal["mjcf", "urdf", "isaaclab", "lerobot"],
        Choice("Format; lerobot (zeros) of a diagnosis from commands alone."),
    ] = "mjcf"
    source: Annotated[
        Path | None,
        File(
            "File that the robot was read from, whose meshes and names are kept: a URDF, not for mjcf; of a"
            " diagnosis from commands the MJCF.",
            metavar="ROBOT",
        ),
    ] = None
    calibration: Annotated[
        Path | None,
        File("Of lerobot: the JSON that the arm was recorded with.", metavar="FILE.json"),
    ] = None
    recording: Annotated[
        Sequence[Path],
        File(
            "What the robot was fitted to: on it sizes of what is not written are stated, and friction and"
            " bodies are fitted anew without that. May be repeated. Default: what RESULT was fitted to; of a"
            " robot.yaml a motion through the robot's range.",
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

    def load(self, progress: run.Progress) -> Loaded | LoadedServo:
        from truing.cli.reading import load_robot
        from truing.dynamics.export.refit import training
        from truing.dynamics.servo.export import is_servo_result
        from truing.files import load_recordings, load_residual_motion

        if is_servo_result(self.result):
            return self._load_servo()
        if self.to == "lerobot":
            raise InputError("--to lerobot: expected the result of a diagnosis from commands alone")

        file = self.result / "robot.yaml" if self.result.is_dir() else self.result
        if not file.exists():
            raise InputError(
                f"{file}: there is no such file: expected the folder that `truing dynamics diagnose` or"
                " `identify` wrote, or a robot.yaml"
            )
        robot = load_robot(file, torques=True)
        residuals = self.result / "residuals.parquet"
        motion = load_residual_motion(residuals, robot) if residuals.exists() else []
        train = training(motion)
        if self.recording:
            train = list(load_recordings(self.recording, robot))
        if self.held_out:
            given = load_recordings(self.held_out, robot)
            motion = [(recording, recording.time > -math.inf) for recording in given]
        return Loaded(robot, train, motion, _cutoff(self.result / "result.json"))

    def _load_servo(self) -> LoadedServo:
        from truing.dynamics.export.refit import training as rows_not_held
        from truing.dynamics.servo.export import MODEL, MOTION, load_servo_result
        from truing.files import load_commanded_motion, load_recordings, load_robot

        result = load_servo_result(self.result)
        motion = self.result / MOTION
        rows = load_commanded_motion(motion, result.chains["named"].prismatic) if motion.exists() else []
        training = rows_not_held(rows)
        if self.recording or self.held_out:
            arm = load_robot(self.result / MODEL, any_tool=True)
            if self.recording:
                training = list(load_recordings(self.recording, arm))
            if self.held_out:
                rows = [(r, r.time > -math.inf) for r in load_recordings(self.held_out, arm)]
        return LoadedServo(result, training, rows)

    def _solve_servo(self, loaded: LoadedServo, progress: run.Progress) -> Found:
        from truing.dynamics.rollout import Rollout
        from truing.dynamics.servo.export import export_servo
        from truing.dynamics.servo.export.verified import judge_servo

        result = loaded.result
        chain = result.chains["named"]
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "model"
            exported = export_servo(
                chain,
                self.to,
                out,
                source=self.source or result.mjcf,
                recordings=loaded.training,
                used=[recording for recording, held in loaded.held_out if held.any()],
                calibration=self.calibration,
            )
            files = {path.name: path.read_text(encoding="utf-8") for path in out.iterdir()}
            if self.to != "mjcf":
                return Found(exported, files, Rollout(None, f"{self.to} is not run here"))
            progress.now("simulating")
            models = {"exported": out / exported.model}
            if self.source is not None:
                models = {"nominal": self.source, **models}
            return Found(
                exported, files, judge_servo(models, result.joints, loaded.held_out, (chain, result.mjcf))
            )

    def solve(self, loaded: Loaded | LoadedServo, progress: run.Progress) -> Found:
        from truing.dynamics.export import export

        if isinstance(loaded, LoadedServo):
            return self._solve_servo(loaded, progress)
        if self.to == "lerobot":
            raise InputError("--to lerobot: expected the result of a diagnosis from commands alone")
        with tempfile.TemporaryDirectory() as folder:
            exported = export(
                loaded.robot,
                self.to,
                Path(folder) / "model",
                source=self.source,
                recordings=loaded.recordings,
                cutoff=loaded.cutoff,
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
            ours = export(
                loaded.robot, "mjcf", folder / "ours", recordings=loaded.recordings, cutoff=loaded.cutoff
            )
            written = load_robot(exported.model, any_tool=True)
            judged = judge_written(ours, runnable(export(written, "mjcf", folder / "urdf")), loaded.held_out)
            return replace(judged, refitted=exported.refitted)
        except InputError as error:
            return Rollout(None, str(error))

    def write(
        self, folder: Path, loaded: Loaded | LoadedServo, found: Found, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_export, write_servo_export
        from truing.dynamics.sanity.untold import untold_load
        from truing.dynamics.servo.export import ServoExported

        for name, text in found.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        exported = found.exported
        if isinstance(loaded, LoadedServo):
            name = loaded.result.robot
            return write_servo_export(folder, name, exported, self.to, found.rollout, warnings=warnings)
        assert not isinstance(exported, ServoExported)
        if self.held_out:
            said = (untold_load(loaded.robot, recording) for recording, _ in loaded.held_out)
            warnings = [*warnings, *(text for text in said if text)]
        return write_export(folder, loaded.robot, exported, self.to, found.rollout, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        lines = [
            (n["name"], "-" if n["size_Nm"] is None else f"{n['size_Nm']:.2g} Nm", n["reason"])
            for n in result["not_written"]
        ]
        if lines:
            table("what the model lacks", ("", "size", "why"), lines, words=True)
        for text in result.get("notes", ()):
            say(text)
        motion = result["rollout"]
        if motion["why_not"]:
            say(f"not judged by motion: {motion['why_not']}")
        else:
            ours = "with callbacks.py" if self.to == "mjcf" else "MJCF, callbacks.py"
            ours = "all laws" if result.get("driven_by") == "commands" else ours
            words = {"nominal": "as it was", "named": ours, "exported": "as written"}
            titles = [words[model] for model in motion["held_out"]]
            print_motion(result["robot"], motion, "held_out", titles)
        if "callbacks.py" in found.files:
            model = f", for {self.out / 'callbacks.xml'}" if "callbacks.xml" in found.files else ""
            say(f"torques that MuJoCo has no field for: {self.out / 'callbacks.py'}{model}")
        say(f"model: {self.out / result['model']}")


def _cutoff(file: Path) -> float | None:
    """[Hz] that a diagnosis or fit says in its result.json; None where it says none."""
    if not file.exists():
        return None
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from None
    cutoff = said.get("cutoff_hz") if isinstance(said, dict) else None
    return float(cutoff) if isinstance(cutoff, int | float) and cutoff > 0.0 else None
