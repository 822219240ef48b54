# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A set of a servo arm from its parts: an arm and commands are drawn, an effect is hidden at its size, what
may be known is written down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.robots import Floats
from truing.exam.dynamics.scenes import Case, Recorded
from truing.exam.dynamics.servo.arms import REFERENCE_C, Plant, Servo, plant, servos
from truing.exam.dynamics.servo.courses import SECONDS, Course, course
from truing.exam.dynamics.servo.effects import LISTED, LOADED, USUAL, Hidden, Maker, Usage, bears
from truing.exam.dynamics.servo.firmware import Conditions, Run, mjcf, play
from truing.exam.dynamics.servo.sizing import View
from truing.exam.scenes import Request

RATES = (50.0, 100.0, 125.0)  # [Hz]
_BITS = (12, 12, 14)  # of encoders
_JITTER = 0.25  # steps of the encoder, rms
_VOLTS = 12.0
_GRID = 5  # amplitudes that are tried
_NEAR = (0.6, 1.7)  # of the wanted size, that a set may have
USUALLY = ("multisine", "steps", "slow", "waypoints", "chirp", "waypoints", "multisine")
PARTS = ("train", "train", "train", "train", "test", "test", "fresh")
BENEATH = ["armature", "command_gain", "coulomb", "damping_gain", "delay", "viscous"]
"""What is rightly named where the usual parameters handed over are wrong."""


@dataclass(frozen=True)
class Stage:
    """A servo arm under its commands before anything is hidden in it."""

    request: Request
    servo: Servo
    plant: Plant
    courses: list[Course]
    conditions: list[Conditions]
    handed: frozenset[str]  # "temperature", "supply"
    wrong: bool  # the usual parameters that are handed over
    step: float  # [rad] of the encoders
    view: View

    @property
    def sigma(self) -> float:
        """[rad] of what an encoder adds."""
        return self.step * float(np.hypot(_JITTER, 1.0 / np.sqrt(12.0)))


def stage(
    request: Request,
    *,
    wrong: bool,
    needs: frozenset[str] = frozenset(),
    servo: Servo | None = None,
    kinds: Sequence[str] = USUALLY,
) -> Stage:
    """needs: columns that must be there. wrong: the usual parameters handed over are, commands late."""
    rng = request.rng
    every = servos(request.which)
    servo = servo or every[int(rng.integers(len(every)))]
    rate = float(rng.choice(RATES))
    true = plant(servo, rng, float(rng.uniform(4e-3, 25e-3)) if wrong else 0.0)
    courses = [course(kind, servo.arm, rng, rate) for kind in kinds]
    conditions = [Conditions(_warmth(servo.n, rate, rng)) for _ in courses]
    learned = [k for k, part in enumerate(PARTS) if part == "train"]
    view = View(true, [courses[k] for k in learned], [conditions[k] for k in learned])
    handed = needs | frozenset(name for name in ("temperature", "supply") if rng.random() < 0.5)
    step = 2.0 * np.pi / 2.0 ** int(rng.choice(_BITS))
    return Stage(request, servo, true, courses, conditions, handed, wrong, step, view)


def _warmth(n: int, rate: float, rng: Generator) -> Floats:
    """Gears that warm slowly, each recording from its own start."""
    t = np.arange(round(SECONDS * rate)) / rate
    start = rng.uniform(REFERENCE_C, 55.0) + rng.uniform(-2.0, 2.0, n)
    return np.asarray(start + rng.uniform(0.0, 0.4, n) * t[:, None])


# ---- Hiding --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Placed:
    """An effect with its amplitude."""

    hidden: Hidden
    amplitude: float


def drawn(st: Stage, name: str, use: Usage, makers: Mapping[str, Maker] = LISTED) -> Hidden | None:
    """An effect somewhere on the arm. None: it has no place there."""
    n, rng = st.servo.n, st.request.rng
    places = [j for j in range(n) if name not in LOADED or bears(st.plant, j)]
    if not places:
        st.request.throw_away("no place on this arm")
        return None
    return makers[name](st.plant, use, int(rng.choice(places)), rng)


def looked_for(hidden: Hidden) -> str:
    """The usual parameter that is hidden, or none."""
    return hidden.effect if hidden.effect in USUAL else ""


def placed(st: Stage, hidden: Hidden, size: float, fitted: str = "") -> Placed | None:
    """An effect with the amplitude that changes the motion by `size`, where most is seen. None: no machine
    has it so large. fitted: BARE, where the usual parameters are not fitted before it is measured.
    """
    besides = fitted or looked_for(hidden)
    amplitudes = np.geomspace(hidden.least, hidden.most, _GRID)
    changes = st.view.changes([hidden.made(st.plant, a) for a in amplitudes])
    sizes = np.array([st.view.sizes(change, besides).max() for change in changes])
    sizes = sizes[np.cumprod(np.isfinite(sizes)) > 0]  # beyond, the arm leaves
    if not len(sizes) or sizes.max() < size or sizes[0] > size:
        st.request.throw_away("no machine has it so large, or so small")
        return None
    first = int(np.flatnonzero(sizes >= size)[0])
    low, high = np.log(np.maximum(sizes[first - 1 : first + 1], 1e-9))
    part = (np.log(size) - low) / (high - low)
    return Placed(hidden, float(amplitudes[first - 1] * (amplitudes[first] / amplitudes[first - 1]) ** part))


def looks_like(st: Stage, use: Usage, change: Floats, hidden: Hidden, joint: int) -> list[dict[str, Any]]:
    """Shares of what is seen of an effect that listed ones explain, at that joint or in the whole arm."""
    names, plants = [], []
    for name, maker in LISTED.items():
        if name in USUAL or (name in LOADED and not bears(st.plant, joint)):
            continue  # fitted anyway; without a place there
        rival = maker(st.plant, use, joint, np.random.default_rng(7))
        if (rival.effect, rival.joints) == (hidden.effect, hidden.joints):
            continue
        names.append((rival.effect, rival.joints))
        plants.append(rival.made(st.plant, float(np.sqrt(rival.least * rival.most))))
    weight = st.plant.at(joint, weight=1.1)
    names.append(("gravity_scale", (joint,)))
    plants.append(weight)
    found = []
    for rival_name, other in zip(names, st.view.changes(plants), strict=True):
        if np.isfinite(other).all():
            share, same = st.view.same(change, other, st.sigma, looked_for(hidden))
            found.append({**told(*rival_name), "share": round(share, 4), "same": same})
    return found


def told(effect: str, joints: Sequence[int]) -> dict[str, Any]:
    return {"effect": effect, "joints": [f"J{j + 1}" for j in joints]}


# ---- Handing over --------------------------------------------------------------------------------


def make_case(
    st: Stage,
    one: Placed | None,
    wanted: float = 0.0,
    withheld: frozenset[str] = frozenset(),
    fitted: str = "",
    **more: Any,
) -> Case | None:
    """The set with its label. None: what is simulated is not of its size, or its motion leaves."""
    true = one.hidden.made(st.plant, one.amplitude) if one else st.plant
    runs = play([true], st.courses, st.conditions)[0]
    if not all(np.isfinite(run.q).all() for run in runs):
        st.request.throw_away("the arm cannot be driven")
        return None
    label: dict[str, Any] = {
        "family": st.request.family,
        "source": "servo",
        "arm": st.servo.arm.name,
        "effects": [],
        "acceptable": [],
        "amplitudes": [one.amplitude] if one else [],
        "size_over_noise": wanted,
        "usual": one is not None and bool(fitted or looked_for(one.hidden)),
        "rate": st.courses[0].rate,
        "encoder_rad": st.step,
        "columns": sorted(st.handed - withheld),
        "geometry_underneath": st.wrong,
        "underneath": BENEATH if st.wrong else [],
    }
    if one and not _labelled(st, one, runs, wanted, fitted, label):
        return None
    label["drawn_anew"] = dict(st.request.anew)
    label.update(more)
    recorded = _recorded(st, runs, withheld)
    drives = _published(st)
    return Case(
        mjcf(st.servo.arm.name, st.servo.arm, drives),
        tuple(r for r, part in zip(recorded, PARTS, strict=True) if part != "fresh"),
        tuple(r for r, part in zip(recorded, PARTS, strict=True) if part == "fresh"),
        label,
        "robot.xml",
    )


def _labelled(
    st: Stage, one: Placed, runs: Sequence[Run], wanted: float, fitted: str, label: dict[str, Any]
) -> bool:
    """Writes what is seen of an effect into the label."""
    change = np.concatenate([run.q for run, p in zip(runs, PARTS, strict=True) if p == "train"])
    change = change - st.view.whole
    sizes = st.view.sizes(change, fitted or looked_for(one.hidden))
    if not _NEAR[0] * wanted <= sizes.max() <= _NEAR[1] * wanted:
        st.request.throw_away("what was simulated is not of its size")
        return False
    joint = one.hidden.joints[0] if one.hidden.joints else int(np.argmax(sizes))
    rivals = looks_like(st, st.view.usage(), change, one.hidden, joint)
    label["effects"] = [told(one.hidden.effect, one.hidden.joints)]
    if one.hidden.inputs:
        label["unlisted"] = one.hidden.effect
        label["unlisted_joint"], label["unlisted_inputs"] = f"J{joint + 1}", list(one.hidden.inputs)
    label["acceptable"] = [{**r, "of": 0} for r in rivals if r.pop("same")]
    label["best_rival"] = max(rivals, key=lambda r: float(r["share"]))
    label["sizes"] = sizes.tolist()
    label["seen_at"] = f"J{joint + 1}"
    return True


def _published(st: Stage) -> dict[str, Floats]:
    """The usual parameters as they are handed over."""
    rng, n = st.request.rng, st.servo.n
    drives = {name: getattr(st.plant, name).copy() for name in ("gain", "viscous", "coulomb", "armature")}
    if st.wrong:
        for name, most in (("gain", 1.6), ("viscous", 2.5), ("coulomb", 2.5), ("armature", 2.0)):
            drives[name] *= most ** rng.uniform(-1.0, 1.0, n)
    return drives


def _recorded(st: Stage, runs: Sequence[Run], withheld: frozenset[str]) -> list[Recorded]:
    """Rows as the bus gives them: an angle is what the encoder read as the command of its row was sent."""
    rng, n = st.request.rng, st.servo.n
    zeros = rng.normal(0.0, 0.015, n) if st.wrong else np.zeros(n)
    found = []
    for k, (run, c, part) in enumerate(zip(runs, st.courses, PARTS, strict=True)):
        table: dict[str, Floats] = {"t_s": np.arange(len(run.q)) / c.rate}
        q = run.q + zeros + rng.normal(0.0, _JITTER * st.step, run.q.shape)
        q = np.round(q / st.step) * st.step
        table.update({f"q{j + 1}_rad": q[:, j] for j in range(n)})
        table.update({f"u{j + 1}_rad": c.u[:, j] + zeros[j] for j in range(n)})
        shown = st.handed - withheld
        if "supply" in shown:
            table["volt_V"] = np.round(_VOLTS * run.supply, 1)
        if "temperature" in shown:
            table.update({f"temp{j + 1}_C": np.round(st.conditions[k].warmth[:, j]) for j in range(n)})
        found.append(Recorded(f"{c.kind}_{k + 1}", part != "train", table))
    return found


def of_joints(request: Request, count: int) -> Servo:
    """One of the half's arms with so many joints."""
    return next(servo for servo in servos(request.which) if servo.n == count)
