# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where the gap between robot and model lies, and which effect causes it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from truing import _core
from truing._core import Diagnosis, Measurements, Robot
from truing.effects import Effect, evaluated, own_effects
from truing.keywords import made, takes
from truing.report.notebook import shown

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import DiagnoseKeywords


@takes(_core.DiagnoseOptions)
def diagnose(
    robot: Robot,
    data: Measurements,
    *,
    effects: Effect | Iterable[Effect] = (),
    **options: Unpack[DiagnoseKeywords],
) -> Diagnosis:
    """Find where the gap between robot and model lies, which effect causes it, and how far it shrinks.

        truing.diagnose(robot, data, leave_out="drift,scale", seed=1)

    Base and targets are fitted first. Then every effect of the catalogue at every joint, the geometry, and
    free functions of the recorded inputs compete. What is named is fitted without linearisation and judged on
    held-out rows. Effects that the data do not tell apart are listed together. What could not be tested is
    listed with the reason. What no effect explains is called unknown.

    robot: nominal, or calibrated. data: measurements, see `Measurements`.
    effects: definitions of own effects that take part beside the catalogue's.
    options: fields of `DiagnoseOptions`. `leave_out` and `also` may be one text, "drift,scale".

    Raises InputError on data or options that cannot be used.
    """
    chosen = made(_core.DiagnoseOptions, options)
    found = _core.diagnose(robot, data, chosen, evaluated(own_effects(effects), robot, data))
    return shown(found, "truing.diagnosis.result:diagnosis_page", data)
