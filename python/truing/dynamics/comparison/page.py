# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of ``truing dynamics compare``: which model is nearer to the robot; both drawn over the
measured motion; every joint's error of both, by motion and, where it was recorded, by torque.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from truing.dynamics.rollout.page import error_text, motion_chart
from truing.report.charts import AFTER, BEFORE
from truing.report.page import Page, footer, part_of_page, warnings_card
from truing.report.words import counted, escaped, figures_text

TONES = {
    "A": ("B is worse", "bad"),
    "B": ("B is nearer", "good"),
    "neither": ("no difference", "found"),
    "mixed": ("better and worse", "open"),
}


def comparison_report(result: Mapping[str, Any], paths: Sequence[Mapping[str, Any]]) -> str:
    """result: what ``result.json`` holds; paths: of every joint a stretch of motion, simulated by A and B."""
    names = result["models"]
    page = Page(f"{names['A']} and {names['B']}", part_of_page("dynamics"))
    label, tone = TONES[result["nearer"]]
    recordings, runs = len(result["recordings"]), result["rollout"]["windows"]
    drive = "recorded commands" if result["driven_by"] == "commands" else "measured torques"
    page.add(
        f'<header><p class="kicker">truing dynamics compare · {counted(recordings, "recording")} ·'
        f' margin {100 * result["margin"]:g} %<span class="verdict {tone}">{label}</span></p>'
        f'<h1 class="long">{escaped(result["sentence"])}</h1><p class="sub">A is'
        f" <b>{escaped(names['A'])}</b>, B <b>{escaped(names['B'])}</b>. {counted(runs, 'simulation')} of"
        f" each begin at measured states and are driven by the {drive}.</p></header>"
    )
    page.add('<div class="first">')
    models = {"A": ("A", BEFORE), "B": ("B", AFTER)}
    last = result["ratios"][-1]["joints"]
    order = sorted(last, key=lambda joint: -abs(math.log(max(last[joint] or 1.0, 1e-12))))
    motion_chart(page, paths, models, {"A": "A", "B": "B"}, order)
    _ratio_card(page, result)
    page.add("</div>")
    _joint_card(page, result)
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _ratio_card(page: Page, result: Mapping[str, Any]) -> None:
    rows = "".join(
        f"<tr><td>{escaped(r['of'])}</td><td>{figures_text(r['B_over_A'], 3)}</td><td>{interval(r)}</td></tr>"
        for r in result["ratios"]
    )
    page.add(
        '<section class="card"><h2>Error of B over that of A</h2><div class="scroll"><table><thead><tr>'
        f"<th></th><th>ratio</th><th>90 % interval</th></tr></thead><tbody>{rows}</tbody></table></div>"
        '<p class="note">Mean over the joints (geometric). Below 1 B is nearer to the robot; by more than'
        f" {100 * result['margin']:g} % above 1 it is worse.</p></section>"
    )


def interval(ratio: Mapping[str, Any]) -> str:
    low, high = ratio["ci"]
    return (
        "" if low is None or not math.isfinite(low) else f"{figures_text(low, 3)} to {figures_text(high, 3)}"
    )


def joint_lines(
    result: Mapping[str, Any], numbers: Sequence[int] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Heads, and a line for each joint: torque and motion of A and B; numbers: of the horizons, all."""
    horizons, units = result["rollout"]["horizon_s"], result["rollout"]["units"]
    errors, torque = result["rollout"]["models"], result["torque"]
    chosen = range(len(horizons)) if numbers is None else numbers
    titles = [title for k in chosen for title in (f"{horizons[k]:g} s ahead A", "B")]
    head = ["", *(["torque A", "B"] if torque else []), *titles]
    lines = []
    for joint, unit in units.items():
        line = [joint, *(f"{of[joint]:.1f} %" for of in torque.values())]
        for k in chosen:
            line += [error_text(errors[model][joint][k], unit) for model in ("A", "B")]
        lines.append(line)
    return head, lines


def _joint_card(page: Page, result: Mapping[str, Any]) -> None:
    head, lines = joint_lines(result)
    heads = "".join(f"<th>{escaped(title)}</th>" for title in head)
    rows = "".join(f"<tr>{''.join(f'<td>{escaped(cell)}</td>' for cell in line)}</tr>" for line in lines)
    torque = "torque in % of its standard deviation, " if result["torque"] else ""
    page.add(
        f'<section class="card"><h2>Every joint <span class="muted">rms; {torque}motion ahead of measured'
        " states</span></h2>"
        f'<div class="scroll"><table class="tight"><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody>'
        "</table></div></section>"
    )
