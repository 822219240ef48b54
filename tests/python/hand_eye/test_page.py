# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a hand-eye calibration says what result.json says, for every status, escapes what it quotes,
and stands alone.
"""

from __future__ import annotations

import copy
import dataclasses
import html
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from handeye_scenes import HandEyeScene, scene, write_scene
from pages import charts_of, visible
from truing.hand_eye.page import Scene, handeye_report
from truing.hand_eye.result import Solved, handeye_dict, scene_of
from truing.report.json_text import without_nan


def solved(tmp_path: Path, s: HandEyeScene, **options: Any) -> tuple[dict[str, Any], Scene | None]:
    data = truing.load_handeye(
        write_scene(
            tmp_path / "poses.csv", s, set=["test" if k % 6 == 5 else "train" for k in range(len(s.A))]
        )
    )
    keywords = {"setup": s.setup, **options}
    result = Solved(
        data,
        truing.hand_eye.handeye_options(data, **keywords),
        truing.handeye(data, **keywords, raise_if_undecided=False),
    )
    return without_nan(handeye_dict(result)), scene_of(result)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Scene | None]:
    s = scene(24, "eye-to-hand", seed=2)
    A = s.A.copy()
    A[7, 1, 3] += 0.405
    return solved(tmp_path_factory.mktemp("good"), dataclasses.replace(s, A=A))


def test_the_first_screen_says_where_the_camera_is_and_whether_to_trust_it(
    good: tuple[dict[str, Any], Scene | None],
) -> None:
    result, scene = good
    text = visible(handeye_report(result, scene))
    camera, point = result["camera"], result["working_point"]
    assert text.startswith(
        "Hand-eye calibration truing handeye · eye to hand · 24 poses camera found The camera sits at ("
    )
    assert f"{1e3 * camera['x_m']:.1f}"[:6] in text[:200] and "in the robot base" in text
    assert f"±{1e3 * point['sigma_m']:.2f} mm" in text[:300]
    assert (
        text.index("How far each pose is")
        < text.index("Usable, but look at the marked points")
        < text.index("1 pose rejected")
        < text.index("The scene")
    )
    assert "Held-out poses are" in text


def test_every_pose_is_a_dot_and_a_rejected_one_says_why(good: tuple[dict[str, Any], Scene | None]) -> None:
    result, scene = good
    charts = charts_of(handeye_report(result, scene))
    assert {"closure_position", "closure_rotation", "directions", "singular"} <= set(charts)
    traces = {trace["name"]: trace for trace in charts["closure_position"]["data"]}
    assert len(traces["left out"]["x"]) + len(traces["held out"]["x"]) + len(traces["rejected"]["x"]) == 24
    assert (
        traces["rejected"]["x"] == [7]
        and result["rejected_poses"][0]["cause"] in traces["rejected"]["text"][0]
    )
    assert traces["rejected"]["y"][0] == pytest.approx(1e3 * result["residuals"][7]["position_left_out_m"])
    assert "95 % below, by the noise" in traces


def test_about_all_poses_are_below_what_the_noise_predicts(good: tuple[dict[str, Any], Scene | None]) -> None:
    result, scene = good
    assert scene is not None
    below = [
        r["position_m"] < scene.predicted_m[k] for k, r in enumerate(result["residuals"]) if not r["rejected"]
    ]
    assert np.mean(below) > 0.8


def test_seen_and_predicted_boards_lie_together_in_the_scene(
    good: tuple[dict[str, Any], Scene | None],
) -> None:
    result, scene = good
    assert scene is not None
    off = np.linalg.norm(scene.T_base_board_seen[:, :3, 3] - scene.T_base_board[:, :3, 3], axis=1)
    assert np.median(off) < 2e-3
    assert np.allclose(scene.T_base_camera, scene.T_base_camera[0])  # the camera stands still


@pytest.mark.parametrize("kind", ["one axis", "inverted", "mixed up"])
def test_without_an_answer_it_says_what_to_do_and_gives_no_camera(tmp_path: Path, kind: str) -> None:
    s = scene(20, one_axis=True) if kind == "one axis" else scene(20, "eye-to-hand", seed=3)
    if kind == "inverted":
        s = dataclasses.replace(s, A=np.linalg.inv(s.A))
    if kind == "mixed up":
        s = dataclasses.replace(s, A=s.A[np.random.default_rng(0).permutation(20)])
    result, drawn = solved(tmp_path, s)
    assert drawn is None and "camera" not in result
    text = html.unescape(visible(handeye_report(result, drawn)))
    assert (
        result["message"].rstrip(".")[1:] in text
        and "No camera pose is given" in text
        and "The camera sits at" not in text
    )
    assert text.index("What to do") < text.index("What the motions show")
    expected = {
        "one axis": "cannot be seen",
        "inverted": "--reading hand-inverted",
        "mixed up": "No other reading of the numbers closes it either",
    }
    assert expected[kind] in text
    assert ("Other readings of the same numbers" in text) == (kind == "inverted")


def fabricated(result: dict[str, Any]) -> dict[str, Any]:
    """With everything that a run may come to."""
    full = copy.deepcopy(result)
    for r in full["residuals"]:
        r |= {"image": f"images/{r['pose']}.png", "pixels": 0.3 + 0.01 * r["pose"], "pixels_corrected": 0.1}
    full["noise"]["pixel"] = 0.12
    for errors in full["errors"].values():
        errors["rms_px"] = 0.3
    full["images"] = {
        "board": "circles:8x5:25mm",
        "found": 24,
        "not_found": ["images/99.png"],
        "camera_given": False,
        "camera_refined": True,
        "rms_px": [0.1] * 24,
        "camera": {
            "width": 640,
            "height": 480,
            "fx": 550.0,
            "fy": 551.0,
            "cx": 320.0,
            "cy": 240.0,
            "distortion": {"model": "plumb_bob", "coefficients": [0.1, 0, 0, 0, 0]},
            "sigma": {"fx": 0.5, "k1": None},
        },
    }
    full["next_poses"] = [
        {
            "x_m": 0.1,
            "y_m": -0.2,
            "z_m": 0.3,
            "qw": 1.0,
            "qx": 0.0,
            "qy": 0.0,
            "qz": 0.0,
            "working_point_sigma_m": 1e-4,
        }
    ]
    full["clock"] = {
        "offset_s": -0.0123,
        "sigma_s": 1e-4,
        "correlation": 0.99,
        "found": True,
        "message": "",
        "rows": 24,
    }
    errors = {"before": full["errors"]["train"], "after": full["errors"]["left_out"]}
    parameter = {
        "name": "J2.offset",
        "nominal": 0.0,
        "value": 1e-3,
        "sigma": 1e-5,
        "unit": "rad",
        "frozen": False,
    }
    full["kinematics"] = {
        "robot": "arm",
        "errors": {"train": errors, "test": errors},
        "parameters": [parameter, parameter | {"name": "J1.a", "sigma": None, "frozen": True}],
        "frozen": [],
        "rejected_poses": [],
        "rank": 1,
        "columns": 2,
        "converged": True,
        "warnings": [],
    }
    full["convention"] |= {
        "reading": "hand-inverted",
        "explanation": "hand poses are inverted (base in hand)",
    }
    full["warnings"] = ["the board's lengths would fit best if they were 2 % larger"]
    return full


def with_pixels(scene: Scene | None) -> Scene:
    assert scene is not None
    rng = np.random.default_rng(0)
    return dataclasses.replace(
        scene, pixel_errors=rng.normal(0, 0.1, (500, 2)), pixel_places=rng.uniform(0, 480, (500, 2))
    )


def test_what_a_run_may_come_to_is_all_said(good: tuple[dict[str, Any], Scene | None]) -> None:
    result, scene = good
    page = handeye_report(fabricated(result), with_pixels(scene))
    text = visible(page)
    for part in (
        "Worst images",
        "images/23.png",
        "images/99.png",
        "fx 550.00 px ± 0.50",
        "What is left in the images",
        "Measure next",
        "next_poses.csv",
        "t_hand = t_camera − 12.30 ms",
        "Camera and robot together",
        "J2.offset +1 mrad",
        "Read otherwise than the file says",
        "Warnings",
        "0.12 px",
    ):
        assert part in text, part
    assert "J1.a" not in text
    assert {"reprojection", "places"} <= set(charts_of(page))


def test_where_no_pose_can_be_left_out_the_headline_says_so(
    good: tuple[dict[str, Any], Scene | None],
) -> None:
    result, scene = good
    full = copy.deepcopy(result)
    left_out = full["errors"]["left_out"]
    full["errors"]["left_out"] = {**dict.fromkeys(left_out), "n": left_out["n"]}
    for r in full["residuals"]:
        r |= {"position_left_out_m": None, "rotation_left_out_rad": None}
    text = visible(handeye_report(full, scene))
    assert "With so few poses none can be left out" in text[:700]
    assert "predicted to" not in text[:700]


def test_with_the_robot_found_as_well_nothing_is_called_left_out(
    good: tuple[dict[str, Any], Scene | None],
) -> None:
    result, scene = good
    full = fabricated(result)
    full["errors"].pop("left_out")
    full["noise"] |= {"camera_rad": None, "pixel": None}
    for r in full["residuals"]:
        r |= {"position_left_out_m": None, "rotation_left_out_rad": None}
    page = handeye_report(full, scene)
    text = visible(page)
    assert "close the loop to" in text[:500] and "with the nominal one" in text[:500]
    assert "How far each pose is from closing the loop" in text and "left out" not in text
    assert {trace["name"] for trace in charts_of(page)["closure_position"]["data"]} >= {"fitted", "rejected"}


def test_names_from_files_cannot_become_markup(good: tuple[dict[str, Any], Scene | None]) -> None:
    evil = "<img src=x onerror=alert(1)>"
    result, scene = good
    full = fabricated(result)
    words = [
        full["rejected_poses"][0]["cause"],
        full["convention"]["explanation"],
        full["images"]["board"],
        "images/99.png",
        "arm",
        "J2.offset",
        *full["warnings"],
        *(r["image"] for r in full["residuals"]),
    ]
    text = json.dumps(full)
    for word in words:
        text = text.replace(json.dumps(word), json.dumps(evil))
    page = handeye_report(json.loads(text), with_pixels(scene))
    assert "<img" not in page[page.index("<body>") : page.index("<script>")]
    undecided = {**json.loads(text), "status": "not closing", "message": evil}
    undecided["convention"]["other_readings"] = [
        {"reading": evil, "option": evil, "explanation": evil, "rms_m": 1e-3, "rotation_rms_rad": 1e-3}
    ]
    undecided["observability"]["unobservable"] = [
        {"what": evil, "direction": [0, 0, 1], "rotation": False, "sigma": None, "advice": evil}
    ]
    page = handeye_report(undecided, None)
    assert "<img" not in page[page.index("<body>") : page.index("<script>")]


def test_what_is_not_known_is_left_out_and_breaks_nothing(good: tuple[dict[str, Any], Scene | None]) -> None:
    result, scene = good
    assert scene is not None
    bare = copy.deepcopy(result)
    bare["observability"] |= {"gap": None, "axes_spread": None}
    for r in bare["residuals"]:
        r |= {"position_left_out_m": None, "rotation_left_out_rad": None, "distance": None}
    bare["camera"]["sigma"] = dict.fromkeys(bare["camera"]["sigma"])
    bare["board"]["sigma"] = dict.fromkeys(bare["board"]["sigma"])
    bare["board_scale"]["sigma"] = None
    bare.pop("solver", None)
    nowhere = dataclasses.replace(
        scene,
        T_base_board_seen=np.full_like(scene.T_base_board_seen, np.nan),
        predicted_m=np.full(24, np.nan),
        predicted_rad=np.full(24, np.nan),
    )
    assert "The camera sits at" in visible(handeye_report(bare, nowhere))
