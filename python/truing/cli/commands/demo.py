# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Calibrate an example robot with hidden errors, and check what was found against the truth.

Writes what `truing identify` writes, and nominal.yaml, true_robot.yaml, measurements.csv, poses.csv,
truth.json.
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
    from numpy.typing import NDArray

    from truing.identification import Identification
    from truing.model import Robot
    from truing.planning import PlanResult
    from truing.testing.simulation import Simulation

PANEL = "Try out"

POSES = 120
FRESH_POSES = 1000
NOISE = 3e-5  # [m] of one coordinate, a laser tracker's
BACKLASH = 4e-4  # [rad] at J3
RATIO_ERROR = 1e-3
OUTLIER_FRACTION, OUTLIER_LENGTH = 0.02, 5e-3  # [m]


@dataclass(frozen=True)
class Found:
    planned: PlanResult
    simulated: Simulation
    identified: Identification
    before: NDArray[Any]  # [m] errors of fresh poses against the truth
    after: NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Robot", Found]):
    doing = "calibrating"
    folder = "demo"

    seed: Seed = 0

    def load(self, progress: run.Progress) -> Robot:
        import truing
        from truing.examples import PALLETIZER_MODEL, example

        if not self.json:
            say(
                f"1. A palletizer gets hidden errors in the {len(PALLETIZER_MODEL)} values of its model (1"
                " mm, 1 mrad, 0.1 % in the gears), and backlash at J3."
            )
            say(
                f"2. {POSES} poses are planned that show such errors well, 15 degrees or more apart at every"
                " joint."
            )
            say(
                f"3. They are measured, with {NOISE * 1e3:g} mm noise on every coordinate and"
                f" {100 * OUTLIER_FRACTION:g} % gross outliers of {1e3 * OUTLIER_LENGTH:g} mm."
            )
            say("4. The robot is identified from the measurements alone.")
        return truing.load_robot(example("palletizer"))

    def solve(self, loaded: Robot, progress: run.Progress) -> Found:
        import truing
        from truing.examples import PALLETIZER_FREE, PALLETIZER_MODEL

        progress.now("planning")
        planned = truing.plan(loaded, poses=POSES, seed=self.seed, free=PALLETIZER_FREE, position_sigma=NOISE)
        simulated = truing.simulate(
            loaded,
            joints=planned.joints,
            effects={"backlash.J3": BACKLASH},
            noise=NOISE,
            ratios=RATIO_ERROR,
            only=PALLETIZER_MODEL,
            outlier_share=OUTLIER_FRACTION,
            outlier_length=OUTLIER_LENGTH,
            base_unknown=True,
            seed=self.seed,
        )
        progress.now("identifying")
        identified = truing.identify(
            loaded, simulated.data, free=PALLETIZER_FREE, effects="backlash:J3", seed=self.seed
        )
        before, after = judged(loaded, simulated, identified, self.seed)
        return Found(planned, simulated, identified, before, after)

    def write(self, folder: Path, loaded: Robot, found: Found, warnings: list[str]) -> Mapping[str, Any]:
        from truing.files import save_measurements, save_robot, write_table
        from truing.files.common import joint_columns
        from truing.identification.result import write_identification
        from truing.report.json_text import to_json

        write_identification(
            folder, found.identified, found.simulated.data, seed=self.seed, source="measurements.csv"
        )
        save_robot(folder / "nominal.yaml", loaded)
        save_robot(folder / "true_robot.yaml", found.simulated.truth.robot)
        save_measurements(folder / "measurements.csv", found.simulated.data, loaded)
        write_table(folder / "poses.csv", joint_columns(loaded, found.planned.joints))
        truth = found.simulated.to_dict()
        truth["fresh_poses"] = {
            "n": FRESH_POSES,
            "before_mean_m": float(found.before.mean()),
            "after_mean_m": float(found.after.mean()),
            "before_max_m": float(found.before.max()),
            "after_max_m": float(found.after.max()),
        }
        (folder / "truth.json").write_text(to_json(truth), encoding="utf-8")
        return truth

    def table(self, result: Mapping[str, Any], found: Found) -> None:
        import numpy as np

        lines = [
            (
                name,
                *(
                    f"{float(np.quantile(errors, level)) * 1e3:.3f} mm"
                    for errors in (found.before, found.after)
                ),
            )
            for name, level in (("95 %", 0.95), ("maximum", 1.0))
        ]
        lines.insert(0, ("mean", *(f"{float(np.mean(e)) * 1e3:.3f} mm" for e in (found.before, found.after))))
        table(f"error against the truth, {FRESH_POSES} fresh poses", ("", "before", "after"), lines)
        head = ("parameter", "hidden", "found", "standard error", "")
        table("hidden errors, and what was found", head, compared(found))
        print_outliers(found)


def judged(
    nominal: Robot, simulated: Simulation, identified: Identification, seed: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Errors before and after at noise-free poses of the true robot that nobody has seen [m]."""
    import numpy as np

    import truing
    from truing.testing.simulation import random_joints

    fresh = random_joints(nominal, FRESH_POSES, seed + 1)
    directions = np.random.default_rng([seed, 9]).choice([-1.0, 1.0], size=fresh.shape)
    judge = truing.Measurements(fresh, directions=directions)
    true, before, after = (
        np.asarray(truing.predict(robot, judge).position)
        for robot in (simulated.truth.robot, identified.before, identified.robot)
    )
    return np.linalg.norm(before - true, axis=1), np.linalg.norm(after - true, axis=1)


def compared(found: Found) -> list[tuple[str, ...]]:
    """The hidden errors and what was found of them, for parameters that the data can see by themselves."""
    truth, identified = found.simulated.truth, found.identified
    hidden = {name: (true - nominal, unit) for name, (nominal, true, unit) in truth.parameters.items()}
    hidden.update({effect.parameter: (effect.value, "rad") for effect in truth.effects})
    tied = {
        name
        for frozen in identified.frozen
        for name, weight in frozen.combination.items()
        if abs(weight) > 1e-6
    }
    lines: list[tuple[str, ...]] = []
    for p in identified.parameters:
        if p.frozen or p.name in tied or p.name not in hidden:
            continue
        error, unit = hidden[p.name]
        scale, shown = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(unit, (1e3, "‰"))
        change = (p.value - p.nominal) * scale
        lines.append((p.name, f"{error * scale:+.3f}", f"{change:+.3f}", f"± {p.sigma * scale:.3f}", shown))
    return lines


def print_outliers(found: Found) -> None:
    identified, outliers = found.identified, found.simulated.outlier_rows
    assert identified.set is not None
    fitted = {row for row in outliers if identified.set[row] == 0}
    caught = fitted & set(identified.rejected_rows)
    held_out = len(outliers) - len(fitted)
    more = f" {held_out} more among the held-out rows: the report points at them." if held_out else ""
    say(
        f"{len(caught)} of {len(fitted)} gross outliers among the fitted rows were found and rejected, and"
        f" {len(identified.rejected_rows) - len(caught)} good rows with them.{more}"
    )
