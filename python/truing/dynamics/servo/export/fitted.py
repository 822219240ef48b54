# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A chain as a simulator's position servos hold it: laws that they have not are taken out, and what every
chain has is fitted anew to the motion of the joints that lose one. And the firmware's gain that it is for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from truing import _core
from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.arm import ServoArm, servo_arm
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.data import servo_data, windows_of
from truing.dynamics.servo.export.held import Held, without
from truing.dynamics.servo.export.ours import at_references
from truing.dynamics.servo.fit import Fitter, rows_of
from truing.dynamics.servo.free import usual_values
from truing.dynamics.servo.ground import sizes_of
from truing.dynamics.servo.simulator import Simulator, chain_of, point_of

_WINDOW = 5.0  # [s]
_STEP = 0.005  # [s] of joints apart
_ROUNDS = 20
_SAME = 1e-6  # relative


def fitted_without(
    chain: ServoChain, nearest: Held, source: Path | str, recordings: Sequence[_core.Recording]
) -> ServoChain:
    """The chain without what simulators do not hold: of joints that lose a law, gain, damping, dry friction,
    rotor and zero begin where they are nearest, and are fitted to the recordings.

    nearest: what simulators can hold of the chain. source: file of the arm, or its
    text without drives. A chain that loses nothing,
    or of which there are no recordings, is the one that was given.
    """
    bare = replace(chain, drives=tuple(without(drive) for drive in chain.drives))
    lost = [a != b for a, b in zip(chain.drives, bare.drives, strict=True)]
    some = [r for r in recordings if r.command.shape[1] == len(chain.joints)]
    if not any(lost) or not some:
        return chain
    values = nearest.joints.values()
    drives = [
        replace(d, command_gain=v.gain, coulomb=v.friction) for d, v in zip(bare.drives, values, strict=True)
    ]
    bare = replace(bare, drives=tuple(drives))
    data = at_references(servo_data(some, len(chain.joints)), chain)
    bodies = source if isinstance(source, str) else servo_arm(source, chain.joints).mjcf
    apart = Apart(Simulator(ServoArm("", bodies, bare, ()), data), _STEP)
    fitter, point = Fitter(apart, rows_of(data, windows_of(data, _WINDOW))), point_of(bare)
    sizes = sizes_of(apart, point, fitter.rows.windows)
    free = [f for f in usual_values(bare, sizes, data.torque_command) if lost[f.joint]]
    start = np.array([f.at(point) for f in free])
    return chain_of(fitter.settled(point, free, start, None, _ROUNDS).point, bare)


def firmware_of(chain: ServoChain, recordings: Sequence[_core.Recording]) -> float:
    """The firmware's gain over the chain's reference, as recordings have it throughout and at every joint; 1
    where they have several, or say none."""
    if not recordings:
        return 1.0
    data = at_references(servo_data(recordings, len(chain.joints)), chain)
    gains = np.concatenate([stream.gain.ravel() for stream in data.streams])
    return float(gains[0]) if np.ptp(gains) < _SAME * gains[0] else 1.0


def at_firmware(chain: ServoChain, gain: float) -> ServoChain:
    """The same chain, its gains stated at another gain of the firmware, which is the reference from here on.
    gain: over the reference."""
    times = [gain**drive.gain_law for drive in chain.drives]
    drives = tuple(
        replace(drive, command_gain=k * drive.command_gain, integral_gain=k * drive.integral_gain)
        for drive, k in zip(chain.drives, times, strict=True)
    )
    return replace(chain, drives=drives, gain_reference=gain * chain.gain_reference)
