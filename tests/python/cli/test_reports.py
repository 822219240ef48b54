# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of every command that writes one: small, alone, safe, and readable without its script."""

from __future__ import annotations

import re
import shutil
from functools import partial
from pathlib import Path

import pytest

import truing.testing.dynamics
from fuzz_commands import COMMANDS as SMALL, write_sound_files
from pages import LARGEST, faults_of
from truing.cli import app, main
from truing.report.page import Page

FLEET = ["robot.yaml", "arms", "--workers", "0", "--out"]
# Every command by its words; where it is to write a report, one or more ways to call it, with the folder that
# it writes to as the last word. Later ones may read what earlier ones wrote.
REPORTS: dict[str, list[list[str]]] = {
    **{
        command: [[*SMALL[case][1], "--out", case.replace(" ", "-")] for case in cases]
        for command, cases in {
            "apply": ["apply kuka"],
            "compensate": ["compensate"],
            "diagnose": ["diagnose"],
            "dynamics compare": ["dynamics compare"],
            "dynamics diagnose": ["dynamics diagnose"],
            "dynamics export": ["dynamics export"],
            "dynamics identify": ["dynamics identify"],
            "dynamics predict": ["dynamics predict"],
            "handeye": ["handeye"],
            "identify": ["identify"],
            "ik": ["ik", "ik program"],
            "performance plan": ["performance plan"],
            "performance report": ["performance report"],
            "plan": ["plan"],
            "predict": ["predict", "predict urdf"],
            "track calibrate": ["track calibrate"],
            "track run": ["track run"],
        }.items()
    },
    "demo": [["demo", "--out", "demo"]],
    "dynamics demo": [["dynamics", "demo", "--out", "dynamics-demo"]],
    "dynamics plan": [["dynamics", "plan", "moving.yaml", "--duration", "10s", "--out", "dynamics-plan"]],
    "dynamics randomise": [["dynamics", "randomise", "dynamics-demo", "--out", "randomise"]],
    "exam": [["exam", "--sets", "none/0", "--workers", "1", "--out", "exam"]],
    "fleet diagnose": [["fleet", "diagnose", *FLEET, "fleet-diagnose"]],
    "fleet dynamics": [["fleet", "dynamics", "moving.yaml", "moved", *FLEET[2:], "fleet-dynamics"]],
    "fleet identify": [["fleet", "identify", *FLEET, "fleet-identify"]],
}
WITHOUT = ["effects", "export", "load", "simulate"]


def commands(folder: Path = app.COMMANDS) -> list[str]:
    """The words of every command there is."""
    found = []
    for name, place in app.places(folder).items():
        found += [f"{name} {more}" for more in commands(place.path)] if place.is_group else [name]
    return found


def test_every_command_is_here() -> None:
    assert sorted([*REPORTS, *WITHOUT]) == sorted(commands())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small inputs for all of them."""
    place = tmp_path_factory.mktemp("reports")
    write_sound_files(place, seconds=14)
    for name in ("a1", "a2", "a3"):
        arguments = ["simulate", str(place / "robot.yaml"), "--poses", "40", "--seed", name[1]]
        assert main([*arguments, "--out", str(place / name)]) == 0
        (place / "arms").mkdir(exist_ok=True)
        shutil.copy(place / name / "measurements.csv", place / "arms" / f"{name}.csv")
    (place / "moved").mkdir()
    for name in ("motion1.csv", "motion2.csv"):
        shutil.copy(place / name, place / "moved" / name)
    return place


@pytest.mark.parametrize("command", REPORTS)
def test_a_report_is_one_small_file_that_stands_alone(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if command == "exam":
        pytest.importorskip("mujoco")
    if command == "handeye":
        pytest.importorskip("cv2")
    short = partial(truing.testing.dynamics.simulate_motion, seconds=6.0, recordings=2, held_out=1)
    monkeypatch.setattr(truing.testing.dynamics, "simulate_motion", short)  # of `dynamics demo`
    monkeypatch.chdir(folder)
    for arguments in REPORTS[command]:
        assert main(arguments) in (0, 1)
        page = (folder / arguments[-1] / "report.html").read_text(encoding="utf-8")
        assert list(faults_of(page)) == []


@pytest.mark.parametrize(
    ("markup", "fault"),
    [
        ('<img src="https://example.org/a.png">', "fetches"),
        ("<style>@import 'a.css';</style>", "fetches"),
        ('<p style="background: url(//example.org/a)">text</p>', "fetches"),
        ('<p onclick="go()">text</p>', "runs a script"),
        ("<p>0.3 mm, nan mm</p>", "shows nan"),
        ("<p>J1 by None</p>", "shows None"),
        ("<p>see https://example.org</p>", "shows https"),
        ("<div><p>text</div></p>", "closes"),
        (f"<p>{'x' * LARGEST}</p>", "bytes"),
        ("", "next to nothing"),
    ],
)
def test_a_fault_of_a_report_is_seen(markup: str, fault: str) -> None:
    page = Page("a report")
    page.add(markup)
    assert any(fault in said for said in faults_of(page.html()))


def test_a_report_whose_pictures_need_the_script_or_whose_policy_is_wide_is_seen() -> None:
    page = Page("a report")
    page.add(f"<p>{'word ' * 60}</p>")
    page.chart("bars", [{"type": "bar", "x": ["a", "b"], "y": [1.0, 2.0]}], {}, size="small")
    sound = page.html()
    assert list(faults_of(sound)) == []
    blank = re.sub("<svg.*?</svg>", "", sound)
    assert "without its script there is no bars" in list(faults_of(blank))
    for before, after in (
        ("default-src 'none'", "default-src https:"),
        ("img-src data:", "img-src https: data:"),
    ):
        assert any("policy" in said for said in faults_of(sound.replace(before, after)))
