# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Many chains over many windows at once: MuJoCo's models and data, one of each a thread, handed to C++ as
addresses. C++ computes the chain and calls `mj_step`; no Python runs meanwhile."""

from __future__ import annotations

import contextlib
import copy
import ctypes
import os
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export import import_mujoco
from truing.dynamics.servo.arm import ServoArm
from truing.dynamics.servo.chain import ServoChain, ServoJoint
from truing.dynamics.servo.charge import Charges
from truing.dynamics.servo.data import ServoData, Window
from truing.errors import InputError
from truing.files.mjcf_file import quiet

Floats = NDArray[np.float64]
FIELDS: tuple[str, ...] = tuple(_core.servo_fields())
_STEPS_AT_ONCE = 1_500_000  # of the simulator in one call: Ctrl-C is heard between two
_TOLERANCE = 1e-10  # of dry friction, the only constraint: few rows, for which PGS is quicker than Newton
_REMEMBERED = 4_000_000  # numbers, 32 MB: motions that are asked for again are not simulated again
Function = tuple[int, str, float, float, Floats]
"""A torque added at a joint: its number, of which input, first place, width between places, values [Nm]."""


@dataclass(frozen=True)
class Point:
    """A chain as numbers: shape=(joints, fields), and what is not of one joint."""

    chain: Floats
    weight: float = 1.0
    payload: float = 0.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    links: tuple[tuple[str, float], ...] = ()  # body, mass and inertia over the model's
    functions: tuple[Function, ...] = field(default=(), compare=False)

    def with_value(self, joint: int | slice, name: str, value: float) -> Point:
        """With this value of a joint, or of several."""
        chain = self.chain.copy()
        chain[joint, FIELDS.index(name)] = value
        return replace(self, chain=chain)

    def value(self, joint: int, name: str) -> float:
        return float(self.chain[joint, FIELDS.index(name)])

    def key(self) -> bytes:
        """The same of points that move alike."""
        rest = (self.weight, self.payload, self.place, self.links)
        functions = b"".join(repr(f[:4]).encode() + f[4].tobytes() for f in self.functions)
        return self.chain.tobytes() + repr(rest).encode() + functions


def point_of(chain: ServoChain) -> Point:
    rows = [[getattr(drive, name) for name in FIELDS] for drive in chain.drives]
    return Point(
        np.array(rows, dtype=float),
        chain.weight_scale,
        chain.payload_mass,
        chain.payload_place,
        tuple(sorted(chain.link_scale.items())),
    )


def chain_of(point: Point, like: ServoChain) -> ServoChain:
    drives = tuple(
        ServoJoint(**{name: float(value) for name, value in zip(FIELDS, row, strict=True)})
        for row in point.chain
    )
    return replace(
        like,
        drives=drives,
        weight_scale=point.weight,
        payload_mass=point.payload,
        payload_place=point.place,
        link_scale=dict(point.links),
    )


class Simulator:
    """One arm and its recordings, ready to run."""

    def __init__(self, arm: ServoArm, data: ServoData, threads: int = 0) -> None:
        mujoco = import_mujoco()
        self.mujoco, self.arm, self.data = mujoco, arm, data
        self.model = mujoco.MjModel.from_xml_string(arm.mjcf)
        self.model.opt.timestep = data.step
        self.model.opt.solver, self.model.opt.tolerance = mujoco.mjtSolver.mjSOL_PGS, _TOLERANCE
        if arm.nominal.gravity is not None:
            self.model.opt.gravity[:] = arm.nominal.gravity
        self.threads = threads if threads > 0 else (os.cpu_count() or 1)
        self.last_body = self.model.body(arm.nominal.payload_body).id if arm.nominal.payload_body else 0
        self._models = [copy.copy(self.model) for _ in range(self.threads)]
        self._datas = [mujoco.MjData(model) for model in self._models]
        self._spaces = [_addresses(m, d) for m, d in zip(self._models, self._datas, strict=True)]
        self._calls, self._library = _functions(mujoco)
        self._known: dict[tuple[bytes, Window], Floats] = {}
        self._numbers = 0  # of these
        self.simulated = 0  # chains, times the windows of each
        self._charges = Charges(data, self._charged)
        joints = [self.model.joint(name) for name in arm.nominal.joints]
        self._places = [int(joint.qposadr[0]) for joint in joints], [int(joint.dofadr[0]) for joint in joints]
        self.core_arm = self.core_arm_with(data.step)
        self.core_recordings = [
            _core.ServoRecording(s.step, s.command, s.smooth, s.speed, s.gain, s.supply, s.enabled, s.warmth)
            for s in data.streams
        ]
        self.dofs = np.array([int(joint.dofadr[0]) for joint in joints])

    def core_arm_with(self, step: float) -> _core.ServoArm:
        """Where the joints are; simulated in steps of so many seconds."""
        gravity = np.array(self.model.opt.gravity)
        return _core.ServoArm(*self._places, step, int(self.model.nbody), gravity, self.data.torque_command)

    def run(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        torques: bool = False,
        heard: Callable[[int, int], None] | None = None,
    ) -> tuple[list[Floats], list[Floats]]:
        """Positions and torques of every point, shape=(rows of all windows, joints) each. Positions of the
        same chain in the same window are simulated once, while they are remembered."""
        if torques:
            return self._run(points, windows, torques, heard)
        keys = [p.key() for p in points]
        known = self._known
        new = {k: p for k, p in zip(keys, points, strict=True) if any((k, w) not in known for w in windows)}
        some = [w for w in dict.fromkeys(windows) if any((k, w) not in known for k in new)]
        fresh: dict[tuple[bytes, Window], Floats] = {}
        if new:
            for key, motion in zip(new, self._run(list(new.values()), some, False, heard)[0], strict=True):
                parts = np.split(motion, np.cumsum([w.rows for w in some])[:-1])
                fresh |= {(key, w): part for w, part in zip(some, parts, strict=True)}
        seen = ChainMap(fresh, known)
        motions = [np.concatenate([seen[key, w] for w in windows]) for key in keys]
        self._remember(fresh)
        return motions, []

    def _remember(self, fresh: Mapping[tuple[bytes, Window], Floats]) -> None:
        """What was known longest goes first."""
        for key, motion in fresh.items():
            self._numbers += motion.size - (self._known[key].size if key in self._known else 0)
            self._known[key] = motion
        while self._numbers > _REMEMBERED:
            self._numbers -= self._known.pop(next(iter(self._known))).size

    def _run(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        torques: bool,
        heard: Callable[[int, int], None] | None,
    ) -> tuple[list[Floats], list[Floats]]:
        return self._with(points, windows, self._charges.of(points, windows), torques, heard)

    def _charged(
        self, points: Sequence[Point], windows: Sequence[Window], charges: Sequence[Floats]
    ) -> list[Floats]:
        return self._with(points, windows, charges, False, None)[0]

    def _with(
        self,
        points: Sequence[Point],
        windows: Sequence[Window],
        charges: Sequence[Floats],
        torques: bool,
        heard: Callable[[int, int], None] | None,
    ) -> tuple[list[Floats], list[Floats]]:
        """charges: of each point, what its integrals hold when recordings begin."""
        self.simulated += len(points) * len(windows)
        bodies, places = self._bodies(points)
        sets = [
            _core.ServoSet(p.chain, p.weight, place, list(p.functions), charge=charge)
            for p, place, charge in zip(points, places, charges, strict=True)
        ]
        parts: list[tuple[list[Floats], list[Floats]]] = []
        with quiet(self.mujoco), _untimed(self._library):
            batches = list(self._batches(windows, len(points)))
            for k, batch in enumerate(batches):
                some = [_core.ServoWindow(w.stream, w.first, w.rows) for w in batch]
                parts.append(
                    _core.simulate_servos(
                        self._calls,
                        self._spaces,
                        self.core_arm,
                        bodies,
                        self.core_recordings,
                        some,
                        sets,
                        torques,
                    )
                )
                if heard is not None:
                    heard(k + 1, len(batches))
        motion = [np.concatenate([part[0][i] for part in parts]) for i in range(len(points))]
        if not torques:
            return motion, []
        return motion, [np.concatenate([part[1][i] for part in parts]) for i in range(len(points))]

    def _batches(self, windows: Sequence[Window], points: int) -> Iterator[list[Window]]:
        """Windows one after the other, so many at once that Ctrl-C is heard."""
        batch: list[Window] = []
        steps = 0.0
        for window in windows:
            of = window.rows * self.data.streams[window.stream].step / self.data.step * points
            if batch and steps + of > _STEPS_AT_ONCE:
                yield batch
                batch, steps = [], 0.0
            batch.append(window)
            steps += of
        yield batch

    # ---- masses

    def _bodies(self, points: Sequence[Point]) -> tuple[list[Any], list[int]]:
        """Masses of all bodies of the points that have others than the model, each kind once."""
        kinds: dict[tuple[Any, ...], int] = {}
        bodies: list[Any] = []
        places: list[int] = []
        for p in points:
            key = (p.payload, p.place, p.links)
            if not p.payload and all(scale == 1.0 for _, scale in p.links):
                places.append(-1)
                continue
            if key not in kinds:
                kinds[key] = len(bodies)
                bodies.append(_core.ServoBodies(*self.masses(p)))
            places.append(kinds[key])
        return bodies, places

    def masses(self, point: Point) -> tuple[Floats, Floats, Floats, Floats]:
        """Mass, place and turn of the centre, and inertia of all bodies, flat."""
        m = self.model
        mass, ipos = np.array(m.body_mass), np.array(m.body_ipos)
        iquat, inertia = np.array(m.body_iquat), np.array(m.body_inertia)
        for name, scale in point.links:
            b = m.body(name).id
            mass[b] *= scale
            inertia[b] *= scale
        if point.payload:
            b = self.last_body
            self._add_point_mass(b, point.payload, np.array(point.place), mass, ipos, iquat, inertia)
        return mass, ipos.ravel(), iquat.ravel(), inertia.ravel()

    def with_masses(self, point: Point) -> Any:
        """A model of its own with the masses of a point."""
        m = copy.copy(self.model)
        mass, ipos, iquat, inertia = self.masses(point)
        m.body_mass[:], m.body_ipos[:] = mass, ipos.reshape(-1, 3)
        m.body_iquat[:], m.body_inertia[:] = iquat.reshape(-1, 4), inertia.reshape(-1, 3)
        self.mujoco.mj_setConst(m, self.mujoco.MjData(m))
        return m

    def _add_point_mass(
        self,
        b: int,
        added: float,
        place: Floats,
        mass: Floats,
        ipos: Floats,
        iquat: Floats,
        inertia: Floats,
    ) -> None:
        """A point mass in a body: parallel axes (Steiner)."""
        flat = np.empty(9)
        self.mujoco.mju_quat2Mat(flat, iquat[b])
        turn = flat.reshape(3, 3)
        whole = turn @ np.diag(inertia[b]) @ turn.T
        total = mass[b] + added
        centre = (mass[b] * ipos[b] + added * place) / total
        for one, at in ((mass[b], ipos[b]), (added, place)):
            d = at - centre
            whole = whole + one * (d @ d * np.eye(3) - np.outer(d, d))
        values, axes = np.linalg.eigh(whole)
        if np.linalg.det(axes) < 0.0:
            axes[:, 0] *= -1.0
        self.mujoco.mju_mat2Quat(iquat[b], np.ascontiguousarray(axes).ravel())
        mass[b], ipos[b], inertia[b] = total, centre, np.maximum(values, 1e-12)


def _functions(mujoco: Any) -> tuple[dict[str, int], ctypes.CDLL]:
    """Addresses of MuJoCo's functions, of the library that the package has loaded, and the library."""
    folder = Path(mujoco.__file__).parent
    names = [*folder.glob("libmujoco*.so*"), *folder.glob("libmujoco*.dylib"), *folder.glob("mujoco.dll")]
    for name in sorted(names):
        library = ctypes.CDLL(str(name))
        found = {
            call: ctypes.cast(getattr(library, call), ctypes.c_void_p).value or 0
            for call in ("mj_step", "mj_resetData", "mj_setConst")
        }
        if all(found.values()):
            return found, library
    raise InputError(f"{folder}: there is no library of MuJoCo: pip install --force-reinstall mujoco")


@contextlib.contextmanager
def _untimed(library: ctypes.CDLL) -> Iterator[None]:
    """Meanwhile MuJoCo does not read the clock, which takes it a fifth of a small arm's steps."""
    clock = ctypes.c_void_p.in_dll(library, "mjcb_time")
    before = clock.value
    clock.value = None
    try:
        yield
    finally:
        clock.value = before


def _addresses(model: Any, data: Any) -> dict[str, int]:
    """Of one thread's model and data, and of the arrays that the chain reads and writes."""
    arrays: Mapping[str, Any] = {
        "qpos": data.qpos,
        "qvel": data.qvel,
        "qfrc_applied": data.qfrc_applied,
        "qfrc_bias": data.qfrc_bias,
        "qfrc_constraint": data.qfrc_constraint,
        "inertia_at_zero": model.dof_M0,
        "frictionloss": model.dof_frictionloss,
        "damping": model.dof_damping,
        "armature": model.dof_armature,
        "gravity": model.opt.gravity,
        "mass": model.body_mass,
        "ipos": model.body_ipos,
        "iquat": model.body_iquat,
        "inertia": model.body_inertia,
    }
    return {
        "model": int(model._address),
        "data": int(data._address),
        **{name: int(array.ctypes.data) for name, array in arrays.items()},
    }
