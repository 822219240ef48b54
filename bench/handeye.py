# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""truing's hand-eye calibration beside OpenCV's seven, on the same scenes in one run.

    python bench/handeye.py [--quick] [--only accuracy,images,...] [--write docs/benchmarks/handeye.md]

Needs OpenCV 4 (`pip install "opencv-python-headless<5"`: 5.0 has no calibrateHandEye in Python). `--write`
puts the tables between the markers of the page; those not asked for stay as they are.
Trial k has seed k, in every cell; the oracle of bench/handeye_oracle.py says what can be had when the noises
are known.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

import truing
from truing.hand_eye import Camera, HandEyePoses, HandEyeResult, handeye_closed_form
from truing.testing import scenes as simulation
from truing.testing.scenes import Board, HandEyeScene, simulate_handeye

sys.path.insert(0, str(Path(__file__).resolve().parent))
import handeye_oracle as oracle

Floats = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Found:
    T_parent_camera: Floats
    T_parent_board: Floats | None = None
    # of T_parent_camera: translation in the parent [m], then rotation about the camera's own axes [rad], as
    # handeye_oracle.error_of
    covariance: Floats | None = None
    # shape=(6,) of Student's t, for intervals; turns about the camera's own axes: the fewest of the three
    degrees_of_freedom: Floats | None = None
    said: str = ""  # warnings, what was rejected, what could not be seen


Method = Callable[[HandEyeScene], Found]


# ---- truing --------------------------------------------------------------------------------------


def poses_of(scene: HandEyeScene, with_pixels: bool = False) -> HandEyePoses:
    images = (
        [(scene.board.points, pixels) for pixels in scene.pixels]
        if with_pixels and scene.pixels is not None
        else None
    )
    camera = None
    if images is not None:
        c = scene.camera
        camera = Camera(
            width=c.width, height=c.height, fx=c.fx, fy=c.fy, cx=c.cx, cy=c.cy, distortion=c.distortion
        )
    return HandEyePoses(scene.T_base_hand, scene.T_camera_board, images=images, camera=camera)


class Refused(ValueError):
    pass


def found_of(result: HandEyeResult) -> Found:
    if result.status not in ("done", "not converged"):
        raise Refused(
            f'{result.status}, reading "{result.readings[0].name}"' if result.readings else result.status
        )
    said = " ".join(result.warnings)
    # Covariances of the library turn about the parent's axes, those of the bench about the camera's own.
    turn = np.eye(6)
    turn[3:, 3:] = result.camera.T[:3, :3].T
    listed = (
        f"{len(result.rejected)} listed: {result.residuals[result.rejected[0]].cause}. "
        if result.rejected
        else ""
    )
    freedom = np.array(result.camera_degrees_of_freedom)
    freedom[3:] = freedom[3:].min()
    covariance = turn @ result.camera.covariance @ turn.T
    return Found(result.camera.T, result.board.T, covariance, freedom, listed + said)


def ours_closed_form(scene: HandEyeScene) -> Found:
    """handeye_closed_form on scene.T_base_hand and scene.T_camera_board: the SVD, without a look at
    whether the loop closes.
    """
    found = handeye_closed_form(poses_of(scene), scene.setup)
    return Found(found.T_parent_camera, found.T_parent_board)


def ours_closed_form_checked(scene: HandEyeScene) -> Found:
    """truing.handeye(..., method="closed-form")."""
    return found_of(
        truing.handeye(poses_of(scene), setup=scene.setup, method="closed-form", raise_if_undecided=False)
    )


def ours_refined(scene: HandEyeScene) -> Found:
    """truing.handeye, told scene.hand_m, hand_rad, camera_m, camera_rad."""
    return found_of(
        truing.handeye(
            poses_of(scene),
            setup=scene.setup,
            hand_position_sigma=scene.hand_m,
            hand_rotation_sigma=scene.hand_rad,
            camera_position_sigma=scene.camera_m,
            camera_rotation_sigma=scene.camera_rad,
            raise_if_undecided=False,
        )
    )


def ours_refined_unknown_noise(scene: HandEyeScene) -> Found:
    """The same, told nothing about the noise."""
    return found_of(truing.handeye(poses_of(scene), setup=scene.setup, raise_if_undecided=False))


def ours_pixels(scene: HandEyeScene) -> Found:
    """From scene.pixels (n, m, 2), scene.board.points (m, 3) and scene.camera, told scene.hand_m, hand_rad,
    pixel.
    """
    return found_of(
        truing.handeye(
            poses_of(scene, with_pixels=True),
            setup=scene.setup,
            hand_position_sigma=scene.hand_m,
            hand_rotation_sigma=scene.hand_rad,
            pixel_sigma=scene.pixel,
            raise_if_undecided=False,
        )
    )


# ---- Peers ---------------------------------------------------------------------------------------

HAND_EYE = {
    "Tsai": cv2.CALIB_HAND_EYE_TSAI,
    "Park": cv2.CALIB_HAND_EYE_PARK,
    "Horaud": cv2.CALIB_HAND_EYE_HORAUD,
    "Andreff": cv2.CALIB_HAND_EYE_ANDREFF,
    "Daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}
ROBOT_WORLD = {"Shah": cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH, "Li": cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI}


def parts(T: Floats) -> tuple[list[Floats], list[Floats]]:
    return list(T[:, :3, :3]), list(T[:, :3, 3])


def frame(R: Any, t: Any) -> Floats:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.ravel(t)
    return T


def opencv_hand_eye(method: int) -> Method:
    def solve(scene: HandEyeScene) -> Found:
        # For a camera that stands still OpenCV's manual wants base-from-hand turned round, and the camera
        # comes out in the base.
        hand = scene.T_base_hand if scene.setup == "eye-in-hand" else oracle.inverse(scene.T_base_hand)
        return Found(frame(*cv2.calibrateHandEye(*parts(hand), *parts(scene.T_camera_board), method=method)))

    return solve


def opencv_robot_world(method: int) -> Method:
    def solve(scene: HandEyeScene) -> Found:
        # Both setups are A X = Z B; with a camera that stands still the hand carries the board, so hand and
        # base change places.
        hand = oracle.inverse(scene.T_base_hand) if scene.setup == "eye-in-hand" else scene.T_base_hand
        R_x, t_x, R_z, t_z = cv2.calibrateRobotWorldHandEye(
            *parts(scene.T_camera_board), *parts(hand), method=method
        )
        return Found(oracle.inverse(frame(R_z, t_z)), oracle.inverse(frame(R_x, t_x)))

    return solve


def oracle_poses(scene: HandEyeScene) -> Found:
    found = oracle.solve(scene.select([k for k in range(scene.poses) if k not in scene.outlier_rows]))
    return Found(found.T_parent_camera, found.T_parent_board, found.covariance[:6, :6])


def oracle_pixels(scene: HandEyeScene) -> Found:
    found = oracle.solve(scene, pixels=True)
    return Found(found.T_parent_camera, found.T_parent_board, found.covariance[:6, :6])


def reprojection_only(scene: HandEyeScene) -> Found:
    found = oracle.solve(scene, pixels=True, exact_hand=True)
    return Found(found.T_parent_camera, found.T_parent_board, found.covariance[:6, :6])


OPENCV: dict[str, Method] = {
    **{f"OpenCV {name}": opencv_hand_eye(which) for name, which in HAND_EYE.items()},
    **{f"OpenCV robot-world {name}": opencv_robot_world(which) for name, which in ROBOT_WORLD.items()},
}
OURS: dict[str, Method] = {
    "truing closed form": ours_closed_form,
    "truing": ours_refined,
    "truing, noise not told": ours_refined_unknown_noise,
}
ORACLE: dict[str, Method] = {"oracle: noises known": oracle_poses}
ORACLE_PIXELS: dict[str, Method] = {
    "oracle: reprojection only": reprojection_only,
    "oracle: pixels and robot": oracle_pixels,
}


def by_pnp(scene: HandEyeScene) -> HandEyeScene:
    """T_camera_board from the pixels, each image by itself, by OpenCV."""
    assert scene.pixels is not None
    seen = []
    for pixels in scene.pixels:
        _, turn, t = cv2.solvePnP(
            scene.board.points,
            pixels,
            scene.camera.matrix,
            np.array(scene.camera.distortion),
            flags=cv2.SOLVEPNP_ITERATIVE,
        )
        seen.append(frame(cv2.Rodrigues(turn)[0], t))
    return replace(scene, T_camera_board=np.array(seen))


# ---- Running -------------------------------------------------------------------------------------


@dataclass
class Tally:
    """Errors and times of one method over the trials of one cell; what failed has an infinite error."""

    degrees: list[float]
    millimetres: list[float]
    seconds: list[float]
    failures: int = 0
    missing: bool = False

    @property
    def median(self) -> tuple[float, float]:
        return (
            (float(np.median(self.degrees)), float(np.median(self.millimetres)))
            if self.degrees
            else (math.nan, math.nan)
        )


def attempt(method: Method, scene: HandEyeScene) -> Found | str:
    """What was found, or why nothing was."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = method(scene)
        except (cv2.error, ValueError, RuntimeError, np.linalg.LinAlgError) as error:
            if isinstance(error, NotImplementedError):
                raise
            words = (
                str(getattr(error, "err", error)).strip().splitlines()
            )  # OpenCV: the assertion, without file and line
            return (
                f"{'OpenCV' if isinstance(error, cv2.error) else type(error).__name__}:"
                f" {words[0] if words else error}"
            )
    if not np.isfinite(found.T_parent_camera).all():
        return "NaN"
    if np.array_equal(
        found.T_parent_camera, np.eye(4)
    ):  # how OpenCV's Tsai gives up; a line in its log says so
        found = replace(found, said="identity")
    if caught:
        found = replace(
            found, said="; ".join([found.said, *(str(one.message) for one in caught)]).strip("; ")
        )
    return found


def tally(
    methods: Mapping[str, Method], trials: Mapping[str, int], scene_of: Callable[[int], HandEyeScene]
) -> dict[str, Tally]:
    out = {name: Tally([], [], []) for name in methods}
    for seed in range(max(trials.values())):
        scene = scene_of(seed)
        for name, method in methods.items():
            one = out[name]
            if seed >= trials[name] or one.missing:
                continue
            begun = time.perf_counter()
            try:
                found = attempt(method, scene)
            except NotImplementedError:
                one.missing = True
                continue
            one.seconds.append(time.perf_counter() - begun)
            if isinstance(found, str):
                one.failures += 1
                degrees, millimetres = math.inf, math.inf
            else:
                degrees, millimetres = oracle.degrees_millimetres(
                    scene.T_parent_camera, found.T_parent_camera
                )
            one.degrees.append(degrees)
            one.millimetres.append(millimetres)
    return out


def scenes(**options: Any) -> Callable[[int], HandEyeScene]:
    """Trial k has seed k."""
    return lambda seed: simulate_handeye(**options, seed=seed)


def number(value: float) -> str:
    return (
        "–"
        if math.isnan(value)
        else "failed"
        if math.isinf(value)
        else f"{value:.3g}"
        if value < 1000
        else f"{value:.0f}"
    )


def milliseconds(seconds: list[float]) -> str:
    return number(1e3 * float(np.median(seconds))) if seconds else "–"


def cell(one: Tally) -> str:
    if one.missing:
        return "–"
    return f"{number(one.median[0])} / {number(one.median[1])}" + (
        f" ({one.failures} failed)" if one.failures else ""
    )


def note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


# ---- Tables --------------------------------------------------------------------------------------


def accuracy(quick: bool) -> Iterator[str]:
    """Errors and times at several numbers of poses, both setups."""
    for setup in simulation.SETUPS:
        results: dict[int, dict[str, Tally]] = {}
        for poses in (10, 30, 100) if quick else (10, 30, 100, 1000):
            methods = {**OPENCV, **ORACLE, **OURS}
            many = (20 if quick else 100) if poses < 1000 else 20
            trials = {name: many for name in methods}
            if poses == 1000:
                for name in HAND_EYE:
                    trials[f"OpenCV {name}"] = 5  # seconds each, and more than a gigabyte
            results[poses] = tally(methods, trials, scenes(setup=setup, poses=poses))
            note(f"{setup}, {poses} poses")
        yield from ("", f"### {setup}", "")
        yield (
            "| | "
            + " | ".join(f"N = {poses}" for poses in results)
            + " | ms: "
            + " / ".join(map(str, results))
            + " | times truing's |"
        )
        yield "| --- |" + " --- |" * (len(results) + 2)
        for name in next(iter(results.values())):
            yield (
                f"| {name} | "
                + " | ".join(cell(result[name]) for result in results.values())
                + " | "
                + " / ".join(milliseconds(result[name].seconds) for result in results.values())
                + f" | {ratios(results, name)} |"
            )
    yield from (
        "",
        (
            f"Median rotation [deg] / translation [mm] error of the camera over {20 if quick else 100}"
            " scenes; at N = 1000 over 20, and 5 for OpenCV's five. Last column: error over truing's (the"
            " oracle's where truing has none), geometric mean over N, rotation / translation."
        ),
    )


def ratios(results: Mapping[int, Mapping[str, Tally]], name: str) -> str:
    against = "truing" if not next(iter(results.values()))["truing"].missing else next(iter(ORACLE))
    if all(result[name].missing for result in results.values()):
        return "–"
    logs = np.log(
        [[result[name].median[k] / result[against].median[k] for k in (0, 1)] for result in results.values()]
    )
    return " / ".join(
        "failed" if not math.isfinite(value) else f"{math.exp(value):.2f}" for value in logs.mean(axis=0)
    )


def outliers(quick: bool) -> Iterator[str]:
    """10 degrees and 30 mm in a fraction of the boards; the oracle knows which."""
    methods = {**OPENCV, **ORACLE, **OURS}
    trials = {name: 20 if quick else 100 for name in methods}
    results = {share: tally(methods, trials, scenes(poses=30, outliers=share)) for share in (0.0, 0.1, 0.3)}
    yield from (
        "",
        "| | " + " | ".join(f"{100 * share:.0f} %" for share in results) + " | ms |",
        "| --- |" + " --- |" * (len(results) + 1),
    )
    for name in methods:
        yield (
            f"| {name} | "
            + " | ".join(cell(result[name]) for result in results.values())
            + f" | {milliseconds(results[0.3][name].seconds)} |"
        )
    yield from (
        "",
        (
            "Eye-to-hand, 30 poses; that fraction of the boards is seen 10 deg and 30 mm off. The oracle is"
            " told which."
        ),
    )


def images(quick: bool) -> Iterator[str]:
    """Chessboard corners in pixels."""

    def through_pnp(method: Method) -> Method:
        return lambda scene: method(by_pnp(scene))

    peers = {f"solvePnP, {name}": through_pnp(method) for name, method in OPENCV.items()}
    methods = {**peers, **ORACLE_PIXELS, "truing": ours_pixels}
    trials = {name: 10 if quick else 100 for name in methods}
    results = {
        setup: tally(methods, trials, scenes(setup=setup, poses=30, board=Board()))
        for setup in simulation.SETUPS
    }
    yield from ("", "| | " + " | ".join(results) + " | ms |", "| --- |" + " --- |" * (len(results) + 1))
    for name in methods:
        yield (
            f"| {name} | "
            + " | ".join(cell(result[name]) for result in results.values())
            + f" | {milliseconds(results['eye-to-hand'][name].seconds)} |"
        )
    yield from (
        "",
        (
            "30 images of a 9 x 6 chessboard of 25 mm, 1280 x 960 pixels, plumb_bob distortion, 0.1 px of"
            " noise per axis; robot 0.05 deg, 0.1 mm. Times of OpenCV include its 30 solvePnP."
        ),
    )


def student_95(degrees_of_freedom: Floats) -> Floats:
    """Half the width of the 95 % interval in standard errors; infinitely many: the normal distribution's."""
    from scipy.stats import t

    return np.asarray(t.ppf(0.975, np.minimum(degrees_of_freedom, 1e9)))


def coverage(quick: bool) -> Iterator[str]:
    """How often the truth lies within the 95 % intervals that a method states."""
    seeds = 50 if quick else 500
    cells: list[tuple[str, str, Method, Callable[[int], HandEyeScene]]] = []
    for setup in simulation.SETUPS:
        for poses in (10, 30):
            of_poses = scenes(setup=setup, poses=poses)
            cells += [
                (f"{setup}, {poses} poses", name, method, of_poses)
                for name, method in {**ORACLE, **OURS}.items()
            ]
    of_pixels = scenes(poses=30, board=Board())
    cells += [
        ("eye-to-hand, 30 images", name, method, of_pixels)
        for name, method in {**ORACLE_PIXELS, "truing": ours_pixels}.items()
    ]
    yield from (
        "",
        "| scene | method | seeds | x | y | z | rx | ry | rz | mean squared normalised error / 6 |",
        "| --- |" + " --- |" * 9,
    )
    for what, name, method, scene_of in cells:
        count = max(10, seeds // 5) if "oracle: " in name else seeds  # up to half a second each
        inside, squared = [], []
        for seed in range(count):
            scene = scene_of(seed)
            try:
                found = attempt(method, scene)
            except NotImplementedError:
                break
            if isinstance(found, str) or found.covariance is None:
                inside.append(np.zeros(6, dtype=bool))
                continue
            error = oracle.error_of(scene.T_parent_camera, found.T_parent_camera)
            freedom = np.full(6, np.inf) if found.degrees_of_freedom is None else found.degrees_of_freedom
            inside.append(np.abs(error) < student_95(freedom) * np.sqrt(np.diag(found.covariance)))
            squared.append(error @ np.linalg.solve(found.covariance, error) / 6)
        if inside and squared:
            yield (
                f"| {what} | {name} | {count} | "
                + " | ".join(f"{100 * share:.1f} %" for share in np.mean(inside, axis=0))
                + f" | {np.mean(squared):.3f} |"
            )
        elif not inside:
            yield f"| {what} | {name} | – |" + " – |" * 7
        note(f"coverage: {what}, {name}")
    yield from (
        "",
        (
            "Of the camera's place in its parent and of its rotation about its own axes; intervals by"
            " Student's t with the degrees of freedom that the result states. 95 % and 1 (n / (n - 2) of n"
            f" degrees) are right; with {seeds} seeds 95 % may read"
            f" {95 - 196 * math.sqrt(0.0475 / seeds):.1f} to"
            f" {min(100.0, 95 + 196 * math.sqrt(0.0475 / seeds)):.1f} %."
        ),
    )


def failures(quick: bool) -> Iterator[str]:
    """What comes out of data that cannot tell, or are wrong, and whether anybody says so."""
    seeds = range(1, 4 if quick else 12)
    methods = {**OPENCV, "truing closed form": ours_closed_form_checked, "truing": ours_refined_unknown_noise}
    for setup in simulation.SETUPS:
        yield from (
            "",
            f"### {setup}",
            "",
            "| | " + " | ".join(methods) + " |",
            "| --- |" + " --- |" * len(methods),
        )
        bad = {
            name: [make(setup, seed=seed) for seed in seeds] for name, make in simulation.DEGENERATE.items()
        }
        bad.update(
            {
                name: [spoil(simulate_handeye(setup, 30, seed=seed)) for seed in seeds]
                for name, spoil in simulation.MISTAKES.items()
            }
        )
        for name, scenes in bad.items():
            yield f"| {name} | " + " | ".join(in_words(method, scenes) for method in methods.values()) + " |"
    yield from (
        "",
        (
            f"Median error [deg] / [mm] of {len(seeds)} scenes of 30 poses (5 equal ones, 2) with the usual"
            " noise; a figure alone was given without a word. In brackets how often there was none, or what"
            ' was said; "identity": OpenCV gives the identity and writes a line to its log. One rotation'
            " axis leaves one coordinate open, pure translation three; there every figure but a refusal is"
            " luck."
        ),
    )


def in_words(method: Method, scenes: list[HandEyeScene]) -> str:
    errors, refusals, remarks = [], [], []
    for scene in scenes:
        try:
            found = attempt(method, scene)
        except NotImplementedError:
            return "–"
        if isinstance(found, str):
            refusals.append(found.removeprefix("OpenCV: ").strip("> :"))
            continue
        errors.append(oracle.degrees_millimetres(scene.T_parent_camera, found.T_parent_camera))
        if found.said:
            remarks.append(found.said)
    figures = " / ".join(number(float(value)) for value in np.median(errors, axis=0)) if errors else ""
    said = [f"{len(words)} of {len(scenes)}: {words[0]}" for words in (refusals, remarks) if words]
    return (
        (f"{figures} ({'; '.join(said)})" if figures and said else figures or said[0])
        .replace("|", "/")
        .replace("\n", " ")
    )


def invariance(quick: bool) -> Iterator[str]:
    """The same poses in another order, and in another unit, should give the same."""
    seeds = 5 if quick else 20
    methods = {**OPENCV, **OURS}
    yield from (
        "",
        "| | other order [deg] / [mm] | mm for m, in everything [deg] / [mm] |",
        "| --- | --- | --- |",
    )
    for name, method in methods.items():
        moved: dict[str, list[tuple[float, float]]] = {"order": [], "unit": []}
        try:
            for seed in range(seeds):
                scene = simulate_handeye(poses=30, seed=seed)
                found = [
                    attempt(method, one)
                    for one in (scene, simulation.shuffled(scene), simulation.scaled(scene))
                ]
                if any(isinstance(one, str) for one in found):
                    continue
                first, order, unit = (one.T_parent_camera for one in found if not isinstance(one, str))
                unit = unit.copy()
                unit[:3, 3] /= 1000
                moved["order"].append(oracle.degrees_millimetres(first, order))
                moved["unit"].append(oracle.degrees_millimetres(first, unit))
        except NotImplementedError:
            yield f"| {name} | – | – |"
            continue
        yield (
            f"| {name} | "
            + " | ".join(
                " / ".join(f"{value:.2g}" for value in np.max(rows, axis=0)) if rows else "failed"
                for rows in moved.values()
            )
            + " |"
        )
    yield from (
        "",
        (
            f"The largest movement of the camera over {seeds} eye-to-hand scenes of 30 poses. Only the data"
            " changes; nothing of it is an error."
        ),
    )


TABLES: dict[str, tuple[str, Callable[[bool], Iterator[str]]]] = {
    "accuracy": ("Accuracy and time", accuracy),
    "outliers": ("Outliers", outliers),
    "images": ("From images", images),
    "coverage": ("Are the intervals true?", coverage),
    "failures": ("Bad data", failures),
    "invariance": ("Order and units", invariance),
}


def machine() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        processor = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor() or platform.machine()
    return (
        f"{processor}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, NumPy"
        f" {np.__version__}, OpenCV {cv2.__version__}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer trials, and no scene of 1000 poses")
    parser.add_argument("--only", default=",".join(TABLES), help="tables to make, with commas between")
    parser.add_argument(
        "--write", type=Path, help="the page whose markers <!-- table --> and <!-- end --> take the tables"
    )
    arguments = parser.parse_args()
    wanted = arguments.only.split(",")
    unknown = [name for name in wanted if name not in TABLES]
    if unknown:
        parser.error(f"no table {unknown[0]!r}; there are {', '.join(TABLES)}")
    page = arguments.write.read_text(encoding="utf-8") if arguments.write else ""
    if arguments.write and not ("<!-- table -->" in page and "<!-- end -->" in page):
        parser.error(f"{arguments.write} has no markers <!-- table --> and <!-- end -->")
    if not hasattr(cv2, "calibrateHandEye"):
        parser.error(
            f'OpenCV {cv2.__version__} has no calibrateHandEye: pip install "opencv-python-headless<5"'
        )
    cv2.setNumThreads(1)
    quick = " --quick" if arguments.quick else ""
    for name in wanted:
        before = load()
        title, table = TABLES[name]
        lines = list(table(arguments.quick))
        about = (
            f"From `python bench/handeye.py{quick} --only {name}` on {datetime.now(timezone.utc):%Y-%m-%d}:"
            f" {machine()}. Load average {before:.1f} before and {load():.1f} after, this program's own work"
            " included; above the number of cores, believe no time but in ratio."
        )
        section = "\n".join([f"## {title}", "", about, *lines])
        if arguments.write:  # at once: what is made is kept if a later table fails
            page = with_section(arguments.write.read_text(encoding="utf-8"), title, section)
            arguments.write.write_text(page, encoding="utf-8")
            note(f"{title}: done")
        else:
            print("\n" + section, flush=True)


def load() -> float:
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else math.nan


def with_section(page: str, title: str, section: str) -> str:
    """The page with this section between its markers anew, and the others as they were."""
    start, end = page.index("<!-- table -->") + len("<!-- table -->"), page.index("<!-- end -->")
    old = {part.split("\n", 1)[0]: f"## {part.rstrip()}" for part in page[start:end].split("\n## ")[1:]}
    old[title] = section.rstrip()
    titles = [title for title, _ in TABLES.values() if title in old]
    return page[:start] + "\n" + "\n\n".join(old[one] for one in titles) + "\n" + page[end:]


if __name__ == "__main__":
    main()
