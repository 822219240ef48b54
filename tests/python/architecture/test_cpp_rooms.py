# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The rooms of the C++ library, over every #include: a room knows only those below it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SOURCE, INCLUDE = ROOT / "cpp" / "src", ROOT / "cpp" / "include"

# Which rooms a room of cpp/src may include from, itself aside. A folder inside a room belongs to it.
ROOMS = {
    "kernel": set[str](),
    "math": set[str](),
    "model": {"math"},
    "estimation": {"math", "kernel", "model"},
    "identification": {"math", "kernel", "model", "estimation"},
    "planning": {"math", "kernel", "model", "estimation"},
    "diagnosis": {"math", "kernel", "model", "estimation"},
    "inverse_kinematics": {"math", "model"},
    "dynamics": {"math", "kernel", "model", "estimation"},
    "hand_eye": {"math"},
    "tracking": {"math"},
}

# The public headers that a room may see.
COMMON, MODEL = ("truing/common/", "truing/version.hpp"), "truing/model/"
PUBLIC_OF = {
    "kernel": (),
    "math": COMMON,
    "model": (*COMMON, MODEL),
    "estimation": (*COMMON, MODEL),
    "identification": (*COMMON, MODEL, "truing/identify.hpp", "truing/review.hpp", "truing/fleet.hpp"),
    "planning": (*COMMON, MODEL, "truing/identify.hpp", "truing/diagnose.hpp", "truing/plan.hpp"),
    "diagnosis": (*COMMON, MODEL, "truing/identify.hpp", "truing/diagnose.hpp"),
    "inverse_kinematics": (
        *COMMON,
        MODEL,
        "truing/identify.hpp",
        "truing/diagnose.hpp",
        "truing/inverse.hpp",
        "truing/compensate.hpp",
    ),
    "dynamics": (*COMMON, MODEL, "truing/identify.hpp", "truing/diagnose.hpp", "truing/dynamics/"),
    "hand_eye": (*COMMON, MODEL, "truing/identify.hpp", "truing/handeye.hpp"),
    "tracking": (
        *COMMON,
        MODEL,
        "truing/identify.hpp",
        "truing/handeye.hpp",
        "truing/inverse.hpp",
        "truing/tracking/",
    ),
}

# A public header belongs to the room whose folder or verb it names.
ROOM_OF_PUBLIC = {
    "truing/identify.hpp": "identification",
    "truing/review.hpp": "identification",
    "truing/fleet.hpp": "identification",
    "truing/diagnose.hpp": "diagnosis",
    "truing/plan.hpp": "planning",
    "truing/inverse.hpp": "inverse_kinematics",
    "truing/compensate.hpp": "inverse_kinematics",
    "truing/handeye.hpp": "hand_eye",
}

# Which files may include what comes from elsewhere.
ONLY_IN = {
    "ceres/": {"estimation/ceres_solver.cpp", "hand_eye/images.cpp"},
    "urdf_": {"model/urdf.cpp"},
    "console_bridge/": {"model/urdf.cpp"},
    "tinyxml2": {"model/urdf.cpp"},
    "thread": {"estimation/evaluate.cpp", "diagnosis/weigh.cpp", "math/batch.cpp"},
    "iostream": set[str](),  # the library prints nothing
}
INCLUDE_LINE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
OF_KERNEL = {"kernel.hpp", "rigid.hpp", "drive.hpp", "lanes.hpp", "laws.hpp"}
STANDARD = re.compile(r"[a-z_]+")  # <vector>; but not <ceres/ceres.h>


def sources() -> dict[str, Path]:
    """Every file of cpp/src by the name that an #include gives it."""
    return {path.relative_to(SOURCE).as_posix(): path for path in SOURCE.rglob("*.[ch]pp")}


def public_headers() -> dict[str, Path]:
    """Every public header by the name that an #include gives it."""
    found = {path.relative_to(INCLUDE).as_posix(): path for path in INCLUDE.rglob("*.hpp")}
    return {**found, "truing/version.hpp": INCLUDE / "truing" / "version.hpp.in"}


def room_of(file: str) -> str:
    """The room of a file of cpp/src or of a public header."""
    if not file.startswith("truing/"):
        return file.split("/")[0]
    if file.startswith(COMMON):
        return "math"
    if file.startswith(MODEL):
        return "model"
    if file.startswith(("truing/tracking/", "truing/dynamics")):
        return file.removesuffix(".hpp").split("/")[1]
    return ROOM_OF_PUBLIC[file]


def includes(path: Path) -> Iterator[tuple[str, str]]:
    """'<' or '"', and the name, of every #include."""
    for match in INCLUDE_LINE.finditer(path.read_text(encoding="utf-8")):
        yield match[1], match[2]


@pytest.mark.parametrize("file", sorted(sources()))
def test_a_room_includes_only_those_below_it(file: str) -> None:
    if file == "rooms.hpp":
        return
    room = room_of(file)
    assert room in ROOMS, (
        f"{file} is in no room: give its folder a line, here and in docs/method/architecture.md"
    )
    for bracket, name in includes(sources()[file]):
        if name == "rooms.hpp" or name in OF_KERNEL:
            continue
        if name in public_headers():
            assert name.startswith(PUBLIC_OF[room] or ("-",)), (
                f"{file} ({room}) includes {name} of a higher room"
            )
        elif name in sources():
            assert room_of(name) in {room, *ROOMS[room]}, (
                f"{file} ({room}) includes {name}: rooms meet through public headers"
            )
        else:
            assert bracket == "<", (
                f'{file}: "{name}" is no file of ours; what comes from elsewhere stands in < >'
            )


def test_every_room_has_a_folder_a_namespace_and_no_file_lies_beside_them() -> None:
    assert {path.name for path in SOURCE.iterdir()} == {*ROOMS, "rooms.hpp"}
    declared = set(
        re.findall(r"^namespace (\w+) \{", (SOURCE / "rooms.hpp").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert declared == {*ROOMS, "truing"}


@pytest.mark.parametrize("file", sorted(file for file in sources() if file.endswith(".hpp")))
def test_an_internal_header_declares_its_names_in_the_namespace_of_its_room(file: str) -> None:
    text = sources()[file].read_text(encoding="utf-8")
    if file != "rooms.hpp":
        assert f"namespace truing::{room_of(file)} {{" in text, (
            f"{file}: its names would meet those of other rooms"
        )


def test_the_compiler_sees_the_same_rooms_as_this_table() -> None:
    text = (SOURCE / "rooms.hpp").read_text(encoding="utf-8")
    for room, below in ROOMS.items():
        body = re.search(rf"^namespace {room} \{{(.*?)\}}", text, re.MULTILINE | re.DOTALL)
        assert body, room
        assert set(re.findall(r"using namespace (\w+);", body[1])) == below - {"kernel"}, f"rooms.hpp, {room}"


@pytest.mark.parametrize("file", sorted(file for file in sources() if file.startswith("kernel/")))
def test_the_kernel_knows_nothing_of_what_uses_it(file: str) -> None:
    for _, name in includes(sources()[file]):
        known = name in OF_KERNEL or STANDARD.fullmatch(name)
        assert known, f"{file} includes {name}: raw pointers and the standard library are all there is here"


@pytest.mark.parametrize("file", sorted(set(public_headers()) - {"truing/truing.hpp"}))
def test_a_public_header_shows_its_users_eigen_and_lower_public_headers_alone(file: str) -> None:
    for _, name in includes(public_headers()[file]):
        if name.startswith("truing/"):
            assert name.startswith(PUBLIC_OF[room_of(file)]), f"{file} includes {name} of a higher room"
        else:
            assert name.startswith("Eigen/") or STANDARD.fullmatch(name), (
                f"{file} includes {name}: users would need it"
            )


def test_truing_hpp_has_every_public_header() -> None:
    names = {name for _, name in includes(public_headers()["truing/truing.hpp"])}
    common = {name for name in public_headers() if name.startswith("truing/common/")}  # come with the others
    assert names == set(public_headers()) - {"truing/truing.hpp"} - common - {
        "truing/model/parameter_selection.hpp"
    }


@pytest.mark.parametrize("dependency", sorted(ONLY_IN))
def test_a_dependency_is_known_to_few_files(dependency: str) -> None:
    users = {
        file
        for file, path in sources().items()
        if any(name.startswith(dependency) for _, name in includes(path))
    }
    assert users <= ONLY_IN[dependency], (
        f"<{dependency}…> belongs into {sorted(ONLY_IN[dependency]) or 'no file'}"
    )
