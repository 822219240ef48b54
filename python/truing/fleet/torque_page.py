# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a fleet's dynamics: how well torques are predicted, and which arms stand out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from truing.report.charts import AFTER, BEFORE
from truing.report.page import Page, footer, table_cell, warnings_card
from truing.report.words import counted, escaped, figures_text

_NAMED = 400  # arms, above which the chart has no room for their names
_MODELS = (("nominal", "as in the file"), ("shared", "what all share"), ("own", "with its own"))


def torque_report(result: Mapping[str, Any]) -> str:
    """The report of ``truing fleet dynamics``, from the dictionary of result.json."""
    arms = result["arms"]
    page = Page(f"{result.get('robot') or 'Robot'}: torques of {counted(len(arms), 'arm')}")
    page.add(
        f'<header><p class="kicker">truing fleet dynamics · {escaped(result.get("robot"))}</p>'
        f'<h1>{escaped(result["sentence"])}</h1><p class="sub">{counted(result["rows"], "row")} in'
        f" {counted(result['partitions'], 'partition')}, read {result['solver']['passes']} times. Held out:"
        f" {escaped(result['held_out_are'])}.</p></header>"
    )
    page.add(_stands_out(result["stands_out"]))
    page.add(_errors(result["held_out"]))
    _arms_chart(page, arms)
    page.add(_parameters(result["parameters"]))
    page.add(_arms(arms))
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def _table(title: str, lead: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f'<th><button type="button">{name}</button></th>' for name in names)
    body = "".join(f"<tr>{''.join(cells)}</tr>" for cells in rows)
    return (
        f'<section class="card"><h2>{title}</h2><p class="lead">{lead}</p><div class="scroll"><table'
        f' class="sortable"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div></section>'
    )


def _number(value: float | None, unit: str = "", sign: bool = False) -> str:
    if value is None:
        return '<td class="held" data-v="-1">–</td>'
    text = ("+" if sign and value > 0 else "") + figures_text(value)
    return table_cell(value, f"{text} {escaped(unit)}".strip() if unit != "-" else text)


def _stands_out(found: Sequence[Mapping[str, Any]]) -> str:
    if not found:
        return (
            '<section class="card"><h2>Arms that stand out</h2><p class="lead">None: no arm departs from the'
            " others by more than chance (1 % for the fleet).</p></section>"
        )
    rows = [
        [
            f"<th>{escaped(one['arm'])}</th>",
            f"<td>{escaped(one['parameter'])}</td>",
            _number(one["value"], one["unit"], sign=True),
            _number(one["sigma"]),
            _number(one["others"], one["unit"], sign=True),
            _number(one["scatter"]),
            _number(one["torque"]),
            _number(100.0 * one["removed"], "%"),
        ]
        for one in found
    ]
    names = (
        *(
            "arm",
            "parameter",
            "departs from the type by",
            "standard error",
            "others, mean",
            "others, scatter",
        ),
        *("torque, rms, Nm or N", "closes, of squares"),
    )
    lead = "A parameter is named where the others scatter too little for it to be chance (1 % for the fleet)."
    return _table("Arms that stand out", lead, names, rows)


def _errors(errors: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        [
            f"<th>{escaped(error['joint'])}</th>",
            *(_number(error[f"{model}_percent"], "%") for model, _ in _MODELS),
            _number(error["own_rms_Nm"]),
            table_cell(error["rows"], f"{error['rows']:,}"),
        ]
        for error in errors
    ]
    lead = (
        "Of torques that were not fitted: rms error in percent of the measured torque's standard deviation."
    )
    names = ("joint", *(words for _, words in _MODELS), "the last, Nm or N", "rows")
    return _table("Error by joint", lead, names, rows)


def _mean(arm: Mapping[str, Any], model: str) -> float | None:
    known = [error[f"{model}_percent"] for error in arm["held_out"] if error[f"{model}_percent"] is not None]
    return sum(known) / len(known) if known else None


def _arms_chart(page: Page, arms: Mapping[str, Any]) -> None:
    """Every arm's error with what all share, and with its own."""
    order = sorted(arms, key=lambda name: -(_mean(arms[name], "shared") or 0.0))
    named = len(order) <= _NAMED
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "x": [escaped(name) for name in order] if named else list(range(1, len(order) + 1)),
            "y": [_mean(arms[name], model) for name in order],
            "name": words,
            "marker": {"color": colour, "size": 6},
            "hovertemplate": "%{x}: %{y:.3g} %<extra></extra>",
        }
        for (model, words), colour in zip(_MODELS[1:], (BEFORE, AFTER), strict=True)
    ]
    page.add('<section class="card"><h2>Every arm\'s error, mean of the joints, largest first</h2>')
    page.chart(
        "arms",
        traces,
        {
            "xaxis": {"type": "category" if named else "linear", "title": {"text": "arm"}},
            "yaxis": {"type": "log", "title": {"text": "error [%]"}},
        },
        size="wide",
    )
    page.add("</section>")


def _parameters(parameters: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        [
            f"<th>{escaped(p['name'])}</th>",
            _number(p["value"], p["unit"], sign=True),
            _number(p["sigma"]),
        ]
        for p in parameters
    ]
    lead = "What is added to the robot of the file. Inertias of links are seen in combinations only."
    return _table("What all arms share", lead, ("parameter", "change from nominal", "standard error"), rows)


def _arms(arms: Mapping[str, Any]) -> str:
    rows = [
        [
            f"<th>{escaped(name)}</th>",
            table_cell(arm["recordings"], str(arm["recordings"])),
            table_cell(arm["rows"], f"{arm['rows']:,}"),
            *(_number(_mean(arm, model), "%") for model, _ in _MODELS),
        ]
        for name, arm in arms.items()
    ]
    lead = "Errors are means of the joints. What each has of its own: arms.csv, its robot: robot_NAME.yaml."
    names = ("arm", "recordings", "rows", *(words for _, words in _MODELS))
    return _table("Arms", lead, names, rows)
