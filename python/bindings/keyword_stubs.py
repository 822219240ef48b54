# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The keywords of Python's functions for type checkers and editors, from the stub of the core.

python keyword_stubs.py _core.pyi _keywords.pyi writes a TypedDict for every options class that a
function takes the fields of: `IdentifyKeywords` of `IdentifyOptions`. What functions take more freely than
the class does is said here: names as one text, effects as `truing.effects.Effects`.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

TAKEN = (
    "Identify",
    "Plan",
    "Distinguish",
    "Diagnose",
    "HandEye",
    "HandEyePlan",
    "Inverse",
    "Path",
    "Torque",
    "TorqueDiagnose",
    "TorquePlan",
)

HEAD = '''# Made by python/bindings/keyword_stubs.py from _core.pyi: run scripts/stubs.sh.
"""Keywords that are the fields of an options class, by class."""
from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from numpy.typing import ArrayLike

from truing import _core
from truing.effects import Effects
'''
# What pybind11 accepts, as a person would say it.
PLAIN = {
    "typing.SupportsFloat | typing.SupportsIndex": "float",
    "typing.SupportsInt | typing.SupportsIndex": "int",
    "collections.abc.Sequence[EffectRequest]": "Effects",
    "collections.abc.Sequence[str]": "str | Sequence[str]",
    "typing.Annotated[numpy.typing.ArrayLike, numpy.float64, '[3, 1]']": "ArrayLike",
    "collections.abc.": "",
    "typing.": "",
}


def plain(annotation: ast.expr, classes: set[str]) -> str:
    if isinstance(annotation, ast.Name) and annotation.id in classes:
        return f"_core.{annotation.id}"
    text = ast.unparse(annotation)
    for found, meant in PLAIN.items():
        text = text.replace(found, meant)
    return text


def meanings(cls: ast.ClassDef) -> dict[str, str]:
    """Docstrings of the attributes."""
    return {
        item.name: ast.get_docstring(item) or ""
        for item in cls.body
        if isinstance(item, ast.FunctionDef)
        and any(isinstance(mark, ast.Name) and mark.id == "property" for mark in item.decorator_list)
    }


def keywords_of(cls: ast.ClassDef, classes: set[str]) -> str:
    constructor = next(i for i in cls.body if isinstance(i, ast.FunctionDef) and i.name == "__init__")
    said = meanings(cls)
    lines = [f"class {cls.name.removesuffix('Options')}Keywords(TypedDict, total=False):"]
    for argument in constructor.args.kwonlyargs:
        assert argument.annotation is not None
        lines.append(f"    {argument.arg}: {plain(argument.annotation, classes)}")
        if said.get(argument.arg):
            body = said[argument.arg].replace("\n", "\n    ")
            lines.append(f'    """{body}"""')
    return "\n".join(line.rstrip() for line in "\n".join(lines).split("\n"))


def main(stub: Path, output: Path) -> None:
    body = [n for n in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(n, ast.ClassDef)]
    classes = {cls.name for cls in body}
    options = {f"{name}Options" for name in TAKEN}
    tables = [keywords_of(cls, classes) for cls in body if cls.name in options]
    output.write_text("\n\n".join([HEAD, *tables]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
