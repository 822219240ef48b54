# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The documentation site asks nothing of the network: what scripts/site_check.py finds in a built one."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"


@pytest.fixture(scope="module")
def check() -> ModuleType:
    spec = importlib.util.spec_from_file_location("site_check", SCRIPTS / "site_check.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "html",
    [
        '<script src="https://cdn.example/x.js"></script>',
        '<link rel="stylesheet" href="//fonts.example/css">',
        '<img src="HTTP://example/a.png">',
        "<p style=\"background: url('https://example/a.png')\">",
        "<style>@import 'https://example/a.css';</style>",
    ],
)
def test_what_a_page_would_fetch_from_elsewhere_is_found(
    check: ModuleType, tmp_path: Path, html: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "index.html").write_text(f"<html>{html}</html>", encoding="utf-8")
    assert check.main(tmp_path) == 1
    assert "index.html" in capsys.readouterr().out


def test_links_that_a_reader_may_follow_are_none(check: ModuleType, tmp_path: Path) -> None:
    page = '<a href="https://example.org">source</a><script src="assets/a.js"></script><img src="a.png">'
    (tmp_path / "index.html").write_text(page, encoding="utf-8")
    assert check.main(tmp_path) == 0


def test_a_site_without_pages_is_a_failure(check: ModuleType, tmp_path: Path) -> None:
    assert check.main(tmp_path) == 1
