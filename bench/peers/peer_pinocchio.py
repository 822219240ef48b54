# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Pinocchio: forward kinematics and kinematic regressor, pose by pose from Python."""

import numpy as np
import pinocchio as pin
from mdh import chain, positions
from result import best_of


def build(dh):
    model = pin.Model()
    parent = 0
    for i, row in enumerate(dh):
        R, o = chain(row[None], np.zeros((1, 1)))
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(R[1, 0], o[1, 0]), f"joint{i + 1}")
    return model


def run(data):
    dh, tool, q = data["dh"], data["tool"], np.ascontiguousarray(data["q_train"][:1000])
    model = build(dh)
    work = model.createData()
    last = model.njoints - 1
    placement = pin.SE3(np.eye(3), tool)

    pin.forwardKinematics(model, work, q[0])
    ours = positions(dh, np.eye(4), tool, q[:1])[0]
    if not np.allclose((work.oMi[last] * placement).translation, ours, atol=1e-12):
        raise AssertionError("Pinocchio's model is not the arm of the data file")

    def kinematics():
        for qi in q:
            pin.forwardKinematics(model, work, qi)

    def regressor():
        for qi in q:
            pin.forwardKinematics(model, work, qi)
            pin.computeJointKinematicRegressor(model, work, last, pin.LOCAL_WORLD_ALIGNED, placement)

    shape = pin.computeJointKinematicRegressor(model, work, last, pin.LOCAL_WORLD_ALIGNED, placement).shape
    return [
        {
            "task": "fk",
            "seconds": best_of(30, kinematics)[0],
            "note": f"{len(q)} poses, a Python loop; best of 30",
        },
        {
            "task": "fk+regressor",
            "seconds": best_of(30, regressor)[0],
            "note": f"{len(q)} poses, {shape[0]} x {shape[1]} a pose (not stored), a Python loop; best of 30",
        },
    ]
