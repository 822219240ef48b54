# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Candidates that sit the examination in tests; in a module that the examination's workers can import."""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import truing
from truing.exam import sets


def silent(robot: truing.Robot, data: truing.Measurements) -> Any:
    """A candidate that never finds anything."""
    share = SimpleNamespace(value=0.0, low=0.0, high=0.0)
    return SimpleNamespace(
        verdict="none",
        effects=[],
        unknown=[],
        not_testable=[],
        shrink=share,
        sentence="",
        candidates=[],
        sanity=[],
        set=[],
        robot=robot,
        robot_before=robot,
    )


PLACE = "TRUING_TEST_PLACE"
"""Environment variable with the folder in which `sleeping` says which process it is."""


def sleeping(robot: truing.Robot, data: truing.Measurements) -> Any:
    """A candidate that does not come to an end."""
    (Path(os.environ[PLACE]) / f"{os.getpid()}.pid").touch()
    time.sleep(600.0)


def leaving(name: str) -> str:
    """A job that returns its name, divides by zero, does not end, or takes its process down."""
    if name == "down":
        os._exit(1)
    if name == "endless":
        time.sleep(600.0)
    return name if name != "zero" else str(1 // 0)


def environment(name: str) -> str:
    """A job that returns a variable of its process's environment."""
    return os.environ.get(name, "")


def endless(robot: truing.Robot, data: truing.Measurements) -> Any:
    time.sleep(600.0)


def misnaming(robot: truing.Robot, data: truing.Measurements) -> Any:
    """A candidate whose teeth have an order that is no number."""
    diagnosis = silent(robot, data)
    diagnosis.effects = [
        SimpleNamespace(
            effect="transmission_error@many",
            joints=["J1"],
            probability=0.9,
            share=0.5,
            confounded_with=[],
        )
    ]
    return diagnosis


def without_robot(robot: truing.Robot, data: truing.Measurements) -> Any:
    """A candidate whose robot is none."""
    diagnosis = silent(robot, data)
    diagnosis.robot = "robot.yaml"
    return diagnosis


def crashing(robot: truing.Robot, data: truing.Measurements) -> Any:
    if data.rows == sets.make("development/none/1")[1].rows:
        os._exit(1)
    return silent(robot, data)
