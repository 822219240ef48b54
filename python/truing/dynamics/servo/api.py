# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The diagnosis of servo arms, from recordings of commands and motion to names."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import by_commands as by_commands
from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.arm import ServoArm, servo_arm
from truing.dynamics.servo.beats import READINGS, beat_of
from truing.dynamics.servo.bus import late_alike, log_squares
from truing.dynamics.servo.data import ServoData, Window, servo_data, windows_of
from truing.dynamics.servo.departures import departures, instead
from truing.dynamics.servo.firm import firm
from truing.dynamics.servo.fit import Fitter, Rows, rows_of
from truing.dynamics.servo.free import USUAL
from truing.dynamics.servo.ground import groundwork
from truing.dynamics.servo.judge import judged, traces_of
from truing.dynamics.servo.mounting import Grounded, mounting
from truing.dynamics.servo.naming import (
    INEXACT,
    NAMED,
    Account,
    Namer,
    Sureness,
    late,
    rooted_gain,
    sureness,
)
from truing.dynamics.servo.result import ServoDiagnosis
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator, point_of
from truing.dynamics.servo.unknown import FoundFunction, Unknown
from truing.dynamics.servo.words import Parts, diagnosis_of, held_share
from truing.errors import InputError

Floats = NDArray[np.float64]

WINDOW = 5.0  # [s] about: longer ones see slow effects better, and forget the start less surely
MAX_EFFECTS = 12
LONGEST_STEP = 0.005  # [s] of joints apart, in the search; what is reported is the whole arm's
LEAST_HELD = 0.1  # of a joint's squared error on held-out motion: other laws may well do less (OTHER_LAWS)
CERTAIN = 1.645  # standard errors over blocks of held-out motion
BLOCK = 1.0  # [s] of held-out motion, over which the interval of what a name removes is taken


@dataclass(frozen=True)
class Prepared:
    """An arm and its recordings, ready to be simulated."""

    arm: ServoArm
    data: ServoData
    windows: tuple[Window, ...]
    simulator: Simulator

    @property
    def train(self) -> list[Window]:
        return [w for w in self.windows if not w.test]


def prepare(
    robot: _core.Robot | str | Path,
    recordings: Sequence[_core.Recording],
    *,
    joints: Sequence[str] | None = None,
    window: float = WINDOW,
    test_share: float = 0.3,
    threads: int = 0,
) -> Prepared:
    """Reads the arm, and cuts the recordings into windows. Raises InputError as `servo_diagnose` does."""
    if not window > 0.0:
        raise InputError(f"window: found {window:g} s, expected a time above zero")
    if not 0.0 < test_share < 1.0:
        raise InputError(f"test_share: found {test_share:g}, expected a part between 0 and 1")
    if not recordings:
        raise InputError("no recordings are given: expected at least one")
    recorded = int(recordings[0].position.shape[1])
    arm = servo_arm(robot, joints, recorded)
    data = servo_data(recordings, len(arm.nominal.joints), test_share=test_share)
    arm = _with_references(arm, data)
    windows = windows_of(data, window, test_share=test_share)
    return Prepared(arm, data, tuple(windows), Simulator(arm, data, threads))


def _with_references(arm: ServoArm, data: ServoData) -> ServoArm:
    drives = arm.nominal.drives
    if data.torque_command:
        drives = tuple(replace(d, command_gain=1.0) for d in drives)
    nominal = replace(
        arm.nominal,
        drives=drives,
        gain_reference=data.gain_reference,
        supply_reference=data.supply_reference,
        temperature_reference=data.temperature_reference,
    )
    return replace(arm, nominal=nominal)


def servo_diagnose(
    robot: _core.Robot | str | Path,
    recordings: Sequence[_core.Recording],
    *,
    joints: Sequence[str] | None = None,
    leave_out: Sequence[str] = (),
    test_share: float = 0.3,
    window: float = WINDOW,
    max_effects: int = MAX_EFFECTS,
    threads: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ServoDiagnosis:
    """Find which effects stand between a simulator's model and recorded motion, from commands alone.

    Gain, damping, dry friction, rotor and zero of every joint are the groundwork. Every effect at every joint
    competes by the change that it makes to simulated motion; what is named predicts folds that it was not
    fitted to.

    robot: MJCF or URDF file, or a robot with masses, which is exported first. recordings: see
    `load_recordings`; with commanded positions [rad | m] or torques [Nm | N]; those marked as test are held
    out. joints: names of the recorded joints in the file, in the order of the columns; None: all of the
    file's. leave_out: effects that are not considered. test_share: part of the time that is held out, where
    no recording is marked. window: [s] length of simulations that begin at measured states; recordings less
    than 1.6 times as long are taken whole. threads: 0: all cores; the result is the same. progress: is
    called with what is being done.

    Raises InputError: MuJoCo is not installed, a file that it refuses, joints or columns that do not fit,
    values that are not numbers, nothing to fit.
    """
    begun = time.perf_counter()
    ready = partial(prepare, robot, joints=joints, window=window, test_share=test_share, threads=threads)
    prepared, said = as_moved(recordings, ready, leave_out, progress)
    nominal, rows = point_of(prepared.arm.nominal), rows_of(prepared.data, prepared.train)

    def ground(apart: Apart) -> Grounded:
        fitter = Fitter(apart, rows, progress)
        standard, sizes = groundwork(fitter, nominal, prepared.data)
        return Namer(fitter, leave_out, max_effects), standard, sizes

    apart = Apart(prepared.simulator, LONGEST_STEP)
    stands, (namer, standard, sizes) = None, ground(apart)
    if "base_tilt" not in leave_out:
        stands, (namer, standard, sizes) = mounting(apart, ground, (namer, standard, sizes))
    fitter = namer.fitter
    if stands is not None and isinstance(fitter.simulator, Apart):
        apart, simulator = fitter.simulator, fitter.simulator.whole
        prepared = replace(prepared, arm=simulator.arm, simulator=simulator)
    account = namer.run(standard, sizes, nominal, late_alike(namer, standard, sizes, nominal))
    fitter.progress("judging by held-out motion")
    single = len({prepared.data.streams[w.stream].fold for w in prepared.train}) < 2
    judge = Judge(prepared, apart, nominal, standard.point)
    account, sure, functions = _what_holds(namer, account, judge, single)
    account = firm(namer, account)
    standard = account.standard
    judge.standard = standard.point
    models = {"nominal": nominal, "standard": standard.point, "named": account.fitted.point}
    parts = Parts(
        prepared.simulator,
        prepared.data,
        single,
        namer,
        nominal,
        standard,
        account,
        sure,
        functions,
        judged(prepared.simulator, prepared.windows, models, window),
        traces_of(prepared.simulator, prepared.windows, models),
        judge.held(account, [f.field for f in standard.free]),
        judge.blocks,
        [*said, *([stands.sentence()] if stands is not None else []), *prepared.arm.notes],
        late(namer, account),
        departed := departures(namer, account),
        instead(namer, account, departed),
    )
    return diagnosis_of(parts, time.perf_counter() - begun)


def as_moved(
    recordings: Sequence[_core.Recording],
    ready: Callable[[Sequence[_core.Recording]], Prepared],
    leave_out: Sequence[str] = (),
    progress: Callable[[str], None] | None = None,
) -> tuple[Prepared, list[str]]:
    """Recordings made ready; where commands change more seldom than rows are recorded, held from change to
    change, or as they go on between, whichever moves better with the usual parameters and a delay; and what
    is to be said of it."""
    beats = [beat_of(recording) for recording in recordings]
    periods = [beat.period for beat in beats if beat is not None]
    if not periods:
        return ready(recordings), []
    period = float(np.median(periods))
    tried = [
        ready([read(one, beat, period) for one, beat in zip(recordings, beats, strict=True)])
        for read in READINGS
    ]
    best = int(np.argmin([_left(one, leave_out, progress) for one in tried]))
    return tried[best], [f"commands change every {1e3 * period:.3g} ms{tuple(READINGS.values())[best]}"]


def _left(prepared: Prepared, leave_out: Sequence[str], progress: Callable[[str], None] | None) -> float:
    """Logarithm of the squared error that the usual parameters and a delay of all joints leave."""
    nominal = point_of(prepared.arm.nominal)
    fitter = Fitter(Apart(prepared.simulator, LONGEST_STEP), rows_of(prepared.data, prepared.train), progress)
    standard, sizes = groundwork(fitter, nominal, prepared.data)
    namer = Namer(fitter, leave_out, 0)
    late = late_alike(namer, standard, sizes, nominal)
    return log_squares(standard.errors if late is None else late[1].errors, namer.resolution)


def _what_holds(
    namer: Namer, account: Account, judge: Judge, single: bool
) -> tuple[Account, list[Sureness], list[FoundFunction]]:
    """Names that held-out motion does not veto, and what nobody knows beside them. A name that is idle beside
    such a function goes, if the function is found without it too."""
    sure = _not_vetoed(namer, account, judge, single)
    unknown = Unknown(namer, account)
    functions = unknown.found(single, lambda point: judge.holds(account, point))
    idle = unknown.idle(functions)
    if idle is None:
        return account, sure, functions
    at, function = idle
    less = replace(account, found=list(account.found), vetoed=list(account.vetoed), idle=list(account.idle))
    less.vetoed.append((account.found[at], f"what nobody knows goes with the {function.input} in its place"))
    namer.drop(less, at)
    found = _what_holds(namer, less, judge, single)
    if function.joint in {other.joint for other in found[2]}:
        return found
    return account, sure, functions


def _not_vetoed(namer: Namer, account: Account, judge: Judge, single: bool) -> list[Sureness]:
    """How sure names are; those that are vetoed leave the account."""
    sure = sureness(namer, account, single)
    while (vetoed := judge.veto(sure, account, namer.resolution)) is not None:
        at, why = vetoed
        account.vetoed.append((account.found[at], why))
        namer.drop(account, at)
        sure = sureness(namer, account, single)
    return sure


def removes(without: Floats, named: Floats, standard: Floats, blocks: NDArray[np.intp]) -> tuple[bool, bool]:
    """Whether held-out errors fall for certain, and whether by enough: by a tenth of what is there without,
    and by what other laws may miss of what they removed there (of several joints, counted as one).
    shape=(rows, joints) each."""
    scale = np.maximum(np.sqrt(np.mean(standard**2, axis=0)), 1e-9)
    before, after = (
        np.asarray(np.bincount(blocks, np.sum((e / scale) ** 2, axis=1)), dtype=float)
        for e in (without, named)
    )
    rows = float(len(blocks))
    left = float(before.sum()) / rows / standard.shape[1]
    gain = float((before - after).sum()) / rows
    enough = gain >= LEAST_HELD * left + INEXACT * max(0.0, 1.0 - left)
    if before.size < 2:
        return False, enough
    # What acts in few seconds is seen by sums; what acts all the time, but mostly in a few, by roots.
    gains = before - after
    by_sums = float(gains.mean()), float(gains.std(ddof=1)) / math.sqrt(before.size)
    sure = any(mean > CERTAIN * error for mean, error in (by_sums, rooted_gain(before, after)))
    return sure, enough


def _veto(
    sure: Sequence[Sureness],
    held: Sequence[Floats],
    blocks: NDArray[np.intp],
    resolution: Floats,
    joints: Sequence[int],
) -> tuple[int, str] | None:
    """Number of an effect that does not deserve a name, and why: something else may look so (the least sure
    first), held-out motion is not predicted better with it for certain, or it moves the arm by less than
    encoders show (that which helps least). joints: of the effects, -1: of the arm."""
    standard, named = held[1], held[2]
    failed: list[tuple[int, float, int, str]] = []
    for k, (one, joint, without) in enumerate(zip(sure, joints, held[3:], strict=False)):
        own = slice(None) if joint < 0 else slice(joint, joint + 1)
        moved = np.sqrt(np.mean((without - named) ** 2, axis=0))
        if one.of_class < NAMED:
            why = "what it wins is so little that something else may look so"
        elif not all(removes(without[:, own], named[:, own], standard[:, own], blocks)):
            why = "held-out motion is not predicted better with it for certain"
        elif np.all(moved < resolution):
            why = "it moves the arm by less than the encoders' steps show"
        else:
            continue
        unsure = one.of_class < NAMED
        share = held_share(without, named, standard, blocks)[0]
        failed.append((0, one.of_class, k, why) if unsure else (1, share, k, why))
    return min(failed)[2:] if failed else None


class Judge:
    """Chains on held-out windows (on all, where none is)."""

    def __init__(self, prepared: Prepared, apart: Apart, nominal: Point, standard: Point) -> None:
        windows = [w for w in prepared.windows if w.test] or prepared.train
        self.rows = rows_of(prepared.data, windows)
        self.blocks = _blocks(prepared.data, self.rows)
        self.nominal, self.standard = nominal, standard
        self.whole, self._apart = Fitter(prepared.simulator, self.rows), Fitter(apart, self.rows)

    def errors(self, points: Sequence[Point]) -> list[Floats]:
        """Of the whole arm."""
        return [self.whole.errors(motion) for motion in self.whole.motions(points)]

    def held(self, account: Account, usual: Sequence[str]) -> list[Floats]:
        """Errors of every chain that is compared: see `Parts.held`. usual: fields that are always fitted."""
        points = [self.nominal, self.standard, account.fitted.point, *(w.point for w in account.weights)]
        for name in (n for n in USUAL if n in usual):
            back = self.standard.chain.copy()
            back[:, FIELDS.index(name)] = self.nominal.chain[:, FIELDS.index(name)]
            points.append(replace(self.standard, chain=back))
        return self.errors(points)

    def veto(self, sure: Sequence[Sureness], account: Account, resolution: Floats) -> tuple[int, str] | None:
        """`_veto`: by what joints apart do without each effect, beside the whole arm with all, as the search
        is; where nothing is vetoed so, by what the whole arm does."""
        compared = self.errors(self._compared(account))
        without = [w.point for w in account.weights]
        named = account.fitted.point
        alone = [self._apart.errors(motion) for motion in self._apart.motions([named, *without])]
        near = [compared[2] + errors - alone[0] for errors in alone[1:]]
        joints = [one.joint for one in account.found]
        vetoed = _veto(sure, [*compared, *near], self.blocks, resolution, joints)
        if vetoed is not None:
            return vetoed
        return _veto(sure, [*compared, *self.errors(without)], self.blocks, resolution, joints)

    def holds(self, account: Account, point: Point) -> bool:
        """Whether the joint of a point's function moves better for certain than with all that is named."""
        joint = [point.functions[0][0]]
        errors = [one[:, joint] for one in self.errors([*self._compared(account), point])[1:]]
        return all(removes(errors[1], errors[2], errors[0], self.blocks))

    def _compared(self, account: Account) -> list[Point]:
        return [self.nominal, account.ground.point, account.fitted.point]


def _blocks(data: ServoData, rows: Rows) -> NDArray[np.intp]:
    """Number of each row's block of about a second, counted within its window."""
    out: list[NDArray[np.intp]] = []
    count = 0
    for w in rows.windows:
        blocks = max(1, round(w.rows * data.streams[w.stream].step / BLOCK))
        out.append(count + np.arange(w.rows) * blocks // w.rows)
        count += blocks
    return np.concatenate(out)
