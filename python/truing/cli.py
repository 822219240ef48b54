# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command reads, lets the core work, and writes all of its files at once or none.

Exit status: 0 done, 1 did not converge, 2 bad input (one line on stderr, nothing written), 130 interrupted.
"""

from __future__ import annotations

import contextlib
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

import typer

from truing.errors import InputError, InputWarning

if TYPE_CHECKING:
    from rich.console import Console

    from truing import Measurements, Robot

Result = TypeVar("Result")

_HELP = "Find how a real robot differs from its model, name the cause, and remove it."
app = typer.Typer(name="truing", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=_HELP)

# Of a click error: in which package click lives is typer's business.
_ClickException: type[Exception] = typer.BadParameter.__mro__[2]

# ---- Arguments that commands share -------------------------------------------------------------------------------------

RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT", help="Robot file: robot.yaml or URDF.", show_default=False)]
DataFile = Annotated[Path, typer.Argument(metavar="DATA", help="Measurements: CSV or Parquet, one row per measured pose.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print result.json instead of a table.")]
Seed = Annotated[int, typer.Option(help="Of every random choice; the same seed gives the same result.", min=0)]
Free = Annotated[str, typer.Option(help="Parameters to find, names and globs: 'J2.*,*.ratio,tool.x'. Default: all geometry, base and targets.",
                                   show_default=False)]  # fmt: skip
Effects = Annotated[str, typer.Option(help="Effects to find as well: 'backlash,harmonic:J2+J3'. `truing effects` lists them.", show_default=False)]
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


class IndexName(str, Enum):
    """--index"""

    d = "d"
    a = "a"
    e = "e"
    inverse_condition = "inverse-condition"
    noise_amplification = "noise-amplification"


# ---- Quantities --------------------------------------------------------------------------------------------------------

_UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
    "angle": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "µrad": 1e-6, "deg": math.pi / 180, "°": math.pi / 180},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
}
_EXAMPLES = {"length": "0.03mm", "angle": "15deg", "time": "40ms"}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\s\d]*)\s*")


def quantity(text: str, kind: str, option: str) -> float:
    """`text` ("0.03mm", "15deg", "40ms") in SI. `kind`: length, angle or time. Raises InputError that names `option`."""
    match = _QUANTITY.fullmatch(text)
    units = _UNITS[kind]
    value = float(match[1]) if match else math.nan
    if match and match[2] in units and math.isfinite(value):
        return value * units[match[2]]
    if match and not match[2] and value == 0:
        return 0.0
    article = "an" if kind == "angle" else "a"
    raise InputError(f"{option}: found {text!r}, expected {article} {kind} with its unit ({', '.join(unit for unit in units if unit.isascii())}), such as {_EXAMPLES[kind]}")


def share(text: str, option: str) -> float:
    """`text` ("2%" or "0.02") as a share of 1. Raises InputError that names `option`."""
    try:
        value = float(text.strip().removesuffix("%")) * (0.01 if text.strip().endswith("%") else 1.0)
    except ValueError:
        value = math.nan
    if not 0 <= value < 1:
        raise InputError(f"{option}: found {text!r}, expected a share such as 2% or 0.02")
    return value


# ---- Commands ----------------------------------------------------------------------------------------------------------


def _print_version(wanted: bool) -> None:
    if wanted:
        import truing

        typer.echo(f"truing {truing.__version__}")
        raise typer.Exit


@app.callback(help=_HELP)
def _common(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)] = False) -> None:
    """Options of truing itself."""


@app.command()
def identify(
    robot: RobotFile,
    data: DataFile,
    out: Annotated[Optional[Path], _out("identify")] = None,
    free: Free = "",
    hold: Annotated[str, typer.Option(help="Names and globs that stay at nominal, e.g. 'base.*,J6.*'.")] = "",
    effects: Effects = "",
    loss: Annotated[LossName, typer.Option(help="What to do about outliers: find and leave them out, or weigh errors down.")] = LossName.reject,
    solver: Annotated[SolverName, typer.Option(help="Levenberg-Marquardt of the palletizer method, or Ceres.")] = SolverName.lm,
    frame: Annotated[FrameName, typer.Option(help="Measurement frame: six more parameters, or registered after every step.")] = FrameName.parameters,
    test_share: Annotated[str, typer.Option(help="Share of the poses held out, when the data has no `set` column.")] = "20%",
    seed: Seed = 0,
    rotation_length: Annotated[str, typer.Option(help="A rotation error of 1 rad counts as this length.")] = "0.1m",
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
    held_out, length = share(test_share, "--test-share"), quantity(rotation_length, "length", "--rotation-length")
    with _warnings_heard() as heard:
        model, table = _load(robot, data, base_link, tip_link)

        def work() -> Any:
            import truing

            return truing.identify(model, table, free=free, hold=hold, effects=effects, solver=solver.value, loss=loss.value, frame_by=frame.value,
                                   rotation_length=length, test_share=held_out, seed=seed, threads=threads,
                                   raise_if_not_converged=False)  # fmt: skip

        found = _busy("identifying", work)
        with atomic_output_dir(folder) as temporary, _progress("writing"):
            from truing.results import write_identification

            result = write_identification(temporary, found, table, seed=seed, source=data.name, warnings=heard, nominal_file=robot,
                                          base_link=base_link, tip_link=tip_link)  # fmt: skip
    _warn(found.warnings)
    if json:
        _print_json(result)
    else:
        identification_table(result, folder)
    if not found.solver.converged:
        _err().print(f"truing: did not converge: {found.solver.stopped_because}", style="bold red", markup=False, highlight=False)
        raise typer.Exit(1)


@app.command()
def predict(
    robot: RobotFile,
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Rows of joints and inputs (CSV or Parquet), measured or not.", show_default=False)],
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
            from truing.results import predicted_rows, prediction_columns, prediction_dict, without_nan

            predicted = truing.predict(model, table)
            columns = prediction_columns(model, table, predicted)
            rows = predicted_rows(model, table, predicted)
            return columns, rows, without_nan(prediction_dict(model, rows, heard))

        columns, rows, result = _busy("predicting", work)
        with atomic_output_dir(folder) as temporary:
            from truing.report import prediction_report
            from truing.results import to_json

            write_table(temporary / "predicted.csv", columns)
            (temporary / "result.json").write_text(to_json(result), encoding="utf-8")
            (temporary / "report.html").write_text(prediction_report(result, rows), encoding="utf-8")
    if json:
        _print_json(result)
        return
    errors = result.get("errors")
    lines = [("rows predicted", str(result["rows"]))]
    if errors:
        lines += [(f"measured error, {name}", _mm(errors[key])) for name, key in
                  (("mean", "mean_m"), ("rms", "rms_m"), ("95 %", "p95_m"), ("worst", "max_m"))]  # fmt: skip
    _table(f"{result['robot']}: prediction", ("", ""), lines)
    _last_line(folder)


@app.command()
def simulate(
    robot: RobotFile,
    out: Annotated[Optional[Path], _out("simulate")] = None,
    effect: Annotated[Optional[list[str]], typer.Option(help="Effect of the true robot, 'backlash:J2=0.2mrad', 'harmonic:J3:cos1=1e-4'; may be repeated.",
                                                        show_default=False)] = None,  # fmt: skip
    poses: Annotated[int, typer.Option(help="Number of random poses within the joint limits.", min=1)] = 200,
    seed: Seed = 0,
    noise: Noise = "0.03mm",
    geometry_error: Annotated[str, typer.Option(help="Standard deviations of the hidden errors: of lengths, of angles, and (optional) of gear ratios.")] = "1mm,1mrad",
    perturb: Annotated[str, typer.Option(help="Only these values get errors, names and globs. Default: all.", show_default=False)] = "",
    outliers: Annotated[str, typer.Option(help="Gross errors: share of the rows and size, such as 2%:5mm.", show_default=False)] = "",
    columns: Annotated[str, typer.Option(help="More recorded inputs: dir,payload,temp,t.", show_default=False)] = "",
    orientation: Annotated[bool, typer.Option("--orientation", help="Measure orientations as well.")] = False,
    rotation_noise: Annotated[str, typer.Option(help="Standard deviation of measured orientations about each axis.")] = "0.1mrad",
    plan: Annotated[Optional[Path], typer.Option(metavar="POSES.csv", help="Measure these poses (columns q1_rad …) instead.", show_default=False)] = None,
    base_unknown: Annotated[bool, typer.Option("--base-unknown", help="Put the robot somewhere unknown in the measurement frame.")] = False,
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Measure a simulated robot with hidden errors.

    Writes measurements.csv, truth.json, robot.yaml (nominal, as it came in), true_robot.yaml.
    """
    from truing.files import atomic_output_dir, load_measurements, load_robot, load_units, save_measurements, save_robot

    folder = out or Path("truing-simulate")
    sizes = _geometry_error(geometry_error)
    outlier_share, outlier_length = _outliers(outliers)
    sigma, rotation_sigma = quantity(noise, "length", "--noise"), quantity(rotation_noise, "angle", "--rotation-noise")
    effects = dict(_simulated_effect(text) for text in effect or ())
    with _warnings_heard():
        model = load_robot(robot, base_link, tip_link)
        joints = None if plan is None else load_measurements(plan, model, joints_only=True).joints

        def work() -> Any:
            from truing.simulation import simulate as run

            return run(model, joints=joints, poses=poses, effects=effects, noise=sigma, lengths=sizes[0], angles=sizes[1], ratios=sizes[2],
                       only=_words(perturb), orientation=orientation, rotation_noise=rotation_sigma, outlier_share=outlier_share,
                       outlier_length=outlier_length, columns=_words(columns), base_unknown=base_unknown, seed=seed)  # fmt: skip

        simulated = _busy("simulating", work)
        with atomic_output_dir(folder) as temporary:
            from truing.results import to_json

            truth = simulated.to_dict()
            units = load_units(robot)
            save_measurements(temporary / "measurements.csv", simulated.data, model)
            (temporary / "truth.json").write_text(to_json(truth), encoding="utf-8")
            save_robot(temporary / "robot.yaml", model, units=units)
            save_robot(temporary / "true_robot.yaml", simulated.truth.robot, units=units)
    if json:
        _print_json(truth)
        return
    lines = [("rows", str(simulated.data.rows)), ("noise per axis", _mm(sigma)), ("outliers", str(len(simulated.outlier_rows))),
             ("hidden errors", str(len(simulated.truth.parameters)))]  # fmt: skip
    lines += [(f"  {e.parameter}", f"{e.value:.4g}") for e in simulated.truth.effects]
    _table(f"{model.name}: simulated measurements", ("", ""), lines)
    _say(str(folder / "measurements.csv"))


@app.command()
def plan(
    robot: RobotFile,
    out: Annotated[Optional[Path], _out("plan")] = None,
    poses: Annotated[int, typer.Option(help="Number of poses.", min=1)] = 50,
    min_step: Annotated[str, typer.Option(help="Every revolute joint moves by more from pose to pose.")] = "15deg",
    index: Annotated[IndexName, typer.Option(help="What the plan makes large: determinant, minus the sum of variances, smallest singular value, …")] = IndexName.d,
    orientation: Annotated[bool, typer.Option("--orientation", help="Orientations will be measured as well.")] = False,
    noise: Noise = "0.03mm",
    seed: Seed = 0,
    free: Free = "",
    effects: Effects = "",
    base_link: BaseLink = "",
    tip_link: TipLink = "",
    json: Json = False,
) -> None:
    """Choose the poses that tell most about the robot.

    Writes poses.csv, result.json, report.html (what standard errors to expect).
    """
    from truing.files import atomic_output_dir, load_robot, write_table

    folder = out or Path("truing-plan")
    step, sigma = quantity(min_step, "angle", "--min-step"), quantity(noise, "length", "--noise")
    long_index = {"d": "d_optimal", "a": "a_optimal", "e": "e_optimal"}.get(index.value, index.value.replace("-", "_"))
    with _warnings_heard() as heard:
        model = load_robot(robot, base_link, tip_link)

        def work() -> Any:
            import truing

            return truing.plan(model, poses=poses, min_step=step, index=long_index, orientation=orientation,  # type: ignore[arg-type]
                               position_sigma=sigma, seed=seed, free=free, effects=effects)  # fmt: skip

        planned = _busy("planning", work)
        with atomic_output_dir(folder) as temporary:
            from truing.report import plan_report
            from truing.results import joint_columns, plan_dict, to_json, without_nan

            result: dict[str, Any] = without_nan(plan_dict(model, planned, index=long_index, noise=sigma, seed=seed, warnings=heard))
            columns = joint_columns(model, planned.joints)
            write_table(temporary / "poses.csv", columns)
            (temporary / "result.json").write_text(to_json(result), encoding="utf-8")
            driven = [model.joints[k] for k in model.driven_joints()]
            page = plan_report(result, [joint.name for joint in driven], planned.joints, ["rad" if joint.type == "revolute" else "m" for joint in driven])
            (temporary / "report.html").write_text(page, encoding="utf-8")
    if json:
        _print_json(result)
        return
    seen = [p for p in result["parameters"] if p["sigma"] is not None]
    lines = [("poses", str(poses)), ("parameters found", f"{len(seen)} of {len(result['parameters'])}")]
    for unit, word in (("m", "length"), ("rad", "angle")):
        sigmas = [p["sigma"] for p in seen if p["unit"] == unit]
        if sigmas:
            lines.append((f"largest standard error of a {word}".replace("a a", "an a"), _mm(max(sigmas)) if unit == "m" else f"{max(sigmas) * 1e3:.3g} mrad"))
    _table(f"{model.name}: plan", ("", ""), lines)
    _last_line(folder)


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
def effects() -> None:
    """List the effects that truing knows."""
    import truing

    _table("effects", ("name", "what it is"), truing.catalogue())


# ---- Reading -----------------------------------------------------------------------------------------------------------


def _load(robot: Path, data: Path, base_link: str, tip_link: str, joints_only: bool = False) -> tuple[Robot, Measurements]:
    from truing.files import load_measurements, load_robot

    model = load_robot(robot, base_link, tip_link)
    return model, _busy("reading", lambda: load_measurements(data, model, joints_only=joints_only))


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _geometry_error(text: str) -> tuple[float, float, float]:
    parts = _words(text)
    if len(parts) not in (2, 3):
        raise InputError(f"--geometry-error: found {text!r}, expected a length, an angle and perhaps a gear-ratio error, such as 1mm,1mrad or 1mm,1mrad,1e-4")
    ratio = 0.0
    if len(parts) == 3:
        try:
            ratio = float(parts[2])
        except ValueError:
            raise InputError(f"--geometry-error: found {parts[2]!r} for gear ratios, expected a plain number such as 1e-4") from None
    sizes = quantity(parts[0], "length", "--geometry-error"), quantity(parts[1], "angle", "--geometry-error"), ratio
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
        raise InputError(f"--effect: found {text!r}, expected effect:joint=size such as backlash:J2=0.2mrad, effect:joint:part=size, or scale=size")
    for kind in ("angle", "length"):
        with contextlib.suppress(InputError):
            return ".".join(words), quantity(size, kind, "--effect")
    try:
        value = float(size)  # of whatever unit the effect's parameter has
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"--effect: found the size {size!r} in {text!r}, expected a number (SI) or a quantity such as 0.2mrad")
    return ".".join(words), value


# ---- Saying ------------------------------------------------------------------------------------------------------------


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
    from truing.results import to_json

    sys.stdout.write(to_json(result))


def _mm(metres: float | None) -> str:
    return "-" if metres is None else f"{metres * 1e3:.4f} mm"


def _table(title: str, head: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_header=any(head))
    for k, name in enumerate(head):
        table.add_column(name, justify="left" if k == 0 or len(head) == 2 else "right", overflow="fold")
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
            for key, what in (("mean_m", "mean"), ("p95_m", "95 %"), ("max_m", "worst")) if name == "test" or not held_out else (("mean_m", "mean"),):
                lines.append((f"{label}, {what}", _mm(e["before"][key]), _mm(e["after"][key])))
    _table(f"{result['robot']}: errors before and after", ("", "before", "after"), lines)
    noise, rejected, frozen = result["noise_sigma_m"], len(result["rejected_rows"]), result["frozen"]
    _say(f"{result['rank']} of {result['columns']} parameters found; noise {_mm(noise)} (1 sigma); {rejected} rows rejected; "
         f"{result['solver']['iterations']} iterations: {result['solver']['stopped_because']}")  # fmt: skip
    if frozen:
        more = f" and {len(frozen) - 8} more" if len(frozen) > 8 else ""
        _say("not visible in these data, kept at nominal: " + ", ".join(f["parameter"] for f in frozen[:8]) + more)
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


def _busy(what: str, work: Callable[[], Result]) -> Result:
    """Runs `work` in a thread, so that Ctrl-C works while the core computes; after a second a progress bar says what goes on."""
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
        with _progress(what):
            while thread.is_alive():
                thread.join(0.1)
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; the exit status."""
    try:
        status = app(args=None if arguments is None else list(arguments), prog_name="truing", standalone_mode=False)
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
        # The core is still computing in its thread, and cannot be asked to stop; everything of ours is put away.
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
