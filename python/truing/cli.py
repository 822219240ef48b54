# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command reads, lets the core work, and writes all of its files at once or none.

Exit status: 0 done (a diagnosis that finds nothing, or something unknown, is an answer too), 1 did not
converge, 2 bad input (one line on stderr, nothing written), 130 interrupted.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import os
import re
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional, TypeVar

import numpy as np
import typer

from truing.errors import InputError, InputWarning

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rich.console import Console

    from truing import Joint, Measurements, Robot
    from truing.files import HandEyeData, TargetData
    from truing.hand_eye import ClockOffset, HandEyePoses
    from truing.inverse_kinematics import InverseSolver, Solution, Task
    from truing.inverse_kinematics.result import Solved

Result = TypeVar("Result")

_HELP = "Find how a real robot differs from its model, name the cause, and remove it."
app = typer.Typer(
    name="truing", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=_HELP
)
_track = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Say where the tool of a swaying arm will be, and what to add to the plan.",
)
app.add_typer(_track, name="track")

# Of a click error: in which package click lives is typer's business.
_ClickException: type[Exception] = typer.BadParameter.__mro__[2]

# ---- Arguments that commands share
# -------------------------------------------------------------------------------------

RobotFile = Annotated[
    Path, typer.Argument(metavar="ROBOT", help="Robot file: robot.yaml or URDF.", show_default=False)
]
DataFile = Annotated[
    Path,
    typer.Argument(
        metavar="DATA", help="Measurements: CSV or Parquet, one row per measured pose.", show_default=False
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print result.json instead of a table.")]
Seed = Annotated[
    int, typer.Option(help="Of every random choice; the same seed gives the same result.", min=0)
]
Free = Annotated[
    str,
    typer.Option(
        help=(
            "Parameters to find, names and globs: 'J2.*,*.ratio,tool.x'. Default: all geometry, base and"
            " targets."
        ),
        show_default=False,
    ),
]
Effects = Annotated[
    str,
    typer.Option(
        help="Effects to find as well: 'backlash,harmonic:J2+J3'. `truing effects` lists them.",
        show_default=False,
    ),
]
BaseLink = Annotated[str, typer.Option(help="First link of the chain, for a URDF.", show_default=False)]
TipLink = Annotated[str, typer.Option(help="Last link of the chain, for a URDF.", show_default=False)]
Noise = Annotated[str, typer.Option(help="Standard deviation of each measured coordinate.")]


def _out(command: str) -> Any:
    return typer.Option("--out", help=f"Folder to write to. Default: ./truing-{command}", show_default=False)


class SolverName(str, Enum):
    """--solver"""

    lm = "lm"
    ceres = "ceres"


class LossName(str, Enum):
    """--loss"""

    reject = "reject"
    none = "none"
    huber = "huber"
    cauchy = "cauchy"
    tukey = "tukey"


class FrameName(str, Enum):
    """--frame"""

    parameters = "parameters"
    svd = "svd"


class RecordName(str, Enum):
    """--record"""

    q = "q"
    qr = "qr"


class SetupName(str, Enum):
    """--setup"""

    eye_in_hand = "eye-in-hand"
    eye_to_hand = "eye-to-hand"


class MethodName(str, Enum):
    """--method"""

    refined = "refined"
    closed_form = "closed-form"


class TaskName(str, Enum):
    """--task"""

    pose = "pose"
    torch = "torch"
    point = "point"


class FreeAxis(str, Enum):
    """--free-axis"""

    none = "none"
    x = "x"
    y = "y"
    z = "z"


class ChooseName(str, Enum):
    """--choose"""

    nearest = "nearest"
    limits_margin = "limits_margin"
    manipulability = "manipulability"
    rail_travel = "rail_travel"


class MotionName(str, Enum):
    """--motion"""

    still = "still"
    gentle = "gentle"
    stop_and_go = "stop-and-go"


class ExamSet(str, Enum):
    """--set"""

    development = "development"
    examination = "examination"


class IndexName(str, Enum):
    """--index"""

    d = "d"
    a = "a"
    e = "e"
    inverse_condition = "inverse-condition"
    noise_amplification = "noise-amplification"


TargetsFile = Annotated[
    Path,
    typer.Argument(
        metavar="TARGETS",
        help="CSV or Parquet, one row per target: x_m y_m z_m qw qx qy qz, and what is optional.",
        show_default=False,
    ),
]
TaskKind = Annotated[
    Optional[TaskName],
    typer.Option(
        help=(
            "What is wanted: position and orientation, position and the tool's axis (roll about it free), or"
            " position alone. Default: pose."
        ),
        show_default=False,
    ),
]
AxisOption = Annotated[
    Optional[FreeAxis],
    typer.Option(
        help="Axis of the tool about which its roll is free; means --task torch. none: a full pose.",
        show_default=False,
    ),
]
SeedJoints = Annotated[
    str,
    typer.Option(
        "--seed",
        metavar="JOINTS",
        help=(
            "Where the robot comes from: 0,-90,90,0,90,0deg, or a CSV with q1_rad … (one row, or one per"
            " target). Default: columns q1_rad … of TARGETS, or the middle of the joints' ranges."
        ),
        show_default=False,
    ),
]
ChooseOption = Annotated[
    ChooseName,
    typer.Option(
        help=(
            "Which of several answers: nearest to the seed, furthest from the limits, furthest from singular,"
            " least way on the rails."
        )
    ),
]
SceneFile = Annotated[
    Optional[Path],
    typer.Option("--scene", help="scene.yaml: what the robot must not touch.", show_default=False),
]
Retreat = Annotated[
    str,
    typer.Option(
        help=(
            "Where everything interferes, move the target back along the tool's z by no more than this: 50mm."
        ),
        show_default=False,
    ),
]
TargetName = Annotated[
    str,
    typer.Option(
        "--target",
        help="Which of the robot's targets is brought there. Default: the tool.",
        show_default=False,
    ),
]
Threads = Annotated[int, typer.Option(help="0: as many as the machine has.", min=0)]


# ---- Quantities
# --------------------------------------------------------------------------------------------------------

_UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
    "angle": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "µrad": 1e-6, "deg": math.pi / 180, "°": math.pi / 180},
    "mass": {"kg": 1.0, "g": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "pixel": {"px": 1.0},
}
_EXAMPLES = {"length": "0.03mm", "angle": "15deg", "mass": "5kg", "time": "40ms", "pixel": "0.2px"}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\s\d]*)\s*")


def quantity(text: str, kind: str, option: str) -> float:
    """`text` ("0.03mm", "15deg", "40ms", "0.2px") in SI. `kind`: length, angle, mass, time or pixel. Raises
    InputError that names `option`.
    """
    match = _QUANTITY.fullmatch(text)
    units = _UNITS[kind]
    value = float(match[1]) if match else math.nan
    if match and match[2] in units and math.isfinite(value):
        return value * units[match[2]]
    if match and not match[2] and value == 0:
        return 0.0
    article = "an" if kind == "angle" else "a"
    raise InputError(
        f"{option}: found {text!r}, expected {article} {kind} with its unit"
        f" ({', '.join(unit for unit in units if unit.isascii())}), such as {_EXAMPLES[kind]}"
    )


def share(text: str, option: str) -> float:
    """`text` ("2%" or "0.02") as a share of 1. Raises InputError that names `option`."""
    try:
        value = float(text.strip().removesuffix("%")) * (0.01 if text.strip().endswith("%") else 1.0)
    except ValueError:
        value = math.nan
    if not 0 <= value < 1:
        raise InputError(f"{option}: found {text!r}, expected a share such as 2% or 0.02")
    return value


# ---- Commands
# ----------------------------------------------------------------------------------------------------------


def _print_version(wanted: bool) -> None:
    if wanted:
        import truing

        typer.echo(f"truing {truing.__version__}")
        raise typer.Exit


@app.callback(help=_HELP)
def _common(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version),
    ] = False,
) -> None:
    """Options of truing itself."""


@app.command()
def identify(
    robot: RobotFile,
    data: DataFile,
    out: Annotated[Optional[Path], _out("identify")] = None,
    free: Free = "",
    hold: Annotated[str, typer.Option(help="Names and globs that stay at nominal, e.g. 'base.*,J6.*'.")] = "",
    effects: Effects = "",
    loss: Annotated[
        LossName,
        typer.Option(help="What to do about outliers: find and leave them out, or weigh errors down."),
    ] = LossName.reject,
    solver: Annotated[
        SolverName, typer.Option(help="Levenberg-Marquardt of the palletizer method, or Ceres.")
    ] = SolverName.lm,
    frame: Annotated[
        FrameName,
        typer.Option(help="Measurement frame: six more parameters, or registered after every step."),
    ] = FrameName.parameters,
    test_share: Annotated[
        str, typer.Option(help="Share of the poses held out, when the data has no `set` column.")
    ] = "20%",
    seed: Seed = 0,
    rotation_length: Annotated[
        str, typer.Option(help="A rotation error of 1 rad counts as this length.")
    ] = "0.1m",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    threads: Annotated[int, typer.Option(help="0: as many as the machine has.", min=0)] = 0,
    json: Json = False,
) -> None:
    """Find the robot's parameters from measurements.

    Writes result.json, report.html, robot.yaml (calibrated), covariance.csv, residuals.csv.
    """
    from truing.files import atomic_output_dir

    folder = out or Path("truing-identify")
    held_out, length = (
        share(test_share, "--test-share"),
        quantity(rotation_length, "length", "--rotation-length"),
    )
    with _warnings_heard() as heard:
        model, table = _load(robot, data, base_link, tip_link)

        def work() -> Any:
            import truing

            return truing.identify(
                model,
                table,
                free=free,
                hold=hold,
                effects=effects,
                solver=solver.value,
                loss=loss.value,
                frame_by=frame.value,
                rotation_length=length,
                test_share=held_out,
                seed=seed,
                threads=threads,
                raise_if_not_converged=False,
            )

        found = _busy("identifying", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.identification.result import write_identification

            result = write_identification(
                temporary,
                found,
                table,
                seed=seed,
                source=data.name,
                warnings=heard,
                nominal_file=robot,
                base_link=base_link,
                tip_link=tip_link,
            )
    _warn(found.warnings)
    if json:
        _print_json(result)
    else:
        identification_table(result, folder)
    if not found.solver.converged:
        _err().print(
            f"truing: did not converge: {found.solver.stopped_because}",
            style="bold red",
            markup=False,
            highlight=False,
        )
        raise typer.Exit(1)


@app.command()
def diagnose(
    robot: RobotFile,
    data: DataFile,
    out: Annotated[Optional[Path], _out("diagnose")] = None,
    leave_out: Annotated[
        str,
        typer.Option(
            help="Effects that are not to be considered: 'drift,scale'. `truing effects` lists them.",
            show_default=False,
        ),
    ] = "",
    false_alarm: Annotated[
        str, typer.Option(help="Chance that a robot without any gap is said to have one.")
    ] = "1%",
    record: Annotated[
        RecordName,
        typer.Option(
            help=(
                "qr: go by the second record of the joints (qr1_rad …). Else by the one that explains the"
                " measurements better."
            )
        ),
    ] = RecordName.q,
    seed: Seed = 0,
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    threads: Annotated[int, typer.Option(help="0: as many as the machine has.", min=0)] = 0,
    json: Json = False,
) -> None:
    """Say where the gap between robot and model comes from, and how far it can be closed.

    Writes result.json, report.html, robot.yaml (with what was named), residuals.csv, and next_poses.csv if
    more should be measured.
    """
    from truing.files import atomic_output_dir

    folder = out or Path("truing-diagnose")
    alarm = share(false_alarm, "--false-alarm")
    with _warnings_heard() as heard:
        model, table = _load(robot, data, base_link, tip_link)
        if record is RecordName.qr:
            from truing.diagnosis.result import with_second_record

            table = with_second_record(model, table)

        def work() -> Any:
            import truing

            return truing.diagnose(
                model, table, leave_out=leave_out, false_alarm=alarm, seed=seed, threads=threads
            )

        found = _busy("diagnosing", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.diagnosis.result import write_diagnosis

            result = write_diagnosis(
                temporary,
                found,
                table,
                source=data.name,
                warnings=heard,
                nominal_file=robot,
                base_link=base_link,
                tip_link=tip_link,
            )
        if not found.next_poses:  # those of an earlier run would be taken for this one's
            (folder / "next_poses.csv").unlink(missing_ok=True)
    _warn(found.warnings)
    if json:
        _print_json(result)
    else:
        diagnosis_table(result, folder)


@app.command()
def predict(
    robot: RobotFile,
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA",
            help="Rows of joints and inputs (CSV or Parquet), measured or not.",
            show_default=False,
        ),
    ],
    out: Annotated[Optional[Path], _out("predict")] = None,
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Say where the robot will be, row by row.

    Writes predicted.csv (one row per data row), result.json, report.html.
    """
    from truing.files import atomic_output_dir, write_table

    folder = out or Path("truing-predict")
    with _warnings_heard() as heard:
        model, table = _load(robot, data, base_link, tip_link, joints_only=True)

        def work() -> tuple[dict[str, Any], Any, dict[str, Any]]:
            import truing
            from truing.identification.result import predicted_rows, prediction_columns, prediction_dict
            from truing.report.json_text import without_nan

            predicted = truing.predict(model, table)
            columns = prediction_columns(model, table, predicted)
            rows = predicted_rows(model, table, predicted)
            return columns, rows, without_nan(prediction_dict(model, rows, heard))

        columns, rows, result = _busy("predicting", work)
        with atomic_output_dir(folder) as temporary:
            from truing.identification.page import prediction_report
            from truing.report.json_text import to_json

            write_table(temporary / "predicted.csv", columns)
            (temporary / "result.json").write_text(to_json(result), encoding="utf-8")
            (temporary / "report.html").write_text(prediction_report(result, rows), encoding="utf-8")
    if json:
        _print_json(result)
        return
    errors = result.get("errors")
    lines = [("rows predicted", str(result["rows"]))]
    if errors:
        lines += [
            (f"measured error, {name}", _mm(errors[key]))
            for name, key in (("mean", "mean_m"), ("rms", "rms_m"), ("95 %", "p95_m"), ("worst", "max_m"))
        ]
    _table(f"{result['robot']}: prediction", ("", ""), lines)
    _last_line(folder)


@app.command()
def simulate(
    robot: RobotFile,
    out: Annotated[Optional[Path], _out("simulate")] = None,
    effect: Annotated[
        Optional[list[str]],
        typer.Option(
            help="Effect of the true robot, 'backlash:J2=0.2mrad', 'harmonic:J3:cos1=1e-4'; may be repeated.",
            show_default=False,
        ),
    ] = None,
    poses: Annotated[int, typer.Option(help="Number of random poses within the joint limits.", min=1)] = 200,
    seed: Seed = 0,
    noise: Noise = "0.03mm",
    geometry_error: Annotated[
        str,
        typer.Option(
            help=(
                "Standard deviations of the hidden errors: of lengths, of angles, and (optional) of gear"
                " ratios."
            )
        ),
    ] = "1mm,1mrad",
    perturb: Annotated[
        str,
        typer.Option(help="Only these values get errors, names and globs. Default: all.", show_default=False),
    ] = "",
    outliers: Annotated[
        str,
        typer.Option(help="Gross errors: share of the rows and size, such as 2%:5mm.", show_default=False),
    ] = "",
    columns: Annotated[
        str, typer.Option(help="More recorded inputs: dir,payload,temp,t.", show_default=False)
    ] = "",
    orientation: Annotated[bool, typer.Option("--orientation", help="Measure orientations as well.")] = False,
    rotation_noise: Annotated[
        str, typer.Option(help="Standard deviation of measured orientations about each axis.")
    ] = "0.1mrad",
    plan: Annotated[
        Optional[Path],
        typer.Option(
            metavar="POSES.csv", help="Measure these poses (columns q1_rad …) instead.", show_default=False
        ),
    ] = None,
    base_unknown: Annotated[
        bool, typer.Option("--base-unknown", help="Put the robot somewhere unknown in the measurement frame.")
    ] = False,
    stream: Annotated[
        bool,
        typer.Option(
            "--stream",
            help=(
                "A recording of the swaying arm instead: inertial sensor, tracker, joints, plan. The options"
                " below are about it, those above are not."
            ),
        ),
    ] = False,
    seconds: Annotated[str, typer.Option(help="With --stream: how long.")] = "60s",
    motion: Annotated[
        MotionName,
        typer.Option(help="With --stream: slow waves of all joints, moves with rests, or gusts only."),
    ] = MotionName.gentle,
    tip_speed: Annotated[
        str, typer.Option(help="With --stream: rms speed of the tip, its highest in stop-and-go.")
    ] = "0.3m/s",
    clock_offset: Annotated[
        str, typer.Option(help="With --stream: of the tracker's clock; setup.yaml does not know it.")
    ] = "0ms",
    dropout: Annotated[
        Optional[list[str]],
        typer.Option(
            help="With --stream: the tracker is away from a time on, 20s:2s; may be repeated.",
            show_default=False,
        ),
    ] = None,
    station_shift: Annotated[
        str,
        typer.Option(
            help="With --stream: from a time on the tracker frame is another, 30s:5mm:0.1deg.",
            show_default=False,
        ),
    ] = "",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Measure a simulated robot with hidden errors; or record one that sways.

    Writes measurements.csv, truth.json, robot.yaml (nominal, as it came in), true_robot.yaml. With --stream:
    imu.csv, tracker.csv, joints.csv, plan.csv, setup.yaml, robot.yaml, truth.csv, truth.json.
    """
    from truing.files import (
        atomic_output_dir,
        load_measurements,
        load_robot,
        load_units,
        save_measurements,
        save_robot,
    )

    folder = out or Path("truing-simulate")
    if stream:
        _simulate_stream(
            robot,
            folder,
            _stream_options(seconds, motion, tip_speed, clock_offset, dropout or (), station_shift, seed),
            base_link,
            tip_link,
            json,
        )
        return
    sizes = _geometry_error(geometry_error)
    outlier_share, outlier_length = _outliers(outliers)
    sigma, rotation_sigma = (
        quantity(noise, "length", "--noise"),
        quantity(rotation_noise, "angle", "--rotation-noise"),
    )
    effects = dict(_simulated_effect(text) for text in effect or ())
    with _warnings_heard():
        model = load_robot(robot, base_link, tip_link)
        joints = None if plan is None else load_measurements(plan, model, joints_only=True).joints

        def work() -> Any:
            from truing.testing.simulation import simulate as run

            return run(
                model,
                joints=joints,
                poses=poses,
                effects=effects,
                noise=sigma,
                lengths=sizes[0],
                angles=sizes[1],
                ratios=sizes[2],
                only=_words(perturb),
                orientation=orientation,
                rotation_noise=rotation_sigma,
                outlier_share=outlier_share,
                outlier_length=outlier_length,
                columns=_words(columns),
                base_unknown=base_unknown,
                seed=seed,
            )

        simulated = _busy("simulating", work)
        with atomic_output_dir(folder) as temporary:
            from truing.report.json_text import to_json

            truth = simulated.to_dict()
            units = load_units(robot)
            save_measurements(temporary / "measurements.csv", simulated.data, model)
            (temporary / "truth.json").write_text(to_json(truth), encoding="utf-8")
            save_robot(temporary / "robot.yaml", model, units=units)
            save_robot(temporary / "true_robot.yaml", simulated.truth.robot, units=units)
    if json:
        _print_json(truth)
        return
    lines = [
        ("rows", str(simulated.data.rows)),
        ("noise per axis", _mm(sigma)),
        ("outliers", str(len(simulated.outlier_rows))),
        ("hidden errors", str(len(simulated.truth.parameters))),
    ]
    lines += [(f"  {e.parameter}", f"{e.value:.4g}") for e in simulated.truth.effects]
    _table(f"{model.name}: simulated measurements", ("", ""), lines)
    _say(str(folder / "measurements.csv"))


def _stream_options(
    seconds: str,
    motion: MotionName,
    tip_speed: str,
    clock_offset: str,
    dropout: Sequence[str],
    station_shift: str,
    seed: int,
) -> Any:
    import truing

    speed = quantity(tip_speed.strip().removesuffix("/s"), "length", "--tip-speed")
    shifts = []
    if station_shift:
        parts = station_shift.split(":")
        if len(parts) != 3:
            raise InputError(
                f"--station-shift: found {station_shift!r}, expected a time, a length and an angle, such as"
                " 30s:5mm:0.1deg"
            )
        start, length, angle = (
            quantity(part, kind, "--station-shift")
            for part, kind in zip(parts, ("time", "length", "angle"), strict=True)
        )
        shifts.append((start, truing.frame_from_xyz_rpy([length, 0.0, 0.0], [0.0, 0.0, angle])))
    dropouts = []
    for text in dropout:
        parts = text.split(":")
        if len(parts) != 2:
            raise InputError(f"--dropout: found {text!r}, expected a time and how long, such as 20s:2s")
        dropouts.append((quantity(parts[0], "time", "--dropout"), quantity(parts[1], "time", "--dropout")))
    tracker = truing.testing.TrackerErrors(clock_offset=quantity(clock_offset, "time", "--clock-offset"))
    return truing.testing.StreamSimulationOptions(
        seconds=quantity(seconds, "time", "--seconds"),
        motion=motion.value,
        tip_speed=speed,
        tracker=tracker,
        dropouts=dropouts,
        shifts=shifts,
        seed=seed,
    )


def _simulate_stream(
    robot: Path, folder: Path, options: Any, base_link: str, tip_link: str, json: bool
) -> None:
    from truing.files import atomic_output_dir, load_robot, load_units, save_robot

    with _warnings_heard():
        model = load_robot(robot, base_link, tip_link)

        def work() -> Any:
            import truing

            return truing.testing.simulate_streams(model, options)

        streams = _busy("simulating", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.testing.streams import write_simulation

            truth = write_simulation(temporary, model, streams, options)
            save_robot(temporary / "robot.yaml", model, units=load_units(robot))
    if json:
        _print_json(truth)
        return
    lines = [(f"{name} samples", str(count)) for name, count in truth["samples"].items()]
    lines += [("modes", ", ".join(f"{mode['frequency_hz']:.3g} Hz" for mode in truth["modes"]))]
    _table(f"{model.name}: simulated recording of {truth['seconds']:g} s", ("", ""), lines)
    _say(
        f"truing track run {folder / 'robot.yaml'} --setup {folder / 'setup.yaml'} --imu {folder / 'imu.csv'}"
        f" --tracker {folder / 'tracker.csv'} --joints {folder / 'joints.csv'} --plan {folder / 'plan.csv'}"
        f" --truth {folder / 'truth.csv'}"
    )


@app.command()
def plan(
    robot: RobotFile,
    out: Annotated[Optional[Path], _out("plan")] = None,
    poses: Annotated[int, typer.Option(help="Number of poses.", min=1)] = 50,
    min_step: Annotated[
        str, typer.Option(help="Every revolute joint moves by more from pose to pose.")
    ] = "15deg",
    index: Annotated[
        IndexName,
        typer.Option(
            help=(
                "What the plan makes large: determinant, minus the sum of variances, smallest singular"
                " value, …"
            )
        ),
    ] = IndexName.d,
    orientation: Annotated[
        bool, typer.Option("--orientation", help="Orientations will be measured as well.")
    ] = False,
    noise: Noise = "0.03mm",
    seed: Seed = 0,
    free: Free = "",
    effects: Effects = "",
    columns: Annotated[
        str,
        typer.Option(
            help=(
                "What will be recorded and varied as well, of dir,payload,temp,t: says which effects the plan"
                " tells apart."
            ),
            show_default=False,
        ),
    ] = "",
    separate: Annotated[
        str,
        typer.Option(
            help="Effects to be told apart, 'backlash,joint_offset:J2'; poses are added if it takes any.",
            show_default=False,
        ),
    ] = "",
    add: Annotated[int, typer.Option(help="At most so many poses are added for --separate.", min=0)] = 12,
    payload: Annotated[str, typer.Option(help="A pose is measured with this load or with none.")] = "5kg",
    temperatures: Annotated[
        str, typer.Option(metavar="LOW,HIGH", help="Warm-up and cool-down, in deg C.")
    ] = "20,35",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Choose the poses that tell most about the robot; say, before any data, which effects they tell apart.

    Writes poses.csv, result.json, report.html (what standard errors to expect).
    """
    from truing.files import atomic_output_dir, load_robot, write_table

    folder = out or Path("truing-plan")
    step, sigma = quantity(min_step, "angle", "--min-step"), quantity(noise, "length", "--noise")
    load, (cold, warm) = quantity(payload, "mass", "--payload"), _temperatures(temperatures)
    long_index = {"d": "d_optimal", "a": "a_optimal", "e": "e_optimal"}.get(
        index.value, index.value.replace("-", "_")
    )
    with _warnings_heard() as heard:
        model = load_robot(robot, base_link, tip_link)

        def work() -> Any:
            import truing

            if columns or separate:  # words that mean nothing are said at once
                truing.distinguish(
                    model,
                    [[0.1 * (k + j) for j in range(model.driven_count)] for k in range(3)],
                    columns=_words(columns),
                    separate=separate,
                    add=0,
                    payload=load,
                    temperature_low=cold,
                    temperature_high=warm,
                )
            planned = truing.plan(
                model,
                poses=poses,
                min_step=step,
                index=long_index,
                orientation=orientation,  # type: ignore[arg-type]
                position_sigma=sigma,
                seed=seed,
                free=free,
                effects=effects,
            )
            if not (columns or separate):
                return planned, None
            return planned, truing.distinguish(
                model,
                planned.joints,
                columns=_words(columns),
                separate=separate,
                add=add,
                payload=load,
                temperature_low=cold,
                temperature_high=warm,
                orientation=orientation,
                position_sigma=sigma,
                min_step=step,
                seed=seed,
            )

        planned, seen = _busy("planning", work)
        with atomic_output_dir(folder) as temporary:
            from truing.planning.page import plan_report
            from truing.planning.result import plan_columns, plan_dict
            from truing.report.json_text import to_json, without_nan

            result: dict[str, Any] = without_nan(
                plan_dict(model, planned, index=long_index, noise=sigma, seed=seed, seen=seen, warnings=heard)
            )
            write_table(temporary / "poses.csv", plan_columns(model, planned.joints, seen))
            (temporary / "result.json").write_text(to_json(result), encoding="utf-8")
            driven = [model.joints[k] for k in model.driven_joints()]
            page = plan_report(
                result,
                [joint.name for joint in driven],
                planned.joints if seen is None else seen.joints,
                ["rad" if joint.type == "revolute" else "m" for joint in driven],
            )
            (temporary / "report.html").write_text(page, encoding="utf-8")
    if json:
        _print_json(result)
        return
    found = [p for p in result["parameters"] if p["sigma"] is not None]
    lines = [
        ("poses", str(result["poses"])),
        ("parameters found", f"{len(found)} of {len(result['parameters'])}"),
    ]
    for unit, word in (("m", "length"), ("rad", "angle")):
        sigmas = [p["sigma"] for p in found if p["unit"] == unit]
        if sigmas:
            lines.append(
                (
                    f"largest standard error of a {word}".replace("a a", "an a"),
                    _mm(max(sigmas)) if unit == "m" else f"{max(sigmas) * 1e3:.3g} mrad",
                )
            )
    _table(f"{model.name}: plan", ("", ""), lines)
    if seen is not None:
        _distinction_table(result["distinguish"])
    _last_line(folder)


def _temperatures(text: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = math.nan
    if not low < high:
        raise InputError(
            f"--temperatures: found {text!r}, expected two temperatures in deg C, the lower one first, such"
            " as 20,35"
        )
    return low, high


def _distinction_table(seen: Mapping[str, Any]) -> None:
    """Which effects a plan tells apart, on stdout."""
    from truing.planning.page import effect_at, size_words

    every: dict[str, list[Mapping[str, Any]]] = {}
    for effect in seen["effects"]:
        every.setdefault(effect["effect"], []).append(effect)
    lines = []
    for name, at in every.items():
        best = min(at, key=lambda e: e["size_at_tip_m"])
        held = [e for e in at if e["size_with_geometry"] is not None]
        worst = max(held, key=lambda e: e["size_with_geometry_at_tip_m"]) if held else None
        lines.append(
            (
                name.replace("_", " "),
                *((best["joint"], size_words(best["size"], best["unit"]), _mm(best["size_at_tip_m"]))),
                (
                    "no"
                    if worst is None
                    else (
                        f"{_mm(worst['size_with_geometry_at_tip_m'])} ({len(held)} of {len(at)})"
                        if len(at) > 1
                        else _mm(worst["size_with_geometry_at_tip_m"])
                    )
                ),
            )
        )
    _table(
        "the smallest effects that would be seen",
        ("", "best at", "size", "at the tip", "with geometry, worst joint"),
        lines,
        words=True,
    )
    if seen["separated"]:
        told = [
            (
                effect_at(p["effect"], p["joint"]),
                effect_at(p["other"], p["other_joint"]),
                f"{p['r2']:.3f}",
                "-" if p["r2_after"] is None else f"{p['r2_after']:.3f}",
                "never" if p["size"] is None else size_words(p["size"], p["unit"]),
                (
                    "-"
                    if p["r2_after"] is None
                    else "never"
                    if p["size_after"] is None
                    else size_words(p["size_after"], p["unit"])
                ),
            )
            for p in seen["separated"][:10]
        ]
        _table(
            f"to be told apart: {seen['added_poses']} poses added",
            ("", "from", "R2", "after", "from this size on", "after"),
            told,
            words=True,
        )
        if len(seen["separated"]) > len(told):
            _say(f"and {len(seen['separated']) - len(told)} pairs that are less alike: see the report")
    alike: dict[tuple[str, str, str], list[str]] = {}  # at the same joint: named once
    for p in seen["alike"]:
        same = p["joint"] == p["other_joint"]
        names = (
            (effect_at(p["effect"], ""), effect_at(p["other"], ""))
            if same
            else (effect_at(p["effect"], p["joint"]), effect_at(p["other"], p["other_joint"]))
        )
        alike.setdefault((*names, p["separated_by"]), []).extend([p["joint"]] if same and p["joint"] else [])
    for (first, other, how), joints in list(alike.items())[:8]:
        _say(
            f"not told apart: {first} from {other}{' at ' + ', '.join(joints) if joints else ''}; to tell:"
            f" {how}"
        )
    if len(alike) > 8:
        _say(f"and {len(alike) - 8} more: see the report")
    if seen["not_testable"]:
        words = [
            f"{effect_at(n['effect'], ', '.join(n['joints']))} ({n['why']})" for n in seen["not_testable"]
        ]
        _say(
            "not testable with such data: "
            + "; ".join(words[:8])
            + (f"; and {len(words) - 8} more" if len(words) > 8 else "")
        )


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", help="Folder to write to.")] = Path("demo"),
    seed: Seed = 0,
) -> None:
    """Calibrate an example robot with hidden errors, and check what was found against the truth."""
    from truing.demo import run

    with _warnings_heard():
        run(out, seed=seed, busy=_busy, console=_console())


@app.command()
def handeye(
    poses: Annotated[
        Path,
        typer.Argument(
            metavar="POSES",
            help="CSV or Parquet: hand poses, and board poses or images, one row per robot pose.",
            show_default=False,
        ),
    ],
    out: Annotated[Optional[Path], _out("handeye")] = None,
    setup: Annotated[
        SetupName,
        typer.Option(
            help="Camera on the hand and board in the cell, or camera in the cell and board on the hand."
        ),
    ] = SetupName.eye_in_hand,
    method: Annotated[
        MethodName, typer.Option(help="Maximum likelihood, or dual quaternions and one SVD alone.")
    ] = MethodName.refined,
    board: Annotated[
        str,
        typer.Option(
            help=(
                "What is in the images: chessboard:9x6:25mm (inner corners), charuco:5x7:40mm:30mm,"
                " circles:10x10:25.4mm, acircles:4x11:20mm."
            ),
            show_default=False,
        ),
    ] = "",
    camera: Annotated[
        Optional[Path],
        typer.Option(
            help="Camera file with focal lengths and distortion. Default: found from the images.",
            show_default=False,
        ),
    ] = None,
    refine_camera: Annotated[
        bool,
        typer.Option(
            "--refine-camera", help="Find the values of the given camera file anew, from the images."
        ),
    ] = False,
    angles: Annotated[
        str,
        typer.Option(
            help=(
                "What columns hand_rx_deg … mean: rotation-vector (UR), zyx (KUKA A B C, Fanuc W P R), xyz,"
                " zyz …"
            ),
            show_default=False,
        ),
    ] = "",
    board_poses: Annotated[
        Optional[Path],
        typer.Option(
            help=(
                "Board poses with times of their own (t_s); POSES then has times and hand poses. The clocks'"
                " offset is found."
            ),
            show_default=False,
        ),
    ] = None,
    hand_sigma: Annotated[
        str,
        typer.Option(
            metavar="LENGTH,ANGLE",
            help="Noise of the robot's poses, one component: 0.1mm,0.05deg. Default: found from the data.",
            show_default=False,
        ),
    ] = "",
    camera_sigma: Annotated[
        str,
        typer.Option(
            metavar="LENGTH,ANGLE",
            help="Noise of the board's poses, likewise; without images.",
            show_default=False,
        ),
    ] = "",
    pixel_sigma: Annotated[
        str,
        typer.Option(
            help="Noise of the board's points in images: 0.2px. Default: found from the data.",
            show_default=False,
        ),
    ] = "",
    working_point: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z",
            help=(
                "Where accuracy is asked for, in the camera frame: 0,0,800mm. Default: where the board was,"
                " on average."
            ),
            show_default=False,
        ),
    ] = "",
    known_height: Annotated[
        str,
        typer.Option(
            help="Where the hand only turned about parallel axes: the camera's coordinate along them, 850mm.",
            show_default=False,
        ),
    ] = "",
    keep_all: Annotated[bool, typer.Option("--keep-all", help="Reject no pose.")] = False,
    reading: Annotated[
        str, typer.Option(help="Read the numbers otherwise, as an earlier run proposed.", show_default=False)
    ] = "",
    with_kinematics: Annotated[
        Optional[Path],
        typer.Option(
            metavar="ROBOT",
            help="Find the robot's own parameters as well, from columns q1_rad … and this robot file.",
            show_default=False,
        ),
    ] = None,
    free: Annotated[
        str,
        typer.Option(
            help="With --with-kinematics: parameters to find, names and globs. Default: all geometry.",
            show_default=False,
        ),
    ] = "",
    hold: Annotated[
        str,
        typer.Option(
            help="With --with-kinematics: names and globs that stay at nominal.", show_default=False
        ),
    ] = "",
    effects: Annotated[
        str,
        typer.Option(
            help="With --with-kinematics: effects to find as well. `truing effects` lists them.",
            show_default=False,
        ),
    ] = "",
    plan: Annotated[
        int,
        typer.Option(
            help="So many robot poses that would help most are written to next_poses.csv.", min=0, max=100
        ),
    ] = 0,
    seed: Seed = 0,
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Find where the camera is, from poses of the hand and of a board, or from images of the board.

    Writes result.json, report.html, residuals.csv; camera.yaml if the camera's values were found,
    next_poses.csv with --plan, robot.yaml with --with-kinematics.
    """
    from truing.files import atomic_output_dir, load_robot

    folder = out or Path("truing-handeye")
    keywords: dict[str, Any] = {
        "setup": setup.value,
        "method": method.value,
        "reject": not keep_all,
        "reading": reading,
    }
    for option, text, names in (
        ("--hand-sigma", hand_sigma, ("hand_m", "hand_rad")),
        ("--camera-sigma", camera_sigma, ("camera_m", "camera_rad")),
    ):
        if text:
            keywords.update(zip(names, _length_and_angle(text, option), strict=True))
    if pixel_sigma:
        keywords["pixel"] = _above_zero(
            quantity(pixel_sigma, "pixel", "--pixel-sigma"), pixel_sigma, "--pixel-sigma"
        )
    if working_point:
        keywords["working_point"] = _point(working_point)
    if known_height:
        keywords["known_height"] = quantity(known_height, "length", "--known-height")
    if refine_camera:
        keywords["refine_camera"] = True
    _require_sense(
        board,
        camera,
        refine_camera,
        board_poses,
        with_kinematics,
        free or hold or effects,
        camera_sigma,
        pixel_sigma,
    )
    with _warnings_heard() as heard:
        import truing

        robot = None if with_kinematics is None else load_robot(with_kinematics, base_link, tip_link)
        data, clock = _handeye_data(poses, board, camera, angles, board_poses, setup.value)
        if data is None:
            assert clock is not None
            with atomic_output_dir(folder) as temporary:
                from truing.hand_eye.result import write_without_clock

                result = write_without_clock(temporary, clock, keywords, warnings=heard)
            _finish_handeye(result, folder, json)
            return
        if robot is not None and data.joints is None:
            raise InputError(
                f"{poses}: --with-kinematics needs the joints, but there is no column q1_rad (or another"
                " unit)"
            )
        if robot is not None and data.joints is not None and data.joints.shape[1] != robot.driven_count:
            raise InputError(
                f"{poses}: has joints q1 to q{data.joints.shape[1]}, but {with_kinematics} has"
                f" {robot.driven_count} driven joints"
            )
        options = truing.hand_eye.handeye_options(data, **keywords)

        def work() -> Any:
            from truing.hand_eye.result import Solved

            found = truing.handeye(data, **keywords, raise_if_undecided=False)
            both = None
            if robot is not None and data.joints is not None and found.status == "done":
                both = truing.hand_eye.handeye_with_kinematics(
                    robot,
                    data.joints,
                    data,
                    options=options,
                    free=free,
                    hold=hold,
                    effects=effects,
                    seed=seed,
                )
            following = (
                truing.hand_eye.handeye_plan(data, found, options=options, count=plan, seed=seed)
                if plan and found.status == "done"
                else ()
            )
            return Solved(data, options, found, following, clock, both, seed)

        solved = _busy("solving", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.hand_eye.result import write_handeye

            result = write_handeye(
                temporary,
                solved,
                warnings=heard,
                nominal_file=with_kinematics,
                base_link=base_link,
                tip_link=tip_link,
            )
        if not solved.next_poses:  # those of an earlier run would be taken for this one's
            (folder / "next_poses.csv").unlink(missing_ok=True)
    _warn([text for text in result["warnings"] if text not in heard])
    _finish_handeye(result, folder, json)


def _finish_handeye(result: Mapping[str, Any], folder: Path, json: bool) -> None:
    if json:
        _print_json(result)
    else:
        handeye_table(result, folder)
    if result["status"] != "done":
        _err().print(
            f"truing: {result['status']}: {result['message']}",
            style="bold red",
            markup=False,
            highlight=False,
        )
        raise typer.Exit(1)


ImuFile = Annotated[
    Path,
    typer.Option(
        "--imu", metavar="IMU.csv", help="Inertial sensor: t_s, gx_rad_s …, ax_m_s2 …", show_default=False
    ),
]
TrackerFile = Annotated[
    Path,
    typer.Option(
        "--tracker",
        metavar="TRACKER.csv",
        help="Receiver in the tracker frame: t_s, x_m …, qw …",
        show_default=False,
    ),
]
JointsFile = Annotated[
    Path,
    typer.Option(
        "--joints", metavar="JOINTS.csv", help="Encoder readings: t_s, q1_rad …", show_default=False
    ),
]


@_track.command("calibrate")
def track_calibrate(
    robot: RobotFile,
    joints: JointsFile,
    tracker: TrackerFile,
    imu: Annotated[
        Optional[Path],
        typer.Option(
            "--imu",
            metavar="IMU.csv",
            help="Inertial sensor: t_s, gx_rad_s …, ax_m_s2 … `track run` needs it.",
            show_default=False,
        ),
    ] = None,
    plan: Annotated[
        Optional[Path],
        typer.Option(
            "--plan",
            metavar="PLAN.csv",
            help="Planned tool in the base frame: gives the actuators' lag and the modes of the sway.",
            show_default=False,
        ),
    ] = None,
    tool: Annotated[
        Optional[Path],
        typer.Option(
            "--tool",
            metavar="TOOL.csv",
            help=(
                "Joints at prescribed poses of the tool: q1_rad …, kind (pivot, orientation), qw … Default:"
                " the robot file's tool."
            ),
            show_default=False,
        ),
    ] = None,
    out: Annotated[Optional[Path], _out("track-calibrate")] = None,
    clock_wanted: Annotated[
        str, typer.Option(help="A larger standard error of the clock offset is not enough: advice is given.")
    ] = "1ms",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Find the frames of tracker, receiver, inertial sensor and tool, gravity, and the clocks, from a
    recording over test positions.

    The arm goes from one test position to the next and stands still at each for three seconds or more. Writes
    result.json, report.html, setup.yaml.
    """
    from truing.files import atomic_output_dir, load_robot
    from truing.files.stream_file import load_imu, load_joints, load_plan, load_tool_poses, load_tracker

    folder = out or Path("truing-track-calibrate")
    wanted = _above_zero(quantity(clock_wanted, "time", "--clock-wanted"), clock_wanted, "--clock-wanted")
    with _warnings_heard() as heard:
        model = load_robot(robot, base_link, tip_link)
        encoders, seen = load_joints(joints, model), load_tracker(tracker)
        inertial, planned = None if imu is None else load_imu(imu), None if plan is None else load_plan(plan)
        prescribed = None if tool is None else load_tool_poses(tool, model)

        def work() -> Any:
            from truing.tracking.api import track_calibrate as calibrate

            return calibrate(
                model, encoders, seen, inertial, plan=planned, tool=prescribed, clock_wanted=wanted
            )

        found = _busy("calibrating", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.tracking.result import write_calibration

            result = write_calibration(temporary, model, found, source=tracker.name, warnings=heard)
        if found.status != "done":  # that of an earlier run would be taken for this one's
            (folder / "setup.yaml").unlink(missing_ok=True)
    if json:
        _print_json(result)
    else:
        track_calibrate_table(result, folder)
    if found.status != "done":
        _err().print(
            f"truing: {found.status}: {found.message}", style="bold red", markup=False, highlight=False
        )
        raise typer.Exit(1)


@_track.command("run")
def track_run(
    robot: RobotFile,
    setup: Annotated[
        Path,
        typer.Option(
            "--setup",
            metavar="SETUP.yaml",
            help="Where sensors are and how clocks differ, as `truing track calibrate` finds it.",
            show_default=False,
        ),
    ],
    imu: ImuFile,
    tracker: TrackerFile,
    joints: JointsFile,
    plan: Annotated[
        Optional[Path],
        typer.Option(
            "--plan",
            metavar="PLAN.csv",
            help=(
                "Planned tool in the base frame: t_s, x_m …, qw … Without it nothing is compensated,"
                " predictions are graded all the same."
            ),
            show_default=False,
        ),
    ] = None,
    out: Annotated[Optional[Path], _out("track")] = None,
    horizon: Annotated[
        str, typer.Option(help="Compensations are made so long before the instant they are for.")
    ] = "40ms",
    learn_modes: Annotated[
        str,
        typer.Option(
            help=(
                "Modes of the sway are identified from so much of the recording's start, unless setup.yaml"
                " has some; 0s: never."
            )
        ),
    ] = "30s",
    truth: Annotated[
        Optional[Path],
        typer.Option(
            metavar="TRUTH.csv",
            help="True tool poses, of a simulated recording: for the report.",
            show_default=False,
        ),
    ] = None,
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Replay a recording: fuse, predict, correct; nothing is used before it arrived.

    Writes result.json, report.html, compensation.csv (one row for each row of the plan), and setup.yaml with
    the modes where they were identified.
    """
    from truing.files import atomic_output_dir, load_robot
    from truing.files.stream_file import load_imu, load_joints, load_plan, load_setup, load_tracker

    folder = out or Path("truing-track")
    ahead, learn = (
        _above_zero(quantity(horizon, "time", "--horizon"), horizon, "--horizon"),
        quantity(learn_modes, "time", "--learn-modes"),
    )
    if ahead > 1.0:
        raise InputError(f"--horizon: found {horizon!r}, expected at most 1s")
    if learn < 0:
        raise InputError(f"--learn-modes: found {learn_modes!r}, expected a time that is not below 0")
    with _warnings_heard() as heard:
        model = load_robot(robot, base_link, tip_link)
        where = load_setup(setup)
        files: dict[str, Any] = {
            "imu": load_imu(imu),
            "tracker": load_tracker(tracker),
            "joints": load_joints(joints, model),
        }
        planned, true = (None if path is None else load_plan(path) for path in (plan, truth))

        def work(progress: Callable[[float], bool]) -> Any:
            import truing
            from truing.tracking.result import Played

            streams = truing.recorded_streams(model, where, **files, plan=planned)
            options = where.options()
            options.deviation.horizon = ahead
            played = truing.replay(
                streams,
                where.setup,
                options,
                horizons=sorted({0.02, 0.04, 0.08, ahead}),
                learn_modes=0.0 if where.modes.count or planned is None else learn,
                progress=progress,
            )
            return Played(
                model,
                where,
                played,
                ahead,
                planned.t if planned is not None else np.empty(0),
                where.steady(files["tracker"].t) - where.setup.clock_offset,
                true,
            )

        run = _counted("replaying", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.tracking.result import write_run

            result = write_run(temporary, run, warnings=heard)
        for name, stale in (
            ("compensation.csv", planned is None),
            ("setup.yaml", not result["modes"]["used_from_s"]),
        ):
            if stale and folder / name != setup:  # that of an earlier run would be taken for this one's
                (folder / name).unlink(missing_ok=True)
    if json:
        _print_json(result)
    else:
        track_run_table(result, folder)
    if planned is not None and not result["made"]:
        _err().print(
            "truing: no row of the plan could be compensated: the streams do not reach it, or the tracker was"
            " never there",
            style="bold red",
            markup=False,
            highlight=False,
        )
        raise typer.Exit(1)


@app.command()
def ik(
    robot: RobotFile,
    targets: TargetsFile,
    out: Annotated[Optional[Path], _out("ik")] = None,
    task: TaskKind = None,
    free_axis: AxisOption = None,
    seed: SeedJoints = "",
    choose: ChooseOption = ChooseName.nearest,
    all_branches: Annotated[
        bool, typer.Option("--all-branches", help="Every configuration that reaches a full pose, a row each.")
    ] = False,
    path: Annotated[
        bool, typer.Option("--path", help="The targets are a chain: joints in steps as short as can be.")
    ] = False,
    longest_turn: Annotated[
        str,
        typer.Option(
            help="With --path: a turning joint that moves by more between neighbouring targets is a gap."
        ),
    ] = "20deg",
    longest_slide: Annotated[str, typer.Option(help="With --path: the same of a sliding joint.")] = "250mm",
    scene: SceneFile = None,
    retreat: Retreat = "",
    target: TargetName = "",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    threads: Threads = 0,
    json: Json = False,
) -> None:
    """Find the joints that bring the robot, nominal or calibrated, to each target; or say why there are none.

    Writes joints.csv, result.json, report.html. Exit status 1 when a target is not reached, or the path has a
    gap.
    """
    from truing.files import atomic_output_dir, load_robot, load_scene, load_targets

    folder = out or Path("truing-ik")
    if path and all_branches:
        raise InputError(
            "--path and --all-branches: a path takes one configuration at every target; choose one of the two"
        )
    turn, slide = (
        _more_than_zero(quantity(text, kind, option), text, option)
        for text, kind, option in (
            (longest_turn, "angle", "--longest-turn"),
            (longest_slide, "length", "--longest-slide"),
        )
    )
    like = _task_like(task, free_axis, retreat)
    if all_branches and like.kind != "pose":
        raise InputError(
            f"--all-branches: is for full poses; a {like.kind} leaves something free, and has endlessly many"
            " answers"
        )
    with _warnings_heard() as heard:
        import truing

        model = load_robot(robot, base_link, tip_link)
        index = _target_index(model, target)
        data = _busy("reading", lambda: load_targets(targets, model, like=like))
        if all_branches and any(one.kind != "pose" for one in data.tasks):
            raise InputError(f"{targets}: --all-branches is for full poses, but its column task holds others")
        start = _seed_joints(seed, model, data)
        of_path = data.path_conditions() if path else None
        options = truing.inverse_kinematics.InverseOptions(
            choose=choose.value, scene=truing.model.Scene() if scene is None else load_scene(scene, model)
        )
        solver = truing.inverse_kinematics.InverseSolver(
            model, options, data.conditions[0] if data.conditions else None, target=index
        )

        def work(progress: Callable[[int], None]) -> Any:
            from truing.inverse_kinematics.result import Solved

            every = np.arange(data.count)
            if path:
                steps = truing.inverse_kinematics.PathOptions(longest_turn=turn, longest_slide=slide)
                first = start if start is None or start.ndim == 1 else start[0]
                found = solver.path(data.tasks, first, steps, of_path, progress=progress)
                return Solved(data, solver, list(found.solutions), every, path=found, steps=steps)
            if all_branches:
                return _every_branch(solver, data, start, progress)
            return Solved(
                data,
                solver,
                list(
                    solver.solve_batch(
                        data.tasks, start, data.conditions or None, threads=threads, progress=progress
                    )
                ),
                every,
            )

        solved = _busy_counting("solving", data.count, work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.inverse_kinematics.result import write_inverse

            result = write_inverse(temporary, solved, warnings=heard)
    if json:
        _print_json(result)
    else:
        inverse_table(result, folder)
    _exit_unless_whole(result)


@app.command()
def compensate(
    nominal: Annotated[
        Path,
        typer.Argument(
            metavar="NOMINAL",
            help="Robot file that the controller believes in: robot.yaml or URDF.",
            show_default=False,
        ),
    ],
    calibrated: Annotated[
        Path,
        typer.Argument(
            metavar="CALIBRATED",
            help="Robot file of the real robot, as `truing identify` or `diagnose` wrote it.",
            show_default=False,
        ),
    ],
    targets: Annotated[
        Path,
        typer.Argument(
            metavar="TARGETS",
            help="CSV or Parquet: poses as for `truing ik`, or a program of joint positions (q1_rad …).",
            show_default=False,
        ),
    ],
    out: Annotated[Optional[Path], _out("compensate")] = None,
    task: TaskKind = None,
    free_axis: AxisOption = None,
    seed: SeedJoints = "",
    choose: ChooseOption = ChooseName.nearest,
    uncertainty: Annotated[
        Optional[Path],
        typer.Option(
            metavar="RESULT",
            help=(
                "result.json of `truing identify`, with covariance.csv beside it: for the standard error of"
                " what remains."
            ),
            show_default=False,
        ),
    ] = None,
    in_base: Annotated[
        bool,
        typer.Option(
            "--in-base",
            help=(
                "Poses are in the robot's own base frame, as controllers have them; else in the measurement"
                " frame."
            ),
        ),
    ] = False,
    scene: SceneFile = None,
    retreat: Retreat = "",
    target: TargetName = "",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    threads: Threads = 0,
    json: Json = False,
) -> None:
    """Say what to command to a controller that believes in the nominal robot, so that the real one goes where
    it is wanted.

    Writes joints.csv and poses.csv (joints and poses to command), result.json, report.html. Exit status 1
    when a target is not reached.
    """
    from truing.files import atomic_output_dir, load_robot, load_scene, load_targets, load_uncertainty

    folder = out or Path("truing-compensate")
    like = _task_like(task, free_axis, retreat)
    with _warnings_heard() as heard:
        import truing

        believed, real = (
            load_robot(nominal, base_link, tip_link),
            _load_calibrated(calibrated, base_link, tip_link),
        )
        if believed.driven_count != real.driven_count:
            raise InputError(
                f"{calibrated}: has {real.driven_count} driven joints, but {nominal} has"
                f" {believed.driven_count}: these are not the same robot"
            )
        index = _target_index(believed, target)
        data = _busy(
            "reading", lambda: load_targets(targets, believed, like=like, program=True, in_base=in_base)
        )
        start = None if data.is_program else _seed_joints(seed, believed, data)
        if data.is_program and seed:
            raise InputError("--seed: a program of joint positions says itself where the robot comes from")
        options = truing.inverse_kinematics.InverseOptions(
            choose=choose.value, scene=truing.model.Scene() if scene is None else load_scene(scene, believed)
        )
        maker = truing.inverse_kinematics.Compensator(
            believed,
            real,
            truing.inverse_kinematics.CompensateOptions(inverse=options, in_base=in_base),
            data.conditions[0] if data.conditions else None,
            target=index,
        )
        if uncertainty is not None:
            known = load_uncertainty(uncertainty)
            try:
                maker.set_uncertainty(known.names, known.values, known.covariance)
            except InputError as error:
                raise InputError(
                    f"{uncertainty}: {error}; was this identification made for {calibrated}?"
                ) from None

        def work(progress: Callable[[int], None]) -> Any:
            if data.is_program:
                assert data.joints is not None
                return maker.joints_batch(
                    data.joints, data.conditions or None, threads=threads, progress=progress
                )
            return maker.pose_batch(
                data.tasks, start, data.conditions or None, threads=threads, progress=progress
            )

        made = _busy_counting("compensating", data.count, work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.inverse_kinematics.result import CompensatedProgram, write_compensation

            result = write_compensation(
                temporary,
                CompensatedProgram(data, maker, made, in_base, uncertainty is not None),
                warnings=heard,
            )
    if json:
        _print_json(result)
    else:
        compensation_table(result, folder)
    _exit_unless_whole(result)


def _exit_unless_whole(result: Mapping[str, Any]) -> None:
    missing = result["targets"] - result["reached"]
    gaps = len(result.get("path", {}).get("gaps", ()))
    if missing or gaps:
        words = [f"{missing} of {result['targets']} targets are not reached"] if missing else []
        words += [f"the path has {gaps} gap{'' if gaps == 1 else 's'}"] if gaps else []
        _err().print(f"truing: {' and '.join(words)}", style="bold red", markup=False, highlight=False)
        raise typer.Exit(1)


@app.command()
def exam(
    out: Annotated[Optional[Path], _out("exam")] = None,
    which: Annotated[
        ExamSet,
        typer.Option(
            "--set", help="The robots, sizes and effects of development, or those kept for the examination."
        ),
    ] = ExamSet.development,
    quick: Annotated[bool, typer.Option("--quick", help="A few data sets of every family.")] = False,
    families: Annotated[
        str,
        typer.Option(
            help="Only these families of data sets, e.g. 'none,one'. Default: all.", show_default=False
        ),
    ] = "",
    workers: Annotated[
        int, typer.Option(help="Processes at a time; 0: as many as the machine has.", min=0)
    ] = 0,
    limit: Annotated[int, typer.Option(help="At most so many sets of each family; 0: all.", min=0)] = 0,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Examine the diagnosis on withheld effects, simulated by other means than its own.

    Writes result.json (the score table) and report.html. Needs MuJoCo: pip install "truing[exam]".
    """
    from truing.files import atomic_output_dir

    folder = out or Path("truing-exam")
    try:
        from truing.exam.run import run_exam
        from truing.exam.score import table
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] == "truing":
            raise
        raise InputError(
            f"the examination needs the package {error.name}, which is not installed: pip install"
            ' "truing[exam]"'
        ) from None
    with _warnings_heard(), atomic_output_dir(folder) as temporary, _counting("examining") as progress:
        from truing.exam.result import write_exam

        scores = run_exam(
            which.value,
            quick=quick,
            seed=seed,
            families=_words(families) or None,
            limit=limit or None,
            workers=workers or os.cpu_count() or 1,
            out=temporary,
            progress=progress,
        )
        result = write_exam(
            temporary,
            {
                "set": which.value,
                "seed": seed,
                "sets": scores.sets,
                "scores": table(scores),
                "failures": scores.failures,
            },
        )
    if json:
        _print_json(result)
    else:
        exam_table(result, folder)


@app.command()
def effects() -> None:
    """List the effects that truing knows."""
    import truing

    _table("effects", ("name", "what it is"), truing.model.catalogue())


# ---- Reading
# -----------------------------------------------------------------------------------------------------------


def _load(
    robot: Path, data: Path, base_link: str, tip_link: str, joints_only: bool = False
) -> tuple[Robot, Measurements]:
    from truing.files import load_measurements, load_robot

    model = load_robot(robot, base_link, tip_link)
    return model, _busy("reading", lambda: load_measurements(data, model, joints_only=joints_only))


def _load_calibrated(path: Path, base_link: str, tip_link: str) -> Robot:
    """A calibrated robot of convention urdf is written as YAML, which has no links to choose."""
    from truing.files import load_robot

    is_urdf = path.suffix.lower() in (".urdf", ".xml")
    return load_robot(path, base_link, tip_link) if is_urdf else load_robot(path)


def _task_like(task: Optional[TaskName], free_axis: Optional[FreeAxis], retreat: str) -> Task:
    """What every row of a target file wants that says nothing else."""
    from truing.inverse_kinematics import Task

    axis = None if free_axis is None or free_axis is FreeAxis.none else "xyz".index(free_axis.value)
    if task is not None and free_axis is not None and (axis is not None) != (task is TaskName.torch):
        raise InputError(
            f"--free-axis {free_axis.value} and --task {task.value}: a free axis is the task torch, and no"
            " other"
        )
    kind = task.value if task is not None else "pose" if axis is None else "torch"
    unit = np.eye(3)[2 if axis is None else axis]
    travel = np.eye(3)[0 if axis is None or axis == 2 else (axis + 1) % 3]
    longest = (
        _more_than_zero(quantity(retreat, "length", "--retreat"), retreat, "--retreat") if retreat else 0.0
    )
    return Task(np.eye(4), kind=kind, axis=unit, travel=travel, retreat=-unit, longest_retreat=longest)  # type: ignore[arg-type]


def _more_than_zero(value: float, text: str, option: str) -> float:
    if not value > 0:
        raise InputError(f"{option}: found {text!r}, expected more than zero")
    return value


def _target_index(robot: Robot, name: str) -> int:
    names = [target.name for target in robot.targets]
    if name and name not in names:
        raise InputError(f"--target: the robot has no target {name!r}; its targets are {', '.join(names)}")
    return names.index(name) if name else 0


def _seed_joints(text: str, robot: Robot, data: TargetData) -> Optional[NDArray[np.float64]]:
    """--seed, or the joints of the target file; None: the middle of the joints' ranges."""
    if not text:
        return data.joints
    path = Path(text)
    if path.suffix.lower() in (".csv", ".parquet", ".pq"):
        from truing.files import load_measurements

        joints = np.asarray(load_measurements(path, robot, joints_only=True).joints)
        if len(joints) not in (1, data.count):
            raise InputError(
                f"{path}: has {len(joints)} rows, expected one, or one for each of {data.count} targets"
            )
        return joints[0] if len(joints) == 1 else joints
    driven = [robot.joints[k] for k in robot.driven_joints()]
    parts = _words(text)
    if len(parts) != len(driven):
        raise InputError(
            f"--seed: found {len(parts)} joints, the robot has {len(driven)}:"
            f" {', '.join(joint.name for joint in driven)}; expected such as {_seed_example(driven)}, or a"
            " .csv file"
        )
    values, units = [], {"angle": "", "length": ""}
    for part, joint in zip(
        reversed(parts), reversed(driven), strict=True
    ):  # a unit holds for the numbers before it that have none
        kind = "angle" if joint.type == "revolute" else "length"
        own = re.sub(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", "", part, count=1).strip()
        units[kind] = own or units[kind]
        values.append(quantity(part if own else part + units[kind], kind, f"--seed, joint {joint.name}"))
    return np.array(values[::-1])


def _seed_example(joints: Sequence[Joint]) -> str:
    return ",".join("10deg" if joint.type == "revolute" else "100mm" for joint in joints)


def _every_branch(
    solver: InverseSolver,
    data: TargetData,
    start: Optional[NDArray[np.float64]],
    progress: Callable[[int], None],
) -> Solved:
    """All configurations of every target; of a target without any, why."""
    from truing.inverse_kinematics.result import Solved

    solutions: list[Solution] = []
    owners: list[int] = []
    for k, task in enumerate(data.tasks):
        seed = start if start is None or start.ndim == 1 else start[k]
        conditions = data.conditions[k] if data.conditions else None
        found = solver.branches(task, seed, conditions).solutions or (solver.solve(task, seed, conditions),)
        solutions.extend(found)
        owners.extend([k] * len(found))
        if k % 16 == 15:
            progress(k + 1)
    return Solved(data, solver, solutions, np.array(owners, dtype=np.intp), all_branches=True)


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _length_and_angle(text: str, option: str) -> tuple[float, float]:
    """ "0.1mm,0.05deg" in m and rad, both above zero."""
    parts = _words(text)
    if len(parts) != 2:
        raise InputError(f"{option}: found {text!r}, expected a length and an angle such as 0.1mm,0.05deg")
    return _above_zero(quantity(parts[0], "length", option), parts[0], option), _above_zero(
        quantity(parts[1], "angle", option), parts[1], option
    )


def _above_zero(value: float, text: str, option: str) -> float:
    if not value > 0:
        raise InputError(f"{option}: found {text!r}, expected a standard deviation above zero")
    return value


def _point(text: str) -> list[float]:
    """ "0,0,800mm" in m: a unit holds for the numbers before it that have none."""
    parts = _words(text)
    match = re.fullmatch(r".*?([^\s\d.,]*)\s*", parts[-1]) if parts else None
    unit = match[1] if match else ""
    if len(parts) != 3 or not unit:
        raise InputError(
            f"--working-point: found {text!r}, expected three lengths with their unit such as 0,0,800mm: x to"
            " the right, y down, z out of the lens"
        )
    return [
        quantity(part if re.search(r"[^\d.eE+\s-]", part) else part + unit, "length", "--working-point")
        for part in parts
    ]


def _require_sense(
    board: str,
    camera: Optional[Path],
    refine_camera: bool,
    board_poses: Optional[Path],
    with_kinematics: Optional[Path],
    of_robot: str,
    camera_sigma: str,
    pixel_sigma: str,
) -> None:
    """Raises InputError about options that need others."""
    if board_poses is not None and (board or camera is not None):
        raise InputError(
            "--board-poses: board poses are given, so that --board and --camera have no images to be for"
        )
    if board_poses is not None and with_kinematics is not None:
        raise InputError(
            "--board-poses: streams have no joints at the camera's times, which --with-kinematics needs"
        )
    for name, given in (
        ("--camera", camera is not None),
        ("--refine-camera", refine_camera),
        ("--pixel-sigma", bool(pixel_sigma)),
    ):
        if given and not board:
            raise InputError(f"{name}: is about images; say with --board what is in them")
    if camera_sigma and board:
        raise InputError("--camera-sigma: is about board poses; with images it is --pixel-sigma")
    if of_robot and with_kinematics is None:
        raise InputError("--free, --hold and --effects are about the robot: say which with --with-kinematics")


def _handeye_data(
    poses: Path, board: str, camera: Optional[Path], angles: str, board_poses: Optional[Path], setup: str
) -> tuple[Optional[HandEyeData], Optional[ClockOffset]]:
    """What the files hold; where hand and camera have clocks of their own, hand poses at the camera's times
    (None: not known), and the offset.
    """
    import truing
    from truing.files import load_stream

    if board_poses is None:
        with _counting("finding the board") if board else contextlib.nullcontext() as progress:
            data = truing.load_handeye(
                poses, board=board or None, camera=camera, angles=angles or None, progress=progress
            )
        if data.board_time is None or data.time is None:
            return data, None
        hand, seen, where = (
            (data.time, data.poses.T_base_hand),
            (data.board_time, data.poses.T_camera_board),
            poses,
        )
    else:
        streams = (
            load_stream(poses, "hand", angles=angles or None),
            load_stream(board_poses, "board", angles=angles or None),
        )
        (hand, seen), where = ((stream.time, stream.T) for stream in streams), board_poses
    clock = _busy("comparing clocks", lambda: truing.hand_eye.handeye_clock(*hand, *seen, setup=setup))  # type: ignore[arg-type]
    if not clock.found:
        return None, clock
    rows = list(clock.rows)
    if len(rows) < 3:
        raise InputError(
            f"{where}: {len(rows)} board poses lie within the time of the robot's record, expected at least 3"
        )
    if board_poses is None:
        return (
            dataclasses.replace(
                data,
                poses=data.poses.replace(T_base_hand=clock.T_base_hand, **_picked(data.poses, rows)),
                rows=data.rows[rows],
                joints=None if data.joints is None else data.joints[rows],
                images=tuple(data.images[row] for row in rows) if data.images else (),
            ),
            clock,
        )
    aligned = truing.hand_eye.HandEyePoses(clock.T_base_hand, seen[1][rows])
    return truing.files.HandEyeData(poses, aligned, np.asarray(rows)), clock


def _picked(poses: HandEyePoses, rows: list[int]) -> dict[str, Any]:
    """The camera's side of some of the poses."""
    return {
        "T_camera_board": poses.T_camera_board[rows],
        "images": None if poses.images is None else [poses.images[row] for row in rows],
        "set": None if poses.set is None else poses.set[rows],
    }


def _geometry_error(text: str) -> tuple[float, float, float]:
    parts = _words(text)
    if len(parts) not in (2, 3):
        raise InputError(
            f"--geometry-error: found {text!r}, expected a length, an angle and perhaps a gear-ratio error,"
            " such as 1mm,1mrad or 1mm,1mrad,1e-4"
        )
    ratio = 0.0
    if len(parts) == 3:
        try:
            ratio = float(parts[2])
        except ValueError:
            raise InputError(
                f"--geometry-error: found {parts[2]!r} for gear ratios, expected a plain number such as 1e-4"
            ) from None
    sizes = (
        quantity(parts[0], "length", "--geometry-error"),
        quantity(parts[1], "angle", "--geometry-error"),
        ratio,
    )
    if min(sizes) < 0 or not math.isfinite(ratio):
        raise InputError(f"--geometry-error: found {text!r}, expected sizes that are not negative")
    return sizes


def _outliers(text: str) -> tuple[float, float]:
    if not text:
        return 0.0, 0.0
    part, colon, length = text.partition(":")
    if not colon:
        raise InputError(f"--outliers: found {text!r}, expected a share and a size such as 2%:5mm")
    return share(part, "--outliers"), quantity(length, "length", "--outliers")


def _simulated_effect(text: str) -> tuple[str, float]:
    """ "backlash:J2=0.2mrad" as parameter name and value."""
    place, equals, size = text.partition("=")
    words = [word.strip() for word in place.split(":")]
    if not equals or len(words) not in (1, 2, 3) or not all(words):
        raise InputError(
            f"--effect: found {text!r}, expected effect:joint=size such as backlash:J2=0.2mrad,"
            " effect:joint:part=size, or scale=size"
        )
    for kind in ("angle", "length"):
        with contextlib.suppress(InputError):
            return ".".join(words), quantity(size, kind, "--effect")
    try:
        value = float(size)  # of whatever unit the effect's parameter has
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"--effect: found the size {size!r} in {text!r}, expected a number (SI) or a quantity such as"
            " 0.2mrad"
        )
    return ".".join(words), value


# ---- Saying
# ------------------------------------------------------------------------------------------------------------


def _console() -> Console:
    from rich.console import Console

    return Console(highlight=False)


def _err() -> Console:
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True)


def _say(text: str) -> None:
    """A line that is never wrapped: a path stays a path."""
    _console().print(text, soft_wrap=True, markup=False)


def _last_line(folder: Path) -> None:
    _say(f"report: {folder / 'report.html'}")


def _print_json(result: Mapping[str, Any]) -> None:
    from truing.report.json_text import to_json

    sys.stdout.write(to_json(result))


def _mm(metres: float | None) -> str:
    return "-" if metres is None else f"{metres * 1e3:.4f} mm"


def _table(title: str, head: Sequence[str], lines: Sequence[Sequence[str]], words: bool = False) -> None:
    """A table on stdout. `words`: its cells are no numbers."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_header=any(head))
    for k, name in enumerate(head):
        table.add_column(
            name, justify="left" if k == 0 or len(head) == 2 or words else "right", overflow="fold"
        )
    for line in lines:
        table.add_row(*line)
    _console().print(table)


def identification_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing identify`, on stdout; the last line is the path of the report."""
    errors = result["errors"]
    held_out = "test" in errors
    lines = []
    for name, label in (("test", "held out"), ("train", "fitted")):
        if name in errors:
            e = errors[name]
            for key, what in (
                (("mean_m", "mean"), ("p95_m", "95 %"), ("max_m", "worst"))
                if name == "test" or not held_out
                else (("mean_m", "mean"),)
            ):
                lines.append((f"{label}, {what}", _mm(e["before"][key]), _mm(e["after"][key])))
    _table(f"{result['robot']}: errors before and after", ("", "before", "after"), lines)
    noise, rejected, frozen = result["noise_sigma_m"], len(result["rejected_rows"]), result["frozen"]
    _say(
        f"{result['rank']} of {result['columns']} parameters found; noise {_mm(noise)} (1 sigma); {rejected}"
        f" rows rejected; {result['solver']['iterations']} iterations: {result['solver']['stopped_because']}"
    )
    if frozen:
        more = f" and {len(frozen) - 8} more" if len(frozen) > 8 else ""
        _say(
            "not visible in these data, kept at nominal: "
            + ", ".join(f["parameter"] for f in frozen[:8])
            + more
        )
    _last_line(folder)


def diagnosis_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing diagnose`, on stdout; the last line is the path of the report."""
    from truing.diagnosis.page import at_joints, size_text, trouble

    for finding in trouble(result):
        _say(f"look at the data first: {finding['text']}")
    _say(result["sentence"])
    gap, after, by_all, shrink = result["gap"], result["after"], result["after_unknown"], result["shrink"]
    cells = [
        ("rms", *(_mm(e["rms_m"]) for e in (gap, after, by_all))),
        ("95 %", *(_mm(e["p95_m"]) for e in (gap, after, by_all))),
        ("noise", _mm(gap["noise_floor_m"]), "", ""),
    ]
    shown = [
        0,
        1,
        *([2] if result["effects"] else []),
        *([3] if any(u["inputs"] for u in result["unknown"]) else []),
    ]
    heading = ("", "before", "with what is named", "with free functions")
    _table(
        f"{result['robot']}: error of held-out poses",
        [heading[k] for k in shown],
        [[line[k] for k in shown] for line in cells],
    )
    if result["effects"]:
        _say(
            f"robot.yaml takes {100 * shrink['value']:.0f} % off the error (90 % interval"
            f" {100 * shrink['ci'][0]:.0f} to {100 * shrink['ci'][1]:.0f} %)"
        )
    found = []
    for effect in result["effects"]:
        others = ", ".join(at_joints(other) for other in effect["confounded_with"])
        found.append(
            (
                at_joints(effect),
                f"{100 * effect['probability']:.0f} %",
                size_text(effect),
                _off(effect["held_out"]),
                others,
            )
        )
    for unknown in result["unknown"]:
        place = f"at {unknown['joint']}" if unknown["joint"] else "somewhere"
        found.append(
            (
                f"unknown {place}",
                f"{100 * unknown['probability']:.0f} %",
                unknown["looks_like"] or f"over {', '.join(unknown['inputs'])}",
                _off(unknown["held_out"]) if unknown["inputs"] else "",
                "",
            )
        )
    if found:
        _table(
            "what causes it", ("what", "sure", "size", "off the error", "not told from"), found, words=True
        )
    if result["not_testable"]:
        words = [f"{at_joints(n)} ({n['why']})" for n in result["not_testable"]]
        _say(
            "not testable with these data: "
            + "; ".join(words[:6])
            + (f"; and {len(words) - 6} more" if len(words) > 6 else "")
        )
    for finding in result["sanity"]:
        if finding not in trouble(result):
            _say(f"note: {finding['text']}")
    if result["next_measurements"]:
        _say(f"measure next: {folder / 'next_poses.csv'} ({len(result['next_measurements'])} poses)")
    _last_line(folder)


def handeye_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing handeye`, on stdout; the last line is the path of the report."""
    if result["status"] != "done":
        for u in result["observability"]["unobservable"]:
            _say(f"{u['what']} cannot be seen: {u['advice'].replace('(known height)', '(--known-height)')}")
        for other in result["convention"]["other_readings"]:
            _say(
                f"the loop closes to {_mm(other['rms_m'])} if {other['explanation']}: --reading"
                f" {other['reading']}"
            )
    else:
        camera, point, errors = result["camera"], result["working_point"], result["errors"]
        lines = [
            (
                axis,
                f"{camera[f'{axis}_m'] * 1e3:.3f} mm",
                _mm(camera["sigma"][f"{axis}_m"]),
                _mrad(camera["sigma"][f"r{axis}_rad"]),
            )
            for axis in "xyz"
        ]
        _table(f"camera in the {camera['in']}", ("", "position", "sigma", "sigma about it"), lines)
        _say("quaternion w x y z: " + " ".join(f"{camera[name]:.7f}" for name in ("qw", "qx", "qy", "qz")))
        _say(
            f"at the working point, {point['in_camera_m'][2] * 1e3:.0f} mm in front of it: +-"
            f" {_mm(point['sigma_m'])}, +- {_mrad(point['rotation_sigma_rad'])} per axis (1 sigma)"
        )
        for name, label in (("left_out", "each pose left out"), ("test", "held-out poses")):
            if name in errors and errors[name]["n"]:
                e = errors[name]
                pixels = f", {e['rms_px']:.3g} px" if e.get("rms_px") is not None else ""
                _say(
                    f"{label}: {_mm(e['rms_m'])}, {_mrad(e['rotation_rms_rad'])}{pixels} rms over {e['n']};"
                    f" worst {_mm(e['max_m'])}"
                )
        if "kinematics" in result:
            for name, label in (("train", "fitted poses"), ("test", "held-out poses")):
                if name in result["kinematics"]["errors"]:
                    e = result["kinematics"]["errors"][name]
                    _say(
                        f"with the robot's own parameters, {label}: {_mm(e['before']['rms_m'])} ->"
                        f" {_mm(e['after']['rms_m'])} rms"
                    )
        if "clock" in result:
            _say(f"clocks: t_hand = t_camera {result['clock']['offset_s']:+.4f} s")
    for pose in result["rejected_poses"][:12]:
        _say(
            f"rejected: pose {pose['pose']}{' (' + pose['image'] + ')' if 'image' in pose else ''}:"
            f" {pose['cause']}"
        )
    if len(result["rejected_poses"]) > 12:
        _say(f"and {len(result['rejected_poses']) - 12} more rejected poses: see residuals.csv")
    if result["next_poses"]:
        _say(
            f"measure next: {folder / 'next_poses.csv'} ({len(result['next_poses'])} poses, then +-"
            f" {_mm(result['next_poses'][-1]['working_point_sigma_m'])})"
        )
    _last_line(folder)


def inverse_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing ik`, on stdout; the last line is the path of the report."""
    _say_reasons(result, f"{result['robot']}: {result['reached']} of {result['targets']} targets reached")
    if "branches" in result:
        _say(f"{result['branches']['rows']} answers in all")
    worst = result["worst"]
    if worst["position_m"] is not None:
        _say(
            f"the worst that is reached misses its task by {worst['position_m']:.2g} m,"
            f" {worst['rotation_rad']:.2g} rad"
        )
    path = result.get("path")
    if path is not None:
        slides = (
            f", {_mm(path['longest_slide_m'])}"
            if any(joint["unit"] == "m" for joint in result["joints"])
            else ""
        )
        _say(
            f"longest step: {math.degrees(path['longest_turn_rad']):.4g} deg{slides}"
            + ("" if path["gaps"] else "; the path is continuous")
        )
        for gap in path["gaps"][:8]:
            size = (
                f": {gap['joint']} would step {math.degrees(gap['step_rad']):.4g} deg"
                if "step_rad" in gap
                else f": {gap['joint']} would step {_mm(gap['step_m'])}"
                if "step_m" in gap
                else ""
            )
            _say(f"no continuous path from target {gap['from']} to {gap['to']}{size}")
        if len(path["gaps"]) > 8:
            _say(f"and {len(path['gaps']) - 8} more gaps: see the report")
    _say(f"joints: {folder / 'joints.csv'}")
    _last_line(folder)


def compensation_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing compensate`, on stdout; the last line is the path of the report."""
    _say_reasons(
        result, f"{result['calibrated']}: {result['reached']} of {result['targets']} targets reached"
    )
    before, after, moved = result["before"], result["after"], result["correction"]
    if after["mean_m"] is not None:
        lines = [
            (label, *(_mm(e[key]) for key in ("mean_m", "p95_m", "max_m")))
            for label, e in (
                ("error if commanded as it is", before),
                ("error by the model, compensated", after),
                ("commands are moved by", moved),
            )
        ]
        if "standard_error" in result:
            lines.append(
                (
                    "standard error of what remains",
                    *(
                        _mm(result["standard_error"]["position_m"][key])
                        for key in ("mean_m", "p95_m", "max_m")
                    ),
                )
            )
        _table("compensation", ("", "mean", "95 %", "worst"), lines)
    others = result["other_configuration"]
    if others:
        which = ", ".join(map(str, others[:12])) + (" …" if len(others) > 12 else "")
        _say(
            "joints far from those that the nominal robot would take, so that a controller that is given"
            f" poses may choose others: targets {which}"
        )
    _say(f"commands: {folder / 'joints.csv'}, {folder / 'poses.csv'}")
    _last_line(folder)


def _say_reasons(result: Mapping[str, Any], title: str) -> None:
    """What came of the targets; the first of those that are not reached, in words."""
    others = [
        f"{count} {reason.replace('_', ' ')}"
        for reason, count in result["reasons"].items()
        if reason != "reached"
    ]
    _say(title + (f" ({', '.join(others)})" if others else ""))
    for failure in result["failures"][:8]:
        _say(f"target {failure['target']}: {failure['text']}")
    if len(result["failures"]) > 8:
        _say(f"and {len(result['failures']) - 8} more: see joints.csv")


def _mrad(radians: float | None) -> str:
    return "-" if radians is None else f"{radians * 1e3:.4f} mrad"


def _off(held: Mapping[str, Any]) -> str:
    """ "46 % [43, 48]": off the error, and the 90 % interval."""
    value, low, high = (round(100 * share) for share in (held["shrink"], *held["ci"]))
    return f"{value} % [{low}, {high}]"


def track_calibrate_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing track calibrate`, on stdout; the last line is the path of the report."""
    if result["frames"]:
        lines = []
        for name, frame in result["frames"].items():
            sigma = frame["sigma"]
            lines.append(
                (
                    name,
                    *(
                        f"{1e3 * frame[f'{axis}_m']:.2f} mm"
                        + ("" if sigma is None else f" +- {1e3 * sigma[f'{axis}_m']:.2g}")
                        for axis in "xyz"
                    ),
                )
            )
        _table("frames", ("", "x", "y", "z"), lines)
        positions, clock = result["positions"], result["clock"]
        what = "test positions" if positions["source"] == "standstills" else "poses of the motion"
        _say(
            f"{len(positions['errors'])} {what}: usual error {_mm(positions['position_sigma_m'])},"
            f" {_mrad(positions['rotation_sigma_rad'])} a component"
        )
        if "offset_s" in clock:
            _say(
                f"clocks: t_imu = t_tracker {-1e3 * clock['offset_s']:+.3f} ms, +-"
                f" {1e3 * clock['sigma_s']:.3f} ms. {clock['advice']}".strip()
            )
        if result["actuator_lag_s"] is not None:
            _say(f"actuators: {1e3 * result['actuator_lag_s']:.1f} ms behind the plan")
        if result["modes"] and result["modes"]["modes"]:
            _say("modes: " + ", ".join(f"{mode['frequency_hz']:.3g} Hz" for mode in result["modes"]["modes"]))
    for note in result["notes"]:
        _say(f"note: {note}")
    _last_line(folder)


def track_run_table(result: Mapping[str, Any], folder: Path) -> None:
    """The short answer of `truing track run`, on stdout; the last line is the path of the report."""
    names = ("truing", "hold", "velocity", "fk", "fk_velocity")
    lines = [
        (f"{1e3 * row['horizon_s']:g} ms", *(_mm(row[name]["rms_m"]) for name in names))
        for row in result["errors"]
    ]
    _table(
        "error of predictions against the tracker's later samples, rms",
        ("ahead", "truing", "hold", "tracker velocity", "joints", "joints' velocity"),
        lines,
    )
    if result["truth"] and result["truth"]["n"]:
        e = result["truth"]
        _say(
            f"true tool, {1e3 * result['horizon_s']:g} ms ahead: {_mm(e['rms_m'])} rms, worst"
            f" {_mm(e['max_m'])}; away from the plan {_mm(e['without_compensation']['rms_m'])} rms; NEES"
            f" {e['nees']:.3g} (6 expected)"
        )
    if result["rows"]:
        limited = (
            f", {100 * result['correction']['limited']:.0f} % of them limited"
            if result["correction"]["limited"] > 0.005
            else ""
        )
        _say(f"{result['made']} of {result['rows']} rows of the plan compensated{limited}")
    clock, modes = result["clock"], result["modes"]["modes"]
    if clock["estimated"]:
        _say(
            f"clocks: t_imu = t_tracker {-1e3 * clock['offset_s']:+.3f} ms, +-"
            f" {1e3 * clock['sigma_s']:.3f} ms"
        )
    if modes:
        _say(
            "modes: "
            + ", ".join(f"{mode['frequency_hz']:.3g} Hz" for mode in modes)
            + f" (from {result['modes']['source']})"
        )
    shares = result["status"]
    _say("status: " + ", ".join(f"{name} {100 * share:.1f} %" for name, share in shares.items() if share > 0))
    for shift in result["shifts"]:
        _say(
            f"the tracker jumped by {_mm(shift['jump_m'])} at {shift['t_s']:.2f} s"
            f" ({shift['cause'].replace('_', ' ')}): calibrate anew"
        )
    _last_line(folder)


def exam_table(result: Mapping[str, Any], folder: Path) -> None:
    """The score table of `truing exam`, on stdout; the last line is the path of the report."""
    from truing.exam.page import plain

    names = list(dict.fromkeys(name for score in result["scores"] for name in score))
    _table(
        "examination",
        [name.replace("_", " ") for name in names],
        [[plain(score.get(name)) for name in names] for score in result["scores"]],
    )
    _last_line(folder)


def _warn(messages: Sequence[str]) -> None:
    for message in messages:
        _err().print(f"warning: {message}", style="yellow", markup=False)


@contextlib.contextmanager
def _warnings_heard() -> Iterator[list[str]]:
    """Warnings about the input go to stderr, a line each, and into the list."""
    heard: list[str] = []

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        heard.append(str(message))
        _warn([str(message)])

    with warnings.catch_warnings():
        warnings.simplefilter("always", InputWarning)
        warnings.showwarning = show
        yield heard


def _busy(what: str, work: Callable[[], Result], own_bar: bool = False) -> Result:
    """Runs `work` in a thread, so that Ctrl-C works while the core computes; after a second a progress bar
    says what goes on, unless `work` has its `own_bar`.
    """
    outcome: list[Result] = []
    failure: list[BaseException] = []

    def run() -> None:
        try:
            outcome.append(work())
        except BaseException as error:  # noqa: BLE001  is raised again below, in the caller's thread
            failure.append(error)

    thread = threading.Thread(target=run, name=f"truing {what}", daemon=True)
    thread.start()
    thread.join(1.0)
    if thread.is_alive():
        with contextlib.nullcontext() if own_bar else _progress(what):
            while thread.is_alive():
                thread.join(0.1)
    if failure:
        raise failure[0]
    return outcome[0]


def _busy_counting(what: str, total: int, work: Callable[[Callable[[int], None]], Result]) -> Result:
    """The same for `work` that tells how many of `total` are done."""
    with _counting(what) as show:
        return _busy(what, lambda: work(lambda done: show(done, total)), own_bar=True)


def _counted(what: str, work: Callable[[Callable[[float], bool]], Result]) -> Result:
    """As `_busy`, for work that tells the share that is done; it is told to stop on Ctrl-C."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    share, stop = [0.0], threading.Event()

    def told(done: float) -> bool:
        share[0] = done
        return not stop.is_set()

    outcome: list[Result] = []
    failure: list[BaseException] = []

    def run() -> None:
        try:
            outcome.append(work(told))
        except BaseException as error:  # noqa: BLE001  is raised again below, in the caller's thread
            failure.append(error)

    thread = threading.Thread(target=run, name=f"truing {what}", daemon=True)
    thread.start()
    try:
        with Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeRemainingColumn(),
            console=_err(),
            transient=True,
            disable=not _err().is_terminal,
        ) as progress:
            task = progress.add_task(what, total=1.0)
            while thread.is_alive():
                thread.join(0.1)
                progress.update(task, completed=share[0])
    except KeyboardInterrupt:
        stop.set()
        raise
    if failure:
        raise failure[0]
    return outcome[0]


@contextlib.contextmanager
def _progress(what: str) -> Iterator[None]:
    """A moving bar on stderr, if that is a terminal, which goes away again."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=_err(), transient=True, disable=not _err().is_terminal) as progress:
        progress.add_task(what, total=None)
        yield


@contextlib.contextmanager
def _counting(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr, if that is a terminal, that is told how many of how many are done."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_err(), transient=True, disable=not _err().is_terminal) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; the exit status."""
    try:
        status = app(
            args=None if arguments is None else list(arguments), prog_name="truing", standalone_mode=False
        )
        sys.stdout.flush()
        code = status if isinstance(status, int) else 0
        if code == 130:  # newer typers make this of Ctrl-C
            _fail("interrupted", 130)
    except InputError as error:
        code = _fail(str(error), 2)
    except _ClickException as error:
        code = _usage(error)
    except (KeyboardInterrupt, typer.Abort):
        code = _fail("interrupted", 130)
    except BrokenPipeError:  # the reader of our output went away: not our trouble
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    if code == 130 and threading.active_count() > 1:
        # The core is still computing in its thread, and cannot be asked to stop; everything of ours is put
        # away.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(130)
    return code


def _fail(message: str, code: int) -> int:
    """One line on stderr."""
    sys.stderr.write("truing: " + " ".join(message.split()) + "\n")
    return code


def _usage(error: Any) -> int:
    """A usage error as one line. Help that was asked for by giving no command is printed as it is."""
    if type(error).__name__ == "NoArgsIsHelpError":
        if error.format_message():  # older typers leave the printing to the caller
            typer.echo(error.format_message(), err=True)
        return 2
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "truing"
    return _fail(f"{error.format_message()} (see {command} --help)", int(error.exit_code))


if __name__ == "__main__":
    sys.exit(main())
