# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the public structs and enums, read from the public headers when the bindings are built.

python field_tables.py cpp/include/truing OUTPUT writes OUTPUT/<header> for every header.
A field's name, default and meaning stand in its header alone: its comment (`///<` behind it, `///` before
it) is what Python's docstrings say, so it is a sentence or a fragment that needs no context, with the unit
in brackets.

- Fields of one declaration share its comment. A field of an enum's type lists what the values mean.
- A double whose default is NaN is `None` in Python as long as it is not given.
- Own effects (`std::vector<Effect>`, `std::vector<TorqueEffect>`) hold functions: they are arguments of
  the bound functions, not fields. Functions (`std::function`) are no fields either: who binds the struct says
  what they are in Python.
- An enumerator is its name in Python, or the quoted word that its comment begins with:
  `not_closing,  ///< "not closing": ...`. Enumerators with numbers of their own are left out.
"""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

NAN = re.compile(r"\b(kEstimate|std::numeric_limits<double>::quiet_NaN\(\))\s*}?$")
COMMENT = re.compile(r"(///<|///|//)[ ]?([^\n]*)")
MARK = re.compile(r"\x01(\d+)\x02")
MARKS = r"((?:\x01\d+\x02\n?[ ]*)*)"


@dataclass
class Field:
    name: str
    type: str
    default: str
    meaning: str = ""

    @property
    def none_if_nan(self) -> bool:
        return self.type == "double" and NAN.search(self.default) is not None


@dataclass
class Struct:
    name: str
    summary: str
    bases: list[str]
    fields: list[Field] = field(default_factory=list)


@dataclass
class Enum:
    name: str
    values: list[tuple[str, str]]  # spelling, meaning

    def meanings(self) -> str:
        return "\n".join(f"'{word}': {meaning}" for word, meaning in self.values if meaning)


@dataclass
class Header:
    includes: list[str]
    structs: list[Struct]
    enums: list[Enum]


class Comments:
    """The text of a header with every comment replaced by a mark, and the comments by mark."""

    def __init__(self, text: str) -> None:
        self.kinds: list[tuple[str, str]] = []
        self.text = COMMENT.sub(self._mark, text)

    def _mark(self, match: re.Match[str]) -> str:
        self.kinds.append((match[1], match[2].strip()))
        return f"\x01{len(self.kinds) - 1}\x02"

    def of(self, marks: str, kind: str) -> str:
        """The comments of one kind among these marks, as one text; an empty `///` line begins a paragraph."""
        lines = [self.kinds[int(k)][1] for k in MARK.findall(marks) if self.kinds[int(k)][0] == kind]
        return "\n\n".join(" ".join(part.split("\n")) for part in "\n".join(lines).split("\n\n")).strip()


def end_of_braces(text: str, start: int) -> int:
    """Where the brace that opens at `start` closes."""
    depth = 0
    for at in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        if depth == 0:
            return at
    raise ValueError("a brace that is not closed")


def split_outside(text: str, separator: str) -> list[str]:
    """`text` at the separators outside of all brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += {"(": 1, "{": 1, "[": 1, "<": 1, ")": -1, "}": -1, "]": -1, ">": -1}.get(character, 0)
        if character == separator and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def declared(statement: str) -> list[Field]:
    """The fields of a declaration; none of a function, a type or a constant."""
    plain = re.sub(r"\s+", " ", MARK.sub("", statement)).strip()
    if re.match(r"(static|using|friend|struct|class|enum|explicit|template)\b", plain):
        return []
    found: list[Field] = []
    for declarator in split_outside(plain, ","):
        head = re.match(r"(?:[^={(<]|<(?:[^<>]|<[^<>]*>)*>)*", declarator)
        assert head is not None
        rest = declarator[head.end() :].strip()
        words = re.match(r"(.*?)\s*(\w+)\s*$", head[0].strip())
        if rest.startswith("(") or words is None:
            return []
        kind = words[1].strip() if not found else found[0].type
        found.append(Field(words[2], kind, rest.lstrip("=").strip()))
    return found


def fields_of(body: str, comments: Comments, where: str) -> list[Field]:
    found: list[Field] = []
    at, start, depth = 0, 0, 0
    while at < len(body):
        character = body[at]
        depth += {"{": 1, "(": 1, "}": -1, ")": -1}.get(character, 0)
        is_function = character == "}" and depth == 0 and "(" in MARK.sub("", body[start:at]).split("{")[0]
        if (character == ";" and depth == 0) or is_function:
            statement = body[start:at]
            behind = re.compile(r"[ ]*" + r"((?:\x01\d+\x02(?:\n[ ]*(?=\x01))?)*)").match(body, at + 1)
            marks = behind[1] if behind else ""
            own = [k for k in MARK.findall(marks) if comments.kinds[int(k)][0] == "///<"]
            after = "".join(f"\x01{k}\x02" for k in own)
            new = declared(statement)
            meaning = comments.of(after, "///<") or comments.of(re.split(r"\n\s*\n", statement)[-1], "///")
            for item in new:
                item.meaning = meaning
            found += new
            at = body.index(f"\x01{own[-1]}\x02", at) + len(f"\x01{own[-1]}\x02") if own else at + 1
            start = at
            continue
        at += 1
    if not found and "std::" in MARK.sub("", body):
        raise ValueError(f"{where}: no field could be read")
    return found


def values_of(body: str, comments: Comments) -> list[tuple[str, str]]:
    values = []
    for name, marks in re.findall(r"(\w+)\s*,?[ ]*" + MARKS, re.sub(r"\x02\n\s*\x01", "\x02\x01", body)):
        if name.isdigit():
            continue
        meaning = comments.of(marks, "///<")
        quoted = re.match(r'"([^"]+)"(?:: )?', meaning)
        values.append((quoted[1], meaning[quoted.end() :]) if quoted else (name, meaning))
    return values


def read_header(path: Path) -> Header:
    comments = Comments(path.read_text(encoding="utf-8"))
    header = Header(re.findall(r'#include "truing/([^"]+)"', comments.text), [], [])
    for match in re.finditer(MARKS + r"struct (\w+)\s*(?::\s*([^{;]+?))?\s*{", comments.text):
        body = comments.text[match.end() : end_of_braces(comments.text, match.end() - 1)]
        bases = [base.strip().removeprefix("public ") for base in (match[3] or "").split(",") if base.strip()]
        struct = Struct(match[2], comments.of(match[1], "///"), bases)
        struct.fields = fields_of(body, comments, f"{path}: {struct.name}")
        header.structs.append(struct)
    for match in re.finditer(r"enum class (\w+)\s*{", comments.text):
        body = comments.text[match.end() : end_of_braces(comments.text, match.end() - 1)]
        if "=" not in MARK.sub("", body):  # words are found by place
            header.enums.append(Enum(match[1], values_of(body, comments)))
    return header


def sentence(text: str) -> str:
    """Begins large and ends with a full stop, as docstrings do; a unit alone stays as it is."""
    if not text:
        return ""
    text = text[0].upper() + text[1:] if re.match(r"(a|[a-z]{2,})\b(?! =)", text) else text
    text = text if text[-1] in ".:])" else text + "."
    return "\n\n".join(textwrap.fill(part, 100) for part in text.split("\n\n"))


def literal(text: str) -> str:
    return f'R"doc({text})doc"'


def table_of_struct(struct: Struct, structs: dict[str, Struct], enums: dict[str, Enum]) -> str:
    def all_fields(one: Struct) -> list[Field]:
        return [f for base in one.bases if base in structs for f in all_fields(structs[base])] + one.fields

    rows = []
    for f in all_fields(struct):
        if f.type in ("std::vector<Effect>", "std::vector<TorqueEffect>") or "function<" in f.type:
            continue
        meaning = sentence(f.meaning)
        if f.type in enums and enums[f.type].meanings():
            meaning = f"{meaning}\n\n{enums[f.type].meanings()}".strip()
        kind = "none_if_nan" if f.none_if_nan else "field"
        rows.append(f'{kind}<T>("{f.name}", &T::{f.name}, {literal(meaning)})')
    separator = ",\n               "
    return f"""template <>
struct Fields<truing::{struct.name}> {{
  static constexpr const char* summary = {literal(sentence(struct.summary))};
  template <class Use>
  static decltype(auto) all(Use&& use) {{
    using T = truing::{struct.name};
    return use({separator.join(rows)});
  }}
}};
"""


def table_of_enum(enum: Enum) -> str:
    what = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", enum.name).lower()
    words = [word for word, _ in enum.values]
    list_of_words = ", ".join(f'"{word}"' for word in words)
    type_of_words = ", ".join(f"'{word}'" for word in words)
    return f"""template <>
struct Words<truing::{enum.name}> {{
  static constexpr const char* what = "{what}";
  static constexpr std::array<const char*, {len(words)}> list{{{list_of_words}}};
  static constexpr auto type = py::detail::const_name("typing.Literal[{type_of_words}]");
}};
"""


def tables_of(
    name: str, header: Header, names: Collection[str], structs: dict[str, Struct], enums: dict[str, Enum]
) -> str:
    tables = [table_of_enum(enum) for enum in header.enums]
    tables += [table_of_struct(struct, structs, enums) for struct in header.structs if struct.fields]
    casters = "".join(
        f"template <>\nstruct type_caster<truing::{e.name}> : word_caster<truing::{e.name}> {{}};\n"
        for e in header.enums
    )
    includes = "".join(f'#include "tables/{other}"\n' for other in header.includes if other in names)
    return f"""// Made by field_tables.py from truing/{name}.
#pragma once

#include "convert/tables.hpp"
{includes}#include "truing/{name}"

namespace truing::python {{

{chr(10).join(tables)}
}}  // namespace truing::python

namespace pybind11::detail {{

{casters}
}}  // namespace pybind11::detail
"""


def write_if_changed(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def main(source: Path, output: Path) -> None:
    headers = {p.relative_to(source).as_posix(): read_header(p) for p in sorted(source.rglob("*.hpp"))}
    structs = {s.name: s for header in headers.values() for s in header.structs}
    enums = {e.name: e for header in headers.values() for e in header.enums}
    for name, header in headers.items():
        write_if_changed(output / name, tables_of(name, header, headers, structs, enums))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
