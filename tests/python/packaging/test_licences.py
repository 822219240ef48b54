# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""No wheel is written with something in it that may not be there: what scripts/licences.py sees to."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"


@pytest.fixture(scope="module")
def licences() -> ModuleType:
    spec = importlib.util.spec_from_file_location("licences", SCRIPTS / "licences.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["licences"] = module  # for its dataclasses
    spec.loader.exec_module(module)
    return module


COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Source: https://example.org

Files: *
Copyright: 2020 somebody
License: BSD-3-clause

Files: src/fast/*
Copyright: 2021 somebody else
License: GPL-2+
 Some words.

License: BSD-3-clause
 The words.
"""


def test_the_last_stanza_that_fits_says_the_licence(licences: ModuleType) -> None:
    stanzas = licences.read_copyright(COPYRIGHT)
    assert licences.licence_of("/usr/include/thing/src/slow/a.h", stanzas) == "BSD-3-clause"
    assert licences.licence_of("/usr/include/thing/src/fast/a.h", stanzas) == "GPL-2+"


@pytest.mark.parametrize(
    ("licence", "spdx"),
    [
        ("BSD-3-clause", "BSD-3-Clause"),
        ("zlib/libpng", "Zlib"),
        ("LGPL-2.1+ or MPL-2", "MPL-2.0"),
        ("BSD-3-Clause and Expat", "BSD-3-Clause AND MIT"),
    ],
)
def test_a_licence_that_asks_nothing_of_the_rest_is_accepted(
    licences: ModuleType, licence: str, spdx: str
) -> None:
    assert licences.accepted(licence) == spdx


@pytest.mark.parametrize("licence", ["GPL-2+", "LGPL-2.1+", "AGPL-3", "BSD-3-clause and GPL-2", "", "beer"])
def test_others_and_unknown_ones_are_not(licences: ModuleType, licence: str) -> None:
    with pytest.raises(licences.LicenceError, match="not among those that may be shipped"):
        licences.accepted(licence)


def test_a_file_that_nobody_knows_is_a_problem(licences: ModuleType, tmp_path: Path) -> None:
    inventory = licences.Inventory([tmp_path / "own"])
    inventory.add(tmp_path / "own" / "a.hpp")
    assert inventory.problems == []
    stranger = tmp_path / "stranger.a"
    stranger.write_bytes(b"")
    inventory.add(stranger)
    assert inventory.problems == [f"{stranger}: belongs to no package"]


def installed(pattern: str) -> Path:
    """A library of this machine."""
    found = sorted(Path("/usr/lib").rglob(pattern)) if shutil.which("dpkg-query") else []
    if not found:
        pytest.skip(f"needs a Debian or Ubuntu machine with {pattern}")
    return found[0]


def test_cholmod_which_debians_ceres_brings_is_not_shipped(licences: ModuleType) -> None:
    inventory = licences.Inventory([])
    inventory.add(installed("libcholmod.so.*"))
    assert len(inventory.problems) == 1 and inventory.parts == {}


def test_a_library_that_may_be_shipped_brings_its_notice(licences: ModuleType) -> None:
    inventory = licences.Inventory([])
    inventory.add(installed("libtinyxml2.so.*"))
    assert inventory.problems == []
    assert inventory.parts["tinyxml2"].licences == {"Zlib"}
    assert "Lee Thomason" in licences.notices(list(inventory.parts.values()))


def test_a_script_of_packages_is_as_good_as_the_worst_of_them(licences: ModuleType) -> None:
    inventory = licences.Inventory([])
    inventory.add_script("contains\n\n@plotly/d3 3.8.2 (BSD-3-Clause)\nthree 0.187.0 (MIT)\n\nwords\n")
    assert inventory.problems == [] and sorted(inventory.parts) == ["@plotly/d3", "three"]
    inventory.add_script("bad 1.0 (GPL-3.0-only)\n")
    assert len(inventory.problems) == 1 and "bad" in inventory.problems[0]


def test_the_script_that_is_shipped_is_of_such_packages(licences: ModuleType) -> None:
    texts = (SCRIPTS.parent / "python" / "truing" / "report" / "licences.txt").read_text(encoding="utf-8")
    inventory = licences.Inventory([])
    inventory.add_script(texts)
    assert inventory.problems == [] and "three" in inventory.parts


def test_a_file_in_the_wheel_that_nobody_vouches_for_is_a_problem(
    licences: ModuleType, tmp_path: Path
) -> None:
    (tmp_path / "truing").mkdir()
    (tmp_path / "truing" / "a.py").write_text("", encoding="utf-8")
    (tmp_path / "truing" / "font.woff2").write_bytes(b"")
    inventory = licences.Inventory([])
    licences.inspect_wheel(tmp_path, inventory)
    assert [problem.partition(":")[0] for problem in inventory.problems] == ["truing/font.woff2"]


def test_every_file_of_the_package_has_somebody_who_vouches_for_it(
    licences: ModuleType, tmp_path: Path
) -> None:
    package = SCRIPTS.parent / "python" / "truing"
    shutil.copytree(package, tmp_path / "truing", ignore=shutil.ignore_patterns("__pycache__"))
    inventory = licences.Inventory([])
    licences.inspect_wheel(tmp_path, inventory)
    assert inventory.problems == []
