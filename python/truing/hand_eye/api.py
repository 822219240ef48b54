# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye calibration: handeye, and what belongs to it. Each function hands its keywords to the C++ core.

data = truing.load_handeye("poses.csv", board="chessboard:9x6:25mm")
found = truing.handeye(data, setup="eye-to-hand")
print(found.summary())
found.camera.T, found.camera.sigma  # in the robot base
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from truing import _core
from truing._core import (
    ClockOffset,
    HandEyeKinematics,
    HandEyeOptions,
    HandEyePoses,
    HandEyeResult,
    NextHandPose,
    Robot,
)
from truing.effects import split_effects
from truing.errors import InputError, UndecidedError
from truing.files import HandEyeData
from truing.keywords import made, takes
from truing.report.notebook import shown

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import HandEyeKeywords, HandEyePlanKeywords, IdentifyKeywords

Setup = Literal["eye-in-hand", "eye-to-hand"]


@takes(_core.HandEyeOptions)
def handeye(
    poses: HandEyePoses | HandEyeData, *, raise_if_undecided: bool = True, **options: Unpack[HandEyeKeywords]
) -> HandEyeResult:
    """Find the camera's pose from poses of the hand and of a board that the camera sees.

        truing.handeye(data, setup="eye-to-hand", hand_position_sigma=1e-4)

    The closed form (dual quaternions, one SVD) gives a start. Poses that do not fit the others are rejected.
    Then the likelihood is maximised, with the noise of robot and camera. What the motions do not determine is
    refused, with advice.

    poses: `HandEyePoses`, or what `load_handeye` read.
    options: fields of `HandEyeOptions`. `refine_camera`, if it is not given, is True for images without a
    given camera. `reading` is a name of `handeye_readings`.

    Raises InputError on data or options that cannot be used, and UndecidedError (it carries the result) where
    `status` is not "done", unless `raise_if_undecided` is False.
    """
    chosen = handeye_options(poses, **options)
    result = _core.handeye(_poses(poses), chosen)
    if isinstance(poses, HandEyeData):
        shown(result, "truing.hand_eye.result:handeye_page", poses, chosen)
    if raise_if_undecided and result.status != "done":
        raise UndecidedError(result)
    return result


@takes(_core.HandEyeOptions)
def handeye_options(poses: HandEyePoses | HandEyeData, **options: Unpack[HandEyeKeywords]) -> HandEyeOptions:
    """The options of `handeye` by the keywords it takes, for functions that take `HandEyeOptions`."""
    if options.get("working_point") is not None:
        point = np.asarray(options["working_point"], dtype=np.float64)
        if point.shape != (3,):
            raise InputError(
                f"working_point: found shape {point.shape}, expected three numbers [m]: a point in the camera"
                " frame"
            )
    found_from_images = isinstance(poses, HandEyeData) and not poses.camera_given
    return made(HandEyeOptions, {"refine_camera": found_from_images, **options})


@takes(_core.HandEyePlanOptions)
def handeye_plan(
    poses: HandEyePoses | HandEyeData,
    result: HandEyeResult,
    *,
    options: HandEyeOptions | None = None,
    setup: Setup = "eye-in-hand",
    **plan: Unpack[HandEyePlanKeywords],
) -> tuple[NextHandPose, ...]:
    """Robot poses to measure next, each the one that reduces the covariance at the working point most.

        truing.handeye_plan(data, found, setup="eye-to-hand", count=3)

    poses, result: what was measured, and what `handeye` made of it. options: those of `handeye`; None: the
    usual ones with `setup`. plan: fields of `HandEyePlanOptions`.

    Raises InputError.
    """
    if options is None:
        options = handeye_options(poses, setup=setup)
    return _core.handeye_plan(_poses(poses), result, options, made(_core.HandEyePlanOptions, plan))


def handeye_clock(
    hand_time: ArrayLike,
    T_base_hand: ArrayLike,
    camera_time: ArrayLike,
    T_camera_board: ArrayLike,
    *,
    setup: Setup = "eye-in-hand",
    search: float = 10.0,
) -> ClockOffset:
    """The offset between the clocks of robot and camera, from the motion that both saw: t_hand = t_camera +
    offset.

    hand_time, camera_time: shape=(n,), shape=(m,) [s], increasing. T_base_hand: shape=(n, 4, 4);
    T_camera_board: shape=(m, 4, 4).
    search: [s] offsets up to this are tried. The result's `T_base_hand` are hand poses at the times of its
    camera `rows`.

    Raises InputError.
    """
    times = [np.asarray(time, dtype=np.float64) for time in (hand_time, camera_time)]
    return _core.handeye_clock(
        times[0].tolist(), T_base_hand, times[1].tolist(), T_camera_board, setup, search
    )


@takes(_core.IdentifyOptions)
def handeye_with_kinematics(
    robot: Robot,
    joints: ArrayLike,
    poses: HandEyePoses | HandEyeData,
    *,
    options: HandEyeOptions | None = None,
    setup: Setup = "eye-in-hand",
    **fit: Unpack[IdentifyKeywords],
) -> HandEyeKinematics:
    """Find camera, board mount and the robot's own parameters in one problem.

    Solved apart, the errors of the arm's model would go into the camera's pose.

    robot: nominal. joints: shape=(n, driven joints) [rad | m], one row per pose, `HandEyeData.joints`.
    poses: as in `handeye`. options: what `handeye_options` makes; None: the usual ones with `setup`.
    fit: fields of `IdentifyOptions`, as in `identify`; effects of the catalogue only.

    Raises InputError on data or options that cannot be used.
    """
    asked, own = split_effects(fit.get("effects", ()))
    if own:
        raise InputError(
            f"handeye_with_kinematics cannot use own effects ({', '.join(effect.name for effect in own)});"
            " name effects of the catalogue"
        )
    chosen = made(_core.IdentifyOptions, {**fit, "effects": asked})
    if chosen.free:
        chosen.free = [*chosen.free, "base.*", "tool.*"]  # these two are camera and board
    if options is None:
        options = handeye_options(poses, setup=setup)
    return _core.handeye_with_kinematics(robot, joints, _poses(poses), options, chosen)


def _poses(poses: HandEyePoses | HandEyeData) -> HandEyePoses:
    return poses.poses if isinstance(poses, HandEyeData) else poses
