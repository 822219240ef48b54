# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Real recordings of motion and torque as a source of real motion and real noise.

A flexible fit takes what is systematic (inertias, friction, every textbook effect at every joint); what it
leaves is neither white nor Gaussian. It is put on the arm of the data sheet with usual friction and one
sealed
effect.
"""

from __future__ import annotations

import functools
import os
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from truing.exam.dynamics.bodies import regressor, torques
from truing.exam.dynamics.laws import Scene
from truing.exam.dynamics.physics import Motion
from truing.exam.dynamics.robots import Arm, Floats, Link
from truing.exam.dynamics.sizing import forms_at, low_pass, orthonormal

_BAND = 8.0  # [Hz] of the derivatives
_GAINS = (10.0, 10.6956, 8.4566, 9.0029, 9.48, 10.1232)  # [Nm/A], published beside the currents
_BLOCKS = 4  # into which one long recording is cut


@dataclass(frozen=True)
class Source:
    """Where recordings are: of several files the last is held out; one file is cut into blocks."""

    folder: str
    files: tuple[str, ...]
    gains: tuple[float, ...] | None = None  # of currents [Nm/A]


_SOURCES = {
    "development": Source("dyn_ur10e", ("h10_20s", "h12_20s", "h8_20s", "free_1223", "h7_20s"), _GAINS),
    "examination": Source("dyn_ur10", ("run",)),
}
LOADED = Source("dyn_ur10e", ("h10_20s", "h12_20s", "h14_50s", "h14_50s_load"), _GAINS)
"""The last recording carries 2.805 kg."""


@dataclass(frozen=True)
class Real:
    """A real recording: as it was read, smoothed, and what a flexible fit leaves of its torques."""

    name: str
    test: bool
    t: Floats
    q: Floats
    qd: Floats | None
    measured: Floats  # shape=(rows, n) [Nm]
    scene: Scene  # smoothed motion; its total is that of links and usual friction, fitted
    standard: Floats  # shape=(rows, n) [Nm] what standard practice leaves
    residual: Floats  # shape=(rows, n) [Nm] what the flexible fit leaves


@dataclass(frozen=True)
class Recorded:
    arm: Arm
    recordings: tuple[Real, ...]
    sigma_standard: Floats  # [Nm] of what standard practice leaves
    sigma: Floats  # [Nm] of what the flexible fit leaves


def missing(which: str) -> str:
    """Why the recordings cannot take part; empty: they can."""
    place = os.environ.get("TRUING_REALDATA")
    if not place or not Path(place).is_dir():
        return "TRUING_REALDATA names no folder with recordings"
    folder = _SOURCES[which].folder
    return "" if (Path(place) / folder).is_dir() else f"no {folder} in TRUING_REALDATA"


@functools.cache
def recorded(which: str) -> Recorded:
    return _load(_SOURCES[which])


@functools.cache
def recorded_with_load() -> Recorded:
    return _load(LOADED)


def _load(source: Source) -> Recorded:
    place = Path(os.environ["TRUING_REALDATA"]) / source.folder
    arm = arm_of_urdf((place / "robot.urdf").read_text(encoding="utf-8"))
    found = [part for name in source.files for part in _read(place / f"{name}.csv", arm, source)]
    found[-1] = replace(found[-1], test=True)
    standard, flexible, model = _fits(found)
    arm = replace(arm, coulomb=model[0], viscous=model[1])
    reals = []
    for one, rough, rest in zip(found, standard, flexible, strict=True):
        scene = replace(one.scene, arm=arm, total=_with_friction(one.scene, *model))
        reals.append(replace(one, scene=scene, standard=rough, residual=rest))
    spread = [np.sqrt(np.mean(np.concatenate(r) ** 2, axis=0)) for r in (standard, flexible)]
    return Recorded(arm, tuple(reals), *spread)


def _read(path: Path, arm: Arm, source: Source) -> list[Real]:
    with open(path, encoding="utf-8") as file:
        head = file.readline().strip().split(",")
    numbers = np.loadtxt(
        path, delimiter=",", skiprows=1, usecols=[k for k, c in enumerate(head) if c != "set"], ndmin=2
    )
    column = {name: numbers[:, k] for k, name in enumerate(c for c in head if c != "set")}

    def of(pattern: str) -> Floats:
        return np.stack([column[pattern.format(j + 1)] for j in range(arm.n)], axis=1)

    gains = source.gains
    measured = of("i{}_A") * np.array(gains) if gains else of("tau{}_Nm")
    even, step = _even(column["t_s"])
    values = [_at(even, column["t_s"], c) for c in (of("q{}_rad"), of("qd{}_rad_s"), measured)]
    blocks = 1 if len(source.files) > 1 else _BLOCKS
    found = []
    for number, rows in enumerate(np.array_split(np.arange(len(even)), blocks)):
        q, qd, tau = (value[rows] for value in values)
        name = path.stem if blocks == 1 else f"{path.stem}_{number + 1}"
        t = even[rows] - even[rows[0]]
        found.append(Real(name, False, t, q, qd, tau, _smoothed(arm, t, q, step), tau, tau))
    return found


def _even(t: Floats) -> tuple[Floats, float]:
    step = float(np.median(np.diff(t)))
    return np.arange(round((t[-1] - t[0]) / step) + 1) * step + t[0], step


def _at(even: Floats, t: Floats, values: Floats) -> Floats:
    return np.stack([np.interp(even, t, column) for column in values.T], axis=1)


def _smoothed(arm: Arm, t: Floats, q: Floats, step: float) -> Scene:
    smooth = low_pass(q, step, _BAND)
    qd = np.gradient(smooth, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    motion = Motion(t, smooth, qd, qdd, torques(arm, smooth, qd, qdd))
    return Scene(arm, motion, motion.torque, np.full_like(q, 22.0), step)


def _fits(found: list[Real]) -> tuple[list[Floats], list[Floats], tuple[Floats, Floats]]:
    """What standard practice and the flexible fit leave, and Coulomb's and viscous friction."""
    n = found[0].scene.arm.n
    scenes = [one.scene for one in found]
    bodies = [regressor(s.arm, s.motion.q, s.motion.qd, s.motion.qdd) for s in scenes]
    standard, rough, friction = [], [], np.zeros((2, n))
    measured = np.concatenate([low_pass(one.measured, one.scene.step) for one in found])
    for j in range(n):
        columns = [
            np.stack([s.sign(j), s.motion.qd[:, j], np.ones(len(s.motion.t)), *b[:, j].T], axis=1)
            for s, b in zip(scenes, bodies, strict=True)
        ]
        both = _in_band(columns, scenes)
        size = np.linalg.norm(both, axis=0).clip(1e-9)
        fit = np.linalg.lstsq(both / size, measured[:, j], rcond=1e-6)[0] / size
        friction[:, j] = np.abs(fit[:2])
        rough.append(_left(both, measured[:, j]))
        standard.append(both)
    coulomb, viscous = friction
    loaded = [replace(s, total=_with_friction(s, coulomb, viscous)) for s in scenes]
    fine = []
    for j in range(n):
        forms = _in_band([_forms(s, j) for s in loaded], loaded)
        fine.append(_left(np.concatenate([standard[j], forms], axis=1), measured[:, j]))
    ends = np.cumsum([len(one.t) for one in found])[:-1]
    standard_left, flexible_left = (np.split(np.stack(left, axis=1), ends) for left in (rough, fine))
    return standard_left, flexible_left, (coulomb, viscous)


def _left(columns: Floats, tau: Floats) -> Floats:
    q = orthonormal(columns)
    return np.asarray(tau - q @ (q.T @ tau))


def _with_friction(s: Scene, coulomb: Floats, viscous: Floats) -> Floats:
    sign = np.stack([s.sign(j) for j in range(s.arm.n)], axis=1)
    return np.asarray(s.motion.torque + coulomb * sign + viscous * s.motion.qd)


def _forms(s: Scene, j: int) -> Floats:
    forms = forms_at(s, j, frozenset())
    return np.stack([column for every in forms.values() for form in every for column in form], axis=1)


def _in_band(columns: list[Floats], scenes: list[Scene]) -> Floats:
    return np.concatenate([low_pass(c, s.step) for c, s in zip(columns, scenes, strict=True)])


def arm_of_urdf(text: str) -> Arm:
    """A serial arm from its URDF, in frames that are parallel at zero."""
    root = ElementTree.fromstring(text)
    links = {link.get("name"): link for link in root.iter("link")}
    joints = root.findall("joint")
    chain = _longest(joints)
    turn, offset = np.eye(3), np.zeros(3)
    rows = []
    for joint in chain:
        origin = joint.find("origin")
        offset = offset + turn @ _numbers(origin, "xyz")
        turn = turn @ _rpy(_numbers(origin, "rpy"))
        if joint.get("type") == "fixed":
            continue
        limit = _of(joint, "limit")
        axis = turn @ _numbers(_of(joint, "axis"), "xyz")
        speed = float(limit.get("velocity") or 3.0)
        rows.append((offset, axis, _link(links[_of(joint, "child").get("link")], turn), speed))
        offset = np.zeros(3)
    n = len(rows)
    ones = np.ones(n)
    return Arm(
        root.get("name") or "arm",
        np.stack([r[0] for r in rows]),
        np.stack([r[1] for r in rows]),
        tuple(r[2] for r in rows),
        6.0 * ones,
        np.array([r[3] for r in rows]),
        ones,
        ones,
        offset,
        5.0,
    )


def _longest(joints: list[ElementTree.Element]) -> list[ElementTree.Element]:
    """The chain with the most joints that move, from its root on."""
    above = {_of(joint, "child").get("link"): joint for joint in joints}
    chains = []
    for place in above:
        chain: list[ElementTree.Element] = []
        while place in above:
            chain.insert(0, above[place])
            place = _of(above[place], "parent").get("link")
        chains.append(chain)
    return max(chains, key=lambda chain: (sum(joint.get("type") != "fixed" for joint in chain), -len(chain)))


def _of(element: ElementTree.Element, name: str) -> ElementTree.Element:
    found = element.find(name)
    if found is None:
        raise ValueError(f"the URDF of a recording has no <{name}> in a {element.tag}")
    return found


def _numbers(element: ElementTree.Element | None, name: str) -> Floats:
    text = element.get(name) if element is not None else None
    return np.array([float(word) for word in (text or "0 0 0").split()])


def _rpy(angles: Floats) -> Floats:
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


def _link(link: ElementTree.Element, turn: Floats) -> Link:
    inertial = _of(link, "inertial")
    origin, inertia = inertial.find("origin"), _of(inertial, "inertia")
    i = {key: float(inertia.get(key) or 0.0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
    own = np.array(
        [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
    )
    frame = turn @ _rpy(_numbers(origin, "rpy"))
    mass = _of(inertial, "mass").get("value")
    return Link(float(mass or 0.0), turn @ _numbers(origin, "xyz"), frame @ own @ frame.T)
