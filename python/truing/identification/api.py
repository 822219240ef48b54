# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Identification: fit a robot's parameters to measurements, and compare it with them."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from truing import _core
from truing._core import Identification, Measurements, Prediction, Residuals, Robot
from truing.effects import Effect, Effects, evaluated, name_list, own_effects, split_effects
from truing.errors import InputWarning, NotConvergedError

_USUAL = _core.IdentifyOptions()  # the defaults stand in identify.hpp and diagnose.hpp alone


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
    priors: Mapping[str, float] | None = None,
    prior_noise: float = _USUAL.prior_noise,
    threads: int = 0,
    raise_if_not_converged: bool = True,
) -> Identification:
    """Find the robot's parameters from measurements.

    Base and targets (anchor, fixed points) are found first. What the data do not determine is frozen at
    nominal and named in the result. Then the fit runs on the training rows.

    robot: nominal. data: measurements, see `Measurements`.
    free: names and globs, "J2.*,*.ratio" or a list. Empty: every geometric value, base and targets.
    hold: names and globs that stay at nominal in any case, "base.*" for a frame that is known.
    effects: fitted as well: "backlash,harmonic:J2+J3", or a list of such words, `EffectRequest` and `Effect`.
    solver: "lm" (Levenberg-Marquardt) or "ceres" (takes bounds).
    loss: "reject" finds gross outliers, lists them and leaves them out; "none", "huber", "cauchy", "tukey".
    frame_by: the measurement frame as six "parameters", or registered after every step ("svd", positions).
    rotation_length: [m] a rotation error of 1 rad counts as this length, where rows give no sigma.
    test_share: fraction of the pose groups that is held out when the data has no `set`. seed: of that split.
    max_iterations, initial_damping, rms_fall [m], gradient, undamped: see `IdentifyOptions`.
    rank_tolerance: a unit column is not observable if the others leave no larger fraction of it unexplained.
    hayati_angle: [rad] neighbouring axes that are closer to parallel get a beta.
    reject_beyond: with loss "reject", rows are rejected whose residual is longer than this many medians.
    bounds: {parameter: (lowest, highest)}, solver "ceres" only.
    priors: {parameter or glob: standard deviation about nominal, as known beforehand}: a drawing's tolerance.
    prior_noise: [m] against priors, see there. threads: 0: as many as the machine has.

    Raises InputError on data or options that cannot be used, and NotConvergedError (it carries the result),
    unless `raise_if_not_converged` is False.
    """
    asked, own = split_effects(effects)
    options = _core.IdentifyOptions(
        free=name_list(free),
        hold=name_list(hold),
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
        priors=priors or {},
        prior_noise=prior_noise,
        threads=threads,
    )
    result = _core.identify(robot, data, options, evaluated(own, robot, data))
    if raise_if_not_converged and not result.solver.converged:
        raise NotConvergedError(result)
    return result


def predict(
    robot: Robot, data: Measurements, *, effects: Effect | Iterable[Effect] = (), threads: int = 0
) -> Prediction:
    """What the robot, with its fitted effects, predicts for the rows of `data`.

    effects: definitions of own effects that the robot carries. Those of the catalogue are known.

    Warns (InputWarning) of rows beyond the ranges that the effects were fitted on, and when an effect needs
    approach directions that the data lack: they are inferred from the order of the rows, as `diagnose` does.
    Raises InputError on unknown effects or columns that they need.
    """
    own = evaluated(own_effects(effects), robot, data)
    data = _with_directions(robot, data, own)
    _warn_of_rows_beyond(robot, data)
    return _core.predict(robot, data, own, threads)


def residuals(
    robot: Robot, data: Measurements, *, effects: Effect | Iterable[Effect] = (), threads: int = 0
) -> Residuals:
    """Predicted minus measured, NaN where not measured.

    Rows of a fixed point are compared with the mean of that point's predictions. Effects, warnings and
    errors are as in `predict`.
    """
    own = evaluated(own_effects(effects), robot, data)
    data = _with_directions(robot, data, own)
    _warn_of_rows_beyond(robot, data)
    return _core.residuals(robot, data, own, threads)


def _with_directions(robot: Robot, data: Measurements, own: Sequence[_core.OwnEffect]) -> Measurements:
    if not _core.lacks_directions(robot, data, own):
        return data
    warnings.warn(
        "no columns dir1 ...: the approach directions that the robot's effects need were inferred from the"
        " order of the rows, as if the poses had been driven to one after the other",
        InputWarning,
        stacklevel=3,
    )
    return data.replace(directions=_core.inferred_directions(data))


def _warn_of_rows_beyond(robot: Robot, data: Measurements) -> None:
    """Beyond the range that they were fitted on, effects may do anything."""
    columns = {f"q{k + 1}": column for k, column in enumerate(np.asarray(data.joints).T)}
    columns |= {"payload": data.payload, "temp": data.temperature}
    beyond = np.zeros(len(data), bool)
    inputs = []
    for name, (low, high) in robot.fitted_range.items():
        column = columns.get(name)
        if column is None:
            continue
        margin = 0.02 * (high - low) + 1e-9
        out = (column < low - margin) | (column > high + margin)
        beyond |= out
        if out.any():
            inputs.append(name)
    if inputs:
        warnings.warn(
            f"{int(beyond.sum())} of {len(data)} rows lie beyond the range that the robot's effects were"
            f" fitted on ({', '.join(inputs)}): nobody has seen what they do there",
            InputWarning,
            stacklevel=3,
        )
