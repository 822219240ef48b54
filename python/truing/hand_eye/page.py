# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of ``truing handeye``.

The first screen: where the camera is and how sure that is, how well each pose closes the loop that it was
left out of, and whether to trust it;
or why there is no answer, and what to do. Below: the scene, the uncertainty by direction, what the motions
can show, images, poses, next poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.report.charts import AFTER, BEFORE, INK, MUTED, REJECTED, faded, packed, round_down, subsample
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.scene import Scene3d, polyline
from truing.report.trust import BAD, GOOD, LOOK, Check, grade_of, shortened, trust_card
from truing.report.words import angle_text, counted, escaped, figures_text, length_text

Floats = NDArray[np.float64]

HELD_OUT, SEEN = "#2e8b57", "#d98324"
TRIADS = ("#c0392b", "#2e8b57", "#2f6fb7")  # x, y, z
SCENE_POSES = 60
SCENE_BOARDS = 12
LISTED = 40
WORST_IMAGES = 6
# Where a check turns from good to worth a look, and to bad.
FEW_POSES, TOO_FEW_POSES = 12, 6
FLAT_AXES, ONE_AXIS = 0.25, 0.08
MANY_REJECTED = 0.2
WORSE_THAN_NOISE = 1.6

_LABELS = {
    "done": ("found", "camera found"),
    "not observable": ("open", "not observable"),
    "not closing": ("open", "loop does not close"),
    "not converged": ("open", "did not converge"),
    "clock not found": ("open", "clocks not compared"),
}


@dataclass(frozen=True)
class Scene:
    """What the report draws, beside what result.json holds. Frames in the robot base, one per pose; NaN where
    there is none.
    """

    T_base_hand: Floats  # shape=(n, 4, 4) as found
    T_base_camera: Floats  # shape=(n, 4, 4)
    T_base_board_seen: Floats  # shape=(n, 4, 4)
    T_base_board: Floats  # shape=(n, 4, 4) predicted
    # shape=(n,) [m] length below which 95 % of position residuals lie by the noise; NaN: not known
    predicted_m: Floats
    predicted_rad: Floats  # shape=(n,) [rad]
    board_m: tuple[float, float, float, float]  # left, top, right, bottom of the board in its frame [m]
    pixel_errors: Floats  # shape=(k, 2) [px] seen minus predicted, robot poses as found
    pixel_places: Floats  # shape=(k, 2) [px]


def handeye_report(result: Mapping[str, Any], scene: Scene | None) -> str:
    """The report of ``truing handeye``.

    Args:
        result: What ``result.json`` holds (format ``truing-handeye/1``).
        scene: Where everything is; None where no camera was found.
    """
    page = Page("Hand-eye calibration", part_of_page("hand_eye"))
    page.add(_headline(result))
    if result["status"] == "done":
        page.add('<div class="first">')
        _closures(page, result, scene)
        page.add(f'<div class="column">{_trust(result)}')
        _directions(page, result)
        page.add("</div></div>")
    else:
        page.add(_what_to_do(result))
    if result["status"] == "not closing":
        page.add(_readings(result))
    if scene is not None:
        page.add('<div class="pair wide">')
        _scene(page, result, scene)
        page.add(_frames(result))
        page.add("</div>")
        page.add(_compared(result))
    elif result["residuals"]:
        page.add("<div>")
        _closures(page, result, scene)
        page.add("</div>")
    page.add('<div class="pair">')
    if result["observability"]["singular_values"]:
        _observability(page, result)
    page.add(_noise(result))
    page.add("</div>")
    page.add(_kinematics(result))
    if scene is not None and len(scene.pixel_errors):
        _pixels(page, result, scene)
    page.add(_images(result))
    page.add(_next(result))
    page.add(_poses(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- First screen --------------------------------------------------------------------------------


def _headline(result: Mapping[str, Any]) -> str:
    tone, label = _LABELS[result["status"]]
    where = {"hand": "the hand", "base": "the robot base"}
    kicker = (
        f'<p class="kicker">truing handeye · {escaped(result["setup"].replace("-", " "))} ·'
        f' {counted(result["poses"], "pose")}<span class="verdict {tone}">{label}</span></p>'
    )
    if result["status"] != "done":
        return (
            f'<header>{kicker}<h1 class="long">{escaped(_sentence(result["message"]))}</h1><p class="sub">No'
            " camera pose is given: what these data say about it is not to be relied on.</p></header>"
        )
    camera, point = result["camera"], result["working_point"]
    distance = float(np.linalg.norm(point["in_camera_m"]))
    digits = _decimals(camera["sigma"])
    place = ", ".join(_millimetres(camera[f"{axis}_m"], digits) for axis in "xyz")
    first = (
        f'The camera sits at <span class="after">({place}) mm</span> in {where[camera["in"]]}. At the working'
        f' point it is known to <span class="after">±{length_text(point["sigma_m"])}</span> and <span'
        f' class="after">±{_mrad(point["rotation_sigma_rad"])}</span>.'
    )
    sub = f"One standard error of each axis; the working point is {length_text(distance)} from the camera. "
    if "kinematics" in result:
        name = "test" if "test" in result["kinematics"]["errors"] else "train"
        both = result["kinematics"]["errors"][name]
        sub += (
            f"{'Held-out' if name == 'test' else 'Fitted'} poses close the loop to"
            f" {length_text(both['after']['rms_m'])} rms with the calibrated robot,"
            f" {length_text(both['before']['rms_m'])} with the nominal one."
        )
    else:
        sub += _left_out_sentence(result["errors"]["left_out"])
    return f'<header>{kicker}<h1>{first}</h1><p class="sub">{sub}</p></header>'


def _left_out_sentence(errors: Mapping[str, Any]) -> str:
    if errors["rms_m"] is None:
        return "With so few poses none can be left out: what a new one would show is not known."
    return (
        f"A pose that was left out of the fit is predicted to {length_text(errors['rms_m'])} and"
        f" {_mrad(errors['rotation_rms_rad'])} rms"
        + (f", {_pixels_text(errors['rms_px'])}" if errors.get("rms_px") is not None else "")
        + "."
    )


def _what_to_do(result: Mapping[str, Any]) -> str:
    items = []
    for u in result["observability"]["unobservable"]:
        size = (
            ""
            if u["sigma"] is None
            else f" (± {_mrad(u['sigma']) if u['rotation'] else length_text(u['sigma'])})"
        )
        items.append(
            f"<li><b>{escaped(_sentence(u['what'], False))}{size} cannot be seen.</b>"
            f" {escaped(_sentence(u['advice'].replace('(known height)', '(--known-height)')))}</li>"
        )
    readings = result["convention"]["other_readings"]
    if readings:
        best = readings[0]
        items.append(
            f"<li><b>The loop closes to {length_text(best['rms_m'])} if {escaped(best['explanation'])}.</b>"
            f" If that is so, run again with <code>{escaped(best['option'])}</code>, or correct"
            " the file.</li>"
        )
    elif result["status"] == "not closing":
        items.append(
            "<li>No other reading of the numbers closes it either. Is every robot pose the one at which its"
            " image was taken? Did camera, board or robot base move in between? Is the board as large as was"
            " said?</li>"
        )
    if not items:
        items.append("<li>See below what the motions show.</li>")
    return f'<section class="card look"><h2>What to do</h2><ul class="plain">{"".join(items)}</ul></section>'


def _readings(result: Mapping[str, Any]) -> str:
    readings = result["convention"]["other_readings"]
    if not readings:
        return ""
    body = "".join(
        f"<tr><th><code>{escaped(r['option'])}</code></th><td"
        f' class="wrap">{escaped(r["explanation"])}</td>'
        f"{table_cell(r['rms_m'] or 0, length_text(r['rms_m']))}"
        f"{table_cell(r['rotation_rms_rad'] or 0, _mrad(r['rotation_rms_rad']))}</tr>"
        for r in readings
    )
    return (
        '<section class="card"><h2>Other readings of the same numbers</h2><p class="lead">With which the'
        ' loop closes, best first.</p><div class="scroll"><table'
        ' class="left"><thead><tr><th>option</th><th>what it means</th><th>closure,'
        f" median</th><th></th></tr></thead><tbody>{body}</tbody></table></div></section>"
    )


def _closures(page: Page, result: Mapping[str, Any], scene: Scene | None) -> None:
    """Left-out residuals of every pose, in mm and mrad, against what the noise predicts."""
    alone = "kinematics" not in result
    page.add(
        '<section class="card"><h2>How far each pose is from'
        f" {'where the others put it' if alone else 'closing the loop'}</h2>"
    )
    _closure_chart(page, result, "position", None if scene is None else scene.predicted_m)
    _closure_chart(page, result, "rotation", None if scene is None else scene.predicted_rad)
    first = (
        "Each dot is a pose that was left out, predicted from all the others; held-out poses never took part."
        if alone
        else "With the calibrated robot; held-out poses never took part in the fit."
    )
    page.add(
        f'<p class="note">{first} Dots far above the dotted line say that something moves that the model does'
        " not know.</p></section>"
    )


def _closure_chart(page: Page, result: Mapping[str, Any], key: str, predicted: Floats | None) -> None:
    """Residuals of every pose. `key`: "position" or "rotation"."""
    position = key == "position"
    scale, unit = (1e3, "mm") if position else (1e3, "mrad")
    traces: list[dict[str, Any]] = []
    if predicted is not None and len(predicted) and np.isfinite(predicted).all():
        traces.append(_expected_trace(result, predicted * scale, unit))
    traces += _residual_traces(result, key, scale, unit)
    page.chart(
        f"closure_{key}",
        traces,
        {
            "xaxis": {"title": {"text": "" if position else "pose"}},
            "yaxis": _closure_axis(result["residuals"], key, predicted, scale, unit),
            "margin": {"l": 56, "r": 10, "t": 30 if position else 6, "b": 22 if position else 40},
            "showlegend": position,
            "legend": {"orientation": "h", "y": 1.16, "x": 0},
        },
        size="close" if position else "close short",
    )


def _expected_trace(result: Mapping[str, Any], below: Floats, unit: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": [r["pose"] for r in result["residuals"]],
        "y": packed(below),
        "line": {"color": MUTED, "width": 1.5, "dash": "dot", "shape": "hvh"},
        "name": "95 % below, by the noise",
        "hovertemplate": f"95 % are below %{{y:.3g}} {unit}<extra></extra>",
    }


def _closure(residual: Mapping[str, Any], key: str) -> float | None:
    """The residual with this pose left out, where there is one; else as fitted [m | rad]."""
    unit = "m" if key == "position" else "rad"
    left_out = residual[f"{key}_left_out_{unit}"]
    found: float | None = left_out if left_out is not None else residual[f"{key}_{unit}"]
    return found


def _residual_traces(result: Mapping[str, Any], key: str, scale: float, unit: str) -> list[dict[str, Any]]:
    kept = [r for r in result["residuals"] if not r["rejected"]]
    groups = (
        (
            "fitted" if "kinematics" in result else "left out",
            AFTER,
            "circle",
            [r for r in kept if r["set"] == "train"],
        ),
        ("held out", HELD_OUT, "diamond", [r for r in kept if r["set"] == "test"]),
        ("rejected", REJECTED, "x", [r for r in result["residuals"] if r["rejected"]]),
    )
    traces = []
    for name, colour, symbol, chosen in groups:
        if chosen:
            values = [_closure(r, key) for r in chosen]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": [r["pose"] for r in chosen],
                    "y": [None if v is None else scale * v for v in values],
                    "name": name,
                    "marker": {
                        "color": colour,
                        "size": 8 if name != "rejected" else 9,
                        "symbol": symbol,
                        "opacity": 0.85,
                    },
                    "text": [escaped(_hover(r)).replace("\n", "<br>") for r in chosen],
                    "hovertemplate": f"%{{text}}<br>%{{y:.3g}} {unit}<extra>{name}</extra>",
                }
            )
    return traces


def _closure_axis(
    residuals: Sequence[Mapping[str, Any]], key: str, predicted: Floats | None, scale: float, unit: str
) -> dict[str, Any]:
    """Linear from zero; logarithmic where gross poses would press the others to the floor."""
    every = [(_closure(r, key), r["rejected"]) for r in residuals]
    usual = [scale * value for value, rejected in every if not rejected and value is not None]
    known = np.empty(0) if predicted is None else predicted[np.isfinite(predicted)]
    most = max([1e-9, *usual, *(known * scale).tolist()])
    top = max([scale * value for value, _ in every if value is not None] or [most])
    if top <= 6 * most:
        return {"title": {"text": unit}, "rangemode": "tozero"}
    low = max(1e-6, min([v for v in usual if v > 0] or [most]) / 1.5)
    return {
        "title": {"text": unit},
        "type": "log",
        "range": [math.log10(low), math.log10(1.6 * top)],
        "dtick": 1,
    }


def _hover(r: Mapping[str, Any]) -> str:
    text = f"pose {r['pose']}" + (f" · {r['image']}" if r.get("image") else "")
    return text + (f"\n{r['cause']}" if r["cause"] else "")


def _trust(result: Mapping[str, Any]) -> str:
    """Checks in words, each good, worth a look, or bad; the worst of them is the verdict."""
    checks = [
        _enough_poses(result),
        _different_axes(result["observability"]),
        *_held_out(result["errors"]),
        _noise_found(result["noise"]),
        *_against_noise(result),
        _rejected(result),
        *_remarks(result),
    ]
    return trust_card(
        checks, ("You can trust this", "Usable, but look at the marked points", "Do not rely on this yet")
    )


def _enough_poses(result: Mapping[str, Any]) -> Check:
    fitted = result["errors"]["train"]["n"]
    grade = GOOD if fitted >= FEW_POSES else LOOK if fitted >= TOO_FEW_POSES else BAD
    head = ("Enough poses", "Few poses", "Very few poses")[grade]
    return Check(grade, head, f"{fitted} of {result['poses']} in the fit")


def _different_axes(seen: Mapping[str, Any]) -> Check:
    spread = seen["axes_spread"] or 0.0
    grade = GOOD if spread > FLAT_AXES else LOOK if spread > ONE_AXIS else BAD
    head = (
        "The hand was turned about different axes",
        "The hand was turned mostly about one axis",
        "The hand was turned about one axis",
    )[grade]
    return Check(
        grade,
        head,
        f"rotation about the second axis is {_percent(spread)} of that about the first, singular gap"
        f" {figures_text(min(seen['gap'] or 0.0, 1e9), 2)}",
    )


def _held_out(errors: Mapping[str, Any]) -> list[Check]:
    if "test" not in errors or not errors["test"]["n"]:
        return []
    known = errors.get("left_out", {}).get("rms_m") is not None
    reference = errors["left_out" if known else "train"]
    ratio = errors["test"]["rms_m"] / reference["rms_m"] if reference["rms_m"] else 1.0
    grade = grade_of(ratio, WORSE_THAN_NOISE, 3)
    head = (
        "Held-out poses are as good as fitted ones",
        "Held-out poses are somewhat worse",
        "Held-out poses are much worse",
    )[grade]
    text = (
        f"{length_text(errors['test']['rms_m'])} rms over {counted(errors['test']['n'], 'held-out pose')},"
        f" {length_text(reference['rms_m'])} {'left out' if known else 'fitted'}"
    )
    return [Check(grade, head, text)]


def _noise_found(noise: Mapping[str, Any]) -> Check:
    source = "found from the data" if noise["estimated"] else "as given"
    by_both = noise["camera_rad"] is not None or noise["pixel"] is not None
    rotation = [f"{'robot ' if by_both else ''}±{_mrad(noise['hand_rad'])}"]
    rotation += [f"camera ±{_mrad(noise['camera_rad'])}"] if noise["camera_rad"] else []
    rotation += [f"images ±{_pixels_text(noise['pixel'])}"] if noise["pixel"] is not None else []
    whose = "the robot" if noise["pixel"] is not None else "robot and camera"
    return Check(
        GOOD,
        f"Noise of {whose} ±{length_text(noise['position_m'])}",
        f"per component, {source}; in rotation {', '.join(rotation)}",
    )


def _against_noise(result: Mapping[str, Any]) -> list[Check]:
    usual = [
        r["distance"]
        for r in result["residuals"]
        if not r["rejected"] and r["set"] == "train" and r["distance"] is not None
    ]
    if not usual or result["noise"]["estimated"]:
        return []
    rms = math.sqrt(sum(d * d for d in usual) / len(usual))
    grade = grade_of(rms, WORSE_THAN_NOISE, 3)
    head = (
        "Residuals are what the noise predicts",
        "Residuals are larger than the noise predicts",
        "Residuals are much larger than the noise predicts",
    )[grade]
    return [Check(grade, head, f"{figures_text(rms, 2)} times")]


def _rejected(result: Mapping[str, Any]) -> Check:
    rejected = len(result["rejected_poses"])
    if rejected == 0:
        return Check(GOOD, "No pose rejected", "all fit each other")
    share = rejected / max(1, result["poses"])
    which = ", ".join(str(p["pose"]) for p in result["rejected_poses"][:10])
    return Check(
        LOOK if share <= MANY_REJECTED else BAD,
        f"{counted(rejected, 'pose')} rejected",
        f"they do not fit the others: {which}" + (" …" if rejected > 10 else ""),
    )


def _remarks(result: Mapping[str, Any]) -> list[Check]:
    """What is worth a look without being measured."""
    checks = []
    images = result.get("images")
    if images and images["not_found"]:
        missing = images["not_found"]
        checks.append(
            Check(
                LOOK,
                f"The board was not found in {counted(len(missing), 'image')}",
                escaped(", ".join(missing[:4])) + (" …" if len(missing) > 4 else ""),
            )
        )
    if result["convention"]["reading"]:
        explanation = escaped(result["convention"]["explanation"])
        checks.append(Check(LOOK, "Read otherwise than the file says", explanation))
    if result["method"] == "closed-form":
        text = "all poses count alike; the refined method is more accurate"
        checks.append(Check(LOOK, "Closed form alone", text))
    for warning in result.get("warnings", [])[:2]:
        if "was not found in" not in warning:
            checks.append(Check(LOOK, "Warning", shortened(warning, 150, 140)))
    return checks


# ---- The scene -----------------------------------------------------------------------------------


def _scene(page: Page, result: Mapping[str, Any], scene: Scene) -> None:
    page.add('<section class="card"><h2>The scene</h2>')
    count = len(scene.T_base_hand)
    pick = subsample(np.arange(count), SCENE_POSES)
    drawing = _Drawing(result, scene, pick)
    drawing.add_triads()
    drawing.add_cameras()
    words = drawing.add_boards()
    drawing.plot.draw(page, eye=(1.25, -1.25, 0.75), size="cloud scene")
    less = f" {counted(len(pick), 'pose')} drawn of {count}." if len(pick) < count else ""
    page.add(
        '<p class="note">Robot base and hands as triads (x red, y green, z blue),'
        f" {'cameras' if drawing.eye_in_hand else 'camera'} dark, boards as the camera saw them orange, and"
        f" as they are predicted blue.{words}{less}</p></section>"
    )


class _Drawing:
    """Robot, camera and boards, as they are added to the scene."""

    def __init__(self, result: Mapping[str, Any], scene: Scene, pick: NDArray[np.integer[Any]]) -> None:
        self.plot = Scene3d()
        self.eye_in_hand = result["setup"] == "eye-in-hand"
        self._residuals = [result["residuals"][k] for k in pick]
        self._rejected = np.array([r["rejected"] for r in self._residuals], dtype=bool)
        self._hands, self._cameras = scene.T_base_hand[pick], scene.T_base_camera[pick]
        self._seen, self._boards = scene.T_base_board_seen[pick], scene.T_base_board[pick]
        self._outline = _outline(scene.board_m)
        places = [self._hands[:, :3, 3], self._cameras[:, :3, 3], self._boards[:, :3, 3], np.zeros((1, 3))]
        self._extent = float(np.ptp(np.concatenate(places), axis=0).max()) or 1.0

    def _add_lines(
        self, pieces: Sequence[Floats], colour: str, name: str, width: float, opacity: float = 1.0
    ) -> None:
        self.plot.add_line(polyline(pieces), name, colour, width, opacity=opacity)

    def add_triads(self) -> None:
        """Robot base and hands."""
        for axis, colour in enumerate(TRIADS):
            arms = [_arm(frame, axis, 0.035 * self._extent) for frame in self._hands]
            self._add_lines(arms, colour, f"hand, {'xyz'[axis]}", 2.5, 0.75)
            base = [_arm(np.eye(4), axis, 0.13 * self._extent)]
            self._add_lines(base, colour, f"robot base, {'xyz'[axis]}", 5)
        self.plot.add_points(
            self._hands[:, :3, 3],
            "hand",
            3.0,
            [REJECTED if out else INK for out in self._rejected],
            texts=[_hover(r) for r in self._residuals],
        )

    def add_cameras(self) -> None:
        if self.eye_in_hand:
            frusta = [_frustum(frame, 0.05 * self._extent) for frame in self._cameras]
            self._add_lines(frusta, INK, "camera", 1.5, 0.55)
        else:
            frusta = [_frustum(frame, 0.1 * self._extent) for frame in self._cameras[:1]]
            self._add_lines(frusta, INK, "camera", 3)

    def add_boards(self) -> str:
        """Boards as predicted and as seen; in words, what strokes between them mean."""
        shown = np.isfinite(self._seen[:, 0, 0])
        every = np.arange(len(self._boards))
        some = np.isin(every, subsample(every, SCENE_BOARDS))  # boards one over the other show nothing
        predicted = self._boards[:1] if self.eye_in_hand else self._boards[some]
        outlines = [_moved(frame, self._outline) for frame in predicted]
        self._add_lines(outlines, AFTER, "board, predicted", 3, 0.95)
        if not shown.any():
            return ""
        outlines = [_moved(frame, self._outline) for frame in self._seen[shown & some]]
        self._add_lines(outlines, SEEN, "board, seen", 1.5, 0.6)
        start = self._boards[shown, :3, 3]
        off = self._seen[shown, :3, 3] - start
        good = ~self._rejected[shown]
        longest = float(np.quantile(np.linalg.norm(off[good] if good.any() else off, axis=1), 0.9)) or 1e-9
        factor = round_down(0.05 * self._extent / longest)
        if factor <= 1:
            return ""
        strokes = [np.stack([start[k], start[k] + factor * off[k]]) for k in np.flatnonzero(good)]
        self._add_lines(strokes, REJECTED, f"seen less predicted, × {factor:g}", 2.5)
        return f" Red strokes: from the predicted to the seen board origin, enlarged {factor:g} times."


def _arm(frame: Floats, axis: int, length: float) -> Floats:
    return np.stack([frame[:3, 3], frame[:3, 3] + length * frame[:3, axis]])


def _moved(frame: Floats, points: Floats) -> Floats:
    return np.asarray(points @ frame[:3, :3].T + frame[:3, 3])


def _frustum(frame: Floats, size: float) -> Floats:
    """A camera as one line: a pyramid that opens along z, with a mark at its upper edge."""
    a, b, c, d = (np.array([x * 0.6, y * 0.45, 1.0]) * size for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    o = np.zeros(3)
    mark = np.array([0.0, -0.7, 1.0]) * size
    return _moved(frame, np.stack([o, a, mark, b, o, c, b, a, d, o, d, c]))


def _outline(board: tuple[float, float, float, float]) -> Floats:
    """The board's edge, from its origin and back: a stroke to the middle tells the origin's corner."""
    left, top, right, bottom = board
    middle = [0.65 * left + 0.35 * right, 0.65 * top + 0.35 * bottom, 0.0]
    return np.array(
        [
            [left, top, 0.0],
            [right, top, 0.0],
            [right, bottom, 0.0],
            [left, bottom, 0.0],
            [left, top, 0.0],
            middle,
        ]
    )


def _directions(page: Page, result: Mapping[str, Any]) -> None:
    """Error of the working point by direction."""
    parent, point = result["camera"]["in"], result["working_point"]
    covariance = np.array(point["covariance_m2"])
    names = [f"{parent} {axis}" for axis in "xyz"] + [
        "(" + ", ".join(f"{v:+.1f}".replace("-", "−") for v in p["axis"]) + ")" for p in point["principal"]
    ]
    values = [1e3 * math.sqrt(max(0.0, covariance[k, k])) for k in range(3)] + [
        1e3 * p["sigma_m"] for p in point["principal"]
    ]
    page.add('<section class="card"><h2>Error of the working point, by direction</h2>')
    page.chart(
        "directions",
        [
            {
                "type": "bar",
                "orientation": "h",
                "y": names,
                "x": values,
                "marker": {"color": [AFTER] * 3 + [faded(AFTER, 0.55)] * 3},
                "hovertemplate": "%{y}: ± %{x:.3g} mm<extra></extra>",
            }
        ],
        {
            "xaxis": {"title": {"text": "one standard error [mm]"}, "rangemode": "tozero"},
            "yaxis": {"autorange": "reversed", "type": "category", "ticks": "", "dtick": 1},
            "bargap": 0.3,
            "margin": {"l": 110, "r": 12, "t": 4, "b": 40},
        },
        size="bars",
    )
    page.add("</section>")


def _frames(result: Mapping[str, Any]) -> str:
    """Camera and board, number by number."""
    parts = []
    for what in ("camera", "board"):
        frame = result[what]
        digits = _decimals(frame["sigma"])
        body = "".join(
            f"<tr><th>{axis}</th><td>{_millimetres(frame[f'{axis}_m'], digits)} mm</td><td>±"
            f" {length_text(frame['sigma'][f'{axis}_m'])}</td><td>±"
            f" {_mrad(frame['sigma'][f'r{axis}_rad'])}</td></tr>"
            for axis in "xyz"
        )
        q = " ".join(f"{frame[name]:+.6f}".replace("-", "−") for name in ("qw", "qx", "qy", "qz"))
        parts.append(
            f"<h3>{what.capitalize()} in the {frame['in']}</h3>"
            '<div class="scroll"><table'
            ' class="narrow"><thead><tr><th></th><th>position</th><th></th><th>turned about'
            " it</th></tr></thead>"
            f'<tbody>{body}</tbody></table></div><p class="note">quaternion w x y z: {q}</p>'
        )
    return (
        f'<section class="card"><h2>The frames</h2>{"".join(parts)}<p class="note">One standard error. The'
        " covariances are in result.json.</p></section>"
    )


def _compared(result: Mapping[str, Any]) -> str:
    """The answers of other programs, and how far the loop closes with each."""
    rows = []
    for other in result.get("compared", ()):
        closes = [other[name] for name in ("closure", "closure_of_ours")]
        cells = "".join(
            "<td></td>"
            if one is None
            else f"<td>{length_text(one['rms_m'])}, {_mrad(one['rotation_rms_rad'])}</td>"
            for one in closes
        )
        sigmas = other["largest_sigmas"]
        rows.append(
            f"<tr><th>{escaped(Path(other['file']).name)}<br>{escaped(other['tool'])}</th>"
            f"<td>{length_text(other['position_m'])}, {_mrad(other['rotation_rad'])}</td>"
            f"<td>{'' if sigmas is None else figures_text(sigmas, 2) + ' σ'}</td>{cells}"
            f"<td>{escaped(other['remark'])}</td></tr>"
        )
    if not rows:
        return ""
    return (
        '<section class="card"><h2>Beside other programs</h2><div class="scroll"><table class="narrow">'
        "<thead><tr><th></th><th>away from ours</th><th>largest component</th><th>closure with theirs</th>"
        f"<th>with ours</th><th></th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
        f'<p class="note">Over {counted(result["compared"][0]["poses"], "pose")}, the board put where it fits'
        " each camera best. The largest component is in our standard errors.</p></section>"
    )


# ---- What it rests on ----------------------------------------------------------------------------


def _observability(page: Page, result: Mapping[str, Any]) -> None:
    seen = result["observability"]
    page.add('<section class="card"><h2>What the motions show</h2>')
    values = [v for v in seen["singular_values"] if v is not None]
    if len(values) == 8 and max(values) > 0:
        floor = max(values) * 1e-16
        page.chart(
            "singular",
            [
                {
                    "type": "bar",
                    "x": [str(k + 1) for k in range(8)],
                    "y": [max(floor, v) for v in values],
                    "marker": {"color": [AFTER] * 6 + [BEFORE] * 2},
                    "hovertemplate": "%{x}: %{y:.3g}<extra></extra>",
                }
            ],
            {
                "xaxis": {"title": {"text": "singular value"}, "type": "category"},
                "yaxis": {"type": "log", "dtick": 2, "exponentformat": "power"},
                "bargap": 0.35,
            },
            size="pane",
        )
    gap = seen["gap"]
    clear = "" if gap is None else f" They stand apart by a factor of {figures_text(min(gap, 1e9), 2)}."
    page.add(
        '<p class="note">Of the eight singular values of the motions, six say what is known; the last two'
        f" (light) are 0 but for noise.{clear} Rotation about the second axis is "
        f"{_percent(seen['axes_spread'])} of that about the first.</p>"
    )
    if result["status"] == "done" and seen["unobservable"]:
        items = "".join(
            f"<li><b>{escaped(_sentence(u['what'], False))}</b>: {escaped(u['advice'])}</li>"
            for u in seen["unobservable"]
        )
        page.add(f'<ul class="plain">{items}</ul>')
    page.add("</section>")


def _noise(result: Mapping[str, Any]) -> str:
    rows = []
    noise, errors = result.get("noise"), result.get("errors", {})
    if noise:
        by_pixels, by_camera = noise["pixel"] is not None, bool(noise["camera_rad"])
        rows.append(
            f"<tr><th>noise of {'the robot' if by_pixels else 'robot and camera together'}, position, per"
            f" axis</th><td>{length_text(noise['position_m'])}</td></tr>"
        )
        rows.append(
            f"<tr><th>noise {'of the robot' if by_pixels or by_camera else 'of both'}, rotation, per"
            f" axis</th><td>{_mrad(noise['hand_rad'])}</td></tr>"
        )
        if by_camera:
            rows.append(
                f"<tr><th>noise of the camera{' beyond its pixels' if by_pixels else ''}, rotation, per"
                f" axis</th><td>{_mrad(noise['camera_rad'])}</td></tr>"
            )
        if by_pixels:
            rows.append(f"<tr><th>noise of the images</th><td>{_pixels_text(noise['pixel'])}</td></tr>")
    for name, label in (
        ("train", "closure, fitted poses, rms"),
        ("left_out", "closure, each left out, rms"),
        ("test", "closure, held-out poses, rms"),
    ):
        if name in errors and errors[name]["n"]:
            e = errors[name]
            pixels = f", {_pixels_text(e['rms_px'])}" if e.get("rms_px") is not None else ""
            rows.append(
                f"<tr><th>{label}</th><td>{length_text(e['rms_m'])},"
                f" {_mrad(e['rotation_rms_rad'])}{pixels}</td></tr>"
            )
            rows.append(
                f'<tr><th class="in">95 % are below, worst</th><td>{length_text(e["p95_m"])},'
                f" {length_text(e['max_m'])}</td></tr>"
            )
    scale = result.get("board_scale")
    if scale and scale["sigma"] is not None:
        rows.append(
            f"<tr><th>board's lengths that fit best</th><td>{figures_text(scale['value'], 5)} ±"
            f" {figures_text(scale['sigma'], 2)} times as told</td></tr>"
        )
    convention = result["convention"]
    rows.append(
        f"<tr><th>read</th><td class=wrap>{escaped(convention['explanation'] or convention['reading'])},"
        f" {escaped(convention['orientation'])}</td></tr>"
    )
    clock = result.get("clock")
    if clock:
        text = (
            f"t_hand = t_camera {'+' if clock['offset_s'] >= 0 else '−'} {abs(clock['offset_s']) * 1e3:.2f}"
            f" ms (± {figures_text((clock['sigma_s'] or 0) * 1e3, 2)})"
            if clock["found"]
            else escaped(clock["message"])
        )
        rows.append(f"<tr><th>clocks</th><td>{text}</td></tr>")
    solver = result.get("solver")
    if solver and solver["name"]:
        rows.append(
            f"<tr><th>solver</th><td class=wrap>{escaped(solver['name'])},"
            f" {counted(solver['iterations'], 'iteration')}: {escaped(solver['stopped_because'])}</td></tr>"
        )
    return (
        '<section class="card"><h2>What it rests on</h2><div class="scroll"><table'
        f' class="facts"><tbody>{"".join(rows)}</tbody></table></div></section>'
    )


def _kinematics(result: Mapping[str, Any]) -> str:
    k = result.get("kinematics")
    if not k:
        return ""
    rows = []
    for name, label in (("train", "fitted poses"), ("test", "held-out poses")):
        if name in k["errors"]:
            before, after = k["errors"][name]["before"], k["errors"][name]["after"]
            rows.append(
                f"<tr><th>{label}, {counted(after['n'], 'pose')}</th><td><span"
                f' class="before">{length_text(before["rms_m"])},'
                f" {_mrad(before['rotation_rms_rad'])}</span></td><td><span"
                f' class="after">{length_text(after["rms_m"])},'
                f" {_mrad(after['rotation_rms_rad'])}</span></td></tr>"
            )
    parameters = []
    for p in k["parameters"]:
        if p["frozen"] or p["sigma"] is None:
            continue
        scale, unit = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(
            p["unit"], (1.0, "" if p["unit"] == "-" else p["unit"])
        )
        change, sigma = p["value"] - p["nominal"], p["sigma"]
        times = min(99999.0, abs(change) / sigma) if sigma else 0.0
        parameters.append(
            f"<tr><th>{escaped(p['name'])}</th>"
            + table_cell(change, f"{change * scale:+.4g} {unit}".replace("-", "−"))
            + table_cell(sigma, f"± {figures_text(sigma * scale, 2)} {unit}")
            + table_cell(times, f"{figures_text(times, 2)} σ")
            + "</tr>"
        )
    heading = "".join(
        f'<th><button type="button">{h}</button></th>'
        for h in ("parameter", "change", "standard error", "significance")
    )
    return (
        f'<section class="card"><h2>Camera and robot together</h2><p class="lead">An arm that is off its'
        f" model puts its error into the camera. Found in one problem: camera, board, and "
        f"{counted(k['rank'], 'value')} of {escaped(k['robot'])} (robot.yaml).</p>"
        '<div class="scroll"><table class="narrow"><thead><tr><th>closure, rms</th><th>nominal'
        f" robot</th><th>calibrated</th></tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
        '<details class="fold"><summary>What changed in the robot</summary><div class="scroll"><table'
        f' class="sortable"><thead><tr>{heading}</tr></thead><tbody>{"".join(parameters)}</tbody></table>'
        "</div></details></section>"
    )


def _pixels(page: Page, result: Mapping[str, Any], scene: Scene) -> None:
    page.add('<div class="pair"><section class="card"><h2>What is left in the images</h2>')
    error, place = scene.pixel_errors, scene.pixel_places
    limit = float(np.quantile(np.abs(error), 0.995)) * 1.2 or 1.0
    page.chart(
        "reprojection",
        [
            {
                "type": "scatter",
                "mode": "markers",
                "x": packed(error[:, 0]),
                "y": packed(error[:, 1]),
                "marker": {"size": 4, "color": AFTER, "opacity": 0.35},
                "hovertemplate": "%{x:.2f}, %{y:.2f} px<extra></extra>",
            }
        ],
        {
            "xaxis": {"title": {"text": "to the right [px]"}, "range": [-limit, limit]},
            "yaxis": {"title": {"text": "down [px]"}, "range": [limit, -limit], "scaleanchor": "x"},
        },
        size="tall",
    )
    rms = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    page.add(
        f'<p class="note">Seen less predicted, robot poses as found: {figures_text(rms, 2)} px rms. A round'
        " cloud about 0 is good.</p></section>"
    )
    page.add('<section class="card"><h2>Where in the image</h2>')
    width, height = result["images"]["camera"]["width"], result["images"]["camera"]["height"]
    size = np.linalg.norm(error, axis=1)
    top = float(np.quantile(size, 0.98)) or 1.0
    page.chart(
        "places",
        [
            {
                "type": "scatter",
                "mode": "markers",
                "x": packed(place[:, 0]),
                "y": packed(place[:, 1]),
                "marker": {
                    "size": 4,
                    "color": packed(size),
                    "colorscale": "Viridis",
                    "reversescale": True,
                    "cmin": 0,
                    "cmax": top,
                    "colorbar": {"title": {"text": "px"}, "thickness": 12},
                },
                "hovertemplate": "%{marker.color:.2f} px<extra></extra>",
            }
        ],
        {
            "xaxis": {"range": [0, width], "constrain": "domain", "title": {"text": "[px]"}},
            "yaxis": {"range": [height, 0], "scaleanchor": "x", "constrain": "domain"},
        },
        size="tall",
    )
    page.add(
        '<p class="note">The whole image should be covered. Errors that grow towards the corners say that the'
        " lens is not described well.</p></section></div>"
    )


def _images(result: Mapping[str, Any]) -> str:
    images = result.get("images")
    if not images:
        return ""
    camera = images["camera"]
    sigma = camera.get("sigma") or {}
    values = dict(zip(("k1", "k2", "p1", "p2", "k3"), camera["distortion"]["coefficients"], strict=True)) | {
        name: camera[name] for name in ("fx", "fy", "cx", "cy")
    }
    cells = []
    for name in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"):
        text = f"{values[name]:.2f} px" if name[0] in "fc" else f"{values[name]:+.4f}"
        error = "" if sigma.get(name) is None else "± " + figures_text(sigma[name], 2)
        cells.append(f"<tr><th>{name}</th><td>{text}</td><td>{error}</td></tr>")
    how = (
        "refined together with the camera's pose"
        if images.get("camera_refined")
        else "as given"
        if images["camera_given"]
        else "found from these images"
    )
    worst = sorted(
        (r for r in result["residuals"] if r.get("pixels") is not None), key=lambda r: -r["pixels"]
    )[:WORST_IMAGES]
    body = "".join(
        f"<tr><th>{escaped(r['image'])}</th><td>{r['pose']}</td>"
        f"{table_cell(r['pixels'], _pixels_text(r['pixels']))}"
        f"{table_cell(r['pixels_corrected'] or 0, _pixels_text(r['pixels_corrected']))}"
        f"<td>{escaped(r['cause']) if r['rejected'] else ''}</td></tr>"
        for r in worst
    )
    missing = (
        f'<p class="note">Board not found in: {escaped(", ".join(images["not_found"][:LISTED]))}.</p>'
        if images["not_found"]
        else ""
    )
    return (
        '<div class="pair"><section class="card"><h2>Worst images</h2><div'
        ' class="scroll"><table><thead><tr><th>image</th><th>pose</th><th>robot as reported</th><th>robot as'
        f" found</th><th></th></tr></thead><tbody>{body}</tbody></table></div>{missing}</section><section"
        f' class="card"><h2>The camera itself <span class="muted">{how}</span></h2><div class="scroll"><table'
        f' class="narrow"><tbody>{"".join(cells)}</tbody></table></div><p class="note">Board'
        f" {escaped(images['board'])}, found in {counted(images['found'], 'image')}.</p></section></div>"
    )


def _next(result: Mapping[str, Any]) -> str:
    poses = result["next_poses"]
    if not poses:
        return ""
    body = "".join(
        f"<tr><th>{k + 1}</th>"
        + "".join(f"<td>{1e3 * p[f'{axis}_m']:.1f}</td>".replace("-", "−") for axis in "xyz")
        + "".join(f"<td>{p[name]:+.4f}</td>".replace("-", "−") for name in ("qw", "qx", "qy", "qz"))
        + f"<td>± {length_text(p['working_point_sigma_m'])}</td></tr>"
        for k, p in enumerate(poses[:LISTED])
    )
    now = (
        f" Now it is known to ±{length_text(result['working_point']['sigma_m'])}."
        if "working_point" in result
        else ""
    )
    return (
        '<section class="card"><h2>Measure next</h2><p class="lead">Hand poses that shrink the error at the'
        f" working point most, one after the other.{now} Look whether the robot can go there without touching"
        ' anything.</p><div class="scroll"><table><thead><tr><th>#</th><th>x'
        " [mm]</th><th>y</th><th>z</th><th>qw</th><th>qx</th><th>qy</th><th>qz</th><th>working point"
        f' then</th></tr></thead><tbody>{body}</tbody></table></div><p class="note">Also in'
        " next_poses.csv.</p></section>"
    )


def _poses(result: Mapping[str, Any]) -> str:
    residuals = result["residuals"]
    if not residuals:
        return ""
    images, alone = any("image" in r for r in residuals), "kinematics" not in result
    ordered = sorted(residuals, key=lambda r: (not r["rejected"], -(r["distance"] or 0.0)))
    body = []
    for r in ordered[:LISTED]:
        cells = f"<td>{escaped(r['image'])}</td>" if images else ""
        cells += f"<td>{'held out' if r['set'] == 'test' else 'rejected' if r['rejected'] else ''}</td>"
        position, rotation = (
            r[f"{key}_left_out_{unit}"] if alone else r[f"{key}_{unit}"]
            for key, unit in (("position", "m"), ("rotation", "rad"))
        )
        cells += table_cell(position or 0, length_text(position)) + table_cell(rotation or 0, _mrad(rotation))
        if images:
            cells += table_cell(r["pixels"] or 0, _pixels_text(r["pixels"]))
        cells += (
            table_cell(r["distance"] or 0, "–" if r["distance"] is None else figures_text(r["distance"], 2))
            + f'<td class="wrap">{escaped(r["cause"])}</td>'
        )
        body.append(
            f"<tr{' class=missed' if r['rejected'] else ''}><th"
            f' data-v="{r["pose"]}">{r["pose"]}</th>{cells}</tr>'
        )
    head = [
        "pose",
        *(["image"] if images else []),
        "",
        "left out, position" if alone else "closure, position",
        "rotation",
        *(["image error"] if images else []),
        "over its noise",
        "looks like",
    ]
    heading = "".join(f'<th><button type="button">{h}</button></th>' for h in head)
    more = (
        f'<p class="note">The {LISTED} worst of {len(residuals)}; residuals.csv has all.</p>'
        if len(residuals) > LISTED
        else ""
    )
    return (
        '<section class="card"><h2>Every pose</h2><div class="scroll"><table'
        f' class="sortable"><thead><tr>{heading}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        f"</div>{more}</section>"
    )


# ---- Words ---------------------------------------------------------------------------------------


def _sentence(text: str, stop: bool = True) -> str:
    text = text.strip()
    text = text[:1].upper() + text[1:]
    return text if not stop or text.endswith((".", "?", "!")) else text + "."


def _mrad(radians: float | None) -> str:
    if radians is None:
        return "–"
    return (
        angle_text(radians) if abs(radians) >= math.radians(2) else f"{figures_text(1e3 * radians)}\u202fmrad"
    )


def _pixels_text(pixels: float | None) -> str:
    return "–" if pixels is None else f"{figures_text(pixels, 2)}\u202fpx"


def _decimals(sigma: Mapping[str, float | None]) -> int:
    """Of positions in mm: as many as their standard errors have meaning."""
    least = min((value for value in (sigma[f"{axis}_m"] for axis in "xyz") if value), default=None)
    return 2 if least is None else min(4, max(0, 1 - math.floor(math.log10(1e3 * least))))


def _millimetres(metres: float, decimals: int) -> str:
    return f"{1e3 * metres:.{decimals}f}".replace("-", "−")


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"
