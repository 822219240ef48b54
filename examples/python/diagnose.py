# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A robot misses its model, and nobody knows why: what is it, where is it, and how much better will it get?

The hidden cause is lost motion in one gear and a joint that jumps where a cable gets stuck. The first is in
the catalogue, the second is not.
"""

import numpy as np

import truing
from truing.examples import example

NOISE = 3e-5  # [m] of one coordinate


def measured(robot: truing.Robot, poses: int, seed: int) -> truing.Measurements:
    """What a tracker would record: joints, approach directions and positions, of a robot that is not quite
    its model.
    """
    true = robot.copy()
    true.effects = [truing.model.AppliedEffect("backlash", ["J3"], {"backlash.J3": 8e-4})]
    joints = truing.simulate(robot, poses=poses, seed=seed).data.joints
    random = np.random.default_rng(seed)
    directions = random.choice([-1.0, 1.0], size=joints.shape)
    moved = np.array(joints)
    moved[:, 0] += np.where(joints[:, 0] > 0.3, 4e-4, -4e-4)  # the cable
    positions = truing.predict(
        true, truing.Measurements(moved, directions=directions)
    ).position + random.normal(0, NOISE, (poses, 3))
    return truing.Measurements(joints, positions=positions, directions=directions)


def main() -> None:
    robot = truing.load_robot(example("irb120"))
    found = truing.diagnose(robot, measured(robot, 250, seed=5))

    print(found.sentence)
    for effect in found.effects:
        print(
            f"{effect.effect} at {', '.join(effect.joints)}: probability {effect.probability:.2f}, takes"
            f" {100 * effect.shrink.value:.0f} % off the held-out error ({100 * effect.shrink.low:.0f} to"
            f" {100 * effect.shrink.high:.0f} %)"
        )
        for parameter in effect.parameters:
            print(f"  {parameter.name} = {parameter.value:.6f} ± {parameter.sigma:.6f} {parameter.unit}")
        for other in effect.confounded_with:
            print(f"  these data cannot tell it from {other.effect}: {other.separated_by}")
    for unknown in found.unknown:
        print(
            f"unknown: {unknown.joint or 'something'} moves with"
            f" {', '.join(unknown.inputs) or 'nothing recorded'}: {unknown.looks_like}"
        )
    for line in sorted({f"{n.effect}: {n.why}" for n in found.not_testable})[:3]:
        print("not testable,", line)
    smallest = next(d for d in found.detectable if d.effect == "gear_ratio")
    print(f"a gear ratio off by {smallest.size:.1e} at {smallest.joint} would have shown")

    # Has it helped? Poses that nobody measured.
    fresh = measured(robot, 500, seed=6)
    for name, model in (("before", found.robot_before), ("with what has a name", found.robot)):
        error = np.linalg.norm(truing.residuals(model, fresh).position, axis=1)
        print(f"fresh poses, {name}: {1e3 * np.sqrt((error**2).mean()):.3f} mm rms")


if __name__ == "__main__":
    main()
