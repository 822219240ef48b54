# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs in the languages of five robot makers, from a list of moves and loops.

| brand | language | files |
| --- | --- | --- |
| kuka | KRL | `name.src` `name.dat` |
| abb | RAPID | `name.mod` |
| fanuc | TP, as text | `name.ls` |
| ur | URScript | `name.script` |
| yaskawa | INFORM | `NAME.JBI` |

What is written is plain: Cartesian targets in the robot's base, a stop at each, a first joint motion that
sets the configuration where the language has one. What a text cannot set (tool numbers of FANUC and Yaskawa,
their configurations) stands in a comment at its top.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.brand_frames import NOTATIONS, Brand, numbers_from_frame

Floats = NDArray[np.float64]
BRANDS: tuple[Brand, ...] = ("kuka", "abb", "fanuc", "ur", "yaskawa")
_LONGEST_NAME = 20
_UR_JOINT = 1.4  # [rad/s^2] acceleration of movej, PolyScope's own
_UR_LINE = 1.2  # [m/s^2] of movel


@dataclass(frozen=True)
class Move:
    """To a target: by the joints, on a line, or on an arc through a second one."""

    kind: Literal["joint", "line", "arc"]
    target: str
    start: str = ""  # of an arc: where the robot is already
    via: str = ""  # of an arc
    dwell: float = 0.0  # [s] at the target, for the instrument


@dataclass(frozen=True)
class Loop:
    """Its moves, so many times."""

    count: int
    body: tuple[Move | Loop, ...]


@dataclass(frozen=True)
class Program:
    """What a robot is to drive."""

    name: str  # letters, digits and _, beginning with a letter
    targets: Mapping[str, Floats]  # shape=(4, 4) [m] tool in the robot's base
    start: Floats  # shape=(joints,) [rad]: where the first target is, as the controller reports it
    tool: Floats  # shape=(4, 4) [m] tool in the flange
    body: tuple[Move | Loop, ...]
    percent: float  # of the largest joint speed
    speed: float  # [m/s] on lines and arcs


def write_program(program: Program, brand: Brand) -> dict[str, str]:
    """The program's files by name, in the language of `brand`. Raises InputError for a program without moves,
    a name that a controller would not take, and a target that is not there.
    """
    _require_sense(program)
    return _WRITERS[brand](program)


def _require_sense(program: Program) -> None:
    name = program.name
    if not (name.isidentifier() and name.isascii() and len(name) <= _LONGEST_NAME):
        raise InputError(
            f"program {name!r}: expected a name of letters, digits and _, at most {_LONGEST_NAME} of them"
        )
    moves = list(_moves(program.body))
    if not moves:
        raise InputError(f"program {name}: has no moves")
    for move in moves:
        for target in filter(None, (move.target, move.start, move.via)):
            if target not in program.targets:
                raise InputError(f"program {name}: the target {target!r} is not among its targets")


def _moves(body: Sequence[Move | Loop]) -> Iterator[Move]:
    for one in body:
        if isinstance(one, Loop):
            yield from _moves(one.body)
        else:
            yield one


def _used(program: Program) -> list[str]:
    """Names of the targets in the order of their first use, via before the end of its arc."""
    return list(
        dict.fromkeys(
            name for move in _moves(program.body) for name in (move.start, move.via, move.target) if name
        )
    )


@dataclass(frozen=True)
class _Language:
    """How a brand writes a move, and what stands before and after the moves of a loop: a function of the
    loop's number and count.
    """

    move: Callable[[Move], list[str]]
    opening: Callable[[int, int], list[str]]
    closing: Callable[[int, int], list[str]]
    indent: str = "  "

    def lines(self, body: Sequence[Move | Loop], numbers: Iterator[int] | None = None) -> list[str]:
        """The program's lines; every loop has a number of its own, from 1."""
        numbers = itertools.count(1) if numbers is None else numbers
        out: list[str] = []
        for one in body:
            if isinstance(one, Loop):
                number = next(numbers)
                inner = [self.indent + line for line in self.lines(one.body, numbers)]
                out += [*self.opening(number, one.count), *inner, *self.closing(number, one.count)]
            else:
                out += self.move(one)
        return out


def _named(brand: Brand, T: Floats, digits: int) -> str:
    """ "X 1.000, Y 2.000 …": components with their names."""
    numbers = numbers_from_frame(brand, T)
    pairs = zip(NOTATIONS[brand].names, numbers, strict=True)
    return ", ".join(f"{name} {_fixed(value, digits)}" for name, value in pairs)


def _plain(brand: Brand, T: Floats, digits: int) -> list[str]:
    return [_fixed(value, digits) for value in numbers_from_frame(brand, T)]


def _fixed(value: float, digits: int) -> str:
    """Without a sign where nothing but zeros is left."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


# ---- KUKA --------------------------------------------------------------------------------------------------


def _kuka(program: Program) -> dict[str, str]:
    def move(one: Move) -> list[str]:
        target = f"X{_krl(one.target)}"
        text = {
            "joint": f"PTP {target}",
            "line": f"LIN {target}",
            "arc": f"CIRC X{_krl(one.via)}, {target}",
        }[one.kind]
        return [text, *([f"WAIT SEC {one.dwell:g}"] if one.dwell else [])]

    def opening(number: int, count: int) -> list[str]:
        return [f"FOR N{number}=1 TO {count}"]

    loops = sum(1 for _ in _loops(program.body))
    axes = ",".join(f"A{k} {math.degrees(q):.6f}" for k, q in enumerate(program.start, 1))
    head = [
        f"DEF {program.name}()",
        *([f"DECL INT {','.join(f'N{k}' for k in range(1, loops + 1))}"] if loops else []),
        "BAS(#INITMOV,0)",
        f"$TOOL={{{_named('kuka', program.tool, 6)}}}",
        "$BASE=$NULLFRAME",
        f"BAS(#VEL_PTP,{program.percent:g})",
        f"$VEL.CP={program.speed:.6g}",
        f"PTP {{{axes}}}",
    ]
    body = _Language(move, opening, lambda number, count: ["ENDFOR"]).lines(program.body)
    targets = [
        f"DECL E6POS X{_krl(name)}={{{_named('kuka', program.targets[name], 6)}}}" for name in _used(program)
    ]
    return {
        f"{program.name}.src": _text([*head, *body, "END"], "\r\n"),
        f"{program.name}.dat": _text([f"DEFDAT {program.name}", *targets, "ENDDAT"], "\r\n"),
    }


def _krl(name: str) -> str:
    """A target's name, of letters that every language takes."""
    return "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in name)


def _loops(body: Sequence[Move | Loop]) -> Iterator[Loop]:
    for one in body:
        if isinstance(one, Loop):
            yield one
            yield from _loops(one.body)


# ---- ABB ---------------------------------------------------------------------------------------------------


def _abb(program: Program) -> dict[str, str]:
    nowhere = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"

    def move(one: Move) -> list[str]:
        target = f"p{_krl(one.target)}"
        text = {
            "joint": f"MoveJ {target},vTest,fine,tTest;",
            "line": f"MoveL {target},vTest,fine,tTest;",
            "arc": f"MoveC p{_krl(one.via)},{target},vTest,fine,tTest;",
        }[one.kind]
        return [text, *([f"WaitTime {one.dwell:g};"] if one.dwell else [])]

    def opening(number: int, count: int) -> list[str]:
        return [f"FOR n{number} FROM 1 TO {count} DO"]

    def frame(T: Floats) -> str:
        numbers = _plain("abb", T, 9)
        return f"[{','.join(numbers[:3])}],[{','.join(numbers[3:])}]"

    axes = ",".join(f"{math.degrees(q):.6f}" for q in [*program.start, *[0.0] * 6][:6])
    declared = [
        f"PERS tooldata tTest:=[TRUE,[{frame(program.tool)}],[1,[0,0,1],[1,0,0,0],0,0,0]];",
        f"CONST speeddata vTest:=[{1e3 * program.speed:.6g},500,5000,1000];",
        f"CONST jointtarget jStart:=[[{axes}],{nowhere}];",
        *(
            f"CONST robtarget p{_krl(name)}:=[{frame(program.targets[name])},[0,0,0,0],{nowhere}];"
            for name in _used(program)
        ),
    ]
    body = [
        "ConfJ\\Off;",
        "ConfL\\Off;",
        f"VelSet {program.percent:g},5000;",
        "MoveAbsJ jStart,v200,fine,tTest;",
        *_Language(move, opening, lambda number, count: ["ENDFOR"]).lines(program.body),
        "VelSet 100,5000;",
    ]
    text = [
        f"MODULE {program.name}",
        "  ! tTest: give the mass and centre of gravity of your load before you drive",
        *(f"  {line}" for line in declared),
        f"  PROC run_{program.name}()",
        *(f"    {line}" for line in body),
        "  ENDPROC",
        "ENDMODULE",
    ]
    return {f"{program.name}.mod": _text(text, "\r\n")}


# ---- FANUC -------------------------------------------------------------------------------------------------


def _fanuc(program: Program) -> dict[str, str]:
    places = {name: number for number, name in enumerate(_used(program), 2)}
    mm = f"{max(1.0, round(1e3 * program.speed))}".removesuffix(".0")

    def move(one: Move) -> list[str]:
        target = f"P[{places[one.target]}]"
        text = {
            "joint": [f"J {target} {max(1, round(program.percent))}% FINE"],
            "line": [f"L {target} {mm}mm/sec FINE"],
            "arc": [f"C P[{places.get(one.via, 0)}]\n    :  {target} {mm}mm/sec FINE"],
        }[one.kind]
        return [*text, *([f"WAIT {one.dwell:7.2f}(sec)"] if one.dwell else [])]

    def opening(number: int, count: int) -> list[str]:
        return [f"R[{number}]=0", f"LBL[{number}]", f"R[{number}]=R[{number}]+1"]

    def closing(number: int, count: int) -> list[str]:
        return [f"IF R[{number}]<{count},JMP LBL[{number}]"]

    body = [
        "!tool 1 must hold the values below",
        *(f"!{text}" for text in _named("fanuc", program.tool, 3).split(", ")),
        "UFRAME_NUM=0",
        "UTOOL_NUM=1",
        "J P[1] 10% FINE",
        *_Language(move, opening, closing, indent="").lines(program.body),
    ]
    numbered = [f"{number:4d}:  {line}    ;" for number, line in enumerate(body, 1)]
    start = ",\n".join(
        "\t" + ",\t".join(f"J{k}= {math.degrees(q):.6f} deg" for k, q in group)
        for group in _grouped(list(enumerate(program.start, 1)), 3)
    )
    positions = [f"P[1]{{\n   GP1:\n\tUF : 0, UT : 1,\n{start}\n}};"]
    for name, number in places.items():
        x, y, z, w, p, r = _plain("fanuc", program.targets[name], 6)
        positions.append(
            f"P[{number}:\"{name[:16]}\"]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
            f"\tX = {x} mm,\tY = {y} mm,\tZ = {z} mm,\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg\n}};"
        )
    text = [
        f"/PROG  {program.name.upper()}",
        "/ATTR",
        'COMMENT\t\t= "test";',
        "DEFAULT_GROUP\t= 1,*,*,*,*;",
        "/MN",
        *numbered,
        "/POS",
        *positions,
        "/END",
    ]
    return {f"{program.name}.ls": _text(text, "\r\n")}


def _grouped(items: Sequence[tuple[int, float]], size: int) -> list[Sequence[tuple[int, float]]]:
    return [items[k : k + size] for k in range(0, len(items), size)]


# ---- Universal Robots --------------------------------------------------------------------------------------


def _ur(program: Program) -> dict[str, str]:
    def pose(T: Floats) -> str:
        return f"p[{', '.join(_plain('ur', T, 9))}]"

    def move(one: Move) -> list[str]:
        target = f"pose_{_krl(one.target)}"
        text = {
            "joint": f"movej({target}, a={_UR_JOINT}, v={math.pi * program.percent / 100:.6g})",
            "line": f"movel({target}, a={_UR_LINE}, v={program.speed:.6g})",
            "arc": f"movec(pose_{_krl(one.via)}, {target}, a={_UR_LINE}, v={program.speed:.6g}, mode=1)",
        }[one.kind]
        return [text, *([f"sleep({one.dwell:g})"] if one.dwell else [])]

    def opening(number: int, count: int) -> list[str]:
        return [f"n{number} = 0", f"while n{number} < {count}:"]

    def closing(number: int, count: int) -> list[str]:
        return [f"  n{number} = n{number} + 1", "end"]

    start = ", ".join(f"{q:.9f}" for q in program.start)
    text = [
        f"def {program.name}():",
        f"  set_tcp({pose(program.tool)})",
        *(f"  pose_{_krl(name)} = {pose(program.targets[name])}" for name in _used(program)),
        f"  movej([{start}], a={_UR_JOINT}, v=0.5)",
        *(f"  {line}" for line in _Language(move, opening, closing).lines(program.body)),
        "end",
        f"{program.name}()",
    ]
    return {f"{program.name}.script": _text(text, "\n")}


# ---- Yaskawa -----------------------------------------------------------------------------------------------


def _yaskawa(program: Program) -> dict[str, str]:
    places = {name: number for number, name in enumerate(_used(program))}

    def at(name: str) -> str:
        return f"C{places[name]:05d}"

    def move(one: Move) -> list[str]:
        percent, speed = f"VJ={program.percent:.2f}", f"V={1e3 * program.speed:.1f}"
        text = {
            "joint": [f"MOVJ {at(one.target)} {percent} PL=0"],
            "line": [f"MOVL {at(one.target)} {speed} PL=0"],
            "arc": [f"MOVC {at(name)} {speed} PL=0" for name in (one.start, one.via, one.target) if name],
        }[one.kind]
        return [*text, *([f"TIMER T={one.dwell:.2f}"] if one.dwell else [])]

    def opening(number: int, count: int) -> list[str]:
        return [f"SET I{number:03d} 0", f"*L{number}", f"INC I{number:03d}"]

    def closing(number: int, count: int) -> list[str]:
        return [f"JUMP *L{number} IF I{number:03d}<{count}"]

    name = program.name.upper()
    text = [
        "/JOB",
        f"//NAME {name}",
        "//POS",
        f"///NPOS {len(places)},0,0,0,0,0",
        "///TOOL 1",
        "///POSTYPE BASE",
        "///RECTAN",
        "///RCONF 0,0,0,0,0,0,0,0",
        *(f"{at(one)}={','.join(_jbi(program.targets[one]))}" for one in places),
        "//INST",
        "///ATTR SC,RW",
        "///GROUP1 RB1",
        "NOP",
        f"'TOOL 1: {' '.join(_jbi(program.tool))}",
        *_Language(move, opening, closing, indent="").lines(program.body),
        "END",
    ]
    return {f"{name}.JBI": _text(text, "\r\n")}


def _jbi(T: Floats) -> list[str]:
    """Thousandths of a millimetre and ten-thousandths of a degree, as controllers write them."""
    numbers = numbers_from_frame("yaskawa", T)
    return [_fixed(value, 3) for value in numbers[:3]] + [_fixed(value, 4) for value in numbers[3:]]


def _text(lines: Sequence[str], ending: str) -> str:
    return ending.join("\n".join(lines).split("\n")) + ending


_WRITERS: Mapping[Brand, Callable[[Program], dict[str, str]]] = {
    "kuka": _kuka,
    "abb": _abb,
    "fanuc": _fanuc,
    "ur": _ur,
    "yaskawa": _yaskawa,
}
