# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Times the diagnosis of simulated sets, small and large, and prints a table.

    python bench/diagnose.py [--repeats 3]

A UR10 with wrong link values, backlash at the shoulder and a harmonic at the elbow; all columns (directions,
payload, temperature, time).
"""

from __future__ import annotations

import argparse
import resource
import time

import truing
from truing.examples import example
from truing.testing.simulation import simulate

POSES = (300, 3000, 100_000)
HIDDEN = {"backlash.shoulder_lift": 3e-4, "harmonic.elbow.cos1": 2e-4}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    robot = truing.load_robot(str(example("ur10")))
    print("| poses | seconds, best | of all | peak memory [MB] | named |\n| --- | --- | --- | --- | --- |")
    for poses in POSES:
        data = simulate(
            robot, poses=poses, effects=HIDDEN, columns=("dir", "payload", "temp", "t"), seed=1
        ).data
        seconds = []
        for _ in range(arguments.repeats):
            started = time.perf_counter()
            found = truing.diagnose(robot, data)
            seconds.append(time.perf_counter() - started)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        named = ", ".join(
            " ".join([effect.effect, *effect.joints[:1]]) if len(effect.joints) == 1 else effect.effect
            for effect in found.effects
        )
        print(
            f"| {poses} | {min(seconds):.2f} | {' '.join(f'{s:.2f}' for s in seconds)} | {memory:.0f} |"
            f" {named} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
