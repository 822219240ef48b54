# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `truing ik` and `truing compensate` share: options about targets, and what they mean."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli.options import (
    Angle,
    Choice,
    File,
    Kind,
    Length,
    Quantity,
    read_with_common_units,
    words_of,
)
from truing.cli.tables import say, say_first
from truing.errors import InputError, InputWarning

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from truing.files import TargetData
    from truing.inverse_kinematics import InverseOptions, Task
    from truing.model import Robot

COLLISIONS = "Collisions"

TaskOption = Annotated[
    Literal["pose", "torch", "point"] | None,
    Choice(
        "What is wanted: position and orientation; position and the tool's axis, roll about it free; position"
        " alone. Default: pose."
    ),
]
FreeAxis = Annotated[
    Literal["none", "x", "y", "z"] | None,
    Choice("Axis of the tool about which its roll is free; means --task torch. none: a full pose."),
]
SeedJoints = Annotated[
    str,
    Kind(
        "Where the robot comes from: 0,-90,90,0,90,0deg, or a CSV with q1_rad … (one row, or one per target)."
        " Default: columns q1_rad … of TARGETS, or the middle of the joints' ranges.",
        flag="--seed",
        metavar="JOINTS",
    ),
]
Choose = Annotated[
    Literal["nearest", "limits_margin", "manipulability", "rail_travel"],
    Choice(
        "Which of several solutions: nearest to the seed, farthest from the limits, farthest from singular,"
        " least travel on the rails."
    ),
]
SceneFile = Annotated[
    Path | None, File("scene.yaml: obstacles that the robot must not collide with.", panel=COLLISIONS)
]
Retreat = Annotated[
    float | None,
    Length(
        "If every solution collides, move the target back along the tool's z by no more than this: 50mm.",
        above=0,
        panel=COLLISIONS,
    ),
]
TargetName = Annotated[
    str, Kind("Which of the robot's targets is brought there. Default: the tool.", metavar="NAME")
]


@dataclass(frozen=True)
class Wanted:
    """What the options say about every target that says nothing else."""

    task: Literal["pose", "torch", "point"] | None
    free_axis: Literal["none", "x", "y", "z"] | None
    retreat: float | None  # [m]

    def like(self) -> Task:
        import numpy as np

        from truing.inverse_kinematics import Task

        axis = None if self.free_axis in (None, "none") else AXIS_NUMBERS[str(self.free_axis)]
        if (
            self.task is not None
            and self.free_axis is not None
            and (axis is not None) != (self.task == "torch")
        ):
            raise InputError(
                f"--free-axis {self.free_axis} and --task {self.task}: a free axis is the task torch, and no"
                " other"
            )
        kind = self.task or ("pose" if axis is None else "torch")
        unit = np.eye(3)[2 if axis is None else axis]
        travel = np.eye(3)[0 if axis is None or axis == 2 else (axis + 1) % 3]
        return Task(
            np.eye(4), kind=kind, axis=unit, travel=travel, retreat=-unit, longest_retreat=self.retreat or 0.0
        )


AXIS_NUMBERS = {"x": 0, "y": 1, "z": 2}


def inverse_options(robot: Robot, choose: Any, scene: Path | None) -> InverseOptions:
    from truing.files import load_scene
    from truing.inverse_kinematics import InverseOptions
    from truing.model import Scene

    return InverseOptions(choose=choose, scene=Scene() if scene is None else load_scene(scene, robot))


def target_index(robot: Robot, name: str) -> int:
    names = [target.name for target in robot.targets]
    if name and name not in names:
        raise InputError(f"--target: the robot has no target {name!r}; its targets are {', '.join(names)}")
    return names.index(name) if name else 0


def seed_joints(text: str, robot: Robot, data: TargetData) -> NDArray[np.float64] | None:
    """--seed, or the joints of the target file; None: the middle of the joints' ranges."""
    import numpy as np

    if not text:
        return data.joints
    path = Path(text)
    if path.suffix.lower() in (".csv", ".parquet", ".pq"):
        return _seed_file(path, robot, data)
    driven = [robot.joints[k] for k in robot.driven_joints()]
    kinds: list[Quantity] = [Angle() if joint.type == "revolute" else Length() for joint in driven]
    parts = words_of(text)
    if len(parts) != len(driven):
        example = ",".join("10deg" if joint.type == "revolute" else "100mm" for joint in driven)
        raise InputError(
            f"--seed: found {len(parts)} joints, the robot has {len(driven)}:"
            f" {', '.join(joint.name for joint in driven)}; expected such as {example}, or a .csv file"
        )
    return np.array(read_with_common_units(parts, kinds, [f"--seed, joint {joint.name}" for joint in driven]))


def _seed_file(path: Path, robot: Robot, data: TargetData) -> NDArray[np.float64]:
    import numpy as np

    from truing.files import load_measurements

    joints = np.asarray(load_measurements(path, robot, joints_only=True).joints)
    if len(joints) not in (1, data.count):
        raise InputError(
            f"{path}: has {len(joints)} rows, expected one, or one for each of {data.count} targets"
        )
    return joints[0] if len(joints) == 1 else joints


def print_reasons(result: Mapping[str, Any], title: str) -> None:
    """What came of the targets; the first of those that are not reached, in words."""
    others = [
        f"{count} {reason.replace('_', ' ')}"
        for reason, count in result["reasons"].items()
        if reason != "reached"
    ]
    say(title + (f" ({', '.join(others)})" if others else ""))
    failures: Sequence[Mapping[str, Any]] = result["failures"]
    say_first([f"target {f['target']}: {f['text']}" for f in failures], 8, "more: see joints.csv")


WHOLE_POSE = 6  # coordinates, and joints that it takes


def warn_of_few_joints(robot: Robot, kinds: Iterable[str], reached: NDArray[np.bool_]) -> None:
    """Another arm's whole poses are out of reach of one with few joints wherever they are."""
    few = robot.driven_count < WHOLE_POSE
    if few and not reached.all() and "pose" in kinds:
        warnings.warn(
            f"{robot.name} has {robot.driven_count} driven joints, and a whole pose takes {WHOLE_POSE}: say"
            " what of it is wanted, --task torch (position and the direction of one axis) or --task point",
            InputWarning,
            stacklevel=2,
        )


def not_whole(result: Mapping[str, Any]) -> str:
    """Why not every target is reached, or the path has gaps or collides; "" if all is well."""
    missing = result["targets"] - result["reached"]
    gaps = len(result.get("path", {}).get("gaps", ()))
    words = [f"{missing} of {result['targets']} targets are not reached"] if missing else []
    words += [f"the path has {gaps} gap{'' if gaps == 1 else 's'}"] if gaps else []
    collisions = len(result.get("path", {}).get("collisions", ()))
    words += [f"the path collides between targets, {collisions} times"] if collisions else []
    return " and ".join(words)
