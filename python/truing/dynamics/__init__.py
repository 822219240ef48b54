# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics: how a robot's motion and torque differ from its model, from recordings of motion."""

from truing._core import (
    Recording as Recording,
    validate_recording as validate_recording,
)
from truing.files import load_recordings as load_recordings
