# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis left uncertain, for domain randomisation.

What the data settled stays as it was found, what it did not is drawn with its correlations.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.export.parts import IN_BODIES, ONLY_MEASURED
from truing.dynamics.result import diagnosis_dict, fit_dict
from truing.dynamics.servo.chain import PARAMETERS
from truing.dynamics.servo.result import ServoDiagnosis, servo_dict
from truing.errors import InputError

Floats = NDArray[np.float64]

KNOWN = 0.05
"""A standard error below this part of the value, or of what such a value is usually large, is taken for none:
`truing dynamics compare` takes errors that differ by less than it for the same."""
MASSES = "masses"
"""All masses and inertias over the model's: what commands and motion alone cannot show."""
MASSES_KNOWN = 0.1
"""Standard error of it that is assumed: a user who has weighed the links states his own."""
RANGE = (0.05, 0.95)  # of the ranges that are written
_TRIES = 200  # draws of each sample before bounds are said to leave no room


@dataclass(frozen=True)
class Uncertain:
    """A parameter that is drawn. Names: `field.joint` of a servo's chain, `effect.joint…` of torques."""

    name: str
    unit: str
    scale: Literal["log", "linear"]
    value: float  # as it was found
    sigma: float  # standard deviation of the draws; of scale log that of the logarithm
    own_sigma: float  # the standard error of the fit, in the same scale; 0 where it is taken for none
    bounds: tuple[float, float] = (-math.inf, math.inf)

    @property
    def range(self) -> tuple[float, float]:
        """90 % of the draws, as far as bounds let them."""
        z = 1.6448536269514722  # the normal distribution's quantile at 0.95
        ends = (self.place(-z), self.place(z))
        return max(ends[0], self.bounds[0]), min(ends[1], self.bounds[1])

    def place(self, away: float) -> float:
        """The value so many standard deviations away."""
        moved = away * self.sigma
        return self.value * math.exp(moved) if self.scale == "log" else self.value + moved


@dataclass(frozen=True)
class Known:
    """A parameter that stays as it was found."""

    name: str
    unit: str
    value: float
    sigma: float  # in `unit`
    why: str


@dataclass(frozen=True)
class Randomisation:
    """What to draw for each simulated robot, and what not."""

    robot: str
    uncertain: tuple[Uncertain, ...]
    correlation: Floats  # shape=(n, n) of the uncertain ones, in their scales
    known: tuple[Known, ...]
    classes: tuple[str, ...]  # what the recordings cannot tell apart, in words
    notes: tuple[str, ...] = ()
    by_controller: Mapping[str, float] = field(default_factory=dict)
    """By joint, where it is any: the part of `viscous` that is the controller's damping."""

    @property
    def names(self) -> list[str]:
        return [one.name for one in self.uncertain]

    def covariance(self) -> Floats:
        """shape=(n, n), in the parameters' scales"""
        sigma = np.array([one.sigma for one in self.uncertain])
        return np.asarray(self.correlation * np.outer(sigma, sigma))

    def sample(self, n: int, seed: int = 0) -> dict[str, Floats]:
        """Draws of n robots, by parameter, shape=(n,) each in the parameter's unit.

        Normal in the parameters' scales; a draw beyond the bounds of a parameter is drawn again as a whole,
        so that correlations stay. Raises InputError: n below 1, bounds that hardly any draw keeps.
        """
        if n < 1:
            raise InputError(f"{n} samples: expected one or more")
        if not self.uncertain:
            return {}
        values, vectors = np.linalg.eigh(self.covariance())
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        random = np.random.default_rng(seed)
        kept: list[Floats] = []
        for _ in range(_TRIES):
            drawn = self._placed(random.standard_normal((n, root.shape[1])) @ root.T)
            kept.append(drawn[self._within(drawn)])
            if sum(map(len, kept)) >= n:
                table = np.concatenate(kept)[:n]
                return {one.name: table[:, k] for k, one in enumerate(self.uncertain)}
        raise InputError(
            f"{self.robot}: of {_TRIES * n} draws {sum(map(len, kept))} keep the bounds of all parameters:"
            " too little is known of them to draw from"
        )

    def _placed(self, away: Floats) -> Floats:
        out = np.empty_like(away)
        for k, one in enumerate(self.uncertain):
            out[:, k] = one.value * np.exp(away[:, k]) if one.scale == "log" else one.value + away[:, k]
        return out

    def _within(self, drawn: Floats) -> NDArray[np.bool_]:
        low, high = (np.array([one.bounds[end] for one in self.uncertain]) for end in (0, 1))
        return np.asarray(((drawn >= low) & (drawn <= high)).all(axis=1))


Result = ServoDiagnosis | _core.TorqueDiagnosis | _core.TorqueFit | Mapping[str, Any] | str | os.PathLike[str]


def randomisation(
    result: Result, *, known: float = KNOWN, mass_uncertainty: float = MASSES_KNOWN
) -> Randomisation:
    """What `truing.dynamics.diagnose` or `identify` left uncertain.

        left = truing.dynamics.randomisation("result")
        left.sample(4096, seed=1)["command_gain.elbow_flex"]  # shape=(4096,) [Nm/rad]

    result: what these returned, the folder that the commands wrote, or its result.json, read.
    known: a standard error below this part of the value (of a value that may be zero: of what it is usually
    large) is taken for none.
    mass_uncertainty: of results from commands alone, the standard error of the model's masses, as a part of
    them: gains, friction and masses then share a factor, since motion is the same for any.

    Raises InputError: no such result, numbers below zero.
    """
    if not (known >= 0.0 and mass_uncertainty >= 0.0):
        raise InputError(
            f"known {known:g} and mass_uncertainty {mass_uncertainty:g}: expected zero or more of both"
        )
    read = result_dict(result)
    if read.get("from") == "commands":
        return _of_commands(read, known, mass_uncertainty)
    return _of_torques(read, known)


def result_dict(result: Result) -> Mapping[str, Any]:
    """What result.json holds. Raises InputError."""
    if isinstance(result, ServoDiagnosis):
        return servo_dict(result)
    if isinstance(result, _core.TorqueDiagnosis):
        return diagnosis_dict(result)
    if isinstance(result, _core.TorqueFit):
        return fit_dict(result)
    if isinstance(result, Mapping):
        return result
    file = Path(result)
    file = file / "result.json" if file.is_dir() else file
    try:
        read = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{file}: cannot be read ({error}): expected the folder that `truing dynamics diagnose` or"
            " `identify` wrote"
        ) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: is not JSON: {error}") from None
    if not isinstance(read, dict) or read.get("command") not in ("diagnose", "identify"):
        raise InputError(
            f"{file}: is not a result of `truing dynamics diagnose` or `identify`: expected format"
            " truing-dynamics/1"
        )
    return read


# ---- From commands -----------------------------------------------------------------------------------
def _of_commands(result: Mapping[str, Any], known: float, mass_uncertainty: float) -> Randomisation:
    """Own covariance of what is not known, and the factor that all torques and masses share."""
    given = result["covariance"]
    names, scales = list(given["names"]), list(given["scales"])
    values = np.array(given["values"], dtype=float)
    prior = np.array([math.inf if p is None else p for p in given["prior"]], dtype=float)
    matrix = np.array(given["matrix"], dtype=float).reshape(len(names), len(names))
    sigma = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    size = np.array([1.0 if scale == "log" else p for scale, p in zip(scales, prior, strict=True)])
    open_ = sigma > known * size
    own = np.where(np.outer(open_, open_), matrix, 0.0)
    share = np.array([_with_masses(n, s, v) for n, s, v in zip(names, scales, values, strict=True)])
    total = np.zeros((len(names) + 1, len(names) + 1))
    total[:-1, :-1] = own
    direction = np.append(share, 1.0) * mass_uncertainty
    total += np.outer(direction, direction)
    units = [*given["units"], "1"]
    rows = [
        Uncertain(
            name, unit, scale, float(value), float(np.sqrt(total[k, k])), float(sigma_own), bounds(name)
        )
        for k, (name, unit, scale, value, sigma_own) in enumerate(
            zip(
                [*names, MASSES],
                units,
                [*scales, "log"],
                [*values, 1.0],
                [*np.where(open_, sigma, 0.0), 0.0],
                strict=True,
            )
        )
    ]
    drawn = [k for k, row in enumerate(rows) if row.sigma > 0.0]
    settled = tuple(
        Known(
            name,
            unit,
            float(value),
            float(s * value if scale == "log" else s),
            f"its standard error is {_part(s, one)} of {'itself' if scale == 'log' else 'its usual size'}",
        )
        for k, (name, unit, value, s, scale, one) in enumerate(
            zip(names, units[:-1], values, sigma, scales, size, strict=True)
        )
        if k not in drawn
    )
    notes = [_mass_note(mass_uncertainty)]
    return Randomisation(
        str(result.get("robot") or ""),
        tuple(rows[k] for k in drawn),
        _correlation(total[np.ix_(drawn, drawn)]),
        settled,
        tuple(str(one["sentence"]) for one in result.get("classes", [])),
        tuple(notes),
        _by_controller(result),
    )


def _by_controller(result: Mapping[str, Any]) -> dict[str, float]:
    joints = (result.get("chains") or {}).get("named", {}).get("joints", {})
    parts = {joint: float(drive.get("limited_damping") or 0.0) for joint, drive in joints.items()}
    return {joint: part for joint, part in parts.items() if part > 0.0}


def _part(sigma: float, of: float) -> str:
    return f"{100 * sigma / of:.2g} %" if math.isfinite(of) and of > 0.0 else "nothing"


def _mass_note(mass_uncertainty: float) -> str:
    text = "commands and motion show torques only up to a factor, which they share with the masses"
    if mass_uncertainty == 0.0:
        return f"{text}: the masses are taken as exact"
    return f"{text}: drawn together, with {100 * mass_uncertainty:g} % for the masses"


def bounds(name: str) -> tuple[float, float]:
    """Of a value of a chain by its name, `field.joint`."""
    field = PARAMETERS.get(name.partition(".")[0])
    return (0.0 if name == MASSES else -math.inf, math.inf) if field is None else (field.low, field.high)


def _with_masses(name: str, scale: str, value: float) -> float:
    """What a factor on all masses does to a value, in its scale, when motion stays: the derivative by the
    factor's logarithm."""
    field = PARAMETERS.get(name.partition(".")[0])
    dimension = "inertia" if name == "payload_mass" else "one" if field is None else field.dimension
    if dimension in ("1/torque", "angle/torque"):
        power = -1.0
    elif dimension == "inertia" or dimension.startswith("torque"):
        power = 1.0
    else:
        return 0.0
    return power if scale == "log" else power * value


def _correlation(matrix: Floats) -> Floats:
    sigma = np.sqrt(np.diag(matrix))
    out = np.asarray(matrix / np.outer(sigma, sigma))
    np.fill_diagonal(out, 1.0)
    return out


# ---- From torques ------------------------------------------------------------------------------------
def _of_torques(result: Mapping[str, Any], known: float) -> Randomisation:
    """What is not known of the effects, with the covariance of the fit."""
    parameters: list[Mapping[str, Any]] = list(result.get("parameters", ()))
    for effect in result.get("effects", ()):
        parameters += effect["parameters"]
    drawn: list[Uncertain] = []
    settled: list[Known] = []
    left: list[str] = []
    for p in parameters:
        name, value, sigma, unit = str(p["name"]), p["value"], p["sigma"], str(p["unit"])
        effect = name.partition(".")[0]
        if effect in IN_BODIES or value is None or sigma is None or not sigma > 0.0:
            left.append(name)
        elif effect in ONLY_MEASURED:
            settled.append(Known(name, unit, value, sigma, ONLY_MEASURED[effect]))
        elif sigma <= known * abs(value):
            why = f"its standard error is {_part(sigma, abs(value))} of itself"
            settled.append(Known(name, unit, value, sigma, why))
        else:
            drawn.append(_of_sign(Uncertain(name, unit, "linear", value, sigma, sigma)))
    notes = []
    if left:
        some = ", ".join(left[:6]) + (" …" if len(left) > 6 else "")
        notes.append(f"not drawn, as bodies must stay possible, or there is no standard error of it: {some}")
    at = [result["covariance"]["names"].index(one.name) for one in drawn]
    matrix = np.array(result["covariance"]["matrix"], dtype=float)
    return Randomisation(
        str(result.get("robot") or ""),
        tuple(drawn),
        _correlation(matrix[np.ix_(at, at)]) if drawn else np.zeros((0, 0)),
        tuple(settled),
        tuple(str(one["sentence"]) for one in result.get("classes", [])),
        tuple(notes),
    )


def _of_sign(one: Uncertain) -> Uncertain:
    """Friction and armature do not turn round: their draws keep the sign that was found."""
    return replace(one, bounds=(0.0, math.inf) if one.value > 0.0 else (-math.inf, 0.0))


def columns_of(samples: Mapping[str, Floats], uncertain: Sequence[Uncertain]) -> dict[str, Floats]:
    """Columns of samples.csv, units in their names."""
    unit = {one.name: one.unit for one in uncertain}
    return {f"{name} [{unit[name]}]": values for name, values in samples.items()}
