# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inertias that are of no special kind, for URDFs that have plain ones."""

from __future__ import annotations

import re

import numpy as np


def skewed_inertias(text: str) -> str:
    """The URDF with an inertia of its own for every link: turned, off the axes, of another mass."""
    random = np.random.default_rng(6)

    def inertial(_: re.Match[str]) -> str:
        A = random.normal(size=(3, 3))
        xx, xy, xz, _yx, yy, yz, _zx, _zy, zz = (A @ A.T).ravel()
        xyz, rpy = random.normal(size=3), random.uniform(-3, 3, 3)
        return (
            f'<inertial><origin xyz="{" ".join(map(str, xyz))}" rpy="{" ".join(map(str, rpy))}"/>'
            f'<mass value="{random.uniform(0.1, 5.0)}"/>'
            f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>'
        )

    return re.sub(r"<inertial>.*?</inertial>", inertial, text, flags=re.DOTALL)
