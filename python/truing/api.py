# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The six verbs: identify, diagnose, predict, residuals, plan, distinguish. Each hands its keywords to the
C++ core.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from truing import _core
from truing._core import (
    Diagnosis,
    Distinction,
    Identification,
    Measurements,
    PlanResult,
    Prediction,
    Residuals,
    Robot,
)
from truing.effects import Effect, Effects, evaluated, split_effects
from truing.errors import InputError, NotConvergedError

_USUAL = _core.IdentifyOptions()  # the defaults stand in identify.hpp and diagnose.hpp alone
_USUAL_DIAGNOSIS = _core.DiagnoseOptions()
_USUAL_DISTINCTION = _core.DistinguishOptions()  # in plan.hpp


def identify(
    robot: Robot,
    data: Measurements,
    *,
    free: str | Sequence[str] = (),
    hold: str | Sequence[str] = (),
    effects: Effects = (),
    solver: Literal["lm", "ceres"] = "lm",
    loss: Literal["reject", "none", "huber", "cauchy", "tukey"] = "reject",
    frame_by: Literal["parameters", "svd"] = "parameters",
    rotation_length: float = _USUAL.rotation_length,
    test_share: float = _USUAL.test_share,
    seed: int = _USUAL.seed,
    max_iterations: int = _USUAL.max_iterations,
    initial_damping: float = _USUAL.initial_damping,
    rms_fall: float = _USUAL.rms_fall,
    gradient: float = _USUAL.gradient,
    undamped: bool = _USUAL.undamped,
    rank_tolerance: float = _USUAL.rank_tolerance,
    hayati_angle: float = _USUAL.hayati_angle,
    reject_beyond: float = _USUAL.reject_beyond,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    threads: int = 0,
    raise_if_not_converged: bool = True,
) -> Identification:
    """Find the robot's parameters from measurements.

    Base, targets (anchor, fixed points) are found first; what the data cannot see is frozen at nominal and
    named in the
    result; then the fit runs on the training rows.

    robot: nominal. data: measurements, see `Measurements`.
    free: names and globs, "J2.*,*.ratio" or a list; empty: every geometric value, base and targets.
    hold: names and globs that stay at nominal whatever else is asked for, "base.*" for a frame that is known.
    effects: effects to fit as well: "backlash,harmonic:J2+J3", or a list of such words, `EffectRequest` and
    `Effect`.
    solver: "lm" (Levenberg-Marquardt) or "ceres" (takes bounds).
    loss: "reject" finds gross outliers, lists them and fits without; or "none", "huber", "cauchy", "tukey".
    frame_by: the measurement frame as six "parameters", or registered after every step ("svd"; positions
    only).
    rotation_length: [m] a rotation error of 1 rad counts as this length, where rows give no sigma.
    test_share: of the pose groups, held out when the data has no `set`. seed: of that split.
    max_iterations, initial_damping, rms_fall [m], gradient, undamped: of the iteration, see
    `IdentifyOptions`.
    rank_tolerance: a unit column that the others explain but for this share is not observable.
    hayati_angle: [rad] neighbouring axes nearer to parallel get beta.
    reject_beyond: loss "reject": rows whose residual is longer than this many medians.
    bounds: {parameter: (lowest, highest)}, solver "ceres" only. threads: 0: as many as the machine has.

    Raises InputError on data or options that cannot be used, and NotConvergedError (it carries the result),
    unless
    `raise_if_not_converged` is False.
    """
    asked, own = split_effects(effects)
    options = _core.IdentifyOptions(
        free=_names(free),
        hold=_names(hold),
        effects=[item.request(robot) if isinstance(item, Effect) else item for item in asked],
        solver=solver,
        loss=loss,
        frame_by=frame_by,
        rotation_length=rotation_length,
        test_share=test_share,
        seed=seed,
        max_iterations=max_iterations,
        initial_damping=initial_damping,
        rms_fall=rms_fall,
        gradient=gradient,
        undamped=undamped,
        rank_tolerance=rank_tolerance,
        hayati_angle=hayati_angle,
        reject_beyond=reject_beyond,
        bounds=bounds or {},
        threads=threads,
    )
    result = _core.identify(robot, data, options, evaluated(own, robot, data))
    if raise_if_not_converged and not result.solver.converged:
        raise NotConvergedError(result)
    return result


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
        leave_out=_names(leave_out),
        false_alarm=false_alarm,
        max_effects=max_effects,
        test_share=test_share,
        search_poses=search_poses,
        resamples=resamples,
        rotation_length=rotation_length,
        seed=seed,
        threads=threads,
    )
    return _core.diagnose(robot, data, options, evaluated(_own(effects), robot, data))


def predict(
    robot: Robot, data: Measurements, *, effects: Effect | Iterable[Effect] = (), threads: int = 0
) -> Prediction:
    """What the robot, with its fitted effects, predicts for the rows of `data`.

    effects: definitions of one's own effects that the robot carries; those of the catalogue are known.
    Raises InputError on unknown effects or columns that they need.
    """
    return _core.predict(robot, data, evaluated(_own(effects), robot, data), threads)


def residuals(
    robot: Robot, data: Measurements, *, effects: Effect | Iterable[Effect] = (), threads: int = 0
) -> Residuals:
    """Predicted minus measured, NaN where not measured.

    Rows of a fixed point are compared with the mean of that point's predictions. effects: as in `predict`.
    Raises InputError on unknown effects or columns that they need.
    """
    return _core.residuals(robot, data, evaluated(_own(effects), robot, data), threads)


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

    poses: how many. min_step: [rad], min_step_prismatic: [m]: joints move by more between neighbours.
    index: what the plan makes large, see `PlanOptions`. orientation: full poses are measured, not only
    positions.
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
        free=_names(free),
        effects=[item for item in asked if not isinstance(item, Effect)],
    )
    return _core.plan(robot, options)


def distinguish(
    robot: Robot,
    joints: ArrayLike,
    *,
    columns: str | Sequence[str] = (),
    separate: Effects = (),
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
    """Before any data: which effects a plan can tell apart, how small it would still see them, and the poses
    to add.

        planned = truing.plan(robot, poses=60)
        seen = truing.distinguish(robot, planned.joints, columns="dir,payload",
        separate="backlash,joint_offset")

    robot: nominal. joints: shape=(poses, driven joints) [rad | m], as of `plan`.
    columns: what will be recorded and varied, of "dir" (approached from both sides), "payload", "temp", "t".
    separate: effects to be told apart, "backlash,joint_offset:J2" or a list; a single one from everything
    else. Poses are added if it takes
    any, `add` at most, each chosen from `proposals`. Empty: the whole catalogue is looked at.
    payload: [kg] a pose is measured with this or with nothing. temperature_low, temperature_high: [deg C] the
    plan warms up, and cools down.
    seconds_per_pose: [s]. orientation, position_sigma, rotation_sigma, min_step, min_step_prismatic: as in
    `plan`.
    alike: an effect of which another explains a larger share is not told from it. seed: of directions,
    payloads and proposals.

    Raises InputError: unknown effects, joints or columns.
    """
    asked, own = split_effects(separate)
    if own:
        raise InputError(
            f"distinguish cannot use own effects ({', '.join(effect.name for effect in own)}): their basis is"
            " known only for rows that were recorded; name effects of the catalogue"
        )
    options = _core.DistinguishOptions(
        columns=_names(columns),
        separate=[item for item in asked if not isinstance(item, Effect)],
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
    return _core.distinguish(robot, table, options)


def _names(names: str | Sequence[str]) -> list[str]:
    if isinstance(names, str):
        return [name.strip() for name in names.split(",") if name.strip()]
    return list(names)


def _own(effects: Effect | Iterable[Effect]) -> list[Effect]:
    own = [effects] if isinstance(effects, Effect) else list(effects)
    for effect in own:
        if not isinstance(effect, Effect):
            raise InputError(
                f"effects holds {effect!r}: only definitions of own effects are needed here; effects of the"
                " catalogue are known"
            )
    return own
