# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Planning of measurements: which poses to measure, and which effects they tell apart."""

from truing._core import (
    Distinction as Distinction,
    DistinguishOptions as DistinguishOptions,
    EffectPair as EffectPair,
    EffectSize as EffectSize,
    PlanOptions as PlanOptions,
    PlanResult as PlanResult,
)
from truing.planning.api import (
    distinguish as distinguish,
    plan as plan,
)
