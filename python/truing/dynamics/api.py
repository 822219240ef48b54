# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics: which effects stand between a robot's model and the torques that it was recorded with."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from truing import _core
from truing._core import Recording, Robot, TorqueDiagnosis, TorqueFit, TorquePlan, TorquePrediction
from truing.dynamics.own_effects import TorqueEffect, own_torque_effects
from truing.effects import Effect, EffectLike, parse_effects
from truing.errors import InputError
from truing.keywords import made, takes
from truing.report.notebook import shown

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from truing._keywords import TorqueDiagnoseKeywords, TorqueKeywords, TorquePlanKeywords


TorqueEffects: TypeAlias = EffectLike | TorqueEffect | Iterable[EffectLike | TorqueEffect]

PAYLOAD_COLUMNS = ("payload_kg", "payload_x_m", "payload_y_m", "payload_z_m")
PAYLOAD_FOUND = "payload_found"
"""A column above zero where the mass was found from the torques, and nobody weighed it."""


@takes(_core.TorqueOptions)
def identify(robot: Robot, recordings: Sequence[Recording], **options: Unpack[TorqueKeywords]) -> TorqueFit:
    """Find inertial parameters and the effects asked for from recordings with torques or currents.

        truing.dynamics.identify(robot, recordings, effects="coulomb,viscous,load_friction:J2+J3")

    robot: with masses, centres of mass and inertias of its links. recordings: see `load_recordings`; those
    marked as test are held out.
    options: fields of `TorqueOptions`. `effects` may be one text, as above, and hold own effects
    (`TorqueEffect`); without it armature, Coulomb and viscous friction and an offset are fitted at every
    joint.

    Raises InputError on recordings or options that cannot be used.
    """
    effects: TorqueEffects = options.get("effects", ())
    items = [effects] if isinstance(effects, str | _core.EffectRequest | Effect | TorqueEffect) else effects
    asked: list[_core.EffectRequest] = []
    own: list[TorqueEffect] = []
    for item in items:
        if isinstance(item, TorqueEffect):
            own.append(item)
            asked.append(item.request(robot))
        else:
            asked += requests(item)
    fit = made(_core.TorqueOptions, {**options, "effects": asked})
    return _core.dynamics_identify(robot, list(recordings), fit, own)


def requests(effects: EffectLike | Iterable[EffectLike]) -> list[_core.EffectRequest]:
    """Effects asked for, also as one text: "coulomb,load_friction:J2+J3". Raises InputError."""
    if isinstance(effects, str):
        return parse_effects(effects) if effects.strip() else []
    asked: list[_core.EffectRequest] = []
    for item in [effects] if isinstance(effects, Effect | _core.EffectRequest) else effects:
        if isinstance(item, Effect):
            raise InputError(
                f"effect '{item.name}' is one on positions: those on torques are asked for by name"
            )
        asked += parse_effects(item) if isinstance(item, str) else [item]
    return asked


@takes(_core.TorqueDiagnoseOptions)
def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    *,
    effects: TorqueEffect | Iterable[TorqueEffect] = (),
    **options: Unpack[TorqueDiagnoseKeywords],
) -> TorqueDiagnosis:
    """Find which effects stand between a robot's model and the torques that it was recorded with.

        found = truing.dynamics.diagnose(robot, recordings)
        print(found.summary())

    Inertial parameters, Coulomb and viscous friction and an offset are the groundwork, unless the robot was
    fitted before: then everything is a departure from it. Every effect at every joint competes. What is
    named predicts recordings that it was not fitted to.

    robot: with masses, centres of mass and inertias of its links. recordings: see `load_recordings`; those
    marked as test are held out.
    effects: definitions of own effects that take part beside the catalogue's.
    options: fields of `TorqueDiagnoseOptions`. `leave_out` may be one text, "coupling,ripple".

    Raises InputError on recordings or options that cannot be used.
    """
    chosen = made(_core.TorqueDiagnoseOptions, options)
    found = _core.dynamics_diagnose(robot, list(recordings), chosen, own_torque_effects(effects, robot))
    return shown(found, "truing.dynamics.result:diagnosis_page", len(recordings))


def effect_names() -> list[str]:
    """Of the catalogue of effects on torques."""
    return [effect["name"] for effect in _core.torque_effects()]


@takes(_core.TorquePlanOptions)
def plan(
    robot: Robot,
    recordings: Sequence[Recording] = (),
    *,
    effects: TorqueEffect | Iterable[TorqueEffect] = (),
    **options: Unpack[TorquePlanKeywords],
) -> TorquePlan:
    """A motion that tells effects on torques apart, within the joints' limits, and what it could show.

        planned = truing.dynamics.plan(robot, columns="current,payload", separate="stribeck,presliding:J2")
        print(planned.summary())

    Fourier trajectories, then slow reversals: of random ones the best is refined. Needs no data.

    robot: with masses, centres of mass and inertias of its links. recordings: looked at as well, for what
    they can show; with torques or without.
    effects: definitions of own effects that count beside the catalogue's; `separate` may name them.
    options: fields of `TorquePlanOptions`. `columns` and `separate` may be one text.

    Raises InputError: options, names or recordings that cannot be used, a joint without room to move.
    """
    chosen = made(_core.TorquePlanOptions, {**options, "separate": requests(options.get("separate", ()))})
    return _core.dynamics_plan(robot, chosen, list(recordings), own_torque_effects(effects, robot))


def with_payload(
    recordings: Sequence[Recording], mass: float, place: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> list[Recording]:
    """The recordings with a payload that is known, in those that do not state one (column payload_kg); in
    those that state its mass and not where it is, with the place.

    mass: [kg], a point. place: [m] of its centre in the tool's frame.

    Raises InputError: a negative mass, numbers that are not finite.
    """
    if not (np.isfinite([mass, *place]).all() and mass >= 0.0):
        raise InputError(f"payload: found {mass:g} kg at {place}, expected a mass of zero or more at a place")
    of_mass, *of_place = PAYLOAD_COLUMNS
    out = []
    for recording in recordings:
        new = {} if of_mass in recording.columns else {of_mass: mass}
        if not any(name in recording.columns for name in of_place) and (new or any(place)):
            new |= dict(zip(of_place, place, strict=True))
        added = {name: np.full(len(recording), value) for name, value in new.items()}
        out.append(recording.replace(columns={**recording.columns, **added}) if added else recording)
    return out


def markdown_table() -> str:
    """The table of docs/reference/torque_effects.md: what every effect of the catalogue is."""
    lines = ["| effect | adds to the torque | parameters | needs |", "| --- | --- | --- | --- |"]
    for effect in _core.torque_effects():
        words = (
            f"`{effect['name']}`: {effect['summary']}",
            effect["law"],
            effect["parameters"],
            effect["needs"],
        )
        lines.append("| " + " | ".join(words) + " |")
    return "\n".join(lines)


def predict(
    robot: Robot,
    recording: Recording,
    *,
    cutoff: float | None = None,
    effects: TorqueEffect | Iterable[TorqueEffect] = (),
) -> TorquePrediction:
    """Torques of every row of a recording: links, rotors, and the effects that the robot carries.

    cutoff: [Hz] of the low-pass without phase that the angles go through for their derivatives; None: the
    highest frequency that the robot's effects were fitted on, or as in TorqueOptions.
    effects: definitions of the own effects that the robot carries.

    Raises InputError on a recording that cannot be used.
    """
    own = own_torque_effects(effects, robot)
    return _core.dynamics_predict(robot, recording, cutoff, own)
