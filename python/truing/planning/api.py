# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Planning of measurements: which poses to measure, and which effects they tell apart."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truing import _core
from truing._core import Distinction, PlanResult, Robot
from truing.effects import Effect, own_effects, split_effects
from truing.errors import InputError
from truing.keywords import made, takes

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import DistinguishKeywords, PlanKeywords


@takes(_core.PlanOptions)
def plan(robot: Robot, **options: Unpack[PlanKeywords]) -> PlanResult:
    """Measurement poses by exchange on an observability index.

        truing.plan(robot, poses=60, effects="backlash", orientation=True)

    options: fields of `PlanOptions`. `free` and `effects` may be one text, as in `identify`; effects of the
    catalogue only.

    Raises InputError: fewer poses than the parameters need, a joint whose range is too small for `min_step`.
    """
    asked, own = split_effects(options.get("effects", ()))
    if own:
        raise InputError(
            f"plan cannot use own effects ({', '.join(effect.name for effect in own)}): their basis is known"
            " only for rows that were recorded; plan with effects of the catalogue"
        )
    return _core.plan(robot, made(_core.PlanOptions, {**options, "effects": asked}))


@takes(_core.DistinguishOptions)
def distinguish(
    robot: Robot,
    joints: ArrayLike,
    *,
    effects: Effect | Iterable[Effect] = (),
    **options: Unpack[DistinguishKeywords],
) -> Distinction:
    """Which effects a plan tells apart, the smallest sizes it would detect, and poses to add. Needs no data.

        planned = truing.plan(robot, poses=60)
        seen = truing.distinguish(
            robot, planned.joints, columns="dir,payload", separate="backlash,joint_offset"
        )

    robot: nominal. joints: shape=(poses, driven joints) [rad | m], as of `plan`.
    effects: own effects that take part beside the catalogue's; those in `separate` need not be named again.
    options: fields of `DistinguishOptions`. `columns` and `separate` may be one text; `separate` takes own
    effects as well.

    Raises InputError: unknown effects, joints or columns.
    """
    asked, own = split_effects(options.get("separate", ()))
    requests = [item.request(robot) if isinstance(item, Effect) else item for item in asked]
    chosen = made(_core.DistinguishOptions, {**options, "separate": requests})
    table = np.asarray(joints, dtype=np.float64)
    if table.ndim != 2:
        raise InputError(f"joints has shape {table.shape}; expected (poses, {robot.driven_count})")
    taking_part = {effect.name: effect for effect in [*own, *own_effects(effects)]}
    return _core.distinguish(robot, table, chosen, list(taking_part.values()))
