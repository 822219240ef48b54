# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading files that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truing.model import Measurements, Robot


def robot_and_measurements(
    robot: Path, data: Path, base_link: str, tip_link: str, *, joints_only: bool = False
) -> tuple[Robot, Measurements]:
    from truing.files import load_measurements, load_robot

    model = load_robot(robot, base_link, tip_link)
    return model, load_measurements(data, model, joints_only=joints_only)
