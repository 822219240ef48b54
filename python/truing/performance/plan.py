# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What to drive for ISO 9283: the cube, its poses and paths (6.8), the order of the cycles (6.9, 6.10)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing._core import Robot
from truing.errors import InputError
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]
SPEEDS = (100.0, 50.0, 10.0)  # [%] of the rated speed
FROM_ENDS = 0.1  # of a diagonal's length: where P2 to P5 are on it
PATH_SHARE = 0.8  # diameter of the large circle, of the cube's edge
SMALL_SHARE = 0.1  # of the small circle
APPROACHED = ("P1", "P2", "P4")
CYCLE = ("P5", "P4", "P3", "P2", "P1")  # the order of one cycle (6.10)
_APPROACH_SHARE = 0.1  # how far off an approach begins, of the cube's edge
_MOST_TURN = math.radians(150)  # a joint may differ by this from P1's: farther is another configuration
_TIGHTEST = 1e-3  # the edge is found to this share of itself
_MARGIN = 0.98  # the cube is smaller than the largest one, by this
_LARGEST_TRIES = 40
_EDGE_RANGE = (0.05, 1.6)  # of the reach, among which the edge is sought: less is no test, more no cube's
_BETTER = 1.01  # times the best edge so far: less is not looked for at other places
_REACHED = 0.98  # of the sampled positions are nearer than what is called the reach
_HEIGHTS = (0.05, 0.95)  # of the sampled positions are lower than the heights looked at
_LEVELS = 9  # heights between these, ends not taken
_AHEAD = (0.3, 0.4, 0.5, 0.6, 0.7)  # of the reach: distances of the cube's centre from the base
_FEWEST = 3  # cycles, and points of a path: of fewer no standard deviation and no shape is known


@dataclass(frozen=True)
class PlanOptions:
    """How large a performance test is."""

    cycles: int = 30  # of poses and approaches
    path_cycles: int = 10
    path_points: int = 21  # at which paths are judged
    speeds: tuple[float, ...] = SPEEDS  # [%]
    edge: float | None = None  # [m] of the cube; None: the largest that is reached
    centre: tuple[float, float, float] | None = None  # [m] in the base; None: where the cube is largest
    warm_up_hours: float = 8.0
    warm_up_blocks: int = 24
    warm_up_cycles: int = 10  # in each block


@dataclass(frozen=True)
class Cube:
    """The test cube, its edges parallel to the axes of the base."""

    centre: Floats  # shape=(3,) [m] in the base
    edge: float  # [m]
    rotation: Floats  # shape=(3, 3): the tool in the base, the same at all poses

    def corner(self, x: int, y: int, z: int) -> Floats:
        """Each of x, y, z is -1 or 1."""
        return np.asarray(self.centre + 0.5 * self.edge * np.array([x, y, z]))


@dataclass(frozen=True)
class PerformancePlan:
    """Commanded poses in the robot's base, and the joints that reach them."""

    cube: Cube
    names: tuple[str, ...]
    T_base_tool: Floats  # shape=(n, 4, 4) [m]
    path: tuple[str, ...]  # "" of a pose
    point: tuple[int, ...]  # of a path, from 1; 0 of a pose
    joints: Floats  # shape=(n, driven joints) [rad | m]
    options: PlanOptions = field(default_factory=PlanOptions)

    def frame(self, name: str) -> Floats:
        """Of a pose by its name."""
        return np.asarray(self.T_base_tool[self.names.index(name)])

    def paths(self) -> list[str]:
        """Names of the paths."""
        return list(dict.fromkeys(name for name in self.path if name))


def plan_test(robot: Robot, options: PlanOptions | None = None) -> PerformancePlan:
    """The cube in the most-used workspace of the robot, poses, approaches and paths in it.

    The cube stands before the robot (x of the base ahead) and is the largest of which corners and poses are
    reached in one configuration, with the tool turned the same way; of several tool directions (down, ahead,
    as at the middle of the joints' ranges) the one with the largest cube. P1 is its centre, P2 to P5 lie in
    the diagonal plane through the lower edge near the robot and the upper edge away from it, a tenth of the
    diagonals' length from their ends. An arm of fewer than six joints reaches positions; its tool turns as it
    must.

    Raises InputError where no cube is reached.
    """
    options = options or PlanOptions()
    _require_sense(options)
    reach = _Reach(robot)
    cube = _largest_cube(reach, options)
    names, path, point, positions = _test_points(cube, options)
    frames = _frames(cube.rotation, positions)
    joints = reach.joints(frames, everything=True)
    if joints is None:
        raise InputError("the poses and paths of this cube are not all reached: give a smaller --edge")
    if not reach.whole:
        frames = reach.attained(joints)
    return PerformancePlan(cube, names, frames, path, point, joints, options)


def _require_sense(options: PlanOptions) -> None:
    if min(options.cycles, options.path_cycles, options.warm_up_cycles, options.path_points) < _FEWEST:
        raise InputError(f"cycles and points of a path: expected {_FEWEST} or more")
    if not options.speeds or not all(0 < speed <= 100 for speed in options.speeds):
        raise InputError(f"speeds: found {list(options.speeds)}, expected percentages above 0, to 100")


def _frames(rotation: Floats, positions: Sequence[Floats] | Floats) -> Floats:
    """Poses that are turned the same way, shape=(n, 4, 4)."""
    frames = np.tile(np.eye(4), (len(positions), 1, 1))
    frames[:, :3, :3], frames[:, :3, 3] = rotation, positions
    return frames


class _Reach:
    """Which poses in the base the robot reaches, in one configuration."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.whole = robot.driven_count >= 6  # position and orientation
        self.solver = _core.InverseSolver(robot, _core.InverseOptions(), None, target=0)
        self.base = np.asarray(robot.T_measurement_base)
        driven = [robot.joints[k] for k in robot.driven_joints()]
        self.turning = np.array([joint.type == "revolute" for joint in driven])
        self.low, self.high = (np.array([_end(joint, place) for joint in driven]) for place in range(2))
        self.like = _core.Task(np.eye(4), kind="pose" if self.whole else "point")

    def solve(self, frames: Floats, seed: Floats | None) -> tuple[Floats, NDArray[np.bool_]]:
        found = self.solver.solve_batch(self.base @ frames, seed, None, like=self.like, threads=1)
        return np.asarray(found.joints), np.asarray(found.reached, dtype=bool)

    def joints(self, frames: Floats, everything: bool = False) -> Floats | None:
        """Those that reach all poses near the first one's configuration; None: some are not reached."""
        first, reached = self.solve(frames[:1], None)
        if not reached[0]:
            return None
        rest, reached = self.solve(frames, first[0])
        turned = np.abs(rest - first[0])[:, self.turning]
        if not reached.all() or (turned.size and turned.max() > _MOST_TURN):
            return None
        return rest if everything else first

    def attained(self, joints: Floats) -> Floats:
        back = np.linalg.inv(self.base)
        return np.stack([back @ _core.forward_kinematics(self.robot, q)[-1] for q in joints])

    def sampled(self) -> Floats:
        """Tools at random joints, shape=(n, 4, 4) in the base."""
        rng = np.random.default_rng(0)
        return self.attained(rng.uniform(self.low, self.high, (2000, len(self.low))))

    def middle(self) -> Floats:
        """The tool's orientation at the middle of the joints' ranges."""
        return np.asarray(self.attained(0.5 * (self.low + self.high)[None])[0, :3, :3])


def _end(joint: Any, place: int) -> float:
    """An end of a joint's range; half a turn where there is none."""
    limits = (joint.lower, joint.upper)
    return float(limits[place]) if math.isfinite(limits[place]) else (-math.pi, math.pi)[place]


def _tool_rotations(reach: _Reach) -> list[Floats]:
    """Down, ahead, and as at the middle of the joints' ranges."""
    if not reach.whole:
        return [np.eye(3)]
    down, ahead = rotations_from_angles(np.array([[0.0, math.pi, 0.0], [0.0, math.pi / 2, 0.0]]), "zyx")
    return [down, ahead, reach.middle()]


def _largest_cube(reach: _Reach, options: PlanOptions) -> Cube:
    best: Cube | None = None
    positions = reach.sampled()[:, :3, 3]
    radius = float(np.quantile(np.linalg.norm(positions, axis=1), _REACHED))
    if options.centre is not None:
        centres = [np.array(options.centre)]
    else:
        low, high = np.quantile(positions[:, 2], _HEIGHTS)
        centres = [
            np.array([ahead * radius, 0.0, up])
            for ahead in _AHEAD
            for up in np.linspace(low, high, _LEVELS)[1:-1]
        ]
    for rotation in _tool_rotations(reach):
        for centre in centres:
            edge = _edge_at(reach, centre, rotation, radius, options, best)
            if edge and (best is None or edge > best.edge):
                best = Cube(centre, edge, rotation)
    if best is None:
        wanted = "" if options.edge is None else f" with an edge of {options.edge:g} m"
        where = "" if options.centre is None else " around this centre"
        raise InputError(f"{reach.robot.name}: no cube{wanted}{where} is reached in one configuration")
    return best if options.edge is not None else Cube(best.centre, _MARGIN * best.edge, best.rotation)


def _edge_at(
    reach: _Reach,
    centre: Floats,
    rotation: Floats,
    radius: float,
    options: PlanOptions,
    best: Cube | None,
) -> float:
    """The largest edge of a cube around `centre`, 0 if it is no larger than the best so far."""

    def fits(edge: float) -> bool:
        cube = Cube(centre, edge, rotation)
        corners = [cube.corner(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        return reach.joints(_frames(rotation, [*_test_points(cube, options)[3], *corners])) is not None

    wanted = options.edge
    if wanted is not None:
        return wanted if best is None and fits(wanted) else 0.0
    low, high = radius * _EDGE_RANGE[0], radius * _EDGE_RANGE[1]
    low = low if best is None else _BETTER * best.edge
    if not fits(low):
        return 0.0
    for _ in range(_LARGEST_TRIES):
        if high - low < _TIGHTEST * high:
            break
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


# ---- Points in the cube ------------------------------------------------------------------------------------


def cube_poses(cube: Cube) -> dict[str, Floats]:
    """P1 to P5 (6.8): the centre, and a tenth of the diagonals of the plane from their ends."""
    ends = {
        "P2": cube.corner(1, 1, 1),
        "P3": cube.corner(1, -1, 1),
        "P4": cube.corner(-1, -1, -1),
        "P5": cube.corner(-1, 1, -1),
    }
    share = 1.0 - 2.0 * FROM_ENDS
    return {"P1": cube.centre, **{n: cube.centre + share * (end - cube.centre) for n, end in ends.items()}}


def approaches(cube: Cube) -> dict[str, Floats]:
    """Where the approaches of P1, P2, P4 begin (7.2): along x, y, z of the base, on the centre's side."""
    poses = cube_poses(cube)
    found = {}
    for name in APPROACHED:
        inward = np.where(cube.centre - poses[name] < 0, -1.0, 1.0)
        for axis in range(3):
            off = np.zeros(3)
            off[axis] = _APPROACH_SHARE * cube.edge * inward[axis]
            found[f"{name}.{axis + 1}"] = poses[name] + off
    return found


def path_points(cube: Cube, count: int) -> dict[str, Floats]:
    """Points of the paths (6.8): the diagonal from P2 to P4, a large and a small circle in the plane, each
    shape=(count, 3). Circles end where they begin.
    """
    poses = cube_poses(cube)
    share = np.linspace(0, 1, count)[:, None]
    across = np.array([0.0, 1.0, 0.0])
    slope = (poses["P2"] - poses["P5"]) / np.linalg.norm(poses["P2"] - poses["P5"])
    angle = 2 * math.pi * share
    turn = np.cos(angle) * across + np.sin(angle) * slope
    return {
        "line": poses["P2"] + share * (poses["P4"] - poses["P2"]),
        "circle": cube.centre + 0.5 * PATH_SHARE * cube.edge * turn,
        "small": cube.centre + 0.5 * SMALL_SHARE * cube.edge * turn,
    }


def arc_names(path: str, count: int) -> tuple[str, str, str, str]:
    """Of a circle's points: begin, a quarter, half, three quarters, as near as there are points."""
    return tuple(  # type: ignore[return-value]
        f"{path}.{1 + round(quarter * (count - 1) / 4)}" for quarter in range(4)
    )


def _test_points(
    cube: Cube, options: PlanOptions
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...], Floats]:
    """Names, paths, points and positions of all that is commanded."""
    single = {**cube_poses(cube), **approaches(cube)}
    names, path, point = list(single), [""] * len(single), [0] * len(single)
    positions = list(single.values())
    for of, points in path_points(cube, options.path_points).items():
        for number, position in enumerate(points, 1):
            names.append(f"{of}.{number}")
            path.append(of)
            point.append(number)
            positions.append(position)
    return tuple(names), tuple(path), tuple(point), np.array(positions)


# ---- The order of the cycles -------------------------------------------------------------------------------

SheetRow = dict[str, Any]
SHEET = ("test", "pose", "path", "cycle", "approach", "point", "block", "load_percent", "speed_percent")


def sheet_rows(planned: PerformancePlan) -> Iterator[SheetRow]:
    """What is to be measured, in the order in which the programs drive it: first the warm-up."""
    options = planned.options
    for block in range(1, options.warm_up_blocks + 1):
        for cycle in range(1, options.warm_up_cycles + 1):
            yield _row("warm-up", "P1", cycle, 100.0, block=block)
    for speed in options.speeds:
        for cycle in range(1, options.cycles + 1):
            for pose in CYCLE:
                yield _row("pose", pose, cycle, speed)
        for pose in APPROACHED:
            for approach in (1, 2, 3):
                for cycle in range(1, options.cycles + 1):
                    yield _row("approach", pose, cycle, speed, approach=approach)
        for path in planned.paths():
            for cycle in range(1, options.path_cycles + 1):
                for point in range(1, options.path_points + 1):
                    yield _row("path", "", cycle, speed, path=path, point=point)


def _row(
    test: str,
    pose: str,
    cycle: int,
    speed: float,
    *,
    path: str = "",
    point: int | None = None,
    approach: int | None = None,
    block: int | None = None,
) -> SheetRow:
    values: Sequence[Any] = (test, pose, path, cycle, approach, point, block, 100.0, speed)
    return dict(zip(SHEET, values, strict=True))
