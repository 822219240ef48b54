# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye calibration: handeye, and what belongs to it. Each function hands its keywords to the C++ core.

data = truing.load_handeye("poses.csv", board="chessboard:9x6:25mm")
found = truing.handeye(data, setup="eye-to-hand")
print(found.summary())
found.camera.T, found.camera.sigma  # in the robot base
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

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
from truing.effects import Effect, Effects, name_list, split_effects
from truing.errors import InputError, UndecidedError
from truing.files import HandEyeData

Setup = Literal["eye-in-hand", "eye-to-hand"]
Method = Literal["refined", "closed-form"]

_USUAL = _core.HandEyeOptions()  # the defaults stand in handeye.hpp alone
_USUAL_FIT = _core.IdentifyOptions()


def handeye(
    poses: HandEyePoses | HandEyeData,
    *,
    setup: Setup = "eye-in-hand",
    method: Method = "refined",
    hand_m: float | None = None,
    hand_rad: float | None = None,
    camera_m: float | None = None,
    camera_rad: float | None = None,
    pixel: float | None = None,
    refine_camera: bool | None = None,
    working_point: ArrayLike | None = None,
    known_height: float | None = None,
    known_height_sigma: float = _USUAL.known_height_sigma,
    reject: bool = _USUAL.reject,
    reject_beyond: float = _USUAL.reject_beyond,
    recognise: bool = _USUAL.recognise,
    reading: str = _USUAL.reading,
    max_iterations: int = _USUAL.max_iterations,
    raise_if_undecided: bool = True,
) -> HandEyeResult:
    """Find the camera's pose from poses of the hand and of a board that the camera sees.

    The closed form (dual quaternions, one SVD) gives a start. Poses that do not fit the others are rejected.
    Then the likelihood is maximised, with the noise of robot and camera. What the motions do not determine is
    refused, with advice.

    poses: `HandEyePoses`, or what `load_handeye` read.
    setup: "eye-in-hand" (camera on the hand, board in the cell) or "eye-to-hand" (camera in the cell, board
    on the hand).
    method: "refined", or "closed-form" for the SVD alone.
    hand_m, hand_rad: [m], [rad] standard deviation of one component of the robot's reported poses. None:
    estimated from the data.
    camera_m, camera_rad: [m], [rad] of the board's poses, without images. pixel: [px] with images. None:
    estimated from the data.
    refine_camera: with images, estimate focal lengths, centre and distortion as well. None: unless a camera
    was given.
    working_point: shape=(3,) [m] in the camera frame, where accuracy matters. None: the mean of the board's
    positions.
    known_height: [m] where all rotation axes are parallel: the camera's coordinate along that axis, in the
    frame that carries the camera;
    known_height_sigma: [m].
    reject: leave out poses whose standardised residual (rms of six components) exceeds reject_beyond.
    recognise: where the loop does not close, try other readings of the numbers (inverted, scalar last, mm …)
    and name the one that closes it.
    reading: use the poses in such a reading, a name of `handeye_readings`.

    Raises InputError on data or options that cannot be used, and UndecidedError (it carries the result) where
    `status` is not "done", unless `raise_if_undecided` is False.
    """
    options = handeye_options(
        poses,
        setup=setup,
        method=method,
        hand_m=hand_m,
        hand_rad=hand_rad,
        camera_m=camera_m,
        camera_rad=camera_rad,
        pixel=pixel,
        refine_camera=refine_camera,
        working_point=working_point,
        known_height=known_height,
        known_height_sigma=known_height_sigma,
        reject=reject,
        reject_beyond=reject_beyond,
        recognise=recognise,
        reading=reading,
        max_iterations=max_iterations,
    )
    result = _core.handeye(_poses(poses), options)
    if raise_if_undecided and result.status != "done":
        raise UndecidedError(result)
    return result


def handeye_options(
    poses: HandEyePoses | HandEyeData,
    *,
    setup: Setup = "eye-in-hand",
    method: Method = "refined",
    hand_m: float | None = None,
    hand_rad: float | None = None,
    camera_m: float | None = None,
    camera_rad: float | None = None,
    pixel: float | None = None,
    refine_camera: bool | None = None,
    working_point: ArrayLike | None = None,
    known_height: float | None = None,
    known_height_sigma: float = _USUAL.known_height_sigma,
    reject: bool = _USUAL.reject,
    reject_beyond: float = _USUAL.reject_beyond,
    recognise: bool = _USUAL.recognise,
    reading: str = _USUAL.reading,
    max_iterations: int = _USUAL.max_iterations,
) -> HandEyeOptions:
    """The options of `handeye` by the keywords it takes, for functions that take `HandEyeOptions`."""
    point = None if working_point is None else np.asarray(working_point, dtype=np.float64)
    if point is not None and point.shape != (3,):
        raise InputError(
            f"working_point: found shape {point.shape}, expected three numbers [m]: a point in the camera"
            " frame"
        )
    if refine_camera is None:
        refine_camera = isinstance(poses, HandEyeData) and not poses.camera_given
    return HandEyeOptions(
        setup=setup,
        method=method,
        hand_position_sigma=hand_m,
        hand_rotation_sigma=hand_rad,
        camera_position_sigma=camera_m,
        camera_rotation_sigma=camera_rad,
        pixel_sigma=pixel,
        refine_camera=refine_camera,
        working_point=point,
        known_height=known_height,
        known_height_sigma=known_height_sigma,
        reject=reject,
        reject_beyond=reject_beyond,
        recognise=recognise,
        reading=reading,
        max_iterations=max_iterations,
    )


def handeye_plan(
    poses: HandEyePoses | HandEyeData,
    result: HandEyeResult,
    *,
    count: int = 5,
    options: HandEyeOptions | None = None,
    setup: Setup = "eye-in-hand",
    candidates: int | None = None,
    tilt: float | None = None,
    reach: float | None = None,
    seed: int = 0,
) -> tuple[NextHandPose, ...]:
    """Robot poses to measure next, each the one that reduces the covariance at the working point most.

    poses, result: what was measured, and what `handeye` made of it. options: those of `handeye`; None: the
    usual ones with `setup`.
    count: how many. candidates: tried for each. seed: of them.
    tilt: [rad] the board is seen at no more than this from its normal, beyond what was seen. reach: [m] hands
    stay this close to a measured one.
    None: the usual ones, see `HandEyePlanOptions` in handeye.hpp.

    Raises InputError.
    """
    if options is None:
        options = handeye_options(poses, setup=setup)
    usual = {"candidates": candidates, "tilt": tilt, "reach": reach}
    return _core.handeye_plan(
        _poses(poses),
        result,
        options,
        count=count,
        seed=seed,
        **{name: value for name, value in usual.items() if value is not None},
    )


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


def handeye_with_kinematics(
    robot: Robot,
    joints: ArrayLike,
    poses: HandEyePoses | HandEyeData,
    *,
    options: HandEyeOptions | None = None,
    setup: Setup = "eye-in-hand",
    free: str | Sequence[str] = (),
    hold: str | Sequence[str] = (),
    effects: Effects = (),
    loss: Literal["reject", "none", "huber", "cauchy", "tukey"] = "reject",
    test_share: float = _USUAL_FIT.test_share,
    seed: int = _USUAL_FIT.seed,
    threads: int = 0,
) -> HandEyeKinematics:
    """Find camera, board mount and the robot's own parameters in one problem.

    Solved apart, the errors of the arm's model would go into the camera's pose.

    robot: nominal. joints: shape=(n, driven joints) [rad | m], one row per pose, `HandEyeData.joints`.
    poses, options, setup: as in `handeye`. free, hold, effects, loss, test_share, seed, threads: as in
    `identify`; effects of the catalogue only.

    Raises InputError on data or options that cannot be used.
    """
    if options is None:
        options = handeye_options(poses, setup=setup)
    asked, own = split_effects(effects)
    if own:
        raise InputError(
            f"handeye_with_kinematics cannot use own effects ({', '.join(effect.name for effect in own)});"
            " name effects of the catalogue"
        )
    fit = _core.IdentifyOptions(
        free=[*name_list(free), "base.*", "tool.*"] if free else [],  # these two are camera and board
        hold=name_list(hold),
        effects=[item for item in asked if not isinstance(item, Effect)],
        loss=loss,
        test_share=test_share,
        seed=seed,
        threads=threads,
    )
    return _core.handeye_with_kinematics(robot, joints, _poses(poses), options, fit)


def _poses(poses: HandEyePoses | HandEyeData) -> HandEyePoses:
    return poses.poses if isinstance(poses, HandEyeData) else poses
