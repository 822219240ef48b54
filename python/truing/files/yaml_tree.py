# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""YAML as a tree of plain values that remembers its line numbers, and pydantic's complaints in terms of those
lines.

Numbers are read as Decimal, with every digit that the file has: a unit conversion then rounds once, and what
is written in degrees or millimetres comes back bit for bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationError
from pydantic_core import PydanticCustomError

from truing.errors import InputError, did_you_mean
from truing.files.common import decoded, listed, read_bytes, shown
from truing.limits import LARGEST_NUMBER

Loc = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)

LARGEST_YAML = 1_000_000  # [bytes] a robot of 200 joints and 2000 targets has 0.3 million
_MOST_DIGITS = 100
LONGEST_NAME = 200  # characters
NAME = f"a name of at most {LONGEST_NAME} characters"
# YAML 1.2's numbers: 1e-3 is one (YAML 1.1 wants 1.0e-3), 1:30 is none (YAML 1.1 reads 90).
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_PLAIN_TAGS = {
    f"tag:yaml.org,2002:{kind}"
    for kind in ("map", "seq", "str", "int", "float", "bool", "null", "timestamp", "merge", "value")
}
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
}


class Document:
    """A YAML file: its values, and the line of every key and list entry.

    kind: what the user was asked for, "robot file". lists: it may be a list instead of a mapping.
    """

    def __init__(self, path: Path, text: str, kind: str, *, lists: bool = False) -> None:
        self.path = path
        self.kind = kind
        self._lines: dict[Loc, int] = {}
        self._seen: set[int] = set()
        try:
            node = yaml.compose(text, Loader=yaml.SafeLoader)
            self.value: Any = None if node is None else self._plain(node, ())
        except yaml.YAMLError as error:
            self._refuse_yaml(error)
        except RecursionError:
            raise InputError(f"{path}: is nested too deeply for a {kind}") from None
        except InputError:
            raise
        except (ValueError, OverflowError) as error:
            # PyYAML lets these through, e.g. from "\UFFFFFFFF".
            raise InputError(f"{path}: is not YAML: {error}") from None
        if self.value is None:
            raise InputError(f"{path}: is empty, expected a {kind}")
        if not isinstance(self.value, (dict, list) if lists else dict):
            raise InputError(
                f"{path}, line 1: found {found(self.value)}, expected a {kind}: keys and values in YAML"
            )

    @classmethod
    def read(cls, path: Path, kind: str, *, lists: bool = False) -> Document:
        return cls(path, decoded(path, read_bytes(path, LARGEST_YAML)), kind, lists=lists)

    def line(self, loc: Loc) -> int | None:
        """The line of `loc`, or of the nearest thing around it."""
        for length in range(len(loc), 0, -1):
            if loc[:length] in self._lines:
                return self._lines[loc[:length]]
        return None

    def refuse(self, loc: Loc, message: str) -> NoReturn:
        line = self.line(loc)
        where = f"{self.path}, line {line}" if line else f"{self.path}"
        place = self._place(loc)
        raise InputError(f"{where}: {place}: {message}" if place else f"{where}: {message}")

    def _place(self, loc: Loc) -> str:
        """('joints', 1, 'alpha') as 'joints[1] (J2) alpha'."""
        parts: list[str] = []
        value = self.value
        for step in loc:
            try:
                value = value[step]
            except (KeyError, IndexError, TypeError):
                value = None
            if isinstance(step, str):
                parts.append(step)
                continue
            name = value.get("name", value.get("effect")) if isinstance(value, dict) else None
            label = f"[{step}] ({name})" if isinstance(name, str) and len(name) < 60 else f"[{step}]"
            parts[-1:] = [(parts[-1] if parts else "") + label]
        return " ".join(parts)

    def _refuse_yaml(self, error: yaml.YAMLError) -> NoReturn:
        mark = getattr(error, "problem_mark", None)
        where = f"{self.path}, line {mark.line + 1}, column {mark.column + 1}" if mark else f"{self.path}"
        problem = getattr(error, "problem", None) or str(error).strip().split("\n")[0]
        context = getattr(error, "context", None)
        raise InputError(f"{where}: is not YAML: {problem}{f' ({context})' if context else ''}") from None

    def _refuse_node(self, node: Any, message: str) -> NoReturn:
        raise InputError(f"{self.path}, line {node.start_mark.line + 1}: {message}")

    def _plain(self, node: Any, loc: Loc) -> Any:
        # An alias is the same node again. Followed blindly, a few lines can stand for billions of values.
        if id(node) in self._seen:
            self._refuse_node(
                node, f"YAML anchors and aliases (&, *) are not read in a {self.kind}: write the value out"
            )
        self._seen.add(id(node))
        if isinstance(node, yaml.ScalarNode):
            self._require_characters(node)
        if node.tag not in _PLAIN_TAGS:
            self._refuse_node(node, f"found the YAML tag {shown(node.tag)}, expected none")
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, loc)
        if isinstance(node, yaml.SequenceNode):
            values = []
            for index, item in enumerate(node.value):
                self._lines[(*loc, index)] = item.start_mark.line + 1
                values.append(self._plain(item, (*loc, index)))
            return values
        return node.value if node.style is not None else _plain_scalar(node.value)

    def _require_characters(self, node: Any) -> None:
        # "\\ud800" in quotes is half a character: no text that leaves Python can hold it.
        if any(0xD800 <= ord(character) < 0xE000 for character in node.value):
            self._refuse_node(
                node, f"found half a character in {shown(node.value)}: remove the \\ud800 ... \\udfff"
            )

    def _mapping(self, node: Any, loc: Loc) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._refuse_node(key_node, "found a list or mapping as a key, expected a name")
            self._require_characters(key_node)
            key = key_node.value
            if key in values:
                first = self._lines[(*loc, key)]
                self._refuse_node(
                    key_node, f"key {shown(key)} is there twice (first in line {first}): remove one"
                )
            self._lines[(*loc, key)] = key_node.start_mark.line + 1
            values[key] = self._plain(value_node, (*loc, key))
        return values

    def validated(self, model: type[Model]) -> Model:
        """The document as `model`; an InputError with the line of the first complaint."""
        try:
            return model.model_validate(self.value)
        except ValidationError as error:
            complaints = error.errors(include_url=False)
        complaints.sort(key=lambda complaint: self.line(complaint["loc"]) or 0)
        # A mistyped key is both unknown and missing; that it is unknown says more.
        unknown = [complaint for complaint in complaints if complaint["type"] == "extra_forbidden"]
        complaint = (unknown or complaints)[0]
        self.refuse(*_explained(complaint, model))


def _plain_scalar(text: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    if _NUMBER.fullmatch(text):
        value = float(text)
        # Exponents that no double holds are cut here: Decimal would carry them on, and slowly.
        if math.isinf(value):
            return Decimal("inf").copy_sign(Decimal(math.copysign(1, value)))
        return Decimal(text) if value != 0.0 else Decimal("0").copy_sign(Decimal(math.copysign(1, value)))
    if _NOT_FINITE.fullmatch(text):
        return Decimal(text.replace(".", ""))
    return text


# ---- What the models are made of -----------------------------------------------------------------


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def found(value: object) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Decimal):
        return shown(str(value)).strip("'")
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return shown(value)


def expected(value: object, what: str) -> PydanticCustomError:
    return PydanticCustomError(
        "expected", "found {found}, expected {what}", {"found": found(value), "what": what}
    )


def _number(value: object) -> Decimal:
    if not isinstance(value, Decimal) or not value.is_finite():
        quoted = isinstance(value, str) and _NUMBER.fullmatch(value)
        raise expected(value, "a finite number, without quotation marks" if quoted else "a finite number")
    if abs(value) > LARGEST_NUMBER:
        raise expected(value, f"a number between -{LARGEST_NUMBER:.0e} and {LARGEST_NUMBER:.0e}")
    if len(value.as_tuple().digits) > _MOST_DIGITS:
        raise expected(value, f"a number of at most {_MOST_DIGITS} digits")
    return value


def _text(value: object) -> str:
    if isinstance(value, Decimal | bool):
        raise expected(value, "a name (put a name that looks like a number in quotes)")
    if not isinstance(value, str) or not value:
        raise expected(value, "a name")
    if len(value) > LONGEST_NAME:
        raise expected(value, NAME)
    return value


def _vector3(value: object) -> tuple[Decimal, Decimal, Decimal]:
    if not isinstance(value, list) or len(value) != 3:
        raise expected(value, "a list of 3 numbers")
    x, y, z = (_number(item) for item in value)
    return x, y, z


def _inertia(value: object) -> tuple[Decimal, ...]:
    if not isinstance(value, list) or len(value) != 6:
        raise expected(value, "a list of 6 numbers, [ixx, iyy, izz, ixy, ixz, iyz]")
    return tuple(_number(item) for item in value)


def _pair(value: object) -> tuple[Decimal | None, Decimal | None]:
    if not isinstance(value, list) or len(value) != 2:
        raise expected(value, "a list of 2 numbers, [lower, upper]")
    lower, upper = (None if item is None else _number(item) for item in value)
    if lower is not None and upper is not None and lower > upper:
        raise expected(f"[{lower}, {upper}]", "[lower, upper]: the lower limit is above the upper one")
    return lower, upper


def _range(value: object) -> tuple[Decimal, Decimal]:
    lower, upper = _pair(value)
    if lower is None or upper is None:
        raise expected(value, "a list of 2 numbers, [smallest, largest]")
    return lower, upper


def _mapping(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise expected(value, "a mapping, {name: value}")
    return value


def choice(*allowed: str) -> Callable[[object], str]:
    def check(value: object) -> str:
        if value not in allowed:
            raise expected(value, f"one of {listed(allowed)}" if len(allowed) > 1 else allowed[0])
        return str(value)

    return check


Number = Annotated[Decimal, PlainValidator(_number)]
Text = Annotated[str, PlainValidator(_text)]
Vector3 = Annotated[tuple[Decimal, Decimal, Decimal], PlainValidator(_vector3)]
Inertia = Annotated[tuple[Decimal, ...], PlainValidator(_inertia)]
Limits = Annotated[tuple[Decimal | None, Decimal | None] | None, PlainValidator(_pair)]
Range = Annotated[tuple[Decimal, Decimal], PlainValidator(_range)]
FreeMapping = Annotated[dict[str, Any], PlainValidator(_mapping)]
LengthName = Annotated[Literal["m", "mm"], PlainValidator(choice("m", "mm"))]
AngleName = Annotated[Literal["rad", "deg"], PlainValidator(choice("rad", "deg"))]
MassName = Annotated[Literal["kg"], PlainValidator(choice("kg"))]


def _explained(complaint: Any, model: type[BaseModel]) -> tuple[Loc, str]:
    """Where pydantic's complaint belongs, and what to tell the user."""
    loc: Loc = tuple(complaint["loc"])
    kind = complaint["type"]
    if kind == "extra_forbidden":
        keys = _keys_at(model, loc[:-1])
        hint = did_you_mean(str(loc[-1]), keys)
        if str(loc[-1]).isdigit():
            hint = "a comma as decimal mark in what is before it? "
        return loc, f"unknown key; {hint}expected one of {listed(keys)}"
    if kind == "missing":
        return loc[:-1], f"key {loc[-1]!r} is missing"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        keys = _keys_at(model, loc)
        what = f"a mapping with the keys {listed(keys)}" if keys else "a mapping, {name: value}"
        return loc, f"found {found(complaint['input'])}, expected {what}"
    if kind == "list_type":
        return loc, f"found {found(complaint['input'])}, expected a list"
    if kind == "too_long":
        return (
            loc,
            f"has {len(complaint['input'])} entries, expected at most {complaint['ctx']['max_length']}",
        )
    if kind == "too_short":
        return loc, "is empty, expected at least one entry"
    return loc, str(complaint["msg"])


def _keys_at(model: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """The keys that the part of `model` at `loc` knows."""
    for step in loc:
        if isinstance(step, str) and step in model.model_fields:
            inner = _model_in(model.model_fields[step].annotation)
            if inner is None:
                return []
            model = inner
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model inside list[Model], dict[str, Model], Model | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for part in getattr(annotation, "__args__", ()):
        inner = _model_in(part)
        if inner is not None:
            return inner
    return None
