# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet's fit found: of all arms, and of each."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.fleet.fit import Fitted, Settings
from truing.fleet.gram import ErrorCounts, Gram
from truing.fleet.nested import Covariance, covariance
from truing.fleet.source import first_notes

Floats = NDArray[np.float64]

_FRAME = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class FleetParameter:
    """A parameter of all arms or of one, in `unit`. sigma: standard error; NaN: held where it was."""

    name: str
    unit: str
    nominal: float
    value: float
    sigma: float

    @property
    def frozen(self) -> bool:
        """Held, because the rows do not show it."""
        return math.isnan(self.sigma)


@dataclass(frozen=True)
class Frozen:
    """What the rows do not show: moving these together changes no measurement. `parameter` is held."""

    parameter: str
    combination: Mapping[str, float]
    why: str


@dataclass(frozen=True)
class Errors:
    """Errors of the rows that were fitted, and of those held out; rotation errors beside them [rad]."""

    fitted: ErrorCounts
    held_out: ErrorCounts
    turns: ErrorCounts
    held_out_turns: ErrorCounts

    @classmethod
    def of(cls, grams: Sequence[Gram]) -> Errors:
        def added(name: str) -> ErrorCounts:
            parts: list[ErrorCounts] = [getattr(gram, name) for gram in grams]
            return functools.reduce(lambda a, b: a + b, parts)

        return cls(added("errors"), added("held_out"), added("turns"), added("held_out_turns"))


@dataclass(frozen=True)
class ArmFound:
    """One arm: its robot (the shared geometry with its own base, tool and zeros), and what is its own."""

    name: str
    robot: _core.Robot
    parameters: tuple[FleetParameter, ...]  # its own, base and orientations of targets aside
    base_sigma: Floats  # shape=(6,) x y z [m], turns about the measurement frame's axes [rad]; NaN: held
    frozen: tuple[Frozen, ...]
    rows: int
    left_out: int  # rows far beyond the others' errors
    before: Errors  # base and targets fitted to a sample, the rest nominal
    after: Errors

    def parameter(self, name: str) -> FleetParameter:
        """The arm's own parameter of that name. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]


@dataclass(frozen=True)
class FleetIdentification:
    """What `truing.fleet.identify` found."""

    robot: _core.Robot  # of the type: nominal with what all arms share
    parameters: tuple[FleetParameter, ...]  # of all arms
    covariance: Floats  # shape=(n, n) of those that are not frozen, in their units
    frozen: tuple[Frozen, ...]
    arms: Mapping[str, ArmFound]
    before: Errors
    after: Errors
    noise_sigma: float  # of one measured number [m], of its row's own sigma where rows have some
    rows: int
    partitions: int
    skipped: tuple[str, ...]  # partitions that could not be read, and why
    warnings: tuple[str, ...]  # of what was read: the first twenty, and the number of the others
    iterations: int
    passes: int
    converged: bool
    stopped_because: str
    test_share: float
    seed: int

    def parameter(self, name: str) -> FleetParameter:
        """The shared parameter of that name. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]


def found_in(fitted: Fitted, settings: Settings, passes: int) -> FleetIdentification:
    """The answer of a fit in the user's terms."""
    layout, plan = fitted.layout, fitted.plan
    known = covariance(fitted.grams, layout)
    parameters = _shared_parameters(fitted, known)
    arms = {name: _arm_found(name, fitted, known) for name in plan.arms}
    value = {p.name: p.value for p in parameters}
    first = next(iter(plan.arms.values()))
    order = [
        p.name
        for p in _core.free_parameters(plan.nominal, first.sample, free=["*"], effects=settings.effects)
    ]
    names = [name for name in order if name in value]
    return FleetIdentification(
        robot=_core.robot_at(
            plan.nominal, first.sample, names, np.array([value[n] for n in names]), settings.effects
        ),
        parameters=parameters,
        covariance=known.shared,
        frozen=_shared_frozen(fitted),
        arms=arms,
        before=Errors.of(list(fitted.before.values())),
        after=Errors.of(list(fitted.grams.values())),
        noise_sigma=math.sqrt(fitted.noise_variance),
        rows=sum(arm.rows for arm in plan.arms.values()),
        partitions=len(plan.source.partitions),
        skipped=fitted.faults,
        warnings=first_notes(plan.notes, "rows"),
        iterations=fitted.iterations,
        passes=passes,
        converged=fitted.converged,
        stopped_because=fitted.stopped_because,
        test_share=settings.test_share,
        seed=settings.seed,
    )


def _shared_parameters(fitted: Fitted, known: Covariance) -> tuple[FleetParameter, ...]:
    """Every shared parameter, as the first arm has it that shares it."""
    sigma = dict(zip(fitted.layout.shared, np.sqrt(np.diag(known.shared)), strict=True))
    out: dict[str, FleetParameter] = {}
    for name, arm in fitted.plan.arms.items():
        units = fitted.grams[name].units
        for k, parameter in enumerate(arm.names):
            if parameter in arm.own or parameter in out:
                continue
            out[parameter] = FleetParameter(
                parameter,
                units[k],
                float(arm.point[k]),
                float(fitted.points[name][k]),
                float(sigma.get(parameter, math.nan)),
            )
    return tuple(out.values())


def _shared_frozen(fitted: Fitted) -> tuple[Frozen, ...]:
    return tuple(
        Frozen(
            name,
            combination,
            _together(name, combination)
            if combination
            else "what every arm has of its own (base, tool, zeros) does the same",
        )
        for name, combination in fitted.layout.frozen.items()
    )


def _together(name: str, combination: Mapping[str, float]) -> str:
    if len(combination) == 1:
        return "no measurement depends on it"
    return f"moving these together changes no measurement; {name} is held"


def _arm_found(name: str, fitted: Fitted, known: Covariance) -> ArmFound:
    arm, point, place = fitted.plan.arms[name], fitted.points[name], fitted.layout.arms[name]
    gram = fitted.grams[name]
    sigma = np.full(len(arm.names), math.nan)
    sigma[place.own] = np.sqrt(np.diag(known.own[name]))
    at = {parameter: k for k, parameter in enumerate(arm.names)}
    base = [sigma[at[f"base.{c}"]] if f"base.{c}" in at else math.nan for c in _FRAME]
    return ArmFound(
        name,
        _core.robot_at(arm.start, arm.sample, arm.names, point, arm.effects),
        _own_parameters(fitted, name, sigma),
        np.array(base),
        tuple(Frozen(p, c, _together(p, c)) for p, c in place.frozen.items()),
        arm.rows,
        gram.left_out,
        Errors.of([fitted.before[name]]),
        Errors.of([gram]),
    )


def _own_parameters(fitted: Fitted, arm_name: str, sigma: Floats) -> tuple[FleetParameter, ...]:
    """Base and turns of targets are left to the robot's frames: their values count from where the fit
    started.
    """
    arm, point, units = fitted.plan.arms[arm_name], fitted.points[arm_name], fitted.grams[arm_name].units
    nominal = {
        p.name: p.value
        for p in _core.free_parameters(fitted.plan.nominal, arm.sample, free=["*"], effects=arm.effects)
    }
    targets = [f"{target.name}.r" for target in arm.start.targets]
    return tuple(
        FleetParameter(name, units[k], nominal[name], float(point[k]), float(sigma[k]))
        for k, name in enumerate(arm.names)
        if name in arm.own
        and not name.startswith("base.")
        and not any(name.startswith(turn) for turn in targets)
    )
