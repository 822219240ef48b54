# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing handeye`` found, as it is written: ``result.json``, ``residuals.csv``, ``camera.yaml``,
``next_poses.csv``, ``robot.yaml``, the report.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.files import HandEyeAnswer, HandEyeData, save_camera, write_table
from truing.files.common import MOTIONS, frame_dict
from truing.hand_eye.comparison import comparison
from truing.hand_eye.page import Scene, handeye_report
from truing.identification.result import write_robot
from truing.report.json_text import to_json, without_nan

HANDEYE_FORMAT = "truing-handeye/1"
AXES = ("x", "y", "z")
INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
OTHER_SETUP = "other-setup"
CHI3_95 = 2.7955  # [-] 95 % of the lengths of a vector of three unit normals are below
_PIXELS_DRAWN = 4000

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Solved:
    """Everything that one run came to."""

    data: HandEyeData
    options: _core.HandEyeOptions
    result: _core.HandEyeResult
    next_poses: tuple[_core.NextHandPose, ...] = ()
    clock: _core.ClockOffset | None = None
    kinematics: _core.HandEyeKinematics | None = None
    seed: int = 0
    answers: tuple[HandEyeAnswer, ...] = ()


# ---- result.json ---------------------------------------------------------------------------------


def _uncertain(
    frame: _core.UncertainFrame, parent: str, degrees_of_freedom: Floats | None = None
) -> dict[str, Any]:
    """degrees_of_freedom: shape=(6,) of Student's t; infinite: null. None: not known, not told."""
    found = {
        "in": parent,
        **frame_dict(frame.T),
        "sigma": dict(zip(MOTIONS, map(float, frame.sigma), strict=True)),
    }
    if degrees_of_freedom is not None:
        numbers = [float(value) if math.isfinite(value) else None for value in degrees_of_freedom]
        found["degrees_of_freedom"] = dict(zip(MOTIONS, numbers, strict=True))
    return found


def _errors(e: _core.HandEyeErrors | None) -> dict[str, Any] | None:
    if e is None:
        return None
    found: dict[str, Any] = {
        "rms_m": e.position_rms,
        "mean_m": e.position_mean,
        "p95_m": e.position_p95,
        "max_m": e.position_max,
        "rotation_rms_rad": e.rotation_rms,
    }
    if math.isfinite(e.pixel_rms):
        found["rms_px"] = e.pixel_rms
    return {**found, "n": e.n}


def camera_model_dict(camera: _core.Camera, sigma: Sequence[float] = ()) -> dict[str, Any]:
    """A camera's values as camera.yaml has them, with their standard errors where known."""
    found: dict[str, Any] = {
        "width": camera.width,
        "height": camera.height,
        **{name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")},
        "distortion": {"model": "plumb_bob", "coefficients": list(camera.distortion)},
    }
    if len(sigma):
        found["sigma"] = dict(zip(INTRINSICS, map(float, sigma), strict=False))
    return found


def handeye_dict(solved: Solved, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing handeye`` holds. Without status "done" there is no camera in it."""
    data, options, r, k = solved.data, solved.options, solved.result, solved.kinematics
    residuals = list(r.residuals if k is None else k.residuals)
    found: dict[str, Any] = {
        "format": HANDEYE_FORMAT,
        "version": _core.version(),
        "setup": options.setup,
        "method": options.method,
        "status": r.status,
        "message": r.message,
        "poses": data.count,
    }
    if r.status == "done":
        found |= _frames(solved)
        if solved.answers:
            found["compared"] = _compared(solved)
    found["residuals"] = [_residual(solved, row, residual) for row, residual in enumerate(residuals)]
    found["rejected_poses"] = [
        {"pose": int(data.rows[row]), **_image(data, row), "cause": residual.cause}
        for row, residual in enumerate(residuals)
        if residual.rejected
    ]
    found["observability"] = _observability(r)
    found["convention"] = _convention(solved)
    if residuals or k is not None:
        found |= _noise_and_errors(solved)
    if r.status == "done" and k is None:
        found["board_scale"] = {"value": r.board_scale, "sigma": r.board_scale_sigma}
    if r.symmetry and any(r.symmetry):
        turned = [int(data.rows[row]) for row, turn in enumerate(r.symmetry) if turn]
        found["board_turned"] = {"poses": turned}
    if data.views is not None:
        found["images"] = _images(solved)
    found["next_poses"] = [
        {**frame_dict(p.T_base_hand), "working_point_sigma_m": p.working_point_sigma}
        for p in solved.next_poses
    ]
    if solved.clock is not None:
        found["clock"] = _clock(solved.clock)
    if k is not None:
        found["kinematics"] = _kinematics(k)
    if r.solver.name:
        found["solver"] = {
            "name": r.solver.name,
            "iterations": r.solver.iterations,
            "converged": r.solver.converged,
            "stopped_because": r.solver.stopped_because,
        }
    found["seed"] = solved.seed
    found["warnings"] = [*warnings, *(r.warnings if k is None else k.identification.warnings)]
    return found


def _frames(solved: Solved) -> dict[str, Any]:
    """Camera and board with their covariances, and the error at the working point."""
    both: _core.HandEyeResult | _core.HandEyeKinematics = (
        solved.result if solved.kinematics is None else solved.kinematics
    )
    camera_in, board_in = ("hand", "base") if solved.options.setup == "eye-in-hand" else ("base", "hand")
    alone = solved.kinematics is None
    return {
        "camera": _uncertain(
            both.camera, camera_in, solved.result.camera_degrees_of_freedom if alone else None
        ),
        "board": _uncertain(both.board, board_in, solved.result.board_degrees_of_freedom if alone else None),
        "covariance": {
            "of": list(MOTIONS),
            "camera": both.camera.covariance,
            "board": both.board.covariance,
        },
        "working_point": _working_point(solved),
    }


def _compared(solved: Solved) -> list[dict[str, Any]]:
    """Over held-out poses where there are some, else over those that were kept."""
    r, k, data = solved.result, solved.kinematics, solved.data
    A, B, as_given = poses_used(solved)
    residuals = r.residuals if k is None else k.residuals
    held_out = np.zeros(data.count, bool) if data.poses.set is None else np.asarray(data.poses.set) == 1
    kept = np.array([not residual.rejected for residual in residuals])
    rows = held_out if held_out.any() else kept
    camera = (r if k is None else k).camera
    return comparison(camera, A, B if as_given else None, rows, solved.options.setup, solved.answers)


def _observability(r: _core.HandEyeResult) -> dict[str, Any]:
    return {
        "singular_values": r.singular_values,
        "gap": r.singular_gap,
        "axes_spread": r.axes_spread,
        "unobservable": [
            {
                "what": u.what,
                "direction": u.direction,
                "rotation": u.rotation,
                "sigma": u.sigma,
                "advice": u.advice,
            }
            for u in r.unobservable
        ],
    }


def _noise_and_errors(solved: Solved) -> dict[str, Any]:
    r, k = solved.result, solved.kinematics
    if k is not None:  # what belongs to the robot as it was is left out
        noise: dict[str, Any] = {
            "position_m": k.identification.noise_sigma,
            "hand_rad": k.identification.rotation_noise_sigma,
            "camera_rad": None,
            "pixel": None,
            "estimated": True,
        }
        return {"noise": noise, "errors": _known({"train": k.train_after, "test": k.test_after})}
    noise = {
        "position_m": r.noise.position,
        "hand_rad": r.noise.hand_rotation,
        "camera_rad": r.noise.camera_rotation,
        "pixel": r.noise.pixel,
        "estimated": r.noise.estimated or not _noise_is_given(solved.options),
    }
    return {"noise": noise, "errors": _known({"train": r.train, "left_out": r.left_out, "test": r.test})}


def _clock(c: _core.ClockOffset) -> dict[str, Any]:
    return {
        "offset_s": c.offset,
        "sigma_s": c.sigma,
        "correlation": c.correlation,
        "found": c.found,
        "message": c.message,
        "rows": len(c.rows),
    }


def _known(errors: Mapping[str, _core.HandEyeErrors | None]) -> dict[str, Any]:
    return {name: _errors(e) for name, e in errors.items() if e is not None}


def _noise_is_given(options: _core.HandEyeOptions) -> bool:
    given = (
        options.hand_position_sigma,
        options.hand_rotation_sigma,
        options.camera_position_sigma,
        options.camera_rotation_sigma,
        options.pixel_sigma,
    )
    return any(sigma is not None for sigma in given)


def _working_point(solved: Solved) -> dict[str, Any]:
    told: _core.HandEyeResult | _core.HandEyeKinematics = (
        solved.result if solved.kinematics is None else solved.kinematics
    )
    point, covariance, camera = (
        np.asarray(told.working_point),
        np.asarray(told.working_point_covariance),
        told.camera,
    )
    values, axes = np.linalg.eigh(covariance)
    values, axes = np.sqrt(np.maximum(values[::-1], 0)), axes[:, ::-1]
    return {
        "in_camera_m": point,
        "sigma_m": _per_axis(covariance),
        "rotation_sigma_rad": _per_axis(np.asarray(camera.covariance)[3:, 3:]),
        "covariance_m2": covariance,
        "principal": [{"sigma_m": float(values[k]), "axis": axes[:, k]} for k in range(3)],
    }


def _per_axis(covariance: Floats) -> float:
    """Standard error of one axis, rms over the three."""
    return math.sqrt(max(0.0, float(np.trace(covariance))) / 3.0)


def _image(data: HandEyeData, k: int) -> dict[str, str]:
    return {"image": data.images[k]} if data.images else {}


def _residual(solved: Solved, k: int, r: _core.HandEyeResidual) -> dict[str, Any]:
    data = solved.data
    test = data.poses.set is not None and data.poses.set[k] == 1
    alone = solved.kinematics is None  # with the robot found as well nothing was left out
    found: dict[str, Any] = {
        "pose": int(data.rows[k]),
        **_image(data, k),
        "set": "test" if test else "train",
        "position_m": r.position,
        "rotation_rad": r.rotation,
        "position_left_out_m": r.position_left_out if alone else None,
        "rotation_left_out_rad": r.rotation_left_out if alone else None,
    }
    if data.images:
        found |= {"pixels": r.pixels, "pixels_corrected": r.pixels_corrected}
    return {**found, "distance": r.distance if alone else None, "rejected": r.rejected, "cause": r.cause}


def _convention(solved: Solved) -> dict[str, Any]:
    used = solved.options.reading
    explanation = (
        next((reading.explanation for reading in _core.handeye_readings() if reading.name == used), "")
        if used
        else "as the file says"
    )
    return {
        "reading": used,
        "explanation": explanation,
        "orientation": solved.data.convention,
        "other_readings": [
            {
                "reading": o.name,
                "option": _option(o.name, solved.options.setup),
                "explanation": o.explanation,
                "rms_m": o.position_rms,
                "rotation_rms_rad": o.rotation_rms,
            }
            for o in solved.result.readings
        ],
    }


def _option(reading: str, setup: str) -> str:
    """What is to be given on the command line: the set-up is an option of its own."""
    parts = reading.split("+")
    read = "+".join(part for part in parts if part != OTHER_SETUP)
    options = [f"--reading {read}"] if read else []
    if OTHER_SETUP in parts:
        options.insert(0, f"--setup {'eye-to-hand' if setup == 'eye-in-hand' else 'eye-in-hand'}")
    return " ".join(options)


def _images(solved: Solved) -> dict[str, Any]:
    data, r = solved.data, solved.result
    assert data.views is not None
    found: dict[str, Any] = {
        "board": str(data.views.board),
        "found": len(data.views.found),
        "not_found": [text.removeprefix("the board was not found in ") for text in data.unused],
        "camera_given": data.camera_given,
        "rms_px": data.views.rms,
        "camera": camera_model_dict(*_camera_model(solved)),
    }
    if math.isfinite(data.views.calibration_rms):
        found["calibration_rms_px"] = data.views.calibration_rms
    if r.camera_model is not None:
        found["camera_refined"] = True
    return found


def _camera_model(solved: Solved) -> tuple[_core.Camera, Sequence[float]]:
    r, views = solved.result, solved.data.views
    assert views is not None
    return (r.camera_model, r.camera_model_sigma) if r.camera_model is not None else (views.camera, ())


def _kinematics(k: _core.HandEyeKinematics) -> dict[str, Any]:
    i = k.identification
    errors = {"train": {"before": _errors(k.train_before), "after": _errors(k.train_after)}}
    if k.test_before is not None and k.test_after is not None:
        errors["test"] = {"before": _errors(k.test_before), "after": _errors(k.test_after)}
    return {
        "robot": k.robot.name,
        "errors": errors,
        "parameters": [
            {
                "name": p.name,
                "nominal": p.nominal,
                "value": p.value,
                "sigma": p.sigma,
                "unit": p.unit,
                "frozen": p.frozen,
            }
            for p in i.parameters
        ],
        "frozen": [
            {"parameter": f.parameter, "combination": dict(f.combination), "why": f.why} for f in i.frozen
        ],
        "rejected_poses": list(i.rejected_rows),
        "rank": i.rank,
        "columns": i.columns,
        "converged": i.solver.converged,
        "warnings": list(i.warnings),
    }


# ---- What is drawn -------------------------------------------------------------------------------


def poses_used(solved: Solved) -> tuple[Floats, Floats, bool]:
    """T_base_hand and T_camera_board, shape=(n, 4, 4), as they were fitted; False: a reading made something
    else of the board's poses, which only the core knows.
    """
    data, r, both = solved.data, solved.result, solved.kinematics
    A = np.asarray(r.T_base_hand if len(r.T_base_hand) == data.count else data.poses.T_base_hand)
    if both is not None and data.joints is not None:
        A = np.array([_core.forward_kinematics(both.robot, q)[-1] for q in data.joints])
    B = np.array(data.poses.T_camera_board)
    for k, turn in enumerate(r.symmetry):
        if turn:
            B[k] = B[k] @ np.asarray(data.poses.board_symmetries[turn - 1])
    return A, B, not any(part.startswith("board") for part in solved.options.reading.split("+"))


def scene_of(solved: Solved) -> Scene | None:
    """Where everything is, for the report; None where no camera was found."""
    data, r, both = solved.data, solved.result, solved.kinematics
    if r.status != "done":
        return None
    A, B, as_given = poses_used(solved)
    X, Y = (
        np.asarray(frame.T) for frame in ((r.camera, r.board) if both is None else (both.camera, both.board))
    )
    ones = np.ones((data.count, 1, 1))
    eye_in_hand = solved.options.setup == "eye-in-hand"
    camera, predicted = (A @ X, ones * Y) if eye_in_hand else (ones * X, A @ Y)
    seen = camera @ B if as_given else np.full_like(A, np.nan)
    n = r.noise
    lever = np.linalg.norm((np.linalg.inv(A) @ predicted)[:, :3, 3], axis=1)
    # Two of a position's three components turn with the hand's noise; as if all three had their mean.
    spread_m, spread_rad = (
        np.sqrt(n.position**2 + (2.0 / 3.0) * (n.hand_rotation * lever) ** 2),
        np.full(data.count, n.hand_rotation),
    )
    if math.isfinite(n.camera_rotation):
        spread_rad = np.hypot(spread_rad, n.camera_rotation)
    if data.poses.images is not None and data.poses.camera is not None and math.isfinite(n.pixel):
        pixel_m, pixel_rad = _by_pixels(data.poses.images, B, data.poses.camera, n.pixel)
        spread_m, spread_rad = np.hypot(spread_m, pixel_m), np.hypot(spread_rad, pixel_rad)
    if both is not None:
        spread_m, spread_rad = (
            np.full(data.count, both.identification.noise_sigma),
            np.full(data.count, both.identification.rotation_noise_sigma),
        )
    board = _board_extent(data)
    errors, places = _pixel_errors(solved, A, X, Y)
    return Scene(A, camera, seen, predicted, CHI3_95 * spread_m, CHI3_95 * spread_rad, board, errors, places)


def _by_pixels(
    images: Sequence[tuple[Floats, Floats]], T_camera_board: Floats, camera: _core.Camera, pixel: float
) -> tuple[Floats, Floats]:
    """Rms standard error of a component of the board's position [m] and rotation [rad] that pixels of this
    noise give, one per image.
    """
    position, rotation = np.full(len(images), np.nan), np.full(len(images), np.nan)
    for k, (points, _) in enumerate(images):
        T = T_camera_board[k]
        arm = np.asarray(points) @ T[:3, :3].T
        x, y, z = (arm + T[:3, 3]).T
        zero = np.zeros_like(x)
        by_point = np.stack(
            [
                np.stack([camera.fx / z, zero, -camera.fx * x / z**2], axis=1),
                np.stack([zero, camera.fy / z, -camera.fy * y / z**2], axis=1),
            ],
            axis=1,
        )
        a, b, c = arm.T
        by_turn = by_point @ np.moveaxis(np.array([[zero, c, -b], [-c, zero, a], [b, -a, zero]]), 2, 0)
        J = np.concatenate([by_point, by_turn], axis=2).reshape(-1, 6)
        variance = np.diag(np.linalg.pinv(J.T @ J)) * pixel**2
        position[k], rotation[k] = math.sqrt(variance[:3].mean()), math.sqrt(variance[3:].mean())
    return position, rotation


def _board_extent(data: HandEyeData) -> tuple[float, float, float, float]:
    if data.board is not None:
        points = data.board.points
        low, high = points.min(axis=0), points.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])
    size = 0.12 * float(np.median(np.linalg.norm(np.asarray(data.poses.T_camera_board)[:, :3, 3], axis=1)))
    return -size, -size, size, size


def _pixel_errors(solved: Solved, A: Floats, X: Floats, Y: Floats) -> tuple[Floats, Floats]:
    """Seen minus predicted pixels of fitted poses, with robot poses as found; and where the pixels are."""
    data, r = solved.data, solved.result
    images, given = data.poses.images, data.poses.camera
    if images is None or given is None:
        return np.empty((0, 2)), np.empty((0, 2))
    camera = r.camera_model if r.camera_model is not None else given
    errors, places = [], []
    for k, (points, pixels) in enumerate(images):
        if r.residuals[k].rejected or (data.poses.set is not None and data.poses.set[k] == 1):
            continue
        moving = np.linalg.inv(A[k]) if solved.options.setup == "eye-in-hand" else A[k]
        T = np.linalg.inv(X) @ moving @ Y
        if r.symmetry and r.symmetry[k]:
            T = T @ np.linalg.inv(np.asarray(data.poses.board_symmetries[r.symmetry[k] - 1]))
        in_camera = np.asarray(points) @ T[:3, :3].T + T[:3, 3]
        if (in_camera[:, 2] > 0).all():
            errors.append(np.asarray(pixels) - _core.project(camera, in_camera))
            places.append(np.asarray(pixels))
    if not errors:
        return np.empty((0, 2)), np.empty((0, 2))
    every, where = np.concatenate(errors), np.concatenate(places)
    step = max(1, math.ceil(len(every) / _PIXELS_DRAWN))
    return every[::step], where[::step]


# ---- Files ---------------------------------------------------------------------------------------


def residual_columns(solved: Solved) -> dict[str, Any]:
    """Columns of ``residuals.csv``: every pose that was used, in the order of the file."""
    data = solved.data
    residuals = solved.result.residuals if solved.kinematics is None else solved.kinematics.residuals
    test = np.zeros(data.count, dtype=bool) if data.poses.set is None else np.asarray(data.poses.set) == 1
    columns: dict[str, Any] = {"pose": np.asarray(data.rows), "set": np.where(test, "test", "train")}
    if data.images:
        columns["image"] = list(data.images)
    names = {"position_m": "position", "rotation_rad": "rotation"}
    if solved.kinematics is None:
        names |= {
            "position_left_out_m": "position_left_out",
            "rotation_left_out_rad": "rotation_left_out",
            "distance": "distance",
        }
    if data.images:
        names |= {"rms_px": "pixels", "rms_corrected_px": "pixels_corrected"}
    for name, attribute in names.items():
        columns[name] = np.array([getattr(residual, attribute) for residual in residuals])
    columns["rejected"] = np.array([residual.rejected for residual in residuals], dtype=np.int8)
    columns["cause"] = [residual.cause or None for residual in residuals]
    return columns


def next_pose_columns(poses: Sequence[_core.NextHandPose]) -> dict[str, Any]:
    """Columns of ``next_poses.csv``: hand poses to drive to, as in poses.csv, and what each leaves at the
    working point.
    """
    frames = [frame_dict(pose.T_base_hand) for pose in poses]
    columns = {f"hand_{name}": np.array([frame[name] for frame in frames]) for name in frames[0]}
    columns["working_point_sigma_m"] = np.array([pose.working_point_sigma for pose in poses])
    return columns


def write_handeye(
    folder: Path,
    solved: Solved,
    *,
    warnings: Iterable[str] = (),
    nominal_file: Path | None = None,
    base_link: str = "",
    tip_link: str = "",
) -> dict[str, Any]:
    """Writes everything that ``truing handeye`` found into `folder`, and returns what result.json holds.
    `nominal_file`: of the robot, with kinematics.
    """
    data, r = solved.data, solved.result
    found: dict[str, Any] = without_nan(handeye_dict(solved, warnings=warnings))
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    if r.residuals:
        write_table(folder / "residuals.csv", residual_columns(solved))
    if (
        data.views is not None
        and r.status == "done"
        and (r.camera_model is not None or data.views.calibrated)
    ):
        camera, sigma = _camera_model(solved)
        noise = found["noise"]["pixel"]
        save_camera(
            folder / "camera.yaml",
            camera,
            sigma=dict(zip(INTRINSICS, sigma, strict=False)) if len(sigma) else None,
            calibration={
                "source": data.path.name,
                "board": str(data.views.board),
                "images": len(data.views.found),
                **({} if noise is None else {"noise_px": float(noise)}),
            },
        )
    if solved.next_poses:
        write_table(folder / "next_poses.csv", next_pose_columns(solved.next_poses))
    if solved.kinematics is not None and nominal_file is not None:
        _write_robot(folder, solved, found, nominal_file, base_link, tip_link)
    (folder / "report.html").write_text(handeye_report(found, scene_of(solved)), encoding="utf-8")
    return found


def handeye_page(result: _core.HandEyeResult, data: HandEyeData, options: _core.HandEyeOptions) -> str:
    """The report of ``truing handeye`` without its files."""
    solved = Solved(data, options, result)
    return handeye_report(without_nan(handeye_dict(solved)), scene_of(solved))


def write_without_clock(
    folder: Path, clock: _core.ClockOffset, keywords: Mapping[str, Any], *, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes that the clocks of robot and camera could not be compared, so that no two poses belong together;
    returns what result.json holds.
    """
    found: dict[str, Any] = without_nan(
        {
            "format": HANDEYE_FORMAT,
            "version": _core.version(),
            "setup": keywords["setup"],
            "method": keywords["method"],
            "status": "clock not found",
            "message": clock.message,
            "poses": 0,
            "residuals": [],
            "rejected_poses": [],
            "observability": {"singular_values": [], "gap": None, "axes_spread": None, "unobservable": []},
            "convention": {
                "reading": "",
                "explanation": "as the file says",
                "orientation": "",
                "other_readings": [],
            },
            "next_poses": [],
            "clock": _clock(clock),
            "warnings": list(warnings),
        }
    )
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    (folder / "report.html").write_text(handeye_report(found, None), encoding="utf-8")
    return found


def _write_robot(
    folder: Path, solved: Solved, found: Mapping[str, Any], nominal_file: Path, base_link: str, tip_link: str
) -> None:
    assert solved.kinematics is not None
    errors = found["kinematics"]["errors"]
    rms = errors.get("test", errors["train"])["after"]["rms_m"]
    write_robot(
        folder,
        solved.kinematics.robot,
        solved.data.path.name,
        {"rms_m": rms},
        nominal_file,
        base_link,
        tip_link,
    )
