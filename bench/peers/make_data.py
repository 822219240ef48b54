# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write the synthetic UR10 set on which every program of the bench is scored.

    python make_data.py ur10.npz --seed 1

The true robot is the nominal one with small errors in all 30 link parameters,
stands anywhere in the measurement frame, and carries a tool a few millimetres
from where it should be. The keys are those listed in README.md; `true_*` hold
the truth, which no fit may read.
"""

import argparse

import numpy as np
from mdh import positions, rotation

# Modified DH, as pybotics publishes it; columns alpha, a, beta, theta, d
UR10 = np.array(
    [
        [0, 0, 0, 0, 0.118],
        [np.pi / 2, 0, 0, np.pi, 0],
        [0, 0.6127, 0, 0, 0],
        [0, 0.5716, 0, 0, 0.1639],
        [-np.pi / 2, 0, 0, 0, 0.1157],
        [np.pi / 2, 0, 0, np.pi, 0.0922],
    ]
)
TOOL = np.array([0.05, 0.03, 0.10])  # off the last axis: 27 of 39 parameters are identifiable


def make(seed=1, train=1000, test=300, sigma=3e-5, length=1e-3, angle=1e-3, tool=3e-3, beta=True):
    """Data set as a dictionary; sigma is per axis, in metres, as are length and tool.

    With beta=False the true robot has none either: then a model without beta (pybotics)
    can be right, which it cannot be for nearly parallel axes that are tilted both ways.
    """
    rng = np.random.default_rng(seed)
    size = np.array([angle, length, angle, angle, length])
    true_dh = UR10 + size * rng.standard_normal(UR10.shape)
    if not beta:
        true_dh[:, 2] = 0
    true_tool = TOOL + tool * rng.standard_normal(3)
    true_base = np.eye(4)
    axis = rng.standard_normal(3)
    true_base[:3, :3] = rotation(axis / np.linalg.norm(axis) * rng.uniform(0.2, 2.5))
    true_base[:3, 3] = rng.uniform(-2, 2, 3)
    q_train = rng.uniform(-np.pi, np.pi, (train, 6))
    q_test = rng.uniform(-np.pi, np.pi, (test, 6))
    p_train = positions(true_dh, true_base, true_tool, q_train)
    return {
        "dh": UR10,
        "base": np.eye(4),
        "tool": TOOL,
        "q_train": q_train,
        "p_train": p_train + sigma * rng.standard_normal((train, 3)),
        "q_test": q_test,
        "p_test": positions(true_dh, true_base, true_tool, q_test),
        "sigma": np.float64(sigma),
        "true_dh": true_dh,
        "true_base": true_base,
        "true_tool": true_tool,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--train", type=int, default=1000)
    parser.add_argument("--test", type=int, default=300)
    parser.add_argument("--sigma", type=float, default=3e-5, help="noise per axis [m]")
    parser.add_argument("--no-beta", action="store_true", help="no Hayati errors in the true robot")
    args = parser.parse_args()
    np.savez(args.out, **make(args.seed, args.train, args.test, args.sigma, beta=not args.no_beta))


if __name__ == "__main__":
    main()
