# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An effect knows itself: no code outside cpp/src/model/effects knows one by its name.

The rule: a string literal of cpp/src or python/truing is not, and does not begin with, the name of an effect
of the catalogue ("backlash", "backlash:J2", "transmission_error@"). Not searched: cpp/src/model/effects
itself; exam/, whose effects are its own and share nothing with the catalogue; dynamics/export/parts.py,
which sorts the effects on torques, some of them of the same names, by what simulators have for their laws;
dynamics/servo and dynamics/servo.cpp, whose names are values of the actuator chain; comments, docstrings and
sentences, where a name is an example. Words that mean something else, and requests of the demonstration,
are listed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import truing.effects
from truing import _core

ROOT = Path(__file__).resolve().parents[3]
NAMES = [effect.name for effect in _core.catalogue_effects()]
EFFECT = re.compile(rf"(?:{'|'.join(NAMES)})(?![a-z_ ])")
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)

# File, and a literal that may stand there.
OTHER_MEANING = {
    ("python/truing/tracking/result.py", "drift"),  # of two clocks [s/s]
    ("python/truing/tracking/page.py", "drift"),
    ("python/truing/files/link_meshes.py", "scale"),  # of a mesh, as a URDF has it
    ("python/truing/cli/commands/demo.py", "backlash:J3"),  # a request, as a user makes it
    ("python/truing/cli/commands/demo.py", "backlash.J3"),  # and what was hidden for it
}


def cpp_literals(path: Path) -> Iterator[str]:
    yield from LITERAL.findall(COMMENT.sub("", path.read_text(encoding="utf-8")))


def python_literals(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            yield node.value


def sources() -> dict[str, Path]:
    servo = ROOT / "cpp" / "src" / "dynamics" / "servo.cpp"
    cpp = (p for p in (ROOT / "cpp" / "src").rglob("*.[ch]pp") if "effects" not in p.parts and p != servo)
    sorts_torques = ROOT / "python" / "truing" / "dynamics" / "export" / "parts.py"
    python = (
        p
        for p in (ROOT / "python" / "truing").rglob("*.py")
        if not {"exam", "servo"} & set(p.parts) and p != sorts_torques
    )
    return {path.relative_to(ROOT).as_posix(): path for path in (*cpp, *python)}


@pytest.mark.parametrize("file", sorted(sources()))
def test_no_effect_is_known_by_its_name(file: str) -> None:
    path = sources()[file]
    literals = cpp_literals(path) if path.suffix != ".py" else python_literals(path)
    found = [
        text
        for text in literals
        if EFFECT.match(text) and len(text.split()) == 1 and (file, text) not in OTHER_MEANING
    ]
    assert not found, f"{file} knows {found}: let it ask for a trait (truing/model/effect.hpp)"


def test_the_table_of_effects_is_the_one_that_they_tell() -> None:
    text = (ROOT / "docs" / "reference" / "effects.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- catalogue: [^\n]*-->\n(.*?)<!-- end -->", text, re.DOTALL)
    assert found and found[1] == truing.effects.markdown_table(), (
        "docs/reference/effects.md: put what truing.effects.markdown_table() returns between the two marks"
    )


def test_every_effect_says_what_it_is() -> None:
    for effect in _core.catalogue_effects():
        law, parameters, _ = effect.traits.documentation
        assert effect.summary and law and parameters, effect.name
        assert all(name in NAMES for name in effect.traits.mimicked_by), effect.name
