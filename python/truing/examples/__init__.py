# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robots and recordings that come with the package, and the parameters that the palletizer method fits."""

from __future__ import annotations

import os
import shutil
from importlib import resources
from pathlib import Path

# The palletizer method's 18 parameters. The measurement frame (base.*) comes on top of them.
PALLETIZER_MODEL = (
    "J1.a",
    "J2.a",
    "J3.a",
    "J4.a",
    "J1.d",
    "J4.d",
    "J5.d",
    "J1.ratio",
    "J2.ratio",
    "J3.ratio",
    "J5.ratio",
    "J1.offset",
    "J2.offset",
    "J3.offset",
    "J5.offset",
    "tool.x",
    "tool.y",
    "tool.z",
)
PALLETIZER_FREE = (*PALLETIZER_MODEL, "base.*")


def example(name: str) -> Path:
    """Path of a shipped robot file: "palletizer", "ur10" or "irb120"."""
    return Path(str(resources.files("truing") / "examples" / f"{name}.yaml"))


def copy_servo_arm(folder: str | os.PathLike[str]) -> Path:
    """Copies an arm of hobby servos into `folder`, which is made: arm.xml (MJCF, as a drawing has it) and
    recordings (a LeRobot data set of five simulated episodes, in degrees). Returns the folder.

    Raises FileExistsError: one of them is there.
    """
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    source = Path(str(resources.files("truing") / "examples" / "servo_arm"))
    for name in ("arm.xml", "recordings"):
        if (out / name).exists():
            raise FileExistsError(f"{out / name} is there already")
    shutil.copyfile(source / "arm.xml", out / "arm.xml")
    shutil.copytree(source / "recordings", out / "recordings")
    return out
