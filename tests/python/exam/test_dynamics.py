# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The dynamic half of the examination: its arms move as mechanics asks, its nulls hide nothing, effects have
the size that their label says, and the scorer judges made-up answers as its page promises.
"""

from __future__ import annotations

import csv
import functools
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import truing

pytest.importorskip("mujoco")

import dynamic_candidates as candidates
from truing.dynamics.sanity.findings import FoundParameter, RecordingFinding
from truing.dynamics.told import told
from truing.exam.answers import Answer, Named, Unknown, UnreadableAnswerError
from truing.exam.dynamics import laws, motions, noise, physics, recordings, scenes, sets
from truing.exam.dynamics.answers import answer_of, inputs_in
from truing.exam.dynamics.bodies import numbers, regressor, torques
from truing.exam.dynamics.departures import DEPARTURES, FAR, UNLISTED
from truing.exam.dynamics.laws import LISTED
from truing.exam.dynamics.robots import Arm, Floats, arms, loaded, misjudged
from truing.exam.dynamics.run import diagnose, run_exam
from truing.exam.dynamics.scenes import Case, Stage, stage
from truing.exam.dynamics.score import LINES, MORE, score
from truing.exam.dynamics.sizing import low_pass, orthonormal
from truing.exam.scenes import Request
from truing.exam.score import Row, Scores, Sheet, markdown, plain

TORQUES = [family for family in sets.COUNTS if not family.startswith("servo_")]
EVERY = [arm for which in ("development", "examination") for arm in arms(which)]
NAMES = [arm.name for arm in EVERY]
CATALOGUE = set(
    """viscous_law stribeck presliding asymmetric_friction load_friction position_friction ripple armature
    link_inertia payload spring motor_constant torque_lag time_offset coupling joint_elasticity backlash
    thermal_friction warmup tool_force base_tilt""".split()
)
REAL = pytest.mark.skipif(
    bool(recordings.missing("development") or recordings.missing("examination")),
    reason=recordings.missing("development") or recordings.missing("examination"),
)


def request_of(number: int, which: str = "development", family: str = "single") -> Request:
    return Request(f"{which}/{family}/{number}", which, family, number, np.random.default_rng(number))


def some_motion(arm: Arm, rows: int = 40, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(-1.5, 1.5, (rows, arm.n)),
        rng.normal(size=(rows, arm.n)),
        rng.normal(size=(rows, arm.n)),
    )


@functools.cache
def driven(name: str, gearing: str = "") -> tuple[Arm, physics.Motion]:
    """Ten seconds of a Fourier trajectory of an arm."""
    arm = EVERY[NAMES.index(name)]
    rng = np.random.default_rng(4)
    course = motions.fourier(arm, rng, 10.0)
    joint = 1
    rotor = {joint: 0.25 * float(physics.felt_inertia(arm)[joint])}
    gears = physics.Gearing()
    if gearing:
        arm = physics.with_rotor(arm, joint, rotor[joint])
        between = {"stiff": {"stiffness": {joint: 3e5}}, "soft": {"stiffness": {joint: 3e3}}}
        gears = physics.Gearing(rotor, **(between | {"gap": {"gap": {joint: 2e-3}}})[gearing])
    gains = physics.controller(arm, arm, 7.0)
    return arm, physics.run(arm, gains, [course], [np.zeros_like(course.q)], gears)[0]


# ---- Mechanics -----------------------------------------------------------------------------------


@pytest.mark.parametrize("arm", EVERY, ids=NAMES)
def test_torques_and_regressor_are_those_of_pinocchio(arm: Arm) -> None:
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(scenes.urdf(arm))
    data = model.createData()
    q, qd, qdd = some_motion(arm)
    theirs = np.array([pin.rnea(model, data, *row) for row in zip(q, qd, qdd, strict=True)])
    assert np.abs(torques(arm, q, qd, qdd) - theirs).max() < 1e-9 * np.abs(theirs).max()
    parameters = np.concatenate([numbers(link) for link in arm.links])
    assert np.abs(regressor(arm, q, qd, qdd) @ parameters - theirs).max() < 1e-9 * np.abs(theirs).max()


@pytest.mark.parametrize("name", NAMES)
def test_the_force_that_moves_an_arm_is_what_its_motion_asks(name: str) -> None:
    arm, motion = driven(name)
    asked = torques(arm, motion.q, motion.qd, motion.qdd)
    assert np.all(np.std(motion.torque - asked, axis=0) < 3e-3 * np.std(asked, axis=0))


@pytest.mark.parametrize("name", NAMES)
def test_no_half_sample_lies_between_torque_and_motion(name: str) -> None:
    """Half of the controller's millisecond would be found, were it there. What is left is a fifth of one:
    MuJoCo takes centrifugal torques from the speed of half a step before.
    """
    arm, motion = driven(name)
    asked = torques(arm, motion.q, motion.qd, motion.qdd)
    rate = np.gradient(asked, motions.STEP, axis=0)
    shift = np.sum((motion.torque - asked) * rate, axis=0) / np.sum(rate**2, axis=0)
    assert np.abs(shift).max() < 0.25 * motions.STEP


def test_a_stiff_gear_is_rigid_and_a_soft_one_sags() -> None:
    spread = {}
    for gearing in ("stiff", "soft"):
        arm, motion = driven("shop", gearing)
        asked = torques(arm, *(low_pass(x, motions.STEP) for x in (motion.q, motion.qd, motion.qdd)))
        left = low_pass(motion.torque - asked, motions.STEP)[:, 1]
        spread[gearing] = float(np.std(left)) / float(np.std(motion.torque[:, 1]))
    assert spread["stiff"] < 0.005 and 3.0 * spread["stiff"] < spread["soft"] < 0.3


def test_a_gap_shows_where_the_load_turns() -> None:
    arm, motion = driven("shop", "gap")
    asked = torques(arm, *(low_pass(x, motions.STEP) for x in (motion.q, motion.qd, motion.qdd)))
    left = np.abs(low_pass(motion.torque - asked, motions.STEP)[:, 1])
    load = np.abs(low_pass(motion.torque[:, 1], motions.STEP))
    turning, carrying = load < np.quantile(load, 0.1), load > np.quantile(load, 0.5)
    assert left[turning].mean() > 1.5 * left[carrying].mean()


@pytest.mark.parametrize("arm", EVERY, ids=NAMES)
def test_misjudged_and_loaded_arms_are_still_bodies(arm: Arm) -> None:
    rng = np.random.default_rng(0)
    heavy = loaded(arm, 2.0, arm.tool)
    for one in (misjudged(arm, rng, 0.05, 0.3), heavy):
        for link in one.links:
            a, b, c = np.linalg.eigvalsh(link.inertia)
            assert link.mass > 0.0 and a > 0.0 and a + b >= c * (1.0 - 1e-9)
    q, qd, qdd = some_motion(arm)
    point = replace(
        arm, links=(*arm.links[:-1], replace(arm.links[-1], mass=1e-9, inertia=np.eye(3) * 1e-12))
    )
    alone = torques(loaded(point, 2.0, arm.tool), q, qd, qdd) - torques(point, q, qd, qdd)
    assert np.allclose(torques(heavy, q, qd, qdd) - torques(arm, q, qd, qdd), alone, atol=1e-6)


# ---- Laws and noise ------------------------------------------------------------------------------


def test_bristles_turn_over_their_width_and_forget_it_beyond() -> None:
    q = np.concatenate([np.linspace(0.0, 0.2, 400), np.linspace(0.2, 0.0, 400)])
    z = laws.bristles(q, 1e-2)
    assert z[399] == pytest.approx(1.0, abs=1e-6) and z[-1] == pytest.approx(-1.0, abs=1e-6)
    back = int(np.flatnonzero((q < 0.2 - 1e-2 * np.log(2.0)) & (np.arange(800) >= 400))[0])
    assert abs(z[back]) < 0.06  # z = 2 exp(-x / width) - 1 crosses zero at width log 2


def test_the_stop_operator_holds_between_its_stops() -> None:
    z = laws.stop(np.array([0.0, 0.5, 2.0, 1.5, -4.0]), 1.0)
    assert z.tolist() == [0.0, 0.5, 1.0, 0.5, -1.0]


def test_a_lag_and_a_shift_delay_a_ramp_by_themselves() -> None:
    ramp = np.arange(4000) * 1e-3
    assert ramp[-1] - laws.lagged(ramp, 0.02, 1e-3)[-1] == pytest.approx(0.0195, abs=6e-4)
    moved = laws.shifted(ramp[:, None], 0.0043, 1e-3)[:, 0]
    assert np.allclose(moved[:3900] - ramp[:3900], 0.0043)


def correlation_length(series: Floats) -> float:
    """Samples that count as one: 1 + 2 times the autocorrelation up to where it first falls below 0.05."""
    x = series - series.mean()
    spectrum = np.abs(np.fft.rfft(x, 2 * len(x))) ** 2
    r = np.fft.irfft(spectrum)[: len(x)]
    r = r / r[0]
    below = np.flatnonzero(r < 0.05)
    end = int(below[0]) if len(below) else len(r)
    return float(1.0 + 2.0 * r[1:end].sum())


def test_coloured_noise_is_as_correlated_as_that_of_real_arms() -> None:
    rng = np.random.default_rng(2)
    series = noise.coloured(60_000, 6, 0.04, rng)
    lengths = [correlation_length(column) for column in series.T]
    assert 9.0 < min(lengths) and max(lengths) < 26.0
    assert np.allclose(series.std(axis=0), 1.0, atol=0.1)
    shuffled = noise.reshuffled(series, rng)
    spectra = [np.abs(np.fft.rfft(x, axis=0)) for x in (series, shuffled)]
    assert np.allclose(*spectra, rtol=1e-6, atol=1e-6) or np.allclose(spectra[0][1:-1], spectra[1][1:-1])
    assert abs(np.corrcoef(series[:, 0], shuffled[:, 0])[0, 1]) < 0.2


def test_every_effect_of_the_catalogue_has_a_law() -> None:
    assert set(LISTED) == CATALOGUE
    assert set(DEPARTURES) <= CATALOGUE and set(FAR) <= CATALOGUE
    assert not (set(UNLISTED["development"]) | set(UNLISTED["examination"])) & CATALOGUE
    assert not set(UNLISTED["development"]) & set(UNLISTED["examination"])


# ---- Sets ----------------------------------------------------------------------------------------


def hidden_in(name: str, number: int, makers: Any = LISTED) -> tuple[Stage, Case]:
    """A set with one effect of twice the noise."""
    request = request_of(number, family="single")
    for _ in range(20):
        st = stage(request, needs=frozenset({"temperature", "speed"}))
        hidden = scenes.draw_hidden(st, name, makers)
        placed = hidden and scenes.placed(st, st.view(st.reference), hidden, 2.0)
        case = scenes.make_case(st, [placed], wanted=[2.0]) if placed else None
        if case:
            return st, case
    raise AssertionError(f"{name} fits on no arm")


QUICKLY = ("backlash", "presliding", "torque_lag", "payload")
"""Effects of every kind, tried in each run of the tests: gears, friction, meters, arms."""


@pytest.mark.parametrize(
    "name",
    [name if name in QUICKLY else pytest.param(name, marks=pytest.mark.slow) for name in sorted(LISTED)],
)
def test_an_effect_has_the_size_of_its_label(name: str) -> None:
    """Fitted to the recordings as they are handed over, by who knows the true arm and the noise."""
    _, case = hidden_in(name, sorted(LISTED).index(name))
    assert case.label["effects"][0]["effect"] == name
    assert 1.2 <= case.label["sizes"][0] <= 3.4
    assert case.label["size_over_noise"] == 2.0


@pytest.mark.parametrize("number", range(3))
def test_nulls_hide_nothing_but_usual_friction(number: int) -> None:
    """Before noise is laid on: no rest of the fit, no time offset, no ripple."""
    request = request_of(number, which="development" if number % 2 else "examination", family="none")
    st = stage(request)
    played = scenes.play(st, [])
    view = st.view(played.scenes)
    left = [
        measured - torques(s.arm, s.motion.q, s.motion.qd, s.motion.qdd)
        for s, measured in zip(view.scenes, played.measured, strict=False)
    ]
    rest = view.rest(view.stacked(left))
    assert np.sqrt(np.mean(rest.reshape(-1, view.n) ** 2, axis=0)).max() < 0.06  # of the noise
    waves = [
        view.stacked([s.at(j, wave(k * s.motion.q[:, j])) for s in view.scenes])
        for j in range(view.n)
        for k in (1, 2, 3, 5, 8, 12)
        for wave in (np.sin, np.cos)
    ]
    rates = [view.stacked([np.gradient(s.total, s.step, axis=0) for s in view.scenes])]
    for column in (*waves, *rates):
        shown = orthonormal(view.rest(column[:, None]))[:, 0] @ rest / np.sqrt(len(rest) / view.n)
        assert abs(shown) < 0.05  # of the noise


def test_rows_of_a_recording_are_those_of_its_instants() -> None:
    """No half sample between angles, speeds and torques of a file."""
    st = stage(request_of(5), needs=frozenset({"speed"}))
    still = replace(st, sigma=st.sigma * 1e-12)
    played = scenes.play(still, [])
    step = round(1.0 / (st.rate * motions.STEP))
    table = scenes.record(still, played, 0).table
    motion = played.scenes[0].motion
    for j in range(st.arm.n):
        assert np.abs(table[f"q{j + 1}_rad"] - motion.q[::step, j]).max() <= np.pi / 2.0**17
        assert np.abs(table[f"qd{j + 1}_rad_s"] - motion.qd[::step, j]).max() < 1e-5
        assert np.abs(table[f"tau{j + 1}_Nm"] - played.measured[0][::step, j]).max() < 1e-9 * 1e3
    assert np.allclose(np.gradient(motion.q, motions.STEP, axis=0)[5:-5], motion.qd[5:-5], atol=2e-3)


def test_a_set_is_the_same_every_time_and_another_with_another_seed() -> None:
    one, again, other = (sets.build(id) for id in ("development/single/2",) * 2 + ("development/single/2@1",))
    assert one.label == again.label and one.robot == again.robot
    for a, b in zip(one.recordings, again.recordings, strict=True):
        assert all(np.array_equal(a.table[name], b.table[name]) for name in a.table)
    assert other.label != one.label


@pytest.mark.parametrize("which", ["development", pytest.param("examination", marks=pytest.mark.slow)])
@pytest.mark.parametrize("family", sorted(TORQUES))
def test_every_family_has_sets_whose_files_can_be_read(family: str, which: str, tmp_path: Path) -> None:
    case = sets.build(f"{which}/{family}/0")
    robot, files = case.write(tmp_path)
    arm = truing.load_robot(robot)
    assert [joint.name for joint in arm.joints] == [f"J{k + 1}" for k in range(len(arm.joints))]
    parts: Counter[str] = Counter()
    for file in files:
        with open(file, encoding="utf-8") as text:
            rows = list(csv.DictReader(text))
        t = [float(row["t_s"]) for row in rows]
        assert len(rows) >= 500 and min(np.diff(t)) > 0.0
        assert all(f"q{k + 1}_rad" in rows[0] and f"tau{k + 1}_Nm" in rows[0] for k in range(len(arm.joints)))
        assert np.isfinite([[float(v) for n, v in row.items() if n != "set"] for row in rows]).all()
        parts[rows[0]["set"]] += 1
    assert parts["train"] >= 3 and parts["test"] >= 1
    assert case.label["family"] == family
    handed = robot.read_text() + "".join(file.read_text() for file in files)
    assert not any(item["effect"] in handed for item in case.label["effects"])
    assert not {file.name for file in files} & {f"{one.name}.csv" for one in case.fresh}


def test_half_of_the_sets_hand_over_wrong_inertials() -> None:
    labels = [sets.build(f"development/none/{k}").label for k in (0, 1, 3, 4)]
    assert [label["geometry_underneath"] for label in labels] == [False, False, True, True]
    assert labels[2]["underneath"] == ["armature", "link_inertia", "motor_constant", "payload"]


def test_twins_are_twins_by_the_examiners_own_columns() -> None:
    for number in (0, 2, 4, 5):
        label = sets.build(f"examination/confounded/{number}").label
        names = [(item["effect"], item["joints"]) for item in label["acceptable"]]
        assert label["twin"] == "gauge" or (label["rival"]["effect"], label["rival"]["joints"]) in names


def test_a_withheld_column_is_not_in_the_files() -> None:
    heated = sets.build("development/missing/0")
    assert heated.label["effects"][0]["effect"] == "thermal_friction"
    assert not any(name.startswith("temp") for one in heated.recordings for name in one.table)
    carried = sets.build("development/missing/1")
    assert carried.label["effects"] == [{"effect": "payload", "joints": []}]
    assert not any("payload" in name for one in carried.recordings for name in one.table)


@REAL
def test_a_spike_stands_on_what_a_flexible_fit_leaves_of_real_torques() -> None:
    for which in ("development", "examination"):
        source = recordings.recorded(which)
        assert np.all(source.sigma < source.sigma_standard)
        measured = np.concatenate([one.measured for one in source.recordings])
        shares = source.sigma_standard / measured.std(axis=0)
        assert 0.02 < shares.min() and shares.max() < 0.4
        case = sets.build(f"{which}/single/3")
        assert case.label["source"] == "spike" and case.label["kind"] == "residual"
        assert case.label["sizes"][0] == pytest.approx(case.label["wanted"][0], rel=1e-6)


@REAL
def test_a_null_of_the_recorded_spectrum_has_it() -> None:
    source = recordings.recorded("development")
    case = sets.build("development/none/2")
    for one, real in zip(case.recordings, source.recordings, strict=True):
        added = np.stack([one.table[f"tau{j + 1}_Nm"] for j in range(6)], axis=1) - real.scene.total
        power = [np.sum(np.abs(np.fft.rfft(x, axis=0)[1:]) ** 2, axis=0) for x in (added, real.residual)]
        assert np.allclose(*power, rtol=0.02)


def test_without_recordings_their_sets_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TRUING_REALDATA", raising=False)
    names = [f"development/{family}/{k}" for family in ("none", "single", "missing") for k in range(4)]
    assert [name for name, _ in sets.skipped("development", names)] == [
        "development/none/2",
        "development/single/3",
        "development/missing/3",
    ]


def test_unknown_families_and_sets_are_refused_in_words() -> None:
    for wrong in ({"families": ["grid"]}, {"only": ["single/x"]}, {"only": ["nothing/1"]}):
        with pytest.raises(truing.InputError, match=r"no family of sets|no set 'single/x'"):
            sets.ids("development", **wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no set"):
        sets.build("elsewhere/single/1")


# ---- Answers -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "joint", "found"),
    [
        ("speed", "J2", "speed"),
        ("qd", "J2", "speed"),
        ("q3", "J3", "angle"),
        ("q3", "J5", "angle J3"),
        ("angle of J3", "J5", "angle J3"),
        ("direction x torque", "J1", "torque"),
        ("direction x angle", "J1", "angle"),
        ("t", "J1", "time"),
        ("temperature", "J1", "temperature"),
        ("qdd", "J1", "acceleration"),
    ],
)
def test_inputs_are_read_in_whatever_words(text: str, joint: str, found: str) -> None:
    assert inputs_in(text, joint) == [found]


def said(effect: str, joints: Sequence[str], probability: float = 0.99, same: Any = ()) -> SimpleNamespace:
    others = [SimpleNamespace(effect=name, joints=at) for name, at in same]
    return SimpleNamespace(effect=effect, joints=joints, probability=probability, confounded_with=others)


def test_an_answer_is_read_from_the_attributes_of_a_diagnosis() -> None:
    payload = said("payload", [], same=[("link_inertia", ["J6"])])
    payload.parameters = [SimpleNamespace(name="payload.m", value=2.5)]
    diagnosis = SimpleNamespace(
        verdict="effects+unknown",
        effects=[said("coulomb", ["J1"]), payload],
        unknown=[SimpleNamespace(joint="J6", input="angle")],
    )
    answer = answer_of(diagnosis)
    assert [item.effect for item in answer.effects] == ["payload"]  # standard practice is no answer
    assert answer.effects[0].same == (("link_inertia", ("J6",)),)
    assert answer.unknown == (Unknown("J6", ("angle",)),)
    assert answer.parameters == {"payload.m": 2.5}


@pytest.mark.parametrize(
    "broken",
    [
        SimpleNamespace(verdict="none"),
        SimpleNamespace(verdict="effects", unknown=[], effects=[said("ripple", ["J1"], probability=1.2)]),
        SimpleNamespace(verdict="effects", unknown=[], effects=[said("ripple", 3)]),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_read_is_said(broken: Any) -> None:
    with pytest.raises(UnreadableAnswerError):
        answer_of(broken)


# ---- Scores --------------------------------------------------------------------------------------


def label_of(family: str, **more: Any) -> dict[str, Any]:
    return {
        "family": family,
        "source": "physics",
        "effects": [],
        "acceptable": [],
        "size_over_noise": 1.0,
        "noise": "coloured",
        "noise_sigma": [1.0] * 6,
        "geometry_underneath": False,
        "payload_kg": None,
        **more,
    }


def sheet(family: str, answer: Answer, number: int = 0, **more: Any) -> Sheet:
    return Sheet(f"development/{family}/{number}", label_of(family, **more), answer)


def named(effect: str, joints: tuple[str, ...], probability: float = 0.99, same: Any = ()) -> Answer:
    return Answer("effects", (Named(effect, joints, probability, tuple(same)),))


RIPPLE = [{"effect": "ripple", "joints": ["J2"]}]
NOTHING = Answer("none")


def row(sheets: Sequence[Sheet], key: str) -> Row:
    return score(sheets).row(key)


def test_a_right_name_counts_at_its_joint_alone() -> None:
    right = sheet("single", named("ripple", ("J2",)), effects=RIPPLE)
    elsewhere = sheet("single", named("ripple", ("J3",)), effects=RIPPLE)
    other = sheet("single", named("spring", ("J2",)), effects=RIPPLE)
    found = score([right, elsewhere, other, sheet("single", NOTHING, effects=RIPPLE)])
    assert (found.row("first_physics").hits, found.row("first_physics").n) == (1, 4)
    assert (found.row("joint").hits, found.row("joint").n) == (1, 2)
    assert (found.row("first_plain").hits, found.row("first_plain").n) == (1, 4)
    assert found.row("first_physics").met is False


def test_what_looks_the_same_is_right_and_no_longer_plain() -> None:
    alike = [{"effect": "spring", "joints": ["J2"], "of": 0}]
    found = score([sheet("single", named("spring", ("J2",)), effects=RIPPLE, acceptable=alike)])
    assert found.row("first_physics").hits == 1 and found.row("first_plain").n == 0


def test_sizes_and_sources_go_to_their_own_rows() -> None:
    sizes = {"spike_half": 0.5, "spike_one": 1.0, "spike_two": 2.0}
    right = named("ripple", ("J2",))
    real: dict[str, Any] = {"effects": RIPPLE, "source": "spike"}
    sheets = [sheet("single", right, kind="residual", size_over_noise=s, **real) for s in sizes.values()]
    found = score([*sheets, sheet("single", right, kind="raw", **real)])
    assert [found.row(key).n for key in sizes] == [1, 1, 1]
    assert found.row("spike_raw").hits == 1 and found.row("first_physics").n == 0


def test_nulls_must_stay_silent_but_for_wrong_inertials() -> None:
    inertia = named("link_inertia", ("J3",))
    unknown = Answer("unknown", unknown=(Unknown("J1", ("speed",)),))
    beneath = {"geometry_underneath": True, "underneath": ["link_inertia"]}
    sheets = [
        sheet("none", NOTHING, kind="white"),
        sheet("none", inertia, kind="white", **beneath),
        sheet("none", inertia, kind="white"),
        sheet("none", unknown, kind="recorded"),
        sheet("none", NOTHING, kind="coloured"),
    ]
    found = score(sheets)
    assert (found.row("alarm_white").hits, found.row("alarm_white").n) == (1, 3)
    assert (found.row("alarm_recorded").hits, found.row("alarm_recorded").n) == (1, 2)


def test_wrong_inertials_are_rightly_named_and_do_not_count_as_first() -> None:
    both = Answer("effects", (Named("link_inertia", ("J1",)), Named("ripple", ("J2",))))
    beneath = {"geometry_underneath": True, "underneath": ["link_inertia"]}
    assert row([sheet("single", both, effects=RIPPLE, **beneath)], "first_physics").hits == 1
    assert row([sheet("single", both, effects=RIPPLE)], "first_physics").hits == 0


def test_twins_are_to_be_returned_together() -> None:
    effects = [{"effect": "spring", "joints": ["J2"]}]
    more: dict[str, Any] = {"effects": effects, "rival": {"effect": "ripple", "joints": ["J2"]}}
    more["acceptable"] = [{"effect": "ripple", "joints": ["J2"], "of": 0}]
    both = named("ripple", ("J2",), same=[("spring", ("J2",))])
    untold = replace(named("spring", ("J2",)), not_testable=(("ripple", ("J2",)),))
    sheets = [
        sheet("confounded", answer, **more)
        for answer in (both, untold, named("spring", ("J2",)), named("ripple", ("J2",)), NOTHING)
    ]
    found = score(sheets)
    assert (found.row("class").hits, found.row("class").n) == (2, 5)
    assert (found.row("class_wrong").hits, found.row("class_wrong").n) == (1, 5)
    doubtful = sheet("confounded", named("ripple", ("J2",), 0.6), **more)
    unrelated = sheet("confounded", named("backlash", ("J4",)), **more)
    assert row([doubtful], "class_wrong").hits == 0 and row([unrelated], "class_wrong").hits == 1


def test_an_unlisted_law_is_to_be_called_unknown_where_it_is() -> None:
    more = {"unlisted_joint": "J3", "unlisted_inputs": ["angle J2"]}
    told = Answer("unknown", unknown=(Unknown("J3", ("angle J2",)),))
    beside = Answer("unknown", unknown=(Unknown("J3", ("speed",)),))
    sheets = [sheet("unlisted", a, **more) for a in (told, beside, NOTHING, named("ripple", ("J3",)))]
    found = score(sheets)
    assert (found.row("unlisted").hits, found.row("unlisted").n) == (2, 4)
    assert (found.row("unlisted_place").hits, found.row("unlisted_place").n) == (1, 2)
    assert found.row("unlisted_wrong").hits == 1


def test_a_payload_is_weighed() -> None:
    more: dict[str, Any] = {"effects": [{"effect": "payload", "joints": []}], "payload_kg": 2.0}
    answers = [replace(named("payload", ()), parameters={"payload.m": mass}) for mass in (2.02, 2.04, 2.5)]
    found = score([sheet("single", answer, **more) for answer in answers]).row("payload_mass")
    assert found.n == 3 and found.value == pytest.approx(2.0) and found.met
    crash = sheet("single", Answer("error", error="no"), **more)
    assert not row([crash], "payload_mass").met


def test_promises_are_held_against_what_came_of_them() -> None:
    answers = [Answer("none", shrink=(0.5, 0.4, 0.6), realised=r) for r in (0.48, 0.40, 0.46)]
    found = score([sheet("single", answer, effects=RIPPLE) for answer in answers]).row("rollout")
    assert found.n == 3 and found.value == pytest.approx(4.0) and found.met
    silent = row([sheet("single", NOTHING, effects=RIPPLE)], "rollout")
    assert silent.met is None and "no diagnosis" in silent.note


def test_confidence_is_held_against_frequency() -> None:
    names = [named("ripple", ("J2",), 0.9)] * 18 + [named("spring", ("J1",), 0.9)] * 2
    sheets = [sheet("single", answer, effects=RIPPLE) for answer in names]
    found = row(sheets, "calibration")
    assert found.value == pytest.approx(0.0, abs=1e-9) and found.met
    sure = [
        replace(s, answer=named(s.answer.effects[0].effect, s.answer.effects[0].joints, 0.6)) for s in sheets
    ]
    assert row(sure, "calibration").value == pytest.approx(0.3) and not row(sure, "calibration").met


def test_a_failed_diagnosis_is_wrong_in_every_row_it_belongs_to() -> None:
    crash = Answer("error", error="RuntimeError: no")
    unlisted = {"unlisted_joint": "J1", "unlisted_inputs": ["time"]}
    rival = {"rival": {"effect": "ripple", "joints": ["J2"]}}
    sheets = [
        sheet("single", crash, effects=RIPPLE),
        sheet("double", crash, effects=RIPPLE * 2),
        sheet("none", crash, kind="white"),
        sheet("confounded", crash, effects=RIPPLE, **rival),
        sheet("unlisted", crash, **unlisted),
        sheet("wrong_law", crash, effects=RIPPLE),
        sheet("missing", crash, effects=RIPPLE),
    ]
    found = score(sheets)
    for line in (*LINES, *MORE):
        one = found.row(line.key)
        assert one.hits == (0 if line.good else one.n), line.key
    assert found.row("failed").n == 7 and len(found.failures) == 7


def test_beside_the_load_of_a_real_arm_other_names_are_not_judged() -> None:
    answer = Answer("effects", (Named("payload", (), 0.95), Named("load_friction", ("J2",), 0.98)))
    kinds = {"source": "spike", "kind": "real_payload", "effects": [{"effect": "payload", "joints": []}]}
    real = sheet("missing", answer, **kinds)
    assert row([real], "missing_payload").hits == 1 and row([real], "missing_wrong").n == 0
    driven = sheet("missing", answer, effects=kinds["effects"])
    assert (row([driven], "missing_wrong").hits, row([driven], "missing_wrong").n) == (1, 1)


def test_a_load_that_only_the_check_of_recordings_finds_is_a_name_with_its_mass() -> None:
    load = RecordingFinding(
        "load_differs",
        ("b",),
        (),
        "",
        1.5,
        "kg",
        True,
        parameters=(FoundParameter("payload.m", 1.5, 0.1, "kg"),),
    )
    nothing = SimpleNamespace(
        verdict="none", sentence="No gap.", effects=(), unknown=(), classes=(), not_testable=()
    )
    answer = answer_of(told(nothing, [load]))
    assert [(one.effect, one.joints) for one in answer.effects] == [("payload", ())]
    assert answer.verdict == "effects" and answer.parameters == {"payload.m": 1.5}
    assert "b carries a load of 1.50 kg that nobody told" in answer.sentence
    assert answer_of(told(nothing)).effects == ()


def test_what_free_inertias_take_up_is_named_though_they_leave_a_little_less(tmp_path: Path) -> None:
    """A rotor over right inertials: free ones, fitted to small errors of derivatives as well, leave less."""
    case = sets.build("development/confounded/12@5101")
    found = diagnose(*case.write(tmp_path))
    said = {(one.effect, *one.joints) for one in answer_of(found).effects}
    assert case.label["effects"] == [{"effect": "armature", "joints": ["J1"]}]
    assert ("armature", "J1") in said


def test_shortfalls_are_listed_by_set() -> None:
    found = score([sheet("single", named("spring", ("J1",)), 7, effects=RIPPLE)])
    failed = next(item for item in found.failures if item["id"] == "development/single/7")
    assert {"first_physics", "first_plain"} <= set(failed["failed"])
    assert "**missed**" in markdown(found) and "MISSED" in plain(found)


# ---- Sitting -------------------------------------------------------------------------------------


def test_a_sitting_is_sealed_before_it_is_answered_and_scored_after(tmp_path: Path) -> None:
    names = ["none/0", "single/2"]
    found = run_exam(only=names, candidate=candidates.silent, out=tmp_path, keep=tmp_path / "sets", workers=1)
    assert found.row("alarm_recorded").hits == 0 and found.row("failed").hits == 0
    lines = {
        name: [json.loads(line) for line in (tmp_path / f"{name}.jsonl").read_text().splitlines()]
        for name in ("sealed", "salts", "answers", "labels")
    }
    assert {len(entries) for entries in lines.values()} == {2}
    assert [e["seal"] for e in lines["labels"]] == [
        next(s["seal"] for s in lines["sealed"] if s["id"] == e["id"]) for e in lines["labels"]
    ]
    kept = tmp_path / "sets" / "development_single_2"
    assert (kept / "robot.urdf").is_file() and len(list(kept.glob("*.csv"))) == 6
    again = run_exam(only=names, candidate=candidates.crashing, out=tmp_path, resume=True, workers=1)
    assert again.row("failed").hits == 0  # answers of before are kept
    assert "first-named class right" in (tmp_path / "scores.md").read_text()


def test_made_up_candidates_are_judged(tmp_path: Path) -> None:
    names = ["none/0", "none/4"]
    stubborn = run_exam(only=names, candidate=candidates.stubborn, workers=1)
    assert stubborn.row("alarm_recorded").hits == 1 and stubborn.row("alarm_white").hits == 1
    crashing = run_exam(only=names[:1], candidate=candidates.crashing, workers=1)
    assert crashing.row("failed").hits == 1
    promising = run_exam(only=names[:1], candidate=candidates.promising, workers=1)
    assert promising.row("rollout").value == pytest.approx(10.0) and promising.row("rollout").met is False


# What the quick development examination must reach at least (shares), or at most, in how many sets at least.
# Far from the targets: docs/method/exam.md has what the first sitting showed.
AT_LEAST = {"joint": (0.75, 3)}
AT_MOST = {"failed": (0.0, 20)}


def shortfalls(found: Scores) -> list[str]:
    """Rows that miss what they must reach, or in which too few sets count: a diagnosis that names nothing has
    no joints that could be wrong.
    """
    wanted = [(key, least, 1.0, few) for key, (least, few) in AT_LEAST.items()]
    wanted += [(key, 0.0, most, few) for key, (most, few) in AT_MOST.items()]
    rows = [(found.row(key), least, most, few) for key, least, most, few in wanted]
    return [row.key for row, least, most, few in rows if row.n < few or not least <= row.value <= most]


def test_who_names_nothing_or_fails_does_not_pass() -> None:
    for answer in (NOTHING, Answer("error", error="no")):
        sheets = [sheet("single", answer, number, effects=RIPPLE) for number in range(24)]
        assert "joint" in shortfalls(score(sheets))


def test_truing_passes_the_quick_examination(tmp_path: Path) -> None:
    found = run_exam(quick=True, families=TORQUES, out=tmp_path)
    assert not shortfalls(found), plain(found)
