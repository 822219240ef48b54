# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot programs whose targets a real robot reaches: literal targets are replaced by what to command."""

from truing.programs.apply import (
    Applied as Applied,
    ApplyOptions as ApplyOptions,
    Outcome as Outcome,
    RefusedFile as RefusedFile,
    apply_programs as apply_programs,
)
from truing.programs.rows import (
    commanded_hand as commanded_hand,
    commanded_joints as commanded_joints,
)
