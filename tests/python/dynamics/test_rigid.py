# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Torques of the rigid chain against Pinocchio's recursive Newton-Euler algorithm, from the same URDF."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pinocchio_arms import ARM, GANTRY, OBLIQUE, Both
from truing import _core
from truing.errors import InputError
from urdf_inertias import skewed_inertias

pin = pytest.importorskip("pinocchio", reason="Pinocchio (pip package 'pin') is not installed")

Floats = NDArray[np.float64]

ROBOTS = {"arm": ARM, "oblique": OBLIQUE, "gantry": GANTRY}


def coupling(both: Both) -> Floats:
    """Rates of Pinocchio's joints, which mimic nothing, for rates of readings."""
    out = np.zeros((both.model.nv, both.robot.driven_count))
    for k in range(both.robot.driven_count):
        for name, motion in both.motions(np.eye(both.robot.driven_count)[k]).items():
            out[both.model.joints[both.model.getJointId(name)].idx_v, k] = motion
    return out


def assert_torques_are_pinocchios(text: str) -> None:
    both = Both.read(text)
    n = both.robot.driven_count
    random = np.random.default_rng(7)
    q, qd, qdd = (random.uniform(-3, 3, (60, n)) for _ in range(3))
    ours = _core.rigid_torques(both.robot, q, qd, qdd)
    C = coupling(both)
    theirs = np.array(
        [
            C.T @ pin.rnea(both.model, both.data, both.configuration(q[row]), C @ qd[row], C @ qdd[row])
            for row in range(len(q))
        ]
    )
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_torques_are_pinocchios(name: str) -> None:
    assert_torques_are_pinocchios(skewed_inertias(ROBOTS[name]))


@pytest.mark.realdata
@pytest.mark.parametrize("name", ["dyn_ur10e", "dyn_tx40", "dyn_ur10"])
def test_torques_of_published_urdfs_are_pinocchios(name: str) -> None:
    path = Path(os.environ.get("TRUING_REALDATA", "")) / name / "robot.urdf"
    if not path.exists():
        pytest.skip(f"{name} is not there: set TRUING_REALDATA to the folder of recordings")
    assert_torques_are_pinocchios(path.read_text())


def test_tables_of_another_shape_are_refused() -> None:
    robot = Both.read(ARM).robot
    right = np.zeros((4, robot.driven_count))
    with pytest.raises(InputError, match=r"qd has shape \(4, 5\), expected \(4, 6\)"):
        _core.rigid_torques(robot, right, right[:, 1:], right)
    with pytest.raises(InputError, match="q"):
        _core.rigid_torques(robot, right[0], right, right)
    right[1, 2] = np.inf
    with pytest.raises(InputError, match="row 2, joint 3"):
        _core.rigid_torques(robot, right, right, right)
