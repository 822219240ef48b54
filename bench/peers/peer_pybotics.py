# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""pybotics, used as its calibration example does: scipy least squares over optimize_accuracy.

Its links have four parameters (no beta) and are in millimetres. All 24 are free,
and so are the world frame (6) and the position of the tool (3).
"""

import time

import numpy as np
from mdh import align, positions
from pybotics.geometry import matrix_2_vector, vector_2_matrix
from pybotics.kinematic_chain import MDHKinematicChain
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from pybotics.tool import Tool
from result import score
from scipy.optimize import least_squares

MM = 1e3


def run(data, method):
    dh, tool, q, p = data["dh"], data["tool"], data["q_train"], data["p_train"]
    if np.any(dh[:, 2]):
        raise ValueError("pybotics has no beta: the nominal table must have none")
    start = time.perf_counter()
    links = dh[:, [0, 1, 3, 4]] * [1, MM, 1, MM]
    robot = Robot(MDHKinematicChain.from_parameters(links.ravel()))
    robot.tool = Tool(vector_2_matrix(np.r_[tool * MM, 0, 0, 0]))
    base = align(positions(dh, np.eye(4), tool, q), p)
    base[:3, 3] *= MM
    robot.world_frame = vector_2_matrix(matrix_2_vector(base))
    handler = OptimizationHandler(
        robot,
        kinematic_chain_mask=[True] * links.size,
        tool_mask=[True] * 3 + [False] * 3,
        world_mask=[True] * 6,
    )
    result = least_squares(
        optimize_accuracy,
        handler.generate_optimization_vector(),
        args=(handler, q, p * MM),
        method=method,
    )
    handler.apply_optimization_vector(result.x)
    seconds = time.perf_counter() - start
    predicted = np.array([handler.robot.fk(qi)[:3, 3] for qi in data["q_test"]]) / MM
    return [
        {
            "task": "fit",
            "seconds": seconds,
            **score(data, predicted),
            "note": (
                f"least_squares(method='{method}'), default tolerances, {len(result.x)} free parameters, "
                f"base from Kabsch; {result.nfev} evaluations, {result.message}"
            ),
        }
    ]
