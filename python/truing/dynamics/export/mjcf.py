# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo's MJCF. Numbers are written in full: MjSpec.to_xml keeps six digits, which moves a tool by 0.01 mm.

Effects and elements of MuJoCo 4:

- dry friction: frictionloss with solreffriction, without which a joint creeps below some hundredths of a
  rad/s, and solimpfriction, without which light joints creep under load.
- friction by speed: damping, a polynomial of speed with its sign.
- presliding and Stribeck: a passive `dcmotor` with LuGre friction: dz/dt = v - s0 |v| / g(v) z, force s0 z,
  where
  g(v) = F_C + (F_S - F_C) exp(-(v / v_S)^2). With s0 = F_C / x0 a reversal costs the same work as with the
  stop operator of `presliding`: the area between either law and full friction is 2 x0 F_C.
- ripple, constant torques: `dcmotor` cogging, amplitude * sin(poles * q + phase).
- friction that grows with the load or goes with the angle: a spatial tendon (`lever`), where that is near it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from truing import _core
from truing.dynamics.export.beside import NO_CALLBACKS, Effect
from truing.dynamics.export.chain import Body, Chain, Floats, Link, body_in, plain
from truing.dynamics.export.lever import Lever, ends, lever_for
from truing.dynamics.export.parts import (
    JointParts,
    NotWritten,
    Parts,
    Reference,
    name_of,
    negative,
    rms,
    stand_in,
)
from truing.rotations import quaternions_from_rotations

STEP = 0.001  # [s] of the model
FRICTION_HOLDS = (0.9999, 0.9999, 0.001)  # solimpfriction: with MuJoCo's 0.9 light joints creep
FRICTION_TIME = 0.004  # [s] solreffriction: with MuJoCo's 0.02 dry friction is viscous below 0.03 rad/s
_EQUALITY = 0.004  # [s] the same of joints that follow others
_HIDDEN = "5"  # group that viewers do not show: the far end of a tendon is metres away
_STRIBECK_X0 = 1e-3  # [rad | m] over which a Stribeck friction without presliding builds up

Element = ElementTree.Element


def _child(parent: Element, tag: str, *attributes: dict[str, str], **more: str) -> Element:
    """An element in `parent`."""
    together = {key: value for table in (more, *attributes) for key, value in table.items()}
    return ElementTree.SubElement(parent, tag, together)


@dataclass
class JointFields:
    """What is written of a joint, at its reading; `frictionloss` and `damping` without callbacks."""

    coulomb: float = 0.0  # may be negative where callbacks add to it
    frictionloss: float = 0.0
    damping: Floats = field(default_factory=lambda: np.zeros(3))
    armature: float = 0.0
    lugre: list[tuple[float, float, float, float]] = field(default_factory=list)  # s0, F_C, F_S, v_S
    cogging: list[tuple[float, int, float]] = field(default_factory=list)  # amplitude, poles, phase


@dataclass
class Tendon:
    """A fixed tendon: what two joints share."""

    name: str
    coefficients: dict[int, float]  # of readings
    damping: float = 0.0
    armature: float = 0.0


@dataclass
class LeverTendon:
    """A spatial tendon whose friction stands for an effect."""

    effect: str  # "load_friction.J2"
    joint: str
    lever: Lever


@dataclass
class Model:
    """What an MJCF says, and what is left."""

    joints: list[JointFields]
    tendons: list[Tendon]
    beside: list[Effect]
    not_written: list[NotWritten]
    levers: list[LeverTendon] = field(default_factory=list)
    fields_beside: dict[str, list[float]] = field(default_factory=dict)
    """What the callbacks add to: friction and damping without stand-ins for what they compute."""


def model_of(chain: Chain, parts: Parts, reference: Reference, levers: bool) -> Model:
    """levers: tendons may stand for friction; then callbacks.py does not belong to the model."""
    names = [link.name for link in chain.driven]
    model = Model([], [], [], list(parts.not_written))
    for j, own in enumerate(parts.joints):
        model.joints.append(_fields(j, names[j], own, model, reference))
    _couple(parts, names, model, reference)
    model.beside += [effect for effect in parts.beside if effect[0] != "coupling"]
    model.fields_beside = {
        "frictionloss": [fields.coulomb for fields in model.joints],
        "damping": [float(fields.damping[0]) for fields in model.joints],
    }
    for effect in model.beside:
        fields, link = model.joints[effect[1]], chain.driven[effect[1]]
        if levers and (lever := _lever(effect, link, reference)) is not None:
            name = name_of(effect, names)
            model.levers.append(LeverTendon(name, link.name, lever))
            fields.frictionloss += lever.constant * abs(link.ratio)
            fields.damping[0] += lever.slope * link.ratio**2
            reason = "the friction of a tendon, which goes with the joint's angle, stands for it"
            model.not_written.append(NotWritten(name, lever.left * abs(link.ratio), reason))
            continue
        instead = stand_in(effect, reference)
        fields.frictionloss += instead.coulomb
        fields.damping[0] += instead.viscous
        with_which = "; Coulomb friction and damping stand for it without them" if instead.coulomb else ""
        reason = f"in callbacks.py{with_which}"
        model.not_written.append(NotWritten(name_of(effect, names), instead.left, reason))
    for j, fields in enumerate(model.joints):
        if fields.frictionloss < 0.0:
            reason = "MuJoCo has no negative dry friction: none written"
            model.not_written.append(NotWritten(f"coulomb.{names[j]}", -fields.frictionloss, reason))
            fields.frictionloss = 0.0
    return model


def _lever(effect: Effect, link: Link, reference: Reference) -> Lever | None:
    """What a tendon can do for friction of a joint that turns."""
    if link.prismatic or effect[0] not in ("load_friction", "position_friction"):
        return None
    j, r = effect[1], link.ratio
    friction = reference.friction(effect) / abs(r)
    return lever_for(friction, r * reference.q[:, j], r * reference.qd[:, j])


def _fields(j: int, name: str, own: JointParts, model: Model, reference: Reference) -> JointFields:
    out = JointFields(damping=own.damping.copy(), armature=own.armature)
    coulomb = own.coulomb
    for size, x0 in own.presliding:
        if size > 0.0:
            out.lugre.append((size / x0, size, size, 1.0))
        else:
            coulomb += size
            reason = "negative: taken from Coulomb friction without its build-up"
            model.not_written.append(NotWritten(f"presliding.{name}", abs(size), reason))
    for size, speed in own.stribeck:
        if out.lugre and out.lugre[0][1] + size > 0.0 and out.lugre[0][1] == out.lugre[0][2]:
            stiffness, level, _, _ = out.lugre[0]
            out.lugre[0] = (stiffness, level, level + size, speed)
        elif not out.lugre and coulomb > 0.0 and coulomb + size > 0.0:
            out.lugre.append((coulomb / _STRIBECK_X0, coulomb, coulomb + size, speed))
            coulomb = 0.0
        else:
            model.beside.append(("stribeck", j, j, {"": size, "vs": speed}))
    out.coulomb = out.frictionloss = coulomb
    if own.armature < 0.0:
        model.not_written += negative("armature", name, own.armature * rms(reference.qdd[:, j]))
        out.armature = 0.0
    # The drive must give these, so the joint feels them with the other sign.
    for order, (s, c) in sorted(own.ripple.items()):
        out.cogging.append((math.hypot(s, c), order, math.atan2(-c, -s)))
    if own.offset:
        out.cogging.append((-own.offset, 0, math.pi / 2))
    return out


def _couple(parts: Parts, names: list[str], model: Model, reference: Reference) -> None:
    """Couplings that act both ways alike are tendons; those that act one way, which no passive part does, are
    left to the callbacks (friction) or not written (inertia)."""
    for (a, b), c in sorted(parts.coupled_inertia.items()):
        whole = f"coupling.{names[a]}.{names[b]}.inertia"
        size = abs(c) * rms(reference.qdd[:, b])
        if not math.isclose(parts.coupled_inertia.get((b, a), 0.0), c, rel_tol=1e-6):
            reason = "acts one way: no simulator's mass matrix is unsymmetric"
            model.not_written.append(NotWritten(whole, size, reason))
        elif a < b:
            own, other = model.joints[a], model.joints[b]
            tendon = _shared(f"inertia_{names[a]}_{names[b]}", a, b, c, own.armature, other.armature)
            if tendon is None:
                reason = "larger than the armatures of its joints can carry"
                model.not_written.append(NotWritten(whole, size, reason))
                continue
            own.armature -= abs(c) * tendon.coefficients[a] ** 2
            other.armature -= abs(c) * tendon.coefficients[b] ** 2
            tendon.armature = abs(c)
            model.tendons.append(tendon)
    left = [
        (name, a, b, dict(values)) for name, a, b, values in parts.beside if name == "coupling" and values
    ]
    viscous: dict[tuple[int, int], float] = {}
    for _, a, b, values in left:
        viscous[a, b] = viscous.get((a, b), 0.0) + values.get("viscous", 0.0)
    for (a, b), c in sorted(viscous.items()):
        if not (a < b and c and math.isclose(viscous.get((b, a), 0.0), c, rel_tol=1e-6)):
            continue
        own, other = model.joints[a], model.joints[b]
        tendon = _shared(f"damping_{names[a]}_{names[b]}", a, b, c, own.damping[0], other.damping[0])
        if tendon is None:
            continue
        own.damping[0] -= abs(c) * tendon.coefficients[a] ** 2
        other.damping[0] -= abs(c) * tendon.coefficients[b] ** 2
        tendon.damping = abs(c)
        model.tendons.append(tendon)
        for _, x, y, values in left:
            if (x, y) in ((a, b), (b, a)):
                values.pop("viscous", None)
    model.beside += [effect for effect in left if effect[3]]


def _shared(name: str, a: int, b: int, c: float, own: float, other: float) -> Tendon | None:
    """A tendon of length t q_a + q_b sign(c) / t, whose |c| gives c between the joints and adds |c| t^2 and
    |c| / t^2 to their own, which the joints must have: possible where c^2 <= own * other."""
    if own <= 0.0 or other <= 0.0 or c * c > own * other * (1.0 + 1e-12):
        return None
    t = (own / other) ** 0.25
    return Tendon(name, {a: t, b: math.copysign(1.0 / t, c)})


def write(robot: _core.Robot, chain: Chain, parts: Parts, model: Model, callbacks_model: str = "") -> str:
    """The text of the MJCF. callbacks_model: the file that callbacks.py belongs to, if it is not this one."""
    root = Element("mujoco", model=robot.name or "robot")
    _child(root, "compiler", angle="radian", autolimits="true")
    gravity = plain(np.array(robot.gravity))
    _child(root, "option", timestep=plain(STEP), integrator="implicitfast", gravity=gravity)
    world = _child(root, "worldbody")
    _child(world, "site", name="base")
    fields = dict(zip((link.name for link in chain.driven), model.joints, strict=True))
    springs = dict(zip((link.name for link in chain.driven), (p.spring for p in parts.joints), strict=True))
    parent, before = world, np.eye(4)
    for link in chain.links:
        behind = parent
        parent = _child(behind, "body", _pose(before @ link.before), name=f"{link.name}_link")
        _inertial(parent, body_in(link.after, link.body))
        _joint(parent, link, fields.get(link.name), springs.get(link.name, 0.0))
        for tendon in (one for one in model.levers if one.joint == link.name):
            far, near = ends(link.axis, tendon.lever.zero)
            at = before @ link.before @ np.append(far, 1.0)
            _child(behind, "site", name=f"{tendon.effect}.far", pos=plain(at[:3]), group=_HIDDEN)
            _child(parent, "site", name=f"{tendon.effect}.lever", pos=plain(near), group=_HIDDEN)
        before = link.after
    for target in robot.targets:
        _child(parent, "site", _pose(before @ np.array(target.T_last_target)), name=target.name)
    if not robot.targets:
        _child(parent, "site", _pose(before), name="flange")
    _followers(root, chain, model)
    _actuators(root, robot, chain, parts, model)
    if callbacks_model:
        _child(_child(root, "custom"), "text", name=NO_CALLBACKS, data=callbacks_model)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _pose(T: Floats) -> dict[str, str]:
    return {"pos": plain(T[:3, 3]), "quat": plain(quaternions_from_rotations(T[None, :3, :3])[0])}


def _inertial(parent: Element, body: Body) -> None:
    I = body.inertia  # noqa: E741
    six = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
    _child(parent, "inertial", pos=plain(body.center), mass=plain(body.mass), fullinertia=plain(six))


def _joint(parent: Element, link: Link, fields: JointFields | None, spring: float) -> None:
    joint = _child(
        parent, "joint", name=link.name, type="slide" if link.prismatic else "hinge", axis=plain(link.axis)
    )
    if np.isfinite(link.lower) and np.isfinite(link.upper):
        joint.set("range", plain([link.lower, link.upper]))
    if fields is None:
        return
    r = link.ratio  # torque at the joint = torque at the reading / r
    if fields.armature:
        joint.set("armature", plain(fields.armature / r**2))
    if fields.damping.any():
        joint.set("damping", plain(fields.damping / np.array([r**2, abs(r) ** 3, r**4])))
    if spring:
        joint.set("stiffness", plain(spring / r**2))
    joint.set("solreffriction", plain([FRICTION_TIME, 1.0]))
    joint.set("solimpfriction", plain(FRICTION_HOLDS))
    if fields.frictionloss:
        joint.set("frictionloss", plain(fields.frictionloss / abs(r)))


def _followers(root: Element, chain: Chain, model: Model) -> None:
    """Joints that follow others, tendons of couplings and of friction."""
    names = [link.name for link in chain.driven]
    ratio = {link.name: link.ratio for link in chain.driven}
    followers = [link for link in chain.links if link.drivers]
    if followers or model.tendons or model.levers:
        tendons = _child(root, "tendon")
    for held in model.levers:
        spatial = _child(tendons, "spatial", name=held.effect, group=_HIDDEN)
        spatial.set("frictionloss", plain(held.lever.force))
        spatial.set("solreffriction", plain([FRICTION_TIME, 1.0]))
        spatial.set("solimpfriction", plain(FRICTION_HOLDS))
        for end in ("far", "lever"):
            _child(spatial, "site", site=f"{held.effect}.{end}")
    for tendon in model.tendons:
        fixed = _child(tendons, "fixed", name=tendon.name)
        if tendon.damping:
            fixed.set("damping", plain(tendon.damping))
        if tendon.armature:
            fixed.set("armature", plain(tendon.armature))
        for j, c in tendon.coefficients.items():
            _child(fixed, "joint", joint=names[j], coef=plain(c / ratio[names[j]]))
    if followers:
        equality = _child(root, "equality")
    for link in followers:
        fixed = _child(tendons, "fixed", name=f"{link.name}_follows")
        _child(fixed, "joint", joint=link.name, coef="1")
        for driver, weight in link.drivers:
            _child(fixed, "joint", joint=driver, coef=plain(-weight))
        _child(equality, "tendon", tendon1=f"{link.name}_follows", solref=plain([_EQUALITY, 1.0]))


def _actuators(root: Element, robot: _core.Robot, chain: Chain, parts: Parts, model: Model) -> None:
    """Motors first, by joint; then what is passive. By their gear all are at the readings."""
    actuators = _child(root, "actuator")
    for link in chain.driven:
        motor = _child(
            actuators, "motor", name=f"drive_{link.name}", joint=link.name, gear=plain(1.0 / link.ratio)
        )
        if np.isfinite(link.torque_limit):
            motor.set("ctrlrange", plain([-link.torque_limit, link.torque_limit]))
    passive = {"motorconst": "0 0", "resistance": "1", "input": "none"}
    for link, fields in zip(chain.driven, model.joints, strict=True):
        elements = [
            (f"friction_{link.name}", "lugre", [s0, 0.0, level, still, speed])
            for s0, level, still, speed in fields.lugre
        ] + [(f"torque_{link.name}", "cogging", list(values)) for values in fields.cogging]
        for k, (name, kind, numbers) in enumerate(elements):
            _child(
                actuators,
                "dcmotor",
                {**passive, kind: plain(numbers)},
                name=name if k == 0 else f"{name}_{k}",
                joint=link.name,
                gear=plain(1.0 / link.ratio),
            )
    if parts.tool_force.any():
        site = robot.targets[0].name if robot.targets else "flange"
        _child(
            actuators,
            "dcmotor",
            passive,
            name="tool_force",
            site=site,
            refsite="base",
            gear=plain([*-parts.tool_force, 0.0, 0.0, 0.0]),
            cogging=plain([1.0, 0.0, math.pi / 2]),
        )
