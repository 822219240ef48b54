# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measure a simulated robot with hidden errors, or record a simulated one that sways.

Writes measurements.csv, truth.json, robot.yaml (nominal, as it came in), true_robot.yaml. With --stream:
imu.csv, tracker.csv, joints.csv, plan.csv, setup.yaml, robot.yaml, truth.csv, truth.json.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import (
    INPUTS,
    Angle,
    BaseLink,
    Choice,
    Count,
    File,
    Flag,
    Fraction,
    Kind,
    Length,
    Number,
    Parts,
    RobotFile,
    Seed,
    Speed,
    Time,
    TipLink,
    Words,
    core,
    keyword,
    refused,
)
from truing.cli.tables import mm, say, table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.model import Robot
    from truing.testing import SimulatedStreams, StreamSimulationOptions
    from truing.testing.simulation import Floats, Simulation

PANEL = "Try out"
STREAM = "With --stream"
_SIMULATE = "truing.testing.simulation:simulate"


class EffectSize(Kind):
    """ "backlash:J2=0.2mrad" as parameter name and value."""

    metavar = "EFFECT:JOINT=SIZE"

    def read(self, text: str, option: str) -> tuple[str, float]:
        place, equals, size = text.partition("=")
        words = [word.strip() for word in place.split(":")]
        if not equals or len(words) not in (1, 2, 3) or not all(words):
            raise refused(
                option,
                text,
                "effect:joint=size such as backlash:J2=0.2mrad, effect:joint:part=size, or scale=size",
            )
        for kind in (Angle(), Length()):
            with contextlib.suppress(InputError):
                return ".".join(words), kind.read(size, option)
        return ".".join(words), Number(noun="a size in SI, or with its unit", example="0.2mrad").read(
            size, option
        )


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["tuple[Robot, Floats | None]", "Simulation | SimulatedStreams"]):
    doing = "simulating"

    robot: RobotFile
    effect: Annotated[
        list[tuple[str, float]],
        EffectSize(
            "Effect of the true robot: 'backlash:J2=0.2mrad', 'harmonic:J3:cos1=1e-4'. May be repeated.",
            several=True,
        ),
    ] = ()  # type: ignore[assignment]
    poses: Annotated[int, Count("Number of random poses within the joint limits.", least=1)] = keyword(
        _SIMULATE, "poses"
    )
    plan: Annotated[
        Path | None,
        File("Measure these poses (columns q1_rad …) instead of random ones.", metavar="POSES.csv"),
    ] = None
    seed: Seed = keyword(_SIMULATE, "seed")
    noise: Annotated[float, Length("Standard deviation of each measured coordinate.", least=0)] = keyword(
        _SIMULATE, "noise"
    )
    orientation: Annotated[bool, Flag("Measure orientations as well.")] = False
    rotation_noise: Annotated[
        float, Angle("Standard deviation of measured orientations about each axis.", least=0)
    ] = keyword(_SIMULATE, "rotation_noise")
    geometry_error: Annotated[
        tuple[float, float, float],
        Parts(
            "Standard deviations of the hidden errors: of lengths, of angles, and perhaps of gear ratios.",
            metavar="LENGTH,ANGLE[,RATIO]",
            parts=(Length(least=0), Angle(least=0), Number(noun="a gear-ratio error", least=0)),
            optional=1,
            expected="a length, an angle and perhaps a gear-ratio error, such as 1mm,1mrad or 1mm,1mrad,1e-4",
        ),
    ] = keyword(_SIMULATE, "lengths", "angles", "ratios")
    perturb: Annotated[
        list[str], Words("Only these values get errors, names and globs: 'J2.*,tool.x'. Default: all.")
    ] = ()  # type: ignore[assignment]
    outliers: Annotated[
        tuple[float, float],
        Parts(
            "Gross errors: fraction of the rows, and their size: 2%:5mm. Default: none.",
            metavar="FRACTION:LENGTH",
            separator=":",
            parts=(Fraction(), Length()),
            expected="a fraction and a size, such as 2%:5mm",
        ),
    ] = ()  # type: ignore[assignment]
    columns: Annotated[
        list[str],
        Words(f"More recorded inputs, of {','.join(INPUTS)}.", known=INPUTS, metavar="COLUMNS"),
    ] = ()  # type: ignore[assignment]
    base_unknown: Annotated[bool, Flag("Put the robot somewhere unknown in the measurement frame.")] = False
    stream: Annotated[
        bool,
        Flag(
            "Record the swaying arm instead: inertial sensor, tracker, joints, plan. Of the options above,"
            " --seed alone counts.",
            panel=STREAM,
        ),
    ] = False
    seconds: Annotated[float, Time("Length of the recording.", above=0, panel=STREAM)] = core(
        "StreamSimulationOptions", "seconds"
    )
    motion: Annotated[
        Literal["still", "gentle", "stop-and-go"],
        Choice("Gusts only, slow waves of all joints, or moves with rests.", panel=STREAM),
    ] = core("StreamSimulationOptions", "motion")
    tip_speed: Annotated[float, Speed("Rms speed of the tip; in stop-and-go its highest.", panel=STREAM)] = (
        core("StreamSimulationOptions", "tip_speed")
    )
    clock_offset: Annotated[
        float, Time("Offset of the tracker's clock, which setup.yaml does not know.", panel=STREAM)
    ] = core("StreamSimulationOptions", "tracker.clock_offset")
    dropout: Annotated[
        list[tuple[float, float]],
        Parts(
            "The tracker is away from a time on, for a time: 20s:2s. May be repeated.",
            metavar="TIME:TIME",
            separator=":",
            parts=(Time(), Time()),
            expected="a time and how long, such as 20s:2s",
            several=True,
            panel=STREAM,
        ),
    ] = ()  # type: ignore[assignment]
    station_shift: Annotated[
        tuple[float, float, float],
        Parts(
            "From a time on the tracker frame is moved and turned: 30s:5mm:0.1deg.",
            metavar="TIME:LENGTH:ANGLE",
            separator=":",
            parts=(Time(), Length(), Angle()),
            expected="a time, a length and an angle, such as 30s:5mm:0.1deg",
            panel=STREAM,
        ),
    ] = ()  # type: ignore[assignment]
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> tuple[Robot, Floats | None]:
        from truing.cli.reading import load_robot
        from truing.files import load_measurements

        robot = load_robot(self.robot, self.base_link, self.tip_link)
        if self.stream or self.plan is None:
            return robot, None
        return robot, load_measurements(self.plan, robot, joints_only=True).joints

    def solve(
        self, loaded: tuple[Robot, Floats | None], progress: run.Progress
    ) -> Simulation | SimulatedStreams:
        from truing.testing.simulation import simulate
        from truing.testing.streams import simulate_streams

        robot, joints = loaded
        if self.stream:
            return simulate_streams(robot, self._stream_options())
        lengths, angles, ratios = self.geometry_error
        outlier_share, outlier_length = self.outliers or (0.0, 0.0)
        return simulate(
            robot,
            joints=joints,
            poses=self.poses,
            effects=dict(self.effect),
            noise=self.noise,
            lengths=lengths,
            angles=angles,
            ratios=ratios,
            only=self.perturb,
            orientation=self.orientation,
            rotation_noise=self.rotation_noise,
            outlier_share=outlier_share,
            outlier_length=outlier_length,
            columns=self.columns,
            base_unknown=self.base_unknown,
            seed=self.seed,
        )

    def _stream_options(self) -> StreamSimulationOptions:
        from truing.model import frame_from_xyz_rpy
        from truing.testing import StreamSimulationOptions, TrackerErrors

        shifts = []
        if self.station_shift:
            start, length, angle = self.station_shift
            shifts.append((start, frame_from_xyz_rpy([length, 0.0, 0.0], [0.0, 0.0, angle])))
        return StreamSimulationOptions(
            seconds=self.seconds,
            motion=self.motion,
            tip_speed=self.tip_speed,
            tracker=TrackerErrors(clock_offset=self.clock_offset),
            dropouts=list(self.dropout),
            shifts=shifts,
            seed=self.seed,
        )

    def write(
        self,
        folder: Path,
        loaded: tuple[Robot, Floats | None],
        found: Simulation | SimulatedStreams,
        warnings: list[str],
    ) -> Mapping[str, Any]:
        from truing.files import load_units, save_measurements, save_robot
        from truing.report.json_text import to_json
        from truing.testing.simulation import Simulation
        from truing.testing.streams import write_simulation

        robot, units = loaded[0], load_units(self.robot)
        save_robot(folder / "robot.yaml", robot, units=units)
        if not isinstance(found, Simulation):
            return write_simulation(folder, robot, found, self._stream_options())
        truth = found.to_dict()
        save_measurements(folder / "measurements.csv", found.data, robot)
        (folder / "truth.json").write_text(to_json(truth), encoding="utf-8")
        save_robot(folder / "true_robot.yaml", found.truth.robot, units=units)
        return truth

    def table(self, result: Mapping[str, Any], found: Simulation | SimulatedStreams) -> None:
        from truing.testing.simulation import Simulation

        if isinstance(found, Simulation):
            self._measurements_table(found)
        else:
            self._recording_table(result, found)

    def _measurements_table(self, found: Simulation) -> None:
        lines = [
            ("rows", str(found.data.rows)),
            ("noise per axis", mm(self.noise)),
            ("outliers", str(len(found.outlier_rows))),
            ("hidden errors", str(len(found.truth.parameters))),
        ]
        lines += [(f"  {e.parameter}", f"{e.value:.4g}") for e in found.truth.effects]
        table(f"{found.truth.robot.name}: simulated measurements", ("", ""), lines)
        say(str(self.out / "measurements.csv"))

    def _recording_table(self, truth: Mapping[str, Any], found: SimulatedStreams) -> None:
        lines = [(f"{name} samples", str(count)) for name, count in truth["samples"].items()]
        lines += [("modes", ", ".join(f"{mode['frequency_hz']:.3g} Hz" for mode in truth["modes"]))]
        table(f"{truth['robot']}: simulated recording of {truth['seconds']:g} s", ("", ""), lines)
        options = [
            f"--{name} {self.out / name}.csv" for name in ("imu", "tracker", "joints", "plan", "truth")
        ]
        say(
            f"truing track run {self.out / 'robot.yaml'} --setup {self.out / 'setup.yaml'}"
            f" {' '.join(options)}"
        )
