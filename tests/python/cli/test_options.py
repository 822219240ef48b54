# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Every kind of option reads SI, refuses by the right noun, and shows defaults as a user writes them."""

from __future__ import annotations

import math
from typing import Any

import pytest

import truing
from truing.cli.commands.handeye import Point, Sigmas
from truing.cli.commands.plan import Temperatures
from truing.cli.commands.simulate import EffectSize
from truing.cli.options import (
    Angle,
    Choice,
    Count,
    EffectNames,
    Fraction,
    Kind,
    Length,
    Mass,
    Number,
    Parts,
    Pixels,
    Speed,
    Time,
    Words,
    read_with_common_units,
)

DROPOUT = Parts("", (Time(), Time()), "a time and how long, such as 20s:2s", separator=":")
ERRORS = Parts("", (Length(least=0), Angle(), Number()), "a length and an angle", optional=1)


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (Length(), "0.03mm", 3e-5),
        (Length(), "1 m", 1.0),
        (Length(), "5µm", 5e-6),
        (Length(), "0", 0.0),
        (Angle(), "15deg", math.radians(15)),
        (Angle(), "1mrad", 1e-3),
        (Angle(), "-2e-3rad", -2e-3),
        (Time(), "40ms", 0.04),
        (Time(), ".5 s", 0.5),
        (Mass(), "500g", 0.5),
        (Speed(), "0.3m/s", 0.3),
        (Pixels(), "0.2px", 0.2),
        (Fraction(), "2%", 0.02),
        (Fraction(), "0.2", 0.2),
        (Count(), "12", 12),
        (Number(), "1e-4", 1e-4),
    ],
)
def test_a_value_is_read_in_si(kind: Kind, text: str, value: float) -> None:
    assert kind.read(text, "--x") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["3", "", "mm", "3 furlongs", "3deg", "1e999mm", "nanmm", "3 mm 4", "0x3mm"])
def test_a_length_without_a_proper_unit_is_refused_by_name(text: str) -> None:
    with pytest.raises(
        truing.InputError, match=r"--noise: found .* expected a length with its unit .* such as 0\.03mm"
    ):
        Length().read(text, "--noise")


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        (Length(), "3", "a length with its unit (m, cm, mm, um), such as 0.03mm"),
        (Length(least=0), "-1mm", "a length of 0 or more, such as 0.03mm"),
        (Angle(), "3mm", "an angle with its unit (rad, mrad, urad, deg), such as 15deg"),
        (Angle(above=0), "0deg", "an angle above 0, such as 15deg"),
        (Mass(), "3", "a mass with its unit (kg, g), such as 5kg"),
        (Time(above=0, most=1.0), "0ms", "a time above 0, such as 40ms"),
        (Time(above=0, most=1.0), "2s", "a time of at most 1s"),
        (Speed(), "0.3m", "a speed with its unit (m/s, cm/s, mm/s), such as 0.3m/s"),
        (Pixels(above=0), "0px", "a number of pixels above 0, such as 0.2px"),
        (Fraction(), "100%", "a fraction below 1, such as 2% or 0.02"),
        (Fraction(), "-1%", "a fraction below 1, such as 2% or 0.02"),
        (Fraction(), "two", "a fraction below 1, such as 2% or 0.02"),
        (Fraction(), "nan", "a fraction below 1, such as 2% or 0.02"),
        (Fraction(above=0, below=0.5), "0%", "a fraction above 0 and below 0.5, such as 2% or 0.02"),
        (Words("", known=("dir", "t")), "dir,humidity", "words of dir, t"),
        (Count(least=1), "none", "a whole number, 1 or more"),
        (Count(least=1), "0", "a whole number, 1 or more"),
        (Count(most=100), "101", "a whole number, 0 to 100"),
        (Count(), "1000000000001", "a number between -1e+12 and 1e+12"),
        (Number(), "-1.1e12", "a number between -1e+12 and 1e+12"),
        (Length(), "2e12m", "a number between -1e+12 and 1e+12"),
        (Number(least=0), "-1", "a number, 0 or more, such as 1e-4"),
        (Choice("", {"d": 1, "a": 2, "e": 3}), "f", "d, a or e"),
        (DROPOUT, "20s", "a time and how long, such as 20s:2s"),
        (DROPOUT, "20s:2mm", "a time with its unit (s, ms, us, min), such as 40ms"),
        (Temperatures(""), "35,20", "two temperatures in deg C, the lower one first, such as 20,35"),
        (Temperatures(""), "20,warm", "a temperature in deg C, such as 20"),
        (Sigmas(""), "0.1mm", "a length and an angle, such as 0.1mm,0.05deg"),
        (Sigmas(""), "0.1mm,0deg", "an angle above 0, such as 15deg"),
        (Point(""), "0,0,0.8", "three lengths with their unit such as 0,0,800mm"),
        (EffectSize(""), "backlash", "effect:joint=size such as backlash:J2=0.2mrad"),
        (EffectSize(""), "backlash:J2=much", "a size in SI, or with its unit, such as 0.2mrad"),
    ],
)
def test_what_cannot_be_used_is_refused_by_its_noun(kind: Kind, text: str, expected: str) -> None:
    with pytest.raises(truing.InputError) as error:
        kind.read(text, "--x")
    assert str(error.value).startswith("--x: found ") and f", expected {expected}" in str(error.value)


@pytest.mark.parametrize(
    ("kind", "value", "text"),
    [
        (Length(), 3e-5, "0.03mm"),
        (Length(), 0.25, "250mm"),
        (Length(), 0.1, "0.1m"),
        (Angle(), math.radians(15), "15deg"),
        (Angle(), 1e-4, "0.1mrad"),
        (Time(), 0.04, "40ms"),
        (Time(), 30.0, "30s"),
        (Mass(), 5.0, "5kg"),
        (Speed(), 0.3, "0.3m/s"),
        (Fraction(), 0.2, "20%"),
        (Choice("", {"d": "d_optimal"}), "d_optimal", "d"),
        (Temperatures(""), (20.0, 35.0), "20,35"),
        (ERRORS, (1e-3, 1e-3, 0.0), "1mm,1mrad"),
        (ERRORS, (1e-3, 1e-3, 1e-4), "1mm,1mrad,0.0001"),
    ],
)
def test_a_default_is_shown_as_a_user_would_write_it(kind: Kind, value: Any, text: str) -> None:
    assert kind.show(value) == text
    assert kind.read(text, "--x") == pytest.approx(value) if not isinstance(value, str) else value


def test_a_unit_holds_for_the_numbers_before_it_of_its_kind() -> None:
    kinds = [Length(), Angle(), Angle(), Length()]
    found = read_with_common_units(["1", "90", "-45deg", "30mm"], kinds, ["--x"] * 4)
    assert found == pytest.approx([1e-3, math.pi / 2, -math.pi / 4, 30e-3])
    assert Point("").read("1, -2, 800mm", "--x") == pytest.approx([1e-3, -2e-3, 0.8])
    with pytest.raises(truing.InputError, match="--joint 1: found '1', expected a length with its unit"):
        read_with_common_units(["1", "90deg"], kinds[:2], ["--joint 1", "--joint 2"])


def test_words_and_effects() -> None:
    assert Words("").read("dir, payload,", "--x") == ["dir", "payload"]
    assert EffectSize("").read("harmonic:J3:cos1=1e-4", "--x") == ("harmonic.J3.cos1", 1e-4)
    assert EffectSize("").read("backlash:J2=0.2mrad", "--x") == ("backlash.J2", 2e-4)
    assert EffectNames("").complete("drift,backl") == ["drift,backlash"]
