# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where the gap between robot and model lies, and which effect causes it."""

from truing._core import (
    Alternative as Alternative,
    Candidate as Candidate,
    Curve as Curve,
    Detectable as Detectable,
    DiagnoseOptions as DiagnoseOptions,
    Diagnosis as Diagnosis,
    FoundEffect as FoundEffect,
    HeldOutFall as HeldOutFall,
    NextPose as NextPose,
    SanityFinding as SanityFinding,
    Share as Share,
    UnknownEffect as UnknownEffect,
    WhereInput as WhereInput,
    WhereJoint as WhereJoint,
    WorkspaceCell as WorkspaceCell,
)
from truing.diagnosis.api import diagnose as diagnose
