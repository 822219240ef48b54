# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say what a robot file holds, a controller's above all, and write it as a robot.yaml.

Reads robot.yaml, URDF, MJCF, calibration.conf and .urp of Universal Robots, MOC.cfg of ABB, LeRobot's
calibration. Of several files it says how far their robots are apart; what is written is the first one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from truing.cli.options import OUTPUT, BaseLink, File, Flag, Kind, TipLink
from truing.cli.tables import mm, say, table, warn

if TYPE_CHECKING:
    from truing.files import ControllerModel

PANEL = "Calibrate"


@dataclass(frozen=True, kw_only=True)
class Command:
    folder: ClassVar[str] = "controller.yaml"

    files: Annotated[
        Sequence[Path],
        File("Robot files, of one arm.", argument=True, metavar="FILE", several=True),
    ]
    arm: Annotated[
        str,
        Kind("Arm that a controller's file is of: a data sheet (ur10e), or a robot file.", metavar="NAME"),
    ] = ""
    base_link: BaseLink = ""
    tip_link: TipLink = ""
    out: Annotated[Path, File("File to write.", flag="--out", metavar="ROBOT.yaml", panel=OUTPUT)]
    json: Annotated[bool, Flag("Print what was understood as JSON.", panel=OUTPUT)] = False

    def run(self) -> int:
        from truing.errors import InputError
        from truing.files import is_controller, save_robot
        from truing.files.output import files_read, is_one_of

        if self.arm and not any(is_controller(str(file)) for file in self.files):
            raise InputError(
                f"--arm {self.arm}: names the arm of a controller's file, and none of these is one"
            )
        with files_read() as read:
            models = [self._load(str(file)) for file in self.files]
        apart = [_apart(models[0], model) for model in models[1:]]
        if is_one_of(self.out, read):
            raise InputError(f"{self.out}: is an input of this run: write to another file (--out)")
        save_robot(self.out, models[0].robot, calibration=models[0].calibration)
        if self.json:
            _print_json(models, apart)
            return 0
        for file, model in zip(self.files, models, strict=True):
            _print(file.name, model)
        for file, distance in zip(self.files[1:], apart, strict=True):
            say(f"flange of {file.name} is up to {mm(distance)} away from that of {self.files[0].name}")
        say(f"robot: {self.out}")
        return 0

    def _load(self, file: str) -> ControllerModel:
        from truing.files import any_robot

        return any_robot(file, self.arm, self.base_link, self.tip_link)


def _apart(one: ControllerModel, other: ControllerModel) -> float:
    """The largest distance between the flanges of two robots over the same poses [m]."""
    import numpy as np

    from truing.errors import InputError
    from truing.files import last_to_flange
    from truing.model import flange_poses

    count = one.robot.driven_count
    if other.robot.driven_count != count:
        raise InputError(
            f"{other.robot.name}: has {other.robot.driven_count} joints, {one.robot.name} has {count}: these"
            " are not files of one arm"
        )
    q = np.random.default_rng(count).uniform(-1.5, 1.5, (200, count))
    first, second = (flange_poses(m.robot, q) @ last_to_flange(m.robot) for m in (one, other))
    return float(np.linalg.norm(first[:, :3, 3] - second[:, :3, 3], axis=1).max())


def _print(name: str, model: ControllerModel) -> None:
    table(f"{name}: {model.kind}", ("", ""), model.understood, words=True)
    table("robot", ("joint", "type", "link", "limits"), _joint_lines(model.robot), words=True)
    for text in model.not_understood:
        say(f"not understood: {text}")
    warn(model.warnings)


def _joint_lines(robot: Any) -> list[tuple[str, str, str, str]]:
    import math

    lines = []
    for joint in robot.joints:
        if robot.convention == "urdf":
            link = "at " + ", ".join(f"{1e3 * x:.3f}" for x in joint.T_parent_joint[:3, 3]) + " mm"
        else:
            angles = f"theta {math.degrees(joint.theta):.5f}, alpha {math.degrees(joint.alpha):.5f}"
            beta = f", beta {math.degrees(joint.beta):.5f}" if joint.beta else ""
            link = f"d {1e3 * joint.d:.4f}, a {1e3 * joint.a:.4f} mm, {angles}{beta} deg"
        unit, scale = ("deg", 180 / math.pi) if joint.type == "revolute" else ("mm", 1e3)
        limits = f"{scale * joint.lower:.1f} to {scale * joint.upper:.1f} {unit}"
        lines.append((joint.name, joint.type, link, limits))
    return lines


def _print_json(models: Sequence[ControllerModel], apart: Sequence[float]) -> None:
    import sys

    from truing.report.json_text import to_json

    files = [
        {
            "kind": model.kind,
            "arm": model.arm,
            "understood": [{"what": what, "value": value} for what, value in model.understood],
            "warnings": list(model.warnings),
            "not_understood": list(model.not_understood),
            "calibration": dict(model.calibration),
        }
        for model in models
    ]
    sys.stdout.write(to_json({"format": "truing-load/1", "files": files, "apart_m": list(apart)}))
