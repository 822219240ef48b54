# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C in the guise of other exceptions, and where Python would lose it."""

from __future__ import annotations

import _thread
import contextlib
import sys
import time
from collections.abc import Iterator
from typing import Any


def was_interrupted(error: BaseException) -> bool:
    """Whether Ctrl-C is behind an exception: compiled modules make an ImportError of it."""
    seen: BaseException | None = error
    while seen is not None and not isinstance(seen, KeyboardInterrupt):
        seen = seen.__cause__ or seen.__context__
    return seen is not None


_LATER = 0.02  # [s] the hook has returned by then: inside it nothing can be raised either


def _interrupt_later() -> None:
    time.sleep(_LATER)
    _thread.interrupt_main()


@contextlib.contextmanager
def none_lost() -> Iterator[None]:
    """Ctrl-C that meets a finaliser, where nothing can be raised, comes again outside of it. Python would
    print a traceback, and go on.
    """
    usual = sys.unraisablehook

    def come_again(unraisable: Any) -> None:
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            _thread.start_new_thread(_interrupt_later, ())
        else:
            usual(unraisable)

    sys.unraisablehook = come_again
    try:
        yield
    finally:
        sys.unraisablehook = usual
