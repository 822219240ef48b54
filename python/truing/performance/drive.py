# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The plan of a performance test as programs, in every brand that there is a writer for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing._core import Robot
from truing.errors import InputError
from truing.performance.plan import APPROACHED, CYCLE, PerformancePlan, arc_names
from truing.programs.write import BRANDS, Loop, Move, Program, write_program

Floats = NDArray[np.float64]
_SECONDS_PER_MOVE = 2.0  # at full speed, to fill the time between two blocks of the warm-up


@dataclass(frozen=True)
class DriveOptions:
    """How the programs drive."""

    dwell: float = 3.0  # [s] at every measured pose, for the robot to settle and the instrument to measure
    rated_speed: float = 1.0  # [m/s] on lines and circles at 100 %


def performance_programs(
    robot: Robot, planned: PerformancePlan, options: DriveOptions | None = None
) -> list[Program]:
    """The warm-up, and for every speed the poses, the approaches and the paths.

    Raises InputError for a robot with a prismatic joint: the programs say joints in degrees.
    """
    options = options or DriveOptions()
    driven = [robot.joints[k] for k in robot.driven_joints()]
    slides = [joint.name for joint in driven if joint.type != "revolute"]
    if slides:
        raise InputError(f"programs are for robots of revolute joints; {', '.join(slides)} is prismatic")
    found = [_program(robot, planned, options, "warm_up", _warm_up(planned, options), 100.0)]
    for speed in planned.options.speeds:
        percent = f"{speed:g}".replace(".", "_")
        for name, body in (
            ("poses", _poses(planned, options)),
            ("approach", _approaches(planned, options)),
            ("paths", _paths(planned, options)),
        ):
            found.append(_program(robot, planned, options, f"{name}_{percent}", body, speed))
    return found


def program_files(programs: list[Program]) -> dict[str, str]:
    """Files by their path: "kuka/poses_100.src" …"""
    return {
        f"{brand}/{name}": text
        for brand in BRANDS
        for program in programs
        for name, text in write_program(program, brand).items()
    }


def _program(
    robot: Robot,
    planned: PerformancePlan,
    options: DriveOptions,
    name: str,
    body: tuple[Move | Loop, ...],
    percent: float,
) -> Program:
    frames = {one: planned.frame(one) for one in planned.names}
    tool = np.asarray(robot.targets[0].T_last_target)
    speed = options.rated_speed * percent / 100.0
    return Program(name, frames, planned.joints[planned.names.index("P1")], tool, body, percent, speed)


def _warm_up(planned: PerformancePlan, options: DriveOptions) -> tuple[Move | Loop, ...]:
    """Blocks of measured cycles, and the cycle of all poses between them."""
    plan = planned.options
    between = 3600.0 * plan.warm_up_hours / plan.warm_up_blocks
    measured = plan.warm_up_cycles * (2 * _SECONDS_PER_MOVE + options.dwell)
    fill = max(1, round((between - measured) / (len(CYCLE) * _SECONDS_PER_MOVE)))
    block = Loop(plan.warm_up_cycles, (Move("joint", "P2"), Move("joint", "P1", dwell=options.dwell)))
    return (Loop(plan.warm_up_blocks, (block, Loop(fill, tuple(Move("joint", p) for p in CYCLE)))),)


def _poses(planned: PerformancePlan, options: DriveOptions) -> tuple[Move | Loop, ...]:
    cycle = tuple(Move("joint", pose, dwell=options.dwell) for pose in CYCLE)
    return (Move("joint", "P1"), Loop(planned.options.cycles, cycle))


def _approaches(planned: PerformancePlan, options: DriveOptions) -> tuple[Move | Loop, ...]:
    """Each pose from each direction on a line, all cycles of a direction one after the other."""
    body: list[Move | Loop] = []
    for pose in APPROACHED:
        body.append(Move("joint", pose))
        for direction in (1, 2, 3):
            visit = (Move("line", f"{pose}.{direction}"), Move("line", pose, dwell=options.dwell))
            body.append(Loop(planned.options.cycles, visit))
    return tuple(body)


def _paths(planned: PerformancePlan, options: DriveOptions) -> tuple[Move | Loop, ...]:
    """The diagonal, and each circle as two arcs."""
    count, cycles = planned.options.path_points, planned.options.path_cycles
    line = (Move("joint", "line.1", dwell=options.dwell), Move("line", f"line.{count}", dwell=options.dwell))
    body: list[Move | Loop] = [Loop(cycles, line)]
    for path in ("circle", "small"):
        begin, first, half, last = arc_names(path, count)
        body.append(Move("joint", begin))
        arcs = (
            Move("line", begin, dwell=options.dwell),
            Move("arc", half, start=begin, via=first),
            Move("arc", begin, start=half, via=last, dwell=options.dwell),
        )
        body.append(Loop(cycles, arcs))
    return tuple(body)
