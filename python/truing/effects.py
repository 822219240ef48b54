# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one's own: a basis function of the recorded inputs that acts at a joint.

    eccentric = truing.Effect("eccentric", site="J2", basis=lambda d: np.cos(d.joint("J2")))
    found = truing.identify(robot, data, effects=["backlash", eccentric])

The basis is evaluated once, for all rows together, before the fit starts; the Jacobian follows from it by
itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truing._core import (
    EffectRequest,
    EffectTraits,
    Measurements,
    OwnEffect,
    Robot,
    catalogue,
    catalogue_effects,
    gravity_torque_rows,
    joint_motion,
    validate_robot,
)
from truing.errors import InputError

Floats: TypeAlias = NDArray[np.float64]
BasisValues: TypeAlias = ArrayLike | Mapping[str, ArrayLike]

EVERY_JOINT = "*"


class Inputs:
    """What a basis may look at: the recorded inputs of all n rows. Every array has shape=(n,)."""

    def __init__(self, robot: Robot, data: Measurements) -> None:
        self._robot = robot
        self._data = data
        self._torques: Floats | None = None

    def __len__(self) -> int:
        return self._data.rows

    def joint(self, name: str) -> Floats:
        """Motion of a joint as read, of a passive one from its drivers' readings [rad | m]."""
        return joint_motion(self._robot, self._data, name)

    def direction(self, name: str) -> Floats:
        """Approach direction of a driven joint: -1, 0 or 1."""
        number = self._driven_number(name)
        return _column(self._present(self._data.directions, f"dir{number + 1}", "directions"), number)

    def speed(self, name: str) -> Floats:
        """Speed of a driven joint [rad/s | m/s]."""
        number = self._driven_number(name)
        return _column(self._present(self._data.joint_speeds, f"qd{number + 1}", "joint_speeds"), number)

    @property
    def payload(self) -> Floats:
        """Payload at the tool [kg]."""
        return self._present(self._data.payload, "payload_kg", "payload")

    @property
    def temperature(self) -> Floats:
        """Temperature [deg C]."""
        return self._present(self._data.temperature, "temp_C", "temperature")

    @property
    def time(self) -> Floats:
        """Time [s]."""
        return self._present(self._data.time, "t_s", "time")

    def gravity_torque(self, name: str) -> Floats:
        """Torque of gravity on a joint, by its links and the payload [Nm | N]."""
        index = self._robot.joint_index(name)
        if self._torques is None:
            self._torques = gravity_torque_rows(self._robot, self._data)
        return _column(self._torques, index)

    def column(self, name: str) -> Floats:
        """Any other column of the data (a covariate)."""
        columns = self._data.covariates
        if name not in columns:
            raise InputError(
                f"the data has no column {name!r}; its covariates are: {', '.join(columns) or 'none'}"
            )
        return columns[name]

    def _driven_number(self, name: str) -> int:
        index = self._robot.joint_index(name)
        if self._robot.joints[index].passive:
            raise InputError(f"joint {name} is passive: it has no reading of its own")
        return self._robot.driven_joints().index(index)

    def _present(self, values: Floats | None, column: str, keyword: str) -> Floats:
        if values is None:
            raise InputError(
                f"the data has no column {column} (Measurements(..., {keyword}=...)), and the basis asks"
                " for it"
            )
        return values


def _column(block: Floats, index: int) -> Floats:
    values: Floats = block[:, index]
    return values


@dataclass(frozen=True)
class Effect:
    """An effect of one's own: parameter * basis(inputs) is added to the value of a site.

    name: names the parameter, `name.site`.
    site: a joint ("J2": whatever moves with it), a link value ("J2.a"), a coordinate of base or target
    ("base.z",
        "tool.x"), or "*" for every driven joint.
    basis: takes `Inputs` (with "*" also the joint's name) and returns an array of shape=(n,), or a mapping
        {suffix: array} for several parameters, `name.site.suffix`.
    unit: of the parameter, so that parameter * basis is in rad (or m, where the site is a length).
    traits: what diagnosis, planning and simulation may know of it: `EffectTraits(driver="temperature", ...)`.
    """

    name: str
    site: str
    basis: Callable[[Inputs], BasisValues] | Callable[[Inputs, str], BasisValues]
    unit: str = "rad"
    summary: str = ""
    traits: EffectTraits = field(default_factory=EffectTraits)

    def __post_init__(self) -> None:
        if not self.name or any(character in self.name for character in ".:,+* "):
            raise InputError(f"an effect's name is one word without . : , + *; found {self.name!r}")
        if self.name in (known := [name for name, _ in catalogue()]):
            raise InputError(
                f"effect name {self.name!r} is taken by the catalogue ({', '.join(known)}); choose another"
            )
        if not callable(self.basis):
            raise InputError(
                f"effect {self.name!r}: basis must be a function of the inputs, found {self.basis!r}"
            )

    def request(self, robot: Robot) -> EffectRequest:
        """The request that asks `identify` for this effect."""
        return EffectRequest(self.name, [joint for joint, _ in self.places(robot)])

    def evaluate(self, robot: Robot, data: Measurements) -> OwnEffect:
        """The basis values for the rows of `data`. Raises InputError when the basis returns what cannot be
        used.
        """
        validate_robot(robot)
        inputs = Inputs(robot, data)
        evaluated = OwnEffect(self.name, self.summary, self.traits)
        for joint, site in self.places(robot):
            values = self.basis(inputs, joint) if self.site == EVERY_JOINT else self.basis(inputs)  # type: ignore[call-arg]
            parts = values if isinstance(values, Mapping) else {"": values}
            if not parts:
                raise InputError(
                    f"effect {self.name!r}: the basis returned an empty mapping, expected {{suffix: array}}"
                )
            for suffix, part in parts.items():
                parameter = ".".join([self.name, site] + ([suffix] if suffix else []))
                evaluated.add(
                    joint=joint,
                    parameter=parameter,
                    unit=self.unit,
                    site=site,
                    values=_checked(parameter, part, len(inputs)),
                )
        return evaluated

    def places(self, robot: Robot) -> list[tuple[str, str]]:
        """Joint that a term is listed under, and its site."""
        driven = [robot.joints[index].name for index in robot.driven_joints()]
        if self.site == EVERY_JOINT:
            return [(name, name) for name in driven]
        joints = [joint.name for joint in robot.joints]
        owner = self.site if self.site in joints else self.site.rpartition(".")[0]
        if owner in joints:
            return [(owner, self.site)]
        frames = ["base"] + [target.name for target in robot.targets]
        if owner in frames:
            return [(driven[0], self.site)]  # belongs to no joint, and is to be counted once
        raise InputError(
            f"effect {self.name!r}: site {self.site!r} does not exist; a site is a joint"
            f" ({', '.join(joints)}), a link value such as '{joints[0]}.a', a coordinate such as 'base.z',"
            " or '*'"
        )


def _checked(parameter: str, given: ArrayLike, rows: int) -> Floats:
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"effect parameter {parameter!r}: the basis must return numbers, one per row: {error}"
        ) from None
    if values.shape != (rows,):
        raise InputError(
            f"effect parameter {parameter!r}: the basis returned shape {values.shape}, expected ({rows},),"
            " one value per row" + ("; for a constant use np.full(len(d), ...)" if values.ndim == 0 else "")
        )
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values))[0])
        raise InputError(
            f"effect parameter {parameter!r}: the basis returned {values[row]} at row {row}, expected finite"
            " values"
        )
    # A copy: the basis may have handed out an array that it goes on to change.
    return np.array(values)


EffectLike: TypeAlias = str | EffectRequest | Effect
Effects: TypeAlias = str | EffectRequest | Effect | Iterable[EffectLike]


def parse_effects(text: str) -> list[EffectRequest]:
    """Requests from "backlash,harmonic:J2+J3": effects, after a colon their joints. Raises InputError."""
    requests = []
    for part in text.split(","):
        name, colon, joints = (piece.strip() for piece in part.partition(":"))
        names = [joint.strip() for joint in joints.split("+")] if colon else []
        if not name or not all(names):
            raise InputError(f'cannot read the effects {text!r}; expected e.g. "backlash,harmonic:J2+J3"')
        requests.append(EffectRequest(name, names))
    return requests


def split_effects(effects: Effects) -> tuple[list[EffectRequest | Effect], list[Effect]]:
    """All that is asked for, in order, and those among them that are the caller's own."""
    items: Iterable[EffectLike] = [effects] if isinstance(effects, (str, EffectRequest, Effect)) else effects
    asked: list[EffectRequest | Effect] = []
    for item in items:
        if isinstance(item, str):
            asked += parse_effects(item) if item.strip() else []
        elif isinstance(item, (EffectRequest, Effect)):
            asked.append(item)
        else:
            raise InputError(f"effects holds {item!r}; expected names, EffectRequest or Effect")
    return asked, [item for item in asked if isinstance(item, Effect)]


def evaluated(own: Sequence[Effect], robot: Robot, data: Measurements) -> list[OwnEffect]:
    """The own effects' values for `data`."""
    return [effect.evaluate(robot, data) for effect in own]


def name_list(names: str | Sequence[str]) -> list[str]:
    if isinstance(names, str):
        return [name.strip() for name in names.split(",") if name.strip()]
    return list(names)


def own_effects(effects: Effect | Iterable[Effect]) -> list[Effect]:
    own = [effects] if isinstance(effects, Effect) else list(effects)
    for effect in own:
        if not isinstance(effect, Effect):
            raise InputError(
                f"effects holds {effect!r}: only definitions of own effects are needed here; effects of the"
                " catalogue are known"
            )
    return own


def markdown_table() -> str:
    """The table of docs/reference/effects.md: what every effect of the catalogue is, from its traits."""
    lines = ["| name | law: what is added, where | parameters | needs |", "| --- | --- | --- | --- |"]
    for effect in catalogue_effects():
        name = effect.name + ("@96" if effect.traits.search == "by_order" else "")
        law, parameters, needs = effect.traits.documentation
        lines.append(f"| `{name}` | {law} | {parameters} | {needs} |".replace("|  |", "| |"))
    return "\n".join(lines) + "\n"
