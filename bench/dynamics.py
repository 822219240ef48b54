# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The torque regressor beside Pinocchio's from Python, on the same states: figures of both for bench/run.py.
And a diagnosis of ten minutes at 500 Hz.

    python bench/dynamics.py build/release/bench/bench_dynamics

Pinocchio's torques are compared with those that the program wrote before anything is timed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import dynamics_stream as stream
import numpy as np

import truing
from truing.testing.dynamics import NOISE, simulate_motion

# The arm of bench/dynamics.cpp: modified DH alpha, a, d.
UR10 = [
    (0, 0, 0.1273),
    (np.pi / 2, 0, 0),
    (0, -0.612, 0),
    (0, -0.5723, 0.163941),
    (np.pi / 2, 0, 0.1157),
    (-np.pi / 2, 0, 0.0922),
]


def pinocchio_samples_per_second(states: Path) -> float | None:
    """None where Pinocchio is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model, parent = pin.Model(), 0
    for k, (alpha, a, d) in enumerate(UR10):
        # The sum along z commutes with the motion about it.
        turned = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, 0.0]))
        placement = turned * pin.SE3(np.eye(3), np.array([0.0, 0.0, d]))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"J{k + 1}")
        inertia = pin.Inertia(8.0 - k, np.array([0.1, 0.02 * k, -0.05]), np.diag([0.04, 0.05, 0.06]))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    data = model.createData()
    table = np.loadtxt(states)
    q, qd, qdd, torque = (np.ascontiguousarray(part) for part in np.split(table, 4, axis=1))
    theirs = np.array([pin.rnea(model, data, *state) for state in zip(q, qd, qdd, strict=True)])
    if not np.allclose(theirs, torque, rtol=0, atol=1e-10 * float(np.abs(torque).max())):
        raise SystemExit("Pinocchio's arm is not that of bench/dynamics.cpp")
    best = float("inf")
    for _ in range(20):
        start = time.perf_counter()
        for state in zip(q, qd, qdd, strict=True):
            pin.computeJointTorqueRegressor(model, data, *state)
        best = min(best, time.perf_counter() - start)
    return len(q) / best


def figures(program: Path) -> dict[str, Any]:
    """Of bench_dynamics by name, and `pinocchio` from the same run (None: not installed)."""
    with tempfile.TemporaryDirectory() as folder:
        states = Path(folder) / "states.txt"
        done = subprocess.run([str(program), str(states)], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{program} failed:\n{done.stderr}")
        out = {row["name"]: row["value"] for row in map(json.loads, done.stdout.splitlines())}
        out["pinocchio"] = pinocchio_samples_per_second(states)
    return out


def ten_minutes() -> tuple[float, float]:
    """Seconds by the clock and of the processor that one recording of ten minutes takes, in memory."""
    random = np.random.default_rng(1)
    arm = simulate_motion(recordings=1, held_out=0)
    ((q, torque),) = stream.motions(arm.truth, random, 1)
    noisy = torque + stream.noise_of(*torque.shape, random) * NOISE * torque.std(axis=0)
    t = np.arange(len(q)) * stream.STEP
    recording = truing.dynamics.Recording("motion", time=t, position=q, torque=noisy)
    clock, processor = time.perf_counter(), time.process_time()
    truing.dynamics.diagnose(arm.nominal, [recording])
    return time.perf_counter() - clock, time.process_time() - processor


def main() -> None:
    found = figures(Path(sys.argv[1]))
    for name, value in found.items():
        print(f"{name:24} {value if isinstance(value, str) or value is None else f'{value:.3g}'}")
    if found["pinocchio"]:
        ours = float(found[f"regressor_{found['kernel']}"])
        print(f"regressor, one thread    {ours / found['pinocchio']:.0f} times Pinocchio's from Python")
        with_effects = float(found["grams_70_threads_2"]) / found["pinocchio"]
        print(f"with 70 effects, Grams   {with_effects:.1f} times, two threads")
    limit = float(found["grams_70_threads_1"]) / float(found["gram_only"])
    print(f"of the Gram alone        {100 * limit:.0f} %, one thread")
    clock, processor = ten_minutes()
    print(f"10 minutes at 500 Hz     {clock:.2f} s by the clock, {processor:.2f} s of processor, diagnosed")


if __name__ == "__main__":
    main()
