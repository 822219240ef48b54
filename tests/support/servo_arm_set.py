# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the data set of python/truing/examples/servo_arm.

The arm of arm.xml in truth has softer gains, other friction, a delay, and zeros that are off; it is driven
along five motions.

    python tests/support/servo_arm_set.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

import truing.examples
from lerobot_sets import write_lerobot

Floats = NDArray[np.float64]

MOTORS = ("shoulder_pan", "shoulder_lift", "elbow_flex")
FPS = 30.0
SECONDS = 9.0
STEP = 0.001  # [s]
COUNT = 2.0 * np.pi / 4096  # [rad] of the encoders
GAINS = (19.0, 21.0, 18.0)  # [Nm/rad]
DAMPING = (0.9, 1.1, 0.95)  # [Nm s/rad]
FRICTION = (0.07, 0.09, 0.08)  # [Nm]
ARMATURE = (0.02, 0.024, 0.02)  # [kg m^2]
ZERO = (0.004, -0.02, 0.03)  # [rad] what the robot reads less the model's angle
DELAY = 0.024  # [s]
HOME = np.array([0.0, -0.5, 0.6])
HELD_OUT = 2  # of the episodes, the last


def truth() -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_file(str(arm_file()))
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for k, name in enumerate(MOTORS):
        joint, actuator = spec.joint(name), spec.actuator(name)
        joint.damping = [DAMPING[k], 0.0, 0.0]
        joint.frictionloss, joint.armature = FRICTION[k], ARMATURE[k]
        joint.solref_friction = [0.004, 1.0]
        actuator.set_to_position(kp=GAINS[k], kv=0.0)
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator.delay, actuator.nsample = DELAY, round(DELAY / STEP) + 1
    return spec.compile()


def arm_file() -> Path:
    return Path(truing.examples.__file__).parent / "servo_arm" / "arm.xml"


def commands(episode: int) -> Floats:
    """Steps, sines of several frequencies, a slow sweep, waypoints twice. shape=(rows, joints) [rad]"""
    random = np.random.default_rng(100 + episode)
    t = np.arange(round(SECONDS * FPS)) / FPS
    wide = np.array([0.7, 0.5, 0.6])
    if episode == 0:
        holds = np.repeat(random.uniform(-0.5, 0.5, size=(8, 3)), -(-t.size // 8), axis=0)
        return HOME + wide * holds[: t.size] * np.minimum(1.0, t / 0.5)[:, None]
    if episode == 1:
        waves = sum(
            np.sin(2 * np.pi * f * t[:, None] + random.uniform(0.0, 6.0, size=3)) / (1.0 + 2.0 * f)
            for f in (0.15, 0.4, 0.9, 1.6)
        )
        return HOME + 0.45 * wide * waves * np.minimum(1.0, t / 1.0)[:, None]
    if episode == 2:
        return HOME + 0.6 * wide * np.sin(2 * np.pi * t[:, None] / np.array([8.0, 7.0, 5.0]))
    points = np.vstack([np.zeros(3), random.uniform(-0.9, 0.9, size=(7, 3))])
    at = t / SECONDS * 7.0
    k = np.minimum(at.astype(int), 6)
    part = np.clip(1.6 * (at - k), 0.0, 1.0)  # on the way, then held
    smooth = part * part * (3.0 - 2.0 * part)
    return HOME + wide * (points[k] + (points[k + 1] - points[k]) * smooth[:, None])


def recorded(model: mujoco.MjModel, command: Floats) -> Floats:
    """What the encoders read at the times of the commands. shape=(rows, joints) [rad]"""
    data = mujoco.MjData(model)
    joints = [model.joint(name).qposadr[0] for name in MOTORS]
    controls = [model.actuator(name).id for name in MOTORS]
    zero = np.array(ZERO)
    data.qpos[joints] = command[0] - zero
    data.ctrl[controls] = command[0] - zero
    for _ in range(round(2.0 / STEP)):  # at rest before the recording begins
        mujoco.mj_step(model, data)
    out = np.empty_like(command)
    for k, row in enumerate(command):
        out[k] = np.round((data.qpos[joints] + zero) / COUNT) * COUNT
        data.ctrl[controls] = row - zero
        # 33 and 34 ms in turn make 30 Hz.
        for _ in range(round((k + 1) / FPS / STEP) - round(k / FPS / STEP)):
            mujoco.mj_step(model, data)
    return out


def write(folder: Path) -> None:
    model = truth()
    episodes = []
    for episode in range(5):
        command = commands(episode)
        episodes.append((np.degrees(recorded(model, command)), np.degrees(command)))
    write_lerobot(folder, MOTORS, FPS, episodes, HELD_OUT)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
