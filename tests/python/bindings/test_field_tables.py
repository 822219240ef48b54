# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""An option is stated once, in its public header: tables that are read there, classes made of them."""

from __future__ import annotations

import importlib.util
import inspect
import pickle
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from truing import _core

ROOT = Path(__file__).resolve().parents[3]

HEADER = """
#include "truing/model/robot.hpp"
enum class Way {
  there,           ///< to the seed
  not_there,       ///< "not there": from the seed,
                   ///< and on
  back,
};

/// Where two things stop.
///
/// A second paragraph.
struct Limits {
  double low = 0.0, high = 1.0;  ///< [m] ends
};

struct Options : Limits {
  /// names and globs ('J2.*'), or more than
  /// one line.
  std::vector<std::string> names;
  std::map<std::string, std::pair<double, double>> bounds{};  ///< (lowest, highest) by name
  Way way = Way::there;                                       ///< which of them
  double sigma = kEstimate;                                   ///< [m] if known
  double rate = 0.0;                                          // not for users
  std::vector<Effect> own_effects;                            ///< hold functions

  /// False, and why.
  bool is_valid(std::string* error) const;
  bool empty() const { return names.empty(); }
  static constexpr int kMost = 4;
  Options() { low = 2.0; }
};
"""


@pytest.fixture(scope="module")
def tables() -> ModuleType:
    spec = importlib.util.spec_from_file_location(
        "field_tables", ROOT / "python" / "bindings" / "field_tables.py"
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["field_tables"] = module
    spec.loader.exec_module(module)
    return module


def test_fields_and_comments_are_read(tables: ModuleType, tmp_path: Path) -> None:
    path = tmp_path / "options.hpp"
    path.write_text(HEADER)
    header = tables.read_header(path)
    limits, options = header.structs
    assert limits.summary == "Where two things stop.\n\nA second paragraph."
    assert [(f.name, f.type, f.meaning) for f in limits.fields] == [
        ("low", "double", "[m] ends"),
        ("high", "double", "[m] ends"),
    ]
    assert options.bases == ["Limits"]
    assert [(f.name, f.meaning) for f in options.fields] == [
        ("names", "names and globs ('J2.*'), or more than one line."),
        ("bounds", "(lowest, highest) by name"),
        ("way", "which of them"),
        ("sigma", "[m] if known"),
        ("rate", ""),
        ("own_effects", "hold functions"),
    ]
    assert [f.name for f in options.fields if f.none_if_nan] == ["sigma"]
    (way,) = header.enums
    assert way.values == [
        ("there", "to the seed"),
        ("not there", "from the seed, and on"),
        ("back", ""),
    ]


def test_a_table_has_inherited_fields_and_the_words_of_an_enum(tables: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "options.hpp").write_text(HEADER)
    tables.main(tmp_path / "in", tmp_path / "out")
    table = (tmp_path / "out" / "options.hpp").read_text()
    options = table[table.index("struct Fields<truing::Options>") :]
    names = re.findall(r'(?:field|none_if_nan)<T>\("(\w+)"', options)
    assert names == ["low", "high", "names", "bounds", "way", "sigma", "rate"]
    assert 'none_if_nan<T>("sigma", &T::sigma, R"doc([m] if known.)doc")' in options
    assert "Which of them.\n\n'there': to the seed\n'not there': from the seed, and on" in options
    assert "typing.Literal['there', 'not there', 'back']" in table


def test_every_public_header_can_be_read(tables: ModuleType) -> None:
    source = ROOT / "cpp" / "include" / "truing"
    for path in source.rglob("*.hpp"):
        for struct in tables.read_header(path).structs:
            for field in struct.fields:
                assert re.fullmatch(r"[A-Za-z]\w*", field.name), f"{path}: {struct.name}.{field.name}"
                if struct.name.endswith(("Options", "Limits", "Errors")):
                    assert field.meaning, f"{path}: {struct.name}.{field.name} has no comment"


OPTIONS = [
    getattr(_core, name)
    for name in dir(_core)
    if name.endswith(("Options", "Limits")) or name in {"TrackSetup", "Conditions", "ImuErrors"}
]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda cls: cls.__name__)
def test_options_say_and_keep_every_field(options: Any) -> None:
    usual = options()
    doc = inspect.getdoc(options) or ""
    signature = options.__init__.__doc__.splitlines()[0]
    names = re.findall(r"(\w+): ", signature.partition("*, ")[2])
    names = [name for name in names if isinstance(getattr(options, name, None), property)]
    assert len(names) >= 2
    for name in names:
        value = getattr(usual, name)
        assert f"\n{name} = " in doc, name
        setattr(usual, name, value)
        given = dict(value) if isinstance(value, Mapping) else value
        again = usual.replace(**{name: given})
        assert repr(getattr(again, name)) == repr(value), name
    assert repr(usual) == f"{options.__name__}()"
    assert repr(pickle.loads(pickle.dumps(usual))) == repr(usual)


def test_options_show_what_is_not_at_its_default() -> None:
    assert repr(_core.PlanOptions(poses=30, index="a_optimal")) == "PlanOptions(poses=30, index='a_optimal')"


def test_a_wrong_keyword_is_named_with_the_closest() -> None:
    with pytest.raises(
        TypeError, match=r"IdentifyOptions has no 'tset_share'; choose from .*test_share"
    ) as error:
        _core.IdentifyOptions(tset_share=0.3)  # type: ignore[call-arg]
    assert str(error.value).endswith("Did you mean 'test_share'?")
    with pytest.raises(TypeError, match="IdentifyOptions: test_share cannot be 'much'"):
        _core.IdentifyOptions(test_share="much")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="PlanOptions takes keywords alone: poses"):
        _core.PlanOptions(5)  # type: ignore[misc]


def test_noise_that_is_not_given_is_none() -> None:
    options = _core.HandEyeOptions()
    assert options.pixel_sigma is None
    options.pixel_sigma = 0.5
    assert options.replace(reject=False).pixel_sigma == 0.5
    assert options.replace(pixel_sigma=None).pixel_sigma is None


def test_options_take_what_can_be_converted() -> None:
    assert _core.TrackSetup(gravity=[0, 0, -9]).gravity.tolist() == [0.0, 0.0, -9.0]
    assert _core.IdentifyOptions(rotation_length=1, free=("J1.a",)).free == ("J1.a",)
