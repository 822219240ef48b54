# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The programs in tests/data/programs, with the tools and frames that their cells have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from program_robots import built, nominal
from truing.files.brand_frames import frame_from_numbers
from truing.files.programs import Given, brand_of
from truing.programs import ApplyOptions, Outcome, apply_programs

CORPUS = Path(__file__).resolve().parents[1] / "data" / "programs"

# Given beside a program: what it uses from other files.
BESIDE = {"kuka_numbered.src": ["kuka_config.dat"], "abb_two_modules.mod": ["abb_two_modules_data.mod"]}

_CELLS = {
    "kuka": ({"1": (30, 0, 120, 0, 30, 0)}, {"2": (600, -200, 100, 20, 0, 0)}),
    "fanuc": ({"1": (30, 0, 120, 0, 0, 0)}, {}),
    "yaskawa": ({"9": (0, 0, 100, 0, 0, 0)}, {"2": (600, -200, 100, 0, 0, 20)}),
    "abb": ({}, {}),
    "ur": ({}, {}),
}
_ROBOTS = {brand: (nominal(brand), built(brand)) for brand in _CELLS}


def programs() -> list[Path]:
    """Those that can be used, in order."""
    others = {name for names in BESIDE.values() for name in names}
    return sorted(
        path
        for path in CORPUS.iterdir()
        if path.suffix not in (".dat", ".csv")
        and not path.name.startswith("bad_")
        and path.name not in others
    )


def options(brand: str) -> ApplyOptions:
    tools, frames = _CELLS[brand]
    return ApplyOptions(
        Given(
            {name: frame_from_numbers(brand, numbers) for name, numbers in tools.items()},  # type: ignore[arg-type]
            {name: frame_from_numbers(brand, numbers) for name, numbers in frames.items()},  # type: ignore[arg-type]
        )
    )


def applied(path: Path, beside: Sequence[Path] | None = None, *, identical: bool = False) -> Outcome:
    """What `truing apply` makes of a program; `identical`: the robot is as its controller believes."""
    brand = brand_of(path)
    others = [path.parent / name for name in BESIDE.get(path.name, [])] if beside is None else list(beside)
    believed, real = _ROBOTS[brand]
    return apply_programs([path, *others], believed, believed if identical else real, options(brand))


def rows(outcome: Outcome) -> list[tuple[str, str, str, str, str]]:
    """File, line, what, status and reason of everything that was found."""
    found = [
        (one.source.name, one.target.line, one.target.name, one.status, one.why) for one in outcome.targets
    ]
    found += [(path.name, stay.line, stay.what, "stayed", stay.why) for path, stay in outcome.stays]
    return [(file, str(line), what, status, why) for file, line, what, status, why in sorted(found)]
