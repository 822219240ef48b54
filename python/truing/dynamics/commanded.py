# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An MJCF driven by what its robot was commanded: begun at measured states, its own actuators do the rest.

A command holds until the next row, as a servo's register does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export import import_mujoco
from truing.dynamics.motion import Track, even_track
from truing.dynamics.recorded import OFF
from truing.dynamics.runner import Runnable, Runner, mjcf_as_it_is
from truing.errors import InputError
from truing.files import is_mjcf
from truing.files.mjcf_file import quiet

Floats = NDArray[np.float64]
CommandKind = Literal["position", "torque"]


@dataclass(frozen=True)
class CommandedTrack(Track):
    """One recording on an even grid; its torques are empty, and its commands as recorded."""

    command: Floats = field(kw_only=True)
    """shape=(n, joints) [rad | m, or Nm | N], rows at `torque_time`."""
    kind: CommandKind = field(kw_only=True)

    def held(self, at: Floats) -> Floats:
        """The command of the last row before or at each of these times [s]. shape=(at, joints)"""
        rows = np.searchsorted(self.torque_time, at + 1e-9, "right") - 1
        return np.asarray(self.command[np.maximum(rows, 0)])


def command_kind(recordings: Sequence[_core.Recording]) -> CommandKind | None:
    """What recordings without torques and currents were commanded. None: all have torques or currents.

    Raises InputError: some have and some have not, neither torques nor commands, commands of two kinds.
    """
    found = {recording.name: _kind(recording) for recording in recordings}
    kinds = sorted(set(found.values()))
    if len(kinds) > 1:
        one, two = (next(name for name, kind in found.items() if kind == which) for which in kinds[:2])
        words = {"measured": "torques or currents", "position": "position commands and no torque"}
        words["torque"] = "torque commands alone"
        raise InputError(
            f"{one} has {words[kinds[0]]}, {two} has {words[kinds[1]]}: take recordings of one kind"
        )
    kind = kinds[0] if kinds else "measured"
    return None if kind == "measured" else kind


def _kind(recording: _core.Recording) -> Literal["measured", "position", "torque"]:
    if recording.torque.shape[1] or recording.current.shape[1]:
        return "measured"
    if recording.command.shape[1]:
        return "position"
    if recording.torque_command.shape[1]:
        return "torque"
    raise InputError(
        f"{recording.name}: there is neither a torque (tau1_Nm …), nor a current (i1_A …), nor a command"
        " (u1_rad …, or u1_Nm …)"
    )


def commanded_track(
    recording: _core.Recording, robot: _core.Robot, smoothing: float
) -> tuple[CommandedTrack, NDArray[np.bool_]]:
    """As `motion.track_of`, of a recording with commands; where its drives were off is not free."""
    position = np.asarray(recording.position, dtype=float)
    kind: CommandKind = "position" if recording.command.shape[1] else "torque"
    command = np.asarray(recording.command if kind == "position" else recording.torque_command, dtype=float)
    numbers = np.isfinite(command).all() and np.isfinite(position).all()
    if command.shape != position.shape or not numbers:
        raise InputError(
            f"{recording.name}: positions and commands are not numbers in all rows of all"
            f" {position.shape[1]} joints: a simulation of commands cannot be driven"
        )
    track, free = even_track(recording, np.empty((len(position), 0)), smoothing)
    enabled = recording.columns.get("enabled")
    if enabled is not None:
        rows = np.searchsorted(track.torque_time, track.time, "right") - 1
        free &= np.asarray(enabled, dtype=float)[rows] > OFF
    shared = {of.name: getattr(track, of.name) for of in fields(track)}
    return CommandedTrack(**shared, command=command, kind=kind), free


@dataclass(frozen=True)
class Commanded(Runnable):
    """An MJCF whose actuators are driven by commands."""

    actuators: tuple[int, ...] = field(kw_only=True)  # of each driven joint
    idle: Floats = field(kw_only=True)  # shape=(controls,): of those that no recorded joint has


def commanded_mjcf(path: Path, robot: _core.Robot, kind: CommandKind) -> Commanded:
    """An MJCF as it is, actuators included. robot: of the same file (`load_robot`). kind: of the commands.

    Contacts do not act, nor do limits of the chain's joints. Actuators of other joints hold them where the
    model begins. Raises InputError: not an MJCF, a joint without an actuator that takes such commands.
    """
    if not is_mjcf(path):
        raise InputError(
            f"{path}: recordings of commands need a model of the drives, expected an MJCF with an actuator at"
            " every joint (`truing dynamics export --to mjcf` writes one)"
        )
    mujoco = import_mujoco()
    with quiet(mujoco):
        model = mujoco.MjModel.from_xml_path(str(path))
    off = mujoco.mjtDisableBit
    for bit in (off.mjDSBL_CONTACT, off.mjDSBL_AUTORESET):
        model.opt.disableflags |= int(bit)
    of = mjcf_as_it_is(model, robot, ())
    for name in of.links:  # a recording's range may be wider than the file's
        model.jnt_limited[model.joint(name).id] = 0
    actuators = tuple(_actuator(mujoco, model, path, name, kind) for name in of.driven)
    shared = {part.name: getattr(of, part.name) for part in fields(of)}
    return Commanded(**shared, actuators=actuators, idle=_idle(mujoco, model))


def _actuator(mujoco: Any, model: Any, path: Path, joint: str, kind: CommandKind) -> int:
    number = int(model.joint(joint).id)
    there = [
        i
        for i in range(model.actuator_ctrlnum.size)
        if _at_joint(mujoco, model, i) == number and model.actuator_ctrlnum[i] > 0
    ]
    fitting = [i for i in there if takes_positions(mujoco, model, i) == (kind == "position")]
    if len(fitting) != 1:
        found = ", ".join(model.actuator(i).name or str(i) for i in there) or "none"
        wanted = "position servo (position, pid)" if kind == "position" else "motor"
        raise InputError(
            f"{path}: joint {joint} has the actuators {found}, expected one {wanted}, which the recorded"
            f" {kind} commands can drive"
        )
    return fitting[0]


def _at_joint(mujoco: Any, model: Any, actuator: int) -> int:
    """The joint that an actuator acts on; -1: none."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trnid[actuator, 0]) if int(model.actuator_trntype[actuator]) in kinds else -1


def takes_positions(mujoco: Any, model: Any, actuator: int) -> bool:
    """Whether the first input of an actuator is a position: by its signature, or `general` with a bias by
    position."""
    spec = int(model.actuator_ctrlspec[actuator])
    if spec:
        return bool(spec & int(mujoco.mjtCtrlInput.mjINPUT_POS))
    affine = int(model.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    return affine and bool(model.actuator_biasprm[actuator, 1])


def _idle(mujoco: Any, model: Any) -> Floats:
    """Controls that hold every joint where the model begins. shape=(controls,)"""
    out = np.zeros(model.nu)
    for i in range(model.actuator_ctrlnum.size):
        joint = _at_joint(mujoco, model, i)
        if joint >= 0 and model.actuator_ctrlnum[i] > 0 and takes_positions(mujoco, model, i):
            out[model.actuator_ctrladr[i]] = model.actuator_gear[i, 0] * model.qpos0[model.jnt_qposadr[joint]]
    return out


class CommandRunner(Runner):
    """One model, run from measured states by the commands that followed."""

    of: Commanded
    tracks: Sequence[CommandedTrack]

    def __init__(self, of: Commanded, tracks: Sequence[CommandedTrack]) -> None:
        model, chosen = of.model, list(of.actuators)
        mujoco = import_mujoco()
        self.controls = model.actuator_ctrladr[chosen]
        positions = np.array([takes_positions(mujoco, model, i) for i in chosen])
        gear = model.actuator_gear[chosen, 0]
        zero = of.start[[of.links.index(name) for name in of.driven]]
        # A position command is one of the actuator's length; a torque command is one of its force.
        self.scale = np.where(positions, gear * of.ratios, 1.0 / of.ratios / gear)
        self.shift = np.where(positions, gear * zero, 0.0)
        super().__init__(of, tracks)

    def _paths(self, starts: Floats, track: NDArray[np.intp], steps: int) -> tuple[Floats, Floats]:
        h = float(self.model.opt.timestep)
        control = np.tile(self.of.idle, (starts.size, steps, 1))
        for k, (start, t) in enumerate(zip(starts, track, strict=True)):
            held = self.tracks[t].held(start + h * np.arange(steps))
            control[k][:, self.controls] = self.scale * held + self.shift
        states, models = self.states(starts, track), self._models(starts, track)
        return states, self._rollout(models, states, control, self.mujoco.mjtState.mjSTATE_CTRL)

    def _prepare(self, data: Any, start: float, t: int) -> None:
        """Delayed commands are on their way at the start."""
        model, h = self.model, float(self.model.opt.timestep)
        for i in range(model.actuator_ctrlnum.size):
            samples = int(model.actuator_history[i, 0])
            if not samples:
                continue
            back = h * np.arange(-samples, 0.0)
            values = np.tile(self.of.idle, (samples, 1))
            values[:, self.controls] = self.scale * self.tracks[t].held(start + back) + self.shift
            at, count = int(model.actuator_ctrladr[i]), int(model.actuator_ctrlnum[i])
            rows = np.ascontiguousarray(values[:, at : at + count])
            self.mujoco.mj_initCtrlHistory(model, data, i, back, rows)

    def _bristles(self, track: Track) -> Floats:
        """And of each `pid` its setpoint, whose rate is limited, and its integral, along a recording."""
        out = super()._bristles(track)
        kind = int(self.mujoco.mjtDyn.mjDYN_PID)
        for j, i in enumerate(self.of.actuators):
            if int(self.model.actuator_dyntype[i]) == kind and isinstance(track, CommandedTrack):
                late = track.held(track.time - float(self.model.actuator_delay[i]))[:, j]
                command = self.scale[j] * late + self.shift[j]
                length = self.scale[j] * track.q[:, j] + self.shift[j]
                found = self._pid_states(i, command, length, track.step)
                at = int(self.model.actuator_actadr[i])
                out[:, at : at + found.shape[1]] = found
        return out

    def _pid_states(self, i: int, command: Floats, length: Floats, step: float) -> Floats:
        """Activations of a `pid` in its order: setpoint, integral. shape=(rows, activations)"""
        gain, dynamics = self.model.actuator_gainprm[i], self.model.actuator_dynprm[i]
        setpoint = command.copy()
        slew = float(dynamics[1])
        if slew > 0.0:
            setpoint[0] = length[0]
            for k in range(1, setpoint.size):
                way = command[k - 1] - setpoint[k - 1]
                setpoint[k] = setpoint[k - 1] + min(max(way, -slew * step), slew * step)
        columns = [setpoint] if slew > 0.0 else []
        if gain[0]:
            most = float(dynamics[0]) or np.inf
            integral = np.zeros_like(length)
            for k in range(1, length.size):
                grown = integral[k - 1] + step * (setpoint[k - 1] - length[k - 1])
                integral[k] = min(max(grown, -most), most)
            columns.append(integral)
        return np.column_stack(columns)
