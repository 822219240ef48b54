# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A scene before and after effects are hidden in it: robot, plan, instrument, what is handed over, and the
label.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.random import Generator

import truing
from truing.exam import laws, recordings
from truing.exam.design import Plan, draw, usual_plan
from truing.exam.kinematics import Chain, Floats, NoRestError, chain_of, quaternions
from truing.exam.laws import LISTED, WHOLE_ROBOT, Context, Hidden, Inputs, motor_torque
from truing.exam.names import accepted
from truing.exam.robots import Specimen, specimens
from truing.exam.sizing import View, explained, lookalikes
from truing.exam.worlds import MECHANICAL, Truth

TRIES = 400
SMALL = 1000  # numbers from here on are those of small sets
_FEW = (100, 150)  # their poses
SMALLEST, LARGEST = 0.5, 10.0  # effect over noise
_RETAINED = 0.25  # of an effect must remain once base and tool are fitted
_TOO_LARGE = "no machine has the effect so large"
_OPTIONAL = ("dir", "payload", "temp", "t")

Label = dict[str, Any]


class NoSetError(Exception):
    """A set cannot be made as its family wants it. It is left out, and nothing takes its place."""


@dataclass
class Case:
    """One set, with what only the examiner knows."""

    id: str
    robot: truing.Robot
    data: truing.Measurements
    label: Label
    fresh: Callable[[], truing.Measurements]  # new noisy poses of the same truth


@dataclass(frozen=True)
class Request:
    id: str
    which: str
    family: str
    number: int
    rng: Generator
    anew: Counter[str] = field(default_factory=Counter, compare=False)
    """Why draws were thrown away, and how many."""

    def throw_away(self, why: str) -> None:
        """Notes that a draw is made anew."""
        self.anew[why] += 1

    @property
    def small(self) -> bool:
        """A set that is quickly made and answered: few poses, no robot of seven joints."""
        return self.number >= SMALL

    def poses(self, *usual: int) -> int:
        return int(self.rng.choice(_FEW if self.small else usual))

    def specimens(self) -> list[Specimen]:
        return [
            specimen for specimen in specimens(self.which) if len(specimen.robot.joints) < 7 or not self.small
        ]

    def specimen(self) -> Specimen:
        """A set's own robot, nearly always: were it drawn anew with every attempt, those on which most
        effects fit would be met most.
        """
        every = self.specimens()
        rng = self.rng if self.rng.random() < 0.1 else np.random.default_rng([self.number, len(self.family)])
        return every[int(rng.integers(len(every)))]


# ---- A scene: robot, plan and instrument, before anything is wrong -------------------------------


@dataclass
class Scene:
    """What is known before effects are drawn."""

    request: Request
    specimen: Specimen
    chain: Chain  # true
    robot: truing.Robot  # as handed over
    plan: Plan
    inputs: Inputs
    handed: frozenset[str]
    sigma: float
    physics: bool
    geometry: laws.Law | None = None
    recording: recordings.Recording | None = None
    rows: Any = None  # of the recording
    noise_kind: str = "white"
    columns_from: tuple[
        tuple[int, float], ...
    ] = ()  # of the recorded readings: true column and sign; (): as they are
    context: Context = field(init=False)

    def __post_init__(self) -> None:
        self.context = Context(self.chain, self.inputs)

    @property
    def source(self) -> str:
        return "spike" if self.recording else "physics" if self.physics else "departures"

    def truth(self, hidden: Sequence[Hidden] = ()) -> Truth:
        return Truth(self.specimen, self.chain, self.physics, tuple(hidden), self.geometry, self.context)


def make_scene(
    request: Request,
    source: str,
    *,
    poses: int | None = None,
    masses: bool | None = None,
    needs: frozenset[str] = frozenset(),
    specimen: Specimen | None = None,
    plan: Plan | None = None,
    geometry: bool = False,
    only: frozenset[str] | None = None,
    reshape: Callable[[Plan, Chain, Generator], Plan] | None = None,
) -> Scene:
    """Draws robot, poses and columns. needs: columns that must be there; only: exactly these columns;
    reshape: makes another plan of the usual one.
    """
    if source == "spike":
        return _spike_scene(request, needs, poses)
    rng = request.rng
    chosen = specimen or request.specimen()
    handed = _columns(rng, needs, masses) if only is None else only
    chain = true_chain(chosen, rng)
    count = poses or request.poses(100, 150, 200, 300, 400)
    made = plan or usual_plan(chosen, chain, rng, count, "payload" in handed)
    if reshape:
        made = reshape(made, chain, rng)
    inputs = draw(chosen, chain, made, rng)
    robot = _nominal(chosen, chain, rng, made.targets, "masses" in handed)
    sigma = float(np.exp(rng.uniform(np.log(1e-5), np.log(1e-4))))
    law = laws.all_geometry(chain, rng) if geometry else None
    return Scene(request, chosen, chain, robot, made, inputs, handed, sigma, source == "physics", law)


def _columns(rng: Generator, needs: frozenset[str], masses: bool | None) -> frozenset[str]:
    handed = {name for name in _OPTIONAL if rng.random() < 0.5} | set(needs)
    if masses if masses is not None else rng.random() < 0.5:
        handed.add("masses")
    if rng.random() < 0.25:
        handed.add("orientation")
    if rng.random() < 0.3:
        handed.add(str(rng.choice(["supply_bar", "humidity_pct", "spindle_rpm"])))
    return frozenset(handed)


def true_chain(specimen: Specimen, rng: Generator) -> Chain:
    """The robot where it stands, its links up to 1 % heavier or lighter than the data sheet says."""
    place = truing.frame_from_xyz_rpy(
        rng.uniform(-2.0, 2.0, 3), rng.uniform([-0.03, -0.03, -3.0], [0.03, 0.03, 3.0])
    )
    chain = chain_of(specimen.robot.replace(T_measurement_base=place))
    return replace(chain, mass=chain.mass * rng.uniform(0.99, 1.01, chain.joints))


def _nominal(specimen: Specimen, chain: Chain, rng: Generator, targets: int, masses: bool) -> truing.Robot:
    """What is handed over: rough frames, and masses or none."""
    robot = specimen.robot.copy()
    if not masses:
        robot = robot.replace(
            joints=[joint.replace(mass=None, center_of_mass=np.zeros(3)) for joint in robot.joints]
        )
    kept = []
    for target in list(robot.targets)[:targets]:
        frame = np.array(target.T_last_target)
        frame[:3, 3] += rng.normal(0.0, 5e-3, 3)
        kept.append(truing.Target(target.name, frame))
    base = chain.base.copy() if rng.random() < 0.5 else np.eye(4)
    base[:3, 3] += rng.normal(0.0, 1e-2, 3) if base[0, 0] != 1.0 else 0.0
    return robot.replace(targets=kept, T_measurement_base=base)


def _spike_scene(request: Request, needs: frozenset[str], poses: int | None) -> Scene:
    rng = request.rng
    why = recordings.missing(request.which)
    if why:
        raise NoSetError(why)
    sources = recordings.recordings(request.which)
    recording = sources[int(rng.integers(len(sources)))]
    every = np.unique(recording.inputs.pose)
    count = min(poses or request.poses(150, 250, 350), max(int(0.7 * len(every)), 20))
    chosen = np.sort(rng.choice(every, size=count, replace=False))
    inside = np.isin(recording.inputs.pose, chosen)
    if len(np.unique(recording.inputs.target)) > 1 and rng.random() < 0.6:  # one reflector only
        inside &= recording.inputs.target == int(rng.choice(np.unique(recording.inputs.target)))
    rows = np.flatnonzero(inside)
    inputs = recordings.rows_of(recording.inputs, rows)
    low, high = inputs.readings.min(axis=0), inputs.readings.max(axis=0)
    plan = Plan(low, high, count)
    handed = frozenset({"pose"} | {name for name in ("dir", "t") if rng.random() < 0.7} | set(needs))
    return Scene(
        request,
        recording.specimen,
        recording.chain,
        recording.nominal,
        plan,
        inputs,
        handed,
        recording.sigma,
        False,
        recording=recording,
        rows=rows,
        noise_kind="real",
    )


# ---- Drawing effects -----------------------------------------------------------------------------

_WEIGHTS = {
    "joint_compliance": 15,
    "backlash": 14,
    "harmonic": 12,
    "gear_ratio": 8,
    "joint_offset": 8,
    "link_geometry": 8,
    "thermal": 6,
    "thermal_zero": 4,
    "gravity_backlash": 5,
    "drift": 5,
    "axis_wobble": 4,
    "link_compliance": 3,
    "joint_coupling": 3,
    "scale": 2,
    "transmission_error": 3,
    "windup": 3,
    "time_offset": 2,
    "linkage": 12,
}
_SPIKES = {
    "backlash": 5,
    "harmonic": 4,
    "gear_ratio": 3,
    "joint_offset": 3,
    "link_geometry": 3,
    "joint_coupling": 1,
    "axis_wobble": 1,
    "drift": 1,
}
GEOMETRIC = frozenset({"joint_offset", "link_geometry", "scale"})
NEED_MASSES = frozenset({"gravity_backlash", "link_compliance"})
_TURN = 2.5  # [rad] of travel that a once-per-turn effect needs


def draw_name(rng: Generator, source: str, *, without: frozenset[str] = frozenset()) -> str:
    weights = dict(_SPIKES if source == "spike" else _WEIGHTS)
    if source == "departures":
        weights.pop("linkage")
        weights.pop("link_compliance")
    names = [name for name in weights if name not in without]
    chances = np.array([weights[name] for name in names], dtype=float)
    return str(rng.choice(names, p=chances / chances.sum()))


def places_of(name: str, scene: Scene) -> list[int]:
    """Joints at which an effect can sit on this robot."""
    chain = scene.chain
    loop = scene.specimen.rod_arm > 0.0
    if name == "linkage":
        return [j for j in range(chain.joints) if j not in chain.driven] if loop else []
    if name == "joint_coupling":
        return [chain.joints - 1] if scene.specimen.wrist else []
    if name in WHOLE_ROBOT:
        return [0]
    if name == "link_compliance":
        return [] if loop else _long_links(scene)
    if name == "link_geometry":
        return [j for j in range(chain.joints) if j in chain.driven]
    if name == "thermal":
        long = np.abs(chain.links[:, :2]).max(axis=1) > 0.1
        return [j for j in range(chain.joints) if j in chain.driven and long[j]]
    if name in ("harmonic", "axis_wobble", "transmission_error"):
        closed = (1, 2) if loop and name == "axis_wobble" else ()
        return [j for j in _turning(scene) if j not in closed]
    if name in ("gear_ratio", "backlash"):
        return list(chain.driven)
    if name in ("joint_compliance", "gravity_backlash", "windup"):
        return _loaded(scene, both_sides=name == "gravity_backlash")
    return chain.revolute


def _turning(scene: Scene) -> list[int]:
    """Revolute joints that turn far enough for what changes with the angle."""
    return [j for j in scene.chain.revolute if float(np.ptp(scene.context.motion[:, j])) > _TURN]


def _loaded(scene: Scene, both_sides: bool) -> list[int]:
    """Joints that carry weight, on both sides of balance if need be."""
    torque = scene.context.torque
    # Where little weighs, a wrong tool or a wrong mass turns the sign of the torque.
    least = (2e-2 if both_sides else 3e-3) * float(np.abs(torque).max())
    found = []
    for j in scene.chain.driven:
        ahead = float(np.mean(torque[:, j] > 0.0))
        if (
            float(np.abs(torque[:, j]).max()) > least
            and not scene.chain.prismatic[j]
            and (not both_sides or 0.05 < ahead < 0.95)
        ):
            found.append(j)
    return found


def _long_links(scene: Scene) -> list[int]:
    state = scene.context.state
    ways = state.joint_origin[1:] - state.joint_origin[:-1]
    return [
        j
        for j in range(scene.chain.joints - 1)
        if float(np.linalg.norm(ways[j], axis=1).max()) > 0.2 and j in scene.chain.driven
    ]


def draw_effect(
    scene: Scene, name: str, view: View, over_noise: float, depart: float = 0.0
) -> tuple[Hidden, Floats] | None:
    """An effect of a stated size at a joint where it can be seen, and how it moves the tips. None: not on
    this robot, not so large.
    """
    rng = scene.request.rng
    places = places_of(name, scene)
    if not places:
        scene.request.throw_away("no joint of this robot has the effect")
        return None
    place = int(rng.choice(places))
    return sized(scene, LISTED[name](place, rng, depart), view, over_noise)


def sized(scene: Scene, hidden: Hidden, view: View, over_noise: float) -> tuple[Hidden, Floats] | None:
    """An effect so large that what is seen of it is `over_noise` times the noise, and how it moves the tips,
    shape=(n, 3) [m]. None: frames absorb it, no machine has it so large, or the arm buckles.
    """
    try:
        return _sized(scene, hidden, view, over_noise)
    except NoRestError:
        scene.request.throw_away("the arm buckles under its own weight")
        return None


def _sized(scene: Scene, hidden: Hidden, view: View, over_noise: float) -> tuple[Hidden, Floats] | None:
    unit = hidden.law(scene.context)
    first = view.displaced(unit)
    seen, raw = view.rms(first), _spread(first)
    thrown = scene.request.throw_away
    if raw < 1e-12 or seen < _RETAINED * raw:
        return thrown("fitted frames absorb the effect")
    target = over_noise * scene.sigma
    hidden = hidden.sized(target / seen)
    if not sensible(scene, hidden):
        return thrown(_TOO_LARGE)
    moved = moved_by(scene, hidden)
    if scene.physics and hidden.effect in MECHANICAL:
        found = view.rms(moved)
        if found < 0.05 * target:
            return thrown("the simulated effect is below its size")
        hidden = hidden.sized(hidden.size * target / found)
        moved = moved_by(scene, hidden)
    if abs(view.rms(moved) / target - 1.0) > 0.1:
        return thrown("the simulated effect is not of its size")
    if not sensible(scene, hidden):
        return thrown(_TOO_LARGE)
    if not _changes_enough(scene, hidden, view, moved):
        return thrown("a warm robot does nothing but wrong link values")
    return hidden, moved


def _changes_enough(scene: Scene, hidden: Hidden, view: View, moved: Floats) -> bool:
    """What a warm robot does beyond wrong link values: a robot that is always equally warm has other links,
    no more can be asked.
    """
    if not hidden.warms:
        return True
    constant = explained(view, moved, view.geometry_columns(hidden.joints or None))
    return bool(view.rms(moved) * np.sqrt(max(1.0 - constant, 0.0)) >= SMALLEST * scene.sigma)


def moved_by(scene: Scene, hidden: Hidden) -> Floats:
    """How an effect moves the tips, shape=(n, 3) [m]."""
    truth = scene.truth()
    return np.asarray(truth.observe(scene.inputs, [hidden])[0] - truth.observe(scene.inputs, [])[0])


def _spread(moved: Floats) -> float:
    centered = moved - moved.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(centered**2, axis=1)) + 1e-3 * np.mean(np.sum(moved**2, axis=1))))


# What machines really do: largest changes [rad, m, 1/K], whatever the noise.
_MOST_MOTION = {
    "joint_offset": 0.02,
    "gear_ratio": 0.01,
    "transmission_error": 6e-4,
    "thermal_zero": 1.5e-3,
    "time_offset": 0.012,
    "joint_coupling": 6e-3,
    "backlash": 1.5e-3,
    "gravity_backlash": 1e-3,
    "teeth": 6e-4,
    "neighbour": 6e-3,
}
_MOST = 5e-3
# Of an axis that wobbles, as the catalogue has it: bearings of 50 to 120 mm run out by up to 25 um (ISO 492,
# class Normal), so that two of them 50 mm apart lean by 1 mrad at most.
_MOST_WOBBLE = 2e-3
_MOST_EXPANSION = 4e-5
_MOST_SCALE = 5e-4


def sensible(scene: Scene, hidden: Hidden) -> bool:
    """Whether machines have the effect so large."""
    changes = hidden.changes(scene.context)
    if hidden.effect in ("thermal", "warm_robot"):
        return hidden.size < _MOST_EXPANSION
    if hidden.effect == "linkage":
        return hidden.size * scene.specimen.rod_arm < 3e-3
    return bool(
        np.abs(changes.motion).max() < _MOST_MOTION.get(hidden.effect, _MOST)
        and np.abs(changes.links[:, :, :2]).max() < 4e-3
        and max(np.abs(changes.links[:, :, 2:]).max(), np.abs(changes.bend).max()) < _MOST
        and np.abs(changes.tilt).max() < _MOST_WOBBLE
        and np.abs(changes.base).max() < 4e-3
        and np.abs(changes.scale).max() < _MOST_SCALE
    )


def draw_size(rng: Generator, low: float = SMALLEST, high: float = LARGEST) -> float:
    """A size over noise, its logarithm uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# ---- Handing over --------------------------------------------------------------------------------


def _measured(
    scene: Scene, truth: Truth, inputs: Inputs, rng: Generator, noise: Floats | None = None
) -> truing.Measurements:
    """Noisy measurements with the columns that are handed over."""
    tip, rotation = truth.observe(inputs)
    n = inputs.rows
    positions = tip + (noise if noise is not None else _noise(scene, rng, n))
    handed = scene.handed
    columns: dict[str, Any] = {"positions": positions}
    if "orientation" in handed:
        columns["orientations"] = quaternions(
            recordings.turned(rotation, rng.normal(0.0, scene.sigma / 0.15, (n, 3)))
        )
    if "dir" in handed:
        columns["directions"] = inputs.direction
    if "payload" in handed:
        columns["payload"] = inputs.payload
    if "temp" in handed:
        columns["temperature"] = inputs.temperature
    if "t" in handed:
        columns["time"] = inputs.time
    if "speed" in handed:
        columns["joint_speeds"] = inputs.speed
    if len(scene.robot.targets) > 1:
        columns["targets"] = inputs.target.astype(np.int32)
    if len(scene.robot.targets) > 1 or scene.plan.repeats > 0 or "pose" in handed:
        columns["pose"] = _pose_names(inputs)
    columns["covariates"] = _covariates(scene, truth, inputs, handed)
    return truing.Measurements(_recorded(scene, inputs.readings), robot=scene.robot, **columns)


def _recorded(scene: Scene, readings: Floats) -> Floats:
    """Readings as somebody wrote them down, be it in exchanged columns or with the wrong sign."""
    if not scene.columns_from:
        return readings.copy()
    return np.stack([sign * readings[:, column] for column, sign in scene.columns_from], axis=1)


def _pose_names(inputs: Inputs) -> Any:
    """Rows of one robot pose share a number, repeats included."""
    _, number = np.unique(inputs.readings, axis=0, return_inverse=True)
    return np.asarray(number).ravel().astype(np.int32)


def _covariates(scene: Scene, truth: Truth, inputs: Inputs, handed: frozenset[str]) -> dict[str, Floats]:
    found = {name: values for name, values in inputs.covariates.items() if name in handed}
    if "bare_tau" in handed:  # as a model would give it: weight without friction
        weight = Context(scene.chain, inputs).torque
        found.update(
            {f"tau{scene.chain.number(j)}_{_unit(scene.chain, j)}": -weight[:, j] for j in scene.chain.driven}
        )
    if "tau" in handed:
        context = Context(scene.chain, inputs, truth.of)
        friction = {
            effect.joints[0]: effect.detail["friction"]
            for effect in truth.hidden
            if "friction" in effect.detail
        }
        for j in scene.chain.driven:
            found[f"tau{scene.chain.number(j)}_{_unit(scene.chain, j)}"] = motor_torque(
                context, j, friction.get(j, 0.3)
            )
    return found


def _unit(chain: Chain, joint: int) -> str:
    return "N" if chain.prismatic[joint] else "Nm"


def _noise(scene: Scene, rng: Generator, n: int) -> Floats:
    if scene.noise_kind == "heavy":
        return np.asarray(rng.standard_t(3, (n, 3)) * scene.sigma / np.sqrt(3.0))
    noise = rng.normal(0.0, scene.sigma, (n, 3))
    if scene.noise_kind == "outliers":
        bad = rng.choice(n, size=max(1, round(float(rng.uniform(0.03, 0.05)) * n)), replace=False)
        away = rng.normal(size=(len(bad), 3))
        noise[bad] += (
            away
            / np.linalg.norm(away, axis=1, keepdims=True)
            * scene.sigma
            * rng.uniform(15.0, 60.0, (len(bad), 1))
        )
    return np.asarray(noise)


def make_case(scene: Scene, hidden: Sequence[Hidden], sizes: Sequence[float], **more: Any) -> Case:
    """Measures the truth and writes the label."""
    rng = scene.request.rng
    truth = scene.truth(hidden)
    noise = scene.recording.noise[scene.rows] if scene.recording else None
    data = _measured(scene, truth, scene.inputs, rng, noise)
    label: Label = {
        "family": scene.request.family,
        "source": scene.source,
        "robot": scene.specimen.name,
        "effects": [named_effect(scene.chain, accepted(h.effect)[0], h.joints) for h in hidden if h.listed],
        "geometry_underneath": scene.geometry is not None,
        "acceptable": [],
        "unlisted": "",
        "unlisted_joint": "",
        "unlisted_inputs": [],
        "size_over_noise": min(sizes) if sizes else 0.0,
        "sizes": list(sizes),
        "sigma": scene.sigma,
        "noise": scene.noise_kind,
        "rows": scene.inputs.rows,
        "columns": sorted(scene.handed),
        "parameters": [_parameter(h) for h in hidden],
        "drawn_anew": dict(sorted(scene.request.anew.items())),
    }
    label.update(more)
    if scene.recording:
        label["robot"] = scene.recording.name
    seed = int(rng.integers(2**31))
    return Case(scene.request.id, scene.robot, data, label, lambda: _fresh(scene, truth, seed))


def named_effect(chain: Chain, effect: str, joints: Sequence[int]) -> dict[str, Any]:
    return {
        "effect": effect,
        "joints": [] if effect in WHOLE_ROBOT else [chain.names[j] for j in joints if j >= 0],
    }


def _parameter(hidden: Hidden) -> dict[str, Any]:
    return {"effect": hidden.effect, "size": hidden.size, **hidden.detail}


def _fresh(scene: Scene, truth: Truth, seed: int) -> truing.Measurements:
    """200 new noisy poses, or of a recording those that were held back. Gross errors of the instrument stay
    at home.
    """
    rng = np.random.default_rng(seed)
    if scene.recording is None:
        quiet = replace(scene, noise_kind="white")
        return _measured(quiet, truth, draw(scene.specimen, scene.chain, scene.plan, rng, fresh=200), rng)
    recording = scene.recording
    used = np.isin(recording.inputs.pose, np.unique(scene.inputs.pose))
    rows = np.flatnonzero(~used & np.isin(recording.inputs.target, np.unique(scene.inputs.target)))
    rows = np.sort(rng.choice(rows, size=min(200, len(rows)), replace=False))
    return _measured(scene, truth, recordings.rows_of(recording.inputs, rows), rng, recording.noise[rows])


def acceptable_for(
    scene: Scene, view: View, hidden: Hidden, moved: Floats, of: int | None = 0
) -> list[dict[str, Any]]:
    """Other answers that are as right. of: place among the label's effects of the one that they stand
    for; None: they may be named, and stand for none.
    """
    found = [
        named_effect(scene.chain, effect, (joint,))
        for effect, joint in lookalikes(view, moved, hidden, scene.handed)
    ]
    found += other_names(scene, hidden)
    return [{**item, "of": of} for k, item in enumerate(found) if item not in found[:k]]


def other_names(scene: Scene, hidden: Hidden) -> list[dict[str, Any]]:
    """What the effect may be called besides its own name, however it looks."""
    names = list(accepted(hidden.effect)[1:])
    if hidden.effect == "joint_offset":
        names.append("link_geometry")
    if hidden.effect == "joint_compliance" and "masses" not in scene.handed:
        names.append("gravity_moment")
    if hidden.effect == "joint_compliance" and (
        hidden.detail.get("depart", 0.0) > 0.3 or "dead_band" in hidden.detail
    ):
        names.append("stiffness_zones")
    if hidden.effect == "linkage":
        names.append("harmonic")
    return [named_effect(scene.chain, name, hidden.joints) for name in names]
