# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the commands of `truing dynamics` share: options, and reading of robots and recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli.options import (
    Choice,
    File,
    Fraction,
    Frequency,
    Kind,
    Length,
    Mass,
    Numbers,
    read_with_common_units,
    refused,
)
from truing.cli.tables import table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.dynamics import Recording
    from truing.model import Robot

READING = "Reading"

RobotWithMasses = Annotated[
    Path,
    File("Robot with masses and inertias: URDF, MJCF or robot.yaml.", argument=True, metavar="ROBOT"),
]
RecordingFiles = Annotated[
    list[Path],
    File(
        "Recordings with torques or currents, one file each: CSV, Parquet, ROS bag, LeRobot data set.",
        argument=True,
        metavar="REC",
        several=True,
    ),
]
Joints = Annotated[
    str,
    Kind(
        "Which of the robot's joints each joint of the files is, in their order: 'J1,J2,-,J3'; '-' for none."
        " Default: the same joints in the same order.",
        metavar="NAMES",
        panel=READING,
    ),
]


class PayloadAt(Kind):
    """A mass, and where its centre is: "2.8kg", "2.8kg@0,0,60mm"; the field holds (mass, (x, y, z))."""

    metavar = "MASS[@X,Y,Z]"

    def read(self, text: str, option: str) -> tuple[float, tuple[float, float, float]]:
        mass, at, place = text.partition("@")
        numbers = place.split(",") if at else ["0", "0", "0"]
        if len(numbers) != 3:
            raise refused(option, text, "a mass, or a mass and its place, such as 2.8kg or 2.8kg@0,0,60mm")
        x, y, z = read_with_common_units(numbers, [Length()] * 3, [option] * 3)
        return Mass(least=0.0).read(mass, option), (x, y, z)


KnownPayload = Annotated[
    tuple[float, tuple[float, float, float]] | None,
    PayloadAt(
        "Known payload of recordings that have no column payload_kg, a point at the tool, or at X,Y,Z in its"
        " frame: '2.8kg@0,0,60mm'.",
        panel=READING,
    ),
]
Topic = Annotated[str, Kind("Of the joint states, where a bag has several.", metavar="TOPIC", panel=READING)]
Units = Annotated[
    Literal["deg", "rad", "percent"] | None,
    Choice("Of the positions of a LeRobot data set, which does not say.", panel=READING),
]
TorquePerAmpere = Annotated[
    list[float] | None,
    Numbers(
        "Torque at the joint for one ampere [Nm/A], one for each joint with a reading: '10,10.7,8.5'."
        " Default: the robot's.",
        panel=READING,
    ),
]
CutOff = Annotated[
    float | None,
    Frequency("Of the low-pass without phase that torques and model go through. Default: 8 Hz.", above=0),
]
TestShare = Annotated[
    float,
    Fraction("Part of the time held out, where no recording is marked as test (column `set`).", above=0),
]


def robot_and_recordings(
    robot: Path,
    recordings: Sequence[Path],
    *,
    base_link: str,
    tip_link: str,
    joints: str,
    topic: str,
    units: Literal["deg", "rad", "percent"] | None,
    torque_per_ampere: Sequence[float] | None,
    payload: tuple[float, tuple[float, float, float]] | None = None,
) -> tuple[Robot, list[Recording]]:
    from truing.dynamics import with_payload
    from truing.files import load_recordings, load_robot

    model = load_robot(robot, base_link, tip_link, any_tool=True)
    if torque_per_ampere is not None:
        model = with_drives(model, torque_per_ampere)
    require_masses(robot, model)
    found = load_recordings(recordings, model, joints=joints or None, topic=topic or None, units=units)
    return model, list(found) if payload is None else with_payload(found, *payload)


def with_drives(robot: Robot, torque_per_ampere: Sequence[float]) -> Robot:
    """The robot with other drive constants [Nm/A | N/A]. Raises InputError."""
    driven = robot.driven_joints()
    if len(driven) != len(torque_per_ampere):
        names = ", ".join(robot.joints[index].name for index in driven)
        raise InputError(
            f"--torque-per-ampere: found {len(torque_per_ampere)} numbers, expected {len(driven)}, one"
            " for each"
            f" joint with a reading ({names})"
        )
    out = robot.copy()
    for index, value in zip(driven, torque_per_ampere, strict=True):
        out.joints[index].torque_per_ampere = value
    return out


def require_masses(file: Path, robot: Robot) -> None:
    """Raises InputError: no link has a mass, so that the nominal model has no torques at all."""
    if not any(joint.mass for joint in robot.joints):
        raise InputError(
            f"{file}: no link has a mass: expected <inertial> of the links in a URDF, or mass, com and"
            " inertia"
            " of the joints in robot.yaml"
        )


def require_torques(recordings: Sequence[Recording]) -> None:
    """Raises InputError that names the first recording without torques and currents."""
    for recording in recordings:
        if recording.torque.shape[1] or recording.current.shape[1]:
            continue
        commands = recording.command.shape[1] or recording.torque_command.shape[1]
        raise InputError(
            f"{recording.name}: there is neither a torque (tau1_Nm …) nor a current (i1_A …)"
            + ("; a diagnosis from commands alone (u1_rad …) is not there yet" if commands else "")
        )


def print_errors(result: Mapping[str, Any], models: Sequence[tuple[str, str]]) -> None:
    """Held-out error of every joint; `models`: by name, with their headings."""
    errors = result["torque"]["held_out"]
    there = [(name, title) for name, title in models if errors.get(name)]
    joints = errors[there[0][0]] if there else {}
    lines = [
        [
            joint,
            *("-" if errors[name][joint] is None else f"{errors[name][joint]:.1f} %" for name, _ in there),
        ]
        for joint in joints
    ]
    table(
        f"{result['robot']}: error of held-out torque, % of its standard deviation",
        ["", *(title for _, title in there)],
        lines,
    )
