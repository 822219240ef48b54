# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sanity before statistics: what looks wrong with recordings of motion, before anything is fitted to them.

What is certain is corrected, and said; all else is only said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.magnitudes import are_magnitudes
from truing.dynamics.recorded import by_commands, driven_joints, of_all_rows, with_rows
from truing.dynamics.sanity import (
    band,
    between,
    columns,
    commands,
    drives_off,
    gravity,
    jumps,
    lag,
    lengths,
    loads,
    pushed,
)
from truing.dynamics.sanity.findings import (
    CheckedRecordings as CheckedRecordings,
    RecordingFinding as RecordingFinding,
)
from truing.dynamics.sanity.grids import Grid, gaps_of, grids_of
from truing.dynamics.sanity.known_load import known_load
from truing.dynamics.sanity.readings import readings
from truing.dynamics.sanity.row_means import row_means
from truing.dynamics.sanity.scales import constants_by_masses, gain_unknown, scales
from truing.dynamics.sanity.speeds import speeds
from truing.dynamics.sanity.switched import Switched, thinned

Floats = NDArray[np.float64]
Check = Callable[
    [_core.Robot, Sequence[_core.Recording]], tuple[list[RecordingFinding], list[_core.Recording]]
]
OF_ANGLES = ("angle_convention", "joint_sign", "joint_order")  # findings that need no scale of torques
HIDES_LENGTHS = ("load_comes_and_goes", "load_differs")  # findings with which masses are no constants
ANGLES: list[Check] = [jumps.unfolded, jumps.without_frozen]
JUMPS: list[Check] = [*ANGLES, jumps.without_spikes]
DRIVES: list[Check] = [drives_off.without_drives_off]


def check_recordings(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> CheckedRecordings:
    """Look for mistakes in recordings before something is fitted to them: shifted streams, signs, order,
    units and scales of columns, clipped and coarse values, gaps, rest.

        checked = truing.dynamics.check_recordings(robot, recordings)
        found = truing.dynamics.diagnose(checked.robot, checked.recordings, cutoff=checked.cutoff)

    Returns the findings, and robot and recordings with what is certain corrected (`applied`): units and
    signs of speeds and angles that derivatives or limits prove, signs of torques that both friction and
    weight contradict, torques that are late by 40 ms or more, and what a load of known mass tells: constants
    of drives of which currents alone were recorded, and where it hangs. `cutoff` is that of the low-pass that
    both sides of the equation of motion are to go through: the usual one, or where the recorded torques end.
    A `mistake` is not corrected: until it is, effects that are named are doubtful. Of recordings of commands
    alone, units, signs and order of the commands are held against what the joints did.

    Raises InputError on a robot or recordings that cannot be used.
    """
    for recording in recordings:
        _core.validate_recording(recording, robot)
    if by_commands(recordings):
        return _of_commands(robot, recordings)
    found, recordings, grids = _by_themselves(robot, recordings)
    magnitudes = are_magnitudes(robot, recordings)
    if magnitudes:
        found.append(columns.magnitudes())
    elif grids:
        held = _by_model(robot, recordings, grids)
        robot, recordings, grids = held.robot, held.recordings, held.grids
        found += held.findings
    if not any(one.mistake and one.finding == "position_unit" for one in found):
        found += columns.rest(robot, grids)
    found += [*columns.values(robot, recordings), *columns.alone(recordings)]
    frequency = None if any(one.mistake for one in found) else band.edge(robot, recordings)
    if frequency is not None:
        found.append(band.finding(frequency))
    found.sort(key=lambda one: (not one.mistake, one.finding in ("at_rest", "gaps", "one_recording")))
    cutoff = _core.TorqueOptions().cutoff if frequency is None else band.cutoff_below(frequency)
    return CheckedRecordings(robot, tuple(recordings), tuple(found), cutoff)


@dataclass(frozen=True)
class _Held:
    """Recordings as they are once they were held against the robot's model."""

    robot: _core.Robot
    recordings: list[_core.Recording]
    grids: list[Grid]
    findings: list[RecordingFinding]


def _by_model(robot: _core.Robot, recordings: list[_core.Recording], grids: list[Grid]) -> _Held:
    """What the robot's model shows: signs, order and scales; shifts; loads and pushes; its own lengths."""
    read = readings(robot, grids)
    unknown = _without_constant(robot, recordings)
    found = [*read.findings, *scales(robot, read.fit, unknown)]
    # Recorded speeds are by now the derivatives of the angles, and go with them.
    recordings = [
        _scaled(one, read.position.get(one.name), read.position.get(one.name)) for one in recordings
    ]
    if read.gravity != tuple(robot.gravity):
        robot = gravity.under(robot, np.array(read.gravity))
    robot, recordings = _turned(robot, recordings, read.torque)
    if _any_change(read.torque) or _any_change(read.position):
        grids = grids_of(robot, recordings)
    if not any(one.mistake for one in found):
        late = lag.shifts(robot, grids)
        found += lag.findings(late, len(recordings))
        recordings = [_shifted_back(one, late.get(one.name, 0.0)) for one in recordings]
        load = known_load(robot, recordings, unknown, constants_by_masses(read.fit, unknown))
        robot, recordings, unknown = load.robot, load.recordings, load.unknown
        found += load.findings
        constants = constants_by_masses(read.fit, unknown)
        recordings, differing = _what_differs(robot, recordings, grids, constants if unknown else None)
        found += differing
    if not unknown and not any(one.finding in HIDES_LENGTHS or _other_mistake(one) for one in found):
        pushed_at = any(one.finding == "tool_pushed" for one in found)
        free = grids_of(robot, recordings) if pushed_at else grids
        found = [*lengths.of_another_robot(robot, free, read.fit), *found]
    if unknown:
        found.append(gain_unknown(robot, read.fit, unknown))
    elif not any(one.mistake for one in found):
        more, recordings = row_means(robot, recordings)
        found += more
    return _Held(robot, recordings, grids, found)


def _other_mistake(found: RecordingFinding) -> bool:
    """Than torques of another scale: those of another robot are, too."""
    return found.mistake and found.finding != "gain"


def _by_themselves(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording], list[Grid]]:
    """What clocks, angles and speeds show without a model: findings, recordings and their grids."""
    found, recordings = columns.clock(recordings)
    magnitudes = are_magnitudes(robot, recordings)  # they turn back at zero, which is no spike
    more, recordings = _mended(robot, recordings, [*(ANGLES if magnitudes else JUMPS), *DRIVES])
    grids = grids_of(robot, recordings)
    of_speeds, by_speed, by_angle = speeds(robot, grids)
    recordings = [_scaled(one, by_speed.get(one.name), by_angle.get(one.name)) for one in recordings]
    if _any_change(by_angle):
        grids = grids_of(robot, recordings)
    slow = columns.slow(recordings)
    return [*found, *more, *of_speeds, *slow], recordings, [grid for grid in grids if len(grid.rows)]


def check_commands(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> CheckedRecordings:
    """What commands and angles show by themselves, whatever the robot's model is: of it no more is taken than
    names, kinds and limits of the joints. recordings: of commands, without torques.
    """
    positions = all(one.command.shape[1] for one in recordings)
    found, recordings = _mended(robot, recordings, [*JUMPS, *([commands.commands] if positions else [])])
    found.sort(key=lambda one: not one.mistake)
    return CheckedRecordings(robot, tuple(recordings), tuple(found))


def _of_commands(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> CheckedRecordings:
    checked = check_commands(robot, recordings)
    positions = all(one.command.shape[1] for one in recordings)
    if not positions or any(one.mistake for one in checked.findings):
        return checked
    angles = _angles_by_leads(robot, checked.recordings)
    return replace(checked, findings=(*angles, *checked.findings))


def _angles_by_leads(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> list[RecordingFinding]:
    """Zeros, signs and order of angles: how far a command is ahead of its joint goes with the torque."""
    leads = [one.replace(torque=np.asarray(one.command) - np.asarray(one.position)) for one in recordings]
    grids = [grid for grid in grids_of(robot, leads) if len(grid.rows)]
    found = readings(robot, grids, each=False).findings if grids else ()
    return [
        replace(one, evidence=f"by how far commands are ahead of the angles, {one.evidence}")
        for one in found
        if one.finding in OF_ANGLES
    ]


def _mended(
    robot: _core.Robot, recordings: Sequence[_core.Recording], checks: Sequence[Check]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    found: list[RecordingFinding] = []
    recordings = list(recordings)
    for check in checks:
        more, recordings = check(robot, recordings)
        found += more
    return found, recordings


def _what_differs(
    robot: _core.Robot, recordings: list[_core.Recording], grids: Sequence[Grid], constants: Floats | None
) -> tuple[list[_core.Recording], list[RecordingFinding]]:
    """What is there at times and no column tells: a load, which is taken into account; a push at the tool,
    whose rows are left out; friction. constants: of drives, where they are guessed, so that a mass is no more
    than that.
    """
    if loads.stated(recordings):
        return recordings, between.friction_differs(robot, recordings, grids)
    found: list[RecordingFinding] = []
    carried, push = _at_times(robot, _guessed(grids, constants))
    if push is not None:
        found.append(pushed.said(push))
        if found[0].mistake:
            return recordings, found
        recordings = pushed.without_pushes(recordings, push)
        grids = [grid for grid in grids_of(robot, recordings) if len(grid.rows)]
    fit = None if carried else loads.compared(robot, _guessed(grids, constants))
    if fit is not None:
        other_scale = loads.gain_differs(fit)
        if other_scale:
            return recordings, [*found, *other_scale]
        carried = loads.loads_of(robot, fit)
    if not carried:
        return recordings, [*found, *between.friction_differs(robot, recordings, grids)]
    if constants is not None:
        return recordings, [*found, *(loads.to_be_weighed(one) for one in carried)]
    return loads.with_loads(recordings, carried), [*found, *(loads.used(one) for one in carried)]


def _at_times(robot: _core.Robot, grids: Sequence[Grid]) -> tuple[list[loads.Load], Switched | None]:
    """Loads that come and go, or a push at the tool, whichever explains more. Pressed upon from below, an
    arm carries less, too, but nothing that would have to be accelerated.
    """
    thin = thinned(robot, grids)
    if thin is None:
        return [], None
    carried, left = loads.picked_up(robot, thin)
    places = [None, *(one.when.values[1:] / one.when.values[0] for one in carried if one.when is not None)]
    pushes = [push for place in places if (push := pushed.push_of(robot, thin, place)) is not None]
    push = min(pushes, key=lambda one: one.left, default=None)
    return (carried, None) if push is None or push.left >= left else ([], push.each[0])


def _guessed(grids: Sequence[Grid], constants: Floats | None) -> Sequence[Grid]:
    """With torques by constants of drives, where these are guessed."""
    return grids if constants is None else [replace(grid, torque=grid.torque * constants) for grid in grids]


def _scaled(recording: _core.Recording, by_speed: Floats | None, by_angle: Floats | None) -> _core.Recording:
    given = {"speed": by_speed, "position": by_angle}
    return _multiplied(recording, {name: by for name, by in given.items() if by is not None})


def _multiplied(recording: _core.Recording, factors: Mapping[str, Floats]) -> _core.Recording:
    """Columns of tables that were recorded times factors, shape=(joints,)."""
    there = {n: by for n, by in factors.items() if (by != 1.0).any() and getattr(recording, n).shape[1]}
    return of_all_rows(recording, partial(_times, factors=there)) if there else recording


def _times(recording: _core.Recording, factors: Mapping[str, Floats]) -> _core.Recording:
    return recording.replace(**{n: np.asarray(getattr(recording, n)) * by for n, by in factors.items()})


def _without_constant(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> list[int]:
    """Joints whose current was recorded in place of the torque, of drives whose constant is not known."""
    return [
        k
        for k, joint in enumerate(driven_joints(robot))
        if joint.torque_per_ampere is None and any(_by_current(one, k) for one in recordings)
    ]


def _by_current(recording: _core.Recording, k: int) -> bool:
    current, torque = recording.current, recording.torque
    there = bool(current.shape[1]) and not np.isnan(current[0, k])
    return there and (not torque.shape[1] or bool(np.isnan(torque[0, k])))


def _any_change(factors: Mapping[str, Floats]) -> bool:
    return any(bool((some != 1.0).any()) for some in factors.values())


def _turned(
    robot: _core.Robot, recordings: Sequence[_core.Recording], factors: Mapping[str, Floats]
) -> tuple[_core.Robot, list[_core.Recording]]:
    """Signs of torques changed. Of a drive whose constant is known and all of whose currents have the other
    sign, the constant changes: it says what sign currents have.
    """
    if not _any_change(factors):
        return robot, list(recordings)
    robot = robot.copy()
    joints = driven_joints(robot)
    of_drive = np.ones(len(joints))
    for k, index in enumerate(robot.driven_joints()):
        constant = robot.joints[index].torque_per_ampere
        if constant is not None and all(
            _by_current(one, k) and one.name in factors and factors[one.name][k] < 0 for one in recordings
        ):
            of_drive[k] = -1.0
            robot.joints[index].torque_per_ampere = -constant
    out = []
    for one in recordings:
        own = factors.get(one.name, np.ones(len(joints)))
        out.append(_multiplied(one, {"torque": own, "current": own * of_drive}))
    return robot, out


def _shifted_back(recording: _core.Recording, late: float) -> _core.Recording:
    """Torques and currents as they were `late` seconds later, on the rows that have such."""
    if abs(late) < lag.APPLIED:
        return recording
    return of_all_rows(recording, partial(_later, late=late))


def _later(recording: _core.Recording, late: float) -> _core.Recording:
    time = np.asarray(recording.time)
    wanted = time + late
    kept = (wanted >= time[0]) & (wanted <= time[-1])
    for row in gaps_of(time):
        kept &= (wanted <= time[row]) | (wanted >= time[row + 1])
    tables = {name: np.asarray(getattr(recording, name)) for name in ("torque", "current")}
    late_ones = {
        name: np.column_stack([np.interp(wanted, time, column) for column in table.T])
        for name, table in tables.items()
        if table.shape[1]
    }
    return with_rows(recording, kept, late_ones)
