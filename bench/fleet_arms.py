# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses simulated fleets: which arms are named, and how far parameters are from the truth.

python bench/fleet_arms.py SEED... [--arms 200] [--poses 100] [--faults 5]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterable

import truing
from truing.examples import example
from truing.fleet import FleetParameter
from truing.testing.fleet import save_fleet, simulate_fleet


def standardised(found: Iterable[FleetParameter], true: dict[str, float]) -> list[float]:
    """Differences from the truth in standard errors, of those that are known and not held."""
    return [abs(p.value - true[p.name]) / p.sigma for p in found if p.name in true and not p.frozen]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--poses", type=int, default=100)
    parser.add_argument("--faults", type=int, default=5)
    options = parser.parse_args()
    robot = truing.load_robot(example("ur10"))
    for seed in options.seeds:
        fleet = simulate_fleet(
            robot, arms=options.arms, poses=options.poses, faults=options.faults, seed=seed
        )
        with tempfile.TemporaryDirectory() as folder:
            save_fleet(folder, fleet, robot)
            start = time.process_time()
            diagnosis = truing.fleet.diagnose(robot, folder, workers=0)
            seconds = time.process_time() - start
        named = {name: (e[0].effect, ",".join(e[0].joints)) for name, e in diagnosis.of_arms.items()}
        right = sum(named.get(name) == fault for name, fault in fleet.faults.items())
        more = sorted(set(named) - set(fleet.faults))
        found = diagnosis.identification
        shared = standardised(
            found.parameters, {name: value for name, (_, value, _) in fleet.type_of.parameters.items()}
        )
        zeros = [
            off
            for name, arm in fleet.arms.items()
            for off in standardised(
                [p for p in found.arms[name].parameters if p.name.endswith(".offset")],
                {key: value for key, (_, value, _) in arm.truth.parameters.items()},
            )
        ]
        inside, outside = sum(off < 2 for off in shared), sum(off > 1.96 for off in zeros)
        print(f"seed {seed}: {seconds:.1f} processor seconds")
        print(f"  {right} of {len(fleet.faults)} faults named with effect and joint; others named: {more}")
        print(f"  {inside} of {len(shared)} shared parameters within two standard errors")
        print(f"  {outside} of {len(zeros)} own zeros beyond 1.96 standard errors", flush=True)


if __name__ == "__main__":
    main()
