# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis from commands in words and numbers: effects with their sizes, classes, what to record next."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.candidates import Candidate
from truing.dynamics.servo.chain import PARAMETERS, ServoChain
from truing.dynamics.servo.data import ServoData
from truing.dynamics.servo.departures import Departure, Instead
from truing.dynamics.servo.fit import Fitted, sums
from truing.dynamics.servo.free import USUAL, Free
from truing.dynamics.servo.naming import Account, Namer, Sureness
from truing.dynamics.servo.result import (
    FoundServoEffect,
    ServoAlternative,
    ServoClass,
    ServoCovariance,
    ServoDiagnosis,
    ServoParameter,
    ServoRollout,
    ServoTrace,
    UnknownMotion,
    departing,
)
from truing.dynamics.servo.simulator import FIELDS, Point, Simulator, chain_of
from truing.dynamics.servo.unknown import FoundFunction

Floats = NDArray[np.float64]

_PLAIN = {
    "command_gain": "a gain of the position controller",
    "integral_gain": "an integral part of the controller",
    "damping_gain": "a derivative part of the controller",
    "gain_law": "torque that does not grow in proportion with the firmware's gain",
    "delay": "a delay from command to torque",
    "rate_limit": "a limit of the command's speed",
    "saturation": "a limit of the torque",
    "drive_law": "a drive whose torque does not grow in proportion with the effort",
    "supply_sag": "a supply that sags",
    "dead_band": "a dead band of the controller",
    "coulomb": "dry friction",
    "viscous": "viscous friction",
    "viscous_law": "friction that does not grow in proportion with speed",
    "back_emf": "a motor that does not brake while it is switched off",
    "stribeck": "dry friction that falls with speed",
    "load_friction": "friction that grows with the load",
    "asymmetric_friction": "friction that differs by direction",
    "presliding": "elastic friction before sliding",
    "thermal_friction": "friction that changes with temperature",
    "warmup": "friction that changes with time",
    "spring": "a spring",
    "current_offset": "a torque that is always there",
    "gravity_scale": "weight other than the model's",
    "armature": "a rotor's inertia",
    "backlash": "backlash",
    "joint_elasticity": "an elastic gear",
    "payload": "a payload",
    "link_inertia": "a link's mass",
    "joint_offset": "a zero of the readings",
}
_SEPARATED = {
    "gravity_scale": "record the same motion with a known weight at the tool",
    "payload": "record the same motion with a known weight at the tool",
    "link_inertia": "record the same motion with a known weight at the tool",
    "load_friction": "record the same motion with a known weight at the tool",
    "command_gain": "record the same motion with another gain of the firmware",
    "drive_law": "record the same motion with another gain of the firmware",
    "gain_law": "record two gains of the firmware at the same temperature",
    "saturation": "record faster and larger steps, which reach the limit",
    "rate_limit": "record larger steps, which reach the limit",
    "supply_sag": "record the voltage, with several joints working hard at once",
    "delay": "record a chirp up to higher frequencies, at a higher rate",
    "damping_gain": "record a chirp up to higher frequencies",
    "viscous": "record slow and fast strokes of the same length",
    "viscous_law": "record strokes at several speeds",
    "back_emf": "let the joint swing with the servo switched off (enabled), from several heights",
    "stribeck": "record slow reversals",
    "presliding": "record slow reversals of small strokes",
    "dead_band": "record slow reversals of small strokes",
    "backlash": "record slow reversals of small strokes under both signs of the load",
    "joint_elasticity": "record a chirp up to higher frequencies, with a weight at the tool",
    "thermal_friction": "record the same motion cold and warm",
    "warmup": "record the same motion for longer, from cold",
    "spring": "record holding at both ends of the range",
    "current_offset": "record the same motion with the arm turned over",
}
_USUAL_SEPARATED = "record steps, slow reversals and a chirp of each joint alone"
_TOGETHER = 0.9  # rank correlation (Spearman 1904) over recordings: inputs that rose in one order
_BETTER = 0.05  # of the file's squared error: where the usual parameters win less, none departs
_TOLD = 3  # causes in a sentence


@dataclass(frozen=True)
class Parts:
    """What a diagnosis is made of."""

    simulator: Simulator
    data: ServoData
    single: bool
    namer: Namer
    nominal: Point
    standard: Fitted
    account: Account
    sure: Sequence[Sureness]
    functions: Sequence[FoundFunction]
    rollout: ServoRollout
    traces: Sequence[ServoTrace]
    held: Sequence[Floats]
    """Errors on held-out windows: of nominal, standard, named, of the named without each effect, and of the
    standard chain with each usual parameter as the file has it (`USUAL`). shape=(rows, joints)"""
    held_rows: NDArray[np.intp]  # number of each row's block of time
    notes: Sequence[str]
    late: Sequence[int]  # joints at which damping and a delay do the same
    departures: Sequence[Departure]  # of the usual parameters from the file
    instead: Mapping[int, Sequence[Instead]]  # by joint: what alone does the same as these


def diagnosis_of(parts: Parts, seconds: float) -> ServoDiagnosis:
    covariance = covariance_of(parts)
    chains = {
        "nominal": parts.simulator.arm.nominal,
        "standard": chain_of(parts.standard.point, parts.simulator.arm.nominal),
        "named": chain_of(parts.account.fitted.point, parts.simulator.arm.nominal),
    }
    named = _named(parts, covariance)
    usual = _usual(parts, covariance)
    effects = [*named, *usual]
    unknown = [_unknown(f, chains["nominal"]) for f in parts.functions]
    classes = [*_classes(parts, named), *_instead(parts)]
    verdict, sentence = _verdict(parts, named, unknown, departing(usual))
    warnings = [*parts.notes, *_beyond_limit(parts)]
    for why in dict.fromkeys(why for _, why in parts.account.vetoed):
        places = ", ".join(_place(one) for one, other in parts.account.vetoed if other == why)
        warnings.append(f"not named, as {why}: {places}")
    if parts.single:
        warnings.append("one recording only: folds are blocks of its time, and no name is surer than 0.9")
    held = tuple(dict.fromkeys(s.name for s in parts.data.streams if s.test))
    return ServoDiagnosis(
        parts.simulator.arm.name,
        verdict,
        sentence,
        tuple(effects),
        tuple(unknown),
        tuple(classes),
        tuple(dict.fromkeys(c.separated_by for c in classes if c.separated_by)),
        chains,
        covariance,
        parts.rollout,
        _where(parts),
        tuple(parts.account.not_testable),
        held or ("blocks of time",),
        tuple(warnings),
        parts.simulator.arm.mjcf,
        tuple(parts.traces),
        seconds,
    )


# ---- values ---------------------------------------------------------------------------------------
def covariance_of(parts: Parts) -> ServoCovariance:
    """(X'X + P)^-1 with rows that count for as many as their noise goes on for."""
    fitted = parts.account.fitted
    noise = parts.namer.noise_after(fitted)
    xx, _ = sums(fitted.columns, fitted.errors, noise)
    prior = np.array([f.prior for f in fitted.free])
    matrix = np.linalg.inv(xx + np.diag(prior**-2.0))
    joints = parts.simulator.arm.nominal.joints
    return ServoCovariance(
        tuple(f.name(joints) for f in fitted.free),
        tuple(f.unit for f in fitted.free),
        tuple(f.scale for f in fitted.free),
        np.array([f.value(fitted.point) for f in fitted.free]),
        0.5 * (matrix + matrix.T),
        prior,
    )


def _parameter(parts: Parts, covariance: ServoCovariance, free: Free, off: Point) -> ServoParameter:
    joints = parts.simulator.arm.nominal.joints
    name = free.name(joints)
    at = covariance.names.index(name)
    sigma = math.sqrt(max(float(covariance.matrix[at, at]), 0.0))
    value = float(covariance.values[at])
    return ServoParameter(
        name,
        value,
        sigma * value if free.scale == "log" else sigma,
        free.unit,
        free.value(off),
        free.value(parts.standard.point),
    )


# ---- effects --------------------------------------------------------------------------------------
def held_share(
    without: Floats, with_it: Floats, whole: Floats, window: NDArray[np.intp]
) -> tuple[float, float, float]:
    """Part of the squares of `whole` (or `without`, where this is more; each joint in units of its own) that
    goes, and its 90 % interval over blocks of time.

    without, with_it, whole: shape=(n, joints), errors of held-out rows. window: shape=(n,), each row's block.
    """
    scale = np.maximum(np.sqrt(np.mean(whole**2, axis=0)), 1e-9)
    gains = np.sum(((without / scale) ** 2 - (with_it / scale) ** 2), axis=1)
    total = max(float(np.sum((whole / scale) ** 2)), float(np.sum((without / scale) ** 2)))
    by_window = np.bincount(window, weights=gains)
    value = float(gains.sum()) / total
    spread = (
        float(by_window.std(ddof=1)) * math.sqrt(by_window.size) / total if by_window.size > 1 else abs(value)
    )
    return value, value - 1.645 * spread, value + 1.645 * spread


def _rms(errors: Floats, joint: int) -> float:
    some = errors if joint < 0 else errors[:, joint]
    return float(np.sqrt(np.mean(some**2)))


def _named(parts: Parts, covariance: ServoCovariance) -> list[FoundServoEffect]:
    out = []
    standard, named = parts.held[1], parts.held[2]
    for k, (one, sure) in enumerate(zip(parts.account.found, parts.sure, strict=True)):
        without = parts.held[3 + k]
        share, low, high = held_share(without, named, standard, parts.held_rows)
        values = tuple(
            _parameter(parts, covariance, f, one.off(parts.account.fitted.point)) for f in one.free
        )
        out.append(
            FoundServoEffect(
                one.effect,
                one.joints,
                False,
                sure.of_class,
                values,
                share,
                (low, high),
                _rms(without, one.joint),
                _rms(named, one.joint),
                tuple(_alternative(o, p) for o, p in sure.confounded),
                _sentence(one.effect, one.joints, values),
            )
        )
    return sorted(out, key=lambda e: -e.share)


def _alternative(other: Candidate, probability: float) -> ServoAlternative:
    return ServoAlternative(
        other.effect, other.joints, probability, _SEPARATED.get(other.effect, _USUAL_SEPARATED)
    )


def _place(one: Candidate) -> str:
    return one.effect + (f" at {', '.join(one.joints)}" if one.joints else "")


def _plain(effect: str) -> str:
    return _PLAIN.get(effect, effect.replace("_", " "))


def _sentence(effect: str, joints: Sequence[str], values: Sequence[ServoParameter]) -> str:
    if _of_bus(effect, values):
        mean, sigma = _common(values)
        return (
            f"Commands arrive late at {_everywhere(joints)}, or angles are stamped late, which move alike:"
            f" {1e3 * mean:.3g} ± {1e3 * sigma:.2g} ms"
        )
    plain = _plain(effect)
    text = plain[:1].upper() + plain[1:] + (f" at {', '.join(joints)}" if joints else "")
    sizes = ", ".join(f"{v.value:.3g} ± {v.sigma:.2g}{'' if v.unit == '1' else ' ' + v.unit}" for v in values)
    return f"{text}: {sizes}" if sizes else text


def _of_bus(effect: str, values: Sequence[ServoParameter]) -> bool:
    """Whether it is the delay that several joints have alike."""
    return effect == "delay" and len(values) > 1


def _common(values: Sequence[ServoParameter]) -> tuple[float, float]:
    """What values say together, each by its standard error, and how far it is known."""
    precision = np.array([max(v.sigma, 1e-9) ** -2.0 for v in values])
    return float(np.average([v.value for v in values], weights=precision)), float(precision.sum() ** -0.5)


def _everywhere(joints: Sequence[str]) -> str:
    return ", ".join(joints) if joints else "all joints"


def _usual(parts: Parts, covariance: ServoCovariance) -> list[FoundServoEffect]:
    """The usual parameters of every joint, by what each removes against the file; last those that do not
    depart from it."""
    joints = parts.simulator.arm.nominal.joints
    out = []
    first = 3 + len(parts.account.found)
    nominal, standard = parts.held[0], parts.held[1]
    better = _better(parts)
    of_joint = {(d.free.field, d.free.joint): d for d in parts.departures}
    for k, name in enumerate(n for n in USUAL if any(f.field == n for f in parts.standard.free)):
        back = parts.held[first + k]
        for j, joint in enumerate(joints):
            departure = of_joint[name, j]
            value = _parameter(parts, covariance, departure.free, parts.nominal)
            departs = departure.certain and bool(better[j])
            scale = max(float(np.sum(np.maximum(nominal[:, j] ** 2, back[:, j] ** 2))), 1e-18)
            share = float(np.sum(back[:, j] ** 2 - standard[:, j] ** 2)) / scale / len(joints)
            out.append(
                FoundServoEffect(
                    PARAMETERS[name].effect,
                    (joint,),
                    True,
                    departure.probability if departs else 0.0,
                    (value,),
                    max(0.0, share) if departs else 0.0,
                    (max(0.0, share), max(0.0, share)),
                    _rms(back, j),
                    _rms(standard, j),
                    tuple(_alternative(i.other, i.probability) for i in parts.instead.get(j, ()) if departs),
                    _sentence(PARAMETERS[name].effect, (joint,), (value,)),
                )
            )
    return sorted(out, key=lambda e: -e.share)


def _better(parts: Parts) -> NDArray[np.bool_]:
    """By joint: whether the usual parameters move it better than the file's, which they need not where they
    depart one after the other: all may go together."""
    nominal, standard = (np.sum(parts.held[k] ** 2, axis=0) for k in range(2))
    return np.asarray(standard < (1.0 - _BETTER) * nominal)


def _unknown(f: FoundFunction, chain: ServoChain) -> UnknownMotion:
    places = f.low + f.width * np.arange(f.values.size)
    words = {"directed_load": ("load", "direction"), "directed_angle": ("angle", "direction")}
    return UnknownMotion(
        chain.joints[f.joint],
        words.get(f.input, (f.input,)),
        f.probability,
        f.share,
        (f.share, f.share),
        tuple((float(x), float(v), float(s)) for x, v, s in zip(places, f.values, f.sigmas, strict=True)),
    )


def _beyond_limit(parts: Parts) -> list[str]:
    """Joints whose damping is not within the largest torque, as it is in the file."""
    column = FIELDS.index("limited_damping")
    file, found = (point.chain[:, column] for point in (parts.nominal, parts.standard.point))
    joints = parts.simulator.arm.nominal.joints
    moved = [joint for joint, changed in zip(joints, file != found, strict=True) if changed]
    if not moved:
        return []
    return [
        f"damping at {', '.join(moved)} goes on where the servo gives its largest torque: joints move better"
        " so than with the file's, which is the controller's (kv) and ends there (forcerange)"
    ]


# ---- classes --------------------------------------------------------------------------------------
def _classes(parts: Parts, named: Sequence[FoundServoEffect]) -> list[ServoClass]:
    out = [_scale_class(named), *_orders(parts.data)]
    late = _late_alike(parts)
    for joint in (parts.simulator.arm.nominal.joints[j] for j in parts.late if j not in late):
        alike = tuple(_member(effect, (joint,)) for effect in ("delay", "viscous", "damping_gain"))
        text = f"In motion as slow as this a delay, damping and a derivative part at {joint} do the same"
        out.append(ServoClass(alike, text, _SEPARATED["delay"]))
    for effect in named:
        if not effect.confounded_with:
            continue
        members = [_member(effect.effect, effect.joints)]
        members += [_member(a.effect, a.joints) for a in effect.confounded_with]
        out.append(
            ServoClass(
                tuple(members),
                f"These recordings cannot tell apart: {', '.join(members)}",
                _SEPARATED.get(effect.effect, _USUAL_SEPARATED),
            )
        )
    return out


def _late_alike(parts: Parts) -> set[int]:
    """Joints whose delay is named as that of all."""
    return {f.joint for one in parts.account.found if one.joint < 0 for f in one.free if f.field == "delay"}


def _instead(parts: Parts) -> list[ServoClass]:
    """By joint: what departs from the file there, and what alone does the same beside the file's values."""
    joints, late = parts.simulator.arm.nominal.joints, _late_alike(parts)
    better = _better(parts)
    out = []
    for j, every in parts.instead.items():
        if not better[j]:
            continue
        others = [i for i in every if not (i.other.effect == "delay" and j in late)]
        if not others:
            continue
        departed = [d.free.field for d in parts.departures if d.certain and d.free.joint == j]
        others.sort(key=lambda i: -i.probability)
        places = list(dict.fromkeys(_place(i.other) for i in others))
        more = f" and {len(places) - _TOLD} more" if len(places) > _TOLD else ""
        alone = ", ".join(places[:_TOLD]) + more
        out.append(
            ServoClass(
                tuple(
                    [_member(PARAMETERS[name].effect, (joints[j],)) for name in departed]
                    + [_member(i.other.effect, i.other.joints) for i in others]
                ),
                f"What departs from the file at {joints[j]} ({', '.join(departed)}) may as well be one cause:"
                f" {alone}",
                _SEPARATED.get(others[0].other.effect, _USUAL_SEPARATED),
            )
        )
    return out


def _member(effect: str, joints: Sequence[str]) -> str:
    return f"{effect}:{'+'.join(joints)}" if joints else effect


def _scale_class(named: Sequence[FoundServoEffect]) -> ServoClass:
    """Inherent: from commands and motion alone every torque is known but for one factor."""
    masses = [e.effect for e in named if e.effect in ("gravity_scale", "payload", "link_inertia")]
    return ServoClass(
        ("command_gain", "coulomb", "viscous", "armature", *(masses or ("gravity_scale", "payload"))),
        "Every torque shares one scale: twice all masses and inertias, with twice the gain and twice all"
        " frictions, move alike. What is said here holds if the file's masses do",
        "record the same motion with a known weight at the tool",
    )


def _orders(data: ServoData) -> list[ServoClass]:
    """Temperature, gain, supply that rose together from recording to recording."""
    means = {
        name: np.array([float(np.mean(getattr(s, name))) for s in data.streams if not s.test])
        for name in ("gain", "warmth", "supply")
        if name in data.varies
    }
    words = {
        "gain": ("the firmware's gain", "gain_law"),
        "warmth": ("temperature", "thermal_friction"),
        "supply": ("the supply", "supply_sag"),
    }
    out = []
    names = list(means)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            a, b = _ranks(means[one]), _ranks(means[other])
            if a.size < 3 or not a.std() or not b.std() or abs(np.corrcoef(a, b)[0, 1]) < _TOGETHER:
                continue
            out.append(
                ServoClass(
                    (words[one][1], words[other][1]),
                    f"{words[one][0].capitalize()} and {words[other][0]} changed together from recording to"
                    " recording: what goes with one goes with the other",
                    f"record the same motion at the same {words[other][0].removeprefix('the ')}, in another"
                    " order",
                )
            )
    return out


def _ranks(values: Floats) -> Floats:
    """Places in their order; the mean of the places where values are the same."""
    _, inverse, counts = np.unique(np.round(values, 9), return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return np.asarray((last - 0.5 * (counts - 1))[inverse])


# ---- verdict --------------------------------------------------------------------------------------
def _mean_degrees(errors: Floats) -> float:
    return float(np.degrees(np.mean(np.sqrt(np.mean(errors**2, axis=0)))))


def _verdict(
    parts: Parts,
    named: Sequence[FoundServoEffect],
    unknown: Sequence[UnknownMotion],
    departed: Sequence[FoundServoEffect],
) -> tuple[str, str]:
    nominal, standard, found = (_mean_degrees(parts.held[k]) for k in range(3))
    slides = any(parts.simulator.arm.nominal.prismatic)

    def size(value: float) -> str:
        return f"{math.radians(value):.3g} (rad and m)" if slides else f"{value:.2f}°"

    if named and found > standard:
        return "does_not_hold", "What was found does not hold on motion that it was not fitted to."
    usual = (
        f"Held-out motion is off by {size(nominal)} with the file's model, {size(standard)} with the usual"
    )
    if named:
        verdict = "effects+unknown" if unknown else "effects"
        return verdict, f"{usual} parameters fitted, {size(found)} with {_causes(named)}."
    if unknown:
        return (
            "unknown",
            f"{usual} parameters fitted: what is left goes with inputs that no known effect explains.",
        )
    if departed:
        off = f"Held-out motion is off by {size(nominal)} with the file, {size(standard)} with fitted values"
        return "none", f"{off}: above all {_departed(departed)}."
    return "none", f"{usual} parameters fitted: beyond these no effect predicts motion it was not fitted to."


def _departed(usual: Sequence[FoundServoEffect]) -> str:
    """The largest that differ from the file, "the gain at J2 (2045, not 2555 Nm/rad)"."""
    told = []
    for one in usual[:_TOLD]:
        name = re.sub("^an? ", "the ", _plain(one.effect))
        value = one.parameters[0]
        sizes = f"{value.value:.4g}, not {value.nominal:.4g}{'' if value.unit == '1' else ' ' + value.unit}"
        told.append(f"{name} at {', '.join(one.joints)} ({sizes})")
    if len(usual) > _TOLD:
        told.append(f"{len(usual) - _TOLD} smaller")
    return " and ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)


def _causes(named: Sequence[FoundServoEffect]) -> str:
    """The largest in plain words, one effect at several joints once, and how many smaller ones there are."""
    joints: dict[str, list[str]] = {}
    for one in named:
        if _of_bus(one.effect, one.parameters):
            late = f"{1e3 * _common(one.parameters)[0]:.3g} ms late at {_everywhere(one.joints)}"
            joints[f"commands that arrive {late}"] = []
        else:
            joints.setdefault(_plain(one.effect), []).extend(one.joints)
    some = list(joints)[:_TOLD]
    told = [plain + (f" ({', '.join(joints[plain])})" if joints[plain] else "") for plain in some]
    smaller = sum(max(1, len(places)) for plain, places in joints.items() if plain not in some)
    if smaller:
        told.append(f"{smaller} smaller")
    return " and ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)


def _where(parts: Parts) -> dict[str, object]:
    """Where the gap lies that the usual parameters leave: by joint, and by what the joint was doing."""
    standard = parts.held[1]
    squares = np.mean(standard**2, axis=0)
    joints = parts.simulator.arm.nominal.joints
    total = max(float(squares.sum()), 1e-30)
    return {
        "joints": [{"joint": j, "share": float(s) / total} for j, s in zip(joints, squares, strict=True)],
        "inputs": [],
    }
