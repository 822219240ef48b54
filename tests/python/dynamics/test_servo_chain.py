# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The actuator chain as data."""

from __future__ import annotations

import json
import math

import pytest

from truing.dynamics.servo import PARAMETERS, ServoChain, ServoJoint


def _chain() -> ServoChain:
    return ServoChain(
        joints=("a", "b"),
        prismatic=(False, True),
        drives=(ServoJoint(delay=0.02, saturation=2.5), ServoJoint(load_friction=0.3)),
        payload_mass=0.2,
        payload_place=(0.0, 0.1, 0.0),
        link_scale={"hand": 1.2},
    )


def test_a_chain_survives_result_json() -> None:
    text = json.dumps(_chain().to_dict(), allow_nan=False)
    assert ServoChain.from_dict(json.loads(text)) == _chain()


def test_a_limit_that_is_not_there_is_null() -> None:
    joints = _chain().to_dict()["joints"]
    assert joints["a"]["saturation"] == 2.5
    assert joints["b"]["saturation"] is None and joints["b"]["type"] == "prismatic"


def test_with_drive_changes_one_joint_alone() -> None:
    changed = _chain().with_drive("b", delay=0.01)
    assert changed.drive("b").delay == 0.01 and changed.drive("a") == _chain().drive("a")


@pytest.mark.parametrize("name", sorted(PARAMETERS))
def test_every_value_is_neutral_as_it_comes_and_within_its_bounds(name: str) -> None:
    known = PARAMETERS[name]
    assert getattr(ServoJoint(), name) == known.neutral
    assert known.low <= known.neutral <= known.high
    assert known.spread > 0.0 and not math.isnan(known.spread) and known.what
