# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What ``truing apply`` did, as it is written: copies of the programs, ``result.json``, the report, and a
table of the programs' poses.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.files import write_table
from truing.files.common import joint_columns
from truing.files.stream_file import pose_columns
from truing.model import Robot
from truing.programs.apply import Applied, Outcome
from truing.programs.page import Drawing, programs_report
from truing.report.json_text import to_json, without_nan
from truing.report.rows import statistics

FORMAT = "truing-programs/1"
ENDING = "_compensated"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class AppliedPrograms:
    """Everything that one run of ``truing apply`` came to."""

    outcome: Outcome
    nominal: Robot
    real: Robot


def copy_name(path: Path) -> str:
    """The name of a program's copy."""
    return f"{path.stem}{ENDING}{path.suffix}"


def programs_dict(made: AppliedPrograms, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """What ``result.json`` holds."""
    outcome = made.outcome
    done = [one for one in outcome.targets if one.status != "stayed"]
    return {
        "format": FORMAT,
        "version": _core.version(),
        "brand": outcome.brand,
        "nominal": made.nominal.name,
        "calibrated": made.real.name,
        "effects": [effect.effect for effect in made.real.effects],
        "files": [_file(path, outcome) for path in outcome.files],
        "targets": [_target(one) for one in outcome.targets],
        "stayed": _all_stayed(outcome),
        "refused": [{"files": [str(p) for p in one.paths], "why": one.message} for one in outcome.refused],
        "before": _errors([one.before for one in done]),
        "after": _errors([one.after for one in done]),
        "moved": _errors([one.moved for one in done]),
        "printed_digits": _errors([one.rounding for one in done]),
        "notes": list(outcome.notes),
        "warnings": list(warnings),
    }


def _all_stayed(outcome: Outcome) -> list[dict[str, Any]]:
    """Targets and other moves that are left as they are, in the order of the files' lines."""
    left = [one for one in outcome.targets if one.status == "stayed"]
    found = [_stayed(one.source, one.target.line, one.target.name, one.why) for one in left]
    found += [_stayed(path, stay.line, stay.what, stay.why) for path, stay in outcome.stays]
    return sorted(found, key=lambda one: (one["file"], one["line"]))


def _stayed(path: Path, line: int, what: str, why: str) -> dict[str, Any]:
    return {"file": path.name, "line": line, "what": what, "why": why}


def _errors(pairs: Sequence[tuple[float, float]]) -> dict[str, Any]:
    values = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    turns = values[:, 1]
    return {**statistics(values[:, 0]), "rotation_max_rad": float(turns.max()) if turns.size else None}


def _file(path: Path, outcome: Outcome) -> dict[str, Any]:
    own = [one for one in outcome.targets if one.source == path]
    left = sum(1 for source, _ in outcome.stays if source == path)
    count = {
        status: sum(1 for one in own if one.status == status) for status in ("changed", "same", "stayed")
    }
    return {
        "file": str(path),
        "written": copy_name(path),
        "targets": len(own),
        **count,
        "stayed": count["stayed"] + left,
    }


def _target(one: Applied) -> dict[str, Any]:
    old, new = one.numbers
    found: dict[str, Any] = {
        "file": one.source.name,
        "line": one.target.line,
        "name": one.target.name,
        "move": one.target.move,
        "kind": one.target.kind,
        "status": one.status,
        "why": one.why,
        "before": old,
        "after": new,
        "notes": list(one.target.notes),
    }
    if one.status == "stayed":
        return found
    for key in ("before", "after", "moved", "rounding"):
        position, rotation = getattr(one, key)
        name = {"before": "error_before", "after": "error_after"}.get(key, key)
        found |= {f"{name}_m": position, f"{name}_rad": rotation}
    if one.target.configuration is not None:
        found["configuration"] = one.target.configuration.text
    found["configuration_from"] = one.configuration_from
    found["joints_rad"] = None if one.command_joints is None else one.command_joints.tolist()
    return found


def _drawing(outcome: Outcome, nominal: Robot) -> Drawing:
    shown = [one for one in outcome.targets if one.wanted is not None]
    places = np.array([one.wanted[:3, 3] for one in shown if one.wanted is not None]).reshape(-1, 3)
    commands = np.array(
        [(one.command if one.command is not None else np.full((4, 4), np.nan))[:3, 3] for one in shown]
    ).reshape(-1, 3)
    robots: tuple[Floats, ...] = ()
    there = next((one.joints for one in shown if one.joints is not None), None)
    if there is not None:
        frames = np.linalg.inv(nominal.T_measurement_base) @ _core.forward_kinematics(nominal, there)
        robots = (np.concatenate([np.zeros((1, 3)), frames[:, :3, 3]]),)
    return Drawing(
        places=places,
        commands=commands,
        changed=np.array([one.status == "changed" for one in shown], dtype=bool),
        texts=tuple(f"{one.source.name}, line {one.target.line}: {one.target.name}" for one in shown),
        robots=robots,
        before=np.array([one.before[0] for one in shown]),
        after=np.array([one.after[0] for one in shown]),
    )


def write_programs(folder: Path, made: AppliedPrograms, *, warnings: Iterable[str] = ()) -> dict[str, Any]:
    """Writes the copies, result.json and report.html into `folder`. Returns what result.json holds."""
    found: dict[str, Any] = without_nan(programs_dict(made, warnings=warnings))
    names = [copy_name(path) for path in made.outcome.files]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two programs would both be written as {twice}: apply them one at a time")
    for path, data in made.outcome.files.items():
        (folder / copy_name(path)).write_bytes(data)
    (folder / "result.json").write_text(to_json(found), encoding="utf-8")
    page = programs_report(found, _drawing(made.outcome, made.nominal))
    (folder / "report.html").write_text(page, encoding="utf-8")
    return found


def poses_table(targets: Sequence[Applied], nominal: Robot) -> Mapping[str, Any]:
    """Columns of --poses-out: where the programs want the tool, in the robot base, and the nominal robot's
    joints there, one row per target in the order of the moves. Those without are left out.
    """
    rows = [one for one in targets if one.wanted is not None and one.joints is not None]
    if not rows:
        raise InputError("--poses-out: the programs have no target whose pose is known")
    T = np.array([one.wanted for one in rows if one.wanted is not None])
    q = np.array([one.joints for one in rows if one.joints is not None])
    return {**pose_columns(T), **joint_columns(nominal, q)}


def write_poses(path: Path, made: AppliedPrograms) -> None:
    """Writes `poses_table` as CSV or Parquet."""
    write_table(path, poses_table(made.outcome.targets, made.nominal))
