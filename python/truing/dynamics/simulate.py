# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Models judged by motion: started at measured states and driven by the measured torques, where is the
robot then?

Windows begin every half second in recordings that no fit has seen. Each model is the file that `export`
wrote, loaded again, and all windows run at once (`mujoco.rollout`, on all cores).
"""

from __future__ import annotations

import copy
import importlib.util
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export import Exported, coupling_matrix, export, import_mujoco
from truing.dynamics.export.parts import drive_torque
from truing.dynamics.motion import SMOOTHING, Recorded, Track, table_at, track_of
from truing.errors import InputError

Floats = NDArray[np.float64]

_SAMPLE = 0.02  # [s] between the samples of simulated paths
_AT_ONCE = 256  # windows: bounds memory
_CHECKED = 16  # windows on which the integration step is halved
_CHECKED_AHEAD = 0.5  # [s]
_HELD_STEPS = 2  # for which callbacks' torques are held
_OUT = 1e3  # [rad | m]: a simulation that has left


@dataclass(frozen=True)
class Windows:
    """Stretches of recordings: where they begin, and where the robot went."""

    joints: tuple[str, ...]
    recordings: tuple[str, ...]  # of each window
    starts: Floats  # shape=(n,) [s]
    times: Floats  # shape=(m,) [s] from the start of a window
    measured: Floats  # shape=(n, m, joints) [rad | m]
    horizons: tuple[float, ...]  # [s], each among `times`
    tracks: tuple[Track, ...] = field(repr=False)
    track: NDArray[np.intp] = field(repr=False)  # shape=(n,)


@dataclass(frozen=True)
class Judgement:
    """How far models are off, ahead of measured states."""

    windows: Windows
    simulated: dict[str, Floats]  # by model, shape=(n, times, joints) [rad | m]
    step_error: dict[str, float]
    """[rad | m] by model, how far half the integration step moves the worst joint half a second ahead,
    median."""

    def errors(self, model: str, horizon: float) -> Floats:
        """shape=(n, joints) [rad | m]: simulated less measured, `horizon` seconds ahead. Raises InputError
        for a model or horizon that was not judged."""
        if model not in self.simulated or horizon not in self.windows.horizons:
            raise InputError(
                f"{model!r} at {horizon} s was not judged: models {', '.join(self.simulated)}, horizons"
                f" {', '.join(map(str, self.windows.horizons))} s"
            )
        k = int(np.argmin(np.abs(self.windows.times - horizon)))
        return self.simulated[model][:, k] - self.windows.measured[:, k]

    def rms(self, model: str, horizon: float) -> Floats:
        """shape=(joints,) [rad | m]"""
        return np.asarray(np.sqrt(np.mean(self.errors(model, horizon) ** 2, axis=0)))

    def worst_joint(self, model: str, horizon: float) -> float:
        """[rad | m] median over the windows of the largest error of a joint."""
        return float(np.median(np.abs(self.errors(model, horizon)).max(axis=1)))

    def rows(self) -> list[dict[str, Any]]:
        """One row per model and horizon, for tables and result.json."""
        return [
            {
                "model": model,
                "horizon_s": horizon,
                "worst_joint_median": self.worst_joint(model, horizon),
                "rms": dict(zip(self.windows.joints, self.rms(model, horizon).tolist(), strict=True)),
            }
            for model in self.simulated
            for horizon in self.windows.horizons
        ]


def windows_of(
    recordings: Sequence[Recorded],
    robot: _core.Robot,
    horizons: Sequence[float] = (0.1, 0.5, 2.0),
    every: float = 0.5,
    smoothing: float = SMOOTHING,
) -> Windows:
    """Stretches as long as the longest horizon, one beginning `every` seconds, without gaps.

    smoothing: [s] half of the stretch whose cubic gives start and end positions (Savitzky and Golay 1964),
    and speeds where none were recorded. Torques, or else currents times torque_per_ampere, are taken as
    they are. Raises InputError: no torques, joints that were not recorded, nothing as long as the longest
    horizon.
    """
    names = tuple(joint.name for joint in robot.joints if not joint.passive)
    if not horizons or min(horizons) <= 0.0 or every <= 0.0 or smoothing <= 0.0:
        raise InputError("horizons, every and smoothing are seconds, expected to be larger than zero")
    longest = max(horizons)
    times = np.unique(np.round([*np.arange(_SAMPLE, longest + 1e-9, _SAMPLE), *horizons], 9))
    tracks, track, starts, measured = [], [], [], []
    for recording in recordings:
        made, free = track_of(recording, robot, smoothing)
        tracks.append(made)
        begin = made.time[0] + smoothing
        for start in np.arange(begin, made.time[-1] - smoothing - longest + 1e-9, every):
            if np.all(free[(made.time >= start) & (made.time <= start + longest)]):
                track.append(len(tracks) - 1)
                starts.append(start)
                measured.append(table_at(made.time, made.q, start + times))
    if not starts:
        raise InputError(
            f"no recording has {longest + 2 * smoothing:g} s without a gap, the longest horizon: give longer"
            " recordings, or shorter horizons"
        )
    return Windows(
        names,
        tuple(recordings[k].name for k in track),
        np.array(starts),
        times,
        np.array(measured),
        tuple(float(h) for h in horizons),
        tuple(tracks),
        np.array(track, dtype=np.intp),
    )


def judge(
    models: Mapping[str, _core.Robot | Exported],
    recordings: Sequence[Recorded],
    horizons: Sequence[float] = (0.1, 0.5, 2.0),
    every: float = 0.5,
    smoothing: float = SMOOTHING,
    callbacks: bool = True,
) -> Judgement:
    """Simulates every model over the same windows of recordings.

    models: robots, exported to a temporary folder, or what `export(to="mjcf")` gave. callbacks: run
    callbacks.py where a model has one. Horizons, every, smoothing: as in windows_of, whose errors are
    raised.
    """
    if not models:
        raise InputError("no model to judge")
    import_mujoco()
    simulated, step_error = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        exported = {
            name: export(model, "mjcf", Path(folder) / str(k)) if isinstance(model, _core.Robot) else model
            for k, (name, model) in enumerate(models.items())
        }
        first = next(iter(exported.values()))
        windows = windows_of(recordings, first.robot, horizons, every, smoothing)
        for name, model in exported.items():
            runner = _Runner(model, windows, callbacks)
            every_one = np.arange(windows.starts.size)
            simulated[name] = runner.run(every_one, windows.times)
            some = every_one[:: max(every_one.size // _CHECKED, 1)][:_CHECKED]
            step_error[name] = runner.step_error(some)
    return Judgement(windows, simulated, step_error)


class _Runner:
    """One model, loaded from its file."""

    def __init__(self, exported: Exported, windows: Windows, callbacks: bool) -> None:
        self.mujoco = import_mujoco()
        self.model = self.mujoco.MjModel.from_xml_path(str(exported.model))
        # Measured torques are not clamped, and ranges may be narrower than the motion was.
        off = self.mujoco.mjtDisableBit
        for bit in (off.mjDSBL_CONTACT, off.mjDSBL_CLAMPCTRL, off.mjDSBL_LIMIT):
            self.model.opt.disableflags |= int(bit)
        self.windows = windows
        self.robot = exported.robot
        names = [link.name for link in exported.chain.driven]
        if tuple(names) != windows.joints:
            raise InputError(
                f"a model has the joints {', '.join(names)}, the first one {', '.join(windows.joints)}"
            )
        self.ratios = np.array([link.ratio for link in exported.chain.driven])
        links = [link.name for link in exported.chain.links]
        self.coupling = coupling_matrix(exported.chain)
        self.links = np.array([self.model.joint(name).qposadr[0] for name in links])
        self.qpos = np.array([self.model.joint(name).qposadr[0] for name in names])
        self.dofs = np.array([self.model.joint(name).dofadr[0] for name in names])
        self.motors = np.array([self.model.actuator(f"drive_{name}").id for name in names])
        self.beside = _module(exported.callbacks) if callbacks and exported.callbacks is not None else None
        if self.beside is not None:
            self.beside.prepare(self.model)
        self.spec = int(self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        self.states = self._initial_states()

    # ---- where windows begin

    def _initial_states(self) -> Floats:
        """shape=(n, states): measured positions and speeds, bristles as the motion before has bent them."""
        data = self.mujoco.MjData(self.model)
        out = np.empty((self.windows.starts.size, self.mujoco.mj_stateSize(self.model, self.spec)))
        bristles = [self._bristles(track) for track in self.windows.tracks]
        for k, (start, t) in enumerate(zip(self.windows.starts, self.windows.track, strict=True)):
            track = self.windows.tracks[t]
            now = np.array([start])
            self.mujoco.mj_resetData(self.model, data)
            data.qpos[self.links] = self.coupling @ table_at(track.time, track.q, now)[0]
            data.qvel[self.links] = self.coupling @ table_at(track.time, track.qd, now)[0]
            if self.model.na:
                data.act[:] = table_at(track.time, bristles[t], now)[0]
            self.mujoco.mj_getState(self.model, data, out[k], self.spec)
        return out

    def _bristles(self, track: Track) -> Floats:
        """Deflection of every LuGre bristle along a recording. shape=(n, activations) [rad | m]

        dz/dt = v - s0 |v| / g(v) z, solved exactly over a row of constant v (Canudas de Wit et al. 1995,
        eq. 2).
        """
        m = self.model
        kind = int(self.mujoco.mjtDyn.mjDYN_DCMOTOR)
        out = np.zeros((track.time.size, m.na))
        step = float(track.time[1] - track.time[0])
        for i in np.flatnonzero((m.actuator_dyntype == kind) & (m.actuator_actnum > 0)):
            column = int(np.flatnonzero(self.dofs == m.jnt_dofadr[m.actuator_trnid[i, 0]])[0])
            level, still, speed = m.actuator_biasprm[i, 3:6]
            v = track.qd[:, column]
            g = level + (still - level) * np.exp(-((v / speed) ** 2))
            rate = m.actuator_dynprm[i, 5] * np.abs(v) / g
            fade = np.exp(-rate * step)
            push = np.where(rate * step > 1e-9, (1.0 - fade) / np.maximum(rate, 1e-12), step) * v
            z = 0.0
            for k in range(1, track.time.size):
                z = fade[k - 1] * z + push[k - 1]
                out[k, m.actuator_actadr[i]] = z
        return out

    def _warmth(self, chosen: NDArray[np.intp]) -> tuple[Floats, Floats]:
        """Temperatures of the joints [deg C; NaN: not known] and time since the recording began [s] of each
        window, where it begins. shape=(windows, joints), (windows, 1)"""
        starts, tracks = (
            self.windows.starts[chosen],
            [self.windows.tracks[t] for t in self.windows.track[chosen]],
        )
        warm = [
            table_at(track.torque_time, track.temperature, np.array([start]))[0]
            for start, track in zip(starts, tracks, strict=True)
        ]
        return np.array(warm), (starts - [track.time[0] for track in tracks])[:, None]

    def _torques(self, chosen: NDArray[np.intp], at: Floats) -> Floats:
        """Torques of the drives of each window, shape=(windows, times, joints) [Nm | N]."""
        out = np.empty((chosen.size, at.size, self.qpos.size))
        for k, (start, t) in enumerate(
            zip(self.windows.starts[chosen], self.windows.track[chosen], strict=True)
        ):
            track = self.windows.tracks[t]
            out[k] = drive_torque(self.robot, track.torque_time, track.torque, start + at)
        return out

    # ---- forward

    def run(self, chosen: NDArray[np.intp], times: Floats, step: float | None = None) -> Floats:
        """Positions at `times` [s] from the starts of the chosen windows. shape=(n, times, joints) [rad |
        m]"""
        usual = float(self.model.opt.timestep)
        self.model.opt.timestep = usual if step is None else step
        try:
            parts = [self._run(chosen[k : k + _AT_ONCE], times) for k in range(0, chosen.size, _AT_ONCE)]
        finally:
            self.model.opt.timestep = usual
        return np.concatenate(parts)

    def _run(self, chosen: NDArray[np.intp], times: Floats) -> Floats:
        h = float(self.model.opt.timestep)
        steps = np.maximum(np.round(times / h).astype(int), 1)
        torque = self._torques(chosen, h * (np.arange(steps[-1]) + 0.5))
        control = np.zeros((chosen.size, steps[-1], self.model.nu))
        control[:, :, self.motors] = torque
        if self.beside is None:
            path = self._rollout([self.model], self.states[chosen], control)
        else:
            path = self._with_callbacks(self.beside, chosen, control, torque)
        found = path[:, steps - 1][:, :, 1 + self.qpos] / self.ratios
        return np.asarray(
            np.where(np.abs(found) < _OUT, found, np.nan_to_num(np.sign(found), nan=1.0) * _OUT)
        )

    def _rollout(self, models: list[Any], states: Floats, control: Floats) -> Floats:
        from mujoco import rollout

        datas = [self.mujoco.MjData(self.model) for _ in range(os.cpu_count() or 1)]
        path, _ = rollout.rollout(models if len(models) > 1 else models[0], datas, states, control)
        return np.asarray(path)

    def _with_callbacks(
        self, beside: Any, chosen: NDArray[np.intp], control: Floats, torque: Floats
    ) -> Floats:
        """Few steps at a time: each window has a model of its own, whose dry friction changes with its
        state."""
        from mujoco import rollout

        states = self.states[chosen]
        warm, begun = self._warmth(chosen)
        warm = np.where(np.isnan(warm), beside.REFERENCE_C, warm)
        m, n = self.model, states.shape[0]
        models = [copy.copy(m) for _ in range(n)]
        losses = [model.dof_frictionloss for model in models]
        datas = [self.mujoco.MjData(m) for _ in range(os.cpu_count() or 1)]
        applied = self.mujoco.mjtState.mjSTATE_CTRL, self.mujoco.mjtState.mjSTATE_QFRC_APPLIED
        both = np.concatenate([control, np.zeros((n, control.shape[1], m.nv))], axis=2)
        path = np.empty((n, control.shape[1], states.shape[1]))
        state = states
        with rollout.Rollout(nthread=len(datas)) as pool:
            for k in range(0, control.shape[1], _HELD_STEPS):
                end = min(k + _HELD_STEPS, control.shape[1])
                q = state[:, 1 + self.qpos] / self.ratios
                qd = state[:, 1 + m.nq + self.dofs] / self.ratios
                now = (q, qd, torque[:, k], warm, begun + k * m.opt.timestep)
                friction = beside.dry_friction(*now) / np.abs(self.ratios)
                for loss, row in zip(losses, friction, strict=True):
                    loss[self.dofs] = row
                smooth = beside.smooth_torques(*now) / self.ratios
                both[:, k:end, self.model.nu + self.dofs] = smooth[:, None]
                part, _ = pool.rollout(
                    models, datas, state, both[:, k:end], control_spec=int(applied[0]) | int(applied[1])
                )
                path[:, k:end] = part
                state = np.ascontiguousarray(part[:, -1])
        return path

    def step_error(self, chosen: NDArray[np.intp]) -> float:
        """[rad | m] by which half the step moves the worst joint, median over some windows."""
        ahead = np.array([min(_CHECKED_AHEAD, max(self.windows.horizons))])
        whole = self.run(chosen, ahead)
        half = self.run(chosen, ahead, 0.5 * float(self.model.opt.timestep))
        return float(np.median(np.abs(whole - half).max(axis=(1, 2))))


def _module(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location("truing_callbacks", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
