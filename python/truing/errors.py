# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What truing raises and warns with."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truing._core import HandEyeResult, Identification


class InputError(ValueError):
    """A file, value or option cannot be used. The message says where, what was found, what was expected."""


def did_you_mean(word: str, known: Iterable[str], least: float = 0.6) -> str:
    """ "did you mean 'x'? " of the name that is nearest to `word`, capitals aside; "" where none is near.

    least: how alike they are, 1 for equal words.
    """
    names = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word.casefold(), names, n=1, cutoff=least)
    return f"did you mean {names[close[0]]!r}? " if close else ""


class InputWarning(UserWarning):
    """An input can be used, but looks odd. The message says where and why."""


class NotConvergedError(RuntimeError):
    """A fit did not converge. `result` is what it came to; do not use it without knowing why."""

    def __init__(self, result: Identification) -> None:
        self.result = result
        solver = result.solver
        super().__init__(
            f"the fit ({solver.name}) did not converge in {solver.iterations} iterations:"
            f" {solver.stopped_because}. The exception's `result` has what it came to;"
            " raise_if_not_converged=False returns it instead."
        )


class UndecidedError(RuntimeError):
    """Data do not say where the camera is: `result.status` is "not observable", "not closing" or "not
    converged", and the message says why.
    """

    def __init__(self, result: HandEyeResult) -> None:
        self.result = result
        super().__init__(
            f"{result.status}: {result.message} (The exception's `result` has the details;"
            " raise_if_undecided=False returns it instead.)"
        )
