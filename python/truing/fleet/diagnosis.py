# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The diagnosis of a fleet: what all arms of a type have, and which arms have what the others do not."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from truing import _core
from truing.effects import name_list
from truing.fleet.api import settings_of
from truing.fleet.fit import Fitted, Plan, Settings, arm_plan, fit, plan_of, shared_of
from truing.fleet.found import FleetIdentification, FleetParameter, found_in
from truing.fleet.gram import Gram
from truing.fleet.passes import Task, sum_all
from truing.fleet.search import Candidate, Choice, Named, NotTestable, Search, candidates_of
from truing.fleet.source import partitions_of
from truing.fleet.workers import Workers, workers_of

_GAIN = 0.02  # of its held-out error, that an arm's own effect must take away to be named
_MUCH_MORE = 1.5  # times the median arm's error, from which on an arm has something that nothing explains


@dataclass(frozen=True)
class FleetEffect:
    """An effect that was named, of all arms or of one."""

    effect: str
    joints: tuple[str, ...]
    nats: float  # log Bayes factor beyond the cost of having looked
    size_at_tip: float  # [m] rms motion of the tip by it, beyond what base, tool and zeros can do
    parameters: tuple[FleetParameter, ...]  # of one arm: nominal is what the other arms have
    confounded_with: tuple[str, ...]  # that would do as well


@dataclass(frozen=True)
class FleetDiagnosis:
    """What `truing.fleet.diagnose` found. `identification` is the fit with everything that was named."""

    sentence: str
    of_all: tuple[FleetEffect, ...]  # "all arms of this type"
    of_arms: Mapping[str, tuple[FleetEffect, ...]]  # "this arm": by its name
    scattered: tuple[str, ...]  # effects that many arms have, each to a size of its own
    unexplained: tuple[str, ...]  # arms with errors well above the others', which no effect explains
    not_testable: tuple[NotTestable, ...]
    identification: FleetIdentification


def diagnose(
    robot: _core.Robot,
    source: Any,
    client: Any = None,
    *,
    leave_out: str | Sequence[str] = (),
    one_arm: bool = False,
    loss: str = "reject",
    test_share: float = 0.2,
    seed: int = 0,
    skip_corrupt: bool = False,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> FleetDiagnosis:
    """Name what all arms of a type have, and the arms that have what the others do not.

        found = truing.fleet.diagnose(robot, "recordings/")
        found.of_all, found.of_arms["a017"]

    The shared geometry and each arm's base, tool and zeros are fitted first; then every effect of the
    catalogue that the columns can show competes at every joint, for all arms together and for each by itself,
    on Grams alone; what is named is fitted without linearisation.

    leave_out: effects that are not to be considered. All else is as in `truing.fleet.identify`, whose errors
    are raised.
    """
    settings = settings_of(
        free=(),
        hold=(),
        effects=(),
        loss=loss,
        test_share=test_share,
        seed=seed,
        skip_corrupt=skip_corrupt,
    )
    with workers_of(client, workers) as at_work:
        tell("looking at every row")
        plan = plan_of(at_work, partitions_of(source, one_arm=one_arm), robot, settings)
        return _diagnosed(at_work, plan, settings, name_list(leave_out), tell)


def _diagnosed(
    workers: Workers, plan: Plan, settings: Settings, leave_out: Sequence[str], tell: Callable[[str], None]
) -> FleetDiagnosis:
    first = fit(workers, plan, settings, tell)
    candidates, not_testable = candidates_of(
        plan.nominal, [arm.sample for arm in plan.arms.values()], leave_out
    )
    candidates = _visible(candidates, first)
    tell("the columns of every candidate")
    grams = _with_columns(workers, first, settings, candidates)
    tell("searching")
    choice = Search(grams, _layout_of(first, grams), candidates, _shifts(first)).run()
    of_all = replace(settings, effects=merged([r for c in _beside_links(choice) for r in c.requests]))
    second = _refitted(workers, first, of_all, choice, tell)
    found = found_in(second, of_all, workers.passes)
    found = replace(found, before=found_in(first, settings, 0).before)
    of_arms = _confirmed(choice, first, second)
    diagnosis = FleetDiagnosis(
        "",
        tuple(_effect_of_all(named, found) for named in choice.of_all),
        {name: tuple(_effect_of_arm(n, name, found) for n in named) for name, named in of_arms.items()},
        tuple(candidate.called for candidate in choice.scattered),
        _unexplained(second),
        tuple(not_testable),
        found,
    )
    return replace(diagnosis, sentence=sentence_of(diagnosis))


def _visible(candidates: Sequence[Candidate], first: Fitted) -> list[Candidate]:
    """Values of links that no row shows beyond base, tool and zeros are none that could be named."""
    shown = set(first.layout.shared)
    out = []
    for candidate in candidates:
        if not candidate.of_links:
            out.append(candidate)
        elif kept := tuple(name for name in candidate.parameters if name in shown):
            out.append(replace(candidate, parameters=kept))
    return out


# ---- Columns
# ---------------------------------------------------------------------------------------------------


def merged(requests: Sequence[_core.EffectRequest]) -> tuple[_core.EffectRequest, ...]:
    """One request for each effect, with all its joints."""
    joints: dict[str, list[str]] = {}
    for request in requests:
        at = joints.setdefault(request.effect, [])
        at += [joint for joint in request.joints if joint not in at]
    return tuple(_core.EffectRequest(effect, at) for effect, at in joints.items())


def _with_columns(
    workers: Workers, first: Fitted, settings: Settings, candidates: Sequence[Candidate]
) -> Mapping[str, Gram]:
    """A pass: Grams where the fit ended, with a column for every parameter of every candidate, at 0."""
    requests = merged([r for c in candidates for r in c.requests])
    wanted = {p for c in candidates for p in c.parameters}
    arms = {}
    for name, arm in first.plan.arms.items():
        at = dict(zip(arm.names, first.points[name], strict=True))
        every = _core.free_parameters(arm.start, arm.sample, free=["*"], effects=requests)
        taken = [p for p in every if p.name in wanted or p.name in at]
        judged = first.judged[name]
        where = dict(zip(arm.names, judged.judged, strict=True)) if judged.judged is not None else {}
        arms[name] = replace(
            judged,
            names=tuple(p.name for p in taken),
            point=np.array([at.get(p.name, p.value) for p in taken]),
            effects=requests,
            judged=np.array([where.get(p.name, p.value) for p in taken]) if where else None,
        )
    task = Task(first.plan.nominal, arms, settings.test_share, settings.seed, settings.rotation_length)
    sums = sum_all(workers, first.plan.source, task)
    return {name: sums.grams[name] for name in arms}


def _layout_of(first: Fitted, grams: Mapping[str, Gram]) -> Any:
    """The first fit's own unknowns, among the columns of these Grams."""
    arms = {}
    for name, place in first.layout.arms.items():
        names = first.plan.arms[name].names
        own = np.array([grams[name].names.index(names[k]) for k in place.own], dtype=np.intp)
        arms[name] = replace(place, own=own)
    return replace(first.layout, arms=arms)


def _shifts(first: Fitted) -> dict[str, float]:
    """How far the shared parameters were moved from the nominal type."""
    out: dict[str, float] = {}
    for name, arm in first.plan.arms.items():
        for k, parameter in enumerate(arm.names):
            if parameter in first.layout.shared and parameter not in arm.own:
                out[parameter] = float(first.points[name][k] - arm.point[k])
    return out


# ---- What was named, fitted without linearisation
# ---------------------------------------------------------------


def _beside_links(choice: Choice) -> list[Candidate]:
    """What all arms have, links aside, which are fitted anyway."""
    return [n.candidate for n in choice.of_all if not n.candidate.of_links]


def _refitted(
    workers: Workers, first: Fitted, settings: Settings, choice: Choice, tell: Callable[[str], None]
) -> Fitted:
    """The fit with everything that was named. The geometry is fitted already; it goes on from there."""
    shared = _beside_links(choice)
    if not shared and not choice.of_arms:
        return first
    also = [p for c in shared if not c.requests for p in c.parameters]
    arms = {}
    for name, arm in first.plan.arms.items():
        mine = [n.candidate for n in choice.of_arms.get(name, ())]
        plan = arm_plan(
            arm.start,
            arm.sample,
            arm.rows,
            settings,
            more=[p for c in mine for p in c.parameters],
            effects=merged([r for c in mine for r in c.requests]),
            also=also,
        )
        at = dict(zip(arm.names, first.points[name], strict=True))
        point = np.array([at.get(n, value) for n, value in zip(plan.names, plan.point, strict=True)])
        arms[name] = replace(plan, point=point)
    return fit(workers, replace(first.plan, arms=arms, shared=shared_of(arms)), settings, tell)


def _confirmed(choice: Choice, first: Fitted, second: Fitted) -> dict[str, tuple[Named, ...]]:
    """Arms whose held-out poses are predicted better with what they have by themselves, effects with them."""
    out = {}
    for name, named in choice.of_arms.items():
        before, after = first.grams[name].held_out, second.grams[name].held_out
        if before.n == 0 or after.rms < (1.0 - _GAIN) * before.rms:
            out[name] = named
    return out


def _effect_of_all(named: Named, found: FleetIdentification) -> FleetEffect:
    known = {p.name: p for p in found.parameters}
    return _effect(named, [known[p] for p in named.candidate.parameters if p in known])


def _effect_of_arm(named: Named, arm: str, found: FleetIdentification) -> FleetEffect:
    others = {p.name: p.value for p in found.parameters}
    mine = {p.name: p for p in found.arms[arm].parameters}
    parameters = [mine[p] for p in named.candidate.parameters if p in mine]
    return _effect(named, [replace(p, nominal=others.get(p.name, p.nominal)) for p in parameters])


def _effect(named: Named, parameters: Sequence[FleetParameter]) -> FleetEffect:
    return FleetEffect(
        named.candidate.effect,
        named.candidate.joints,
        named.nats,
        named.size_at_tip,
        tuple(parameters),
        tuple(rival.called for rival in named.rivals),
    )


def _unexplained(second: Fitted) -> tuple[str, ...]:
    """Arms that are left with an error well above the others'."""
    left = {name: gram.errors.quantile(0.5) for name, gram in second.grams.items()}
    usual = float(np.median(list(left.values())))
    return tuple(
        name for name, length in left.items() if math.isfinite(usual) and length > _MUCH_MORE * usual
    )


def called(effect: FleetEffect) -> str:
    """backlash J2"""
    return " ".join((effect.effect.replace("_", " "), *effect.joints))


def sentence_of(found: FleetDiagnosis) -> str:
    """The verdict in words."""
    count = len(found.identification.arms)
    all_of = ", ".join(called(effect) for effect in found.of_all)
    parts = [
        f"All {count} arms of this type: {all_of}."
        if all_of
        else f"Nothing that all {count} arms share was found."
    ]
    if found.of_arms:
        arms = [f"{name} {', '.join(map(called, effects))}" for name, effects in found.of_arms.items()]
        parts.append(f"By itself: {'; '.join(arms)}.")
    elif count > 1:
        parts.append("No arm differs from the others beyond its base, tool and zeros.")
    if found.scattered:
        parts.append(f"Of another size in every arm: {', '.join(found.scattered)}.")
    if found.unexplained:
        parts.append(f"With errors that nothing here explains: {', '.join(found.unexplained)}.")
    return " ".join(parts)
