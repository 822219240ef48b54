# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs of five makers written and read without truing's readers: what a controller would do with them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TOOL = {"xyz": (0.03, -0.02, 0.12), "turn": 30.0}  # [m], [deg] about y
FRAME = {"xyz": (0.6, -0.2, 0.1), "turn": 20.0}  # [m], [deg] about z


def about(axis: str, degrees: float) -> Floats:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    R = np.eye(4)
    a, b = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R[a, a], R[a, b], R[b, a], R[b, b] = c, -s, s, c
    return R


def moved(xyz: Sequence[float]) -> Floats:
    T = np.eye(4)
    T[:3, 3] = xyz
    return T


T_FLANGE_TOOL = moved(TOOL["xyz"]) @ about("y", TOOL["turn"])
T_BASE_FRAME = moved(FRAME["xyz"]) @ about("z", FRAME["turn"])


def euler(T: Floats) -> list[float]:
    """X Y Z [mm] and the turns about z, y, x [deg]."""
    z = math.degrees(math.atan2(T[1, 0], T[0, 0]))
    y = math.degrees(math.atan2(-T[2, 0], math.hypot(T[0, 0], T[1, 0])))
    x = math.degrees(math.atan2(T[2, 1], T[2, 2]))
    return [*(1e3 * T[:3, 3]), z, y, x]


def from_euler(n: Sequence[float]) -> Floats:
    return moved(np.array(n[:3]) / 1e3) @ about("z", n[3]) @ about("y", n[4]) @ about("x", n[5])


def quaternion(T: Floats) -> list[float]:
    """x y z [mm] and q1 to q4; by the largest of the four, as every textbook has it."""
    R = T[:3, :3]
    four = np.array(
        [
            1 + R[0, 0] + R[1, 1] + R[2, 2],
            1 + R[0, 0] - R[1, 1] - R[2, 2],
            1 - R[0, 0] + R[1, 1] - R[2, 2],
            1 - R[0, 0] - R[1, 1] + R[2, 2],
        ]
    )
    k = int(np.argmax(four))
    w, x, y, z = (
        (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]),
        R[1, 0] + R[0, 1],
        R[0, 2] + R[2, 0],
        R[2, 1] + R[1, 2],
    )
    rows = [(four[0], *w), (w[0], four[1], x, y), (w[1], x, four[2], z), (w[2], y, z, four[3])]
    q = np.array(rows[k]) / (2 * math.sqrt(four[k]))
    return [*(1e3 * T[:3, 3]), *q]


def from_quaternion(n: Sequence[float]) -> Floats:
    w, x, y, z = np.array(n[3:]) / np.linalg.norm(n[3:])
    T = moved(np.array(n[:3]) / 1e3)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return T


def rotation_vector(T: Floats) -> list[float]:
    w, *xyz = quaternion(T)[3:]
    axis = np.array(xyz)
    return [*T[:3, 3], *(axis / np.linalg.norm(axis) * 2 * math.atan2(np.linalg.norm(axis), w))]


def from_rotation_vector(n: Sequence[float]) -> Floats:
    angle = float(np.linalg.norm(n[3:]))
    axis = np.array(n[3:]) / angle
    q = [math.cos(angle / 2), *(axis * math.sin(angle / 2))]
    return from_quaternion([*(1e3 * np.array(n[:3])), *q])


def listed(values: Sequence[float], digits: int) -> str:
    return ",".join(f"{value:.{digits}f}" for value in values)


def krl(T: Floats, names: str = "XYZABC") -> str:
    return "{" + ",".join(f"{name} {value:.4f}" for name, value in zip(names, euler(T), strict=True)) + "}"


# ---- Writing ---------------------------------------------------------------------------------------------
# poses: T_frame_tool of the targets. joints [deg] of all targets, those of moves by joints first.


def write_kuka(joints: Floats, poses: Sequence[Floats]) -> str:
    lines = ["DEF sim()", f"$BASE={krl(T_BASE_FRAME)}", f"$TOOL={krl(T_FLANGE_TOOL)}"]
    count = len(joints) - len(poses)
    for q in joints[:count]:
        lines.append("PTP {" + ",".join(f"A{k + 1} {a:.5f}" for k, a in enumerate(q)) + "}")
    for q, T in zip(joints[count:], poses, strict=True):
        status = 2 + 4 * int(q[4] <= 0)  # in front, the forearm bent down
        turn = sum(1 << k for k in range(6) if q[k] < 0)
        lines.append(f"PTP {krl(T)[:-1]},S {status},T {turn}}}")
    return "\r\n".join([*lines, "END", ""])


def write_abb(joints: Floats, poses: Sequence[Floats]) -> str:
    def placed(T: Floats) -> str:
        n = quaternion(T)
        return f"[{listed(n[:3], 4)}],[{listed(n[3:], 9)}]"

    nothing = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"
    lines = [
        "MODULE sim",
        f"  PERS tooldata torch:=[TRUE,[{placed(T_FLANGE_TOOL)}],[1,[0,0,1],[1,0,0,0],0,0,0]];",
        f'  PERS wobjdata table:=[FALSE,TRUE,"",[{placed(T_BASE_FRAME)}],[[0,0,0],[1,0,0,0]]];',
        "  PROC main()",
    ]
    count = len(joints) - len(poses)
    lines += [f"    MoveAbsJ [[{listed(q, 5)}],{nothing}],v100,fine,torch;" for q in joints[:count]]
    for q, T in zip(joints[count:], poses, strict=True):
        turns = [math.floor(q[k] / 90) for k in (0, 3, 5)]
        cf = ",".join(map(str, [*turns, int(q[4] < 0)]))
        lines.append(f"    MoveL [{placed(T)},[{cf}],{nothing}],v100,fine,torch\\WObj:=table;")
    return "\n".join([*lines, "  ENDPROC", "ENDMODULE", ""])


def write_fanuc(joints: Floats, poses: Sequence[Floats]) -> str:
    count = len(joints) - len(poses)
    moves = [f"{k + 1:4d}:{'J' if k < count else 'L'} P[{k + 1}] 100% FINE ;" for k in range(len(joints))]
    blocks = []
    for k, q in enumerate(joints[:count]):
        shown = [*q[:2], q[2] - q[1], *q[3:]]  # J3 counts from the horizon
        values = ",\t".join(f"J{i + 1}= {a:9.3f} deg" for i, a in enumerate(shown))
        blocks.append(f"P[{k + 1}]{{\n   GP1:\n\tUF : 2, UT : 3,\t\n\t{values}\n}};")
    for k, (q, T) in enumerate(zip(joints[count:], poses, strict=True), start=count):
        n = euler(T)
        turns = ", ".join(str(round(q[i] / 360)) for i in (3, 4, 5))
        flip = "F" if q[4] >= 0 else "N"
        named = zip("XYZWPR", (*n[:3], *n[:2:-1]), strict=True)
        values = ",\t".join(f"{w} = {v:9.3f} {'mm' if w in 'XYZ' else 'deg'}" for w, v in named)
        blocks.append(
            f"P[{k + 1}]{{\n   GP1:\n\tUF : 2, UT : 3,\tCONFIG : '{flip} U T, {turns}',\n\t{values}\n}};"
        )
    return "\n".join(["/PROG  SIM", "/ATTR", "/MN", *moves, "/POS", *blocks, "/END", ""])


def write_yaskawa(joints: Floats, poses: Sequence[Floats]) -> str:
    lines, moves = ["/JOB", "//NAME SIM", "//POS", f"///NPOS {len(joints)},0,0,0,0,0"], []
    count = len(joints) - len(poses)
    lines += ["///TOOL 3", "///POSTYPE PULSE", "///PULSE"]
    for k, q in enumerate(joints[:count]):
        lines.append(f"C{k:05d}={listed(q * PULSES, 0)}")
    lines += ["///USER 2", "///TOOL 3", "///POSTYPE USER", "///RECTAN"]
    for k, (q, T) in enumerate(zip(joints[count:], poses, strict=True), start=count):
        n = euler(T)
        flip = int(not -90 < q[3] <= 90)
        lines.append(f"///RCONF {flip},0,0,0,{int(abs(q[5]) > 180)},0,0,0")
        lines.append(f"C{k:05d}={listed(n[:3], 3)},{listed(n[:2:-1], 4)}")
    moves = [f"MOVJ C{k:05d} VJ=10.00" for k in range(len(joints))]
    return "\r\n".join([*lines, "//INST", "///ATTR SC,RW", "///GROUP1 RB1", "NOP", *moves, "END", ""])


def write_ur(joints: Floats, poses: Sequence[Floats]) -> str:
    count = len(joints) - len(poses)
    lines = ["def sim():", f"  set_tcp(p[{listed(rotation_vector(T_FLANGE_TOOL), 9)}])"]
    lines += [f"  movej([{listed(np.radians(q), 6)}], a=1.2, v=0.25)" for q in joints[:count]]
    for q, T in zip(joints[count:], poses, strict=True):
        near = f"qnear=[{listed(np.radians(q), 6)}]"
        lines.append(f"  movej(get_inverse_kin(p[{listed(rotation_vector(T), 6)}], {near}), a=1.2)")
    return "\n".join([*lines, "end", "sim()", ""])


PULSES = np.array([1908.0, 1592.9, -1022.9, 980.2, 454.8, -400.0])  # per degree
WRITERS = {
    "kuka": write_kuka,
    "abb": write_abb,
    "fanuc": write_fanuc,
    "yaskawa": write_yaskawa,
    "ur": write_ur,
}
SUFFIX = {"kuka": ".src", "abb": ".mod", "fanuc": ".LS", "yaskawa": ".JBI", "ur": ".script"}

# ---- Reading: joints [deg] and poses of moves, in their order --------------------------------------------

_N = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"


def _numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(_N, text)]


def read_back(brand: str, text: str) -> tuple[list[Floats], list[Floats]]:
    """Joints [deg] and T_frame_tool of a program that a writer above wrote, whatever its numbers are now."""
    if brand == "kuka":
        joints = [np.array(_numbers(re.sub(r"A\d ", "", m))) for m in re.findall(r"PTP \{(A1[^}]*)\}", text)]
        poses = [
            from_euler(_numbers(re.sub(r"[STXYZABC] ", "", m))[:6])
            for m in re.findall(r"PTP \{(X[^}]*)\}", text)
        ]
    elif brand == "abb":
        joints = [np.array(_numbers(m)) for m in re.findall(r"MoveAbsJ \[\[([^\]]*)\]", text)]
        poses = [
            from_quaternion(_numbers(a + "," + b))
            for a, b in re.findall(r"MoveL \[\[([^\]]*)\],\[([^\]]*)\]", text)
        ]
    elif brand == "fanuc":
        joints = [np.array(_numbers(re.sub(r"J\d=", "", m))) for m in re.findall(r"(J1=.*)", text)]
        joints = [np.array([*q[:2], q[2] + q[1], *q[3:]]) for q in joints]
        rows = [_numbers(m) for m in re.findall(r"(X =.*)", text)]
        poses = [from_euler([*n[:3], *n[:2:-1]]) for n in rows]
    elif brand == "yaskawa":
        rows = [_numbers(m) for m in re.findall(r"C\d{5}=(.*)", text)]
        joints = [np.array(n) / PULSES for n in rows if all(v == int(v) for v in n)]
        poses = [from_euler([*n[:3], *n[:2:-1]]) for n in rows if any(v != int(v) for v in n)]
    else:
        joints = [np.degrees(_numbers(m)) for m in re.findall(r"movej\(\[([^\]]*)\]", text)]
        poses = [
            from_rotation_vector(_numbers(m)) for m in re.findall(r"get_inverse_kin\(p\[([^\]]*)\]", text)
        ]
    return joints, poses
