# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Laws that machines have and textbooks shorten: exact where the usual form is a first order, or a little
different.

They are listed effects by other laws than the catalogue's. What the candidate calls them: `names`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from truing.exam.kinematics import A, Chain, Changes, D, Floats
from truing.exam.laws import Context, Hidden, at_joint, lagging

RATIOS = {"development": (50, 81, 101, 120, 153), "examination": (80, 100, 121, 141, 161)}
"""Gear ratios of the two halves: up to the largest that one strain-wave stage is sold with."""
_STEP = 1e-5  # of the bars' lengths: for the law to first order


# ---- Four-bar linkages ---------------------------------------------------------------------------


def closure(theta: Floats, base: float, crank: float, rocker: float, coupler: float) -> Floats:
    """Angle of the rocker of a four-bar linkage whose crank stands at `theta` to the base bar [rad].

    The coupler joins the ends of crank and rocker: |d - rocker e(phi)| = coupler, where d runs from the
    rocker's pivot to the crank's end. By the law of cosines phi is the angle of d, plus or minus psi; of both
    branches the one nearer to a parallelogram's, phi = theta, is meant.
    """
    x, y = crank * np.cos(theta) - base, crank * np.sin(theta)
    length = np.hypot(x, y)
    cosine = (rocker**2 + length**2 - coupler**2) / (2.0 * rocker * length)
    psi = np.arccos(np.clip(cosine, -1.0, 1.0))
    off = [np.angle(np.exp(1j * (np.arctan2(y, x) + side * psi - theta))) for side in (-1.0, 1.0)]
    return np.asarray(theta + np.where(np.abs(off[0]) < np.abs(off[1]), off[0], off[1]))


def four_bar(
    chain: Chain, joint: int, crank: Sequence[tuple[int, float]], rng: Generator, inputs: tuple[str, ...]
) -> Hidden:
    """A parallelogram that drives `joint`, its bars unequal. crank: joints, with weights, whose motions add
    up to the crank's angle; in the middle of the travel it stands about square to the base bar.

    Size 1: bars wrong by the base bar's length. The joint was set to zero over its travel: the mean is
    trimmed away.
    """
    arm = float(rng.uniform(0.35, 0.9))  # of crank and rocker, the base bar being 1
    wrong = rng.normal(size=4)
    wrong /= np.linalg.norm(wrong)
    lean = float(rng.uniform(-0.3, 0.3))

    def angle(c: Context) -> Floats:
        return np.asarray(sum(weight * c.motion[:, driver] for driver, weight in crank))

    def exact(c: Context, size: float) -> Changes:
        usual = angle(c.of)
        middle = 0.5 * (usual.min() + usual.max())
        bars = (np.array([1.0, arm, arm, 1.0]) + size * wrong).tolist()

        def error(at: Floats) -> Floats:
            theta = at - middle + 0.5 * np.pi + lean
            return np.asarray(closure(theta, *bars) - theta)

        changes = c.still()
        changes.motion[:, joint] = error(angle(c)) - error(usual).mean()
        return changes

    return Hidden(
        "four_bar",
        (joint,),
        lambda c: exact(c, _STEP).scaled(1.0 / _STEP),
        inputs=inputs,
        detail={"arm": arm},
        exact=exact,
    )


# ---- Joints --------------------------------------------------------------------------------------


def hard_spring(joint: int, rng: Generator, share: float | None = None) -> Hidden:
    """A gear that stiffens all the way: its deflection goes with asinh of the torque, linear up to a share of
    the largest one.
    """
    linear = float(rng.uniform(0.15, 0.35)) if share is None else share

    def values(c: Context) -> Floats:
        knee = linear * c.largest(joint)
        return np.asarray(knee * np.arcsinh(c.torque[:, joint] / knee))

    return Hidden("hard_spring", (joint,), at_joint(joint, values), detail={"linear_to": linear})


def neighbour(joint: int, other: int, rng: Generator, inputs: tuple[str, ...]) -> Hidden:
    """A belt or hose of the joint next door drags this one along, over a pulley that is a little out of
    round.
    """
    out_of_round = float(rng.uniform(0.05, 0.12))
    phase = float(rng.uniform(-np.pi, np.pi))

    def values(c: Context) -> Floats:
        q = c.motion[:, other]
        return np.asarray(q + out_of_round * np.sin(2.0 * q + phase))

    return Hidden("neighbour", (joint,), at_joint(joint, values), inputs=inputs)


def teeth(joint: int, order: float, rng: Generator) -> Hidden:
    """Meshing of a gear or belt, so many times per turn of the joint; a tenth of it at twice the order."""
    phase = rng.uniform(-np.pi, np.pi, 2)

    def values(c: Context) -> Floats:
        u = order * c.motion[:, joint]
        return np.asarray(np.cos(u + phase[0]) + 0.1 * np.cos(2.0 * u + phase[1]))

    return Hidden("teeth", (joint,), at_joint(joint, values), detail={"order": order})


def tooth_order(ratio: int, rng: Generator) -> tuple[str, float]:
    """An order that a gear train of that ratio makes, and what makes it: its motor, the two bulges of a
    strain wave, a stage of half the ratio, a belt whose ratio is no whole number.
    """
    kind = str(rng.choice(["motor", "strain_wave", "half", "belt"]))
    if kind == "belt":
        return kind, float(rng.integers(12, 60)) * float(rng.integers(17, 40)) / float(rng.integers(17, 40))
    return kind, ratio * {"motor": 1.0, "strain_wave": 2.0, "half": 0.5}[kind]


# ---- Axes and links ------------------------------------------------------------------------------


def wobble_twice(joint: int, rng: Generator) -> Hidden:
    """An oval race: the axis leans twice per turn, and a little three times."""
    phase = rng.uniform(-np.pi, np.pi, 3)
    oval = float(rng.uniform(0.3, 1.0))

    def law(context: Context) -> Changes:
        changes = context.still()
        q = context.motion[:, joint]
        changes.tilt[:, joint, 0] = np.cos(2.0 * q + phase[0]) + 0.12 * np.cos(3.0 * q + phase[2])
        changes.tilt[:, joint, 1] = oval * np.cos(2.0 * q + phase[1])
        return changes

    return Hidden("wobble_twice", (joint,), law)


def warm_robot(chain: Chain, rng: Generator) -> Hidden:
    """All links grow as aluminium does, those near the motors of the base most, and later than the sensor
    says.
    """
    reached = rng.uniform(0.7, 1.0, chain.joints) * np.linspace(1.2, 0.8, chain.joints)
    late = float(rng.uniform(0.05, 0.2))

    def law(context: Context) -> Changes:
        changes = context.still()
        span = float(np.ptp(context.of.inputs.time)) + 1.0
        slow = lagging(context, late * span)
        for which in (D, A):
            changes.links[:, :, which] = slow[:, None] * reached * chain.links[:, which]
        return changes

    return Hidden(
        "warm_robot", (), law, inputs=("temp",), needs=frozenset({"temp"}), detail={"late": late}, warms=True
    )
