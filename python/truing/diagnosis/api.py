# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where the gap between robot and model lies, and which effect causes it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from truing import _core
from truing._core import Diagnosis, Measurements, Robot
from truing.effects import Effect, evaluated, name_list, own_effects

_USUAL_DIAGNOSIS = _core.DiagnoseOptions()


def diagnose(
    robot: Robot,
    data: Measurements,
    *,
    effects: Effect | Iterable[Effect] = (),
    leave_out: str | Sequence[str] = (),
    false_alarm: float = _USUAL_DIAGNOSIS.false_alarm,
    max_effects: int = _USUAL_DIAGNOSIS.max_effects,
    test_share: float = _USUAL_DIAGNOSIS.test_share,
    search_poses: int = _USUAL_DIAGNOSIS.search_poses,
    resamples: int = _USUAL_DIAGNOSIS.resamples,
    rotation_length: float = _USUAL_DIAGNOSIS.rotation_length,
    seed: int = _USUAL_DIAGNOSIS.seed,
    threads: int = 0,
) -> Diagnosis:
    """Find where the gap between robot and model lies, which effect causes it, and how far it shrinks.

    Base and targets are fitted first. Then every effect of the catalogue at every joint, the geometry, and
    free functions of the recorded inputs compete. What is named is fitted without linearisation and judged on
    held-out rows. Effects that the data do not tell apart are listed together. What could not be tested is
    listed with the reason. What no effect explains is called unknown.

    robot: nominal, or calibrated. data: measurements, see `Measurements`.
    effects: definitions of own effects that take part beside the catalogue's.
    leave_out: effects that are not to be considered, "drift,scale" or a list.
    false_alarm: false-positive rate, the probability that a robot without a gap is said to have one.
    max_effects: no more than this are named.
    test_share: fraction of the pose groups that is held out when the data has no `set`.
    search_poses: the search uses no more pose groups than this. Errors are those of all rows.
    resamples: bootstrap draws of pose groups for the intervals, with the named effects fitted again. At most
    10 more repeat the selection.
    rotation_length: [m] a rotation error of 1 rad counts as this length in reported errors.
    seed: of the split and of every simulation. The same seed gives the same result.
    threads: 0: as many as the machine has.

    Raises InputError on data or options that cannot be used.
    """
    options = _core.DiagnoseOptions(
        leave_out=name_list(leave_out),
        false_alarm=false_alarm,
        max_effects=max_effects,
        test_share=test_share,
        search_poses=search_poses,
        resamples=resamples,
        rotation_length=rotation_length,
        seed=seed,
        threads=threads,
    )
    return _core.diagnose(robot, data, options, evaluated(own_effects(effects), robot, data))
