# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of hours, longer than memory: memory and time of their diagnosis, as a user starts it.

    python bench/dynamics_stream.py --hours 2 6 24 [--folder FOLDER]

An arm with hidden effects (`truing.testing.dynamics`) is simulated at 500 Hz and written to a Parquet file of
80 bytes a row, 3.5 GB for 24 hours; `truing dynamics diagnose` reads it. Not part of `make bench`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

import truing
from truing.testing.dynamics import MEMORY, NOISE, fourier_motion, simulate_motion

STEP = 0.002  # [s]
PIECE = 600.0  # [s] of one motion; then the recording stops for a second, and the next begins
MOTIONS = 6  # that differ; then they come again, with other noise
CUT_OFF = 30.0  # [Hz] of the derivatives of the motion

Floats = NDArray[np.float64]


def noise_of(rows: int, joints: int, random: np.random.Generator) -> Floats:
    """First-order autoregressive noise of unit variance, by its impulse response."""
    response = MEMORY ** np.arange(200.0) * np.sqrt(1.0 - MEMORY**2)
    white = random.normal(0.0, 1.0, (joints, rows + len(response) - 1))
    size = 1 << (white.shape[1] + len(response)).bit_length()
    spectrum = np.fft.rfft(white, size) * np.fft.rfft(response, size)
    return np.fft.irfft(spectrum, size)[:, len(response) - 1 : white.shape[1]].T


def motions(
    truth: truing.Robot, random: np.random.Generator, count: int = MOTIONS
) -> list[tuple[Floats, Floats]]:
    """Angles and torques of pieces, without noise."""
    out = []
    t = np.arange(0.0, PIECE, STEP)
    for _ in range(count):
        q = fourier_motion(t, len(truth.driven_joints()), random)
        bare = truing.dynamics.Recording("motion", time=t, position=q)
        out.append((q, np.asarray(truing.dynamics.predict(truth, bare, cutoff=CUT_OFF).torque)))
    return out


def write(file: Path, truth: truing.Robot, hours: float) -> int:
    """The number of rows."""
    random = np.random.default_rng(1)
    pieces, rows = motions(truth, random), 0
    joints = len(truth.driven_joints())
    names = [f"q{k + 1}_rad" for k in range(joints)] + [f"tau{k + 1}_Nm" for k in range(joints)]
    schema = pa.schema(
        [("t_s", pa.float64())] + [(n, pa.float64() if n[0] == "q" else pa.float32()) for n in names]
    )
    with pq.ParquetWriter(file, schema) as writer:
        for number in range(max(1, round(hours * 3600.0 / PIECE))):
            q, torque = pieces[number % MOTIONS]
            noisy = torque + noise_of(*torque.shape, random) * NOISE * torque.std(axis=0)
            t = number * (PIECE + 1.0) + np.arange(len(q)) * STEP
            arrays = [pa.array(t), *map(pa.array, q.T), *(pa.array(one, pa.float32()) for one in noisy.T)]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema), row_group_size=65_536)
            rows += len(q)
    return rows


def diagnosed(robot: Path, file: Path, out: Path) -> tuple[float, float, float]:
    """Seconds by the clock and of the processor, and the most memory [MB]."""
    command = [sys.executable, "-m", "truing", "dynamics", "diagnose", str(robot), str(file)]
    start = time.perf_counter()
    process = subprocess.Popen([*command, "--out", str(out), "--no-rollout"])
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit("the diagnosis failed")
    return time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def written(folder: Path, hours: float) -> None:
    """By a process of its own, or its memory would count as that of the diagnosis, which it starts."""
    arm = simulate_motion(recordings=1, held_out=0)
    truing.save_robot(folder / "robot.yaml", arm.nominal)
    print(write(folder / "long.parquet", arm.truth, hours))


def measured(parent: Path | None, hours: float) -> str:
    """A line of what so many hours take. parent: of the recording's folder."""
    with tempfile.TemporaryDirectory(dir=parent) as name:
        folder = Path(name)
        command = [sys.executable, __file__, "--hours", str(hours), "--write", name]
        rows = int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        clock, processor, memory = diagnosed(
            folder / "robot.yaml", folder / "long.parquet", folder / "result"
        )
    return (
        f"{hours:g} h at {1 / STEP:.0f} Hz, {rows} rows: {clock:.0f} s by the clock,"
        f" {processor:.0f} s of processor, {1e6 * processor / rows:.1f} us a row, {memory:.0f} MB at most"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--hours", type=float, nargs="+", default=[2.0], help="from two on they are read in pieces"
    )
    parser.add_argument("--folder", type=Path, help="for the recording; default: a temporary one")
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.write:
        written(arguments.write, arguments.hours[0])
        return
    for hours in arguments.hours:
        print(measured(arguments.folder, hours), flush=True)


if __name__ == "__main__":
    main()
