# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""From the words on the command line to a command, and from its outcome to the exit status.

A command is found by listing the folder `commands/`, described by the docstring and the PANEL at the top of
its file, and imported only when it runs or its own help is asked for: `truing --help` stays quick.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import io
import os
import re
import signal
import sys
import threading
from collections.abc import Sequence
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from truing.cli.interrupts import was_interrupted
from truing.cli.options import Choice, Default, File, Flag, Kind
from truing.cli.tables import harmless
from truing.errors import InputError, did_you_mean

COMMANDS = Path(__file__).parent / "commands"

PANELS = (
    "Calibrate",
    "Diagnose",
    "Hand-eye",
    "Inverse kinematics",
    "Apply",
    "Track",
    "Dynamics",
    "Fleets",
    "Try out",
)
"""Headings of `truing --help` in their order; others come last."""

_WIDEST = 24  # characters of a metavar

# Of a click error: in which package click lives is typer's business.
_ClickException: type[Exception] = typer.BadParameter.__mro__[2]


# ---- What a file says of its command -----------------------------------------------------------------------


class Place:
    """A file or a folder in `commands/`."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def is_group(self) -> bool:
        return self.path.is_dir()

    @property
    def name(self) -> str:
        return self.path.stem.replace("_", "-")

    @property
    def module(self) -> str:
        words = self.path.relative_to(COMMANDS).with_suffix("").parts
        return ".".join(("truing.cli.commands", *words))

    def about(self) -> tuple[str, str | None]:
        """Its help and its panel, read from the text of the file: nothing is imported."""
        text = (self.path / "__init__.py" if self.is_group else self.path).read_text(encoding="utf-8")
        panel = re.search(r'^PANEL = "(.*)"$', text, re.MULTILINE)
        return inspect.cleandoc(text.split('"""')[1]), panel[1] if panel else None


def places(folder: Path) -> dict[str, Place]:
    """The commands of a folder by name, in the order of their panels."""
    found = [
        Place(path)
        for path in sorted(folder.iterdir())
        if not path.name.startswith("_") and (path.suffix == ".py" or (path / "__init__.py").exists())
    ]

    def order(place: Place) -> tuple[int, str]:
        panel = place.about()[1]
        return PANELS.index(panel) if panel in PANELS else len(PANELS), place.name

    return {place.name: place for place in sorted(found, key=order)}


class LazyGroup(TyperGroup):
    """The commands of a folder."""

    folder = COMMANDS

    def get_params(self, ctx: Any) -> Any:
        flags = super().get_params(ctx)
        for flag in flags:  # without a default typer loads pydantic to make sure of nothing
            flag.default = flag.default or False
        return flags

    def list_commands(self, ctx: Any) -> list[str]:
        return list(places(self.folder))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        known = places(self.folder)
        if args and args[0] not in known and not args[0].startswith("-"):
            hint = did_you_mean(args[0], known) or f"there are {', '.join(known)} "
            ctx.fail(f"No such command {args[0]!r}; {hint.rstrip()}")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        place = places(self.folder).get(cmd_name)
        if place is None:
            return None
        text, panel = place.about()
        if not place.is_group:
            return LazyCommand(place, text, panel)
        group = LazyGroup(name=place.name, help=text, rich_help_panel=panel, no_args_is_help=True)
        group.folder = place.path
        return group


class LazyCommand(TyperCommand):
    """A command whose module is imported when its options are asked for."""

    def __init__(self, place: Place, help: str, panel: str | None) -> None:
        super().__init__(name=place.name, callback=self._run, help=help, rich_help_panel=panel)
        self.place = place
        self._bound: list[Bound] = []

    def get_params(self, ctx: Any) -> Any:
        if not self._bound:
            words = ctx.command_path.split()[1:]
            self._bound = bind(importlib.import_module(self.place.module).Command, "-".join(words))
            self.params = typer_parameters(self._bound)
        return super().get_params(ctx)

    def _run(self, **raw: Any) -> int:
        command = importlib.import_module(self.place.module).Command
        options = {bound.field.name: bound.value(raw[bound.field.name]) for bound in self._bound}
        status: int = command(**options).run()
        return status


# ---- From fields to options --------------------------------------------------------------------------------


class Bound(NamedTuple):
    """A field of a command, its kind, and its default."""

    field: Field[Any]
    kind: Kind
    default: Any  # MISSING: it must be given

    @property
    def flag(self) -> str:
        return self.kind.flag or "--" + self.field.name.replace("_", "-")

    @property
    def shown_default(self) -> str | None:
        """As the user would write it; None where the help says it in words."""
        if self.default is MISSING or self.default in (None, "", [], ()) or isinstance(self.kind, Flag):
            return None
        return self.kind.show(self.default)

    def value(self, raw: Any) -> Any:
        """What the command gets for what the user wrote."""
        if isinstance(self.kind, Flag):
            return bool(raw)
        if self.kind.several:
            return [self.kind.read(text, self.flag) for text in raw or ()]
        if raw is None or raw == self.shown_default:  # a default is taken as it is, not by way of its text
            return self.default
        return self.kind.read(raw, self.kind.metavar if self.kind.argument else self.flag)


def bind(command: type[Any], name: str) -> list[Bound]:
    """The options of a command, those that all commands have last."""
    from truing.cli.run import Command

    hints = get_type_hints(command, include_extras=True)
    shared = {field.name for field in fields(Command)}
    bound = []
    for field in sorted(fields(command), key=lambda field: field.name in shared):
        type_, kind = get_args(hints[field.name])
        if isinstance(kind, Choice) and not kind.values:
            kind.values = {word: word for word in literal_words(type_)}
        default = field.default
        if field.name == "out":
            default = Path(command.folder or f"truing-{name}")
        bound.append(Bound(field, kind, default.lookup() if isinstance(default, Default) else default))
    return bound


def literal_words(type_: Any) -> tuple[str, ...]:
    """The words of a Literal, or of the Literal in a union with None."""
    if get_origin(type_) is Literal:
        return get_args(type_)
    return next((words for member in get_args(type_) if (words := literal_words(member))), ())


def typer_parameters(bound: Sequence[Bound]) -> list[Any]:
    """The options as typer wants them: text, which `Bound.value` reads."""

    def no_command(**_: Any) -> None: ...

    parameters = []
    for one in bound:
        default: Any = inspect.Parameter.empty if one.default is MISSING else one.shown_default
        annotation: Any = str | None
        if isinstance(one.kind, Flag):
            annotation, default = bool, False
        elif one.kind.several and not (one.kind.argument and one.default is MISSING):
            annotation, default = list[str] | None, None
        elif one.kind.several:
            annotation = list[Path] if isinstance(one.kind, File) else list[str]
        elif default is inspect.Parameter.empty:
            annotation = Path if isinstance(one.kind, File) else str
        parameters.append(
            inspect.Parameter(
                one.field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=default,
                annotation=Annotated[annotation, typer_info(one)],
            )
        )
    no_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    no_command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    app = typer.Typer(add_completion=False)
    app.command()(no_command)
    return list(typer.main.get_command(app).params)


def typer_info(one: Bound) -> Any:
    kind = one.kind

    def complete(incomplete: str) -> list[str]:
        return kind.complete(incomplete)

    if kind.argument:
        return typer.Argument(
            metavar=kind.metavar, help=kind.help, show_default=False, autocompletion=complete
        )
    if isinstance(kind, Flag):
        return typer.Option(
            one.flag, help=kind.help, metavar="", rich_help_panel=kind.panel, show_default=False
        )
    help, metavar = kind.help, kind.metavar
    if isinstance(kind, Choice):
        metavar = "|".join(kind.values)
        if len(metavar) > _WIDEST:  # would leave no room for the help
            help, metavar = f"{help} One of {', '.join(kind.values)}.", "WORD"
    return typer.Option(
        one.flag,
        help=help,
        metavar=metavar,
        rich_help_panel=kind.panel,
        show_default=one.shown_default is not None,
        autocompletion=complete,
    )


# ---- truing itself -----------------------------------------------------------------------------------------


def _print_version(wanted: bool) -> None:
    if wanted:
        import truing

        typer.echo(f"truing {truing.__version__}")
        raise typer.Exit


def _application() -> Any:
    """The click command of the whole."""
    help = Place(COMMANDS).about()[0]
    app = typer.Typer(
        name="truing", cls=LazyGroup, no_args_is_help=True, pretty_exceptions_enable=False, help=help
    )

    @app.callback(help=help)
    def common(
        version: Annotated[
            bool,
            typer.Option(
                "--version", help="Print the version and exit.", is_eager=True, callback=_print_version
            ),
        ] = False,
    ) -> None:
        """Options of truing itself."""

    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; the exit status."""
    lost = _prepare_streams()
    try:
        status = _application()(
            args=None if arguments is None else list(arguments), prog_name="truing", standalone_mode=False
        )
        sys.stdout.flush()
        code = status if isinstance(status, int) else 0
        if code == 130:  # newer typers make this of Ctrl-C
            _fail("interrupted", 130)
        elif lost:
            code = _fail("standard output is closed: what would have been printed is lost", code or 1)
    except InputError as error:
        code = _fail(str(error), 2)
    except _ClickException as error:
        code = _usage(error)
    except (KeyboardInterrupt, typer.Abort):
        code = _fail("interrupted", 130)
    except BrokenPipeError:
        code = 0  # the reader of our output went away: not our trouble
    except SystemExit as error:  # rich makes one of a broken pipe, too
        code = 0 if isinstance(error.__context__, BrokenPipeError) else _code_of(error)
    except OSError as error:  # a full disk, say: no fault of the input, nor of the program
        code = _fail(_words_of(error), 1)
    except MemoryError:
        code = _fail("the memory does not suffice: give fewer rows or a smaller file", 1)
    except Exception as error:
        if not was_interrupted(error):
            raise
        code = _fail("interrupted", 130)
    _empty_streams()
    if arguments is None:  # the process is ours, and all is done
        # Ctrl-C while Python puts itself away would only be a traceback.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if code == 130 and threading.active_count() > 1:
            # The core is still computing in its thread, and cannot be asked to stop; all of ours is put away.
            os._exit(130)
    return code


def _code_of(error: SystemExit) -> int:
    """As Python takes it: nothing is 0, a text is printed and 1."""
    if error.code is None or isinstance(error.code, int):
        return error.code or 0
    return _fail(str(error.code), 1)


def _prepare_streams() -> bool:
    """Makes sure that there is something to print to, and that every character can be printed. True: standard
    output is closed.
    """
    lost = sys.stdout is None
    if lost or sys.stderr is None:
        while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
            pass  # else the next file to be opened were standard output, to whatever prints there
        os.close(descriptor)
        sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    return lost


def _empty_streams() -> None:
    """What cannot be written any more is dropped here: Python would complain of it in its own words."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)


def _words_of(error: OSError) -> str:
    """What the operating system said, and of which file."""
    text = error.strerror or str(error)
    return f"{error.filename}: {text}" if error.filename else text


def _fail(message: str, code: int) -> int:
    """One line on stderr."""
    with contextlib.suppress(OSError):
        sys.stderr.write("truing: " + harmless(" ".join(message.split())) + "\n")
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
