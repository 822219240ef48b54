# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses and joints of a robot program, for readers that take tables of them.

A program is recognised by its name (.src, .mod, .ls, .script, .jbi; .dat with DEFDAT in it). What is no
literal target is left out with a warning.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError, InputWarning
from truing.files.brand_frames import Brand, frame_from_numbers
from truing.files.flange import last_to_flange
from truing.files.programs import Given, Place, Target, has_program_name, read_programs

Floats = NDArray[np.float64]
_HEAD = 65536  # [bytes]


def counts_j3_from_horizon(brand: Brand, robot: _core.Robot) -> bool:
    """Whether FANUC's pendant counts J3 against the horizon and the model against the lower arm, so that the
    model's J3 is the sum of J2 and J3. A passive joint that J2 drives is a model's own way to say so.
    """
    if brand != "fanuc":
        return False
    driven = [robot.joints[k].name for k in robot.driven_joints()]
    return not any(name == driven[1] for joint in robot.joints for name, _ in joint.driven_by)


def is_program(path: Path) -> bool:
    """Whether a file is a robot program. Many things are called .dat: of KUKA's DEFDAT says so."""
    if not has_program_name(path) or path.suffix.lower() != ".dat":
        return has_program_name(path)
    try:
        with path.open("rb") as file:
            return b"DEFDAT" in file.read(_HEAD).upper()
    except (OSError, ValueError):
        return False


@dataclass(frozen=True)
class ProgramPoses:
    """Literal targets of a program in the order in which its moves use them."""

    path: Path
    brand: Brand
    targets: tuple[Target, ...]

    def where(self, target: Target) -> str:
        return f"{self.path}, line {target.line}: {target.name}"

    def flanges(self) -> tuple[Floats, bool]:
        """T_base_flange, shape=(n, 4, 4) [m], of targets that are poses. True: a tool is not known, and all
        frames are those of the tool. Raises InputError for joints and for unknown frames.
        """
        for target in self.targets:
            if target.kind == "joints":
                raise InputError(
                    f"{self.where(target)}: is given by joints, and has no pose without a robot: `truing"
                    " apply"
                    " --poses-out` writes poses of all targets"
                )
            if target.frame.T is None:
                raise InputError(
                    f"{self.where(target)}: {target.frame.why}: `truing apply --frame … --poses-out FILE`"
                    " writes a"
                    " table with it"
                )
        as_tools = any(target.tool.T is None for target in self.targets)
        frames = [
            _known(target.frame)
            @ self._pose(target)
            @ (np.eye(4) if as_tools else np.linalg.inv(_known(target.tool)))
            for target in self.targets
        ]
        return np.array(frames), as_tools

    def _pose(self, target: Target) -> Floats:
        try:
            return frame_from_numbers(self.brand, [number.value for number in target.numbers])
        except InputError as error:
            raise InputError(f"{self.where(target)}: {error}") from None

    def joints(self, robot: _core.Robot) -> Floats:
        """shape=(n, 6) [rad] of a program of joints alone, as the robot's model has them."""
        q = np.array([[number.value for number in target.numbers] for target in self.targets])
        if q.shape[1] != robot.driven_count:
            raise InputError(
                f"{self.path}: has {q.shape[1]} joints, the robot has {robot.driven_count} driven ones"
            )
        q = q if self.brand == "ur" else np.radians(q)
        if counts_j3_from_horizon(self.brand, robot):
            q[:, 2] += q[:, 1]
        return q

    @property
    def only_joints(self) -> bool:
        return all(target.kind == "joints" for target in self.targets)

    def parts(self) -> tuple[ProgramPoses, ProgramPoses]:
        """Targets that are joints, and those that are poses."""
        split = [tuple(t for t in self.targets if t.kind == kind) for kind in ("joints", "pose")]
        return ProgramPoses(self.path, self.brand, split[0]), ProgramPoses(self.path, self.brand, split[1])


def _known(place: Place) -> Floats:
    assert place.T is not None
    return place.T


def read_program_poses(path: Path, *, every_move: bool = False) -> ProgramPoses:
    """every_move: a target as often as moves go to it, in the order in which the moves stand in the file.
    Raises InputError where the program cannot be read, has no literal target, or, with `every_move`, goes to
    what is none.
    """
    readings, refused = read_programs([with_moves(path)], Given())
    if refused:
        raise InputError(refused[0].message)
    reading = readings[0]
    if reading.stays:
        first = reading.stays[0]
        what = f"line {first.line}, {first.what}: {first.why}"
        if every_move:
            raise InputError(
                f"{path}: {what}: it is not known which row belongs to it; expected a program of literal"
                " targets, or a table of poses"
            )
        more = f", and {len(reading.stays) - 1} more" if len(reading.stays) > 1 else ""
        warnings.warn(
            f"{path}: left out is what is no literal target: {what}{more}", InputWarning, stacklevel=3
        )
    targets = list(reading.targets)
    if every_move:
        order = sorted((move, k) for k, target in enumerate(targets) for move in target.moves)
        targets = [targets[k] for _, k in order]
    if not targets:
        raise InputError(f"{path}: has no literal target whose meaning is known")
    return ProgramPoses(path, reading.brand, tuple(targets))


def with_moves(path: Path) -> Path:
    """Of a .dat the .src beside it, which says what its targets are for."""
    if path.suffix.lower() != ".dat":
        return path
    beside = [path.with_suffix(suffix) for suffix in (".src", ".SRC", ".Src")]
    return next((other for other in beside if other.exists()), path)


def hand_poses(path: Path) -> Floats:
    """T_base_flange at every move, shape=(n, 4, 4) [m]; of the tool, with a warning, where the program does
    not say which."""
    frames, as_tools = read_program_poses(path, every_move=True).flanges()
    if as_tools:
        warnings.warn(
            f"{path}: its tool is not known: the poses are those of the tool, and the camera is found"
            " against it",
            InputWarning,
            stacklevel=3,
        )
    return frames


def wanted_poses(path: Path, robot: _core.Robot, *, in_base: bool) -> tuple[Floats, Floats | None]:
    """Where the program wants the robot's first target, shape=(n, 4, 4) [m] in the measurement frame
    (`in_base`: in the robot base), and joints [rad] if it is given by joints alone.
    """
    program = read_program_poses(path)
    by_joints, by_poses = program.parts()
    solver = _core.InverseSolver(robot)
    T_measurement_base = np.asarray(robot.T_measurement_base)
    found: dict[int, Floats] = {}
    joints = by_joints.joints(robot) if by_joints.targets else None
    for k, target in enumerate(by_joints.targets):
        assert joints is not None
        found[id(target)] = solver.forward(joints[k])
    if by_poses.targets:
        frames, as_tools = by_poses.flanges()
        if as_tools:
            warnings.warn(
                f"{path}: its tool is not known: taken to be the robot's target {robot.targets[0].name!r}",
                InputWarning,
                stacklevel=3,
            )
        T_flange_target = np.linalg.inv(last_to_flange(robot)) @ robot.targets[0].T_last_target
        end = np.eye(4) if as_tools else T_flange_target
        found |= {id(t): T_measurement_base @ T @ end for t, T in zip(by_poses.targets, frames, strict=True)}
    wanted = np.array([found[id(target)] for target in program.targets])
    if in_base:
        wanted = np.linalg.inv(T_measurement_base) @ wanted
    return wanted, joints if program.only_joints else None
