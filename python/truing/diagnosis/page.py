# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of ``truing diagnose``, in the order in which people ask.

The first screen: the verdict in a sentence, what the gap is made of, and where it shows. Below: every effect
with the law drawn through what single poses say; what is unknown; what could not be told apart, tested or
seen; what to measure next.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.identification.page import workspace
from truing.report.charts import (
    AFTER,
    BEFORE,
    INK,
    MUTED,
    chart_over_rows,
    distribution_chart,
    faded,
    packed,
    points_trace,
)
from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.rows import Rows
from truing.report.scene import RobotPicture
from truing.report.trust import GOOD, LOOK, Check, check_items
from truing.report.words import counted, escaped, figures_text, length_text, length_unit, sure_text

Floats = NDArray[np.float64]
# Of effects, most first; apart for colour-blind readers, and none is that of before, after, noise or the
# unexplained.
EFFECT_COLOURS = ("#2f6fb7", "#1b8a6b", "#8a5bb5", "#4aa3c7", "#6f8f2d", "#b0558f", "#3d5a80", "#7a9e9f")
UNKNOWN, UNEXPLAINED, LEFT, NOISE = "#c77d0a", "#c0392b", "#cf9d96", "#b8c0c9"
HEAT = [[0, "#fdf3d8"], [0.35, "#f6bd60"], [0.7, "#dd6b2f"], [1, "#8f1d1d"]]
FIRST_SCREEN = 5  # effects that the first screen has room for
BAR_WIDTH = 1200  # [px] of the stacked bar, about: what fits into its pieces
TILES = 6  # of the workspace, along its longest side
LONG_TABLE = 6  # parameters; more are folded away
LISTED = 60  # candidates and rows of other long tables
BAND = 2  # standard errors
STRUCTURE = 0.05  # where the test of what is left finds structure below it
MANY_OUTLIERS = 0.05  # of the rows: so many are no exceptions
CONTENDER = 0.25  # of a cause's probability: an alternative that must be reckoned with
FEW_PARAMETERS = 3  # more are no size that one can look at
READ_OTHERWISE = ("gravity_direction",)  # findings that change what is read
ALIKE = 0.05  # of the gap: inputs that explain as much as each other, within this
_TONES = {
    "no gap": "good",
    "explained": "found",
    "partly explained": "open",
    "not explained": "open",
    "does not hold": "bad",
}


def diagnosis_report(result: Mapping[str, Any], rows: Rows, robot: RobotPicture | None = None) -> str:
    """The report of ``truing diagnose``.

    Args:
        result: What ``result.json`` holds (format ``truing-diagnosis/1``).
        rows: Errors of every row before and after; `rejected`: rows that counted for little.
        robot: The robot and what was found, to be drawn.
    """
    page = Page(f"{result.get('robot') or 'Robot'}: diagnosis", part_of_page("diagnosis"))
    page.add(_headline(result, rows))
    page.add(_sanity(result))
    page.add(_parts(result))
    _where(page, result)
    _robot(page, rows, robot)
    page.add(_remarks(result))
    for number, effect in enumerate(result["effects"]):
        _effect(page, effect, number)
    for number, unknown in enumerate(result["unknown"]):
        _unknown(page, unknown, number)
    page.add(_next(result, rows))
    _before_and_after(page, result, rows)
    if result["verdict"] != "none":
        page.add(_detectable(result))
    if result["verdict"] != "none":
        page.add(_not_testable(result))
    page.add(_candidates(result))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


# ---- First screen --------------------------------------------------------------------------------
def _headline(result: Mapping[str, Any], rows: Rows) -> str:
    label = result["explained"]
    tone = _TONES[label]
    first, *rest = re.split(
        r"(?<=[.!?])\s+(?=[A-Z])", in_words(result, str(result["sentence"]).strip()), maxsplit=1
    )
    more = f'<p class="more">{escaped(rest[0])}</p>' if rest else ""
    size = ' class="long"' if len(first) > 75 else ""
    gap = result["gap"]
    floor = (
        f"{length_text(gap['noise_floor_m'])} is noise"
        f" ({'from repeated poses' if gap['noise_from_repeats'] else 'what a flexible fit leaves'})"
        if gap["noise_floor_m"]
        else "of it what is noise is not known"
    )
    if result["verdict"] == "none":
        numbers = (
            f"<b>{length_text(gap['rms_m'])}</b> rms on held-out poses with only base and tool fitted;"
            f" {floor}."
        )
    else:
        fall = _fall(result)
        numbers = (
            "Rms error on held-out poses: <span"
            f' class="before">{length_text(gap["rms_m"])}</span>{" " + fall if fall else ""}; {floor}.'
        )
    return (
        f'<header><p class="kicker">truing diagnose · {escaped(result.get("robot"))} ·'
        f' {counted(rows.count, "row")}<span class="verdict'
        f' {tone}">{label}</span></p><h1{size}>{escaped(first)}</h1>{more}<p'
        f' class="sub">{numbers}{_left_out(result, rows)}</p>{_corrected(result)}</header>'
    )


def _left_out(result: Mapping[str, Any], rows: Rows) -> str:
    """Held-out rows that no error of the first screen counts."""
    count = int(np.count_nonzero(rows.rejected & rows.test))
    if not count or _many_outliers(result):
        return ""
    return f" Without {counted(count, 'held-out row')} far out."


def _corrected(result: Mapping[str, Any]) -> str:
    """What was read otherwise than it is written, a line each."""
    found = [f for f in result["sanity"] if f["kind"] in READ_OTHERWISE]
    return "".join(f'<p class="sub"><b>Corrected first:</b> {escaped(f["text"])}</p>' for f in found)


def _fall(result: Mapping[str, Any]) -> str:
    """How far the error falls: with the effects named, with free functions, and by the robot files where they
    differ.
    """
    gap, after, by_all, shrink = (
        result["gap"]["rms_m"] or 0.0,
        result["after"]["rms_m"] or 0.0,
        result["after_unknown"]["rms_m"],
        result["shrink"],
    )
    sure = f"90 % interval {_percent(shrink['ci'][0])} to {_percent(shrink['ci'][1])}"
    texts = []
    if result["effects"]:
        by_robot = gap * (1.0 - shrink["value"])
        same = abs(by_robot - after) <= 0.03 * after
        less = _less(1.0 - after / gap if gap else 0.0)
        texts.append(
            f'→ <span class="after">{length_text(after)}</span> with'
            f" {'what is' if len(result['effects']) > 1 else 'the effect'} named, {less}"
            + (f" ({sure})" if same else "")
        )
        if not same:  # drifts and corrections of laws are no part of a robot
            texts.append(f"{length_text(by_robot)} by robot.yaml alone, {_less(shrink['value'])} ({sure})")
    free, by_tables = _free(result), result["after_robot_with_unknown"]
    if free:
        same = by_tables and abs(by_tables["rms_m"] - by_all) <= 0.03 * by_all
        texts.append(
            f'{"" if texts else "→ "}<span class="after">{length_text(by_all)}</span> with'
            f" {'a free function' if len(free) == 1 else 'free functions'} "
            f"for what is unknown{'' if texts else ', not by anything known'}"
            + (" (robot_with_unknown.yaml)" if same else "")
        )
        if by_tables and not same:  # functions of time or order are no part of a robot
            texts.append(f"{length_text(by_tables['rms_m'])} by robot_with_unknown.yaml")
    return "; ".join(texts)


def _less(share: float) -> str:
    return f"{_percent(abs(share))} {'more' if share < 0.0 else 'less'}"


def _free(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Unknowns described by functions of the inputs; not what is only known to exceed the repeats."""
    return [unknown for unknown in result["unknown"] if unknown["inputs"]]


def trouble(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Findings about the data that make conclusions doubtful; the others of `sanity` say how the data were
    read.
    """
    calm = {"direction", "speed", *READ_OTHERWISE}
    if result["joint_record"] in ("", "q"):
        calm.add("joint_record")
    if not _many_outliers(result):
        calm.add("outliers")
    # A mistake is said by the headline.
    return [f for f in result["sanity"] if f["kind"] not in calm and not f.get("mistake")]


def _many_outliers(result: Mapping[str, Any]) -> bool:
    return bool(len(result["outliers"]) >= MANY_OUTLIERS * max(1, result["rows"]))


def _sanity(result: Mapping[str, Any]) -> str:
    """What is wrong with the data themselves comes before anything that was concluded from them."""
    items = [_finding(f) for f in trouble(result)]
    return (
        '<section class="card look"><h2>Look at the data first</h2><ul'
        f' class="plain">{"".join(items)}</ul></section>'
        if items
        else ""
    )


def _remarks(result: Mapping[str, Any]) -> str:
    """How the data were read."""
    troubles = trouble(result)
    items = [_finding(f) for f in result["sanity"] if f not in troubles and not f.get("mistake")]
    if any(f["kind"] == "direction" for f in result["sanity"]):
        items.append(
            "<li>What was inferred is in residuals.csv, columns dir1 …; where robot.yaml has backlash,"
            " predict infers them from the order of the rows as well.</li>"
        )
    return (
        '<section class="card"><h2>How the data were read</h2><ul'
        f' class="plain">{"".join(items)}</ul></section>'
        if items
        else ""
    )


def _finding(finding: Mapping[str, Any]) -> str:
    rows = finding["rows"]
    which = (
        f' <span class="muted">({"row" if len(rows) == 1 else "rows"} {_listed(rows, 12)}, from 0)</span>'
        if rows
        else ""
    )
    return f"<li>{escaped(_capital(finding['text']))}{which}</li>"


_COLUMNS = 4  # of the table of causes, after name and fraction


def _cause_pieces(result: Mapping[str, Any]) -> list[tuple[float, str, str, str]]:
    """Fraction, colour, name and the rest of the line of what was found, largest first."""
    parts = result["gap"]["parts"]
    pieces = []
    for number, (effect, share) in enumerate(zip(result["effects"], parts["effects"], strict=True)):
        line = _cause_cells(effect, " ".join(filter(None, (escaped(size_text(effect)), _or(effect)))))
        pieces.append((share, colour_of(number), _name(effect), line))
    for unknown, share in zip(result["unknown"], parts["unknown"], strict=True):
        looks = escaped(_angles(unknown["looks_like"])) or f"over {escaped(', '.join(unknown['inputs']))}"
        pieces.append((share, UNKNOWN, f"unknown {_at(unknown['joint'])}", _cause_cells(unknown, looks)))
    return sorted(pieces, key=lambda piece: -piece[0])


def _cause_cells(found: Mapping[str, Any], size: str) -> str:
    """How far it moves the tip, the error without it, how sure, its size."""
    seen = bool(found.get("inputs", True))  # what no function describes has no size
    cells = (
        length_text(found["size_at_tip_m"]) if seen else "–",
        length_text(found["held_out"]["before_rms_m"]) if seen else "–",
        _sure(found["probability"]),
        size,
    )
    return "".join(f"<td>{cell}</td>" for cell in cells)


def _parts(result: Mapping[str, Any]) -> str:
    """The gap as one bar, and in a line each what its pieces are."""
    parts = result["gap"]["parts"]
    pieces = _cause_pieces(result)
    causes = len(pieces)
    room = FIRST_SCREEN if len(pieces) > FIRST_SCREEN + 1 else len(pieces)
    more = pieces[room:]
    p, rest, noise = result["after"]["remaining_structure_p"], parts["unexplained"], parts["noise"]
    if (
        result["verdict"] == "none"
    ):  # a noise floor is an estimate: what chance makes of it is no part of its own
        rest, noise = 0.0, noise + rest
    if rest >= 0.005:
        structure = p is not None and p <= STRUCTURE
        said = (
            "more than noise, and nothing found explains it"
            if structure
            else "more than the noise, but no structure was found in it"
        )
        colour = UNEXPLAINED if structure else LEFT
        pieces.append((rest, colour, "not explained", f'<td colspan="{_COLUMNS}">{said}</td>'))
    pieces.append((noise, NOISE, "noise", f'<td colspan="{_COLUMNS}">of instrument and robot</td>'))
    bar, lines = [], []
    for share, colour, name, rest in pieces:
        text = next(
            (
                t
                for t in (f"{name} {_percent(share)}", _percent(share))
                if 9.5 * len(t) + 14 < share * BAR_WIDTH
            ),
            "",
        )
        bar.append(
            f'<div style="flex:{max(share, 0.004):.5f};background:{colour}" title="{name}:'
            f' {_percent(share)}"><span>{text}</span></div>'
        )
        if (share, colour, name, rest) not in more:
            lines.append(
                f'<tr><th><i style="background:{colour}"></i>{name}</th><td'
                f' class="share">{_percent(share)}</td>{rest}</tr>'
            )
    if more:
        names = "; ".join(dict.fromkeys(name for _, _, name, _ in more))
        lines.insert(
            room,
            f'<tr><th><i class="many"></i>{len(more)} smaller ones</th><td'
            f' class="share">{_percent(sum(share for share, _, _, _ in more))}</td><td class="names"'
            f' colspan="{_COLUMNS}">{names}</td></tr>',
        )
    head, note = (_PARTS_HEAD, _PARTS_NOTE) if causes else ("", "")
    said = "; ".join(f"{name} {_percent(share)}" for share, _, name, _ in pieces)
    return (
        f'<section class="card"><h2>What the gap of {length_text(result["gap"]["rms_m"])} is made of <span'
        ' class="muted">fractions of the mean square</span></h2><div class="stack" role="img"'
        f' aria-label="{said}">{"".join(bar)}</div><div class="scroll"><table'
        f' class="parts"><tbody>{head}{"".join(lines)}</tbody></table></div>{note}</section>'
    )


_PARTS_HEAD = (
    '<tr class="head"><th></th><th>of the gap</th><th>at the tip</th><th>without it</th><th></th>'
    "<th>size</th></tr>"
)
_PARTS_NOTE = (
    '<p class="note">Of the gap: fraction of the mean square that it closes, averaged over the orders in'
    " which causes may be added. At the tip: rms motion that it makes, beyond what base and tool could do as"
    " well. Without it: rms error on held-out poses with all others.</p>"
)


def _where(page: Page, result: Mapping[str, Any]) -> None:
    """Which joints, which inputs, which part of the workspace; without a gap, what would have been found
    instead.
    """
    where = result["where"]
    calm = result["verdict"] == "none"
    page.add(f'<div class="where{" calm" if calm else ""}">')
    if calm:
        page.add(_detectable(result, narrow=True))
    else:
        page.add('<section class="card"><h2>At which joints</h2>')
        joints = where["joints"]
        shares = np.array([w["share"] for w in joints], dtype=np.float64)
        ends = np.array([w["ci"] for w in joints], dtype=np.float64).reshape(-1, 2)
        page.chart(
            "where_joints",
            [_bars([w["joint"] for w in joints], shares, AFTER, ends)],
            _bar_layout(shares, ends),
            size="pane",
        )
        page.add(
            '<p class="note">Fraction of the gap that motion of this joint alone could close, 90 % interval.'
            " What joints do alike counts for each of them.</p></section>"
        )
        _goes_with(page, where)
    page.add('<div class="column"><section class="card"><h2>Where in the workspace</h2>')
    _workspace(page, where)
    page.add(f"</section>{_not_testable(result) if calm else ''}</div></div>")


def _robot(page: Page, rows: Rows, robot: RobotPicture | None) -> None:
    """The robot with what is wrong, enlarged, and the errors around it."""
    if robot is None:
        return
    head = "What it does to the robot" if robot.scene["causes"] else "The robot, and what is left"
    page.add(f'<section class="card"><h2>{head}</h2>')
    workspace(page, rows, robot)
    page.add("</section>")


def _goes_with(page: Page, where: Mapping[str, Any]) -> None:
    """Which inputs stand out. Poses vary all joints at once, and flexible functions of any input explain much
    of the gap: what tells is the difference.
    """
    inputs = sorted(where["inputs"], key=lambda w: -w["share"])
    shares = np.array([w["share"] for w in inputs], dtype=np.float64)
    floor = float(shares.min()) if len(inputs) > 1 else 0.0
    page.add('<section class="card"><h2>What it goes with</h2>')
    if len(inputs) > 1 and float(shares[0]) - floor < ALIKE:
        page.add(
            f"<p>Nothing stands out: each of the {len(inputs)} recorded inputs explains"
            f" {_percent(floor)} to {_percent(float(shares[0]))} of the gap.</p></section>"
        )
        return
    inputs, shares = inputs[:8], shares[:8]
    beyond = shares - floor
    page.chart(
        "where_inputs",
        [_bars([_input_name(w["input"], short=True) for w in inputs], beyond, MUTED, None)],
        _bar_layout(beyond, None),
        size="pane",
    )
    least = f" Each explains {_percent(floor)}; the bars show what it explains beyond that." if floor else ""
    page.add(f'<p class="note">Fraction of the gap that goes with what was recorded.{least}</p></section>')


def _bars(names: Sequence[str], shares: Floats, colour: str, ends: Floats | None) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "bar",
        "orientation": "h",
        "y": list(names),
        "x": [100 * float(share) for share in shares],
        "marker": {"color": colour},
        "hovertemplate": "%{y}: %{x:.0f} %<extra></extra>",
    }
    if ends is not None:
        trace["error_x"] = {
            "type": "data",
            "symmetric": False,
            "array": [100 * float(v) for v in np.maximum(0, ends[:, 1] - shares)],
            "arrayminus": [100 * float(v) for v in np.maximum(0, shares - ends[:, 0])],
            "color": INK,
            "thickness": 1.5,
            "width": 4,
        }
    return trace


def _bar_layout(shares: Floats, ends: Floats | None) -> dict[str, Any]:
    top = max([0.1, *shares.tolist(), *([] if ends is None else ends[:, 1].tolist())])
    step = next(s for s in (10, 25, 50) if 100 * min(1.0, top) <= 2.5 * s)
    return {
        "xaxis": {"range": [0, 105 * min(1.0, top)], "ticksuffix": " %", "dtick": step, "tickangle": 0},
        "yaxis": {"autorange": "reversed", "type": "category", "dtick": 1, "ticks": ""},
        "bargap": 0.35,
        "margin": {"l": 40, "r": 12, "t": 6, "b": 30},
    }


def _workspace(page: Page, where: Mapping[str, Any]) -> None:
    cells = where["workspace"]
    if not cells:
        page.add('<p class="note">No positions to draw.</p>')
        return
    center = np.array([c["center_m"] for c in cells], dtype=np.float64)
    count = np.array([c["n"] for c in cells], dtype=np.float64)
    square = np.array([c["rms_m"] for c in cells], dtype=np.float64) ** 2
    side = max(float(np.ptp(center, axis=0).max()) / TILES, 1e-6)
    views = [
        (view, second, *_tiles(center[:, [0, second]], square, count, side))
        for view, second in (("from above", 1), ("from the side", 2))
    ]
    limit = max(float(np.nanmax(rms)) for _, _, _, _, rms, _ in views) or 1e-9
    unit, scale = length_unit(limit)
    page.add('<div class="maps">')
    for view, second, x, y, rms, rows in views:
        shown = [[None if math.isnan(v) else round(float(v) * scale, 5) for v in line] for line in rms]
        text = [
            [
                f"{figures_text(float(v) * scale)} {unit}, {counted(int(n), 'row')}"
                for v, n in zip(*both, strict=True)
            ]
            for both in zip(rms, rows, strict=True)
        ]
        trace: dict[str, Any] = {
            "type": "heatmap",
            "x": x.tolist(),
            "y": y.tolist(),
            "z": shown,
            "text": text,
            "hoverinfo": "text",
            "hoverongaps": False,
            "colorscale": HEAT,
            "zmin": 0,
            "zmax": limit * scale,
            "xgap": 1,
            "ygap": 1,
            "showscale": second == 2,
        }
        if second == 2:
            trace["colorbar"] = {"title": {"text": unit}, "thickness": 10, "len": 1.0}
        page.chart(
            f"map{second}",
            [trace],
            {
                "title": {"text": view},
                "xaxis": {"title": {"text": "x [m]"}, "constrain": "domain", "nticks": 4, "tickangle": 0},
                "yaxis": {
                    "title": {"text": f"{'xyz'[second]} [m]"},
                    "scaleanchor": "x",
                    "constrain": "domain",
                    "nticks": 5,
                },
                "margin": {"l": 48, "r": 8, "t": 30, "b": 40},
            },
            size="pane",
        )
    page.add("</div>")
    axes = sorted(where["direction"], key=lambda d: -(d["rms_m"] or 0))
    largest, smallest = axes[0]["rms_m"] or 0.0, axes[-1]["rms_m"] or 0.0
    lie = (
        f" It is largest along {_axis(axes[0]['axis'])}, {length_text(largest)}, and smallest along"
        f" {_axis(axes[-1]['axis'])}, {length_text(smallest)}."
        if largest
        else ""
    )
    page.add(f'<p class="note">Rms of the gap, in the base frame of the robot.{lie}</p>')


def _tiles(
    places: Floats, square: Floats, count: Floats, side: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Cells that lie behind one another put together: centres of the tiles along both axes, rms and rows of
    each tile (NaN, 0: empty).
    """
    low = places.min(axis=0)
    at = np.minimum(np.floor((places - low) / side + 1e-9).astype(np.intp), TILES)
    shape = at.max(axis=0) + 1
    rows, total = np.zeros(shape[::-1]), np.zeros(shape[::-1])
    np.add.at(rows, (at[:, 1], at[:, 0]), count)
    np.add.at(total, (at[:, 1], at[:, 0]), count * square)
    rms = np.full(rows.shape, np.nan)
    np.divide(total, rows, out=rms, where=rows > 0)
    x, y = (low[k] + side * (np.arange(shape[k]) + 0.5) for k in range(2))
    return x, y, np.sqrt(rms), rows


def _axis(axis: Sequence[float]) -> str:
    """ "z", or the direction's numbers when it is between the axes."""
    most = max(range(3), key=lambda k: abs(axis[k]))
    return (
        "xyz"[most]
        if abs(axis[most]) > 0.95
        else "(" + ", ".join(_minus(f"{v if abs(v) >= 0.005 else 0.0:.2f}") for v in axis) + ")"
    )


# ---- What was found ------------------------------------------------------------------------------
def _effect(page: Page, effect: Mapping[str, Any], number: int) -> None:
    colour = colour_of(number)
    page.add(
        f'<section class="card"><h2><i class="dot" style="background:{colour}"></i>{_capital(_name(effect))}'
        f' <span class="muted">{_sure(effect["probability"])}</span></h2>'
    )
    words = [
        _held_out("this effect", effect["held_out"]),
        (
            f"<p>Alone it closes {_percent(effect['share_alone'])} of the gap; as the last one, with all"
            f" others in already, {_percent(effect['share_last'])}.</p>"
        ),
    ]
    if effect["note"]:
        words.append(f"<p><b>Note:</b> {escaped(effect['note'])}.</p>".replace("..</p>", ".</p>"))
    words.append(_confounded(effect))
    if effect.get("identify_as"):
        words.append(
            f'<p class="muted">To fit it: truing identify … --effects {escaped(effect["identify_as"])}</p>'
        )
    _beside_curves(
        page,
        f"effect{number}",
        effect["curves"],
        colour,
        "".join(words),
        _parameters(effect),
        small=number >= FIRST_SCREEN,
    )
    page.add("</section>")


def _unknown(page: Page, unknown: Mapping[str, Any], number: int) -> None:
    inputs = escaped(" and ".join(_input_name(name) for name in unknown["inputs"]))
    page.add(
        f'<section class="card"><h2><i class="dot" style="background:{UNKNOWN}"></i>Unknown'
        f" {_at(unknown['joint'])}{', over ' + inputs if inputs else ''} <span"
        f' class="muted">{_sure(unknown["probability"])}</span></h2>'
    )
    if not unknown["inputs"]:
        page.add(
            "<p>More is left on held-out poses than repeats of one pose show, and neither an effect of the"
            " catalogue nor a function of what was recorded, at one joint or the base, describes it. What it"
            " goes with may not have been recorded.</p></section>"
        )
        return
    looks = f"Its shape: <b>{escaped(_angles(unknown['looks_like']))}</b>. " if unknown["looks_like"] else ""
    why = (
        f"<p>{looks}No effect of the catalogue explains it. The robot file leaves it out: a free function"
        " says what happens, not why, and knows nothing beyond the poses that were measured.</p>"
    )
    _beside_curves(
        page,
        f"unknown{number}",
        unknown["curves"],
        UNKNOWN,
        _held_out("a free function here", unknown["held_out"]) + why,
        "",
    )
    page.add("</section>")


def _beside_curves(
    page: Page,
    name: str,
    curves: Sequence[Mapping[str, Any]],
    colour: str,
    words: str,
    table: str,
    small: bool = False,
) -> None:
    """Curves with what there is to say of them: one on the left, several in a row above, without any only
    words and table.
    """
    if len(curves) > 1:
        page.add('<div class="laws">')
        _curves(page, name, curves, colour, "law row")
        page.add("</div>" + _BENEATH)
    if len(curves) == 1:
        page.add('<div class="finding"><div>')
        _curves(page, name, curves, colour, "law small" if small else "law")
        page.add(f"{_BENEATH}</div><div>{words}{table}</div></div>")
    elif table:
        page.add(f'<div class="finding even"><div>{words}</div><div>{table}</div></div>')
    else:
        page.add(words)


_BENEATH = (
    f'<p class="note">Line: fitted, ± {BAND} standard errors. Dots: what single poses say, everything else'
    " taken out.</p>"
)


def _curves(page: Page, name: str, curves: Sequence[Mapping[str, Any]], colour: str, size: str) -> None:
    all_values = np.concatenate(
        [
            np.array([point[1] for point in curve[what]], dtype=np.float64)
            for curve in curves
            for what in ("points", "samples")
        ]
    )
    up, value = _axis_unit(curves[0]["unit"], all_values)
    # Curves of a row have one scale; a few wild poses do not flatten it.
    tops = [float(np.abs([point[1] for point in curve["points"]]).max(initial=0.0)) for curve in curves]
    top = 1.15 * max([float(np.quantile(np.abs(all_values), 0.98)) if all_values.size else 0.0, *tops]) * up
    for k, curve in enumerate(curves):
        points = np.array(curve["points"], dtype=np.float64).reshape(-1, 3)
        samples = np.array(curve["samples"], dtype=np.float64).reshape(-1, 2)
        points = points[np.argsort(points[:, 0], kind="stable")]
        across, over = _axis_unit(curve["input_unit"], points[:, 0])
        approach = curve["input"].startswith("dir")
        steps = approach or 0 < len(points) <= 3
        x, y, band = points[:, 0] * across, points[:, 1] * up, BAND * np.nan_to_num(points[:, 2]) * up
        beside = samples[:, 0] * across
        if steps:  # samples of one direction lie on top of each other: side by side they can be seen
            beside = beside + (0.15 * float(np.ptp(x)) if x.size else 0.0) * (
                np.modf(np.arange(len(samples)) * 0.6180339887)[0] - 0.5
            )
        dots = points_trace(beside, samples[:, 1] * up, MUTED, "single poses", 4, opacity=0.4)
        law = {
            "type": "scatter",
            "mode": "lines+markers" if steps else "lines",
            "x": packed(x),
            "y": packed(y),
            "line": {"color": colour, "width": 3},
            "marker": {"size": 9, "color": colour},
            "name": "fitted",
        }
        around = {
            "type": "scatter",
            "mode": "lines",
            "x": packed(np.concatenate([x, x[::-1]])),
            "y": packed(np.concatenate([y + band, (y - band)[::-1]])),
            "fill": "toself",
            "fillcolor": faded(colour, 0.22),
            "line": {"width": 0},
            "hoverinfo": "skip",
            "name": "band",
        }
        xaxis: dict[str, Any] = {
            "title": {"text": _over(curve, "row" in size) + (f" [{over}]" if over else "")}
        }
        if approach:
            xaxis |= {
                "tickvals": [-1, 0, 1],
                "ticktext": ["from above (−)", "at rest", "from below (+)"],
                "range": [-1.5, 1.5],
            }
        moves = _site(curve["site"])
        adds = "what it adds" if size == "law" else "adds"
        yaxis: dict[str, Any] = {
            "title": {"text": (f"{adds} to {moves}" if moves else adds) + (f" [{value}]" if value else "")}
        }
        if top > 0:
            yaxis["range"] = [-top, top]
        layout: dict[str, Any] = {"xaxis": xaxis, "yaxis": yaxis}
        second = curve["second"]
        if second:
            times, unit = _axis_unit(second["unit"], np.array(second["range"], dtype=np.float64))
            low, high = (_minus(f"{v * times:.3g}") for v in second["range"])
            layout["title"] = {
                "text": f"{_input_name(second['input'], short=True)} from {low} to {high} {unit}".rstrip()
            }
        page.chart(f"{name}_{k}", [dots, around, law], layout, size=size)


def _over(curve: Mapping[str, Any], short: bool) -> str:
    """What a curve is drawn over: "q4", or, of a law that repeats, "q4, one period of 3.6 deg"."""
    name = _input_name(curve["input"], short=short)
    period = curve.get("period")
    if not period:
        return name
    times, unit = _axis_unit(curve["input_unit"], np.array([period], dtype=np.float64))
    return f"{name}, one period of {period * times:.3g} {unit}".rstrip()


def _held_out(what: str, held: Mapping[str, Any]) -> str:
    low, high = (_percent(end) for end in held["ci"])
    less = (
        f'<b>{_percent(held["shrink"])} less</b> <span class="muted">({low} to {high})'
        if held["shrink"] >= 0
        else (f'<b>{_percent(-held["shrink"])} more</b> <span class="muted">(a fall of {low} to {high})')
    )
    return (
        f'<p class="shrink"><span class="before">{length_text(held["before_rms_m"])}</span> <span'
        f' class="muted">without {what}</span> → <strong'
        f' class="after">{length_text(held["after_rms_m"])}</strong> <span class="muted">with it</span>,'
        f" {less}, rms on {counted(held['n'], 'held-out row')}</span></p>"
    )


def _parameters(effect: Mapping[str, Any]) -> str:
    body, held = [], []
    for p in effect["parameters"]:
        if p["value"] is None or p["frozen"] or p["sigma"] is None:
            held.append(escaped(_part(p["name"], effect)))
            continue
        change = p["value"] - (p["nominal"] or 0.0)
        scale, unit = _unit_for(max(abs(change), p["sigma"]), p["unit"])
        significance = abs(change) / p["sigma"] if p["sigma"] else math.inf
        value, sigma = _with_error(change * scale, p["sigma"] * scale)
        cells = (
            table_cell(change * scale, value),
            table_cell(p["sigma"] * scale, f"± {sigma} {escaped(unit)}"),
            table_cell(significance, f"{figures_text(min(significance, 99999), 2)} σ"),
        )
        body.append(f"<tr><th>{escaped(_part(p['name'], effect))}</th>{''.join(cells)}</tr>")
    table = (
        '<div class="scroll"><table class="narrow"><thead><tr><th>parameter</th><th>change</th><th>standard'
        " error</th><th>sure by</th></tr></thead>"
        f"<tbody>{''.join(body)}</tbody></table></div>"
        if body
        else ""
    )
    if len(body) > LONG_TABLE:
        table = f'<details class="fold"><summary>Its {len(body)} parameters</summary>{table}</details>'
    if held:
        table += (
            f'<p class="note">Kept at nominal, as these data cannot see {"it" if len(held) == 1 else "them"}:'
            f" {', '.join(held)}.</p>"
        )
    return table


def _confounded(effect: Mapping[str, Any]) -> str:
    others = effect["confounded_with"]
    if not others:
        return ""
    items = []
    for other in others:
        share = f" ({_percent(other['probability'])})" if other["probability"] else ""
        measure = f" To tell them apart: {escaped(other['separated_by'])}." if other["separated_by"] else ""
        items.append(f"<li><b>{_name(other)}</b>{share}.{measure}</li>")
    return (
        '<div class="apart"><p>These data cannot tell it from</p><ul'
        f' class="plain">{"".join(items)}</ul></div>'
    )


def _before_and_after(page: Page, result: Mapping[str, Any], rows: Rows) -> None:
    shown = rows.test if rows.test.any() else ~rows.rejected
    before, after = rows.magnitude_before[shown], rows.magnitude_after[shown]
    calm = not result["effects"]  # nothing was changed: before and after are the same
    page.add(
        f'<div class="first"><section class="card"><h2>How far off{"" if calm else ", before and after"}</h2>'
    )
    page.chart(
        "distribution",
        *distribution_chart(
            [(after, AFTER, "error")] if calm else [(before, BEFORE, "before"), (after, AFTER, "after")]
        ),
        size="tall",
    )
    page.add(
        f'<p class="note">{counted(int(shown.sum()), "row")}{", held out" if rows.test.any() else ""}. Base'
        f" and tool are fitted{'' if calm else ' before, too'}, "
        f"so only the robot's own error is seen. {'' if calm else 'After: with the effects named. '}The scale"
        " is logarithmic.</p></section>"
    )
    page.add(_left(result))
    page.add(
        '</div><section class="card"><h2>Error over '
        + ("time" if rows.time is not None else "the order of the rows")
        + "</h2>"
    )
    chart_over_rows(page, rows, "counted for little")
    page.add("</section>")


def _left(result: Mapping[str, Any]) -> str:
    """What remains, as checks in words."""
    checks = [
        *_like_noise(result),
        *_structure_left(result),
        *_predictable_from_neighbours(result["nearest_neighbour"]),
        *_above_noise(result),
        *_rows_that_counted_little(result),
    ]
    worst = max([GOOD, *(check.grade for check in checks)])
    return (
        f'<section class="card trust t{worst}"><h2>What is left</h2><ul>{check_items(checks)}</ul></section>'
    )


def _like_noise(result: Mapping[str, Any]) -> list[Check]:
    p = result["gap"]["p"]
    if result["verdict"] != "none" or p is None:
        return []
    text = f"a gain as large has probability {figures_text(p, 2)} without any gap"
    return [Check(GOOD, "Noise alone would look like this", text)]


def _structure_left(result: Mapping[str, Any]) -> list[Check]:
    p = result["after"]["remaining_structure_p"]
    if p is None:
        return []
    if p <= STRUCTURE:
        text = f"free functions of the inputs explain more than chance would (p = {figures_text(p, 2)})"
        return [Check(LOOK, "What is left has structure", text)]
    quiet = (
        "No function of the inputs describes what is left"
        if len(_free(result)) < len(result["unknown"])
        else "What is left looks like noise"
    )
    text = f"no free function of the inputs explains more than chance would (p = {figures_text(p, 2)})"
    return [Check(GOOD, quiet, text)]


def _predictable_from_neighbours(near: Mapping[str, Any]) -> list[Check]:
    share = near["share"]
    if share is None:
        return []
    end = "" if near["p95_m"] is None else f"; 95 % of its errors are below {length_text(near['p95_m'])}"
    return [
        Check(
            GOOD if share < 0.15 else LOOK,
            f"Poses nearby would predict {_percent(share)} of what is left",
            f"by the nearest neighbour, a model that knows nothing{end}",
        )
    ]


def _above_noise(result: Mapping[str, Any]) -> list[Check]:
    floor, left = result["gap"]["noise_floor_m"], result["after_unknown"]["rms_m"]  # with all that was found
    if not floor or not left:
        return []
    ratio = left / floor
    with_free = " with free functions for what is unknown" if _free(result) else ""
    source = (
        "that of repeated poses"
        if result["gap"]["noise_from_repeats"]
        else "what a flexible fit leaves: without repeated poses it may be too low"
    )
    return [
        Check(
            GOOD if ratio < 1.5 else LOOK,
            f"{length_text(left)} rms is left{with_free}",
            f"{figures_text(ratio, 2)} × the noise of {length_text(floor)}, which is {source}",
        )
    ]


def _rows_that_counted_little(result: Mapping[str, Any]) -> list[Check]:
    """Outliers, and a joint record that was not gone by."""
    checks = []
    if result["outliers"]:
        head = f"{counted(len(result['outliers']), 'row')} counted for little"
        text = f"too far from all others: {_listed(result['outliers'], 15)} (from 0)"
        checks.append(Check(LOOK if _many_outliers(result) else GOOD, head, text))
    if result["joint_record"] not in ("", "q"):
        text = "the diagnosis went by it (columns qr1 …), and so does robot.yaml"
        checks.append(Check(LOOK, "The second joint record fits better", text))
    return checks


# ---- Could not be found --------------------------------------------------------------------------
def _detectable(result: Mapping[str, Any], narrow: bool = False) -> str:
    if not result["detectable"]:
        return ""
    of: dict[str, list[Mapping[str, Any]]] = {}
    for d in result["detectable"]:
        of.setdefault(d["effect"], []).append(d)
    body = []
    for effect, places in of.items():
        easiest, others = places[0], places[1:]
        rest = ", ".join(f"{escaped(d['joint'])} {_quantity(d['size'], d['unit'])}" for d in others[:6]) + (
            " …" if len(others) > 6 else ""
        )
        at = escaped(easiest["joint"]) or "robot"
        body.append(
            f"<tr><th>{_words(effect)}</th><td>{at}</td>"
            f"{table_cell(easiest['size'] or 0, _quantity(easiest['size'], easiest['unit']))}"
            f"{table_cell(easiest['size_at_tip_m'] or 0, length_text(easiest['size_at_tip_m']))}"
            + ("" if narrow else f'<td class="held wrap">{rest}</td>')
            + "</tr>"
        )
    elsewhere = "" if narrow else '<th class="wrap">elsewhere</th>'
    return (
        '<section class="card"><h2>The smallest effects that would have been found</h2><p class="lead">What'
        " is not named is smaller than this at these "
        'joints, or cannot be tested.</p><div class="scroll"><table><thead><tr><th>effect</th><th>easiest'
        " at</th><th>size</th><th>at the tip, rms</th>"
        f"{elsewhere}</tr></thead><tbody>{''.join(body)}</tbody></table></div></section>"
    )


def _not_testable(result: Mapping[str, Any]) -> str:
    if not result["not_testable"]:
        return ""
    body = "".join(
        f"<tr><th>{_words(n['effect'])}</th><td>{escaped(', '.join(n['joints'])) or 'anywhere'}</td><td"
        f' class="wrap">{escaped(in_words(result, n["why"]))}</td></tr>'
        for n in result["not_testable"]
    )
    return (
        '<section class="card"><h2>What these data could not show</h2><p class="lead">These effects may be'
        " there or not: nothing was concluded about them.</p>"
        '<div class="scroll"><table'
        ' class="left"><thead><tr><th>effect</th><th>at</th><th>why</th></tr></thead>'
        f"<tbody>{body}</tbody></table></div></section>"
    )


def _next(result: Mapping[str, Any], rows: Rows) -> str:
    poses = result["next_measurements"]
    if not poses:
        return ""
    has_direction, has_payload = (
        any(p["direction"] for p in poses),
        any(p["payload_kg"] is not None for p in poses),
    )
    head = (
        ["#", *rows.joint_names]
        + (["approach"] if has_direction else [])
        + (["payload"] if has_payload else [])
        + ["what it tells"]
    )
    body = []
    for k, pose in enumerate(poses[:LISTED]):
        cells = [f"<th>{k + 1}</th>"]
        for value, unit in zip(pose["joints"], rows.joint_units, strict=False):
            place = f"{math.degrees(value):.1f}°" if unit == "rad" else f"{value * 1e3:.1f} mm"
            cells.append(f"<td>{_minus(place)}</td>")
        if has_direction:
            signs = ("+" if d > 0 else "−" if d < 0 else "·" for d in pose["direction"])
            cells.append(f"<td>{' '.join(signs) or 'any'}</td>")
        if has_payload:
            cells.append(
                "<td>any</td>" if pose["payload_kg"] is None else f"<td>{pose['payload_kg']:g} kg</td>"
            )
        cells.append(f'<td class="wrap">{escaped(in_words(result, pose["why"]))}</td>')
        body.append(f"<tr>{''.join(cells)}</tr>")
    more = (
        f'<p class="note">The first {LISTED} of {len(poses)}; next_poses.csv has all.</p>'
        if len(poses) > LISTED
        else '<p class="note">Also in next_poses.csv.</p>'
    )
    heading = "".join(f"<th>{escaped(h)}</th>" for h in head[:-1]) + f'<th class="wrap">{head[-1]}</th>'
    return (
        f'<section class="card"><h2>Measure next</h2><p class="lead">{counted(len(poses), "pose")} that would'
        " settle what is open. Approach: from which side each joint comes.</p>"
        "<div"
        f' class="scroll"><table><thead><tr>{heading}</tr></thead><tbody>{"".join(body)}</tbody></table>'
        f"</div>{more}</section>"
    )


def _candidates(result: Mapping[str, Any]) -> str:
    if not result["candidates"]:
        return ""
    ordered = sorted(
        result["candidates"], key=lambda c: -(c["evidence"] if c["evidence"] is not None else -math.inf)
    )
    body = []
    for c in ordered[:LISTED]:
        cells = "".join(
            table_cell(c[key] or 0, "–" if c[key] is None else _compact(c[key]))
            for key in ("columns", "gain", "evidence")
        )
        cells += table_cell(c["held_out_gain"] or 0, _percent(c["held_out_gain"])) + table_cell(
            c["largest_z"] or 0, _compact(c["largest_z"])
        )
        body.append(f"<tr><th>{_name(c)}</th>{cells}</tr>")
    head = ("candidate", "parameters", "gain alone", "log evidence", "held-out gain", "largest z")
    more = (
        f'<p class="note">The first {LISTED} of {len(ordered)}; result.json has all.</p>'
        if len(ordered) > LISTED
        else ""
    )
    heading = "".join(f'<th><button type="button">{h}</button></th>' for h in head)
    return (
        '<details class="card"><summary>Every candidate by itself</summary><p class="lead">Before any choice.'
        " The table is here to be checked, not to be read from the "
        "top: candidates that resemble the true cause score nearly as well.</p>"
        f'<div class="scroll"><table class="sortable"><thead><tr>{heading}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>{more}</details>"
    )


# ---- Words ---------------------------------------------------------------------------------------
def colour_of(number: int) -> str:
    return EFFECT_COLOURS[number % len(EFFECT_COLOURS)]


def _words(effect: str) -> str:
    return escaped(plain_name(effect))


def plain_name(effect: str) -> str:
    """ "transmission_error@14" as "transmission error (14 per turn)" """
    name, _, order = effect.partition("@")
    return name.replace("_", " ") + (f" ({order} per turn)" if order else "")


def in_words(result: Mapping[str, Any], text: str) -> str:
    """A sentence of the result with its effects, angles and lengths written as everywhere in the report."""
    named = [e for effect in result["effects"] for e in (effect, *effect["confounded_with"])]
    for name in sorted(
        {str(e["effect"]) for e in (*named, *result["detectable"], *result["not_testable"])},
        key=len,
        reverse=True,
    ):
        text = re.sub(rf"(?<![\w@]){re.escape(name)}(?![\w@])", plain_name(name), text)
    return _angles(text)


def _angles(text: str) -> str:
    """Angles and small lengths in words as the charts have them: "0.557 rad" as "31.9°"."""

    def shown(match: re.Match[str]) -> str:
        value, unit = float(match[1]), match[2]
        if unit == "rad" and abs(value) > 0.02:
            return _minus(f"{math.degrees(value):.1f}°")
        return _minus(_quantity(value, unit))

    return re.sub(r"(?<![\w.])(-?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?) (rad|m)(?![\w/·])", shown, text)


def at_joints(found: Mapping[str, Any]) -> str:
    """ "joint compliance at J2, J3" """
    joints = list(found["joints"])
    where = (
        ""
        if not joints
        else (
            f" at {', '.join(joints)}"
            if len(joints) <= 3
            else f" of {len(joints)} {'links' if 'link' in found['effect'] else 'joints'}"
        )
    )
    return plain_name(str(found["effect"])) + where


def _name(found: Mapping[str, Any]) -> str:
    return escaped(at_joints(found))


def _at(joint: str) -> str:
    return f"at {escaped(joint)}" if joint else "somewhere"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _percent(share: float | None) -> str:
    if share is None:
        return "–"
    value = 100 * share
    text = f"{value:.0f}" if abs(value) >= 2 or abs(value) < 0.05 else f"{value:.1f}"
    return ("0" if float(text) == 0 else _minus(text)) + " %"


def _sure(probability: float | None) -> str:
    if probability is None:
        return ""
    return f"{sure_text(probability).replace('> ', 'more than ')} sure"


def contender(effect: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The effect that it cannot be told from and that is about as likely: what to repair depends on it.
    Others, and those that lack their input, stand in the effect's own section.
    """
    least = CONTENDER * effect["probability"]
    return next(
        (o for o in effect["confounded_with"] if o["probability"] and o["probability"] >= least), None
    )


def _or(effect: Mapping[str, Any]) -> str:
    rival = contender(effect)
    return f'<span class="maybe">or {_name(rival)}</span>' if rival else ""


def size_text(effect: Mapping[str, Any]) -> str:
    """Value and standard error: of a wave its amplitude, of compliance the stiffness, of few parameters the
    one that says most; of an effect that is a curve, how far it goes.
    """
    seen = [p for p in effect["parameters"] if p["sigma"] and not p["frozen"] and p["value"] is not None]
    if not seen:
        ends = [(abs(point[1]), curve["unit"]) for curve in effect["curves"] for point in curve["points"]]
        return f"up to {_quantity(*max(ends))}" if ends else ""
    wave = _largest_wave(seen)
    if wave:
        return wave
    if len(seen) > FEW_PARAMETERS:
        return f"{len(seen)} parameters"
    p = max(seen, key=lambda p: abs(p["value"] - (p["nominal"] or 0.0)) / p["sigma"])
    if len(seen) == 1 and p["unit"] == "rad/Nm" and p["value"] > 2 * p["sigma"]:
        return _stiffness(p["value"], p["sigma"])
    change = p["value"] - (p["nominal"] or 0.0)
    scale, unit = _unit_for(max(abs(change), p["sigma"]), p["unit"])
    value, sigma = _with_error(change * scale, p["sigma"] * scale)
    size = f"{value} ± {sigma} {unit}".rstrip()
    return size if len(seen) == 1 else f"{_part(p['name'], effect)} {size}, and {len(seen) - 1} more"


def _largest_wave(parameters: Sequence[Mapping[str, Any]]) -> str:
    """Amplitude of the largest of waves whose parameters are pairs of cos and sin, "…cos2" and "…sin2"; "" of
    anything else.
    """
    values = {p["name"]: p for p in parameters}
    waves = []
    for name, cos in values.items():
        sin = values.get(re.sub(r"cos(?=[^.]*$)", "sin", name))
        if sin is None or sin is cos:
            continue
        amplitude = math.hypot(cos["value"], sin["value"])
        # along the phase: the standard errors of both by how much each adds to it
        sigma = math.hypot(cos["value"] * cos["sigma"], sin["value"] * sin["sigma"]) / (amplitude or 1.0)
        waves.append((amplitude, sigma, cos["unit"]))
    if not waves or 2 * len(waves) != len(parameters):
        return ""
    amplitude, sigma, unit = max(waves)
    scale, unit = _unit_for(amplitude, unit)
    value, error = _with_error(amplitude * scale, sigma * scale)
    return f"amplitude {value.lstrip('+')} ± {error} {unit}"


def _stiffness(compliance: float, sigma: float) -> str:
    """ "212 ± 8 kNm/rad" of a compliance [rad/Nm]"""
    stiffness = 1.0 / compliance
    scale, prefix = (1e-6, "M") if stiffness >= 1e6 else (1e-3, "k") if stiffness >= 1e3 else (1.0, "")
    value, error = _with_error(stiffness * scale, stiffness * scale * sigma / compliance)
    return f"stiffness {value.lstrip('+')} ± {error} {prefix}Nm/rad"


def _part(name: str, effect: Mapping[str, Any]) -> str:
    """ "cos1" of "harmonic.J2.cos1" if effect and joint are named beside it; else the whole name."""
    known = [str(effect["effect"]), *(effect["joints"] if len(effect["joints"]) == 1 else [])]
    parts = [part for part in name.split(".") if part not in known]
    return ".".join(parts) or name


def _with_error(value: float, sigma: float) -> tuple[str, str]:
    """A value and its standard error with as many decimals as the error has meaning: "+0.640", "0.006"."""
    if not (sigma > 0 and math.isfinite(sigma)):
        return _signed(value), figures_text(sigma, 2)
    shown = figures_text(sigma, 2 if f"{sigma:.1e}"[0] in "12" else 1)
    decimals = len(shown.partition(".")[2])
    return f"{'−' if value < 0 else '+'}{abs(value):.{decimals}f}", shown


_INPUTS = {
    "dir": ("approach direction of joint", "approach"),
    "torque": ("gravity torque at joint", "torque"),
    "tau": ("measured torque at joint", "tau"),
    "speed": ("speed of joint", "speed"),
}


def _input_name(name: str, short: bool = False) -> str:
    """ "dir3" as "approach direction of joint 3": for people; a short name for narrow charts."""
    match = re.fullmatch(r"(dir|torque|tau|speed)([0-9]+)", name)
    if match:
        return f"{_INPUTS[match[1]][short]} {match[2]}"
    match = re.fullmatch(r"qr([0-9]+)-q\1", name)
    if match and not short:
        return f"second record of joint {match[1]} less the first"
    return {"temp": "temperature", "order": "order of the poses"}.get(name, name)


def _site(name: str) -> str:
    """ "base.x" as "base x"; what a curve moves."""
    return name.replace(".", " ")


_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))


def _unit_for(value: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which `value` is a number people read: rad, m and s get a prefix, pure numbers
    become ppm.
    """
    size = abs(value)
    if unit in ("", "-"):
        return (1e6, "ppm") if 0 < size < 1e-2 else (1.0, "")
    if not (unit.startswith(("rad", "m")) or unit == "s") or size == 0:
        return 1.0, unit
    for factor, prefix in _PREFIXES[1:] if unit[:1] == "m" else _PREFIXES:  # lengths in mm, not in m
        if size * factor >= 0.05:
            return factor, prefix + unit
    return _PREFIXES[-1][0], _PREFIXES[-1][1] + unit


def _quantity(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    scale, shown = _unit_for(value, unit)
    return f"{figures_text(value * scale, 2)}\u202f{escaped(shown)}".rstrip("\u202f")


def _axis_unit(unit: str, values: Floats) -> tuple[float, str]:
    """Factor and unit of an axis."""
    size = float(np.nanmax(np.abs(values), initial=0.0)) if values.size else 0.0
    if unit == "rad" and size > 0.02:
        return 180 / math.pi, "°"
    return _unit_for(size, unit) if unit in ("rad", "m") else (1.0, "" if unit == "-" else unit)


def _minus(number: str) -> str:
    return number.replace("-", "−")


def _signed(value: float) -> str:
    return ("+" if value >= 0 else "−") + figures_text(abs(value))


def _compact(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.0f}" if abs(value) >= 100 or float(value).is_integer() else f"{value:.3g}"


def _listed(numbers: Iterable[int], limit: int) -> str:
    every = list(numbers)
    return ", ".join(str(n) for n in every[:limit]) + (" …" if len(every) > limit else "")
