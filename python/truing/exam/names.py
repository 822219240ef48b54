# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the candidate calls the effects that the examiner builds by laws of its own: the one place to change
when the catalogue names one of them otherwise.
"""

from __future__ import annotations

ACCEPTED: dict[str, tuple[str, ...]] = {
    "four_bar": ("linkage", "elbow_linkage"),
    "wobble_twice": ("axis_wobble_twice",),
    "neighbour": ("neighbour_coupling",),
    "warm_robot": ("thermal",),
    "teeth": ("transmission_error",),
    "hard_spring": ("joint_compliance", "stiffness_zones"),
}
"""The examiner's word: names that are right, the one in the label first. What is not here goes by its own
name.
"""

FINDINGS: dict[str, frozenset[str]] = {
    "exchanged": frozenset({"joint_order"}),
    "sign": frozenset({"joint_sign"}),
    "convention": frozenset({"convention"}),
}
"""Mistakes in what was handed over: kinds of findings that say them."""


def accepted(effect: str) -> tuple[str, ...]:
    return ACCEPTED.get(effect, (effect,))
