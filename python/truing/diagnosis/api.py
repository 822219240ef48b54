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
    free functions of the
    recorded inputs compete; what is named is fitted without linearisation and judged on rows that were held
    out. What cannot be
    told apart is listed together, what could not be tested is listed with the reason, and what no effect
    explains is called
    unknown.

    robot: nominal, or calibrated. data: measurements, see `Measurements`.
    effects: definitions of own effects that take part beside the catalogue's.
    leave_out: effects that are not to be considered, "drift,scale" or a list.
    false_alarm: chance that a robot without any gap is said to have one. max_effects: at most so many are
    named.
    test_share: of the pose groups, held out when the data has no `set`.
    search_poses: of more pose groups, so many are searched; errors are those of all rows.
    resamples: draws of folds of pose groups for the intervals, with what was chosen fitted again; at most 10
    more repeat the selection.
    rotation_length: [m] a rotation error of 1 rad counts as this length in reported errors.
    seed: of the split and of every simulation; the same seed gives the same result. threads: 0: as many as
    the machine has.

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
