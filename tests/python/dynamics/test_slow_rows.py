# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of recordings whose rows are far apart, as a controller's log or a bus gives them, the same is named."""

from __future__ import annotations

import numpy as np
import pytest

from truing.dynamics import check_recordings, diagnose
from truing.dynamics.recorded import with_rows
from truing.testing.dynamics import simulate_motion

USUAL = ("coulomb", "viscous", "current_offset")


@pytest.mark.parametrize(("seed", "every"), [(3, 4), (3, 15), (4, 10), (5, 10)])
def test_names_and_values_are_those_of_fast_rows(seed: int, every: int) -> None:
    """Rows 40 to 150 ms apart. With differences in place of a curve, stiction and friction that is not
    linear were named at up to four joints, .9 and surer, an unknown beside them."""
    simulated = simulate_motion(seed=seed, seconds=60.0)
    rows = [with_rows(one, np.arange(len(one)) % every == 0) for one in simulated.recordings]
    checked = check_recordings(simulated.nominal, rows)
    said = [one for one in checked.findings if one.finding != "at_rest"]
    assert [one.finding for one in said] == ["slow_rows"]
    assert said[0].value == pytest.approx(10.0 * every)
    found = diagnose(checked.robot, checked.recordings)
    assert found.cutoff == pytest.approx(min(8.0, 25.0 / every), rel=1e-6)  # a quarter of the rows a second
    named = {one.effect: one for one in found.effects if one.effect not in USUAL}
    assert {(one, tuple(effect.joints)) for one, effect in named.items()} == {
        ("coupling", ("J5", "J6")),
        ("load_friction", ("J2",)),
        ("armature", ("J3",)),
    }
    assert not found.unknown
    assert named["load_friction"].parameters[0].value == pytest.approx(0.09, rel=0.05)
    assert named["armature"].parameters[0].value == pytest.approx(1.6, rel=0.03)
    assert min(one.probability for one in named.values()) > 0.9
