# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A robot fitted anew with what a format can hold.

Without a law of friction that the format has no place for, the best Coulomb and viscous friction and the best
bodies are others than those that were fitted beside it. What acts from elsewhere (couplings, springs, ripple)
stays in the fit: friction that is fitted without it bends towards it and moves worse.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import identify
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.recorded import Recorded
from truing.errors import InputError

_ANEW = (
    "coulomb",
    "viscous",
    "current_offset",
    "viscous_law",
    "stribeck",
    "presliding",
    "armature",
    "motor_constant",
)
"""Effects that are fitted anew where the robot carries them; the others stay as they are. What a drive's
constant is taken for depends on friction that grows with the load."""
_AT_ITS_JOINT = ("coulomb", "viscous", "viscous_law", "stribeck", "presliding")
"""Friction that is fitted anew at a joint whose friction fades at rest: these trade places."""
_OF_MOTION = {"load_friction", "viscous_law", "stribeck", "position_friction"}
"""Laws of friction that one of the speed can stand for in part; what goes with warmth or time it cannot."""
_TAKEN_UP = _OF_MOTION | {"thermal_friction", "warmup", "presliding", "armature"}
"""Effects that Coulomb friction, damping and bodies can make up for."""
_FORMS = ("viscous_law.quadratic", "viscous_law.cubic", "viscous_law.root", "viscous_law.saturating")
_NO_FORMS = ("viscous_law.root", "viscous_law.saturating")  # no format holds these
_NONE_HELD_OUT = 1e-6  # test_share at which no recording and no block of time is held out
_SHORTEST = 1.0  # [s] of a stretch that is fitted to


def lacking(robot: _core.Robot, left: Iterable[NotWritten]) -> list[str]:
    """Parameters that a format does not hold, and that friction and bodies can make up for.

    left: what it has no place for.
    """
    names = {item.name for item in left if item.name.split(".")[0] in _TAKEN_UP}
    return [
        parameter
        for effect in robot.torque_effects
        for parameter in effect.parameters
        if any(parameter == name or parameter.startswith(f"{name}.") for name in names)
    ]


def fading(robot: _core.Robot) -> list[str]:
    """Parameters by which dry friction fades at rest: no simulator has that."""
    return [
        parameter
        for effect in robot.torque_effects
        for parameter in effect.parameters
        if parameter.endswith(".turn_fade")
    ]


def joints_with(robot: _core.Robot, parameters: Collection[str]) -> set[str]:
    """Joints of the effects that have one of these parameters."""
    found = [effect for effect in robot.torque_effects if set(effect.parameters) & set(parameters)]
    return {joint for effect in found for joint in effect.joints}


def training(
    recordings: Sequence[tuple[_core.Recording, NDArray[np.bool_]]],
) -> list[_core.Recording]:
    """What was not held out of recordings, given with their rows that were: stretches of theirs.

    Raises InputError: a part of a recording that is longer than memory was held out.
    """
    out: list[_core.Recording] = []
    for recording, held in recordings:
        if held.all():
            continue
        if not held.any():
            out.append(recording.replace(test=False))
            continue
        if recording.pieces is not None:
            raise InputError(f"{recording.name}: is longer than memory, and parts of it were held out")
        rows = np.flatnonzero(~held)
        for part in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            if recording.time[part[-1]] - recording.time[part[0]] >= _SHORTEST:
                out.append(_rows(recording, part, len(out)))
    return out


def _rows(recording: _core.Recording, rows: NDArray[np.intp], number: int) -> _core.Recording:
    n = len(recording)
    tables = ("time", "position", "speed", "torque", "current", "command", "torque_command")
    whole = {name: np.asarray(getattr(recording, name)) for name in tables}
    columns = {name: np.asarray(column)[rows] for name, column in recording.columns.items()}
    parts: dict[str, Any] = {
        name: table[rows] for name, table in whole.items() if table.shape[0] == n and table.size
    }
    parts |= {"columns": columns, "torque_is_mean": recording.torque_is_mean}
    return _core.Recording(f"{recording.name} {number}", **parts)


def fit_without(
    robot: _core.Robot,
    parameters: Collection[str],
    to: str,
    recordings: Sequence[Recorded],
    cutoff: float | None,
    bare_joints: Collection[str] = (),
) -> _core.Robot:
    """The robot without these parameters: friction, bodies, rotor inertias and the constant of a single drive
    fitted anew to all of the recordings. cutoff: [Hz], as the robot was fitted with; None: the usual one.
    Joints that lose a law of friction get one that the format `to` holds, but for bare_joints.

    Raises InputError on recordings that nothing can be fitted to.
    """
    given = _read_into_memory(recordings)
    rest = [
        effect.replace(parameters={k: v for k, v in effect.parameters.items() if k not in parameters})
        for effect in robot.torque_effects
    ]
    rest = [effect for effect in rest if effect.parameters]
    where = {name: {j for e in rest if e.effect == name for j in e.joints} for name in _ANEW}
    if len(where["motor_constant"]) > 1:
        del where["motor_constant"]  # several share a scale with all masses
    lost = {
        joint
        for effect in robot.torque_effects
        if effect.effect in _OF_MOTION and set(effect.parameters) & set(parameters)
        for joint in effect.joints
    }
    lost -= set(bare_joints)
    if to == "mjcf":
        where["viscous_law"] |= lost
        # MuJoCo has it as a part of what builds up over an angle after a reversal.
        where["stribeck"] |= lost & where["presliding"]
    kept = [effect for effect in rest if effect.effect not in where]
    return _fitted(robot, kept, where, given, cutoff, _NO_FORMS)


def with_friction_that_holds(
    robot: _core.Robot, recordings: Sequence[Recorded], cutoff: float | None
) -> _core.Robot:
    """The robot with all friction of joints where it fades at rest fitted anew, with friction that does not,
    its laws in the forms that they have; of the rest only bodies move with it. recordings, cutoff: as of
    fit_without, whose errors are raised.
    """
    joints = {_joint_of(parameter) for parameter in fading(robot)}
    where = {
        name: {j for e in robot.torque_effects if e.effect == name for j in e.joints} & joints
        for name in _AT_ITS_JOINT
    }
    kept = [
        _elsewhere(effect, where[effect.effect]) if effect.effect in where else effect
        for effect in robot.torque_effects
    ]
    forms = {
        f"{effect.effect}.{parameter.rpartition('.')[2]}"
        for effect in robot.torque_effects
        for parameter in effect.parameters
        if _joint_of(parameter) in joints
    }
    kept = [effect for effect in kept if effect.parameters]
    given = _read_into_memory(recordings)
    return _fitted(robot, kept, where, given, cutoff, [form for form in _FORMS if form not in forms])


def _joint_of(parameter: str) -> str:
    """ "J2" of coulomb.J2.turn_fade; "" of one that belongs to no joint."""
    return parameter.split(".")[1] if "." in parameter else ""


def _elsewhere(effect: _core.AppliedEffect, joints: Collection[str]) -> _core.AppliedEffect:
    """What an effect is at other joints than these."""
    return effect.replace(
        joints=[joint for joint in effect.joints if joint not in joints],
        parameters={k: v for k, v in effect.parameters.items() if _joint_of(k) not in joints},
    )


def _read_into_memory(recordings: Sequence[Recorded]) -> list[_core.Recording]:
    given = [recording for recording in recordings if isinstance(recording, _core.Recording)]
    if len(given) < len(recordings):
        raise InputError("recordings: expected those of truing.dynamics.load_recordings")
    return given


def _fitted(
    robot: _core.Robot,
    kept: Sequence[_core.AppliedEffect],
    where: Mapping[str, set[str]],
    recordings: Sequence[_core.Recording],
    cutoff: float | None,
    leave_out_forms: Sequence[str] = (),
) -> _core.Robot:
    """The robot with bodies, and effects at joints by name (`where`), fitted beside those that are kept."""
    options: dict[str, Any] = {} if cutoff is None else {"cutoff": cutoff}
    found = identify(
        # Without its range it counts as one that was not fitted before: how friction turns is chosen anew.
        robot.replace(torque_effects=list(kept), fitted_range={}),
        [recording.replace(test=False) for recording in recordings],
        effects=[f"{name}:{'+'.join(sorted(joints))}" for name, joints in where.items() if joints],
        leave_out_forms=leave_out_forms,
        test_share=_NONE_HELD_OUT,
        **options,
    ).robot
    laws = where.get("viscous_law", set())
    if driving := _driving(found) & laws:
        without = {**where, "viscous_law": laws - driving}
        return _fitted(robot, kept, without, recordings, cutoff, leave_out_forms)
    return found


def _driving(robot: _core.Robot) -> set[str]:
    """Joints whose friction pushes once they are fast: in its polynomial the highest power of the speed is
    below zero. It fits as far as the recordings go, and a simulation that goes farther never comes back.
    """
    return {
        joint
        for effect in robot.torque_effects
        if effect.effect == "viscous_law"
        for joint in effect.joints
        if any(size < 0.0 for size in effect.parameters.values())
    }
