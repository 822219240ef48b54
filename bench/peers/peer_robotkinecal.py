# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""robotkinecal: minimal product-of-exponentials fit (Li, Wu, Löwe, Li 2016).

It expects points in the base frame, so the points are first brought there by Kabsch;
what remains of the base is absorbed by the screws. The robot comes from a URDF, as in
its documentation (its PoERobot path raises IndexError with Robotics Toolbox 1.4.4).
"""

import contextlib
import io
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import roboticstoolbox as rtb
from mdh import align, positions, urdf
from result import score
from robotkinecal import SerialRobotKineCal


def run(data):
    dh, tool, q, p = data["dh"], data["tool"], data["q_train"], data["p_train"]
    warnings.simplefilter("ignore", DeprecationWarning)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf(dh, tool))
        robot = rtb.ERobot.URDF(str(path))
    np.random.seed(0)  # it draws its bases from the global generator
    start = time.perf_counter()
    base = align(positions(dh, np.eye(4), tool, q), p)
    in_base = (p - base[:3, 3]) @ base[:3, :3]
    with contextlib.redirect_stdout(io.StringIO()) as said:
        calibration = SerialRobotKineCal(robot, ee_name="tool")
        calibration.set_observations(list(q), list(in_base))
        result = calibration.solve()
    seconds = time.perf_counter() - start
    predicted = np.array([calibration.forward_kinematics(len(dh) + 1, qi).t for qi in data["q_test"]])
    said = " ".join(said.getvalue().split())
    return [
        {
            "task": "fit",
            "seconds": seconds,
            **score(data, predicted @ base[:3, :3].T + base[:3, 3]),
            "note": (
                f"{calibration.N_PARAMS} parameters, base from Kabsch, {result.nb_iterations_executed}"
                f" iterations, converged: {result.has_converged}" + (f"; it says: {said}" if said else "")
            ),
        }
    ]
