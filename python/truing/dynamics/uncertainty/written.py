# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Domain randomisation as files: YAML for people and any simulator, and events of Isaac Lab."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from truing import _core
from truing.dynamics.uncertainty import RANGE, Randomisation, columns_of
from truing.dynamics.uncertainty.page import randomisation_report
from truing.files import write_table
from truing.report.json_text import to_json, without_nan

FORMAT = "truing-randomisation/1"
_DIGITS = 6


def yaml_text(left: Randomisation) -> str:
    """Ranges, scales, correlations, and what is not drawn (JSON strings are YAML strings)."""
    lines = [
        f"format: {FORMAT}",
        f"robot: {json.dumps(left.robot)}",
        f"# low, high: {100 * (RANGE[1] - RANGE[0]):.0f} % of the draws. sigma: of scale log that of the"
        " logarithm.",
        "# own_sigma: the standard error of the fit; where it is less, the rest is a factor that all share.",
        "randomised:" + ("" if left.uncertain else " []"),
    ]
    for one in left.uncertain:
        low, high = one.range
        lines += [
            f"  - name: {json.dumps(one.name)}",
            f"    unit: {json.dumps(one.unit)}",
            f"    scale: {one.scale}",
            f"    value: {_number(one.value)}",
            f"    low: {_number(low)}",
            f"    high: {_number(high)}",
            f"    sigma: {_number(one.sigma)}",
            f"    own_sigma: {_number(one.own_sigma)}",
            f"    bounds: [{_number(one.bounds[0])}, {_number(one.bounds[1])}]",
        ]
    lines.append("correlation:" + ("" if left.uncertain else " []") + "  # of the randomised, in that order")
    lines += [f"  - [{', '.join(_number(value) for value in row)}]" for row in left.correlation.tolist()]
    lines.append("known:" + ("" if left.known else " []"))
    for settled in left.known:
        lines += [
            f"  - name: {json.dumps(settled.name)}",
            f"    unit: {json.dumps(settled.unit)}",
            f"    value: {_number(settled.value)}",
            f"    sigma: {_number(settled.sigma)}",
            f"    why: {json.dumps(settled.why)}",
        ]
    for key, texts in (("cannot_be_told_apart", left.classes), ("notes", left.notes)):
        lines.append(f"{key}:" + ("" if texts else " []"))
        lines += [f"  - {json.dumps(text)}" for text in texts]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    if math.isinf(value):
        return ".inf" if value > 0 else "-.inf"
    text = f"{value:.{_DIGITS}g}"
    return text if any(c in text for c in ".en") else f"{text}.0"


# ---- Isaac Lab ---------------------------------------------------------------------------------------
FIELDS = {
    "command_gain": "stiffness",
    "damping_gain": "damping",
    "coulomb": "friction",
    "viscous": "viscous",
    "armature": "armature",
    "delay": "delay",
}
"""Of an actuator in Isaac Lab, by the field of a servo's chain or the effect on a torque."""

_EVENTS = '''"""Domain randomisation of {robot} for Isaac Lab, written by truing.

    from events import EventsCfg  # in a manager-based environment: events = EventsCfg()

One event draws all parameters of a robot together, with their correlations, and writes them; the events that
come with Isaac Lab would draw each by itself. What is not here was found well enough to stay. `draw` needs
numpy alone. Names: {mapped}.
Not an actuator's, and left to you: {others}.
"""

from __future__ import annotations

import numpy as np

ASSET = "robot"
"""Name of the articulation in the scene."""
NAMES = {names!r}
LOG = {logs!r}  # those whose logarithm is normal
VALUES = {values!r}
COVARIANCE = {covariance!r}
"""In the scales: of the logarithm where LOG."""
BOUNDS = {bounds!r}
FIELDS = {fields!r}
"""(column, field, joint, part of it) of what an actuator has."""
BESIDE = {beside!r}
"""By field and joint: what is there of it beside what is drawn."""
COEFFICIENTS = (("friction", "joint_friction_coeff"), ("viscous", "joint_viscous_friction_coeff"))
FOUND = {found!r}
"""Of these fields, by joint: as it was found."""


def draw(n, random):
    """n robots, shape=(n, len(NAMES)). random: numpy.random.Generator."""
    values, vectors = np.linalg.eigh(np.array(COVARIANCE))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    found, logs = np.array(VALUES), np.array(LOG)
    low, high = np.array(BOUNDS).T
    out = np.empty((0, len(NAMES)))
    while len(out) < n:
        away = random.standard_normal((n, len(NAMES))) @ root.T
        table = np.where(logs, found * np.exp(np.where(logs, away, 0.0)), found + away)
        out = np.concatenate([out, table[((table >= low) & (table <= high)).all(axis=1)]])
    return out[:n]


def randomise_servos(env, env_ids, seed=None):
    """The event: draws and writes gains, friction, armature and delay of the joints."""
    import torch

    asset = env.scene[ASSET]
    ids = torch.arange(env.scene.num_envs, device=asset.device) if env_ids is None else env_ids
    random = np.random.default_rng(seed)
    table = torch.as_tensor(draw(len(ids), random), dtype=torch.float32, device=asset.device)
    step = env.physics_dt
    drawn = {{}}
    for column, field, joint, part in FIELDS:
        before = drawn.get((field, joint), BESIDE.get((field, joint), 0.0))
        drawn[field, joint] = before + part * table[:, column]
    for joint in sorted({{joint for _, joint in drawn}}):
        number = asset.find_joints(joint)[0]
        friction = {{
            name: drawn[field, joint].unsqueeze(1)
            for field, name in COEFFICIENTS
            if (field, joint) in drawn
        }}
        if friction:
            usual = torch.full((len(ids), 1), FOUND.get(joint, {{}}).get("friction", 0.0))
            dry = friction.get("joint_friction_coeff", usual)
            friction["joint_friction_coeff"] = friction["joint_dynamic_friction_coeff"] = dry
            _write(asset, "joint_friction_coefficient", number, ids, **friction)
        if ("armature", joint) in drawn:
            _write(asset, "joint_armature", number, ids, armature=drawn["armature", joint].unsqueeze(1))
    for actuator in asset.actuators.values():
        for k, joint in enumerate(actuator.joint_names):
            for field in ("stiffness", "damping"):
                if (field, joint) not in drawn:
                    continue
                getattr(actuator, field)[ids, k] = drawn[field, joint]
                if getattr(actuator, "is_implicit_model", False):
                    values = {{field: drawn[field, joint].unsqueeze(1)}}
                    _write(asset, f"joint_{{field}}", asset.find_joints(joint)[0], ids, **values)
        late = [drawn["delay", joint] for joint in actuator.joint_names if ("delay", joint) in drawn]
        if late and hasattr(actuator, "positions_delay_buffer"):
            # A DelayedPD actuator delays all of its joints alike, and no longer than its max_delay.
            steps = torch.round(torch.stack(late).mean(dim=0) / step).to(torch.int)
            actuator.positions_delay_buffer.set_time_lag(steps.clamp(0, actuator.cfg.max_delay), ids)


def _write(asset, what, joint_ids, env_ids, **values):
    """Isaac Lab 3 writes by index, 2 does not say so."""
    name = f"write_{{what}}_to_sim"
    write = getattr(asset, f"{{name}}_index", None) or getattr(asset, name)
    write(**values, joint_ids=joint_ids, env_ids=env_ids)


try:
    from isaaclab.managers import EventTermCfg
    from isaaclab.utils import configclass
except ImportError:  # without Isaac Lab `draw` is of use
    pass
else:

    @configclass
    class EventsCfg:
        """For `events` of an environment's configuration."""

        servos = EventTermCfg(func=randomise_servos, mode="startup")
'''


def isaaclab_text(left: Randomisation) -> str:
    """Source of events.py."""
    fields = [
        (k, *one) for k, name in enumerate(left.names) for one in _of_actuator(name, left.by_controller)
    ]
    others = [name for name in left.names if not _of_actuator(name, left.by_controller)]
    found: dict[str, dict[str, float]] = {}
    beside: dict[tuple[str, str], float] = {}
    settled = [(one.name, one.value) for one in left.known]
    for name, value in [*((one.name, one.value) for one in left.uncertain), *settled]:
        for field, joint, part in _of_actuator(name, left.by_controller):
            of_joint = found.setdefault(joint, {})
            of_joint[field] = of_joint.get(field, 0.0) + part * value
            if (name, value) in settled:
                beside[field, joint] = beside.get((field, joint), 0.0) + part * value
    return _EVENTS.format(
        robot=_plain(left.robot) or "the robot",
        mapped=", ".join(f"{ours} is {theirs}" for ours, theirs in FIELDS.items()),
        others=_plain(", ".join(others)) or "nothing",
        names=left.names,
        logs=[one.scale == "log" for one in left.uncertain],
        values=[float(f"{one.value:.9g}") for one in left.uncertain],
        covariance=[[float(f"{v:.9g}") for v in row] for row in left.covariance().tolist()],
        bounds=[[_finite(end) for end in one.bounds] for one in left.uncertain],
        fields=fields,
        found=found,
        beside=beside,
    )


def _finite(end: float) -> float:
    """`inf` is no Python literal."""
    return max(min(end, 1e30), -1e30)


def _plain(text: str) -> str:
    return text.replace("\\", "").replace('"', "")


def _of_actuator(name: str, by_controller: Mapping[str, float]) -> list[tuple[str, str, float]]:
    """Fields of a joint's actuator, and the parts of the value that they get."""
    ours, _, joint = name.partition(".")
    if ours not in FIELDS:
        return []
    part = by_controller.get(joint, 0.0) if ours == "viscous" else 0.0
    out = [(FIELDS[ours], joint, 1.0 - part)] if part < 1.0 else []
    return [*out, (FIELDS["damping_gain"], joint, part)] if part > 0.0 else out


def table_rows(left: Randomisation) -> Sequence[tuple[str, str, str, str]]:
    """Name, value, range and unit of what is drawn, for people."""
    return [
        (one.name, f"{one.value:.3g}", f"{one.range[0]:.3g} to {one.range[1]:.3g}", one.unit)
        for one in left.uncertain
    ]


# ---- Everything --------------------------------------------------------------------------------------
def randomisation_dict(left: Randomisation, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` of ``truing dynamics randomise`` holds."""
    out: dict[str, Any] = without_nan(
        {
            "format": "truing-dynamics/1",
            "command": "randomise",
            "version": _core.version(),
            "robot": left.robot,
            "randomised": [
                {**asdict(one), "low": one.range[0], "high": one.range[1], "bounds": list(one.bounds)}
                for one in left.uncertain
            ],
            "correlation": left.correlation,
            "known": [asdict(settled) for settled in left.known],
            "cannot_be_told_apart": list(left.classes),
            "notes": list(left.notes),
            "warnings": list(warnings),
        }
    )
    return out


def write_randomisation(
    folder: Path, left: Randomisation, samples: int, seed: int, *, warnings: Iterable[str] = ()
) -> dict[str, Any]:
    """Writes everything of ``truing dynamics randomise``, and returns what result.json holds."""
    result = {**randomisation_dict(left, warnings=warnings), "seed": seed}
    (folder / "randomisation.yaml").write_text(yaml_text(left), encoding="utf-8")
    (folder / "events.py").write_text(isaaclab_text(left), encoding="utf-8")
    if left.uncertain:
        write_table(folder / "samples.csv", columns_of(left.sample(samples, seed), left.uncertain))
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    (folder / "report.html").write_text(randomisation_report(result), encoding="utf-8")
    return result
