# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Families that trials on real robots asked for: poses on a grid, 25 to 70 poses, mistakes in what is handed
over, laws that machines have, teeth, one cause on several joints, small companions.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import Generator

from truing.exam import laws, machine_laws
from truing.exam.design import Plan
from truing.exam.families import (
    acceptable_for_each,
    apart,
    clash,
    needs_of,
    one_effect,
    surprise_needs,
    unlisted_effect,
)
from truing.exam.kinematics import ALPHA, Chain, Floats, chain_of
from truing.exam.laws import Hidden
from truing.exam.names import accepted
from truing.exam.recordings import fit_frames
from truing.exam.scenes import (
    GEOMETRIC,
    NEED_MASSES,
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
    moved_by,
    named_effect,
    places_of,
    sensible,
    sized,
)
from truing.exam.sizing import View, explained
from truing.exam.surprises import surprises

_FEW_POSES = (25, 71)  # from, below
_PLAIN_MISTAKE = 20.0  # times the noise that a mistake must leave, else there is nothing to say
_FINE = (10, 41)  # angles of a joint on the grids that teeth are looked at on: from, below
_TRAVEL = 0.95  # [rad] either way, of an elbow that rods drive


def _once_per_try(request: Request, attempt: Callable[[], Case | None]) -> Case:
    for _ in range(TRIES):
        case = attempt()
        if case is not None:
            return case
    raise NoSetError(f"nothing fits in {TRIES} draws")


def gridded(
    plan: Plan, chain: Chain, rng: Generator, even: bool = True, steps: tuple[int, int] = (4, 10)
) -> Plan:
    """The same joints' ranges, but each joint stands at a few angles only, evenly spaced or not. steps: how
    many, from and below.
    """
    levels = []
    for low, high in zip(plan.low, plan.high, strict=True):
        count = int(rng.integers(*steps))
        span = float(rng.uniform(0.8, 1.0)) * (high - low)
        start = float(rng.uniform(low, high - span))
        inner = np.linspace(0.0, 1.0, count) if even else np.sort([0.0, 1.0, *rng.random(count - 2)])
        levels.append(start + span * np.asarray(inner))
    return replace(plan, levels=tuple(levels))


def _uneven(plan: Plan, chain: Chain, rng: Generator) -> Plan:
    return gridded(plan, chain, rng, even=False)


def _grid(request: Request) -> Case:
    """One listed effect, looked at on a grid of joint angles; half of the grids are even."""
    source = ("physics", "departures", "departures")[request.number % 3]
    depart = 0.15 if source == "departures" else 0.0
    reshape = gridded if request.number % 2 else _uneven
    return one_effect(request, source, depart=depart, sizes=(1.0, 10.0), reshape=reshape)


# ---- Few poses -----------------------------------------------------------------------------------


def _few(request: Request) -> Case:
    """25 to 70 poses of a robot with wrong link values: with nothing else, one effect, two, or an unlisted
    one.
    """
    kind = ("geometry", "one", "two", "unlisted")[request.number % 4]
    return _once_per_try(request, lambda: _few_of(request, kind))


def _few_of(request: Request, kind: str) -> Case | None:
    rng = request.rng
    poses = int(rng.integers(*_FEW_POSES))
    if kind == "unlisted":
        return _few_unlisted(request, poses)
    without = GEOMETRIC | {"transmission_error"}
    count = {"geometry": 0, "one": 1, "two": 2}[kind]
    names = [draw_name(rng, "departures", without=without) for _ in range(count)]
    needs = frozenset().union(*(needs_of(name, rng) for name in names))
    masses = True if NEED_MASSES & set(names) else None
    scene = make_scene(request, "departures", poses=poses, needs=needs, masses=masses, geometry=True)
    view = View(scene.context, True)
    drawn = [draw_effect(scene, name, view, draw_size(rng, 1.0), 0.15) for name in names]
    found = [item for item in drawn if item is not None]
    if len(found) < count or clash([hidden for hidden, _ in found]):
        return None
    acceptable = acceptable_for_each(scene, view, found)
    sizes = [view.rms(moved) / scene.sigma for _, moved in found]
    return make_case(scene, [hidden for hidden, _ in found], sizes, acceptable=acceptable, kind=kind)


def _few_unlisted(request: Request, poses: int) -> Case | None:
    rng = request.rng
    kinds = surprises(request.which)
    kind = kinds[int(rng.integers(len(kinds)))]
    needs = surprise_needs(request, kind)
    scene = make_scene(request, "departures", poses=poses, needs=needs, geometry=True)
    return unlisted_effect(scene, kind, View(scene.context, True), kind="unlisted")


# ---- Mistakes in what is handed over -------------------------------------------------------------


def _mistaken(request: Request) -> Case:
    """Two joint columns exchanged, a joint that counts the other way, or a table read in the other
    convention; under half of them wrong link values.
    """
    kind = ("exchanged", "sign", "convention")[request.number % 3]
    geometry = request.number % 2 == 1
    return _once_per_try(request, lambda: _mistake(request, kind, geometry))


def _mistake(request: Request, kind: str, geometry: bool) -> Case | None:
    rng = request.rng
    scene = make_scene(request, "departures", poses=request.poses(100, 150, 200, 300), geometry=geometry)
    driven = len(scene.chain.driven)
    columns = list(range(driven))
    signs = [1.0] * driven
    if kind == "exchanged":
        one, other = sorted(int(k) for k in rng.choice(driven, 2, replace=False))
        columns[one], columns[other] = other, one
    elif kind == "sign":
        one = other = int(rng.integers(driven))
        signs[one] = -1.0
    else:
        one = other = -1
        said = "dh" if scene.chain.mdh else "mdh"
        scene.robot = scene.robot.replace(convention=said)
    scene.columns_from = tuple(zip(columns, signs, strict=True))
    if _mistake_leaves(scene) < _PLAIN_MISTAKE * scene.sigma:
        request.throw_away("the mistake leaves nothing to see")
        return None
    joints = sorted({scene.chain.names[scene.chain.driven[k]] for k in (one, other) if k >= 0})
    return make_case(scene, [], [], kind=kind, mistake=kind, mistake_joints=joints)


def _mistake_leaves(scene: Scene) -> float:
    """Rms error of the robot as handed over, at the readings as handed over, once frames are fitted [m]."""
    tip, _ = scene.truth().observe(scene.inputs)
    readings = np.stack([s * scene.inputs.readings[:, k] for k, s in scene.columns_from], axis=1)
    inputs = replace(scene.inputs, readings=readings)
    chain = fit_frames(chain_of(scene.robot.replace(T_measurement_base=np.eye(4))), inputs, tip)
    rest = laws.Context(chain, inputs).state.tip - tip
    return float(np.sqrt(np.mean(np.sum(rest**2, axis=1))))


# ---- Laws that machines have ---------------------------------------------------------------------

MACHINES = ("rods", "elbow_rods", "warm_robot", "wobble_twice", "neighbour", "hard_spring")


def _machines(request: Request) -> Case:
    """A listed effect by the law that machines have."""
    kind = MACHINES[request.number % len(MACHINES)]
    return _once_per_try(request, lambda: _machine(request, kind))


def _machine(request: Request, kind: str) -> Case | None:
    rng = request.rng
    every = request.specimens()
    specimen = every[int(rng.integers(len(every)))]  # rods are not on every robot
    geometry = bool(rng.random() < 1 / 3)
    needs = {"warm_robot": frozenset({"temp"}), "hard_spring": frozenset({"payload"})}.get(kind, frozenset())
    scene = make_scene(
        request,
        "departures",
        specimen=specimen,
        needs=needs,
        masses=True if kind == "hard_spring" else None,
        geometry=geometry,
        reshape=_short_elbow if kind == "elbow_rods" else None,
    )
    hidden = _machine_law(scene, kind, rng)
    view = View(scene.context, geometry)
    drawn = sized(scene, hidden, view, draw_size(rng, 1.0)) if hidden else None
    if drawn is None:
        return None
    acceptable = acceptable_for(scene, view, *drawn)
    if kind == "neighbour" and _drags_the_wrist(scene, drawn[0]):
        acceptable.append({**named_effect(scene.chain, "joint_coupling", ()), "of": 0})
    size = view.rms(drawn[1]) / scene.sigma
    places = _places_of(scene, drawn[0])
    return make_case(scene, [drawn[0]], [size], acceptable=acceptable, kind=kind, places=places)


def _places_of(scene: Scene, hidden: Hidden) -> list[tuple[str, list[str]]]:
    """Joints and inputs at which it is rightly called unknown. A tilt is no joint's motion: the joints beside
    it, or the base, come nearest. A warm robot's links are at every joint.
    """
    names, inputs = scene.chain.names, list(hidden.inputs)
    if not hidden.joints:
        return [("", inputs)]
    joint = hidden.joints[0]
    if hidden.effect != "wobble_twice":
        return [(names[joint], inputs)]
    near = [names[j] for j in (joint - 1, joint, joint + 1) if 0 <= j < len(names)]
    return [(name, inputs) for name in (near if joint else ["base", *near])]


def _machine_law(scene: Scene, kind: str, rng: Generator) -> Hidden | None:
    """None: not on this robot."""
    chain = scene.chain
    turning = chain.revolute
    if kind == "rods":
        passive = [j for j in range(chain.joints) if j not in chain.driven]
        if not passive:
            return None
        drivers = [driver for driver, _ in chain.drivers[passive[0]]]
        crank = drivers[:1] if rng.random() < 0.5 else drivers
        named = tuple(chain.angle(j) for j in crank)
        return machine_laws.four_bar(chain, passive[0], [(j, 1.0) for j in crank], rng, named)
    if kind == "elbow_rods":
        elbow = turning[2]
        if not _parallel(chain, elbow):  # rods turn in one plane
            return None
        named = (chain.angle(elbow),)
        return machine_laws.four_bar(chain, elbow, [(elbow, 1.0)], rng, named)
    if kind == "warm_robot":
        return machine_laws.warm_robot(chain, rng)
    if kind == "neighbour":
        joint = int(rng.choice(turning))
        beside = [j for j in turning if abs(j - joint) == 1]
        other = int(rng.choice(beside)) if beside else -1
        return machine_laws.neighbour(joint, other, rng, (chain.angle(other),)) if beside else None
    places = places_of("axis_wobble" if kind == "wobble_twice" else "joint_compliance", scene)
    if not places:
        return None
    joint = int(rng.choice(places))
    if kind == "wobble_twice":
        return replace(machine_laws.wobble_twice(joint, rng), inputs=(chain.angle(joint),))
    return replace(machine_laws.hard_spring(joint, rng), inputs=(f"torque{joint + 1}",))


def _parallel(chain: Chain, joint: int) -> bool:
    """Whether a joint's axis is parallel to the one before, so that rods can drive it."""
    return bool(abs(np.sin(chain.links[joint if chain.mdh else joint - 1, ALPHA])) < 0.05)


def _short_elbow(plan: Plan, chain: Chain, rng: Generator) -> Plan:
    """An elbow that rods drive stays away from where crank and base bar are in line."""
    column = chain.driven.index(chain.revolute[2])
    low, high = plan.low.copy(), plan.high.copy()
    middle = 0.5 * (low[column] + high[column])
    low[column], high[column] = max(low[column], middle - _TRAVEL), min(high[column], middle + _TRAVEL)
    return replace(plan, low=low, high=high)


def _drags_the_wrist(scene: Scene, hidden: Hidden) -> bool:
    joint, chain = hidden.joints[0], scene.chain
    return scene.specimen.wrist and joint >= chain.joints - 2 and hidden.inputs == (chain.angle(joint - 1),)


# ---- Several joints ------------------------------------------------------------------------------


def _together(
    scene: Scene, view: View, units: Sequence[Hidden], over_noise: float
) -> tuple[list[tuple[Hidden, Floats]], list[float]] | None:
    """Effects scaled by one factor, so that together they are of a stated size; how each moves the tips, and
    its size over noise beyond the others. None: no machine has them so large.
    """
    whole = sum(view.displaced(hidden.changes(scene.context)) for hidden in units)
    seen = view.rms(np.asarray(whole))
    if seen <= 0.0:
        return None
    factor = over_noise * scene.sigma / seen
    scaled = [hidden.sized(hidden.size * factor) for hidden in units]
    if not all(sensible(scene, hidden) for hidden in scaled):
        scene.request.throw_away("no machine has the effect so large")
        return None
    moved = [moved_by(scene, hidden) for hidden in scaled]
    return list(zip(scaled, moved, strict=True)), apart(view, moved, scene.sigma)


def _several(request: Request) -> Case:
    """One cause on all joints of a kind: springs under all weight, springs that harden, play of all gears."""
    kind = ("springs", "hard_springs", "play")[request.number % 3]
    return _once_per_try(request, lambda: _several_of(request, kind))


def _several_of(request: Request, kind: str) -> Case | None:
    rng = request.rng
    source = "physics" if kind == "springs" else "departures"
    needs = frozenset({"dir"} if kind == "play" else {"payload"})
    scene = make_scene(request, source, poses=request.poses(200, 300, 400), needs=needs, masses=True)
    view = View(scene.context)
    units = _units(scene, kind, rng)
    if len(units) < 2:
        return None
    drawn = _together(scene, view, units, draw_size(rng, 3.0, 15.0))
    if drawn is None:
        return None
    complete, sizes = drawn
    return _joints_case(scene, view, complete, sizes, least=2, kind=kind)


def _units(scene: Scene, kind: str, rng: Generator) -> list[Hidden]:
    """An effect a joint, of the sizes that they have to each other: a gear winds up by as much under its
    largest load as the others do.
    """
    context = scene.context
    if kind == "play":
        joints = scene.chain.revolute
        return [laws.backlash(j, rng).sized(float(rng.uniform(0.5, 1.0))) for j in joints]
    most = float(np.abs(context.torque).max())
    joints = [j for j in places_of("joint_compliance", scene) if context.largest(j) > 0.05 * most]
    share = float(rng.uniform(0.15, 0.35))
    made = [
        machine_laws.hard_spring(j, rng, share) if kind == "hard_springs" else laws.joint_compliance(j, rng)
        for j in joints
    ]
    return [h.sized(float(rng.uniform(0.6, 1.4)) / context.largest(h.joints[0])) for h in made]


def _joints_case(
    scene: Scene,
    view: View,
    drawn: Sequence[tuple[Hidden, Floats]],
    sizes: Sequence[float],
    least: int,
    **more: Any,
) -> Case | None:
    """What is as large as the noise by itself must be named, the rest may be."""
    plain = [k for k, size in enumerate(sizes) if size >= 1.0]
    if len(plain) < least:
        scene.request.throw_away("one effect hides another")
        return None
    told = [named_effect(scene.chain, accepted(hidden.effect)[0], hidden.joints) for hidden, _ in drawn]
    acceptable = [{**told[k], "of": None} for k in range(len(told)) if k not in plain]
    for k, (hidden, moved) in enumerate(drawn):
        of = plain.index(k) if k in plain else None
        acceptable += acceptable_for(scene, view, hidden, moved, of)
    return make_case(
        scene,
        [hidden for hidden, _ in drawn],
        [sizes[k] for k in plain],
        acceptable=acceptable,
        effects=[told[k] for k in plain],
        **more,
    )


# ---- Teeth ---------------------------------------------------------------------------------------


def _teeth(request: Request) -> Case:
    """Teeth, motors or belts of one to three joints with the same gear: on an even grid, an uneven one,
    anywhere.
    """
    where = ("even_grid", "uneven_grid", "anywhere")[request.number % 3]
    return _once_per_try(request, lambda: _teeth_of(request, where))


def _teeth_of(request: Request, where: str) -> Case | None:
    rng = request.rng
    grid = functools.partial(gridded, even=where == "even_grid", steps=_FINE)
    reshape = None if where == "anywhere" else grid
    scene = make_scene(request, "departures", poses=request.poses(200, 300, 400), reshape=reshape)
    view = View(scene.context)
    turning = scene.chain.revolute
    gear, order = machine_laws.tooth_order(int(rng.choice(machine_laws.RATIOS[request.which])), rng)
    joints = sorted(int(j) for j in rng.choice(turning, int(rng.integers(1, 4)), replace=False))
    units = [machine_laws.teeth(j, order, rng).sized(float(rng.uniform(0.6, 1.0))) for j in joints]
    drawn = _together(scene, view, units, draw_size(rng, 1.5, 8.0))
    if drawn is None:
        return None
    complete, sizes = drawn
    names = scene.chain.names
    places = [(names[j], [scene.chain.angle(j)]) for j in joints]
    spacing = {
        names[j]: float(np.diff(scene.plan.levels[scene.chain.driven.index(j)])[0])
        if where == "even_grid"
        else 0.0
        for j in joints
    }
    return _joints_case(
        scene,
        view,
        complete,
        sizes,
        least=1,
        kind=where,
        gear=gear,
        order=order,
        spacing=spacing,
        places=places,
    )


# ---- Small companions ----------------------------------------------------------------------------


def _companion(request: Request) -> Case:
    """An effect, a little off its law, and another one that makes 1 to 2 % of the gap's mean square."""
    return _once_per_try(request, lambda: _companion_of(request))


def _companion_of(request: Request) -> Case | None:
    rng = request.rng
    without = GEOMETRIC | {"transmission_error"}
    names = [draw_name(rng, "departures", without=without) for _ in range(2)]
    needs = frozenset().union(*(needs_of(name, rng) for name in names))
    masses = True if NEED_MASSES & set(names) else None
    scene = make_scene(request, "departures", needs=needs, masses=masses, poses=request.poses(200, 300, 400))
    view = View(scene.context)
    large = draw_size(rng, 3.0, 15.0)
    small = large * float(np.sqrt(rng.uniform(0.01, 0.02)))
    drawn = [
        draw_effect(scene, name, view, size, depart)
        for name, size, depart in zip(names, (large, small), (0.15, 0.0), strict=True)
    ]
    found = [item for item in drawn if item is not None]
    if len(found) < 2 or clash([hidden for hidden, _ in found]):
        return None
    (main, moved), (extra, little) = found
    if explained(view, little, [moved]) > 0.5:
        request.throw_away("one effect hides another")
        return None
    acceptable = [{**named_effect(scene.chain, extra.effect, extra.joints), "of": None}]
    for of, (hidden, own) in zip((0, None), found, strict=True):
        acceptable += acceptable_for(scene, view, hidden, own, of)
    label = named_effect(scene.chain, main.effect, main.joints)
    size = view.rms(moved) / scene.sigma
    return make_case(scene, [main, extra], [size], acceptable=acceptable, effects=[label], small=small)


FAMILIES: dict[str, Callable[[Request], Case]] = {
    "grid": _grid,
    "few": _few,
    "mistaken": _mistaken,
    "machines": _machines,
    "teeth": _teeth,
    "several": _several,
    "companion": _companion,
}
