# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Simulated fleets: arms of one type that share the errors of their geometry, each with a base, a tool and
zeros of its own, and some with a fault that the others do not have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from truing import _core
from truing.files.common import PathLike
from truing.files.measurement_file import save_measurements
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
