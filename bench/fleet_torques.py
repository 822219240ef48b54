# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques of simulated fleets: which arms are named, how far parameters are from the truth, what is left.

python bench/fleet_torques.py SEED... [--arms 12] [--faults 2] [--seconds 40]
"""

from __future__ import annotations

import argparse
import tempfile
import time

import numpy as np

import truing
from truing.fleet import FleetDynamics
from truing.testing.fleet import TorqueFleet, save_torque_fleet, simulate_torque_fleet


def off_by(fleet: TorqueFleet, found: FleetDynamics, effect: str) -> np.ndarray:
    """What arms' own parameters of an effect differ from the truth by, in standard errors. What is common to
    all arms is the type's.
    """
    out = []
    for joint in fleet.nominal.joints:
        name = f"{effect}.{joint.name}"
        mine = [arm.parameter(name) for arm in found.arms.values()]
        apart = np.array(
            [p.value - fleet.own[a].get(name, 0.0) for a, p in zip(found.arms, mine, strict=True)]
        )
        out.append((apart - np.median(apart)) / [p.sigma for p in mine])
    return np.concatenate(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--arms", type=int, default=12)
    parser.add_argument("--faults", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=40.0)
    options = parser.parse_args()
    print(
        "| seed | faults named | others named | friction and offsets beyond 1.96 standard errors | motor"
        " gains beyond | held-out error as in the file, shared, own [%] | processor seconds |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for seed in options.seeds:
        fleet = simulate_torque_fleet(
            arms=options.arms, faults=options.faults, seconds=options.seconds, seed=seed
        )
        with tempfile.TemporaryDirectory() as folder:
            save_torque_fleet(folder, fleet)
            start = time.process_time()
            found = truing.fleet.dynamics(fleet.nominal, folder, workers=0)
            seconds = time.process_time() - start
        named = {(one.arm, one.parameter) for one in found.stands_out}
        right = named & set(fleet.faults.items())
        off = np.concatenate([off_by(fleet, found, e) for e in ("coulomb", "viscous", "current_offset")])
        gains = off_by(fleet, found, "motor_constant")
        errors = [
            np.mean([getattr(e, model) for e in found.errors]) for model in ("nominal", "shared", "own")
        ]
        print(
            f"| {seed} | {len(right)} of {len(fleet.faults)} | {len(named - right) or 'none'} |"
            f" {100 * np.mean(np.abs(off) > 1.96):.1f} % of {off.size} |"
            f" {100 * np.mean(np.abs(gains) > 1.96):.1f} % of {gains.size} |"
            f" {', '.join(f'{e:.1f}' for e in errors)} | {seconds:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
