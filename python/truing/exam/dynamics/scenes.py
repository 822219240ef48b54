# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A set from its parts: an arm is driven along commands, effects are hidden at their sizes, noise is laid on,
and what may be known is written down as files. The label stays with the examiner.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics import motions, noise
from truing.exam.dynamics.bodies import torques
from truing.exam.dynamics.laws import LISTED, Hidden, Scene, lagged, shifted, usual_friction
from truing.exam.dynamics.motions import STEP, Course
from truing.exam.dynamics.physics import (
    Controller,
    Gearing,
    Motion,
    controller,
    felt_inertia,
    run,
    with_rotor,
)
from truing.exam.dynamics.robots import Arm, Floats, arms, misjudged
from truing.exam.dynamics.sizing import SAME, View, best_share, low_pass, rivals
from truing.exam.scenes import NoSetError, Request

SIZES = (0.5, 1.0, 2.0, 3.0)
"""Of effects, over the noise."""
TRIES = 60
_FELT = 6.0  # [Hz] up to which friction disturbs a motion: beyond, a joint that turns back would be kicked
_COARSE = 5  # rows of 1 ms between those on which sizes are found
_ENCODER_BITS = (17, 20)
INERTIAL = frozenset({"link_inertia", "payload", "armature", "motor_constant"})
"""What wrong inertials are rightly called, or look like."""
ARM_WIDE = frozenset({"payload", "tool_force", "base_tilt", "time_offset"})

Label = dict[str, Any]
Table = dict[str, Floats]


@dataclass(frozen=True)
class Recorded:
    """One recording as it is handed over."""

    name: str
    test: bool
    table: Table


@dataclass(frozen=True)
class Case:
    """A set: what is handed over, and what is not."""

    robot: str  # its file
    recordings: tuple[Recorded, ...]
    fresh: tuple[Recorded, ...]  # never handed over
    label: Label
    robot_name: str = "robot.urdf"

    def write(self, folder: Path) -> tuple[Path, list[Path]]:
        """Robot and recordings as files: docs/reference/files.md."""
        folder.mkdir(parents=True, exist_ok=True)
        robot = folder / self.robot_name
        robot.write_text(self.robot, encoding="utf-8")
        return robot, [_write_recording(folder, one) for one in self.recordings]

    def write_kept_back(self, folder: Path) -> list[Path]:
        """What is not handed over before the answer."""
        folder.mkdir(parents=True, exist_ok=True)
        return [_write_recording(folder, one) for one in self.fresh]


def _write_recording(folder: Path, one: Recorded) -> Path:
    path = folder / f"{one.name}.csv"
    columns = np.stack(list(one.table.values()), axis=1)
    last = "test" if one.test else "train"
    lines = [",".join([*one.table, "set"])]
    lines += [",".join([*map(_told, row), last]) for row in columns.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _told(value: float) -> str:
    return f"{value:.9g}"


# ---- The robot as it is handed over --------------------------------------------------------------


def urdf(arm: Arm) -> str:
    """The arm as its data sheet gives it: no friction, no rotors."""
    parts = [f'<?xml version="1.0"?>\n<robot name="{arm.name}">\n<link name="base_link"/>']
    for k, link in enumerate(arm.links):
        i = link.inertia
        parts.append(
            f'<link name="link{k + 1}"><inertial><origin xyz="{_three(link.com)}" rpy="0 0 0"/>'
            f'<mass value="{link.mass:.12g}"/><inertia ixx="{i[0, 0]:.12g}" iyy="{i[1, 1]:.12g}"'
            f' izz="{i[2, 2]:.12g}" ixy="{i[0, 1]:.12g}" ixz="{i[0, 2]:.12g}" iyz="{i[1, 2]:.12g}"/>'
            "</inertial></link>"
        )
        parent = f"link{k}" if k else "base_link"
        effort = 12.0 * arm.coulomb[k] + 60.0
        parts.append(
            f'<joint name="J{k + 1}" type="revolute"><parent link="{parent}"/><child link="link{k + 1}"/>'
            f'<origin xyz="{_three(arm.origins[k])}" rpy="0 0 0"/><axis xyz="{_three(arm.axes[k])}"/>'
            f'<limit lower="{-arm.reach[k] - 0.2:.6g}" upper="{arm.reach[k] + 0.2:.6g}"'
            f' velocity="{1.2 * arm.speed[k]:.6g}" effort="{effort:.6g}"/></joint>'
        )
    parts.append(
        f'<link name="tool0"/><joint name="tool" type="fixed"><parent link="link{arm.n}"/>'
        f'<child link="tool0"/><origin xyz="{_three(arm.tool)}" rpy="0 0 0"/></joint>\n</robot>'
    )
    return "\n".join(parts) + "\n"


def _three(values: Floats) -> str:
    return " ".join(f"{value:.12g}" for value in values)


# ---- Commands ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drive:
    """A command; its recording is to learn from ("train"), held out, or kept back."""

    name: str
    part: str  # "train", "test", "fresh"
    course: Course
    loaded: bool = True  # whether an effect that changes the arm (a payload) is there


def usual_drives(arm: Arm, rng: Generator, held: frozenset[int] = frozenset()) -> list[Drive]:
    """Two Fourier trajectories, slow reversals and point-to-point motion; two more recordings held out, one
    kept back.
    """
    return [
        Drive("fourier_1", "train", motions.fourier(arm, rng, 12.0, held)),
        Drive("fourier_2", "train", motions.fourier(arm, rng, 12.0, held)),
        Drive("slow", "train", motions.reversals(arm, rng, 10.0, held)),
        Drive("ptp_1", "train", motions.point_to_point(arm, rng, 9.0, held)),
        Drive("fourier_3", "test", motions.fourier(arm, rng, 8.0, held)),
        Drive("ptp_2", "test", motions.point_to_point(arm, rng, 7.0, held)),
        Drive("kept_back", "fresh", motions.fourier(arm, rng, 6.0, held)),
    ]


# ---- A stage: everything but what is hidden ------------------------------------------------------


Warmth = Callable[[Generator, Floats, Floats, float], Floats]
"""Temperatures of a recording from the dice, its times, the friction's power and the time step."""


def heated(rng: Generator, t: Floats, power: Floats, step: float) -> Floats:
    """Gears that warm by friction's power and cool to the room, each recording from its own start."""
    lasts, rise = 60.0, 12.0
    rate = rise / 15.0 / np.maximum(power.mean(axis=0), 1e-6)
    temperature = np.empty_like(power)
    value = rng.uniform(22.0, 48.0) + rng.uniform(-3.0, 3.0, power.shape[1])
    for row in range(len(t)):
        temperature[row] = value
        value = value + step * (rate * power[row] - (value - 22.0) / lasts)
    return temperature


@dataclass(frozen=True)
class Stage:
    """An arm under its commands before anything is hidden in it."""

    request: Request
    arm: Arm  # the true one, but for what is hidden
    nominal: Arm  # handed over
    drives: list[Drive]
    gains: Controller
    rate: float  # [Hz] of recording
    noise_kind: str
    sigma: Floats  # shape=(n,) [Nm]
    reference: list[Scene]  # along the commands, every 5 ms
    handed: frozenset[str]  # "speed", "temperature"
    inertials: bool  # wrong ones underneath

    @property
    def per_row(self) -> float:
        """What a row at 25 Hz counts in the likelihood."""
        return self.rate / 20.0 if self.noise_kind == "white" else 1.0 / 16.0

    def view(self, scenes: Sequence[Scene]) -> View:
        learned = [s for s, drive in zip(scenes, self.drives, strict=True) if drive.part == "train"]
        return View(learned, self.sigma, self.inertials, self.per_row)

    def places(self, effect: str) -> list[int]:
        """Joints at which an effect may be hidden."""
        n, moving = self.arm.n, self._moving()
        if effect in ("spring", "joint_elasticity", "backlash"):
            return [j for j in range(n) if self._level(j) and j in moving]
        if effect == "link_inertia":
            return [j for j in range(1, n) if j in moving]
        if effect == "coupling":
            return [j for j in range(n) if j in moving and n > 1]
        return moving

    def _level(self, j: int) -> bool:
        """Whether weight loads a joint."""
        return float(np.std(self.reference[0].motion.torque[:, j])) > 0.3 * float(self.arm.coulomb[j])

    def _moving(self) -> list[int]:
        return [j for j in range(self.arm.n) if np.ptp(self.reference[0].motion.q[:, j]) > 1e-3]


def stage(
    request: Request,
    *,
    arm: Arm | None = None,
    drives: list[Drive] | None = None,
    needs: frozenset[str] = frozenset(),
    inertials: bool = False,
    noise_kind: str = "coloured",
    warmth: Warmth = heated,
) -> Stage:
    """needs: columns that must be there. inertials: 5 to 30 % wrong ones are handed over."""
    rng = request.rng
    every = arms(request.which)
    arm = arm or every[int(rng.integers(len(every)))]
    drives = drives or usual_drives(arm, rng)
    nominal = misjudged(arm, rng, 0.05, 0.3) if inertials else arm
    gains = controller(arm, misjudged(nominal, rng, 0.0, 0.1), float(rng.uniform(5.0, 9.0)))
    reference = [replace(_along(arm, d.course, rng, warmth), loaded=d.loaded) for d in drives]
    spread = np.sqrt(np.mean([np.var(s.total, axis=0) for s in reference], axis=0))
    handed = needs | frozenset(name for name in ("speed", "temperature") if rng.random() < 0.5)
    return Stage(
        request,
        arm,
        nominal,
        drives,
        gains,
        float(rng.choice([100.0, 125.0, 200.0, 250.0, 500.0])),
        noise_kind,
        spread * rng.uniform(0.02, 0.06, arm.n),
        reference,
        handed,
        inertials,
    )


def _along(arm: Arm, course: Course, rng: Generator, warmth: Warmth) -> Scene:
    """A command as if it were followed, every 5 ms: for sizes, and for what a motion loses on its way."""
    step = _COARSE * STEP
    q = course.q[course.settle :: _COARSE]
    qd = np.gradient(q, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    motion = Motion(np.arange(len(q), dtype=float) * step, q, qd, qdd, torques(arm, q, qd, qdd))
    lost = usual_friction(arm, motion)
    temperature = warmth(rng, motion.t, np.abs(lost * qd), step)
    return Scene(arm, motion, motion.torque + lost, temperature, step)


# ---- Hiding --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Placed:
    """An effect with its amplitude."""

    hidden: Hidden
    amplitude: float


def unit_torques(scenes: Sequence[Scene], hidden: Hidden) -> list[Floats]:
    """Torque of an amplitude of one along commands, by recording; of arms and gears to first order."""
    if hidden.law:
        return [hidden.law(s) for s in scenes]
    if hidden.arm:
        some, changed = 0.2, hidden.arm(0.2)
        return [
            s.loaded * (torques(changed, s.motion.q, s.motion.qd, s.motion.qdd) - s.motion.torque) / some
            for s in scenes
        ]
    return [_bent(s, hidden) for s in scenes]


def _bent(s: Scene, hidden: Hidden) -> Floats:
    """The link lags the motor by dq = -a tau / std(tau), or by -a/2 sign(tau), for a small a."""
    j, some = hidden.joints[0], 2e-3
    load = s.motion.torque[:, j] / float(np.std(s.motion.torque[:, j]))
    shape = load if hidden.gearing == "stiffness" else 0.5 * np.tanh(load / 0.1)
    q, qd, qdd = s.motion.q.copy(), s.motion.qd.copy(), s.motion.qdd.copy()
    moved = -some * shape
    q[:, j] += moved
    qd[:, j] += np.gradient(moved, s.step)
    qdd[:, j] += np.gradient(np.gradient(moved, s.step), s.step)
    return (torques(s.arm, q, qd, qdd) - s.motion.torque) / some


def placed(st: Stage, view: View, hidden: Hidden, size: float) -> Placed | None:
    """An effect with the amplitude that shows `size` over the noise. None: no machine has it so large."""
    learned = [s for s, drive in zip(st.reference, st.drives, strict=True) if drive.part == "train"]
    seen = view.size(view.stacked(unit_torques(learned, hidden)))
    if seen < 1e-9 or size / seen > hidden.largest:
        st.request.throw_away("no machine has it so large")
        return None
    return Placed(hidden, size / seen)


@dataclass(frozen=True)
class Played:
    """The arm with everything in it: scenes at 1 ms, measured torques, what effects add."""

    scenes: list[Scene]
    measured: list[Floats]
    added: list[list[Floats]]  # effect by effect, recording by recording


def play(st: Stage, effects: Sequence[Placed]) -> Played:
    """Drives the arm. Motors feel friction and effects along the command; what is measured is the torque that
    moved the arm along its actual motion, and the losses of this motion.
    """
    arm, gearing = _mechanism(st, effects)
    lawful = [e for e in effects if e.hidden.law and not e.hidden.meter]
    losses = []
    for s, drive in zip(st.reference, st.drives, strict=True):
        lost = sum((e.amplitude * e.hidden.law(s) for e in lawful if e.hidden.law), np.zeros_like(s.motion.q))
        lost = low_pass(lost + usual_friction(arm, s.motion), s.step, _FELT)
        times = np.arange(len(drive.course.q)) * STEP - drive.course.settle * STEP
        losses.append(np.stack([np.interp(times, s.motion.t, lost[:, j]) for j in range(arm.n)], axis=1))
    bare = _sheet(st, effects)
    driven = [
        run(arm if drive.loaded else bare, st.gains, [drive.course], [loss], gearing)[0]
        for drive, loss in zip(st.drives, losses, strict=True)
    ]
    scenes, measured = [], []
    added: list[list[Floats]] = [[] for _ in effects]
    for reference, motion in zip(st.reference, driven, strict=True):
        warm = [np.interp(motion.t, reference.motion.t, c) for c in reference.temperature.T]
        s = Scene(
            st.arm,
            motion,
            motion.torque + usual_friction(arm, motion),
            np.stack(warm, axis=1),
            loaded=reference.loaded,
        )
        scenes.append(s)
        measured.append(_measured(st, s, effects, added))
    return Played(scenes, measured, added)


def _measured(st: Stage, s: Scene, effects: Sequence[Placed], added: list[list[Floats]]) -> Floats:
    total = s.total
    rigid = None
    for k, e in enumerate(effects):
        if e.hidden.law and not e.hidden.meter:
            own = e.amplitude * e.hidden.law(s)
            added[k].append(own)
            total = total + own
        elif not e.hidden.law:  # MuJoCo moved it: against the arm of the data sheet along the same motion
            if rigid is None:
                rigid = _rigid(_sheet(st, effects), s.motion)
            added[k].append(s.motion.torque - rigid)
    for k, e in enumerate(effects):
        if e.hidden.meter:
            read = _read(replace(s, total=total), e)
            added[k].append(read - total)
            total = read
    return total


def _rigid(arm: Arm, motion: Motion) -> Floats:
    """Torques of a rigid arm along a motion, found every 5 ms."""
    some = motion.every(_COARSE)
    coarse = torques(arm, some.q, some.qd, some.qdd)
    return np.stack([np.interp(motion.t, some.t, coarse[:, j]) for j in range(arm.n)], axis=1)


def _read(s: Scene, e: Placed) -> Floats:
    """A torque as its meter reads it: filters and clocks exactly, gains by their law."""
    if e.hidden.effect == "torque_lag":
        j = e.hidden.joints[0]
        read = s.total.copy()
        read[:, j] = lagged(s.total[:, j], e.amplitude, s.step)
        return read
    if e.hidden.effect == "time_offset":
        return shifted(s.total, e.amplitude, s.step)
    assert e.hidden.law is not None
    return np.asarray(s.total + e.amplitude * e.hidden.law(s))


def _mechanism(st: Stage, effects: Sequence[Placed]) -> tuple[Arm, Gearing]:
    """The arm that MuJoCo drives, and what stands in its gears."""
    arm = _sheet(st, effects)
    rotor: dict[int, float] = {}
    stiffness: dict[int, float] = {}
    gap: dict[int, float] = {}
    for e in effects:
        if e.hidden.arm:
            arm = e.hidden.arm(e.amplitude)
        if e.hidden.gearing:
            j = e.hidden.joints[0]
            rotor[j] = _rotor(st, j)
            spread = float(np.std(st.reference[0].motion.torque[:, j]))
            if e.hidden.gearing == "stiffness":
                stiffness[j] = spread / e.amplitude
            else:
                gap[j] = e.amplitude
    return arm, Gearing(rotor, stiffness, gap)


def _rotor(st: Stage, j: int) -> float:
    return 0.25 * float(felt_inertia(st.arm)[j])


def _sheet(st: Stage, effects: Sequence[Placed]) -> Arm:
    """The true arm as a data sheet would give it: rotors of elastic gears counted to their links."""
    arm = st.arm
    for e in effects:
        if e.hidden.gearing:
            arm = with_rotor(arm, e.hidden.joints[0], _rotor(st, e.hidden.joints[0]))
    return arm


# ---- Handing over --------------------------------------------------------------------------------


def make_case(
    st: Stage,
    effects: Sequence[Placed],
    *,
    source: str = "physics",
    rivalry: bool = True,
    **more: Any,
) -> Case | None:
    """The set with its label. None: what the arm then does shows an effect much smaller, or larger, than
    wanted.
    """
    played = play(st, effects)
    coarse = [every_row(s, _COARSE) for s in played.scenes]
    view = st.view(coarse)
    train = [k for k, drive in enumerate(st.drives) if drive.part == "train"]
    seen = [view.stacked([added[k][::_COARSE] for k in train]) for added in played.added]
    sizes = [view.size(column) for column in seen]
    wanted = more.pop("wanted", None)
    if wanted and any(not 0.6 * w <= size <= 1.7 * w for size, w in zip(sizes, wanted, strict=True)):
        st.request.throw_away("what was simulated is not of its size")
        return None
    acceptable = [
        item
        for of, (e, column) in enumerate(zip(effects, seen, strict=True))
        for item in (looks_like(view, e.hidden, column, st.handed, of) if rivalry else [])
    ]
    label: Label = {
        "family": st.request.family,
        "source": source,
        "arm": st.arm.name,
        "effects": [told(e.hidden) for e in effects],
        "acceptable": acceptable,
        "amplitudes": [e.amplitude for e in effects],
        "sizes": sizes,
        "wanted": list(wanted) if wanted else sizes,
        "size_over_noise": (list(wanted) if wanted else sizes or [0.0])[0],
        "noise": st.noise_kind,
        "noise_sigma": st.sigma.tolist(),
        "payload_kg": _payload_of(st, effects),
        "rate": st.rate,
        "geometry_underneath": st.inertials,
        "underneath": sorted(INERTIAL) if st.inertials else [],
        "drawn_anew": dict(st.request.anew),
        **more,
    }
    recorded = [record(st, played, k) for k in range(len(st.drives))]
    drives = [drive.part for drive in st.drives]
    return Case(
        urdf(_handed(st, effects)),
        tuple(r for r, part in zip(recorded, drives, strict=True) if part != "fresh"),
        tuple(r for r, part in zip(recorded, drives, strict=True) if part == "fresh"),
        label,
    )


def _payload_of(st: Stage, effects: Sequence[Placed]) -> float | None:
    """Mass of a hidden payload [kg]."""
    return next((e.amplitude * st.arm.payload for e in effects if e.hidden.effect == "payload"), None)


def _handed(st: Stage, effects: Sequence[Placed]) -> Arm:
    return _sheet(replace(st, arm=st.nominal), effects)


def every_row(s: Scene, rows: int) -> Scene:
    """Some rows of a scene only."""
    return replace(
        s,
        motion=s.motion.every(rows),
        total=s.total[::rows],
        temperature=s.temperature[::rows],
        step=s.step * rows,
    )


def told(hidden: Hidden) -> dict[str, Any]:
    return {"effect": hidden.effect, "joints": [f"J{j + 1}" for j in hidden.joints]}


def looks_like(
    view: View, hidden: Hidden, column: Floats, handed: frozenset[str], of: int | None
) -> list[dict[str, Any]]:
    """Other names that explain what is seen of an effect, or differ from it by less than the noise shows."""
    own = told(hidden)
    joints = hidden.joints[:1] if hidden.joints else tuple(range(view.n))
    if hidden.effect == "link_inertia":
        joints = tuple(range(hidden.joints[0] + 1))
    found = []
    for rival in rivals(view, joints, handed):
        name = {"effect": rival.effect, "joints": [f"J{j + 1}" for j in rival.joints]}
        if name == own:
            continue
        share = best_share(view, column, rival)
        if share >= SAME or view.unseen(column, share):
            found.append({**name, "of": of, "share": round(share, 4)})
    return found


def record(st: Stage, played: Played, k: int) -> Recorded:
    """Rows as the arm's controller logs them: quantised angles, noisy torques."""
    rng, n, drive = st.request.rng, st.arm.n, st.drives[k]
    step = max(1, round(1.0 / (st.rate * STEP)))
    s = every_row(played.scenes[k], step)
    rows = len(s.motion.t)
    lines = 2.0 ** int(rng.integers(*_ENCODER_BITS)) / (2.0 * np.pi)
    table: Table = {"t_s": s.motion.t}
    q = np.round(s.motion.q * lines) / lines
    table.update({f"q{j + 1}_rad": q[:, j] for j in range(n)})
    if "speed" in st.handed:
        table.update({f"qd{j + 1}_rad_s": np.round(s.motion.qd[:, j], 5) for j in range(n)})
    shape = noise.white(rows, n, rng) if st.noise_kind == "white" else noise.coloured(rows, n, s.step, rng)
    torque = played.measured[k][::step] + st.sigma * shape
    table.update({f"tau{j + 1}_Nm": torque[:, j] for j in range(n)})
    if "temperature" in st.handed:
        table.update({f"temp{j + 1}_C": np.round(s.temperature[:, j], 1) for j in range(n)})
    return Recorded(drive.name, drive.part != "train", table)


def draw_size(rng: Generator, least: float = 0.0) -> float:
    return float(rng.choice([size for size in SIZES if size >= least]))


def draw_hidden(st: Stage, name: str, makers: Mapping[str, Callable[..., Hidden]] = LISTED) -> Hidden | None:
    """An effect somewhere on the arm. None: it has no place there."""
    places = [0] if name in ARM_WIDE else st.places(name)
    if not places or (name == "coupling" and st.arm.n < 2):
        st.request.throw_away("no place on this arm")
        return None
    rng = st.request.rng
    return makers[name](st.arm, int(rng.choice(places)), rng)


Makers = Mapping[str, Callable[[Arm, int, Generator], Hidden]]


def hide_one(
    request: Request,
    names: Sequence[str],
    makers: Makers = LISTED,
    *,
    source: str = "physics",
    sizes: Sequence[float] = SIZES,
    withheld: frozenset[str] = frozenset(),
    fits: Callable[[Case], bool] | None = None,
    staged: Callable[[str], Stage] | None = None,
    **more: Any,
) -> Case:
    """One effect of these names, somewhere on some arm. withheld: columns that are then not handed over.
    fits: says whether the set is as its family wants it. staged: makes the stage for an effect.
    """
    rng = request.rng
    name, size = str(rng.choice(list(names))), float(rng.choice(list(sizes)))
    for tried in range(TRIES):
        if tried % 10 == 9:  # this effect has no place at this size
            name = str(rng.choice(list(names)))
        st = staged(name) if staged else _usual_stage(request, name)
        view = st.view(st.reference)
        for _ in range(3):
            hidden = draw_hidden(st, name, makers)
            found = placed(st, view, hidden, size) if hidden else None
            if found is None:
                continue
            shown = replace(st, handed=st.handed - withheld)
            case = make_case(shown, [found], source=source, wanted=[size], **more)
            if case is None:
                continue
            if fits is None or fits(case):
                return case
            request.throw_away("not what its family asks for")
    raise NoSetError(f"no effect fits in {TRIES} draws")


def _usual_stage(request: Request, name: str) -> Stage:
    """Right inertials are handed over in half of the sets; always, where they are what is looked for."""
    wrong = name not in INERTIAL and request.rng.random() < 0.5
    return stage(request, needs=NEEDS.get(name, frozenset()), inertials=wrong)


NEEDS = {"thermal_friction": frozenset({"temperature"})}
"""Columns without which an effect cannot be found."""
