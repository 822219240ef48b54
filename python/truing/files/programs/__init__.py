# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot programs of five makers: where their literal targets stand, byte by byte, and why others are left."""

from truing.files.programs.model import (
    Configuration as Configuration,
    Given as Given,
    Place as Place,
    Reading as Reading,
    Stay as Stay,
    Target as Target,
    Via as Via,
)
from truing.files.programs.reading import (
    SUFFIXES as SUFFIXES,
    brand_of as brand_of,
    has_program_name as has_program_name,
    parse_place as parse_place,
    read_programs as read_programs,
)
from truing.files.programs.text import (
    Number as Number,
    Source as Source,
    edited as edited,
    printed as printed,
)
