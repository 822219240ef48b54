# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""URDF: the chain and its limits, or the origins of the URDF that the robot was read from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from truing import _core
from truing.chains import FixedFrames, fixed_frames
from truing.controllers.chain import Floats, origins, robot_of
from truing.controllers.distances import between, dropped_effects, dropped_ratios, poses_of
from truing.controllers.written import Written
from truing.errors import InputError
from truing.files import load_robot

FILE = "robot.urdf"
BASE = "base_link"
_REASON = "URDF has no place for it: its joint is at the reading"
_NO_LIMIT = 1e9  # [Nm, N, rad/s, m/s] URDF demands limits where there are none


def written(robot: _core.Robot, source: Path | None, base_link: str = "", tip_link: str = "") -> Written:
    """source: the URDF that the robot was read from; its meshes and names are kept. base_link, tip_link: the
    chain in it. Raises InputError.
    """
    links = fixed_frames(robot)
    frames = origins(links)
    if source is None:
        text = _anew(robot, links, frames)
        exported = robot_of(frames, robot, [link.axis for link in links])
    else:
        if robot.convention != "urdf":
            raise InputError(
                f"{source}: the calibrated robot has convention {robot.convention}, so it was not read from"
                " a URDF: leave --source out"
            )
        nominal = load_robot(source, base_link, tip_link)
        if [joint.name for joint in nominal.joints] != [joint.name for joint in robot.joints]:
            raise InputError(
                f"{source}: has other joints than {robot.name}: is it the URDF that it was read from?"
            )
        text = source.read_text(encoding="utf-8-sig")
        text = _core.urdf_with_calibration(text, robot, base_link, tip_link)
        exported = robot_of(frames, robot, [link.axis for link in links])
    notes = []
    if source is None and any(joint.mass is not None for joint in robot.joints):
        notes.append("masses are not written: truing dynamics export --to urdf")
    return Written(
        files={FILE: text},
        values={"urdf": {"base_link": BASE if source is None else "", "tool": robot.targets[0].name}},
        lines=[("joints", ", ".join(joint.name for joint in robot.joints))],
        dropped=[*dropped_ratios(robot, _REASON), *dropped_effects(robot, _REASON)],
        notes=notes,
        remaining=between(robot.replace(T_measurement_base=np.eye(4)), exported, poses_of(robot)),
    )


def _anew(robot: _core.Robot, links: Sequence[FixedFrames], frames: Sequence[Floats]) -> str:
    root = ElementTree.Element("robot", name=robot.name or "robot")
    ElementTree.SubElement(root, "link", name=BASE)
    parent = BASE
    for link, origin in zip(links, frames, strict=False):
        child = f"{link.joint.name}_link"
        ElementTree.SubElement(root, "link", name=child)
        _joint(root, link, origin, parent, child)
        parent = child
    for target in robot.targets:
        ElementTree.SubElement(root, "link", name=target.name)
        fixed = ElementTree.SubElement(root, "joint", name=f"{target.name}_fixed", type="fixed")
        _ends(fixed, frames[-1] @ np.asarray(target.T_last_target), parent, target.name)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _ends(joint: ElementTree.Element, T: Floats, parent: str, child: str) -> None:
    rpy = _core.rpy_from_rotation(np.array(T[:3, :3]))
    ElementTree.SubElement(joint, "origin", xyz=_plain(T[:3, 3]), rpy=_plain(rpy))
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)


def _joint(root: ElementTree.Element, link: FixedFrames, origin: Floats, parent: str, child: str) -> None:
    joint = link.joint
    limited = math.isfinite(joint.lower) and math.isfinite(joint.upper)
    kind = "prismatic" if joint.type == "prismatic" else "revolute" if limited else "continuous"
    element = ElementTree.SubElement(root, "joint", name=joint.name, type=kind)
    _ends(element, origin, parent, child)
    ElementTree.SubElement(element, "axis", xyz=_plain(link.axis))
    limit = ElementTree.SubElement(
        element,
        "limit",
        effort=_plain([min(joint.torque_limit, _NO_LIMIT)]),
        velocity=_plain([min(joint.speed_limit, _NO_LIMIT)]),
    )
    if kind != "continuous":
        limit.set("lower", _plain([max(joint.lower, -_NO_LIMIT)]))
        limit.set("upper", _plain([min(joint.upper, _NO_LIMIT)]))
    if joint.driven_by:
        if len(joint.driven_by) > 1:
            raise InputError(
                f"{joint.name} follows {len(joint.driven_by)} joints, and a URDF's mimic follows one: this"
                " robot has no URDF"
            )
        (driver, weight), *_ = joint.driven_by
        ElementTree.SubElement(element, "mimic", joint=driver, multiplier=_plain([weight]))


def _plain(values: Sequence[float] | Floats) -> str:
    """Numbers as text that reads back to the same doubles."""
    return " ".join(repr(float(value) + 0.0) for value in values)
