# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of options: how a value is read from its text, which values are refused and why, how a default is
shown.

A command lists its options as annotated fields:

noise: Annotated[float, Length("Standard deviation of …", least=0)] = core("PlanOptions", "position_sigma")

Every message names the option, what was found, and what was expected. Values are SI.
"""

from __future__ import annotations

import importlib
import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Annotated, Any, ClassVar

from truing.errors import InputError
from truing.limits import LARGEST_NUMBER

# ---- Defaults that stand elsewhere -------------------------------------------------------------------------


class Default:
    """A default that another place states; looked up when a command runs or shows its help."""

    def __init__(self, lookup: Callable[[], Any]) -> None:
        self.lookup = lookup


def core(options: str, *names: str) -> Any:
    """The default of an options class of the core: its field `names` ("tracker.clock_offset": a field of a
    field); a tuple of several.
    """

    def lookup() -> Any:
        usual = getattr(importlib.import_module("truing._core"), options)()
        found = [reduce(getattr, name.split("."), usual) for name in names]
        return found[0] if len(found) == 1 else tuple(found)

    return Default(lookup)


def keyword(function: str, *names: str) -> Any:
    """The default of a Python function's keyword, "truing.testing.simulation:simulate", "noise"; a tuple of
    several.
    """

    def lookup() -> Any:
        module, _, name = function.partition(":")
        parameters = inspect.signature(getattr(importlib.import_module(module), name)).parameters
        found = [parameters[name].default for name in names]
        return found[0] if len(found) == 1 else tuple(found)

    return Default(lookup)


# ---- Kinds -------------------------------------------------------------------------------------------------


class Kind:
    """What an option or an argument takes. Plain text, unless a subclass says more.

    help: for --help. flag: "--out", where the field has another name. argument: needs no flag. metavar:
    stands for the value in --help. panel: heading in --help. several: may be repeated, the field holds a
    list.
    """

    metavar = "TEXT"

    def __init__(
        self,
        help: str = "",
        *,
        flag: str = "",
        argument: bool = False,
        metavar: str = "",
        panel: str | None = None,
        several: bool = False,
    ) -> None:
        self.help = help
        self.flag = flag
        self.argument = argument
        self.metavar = metavar or self.metavar
        self.panel = panel
        self.several = several

    def read(self, text: str, option: str) -> Any:
        """The value of `text`. Raises InputError that names `option`."""
        return text

    def show(self, value: Any) -> str:
        """`value` as a user would write it."""
        return str(value)

    def complete(self, incomplete: str) -> list[str]:
        """For the shell; of nothing it makes names of files."""
        return []


def refused(option: str, text: str, expected: str) -> InputError:
    """The message of every value that cannot be used."""
    return InputError(f"{option}: found {text!r}, expected {expected}")


def too_large(option: str, text: str) -> InputError:
    return refused(option, text, f"a number between -{LARGEST_NUMBER:.0e} and {LARGEST_NUMBER:.0e}")


def is_too_large(value: float) -> bool:
    """Infinity is no number at all, and is said to be none."""
    return math.isfinite(value) and abs(value) > LARGEST_NUMBER


class Flag(Kind):
    """On or off."""


class File(Kind):
    """The path of a file to read, or of a folder to write."""

    metavar = "FILE"

    def read(self, text: str, option: str) -> Path:
        if not text:  # of a variable of the shell that is not set, as a rule; it would be this folder
            raise refused(option, text, "a path")
        return Path(text)


class Choice(Kind):
    """One of a few words, those of the field's Literal unless `words` say what others stand for."""

    def __init__(self, help: str, words: Mapping[str, Any] | None = None, **common: Any) -> None:
        super().__init__(help, **common)
        self.values = dict(words or {})

    def read(self, text: str, option: str) -> Any:
        if text not in self.values:
            *others, last = self.values
            raise refused(option, text, f"{', '.join(others)} or {last}")
        return self.values[text]

    def show(self, value: Any) -> str:
        return next(word for word, meant in self.values.items() if meant == value)

    def complete(self, incomplete: str) -> list[str]:
        return [word for word in self.values if word.startswith(incomplete)]


class Count(Kind):
    """A whole number."""

    metavar = "N"

    def __init__(self, help: str = "", *, least: int = 0, most: int | None = None, **common: Any) -> None:
        super().__init__(help, **common)
        self.least, self.most = least, most

    def read(self, text: str, option: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = self.least - 1
        if abs(value) > LARGEST_NUMBER:
            raise too_large(option, text)
        if value < self.least or (self.most is not None and value > self.most):
            upper = "or more" if self.most is None else f"to {self.most}"
            raise refused(option, text, f"a whole number, {self.least} {upper}")
        return value


class Number(Kind):
    """A number without a unit, or of a unit that the help states."""

    metavar = "NUMBER"

    def __init__(
        self,
        help: str = "",
        *,
        noun: str = "a number",
        example: str = "1e-4",
        least: float = -math.inf,
        **common: Any,
    ) -> None:
        super().__init__(help, **common)
        self.noun, self.example, self.least = noun, example, least

    def read(self, text: str, option: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if is_too_large(value):
            raise too_large(option, text)
        if not (math.isfinite(value) and value >= self.least):
            bound = "" if math.isinf(self.least) else f", {self.least:g} or more"
            raise refused(option, text, f"{self.noun}{bound}, such as {self.example}")
        return value

    def show(self, value: float) -> str:
        return f"{value:g}"


class Fraction(Kind):
    """A part of a whole, "2%" or "0.02": from 0, or `above` something, to `below` something."""

    metavar = "FRACTION"

    def __init__(
        self, help: str = "", *, above: float | None = None, below: float = 1.0, **common: Any
    ) -> None:
        super().__init__(help, **common)
        self.above, self.below = above, below

    def read(self, text: str, option: str) -> float:
        percent = text.strip().endswith("%")
        try:
            value = float(text.strip().removesuffix("%")) * (0.01 if percent else 1.0)
        except ValueError:
            value = math.nan
        lowest = 0.0 if self.above is None else self.above
        if not lowest <= value < self.below or value == self.above:
            above = "" if self.above is None else f"above {self.above:g} and "
            raise refused(option, text, f"a fraction {above}below {self.below:g}, such as 2% or 0.02")
        return value

    def show(self, value: float) -> str:
        return f"{100 * value:g}%"


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*([^\s\d]*)\s*")


class Quantity(Kind):
    """A number with its unit, "0.03mm". Zero needs none."""

    noun: ClassVar[str]
    units: ClassVar[dict[str, float]]
    shown_in: ClassVar[tuple[str, ...]]  # of these units the one with the shortest text
    example: ClassVar[str]

    def __init__(
        self,
        help: str = "",
        *,
        least: float = -math.inf,
        above: float = -math.inf,
        most: float = math.inf,
        **common: Any,
    ) -> None:
        super().__init__(help, **common)
        self.least, self.above, self.most = least, above, most

    def read(self, text: str, option: str) -> float:
        match = _QUANTITY.fullmatch(text)
        value = float(match[1]) if match else math.nan
        unit = match[2] if match else ""
        if unit in self.units:
            value *= self.units[unit]
        elif unit or value != 0:
            value = math.nan
        if is_too_large(value):
            raise too_large(option, text)
        if not math.isfinite(value):
            units = ", ".join(unit for unit in self.units if unit.isascii())
            raise refused(option, text, f"{self.noun} with its unit ({units}), such as {self.example}")
        if value < self.least:
            raise refused(
                option, text, f"{self.noun} of {self._bound(self.least)} or more, such as {self.example}"
            )
        if value <= self.above:
            raise refused(
                option, text, f"{self.noun} above {self._bound(self.above)}, such as {self.example}"
            )
        if value > self.most:
            raise refused(option, text, f"{self.noun} of at most {self._bound(self.most)}")
        return value

    def show(self, value: float) -> str:
        texts = [f"{value / self.units[unit]:.12g}{unit}" for unit in reversed(self.shown_in)]
        return min(texts, key=len)

    def _bound(self, value: float) -> str:
        return "0" if value == 0 else self.show(value)


class Length(Quantity):
    metavar = "LENGTH"
    noun = "a length"
    units = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}
    shown_in = ("m", "mm")
    example = "0.03mm"


class Angle(Quantity):
    metavar = "ANGLE"
    noun = "an angle"
    units = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "µrad": 1e-6, "deg": math.pi / 180, "°": math.pi / 180}
    shown_in = ("rad", "mrad", "deg")
    example = "15deg"


class Mass(Quantity):
    metavar = "MASS"
    noun = "a mass"
    units = {"kg": 1.0, "g": 1e-3}
    shown_in = ("kg",)
    example = "5kg"


class Time(Quantity):
    metavar = "TIME"
    noun = "a time"
    units = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}
    shown_in = ("s", "ms")
    example = "40ms"


class Speed(Quantity):
    metavar = "SPEED"
    noun = "a speed"
    units = {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3}
    shown_in = ("m/s",)
    example = "0.3m/s"


class Frequency(Quantity):
    metavar = "FREQUENCY"
    noun = "a frequency"
    units = {"Hz": 1.0, "kHz": 1e3}
    shown_in = ("Hz",)
    example = "8Hz"


class Pixels(Quantity):
    metavar = "PIXELS"
    noun = "a number of pixels"
    units = {"px": 1.0}
    shown_in = ("px",)
    example = "0.2px"


class Parts(Kind):
    """Values of several kinds in one text, "20s:2s" or "1mm,1mrad"; the field holds a tuple."""

    def __init__(
        self,
        help: str,
        parts: Sequence[Kind],
        expected: str,
        *,
        separator: str = ",",
        optional: int = 0,
        **common: Any,
    ) -> None:
        """expected: "a time and how long, such as 20s:2s". optional: so many at the end may be absent; they
        are 0.
        """
        super().__init__(help, **common)
        self.parts, self.expected, self.separator, self.optional = tuple(parts), expected, separator, optional

    def read(self, text: str, option: str) -> tuple[Any, ...]:
        texts = [part.strip() for part in text.split(self.separator)]
        if not len(self.parts) - self.optional <= len(texts) <= len(self.parts):
            raise refused(option, text, self.expected)
        values = [part.read(found, option) for part, found in zip(self.parts, texts, strict=False)]
        return (*values, *[0.0] * (len(self.parts) - len(texts)))

    def show(self, value: Sequence[Any]) -> str:
        shown = [part.show(one) for part, one in zip(self.parts, value, strict=True)]
        while len(shown) > len(self.parts) - self.optional and value[len(shown) - 1] == 0:
            shown.pop()
        return self.separator.join(shown)


class Words(Kind):
    """Words between commas; the field holds a list. `known`: no others."""

    metavar = "NAMES"

    def __init__(self, help: str, *, known: Sequence[str] = (), **common: Any) -> None:
        super().__init__(help, **common)
        self.known = known

    def read(self, text: str, option: str) -> list[str]:
        words = words_of(text)
        for word in words:
            if self.known and word not in self.known:
                raise refused(option, word, f"words of {', '.join(self.known)}")
        return words

    def complete(self, incomplete: str) -> list[str]:
        return continued(incomplete, self.known)


class Numbers(Kind):
    """Numbers between commas, of a unit that the help states, none of them zero; the field holds a list."""

    metavar = "NUMBERS"

    def read(self, text: str, option: str) -> list[float]:
        number = Number(noun="numbers between commas, none of them 0", example="10,10.7,-8.5")
        values = [number.read(word.strip(), option) for word in text.split(",")]
        for word, value in zip(text.split(","), values, strict=True):
            if value == 0:
                raise refused(option, word.strip(), f"{number.noun}, such as {number.example}")
        return values


class Names(Kind):
    """Names and globs between commas, as the core reads them."""

    metavar = "NAMES"


class EffectNames(Names):
    """Effects of the catalogue between commas, perhaps with their joints: "backlash,harmonic:J2+J3"."""

    def complete(self, incomplete: str) -> list[str]:
        from truing.model import catalogue

        return continued(incomplete, [name for name, _ in catalogue()])


class TorqueEffectNames(Names):
    """Effects on torques between commas, perhaps with their joints: "coulomb,load_friction:J2+J3"."""

    def read(self, text: str, option: str) -> str:
        known = self._known()
        for word in words_of(text):
            if word.partition(":")[0].strip() not in known:
                raise refused(option, word, f"effects on torques, of {', '.join(known)}")
        return text

    def complete(self, incomplete: str) -> list[str]:
        return continued(incomplete, self._known())

    def _known(self) -> list[str]:
        from truing.dynamics.api import effect_names

        return effect_names()


def continued(incomplete: str, names: Sequence[str]) -> list[str]:
    """The last word of "a,b" completed."""
    before, comma, begun = incomplete.rpartition(",")
    return [before + comma + name for name in names if name.startswith(begun)]


def words_of(text: str) -> list[str]:
    """ "a, b" as ["a", "b"]."""
    return [word.strip() for word in text.split(",") if word.strip()]


def read_with_common_units(
    texts: Sequence[str], kinds: Sequence[Quantity], options: Sequence[str]
) -> list[float]:
    """Quantities of which some have no unit: a unit holds for the numbers of its kind before it that have
    none.
    """
    units: dict[str, str] = {}
    values = []
    for text, kind, option in reversed(list(zip(texts, kinds, options, strict=True))):
        own = re.sub(_NUMBER, "", text, count=1).strip()
        unit = units[kind.noun] = own or units.get(kind.noun, "")
        values.append(kind.read(text if own else text + unit, option))
    return values[::-1]


# ---- Fields that commands share ----------------------------------------------------------------------------

OUTPUT = "Output"


RobotFile = Annotated[Path, File("Robot file: robot.yaml or URDF.", argument=True, metavar="ROBOT")]
DataFile = Annotated[
    Path,
    File("Measurements: CSV or Parquet, one row per measured pose.", argument=True, metavar="DATA"),
]
ProgramFile = Annotated[
    Path | None,
    File(
        "Robot program (.src, .mod, .ls, .script, .jbi), or table of `truing apply --poses-out`, that gives"
        " the joints of DATA, which then has none: one row per move to a literal target, in their order.",
        metavar="PROGRAM",
    ),
]
OutFolder = Annotated[
    Path, File("Folder to write to: all files, or none.", flag="--out", metavar="FOLDER", panel=OUTPUT)
]
Json = Annotated[bool, Flag("Print result.json instead of a table.", panel=OUTPUT)]
Seed = Annotated[int, Count("Seed of every random choice. The same seed gives the same result.")]
Threads = Annotated[int, Count("Threads to compute with. 0: as many as the machine has.")]
BaseLink = Annotated[
    str, Kind("First link of the chain, for a URDF. Default: its only root.", metavar="LINK")
]
TipLink = Annotated[str, Kind("Last link of the chain, for a URDF. Default: its only leaf.", metavar="LINK")]
Free = Annotated[
    str,
    Names(
        "Parameters to find, names and globs: 'J2.*,*.ratio,tool.x'. Default: all geometry, base and targets."
    ),
]
Effects = Annotated[
    str,
    EffectNames("Effects to find as well: 'backlash,harmonic:J2+J3'. `truing effects` lists them."),
]
INPUTS = ("dir", "payload", "temp", "t")  # of measurements, which --columns asks for
