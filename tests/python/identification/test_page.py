# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reports say what the numbers say, escape what they quote, and stand alone."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from typing import Any

import numpy as np
import pytest

from pages import visible
from truing.cli.commands.identify import worse_than_drawn
from truing.identification.page import identification_report, prediction_report
from truing.planning.page import plan_report
from truing.report.json_text import to_json, without_nan
from truing.report.rows import Rows, statistics
from truing.report.words import figures_text, length_text


def some_rows(n: int = 200, *, rejected: int = 2, test: bool = True) -> Rows:
    rng = np.random.default_rng(0)
    absent, absent3 = np.full(n, np.nan), np.full((n, 3), np.nan)
    out = np.zeros(n, dtype=bool)
    out[1 : 1 + rejected] = True
    after = rng.normal(0, 3e-5, (n, 3))
    after[out] += 5e-3
    held_out = (np.arange(n) % 5 == 0) if test else np.zeros(n, dtype=bool)
    return Rows(
        ("J1", "J2"),
        ("rad", "m"),
        rng.uniform(-1, 1, (n, 2)),
        rng.uniform(-1, 1, (n, 3)),
        rng.normal(0, 1e-3, (n, 3)),
        after,
        absent,
        absent,
        absent3,
        absent3,
        held_out,
        out,
        np.arange(n, dtype=np.int32),
    )


def some_result(rows: Rows, **changes: Any) -> dict[str, Any]:
    sets = {"train": ~rows.test & ~rows.rejected, "test": rows.test}
    result = {
        "format": "truing-identification/1",
        "version": "0",
        "robot": "arm",
        "seed": 0,
        "warnings": [],
        "rank": 2,
        "columns": 3,
        "noise_sigma_m": 3e-5,
        "errors": {
            name: {
                "before": statistics(rows.magnitude_before[chosen]),
                "after": statistics(rows.magnitude_after[chosen]),
            }
            for name, chosen in sets.items()
            if chosen.any()
        },
        "parameters": [
            {"name": "J1.a", "nominal": 0.3, "value": 0.3012, "sigma": 1e-5, "unit": "m", "frozen": False},
            {
                "name": "J2.ratio",
                "nominal": 1.0,
                "value": 1.0001,
                "sigma": 2e-6,
                "unit": "-",
                "frozen": False,
            },
            {"name": "J1.d", "nominal": 0.1, "value": 0.1, "sigma": None, "unit": "m", "frozen": True},
        ],
        "effects": [],
        "frozen": [
            {"parameter": "J1.d", "combination": {"J1.d": 1.0, "base.z": -1.0}, "why": "J1 turns about z"}
        ],
        "rejected_rows": [int(k) for k in np.flatnonzero(rows.rejected)],
        "solver": {"name": "lm", "iterations": 4, "converged": True, "stopped_because": "enough"},
    }
    return {**result, **changes}


def test_what_is_worse_than_the_robot_as_drawn_is_never_called_usable() -> None:
    rows = some_rows(rejected=0)
    good = visible(identification_report(some_result(rows), rows))
    assert "Worse than the robot as drawn" not in good and "Do not rely on this" not in good
    worse = dataclasses.replace(rows, error_before=rows.error_after, error_after=rows.error_before)
    text = visible(identification_report(some_result(worse), worse))
    assert "Worse than the robot as drawn" in text and "Do not rely on this yet" in text
    assert "Usable" not in text
    errors = some_result(worse)["errors"]
    assert "worse than by the robot as drawn" in worse_than_drawn(errors)
    assert worse_than_drawn(some_result(rows)["errors"]) == ""


def test_the_first_screen_answers_how_accurate_it_was_and_is() -> None:
    rows = some_rows()
    result = some_result(rows)
    text = visible(identification_report(result, rows))
    errors = result["errors"]["test"]
    was, now = (length_text(errors[when]["mean_m"]).replace("\u202f", " ") for when in ("before", "after"))
    assert f"arm was off by {was} on average. Calibrated, it is off by {now} ." in text
    assert "40 rows that the fit never saw" in text
    assert (
        text.index("95 % of errors are below")
        < text.index("You can trust this calibration")
        < text.index("Where in the workspace")
    )


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {
                "solver": {
                    "name": "lm",
                    "iterations": 100,
                    "converged": False,
                    "stopped_because": "iteration limit",
                }
            },
            "Do not rely on this yet",
        ),
        ({"rank": 150}, "Do not rely on this yet"),
        ({"warnings": ["the tracker moved"]}, "Usable, but look at the marked points"),
        ({"warnings": ["2 training rows left out as gross outliers"]}, "You can trust this calibration"),
    ],
)
def test_the_verdict_follows_the_worst_check(changes: dict[str, Any], expected: str) -> None:
    rows = some_rows()
    assert expected in visible(identification_report(some_result(rows, **changes), rows))


def test_overfitting_and_bad_held_out_rows_are_told_apart() -> None:
    rows = some_rows()
    worse = rows.error_after.copy()
    worse[rows.test] *= 4
    overfitted = dataclasses.replace(rows, error_after=worse)
    text = visible(identification_report(some_result(overfitted), overfitted))
    assert "Unseen poses are much worse than fitted ones" in text and "bad measurements" not in text
    wild = rows.error_after.copy()
    wild[0] += 4e-3
    assert rows.test[0]
    spoiled = dataclasses.replace(rows, error_after=wild)
    text = visible(identification_report(some_result(spoiled), spoiled))
    assert (
        "1 held-out row looks like a bad measurement" in text
        and "Unseen poses are as good as fitted ones" in text
    )


def test_without_held_out_rows_it_says_so() -> None:
    rows = some_rows(test=False)
    text = visible(identification_report(some_result(rows), rows))
    assert "because nothing was held out" in text and "Nothing was held out" in text


def test_a_calibration_that_made_it_worse_is_not_sold_as_better() -> None:
    rows = some_rows()
    swapped = dataclasses.replace(rows, error_before=rows.error_after, error_after=rows.error_before)
    text = visible(identification_report(some_result(swapped), swapped))
    assert "Calibration made arm worse" in text and "× worse" in text and "× better" not in text


def test_frozen_combinations_are_sentences() -> None:
    rows = some_rows()
    text = visible(identification_report(some_result(rows), rows))
    assert "Changing J1.d together with base.z (-1) changes no measurement" in text
    assert "J1 turns about z" in text


def test_names_from_files_cannot_become_markup() -> None:
    rows = dataclasses.replace(some_rows(), joint_names=("</script><b>", "J2"))
    evil = "<img src=x onerror=alert(1)>"
    result = some_result(rows, robot=evil, warnings=[evil])
    result["parameters"][0]["name"] = evil
    result["frozen"][0]["combination"][evil] = 1.0
    page = identification_report(result, rows, ([evil, "b"], np.eye(2)))
    charts = re.search(r'id="charts">(.*?)</script>', page, flags=re.DOTALL)
    assert charts is not None
    assert any(chart["id"] == "correlation" for chart in json.loads(charts[1]))
    assert "<img" not in page.replace(charts[0], "")[page.index("<body>") : page.index("<body>") + 30000]


def test_large_data_is_subsampled_and_says_so() -> None:
    rows = some_rows(30000)
    page = identification_report(some_result(rows), rows)
    assert len(page) < 2e6
    assert "drawn of 29 998 rows" in visible(page)


def test_charts_carry_the_rows() -> None:
    rows = some_rows()
    page = identification_report(some_result(rows), rows)
    charts = {
        chart["id"]: chart
        for chart in json.loads(re.search(r'id="charts">(.*?)</script>', page, flags=re.DOTALL)[1])
    }  # type: ignore[index]
    assert {"distribution", "joint0", "joint1", "rows"} <= set(charts)
    after = charts["rows"]["data"][1]
    values = np.frombuffer(base64.b64decode(after["y"]["bdata"]), dtype=after["y"]["dtype"])
    assert values == pytest.approx(rows.magnitude_after[~rows.rejected] * 1e3, rel=1e-6)


@pytest.mark.parametrize("n", [3, 8])
def test_very_small_data_still_makes_a_page(n: int) -> None:
    rows = some_rows(n, rejected=1)
    assert "off by" in visible(identification_report(some_result(rows), rows))


def test_distances_have_their_own_words() -> None:
    rows = some_rows()
    nothing = np.full_like(rows.error_after, np.nan)
    wire = dataclasses.replace(
        rows,
        error_before=nothing,
        error_after=nothing,
        distance_before=rows.error_before[:, 0],
        distance_after=rows.error_after[:, 0],
    )
    assert wire.what == "distance" and wire.numbers_per_row == 1
    assert "held-out distance errors" in visible(identification_report(some_result(wire), wire))


def test_prediction_and_plan_reports() -> None:
    rows = some_rows()
    compared = {
        "format": "truing-prediction/1",
        "robot": "arm",
        "rows": rows.count,
        "warnings": [],
        "errors": statistics(rows.magnitude_after),
    }
    assert "misses the measurements by" in visible(prediction_report(compared, rows))
    bare = {"format": "truing-prediction/1", "robot": "arm", "rows": 7, "warnings": ["odd"]}
    assert "7 rows predicted." in visible(prediction_report(bare, None)) and "odd" in visible(
        prediction_report(bare, None)
    )
    plan = {
        **some_result(rows),
        "format": "truing-plan/1",
        "noise_m": 3e-5,
        "index": {"name": "d_optimal", "start": 1.0, "end": 2.0, "exchanges": 3},
    }
    del plan["solver"]
    text = visible(plan_report(plan, ["J1", "J2"], rows.joints, ["rad", "m"]))
    assert "200 poses will find lengths to ±0.010 mm" in text and "cannot be found" in text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.9234, "1.92"),
        (0.05234, "0.052"),
        (12.345, "12.3"),
        (1234.5, "1230"),
        (0.00012345, "0.00012"),
        (0.0, "0"),
        (0.0999, "0.10"),
    ],
)
def test_numbers_have_the_figures_that_mean_something(value: float, text: str) -> None:
    assert figures_text(value) == text


def test_json_has_no_nan() -> None:
    text = to_json({"a": float("nan"), "b": [np.float64("inf"), np.int32(3)], "c": np.array([1.0, np.nan])})
    assert json.loads(text) == {"a": None, "b": [None, 3], "c": [1.0, None]}
    assert without_nan((1, 2)) == [1, 2]


def test_statistics_leave_out_rows_without_a_measurement() -> None:
    found = statistics(np.array([3e-3, np.nan, 4e-3]))
    assert (
        found["n"] == 2 and found["rms_m"] == pytest.approx(np.sqrt(12.5) * 1e-3) and found["max_m"] == 4e-3
    )
    assert statistics(np.array([np.nan]))["mean_m"] is None
