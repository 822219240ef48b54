# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The robots and targets that bench/inverse.cpp writes, as the peers take them: frames of a chain, URDF.

Link parameters are turned into frames here, apart from the library; every joint turns about, or moves along,
z of its frame.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def turn(axis: str, angle: float) -> Floats:
    """(4, 4), angle in rad."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = np.eye(4)
    T[i, i], T[i, j], T[j, i], T[j, j] = c, -s, s, c
    return T


def shift(x: float, z: float) -> Floats:
    """(4, 4), metres."""
    T = np.eye(4)
    T[0, 3], T[2, 3] = x, z
    return T


@dataclass(frozen=True)
class Chain:
    name: str
    # (n, 4, 4), of every joint at zero in the frame of the one before; the first in the measurement frame
    placements: Floats
    tool: Floats  # (4, 4), in the frame of the last joint
    prismatic: NDArray[np.bool_]  # (n,)
    lower: Floats  # (n,) [rad | m]
    upper: Floats

    @property
    def joints(self) -> int:
        return len(self.prismatic)

    def zero_frames(self) -> Floats:
        """(n + 1, 4, 4): joints, then the tool, in the measurement frame, with all joints at zero."""
        frames, T = [], np.eye(4)
        for placement in [*self.placements, self.tool]:
            T = T @ placement
            frames.append(T)
        return np.array(frames)


def chain_of(name: str, robot: dict[str, Any]) -> Chain:
    """dh: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta), the joint moves first; mdh: Rx(alpha) Tx(a) Ry(beta)
    Rz(theta) Tz(d), it moves last.
    """
    before = np.reshape(robot["T_measurement_base"], (4, 4))
    placements = []
    for joint in robot["joints"]:
        link = shift(joint["a"], 0.0) @ turn("x", joint["alpha"]) @ turn("y", joint["beta"])
        moving = turn("z", joint["theta"]) @ shift(0.0, joint["d"])
        if robot["convention"] == "mdh":
            link = turn("x", joint["alpha"]) @ shift(joint["a"], 0.0) @ turn("y", joint["beta"])
            placements.append(before @ link)
            before = moving
        else:
            placements.append(before)
            before = moving @ link
    joints = robot["joints"]
    return Chain(
        name,
        np.array(placements),
        before @ np.reshape(robot["T_last_target"], (4, 4)),
        np.array([j["prismatic"] for j in joints]),
        np.array([j["lower"] for j in joints]),
        np.array([j["upper"] for j in joints]),
    )


def read_chains(folder: Path) -> dict[str, Chain]:
    return {
        name: chain_of(name, robot)
        for name, robot in json.loads((folder / "robots.json").read_text(encoding="utf-8")).items()
    }


@dataclass(frozen=True)
class Cases:
    truth: Floats  # (m, n), joints that the targets were made from
    seed: Floats  # (m, n)
    wanted: Floats  # (m, 4, 4), T_measurement_target

    def first(self, count: int) -> Cases:
        return Cases(self.truth[:count], self.seed[:count], self.wanted[:count])


def read_cases(folder: Path, name: str, joints: int) -> Cases:
    rows = np.fromfile(folder / f"{name}.cases").reshape(-1, 2 * joints + 16)
    return Cases(
        rows[:, :joints].copy(),
        rows[:, joints : 2 * joints].copy(),
        rows[:, 2 * joints :].reshape(-1, 4, 4).copy(),
    )


def write_chain(chain: Chain, path: Path) -> None:
    """For pinocchio_clik."""
    rows = [
        np.concatenate([[slides, low, high], T.ravel()])
        for slides, low, high, T in zip(
            chain.prismatic, chain.lower, chain.upper, chain.placements, strict=True
        )
    ]
    np.concatenate([*rows, chain.tool.ravel()]).tofile(path)


def write_cases(cases: Cases, path: Path) -> None:
    np.hstack([cases.truth, cases.seed, cases.wanted.reshape(len(cases.wanted), 16)]).tofile(path)


def rpy_of(T: Floats) -> tuple[float, float, float]:
    """R = Rz(yaw) Ry(pitch) Rx(roll) [rad]. Roll is found last, so that it makes up for what near pitch = 90
    degrees cannot be told apart.
    """
    yaw = math.atan2(T[1, 0], T[0, 0])
    pitch = math.atan2(-T[2, 0], math.hypot(T[0, 0], T[1, 0]))
    rest = (turn("z", yaw) @ turn("y", pitch)).T @ T
    return math.atan2(rest[2, 1], rest[1, 1]), pitch, yaw


def urdf_of(chain: Chain) -> str:
    """Links base, link1 … linkN, tool; joints joint1 … jointN along z."""
    names = ["base", *(f"link{k + 1}" for k in range(chain.joints)), "tool"]
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    )
    lines = [
        f'<robot name="{chain.name}">',
        *(f'<link name="{name}">{inertial if name != "base" else ""}</link>' for name in names),
    ]
    for k, T in enumerate([*chain.placements, chain.tool]):
        kind = "fixed" if k == chain.joints else "prismatic" if chain.prismatic[k] else "revolute"
        lines.append(
            f'<joint name="joint{k + 1}" type="{kind}"><parent link="{names[k]}"/><child'
            f' link="{names[k + 1]}"/><origin xyz="{" ".join(repr(float(x)) for x in T[:3, 3])}"'
            f' rpy="{" ".join(repr(float(x)) for x in rpy_of(T))}"/>'
        )
        if kind != "fixed":
            lines.append(
                f'<axis xyz="0 0 1"/><limit lower="{float(chain.lower[k])!r}"'
                f' upper="{float(chain.upper[k])!r}" effort="1000" velocity="10"/>'
            )
        lines.append("</joint>")
    return "\n".join([*lines, "</robot>", ""])


def mjcf_of(chain: Chain) -> str:
    """The same for MuJoCo: bodies link1 … linkN, site tool."""

    def place(T: Floats) -> str:
        w, x, y, z = quaternion_of(T)
        return f'pos="{" ".join(repr(float(v)) for v in T[:3, 3])}" quat="{w!r} {x!r} {y!r} {z!r}"'

    body = f'<site name="tool" {place(chain.tool)}/>'
    for k in reversed(range(chain.joints)):
        kind = "slide" if chain.prismatic[k] else "hinge"
        body = (
            f'<body name="link{k + 1}" {place(chain.placements[k])}><inertial pos="0 0 0" mass="1"'
            f' diaginertia="1 1 1"/><joint name="joint{k + 1}" type="{kind}" axis="0 0 1" limited="true"'
            f' range="{float(chain.lower[k])!r} {float(chain.upper[k])!r}"/>{body}</body>'
        )
    return f'<mujoco model="{chain.name}"><compiler angle="radian"/><worldbody>{body}</worldbody></mujoco>'


def quaternion_of(T: Floats) -> tuple[float, float, float, float]:
    """w, x, y, z of a rotation, by its largest component (Shepperd 1978)."""
    R = T[:3, :3]
    squares = np.array([R.trace(), R[0, 0], R[1, 1], R[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = np.array([1.0 + R.trace(), R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.zeros(4)
        q[0], q[1 + i], q[1 + j], q[1 + k] = (
            R[k, j] - R[j, k],
            1.0 + R[i, i] - R[j, j] - R[k, k],
            R[j, i] + R[i, j],
            R[k, i] + R[i, k],
        )
    w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
    return w, x, y, z
