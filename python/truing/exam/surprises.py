# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Effects that stand in no catalogue. Those of the examination are not those of the development."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from truing.exam.kinematics import Chain, Changes, Floats
from truing.exam.laws import Context, Hidden, at_joint


def _unlisted(
    name: str,
    joint: int,
    inputs: tuple[str, ...],
    values: Callable[[Context], Floats],
    needs: frozenset[str] = frozenset(),
) -> Hidden:
    return Hidden(name, (joint,), at_joint(joint, values), inputs=inputs, needs=needs, listed=False)


def _other(chain: Chain, joint: int, rng: Generator) -> int:
    return int(rng.choice([j for j in chain.driven if j != joint]))


def _name(chain: Chain, joint: int) -> str:
    return chain.angle(joint)


def _relative(c: Context, joint: int) -> Floats:
    """The joint's motion within the range it went through, -1 to 1."""
    usual = c.of.motion[:, joint]
    return np.asarray(2.0 * (c.motion[:, joint] - usual.min()) / max(float(np.ptp(usual)), 1e-9) - 1.0)


# ---- Development ---------------------------------------------------------------------------------


def bump(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A dent in a race: the joint moves where it rolls over it."""
    at, width = float(rng.uniform(-0.5, 0.5)), float(rng.uniform(0.12, 0.25))
    return _unlisted(
        "bump",
        joint,
        (_name(chain, joint),),
        lambda c: np.asarray(np.exp(-(((_relative(c, joint) - at) / width) ** 2))),
    )


def step(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """An encoder that loses counts at its index."""
    at = float(rng.uniform(-0.4, 0.4))
    return _unlisted(
        "step", joint, (_name(chain, joint),), lambda c: np.asarray((_relative(c, joint) > at).astype(float))
    )


def kink(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """Cables that turn over twice on the way: a W with sharp corners."""
    return _unlisted(
        "kink", joint, (_name(chain, joint),), lambda c: np.asarray(np.abs(np.abs(_relative(c, joint)) - 0.5))
    )


def bent_by_neighbour(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A hose that one joint tightens and another feels."""
    other = _other(chain, joint, rng)
    return _unlisted(
        "bent_by_neighbour",
        joint,
        (_name(chain, other),),
        lambda c: np.asarray(np.tanh(2.5 * _relative(c, other)) + _relative(c, other) ** 2),
    )


def product(chain: Chain, joint: int, rng: Generator) -> Hidden:
    other = _other(chain, joint, rng)
    return _unlisted(
        "product",
        joint,
        (_name(chain, joint), _name(chain, other)),
        lambda c: np.asarray(_relative(c, joint) * _relative(c, other)),
    )


def warm_square(chain: Chain, joint: int, rng: Generator) -> Hidden:
    def values(c: Context) -> Floats:
        usual = c.of.inputs.temperature
        return np.asarray(((c.inputs.temperature - usual.mean()) / max(float(usual.std()), 1e-9)) ** 2)

    return _unlisted("warm_square", joint, ("temp",), values, frozenset({"temp"}))


def supply(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A pneumatic balancer follows the supply pressure."""
    return _unlisted(
        "supply",
        joint,
        ("supply_bar",),
        lambda c: c.inputs.covariates["supply_bar"] - 6.0,
        frozenset({"supply_bar"}),
    )


def slip(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A bolted flange slips once."""
    at = float(rng.uniform(0.3, 0.7))
    return _unlisted(
        "slip", joint, ("time",), lambda c: np.asarray((c.hours > at).astype(float)), frozenset({"t"})
    )


# ---- Examination ---------------------------------------------------------------------------------


def sawtooth(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """An interpolator that wraps: a ramp that falls back several times over the range."""
    teeth, shift = float(rng.uniform(1.6, 2.6)), float(rng.uniform(0.0, 1.0))
    return _unlisted(
        "sawtooth",
        joint,
        (_name(chain, joint),),
        lambda c: np.asarray(np.mod(teeth * 0.5 * _relative(c, joint) + shift, 1.0)),
    )


def end_stop(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A dress pack that tightens from somewhere on."""
    at, side = float(rng.uniform(0.0, 0.4)), float(rng.choice([-1.0, 1.0]))
    return _unlisted(
        "end_stop",
        joint,
        (_name(chain, joint),),
        lambda c: np.asarray(np.maximum(side * _relative(c, joint) - at, 0.0) ** 1.5),
    )


def plateau(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A worn stretch of a gear."""
    low, width = float(rng.uniform(-0.6, 0.0)), float(rng.uniform(0.3, 0.6))
    return _unlisted(
        "plateau",
        joint,
        (_name(chain, joint),),
        lambda c: np.asarray((np.abs(_relative(c, joint) - low - 0.5 * width) < 0.5 * width).astype(float)),
    )


def neighbour_switch(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A cable that falls from one guide into another as another joint turns."""
    other, at = _other(chain, joint, rng), float(rng.uniform(-0.3, 0.3))
    return _unlisted(
        "neighbour_switch",
        joint,
        (_name(chain, other),),
        lambda c: np.asarray(np.tanh(8.0 * (_relative(c, other) - at))),
    )


def cable_drag(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A cable over two joints pulls by how far both stretch it together."""
    other = _other(chain, joint, rng)

    def values(c: Context) -> Floats:
        stretch = _relative(c, joint) + _relative(c, other)
        return np.asarray(np.maximum(stretch, 0.0) ** 2)

    return _unlisted("cable_drag", joint, (_name(chain, joint), _name(chain, other)), values)


def humid(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A belt swells in damp air, more and more."""
    return _unlisted(
        "humid",
        joint,
        ("humidity_pct",),
        lambda c: np.asarray(((c.inputs.covariates["humidity_pct"] - 30.0) / 20.0) ** 2),
        frozenset({"humidity_pct"}),
    )


def creep(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """After switching on, a joint settles for a while."""
    return _unlisted(
        "creep", joint, ("time",), lambda c: np.asarray(np.exp(-c.hours / 0.15)), frozenset({"t"})
    )


def loaded_belt(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """A belt lags one way empty and the other way loaded: approach direction and payload together."""
    column = chain.number(joint) - 1

    def values(c: Context) -> Floats:
        usual = c.of.inputs.payload
        return np.asarray(
            c.inputs.direction[:, column] * (c.inputs.payload - usual.mean()) / max(float(usual.max()), 1e-9)
        )

    return _unlisted(
        "loaded_belt", joint, (f"dir{joint + 1}", "payload"), values, frozenset({"dir", "payload"})
    )


def leaning_base(chain: Chain, joint: int, rng: Generator) -> Hidden:
    """The pedestal leans towards where the arm carries its payload: q1 and payload together."""
    turning = chain.revolute[0]

    def law(context: Context) -> Changes:
        changes = context.still()
        share = context.inputs.payload / max(float(context.of.inputs.payload.max()), 1e-9)
        q = context.motion[:, turning]
        lean = np.stack([-np.sin(q), np.cos(q), np.zeros_like(q)], axis=1) * share[:, None]
        up = -chain.gravity / np.linalg.norm(chain.gravity)
        if abs(up[2]) < 0.5:  # a rail's base has its z lying
            lean = np.stack([np.cos(q), np.zeros_like(q), np.sin(q)], axis=1) * share[:, None]
        changes.base[:, 3:] = lean @ chain.base[:3, :3].T
        return changes

    inputs = (_name(chain, turning), "payload")
    return Hidden("leaning_base", (), law, inputs=inputs, needs=frozenset({"payload"}), listed=False)


Surprise = Callable[[Chain, int, Generator], Hidden]
DEVELOPMENT: tuple[Surprise, ...] = (bump, step, kink, bent_by_neighbour, product, warm_square, supply, slip)
EXAMINATION: tuple[Surprise, ...] = (
    sawtooth,
    end_stop,
    plateau,
    neighbour_switch,
    cable_drag,
    humid,
    creep,
    loaded_belt,
    leaning_base,
)


def surprises(which: str) -> tuple[Surprise, ...]:
    return DEVELOPMENT if which == "development" else EXAMINATION
