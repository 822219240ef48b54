# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs in the varieties that public examples show. What is found in each was checked by hand and stands
in tests/data/programs/expected.csv: every target by line, and why others stay.
"""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from program_corpus import BESIDE, CORPUS, applied, programs, rows
from truing import InputError

PROGRAMS = programs()


def expected(program: str) -> list[tuple[str, ...]]:
    with (CORPUS / "expected.csv").open(encoding="utf-8", newline="") as file:
        return [tuple(row[1:]) for row in csv.reader(file) if row[0] == program]


def test_the_corpus_is_large_enough() -> None:
    assert len(PROGRAMS) >= 25
    assert {path.suffix for path in PROGRAMS} == {".src", ".mod", ".ls", ".script", ".jbi"}


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_every_target_is_found_or_said_to_stay(path: Path) -> None:
    assert rows(applied(path)) == expected(path.name)


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_identical_robots_leave_every_byte(path: Path) -> None:
    for file, data in applied(path, identical=True).files.items():
        assert data == file.read_bytes()


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_bytes_between_numbers_of_targets_stay(path: Path) -> None:
    outcome = applied(path)
    for file, data in outcome.files.items():
        old, new = file.read_bytes(), data
        tokens = sorted(
            (number.start, number.end, text.encode())
            for one in outcome.targets
            if one.source == file
            for number, text in one.texts.items()
        )
        shift = done = 0
        for start, end, text in tokens:
            assert old[done:start] == new[done + shift : start + shift]
            assert new[start + shift : start + shift + len(text)] == text
            shift, done = shift + len(text) - (end - start), end
        assert old[done:] == new[done + shift :]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("bad_two_robots.jbi", "line 14: the job moves the robots RB1, RB2"),
        ("bad_two_robots.ls", "line 27: P[2] moves a second robot, group 2"),
        ("bad_two_robots.mod", "line 5: SyncMoveOn: robots that move together"),
        ("bad_reach.ls", "line 20: P[2] is out of the nominal robot's reach"),
        ("bad_tool.mod", "line 3: p1: tool tGripper is not defined"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(name: str, message: str) -> None:
    with pytest.raises(InputError, match=".") as refusal:
        applied(CORPUS / name)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_other_files_are_told_by_their_name(tmp_path: Path) -> None:
    for name, message in (("a.tp", "save it as .ls"), ("a.pdl", "expected a program of KUKA")):
        (tmp_path / name).write_bytes(b"\0\1")
        with pytest.raises(InputError, match=message):
            applied(tmp_path / name)
    (tmp_path / "binary.ls").write_bytes(b"/PROG\0\1")
    with pytest.raises(InputError, match="binary file"):
        applied(tmp_path / "binary.ls")
    (tmp_path / "empty.jbi").write_bytes(b" \n")
    with pytest.raises(InputError, match="is empty"):
        applied(tmp_path / "empty.jbi")


def test_a_dat_is_found_beside_its_src_and_written_with_it(tmp_path: Path) -> None:
    for name in ("kuka_points.src", "kuka_points.dat"):
        shutil.copy(CORPUS / name, tmp_path / name)
    outcome = applied(tmp_path / "kuka_points.src")
    assert {path.name for path in outcome.files} == {"kuka_points.src", "kuka_points.dat"}


def test_files_that_are_only_looked_into_are_not_written() -> None:
    outcome = applied(CORPUS / "kuka_numbered.src")
    assert [path.name for path in outcome.files] == ["kuka_numbered.src"]
    assert BESIDE["kuka_numbered.src"] == ["kuka_config.dat"]


def test_one_bad_program_does_not_keep_others_from_being_written(tmp_path: Path) -> None:
    outcome = applied(CORPUS / "fanuc_plain.ls", [CORPUS / "bad_reach.ls"])
    assert [path.name for path in outcome.files] == ["fanuc_plain.ls"]
    (refused,) = outcome.refused
    assert "out of the nominal robot's reach" in refused.message


def test_a_string_between_sign_and_digits_makes_no_number(tmp_path: Path) -> None:
    text = (CORPUS / "ur_notool.script").read_bytes()
    assert b"-1.4" in text
    (tmp_path / "ur_notool.script").write_bytes(text.replace(b"-1.4", b'-"x"1.4', 1))
    outcome = applied(tmp_path / "ur_notool.script")
    assert [stay.why for _, stay in outcome.stays if stay.line == 1] == ["the target is computed"]


@pytest.mark.parametrize(
    "name", ["kuka_arc.src", "abb_utf8.mod", "fanuc_plain.ls", "yaskawa_arc.jbi", "ur_notool.script"]
)
def test_a_mark_of_utf_8_is_no_part_of_a_program(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + (CORPUS / name).read_bytes())
    assert rows(applied(tmp_path / name)) == expected(name)


ARC = """/PROG  A
/MN
   1:J P[1] 100% FINE    ;
{moves}
/POS
{points}/END
"""
POINT = """P[{k}]{{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = {x:.3f} mm, Y = {y:.3f} mm, Z = 800.000 mm,
	W = 180.000 deg, P = -30.000 deg, R = 0.000 deg
}};
"""


def arc_moves(folder: Path, rise: float) -> list[str]:
    """What becomes of four points of moves A on an arc that rises so far [mm] above 400 mm of way."""
    points = [(900.0 - up, y) for y, up in ((-200.0, 0.0), (-80.0, rise), (80.0, rise), (200.0, 0.0))]
    text = ARC.format(
        moves="\n".join(f"   {k + 1}:A P[{k}] 100mm/sec FINE    ;" for k in range(1, 5)),
        points="".join(POINT.format(k=k, x=x, y=y) for k, (x, y) in enumerate(points, 1)),
    )
    (folder / "a.ls").write_text(text, encoding="ascii")
    return [f"{one.status} {one.why}".strip() for one in applied(folder / "a.ls").targets]


def test_a_fanuc_arc_of_moves_a_keeps_its_radius_and_plane(tmp_path: Path) -> None:
    assert arc_moves(tmp_path, 150.0) == ["changed"] * 4
    first, second, third, last = arc_moves(tmp_path, 1.0)
    assert (first, last) == ("changed", "changed")  # they are in the middle of none
    assert second.startswith("stayed a point on an arc, whose ")
    assert third == "stayed a point on an arc whose start or end stays as it is"
