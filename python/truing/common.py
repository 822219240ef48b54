# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the results of several rooms are made of."""

from truing._core import (
    ErrorStatistics as ErrorStatistics,
    Frozen as Frozen,
    NotTestable as NotTestable,
    Parameter as Parameter,
    SolverSummary as SolverSummary,
    UncertainFrame as UncertainFrame,
)
