# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A URDF of three joints whose links have meshes, and mesh files as they are and as they should not be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

URDF = """<robot name="meshed">
{links}
<joint name="turn" type="revolute"><parent link="base"/><child link="column"/><origin xyz="0 0 0.1"/>
<axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>
<joint name="lift" type="revolute"><parent link="column"/><child link="upper"/><origin xyz="0 0 0.3"/>
<axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="bolted" type="fixed"><parent link="lower"/><child link="tool"/>
<origin xyz="0 0 0.35" rpy="0 1.5707963267948966 0"/></joint>
</robot>
"""
LINKS = ("base", "column", "upper", "lower", "tool")


def tube(radius: float, low: float, high: float, sides: int = 24) -> Floats:
    """Triangles of a closed cylinder along z, shape=(n, 3, 3) [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle])
    bottom, top = ring + [0, 0, low], ring + [0, 0, high]
    faces = []
    for k in range(sides):
        faces += [(bottom[k], bottom[k + 1], top[k + 1]), (bottom[k], top[k + 1], top[k])]
        faces += [([0, 0, low], bottom[k + 1], bottom[k]), ([0, 0, high], top[k], top[k + 1])]
    return np.array(faces, dtype=np.float64)


def binary_stl(faces: Floats, count: int | None = None) -> bytes:
    """`count`: what the file says that it has."""
    rows = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = faces
    said = len(faces) if count is None else count
    return b"solid or not".ljust(80, b"\0") + said.to_bytes(4, "little") + rows.tobytes()


def ascii_stl(faces: Floats) -> bytes:
    each = ("\n".join(f"vertex {x:.6g} {y:.6g} {z:.6g}" for x, y, z in face) for face in faces)
    text = "\n".join(f"facet normal 0 0 0\nouter loop\n{face}\nendloop\nendfacet" for face in each)
    return f"solid link\n{text}\nendsolid link\n".encode()


def obj(faces: Floats) -> bytes:
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in faces.reshape(-1, 3)]
    lines += [f"f {3 * k + 1}//1 {3 * k + 2}//1 {3 * k + 3}//1" for k in range(len(faces))]
    return "\n".join(["# a link", *lines]).encode()


def link(name: str, file: str, more: str = "") -> str:
    if not file:
        return f'<link name="{name}"/>'
    return f'<link name="{name}"><visual>{more}<geometry><mesh filename="{file}"/></geometry></visual></link>'


def write_meshed_arm(package: Path, sides: int = 24, **files: str) -> Path:
    """The arm in a package, its meshes in millimetres where it says so. `files`: names of links' meshes
    instead of the usual ones; "" for none. Returns the URDF's path.
    """
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    (package / "package.xml").write_text("<package><name>arm_description</name></package>")
    (package / "meshes/base.stl").write_bytes(binary_stl(tube(0.12, 0.0, 0.1, sides)))
    (package / "meshes/column.STL").write_bytes(ascii_stl(tube(0.07, 0.0, 0.34, sides)))
    (package / "meshes/upper.obj").write_bytes(obj(tube(0.05, -0.04, 0.44, sides)))
    (package / "meshes/lower.stl").write_bytes(binary_stl(1e3 * tube(0.04, -0.03, 0.35, sides)))
    named = {name: f"package://arm_description/meshes/{name}.stl" for name in ("base", "lower")}
    named |= {
        "column": "../meshes/column.STL",
        "upper": "package://arm_description/meshes/upper.obj",
        "tool": "",
    }
    named |= files
    links = [link(name, named[name]) for name in LINKS]
    text = URDF.format(links="\n".join(links))
    if "lower" not in files:
        text = text.replace('lower.stl"/>', 'lower.stl" scale="0.001 0.001 0.001"/>')
    (package / "urdf/arm.urdf").write_text(text)
    return package / "urdf/arm.urdf"
