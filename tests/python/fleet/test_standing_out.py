# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values that stand out are named, and others as seldom as is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from truing.fleet.standing_out import beyond, standing_out


def test_students_t_is_scipys() -> None:
    for freedom in (1, 2, 3, 4, 7, 10, 199):
        for t in (0.1, 1.0, 2.5, 6.0):
            assert beyond(t, freedom) == pytest.approx(2.0 * stats.t.sf(t, freedom), rel=1e-8, abs=1e-14)


def test_two_values_that_stand_out_do_not_hide_each_other() -> None:
    random = np.random.default_rng(31)
    values = np.append(random.normal(0.0, 1.0, 18), [30.0, 31.0])
    outliers = standing_out(values, np.full(20, 0.1), 0.01)
    assert sorted(o.index for o in outliers) == [18, 19]
    assert all(abs(o.centre) < 1.0 and 0.5 < o.scatter < 1.5 for o in outliers)


def test_chance_names_a_value_as_often_as_it_says() -> None:
    random = np.random.default_rng(32)
    errors = random.uniform(0.5, 1.5, (600, 12))
    values = random.normal(0.0, 1.0, (600, 12)) * np.hypot(errors, 1.0)
    named = sum(bool(standing_out(v, e, 0.05)) for v, e in zip(values, errors, strict=True))
    assert named / 600 < 0.1


def test_of_few_values_none_stands_out() -> None:
    assert standing_out(np.array([0.0, 0.1, -0.1, 50.0]), np.full(4, 0.1), 0.01) == []
    assert standing_out(np.array([0.0, 0.1, -0.1, np.nan, np.nan, 50.0]), np.full(6, 0.1), 0.01) == []
