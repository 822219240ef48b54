# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Identification: a robot's parameters from measurements, and what it then predicts."""

from truing._core import (
    BeforeAfter as BeforeAfter,
    Identification as Identification,
    IdentifyOptions as IdentifyOptions,
    Mistake as Mistake,
    Prediction as Prediction,
    Residuals as Residuals,
)
from truing.identification.api import (
    identify as identify,
    predict as predict,
    residuals as residuals,
    review as review,
)
