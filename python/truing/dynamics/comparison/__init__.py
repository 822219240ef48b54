# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two simulator models on the same recordings: which moves more like the robot, at which joints, and,
where torques were recorded, which needs those that were measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.commanded import Commanded
from truing.dynamics.export import Exported
from truing.dynamics.recorded import Recorded
from truing.dynamics.rollout import WINDOWS, judgement_dict, possible
from truing.dynamics.rollout.page import main_horizon
from truing.dynamics.runner import Runnable
from truing.dynamics.simulate import COMMANDED_HORIZONS, HORIZONS, Judgement, judge
from truing.errors import InputError

Floats = NDArray[np.float64]
Model = _core.Robot | Exported | Runnable

MARGIN = 0.05
_LEAST = 1e-9  # [rad | m | Nm | N] added to errors: none at all is as good as this
_DRAWS = 400  # of the bootstrap
_INTERVAL = (0.05, 0.95)


@dataclass(frozen=True)
class Ratio:
    """B's error over A's: the geometric mean over the joints."""

    value: float
    low: float  # 90 % interval over recordings and stretches; NaN: not known
    high: float
    joints: tuple[float, ...]  # of each joint


@dataclass(frozen=True)
class Comparison:
    """What `compare` found."""

    judgement: Judgement  # of the models "A" and "B", with torques where they were recorded
    torque: Ratio | None  # None: driven by commands, no torque was recorded
    motion: tuple[Ratio, ...]  # of each horizon
    margin: float
    notes: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())  # what of each model was left out

    @property
    def ratios(self) -> list[tuple[str, Ratio]]:
        horizons = (f"motion {h:g} s ahead" for h in self.judgement.windows.horizons)
        motion = list(zip(horizons, self.motion, strict=True))
        return motion if self.torque is None else [("torque", self.torque), *motion]

    @property
    def worse(self) -> list[str]:
        """In what B is worse than A by more than the margin."""
        return [name for name, ratio in self.ratios if ratio.value > 1.0 + self.margin]

    @property
    def better(self) -> list[str]:
        return [name for name, ratio in self.ratios if ratio.value < 1.0 / (1.0 + self.margin)]

    @property
    def nearer(self) -> str:
        """'A', 'B', 'neither' where they do not differ by more than the margin, 'mixed'."""
        if self.worse and self.better:
            return "mixed"
        return "A" if self.worse else "B" if self.better else "neither"


def compare(
    a: Model,
    b: Model,
    recordings: Sequence[Recorded],
    *,
    margin: float = MARGIN,
    horizons: Sequence[float] | None = None,
    windows: int = WINDOWS,
    seed: int = 0,
) -> Comparison:
    """Judges two models by torque and by motion over the same windows of recordings (`judge`).

    Driven by the recorded torques; `commanded_mjcf` models by the recorded commands, and by motion alone.

    a, b: robots, exports, or MJCF files as they are (`truing.dynamics.runner.runnable_mjcf`), with the same
    number of joints. recordings: with torques, or currents and the models' torque_per_ampere, or commands for
    `commanded_mjcf`; best ones that neither model was fitted to. margin: ratio of errors beyond one that
    counts as a difference. horizons: [s]; default: 0.1, 0.5, 2, of commands also 5, as far as recordings are
    long enough. windows: at most so many, evenly taken. seed: of the bootstrap of the intervals.

    Raises InputError: no such torques, other numbers of joints, nothing as long as the longest horizon,
    MuJoCo is not installed.
    """
    if not margin >= 0.0:
        raise InputError(f"a margin of {margin:g}: expected zero or more")
    commanded = isinstance(a, Commanded)
    usual = COMMANDED_HORIZONS if commanded else HORIZONS
    wanted = possible(usual, recordings) if horizons is None else horizons
    judged = judge({"A": a, "B": b}, recordings, wanted, most=windows, torques=not commanded)
    groups = _groups(judged)
    motion = tuple(_motion_ratio(judged, h, groups, seed) for h in judged.windows.horizons)
    torque = None
    if not commanded:
        torque_a, torque_b = (judged.torque_error[m] / judged.torque_spread[m] for m in ("A", "B"))
        torque = _ratio(torque_a, torque_b, [])
    notes = tuple(m.notes if isinstance(m, Runnable) else () for m in (a, b))
    return Comparison(judged, torque, motion, margin, (notes[0], notes[1]))


def _groups(judged: Judgement) -> list[NDArray[np.intp]]:
    """Windows that overlap, or follow within a horizon, go together: stretches of two horizons."""
    windows = judged.windows
    length = 2.0 * max(windows.horizons)
    number = windows.track * 1_000_000 + ((windows.starts - windows.starts.min()) / length).astype(np.intp)
    return [np.flatnonzero(number == one) for one in np.unique(number)]


def _motion_ratio(judged: Judgement, horizon: float, groups: list[NDArray[np.intp]], seed: int) -> Ratio:
    a, b = (judged.errors(model, horizon) ** 2 for model in ("A", "B"))
    random = np.random.default_rng(seed)
    draws = []
    for _ in range(_DRAWS if len(groups) > 3 else 0):
        rows = np.concatenate([groups[k] for k in random.integers(0, len(groups), len(groups))])
        draws.append(_ratio(_rms(a[rows]), _rms(b[rows]), []).value)
    return _ratio(_rms(a), _rms(b), draws)


def _rms(squares: Floats) -> Floats:
    return np.asarray(np.sqrt(squares.mean(axis=0)))


def _ratio(a: Floats, b: Floats, draws: Sequence[float]) -> Ratio:
    each = (b + _LEAST) / (a + _LEAST)
    low, high = np.quantile(draws, _INTERVAL) if draws else (math.nan, math.nan)
    return Ratio(float(np.exp(np.log(each).mean())), float(low), float(high), tuple(each.tolist()))


# ---- result.json -----------------------------------------------------------------------------------
def comparison_dict(found: Comparison, names: tuple[str, str]) -> dict[str, Any]:
    """The part of ``result.json`` of ``truing dynamics compare`` that is its own. names: of the models."""
    judged = found.judgement
    joints = judged.windows.joints
    return {
        "models": {"A": names[0], "B": names[1]},
        "margin": found.margin,
        "nearer": found.nearer,
        "worse": found.worse,
        "better": found.better,
        "sentence": sentence(found, names),
        "ratios": [
            {
                "of": name,
                "B_over_A": r.value,
                "ci": [r.low, r.high],
                "joints": dict(zip(joints, r.joints, strict=True)),
            }
            for name, r in found.ratios
        ],
        "torque": {
            model: dict(zip(joints, (100.0 * e / judged.torque_spread[model]).tolist(), strict=True))
            for model, e in judged.torque_error.items()
        },
        "torque_rms_Nm": {
            model: dict(zip(joints, e.tolist(), strict=True)) for model, e in judged.torque_error.items()
        },
        "driven_by": "commands" if found.torque is None else "torques",
        "rollout": judgement_dict(judged, "models"),
    }


def sentence(found: Comparison, names: tuple[str, str]) -> str:
    """The answer in words: which is nearer to the robot, in what, and at which joints most."""
    a, b = names
    main = main_horizon(found.judgement.windows.horizons)
    ratio = found.motion[main]
    order = np.argsort(-np.abs(np.log(ratio.joints)))
    joint = found.judgement.windows.joints[int(order[0])]
    each = f"{100 * ratio.joints[int(order[0])]:.3g} % at {joint}"
    ahead = f"{found.judgement.windows.horizons[main]:g} s ahead"
    moved = f"{ahead} its error of motion is {100 * ratio.value:.3g} % of that of the other one, {each}"
    if found.torque is not None:
        moved += f"; that of torque {100 * found.torque.value:.3g} %"
    if found.nearer == "neither":
        return f"{a} and {b} are as near to the robot, within {100 * found.margin:g} %"
    if found.nearer == "mixed":
        return f"{b} is worse than {a} in {_listed(found.worse)}, better in {_listed(found.better)}: {moved}"
    if found.nearer == "A":
        return f"{b} is further from the robot than {a}: {moved}"
    return f"{b} is nearer to the robot than {a}: {moved}"


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
