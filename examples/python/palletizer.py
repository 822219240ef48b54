# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Plan, measure, identify: a palletizer with its 18 parameters.

Four driven joints and a linkage that keeps the wrist level (J4 follows J2 and J3). The parameters are lengths
and offsets of the
links, gear ratios, joint zeros and the tool. Where the robot stands is found along with them.
"""

import numpy as np

import truing
from truing.examples import PALLETIZER_FREE, PALLETIZER_MODEL, example


def main() -> None:
    nominal = truing.load_robot(example("palletizer"))

    # Where to measure, so that the parameters show; every joint moves by 15 degrees or more from pose to
    # pose.
    planned = truing.plan(nominal, poses=60, free=PALLETIZER_FREE, position_sigma=3e-5)
    promised = {p.name: p.sigma for p in planned.parameters if not p.frozen}

    # Instead of a laser tracker: a robot with errors in exactly these 18 values, somewhere in the measurement
    # frame.
    simulated = truing.simulate(
        nominal,
        joints=planned.joints,
        only=PALLETIZER_MODEL,
        ratios=1e-3,
        base_unknown=True,
        noise=3e-5,
        seed=7,
    )

    found = truing.identify(nominal, simulated.data, free=PALLETIZER_FREE)
    print(
        f"{found.rank} of {found.columns} parameters can be seen, after {found.solver.iterations} iterations"
        f" ({found.solver.stopped_because})"
    )
    print("held at nominal, because others stand for them:", ", ".join(f.parameter for f in found.frozen))

    tied = {
        name for frozen in found.frozen for name, weight in frozen.combination.items() if abs(weight) > 1e-6
    }
    print(f"{'parameter':10} {'hidden':>11} {'found':>11} {'sigma':>10} {'promised':>10}")
    for p in found.parameters:
        if p.name in simulated.truth.parameters and p.name not in tied:
            nominal_value, true_value, unit = simulated.truth.parameters[p.name]
            print(
                f"{p.name:10} {true_value - nominal_value:+11.6f} {p.value - p.nominal:+11.6f}"
                f" {p.sigma:10.6f} {promised[p.name]:10.6f} {unit}"
            )

    # The judge: poses that nobody measured, of the robot that only a simulation knows.
    fresh = truing.simulate(nominal, poses=500, seed=8).data.joints
    judge = truing.Measurements(fresh)
    truth = truing.predict(simulated.truth.robot, judge).position
    for name, robot in (("before", found.before), ("after", found.robot)):
        error = np.linalg.norm(truing.predict(robot, judge).position - truth, axis=1)
        print(
            f"{name:6} mean {1e3 * error.mean():.4f} mm, worst {1e3 * error.max():.4f} mm over {len(fresh)}"
            " fresh poses"
        )


if __name__ == "__main__":
    main()
