# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""One peer of bench/inverse.py, in a process of its own: answers and CPU times on the targets that
bench/inverse.cpp wrote.

    python inverse_peers.py "PEER" FOLDER OUT.npz [--quick] [--cache FOLDER]

OUT.npz holds `summary` (JSON: a list of jobs with their notes, versions) and for job k `times_k` (m,) [s] and
`answers_k`: rows of target,
1 if said to be reached, joints. Nothing is judged here. Needs NumPy and the peer.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import importlib.metadata
import importlib.util
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from inverse_chain import (
    Cases,
    Chain,
    Floats,
    mjcf_of,
    quaternion_of,
    read_cases,
    read_chains,
    urdf_of,
    write_cases,
    write_chain,
)

Answers = list[tuple[bool, Floats]]  # what the peer says of it, joints


@dataclass(frozen=True)
class Solver:
    """`call` alone is timed: the peer's own function on its own types."""

    call: Callable[..., Any]
    answers: Callable[[Any], Answers]
    arguments: Callable[[Floats, Floats], tuple[Any, ...]] = lambda wanted, seed: (wanted, seed)  # of `call`


METRES = RADIANS = 1e-6
RESTARTS = 20
CACHE = Path()
QUICK = False


class Refused(RuntimeError):
    """The peer says that it cannot do this robot."""


def eaik(chain: Chain, task: str) -> Solver:
    from eaik.IK_Homogeneous import HomogeneousRobot

    robot = HomogeneousRobot(chain.zero_frames())
    if not robot.hasKnownDecomposition():
        raise Refused(f"refuses: {robot.getKinematicFamily()}")

    return Solver(
        robot.IK,
        lambda found: [(not bad, q) for q, bad in zip(found.Q, found.is_LS, strict=False)],
        lambda wanted, seed: (wanted,),
    )


def ssik(chain: Chain, task: str) -> Solver:
    """From an artifact of `ssik build`, which is kept: a general six-axis arm takes minutes. Answers come
    with their residual, and are taken by it.
    """
    urdf = urdf_of(chain)
    stem = f"ssik_{chain.name}_{hashlib.sha256(urdf.encode()).hexdigest()[:8]}"
    artifact = CACHE / f"{stem}.py"
    if not artifact.exists() and QUICK and chain.name in REAL_ARMS:
        raise Refused("left out with --quick: its build takes minutes")
    if not artifact.exists():
        (CACHE / f"{stem}.urdf").write_text(urdf, encoding="utf-8")
        command = [
            str(Path(sys.executable).parent / "ssik"),
            "build",
            f"{stem}.urdf",
            "--base",
            "base",
            "--ee",
            "tool",
            "--out",
            artifact.name,
            "--no-validate",
        ]
        built = subprocess.run(command, cwd=CACHE, capture_output=True, text=True)
        if not artifact.exists():
            raise Refused("ssik build: " + (built.stderr.strip().splitlines() or ["no artifact"])[-1])
    spec = importlib.util.spec_from_file_location(stem, artifact)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[stem] = module
    spec.loader.exec_module(module)
    return Solver(
        lambda wanted: module.solve(wanted, enumerate_windings=False),
        lambda found: [(one.fk_residual <= METRES, one.q) for one in found],
        lambda wanted, seed: (wanted,),
    )


def robotics_toolbox(chain: Chain, task: str) -> Solver:
    import roboticstoolbox as rtb
    from roboticstoolbox import ET

    parts = []
    for placement, slides, low, high in zip(
        chain.placements, chain.prismatic, chain.lower, chain.upper, strict=True
    ):
        parts += [ET.SE3(placement), (ET.tz if slides else ET.Rz)(qlim=np.array([low, high]))]
    ets = rtb.ETS([*parts, ET.SE3(chain.tool)])
    # Its residual is half the squared error. Roll free by the mask that its manual names.
    options: dict[str, Any] = {"tol": 0.5 * METRES**2, "k": 0.1, "method": "chan"}
    if task == "torch":
        options["mask"] = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])

    return Solver(
        lambda wanted, seed: ets.ik_LM(wanted, q0=seed, **options),
        lambda found: [(bool(found.success), found.q)],
    )


def trac_ik(seconds: float) -> Callable[[Chain, str], Solver]:
    def make(chain: Chain, task: str) -> Solver:
        import pytracik

        solver = pytracik.TRAC_IK(
            "base", "tool", urdf_of(chain), seconds, 0.5 * METRES, pytracik.SolveType.Speed
        )

        def arguments(wanted: Floats, seed: Floats) -> tuple[Any, ...]:
            w, x, y, z = quaternion_of(wanted)
            return solver, seed, *(float(v) for v in wanted[:3, 3]), x, y, z, w

        return Solver(pytracik.ik, lambda found: [(bool(found[0] >= 0), found[1:])], arguments)

    return make


def roboplan(chain: Chain, task: str) -> Solver:
    import roboplan.core as core
    from roboplan.simple_ik import SimpleIk, SimpleIkOptions

    scene = core.Scene(chain.name, core.loadUrdfSceneDescriptionFromXml(urdf_of(chain)))
    names = scene.getJointNames()
    # Tuned: whole steps, next to no damping, restarts until a tenth of a second is over.
    solver = SimpleIk(
        scene,
        SimpleIkOptions(
            max_iters=100,
            max_time=0.1,
            max_restarts=200,
            step_size=1.0,
            damping=1e-6,
            max_linear_error_norm=METRES,
            max_angular_error_norm=RADIANS,
            check_collisions=False,
        ),
    )
    solver.setRngSeed(1)

    found = core.JointConfiguration(names, np.zeros(chain.joints))

    def arguments(wanted: Floats, seed: Floats) -> tuple[Any, ...]:
        return (
            core.CartesianConfiguration("base", "tool", np.asfortranarray(wanted)),
            core.JointConfiguration(names, seed),
            found,
        )

    return Solver(solver.solveIk, lambda reached: [(bool(reached), np.array(found.positions))], arguments)


def mink_ik(chain: Chain, task: str) -> Solver:
    """A site's pose without cost on its turn about z, limits in the quadratic program; up to 200 steps from
    the seed.
    """
    import mink
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf_of(chain))
    configuration = mink.Configuration(model)
    aim = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=[1.0, 1.0, 0.0])
    limits = [mink.ConfigurationLimit(model)]

    def solve(wanted: Floats, seed: Floats) -> Answers:
        configuration.update(seed)
        aim.set_target(mink.SE3.from_matrix(wanted))
        reached = False
        for _ in range(200):
            error = aim.compute_error(configuration)
            reached = bool(np.linalg.norm(error[:3]) <= METRES and np.linalg.norm(error[3:5]) <= RADIANS)
            if reached:
                break
            configuration.integrate_inplace(
                mink.solve_ik(configuration, [aim], 1.0, "daqp", damping=1e-6, limits=limits), 1.0
            )
        return [(reached, configuration.q.copy())]

    return Solver(solve, lambda found: found)


def drake(chain: Chain, task: str) -> Solver:
    """Position and AddAngleBetweenVectorsConstraint within 1e-6, its default solver, up to 20 restarts."""
    from pydrake.multibody.inverse_kinematics import InverseKinematics
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.solvers import Solve as solve_program

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(urdf_of(chain), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    tool, z = plant.GetFrameByName("tool"), np.array([0.0, 0.0, 1.0])
    random = np.random.default_rng(1)

    def solve(wanted: Floats, seed: Floats) -> Answers:
        problem = InverseKinematics(plant, with_joint_limits=True)
        within = np.full(3, METRES / 2.0)
        problem.AddPositionConstraint(
            tool, np.zeros(3), plant.world_frame(), wanted[:3, 3] - within, wanted[:3, 3] + within
        )
        problem.AddAngleBetweenVectorsConstraint(plant.world_frame(), wanted[:3, 2], tool, z, 0.0, RADIANS)
        start = seed
        for _ in range(1 + RESTARTS):
            problem.get_mutable_prog().SetInitialGuess(problem.q(), start)
            result = solve_program(problem.prog())
            if result.is_success():
                break
            start = random.uniform(chain.lower, chain.upper)
        return [(bool(result.is_success()), result.GetSolution(problem.q()))]

    return Solver(solve, lambda found: found)


@dataclass(frozen=True)
class Peer:
    distributions: tuple[str, ...]  # whose versions are told
    jobs: tuple[tuple[str, str], ...]  # task, robot
    make: Callable[[Chain, str], Solver] | None  # None: the program pinocchio_clik
    runs: int = 3  # the best of so many counts
    times: int = 1  # so often in a row, for what is not much slower than reading the clock
    most: int = 10000  # targets


def jobs(task: str, *robots: str) -> tuple[tuple[str, str], ...]:
    return tuple((task, robot) for robot in robots)


ARMS, REAL_ARMS = ("ur10", "irb"), ("ur10_calibrated", "irb_calibrated")
REAL = (*REAL_ARMS, "gantry_calibrated")
PEERS = {
    "EAIK": Peer(("eaik",), jobs("branches", *ARMS, *REAL_ARMS), eaik, runs=5, times=8),
    "ssik": Peer(("ssik",), jobs("branches", *ARMS, *REAL_ARMS), ssik),
    "Robotics Toolbox": Peer(
        ("roboticstoolbox-python",),
        jobs("one", *ARMS, *REAL) + jobs("torch", *REAL) + jobs("path", *REAL),
        robotics_toolbox,
    ),
    "Pinocchio CLIK": Peer(("pin",), jobs("one", *ARMS, *REAL) + jobs("path", *REAL), None, runs=2),
    "TRAC-IK 5 ms": Peer(
        ("pytracik",), jobs("one", *REAL) + jobs("path", *REAL), trac_ik(0.005), runs=1, most=2000
    ),
    "TRAC-IK 50 ms": Peer(("pytracik",), jobs("one", *REAL), trac_ik(0.05), runs=1, most=2000),
    "RoboPlan": Peer(("roboplan",), jobs("one", *REAL), roboplan, runs=1, most=2000),
    "mink": Peer(("mink", "mujoco", "daqp"), jobs("torch", *REAL), mink_ik, runs=1, most=200),
    "Drake": Peer(("drake",), jobs("torch", *REAL), drake, runs=1, most=200),
}
SETS = {"branches": "pose", "one": "pose", "torch": "torch", "path": "path"}


def run_solver(solver: Solver, cases: Cases, task: str, peer: Peer) -> tuple[Floats, Floats]:
    """Seconds of the process, its other threads included, best of the runs (m,); answers of the first."""
    best, rows = np.full(len(cases.wanted), np.inf), []
    solver.call(
        *solver.arguments(cases.wanted[0], cases.seed[0])
    )  # what is prepared at the first call is not counted
    for run in range(peer.runs):
        previous = cases.truth[0]
        for k, (wanted, seed) in enumerate(zip(cases.wanted, cases.seed, strict=True)):
            if task == "path":
                seed = previous
            given = solver.arguments(wanted, seed)
            begun = time.process_time_ns()
            for _ in range(peer.times):
                raw = solver.call(*given)
            best[k] = min(best[k], 1e-9 * (time.process_time_ns() - begun) / peer.times)
            found = solver.answers(raw)
            if task == "path" and found[0][0]:
                previous = found[0][1]
            if run == 0:
                rows += [np.concatenate([[k, claimed], q]) for claimed, q in found]
    return best, np.array(rows)


def run_clik(chain: Chain, cases: Cases, task: str, peer: Peer) -> tuple[Floats, Floats]:
    program = Path(sys.executable).parent / "pinocchio_clik"
    if not program.exists():
        raise Refused("bench/peers/setup_inverse.sh has not built pinocchio_clik")
    files = [CACHE / f"clik_{name}" for name in ("chain", "cases", "answers")]
    write_chain(chain, files[0])
    write_cases(cases, files[1])
    subprocess.run(
        [str(program), *map(str, files), "path" if task == "path" else "one", str(peer.runs)], check=True
    )
    rows = np.fromfile(files[2]).reshape(len(cases.wanted), -1)
    return rows[:, -1], np.column_stack([np.arange(len(rows)), rows[:, :-1]])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true", help="a tenth of the targets, one run")
    parser.add_argument("--cache", type=Path, default=Path("."), help="where artifacts are kept")
    arguments = parser.parse_args()
    global CACHE, QUICK
    CACHE, QUICK = arguments.cache.absolute(), arguments.quick
    peer, chains = PEERS[arguments.peer], read_chains(arguments.folder)
    arrays: dict[str, Floats] = {}
    summary: list[dict[str, Any]] = []
    for task, robot in peer.jobs:
        chain = chains[robot]
        cases = read_cases(arguments.folder, f"{robot}.{SETS[task]}", chain.joints)
        if task != "path":
            most = min(peer.most, 1000 if task == "branches" else 10000)
            cases = cases.first(most // 10 if arguments.quick else most)
        job: dict[str, Any] = {"task": task, "robot": robot, "targets": len(cases.wanted), "note": ""}
        try:
            times, answers = (
                run_clik(chain, cases, task, peer)
                if peer.make is None
                else run_solver(peer.make(chain, task), cases, task, peer)
            )
            arrays[f"times_{len(summary)}"], arrays[f"answers_{len(summary)}"] = times, answers
        except Refused as refused:
            job["note"] = str(refused)
        except Exception as error:
            job["note"] = f"{type(error).__name__}: {(str(error).strip().splitlines() or [''])[0]}"
        summary.append(job)
        # After every job, so that what was done is kept when the next one takes too long.
        found = {name: importlib.metadata.version(name) for name in peer.distributions}
        np.savez(arguments.out, summary=np.array(json.dumps({"jobs": summary, "versions": found})), **arrays)


if __name__ == "__main__":
    main()
