# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The arm of a simulator's file without its actuators: bodies, joints, and the chain that the file means."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from truing import _core
from truing.dynamics.export import export, import_mujoco
from truing.dynamics.export.mjcf import FRICTION_HOLDS, FRICTION_TIME
from truing.dynamics.servo.chain import ServoChain, ServoJoint
from truing.errors import InputError
from truing.files.mjcf_file import quiet

LEAST_ARMATURE = 1e-6  # [kg m^2] of a file that says none
LEAST_FRICTION = 1e-4  # [Nm] and of its friction [Nm, Nm s/rad], which are fitted as logarithms
_GUESSED_GAIN = 10.0  # [Nm/rad] where no actuator says one
_SLIDE, _HINGE = 2, 3  # mjtJoint


@dataclass(frozen=True)
class ServoArm:
    """Bodies and joints as MJCF, and the actuator chain that the file states."""

    name: str
    mjcf: str  # bodies and joints alone; compiles by itself
    nominal: ServoChain
    bodies: tuple[str, ...]  # those that move, from the base on
    notes: tuple[str, ...] = field(default=())  # what of the file does not act


def servo_arm(
    robot: _core.Robot | str | Path, joints: Sequence[str] | None = None, recorded: int = 0
) -> ServoArm:
    """The arm of an MJCF or URDF file, or of a robot (which is exported first).

    joints: those that were recorded, in the order of the recordings' columns; None: the file's hinges and
    slides in their order. recorded: number of joints in the recordings; 0: as many as the file has.
    Raises InputError: MuJoCo is not installed or refuses the file, a joint that the file does not have, free
    or ball joints, other numbers of joints than were recorded.
    """
    mujoco = import_mujoco()
    if isinstance(robot, _core.Robot):
        joints = [joint.name for joint in robot.joints if not joint.passive] if joints is None else joints
        with tempfile.TemporaryDirectory() as folder:
            return servo_arm(export(robot, "mjcf", Path(folder)).model, joints, recorded)
    path = Path(robot)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file: expected an MJCF or a URDF")
    try:
        with quiet(mujoco):
            model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: MuJoCo cannot load it: {error}") from None
    return _Reader(path, model, joints, recorded).arm()


class _Reader:
    """What of a compiled model makes an arm."""

    def __init__(self, path: Path, model: Any, joints: Sequence[str] | None, recorded: int) -> None:
        self.path, self.m = path, model
        self.joints = self._chosen(joints, recorded)
        self.names = tuple(str(model.joint(j).name) for j in self.joints)
        self.notes: list[str] = []

    def _chosen(self, names: Sequence[str] | None, recorded: int) -> list[int]:
        m = self.m
        there = [m.joint(j).name for j in range(m.njnt)]
        other = [m.joint(j).name or str(j) for j in range(m.njnt) if m.jnt_type[j] not in (_SLIDE, _HINGE)]
        if other:
            raise InputError(
                f"{self.path}: joint {other[0]} is free or a ball: an arm on a fixed base was expected, of"
                " hinges and slides"
            )
        if names is not None:
            missing = [name for name in names if name not in there]
            if missing:
                raise InputError(f"{self.path}: there is no joint {missing[0]}; there are {', '.join(there)}")
            chosen = [there.index(name) for name in names]
        else:
            chosen = list(range(m.njnt))
        if not chosen or (recorded and len(chosen) != recorded):
            raise InputError(
                f"{self.path}: has {len(chosen)} joints ({', '.join(there[j] for j in chosen)}), and"
                f" {recorded} were recorded: say which ones (--joints, or --tip-link)"
            )
        return chosen

    def arm(self) -> ServoArm:
        m = self.m
        held = [m.joint(j).name for j in range(m.njnt) if j not in self.joints]
        if held:
            self.notes.append(f"{', '.join(held)}: not recorded, held where the file has them")
        if m.ntendon or m.neq:
            self.notes.append("tendons and equality constraints of the file do not act")
        if self._may_touch():
            self.notes.append("contacts of the file do not act")
        moving = {int(m.jnt_bodyid[j]) for j in self.joints}
        bodies = []
        for b in range(1, m.nbody):
            at = b
            while at and at not in moving:
                at = int(m.body_parentid[at])
            if at and m.body_mass[b] > 0.0:
                bodies.append(self._body(b))
        if not bodies:
            raise InputError(f"{self.path}: no body that moves has a mass: expected <inertial> of the links")
        model = str(getattr(m, "names", b"").split(b"\0")[0].decode() or self.path.stem)
        return ServoArm(model, self._mjcf(), self._chain(bodies), tuple(bodies), tuple(self.notes))

    def _may_touch(self) -> bool:
        m = self.m
        return bool(m.npair or np.any(m.geom_contype) and np.any(m.geom_conaffinity) and m.ngeom > 1)

    def _body(self, b: int) -> str:
        return str(self.m.body(b).name) or f"body{b}"

    # ---- bodies and joints

    def _mjcf(self) -> str:
        m = self.m
        children: dict[int, list[int]] = {}
        for b in range(1, m.nbody):
            children.setdefault(int(m.body_parentid[b]), []).append(b)
        gravity = _numbers(m.opt.gravity)
        lines = [
            f"<mujoco model={quoteattr(self.path.stem)}>",
            '  <compiler angle="radian" autolimits="false" boundmass="0" balanceinertia="false"/>',
            f'  <option gravity="{gravity}" integrator="implicitfast">',
            '    <flag contact="disable" limit="disable" island="disable" autoreset="disable"/>',
            "  </option>",
            "  <worldbody>",
            *(line for b in children.get(0, []) for line in self._element(b, children, 2)),
            "  </worldbody>",
            "</mujoco>",
        ]
        return "\n".join(lines) + "\n"

    def _element(self, b: int, children: dict[int, list[int]], depth: int) -> list[str]:
        m, pad = self.m, "  " * depth
        out = [
            f'{pad}<body name={quoteattr(self._body(b))} pos="{_numbers(m.body_pos[b])}"'
            f' quat="{_numbers(m.body_quat[b])}" gravcomp="{float(m.body_gravcomp[b])!r}">'
        ]
        for j in self.joints:
            if m.jnt_bodyid[j] == b:
                out.append(pad + "  " + self._joint(j))
        if m.body_mass[b] > 0.0:
            out.append(
                f'{pad}  <inertial pos="{_numbers(m.body_ipos[b])}" quat="{_numbers(m.body_iquat[b])}"'
                f' mass="{float(m.body_mass[b])!r}" diaginertia="{_numbers(m.body_inertia[b])}"/>'
            )
        for child in children.get(b, []):
            out += self._element(child, children, depth + 1)
        return [*out, f"{pad}</body>"]

    def _joint(self, j: int) -> str:
        m = self.m
        dof = int(m.jnt_dofadr[j])
        kind = "slide" if m.jnt_type[j] == _SLIDE else "hinge"
        adr = int(m.jnt_qposadr[j])
        return (
            f'<joint name={quoteattr(str(m.joint(j).name))} type="{kind}" axis="{_numbers(m.jnt_axis[j])}"'
            f' pos="{_numbers(m.jnt_pos[j])}" ref="{float(m.qpos0[adr])!r}"'
            f' springref="{float(m.qpos_spring[adr])!r}"'
            f' stiffness="{float(np.ravel(m.jnt_stiffness[j])[0])!r}"'
            f' damping="{float(np.ravel(m.dof_damping[dof])[0])!r}"'
            f' frictionloss="{max(float(m.dof_frictionloss[dof]), LEAST_FRICTION)!r}"'
            f' armature="{float(m.dof_armature[dof])!r}" solreffriction="{FRICTION_TIME} 1"'
            f' solimpfriction="{_numbers(FRICTION_HOLDS)}"/>'
        )

    # ---- the chain

    def _chain(self, bodies: Sequence[str]) -> ServoChain:
        m = self.m
        return ServoChain(
            joints=self.names,
            prismatic=tuple(bool(m.jnt_type[j] == _SLIDE) for j in self.joints),
            drives=tuple(self._drive(j) for j in self.joints),
            payload_body=bodies[-1],
            payload_place=self._payload_place(bodies[-1]),
        )

    def _payload_place(self, body: str) -> tuple[float, float, float]:
        """The body's last site, a tool's as a rule, or its centre: at the joint's axis a mass is idle."""
        m = self.m
        b = next(b for b in range(1, m.nbody) if self._body(b) == body)
        sites = [k for k in range(m.nsite) if m.site_bodyid[k] == b]
        place = m.site_pos[sites[-1]] if sites else m.body_ipos[b]
        return float(place[0]), float(place[1]), float(place[2])

    def _drive(self, j: int) -> ServoJoint:
        m = self.m
        dof = int(m.jnt_dofadr[j])
        gain, viscous, limit, delay = _GUESSED_GAIN, float(np.ravel(m.dof_damping[dof])[0]), math.inf, 0.0
        fed_back = 0.0  # [Nm s/rad] for the speed: MuJoCo limits it together with the torque for the error
        mine = [a for a in range(m.nu) if m.actuator_trntype[a] in (0, 1) and m.actuator_trnid[a, 0] == j]
        if len(mine) > 1:
            raise InputError(f"{self.path}: joint {m.joint(j).name} has {len(mine)} actuators, expected one")
        for a in mine:
            gear = abs(float(m.actuator_gear[a, 0]))
            gain = abs(float(m.actuator_gainprm[a, 0])) * gear**2
            fed_back = abs(float(m.actuator_biasprm[a, 2])) * gear**2
            if m.actuator_forcelimited[a]:
                limit = gear * float(np.abs(m.actuator_forcerange[a]).max())
            delay = float(m.actuator_delay[a]) if hasattr(m, "actuator_delay") else 0.0
        if not mine:
            self.notes.append(f"joint {m.joint(j).name} has no actuator: its gain is fitted from a guess")
        return ServoJoint(
            command_gain=max(gain, 1e-9),
            viscous=max(viscous + fed_back, LEAST_FRICTION),
            limited_damping=fed_back / (viscous + fed_back) if 0.0 < limit < math.inf and fed_back else 0.0,
            coulomb=max(float(m.dof_frictionloss[dof]), LEAST_FRICTION),
            armature=max(float(m.dof_armature[dof]), LEAST_ARMATURE),
            saturation=limit if limit > 0.0 else math.inf,
            delay=delay,
        )


def _numbers(values: Any) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))
