# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""From two files, a robot and its measurements, to a calibrated robot file.

The measurements are simulated here, so that the example runs by itself; with your own, only `calibrate`
counts.
"""

import tempfile
from pathlib import Path

import truing
from truing.examples import example


def simulate_files(folder: Path) -> None:
    """Writes robot.yaml, and measurements.csv of a robot that differs from it."""
    robot = truing.load_robot(example("irb120"))
    simulated = truing.simulate(robot, poses=150, base_unknown=True, outlier_share=0.02, seed=4)
    truing.save_robot(folder / "robot.yaml", robot)
    truing.save_measurements(folder / "measurements.csv", simulated.data, robot)


def calibrate(folder: Path) -> truing.identification.Identification:
    robot = truing.load_robot(folder / "robot.yaml")
    data = truing.load_measurements(folder / "measurements.csv", robot)
    found = truing.identify(robot, data)
    truing.save_robot(folder / "calibrated.yaml", found.robot)
    return found


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        simulate_files(Path(name))
        found = calibrate(Path(name))
        written = (Path(name) / "calibrated.yaml").read_text(encoding="utf-8")

    assert found.test is not None  # rows are held out unless test_share=0 is asked for
    before, after = found.test.before, found.test.after
    print(
        f"held-out error, mean: {1e3 * before.mean:.3f} mm before, {1e3 * after.mean:.3f} mm after ({after.n}"
        " rows)"
    )
    print(
        f"{found.rank} of {found.columns} parameters found, {len(found.rejected_rows)} gross outliers left"
        f" out, noise {1e3 * found.noise_sigma:.3f} mm per axis"
    )
    for parameter in [p for p in found.parameters if not p.frozen and not p.name.startswith("base.")][:5]:
        print(
            f"  {parameter.name:10} {parameter.value - parameter.nominal:+.6f} ± {parameter.sigma:.6f}"
            f" {parameter.unit}"
        )
    print("the calibrated robot begins:", written.splitlines()[0])


if __name__ == "__main__":
    main()
