# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Keywords of functions that are the fields of an options class. A field is stated once, in its C++ header.

    @takes(_core.PlanOptions)
    def plan(robot: Robot, **options: Unpack[PlanKeywords]) -> PlanResult: ...

Editors and type checkers read the keywords in `_keywords.pyi`, which scripts/stubs.sh makes of the same
table; `help` and `inspect.signature` find them, with defaults and meanings, at the function itself.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from truing.effects import name_list

Function = TypeVar("Function", bound=Callable[..., Any])
Options = TypeVar("Options")


def fields(options: type) -> list[str]:
    """Names of the fields, in the order of the header."""
    return [name for name, value in vars(options).items() if isinstance(value, property)]


def takes(options: type) -> Callable[[Function], Function]:
    """Of a function whose last parameter is `**options`: its signature and docstring say what these are."""

    def explained(function: Function) -> Function:
        signature = inspect.signature(function)
        *own, last = signature.parameters.values()
        assert last.kind is inspect.Parameter.VAR_KEYWORD
        usual = options()
        own += [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=getattr(usual, name))
            for name in fields(options)
        ]
        function.__signature__ = signature.replace(parameters=own)  # type: ignore[attr-defined]
        meanings = inspect.cleandoc(options.__doc__ or "").partition("\n\n")[2]
        text = inspect.cleandoc(function.__doc__ or "")
        function.__doc__ = f"{text}\n\nKeywords that are fields of {options.__name__}:\n\n{meanings}\n"
        return function

    return explained


def made(options: type[Options], keywords: Mapping[str, Any]) -> Options:
    """Options of the keywords that were given. Names may be one text, "J2.*,base.*".

    Raises TypeError on a keyword that is none, and InputError on a value that cannot be used.
    """
    usual = options()
    return options(
        **{
            name: name_list(value) if isinstance(value, str) and getattr(usual, name, None) == () else value
            for name, value in keywords.items()
        }
    )
