# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one's own on torques: a basis function of the motion that acts at a joint.

    cable = truing.dynamics.TorqueEffect("cable", joint="J4", basis=lambda m: m.joint("J4") ** 2)
    found = truing.dynamics.diagnose(robot, recordings, effects=cable)

The basis is evaluated for all rows of a stretch of a recording at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truing._core import EffectRequest, Motion, Robot, torque_effects
from truing.effects import EVERY_JOINT
from truing.errors import InputError

Floats: TypeAlias = NDArray[np.float64]


class MotionInputs:
    """What a basis on torques may look at: a stretch of one recording, evenly sampled and low-passed, n rows.

    Every array has shape=(n,).
    """

    def __init__(self, robot: Robot, motion: Motion, effect: TorqueEffect, at: str) -> None:
        self._names = [robot.joints[index].name for index in robot.driven_joints()]
        self._motion, self._effect = motion, effect
        self.at = at  # the joint's name, of an effect at every joint

    def __len__(self) -> int:
        return len(self._motion)

    @property
    def time(self) -> Floats:
        """Time from the start of the recording [s]."""
        return self._motion.time

    @property
    def step(self) -> float:
        """Time between two rows [s]."""
        return self._motion.step

    def joint(self, name: str) -> Floats:
        """Position of a joint [rad | m]."""
        return self._of(self._motion.q, name)

    def speed(self, name: str) -> Floats:
        """Speed of a joint [rad/s | m/s]."""
        return self._of(self._motion.qd, name)

    def acceleration(self, name: str) -> Floats:
        """Acceleration of a joint [rad/s^2 | m/s^2]."""
        return self._of(self._motion.qdd, name)

    def direction(self, name: str) -> Floats:
        """Direction of a joint's motion, -1 ... 1, as dry friction knows it."""
        return self._of(self._motion.direction, name)

    def torque(self, name: str) -> Floats:
        """Torque of a joint that the model predicts in all, friction included [Nm | N]."""
        if not self._effect.needs_torque:
            raise InputError(
                f"effect {self._effect.name!r}: its basis asks for the torque, so say"
                " TorqueEffect(..., needs_torque=True)"
            )
        return self._of(self._motion.torque, name)

    def column(self, name: str) -> Floats:
        """A further column of the recording, such as temp2_C."""
        values = self._motion.column(name)
        if values is None:
            raise InputError(
                f"a recording has no column {name!r}, and the basis of effect {self._effect.name!r} asks for"
                " it"
            )
        return values

    def _of(self, table: Floats, name: str) -> Floats:
        if name not in self._names:
            raise InputError(
                f"there is no joint {name!r} that has a reading; there are: {', '.join(self._names)}"
            )
        column: Floats = table[:, self._names.index(name)]
        return column


TorqueBasis: TypeAlias = Callable[[MotionInputs], ArrayLike]


@dataclass(frozen=True)
class TorqueEffect:
    """An effect of one's own: parameter * basis(inputs) is added to the torque of a joint.

    name: names the parameter, `name.joint`.
    joint: its name, or "*" for every joint that has a reading: then `inputs.at` says which.
    basis: takes `MotionInputs` and returns an array of shape=(n,); or a mapping {suffix: basis} for several
        parameters, `name.joint.suffix`. Called for a stretch of a recording at a time; a row may depend on
        the second before it, not on more.
    unit: of the parameter, so that parameter * basis is in Nm (of a prismatic joint N).
    size: that the parameter may well have; None: the torque's standard deviation, for a basis of about one.
    needs_torque: the basis looks at `inputs.torque`.

    Raises InputError: a name that is taken or is not one word, a basis that cannot be called.
    """

    name: str
    joint: str
    basis: TorqueBasis | Mapping[str, TorqueBasis]
    unit: str = "Nm"
    summary: str = ""
    size: float | None = None
    needs_torque: bool = False

    def __post_init__(self) -> None:
        if not self.name or any(character in self.name for character in ".:,+* "):
            raise InputError(f"an effect's name is one word without . : , + *; found {self.name!r}")
        if self.name in (known := [effect["name"] for effect in torque_effects()]):
            raise InputError(
                f"effect name {self.name!r} is taken by the catalogue ({', '.join(known)}); choose another"
            )
        if not all(callable(basis) for basis in self._parts.values()):
            raise InputError(
                f"effect {self.name!r}: basis must be a function of the inputs, found {self.basis!r}"
            )
        if self.size is not None and not (np.isfinite(self.size) and self.size > 0.0):
            raise InputError(f"effect {self.name!r}: size must be above zero, found {self.size:g}")

    @property
    def _parts(self) -> Mapping[str, TorqueBasis]:
        return self.basis if isinstance(self.basis, Mapping) else {"": self.basis}

    def joints(self, robot: Robot) -> list[str]:
        """Names of the joints where it acts. Raises InputError: there is none of this name."""
        driven = [robot.joints[index].name for index in robot.driven_joints()]
        if self.joint == EVERY_JOINT:
            return driven
        if self.joint not in driven:
            raise InputError(
                f"effect {self.name!r}: there is no joint {self.joint!r} that has a reading; there are:"
                f" {', '.join(driven)}, or '*' for all of them"
            )
        return [self.joint]

    def request(self, robot: Robot) -> EffectRequest:
        """The request that asks `identify` for this effect."""
        return EffectRequest(self.name, self.joints(robot))

    def parts_at(self, joint: str) -> list[str]:
        """Suffixes of its parameters at a joint; none: it does not act there."""
        return list(self._parts) if self.joint in (EVERY_JOINT, joint) else []

    def evaluate(self, robot: Robot, motion: Motion, joint: str, part: str) -> Floats:
        """The basis values for the rows of a motion. Raises InputError when they cannot be used."""
        inputs = MotionInputs(robot, motion, self, joint)
        parameter = ".".join([self.name, joint] + ([part] if part else []))
        try:
            values = np.array(self._parts[part](inputs), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"effect parameter {parameter!r}: the basis must return numbers, one per row: {error}"
            ) from error
        if values.shape != (len(inputs),):
            raise InputError(
                f"effect parameter {parameter!r}: the basis returned shape {values.shape}, expected"
                f" ({len(inputs)},), one value per row"
            )
        if not np.isfinite(values).all():
            raise InputError(f"effect parameter {parameter!r}: the basis returned values that are not finite")
        return values


def own_torque_effects(effects: TorqueEffect | Iterable[TorqueEffect], robot: Robot) -> list[TorqueEffect]:
    """Definitions of own effects, each of which has its joints. Raises InputError on anything else."""
    own = [effects] if isinstance(effects, TorqueEffect) else list(effects)
    for effect in own:
        if not isinstance(effect, TorqueEffect):
            raise InputError(
                f"effects holds {effect!r}: expected definitions of own effects (TorqueEffect); those of the"
                " catalogue are known"
            )
        effect.joints(robot)
    return own
