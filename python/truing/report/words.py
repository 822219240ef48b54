# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Numbers and names as a reader wants them: units that give figures people read, plurals, HTML escapes."""

from __future__ import annotations

import html
import math


def escaped(text: object) -> str:
    return html.escape(str(text if text is not None else ""))


def counted(n: int, noun: str) -> str:
    return f"{n:,} {noun}{'' if n == 1 else 's'}".replace(",", "\u202f")


def drawn_of(shown: int, total: int, noun: str) -> str:
    return (
        f"{counted(total, noun)}."
        if shown == total
        else f"{counted(shown, noun)} drawn of {counted(total, noun)}, evenly picked."
    )


def figures_text(value: float, figures: int | None = None) -> str:
    """Plain decimal text with `figures` significant figures (3 from 1 on, 2 below), never an exponent."""
    if not math.isfinite(value):
        return "∞" if value > 0 else "–"
    if value == 0:
        return "0"
    wanted = figures if figures is not None else 3 if abs(value) >= 1 else 2
    rounded = float(f"{value:.{wanted - 1}e}")  # 0.0999 has become 0.10, and needs a decimal less
    decimals = wanted - 1 - math.floor(math.log10(abs(rounded)))
    return f"{rounded:.{max(0, min(decimals, 9))}f}"


def length_unit(metres: float, big: bool = False) -> tuple[str, float]:
    """mm, unless that gives numbers nobody reads."""
    if not big and 0 < abs(metres) < 2e-6:
        return "µm", 1e6
    return ("m", 1.0) if abs(metres) >= 10 else ("mm", 1e3)


def length_text(metres: float | None) -> str:
    if metres is None:
        return "–"
    unit, scale = length_unit(metres)
    return f"{figures_text(metres * scale)}\u202f{unit}"


def sure_text(probability: float) -> str:
    """A confidence; nothing is said to be wholly certain."""
    return "> 99 %" if probability > 0.99 else f"{100 * probability:.0f} %"


def angle_text(radians: float) -> str:
    return (
        f"{figures_text(math.degrees(radians))}°"
        if abs(radians) > 2e-3
        else f"{figures_text(radians * 1e3)}\u202fmrad"
    )
