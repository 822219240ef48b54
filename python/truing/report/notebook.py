# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Results as notebooks show them: the page of the command that writes the same, in a frame of its own."""

from __future__ import annotations

import html
import importlib
import weakref
from typing import Any, TypeVar

Result = TypeVar("Result")
HEIGHT = 760  # [px] of the frame; the page scrolls in it

# What makes the page of a result, and with what, for as long as the result lives.
_PAGES: weakref.WeakKeyDictionary[Any, tuple[str, tuple[Any, ...]]] = weakref.WeakKeyDictionary()


def shown(result: Result, page: str, *more: Any) -> Result:
    """The same result, which notebooks show as its page (`_repr_html_`).

    page: the function that makes it of the result and of `more`, "module:name": it stands above the function
    that found the result, and is imported only when somebody looks. `more` must not hold the result itself:
    neither would ever be freed.
    """
    _PAGES[result] = page, more
    if not hasattr(type(result), "_repr_html_"):
        setattr(type(result), "_repr_html_", _repr_html)  # noqa: B010 (classes of the core have no such name)
    return result


def _repr_html(result: Any) -> str | None:
    """None, and with it the plain text, of a result that came another way."""
    if result not in _PAGES:
        return None
    page, more = _PAGES[result]
    module, _, name = page.partition(":")
    return framed(getattr(importlib.import_module(module), name)(result, *more))


def framed(page: str) -> str:
    """A page as part of another: it runs its script, and reaches nothing around it."""
    return (
        f'<iframe srcdoc="{html.escape(page, quote=True)}" sandbox="allow-scripts" title="truing"'
        f' style="width:100%;height:{HEIGHT}px;border:1px solid #dfe3e8;border-radius:8px"></iframe>'
    )
