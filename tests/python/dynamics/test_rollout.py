# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis judged by motion: what was named moves like the robot, and what moves worse is said."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from pages import charts_of, visible
from truing.dynamics import Recording, TorqueDiagnosis, diagnose
from truing.dynamics.result import write_diagnosis
from truing.dynamics.rollout import (
    Rollout,
    held_out_blocks,
    held_out_rows,
    moves_worse,
    rollout,
    rollout_dict,
    spans_of,
)
from truing.dynamics.sanity import band
from truing.dynamics.simulate import Judgement, judge
from truing.testing.dynamics import SimulatedMotion, simulate_motion


@pytest.fixture(scope="module")
def simulated() -> SimulatedMotion:
    return simulate_motion(seconds=14.0, recordings=4, held_out=1)


@pytest.fixture(scope="module")
def found(simulated: SimulatedMotion) -> TorqueDiagnosis:
    return diagnose(simulated.nominal, simulated.recordings)


@pytest.fixture(scope="module")
def judged(simulated: SimulatedMotion, found: TorqueDiagnosis) -> Rollout:
    return rollout(simulated.nominal, found, simulated.recordings, windows=12)


def of(judged: Rollout) -> Judgement:
    assert judged.why_not == "" and judged.judgement is not None
    return judged.judgement


def test_what_was_named_moves_like_the_robot(judged: Rollout) -> None:
    motion = of(judged)
    assert list(motion.simulated) == ["nominal", "standard", "named", "exported"]
    assert set(motion.windows.recordings) == {"motion4"} and motion.windows.starts.size == 12
    named, alone, standard = (motion.worst_joint(m, 0.5) for m in ("named", "exported", "standard"))
    assert named < 0.25 * standard
    assert named < alone < standard
    assert judged.refitted == ("load_friction.J2",)
    assert motion.worst_joint("nominal", 0.5) > standard


def test_the_contract_of_result_json(judged: Rollout) -> None:
    part = rollout_dict(judged)
    assert part["horizon_s"] == [0.1, 0.5, 2.0] and part["why_not"] == ""
    motion = of(judged)
    for model in ("nominal", "standard", "named", "exported"):
        errors = part["held_out"][model]
        assert list(errors) == ["J1", "J2", "J3", "J4", "J5", "J6"]
        assert errors["J5"][1] == pytest.approx(np.sqrt(np.mean(motion.errors(model, 0.5)[:, 4] ** 2)))
        assert part["worst_joint_median"][model][2] == motion.worst_joint(model, 2.0)
    assert part["units"]["J1"] == "rad" and part["windows"] == 12
    assert "12 windows" in part["sentence"] and part["worse"] == []


def test_the_report_draws_simulated_motion_over_the_real_one(
    simulated: SimulatedMotion, found: TorqueDiagnosis, judged: Rollout, tmp_path: Path
) -> None:
    result = write_diagnosis(tmp_path, found, simulated.recordings, judged)
    assert result == json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert result["rollout"]["sentence"] in visible(page)
    chart = charts_of(page)["motion"]
    shown = [trace["name"] for trace in chart["data"] if trace["visible"]]
    assert shown == ["measured", "nominal", "standard", "named", "exported", "start"]
    assert len(chart["layout"]["updatemenus"][0]["buttons"]) == 6


def test_the_report_says_that_low_passed_torques_drive_the_models_badly(
    simulated: SimulatedMotion, found: TorqueDiagnosis, judged: Rollout, tmp_path: Path
) -> None:
    for sanity, said in (((), False), ((band.finding(1.9),), True)):
        write_diagnosis(tmp_path, found, simulated.recordings, judged, sanity=sanity)
        page = visible((tmp_path / "report.html").read_text(encoding="utf-8"))
        assert ("These torques end at 1.9 Hz" in page) is said


def test_whatmoves_worse_than_before_is_said(
    simulated: SimulatedMotion, found: TorqueDiagnosis, tmp_path: Path
) -> None:
    # As if the robot found were the nominal one, and standard practice had all effects.
    held = [recording for recording in simulated.recordings if recording.test]
    models = {"nominal": simulated.truth, "standard": simulated.truth}
    worse = {"named": simulated.nominal, "exported": simulated.nominal}
    motion = judge({**models, **worse}, held, horizons=(0.1, 0.5), most=6)
    part = rollout_dict(Rollout(motion))
    assert any(text.startswith("in motion what was named is worse than standard") for text in part["worse"])
    assert any("moves worse than standard practice at J1" in text for text in part["worse"])
    result = write_diagnosis(tmp_path, found, simulated.recordings, Rollout(motion))
    assert "In motion what was named is worse than standard practice" in result["sentence"]
    assert set(part["worse"]) <= set(result["warnings"])
    assert "worse in motion" in visible((tmp_path / "report.html").read_text(encoding="utf-8"))


def test_motion_is_worse_where_windows_agree_that_it_is() -> None:
    random = np.random.default_rng(3)
    its = np.abs(random.normal(size=60))
    noise = np.abs(random.normal(size=(400, 2, 60)))
    false = np.mean([moves_worse(one, other, "rad", np.median) for one, other in noise])
    assert (
        false < 0.05
    )  # models that are equally good, though medians of 60 differ by 5 % in a third of cases
    assert moves_worse(1.2 * its, its, "rad", np.median)
    assert not moves_worse(1.04 * its, its, "rad", np.median)
    # Who has left is no farther off than who has left.
    assert not moves_worse(30.0 + its, 10.0 + its, "rad", np.median)
    assert not moves_worse(np.full(60, np.nan), 10.0 + its, "rad", np.median)
    assert moves_worse(np.full(60, np.nan), its, "rad", np.median)


def test_blocks_held_out_are_those_of_the_core(simulated: SimulatedMotion) -> None:
    # Of one recording blocks of time are held out, and the core's traces are of them.
    one = simulated.recordings[0]
    alone = Recording("alone", time=one.time + 5.0, position=one.position, torque=one.torque)
    found = diagnose(simulated.nominal, [alone], test_share=0.4)
    assert list(found.held_out) == ["blocks of time"]
    (spans,) = held_out_blocks([alone], 0.4)
    assert sum(end - begin for begin, end in spans) == pytest.approx(0.4 * 13.99)
    time = 5.0 + np.array(found.traces[0].time)  # which counts from the recording's begin
    inside = [(begin - 1e-6 <= time) & (time <= end + 1e-6) for begin, end in spans]
    assert np.all(np.any(inside, axis=0)) and all(np.any(one) for one in inside[:3])
    motion = of(rollout(simulated.nominal, found, [alone], test_share=0.4, windows=4))
    assert motion.windows.horizons == (0.1, 0.5)  # no block has room for 2 s
    ends = motion.windows.starts + 0.5
    for start, end in zip(motion.windows.starts, ends, strict=True):
        assert any(begin <= start and end <= last for begin, last in spans)


def test_rows_of_blocks_are_marked(simulated: SimulatedMotion) -> None:
    one = simulated.recordings[0]
    (rows,) = held_out_rows([one], ["blocks of time"], 0.4)
    assert rows.mean() == pytest.approx(0.4, abs=0.01)
    spans, (blocks,) = spans_of(one, rows), held_out_blocks([one], 0.4)
    assert spans == [pytest.approx(block, abs=0.011) for block in blocks]
    assert not held_out_rows([one], ["another"], 0.4)[0].any()


def test_a_robot_that_was_fitted_is_its_own_standard(
    simulated: SimulatedMotion, found: TorqueDiagnosis
) -> None:
    again = diagnose(found.robot, simulated.recordings)
    motion = of(rollout(found.robot, again, simulated.recordings, windows=2, horizons=(0.1,)))
    assert np.array_equal(motion.simulated["nominal"], motion.simulated["standard"])


def test_what_cannot_be_simulated_says_why(
    simulated: SimulatedMotion, found: TorqueDiagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    currents = [
        Recording(r.name, time=r.time, position=r.position, current=r.torque, test=r.test)
        for r in simulated.recordings
    ]
    refused = rollout(simulated.nominal, found, currents)
    assert refused.judgement is None and "torque_per_ampere" in refused.why_not
    monkeypatch.setitem(sys.modules, "mujoco", None)
    missing = rollout(simulated.nominal, found, simulated.recordings)
    assert "pip install 'truing[dynamics]'" in missing.why_not
    result: dict[str, Any] = write_diagnosis(tmp_path, found, simulated.recordings, missing)
    assert result["rollout"]["held_out"] == {} and "MuJoCo is not installed" in result["rollout"]["why_not"]
    assert "Not judged by motion: MuJoCo is not installed" in visible(
        (tmp_path / "report.html").read_text(encoding="utf-8")
    )


def test_simulations_that_leave_are_no_silent_reset(simulated: SimulatedMotion, tmp_path: Path) -> None:
    held = [recording for recording in simulated.recordings if recording.test]
    wild = Recording("wild", time=held[0].time, position=held[0].position, torque=1e6 * held[0].torque)
    motion = judge({"nominal": simulated.nominal}, [wild], horizons=(0.5,), most=3)
    assert np.abs(motion.errors("nominal", 0.5)).max() > 500.0
    assert "more than a turn" in rollout_words(motion)
    assert not list(Path.cwd().glob("MUJOCO_LOG.TXT"))


def rollout_words(motion: Judgement) -> str:
    from truing.dynamics.rollout import shown

    return shown(motion.worst_joint("nominal", 0.5), "rad")


def test_rollout_has_a_place_in_the_package() -> None:
    assert truing.dynamics.rollout.__doc__
