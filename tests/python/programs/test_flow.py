# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which tool holds at a target, where a program runs in another order than its lines: what is not certain is
not known, and the target stays.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from truing.files.programs import Given, Reading, read_programs

KRL_POINT = "{X 900,Y 0,Z 800,A 0,B 90,C 0}"
UR_POINT = "p[0.5,0.2,0.4,0,3.14,0]"


def reading_of(folder: Path, name: str, text: str) -> Reading:
    path = folder / name
    path.write_text(text, encoding="ascii")
    readings, refused = read_programs([path], Given())
    assert not refused
    return readings[0]


def heights(reading: Reading) -> dict[int, float | str]:
    """By line: the tool's z [mm], or why the target stays."""
    found: dict[int, float | str] = {stay.line: stay.why for stay in reading.stays}
    for target in reading.targets:
        assert target.tool.T is not None
        found[target.line] = round(1e3 * float(target.tool.T[2, 3]), 6)
    return dict(sorted(found.items()))


@pytest.fixture
def krl(tmp_path: Path) -> Callable[[str], Reading]:
    """Reads lines in which T100 sets a tool of 100 mm and MOVE moves, after one that sets the base."""

    def read(lines: str) -> Reading:
        for height in (100, 200):
            lines = lines.replace(f"T{height}", f"$TOOL={{X 0,Y 0,Z {height},A 0,B 0,C 0}}")
        lines = lines.replace("MOVE", f"LIN {KRL_POINT}")
        return reading_of(tmp_path, "a.src", "DEF A()\n$BASE=$WORLD\n" + lines)

    return read


def script(folder: Path, lines: str) -> Reading:
    for height in (100, 200):
        lines = lines.replace(f"T{height}", f"set_tcp(p[0,0,{height / 1000},0,0,0])")
    return reading_of(folder, "a.script", "def a():\n" + lines.replace("MOVE", f"movel({UR_POINT})"))


@pytest.mark.parametrize(
    "loop", ["LOOP ENDLOOP", "WHILE $IN[1];ENDWHILE", "FOR I=1 TO 3;ENDFOR", "REPEAT UNTIL X"]
)
def test_a_loop_that_ends_with_another_tool_begins_with_none(
    krl: Callable[[str], Reading], loop: str
) -> None:
    begin, _, end = loop.partition(";") if ";" in loop else loop.partition(" ")
    found = heights(krl(f"T100\n{begin}\nMOVE\nT200\nMOVE\n{end}\nEND\n"))
    assert found == {5: "which tool holds depends on the block at line 4", 7: 200.0}
    found = heights(krl(f"T200\n{begin}\nMOVE\nT200\nMOVE\n{end}\nMOVE\nEND\n"))
    assert found == {5: 200.0, 7: 200.0, 9: 200.0}


def test_a_loop_in_a_loop_is_seen_from_the_outer_one(krl: Callable[[str], Reading]) -> None:
    found = heights(krl("T100\nLOOP\nMOVE\nLOOP\nT200\nENDLOOP\nENDLOOP\nEND\n"))
    assert found == {5: "which tool holds depends on the block at line 4"}


def test_a_routine_leaves_its_tool_to_its_caller(krl: Callable[[str], Reading]) -> None:
    routines = "END\nDEF B()\nC()\nEND\nDEF C()\nT200\nEND\nDEF D()\nMOVE\nEND\n"
    found = heights(krl("T100\nMOVE\nB()\nMOVE\nD()\nMOVE\n" + routines))
    assert {line: found[line] for line in (4, 6, 8)} == {4: 100.0, 6: 200.0, 8: 200.0}
    assert found[17] == "which tool holds depends on where this routine is called from"


def test_what_is_called_elsewhere_is_said(krl: Callable[[str], Reading]) -> None:
    reading = krl("BAS(#INITMOV,0)\nT100\nGRIP(1)\nMOVE\nOPEN_IT()\nGRIP(0)\nEND\n")
    assert heights(reading) == {6: 100.0}
    assert reading.notes == [
        "a.src: GRIP, OPEN_IT, called and not in the files given, are taken to leave tool and base as they"
        " are"
    ]


def test_behind_a_label_only_what_holds_everywhere_is_known(krl: Callable[[str], Reading]) -> None:
    found = heights(krl("T100\nAGAIN:\nMOVE\nT200\nMOVE\nGOTO AGAIN\nEND\n"))
    assert isinstance(found[5], str) and found[7] == 200.0


@pytest.mark.parametrize("line", ["$TOOL.Z=33", "$TOOL . Z = $TOOL.Z+1"])
def test_a_tool_that_is_set_in_part_is_not_known(krl: Callable[[str], Reading], line: str) -> None:
    assert heights(krl(f"T100\nMOVE\n{line}\nMOVE\nEND\n")) == {
        4: 100.0,
        6: "a part of $TOOL is set in line 5",
    }


def test_a_tool_of_the_table_that_is_set_twice_is_not_known(krl: Callable[[str], Reading]) -> None:
    tool = "TOOL_DATA[1]={X 0,Y 0,Z 100,A 0,B 0,C 0}\n"
    use = "$TOOL=TOOL_DATA[1]\nMOVE\n"
    assert heights(krl(tool + use + tool + "END\n")) == {5: 100.0}
    for other in (tool.replace("100", "120"), "TOOL_DATA[1].Z=120\n", "TOOL_DATA[1]=OTHER\n"):
        (why,) = heights(krl(tool + use + other + "END\n")).values()
        assert str(why).startswith("TOOL_DATA[1] is set to") and str(why).endswith("in line 6 of a.src")


def test_two_branches_that_set_the_same_tool_leave_it(krl: Callable[[str], Reading]) -> None:
    found = heights(
        krl("T100\nIF X THEN\nT200\nELSE\nT200\nENDIF\nMOVE\nIF X THEN\nT100\nENDIF\nMOVE\nEND\n")
    )
    assert found == {9: 200.0, 13: "which tool holds depends on the block at line 10"}


def test_scripts_have_loops_and_routines_as_well(tmp_path: Path) -> None:
    found = heights(script(tmp_path, "T100\nwhile (True):\nMOVE\nT200\nMOVE\nend\nend\n"))
    assert found == {4: "which tool holds depends on the block at line 3", 6: 200.0}
    found = heights(script(tmp_path, "def b():\nT200\nend\nT100\nMOVE\nb()\nMOVE\nend\n"))
    assert found == {6: 100.0, 8: 200.0}
    found = heights(script(tmp_path, "T100\nif x:\nT200\nelif y:\nT200\nelse:\nT200\nend\nMOVE\nend\n"))
    assert found == {10: 200.0}


def test_a_base_that_a_routine_sets_to_the_world_is_its_callers(tmp_path: Path) -> None:
    text = f"DEF A()\nB()\n$TOOL={{X 0,Y 0,Z 100,A 0,B 0,C 0}}\nLIN {KRL_POINT}\nEND\n"
    text += "DEF B()\n$BASE=$WORLD\nEND\n"
    assert heights(reading_of(tmp_path, "a.src", text)) == {4: 100.0}


def test_why_a_tool_is_not_known_is_said_behind_loops_as_well(krl: Callable[[str], Reading]) -> None:
    found = heights(krl("FDAT_ACT=FP1\nFOR I=1 TO 3\nMOVE\nENDFOR\nMOVE\nEND\n"))
    assert {str(why) for why in found.values()} == {"FDAT_ACT is set to what is not in the files given: FP1"}


RAPID_MOVE = "MoveAbsJ [[0,0,0,0,9,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v9,fine,tool0"
FANUC_POINT = (
    'P[1:"bin ]{"]{ GP1: UF : 0, UT : 0,\n'
    "J1= 0 deg, J2= 0 deg, J3= 0 deg, J4= 0 deg, J5= 9 deg, J6= 0 deg };\n"
)


def fanuc(points: str, *moves: str) -> str:
    return "\n".join(["/PROG A", "/MN", *moves, "/POS", points + "P[2]{ GP1: UF : 0, UT : 0, };", "/END", ""])


def test_a_point_of_a_fanuc_that_the_program_computes_with_is_listed(tmp_path: Path) -> None:
    text = fanuc(FANUC_POINT, "  1:J P[1] 50% FINE ;", "  2:  PR[4]=P[1:bin] ;", "  3:  P[1:bin]=P[1] ;")
    stays = reading_of(tmp_path, "a.ls", text).stays
    assert [(stay.line, stay.why) for stay in stays if "computes" in stay.why] == [
        (4, "computes with P[1], which is changed"),
        (5, "computes with P[1], which is changed"),
    ]


def test_pulses_are_not_taken_from_where_a_job_has_a_frame(tmp_path: Path) -> None:
    """///RECTAN is missing: millimetres were taken for pulses."""
    text = "/JOB\n//POS\n///TOOL 0\n///POSTYPE PULSE\n///PULSE\nC00000=0,0,0,0,900,0\n///USER 1\n"
    text += "///POSTYPE USER\nC00001=500.0,0.0,400.0,180.0,0.0,0.0\n//INST\nMOVJ C00000\nMOVJ C00001\nEND\n"
    (tmp_path / "a.jbi").write_text(text, encoding="ascii")
    (reading,), _ = read_programs([tmp_path / "a.jbi"], Given(pulses=(1.0,) * 6))
    assert [target.name for target in reading.targets] == ["C00000"]
    assert [stay.why for stay in reading.stays] == ["its ///POSTYPE is USER, expected PULSE with ///PULSE"]


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "open.script",
            f"def f():\n  movel({UR_POINT})\n  movel({UR_POINT[:-1]}, a=1.2)\nend\n",
            "line 3: .* do not close in pairs, expected",
        ),
        ("cut.script", f"def f():\n  movel({UR_POINT})\n  movel(p[0.5,0.2", "line 3: .* do not close"),
        (
            "tool.script",
            f"def f():\n  set_tcp(p[0,0,0.1,0,0,0)\n  movel({UR_POINT})\nend\n",
            "line 2: .* do not close",
        ),
        (
            "cut.mod",
            "MODULE m\nPROC main()\nMoveAbsJ [[0,0,0,0,9,0],[9E9]],v9,fine,tool0;\nMoveL [[9",
            "line 4: .*no ; follows, expected one",
        ),
        (
            "inside.mod",
            f"MODULE m\n{RAPID_MOVE}\n{RAPID_MOVE};\nENDMODULE\n",
            "line 2: .*no ; follows, expected one",
        ),
        (
            "open.mod",
            f"MODULE m\n{RAPID_MOVE.replace(']]', ']', 1)};\nENDMODULE\n",
            "line 2: .* do not close",
        ),
        ("cut_after.mod", f"MODULE m\nPROC main()\n{RAPID_MOVE};\n", "no ENDMODULE, and was cut off"),
        ("open.src", f"DEF A()\nLIN {KRL_POINT[:-1]}\nEND\n", "line 2: .* do not close"),
        ("cut.src", f"DEF A()\nLIN {KRL_POINT}\n", "no END, and was cut off"),
        ("cut_after.script", f"def f():\n  movel({UR_POINT})\n", "a routine has no end"),
        ("open.ls", fanuc(FANUC_POINT.replace("}", "")), "line 4: P.1. has no } at its end"),
        ("cut.ls", fanuc(FANUC_POINT).replace("/END", ""), "no /END, and was cut off"),
        ("cut.jbi", "/JOB\n//POS\n///TOOL 0\n///POSTYPE PULSE\n///PULSE\nC00000=0,0,0,0,0,0\n", "no //INST"),
        ("cut_after.jbi", "/JOB\n//POS\n//INST\nNOP\nMOVJ C00000\n", "no END, and was cut off"),
    ],
)
def test_a_program_that_does_not_end_is_refused(tmp_path: Path, name: str, text: str, expected: str) -> None:
    """It was passed over without a word: the target not corrected, the tool not set, or the rest left out."""
    path = tmp_path / name
    path.write_text(text, encoding="ascii")
    readings, refused = read_programs([path], Given())
    assert not readings
    assert re.search(expected, refused[0].message)
