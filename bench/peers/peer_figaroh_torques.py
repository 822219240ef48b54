# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""FIGAROH's identification of base parameters, Coulomb and viscous friction, rotor inertia and offset by
weighted least squares, on rows that are filtered and differentiated already.

    python peer_figaroh_torques.py ROBOT.urdf ROWS.npz OUT.npz

ROWS: q, qd, qdd, torque, shape=(rows, joints), and which rows it may learn from (`train`). OUT: torques of
all rows.
"""

import contextlib
import io
import logging
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml


def config(joints):
    components = {"friction": True, "actuator_inertia": True, "joint_offset": True}
    zeros = [0.0] * len(joints)
    task = {
        "enabled": True,
        "joints": {"active_joints": joints},
        "mechanics": {
            "friction_coefficients": {"viscous": zeros, "static": zeros},
            "actuator_inertias": zeros,
            "joint_offsets": zeros,
        },
        "problem": {"model_components": components, "wls": True},
        "coupling": {"has_coupled_wrist": False},
    }
    return {
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": joints}}},
        "tasks": {"identification": task},
    }


def main():
    import matplotlib

    matplotlib.use("Agg")
    from figaroh.identification.base_identification import BaseIdentification
    from figaroh.tools.load_robot import load_robot
    from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced

    logging.disable(logging.WARNING)
    urdf, rows, out = sys.argv[1:]
    data = {name: table.astype(float) for name, table in np.load(rows).items()}
    train = data["train"] > 0.5
    names = ("positions", "velocities", "accelerations", "torques")
    tables = dict(zip(names, (data[key] for key in ("q", "qd", "qdd", "torque")), strict=True))

    class Identification(BaseIdentification):
        def load_trajectory_data(self, data_source=None):
            learned = {name: table[train] for name, table in tables.items()}
            return {"timestamps": np.arange(train.sum()) * 0.04, **learned}

        def process_kinematics_data(self, filter_config=None):
            self.processed_data = dict(self.raw_data)  # filtered and differentiated already

    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:
        robot = load_robot(urdf, package_dirs=str(Path(urdf).parent))
        joints = [name for name in robot.model.names if name != "universe"]
        file = Path(folder) / "arm.yaml"
        file.write_text(yaml.safe_dump(config(joints)), encoding="utf-8")
        made = Identification(robot, str(file))
        moved = [robot.model.joints[robot.model.getJointId(name)] for name in joints]
        made.identif_config["act_idxq"] = [joint.idx_q for joint in moved]
        made.identif_config["act_idxv"] = [joint.idx_v for joint in moved]
        made.initialize()
        made.solve(decimate=False, plotting=False, wls=True)
        whole = [tables[name] for name in names[:3]]
        regressor = build_regressor_basic(robot, *whole, made.identif_config)
        base = build_regressor_reduced(regressor, made._idx_eliminated)[:, made._base_indices]
    np.savez(out, torque=(base @ made.phi_base).reshape(len(joints), -1).T)


if __name__ == "__main__":
    main()
