# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A scene file, and the columns of a target file."""

from __future__ import annotations

NAMES = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")

SCENE = b"""\
format: truing-scene/1
units: {length: mm, angle: deg}
obstacles:
  - {name: table, shape: box, xyz: [600, 0, -20], rpy: [0, 0, 90], size: [800, 400, 40]}
  - {name: post, shape: capsule, xyz: [0, 500, 0], length: 900, radius: 40}
  - {name: ball, shape: sphere, xyz: [300, 300, 500], radius: 80}
capsules:
  - {name: forearm, link: J4, start: [0, 0, -250], end: [0, 0, 0], radius: 60}
  - {name: hand, link: tool, start: [0, 0, -50], end: [0, 0, 0], radius: 20}
clearance: 5
ignored: [[forearm, post]]
"""
