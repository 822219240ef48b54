# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""URDF: origins, inertials, `dynamics` (damping, friction), limits. Nothing else of a torque has a place
there."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np

from truing import _core
from truing.dynamics.export.chain import Body, Chain, Floats, Link, body_in, plain
from truing.dynamics.export.parts import NotWritten, Parts, Reference, negative, rms, stand_ins
from truing.errors import InputError

Element = ElementTree.Element
_NO_PLACE = "no place in URDF"
_NO_LIMIT = 1e9  # [Nm, rad/s]: URDF demands limits where there are none


def write(
    robot: _core.Robot, chain: Chain, parts: Parts, reference: Reference, source: str | None
) -> tuple[str, list[NotWritten]]:
    """The text of the URDF, and what it has no place for.

    source: text of the URDF that the robot was read from; its meshes, materials and other branches stay.
    """
    left = list(parts.not_written)
    dynamics = _dynamics(chain, parts, reference, left)
    if source is None:
        text = _anew(robot, chain, parts, dynamics)
    else:
        text = _into(source, robot, chain, parts, dynamics)
    for link in chain.driven:
        if link.ratio != 1.0:
            reason = "URDF has no ratios: its joint is at ratio * reading, and its torques are at that joint"
            left.append(NotWritten(f"{link.name}.ratio", 0.0, reason))
    return text, left


def _dynamics(
    chain: Chain, parts: Parts, reference: Reference, left: list[NotWritten]
) -> dict[str, tuple[float, float]]:
    """Damping and friction by joint, at the simulator's joints; what they cannot say is added to `left`."""
    out: dict[str, tuple[float, float]] = {}
    extra, no_place = stand_ins(chain, parts, reference, _NO_PLACE)
    left += no_place
    for j, (link, own) in enumerate(zip(chain.driven, parts.joints, strict=True)):
        qd, qdd = reference.qd[:, j], reference.qdd[:, j]
        friction = own.coulomb + float(extra[j, 0]) + sum(size for size, _ in own.presliding)
        damping = float(own.damping[0] + extra[j, 1])
        sizes = {f"armature.{link.name}": own.armature * rms(qdd)}
        for size, speed in own.stribeck:
            sizes[f"stribeck.{link.name}"] = size * rms(np.exp(-((qd / speed) ** 2)))
        left += [NotWritten(key, abs(size), _NO_PLACE) for key, size in sizes.items() if size]
        left += negative("coulomb", link.name, friction) + negative("viscous", link.name, damping * rms(qd))
        out[link.name] = (max(damping, 0.0) / link.ratio**2, max(friction, 0.0) / abs(link.ratio))
    return out


def _origin(T: Floats) -> dict[str, str]:
    return {"xyz": plain(T[:3, 3]), "rpy": plain(np.array(_core.rpy_from_rotation(T[:3, :3])))}


def _inertial(body: Body) -> Element:
    out = Element("inertial")
    ElementTree.SubElement(out, "origin", xyz=plain(body.center), rpy="0.0 0.0 0.0")
    ElementTree.SubElement(out, "mass", value=plain(body.mass))
    I = body.inertia  # noqa: E741
    ElementTree.SubElement(
        out,
        "inertia",
        {
            key: plain(I["xyz".index(key[1]), "xyz".index(key[2])])
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        },
    )
    return out


def _set_dynamics(joint: Element, values: tuple[float, float]) -> None:
    dynamics = joint.find("dynamics")
    if dynamics is None:
        dynamics = ElementTree.SubElement(joint, "dynamics")
    dynamics.set("damping", plain(values[0]))
    dynamics.set("friction", plain(values[1]))


def _anew(robot: _core.Robot, chain: Chain, parts: Parts, dynamics: dict[str, tuple[float, float]]) -> str:
    root = Element("robot", name=robot.name or "robot")
    ElementTree.SubElement(root, "link", name="base_link")
    parent, before = "base_link", np.eye(4)
    for link in chain.links:
        child = f"{link.name}_link"
        body = ElementTree.SubElement(root, "link", name=child)
        body.append(_inertial(body_in(link.after, link.body)))
        root.append(_joint(link, parent, child, before, dynamics.get(link.name)))
        parent, before = child, link.after
    targets = [(t.name, before @ np.array(t.T_last_target)) for t in robot.targets] or [("flange", before)]
    for name, T in targets:
        ElementTree.SubElement(root, "link", name=name)
        fixed = ElementTree.SubElement(root, "joint", name=f"{name}_fixed", type="fixed")
        ElementTree.SubElement(fixed, "origin", _origin(T))
        ElementTree.SubElement(fixed, "parent", link=parent)
        ElementTree.SubElement(fixed, "child", link=name)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _joint(
    link: Link, parent: str, child: str, before: Floats, dynamics: tuple[float, float] | None
) -> Element:
    limited = bool(np.isfinite(link.lower) and np.isfinite(link.upper))
    kind = "prismatic" if link.prismatic else ("revolute" if limited else "continuous")
    joint = Element("joint", name=link.name, type=kind)
    ElementTree.SubElement(joint, "origin", _origin(before @ link.before))
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "axis", xyz=plain(link.axis))
    effort = min(link.torque_limit / abs(link.ratio), _NO_LIMIT)
    speed = min(link.speed_limit * abs(link.ratio), _NO_LIMIT)
    limit = ElementTree.SubElement(joint, "limit", effort=plain(effort), velocity=plain(speed))
    if limited or link.prismatic:
        limit.set("lower", plain(max(link.lower, -_NO_LIMIT)))
        limit.set("upper", plain(min(link.upper, _NO_LIMIT)))
    if link.drivers:
        if len(link.drivers) > 1:
            raise InputError(
                f"{link.name} follows {len(link.drivers)} joints, and a URDF's mimic follows one: export to"
                " mjcf"
            )
        (driver, weight), *_ = link.drivers
        ElementTree.SubElement(joint, "mimic", joint=driver, multiplier=plain(weight))
    if dynamics is not None:
        _set_dynamics(joint, dynamics)
    return joint


def _into(
    source: str, robot: _core.Robot, chain: Chain, parts: Parts, dynamics: dict[str, tuple[float, float]]
) -> str:
    """The source with calibrated origins, and inertials and dynamics set. The mass of links that are fixed
    to a moving one was merged into it when the robot was read, so theirs go."""
    base, tip = _ends(source, robot)
    text = _core.urdf_with_calibration(source, robot, base, tip)
    comments = "".join(re.findall(r"<!--.*?-->", text.split("<robot", 1)[0], flags=re.DOTALL))
    root = _parsed(text)
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    bodies = {body.get("name", ""): body for body in root.findall("link")}
    for link in chain.links:
        child = _child(joints[link.name])
        for merged in _fixed_to(child, root):
            for old in bodies[merged].findall("inertial"):
                bodies[merged].remove(old)
        for old in bodies[child].findall("inertial"):
            bodies[child].remove(old)
        bodies[child].insert(0, _inertial(body_in(link.after, link.body)))
        if link.name in dynamics:
            _set_dynamics(joints[link.name], dynamics[link.name])
    ElementTree.indent(root)
    return f"{comments}\n" * bool(comments) + ElementTree.tostring(root, encoding="unicode") + "\n"


def _parsed(text: str) -> Element:
    keeping_comments = ElementTree.TreeBuilder(insert_comments=True)
    try:
        return ElementTree.fromstring(text, parser=ElementTree.XMLParser(target=keeping_comments))
    except ElementTree.ParseError as error:
        raise InputError(f"the source is not a URDF: {error}") from None


def _ends(source: str, robot: _core.Robot) -> tuple[str, str]:
    """The link that the chain begins at, and the link that its last joint moves: of several ends a URDF
    has, the calibration is told which."""
    root = _parsed(source)
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    missing = [joint.name for joint in robot.joints if joint.name not in joints]
    if missing:
        raise InputError(
            f"the source URDF has no joint {missing[0]}; its joints are {', '.join(sorted(joints))}: give"
            " the URDF that the robot was read from, or none"
        )
    moved = {_child(joint) for joint in root.findall("joint")}
    roots = [link.get("name", "") for link in root.findall("link") if link.get("name", "") not in moved]
    return (roots[0] if len(roots) == 1 else ""), _child(joints[robot.joints[-1].name])


def _child(joint: Element) -> str:
    child = joint.find("child")
    return child.get("link", "") if child is not None else ""


def _fixed_to(link: str, root: Element) -> list[str]:
    """Links that hang on `link` by fixed joints alone."""
    found: list[str] = []
    for joint in root.findall("joint"):
        parent = joint.find("parent")
        if joint.get("type") == "fixed" and parent is not None and parent.get("link") == link:
            found += [_child(joint), *_fixed_to(_child(joint), root)]
    return found
