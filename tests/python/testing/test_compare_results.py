# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""bench/compare_results.py sees what differs between two collections of results, and in standard errors."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

import pytest

_PATH = Path(__file__).resolve().parents[3] / "bench/compare_results.py"
_SPEC = importlib.util.spec_from_file_location("compare_results", _PATH)
assert _SPEC is not None and _SPEC.loader is not None
compare_results: Any = importlib.util.module_from_spec(_SPEC)
sys.modules["compare_results"] = compare_results  # its dataclasses look themselves up
_SPEC.loader.exec_module(compare_results)

RESULT: dict[str, Any] = {
    "version": "0.1.0",
    "verdict": "effects",
    "sentence": "It is backlash at J3.",
    "rank": 27,
    "parameters": [{"name": "J1.a", "value": 0.25, "sigma": 2e-5, "unit": "m"}],
    "camera": {"x_m": 0.04, "qw": 0.5, "sigma": {"x_m": 1e-4, "rx_rad": 1e-3}},
    "clock": {"offset_s": 0.35, "sigma_s": 1e-3},
}
FILES = {
    "residuals.csv": "row,x_m,sigma_x_m,status\n0,0.1,1e-4,ok\n1,0.2,1e-4,out of reach by 2 m\n",
    "robot.yaml": "# found\njoints:\n  - {name: J1, a: 0.25}\ncalibration: {date: 2026-01-01, rms_m: 1e-4}\n",
    "report.html": '<script id="charts">[{"id": "bars", "data": [{"y": [1.0, 2.0]}]}]</script>',
    "stderr.txt": "warning: old",
}


def write(folder: Path, result: dict[str, Any], **files: str) -> Path:
    """One run of a collection."""
    (folder / "run").mkdir(parents=True)
    (folder / "run/result.json").write_text(json.dumps(result))
    for name, text in (FILES | {name.replace("_", "."): text for name, text in files.items()}).items():
        (folder / "run" / name).write_text(text)
    return folder


def compared(tmp_path: Path, changes: dict[str, Any], **files: str) -> Any:
    """RESULT and FILES against the same with changes: {path in RESULT: value}."""
    changed = json.loads(json.dumps(RESULT))
    for path, value in changes.items():
        *parents, last = [int(word) if word.isdigit() else word for word in path.split(".")]
        at = changed
        for word in parents:
            at = at[word]
        at[last] = value
    (result,) = compare_results.compare(
        write(tmp_path / "a", RESULT), write(tmp_path / "b", changed, **files)
    )
    return result


def test_the_same_is_bit_equal(tmp_path: Path) -> None:
    result = compared(tmp_path, {})
    assert result.bit_equal and result.files == 4


def test_versions_dates_comments_and_what_is_added_do_not_count(tmp_path: Path) -> None:
    yaml = FILES["robot.yaml"].replace("2026-01-01", "2027-02-02").replace("# found", "# calibrated")
    result = compared(tmp_path, {"version": "0.2.0", "more": 1}, robot_yaml=yaml, stderr_txt="warning: new")
    assert result.bit_equal and result.added == ["result.json: more"]


def test_sentences_are_counted_and_names_must_be_the_same(tmp_path: Path) -> None:
    result = compared(tmp_path / "sentence", {"sentence": "Backlash at J3."})
    assert result.bit_equal and len(result.words) == 1
    assert not compared(tmp_path / "name", {"verdict": "none"}).same


@pytest.mark.parametrize(
    ("path", "value", "errors"),
    [
        ("parameters.0.value", 0.25 + 1e-14, 5e-10),
        ("parameters.0.value", 0.25 + 1e-9, 5e-5),
        ("parameters.0.sigma", 2e-5 * (1 + 1e-6), 1e-6),
        ("camera.x_m", 0.04 + 1e-9, 1e-5),
        ("camera.qw", 0.5 + 1e-9, 1e-6),
        ("clock.offset_s", 0.35 + 1e-9, 1e-6),
        ("rank", 26, 1 / 27),
    ],
)
def test_numbers_are_told_in_the_standard_errors_beside_them(
    tmp_path: Path, path: str, value: float, errors: float
) -> None:
    result = compared(tmp_path, {path: value})
    assert result.largest == pytest.approx(errors, rel=0.02)
    assert not result.bit_equal and result.same == (errors <= compare_results.LIMIT)


@pytest.mark.parametrize("name", ["residuals.csv", "robot.yaml", "report.html"])
def test_numbers_in_other_files_are_seen(tmp_path: Path, name: str) -> None:
    for old, new in (("0.2,", "0.2000001,"), ("0.25", "0.2500001"), ("2.0]", "2.0000001]")):
        if old in FILES[name]:
            assert not compared(tmp_path, {}, **{name.replace(".", "_"): FILES[name].replace(old, new)}).same
            return
    raise AssertionError(name)


def test_what_is_gone_is_a_difference(tmp_path: Path) -> None:
    a, b = write(tmp_path / "a", RESULT), write(tmp_path / "b", {})
    (b / "run/residuals.csv").unlink()
    (result,) = compare_results.compare(a, b)
    assert {"result.json: rank is missing", "residuals.csv is missing"} <= set(result.wrong)


def test_every_run_builds_on_runs_before_it_and_names_are_unique() -> None:
    cases = compare_results.listed()
    lines = [line for line in compare_results.CASES.read_text(encoding="utf-8").splitlines() if ": " in line]
    assert len(cases) == sum(not line.startswith("#") for line in lines) > 150
    seen = {"in", "data", "examples"}
    for name, command in cases.items():
        assert compare_results.needed(command) <= seen, name
        seen.add(name)


def test_the_exit_status_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = str(write(tmp_path / "a", RESULT)), str(write(tmp_path / "b", {**RESULT, "rank": 26}))
    assert compare_results.main(["compare", a, a]) == 0
    assert compare_results.main(["compare", a, b]) == 1
    assert "1 differ" in capsys.readouterr().out.splitlines()[-2]
