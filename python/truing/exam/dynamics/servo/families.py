# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Families of servo arms: nothing, one effect, confounded by design, unlisted, withheld."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from truing.exam.dynamics.robots import Floats
from truing.exam.dynamics.scenes import TRIES, Case
from truing.exam.dynamics.servo.effects import LISTED, UNLISTED, USUAL, Hidden, Maker
from truing.exam.dynamics.servo.sizing import BARE, SAME
from truing.exam.dynamics.servo.stage import Stage, drawn, make_case, of_joints, placed, stage
from truing.exam.scenes import NoSetError, Request

SIZES = (0.03, 0.03, 0.01, 0.10)
"""Of effects, by number: rms of the change of the motion over rms of the motion."""
_BEYOND = 0.75
"""Share of an unlisted effect that no listed one may explain."""
_NEEDS = {"thermal_friction": frozenset({"temperature"}), "supply_sag": frozenset({"supply"})}
_RIGHT = USUAL | {"payload"}
"""Effects that are asked for where all else is as it is handed over."""


def none(request: Request) -> Case:
    """Nothing; in half of the sets the usual parameters that are handed over are wrong."""
    case = make_case(stage(request, wrong=request.number % 2 == 1), None)
    if case is None:
        raise NoSetError("the arm cannot be driven")
    return case


def single(request: Request) -> Case:
    names = sorted(LISTED)
    return _hide(request, names, names[(request.number // len(SIZES)) % len(names)], LISTED)


def _hide(
    request: Request,
    names: list[str],
    name: str,
    makers: Mapping[str, Maker],
    withheld: frozenset[str] = frozenset(),
    fits: Callable[[Case], bool] = lambda case: True,
) -> Case:
    rng, size = request.rng, SIZES[request.number % len(SIZES)]
    for tried in range(TRIES):
        if tried % 8 == 7:  # it cannot be had at this size
            name = str(rng.choice(names))
        wrong = name not in _RIGHT and rng.random() < 0.5
        st = stage(request, wrong=wrong, needs=_NEEDS.get(name, frozenset()))
        use = st.view.usage()
        hidden = drawn(st, name, use, makers)
        found = placed(st, hidden, size) if hidden else None
        case = make_case(st, found, size, withheld) if found else None
        if case is None:
            continue
        if fits(case):
            return case
        request.throw_away("not what its family asks for")
    raise NoSetError(f"no effect fits in {TRIES} draws")


# ---- Confounded by design ------------------------------------------------------------------------


@dataclass(frozen=True)
class Twins:
    """An effect, the names of what looks the same, and the share that these take up."""

    stage: Stage
    hidden: Hidden
    rivals: tuple[str, ...]
    absorbed: Callable[[Floats], float]


def _one_scale(request: Request) -> Twins:
    """A weaker drive at a single joint, and more weight where friction and rotor are unknown too."""
    st = stage(request, wrong=False, servo=of_joints(request, 1))
    heavier = st.view.changes([st.plant.at(0, weight=1.05)])[0]
    return Twins(
        st,
        LISTED["command_gain"](st.plant, st.view.usage(), 0, request.rng),
        ("gravity_scale", "payload"),
        lambda change: st.view.absorbed(change, "command_gain", heavier),
    )


def _one_mass(request: Request) -> Twins:
    """A payload at a single joint, and a weaker drive with its friction and its rotor."""
    st = stage(request, wrong=False, servo=of_joints(request, 1))
    return Twins(
        st,
        LISTED["payload"](st.plant, st.view.usage(), 0, request.rng),
        ("gravity_scale", "command_gain"),
        lambda change: st.view.absorbed(change, ""),
    )


def _slowly(request: Request) -> Twins:
    """A delay in motions so slow that damping does the same."""
    st = stage(request, wrong=False, kinds=("crawl",) * 7)
    joint = int(request.rng.integers(st.servo.n))
    return Twins(
        st,
        LISTED["delay"](st.plant, st.view.usage(), joint, request.rng),
        ("viscous", "damping_gain"),
        lambda change: st.view.absorbed(change, "delay"),
    )


TWINS = (_one_scale, _one_mass, _slowly)
_SEEN = 0.03
"""Size of a confounded effect before anything is fitted."""


def confounded(request: Request) -> Case:
    """An effect, and twins that these recordings cannot tell from it."""
    kind = TWINS[request.number % len(TWINS)]
    for _ in range(TRIES):
        twins = kind(request)
        st, hidden = twins.stage, twins.hidden
        one = placed(st, hidden, _SEEN, BARE)
        if one is None:
            continue
        absorbed = twins.absorbed(st.view.changes([hidden.made(st.plant, one.amplitude)])[0])
        if absorbed < SAME:
            request.throw_away("the twins differ here")
            continue
        joints = [f"J{j + 1}" for j in hidden.joints] or ["J1"]
        case = make_case(
            st,
            one,
            _SEEN,
            fitted=BARE,
            twin=kind.__name__.strip("_"),
            rivals=[{"effect": name, "joints": joints} for name in twins.rivals],
            absorbed=absorbed,
        )
        if case:
            return case
    raise NoSetError(f"no twins fit in {TRIES} draws")


# ---- No law, no column ---------------------------------------------------------------------------


def unlisted(request: Request) -> Case:
    """An effect in no catalogue, that no listed one explains."""
    makers = UNLISTED[request.which]
    names = list(makers)
    case = _hide(
        request,
        names,
        names[request.number % len(names)],
        makers,
        fits=lambda case: case.label["best_rival"]["share"] < _BEYOND,
    )
    return case


def missing(request: Request) -> Case:
    """Temperature or supply is withheld."""
    name = ("thermal_friction", "supply_sag")[request.number % 2]
    return _hide(request, [name], name, LISTED, withheld=_NEEDS[name])


FAMILIES: dict[str, Callable[[Request], Case]] = {
    "servo_none": none,
    "servo_single": single,
    "servo_confounded": confounded,
    "servo_unlisted": unlisted,
    "servo_missing": missing,
}
