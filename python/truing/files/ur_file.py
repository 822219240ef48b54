# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Universal Robots: calibration.conf of the controller, and the kinematics that a program (.urp) carries.

Every arm of this maker is calibrated in the factory, and its controller uses that. calibration.conf holds
what is added to the data sheet, a .urp the sums for a, d and alpha. The axes of shoulder lift, elbow and
wrist 1 are nearly parallel, where Denavit and Hartenberg's d is where two common perpendiculars happen to
stand: up to hundreds of metres, which cancel. `shortened` writes the same product of transforms with Hayati's
beta and the data sheet's d.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.files.arms import ARMS, UR_JOINTS, Arm, Row, arms_of, joint_of
from truing.files.brand_frames import frame_from_numbers
from truing.files.common import decoded, listed, read_bytes, shown
from truing.files.controller_parts import ControllerModel, unknown_arm

Floats = NDArray[np.float64]

_MAKER = "Universal Robots"
_CONF_KEYS = ("delta_theta", "delta_a", "delta_d", "delta_alpha")
_KNOWN_STATUS = {0: "not initialised", 1: "not linearised", 2: "linearised"}
_LINEARISED = 2
_LARGEST = 64_000_000  # bytes of a program, unpacked
_LARGEST_D = 1e5  # [m] as written
_LARGEST_TWIST = 2 * math.pi  # [rad]
_LONGEST = 3.0  # [m] link of an arm of this maker
_NEAR_PARALLEL = math.radians(10)
_FIT = 0.01  # [m] that an arm's lengths are off its data sheet at most
_FIT_ANGLE = 0.05  # [rad]
_ENCODERS = "of its encoders and their checks: not part of the kinematics"


@dataclass(frozen=True)
class Table:
    """Denavit-Hartenberg values of six links, shape=(6,) each [rad, m]; beta: Hayati's."""

    theta: Floats
    d: Floats
    a: Floats
    alpha: Floats
    beta: Floats

    @staticmethod
    def of(arm: Arm) -> Table:
        theta, d, a, alpha = np.array([(row.theta, row.d, row.a, row.alpha) for row in arm.rows]).T
        return Table(theta, d, a, alpha, np.zeros(len(arm.rows)))


# ---- The same chain without long way round -------------------------------------------------------


def shortened(table: Table, nominal_d: Floats, nominal_a: Floats) -> Table:
    """The same product of transforms, with d of near-parallel links brought to the data sheet's.

    Links i whose axis is near-parallel to the next one: Rz(theta) Tz(d) Tx(a) Rx(alpha) moves along the next
    axis by s to where that meets the plane z = nominal d, and turns about it by phi; the next link takes both
    back. What remains is Rz(theta') Tz(d') Tx(a') Rx(alpha') Ry(beta') (Hayati 1983).
    """
    theta, d, a = table.theta.copy(), table.d.copy(), table.a.copy()
    alpha, beta = table.alpha.copy(), table.beta.copy()
    for i in range(len(theta) - 1):
        if abs(math.sin(alpha[i])) > math.sin(_NEAR_PARALLEL):
            continue
        link = _link(theta[i], d[i], a[i], alpha[i])
        along = link[:3, 2]
        s = (nominal_d[i] - link[2, 3]) / along[2]
        place = link[:3, 3] + s * along
        sign = -1.0 if nominal_a[i] < 0 else 1.0
        theta[i] = math.atan2(sign * place[1], sign * place[0])
        d[i], a[i] = nominal_d[i], sign * math.hypot(place[0], place[1])
        rest = _rz(-theta[i]) @ link[:3, :3]
        beta[i] = math.asin(max(-1.0, min(1.0, rest[0, 2])))
        alpha[i] = math.atan2(-rest[1, 2], rest[2, 2])
        turn = rest.T @ _rx(alpha[i]) @ _ry(beta[i])
        theta[i + 1] -= math.atan2(turn[1, 0], turn[0, 0])
        d[i + 1] -= s
    theta = np.array([math.remainder(value, 2 * math.pi) for value in theta])
    return Table(theta, d, a, alpha, beta)


def _rx(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _ry(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _rz(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _link(theta: float, d: float, a: float, alpha: float) -> Floats:
    T = np.eye(4)
    T[:3, :3] = _rz(theta) @ _rx(alpha)
    T[:3, 3] = (a * math.cos(theta), a * math.sin(theta), d)
    return T


# ---- Which arm -----------------------------------------------------------------------------------


def _misfit(table: Table, arm: Arm) -> float:
    """How far the lengths are off the arm's data sheet [m]; infinite where a twist is another one."""
    nominal = Table.of(arm)
    if float(np.abs(table.alpha - nominal.alpha).max()) > _FIT_ANGLE:
        return math.inf
    return float(max(np.abs(table.a - nominal.a).max(), np.abs(table.d - nominal.d).max()))


def _sums(deltas: Mapping[str, Floats], arm: Arm) -> Table:
    """What the controller computes with: data sheet and calibration added up, without long ways round."""
    sheet = Table.of(arm)
    added = replace(
        sheet,
        theta=sheet.theta + deltas["delta_theta"],
        d=sheet.d + deltas["delta_d"],
        a=sheet.a + deltas["delta_a"],
        alpha=sheet.alpha + deltas["delta_alpha"],
    )
    return shortened(added, sheet.d, sheet.a)


def _arm_named(path: Path, name: str, fitting: Sequence[str]) -> Arm:
    arm = ARMS.get(name.lower())
    if arm is None or arm.maker != _MAKER:
        raise unknown_arm(path, name, fitting or [arm.name for arm in arms_of(_MAKER)])
    return arm


def _robot(path: Path, table: Table, arm: Arm | None, name: str) -> _core.Robot:
    """The robot in convention dh; limits and masses are the data sheet's."""
    endless = Row(0, 0, 0, 0, -2 * math.pi, 2 * math.pi)
    rows = arm.rows if arm is not None else (endless,) * len(UR_JOINTS)
    joints = []
    for k, joint in enumerate(UR_JOINTS):
        theta, d, a, alpha, beta = (
            float(column[k]) for column in (table.theta, table.d, table.a, table.alpha, table.beta)
        )
        row = replace(rows[k], theta=theta, d=d, a=a, alpha=alpha)
        joints.append(joint_of(joint, row, beta))
    try:
        robot = _core.Robot(name, joints=joints)
        _core.validate_robot(robot)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    return robot


def _largest_change(table: Table, arm: Arm, robot: _core.Robot) -> float:
    """How far the factory calibration moves the flange at most, over poses [m]."""
    return _apart(robot, arm.robot())


def _apart(one: _core.Robot, other: _core.Robot) -> float:
    """The largest distance between the flanges of two robots over the same 200 poses [m]."""
    q = np.random.default_rng(200).uniform(-math.pi, math.pi, (200, len(UR_JOINTS)))
    first, second = _core.flange_poses(one, q), _core.flange_poses(other, q)
    return float(np.linalg.norm(first[:, :3, 3] - second[:, :3, 3], axis=1).max())


# ---- calibration.conf ----------------------------------------------------------------------------


def robot_from_calibration_conf(path: Path, arm: str) -> ControllerModel:
    """The robot of a calibration.conf. arm: its data sheet; "": the only one that fits. Raises InputError."""
    entries = _entries(path)
    deltas = {key: _numbers(path, entries, key) for key in _CONF_KEYS}
    fitting = [a.name for a in arms_of(_MAKER) if _misfit(_sums(deltas, a), a) < _FIT]
    if not arm and len(fitting) != 1:
        raise unknown_arm(path, "", fitting)
    chosen = _arm_named(path, arm or fitting[0], fitting)
    table = _sums(deltas, chosen)
    off = _misfit(table, chosen)
    if off >= _FIT:
        raise InputError(
            f"{path}: added to the data sheet of {chosen.name} its values give links that are"
            f" {'twisted otherwise' if math.isinf(off) else f'{1e3 * off:.1f} mm off it'}: it is of another"
            " arm" + (f" ({listed(fitting)} would fit)" if fitting else "")
        )
    robot = _robot(path, table, chosen, path.stem)
    status, said = _status(path, entries)
    warnings = [said] if said else []
    return ControllerModel(
        robot=robot,
        kind="Universal Robots calibration.conf",
        arm=chosen.name,
        understood=(
            ("factory calibration, added to the data sheet of", chosen.name),
            ("calibration status", status),
            ("d of shoulder lift and elbow as written", _long_way(deltas["delta_d"][1:3])),
            ("moves the flange by at most", f"{1e3 * _largest_change(table, chosen, robot):.2f} mm"),
            ("masses, centres of mass, limits", "of the data sheet"),
        ),
        warnings=tuple(warnings),
        not_understood=tuple(
            f"{key} (line {line}): {_ENCODERS if key.startswith('joint_') else 'unknown key'}"
            for key, (line, _) in entries.items()
            if key not in (*_CONF_KEYS, "calibration_status")
        ),
        calibration={
            "source": path.name,
            "controller": "Universal Robots factory calibration",
            "arm": chosen.name,
            **({"joint_checksum": entries["joint_checksum"][1]} if "joint_checksum" in entries else {}),
        },
    )


def _long_way(d: Floats) -> str:
    return ", ".join(f"{value:+.3f} m" for value in d) + " (written with Hayati's beta instead)"


def _entries(path: Path) -> dict[str, tuple[int, str]]:
    """Keys of the section [mounting] with their line and text."""
    text = decoded(path, read_bytes(path, 1_000_000))
    entries: dict[str, tuple[int, str]] = {}
    section = ""
    for number, line in enumerate(text.splitlines(), 1):
        content = line.split("#", 1)[0].strip()
        if not content:
            continue
        if content.startswith("["):
            section = content.strip("[] \t")
            continue
        key, equals, value = (part.strip() for part in content.partition("="))
        if not equals:
            raise InputError(f"{path}, line {number}: found {shown(content)}, expected `key = value`")
        if section != "mounting":
            continue
        if key in entries:
            raise InputError(f"{path}, line {number}: {key} is there twice (first in line {entries[key][0]})")
        entries[key] = (number, value)
    if not any(key in entries for key in _CONF_KEYS):
        raise InputError(
            f"{path}: found no section [mounting] with {listed(_CONF_KEYS)}, expected the calibration.conf"
            " of a Universal Robots controller"
        )
    return entries


def _numbers(path: Path, entries: Mapping[str, tuple[int, str]], key: str) -> Floats:
    if key not in entries:
        raise InputError(f"{path}: {key} is missing, expected six numbers: {key} = [ 0, 0, 0, 0, 0, 0]")
    line, text = entries[key]
    try:
        if not (text.startswith("[") and text.endswith("]")):
            raise ValueError
        values = np.array([float(word) for word in text[1:-1].split(",")])
    except ValueError:
        raise InputError(f"{path}, line {line}: {key} = {shown(text)}, expected [six numbers]") from None
    return _checked(f"{path}, line {line}: {key}", values, key.removeprefix("delta_"))


def _checked(where: str, values: Floats, key: str) -> Floats:
    length = key in ("a", "d")
    if values.shape != (6,):
        raise InputError(f"{where}: found {values.size} numbers, expected six, one for each joint")
    most = _LARGEST_D if length else _LARGEST_TWIST if key == "alpha" else 100.0
    if not (np.abs(values) < most).all():
        raise InputError(
            f"{where}: found {values.tolist()}, expected {'lengths in m' if length else 'angles in rad'}"
        )
    return values


def _status(path: Path, entries: Mapping[str, tuple[int, str]]) -> tuple[str, str]:
    """The calibration's status in words, and what is to be said of it."""
    line, text = entries.get("calibration_status", (0, str(_LINEARISED)))
    if not line:
        return "not stated", ""
    if not text.lstrip("-").isdigit():
        raise InputError(f"{path}, line {line}: calibration_status = {shown(text)}, expected 0, 1 or 2")
    words = _KNOWN_STATUS.get(int(text), f"unknown ({text})")
    if int(text) == _LINEARISED:
        return words, ""
    return words, (
        f"{path.name}: calibration_status is {text} ({words}): its controller may work with the data sheet"
        " instead; compare a pose that it shows with this robot's before compensating"
    )


# ---- .urp ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Kinematics:
    """One <Kinematics> of a program. where: of the program itself, or the waypoint's name."""

    where: str
    initialised: bool
    valid_checksum: bool
    checksum: str
    delta_theta: tuple[float, ...]
    a: tuple[float, ...]
    d: tuple[float, ...]
    alpha: tuple[float, ...]

    @property
    def values(self) -> tuple[tuple[float, ...], ...]:
        return self.delta_theta, self.a, self.d, self.alpha


def robot_from_urp(path: Path, arm: str) -> ControllerModel:
    """The robot that a PolyScope program was taught on. arm: its data sheet, for limits and masses; "": the
    nearest. Raises InputError.
    """
    root = _program(path)
    found, empty = _all_kinematics(path, root)
    if not found:
        raise InputError(
            f"{path}: holds no kinematics ({empty} empty ones): no waypoint was taught on an arm; take"
            " calibration.conf of its controller"
        )
    chosen, rest = _chosen(found)
    as_written = Table(
        np.array(chosen.delta_theta),
        np.array(chosen.d),
        np.array(chosen.a),
        np.array(chosen.alpha),
        np.zeros(6),
    )
    sheet = _arm_named(path, arm, []) if arm else _nearest(as_written)
    table = _short(as_written, sheet)
    if arm and sheet is not None and _misfit(table, sheet) >= _FIT:
        nearest = _nearest(as_written)
        raise InputError(
            f"{path}: its kinematics are not those of {sheet.name}"
            + (f", but of {nearest.name}" if nearest is not None else "")
        )
    longest = max(float(np.abs(table.a).max()), float(np.abs(table.d).max()))
    if longest > _LONGEST:
        raise InputError(f"{path}: its kinematics have a link of {longest:.1f} m: they are no arm's")
    robot = _robot(path, table, sheet, path.stem)
    tool, tool_said = _tool(path, root)
    robot = robot.replace(targets=[_core.Target("tool", tool)])
    return ControllerModel(
        robot=robot,
        kind="Universal Robots program (.urp)",
        arm=sheet.name if sheet is not None else "unknown",
        understood=(
            ("kinematics of", f"{chosen.where}, checksums {chosen.checksum}"),
            ("waypoints and others that carry kinematics", str(len(found))),
            (
                "nearest data sheet",
                sheet.name if sheet is not None else "none: joint limits are one turn each way",
            ),
            ("d of shoulder lift and elbow as written", _long_way(as_written.d[1:3])),
            ("tool", tool_said),
        ),
        warnings=tuple(_urp_warnings(path, robot, chosen, rest, sheet)),
        not_understood=(("moves, waits and everything else of the program: only its kinematics are read"),),
        calibration={
            "source": path.name,
            "controller": "Universal Robots factory calibration",
            "arm": sheet.name if sheet is not None else "unknown",
            "joint_checksum": chosen.checksum,
        },
    )


def _program(path: Path) -> ElementTree.Element:
    data = read_bytes(path, _LARGEST)
    if data.startswith(b"\x1f\x8b"):
        try:
            with gzip.open(path) as file:
                data = file.read(_LARGEST + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise InputError(f"{path}: is damaged: {error}") from None
        if len(data) > _LARGEST:
            raise InputError(f"{path}: has more than {_LARGEST // 1_000_000} MB unpacked")
    text = decoded(path, data)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{path}: declares entities, which no program of PolyScope does")
    try:
        root = ElementTree.fromstring(text.encode())
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: is no program of PolyScope (gzipped XML): {error}") from None
    if root.tag != "URProgram":
        raise InputError(f"{path}: found <{root.tag}>, expected <URProgram>, a program of PolyScope")
    return root


def _all_kinematics(path: Path, root: ElementTree.Element) -> tuple[list[_Kinematics], int]:
    """Those with values, and how many have none: all zero, as a program that was never taught has them."""
    found: list[_Kinematics] = []
    empty = 0
    parents = {child: parent for parent in root.iter() for child in parent}
    for element in root.iter():
        if element.tag.lower() != "kinematics" or element.get("reference") is not None:
            continue
        where = _where(element, parents)
        values = {child.tag: child.get("value", "") for child in element}
        a = _row(path, where, values, "a")
        if not any(a):
            empty += 1
            continue
        found.append(
            _Kinematics(
                where,
                element.get("status", "").upper() == "LINEARIZED",
                element.get("validChecksum", "").lower() == "true",
                ", ".join(values.get("jointChecksum", "").replace(",", " ").split()) or "none",
                _row(path, where, values, "deltaTheta"),
                a,
                _row(path, where, values, "d"),
                _row(path, where, values, "alpha"),
            )
        )
    return found, empty


def _where(element: ElementTree.Element, parents: Mapping[ElementTree.Element, ElementTree.Element]) -> str:
    above = parents.get(element)
    while above is not None and above.tag != "Waypoint":
        if above.tag == "URProgram":
            return "the program"
        above = parents.get(above)
    return f"waypoint {above.get('name', '?')}" if above is not None else "the program"


def _row(path: Path, where: str, values: Mapping[str, str], key: str) -> tuple[float, ...]:
    if key not in values:
        raise InputError(f"{path}: {where}: <Kinematics> has no <{key}>")
    try:
        numbers = np.array([float(word) for word in values[key].split(",")])
    except ValueError:
        raise InputError(f"{path}: {where}: {key} = {shown(values[key])}, expected six numbers") from None
    return tuple(_checked(f"{path}: {where}: {key}", numbers, key).tolist())


def _chosen(found: Sequence[_Kinematics]) -> tuple[_Kinematics, list[_Kinematics]]:
    """The kinematics to use, calibrated before nominal, most frequent first; and those that differ from
    it.
    """

    def order(kinematics: _Kinematics) -> tuple[bool, bool, int]:
        return (
            kinematics.initialised,
            kinematics.valid_checksum,
            sum(other.values == kinematics.values for other in found),
        )

    best = max(found, key=order)
    return best, [other for other in found if other.values != best.values]


def _short(table: Table, sheet: Arm | None) -> Table:
    """With the d of a data sheet, or with none where it is not known: a long way is none of a robot's."""
    nominal = Table.of(sheet) if sheet is not None else None
    flat = np.where(np.abs(np.sin(table.alpha)) < math.sin(_NEAR_PARALLEL), 0.0, table.d)
    return shortened(
        table,
        nominal.d if nominal is not None else flat,
        nominal.a if nominal is not None else -np.ones(6),
    )


def _nearest(table: Table) -> Arm | None:
    misfits = {arm.name: _misfit(_short(table, arm), arm) for arm in arms_of(_MAKER)}
    best = min(misfits, key=lambda name: misfits[name])
    return ARMS[best] if misfits[best] < _FIT else None


def _tool(path: Path, root: ElementTree.Element) -> tuple[Floats, str]:
    """The tool of all waypoints, if they agree: else the flange."""
    poses = {element.get("pose", "") for element in root.iter("TCPOffset")}
    if len(poses) != 1:
        return np.eye(4), f"flange: waypoints have {len(poses)} tools" if poses else "flange: none is stated"
    (text,) = poses
    try:
        T = frame_from_numbers("ur", [float(word) for word in text.split(",")])
    except ValueError:
        raise InputError(f"{path}: TCPOffset {shown(text)}, expected x, y, z, rx, ry, rz") from None
    return T, f"p[{text}] of every waypoint"


def _urp_warnings(
    path: Path, robot: _core.Robot, chosen: _Kinematics, rest: Sequence[_Kinematics], sheet: Arm | None
) -> list[str]:
    said = []
    if sheet is None:
        said.append(
            f"{path.name}: its links are of no arm whose data sheet is known here"
            f" ({listed([a.name for a in arms_of(_MAKER)])}): masses are not known, and limits are one turn"
            " each way"
        )
    if not chosen.initialised or not chosen.valid_checksum:
        said.append(
            f"{path.name}: its kinematics are not calibrated (status not LINEARIZED, or checksum not valid):"
            " this is the data sheet's robot, not the one in the cell; take calibration.conf of its"
            " controller"
        )
    others: dict[tuple[tuple[float, ...], ...], list[_Kinematics]] = {}
    for kinematics in rest:
        others.setdefault(kinematics.values, []).append(kinematics)
    for group in others.values():
        one = group[0]
        table = Table(
            np.array(one.delta_theta), np.array(one.d), np.array(one.a), np.array(one.alpha), np.zeros(6)
        )
        apart = _apart(robot, _robot(path, _short(table, sheet), sheet, path.stem))
        said.append(
            f"{path.name}: {listed([kinematics.where for kinematics in group], 5)} disagree: taught on"
            f" another arm (checksums {one.checksum}) whose flange is up to {1e3 * apart:.2f} mm elsewhere;"
            f" used are those of {chosen.where}"
        )
    return said
