# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a diagnosis from commands: the answer first, motion and errors, what to record next."""

from __future__ import annotations

import copy
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from pages import charts_of, faults_of, visible
from truing.dynamics.sanity import RecordingFinding
from truing.dynamics.servo.chain import ServoChain, ServoJoint
from truing.dynamics.servo.export import is_servo_result, load_servo_result
from truing.dynamics.servo.page import main_number, mean_error, paths_of, servo_report, telling, worst_first
from truing.dynamics.servo.result import (
    WHOLE,
    FoundServoEffect,
    ServoAlternative,
    ServoClass,
    ServoCovariance,
    ServoDiagnosis,
    ServoParameter,
    ServoRollout,
    ServoTrace,
    UnknownMotion,
    servo_dict,
)
from truing.dynamics.servo.written import held_rows, write_servo
from truing.files import load_commanded_motion

JOINTS = ("shoulder", "elbow <script>")


def chain(gain: float, law: float = 1.0) -> ServoChain:
    drives = (ServoJoint(command_gain=gain, viscous=0.5), ServoJoint(command_gain=gain, drive_law=law))
    return ServoChain(joints=JOINTS, prismatic=(False, False), drives=drives)


def rollout() -> ServoRollout:
    """Errors of 2, 1 and 0.4 degrees at the elbow, half of it at the shoulder; less at short horizons."""
    sizes = {"nominal": 2.0, "standard": 1.0, "named": 0.4}
    table = {m: np.radians(np.outer([0.5, 1.0], [0.3, 0.6, 1.0, 1.1]) * s) for m, s in sizes.items()}
    return ServoRollout(
        horizons=(0.1, 0.5, 5.0, WHOLE),
        joints=JOINTS,
        units=("rad", "rad"),
        windows=(60, 60, 12, 2),
        errors=table,
        regimes={m: {"reversals": t[:, 2], "holding": t[:, 0] * math.nan} for m, t in table.items()},
        recordings={m: {"slow": t[:, 0], "waypoints": t[:, 2]} for m, t in table.items()},
        main_horizon=5.0,
    )


def trace(recording: str, joint: str) -> ServoTrace:
    time = np.arange(0.0, 12.0, 0.02)
    command = np.radians(30.0) * np.sign(np.sin(time))
    measured = np.radians(28.0) * np.tanh(3.0 * np.sin(time))
    simulated = {}
    for model, off in (("nominal", 2.0), ("standard", 1.0), ("named", 0.4)):
        path = measured + np.radians(off) * np.sin(3.0 * time)
        path[::250] = np.nan
        simulated[model] = path
    return ServoTrace(recording, joint, "rad", time, command, measured, simulated)


def parameter(name: str, value: float) -> ServoParameter:
    return ServoParameter(name, value, 0.02, "1", 1.0, 1.0)


def diagnosis() -> ServoDiagnosis:
    elbow = JOINTS[1]
    law = FoundServoEffect(
        effect="drive_law",
        joints=(elbow,),
        standard=False,
        probability=0.97,
        parameters=(parameter(f"drive_law.{elbow}", 0.62),),
        share=0.7,
        ci=(0.6, 0.8),
        before_rms=math.radians(1.0),
        after_rms=math.radians(0.4),
        confounded_with=(ServoAlternative("dead_band", (elbow,), 0.1, "small steps"),),
        sentence=f"A drive whose torque grows less than its effort at {elbow}: exponent 0.62",
    )
    return ServoDiagnosis(
        robot="two servos",
        verdict="effects+unknown",
        sentence="The elbow's drive gives less torque for a large effort: exponent 0.62 instead of 1",
        effects=(law,),
        unknown=(
            UnknownMotion(
                "shoulder", ("angle",), 0.9, 0.1, (0.05, 0.15), ((-1.0, 0.1, 0.01), (1.0, -0.1, 0.01))
            ),
        ),
        classes=(
            ServoClass(
                ("delay", "viscous"), "delay and damping are alike at low frequency", "a faster chirp"
            ),
        ),
        record_next=("a faster chirp", "a known weight at the gripper"),
        chains={"nominal": chain(900.0), "standard": chain(18.0), "named": chain(20.0, 0.62)},
        covariance=ServoCovariance((), (), (), np.zeros(0), np.zeros((0, 0)), np.zeros(0)),
        rollout=rollout(),
        where={},
        not_testable=(("thermal_friction", JOINTS, "no temperature was recorded"),),
        held_out=("slow", "waypoints"),
        warnings=("a warning",),
        mjcf="",
        traces=tuple(trace(recording, joint) for recording in ("slow", "waypoints") for joint in JOINTS),
    )


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    return servo_dict(diagnosis())


@pytest.fixture(scope="module")
def page(result: dict[str, Any]) -> str:
    return servo_report(result, [vars(one) for one in diagnosis().traces])


def test_the_first_screen_answers(result: dict[str, Any], page: str) -> None:
    text = visible(page)
    assert text.index("exponent 0.62 instead of 1") < text.index("measured")
    # Mean of the joints at 5 s: three quarters of the elbow's.
    assert "1.50° with the file, 0.75° with the usual parameters, 0.30° with what was named" in text
    assert mean_error(result, "standard") == pytest.approx(math.radians(0.75))
    assert main_number(result) == 2 and worst_first(result)[0] == JOINTS[1]


def test_motion_is_drawn_where_the_names_help_most(result: dict[str, Any], page: str) -> None:
    assert telling(result) == {joint: "waypoints" for joint in JOINTS}
    chart = charts_of(page)["motion"]
    shown = [t["name"] for t in chart["data"] if t["visible"]]
    assert shown == ["commanded", "measured", "nominal", "standard", "named", "start"]
    paths = paths_of([vars(t) for t in diagnosis().traces], worst_first(result), telling(result))
    assert paths[0]["recording"] == "waypoints" and paths[0]["unit"] == "°"
    # A line breaks where the next simulation begins, and nothing is drawn before the first.
    assert np.isfinite(paths[0]["ahead"][0]) and np.isnan(paths[0]["ahead"]).sum() == 2
    assert np.abs(paths[0]["measured"]).max() == pytest.approx(28.0, abs=0.5)


def test_errors_of_every_joint_at_every_horizon_can_be_chosen(page: str) -> None:
    chart = charts_of(page)["errors"]
    assert len(chart["data"]) == 4 * 3 and sum(t["visible"] for t in chart["data"]) == 3
    labels = [b["label"] for b in chart["layout"]["updatemenus"][0]["buttons"]]
    assert labels == ["0.1 s", "0.5 s", "5 s", "whole recordings"]
    named = next(t for t in chart["data"] if t["visible"] and t["name"] == "named")
    assert named["customdata"] == [pytest.approx(0.2), pytest.approx(0.4)]


def test_causes_classes_and_what_to_record_are_said(page: str) -> None:
    text = visible(page)
    for words in (
        "a drive whose torque grows less than its effort",
        "or dead band at elbow",
        "70.0 % 60.0 to 80.0",
        "0.62 ± 0.020",
        "delay and damping are alike at low frequency Record a faster chirp",
        "a known weight at the gripper",
        "something goes with angle",
        "turning round",
        "no temperature was recorded",
        "a warning",
        "900 → 20.0",
    ):
        assert words in text, words
    assert text.count("a faster chirp") == 1


def test_names_of_joints_stay_text(page: str) -> None:
    assert "elbow <script>" not in page and "elbow &lt;script&gt;" in page


def test_a_diagnosis_that_names_nothing_has_its_page(result: dict[str, Any]) -> None:
    bare = copy.deepcopy(result)
    bare.update(verdict="none", effects=[], unknown=[], classes=[], record_next=[], not_testable=[])
    text = visible(servo_report(bare, []))
    assert "Nothing beyond the usual parameters" in text and "No held-out stretch to draw" in text
    assert "no further cause found" in text


def test_the_folder_holds_what_export_and_randomise_read(tmp_path: Path) -> None:
    time = np.arange(200) / 50.0
    position = np.zeros((200, 2))
    recordings = [
        truing.dynamics.Recording(
            name,
            time=time,
            position=position,
            command=position + 0.1,
            columns={"kp1_raw": np.full(200, 16.0)},
            test=name != "fitted",
        )
        for name in ("slow", "fitted")
    ]
    found = replace(diagnosis(), mjcf="<mujoco/>", held_out=("slow",))
    written = write_servo(tmp_path, found, recordings)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"result.json", "report.html", "arm.xml", "motion.parquet"}
    assert list(faults_of((tmp_path / "report.html").read_text(encoding="utf-8"))) == []
    assert is_servo_result(tmp_path) and load_servo_result(tmp_path).chains["named"] == found.chains["named"]
    motion = load_commanded_motion(tmp_path / "motion.parquet", (False, False))
    assert [(r.name, bool(held.all()), bool(held.any())) for r, held in motion] == [
        ("slow", True, True),
        ("fitted", False, False),
    ]
    np.testing.assert_allclose(motion[0][0].command, 0.1)
    assert motion[0][0].columns["kp1_raw"][0] == 16.0
    assert truing.dynamics.randomisation(tmp_path).classes == (written["classes"][0]["sentence"],)
    # Where no recording was held out by name, blocks of time were.
    rows = held_rows(replace(found, held_out=("blocks of time",)), recordings, 0.3)
    assert 0.2 < np.mean(rows[0]) < 0.4


def test_mistakes_in_the_recordings_come_first() -> None:
    wrong = RecordingFinding(
        "command_sign", (), ("elbow",), "elbow goes the other way", -1.0, "-", mistake=True
    )
    read = RecordingFinding("command_unit", (), (), "commands are in deg", 57.3, "-", applied=True)
    page = servo_report(servo_dict(diagnosis(), sanity=[wrong, read]), [])
    assert "data to be corrected" in page and "Corrected first:</b> commands are in deg" in page
    assert page.index("elbow goes the other way") < page.index('<div class="first">')


@pytest.mark.parametrize(("left", "said"), [(0.2, "explained"), (0.8, "partly explained")])
def test_the_badge_says_how_much_is_left(result: dict[str, Any], left: float, said: str) -> None:
    some = copy.deepcopy(result)
    some["verdict"] = "effects"
    errors = some["rollout"]["held_out"]
    for joint, values in errors["standard"].items():
        errors["named"][joint] = [None if value is None else left * value for value in values]
    badge = re.search(r'class="verdict \w+">([^<]*)<', servo_report(some, []))
    assert badge is not None and badge[1] == said
