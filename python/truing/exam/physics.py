# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The examiner's robots as mechanisms in MuJoCo, and where they come to rest.

Per joint stand, one behind the other on the same axis: a motor hinge, held where it is commanded; a play
hinge between two stops; an elastic hinge. Links that bend are beams of three elastic hinge pairs. A
palletizer has its plate, its wrist and two
rods: a closed loop. Wrong geometry is wrong body frames.

Rest is found by Newton's method on MuJoCo's own generalised forces (`mj_rne` at zero speed), not by stepping
through time: stops and friction are softened in time stepping, so a gap creeps, and a pose would take
thousands of steps. At rest each spring holds the weight, each gap lies at the stop that weight and friction
push it to, and the rods have their lengths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from truing.exam.kinematics import (
    ALPHA,
    BETA,
    A,
    Chain,
    Changes,
    D,
    Floats,
    Ints,
    NoRestError,
    motions,
    no_changes,
    rotations,
    side_of,
)

Spring = Callable[[Floats], Floats]

_BEAM_AT = (
    1 / 6,
    1 / 2,
    5 / 6,
)  # midpoint rule: tip of a clamped beam under an end force to 3 %, under an end moment exactly
_TINY = 1e-9  # mass and inertia of what has none [kg, kg m^2]: none of its weight moves a gap (`side_of`)
_CONVERGED = 1e-13
_SWEEPS = 60
_PATIENCE = 30  # sweeps until a gap that keeps changing sides counts as afloat


@dataclass(frozen=True)
class Play:
    """A gap between motor and joint, and the friction that holds the joint back while the motor moves in."""

    width: float  # [rad | m]
    friction: float  # [Nm | N]; without bound: the approach decides the side, 0: the weight does


@dataclass(frozen=True)
class Parts:
    """What a mechanism has beside rigid links."""

    springs: Mapping[int, Spring] = field(default_factory=dict)  # joint: deflection of a torque
    wound_by: Mapping[int, Floats] = field(
        default_factory=dict
    )  # joint: friction torque per row that the spring carries as well [Nm]
    plays: Mapping[int, Play] = field(default_factory=dict)
    beams: Mapping[int, float] = field(default_factory=dict)  # link of joint j: compliance [rad/Nm]
    rods: tuple[float, float] = (0.0, 0.0)  # lower and upper rod are longer by [m]
    rod_arm: float = 0.0  # [m]; 0: no rods
    level: float = 0.0  # the wrist's pivot was turned by so much to level the wrist [rad]
    rod_middle: tuple[float, float] = (
        0.0,
        0.0,
    )  # of the ranges of the two driving joints: rods stand square to the arms there


@dataclass
class _Hinge:
    qpos: int
    dof: int


def link_frames(chain: Chain, links: Floats) -> Floats:
    """Constant transform from each joint (after its motion) to the next (before its), the first from the
    base.

    links: shape=(n, J, 4), link values of n poses. Returns shape=(n, J + 1, 4, 4).
    """
    made = []
    before = np.broadcast_to(np.eye(4), (len(links), 4, 4))
    for j in range(chain.joints):
        if chain.mdh:
            before = before @ _across(links[:, j])
        made.append(before @ _turn_z(chain.theta[j]) if chain.prismatic[j] else before)
        before = _along(links[:, j, D])
        if not chain.mdh:
            before = before @ _across(links[:, j])
    made.append(before)
    return np.stack(made, axis=1)


def _across(values: Floats) -> Floats:
    """Tx(a) Rx(alpha) Ry(beta), shape=(n, 4) -> (n, 4, 4)."""
    (ca, sa), (cb, sb) = ((np.cos(values[:, k]), np.sin(values[:, k])) for k in (ALPHA, BETA))
    frames = np.zeros((len(values), 4, 4))
    frames[:, 0, 0], frames[:, 0, 2], frames[:, 0, 3] = cb, sb, values[:, A]
    frames[:, 1, 0], frames[:, 1, 1], frames[:, 1, 2] = sa * sb, ca, -sa * cb
    frames[:, 2, 0], frames[:, 2, 1], frames[:, 2, 2] = -ca * sb, sa, ca * cb
    frames[:, 3, 3] = 1.0
    return frames


def _along(d: Floats) -> Floats:
    frames = np.tile(np.eye(4), (len(d), 1, 1))
    frames[:, 2, 3] = d
    return frames


def _turn_z(angle: float) -> Floats:
    frame = np.eye(4)
    frame[:3, :3] = rotations(np.array([[0.0, 0.0, angle]]))[0]
    return frame


class Mechanism:
    """A MuJoCo model of one robot with given parts."""

    def __init__(self, chain: Chain, parts: Parts, tilting: Sequence[int] = ()) -> None:
        self.chain, self.parts = chain, parts
        self.nominal = link_frames(chain, chain.links[None])[0]
        self.model: Any = mujoco.MjModel.from_xml_string(_Writer(chain, parts, tilting, self.nominal).text())
        self.data: Any = mujoco.MjData(self.model)
        self.tilting = tuple(tilting)
        self.shape = self.nominal
        self.motors = [self._hinge(f"motor{j}") for j in range(chain.joints)]
        self.tilts = {(j, k): self._hinge(f"tilt{j}{'xy'[k]}") for j in tilting for k in range(2)}
        self.plays = {j: self._hinge(f"play{j}") for j in parts.plays}
        self.springs = {j: self._hinge(f"spring{j}") for j in parts.springs}
        self.beams = {
            (j, i, k): self._hinge(f"beam{j}_{i}{k}")
            for j in parts.beams
            for i in range(len(_BEAM_AT))
            for k in "uv"
        }
        self.bodies = [self._id(mujoco.mjtObj.mjOBJ_BODY, f"joint{j}") for j in range(chain.joints)] + [
            self._id(mujoco.mjtObj.mjOBJ_BODY, "flange")
        ]
        self.load = self._id(mujoco.mjtObj.mjOBJ_BODY, "load")
        self.sites = [self._id(mujoco.mjtObj.mjOBJ_SITE, f"target{k}") for k in range(len(chain.targets))]
        self.loop = _Loop(self) if parts.rod_arm > 0.0 else None

    def _id(self, kind: Any, name: str) -> int:
        return int(mujoco.mj_name2id(self.model, kind, name))

    def _hinge(self, name: str) -> _Hinge:
        joint = self._id(mujoco.mjtObj.mjOBJ_JOINT, name)
        return _Hinge(int(self.model.jnt_qposadr[joint]), int(self.model.jnt_dofadr[joint]))

    def measure(
        self, readings: Floats, changes: Changes, direction: Floats, payload: Floats, target: Ints
    ) -> tuple[Floats, Floats]:
        """Target positions (n, 3) and rotations (n, 3, 3) in the measurement frame, everything at rest."""
        n = len(readings)
        position, rotation = np.empty((n, 3)), np.empty((n, 3, 3))
        motion = motions(self.chain, readings, changes)
        frames = link_frames(self.chain, self.chain.links + changes.links)
        for row in range(n):
            self._reshape(frames[row])
            self._command(motion[row], changes, row)
            self.model.body_mass[self.load] = max(float(payload[row]), _TINY)
            self._settle(direction[row], row)
            site = self.sites[int(target[row])]
            turned = self.data.site_xmat[site].reshape(3, 3)
            position[row] = self.data.site_xpos[site] + turned @ (
                self.chain.targets[int(target[row])][:3, :3].T @ changes.tool[row]
            )
            rotation[row] = turned
        return _placed(self.chain, changes, position, rotation)

    def torques(self, readings: Floats, payload: Floats) -> Floats:
        """What the weight does to each joint's motor at the nominal pose, shape=(n, J): of one joint alone,
        followers not counted.
        """
        found = np.empty((len(readings), self.chain.joints))
        changes = no_changes(len(readings), self.chain.joints)
        motion = motions(self.chain, readings, changes)
        for row in range(len(readings)):
            self._command(motion[row], changes, row)
            self.model.body_mass[self.load] = max(float(payload[row]), _TINY)
            found[row] = self._weight()[[motor.dof for motor in self.motors]]
        return found

    def _command(self, motion: Floats, changes: Changes, row: int) -> None:
        self.data.qpos[:] = 0.0
        for j, motor in enumerate(self.motors):
            self.data.qpos[motor.qpos] = (
                motion[j] if self.chain.prismatic[j] else self.chain.theta[j] + motion[j]
            )
        for (j, k), hinge in self.tilts.items():
            self.data.qpos[hinge.qpos] = changes.tilt[row, j, k]

    def _reshape(self, frames: Floats) -> None:
        """Body frames of the links as they are, if they are not so already."""
        if np.array_equal(frames, self.shape):
            return
        self.shape = frames
        quaternion = np.empty(4)
        for body, frame, nominal, j in zip(
            self.bodies, frames, self.nominal, range(len(self.bodies)), strict=True
        ):
            shift = frame[:3, 3].copy()
            if j > 0 and (j - 1) in self.parts.beams:  # the last piece of a beam ends here
                shift -= _BEAM_AT[-1] * nominal[:3, 3]
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame[:3, :3]).ravel())
            self.model.body_pos[body] = shift
            self.model.body_quat[body] = quaternion
        if self.loop:
            self.loop.resize(frames)

    def _settle(self, direction: Floats, row: int) -> None:
        """Newton on springs and gaps. Springs are far stiffer than the weight's change with pose, so their
        stiffness is the whole matrix.
        """
        for sweep in range(_SWEEPS):
            weight = self._weight()
            if self._give_way(weight, direction, row, afloat=sweep >= _PATIENCE) < _CONVERGED:
                return
        raise NoRestError("a mechanism of the examination does not come to rest")

    def _weight(self) -> Floats:
        """Generalised gravity force on every degree of freedom, the loop closed."""
        if self.loop:
            self.loop.close()
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        bias = np.empty(self.model.nv)
        mujoco.mj_rne(self.model, self.data, 0, bias)
        return self.loop.passed_on(-bias) if self.loop else -bias

    def _give_way(self, weight: Floats, direction: Floats, row: int, afloat: bool) -> float:
        """Moves every spring and gap to where the forces put it; the largest move.

        A joint balanced within its gap touches neither stop: it would go to and fro, and is left `afloat` in
        the middle. So is one that nothing weighs on.
        """
        moved = 0.0
        for j, hinge in self.springs.items():
            torque = float(weight[hinge.dof])
            if j in self.parts.wound_by:
                torque -= float(self.parts.wound_by[j][row])
            moved = max(moved, self._put(hinge, float(self.parts.springs[j](np.array(torque)))))
        for j, hinge in self.plays.items():
            play = self.parts.plays[j]
            pushed = float(weight[hinge.dof]) - play.friction * float(direction[self.chain.driven.index(j)])
            place = 0.5 * play.width * float(side_of(np.array(pushed)))
            if afloat and place != float(self.data.qpos[hinge.qpos]):
                place = 0.0
            moved = max(moved, self._put(hinge, place))
        for (j, _, _), hinge in self.beams.items():
            moved = max(
                moved, self._put(hinge, self.parts.beams[j] / len(_BEAM_AT) * float(weight[hinge.dof]))
            )
        return moved

    def _put(self, hinge: _Hinge, value: float) -> float:
        moved = abs(value - float(self.data.qpos[hinge.qpos]))
        self.data.qpos[hinge.qpos] = value
        return moved


def _placed(chain: Chain, changes: Changes, position: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """From the base's own frame, in which MuJoCo works, to the measurement frame."""
    turned = rotations(changes.base[:, 3:]) @ chain.base[:3, :3]
    place = chain.base[:3, 3] + changes.base[:, :3] + np.einsum("nab,nb->na", turned, position)
    return place * (1.0 + changes.scale[:, None]), turned @ rotation


class _Loop:
    """Plate and wrist of a palletizer: two angles so that both rods have their lengths."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.of = mechanism
        chain = mechanism.chain
        self.wrist = next(j for j, drivers in enumerate(chain.drivers) if drivers)
        self.lower, self.upper = (driver for driver, _ in chain.drivers[self.wrist])
        self.plate = mechanism._hinge("plate")
        self.plate_body = mechanism._id(mujoco.mjtObj.mjOBJ_BODY, "plate")
        self.free = [self.plate, mechanism.motors[self.wrist]]
        names = (("turret", "plate_below"), ("plate_above", "wrist"))
        self.ends = [tuple(mechanism._id(mujoco.mjtObj.mjOBJ_SITE, name) for name in pair) for pair in names]
        self.lengths = np.zeros(2)
        self.resize(mechanism.nominal)
        self.gradient = np.zeros((2, mechanism.model.nv))

    def resize(self, frames: Floats) -> None:
        """Rods grow with the arms that they run along, so that wrong arms alone leave the wrist level."""
        arms = np.array([np.linalg.norm(frames[j + 1][:3, 3]) for j in (self.lower, self.upper)])
        self.lengths = arms + np.array(self.of.parts.rods)
        model = self.of.model
        model.site_pos[self.ends[0][0]] = (
            frames[self.lower][:3, :3] @ model.site_pos[self.ends[0][1]] + frames[self.lower][:3, 3]
        )
        model.body_pos[self.plate_body] = frames[self.upper][:3, 3]
        mujoco.mju_mat2Quat(
            model.body_quat[self.plate_body], np.ascontiguousarray(frames[self.upper][:3, :3]).ravel()
        )

    def close(self) -> None:
        data = self.of.data
        # A good start: the plate upright, the wrist level.
        angle = float(data.qpos[self.of.motors[self.lower].qpos])
        if float(data.qpos[self.plate.qpos]) == 0.0:
            data.qpos[self.plate.qpos] = -angle
        for _ in range(_SWEEPS):
            error = self._look()
            if float(np.abs(error).max()) < _CONVERGED:
                return
            step = np.linalg.solve(self.gradient[:, [h.dof for h in self.free]], error)
            for hinge, change in zip(self.free, step, strict=True):
                data.qpos[hinge.qpos] -= change
        raise RuntimeError("the rods of a palletizer of the examination do not reach")

    def _look(self) -> Floats:
        """Errors of the rods' lengths, and their gradients."""
        model, data = self.of.model, self.of.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        error = np.empty(2)
        for k, (one, other) in enumerate(self.ends):
            rod = data.site_xpos[other] - data.site_xpos[one]
            length = float(np.linalg.norm(rod))
            error[k] = length - self.lengths[k]
            self.gradient[k] = (rod / length) @ (self._jacobian(other) - self._jacobian(one))
        return error

    def _jacobian(self, site: int) -> Floats:
        found = np.zeros((3, self.of.model.nv))
        mujoco.mj_jacSite(self.of.model, self.of.data, found, None, site)
        return found

    def passed_on(self, weight: Floats) -> Floats:
        """Forces on plate and wrist reach the other joints through the rods (virtual work)."""
        free = [h.dof for h in self.free]
        moves = -np.linalg.solve(self.gradient[:, free], self.gradient)
        total = weight + weight[free] @ moves
        total[free] = 0.0
        return np.asarray(total)


class _Writer:
    """The robot as a text in MuJoCo's language."""

    def __init__(self, chain: Chain, parts: Parts, tilting: Sequence[int], frames: Floats) -> None:
        self.chain, self.parts, self.tilting, self.frames = chain, parts, tilting, frames
        self.wrist = (
            next((j for j, drivers in enumerate(chain.drivers) if drivers), -1) if parts.rod_arm > 0.0 else -1
        )
        self.lines: list[str] = []
        self.depth = 0

    def text(self) -> str:
        gravity = " ".join(f"{g:.17g}" for g in self.chain.gravity)
        # Hinges one behind the other have no mass between them; the armature keeps MuJoCo's mass matrix
        # regular and does nothing at rest.
        self.lines = [
            '<mujoco><compiler angle="radian" autolimits="true"/>',
            f'<option gravity="{gravity}"><flag contact="disable"/></option>',
            '<default><joint armature="1"/></default><worldbody>',
        ]
        for j in range(self.chain.joints):
            self._joint(j)
        self._end()
        self.lines += ["</body>"] * self.depth + ["</worldbody></mujoco>"]
        return "\n".join(self.lines)

    def _body(self, name: str, frame: Floats, mass: float = 0.0, center: Floats | None = None) -> None:
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame[:3, :3]).ravel())
        self.lines.append(f'<body name="{name}" pos="{_words(frame[:3, 3])}" quat="{_words(quaternion)}">')
        self.depth += 1
        self._mass(mass, center if center is not None else np.zeros(3))

    def _mass(self, mass: float, center: Floats) -> None:
        inertia = max(mass * 0.02 * (0.05 + float(center @ center)), _TINY)
        self.lines.append(
            f'<inertial mass="{max(mass, _TINY):.17g}" pos="{_words(center)}" diaginertia="{inertia:.9g}'
            f' {inertia:.9g} {inertia:.9g}"/>'
        )

    def _joint(self, j: int) -> None:
        frame = self.frames[j]
        if j > 0 and (j - 1) in self.parts.beams:
            frame = self._beam(j - 1, frame)
        if self.wrist >= 0:
            self._loop_before(j, frame)
        after = _along(self.chain.links[j, D : D + 1])[0] if self.chain.mdh else self.frames[j + 1]
        center = after[:3, :3] @ self.chain.com[j] + after[:3, 3]
        bends = j in self.parts.beams
        self._body(f"joint{j}", frame, self.chain.mass[j] * (0.5 if bends else 1.0), center)
        self._hinges(j)
        if self.wrist >= 0:
            self._loop_after(j)

    def _hinges(self, j: int) -> None:
        if j in self.tilting:
            self.lines += [f'<joint name="tilt{j}x" axis="1 0 0"/>', f'<joint name="tilt{j}y" axis="0 1 0"/>']
        kind = "slide" if self.chain.prismatic[j] else "hinge"
        names = (
            ["motor"]
            + (["play"] if j in self.parts.plays else [])
            + (["spring"] if j in self.parts.springs else [])
        )
        self.lines += [f'<joint name="{name}{j}" type="{kind}" axis="0 0 1"/>' for name in names]

    def _beam(self, j: int, frame: Floats) -> Floats:
        """Three pieces with elastic hinges about the two axes across; half the link's weight sits on the
        middle one.
        """
        way = frame[:3, 3]
        across = _across_axes(way)
        after = _along(self.chain.links[j, D : D + 1])[0] if self.chain.mdh else self.frames[j + 1]
        center = after[:3, :3] @ self.chain.com[j] + after[:3, 3]
        last = 0.0
        for i, share in enumerate(_BEAM_AT):
            piece = np.eye(4)
            piece[:3, 3] = (share - last) * way
            last = share
            self._body(
                f"beam{j}_{i}", piece, 0.5 * self.chain.mass[j] if i == 1 else 0.0, center - share * way
            )
            self.lines += [
                f'<joint name="beam{j}_{i}{name}" axis="{_words(axis)}"/>'
                for name, axis in zip("uv", across, strict=True)
            ]
        rest = frame.copy()
        rest[:3, 3] -= _BEAM_AT[-1] * way
        return rest

    def _end(self) -> None:
        self._body("flange", self.frames[-1])
        for k, target in enumerate(self.chain.targets):
            quaternion = np.empty(4)
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(target[:3, :3]).ravel())
            self.lines.append(
                f'<site name="target{k}" pos="{_words(target[:3, 3])}" quat="{_words(quaternion)}"/>'
            )
        load = np.eye(4)
        load[:3, 3] = self.chain.targets[0][:3, 3]
        self._body("load", load)

    # The loop of a palletizer: pivots on turret and plate, on plate and wrist, square to the arms in the
    # middle of their ranges.

    def _pivots(self) -> tuple[Floats, Floats]:
        lower, upper = (driver for driver, _ in self.chain.drivers[self.wrist])
        middle = self.parts.rod_middle
        first = self.chain.theta[lower] + middle[0]
        second = first + self.chain.theta[upper] + middle[1]
        return _square(first, self.parts.rod_arm), _square(second, self.parts.rod_arm)

    def _loop_before(self, j: int, frame: Floats) -> None:
        lower, upper = (driver for driver, _ in self.chain.drivers[self.wrist])
        below, above = self._pivots()
        if j == lower:  # written into the turret
            place = frame[:3, :3] @ below + frame[:3, 3]
            self.lines.append(f'<site name="turret" pos="{_words(place)}"/>')
        if j == upper:  # turns about the upper arm's axis, on the end of the lower arm
            self._body("plate", frame)
            self.lines += [
                '<joint name="plate" axis="0 0 1"/>',
                f'<site name="plate_below" pos="{_words(below)}"/>',
                f'<site name="plate_above" pos="{_words(above)}"/>',
                "</body>",
            ]
            self.depth -= 1

    def _loop_after(self, j: int) -> None:
        if j != self.wrist:
            return
        lower, upper = (driver for driver, _ in self.chain.drivers[self.wrist])
        level = self.chain.theta[lower] + self.chain.theta[upper] + self.chain.theta[j]
        place = rotations(np.array([[0.0, 0.0, self.parts.level - level]]))[0] @ self._pivots()[1]
        self.lines.append(f'<site name="wrist" pos="{_words(place)}"/>')


def _square(angle: float, arm: float) -> Floats:
    return arm * np.array([math.cos(angle + 0.5 * math.pi), math.sin(angle + 0.5 * math.pi), 0.0])


def _across_axes(way: Floats) -> tuple[Floats, Floats]:
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        raise ValueError("a link without a length cannot bend")
    along = way / length
    start = np.eye(3)[int(np.argmin(np.abs(along)))]
    first = np.cross(along, start)
    first /= np.linalg.norm(first)
    return first, np.cross(along, first)


def _words(values: Floats) -> str:
    return " ".join(f"{float(v):.17g}" for v in values)
