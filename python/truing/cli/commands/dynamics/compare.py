# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Compare two simulator models on the same recordings: which is nearer to the robot, and at which joints.

Where some recordings are marked as test, only these count. Both models run in MuJoCo from measured states,
driven by the measured torques; where the recordings have commands alone, by these, through the models' own
actuators. Writes result.json, report.html. Exits with 1 where MODEL_B is worse than MODEL_A by more than
--margin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import File, Fraction, Seed, keyword
from truing.cli.recordings import ReadMotion, RecordingFiles, with_sound_commands
from truing.cli.tables import say, table

if TYPE_CHECKING:
    from truing.dynamics import Recording
    from truing.dynamics.comparison import Comparison
    from truing.model import Robot

PANEL = "Dynamics"


def model_file(which: str) -> File:
    return File(f"{which}: MJCF, which runs as it is, URDF or robot.yaml.", argument=True, metavar=which)


@dataclass(frozen=True)
class Loaded:
    a: Robot
    b: Robot
    recordings: Sequence[Recording]


@dataclass(frozen=True, kw_only=True)
class Command(ReadMotion, run.Command[Loaded, "Comparison"]):
    doing = "simulating"

    model_a: Annotated[Path, model_file("MODEL_A")]
    model_b: Annotated[Path, model_file("MODEL_B")]
    recordings: RecordingFiles
    margin: Annotated[float, Fraction("By which errors of MODEL_B may be larger than those of MODEL_A.")] = (
        keyword("truing.dynamics.comparison:compare", "margin")
    )
    seed: Seed = 0

    def load(self, progress: run.Progress) -> Loaded:
        a, b = self.read_robot(self.model_a), self.read_robot(self.model_b)
        recordings = with_sound_commands(a, self.read_recordings(a, self.recordings))
        held = [recording for recording in recordings if recording.test]
        return Loaded(a, b, held or recordings)

    def solve(self, loaded: Loaded, progress: run.Progress) -> Comparison:
        from truing.dynamics.commanded import command_kind, commanded_mjcf
        from truing.dynamics.comparison import compare
        from truing.dynamics.runner import simulator_of

        files = ((self.model_a, loaded.a), (self.model_b, loaded.b))
        kind = command_kind(loaded.recordings)
        a, b = (simulator_of(*f) if kind is None else commanded_mjcf(*f, kind) for f in files)
        return compare(a, b, loaded.recordings, margin=self.margin, seed=self.seed)

    def write(
        self, folder: Path, loaded: Loaded, found: Comparison, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.result import write_comparison

        names = (self.model_a.name, self.model_b.name)
        if names[0] == names[1]:
            names = (str(self.model_a), str(self.model_b))
        return write_comparison(folder, found, names, warnings=warnings)

    def failure(self, result: Mapping[str, Any]) -> str:
        if not result["worse"]:
            return ""
        margin, what = f"{100 * self.margin:g} %", ", ".join(result["worse"])
        return f"MODEL_B is worse than MODEL_A by more than {margin}: {what}"

    def table(self, result: Mapping[str, Any], found: Comparison) -> None:
        from truing.dynamics.comparison.page import interval, joint_lines
        from truing.dynamics.rollout.page import main_horizon

        say(result["sentence"])
        main = main_horizon(result["rollout"]["horizon_s"])
        head, lines = joint_lines(result, [main])
        of = "torque in % of its standard deviation, " if result["torque"] else ""
        table(f"rms errors of A and B: {of}motion", head, lines)
        ratios = [(r["of"], f"{r['B_over_A']:.3g}", interval(r)) for r in result["ratios"]]
        table("error of B over that of A, mean over the joints", ("", "ratio", "90 % interval"), ratios)
