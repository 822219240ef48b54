# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a careful user writes in an afternoon: Gauss-Newton with an analytic Jacobian in NumPy."""

import numpy as np
from mdh import align, positions, positions_and_jacobian, rotation
from result import best_of, score

RANK_TOLERANCE = 1e-8  # of the largest singular value, columns scaled to unit length


def fit(dh, tool, q, p, max_iterations=20):
    """Fit base, all link parameters and the tool to measured points.

    Directions that the data does not see are left where they are: the step is the
    one of least norm in scaled parameters.

    Returns:
        dh, base, tool, rank, iterations.
    """
    dh, tool = dh.copy(), tool.copy()
    base = align(positions(dh, np.eye(4), tool, q), p)
    iteration = 0
    for _ in range(max_iterations):
        iteration += 1
        predicted, J = positions_and_jacobian(dh, base, tool, q)
        r = (p - predicted).ravel()
        J = J.reshape(len(r), -1)
        scale = np.linalg.norm(J, axis=0)
        # QR first: the SVD is then of a 39 x 39 triangle, twice as fast as of J itself
        triangle = np.linalg.qr(np.c_[J / scale, r], mode="r")
        U, s, Vt = np.linalg.svd(triangle[:-1, :-1])
        rank = int(np.sum(s > RANK_TOLERANCE * s[0]))
        along = U[:, :rank].T @ triangle[:-1, -1]
        step = (Vt[:rank].T @ (along / s[:rank])) / scale
        base[:3, :3] = rotation(step[:3]) @ base[:3, :3]
        base[:3, 3] += step[3:6]
        dh += step[6:-3].reshape(dh.shape)
        tool += step[-3:]
        # the step explains less than a millionth of what is left: noise
        if along @ along <= 1e-6 * (r @ r - along @ along):
            break
    return dh, base, tool, rank, iteration


def run(data):
    dh, tool, q, p = data["dh"], data["tool"], data["q_train"], data["p_train"]
    seconds, (fdh, fbase, ftool, rank, iterations) = best_of(20, lambda: fit(dh, tool, q, p))
    both, _ = best_of(50, lambda: positions_and_jacobian(dh, np.eye(4), tool, q))
    return [
        {
            "task": "fit",
            "seconds": seconds,
            **score(data, positions(fdh, fbase, ftool, data["q_test"])),
            "rank": rank,
            "note": (
                f"analytic Jacobian, QR + SVD, rank {rank} of {6 + dh.size + 3}, {iterations} iterations,"
                " base from Kabsch; best of up to 20"
            ),
        },
        {
            "task": "fk+jacobian",
            "seconds": both,
            "note": f"{len(q)} poses, {6 + dh.size + 3} columns, 3 rows a pose; best of 50",
        },
    ]
