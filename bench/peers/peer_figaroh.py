# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""FIGAROH's geometric calibration: full placements of all joints, base and tip unknown.

FIGAROH reads a URDF, a CSV and a YAML file, so those are written to a temporary
directory (not timed). Timed is what a user calls: initialize() and solve(). The
cost function is the one of its own UR10 example.
"""

import contextlib
import io
import logging
import os
import tempfile
import time

import numpy as np
import yaml
from mdh import JOINTS, urdf
from result import score


def config(samples, method):
    calibration = {
        "enabled": True,
        "parameters": {
            "calibration_level": "full_params",
            "include_non_geometric": False,
            "outlier_threshold": 0.05,
            "estimation": {"method": method},
        },
        "kinematics": {"base_frame": "universe", "tool_frame": "link6"},
        "measurements": {
            "markers": [
                {"name": "point", "reference_joint": "joint6", "measurable_dof": [True] * 3 + [False] * 3}
            ],
            "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
        },
        "joints": {"active_joints": JOINTS},
        "data": {"source_file": "points.csv", "number_of_samples": samples},
    }
    return {
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": JOINTS}}},
        "tasks": {"calibration": calibration},
    }


def run(data, method):
    import matplotlib

    matplotlib.use("Agg")
    from figaroh.calibration.base_calibration import BaseCalibration
    from figaroh.calibration.calibration_tools import calc_updated_fkm
    from figaroh.tools.load_robot import load_robot

    class Calibration(BaseCalibration):
        def cost_function(self, var):
            estimated = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
            residuals = self._compute_logmap_residuals(self.PEE_measured, estimated)
            return self.apply_measurement_weighting(residuals, pos_weight=1.0, orient_weight=0.5)

    logging.disable(logging.WARNING)
    q, p = data["q_train"], data["p_train"]
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        os.chdir(folder)
        try:
            with open("arm.urdf", "w") as file:
                file.write(urdf(data["dh"]))
            with open("arm.yaml", "w") as file:
                yaml.safe_dump(config(len(q), method), file)
            header = ",".join(["x1", "y1", "z1", *JOINTS])
            np.savetxt("points.csv", np.c_[p, q], fmt="%.17g", delimiter=",", header=header, comments="")
            calibration = Calibration(load_robot("arm.urdf", package_dirs="."), "arm.yaml")
            calibration.calib_config["known_baseframe"] = False
            calibration.calib_config["known_tipframe"] = False
            start = time.perf_counter()
            calibration.initialize()
            chosen = time.perf_counter()
            calibration.solve(enable_logging=False)
            end = time.perf_counter()
            test = dict(calibration.calib_config, NbSample=len(data["q_test"]))
            predicted = calc_updated_fkm(
                calibration.model, calibration.data, calibration.var_, data["q_test"], test
            )
        finally:
            os.chdir(here)
    return [
        {
            "task": "fit",
            "seconds": end - start,
            **score(data, predicted.reshape(3, -1).T),
            "note": (
                f"estimation.method '{method}', {len(calibration.var_)} parameters, frames from its own"
                f" closed form; initialize {chosen - start:.1f} s, solve {end - chosen:.1f} s;"
                f" {calibration.STATUS}"
            ),
        }
    ]
