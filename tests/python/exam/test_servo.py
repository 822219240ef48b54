# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms of the dynamic half: firmware does what its words say, nulls hide nothing, effects have the size
of their label, and the scorer judges made-up answers as its page promises.
"""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import truing

pytest.importorskip("mujoco")

from truing.exam.answers import Answer, Named
from truing.exam.dynamics import sets
from truing.exam.dynamics.answers import answer_of
from truing.exam.dynamics.score import score
from truing.exam.dynamics.servo import courses, effects, families, firmware, sizing
from truing.exam.dynamics.servo.arms import Plant, Servo, plant, servos
from truing.exam.dynamics.servo.stage import PARTS, make_case, stage
from truing.exam.dynamics.servo_score import SERVO_LINES, SERVO_MORE, class_returned, single_wrong_name
from truing.exam.scenes import Request
from truing.exam.score import Sheet

CATALOGUE = set(
    """delay command_gain saturation rate_limit dead_band integral_gain damping_gain drive_law supply_sag
    load_friction stribeck thermal_friction backlash joint_elasticity payload""".split()
)
SERVO = [family for family in sets.COUNTS if family.startswith("servo_")]


def request_of(number: int, family: str = "servo_single", which: str = "development") -> Request:
    return Request(f"{which}/{family}/{number}", which, family, number, np.random.default_rng(number))


def lever() -> tuple[Servo, Plant]:
    servo = servos("development")[0]
    return servo, plant(servo, np.random.default_rng(3), 0.0)


def held(servo: Servo, to: float, rate: float = 100.0) -> courses.Course:
    """A command that steps once."""
    t = np.arange(round(courses.SECONDS * rate)) / rate
    return courses.Course("steps", rate, np.repeat(np.where(t < 1.0, 0.0, to)[:, None], servo.n, axis=1))


def along(p: Plant, course: courses.Course) -> firmware.Run:
    cool = firmware.Conditions(np.full_like(course.u, 25.0))
    return firmware.play([p], [course], [cool])[0][0]


# ---- Firmware and gears --------------------------------------------------------------------------


def test_a_servo_sags_by_its_weight_over_its_gain() -> None:
    servo, p = lever()
    p = replace(p, coulomb=np.zeros(1))
    run = along(p, held(servo, 1.0))
    q = float(run.q[-1, 0])
    link = servo.arm.links[0]
    com = link.com
    moment = -link.mass * 9.81 * (-com[2] * np.sin(q) - com[0] * np.cos(q))
    assert p.gain[0] * (1.0 - q) == pytest.approx(-moment, rel=0.02)


def test_a_delay_is_late_by_itself() -> None:
    servo, p = lever()
    course = held(servo, 0.8)
    late = along(p.at(0, delay=0.05), course)
    assert np.allclose(late.q[10:, 0], along(p, course).q[:-5, 0][5:], atol=2e-3)


def test_torque_stops_at_its_limit_and_a_dead_band_is_not_answered() -> None:
    servo, p = lever()
    limited = along(p.at(0, limit=1.5), held(servo, 1.2))
    assert np.abs(limited.torque).max() == pytest.approx(1.5)
    idle = along(p.at(0, dead_band=0.3), held(servo, 0.25))
    assert np.abs(idle.torque[120:]).max() == 0.0


def test_a_drive_law_is_right_at_its_bend_and_gives_more_for_less() -> None:
    servo, p = lever()
    bent = p.at(0, power=0.5, bend=0.1)
    run = along(bent, held(servo, 0.4))
    error = 0.4 - run.q[-1, 0]
    assert run.torque[-1, 0] == pytest.approx(p.gain[0] * error * (error / 0.1) ** -0.5, rel=1e-2)


def test_load_friction_grows_with_the_load() -> None:
    servo, p = lever()
    course = courses.course("slow", servo.arm, np.random.default_rng(2), 100.0)
    plain, rough = (along(q, course) for q in (p, p.at(0, load_friction=0.3)))
    asked = np.abs(rough.torque - plain.torque)[:, 0]
    load = np.abs(plain.torque[:, 0])
    assert asked[load > np.quantile(load, 0.7)].mean() > 1.5 * asked[load < np.quantile(load, 0.3)].mean()


def test_a_gap_lets_the_link_move_by_itself_and_no_further() -> None:
    servo, p = lever()
    course = courses.course("slow", servo.arm, np.random.default_rng(2), 100.0)
    plain, loose = (along(q, course) for q in (p, p.at(0, gap=0.04)))
    assert 0.004 < np.abs(loose.q - plain.q).max() < 0.08


def test_copies_of_an_arm_do_not_know_of_each_other() -> None:
    servo, p = lever()
    course = held(servo, 0.5)
    cool = firmware.Conditions(np.full_like(course.u, 25.0))
    runaway = p.at(0, gain=1e7)  # far beyond what the step can follow
    one, other = (runs[0].q for runs in firmware.play([p, runaway], [course], [cool]))
    assert not np.isfinite(other).any()
    assert np.allclose(one, along(p, course).q, atol=1e-9)


def test_halves_share_no_arm_and_no_unlisted_law() -> None:
    names = [{servo.arm.name for servo in servos(which)} for which in ("development", "examination")]
    laws = [set(effects.UNLISTED[which]) for which in ("development", "examination")]
    assert not names[0] & names[1] and not laws[0] & laws[1]
    assert set(effects.LISTED) == CATALOGUE
    assert {servo.n for which in ("development", "examination") for servo in servos(which)} == set(
        range(1, 7)
    )


# ---- Nulls and sizes -----------------------------------------------------------------------------


@pytest.mark.parametrize("number", (0, 1))
def test_a_null_replayed_leaves_the_encoders_noise_alone(number: int) -> None:
    """The file's commands, simulated by what made it: no half sample between commands and angles, no offset
    but that of the zeros."""
    request = request_of(number, "servo_none")
    st = stage(request, wrong=number == 1)
    case = make_case(st, None)
    assert case is not None
    n = st.servo.n
    for k, one in enumerate(case.recordings):
        q = np.stack([one.table[f"q{j + 1}_rad"] for j in range(n)], axis=1)
        u = np.stack([one.table[f"u{j + 1}_rad"] for j in range(n)], axis=1)
        zeros = (u - st.courses[k].u)[0]
        run = firmware.play([st.plant], [replace(st.courses[k], u=u - zeros)], [st.conditions[k]])[0][0]
        left = q - zeros - run.q
        assert np.sqrt(np.mean(left**2, axis=0)).max() < 1.2 * st.sigma
        speed = np.gradient(run.q, 1.0 / st.courses[k].rate, axis=0)
        late = np.sum(left * speed, axis=0) / np.sum(speed**2, axis=0)
        assert np.abs(late).max() < 0.1 / st.courses[k].rate  # of a sample


def test_the_usual_parameters_take_up_their_own_changes() -> None:
    st = stage(request_of(4), wrong=True)
    p = st.plant
    other = replace(p, gain=1.1 * p.gain, coulomb=1.1 * p.coulomb, delay=p.delay + 2e-3)
    change = st.view.changes([other])[0]
    assert st.view.sizes(change).max() < 0.1 * st.view.sizes(change, sizing.BARE).max()


def test_an_effect_has_the_size_of_its_label_in_what_is_handed_over() -> None:
    """With the true arm in hand, the files show what the label says."""
    case = sets.build("development/servo_single/16")
    label = case.label
    assert label["size_over_noise"] == 0.03
    assert 0.018 <= max(label["sizes"]) <= 0.051
    assert label["seen_at"] in {f"J{j + 1}" for j in range(len(label["sizes"]))}


@pytest.mark.slow
@pytest.mark.parametrize("number", range(2, 60, 4))
def test_every_listed_effect_can_be_hidden(number: int) -> None:
    label = sets.build(f"development/servo_single/{number}").label
    assert label["effects"][0]["effect"] in CATALOGUE
    assert 0.006 <= max(label["sizes"]) <= 0.017


# ---- Sets ----------------------------------------------------------------------------------------


def test_a_servo_set_is_the_same_every_time() -> None:
    one, again = (sets.build("examination/servo_none/1") for _ in range(2))
    assert one.label == again.label and one.robot == again.robot
    for a, b in zip(one.recordings, again.recordings, strict=True):
        assert all(np.array_equal(a.table[name], b.table[name]) for name in a.table)


@pytest.mark.parametrize("family", SERVO)
def test_every_servo_family_has_sets_whose_files_can_be_read(family: str, tmp_path: Path) -> None:
    which = "examination" if family in ("servo_unlisted", "servo_none") else "development"
    case = sets.build(f"{which}/{family}/2")
    robot, files = case.write(tmp_path)
    arm = truing.load_robot(robot)
    n = len(arm.joints)
    parts: Counter[str] = Counter()
    for file in files:
        with open(file, encoding="utf-8") as text:
            rows = list(csv.DictReader(text))
        assert all(f"q{k + 1}_rad" in rows[0] and f"u{k + 1}_rad" in rows[0] for k in range(n))
        assert not any(name.startswith("tau") for name in rows[0])
        assert np.isfinite([[float(v) for name, v in row.items() if name != "set"] for row in rows]).all()
        parts[rows[0]["set"]] += 1
    assert parts == Counter(part for part in PARTS if part != "fresh")
    handed = robot.read_text() + "".join(file.read_text() for file in files)
    assert not any(item["effect"] in handed for item in case.label["effects"])
    assert case.label["family"] == family
    if family == "servo_unlisted":
        assert case.label["unlisted_joint"] == case.label["effects"][0]["joints"][0]
        assert case.label["unlisted_inputs"]


def test_twins_of_servo_arms_take_each_other_up() -> None:
    for number in range(len(families.TWINS)):
        label = sets.build(f"development/servo_confounded/{number}").label
        assert label["absorbed"] >= sizing.SAME and label["usual"]


def test_a_withheld_supply_is_not_in_the_files() -> None:
    case = sets.build("development/servo_missing/1")
    assert case.label["effects"] == [{"effect": "supply_sag", "joints": []}]
    assert not any("volt" in name for one in case.recordings for name in one.table)


# ---- Scores --------------------------------------------------------------------------------------


def sheet(family: str, answer: Answer, **label: Any) -> Sheet:
    whole = {
        "family": family,
        "source": "servo",
        "effects": [],
        "acceptable": [],
        "size_over_noise": 0.03,
        "usual": False,
        "geometry_underneath": False,
        "underneath": [],
        **label,
    }
    return Sheet(f"development/{family}/0", whole, answer)


def said(effect: str, joint: str, probability: float = 0.95, **more: Any) -> SimpleNamespace:
    return SimpleNamespace(
        effect=effect, joints=(joint,), probability=probability, confounded_with=(), share=0.5, **more
    )


def test_usual_parameters_are_answers_where_they_were_hidden_alone() -> None:
    diagnosis = SimpleNamespace(
        verdict="effects",
        effects=[said("command_gain", "J2", standard=True), said("drive_law", "J1", standard=False)],
        unknown=(),
        not_testable=(("rate_limit", ("J1",), "never that fast"),),
        classes=(SimpleNamespace(effects=("command_gain:J2", "payload")),),
        sentence="",
    )
    assert [item.effect for item in answer_of(diagnosis).effects] == ["drive_law"]
    whole = answer_of(diagnosis, usual=True)
    assert [item.effect for item in whole.effects] == ["command_gain", "drive_law"]
    assert whole.not_testable == (("command_gain", ("J2",)), ("payload", ()))


def test_servo_rows_count_what_their_words_say() -> None:
    hidden = [{"effect": "drive_law", "joints": ["J1"]}]
    good = Answer("effects", (Named("drive_law", ("J1",)),))
    bad = Answer("effects", (Named("dead_band", ("J1",)),))
    alarm = Answer("effects", (Named("delay", ("J1",)),))
    sheets = [
        sheet("servo_single", good, effects=hidden),
        sheet("servo_single", bad, effects=hidden),
        sheet("servo_none", alarm),
        sheet("servo_none", alarm, geometry_underneath=True, underneath=["delay"]),
    ]
    rows = {row.key: row for row in score(sheets).rows}
    assert (rows["servo_first"].hits, rows["servo_first"].n) == (1, 2)
    assert (rows["servo_alarm"].hits, rows["servo_alarm"].n) == (1, 2)
    assert (rows["servo_alarm_right"].hits, rows["servo_alarm_right"].n) == (1, 1)
    assert not set(rows) & {"first_physics", "payload_mass"}
    assert {line.key for line in (*SERVO_LINES, *SERVO_MORE)} <= set(rows)


def test_a_class_of_servos_has_the_effect_and_a_twin() -> None:
    label: dict[str, Any] = {
        "effects": [{"effect": "delay", "joints": ["J1"]}],
        "rivals": [{"effect": "viscous", "joints": ["J1"]}, {"effect": "damping_gain", "joints": ["J1"]}],
    }
    alone = Answer("effects", (Named("delay", ("J1",)),))
    twin = Answer("effects", (Named("damping_gain", ("J1",), 0.99),))
    both = Answer("effects", (Named("damping_gain", ("J1",), 0.99, (("delay", ("J1",)),)),))
    told = replace(twin, not_testable=(("delay", ()),))
    passed = [class_returned(sheet("servo_confounded", a, **label)) for a in (alone, twin, both, told)]
    assert passed == [False, False, True, True]
    wrong = [single_wrong_name(sheet("servo_confounded", a, **label)) for a in (alone, twin, both, told)]
    assert wrong == [False, True, False, False]
