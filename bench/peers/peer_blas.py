# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""BLAS dsyrk of a tall matrix: the price of forming a Gram matrix after the Jacobian exists."""

import numpy as np
from result import best_of
from scipy.linalg.blas import dsyrk

ROWS, COLUMNS = 3_000_000, 39


def run(data):
    # One block of memory read both ways, so that neither call copies: as rows x columns
    # by columns (trans=1), and as the transpose of a row-major Jacobian (trans=0).
    rng = np.random.default_rng(0)
    block = rng.standard_normal((COLUMNS, ROWS), dtype=np.float64)
    flops = ROWS * COLUMNS * (COLUMNS + 1)
    results = []
    for layout, matrix, trans in (
        ("column-major", block.T, 1),
        ("row-major", block.reshape(ROWS, COLUMNS).T, 0),
    ):
        assert matrix.flags.f_contiguous
        seconds, _ = best_of(7, lambda m=matrix, t=trans: dsyrk(1.0, m, trans=t))
        results.append(
            {
                "task": f"gram, {layout}",
                "seconds": seconds,
                "gflops": flops / seconds / 1e9,
                "note": f"dsyrk, {ROWS} x {COLUMNS} float64 {layout}, {flops / 1e9:.2f} Gflop; best of 7",
            }
        )
    return results
