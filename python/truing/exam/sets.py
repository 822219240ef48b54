# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The sets of the examination: `make("development/single/12")` gives robot, data and label of one of them,
the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.random import Generator

import truing
from truing.exam import laws, recordings
from truing.exam.confounded import Twin, twins
from truing.exam.design import Plan, draw, usual_plan
from truing.exam.kinematics import Chain, Floats, chain_of, quaternions
from truing.exam.laws import LISTED, WHOLE_ROBOT, Context, Hidden, Inputs, motor_torque
from truing.exam.robots import Specimen, specimens
from truing.exam.sizing import SAME, View, explained, lookalikes, rivals
from truing.exam.surprises import Surprise, surprises
from truing.exam.worlds import MECHANICAL, Truth

COUNTS = {
    "none": 120,
    "single": 300,
    "double": 150,
    "confounded": 80,
    "wrong_law": 80,
    "unlisted": 120,
    "missing": 40,
    "twenty": 40,
}
QUICK = {
    "none": 12,
    "single": 18,
    "double": 8,
    "confounded": 6,
    "wrong_law": 4,
    "unlisted": 8,
    "missing": 2,
    "twenty": 2,
}
WHICH = ("development", "examination")
_TRIES = 400
_SMALL = 1000  # numbers from here on are those of small sets
_FEW = (100, 150)  # their poses
_SMALLEST, _LARGEST = 0.5, 10.0  # effect over noise
_RETAINED = 0.25  # of an effect must remain once base and tool are fitted
_OPTIONAL = ("dir", "payload", "temp", "t")

Label = dict[str, Any]


@dataclass
class Case:
    """One set, with what only the examiner knows."""

    id: str
    robot: truing.Robot
    data: truing.Measurements
    label: Label
    fresh: Callable[[], truing.Measurements]  # new noisy poses of the same truth


def ids(
    which: str, *, quick: bool = False, families: Sequence[str] | None = None, seed: int = 0
) -> list[str]:
    """Names of all sets of an examination. Quick: a few small ones of each family, that the whole examination
    does not have.
    """
    found = []
    for family in families or COUNTS:
        first, count = (_SMALL, QUICK[family]) if quick else (0, COUNTS[family])
        found += [f"{which}/{family}/{k}" + (f"@{seed}" if seed else "") for k in range(first, first + count)]
    return found


def make(id: str) -> tuple[truing.Robot, truing.Measurements, Label]:
    """Robot, data and label of a set."""
    case = build(id)
    return case.robot, case.data, case.label


def build(id: str) -> Case:
    """A set with everything about it. id: "development/single/12", with "@7" after it for another seed than
    0.
    """
    words, _, seed = id.partition("@")
    which, family, number = words.split("/")
    if which not in WHICH or family not in COUNTS:
        raise ValueError(f"no set {id!r}: expected {'|'.join(WHICH)}/{'|'.join(COUNTS)}/number")
    rng = np.random.default_rng(
        [int(seed or 0), WHICH.index(which), list(COUNTS).index(family), int(number), 77]
    )
    return _FAMILIES[family](Request(id, which, family, int(number), rng))


@dataclass(frozen=True)
class Request:
    id: str
    which: str
    family: str
    number: int
    rng: Generator

    @property
    def small(self) -> bool:
        """A set that is quickly made and answered: few poses, no robot of seven joints."""
        return self.number >= _SMALL

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
    context: Context = field(init=False)

    def __post_init__(self) -> None:
        self.context = Context(self.chain, self.inputs)

    @property
    def source(self) -> str:
        return "spike" if self.recording else "physics" if self.physics else "departures"

    def truth(self, hidden: Sequence[Hidden] = ()) -> Truth:
        return Truth(self.specimen, self.chain, self.physics, tuple(hidden), self.geometry, self.context)


def _scene(
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
) -> Scene:
    """Draws robot, poses and columns. needs: columns that must be there; only: exactly these columns."""
    if source == "spike":
        return _spike_scene(request, needs, poses)
    rng = request.rng
    chosen = specimen or request.specimen()
    handed = _columns(rng, needs, masses) if only is None else only
    chain = _true_chain(chosen, rng)
    count = poses or request.poses(100, 150, 200, 300, 400)
    made = plan or usual_plan(chosen, chain, rng, count, "payload" in handed)
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


def _true_chain(specimen: Specimen, rng: Generator) -> Chain:
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
_GEOMETRIC = frozenset({"joint_offset", "link_geometry", "scale"})
_NEED_MASSES = frozenset({"gravity_backlash", "link_compliance"})
_TURN = 2.5  # [rad] of travel that a once-per-turn effect needs


def _draw_name(rng: Generator, source: str, *, without: frozenset[str] = frozenset()) -> str:
    weights = dict(_SPIKES if source == "spike" else _WEIGHTS)
    if source == "departures":
        weights.pop("linkage")
        weights.pop("link_compliance")
    names = [name for name in weights if name not in without]
    chances = np.array([weights[name] for name in names], dtype=float)
    return str(rng.choice(names, p=chances / chances.sum()))


def _places(name: str, scene: Scene) -> list[int]:
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
    return _revolute(chain)


def _revolute(chain: Chain) -> list[int]:
    return [j for j in chain.driven if not chain.prismatic[j]]


def _turning(scene: Scene) -> list[int]:
    """Revolute joints that turn far enough for what changes with the angle."""
    return [j for j in _revolute(scene.chain) if float(np.ptp(scene.context.motion[:, j])) > _TURN]


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


def _draw_effect(
    scene: Scene, name: str, view: View, over_noise: float, depart: float = 0.0
) -> tuple[Hidden, Floats] | None:
    """An effect of a stated size at a joint where it can be seen, and how it moves the tips. None: not on
    this robot, not so large.
    """
    rng = scene.request.rng
    places = _places(name, scene)
    if not places:
        return None
    place = int(rng.choice(places))
    return _sized(scene, LISTED[name](place, rng, depart), view, over_noise)


def _sized(scene: Scene, hidden: Hidden, view: View, over_noise: float) -> tuple[Hidden, Floats] | None:
    unit = hidden.law(scene.context)
    first = view.displaced(unit)
    seen, raw = view.rms(first), _spread(first)
    if raw < 1e-12 or seen < _RETAINED * raw:
        return None
    target = over_noise * scene.sigma
    hidden = hidden.sized(target / seen)
    if not _sensible(scene, hidden):
        return None
    moved = _moved(scene, hidden)
    if scene.physics and hidden.effect in MECHANICAL:
        found = view.rms(moved)
        if found < 0.05 * target:
            return None
        hidden = hidden.sized(hidden.size * target / found)
        moved = _moved(scene, hidden)
    return (hidden, moved) if abs(view.rms(moved) / target - 1.0) < 0.1 and _sensible(scene, hidden) else None


def _moved(scene: Scene, hidden: Hidden) -> Floats:
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
}
_MOST = 5e-3
_MOST_EXPANSION = 4e-5
_MOST_SCALE = 5e-4


def _sensible(scene: Scene, hidden: Hidden) -> bool:
    changes = hidden.changes(scene.context)
    if hidden.effect == "thermal":
        return hidden.size < _MOST_EXPANSION
    if hidden.effect == "linkage":
        return hidden.size * scene.specimen.rod_arm < 3e-3
    return bool(
        np.abs(changes.motion).max() < _MOST_MOTION.get(hidden.effect, _MOST)
        and np.abs(changes.links[:, :, :2]).max() < 4e-3
        and max(np.abs(changes.links[:, :, 2:]).max(), np.abs(changes.tilt).max(), np.abs(changes.bend).max())
        < _MOST
        and np.abs(changes.base).max() < 4e-3
        and np.abs(changes.scale).max() < _MOST_SCALE
    )


def _size(rng: Generator, low: float = _SMALLEST, high: float = _LARGEST) -> float:
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
    return truing.Measurements(inputs.readings.copy(), robot=scene.robot, **columns)


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


def _case(scene: Scene, hidden: Sequence[Hidden], sizes: Sequence[float], **more: Any) -> Case:
    """Measures the truth and writes the label."""
    rng = scene.request.rng
    truth = scene.truth(hidden)
    noise = scene.recording.noise[scene.rows] if scene.recording else None
    data = _measured(scene, truth, scene.inputs, rng, noise)
    label: Label = {
        "family": scene.request.family,
        "source": scene.source,
        "robot": scene.specimen.name,
        "effects": [_named(scene.chain, h.effect, h.joints) for h in hidden if h.listed],
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
    }
    label.update(more)
    if scene.recording:
        label["robot"] = scene.recording.name
    seed = int(rng.integers(2**31))
    return Case(scene.request.id, scene.robot, data, label, lambda: _fresh(scene, truth, seed))


def _named(chain: Chain, effect: str, joints: Sequence[int]) -> dict[str, Any]:
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


def _acceptable(scene: Scene, view: View, hidden: Hidden, moved: Floats) -> list[dict[str, Any]]:
    """Other answers that are as right."""
    found = [
        _named(scene.chain, effect, (joint,))
        for effect, joint in lookalikes(view, moved, hidden, scene.handed)
    ]
    if hidden.effect == "joint_offset":
        found.append(_named(scene.chain, "link_geometry", hidden.joints))
    if hidden.effect == "joint_compliance" and "masses" not in scene.handed:
        found.append(_named(scene.chain, "gravity_moment", hidden.joints))
    if hidden.effect == "joint_compliance" and (
        hidden.detail.get("depart", 0.0) > 0.3 or "dead_band" in hidden.detail
    ):
        found.append(_named(scene.chain, "stiffness_zones", hidden.joints))
    if hidden.effect == "linkage":
        found.append(_named(scene.chain, "harmonic", hidden.joints))
    return [item for k, item in enumerate(found) if item not in found[:k]]


# ---- Families ------------------------------------------------------------------------------------


def _none(request: Request) -> Case:
    """Nothing is wrong: white noise, a wandering frame, heavy tails, gross errors."""
    kind = ("white", "drift", "heavy", "outliers")[request.number % 4]
    scene = _scene(request, "departures", needs=frozenset({"t"}) if kind == "drift" else frozenset())
    if kind != "drift":
        scene.noise_kind = kind
        return _case(scene, [], [], kind=kind)
    view = View(scene.context)
    for _ in range(_TRIES):
        hidden = laws.drifting(str(request.rng.choice(["wandering", "dying"])), request.rng)
        drawn = _sized(scene, hidden, view, _size(request.rng, 0.7, 5.0))
        if drawn:
            return _case(scene, [drawn[0]], [view.rms(drawn[1]) / scene.sigma], kind=kind)
    raise RuntimeError(f"{request.id}: no drift fits")


def _source_of_single(number: int) -> str:
    return ("physics", "physics", "departures", "spike")[number % 4]


def _single(request: Request) -> Case:
    source = _source_of_single(request.number)
    geometry = source != "spike" and request.rng.random() < 1 / 3
    return _one_effect(request, source, geometry=geometry, depart=0.15 if source == "departures" else 0.0)


def _one_effect(
    request: Request,
    source: str,
    *,
    geometry: bool = False,
    depart: float = 0.0,
    poses: int | None = None,
    sizes: tuple[float, float] = (_SMALLEST, _LARGEST),
    names: Sequence[str] = (),
    withheld: bool = False,
) -> Case:
    """One listed effect; `withheld`: without the column that it needs."""
    rng = request.rng
    for _ in range(_TRIES):
        name = (
            str(rng.choice(list(names)))
            if names
            else _draw_name(rng, source, without=_GEOMETRIC if geometry else frozenset())
        )
        needs = _needs(name, rng)
        scene = _scene(
            request,
            source,
            poses=poses,
            needs=needs,
            masses=True if name in _NEED_MASSES else None,
            geometry=geometry,
        )
        view = View(scene.context, geometry)
        drawn = _draw_effect(scene, name, view, _size(rng, *sizes), depart)
        if drawn is None:
            continue
        hidden, moved = drawn
        if withheld:
            scene.handed = scene.handed - needs
        acceptable = _acceptable(scene, view, hidden, moved)
        return _case(
            scene,
            [hidden],
            [view.rms(moved) / scene.sigma],
            acceptable=acceptable,
            **({"withheld": sorted(needs)} if withheld else {}),
        )
    raise RuntimeError(f"{request.id}: no effect fits")


def _needs(name: str, rng: Generator) -> frozenset[str]:
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
    for _ in range(_TRIES):
        names = [
            _draw_name(rng, "physics", without=_GEOMETRIC | {"transmission_error"}) for _ in range(count)
        ]
        needs = frozenset().union(*(_needs(name, rng) for name in names))
        masses = True if _NEED_MASSES & set(names) else None
        scene = _scene(
            request,
            "physics",
            needs=needs,
            masses=masses,
            geometry=geometry,
            poses=request.poses(200, 300, 400),
        )
        view = View(scene.context, geometry)
        drawn = [_draw_effect(scene, name, view, _size(rng, 1.5)) for name in names]
        complete = [item for item in drawn if item is not None]
        if len(complete) < count or _clash([item[0] for item in complete]):
            continue
        sizes = _apart(view, [moved for _, moved in complete], scene.sigma)
        if min(sizes) >= 1.0:
            acceptable = [
                item for hidden, moved in complete for item in _acceptable(scene, view, hidden, moved)
            ]
            return _case(scene, [hidden for hidden, _ in complete], sizes, acceptable=acceptable)
    raise RuntimeError(f"{request.id}: no two effects fit")


def _clash(hidden: Sequence[Hidden]) -> bool:
    """The same effect twice at one joint, or two springs or two gaps there."""
    kind = {"joint_compliance": "spring", "windup": "spring", "backlash": "gap", "gravity_backlash": "gap"}
    places = [(kind.get(h.effect, h.effect), h.joints) for h in hidden]
    return len(set(places)) < len(places)


def _apart(view: View, moved: Sequence[Floats], sigma: float) -> list[float]:
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
    for _ in range(_TRIES):
        every = request.specimens()
        specimen = every[int(rng.integers(len(every)))]  # not every twin fits every robot
        kind = kinds[request.number % len(kinds)]
        twin = kind(specimen, _true_chain(specimen, rng), rng)
        if twin is None:
            continue
        scene = _scene(request, "physics", specimen=specimen, plan=twin.plan, only=twin.handed)
        view = View(scene.context)
        wanted = _size(rng, 1.5)
        drawn = _sized(scene, twin.hidden, view, wanted)
        if drawn and not twin.exact:  # as small as it must be for nobody to see the difference
            wanted = min(wanted, _too_small_to_tell(view, drawn[1], twin))
            drawn = _sized(scene, twin.hidden, view, wanted) if wanted >= 1.0 else None
        if drawn:
            hidden, moved = drawn
            rival = _named(scene.chain, twin.rival, (twin.rival_joint,))
            acceptable = [rival, *(item for item in _acceptable(scene, view, hidden, moved) if item != rival)]
            return _case(
                scene,
                [hidden],
                [view.rms(moved) / scene.sigma],
                acceptable=acceptable,
                twin=kind.__name__.strip("_"),
                rival=rival,
            )
    raise RuntimeError(f"{request.id}: no twins fit")


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
    return _one_effect(
        request,
        "departures" if request.number % 3 else "physics",
        names=[name],
        depart=depart * float(rng.uniform(0.7, 1.0)),
        sizes=(1.0, 10.0),
    )


def _dead_band(request: Request) -> Case:
    rng = request.rng
    for _ in range(_TRIES):
        scene = _scene(request, "physics", masses=True, needs=frozenset({"payload"}))
        view = View(scene.context)
        place = int(rng.choice(_places("joint_compliance", scene)))  # every robot has a loaded joint
        drawn = _sized(scene, laws.dead_band(place, rng), view, _size(rng, 1.0))
        if drawn:
            return _case(
                scene,
                [drawn[0]],
                [view.rms(drawn[1]) / scene.sigma],
                acceptable=_acceptable(scene, view, *drawn),
            )
    raise RuntimeError(f"{request.id}: no effect fits")


def _unlisted(request: Request) -> Case:
    """An effect that stands in no catalogue, and that no listed one explains."""
    rng = request.rng
    kinds = surprises(request.which)
    kind = kinds[request.number % len(kinds)]
    for _ in range(_TRIES):
        needs = _surprise_needs(request, kind)
        scene = _scene(request, "departures", needs=needs)
        chain = scene.chain
        places = [j for j in chain.driven if not chain.prismatic[j]]
        hidden = kind(chain, int(rng.choice(places)), rng)
        view = View(scene.context)
        drawn = _sized(scene, hidden, view, _size(rng, 1.0))
        if drawn and _beyond(view, drawn[1], scene.handed):
            joint = chain.names[hidden.joints[0]] if hidden.joints else "base"
            return _case(
                scene,
                [drawn[0]],
                [view.rms(drawn[1]) / scene.sigma],
                unlisted=hidden.effect,
                unlisted_joint=joint,
                unlisted_inputs=list(hidden.inputs),
            )
    raise RuntimeError(f"{request.id}: no unlisted effect fits")


def _surprise_needs(request: Request, kind: Surprise) -> frozenset[str]:
    chain = chain_of(specimens(request.which)[0].robot)
    return kind(chain, chain.driven[-1], np.random.default_rng(0)).needs


def _beyond(view: View, moved: Floats, handed: frozenset[str]) -> bool:
    """No listed effect, and no wrong geometry as a whole, explains most of it."""
    return all(explained(view, moved, rival.columns) < 0.75 for rival in rivals(view, handed))


def _missing(request: Request) -> Case:
    """The column that the effect needs is withheld."""
    names = (("backlash",), ("thermal_zero", "thermal"), ("windup",), ("time_offset", "backlash"))[
        request.number % 4
    ]
    spike = request.number % 8 == 0 and not recordings.missing(request.which)
    return _one_effect(
        request,
        "spike" if spike else "physics",
        names=names if not spike else ["backlash"],
        sizes=(1.5, 10.0),
        withheld=True,
    )


def _twenty(request: Request) -> Case:
    """Twenty poses only."""
    return _one_effect(
        request, "physics" if request.number % 2 else "departures", poses=20, sizes=(2.0, 10.0)
    )


_FAMILIES: dict[str, Callable[[Request], Case]] = {
    "none": _none,
    "single": _single,
    "double": _double,
    "confounded": _confounded,
    "wrong_law": _wrong_law,
    "unlisted": _unlisted,
    "missing": _missing,
    "twenty": _twenty,
}


def skipped(which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Sets that cannot be made here, and why."""
    why = recordings.missing(which)
    if not why:
        return
    for name in names:
        _, family, number = name.partition("@")[0].split("/")
        if family == "single" and _source_of_single(int(number)) == "spike":
            yield name, why
