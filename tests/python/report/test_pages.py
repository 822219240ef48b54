# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A page is one file that says the same with its script and without, runs nothing but its script, and shows
every text as text.
"""

from __future__ import annotations

import base64
import gc
import hashlib
import html
import json
import re
import weakref
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import truing
from pages import charts_of
from truing import _core
from truing.examples import example
from truing.report.arrays import outline, packed, unpacked
from truing.report.page import Page
from truing.report.picture import chart_picture
from truing.report.scene import Scene3d
from truing.report.words import sure_text

WEB = Path(__file__).resolve().parents[3] / "web"
EVIL = "</script><img src=x onerror=alert(1)>"
SIZE = (400, 240)


def shapes(data: list[dict[str, Any]], layout: dict[str, Any] | None = None) -> list[ElementTree.Element]:
    """What a static picture draws; it is well formed."""
    return list(ElementTree.fromstring(chart_picture(data, layout or {}, SIZE)).iter())


def file_of_report(name: str) -> str:
    return (resources.files("truing") / "report" / name).read_text(encoding="utf-8")


def test_nothing_is_said_to_be_wholly_certain() -> None:
    assert [sure_text(p) for p in (0.5, 0.987, 0.9962)] == ["50 %", "99 %", "> 99 %"]


def test_the_script_is_allowed_by_its_digest_and_nothing_else_is() -> None:
    page = Page("title").html()
    policy = re.search('Content-Security-Policy" content="(.*?)"', page)
    assert policy is not None
    for text in (file_of_report("report.js"), "\n" + file_of_report("boot.js")):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy[1]
    assert "unsafe-eval" not in page and "default-src 'none'" in policy[1]
    assert policy[1].count("sha256-") == 2


def test_the_script_carries_the_licences_of_what_is_in_it() -> None:
    script, licences = file_of_report("report.js"), file_of_report("licences.txt")
    for name, version in json.loads((WEB / "package.json").read_text())["dependencies"].items():
        assert f"{name} {version} (MIT)" in licences
    for paragraph in licences.split("\n\n")[1:]:
        assert paragraph.strip() in script


def test_bars_end_where_their_numbers_say() -> None:
    bars = {"type": "bar", "orientation": "h", "y": ["a", "b"], "x": [10.0, 40.0]}
    wide = [float(s.get("width", 0)) for s in shapes([bars]) if s.tag.endswith("rect")]
    assert len(wide) == 2 and wide[1] == pytest.approx(4 * wide[0], rel=0.01)


def test_lines_keep_their_gaps_and_points_their_places() -> None:
    x, y = np.arange(5.0), np.array([1.0, 2.0, np.nan, 4.0, 5.0])
    line = {"type": "scatter", "mode": "lines", "x": packed(x), "y": packed(y), "line": {"color": "#123456"}}
    path = next(s for s in shapes([line]) if s.get("stroke") == "#123456")
    assert path.get("d", "").count("M") == 2
    points = {**line, "mode": "markers", "marker": {"color": "#abcdef", "size": 4}}
    dots = next(s for s in shapes([points]) if s.get("stroke") == "#abcdef")
    assert dots.get("d", "").count("h0") == 4


@pytest.mark.parametrize(("axis", "expected"), [({"type": "log"}, [0.0, 0.5, 1.0]), ({}, [0.0, 9 / 99, 1.0])])
def test_axes_are_linear_or_logarithmic(axis: dict[str, Any], expected: list[float]) -> None:
    points = {"mode": "markers", "x": [1.0, 10.0, 100.0], "y": [1, 2, 3], "marker": {"color": "#abcdef"}}
    dots = next(s for s in shapes([points], {"xaxis": axis}) if s.get("stroke") == "#abcdef")
    at = [float(v) for v in re.findall(r"M([\d.]+) ", dots.get("d", ""))]
    assert (np.array(at) - at[0]) / (at[-1] - at[0]) == pytest.approx(expected, abs=0.01)


def test_cells_without_a_value_stay_empty() -> None:
    cells = {"type": "heatmap", "z": [[1.0, None], [0.0, 2.0]], "x": ["a", "b"], "y": ["c", "d"]}
    assert len([s for s in shapes([cells]) if s.tag.endswith("rect")]) == 3


def test_pictures_show_what_is_visible_at_first_and_every_text_as_text() -> None:
    one = {"type": "scatter", "mode": "lines", "x": [0, 1], "y": [0, 1], "line": {"color": "#111111"}}
    other = {**one, "line": {"color": "#222222"}, "visible": False}
    layout = {
        "title": {"text": f"<b>{html.escape(EVIL)}</b>"},
        "annotations": [{"text": EVIL, "x": 0, "y": 0}],
    }
    picture = chart_picture([one, other], layout, SIZE)
    assert "#111111" in picture and "#222222" not in picture
    assert "<img" not in picture and "onerror" in picture
    ElementTree.fromstring(picture)


def test_a_line_of_few_points_keeps_its_peaks_and_gaps() -> None:
    values = np.sin(np.arange(10_000) / 50)
    values[1234], values[5000:5100] = 7.0, np.nan
    pick = outline(values, 300)
    assert pick.size < 400 and 1234 in pick and np.isnan(values[pick]).any()
    assert np.array_equal(unpacked(packed(values[pick])), values[pick].astype("f4"), equal_nan=True)


def some_page() -> str:
    page = Page(EVIL)
    page.chart("c", [{"type": "bar", "x": [EVIL], "y": [1.0], "name": html.escape(EVIL)}], {}, size="small")
    scene = Scene3d()
    scene.add_points(np.zeros((1, 3)), EVIL, 3, "#000000", texts=[EVIL], group=EVIL)
    scene.add_arrows(np.zeros((2, 3)), np.eye(3)[:2], EVIL, "#000000", 1, group=EVIL)
    scene.add_line(np.eye(3), EVIL, "#000000", 1)
    scene.draw(page, eye=(1, 1, 1), size="cloud")
    return page.html()


def test_a_page_without_its_script_still_has_its_pictures() -> None:
    page = re.sub("<script.*?</script>", "", some_page(), flags=re.DOTALL)
    pictures = re.findall('<svg class="picture".*?</svg>', page)
    assert len(pictures) == 2
    for picture in pictures:
        assert len(list(ElementTree.fromstring(picture).iter())) > 3
    assert "<img" not in page


def test_data_in_a_page_cannot_end_their_element() -> None:
    page = some_page()
    for name in ("charts", "scenes"):
        data = page[page.index(f'id="{name}">') + len(f'id="{name}">') :]
        assert "<" not in data[: data.index("</script>")]
        assert EVIL in str(json.loads(data[: data.index("</script>")]))


# ---- Notebooks -----------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def measured() -> tuple[truing.Robot, truing.Measurements]:
    robot = truing.load_robot(example("palletizer"))
    return robot, truing.simulate(robot, poses=60, seed=1).data


def page_in(frame: str) -> str:
    found = re.fullmatch('<iframe srcdoc="([^"]*)" sandbox="allow-scripts"[^>]*></iframe>', frame)
    assert found is not None
    return html.unescape(found[1])


def test_notebooks_show_a_result_as_its_report(measured: tuple[truing.Robot, truing.Measurements]) -> None:
    found = truing.identify(*measured)
    page = page_in(found._repr_html_())  # type: ignore[attr-defined]
    assert {"distribution", "rows"} <= set(charts_of(page)) and '"workspace"' in page
    assert len(page) < 2e6
    diagnosed = truing.diagnose(*measured)
    assert "truing diagnose" in page_in(diagnosed._repr_html_())  # type: ignore[attr-defined]


def test_a_result_without_its_data_is_shown_as_text(
    measured: tuple[truing.Robot, truing.Measurements],
) -> None:
    truing.identify(*measured)
    found = _core.identify(*measured, _core.IdentifyOptions())
    assert found._repr_html_() is None  # type: ignore[attr-defined]


def test_a_result_that_was_shown_is_freed(measured: tuple[truing.Robot, truing.Measurements]) -> None:
    found = truing.identify(*measured)
    found._repr_html_()  # type: ignore[attr-defined]
    gone = weakref.ref(found)
    del found
    gc.collect()
    assert gone() is None
