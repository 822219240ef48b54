# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""One name for both diagnoses: the recordings' columns say which."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from truing import _core
from truing.dynamics import api
from truing.dynamics.own_effects import TorqueEffect
from truing.dynamics.servo.api import by_commands, servo_diagnose
from truing.dynamics.servo.result import ServoDiagnosis
from truing.errors import InputError
from truing.files import load_robot
from truing.keywords import takes

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._core import Recording, Robot, TorqueDiagnosis
    from truing._keywords import TorqueDiagnoseKeywords

_SERVO_KEYWORDS = (
    "joints",
    "leave_out",
    "test_share",
    "window",
    "max_effects",
    "threads",
    "progress",
)


@overload
def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    *,
    effects: TorqueEffect | Iterable[TorqueEffect] = (),
    **options: Unpack[TorqueDiagnoseKeywords],
) -> TorqueDiagnosis: ...


@overload
def diagnose(
    robot: str | Path, recordings: Sequence[Recording], **options: Any
) -> TorqueDiagnosis | ServoDiagnosis: ...


@takes(_core.TorqueDiagnoseOptions)
def diagnose(
    robot: Robot | str | Path,
    recordings: Sequence[Recording],
    *,
    effects: TorqueEffect | Iterable[TorqueEffect] = (),
    **options: Any,
) -> TorqueDiagnosis | ServoDiagnosis:
    """Find which effects stand between a robot's model and what was recorded of it.

        found = truing.dynamics.diagnose(robot, recordings)
        print(found.summary())

    Recordings with torques or currents: inertial parameters, Coulomb and viscous friction and an offset are
    the groundwork, unless the robot was fitted before: then everything is a departure from it. Every effect
    at every joint competes. What is named predicts recordings that it was not fitted to.

    Recordings of commands and motion alone (servo arms): robot is the path of the simulator's file, MJCF or
    URDF, and what comes is a `ServoDiagnosis`; keywords are those of
    `truing.dynamics.servo.servo_diagnose`.

    robot: with masses, centres of mass and inertias of its links. recordings: see `load_recordings`; those
    marked as test are held out.
    effects: definitions of own effects (`TorqueEffect`) that take part beside the catalogue's; not of servo
    arms.
    options: fields of `TorqueDiagnoseOptions`. `leave_out` may be one text, "coupling,ripple".

    Raises InputError on recordings or options that cannot be used.
    """
    recordings = list(recordings)
    if by_commands(recordings):
        strange = sorted(set(options) - set(_SERVO_KEYWORDS)) + (["effects"] if effects else [])
        if strange:
            raise InputError(
                f"{strange[0]} is not an option of a diagnosis from commands: expected"
                f" {', '.join(_SERVO_KEYWORDS)}"
            )
        return servo_diagnose(robot, recordings, **options)
    given = load_robot(robot, any_tool=True) if isinstance(robot, str | Path) else robot
    return api.diagnose(given, recordings, effects=effects, **options)
