# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sets of the examination and small sets of real robots that a diagnosis answered wrongly once."""

from __future__ import annotations

import pytest

import truing
from truing.exam.sets import make


def test_one_link_off_by_little_more_than_noise_shows_where_few_poses_have_orientations() -> None:
    robot, data, label = make("examination/single/4@19")
    found = truing.diagnose(robot, data)
    assert [(e.effect, e.joints) for e in found.effects] == [("link_geometry", ("J3",))]
    assert found.noise_floor == pytest.approx(3**0.5 * label["sigma"], rel=0.15)


def test_an_end_stop_is_no_zero_ratio_and_harmonic_at_once() -> None:
    robot, data, _ = make("examination/unlisted/1@19")
    found = truing.diagnose(robot, data)
    assert not found.effects
    assert [(u.joint, u.inputs) for u in found.unknown] == [("B3", ("q3",))]
