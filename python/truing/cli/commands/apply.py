# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Write robot programs anew, so that the real robot reaches the targets that they name.

Reads KUKA (.src with .dat), ABB (.mod), FANUC (.ls), Universal Robots (.script) and Yaskawa (.jbi). Writes
renamed copies in which numbers of literal targets are changed and nothing else, result.json, report.html.
Exit status 1 if anything that is a target stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import (
    Angle,
    BaseLink,
    Choice,
    File,
    Kind,
    Mass,
    Number,
    TipLink,
    read_with_common_units,
    words_of,
)
from truing.cli.tables import mm, mrad, say, say_first, statistics, table, warn
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.model import Robot
    from truing.programs import ApplyOptions, Outcome

PANEL = "Inverse kinematics"
CELL = "What the programs do not say"
_LISTED = 12


@dataclass(frozen=True)
class Loaded:
    nominal: Robot
    real: Robot
    options: ApplyOptions


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "Outcome"]):
    doing = "compensating"

    programs: Annotated[
        list[Path],
        File(
            "Programs of one robot: .src (its .dat is found), .mod, .ls, .script, .jbi.",
            argument=True,
            metavar="PROGRAM",
            several=True,
        ),
    ]
    nominal: Annotated[
        Path,
        File(
            "Robot as its controller believes it to be; its flange is the controller's, of a URDF its tip"
            " link.",
            metavar="ROBOT",
        ),
    ]
    real: Annotated[Path, File("Robot as `truing identify` or `diagnose` found it.", metavar="ROBOT")]
    tool: Annotated[
        list[str],
        Kind(
            "A tool, in the maker's own notation and units: 1=0,0,120,0,0,0 (FANUC's UT, KUKA's TOOL_DATA,"
            " Yaskawa's TOOL), tGripper=x,y,z,q1,q2,q3,q4, or without a name any that is not known. May"
            " be repeated.",
            metavar="NAME=NUMBERS",
            panel=CELL,
            several=True,
        ),
    ] = ()  # type: ignore[assignment]
    frame: Annotated[
        list[str],
        Kind(
            "A frame in the robot base, likewise: FANUC's UF, KUKA's BASE_DATA, ABB's wobjdata, Yaskawa's"
            " USER.",
            metavar="NAME=NUMBERS",
            panel=CELL,
            several=True,
        ),
    ] = ()  # type: ignore[assignment]
    seed: Annotated[
        str,
        Kind(
            "Joints before the first move, as the model has them: 0,-90,90,0,90,0deg.",
            metavar="JOINTS",
            panel=CELL,
        ),
    ] = ""
    pulses: Annotated[
        str,
        Kind(
            "Pulses per degree of a Yaskawa's six joints, sign included: 1908,1592.9,…",
            metavar="NUMBERS",
            panel=CELL,
        ),
    ] = ""
    fanuc_j3: Annotated[
        Any,
        Choice(
            "How FANUC's J3 counts against the model's: horizon (model J3 = J2 + J3, as the pendant shows"
            " it) or"
            " lower-arm (the same). Default: horizon, unless the model has a passive joint that J2 drives.",
            {"horizon": True, "lower-arm": False},
            panel=CELL,
        ),
    ] = None
    payload: Annotated[
        float, Mass("Payload at the tool, for effects that depend on it.", least=0, panel=CELL)
    ] = 0.0
    temperature: Annotated[
        float | None,
        Number(
            "Temperature in degrees Celsius, for effects that depend on it.",
            noun="a temperature",
            example="31.5",
            panel=CELL,
        ),
    ] = None
    poses_out: Annotated[
        Path | None,
        File(
            "Write the programs' poses and joints as a table as well (.csv, .parquet).",
            metavar="FILE",
            panel="Output",
        ),
    ] = None
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def inputs(self) -> list[Path]:
        return [*self.programs, self.nominal, self.real]

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files.programs import Given, brand_of, parse_place
        from truing.programs import ApplyOptions

        brand = brand_of(self.programs[0])
        nominal = load_robot(self.nominal, self.base_link, self.tip_link)
        is_urdf = self.real.suffix.lower() in (".urdf", ".xml")
        real = load_robot(self.real, *((self.base_link, self.tip_link) if is_urdf else ()))
        given = Given(
            dict(parse_place(text, brand, "--tool") for text in self.tool or ()),
            dict(parse_place(text, brand, "--frame") for text in self.frame or ()),
            self._pulses(),
        )
        options = ApplyOptions(given, self._seed(nominal), self.payload, self.temperature, self.fanuc_j3)
        return Loaded(nominal, real, options)

    def _pulses(self) -> tuple[float, ...] | None:
        if not self.pulses:
            return None
        number = Number(noun="six numbers other than 0", example="1908,1592.9,1022.9,980.2,454.8,400")
        values = tuple(number.read(word, "--pulses") for word in words_of(self.pulses))
        if len(values) != 6 or not all(values):
            raise InputError(f"--pulses: found {self.pulses!r}, expected six numbers other than 0")
        return values

    def _seed(self, robot: Robot) -> Any:
        import numpy as np

        if not self.seed:
            return None
        words = words_of(self.seed)
        if len(words) != robot.driven_count:
            raise InputError(f"--seed: found {len(words)} joints, the robot has {robot.driven_count}")
        return np.array(read_with_common_units(words, [Angle()] * len(words), ["--seed"] * len(words)))

    def solve(self, loaded: Loaded, progress: run.Progress) -> Outcome:
        from truing.programs import apply_programs

        found = apply_programs(self.programs, loaded.nominal, loaded.real, loaded.options)
        warn([f"nothing is written for {one.message}" for one in found.refused])
        return found

    def write(self, folder: Path, loaded: Loaded, found: Outcome, warnings: list[str]) -> Mapping[str, Any]:
        from truing.programs.result import AppliedPrograms, write_poses, write_programs

        made = AppliedPrograms(found, loaded.nominal, loaded.real)
        result = write_programs(folder, made, warnings=warnings)
        if self.poses_out is not None:
            inside = self.poses_out.parent.absolute() == self.out.absolute()
            write_poses(folder / self.poses_out.name if inside else self.poses_out, made)
        return result

    def table(self, result: Mapping[str, Any], found: Outcome) -> None:
        lines = [
            (one["written"], str(one["changed"]), str(one["same"]), str(one["stayed"]))
            for one in result["files"]
        ]
        table("programs", ("", "changed", "same digits", "stayed"), lines)
        if result["before"]["mean_m"] is not None:
            errors = [
                ("error as it was, by the model", *statistics(result["before"])),
                ("error with the new numbers", *statistics(result["after"])),
                ("targets are moved by", *statistics(result["moved"])),
            ]
            table("targets", ("", "mean", "95 %", "maximum"), errors)
            digits = result["printed_digits"]
            say(f"printed digits leave up to {mm(digits['max_m'])} and {mrad(digits['rotation_max_rad'])}")
        stayed = [
            f"{one['file']}, line {one['line']}: {one['what']}: {one['why']}" for one in result["stayed"]
        ]
        if stayed:
            say("left as it is:")
        say_first(stayed, _LISTED, "more: see the report")
        if self.poses_out is not None:
            say(f"poses: {self.poses_out}")

    def failure(self, result: Mapping[str, Any]) -> str:
        if result["refused"]:
            return f"nothing is written for {len(result['refused'])} of the programs"
        left = len(result["stayed"])
        return f"{left} {'place' if left == 1 else 'places'} stayed as they are" if left else ""
