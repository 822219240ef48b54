# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Timing and scoring, the same for every peer."""

import time

import numpy as np


def best_of(times, call, budget=5.0):
    """Shortest wall time of several calls [s], and the last value; no new call after `budget` seconds."""
    best = float("inf")
    end = time.perf_counter() + budget
    for i in range(times):
        if i and time.perf_counter() > end:
            break
        start = time.perf_counter()
        value = call()
        best = min(best, time.perf_counter() - start)
    return best, value


def score(data, predicted):
    """Held-out distance errors [m].

    `test_*` compare with the noise-free points: the error of the model alone.
    `test_noisy_*` compare with points measured once more with the same noise
    (fixed seed), which is what a user sees; their floor is about 1.6 sigma.
    """
    error = predicted - data["p_test"]
    noise = float(data["sigma"]) * np.random.default_rng(20250101).standard_normal(error.shape)
    out = {}
    for name, e in (("test", error), ("test_noisy", error - noise)):
        distance = np.linalg.norm(e, axis=1)
        out[f"{name}_mean_m"] = float(distance.mean())
        out[f"{name}_rms_m"] = float(np.sqrt(np.mean(distance**2)))
        out[f"{name}_max_m"] = float(distance.max())
    return out
