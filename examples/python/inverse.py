# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inverse kinematics of a calibrated arm: poses, a torch whose roll is free, a path; and what to command to a
controller that knows the nominal arm only.
"""

import numpy as np

import truing
from truing.examples import example
from truing.inverse_kinematics import InverseSolver, Task


def main() -> None:
    nominal = truing.load_robot(example("irb120"))
    # What a calibration would find: links and zeros that are a little off, and a backlash in joint 3.
    links = [
        joint.replace(a=joint.a + 4e-4, alpha=joint.alpha + 6e-4, offset=joint.offset + 8e-4)
        for joint in nominal.joints
    ]
    real = nominal.replace(
        joints=links, effects=[truing.model.AppliedEffect("backlash", ["J3"], {"backlash.J3": 3e-4})]
    )

    solver = InverseSolver(real)
    random = np.random.default_rng(1)
    low, high = (
        0.8 * np.array([getattr(joint, end) for joint in nominal.joints]) for end in ("lower", "upper")
    )
    poses = np.array([solver.forward(q) for q in random.uniform(low, high, (200, 6))])

    found = truing.inverse(real, poses)
    print(
        f"{int(found.reached.sum())} of {len(found)} poses reached, the worst to"
        f" {found.position_error.max():.1e} m"
    )
    branches = solver.branches(Task(poses[0]))
    print(f"the first of them in {len(branches)} ways, and {branches.beyond_limits} beyond the limits")

    too_far = poses[0].copy()
    too_far[:3, 3] *= 3.0 / np.linalg.norm(too_far[:3, 3])
    print("3 m away:", solver.describe(solver.solve(Task(too_far))))

    # A weld: the roll about the torch is whatever suits the arm.
    seam = np.tile(solver.forward([0.0, 0.4, 0.1, 0.0, 0.9, 0.0]), (100, 1, 1))
    seam[:, 1, 3] += np.linspace(-0.1, 0.1, 100)
    path = truing.inverse_path(real, seam, kind="torch")
    print(
        f"a seam of 100 poses: {'continuous' if path.continuous else 'with gaps'}, no joint moves by more"
        f" than {np.degrees(path.longest_turn):.2f} deg a step"
    )

    made = truing.compensate(nominal, real, poses)
    good = made.solutions.reached & np.isfinite(made.position_before)
    print(
        f"commanded as they are, poses would be missed by {1e3 * made.position_before[good].mean():.2f} mm;"
        f" compensated by {made.solutions.position_error[good].max():.1e} m at worst"
    )


if __name__ == "__main__":
    main()
