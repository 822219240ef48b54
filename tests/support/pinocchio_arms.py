# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""URDF arms that truing and Pinocchio both read."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import truing

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]


def urdf(name: str, joints: str) -> str:
    """A URDF with the given joints, and every link that they name."""
    links = dict.fromkeys(re.findall(r'link="(\w+)"', joints))
    inertia = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return (
        f'<?xml version="1.0"?>\n<robot name="{name}">'
        + "".join(f'<link name="{link}">{inertia}</link>' for link in links)
        + joints
        + "</robot>"
    )


LIMITS = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'

# Origins turned about all three axes, axes along x, y, z and -z; fixed joints before, between and behind.
ARM = urdf(
    "arm",
    f"""
  <joint name="mount" type="fixed"><parent link="world"/><child link="foot"/>
    <origin xyz="0.3 -0.2 0.5" rpy="0.3 -0.7 1.9"/></joint>
  <joint name="A1" type="revolute"><parent link="foot"/><child link="l1"/>
    <origin xyz="0 0.01 0.4" rpy="0.1 0.2 -0.3"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="A2" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="0.15 0 0.1" rpy="-1.57 0 0.4"/><axis xyz="0 1 0"/>{LIMITS}</joint>
  <joint name="spacer" type="fixed"><parent link="l2"/><child link="l2b"/>
    <origin xyz="0.05 0.02 -0.01" rpy="0.7 1.1 -2.0"/></joint>
  <joint name="spacer2" type="fixed"><parent link="l2b"/><child link="l2c"/>
    <origin xyz="0 0.02 0.3" rpy="0 0 3.1"/></joint>
  <joint name="A3" type="revolute"><parent link="l2c"/><child link="l3"/><origin xyz="0.6 0 0" rpy="0 1.5 0"/>
    <axis xyz="1 0 0"/>{LIMITS}</joint>
  <joint name="A4" type="continuous"><parent link="l3"/><child link="l4"/>
    <origin xyz="0.1 0.6 0" rpy="2.9 -1.2 0.5"/><axis xyz="0 0 -1"/></joint>
  <joint name="A5" type="revolute"><parent link="l4"/><child link="l5"/>
    <origin xyz="0 0 0.12" rpy="1.57 0 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="A6" type="revolute"><parent link="l5"/><child link="l6"/>
    <origin xyz="0 0.1 0.02" rpy="-1.5 0.1 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="flange" type="fixed"><parent link="l6"/><child link="tcp"/>
    <origin xyz="0.04 -0.03 0.2" rpy="0.5 -0.4 0.3"/></joint>
""",
)

# Axes along no coordinate, one of them not of unit length; the first joint starts at the root.
OBLIQUE = urdf(
    "oblique",
    f"""
  <joint name="B1" type="revolute"><parent link="base"/><child link="l1"/>
    <origin xyz="0.1 0.2 0.3" rpy="0 0 0"/><axis xyz="0.48 -0.6 0.64"/>{LIMITS}</joint>
  <joint name="B2" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="-0.2 0.1 0.5" rpy="1 2 3"/><axis xyz="1 2 -3"/>{LIMITS}</joint>
  <joint name="B3" type="continuous"><parent link="l2"/><child link="l3"/>
    <origin xyz="0.4 0 0" rpy="-2 0.3 1"/><axis xyz="0 0.6 0.8"/></joint>
  <joint name="tip" type="fixed"><parent link="l3"/><child link="l3b"/><origin xyz="0 0.1 0"/></joint>
  <joint name="B4" type="revolute"><parent link="l3b"/><child link="l4"/>
    <origin xyz="0 0 0.35" rpy="0.2 -0.9 2.2"/><axis xyz="-0.8 0 0.6"/>{LIMITS}</joint>
""",
)

# A gantry that carries a wrist; a prismatic joint along an oblique axis, and one that mimics another.
GANTRY = urdf(
    "gantry",
    f"""
  <joint name="X" type="prismatic"><parent link="floor"/><child link="bridge"/>
    <origin xyz="0 0 2" rpy="0.01 -0.02 0.03"/><axis xyz="1 0 0"/>{LIMITS}</joint>
  <joint name="Y" type="prismatic"><parent link="bridge"/><child link="trolley"/>
    <origin xyz="0.1 0 0" rpy="0 0 0.5"/><axis xyz="0 0.6 -0.8"/>{LIMITS}</joint>
  <joint name="foot" type="fixed"><parent link="trolley"/><child link="trolley2"/>
    <origin xyz="0.02 0.01 -0.3" rpy="3.1 0 0"/></joint>
  <joint name="Z" type="prismatic"><parent link="trolley2"/><child link="mast"/>
    <origin xyz="0 0 0" rpy="0.1 0 0"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="Z2" type="prismatic"><parent link="mast"/><child link="mast2"/><origin xyz="0 0.1 0"/>
    <axis xyz="0 0 1"/>{LIMITS}
    <mimic joint="Z" multiplier="0.5"/></joint>
  <joint name="C" type="revolute"><parent link="mast2"/><child link="wrist"/>
    <origin xyz="0.05 0 0.3" rpy="0.4 0.2 -1"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="D" type="revolute"><parent link="wrist"/><child link="hand"/>
    <origin xyz="0 0 0.2" rpy="1.57 0 0"/><axis xyz="0.28 0 0.96"/>{LIMITS}</joint>
  <joint name="grip" type="fixed"><parent link="hand"/><child link="tcp"/>
    <origin xyz="0.1 0.2 0.05" rpy="0 0.3 0"/></joint>
""",
)


@dataclass
class Both:
    """One URDF, read by truing and by Pinocchio."""

    text: str
    robot: truing.Robot
    model: Any
    data: Any
    tip: int  # Pinocchio's frame of the last link

    @classmethod
    def read(cls, text: str) -> Both:
        model = pin.buildModelFromXML(text)
        links = [i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
        # An export adds a link where the tool was measured to be.
        names = [model.frames[i].name for i in links]
        tip = "truing_tool" if "truing_tool" in names else names[-1]
        return cls(
            text,
            truing.model.robot_from_urdf(text, tip_link=tip),
            model,
            model.createData(),
            model.getFrameId(tip, pin.FrameType.BODY),
        )

    def motions(self, reading: Floats) -> dict[str, float]:
        """What each joint moves by: readings, and their multiples at joints that mimic."""
        driven = [self.robot.joints[index].name for index in self.robot.driven_joints()]
        moves = dict(zip(driven, (float(value) for value in reading), strict=True))
        for joint in self.robot.joints:
            if joint.passive:
                moves[joint.name] = sum(weight * moves[other] for other, weight in joint.driven_by)
        return moves

    def configuration(self, reading: Floats) -> Floats:
        q = np.array(pin.neutral(self.model))
        for name, motion in self.motions(reading).items():
            joint = self.model.joints[self.model.getJointId(name)]
            # Pinocchio holds a joint without limits as cosine and sine.
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(motion), np.sin(motion)) if joint.nq == 2 else motion
            )
        return q

    def frames(self, reading: Floats) -> Floats:
        """Frame after every joint, then that of the last link."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(reading))
        placements = [self.data.oMi[self.model.getJointId(joint.name)] for joint in self.robot.joints]
        return np.array([placement.homogeneous for placement in [*placements, self.data.oMf[self.tip]]])

    def jacobian(self, reading: Floats) -> Floats:
        """Of the last link's frame at its own origin, in axes of the base: rows x y z rx ry rz, a column per
        driven joint.
        """
        full = pin.computeFrameJacobian(
            self.model,
            self.data,
            self.configuration(reading),
            self.tip,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        driven = [self.robot.joints[index].name for index in self.robot.driven_joints()]
        columns = {name: np.zeros(6) for name in driven}
        for joint in self.robot.joints:
            column = full[:, self.model.joints[self.model.getJointId(joint.name)].idx_v]
            for name, weight in joint.driven_by or ((joint.name, 1.0),):
                columns[name] = columns[name] + weight * column
        return np.column_stack([columns[name] for name in driven])
