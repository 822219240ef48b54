# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The actuator chain of a servo arm as data: from the command to the torque at each joint.

In every step of the simulation, with `u` the command of `delay` seconds ago, no faster than `rate_limit`:

    e      = u - q, less `dead_band` on both sides of zero; q is the rotor's angle where `backlash` or
             `elasticity` stand between the rotor and the link and the encoder sits on the motor
    c      = g (command_gain e + integral_gain * integral of e) + damping_gain (du/dt - dq/dt)
              - limited_damping viscous dq/dt
             g = (firmware gain / its reference) ** gain_law, where the recordings have `kp1_raw` …
    tau    = sign(c) drive_reference (|c| / drive_reference) ** drive_law
    tau   *= 1 + supply_gain (volt / its reference - 1), and 1 - supply_sag * (all drives' |torques|)
    tau    = tau clipped to +-saturation; 0 where `enabled` is 0
    level  = coulomb + load_friction |tau| + stribeck exp(-(dq/dt / stribeck_speed)^2)
              + asymmetric_friction sign(dq/dt)
    level *= 1 + thermal_friction (temperature - its reference) + warmup t
    friction = dry, at most `level` (elastic over `presliding` of travel) + viscous_law dq/dt |dq/dt|
              + (1 - limited_damping) viscous dq/dt, its part back_emf not where `enabled` is 0
    joint  = tau + current_offset - spring q - friction - gravity_scale * gravity, with `armature` on it

All values are those at the joint, SI. Where a joint slides read m for rad and N for Nm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Literal

Scale = Literal["log", "linear", "constant"]
Dimension = Literal[
    "one",
    "torque",
    "torque/angle",
    "torque/(angle s)",
    "torque/speed",
    "torque/speed^2",
    "1/torque",
    "angle",
    "angle/torque",
    "speed",
    "second",
    "inertia",
    "1/K",
    "1/s",
]


@dataclass(frozen=True)
class DriveParameter:
    """What is known of a value of the chain before any data."""

    effect: str  # of the catalogue: what a departure from `neutral` is called
    unit: str
    scale: Scale
    """'log': fitted as its logarithm; 'linear': as it is; 'constant': of a law, scanned or given."""
    spread: float
    """Standard deviation of the prior: of the logarithm, or in units of the joint's own torque, speed, angle
    and inertia (`dimension`), which its recordings say."""
    dimension: Dimension
    low: float
    high: float
    neutral: float  # the value at which the effect is not there
    usual: bool  # fitted in any case, as standard practice does
    what: str  # in words


def _value(neutral: float, effect: str, unit: str, dimension: Dimension, what: str, **known: Any) -> Any:
    """A field of the chain with what is known of it."""
    parameter = DriveParameter(
        effect,
        unit,
        known.get("scale", "linear"),
        known.get("spread", 1.0),
        dimension,
        known.get("low", -math.inf),
        known.get("high", math.inf),
        known.get("neutral", neutral),
        known.get("usual", False),
        what,
    )
    return field(default=neutral, metadata={"parameter": parameter})


@dataclass(frozen=True, kw_only=True)
class ServoJoint:
    """The chain of one joint. The order of the fields is that of the rows the simulator takes."""

    command_gain: float = _value(
        1.0,
        "command_gain",
        "Nm/rad",
        "torque/angle",
        "torque for a command error",
        scale="log",
        spread=1.5,
        low=0.0,
        usual=True,
    )
    integral_gain: float = _value(
        0.0,
        "integral_gain",
        "Nm/(rad s)",
        "torque/(angle s)",
        "torque for a command error that stays",
        spread=1.0,
        low=0.0,
    )
    damping_gain: float = _value(
        0.0,
        "damping_gain",
        "Nm s/rad",
        "torque/speed",
        "torque for the command's speed less the joint's",
        spread=1.0,
        low=0.0,
    )
    gain_law: float = _value(
        1.0, "gain_law", "1", "one", "exponent of the firmware's gain", spread=0.3, low=0.0, high=3.0
    )
    delay: float = _value(
        0.0, "delay", "s", "second", "time from the command to the torque", spread=0.02, low=0.0, high=0.3
    )
    rate_limit: float = _value(
        math.inf,
        "rate_limit",
        "rad/s",
        "speed",
        "fastest change of the command that the servo follows",
        scale="log",
        spread=1.0,
        low=0.0,
    )
    saturation: float = _value(
        math.inf, "saturation", "Nm", "torque", "largest torque", scale="log", spread=1.0, low=0.0
    )
    drive_law: float = _value(
        1.0, "drive_law", "1", "one", "exponent of torque over command effort", spread=0.3, low=0.2, high=3.0
    )
    drive_reference: float = _value(
        1.0,
        "drive_law",
        "Nm",
        "torque",
        "effort at which any exponent gives the same torque",
        scale="constant",
    )
    supply_gain: float = _value(
        0.0,
        "supply_sag",
        "1",
        "one",
        "how torque follows the measured supply (1: in proportion)",
        spread=1.0,
        low=0.0,
        high=4.0,
    )
    supply_sag: float = _value(
        0.0,
        "supply_sag",
        "1/Nm",
        "1/torque",
        "part of the torque lost for the torque of all drives",
        spread=0.3,
        low=0.0,
    )
    dead_band: float = _value(
        0.0, "dead_band", "rad", "angle", "command error that gives no torque", spread=0.5, low=0.0
    )
    coulomb: float = _value(
        0.0, "coulomb", "Nm", "torque", "dry friction", scale="log", spread=2.0, low=0.0, usual=True
    )
    viscous: float = _value(
        0.0,
        "viscous",
        "Nm s/rad",
        "torque/speed",
        "friction that grows with speed",
        scale="log",
        spread=2.0,
        low=0.0,
        usual=True,
    )
    viscous_law: float = _value(
        0.0,
        "viscous_law",
        "Nm s^2/rad^2",
        "torque/speed^2",
        "friction that grows with the square of speed",
        spread=0.5,
    )
    back_emf: float = _value(
        0.0,
        "back_emf",
        "1",
        "one",
        "part of viscous friction that the motor makes, and not while it is switched off",
        spread=0.5,
        low=0.0,
        high=1.0,
    )
    limited_damping: float = _value(
        0.0,
        "viscous",
        "1",
        "one",
        "part of viscous friction that the controller makes, within its largest torque",
        scale="constant",
        low=0.0,
        high=1.0,
    )
    stribeck: float = _value(
        0.0, "stribeck", "Nm", "torque", "dry friction more at rest than at speed", spread=0.3
    )
    stribeck_speed: float = _value(
        0.1, "stribeck", "rad/s", "speed", "speed at which that has gone", scale="constant"
    )
    load_friction: float = _value(
        0.0,
        "load_friction",
        "1",
        "one",
        "dry friction for a torque that is transmitted",
        spread=0.3,
        low=0.0,
        high=1.5,
    )
    asymmetric_friction: float = _value(
        0.0, "asymmetric_friction", "Nm", "torque", "dry friction more forwards than backwards", spread=0.2
    )
    presliding: float = _value(
        0.0, "presliding", "rad", "angle", "travel over which dry friction is elastic", spread=0.5, low=0.0
    )
    thermal_friction: float = _value(
        0.0, "thermal_friction", "1/K", "1/K", "part that dry friction changes by for a kelvin", spread=0.03
    )
    warmup: float = _value(
        0.0, "warmup", "1/s", "1/s", "part that dry friction changes by in a second", spread=0.03
    )
    spring: float = _value(0.0, "spring", "Nm/rad", "torque/angle", "spring beside the drive", spread=0.3)
    current_offset: float = _value(
        0.0, "current_offset", "Nm", "torque", "torque that is always there", spread=0.3
    )
    gravity_scale: float = _value(
        1.0,
        "gravity_scale",
        "1",
        "one",
        "weight at this joint over the model's",
        spread=0.3,
        low=-1.0,
        high=4.0,
    )
    armature: float = _value(
        0.0,
        "armature",
        "kg m^2",
        "inertia",
        "rotor's inertia at the joint",
        scale="log",
        spread=2.0,
        low=0.0,
        usual=True,
    )
    backlash: float = _value(
        0.0, "backlash", "rad", "angle", "play between rotor and link", spread=1.0, low=0.0
    )
    elasticity: float = _value(
        0.0,
        "joint_elasticity",
        "rad/Nm",
        "angle/torque",
        "twist between rotor and link for a torque",
        spread=1.0,
        low=0.0,
    )
    motor_encoder: float = _value(
        0.0,
        "backlash",
        "1",
        "one",
        "1: the encoder sits on the motor, before play and elasticity",
        scale="constant",
    )
    zero: float = _value(
        0.0,
        "joint_offset",
        "rad",
        "angle",
        "the recording's angle less the model's at the same place",
        spread=0.1,
        usual=True,
    )


@dataclass(frozen=True, kw_only=True)
class ServoChain:
    """All joints of an arm, and what is not a matter of one joint."""

    joints: tuple[str, ...]  # in the order of the recordings' columns
    prismatic: tuple[bool, ...]
    drives: tuple[ServoJoint, ...]
    weight_scale: float = 1.0  # gravity over the model's, at all joints
    payload_mass: float = 0.0  # [kg] a point, at payload_place
    payload_place: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m] in the frame of the last body
    payload_body: str = ""
    link_scale: Mapping[str, float] = field(default_factory=dict)
    """Mass and inertia of a body over the model's, by its name; those that are not named: 1."""
    gravity: tuple[float, float, float] | None = None
    """[m/s^2] in the file's frame, where the base does not stand as the file has it; None: it does."""
    gain_reference: float = 1.0  # firmware gain (kp1_raw) at which command_gain holds
    supply_reference: float = 1.0  # [V]
    temperature_reference: float = 25.0  # [deg C]

    def drive(self, joint: str) -> ServoJoint:
        return self.drives[self.joints.index(joint)]

    def with_drive(self, joint: str, **values: float) -> ServoChain:
        """Another chain with these values at a joint."""
        at = self.joints.index(joint)
        drives = tuple(replace(d, **values) if k == at else d for k, d in enumerate(self.drives))
        return replace(self, drives=drives)

    def to_dict(self) -> dict[str, Any]:
        """As result.json has it; a limit that is not there is null."""
        out = {k: v for k, v in asdict(self).items() if k not in ("drives", "joints", "prismatic")}
        out["payload_place"], out["link_scale"] = list(self.payload_place), dict(self.link_scale)
        out["gravity"] = list(self.gravity) if self.gravity else None
        out["joints"] = {
            joint: {
                "type": "prismatic" if slides else "revolute",
                **{k: (v if math.isfinite(v) else None) for k, v in asdict(drive).items()},
            }
            for joint, slides, drive in zip(self.joints, self.prismatic, self.drives, strict=True)
        }
        return out

    @classmethod
    def from_dict(cls, read: Mapping[str, Any]) -> ServoChain:
        """What `to_dict` gave."""
        rest = {k: v for k, v in read.items() if k != "joints"}
        rest["payload_place"] = tuple(rest.get("payload_place", (0.0, 0.0, 0.0)))
        rest["gravity"] = tuple(rest["gravity"]) if rest.get("gravity") else None
        drives = [
            ServoJoint(**{k: math.inf if v is None else v for k, v in one.items() if k != "type"})
            for one in read["joints"].values()
        ]
        return cls(
            joints=tuple(read["joints"]),
            prismatic=tuple(one["type"] == "prismatic" for one in read["joints"].values()),
            drives=tuple(drives),
            **rest,
        )


PARAMETERS: dict[str, DriveParameter] = {f.name: f.metadata["parameter"] for f in fields(ServoJoint)}
"""What is known of every value of a joint, by its name."""
