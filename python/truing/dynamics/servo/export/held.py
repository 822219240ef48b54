# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A servo's chain as simulators hold one: position servos with damping, dry friction and a delay; and what of
the chain that leaves out, with its size.

What a position servo cannot say is replaced by the servo that is nearest over the motion that was recorded:
the drive's law and the dead band by the gain of least squares over the command errors, friction that grows
with the load by that at the mean load, a torque for the command's speed by a shorter delay (u(t + D/P) is
u + D/P du/dt to first order).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.servo.chain import ServoChain, ServoJoint

Floats = NDArray[np.float64]

_NO_FIELD = "no simulator's position servo has it"
_POINTS = 4000  # of a recording's rows that sizes are stated on


@dataclass(frozen=True)
class Use:
    """How a joint was used: rows of the recordings. shape=(n,) each"""

    error: Floats  # [rad | m] command less angle
    speed: Floats  # [rad/s | m/s]
    command_speed: Floats  # [rad/s | m/s]
    angle: Floats  # [rad | m] as recorded

    @property
    def known(self) -> bool:
        return self.error.size > 0


@dataclass(frozen=True)
class HeldJoint:
    """What is written of a joint. Torques are at the joint; NaN and infinity are not among them."""

    gain: float  # [Nm/rad]
    damping_gain: float  # [Nm s/rad] of the servo, against the joint's speed
    integral_gain: float
    delay: float  # [s]
    rate_limit: float | None
    force_limit: float | None
    damping: tuple[float, float]  # [Nm s/rad, Nm s^2/rad^2]
    friction: float  # [Nm] dry
    more_at_rest: float  # [Nm] of dry friction, gone at stribeck_speed
    stribeck_speed: float
    presliding: float  # [rad]
    armature: float
    spring: float
    offset: float  # [Nm]
    zero: float  # [rad] of the recording less the model's
    play: float  # [rad] between rotor and link, encoder on the motor
    twist: float  # [rad/Nm] the same


@dataclass(frozen=True)
class Held:
    """All joints of an arm, and what could not be said."""

    joints: dict[str, HeldJoint]
    not_written: list[NotWritten] = field(default_factory=list)


def uses_of(chain: ServoChain, recordings: Sequence[_core.Recording]) -> dict[str, Use]:
    """By joint; empty rows without recordings of position commands."""
    out = {}
    for j, joint in enumerate(chain.joints):
        parts: list[list[Floats]] = [[], [], [], []]
        for recording in recordings:
            if recording.command.shape[1] != len(chain.joints):
                continue
            time = np.asarray(recording.time, dtype=float)
            angle, command = np.asarray(recording.position[:, j]), np.asarray(recording.command[:, j])
            kept = slice(None, None, max(1, time.size * len(recordings) // _POINTS))
            rows = (command - angle, np.gradient(angle, time), np.gradient(command, time), angle)
            for part, row in zip(parts, rows, strict=True):
                part.append(row[kept])
        out[joint] = Use(*(np.concatenate(part) if part else np.empty(0) for part in parts))
    return out


def held(chain: ServoChain, uses: dict[str, Use]) -> Held:
    """What simulators can hold of a chain. uses: of `uses_of`."""
    out = Held({})
    for joint, drive in zip(chain.joints, chain.drives, strict=True):
        out.joints[joint] = _held(joint, drive, uses[joint], out.not_written)
    if any(drive.gain_law for drive in chain.drives) and chain.gain_reference != 1.0:
        reason = f"gains are those at the firmware's gain {chain.gain_reference:g}"
        out.not_written.append(NotWritten("firmware_gain", math.nan, reason))
    return out


def _held(joint: str, drive: ServoJoint, use: Use, left: list[NotWritten]) -> HeldJoint:
    gain = _straight_gain(joint, drive, use, left)
    lead = drive.damping_gain / gain if gain > 0.0 else 0.0
    delay = max(0.0, drive.delay - lead)
    if lead > drive.delay:
        size = (lead - drive.delay) * gain * _rms(use.command_speed)
        reason = "the torque for the command's speed is written as a shorter delay, as far as there is one"
        left.append(NotWritten(f"damping_gain.{joint}", size, reason))
    fed_back = drive.viscous * drive.limited_damping
    friction = drive.coulomb + _mean_load_friction(joint, drive, use, left)
    _by_inputs(joint, drive, use, left)
    encoder_on_motor = drive.motor_encoder > 0.5
    if not encoder_on_motor:
        for name, value in (("backlash", drive.backlash), ("joint_elasticity", drive.elasticity)):
            if value:
                reason = "the servo measures behind it, and an actuator of a simulator measures where it acts"
                left.append(NotWritten(f"{name}.{joint}", math.nan, reason))
    return HeldJoint(
        gain=gain,
        damping_gain=drive.damping_gain + fed_back,
        integral_gain=drive.integral_gain,
        delay=delay,
        rate_limit=drive.rate_limit if math.isfinite(drive.rate_limit) else None,
        force_limit=drive.saturation if math.isfinite(drive.saturation) else None,
        damping=(drive.viscous - fed_back, drive.viscous_law),
        friction=max(friction, 0.0),
        more_at_rest=drive.stribeck,
        stribeck_speed=drive.stribeck_speed,
        presliding=drive.presliding,
        armature=drive.armature,
        spring=drive.spring,
        # Dry friction of c + a forwards and c - a backwards is c, and a torque -a, at rest as well.
        offset=drive.current_offset - drive.asymmetric_friction,
        zero=drive.zero,
        play=drive.backlash if encoder_on_motor else 0.0,
        twist=drive.elasticity if encoder_on_motor else 0.0,
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def drive_torque(drive: ServoJoint, error: Floats) -> Floats:
    """Torque for command errors of a drive at rest: dead band, then the exponent through its reference."""
    beyond = np.sign(error) * np.maximum(np.abs(error) - drive.dead_band, 0.0)
    effort = drive.command_gain * beyond
    reference = drive.drive_reference
    return np.asarray(np.sign(effort) * reference * (np.abs(effort) / reference) ** drive.drive_law)


def _straight_gain(joint: str, drive: ServoJoint, use: Use, left: list[NotWritten]) -> float:
    """The gain that is nearest to the drive's law over the command errors that were recorded."""
    names = [
        name
        for name, there in (("drive_law", drive.drive_law != 1.0), ("dead_band", drive.dead_band > 0.0))
        if there
    ]
    if not names:
        return drive.command_gain
    limit = drive.saturation
    if not use.known or not use.error.any():
        left += [NotWritten(f"{name}.{joint}", math.nan, _NO_FIELD) for name in names]
        return drive.command_gain
    torque = np.clip(drive_torque(drive, use.error), -limit, limit)
    gain = float(torque @ use.error / (use.error @ use.error))
    size = _rms(torque - gain * use.error)
    left += [NotWritten(f"{name}.{joint}", size, f"{_NO_FIELD}; a gain stands for it") for name in names]
    return gain


def _mean_load_friction(joint: str, drive: ServoJoint, use: Use, left: list[NotWritten]) -> float:
    """Dry friction for the mean torque of the drive."""
    if drive.load_friction == 0.0:
        return 0.0
    if not use.known:
        left.append(NotWritten(f"load_friction.{joint}", math.nan, _NO_FIELD))
        return 0.0
    load = np.minimum(np.abs(drive_torque(drive, use.error)), drive.saturation)
    mean = float(drive.load_friction * load.mean())
    size = _rms(drive.load_friction * load - mean)
    left.append(NotWritten(f"load_friction.{joint}", size, f"{_NO_FIELD}; friction stands for it"))
    return mean


def _by_inputs(joint: str, drive: ServoJoint, use: Use, left: list[NotWritten]) -> None:
    """What goes with supply, temperature, time and the switch: simulators have none of these."""
    torque = _rms(drive_torque(drive, use.error)) if use.known else math.nan
    for name, value, size, at in (
        ("supply_gain", drive.supply_gain, 0.1 * drive.supply_gain * torque, "written for the mean supply"),
        ("supply_sag", drive.supply_sag, drive.supply_sag * torque**2, "written without it"),
        (
            "thermal_friction",
            drive.thermal_friction,
            10.0 * abs(drive.thermal_friction) * drive.coulomb,
            "written for the reference temperature; size: 10 K from it",
        ),
        (
            "warmup",
            drive.warmup,
            600.0 * abs(drive.warmup) * drive.coulomb,
            "written as at the start; size: 600 s later",
        ),
        (
            "back_emf",
            drive.back_emf,
            drive.back_emf * (1.0 - drive.limited_damping) * drive.viscous * _rms(use.speed),
            "written for a servo that is switched on",
        ),
    ):
        if value:
            left.append(NotWritten(f"{name}.{joint}", size, at))


def without(drive: ServoJoint) -> ServoJoint:
    """A drive with neutral values where simulators hold nothing: where a fit of what they hold begins."""
    return replace(
        drive,
        drive_law=1.0,
        dead_band=0.0,
        load_friction=0.0,
        supply_gain=0.0,
        supply_sag=0.0,
        thermal_friction=0.0,
        warmup=0.0,
        back_emf=0.0,
        backlash=drive.backlash if drive.motor_encoder > 0.5 else 0.0,
        elasticity=drive.elasticity if drive.motor_encoder > 0.5 else 0.0,
    )
