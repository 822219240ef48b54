# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Performance of a robot after ISO 9283: what to drive and measure, and what the measurements say."""

from truing.performance.api import assess as assess
from truing.performance.assessment import (
    Alignment as Alignment,
    Assessment as Assessment,
    NotFound as NotFound,
    Quantity as Quantity,
    WarmUp as WarmUp,
)
from truing.performance.drive import (
    DriveOptions as DriveOptions,
    performance_programs as performance_programs,
)
from truing.performance.plan import (
    Cube as Cube,
    PerformancePlan as PerformancePlan,
    PlanOptions as PlanOptions,
    plan_test as plan_test,
)
