# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""kinematics.yaml of ur_description (ROS): x, y, z, roll, pitch, yaw of six joints, as ur_calibration writes
it.

ur_description turns about z of each frame, from `base_link_inertia` (the controller's base) to `wrist_3_link`
(the flange): joint k stands at origin k of the chain.
"""

from __future__ import annotations

import hashlib

import numpy as np

from truing import _core
from truing.chains import fixed_frames
from truing.controllers.chain import Floats, about_z, origins, robot_of
from truing.controllers.distances import between, dropped_effects, dropped_ratios, poses_of
from truing.controllers.written import Written
from truing.errors import InputError

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
FILE = "kinematics.yaml"
_REASON = "ur_description has joint origins and nothing else"
_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def written(robot: _core.Robot) -> Written:
    """Raises InputError for a robot without six revolute joints in a row."""
    if len(robot.joints) != len(LINKS) or any(j.type != "revolute" or j.driven_by for j in robot.joints):
        raise InputError(
            f"{robot.name}: ur_description is for six revolute joints in a row, found {len(robot.joints)}"
            " joints"
        )
    frames = origins(about_z(fixed_frames(robot)))
    rows = {name: _row(T) for name, T in zip(LINKS, frames, strict=False)}
    text = _text(robot.name, rows)
    read = [_frame(row) for row in rows.values()]
    axis = np.array([0.0, 0.0, 1.0])
    exported = robot_of([*read, frames[-1]], robot, [axis] * len(LINKS))
    at_base = robot.replace(T_measurement_base=np.eye(4))
    notes = [
        "use it: ros2 launch ur_robot_driver ur_control.launch.py ur_type:=… robot_ip:=…"
        f" kinematics_params_file:=$PWD/{FILE} (older: kinematics_config)",
        "the driver compares `hash` with the checksum of its controller and warns that it differs: this is"
        " no longer the controller's own calibration. The controller still moves by its own: Cartesian moves"
        " of its own (movel) keep their error, MoveIt's do not",
    ]
    if not np.allclose(frames[-1], np.eye(4), atol=1e-12):
        notes.append(
            "the last link does not end at the flange of ur_description (wrist_3_link): see `tool` for what"
            " follows it"
        )
    return Written(
        files={FILE: text},
        values={"kinematics": {name: dict(zip(_KEYS, row, strict=True)) for name, row in rows.items()}},
        lines=[(name, ", ".join(f"{value:.6g}" for value in row)) for name, row in rows.items()],
        dropped=[*dropped_ratios(robot, _REASON), *dropped_effects(robot, _REASON)],
        notes=notes,
        remaining=between(at_base, exported, poses_of(robot)),
        extra={"T_wrist_3_tool": (frames[-1] @ np.asarray(robot.targets[0].T_last_target)).tolist()},
    )


def _row(T: Floats) -> list[float]:
    return [*map(float, T[:3, 3]), *map(float, _core.rpy_from_rotation(np.array(T[:3, :3])))]


def _frame(row: list[float]) -> Floats:
    return np.asarray(_core.frame_from_xyz_rpy(row[:3], row[3:]))


def _text(name: str, rows: dict[str, list[float]]) -> str:
    body = []
    for link, row in rows.items():
        body.append(f"  {link}:")
        body += [f"    {key}: {value + 0.0!r}" for key, value in zip(_KEYS, row, strict=True)]
    digest = hashlib.sha256("\n".join(body).encode()).hexdigest()[:16]
    head = f"# Calibrated kinematics of {' '.join(name.split())}, written by truing. m, rad.\nkinematics:\n"
    return head + "\n".join(body) + f"\n  hash: truing_{digest}\n"
