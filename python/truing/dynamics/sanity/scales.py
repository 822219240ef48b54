# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measured torque over the model's: units, gains of drives, percentages of a torque limit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.readings import Fit

Floats = NDArray[np.float64]

SEEN = 0.3  # of the variance that the rigid torque must explain to say anything of a scale
FAR = 5.0  # ratio of all joints from which on nothing that is named has a meaning
SCALE = 2.0  # largest ratio between model and measurement that is the diagnosis' matter
THOUSAND = 250.0  # from this ratio on it is one of units
RATED = 2.0  # spread of ratios to a joint's limit that is one of percentages


def scales(robot: _core.Robot, fit: Fit, unknown: Sequence[int]) -> list[RecordingFinding]:
    """Torques that are far from the model's by a factor; `unknown` joints have no scale yet."""
    joints = driven_joints(robot)
    names = [joint.name for joint in joints]
    rest = [j for j in _seen(fit) if j not in unknown]
    ratio = {j: float(fit.scale[j]) for j in rest}
    out: list[RecordingFinding] = []
    if not rest:
        return out
    middle = float(np.median(list(ratio.values())))
    percent = _percent_of(joints, ratio)
    where = tuple(names[j] for j in rest)
    if middle > THOUSAND or middle < 1.0 / THOUSAND:
        many = middle if middle > 1.0 else 1.0 / middle
        words = f"torques are {many:.0f} times {'larger' if middle > 1 else 'smaller'} than the model's"
        words += ": mNm in place of Nm, or masses in g?" if middle > 1 else ": Nm in place of mNm?"
        out.append(RecordingFinding("torque_unit", (), where, words, middle, "-", mistake=True))
    elif percent:
        words = f"torques over the model's go with 1 / the joints' torque limits: per {percent} of the limit?"
        out.append(RecordingFinding("torque_unit", (), where, words, middle, "-", mistake=True))
    else:
        out += _gains(names, ratio)
    return out


def _gains(names: Sequence[str], ratio: dict[int, float]) -> list[RecordingFinding]:
    wrong = {j: r for j, r in ratio.items() if not 1.0 / SCALE < r < SCALE}
    if not wrong:
        return []
    said = listed([f"{names[j]} {r:.2g}" for j, r in wrong.items()])
    words = (
        f"measured torque over the model's rigid torque: {said}. Check the torque per ampere and the"
        " masses; a load that the model lacks makes more than 1"
    )
    worst = max(wrong.values(), key=lambda r: abs(math.log(r)))
    beyond = len(ratio) > 1 and all(not 1.0 / FAR < r < FAR for r in ratio.values())
    if beyond:
        words += ", and torques on the motors' side of their gears less"
    where = tuple(names[j] for j in wrong)
    return [RecordingFinding("gain", (), where, words, worst, "-", mistake=beyond)]


def gain_unknown(robot: _core.Robot, fit: Fit, unknown: Sequence[int]) -> RecordingFinding:
    """Of drives without a constant: which one the model's masses would need."""
    names = [joint.name for joint in driven_joints(robot)]
    words = (
        f"{listed([names[j] for j in unknown])}: currents without torque_per_ampere: masses and drive"
        " constants share one scale"
    )
    per_ampere = {j: 1.0 / float(fit.scale[j]) for j in _seen(fit) if j in unknown}
    if per_ampere:
        said = listed([f"{names[j]} {value:.3g}" for j, value in per_ampere.items()], 8)
        words += f"; with the model's masses it would be {said} Nm/A (--torque-per-ampere)"
    value = float(np.median(list(per_ampere.values()))) if per_ampere else 1.0
    return RecordingFinding("gain_unknown", (), tuple(names[j] for j in unknown), words, value, "Nm/A")


def constants_by_masses(fit: Fit, unknown: Sequence[int]) -> Floats:
    """[Nm/A | N/A] shape=(joints,) of drives that the model's masses would need; where those say nothing,
    that of the other joints; 1 of a drive that is known.
    """
    by_masses = {j: 1.0 / fit.scale[j] for j in _seen(fit) if j in unknown}
    out = np.ones(len(fit.scale))
    for j in unknown:
        out[j] = by_masses.get(j, np.median(list(by_masses.values())) if by_masses else 1.0)
    return out


def _seen(fit: Fit) -> list[int]:
    """Joints whose rigid torque is seen in what was measured."""
    return [j for j in range(len(fit.scale)) if fit.by_rigid[j] > SEEN and fit.scale[j] > 0.0]


def _percent_of(joints: Sequence[_core.Joint], ratio: dict[int, float]) -> str:
    """ "cent" or "mille", where ratios are that of a torque limit."""
    limits = {j: joints[j].torque_limit for j in ratio}
    if len(ratio) < 2 or any(limit is None for limit in limits.values()):
        return ""
    if all(1.0 / SCALE < r < SCALE for r in ratio.values()):
        return ""
    of_limits = [r * (limits[j] or math.nan) for j, r in ratio.items()]
    if max(of_limits) / min(of_limits) > max(ratio.values()) / min(ratio.values()):
        return ""  # the same ratio at all joints: other masses, as of another robot's file
    for many, word in ((100.0, "cent"), (1000.0, "mille")):
        of_limit = [one / many for one in of_limits]
        if max(of_limit) < RATED and min(of_limit) > 1.0 / RATED:
            return word
    return ""
