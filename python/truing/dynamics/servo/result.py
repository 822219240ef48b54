# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis from commands gives, and the text of its ``result.json`` (``truing-dynamics/1``)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity.findings import RecordingFinding
from truing.dynamics.servo.chain import ServoChain
from truing.report.json_text import without_nan

Floats = NDArray[np.float64]
WHOLE = float("inf")  # among horizons: to the end of the recording; result.json says "whole"
MATTERS = 0.1  # of what usual parameters remove: less is no answer to where the error comes from
MODELS = ("nominal", "standard", "named")
REGIMES = ("reversals", "slow", "fast", "holding")


@dataclass(frozen=True)
class ServoParameter:
    """A value of the chain that was fitted: `name` is `field.joint`, or a field of the chain itself."""

    name: str
    value: float
    sigma: float  # standard error, as the noise goes on in time
    unit: str
    nominal: float  # of the file; the value at which an effect is not there
    standard: float  # as the usual parameters alone have it


@dataclass(frozen=True)
class ServoAlternative:
    """What could stand in an effect's place."""

    effect: str
    joints: tuple[str, ...]
    probability: float
    separated_by: str  # what to record


@dataclass(frozen=True)
class FoundServoEffect:
    """A cause, or one of the usual parameters (`standard`)."""

    effect: str
    joints: tuple[str, ...]
    standard: bool
    probability: float  # of it or one of its class
    parameters: tuple[ServoParameter, ...]
    share: float
    """Of the squared error that the usual parameters leave (of a usual one: that the file leaves), the part
    that it removes, on folds that were not fitted."""
    ci: tuple[float, float]  # 90 %
    before_rms: float  # [rad] of held-out motion, without it
    after_rms: float  # [rad] with it
    confounded_with: tuple[ServoAlternative, ...] = ()
    sentence: str = ""


def departing(effects: Sequence[FoundServoEffect]) -> list[FoundServoEffect]:
    """Usual parameters that are surely others than the file has, also beside all that is named, and matter:
    each removes a tenth or more of what all of them remove, and half of the squared error at its joint. The
    largest first."""
    removed = {
        k: max(0.0, e.before_rms**2 - e.after_rms**2)
        for k, e in enumerate(effects)
        if e.standard and e.probability > 0.0 and _persists(e.parameters[0])
    }
    least = MATTERS * sum(removed.values())
    told = [k for k, of in removed.items() if of > least and of > effects[k].after_rms ** 2]
    return [effects[k] for k in sorted(told, key=lambda k: -removed[k])]


def _persists(value: ServoParameter) -> bool:
    """It departs from the file beside what is named at least half as far as without."""
    return abs(value.value - value.nominal) >= 0.5 * abs(value.standard - value.nominal)


@dataclass(frozen=True)
class UnknownMotion:
    """A torque that no effect of the catalogue explains, as a function of an input."""

    joint: str
    inputs: tuple[str, ...]  # 'speed', 'load', 'angle', 'command_error', 'time'
    probability: float
    share: float
    ci: tuple[float, float]
    curve: tuple[tuple[float, float, float], ...]  # of input, torque [Nm], standard error [Nm]


@dataclass(frozen=True)
class ServoClass:
    """What the recordings cannot tell apart, and what would."""

    effects: tuple[str, ...]  # 'effect' or 'effect:J1'
    sentence: str
    separated_by: str


@dataclass(frozen=True)
class ServoRollout:
    """Simulated less measured motion on held-out recordings, open loop from measured states."""

    horizons: tuple[float, ...]  # [s]; WHOLE: whole recordings
    joints: tuple[str, ...]
    units: tuple[str, ...]
    windows: tuple[int, ...]  # at each horizon
    errors: Mapping[str, Floats]
    """By model, shape=(joints, horizons) [rad | m]: rms over all rows of windows as long as the horizon."""
    regimes: Mapping[str, Mapping[str, Floats]]
    """By model and regime, shape=(joints,) [rad | m]: rms at the main horizon; NaN: no such rows."""
    recordings: Mapping[str, Mapping[str, Floats]]
    """By model and held-out recording, shape=(joints,) [rad | m]: rms at the main horizon."""
    main_horizon: float  # [s] of regimes, recordings and sentences
    train: Mapping[str, Floats] = field(default_factory=dict)
    """By model, shape=(joints,): the same at the main horizon on the recordings that were fitted."""


@dataclass(frozen=True)
class ServoTrace:
    """Motion of one joint over one held-out recording, to be drawn. shape=(n,) each."""

    recording: str
    joint: str
    unit: str
    time: Floats  # [s]
    command: Floats  # [rad | m], of a command in Nm: [Nm]
    measured: Floats  # [rad | m]
    simulated: Mapping[str, Floats]  # by model; windows of the main horizon, NaN where one begins


@dataclass(frozen=True)
class ServoCovariance:
    """Of everything that was fitted, in the model that was named."""

    names: tuple[str, ...]  # field.joint
    units: tuple[str, ...]
    scales: tuple[str, ...]  # 'log': matrix and prior are those of the logarithm
    values: Floats  # shape=(n,), in their units
    matrix: Floats  # shape=(n, n), in the scales
    prior: Floats  # shape=(n,) standard deviations before the data, in the scales


@dataclass(frozen=True)
class ServoDiagnosis:
    """Which causes stand between a simulator's model and recorded motion, from commands alone."""

    robot: str
    verdict: str  # effects | none | unknown | effects+unknown | does_not_hold
    sentence: str
    effects: tuple[FoundServoEffect, ...]
    unknown: tuple[UnknownMotion, ...]
    classes: tuple[ServoClass, ...]
    record_next: tuple[str, ...]  # what would tell apart what these recordings do not
    chains: Mapping[str, ServoChain]  # nominal, standard, named
    covariance: ServoCovariance
    rollout: ServoRollout
    where: Mapping[str, Any]
    not_testable: tuple[tuple[str, tuple[str, ...], str], ...]  # effect, joints, why
    held_out: tuple[str, ...]
    warnings: tuple[str, ...]
    mjcf: str = field(repr=False)
    """The file's model without its actuators and geoms, as text: the chain drives it."""
    traces: tuple[ServoTrace, ...] = field(default=(), repr=False)
    seconds: float = 0.0

    def summary(self) -> str:
        """A few lines for people."""
        lines = [f"{self.robot}: {self.verdict}", self.sentence]
        for effect in self.effects:
            if not effect.standard:
                lines.append(f"{effect.sentence} ({effect.probability:.0%} sure, removes {effect.share:.0%})")
        lines += [f"unknown: {u.joint}, with {', '.join(u.inputs)}" for u in self.unknown]
        return "\n".join([*lines, *(one.sentence for one in self.classes)])


def servo_dict(
    found: ServoDiagnosis, *, sanity: Iterable[RecordingFinding] = (), warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics diagnose`` holds when there were commands alone. sanity:
    findings of `check_recordings`."""
    departed = departing(found.effects)
    out: dict[str, Any] = without_nan(
        {
            "format": "truing-dynamics/1",
            "command": "diagnose",
            "from": "commands",
            "version": _core.version(),
            "robot": found.robot,
            "verdict": found.verdict,
            "sentence": found.sentence,
            "effects": [{**_effect(e), "departs": any(e is one for one in departed)} for e in found.effects],
            "unknown": [
                {**asdict(u), "inputs": list(u.inputs), "ci": list(u.ci), "curve": [list(p) for p in u.curve]}
                for u in found.unknown
            ],
            "where": dict(found.where),
            "rollout": _rollout(found.rollout),
            "classes": [{**asdict(c), "effects": list(c.effects)} for c in found.classes],
            "record_next": list(found.record_next),
            "chains": {name: chain.to_dict() for name, chain in found.chains.items()},
            "covariance": {
                "names": list(found.covariance.names),
                "units": list(found.covariance.units),
                "scales": list(found.covariance.scales),
                "values": found.covariance.values.tolist(),
                "matrix": found.covariance.matrix.tolist(),
                "prior": found.covariance.prior.tolist(),
            },
            "sanity": [asdict(finding) for finding in sanity],
            "not_testable": [
                {"effect": effect, "joints": list(joints), "why": why}
                for effect, joints, why in found.not_testable
            ],
            "held_out": list(found.held_out),
            "warnings": [*warnings, *found.warnings],
        }
    )
    return out


def _effect(e: FoundServoEffect) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "joints": list(e.joints),
        "standard": e.standard,
        "probability": e.probability,
        "parameters": [asdict(p) for p in e.parameters],
        "share": e.share,
        "ci": list(e.ci),
        "held_out": {
            "before_rms_rad": e.before_rms,
            "after_rms_rad": e.after_rms,
            "shrink": 1.0 - e.after_rms / e.before_rms if e.before_rms > 0.0 else 0.0,
        },
        "confounded_with": [{**asdict(a), "joints": list(a.joints)} for a in e.confounded_with],
        "sentence": e.sentence,
    }


def _rollout(r: ServoRollout) -> dict[str, Any]:
    """`held_out`: by model and joint, rms [rad | m] at each horizon; "whole" is a whole recording."""

    def by_joint(values: Floats) -> dict[str, Any]:
        return dict(zip(r.joints, np.asarray(values).tolist(), strict=True))

    return {
        "horizon_s": ["whole" if h == WHOLE else h for h in r.horizons],
        "main_horizon_s": "whole" if r.main_horizon == WHOLE else r.main_horizon,
        "windows": list(r.windows),
        "units": dict(zip(r.joints, r.units, strict=True)),
        "held_out": {model: by_joint(errors) for model, errors in r.errors.items()},
        "train": {model: by_joint(errors) for model, errors in r.train.items()},
        "regimes": {m: {name: by_joint(v) for name, v in of.items()} for m, of in r.regimes.items()},
        "recordings": {m: {name: by_joint(v) for name, v in of.items()} for m, of in r.recordings.items()},
        "why_not": "",
    }


def of_effect(result: Mapping[str, Any], standard: bool) -> Sequence[Mapping[str, Any]]:
    """Of result.json: the usual parameters, or what was named beyond them."""
    return [effect for effect in result["effects"] if effect["standard"] == standard]
