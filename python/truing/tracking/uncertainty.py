# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How sure a predicted tool is: the filter's covariance, and what the frames of the set-up may be off by.

The filter takes the frames for what the set-up says. Their errors stay the same over a recording, so no
sample tells them; they reach the tool to first order. A frame's covariance is of x, y, z and of the rotation
vector about its parent's axes, the tool's about the base frame's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truing.files.stream_file import SetupData

Floats = NDArray[np.float64]


def tool_covariance(where: SetupData, T_base_tool: Floats, of_filter: Floats) -> Floats:
    """shape=(n, 6, 6) [m], [rad]. T_base_tool: shape=(n, 4, 4); of_filter: shape=(n, 6, 6)."""
    total = np.array(of_filter)
    for name, jacobian in _jacobians(where, T_base_tool).items():
        if name in where.covariance:
            total += jacobian @ where.covariance[name] @ np.swapaxes(jacobian, 1, 2)
    return total


def _jacobians(where: SetupData, T_base_tool: Floats) -> dict[str, Floats]:
    """What errors of each frame move the tool by, shape=(n, 6, 6). The tool is, by the tracker,
    T_tracker_base^-1 T_tracker_receiver T_flange_receiver^-1 T_flange_tool.
    """
    setup = where.setup
    T_flange_tool, T_flange_receiver = np.asarray(setup.T_flange_tool), np.asarray(setup.T_flange_receiver)
    from_tracker = np.asarray(setup.T_tracker_base)[:3, :3].T
    flange = T_base_tool[:, :3, :3] @ T_flange_tool[:3, :3].T
    receiver_to_tool = T_flange_tool[:3, 3] - T_flange_receiver[:3, 3]
    return {
        "T_tracker_base": _blocks(-from_tracker, _cross(T_base_tool[:, :3, 3]) @ from_tracker),
        "T_flange_receiver": _blocks(-flange, flange @ _cross(receiver_to_tool)),
        "T_flange_tool": _blocks(flange, np.zeros_like(flange)),
    }


def _blocks(turn: Floats, lever: Floats) -> Floats:
    """[[turn, lever], [0, turn]], shape=(n, 6, 6)."""
    out = np.zeros((len(lever), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = turn
    out[:, :3, 3:] = lever
    return out


def _cross(v: Floats) -> Floats:
    """The matrix of the cross product with v, shape=(…, 3, 3)."""
    return np.cross(np.eye(3), v[..., None, :])
