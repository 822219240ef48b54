# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Families of the dynamic half: nothing, one effect, two, confounded by design, by other laws, unlisted,
withheld.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics import motions, spike_in
from truing.exam.dynamics.departures import DEPARTURES, FAR, UNLISTED
from truing.exam.dynamics.laws import LISTED, Hidden
from truing.exam.dynamics.robots import Arm, Floats, arms
from truing.exam.dynamics.scenes import (
    INERTIAL,
    TRIES,
    Case,
    Drive,
    Placed,
    Stage,
    draw_hidden,
    draw_size,
    hide_one,
    make_case,
    placed,
    stage,
    usual_drives,
)
from truing.exam.dynamics.sizing import best_share, rivals
from truing.exam.scenes import NoSetError, Request

_BEYOND = 0.75
"""Share of an unlisted effect that no listed one may explain."""


def kind_of_none(number: int) -> str:
    return ("coloured", "white", "recorded")[number % 3]


def none(request: Request) -> Case:
    """Usual friction only; in half of the driven sets wrong inertials are handed over."""
    kind = kind_of_none(request.number)
    if kind == "recorded":
        return spike_in.quiet(request)
    st = stage(request, noise_kind=kind, inertials=(request.number // 3) % 2 == 1)
    case = make_case(st, [], kind=kind)
    if case is None:
        raise NoSetError("the arm cannot be driven")
    return case


def source_of_single(number: int) -> str:
    return ("physics", "physics", "departures", "spike")[number % 4]


def single(request: Request) -> Case:
    source = source_of_single(request.number)
    if source == "spike":
        return spike_in.spike(request)
    makers = LISTED if source == "physics" else DEPARTURES
    return hide_one(request, list(makers), makers, source=source)


def double(request: Request) -> Case:
    """Two effects of one to three times the noise."""
    rng = request.rng
    for _ in range(TRIES):
        first, second = (str(name) for name in rng.choice(sorted(LISTED), 2, replace=False))
        inertial = bool({first, second} & INERTIAL)
        st = stage(request, needs=frozenset({"temperature"}), inertials=not inertial and rng.random() < 0.5)
        view = st.view(st.reference)
        sizes = [draw_size(rng, 1.0), draw_size(rng, 1.0)]
        drawn = [draw_hidden(st, name) for name in (first, second)]
        found = [placed(st, view, h, size) for h, size in zip(drawn, sizes, strict=True) if h is not None]
        ready = [one for one in found if one is not None]
        if len(ready) < 2 or sum(bool(one.hidden.arm or one.hidden.gearing) for one in ready) > 1:
            request.throw_away("two effects do not fit")
            continue
        case = make_case(st, ready, wanted=sizes)
        if case and not _one_explains_the_other(case):
            return case
    raise NoSetError(f"no two effects fit in {TRIES} draws")


def _one_explains_the_other(case: Case) -> bool:
    names = [(item["effect"], tuple(item["joints"])) for item in case.label["effects"]]
    looks = {(item["effect"], tuple(item["joints"])) for item in case.label["acceptable"]}
    return bool(looks & set(names))


# ---- Confounded by design ------------------------------------------------------------------------


def _first_rotor(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """A rotor of the first joint, and the first link's inertia about its axis: exactly the same. (Not so at
    the last joint, whose link turns with all others.)
    """
    st = stage(request)
    return st, LISTED["armature"](st.arm, 0, request.rng), _rival("link_inertia", [0])


def _last_load(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """A payload in all recordings, and a last link that is heavier: exactly the same."""
    st = stage(request)
    return st, LISTED["payload"](st.arm, 0, request.rng), _rival("link_inertia", [st.arm.n - 1])


def _short_spring(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """A spring seen over a short travel, and a wave of first order."""
    rng = request.rng
    every = arms(request.which)
    arm = every[int(rng.integers(len(every)))]
    joint = 1 if arm.axes[0][2] else 0
    drives = [
        Drive(f"fourier_{k + 1}", part, motions.short(arm, rng, 10.0, joint, 0.3))
        for k, part in enumerate(("train", "train", "train", "test", "fresh"))
    ]
    st = stage(request, arm=arm, drives=drives)
    return st, DEPARTURES["spring"](arm, joint, rng), _rival("ripple", [joint])


def _one_order(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """Temperature that rises with time, the same in every recording."""
    st = stage(request, needs=frozenset({"temperature"}), warmth=_evenly)
    joint = int(request.rng.integers(st.arm.n))
    return st, DEPARTURES["thermal_friction"](st.arm, joint, request.rng), _rival("warmup", [joint])


def _evenly(rng: Generator, t: Floats, power: Floats, step: float) -> Floats:
    return np.asarray(np.repeat((22.0 + 0.8 * t)[:, None], power.shape[1], axis=1))


def _gauge(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """All drives by one factor, and all masses by one factor: without a known payload exactly the same."""
    st = stage(request)
    side = float(request.rng.choice([-1.0, 1.0]))
    every = tuple(range(st.arm.n))
    hidden = Hidden("motor_constant", every, lambda s: side * s.total, largest=0.35, meter=True)
    return st, hidden, _rival("link_inertia", list(every))


def _first_weight(request: Request) -> tuple[Stage, Hidden, dict[str, object]]:
    """A wave of first order at the first joint that carries weight, and its link's centre of mass."""
    st = stage(request)
    joint = 1 if st.arm.axes[0][2] else 0
    phase = request.rng.uniform(-np.pi, np.pi)
    hidden = Hidden("ripple", (joint,), lambda s: s.at(joint, np.sin(s.motion.q[:, joint] + phase)))
    return st, hidden, _rival("link_inertia", [joint])


def _rival(effect: str, joints: list[int]) -> dict[str, object]:
    return {"effect": effect, "joints": [f"J{j + 1}" for j in joints]}


TWINS = (_first_rotor, _last_load, _short_spring, _one_order, _gauge, _first_weight)


def confounded(request: Request) -> Case:
    """An effect and a twin that these recordings cannot tell apart, by the examiner's own columns."""
    kind = TWINS[request.number % len(TWINS)]
    for _ in range(TRIES):
        st, hidden, rival = kind(request)
        size = draw_size(request.rng, 1.0)
        found = placed(st, st.view(st.reference), hidden, size)
        case = found and make_case(st, [found], wanted=[size], twin=kind.__name__.strip("_"), rival=rival)
        if not case:
            continue
        looks = [(item["effect"], item["joints"]) for item in case.label["acceptable"]]
        if kind is _gauge or (rival["effect"], rival["joints"]) in looks:
            return case
        request.throw_away("the twins differ here")
    raise NoSetError(f"no twins fit in {TRIES} draws")


# ---- Other laws, no law, no column ---------------------------------------------------------------


def wrong_law(request: Request) -> Case:
    """A listed effect by a law far from the textbook's."""
    names = list(FAR)
    return hide_one(
        request, [names[request.number % len(names)]], FAR, source="departures", sizes=(1.0, 2.0, 3.0)
    )


def unlisted(request: Request) -> Case:
    """An effect in no catalogue, that no listed one explains."""
    makers = UNLISTED[request.which]
    names = list(makers)
    name = names[request.number % len(names)]
    rng = request.rng
    for _ in range(TRIES):
        st = stage(request, inertials=rng.random() < 0.5)
        view = st.view(st.reference)
        hidden = draw_hidden(st, name, makers)
        size = draw_size(rng, 1.0)
        found = placed(st, view, hidden, size) if hidden else None
        if not found or not hidden or not _beyond(st, found):
            request.throw_away("a listed effect explains the unlisted one")
            continue
        joint = f"J{hidden.joints[0] + 1}"
        case = make_case(
            st,
            [found],
            source="departures",
            rivalry=False,
            wanted=[size],
            unlisted=hidden.effect,
            unlisted_joint=joint,
            unlisted_inputs=list(hidden.inputs),
        )
        if case:
            return case
    raise NoSetError(f"no unlisted effect fits in {TRIES} draws")


def _beyond(st: Stage, one: Placed) -> bool:
    """No listed effect explains most of it."""
    view = st.view(st.reference)
    assert one.hidden.law is not None
    column = view.stacked([one.amplitude * one.hidden.law(s) for s in view.scenes])
    return all(
        best_share(view, column, rival) < _BEYOND for rival in rivals(view, one.hidden.joints, st.handed)
    )


def source_of_missing(number: int) -> str:
    return "spike" if number % 4 == 3 else "physics"


def missing(request: Request) -> Case:
    """Temperature or payload is withheld: from arms that are driven, and from a real one."""
    if source_of_missing(request.number) == "spike":
        return spike_in.payload_withheld(request)
    if request.number % 2:
        return hide_one(request, ["payload"], staged=lambda _: _sometimes_loaded(request), withheld=_LOAD)
    return hide_one(
        request,
        ["thermal_friction"],
        sizes=(1.0, 2.0, 3.0),
        withheld=frozenset({"temperature"}),
        staged=lambda _: stage(request, needs=frozenset({"temperature"})),
    )


_LOAD = frozenset({"payload"})


def _sometimes_loaded(request: Request) -> Stage:
    """A payload in half of the recordings."""
    every = arms(request.which)
    arm: Arm = every[int(request.rng.integers(len(every)))]
    drives = [
        replace(drive, loaded=number % 2 == 1) for number, drive in enumerate(usual_drives(arm, request.rng))
    ]
    return stage(request, arm=arm, drives=drives)


FAMILIES: dict[str, Callable[[Request], Case]] = {
    "none": none,
    "single": single,
    "double": double,
    "confounded": confounded,
    "wrong_law": wrong_law,
    "unlisted": unlisted,
    "missing": missing,
}
