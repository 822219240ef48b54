# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated measurements: a hidden true robot, and what an instrument would read from it.

The truth is a copy of the nominal robot with errors drawn on its parameters; where its target is,
`truing.predict` says. So these data test estimation and bookkeeping, not the model itself: what no model here
knows is not in them either.
"""

from __future__ import annotations

import fnmatch
import functools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.effects import Effect, evaluated, own_effects as as_list
from truing.errors import InputError

Floats = NDArray[np.float64]

FORMAT = "truing-truth/1"
COLUMNS = ("dir", "payload", "temp", "t")
SECONDS_PER_POSE = 20.0
LARGEST_PAYLOAD = 10.0  # [kg]
# The inputs that effects are functions of, as far as they can be simulated: an effect brings its own along.
_COLUMN_OF_DRIVER = {"direction": "dir", "temperature": "temp", "time": "t"}
_NEAR_PARALLEL = math.sin(math.radians(5.0))


@dataclass(frozen=True)
class TrueEffect:
    """An effect of the true robot: its size at one joint."""

    effect: str
    joint: str
    parameter: str  # full name, e.g. "backlash.J2"
    value: float


@dataclass(frozen=True)
class Truth:
    """The robot behind simulated measurements."""

    robot: _core.Robot
    parameters: Mapping[
        str, tuple[float, float, str]
    ]  # name: (nominal, true, unit) of every value that differs
    effects: Sequence[TrueEffect] = ()
    own_effects: Sequence[Effect] = ()  # definitions of those that are not in the catalogue


@dataclass(frozen=True)
class Simulation:
    """Simulated measurements, and everything that a calibration should find out about them."""

    truth: Truth
    data: _core.Measurements
    noise: float  # of one position component [m]
    rotation_noise: float  # of one rotation component [rad]; 0: no orientation measured
    outlier_rows: tuple[int, ...]
    outlier_length: float  # [m]
    seed: int
    columns: tuple[str, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """What ``truth.json`` holds. The true robot is what a robot file has under the same keys."""
        import yaml

        from truing.files import robot_to_yaml

        return {
            "format": FORMAT,
            "robot": yaml.safe_load(robot_to_yaml(self.truth.robot)),
            "parameters": {
                name: {"nominal": nominal, "true": true, "unit": unit}
                for name, (nominal, true, unit) in self.truth.parameters.items()
            },
            "effects": [
                {"effect": e.effect, "joint": e.joint, "parameter": e.parameter, "value": e.value}
                for e in self.truth.effects
            ],
            "noise_m": self.noise,
            "rotation_noise_rad": self.rotation_noise,
            "outlier_rows": list(self.outlier_rows),
            "outlier_m": self.outlier_length,
            "columns": list(self.columns),
            "rows": self.data.rows,
            "seed": self.seed,
        }


def simulate(
    robot: _core.Robot,
    *,
    joints: Floats | None = None,
    poses: int = 200,
    effects: Mapping[str, float | None] | None = None,
    own_effects: Effect | Iterable[Effect] = (),
    noise: float = 3e-5,
    lengths: float = 1e-3,
    angles: float = 1e-3,
    ratios: float = 0.0,
    only: Iterable[str] = (),
    orientation: bool = False,
    rotation_noise: float = 1e-4,
    outlier_share: float = 0.0,
    outlier_length: float = 5e-3,
    columns: Iterable[str] = (),
    base_unknown: bool = False,
    seed: int = 0,
) -> Simulation:
    """Hides errors in a copy of `robot` and measures it: `true_robot`, then `measure`; see these for the
    arguments.

    simulated = truing.simulate(robot, poses=100, effects={"backlash.J2": 2e-4}, seed=1)
    found = truing.identify(robot, simulated.data, effects="backlash:J2")
    simulated.truth.parameters  # what should have been found
    """
    truth = true_robot(
        robot,
        lengths=lengths,
        angles=angles,
        ratios=ratios,
        only=only,
        effects=effects,
        own_effects=own_effects,
        base_unknown=base_unknown,
        seed=seed,
    )
    known = _known(truth.own_effects)
    # Without approach directions there is no backlash.
    drivers = [known[effect.effect.partition("@")[0]].traits.driver for effect in truth.effects]
    wanted = [*columns, *(_COLUMN_OF_DRIVER[driver] for driver in drivers if driver in _COLUMN_OF_DRIVER)]
    return measure(
        truth,
        joints=joints,
        poses=poses,
        noise=noise,
        orientation=orientation,
        rotation_noise=rotation_noise,
        outlier_share=outlier_share,
        outlier_length=outlier_length,
        columns=wanted,
        seed=seed,
    )


def true_robot(
    nominal: _core.Robot,
    *,
    lengths: float = 1e-3,
    angles: float = 1e-3,
    ratios: float = 0.0,
    only: Iterable[str] = (),
    effects: Mapping[str, float | None] | None = None,
    own_effects: Effect | Iterable[Effect] = (),
    base_unknown: bool = False,
    seed: int = 0,
) -> Truth:
    """A copy of `nominal` with hidden errors.

    Args:
        lengths: Standard deviation of the errors of link lengths, link offsets and the tool [m].
        angles: Of joint zeros and link twists [rad].
        ratios: Of gear ratios [-].
        only: Names and globs of the values that get errors ("J2.*", "*.offset"); empty: all.
        effects: Effects that the true robot has as well, by parameter and in SI: {"backlash.J2": 2e-4,
            "harmonic.J3.cos1": 1e-4, "gear_ratio.J1": 1e-4}. None: a size is drawn, about as large as the
            effect usually is.
        own_effects: Definitions of effects that are not in the catalogue; `effects` asks for them by their
            parameters.
        base_unknown: Put the robot somewhere else in the measurement frame: within 2 m, turned about z,
            tilted by up to 2 degrees.
        seed: The same seed gives the same robot, whatever is measured on it.
    """
    robot = nominal.copy()
    rng = np.random.default_rng([seed, 1])
    errors = _Errors(tuple(only))
    errors.add_to_values(robot, {"m": lengths, "rad": angles, "-": ratios}, rng)
    errors.add_to_frames(robot, lengths, angles, rng)
    errors.require_all_met(robot)
    own = as_list(own_effects)
    known = _known(own)
    draw = np.random.default_rng([seed, 6])
    hidden = tuple(_true_effect(robot, name, value, known, draw) for name, value in (effects or {}).items())
    _add_effects(robot, hidden, errors.changed, known)
    if base_unknown:
        place = np.eye(4)
        place[:3, 3] = rng.uniform(-2, 2, 3)
        place[:3, :3] = _core.rotation_from_rpy(
            rng.uniform([-0.035, -0.035, -math.pi], [0.035, 0.035, math.pi])
        )
        robot.T_measurement_base = place
    return Truth(robot, errors.changed, hidden, tuple(own))


@dataclass
class _Errors:
    """Errors that are put on a robot's parameters. One is drawn for every value: `only` does not change the
    others.
    """

    only: tuple[str, ...]  # names and globs; empty: all
    changed: dict[str, tuple[float, float, str]] = field(default_factory=dict)  # nominal, true, unit
    met: set[str] = field(default_factory=set)  # patterns that mean something

    def _wanted(self, name: str) -> bool:
        matching = {pattern for pattern in self.only if fnmatch.fnmatchcase(name, pattern)}
        self.met |= matching
        return bool(matching) or not self.only

    def add_to_values(self, robot: _core.Robot, sigma: Mapping[str, float], rng: np.random.Generator) -> None:
        """sigma: standard deviations by unit."""
        for owner, attribute, name, unit in _values(robot):
            error = float(rng.normal()) * sigma[unit]
            if self._wanted(name) and error:
                before = float(getattr(owner, attribute))
                setattr(owner, attribute, before + error)
                self.changed[name] = (before, before + error, unit)

    def add_to_frames(
        self, robot: _core.Robot, lengths: float, angles: float, rng: np.random.Generator
    ) -> None:
        """lengths, angles: standard deviations [m], [rad]."""
        for name, frame_of, apply in _frames(robot):
            draws = rng.normal(size=6) * np.repeat([lengths, angles], 3)
            wanted = [self._wanted(f"{name}.{axis}") for axis in ("x", "y", "z", "rx", "ry", "rz")]
            draws[~np.array(wanted)] = 0.0
            if not draws.any():
                continue
            frame = np.array(frame_of)
            moved = frame.copy()
            moved[:3, 3] += draws[:3]
            moved[:3, :3] = _core.rotation_from_rpy(draws[3:]) @ frame[:3, :3]
            apply(moved)
            for k, axis in enumerate("xyz"):
                if draws[k]:
                    self.changed[f"{name}.{axis}"] = (float(frame[k, 3]), float(moved[k, 3]), "m")
            for k, axis in enumerate(("rx", "ry", "rz")):
                if draws[3 + k]:
                    self.changed[f"{name}.{axis}"] = (0.0, float(draws[3 + k]), "rad")

    def require_all_met(self, robot: _core.Robot) -> None:
        for pattern in self.only:
            if pattern not in self.met and not pattern.startswith("base."):
                raise InputError(
                    f"{pattern!r} means no value of robot {robot.name!r} that an error can be put on"
                )


def measure(
    truth: Truth,
    *,
    joints: Floats | None = None,
    poses: int = 200,
    noise: float = 3e-5,
    orientation: bool = False,
    rotation_noise: float = 1e-4,
    outlier_share: float = 0.0,
    outlier_length: float = 5e-3,
    columns: Iterable[str] = (),
    seed: int = 0,
) -> Simulation:
    """Measures `truth` at `joints`, or at `poses` random configurations within the joint limits.

    Args:
        joints: shape=(n, driven joints) [rad | m].
        noise: Standard deviation of each measured coordinate [m].
        orientation: Measure orientations too, with `rotation_noise` [rad] about each axis.
        outlier_share: Fraction of the rows that is off by `outlier_length` [m] in a random direction.
        columns: More recorded inputs, of "dir" (approach directions), "payload", "temp", "t", for effects
            to act on.
    """
    robot = truth.robot
    wanted = tuple(dict.fromkeys(columns))
    unknown = [name for name in wanted if name not in COLUMNS]
    if unknown:
        raise InputError(f"column {unknown[0]!r} cannot be simulated; there are {', '.join(COLUMNS)}")
    if not 0 <= outlier_share < 1:
        raise InputError(f"share of outliers: found {outlier_share:g}, expected 0 to 1")
    if noise < 0 or rotation_noise < 0 or outlier_length < 0:
        raise InputError("noise and the length of outliers must not be negative")
    if joints is None:
        if poses < 1:
            raise InputError(f"poses: found {poses}, expected at least 1")
        joints = random_joints(robot, poses, seed)
    n = len(joints)
    inputs = _inputs(robot, n, wanted, seed)
    recorded = _core.Measurements(joints, **inputs)
    predicted = _core.predict(robot, recorded, evaluated(truth.own_effects, robot, recorded))

    rng = np.random.default_rng([seed, 3])
    positions = predicted.position + noise * rng.normal(size=(n, 3))
    orientations = None
    if orientation:
        orientations = _turned(np.asarray(predicted.orientation), rotation_noise * rng.normal(size=(n, 3)))
    rng = np.random.default_rng([seed, 4])
    rows = np.sort(rng.choice(n, size=round(outlier_share * n), replace=False))
    away = rng.normal(size=(rows.size, 3))
    positions[rows] += outlier_length * away / np.linalg.norm(away, axis=1, keepdims=True)
    data = _core.Measurements(joints, positions=positions, orientations=orientations, **inputs)
    return Simulation(
        truth,
        data,
        noise,
        rotation_noise if orientation else 0.0,
        tuple(int(row) for row in rows),
        outlier_length if rows.size else 0.0,
        seed,
        wanted,
    )


def random_joints(robot: _core.Robot, count: int, seed: int = 0) -> Floats:
    """Configurations drawn evenly between the joint limits, shape=(count, driven joints) [rad | m].

    Revolute joints without limits use -pi to pi; a prismatic joint must have limits, or InputError is raised.
    """
    bounds = []
    for index in robot.driven_joints():
        joint = robot.joints[index]
        lower, upper = joint.lower, joint.upper
        if joint.type == "revolute":
            lower, upper = (
                max(lower, -math.pi) if math.isinf(lower) else lower,
                min(upper, math.pi) if math.isinf(upper) else upper,
            )
        if not (math.isfinite(lower) and math.isfinite(upper)):
            raise InputError(
                f"joint {joint.name} is prismatic and has no limits: give it `limits` in the robot file to"
                " draw poses from"
            )
        bounds.append((lower, upper))
    low, high = np.array(bounds).T
    return np.random.default_rng([seed, 2]).uniform(low, high, (count, len(bounds)))


@dataclass(frozen=True)
class _Known:
    """An effect that can be hidden."""

    name: str
    traits: _core.EffectTraits
    per_joint: bool
    own: Effect | None = None


@functools.lru_cache(maxsize=1)
def _catalogue() -> tuple[_Known, ...]:
    return tuple(_Known(e.name, e.traits, e.per_joint) for e in _core.catalogue_effects())


def _known(own: Iterable[Effect]) -> dict[str, _Known]:
    """Every effect by name. Not in it: geometry and frames, which have options of their own."""
    effects = [*_catalogue(), *(_Known(e.name, e.traits, True, e) for e in own)]
    return {e.name: e for e in effects if e.traits.stands_for in ("", "ratio", "offset")}


def _true_effect(
    robot: _core.Robot, name: str, value: float | None, known: Mapping[str, _Known], draw: np.random.Generator
) -> TrueEffect:
    """The effect that a parameter name stands for. Raises InputError that lists the effects there are."""
    found = re.fullmatch(r"([a-z_]+(?:@\d+(?:\.\d+)?)?)(?:\.(.*))?", name)
    effect, rest = (found[1], found[2] or "") if found else (name.partition(".")[0], name.partition(".")[2])
    which = known.get(effect.partition("@")[0])
    if which is None:
        raise InputError(
            f"effect {effect!r} cannot be simulated; there are {', '.join(known)} (link geometry, base and"
            " tool come from options of their own)"
        )
    size = _drawn_size(which, draw) if value is None else value
    if which.own is not None:
        return TrueEffect(effect, _joint_of_own(which.own, robot, rest), name, size)
    if not which.per_joint:
        return TrueEffect(effect, "", name, size)
    joint, _, part = rest.partition(".")
    robot.joint_index(joint)  # raises, and lists the joints
    attribute = which.traits.stands_for
    if attribute:
        if part:
            raise InputError(f"{effect} has one parameter only, found {name!r}")
        return TrueEffect(effect, joint, f"{joint}.{attribute}", size)
    suffix = part or which.traits.main_part
    return TrueEffect(effect, joint, f"{effect}.{joint}" + (f".{suffix}" if suffix else ""), size)


def _drawn_size(effect: _Known, draw: np.random.Generator) -> float:
    """Of either sign, half to one and a half times the usual size."""
    if not effect.traits.usual > 0:
        raise InputError(f"effect {effect.name!r} does not say how large it usually is: give a size")
    return float(effect.traits.usual * draw.uniform(0.5, 1.5) * draw.choice([-1.0, 1.0]))


def _joint_of_own(effect: Effect, robot: _core.Robot, parameter: str) -> str:
    """The joint that a parameter of an own effect, less the effect's name, is listed under."""
    places = effect.places(robot)
    for joint, site in places:
        if parameter == site or parameter.startswith(site + "."):
            return joint
    raise InputError(
        f"effect {effect.name!r} has no parameter {parameter!r}; it acts at {', '.join(s for _, s in places)}"
    )


def _values(robot: _core.Robot) -> Iterator[tuple[Any, str, str, str]]:
    """Object, attribute, parameter name and unit of every single value that can be wrong."""
    last = len(robot.joints) - 1
    for index, joint in enumerate(robot.joints):
        if robot.convention != "urdf":
            yield joint, "a", f"{joint.name}.a", "m"
            yield joint, "d", f"{joint.name}.d", "m"
            yield joint, "alpha", f"{joint.name}.alpha", "rad"
            # Between near-parallel axes a small twist about y cannot be said by the four values of DH.
            inner = index < last if robot.convention == "dh" else index > 0
            if inner and joint.type == "revolute" and abs(math.sin(joint.alpha)) < _NEAR_PARALLEL:
                yield joint, "beta", f"{joint.name}.beta", "rad"
        if joint.type == "revolute":
            yield joint, "offset", f"{joint.name}.offset", "rad"
        if not joint.passive:
            yield joint, "ratio", f"{joint.name}.ratio", "-"


def _frames(robot: _core.Robot) -> Iterator[tuple[str, Any, Any]]:
    """Name, value and setter of every frame that can be wrong."""

    def setter(owner: Any, attribute: str) -> Any:
        return lambda frame: setattr(owner, attribute, frame)

    if robot.convention == "urdf":
        for joint in robot.joints:
            yield joint.name, joint.T_parent_joint, setter(joint, "T_parent_joint")
    for target in robot.targets:
        yield target.name, target.T_last_target, setter(target, "T_last_target")


def _add_effects(
    robot: _core.Robot,
    effects: Sequence[TrueEffect],
    changed: dict[str, tuple[float, float, str]],
    known: Mapping[str, _Known],
) -> None:
    applied: dict[tuple[str, str], dict[str, float]] = {}
    for effect in effects:
        attribute = known[effect.effect.partition("@")[0]].traits.stands_for
        if attribute:
            joint = robot.joint(effect.joint)
            before = float(getattr(joint, attribute))
            setattr(joint, attribute, before + effect.value)
            first, _, unit = changed.get(
                effect.parameter, (before, before, "-" if attribute == "ratio" else "rad")
            )
            changed[effect.parameter] = (first, before + effect.value, unit)
        else:
            applied.setdefault((effect.effect, effect.joint), {})[effect.parameter] = effect.value
    if applied:
        robot.effects = [
            *robot.effects,
            *(
                _core.AppliedEffect(name, [joint] if joint else [], values)
                for (name, joint), values in applied.items()
            ),
        ]


def _inputs(robot: _core.Robot, n: int, columns: Sequence[str], seed: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, 5])
    direction = rng.choice([-1.0, 1.0], size=(n, robot.driven_count))
    payload = rng.choice([0.0, 0.5, 1.0], size=n) * LARGEST_PAYLOAD
    time = SECONDS_PER_POSE * np.arange(n)
    temperature = 20.0 + 12.0 * (1.0 - np.exp(-time / max(time[-1] / 3.0, 1.0))) + rng.normal(0.0, 0.1, n)
    every: dict[str, tuple[str, Any]] = {
        "dir": ("directions", direction),
        "payload": ("payload", payload),
        "temp": ("temperature", temperature),
        "t": ("time", time),
    }
    return dict(every[name] for name in columns)


def _turned(quaternions: Floats, rotations: Floats) -> Floats:
    """Quaternions w x y z, turned by small rotation vectors [rad] about the measurement frame's axes."""
    w, v = quaternions[:, :1], quaternions[:, 1:]
    half = 0.5 * rotations
    turned = np.hstack([w - np.sum(half * v, axis=1, keepdims=True), v + w * half + np.cross(half, v)])
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))
