# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Pages draw a robot where the core says that it is: the page's own kinematics against the core's, with every
effect, load, temperature and direction of approach. One page in one browser computes all of it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from browser import dom_of
from truing import _core
from truing.drawing import differences, robot_numbers, without
from truing.report.json_text import without_nan

POSES = 20
NEAR = 1e-9  # [m]; what is promised is 1e-6
# Effects that a page does not show: they belong to instrument, clocks or motor, are values of the model, or
# have no law.
NOT_DRAWN = {"windup", "scale", "drift", "time_offset", "wire_pull", "lookup_table"}
ARM = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="rail" type="prismatic"><parent link="a"/><child link="b"/>
<origin xyz="0.1 0.2 0.3" rpy="0.1 -0.4 0.7"/><axis xyz="0 0.6 0.8"/>
<limit lower="-0.5" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="swing" type="revolute"><parent link="b"/><child link="c"/>
<origin xyz="0.3 0 0.1" rpy="1.2 0.3 -0.5"/><axis xyz="0.6 0 -0.8"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="wrist" type="revolute"><parent link="c"/><child link="d"/>
<origin xyz="0 0.4 0.1" rpy="-0.3 0 0.2"/><axis xyz="0 0 -1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""


def robots(rng: np.random.Generator) -> Iterator[truing.Robot]:
    """The shipped robots, some with errors and all effects; a URDF; modified DH."""
    for file in sorted((resources.files("truing") / "examples").iterdir(), key=str):
        if file.name.endswith(".yaml"):
            yield truing.load_robot(Path(str(file)))
    yield _core.robot_from_urdf(ARM)
    yield modified_dh(rng)


def modified_dh(rng: np.random.Generator) -> truing.Robot:
    joints = [
        truing.Joint(
            f"M{k}",
            type="prismatic" if k == 2 else "revolute",
            theta=rng.uniform(-1, 1),
            d=rng.uniform(0, 0.4),
            a=rng.uniform(0, 0.4),
            alpha=rng.uniform(-2, 2),
            beta=rng.uniform(-0.1, 0.1),
        )
        for k in range(5)
    ]
    return truing.Robot("modified", joints=joints, convention="mdh")


def wrong(robot: truing.Robot, rng: np.random.Generator) -> truing.Robot:
    """Other values of the chain, in all of its parts, and weights."""
    out = robot.copy()
    for joint in out.joints:
        for value in ("theta", "d", "a", "alpha", "beta", "offset"):
            setattr(joint, value, getattr(joint, value) + rng.normal(0, 0.01))
        if not joint.driven_by:
            joint.ratio *= 1 + rng.normal(0, 1e-3)
        joint.mass = rng.uniform(1, 20)
        joint.center_of_mass = rng.normal(0, 0.1, 3)
        frame = np.array(joint.T_parent_joint)
        frame[:3, 3] += rng.normal(0, 0.01, 3)
        frame[:3, :3] = truing.model.rotation_from_rpy(rng.normal(0, 0.02, 3)) @ frame[:3, :3]
        if robot.convention == "urdf":
            joint.T_parent_joint = frame
    return out


def inputs_of(robot: truing.Robot, rng: np.random.Generator, rows: int = POSES) -> truing.Measurements:
    """Random poses with all that effects look at."""
    driven = [robot.joints[k] for k in robot.driven_joints()]
    reach = [1.0 if joint.type == "revolute" else 0.3 for joint in driven]
    joints = rng.uniform(-1, 1, (rows, len(driven))) * reach
    return truing.Measurements(
        joints=joints,
        positions=truing.model.flange_poses(robot, joints)[:, :3, 3],
        directions=rng.choice([-1.0, 1.0], joints.shape),
        payload=rng.uniform(0.5, 8, rows),
        temperature=rng.uniform(10, 40, rows),
    )


def with_effect(robot: truing.Robot, name: str, rng: np.random.Generator) -> truing.Robot | None:
    """The robot with an effect at all joints that suit, its parameters drawn; None where none suits."""
    try:
        fitted = _core.identify(
            robot,
            inputs_of(robot, rng, 60),
            _core.IdentifyOptions(effects=[_core.EffectRequest(name)]),
        )
    except truing.InputError:
        return None
    effects = []
    for effect in fitted.robot.effects:
        constants = {".T1": 5.0, ".T2": 20.0}
        parameters = {
            key: next((v for end, v in constants.items() if key.endswith(end)), None)
            or (value if ".phase" in key or ".reference" in key else rng.normal(0, 1e-3))
            for key, value in effect.parameters.items()
        }
        effects.append(truing.model.AppliedEffect(effect.effect, effect.joints, parameters))
    return robot.replace(effects=effects)


def case(name: str, robot: truing.Robot, data: truing.Measurements) -> dict[str, Any]:
    return {
        "name": name,
        "robot": robot_numbers(robot),
        "joints": np.asarray(data.joints),
        "direction": np.asarray(data.directions),
        "payload": np.asarray(data.payload),
        "temperature": np.asarray(data.temperature),
        "expected": np.asarray(_core.predict(robot, data).position),
    }


COMPUTE = """
const off = {};
for (const c of JSON.parse(document.getElementById('cases').textContent)) {
  off[c.name] = Math.max(...c.joints.map((q, k) => {
    const at = {payload: c.payload[k], temperature: c.temperature[k], direction: c.direction[k]};
    const {frames} = truing.forward(c.robot, q, at), T = frames[frames.length - 1];
    return Math.hypot(T[3] - c.expected[k][0], T[7] - c.expected[k][1], T[11] - c.expected[k][2]);
  }));
}
for (const c of JSON.parse(document.getElementById('changes').textContent)) {
  const T = truing.chain(c.robot, c.joints, c.added).frames.at(-1);
  off[c.name] = Math.max(...T.map((v, k) => Math.abs(v - c.expected[k])));
}
document.getElementById('off').textContent = JSON.stringify(off);
"""


def computed(folder: Path, cases: list[Any], changes: list[Any]) -> dict[str, float]:
    """How far the page's kinematics are off, by name of the case [m]."""
    script = (resources.files("truing") / "report" / "report.js").read_text(encoding="utf-8")
    data = "".join(
        f'<script type="application/json" id="{name}">{json.dumps(without_nan(value))}</script>'
        for name, value in (("cases", cases), ("changes", changes))
    )
    page = folder / "page.html"
    page.write_text(
        f'<!doctype html><meta charset="utf-8"><pre id="off"></pre>{data}'
        f"<script>{script}</script><script>{COMPUTE}</script>",
        encoding="utf-8",
    )
    found = re.search('<pre id="off">(.*?)</pre>', dom_of(page))
    assert found is not None
    off: dict[str, float] = json.loads(found[1])
    return off


def test_pages_compute_joints_effects_and_changes_as_the_core_does(tmp_path: Path) -> None:
    rng = np.random.default_rng(17)
    names = [e.name.replace("transmission_error", "transmission_error@14") for e in _core.catalogue_effects()]
    cases, changes, drawn = [], [], set()
    for shipped in robots(rng):
        cases.append(case(shipped.name, shipped, inputs_of(shipped, rng)))
        robot = wrong(shipped, rng)
        cases.append(case(f"{robot.name}, other values", robot, inputs_of(robot, rng)))
        q = np.asarray(inputs_of(robot, rng).joints)[0]
        moved = np.asarray(truing.model.forward_kinematics(robot, q))[-1]
        changes.append(
            {
                "name": f"{robot.name}, changed",
                "robot": robot_numbers(shipped),
                "joints": q,
                "added": differences(shipped, robot),
                "expected": moved[:3].ravel(),
            }
        )
        for name in names:
            if name in NOT_DRAWN or (changed := with_effect(robot, name, rng)) is None:
                continue
            if changed.effects:
                drawn.add(name)
                at = inputs_of(robot, rng)
                moved_by = _core.predict(changed, at).position - _core.predict(robot, at).position
                assert np.abs(moved_by).max() > 1e-6, name
                cases.append(case(f"{robot.name}, {name}", changed, inputs_of(robot, rng)))
    off = computed(tmp_path, cases, changes)
    assert len(off) == len(cases) + len(changes)
    assert {name: value for name, value in off.items() if not value < NEAR} == {}
    of_model = {e.name for e in _core.catalogue_effects() if e.traits.stands_for}
    assert drawn == set(names) - NOT_DRAWN - of_model, (
        "every effect of the catalogue is drawn, or said not to be"
    )


def test_taking_away_what_was_added_gives_the_robot_before() -> None:
    rng = np.random.default_rng(3)
    for shipped in robots(rng):
        robot = wrong(shipped, rng)
        added = differences(shipped, robot)
        assert added
        before = without(robot, added)
        q = np.asarray(inputs_of(robot, rng).joints)[0]
        assert truing.model.forward_kinematics(before, q) == pytest.approx(
            np.asarray(truing.model.forward_kinematics(shipped, q)), abs=1e-12
        )
