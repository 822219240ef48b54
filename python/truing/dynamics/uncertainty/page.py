# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML report of ``truing dynamics randomise``: what is drawn over which range, what goes together, what
stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from truing.report.page import Page, footer, part_of_page, table_cell, warnings_card
from truing.report.words import counted, escaped, figures_text

STRONG = 0.3  # correlations from which on pairs are listed
PAIRS = 24  # of them
BAR = 160  # [px] of the widest range, over its value


def randomisation_report(result: Mapping[str, Any]) -> str:
    """result: what ``result.json`` holds."""
    drawn, known = result["randomised"], result["known"]
    page = Page(f"{result.get('robot') or 'Robot'}: domain randomisation", part_of_page("dynamics"))
    page.add(
        f'<header><p class="kicker">truing dynamics randomise · {escaped(result.get("robot"))}</p>'
        f'<h1 class="long">{escaped(sentence(result))}</h1><p class="sub">'
        f"{escaped('. '.join(text[:1].upper() + text[1:] for text in result['notes']))}.</p></header>"
    )
    page.add('<div class="first">')
    _ranges(page, drawn)
    _pairs(page, result)
    page.add("</div>")
    _known(page, known)
    items = "".join(f'<div class="apart">{escaped(text)}</div>' for text in result["cannot_be_told_apart"])
    if items:
        page.add(f'<section class="card"><h2>What the recordings cannot tell apart</h2>{items}</section>')
    page.add(warnings_card(result))
    page.add(footer(result))
    return page.html()


def sentence(result: Mapping[str, Any]) -> str:
    """How much is drawn, how much stays."""
    drawn, known = len(result["randomised"]), len(result["known"])
    if not drawn:
        return f"Nothing is to be drawn: all {counted(known, 'parameter')} are known well enough"
    own = sum(1 for one in result["randomised"] if one["own_sigma"])
    text = f"{counted(own, 'parameter')} left uncertain by the data {'is' if own == 1 else 'are'} drawn"
    if drawn > own:
        text += f", {drawn - own} more only with a factor that all torques and masses share"
    return f"{text}; {known} stay as they were found"


def strong_pairs(result: Mapping[str, Any]) -> list[tuple[str, str, float]]:
    """Pairs by how strongly they go together."""
    names = [one["name"] for one in result["randomised"]]
    table = result["correlation"]
    pairs = [
        (names[i], names[j], float(table[i][j]))
        for i in range(len(names))
        for j in range(i)
        if abs(table[i][j]) >= STRONG
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def _ranges(page: Page, drawn: Sequence[Mapping[str, Any]]) -> None:
    spans = [_span(one) for one in drawn]
    widest = max([*spans, 1e-12])
    rows = "".join(
        f"<tr><td>{escaped(one['name'])}</td>{table_cell(one['value'], figures_text(one['value']))}"
        f"<td>{figures_text(one['low'])} to {figures_text(one['high'])} {escaped(one['unit'])}</td>"
        f'<td><i class="bar" style="display:inline-block;height:9px;width:{BAR * span / widest:.0f}px;'
        'background:var(--after)"></i></td></tr>'
        for one, span in zip(drawn, spans, strict=True)
    )
    page.add(
        '<section class="card"><h2>Drawn <span class="muted">90 % of the draws; bar: over the value</span>'
        '</h2><div class="scroll"><table class="tight"><thead><tr><th></th><th>found</th><th>range</th>'
        f"<th></th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )


def _span(one: Mapping[str, Any]) -> float:
    """Width of a range over the value."""
    low, high, value = one["low"], one["high"], one["value"]
    return (high - low) / abs(value) if value else 0.0


def _pairs(page: Page, result: Mapping[str, Any]) -> None:
    pairs = strong_pairs(result)
    rows = "".join(
        f"<tr><td>{escaped(a)}</td><td>{escaped(b)}</td>{table_cell(value, f'{value:+.2f}')}</tr>"
        for a, b, value in pairs[:PAIRS]
    )
    rest = f'<p class="note">and {len(pairs) - PAIRS} more above {STRONG}</p>' if len(pairs) > PAIRS else ""
    none = f"<p>No two go together by more than {STRONG}.</p>" if not pairs else ""
    page.add(
        '<section class="card"><h2>What goes together <span class="muted">correlation</span></h2>'
        f'{none}<div class="scroll"><table class="tight"><tbody>{rows}</tbody></table></div>{rest}</section>'
    )


def _known(page: Page, known: Sequence[Mapping[str, Any]]) -> None:
    rows = "".join(
        f"<tr><td>{escaped(one['name'])}</td><td>{figures_text(one['value'])} {escaped(one['unit'])}</td>"
        f'<td class="wrap">{escaped(one["why"])}</td></tr>'
        for one in known
    )
    if rows:
        page.add(
            '<section class="card"><h2>Not drawn</h2><div class="scroll"><table class="causes"><tbody>'
            f"{rows}</tbody></table></div></section>"
        )
