# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A calibration from end to end on a simulated palletizer, checked against the truth that only a simulation
has.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

import truing
from truing.examples import PALLETIZER_FREE, PALLETIZER_MODEL, example
from truing.files import atomic_output_dir, save_measurements, save_robot, write_table
from truing.testing.simulation import Truth, random_joints, simulate

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Result = TypeVar("Result")


POSES = 120
FRESH_POSES = 1000
NOISE = 3e-5  # [m] of one coordinate, a laser tracker's
BACKLASH = 4e-4  # [rad] at J3


class Busy(Protocol):
    """Runs work under a progress bar with that name."""

    def __call__(self, what: str, work: Callable[[], Result]) -> Result: ...


def run(out: Path, *, seed: int, busy: Busy, console: Console) -> dict[str, Any]:
    """Runs the demo, writes all of its files to `out`, and returns what result.json holds. The last line said
    is the report's path.
    """
    from rich import box
    from rich.table import Table

    from truing.identification.result import write_identification
    from truing.report.json_text import to_json

    nominal = truing.load_robot(example("palletizer"))

    def say(text: str) -> None:
        console.print(text, soft_wrap=True, markup=False)

    say(
        f"1. A palletizer gets hidden errors in the {len(PALLETIZER_MODEL)} values of its model (1 mm, 1"
        " mrad, 0.1 % in the gears), and backlash at J3."
    )
    say(f"2. {POSES} poses are planned that show such errors well, 15 degrees or more apart at every joint.")
    planned = busy(
        "planning",
        lambda: truing.plan(nominal, poses=POSES, seed=seed, free=PALLETIZER_FREE, position_sigma=NOISE),
    )
    say(
        f"3. They are measured, with {NOISE * 1e3:g} mm noise on every coordinate and 2 % gross outliers of"
        " 5 mm."
    )
    simulated = simulate(
        nominal,
        joints=planned.joints,
        effects={"backlash.J3": BACKLASH},
        noise=NOISE,
        ratios=1e-3,
        only=PALLETIZER_MODEL,
        outlier_share=0.02,
        outlier_length=5e-3,
        base_unknown=True,
        seed=seed,
    )
    say("4. The robot is identified from the measurements alone.")
    found = busy(
        "identifying",
        lambda: truing.identify(
            nominal, simulated.data, free=PALLETIZER_FREE, effects="backlash:J3", seed=seed
        ),
    )

    # The judge: noise-free poses that nobody has seen, of the true robot.
    fresh = random_joints(nominal, FRESH_POSES, seed + 1)
    directions = np.random.default_rng([seed, 9]).choice([-1.0, 1.0], size=fresh.shape)
    judge = truing.Measurements(fresh, directions=directions)
    true_positions = np.asarray(truing.predict(simulated.truth.robot, judge).position)
    before, after = (
        np.linalg.norm(truing.predict(robot, judge).position - true_positions, axis=1)
        for robot in (found.before, found.robot)
    )

    with atomic_output_dir(out) as folder:
        write_identification(folder, found, simulated.data, seed=seed, source="measurements.csv")
        save_robot(folder / "nominal.yaml", nominal)
        save_robot(folder / "true_robot.yaml", simulated.truth.robot)
        save_measurements(folder / "measurements.csv", simulated.data, nominal)
        write_table(
            folder / "poses.csv",
            {f"q{k + 1}_rad": planned.joints[:, k] for k in range(planned.joints.shape[1])},
        )
        truth = simulated.to_dict()
        truth["fresh_poses"] = {
            "n": FRESH_POSES,
            "before_mean_m": float(before.mean()),
            "after_mean_m": float(after.mean()),
            "before_max_m": float(before.max()),
            "after_max_m": float(after.max()),
        }
        (folder / "truth.json").write_text(to_json(truth), encoding="utf-8")

    table = Table(
        title=f"error against the truth, {FRESH_POSES} fresh poses", title_justify="left", box=box.SIMPLE_HEAD
    )
    for heading in ("", "before", "after"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, of in (("mean", np.mean), ("95 %", lambda e: np.quantile(e, 0.95)), ("worst", np.max)):
        table.add_row(name, f"{float(of(before)) * 1e3:.3f} mm", f"{float(of(after)) * 1e3:.3f} mm")
    console.print(table)
    console.print(_compared(simulated.truth, found))
    assert found.set is not None
    fitted = {row for row in simulated.outlier_rows if found.set[row] == 0}
    caught = fitted & set(found.rejected_rows)
    held_out = len(simulated.outlier_rows) - len(fitted)
    say(
        f"{len(caught)} of {len(fitted)} gross outliers among the fitted rows were found and left out, and"
        f" {len(found.rejected_rows) - len(caught)} good rows with them."
        + (f" {held_out} more among the held-out rows: the report points at them." if held_out else "")
    )
    say(f"report: {out / 'report.html'}")
    return truth


def _compared(truth: Truth, found: truing.identification.Identification) -> Table:
    """The hidden errors and what was found of them, for parameters that the data can see by themselves."""
    from rich import box
    from rich.table import Table

    hidden = {name: (true - nominal, unit) for name, (nominal, true, unit) in truth.parameters.items()}
    hidden.update({effect.parameter: (effect.value, "rad") for effect in truth.effects})
    tied = {
        name for frozen in found.frozen for name, weight in frozen.combination.items() if abs(weight) > 1e-6
    }
    table = Table(title="hidden errors, and what was found", title_justify="left", box=box.SIMPLE_HEAD)
    for heading in ("parameter", "hidden", "found", "standard error", ""):
        table.add_column(heading, justify="left" if heading in ("parameter", "") else "right")
    for p in found.parameters:
        if p.frozen or p.name in tied or p.name not in hidden:
            continue
        error, unit = hidden[p.name]
        scale, shown = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(unit, (1e3, "‰"))
        table.add_row(
            p.name,
            f"{error * scale:+.3f}",
            f"{(p.value - p.nominal) * scale:+.3f}",
            f"± {p.sigma * scale:.3f}",
            shown,
        )
    return table
