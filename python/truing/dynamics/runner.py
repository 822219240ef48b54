# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A model as MuJoCo runs it: forward from many states at once (`mujoco.rollout`, on all cores), and backward
from a motion to the torques that it takes.

Torques of the drives enter as forces at the joints, in place of the model's own drives.
"""

from __future__ import annotations

import copy
import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.chains import coupling_of, zeros_of
from truing.dynamics.export import Exported, coupling_matrix, import_mujoco
from truing.dynamics.export.parts import drive_torque
from truing.dynamics.motion import Track, table_at
from truing.errors import InputError
from truing.files import is_mjcf
from truing.files.mjcf_file import quiet

Floats = NDArray[np.float64]

_AT_ONCE = 256  # windows: bounds memory
_HELD_STEPS = 2  # for which callbacks' torques are held
_OUT = 1e3  # [rad | m]: a simulation that has left
_NEAR = 1.0  # [s] of a track on both sides of a window, for torques at other clocks
_AT_REST = 1e-9  # of a bristle that bends back in a row: it does not
_OFF_GROUP = 30  # of MuJoCo's groups of actuators: the one that is switched off


@dataclass(frozen=True)
class Runnable:
    """A compiled model, and how readings and torques of a robot enter it."""

    robot: _core.Robot
    """Its effects on the measurement are taken out of measured torques."""
    model: Any  # mujoco.MjModel
    links: tuple[str, ...]  # joints of the chain
    driven: tuple[str, ...]  # those with a reading
    ratios: Floats  # shape=(driven,): joint = ratio * reading
    coupling: Floats  # shape=(links, driven): motion of the joints for readings
    start: Floats  # shape=(links,) [rad | m]: the joints at readings of zero
    beside: Any = None  # the module of callbacks.py
    notes: tuple[str, ...] = ()
    """What of the model was left out, in words."""
    prismatic: tuple[bool, ...] = field(default=(), kw_only=True)
    T_body_tool: Floats = field(default_factory=lambda: np.eye(4), kw_only=True)
    """The tool's frame in the body that the last joint of the chain moves: there a payload hangs."""


def runnable(exported: Exported, callbacks: bool = True) -> Runnable:
    """What `export(to="mjcf")` wrote, loaded again. callbacks: with callbacks.py, if there is one."""
    beside = _module(exported.callbacks) if callbacks and exported.callbacks is not None else None
    file = exported.model if beside is None else exported.callbacks_model or exported.model
    model = _without_bounds(import_mujoco().MjModel.from_xml_path(str(file)))
    chain = exported.chain
    if beside is not None:
        beside.prepare(model)
    return Runnable(
        exported.alone if beside is None else exported.robot,
        model,
        tuple(link.name for link in chain.links),
        tuple(link.name for link in chain.driven),
        np.array([link.ratio for link in chain.driven]),
        coupling_matrix(chain),
        np.zeros(len(chain.links)),
        beside,
        prismatic=tuple(link.prismatic for link in chain.driven),
        T_body_tool=chain.links[-1].after @ _tool(exported.robot),
    )


def runnable_mjcf(path: Path, robot: _core.Robot) -> Runnable:
    """An MJCF as it is, step, solver and passive elements included. robot: of the same file (`load_robot`).

    Actuators that drive the chain's joints are switched off: the recorded torques stand in their place.
    Contacts and limits do not act.
    """
    mujoco = import_mujoco()
    with quiet(mujoco):
        model = _without_bounds(mujoco.MjModel.from_xml_path(str(path)))
    off = _drives_off(mujoco, model, [joint.name for joint in robot.joints])
    notes = (f"recorded torques stand in the place of its drives {', '.join(off)}",) if off else ()
    return mjcf_as_it_is(model, robot, notes)


def mjcf_as_it_is(model: Any, robot: _core.Robot, notes: tuple[str, ...]) -> Runnable:
    """How readings enter a compiled MJCF. robot: of the same file."""
    driven = [joint.name for joint in robot.joints if not joint.passive]
    coupling = coupling_of([(joint.name, joint.driven_by) for joint in robot.joints])
    # The robot counts motion from `ref`.
    refs = [float(model.qpos0[model.joint(joint.name).qposadr[0]]) for joint in robot.joints]
    anchor = np.eye(4)  # the reader has the frame of a link at its joint's anchor, with the axes of its body
    anchor[:3, 3] = model.jnt_pos[model.joint(robot.joints[-1].name).id]
    return Runnable(
        robot,
        model,
        tuple(joint.name for joint in robot.joints),
        tuple(driven),
        np.ones(len(driven)),
        coupling[:, robot.driven_joints()],
        zeros_of(robot) + refs,
        notes=notes,
        prismatic=tuple(joint.type == "prismatic" for joint in robot.joints if not joint.passive),
        T_body_tool=anchor @ _tool(robot),
    )


def _tool(robot: _core.Robot) -> Floats:
    """T_last_tool, as cpp/src/dynamics/payload.cpp has it: the first target, or the last link's frame."""
    return np.array(robot.targets[0].T_last_target) if robot.targets else np.eye(4)


def simulator_of(path: Path, robot: _core.Robot) -> _core.Robot | Runnable:
    """What simulates the robot of a file: an MJCF as it is; of others the robot, which is exported."""
    return runnable_mjcf(path, robot) if is_mjcf(path) else robot


def _without_bounds(model: Any) -> Any:
    """Measured torques are not clamped, and ranges may be narrower than the motion was. What has left does
    not begin anew."""
    off = import_mujoco().mjtDisableBit
    for bit in (off.mjDSBL_CONTACT, off.mjDSBL_CLAMPCTRL, off.mjDSBL_LIMIT, off.mjDSBL_AUTORESET):
        model.opt.disableflags |= int(bit)
    return model


def _drives_off(mujoco: Any, model: Any, joints: Sequence[str]) -> list[str]:
    """Switches actuators of these joints off that take an input, and names those that do more than pass it
    on. Passive ones (friction, cogging) take none, and stay."""
    numbers = {int(model.joint(name).id) for name in joints}
    at_joints = {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}
    named = []
    for i in range(model.actuator_ctrlnum.size):
        here = int(model.actuator_trntype[i]) in at_joints and int(model.actuator_trnid[i, 0]) in numbers
        if not here or model.actuator_ctrlnum[i] == 0:
            continue
        model.actuator_group[i] = _OFF_GROUP
        if int(model.actuator_biastype[i]) != int(mujoco.mjtBias.mjBIAS_NONE):
            named.append(model.actuator(i).name or str(i))
    model.opt.disableactuator |= 1 << _OFF_GROUP
    return named


def _module(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location("truing_callbacks", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _with_point_mass(mujoco: Any, model: Any, joint: str, mass: float, place: Floats) -> Any:
    """A copy of a model with a point mass [kg] at `place`, shape=(3,) [m], of the body that a joint moves."""
    loaded = copy.copy(model)
    body = int(loaded.jnt_bodyid[loaded.joint(joint).id])
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, loaded.body_iquat[body])
    axes = turn.reshape(3, 3)
    before, center = float(loaded.body_mass[body]), loaded.body_ipos[body].copy()
    inertia = axes @ np.diag(loaded.body_inertia[body]) @ axes.T
    # Two masses about their common centre: that of the reduced mass at their distance (Steiner).
    apart = place - center
    reduced = before * mass / (before + mass)
    inertia += reduced * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    values, vectors = np.linalg.eigh(inertia)
    vectors[:, 0] *= np.linalg.det(vectors)
    loaded.body_mass[body] = before + mass
    loaded.body_ipos[body] = center + mass / (before + mass) * apart
    loaded.body_inertia[body] = values
    mujoco.mju_mat2Quat(loaded.body_iquat[body], vectors.ravel())
    # What MuJoCo leaves out for bodies whose inertia stands in their own frame.
    loaded.body_sameframe[body] = loaded.body_simple[body] = 0
    mujoco.mj_setConst(loaded, mujoco.MjData(loaded))
    return loaded


class Runner:
    """One model, run from measured states or along a measured motion."""

    def __init__(self, of: Runnable, tracks: Sequence[Track]) -> None:
        self.mujoco = import_mujoco()
        self.of, self.model, self.tracks = of, of.model, tracks
        self.links = np.array([self.model.joint(name).qposadr[0] for name in of.links])
        self.link_dofs = np.array([self.model.joint(name).dofadr[0] for name in of.links])
        self.qpos = np.array([self.model.joint(name).qposadr[0] for name in of.driven])
        self.dofs = np.array([self.model.joint(name).dofadr[0] for name in of.driven])
        rows = [of.links.index(name) for name in of.driven]
        self.zero = of.start[rows]
        self.spec = int(self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        first = 1 + self.model.nq  # of the speeds in such a state, after time and positions
        self.speeds = slice(first, first + self.model.nv)
        self.bristles = [self._bristles(track) for track in tracks]
        self._loaded: dict[tuple[float, ...], Any] = {}

    # ---- what hangs at the tool

    def _with_payload(self, payload: Floats) -> Any:
        """The model with a point mass at the tool. payload: shape=(4,) [kg, m], as in `Track`"""
        mass = float(payload[0])
        if mass == 0.0:
            return self.model
        key = tuple(payload.tolist())
        if key not in self._loaded:
            place = (self.of.T_body_tool @ [*payload[1:], 1.0])[:3]
            self._loaded[key] = _with_point_mass(self.mujoco, self.model, self.of.links[-1], mass, place)
        self._loaded[key].opt.timestep = self.model.opt.timestep
        return self._loaded[key]

    def _models(self, starts: Floats, track: NDArray[np.intp]) -> list[Any]:
        """Of every window, with the payload that it begins with."""
        return [
            self._with_payload(self.tracks[t].payload_at(start))
            for start, t in zip(starts, track, strict=True)
        ]

    # ---- where windows begin

    def states(self, starts: Floats, track: NDArray[np.intp]) -> Floats:
        """shape=(n, states): measured positions and speeds at times of tracks, bristles as the motion before
        has bent them."""
        data = self.mujoco.MjData(self.model)
        out = np.empty((starts.size, self.mujoco.mj_stateSize(self.model, self.spec)))
        for k, (start, t) in enumerate(zip(starts, track, strict=True)):
            near = self.tracks[t].near(start, start)
            now = np.array([start])
            self.mujoco.mj_resetData(self.model, data)
            q, qd = (table_at(near.time, table, now)[0] for table in (near.q, near.qd))
            data.qpos[self.links] = self.of.start + self.of.coupling @ q
            data.qvel[self.link_dofs] = self.of.coupling @ qd
            if self.model.na:
                data.act[:] = table_at(self.tracks[t].time, self.bristles[t], now)[0]
            self._prepare(data, float(start), int(t))
            self.mujoco.mj_getState(self.model, data, out[k], self.spec)
        return out

    def _prepare(self, data: Any, start: float, t: int) -> None:
        """What else a state has where a window begins at `start` [s] of track t; here nothing."""

    def _bristles(self, track: Track) -> Floats:
        """Deflection of every LuGre bristle along a recording. shape=(n, activations) [rad | m]

        dz/dt = v - s0 |v| / g(v) z, solved exactly over a row of constant v (Canudas de Wit et al. 1995,
        eq. 2).
        """
        m = self.model
        kind = int(self.mujoco.mjtDyn.mjDYN_DCMOTOR)
        out = np.zeros((track.time.size, m.na))
        step = track.step
        row = {int(m.joint(name).id): k for k, name in enumerate(self.of.links)}
        bent = (m.actuator_dyntype == kind) & (m.actuator_actnum > 0) & (m.actuator_dynprm[:, 5] > 0.0)
        for i in np.flatnonzero(bent):
            if int(m.actuator_trnid[i, 0]) not in row:
                continue
            level, still, speed = m.actuator_biasprm[i, 3:6]
            v = m.actuator_gear[i, 0] * (track.qd @ self.of.coupling[row[int(m.actuator_trnid[i, 0])]])
            g = level + (still - level) * np.exp(-((v / speed) ** 2))
            rate = m.actuator_dynprm[i, 5] * np.abs(v) / g
            fade = np.exp(-rate * step)
            push = np.where(rate * step > _AT_REST, (1.0 - fade) / np.maximum(rate, 1e-12), step) * v
            z = 0.0
            for k in range(1, track.time.size):
                z = fade[k - 1] * z + push[k - 1]
                out[k, m.actuator_actadr[i]] = z
        return out

    def _warmth(self, starts: Floats, track: NDArray[np.intp]) -> tuple[Floats, Floats]:
        """Temperatures of the joints [deg C; NaN: not known] and time since the recording began [s].
        shape=(windows, joints), (windows, 1)"""
        warm = []
        for start, t in zip(starts, track, strict=True):
            near = self.tracks[t].near(start, start)
            warm.append(table_at(near.torque_time, near.temperature, np.array([start]))[0])
        begun = np.array([self.tracks[t].began for t in track])
        return np.array(warm), (starts - begun)[:, None]

    def _torques(self, starts: Floats, track: NDArray[np.intp], at: Floats) -> Floats:
        """Torques of the drives of each window, shape=(windows, times, joints) [Nm | N]."""
        out = np.empty((starts.size, at.size, self.qpos.size))
        for k, (start, t) in enumerate(zip(starts, track, strict=True)):
            near = self.tracks[t].near(start - _NEAR, start + at[-1] + _NEAR)
            out[k] = drive_torque(self.of.robot, near.torque_time, near.torque, start + at)
        return out

    # ---- forward

    def run(
        self, starts: Floats, track: NDArray[np.intp], times: Floats, step: float | None = None
    ) -> Floats:
        """Readings at `times` [s] after `starts` of tracks. shape=(n, times, joints) [rad | m]

        step: [s] other than the model's own.
        """
        usual = float(self.model.opt.timestep)
        self.model.opt.timestep = usual if step is None else step
        try:
            with quiet(self.mujoco):
                parts = [
                    self._run(starts[k : k + _AT_ONCE], track[k : k + _AT_ONCE], times)
                    for k in range(0, starts.size, _AT_ONCE)
                ]
        finally:
            self.model.opt.timestep = usual
        return np.concatenate(parts)

    def _run(self, starts: Floats, track: NDArray[np.intp], times: Floats) -> Floats:
        h = float(self.model.opt.timestep)
        # A step need not divide the times: between two steps the path is a straight line.
        number = np.maximum(np.ceil(times / h - 1e-6).astype(int), 1)
        states, path = self._paths(starts, track, int(number[-1]))
        stopped = path[:, :, 0] < h * (np.arange(number[-1]) + 0.5)  # where MuJoCo gave up
        path[stopped] = np.nan
        whole = np.concatenate([states[:, None], path], axis=1)[:, :, 1 + self.qpos]
        part = (times / h - (number - 1))[:, None]
        found = (1.0 - part) * whole[:, number - 1] + part * whole[:, number]
        found = (found - self.zero) / self.of.ratios
        return np.asarray(
            np.where(np.abs(found) < _OUT, found, np.nan_to_num(np.sign(found), nan=1.0) * _OUT)
        )

    def _paths(self, starts: Floats, track: NDArray[np.intp], steps: int) -> tuple[Floats, Floats]:
        """States at the starts, and after each of so many steps. shape=(n, states), (n, steps, states)"""
        h = float(self.model.opt.timestep)
        torque = self._torques(starts, track, h * (np.arange(steps, dtype=np.float64) + 0.5))
        states, models = self.states(starts, track), self._models(starts, track)
        applied = np.zeros((starts.size, steps, self.model.nv))
        applied[:, :, self.dofs] = torque / self.of.ratios
        if self.of.beside is None:
            spec = self.mujoco.mjtState.mjSTATE_QFRC_APPLIED
            return states, self._rollout(models, states, applied, spec)
        warmth, qacc = self._warmth(starts, track), self._accelerations(starts, track)
        return states, self._with_callbacks(self.of.beside, models, states, applied, torque, *warmth, qacc)

    def _rollout(self, models: list[Any], states: Floats, inputs: Floats, spec: Any) -> Floats:
        """models: of each window. spec: which part of MuJoCo's state the inputs are.
        shape=(n, steps, states)"""
        from mujoco import rollout

        datas = [self.mujoco.MjData(self.model) for _ in range(os.cpu_count() or 1)]
        path, _ = rollout.rollout(models, datas, states, inputs, control_spec=int(spec))
        return np.asarray(path)

    def _with_callbacks(
        self,
        beside: Any,
        models: list[Any],
        states: Floats,
        applied: Floats,
        torque: Floats,
        warm: Floats,
        begun: Floats,
        qacc: Floats,
    ) -> Floats:
        """Few steps at a time: each window has a model of its own, whose dry friction changes with its
        state. On one thread: to wake others for two steps takes longer than the steps on a busy machine."""
        from mujoco import rollout

        warm = np.where(np.isnan(warm), beside.REFERENCE_C, warm)
        m, n, ratios = self.model, states.shape[0], self.of.ratios
        models = [copy.copy(model) for model in models]
        losses = [model.dof_frictionloss for model in models]
        data = [self.mujoco.MjData(m)]
        spec = int(self.mujoco.mjtState.mjSTATE_QFRC_APPLIED)
        path = np.empty((n, applied.shape[1], states.shape[1]))
        state = states
        with rollout.Rollout(nthread=0) as pool:
            for k in range(0, applied.shape[1], _HELD_STEPS):
                end = min(k + _HELD_STEPS, applied.shape[1])
                q = (state[:, 1 + self.qpos] - self.zero) / ratios
                qd = state[:, 1 + m.nq + self.dofs] / ratios
                now = (q, qd, torque[:, k], warm, begun + k * m.opt.timestep)
                links = self._link_torques(models, state[:, 1:], qacc) if beside.of_links() else None
                friction = beside.dry_friction(*now, links=links) / np.abs(ratios)
                for loss, row in zip(losses, friction, strict=True):
                    loss[self.dofs] = row
                smooth = beside.smooth_torques(*now) / ratios
                applied[:, k:end, self.dofs] += smooth[:, None]
                part, _ = pool.rollout(models, data, state, applied[:, k:end], control_spec=spec)
                path[:, k:end] = part
                qacc = (part[:, -1] - state)[:, self.speeds] / ((end - k) * m.opt.timestep)
                state = np.ascontiguousarray(part[:, -1])
        return path

    def _accelerations(self, starts: Floats, track: NDArray[np.intp]) -> Floats:
        """As measured at times of tracks. shape=(n, nv) [rad/s^2 | m/s^2]"""
        out = np.zeros((starts.size, self.model.nv))
        for k, (start, t) in enumerate(zip(starts, track, strict=True)):
            near = self.tracks[t].near(start, start)
            out[k, self.link_dofs] = self.of.coupling @ table_at(near.time, near.qdd, np.array([start]))[0]
        return out

    def _link_torques(self, models: Sequence[Any], motion: Floats, qacc: Floats) -> Floats:
        """What the links take of each drive. motion: positions and speeds, shape=(n, nq + nv)
        shape=(n, joints) [Nm | N]"""
        data, nq = self.mujoco.MjData(self.model), self.model.nq
        out = np.empty((len(models), self.qpos.size))
        for k, model in enumerate(models):
            data.qpos[:], data.qvel[:] = motion[k, :nq], motion[k, nq : nq + self.model.nv]
            data.qacc[:] = qacc[k]
            self.mujoco.mj_kinematics(model, data)
            self.mujoco.mj_comPos(model, data)
            self.mujoco.mj_comVel(model, data)
            out[k] = self.of.beside.link_torques(model, data, self.link_dofs)
        return out

    # ---- backward

    def torques(self, t: int, rows: NDArray[np.intp]) -> Floats:
        """What the drives must give for rows of a track's motion, at the readings (mj_inverse).
        shape=(rows, joints) [Nm | N]"""
        track, of = self.tracks[t], self.of
        data = self.mujoco.MjData(self.model)
        q, qd, qdd = (table[rows] for table in (track.q, track.qd, track.qdd))
        smooth, friction = np.zeros_like(q), None
        if of.beside is not None:
            drive = drive_torque(of.robot, track.torque_time, track.torque, track.time[rows])
            warm = table_at(track.torque_time, track.temperature, track.time[rows])
            warm = np.where(np.isnan(warm), of.beside.REFERENCE_C, warm)
            now = (q, qd, drive, warm, (track.time[rows] - track.began)[:, None])
            links = self._link_torques_along(track, rows) if of.beside.of_links() else None
            friction = of.beside.dry_friction(*now, links=links) / np.abs(of.ratios)
            smooth = of.beside.smooth_torques(*now)
        out = np.empty_like(q)
        copies: dict[int, Any] = {}  # that friction is written into
        for k, row in enumerate(rows):
            loaded = self._with_payload(track.payload_at(track.time[row]))
            if id(loaded) not in copies:
                copies[id(loaded)] = copy.copy(loaded)
            model = copies[id(loaded)]
            data.qpos[self.links] = of.start + of.coupling @ q[k]
            data.qvel[self.link_dofs] = of.coupling @ qd[k]
            data.qacc[self.link_dofs] = of.coupling @ qdd[k]
            if model.na:
                data.act[:] = self.bristles[t][row]
            if friction is not None:
                model.dof_frictionloss[self.dofs] = friction[k]
            self.mujoco.mj_inverse(model, data)
            self.mujoco.mj_fwdActuation(model, data)
            left = data.qfrc_inverse - data.qfrc_actuator  # the passive ones give their part
            out[k] = of.coupling.T @ left[self.link_dofs] - smooth[k]
        return out

    def _link_torques_along(self, track: Track, rows: NDArray[np.intp]) -> Floats:
        """What the links take of each drive in rows of a track. shape=(rows, joints) [Nm | N]"""
        m, coupling = self.model, self.of.coupling.T
        motion = np.tile(np.concatenate([m.qpos0, np.zeros(m.nv)]), (rows.size, 1))
        motion[:, self.links] = self.of.start + track.q[rows] @ coupling
        motion[:, m.nq + self.link_dofs] = track.qd[rows] @ coupling
        qacc = np.zeros((rows.size, m.nv))
        qacc[:, self.link_dofs] = track.qdd[rows] @ coupling
        models = [self._with_payload(track.payload_at(time)) for time in track.time[rows]]
        return self._link_torques(models, motion, qacc)
