# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An effect of one's own on the torques: a hose that is bent the more the further the elbow turns.

Nothing in the catalogue says so. The joint and what its torque grows with are all that has to be said.
"""

import numpy as np

import truing
from truing.testing.dynamics import simulate_motion

STIFFNESS = 9.0  # [Nm/rad^2] of the hose


def bent(angle: np.ndarray) -> np.ndarray:
    return np.sign(angle - 0.4) * (angle - 0.4) ** 2


def main() -> None:
    simulated = simulate_motion(seed=5, hidden={})
    recordings = [
        one.replace(torque=one.torque + STIFFNESS * np.outer(bent(one.position[:, 2]), np.eye(6)[2]))
        for one in simulated.recordings
    ]

    hose = truing.dynamics.TorqueEffect("hose", "J3", lambda m: bent(m.joint("J3")), unit="Nm/rad^2")
    found = truing.dynamics.diagnose(simulated.nominal, recordings, effects=hose)

    print(found.sentence)
    first = found.effects[0]
    (parameter,) = first.parameters
    print(f"{parameter.name} = {parameter.value:.2f} ± {parameter.sigma:.2f} {parameter.unit}", end="")
    print(f", hidden were {STIFFNESS:g}; probability {first.probability:.2f}")

    # The robot that was found carries the effect's name and value; what it means has to be given again.
    predicted = truing.dynamics.predict(found.robot, recordings[-1], effects=hose).torque[:, 2]
    left = np.std(predicted - recordings[-1].torque[:, 2]) / np.std(recordings[-1].torque[:, 2])
    print(f"predicted again: {100 * left:.1f} % of the torque's standard deviation is left at J3")


if __name__ == "__main__":
    main()
