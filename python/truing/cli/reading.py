# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading files that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truing.model import Measurements, Robot


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
    from truing.files import load_measurements, load_robot

    model = load_robot(robot, base_link, tip_link)
    if program is None:
        return model, load_measurements(data, model, joints_only=joints_only)
    from truing.programs import commanded_joints

    return model, load_measurements(data, model, beside=commanded_joints(program, model))
