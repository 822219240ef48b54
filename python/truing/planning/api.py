# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Planning of measurements: which poses to measure, and which effects they tell apart."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from truing import _core
from truing._core import Distinction, PlanResult, Robot
from truing.effects import Effect, Effects, name_list, own_effects, split_effects
from truing.errors import InputError

_USUAL_DISTINCTION = _core.DistinguishOptions()  # in plan.hpp


def plan(
    robot: Robot,
    *,
    poses: int = 50,
    min_step: float = 0.2617993877991494,
    min_step_prismatic: float = 0.0,
    index: Literal[
        "d_optimal", "a_optimal", "e_optimal", "inverse_condition", "noise_amplification"
    ] = "d_optimal",
    orientation: bool = False,
    position_sigma: float = 3e-5,
    rotation_sigma: float = 1e-4,
    sweeps: int = 4,
    proposals: int = 64,
    seed: int = 0,
    free: str | Sequence[str] = (),
    effects: Effects = (),
) -> PlanResult:
    """Measurement poses by exchange on an observability index.

    poses: how many. min_step: [rad], min_step_prismatic: [m]: least motion of a joint between neighbours.
    index: what the plan maximises, see `PlanOptions`. orientation: poses are measured, not only positions.
    position_sigma: [m], rotation_sigma: [rad] of one component, for the standard errors promised.
    sweeps, proposals, seed: of the exchange. free, effects: as in `identify`; effects of the catalogue only.

    Raises InputError: fewer poses than the parameters need, a joint whose range is too small for `min_step`.
    """
    asked, own = split_effects(effects)
    if own:
        raise InputError(
            f"plan cannot use own effects ({', '.join(effect.name for effect in own)}): their basis is known"
            " only for rows that were recorded; plan with effects of the catalogue"
        )
    options = _core.PlanOptions(
        poses=poses,
        min_step=min_step,
        min_step_prismatic=min_step_prismatic,
        index=index,
        orientation=orientation,
        position_sigma=position_sigma,
        rotation_sigma=rotation_sigma,
        sweeps=sweeps,
        proposals=proposals,
        seed=seed,
        free=name_list(free),
        effects=[item for item in asked if not isinstance(item, Effect)],
    )
    return _core.plan(robot, options)


def distinguish(
    robot: Robot,
    joints: ArrayLike,
    *,
    columns: str | Sequence[str] = (),
    separate: Effects = (),
    effects: Effect | Iterable[Effect] = (),
    payload: float = _USUAL_DISTINCTION.payload,
    temperature_low: float = _USUAL_DISTINCTION.temperature_low,
    temperature_high: float = _USUAL_DISTINCTION.temperature_high,
    seconds_per_pose: float = _USUAL_DISTINCTION.seconds_per_pose,
    orientation: bool = _USUAL_DISTINCTION.orientation,
    position_sigma: float = _USUAL_DISTINCTION.position_sigma,
    rotation_sigma: float = _USUAL_DISTINCTION.rotation_sigma,
    alike: float = _USUAL_DISTINCTION.alike,
    add: int = _USUAL_DISTINCTION.add,
    proposals: int = _USUAL_DISTINCTION.proposals,
    min_step: float = _USUAL_DISTINCTION.min_step,
    min_step_prismatic: float = _USUAL_DISTINCTION.min_step_prismatic,
    seed: int = _USUAL_DISTINCTION.seed,
) -> Distinction:
    """Which effects a plan tells apart, the smallest sizes it would detect, and poses to add. Needs no data.

        planned = truing.plan(robot, poses=60)
        seen = truing.distinguish(
            robot, planned.joints, columns="dir,payload", separate="backlash,joint_offset"
        )

    robot: nominal. joints: shape=(poses, driven joints) [rad | m], as of `plan`.
    columns: what will be recorded and varied, of "dir" (approached from both sides), "payload", "temp", "t".
    separate: effects to be told apart, "backlash,joint_offset:J2" or a list; a single one from all others.
    Poses are added if needed, at most `add`, each chosen from `proposals`. Empty: the whole catalogue.
    effects: own effects that take part beside the catalogue's; those in `separate` need not be named again.
    payload: [kg] a pose is measured with this or with nothing.
    temperature_low, temperature_high: [deg C] between which the plan warms up and cools down.
    seconds_per_pose: [s]. orientation, position_sigma, rotation_sigma, min_step, min_step_prismatic: as in
    `plan`.
    alike: effects are not told apart if R² between them is larger than this. seed: of directions, payloads
    and proposals.

    Raises InputError: unknown effects, joints or columns.
    """
    asked, own = split_effects(separate)
    options = _core.DistinguishOptions(
        columns=name_list(columns),
        separate=[item.request(robot) if isinstance(item, Effect) else item for item in asked],
        payload=payload,
        temperature_low=temperature_low,
        temperature_high=temperature_high,
        seconds_per_pose=seconds_per_pose,
        orientation=orientation,
        position_sigma=position_sigma,
        rotation_sigma=rotation_sigma,
        alike=alike,
        add=add,
        proposals=proposals,
        min_step=min_step,
        min_step_prismatic=min_step_prismatic,
        seed=seed,
    )
    table = np.asarray(joints, dtype=np.float64)
    if table.ndim != 2:
        raise InputError(f"joints has shape {table.shape}; expected (poses, {robot.driven_count})")
    taking_part = {effect.name: effect for effect in [*own, *own_effects(effects)]}
    return _core.distinguish(robot, table, options, list(taking_part.values()))
