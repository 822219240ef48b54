# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading files that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truing.model import Measurements, Robot


def load_robot(
    path: Path | str,
    base_link: str = "",
    tip_link: str = "",
    *,
    any_tool: bool = False,
    torques: bool = False,
) -> Robot:
    """A robot whose effects, those on torques if `torques`, are of the catalogue: a command has no others."""
    from truing import files
    from truing.dynamics.api import effect_names
    from truing.model import catalogue

    known = {"torque_effects": effect_names()} if torques else {"effects": [name for name, _ in catalogue()]}
    return files.load_robot(path, base_link, tip_link, any_tool=any_tool, known=known)


def robot_and_measurements(
    robot: Path,
    data: Path,
    base_link: str,
    tip_link: str,
    *,
    joints_only: bool = False,
    program: Path | None = None,
) -> tuple[Robot, Measurements]:
    """program: gives the joints of the rows."""
    from truing.files import load_measurements

    model = load_robot(robot, base_link, tip_link)
    if program is None:
        return model, load_measurements(data, model, joints_only=joints_only)
    from truing.programs import commanded_joints

    return model, load_measurements(data, model, beside=commanded_joints(program, model))
