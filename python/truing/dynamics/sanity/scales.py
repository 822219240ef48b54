# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measured torque over the model's: units, gains of drives, percentages of a torque limit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.readings import Fit

SEEN = 0.3  # of the variance that the rigid torque must explain to say anything of a scale
SCALE = 2.0  # largest ratio between model and measurement that is the diagnosis' matter
THOUSAND = 250.0  # from this ratio on it is one of units
RATED = 2.0  # spread of ratios to a joint's limit that is one of percentages


def scales(robot: _core.Robot, fit: Fit, known: Sequence[bool]) -> list[RecordingFinding]:
    """Torques that are far from the model's by a factor; of drives without a constant (`known`: it is, or the
    torque was measured), which constant the model's masses would need.
    """
    joints = driven_joints(robot)
    names = [joint.name for joint in joints]
    seen = [j for j in range(len(joints)) if fit.by_rigid[j] > SEEN and fit.scale[j] > 0.0]
    out = []
    unknown = [j for j in range(len(joints)) if not known[j]]
    if unknown:
        out.append(_gain_unknown(names, unknown, [j for j in seen if j in unknown], fit))
    rest = [j for j in seen if known[j]]
    ratio = {j: float(fit.scale[j]) for j in rest}
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
    return [RecordingFinding("gain", (), tuple(names[j] for j in wrong), words, worst, "-")]


def _gain_unknown(
    names: Sequence[str], unknown: Sequence[int], seen: Sequence[int], fit: Fit
) -> RecordingFinding:
    words = (
        f"{listed([names[j] for j in unknown])}: currents without torque_per_ampere: masses and drive"
        " constants share one scale"
    )
    per_ampere = {j: 1.0 / float(fit.scale[j]) for j in seen}
    if per_ampere:
        said = listed([f"{names[j]} {value:.3g}" for j, value in per_ampere.items()], 8)
        words += f"; with the model's masses it would be {said} Nm/A (--torque-per-ampere)"
    value = float(np.median(list(per_ampere.values()))) if per_ampere else math.nan
    return RecordingFinding(
        "gain_unknown", (), tuple(names[j] for j in unknown), words, value if per_ampere else 1.0, "Nm/A"
    )


def _percent_of(joints: Sequence[_core.Joint], ratio: dict[int, float]) -> str:
    """ "cent" or "mille", where ratios are that of a torque limit."""
    limits = {j: joints[j].torque_limit for j in ratio}
    if len(ratio) < 2 or any(limit is None for limit in limits.values()):
        return ""
    if all(1.0 / SCALE < r < SCALE for r in ratio.values()):
        return ""
    for many, word in ((100.0, "cent"), (1000.0, "mille")):
        of_limit = [r * (limits[j] or math.nan) / many for j, r in ratio.items()]
        if max(of_limit) < RATED and min(of_limit) > 1.0 / RATED:
            return word
    return ""
