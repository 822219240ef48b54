# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the commands of `truing dynamics` share: options, and reading of robots and recordings."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import (
    BaseLink,
    Choice,
    File,
    Fraction,
    Frequency,
    Kind,
    Length,
    Mass,
    Numbers,
    TipLink,
    read_with_common_units,
    refused,
)
from truing.cli.run import Found, Loaded
from truing.cli.tables import say, table
from truing.errors import InputError, InputWarning

if TYPE_CHECKING:
    from truing.dynamics import CheckedRecordings, Recording
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
        " frame: '2.8kg@0,0,60mm'; of those that have one and no place, the place.",
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
        "Torque at the joint for one ampere [Nm/A], one for each joint with a reading: '10,10.7,-8.5';"
        " negative where the current has the other sign. Default: the robot's.",
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


@dataclass(frozen=True, kw_only=True)
class ReadMotion:
    """What reading a robot and recordings of its motion takes."""

    joints: Joints = ""
    torque_per_ampere: TorquePerAmpere = None
    topic: Topic = ""
    units: Units = None
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def read_robot(self, file: Path) -> Robot:
        """With masses, and the drive constants that were given."""
        from truing.cli.reading import load_robot

        robot = load_robot(file, self.base_link, self.tip_link, any_tool=True, torques=True)
        if self.torque_per_ampere is not None:
            robot = with_drives(robot, self.torque_per_ampere)
        require_masses(file, robot)
        return robot

    def read_recordings(self, robot: Robot, files: Sequence[Path]) -> list[Recording]:
        from truing.files import load_recordings

        return list(
            load_recordings(
                files, robot, joints=self.joints or None, topic=self.topic or None, units=self.units
            )
        )


@dataclass(frozen=True, kw_only=True)
class MotionCommand(ReadMotion, run.Command[Loaded, Found]):
    """A command on a robot and recordings of its motion."""

    robot: RobotWithMasses
    payload: KnownPayload = None

    def read(self, files: Sequence[Path]) -> tuple[Robot, list[Recording]]:
        """Robot and recordings, by the options above."""
        from truing.dynamics import with_payload

        robot = self.read_robot(self.robot)
        found = self.read_recordings(robot, files)
        return robot, found if self.payload is None else with_payload(found, *self.payload)


@dataclass(frozen=True, kw_only=True)
class TorqueCommand(MotionCommand["CheckedRecordings", Found]):
    """A command that compares torques with recorded ones."""

    recordings: RecordingFiles
    cutoff: CutOff = None

    def load(self, progress: run.Progress) -> CheckedRecordings:
        return checked(self.read(self.recordings))


def with_drives(robot: Robot, torque_per_ampere: Sequence[float]) -> Robot:
    """The robot with other drive constants [Nm/A | N/A]. Raises InputError."""
    driven = robot.driven_joints()
    if len(driven) != len(torque_per_ampere):
        names = ", ".join(robot.joints[index].name for index in driven)
        raise InputError(
            f"--torque-per-ampere: found {len(torque_per_ampere)} numbers, expected {len(driven)}, one for"
            f" each joint with a reading ({names})"
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
            " inertia of the joints in robot.yaml"
        )


def require_torques(recordings: Sequence[Recording]) -> None:
    """Raises InputError that names the first recording without torques and currents."""
    for recording in recordings:
        if recording.torque.shape[1] or recording.current.shape[1]:
            continue
        raise InputError(
            f"{recording.name}: there is neither a torque (tau1_Nm …) nor a current (i1_A …): record one of"
            " them, or commands (u1_rad …), which are enough for `truing dynamics diagnose`"
        )


def checked(loaded: tuple[Robot, Sequence[Recording]]) -> CheckedRecordings:
    """Recordings with torques, looked at before anything is fitted to them. Raises InputError."""
    from truing.dynamics import check_recordings

    require_torques(loaded[1])
    return check_recordings(*loaded)


def with_sound_commands(robot: Robot, recordings: Sequence[Recording]) -> Sequence[Recording]:
    """Recordings of commands alone with what is certain corrected, which a warning says; others as they are.
    Raises InputError on a mistake in them: both models would be judged by it. What a model contradicts is no
    matter of theirs."""
    from truing.dynamics.recorded import by_commands
    from truing.dynamics.sanity import check_commands

    if not by_commands(recordings):
        return recordings
    found = check_commands(robot, recordings)
    for finding in found.findings:
        if finding.mistake:
            raise InputError(finding.evidence)
        warnings.warn(finding.evidence, InputWarning, stacklevel=2)
    return found.recordings


def mistaken(result: Mapping[str, Any]) -> str:
    """Why what was found is doubtful: the recordings contradict the model or themselves; "" if not."""
    if not any(finding["mistake"] for finding in result["sanity"]):
        return ""
    return "the robot file or the columns of the recordings are to be corrected first"


def print_findings(result: Mapping[str, Any]) -> None:
    """What looks wrong with the recordings, before anything that was concluded from them."""
    for finding in result["sanity"]:
        word = "look at the data first" if finding["mistake"] else "note"
        say(f"{word}: {finding['evidence']}")


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


def print_motion(robot: str, found: Mapping[str, Any], key: str, titles: Sequence[str]) -> None:
    """How far simulations are off at every joint, and the worst joint at every horizon. found: what
    result.json has of them, errors by model under `key`; titles: of the models."""
    from truing.dynamics.rollout.page import main_horizon, rollout_lines

    joints, worst = rollout_lines(found, key)
    main = found["horizon_s"][main_horizon(found["horizon_s"])]
    head = [f"{main:g} s ahead, rms", *titles]
    lines = [*joints, *([f"worst joint, {label}", *cells] for label, *cells in worst)]
    table(f"{robot}: simulated less measured motion, {found['windows']} windows", head, lines)
