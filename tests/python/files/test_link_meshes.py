# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Meshes of a URDF's links stand where its links are, in few triangles, from no other place than its package;
whatever a mesh file holds, it stops nothing.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from browser import dom_of
from meshed_arm import ascii_stl, binary_stl, link, obj, tube, write_meshed_arm
from pages import LARGEST, faults_of
from truing.cli import main
from truing.files import looks_of
from truing.files.link_meshes import TRIANGLES, Looks, Mesh
from truing.report.arrays import unpacked

BASE, TURN, LIFT, BEND = range(-1, 3)


def looks(urdf: Path, base_link: str = "") -> Looks:
    found = looks_of(urdf, truing.load_robot(urdf, base_link), base_link)
    assert found is not None
    return found


def box(mesh: Mesh) -> list[list[float]]:
    return [mesh.points.min(axis=0).tolist(), mesh.points.max(axis=0).tolist()]


def test_every_kind_of_file_gives_the_same_triangles(tmp_path: Path) -> None:
    found = looks(write_meshed_arm(tmp_path / "arm"))
    assert [mesh.joint for mesh in found.meshes] == [BASE, TURN, LIFT, BEND] and found.note == ""
    for mesh, (radius, low, high) in zip(
        found.meshes, [(0.12, 0, 0.1), (0.07, 0, 0.34), (0.05, -0.04, 0.44), (0.04, -0.03, 0.35)], strict=True
    ):
        assert len(mesh.faces) == 4 * 24 and len(mesh.points) == 2 * 24 + 2  # shared corners are one point
        np.testing.assert_allclose(box(mesh), [[-radius, -radius, low], [radius, radius, high]], atol=1e-6)
        normals = np.cross(*(mesh.points[mesh.faces[:, k]] - mesh.points[mesh.faces[:, 0]] for k in (1, 2)))
        outward = mesh.points[mesh.faces].mean(axis=1) - [0, 0, (low + high) / 2]
        assert (np.sum(normals * outward, axis=1) > 0).all()


def test_what_is_bolted_to_a_link_moves_with_it_where_it_is_bolted(tmp_path: Path) -> None:
    urdf = write_meshed_arm(tmp_path / "arm", tool="tool.stl", base="", column="", upper="", lower="")
    (urdf.parent / "tool.stl").write_bytes(binary_stl(tube(0.02, 0.0, 0.1)))
    text = urdf.read_text()
    placed = '<origin xyz="0 0 0.01" rpy="0 0 0"/>'
    urdf.write_text(text.replace(link("tool", "tool.stl"), link("tool", "tool.stl", placed)))
    (mesh,) = looks(urdf).meshes
    assert mesh.joint == BEND  # along the tool's z, which is the link's x, 0.35 m above its joint
    np.testing.assert_allclose(box(mesh), [[0.01, -0.02, 0.33], [0.11, 0.02, 0.37]], atol=1e-6)
    from_column = looks(urdf, "column")
    assert [m.joint for m in from_column.meshes] == [1]


def test_a_mirrored_mesh_is_not_inside_out(tmp_path: Path) -> None:
    urdf = write_meshed_arm(tmp_path / "arm", column="", upper="", lower="")
    urdf.write_text(urdf.read_text().replace('base.stl"/>', 'base.stl" scale="1 1 -1"/>'))
    (mesh,) = looks(urdf).meshes
    assert box(mesh)[0][2] == pytest.approx(-0.1)
    normals = np.cross(*(mesh.points[mesh.faces[:, k]] - mesh.points[mesh.faces[:, 0]] for k in (1, 2)))
    assert (np.sum(normals * (mesh.points[mesh.faces].mean(axis=1) + [0, 0, 0.05]), axis=1) > 0).all()


def test_fine_meshes_are_made_coarser_and_keep_their_shape(tmp_path: Path) -> None:
    found = looks(write_meshed_arm(tmp_path / "arm", sides=2_000))
    count = sum(len(mesh.faces) for mesh in found.meshes)
    assert 0.3 * TRIANGLES < count <= TRIANGLES
    assert re.fullmatch(r"Meshes are drawn with \d \d{3} of 3\d \d{3} triangles\.", found.note)
    np.testing.assert_allclose(box(found.meshes[1]), [[-0.07, -0.07, 0], [0.07, 0.07, 0.34]], atol=2e-3)


SOUND = tube(0.1, 0.0, 0.2)
NAN = SOUND.copy()
NAN[3, 1, 2] = np.nan
BAD: dict[str, tuple[str, bytes]] = {
    "truncated": ("a.stl", binary_stl(SOUND)[:-20]),
    "cut in the header": ("a.stl", binary_stl(SOUND)[:60]),
    "four billion triangles": ("a.stl", binary_stl(SOUND, count=2**32 - 1)),
    "no triangles": ("a.stl", binary_stl(SOUND[:0])),
    "empty": ("a.stl", b""),
    "NaN": ("a.stl", binary_stl(NAN)),
    "as wide as a town": ("a.stl", binary_stl(1e5 * SOUND)),
    "an ascii NaN": ("a.stl", ascii_stl(NAN)),
    "ascii cut short": ("a.stl", ascii_stl(SOUND)[:-200]),
    "ascii words": ("a.stl", b"solid x\nvertex one two three\n"),
    "an ascii number too large": ("a.stl", ascii_stl(SOUND).replace(b"0.2", b"1e999")),
    "no STL": ("a.stl", b"<html>not found</html>"),
    "a corner that is not there": ("a.obj", obj(SOUND) + b"\nf 1 2 999999"),
    "a corner of 30 digits": ("a.obj", obj(SOUND) + b"\nf 1 2 " + b"9" * 30),
    "a corner zero": ("a.obj", obj(SOUND) + b"\nf 0 1 2"),
    "a point of two numbers": ("a.obj", obj(SOUND) + b"\nv 1 2"),
    "OBJ words": ("a.obj", b"v a b c\nf 1 2 3\n"),
    "COLLADA": ("a.dae", b"<COLLADA/>"),
    "a name with markup": ("<img src=x onerror=alert(1)>.stl", b""),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_damaged_mesh_is_left_out_and_named(kind: str, tmp_path: Path) -> None:
    name, data = BAD[kind]
    urdf = write_meshed_arm(tmp_path / "arm", base=name.replace("<", "&lt;"), upper="", lower="")
    (urdf.parent / name).write_bytes(data)
    found = looks(urdf)
    assert [mesh.joint for mesh in found.meshes] == [TURN]
    assert found.note.startswith("Drawn without their meshes: ") and name[-20:] in found.note


def test_a_scale_that_is_none_is_said(tmp_path: Path) -> None:
    urdf = write_meshed_arm(tmp_path / "arm")
    robot = truing.load_robot(urdf)
    urdf.write_text(urdf.read_text().replace('scale="0.001 0.001 0.001"', 'scale="1 1"'))
    found = looks_of(urdf, robot)
    assert found is not None and not found.meshes
    assert found.note == (
        "Drawn without meshes: an origin or a scale in 'arm.urdf': found '1 1', expected three numbers."
    )


@pytest.mark.parametrize(
    "name",
    ["{0}/secret.stl", "file://{0}/secret.stl", "../../secret.stl", "package://arm_description/../secret.stl",
     "package://other/secret.stl", "https://example.org/a.stl", "link.stl", "missing.stl", "fifo.stl", ".",
     "package://../secret.stl", "a\x01.stl".replace("\x01", "&#9;")],
)  # fmt: skip
def test_no_file_outside_the_package_is_read(name: str, tmp_path: Path) -> None:
    (tmp_path / "secret.stl").write_bytes(binary_stl(SOUND))
    urdf = write_meshed_arm(tmp_path / "arm", base=name.format(tmp_path), upper="", lower="")
    (urdf.parent / "link.stl").symlink_to(tmp_path / "secret.stl")
    os.mkfifo(urdf.parent / "fifo.stl")
    found = looks(urdf)
    assert [mesh.joint for mesh in found.meshes] == [TURN] and "Drawn without" in found.note


def test_without_a_package_only_the_urdfs_folder_counts(tmp_path: Path) -> None:
    urdf = write_meshed_arm(tmp_path / "arm")
    (tmp_path / "arm/package.xml").unlink()
    found = looks_of(urdf, truing.load_robot(urdf))
    assert found is not None and not found.meshes and found.note.count(";") == 3
    (tmp_path / "arm").rename(tmp_path / "arm_description")  # a package may be known by its folder's name
    urdf = tmp_path / "arm_description/urdf/arm.urdf"
    assert [mesh.joint for mesh in looks(urdf).meshes] == [BASE, LIFT, BEND]


def test_collision_meshes_are_drawn_where_visual_ones_cannot_be_read(
    tmp_path: Path,
) -> None:
    urdf = write_meshed_arm(tmp_path / "arm", base="a.dae", column="", upper="", lower="")
    simple = '<collision><geometry><mesh filename="../meshes/base.stl"/></geometry></collision></link>'
    urdf.write_text(urdf.read_text().replace("</visual></link>", f"</visual>{simple}"))
    found = looks(urdf)
    assert [mesh.joint for mesh in found.meshes] == [BASE] and found.note == ""


def test_robots_without_meshes_have_no_looks(tmp_path: Path) -> None:
    urdf = write_meshed_arm(tmp_path / "arm", base="", column="", upper="", lower="")
    robot = truing.load_robot(urdf)
    assert looks_of(urdf, robot) is None and looks_of(None, robot) is None
    truing.save_robot(tmp_path / "arm.yaml", robot)
    assert looks_of(tmp_path / "arm.yaml", robot) is None
    assert looks_of(tmp_path / "gone.urdf", robot) is None


# ---- Reports -------------------------------------------------------------------------------------


def scene_of(page: str) -> dict[str, Any]:
    found = re.search(r'id="scenes">(.*?)</script>', page, flags=re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1])[0]["robot"])


def test_reports_draw_the_meshes_and_stay_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    urdf = str(write_meshed_arm(tmp_path / "arm", sides=2_000, base="<img src=x>.stl".replace("<", "&lt;")))
    assert main(["simulate", urdf, "--poses", "60", "--seed", "1", "--out", "sim"]) == 0
    Path("targets.csv").write_text("x_m,y_m,z_m\n0.3,0.1,0.6\n0.2,-0.2,0.7\n")
    runs = {
        "identify": ["identify", urdf, "sim/measurements.csv"],
        "diagnose": ["diagnose", urdf, "sim/measurements.csv"],
        "ik": ["ik", urdf, "targets.csv", "--task", "point"],
        "compensate": ["compensate", urdf, "identify/robot.yaml", "targets.csv", "--task", "point"],
    }
    for name, arguments in runs.items():
        assert main([*arguments, "--out", name]) in (0, 1)
        page = Path(name, "report.html").read_text(encoding="utf-8")
        assert list(faults_of(page)) == [] and len(page) < LARGEST
        meshes = scene_of(page)["meshes"]
        assert [mesh["joint"] for mesh in meshes] == [TURN, LIFT, BEND]
        faces = unpacked(meshes[0]["faces"])
        assert faces.max() * 3 + 2 < unpacked(meshes[0]["points"]).size and faces.size % 3 == 0
        note = re.search('<p class="note">(Meshes are drawn with .*?)</p>', page)
        assert note is not None and "&lt;img src=x&gt;.stl" in note[1]


def test_a_browser_draws_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    urdf = str(write_meshed_arm(tmp_path / "arm"))
    assert main(["simulate", urdf, "--poses", "60", "--seed", "1", "--out", "sim"]) == 0
    assert main(["identify", urdf, "sim/measurements.csv", "--out", "found"]) == 0
    dom = dom_of(Path("found/report.html"))
    assert 'class="scene cloud drawn"' in dom and "<canvas" in dom
