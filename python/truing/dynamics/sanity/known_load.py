# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a load of known mass tells before anything is named: the constants of drives of which currents
alone were recorded, and where the load hangs.

A drive's current is i = (Y theta + m y(c)) / k: its constant k and all masses theta share one scale, which
the known mass m fixes. With k assumed, what is recorded is k i = (1 + d) (Y theta + m y(c)): the effect
`motor_constant` is linear in d and `payload_place` in c, but not both at once, so the fit is made anew with
k / (1 + d) until that settles (Gauss and Newton).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import PAYLOAD_COLUMNS, identify, with_payload
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.errors import InputError

Floats = NDArray[np.float64]

_USUAL = ("coulomb", "viscous", "current_offset", "load_friction", "armature")  # what gears have anyway
_ROUNDS = 8
_SETTLED = 1e-3  # of a constant
_TOLD = 0.1  # of a constant: standard error up to which it is taken
_PLACED = 0.02  # [m] standard error of a place up to which it is taken
_LEVEL, _SURE = 0.01, 5.0  # [rad], standard errors: a tilt beyond both is one
_MASS, *_PLACE = PAYLOAD_COLUMNS


@dataclass(frozen=True)
class KnownLoad:
    """Robot and recordings with what the load told, and that in words."""

    robot: _core.Robot
    recordings: list[_core.Recording]
    findings: list[RecordingFinding]
    unknown: list[int]  # joints whose drives' constants it did not tell


@dataclass(frozen=True)
class _Fit:
    constants: Floats  # shape=(joints,) [Nm/A | N/A]
    sigmas: Floats  # shape=(joints,) of these, relative
    place: Floats  # shape=(3,) [m] in the tool's frame
    place_sigmas: Floats  # shape=(3,) [m]
    is_tilted: bool  # the base, for sure


def known_load(
    robot: _core.Robot, recordings: Sequence[_core.Recording], unknown: Sequence[int], start: Floats
) -> KnownLoad:
    """Drives' constants and the load's place, where these recordings tell them.

    unknown: joints, counted among those with a reading, of which currents without a constant were recorded.
    start: [Nm/A | N/A] shape=(joints,) constants to begin with.
    """
    nothing = KnownLoad(robot, list(recordings), [], list(unknown))
    masses = _masses(recordings)
    no_place = not _placed(recordings)
    if len(masses) < 2 or not (unknown or no_place) or any(one.pieces is not None for one in recordings):
        return nothing
    fit = _fitted(robot, recordings, unknown, start, no_place)
    if fit is None:
        return nothing
    told = [k for k in unknown if fit.sigmas[k] < _TOLD]
    if unknown and not told:
        return nothing
    findings: list[RecordingFinding] = []
    if told:
        robot = _with_constants(robot, told, fit.constants)
        findings.append(_constants_found(driven_joints(robot), told, fit))
    out = list(recordings)
    loads = [mass for mass in masses if mass > 0.0]
    if no_place and len(loads) == 1 and (fit.place_sigmas < _PLACED).all():
        x, y, z = fit.place.tolist()
        out = with_payload(out, 0.0, (x, y, z))
        findings.append(
            _place_found(fit, loads[0], [one.name for one in recordings if _MASS not in one.columns])
        )
    return KnownLoad(robot, out, findings, [k for k in unknown if k not in told])


def _masses(recordings: Sequence[_core.Recording]) -> list[float]:
    """[kg] that hung at the tool, each once; a load that is not stated is none."""
    return sorted({float(m) for one in recordings for m in np.unique(one.columns.get(_MASS, 0.0))})


def _placed(recordings: Sequence[_core.Recording]) -> bool:
    return any(name in one.columns for one in recordings for name in _PLACE)


def _fitted(
    robot: _core.Robot,
    recordings: Sequence[_core.Recording],
    unknown: Sequence[int],
    start: Floats,
    no_place: bool,
) -> _Fit | None:
    """None: it does not settle, or cannot be fitted."""
    names = [joint.name for joint in driven_joints(robot)]
    asked = {effect: list[str]() for effect in _USUAL}
    if unknown:
        asked["motor_constant"] = [names[k] for k in unknown]
    if no_place:
        asked["payload_place"] = []
    if not np.any(robot.gravity):
        return _settled(robot, recordings, unknown, start, asked)
    tilted = _settled(robot, recordings, unknown, start, {**asked, "base_tilt": []})
    if tilted is None or tilted.is_tilted:  # else a base that is not level would be taken for a constant
        return tilted
    return _settled(robot, recordings, unknown, tilted.constants, asked)


def _settled(
    robot: _core.Robot,
    recordings: Sequence[_core.Recording],
    unknown: Sequence[int],
    start: Floats,
    asked: Mapping[str, Sequence[str]],
) -> _Fit | None:
    names = [joint.name for joint in driven_joints(robot)]
    effects = [_core.EffectRequest(effect, list(joints)) for effect, joints in asked.items()]
    constants = np.array(start, dtype=float)
    for _ in range(_ROUNDS):
        try:
            fit = identify(_with_constants(robot, unknown, constants), recordings, effects=effects)
        except InputError:
            return None
        off, sigmas = (np.zeros(len(names)) for _ in range(2))
        for k in unknown:
            off[k], sigmas[k] = _value(fit, f"motor_constant.{names[k]}")
        if (off <= -1.0).any():
            return None
        constants /= 1.0 + off
        if (np.abs(off) < np.maximum(_SETTLED, sigmas / 10.0)).all():
            place = np.array([_value(fit, f"payload_place.{axis}") for axis in "xyz"])
            tilts = [_value(fit, f"base_tilt.{axis}") for axis in "xyz"]
            is_tilted = any(abs(tilt) > max(_LEVEL, _SURE * sigma) for tilt, sigma in tilts)
            return _Fit(constants, sigmas / (1.0 + off), place[:, 0], place[:, 1], is_tilted)
    return None


def _value(fit: _core.TorqueFit, name: str) -> tuple[float, float]:
    """A parameter and its standard error, infinite for what the recordings do not show."""
    for parameter in fit.parameters:
        if parameter.name == name and not parameter.frozen:
            return parameter.value, parameter.sigma
    return 0.0, np.inf


def _with_constants(robot: _core.Robot, joints: Sequence[int], constants: Floats) -> _core.Robot:
    robot = robot.copy()
    driven = robot.driven_joints()
    for k in joints:
        robot.joints[driven[k]].torque_per_ampere = float(constants[k])
    return robot


def _constants_found(joints: Sequence[_core.Joint], told: Sequence[int], fit: _Fit) -> RecordingFinding:
    sigmas = fit.constants * fit.sigmas
    said = [f"{joints[k].name} {fit.constants[k]:.3g} +- {sigmas[k]:.2g}" for k in told]
    unit = "Nm/A" if all(joints[k].type == "revolute" for k in told) else "Nm/A (N/A)"
    words = f"drive constants found by the known load, and used: {listed(said, 8)} {unit}"
    names = tuple(joints[k].name for k in told)
    middle = float(np.median(fit.constants[list(told)]))
    return RecordingFinding("gain_from_load", (), names, words, middle, "Nm/A", applied=True)


def _place_found(fit: _Fit, mass: float, unstated: Sequence[str]) -> RecordingFinding:
    said = ", ".join(f"{v:.3f}" for v in fit.place)
    words = (
        f"where the load of {mass:g} kg hangs is not stated: found {said} m"
        f" (+- {fit.place_sigmas.max():.2g} m) from the tool's frame, and used (for predict: --payload"
        f" {mass:g}kg@{','.join(f'{1e3 * v:.0f}' for v in fit.place)}mm)"
    )
    if unstated:
        words += f"; no {_MASS} in {listed(unstated)}: taken to be without a payload"
    return RecordingFinding("load_place", (), (), words, float(np.linalg.norm(fit.place)), "m", applied=True)
