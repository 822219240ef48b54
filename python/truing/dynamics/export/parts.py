# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The torque effects of a robot, sorted by what simulators have for them.

Laws and names: docs/reference/torque_effects.md. Everything here is at the readings; a writer turns it into
the joints of its format.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from truing import _core
from truing.dynamics.export.beside import REFERENCE_C, Effect, dry_friction, smooth_torques
from truing.dynamics.export.chain import Chain, Floats
from truing.dynamics.motion import SMOOTHING, track_of
from truing.dynamics.recorded import Recorded
from truing.errors import InputError

_WARM, _LATER = REFERENCE_C + 10.0, 600.0  # [deg C], [s] at which sizes of thermal effects are stated
_GRAVITY = 9.81  # [m/s^2]
_REFERENCE = (20.0, 0.05)  # [s] of the reference motion where nothing was recorded, and between its rows
_USUAL_REACH = (np.pi / 2, 0.25)  # [rad], [m] of a joint without limits
_SHARE = 0.25  # of a joint's range to both sides of its middle
_APART, _PHASE = 0.13, 0.7  # share and [rad] by which a joint's sine differs from that of the one before
_USUAL_SPEED = 1.0  # [rad/s | m/s] of a joint without a speed limit
_PER_JOINT = (
    "coulomb",
    "viscous",
    "current_offset",
    "viscous_law",
    "stribeck",
    "presliding",
    "asymmetric_friction",
    "load_friction",
    "position_friction",
    "ripple",
    "armature",
    "spring",
    "motor_constant",
    "torque_lag",
    "joint_elasticity",
    "backlash",
    "thermal_friction",
    "warmup",
)
_PARTS = {
    "coulomb": ("", "turn_speed", "turn_travel", "turn_fade"),
    "viscous_law": ("quadratic", "cubic", "root", "saturating", "v0"),
    "stribeck": ("", "vs"),
    "presliding": ("", "x0"),
    "load_friction": ("", "links"),
    "position_friction": ("sin", "cos"),
    "thermal_friction": ("coulomb", "viscous"),
    "warmup": ("coulomb", "viscous"),
    "coupling": ("viscous", "coulomb", "inertia"),
    "tool_force": ("x", "y", "z"),
    "payload_place": ("x", "y", "z"),
}
"""What follows the joint in the names of an effect's parameters; nothing where it is not listed."""
IN_BODIES = ("link_inertia", "payload")
IN_GRAVITY = "base_tilt"
ONLY_MEASURED = {
    "motor_constant": "belongs to the measurement: divide measured torques by one plus this",
    "torque_lag": "belongs to the measurement: the torque was read so much later than the motion",
    "time_offset": "belongs to the measurement: torques and positions have other clocks",
    "payload_place": "belongs to the recordings: the payload that they state is no part of the robot",
}
_HOLDS = "dry friction of simulators holds a resting joint for good"
_NO_PLACE = {
    "joint_elasticity": "needs a further hinge and a motor body in every joint: the model's joints would no"
    " longer be the robot's",
    "backlash": "needs a further hinge with limits: the model's joints would no longer be the robot's",
}


@dataclass(frozen=True)
class NotWritten:
    """What the written model lacks, or has only nearly."""

    name: str  # of the parameter or effect, e.g. "load_friction.J2"
    size: float  # [Nm | N] root mean square over the reference motion, of what is lacking; NaN: not known
    reason: str


@dataclass
class JointParts:
    """Of one joint, at its reading. Sums where an effect stands twice."""

    coulomb: float = 0.0  # [Nm | N]
    damping: Floats = field(default_factory=lambda: np.zeros(3))  # of qd, qd |qd|, qd^3
    offset: float = 0.0  # [Nm | N]
    armature: float = 0.0  # [kg m^2 | kg]
    spring: float = 0.0  # [Nm/rad | N/m]
    presliding: list[tuple[float, float]] = field(default_factory=list)  # [Nm | N], x0 [rad | m]
    stribeck: list[tuple[float, float]] = field(default_factory=list)  # [Nm | N], vs [rad/s | m/s]
    ripple: dict[int, tuple[float, float]] = field(default_factory=dict)  # order: sin, cos [Nm | N]


@dataclass
class Parts:
    joints: list[JointParts]  # of those that have a reading
    beside: list[Effect]  # only a callback can do these
    tool_force: Floats  # shape=(3,) [N] that the drives must give, in the base's axes
    coupled_inertia: dict[tuple[int, int], float]  # at the first joint, by the second's acceleration
    not_written: list[NotWritten]


@dataclass(frozen=True)
class Reference:
    """The motion on which the sizes of effects are stated: recorded, or through the robot's range."""

    time: Floats  # shape=(n,) [s], evenly
    q: Floats  # shape=(n, joints) [rad | m]
    qd: Floats
    qdd: Floats
    torque: Floats  # shape=(n, joints) [Nm | N]: as recorded, or what the drives hold against gravity
    links: Floats  # shape=(n, joints) [Nm | N]: what of it the links take

    def size(self, effect: Effect) -> float:
        """[Nm | N] root mean square of an effect of `beside`."""
        smooth = smooth_torques(self.q, self.qd, self.torque, _WARM, _LATER, [effect])[:, effect[1]]
        return rms(np.sign(self.qd[:, effect[1]]) * self.friction(effect, _WARM, _LATER) - smooth)

    def friction(self, effect: Effect, temperature: float = REFERENCE_C, time: float = 0.0) -> Floats:
        """Dry friction of an effect of `beside` without its sign; below zero where it takes from that of
        others. shape=(n,) [Nm | N]"""
        zero = [0.0] * self.q.shape[1]
        positive, negative = (
            dry_friction(self.q, self.qd, self.torque, temperature, time, [one], zero, self.links)[
                :, effect[1]
            ]
            for one in (effect, (*effect[:3], _turned(effect[3])))
        )
        return np.asarray(positive - negative)


def _turned(parts: dict[str, float]) -> dict[str, float]:
    return {key: value if key in ("vs", "v0", "x0") else -value for key, value in parts.items()}


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def with_gravity_turned(robot: _core.Robot) -> _core.Robot:
    """The robot whose `gravity` has what its base is tilted by, g - tilt x g, in place of the effect."""
    gravity, rest = np.array(robot.gravity), []
    for applied in robot.torque_effects:
        if applied.effect == IN_GRAVITY:
            tilt = [applied.parameters.get(f"{IN_GRAVITY}.{axis}", 0.0) for axis in "xyz"]
            gravity = gravity - np.cross(tilt, robot.gravity)
        else:
            rest.append(applied)
    return (
        robot.replace(gravity=gravity, torque_effects=rest)
        if len(rest) < len(robot.torque_effects)
        else robot
    )


def reference_motion(robot: _core.Robot, chain: Chain) -> Reference:
    """20 s of sines, at every joint another frequency, through half its range and up to half its speed
    limit."""
    time = np.arange(0.0, *_REFERENCE)
    q, qd, qdd = (np.zeros((time.size, len(chain.driven))) for _ in range(3))
    for j, link in enumerate(chain.driven):
        ends = np.sort(np.array([link.lower, link.upper]) / link.ratio)
        usual = _USUAL_REACH[int(link.prismatic)]
        middle, reach = 0.0, usual
        if np.all(np.isfinite(ends)):
            middle, reach = float(ends.mean()), min(usual, _SHARE * float(ends[1] - ends[0]))
        speed = 0.5 * (link.speed_limit if np.isfinite(link.speed_limit) else 2.0 * _USUAL_SPEED)
        w = (
            min(speed / max(reach, 1e-9), 2.0 * np.pi)
            * (1.0 + _APART * j)
            / (1.0 + _APART * len(chain.driven))
        )
        phase = w * time + _PHASE * j
        q[:, j] = middle + reach * np.sin(phase)
        qd[:, j] = reach * w * np.cos(phase)
        qdd[:, j] = -reach * w * w * np.sin(phase)
    still = np.zeros_like(q)
    torque = np.asarray(_core.rigid_torques(robot, q, still, still))
    return Reference(time, q, qd, qdd, torque, torque)


def recorded_motion(robot: _core.Robot, chain: Chain, recordings: Sequence[Recorded]) -> Reference:
    """The recordings one after the other, and the torques of the drives in them."""
    rows: list[Floats] = []
    torques: list[Floats] = []
    steps: list[float] = []
    for recording in recordings:
        track, free = track_of(recording, robot, SMOOTHING)
        rows.append(np.asarray(np.stack([track.q, track.qd, track.qdd])[:, free], dtype=float))
        torques.append(drive_torque(robot, track.torque_time, track.torque, track.time)[free])
        steps.append(track.step)
    q, qd, qdd = (np.asarray(np.concatenate([table[k] for table in rows]), dtype=float) for k in range(3))
    time = float(np.median(steps)) * np.arange(len(q), dtype=np.float64)
    links = np.asarray(_core.rigid_torques(_bodies_only(robot, chain), q, qd, qdd))
    return Reference(time, q, qd, qdd, np.concatenate(torques), links)


def _bodies_only(robot: _core.Robot, chain: Chain) -> _core.Robot:
    """The robot with the chain's bodies, and no rotors."""
    bodies = {link.name: link.body for link in chain.links}
    return robot.replace(
        joints=[
            joint.replace(
                mass=bodies[joint.name].mass,
                center_of_mass=bodies[joint.name].center,
                inertia=bodies[joint.name].inertia,
                rotor_inertia=0.0,
            )
            for joint in robot.joints
        ]
    )


def parts_of(robot: _core.Robot, chain: Chain, reference: Reference) -> Parts:
    """Raises InputError for a joint that the robot lacks, or a parameter whose constant is missing."""
    number = {link.name: k for k, link in enumerate(chain.driven)}
    parts = Parts([JointParts() for _ in number], [], np.zeros(3), {}, [])
    for joint in robot.joints:
        if joint.name in number:
            parts.joints[number[joint.name]].armature += joint.rotor_inertia
        elif joint.rotor_inertia:
            parts.not_written.append(
                NotWritten(f"{joint.name}.rotor_inertia", np.nan, "of a joint that has no motor")
            )
    for change in chain.adjusted:
        size = change.inertia * (rms(reference.qdd) if reference.qdd.size else 0.0) + _GRAVITY * change.mass
        parts.not_written.append(
            NotWritten(f"inertia.{change.joint}", size, change.reason + ": nearest written")
        )
    for name, joint_name, by, values in _forms(robot):
        _check_parts(robot, name, joint_name, values)
        for who in (joint_name, by):
            if who and who not in number:
                raise InputError(
                    f"{robot.name}: torque effect {name} is of {who}, which has no reading; joints with one"
                    f" are {', '.join(number)}"
                )
        _add(parts, name, number.get(joint_name, -1), number.get(by, -1), values, joint_name, reference)
    return parts


def _check_parts(robot: _core.Robot, name: str, joint: str, values: dict[str, float]) -> None:
    """Raises InputError for a parameter that the effect has not."""
    if name in IN_BODIES:
        known = {joint.name for joint in robot.joints}
        for key in values if name == "link_inertia" else ():
            if key.split(".")[0] not in known:
                raise InputError(
                    f"{robot.name}: torque effect {name} is of {key.split('.')[0]}; joints are"
                    f" {', '.join(joint.name for joint in robot.joints)}"
                )
        return
    if name not in _PER_JOINT and name not in _PARTS:
        return
    for part in values:
        if name == "ripple":
            good, wanted = re.fullmatch(r"(sin|cos)\d+", part) is not None, "sin1, cos1, sin2 …"
        else:
            parts = _PARTS.get(name, ("",))
            good, wanted = part in parts, ", ".join(key or "nothing" for key in parts)
        if not good:
            raise InputError(
                f"{robot.name}: torque effect {name}{f' of {joint}' if joint else ''} has a parameter that"
                f" ends in {part!r}, expected {wanted}"
            )


def _forms(robot: _core.Robot) -> Iterator[tuple[str, str, str, dict[str, float]]]:
    """Effect, joint, causing joint, parameters without their prefix; of every form that the robot carries."""
    for applied in robot.torque_effects:
        found: dict[tuple[str, str], dict[str, float]] = {}
        for key, value in applied.parameters.items():
            words = key.split(".")
            if not np.isfinite(value):
                raise InputError(f"{robot.name}: parameter {key} of a torque effect is {value}, not a number")
            if applied.effect in _PER_JOINT and len(words) >= 2:
                found.setdefault((words[1], ""), {})[".".join(words[2:])] = value
            elif applied.effect == "coupling" and len(words) == 4:
                found.setdefault((words[1], words[2]), {})[words[3]] = value
            else:
                found.setdefault(("", ""), {})[".".join(words[1:])] = value
        for (joint, by), values in found.items():
            yield applied.effect, joint, by, values


def _add(
    parts: Parts,
    name: str,
    j: int,
    by: int,
    values: dict[str, float],
    joint: str,
    reference: Reference,
) -> None:
    if name in IN_BODIES:
        return
    if name in ONLY_MEASURED or name in _NO_PLACE:
        reason = ONLY_MEASURED.get(name) or _NO_PLACE[name]
        full = f"{name}.{joint}" if joint else name
        parts.not_written.append(NotWritten(full, _measured_size(name, j, values, reference), reason))
    elif name == "tool_force":
        parts.tool_force = parts.tool_force + np.array([values.get(axis, 0.0) for axis in "xyz"])
    elif name == "coupling":
        inertia = values.pop("inertia", 0.0)
        if inertia:
            parts.coupled_inertia[j, by] = parts.coupled_inertia.get((j, by), 0.0) + inertia
        if values:
            parts.beside.append((name, j, by, values))
    elif name in _PER_JOINT:
        _add_to_joint(parts, name, j, values, joint)
        if min(values.get("turn_travel", 0.0), values.get("turn_fade", 0.0)) > 0.0:
            parts.not_written.append(
                NotWritten(f"{name}.{joint}.turn_fade", _faded(j, values, reference), _HOLDS)
            )
    else:
        parts.not_written.append(
            NotWritten(name, np.nan, "an effect of one's own, whose law only its Python code knows")
        )


def _constant(name: str, joint: str, key: str, values: dict[str, float]) -> float:
    if not values.get(key, 0.0) > 0.0:
        raise InputError(
            f"torque effect {name} of {joint}: its constant {name}.{joint}.{key} is"
            f" {values.get(key, 'missing')}, expected a positive number"
        )
    return values[key]


def _add_to_joint(parts: Parts, name: str, j: int, values: dict[str, float], joint: str) -> None:
    own, value = parts.joints[j], values.get("", 0.0)
    if name == "coulomb":
        own.coulomb += value
    elif name == "viscous":
        own.damping[0] += value
    elif name == "current_offset":
        own.offset += value
    elif name == "armature":
        own.armature += value
    elif name == "spring":
        own.spring += value
    elif name == "presliding":
        own.presliding.append((value, _constant(name, joint, "x0", values)))
    elif name == "stribeck":
        own.stribeck.append((value, _constant(name, joint, "vs", values)))
    elif name == "ripple":
        for key, amplitude in values.items():
            order = int(key[3:])
            s, c = own.ripple.get(order, (0.0, 0.0))
            own.ripple[order] = (s + amplitude, c) if key.startswith("sin") else (s, c + amplitude)
    elif name == "viscous_law":
        own.damping[1] += values.get("quadratic", 0.0)
        own.damping[2] += values.get("cubic", 0.0)
        rest = {key: v for key, v in values.items() if key in ("root", "saturating", "v0")}
        if "saturating" in rest:
            _constant(name, joint, "v0", rest)
        if rest:
            parts.beside.append((name, j, j, rest))
    else:
        parts.beside.append((name, j, j, values))


def _faded(j: int, values: dict[str, float], reference: Reference) -> float:
    """[Nm | N] of what Coulomb friction forgets at rest (`stop_operator` in cpp/src/dynamics/turn.cpp)."""
    if reference.time.size < 2:
        return 0.0
    kept = np.exp(-(reference.time[1] - reference.time[0]) / values["turn_fade"])
    holding = fading = 0.0
    lost = [0.0]
    for move in (np.diff(reference.q[:, j]) / values["turn_travel"]).tolist():
        holding = min(max(holding + move, -1.0), 1.0)
        fading = min(max(kept * fading + move, -1.0), 1.0)
        lost.append(holding - fading)
    return abs(values.get("", 0.0)) * rms(np.array(lost))


def _measured_size(name: str, j: int, values: dict[str, float], reference: Reference) -> float:
    """[Nm | N] of what belongs to the measurement."""
    value = values.get("", 0.0)
    torque = reference.torque
    if name == "motor_constant":
        return abs(value) * rms(torque[:, j])
    if name in ("torque_lag", "time_offset"):
        rate = np.gradient(torque, reference.time, axis=0)
        return abs(value) * rms(rate[:, j] if j >= 0 else rate)
    return float("nan")


@dataclass(frozen=True)
class StandIn:
    """What Coulomb friction and damping can do for a law that the model has no field for."""

    coulomb: float
    viscous: float
    left: float  # [Nm | N] root mean square of what they cannot do


def stand_in(effect: Effect, reference: Reference) -> StandIn:
    """Least squares over the reference motion of the friction without its sign, by 1 and abs(qd),
    neither with the other sign."""
    j = effect[1]
    if effect[0] not in ("load_friction", "viscous_law", "stribeck", "position_friction"):
        return StandIn(0.0, 0.0, reference.size(effect))
    wanted, speed = reference.friction(effect), np.abs(reference.qd[:, j])
    columns = np.column_stack([np.ones_like(speed), speed])
    constant, slope = np.linalg.lstsq(columns, wanted, rcond=None)[0].tolist()
    mean = float(wanted.mean())
    if constant * mean < 0.0:  # neither works against what it stands for
        constant, slope = 0.0, float(speed @ wanted) / max(float(speed @ speed), 1e-12)
    elif slope * mean < 0.0:
        constant, slope = mean, 0.0
    return StandIn(constant, slope, rms(wanted - constant - slope * speed))


def stand_ins(
    chain: Chain, parts: Parts, reference: Reference, place: str
) -> tuple[Floats, list[NotWritten]]:
    """Coulomb friction and damping that stand for what only a callback can do, shape=(joints, 2), and what a
    format without callbacks, tendons and forces at the tool has no place for. place: "no place in URDF".
    """
    names = [link.name for link in chain.driven]
    extra = np.zeros((len(names), 2))
    left = []
    for effect in parts.beside:
        instead = stand_in(effect, reference)
        extra[effect[1]] += instead.coulomb, instead.viscous
        reason = place + ("; friction and damping stand for it" if instead.coulomb else "")
        left.append(NotWritten(name_of(effect, names), instead.left, reason))
    for (a, b), c in parts.coupled_inertia.items():
        size = abs(c) * rms(reference.qdd[:, b])
        left.append(NotWritten(f"coupling.{names[a]}.{names[b]}.inertia", size, place))
    if parts.tool_force.any():
        left.append(NotWritten("tool_force", float("nan"), place))
    for j, (name, own) in enumerate(zip(names, parts.joints, strict=True)):
        left += _without_place(name, own, reference.q[:, j], reference.qd[:, j], place)
    return extra, left


def name_of(effect: Effect, names: Sequence[str]) -> str:
    """ "load_friction.J2", "coupling.J5.J6"."""
    joints = effect[1:3] if effect[0] == "coupling" else effect[1:2]
    return ".".join([effect[0], *(names[j] for j in joints)])


def _without_place(name: str, own: JointParts, q: Floats, qd: Floats, place: str) -> list[NotWritten]:
    """Fields of a joint that MJCF has, and neither URDF nor Isaac Lab."""
    sizes = {
        f"viscous_law.{name}.quadratic": own.damping[1] * rms(qd * qd),
        f"viscous_law.{name}.cubic": own.damping[2] * rms(qd**3),
        f"current_offset.{name}": own.offset,
        f"spring.{name}": own.spring * rms(q),
    }
    for order, (s, c) in own.ripple.items():
        sizes[f"ripple.{name}.{order}"] = rms(s * np.sin(order * q) + c * np.cos(order * q))
    out = [NotWritten(key, float(abs(size)), place) for key, size in sizes.items() if size]
    out += [
        NotWritten(f"presliding.{name}", abs(size), "written as friction, without its build-up over x0")
        for size, _ in own.presliding
        if size
    ]
    return out


def negative(what: str, joint: str, size: float) -> list[NotWritten]:
    """Of a field that may not be below zero: what is not written of it. size: [Nm | N] with its sign."""
    return [NotWritten(f"{what}.{joint}", -size, "negative: none written")] if size < 0.0 else []


def drive_torque(robot: _core.Robot, time: Floats, torque: Floats, at: Floats) -> Floats:
    """The drives' torques at the times `at`, shape=(at, joints) [Nm | N], from those measured: gains, lags
    and the clock that the robot's torque effects say the measurement has are taken out.

    measured = (1 + motor_constant) T - torque_lag dT/dt + time_offset dT/dt, to first order.
    """
    names = [joint.name for joint in robot.joints if not joint.passive]
    gain, late = np.ones(len(names)), np.zeros(len(names))
    for effect in robot.torque_effects:
        for key, value in effect.parameters.items():
            joint = key.partition(".")[2]
            if effect.effect == "time_offset":
                late -= value
            elif effect.effect == "motor_constant":
                gain[names.index(joint)] += value
            elif effect.effect == "torque_lag":
                late[names.index(joint)] += value
    return np.column_stack([np.interp(at + late[j], time, torque[:, j]) / gain[j] for j in range(len(names))])
