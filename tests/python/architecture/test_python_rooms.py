# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The rooms of the Python package, checked over every import: a room knows only what is below it.

Imports inside functions and those for type checking count as well.
"""

from __future__ import annotations

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[3] / "python" / "truing"

# Which rooms a room may import, besides itself. A room is a folder or a single file of the package; "truing"
# stands for the names of the package itself.
BASIC = {
    "_core",
    "_keywords",
    "errors",
    "effects",
    "keywords",
    "rotations",
    "files",
    "report",
    "limits",
    "drawing",
}
ROOMS: dict[str, set[str]] = {
    "errors": {"_core"},
    "effects": {"_core", "errors"},
    "keywords": {"effects"},
    "rotations": set(),
    "chains": {"_core", "rotations"},
    "limits": set(),
    "common": {"_core"},
    "model": {"_core"},
    "examples": set(),
    "report": set(),
    "drawing": {"_core", "report", "files"},
    "files": {"_core", "errors", "limits", "rotations"},
    "identification": BASIC,
    "planning": BASIC | {"identification"},
    "diagnosis": BASIC | {"identification"},
    "fleet": BASIC | {"identification"},
    "hand_eye": BASIC | {"identification"},
    "inverse_kinematics": BASIC,
    "programs": BASIC | {"inverse_kinematics", "model"},
    "dynamics": BASIC | {"identification", "chains"},
    "controllers": BASIC | {"identification", "chains"},
    "performance": BASIC | {"identification", "inverse_kinematics", "programs"},
    "tracking": BASIC | {"hand_eye"},
    "testing": BASIC,
    "exam": {"truing", "model", "report"},  # of both only what test_exam.py allows
}
ROOMS["public"] = set(ROOMS) - {"exam"}
ROOMS["truing"] = {"public"}
ROOMS["cli"] = set(ROOMS) - {"public"}
ROOMS["__main__"] = {"cli"}

# Rooms in which every module has its place, from the ground up: each may import those before it.
FLOORS = {
    "files": [
        "output",
        "common",
        "brand_frames",
        "programs",
        "table",
        "yaml_tree",
        "plausibility",
        "rigid",
        "tags",
        "boards",
        "opencv_file",
        "visp_file",
        "flange",
        "program_poses",
        "other_poses",
        "handeye_answer",
        "handeye_file",
        "mjcf_file",
        "arms",
        "controller_parts",
        "ur_file",
        "abb_file",
        "lerobot_calibration",
        "robot_file",
        "link_meshes",
        "measurement_file",
        "gram_file",
        "performance_file",
        "recording_parts",
        "recording_table",
        "recording_bag",
        "recording_lerobot",
        "recording_rtde",
        "recording_file",
        "residual_file",
        "scene_file",
        "stream_file",
        "target_file",
        "uncertainty_file",
    ],
    "files/programs": ["text", "model", "flow", "krl", "rapid", "fanuc", "urscript", "inform", "reading"],
    "exam": [
        "robots",
        "kinematics",
        "laws",
        "machine_laws",
        "surprises",
        "design",
        "physics",
        "worlds",
        "sizing",
        "recordings",
        "confounded",
        "names",
        "scenes",
        "families",
        "field_families",
        "numbering",
        "sets",
        "answers",
        "score",
        "sealing",
        "workers",
        "builds",
        "sitting",
        "run",
        "dynamics",
        "page",
        "result",
    ],
    "exam/dynamics": [
        "robots",
        "bodies",
        "motions",
        "physics",
        "laws",
        "noise",
        "sizing",
        "departures",
        "recordings",
        "scenes",
        "spike_in",
        "families",
        "servo",
        "sets",
        "answers",
        "servo_score",
        "score",
        "run",
    ],
    "exam/dynamics/servo": ["arms", "courses", "firmware", "effects", "sizing", "stage", "families"],
}

# Packages that are slow to import, or belong to one job: which rooms may import them.
ONLY_IN = {
    "yaml": {"files", "testing"},
    "pydantic": {"files"},
    "pydantic_core": {"files"},
    "pyarrow": {"files"},
    "typer": {"cli"},
    "rich": {"cli"},
    "mujoco": {"exam", "files", "dynamics"},
    "cv2": {"files"},
    "rosbags": {"files"},
    "dask": {"fleet"},
    "distributed": {"fleet"},
}

FILES = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*.py")}
MODULES = {
    ".".join(["truing", *file.removesuffix(".py").removesuffix("__init__").strip("/").split("/")]).rstrip(
        "."
    ): file
    for file in FILES
}


def room_of(module: str) -> str:
    """truing.files.table -> files; a name of the package itself -> truing."""
    words = module.split(".")
    return words[1] if len(words) > 1 and words[1] in {*ROOMS, "_core", "_keywords"} else "truing"


def module_of(name: str) -> str:
    """The module that an imported name is in: truing.files.table.Table -> truing.files.table."""
    while name not in MODULES and "." in name:
        name = name.rpartition(".")[0]
    return name


def imports(file: str) -> Iterator[str]:
    """The full name of everything that is imported anywhere in a file."""
    for node in ast.walk(ast.parse(FILES[file].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: write imports out, from truing…"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def ours(file: str) -> Iterator[str]:
    return (name for name in imports(file) if name.split(".")[0] == "truing")


@pytest.mark.parametrize(("module", "file"), sorted(MODULES.items()))
def test_a_module_imports_only_rooms_below_its_own(module: str, file: str) -> None:
    room = room_of(module)
    for name in ours(file):
        assert room_of(name) in ROOMS[room] | {room}, f"{file} imports {name}"


def test_every_room_has_its_place() -> None:
    there = {file.split("/")[0].removesuffix(".py") for file in FILES} - {"__init__"}
    assert there == set(ROOMS) - {"truing"}, (
        "a new room gets its place here and in docs/method/architecture.md"
    )


def test_rooms_do_not_import_in_a_circle() -> None:
    graphlib.TopologicalSorter({room: below - {"truing"} for room, below in ROOMS.items()}).prepare()


def test_modules_do_not_import_in_a_circle() -> None:
    graphlib.TopologicalSorter(
        {module: {module_of(name) for name in ours(file)} - {"truing"} for module, file in MODULES.items()}
    ).prepare()


@pytest.mark.parametrize("file", sorted(file for file in FILES if file.endswith("/page.py")))
def test_a_page_knows_plain_data_only(file: str) -> None:
    for name in ours(file):
        module = module_of(name)
        plain = room_of(module) in ("report", "rotations") or module.endswith(".page")
        assert plain, (
            f"{file} imports {name}: a page is made from the result's dictionary and tables of numbers"
        )


@pytest.mark.parametrize("file", sorted(FILES))
def test_heavy_packages_stay_where_they_are_needed(file: str) -> None:
    room = file.split("/")[0].removesuffix(".py")
    for name in imports(file):
        package = name.split(".")[0]
        if package in ONLY_IN:
            assert room in ONLY_IN[package], f"{file} imports {package}"
        else:
            known = {"truing", "numpy", *sys.stdlib_module_names}
            if name == "typing_extensions.Unpack":  # for type checkers alone, which bring it
                continue
            assert package in known, f"{file} imports {package}: a new dependency?"


@pytest.mark.parametrize("room", sorted(FLOORS))
def test_a_module_imports_only_those_below_it_in_its_room(room: str) -> None:
    floors = FLOORS[room]
    depth = room.count("/") + 1
    there = {file.split("/")[depth] for file in FILES if file.startswith(f"{room}/")} - {"__init__.py"}
    expected = {module if f"{room}/{module}" in FLOORS else f"{module}.py" for module in floors}
    assert there == expected, "a new module gets its floor here"
    inside = ["truing", *room.split("/")]
    for floor, module in enumerate(floors):
        if f"{room}/{module}" in FLOORS:  # a room within, with floors of its own
            below = {name for file in FILES if file.startswith(f"{room}/{module}/") for name in ours(file)}
            allowed = floors[: floor + 1]
        else:
            below, allowed = set(ours(f"{room}/{module}.py")), floors[:floor]
        for name in below:
            words = name.split(".")
            if words[: len(inside)] == inside:
                assert (words[len(inside)] if len(words) > len(inside) else "") in allowed, (
                    f"{room}/{module} imports {name}"
                )
