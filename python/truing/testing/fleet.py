# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated fleets: arms of one type that share the errors of their geometry, each with a base, a tool and
zeros of its own, and some with a fault that the others do not have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truing import _core
from truing.files.common import PathLike, write_table
from truing.files.measurement_file import save_measurements
from truing.testing.dynamics import USUAL, demo_arm, moved
from truing.testing.simulation import Simulation, Truth, _values, measure, true_robot

# Faults that arms may have, by what an effect says of itself: play, a gear ratio, an eccentric wheel, a soft
# joint, a bearing that wobbles.
_FAULTS = (
    ("law", "of_direction"),
    ("stands_for", "ratio"),
    ("law", "of_angle"),
    ("law", "of_torque"),
    ("moves", "axis"),
)


@dataclass(frozen=True)
class FleetSimulation:
    """A simulated fleet: what all arms share, and every arm with its measurements and its own errors."""

    type_of: Truth
    arms: Mapping[str, Simulation]
    faults: Mapping[str, tuple[str, str]]  # effect and joint by the arm that has it


def simulate_fleet(
    robot: _core.Robot,
    *,
    arms: int = 200,
    poses: int = 100,
    lengths: float = 5e-4,
    angles: float = 5e-4,
    zeros: float = 2e-3,
    faults: int = 5,
    fault_at_tip: float = 3e-4,
    noise: float = 5e-5,
    columns: Sequence[str] = ("dir",),
    seed: int = 0,
) -> FleetSimulation:
    """Arms of one type. lengths [m], angles [rad]: standard deviation of the geometry's errors, the same in
    all; zeros [rad]: of each arm's own joint zeros; lengths: of its tool as well. faults: so many arms have
    one, each of another kind, at a joint that is drawn; fault_at_tip: rms motion of the tip by it [m]. The
    base of every arm stands somewhere else. noise: of each coordinate [m].
    """
    rng = np.random.default_rng([seed, 11])
    kind = true_robot(robot, lengths=lengths, angles=angles, only=_geometry(robot), seed=seed)
    with_fault = sorted(rng.choice(arms, size=faults, replace=False)) if faults else []
    found: dict[str, Simulation] = {}
    hidden: dict[str, tuple[str, str]] = {}
    for k in range(arms):
        name, effects = f"a{k + 1:03d}", {}
        if k in with_fault:
            joint = robot.joints[int(rng.choice(robot.driven_joints()[1:4]))].name
            trait, value = _FAULTS[with_fault.index(k) % len(_FAULTS)]
            effect = next(e.name for e in _core.catalogue_effects() if getattr(e.traits, trait) == value)
            parameter = f"{effect}.{joint}"
            effects = {parameter: _size(robot, parameter, fault_at_tip)}
            hidden[name] = (effect, joint)
        mine = true_robot(
            kind.robot,
            lengths=lengths,
            angles=zeros,
            only=["*.offset", *(f"{t.name}.[xyz]" for t in robot.targets)],
            effects=effects,
            base_unknown=True,
            seed=int(rng.integers(2**31)),
        )
        found[name] = measure(mine, poses=poses, noise=noise, columns=columns, seed=int(rng.integers(2**31)))
    return FleetSimulation(kind, found, hidden)


def _size(robot: _core.Robot, parameter: str, at_tip: float) -> float:
    """Of an effect that moves the tip by so much (rms) [m]."""
    trial = 1e-6  # small, and every effect is linear in it
    bent = true_robot(robot, lengths=0.0, angles=0.0, effects={parameter: trial})
    there = [measure(truth, poses=200, noise=0.0, columns=("dir",)) for truth in (Truth(robot, {}), bent)]
    straight, moved = (np.asarray(simulation.data.positions) for simulation in there)
    return trial * at_tip / float(np.sqrt(np.mean(np.sum((moved - straight) ** 2, axis=1))))


def _geometry(robot: _core.Robot) -> list[str]:
    """What the type has wrong: the values of its links, not zeros, ratios or the tool."""
    if robot.convention == "urdf":
        return [
            f"{joint.name}.{axis}" for joint in robot.joints for axis in ("x", "y", "z", "rx", "ry", "rz")
        ]
    of_links = ("a", "d", "alpha", "beta")
    return [name for _, _, name, _ in _values(robot) if name.rpartition(".")[2] in of_links]


def save_fleet(
    folder: PathLike, fleet: FleetSimulation, robot: _core.Robot, *, suffix: str = ".parquet"
) -> None:
    """Writes the measurements of every arm to a file of its name in `folder`."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    for name, simulation in fleet.arms.items():
        save_measurements(place / f"{name}{suffix}", simulation.data, robot)


# ---- Torques


@dataclass(frozen=True)
class TorqueFleet:
    """Recordings of a simulated fleet's motion and torque: the robot as its author knows it, what the type
    has instead, every arm's recordings, and faults: the parameter by the arm that has it.
    """

    nominal: _core.Robot
    type_of: _core.Robot
    recordings: Mapping[str, tuple[_core.Recording, ...]]
    own: Mapping[str, Mapping[str, float]]  # of every arm: what it departs from the type by
    faults: Mapping[str, str]


_TYPE_MASS = 1.1  # of its links, of the author's
_SCATTER = 0.03  # of every arm's friction, of the type's
_GAIN_SCATTER = 0.015  # of its motors' torque per ampere
_TORQUE_FAULTS = (("coulomb", 0.5), ("motor_constant", 0.15))  # by so much of the type's


def simulate_torque_fleet(
    *, arms: int = 12, faults: int = 2, seconds: float = 40.0, held_out: bool = False, seed: int = 0
) -> TorqueFleet:
    """Arms of one type: its links are a tenth heavier than in the file, its friction is not in the file.

    Every arm's friction scatters by 3 % about the type's, its motors' gains by 1.5 %, and it has offsets of
    its own. faults: so many arms have more, by turns half as much dry friction again or 15 % more torque per
    ampere at J2 or J3. held_out: a second recording of every arm, marked as test.
    """
    rng = np.random.default_rng([seed, 13])
    nominal, type_of = demo_arm(), demo_arm()
    for joint in type_of.joints:
        joint.mass = _TYPE_MASS * float(joint.mass or 0.0)
    names = [joint.name for joint in nominal.joints]
    usual = {
        f"{e}.{n}": USUAL[k][i] for k, n in enumerate(names) for i, e in enumerate(("coulomb", "viscous"))
    }
    type_of.torque_effects = _effects(usual)
    with_fault = [int(k) for k in rng.choice(arms, size=faults, replace=False)] if faults else []
    recordings, own, hidden = {}, {}, {}
    for k in range(arms):
        name = f"a{k + 1:03d}"
        mine = {p: value * _SCATTER * rng.normal() for p, value in usual.items()}
        mine |= {f"motor_constant.{n}": _GAIN_SCATTER * rng.normal() for n in names}
        mine |= {f"current_offset.{n}": 0.05 * USUAL[i][0] * rng.normal() for i, n in enumerate(names)}
        if k in with_fault:
            effect, more = _TORQUE_FAULTS[with_fault.index(k) % len(_TORQUE_FAULTS)]
            hidden[name] = f"{effect}.{rng.choice(['J2', 'J3'])}"
            mine[hidden[name]] += more * usual.get(hidden[name], 1.0)
        arm = type_of.copy()
        arm.torque_effects = _effects({p: usual.get(p, 0.0) + value for p, value in mine.items()})
        own[name] = mine
        recordings[name] = tuple(
            moved(
                arm,
                name,
                seconds=seconds,
                test=number > 0,
                random=np.random.default_rng([seed, 14, k, number]),
            )
            for number in range(2 if held_out else 1)
        )
    return TorqueFleet(nominal, type_of, recordings, own, hidden)


def _effects(values: Mapping[str, float]) -> list[_core.AppliedEffect]:
    """Effects at one joint each, by the names of their parameters."""
    return [_core.AppliedEffect(*_split(name), {name: value}) for name, value in values.items()]


def _split(name: str) -> tuple[str, list[str]]:
    effect, _, joint = name.partition(".")
    return effect, [joint]


def save_torque_fleet(folder: PathLike, fleet: TorqueFleet, *, suffix: str = ".parquet") -> None:
    """Writes the recordings of every arm to `folder/arm=NAME/`."""
    for name, recordings in fleet.recordings.items():
        place = Path(folder) / f"arm={name}"
        place.mkdir(parents=True, exist_ok=True)
        for number, recording in enumerate(recordings, 1):
            write_table(place / f"run{number}{suffix}", _recorded(recording))


def _recorded(recording: _core.Recording) -> dict[str, Any]:
    """The columns of a file."""
    out: dict[str, Any] = {"t_s": np.asarray(recording.time)}
    for called, table in (("q{}_rad", recording.position), ("tau{}_Nm", recording.torque)):
        out |= {called.format(k + 1): column for k, column in enumerate(np.asarray(table).T)}
    return out | {"set": ["test" if recording.test else "train"] * len(recording)}
