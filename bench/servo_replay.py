# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms replayed by their usual parameters alone, by MuJoCo itself: the one judge of what truing and
mujoco.sysid fit to the same recordings. And the peer's task.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from truing.dynamics import Recording

Floats = NDArray[np.float64]

FRICTION_TIME = 0.004  # [s] solreffriction: with MuJoCo's 0.02 dry friction is viscous when slow
_SLOPE_ROWS = 5  # from which the speed at the start is taken
_BOUNDS = {
    "gain": 30.0,
    "damping": 100.0,
    "frictionloss": 100.0,
    "armature": 100.0,
}  # times and over the file's
_STATES = 1e-3  # rad/s of a start from rest


@dataclass(frozen=True)
class Usual:
    """Usual parameters, shape=(joints,) each."""

    gain: Floats  # [Nm/rad] at the reference of the firmware's gain
    damping: Floats  # [Nm s/rad]
    frictionloss: Floats  # [Nm]
    armature: Floats  # [kg m^2]
    zero: Floats  # [rad] of the recording less the model's


def column(recording: Recording, name: str, otherwise: float) -> Floats:
    found = recording.columns.get(name)
    return np.full(len(recording), otherwise) if found is None else np.asarray(found, dtype=float)


def firmware_scale(recording: Recording, reference: float) -> float:
    return float(column(recording, "kp1_raw", reference)[0]) / reference


def of_file(path: Path, joints: Sequence[str]) -> Usual:
    """What an MJCF with position actuators says."""
    model = mujoco.MjModel.from_xml_path(str(path))
    at = [int(model.joint(name).dofadr[0]) for name in joints]
    ids = [int(model.joint(name).id) for name in joints]
    drive = [int(np.flatnonzero(model.actuator_trnid[:, 0] == id)[0]) for id in ids]
    damping = np.asarray(model.dof_damping).reshape(model.nv, -1)[at, 0] - model.actuator_biasprm[drive, 2]
    return Usual(
        model.actuator_gainprm[drive, 0].copy(),
        damping,
        model.dof_frictionloss[at].copy(),
        model.dof_armature[at].copy(),
        np.zeros(len(at)),
    )


def replay(path: Path, joints: Sequence[str], usual: Usual, recording: Recording, scale: float) -> Floats:
    """Angles at the recording's rows, begun at its first; commands hold. shape=(rows, joints) [rad]"""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    at = np.array([int(model.joint(name).dofadr[0]) for name in joints])
    model.dof_damping[at] = 0.0
    model.dof_damping.reshape(model.nv, -1)[at, 0] = usual.damping
    model.dof_frictionloss[at] = usual.frictionloss
    model.dof_armature[at] = usual.armature
    model.dof_solref[:] = (FRICTION_TIME, 1.0)
    data = mujoco.MjData(model)
    places = np.array([int(model.joint(name).qposadr[0]) for name in joints])
    data.qpos[places] = recording.position[0] - usual.zero
    data.qvel[at] = start_speed(recording)
    on, gain = column(recording, "enabled", 1.0), usual.gain * scale
    found = np.empty_like(recording.position)
    now = 0.0
    for row, until in enumerate(recording.time - recording.time[0]):
        while now < until - 0.5 * model.opt.timestep:
            held = row - 1
            error = recording.command[held] - usual.zero - data.qpos[places]
            data.qfrc_applied[at] = gain * error * on[held]
            mujoco.mj_step(model, data)
            now += model.opt.timestep
        found[row] = data.qpos[places] + usual.zero
    return found


def start_speed(recording: Recording) -> Floats:
    slope = state_at(recording, 0)[1]
    return np.where(np.abs(slope) < _STATES, 0.0, slope)


def state_at(recording: Recording, row: int) -> tuple[Floats, Floats]:
    """Angles and speeds, by a line through the rows around."""
    first = max(0, min(row - _SLOPE_ROWS // 2, len(recording) - _SLOPE_ROWS))
    rows = slice(first, first + _SLOPE_ROWS)
    slope, there = np.polyfit(recording.time[rows] - recording.time[row], recording.position[rows], 1)
    return there, slope


def as_published(path: Path, joints: Sequence[str], recording: Recording, window: float) -> Floats:
    """Angles by the file's own actuators, begun anew at measured states every `window` [s]; commands hold.
    shape=(rows, joints) [rad], the rows of beginnings as measured.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    places = np.array([int(model.joint(name).qposadr[0]) for name in joints])
    speeds = np.array([int(model.joint(name).dofadr[0]) for name in joints])
    ids = [int(model.joint(name).id) for name in joints]
    drives = [int(np.flatnonzero(model.actuator_trnid[:, 0] == id)[0]) for id in ids]
    found = np.array(recording.position, dtype=float)
    times, begun = recording.time - recording.time[0], -np.inf
    now = 0.0
    for row, until in enumerate(times):
        if until - begun >= window:
            mujoco.mj_resetData(model, data)
            data.qpos[places], data.qvel[speeds] = state_at(recording, row)
            begun = now = until
            continue
        data.ctrl[drives] = recording.command[row - 1]
        while now < until - 0.5 * model.opt.timestep:
            mujoco.mj_step(model, data)
            now += model.opt.timestep
        found[row] = data.qpos[places]
    return found


# ---- The peer ------------------------------------------------------------------------------------


def with_sensors(path: Path, joints: Sequence[str]) -> str:
    """The file's model with a sensor for each joint, and dry friction that holds."""
    spec = mujoco.MjSpec.from_file(str(path))
    for name in joints:
        spec.joint(name).solref_friction = [FRICTION_TIME, 1.0]
        spec.add_sensor(
            name=f"{name}_pos",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=name,
        )
    spec.compile()
    return str(spec.to_xml())


def sysid_task(path: Path, joints: Sequence[str], recordings: Sequence[Recording], reference: float) -> Any:
    """Recordings up to where the drive is switched off, from the file's own values."""
    start = of_file(path, joints)
    first = {name: float(getattr(start, name)[0]) for name in _BOUNDS}
    pieces = []
    for one in recordings:
        off = np.flatnonzero(column(one, "enabled", 1.0) < 0.5)
        rows = slice(0, int(off[0]) if len(off) else len(one))
        pieces.append(
            {
                "t": (one.time[rows] - one.time[0]).tolist(),
                "q": one.position[rows].tolist(),
                "u": one.command[rows].tolist(),
                "qd0": start_speed(one).tolist(),
                "scale": firmware_scale(one, reference),
            }
        )
    return {
        "mjcf": with_sensors(path, joints),
        "joints": list(joints),
        "pieces": pieces,
        "start": first,
        "bounds": {name: [first[name] / most, first[name] * most] for name, most in _BOUNDS.items()},
    }


def ask_sysid(python: Path, task: Any) -> dict[str, Any] | str:
    """The peer's answer, or why there is none."""
    if not python.is_file():
        return "not installed: bench/peers/setup_sysid.sh"
    script = Path(__file__).resolve().parent / "peers" / "peer_sysid.py"
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "task.json"
        file.write_text(json.dumps(task), encoding="utf-8")
        done = subprocess.run([str(python), str(script), str(file)], capture_output=True, text=True)
    if done.returncode != 0:
        return f"failed: {done.stderr.strip().splitlines()[-1]}"
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer
