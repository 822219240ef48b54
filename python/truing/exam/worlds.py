# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The true robot: what an instrument without noise would read. A mechanism in MuJoCo, or plain numpy."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from truing.exam.design import limits
from truing.exam.kinematics import Chain, Changes, Floats, sweep
from truing.exam.laws import Context, Hidden, Inputs, Law, hardening, motor_torque
from truing.exam.robots import Specimen

MECHANICAL = frozenset(
    {"joint_compliance", "link_compliance", "backlash", "gravity_backlash", "windup", "linkage"}
)
"""Effects that a mechanism brings about by itself, by springs, stops, beams and rods."""


@dataclass(frozen=True)
class Truth:
    """A robot with hidden effects."""

    specimen: Specimen
    chain: Chain  # true base and tool, true masses
    physics: bool
    hidden: tuple[Hidden, ...] = ()
    geometry: Law | None = None  # errors of manufacture underneath
    of: Context | None = None  # of the measurement, where fresh poses are observed

    def observe(self, inputs: Inputs, hidden: Sequence[Hidden] | None = None) -> tuple[Floats, Floats]:
        """Positions (n, 3) and rotations (n, 3, 3) of the targets, with the truth's own effects or with
        others.
        """
        effects = self.hidden if hidden is None else tuple(hidden)
        context = Context(self.chain, inputs, self.of)
        if self.physics:
            return self._mechanism(context, effects)
        state = sweep(self.chain, inputs.readings, self._changes(context, effects), inputs.target)
        return state.tip, state.rotation

    def _changes(self, context: Context, effects: Sequence[Hidden]) -> Changes:
        total = self.geometry(context) if self.geometry else context.still()
        for effect in effects:
            total = total + effect.changes(context)
        return total

    def _mechanism(self, context: Context, effects: Sequence[Hidden]) -> tuple[Floats, Floats]:
        from truing.exam.physics import Mechanism

        mechanical = [effect for effect in effects if effect.effect in MECHANICAL]
        commanded = self._changes(context, [effect for effect in effects if effect.effect not in MECHANICAL])
        tilting = [j for j in range(self.chain.joints) if commanded.tilt[:, j].any()]
        mechanism = Mechanism(self.chain, self._parts(context, mechanical), tilting)
        inputs = context.inputs
        return mechanism.measure(inputs.readings, commanded, inputs.direction, inputs.payload, inputs.target)

    def _parts(self, context: Context, effects: Sequence[Hidden]) -> Any:
        from truing.exam.physics import Parts, Play

        springs, wound, plays, beams, rods, level = {}, {}, {}, {}, [0.0, 0.0], 0.0
        for effect in effects:
            joint = effect.joints[0]
            largest = context.largest(joint)
            if effect.effect == "joint_compliance":
                springs[joint] = _spring(effect, largest)
            elif effect.effect == "windup":
                springs[joint] = _spring(effect, largest)
                wound[joint] = (
                    motor_torque(context, joint, effect.detail["friction"]) + context.torque[:, joint]
                )
            elif effect.effect == "backlash":
                # The approach decides the side, whatever weight the robot as made puts on the joint.
                plays[joint] = Play(effect.size, math.inf)
            elif effect.effect == "gravity_backlash":
                plays[joint] = Play(effect.size, 0.0)
            elif effect.effect == "link_compliance":
                beams[joint] = effect.size
            else:
                rods[0 if effect.detail["lower"] else 1] += effect.size * self.specimen.rod_arm
                level -= effect.size * self._mean_lean(context, joint, bool(effect.detail["lower"]))
        middle = self._rod_middle() if self.specimen.rod_arm else (0.0, 0.0)
        return Parts(springs, wound, plays, beams, (rods[0], rods[1]), self.specimen.rod_arm, level, middle)

    def _mean_lean(self, context: Context, wrist: int, lower: bool) -> float:
        """Mean of 1 / cos of a rod's lean: what whoever set the robot up trimmed away."""
        drivers = [driver for driver, _ in self.chain.drivers[wrist]]
        middle = np.array(self._rod_middle())
        lean = context.of.motion[:, drivers] - middle
        return float(np.mean(1.0 / np.cos(lean[:, 0] if lower else lean.sum(axis=1))))

    def _rod_middle(self) -> tuple[float, float]:
        low, high = limits(self.specimen, self.chain)
        drivers = [
            self.chain.driven.index(driver) for driver, _ in next(by for by in self.chain.drivers if by)
        ]
        first, second = 0.5 * (low + high)[drivers]
        return float(first), float(second)


def _spring(effect: Hidden, largest: float) -> Callable[[Floats], Floats]:
    """Deflection of a torque."""
    depart, band, size = effect.detail.get("depart", 0.0), effect.detail.get("dead_band", 0.0), effect.size
    if band:
        return lambda torque: np.asarray(
            size * np.copysign(np.maximum(np.abs(torque) - band * largest, 0.0), torque)
        )
    if depart:
        return lambda torque: size * hardening(np.asarray(torque), largest, depart)
    return lambda torque: size * torque
