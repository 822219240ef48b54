# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking on the arm: every sample comes in by a socket as one datagram, every inertial sample is answered
with the correction 40 ms ahead.

    python examples/python/live.py --seconds 60

A second process plays the arm: a simulated recording, inertial samples at 500 Hz; tracker, joints and plan
when they arrive. Two times are measured: the program's, from a datagram read to the answer sent, and the
whole way, from the arm's sending to its having the answer: what else the machine does is in it. Both
processes ask for real-time priority, which is granted to root; without it other work delays answers. With
--echo nothing is computed: what socket, language and machine take by themselves.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import os
import socket
import struct
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import truing

Floats = NDArray[np.float64]

RATE = 500.0  # [Hz] of the inertial sensor
AHEAD = 0.04  # [s] corrections are made so long before the instant they are for
START = 2.0  # [s] clock and biases settle: errors are not counted before
LIMIT = 2.0  # [ms]
# A datagram: what it is, its stamp [s], then its numbers, little-endian.
IMU, POSE, JOINTS, PLAN, END = range(5)
LAYOUT = {
    IMU: struct.Struct("<Bd6d"),  # angular velocity [rad/s], specific force [m/s^2]
    POSE: struct.Struct("<Bd7d"),  # position [m], quaternion w x y z
    JOINTS: struct.Struct("<Bd12d"),  # T_base_flange, upper three rows (`truing.model.flange_poses`)
    PLAN: struct.Struct("<Bd12d"),  # T_base_tool likewise
}
ANSWER = struct.Struct("<d6d")  # instant [s], correction in the base frame [m], rotation vector [rad]


def datagrams(streams: Any) -> list[tuple[float, bytes]]:
    """Every sample with its arrival, in that order."""
    imu, pose, flange, plan = streams.imu, streams.tracker, streams.flange, streams.plan
    rows = [
        (IMU, imu, np.hstack([imu["gyro"], imu["accel"]])),
        (POSE, pose, np.hstack([pose["position"], pose["orientation"]])),
        (JOINTS, flange, flange["T_base_flange"][:, :3].reshape(-1, 12)),
        (PLAN, plan, plan["T_base_tool"][:, :3].reshape(-1, 12)),
    ]
    out = [
        (float(stream["arrival"][k]), LAYOUT[kind].pack(kind, stream["t"][k], *values[k]))
        for kind, stream, values in rows
        for k in range(len(stream["t"]))
    ]
    return sorted(out, key=lambda item: item[0])


def play_arm(port: int, packets: list[tuple[float, bytes]], results: Any) -> None:
    """The arm: sends each datagram when it is due, waits for the answer to each inertial sample, and puts the
    whole way's times into `results` [ms]; an answer that never came counts as a second.
    """
    steady_process()  # an arm's controller is not late either
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect(("127.0.0.1", port))
    link.settimeout(1.0)
    ways = []
    began = time.monotonic() + 0.2
    first = next(arrival for arrival, packet in packets if packet[0] == IMU)
    for arrival, packet in packets:
        wait = began + arrival - first - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        sent = time.monotonic()
        link.send(packet)
        if packet[0] == IMU:
            try:
                link.recv(ANSWER.size)
                ways.append(1e3 * (time.monotonic() - sent))
            except TimeoutError:
                ways.append(1e3)
    link.send(bytes([END]))
    results.put(ways)


def take(tracker: truing.tracking.Tracker, packet: bytes) -> bool:
    """The sample in a datagram is given to the tracker; True for an inertial one, which is to be answered."""
    kind = packet[0]
    _, t, *values = LAYOUT[kind].unpack(packet)
    if kind == IMU:
        tracker.push_imu(t, values[:3], values[3:])
    elif kind == POSE:
        tracker.push_pose(t, values[:3], values[3:])
    else:
        T = np.eye(4)
        T[:3] = np.reshape(values, (3, 4))
        (tracker.push_joints if kind == JOINTS else tracker.push_plan)(t, T)
    return kind == IMU


def answer_all(link: socket.socket, tracker: truing.tracking.Tracker) -> tuple[list[float], list[Any]]:
    """Reads until the arm ends: times of the program [ms], and the compensations it has sent."""
    times: list[float] = []
    sent: list[truing.tracking.Compensation] = []
    while True:
        packet, arm = link.recvfrom(256)
        if packet[0] == END:
            return times, sent
        began = time.perf_counter()
        if not take(tracker, packet):
            continue
        t = tracker.now + AHEAD
        compensation = tracker.compensate(t)
        link.sendto(ANSWER.pack(t, *compensation.correction), arm)
        times.append(1e3 * (time.perf_counter() - began))
        sent.append(compensation)


def echo_all(link: socket.socket) -> list[float]:
    """Answers without looking: the times that socket, language and machine take by themselves [ms]."""
    times: list[float] = []
    while True:
        packet, arm = link.recvfrom(256)
        if packet[0] == END:
            return times
        began = time.perf_counter()
        if packet[0] == IMU:
            link.sendto(bytes(ANSWER.size), arm)
            times.append(1e3 * (time.perf_counter() - began))


def steady_process() -> str:
    """What keeps answers from being late: no garbage collection, real-time priority where it is granted."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
        return "real-time priority"
    except (AttributeError, OSError):
        return "no real-time priority: not granted"


def print_times(what: str, times: list[float]) -> None:
    """Percentiles and a histogram of times [ms]."""
    values = np.array(times)
    middle, high, highest = np.quantile(values, [0.5, 0.99, 0.999])
    print(
        f"{what}: {len(values)} answers, median {middle:.3f} ms, p99 {high:.3f}, p99.9 {highest:.3f}, maximum"
        f" {values.max():.3f}; {100 * np.mean(values <= LIMIT):.2f} % within {LIMIT:g} ms"
    )
    edges = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, LIMIT, 5.0, np.inf]
    counts = np.histogram(values, bins=edges)[0]
    for low, up, count in zip(edges[:-1], edges[1:], counts, strict=True):
        bar = "#" * int(np.ceil(50 * count / len(values)))
        print(f"  {low:5.2f} to {up:5.2f} ms {count:7d} {bar}")


def print_error(streams: Any, sent: list[truing.tracking.Compensation]) -> None:
    """Predictions behind the answers against the true tool."""
    predicted = [c.predicted for c in sent if c.predicted.t > START]
    if not predicted:
        return
    true: Floats = streams.tool_at([p.t for p in predicted])[:, :3, 3]
    off = np.linalg.norm(np.array([p.T_base_tool[:3, 3] for p in predicted]) - true, axis=1)
    print(f"{1e3 * AHEAD:g} ms ahead the tool was predicted to {1e3 * np.sqrt(np.mean(off**2)):.2f} mm rms")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=6.0, help="length of the recording, %(default)s s")
    parser.add_argument("--echo", action="store_true", help="answer without computing anything")
    args = parser.parse_args()
    streams = truing.testing.simulate_streams(
        truing.testing.large_boom(), seconds=args.seconds, motion="stop-and-go", imu_rate=RATE, seed=4
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.settimeout(60.0)
        context = multiprocessing.get_context("spawn")
        results = context.Queue()
        arm = context.Process(target=play_arm, args=(link.getsockname()[1], datagrams(streams), results))
        arm.start()
        tracker = truing.tracking.Tracker(streams.setup)
        granted = steady_process()
        times, sent = (echo_all(link), []) if args.echo else answer_all(link, tracker)
        ways = results.get()
        arm.join()
    print(f"{RATE:g} Hz, {granted}")
    print_times("program", times)
    print_times("whole way", ways)
    print_error(streams, sent)


if __name__ == "__main__":
    main()
