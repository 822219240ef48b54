# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs are what their languages ask for, and say the same poses in each."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

import truing
from truing.files.brand_frames import Brand, frame_from_numbers
from truing.programs.write import BRANDS, Loop, Move, Program, write_program

A = truing.frame_from_xyz_rpy([0.5, -0.25, 0.75], [0.1, -0.2, 0.3])
B = truing.frame_from_xyz_rpy([0.6, -0.25, 0.75], [3.0, 0.4, -2.0])
TOOL = truing.frame_from_xyz_rpy([0, 0.01, 0.12], [0, 0, 0.5])
START = np.radians([0.0, -90, 90, 0, 45, 10])


def program(*body: Move | Loop, **changed: object) -> Program:
    values: dict[str, object] = {
        "name": "poses_50",
        "targets": {"P1": A, "P2.1": B},
        "start": START,
        "tool": TOOL,
        "body": body or (Move("joint", "P1"), Loop(3, (Move("line", "P2.1", dwell=2.5), Move("line", "P1")))),
        "percent": 50.0,
        "speed": 0.25,
    }
    return Program(**{**values, **changed})  # type: ignore[arg-type]


def text_of(brand: Brand, *body: Move | Loop) -> str:
    return "".join(write_program(program(*body), brand).values())


NUMBER = r"-?\d+\.\d+"

# How the two targets and the tool stand in a program, found without our own readers.
FRAMES: dict[Brand, Callable[[str], list[list[float]]]] = {
    "kuka": lambda text: numbers_in(r"=\{(?:FRAME: )?(X .*?)\}", text),
    "abb": lambda text: [
        [float(n) for n in re.findall(r"-?\d+\.\d+", found)]
        for found in re.findall(r"\[(\[[^\[\]]*\],\[[^\[\]]*\])", text)
        if len(re.findall(r"\d+\.\d+", found)) == 7
    ],
    "fanuc": lambda text: numbers_in(r"\tX = (.*?)\}", text),
    "ur": lambda text: numbers_in(r"p\[(.*?)\]", text),
    "yaskawa": lambda text: numbers_in(r"^C\d{5}=(.*?)$", text),
}


def numbers_in(pattern: str, text: str) -> list[list[float]]:
    return [
        [float(n) for n in re.findall(NUMBER, found)]
        for found in re.findall(pattern, text, re.DOTALL | re.MULTILINE)
    ]


@pytest.mark.parametrize("brand", BRANDS)
def test_every_brand_says_the_same_poses(brand: Brand) -> None:
    text = text_of(brand).replace("\r\n", "\n")
    frames = [frame_from_numbers(brand, numbers) for numbers in FRAMES[brand](text)]
    for wanted in (A, B):  # printed to 0.001 mm and 0.0001 deg or better
        assert any(np.allclose(wanted, found, atol=2e-6) for found in frames), frames


@pytest.mark.parametrize("brand", BRANDS)
def test_lines_end_as_the_controller_wants_them(brand: Brand) -> None:
    for text in write_program(program(), brand).values():
        assert text.endswith("\n") and text.isascii()
        assert ("\r\n" in text) == (brand != "ur")
        assert text.replace("\r\n", "").count("\n") == (0 if brand != "ur" else text.count("\n"))


@pytest.mark.parametrize(
    ("brand", "opens", "closes"),
    [
        ("kuka", r"^\s*FOR N\d=1 TO \d+", r"^\s*ENDFOR"),
        ("abb", r"^\s*FOR n\d FROM 1 TO \d+ DO", r"^\s*ENDFOR"),
        ("fanuc", r"LBL\[\d\]    ;", r"JMP LBL\[\d\]"),
        ("ur", r"^\s*while ", r"^ {2,}end$"),
        ("yaskawa", r"^\*L\d", r"^JUMP \*L\d"),
    ],
)
def test_loops_open_and_close(brand: Brand, opens: str, closes: str) -> None:
    inner = Loop(10, (Move("joint", "P1", dwell=1.0),))
    text = text_of(brand, Loop(24, (inner, Loop(7, (Move("joint", "P2.1"),))))).replace("\r\n", "\n")
    labels = re.findall(opens, text, re.MULTILINE)
    assert len(re.findall(closes, text, re.MULTILINE)) == 3
    assert len([one for one in labels if "JMP" not in one]) - text.count("JMP LBL") * (brand == "fanuc") in (
        0,
        3,
    )
    for count in ("24", "10", "7"):
        assert count in text


def test_a_fanuc_loop_runs_as_often_as_asked() -> None:
    lines = text_of("fanuc", Loop(3, (Move("joint", "P1"),))).split("\r\n")
    commands = [line.partition(":  ")[2].removesuffix("    ;") for line in lines if re.match(r" *\d+:", line)]
    register, visits, place = 0, 0, commands.index("R[1]=0")
    while place < len(commands):
        command = commands[place]
        if command == "R[1]=R[1]+1":
            register += 1
        visits += command == "J P[2] 50% FINE"
        jump = re.fullmatch(r"IF R\[1\]<(\d+),JMP LBL\[1\]", command)
        place = commands.index("LBL[1]") if jump and register < int(jump[1]) else place + 1
    assert visits == 3


def test_a_script_of_universal_robots_is_nearly_python() -> None:
    """Its while loops and calls can be run by Python once "end" is gone: the moves in their order."""
    body = (Move("joint", "P1"), Loop(2, (Move("line", "P2.1", dwell=2.5), Move("line", "P1"))))
    lines = [line for line in text_of("ur", *body).splitlines() if line.strip() != "end"]
    code = re.sub(r"p\[(.*?)\]", r"(\1)", "\n".join(lines))
    done: list[str] = []
    names = {
        "set_tcp": lambda pose: done.append("tcp"),
        "movej": lambda target, a, v: done.append("joint"),
        "movel": lambda target, a, v: done.append(f"line {target[0]:.1f} at {v}"),
        "sleep": lambda seconds: done.append(f"sleep {seconds}"),
    }
    exec(code, names)  # noqa: S102
    visit = ["line 0.6 at 0.25", "sleep 2.5", "line 0.5 at 0.25"]
    assert done == ["tcp", "joint", "joint", *visit, *visit]


def test_arcs_go_through_their_second_target() -> None:
    arc = Move("arc", "P1", start="P1", via="P2.1")
    assert "CIRC XP2_1, XP1" in text_of("kuka", arc)
    assert "MoveC pP2_1,pP1,vTest,fine,tTest;" in text_of("abb", arc)
    assert "C P[3]\r\n    :  P[2] 250mm/sec FINE    ;" in text_of("fanuc", arc)
    assert "movec(pose_P2_1, pose_P1, a=1.2, v=0.25, mode=1)" in text_of("ur", arc)
    assert re.findall(r"MOVC C0000(\d)", text_of("yaskawa", arc)) == ["0", "1", "0"]


def test_targets_that_are_not_driven_are_not_written() -> None:
    assert "P2" not in text_of("kuka", Move("joint", "P1"))


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"name": "50 poses"}, "expected a name of letters"),
        ({"name": "a" * 21}, "at most 20"),
        ({"body": ()}, "has no moves"),
        ({"body": (Move("joint", "P7"),)}, "the target 'P7' is not among its targets"),
    ],
)
def test_what_no_controller_would_take_is_refused(changed: dict[str, object], expected: str) -> None:
    with pytest.raises(truing.InputError, match=expected):
        write_program(program(**changed), "kuka")
