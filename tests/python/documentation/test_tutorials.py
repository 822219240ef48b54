# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The tutorials do what they say: every block of commands runs, and prints what stands below it."""

from __future__ import annotations

from pathlib import Path

import pytest

from page_blocks import PageError, blocks, run_page

TUTORIALS = Path(__file__).resolve().parents[3] / "docs" / "tutorials"
PAGES = sorted(page for page in TUTORIALS.glob("*.md") if page.name != "index.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_runs_and_prints_what_it_shows(page: Path, tmp_path: Path) -> None:
    if page.stem == "servo":
        pytest.importorskip("mujoco")
    assert run_page(page, tmp_path) >= 2


def test_the_index_lists_every_tutorial() -> None:
    index = (TUTORIALS / "index.md").read_text(encoding="utf-8")
    assert [page.name for page in PAGES if f"({page.name})" not in index] == []


def page_with(folder: Path, text: str) -> Path:
    page = folder / "page.md"
    page.write_text(text, encoding="utf-8")
    return page


def test_output_that_is_not_printed_any_more_is_an_error_with_its_line(tmp_path: Path) -> None:
    page = page_with(tmp_path, "# t\n\n```sh\necho rms 2.00 mm\n```\n\n```text\nrms 2.30 mm\n```\n")
    with pytest.raises(PageError, match="page.md:7: this line is not printed"):
        run_page(page, tmp_path)


def test_numbers_may_differ_as_machines_do(tmp_path: Path) -> None:
    page = page_with(tmp_path, "```sh\necho 'rms   2.00 mm'\n```\n```text\n rms 2.05 mm\n```\n")
    assert run_page(page, tmp_path) == 1


@pytest.mark.parametrize(
    ("block", "complaint"),
    [
        ("```sh\nfalse\n```\n", "page.md:1: exit status 1"),
        ("```sh\nfalse | true\n```\n", "page.md:1: exit status 1"),
        ("\n```python\nassert 1 == 2\n```\n", "page.md:2: AssertionError"),
        ("```\ntruing demo\n```\n", "page.md:1: a block of no language"),
    ],
)
def test_a_block_that_fails_or_is_of_no_known_kind_is_an_error(
    tmp_path: Path, block: str, complaint: str
) -> None:
    with pytest.raises(PageError, match=complaint):
        run_page(page_with(tmp_path, block), tmp_path)


def test_files_are_written_and_consoles_are_not_run(tmp_path: Path) -> None:
    text = (
        '```csv title="a.csv"\n1,2\n```\n```console\n$ false\n```\n```sh\ncat a.csv\n```\n```text\n1,2\n```\n'
    )
    assert run_page(page_with(tmp_path, text), tmp_path) == 1
    assert [block.language for block in blocks(tmp_path / "page.md")] == ["csv", "console", "sh", "text"]
