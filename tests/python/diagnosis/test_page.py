# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a diagnosis says what result.json says, for every verdict, escapes what it quotes, and stands
alone.
"""

from __future__ import annotations

import copy
import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pages import charts_of, visible
from truing.diagnosis.page import _unit_for, contender, diagnosis_report, size_text
from truing.exam.page import exam_report
from truing.report.json_text import to_json
from truing.report.rows import Rows, statistics

SENTENCES = {
    "none": "No gap beyond noise.",
    "effects": "Backlash at J2 causes the gap.",
    "unknown": "Something moves J1 that no known effect explains.",
    "effects+unknown": "Backlash at J2 causes most of the gap. Something at J1 is left.",
}
EXPLAINED = {
    "none": "no gap",
    "effects": "explained",
    "unknown": "not explained",
    "effects+unknown": "partly explained",
}


def some_rows(n: int = 100) -> Rows:
    rng = np.random.default_rng(0)
    absent, absent3 = np.full(n, np.nan), np.full((n, 3), np.nan)
    return Rows(
        ("J1", "J2"),
        ("rad", "m"),
        rng.uniform(-1, 1, (n, 2)),
        rng.uniform(-1, 1, (n, 3)),
        rng.normal(0, 2e-4, (n, 3)),
        rng.normal(0, 3e-5, (n, 3)),
        absent,
        absent,
        absent3,
        absent3,
        np.arange(n) % 5 == 0,
        np.arange(n) == 7,
        np.arange(n, dtype=np.int32),
    )


def some_result(verdict: str, **changes: Any) -> dict[str, Any]:
    rows = some_rows()
    held = {"before_rms_m": 3e-4, "after_rms_m": 6e-5, "shrink": 0.8, "ci": [0.75, 0.84], "n": 20}
    curve = {
        "site": "J2",
        "input": "dir2",
        "input_unit": "",
        "second": None,
        "unit": "rad",
        "points": [[-1, -2e-4, 1e-6], [1, 2e-4, 1e-6]],
        "samples": [[-1, -2.1e-4], [1, 1.9e-4]],
    }
    effect = {
        "effect": "backlash",
        "joints": ["J2"],
        "probability": 0.997,
        "held_out": held,
        "size_at_tip_m": 2.8e-4,
        "share": 0.8,
        "share_alone": 0.7,
        "share_last": 0.6,
        "note": "direction inferred",
        "parameters": [
            {
                "name": "backlash.J2",
                "nominal": 0.0,
                "value": 4e-4,
                "sigma": 5e-6,
                "unit": "rad",
                "frozen": False,
            }
        ],
        "curves": [curve],
        "confounded_with": [
            {"effect": "windup", "joints": ["J2"], "probability": 0.2, "separated_by": "two payloads"}
        ],
    }
    free = {
        "site": "J1",
        "input": "q1",
        "input_unit": "rad",
        "second": None,
        "unit": "rad",
        "points": [[-2.0, 0.0, 1e-5], [2.0, 1e-4, 1e-5]],
        "samples": [],
    }
    unknown = {
        "joint": "J1",
        "inputs": ["q1"],
        "probability": 0.93,
        "held_out": held,
        "size_at_tip_m": 1.1e-4,
        "share": 0.8,
        "curve": [[-2.0, 0.0]],
        "curves": [free],
        "looks_like": "a step at q1 = 0.4 rad",
    }
    effects, unknowns = [effect] * verdict.startswith("effects"), [unknown] * verdict.endswith("unknown")
    found = len(effects) + len(unknowns)
    share = 0.8 / found if found else 0.0
    parts = {
        "noise": 0.15 if found else 1.0,
        "effects": [share] * len(effects),
        "unknown": [share] * len(unknowns),
        "unexplained": 0.05 if found else 0.0,
    }
    result = {
        "format": "truing-diagnosis/1",
        "version": "0",
        "robot": "arm",
        "verdict": verdict,
        "explained": EXPLAINED[verdict],
        "sentence": SENTENCES[verdict],
        "gap": {
            **statistics(rows.magnitude_before),
            "noise_floor_m": 5e-5,
            "noise_from_repeats": True,
            "closable": 0.9,
            "p": 0.4,
            "parts": parts,
        },
        "after": {**statistics(rows.magnitude_after), "remaining_structure_p": 0.3},
        "after_unknown": statistics(rows.magnitude_after),
        "after_robot_with_unknown": None,
        "shrink": {"value": 0.8, "ci": [0.7, 0.9]},
        "effects": effects,
        "unknown": unknowns,
        "sanity": [],
        "where": {
            "joints": [{"joint": "J2", "share": 0.7, "ci": [0.6, 0.8]}],
            "inputs": [{"input": "dir2", "share": 0.9}, {"input": "q1", "share": 0.6}],
            "workspace": [
                {"center_m": [0.1, 0.2, 0.3], "rms_m": 2e-4, "n": 9},
                {"center_m": [0.1, 0.2, 0.5], "rms_m": 3e-4, "n": 3},
            ],
            "direction": [
                {"axis": [1.0, 0.0, 0.0], "rms_m": 2e-4},
                {"axis": [0.0, 1.0, 0.0], "rms_m": 1e-4},
                {"axis": [0.0, 0.0, 1.0], "rms_m": 5e-5},
            ],
        },
        "not_testable": [{"effect": "thermal", "joints": [], "why": "no column temp_C"}],
        "detectable": [
            {
                "effect": "gear_ratio",
                "joint": "J1",
                "parameter": "J1.ratio",
                "unit": "-",
                "size": 1.2e-4,
                "size_at_tip_m": 3e-5,
            }
        ],
        "candidates": [
            {
                "effect": "backlash",
                "joints": ["J2"],
                "columns": 1,
                "gain": 900.0,
                "evidence": 440.0,
                "held_out_gain": 0.5,
                "largest_z": 30.0,
            }
        ],
        "next_measurements": [
            {
                "joints": [0.5, 0.02],
                "direction": [1, -1],
                "payload_kg": None,
                "why": "tells backlash from windup",
            }
        ],
        "nearest_neighbour": {"p95_m": None, "share": 0.02},
        "joint_record": "q",
        "rows": rows.count,
        "outliers": [7],
        "seed": 0,
        "warnings": [],
    }
    return {**result, **changes}


@pytest.mark.parametrize("verdict", SENTENCES)
def test_the_first_screen_answers_what_and_where(verdict: str) -> None:
    text = visible(diagnosis_report(some_result(verdict), some_rows()))
    for part in re.split(r"(?<=\.) ", SENTENCES[verdict]):
        assert part in text
    assert ("robot.yaml alone" in text) == verdict.startswith(
        "effects"
    )  # it is less good than all that was named
    assert text.index("What the gap of") < text.index("Where in the workspace") < text.index("What is left")
    assert ("backlash at J2" in text[: text.index("Where in the workspace")]) == verdict.startswith("effects")
    assert ("unknown at J1" in text) == verdict.endswith("unknown")
    assert ("At which joints" in text) == (verdict != "none")


def test_without_a_gap_it_says_what_would_have_been_found() -> None:
    text = visible(diagnosis_report(some_result("none"), some_rows()))
    assert text.index("The smallest effects that would have been found") < text.index(
        "Where in the workspace"
    )
    assert "gear ratio J1 120 ppm 0.030 mm" in text
    assert text.count("The smallest effects that would have been found") == 1
    assert "Noise alone would look like this" in text and "→" not in text and "not explained" not in text


def test_a_named_effect_comes_with_its_numbers_and_its_rivals() -> None:
    page = diagnosis_report(some_result("effects"), some_rows())
    text = visible(page)
    assert "more than 99 % sure" in text
    assert "80 % less (75 % to 84 %)" in text
    assert "windup at J2 (20 %). To tell them apart: two payloads." in text
    assert "Note: direction inferred." in text
    assert {"effect0_0", "where_joints", "where_inputs", "map1", "map2", "distribution", "rows"} <= set(
        charts_of(page)
    )


def test_the_robot_file_is_said_to_leave_free_functions_out() -> None:
    text = visible(diagnosis_report(some_result("unknown"), some_rows()))
    assert "Its shape: a step at q1 = 22.9° ." in text and "The robot file leaves it out" in text


def test_curves_say_what_moves_and_for_which_values_of_a_second_input() -> None:
    result = some_result("effects+unknown")
    free = result["unknown"][0]["curves"][0]
    result["unknown"][0]["curves"] = [
        free | {"second": {"input": "q3", "unit": "rad", "range": ends}} for ends in ([-1.0, 0.0], [0.0, 1.0])
    ]
    result["effects"][0]["curves"][0]["site"] = "base.x"
    charts = charts_of(diagnosis_report(result, some_rows()))
    assert charts["effect0_0"]["layout"]["yaxis"]["title"]["text"] == "what it adds to base x [mrad]"
    assert [charts[f"unknown0_{k}"]["layout"]["title"]["text"] for k in range(2)] == [
        "q3 from −57.3 to 0 °",
        "q3 from 0 to 57.3 °",
    ]
    assert charts["unknown0_0"]["layout"]["yaxis"] == charts["unknown0_1"]["layout"]["yaxis"]


def test_the_order_of_a_transmission_error_is_said_in_words() -> None:
    result = some_result("effects", sentence="The gap shrinks: transmission_error@14 at J2.")
    result["effects"][0]["effect"] = "transmission_error@14"
    text = visible(diagnosis_report(result, some_rows()))
    assert "The gap shrinks: transmission error (14 per turn) at J2." in text and "@14 at" not in text


def test_a_curve_that_is_folded_says_its_period() -> None:
    result = some_result("effects")
    curve = result["effects"][0]["curves"][0]
    curve |= {
        "input": "q2",
        "input_unit": "rad",
        "period": 0.0628,
        "points": [[0.01, 1e-4, 1e-6], [0.06, -1e-4, 1e-6]],
    }
    charts = charts_of(diagnosis_report(result, some_rows()))
    assert charts["effect0_0"]["layout"]["xaxis"]["title"]["text"] == "q2, one period of 3.6 ° [°]"


def test_what_is_left_is_only_called_more_than_noise_where_it_has_structure() -> None:
    result = some_result("effects")
    assert "more than the noise, but no structure was found in it" in visible(
        diagnosis_report(result, some_rows())
    )
    result["after"]["remaining_structure_p"] = 0.01
    assert "more than noise, and nothing found explains it" in visible(diagnosis_report(result, some_rows()))


def test_an_effect_that_does_not_help_is_not_said_to_take_less_than_nothing() -> None:
    result = some_result("effects")
    result["effects"][0]["held_out"] |= {"shrink": -0.05, "ci": [-0.12, 0.01]}
    assert "5 % more (a fall of −12 % to 1.0 %)" in visible(diagnosis_report(result, some_rows()))


def test_how_the_data_were_read_is_no_trouble() -> None:
    result = some_result(
        "effects",
        sanity=[
            {"kind": "direction", "text": "directions were inferred", "rows": []},
            {"kind": "lag", "text": "they lag", "rows": []},
        ],
    )
    text = visible(diagnosis_report(result, some_rows()))
    assert (
        text.index("Look at the data first They lag")
        < text.index("What the gap of")
        < text.index("How the data were read Directions were inferred")
    )
    assert "columns dir1" in text


def test_a_gravity_that_was_corrected_is_said_in_the_head() -> None:
    text = "gravity points along -1.00 0.00 0.00 of the base, not as the file has it."
    result = some_result("effects", sanity=[{"kind": "gravity_direction", "text": text, "rows": []}])
    page = visible(diagnosis_report(result, some_rows()))
    assert f"Corrected first: {text}" in page and "Look at the data first" not in page


@pytest.mark.parametrize(("outliers", "first"), [(3, False), (12, True)])
def test_rows_that_count_little_are_a_warning_when_they_are_many(outliers: int, first: bool) -> None:
    found = [{"kind": "outliers", "text": "rows stand far out.", "rows": []}]
    result = some_result("effects", sanity=found, rows=100, outliers=list(range(outliers)))
    text = visible(diagnosis_report(result, some_rows()))
    assert ("Look at the data first Rows stand far out" in text) == first
    assert ("How the data were read Rows stand far out" in text) != first


@pytest.mark.parametrize("verdict", SENTENCES)
def test_the_first_screen_says_which_rows_its_errors_leave_out(verdict: str) -> None:
    rows = some_rows()
    held_out = np.flatnonzero(rows.test)

    def head(outliers: list[int], of: int) -> str:
        far = np.isin(np.arange(rows.count), outliers)
        result = some_result(verdict, outliers=outliers, rows=of)
        return visible(diagnosis_report(result, replace(rows, rejected=far))).partition("What the gap of")[0]

    assert "Without 2 held-out rows far out." in head(held_out[:2].tolist(), 100)
    assert "far out" not in head(held_out[:2].tolist(), 10)  # so many are no exceptions: they count
    assert "far out" not in head(np.flatnonzero(~rows.test)[:1].tolist(), 100)


@pytest.mark.parametrize("verdict", SENTENCES)
def test_the_badge_says_how_much_is_left(verdict: str) -> None:
    head = visible(diagnosis_report(some_result(verdict), some_rows())).partition("Rms error")[0]
    assert EXPLAINED[verdict] in head.partition(SENTENCES[verdict][:20])[0]


def test_what_the_gap_goes_with_is_shown_as_differences() -> None:
    result = some_result("effects")
    page = diagnosis_report(result, some_rows())
    assert charts_of(page)["where_inputs"]["data"][0]["x"] == pytest.approx([30.0, 0.0])
    assert "Each explains 60 %; the bars show what it explains beyond that." in visible(page)
    result["where"]["inputs"] = [{"input": f"q{k}", "share": 0.9 + 0.01 * k} for k in range(1, 5)]
    page = diagnosis_report(result, some_rows())
    assert "where_inputs" not in charts_of(page)
    assert "Nothing stands out: each of the 4 recorded inputs explains 91 % to 94 % of the gap." in visible(
        page
    )


def test_causes_have_their_size_at_the_tip_and_the_error_without_them() -> None:
    text = visible(diagnosis_report(some_result("effects"), some_rows()))
    held = some_result("effects")["effects"][0]["held_out"]
    assert "of the gap at the tip without it" in text
    line = text[text.index("backlash at J2 80 %") :].partition("sure")[0]
    assert "0.28 mm" in line and f"{1e3 * held['before_rms_m']:.2g}" in line


def test_a_rival_is_on_the_first_screen_where_it_must_be_reckoned_with() -> None:
    result = some_result("effects")
    (effect,) = result["effects"]
    assert contender(effect) is None  # 20 % of 99.7 %
    effect["confounded_with"][0]["probability"] = 0.4
    assert "or windup at J2" in visible(diagnosis_report(result, some_rows())).partition("Where in the")[0]


def test_trouble_with_the_data_comes_first() -> None:
    result = some_result(
        "effects", sanity=[{"kind": "duplicates", "text": "Rows 3 and 4 are equal.", "rows": [3, 4]}]
    )
    text = visible(diagnosis_report(result, some_rows()))
    assert text.index("Rows 3 and 4 are equal. (rows 3, 4, from 0)") < text.index("What the gap of")


def test_structure_that_is_left_is_not_called_noise() -> None:
    result = some_result("effects+unknown")
    result["after"]["remaining_structure_p"] = 0.001
    text = visible(diagnosis_report(result, some_rows()))
    assert "What is left has structure" in text and "looks like noise" not in text


def test_names_from_files_cannot_become_markup() -> None:
    evil = "<img src=x onerror=alert(1)>"
    text = json.dumps(
        some_result("effects+unknown", sanity=[{"kind": "x", "text": evil, "rows": []}], warnings=[evil])
    )
    for word in (
        "J1",
        "J2",
        "dir2",
        "backlash",
        "windup",
        "no column temp_C",
        "direction inferred",
        "tells backlash from windup",
        "arm",
    ):
        text = text.replace(f'"{word}"', json.dumps(evil))
    page = diagnosis_report(json.loads(text), some_rows())
    assert "<img" not in page[page.index("<body>") : page.index("<script>")]


def test_what_is_not_known_is_left_out_and_breaks_nothing() -> None:
    result = copy.deepcopy(some_result("effects+unknown"))
    result["effects"][0] |= {"curves": [], "parameters": [], "confounded_with": [], "note": "", "joints": []}
    result["unknown"][0] |= {"curves": [], "joint": "", "looks_like": ""}
    result["where"] = {
        "joints": [],
        "inputs": [],
        "workspace": [],
        "direction": [{"axis": [1, 0, 0], "rms_m": None}],
    }
    result |= {
        "candidates": [],
        "detectable": [],
        "not_testable": [],
        "next_measurements": [],
        "outliers": [],
    }
    result["after"]["remaining_structure_p"] = None
    result["nearest_neighbour"] = {"p95_m": None, "share": None}
    text = visible(diagnosis_report(result, some_rows(3)))
    assert "unknown somewhere" in text and "Unknown somewhere, over q1" in text


def test_many_effects_leave_the_first_screen_readable() -> None:
    result = some_result("effects")
    result["effects"] = result["effects"] * 9
    result["gap"]["parts"]["effects"] = [0.8 / 9] * 9
    text = visible(diagnosis_report(result, some_rows()))
    assert "4 smaller ones 36 %" in text


@pytest.mark.parametrize(
    ("value", "unit", "scale", "shown"),
    [
        (4e-4, "rad", 1e3, "mrad"),
        (2e-7, "rad/Nm", 1e6, "µrad/Nm"),
        (3e-4, "m", 1e3, "mm"),
        (5e-6, "m", 1e6, "µm"),
        (3e-4, "-", 1e6, "ppm"),
        (0.5, "-", 1.0, ""),
        (2e-5, "1/K", 1.0, "1/K"),
        (0.0, "rad", 1.0, "rad"),
        (-0.0020007, "s", 1e3, "ms"),
        (0.12, "s", 1.0, "s"),
    ],
)
def test_sizes_have_units_that_people_read(value: float, unit: str, scale: float, shown: str) -> None:
    assert _unit_for(value, unit) == (scale, shown)


def test_the_size_is_that_of_the_clearest_parameter() -> None:
    effect = some_result("effects")["effects"][0]
    effect["parameters"].append(
        {"name": "b", "nominal": 0.0, "value": 1e-3, "sigma": 1e-3, "unit": "rad", "frozen": False}
    )
    assert size_text(effect) == "backlash.J2 +0.400 ± 0.005 mrad, and 1 more"
    pair = [
        dict(effect["parameters"][0], name=f"wave.J2.{part}2", value=value)
        for part, value in (("cos", 3e-4), ("sin", -4e-4))
    ]
    assert size_text(effect | {"parameters": pair}) == "amplitude 0.500 ± 0.005 mrad"
    spring = dict(effect["parameters"][0], value=5e-6, sigma=1e-7, unit="rad/Nm")
    assert size_text(effect | {"parameters": [spring]}) == "stiffness 200 ± 4 kNm/rad"
    assert size_text(effect | {"parameters": [effect["parameters"][0]] * 4}) == "4 parameters"
    drift = {
        "effect": "drift",
        "joints": [],
        "parameters": [],
        "curves": [{"unit": "m", "points": [[0, -2e-5, 1e-6], [9, 1e-5, 1e-6]]}],
    }
    assert size_text(drift) == "up to 20\u202fµm"


def test_rows_of_numbers_stay_on_one_line_in_result_json() -> None:
    text = to_json({"curve": [[-2.0, 1e-4], [0, None]], "words": ["[1,\n 2]", "[ 1 ]"], "empty": []})
    assert "[-2.0, 0.0001]" in text and "[0, null]" in text
    assert json.loads(text) == {
        "curve": [[-2.0, 1e-4], [0, None]],
        "words": ["[1,\n 2]", "[ 1 ]"],
        "empty": [],
    }


def test_the_examination_is_a_table() -> None:
    scores = [
        {"score": "first effect right", "value": 0.98, "target": 0.97, "passed": True},
        {"score": "false alarms", "value": 0.2, "target": 0.02, "passed": False},
    ]
    text = visible(
        exam_report({"format": "truing-exam/1", "set": "development", "seed": 0, "scores": scores})
    )
    assert "1 of 2 targets met." in text and "first effect right 0.98 0.97 yes" in text
