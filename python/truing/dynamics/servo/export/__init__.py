# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A servo arm as it was found, for simulators and LeRobot: MJCF, URDF, actuators of Isaac Lab, zeros; and
what could not be written, by name."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from truing import _core
from truing.dynamics.export import NOT_WRITTEN, export, listed
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.export import isaaclab, lerobot, mjcf
from truing.dynamics.servo.export.fitted import at_firmware, firmware_of, fitted_without
from truing.dynamics.servo.export.held import held, uses_of
from truing.errors import InputError
from truing.files import load_robot
from truing.files.output import atomic_output_dir

ServoTarget = Literal["mjcf", "urdf", "isaaclab", "lerobot"]

MODEL = "arm.xml"
"""In the folder of a diagnosis from commands: the diagnosed file's bodies and joints, without its drives."""
MOTION = "motion.parquet"
"""Beside it: the recordings, and which of their rows were held out."""
_NO_DRIVES = "URDF has no drives: `--to mjcf` has it"


@dataclass(frozen=True)
class ServoExported:
    """What was written."""

    files: tuple[str, ...]
    model: str  # name of the main one
    not_written: tuple[NotWritten, ...]  # largest first


def export_servo(
    chain: ServoChain,
    to: ServoTarget,
    out: str | os.PathLike[str],
    *,
    source: Path | str,
    recordings: Sequence[_core.Recording] = (),
    used: Sequence[_core.Recording] = (),
    calibration: Path | None = None,
) -> ServoExported:
    """Writes an arm with its drives as a diagnosis from commands found them, into the folder `out`.

    chain: `chains["named"]` of a ServoDiagnosis. to: "mjcf" (MuJoCo 4), "urdf", "isaaclab" (actuators.py) or
    "lerobot" (zeros). source: the file that was diagnosed, whose meshes and names stay in an MJCF, or its
    text (`ServoDiagnosis.mjcf`). recordings: motion to which joints are fitted anew that lose a law, and on
    which the size of that is stated. used: motion of the kind that the model is for: gains are those at the
    firmware's gain that it has throughout, else at the chain's reference. calibration: of lerobot, the JSON
    that the arm was recorded with. not_written.yaml lists what is missing.

    Raises InputError: unknown target, a source that MuJoCo does not take or that is another arm's, a
    calibration of other motors, MuJoCo is not installed.
    """
    if to not in get_args(ServoTarget):
        raise InputError(f"{to!r} is not known, expected one of {', '.join(get_args(ServoTarget))}")
    chain = at_firmware(chain, firmware_of(chain, used))
    uses = uses_of(chain, recordings)
    values = held(chain, uses)
    if to != "lerobot":
        fitted = fitted_without(chain, values, source, recordings)
        values = replace(values, joints=held(fitted, uses).joints)
    files: dict[str, str]
    if to == "lerobot":
        files, left = lerobot.write(chain, calibration)
        main = calibration.name if calibration else "offsets.json"
    elif to == "isaaclab":
        text, left = isaaclab.write(chain, values, uses)
        files, main = {"actuators.py": text}, "actuators.py"
    else:
        text, left = mjcf.write(chain, values, uses, source)
        main = "robot.xml"
        files = {main: text}
        if to == "urdf":
            files, main, left = _urdf(chain, text, left)
    left = sorted(left, key=lambda item: -item.size if item.size == item.size else 1.0)
    where = "the recordings" if recordings else "nothing: no recordings were given"
    files[NOT_WRITTEN] = listed(", ".join(chain.joints), to, left, where)
    inputs = [file for file in (source, calibration) if isinstance(file, Path)]
    with atomic_output_dir(out, inputs=inputs) as folder:
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
    return ServoExported(tuple(files), main, tuple(left))


def _urdf(
    chain: ServoChain, text: str, left: Sequence[NotWritten]
) -> tuple[dict[str, str], str, list[NotWritten]]:
    """The bodies, zeros, friction and armature of the MJCF as a URDF."""
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "robot.xml"
        file.write_text(text, encoding="utf-8")
        robot = load_robot(file, any_tool=True)
        # Readings of the recordings: their zeros are in the frames, and not beside them.
        written = export(robot, "urdf", Path(name) / "urdf")
        files = {written.model.name: written.model.read_text(encoding="utf-8")}
    drives = [
        replace(one, name=one.name) for one in written.not_written if not one.name.startswith("gravity_scale")
    ]
    gains = [NotWritten(f"command_gain.{joint}", float("nan"), _NO_DRIVES) for joint in chain.joints]
    return files, written.model.name, [*left, *drives, *gains]


# ---- A folder's result -------------------------------------------------------------------------------
@dataclass(frozen=True)
class ServoResult:
    """What `truing dynamics diagnose` left in a folder when there were commands alone."""

    robot: str
    chains: Mapping[str, ServoChain]
    mjcf: str  # without drives
    held_out: tuple[str, ...]  # names of recordings
    joints: tuple[str, ...]


def is_servo_result(folder: Path) -> bool:
    """Whether a folder holds one: result.json says that it is from commands."""
    return _read(folder).get("from") == "commands"


def load_servo_result(folder: Path) -> ServoResult:
    """Raises InputError: something of it is missing."""
    read = _read(folder)
    try:
        chains = {name: ServoChain.from_dict(chain) for name, chain in read["chains"].items()}
        text = (folder / MODEL).read_text(encoding="utf-8")
        named = chains["named"]
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{folder / 'result.json'}: has no {error}: diagnose again") from None
    except OSError as error:
        raise InputError(f"{folder / MODEL}: cannot be read: {error.strerror}: diagnose again") from None
    return ServoResult(
        str(read.get("robot") or ""), chains, text, tuple(read.get("held_out", ())), named.joints
    )


def _read(folder: Path) -> Mapping[str, Any]:
    try:
        read = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return read if isinstance(read, dict) else {}
