# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Candidates that sit the examination in tests; in a module that the examination's workers can import."""

from __future__ import annotations

import os
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
        robot=robot,
        robot_before=robot,
    )


def crashing(robot: truing.Robot, data: truing.Measurements) -> Any:
    if data.rows == sets.make("development/none/1")[1].rows:
        os._exit(1)
    return silent(robot, data)
