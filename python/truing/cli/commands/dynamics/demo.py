# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnose a simulated arm with hidden effects on its torques, and compare with the truth.

Writes what `truing dynamics diagnose` writes, and nominal.yaml, truth.yaml, and the recordings as CSV.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truing.cli import run
from truing.cli.options import Seed
from truing.cli.tables import say, table

if TYPE_CHECKING:
    from truing.cli.commands.dynamics.diagnose import Answer
    from truing.testing.dynamics import SimulatedMotion

PANEL = "Dynamics"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["SimulatedMotion", "Answer"]):
    doing = "diagnosing"
    folder = "dynamics-demo"

    seed: Seed = 0

    def load(self, progress: run.Progress) -> SimulatedMotion:
        from truing.testing.dynamics import HIDDEN, NOISE, simulate_motion

        progress.now("simulating")
        simulated = simulate_motion(seed=self.seed)
        if not self.json:
            hidden = ", ".join(
                f"{name.replace('_', ' ')} at {'+'.join(j)}" for name, (j, _) in HIDDEN.items()
            )
            kept = sum(recording.test for recording in simulated.recordings)
            say("1. A six-joint arm is given friction, and effects that its model does not have:")
            say(f"   {hidden}.")
            say(
                f"2. It is recorded {len(simulated.recordings)} times, with noise of {100 * NOISE:g} % on the"
                f" torques; {kept} recordings are held out."
            )
            say("3. The torques are diagnosed from the model and the recordings alone.")
        return simulated

    def solve(self, loaded: SimulatedMotion, progress: run.Progress) -> Answer:
        from truing.cli.commands.dynamics.diagnose import Answer
        from truing.dynamics import diagnose, rollout

        found = diagnose(loaded.nominal, loaded.recordings)
        progress.now("simulating")
        return Answer(found, rollout(loaded.nominal, found, loaded.recordings))

    def write(
        self, folder: Path, loaded: SimulatedMotion, found: Answer, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics import check_recordings
        from truing.dynamics.result import recording_columns, write_diagnosis
        from truing.files import save_robot, write_table

        sanity = check_recordings(loaded.nominal, loaded.recordings).findings
        result = write_diagnosis(
            folder, found.found, loaded.recordings, found.rollout, sanity=sanity, warnings=warnings
        )
        save_robot(folder / "nominal.yaml", loaded.nominal)
        save_robot(folder / "truth.yaml", loaded.truth)
        for recording in loaded.recordings:
            write_table(folder / f"{recording.name}.csv", recording_columns(loaded.nominal, recording))
        return result

    def failure(self, result: Mapping[str, Any]) -> str:
        if result["verdict"] != "does_not_hold":
            return ""
        return "what was found does not hold on recordings that it was not fitted to"

    def table(self, result: Mapping[str, Any], found: Answer) -> None:
        from truing.cli.commands.dynamics.diagnose import print_diagnosis
        from truing.testing.dynamics import HIDDEN

        print_diagnosis(result)
        values = {p["name"]: p for effect in result["effects"] for p in effect["parameters"]}
        lines = []
        for _, hidden in HIDDEN.values():
            for name, value in hidden.items():
                p = values.get(name)
                shown = (
                    ("not named", "") if p is None else (f"{p['value']:.4g}", f"± {p['sigma'] or 0.0:.2g}")
                )
                lines.append((name, f"{value:.4g}", *shown))
        head = ("parameter", "hidden", "found", "standard error")
        table("hidden effects, and what was found", head, lines)
