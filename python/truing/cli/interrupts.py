# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C in the guise of other exceptions."""

from __future__ import annotations


def was_interrupted(error: BaseException) -> bool:
    """Whether Ctrl-C is behind an exception: compiled modules make an ImportError of it."""
    seen: BaseException | None = error
    while seen is not None and not isinstance(seen, KeyboardInterrupt):
        seen = seen.__cause__ or seen.__context__
    return seen is not None
