# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A robot as the plain numbers from which a page draws it, and lets its reader turn its joints.

The page computes where joints are by itself (``web/src/kinematics.js``, ``web/src/effects.js``); tests
hold it against the core.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.files.link_meshes import Looks
from truing.report.arrays import packed
from truing.report.scene import RobotPicture

Floats = NDArray[np.float64]

LINK_VALUES = ("theta", "d", "a", "alpha", "beta")
UNLIMITED = {"revolute": math.pi, "prismatic": 1.0}  # [rad | m] how far a slider goes where there is no limit
USUAL_LOAD, USUAL_WARMTH = (0.0, 10.0), (10.0, 40.0)  # [kg], [deg C] where nobody said what was measured
# Which drivers of effects (`CatalogueEffect.traits`) a slider stands for.
BY_WEIGHT, BY_WARMTH, BY_DIRECTION = {"gravity_torque", "several"}, {"temperature"}, {"direction", "several"}


def robot_numbers(robot: _core.Robot, target: int = 0) -> dict[str, Any]:
    """The robot as the page's script reads it, with one of its targets. Frames are the first three rows of
    their matrices; lengths in m, angles in rad.
    """
    if robot.targets:
        tool = robot.targets[target]
        name, frame = tool.name, np.asarray(tool.T_last_target)
    else:
        name, frame = "tool", np.eye(4)
    return {
        "convention": robot.convention,
        "gravity": np.asarray(robot.gravity),
        "T_measurement_base": _rows(np.asarray(robot.T_measurement_base)),
        "joints": [_joint_numbers(joint) for joint in robot.joints],
        "target": {"name": name, "T_last_target": _rows(frame)},
        "effects": effects_of(robot),
    }


def _rows(frame: Floats) -> list[float]:
    return [float(v) for v in np.asarray(frame)[:3].ravel()]


def _joint_numbers(joint: _core.Joint) -> dict[str, Any]:
    return {
        "name": joint.name,
        "type": joint.type,
        **{value: getattr(joint, value) for value in LINK_VALUES},
        "T_parent_joint": _rows(np.asarray(joint.T_parent_joint)),
        "axis": np.asarray(joint.axis),
        "ratio": joint.ratio,
        "offset": joint.offset,
        "driven_by": [[name, weight] for name, weight in joint.driven_by],
        "mass": joint.mass,
        "center_of_mass": np.asarray(joint.center_of_mass),
    }


def effects_of(robot: _core.Robot) -> list[dict[str, Any]]:
    """The effects of a robot with their parameters, as the page's script reads them."""
    return [
        {"effect": e.effect, "joints": list(e.joints), "parameters": dict(e.parameters)}
        for e in robot.effects
    ]


def differences(before: _core.Robot, after: _core.Robot) -> dict[str, float]:
    """What is added to the values of `before` to make the chain of `after`, by name of the value; effects are
    left out. Frames differ by rotations on top of that of `before`.
    """
    added: dict[str, float] = {}
    added |= _frame_difference(
        "base", np.asarray(before.T_measurement_base), np.asarray(after.T_measurement_base)
    )
    for old, new in zip(before.joints, after.joints, strict=True):
        for value in (*LINK_VALUES, "ratio", "offset"):
            added[f"{old.name}.{value}"] = getattr(new, value) - getattr(old, value)
        if before.convention == "urdf":
            frames = np.asarray(old.T_parent_joint), np.asarray(new.T_parent_joint)
            added |= _frame_difference(old.name, *frames)
    if before.targets and after.targets:
        tools = before.targets[0], after.targets[0]
        added |= _frame_difference(tools[0].name, *(np.asarray(tool.T_last_target) for tool in tools))
    return {name: value for name, value in added.items() if value}


def _frame_difference(name: str, before: Floats, after: Floats) -> dict[str, float]:
    shift = after[:3, 3] - before[:3, 3]
    turn = _core.rpy_from_rotation(after[:3, :3] @ before[:3, :3].T)
    values = {f"{name}.{axis}": float(v) for axis, v in zip("xyz", shift, strict=True)}
    return values | {f"{name}.r{axis}": float(v) for axis, v in zip("xyz", turn, strict=True)}


def cause(
    name: str,
    colour: str,
    joints: Iterable[str] = (),
    *,
    added: Mapping[str, float] | None = None,
    effects: Sequence[Mapping[str, Any]] = (),
    curves: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Something that makes the robot differ from its model, and that a page can enlarge.

    added: what it adds to values of the chain: {"J2.a": 1e-4}.
    effects: as `effects_of` gives them.
    curves: functions of an input that act at a site: {"site", "input", "second", "points"}.
    """
    return {
        "name": name,
        "colour": colour,
        "joints": list(joints),
        "added": dict(added or {}),
        "effects": list(effects),
        "curves": list(curves),
    }


def robot_picture(
    robot: _core.Robot,
    *,
    causes: Sequence[Mapping[str, Any]] = (),
    readings: Floats | None = None,
    payload: Floats | None = None,
    temperature: Floats | None = None,
    poses: tuple[Sequence[str], Floats] | None = None,
    play: Mapping[str, Any] | None = None,
    stand: Floats | None = None,
    looks: Looks | None = None,
) -> RobotPicture:
    """The robot for a page's 3-D picture.

    robot: the one that is drawn as the model.
    causes: what makes it differ, see `cause`; the first is shown first.
    readings: shape=(n, driven joints) [rad | m], what was measured at: sliders reach at least so far, and the
        picture begins at one of them.
    payload: shape=(n,) [kg]; temperature: shape=(n,) [deg C]; both of the measurements.
    poses: names and readings, shape=(m, driven joints), among which the reader chooses.
    play: "time" shape=(n,) [s], "name" and "first" shape=(n, driven joints), and "others", readings by name,
        of the same shape: motions that are played over each other.
    stand: shape=(driven joints,) the readings of the picture's beginning.
    looks: meshes of its links (`truing.files.looks_of`); where a link has none it is drawn as a capsule.
    """
    driven = [robot.joints[index] for index in robot.driven_joints()]
    seen = [np.atleast_2d(r) for r in (readings, None if poses is None else poses[1]) if r is not None]
    every = np.concatenate(seen) if seen else np.zeros((0, len(driven)))
    every = every[np.isfinite(every).all(axis=1)]
    if stand is None:
        stand = _usual_stand(driven, every)
    joints = [_slider(joint, every[:, k], float(stand[k])) for k, joint in enumerate(driven)]
    drivers = _drivers(
        {e["effect"] for c in causes for e in c["effects"]} | {e.effect for e in robot.effects}
    )
    inputs = {curve["input"].rstrip("0123456789") for c in causes for curve in c["curves"]}
    line, places = _stand_line(robot, stand)
    scene = {
        "model": robot_numbers(robot),
        "reach": _reach(robot),
        "joints": joints,
        "value": stand,
        "payload": _input(robot, "payload", payload, USUAL_LOAD)
        if drivers & BY_WEIGHT or inputs & {"torque", "payload"}
        else None,
        "temperature": _input(robot, "temp", temperature, USUAL_WARMTH)
        if drivers & BY_WARMTH or "temp" in inputs
        else None,
        "directions": bool(drivers & BY_DIRECTION or "dir" in inputs),
        "causes": list(causes),
        "poses": None if poses is None else {"names": list(poses[0]), "readings": packed(poses[1].ravel())},
        "play": None if play is None else _played(play),
        **_looks_numbers(looks or Looks([])),
    }
    marked = {places[name]: c["colour"] for c in causes[:1] for name in c["joints"] if name in places}
    return RobotPicture(scene, line, marked)


def _looks_numbers(looks: Looks) -> dict[str, Any]:
    meshes = [
        {"joint": mesh.joint, "points": packed(mesh.points.ravel()), "faces": packed(mesh.faces.ravel())}
        for mesh in looks.meshes
    ]
    return {"meshes": meshes, "note": looks.note}


def _drivers(effects: Iterable[str]) -> set[str]:
    """The inputs that effects depend on, as the catalogue has them."""
    traits = {effect.name: effect.traits for effect in _core.catalogue_effects()}
    return {traits[name.partition("@")[0]].driver for name in effects if name.partition("@")[0] in traits}


def _played(play: Mapping[str, Any]) -> dict[str, Any]:
    others = [
        {"name": name, "readings": packed(np.asarray(readings).ravel())}
        for name, readings in play["others"].items()
    ]
    return {
        "time": packed(np.asarray(play["time"])),
        "name": play["name"],
        "first": packed(np.asarray(play["first"]).ravel()),
        "others": others,
    }


def _usual_stand(driven: Sequence[_core.Joint], every: Floats) -> Floats:
    """The measured pose nearest to the middle of all; else the middle of the limits, bent where it may be."""
    if len(every):
        span = np.maximum(np.ptp(every, axis=0), 1e-9)
        off = np.abs(every - np.median(every, axis=0)) / span
        return np.asarray(every[int(np.argmin(off.sum(axis=1)))])
    ends = [(_finite(j.lower, -UNLIMITED[j.type]), _finite(j.upper, UNLIMITED[j.type])) for j in driven]
    return np.array([0.5 * (low + high) for low, high in ends])


def _finite(value: float, otherwise: float) -> float:
    return value if math.isfinite(value) else otherwise


def _slider(joint: _core.Joint, seen: Floats, value: float) -> dict[str, Any]:
    reach = UNLIMITED[joint.type]
    ends = [_finite(joint.lower, -reach), _finite(joint.upper, reach)]
    low = min(ends[0], value, *seen.tolist())
    high = max(ends[1], value, *seen.tolist())
    return {
        "name": joint.name,
        "unit": "rad" if joint.type == "revolute" else "m",
        "lower": low,
        "upper": high,
    }


def _input(
    robot: _core.Robot, name: str, measured: Floats | None, usual: tuple[float, float]
) -> dict[str, float]:
    """Range and beginning of a slider for an input."""
    known = np.zeros(0) if measured is None else np.asarray(measured)[np.isfinite(measured)]
    fitted = robot.fitted_range.get(name)
    low, high = (float(known.min()), float(known.max())) if known.size else fitted or usual
    if name == "payload":
        low = 0.0
    if high - low < 1e-6:
        high = low + (usual[1] - usual[0])
    value = float(np.median(known)) if known.size else low if name == "payload" else 0.5 * (low + high)
    return {"low": low, "high": high, "value": value}


def _reach(robot: _core.Robot) -> float:
    """Length of all links in one line [m], at readings of zero."""
    frames = np.asarray(_core.forward_kinematics(robot, np.zeros(robot.driven_count)))
    places = np.concatenate([np.asarray(robot.T_measurement_base)[None, :3, 3], frames[:, :3, 3]])
    return max(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()), 1e-3)


def _stand_line(robot: _core.Robot, reading: Floats) -> tuple[Floats, dict[str, int]]:
    """The robot as a line through its joints, shape=(n, 3), with the corners of its links, and where on it
    each joint is.
    """
    frames = np.asarray(_core.forward_kinematics(robot, reading))
    before = np.asarray(robot.T_measurement_base)
    line, places = [before[:3, 3]], {}
    for joint, after in zip(robot.joints, frames, strict=False):
        if robot.convention == "dh":
            places[joint.name] = len(line) - 1
        if robot.convention != "urdf":  # along z first and then along x, or the other way round
            along = before[:3, 2] if robot.convention == "dh" else before[:3, 0]
            line.append(before[:3, 3] + along * float(along @ (after[:3, 3] - before[:3, 3])))
        line.append(after[:3, 3])
        if robot.convention != "dh":
            places[joint.name] = len(line) - 1
        before = after
    line.append(frames[-1][:3, 3])
    return np.array(line), places


def without(robot: _core.Robot, added: Mapping[str, float]) -> _core.Robot:
    """The robot before `added` (see `differences`) was added to values of its joints; those of base and
    targets stay.
    """
    out = robot.copy()
    for joint in out.joints:
        here = {name.removeprefix(f"{joint.name}."): value for name, value in added.items()}
        for value in (*LINK_VALUES, "ratio", "offset"):
            if value in here:
                setattr(joint, value, getattr(joint, value) - here[value])
        if robot.convention == "urdf":
            frame = np.array(joint.T_parent_joint)
            frame[:3, 3] -= [here.get(axis, 0.0) for axis in "xyz"]
            turn = np.array([here.get(f"r{axis}", 0.0) for axis in "xyz"])
            if turn.any():
                frame[:3, :3] = _core.rotation_from_rpy(turn).T @ frame[:3, :3]
            joint.T_parent_joint = frame
    return out


def tip_motion(before: _core.Robot, after: _core.Robot, joint: str, readings: Floats) -> float:
    """Rms motion [m] of the flange that the changed values of one joint make, effects left out. readings:
    shape=(n, driven joints).
    """
    changed = before.copy()
    old, new = changed.joint(joint), after.joint(joint)
    for value in (*LINK_VALUES, "ratio", "offset", "T_parent_joint"):
        setattr(old, value, getattr(new, value))
    places = [np.asarray(_core.flange_poses(robot, readings))[:, :3, 3] for robot in (before, changed)]
    return float(np.sqrt(np.mean(np.sum((places[1] - places[0]) ** 2, axis=1))))
