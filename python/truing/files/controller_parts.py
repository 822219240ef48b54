# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the readers of controllers' files hand on: the robot, and in words what was understood and what was
not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from truing import _core
from truing.errors import InputError
from truing.files.arms import ARMS
from truing.files.common import listed, shown

SEPARATOR = "@"
"""Between a controller's file and the arm it is of: calibration.conf@ur10e, follower.json@so101.urdf."""


@dataclass(frozen=True)
class ControllerModel:
    """The robot that a controller believes in, read from one of its files."""

    robot: _core.Robot
    kind: str
    """Which file of which maker it is."""
    arm: str
    """The data sheet that the file adds to, or the robot file beside it."""
    understood: tuple[tuple[str, str], ...]
    """What the file says: names and values in words."""
    warnings: tuple[str, ...] = ()
    """What whoever calibrates or compensates this robot has to know."""
    not_understood: tuple[str, ...] = ()
    """What the file holds and the robot does not."""
    calibration: Mapping[str, Any] = field(default_factory=dict)
    """Goes into robot.yaml as it is."""


def split_arm(path: str, arm: str = "") -> tuple[Path, str]:
    """ "calibration.conf@ur10e" as path and arm. A file that is really called so is one."""
    name, separator, after = path.rpartition(SEPARATOR)
    if arm or not separator or not name or Path(path).exists():
        return Path(path), arm
    return Path(name), after


def unknown_arm(path: Path, arm: str, fitting: Sequence[str] = (), beside: str = "") -> InputError:
    """For a name that is no data sheet's, or one that is missing. beside: what a robot file may be named
    as.
    """
    names = listed(list(fitting or ARMS))
    found = f"there is no data sheet of {shown(arm)} for it" if arm else "does not say which arm it is of"
    fit = "its values fit" if fitting else "known are"
    other = f"; or a robot file that has the links ({path.name}{SEPARATOR}{beside})" if beside else ""
    return InputError(
        f"{path}: {found}: name the arm (--arm NAME, or {path.name}{SEPARATOR}NAME; {fit} {names}){other}"
    )
