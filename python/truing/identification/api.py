# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Identification: fit a robot's parameters to measurements, and compare it with them."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from truing import _core
from truing._core import Identification, Measurements, Mistake, Prediction, Residuals, Robot
from truing.effects import Effect, evaluated, own_effects, split_effects
from truing.errors import InputWarning, NotConvergedError
from truing.keywords import made, takes
from truing.report.notebook import shown

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import IdentifyKeywords


@takes(_core.IdentifyOptions)
def identify(
    robot: Robot,
    data: Measurements,
    *,
    raise_if_not_converged: bool = True,
    **options: Unpack[IdentifyKeywords],
) -> Identification:
    """Find the robot's parameters from measurements.

        truing.identify(robot, data, effects="backlash,harmonic:J2+J3", hold="base.*", test_share=0.3)

    Base and targets (anchor, fixed points) are found first. What the data do not determine is frozen at
    nominal and named in the result. Then the fit runs on the training rows.

    robot: nominal. data: measurements, see `Measurements`.
    options: fields of `IdentifyOptions`. `free` and `hold` may be one text, "J2.*,*.ratio"; `effects` one
    text, "backlash,harmonic:J2+J3", or a list of such words, `EffectRequest` and `Effect`.

    `review` says whether what was found can be believed: a joint with the wrong sign is fitted as well.

    Raises InputError on data or options that cannot be used, and NotConvergedError (it carries the result),
    unless `raise_if_not_converged` is False.
    """
    chosen = _core_options(robot, data, options)
    result = _core.identify(robot, data, *chosen)
    if not chosen[1]:  # what a definition of one's own predicts, only its owner can say
        shown(result, "truing.identification.result:identification_page", data, chosen[0].seed)
    if raise_if_not_converged and not result.solver.converged:
        raise NotConvergedError(result)
    return result


@takes(_core.IdentifyOptions)
def review(
    robot: Robot, data: Measurements, found: Identification, **options: Unpack[IdentifyKeywords]
) -> Mistake | None:
    """What speaks against the robot file or the columns that `found` was identified from; None: nothing.

        mistake = truing.review(robot, data, truing.identify(robot, data))

    A joint with the wrong sign is fitted as well by turning two links round. So where a link changed by more
    than a workshop makes (10 mm or 2 % of the reach, 3 degrees), or much is left over, the usual mistakes are
    tried: the sign of a joint, the order of joint columns, units of angles and lengths, a left-handed frame,
    the convention of the links; and where rotations are far off, other readings of the orientations. One that
    explains the data is named.

    robot, data, options: those of `identify`. found: what it found.

    Raises InputError on data or options that cannot be used.
    """
    return _core.review(robot, data, found, *_core_options(robot, data, options))


def _core_options(
    robot: Robot, data: Measurements, options: IdentifyKeywords
) -> tuple[_core.IdentifyOptions, list[_core.OwnEffect]]:
    """Options as the core takes them, and effects of one's own."""
    asked, own = split_effects(options.get("effects", ()))
    requests = [item.request(robot) if isinstance(item, Effect) else item for item in asked]
    fit = made(_core.IdentifyOptions, {**options, "effects": requests})
    return fit, evaluated(own, robot, data)


def predict(
    robot: Robot, data: Measurements, *, effects: Effect | Iterable[Effect] = (), threads: int = 0
) -> Prediction:
    """What the robot, with its fitted effects, predicts for the rows of `data`.

    effects: definitions of own effects that the robot carries. Those of the catalogue are known.

    Warns (InputWarning) of rows beyond the ranges that the effects were fitted on, and when an effect needs
    approach directions that the data lack: they are inferred from the order of the rows, as `diagnose` does,
    and so are joint speeds of a robot that moved while it was measured.
    Raises InputError on unknown effects or columns that they need.
    """
    own = evaluated(own_effects(effects), robot, data)
    data = _with_inferred(robot, data, own)
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
    data = _with_inferred(robot, data, own)
    _warn_of_rows_beyond(robot, data)
    return _core.residuals(robot, data, own, threads)


def _with_inferred(robot: Robot, data: Measurements, own: Sequence[_core.OwnEffect]) -> Measurements:
    """The data with what the robot's effects need and rows that follow each other show."""
    if _core.lacks_directions(robot, data, own):
        _warn_of_inferred(
            "dir1 ...: the approach directions that the robot's effects need were inferred from the order of"
            " the rows, as if the poses had been driven to one after the other"
        )
        data = data.replace(directions=_core.inferred_directions(data))
    if _core.lacks_speeds(robot, data, own):
        _warn_of_inferred(
            "qd1 ...: the joint speeds that the robot's effects need were inferred from joints and times"
        )
        data = data.replace(joint_speeds=_core.inferred_speeds(data))
    return data


def _warn_of_inferred(columns: str) -> None:
    warnings.warn(f"no columns {columns}", InputWarning, stacklevel=4)


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
