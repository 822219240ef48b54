# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Performance of a robot after ISO 9283: what to drive and measure, and what the measurements say."""

from truing.performance.api import (
    Alignment as Alignment,
    Assessment as Assessment,
    NotFound as NotFound,
    Quantity as Quantity,
    WarmUp as WarmUp,
    assess as assess,
)
