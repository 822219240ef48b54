# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The groundwork: gain, damping, dry friction, rotor and zero of every joint, from whatever the file says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.arm import LEAST_ARMATURE, LEAST_FRICTION
from truing.dynamics.servo.data import ServoData, Window
from truing.dynamics.servo.fit import Fitted, Fitter, Rows, noise_of, rows_of
from truing.dynamics.servo.free import Free, Sizes, usual_values
from truing.dynamics.servo.scatter import narrowed, scattered
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator

Floats = NDArray[np.float64]

_MOVING = 0.02  # of the fastest: slower rows are at rest
_ROUNDS = 20
_KIND = 3  # joints of one gain in the file, at least: servos of one kind
_ALIKE = 0.2  # of the logarithm of their gains
_SAME_SQUARES = 0.3  # more of a joint's squared error, before it is fitted again: its scale is not seen
_SCALES = (1.0, 0.2, 0.5, 2.0)  # of all torques, from which a fit goes on
_FINER_GAIN = 0.1  # of a joint's squared error, that finer differences have to win
_WITHIN_GAIN = 0.1  # the same of damping that ends at the largest torque
_NEAR = 10.0  # times a joint's squared error: with the file's torques they may still be the better ones
_LEAST_ERROR = 1e-6  # [rad | m]
_SCANNED = 12  # windows that the first scan looks at, at most
_RUBS = 0.1  # of a joint's usual torque: dry friction
TORQUES = ("command_gain", "viscous", "coulomb", "armature")
_FAR_SCALE = np.log(3.0)  # of all torques at once: a joint that has left its file
_FAR_DELAY = 0.5  # of the bus's delay: a joint that has left it
_AND_LIMIT = np.array([FIELDS.index(name) for name in (*TORQUES, "saturation")])
_STATED = {
    "command_gain": 0.0,
    "viscous": LEAST_FRICTION,
    "coulomb": LEAST_FRICTION,
    "armature": LEAST_ARMATURE,
}
"""Above these a file states a value."""
_TINY = 1e-12
_GAINS = np.exp(np.arange(-5.0, 2.1, 1.0))  # times the file's, and what all torques share
_WIDE = np.exp(np.arange(-4.0, 2.1, 1.5))  # the same of friction and rotors
_FINE = np.exp(np.array([-0.7, -0.35, 0.35, 0.7]))


def sizes_of(simulator: Simulator | Apart, point: Point, windows: Sequence[Window]) -> Sizes:
    """What is usual at each joint, of a simulation of it and of the recordings."""
    data = simulator.data
    speeds = [s.speed for s in data.streams]
    speed = np.array([_moving_rms(np.concatenate([v[:, j] for v in speeds])) for j in range(data.joints)])
    _, torque = simulator.run([point], windows, torques=True)
    error = np.concatenate([s.command - s.position for s in data.streams])
    if data.torque_command:
        error = np.concatenate([s.position - s.position.mean(axis=0) for s in data.streams])
    gain = point.chain[:, FIELDS.index("command_gain")]
    used = np.sqrt(np.mean(torque[0] ** 2, axis=0))
    angle = np.maximum(np.sqrt(np.mean(error**2, axis=0)), 1e-4)
    return Sizes(
        np.maximum(used, 1e-3 * angle * gain + 1e-9),
        np.maximum(speed, 1e-4),
        angle,
        np.maximum(_inertia(simulator, point), 1e-9),
    )


def _moving_rms(speed: Floats) -> float:
    moving = np.abs(speed) > _MOVING * np.abs(speed).max()
    return float(np.sqrt(np.mean(speed[moving] ** 2))) if moving.any() else 0.0


def _inertia(simulator: Simulator | Apart, point: Point) -> Floats:
    """Of everything that each joint moves, at the file's zero."""
    return _carried(simulator) + point.chain[:, FIELDS.index("armature")]


def _carried(simulator: Simulator | Apart) -> Floats:
    """The same without rotors."""
    m = simulator.model
    bodies = np.asarray(m.dof_M0, dtype=float)[simulator.dofs] - np.asarray(m.dof_armature)[simulator.dofs]
    return np.asarray(np.maximum(bodies, 1e-9))


def first_guess(simulator: Simulator | Apart, rows: Rows, point: Point, torque_command: bool) -> Point:
    """Joint by joint the best of wide steps in gain, damping, friction and rotor, and in all torques at once,
    of which only weight and masses say how large they are: a file may be off by hundreds, where no derivative
    leads back. All joints are changed at once: they hardly see each other."""
    fitter = Fitter(simulator, _few(simulator, rows))
    names = [name for name in TORQUES if not (torque_command and name == "command_gain")]
    wide = [([name], _GAINS if name == "command_gain" else _WIDE) for name in names]
    fine = [([name], _FINE) for name in names]
    for together, factors in [*wide, (names, _GAINS), *fine]:
        columns = [FIELDS.index(name) for name in together]
        if together == names:  # what limits them is a torque as well
            columns.append(FIELDS.index("saturation"))
        chains = []
        for factor in (1.0, *factors):
            chains.append(point.chain.copy())
            chains[-1][:, columns] *= factor
        motions = fitter.motions([replace(point, chain=chain) for chain in chains])
        squares = np.array([np.mean(fitter.errors(motion) ** 2, axis=0) for motion in motions])
        best = np.argmin(squares, axis=0)
        point = replace(point, chain=np.array(chains)[best, np.arange(len(best))])
    return point


def groundwork(fitter: Fitter, nominal: Point, data: ServoData) -> tuple[Fitted, Sizes]:
    """The usual parameters fitted to all rows of the fitter."""
    simulator = fitter.simulator
    fitter.progress("groundwork")
    guess = first_guess(simulator, fitter.rows, _beyond_limit(nominal), data.torque_command)
    point = with_limits(guess, nominal)
    sizes = sizes_of(simulator, point, fitter.rows.windows)
    free = usual_values(simulator.arm.nominal, sizes, data.torque_command)
    start = np.array([f.at(point) for f in free])
    begin = _better_start(fitter, point, nominal, sizes, free, start)
    fitted = fitter.settled(begin, free, start, None, _ROUNDS, "groundwork")
    fitted = _alike(fitter, _from_file(fitter, _finer(fitter, fitted), nominal), nominal)
    point = with_limits(fitted.point, nominal)
    if not np.array_equal(point.chain, fitted.point.chain):
        fitted = fitter.settled(point, fitted.free, fitted.start, None, _ROUNDS // 4, "limits of the torques")
    return fitted, sizes


def _better_start(
    fitter: Fitter, point: Point, nominal: Point, sizes: Sizes, free: Sequence[Free], start: Floats
) -> Point:
    """Where a fit ends best, joint by joint, of several: one begins at the point, one with rotors as heavy as
    what they move and with dry friction (a rotor that a scan left at next to nothing does not come back, as
    damping has taken its place), one at the best servo of all that there may be. Where joints are at their
    largest torque, a controller's damping ends there if that leaves clearly less."""
    chain = point.chain.copy()
    chain[:, FIELDS.index("armature")] = sizes.inertia
    chain[:, FIELDS.index("coulomb")] = _RUBS * sizes.torque
    begins = [point, replace(point, chain=chain)]
    limited = _reaches_limit(fitter, nominal)
    if not fitter.simulator.data.torque_command:
        few = Fitter(fitter.simulator, _few(fitter.simulator, fitter.rows))
        carried = _carried(fitter.simulator)
        for one in [point, nominal] if limited else [point]:
            begins.append(narrowed(few, scattered(one, carried)))
    if limited:
        begins.append(nominal)
    best = _best_ends(fitter, begins, free, start)
    return _best_ends(fitter, [best, _turned(best, nominal)], free, start) if limited else best


def _best_ends(fitter: Fitter, begins: Sequence[Point], free: Sequence[Free], start: Floats) -> Point:
    """Joint by joint where fits from these end best."""
    fits = [fitter.fit(one, free, start, None, _ROUNDS, "groundwork", shown=False) for one in begins]
    within = [fit.point.chain[:, FIELDS.index("limited_damping")] > 0.0 for fit in fits]
    squares = np.array([np.mean(fit.errors**2, axis=0) for fit in fits])
    best = np.argmin(np.where(within, squares / (1.0 - _WITHIN_GAIN), squares), axis=0)
    return replace(begins[0], chain=np.array([fits[k].point.chain[j] for j, k in enumerate(best)]))


def _turned(point: Point, nominal: Point) -> Point:
    """With damping beyond the largest torque where it ends there, and the other way round."""
    column = FIELDS.index("limited_damping")
    chain = point.chain.copy()
    chain[:, column] = nominal.chain[:, column] - chain[:, column]
    return replace(point, chain=chain)


def _few(simulator: Simulator | Apart, rows: Rows) -> Rows:
    """A dozen windows' rows: enough for a first look."""
    return rows_of(simulator.data, rows.windows[:: max(1, len(rows.windows) // _SCANNED)])


def _reaches_limit(fitter: Fitter, point: Point) -> bool:
    """Whether a joint whose controller makes damping is at its largest torque in some row."""
    within = point.chain[:, FIELDS.index("limited_damping")] > 0.0
    if not within.any():
        return False
    torque = fitter.simulator.run([point], fitter.rows.windows, torques=True)[1][0]
    at_most = np.abs(torque) >= (1.0 - _TINY) * point.chain[:, FIELDS.index("saturation")]
    return bool(np.any(at_most.any(axis=0) & within))


def _beyond_limit(point: Point) -> Point:
    """With damping that does not end at the largest torque."""
    return point.with_value(slice(None), "limited_damping", 0.0)


def _finer(fitter: Fitter, fitted: Fitted) -> Fitted:
    """The fit goes on by finer differences, also from all torques of a joint at other scales, where joints
    move better for certain so."""
    other, columns = fitter.other, [FIELDS.index(name) for name in TORQUES]
    chains = []
    for factor in _SCALES:
        chains.append(fitted.point.chain.copy())
        chains[-1][:, columns] *= factor
    with fitter.finer():
        fits = [
            fitter.fit(
                replace(fitted.point, chain=chain), fitted.free, fitted.start, None, _ROUNDS, "", False
            )
            for chain in chains
        ]
        best = np.argmin([np.mean(fit.errors**2, axis=0) for fit in fits], axis=0)
        point = replace(fitted.point, chain=np.array([fits[k].point.chain[j] for j, k in enumerate(best)]))
        fit = fitter.settled(point, fitted.free, fitted.start, None, _ROUNDS // 4, "groundwork")
    before, after = (np.mean(one.errors**2, axis=0) for one in (fitted, fit))
    better = after < (1.0 - _FINER_GAIN) * before
    if not better.any():
        fitter.other = other
        return fitted
    point = replace(fitted.point, chain=np.where(better[:, None], fit.point.chain, fitted.point.chain))
    return fitter.settled(point, fitted.free, fitted.start, None, _ROUNDS // 4, "groundwork")


def with_limits(point: Point, nominal: Point) -> Point:
    """The file's limits of the torques, times the factor that all torques of a joint have in common: motion
    says them but for one factor, and a limit that stayed would be another one. Of torques that all grew (or
    all fell) the factor is their median; else there is none."""
    limit = FIELDS.index("saturation")
    chain = point.chain.copy()
    chain[:, limit] = nominal.chain[:, limit] * np.exp(shared_scale(point, nominal))
    return replace(point, chain=chain)


def shared_scale(point: Point, nominal: Point) -> Floats:
    """Logarithm of the factor over the file's that all torques of a joint have in common; 0: there is none.
    shape=(joints,)"""
    columns = [FIELDS.index(name) for name in TORQUES]
    unstated = nominal.chain[:, columns] <= np.array([_STATED[name] for name in TORQUES])
    now, then = np.maximum(point.chain[:, columns], _TINY), np.maximum(nominal.chain[:, columns], _TINY)
    out = np.zeros(len(unstated))
    for j, stated in enumerate(~unstated):
        logs = np.log(now / then)[j, stated]
        if logs.size and abs(np.sum(np.sign(logs))) == logs.size:
            out[j] = np.median(logs)
    return out


@dataclass(frozen=True)
class Place:
    """Another fit to look from, the joints at which it is one, and the field that it holds there."""

    near: Fitted
    joints: list[int]
    held: str


def other_places(fitter: Fitter, fitted: Fitted, nominal: Point, sizes: Sizes) -> list[Place]:
    """Where a fit may have been led away by what was missing, fits that hold what it let go."""
    places = [_near_file(fitter, fitted, nominal), _near_bus(fitter, fitted, sizes)]
    return [place for place in places if place is not None]


def _near_file(fitter: Fitter, fitted: Fitted, nominal: Point) -> Place | None:
    """Where all torques of a joint have left the file's by far, these, its gain held. An integral holds
    weight that a position error would, as torques do that are so large that weight is nothing; among these
    its derivatives show nothing of it."""
    far = np.flatnonzero(np.abs(shared_scale(fitted.point, nominal)) > _FAR_SCALE)
    chain = fitted.point.chain.copy()
    chain[np.ix_(far, _AND_LIMIT)] = nominal.chain[np.ix_(far, _AND_LIMIT)]
    return _holding(fitter, fitted, chain, far, "command_gain")


def _near_bus(fitter: Fitter, fitted: Fitted, sizes: Sizes) -> Place | None:
    """Where a joint is later than the bus, or less, by far, the bus's delay (none, where it is late alone),
    with a rotor and dry friction. A spring between rotor and link looks late, and the link's inertia then
    like less."""
    late = [f for f in fitted.free if f.field == "delay" and f.joint >= 0]
    values = np.array([f.at(fitted.point) for f in late])
    bus = float(np.median(values)) if len(late) >= _KIND else 0.0
    far = np.array([f.joint for f in late], dtype=np.intp)[np.abs(values - bus) > _FAR_DELAY * bus]
    chain = fitted.point.chain.copy()
    chain[far, FIELDS.index("delay")] = bus
    for name, least in (("armature", sizes.inertia), ("coulomb", _RUBS * sizes.torque)):
        chain[far, FIELDS.index(name)] = np.maximum(chain[far, FIELDS.index(name)], least[far])
    return _holding(fitter, fitted, chain, far, "delay")


def _holding(
    fitter: Fitter, fitted: Fitted, chain: Floats, joints: NDArray[np.intp], held: str
) -> Place | None:
    """The fit from this chain, a field held at these joints. None: at none."""
    if not joints.size:
        return None
    mine = [k for k, f in enumerate(fitted.free) if f.joint in joints and f.field != held]
    free = [fitted.free[k] for k in mine]
    near = fitter.fit(
        replace(fitted.point, chain=chain), free, fitted.start[mine], None, _ROUNDS // 2, shown=False
    )
    errors, table = fitter.columns(near.point, fitted.free)
    return Place(replace(fitted, point=near.point, errors=errors, columns=table), [*map(int, joints)], held)


def _from_file(fitter: Fitter, fitted: Fitted, nominal: Point) -> Fitted:
    """Joints that the whole arm moves better with the file's torques begin again there: of a light joint
    alone, along the measured motion of the others, the scale of all torques is hardly seen, and may end
    anywhere."""
    chain, columns = fitted.point.chain, [FIELDS.index(name) for name in TORQUES]
    file = chain.copy()
    file[:, columns] = nominal.chain[:, columns]
    before, other = np.mean(fitted.errors**2, axis=0), fitter.other
    motion = fitter.motions([replace(fitted.point, chain=file)])[0]
    near = np.mean(fitter.errors(motion) ** 2, axis=0) < _NEAR * before
    if not near.any():
        return fitted
    begin = replace(fitted.point, chain=np.where(near[:, None], file, chain))
    fitter.anchor(begin)
    after = np.mean(fitter.errors(fitter.motions([begin])[0]) ** 2, axis=0)
    better = near & (after < before)
    fitter.other = other
    if not better.any():
        return fitted
    point = replace(fitted.point, chain=np.where(better[:, None], file, chain))
    start = [
        one.at(point) if one.field in TORQUES and better[one.joint] else mean
        for one, mean in zip(fitted.free, fitted.start, strict=True)
    ]
    noise = noise_of(fitted.errors, fitter.rows, _LEAST_ERROR * np.ones(len(chain)))
    return fitter.settled(point, fitted.free, np.array(start), noise, _ROUNDS // 2, "torques of the file")


def _alike(fitter: Fitter, fitted: Fitted, nominal: Point) -> Fitted:
    """Drives to which the file gives one gain are servos of one kind: joints whose motion says nothing of the
    scale of their torques, as light ones, have that of the others (the median of the gains)."""
    gain, torques = FIELDS.index("command_gain"), np.array([FIELDS.index(name) for name in TORQUES])
    if not any(f.field == "command_gain" for f in fitted.free):
        return fitted
    chain, scaled = fitted.point.chain, fitted.point.chain.copy()
    for of_file in np.unique(nominal.chain[:, gain]):
        kind = np.flatnonzero(nominal.chain[:, gain] == of_file)
        if kind.size >= _KIND:
            scaled[np.ix_(kind, torques)] *= (np.median(chain[kind, gain]) / chain[kind, gain])[:, None]
    motion = fitter.motions([replace(fitted.point, chain=scaled)])[0]
    before, after = (np.mean(errors**2, axis=0) for errors in (fitted.errors, fitter.errors(motion)))
    unseen = (after < (1.0 + _SAME_SQUARES) * before) & np.any(scaled != chain, axis=1)
    if not unseen.any():
        return fitted
    point = replace(fitted.point, chain=np.where(unseen[:, None], scaled, chain))
    free, start = list(fitted.free), fitted.start.copy()
    for k, one in enumerate(free):
        if one.field in TORQUES and unseen[one.joint]:
            start[k] = one.at(point)
            free[k] = replace(one, prior=_ALIKE) if one.field == "command_gain" else one
    noise = noise_of(fitted.errors, fitter.rows, _LEAST_ERROR * np.ones(len(chain)))
    return fitter.settled(point, free, start, noise, _ROUNDS // 2, "scale of the torques")
