# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An effect of one's own: the pedestal grows as the cell warms up.

Nothing in the catalogue says so. What acts where is all that has to be said: the site is the length
`shoulder_pan.d`, the basis the
temperature above 20 °C. The Jacobian follows by itself.
"""

import numpy as np

import truing
from truing.examples import example

GROWTH = 25e-6  # [m/K] of the true robot: about a metre of aluminium


def measured_while_warming_up(robot: truing.Robot) -> truing.Measurements:
    """A robot whose pedestal, upright in the measurement frame, grows: its target is measured that much
    higher.
    """
    data = truing.simulate(robot, poses=200, columns=["temp"], seed=2).data
    assert data.positions is not None and data.temperature is not None
    positions = np.array(data.positions)
    positions[:, 2] += GROWTH * (data.temperature - 20.0)
    return data.replace(positions=positions)


def main() -> None:
    robot = truing.load_robot(example("ur10"))
    data = measured_while_warming_up(robot)

    growth = truing.Effect("growth", site="shoulder_pan.d", basis=lambda d: d.temperature - 20.0, unit="m/K")
    without = truing.identify(robot, data)
    found = truing.identify(robot, data, effects=growth)

    assert without.test is not None and found.test is not None
    print(
        f"held-out error, mean: {1e3 * without.test.after.mean:.3f} mm without the effect,"
        f" {1e3 * found.test.after.mean:.3f} mm with it"
    )
    parameter = next(p for p in found.parameters if p.name == "growth.shoulder_pan.d")
    print(
        f"{parameter.name} = {1e6 * parameter.value:.2f} ± {1e6 * parameter.sigma:.2f} µm/K, hidden were"
        f" {1e6 * GROWTH:.2f}"
    )

    # The calibrated robot carries the effect's name and value; what it means has to be given again.
    predicted = truing.predict(found.robot, data, effects=growth)
    assert data.positions is not None
    error = np.linalg.norm(predicted.position - data.positions, axis=1)
    print(f"predicted again: {1e3 * error.mean():.3f} mm on average over all {len(data)} rows")


if __name__ == "__main__":
    main()
