# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How much of a warm-up's drift the catalogue's thermal effects would compensate.

Every second block is predicted from the others: what is left is what a compensated robot would have shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing._core import Measurements, Robot
from truing.errors import InputError
from truing.identification import identify, predict

Floats = NDArray[np.float64]
_FEWEST_BLOCKS = 4
_PLACE = ("tool.x", "tool.y", "tool.z")  # what of the mean position is no matter of warmth


@dataclass(frozen=True)
class ThermalFit:
    """Thermal effects fitted to a warm-up."""

    effects: tuple[str, ...]  # names of the parameters that were found
    predicted: Floats  # shape=(n, 3) [m], each row by a fit that did not see its block


def fit_warm_up(
    robot: Robot, joints: Floats, positions: Floats, temperature: Floats, block: NDArray[np.int64]
) -> ThermalFit:
    """Fits every effect of the catalogue that temperature drives, and the tool's position.

    robot: its base frame is where it stands in the frame of the measurements, and is held.
    joints: shape=(n, driven joints) [rad | m]. positions: shape=(n, 3) [m]. temperature: shape=(n,) [deg C].
    block: shape=(n,), number of the block. Raises InputError where the data do not serve.
    """
    if joints.shape[1] != robot.driven_count:
        raise InputError(
            f"the warm-up has {joints.shape[1]} joint columns, the robot {robot.driven_count} driven joints"
        )
    blocks = np.unique(block)
    if len(blocks) < _FEWEST_BLOCKS:
        raise InputError(f"the warm-up has {len(blocks)} blocks, expected {_FEWEST_BLOCKS} or more")
    if float(np.ptp(temperature)) < 1.0:
        raise InputError(f"the temperature changed by {np.ptp(temperature):.2g} K, expected 1 K or more")
    data = Measurements(joints, positions=positions, temperature=temperature)
    effects = [one.name for one in _core.catalogue_effects() if one.traits.driver == "temperature"]
    predicted = np.empty_like(positions)
    odd = np.isin(block, blocks[::2])
    names: set[str] = set()
    for held_out in (odd, ~odd):
        seen = Measurements(
            joints[~held_out],
            positions=positions[~held_out],
            temperature=temperature[~held_out],
            pose=block[~held_out],  # one pose of the robot, but not one temperature
        )
        found = identify(
            robot,
            seen,
            free=list(_PLACE),
            hold="base.*",
            effects=effects,
            test_share=0.0,
            raise_if_not_converged=False,
        )
        if not found.solver.converged:
            raise InputError(f"the fit of the thermal effects failed: {found.solver.stopped_because}")
        names |= {one.name for one in found.parameters if not one.frozen and one.name not in _PLACE}
        found.robot.fitted_range = {}  # half of the blocks may lie beyond the other half's, by little
        predicted[held_out] = predict(found.robot, data).position[held_out]
    return ThermalFit(tuple(sorted(names)), predicted)
