# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""ros2_control: joint zeros and gear ratios as transmissions, for a description whose links stay nominal.

transmission_interface/SimpleTransmission: joint = actuator / mechanical_reduction + offset. Drivers that take
an offset themselves read `<param name="offset">` of the joint instead: one of the two, never both.
"""

from __future__ import annotations

import numpy as np

from truing import _core
from truing.controllers.distances import between, dropped_effects, dropped_links, poses_of
from truing.controllers.frames import in_flange
from truing.controllers.nearest import Nearest
from truing.controllers.written import Written, numbers
from truing.report.words import escaped

TRANSMISSIONS = "transmissions.xml"
PARAMETERS = "joint_offsets.xml"
_DIGITS = 9
_REASON = "ros2_control has zeros and ratios"


def written(found: Nearest, calibrated: _core.Robot) -> Written:
    robot = found.robot
    driven = [robot.joints[index] for index in robot.driven_joints()]
    offsets = {joint.name: numbers([joint.offset], _DIGITS)[0] for joint in driven}
    reductions = {joint.name: numbers([1.0 / joint.ratio], _DIGITS)[0] for joint in driven}
    again = robot.copy()
    for index in robot.driven_joints():
        joint = again.joints[index]
        joint.offset, joint.ratio = float(offsets[joint.name]), 1.0 / float(reductions[joint.name])
    units = {joint.name: "rad" if joint.type == "revolute" else "m" for joint in driven}
    bare = calibrated.replace(targets=[calibrated.targets[0]])
    remaining = between(bare, again, poses_of(calibrated))
    return Written(
        files={
            TRANSMISSIONS: _transmissions(offsets, reductions),
            PARAMETERS: _parameters(offsets),
        },
        values={
            "joints": {
                name: {"offset": float(offsets[name]), "mechanical_reduction": float(reductions[name])}
                for name in offsets
            },
            "T_measurement_base": np.asarray(robot.T_measurement_base).tolist(),
            "T_flange_tool": in_flange(robot.targets[0], found.T_last_flange).tolist(),
        },
        lines=[
            (name, f"offset {offsets[name]} {units[name]}, mechanical_reduction {reductions[name]}")
            for name in offsets
        ],
        dropped=[dropped_links(remaining, _REASON), *dropped_effects(calibrated, _REASON)],
        notes=[
            "for the nominal description: with a calibrated URDF the zeros would count twice",
            "enter tool and base of result.json with them: the first and the last joint have no zero of"
            " their own",
            f"{TRANSMISSIONS} or {PARAMETERS}, never both; times the reduction that your description has"
            " already",
        ],
        remaining=remaining,
        before=found.before,
    )


def _transmissions(offsets: dict[str, str], reductions: dict[str, str]) -> str:
    entries = "".join(
        f'  <transmission name="{escaped(name)}_transmission">\n'
        "    <plugin>transmission_interface/SimpleTransmission</plugin>\n"
        f'    <actuator name="{escaped(name)}_actuator" role="actuator1"/>\n'
        f'    <joint name="{escaped(name)}" role="joint1">\n'
        f"      <mechanical_reduction>{reductions[name]}</mechanical_reduction>\n"
        f"      <offset>{offset}</offset>\n"
        "    </joint>\n  </transmission>\n"
        for name, offset in offsets.items()
    )
    return (
        "<!-- Into the ros2_control tag of the description whose links are nominal; rad, m. joint = actuator"
        f" /\n     mechanical_reduction + offset. -->\n<transmissions>\n{entries}</transmissions>\n"
    )


def _parameters(offsets: dict[str, str]) -> str:
    entries = "".join(
        f'  <joint name="{escaped(name)}">\n    <param name="offset">{offset}</param>\n  </joint>\n'
        for name, offset in offsets.items()
    )
    return (
        "<!-- For drivers that take the offset of a joint themselves; rad, m, added to what the motor shows."
        f" -->\n<joints>\n{entries}</joints>\n"
    )
