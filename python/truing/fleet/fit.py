# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a fleet: Levenberg-Marquardt outside, a pass over the rows for every point that it looks at
inside.
"""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.gram import ROTATION_LENGTH, Gram
from truing.fleet.nested import Layout, damped_step, layout_of
from truing.fleet.passes import Arm, Sample, Sums, Task, chosen_rows, sample_all, sum_all
from truing.fleet.source import Source
from truing.fleet.workers import Workers
from truing.identification.api import identify as identify_one

Floats = NDArray[np.float64]

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-9, 1e-15, 1e12  # as `identify` has them
_ROUNDING = 1e-13  # of the cost: a smaller predicted fall is lost in the sums' rounding
# Of the noise's variance: a step that promises no more moves every parameter by less than a thousandth of its
# standard error.
_WORTH_A_PASS = 1e-6
IMPOSSIBLE, GROSS = 20.0, 6.0  # medians, as `identify` has them: of where a fit starts, and of what it leaves
_ROUNDS = 10  # of outliers found anew
# Of two unknowns of an arm that cannot be told apart the one of the lower number stays.
_PRIORITY = {"base": 0, "target": 0, "anchor": 0, "geometry": 1, "offset": 2, "ratio": 2, "effect": 3}


@dataclass(frozen=True)
class Settings:
    """What is asked for. Names and globs as in `identify`."""

    free: tuple[str, ...] = ()  # empty: all geometry and the targets
    hold: tuple[str, ...] = ()
    effects: tuple[_core.EffectRequest, ...] = ()  # of all arms
    own: tuple[str, ...] = ("*.offset",)  # what each arm has of its own, beside base, targets and anchor
    loss: str = "reject"  # or "none"
    test_share: float = 0.2
    seed: int = 0
    rotation_length: float = ROTATION_LENGTH
    max_iterations: int = 50
    skip_corrupt: bool = False


@dataclass(frozen=True)
class ArmPlan:
    """What one arm adds to the fit."""

    start: _core.Robot  # nominal, with base and targets fitted to a sample
    sample: _core.Measurements
    rows: int
    names: tuple[str, ...]  # of its Gram, in the order of its model
    point: Floats  # where the fit starts
    own: Mapping[str, int]  # unknowns of its own, with their priority
    effects: tuple[_core.EffectRequest, ...] = ()


@dataclass(frozen=True)
class Plan:
    """What is fitted, to which rows."""

    nominal: _core.Robot
    source: Source
    arms: Mapping[str, ArmPlan]
    shared: Mapping[str, int]  # unknowns of all arms, with their priority
    faults: tuple[str, ...]  # partitions that cannot be read
    notes: tuple[str, ...]  # what reading the others warns of


@dataclass(frozen=True)
class Fitted:
    """Where the fit ended."""

    plan: Plan
    layout: Layout
    points: Mapping[str, Floats]  # by arm, in the order of its names
    before: Mapping[str, Gram]  # where the fit started
    grams: Mapping[str, Gram]  # where it ended, with scores
    judged: Mapping[str, Arm]  # with the rows left out
    iterations: int
    converged: bool
    stopped_because: str
    faults: tuple[str, ...] = field(default=())

    @property
    def noise_variance(self) -> float:
        """Of one measured number, in its row's own sigma where rows have some, else [m^2]."""
        cost = sum(gram.rr for gram in self.grams.values())
        return cost / max(1.0, sum(g.values for g in self.grams.values()) - self.layout.unknowns)


# ---- What is fitted
# --------------------------------------------------------------------------------------------


def plan_of(workers: Workers, source: Source, nominal: _core.Robot, settings: Settings) -> Plan:
    """Looks at every row once: which arms there are, and where each fit may start."""
    found = sample_all(workers, source, nominal)
    refuse_faults(found.faults, settings.skip_corrupt, len(source.partitions))
    arms = {name: _arm_plan(nominal, name, found, settings) for name in sorted(found.rows)}
    return Plan(nominal, source, arms, shared_of(arms), found.faults, found.notes)


def shared_of(arms: Mapping[str, ArmPlan]) -> dict[str, int]:
    """Unknowns of all arms, with their priority."""
    shared: dict[str, int] = {}
    for arm in arms.values():
        roles = _roles(arm.start, arm.sample, arm.effects)
        shared |= {n: _PRIORITY[roles[n]] for n in arm.names if n not in arm.own}
    return shared


def refuse_faults(faults: Sequence[str], skip: bool, partitions: int) -> None:
    """Raises InputError that names the first partition that cannot be read, unless they are to be passed
    over.
    """
    if not faults or (skip and len(faults) < partitions):
        return
    more = f" ({len(faults) - 1} more partitions cannot be read)" if len(faults) > 1 else ""
    rest = (
        "none is left" if len(faults) == partitions else "--skip-corrupt (skip_corrupt=True) uses the others"
    )
    raise InputError(f"{faults[0]}{more}; {rest}")


def takes_constants_from_rows(
    robot: _core.Robot, data: _core.Measurements, request: _core.EffectRequest
) -> bool:
    """The law of an effect holds constants of the rows (a mean time, zones of torques, the middle of a
    range), of which each partition would take others. Two halves of the rows show it.
    """
    halves = np.array_split(np.arange(data.rows), 2)
    laws = [
        _core.robot_at(robot, chosen_rows(data, rows), (), np.zeros(0), [request]).effects for rows in halves
    ]
    constants = [[(e.effect, list(e.joints), dict(e.parameters)) for e in law] for law in laws]
    return constants[0] != constants[1]


def _refuse_laws_of_rows(robot: _core.Robot, sample: _core.Measurements, settings: Settings) -> None:
    for request in settings.effects:
        if takes_constants_from_rows(robot, sample, request):
            raise InputError(
                f"effects: the law of {request.effect} takes constants from the rows, each partition would"
                " take others: fit it with `truing identify`, arm by arm"
            )


def _arm_plan(nominal: _core.Robot, name: str, found: Sample, settings: Settings) -> ArmPlan:
    sample = found.data[name][0]
    targets = [f"{target.name}.*" for target in nominal.targets]
    held = [name for name in settings.hold if any(fnmatch.fnmatch(name, f"{t}*") for t in ("base", *targets))]
    try:
        start = identify_one(
            nominal, sample, free=targets, hold=held, test_share=0.0, threads=1, raise_if_not_converged=False
        ).robot
        _refuse_laws_of_rows(start, sample, settings)
        return arm_plan(start, sample, found.rows[name], settings)
    except InputError as error:
        raise InputError(f"arm {name}: {error}") from None


def arm_plan(
    start: _core.Robot,
    sample: _core.Measurements,
    rows: int,
    settings: Settings,
    more: Sequence[str] = (),
    effects: Sequence[_core.EffectRequest] = (),
    also: Sequence[str] = (),
) -> ArmPlan:
    """more: unknowns that only this arm has of its own; effects: that these belong to. also: more that all
    share.
    """
    requests = (*settings.effects, *(e for e in effects if not _asked(e, settings.effects)))
    asked = {
        p.name
        for p in _core.free_parameters(
            start, sample, free=settings.free, hold=settings.hold, effects=settings.effects
        )
    }
    own_globs = [*settings.own, *more]
    every = _core.free_parameters(start, sample, free=["*"], effects=requests)
    instrument = {p.name for p in every if p.role in ("base", "target", "anchor")} & asked
    asked |= {p.name for p in every} & set(also)
    held = {p.name for p in every if any(fnmatch.fnmatchcase(p.name, glob) for glob in settings.hold)}
    mine = {p.name for p in every if any(fnmatch.fnmatchcase(p.name, glob) for glob in own_globs)} - held
    taken = [p for p in every if p.name in asked | mine]
    return ArmPlan(
        start,
        sample,
        rows,
        tuple(p.name for p in taken),
        np.array([p.value for p in taken]),
        {p.name: _PRIORITY[p.role] for p in taken if p.name in instrument | mine},
        requests,
    )


def _asked(request: _core.EffectRequest, among: Sequence[_core.EffectRequest]) -> bool:
    return any(r.effect == request.effect and (not r.joints or r.joints == request.joints) for r in among)


def _roles(
    robot: _core.Robot, data: _core.Measurements, effects: Sequence[_core.EffectRequest]
) -> dict[str, str]:
    return {p.name: p.role for p in _core.free_parameters(robot, data, free=["*"], effects=effects)}


# ---- The iteration
# ---------------------------------------------------------------------------------------------


class _Search:
    """Where the fit stands; every look at another point is a pass."""

    def __init__(self, workers: Workers, plan: Plan, settings: Settings, tell: Callable[[str], None]) -> None:
        self.workers, self.plan, self.settings, self.tell = workers, plan, settings, tell
        self.points: dict[str, Floats] = {name: arm.point for name, arm in plan.arms.items()}
        self.judged = {
            name: Arm(arm.start, arm.names, arm.point, arm.effects) for name, arm in plan.arms.items()
        }
        self.iterations = 0
        self.faults: tuple[str, ...] = ()

    def look(self, points: Mapping[str, Floats], scores: bool = False) -> Mapping[str, Gram]:
        """A pass: the Grams at these points."""
        arms = {name: replace(arm, point=points[name]) for name, arm in self.judged.items()}
        s = self.settings
        self.tell(f"pass {self.workers.passes + 1}")
        task = Task(self.plan.nominal, arms, s.test_share, s.seed, s.rotation_length, scores)
        sums: Sums = sum_all(self.workers, self.plan.source, task)
        refuse_faults(sums.faults, s.skip_corrupt, len(self.plan.source.partitions))
        missing = [name for name in self.plan.arms if name not in sums.grams]
        if missing:
            raise InputError(f"arm {missing[0]}: its rows can no longer be read: {' '.join(sums.faults[:1])}")
        self.faults = sums.faults
        return {name: sums.grams[name] for name in self.plan.arms}

    def leave_out(self, grams: Mapping[str, Gram], medians: float) -> bool:
        """Rows with errors beyond so many medians of their arm's, where the fit stands, are left out from now
        on. False: there are none.
        """
        any_left_out = False
        for name, gram in grams.items():
            longest, widest = medians * gram.errors.quantile(0.5), medians * gram.turns.quantile(0.5)
            beyond = gram.errors.largest > longest or gram.turns.largest > widest
            any_left_out |= beyond
            self.judged[name] = replace(
                self.judged[name],
                judged=self.points[name] if beyond else None,
                longest=longest if beyond else math.inf,
                widest=widest if beyond and math.isfinite(widest) else math.inf,
            )
        return any_left_out

    def descend(self, grams: Mapping[str, Gram], layout: Layout) -> tuple[bool, str]:
        """Levenberg-Marquardt from where the fit stands. Whether it converged, and why it stopped."""
        mu = _FIRST_DAMPING
        cost = sum(gram.rr for gram in grams.values())
        values = sum(gram.values for gram in grams.values())
        while self.iterations < self.settings.max_iterations:
            step = damped_step(grams, layout, mu)
            trial = self._moved(grams, layout, step.shared, step.own)
            self.iterations += 1
            noise = cost / max(1, values - layout.unknowns)
            if step.fall <= max(_ROUNDING * cost, _WORTH_A_PASS * noise):
                self.points = trial  # too small for the cost to judge, or for another pass
                return True, "predicted fall of the cost far below the noise"
            there = self.look(trial)
            next_cost = sum(gram.rr for gram in there.values())
            if math.isfinite(next_cost) and next_cost < cost:
                self.points, grams, cost = trial, there, next_cost
                mu = max(mu / 10.0, _LEAST_DAMPING)
            elif mu >= _MOST_DAMPING:
                return False, "no step lowers the rms"
            else:
                mu = max(10.0 * mu, _LEAST_DAMPING)
        return False, "iteration limit"

    def _moved(
        self, grams: Mapping[str, Gram], layout: Layout, shared: Floats, own: Mapping[str, Floats]
    ) -> dict[str, Floats]:
        out: dict[str, Floats] = {}
        for name, place in layout.arms.items():
            point = self.points[name].copy()
            point[place.own] += own[name]
            point[place.shared] += shared[place.into]
            out[name] = point
        return out


def fit(
    workers: Workers, plan: Plan, settings: Settings, tell: Callable[[str], None] = lambda _: None
) -> Fitted:
    """Fits what the plan says. tell: is told which pass begins.

    The first least squares leaves out rows beyond 20 medians of where it starts; then rows beyond six medians
    of what it leaves, until the same ones are left out.
    """
    search = _Search(workers, plan, settings, tell)
    before = grams = search.look(search.points)
    rejecting = settings.loss != "none"
    if rejecting and search.leave_out(grams, IMPOSSIBLE):
        grams = search.look(search.points)
    layout = layout_of(grams, {name: arm.own for name, arm in plan.arms.items()}, plan.shared)
    _refuse_too_few(grams, layout)
    converged, why = search.descend(grams, layout)
    final = search.look(search.points, scores=True)
    for _ in range(_ROUNDS if rejecting else 0):
        marks = {name: gram.mark for name, gram in final.items()}
        if not search.leave_out(final, GROSS) and not any(marks.values()):
            break
        grams = search.look(search.points)
        if {name: gram.mark for name, gram in grams.items()} == marks:
            break
        converged, why = search.descend(grams, layout)
        final = search.look(search.points, scores=True)
    return Fitted(
        plan,
        layout,
        search.points,
        before,
        final,
        search.judged,
        search.iterations,
        converged,
        why,
        tuple(dict.fromkeys((*plan.faults, *search.faults))),
    )


def _refuse_too_few(grams: Mapping[str, Gram], layout: Layout) -> None:
    for name, place in layout.arms.items():
        if grams[name].values <= len(place.own):
            raise InputError(
                f"arm {name}: {grams[name].values} measured values cannot determine its own {len(place.own)}"
                " parameters: measure more poses, or leave the arm out"
            )
    values = sum(gram.values for gram in grams.values())
    if values <= layout.unknowns:
        raise InputError(
            f"{values} measured values cannot determine {layout.unknowns} parameters: measure more poses, or"
            " free fewer parameters"
        )
