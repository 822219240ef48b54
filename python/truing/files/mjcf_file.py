# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""MJCF: MuJoCo compiles the file, and the chain from base to tip becomes a robot of convention urdf.

A joint's frame stands at its anchor with the axes of its body, so that the motion is about the frame's
origin; motion counts from `ref`. Bodies that do not move against a link are merged into it. Names are kept.
"""

from __future__ import annotations

import contextlib
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files.common import decoded, listed, read_bytes, shown

Floats = NDArray[np.float64]

_LARGEST_MJCF = 64_000_000
_BEFORE_ROOT = {"<?": "?>", "<!--": "-->", "<!": ">"}  # what begins so, and how it ends
_DAMPING = ("viscous", "viscous_law.quadratic", "viscous_law.cubic")
_ROOTS = ("mujoco", "mujocoinclude")  # of a part MuJoCo says that it is none
_ROOT = re.compile(r"<([\w.:-]+)")


def is_mjcf(path: Path) -> bool:
    """Whether the root element of an XML file is `mujoco`, or that of a part."""
    if path.suffix.lower() != ".xml":
        return False
    text = decoded(path, read_bytes(path, _LARGEST_MJCF))
    at = text.find("<")
    while at >= 0:
        ending = next((end for start, end in _BEFORE_ROOT.items() if text.startswith(start, at)), None)
        if ending is None:
            match = _ROOT.match(text, at)
            return match is not None and match[1] in _ROOTS
        end = text.find(ending, at)
        at = text.find("<", end + len(ending)) if end >= 0 else -1
    return False


def robot_from_mjcf(path: Path, base: str = "", tip: str = "") -> _core.Robot:
    """The chain from body `base` to body or site `tip` of an MJCF; empty: the world, the only end.

    Warns (InputWarning) of what the file has and the robot leaves out. Raises InputError: MuJoCo is not
    installed, not an MJCF that it takes, no such body, several ends, free or ball joints, closed loops.
    """
    mj = _mujoco(path)
    with quiet(mj):
        model = _compiled(mj, path)
    chain = _Chain(mj, model, path, base, tip)
    robot = chain.robot(path.stem)
    chain.warn()
    return robot


def _mujoco(path: Path) -> Any:
    try:
        import mujoco
    except ModuleNotFoundError as error:
        raise InputError(
            f"{path}: is an MJCF, and reading one needs the package {error.name}, which is not installed:"
            ' pip install "truing[dynamics]"'
        ) from None
    return mujoco


@contextlib.contextmanager
def quiet(mujoco: Any) -> Iterator[None]:
    """What MuJoCo warns of is told by what comes of it, not in a file of the working folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _compiled(mj: Any, path: Path) -> Any:
    try:
        spec = mj.MjSpec.from_file(str(path))
        try:
            return spec.compile()
        except ValueError:
            # Meshes are often left behind. Where inertials are stated, shapes say nothing wanted here.
            always = mj.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
            from_shapes = int(spec.compiler.inertiafromgeom) == int(always)
            if from_shapes or not all(body.explicitinertial for body in spec.bodies[1:]):
                raise
            bare = mj.MjSpec.from_file(str(path))
            _strip_shapes(bare)
            return bare.compile()
    except (ValueError, RuntimeError) as error:
        why = " ".join(str(error).split())[:1000]
        raise InputError(f"{path}: is not an MJCF that MuJoCo {mj.__version__} takes: {why}") from None


def _strip_shapes(spec: Any) -> None:
    for kind in ("pairs", "excludes", "skins", "geoms", "meshes", "hfields", "materials", "textures"):
        for element in list(getattr(spec, kind)):
            spec.delete(element)


# ---- Frames --------------------------------------------------------------------------------------


def _frame(position: Any = (0.0, 0.0, 0.0), rotation: Any = None) -> Floats:
    T = np.eye(4)
    T[:3, 3] = position
    if rotation is not None:
        T[:3, :3] = rotation
    return T


def _turn(axis: Floats, angle: float) -> Floats:
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))


@dataclass
class _Link:
    """What moves with a joint, in the joint's frame: masses, centres, inertias about them."""

    mass: float = 0.0
    moment: Floats = field(default_factory=lambda: np.zeros(3))
    about_origin: Floats = field(default_factory=lambda: np.zeros((3, 3)))

    def add(self, mass: float, center: Floats, inertia: Floats) -> None:
        self.mass += mass
        self.moment += mass * center
        self.about_origin += inertia + mass * (center @ center * np.eye(3) - np.outer(center, center))

    def fields(self) -> dict[str, Any]:
        """mass, center_of_mass and inertia of a joint (Steiner)."""
        c = self.moment / self.mass if self.mass > 0.0 else np.zeros(3)
        inertia = self.about_origin - self.mass * (c @ c * np.eye(3) - np.outer(c, c))
        return {"mass": self.mass, "center_of_mass": c, "inertia": 0.5 * (inertia + inertia.T)}


# ---- The chain -----------------------------------------------------------------------------------


class _Chain:
    """The bodies of a compiled model, and which of its joints are the robot's."""

    def __init__(self, mj: Any, model: Any, path: Path, base: str, tip: str) -> None:
        self.mj = mj
        self.m = model
        self.path = path
        self.left_out: list[str] = []
        self.children: list[list[int]] = [[] for _ in range(model.nbody)]
        for body in range(1, model.nbody):
            self.children[model.body_parentid[body]].append(body)
        self.base = self._body(base, "base") if base else 0
        self.site = -1
        self.tip = self._named_tip(tip) if tip else self._only_end()
        self.bodies = self._between()
        self.joints = [
            joint for body in self.bodies for joint in self._joints_of(body) if self._require_turning(joint)
        ]
        self.locked: dict[int, float] = {}
        self.followers: dict[int, tuple[int, float, float]] = {}
        self._read_equalities()
        self.moving = [joint for joint in self.joints if joint not in self.locked]
        if not self.moving:
            self._refuse(
                f"nothing moves between {self._body_name(self.base)} and {self._body_name(self.tip)}"
            )
        self.links = [_Link() for _ in self.moving]
        self.owner: dict[int, tuple[int, Floats]] = {}  # body: link (-1: the base) and T_link_body
        self.origins: list[Floats] = []

    # -- names

    def _refuse(self, message: str) -> NoReturn:
        raise InputError(f"{self.path}: {message}")

    def _name(self, kind: Any, index: int) -> str:
        return self.mj.mj_id2name(self.m, kind, index) or ""

    def _body_name(self, body: int) -> str:
        if body == 0:
            return "the world"
        return shown(self._name(self.mj.mjtObj.mjOBJ_BODY, body) or f"body {body} (it has no name)")

    def _joint_name(self, joint: int) -> str:
        name = self._name(self.mj.mjtObj.mjOBJ_JOINT, joint)
        return name or f"joint{joint + 1}"

    def _body(self, name: str, role: str) -> int:
        body = int(self.mj.mj_name2id(self.m, self.mj.mjtObj.mjOBJ_BODY, name))
        if body < 0:
            self._refuse(
                f"{role} body {shown(name)} does not exist; the bodies are {listed(self._body_names())}"
            )
        return body

    def _body_names(self) -> list[str]:
        return [self._name(self.mj.mjtObj.mjOBJ_BODY, body) for body in range(self.m.nbody)]

    # -- base and tip

    def _named_tip(self, name: str) -> int:
        site = int(self.mj.mj_name2id(self.m, self.mj.mjtObj.mjOBJ_SITE, name))
        body = int(self.mj.mj_name2id(self.m, self.mj.mjtObj.mjOBJ_BODY, name))
        if body < 0 and site >= 0:
            self.site = site
            return int(self.m.site_bodyid[site])
        if body < 0:
            sites = [self._name(self.mj.mjtObj.mjOBJ_SITE, k) for k in range(self.m.nsite)]
            also = f"; the sites are {listed(sites)}" if sites else ""
            self._refuse(
                f"tip {shown(name)} does not exist; the bodies are {listed(self._body_names())}{also}"
            )
        return body

    def _below(self, body: int) -> Iterable[int]:
        waiting = [body]
        while waiting:
            body = waiting.pop()
            yield body
            waiting += reversed(self.children[body])

    def _path(self, body: int) -> list[int]:
        """The bodies from below the base to `body`; empty if that is not below it."""
        path = []
        while body != self.base:
            if body == 0:
                return []
            path.append(body)
            body = int(self.m.body_parentid[body])
        return path[::-1]

    def _joints_of(self, body: int) -> range:
        first, count = int(self.m.body_jntadr[body]), int(self.m.body_jntnum[body])
        return range(first, first + count) if count else range(0)

    def _only_end(self) -> int:
        """The tip that the file leaves no doubt about."""
        free = int(self.mj.mjtJoint.mjJNT_FREE)
        moving = [body for body in self._below(self.base) if body != self.base and self._joints_of(body)]
        # What lies about, free to move, is no arm; unless there is nothing else.
        lying = {
            inner
            for body in moving
            if any(int(self.m.jnt_type[joint]) == free for joint in self._joints_of(body))
            for inner in self._below(body)
        }
        arm = [body for body in moving if body not in lying] or moving
        ends = [body for body in arm if not any(inner in arm for inner in self._below(body) if inner != body)]
        if not ends:
            self._refuse(
                f"nothing moves below {self._body_name(self.base)}: it has no hinge and no slide joint"
            )
        if len(ends) == 1:
            return self._end_of(ends[0])
        if self.m.nsite == 1 and self._path(int(self.m.site_bodyid[0])):
            self.site = 0
            return int(self.m.site_bodyid[0])
        actuated = [body for body in arm if any(self._is_actuated(joint) for joint in self._joints_of(body))]
        last = max(actuated, key=lambda body: len(self._path(body)), default=None)
        if last is not None and set(actuated) <= set(self._path(last)):
            return last
        self._refuse(
            f"below {self._body_name(self.base)} {len(ends)} branches end, at"
            f" {', '.join(self._body_name(body) for body in ends)}: name the tip (--tip-link, tip_link=), a"
            " body or a site"
        )

    def _end_of(self, last: int) -> int:
        """The tip on the last moving body: its only leaf, or its only site, or that body."""
        fixed = list(self._below(last))
        leaves = [body for body in fixed if not self.children[body]]
        sites = [site for site in range(self.m.nsite) if int(self.m.site_bodyid[site]) in fixed]
        if len(leaves) == 1:
            return leaves[0]
        if len(sites) == 1:
            self.site = sites[0]
            return int(self.m.site_bodyid[sites[0]])
        return last

    def _is_actuated(self, joint: int) -> bool:
        return bool(self._actuators_of(joint))

    def _actuators_of(self, joint: int) -> list[int]:
        kinds = (int(self.mj.mjtTrn.mjTRN_JOINT), int(self.mj.mjtTrn.mjTRN_JOINTINPARENT))
        return [
            k
            for k, kind in enumerate(self.m.actuator_trntype)
            if int(kind) in kinds and int(self.m.actuator_trnid[k, 0]) == joint
        ]

    def _between(self) -> list[int]:
        path = self._path(self.tip)
        if not path:
            self._refuse(
                f"tip {self._body_name(self.tip)} is not below base {self._body_name(self.base)}; the bodies"
                f" are {listed(self._body_names())}"
            )
        return path

    def _require_turning(self, joint: int) -> bool:
        kinds = self.mj.mjtJoint
        name, kind = shown(self._joint_name(joint)), int(self.m.jnt_type[joint])
        if kind == int(kinds.mjJNT_FREE):
            self._refuse(
                f"joint {name} is free: a floating base is not read. Name a base body (--base-link,"
                " base_link=) above which nothing counts, if the robot stood still"
            )
        if kind == int(kinds.mjJNT_BALL):
            self._refuse(f"joint {name} is a ball: between base and tip only hinge and slide joints are read")
        return True

    # -- equality constraints

    def _read_equalities(self) -> None:
        kinds = self.mj.mjtEq
        for k in range(self.m.neq):
            if not self.m.eq_active0[k]:
                continue
            kind, one, two = int(self.m.eq_type[k]), int(self.m.eq_obj1id[k]), int(self.m.eq_obj2id[k])
            if kind == int(kinds.mjEQ_JOINT):
                self._read_joint_equality(k, one, two)
            elif kind in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
                self._refuse_loop(k, "connect" if kind == int(kinds.mjEQ_CONNECT) else "weld", one, two)
            elif kind == int(kinds.mjEQ_TENDON):
                self._refuse_tendon(k, (one, two))

    def _read_joint_equality(self, k: int, one: int, two: int) -> None:
        """q1 - ref1 = a0 + a1 (q2 - ref2): a joint that follows, or one that is held."""
        if one not in self.joints:
            return  # of a branch
        name = shown(self._joint_name(one))
        a0, a1, *higher = (float(value) for value in self.m.eq_data[k, :5])
        if two < 0:
            self.locked[one] = a0
            return
        if any(higher):
            self._refuse(
                f"joint {name} follows another by a polynomial of higher order: only straight lines are read"
            )
        if two not in self.joints:
            self._refuse(
                f"joint {name} follows {shown(self._joint_name(two))}, which does not move between base and"
                " tip: choose them so that both do"
            )
        if one in self.followers:
            self._refuse(f"joint {name} follows two joints at once")
        self.followers[one] = (two, a0, a1)

    def _link_below(self, body: int) -> int:
        """The last body of the chain that carries `body`: what hangs on it counts to it."""
        while body not in self.bodies and body not in (0, self.base):
            body = int(self.m.body_parentid[body])
        while body in self.bodies and not self._joints_of(body):
            body = int(self.m.body_parentid[body])
        return body if body in self.bodies else 0

    def _refuse_loop(self, k: int, kind: str, one: int, two: int) -> None:
        if int(self.m.eq_objtype[k]) == int(self.mj.mjtObj.mjOBJ_SITE):
            one, two = int(self.m.site_bodyid[one]), int(self.m.site_bodyid[two])
        if self._link_below(one) == self._link_below(two):
            return  # within what is merged into one link
        for leader, led in ((one, two), (two, one)):
            if self.m.body_mocapid[leader] >= 0:
                names = f"{self._body_name(leader)} leads {self._body_name(led)}"
                self.left_out.append(f"the `{kind}` by which the mocap body {names}: not read")
                return
        self._refuse(
            f"the equality constraint `{kind}` between {self._body_name(one)} and {self._body_name(two)}"
            " closes a loop: closed chains are not read. Write the passive joint of a parallelogram as"
            " `driven_by` in a robot.yaml, or as `equality/joint`, and take the constraint out"
        )

    def _refuse_tendon(self, k: int, tendons: Iterable[int]) -> None:
        for tendon in tendons:
            if tendon >= 0 and self._chain_joints_of(tendon):
                self._refuse(
                    "an equality constraint of tendons holds joints of the chain: it is not read; write"
                    " `equality/joint`"
                )

    def _chain_joints_of(self, tendon: int) -> list[int]:
        first, count = int(self.m.tendon_adr[tendon]), int(self.m.tendon_num[tendon])
        joint_kind = int(self.mj.mjtWrap.mjWRAP_JOINT)
        held = []
        for wrap in range(first, first + count):
            if int(self.m.wrap_type[wrap]) != joint_kind:
                held += self.joints  # a tendon along sites: of which joints, only its path says
            elif int(self.m.wrap_objid[wrap]) in self.joints:
                held.append(int(self.m.wrap_objid[wrap]))
        return held

    # -- to a robot

    def robot(self, default_name: str) -> _core.Robot:
        self._place_bodies()
        for body in range(1, self.m.nbody):
            link, T = self.owner.get(body, (-1, np.eye(4)))
            if link >= 0:
                self._add_body(self.links[link], body, T)
        _, T_link_tip = self.owner[self.tip]
        if self.site >= 0:
            T_link_tip = T_link_tip @ _frame(
                self.m.site_pos[self.site], self._rotation(self.m.site_quat[self.site])
            )
        joints = [self._joint(k) for k in range(len(self.moving))]
        effects = self._torque_effects()
        try:
            robot = _core.Robot(
                self._model_name() or default_name,
                convention="urdf",
                gravity=self._gravity(),
                joints=joints,
                targets=[_core.Target("tool", T_link_tip)],
                torque_effects=effects,
            )
            _core.validate_robot(robot)
        except ValueError as error:
            raise InputError(f"{self.path}: {error}") from None
        return robot

    def _model_name(self) -> str:
        return bytes(self.m.names).split(b"\0", 1)[0].decode("utf-8", "replace")

    def _rotation(self, quaternion: Any) -> Floats:
        matrix = np.zeros(9)
        self.mj.mju_quat2Mat(matrix, np.asarray(quaternion, dtype=float))
        return matrix.reshape(3, 3)

    def _gravity(self) -> Floats:
        if int(self.m.opt.disableflags) & int(self.mj.mjtDisableBit.mjDSBL_GRAVITY):
            return np.zeros(3)
        return np.asarray(self._base_frame()[:3, :3].T @ np.array(self.m.opt.gravity))

    def _base_frame(self) -> Floats:
        """The base in the world, joints below it at their references."""
        T, body = np.eye(4), self.base
        while body != 0:
            T = _frame(self.m.body_pos[body], self._rotation(self.m.body_quat[body])) @ T
            body = int(self.m.body_parentid[body])
        return T

    def _place_bodies(self) -> None:
        """Every body's link and its place there; at a joint of the chain a new link begins, at its anchor."""
        number = {joint: k for k, joint in enumerate(self.moving)}
        self.owner[self.base] = (-1, np.eye(4))
        for body in self._below(self.base):
            if body == self.base:
                continue
            link, T = self.owner[int(self.m.body_parentid[body])]
            T = T @ _frame(self.m.body_pos[body], self._rotation(self.m.body_quat[body]))
            for joint in self._joints_of(body) if body in self.bodies else ():
                if joint in self.locked:
                    T = T @ self._motion(joint, self.locked[joint])
                    continue
                anchor = self.m.jnt_pos[joint] if self._turns(joint) else np.zeros(3)
                self.origins.append(T @ _frame(anchor))
                link, T = number[joint], _frame(0.0 - anchor)
            self.owner[body] = (link, T)
            if body not in self.bodies and self._joints_of(body) and link >= 0:
                self.left_out.append(
                    f"{self._body_name(body)} moves off the chain: it is merged into the link that carries"
                    " it, as it stands at its reference position"
                )

    def _turns(self, joint: int) -> bool:
        return int(self.m.jnt_type[joint]) == int(self.mj.mjtJoint.mjJNT_HINGE)

    def _motion(self, joint: int, motion: float) -> Floats:
        axis = np.asarray(self.m.jnt_axis[joint])
        if not self._turns(joint):
            return _frame(motion * axis)
        anchor = np.asarray(self.m.jnt_pos[joint])
        return _frame(anchor, _turn(axis, motion)) @ _frame(0.0 - anchor)

    def _add_body(self, link: _Link, body: int, T_link_body: Floats) -> None:
        R = T_link_body[:3, :3]
        center = R @ np.asarray(self.m.body_ipos[body]) + T_link_body[:3, 3]
        axes = R @ self._rotation(self.m.body_iquat[body])
        link.add(float(self.m.body_mass[body]), center, axes @ np.diag(self.m.body_inertia[body]) @ axes.T)

    def _joint(self, k: int) -> _core.Joint:
        joint = self.moving[k]
        dof = int(self.m.jnt_dofadr[joint])
        reference = float(self.m.qpos0[self.m.jnt_qposadr[joint]])
        limited = bool(self.m.jnt_limited[joint])
        axis = np.array(self.m.jnt_axis[joint])
        fields: dict[str, Any] = {
            "type": "revolute" if self._turns(joint) else "prismatic",
            "T_parent_joint": self.origins[k],
            "axis": axis / np.linalg.norm(axis),
            "offset": -reference if reference else 0.0,
            "rotor_inertia": float(self.m.dof_armature[dof])
            + sum(
                float(self.m.actuator_gear[a, 0]) ** 2 * float(self.m.actuator_armature[a])
                for a in self._actuators_of(joint)
            ),
            "torque_limit": self._torque_limit(joint),
            **self.links[k].fields(),
        }
        lower, upper = self.m.jnt_range[joint]
        if lower > upper:  # MuJoCo takes such a joint for one without limits
            self._refuse(
                f"joint {shown(self._joint_name(joint))}: its range is {lower:g} to {upper:g}, expected the"
                " lower limit first"
            )
        if limited:
            fields["lower"], fields["upper"] = (float(value) for value in self.m.jnt_range[joint])
        if joint in self.followers:
            driver, a0, a1 = self.followers[joint]
            if driver in self.locked:
                self._refuse(f"joint {shown(self._joint_name(joint))} follows a joint that is held")
            fields["driven_by"], fields["offset"] = [(self._joint_name(driver), a1)], a0
        return _core.Joint(self._joint_name(joint), **fields)

    def _torque_limit(self, joint: int) -> float:
        """Of the joint, and of its actuator if it has one alone."""
        limits = []
        if self.m.jnt_actfrclimited[joint]:
            limits.append(float(np.abs(self.m.jnt_actfrcrange[joint]).max()))
        actuators = self._actuators_of(joint)
        if len(actuators) == 1 and self.m.actuator_forcelimited[actuators[0]]:
            gear = abs(float(self.m.actuator_gear[actuators[0], 0]))
            limits.append(gear * float(np.abs(self.m.actuator_forcerange[actuators[0]]).max()))
        return min((limit for limit in limits if 0.0 < limit < 1e6), default=float("inf"))

    # -- friction and springs

    def _line(self, joint: int) -> tuple[int, float, float]:
        """The joint with a reading that moves `joint`, and motion = factor * its motion + constant."""
        factor, constant, seen = 1.0, 0.0, {joint}
        while joint in self.followers:
            joint, a0, a1 = self.followers[joint]
            constant, factor = constant + factor * a0, factor * a1
            if joint in seen:
                self._refuse(f"joint {shown(self._joint_name(joint))} follows itself")
            seen.add(joint)
        return joint, factor, constant

    def _torque_effects(self) -> list[_core.AppliedEffect]:
        """Laws of the file at the joints with a reading; those of a joint that follows by virtual work."""
        found: dict[tuple[int, str], float] = {}

        def add(joint: int, name: str, value: float) -> None:
            found[joint, name] = found.get((joint, name), 0.0) + value

        for joint in self.moving:
            root, w, constant = self._line(joint)
            dof, adr = int(self.m.jnt_dofadr[joint]), int(self.m.jnt_qposadr[joint])
            add(root, "coulomb", abs(w) * float(self.m.dof_frictionloss[dof]))
            for power, (law, value) in enumerate(zip(_DAMPING, self._damping(joint), strict=True), start=1):
                add(root, law, abs(w) ** (power + 1) * value)
            k = float(self.m.jnt_stiffness[joint])
            # motion of the joint: q - q0 = w (q_root - q0_root) + constant; its spring pulls to qpos_spring.
            at_zero = constant - w * float(self.m.qpos0[self.m.jnt_qposadr[root]]) + float(self.m.qpos0[adr])
            add(root, "spring", w**2 * k)
            add(root, "current_offset", w * k * (at_zero - float(self.m.qpos_spring[adr])))
        order = ("coulomb", *_DAMPING, "spring", "current_offset")
        return [
            self._applied(joint, name, found[joint, name])
            for joint in self.moving
            for name in order
            if found.get((joint, name))
        ]

    def _applied(self, joint: int, name: str, value: float) -> _core.AppliedEffect:
        effect, _, part = name.partition(".")
        of = self._joint_name(joint)
        parameter = f"{effect}.{of}.{part}" if part else f"{effect}.{of}"
        return _core.AppliedEffect(effect, [of], {parameter: value})

    def _damping(self, joint: int) -> Floats:
        """Of speed, speed |speed| and speed cubed, the actuators' own with it."""
        dof = int(self.m.jnt_dofadr[joint])
        out = np.array([self.m.dof_damping[dof], *self.m.dof_dampingpoly[dof]], dtype=float)
        for a in self._actuators_of(joint):
            gear = abs(float(self.m.actuator_gear[a, 0]))
            own = np.array([self.m.actuator_damping[a], *self.m.actuator_dampingpoly[a]], dtype=float)
            out += own * gear ** np.arange(2, 5)
        return out

    # -- what is left out

    def warn(self) -> None:
        m = self.m
        moved = [body for body, (link, _) in self.owner.items() if link >= 0]
        dropped: list[tuple[Callable[[], bool], str]] = [
            (lambda: bool(np.any(m.body_gravcomp[moved])), "gravity compensation of bodies (gravcomp)"),
            (lambda: bool(np.any(m.jnt_stiffnesspoly[self.joints])), "springs that are not straight lines"),
            (self._has_tendon_forces, "springs, friction and inertia of tendons"),
            (lambda: bool(m.opt.density or m.opt.viscosity), "the medium (density, viscosity)"),
        ]
        self.left_out += [f"{what}: not read" for is_there, what in dropped if is_there()]
        colliding = self._colliding(moved)
        if colliding:
            self.left_out.append(f"geoms may collide ({colliding}): contacts are ignored")
        if self.left_out:
            warnings.warn(f"{self.path}: {'; '.join(self.left_out)}", InputWarning, stacklevel=4)

    def _has_tendon_forces(self) -> bool:
        m = self.m
        names = ("stiffness", "damping", "frictionloss", "armature")
        return any(
            any(getattr(m, f"tendon_{name}")[tendon] for name in names) and self._chain_joints_of(tendon)
            for tendon in range(m.ntendon)
        )

    def _colliding(self, moved: list[int]) -> str:
        """Two bodies, one of which moves with the chain, whose geoms are not kept from touching."""
        m = self.m
        flags = self.mj.mjtDisableBit
        if int(m.opt.disableflags) & int(flags.mjDSBL_CONTACT):
            return ""
        weld, excluded = m.body_weldid, {int(signature) for signature in m.exclude_signature}
        for one in moved:
            for two in range(m.nbody):
                if not m.body_geomnum[one] or not m.body_geomnum[two] or weld[one] == weld[two]:
                    continue
                touches = (
                    m.body_contype[one] & m.body_conaffinity[two]
                    or m.body_contype[two] & m.body_conaffinity[one]
                )
                low, high = min(one, two), max(one, two)
                parents = weld[m.body_parentid[weld[one]]], weld[m.body_parentid[weld[two]]]
                # Parent and child are filtered, but not against the world.
                related = (weld[two] == parents[0] != 0) or (weld[one] == parents[1] != 0)
                if touches and not related and (low << 16) + high not in excluded:
                    return f"those of {self._body_name(one)} and {self._body_name(two)}"
        return ""
