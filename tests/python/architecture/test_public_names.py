# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The names of the package: few, there when asked for, and free until then."""

from __future__ import annotations

import subprocess
import sys

import pytest

import truing


def test_importing_truing_loads_nothing_else() -> None:
    heavy = "('truing.', 'numpy', 'pyarrow', 'pydantic')"
    code = f"import sys, truing; print([m for m in sys.modules if m.startswith({heavy})])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.strip() == "[]"


def test_the_package_has_few_names_of_its_own() -> None:
    assert 30 <= len(truing.__all__) <= 45
    assert set(truing.__all__) <= set(dir(truing))


@pytest.mark.parametrize("name", truing.__all__)
def test_a_name_is_there_and_documented(name: str) -> None:
    assert getattr(truing, name).__doc__


def test_rooms_come_with_the_package() -> None:
    assert truing.diagnosis.diagnose is truing.diagnose
    assert truing.model.Robot is truing.Robot


def test_a_name_that_is_not_there_raises() -> None:
    with pytest.raises(AttributeError, match="identfy"):
        _ = truing.identfy  # type: ignore[attr-defined]
