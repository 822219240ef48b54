# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands are found by their files, their help is quick and true, and shells complete them."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pytest

import truing
import truing.cli.commands
from truing import _core
from truing.cli import app, main
from truing.cli.options import Flag

DOCS = Path(__file__).resolve().parents[3] / "docs"


def every_command(folder: Path = app.COMMANDS) -> list[app.Place]:
    found = []
    for place in app.places(folder).values():
        found += every_command(place.path) if place.is_group else [place]
    return found


def words_of(place: app.Place) -> list[str]:
    return place.module.removeprefix("truing.cli.commands.").split(".")


COMMANDS = [pytest.param(place, id=" ".join(words_of(place))) for place in every_command()]


def bound(place: app.Place) -> list[app.Bound]:
    return app.bind(importlib.import_module(place.module).Command, "-".join(words_of(place)))


# ---- Help


@pytest.mark.parametrize("place", COMMANDS)
def test_help_names_every_option_with_its_default(
    place: app.Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert main([*words_of(place), "--help"]) == 0
    text = capsys.readouterr().out
    assert place.about()[0].splitlines()[0] in text
    for one in bound(place):
        name = one.kind.metavar if one.kind.argument else one.flag
        assert re.search(rf"{re.escape(name)}(?!\w)", text), name
        if one.shown_default is not None:
            assert f"[default: {one.shown_default}]" in text, name


@pytest.mark.parametrize("place", COMMANDS)
def test_what_a_file_says_without_being_imported_is_what_it_says(place: app.Place) -> None:
    module = importlib.import_module(place.module)
    assert place.about()[1] == getattr(module, "PANEL", None)
    assert module.__doc__ is not None and place.about()[0] == module.__doc__.strip()


def default_of(command: str, field: str) -> Any:
    place = next(place for place in every_command() if " ".join(words_of(place)) == command)
    return next(one for one in bound(place) if one.field.name == field).default


@pytest.mark.parametrize(
    ("command", "field", "expected"),
    [
        ("identify", "solver", _core.IdentifyOptions().solver),
        ("identify", "loss", _core.IdentifyOptions().loss),
        ("identify", "frame_by", _core.IdentifyOptions().frame_by),
        ("identify", "test_share", _core.IdentifyOptions().test_share),
        ("identify", "rotation_length", _core.IdentifyOptions().rotation_length),
        ("diagnose", "false_alarm", _core.DiagnoseOptions().false_alarm),
        ("plan", "poses", _core.PlanOptions().poses),
        ("plan", "min_step", _core.PlanOptions().min_step),
        ("plan", "index", _core.PlanOptions().index),
        ("plan", "noise", _core.PlanOptions().position_sigma),
        ("plan", "add", _core.DistinguishOptions().add),
        ("plan", "payload", _core.DistinguishOptions().payload),
        ("handeye", "setup", _core.HandEyeOptions().setup),
        ("handeye", "method", _core.HandEyeOptions().method),
        ("ik", "choose", _core.InverseOptions().choose),
        ("ik", "longest_turn", _core.PathOptions().longest_turn),
        ("ik", "longest_slide", _core.PathOptions().longest_slide),
        ("track run", "horizon", _core.DeviationOptions().horizon),
        ("simulate", "seconds", _core.StreamSimulationOptions().seconds),
        ("simulate", "motion", _core.StreamSimulationOptions().motion),
        ("simulate", "tip_speed", _core.StreamSimulationOptions().tip_speed),
    ],
)
def test_defaults_are_those_of_the_core(command: str, field: str, expected: Any) -> None:
    assert default_of(command, field) == expected


@pytest.mark.parametrize("place", COMMANDS)
def test_a_default_survives_its_text(place: app.Place) -> None:
    """What the help shows can be written, and means the same."""
    for one in bound(place):
        if one.shown_default is not None:
            read = one.kind.read(one.shown_default, one.flag)
            if isinstance(one.default, str | Path):
                assert read == one.default, one.flag
            else:
                assert read == pytest.approx(one.default, rel=1e-12), one.flag
            assert one.value(one.shown_default) is one.default  # nothing is lost on the way


@pytest.mark.parametrize("place", COMMANDS)
def test_every_option_is_in_the_page_of_commands(place: app.Place) -> None:
    page = next(DOCS.rglob("commands.md")).read_text(encoding="utf-8")
    sections = re.split(r"^## ", page, flags=re.MULTILINE)[1:]
    name = " ".join(words_of(place))
    section = next(text for text in sections if re.search(rf"`truing {name}\b", text.splitlines()[0]))
    for one in bound(place):
        if not one.kind.argument:
            assert f"`{one.flag}" in section, one.flag
            if one.shown_default is not None and one.field.name not in ("out", "seed", "threads"):
                assert f"`{one.shown_default}`" in section or f" {one.shown_default} " in section, one.flag
        elif one.default is MISSING:
            assert one.kind.metavar in section


# ---- What is imported


def modules_after(*arguments: str) -> set[str]:
    program = (
        "import sys; from truing.cli import main; code = main(sys.argv[1:]); "
        "sys.stderr.write('\\n'.join(sys.modules)); sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True
    )
    return set(done.stderr.split())


HEAVY = {
    "numpy",
    "pandas",
    "scipy",
    "pyarrow",
    "pydantic",
    "truing._core",
    "truing.public",
    "truing.files",
}


def test_help_of_the_whole_imports_nothing_heavy_and_no_command() -> None:
    for arguments in (["--help"], ["track", "--help"]):
        found = modules_after(*arguments)
        assert not found & HEAVY
        assert not {name for name in found if name.startswith("truing.cli.commands.")}


def test_help_of_a_command_imports_that_command_alone() -> None:
    found = modules_after("identify", "--help")
    assert {name for name in found if name.startswith("truing.cli.commands.")} == {
        "truing.cli.commands.identify"
    }
    assert not found & {"pyarrow"}


# ---- A new command


NEW = '''"""Say hello.

It writes hello.txt.
"""

from dataclasses import dataclass
from typing import Annotated

from truing.cli import run
from truing.cli.options import Count

PANEL = "Greetings"


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[None, str]):
    doing = "greeting"
    times: Annotated[int, Count("How often.", least=1)] = 2

    def load(self, progress):
        return None

    def solve(self, loaded, progress):
        return " ".join(["hello"] * self.times)

    def write(self, folder, loaded, found, warnings):
        (folder / "hello.txt").write_text(found)
        return {"text": found}

    def table(self, result, found):
        print(result["text"])
'''


def test_a_command_is_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "commands"
    shutil.copytree(app.COMMANDS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "greet.py").write_text(NEW)
    monkeypatch.setattr(app, "COMMANDS", folder)
    monkeypatch.setattr(app.LazyGroup, "folder", folder)
    monkeypatch.setattr(truing.cli.commands, "__path__", [str(folder)])
    monkeypatch.chdir(tmp_path)
    assert main(["--help"]) == 0
    help = capsys.readouterr().out
    assert "Greetings" in help and "Say hello." in help
    assert main(["greet", "--times", "3"]) == 0
    assert capsys.readouterr().out == "hello hello hello\n"
    assert Path("truing-greet/hello.txt").read_text() == "hello hello hello"
    assert main(["greet", "--times", "0"]) == 2
    assert capsys.readouterr().err == "truing: --times: found '0', expected a whole number, 1 or more\n"
    sys.modules.pop("truing.cli.commands.greet")


def test_python_m_truing() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "truing", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"truing {truing.__version__}\n"


# ---- Completion


def completed(line: str) -> list[str]:
    environment = {
        **os.environ,
        "_TRUING_COMPLETE": "complete_bash",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split(" ")) - 1),
    }
    done = subprocess.run(
        [sys.executable, "-m", "truing"], capture_output=True, text=True, env=environment, check=False
    )
    return done.stdout.split()


def test_commands_options_choices_and_effects_are_completed() -> None:
    assert {"identify", "handeye", "track"} <= set(completed("truing "))
    assert completed("truing track ca") == ["calibrate"]
    assert completed("truing identify --sol") == ["--solver"]
    assert completed("truing identify --solver ") == ["lm", "ceres"]
    assert completed("truing identify --effects drift,backl") == ["drift,backlash"]


def test_files_are_left_to_the_shell() -> None:
    assert completed("truing identify ") == []
    assert completed("truing handeye poses.csv --camera ") == []


def test_flags_have_no_default_to_show() -> None:
    for place in every_command():
        assert all(one.default is False for one in bound(place) if isinstance(one.kind, Flag))
