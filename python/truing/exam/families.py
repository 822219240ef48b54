# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Families of sets: effects one by one, together, confounded, by other laws, unlisted, withheld, in few
poses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from truing.exam import laws
from truing.exam.confounded import Twin, twins
from truing.exam.design import Plan
from truing.exam.kinematics import Chain, Floats, chain_of
from truing.exam.laws import LISTED, Hidden
from truing.exam.robots import specimens
from truing.exam.scenes import (
    GEOMETRIC,
    LARGEST,
    NEED_MASSES,
    SMALLEST,
    TRIES,
    Case,
    NoSetError,
    Request,
    Scene,
    acceptable_for,
    draw_effect,
    draw_name,
    draw_size,
    make_case,
    make_scene,
    named_effect,
    other_names,
    places_of,
    sized,
    true_chain,
)
from truing.exam.sizing import SAME, View, drifts, explained, rivals
from truing.exam.surprises import Surprise, surprises

# ---- Families ------------------------------------------------------------------------------------


def _none(request: Request) -> Case:
    """Nothing is wrong: white noise, a wandering frame, heavy tails, gross errors."""
    kind = ("white", "drift", "heavy", "outliers")[request.number % 4]
    scene = make_scene(request, "departures", needs=frozenset({"t"}) if kind == "drift" else frozenset())
    if kind != "drift":
        scene.noise_kind = kind
        return make_case(scene, [], [], kind=kind)
    view = View(scene.context)
    for _ in range(TRIES):
        hidden = laws.drifting(str(request.rng.choice(["wandering", "dying"])), request.rng)
        drawn = sized(scene, hidden, view, draw_size(request.rng, 0.7, 5.0))
        if drawn:
            return make_case(scene, [drawn[0]], [view.rms(drawn[1]) / scene.sigma], kind=kind)
    raise NoSetError(f"no drift fits in {TRIES} draws")


def source_of_single(number: int) -> str:
    return ("physics", "physics", "departures", "spike")[number % 4]


def _single(request: Request) -> Case:
    source = source_of_single(request.number)
    geometry = source != "spike" and request.rng.random() < 1 / 3
    return one_effect(request, source, geometry=geometry, depart=0.15 if source == "departures" else 0.0)


def one_effect(
    request: Request,
    source: str,
    *,
    geometry: bool = False,
    depart: float = 0.0,
    poses: int | None = None,
    sizes: tuple[float, float] = (SMALLEST, LARGEST),
    names: Sequence[str] = (),
    withheld: bool = False,
    reshape: Callable[[Plan, Chain, Generator], Plan] | None = None,
) -> Case:
    """One listed effect; `withheld`: without the column that it needs."""
    rng = request.rng
    for _ in range(TRIES):
        name = (
            str(rng.choice(list(names)))
            if names
            else draw_name(rng, source, without=GEOMETRIC if geometry else frozenset())
        )
        needs = needs_of(name, rng)
        scene = make_scene(
            request,
            source,
            poses=poses,
            needs=needs,
            masses=True if name in NEED_MASSES else None,
            geometry=geometry,
            reshape=reshape,
        )
        view = View(scene.context, geometry)
        drawn = draw_effect(scene, name, view, draw_size(rng, *sizes), depart)
        if drawn is None:
            continue
        hidden, moved = drawn
        if withheld:
            scene.handed = scene.handed - needs
        acceptable = acceptable_for(scene, view, hidden, moved)
        return make_case(
            scene,
            [hidden],
            [view.rms(moved) / scene.sigma],
            acceptable=acceptable,
            **({"withheld": sorted(needs)} if withheld else {}),
        )
    raise NoSetError(f"no effect fits in {TRIES} draws")


def needs_of(name: str, rng: Generator) -> frozenset[str]:
    """Columns without which an effect cannot be found."""
    needed = LISTED[name](6, np.random.default_rng(0)).needs - {"masses"}
    if name in ("joint_compliance", "link_compliance") and rng.random() < 0.6:
        needed |= {"payload"}
    return frozenset(needed)


def _double(request: Request) -> Case:
    """Two effects, or three; under half of them wrong link values on every joint."""
    rng = request.rng
    geometry = request.number % 2 == 1
    count = 3 if request.number % 5 == 4 else 2
    for _ in range(TRIES):
        names = [draw_name(rng, "physics", without=GEOMETRIC | {"transmission_error"}) for _ in range(count)]
        needs = frozenset().union(*(needs_of(name, rng) for name in names))
        masses = True if NEED_MASSES & set(names) else None
        scene = make_scene(
            request,
            "physics",
            needs=needs,
            masses=masses,
            geometry=geometry,
            poses=request.poses(200, 300, 400),
        )
        view = View(scene.context, geometry)
        drawn = [draw_effect(scene, name, view, draw_size(rng, 1.5)) for name in names]
        complete = [item for item in drawn if item is not None]
        if len(complete) < count or clash([item[0] for item in complete]):
            continue
        sizes = apart(view, [moved for _, moved in complete], scene.sigma)
        if min(sizes) >= 1.0:
            acceptable = acceptable_for_each(scene, view, complete)
            return make_case(scene, [hidden for hidden, _ in complete], sizes, acceptable=acceptable)
        request.throw_away("one effect hides another")
    raise NoSetError(f"no two effects fit in {TRIES} draws")


def acceptable_for_each(
    scene: Scene, view: View, drawn: Sequence[tuple[Hidden, Floats]]
) -> list[dict[str, Any]]:
    """Other answers that are as right, each of them for its own effect. drawn: effects in the label's
    order, and how each moves the tips, shape=(n, 3) [m].
    """
    return [
        item
        for of, (hidden, moved) in enumerate(drawn)
        for item in acceptable_for(scene, view, hidden, moved, of)
    ]


def clash(hidden: Sequence[Hidden]) -> bool:
    """The same effect twice at one joint, or two springs or two gaps there."""
    kind = {"joint_compliance": "spring", "windup": "spring", "backlash": "gap", "gravity_backlash": "gap"}
    places = [(kind.get(h.effect, h.effect), h.joints) for h in hidden]
    return len(set(places)) < len(places)


def apart(view: View, moved: Sequence[Floats], sigma: float) -> list[float]:
    """Size over noise of each effect, counting only what the others do not explain."""
    found = []
    for k, own in enumerate(moved):
        share = explained(view, own, [other for j, other in enumerate(moved) if j != k])
        found.append(view.rms(own) * float(np.sqrt(max(1.0 - share, 0.0))) / sigma)
    return found


def _confounded(request: Request) -> Case:
    """Two effects that this way of measuring cannot tell apart."""
    rng = request.rng
    kinds = twins()
    for _ in range(TRIES):
        every = request.specimens()
        specimen = every[int(rng.integers(len(every)))]  # not every twin fits every robot
        kind = kinds[request.number % len(kinds)]
        twin = kind(specimen, true_chain(specimen, rng), rng)
        if twin is None:
            continue
        scene = make_scene(request, "physics", specimen=specimen, plan=twin.plan, only=twin.handed)
        view = View(scene.context)
        wanted = draw_size(rng, 1.5)
        drawn = sized(scene, twin.hidden, view, wanted)
        if drawn and not twin.exact:  # as small as it must be for nobody to see the difference
            wanted = min(wanted, _too_small_to_tell(view, drawn[1], twin))
            drawn = sized(scene, twin.hidden, view, wanted) if wanted >= 1.0 else None
        if drawn:
            hidden, moved = drawn
            rival = named_effect(scene.chain, twin.rival, (twin.rival_joint,))
            # What looks like one of them looks like the other: it stands for none of the two.
            looks = acceptable_for(scene, view, hidden, moved, None)
            told = {"of": None, **rival}
            own = [{**item, "of": 0} for item in other_names(scene, hidden)]
            acceptable = [told, *own, *(item for item in looks if item != told)]
            return make_case(
                scene,
                [hidden],
                [view.rms(moved) / scene.sigma],
                acceptable=acceptable,
                twin=kind.__name__.strip("_"),
                rival=rival,
                rival_names=_other_names_of_rival(scene, twin),
            )
    raise NoSetError(f"no twins fit in {TRIES} draws")


def _other_names_of_rival(scene: Scene, twin: Twin) -> list[dict[str, Any]]:
    """What the twin may be called besides its own name."""
    if twin.rival_joint < 0:
        return []
    return other_names(scene, LISTED[twin.rival](twin.rival_joint, np.random.default_rng(0)))


def _too_small_to_tell(view: View, moved: Floats, twin: Twin) -> float:
    """Size over noise up to which an effect and its twin differ by less than two standard errors. 0: they do
    not look alike.
    """
    for rival in rivals(view, twin.handed):
        if rival.effect == twin.rival and rival.joint == twin.rival_joint:
            different = 1.0 - explained(view, moved, rival.columns)
            return (
                float(np.sqrt(4.0 / max(different * view.context.n, 1e-12)))
                if different < 1.0 - SAME
                else 0.0
            )
    return 0.0


def _wrong_law(request: Request) -> Case:
    """The right effect by a law that nobody wrote down."""
    rng = request.rng
    name = (
        "joint_compliance",
        "thermal_zero",
        "backlash",
        "harmonic",
        "transmission_error",
        "joint_compliance",
        "drift",
        "thermal",
    )[request.number % 8]
    if name == "joint_compliance" and request.number % 16 >= 8:
        return _dead_band(request)
    depart = {
        "joint_compliance": 0.9,
        "thermal_zero": 0.7,
        "thermal": 0.7,
        "backlash": 0.9,
        "harmonic": 0.6,
        "transmission_error": 0.8,
        "drift": 0.8,
    }[name]
    return one_effect(
        request,
        "departures" if request.number % 3 else "physics",
        names=[name],
        depart=depart * float(rng.uniform(0.7, 1.0)),
        sizes=(1.0, 10.0),
    )


def _dead_band(request: Request) -> Case:
    rng = request.rng
    for _ in range(TRIES):
        scene = make_scene(request, "physics", masses=True, needs=frozenset({"payload"}))
        view = View(scene.context)
        place = int(rng.choice(places_of("joint_compliance", scene)))  # every robot has a loaded joint
        drawn = sized(scene, laws.dead_band(place, rng), view, draw_size(rng, 1.0))
        if drawn:
            return make_case(
                scene,
                [drawn[0]],
                [view.rms(drawn[1]) / scene.sigma],
                acceptable=acceptable_for(scene, view, *drawn),
            )
    raise NoSetError(f"no effect fits in {TRIES} draws")


def _unlisted(request: Request) -> Case:
    """An effect that stands in no catalogue, and that no listed one explains."""
    kinds = surprises(request.which)
    kind = kinds[request.number % len(kinds)]
    for _ in range(TRIES):
        needs = surprise_needs(request, kind)
        scene = make_scene(request, "departures", needs=needs)
        case = unlisted_effect(scene, kind, View(scene.context))
        if case:
            return case
    raise NoSetError(f"no unlisted effect fits in {TRIES} draws")


def unlisted_effect(scene: Scene, make: Surprise, view: View, **more: Any) -> Case | None:
    """An unlisted effect at some joint that turns. None: it is not of its size, or a listed one explains it.
    more: goes into the label.
    """
    chain, rng = scene.chain, scene.request.rng
    hidden = make(chain, int(rng.choice(chain.revolute)), rng)
    drawn = sized(scene, hidden, view, draw_size(rng, 1.0))
    if drawn is None:
        return None
    if not beyond(view, drawn[1], scene.handed):
        scene.request.throw_away("a listed effect explains the unlisted one")
        return None
    return make_case(
        scene,
        [drawn[0]],
        [view.rms(drawn[1]) / scene.sigma],
        unlisted=hidden.effect,
        unlisted_joint=chain.names[hidden.joints[0]] if hidden.joints else "base",
        unlisted_inputs=list(hidden.inputs),
        **more,
    )


def surprise_needs(request: Request, kind: Surprise) -> frozenset[str]:
    chain = chain_of(specimens(request.which)[0].robot)
    return kind(chain, chain.driven[-1], np.random.default_rng(0)).needs


def beyond(view: View, moved: Floats, handed: frozenset[str]) -> bool:
    """No listed effect, and no wrong geometry as a whole, explains most of it. A first joint that creeps is
    a base that turns about the same axis: a drift, though not an even one.
    """
    others = [rival.columns for rival in rivals(view, handed)]
    if "t" in handed:
        others.append(tuple(drifts(view)))
    return all(explained(view, moved, columns) < 0.75 for columns in others)


def source_of_missing(number: int) -> str:
    return "spike" if number % 8 == 0 else "physics"


def _missing(request: Request) -> Case:
    """The column that the effect needs is withheld."""
    names = (("backlash",), ("thermal_zero", "thermal"), ("windup",), ("time_offset", "backlash"))[
        request.number % 4
    ]
    spike = source_of_missing(request.number) == "spike"
    return one_effect(
        request,
        source_of_missing(request.number),
        names=names if not spike else ["backlash"],
        sizes=(1.5, 10.0),
        withheld=True,
    )


def _twenty(request: Request) -> Case:
    """Twenty poses only."""
    return one_effect(request, "physics" if request.number % 2 else "departures", poses=20, sizes=(2.0, 10.0))


FAMILIES: dict[str, Callable[[Request], Case]] = {
    "none": _none,
    "single": _single,
    "double": _double,
    "confounded": _confounded,
    "wrong_law": _wrong_law,
    "unlisted": _unlisted,
    "missing": _missing,
    "twenty": _twenty,
}
